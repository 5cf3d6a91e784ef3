//! How the error of the tool along a motion answers to parameters of the arm, its tool and its motion.
//!
//! The equations of motion are differentiated by [`run_slopes`]; here is what each parameter is to them. Modal damping and Rayleigh's follow
//! the modes and the mass of the start, which move with the equilibrium there, so that all parameters have a part in the damping matrix.

use std::sync::Arc;

use flexarm_kinematics::Wrench;
use flexarm_stepping::{
    Damping, Direction, FlexibleArm, Held, PrescribedMotion, RunSlopes, SlopesRequest, SpringSlope, StepError,
    Tangents, equilibrium_slopes, run_slopes,
};
use nalgebra::{DMatrix, DVector, Vector3};

use crate::parameter::{Effect, Parameter, entry_slope, slope_of};
use crate::response::Damped;
use crate::sensitivity::{along_coordinates, eigen, explicit};

/// What a run is differentiated by.
#[derive(Clone)]
pub enum RunParameter {
    /// Of the arm, per unit of its coordinate of the search: of the logarithm of what is logarithmic.
    Arm(Parameter),
    /// A shift of a joint's whole motion, by its coordinate (per rad or m).
    Joint(usize),
    /// Any change of the motion, per unit of it.
    Motion(Arc<dyn PrescribedMotion>),
    /// Place of the tool's point along this, tool axes (per m).
    Tool(Vector3<f64>),
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
    let moved = equilibrium_slopes(arm, &directions)?;
    let damping = damping_slopes(arm, parameters, &directions, &moved)?;
    for (direction, dD) in directions.iter_mut().zip(damping) {
        direction.damping = Some(dD);
    }
    run_slopes(arm, request, &directions)
}

/// A parameter without what it does to the damping.
fn direction(arm: &FlexibleArm, parameter: &RunParameter) -> Direction {
    let mut direction = Direction::default();
    match parameter {
        RunParameter::Arm(Parameter { effect, .. }) => match effect {
            Effect::Stiffness(places) => {
                for place in places {
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
            Effect::Damping(_) | Effect::Tool(_) => {}
            Effect::Mass { body, per_kg } => direction.inertias.push((*body, *per_kg)),
        },
        RunParameter::Joint(k) => {
            let mut shift = vec![0.0; arm.model.n_actuated()];
            shift[*k] = 1.0;
            direction.motion = Some(Arc::new(Held(shift)));
        }
        RunParameter::Motion(motion) => direction.motion = Some(motion.clone()),
        RunParameter::Tool(axis) => direction.tool = *axis,
    }
    direction
}

/// Change of the damping matrix with each parameter; `moved`: of the elastic coordinates at the start, n × p.
fn damping_slopes(
    arm: &FlexibleArm,
    parameters: &[RunParameter],
    directions: &[Direction],
    moved: &DMatrix<f64>,
) -> Result<Vec<DMatrix<f64>>, StepError> {
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
    let mut found = Vec::with_capacity(parameters.len());
    for (k, (parameter, direction)) in parameters.iter().zip(directions).enumerate() {
        let effect = match parameter {
            RunParameter::Arm(parameter) => &parameter.effect,
            _ => &nothing,
        };
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
