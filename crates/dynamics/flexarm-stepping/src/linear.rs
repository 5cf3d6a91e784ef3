//! Linearisation of the arm about a static pose: basis of statics, modes and frequency response.
//!
//! ```text
//! M ẍ + D ẋ + K x = Jᵀ F - M_a q̈_a - D_a q̇_a - K_a q_a        V_T = J ẋ + J_a q̇_a
//! ```
//! for small motions x of the free coordinates and commands q_a of the joints about the equilibrium
//! under weight and a constant wrench at a tool frame T. A prescribed joint follows its command
//! exactly. A joint driven by torque is free; its servo acts as a spring and a damper towards the
//! command, with feed-forward but without sampling, limit and integral (at rest the integral makes
//! the motor reach its command). Start at [`linearise`]. The layout of the coordinates is known
//! only to the few functions of this file. Not here: eigenvalues and frequency response
//! (`flexarm-analysis`).

use std::ops::Range;
use std::sync::Arc;

use flexarm_kinematics::{Data, Frame, Pose, StaticTangent, Wrench, forward_kinematics, frame_jacobian, mass_matrix};
use nalgebra::{DMatrix, DVector, Matrix6, Matrix6xX};

use crate::drive::{Friction, ServoAxis};
use crate::equilibrium::{Equilibrium, Forces, equilibrium};
use crate::error::StepError;
use crate::plant::{ElasticElement, Plant, Servo};
use crate::statics::{
    StaticSlopes, for_vibration, leave_play, spring_forces, static_equilibrium, static_forces, to_the_edge, with_curves,
};

/// Minimum step of the wrench, as a share of it.
const SMALLEST_LOAD_STEP: f64 = 1.0 / 128.0;

/// Linear model about a static pose with n free coordinates (joints driven by torque, then elastic
/// ones) and m joints. Tool quantities are in world axes at the tool point, linear part first.
#[derive(Clone, Debug)]
pub struct Linear {
    /// Free coordinates at the equilibrium.
    pub equilibrium: DVector<f64>,
    /// All coordinates at the equilibrium.
    pub q: DVector<f64>,
    /// Mass matrix of the free coordinates, n×n.
    pub M: DMatrix<f64>,
    /// Damping matrix, n×n.
    pub D: DMatrix<f64>,
    /// Tangent stiffness, n×n: springs plus the geometric stiffness of weight and tool wrench.
    /// Symmetric unless there is a constant moment, which is not conservative.
    pub K: DMatrix<f64>,
    /// Number of joints driven by torque; they are the first free coordinates.
    pub driven: usize,
    /// Share of the springs in `K`, n×n.
    pub springs: DMatrix<f64>,
    /// Name and free coordinates of each elastic element.
    pub elements: Vec<(String, Range<usize>)>,
    /// Forces on the free coordinates per acceleration of the commands, n×m.
    pub M_a: DMatrix<f64>,
    /// Forces on the free coordinates per rate of the commands, n×m; zero for prescribed joints.
    pub D_a: DMatrix<f64>,
    /// Forces on the free coordinates per command, n×m.
    pub K_a: DMatrix<f64>,
    /// Twist of the tool per rate of the free coordinates, 6×n.
    pub J: Matrix6xX<f64>,
    /// Twist of the tool per rate of the commands with the structure rigid, 6×m; zero for joints
    /// driven by torque.
    pub J_a: Matrix6xX<f64>,
    /// Pose of the tool in the world at the equilibrium.
    pub X_WT: Pose,
    /// Drive forces that hold the pose, m.
    pub holding: DVector<f64>,
    /// Unbalanced force relative to the largest force at the equilibrium.
    pub residual: f64,
    /// Newton iterations in addition to those for the equilibrium under weight.
    pub iterations: usize,
}

impl Linear {
    /// Returns the Cartesian compliance of the tool, `J K^-1 Jᵀ` (m/N, rad/N; m/(N m), rad/(N m)),
    /// with motors held.
    ///
    /// # Errors
    /// [`StepError::Singular`] if a direction has no stiffness.
    pub fn compliance(&self) -> Result<Matrix6<f64>, StepError> {
        let n = self.K.nrows() - self.driven;
        if n == 0 {
            return Ok(Matrix6::zeros());
        }
        let J = self.J.columns(self.driven, n);
        let K = self.K.view((self.driven, self.driven), (n, n)).into_owned();
        let yielding = K
            .lu()
            .solve(&J.transpose())
            .ok_or(StepError::Singular { matrix: "static stiffness (with the effect of weight)", t: 0.0 })?;
        let C = J * yielding;
        Ok(Matrix6::from_fn(|i, j| C[(i, j)]))
    }

