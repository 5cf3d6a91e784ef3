//! Generalised-alpha for arms in SIMD lanes: the steps of [`crate::GeneralizedAlpha`], bitwise the
//! same in each lane.
//!
//! All lanes share the times of their steps. Each lane has its own decisions on convergence and on
//! renewal of its matrix; if one lane needs a matrix, all compute the mass matrix and the others
//! keep their matrices. A lane whose step fails or would have to be subdivided is abandoned
//! ([`LaneAlpha::left_behind`]), and its run is computed individually.

use std::sync::Arc;

use flexarm_kinematics::{Frame, Real};
use nalgebra::{DMatrix, DVector, Vector3};

use crate::arm::FlexibleArm;
use crate::batch::lane_arm::{LaneArm, set_lane};
use crate::dense::{congruence, dot, larger, product, solve_in_place};
use crate::error::StepError;
use crate::implicit::{ImplicitStep, Newton, Search, Sizes};
use crate::integrator::TimeGrid;
use crate::motion::PrescribedMotion;
use crate::reduced::{IMPULSE_DEFECT, ReducedArm, SLOW};
use crate::statics::static_equilibrium;
use crate::stepper::{LARGEST_DEFLECTION, Start};
use crate::steppers::{AlphaSettings, Coefficients, GeneralizedAlpha, leave_of};
use crate::system::SecondOrderSystem;

/// Phases of a step.
#[derive(Clone, Copy, PartialEq)]
enum Part {
    /// Computation of a matrix at the start.
    Begin,
    /// Newton's method.
    Iterate,
    /// Renewal of matrices for the next step.
    End,
}

/// One run: its motion, and the state of its Newton iterations.
struct Lane {
    motion: Arc<dyn PrescribedMotion>,
    newton: Newton,
    /// `c_D D + c_K K` and K, both constant.
    C: DMatrix<f64>,
    K: DMatrix<f64>,
    /// Whether the run continues in this lane.
    alive: bool,
}

/// Prescribed joints at the start of a step, to decide whether the step has to be subdivided as in
/// [`ReducedArm::resolved`].
struct Joints<T> {
    /// Workspace for the motion of one lane.
    own: [Vec<f64>; 3],
    qdot: Vec<T>,
    qddot: Vec<T>,
    /// Maximum speeds so far.
    top: Vec<T>,
}

impl<T: Real> Joints<T> {
    fn new(n: usize) -> Self {
        let zeros = || vec![T::zero(); n];
        Self {
            own: [vec![0.0; n], vec![0.0; n], vec![0.0; n]],
            qdot: zeros(),
            qddot: zeros(),
            top: vec![T::splat(SLOW); n],
        }
    }

    /// Begins a step with these rates.
    #[inline(always)]
    fn begin(&mut self, qdot: &[T], qddot: &[T]) {
        self.qdot.copy_from_slice(qdot);
        self.qddot.copy_from_slice(qddot);
        for (top, speed) in self.top.iter_mut().zip(qdot) {
            *top = larger(*top, speed.abs());
        }
    }

    /// Returns 1 in lanes in which a step of size h may end with these rates; the next step begins
    /// with them.
    #[inline(always)]
    fn meets_impulse(&mut self, h: f64, qdot: &[T], qddot: &[T]) -> T {
        let [(_, at_start), (_, at_end)] = GeneralizedAlpha::ENDS;
        let mut meets = T::one();
        for k in 0..qdot.len() {
            let mean = T::zero() + T::splat(at_start) * self.qddot[k];
            let defect = qdot[k] - self.qdot[k] - T::splat(h) * (mean + T::splat(at_end) * qddot[k]);
            let bound = T::splat(IMPULSE_DEFECT) * larger(self.top[k], qdot[k].abs());
            // NaN does not satisfy the bound.
            let below = bound.pick_below(defect.abs(), T::zero(), meets);
            let number = (defect * T::zero()).pick_below(T::splat(0.5), T::one(), T::zero());
            meets = number.pick_below(T::splat(0.5), T::zero(), below);
        }
        self.begin(qdot, qddot);
        meets
    }
}

