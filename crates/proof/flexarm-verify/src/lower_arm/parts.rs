//! Limit of the sag of chains as their parts become short, and the share of the sag that it misses.

use flexarm_fem::ElasticSplit;
use flexarm_fem::chain::Chain;
use nalgebra::{Vector3, Vector6};

use super::G;
use super::truth::Truth;
use crate::Error;
use crate::meshed::{Condensed, Meshed};

/// Numbers of parts.
pub(super) const COUNTS: [usize; 7] = [2, 3, 4, 8, 16, 32, 64];
/// The largest of them.
pub(super) const MOST: usize = COUNTS[COUNTS.len() - 1];
/// Number of frequencies compared.
pub(super) const MODES: usize = 3;
/// Boundaries of the stretches of the casting, as fractions of the distance from A to B.
pub(super) const CUTS: [f64; 2] = [0.2, 0.9];

/// A chain of `parts` parts under gravity along x, y, z; displacements of B relative to those of
/// the mesh.
pub(super) struct ChainError {
    pub(super) parts: usize,
    /// Mass of its first part (kg).
    pub(super) first_mass_kg: f64,
    /// Missing share of the displacement.
    pub(super) missed: [f64; 3],
    /// Displacement due to the weight of the first part only, in the mesh.
    pub(super) by_first_part: [f64; 3],
    /// Relative differences of frequencies.
    pub(super) hz_errors: Vec<f64>,
}

/// A stretch of the casting: the parts of the longest chain that begin in it.
pub(super) struct Stretch {
    pub(super) name: String,
    /// Start, as a fraction of the distance from A to B.
    begin: f64,
    pub(super) mass_kg: f64,
    /// Missing displacement due to the weight of the stretch, over the displacement due to the
    /// whole weight.
    pub(super) missed: [f64; 3],
}

/// Chains of all lengths, and the stretches of the longest one.
pub(super) struct LimitOfParts {
    pub(super) chains: Vec<ChainError>,
    pub(super) stretches: Vec<Stretch>,
}

impl LimitOfParts {
    pub(super) fn new(mesh: &Meshed, condensed: &Condensed<'_>, truth: &Truth) -> Result<Self, Error> {
        let subject = Subject { condensed, truth };
        let made = COUNTS.iter().map(|n| condensed.chain(mesh, *n)).collect::<Result<Vec<Chain>, Error>>()?;
        let chains = COUNTS.iter().zip(&made).map(|(n, chain)| subject.chain_error(*n, chain)).collect();
        Ok(Self { chains, stretches: subject.stretches(&made[made.len() - 1]) })
    }

    /// Missing share of the longest chain along z.
    pub(super) fn missed_along(&self) -> f64 {
        self.chains.last().map_or(f64::NAN, |chain| chain.missed[2])
    }

    /// Missing share of the longest chain along z, summed over all stretches beyond the first of
    /// the [`CUTS`].
    pub(super) fn missed_away_from_the_seat(&self) -> f64 {
        self.stretches.iter().filter(|stretch| stretch.begin >= CUTS[0]).map(|stretch| stretch.missed[2]).sum()
    }

    /// Missing share of the longest chain between the cuts under transverse gravity; the larger of
    /// x and y.
    pub(super) fn missed_across_the_body(&self) -> f64 {
        let body = self.stretches.iter().find(|stretch| stretch.begin == CUTS[0]);
        body.map_or(f64::NAN, |body| body.missed[0].max(body.missed[1]))
    }
}

/// Mesh and truth with which chains are compared.
struct Subject<'a> {
    condensed: &'a Condensed<'a>,
    truth: &'a Truth,
}

