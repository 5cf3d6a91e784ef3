//! Default gains of servos: values that suit the inertia at the start, and their derivatives with
//! respect to changes of the robot.

use flexarm_kinematics::{Data, Model, mass_matrix};
use flexarm_stepping::{AxisSlope, ServoAxis};
use nalgebra::DVector;

use crate::drive_entry::ServoEntry;
use crate::flexible::FlexibleRobot;

/// Default gain of the position loop (1/s), bandwidth of the velocity loop (1/s), ratio of integral
/// to velocity gain (1/s), sampling period (s).
const SERVO: [f64; 4] = [20.0, 100.0, 20.0, 1e-3];
/// Maximum default velocity gain relative to the quick inertia divided by the sampling period; a
/// sampled velocity loop becomes unstable at 2.
const QUICK_GAIN: f64 = 0.4;

/// Inertia seen by a joint under a servo (kg m² or kg).
pub(crate) struct ServoInertia {
    /// Inertia of the rigid robot.
    inertia: f64,
    /// High-frequency inertia: with all other free coordinates free to accelerate.
    quick: f64,
}

impl ServoInertia {
    /// Returns the gains of position, velocity and integral: as given, or suitable defaults. `rule`
    /// decides which of the two rules limits them.
    fn gains(&self, servo: &ServoEntry, sample_s: f64, rule: &ServoInertia) -> [f64; 3] {
        let [position, bandwidth, integral, _] = SERVO;
        // Between samples a motor only feels the inertia rigidly attached to it, because the
        // springs deflect.
        let most = |felt: &ServoInertia| QUICK_GAIN * felt.quick / sample_s;
        let yields = bandwidth * rule.inertia > most(rule);
        let fitting = |felt: &ServoInertia| if yields { most(felt) } else { bandwidth * felt.inertia };
        let velocity = |felt: &ServoInertia| servo.velocity_gain.unwrap_or_else(|| fitting(felt));
        // The outer loops must be slower than the velocity loop inside them.
        let slower = |felt: &ServoInertia| 0.25 * velocity(felt) / felt.inertia;
        let limited = |gain: f64| servo.velocity_gain.is_none() && gain > slower(rule);
        let inner = |gain: f64| if limited(gain) { slower(self) } else { gain };
        let velocity_gain = velocity(self);
        let integral_gain = servo.integral_gain.unwrap_or_else(|| inner(integral) * velocity_gain);
        [servo.position_gain.unwrap_or_else(|| inner(position)), velocity_gain, integral_gain]
    }
}

impl FlexibleRobot {
    /// Returns the sampling period of the servos (s).
    pub(crate) fn sample_s(&self) -> f64 {
        self.torque.iter().find_map(|(_, servo, _)| servo.sample_s).unwrap_or(SERVO[3])
    }

    /// Returns, for each joint under a servo, the inertia of the rigid robot with the joints at `q`
    /// and the high-frequency inertia.
    pub(crate) fn inertias_felt(&self, model: &Model, rigid: &Model, q: &DVector<f64>) -> Vec<ServoInertia> {
        let M = mass_matrix(rigid, &mut Data::new(rigid), q).clone();
        let felt = |((k, ..), quick): (&(usize, ServoEntry, f64), f64)| ServoInertia { inertia: M[(*k, *k)], quick };
        self.torque.iter().zip(self.quick_inertia_of(model, q)).map(felt).collect()
    }

    /// Returns the servos of joints with these inertias.
    pub(crate) fn servo_axes(&self, felt: &[ServoInertia]) -> Vec<ServoAxis> {
        let sample_s = self.sample_s();
        let axis = |((coordinate, servo, limit), felt): (&(usize, ServoEntry, f64), &ServoInertia)| {
            let [position_gain, velocity_gain, integral_gain] = felt.gains(servo, sample_s, felt);
            let (coordinate, limit) = (*coordinate, *limit);
            let feed_forward = servo.feed_forward.unwrap_or(true);
            ServoAxis { coordinate, position_gain, velocity_gain, integral_gain, feed_forward, limit }
        };
        self.torque.iter().zip(felt).map(axis).collect()
    }

    /// Derivatives of the default gains with respect to a change of the robot, at zero change. `at`
    /// returns, for a given change, the tree, the tree of the rigid robot, and the joint values at
    /// the start of the motion. Given gains have zero slope.
    ///
    /// * `step`: small change for the finite differences.
    pub fn gain_slopes(&self, step: f64, at: impl Fn(f64) -> (Model, Model, DVector<f64>)) -> Vec<(usize, AxisSlope)> {
        let felt = |x: f64| {
            let (model, rigid, q) = at(x);
            self.inertias_felt(&model, &rigid, &q)
        };
        let here = felt(0.0);
        // Fourth-order central differences; the choice between the two rules is made once, at zero
        // change.
        let stencil =
            [(-2.0, 1.0), (-1.0, -8.0), (1.0, 8.0), (2.0, -1.0)].map(|(k, c)| (felt(k * step), c / (12.0 * step)));
        let mut slopes = Vec::new();
        for (number, (_, servo, _)) in self.torque.iter().enumerate() {
            let mut slope = [0.0; 3];
            for (felt, weight) in &stencil {
                let gains = felt[number].gains(servo, self.sample_s(), &here[number]);
                slope.iter_mut().zip(gains).for_each(|(slope, gain)| *slope += weight * gain);
            }
            let [position_gain, velocity_gain, integral_gain] = slope;
            slopes.push((number, AxisSlope { position_gain, velocity_gain, integral_gain, feed_forward: 0.0 }));
        }
        slopes
    }
}
