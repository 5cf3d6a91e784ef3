//! Gearbox effects other than elasticity: transmission errors, hysteresis, load-dependent friction,
//! and gears that couple several joints.
//!
//! ```text
//! δ = e - ε(q_m)                              ε: transmission error, δ: spring deflection  (1)
//! F = elastic(δ) + Σ k_i s_i                  s_i: deflection of slider i, |s_i| <= r_i    (2)
//! s_i ← clamp(s_i + Δδ, -r_i, r_i)            play operator, state at the ends of steps    (3)
//! on e: F;   on q_m: -ε'(q_m) F               so that F does the work F δ̇                  (4)
//! θ = C^-1 q,  K = C^-T K_m C^-1,  τ_m = Cᵀ τ gears between motors θ and joints q = C θ    (5)
//! ```
//! Sliders in parallel follow Masing's rules: a branch after a reversal is the first loading curve
//! scaled by two, and the loss of a closed cycle does not depend on the rate. Start at
//! [`TransmissionError`], [`Hysteresis`], [`GearCoupling`] and [`LoadFriction`]; [`GearState`] is
//! the state of a run. Not here: springs (`arm`), rotors (in the tree).
//!
//! Sources: [Iwan 1966] for sliders in parallel; [Tuttle & Seering 1996] for (1) with harmonics of
//! the motor.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{DMatrix, DVector, Vector6};

use crate::arm::{Damping, ElasticElement, FlexibleArm, add_product};
use crate::drive::{SpringCurve, TorqueCurve};
use crate::error::StepError;
use crate::guide::Guide;
use crate::statics::spring_forces;

/// One harmonic of a transmission error: `amplitude sin(cycles q + phase)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Harmonic {
    /// Amplitude on the joint side (rad or m).
    pub amplitude: f64,
    /// Cycles per turn of the joint, which is radians of phase per radian; for a prismatic joint
    /// radians per metre.
    pub cycles: f64,
    /// Phase at joint position zero (rad).
    pub phase: f64,
}

/// Transmission error as a function of the motor's coordinate, equation (1) of the module.
#[derive(Clone, Debug, PartialEq)]
pub struct TransmissionError {
    /// Element index of the gearbox spring (single coordinate).
    pub element: usize,
    /// Actuated coordinate of the joint, on the motor side.
    pub motor: usize,
    /// Harmonics.
    pub harmonics: Vec<Harmonic>,
}

impl TransmissionError {
    /// Returns ε (rad or m) at motor coordinate `q`, on the joint side.
    pub fn at(&self, q: f64) -> f64 {
        self.harmonics.iter().map(|h| h.amplitude * (h.cycles * q + h.phase).sin()).sum()
    }

    /// Returns the second derivative d²ε/dq².
    pub(crate) fn bend(&self, q: f64) -> f64 {
        self.harmonics.iter().map(|h| -h.amplitude * h.cycles * h.cycles * (h.cycles * q + h.phase).sin()).sum()
    }

    /// Returns the derivative dε/dq.
    pub fn slope(&self, q: f64) -> f64 {
        let cosine = |h: &Harmonic| h.amplitude * h.cycles * (h.cycles * q + h.phase + FRAC_PI_2).sin();
        self.harmonics.iter().map(cosine).sum()
    }
}

/// A spring in series with dry friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slider {
    /// Stiffness of the spring (N m/rad or N/m).
    pub stiffness: f64,
    /// Deflection of the spring at which the friction element slips (rad or m).
    pub reach: f64,
}

/// A gearbox with rate-independent hysteresis: its torque depends on the history of its deflection,
/// equations (2) and (3) of the module.
#[derive(Clone, Debug, PartialEq)]
pub struct Hysteresis {
    /// Element index of the gearbox spring (single coordinate).
    pub element: usize,
    /// Elastic torque, without friction.
    pub elastic: TorqueCurve,
    /// Sliders in parallel with the elastic spring.
    pub sliders: Vec<Slider>,
}

