//! Balancers: forces that depend only on the configuration, like gravity.
//!
//! A balancer acts along the line between two points of the arm, or about one joint. It has a
//! single length x, and its law has the energy U(x):
//!
//! ```text
//! line:   x = |d|,  d = p_WTo - p_WFrom,  u = d/x      force on From  +T u,  on To  -T u      T = dU/dx: tension     (1)
//!         ∂(T u)/∂d = k u uᵀ + (T/x) (1 - u uᵀ)                                               k = dT/dx              (2)
//! joint:  x = Σ c_i q_i + x_0                           generalised force  -c_i T                                    (3)
//! ```
//! Force laws: [`BalancerLaw`]; element of the mechanism: [`Balancer`]. All `f64` recursions
//! include balancers, those of [`crate::lanes`] do not. Not here: files, friction in a cylinder,
//! heat transfer.

use std::collections::HashSet;

use flexarm_spatial::{Pose, Twist, Wrench};
use nalgebra::{Matrix3, Vector3};

use crate::data::Data;
use crate::kinematics::place_bodies;
use crate::mechanism::Mechanism;
use crate::model::{Body, Frame, JointMotion, Model, ModelError};

/// Balancer of a mechanism; links and joints are given by name.
#[derive(Clone, Debug, PartialEq)]
pub struct Balancer {
    /// Unique name.
    pub name: String,
    /// Points or joint on which it acts.
    pub span: BalancerSpan,
    /// Force law.
    pub law: BalancerLaw,
}

/// Points or joint between which a balancer acts.
#[derive(Clone, Debug, PartialEq)]
pub enum BalancerSpan {
    /// Along the line between the origins of two links. Frames on fixed joints move with the part
    /// of a flexible link that carries them.
    Points {
        /// Name of the first link.
        from: String,
        /// Name of the second link.
        to: String,
    },
    /// About a single-DoF joint, between its two links; the value includes the deflection of drive
    /// springs inside the joint.
    Joint {
        /// Name of the joint.
        joint: String,
        /// Name of the child link.
        child: String,
    },
}

/// Force law: tension as a function of length, with energy and rate.
///
/// x is the length of a line (m) or the value of a joint (rad or m), T the tension (N, or N m about
/// a rotating joint). Positive tension pulls the ends together, or the joint to lower values.
#[derive(Clone, Debug, PartialEq)]
pub enum BalancerLaw {
    /// `T = preload + rate (x - free)`.
    Linear {
        /// Spring rate (N/m, N m/rad or N/m).
        rate: f64,
        /// Length, angle or position at which the tension equals the preload (m, rad or m).
        free: f64,
        /// Preload (N or N m).
        preload: f64,
    },
    /// Gas spring.
    Gas(GasLaw),
    /// `T = -amplitude sin(x - zero)`, which balances a weight on one joint.
    Sine {
        /// Maximum torque (N m).
        amplitude: f64,
        /// Angle of zero torque (rad).
        zero: f64,
    },
    /// Interpolated curve.
    Curve(BalancerCurve),
}

/// Gas under a piston, `p V^n` constant.
///
/// ```text
/// pulls:   T =   force v^-n - opposing,     v = 1 - slope (x - at)    volume decreases with length
/// pushes:  T = -(force v^-n - opposing),    v = 1 + slope (x - at)    volume increases with length
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GasLaw {
    /// Pressure times area of the piston at the length `at` (N).
    pub force: f64,
    /// Force on the other side of the piston, such as from ambient pressure (N).
    pub opposing: f64,
    /// Reference length (m).
    pub at: f64,
    /// Piston area over gas volume at the reference length (1/m).
    pub slope: f64,
    /// Polytropic exponent n: 1 for isothermal, 1.4 for adiabatic nitrogen.
    pub exponent: f64,
    /// Whether it pulls its ends together; otherwise it pushes them apart.
    pub pulls: bool,
}

impl GasLaw {
    /// Gas volume relative to that at the length `at`.
    pub fn volume_ratio(&self, x: f64) -> f64 {
        let stretch = self.slope * (x - self.at);
        if self.pulls { 1.0 - stretch } else { 1.0 + stretch }
    }

    /// Length at which the gas volume vanishes (m); infinite, with either sign, if `slope` is zero.
    pub fn end(&self) -> f64 {
        let reach = if self.slope > 0.0 { 1.0 / self.slope } else { f64::INFINITY };
        if self.pulls { self.at + reach } else { self.at - reach }
    }

