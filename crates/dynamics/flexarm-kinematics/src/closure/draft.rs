//! Loops on the bodies of the tree before its coordinates are numbered, in order of dependence.
//!
//! [`draft_loops`] finds the bodies of each loop: the common body C of its two chains, the bodies with
//! pin and eye, the two dependent joints. [`LoopDraft::placed`] adds the coordinates once they are
//! numbered. Not here: the assembly mode (`assemble`).

use flexarm_spatial::Pose;
use nalgebra::{Rotation3, Vector3};

use crate::axis_motion::AxisMotion;
use crate::closure::loop_closure::LoopClosure;
use crate::closure::placed_loop::PlacedLoop;
use crate::closure::triangle::Shape;
use crate::mechanism::Mechanism;
use crate::model::{Body, Frame, JointMotion, ModelError};

/// Loop on the bodies of the tree, before its coordinates are numbered.
pub(crate) struct LoopDraft<'m> {
    closure: &'m LoopClosure,
    dependent: [usize; 2],
    ends: [usize; 2],
    X_pin: Pose,
    p_eye: Vector3<f64>,
    common: usize,
    chains: [Vec<usize>; 2],
    shape: Shape,
}

pub(super) fn bad(closure: &LoopClosure, what: impl Into<String>) -> ModelError {
    ModelError::BadLoop { name: closure.name.clone(), what: what.into() }
}

/// Loops of a mechanism, ordered so that each depends only on loops before it.
///
/// # Errors
/// [`ModelError`] with the name of the loop.
pub(crate) fn draft_loops<'m>(
    mechanism: &'m Mechanism,
    frames: &[Frame],
    bodies: &[Body],
) -> Result<Vec<LoopDraft<'m>>, ModelError> {
    let mut drafts: Vec<LoopDraft<'m>> = Vec::new();
    for closure in &mechanism.loops {
        if drafts.iter().any(|other| other.closure.name == closure.name) {
            return Err(ModelError::duplicate("loop", &closure.name));
        }
        // A joint follows from one loop only.
        let draft = LoopDraft::new(closure, mechanism, frames, bodies)?;
        for other in &drafts {
            if let Some(&body) = draft.dependent.iter().find(|body| other.dependent.contains(body)) {
                let (joint, other) = (&bodies[body].joint, &other.closure.name);
                return Err(bad(
                    closure,
                    format!("joint {joint:?} already follows from loop {other:?}: name another one of its joints"),
                ));
            }
        }
        drafts.push(draft);
    }
    // Next is a loop whose chains contain no dependent joint of the loops that remain.
    let mut ordered: Vec<LoopDraft<'m>> = Vec::new();
    while !drafts.is_empty() {
        let rests =
            |draft: &LoopDraft, other: &LoopDraft| draft.chains.iter().flatten().any(|i| other.dependent.contains(i));
        let ready = (0..drafts.len())
            .find(|&k| (0..drafts.len()).all(|other| other == k || !rests(&drafts[k], &drafts[other])));
        let Some(ready) = ready else {
            let names: Vec<&str> = drafts.iter().map(|d| d.closure.name.as_str()).collect();
            let what = format!(
                "the loops {names:?} depend on each other in a circle: each must close once those before it have; choose other dependent joints"
            );
            return Err(bad(drafts[0].closure, what));
        };
        ordered.push(drafts.remove(ready));
    }
    Ok(ordered)
}

impl<'m> LoopDraft<'m> {
    fn new(
        closure: &'m LoopClosure,
        mechanism: &Mechanism,
        frames: &[Frame],
        bodies: &[Body],
    ) -> Result<Self, ModelError> {
        let frame = |link: &str| {
            let found = frames.iter().find(|f| f.name == link);
            found.ok_or_else(|| bad(closure, format!("there is no link {link:?}")))
        };
        let (pin, eye) = (frame(&closure.pin)?, frame(&closure.eye)?);
        let finite = closure.axis.iter().chain(closure.at.iter().map(|(_, x)| x)).all(|x| x.is_finite());
        if !finite {
            return Err(ModelError::not_finite("axis or start value of loop", &closure.name));
        }
        let path = |body: usize| {
            let mut path = vec![body];
            while let Some(&last) = path.last().filter(|last| **last > 0) {
                path.push(bodies[last].parent);
            }
            path.reverse();
            path
        };
        // Chains from the last common body to pin and eye.
        let (to_pin, to_eye) = (path(pin.body), path(eye.body));
        let shared = to_pin.iter().zip(&to_eye).take_while(|(a, b)| a == b).count();
        let common = to_pin[shared - 1];
        let chains = [to_pin[shared..].to_vec(), to_eye[shared..].to_vec()];
        let dependent = dependent_bodies(closure, mechanism, bodies, &chains)?;
        // The two dependent joints are in one chain, or one in each.
        let place = |body: usize| chains.iter().position(|chain| chain.contains(&body)).unwrap_or(0);
        let at = |body: usize| chains[place(body)].iter().position(|i| *i == body);
        let shape = match (place(dependent[0]), place(dependent[1])) {
            (a, b) if a == b => Shape::OneChain { chain: a, inner: usize::from(at(dependent[0]) > at(dependent[1])) },
            (a, _) => Shape::BothChains { of_pin: a },
        };
        // Frame of the pin, its z axis along the axis of the pin.
        let turn = Rotation3::rotation_between(&Vector3::z(), &closure.axis)
            .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
        let X_pin = pin.X_BF * Pose::from_parts(Vector3::zeros().into(), turn);
        let p_eye = eye.X_BF.translation.vector;
        Ok(Self { closure, dependent, ends: [pin.body, eye.body], X_pin, p_eye, common, chains, shape })
    }

