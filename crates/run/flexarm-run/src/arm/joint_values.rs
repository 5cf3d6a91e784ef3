//! Values of all actuated joints, checked against their number and range.

use flexarm_settings::Quantity;

use crate::error::Error;

/// Returns the values of all actuated joints; zeros by default.
///
/// # Errors
/// [`Error::Pose`] for a wrong number of values, and for values that are not finite.
pub fn joint_values(values: Option<&[f64]>, joints: &[&str]) -> Result<Vec<f64>, Error> {
    let Some(values) = values else { return Ok(vec![0.0; joints.len()]) };
    if values.len() != joints.len() {
        let message =
            format!("{} joint values given, the robot has {} movable joints: {joints:?}", values.len(), joints.len());
        return Err(Error::Pose(message));
    }
    match values.iter().zip(joints).find(|(value, _)| !value.is_finite()) {
        Some((value, joint)) => Err(Error::Pose(format!("joint {joint:?} at {value} is at no finite number"))),
        None => {
            let named = |(value, joint): (&f64, &&str)| Quantity::JOINT.check(&format!("joint {joint:?}"), *value);
            Ok(values.iter().zip(joints).map(named).collect::<Result<_, _>>()?)
        }
    }
}
