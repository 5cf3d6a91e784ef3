//! Generalised-alpha over arms in lanes: the steps of [`crate::GeneralizedAlpha`], each lane with its bits.
//!
//! All lanes share the times of their steps. Each decides by itself when its iteration ends and when its matrix is renewed; where
//! one lane needs a matrix, all compute one and the others keep theirs. A lane that would do anything else than take whole
//! steps, or whose step fails, is left behind ([`LaneAlpha::left_behind`]): its run is to be taken alone.

use flexarm_kinematics::Real;

use crate::arm::FlexibleArm;
use crate::batch::dense::{cholesky, dot, product, solve_transposed, transpose};
use crate::batch::lane_arm::{LaneArm, set};
use crate::error::StepError;
use crate::implicit::{ImplicitStep, Newton, Search, Sizes};
use crate::integrator::TimeGrid;
use crate::reduced::ReducedArm;
use crate::statics::static_equilibrium;
use crate::stepper::{LARGEST_DEFLECTION, Start};
use crate::steppers::{AlphaSettings, Coefficients, GeneralizedAlpha, leave_of};

/// One run: its own view of motion and events, and the memory of its Newton iterations.
struct Lane {
    system: ReducedArm,
    newton: Newton,
    /// Whether its run goes on here.
    alive: bool,
}

/// Runs in lanes, at one time.
pub(super) struct LaneAlpha<T: Real> {
    coefficients: Coefficients,
    /// c of the dispersion correction, 0 without.
    c_h2: T,
    lanes: Vec<Lane>,
    searches: Vec<Search>,
    pub(super) arm: LaneArm<T>,
    pub(super) grid: TimeGrid,
    /// Positions, velocities, accelerations; ẍ one step before, a and x̃.
    pub(super) x: Vec<T>,
    v: Vec<T>,
    acceleration: Vec<T>,
    previous: Vec<T>,
    a: Vec<T>,
    x_tilde: Vec<T>,
    /// The same on trial.
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
    C: Vec<T>,
    K: Vec<T>,
    L: Vec<T>,
    work: Vec<T>,
}

