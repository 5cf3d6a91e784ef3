//! Assembly of an arm: its springs on the model, loads, changes of inertia and servos, and with each
//! the modes and the damping that depend on them. Start at [`Plant::new`]. Not here: gear laws
//! (`gear::setup`).

use std::sync::Arc;

use flexarm_kinematics::{Data, ElasticGroup, Model, Wrench, mass_matrix};
use nalgebra::DMatrix;

use crate::error::StepError;
use crate::events::SAME_TIME;
use crate::load::Load;
use crate::modes::modes_at;
use crate::motion::PrescribedMotion;
use crate::plant::{Damping, ElasticElement, InertiaChange, Modes, Plant, Servo, Spring};

impl Plant {
    /// Creates an arm from a model and the springs of its elastic groups.
    ///
    /// `springs` lists name, stiffness and damping in the order of `model.elastic()`. The modal
    /// damping matrix and the modes are computed at the static equilibrium at `t = 0`.
    ///
    /// # Errors
    /// [`StepError::Setup`] if counts or sizes differ, [`StepError::Singular`] if a stiffness is
    /// not positive definite, [`StepError::NoEquilibrium`] if the arm cannot carry its weight.
    pub fn new<S: Into<Spring>>(
        model: Arc<Model>,
        springs: Vec<S>,
        motion: Arc<dyn PrescribedMotion>,
    ) -> Result<Self, StepError> {
        let mut plant = Self { at_rest: false, ..Self::at_rest(model, springs, motion)? };
        plant.update_modes_and_damping()?;
        Ok(plant)
    }

    /// Creates an arm for equilibria alone: without modes and damping, so that links between springs
    /// need no mass.
    ///
    /// # Errors
    /// As [`Plant::new`], except that no equilibrium is sought.
    pub fn at_rest<S: Into<Spring>>(
        model: Arc<Model>,
        springs: Vec<S>,
        motion: Arc<dyn PrescribedMotion>,
    ) -> Result<Self, StepError> {
        // One spring per elastic group, in the model's order.
        let groups = model.elastic();
        if springs.len() != groups.len() {
            return Err(StepError::Setup(format!(
                "the model has {} elastic joints but {} springs were given",
                groups.len(),
                springs.len()
            )));
        }
        let elements = springs.into_iter().zip(groups).map(|(spring, group)| element(spring.into(), group));
        let elements = elements.collect::<Result<Vec<_>, _>>()?;
        // Drives, loads and gear laws are added by the functions with `with_`.
        let n = model.n_elastic();
        Ok(Self {
            model,
            elements,
            D: DMatrix::zeros(n, n),
            tau: Vec::new(),
            proportional: true,
            motion,
            torque_driven: Vec::new(),
            friction: Vec::new(),
            servo: None,
            loads: Vec::new(),
            inertia_changes: Vec::new(),
            transmission: Vec::new(),
            load_friction: Vec::new(),
            coupling: None,
            cross_stiffness: Vec::new(),
            cross_damping: Vec::new(),
            modes: Modes::default(),
            at_rest: true,
        })
    }

    /// Returns the arm with constant external loads: (body, wrench at Bo in world axes; N, N m).
    ///
    /// # Errors
    /// As [`Plant::new`].
    pub fn with_loads(self, loads: Vec<(usize, Wrench)>) -> Result<Self, StepError> {
        self.with_timed_loads(loads.into_iter().map(|(body, F)| Load::constant(body, F)).collect())
    }

    /// Returns the arm with external loads that change with time.
    ///
    /// # Errors
    /// As [`Plant::new`].
    pub fn with_timed_loads(mut self, loads: Vec<Load>) -> Result<Self, StepError> {
        self.loads = loads;
        self.update_modes_and_damping()?;
        Ok(self)
    }

    /// Returns the arm with inertias that change during the motion; changes at t ≤ 0 apply from the
    /// start.
    ///
    /// # Errors
    /// As [`Plant::new`].
    pub fn with_inertia_changes(mut self, mut changes: Vec<InertiaChange>) -> Result<Self, StepError> {
        changes.sort_by(|a, b| a.t.total_cmp(&b.t));
        self.inertia_changes = changes;
        self.carry_from_start()?;
        Ok(self)
    }

