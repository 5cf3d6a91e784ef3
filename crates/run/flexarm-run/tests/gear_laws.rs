//! Hysteresis and transmission error of a gear, from the robot file to its laws.

use flexarm_run::{Error, Robot};
use flexarm_stepping::{Hysteresis, Slider};

use crate::small_robots::{refusal, two_joints};

const ARCSEC: f64 = std::f64::consts::PI / 648_000.0;
const ARCMIN: f64 = 60.0 * ARCSEC;

/// A robot whose first gear has a stiffness of 1e6 N m/rad and these other properties.
fn geared(drive: &str, gearbox: &str) -> Result<Robot, Error> {
    two_joints(&format!(
        "[[drive]]\njoint = \"a\"\nkind = \"gearbox\"\n{drive}gearbox = {{ stiffness = 1.0e6, {gearbox} }}\n"
    ))
}

fn hysteresis(entry: &str) -> Hysteresis {
    let robot = geared("", &format!("hysteresis = {{ {entry} }}")).unwrap();
    robot.drives[0].gearbox.as_ref().unwrap().1.hysteresis.clone().unwrap().law
}

/// Middle line and width of the loop at a torque, by bisection on the branches of a cycle
/// between ±`far`.
fn branches(law: &Hysteresis, far: f64, torque: f64) -> (f64, f64) {
    // Branch after a reversal at ±far (Masing): sliders at ±reach unload.
    let branch = |side: f64, d: f64| {
        let slid = |s: &Slider| s.stiffness * side * (s.reach - (far - side * d)).max(-s.reach);
        law.elastic.torque(d) + law.sliders.iter().map(slid).sum::<f64>()
    };
    let cross = |side: f64| {
        let (mut low, mut high) = (-far, far);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if branch(side, middle) < torque { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    };
    let (down, up) = (cross(1.0), cross(-1.0));
    (0.5 * (down + up), (down - up).abs())
}

/// Truth: definitions of the catalogue values. A gear of the 1.1 N m/arcsec class (typical of
/// cycloidal gears: 1 arcmin of hysteresis, 1 arcmin of lost motion at 3 % of 1570 N m) shows
/// them on its own loop, cycled to the rated torque.
#[test]
fn the_loop_of_a_gear_has_the_width_and_the_lost_motion_of_its_catalogue() {
    let stiffness = 1.0e6;
    let law = hysteresis("loss_arcmin = 1.0, lost_motion_arcmin = 0.8, rated_torque = 1570.0");
    let far = 1570.0 / stiffness + 4.0 * ARCMIN;
    let (_, width) = branches(&law, far, 0.0);
    assert!((width - ARCMIN).abs() < 1e-12, "{width}");
    let [low, high] = [-0.03, 0.03].map(|part| branches(&law, far, part * 1570.0).0);
    let off = (high - low) / (0.8 * ARCMIN) - 1.0;
    assert!(off.abs() < 1e-6, "{off:e}");
    // Without lost motion the loop has the same width at every torque far from the ends.
    let plain = hysteresis("loss = 2e-4, reach = 5e-5, sliders = 3");
    for torque in [-300.0, 0.0, 300.0] {
        assert!((branches(&plain, 2e-3, torque).1 - 2e-4).abs() < 1e-12);
    }
}

#[test]
fn what_makes_no_hysteresis_or_ripple_is_told() {
    let fails = |text: &str, other: &str, words: &str| {
        let fault = refusal(geared("", &format!("{other}hysteresis = {{ {text} }}")));
        assert!(fault.contains(words), "{text}: {fault}");
    };
    fails("", "", "loss_arcmin");
    fails("loss = 1e-4, loss_arcmin = 1.0", "", "both given");
    fails("loss = -1e-4", "", "-0.0001");
    fails("loss = 1e-4, lost_motion = 1e-3", "", "rated_torque");
    fails("loss = 1e-4, lost_motion = 1e-5, rated_torque = 1000.0", "", "less than");
    fails("loss = 1e-4, reach = 0.0", "", "reach");
    fails("loss = 1e-4, sliders = 0", "", "1 to 200");
    fails("loss = 1e-4", "backlash = 2e-3, ", "play");
    let ripple = |drive: &str, text: &str| geared(drive, &format!("transmission_error = [{{ {text} }}]"));
    for (text, words) in [
        ("per_joint_turn = 3", "amplitude"),
        ("amplitude = 1e-5", "per_motor_turn"),
        ("amplitude = 1e-5, per_motor_turn = 1", "ratio"),
        ("amplitude = 1e-5, per_joint_turn = -2", "positive"),
        ("amplitude = nan, per_joint_turn = 2", "NaN"),
    ] {
        let fault = refusal(ripple("", text));
        assert!(fault.contains(words), "{text}: {fault}");
    }
    let robot = ripple("ratio = -121.0\n", "amplitude_arcsec = 20.0, per_motor_turn = 2").unwrap();
    let found = robot.drives[0].gearbox.as_ref().unwrap().1.transmission[0];
    assert!((found.amplitude - 20.0 * ARCSEC).abs() < 1e-20 && found.cycles == 242.0);
}
