//! Simulation of a cut in time: teeth lose contact where the tool moves out of the workpiece, and
//! cut the surface left by earlier teeth.
//!
//! For each angle of a tooth the deepest earlier cut is stored. The chip is the excess over it;
//! without a chip there is no force. The edge is divided into slices along the tool, each with
//! angles of its own, so that a helix needs no interpolation. The motion of the structure is exact
//! for a force that is linear within a step; the force at the end of a step is found by fixed-point
//! iteration. [`simulate`] does both; other time integrators can use [`RegenerativeCut`] on its
//! own.

use std::f64::consts::TAU;

use nalgebra::{Complex, Matrix3, Vector3};

use crate::milling::cutter::Cutter;
use crate::milling::error::ChatterError;
use crate::milling::structure::Structure;

/// Maximum number of slices of a helical edge; if fewer suffice, each lags by at most one step.
const MOST_SLICES: usize = 200;
/// Number of fixed-point iterations for the force at the end of a step.
const CORRECTIONS: usize = 3;

/// Parameters of a cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// Spindle speed (rad/s).
    pub spindle: f64,
    /// Depth of cut along the tool (m).
    pub depth: f64,
    /// Feed per tooth (m).
    pub feed: f64,
    /// Number of steps per tooth period.
    pub steps: usize,
    /// Number of tooth periods.
    pub teeth: usize,
}

/// Result of a simulation, one entry per step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Simulated {
    /// Time (s).
    pub time: Vec<f64>,
    /// Displacement of the tip (m).
    pub displacement: Vec<Vector3<f64>>,
    /// Force on the tool (N).
    pub force: Vec<Vector3<f64>>,
    /// Maximum chip thickness (m); 0 without contact.
    pub chip: Vec<f64>,
}

/// Simulates a cut from rest.
///
/// # Errors
/// [`ChatterError::Value`] for invalid parameters.
pub fn simulate(structure: &Structure, cutter: &Cutter, cut: &Cut) -> Result<Simulated, ChatterError> {
    let mut work = RegenerativeCut::new(cutter, cut)?;
    let h = work.step_s();
    let mut motion = ForcedMotion::new(structure, h);
    let mut run = Simulated::default();
    let mut force = Vector3::zeros();
    for step in 0..cut.steps * cut.teeth {
        let free = motion.predicted(&force);
        let mut next = force;
        for _ in 0..CORRECTIONS {
            next = work.force(step, &(free + motion.end_gain() * next));
        }
        motion.advance(&force, &next);
        force = next;
        let u = motion.displacement();
        let chip = work.leave(step, &u);
        run.time.push((step + 1) as f64 * h);
        run.displacement.push(u);
        run.force.push(force);
        run.chip.push(chip);
    }
    Ok(run)
}

impl Simulated {
    /// Returns the scatter of the motion from tooth to tooth over the last `teeth` periods (m):
    /// standard deviation of the displacement at one instant of each period about its mean, maximum
    /// over instants and directions.
    pub fn scatter(&self, steps: usize, teeth: usize) -> f64 {
        let from = self.displacement.len().saturating_sub(steps * teeth);
        let mut largest: f64 = 0.0;
        for moment in 0..steps {
            let all = || self.displacement[from..].iter().skip(moment).step_by(steps);
            let n = all().count().max(1) as f64;
            let mean = all().sum::<Vector3<f64>>() / n;
            let square = all().map(|u| (u - mean).component_mul(&(u - mean))).sum::<Vector3<f64>>() / n;
            largest = largest.max(square.max().sqrt());
        }
        largest
    }
}

fn check(cutter: &Cutter, cut: &Cut) -> Result<(), ChatterError> {
    cutter.check()?;
    let positive = |x: f64| x.is_finite() && x > 0.0;
    let rules = [
        ("the spindle speed (rad/s)", cut.spindle, positive(cut.spindle), "above 0"),
        ("the depth (m)", cut.depth, positive(cut.depth), "above 0"),
        ("the feed per tooth (m)", cut.feed, positive(cut.feed), "above 0"),
        ("the number of steps per tooth", cut.steps as f64, cut.steps >= 10, "10 or more"),
    ];
    match rules.into_iter().find(|rule| !rule.2) {
        Some((what, found, _, expected)) => Err(ChatterError::Value { what, found, expected }),
        None => Ok(()),
    }
}