/// Runs in lanes at one common time.
pub(super) struct LaneAlpha<T: Real> {
    coefficients: Coefficients,
    /// `c h²` of the dispersion correction, 0 without.
    c_h2: f64,
    lanes: Vec<Lane>,
    searches: Vec<Search>,
    arm: LaneArm<T>,
    joints: Joints<T>,
    pub(super) grid: TimeGrid,
    /// Positions, velocities, accelerations; ẍ of the previous step; a and x̃.
    x: Vec<T>,
    v: Vec<T>,
    acceleration: Vec<T>,
    previous: Vec<T>,
    a: Vec<T>,
    x_tilde: Vec<T>,
    /// Trial values of the same.
    x_new: Vec<T>,
    v_new: Vec<T>,
    trial: Vec<T>,
    x_tilde_new: Vec<T>,
    /// Residual and correction.
    r: Vec<T>,
    d: Vec<T>,
    shift: Vec<T>,
    /// `M^-1 K` and the inverse of Newton's matrix.
    M_inverse_K: Vec<T>,
    inverse: Vec<T>,
    /// Workspaces of the matrices.
    S: Vec<T>,
    matrices: Matrices,
}

impl<T: Real> LaneAlpha<T> {
    /// Creates the runs at their start, one arm per lane; `None` if lanes do not support them.
    ///
    /// # Errors
    /// As of an individual run, with the number of the lane.
    pub(super) fn new(
        arms: &[&FlexibleArm],
        settings: AlphaSettings,
        h: f64,
        start: Start,
    ) -> Option<Result<Self, (usize, StepError)>> {
        let arm = LaneArm::new(arms)?;
        let n = arm.dimension();
        let zeros = || vec![T::zero(); n];
        let square = || vec![T::zero(); n * n];
        let coefficients = Coefficients::new(settings.rho);
        let c = if settings.dispersion_correction { coefficients.dispersion().max(0.0) } else { 0.0 };
        let mut all = Self {
            coefficients,
            c_h2: c * h * h,
            lanes: Vec::new(),
            searches: Vec::with_capacity(T::LANES),
            joints: Joints::new(arm.joints()),
            arm,
            grid: TimeGrid::new(0.0, h),
            x: zeros(),
            v: zeros(),
            acceleration: zeros(),
            previous: zeros(),
            a: zeros(),
            x_tilde: zeros(),
            x_new: zeros(),
            v_new: zeros(),
            trial: zeros(),
            x_tilde_new: zeros(),
            r: zeros(),
            d: zeros(),
            shift: zeros(),
            M_inverse_K: square(),
            inverse: square(),
            S: square(),
            matrices: Matrices::new(n),
        };
        for (lane, arm) in arms.iter().enumerate() {
            match all.begin(lane, arm, settings, start) {
                Ok(own) => all.lanes.push(own),
                Err(error) => return Some(Err((lane, error))),
            }
        }
        let [qdot, qddot] = all.arm.joint_rates();
        all.joints.begin(qdot, qddot);
        // Poses of the joints before the first step.
        all.arm.residual(T::one(), &all.x, &all.v, &all.acceleration, &mut all.r);
        all.a.copy_from_slice(&all.acceleration);
        all.x_tilde.copy_from_slice(&all.acceleration);
        all.previous.copy_from_slice(&all.acceleration);
        Some(Ok(all))
    }

    /// Starts one run as it would start individually.
    fn begin(
        &mut self,
        lane: usize,
        arm: &FlexibleArm,
        settings: AlphaSettings,
        start: Start,
    ) -> Result<Lane, StepError> {
        let h = self.grid.step_size();
        let n = arm.n_elastic_coordinates();
        let e = match start {
            Start::Equilibrium if n > 0 => static_equilibrium(arm, 0.0)?,
            _ => DVector::zeros(n),
        };
        let mut system = ReducedArm::new(arm.clone());
        let (x, v) = system.start(&e)?;
        let alone = GeneralizedAlpha::new(&mut system, 0.0, h, settings, x, v)?;
        let now = ImplicitStep::current(&alone);
        set_lane(&mut self.x, lane, now.x.as_slice());
        set_lane(&mut self.v, lane, now.v.as_slice());
        set_lane(&mut self.acceleration, lane, now.acceleration.as_slice());
        system.sample_joints(0.0);
        self.place_joints(lane, &system);
        let mut newton = Newton::new(0, h);
        let left = leave_of(settings, arm, h);
        if let Some(left) = left {
            newton = newton.leaving(left);
        }
        let [mut C, mut K] = [DMatrix::zeros(n, n), DMatrix::zeros(n, n)];
        let (c_D, c_K) = self.coefficients.derivatives(h);
        system.damping_and_stiffness(c_D, c_K, &mut C);
        system.stiffness(&mut K);
        Ok(Lane { motion: arm.motion.clone(), newton, C, K, alive: true })
    }

