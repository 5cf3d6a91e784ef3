//! Time-optimal law of a route with joint jerk limits. Every moving joint gets a jerk limit:
//! without a given one it is such that the acceleration rises to its limit in a given time.

use flexarm_trajectory::jerk_law::{QuinticLaw, least_time_with_jerks};
use flexarm_trajectory::time_law::{Law, LawError, PathPoint, least_time};

use crate::arm::ProgramArm;
use crate::limits::Limits;
use crate::route::Route;

/// A law with the jerk limits that it keeps.
pub(crate) struct JerkBounded {
    pub(crate) law: QuinticLaw,
    /// Jerk limit by joint, infinite for joints at rest.
    pub(crate) jerks: Vec<f64>,
    /// Names of the joints with a given jerk limit.
    pub(crate) given: Vec<Option<String>>,
}

impl JerkBounded {
    /// Computes the law along a route.
    ///
    /// * `points`: bounds at the stations.
    /// * `rise`: rise time of the acceleration of joints without a given jerk limit (s).
    pub(crate) fn new(points: &[PathPoint], route: &Route, arm: &ProgramArm<'_>, rise: f64) -> Result<Self, LawError> {
        let moves = |k: usize| route.stations.iter().any(|station| station.d[k] != 0.0 || station.after[k] != 0.0);
        let jerks: Vec<f64> = (0..arm.bounds.len())
            .map(|k| match &arm.bounds[k] {
                bounds if moves(k) => bounds.jerk.unwrap_or(bounds.acceleration / rise),
                _ => f64::INFINITY,
            })
            .collect();
        // Times in which joints reach their acceleration limits.
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
        let given = (0..arm.bounds.len()).map(|k| arm.bounds[k].jerk.map(|_| name(k))).collect();
        Ok(Self { law, jerks, given })
    }
}
