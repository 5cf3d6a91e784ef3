//! Derivatives of the tool error along a motion with respect to parameters of the arm, its tool and
//! its motion.
//!
//! [`run_slopes`] differentiates the equations of motion; this module provides the derivatives of
//! their terms with respect to each parameter. Modal and Rayleigh damping depend on the modes and
//! the mass matrix at the start, and these depend on the equilibrium there. Therefore all
//! parameters affect the damping matrix.

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

/// Parameter with respect to which a run is differentiated.
#[derive(Clone)]
pub enum RunParameter {
    /// Parameter of the arm, per unit of its search coordinate: of the logarithm if it is
    /// logarithmic.
    Arm(Parameter),
    /// Shift of a joint's whole motion, given by its coordinate (per rad or m).
    Joint(usize),
    /// Arbitrary change of the motion, per unit of it.
    Motion(Arc<dyn PrescribedMotion>),
    /// Shift of the tool's point along a vector, tool axes (per m).
    Tool(Vector3<f64>),
    /// Friction of a joint, given by its coordinate: change of the coefficients of its friction
    /// law, per unit. It has an effect only on joints under servo control.
    Friction(usize, Friction),
    /// Controller of a joint, given by the number of its axis, per unit.
    Servo(usize, AxisSlope),
    /// Another parameter, whose change the controllers also use.
    Followed {
        /// Change of the arm or its motion.
        parameter: Box<RunParameter>,
        /// Derivatives of the inertia of bodies in the rigid model for torque feedforward, about
        /// Bo, B axes.
        fed_forward: Vec<(usize, SpatialInertia)>,
        /// Changes of the controllers, by number of the axis.
        gains: Vec<(usize, AxisSlope)>,
    },
}

impl RunParameter {
    /// Returns the effect on the arm if this is a parameter of the arm.
    fn effect(&self) -> Option<&Effect> {
        match self {
            Self::Arm(parameter) => Some(&parameter.effect),
            Self::Followed { parameter, .. } => parameter.effect(),
            _ => None,
        }
    }
}

/// Computes the tool error along a run and its derivatives, one number or column per parameter.
///
/// # Errors
/// As [`run_slopes`]; [`StepError::Singular`] if a coordinate has no mass.
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

/// Computes the derivatives of the damping matrix after each change of inertia, a matrix per
/// parameter. That damping is computed with the changed inertia at the initial pose.
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
        // The change replaces the inertia of the body.
        for (effect, direction) in effects.iter_mut().zip(&mut directions) {
            direction.inertias.retain(|(body, _)| *body != change.body);
            *effect = effect.filter(|effect| !matches!(effect, Effect::Mass { body, .. } if *body == change.body));
        }
        let mut renewed = changed.clone();
        if renewed.update_modes_and_damping().is_ok() {
            changed = renewed;
            found.push(damping_slopes(&changed, &effects, &directions)?);
        } else {
            // The damping stays as before.
            let before = found.last().cloned().map_or_else(|| damping_slopes(arm, &effects, &directions), Ok)?;
            found.push(before);
        }
    }
    Ok(found)
}

/// Computes the derivatives with respect to a parameter, without those of the damping matrix.
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
            // A rotation of the tool about its origin does not change its position error.
            Effect::Damping(_) | Effect::Damper { .. } | Effect::Tool(_) => {}
            // Runs with a guide have no derivatives, and calibrated frames move both arms.
            Effect::Guide { .. } | Effect::Frame { .. } => {}
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

/// Computes the derivatives of the damping matrix with respect to each parameter, by way of the
/// modes at the start.
fn damping_slopes(
    arm: &FlexibleArm,
    effects: &[Option<&Effect>],
    directions: &[Direction],
) -> Result<Vec<DMatrix<f64>>, StepError> {
    let moved = equilibrium_slopes(arm, directions)?;
    let (m, n) = (arm.model.n_actuated(), arm.n_elastic_coordinates());
    // Dampers and stiffness-proportional damping do not depend on masses and pose.
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
