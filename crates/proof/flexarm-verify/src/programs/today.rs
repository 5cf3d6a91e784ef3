//! Results of this build on this machine.
//!
//! Errors are distances of the TCP from the stored truth, over its peak; times are not judged,
//! since machines differ. Not here: the other programs (`stored.rs`).

use std::path::Path;

use flexarm::steppers::{ConstraintForm, ReferenceSettings};
use flexarm::{Keep, Modelling, Motion, Robot, RunOptions, RunRequest, StepperKind};
use flexarm_kinematics::ElasticAngles;
use flexarm_stepping::Damping;
use nalgebra::Vector3;

use crate::Error;
use crate::bench::{ALPHA, Bench, Worst, columns, larger, spook};

const ROBOT: &str = "robots/kr210/links.toml";
pub(super) const MOTION: &str = "pick_and_place";
const CURVE: &str = "tests/verification/kr210_pick_and_place_pinocchio.csv";
/// Sampling rate of the stored curve (1/s).
pub(super) const SAMPLE_HZ: f64 = 100.0;
/// Half a unit of the last digit of the stored curve (m).
pub(super) const ROUNDING_M: f64 = 0.5e-9;
/// Tolerance of the stepper with error control.
const TOLERANCE: f64 = 1e-9;
/// Finest step size of a quick run (s).
const QUICK_STEP_S: f64 = 2.5e-4;

/// One stepper.
pub(super) struct Stepped {
    pub(super) name: String,
    pub(super) step_s: f64,
    /// Claimed upper bound of its error.
    pub(super) bound: f64,
    /// Maximum distance of the TCP from the truth over the peak: along x, y, z, and in total.
    pub(super) axis_errors: [f64; 3],
    pub(super) error: f64,
    /// The same distance at the start.
    pub(super) start_error: f64,
}

/// Results of all steppers.
pub(super) struct Today {
    /// Maximum deflection of the truth (m).
    pub(super) peak_m: f64,
    pub(super) steppers: Vec<Stepped>,
}

/// Name, stepper, step size (s), bound.
type Method = (String, StepperKind, f64, f64);

fn methods() -> [Method; 7] {
    let (local, global) = (spook(ConstraintForm::Local), spook(ConstraintForm::Global));
    let reference = StepperKind::Reference(ReferenceSettings::new(TOLERANCE));
    [
        ("RK4".into(), StepperKind::Rk4, 2.5e-4, 1e-6),
        ("generalised-alpha".into(), ALPHA, 1e-3, 1e-4),
        ("generalised-alpha".into(), ALPHA, 2.5e-4, 1e-5),
        ("SPOOK, local".into(), local, 1e-3, 0.01),
        ("SPOOK, local".into(), local, 1e-4, 5e-4),
        ("SPOOK, global".into(), global, 1e-4, 5e-4),
        (format!("error control, {TOLERANCE:e}"), reference, 1e-2, 2e-6),
    ]
}

impl Today {
    /// * `damping_s`: ratio of damping to stiffness of the links, as in the other programs (s).
    pub(super) fn new(bench: &Bench, damping_s: f64) -> Result<Self, Error> {
        let truth = Curve::read(&bench.root.join(CURVE))?;
        let mut robot = bench.robot(ROBOT)?;
        for link in &mut robot.flexible_links {
            link.damping = Damping::StiffnessProportional(damping_s);
            link.flexible.angles = ElasticAngles::EulerZyx;
        }
        let motion = bench.motion(&robot, &format!("trajectories/{MOTION}.toml"))?;
        let methods = methods().into_iter().filter(|(_, _, h, _)| !bench.quick || *h >= QUICK_STEP_S);
        let steppers = methods.map(|method| Stepped::new(bench, (&robot, &motion), &truth, method));
        Ok(Self { peak_m: truth.peak, steppers: steppers.collect::<Result<_, Error>>()? })
    }
}

impl Stepped {
    fn new(
        bench: &Bench,
        (robot, motion): (&Robot, &Motion),
        truth: &Curve,
        (name, stepper, step_s, bound): Method,
    ) -> Result<Self, Error> {
        let options = RunOptions { stepper, step_s, log_rate_hz: SAMPLE_HZ, ..RunOptions::default() };
        let request = RunRequest::keeping(Keep::Curves);
        let trace = robot.model(&Modelling::default())?.simulate_with(motion, &options, request)?.trace;
        if trace.rows.len() != truth.flexible.len() {
            let (stored, run) = (truth.flexible.len(), trace.rows.len());
            let what = format!("has {stored} samples, the run {run}: not the same motion");
            return Err(flexarm::Error::File { path: bench.root.join(CURVE), what }.into());
        }
        let tools = trace.rows.iter().map(|row| Vector3::from(row.flexible_m));
        let apart: Vec<Vector3<f64>> = tools.zip(&truth.flexible).map(|(a, b)| a - b).collect();
        let most = |size: &dyn Fn(&Vector3<f64>) -> f64| apart.iter().map(size).worst() / truth.peak;
        Ok(Self {
            name,
            step_s,
            bound,
            axis_errors: [0, 1, 2].map(|i| most(&|d| d[i].abs())),
            error: most(&|d| d.norm()),
            start_error: apart[0].norm() / truth.peak,
        })
    }
}

/// The stored truth.
struct Curve {
    flexible: Vec<Vector3<f64>>,
    /// Maximum deflection (m).
    peak: f64,
}

impl Curve {
    fn read(path: &Path) -> Result<Self, Error> {
        let names = ["rigid_x", "rigid_y", "rigid_z", "flexible_x", "flexible_y", "flexible_z"];
        let (mut flexible, mut peak) = (Vec::new(), 0.0f64);
        for [x, y, z, flexible_x, flexible_y, flexible_z] in columns(path, names)? {
            let tool = Vector3::new(flexible_x, flexible_y, flexible_z);
            peak = larger(peak, (tool - Vector3::new(x, y, z)).norm());
            flexible.push(tool);
        }
        Ok(Self { flexible, peak })
    }
}
