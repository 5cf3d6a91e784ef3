//! An arm at rest at a sequence of poses: equilibrium, compliance, Jacobian and frequencies, without
//! allocation.
//!
//! ```text
//! K e + p(q_a, e) = 0          C = J (K + dp/de)^-1 Jᵀ          (K + dp/de) φ = ω² M φ
//! ```
//! with the elastic coordinates e, the spring stiffness K, and p the static forces of weight and
//! loads. Drives are locked. Newton's method begins with the factor of the springs, which weight
//! changes little, so that a pose needs one tangent in closed form
//! ([`flexarm_kinematics::StaticTangent`]), and the result does not depend on earlier calls.
//!
//! Start at [`OperatingPoint::new`]. For damping, servos and inputs at one pose use
//! [`crate::linearise`].

mod each;
mod lanes;
mod tangent;

use flexarm_kinematics::{
    Data, Frame, Pose, SpatialInertia, Twist, Wrench, forward_kinematics, frame_jacobian, mass_matrix_at_poses,
};
use nalgebra::{DMatrix, DVector, Matrix6, Matrix6xX};

use crate::dense::Factor;
use crate::equilibrium::{MAX_HALVINGS, settled};
use crate::error::StepError;
use crate::linear::loaded_equilibrium;
use crate::motion::Held;
use crate::plant::Plant;
use crate::statics::{StaticSlopes, add_spring_forces, static_forces};
pub use each::{PoseAnswer, PoseOutputs};
use tangent::{Tangent, to_hertz};

/// Maximum number of Newton iterations.
const MAX_ITERATIONS: usize = 60;
/// Residual reduction of a step above which the tangent is renewed.
const SLOW: f64 = 0.1;

/// Equilibria of an arm at given poses, with the workspace for them.
///
/// Tool quantities are in world axes at the tool point, linear part first. The arm's loads at time
/// 0 are included.
#[derive(Clone)]
pub struct OperatingPoint {
    plant: Plant,
    tool: Frame,
    data: Data,
    /// Whether any spring is nonlinear (backlash or curve).
    curved: bool,
    /// Stiffness of the springs at rest, n×n, and its factor if it is positive definite.
    K: DMatrix<f64>,
    rest: Option<Factor<f64>>,
    /// All coordinates: joints, then elastic ones.
    q: DVector<f64>,
    F_T_W: Wrench,
    /// Static forces over all coordinates; the part of the joints is read after the solution.
    p: DVector<f64>,
    /// Efforts of the joints at the equilibrium.
    holding: DVector<f64>,
    slopes: StaticSlopes,
    /// Unbalanced forces, and Newton's step.
    r: DVector<f64>,
    dp_de: DMatrix<f64>,
    tangent: Tangent<f64>,
    /// Whether the tangent is factorised.
    factored: bool,
    X_WT: Pose,
    X_WT_rigid: Pose,
    J: Matrix6xX<f64>,
    residual: f64,
    iterations: usize,
}

/// Returns the error for an equilibrium whose tangent is not positive definite: it is unstable.
fn beyond_buckling() -> StepError {
    StepError::Singular { matrix: "static stiffness (with the effect of weight and load)", t: 0.0 }
}

impl OperatingPoint {
    /// Creates the workspace for an arm and a frame on it; nothing is solved yet.
    ///
    /// * `tool`: a frame of the arm's model.
    pub fn new(plant: Plant, tool: Frame) -> Self {
        let (n, nv) = (plant.model.n_elastic(), plant.model.nv());
        let K = plant.stiffness();
        // Factor of the springs; there is none if their stiffness is not positive definite.
        let mut rest = Factor::new(n);
        let stiff = n > 0 && rest.compute(K.as_slice()) == 1.0;
        Self {
            rest: stiff.then_some(rest),
            data: Data::new(&plant.model),
            curved: plant.elements.iter().any(|element| element.curve.is_some()),
            K,
            q: DVector::zeros(nv),
            F_T_W: Wrench::zeros(),
            p: DVector::zeros(nv),
            holding: DVector::zeros(plant.model.n_actuated()),
            slopes: StaticSlopes::new(&plant, plant.model.n_actuated()),
            r: DVector::zeros(n),
            dp_de: DMatrix::zeros(n, n),
            tangent: Tangent::new(n),
            factored: false,
            X_WT: Pose::identity(),
            X_WT_rigid: Pose::identity(),
            J: Matrix6xX::zeros(nv),
            residual: f64::NAN,
            iterations: 0,
            plant,
            tool,
        }
    }

