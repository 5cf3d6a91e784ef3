//! Magnification of deflections in a recording, chosen before the run.
//!
//! Start at `Expected::of`. World axes, SI units. Not here: magnified poses (`flexarm-log`),
//! pictures (`flexarm-draw`).

use flexarm_kinematics::{Frame, frame_jacobian};
use flexarm_log::Trace;
use flexarm_stepping::{LoadAxes, Plant, Start};
use nalgebra::{Matrix6xX, Vector3, Vector6};

use crate::run::twin::RigidTwin;

/// Number of time intervals at which the deflection is estimated.
const INSTANTS: u32 = 200;
/// Number of values averaged for the mean of a load.
const PIECES: u32 = 64;
/// Maximum displayed TCP deflection relative to the arm's reach.
const SHOWN: f64 = 0.15;
/// Maximum displayed rotation of springs (rad).
const LARGEST_TURN: f64 = 0.3;
/// Dynamic factor of a suddenly applied load, or of a start with undeformed springs, relative to
/// the static deflection.
const SUDDEN: f64 = 2.0;

/// Rough estimate of the deflections in a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Expected {
    /// Deflection of the TCP (m).
    pub tool_m: f64,
    /// Maximum rotation of a spring (rad).
    pub turn_rad: f64,
    /// Reach of the arm (m).
    pub reach_m: f64,
    /// Corners of the bounding box of all bodies and the TCP at all times (m, world).
    pub volume: Option<[[f64; 3]; 2]>,
}

impl Expected {
    /// Estimates the deflections under gravity and rigid motion without the springs' dynamics:
    /// `e = -K^-1 tau_e` with the forces that hold the elastic coordinates of the rigid twin at
    /// zero.
    pub(crate) fn of(plant: &Plant, tcp: &Frame, duration: f64, start: Start) -> Self {
        let mut twin = RigidTwin::new(plant);
        let mut J = Matrix6xX::zeros(plant.model.nv());
        let mut expected = Self::default();
        // A start with undeformed springs doubles everything below.
        let sudden = if start == Start::Undeformed { 1.0 } else { SUDDEN };
        // A short load acts through its mean over half a period of the first mode.
        let window = 0.5 / plant.modes.frequencies_hz().first().copied().unwrap_or(f64::INFINITY).max(1e-3);
        let jumps = plant.load_jumps().map(|t| t + 0.5 * window).take(INSTANTS as usize);
        let evenly = (0..=INSTANTS).map(|k| duration * f64::from(k) / f64::from(INSTANTS));
        for t in evenly.chain(jumps.filter(|t| *t < duration)) {
            twin.update(plant, tcp, t);
            // Loads reduce the forces that hold the elastic coordinates.
            for load in &plant.loads {
                let frame = Frame { name: String::new(), body: load.body, X_BF: load.X_BF };
                frame_jacobian(&plant.model, &twin.data, &frame, &mut J);
                let R = twin.data.X_WF(&frame).rotation;
                let in_world = |v| if load.wrench.axes == LoadAxes::Frame { R * v } else { v };
                let mut F = Vector6::zeros();
                for k in 0..PIECES {
                    let share = (f64::from(k) + 0.5) / f64::from(PIECES) - 0.5;
                    let now = load.wrench.at((t + share * window).max(0.0));
                    let (force, torque) = (in_world(now.force), in_world(now.torque));
                    F += Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z) / f64::from(PIECES);
                }
                twin.data.tau -= J.tr_mul(&F) * sudden;
            }
            // TCP displacement, and largest rotation of a spring.
            let mut moved = Vector6::zeros();
            for element in &plant.elements {
                let (first, n) = (element.coordinate, element.size);
                let e = -(&element.C * twin.data.tau.rows(first, n));
                moved += twin.J.columns(first, n) * &e;
                let turned = match (element.modal, n) {
                    (false, 6) => e.rows(3, 3).norm(),
                    (false, _) => e.norm(),
                    (true, _) => 0.0,
                };
                expected.turn_rad = expected.turn_rad.max(turned);
            }
            expected.tool_m = expected.tool_m.max(moved.fixed_rows::<3>(0).norm());
            // Reach and bounding box of the arm.
            let tool = twin.data.X_WF(tcp).translation.vector;
            let far = twin.data.X_WB.iter().skip(1).map(|X| (X.translation.vector - tool).norm());
            expected.reach_m = far.fold(expected.reach_m, f64::max);
            for p in twin.data.X_WB.iter().map(|X| X.translation.vector).chain([tool]) {
                let [low, high] = expected.volume.get_or_insert([p.into(), p.into()]);
                for c in 0..3 {
                    (low[c], high[c]) = (low[c].min(p[c]), high[c].max(p[c]));
                }
            }
        }
        if start == Start::Undeformed {
            expected.tool_m *= SUDDEN;
            expected.turn_rad *= SUDDEN;
        }
        expected
    }

    /// Returns the maxima of two runs that are shown together.
    pub(crate) fn or(self, other: Self) -> Self {
        let largest = |a: [f64; 3], b: [f64; 3], pick: fn(f64, f64) -> f64| [0, 1, 2].map(|c| pick(a[c], b[c]));
        let volume = match (self.volume, other.volume) {
            (Some([a, b]), Some([c, d])) => Some([largest(a, c, f64::min), largest(b, d, f64::max)]),
            (own, others) => own.or(others),
        };
        Self {
            tool_m: self.tool_m.max(other.tool_m),
            turn_rad: self.turn_rad.max(other.turn_rad),
            reach_m: self.reach_m.max(other.reach_m),
            volume,
        }
    }

    /// Returns the factor on displayed deflections: a round number, or 0 if nothing is elastic.
    pub fn magnification(&self) -> f64 {
        if !(self.tool_m > 0.0 && self.tool_m.is_finite()) {
            return 0.0;
        }
        let wanted = (SHOWN * self.reach_m / self.tool_m).min(LARGEST_TURN / self.turn_rad.max(1e-12));
        round_down(wanted).max(1.0)
    }

    /// Returns the deviation at the end of the colour scale (m).
    pub fn color_scale_m(&self) -> f64 {
        end_of_scale(self.tool_m)
    }
}

