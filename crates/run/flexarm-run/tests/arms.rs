//! Arms whose figures are published: what the program reads is what the maker publishes.

use std::path::{Path, PathBuf};

use flexarm_kinematics::JointKind;
use flexarm_run::Robot;
use nalgebra::{Matrix3, Rotation3, Vector3};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).unwrap().to_owned()
}

fn numbers(value: &toml::Value) -> Vec<f64> {
    let number = |v: &toml::Value| v.as_float().or(v.as_integer().map(|i| i as f64)).unwrap();
    value.as_array().unwrap().iter().map(number).collect()
}

/// Truth: the tables of `tests/arms`, which hold the figures of the makers' files with their
/// commits (`tools/make_arms.py --vendor` compares them).
#[test]
fn masses_inertias_frames_and_limits_are_those_that_the_makers_publish() {
    let tables: Vec<PathBuf> =
        std::fs::read_dir(root().join("tests/arms")).unwrap().map(|e| e.unwrap().path()).collect();
    assert!(tables.len() >= 12, "{}", tables.len());
    let mut largest: f64 = 0.0;
    for path in tables {
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let table: toml::Table = toml::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
        let mechanism = Robot::load(root().join("robots").join(&name)).unwrap().urdf.mechanism;
        for (link, row) in table["links"].as_table().unwrap() {
            let row = numbers(row);
            let read = mechanism.links.iter().find(|l| l.name == *link).unwrap().inertia.unwrap();
            let [xx, yy, zz, xy, xz, yz] = row[4..10] else { panic!("{name} {link}: ten numbers") };
            let turned = match row[10..] {
                [roll, pitch, yaw] => Rotation3::from_euler_angles(roll, pitch, yaw),
                _ => Rotation3::identity(),
            };
            let published = turned * Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) * turned.transpose();
            let com = Vector3::new(row[1], row[2], row[3]);
            let off = [
                (read.mass - row[0]).abs() / row[0],
                (read.com - com).norm(),
                (read.inertia_com - published).norm() / published.norm(),
            ];
            assert!(off.iter().all(|error| *error <= 1e-12), "{name} {link}: {off:?}");
            largest = off.iter().fold(largest, |a, b| a.max(*b));
        }
        for (joint, row) in table["joints"].as_table().unwrap().iter().filter(|(_, row)| row.get("axis").is_some()) {
            let read = mechanism.joints.iter().find(|j| j.name == *joint).unwrap();
            let (axis, limits) = (numbers(&row["axis"]), numbers(&row["limits"]));
            let JointKind::Revolute(found) = read.kind else { panic!("{name} {joint}: {:?}", read.kind) };
            assert!((found.into_inner() - Vector3::from_vec(axis).normalize()).norm() <= 1e-15, "{name} {joint}");
            let found = [read.limits.lower, read.limits.upper, read.limits.velocity, read.limits.effort];
            assert_eq!(found.as_slice(), limits, "{name} {joint}");
            let origin = numbers(&row["origin"]);
            let place = Vector3::new(origin[0], origin[1], origin[2]);
            let turned = Rotation3::from_euler_angles(origin[3], origin[4], origin[5]);
            let off =
                (read.X_PJ.translation.vector - place).norm() + (read.X_PJ.rotation.matrix() - turned.matrix()).norm();
            assert!(off <= 1e-12, "{name} {joint}: {off:.1e}");
        }
    }
    println!("largest difference of a mass, a centre of mass or an inertia {largest:.1e} (bound 1e-12)");
}
