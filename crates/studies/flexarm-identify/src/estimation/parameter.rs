//! Unknown parameters of an arm, and the arm with given parameter values.
//!
//! A parameter has three coordinates: its value in the robot file, the search coordinate x (0 at the
//! initial value, often a logarithm) in which derivatives are, and the unknown z of the fit, a
//! compliance for springs. Start at [`Parameter`] and [`NominalArm::with`].
//!
//! Frames: B body, J joint frame in its parent P, L link, T tool; inertias about Bo in B axes.
//! Not here: names and places in the robot file ([`crate::parameters`]).

use std::sync::Arc;

use flexarm_kinematics::{Frame, LinkInertia, Model, Pose, SpatialInertia};
use flexarm_stepping::{Damping, GearCoupling, GuideTerm, Held, Plant, Spring, SpringCurve, StepError};
use nalgebra::{DMatrix, Matrix3, Rotation3, Translation3, Vector3, Vector6};

use crate::estimation::least_squares::Unknown;

/// Model of an arm: tree, springs in coordinate order, tool.
#[derive(Clone, Debug)]
pub struct NominalArm {
    /// Kinematic tree.
    pub model: Arc<Model>,
    /// Springs, one per elastic group.
    pub springs: Vec<Spring>,
    /// Tool frame.
    pub tool: Frame,
    /// Coupling of gears that move several joints; `springs` then contains the springs of their
    /// motors.
    pub coupling: Option<GearCoupling>,
}

/// Spring, or one of its coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SpringPart {
    /// Number of the spring.
    pub spring: usize,
    /// One of its coordinates; all of them if `None`.
    pub coordinate: Option<usize>,
}

/// Part of a link on a body; a rigid link has one.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkPart {
    /// Number of the body.
    pub body: usize,
    /// Pose of the link's axes in the body.
    pub X_BL: Pose,
    /// Initial mass properties of the part, link axes.
    pub inertia: LinkInertia,
}

impl LinkPart {
    /// Returns the inertia about Bo, B axes, with a factor on the mass and a shifted centre of mass.
    fn spatial(&self, factor: f64, shift: &Vector3<f64>) -> SpatialInertia {
        let LinkInertia { mass, com, inertia_com } = self.inertia;
        SpatialInertia::from_com(factor * mass, &(com + shift), &(inertia_com * factor)).at_parent(&self.X_BL)
    }
}

/// Effect of a parameter on the arm.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// Factor on the stiffness of springs. For one coordinate of a spring, K becomes `S K S` with
    /// `√factor` there, so that K stays symmetric and positive definite.
    Stiffness(Vec<SpringPart>),
    /// Entry of a spring's matrix and its mirror image. The search coordinate is the change of the
    /// parameter's value, and the entry changes by `factor` times that. The matrix must stay
    /// positive definite: otherwise the arm has no solution, and the search rejects the step. Not
    /// to be combined with [`Effect::Stiffness`] on the same spring.
    Entry {
        /// Number of the spring.
        spring: usize,
        /// Row, from 0.
        row: usize,
        /// Column, from 0.
        column: usize,
        /// Change of the entry per unit of the value.
        factor: f64,
        /// `√(K_ii K_jj)` in the unit of the value, the scale of the entry.
        size: f64,
    },
    /// Translation of the tool along one of its own axes (0 to 2; m), or component of a rotation
    /// vector about them (3 to 5; rad). Together they give `X_BT exp`, with the displacement in the
    /// initial axes. Measured points, loads and payload at the tool move with it.
    Tool(usize),
    /// Factor on the damping of springs of any damping model.
    Damping(Vec<usize>),
    /// Factor on the damper of one coordinate of a spring.
    Damper {
        /// Number of the spring.
        spring: usize,
        /// Coordinate of the spring, from 0.
        coordinate: usize,
    },
    /// Number of the laws of telescopic guides. The search coordinate is the logarithm of a
    /// positive number, and the change of others.
    Guide {
        /// Numbers of the springs.
        springs: Vec<usize>,
        /// Number of the law.
        term: GuideTerm,
        /// Scale of the number, in its unit.
        size: f64,
    },
    /// Displacement of the joint frame of a body along a twist in its own axes, linear part first
    /// (m, rad): `X_PJ exp`. Displacements of one body follow each other in the order of the
    /// parameters.
    Frame {
        /// Number of the body.
        body: usize,
        /// Twist per unit of the search coordinate.
        twist: Vector6<f64>,
        /// Usual size of the displacement (m, rad).
        size: f64,
    },
    /// Mass (kg) with inertia proportional to it: per kilogram on each body, about Bo, B axes.
    Mass(Vec<(usize, SpatialInertia)>),
    /// Mass of a link (kg) at constant centre of mass and radii of gyration, or a coordinate of its
    /// centre of mass in link axes (m). Parameters of one link have equal parts.
    Link {
        /// Parts of the link.
        parts: Vec<LinkPart>,
        /// Axis of the centre of mass, 0 to 2; `None` for the mass.
        axis: Option<usize>,
        /// Usual size of an error of the number (kg or m).
        size: f64,
    },
}