impl<T: Real> LaneAlpha<T> {
    /// Arms at the start of their runs, as many as lanes; `None` where lanes do not know them.
    ///
    /// # Errors
    /// As a run alone, with the number of the lane.
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
            c_h2: T::splat(c * h * h),
            lanes: Vec::new(),
            searches: Vec::with_capacity(T::LANES),
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
            C: square(),
            K: square(),
            L: square(),
            work: square(),
        };
        for (lane, arm) in arms.iter().enumerate() {
            match all.begin(lane, arm, settings, start) {
                Ok(own) => all.lanes.push(own),
                Err(error) => return Some(Err((lane, error))),
            }
        }
        all.a.copy_from_slice(&all.acceleration);
        all.x_tilde.copy_from_slice(&all.acceleration);
        all.previous.copy_from_slice(&all.acceleration);
        Some(Ok(all))
    }

    /// The start of one run, as it would be alone.
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
            _ => nalgebra::DVector::zeros(n),
        };
        let mut system = ReducedArm::new(arm.clone());
        let (x, v) = system.start(&e)?;
        let alone = GeneralizedAlpha::new(&mut system, 0.0, h, settings, x, v)?;
        let now = ImplicitStep::current(&alone);
        for k in 0..n {
            self.x[k].set_lane(lane, now.x[k]);
            self.v[k].set_lane(lane, now.v[k]);
            self.acceleration[k].set_lane(lane, now.acceleration[k]);
        }
        system.sample_joints(0.0);
        self.place_joints(lane, &system);
        let mut newton = Newton::new(0, h);
        if let Some(left) = leave_of(settings, arm, h) {
            newton = newton.leaving(left);
        }
        Ok(Lane { system, newton, alive: true })
    }

    fn place_joints(&mut self, lane: usize, system: &ReducedArm) {
        let (q, qdot) = (system.state.q.as_slice(), system.state.qdot.as_slice());
        self.arm.set_joints(lane, q, qdot, system.qddot.as_slice());
    }

    /// Whether the run of a lane is to be taken alone.
    pub(super) fn left_behind(&self, lane: usize) -> bool {
        !self.lanes[lane].alive
    }

    /// One step of all lanes that are not left behind; of others the state means nothing.
    #[inline(always)]
    pub(super) fn step(&mut self) {
        let (t, h) = (self.grid.next_time(), self.grid.step_size());
        let mut unfactored = T::zero();
        for (k, lane) in self.lanes.iter().enumerate() {
            unfactored.set_lane(k, f64::from(u8::from(!lane.newton.factored)));
        }
        if unfactored.any_above(0.5) {
            // The first step: the joints are still where they start.
            self.arm.residual(T::one(), &self.x, &self.v, &self.acceleration, &mut self.r);
            self.factor(unfactored);
        }
        self.sample(t);
        self.predict();
        self.search(t, h);
        self.accept();
        self.grid.reach(t);
        self.renew_matrices();
    }

    /// Joints of all lanes at the end of the step; a step that has to be cut is none for lanes.
    fn sample(&mut self, t: f64) {
        for k in 0..T::LANES {
            let lane = &mut self.lanes[k];
            let stop = lane.system.resolved(self.grid.time(), t, GeneralizedAlpha::MOTION_RULE);
            lane.alive &= stop == t;
            lane.system.sample_joints(t);
            let (q, qdot) = (lane.system.state.q.as_slice(), lane.system.state.qdot.as_slice());
            self.arm.set_joints(k, q, qdot, lane.system.qddot.as_slice());
        }
    }

    /// ẍ⁺ by extrapolation, and the rest by the scheme.
    #[inline(always)]
    fn predict(&mut self) {
        for k in 0..self.x.len() {
            self.trial[k] = T::splat(2.0) * self.acceleration[k] - self.previous[k];
        }
        self.place(T::one());
    }

    /// As in a single run, where `active` is 1.
    #[inline(always)]
    fn place(&mut self, active: T) {
        product(&self.M_inverse_K, &self.trial, &mut self.shift);
        let h = self.grid.step_size();
        for k in 0..self.x.len() {
            let x_tilde = self.c_h2 * self.shift[k] + self.trial[k];
            let (x, v) = self.coefficients.advance(h, self.x[k], self.v[k], self.a[k], self.x_tilde[k], x_tilde);
            self.x_tilde_new[k] = picked(active, self.x_tilde_new[k], x_tilde);
            self.x_new[k] = picked(active, self.x_new[k], x);
            self.v_new[k] = picked(active, self.v_new[k], v);
        }
    }

    /// Newton's method in all lanes until none goes on.
    #[inline(always)]
    fn search(&mut self, t: f64, h: f64) {
        let c_K = self.coefficients.derivatives(h).1;
        let mut searches = std::mem::take(&mut self.searches);
        searches.clear();
        searches.extend((0..T::LANES).map(|_| Search::new(t, h, c_K)));
        let mut active = T::zero();
        for (k, lane) in self.lanes.iter().enumerate() {
            active.set_lane(k, f64::from(u8::from(lane.alive)));
        }
        while active.any_above(0.5) {
            self.arm.residual(active, &self.x_new, &self.v_new, &self.trial, &mut self.r);
            let mut stalled = T::zero();
            for (k, search) in searches.iter().enumerate() {
                let stalls = search.stalls() && active.lane(k) == 1.0;
                stalled.set_lane(k, f64::from(u8::from(stalls)));
            }
            if stalled.any_above(0.5) {
                self.factor(stalled);
                self.place(stalled);
                self.arm.residual(active, &self.x_new, &self.v_new, &self.trial, &mut self.r);
            }
            let sizes = self.correct(active);
            for (k, search) in searches.iter_mut().enumerate() {
                if active.lane(k) != 1.0 {
                    continue;
                }
                let lane = &mut self.lanes[k];
                match search.ends(sizes.lane(k), &mut lane.newton) {
                    Ok(false) => continue,
                    Ok(true) => lane.newton.found(search.iterations, search.iterations),
                    Err(_) => lane.alive = false,
                }
                // A link that has come apart is told by the run alone.
                lane.alive &= sizes.place.lane(k) <= LARGEST_DEFLECTION;
                active.set_lane(k, 0.0);
            }
        }
        self.searches = searches;
    }

    /// Takes the correction `d = J^-1 r` off everything on trial, where `active` is 1.
    #[inline(always)]
    fn correct(&mut self, active: T) -> LaneSizes<T> {
        let zero = T::zero();
        product(&self.inverse, &self.r, &mut self.d);
        let norm = dot(&self.d, &self.d).sqrt();
        for d in &mut self.d {
            *d = picked(active, zero, *d);
        }
        product(&self.M_inverse_K, &self.d, &mut self.shift);
        let (c_D, c_K) = self.coefficients.derivatives(self.grid.step_size());
        let mut sizes = LaneSizes { norm, correction: zero, acceleration: zero, place: zero };
        for k in 0..self.d.len() {
            let d = self.d[k];
            let d_tilde = d + self.c_h2 * self.shift[k];
            self.trial[k] -= d;
            self.x_tilde_new[k] -= d_tilde;
            self.x_new[k] -= T::splat(c_K) * d_tilde;
            self.v_new[k] -= T::splat(c_D) * d_tilde;
            sizes.include(d, self.trial[k], self.x_new[k]);
        }
        sizes
    }

    /// What was on trial becomes the state.
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

    /// New matrices for the lanes whose matrix is not good any more.
    #[inline(always)]
    fn renew_matrices(&mut self) {
        let mut stale = T::zero();
        for (k, lane) in self.lanes.iter().enumerate() {
            stale.set_lane(k, f64::from(u8::from(lane.alive && !lane.newton.factored)));
        }
        if stale.any_above(0.5) {
            self.factor(stale);
            for (k, lane) in self.lanes.iter_mut().enumerate() {
                if stale.lane(k) == 1.0 {
                    lane.newton.renewed_between();
                }
            }
        }
    }

    /// Newton's matrix at the configuration of the last residual, in the lanes where `wanted` is 1: see the dispersion
    /// correction of a single run.
    #[inline(always)]
    fn factor(&mut self, wanted: T) {
        let n = self.x.len();
        let (c_D, c_K) = self.coefficients.derivatives(self.grid.step_size());
        let Self { arm, S, C, K, L, work, c_h2, .. } = self;
        arm.mass(S);
        arm.damping_and_stiffness(c_D, c_K, C);
        arm.stiffness(K);
        // M^-1 K into `work`, and its place where it is wanted.
        L.copy_from_slice(S);
        let mut failed = cholesky(L, n);
        work.copy_from_slice(K);
        solve_transposed(L, work, n);
        transpose(work, n);
        set(wanted, work, &mut self.M_inverse_K);

        // S C Sᵀ
        L.copy_from_slice(C);
        for (column, x) in L.chunks_exact_mut(n).zip(work.chunks_exact(n)) {
            for (c, x) in C.chunks_exact(n).zip(x) {
                for (y, c) in column.iter_mut().zip(c) {
                    *y = *c_h2 * *c * *x + *y;
                }
            }
        }
        C.copy_from_slice(L);
        for (column, x) in C.chunks_exact_mut(n).zip(L.chunks_exact(n)) {
            for (y, a) in column.iter_mut().zip(work.chunks_exact(n)) {
                *y = *c_h2 * dot(a, x) + *y;
            }
        }
        // M + c h² K + S C Sᵀ, and Sᵀ on the right-hand side, which is kept transposed.
        for ((s, k), c) in S.iter_mut().zip(K.iter()).zip(C.iter()) {
            *s += *c_h2 * *k;
            *s += *c;
        }
        K.fill(T::zero());
        for j in 0..n {
            K[j * n + j] = T::one();
        }
        for (i, s) in K.iter_mut().zip(work.iter()) {
            *i += *c_h2 * *s;
        }
        failed += cholesky(S, n);
        solve_transposed(S, K, n);
        transpose(K, n);
        set(wanted, K, &mut self.inverse);
        for (k, lane) in self.lanes.iter_mut().enumerate() {
            if wanted.lane(k) == 1.0 {
                lane.newton.renewed();
                lane.newton.fresh = false;
                // A run alone goes on without a matrix, or fails: it will tell.
                lane.alive &= failed.lane(k) == 0.0;
            }
        }
    }
}

/// [`Sizes`] of all lanes.
struct LaneSizes<T> {
    norm: T,
    correction: T,
    acceleration: T,
    place: T,
}

impl<T: Real> LaneSizes<T> {
    #[inline(always)]
    fn include(&mut self, correction: T, acceleration: T, place: T) {
        // What is not a number stays in a sum, and passes by in a largest value.
        let broken = correction - correction;
        self.correction = larger(self.correction, correction.abs()) + broken;
        self.acceleration = larger(self.acceleration, acceleration.abs());
        self.place = larger(self.place, place.abs());
    }

    #[inline(always)]
    fn lane(&self, k: usize) -> Sizes {
        let mut sizes = Sizes::of(self.norm.lane(k));
        sizes.include(self.correction.lane(k), self.acceleration.lane(k), self.place.lane(k));
        sizes
    }
}

/// The new value where `active` is 1, else the old one.
#[inline(always)]
fn picked<T: Real>(active: T, old: T, new: T) -> T {
    active.pick_below(T::splat(0.5), old, new)
}

#[inline(always)]
fn larger<T: Real>(a: T, b: T) -> T {
    a.pick_below(b, b, a)
}
