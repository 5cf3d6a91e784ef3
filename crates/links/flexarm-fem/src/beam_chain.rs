//! Closed-form chain of a beam link: n rigid parts in series with n - 1 elastic joints.
//!
//! The beam is cut into n - 1 slices of equal length. Each joint is at the middle of its slice and
//! has the stiffness of the slice; each part reaches from joint to joint. The joint compliances add
//! up to that of the whole beam for every end wrench.

use crate::beam::Beam;
use crate::beam_link::BeamLink;
use crate::chain::Chain;
use crate::error::{FemError, positive};
use crate::reduced::{ElasticSplit, stiffness_at_split};
use flexarm_spatial::Pose;

impl BeamLink {
    /// Splits the beam into a chain of rigid parts in closed form.
    ///
    /// * `parts`: number of rigid parts, 2 or more.
    ///
    /// Returns the chain; poses and parts in link axes, `K_S` in beam axes.
    ///
    /// # Errors
    /// As [`BeamLink::reduce`], and [`FemError::OutOfRange`] for fewer than two parts.
    pub fn chain(&self, parts: usize) -> Result<Chain, FemError> {
        if parts < 2 {
            let (what, found) = ("number of parts of a chain".to_owned(), parts as f64);
            return Err(FemError::OutOfRange { what, found, allowed: "2 or more".into() });
        }
        let bar = self.section.bar(&self.material)?;
        // n - 1 slices, each with its stiffness at its middle.
        let slices = parts - 1;
        let slice = self.length / slices as f64;
        let piece = Beam::new(bar, self.theory, slice)?;
        let whole = Beam::new(bar, self.theory, self.length)?;
        let K_S = stiffness_at_split(&piece.tip_stiffness(), &Pose::translation(-0.5 * slice, 0.0, 0.0))?;
        let place = |k: usize| (k as f64 + 0.5) / slices as f64;
        let joints = (0..slices)
            .map(|k| ElasticSplit { X_LS: self.X_LE * Pose::translation(place(k) * self.length, 0.0, 0.0), K_S })
            .collect();
        // Parts reach from middle to middle, the first and last from the ends of the beam.
        let ends: Vec<f64> = std::iter::once(0.0).chain((0..slices).map(place)).chain([1.0]).collect();
        let mut bodies = Vec::with_capacity(parts);
        for pair in ends.windows(2) {
            bodies.push(whole.piece(pair[0], pair[1])?);
        }
        let mass: f64 = bodies.iter().map(|b| b.mass).sum();
        let factor = match self.mass {
            Some(wanted) => positive("mass of the link (kg)", wanted)? / mass,
            None => 1.0,
        };
        let parts = bodies.into_iter().map(|b| b.with_mass(b.mass * factor).transformed(&self.X_LE)).collect();
        Ok(Chain { joints, parts })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Material, Section};
    use approx::assert_relative_eq;
    use nalgebra::{Vector3, vector};

    /// Truth: closed-form compliance of the whole beam; measured 2e-13 of its diagonal.
    #[test]
    fn joints_of_a_beam_chain_add_up_to_the_beam() {
        let section = Section::Box { width: 0.12, height: 0.08, wall: 0.01 };
        let link = BeamLink::new("l", section, Material::STEEL, 0.9);
        let link = link.along(vector![1.0, 2.0, 0.5], Vector3::z(), 0.4, vector![0.01, 0.0, 0.03]).unwrap();
        let C = link.reduce().unwrap().tip_compliance().unwrap();
        for parts in [2, 3, 5, 9] {
            let chain = link.chain(parts).unwrap();
            let found = chain.tip_compliance(&link.X_LB.translation.vector).unwrap();
            let scale = C.diagonal().map(f64::sqrt);
            let error = (found - C).component_div(&(scale * scale.transpose())).amax();
            assert!(error < 1e-11, "{parts}: {error:e}");
            let mass: f64 = chain.parts.iter().map(|p| p.mass).sum();
            assert_relative_eq!(mass, link.reduce().unwrap().mass(), max_relative = 1e-13);
        }
        assert!(link.chain(1).is_err());
    }

    /// Truth: βl = 1.8751 of a slender clamped beam; the error falls with the square of the number
    /// of parts.
    #[test]
    fn first_frequency_of_a_beam_chain_converges_with_second_order() {
        let section = Section::Rectangle { width: 0.02, height: 0.01 };
        let mut link = BeamLink::new("l", section, Material::STEEL, 2.0);
        link.theory = crate::BeamTheory::EulerBernoulli;
        let (EI, rho_A) = (210e9 * 0.02 * 0.01_f64.powi(3) / 12.0, Material::STEEL.rho * 2e-4);
        let EI = EI * Material::STEEL.E / 210e9;
        let truth = 1.875_104_068_711_961_f64.powi(2) * (EI / (rho_A * 16.0)).sqrt() / std::f64::consts::TAU;
        let error = |parts| link.chain(parts).unwrap().held_frequencies_hz()[0] / truth - 1.0;
        let (coarse, fine) = (error(5), error(9));
        // measured 7.9e-3 and 2.0e-3
        assert!(fine.abs() < 4e-3 && (coarse / fine - 4.0).abs() < 0.4, "{coarse} {fine}");
    }
}
