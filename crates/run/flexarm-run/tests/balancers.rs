//! Balancers of robot files: their effect in statics and runs, on flexible links, and the messages
//! of refusals.

use std::path::{Path, PathBuf};

use flexarm_kinematics::{BalancerLaw, Wrench};
use flexarm_run::{
    DriveModel, LinkModel, LoadOptions, Modelling, Motion, Robot, RobotBalancer, RunOptions, check, inspect,
};
use flexarm_stepping::StepperKind;

fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..").join(path)
}

/// Truth: the published formula of the counterbalance, pressure times area times lever, by hand at
/// three angles of joint 2.
#[test]
fn the_counterbalance_of_the_kr300_turns_joint_2_as_its_formula_says() {
    let robot = Robot::load(project("robots/kr300")).unwrap();
    let mut bare = robot.clone();
    bare.rigid.balancers.clear();
    for q2 in [-2.0, -1.5, -0.9f64] {
        let at = [0.3, q2, 1.2, -0.4, 0.5, 0.1];
        let with = inspect(&robot, Some(&at), None).unwrap();
        let without = inspect(&bare, Some(&at), None).unwrap();
        let (D, k, delta) = (0.8f64, 0.2, q2 + 1.6580627893946132);
        let L = (D * D + k * k - 2.0 * D * k * delta.cos()).sqrt();
        let area = std::f64::consts::PI / 4.0 * (0.055f64.powi(2) - 0.03f64.powi(2));
        let pressure = 1.01 * 296.8 * 328.0 * 0.159 / (0.00096 - (L - 0.6) * area);
        let torque = D * k * delta.sin() / L * pressure * area;
        let found = with.gravity_torque[1] - without.gravity_torque[1];
        // measured 2.1e-8 N m: rounding in the robot file
        assert!((found - torque).abs() < 1e-5, "{found} {torque}");
        let info = &with.balancers[0];
        assert!((info.length - L).abs() < 1e-10 && (info.torque[1] + torque).abs() < 1e-5);
        for k in [0, 2, 3, 4, 5] {
            assert!((with.gravity_torque[k] - without.gravity_torque[k]).abs() < 1e-9 && info.torque[k].abs() < 1e-9);
        }
        assert!(without.balancers.is_empty());
    }
}

/// A spring of 20 MN/m from the column to a point on the upper arm, unloaded at [`AT`].
fn strut(robot: &Robot, to: [f64; 3]) -> Robot {
    let with = |free: f64| {
        let law = BalancerLaw::Linear { rate: 2e7, free, preload: 0.0 };
        let strut = RobotBalancer::between("strut", ("link_1", [-0.5, 0.0, 0.2]), ("link_2", to), law);
        robot.clone().with_balancer(strut).unwrap()
    };
    with(inspect(&with(1.0), Some(&AT), None).unwrap().balancers[0].length)
}

const AT: [f64; 6] = [0.0, -1.1, 1.2, 0.0, 0.4, 0.0];

/// A strut at the far end of a link moves with the far end; attached to the near part it would
/// bypass the spring of the link. Truth: the compliance of the TCP decreases because the springs of
/// the link are supported, by the same 1.1 % in both models of the link; measured 1.3e-4 between
/// them.
#[test]
fn a_balancer_at_the_far_end_of_a_link_that_bends_holds_its_far_end() {
    let robot = Robot::load(project("robots/kr210/links.toml")).unwrap();
    let helped = strut(&robot, [1.1, 0.0, 0.0]);
    let softness = |robot: &Robot, links: LinkModel| {
        let modelling = Modelling { links, drives: DriveModel::Rigid, ..Modelling::default() };
        let arm = robot.model(&modelling).unwrap();
        let mut at = arm.operating_point().unwrap();
        at.solve(&AT, &Wrench::zeros()).unwrap();
        at.compliance()[(2, 2)]
    };
    let [lumped, modal] =
        [LinkModel::Lumped, LinkModel::Modal].map(|links| softness(&helped, links) / softness(&robot, links));
    assert!(lumped < 0.995 && (lumped / modal - 1.0).abs() < 1e-3, "{lumped} {modal}");
    // On the near part it does not affect the flexible link.
    let near = strut(&robot, [0.1, 0.0, 0.0]);
    let near = softness(&near, LinkModel::Lumped) / softness(&robot, LinkModel::Lumped);
    assert!((near - 1.0).abs() < 1e-3, "{near}");
}

