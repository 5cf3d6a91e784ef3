//! Entries of a link's matrix and the tool in files of measurements: results are written to the
//! place of the original values.

use std::path::{Path, PathBuf};

use flexarm_identify::{IdentifyRequest, identify_robot, parameters_like};
use flexarm_kinematics::Wrench;
use flexarm_run::{LinkModel, Modelling, Robot};
use flexarm_sensitivity::pose_sensitivity;
use nalgebra::{Matrix6, Rotation3, Translation3, Vector3};

struct Place(PathBuf);

impl Place {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("flexarm-entries-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _gone = std::fs::remove_dir_all(&self.0);
    }
}

/// The shipped robot file with its paths made absolute.
fn kr210() -> String {
    let home = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../robots/kr210").canonicalize().unwrap();
    let text = std::fs::read_to_string(home.join("robot.toml")).unwrap();
    let absolute = |text: String, key: &str, path: &str| {
        text.replace(&format!("{key} = \"{path}"), &format!("{key} = \"{}/{path}", home.display()))
    };
    let text = absolute(absolute(text, "urdf", "kr210.urdf"), "reduced", "fe/");
    absolute(text, "default_trajectory", "../../")
}

fn robot(text: &str, folder: &Path) -> Robot {
    std::fs::write(folder.join("robot.toml"), text).unwrap();
    Robot::load(folder).unwrap()
}

const LINK: &str = "link = \"link_2\"\n";

fn with_stiffness(K: &Matrix6<f64>) -> String {
    let rows: Vec<Vec<f64>> = (0..6).map(|i| K.row(i).iter().copied().collect()).collect();
    kr210().replace(LINK, &format!("{LINK}stiffness = {rows:?}\n"))
}

/// The matrix of link_2 in the shipped file.
fn matrix(robot: &Robot) -> Matrix6<f64> {
    let arm = robot.model(&Modelling::default()).unwrap();
    let mut K = Matrix6::zeros();
    for p in parameters_like(&arm, "link.link_2.stiffness[*][*]") {
        let digits: Vec<usize> = p.name.chars().filter_map(|c| c.to_digit(10)).map(|d| d as usize).collect();
        let (i, j) = (digits[1], digits[2]);
        (K[(i, j)], K[(j, i)]) = (p.initial, p.initial);
    }
    K
}

fn poses() -> Vec<[f64; 6]> {
    (0..12)
        .map(|k| {
            let angle = |j: usize| 0.5 * (1.3 * f64::from(k) + 2.1 * j as f64).sin();
            let middle = [0.0, -0.9, 1.2, 0.3, 0.5, 0.2];
            std::array::from_fn(|j| middle[j] + angle(j))
        })
        .collect()
}

/// Truth: a robot file with that matrix, whose equilibria are measured. Two entries are identified,
/// written, and read again.
#[test]
fn the_coupling_of_shear_and_bending_is_found_and_written_into_the_robot_file() {
    let place = Place::new("coupling");
    let first = robot(&kr210(), &place.0);
    let K = matrix(&first);
    let mut other = K;
    let size = |i: usize, j: usize| (K[(i, i)] * K[(j, j)]).sqrt();
    // The plane in which gravity bends the link, for any naming of its axes.
    let (row, column) = if K[(0, 0)] < K[(2, 2)] { (0, 4) } else { (1, 5) };
    let name = format!("link.link_2.stiffness[{column}][{row}]");
    other[(row, column)] += 0.15 * size(row, column);
    other[(column, row)] = other[(row, column)];
    other[(column, column)] *= 0.8;
    let measured = Place::new("measured");
    let arm = robot(&with_stiffness(&other), &measured.0).model(&Modelling::default()).unwrap();
    let mut at = arm.operating_point().unwrap();
    let mut text = "format = 1\n".to_owned();
    for (k, q) in poses().iter().enumerate() {
        let force = [-Vector3::z(), Vector3::x(), Vector3::y()][k % 3] * 2000.0;
        let mut pose = |force| {
            at.solve(q, &Wrench::new(force, Vector3::zeros())).unwrap();
            at.tcp_pose().translation.vector
        };
        let d = pose(force) - pose(Vector3::zeros());
        text += &format!(
            "[[displacement]]\njoints = {q:?}\nload = {{ force = {:?} }}\nvalue = {:?}\nstd = 3e-5\n",
            <[f64; 3]>::from(force),
            <[f64; 3]>::from(d)
        );
    }
    std::fs::write(place.0.join("job.toml"), &text).unwrap();
    let output = place.0.join("new");
    let fit = vec![name.clone(), format!("link.link_2.stiffness[{column}][{column}]")];
    let request = IdentifyRequest { fit, output: Some(output.clone()), ..IdentifyRequest::default() };
    let found = identify_robot(&first, &place.0.join("job.toml"), &request).unwrap();
    assert_eq!(found.parameters.len(), 2);
    for (p, (i, j)) in found.parameters.iter().zip([(row, column), (column, column)]) {
        eprintln!("{}: {:.6e} of {:.6e} +- {:.1e} {}", p.name, p.value, other[(i, j)], p.std, p.unit);
        assert!(p.identifiable && (p.value - other[(i, j)]).abs() < 0.05 * p.std, "{}", p.name);
    }
    let new = Robot::load(&output).unwrap();
    let off = (matrix(&new) - other).abs();
    let std = found.parameters.iter().map(|p| p.std).fold(0.0, f64::max);
    assert!(off.max() < 0.05 * std, "{off}");
    // Both names of an entry are accepted; an additional factor would duplicate it.
    let request = IdentifyRequest { fit: vec![name, "link.link_2.*".into()], ..IdentifyRequest::default() };
    let error = identify_robot(&first, &place.0.join("job.toml"), &request).unwrap_err().to_string();
    assert!(error.contains("describe the same stiffness") && error.contains("link.link_2.stiffness_factor"), "{error}");
}