impl Effect {
    /// Returns the change of the inertia of bodies per unit of a mass or a centre of mass.
    ///
    /// * `factor`, `shift`: present factor on the mass of the link and shift of its centre of mass.
    pub(crate) fn inertia_rates(&self, factor: f64, shift: &Vector3<f64>) -> Vec<(usize, SpatialInertia)> {
        match self {
            Self::Mass(on) => on.clone(),
            Self::Link { parts, axis, .. } => {
                let all: f64 = parts.iter().map(|part| part.inertia.mass).sum();
                let rate = |part: &LinkPart| match axis {
                    None => scaled(&part.spatial(1.0, shift), 1.0 / all),
                    Some(axis) => {
                        let along = part.X_BL.rotation * Vector3::ith(*axis, 1.0);
                        carried_along(&part.spatial(factor, shift), &Vector3::zeros(), &along, &Vector3::zeros())
                    }
                };
                parts.iter().map(|part| (part.body, rate(part))).collect()
            }
            _ => Vec::new(),
        }
    }
}

/// Returns the factor on the mass of a link and the shift of its centre of mass (m).
pub(crate) fn link_change(parameters: &[Parameter], x: &[f64], of: &[LinkPart]) -> (f64, Vector3<f64>) {
    let all: f64 = of.iter().map(|part| part.inertia.mass).sum();
    let (mut factor, mut shift) = (1.0, Vector3::zeros());
    for (parameter, x) in parameters.iter().zip(x) {
        match &parameter.effect {
            Effect::Link { parts, axis: None, .. } if parts == of => factor += x / all,
            Effect::Link { parts, axis: Some(axis), .. } if parts == of => shift[*axis] += x,
            _ => {}
        }
    }
    (factor, shift)
}

/// Unknown parameter of an arm.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name for output, as in robot files.
    pub name: String,
    /// Unit of the value.
    pub unit: String,
    /// Initial value.
    pub initial: f64,
    /// Standard deviation of the search coordinate about the initial value if it is known: of the
    /// logarithm for stiffness and damping, otherwise in the unit of the value. `None` if the
    /// initial value says only the order of magnitude.
    pub prior: Option<f64>,
    /// Effect on the arm.
    pub effect: Effect,
}

/// Standard deviation of a compliance about zero, over the compliance of the initial value.
const COMPLIANCE: f64 = 10.0;
/// Minimum compliance over its standard deviation: a stiffness beyond it has the effect of a rigid
/// spring.
const RIGID: f64 = 1e-6;
/// Minimum mass of a link over the initial one.
const LIGHTEST: f64 = 0.01;
/// Standard deviation of the logarithm of a positive number of known order of magnitude.
const MAGNITUDE: f64 = std::f64::consts::LN_10;

impl Parameter {
    /// Whether the search coordinate is the logarithm of the value, which keeps the value positive.
    pub fn is_logarithmic(&self) -> bool {
        match &self.effect {
            Effect::Stiffness(_) | Effect::Damping(_) | Effect::Damper { .. } => true,
            Effect::Guide { term, .. } => term.is_positive(),
            _ => false,
        }
    }

    /// Whether the parameter is a compliance, a stiffness or a clearance: the fit seeks a number
    /// that is 0 for a rigid arm.
    pub fn is_yielding(&self) -> bool {
        match &self.effect {
            Effect::Stiffness(_) => true,
            Effect::Guide { term, .. } => matches!(term, GuideTerm::Compliance(_) | GuideTerm::Gap),
            _ => false,
        }
    }