    fn sign(&self) -> f64 {
        if self.pulls { 1.0 } else { -1.0 }
    }

    /// `v^-n`; NaN for a non-positive volume.
    fn rise(&self, x: f64) -> f64 {
        let v = self.volume_ratio(x);
        if v > 0.0 { v.powf(-self.exponent) } else { f64::NAN }
    }

    fn energy(&self, x: f64) -> f64 {
        let (way, n) = (self.sign() * (x - self.at), self.exponent);
        if self.slope == 0.0 {
            return (self.force - self.opposing) * way;
        }
        let v = self.volume_ratio(x);
        let log = if v > 0.0 { v.ln() } else { f64::NAN };
        // ∫ v^-n, regular at n = 1.
        let work = if n == 1.0 { -log } else { ((1.0 - n) * log).exp_m1() / (n - 1.0) };
        self.force / self.slope * work - self.opposing * way
    }
}

impl BalancerLaw {
    /// Tension T at x (N, N m); NaN beyond the end of a gas spring.
    pub fn tension(&self, x: f64) -> f64 {
        match self {
            Self::Linear { rate, free, preload } => preload + rate * (x - free),
            Self::Gas(gas) => gas.sign() * (gas.force * gas.rise(x) - gas.opposing),
            Self::Sine { amplitude, zero } => -amplitude * (x - zero).sin(),
            Self::Curve(curve) => curve.at(x)[0],
        }
    }

    /// Rate dT/dx (N/m, N m/rad).
    pub fn rate(&self, x: f64) -> f64 {
        match self {
            Self::Linear { rate, .. } => *rate,
            Self::Gas(gas) => gas.force * gas.exponent * gas.slope * gas.rise(x) / gas.volume_ratio(x),
            Self::Sine { amplitude, zero } => -amplitude * (x - zero).cos(),
            Self::Curve(curve) => curve.at(x)[1],
        }
    }

    /// Energy U (J), the integral of T from a reference point of the law.
    pub fn energy(&self, x: f64) -> f64 {
        match self {
            Self::Linear { rate, free, preload } => (preload + 0.5 * rate * (x - free)) * (x - free),
            Self::Gas(gas) => gas.energy(x),
            // Relative to the balanced position: amplitude (cos - 1) without cancellation.
            Self::Sine { amplitude, zero } => -2.0 * amplitude * (0.5 * (x - zero)).sin().powi(2),
            Self::Curve(curve) => curve.at(x)[2],
        }
    }

    fn is_finite(&self) -> bool {
        match self {
            Self::Linear { rate, free, preload } => [rate, free, preload].iter().all(|x| x.is_finite()),
            Self::Gas(gas) => {
                [gas.force, gas.opposing, gas.at, gas.slope, gas.exponent].iter().all(|x| x.is_finite())
                    && gas.slope >= 0.0
            }
            Self::Sine { amplitude, zero } => amplitude.is_finite() && zero.is_finite(),
            Self::Curve(_) => true,
        }
    }
}

/// Interpolated tension: piecewise cubics with continuous slope and no overshoot between data
/// points [Fritsch & Butland 1984]; linear extrapolation beyond the first and last point.
#[derive(Clone, Debug, PartialEq)]
pub struct BalancerCurve {
    x: Vec<f64>,
    T: Vec<f64>,
    slope: Vec<f64>,
    /// Energy at the data points, relative to the first.
    U: Vec<f64>,
}

/// Reason why points do not define a curve.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BalancerCurveError {
    /// Fewer than two points.
    #[error("a curve needs at least two points, found {found}")]
    TooFew {
        /// Number of points.
        found: usize,
    },
    /// A value is NaN or infinite.
    #[error("point {number} of the curve has the entry {value}, expected finite numbers")]
    NotFinite {
        /// Number of the point, from 1.
        number: usize,
        /// The value.
        value: f64,
    },
    /// The x values do not increase.
    #[error("after {before} comes {after}: the first numbers of the points must rise")]
    Order {
        /// x of a point.
        before: f64,
        /// x of the next point.
        after: f64,
    },
}