impl Hysteresis {
    /// Creates sliders that slip one after the other at evenly spaced deflections up to `reach`,
    /// with the total torque `friction`.
    ///
    /// The first loading curve is a polygon with its corners on the parabola `friction (2 x - x²)`,
    /// `x = δ / reach`, of Rayleigh's law. All arguments are positive.
    pub fn even_sliders(friction: f64, reach: f64, count: usize) -> Vec<Slider> {
        let n = count as f64;
        // The slopes of the polygon decrease from corner to corner by 2 friction / (reach n).
        let slip = |i: usize| reach * (i as f64 + 1.0) / n;
        let each = 2.0 * friction / (reach * n);
        let slope = |i: usize| if i < count { each * (n - i as f64 - 0.5) } else { 0.0 };
        (0..count).map(|i| Slider { stiffness: slope(i) - slope(i + 1), reach: slip(i) }).collect()
    }

    /// Returns the curve of first loading from rest.
    pub fn first_loading(&self) -> TorqueCurve {
        self.sliders
            .iter()
            .fold(self.elastic.clone(), |curve, slider| curve.with_slider(slider.stiffness, slider.reach))
    }

    /// Returns the slope for small motions about the deflection `delta`, at which no slider slips.
    pub fn stuck_slope(&self, delta: f64) -> f64 {
        self.elastic.slope(delta) + self.sliders.iter().map(|slider| slider.stiffness).sum::<f64>()
    }

    /// Returns the loss of a closed cycle between `-amplitude` and `amplitude` (J):
    /// `4 Σ k r (amplitude - r)` over the sliders that slip.
    pub fn loss(&self, amplitude: f64) -> f64 {
        self.sliders.iter().map(|s| 4.0 * s.stiffness * s.reach * (amplitude - s.reach).max(0.0)).sum()
    }
}

/// Friction that grows with the torque transmitted by a gear: `coefficient |τ| tanh(q̇ / v_0)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadFriction {
    /// Coordinate of the joint.
    pub coordinate: usize,
    /// Element index of the gearbox spring (single coordinate) whose torque is transmitted; without
    /// one, the torque that drives the joint counts.
    pub element: Option<usize>,
    /// Ratio of friction to transmitted torque.
    pub coefficient: f64,
    /// Speed `v_0` over which the sign changes (rad/s).
    pub regularisation: f64,
}

impl LoadFriction {
    pub(crate) fn torque(&self, transmitted: f64, rate: f64) -> f64 {
        self.coefficient * transmitted.abs() * (rate / self.regularisation).tanh()
    }

    pub(crate) fn slope(&self, transmitted: f64, rate: f64) -> f64 {
        let t = (rate / self.regularisation).tanh();
        self.coefficient * transmitted.abs() * (1.0 - t * t) / self.regularisation
    }

    /// Returns the derivative of the friction with respect to the transmitted torque.
    pub(crate) fn by_torque(&self, transmitted: f64, rate: f64) -> f64 {
        self.coefficient * transmitted.signum() * (rate / self.regularisation).tanh()
    }
}

/// Gears through which motors move several joints, equation (5) of the module.
#[derive(Clone, Debug, PartialEq)]
pub struct GearCoupling {
    /// Element indices of the gearbox springs in the order of the motors; empty if the gears are
    /// rigid.
    pub elements: Vec<usize>,
    /// Coordinates of the joints, in the same order.
    pub coordinates: Vec<usize>,
    /// C: joint coordinates from motor coordinates (after the gears).
    pub C: DMatrix<f64>,
    /// Its inverse.
    pub C_inverse: DMatrix<f64>,
}

impl GearCoupling {
    /// Returns `C^-T diag(values) C^-1`: stiffness, damping or inertia of the motors on the joints.
    pub fn on_joints(C_inverse: &DMatrix<f64>, values: &[f64]) -> DMatrix<f64> {
        C_inverse.transpose() * DMatrix::from_diagonal(&DVector::from_column_slice(values)) * C_inverse
    }

    /// Returns the motor torques after the gears, `Cᵀ τ`, from joint torques `tau` over all
    /// coordinates.
    pub fn motor_torques(&self, tau: &[f64]) -> Vec<f64> {
        let joints = DVector::from_iterator(self.coordinates.len(), self.coordinates.iter().map(|k| tau[*k]));
        self.C.tr_mul(&joints).as_slice().to_vec()
    }