    fn place_joints(&mut self, lane: usize, system: &ReducedArm) {
        let (q, qdot) = (system.state.q.as_slice(), system.state.qdot.as_slice());
        self.arm.set_joints(lane, q, qdot, system.qddot.as_slice());
    }

    /// Returns the current flexible minus rigid position of a frame (m, world axes).
    #[inline(always)]
    pub(super) fn deflection(&mut self, tool: &Frame) -> Vector3<T> {
        self.arm.deflection(tool, &self.x)
    }

    /// Returns whether the run of a lane has to be computed individually.
    pub(super) fn left_behind(&self, lane: usize) -> bool {
        !self.lanes[lane].alive
    }

    /// Advances all lanes that are not abandoned by one step; the state of abandoned lanes is
    /// undefined.
    ///
    /// The residual and the matrices are each called at one place only: inlined twice, the code
    /// would exceed the instruction cache.
    #[inline(always)]
    pub(super) fn step(&mut self) {
        let (t, h) = (self.grid.next_time(), self.grid.step_size());
        let c_K = self.coefficients.derivatives(h).1;
        self.searches.clear();
        self.searches.extend((0..T::LANES).map(|_| Search::new(t, h, c_K)));
        let steps = self.grid.steps();
        self.lanes.iter_mut().for_each(|lane| lane.newton.begin_step(steps));
        let mut active = T::one();
        let mut part = Part::Iterate;
        if self.mask(|lane| !lane.newton.factored).any_above(0.5) {
            // First step: the joints are still at their initial position.
            part = Part::Begin;
            self.x_new.copy_from_slice(&self.x);
            self.v_new.copy_from_slice(&self.v);
            self.trial.copy_from_slice(&self.acceleration);
        } else {
            active = self.begin_search(t);
        }
        loop {
            if part != Part::End {
                self.arm.residual(active, &self.x_new, &self.v_new, &self.trial, &mut self.r);
            }
            let wanted = match part {
                Part::Begin => T::one(),
                Part::Iterate => self.stalled(active),
                Part::End => self.mask(|lane| lane.alive && !lane.newton.factored),
            };
            let renewed = wanted.any_above(0.5);
            if renewed {
                self.factor(wanted);
            }
            match part {
                Part::Begin => {
                    active = self.begin_search(t);
                    part = Part::Iterate;
                }
                Part::Iterate if renewed => self.place(wanted),
                Part::Iterate => {
                    active = self.correct(active);
                    if !active.any_above(0.5) {
                        self.accept();
                        self.grid.reach(t);
                        part = Part::End;
                    }
                }
                Part::End => {
                    let own = self.lanes.iter_mut().enumerate().filter(|(k, _)| wanted.lane(*k) == 1.0);
                    own.for_each(|(_, lane)| lane.newton.renewed_between());
                    return;
                }
            }
        }
    }

    /// Returns 1 in the lanes that satisfy a condition, else 0.
    fn mask(&self, condition: impl Fn(&Lane) -> bool) -> T {
        let mut mask = T::zero();
        for (k, lane) in self.lanes.iter().enumerate() {
            mask.set_lane(k, f64::from(u8::from(condition(lane))));
        }
        mask
    }

    /// Sets the joints and the prediction at the end of the step; returns the lanes that take the
    /// step.
    #[inline(always)]
    fn begin_search(&mut self, t: f64) -> T {
        self.sample(t);
        for k in 0..self.x.len() {
            self.trial[k] = T::splat(2.0) * self.acceleration[k] - self.previous[k];
        }
        self.place(T::one());
        self.mask(|lane| lane.alive)
    }

    /// Returns the lanes whose iteration needs a fresh matrix; at most once per step.
    fn stalled(&mut self, active: T) -> T {
        let mut stalled = T::zero();
        for (k, search) in self.searches.iter_mut().enumerate() {
            let stalls = active.lane(k) == 1.0 && search.stalls() && !search.renewed;
            search.renewed |= stalls;
            stalled.set_lane(k, f64::from(u8::from(stalls)));
        }
        stalled
    }

