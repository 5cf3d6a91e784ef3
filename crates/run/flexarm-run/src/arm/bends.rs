//! Drawing of deflected links: stations along each flexible link, and the links attached to them.
//!
//! A station is a frame on a part of the link that undeformed has the axes of the link, so that the
//! pose of a station shows the deflection there. Not here: the curve through the stations
//! (`flexarm-draw`).

use flexarm_flexlink::{FlexibleSpan, Substituted};
use flexarm_kinematics::{Data, Frame, Model, Pose, forward_kinematics};
use flexarm_log::{BendInfo, LinkInfo};
use nalgebra::{DVector, Translation3, Vector3};

/// Stations of a flexible link: near interface, middles of inner parts, far interface.
#[derive(Clone, Debug)]
pub struct Bend {
    /// Name of the link.
    pub link: String,
    /// Links of the model that carry the stations, with the stations' undeformed positions in the
    /// flexible link (m).
    pub stations: Vec<(String, Vector3<f64>)>,
    /// Links of the URDF attached to a station.
    pub carries: Vec<(String, usize)>,
}

/// Returns one entry per span of the substitution.
pub(crate) fn bends(substituted: &Substituted) -> Vec<Bend> {
    let mechanism = &substituted.mechanism;
    let of_span = |span: &FlexibleSpan| {
        let mut stations = vec![(span.link.clone(), span.X_LA.translation.vector)];
        for pair in span.joints.windows(2) {
            let middle = 0.5 * (pair[0].X_LS.translation.vector + pair[1].X_LS.translation.vector);
            stations.push((pair[0].distal_link.clone(), middle));
        }
        // Undeformed, the frame of the distal part is at the last joint; for a modal link it is at
        // interface B.
        let at_B = || mechanism.joints.iter().find(|j| j.child == span.distal_link).map(|j| j.X_PJ);
        let X_LD = span.joints.last().map(|joint| joint.X_LS).or_else(at_B).unwrap_or_else(Pose::identity);
        stations.push((span.distal_link.clone(), (X_LD * span.X_DB).translation.vector));
        // Children of the parts, but not the parts themselves.
        let carried = mechanism.joints.iter().filter_map(|joint| {
            let station = stations.iter().skip(1).position(|(part, _)| *part == joint.parent)?;
            let inner = stations.iter().any(|(part, _)| *part == joint.child);
            (!inner).then(|| (joint.child.clone(), station + 1))
        });
        Bend { link: span.link.clone(), carries: carried.collect(), stations }
    };
    substituted.spans.iter().map(of_span).collect()
}

/// Returns the stations in a model: the constant data for recordings, and the frames evaluated for
/// samples.
pub(crate) fn stations(bends: &[Bend], model: &Model, links: &[LinkInfo]) -> (Vec<BendInfo>, Vec<Frame>) {
    let mut data = Data::new(model);
    forward_kinematics(model, &mut data, &DVector::zeros(model.nv()));
    let (mut infos, mut frames) = (Vec::new(), Vec::new());
    for bend in bends {
        let index = |name: &str| links.iter().position(|l| l.name == *name);
        let (Some(link), Some(own)) = (index(&bend.link), model.frame(&bend.link)) else { continue };
        let X_WL = data.X_WF(own);
        let mut X_LS = Vec::new();
        for (part, place) in &bend.stations {
            let Some(part) = model.frame(part) else { continue };
            // The station S on its part P: X_PS = X_WP⁻¹ X_WL X_LS, all undeformed.
            let at = Pose::from(Translation3::from(*place));
            let X_PS = data.X_WF(part).inv_mul(&(X_WL * at));
            X_LS.push(at);
            frames.push(Frame { X_BF: part.X_BF * X_PS, ..part.clone() });
        }
        let carries = bend.carries.iter().filter_map(|(child, station)| Some((index(child)?, *station))).collect();
        infos.push(BendInfo { link, X_LS, carries });
    }
    (infos, frames)
}