    /// Returns whether C is the identity, so that each motor moves only its own joint.
    pub(crate) fn is_none(&self) -> bool {
        self.C.is_identity(0.0)
    }

    /// Returns the index of a coordinate among the coupled ones.
    pub(crate) fn place(&self, coordinate: usize) -> Option<usize> {
        self.coordinates.iter().position(|k| *k == coordinate)
    }

    /// Returns the rate of motor `number` after its gear.
    pub(crate) fn motor_rate(&self, number: usize, rates: &[f64]) -> f64 {
        self.coordinates.iter().enumerate().map(|(j, k)| self.C_inverse[(number, j)] * rates[*k]).sum()
    }
}

impl FlexibleArm {
    /// Returns the arm with gears that couple several joints. Springs, dampers and friction given
    /// so far are those of the motors after their gears; they are transformed to the joints.
    ///
    /// # Errors
    /// [`StepError::Setup`] if sizes differ, or if springs have more than one coordinate, are
    /// nonlinear or are missing for some motors; errors of [`FlexibleArm::new`].
    pub fn with_coupling(mut self, coupling: GearCoupling) -> Result<Self, StepError> {
        let n = coupling.coordinates.len();
        let single = |k: &usize| self.elements.get(*k).is_some_and(|e| e.size == 1 && e.curve.is_none());
        let fits = coupling.C.shape() == (n, n) && coupling.C_inverse.shape() == (n, n);
        if !(fits
            && (coupling.elements.is_empty() || coupling.elements.len() == n)
            && coupling.elements.iter().all(single))
        {
            return Err(StepError::Setup(format!(
                "a coupling of {n} joints needs {n} straight springs of one coordinate, or none, and a {n}x{n} matrix"
            )));
        }
        let (mut stiffness, mut damping) = (Vec::new(), Vec::new());
        for &k in &coupling.elements {
            let element = &self.elements[k];
            stiffness.push(element.K[(0, 0)]);
            damping.push(if let Damping::Dampers(d) = element.damping { d[0] } else { 0.0 });
        }
        let K = GearCoupling::on_joints(&coupling.C_inverse, &stiffness_of(n, &stiffness));
        let D = GearCoupling::on_joints(&coupling.C_inverse, &stiffness_of(n, &damping));
        for (i, &k) in coupling.elements.iter().enumerate() {
            let row = self.offset(&self.elements[k]);
            for (j, &l) in coupling.elements.iter().enumerate().skip(i + 1) {
                let column = self.offset(&self.elements[l]);
                self.cross_stiffness.extend((K[(i, j)] != 0.0).then_some((row, column, K[(i, j)])));
                self.cross_damping.extend((D[(i, j)] != 0.0).then_some((row, column, D[(i, j)])));
            }
            let element = &mut self.elements[k];
            element.K[(0, 0)] = K[(i, i)];
            element.C[(0, 0)] = 1.0 / K[(i, i)];
            match &mut element.damping {
                Damping::Dampers(d) => d[0] = D[(i, i)],
                _ if D[(i, i)] != 0.0 => self.cross_damping.push((row, row, D[(i, i)])),
                _ => {}
            }
        }
        self.coupling = Some(coupling);
        self.update_modes_and_damping()?;
        Ok(self)
    }

    /// Returns `dK/d(ln k)` for the stiffness k of one motor's spring in coupled gears: the elastic
    /// coordinates of all coupled springs, and the matrix over them. `None` if the element is not
    /// coupled.
    pub fn coupled_stiffness_slope(&self, element: usize) -> Option<(Vec<usize>, DMatrix<f64>)> {
        let coupling = self.coupling.as_ref()?;
        let motor = coupling.elements.iter().position(|k| *k == element)?;
        let places: Vec<usize> = coupling.elements.iter().map(|k| self.offset(&self.elements[*k])).collect();
        let K = self.stiffness().select_rows(&places).select_columns(&places);
        let own = (coupling.C.tr_mul(&K) * &coupling.C)[(motor, motor)];
        let row = coupling.C_inverse.row(motor);
        Some((places, row.tr_mul(&row) * own))
    }