    /// Returns the standard deviation of the search coordinate that is assumed without other
    /// knowledge, for plans of measurements; a stiffness is identified if it is known better.
    pub fn reference(&self) -> f64 {
        match &self.effect {
            Effect::Stiffness(_) | Effect::Damping(_) | Effect::Damper { .. } => std::f64::consts::LN_2,
            Effect::Entry { size, .. } => 0.5 * size,
            Effect::Tool(_) => 0.01,
            Effect::Guide { term, .. } if term.is_positive() => std::f64::consts::LN_2,
            Effect::Guide { size, .. } => 0.5 * size,
            Effect::Frame { size, .. } | Effect::Link { size, .. } => *size,
            Effect::Mass(_) => (0.5 * self.initial.abs()).max(1.0),
        }
    }

    /// Returns the unknown of the fit: the compliance over the initial one for a stiffness, a number
    /// of a guide itself, otherwise the search coordinate.
    ///
    /// * `rigid`: whether the search for compliances starts at a rigid arm.
    pub(crate) fn unknown(&self, rigid: bool) -> Unknown {
        let at = self.coordinate(0.0);
        if self.is_yielding() {
            let std = COMPLIANCE * self.yielding_size();
            let known = |prior: f64| (at, if self.is_logarithmic() { at * prior.sinh() } else { prior });
            let prior = self.prior.map_or((0.0, std), known);
            let lower = RIGID * std;
            return Unknown {
                start: if rigid && self.prior.is_none() { lower } else { at },
                prior: Some(prior),
                lower,
            };
        }
        let std = if self.is_logarithmic() { MAGNITUDE } else { self.reference() };
        let lower = match self.effect {
            Effect::Mass(_) => -self.initial,
            Effect::Link { axis: None, .. } => (LIGHTEST - 1.0) * self.initial,
            _ => f64::NEG_INFINITY,
        };
        Unknown { start: 0.0, prior: Some((0.0, self.prior.unwrap_or(std))), lower }
    }

    /// Returns the compliance of the initial value in the unit of [`Self::unknown`].
    fn yielding_size(&self) -> f64 {
        match &self.effect {
            Effect::Guide { size, term, .. } if !term.is_positive() => *size,
            _ => 1.0,
        }
    }

    /// Returns the unknown of the fit at a search coordinate.
    pub(crate) fn coordinate(&self, x: f64) -> f64 {
        match &self.effect {
            Effect::Stiffness(_) => (-x).exp(),
            Effect::Guide { term: GuideTerm::Gap, .. } => x.exp(),
            Effect::Guide { term: GuideTerm::Compliance(_), .. } => self.initial + x,
            _ => x,
        }
    }

    /// Returns the search coordinate of an unknown of the fit, and its derivative.
    pub(crate) fn search(&self, z: f64) -> (f64, f64) {
        match &self.effect {
            Effect::Stiffness(_) => (-z.ln(), -1.0 / z),
            Effect::Guide { term: GuideTerm::Gap, .. } => (z.ln(), 1.0 / z),
            Effect::Guide { term: GuideTerm::Compliance(_), .. } => (z - self.initial, 1.0),
            _ => (z, 1.0),
        }
    }

    /// Changes the springs that the parameter affects, to the search coordinate `x`.
    fn change_springs(&self, all: &mut [Spring], x: f64) {
        match &self.effect {
            Effect::Stiffness(places) => {
                places.iter().for_each(|place| stiffen(&mut all[place.spring], place.coordinate, x.exp()));
            }
            Effect::Damping(springs) => {
                springs.iter().for_each(|k| all[*k].damping = all[*k].damping.scaled(x.exp()));
            }
            Effect::Damper { spring, coordinate } => {
                if let Damping::Dampers(d) = &mut all[*spring].damping {
                    d[*coordinate] *= x.exp();
                }
            }
            Effect::Entry { spring, row, column, factor, .. } => {
                let K = &mut all[*spring].K;
                *K += entry_slope(K.nrows(), *row, *column, factor * x);
            }
            Effect::Guide { springs, term, .. } => {
                for spring in springs {
                    if let Some(SpringCurve::Guide(guide)) = &mut all[*spring].curve {
                        *guide = guide.with(*term, self.value(x) - guide.number(*term));
                    }
                }
            }
            Effect::Tool(_) | Effect::Frame { .. } | Effect::Mass(_) | Effect::Link { .. } => {}
        }
    }

