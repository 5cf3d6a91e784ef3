//! Payloads that are picked up and put down during a run.
//!
//! Start at [`PayloadChange::attach`]. Frames: L carrying link, B its body; kg, m, kg m². Not here:
//! the robot's own payload (`robot`), files (`loads_file`).

use flexarm_kinematics::{LinkInertia, Model, Pose, SpatialInertia};
use flexarm_settings::{Quantity, known_names};
use flexarm_stepping::InertiaChange;
use nalgebra::{Matrix3, Vector3};

use crate::error::Error;
use crate::motions::applied_load::moving_links;
use crate::motions::loads_file::LoadLocation;
use crate::robot::{PAYLOAD_LINK, Robot};

/// New payload of a link from a given time on, which replaces the previous one.
#[derive(Clone, Debug)]
pub struct PayloadChange {
    /// Time of the change (s).
    pub at_s: f64,
    /// Carrying link; by default that of the robot's own payload, or else of the TCP.
    pub link: Option<String>,
    /// New payload in link axes; a mass of 0 means none.
    pub carried: LinkInertia,
    /// Location in the file, if read from one.
    pub(crate) written: Option<LoadLocation>,
}

impl PayloadChange {
    /// Returns a change that picks up a payload.
    ///
    /// * `at_s`: time (s). `mass`: kg. `com`: `p_LoLcm_L`, its centre of mass in the carrying link
    ///   L (m).
    pub fn attach(at_s: f64, mass: f64, com: Vector3<f64>) -> Self {
        let carried = LinkInertia { mass, com, inertia_com: Matrix3::zeros() };
        Self { at_s, link: None, carried, written: None }
    }

    /// Returns a change that puts down the payload; `at_s`: time (s).
    pub fn release(at_s: f64) -> Self {
        Self::attach(at_s, 0.0, Vector3::zeros())
    }

    /// Sets the inertia about the centre of mass, link axes (kg m²); without it the payload is a
    /// point mass.
    #[must_use]
    pub fn with_inertia(mut self, inertia_com: Matrix3<f64>) -> Self {
        self.carried.inertia_com = inertia_com;
        self
    }

    /// Sets the carrying link.
    #[must_use]
    pub fn on_link(self, link: &str) -> Self {
        Self { link: Some(link.to_owned()), ..self }
    }

    /// Returns the change on a model of the robot; `earlier`: preceding changes.
    pub(crate) fn on(&self, robot: &Robot, model: &Model, earlier: &[InertiaChange]) -> Result<InertiaChange, Error> {
        let fail = |cause: &str| LoadLocation::entry(self.written.as_ref(), cause);
        let LinkInertia { mass, com, inertia_com } = &self.carried;
        // The values themselves.
        let mut numbers = [self.at_s, *mass].into_iter().chain(com.iter().copied()).chain(inertia_com.iter().copied());
        if numbers.any(|x| !x.is_finite()) || *mass < 0.0 || self.at_s < 0.0 {
            return Err(fail("a payload needs a time and a mass of at least 0, and finite numbers"));
        }
        let ranges = [
            Quantity::TIME.check_all("the time of the payload", [&self.at_s]),
            Quantity::MASS.check_all("the mass of the payload", [mass]),
            Quantity::LENGTH.check_all("the centre of mass of the payload", com),
            Quantity::INERTIA.check_all("the inertia of the payload", inertia_com),
        ];
        ranges
            .into_iter()
            .collect::<Result<(), _>>()
            .map_err(|cause| LoadLocation::entry(self.written.as_ref(), cause))?;

        // The link that carries it, and the tensor.
        let (link, body, X_BL) = self.carrier(robot, model)?;
        if inertia_com.symmetric_eigenvalues().min() < -1e-9 * inertia_com.norm() {
            return Err(LoadLocation::inertia(
                self.written.as_ref(),
                "payload inertia has a negative principal moment; the order is ixx iyy izz ixy ixz iyz",
            ));
        }

        // It replaces the robot's own payload, on one body during a run.
        let mut inertia = without_payload(robot, model, body)
            .ok_or_else(|| fail(&format!("the robot's own payload does not ride on link {link:?}: give that link")))?;
        if let Some(other) = earlier.iter().find(|c| c.body != body) {
            let first = model.bodies()[other.body].name.clone();
            return Err(fail(&format!("payloads on two bodies ({first:?} and {link:?}): one changes in a run")));
        }
        if *mass > 0.0 {
            inertia += self.carried.spatial().at_parent(&X_BL);
        }
        Ok(InertiaChange { t: self.at_s, body, inertia })
    }

    /// Returns the carrying link, its body, and its frame on the body.
    fn carrier(&self, robot: &Robot, model: &Model) -> Result<(String, usize, Pose), Error> {
        let fail = |cause: &str| LoadLocation::frame(self.written.as_ref(), cause);
        let own = || robot.rigid.joints.iter().find(|j| j.child == PAYLOAD_LINK).map(|j| j.parent.clone());
        let link = self.link.clone().or_else(own).unwrap_or_else(|| robot.tcp.0.clone());
        let frame = model.frame(&link).filter(|f| f.body > 0).ok_or_else(|| {
            let known: Vec<String> = moving_links(model).into_iter().map(str::to_owned).collect();
            fail(&format!("payload link {link:?}: expected a link that moves, of {}", known_names(&link, &known)))
        })?;
        if robot.flexible_links.iter().any(|f| f.flexible.link == link)
            && model.frame(&format!("{link}__distal")).is_some()
        {
            let beyond: Vec<_> = robot.urdf.mechanism.child_joints(&link).map(|j| j.child.clone()).collect();
            return Err(fail(&format!(
                "payload link {link:?} is flexible, so that the position of the payload on it is not defined: name a \
                 link beyond it, of {beyond:?}"
            )));
        }
        Ok((link, frame.body, frame.X_BF))
    }
}

/// Returns the inertia of a body without its initial payload; `None` if the robot's own payload is
/// on another body.
fn without_payload(robot: &Robot, model: &Model, body: usize) -> Option<SpatialInertia> {
    let inertia = model.bodies()[body].inertia;
    let at_start = robot.rigid.link(PAYLOAD_LINK).and_then(|l| l.inertia);
    let (Some(payload), Some(own)) = (at_start, model.frame(PAYLOAD_LINK)) else { return Some(inertia) };
    if own.body != body {
        return None;
    }
    let carried = payload.spatial().at_parent(&own.X_BF);
    Some(SpatialInertia {
        mass: inertia.mass - carried.mass,
        first_moment: inertia.first_moment - carried.first_moment,
        rotational: inertia.rotational - carried.rotational,
    })
}
