//! The body of a link is the same however the link is modelled.

use std::path::Path;

use flexarm_kinematics::{Data, gravity_forces, mass_matrix};
use flexarm_run::{Description, *};
use nalgebra::{DMatrix, DVector};

/// A boom of 1 m, which may have a body of its own, and a tool of 2 kg at its end.
fn boom_urdf(inertial: &str) -> String {
    format!(
        r#"<robot name="arm"><link name="base"/>
  <joint name="lift" type="revolute"><parent link="base"/><child link="boom"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" velocity="5" effort="1000"/></joint>
  <link name="boom">{inertial}</link>
  <joint name="bolts" type="revolute"><parent link="boom"/><child link="tool"/><axis xyz="0 1 0"/>
    <origin xyz="1 0 0"/><limit lower="-3" upper="3" velocity="5" effort="1000"/></joint>
  <link name="tool"><inertial><mass value="2"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>"#
    )
}

fn boom(inertial: &str, keys: &str) -> Result<Robot, Error> {
    let text = format!(
        "format = 1\nurdf = \"arm.urdf\"\ntcp = {{ link = \"tool\" }}\n[[flexible_link]]\nlink = \"boom\"\n\
         beam = {{ section = \"box\", width = 0.06, height = 0.08, wall = 0.004, material = \"aluminium\"{keys} }}"
    );
    load(&text, &boom_urdf(inertial))
}

fn load(text: &str, urdf: &str) -> Result<Robot, Error> {
    let (path, options, description) =
        (Path::new("robot.toml"), &LoadOptions::default(), Some(Description::Text(urdf)));
    let source = RobotSource { text: Some(text), description, ..RobotSource::new(path, options) };
    source.load().map(|arm| arm.robot().clone())
}

fn inertial(x: f64, mass: f64, moment: f64) -> String {
    format!(
        r#"<inertial><origin xyz="{x} 0 0"/><mass value="{mass}"/>
        <inertia ixx="{moment}" iyy="{moment}" izz="{moment}" ixy="0" ixz="0" iyz="0"/></inertial>"#
    )
}

/// Holding torques, and mass matrix over the actuated joints, of the undeformed robot with its links
/// as asked.
fn undeformed(
    robot: &Robot,
    links: LinkModel,
    segments: Option<usize>,
    q: &[f64],
) -> Result<(DVector<f64>, DMatrix<f64>), Error> {
    let modelling = Modelling { links, segments, drives: DriveModel::Rigid, ..Modelling::default() };
    let model = robot.model(&modelling)?.model.clone();
    let (mut data, n) = (Data::new(&model), q.len());
    let full = DVector::from_fn(model.nv(), |i, _| q.get(i).copied().unwrap_or(0.0));
    let torques = gravity_forces(&model, &mut data, &full).rows(0, n).into_owned();
    Ok((torques, mass_matrix(&model, &mut data, &full).view((0, 0), (n, n)).into_owned()))
}

/// Maximum differences of holding torques and mass matrix from the robot with rigid links over a few
/// poses, relative to the largest entry. `None` if a link has no such model.
fn difference(robot: &Robot, links: LinkModel, segments: Option<usize>) -> Option<[f64; 2]> {
    let n = robot.rigid_model().unwrap().n_actuated();
    let mut worst = [0.0f64; 2];
    for k in 0..4 {
        let q: Vec<f64> = (0..n).map(|i| (1.3 * (i + 7 * k) as f64 + 0.4).sin()).collect();
        let (rigid, mass) = undeformed(robot, LinkModel::Rigid, None, &q).unwrap();
        let (found, parts) = undeformed(robot, links, segments, &q).ok()?;
        let size = rigid.amax().max(found.amax()).max(1e-9);
        worst = [worst[0].max((found - rigid).amax() / size), worst[1].max((parts - &mass).amax() / mass.amax())];
    }
    Some(worst)
}

/// Truth: the robot with rigid links. Bound 1e-8: a `.flex` file has ten digits.
#[test]
fn every_shipped_robot_keeps_mass_and_holding_torques_with_every_model_of_its_links() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../robots");
    let mut models = 0;
    let folders = [folder.clone(), folder.join("test")].into_iter().flat_map(|f| std::fs::read_dir(f).unwrap());
    let robots = folders.map(|entry| entry.unwrap().path().join("robot.toml"));
    for path in robots.filter(|path| path.is_file()).chain([folder.join("kr210/beams.toml")]) {
        let robot = Robot::load(&path).unwrap();
        for (links, segments) in [
            (LinkModel::AsFiled, None),
            (LinkModel::Lumped, None),
            (LinkModel::Lumped, Some(4)),
            (LinkModel::Modal, None),
        ] {
            let Some(worst) = difference(&robot, links, segments) else { continue };
            println!("{} {links:?} {segments:?}: {worst:?}", path.display());
            assert!(worst.iter().all(|d| *d < 1e-8), "{} {links:?} {segments:?}: {worst:?}", path.display());
            models += 1;
        }
    }
    assert!(models > 30, "{models}");
}