impl BalancerCurve {
    /// Builds the curve through points (x, T).
    ///
    /// # Errors
    /// [`BalancerCurveError`] for fewer than two points, non-finite values, or x values that are
    /// not strictly increasing.
    pub fn new(points: &[[f64; 2]]) -> Result<Self, BalancerCurveError> {
        if points.len() < 2 {
            return Err(BalancerCurveError::TooFew { found: points.len() });
        }
        for (k, point) in points.iter().enumerate() {
            if let Some(value) = point.iter().find(|x| !x.is_finite()) {
                return Err(BalancerCurveError::NotFinite { number: k + 1, value: *value });
            }
        }
        if let Some(pair) = points.windows(2).find(|pair| pair[1][0] <= pair[0][0]) {
            return Err(BalancerCurveError::Order { before: pair[0][0], after: pair[1][0] });
        }
        let (x, T): (Vec<f64>, Vec<f64>) = points.iter().map(|p| (p[0], p[1])).unzip();
        let slope = monotone_slopes(&x, &T);
        let mut U = vec![0.0];
        for k in 1..x.len() {
            let h = x[k] - x[k - 1];
            U.push(U[k - 1] + 0.5 * h * (T[k - 1] + T[k]) + h * h * (slope[k - 1] - slope[k]) / 12.0);
        }
        Ok(Self { x, T, slope, U })
    }

    /// First and last x of the data points.
    pub fn range(&self) -> [f64; 2] {
        [self.x[0], self.x[self.x.len() - 1]]
    }

    /// Tension, slope, and energy relative to the first point.
    fn at(&self, x: f64) -> [f64; 3] {
        let last = self.x.len() - 1;
        let straight = |k: usize| {
            let d = x - self.x[k];
            [self.T[k] + self.slope[k] * d, self.slope[k], self.U[k] + (self.T[k] + 0.5 * self.slope[k] * d) * d]
        };
        let k = match self.x.partition_point(|p| *p <= x) {
            0 => return straight(0),
            k if k > last => return straight(last),
            k => k - 1,
        };
        // T = T0 + m0 s + a s² + b s³
        let (h, s) = (self.x[k + 1] - self.x[k], x - self.x[k]);
        let (m0, m1, secant) = (self.slope[k], self.slope[k + 1], (self.T[k + 1] - self.T[k]) / h);
        let a = (3.0 * secant - 2.0 * m0 - m1) / h;
        let b = (m0 + m1 - 2.0 * secant) / (h * h);
        [
            self.T[k] + s * (m0 + s * (a + s * b)),
            m0 + s * (2.0 * a + s * 3.0 * b),
            self.U[k] + s * (self.T[k] + s * (0.5 * m0 + s * (a / 3.0 + s * 0.25 * b))),
        ]
    }
}

/// Slopes at the data points: weighted harmonic means of the secants, zero at extrema [Fritsch &
/// Butland 1984].
fn monotone_slopes(x: &[f64], T: &[f64]) -> Vec<f64> {
    let secants: Vec<f64> = (1..x.len()).map(|k| (T[k] - T[k - 1]) / (x[k] - x[k - 1])).collect();
    let inner = |k: usize| {
        let (a, b) = (secants[k - 1], secants[k]);
        let (before, after) = (x[k] - x[k - 1], x[k + 1] - x[k]);
        if a * b <= 0.0 {
            return 0.0;
        }
        3.0 * (before + after) / ((2.0 * after + before) / a + (after + 2.0 * before) / b)
    };
    let last = x.len() - 1;
    (0..=last)
        .map(|k| match k {
            0 => secants[0],
            k if k == last => secants[last - 1],
            k => inner(k),
        })
        .collect()
}

/// Balancer placed on the tree.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedBalancer {
    /// Name of the balancer.
    pub name: String,
    /// Force law.
    pub law: BalancerLaw,
    /// Points or joint on which it acts.
    pub place: BalancerPlace,
}

/// Points or joint of the tree on which a balancer acts.
#[derive(Clone, Debug, PartialEq)]
pub enum BalancerPlace {
    /// Between two points: body, and position from Bo in body axes (m).
    Points([(usize, Vector3<f64>); 2]),
    /// About a joint.
    Joint {
        /// Coordinates and their factors c.
        terms: Vec<(usize, f64)>,
        /// `x_0` (rad or m).
        offset: f64,
        /// Body that carries the joint.
        parent: usize,
        /// First body outward of the joint; the axis is constant in its axes.
        body: usize,
        /// Last body outward of the drive springs.
        child: usize,
        /// Joint twist per unit of x, in axes of `body`.
        axis: Twist,
    },
}