    /// Returns `dD/d(ln d)` for the damper d of one motor in coupled gears, in the form of
    /// [`FlexibleArm::coupled_stiffness_slope`].
    pub fn coupled_damping_slope(&self, element: usize) -> Option<(Vec<usize>, DMatrix<f64>)> {
        let coupling = self.coupling.as_ref()?;
        let motor = coupling.elements.iter().position(|k| *k == element)?;
        let places: Vec<usize> = coupling.elements.iter().map(|k| self.offset(&self.elements[*k])).collect();
        // Dampers only: other damping is derived from the modes.
        let mut D = DMatrix::zeros(places.len(), places.len());
        for (i, k) in coupling.elements.iter().enumerate() {
            D[(i, i)] = if let Damping::Dampers(d) = self.elements[*k].damping { d[0] } else { 0.0 };
        }
        let place = |row: usize| places.iter().position(|k| *k == row);
        for &(row, column, d) in &self.cross_damping {
            let (Some(i), Some(j)) = (place(row), place(column)) else { continue };
            (D[(i, j)], D[(j, i)]) = (d, d);
        }
        let own = (coupling.C.tr_mul(&D) * &coupling.C)[(motor, motor)];
        let row = coupling.C_inverse.row(motor);
        Some((places, row.tr_mul(&row) * own))
    }

    /// Returns the arm with hysteresis in gears; the springs of these gears get the first loading
    /// curve.
    ///
    /// # Errors
    /// [`StepError::Setup`] if an element does not exist or has more than one coordinate; errors of
    /// [`FlexibleArm::new`].
    pub fn with_hysteresis(mut self, laws: Vec<Hysteresis>) -> Result<Self, StepError> {
        for law in &laws {
            let Some(element) = self.elements.get_mut(law.element).filter(|e| e.size == 1) else {
                return Err(StepError::Setup(format!(
                    "hysteresis of element {}: it needs a spring of one coordinate",
                    law.element
                )));
            };
            let curve = law.first_loading();
            element.K[(0, 0)] = curve.stiffest();
            element.C[(0, 0)] = 1.0 / curve.stiffest();
            element.curve = Some(curve.into());
        }
        self.hysteresis = laws;
        self.update_modes_and_damping()?;
        Ok(self)
    }

    /// Returns the arm with transmission errors.
    ///
    /// # Errors
    /// As [`FlexibleArm::with_hysteresis`].
    pub fn with_transmission_errors(mut self, errors: Vec<TransmissionError>) -> Result<Self, StepError> {
        for error in &errors {
            let single = self.elements.get(error.element).is_some_and(|e| e.size == 1);
            if !single || error.motor >= self.model.n_actuated() {
                let text =
                    format!("transmission error of element {}: it needs a spring of one coordinate", error.element);
                return Err(StepError::Setup(text));
            }
        }
        self.transmission = errors;
        self.update_modes_and_damping()?;
        Ok(self)
    }

    /// Returns whether any gear has a transmission error, hysteresis, load-dependent friction or
    /// coupling, or any joint a telescopic guide.
    pub(crate) fn has_gear_laws(&self) -> bool {
        !(self.transmission.is_empty() && self.hysteresis.is_empty() && self.load_friction.is_empty())
            || self.has_guides()
            || self.coupling.as_ref().is_some_and(|coupling| !coupling.is_none())
    }

    /// Returns the largest friction torque of the gears with hysteresis (N m or N); a scale for the
    /// force balance, in which smaller residuals do not count.
    pub(crate) fn friction_of_gears(&self) -> f64 {
        let of_law = |law: &Hysteresis| law.sliders.iter().map(|s| s.stiffness * s.reach).sum::<f64>();
        self.hysteresis.iter().map(of_law).fold(0.0, f64::max)
    }

