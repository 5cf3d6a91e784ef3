//! Strain, rotation and angular speed of the flexible links, to check what their models assume:
//! small deformations, and no stiffening by centrifugal forces.
//!
//! ```text
//! ε = (|p_AB| - l)/l        θ = |log((R_AB undeformed)ᵀ R_AB)|
//! ```
//! A, B: interfaces of the link; l: their distance.

use flexarm_analysis::engineering_strain;
use flexarm_kinematics::{Frame, Model, Pose, rotation_vector};
use nalgebra::{Rotation3, Vector3};

use crate::flexible::FlexibleRobot;

/// Figures of one link.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LinkStrain {
    /// Maximum change of the distance between its interfaces, relative to that distance.
    pub(crate) strain: f64,
    /// Maximum rotation of its far interface relative to the near one (rad).
    pub(crate) rotation: f64,
    /// Maximum angular speed of the undeformed line from the near to the far interface, as the mean
    /// between two samples (rad/s).
    pub(crate) speed: f64,
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

/// Monitors the flexible links, in the order of [`FlexibleRobot::spans`].
pub(crate) struct Strains {
    spans: Vec<Span>,
    largest: Vec<LinkStrain>,
}

impl Strains {
    pub(crate) fn new(flexible: &FlexibleRobot, model: &Model) -> Self {
        let frame = |name: &str| model.frame(name).expect("a link of the substitution");
        let spans = flexible.spans.iter().map(|span| Span {
            near: Interface::new(frame(&span.link), span.X_LA),
            far: Interface::new(frame(&span.distal_link), span.X_DB),
            length: span.length,
            R_AE: None,
            last: None,
        });
        Self { spans: spans.collect(), largest: vec![LinkStrain::default(); flexible.spans.len()] }
    }

    /// * `X_WB`: poses of all bodies in the world at time t (s); `rigid`: those of the rigid twin,
    ///   whose links are undeformed.
    pub(crate) fn update(&mut self, t: f64, X_WB: &[Pose], rigid: &[Pose]) {
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
    pub(crate) fn result(&self) -> &[LinkStrain] {
        &self.largest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: a link of 2 m whose far end moves by 1 mm along it and rotates by 0.02 rad; a rigid
    /// motion of the whole arm changes nothing.
    #[test]
    fn strain_and_rotation_are_those_of_the_link_wherever_the_arm_is() {
        let on = |body: usize, X_FI: Pose| {
            let frame = Frame { name: String::new(), body, X_BF: Pose::identity() };
            Interface::new(&frame, X_FI)
        };
        let near = on(1, Pose::translation(0.1, 0.0, 0.0));
        let far = on(2, Pose::translation(0.0, 0.0, 0.3));
        let spans = vec![Span { near, far, length: 2.0, R_AE: None, last: None }];
        let mut seen = Strains { spans, largest: vec![LinkStrain::default()] };
        for X_WA in
            [Pose::identity(), Pose::from_parts([3.0, -1.0, 0.5].into(), Rotation3::new(Vector3::new(0.3, 2.0, -1.0)))]
        {
            let at = |x: f64, turn: f64| {
                let R = Rotation3::new(Vector3::y() * turn);
                let X_AE = Pose::from_parts([x, 0.0, 0.0].into(), R);
                let [X_AN, X_NE] = [Pose::translation(0.1, 0.0, 0.0), Pose::translation(0.0, 0.0, 0.3)];
                vec![Pose::identity(), X_WA * X_AN.inverse(), X_WA * X_AE * X_NE.inverse()]
            };
            seen.update(0.0, &at(2.001, 0.02), &at(2.0, 0.0));
            seen.update(0.0, &at(1.9995, -0.01), &at(2.0, 0.0));
        }
        let LinkStrain { strain, rotation, .. } = seen.result()[0];
        assert!((strain - 5e-4).abs() < 1e-14 && (rotation - 0.02).abs() < 1e-14, "{strain} {rotation}");
    }

    /// Truth: a link that turns by 2 rad/s about an axis across it and by 5 rad/s about itself.
    #[test]
    fn the_angular_speed_is_that_of_the_line_between_the_interfaces() {
        let on = |X_FI| Interface::new(&Frame { name: String::new(), body: 0, X_BF: Pose::identity() }, X_FI);
        let (near, far) = (on(Pose::identity()), on(Pose::translation(2.0, 0.0, 0.0)));
        let spans = vec![Span { near, far, length: 2.0, R_AE: None, last: None }];
        let mut seen = Strains { spans, largest: vec![LinkStrain::default()] };
        for t in [0.0, 0.01, 0.02] {
            let R = Rotation3::new(Vector3::z() * (2.0 * t)) * Rotation3::new(Vector3::x() * (5.0 * t));
            let X = [Pose::from_parts(Vector3::zeros().into(), R)];
            seen.update(t, &X, &X);
        }
        assert!((seen.result()[0].speed - 2.0).abs() < 1e-12, "{}", seen.result()[0].speed);
    }
}
