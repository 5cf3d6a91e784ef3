//! Differences between the sections of beam theory and the meshes, beam by beam.
//!
//! The middle layers of a mesh show the section alone, its end also shows the ties. Compliances at
//! the end, axes of the beam (m, rad per N, N m). Not here: the whole arm (`study.rs`).

use flexarm::Robot;
use flexarm_fem::UnitSystem;
use flexarm_fem::reduction::Tie;
use nalgebra::{Matrix3, Matrix6, Vector3};

use super::beams::{Member, TUBE, members};
use crate::Error;
use crate::bench::{Bench, Worst, compliance_error, larger};
use crate::meshed::{Condensed, Meshed, inverse};
use crate::textbook::{Stiffness, at_lever, turned};

/// Number of slices, equal to the number of elements along each beam.
const SLICES: usize = 20;
/// Number of element layers in the middle whose stiffness is evaluated.
const LAYERS: usize = 2;
/// The ties that are compared, in this order.
pub(super) const TIES: [Tie; 2] = [Tie::Rigid, Tie::Distributing];
/// Index of torsion.
pub(super) const TORSION: usize = 3;

/// One beam: relative differences of its mesh from beam theory.
pub(super) struct Section {
    /// Diagonal of the compliance of its end, in the axes of the beam, with each of the [`TIES`].
    pub(super) end_errors: [[f64; 6]; 2],
    /// In the middle: EA, EI_y, EI_z, GJ, kGA_y, kGA_z; then the mass.
    pub(super) middle_errors: [f64; 7],
    /// Difference of the compliance of the link file from that of the mesh reduced here.
    pub(super) file_error: f64,
}

/// All three beams.
pub(super) struct Sections {
    pub(super) beams: [Section; 3],
}

impl Sections {
    pub(super) fn new(bench: &Bench, robot: &Robot) -> Result<Self, Error> {
        let [tube, hollow, bar] = [0, 1, 2].map(|k| Section::new(bench, robot, k));
        Ok(Self { beams: [tube?, hollow?, bar?] })
    }

    /// Maximum error of EA and EI in the middle.
    pub(super) fn worst_in_the_middle(&self) -> f64 {
        self.beams.iter().map(|beam| beam.middle_errors[..3].iter().copied().worst()).fold(0.0, larger)
    }

    /// Maximum error of a link file.
    pub(super) fn worst_file(&self) -> f64 {
        self.beams.iter().map(|beam| beam.file_error).fold(0.0, larger)
    }
}

impl Section {
    fn new(bench: &Bench, robot: &Robot, k: usize) -> Result<Self, Error> {
        let member = &members()[k];
        let reduced = &robot.flexible_links[k].flexible.reduced;
        let mesh = Meshed::read(bench, &format!("robots/test/three_beams/fe/beam_{}.msh.gz", k + 1), UnitSystem::SI)?;
        // The first beam is along z of its link, the others are along x.
        let R = if k == TUBE { member.R.transpose() } else { Matrix3::identity() };
        let p_B = reduced.X_LB.translation.vector;
        let [rigid, mean] = TIES.map(|tie| mesh.condensed([tie; 2], Vector3::zeros(), p_B));
        let (rigid, mean) = (rigid?, mean?);
        let theory = member.section.tip_compliance();
        let against_theory = |C: &Matrix6<f64>| {
            let C = turned(C, &R);
            std::array::from_fn(|i| C[(i, i)] / theory[(i, i)] - 1.0)
        };
        let C = rigid.compliance()?;
        let known = inverse(&reduced.K_BB);
        Ok(Self {
            end_errors: [against_theory(&C), against_theory(&mean.compliance()?)],
            middle_errors: middle_errors(member, &mesh, &rigid, &p_B, &R),
            file_error: known.map_or(f64::NAN, |known| compliance_error(&known, &C)),
        })
    }
}

/// Relative differences from beam theory of the stiffness of the middle layers and of the mass.
///
/// * `p_B`: interface B from A, in axes of the mesh (m).
/// * `R`: rotation from the axes of the mesh to those of the section.
fn middle_errors(
    member: &Member,
    mesh: &Meshed,
    condensed: &Condensed<'_>,
    p_B: &Vector3<f64>,
    R: &Matrix3<f64>,
) -> [f64; 7] {
    let slices = condensed.slices(mesh, SLICES);
    let short: Matrix6<f64> = slices[SLICES / 2 - 1..][..LAYERS].iter().sum();
    let c = turned(&at_lever(&short, &(-0.5 * p_B)), R).diagonal();
    let d = LAYERS as f64 * member.section.l / SLICES as f64;
    let Stiffness { EA, EI_y, EI_z, GJ, kGA, mu, l } = member.section;
    // Treat the layers as a beam about their middle: subtract the bending share l³/(12 EI) from the
    // shear compliance.
    let shear = |yields: f64, turns: f64, kGA: f64| d / (yields - d * d / 12.0 * turns) / kGA - 1.0;
    [
        d / c[0] / EA - 1.0,
        d / c[4] / EI_y - 1.0,
        d / c[5] / EI_z - 1.0,
        d / c[3] / GJ - 1.0,
        shear(c[1], c[5], kGA[0]),
        shear(c[2], c[4], kGA[1]),
        mesh.mass() / (mu * l) - 1.0,
    ]
}