    /// Returns the deflection δ (rad, m) of a spring with one coordinate e, with the joints at `q`:
    /// e minus the transmission error, if any.
    pub fn deflection(&self, element: usize, e: f64, q: &[f64]) -> f64 {
        let errors = self.transmission.iter().filter(|error| error.element == element);
        errors.fold(e, |delta, error| delta - error.at(q[error.motor]))
    }

    /// Returns the slope of a nonlinear spring for small motions about the coordinates `q`: no
    /// slider slips, and within backlash the steepest slope counts. `None` for a linear spring.
    pub fn vibration_slope(&self, element: usize, q: &[f64]) -> Option<f64> {
        let own = &self.elements[element];
        let curve = own.curve.as_ref()?;
        let delta = self.deflection(element, q[own.coordinate], q);
        if let Some(law) = self.hysteresis.iter().find(|law| law.element == element) {
            return Some(law.stuck_slope(delta));
        }
        Some(curve.slope_beyond_play(delta, q))
    }

    /// Returns the forces of the springs and the energy of each element, at rest with all
    /// coordinates at `q`.
    ///
    /// The forces are over the elastic coordinates (N, N m). For coupled gears the energy is the
    /// share of the joint, `F e / 2`.
    pub fn springs_at_rest(&self, q: &DVector<f64>) -> (DVector<f64>, Vec<f64>) {
        let e = q.rows(self.model.n_actuated(), self.n_elastic_coordinates()).into_owned();
        let F = spring_forces(self, q.as_slice(), &e);
        let energy = |(k, element): (usize, &ElasticElement)| {
            let first = self.offset(element);
            let own = &e.as_slice()[first..first + element.size];
            match element.size {
                1 if self.cross_stiffness.iter().any(|(i, j, _)| *i == first || *j == first) => 0.5 * F[first] * own[0],
                1 => element.energy(&[self.deflection(k, own[0], q.as_slice())], q.as_slice()),
                _ => element.energy(own, q.as_slice()),
            }
        };
        let energies = self.elements.iter().enumerate().map(energy).collect();
        (F, energies)
    }

    /// Adds the cross stiffness of coupled springs: `f += K x`.
    pub(crate) fn add_cross_forces(&self, x: &[f64], f: &mut [f64]) {
        for &(i, j, k) in &self.cross_stiffness {
            f[i] += k * x[j];
            f[j] += k * x[i];
        }
    }

    /// Returns whether any joint has a telescopic guide.
    pub(crate) fn has_guides(&self) -> bool {
        self.guides().next().is_some()
    }

    fn guides(&self) -> impl Iterator<Item = (&ElasticElement, &Guide)> {
        self.elements.iter().filter_map(|element| Some((element, element.curve.as_ref()?.guide()?)))
    }

    /// Returns the error for the first guide whose tubes are apart or without stiffness with the
    /// joints at `q`, if any.
    pub(crate) fn apart(&self, q: &[f64]) -> Option<StepError> {
        let apart = |(element, guide): (&ElasticElement, &Guide)| {
            let overlap = guide.overlap(q);
            let compliance = guide.compliance(overlap);
            let fine = overlap > 0.0 && compliance > 0.0;
            (!fine).then(|| StepError::Apart { name: element.name.clone(), overlap, compliance })
        };
        self.guides().find_map(apart)
    }

