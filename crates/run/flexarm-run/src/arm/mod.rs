//! A robot with its links and drives modelled, built once and used for many runs and poses.
//!
//! [`Arm`] is the immutable model: one tree, its springs in coordinate order with their owners, the
//! rigid twin. [`Arm::plant`] adds a motion for the steppers. Coordinates are actuated joints first,
//! then elastic groups; SI units, points in the axes of the named frame.
//! Not here: how the springs are made (`modelled.rs`), the equations of motion (`flexarm-stepping`).

pub(crate) mod bends;
pub(crate) mod deflections;
pub(crate) mod joint_values;
pub(crate) mod live;
pub(crate) mod modelled;
pub(crate) mod operating_points;
pub(crate) mod options;
pub(crate) mod recursions;
pub(crate) mod servo_gains;

use std::sync::{Arc, OnceLock};

use flexarm_flexlink::FlexibleSpan;
use flexarm_kinematics::{Data, Frame, Model, mass_matrix};
use flexarm_stepping::{Friction, GearCoupling, Plant, PrescribedMotion, Servo, Spring, StepError};
use nalgebra::{DMatrix, DVector};

use crate::arm::bends::Bend;
use crate::arm::options::Modelling;
use crate::caveat::{self, Finding};
use crate::error::Error;
use crate::robot::Robot;
use crate::robot::drive_entry::ServoEntry;
use crate::robot::gear_entry::GearLaws;

/// A robot with its flexible links and drives modelled: one tree with its springs.
///
/// [`Robot::model`] does the costly work (substitution, modes). The arm is immutable and shared by
/// threads; each query uses numbers and a workspace of its own.
#[derive(Clone, Debug)]
pub struct Arm {
    /// Robot from which the arm was built.
    pub(crate) robot: Arc<Robot>,
    pub(crate) modelling: Modelling,
    /// Tree of the robot.
    pub model: Arc<Model>,
    /// Springs in coordinate order.
    pub springs: Vec<Spring>,
    /// Owner of each spring, in the same order.
    pub owners: Vec<Owner>,
    /// Frame of the TCP, on the body that carries it.
    pub tcp: Frame,
    /// Flexible links.
    pub spans: Vec<FlexibleSpan>,
    /// Data for drawing the deflected links, in the order of the spans.
    pub bends: Vec<Bend>,
    /// The same robot with rigid links and without gearboxes.
    pub rigid: Arc<Model>,
    /// Friction of each actuated coordinate.
    pub(crate) friction: Vec<Friction>,
    /// Gear effects other than elasticity.
    pub(crate) gears: GearLaws,
    /// Torque-driven joints: coordinate, servo, torque limit.
    pub(crate) torque: Vec<(usize, ServoEntry, f64)>,
    /// Caveats about the models of the links.
    pub findings: Vec<Finding>,
    /// Index in `spans` of the springs under the base; they are the last span.
    pub(crate) mounting: Option<usize>,
    /// Reach of the mass or of the TCP, used as a length scale (m).
    pub(crate) extent: f64,
    /// Messages about links modelled with modes although rigid parts were requested, with the
    /// reason.
    pub modal_instead: Vec<String>,
    /// Result of [`Robot::caveats`], computed when it is first asked for.
    pub(crate) robot_caveats: OnceLock<Vec<Finding>>,
}

/// Owner of a spring.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Owner {
    /// Flexible link or mounting; index into [`Arm::spans`].
    Link(usize),
    /// Drive; index into [`crate::Robot::drives`].
    Drive(usize),
}

impl Arm {
    /// Returns the robot from which the arm was built.
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// Returns [`Robot::caveats`], computed once.
    pub fn robot_caveats(&self) -> &[Finding] {
        self.robot_caveats.get_or_init(|| self.robot.caveats())
    }

    /// Returns how links and drives are modelled.
    pub fn modelling(&self) -> &Modelling {
        &self.modelling
    }

    /// Returns the actuated joints, in the order of poses and motions.
    pub fn joints(&self) -> impl Iterator<Item = &str> {
        let model = &self.model;
        model.coordinates()[..model.n_actuated()].iter().map(|coordinate| coordinate.joint.as_str())
    }

    /// Returns the arm for the steppers, driven along a motion.
    ///
    /// # Errors
    /// As [`Plant::new`] and [`Plant::with_servo`].
    pub fn plant(&self, motion: Arc<dyn PrescribedMotion>) -> Result<Plant, StepError> {
        self.plant_with(self.springs.clone(), motion)
    }

    /// As [`Self::plant`], with other springs in the same places.
    ///
    /// # Errors
    /// As [`Self::plant`].
    pub fn plant_with(&self, springs: Vec<Spring>, motion: Arc<dyn PrescribedMotion>) -> Result<Plant, StepError> {
        self.completed(Plant::new(self.model.clone(), springs, motion)?)
    }

    /// As [`Self::plant`], for equilibria alone: links between springs need no mass.
    pub(crate) fn plant_at_rest(&self, motion: Arc<dyn PrescribedMotion>) -> Result<Plant, StepError> {
        self.completed(Plant::at_rest(self.model.clone(), self.springs.clone(), motion)?)
    }

    /// Adds friction, gear laws and servos to an arm.
    fn completed(&self, mut plant: Plant) -> Result<Plant, StepError> {
        if self.friction.iter().any(|f| *f != Friction::NONE) {
            plant.friction.clone_from(&self.friction);
        }
        let plant = self.gears.put_into(plant)?;
        if self.torque.is_empty() {
            return Ok(plant);
        }
        let n = self.rigid.nv();
        let (mut q, mut v, mut a) = (DVector::zeros(n), DVector::zeros(n), DVector::zeros(n));
        plant.motion.sample(0.0, q.as_mut_slice(), v.as_mut_slice(), a.as_mut_slice());
        let axes = self.servo_axes(&q);
        plant.with_servo(Servo { sample_s: self.sample_s(), axes, rigid: self.rigid.clone() })
    }

