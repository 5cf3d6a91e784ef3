//! Commands for the reference arm in motion, compared with forward integration of its linear
//! equations of motion.

use std::sync::Arc;

use flexarm_analysis::{Inversion, Node, NodeServo};
use flexarm_kinematics::{Data, Frame, Model, Wrench, mass_matrix};
use flexarm_stepping::{Damping, Held, Plant, Servo, ServoAxis, linearise};
use flexarm_testkit::reference_arm;
use nalgebra::{DMatrix, DVector};

const POSE: [f64; 6] = [0.4, 0.5, -0.3, 0.7, 0.6, -1.2];

fn plant() -> (Plant, Frame) {
    let reference = reference_arm(true);
    let model = Arc::new(Model::new(&reference.mechanism).expect("valid"));
    let spring = |name: &str, k: usize| (name.to_owned(), reference.K_S[k], Damping::StiffnessProportional(2e-3));
    let tool = model.frame("tcp").expect("there").clone();
    let springs = vec![spring("lower", 0), spring("upper", 1)];
    (Plant::new(model, springs, Arc::new(Held(POSE.to_vec()))).expect("valid"), tool)
}

/// Truth: forward integration of the linear equations by the trapezoidal rule.
#[test]
fn commands_by_the_series_of_the_inverse_move_the_tool_as_asked_at_a_third_of_the_first_frequency() {
    let (plant, tool) = plant();
    let at = linearise(&plant, &tool, &Wrench::zeros(), 0.0).unwrap();
    let six = |M: &nalgebra::Matrix6xX<f64>| DMatrix::from_fn(6, M.ncols(), |i, j| M[(i, j)]);
    let node = Node {
        M: at.M.clone(),
        D: at.D.clone(),
        K: at.K.clone(),
        M_a: at.M_a.clone(),
        D_a: at.D_a.clone(),
        K_a: at.K_a.clone(),
        J: six(&at.J),
        J_a: six(&at.J_a),
        servo: None,
    };
    let hz = plant.modes.frequencies_hz()[0];
    let (length, h) = (3.0, 2.5e-4);
    let N = (length / h) as usize + 1;
    // A smooth bump with vibration, at rest at both ends.
    let wave = |t: f64| {
        let s: f64 = (t / length * std::f64::consts::PI).sin();
        s.powi(8) * (std::f64::consts::TAU * hz / 3.0 * t).cos()
    };
    let size = [2e-3, -1e-3, 1.5e-3, 1e-3, 2e-3, -1e-3];
    let y = DMatrix::from_fn(6, N, |i, k| size[i] * wave(h * k as f64));
    let inversion = Inversion::new(&[node.clone(), node.clone()], length).unwrap();
    let u = inversion.commands(&y, h);
    let shown = forwards(&node, &u, h);
    let error = (&shown - &y).amax() / y.amax();
    // The residual of one application is corrected by a second one.
    let more = inversion.commands(&(&y - &shown), h);
    let twice = &u + more;
    let twice = (forwards(&node, &twice, h) - &y).amax() / y.amax();
    // A static inverse would omit the inertia.
    let G = &node.J_a - &node.J * node.K.clone().lu().solve(&node.K_a).unwrap();
    let rest = G.try_inverse().unwrap() * &y;
    let as_at_rest = (forwards(&node, &rest, h) - &y).amax() / y.amax();
    let cutoff = inversion.cutoff_hz();
    eprintln!(
        "first frequency {hz:.2} Hz, cutoff {cutoff:.1}; left {error:.1e}, {twice:.1e}, with commands as at rest {as_at_rest:.1e}"
    );
    // The arm with its TCP held has its first frequency at 25 Hz.
    assert!((1.2 * hz..25.0).contains(&cutoff), "{cutoff}");
    assert!(error < 1e-2 && twice < 0.1 * error, "{error:e} {twice:e}");
    assert!(as_at_rest > 10.0 * error);
}