    /// Computes the equilibrium with the joints at `q` under weight and a wrench at the tool.
    ///
    /// * `q`: actuated joints in coordinate order (rad or m).
    /// * `F_T_W`: force and moment on the tool at its origin, world axes (N, N m), with constant
    ///   direction as the arm deflects.
    ///
    /// Cost: one tangent, at most two for small deflections. Does not allocate after the first
    /// call, except with backlash, and where a load deflects the arm so far that the tangent is not
    /// positive definite at some iterate.
    ///
    /// # Errors
    /// [`StepError::Setup`] for a wrong number of joints or values that are not finite,
    /// [`StepError::NoEquilibrium`], [`StepError::OpenLoop`], and [`StepError::Singular`] beyond a
    /// buckling load.
    pub fn solve(&mut self, q: &[f64], F_T_W: &Wrench) -> Result<(), StepError> {
        let m = self.plant.model.n_actuated();
        self.residual = f64::NAN;
        if q.len() != m {
            return Err(StepError::Setup(format!("{} joint values are given, the arm has {m} joints", q.len())));
        }
        let finite = |mut values: std::slice::Iter<'_, f64>| values.all(|x| x.is_finite());
        if !finite(q.iter()) {
            return Err(StepError::Setup(format!("the {m} joint values must be finite numbers, found {q:?}")));
        }
        if !(finite(F_T_W.force.as_slice().iter()) && finite(F_T_W.torque.as_slice().iter())) {
            return Err(StepError::Setup(format!("force and moment must be finite numbers, found {F_T_W:?}")));
        }
        self.F_T_W = *F_T_W;
        self.start_from_springs();
        self.q.fill(0.0);
        self.q.rows_mut(0, m).copy_from_slice(q);
        forward_kinematics(&self.plant.model, &mut self.data, &self.q);
        if let Some(open) = StepError::open_loop(&self.plant.model, &self.data, 0.0) {
            return Err(open);
        }
        self.X_WT_rigid = self.data.X_WF(&self.tool);
        if self.curved {
            // Leave backlash with the dedicated solver.
            let fixed = Plant { motion: std::sync::Arc::new(Held(q.to_vec())), ..self.plant.clone() };
            let e = loaded_equilibrium(&fixed, &self.tool, F_T_W, 0.0)?;
            self.q.rows_mut(m, e.len()).copy_from(&e);
            // The factor of the springs at rest does not apply beyond the backlash.
            self.factored = false;
        }
        let residual = self.newton()?;
        // Later queries need the tangent at the equilibrium.
        self.refactor(true)?;
        self.X_WT = self.data.X_WF(&self.tool);
        frame_jacobian(&self.plant.model, &self.data, &self.tool, &mut self.J);
        self.holding.copy_from(&self.p.rows(0, m));
        // The springs carry the static forces.
        self.r.zip_apply(&self.p.rows(m, self.r.len()), |carried, p| *carried = -p);
        self.plant.add_motor_forces(self.q.as_slice(), self.r.as_slice(), self.holding.as_mut_slice());
        self.residual = residual;
        Ok(())
    }

    /// Resets the tangent to the factor of the springs at rest.
    fn start_from_springs(&mut self) {
        self.factored = self.rest.is_some();
        if let Some(rest) = &self.rest {
            self.tangent.factor.copy_from(rest);
        }
    }