/// Truth: a robot file with a changed entry, by statics; compared with the derivative of the entry
/// by `sensitivity`.
#[test]
fn an_entry_in_the_robot_file_does_what_its_derivative_says() {
    let place = Place::new("derivative");
    let K = matrix(&robot(&kr210(), &place.0));
    let at = [0.0, -1.2, 1.5, 0.0, 0.4, 0.0];
    let by = ["link.link_2.stiffness[*][*]".to_owned()];
    let here = robot(&with_stiffness(&K), &place.0);
    let found = pose_sensitivity(&here, Modelling::default(), Some(&at), &by).unwrap();
    assert_eq!(found.parameters.len(), 21);
    let largest = found.parameters.iter().max_by(|a, b| a.tcp_m[2].abs().total_cmp(&b.tcp_m[2].abs())).unwrap();
    let own = found.parameters.iter().filter(|p| p.name.ends_with("[0][4]") || p.name == largest.name);
    for p in own {
        let digits: Vec<usize> = p.name.chars().filter_map(|c| c.to_digit(10)).map(|d| d as usize).collect();
        let (i, j) = (digits[1], digits[2]);
        let sag = |h: f64| {
            let mut changed = K;
            changed[(i, j)] += h * (K[(i, i)] * K[(j, j)]).sqrt();
            changed[(j, i)] = changed[(i, j)];
            let robot = robot(&with_stiffness(&changed), &place.0);
            robot.model(&Modelling::default()).unwrap().statics(Some(&at), [0.0; 6]).unwrap().sag_m[2]
        };
        let difference = (8.0 * (sag(0.01) - sag(-0.01)) - (sag(0.02) - sag(-0.02))) / 12.0;
        eprintln!("{}: slope {:.9e}, difference {difference:.9e}", p.name, p.tcp_m[2]);
        assert!((difference - p.tcp_m[2]).abs() < 1e-5 * largest.tcp_m[2].abs(), "{}", p.name);
    }
    // Entries are included only if they are named.
    let all = pose_sensitivity(&here, Modelling::default(), Some(&at), &["*".to_owned()]).unwrap();
    assert!(all.parameters.iter().all(|p| !p.name.contains("][")));
}

#[test]
fn a_matrix_that_is_no_stiffness_is_refused_with_what_is_wrong() {
    let place = Place::new("wrong");
    let K = matrix(&robot(&kr210(), &place.0));
    let changed = |change: &dyn Fn(&mut Matrix6<f64>)| {
        let mut other = K;
        change(&mut other);
        std::fs::write(place.0.join("robot.toml"), with_stiffness(&other)).unwrap();
        Robot::load(&place.0)
    };
    let size = (K[(1, 1)] * K[(5, 5)]).sqrt();
    let odd = changed(&|K| K[(1, 5)] += 0.1 * size).unwrap_err().to_string();
    assert!(odd.contains("robot.toml:") && odd.contains("[1][5] is") && odd.contains("symmetric"), "{odd}");
    let wild = |K: &mut Matrix6<f64>| (K[(1, 5)], K[(5, 1)]) = (1.2 * size, 1.2 * size);
    let wild = changed(&wild).unwrap_err().to_string();
    assert!(wild.contains("not positive definite") && wild.contains("[1][5]") && wild.contains("1.2000"), "{wild}");
    let none = changed(&|K| K[(2, 2)] = 0.0).unwrap_err().to_string();
    assert!(none.contains("[2][2] is 0, expected a positive number"), "{none}");
    let modal = Modelling { links: LinkModel::Modal, ..Modelling::default() };
    let error = changed(&|_| {}).unwrap().model(&modal).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("one spring between two rigid parts"), "{error}");
}