    /// Samples the joints of all lanes at the end of the step; lanes whose step has to be
    /// subdivided are abandoned.
    #[inline(always)]
    fn sample(&mut self, t: f64) {
        let joints = &mut self.joints;
        for (k, lane) in self.lanes.iter().enumerate() {
            let [q, qdot, qddot] = &mut joints.own;
            lane.motion.sample(t, q, qdot, qddot);
            self.arm.set_joints(k, q, qdot, qddot);
        }
        let [qdot, qddot] = self.arm.joint_rates();
        let meets = joints.meets_impulse(t - self.grid.time(), qdot, qddot);
        for (k, lane) in self.lanes.iter_mut().enumerate() {
            lane.alive &= meets.lane(k) == 1.0;
        }
    }

    /// Computes positions and velocities from the trial accelerations as in a single run, where
    /// `active` is 1.
    #[inline(always)]
    fn place(&mut self, active: T) {
        product(&self.M_inverse_K, &self.trial, &mut self.shift);
        let h = self.grid.step_size();
        let c_h2 = T::splat(self.c_h2);
        let n = self.trial.len();
        let (x, v, a, x_tilde) = (&self.x[..n], &self.v[..n], &self.a[..n], &self.x_tilde[..n]);
        let (shift, x_tilde_new) = (&self.shift[..n], &mut self.x_tilde_new[..n]);
        let (x_new, v_new) = (&mut self.x_new[..n], &mut self.v_new[..n]);
        for (k, trial) in self.trial.iter().enumerate() {
            let new = c_h2 * shift[k] + *trial;
            let (place, speed) = self.coefficients.advance(h, x[k], v[k], a[k], x_tilde[k], new);
            x_tilde_new[k] = picked(active, x_tilde_new[k], new);
            x_new[k] = picked(active, x_new[k], place);
            v_new[k] = picked(active, v_new[k], speed);
        }
    }

    /// Subtracts the correction `d = J^-1 r` from all trial values where `active` is 1; returns the
    /// lanes that continue.
    #[inline(always)]
    fn correct(&mut self, active: T) -> T {
        let zero = T::zero();
        product(&self.inverse, &self.r, &mut self.d);
        let norm = dot(&self.d, &self.d).sqrt();
        for d in &mut self.d {
            *d = picked(active, zero, *d);
        }
        product(&self.M_inverse_K, &self.d, &mut self.shift);
        let (c_D, c_K) = self.coefficients.derivatives(self.grid.step_size());
        let (c_h2, c_D, c_K) = (T::splat(self.c_h2), T::splat(c_D), T::splat(c_K));
        let mut sizes = LaneSizes { norm, correction: zero, broken: zero, acceleration: zero, place: zero };
        let n = self.d.len();
        let (shift, trial, x_tilde) = (&self.shift[..n], &mut self.trial[..n], &mut self.x_tilde_new[..n]);
        let (x, v) = (&mut self.x_new[..n], &mut self.v_new[..n]);
        for (k, d) in self.d.iter().enumerate() {
            let d_tilde = *d + c_h2 * shift[k];
            trial[k] -= *d;
            x_tilde[k] -= d_tilde;
            x[k] -= c_K * d_tilde;
            v[k] -= c_D * d_tilde;
            sizes.include(*d, trial[k], x[k]);
        }
        self.judge(active, &sizes)
    }

    /// Returns the lanes whose iteration continues.
    fn judge(&mut self, mut active: T, sizes: &LaneSizes<T>) -> T {
        for (k, search) in self.searches.iter_mut().enumerate() {
            if active.lane(k) != 1.0 {
                continue;
            }
            let lane = &mut self.lanes[k];
            match search.ends(sizes.lane(k), &mut lane.newton) {
                Ok(false) => continue,
                Ok(true) => lane.newton.found(search.iterations, search.iterations),
                Err(_) => lane.alive = false,
            }
            // An excessive deflection is reported by the individual run.
            lane.alive &= sizes.place.lane(k) <= LARGEST_DEFLECTION;
            active.set_lane(k, 0.0);
        }
        active
    }

    /// Accepts the trial values as the state.
    #[inline(always)]
    fn accept(&mut self) {
        for k in 0..self.x.len() {
            self.a[k] = self.coefficients.remembered(self.a[k], self.x_tilde[k], self.x_tilde_new[k]);
        }
        std::mem::swap(&mut self.x, &mut self.x_new);
        std::mem::swap(&mut self.v, &mut self.v_new);
        std::mem::swap(&mut self.x_tilde, &mut self.x_tilde_new);
        std::mem::swap(&mut self.previous, &mut self.acceleration);
        std::mem::swap(&mut self.acceleration, &mut self.trial);
    }