/// Force and stiffness of a line balancer at given poses, (1) and (2).
#[derive(Clone, Copy, Debug)]
pub struct BalancerLine {
    /// The two bodies.
    pub bodies: [usize; 2],
    /// Positions of the two ends in their bodies (m).
    pub p_B: [Vector3<f64>; 2],
    /// Positions of the two ends in the world (m).
    pub p_W: [Vector3<f64>; 2],
    /// Distance (m).
    pub length: f64,
    /// Force on the first end, world axes (N); the second end has the opposite force.
    pub F_W: Vector3<f64>,
    /// Stiffness (2), world axes (N/m).
    pub K_W: Matrix3<f64>,
}

impl BalancerLine {
    fn new(law: &BalancerLaw, ends: &[(usize, Vector3<f64>); 2], X_WB: &[Pose]) -> Self {
        let p_W = ends.map(|(body, p_B)| X_WB[body].rotation * p_B + X_WB[body].translation.vector);
        let d = p_W[1] - p_W[0];
        let length = d.norm();
        let (T, k) = (law.tension(length), law.rate(length));
        let bodies = ends.map(|(body, _)| body);
        let p_B = ends.map(|(_, p_B)| p_B);
        // At zero length with zero tension the direction is undefined, but the force is zero and
        // the stiffness isotropic.
        if length == 0.0 && T == 0.0 {
            return Self { bodies, p_B, p_W, length, F_W: Vector3::zeros(), K_W: Matrix3::from_diagonal_element(k) };
        }
        let (u, across) = (d / length, T / length);
        let K_W = Matrix3::from_diagonal_element(across) + u * u.transpose() * (k - across);
        Self { bodies, p_B, p_W, length, F_W: u * T, K_W }
    }
}

impl PlacedBalancer {
    /// Line at these body poses; `None` for a balancer about a joint.
    pub fn line(&self, X_WB: &[Pose]) -> Option<BalancerLine> {
        match &self.place {
            BalancerPlace::Points(ends) => Some(BalancerLine::new(&self.law, ends, X_WB)),
            BalancerPlace::Joint { .. } => None,
        }
    }

    /// Length of the line (m) or value of the joint (rad or m) at these poses and coordinates.
    pub fn length(&self, X_WB: &[Pose], q: &[f64]) -> f64 {
        match &self.place {
            BalancerPlace::Points(ends) => BalancerLine::new(&self.law, ends, X_WB).length,
            BalancerPlace::Joint { terms, offset, .. } => terms.iter().fold(*offset, |x, (k, c)| x + c * q[*k]),
        }
    }

    /// Wrenches on the two bodies about their origins, in world axes, at length or joint value `x`.
    /// About a joint with a six-DoF spring, they are exact to first order in its deflection.
    pub fn wrenches(&self, X_WB: &[Pose], x: f64) -> [(usize, Wrench); 2] {
        let at_origin = |body: usize, p_W: &Vector3<f64>, F: Vector3<f64>| {
            let arm = p_W - X_WB[body].translation.vector;
            (body, Wrench::new(F, arm.cross(&F)))
        };
        match &self.place {
            BalancerPlace::Points(ends) => {
                let line = BalancerLine::new(&self.law, ends, X_WB);
                [at_origin(line.bodies[0], &line.p_W[0], line.F_W), at_origin(line.bodies[1], &line.p_W[1], -line.F_W)]
            }
            BalancerPlace::Joint { parent, body, child, axis, .. } => {
                let R = X_WB[*body].rotation;
                let T = self.law.tension(x);
                if axis.angular.norm_squared() > 0.0 {
                    let moment = R * axis.angular * T;
                    let of = |moment: Vector3<f64>| Wrench::new(Vector3::zeros(), moment);
                    return [(*parent, of(moment)), (*child, of(-moment))];
                }
                let (force, p_W) = (R * axis.linear * T, X_WB[*child].translation.vector);
                [at_origin(*parent, &p_W, force), at_origin(*child, &p_W, -force)]
            }
        }
    }
}