    /// Runs Newton's iteration from the elastic coordinates in `q`; returns the residual.
    fn newton(&mut self) -> Result<f64, StepError> {
        let (m, n) = (self.plant.model.n_actuated(), self.r.len());
        let (mut residual, mut buckled) = (f64::INFINITY, false);
        for iteration in 0..MAX_ITERATIONS {
            self.iterations = iteration;
            self.forces();
            let scale = self.unbalance();
            let previous = residual;
            residual = if n == 0 { 0.0 } else { self.r.amax() / scale };
            if settled(iteration, residual, previous) {
                return Ok(residual);
            }
            if !residual.is_finite() {
                break;
            }
            if !self.factored || residual > SLOW * previous {
                if self.refactor(false).is_err() {
                    buckled = true;
                    // Its step would lead uphill to a saddle point; a step with the springs only
                    // leads downhill.
                    self.start_from_springs();
                }
                self.forces();
                self.unbalance();
            }
            let unbalanced = self.r.norm();
            if !self.factored {
                break;
            }
            self.tangent.factor.solve(self.r.as_mut_slice());
            // The full step may overshoot for large deflections: no coordinate moves by more than
            // 0.5.
            let shorten = (0.5 / self.r.amax()).min(1.0);
            self.q.rows_mut(m, n).axpy(-shorten, &self.r, 1.0);
            if self.plant.has_hysteresis() {
                self.come_closer(shorten, unbalanced);
            }
        }
        match buckled {
            true => Err(beyond_buckling()),
            false => Err(StepError::NoEquilibrium { t: 0.0, iterations: MAX_ITERATIONS, residual }),
        }
    }

    /// Reverts halves of the step in `r` until the residual is below `unbalanced`: the first
    /// loading curve of a gear may be soft, then stiff.
    fn come_closer(&mut self, mut part: f64, unbalanced: f64) {
        let (m, n) = (self.plant.model.n_actuated(), self.r.len());
        let step = self.r.clone();
        for _ in 0..MAX_HALVINGS {
            self.forces();
            self.unbalance();
            if self.r.norm() < unbalanced {
                break;
            }
            part *= 0.5;
            self.q.rows_mut(m, n).axpy(part, &step, 1.0);
        }
    }

    /// Computes weight, loads and load-dependent stiffness at `q`, without springs, in `p`.
    fn forces(&mut self) {
        static_forces(&self.plant, Some((&self.tool, &self.F_T_W)), 0.0, &mut self.data, &self.q, &mut self.p);
    }

    /// Computes `r = K e + p`; returns the largest of these forces.
    fn unbalance(&mut self) -> f64 {
        let m = self.plant.model.n_actuated();
        let (e, p) = (&self.q.as_slice()[m..], &self.p.as_slice()[m..]);
        self.r.fill(0.0);
        add_spring_forces(&self.plant, self.q.as_slice(), e, self.r.as_mut_slice());
        let springs = self.r.amax();
        let mut carried = 0.0_f64;
        for (r, p) in self.r.iter_mut().zip(p) {
            carried = carried.max(p.abs());
            *r += p;
        }
        springs.max(carried).max(self.plant.friction_of_gears()).max(f64::MIN_POSITIVE)
    }

    /// Computes the tangent at `q` and the factor of its symmetric part; `small`: for small
    /// motions, in which friction does not slip.
    fn refactor(&mut self, small: bool) -> Result<(), StepError> {
        let (m, n) = (self.plant.model.n_actuated(), self.r.len());
        let tool = Some((&self.tool, &self.F_T_W));
        // `data` holds the poses of the last forces, which were evaluated at `q`.
        self.slopes.compute_at_poses(&self.plant, tool, 0.0, &mut self.data, &self.q, &mut self.dp_de);
        self.tangent.T.copy_from_slice(self.dp_de.as_slice());
        self.tangent.add_springs(&self.K);
        for (number, element) in self.plant.elements.iter().enumerate() {
            if let Some(curve) = &element.curve {
                let k = self.plant.offset(element);
                let delta = self.plant.deflection(number, self.q[m + k], self.q.as_slice());
                let stuck = element.hysteresis.as_ref().filter(|_| small);
                let beyond_play = || curve.slope_beyond_play(delta, self.q.as_slice());
                let slope = stuck.map_or_else(beyond_play, |law| law.stuck_slope(delta));
                self.tangent.T[k * n + k] += slope - self.K[(k, k)];
            }
        }
        // A constant moment is not conservative; without one any asymmetry is an error of the
        // differences.
        let moments = self.plant.loads.iter().any(|load| load.wrench.at(0.0).torque.norm() > 0.0);
        self.tangent.symmetric = self.F_T_W.torque.norm() == 0.0 && !moments;
        self.factored = self.tangent.factorise() == 1.0;
        match self.factored {
            true => Ok(()),
            false => Err(beyond_buckling()),
        }
    }

