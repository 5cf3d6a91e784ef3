//! Friction of the joints of an arm with load-dependent friction and coupled gears: torques against the motion (N m
//! or N) and their slopes, per actuated coordinate.

use crate::gear::load_friction::LoadFriction;
use crate::gear::state::GearState;
use crate::plant::Plant;

impl Plant {
    /// Writes the friction of all actuated coordinates, at the given rates and transmitted torques,
    /// into `friction`.
    pub(crate) fn friction_torques(
        &self,
        rates: &[f64],
        transmitted: impl Fn(&LoadFriction) -> f64,
        friction: &mut [f64],
    ) {
        for (k, friction) in friction.iter_mut().enumerate() {
            *friction = match self.coupling.as_ref().and_then(|coupling| Some((coupling, coupling.place(k)?))) {
                None => self.friction_torque(k, rates[k]),
                // C^-T times the friction torques on the motors.
                Some((coupling, j)) => {
                    let motors = coupling.coordinates.iter().enumerate();
                    motors
                        .map(|(i, m)| {
                            coupling.C_inverse[(i, j)] * self.friction_torque(*m, coupling.motor_rate(i, rates))
                        })
                        .sum()
                }
            };
        }
        for law in &self.load_friction {
            friction[law.coordinate] += law.torque(transmitted(law), rates[law.coordinate]);
        }
    }

    /// Returns the derivative of the friction of one coordinate with respect to the rate of
    /// another; negative slopes of the friction laws count as zero.
    pub(crate) fn friction_slope(&self, row: usize, column: usize, rates: &[f64], gears: &GearState) -> f64 {
        let unloaded = self.unloaded_friction_slope(row, column, rates, 0.0);
        if row != column {
            return unloaded;
        }
        let loaded = self.load_friction.iter().filter(|law| law.coordinate == row);
        let loaded = loaded
            .map(|law| law.slope(law.element.map_or(0.0, |k| gears.F[self.offset(&self.elements[k])]), rates[row]));
        unloaded + loaded.sum::<f64>()
    }

    /// Returns the same derivative without load-dependent friction; the slope of each motor is at
    /// least `least`.
    pub(crate) fn unloaded_friction_slope(&self, row: usize, column: usize, rates: &[f64], least: f64) -> f64 {
        let rate = |k: usize| match self.coupling.as_ref().and_then(|coupling| Some((coupling, coupling.place(k)?))) {
            Some((coupling, motor)) => coupling.motor_rate(motor, rates),
            None => rates[k],
        };
        self.over_joints(row, column, |k| self.friction.get(k).map_or(0.0, |f| f.slope(rate(k)).max(least)))
    }

    /// Returns an entry of the damping over joints that has `of_motor` for the motor of each
    /// coordinate; off-diagonal entries exist only for motors that move several joints.
    pub(crate) fn over_joints(&self, row: usize, column: usize, of_motor: impl Fn(usize) -> f64) -> f64 {
        let places = self.coupling.as_ref().and_then(|c| Some((c, c.place(row)?, c.place(column)?)));
        if let Some((coupling, i, j)) = places {
            let C = &coupling.C_inverse;
            let motors = coupling.coordinates.iter().enumerate();
            return motors.map(|(m, k)| C[(m, i)] * of_motor(*k) * C[(m, j)]).sum();
        }
        if row == column { of_motor(row) } else { 0.0 }
    }
}