    /// Returns the value at a search coordinate, which is 0 at the initial value.
    pub fn value(&self, x: f64) -> f64 {
        if self.is_logarithmic() { self.initial * x.exp() } else { self.initial + x }
    }

    /// Returns the standard deviation of the value from that of the search coordinate, to first
    /// order.
    pub fn deviation(&self, x: f64, std: f64) -> f64 {
        if self.is_logarithmic() { self.value(x) * std } else { std }
    }

    /// Returns the interval of the value for unknowns of the fit between two numbers; a stiffness
    /// without an upper limit is infinite.
    pub(crate) fn interval(&self, low: f64, high: f64) -> [f64; 2] {
        let low = if self.is_yielding() { low.max(0.0) } else { low };
        let [a, b] = [low, high].map(|z| self.value(self.search(z).0));
        [a.min(b), a.max(b)]
    }
}

impl NominalArm {
    /// Returns the arm with parameters at search coordinates `all`.
    #[must_use]
    pub fn with(&self, parameters: &[Parameter], all: &[f64]) -> Self {
        let mut nominal = self.clone();
        for (k, (parameter, x)) in parameters.iter().zip(all).enumerate() {
            match &parameter.effect {
                Effect::Frame { body, twist, .. } => {
                    let moved = nominal.model.bodies()[*body].X_PJ * displacement(&(twist * *x));
                    Arc::make_mut(&mut nominal.model).set_joint_frame(*body, moved);
                }
                Effect::Mass(on) => {
                    for (body, per_kg) in on {
                        nominal = nominal.carrying(*body, &scaled(per_kg, *x));
                    }
                }
                // Mass and centre of mass of a link multiply: the first of its parameters sets all.
                Effect::Link { parts, .. } => {
                    let same =
                        |other: &Parameter| matches!(&other.effect, Effect::Link { parts: own, .. } if own == parts);
                    if !parameters[..k].iter().any(same) {
                        nominal = nominal.with_link(parts, link_change(parameters, all, parts));
                    }
                }
                _ => parameter.change_springs(&mut nominal.springs, *x),
            }
        }
        let (p, turn) = tool_shift(parameters, all);
        if p != Vector3::zeros() || turn != Vector3::zeros() {
            nominal.tool.X_BF *= Pose::from_parts(Translation3::from(p), Rotation3::new(turn));
        }
        nominal
    }

    /// Returns the arm with a link's mass multiplied and its centre of mass shifted (m, link axes).
    fn with_link(&self, parts: &[LinkPart], (factor, shift): (f64, Vector3<f64>)) -> Self {
        parts.iter().fold(self.clone(), |nominal, part| {
            let old = scaled(&part.spatial(1.0, &Vector3::zeros()), -1.0);
            nominal.carrying(part.body, &old).carrying(part.body, &part.spatial(factor, &shift))
        })
    }

    /// Returns the plant with inertia added to a body (about Bo, B axes).
    #[must_use]
    pub fn carrying(&self, body: usize, inertia: &SpatialInertia) -> Self {
        let mut sum = self.model.bodies()[body].inertia;
        sum += *inertia;
        Self { model: Arc::new(self.model.with_inertia(body, sum)), ..self.clone() }
    }

    /// Returns the arm with drives locked at a pose.
    ///
    /// # Errors
    /// As [`Plant::new`] and [`Plant::with_coupling`].
    pub fn locked(&self, q: &[f64]) -> Result<Plant, StepError> {
        self.coupled(Plant::new(self.model.clone(), self.elastic(), Arc::new(Held(q.to_vec())))?)
    }

    /// Returns the arm with drives locked at a pose, only for equilibria.
    ///
    /// # Errors
    /// As [`Plant::at_rest`] and [`Plant::with_coupling`].
    pub fn at_rest(&self, q: &[f64]) -> Result<Plant, StepError> {
        self.coupled(Plant::at_rest(self.model.clone(), self.elastic(), Arc::new(Held(q.to_vec())))?)
    }