    /// Returns the arm; its springs and loads apply here, its own motion does not.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// Returns `X_WT`, the pose of the tool in the world at the equilibrium.
    pub fn tcp_pose(&self) -> Pose {
        self.X_WT
    }

    /// Returns the pose of the tool in the world with all elastic coordinates zero.
    pub fn rigid_tcp_pose(&self) -> Pose {
        self.X_WT_rigid
    }

    /// Returns all coordinates at the equilibrium: joints, then elastic ones (rad or m).
    pub fn coordinates(&self) -> &DVector<f64> {
        &self.q
    }

    /// Returns the tool frame.
    pub fn tool(&self) -> &Frame {
        &self.tool
    }

    /// Returns the elastic coordinates (m, rad) in the order of the elements.
    pub fn deflections(&self) -> &[f64] {
        &self.q.as_slice()[self.plant.model.n_actuated()..]
    }

    /// Returns the efforts with which the drives hold the pose (N m or N), in coordinate order.
    pub fn holding_efforts(&self) -> &[f64] {
        self.holding.as_slice()
    }

    /// Checks that there is one number per elastic coordinate.
    #[track_caller]
    fn check_length(&self, what: &str, found: usize) {
        let expected = self.r.len();
        assert!(found == expected, "{what} has {found} entries, the arm has {expected} elastic coordinates");
    }

    /// Adds the static forces on the elastic coordinates due to the weight of an additional inertia
    /// on a body (`M_BBo_B`) to `p` (n; N, N m).
    ///
    /// # Panics
    /// If `p` is not n long, or there is no such body.
    pub fn add_weight(&mut self, body: usize, inertia: &SpatialInertia, p: &mut [f64]) {
        self.check_length("p", p.len());
        let model = self.plant.model.clone();
        if self.plant.elements.iter().any(|element| element.geometric.is_some()) {
            // Its stiffness depends on the weight; forces are linear in a mass.
            let n = self.r.len();
            let (mut with, mut without) = (DVector::zeros(n), DVector::zeros(n));
            let (plant, mut heavier) = (self.plant.clone(), model.bodies()[body].inertia);
            heavier += *inertia;
            self.forces_of(&plant.with_inertia(body, heavier), &mut with);
            self.forces_of(&plant, &mut without);
            p.iter_mut().zip((with - without).iter()).for_each(|(p, more)| *p += more);
            return;
        }
        let frame = Frame { name: String::new(), body, X_BF: Pose::identity() };
        let mut J = Matrix6xX::zeros(self.q.len());
        frame_jacobian(&model, &self.data, &frame, &mut J);
        let moment = (self.data.X_WB[body].rotation * inertia.first_moment).cross(&model.gravity);
        let weight = Wrench::new(model.gravity * inertia.mass, moment).to_vector();
        p.iter_mut().zip(J.column_iter().skip(model.n_actuated())).for_each(|(p, J)| *p -= J.dot(&weight));
    }

    /// Writes the static forces on the elastic coordinates, without springs, of another arm of the
    /// same tree at this equilibrium under weight, loads and the wrench into `p` (n).
    ///
    /// # Panics
    /// If `p` is not n long.
    pub fn forces_of(&mut self, other: &Plant, p: &mut DVector<f64>) {
        self.check_length("p", p.len());
        let mut all = DVector::zeros(self.q.len());
        static_forces(other, Some((&self.tool, &self.F_T_W)), 0.0, &mut self.data, &self.q, &mut all);
        p.copy_from(&all.rows(self.plant.model.n_actuated(), self.r.len()));
    }