    /// Returns the coupling of motors that move several joints, if there is one.
    pub fn gear_coupling(&self) -> Option<&GearCoupling> {
        self.gears.coupling.as_ref()
    }

    /// Wraps an error; if the mass matrix is singular, adds the names of the links that lack
    /// inertia.
    pub fn explained(&self, source: StepError) -> Error {
        let light = match source {
            StepError::Singular { matrix, .. } if matrix.starts_with("mass matrix") => self.without_inertia(),
            _ => Vec::new(),
        };
        if light.is_empty() {
            return Error::Step { source, partial: false };
        }
        if let Some(seat) = self.robot.drives.iter().find_map(caveat::drives::seat) {
            return Error::Pose(format!("{}: {source}: {}", self.robot.path.display(), seat.message));
        }
        Error::Pose(format!(
            "{}: {source}: {} lacks inertia about some axis, with all that it carries; give the links <inertial> \
             with mass and inertia, have them estimated (inertia_from_density in the robot file), or keep everything \
             before them rigid",
            self.robot.urdf_path.display(),
            light.join(", ")
        ))
    }

    /// Names the elastic bodies and torque-driven joints without inertia in some direction: rows of
    /// the mass matrix that depend linearly on earlier rows.
    ///
    /// Cholesky factor `L Lᵀ` of the rows of the free coordinates; a row whose pivot
    /// `M_ii - Σ L_ik²` vanishes is named and left out.
    fn without_inertia(&self) -> Vec<String> {
        /// Threshold for the pivot relative to the diagonal entry; below it a row counts as
        /// dependent.
        const MIN: f64 = 1e-13;
        let (model, n) = (&self.model, self.model.n_actuated());
        let M = mass_matrix(model, &mut Data::new(model), &DVector::zeros(model.nv())).clone();
        let free: Vec<usize> = self.torque.iter().map(|t| t.0).chain(n..model.nv()).collect();
        let mut L: DMatrix<f64> = DMatrix::zeros(free.len(), free.len());
        let mut names: Vec<String> = Vec::new();
        for (i, &row) in free.iter().enumerate() {
            for j in 0..i {
                let known: f64 = (0..j).map(|k| L[(i, k)] * L[(j, k)]).sum();
                L[(i, j)] = if L[(j, j)] > 0.0 { (M[(row, free[j])] - known) / L[(j, j)] } else { 0.0 };
            }
            let left = M[(row, row)] - (0..i).map(|k| L[(i, k)].powi(2)).sum::<f64>();
            if left > MIN * M[(row, row)] {
                L[(i, i)] = left.sqrt();
                continue;
            }
            let group = model.elastic().iter().position(|g| (g.coordinate..g.coordinate + g.size).contains(&row));
            let name = match group.map(|k| self.owners[k]) {
                Some(Owner::Link(k)) => format!("link {:?}", self.spans[k].link),
                Some(Owner::Drive(_)) => format!("link {:?}", model.bodies()[model.coordinates()[row].body].name),
                None => format!("the body of the torque-driven joint {:?}", model.coordinates()[row].joint),
            };
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// Returns the inertia that each torque-driven joint sees when all other free coordinates are free
    /// to accelerate, with the joints at `actuated` (rad or m) and no deflection (kg m² or kg):
    ///
    /// ```text
    /// 1 / (M_ff⁻¹)_ii,    f: torque-driven and elastic coordinates
    /// ```
    /// 0 where the mass matrix is singular.
    pub(crate) fn quick_inertia(&self, actuated: &DVector<f64>) -> Vec<f64> {
        let (model, n) = (&self.model, self.model.n_actuated());
        let mut q = DVector::zeros(model.nv());
        q.rows_mut(0, n).copy_from(actuated);
        let M = mass_matrix(model, &mut Data::new(model), &q).clone();
        let free: Vec<usize> = self.torque.iter().map(|t| t.0).chain(n..model.nv()).collect();
        let inverse = M.select_rows(&free).select_columns(&free).cholesky().map(|c| c.inverse());
        (0..self.torque.len()).map(|i| inverse.as_ref().map_or(0.0, |inverse| 1.0 / inverse[(i, i)])).collect()
    }

    /// Returns the caveats about the models of the links.
    pub(crate) fn link_caveats(&self) -> Vec<Finding> {
        let help = "write model = \"modal\" into the robot file";
        let instead = self.modal_instead.iter().map(|text| Finding::warning("third-interface", "links", text, help));
        self.findings.iter().cloned().chain(instead).collect()
    }

    /// Whether any joint is driven by torque.
    pub fn has_servo(&self) -> bool {
        !self.torque.is_empty()
    }

    /// Returns the coordinates of the torque-driven joints, with the torque limit of each (N m or
    /// N).
    pub fn servo_limits(&self) -> impl Iterator<Item = (usize, f64)> {
        self.torque.iter().map(|(coordinate, _, limit)| (*coordinate, *limit))
    }

    /// Returns a name for the kind of link models: rigid, lumped, modal or mixed.
    pub fn links_model(&self) -> &'static str {
        let modal = self.model.elastic().iter().filter(|g| g.modal).count();
        match (self.spans.len() - usize::from(self.mounting.is_some()), modal) {
            (0, _) => "rigid",
            (_, 0) => "lumped",
            (n, m) if n == m => "modal",
            _ => "mixed",
        }
    }
}
