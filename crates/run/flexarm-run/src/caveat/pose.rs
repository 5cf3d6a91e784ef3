//! Caveats about the arm at rest in a pose: sag, first natural frequency, deflection of gears, gains.
//!
//! Start at [`ArmAtRest::caveats`]. Not here: equilibrium and modes (`poses/posed.rs`), the thresholds
//! of single gears (`drives.rs`).

use flexarm_stepping::Plant;

use super::drives::{give, integral, speed_loop};
use super::{Finding, kinds};
use crate::arm::{Arm, Owner};

/// TCP sag relative to the size of the arm: note, warning.
const SAG: [f64; 2] = [0.03, 0.1];
/// First natural frequency below which an arm with gears is unusual, and below which any arm is
/// wrong (Hz).
const SLOW: [f64; 2] = [3.0, 0.02];
/// Maximum of first natural frequency times size (m/s): the speed of sound in steel and aluminium.
const SOUND: f64 = 5100.0;
/// Damping ratio of the first mode: note, warning.
const DAMPED: [f64; 2] = [0.2, 0.5];

/// An arm at rest.
pub(crate) struct ArmAtRest<'a> {
    pub(crate) arm: &'a Arm,
    pub(crate) plant: &'a Plant,
    /// Elastic coordinates.
    pub(crate) elastic: &'a [f64],
    /// Static TCP deflection (m).
    pub(crate) sag_m: f64,
}

impl ArmAtRest<'_> {
    /// Returns all of these caveats.
    pub(crate) fn caveats(&self) -> Vec<Finding> {
        let extent = self.arm.extent;
        let mut caveats = self.gears();
        if extent > 0.0 && self.sag_m > SAG[0] * extent {
            let caveat = kinds::SAG.found("the TCP", self.sag_m, extent);
            caveats.push(if self.sag_m > SAG[1] * extent { caveat } else { caveat.as_note() });
        }
        caveats.extend(self.first_mode(extent));
        caveats.extend(self.speed_loops());
        caveats
    }

    fn gears(&self) -> Vec<Finding> {
        let mut caveats = Vec::new();
        for (element, owner) in self.plant.elements.iter().zip(&self.arm.owners) {
            let Owner::Drive(k) = owner else { continue };
            let drive = &self.arm.robot().drives[*k];
            let joint = self.arm.robot().rigid.joint(&drive.joint);
            let effort = joint.map_or(f64::INFINITY, |j| j.limits.effort);
            let e = &self.elastic[self.plant.offset(element)..][..element.size];
            let norm = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
            let (along, turned) = match element.size {
                6 => (norm(&e[..3]), norm(&e[3..])),
                _ if element.slides(&self.plant.model) => (norm(e), 0.0),
                _ => (0.0, norm(e)),
            };
            // Play is not deflection.
            let [turning, sliding] = drive.play(element.slides(&self.plant.model));
            caveats.extend(give(drive, effort, (turned - turning).max(0.0), (along - sliding).max(0.0), 1.0));
        }
        caveats
    }

    /// Checks frequency and damping of the first mode.
    fn first_mode(&self, extent: f64) -> Vec<Finding> {
        let modes = &self.plant.modes;
        let Some(omega) = modes.omega.first() else { return Vec::new() };
        let hz = omega / std::f64::consts::TAU;
        let mut caveats = Vec::new();
        let geared = self.arm.owners.iter().any(|owner| matches!(owner, Owner::Drive(_)));
        if hz < SLOW[1] || (geared && hz < SLOW[0]) {
            let caveat = kinds::SLOW_MODE.found("the arm", hz, if hz < SLOW[1] { SLOW[1] } else { SLOW[0] });
            caveats.push(if hz < SLOW[1] { caveat } else { caveat.as_note() });
        } else if hz * extent > SOUND {
            caveats.push(kinds::FAST_MODE.found("the arm", hz, SOUND / extent));
        }
        let ratio = self.plant.first_damping_ratio();
        if ratio > DAMPED[0] {
            let caveat = kinds::DAMPED_MODE.found("the first mode", ratio, 1.0);
            caveats.push(if ratio > DAMPED[1] { caveat } else { caveat.as_note() });
        }
        caveats
    }

    fn speed_loops(&self) -> Vec<Finding> {
        let Some(servo) = &self.plant.servo else { return Vec::new() };
        let n = self.plant.model.n_actuated();
        let mut q = nalgebra::DVector::zeros(n);
        let (mut v, mut a) = (vec![0.0; n], vec![0.0; n]);
        self.plant.motion.sample(0.0, q.as_mut_slice(), &mut v, &mut a);
        let quick = self.arm.quick_inertia(&q);
        let name = |k: usize| self.plant.model.coordinates()[k].joint.as_str();
        let loops = servo.axes.iter().zip(quick);
        loops
            .flat_map(|(axis, inertia)| {
                let joint = name(axis.coordinate);
                let speed = speed_loop(joint, axis.velocity_gain, servo.sample_s, inertia);
                speed.into_iter().chain(integral(joint, axis.integral_gain / axis.velocity_gain))
            })
            .collect()
    }
}