/// Places the balancers of a mechanism on its bodies.
///
/// # Errors
/// [`ModelError::Duplicate`], [`ModelError::UnknownLink`] and [`ModelError::BadBalancer`].
pub(crate) fn place_balancers(
    mechanism: &Mechanism,
    frames: &[Frame],
    bodies: &[Body],
    nv: usize,
) -> Result<Vec<PlacedBalancer>, ModelError> {
    let mut names = HashSet::new();
    let mut placed = Vec::new();
    for Balancer { name, span, law } in &mechanism.balancers {
        if !names.insert(name) {
            return Err(ModelError::Duplicate { what: "balancer", name: name.clone() });
        }
        if !law.is_finite() {
            return Err(ModelError::NotFinite { what: "law of balancer", name: name.clone() });
        }
        let fail = |what: &'static str| ModelError::BadBalancer { balancer: name.clone(), what };
        let frame =
            |link: &String, what: &'static str| frames.iter().find(|f| f.name == *link).ok_or_else(|| fail(what));
        let place = match span {
            BalancerSpan::Points { from, to } => {
                let ends = [frame(from, "the link at its first end")?, frame(to, "the link at its second end")?];
                BalancerPlace::Points(ends.map(|f| (f.body, f.X_BF.translation.vector)))
            }
            BalancerSpan::Joint { joint, child } => {
                let last = frame(child, "the link behind its joint")?.body;
                let place = over_joint(bodies, joint, last).ok_or_else(|| fail("its joint"))?;
                if matches!(&place, BalancerPlace::Joint { terms, .. } if terms.iter().any(|(k, _)| *k >= nv)) {
                    return Err(ModelError::BadLoop {
                        name: name.clone(),
                        what: format!(
                            "balancer {name:?} acts over joint {joint:?}, which follows from a loop: give its two ends (from, to) instead"
                        ),
                    });
                }
                place
            }
        };
        placed.push(PlacedBalancer { name: name.clone(), law: law.clone(), place });
    }
    Ok(placed)
}

/// Sums over the bodies from `child` inward to that of the joint: each contributes its rotation (or
/// translation) projected on the joint axis.
fn over_joint(bodies: &[Body], joint: &str, child: usize) -> Option<BalancerPlace> {
    let first = bodies.iter().skip(1).position(|b| b.joint == joint)? + 1;
    let JointMotion::Axis(motion) = bodies[first].motion else { return None };
    let (axis, slides) = (motion.axis(), motion.slides());
    let (mut terms, mut offset) = (Vec::new(), 0.0);
    let mut i = child;
    loop {
        let body = &bodies[i];
        match body.motion {
            JointMotion::Axis(motion) => {
                let share = motion.axis().dot(&axis);
                terms.push((body.coordinate, share * body.ratio));
                offset += share * body.offset;
            }
            JointMotion::Elastic(_) => {
                let k = body.coordinate + if slides { 0 } else { 3 };
                terms.extend(axis.iter().enumerate().map(|(c, share)| (k + c, *share)));
            }
            JointMotion::Welded | JointMotion::Interface { .. } => return None,
        }
        if i == first {
            break;
        }
        i = body.parent;
        if i < first {
            return None;
        }
    }
    terms.retain(|(_, c)| *c != 0.0);
    Some(BalancerPlace::Joint {
        terms,
        offset,
        parent: bodies[first].parent,
        body: first,
        child,
        axis: motion.twist(1.0),
    })
}

/// Computes lengths and joint values at the poses in `data.X_WB`, for [`energy`].
pub(crate) fn measure(model: &Model, data: &mut Data, q: &[f64]) {
    for (x, balancer) in data.balanced.iter_mut().zip(&model.balancers) {
        *x = balancer.length(&data.X_WB, q);
    }
}

/// Energy of all balancers (J) at the last measured lengths.
pub(crate) fn energy(model: &Model, data: &Data) -> f64 {
    model.balancers.iter().zip(&data.balanced).map(|(balancer, x)| balancer.law.energy(*x)).sum()
}

/// Runs a recursion with the forces of line balancers added to the external wrenches; restores
/// `data.F_ext` afterwards.
pub(crate) fn with_lines(model: &Model, data: &mut Data, q: &[f64], run: impl FnOnce(&mut Data)) {
    place_bodies(model, data, q);
    measure(model, data, q);
    data.F_held.copy_from_slice(&data.F_ext);
    for balancer in &model.balancers {
        let Some(line) = balancer.line(&data.X_WB) else { continue };
        for (end, F_W) in [line.F_W, -line.F_W].into_iter().enumerate() {
            let body = line.bodies[end];
            let F_B = data.X_WB[body].rotation.inverse() * F_W;
            data.F_ext[body] += Wrench::new(F_B, line.p_B[end].cross(&F_B));
        }
    }
    run(data);
    data.F_ext.copy_from_slice(&data.F_held);
}