/// A pole over one step.
#[derive(Clone, Debug)]
struct Step {
    /// `e^{λ h}`.
    decay: Complex<f64>,
    /// Displacement per unit state.
    reading: Vector3<Complex<f64>>,
    /// State per force at the start and at the end of the step.
    start: Vector3<Complex<f64>>,
    end: Vector3<Complex<f64>>,
}

/// Time integration of the structure, exact for a force that is linear within a step.
#[derive(Clone, Debug)]
pub struct ForcedMotion {
    poles: Vec<Step>,
    state: Vec<Complex<f64>>,
    /// Displacement at the end of a step per force there (m/N).
    end_gain: Matrix3<f64>,
}

impl ForcedMotion {
    /// Returns the structure at rest, for steps of `h` (s).
    pub fn new(structure: &Structure, h: f64) -> Self {
        let mut motion = Self { poles: Vec::new(), state: Vec::new(), end_gain: Matrix3::zeros() };
        for pole in structure.poles() {
            let (whole, ramp) = ramps(pole.value * h);
            let (start, end) = (pole.input * ((whole - ramp) * h), pole.input * (ramp * h));
            motion.end_gain += (pole.reading() * end.transpose()).map(|x| x.re);
            motion.poles.push(Step { decay: (pole.value * h).exp(), reading: pole.reading(), start, end });
            motion.state.push(Complex::new(0.0, 0.0));
        }
        motion
    }

    /// Returns the displacement at the end of a step (m) under a force that decreases from the
    /// given value (N) to zero.
    pub fn predicted(&self, force: &Vector3<f64>) -> Vector3<f64> {
        let force = force.map(|x| Complex::new(x, 0.0));
        let parts = self.poles.iter().zip(&self.state);
        parts.map(|(p, z)| (p.reading * (p.decay * z + p.start.dot(&force))).map(|x| x.re)).sum()
    }

    /// Advances one step under a force (N) that changes linearly between two values.
    pub fn advance(&mut self, from: &Vector3<f64>, to: &Vector3<f64>) {
        let (from, to) = (from.map(|x| Complex::new(x, 0.0)), to.map(|x| Complex::new(x, 0.0)));
        for (p, z) in self.poles.iter().zip(&mut self.state) {
            *z = p.decay * *z + p.start.dot(&from) + p.end.dot(&to);
        }
    }

    /// Returns the displacement per force at the end of a step (m/N).
    pub fn end_gain(&self) -> Matrix3<f64> {
        self.end_gain
    }

    /// Returns the displacement of the tip (m).
    pub fn displacement(&self) -> Vector3<f64> {
        self.poles.iter().zip(&self.state).map(|(p, z)| (p.reading * *z).map(|x| x.re)).sum()
    }
}

/// Computes `∫_0^1 e^{z (1 - s)} ds` and `∫_0^1 e^{z (1 - s)} s ds`.
fn ramps(z: Complex<f64>) -> (Complex<f64>, Complex<f64>) {
    if z.norm() < 0.5 {
        // Power series: 1/1! + z/2! + ..., 1/2! + z/3! + ...
        let (mut whole, mut ramp) = (Complex::new(0.0, 0.0), Complex::new(0.0, 0.0));
        let mut term = Complex::new(1.0, 0.0);
        for k in 1..20 {
            term /= f64::from(k);
            whole += term;
            ramp += term / f64::from(k + 1);
            term *= z;
        }
        return (whole, ramp);
    }
    let e = z.exp();
    ((e - 1.0) / z, (e - 1.0 - z) / (z * z))
}