    /// Returns the static twist of the tool per change of the commands, `J_a - J K^-1 K_a`, 6×m:
    /// rigid motion plus the change of the deflection. `None` if a direction has no stiffness.
    pub fn command_slopes(&self) -> Option<Matrix6xX<f64>> {
        if self.K.is_empty() {
            return Some(self.J_a.clone());
        }
        Some(&self.J_a - &self.J * self.K.clone().lu().solve(&self.K_a)?)
    }

    /// Returns the compliance as [`Linear::compliance`] does, with the stiffness of the servos
    /// included. `None` if a motor is not held. Units as there.
    pub fn yielding_compliance(&self) -> Option<Matrix6<f64>> {
        let K = (&self.K + self.K.transpose()) * 0.5;
        let scale = K.diagonal().amax();
        let yielding = self.K.clone().lu().solve(&self.J.transpose())?;
        let smallest = K.symmetric_eigenvalues().amin();
        if smallest <= 1e-12 * scale {
            return None;
        }
        let C = &self.J * yielding;
        Some(Matrix6::from_fn(|i, j| C[(i, j)]))
    }
}

/// Linearises the arm about its equilibrium at time `t` of the motion, prescribed joints locked
/// there.
///
/// * `tool`: a frame of the arm's model; `F_T_W`: constant wrench on it, at its origin, in world
///   axes, which keeps its direction and moves with the point as the arm deflects. The arm's own
///   loads act as well.
///
/// # Errors
/// [`StepError::NoEquilibrium`], [`StepError::Singular`], [`StepError::OpenLoop`].
pub fn linearise(plant: &Plant, tool: &Frame, F_T_W: &Wrench, t: f64) -> Result<Linear, StepError> {
    let model = &plant.model;
    let (m, nv, driven) = (model.n_actuated(), model.nv(), plant.torque_driven.len());
    // Indices of the free coordinates.
    let free: Vec<usize> = plant.torque_driven.iter().copied().chain(m..nv).collect();
    let n = free.len();
    // Equilibrium, and the static forces p there.
    let mut data = Data::new(model);
    let statics = Statics { plant, tool, F_T_W: *F_T_W, t };
    let Equilibrium { e, residual, iterations } = statics.equilibrium(&mut data)?;
    let q = plant.coordinates_at(t, &e);
    let p = statics.forces(&mut data, &q);

    // Free coordinates: K = springs + ∂p/∂q, D, M, and the Jacobian of the tool.
    let slopes = statics.slopes(&mut data, &q);
    let springs = among_free(&for_vibration(plant, &plant.stiffness(), q.as_slice(), &e), driven);
    let K = statics.tangent(&springs, &slopes, &free)?;
    let D = among_free(&plant.D, driven);
    let M = mass_matrix(model, &mut data, &q).clone();
    forward_kinematics(model, &mut data, &q);
    if let Some(open) = StepError::open_loop(model, &data, t) {
        return Err(open);
    }
    let mut J = Matrix6xX::zeros(nv);
    frame_jacobian(model, &data, tool, &mut J);

    // Commands move prescribed joints directly; joints driven by torque receive them only through
    // their servos.
    let (mut M_a, mut K_a) = (M.columns(0, m).select_rows(&free), slopes.columns(0, m).select_rows(&free));
    let mut J_a = J.columns(0, m).into_owned();
    for &k in &plant.torque_driven {
        M_a.column_mut(k).fill(0.0);
        K_a.column_mut(k).fill(0.0);
        J_a.column_mut(k).fill(0.0);
    }
    let place = |e: &ElasticElement| driven + plant.offset(e)..driven + plant.offset(e) + e.size;
    let mut linear = Linear {
        equilibrium: q.select_rows(&free),
        M: M.select_rows(&free).select_columns(&free),
        D,
        K,
        driven,
        springs,
        elements: plant.elements.iter().map(|e| (e.name.clone(), place(e))).collect(),
        M_a,
        D_a: DMatrix::zeros(n, m),
        K_a,
        J: Matrix6xX::from_fn(n, |i, j| J[(i, free[j])]),
        J_a,
        X_WT: data.X_WF(tool),
        holding: holding(plant, &q, &e, &p),
        q,
        residual,
        iterations,
    };
    if let Some(servo) = &plant.servo {
        linear.close_loops(plant, servo);
    }
    Ok(linear)
}