    /// Adds the reactions of transmission errors, equation (4), and of guides on the motors, for
    /// the spring forces F and all coordinates `q`, to `tau` over all joints.
    pub(crate) fn add_motor_forces(&self, q: &[f64], F: &[f64], tau: &mut [f64]) {
        for error in &self.transmission {
            tau[error.motor] -= error.slope(q[error.motor]) * F[self.offset(&self.elements[error.element])];
        }
        for (element, guide) in self.guides() {
            tau[guide.coordinate] += guide.reaction(q[element.coordinate], q);
        }
    }

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
    /// coordinate: diagonal but for motors that move several joints.
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

/// Returns the values per motor; zeros if the gears are rigid.
fn stiffness_of(n: usize, values: &[f64]) -> Vec<f64> {
    if values.is_empty() { vec![0.0; n] } else { values.to_vec() }
}

/// Slider state of one gear at the end of the last step.
#[derive(Clone, Debug)]
struct SliderState {
    delta: f64,
    s: Vec<f64>,
}

/// Gear state of a run: slider positions, and the forces of the last evaluation.
#[derive(Clone, Debug)]
pub(crate) struct GearState {
    /// Actuated joints at the last evaluation.
    q: Vec<f64>,
    /// Deflections and their rates, per elastic coordinate.
    pub(crate) delta: DVector<f64>,
    pub(crate) rate: DVector<f64>,
    /// Forces of springs and dampers at these deflections.
    pub(crate) F: DVector<f64>,
    /// Share of the dampers.
    damper: DVector<f64>,
    /// Friction per actuated coordinate.
    pub(crate) friction: Vec<f64>,
    slipped: Vec<SliderState>,
    /// Energy lost to hysteresis so far (J).
    pub(crate) lost: f64,
}

impl GearState {
    /// Creates the state if the arm has gear laws.
    pub(crate) fn of(arm: &FlexibleArm) -> Option<Box<Self>> {
        let zeros = DVector::zeros(arm.n_elastic_coordinates());
        let slipped = |law: &Hysteresis| SliderState { delta: 0.0, s: vec![0.0; law.sliders.len()] };
        arm.has_gear_laws().then(|| {
            Box::new(Self {
                q: vec![0.0; arm.model.n_actuated()],
                delta: zeros.clone(),
                rate: zeros.clone(),
                F: zeros.clone(),
                damper: zeros,
                friction: vec![0.0; arm.model.n_actuated()],
                slipped: arm.hysteresis.iter().map(slipped).collect(),
                lost: 0.0,
            })
        })
    }

    /// Computes springs and dampers at elastic coordinates `e` and rates `v`, with the joints at
    /// `q` and `qdot`.
    pub(crate) fn update(&mut self, arm: &FlexibleArm, q: &[f64], qdot: &[f64], e: &[f64], v: &[f64]) {
        let Self { q: joints, delta, rate, F, damper, slipped, .. } = self;
        let actuated = joints.len();
        joints.copy_from_slice(&q[..actuated]);
        // Deflections (1) and their rates.
        delta.as_mut_slice().copy_from_slice(e);
        rate.as_mut_slice().copy_from_slice(v);
        for error in &arm.transmission {
            let k = arm.offset(&arm.elements[error.element]);
            delta[k] -= error.at(q[error.motor]);
            rate[k] -= error.slope(q[error.motor]) * qdot[error.motor];
        }
        // Dampers: D δ̇.
        damper.fill(0.0);
        if arm.proportional {
            for (element, tau) in arm.elements.iter().zip(&arm.tau) {
                let range = arm.offset(element)..arm.offset(element) + element.size;
                add_product(&element.K, &rate.as_slice()[range.clone()], &mut damper.as_mut_slice()[range.clone()]);
                damper.as_mut_slice()[range].iter_mut().for_each(|d| *d *= tau);
            }
        } else {
            arm.add_damping(rate.as_slice(), damper.as_mut_slice());
        }
        // Springs: equation (2).
        F.copy_from(damper);
        for (k, element) in arm.elements.iter().enumerate() {
            let range = arm.offset(element)..arm.offset(element) + element.size;
            match arm.hysteresis.iter().zip(&*slipped).find(|(law, _)| law.element == k) {
                Some((law, slipped)) => {
                    let delta = delta[range.start];
                    F[range.start] += law.elastic.torque(delta) + slipped.torque(law, delta);
                }
                None => {
                    element.add_spring_force(&delta.as_slice()[range.clone()], q, &mut F.as_mut_slice()[range]);
                }
            }
        }
        arm.add_cross_forces(delta.as_slice(), F.as_mut_slice());
    }

    /// Returns the slope of a nonlinear spring with one coordinate at its last deflection.
    pub(crate) fn slope(&self, arm: &FlexibleArm, k: usize, element: &ElasticElement, curve: &SpringCurve) -> f64 {
        let delta = self.delta[arm.offset(element)];
        match arm.hysteresis.iter().zip(&self.slipped).find(|(law, _)| law.element == k) {
            Some((law, slipped)) => law.elastic.slope(delta) + slipped.slope(law, delta),
            None => curve.slope(delta, &self.q),
        }
    }