/// Teeth and the surface that they left, by slice of the edge and step of a turn.
#[derive(Clone, Debug)]
pub struct RegenerativeCut {
    cutter: Cutter,
    cut: Cut,
    slices: usize,
    /// Maximum position of the edge along the thickness at each angle (m), by slice and step of the
    /// turn.
    surface: Vec<Vec<f64>>,
}

impl RegenerativeCut {
    /// Returns the state just before a cut, with the surface that rigid teeth leave.
    ///
    /// # Errors
    /// [`ChatterError::Value`] for invalid parameters.
    pub fn new(cutter: &Cutter, cut: &Cut) -> Result<Self, ChatterError> {
        check(cutter, cut)?;
        let per_turn = cut.steps * cutter.teeth;
        let lag = cutter.lag() * cut.depth;
        let slices = (lag / (TAU / per_turn as f64)).ceil().clamp(1.0, MOST_SLICES as f64) as usize;
        let mut work = Self { cutter: *cutter, cut: *cut, slices, surface: Vec::new() };
        for slice in 0..slices {
            let before = |station: usize| {
                // Number of steps since a tooth last passed this station.
                let steps = (cut.steps - station % cut.steps) as f64;
                -cutter.thickness(work.angle(station, 0, slice)).x * cut.feed * steps / cut.steps as f64
            };
            let surface = (0..per_turn).map(before).collect();
            work.surface.push(surface);
        }
        Ok(work)
    }

    /// Returns the step size (s).
    pub fn step_s(&self) -> f64 {
        self.cutter.tooth_period(self.cut.spindle) / self.cut.steps as f64
    }

    /// Returns the angle of a tooth at a step of the turn (rad).
    fn angle(&self, step: usize, tooth: usize, slice: usize) -> f64 {
        let per_turn = (self.cut.steps * self.cutter.teeth) as f64;
        let height = (slice as f64 + 0.5) / self.slices as f64 * self.cut.depth;
        // Offset by half a step, so that entry and exit are between steps.
        TAU * ((step as f64 + 0.5) / per_turn + tooth as f64 / self.cutter.teeth as f64) - self.cutter.lag() * height
    }

    /// Visits each engaged tooth and slice with the position of its edge along the thickness, and
    /// its chip.
    fn each(&self, step: usize, u: &Vector3<f64>, mut visit: impl FnMut(usize, usize, f64, f64, f64)) {
        let per_turn = self.cut.steps * self.cutter.teeth;
        let travel = self.cut.feed * step as f64 / self.cut.steps as f64;
        let place = u + Vector3::new(travel, 0.0, 0.0);
        for slice in 0..self.slices {
            for tooth in 0..self.cutter.teeth {
                let phi = self.angle(step, tooth, slice);
                if self.cutter.cuts(phi) {
                    let station = (step + tooth * self.cut.steps) % per_turn;
                    let reach = self.cutter.thickness(phi).dot(&place);
                    visit(slice, station, phi, reach, (reach - self.surface[slice][station]).max(0.0));
                }
            }
        }
    }

    /// Returns the force on the tool (N) at the end of a step for a displacement `u` of the tip
    /// (m), axes of the cut.
    pub fn force(&self, step: usize, u: &Vector3<f64>) -> Vector3<f64> {
        let mut force = Vector3::zeros();
        let width = self.cut.depth / self.slices as f64;
        self.each(step, u, |_, _, phi, _, chip| force -= self.cutter.push(phi) * (width * chip));
        force
    }

    /// Removes the chips of a step, and returns the maximum thickness (m).
    pub fn leave(&mut self, step: usize, u: &Vector3<f64>) -> f64 {
        let (mut cuts, mut thickest) = (Vec::new(), 0.0_f64);
        self.each(step, u, |slice, station, _, reach, chip| {
            cuts.push((slice, station, reach));
            thickest = thickest.max(chip);
        });
        for (slice, station, reach) in cuts {
            let surface = &mut self.surface[slice][station];
            *surface = surface.max(reach);
        }
        thickest
    }
}