    /// Applies the inertia changes that are due at the start, so that the initial equilibrium
    /// includes them.
    pub(crate) fn carry_from_start(&mut self) -> Result<(), StepError> {
        let due = self.inertia_changes.iter().take_while(|change| change.t <= SAME_TIME).count();
        for change in self.inertia_changes.drain(..due) {
            self.model = Arc::new(self.model.with_inertia(change.body, change.inertia));
        }
        if due > 0 { self.update_modes_and_damping() } else { Ok(()) }
    }

    /// Returns the arm with some joints driven by torque, under a controller.
    ///
    /// # Errors
    /// [`StepError::Setup`] if the axes are not ascending actuated coordinates, the rigid robot has
    /// a different number of coordinates, friction of an axis depends on its load without a
    /// gearbox, or an axis without inertia behind it has no rotor.
    pub fn with_servo(mut self, servo: Servo) -> Result<Self, StepError> {
        let n = self.model.n_actuated();
        self.torque_driven = servo.axes.iter().map(|a| a.coordinate).collect();
        let sorted = self.torque_driven.windows(2).all(|w| w[0] < w[1]);
        if !sorted || self.torque_driven.last().is_some_and(|&k| k >= n) {
            let text = format!("servo axes {:?} must be ascending coordinates below {n}", self.torque_driven);
            return Err(StepError::Setup(text));
        }
        if servo.rigid.nv() != n {
            let text = format!("the servo's rigid robot has {} coordinates, the arm has {n} drives", servo.rigid.nv());
            return Err(StepError::Setup(text));
        }
        // A motor needs an inertia of its own or a body behind it, and a load that its friction can
        // read.
        for &k in &self.torque_driven {
            let mut bodies = self.model.bodies().iter().enumerate().skip(1);
            let body = bodies.find(|(_, b)| b.coordinate == k && !b.elastic);
            let bends = |i: usize| self.model.elastic().iter().any(|g| g.modal && g.body == i);
            let friction = self.load_friction.iter().find(|law| law.coordinate == k && law.element.is_none());
            if friction.is_some() {
                let joint = &self.model.coordinates()[k].joint;
                let text = format!(
                    "joint {joint:?} is driven by torque and has friction that grows with its load: give it a gearbox, whose torque is the load"
                );
                return Err(StepError::Setup(text));
            }
            if let Some((i, body)) = body
                && body.inertia.mass == 0.0
                && !bends(i)
                && body.armature <= 0.0
            {
                let text = format!(
                    "joint {:?} is driven by torque through a spring: its motor needs an inertia (motor_inertia and ratio)",
                    body.joint
                );
                return Err(StepError::Setup(text));
            }
        }
        self.servo = Some(Arc::new(servo));
        Ok(self)
    }

    /// Recomputes the modes at `t = 0` and the damping matrix that depends on them; to be called
    /// after fields were changed directly. Does nothing for an arm at rest.
    ///
    /// # Errors
    /// As [`Plant::new`].
    pub fn update_modes_and_damping(&mut self) -> Result<(), StepError> {
        let n = self.model.n_elastic();
        if n == 0 || self.at_rest {
            return Ok(());
        }
        self.modes = modes_at(self, 0.0)?;
        self.proportional = self.cross_stiffness.is_empty()
            && self.elements.iter().all(|e| matches!(e.damping, Damping::StiffnessProportional(_)));
        let first = self.modes.omega[0];
        self.tau = self
            .elements
            .iter()
            .map(|e| match e.damping {
                Damping::Modal(zeta) => 2.0 * zeta / first,
                Damping::StiffnessProportional(beta) => beta,
                Damping::Rayleigh(a, b) => a / (first * first) + b,
                // Factor that gives the same trace.
                Damping::Dampers(d) => d[..e.size].iter().sum::<f64>() / e.K.trace(),
            })
            .collect();
        self.D.fill(0.0);

        // D = M Φ diag(2 ζ ω) Φᵀ M, ζ of each mode weighted by strain energy, plus the blocks of
        // the elements.
        let M = self.mass_at_start();
        if !self.damps_by_element() {
            self.add_modal_damping(&M);
        }
        for element in &self.elements {
            let (k, size) = (element.coordinate - self.model.n_actuated(), element.size);
            let mut block = self.D.view_mut((k, k), (size, size));
            match element.damping {
                Damping::Modal(_) => {}
                Damping::StiffnessProportional(beta) => block += &element.K * beta,
                Damping::Rayleigh(a, b) => block += &element.K * b + M.view((k, k), (size, size)) * a,
                Damping::Dampers(d) => {
                    for c in 0..size.min(6) {
                        block[(c, c)] += d[c];
                    }
                }
            }
        }
        for &(i, j, d) in &self.cross_damping {
            self.D[(i, j)] += d;
            if i != j {
                self.D[(j, i)] += d;
            }
        }
        Ok(())
    }