    /// Returns the change of the static forces on the elastic coordinates and the twist of a frame
    /// (world axes, at its origin), as the subtree of a body moves with a twist in the body's joint
    /// axes while all coordinates keep their values; `None` for arms with balancers or load-dependent
    /// stiffness.
    ///
    /// # Panics
    /// If `p` is not n long, or there is no such body.
    pub fn moved_subtree(&mut self, body: usize, moved: &Twist, frame: &Frame, p: &mut [f64]) -> Option<Twist> {
        self.check_length("p", p.len());
        let model = &self.plant.model;
        let geometric = self.plant.elements.iter().any(|element| element.geometric.is_some());
        if geometric || !model.balancers().is_empty() {
            return None;
        }
        let own = &model.bodies()[body];
        let X_WJ = self.data.X_WB[own.parent] * own.X_PJ;
        let (R, at) = (X_WJ.rotation, X_WJ.translation.vector);
        let w = R * moved.angular;
        let v = R * moved.linear + at.cross(&w);
        let moved = (body, &Twist::new(v, w));
        let V = self.slopes.add_moved_subtree(&self.plant, &self.data, moved, frame.body, p);
        let p_F = self.data.X_WF(frame).translation.vector;
        Some(Twist::new(V.linear + V.angular.cross(&p_F), V.angular))
    }

    /// Returns `X_WF`, the pose of a frame of the arm in the world at the equilibrium.
    pub fn pose_of(&self, frame: &Frame) -> Pose {
        self.data.X_WF(frame)
    }

    /// Returns the twist of a frame per generalised force on each elastic coordinate, transposed:
    /// n×6, as [`Self::yielding`] for the tool.
    pub fn yielding_of(&mut self, frame: &Frame) -> &DMatrix<f64> {
        if self.factored {
            let mut J = Matrix6xX::zeros(self.q.len());
            frame_jacobian(&self.plant.model, &self.data, frame, &mut J);
            self.tangent.solve(&J.as_slice()[6 * self.plant.model.n_actuated()..], true);
        }
        &self.tangent.Y
    }

    /// Returns `J_WT_W`, the twist of the tool per rate of the coordinates, joints first, 6×(m + n).
    pub fn jacobian(&self) -> &Matrix6xX<f64> {
        &self.J
    }

    /// Returns the unbalanced force relative to the largest force; NaN before the first pose and
    /// after a failed one.
    pub fn residual(&self) -> f64 {
        self.residual
    }

    /// Returns the number of Newton iterations of the last pose.
    pub fn iterations(&self) -> usize {
        self.iterations
    }

    /// Returns the displacement of the tool per wrench on it, drives locked, 6×6 (m/N, rad/N; m/(N
    /// m), rad/(N m)).
    ///
    /// Cost: six solutions with the existing factor.
    pub fn compliance(&mut self) -> Matrix6<f64> {
        if !self.factored {
            return Matrix6::zeros();
        }
        let C = self.tangent.compliance(&self.J.as_slice()[6 * self.plant.model.n_actuated()..]);
        Matrix6::from_fn(|i, j| C[i][j])
    }

    /// Returns the twist of the tool per generalised force on each elastic coordinate,
    /// `J (K + dp/de)^-1`, transposed: n×6.
    ///
    /// A parameter that changes the forces on the elastic coordinates by `dr` moves the tool by
    /// `-yieldingᵀ dr`: one matrix serves any number of parameters. Zero before the first pose.
    ///
    /// Cost: as [`OperatingPoint::compliance`].
    pub fn yielding(&mut self) -> &DMatrix<f64> {
        let tool = self.tool.clone();
        self.yielding_of(&tool)
    }

    /// Returns the natural frequencies (Hz), ascending, undamped, drives locked, with the symmetric
    /// part of the stiffness.
    ///
    /// Cost: a mass matrix and the eigenvalues of an n×n matrix. Infinite or NaN, up to
    /// round-off, if a coordinate has no mass.
    pub fn frequencies_hz(&mut self) -> &[f64] {
        if !self.factored {
            return &[];
        }
        mass_matrix_at_poses(&self.plant.model, &mut self.data);
        let found = self.tangent.find_frequencies(self.data.M.as_slice()) == 1.0;
        to_hertz(found, &mut self.tangent.d);
        &self.tangent.d
    }
}