/// Truth: a robot whose tool is elsewhere, observed at its equilibria; the tool is identified,
/// written, and read again.
#[test]
fn a_tool_that_is_elsewhere_is_found_from_places_and_written_into_the_robot_file() {
    let place = Place::new("tool");
    let first = robot(&kr210(), &place.0);
    let (link, X_LT) = first.tcp();
    let (link, X_LT) = (link.to_owned(), *X_LT);
    let shift = flexarm_kinematics::Pose::from_parts(
        Translation3::new(0.004, -0.003, 0.006),
        Rotation3::new(Vector3::new(0.01, -0.02, 0.015)),
    );
    let moved = first.clone().with_tcp(&link, X_LT * shift).unwrap();
    let arm = moved.model(&Modelling::default()).unwrap();
    let mut at = arm.operating_point().unwrap();
    let mut text = "format = 1\nfit = [\"tcp.*\"]\n[instrument.tracker]\nxyz = [0, 0, 0]\n".to_owned();
    for (name, xyz) in [("a", [0.0, 0.0, 0.0]), ("b", [0.2, 0.0, 0.0]), ("c", [0.0, 0.2, 0.1])] {
        text += &format!("[target.{name}]\nxyz = {xyz:?}\n");
        for q in poses().iter().take(4) {
            at.solve(q, &Wrench::zeros()).unwrap();
            let X = at.tcp_pose();
            let seen: [f64; 3] = (X.translation.vector + X.rotation * Vector3::from(xyz)).into();
            text += &format!("[[place]]\ntarget = \"{name}\"\njoints = {q:?}\nvalue = {seen:?}\nstd = 2e-5\n");
        }
    }
    // Tables of one kind are grouped in a file, regardless of their order here.
    std::fs::write(place.0.join("job.toml"), &text).unwrap();
    let output = place.0.join("new");
    let request = IdentifyRequest { output: Some(output.clone()), ..IdentifyRequest::default() };
    let found = identify_robot(&first, &place.0.join("job.toml"), &request).unwrap();
    let truth = [0.004, -0.003, 0.006, 0.01, -0.02, 0.015];
    for (p, truth) in found.parameters.iter().zip(truth) {
        eprintln!("{}: {:.9} of {truth} +- {:.1e} {}", p.name, p.value, p.std, p.unit);
        assert!(p.identifiable && (p.value - truth).abs() < 0.02 * p.std, "{}: {}", p.name, p.value);
    }
    let new = Robot::load(&output).unwrap();
    let (now, before) = (new.tcp().1, moved.tcp().1);
    let apart = (now.translation.vector - before.translation.vector).norm();
    let turned = (now.rotation.inverse() * before.rotation).angle();
    eprintln!("written and read: {apart:.1e} m, {turned:.1e} rad");
    // The pull of the prior.
    assert!(new.tcp().0 == link && apart < 5e-6 && turned < 5e-6, "{apart:e} {turned:e}");
    // A tool chosen instead of the file's cannot be written into the file.
    let error = identify_robot(&moved, &place.0.join("job.toml"), &IdentifyRequest::default()).unwrap_err().to_string();
    assert!(error.contains("chosen as the TCP at loading"), "{error}");
}

/// Truth: the same tool in the robot file.
#[test]
fn moving_the_tool_of_a_loaded_robot_moves_the_answer_as_another_robot_file_does() {
    let place = Place::new("with_tcp");
    let at = [0.3, -1.2, 1.5, 0.2, 0.4, -0.5];
    let of = |robot: &Robot| {
        robot.model(&Modelling::default()).unwrap().statics(Some(&at), [0.0, 0.0, -500.0, 0.0, 0.0, 0.0]).unwrap()
    };
    let old = "xyz = [0.0, 0.0, 0.35]";
    let text = kr210();
    assert!(text.contains(old));
    let filed = robot(&text.replace(old, "xyz = [0.1, -0.2, 0.5]"), &place.0);
    let first = robot(&text, &place.0);
    let before = of(&first);
    let (link, X_LT) = (first.tcp().0.to_owned(), *filed.tcp().1);
    let moved = first.with_tcp(&link, X_LT).unwrap();
    let [a, b] = [&moved, &filed].map(of);
    assert_eq!((a.sag_m, &a.compliance, a.tcp_displacement_m), (b.sag_m, &b.compliance, b.tcp_displacement_m));
    assert!(before.compliance != a.compliance);
    let error = moved.clone().with_tcp("lnk", X_LT).unwrap_err().to_string();
    assert!(error.contains("lnk") && error.contains("link_2"), "{error}");
    let nowhere = flexarm_kinematics::Pose::translation(f64::NAN, 0.0, 0.0);
    assert!(moved.with_tcp(&link, nowhere).unwrap_err().to_string().contains("finite"));
}