    /// Returns the torque of a spring with hysteresis at its last deflection; `None` for other
    /// springs.
    pub(crate) fn hysteresis_torque(&self, arm: &FlexibleArm, element: usize) -> Option<f64> {
        let (law, slipped) = arm.hysteresis.iter().zip(&self.slipped).find(|(law, _)| law.element == element)?;
        let delta = self.delta[arm.offset(&arm.elements[element])];
        Some(law.elastic.torque(delta) + slipped.torque(law, delta))
    }

    /// Reports each slider of each law: its number, its elastic coordinate, and its stiffness (0
    /// while it slips).
    pub(crate) fn stuck(&self, arm: &FlexibleArm, mut report: impl FnMut(usize, usize, f64)) {
        let mut number = 0;
        for (law, slipped) in arm.hysteresis.iter().zip(&self.slipped) {
            let k = arm.offset(&arm.elements[law.element]);
            for (s, slider) in slipped.at(law, self.delta[k]) {
                report(number, k, if s.abs() < slider.reach { slider.stiffness } else { 0.0 });
                number += 1;
            }
        }
    }

    /// Writes the loads `-F` of the elements; returns the power dissipated by the dampers (W).
    pub(crate) fn loads(&self, arm: &FlexibleArm, loads: &mut [Vector6<f64>]) -> f64 {
        for (load, element) in loads.iter_mut().zip(&arm.elements) {
            let first = arm.offset(element);
            *load = Vector6::from_fn(|c, _| if c < element.size { -self.F[first + c] } else { 0.0 });
        }
        self.damper.dot(&self.rate)
    }

    /// Returns the energy in the springs at the last deflections (J).
    pub(crate) fn energy(&self, arm: &FlexibleArm) -> f64 {
        let mut energy = 0.0;
        for (k, element) in arm.elements.iter().enumerate() {
            let delta = &self.delta.as_slice()[arm.offset(element)..][..element.size];
            energy += match arm.hysteresis.iter().zip(&self.slipped).find(|(law, _)| law.element == k) {
                Some((law, slipped)) => law.elastic.energy(delta[0]) + slipped.energy(law, delta[0]),
                None => element.energy(delta, &self.q),
            };
        }
        energy + arm.cross_stiffness.iter().map(|&(i, j, k)| k * self.delta[i] * self.delta[j]).sum::<f64>()
    }

    /// Accepts the end of a step with the joints at `q` and the elastic coordinates at `e`: moves
    /// the sliders by (3) and adds their losses. The first call of a run moves them along the first
    /// loading curve.
    pub(crate) fn settle(&mut self, arm: &FlexibleArm, q: &[f64], e: &[f64]) {
        for (law, slipped) in arm.hysteresis.iter().zip(&mut self.slipped) {
            let delta = arm.deflection(law.element, e[arm.offset(&arm.elements[law.element])], q);
            self.lost += slipped.advance(law, delta);
        }
    }

