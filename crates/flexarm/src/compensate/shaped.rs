//! A motion through an input shaper.

use std::sync::Arc;

use flexarm_analysis::{Shaper, ShaperKind};
use flexarm_stepping::Held;
use flexarm_trajectory::{JointKnots, Trajectory};

use super::{CompensateError, SAMPLE_S};
use crate::arm::Arm;
use crate::error::Error;
use crate::motion::Motion;

/// The motion through a shaper of the first mode at its end.
pub(super) fn shaped(arm: &Arm, motion: &Motion, kind: ShaperKind) -> Result<(Motion, f64), Error> {
    let flexible = arm.flexible();
    let m = motion.trajectory.joints().len();
    let (mut q, mut v, mut a) = (vec![0.0; m], vec![0.0; m], vec![0.0; m]);
    let duration = motion.trajectory.duration();
    motion.trajectory.sample(duration, &mut q, &mut v, &mut a);
    let held = flexible.arm(Arc::new(Held(q.clone()))).map_err(|e| flexible.explained(e))?;
    let (Some(hz), Some(phi)) = (held.modes.frequencies_hz().first().copied(), held.modes.shapes.column_iter().next())
    else {
        return Err(CompensateError::NothingYields.into());
    };
    let ratio = (phi.dot(&(&held.D * phi)) / (2.0 * std::f64::consts::TAU * hz)).clamp(0.0, 0.9);
    let shaper = Shaper::new(kind, hz, ratio);
    let total = duration + shaper.delay_s();
    let n = (total / SAMPLE_S).ceil() as usize;
    let times: Vec<f64> = (0..=n).map(|k| total * k as f64 / n as f64).collect();
    let mut joints: Vec<JointKnots> = motion
        .trajectory
        .joints()
        .iter()
        .map(|name| JointKnots { name: name.clone(), ..JointKnots::default() })
        .collect();
    for t in &times {
        let mut sum = vec![[0.0; 3]; m];
        for (delay, part) in &shaper.copies {
            motion.trajectory.sample(t - delay, &mut q, &mut v, &mut a);
            for k in 0..m {
                sum[k][0] += part * q[k];
                sum[k][1] += part * v[k];
                sum[k][2] += part * a[k];
            }
        }
        for (joint, [q, v, a]) in joints.iter_mut().zip(sum) {
            joint.position.push(q);
            joint.velocity.push(v);
            joint.acceleration.push([a; 2]);
        }
    }
    let trajectory = Trajectory::through_knots(&times, &joints)?;
    let shaped = Motion::along(trajectory, &format!("{}_shaped", motion.name), arm.robot())?;
    Ok((shaped, shaper.delay_s()))
}