/// Returns a matrix over the elastic coordinates as one over the free coordinates, of which the
/// first `driven` are those of the joints driven by torque.
fn among_free(elastic: &DMatrix<f64>, driven: usize) -> DMatrix<f64> {
    let n = driven + elastic.nrows();
    let mut free = DMatrix::zeros(n, n);
    free.view_mut((driven, driven), elastic.shape()).copy_from(elastic);
    free
}

/// Returns the joint forces that hold the pose: weight, loads, and reactions of transmission errors
/// on the motors.
fn holding(plant: &Plant, q: &DVector<f64>, e: &DVector<f64>, p: &DVector<f64>) -> DVector<f64> {
    let mut holding = p.rows(0, plant.model.n_actuated()).into_owned();
    let F = spring_forces(plant, q.as_slice(), e);
    plant.add_motor_forces(q.as_slice(), F.as_slice(), holding.as_mut_slice());
    holding
}

impl Linear {
    /// Adds the servos: springs and dampers towards the commands, and their feed-forward.
    fn close_loops(&mut self, plant: &Plant, servo: &Servo) {
        let m = plant.model.n_actuated();
        let [K, D, M] = servo.fed_forward(self.q.rows(0, m).as_slice(), &plant.friction);
        for (i, axis) in servo.axes.iter().enumerate() {
            let (position, rate) = (axis.velocity_gain * axis.position_gain, axis.velocity_gain);
            self.K[(i, i)] += position;
            self.D[(i, i)] += rate;
            for (j, other) in servo.axes.iter().enumerate() {
                let of_motor = |k: usize| viscous(&plant.friction, k);
                self.D[(i, j)] += plant.over_joints(axis.coordinate, other.coordinate, of_motor);
            }
            self.K_a[(i, axis.coordinate)] -= position;
            self.D_a[(i, axis.coordinate)] -= rate;
            for k in 0..m {
                self.K_a[(i, k)] -= K[(i, k)];
                self.D_a[(i, k)] -= D[(i, k)];
                self.M_a[(i, k)] -= M[(i, k)];
            }
        }
    }
}

fn viscous(friction: &[Friction], coordinate: usize) -> f64 {
    friction.get(coordinate).map_or(0.0, |friction| friction.viscous)
}

impl Servo {
    /// Returns the feed-forward torques about rest at a pose per command, per rate and per
    /// acceleration of the commands: one row per axis, one column per joint.
    ///
    /// * `pose`: all actuated joints; `friction`: of these joints, as in [`Plant::friction`];
    ///   its viscous part is fed forward as well.
    pub fn fed_forward(&self, pose: &[f64], friction: &[Friction]) -> [DMatrix<f64>; 3] {
        let (model, m) = (&self.rigid, pose.len());
        let (mut data, pose) = (Data::new(model), DVector::from_column_slice(pose));
        let M = mass_matrix(model, &mut data, &pose).clone();
        let mut K = DMatrix::zeros(m, m);
        forward_kinematics(model, &mut data, &pose);
        StaticTangent::new(model, 0).compute(model, &data, &pose, &[], &mut K);
        let D = DMatrix::from_fn(m, m, |i, j| if i == j { viscous(friction, i) } else { 0.0 });
        let of_axes = |A: &DMatrix<f64>| {
            DMatrix::from_fn(self.axes.len(), m, |i, k| {
                let axis = &self.axes[i];
                axis.feed_forward * A[(axis.coordinate, k)]
            })
        };
        [of_axes(&K), of_axes(&D), of_axes(&M)]
    }

    /// Returns the servo with zero gains and without feed-forward: the motors are free.
    #[must_use]
    pub fn opened(&self) -> Self {
        let open = |axis: &ServoAxis| ServoAxis {
            position_gain: 0.0,
            velocity_gain: 0.0,
            integral_gain: 0.0,
            feed_forward: 0.0,
            ..*axis
        };
        Self { axes: self.axes.iter().map(open).collect(), ..self.clone() }
    }
}

impl Plant {
    /// Returns the arm without servos: motors follow their commands exactly.
    #[must_use]
    pub fn with_motors_held(&self) -> Self {
        Self { torque_driven: Vec::new(), servo: None, ..self.clone() }
    }

    /// Returns the arm with free motors.
    #[must_use]
    pub fn with_servo_opened(&self) -> Self {
        Self { servo: self.servo.as_ref().map(|servo| Arc::new(servo.opened())), ..self.clone() }
    }
}