    /// Moves the sliders as [`GearState::settle`] does, for the time before the run: without
    /// losses.
    pub(crate) fn begin(&mut self, arm: &FlexibleArm, q: &[f64], e: &[f64]) {
        self.settle(arm, q, e);
        self.lost = 0.0;
    }
}

impl SliderState {
    /// Returns the deflections of the sliders with the gear at deflection `delta`.
    fn at<'a>(&'a self, law: &'a Hysteresis, delta: f64) -> impl Iterator<Item = (f64, &'a Slider)> + 'a {
        let way = delta - self.delta;
        self.s.iter().zip(&law.sliders).map(move |(s, slider)| ((s + way).clamp(-slider.reach, slider.reach), slider))
    }

    fn torque(&self, law: &Hysteresis, delta: f64) -> f64 {
        self.at(law, delta).map(|(s, slider)| slider.stiffness * s).sum()
    }

    fn slope(&self, law: &Hysteresis, delta: f64) -> f64 {
        self.at(law, delta).map(|(s, slider)| if s.abs() < slider.reach { slider.stiffness } else { 0.0 }).sum()
    }

    fn energy(&self, law: &Hysteresis, delta: f64) -> f64 {
        self.at(law, delta).map(|(s, slider)| 0.5 * slider.stiffness * s * s).sum()
    }

    /// Advances the sliders to the deflection `delta`; returns the energy dissipated (J).
    fn advance(&mut self, law: &Hysteresis, delta: f64) -> f64 {
        let way = delta - self.delta;
        let mut lost = 0.0;
        for (s, slider) in self.s.iter_mut().zip(&law.sliders) {
            let stuck = *s + way;
            let held = stuck.clamp(-slider.reach, slider.reach);
            lost += slider.stiffness * slider.reach * (stuck - held).abs();
            *s = held;
        }
        self.delta = delta;
        lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: Rayleigh's parabola at the corners, and the area of Masing's loop `8 ∫ f - 4 A f(A)`
    /// for the first loading curve f, in closed form for piecewise linear curves.
    #[test]
    fn sliders_follow_rayleighs_law_and_lose_the_area_of_masings_loop() {
        let (friction, reach) = (30.0, 2e-4);
        let law = |count: usize| Hysteresis {
            element: 0,
            elastic: TorqueCurve::straight(4e5),
            sliders: Hysteresis::even_sliders(friction, reach, count),
        };
        let eight = law(8);
        let curve = eight.first_loading();
        for k in 0..=8 {
            let x = f64::from(k) / 8.0;
            let truth = 4e5 * x * reach + friction * (2.0 * x - x * x);
            assert!((curve.torque(x * reach) - truth).abs() < 1e-11, "{k} {} {truth}", curve.torque(x * reach));
            assert!((curve.torque(-x * reach) + truth).abs() < 1e-11);
        }
        assert!((curve.stiffest() - (4e5 + 8.0 * 2.0 * friction / (reach * 8.0) * (7.5 / 8.0))).abs() < 1e-6);
        for amplitude in [0.3 * reach, 0.77 * reach, 2.5 * reach] {
            let masing = 8.0 * curve.energy(amplitude) - 4.0 * amplitude * curve.torque(amplitude);
            assert!((eight.loss(amplitude) - masing).abs() < 1e-12, "{amplitude} {masing}");
            // The slider state that follows a closed cycle loses the same energy, after a first
            // loading.
            let mut slipped = SliderState { delta: 0.0, s: vec![0.0; 8] };
            slipped.advance(&eight, amplitude);
            let lost: f64 = [-amplitude, amplitude].iter().map(|d| slipped.advance(&eight, *d)).sum();
            assert!((lost - masing).abs() < 1e-12, "{lost} {masing}");
        }
        // Many sliders: 2/3 κ A³ / reach with κ = 2 friction / reach, Rayleigh's loss for
        // amplitudes below the reach.
        let (many, A) = (law(2000), 0.5 * reach);
        let rayleigh = 2.0 / 3.0 * (2.0 * friction / reach) * A.powi(3) / reach;
        assert!((many.loss(A) / rayleigh - 1.0).abs() < 1e-5, "{}", many.loss(A) / rayleigh);
    }

    #[test]
    fn the_slope_of_a_transmission_error_is_its_derivative() {
        let harmonics = vec![
            Harmonic { amplitude: 3e-5, cycles: 100.0, phase: 0.3 },
            Harmonic { amplitude: -1e-5, cycles: 200.0, phase: 1.1 },
        ];
        let error = TransmissionError { element: 0, motor: 0, harmonics };
        for q in [-1.0, 0.0, 0.37] {
            let slope = (error.at(q + 1e-6) - error.at(q - 1e-6)) / 2e-6;
            // measured 1.3e-11
            assert!((slope - error.slope(q)).abs() < 1e-9, "{slope} {}", error.slope(q));
            let bend = (error.slope(q + 1e-5) - error.slope(q - 1e-5)) / 2e-5;
            // measured 2e-7 of 0.6
            assert!((bend - error.bend(q)).abs() < 2e-6, "{bend} {}", error.bend(q));
        }
    }
}