    /// Returns the mass matrix of the elastic coordinates at the pose at which the modes are
    /// computed.
    fn mass_at_start(&self) -> DMatrix<f64> {
        let (model, n) = (&self.model, self.model.n_elastic());
        let mut data = Data::new(model);
        let M = mass_matrix(model, &mut data, &self.coordinates_at(0.0, &self.modes.equilibrium));
        M.view((model.n_actuated(), model.n_actuated()), (n, n)).clone_owned()
    }

    /// Returns the modal damping ratio of the element of an elastic coordinate.
    fn modal_ratio(&self, offset: usize) -> f64 {
        let own = self.elements.iter().find(|e| (self.offset(e)..self.offset(e) + e.size).contains(&offset));
        own.map_or(0.0, |e| if let Damping::Modal(ratio) = e.damping { ratio } else { 0.0 })
    }

    /// Adds `M Φ diag(2 ζ ω) Φᵀ M` to D; ζ of a mode is the mean of those of the elements, weighted by
    /// their strain energy in the mode.
    fn add_modal_damping(&mut self, M: &DMatrix<f64>) {
        for (j, omega) in self.modes.omega.iter().enumerate() {
            let phi = self.modes.shapes.column(j);
            let (mut zeta, mut total) = (0.0, 0.0);
            for element in &self.elements {
                let x = phi.rows(self.offset(element), element.size);
                let energy = x.dot(&(&element.K * x));
                total += energy;
                if let Damping::Modal(z) = element.damping {
                    zeta += z * energy;
                }
            }
            for &(i, j, k) in &self.cross_stiffness {
                let energy = k * phi[i] * phi[j];
                total += 2.0 * energy;
                zeta += energy * (self.modal_ratio(i) + self.modal_ratio(j));
            }
            let Mphi = M * phi;
            self.D.ger(2.0 * zeta / total * omega, &Mphi, &Mphi, 1.0);
        }
    }
}

/// Assigns a spring to its coordinates.
fn element(spring: Spring, group: &ElasticGroup) -> Result<ElasticElement, StepError> {
    let Spring { name, mut K, damping, mut curve, hysteresis, geometric } = spring;
    let ElasticGroup { body, coordinate, size, modal, .. } = *group;
    if K.shape() != (size, size) {
        let rows = K.nrows();
        let text = format!("the stiffness of {name:?} has {rows} rows, its joint has {size} coordinates");
        return Err(StepError::Setup(text));
    }
    let Some(mut C) = K.clone().cholesky().map(|c| c.inverse()) else {
        return Err(StepError::Singular { matrix: "stiffness of an elastic joint", t: 0.0 });
    };
    if let Some(law) = &hysteresis {
        if size != 1 {
            return Err(StepError::Setup(format!("hysteresis of {name:?}: it needs a spring of one coordinate")));
        }
        let first_loading = law.first_loading();
        K[(0, 0)] = first_loading.stiffest();
        C[(0, 0)] = 1.0 / first_loading.stiffest();
        curve = Some(first_loading.into());
    }
    Ok(ElasticElement { name, body, coordinate, size, modal, K, C, damping, curve, hysteresis, geometric })
}
