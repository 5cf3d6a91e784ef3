//! How the error of the tool along a motion answers to parameters of the arm, its tool and its
//! motion.
//!
//! The equations of motion are differentiated by [`run_slopes`]; here is what each parameter is to
//! them. Modal damping and Rayleigh's follow the modes and the mass of the start, which move with
//! the equilibrium there, so that all parameters have a part in the damping matrix.

use std::sync::Arc;

use flexarm_kinematics::{SpatialInertia, Wrench};
use flexarm_stepping::{
    AxisSlope, Damping, Direction, FlexibleArm, Friction, Held, PrescribedMotion, RunSlopes, SlopesRequest,
    SpringSlope, StepError, Tangents, equilibrium_slopes, run_slopes,
};
use nalgebra::{DMatrix, DVector, Vector3};

use crate::estimation::parameter::{Effect, Parameter, entry_slope, slope_of};
use crate::estimation::response::Damped;
use crate::estimation::sensitivity::{along_coordinates, eigen, explicit};

/// What a run is differentiated by.
#[derive(Clone)]
pub enum RunParameter {
    /// Of the arm, per unit of its coordinate of the search: of the logarithm of what is
    /// logarithmic.
    Arm(Parameter),
    /// A shift of a joint's whole motion, by its coordinate (per rad or m).
    Joint(usize),
    /// Any change of the motion, per unit of it.
    Motion(Arc<dyn PrescribedMotion>),
    /// Place of the tool's point along this, tool axes (per m).
    Tool(Vector3<f64>),
    /// Friction of a joint, by its coordinate: changes of the numbers of its law, per unit. It
    /// moves joints under servos alone.
    Friction(usize, Friction),
    /// The controller of a joint, by the number of its axis, per unit.
    Servo(usize, AxisSlope),
    /// Another one of which the controllers know.
    Followed {
        /// What changes of the arm or its motion.
        parameter: Box<RunParameter>,
        /// Inertia of bodies of the rigid robot whose torques are fed forward, about Bo, B axes.
        fed_forward: Vec<(usize, SpatialInertia)>,
        /// What becomes of controllers, by the number of the axis.
        gains: Vec<(usize, AxisSlope)>,
    },
}

impl RunParameter {
    /// What it does to the arm, if it is a parameter of it.
    fn effect(&self) -> Option<&Effect> {
        match self {
            Self::Arm(parameter) => Some(&parameter.effect),
            Self::Followed { parameter, .. } => parameter.effect(),
            _ => None,
        }
    }
}

/// Error of the tool along a run and its derivatives, a number or column per parameter.
///
/// # Errors
/// As [`run_slopes`]; [`StepError::Singular`] where a coordinate moves no mass.
pub fn error_slopes(
    arm: &FlexibleArm,
    parameters: &[RunParameter],
    request: &SlopesRequest,
) -> Result<RunSlopes, StepError> {
    let mut directions: Vec<Direction> = parameters.iter().map(|parameter| direction(arm, parameter)).collect();
    let effects: Vec<Option<&Effect>> = parameters.iter().map(RunParameter::effect).collect();
    let damping = damping_slopes(arm, &effects, &directions)?;
    let after = damping_after_changes(arm, &effects, &directions)?;
    for (k, (direction, dD)) in directions.iter_mut().zip(damping).enumerate() {
        direction.damping = Some(dD);
        direction.dampings_after = after.iter().map(|change| change[k].clone()).collect();
    }
    run_slopes(arm, request, &directions)
}

/// Changes of the damping matrix after each change of inertia, a matrix per parameter: the damping
/// then is that of the arm with what it carries then, where the motion begins.
fn damping_after_changes(
    arm: &FlexibleArm,
    effects: &[Option<&Effect>],
    directions: &[Direction],
) -> Result<Vec<Vec<DMatrix<f64>>>, StepError> {
    let mut changed = FlexibleArm { inertia_changes: Vec::new(), ..arm.clone() };
    let (mut effects, mut directions) = (effects.to_vec(), directions.to_vec());
    let mut found: Vec<Vec<DMatrix<f64>>> = Vec::new();
    for change in &arm.inertia_changes {
        changed.model = Arc::new(changed.model.with_inertia(change.body, change.inertia));
        // What was carried there before is gone.
        for (effect, direction) in effects.iter_mut().zip(&mut directions) {
            direction.inertias.retain(|(body, _)| *body != change.body);
            *effect = effect.filter(|effect| !matches!(effect, Effect::Mass { body, .. } if *body == change.body));
        }
        let mut renewed = changed.clone();
        if renewed.update_modes_and_damping().is_ok() {
            changed = renewed;
            found.push(damping_slopes(&changed, &effects, &directions)?);
        } else {
            // It keeps the damping that it had.
            let before = found.last().cloned().map_or_else(|| damping_slopes(arm, &effects, &directions), Ok)?;
            found.push(before);
        }
    }
    Ok(found)
}