impl Subject<'_> {
    /// Position of a joint as a fraction of the distance from A to B.
    fn fraction(&self, joint: &ElasticSplit) -> f64 {
        let (p_A, p_B) = self.condensed.points();
        let along = p_B - p_A;
        (joint.X_LS.translation.vector - p_A).dot(&along) / along.norm_squared()
    }

    /// Displacement of B under gravity along an axis, over that of the mesh under the whole weight.
    fn size(&self, u: &Vector6<f64>, axis: usize) -> f64 {
        u.fixed_rows::<3>(0).norm() / self.truth.sag[axis].fixed_rows::<3>(0).norm()
    }

    /// Computes the motion of B of a chain under gravity in closed form: each joint deflects under
    /// the weight of all parts beyond it.
    fn sag(&self, chain: &Chain, axis: usize) -> Vector6<f64> {
        let (_, p_B) = self.condensed.points();
        chain.sag(&p_B, &weight(axis)).unwrap_or_else(|| Vector6::repeat(f64::NAN))
    }

    fn chain_error(&self, parts: usize, chain: &Chain) -> ChainError {
        let first_joint = self.fraction(&chain.joints[0]);
        let first = |k: usize| self.condensed.under_weight_between(&weight(k), f64::NEG_INFINITY, first_joint);
        let hz_errors = self.truth.hz_errors(&chain.held_frequencies_hz());
        ChainError {
            parts,
            first_mass_kg: chain.parts[0].mass,
            missed: [0, 1, 2].map(|k| self.size(&(self.truth.sag[k] - self.sag(chain, k)), k)),
            by_first_part: [0, 1, 2].map(|k| self.size(&first(k), k)),
            hz_errors: hz_errors.into_iter().take(MODES).collect(),
        }
    }

    fn stretches(&self, chain: &Chain) -> Vec<Stretch> {
        let [near, far] = CUTS;
        let list = [
            ("first part".to_owned(), -1.0, 0.0),
            (format!("to {near}"), 0.0, near),
            (format!("{near} to {far}"), near, far),
            (format!("beyond {far}"), far, 2.0),
        ];
        list.into_iter().map(|(name, begin, end)| self.stretch(chain, name, begin, end)).collect()
    }

    fn stretch(&self, chain: &Chain, name: String, begin: f64, end: f64) -> Stretch {
        let joints: Vec<f64> = chain.joints.iter().map(|joint| self.fraction(joint)).collect();
        // Part k is between joint k - 1 and joint k.
        let start = |k: usize| if k == 0 { -1.0 } else { joints[k - 1] };
        let inside: Vec<usize> = (0..chain.parts.len()).filter(|k| (begin..end).contains(&start(*k))).collect();
        let mut only = chain.clone();
        for (_, part) in only.parts.iter_mut().enumerate().filter(|(k, _)| !inside.contains(k)) {
            part.mass = 0.0;
        }
        let from = inside.first().map_or(0.0, |k| if *k == 0 { f64::NEG_INFINITY } else { start(*k) });
        let to = inside.last().and_then(|k| joints.get(*k)).copied().unwrap_or(f64::INFINITY);
        let missed = [0, 1, 2].map(|k| {
            let in_mesh = self.condensed.under_weight_between(&weight(k), from, to);
            self.size(&(in_mesh - self.sag(&only, k)), k)
        });
        Stretch { name, begin, mass_kg: only.parts.iter().map(|part| part.mass).sum(), missed }
    }
}

/// Acceleration of gravity along an axis (m/s²).
fn weight(axis: usize) -> Vector3<f64> {
    G * Vector3::ith(axis, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first part and everything before the cut do not count as beyond it; in the transverse
    /// directions the larger of x and y counts.
    #[test]
    fn what_is_missed_is_summed_beyond_the_seat_alone() {
        let stretch = |begin: f64, missed: [f64; 3]| Stretch { name: String::new(), begin, mass_kg: 1.0, missed };
        let stretches = vec![
            stretch(-1.0, [0.5; 3]),
            stretch(0.0, [0.4; 3]),
            stretch(CUTS[0], [1e-3, 2e-3, 3e-3]),
            stretch(CUTS[1], [0.3, 0.3, 1e-3]),
        ];
        let found = LimitOfParts { chains: Vec::new(), stretches };
        assert!((found.missed_away_from_the_seat() - 4e-3).abs() < 1e-15);
        assert_eq!(found.missed_across_the_body(), 2e-3);
        assert!(found.missed_along().is_nan());
    }
}