/// Energy in equals energy stored and dissipated, in a run with the counterbalance; SPOOK compared
/// with generalised-alpha.
#[test]
fn a_run_of_the_kr300_keeps_the_books_with_its_counterbalance() {
    let robot = Robot::load(project("robots/kr300")).unwrap();
    let motion = Motion::load(robot.default_trajectory.clone().unwrap(), &robot).unwrap();
    let arm = robot.model(&Modelling::default()).unwrap();
    let spook = StepperKind::Spook(flexarm_stepping::SpookSettings::default());
    let options = |stepper| RunOptions { stepper, log_rate_hz: 1000.0, ..RunOptions::default() };
    let alpha = arm.simulate(&motion, &options(StepperKind::default())).unwrap();
    assert!(alpha.summary.caveats.iter().all(|c| c.code != "energy-open"), "{:?}", alpha.summary.caveats);
    let spook = arm.simulate(&motion, &options(spook)).unwrap();
    let [a, b] = [&alpha, &spook].map(|run| run.summary.tcp.as_ref().unwrap().peak_m);
    // measured 1.1983 and 1.1980 mm
    assert!(a > 3e-4 && (a / b - 1.0).abs() < 5e-3, "{a} {b}");
}

/// Returns the message for the robot of the examples with an additional entry.
fn refused(entry: &str) -> String {
    let folder = std::env::temp_dir().join(format!("flexarm-balancers-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::copy(project("robots/kr210/kr210.urdf"), folder.join("kr210.urdf")).unwrap();
    let path = folder.join("robot.toml");
    std::fs::write(&path, format!("format = 1\nurdf = \"kr210.urdf\"\n\n[[balancer]]\nname = \"b\"\n{entry}\n"))
        .unwrap();
    let error = Robot::load(&path).map(|_| format!("accepted: {entry}")).unwrap_err().to_string();
    assert!(error.contains("robot.toml:"), "{error}");
    error
}

#[test]
fn what_no_balancer_is_is_refused_with_its_place_and_what_is_expected() {
    let ends = "from = { link = \"link_1\" }\nto = { link = \"link_2\", xyz = [0.0, 0.0, 0.3] }";
    let gas = "acts = \"pull\", pressure = 1e7, volume = 1e-3, length = 0.5";
    let over = "joint = \"joint_2\"";
    for (entry, words) in [
        (format!("{ends}\njoint = \"joint_2\"\nspring = {{ rate = 1.0, free_length = 0.1 }}"), "give one of these"),
        ("spring = { rate = 1.0, free_length = 0.1 }".into(), "from = { link, xyz }"),
        (ends.into(), "spring, gas, gas_spring or curve"),
        (over.into(), "spring, sine or curve"),
        (format!("{ends}\nspring = {{ rate = 1.0, free_length = 0.1 }}\ncurve = [[0.1, 1.0], [0.2, 2.0]]"), "keep one"),
        (
            format!("{ends}\nspring = {{ rate = -1.0, free_length = 0.1 }}"),
            "rate is -1, expected 0 or a positive number in N/m",
        ),
        (format!("{ends}\nspring = {{ rate = nan, free_length = 0.1 }}"), "rate is NaN"),
        (format!("{ends}\nspring = {{ rate = 1.0, free_angle = 0.1 }}"), "needs free_length"),
        (format!("{over}\nspring = {{ rate = 1.0, free_length = 0.1 }}"), "needs free_angle"),
        (format!("{over}\ngas = {{ {gas}, area = 1e-3 }}"), "acts between two points"),
        (format!("{ends}\nsine = {{ torque = 1.0, zero = 0.0 }}"), "acts over a joint"),
        (format!("{ends}\ngas = {{ {gas} }}"), "needs area"),
        (format!("{ends}\ngas = {{ {gas}, area = 1e-3, piston_diameter = 0.05 }}"), "needs area"),
        (
            format!("{ends}\ngas = {{ {gas}, piston_diameter = 0.05, rod_diameter = 0.06 }}"),
            "below the diameter of the piston",
        ),
        (format!("{ends}\ngas = {{ {gas}, area = 1e-3, exponent = 0.5 }}"), "exponent is 0.5, expected 1 to 2"),
        (format!("{ends}\ngas = {{ {gas}, area = 1e-3, ambient_pressure = 2e7 }}"), "below the pressure"),
        (format!("{ends}\ngas = {{ {}, area = 1e-3 }}", gas.replace("pull", "draw")), "expected \"pull\""),
        (
            format!("{ends}\ngas_spring = {{ force = 9e2, length = 0.5, stroke = 0.6, progression = 1.3 }}"),
            "below the extended length",
        ),
        (format!("{ends}\ngas_spring = {{ force = 9e2, length = 0.5, stroke = 0.2, progression = 0.7 }}"), "1 or more"),
        (format!("{ends}\ncurve = [[0.2, 1.0], [0.1, 2.0]]"), "must rise"),
        (format!("{over}\ncurve = [[0.2, 1.0]]"), "at least two points"),
        (
            format!("{}\nspring = {{ rate = 1.0, free_length = 0.1 }}", ends.replace("link_1", "ghost")),
            "\"ghost\" is not a link",
        ),
        (
            format!("{}\nspring = {{ rate = 1.0, free_length = 0.1 }}", ends.replace("link_1", "link_2")),
            "no joint moves link",
        ),
        ("joint = \"ghost\"\nspring = { rate = 1.0, free_angle = 0.1 }".into(), "no movable joint \"ghost\""),
        (format!("{ends}\nspring = {{ rate = 1.0, free_length = 0.1, force = 2.0 }}"), "force"),
    ] {
        let error = refused(&entry);
        assert!(error.contains(words), "{entry}\n{error}");
    }
}

/// A pose in which the gas has no volume is refused by every function, with length and end.
#[test]
fn a_pose_without_room_for_the_gas_is_refused() {
    let robot = Robot::load(project("robots/kr210")).unwrap();
    let gas = flexarm_kinematics::GasLaw { force: 1e3, opposing: 0.0, at: 0.5, slope: 2.0, exponent: 1.0, pulls: true };
    let balancer =
        RobotBalancer::between("b", ("link_1", [-0.9, 0.0, 0.0]), ("link_2", [0.0, 0.0, 0.9]), BalancerLaw::Gas(gas));
    let robot = robot.with_balancer(balancer.clone()).unwrap();
    let leaning = [0.0, 0.5, 0.5, 0.0, 0.0, 0.0];
    let error = inspect(&robot, Some(&leaning), None).unwrap_err().to_string();
    assert!(error.contains("has no room left above 1.0000 m"), "{error}");
    assert!(robot.model(&Modelling::default()).unwrap().statics(Some(&leaning), [0.0; 6]).is_err());
    let motion = Motion::from_samples(&[0.0, 1.0], &[leaning, leaning].concat(), &robot).unwrap();
    let arm = robot.model(&Modelling::default()).unwrap();
    let error =
        arm.simulate(&motion, &RunOptions { ignore_limits: true, ..RunOptions::default() }).unwrap_err().to_string();
    assert!(error.contains("at t = 0.000 s") && error.contains("no room"), "{error}");
    let error = robot.with_balancer(balancer).unwrap_err().to_string();
    assert!(error.ends_with("is defined twice: names must be unique"), "{error}");
}

#[test]
fn the_kr300_as_shipped_has_no_warnings() {
    let findings = check(&project("robots/kr300/robot.toml"), None, &LoadOptions::default());
    let loud: Vec<_> = findings.iter().filter(|f| f.severity != flexarm_run::Severity::Note).collect();
    assert!(loud.is_empty(), "{loud:#?}");
}