    /// Springs without hysteresis, which an identification ignores.
    fn elastic(&self) -> Vec<Spring> {
        self.springs.iter().map(|spring| Spring { hysteresis: None, ..spring.clone() }).collect()
    }

    /// Returns the plant with the coupling of its gears.
    fn coupled(&self, plant: Plant) -> Result<Plant, StepError> {
        match &self.coupling {
            Some(coupling) => plant.with_coupling(coupling.clone()),
            None => Ok(plant),
        }
    }
}

/// Returns the displacement by a translation (m) and a rotation vector (rad).
pub fn displacement(twist: &Vector6<f64>) -> Pose {
    let [linear, angular] = [twist.fixed_rows::<3>(0), twist.fixed_rows::<3>(3)];
    Pose::from_parts(Translation3::from(linear.into_owned()), Rotation3::new(angular.into_owned()))
}

/// Returns displacement (m) and rotation vector (rad) of the tool in its own axes at given search
/// coordinates.
pub(crate) fn tool_shift(parameters: &[Parameter], x: &[f64]) -> (Vector3<f64>, Vector3<f64>) {
    let (mut p, mut turn) = (Vector3::zeros(), Vector3::zeros());
    for (parameter, x) in parameters.iter().zip(x) {
        match parameter.effect {
            Effect::Tool(axis @ 0..3) => p[axis] += x,
            Effect::Tool(axis) => turn[axis - 3] += x,
            _ => {}
        }
    }
    (p, turn)
}

/// Returns the rate of change of an inertia about Bo, B axes, as it moves with velocity `v` at the
/// point `p` and angular velocity `w`:
///
/// ```text
/// v_o = v - w × p,   dh = m v_o + w × h,   dJ = [w]x J + ([w]x J)ᵀ + 2 (v_o·h) 1 - v_o hᵀ - h v_oᵀ
/// ```
/// with the first moment h and the rotational inertia J.
pub(crate) fn carried_along(
    I: &SpatialInertia,
    p: &Vector3<f64>,
    v: &Vector3<f64>,
    w: &Vector3<f64>,
) -> SpatialInertia {
    let v_o = v - w.cross(p);
    let h = I.first_moment;
    let turned = w.cross_matrix() * I.rotational;
    let moved = Matrix3::identity() * (2.0 * v_o.dot(&h)) - v_o * h.transpose() - h * v_o.transpose();
    SpatialInertia {
        mass: 0.0,
        first_moment: v_o * I.mass + w.cross(&h),
        rotational: turned + turned.transpose() + moved,
    }
}

/// Scales an inertia per kilogram to a mass.
pub(crate) fn scaled(per_kg: &SpatialInertia, kg: f64) -> SpatialInertia {
    SpatialInertia {
        mass: kg * per_kg.mass,
        first_moment: kg * per_kg.first_moment,
        rotational: kg * per_kg.rotational,
    }
}

/// Multiplies the stiffness of a spring, or of one coordinate as `S K S`.
fn stiffen(spring: &mut Spring, coordinate: Option<usize>, factor: f64) {
    match coordinate {
        Some(k) if spring.K.nrows() > 1 => {
            let root = factor.sqrt();
            spring.K.row_mut(k).scale_mut(root);
            spring.K.column_mut(k).scale_mut(root);
        }
        _ => *spring = spring.clone().stiffened(factor),
    }
}

/// Returns a symmetric n×n matrix with one entry, and its mirror image, equal to `change`.
pub(crate) fn entry_slope(n: usize, row: usize, column: usize, change: f64) -> DMatrix<f64> {
    let mut dK = DMatrix::zeros(n, n);
    (dK[(row, column)], dK[(column, row)]) = (change, change);
    dK
}

/// Returns `dK/d(ln factor)` of a spring's matrix.
pub(crate) fn slope_of(K: &DMatrix<f64>, coordinate: Option<usize>) -> DMatrix<f64> {
    match coordinate {
        None => K.clone(),
        Some(k) => {
            DMatrix::from_fn(K.nrows(), K.ncols(), |i, j| 0.5 * K[(i, j)] * (f64::from(i == k) + f64::from(j == k)))
        }
    }
}