/// Mass, tangent stiffness and Jacobian of an arm at arbitrary coordinates, drives locked: the
/// matrices of [`linearise`], not restricted to the equilibrium.
#[derive(Clone, Debug)]
pub struct Tangents {
    /// Mass matrix of the elastic coordinates, n×n.
    pub M: DMatrix<f64>,
    /// Stiffness of springs, weight and wrench, n×n.
    pub K: DMatrix<f64>,
    /// Twist of the tool per rate of the elastic coordinates, 6×n.
    pub J: Matrix6xX<f64>,
}

impl Tangents {
    /// Computes the matrices at all coordinates `q` (joints, then elastic ones), under weight, the
    /// loads at time 0 and a wrench at the tool's origin (world axes).
    ///
    /// # Panics
    /// If `q` is not nv long.
    pub fn at(plant: &Plant, tool: &Frame, F_T_W: &Wrench, q: &DVector<f64>) -> Self {
        plant.model.check_size("q", q.len());
        let model = &plant.model;
        let (m, n) = (model.n_actuated(), plant.model.n_elastic());
        let mut data = Data::new(model);
        let statics = Statics { plant, tool, F_T_W: *F_T_W, t: 0.0 };
        let e = q.rows(m, n).into_owned();
        let K = for_vibration(plant, &plant.stiffness(), q.as_slice(), &e)
            + statics.slopes(&mut data, q).view((m, m), (n, n));
        let M = mass_matrix(model, &mut data, q).view((m, m), (n, n)).into_owned();
        forward_kinematics(model, &mut data, q);
        let mut J = Matrix6xX::zeros(model.nv());
        frame_jacobian(model, &data, tool, &mut J);
        Self { M, K, J: J.columns(m, n).into_owned() }
    }
}

/// Returns the elastic coordinates in equilibrium under weight, the loads at `t` and a wrench at the
/// tool's origin (world axes).
///
/// # Errors
/// [`StepError::NoEquilibrium`], [`StepError::OpenLoop`], and [`StepError::Singular`] beyond a
/// buckling load.
pub(crate) fn loaded_equilibrium(
    plant: &Plant,
    tool: &Frame,
    F_T_W: &Wrench,
    t: f64,
) -> Result<DVector<f64>, StepError> {
    let statics = Statics { plant, tool, F_T_W: *F_T_W, t };
    Ok(statics.equilibrium(&mut Data::new(&plant.model))?.e)
}

/// Static loading: weight, loads of the arm, wrench on the tool.
struct Statics<'a> {
    plant: &'a Plant,
    tool: &'a Frame,
    /// Force and moment on the tool.
    F_T_W: Wrench,
    t: f64,
}

