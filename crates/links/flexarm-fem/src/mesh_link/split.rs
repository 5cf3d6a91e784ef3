//! Cut of the mesh into the two parts of a link, and bodies attached to them.
//!
//! Start at [`split`]; [`SplitAt`] says where. Link axes. Not here: the volume of cut elements
//! ([`cut`](crate::cut())).

use flexarm_spatial::{Matrix12, Pose, symmetric_part};
use nalgebra::{DMatrix, Matrix6, Vector3};

use crate::chain::{Chain, centre_of_compliance};
use crate::cut::{CutError, CutPlane, cut};
use crate::error::FemError;
use crate::frames::LinkFrames;
use crate::mesh::Mesh;
use crate::mesh_link::error::MeshLinkError;
use crate::reduced::ReducedLink;
use crate::reduction::spd_inverse;
use crate::rigid_part::RigidPart;
use flexarm_settings::Finding;

/// Position of the elastic joint of the two-part link.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum SplitAt {
    /// At the centre of compliance of the link if a cut there has material on both sides, otherwise
    /// midway.
    #[default]
    ElasticCentre,
    /// Midway between A and B.
    MidLength,
    /// At a fraction of the distance from A to B.
    Fraction(f64),
    /// At a point, link axes, m.
    Point(Vector3<f64>),
}

/// Split frame and the two parts. The cut is through S, perpendicular to AB.
///
/// * `densities`: one per region, kg/m³.
/// * `K12`: stiffness of A and B, 12×12, link axes, for the elastic centre.
///
/// Returns the frames with S in link axes, and the proximal and distal part, link axes.
pub(super) fn split(
    mesh: &Mesh,
    densities: &[f64],
    frames: LinkFrames,
    K12: &Matrix12,
    at: SplitAt,
    findings: &mut Vec<Finding>,
) -> Result<(LinkFrames, [RigidPart; 2]), MeshLinkError> {
    let normal = frames.p_AB();
    let parts = |point: Vector3<f64>| -> Result<[RigidPart; 2], CutError> {
        let mut parts = cut(mesh, densities, &[CutPlane { point, normal }])?.into_iter();
        match (parts.next(), parts.next()) {
            (Some(proximal), Some(distal)) => Ok([proximal, distal]),
            _ => Err(CutError::NoElements),
        }
    };
    let (p_LS, said) = split_point(&frames, K12, at, &|p| parts(p).is_ok());
    findings.extend(said.map(|said| Finding::warning("split", "", said, "")));
    let parts = parts(p_LS).map_err(|source| MeshLinkError::Split { p: p_LS.into(), source })?;
    Ok((frames.with_split(Pose::translation(p_LS.x, p_LS.y, p_LS.z)), parts))
}

/// Merges attached bodies into the part of the interface on whose side of the split they are, so
/// that the two-part link, chains and modal links carry them alike.
pub(super) fn attach(attached: &[RigidPart], link: &mut ReducedLink, chains: &mut [Chain]) -> Result<(), FemError> {
    let (p_AB, p_LS) = (link.p_AB(), link.split.X_LS.translation.vector);
    for body in attached {
        body.check("an attached body")?;
        let is_beyond = (body.com - p_LS).dot(&p_AB) > 0.0;
        let part = if is_beyond { &mut link.distal } else { &mut link.proximal };
        *part = part.merged(body);
        for chain in chains.iter_mut() {
            let end = if is_beyond { chain.parts.last_mut() } else { chain.parts.first_mut() };
            if let Some(end) = end {
                *end = end.merged(body);
            }
        }
    }
    Ok(())
}

/// Returns the split point `p_LS` (m, link axes), and a message if it is not the requested one.
///
/// * `K12`: stiffness of A and B, 12×12, link axes; only its block `K_BB` is used.
/// * `possible`: whether a cut at a point leaves two parts.
pub(crate) fn split_point(
    frames: &LinkFrames,
    K12: &Matrix12,
    at: SplitAt,
    possible: &dyn Fn(Vector3<f64>) -> bool,
) -> (Vector3<f64>, Option<String>) {
    let (p_LA, p_LB, p_AB) = (frames.X_LA.translation.vector, frames.X_LB.translation.vector, frames.p_AB());
    let middle = p_LA + p_AB * 0.5;
    match at {
        SplitAt::MidLength => (middle, None),
        SplitAt::Fraction(fraction) => (p_LA + p_AB * fraction, None),
        SplitAt::Point(point) => (point, None),
        SplitAt::ElasticCentre => {
            let K_BB = DMatrix::from_fn(6, 6, |i, j| K12[(6 + i, 6 + j)]);
            let C_BB = spd_inverse(&K_BB).map(|C| symmetric_part(&Matrix6::from_column_slice(C.as_slice())));
            let centre = C_BB.and_then(|C_BB| centre_of_compliance(&C_BB, &p_LB));
            let fraction = |p_L: &Vector3<f64>| (p_L - p_LA).dot(&p_AB) / p_AB.norm_squared();
            // Not near an end, where one part would be almost empty.
            match centre.filter(|p| (0.1..=0.9).contains(&fraction(p)) && possible(*p)) {
                Some(centre) => (centre, None),
                None => {
                    let said = "the elastic centre lies outside the middle of the link; split at mid length";
                    (middle, Some(said.into()))
                }
            }
        }
    }
}