    /// Computes Newton's matrix at the configuration of the last residual in the lanes in which
    /// `wanted` is 1.
    ///
    /// Usually it is a single lane, so matrices are factorised one by one, with vector instructions
    /// along the columns.
    #[inline(always)]
    fn factor(&mut self, wanted: T) {
        self.arm.mass(&mut self.S);
        for k in (0..T::LANES).filter(|k| wanted.lane(*k) == 1.0) {
            let (lane, matrices) = (&mut self.lanes[k], &mut self.matrices);
            for (to, from) in matrices.S.iter_mut().zip(T::flat(&self.S).chunks_exact(T::LANES)) {
                *to = from[k];
            }
            // Without a valid matrix the lane is abandoned; the individual run continues without it
            // or reports the error.
            lane.alive &= matrices.invert(self.c_h2, lane.C.as_slice(), lane.K.as_slice());
            lane.newton.renewed();
            lane.newton.fresh = false;
            set_lane(&mut self.M_inverse_K, k, &matrices.M_inverse_K);
            set_lane(&mut self.inverse, k, &matrices.inverse);
        }
    }
}

/// Newton's matrix of one lane; n × n, column-major.
struct Matrices {
    n: usize,
    /// M, then `M + c h² K + S C Sᵀ` and its factor.
    S: Vec<f64>,
    /// `S C Sᵀ`.
    product: Vec<f64>,
    L: Vec<f64>,
    turned: Vec<f64>,
    M_inverse_K: Vec<f64>,
    inverse: Vec<f64>,
}

impl Matrices {
    fn new(n: usize) -> Self {
        let square = || vec![0.0; n * n];
        Self {
            n,
            S: square(),
            product: square(),
            L: square(),
            turned: square(),
            M_inverse_K: square(),
            inverse: square(),
        }
    }

    /// Computes `M^-1 K` and the inverse of Newton's matrix from S and the C and K of a run, as the
    /// dispersion correction of a single run does; returns false if there is none.
    #[inline(always)]
    fn invert(&mut self, c_h2: f64, C: &[f64], K: &[f64]) -> bool {
        let Self { n, S, product, L, turned, M_inverse_K, inverse } = self;
        let n = *n;
        L.copy_from_slice(S);
        M_inverse_K.copy_from_slice(K);
        let positive = solve_in_place(L, M_inverse_K, n);
        congruence(c_h2, M_inverse_K, C, n, [L, turned], product);
        // M + c h² K + S C Sᵀ, and Sᵀ as right-hand side, stored transposed.
        for ((s, k), c) in S.iter_mut().zip(K).zip(product.iter()) {
            *s += c_h2 * *k;
            *s += *c;
        }
        inverse.fill(0.0);
        for j in 0..n {
            inverse[j * n + j] = 1.0;
        }
        for (i, s) in inverse.iter_mut().zip(M_inverse_K.iter()) {
            *i += c_h2 * *s;
        }
        solve_in_place(S, inverse, n) && positive
    }
}

/// [`Sizes`] of all lanes.
struct LaneSizes<T> {
    norm: T,
    correction: T,
    /// Zero, or NaN if a correction is not finite.
    broken: T,
    acceleration: T,
    place: T,
}

impl<T: Real> LaneSizes<T> {
    #[inline(always)]
    fn include(&mut self, correction: T, acceleration: T, place: T) {
        // NaN propagates through a sum but not through a maximum.
        self.broken += correction * T::zero();
        self.correction = larger(self.correction, correction.abs());
        self.acceleration = larger(self.acceleration, acceleration.abs());
        self.place = larger(self.place, place.abs());
    }

    #[inline(always)]
    fn lane(&self, k: usize) -> Sizes {
        let mut sizes = Sizes::of(self.norm.lane(k));
        sizes.include(self.correction.lane(k) + self.broken.lane(k), self.acceleration.lane(k), self.place.lane(k));
        sizes
    }
}

/// Returns the new value where `active` is 1, else the old one.
#[inline(always)]
fn picked<T: Real>(active: T, old: T, new: T) -> T {
    active.pick_below(T::splat(0.5), old, new)
}