/// Truth: forward integration of the closed loop, which `linearise` derives independently from the
/// same servos; two joints follow their commands exactly, two of the others have no feed-forward.
/// Without integrators, so that the loop is of second order.
#[test]
fn commands_of_servos_move_the_tool_as_asked_far_above_their_position_gains() {
    let (plant, tool) = plant();
    let rigid = Arc::new(Model::new(&reference_arm(false).mechanism).expect("valid"));
    let M = mass_matrix(&rigid, &mut Data::new(&rigid), &DVector::from_column_slice(&POSE)).clone();
    let axis = |(i, coordinate): (usize, usize)| ServoAxis {
        coordinate,
        position_gain: 15.0,
        velocity_gain: 60.0 * M[(coordinate, coordinate)],
        integral_gain: 0.0,
        feed_forward: f64::from(u8::from(i % 2 == 0)),
        limit: f64::INFINITY,
    };
    let axes = [0, 1, 2, 4].into_iter().enumerate().map(axis).collect();
    let plant = plant.with_servo(Servo { sample_s: 1e-3, axes, rigid }).unwrap();
    let servo = plant.servo.clone().unwrap();
    let of = |value: fn(&ServoAxis) -> f64| DVector::from_iterator(4, servo.axes.iter().map(value));
    let controllers = NodeServo {
        axes: servo.axes.iter().map(|axis| axis.coordinate).collect(),
        stiffness: of(|axis| axis.velocity_gain * axis.position_gain),
        damping: of(|axis| axis.velocity_gain),
        integral: DVector::zeros(4),
        ahead: servo.fed_forward(&POSE, &plant.friction),
    };
    let node = |plant: &Plant, servo: Option<NodeServo>| {
        let at = linearise(plant, &tool, &Wrench::zeros(), 0.0).unwrap();
        let six = |M: &nalgebra::Matrix6xX<f64>| DMatrix::from_fn(6, M.ncols(), |i, j| M[(i, j)]);
        let (J, J_a) = (six(&at.J), six(&at.J_a));
        Node { M: at.M, D: at.D, K: at.K, M_a: at.M_a, D_a: at.D_a, K_a: at.K_a, J, J_a, servo }
    };
    let (open, closed) = (node(&plant.with_servo_opened(), Some(controllers)), node(&plant, None));
    let (length, h, hz) = (3.0, 2.5e-4, 4.0);
    let N = (length / h) as usize + 1;
    let wave = |t: f64| (t / length * std::f64::consts::PI).sin().powi(8) * (std::f64::consts::TAU * hz * t).cos();
    let size = [2e-3, -1e-3, 1.5e-3, 1e-3, 2e-3, -1e-3];
    let y = DMatrix::from_fn(6, N, |i, k| size[i] * wave(h * k as f64));
    let inversion = Inversion::new(&[open.clone(), open.clone()], length).unwrap();
    let u = inversion.commands(&y, h);
    let shown = forwards(&closed, &u, h);
    let error = (&shown - &y).amax() / y.amax();
    let twice = &u + inversion.commands(&(&y - &shown), h);
    let twice = (forwards(&closed, &twice, h) - &y).amax() / y.amax();
    // The series of the closed loop itself, as slow as its position gain.
    let slow = Inversion::new(&[closed.clone(), closed.clone()], length).unwrap();
    eprintln!(
        "cutoff {:.1} Hz, of the closed loop {:.1} Hz; left {error:.1e}, {twice:.1e}",
        inversion.cutoff_hz(),
        slow.cutoff_hz()
    );
    assert!(inversion.cutoff_hz() > 2.0 * hz && inversion.cutoff_hz() > 2.0 * slow.cutoff_hz());
    assert!(error < 2e-2 && twice < 0.1 * error, "{error:e} {twice:e}");
}

/// TCP motion under commands: trapezoidal rule, rates by central differences.
fn forwards(node: &Node, u: &DMatrix<f64>, h: f64) -> DMatrix<f64> {
    let (n, N) = (node.M.nrows(), u.ncols());
    let at = |k: i64| u.column(k.clamp(0, N as i64 - 1) as usize);
    let force = |k: i64| {
        let rate = (at(k + 1) - at(k - 1)) / (2.0 * h);
        let acceleration = (at(k + 1) + at(k - 1) - at(k) * 2.0) / (h * h);
        -(&node.M_a * acceleration + &node.D_a * rate + &node.K_a * at(k))
    };
    let mut x = node.K.clone().lu().solve(&force(0)).unwrap();
    let (mut v, mut a) = (DVector::zeros(n), DVector::zeros(n));
    let (g, b) = (0.5, 0.25);
    let lu = (&node.M + &node.D * (g * h) + &node.K * (b * h * h)).lu();
    let mut shown = DMatrix::zeros(node.J.nrows(), N);
    for k in 0..N {
        shown.column_mut(k).copy_from(&(&node.J * &x + &node.J_a * u.column(k)));
        let xp = &x + &v * h + &a * ((0.5 - b) * h * h);
        let vp = &v + &a * ((1.0 - g) * h);
        a = lu.solve(&(force(k as i64 + 1) - &node.D * &vp - &node.K * &xp)).unwrap();
        x = xp + &a * (b * h * h);
        v = vp + &a * (g * h);
    }
    shown
}

#[test]
fn the_filter_keeps_what_is_slow_without_delay_and_takes_away_what_is_fast() {
    let (h, N) = (1e-3, 4001);
    let wave = |hz: f64| {
        move |k: usize| {
            (std::f64::consts::TAU * hz * h * k as f64).sin() * (std::f64::consts::PI * k as f64 / 4000.0).sin().powi(4)
        }
    };
    let slow = DMatrix::from_fn(1, N, |_, k| wave(3.0)(k));
    let both = DMatrix::from_fn(1, N, |_, k| wave(3.0)(k) + wave(90.0)(k));
    let inversion = Inversion::new(&[], h).unwrap().below(20.0);
    let error = (&both - inversion.quicker_than_cutoff(&both, h) - &slow).amax();
    // Butterworth squared at 3/20 and 90/20: 2.6e-7 and 6e-6.
    assert!(error < 1e-4, "{error:e}"); // measured: 1.1e-5
}