/// Sets the end of the pictures' colour scale to the maximum TCP error of the runs shown together;
/// before a run it is an estimate.
pub(crate) fn fit_color_scale<'a>(traces: impl IntoIterator<Item = &'a mut Trace>) {
    let mut traces: Vec<&mut Trace> = traces.into_iter().filter(|trace| trace.header.color_scale_m > 0.0).collect();
    let peak_m = |trace: &&mut Trace| Vector3::from_row_slice(&trace.peak.error_world[..3]).norm();
    let largest = traces.iter().map(peak_m).fold(0.0, f64::max);
    if largest > 0.0 {
        traces.iter_mut().for_each(|trace| trace.header.color_scale_m = largest);
    }
}

/// Returns the maximum of 1, 2, 5 times a power of ten that does not exceed `x`.
pub(crate) fn round_down(x: f64) -> f64 {
    let decade = 10f64.powf(x.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|k| k * decade).find(|y| *y <= x * (1.0 + 1e-9)).unwrap_or(decade)
}

/// Returns the minimum round number not below `x`, larger by at most a third; 0 for 0.
fn end_of_scale(x: f64) -> f64 {
    next_of(&[1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0], x)
}

/// Returns the minimum of 1, 2, 5 times a power of ten not below `x`; 0 for 0.
pub fn round_up(x: f64) -> f64 {
    next_of(&[1.0, 2.0, 5.0, 10.0], x)
}

/// Returns the minimum of these steps times a power of ten not below `x`; 0 for 0.
fn next_of(steps: &[f64], x: f64) -> f64 {
    if !(x > 0.0 && x.is_finite()) {
        return 0.0;
    }
    let decade = 10f64.powf(x.log10().floor());
    steps.iter().map(|k| k * decade).find(|y| *y >= x * (1.0 - 1e-9)).unwrap_or(10.0 * decade)
}