    /// Bodies whose joints are dependent.
    pub(crate) fn dependent(&self) -> [usize; 2] {
        self.dependent
    }

    /// Converts the draft to a placed loop, with coordinates numbered; the assembly mode is set
    /// later by [`super::assemble`].
    pub(crate) fn placed(&self, bodies: &[Body], nv: usize, modal_size: impl Fn(usize) -> usize) -> PlacedLoop {
        let mut moved_by: Vec<usize> = Vec::new();
        // Coordinates that move pin or eye, apart from the dependent ones.
        for &i in self.chains.iter().flatten().filter(|i| !self.dependent.contains(i)) {
            let k = bodies[i].coordinate;
            match bodies[i].motion {
                JointMotion::Axis(_) => moved_by.push(k),
                JointMotion::Elastic(_) => moved_by.extend(k..k + 6),
                JointMotion::Interface { modal, .. } => moved_by.extend(k..k + modal_size(modal)),
                JointMotion::Welded => {}
            }
        }
        moved_by.sort_unstable();
        moved_by.dedup();
        PlacedLoop {
            name: self.closure.name.clone(),
            dependent: self.dependent,
            ends: self.ends,
            start: [0.0; 2],
            start_miss: [0.0; 2],
            first: bodies[self.dependent[0]].coordinate.max(nv),
            common: self.common,
            chains: self.chains.clone(),
            X_pin: self.X_pin,
            p_eye: self.p_eye,
            moved_by,
            root: 1.0,
            shape: self.shape,
            corner: self.corner(bodies),
        }
    }

    /// Corner of the triangle opposite to the side with the driving joints, if only one side has
    /// any: 0 and 1 are the dependent joints, 2 is the pin.
    fn corner(&self, bodies: &[Body]) -> Option<usize> {
        let mut driven = [false; 3];
        for own in &self.chains {
            for (at, &i) in own.iter().enumerate() {
                let drives = !bodies[i].elastic && matches!(bodies[i].motion, JointMotion::Axis(_));
                if !drives || self.dependent.contains(&i) {
                    continue;
                }
                let inward: Vec<usize> = (0..2).filter(|d| own[..at].contains(&self.dependent[*d])).collect();
                let opposite = match (self.shape, inward.as_slice()) {
                    // Outward of both: the side from the outer joint to the pin.
                    (Shape::OneChain { inner, .. }, [_, _]) => inner,
                    (Shape::OneChain { .. }, [_]) => 2,
                    (Shape::OneChain { inner, .. }, _) => 1 - inner,
                    (Shape::BothChains { .. }, [own]) => 1 - own,
                    (Shape::BothChains { .. }, _) => 2,
                };
                driven[opposite] = true;
            }
        }
        match driven.iter().filter(|d| **d).count() {
            1 => driven.iter().position(|d| *d),
            _ => None,
        }
    }
}

/// Child bodies of the two dependent joints named in a loop closure.
fn dependent_bodies(
    closure: &LoopClosure,
    mechanism: &Mechanism,
    bodies: &[Body],
    chains: &[Vec<usize>; 2],
) -> Result<[usize; 2], ModelError> {
    // Two different joints, each known, of a type that the closed form covers, without mimic
    // relations, and between pin and eye.
    let mut found = [0; 2];
    if closure.dependent[0] == closure.dependent[1] {
        return Err(bad(
            closure,
            format!("joint {:?} is named twice: two joints follow from a loop", closure.dependent[0]),
        ));
    }
    for (to, name) in found.iter_mut().zip(&closure.dependent) {
        let Some(joint) = mechanism.joint(name) else {
            return Err(bad(closure, format!("there is no joint {name:?}")));
        };
        let turns = (joint.kind.turns() || joint.kind.slides())
            && matches!(joint.kind.axis_motion(), Some(AxisMotion::Revolute(_) | AxisMotion::Prismatic(_)));
        if !turns {
            let kind = joint.kind.name();
            return Err(bad(
                closure,
                format!("joint {name:?} is {kind}: dependent joints are revolute, continuous or prismatic"),
            ));
        }
        if let Some(mimic) = &joint.mimic {
            let leader = &mimic.joint;
            return Err(bad(
                closure,
                format!("joint {name:?} mimics {leader:?}: remove the mimic: its position follows from the loop"),
            ));
        }
        if let Some(follower) = mechanism.joints.iter().find(|j| j.mimic.as_ref().is_some_and(|m| m.joint == *name)) {
            let follower = &follower.name;
            return Err(bad(
                closure,
                format!("joint {follower:?} mimics the dependent joint {name:?}, which is none that drives"),
            ));
        }
        let in_loop = |i: &usize| bodies[*i].joint == *name;
        let Some(&body) = chains.iter().flatten().find(|i| in_loop(i)) else {
            let moving = |i: &&usize| matches!(bodies[**i].motion, JointMotion::Axis(_)) && !bodies[**i].elastic;
            let known: Vec<&str> = chains.iter().flatten().filter(moving).map(|i| bodies[*i].joint.as_str()).collect();
            return Err(bad(
                closure,
                format!("joint {name:?} does not lie between pin and eye; the joints there are {known:?}"),
            ));
        };
        *to = body;
    }
    Ok(found)
}