impl Statics<'_> {
    fn singular(&self) -> StepError {
        StepError::Singular { matrix: "static stiffness (with the effect of weight and load)", t: self.t }
    }

    /// Returns the equilibrium, found from that under weight at once or, where that fails, with the
    /// wrench rising in steps.
    fn equilibrium(&self, data: &mut Data) -> Result<Equilibrium, StepError> {
        let under_weight = static_equilibrium(self.plant, self.t)?;
        match self.equilibrium_from(data, under_weight.clone()) {
            Err(StepError::Singular { .. } | StepError::NoEquilibrium { .. }) if self.F_T_W != Wrench::zeros() => {
                self.in_load_steps(data, under_weight)
            }
            found => found,
        }
    }

    /// Raises the wrench in steps, each from the equilibrium of the one before.
    fn in_load_steps(&self, data: &mut Data, mut e: DVector<f64>) -> Result<Equilibrium, StepError> {
        let (mut share, mut step) = (0.0_f64, 0.25);
        loop {
            let next = (share + step).min(1.0);
            let F_T_W = Wrench::new(self.F_T_W.force * next, self.F_T_W.torque * next);
            match (Self { F_T_W, ..*self }).equilibrium_from(data, e.clone()) {
                Ok(found) if next == 1.0 => return Ok(found),
                Ok(found) => (e, share, step) = (found.e, next, 1.5 * step),
                Err(error) if step < SMALLEST_LOAD_STEP => return Err(error),
                Err(_) => step *= 0.5,
            }
        }
    }

    /// Solves `K e + p(e) = 0` from elastic coordinates.
    fn equilibrium_from(&self, data: &mut Data, e: DVector<f64>) -> Result<Equilibrium, StepError> {
        let mut under_load = UnderLoad { statics: self, data, at_rest: self.plant.stiffness(), buckled: false };
        equilibrium(&mut under_load, e).map_err(|error| match error {
            StepError::NoEquilibrium { .. } if under_load.buckled => self.singular(),
            other => other,
        })
    }

    /// Returns the tangent stiffness of the free coordinates: springs plus slopes of weight and
    /// loads.
    fn tangent(
        &self,
        springs: &DMatrix<f64>,
        slopes: &DMatrix<f64>,
        free: &[usize],
    ) -> Result<DMatrix<f64>, StepError> {
        let (driven, ne) = (self.plant.torque_driven.len(), self.plant.model.n_elastic());
        let mut change = slopes.select_rows(free).select_columns(free);
        // Without constant moments the forces have a potential, and any asymmetry is round-off.
        let moments = self.plant.loads.iter().any(|load| load.wrench.at(self.t).torque.norm() > 0.0);
        if self.F_T_W.torque.norm() == 0.0 && !moments {
            change = (&change + change.transpose()) * 0.5;
        }
        let K = springs + change;
        // An equilibrium beyond the buckling load exists but is unstable.
        let elastic = K.view((driven, driven), (ne, ne));
        if ne > 0 && ((elastic + elastic.transpose()) * 0.5).cholesky().is_none() {
            return Err(self.singular());
        }
        Ok(K)
    }

    /// Returns the static forces; see [`static_forces`].
    fn forces(&self, data: &mut Data, q: &DVector<f64>) -> DVector<f64> {
        let mut p = DVector::zeros(q.len());
        static_forces(self.plant, Some((self.tool, &self.F_T_W)), self.t, data, q, &mut p);
        p
    }

    /// Returns the derivatives of the static forces with respect to all coordinates.
    fn slopes(&self, data: &mut Data, q: &DVector<f64>) -> DMatrix<f64> {
        let mut P = DMatrix::zeros(q.len(), q.len());
        let tool = Some((self.tool, &self.F_T_W));
        StaticSlopes::new(self.plant, 0).compute(self.plant, tool, self.t, data, q, &mut P);
        P
    }
}

/// The arm at rest under weight, its loads and the wrench on the tool, motors held.
struct UnderLoad<'a> {
    statics: &'a Statics<'a>,
    data: &'a mut Data,
    /// Stiffness of the springs at rest.
    at_rest: DMatrix<f64>,
    /// Whether the tangent was not positive definite somewhere.
    buckled: bool,
}

impl Forces for UnderLoad<'_> {
    fn unbalanced(&mut self, e: &DVector<f64>) -> Result<(DVector<f64>, f64), StepError> {
        let plant = self.statics.plant;
        let q = plant.coordinates_at(self.statics.t, e);
        let p = self.statics.forces(self.data, &q);
        let spring = spring_forces(plant, q.as_slice(), e);
        let elastic_p = p.rows(plant.model.n_actuated(), e.len());
        let scale = elastic_p.amax().max(spring.amax()).max(plant.friction_of_gears());
        Ok((&spring + elastic_p, scale))
    }

    fn step(&mut self, e: &DVector<f64>, r: &DVector<f64>, scale: f64) -> Result<DVector<f64>, StepError> {
        let (plant, m, n) = (self.statics.plant, self.statics.plant.model.n_actuated(), e.len());
        let q = plant.coordinates_at(self.statics.t, e);
        let springs = with_curves(plant, &self.at_rest, q.as_slice(), e);
        let slopes = self.statics.slopes(self.data, &q).view((m, m), (n, n)).into_owned();
        let is_stable = |K: &DMatrix<f64>| ((K + K.transpose()) * 0.5).cholesky().is_some();
        // If the tangent is not positive definite, its step leads uphill to a saddle point; a step
        // with the springs only leads downhill.
        let tangent = &springs + &slopes;
        let stable = is_stable(&tangent);
        self.buckled |= !stable;
        let out = leave_play(plant, q.as_slice(), e, r, scale, &springs) + slopes;
        let K = match (stable && is_stable(&out), stable) {
            (true, _) => out,
            (false, true) => tangent,
            _ => springs,
        };
        let step = K.lu().solve(r).ok_or_else(|| self.statics.singular())?;
        Ok(to_the_edge(plant, q.as_slice(), e, step))
    }

    fn has_hysteresis(&self) -> bool {
        self.statics.plant.has_hysteresis()
    }

    fn time(&self) -> f64 {
        self.statics.t
    }
}
