//! Motion of the prescribed joints over time. Not here: trajectories and their files.

/// Positions, velocities and accelerations of the actuated coordinates as functions of time.
pub trait PrescribedMotion: Send + Sync {
    /// Writes the values at `t` (s), in coordinate order: rad or m, per s, per s².
    fn sample(&self, t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]);

    /// Returns the times at which a velocity jumps (s); samples just before and after differ. A
    /// jump at 0 starts from rest.
    fn velocity_jumps(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Returns the torque that is added to that of the servo of an actuated coordinate at `t` (s),
    /// at the joint (N m or N). Read at each sample of the servos and by
    /// [`Stepper::restart`](crate::Stepper::restart).
    fn added_torque(&self, _t: f64, _coordinate: usize) -> f64 {
        0.0
    }
}

/// All joints held at fixed positions.
#[derive(Clone, Debug)]
pub struct Held(pub Vec<f64>);

impl PrescribedMotion for Held {
    fn sample(&self, _t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]) {
        q.copy_from_slice(&self.0);
        qdot.fill(0.0);
        qddot.fill(0.0);
    }
}

/// A motion given as a function of time; its velocities do not jump.
pub struct MotionFn<F>(pub F);

impl<F: Fn(f64, &mut [f64], &mut [f64], &mut [f64]) + Send + Sync> PrescribedMotion for MotionFn<F> {
    fn sample(&self, t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]) {
        (self.0)(t, q, qdot, qddot);
    }
}
