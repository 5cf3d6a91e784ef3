//! The least time of a route within the jerks of its joints. They bound every joint: one of which
//! none is told raises its acceleration to its bound in a given time.

use crate::jerk_law::{QuinticLaw, least_time_with_jerks};
use crate::limits::Limits;
use crate::plan::ProgramArm;
use crate::route::Route;
use crate::time_law::{Law, LawError, PathPoint, least_time};

/// Is the jerk of some joint told?
pub(crate) fn has_jerks(arm: &ProgramArm<'_>) -> bool {
    arm.bounds.iter().any(|bounds| bounds.jerk.is_some())
}

/// A law with the bounds of jerk that it keeps.
pub(crate) struct JerkBounded {
    pub(crate) law: QuinticLaw,
    /// By joint, infinite where it stays.
    pub(crate) jerks: Vec<f64>,
    /// Names of joints whose jerk is told.
    pub(crate) told: Vec<Option<String>>,
}

impl JerkBounded {
    /// * `points`: what holds at the stations.
    /// * `rise`: s, of joints whose jerk is not told.
    pub(crate) fn new(points: &[PathPoint], route: &Route, arm: &ProgramArm<'_>, rise: f64) -> Result<Self, LawError> {
        let moves = |k: usize| route.stations.iter().any(|station| station.d[k] != 0.0 || station.after[k] != 0.0);
        let jerks: Vec<f64> = (0..arm.bounds.len())
            .map(|k| match &arm.bounds[k] {
                bounds if moves(k) => bounds.jerk.unwrap_or(bounds.acceleration / rise),
                _ => f64::INFINITY,
            })
            .collect();
        // Times in which joints reach their accelerations.
        let rises = arm.bounds.iter().zip(&jerks).filter(|(_, jerk)| jerk.is_finite());
        let rises: Vec<f64> = rises.map(|(bounds, jerk)| bounds.acceleration / jerk).collect();
        let (shortest, longest) = rises.iter().fold((f64::INFINITY, 0.0f64), |(a, b), x| (a.min(*x), b.max(*x)));

        let s: Vec<f64> = points.iter().map(|point| point.s).collect();
        let law = Law::new(&s, &least_time(points)?);
        let window = if rises.is_empty() { rise } else { longest.min(law.duration()) };
        let law = law.smoothed(window);
        let mut limits = Limits::new(route, arm, Some(rise));
        let law = least_time_with_jerks(&law, &s, shortest, &mut |k, s| limits.at(k, s));
        let name = |k: usize| arm.model.coordinates()[k].joint.clone();
        let told = (0..arm.bounds.len()).map(|k| arm.bounds[k].jerk.map(|_| name(k))).collect();
        Ok(Self { law, jerks, told })
    }
}
