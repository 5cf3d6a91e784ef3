//! Default gains of servos: values that suit the inertia at the start.
//!
//! A position loop gives the velocity error `e = q̇_d - q̇ + k_p (q_d - q)`, the velocity loop inside it
//! the torque `k_v e + k_i ∫ e dt`, both sampled. Gains that the robot file gives stay.
//! Not here: the sampled loop (`flexarm_stepping::Servo`).

use flexarm_kinematics::{Data, mass_matrix};
use flexarm_stepping::ServoAxis;
use nalgebra::DVector;

use crate::arm::Arm;
use crate::robot::drive_entry::ServoEntry;

/// Default gain of the position loop (1/s), bandwidth of the velocity loop (1/s), ratio of integral
/// to velocity gain (1/s), sampling period (s).
const SERVO: [f64; 4] = [20.0, 100.0, 20.0, 1e-3];
/// Maximum default velocity gain relative to the quick inertia divided by the sampling period; a
/// sampled velocity loop becomes unstable at 2.
const QUICK_GAIN: f64 = 0.4;

/// Inertia seen by a joint under a servo (kg m² or kg).
struct ServoInertia {
    /// Inertia of the rigid robot.
    inertia: f64,
    /// High-frequency inertia: with all other free coordinates free to accelerate.
    quick: f64,
}

impl ServoInertia {
    /// Returns the gains of position, velocity and integral: as given, or suitable defaults.
    fn gains(&self, servo: &ServoEntry, sample_s: f64) -> [f64; 3] {
        let [position, bandwidth, integral, _] = SERVO;
        // Between samples a motor only feels the inertia rigidly attached to it, because the
        // springs deflect.
        let fitting = (bandwidth * self.inertia).min(QUICK_GAIN * self.quick / sample_s);
        let velocity_gain = servo.velocity_gain.unwrap_or(fitting);
        // The outer loops must be slower than the velocity loop inside them.
        let slower = 0.25 * velocity_gain / self.inertia;
        let inner = |gain: f64| if servo.velocity_gain.is_none() { gain.min(slower) } else { gain };
        let integral_gain = servo.integral_gain.unwrap_or_else(|| inner(integral) * velocity_gain);
        [servo.position_gain.unwrap_or_else(|| inner(position)), velocity_gain, integral_gain]
    }
}

impl Arm {
    /// Returns the sampling period of the servos (s).
    pub(crate) fn sample_s(&self) -> f64 {
        self.torque.iter().find_map(|(_, servo, _)| servo.sample_s).unwrap_or(SERVO[3])
    }

    /// Returns the servos of the torque-driven joints; gains that the robot file omits suit the
    /// inertia with the joints at `q`.
    pub(crate) fn servo_axes(&self, q: &DVector<f64>) -> Vec<ServoAxis> {
        let sample_s = self.sample_s();
        let M = mass_matrix(&self.rigid, &mut Data::new(&self.rigid), q).clone();
        let axis = |((coordinate, servo, limit), quick): (&(usize, ServoEntry, f64), f64)| {
            let felt = ServoInertia { inertia: M[(*coordinate, *coordinate)], quick };
            let [position_gain, velocity_gain, integral_gain] = felt.gains(servo, sample_s);
            let (coordinate, limit) = (*coordinate, *limit);
            let feed_forward = f64::from(u8::from(servo.feed_forward.unwrap_or(true)));
            ServoAxis { coordinate, position_gain, velocity_gain, integral_gain, feed_forward, limit }
        };
        self.torque.iter().zip(self.quick_inertia(q)).map(axis).collect()
    }
}
