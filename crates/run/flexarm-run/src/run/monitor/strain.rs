//! Strain, rotation and angular speed of the flexible links, to check what their models assume:
//! small deformations, and no stiffening by centrifugal forces.
//!
//! ```text
//! ε = (|p_AE| - l)/l        θ = |log((R_AE undeformed)ᵀ R_AE)|
//! ```
//! A, E: near and far interface of the link; l: their distance (m); W: world. Not here: strain inside
//! the link, which the stress monitor has (`stress`).

use flexarm_analysis::engineering_strain;
use flexarm_kinematics::{Frame, Model, Pose, rotation_vector};
use nalgebra::{Rotation3, Vector3};

use crate::arm::Arm;

/// Figures of one link.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinkStrain {
    /// Maximum change of the distance between its interfaces, relative to that distance.
    pub strain: f64,
    /// Maximum rotation of its far interface relative to the near one (rad).
    pub rotation: f64,
    /// Maximum angular speed of the undeformed line from the near to the far interface, as the mean
    /// between two samples (rad/s).
    pub speed: f64,
}

/// Interface of a link on its body.
struct Interface {
    body: usize,
    X_BI: Pose,
}

impl Interface {
    fn new(frame: &Frame, X_FI: Pose) -> Self {
        Self { body: frame.body, X_BI: frame.X_BF * X_FI }
    }

    fn pose(&self, X_WB: &[Pose]) -> Pose {
        X_WB[self.body] * self.X_BI
    }
}

/// Link between its two interfaces.
struct Span {
    near: Interface,
    far: Interface,
    /// Distance between the interfaces (m).
    length: f64,
    /// Undeformed orientation of the far interface in the near one; set at the first sample.
    R_AE: Option<Rotation3<f64>>,
    /// Time (s) and direction of the line at the last sample.
    last: Option<(f64, Vector3<f64>)>,
}

/// Monitors the flexible links, in the order of [`Arm::spans`].
pub struct Strains {
    spans: Vec<Span>,
    largest: Vec<LinkStrain>,
}

impl Strains {
    /// Creates the monitor.
    ///
    /// * `model`: tree of the flexible robot.
    pub fn new(arm: &Arm, model: &Model) -> Self {
        let frame = |name: &str| model.frame(name).expect("a link of the substitution");
        let spans = arm.spans.iter().map(|span| Span {
            near: Interface::new(frame(&span.link), span.X_LA),
            far: Interface::new(frame(&span.distal_link), span.X_DB),
            length: span.length,
            R_AE: None,
            last: None,
        });
        Self { spans: spans.collect(), largest: vec![LinkStrain::default(); arm.spans.len()] }
    }

    /// Takes a sample.
    ///
    /// * `X_WB`: poses of all bodies in the world at time t (s); `rigid`: those of the rigid twin,
    ///   whose links are undeformed.
    pub fn update(&mut self, t: f64, X_WB: &[Pose], rigid: &[Pose]) {
        for (span, largest) in self.spans.iter_mut().zip(&mut self.largest) {
            let (X_WA, X_WE) = (span.near.pose(X_WB), span.far.pose(X_WB));
            let distance = (X_WE.translation.vector - X_WA.translation.vector).norm();
            let p_AE = span.far.pose(rigid).translation.vector - span.near.pose(rigid).translation.vector;
            let before = span.last.replace((t, p_AE)).filter(|(before, _)| *before < t);
            let speed = before.map_or(0.0, |(before, p)| p.angle(&p_AE) / (t - before));
            largest.speed = largest.speed.max(speed);
            let strain = engineering_strain(distance - span.length, span.length).map_or(0.0, f64::abs);
            // Relative rotation of the ends, less the undeformed one.
            let Span { near, far, R_AE, .. } = span;
            let R_AE = R_AE.get_or_insert_with(|| near.pose(rigid).rotation.inverse() * far.pose(rigid).rotation);
            let turn = R_AE.inverse() * (X_WA.rotation.inverse() * X_WE.rotation);
            largest.strain = largest.strain.max(strain);
            largest.rotation = largest.rotation.max(rotation_vector(turn.matrix()).norm());
        }
    }

    /// Returns one entry per link.
    pub fn result(&self) -> &[LinkStrain] {
        &self.largest
    }
}