/// A parameter without what it does to the damping.
fn direction(arm: &FlexibleArm, parameter: &RunParameter) -> Direction {
    let mut direction = Direction::default();
    match parameter {
        RunParameter::Arm(Parameter { effect, .. }) => match effect {
            Effect::Stiffness(places) => {
                for place in places {
                    if let Some((coupled, slope)) = arm.coupled_stiffness_slope(place.spring) {
                        let n = arm.n_elastic_coordinates();
                        let dK = direction.stiffness.get_or_insert_with(|| DMatrix::zeros(n, n));
                        for (a, i) in coupled.iter().enumerate() {
                            coupled.iter().enumerate().for_each(|(b, j)| dK[(*i, *j)] += slope[(a, b)]);
                        }
                        continue;
                    }
                    let K = &arm.elements[place.spring].K;
                    let slope = match place.coordinate {
                        Some(_) if K.nrows() > 1 => SpringSlope::Matrix(slope_of(K, place.coordinate)),
                        _ => SpringSlope::Factor(1.0),
                    };
                    direction.springs.push((place.spring, slope));
                }
            }
            Effect::Entry { spring, row, column, factor, .. } => {
                let slope = entry_slope(arm.elements[*spring].size, *row, *column, *factor);
                direction.springs.push((*spring, SpringSlope::Matrix(slope)));
            }
            Effect::Tool(axis @ 0..3) => direction.tool = Vector3::ith(*axis, 1.0),
            // A tool that is turned in its place is off by the same angle.
            Effect::Damping(_) | Effect::Damper { .. } | Effect::Tool(_) => {}
            Effect::Mass { body, per_kg } => direction.inertias.push((*body, *per_kg)),
        },
        RunParameter::Joint(k) => {
            let mut shift = vec![0.0; arm.model.n_actuated()];
            shift[*k] = 1.0;
            direction.motion = Some(Arc::new(Held(shift)));
        }
        RunParameter::Motion(motion) => direction.motion = Some(motion.clone()),
        RunParameter::Tool(axis) => direction.tool = *axis,
        RunParameter::Friction(coordinate, by) => direction.friction.push((*coordinate, *by)),
        RunParameter::Servo(axis, by) => direction.servo.push((*axis, *by)),
        RunParameter::Followed { parameter, fed_forward, gains } => {
            direction = self::direction(arm, parameter);
            direction.fed_forward.extend_from_slice(fed_forward);
            direction.servo.extend_from_slice(gains);
        }
    }
    direction
}

/// Change of the damping matrix with each parameter, which follows the modes at the start.
fn damping_slopes(
    arm: &FlexibleArm,
    effects: &[Option<&Effect>],
    directions: &[Direction],
) -> Result<Vec<DMatrix<f64>>, StepError> {
    let moved = equilibrium_slopes(arm, directions)?;
    let (m, n) = (arm.model.n_actuated(), arm.n_elastic_coordinates());
    // Dampers, and what is in proportion to the springs, know nothing of masses and poses.
    let by_modes = arm.elements.iter().any(|e| matches!(e.damping, Damping::Modal(_) | Damping::Rayleigh(..)));
    let (tool, none) = (&arm.model.frames()[0], Wrench::zeros());
    let mut q = DVector::zeros(m + n);
    let (mut rates, mut accelerations) = (vec![0.0; m], vec![0.0; m]);
    arm.motion.sample(0.0, &mut q.as_mut_slice()[..m], &mut rates, &mut accelerations);
    q.rows_mut(m, n).copy_from(&arm.modes.equilibrium);
    let here = Tangents::at(arm, tool, &none, &q);
    let (omega2, shapes) = eigen(&here)?;
    let damped = Damped { arm, M: &here.M, omega2: &omega2, shapes: &shapes };
    let zero = DMatrix::zeros(n, n);
    let nothing = Effect::Stiffness(Vec::new());
    let mut found = Vec::with_capacity(effects.len());
    for (k, (effect, direction)) in effects.iter().zip(directions).enumerate() {
        let effect = effect.unwrap_or(&nothing);
        let (mut dK, mut dM) = (zero.clone(), zero.clone());
        if by_modes {
            let mut dq = DVector::zeros(m + n);
            if let Some(motion) = &direction.motion {
                motion.sample(0.0, &mut dq.as_mut_slice()[..m], &mut rates, &mut accelerations);
            }
            dq.rows_mut(m, n).copy_from(&moved.column(k));
            let change = along_coordinates(&q, &dq, |q| {
                let at = Tangents::at(arm, tool, &none, q);
                vec![at.K, at.M]
            });
            (dK, dM) = explicit(arm, tool, &none, effect, &q, &here);
            dK += &change[0];
            dM += &change[1];
        }
        found.push(damped.slope(effect, &dK, &dM));
    }
    Ok(found)
}