/// Truth: 2700 kg/m³ times 1.056e-3 m² times 1 m is 2.851 kg, and a tool of 2 kg at 1 m: 9.81 m/s²
/// times (0.5 * 2.851 + 2) kg m.
#[test]
fn a_link_without_inertia_has_the_mass_of_its_section_with_rigid_links_too() {
    let robot = boom("", "").unwrap();
    let truth = 9.80665 * (0.5 * 2700.0 * (0.06 * 0.08 - 0.052 * 0.072) + 2.0);
    for links in [LinkModel::Rigid, LinkModel::Lumped, LinkModel::Modal] {
        let (torques, _) = undeformed(&robot, links, None, &[0.0, 0.0]).unwrap();
        println!("{links:?}: {}", torques[0]);
        assert!((torques[0].abs() / truth - 1.0).abs() < 2e-3, "{links:?}: {} {truth}", torques[0]);
    }
    let worst = difference(&robot, LinkModel::Lumped, None).unwrap();
    assert!(worst.iter().all(|d| *d < 1e-12), "{worst:?}");
}

/// Truth: the robot with rigid links. A centre of mass near, before and beyond the ends of the link,
/// and moments of inertia below those of a beam. Measured 3e-16.
#[test]
fn links_heavy_at_one_end_keep_their_body_in_two_parts_in_chains_and_with_modes() {
    for (x, moment) in [(0.5, 0.8), (0.1, 0.8), (-0.1, 0.4), (1.1, 0.4), (0.5, 0.05), (0.2, 0.05)] {
        for keys in ["", ", parts = \"from-link\""] {
            let robot = boom(&inertial(x, 10.0, moment), keys).unwrap();
            for (links, segments) in [(LinkModel::Lumped, None), (LinkModel::Lumped, Some(5)), (LinkModel::Modal, None)]
            {
                let worst = difference(&robot, links, segments).unwrap();
                assert!(worst.iter().all(|d| *d < 1e-12), "{x} {moment} {links:?} {segments:?}: {worst:?}");
                assert!(!robot.caveats().iter().any(|caveat| caveat.code == "uniform-mass"));
            }
        }
    }
    let refused = boom(&inertial(0.5, 10.0, 1e-4), "").unwrap_err().to_string();
    assert!(refused.contains("boom") && refused.contains("parts = \"uniform\""), "{refused}");
}

/// Truth: the centre of mass moves from 0.1 m to 0.5 m: 10 kg times 9.81 m/s² times 0.4 m is
/// 39.2 N m.
#[test]
fn uniform_parts_that_move_the_mass_of_a_link_are_a_caveat_with_the_torque() {
    let uniform = ", parts = \"uniform\"";
    let code = |robot: &Robot| robot.caveats().into_iter().find(|caveat| caveat.code == "uniform-mass");
    let found = code(&boom(&inertial(0.1, 10.0, 0.8), uniform).unwrap()).unwrap();
    println!("{}", found.message);
    assert!(found.message.contains("0.4000 m") && found.message.contains("39.2 N m"), "{}", found.message);
    let compact = code(&boom(&inertial(0.5, 10.0, 0.2), uniform).unwrap()).unwrap();
    assert!(compact.message.contains('%'), "{}", compact.message);
    // A uniform link is its own uniform beam: ml²/12 is 0.833 kg m², and m (w² + h²)/12 about its axis.
    let own = r#"<inertial><origin xyz="0.5 0 0"/><mass value="10"/>
        <inertia ixx="0.0155" iyy="0.84" izz="0.84" ixy="0" ixz="0" iyz="0"/></inertial>"#;
    assert!(code(&boom(own, uniform).unwrap()).is_none());
}

/// Truth: the closed form of the beam, whose 6x6 the page of the robot file gives for a spring in the
/// middle and at a quarter. Measured 2e-15.
#[test]
fn the_springs_of_the_page_are_those_of_its_beam_in_the_middle_and_at_a_quarter() {
    let page =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../docs/robot-file.md")).unwrap();
    let springs: Vec<&str> =
        page.split("```toml\nstiffness = ").skip(1).map(|rest| rest.split("```").next().unwrap()).collect();
    assert_eq!(springs.len(), 2);
    for (split, spring) in [(0.5, springs[0]), (0.25, springs[1])] {
        let given = |stiffness: &str| {
            let text = format!(
                "format = 1\nurdf = \"arm.urdf\"\n[[flexible_link]]\nlink = \"boom\"\n{stiffness}\nbeam = {{ section = \
                 \"given\", EA = 4e7, EI_y = 2e5, EI_z = 2e5, GJ = 1.5e5, mass_per_length = 10.0, rotary_y = 0.01, \
                 rotary_z = 0.01, theory = \"euler-bernoulli\", split = {split}, roll = 0.3 }}"
            );
            let robot = load(&text, &boom_urdf("")).unwrap();
            robot.model(&Modelling::default()).unwrap().modes(Some(&[0.0, 0.0]), None, 6).unwrap().frequencies_hz
        };
        let (own, filed) = (given(&format!("stiffness = {spring}")), given(""));
        for (a, b) in own.iter().zip(&filed) {
            assert!((a / b - 1.0).abs() < 1e-12, "{own:?} {filed:?}");
        }
    }
}