/// `τ += factor c T`, (3): with factor 1 the forces that hold the joints against their balancers.
pub(crate) fn add_joint_torques(model: &Model, data: &mut Data, factor: f64) {
    for (balancer, x) in model.balancers.iter().zip(&data.balanced) {
        if let BalancerPlace::Joint { terms, .. } = &balancer.place {
            let T = factor * balancer.law.tension(*x);
            for (k, c) in terms {
                data.tau[*k] += c * T;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn laws() -> Vec<(BalancerLaw, Vec<f64>)> {
        let gas = |pulls, exponent, slope| {
            BalancerLaw::Gas(GasLaw { force: 27e3, opposing: 170.0, at: 0.6, slope, exponent, pulls })
        };
        let points = [[-1.0, 30.0], [-0.2, 80.0], [0.1, 80.0], [0.5, -20.0], [1.5, -60.0]];
        vec![
            (BalancerLaw::Linear { rate: 4e4, free: 0.5, preload: 700.0 }, vec![0.2, 0.5, 0.9]),
            (gas(true, 1.0, 1.7), vec![0.5, 0.6, 0.9]),
            (gas(true, 1.4, 1.7), vec![0.5, 0.6, 0.9]),
            (gas(false, 1.3, 1.7), vec![0.3, 0.6, 0.9]),
            (gas(false, 1.0, 0.0), vec![0.3, 0.6, 0.9]),
            (BalancerLaw::Sine { amplitude: 9e3, zero: -1.4 }, vec![-2.0, -1.4, 0.3]),
            (BalancerLaw::Curve(BalancerCurve::new(&points).unwrap()), vec![-1.5, -0.6, 0.0, 0.3, 1.1, 2.0]),
        ]
    }

    /// T = dU/dx and k = dT/dx by central differences of every law; measured below 2e-9 relative.
    #[test]
    fn tension_and_rate_are_the_derivatives_of_the_energy() {
        let h = 1e-5;
        for (law, places) in laws() {
            for x in places {
                let T = (law.energy(x + h) - law.energy(x - h)) / (2.0 * h);
                let k = (law.tension(x + h) - law.tension(x - h)) / (2.0 * h);
                assert!((T - law.tension(x)).abs() < 1e-7 * (1.0 + T.abs()), "{law:?} at {x}: {T}");
                assert!((k - law.rate(x)).abs() < 1e-6 * (1.0 + k.abs()), "{law:?} at {x}: {k}");
            }
        }
    }

    /// Truth: Boyle's law, p V constant, and Poisson's, p V^n constant.
    #[test]
    fn a_gas_at_half_its_volume_presses_twice_as_hard_and_more_if_it_cannot_cool() {
        let at_half = |exponent| {
            let gas = GasLaw { force: 1000.0, opposing: 0.0, at: 0.5, slope: 2.0, exponent, pulls: false };
            BalancerLaw::Gas(gas).tension(0.25)
        };
        assert!((at_half(1.0) + 2000.0).abs() < 1e-9);
        assert!((at_half(1.4) + 1000.0 * 2f64.powf(1.4)).abs() < 1e-9);
        let gas = GasLaw { force: 1.0, opposing: 0.0, at: 0.5, slope: 2.0, exponent: 1.0, pulls: true };
        assert_eq!(gas.end(), 1.0);
        assert!(BalancerLaw::Gas(gas).tension(1.01).is_nan());
    }

    #[test]
    fn a_curve_goes_through_its_points_and_does_not_overshoot_them() {
        let points = [[0.0, 0.0], [1.0, 0.0], [2.0, 10.0], [3.0, 10.0]];
        let curve = BalancerCurve::new(&points).unwrap();
        for [x, T] in points {
            assert!((curve.at(x)[0] - T).abs() < 1e-12);
        }
        assert!((0..=300).all(|k| (-1e-12..=10.0 + 1e-12).contains(&curve.at(f64::from(k) * 0.01)[0])));
        assert!(matches!(BalancerCurve::new(&points[..1]), Err(BalancerCurveError::TooFew { found: 1 })));
        assert!(matches!(BalancerCurve::new(&[[1.0, 0.0], [1.0, 2.0]]), Err(BalancerCurveError::Order { .. })));
        assert!(matches!(
            BalancerCurve::new(&[[1.0, f64::NAN], [2.0, 2.0]]),
            Err(BalancerCurveError::NotFinite { .. })
        ));
    }
}
