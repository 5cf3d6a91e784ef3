//! Results of the mesh and of the other programs, with A held.
//!
//! The mesh is assembled and condensed here; stored results of CalculiX and NGSolve check it. Link
//! axes, SI. Not here: models under test (`study.rs`).

use flexarm::Robot;
use nalgebra::{Matrix6, Vector3, Vector6};

use super::{AXES, G};
use crate::Error;
use crate::bench::{Bench, Stored};
use crate::meshed::{Condensed, inverse};

/// Number of frequencies compared.
pub(super) const MODES: usize = 6;

/// Compliance, sag and frequencies, with A held.
pub(super) struct Truth {
    /// Compliance at B (m/N, rad/(N m), ...).
    pub(super) C: Matrix6<f64>,
    /// Motion of B under gravity along x, y, z (m, rad).
    pub(super) sag: [Vector6<f64>; 3],
    pub(super) hz: Vec<f64>,
}

impl Truth {
    /// Computes them from the whole mesh.
    pub(super) fn new(condensed: &Condensed<'_>) -> Result<Self, Error> {
        let sag = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| condensed.under_acceleration(&(G * axis)));
        Ok(Self { C: condensed.compliance()?, sag, hz: condensed.held_hz(MODES)? })
    }

    /// Computes them from the condensed matrices of the link file, which have only a few modes.
    pub(super) fn filed(robot: &Robot, hz: Vec<f64>) -> Result<Self, Error> {
        let reduced = &robot.flexible_links[0].flexible.reduced;
        let element = reduced.details.as_ref().and_then(|details| details.superelement.as_ref());
        let element = element.ok_or_else(|| Error::Case("the link file has no condensed mass".into()))?;
        let C = inverse(&reduced.K_BB).ok_or_else(|| Error::Case("K_BB of the link file is singular".into()))?;
        let sag = [0, 1, 2].map(|axis| {
            // Both interfaces accelerate alike; the mass matrix gives the resulting load at B.
            let load = element.M.column(axis) + element.M.column(6 + axis);
            C * Vector6::from_fn(|i, _| G * load[6 + i])
        });
        Ok(Self { C, sag, hz })
    }

    /// Relative differences of given frequencies from the truth.
    pub(super) fn hz_errors(&self, hz: &[f64]) -> Vec<f64> {
        hz.iter().zip(&self.hz).map(|(f, truth)| f / truth - 1.0).collect()
    }
}

/// Another program on the same mesh.
pub(super) struct Program {
    pub(super) name: &'static str,
    /// Program, script and date.
    pub(super) provenance: String,
    pub(super) truth: Truth,
    /// Its compliance with both seats tied by the mean of their nodes.
    pub(super) C_distributing: Matrix6<f64>,
}

impl Program {
    /// CalculiX and NGSolve.
    pub(super) fn both(bench: &Bench) -> Result<[Self; 2], Error> {
        let calculix = Self::read("CalculiX", &bench.stored("lower_arm_calculix.json")?)?;
        let ngsolve = Self::read("NGSolve", &bench.stored("lower_arm_ngsolve.json")?)?;
        Ok([calculix, ngsolve])
    }

    fn read(name: &'static str, stored: &Stored) -> Result<Self, Error> {
        let [x, y, z] = AXES.map(|axis| stored.vector6(&format!("gravity/{axis}")));
        let hz = stored.numbers("frequencies_hz")?.into_iter().take(MODES).collect();
        Ok(Self {
            name,
            provenance: stored.provenance(),
            truth: Truth { C: stored.matrix6("C_BB")?, sag: [x?, y?, z?], hz },
            C_distributing: stored.matrix6("C_BB_distributing")?,
        })
    }
}
