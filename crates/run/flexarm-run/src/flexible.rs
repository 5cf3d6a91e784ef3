//! Robot with its flexible links and elastic drives: chooses a model for each and builds the arm.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use crate::bends::Bend;
use flexarm_fem::{BeamLink, ModalLink, ModalOptions};
use flexarm_flexlink::{
    BranchJoint, FlexibleLink, FlexibleSpan, GearSpring, Gearbox, LinkForm, Parts, Substituted, SubstitutionError,
    branch_joints, insert_gearboxes, insert_mounting, substitute,
};
use flexarm_kinematics::{Coordinate, Data, ElasticAngles, ElasticGroup, Frame, MOST_COORDINATES, Model, mass_matrix};
use flexarm_settings::Setting;
use flexarm_stepping::{
    Damping, FlexibleArm, Friction, GearCoupling, GeometricStiffness, PrescribedMotion, Servo, Spring, SpringCurve,
    StepError,
};
use nalgebra::{DMatrix, DVector, Matrix6, Vector3};

use crate::caveat::Caveat;
use crate::caveat::kinds;
use crate::caveat::size::Size;
use crate::drive_entry::{DriveKind, ServoEntry};
use crate::error::{Error, ModellingError, PoseError};
use crate::gear_entry::{GearLaws, RobotCoupling};
use crate::guide_entry::guide_law;
use crate::mounting::RobotMounting;
use crate::options::{DriveModel, LinkModel, Modelling};
use crate::robot::{Robot, tcp_frame};
use crate::strength::Strength;
use flexarm_linkmaker::import::SECOND_ORDER_UNKNOWN;

/// Springs along Euler angles are not symmetric between the two ends: an error of third order in
/// the deflection remains, which a chain of n parts only divides by n.
const EULER_CHAIN: &str = "its chain has angles = \"euler-zyx\": where it bends about two axes or twists, its deflection \
                           converges with the number of parts, not with the square of it as with rotation vectors";
/// Maximum number of fixed-interface modes of a link.
const MOST_MODES: usize = 200;
/// Default number of fixed-interface modes of a beam link.
const BEAM_MODES: usize = 6;

/// Flexible link with the data from which its models are built.
#[derive(Clone, Debug)]
pub struct RobotLink {
    /// The link with its reduced model.
    pub flexible: FlexibleLink,
    /// Damping of the link.
    pub damping: Damping,
    /// Stiffness of the spring between its two parts, symmetric and positive definite; replaces
    /// that of the source (N/m, N, N m/rad).
    pub stiffness: Option<Matrix6<f64>>,
    /// Factor on the stiffness of all models of the link.
    pub stiffness_factor: f64,
    /// Additional factors on the springs of a lumped link, one per direction: K becomes `S K S`,
    /// where the diagonal of S holds their square roots.
    pub stiffness_factors: [f64; 6],
    /// Beam from which the link is built, if it is a beam.
    pub beam: Option<BeamLink>,
    /// Choices made in the robot file.
    pub choices: LinkChoices,
    /// Source of its stress, if that is computed.
    pub stress: Option<StressSource>,
    /// Strength against which its stress is judged; by default that of its material.
    pub strength: Option<Strength>,
}

/// Source of the stress of a flexible link.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StressSource {
    /// File of stress fields, beside that of the reduced link.
    File(PathBuf),
    /// Section forces of the beam.
    Beam,
}

/// Choices of a robot file for a flexible link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinkChoices {
    /// Link model: lumped or modal.
    pub model: LinkModel,
    /// Number of rigid parts of a lumped link.
    pub segments: usize,
    /// Number of fixed-interface modes of a modal link.
    pub modes: Option<usize>,
    /// Number of eigenmodes of a modal link, used instead of fixed-interface modes.
    pub eigenmodes: Option<usize>,
    /// Whether loads change the stiffness (geometric stiffening).
    pub geometric: bool,
    /// Whether the file says whose mass the parts take; if not, the parts take that of the uniform
    /// beam when the link's own mass cannot be cut.
    pub parts_asked: bool,
}

/// Key of the robot file that requested something unavailable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RequestedKey {
    Model,
    Segments,
    Modes,
    Eigenmodes,
    Geometric,
    Directions,
    Stiffness,
}

impl RobotLink {
    /// Applies the stiffness factors to a spring of the lumped models.
    pub(crate) fn scaled(&self, K: &Matrix6<f64>) -> Matrix6<f64> {
        let root = self.stiffness_factors.map(f64::sqrt);
        let K = self.stiffness.as_ref().unwrap_or(K);
        Matrix6::from_fn(|i, j| root[i] * K[(i, j)] * root[j]) * self.stiffness_factor
    }

    /// Whether the source provides geometric stiffening for a modal link.
    pub fn has_geometric(&self) -> bool {
        let stored = self.flexible.reduced.details.as_ref().and_then(|details| details.modal.as_ref());
        self.beam.is_some() || stored.is_some_and(|modal| modal.geometric.is_some())
    }

    /// Returns the model of the link; rigid links have none.
    ///
    /// # Errors
    /// A message that names what the source of the link lacks.
    pub fn form(&self, modelling: &Modelling) -> Result<LinkForm, String> {
        self.form_or_key(modelling).map_err(|(_, message)| message)
    }

    /// As [`Self::form`], with the robot file key that requested what is missing.
    pub(crate) fn form_or_key(&self, modelling: &Modelling) -> Result<LinkForm, (RequestedKey, String)> {
        let model = if modelling.links == LinkModel::AsFiled { self.choices.model } else { modelling.links };
        match model {
            LinkModel::Modal if self.stiffness_factors != [1.0; 6] => {
                let name = &self.flexible.link;
                let message = format!(
                    "link {name:?}: stiffness_factors are those of the springs of a lumped link; a modal link has one stiffness_factor"
                );
                Err((RequestedKey::Directions, message))
            }
            LinkModel::Modal if self.stiffness.is_some() => {
                Err((RequestedKey::Stiffness, self.one_spring("modal body")))
            }
            LinkModel::Modal => self.modal(modelling).map(|modal| LinkForm::Modal(Arc::new(modal))),
            _ => match modelling.segments.unwrap_or(self.choices.segments) {
                2 => Ok(LinkForm::TwoParts),
                n if self.stiffness.is_some() => {
                    Err((RequestedKey::Stiffness, self.one_spring(&format!("has {n} parts"))))
                }
                n => self.lumped(n).map_err(|message| (RequestedKey::Segments, message)),
            },
        }
    }

    /// Returns the message that the link's own stiffness fits only the two-part model.
    fn one_spring(&self, has: &str) -> String {
        let name = &self.flexible.link;
        format!("link {name:?} {has}: its stiffness is that of the one spring between two rigid parts; leave it out")
    }

    fn lumped(&self, segments: usize) -> Result<LinkForm, String> {
        let name = &self.flexible.link;
        let coordinates = 6 * segments.saturating_sub(1);
        if coordinates > MOST_COORDINATES {
            return Err(format!(
                "link {name:?}: {segments} segments have {coordinates} elastic coordinates, a robot can have {MOST_COORDINATES} in all, for the \
                 time of a step grows with their cube: ask for at most {} in one link, or for modes, which say more with fewer",
                MOST_COORDINATES / 6 + 1
            ));
        }
        if let Some(beam) = &self.beam {
            return beam.chain(segments).map(LinkForm::Chain).map_err(|e| format!("link {name:?}: {e}"));
        }
        let chains = self.flexible.reduced.details.as_ref().map_or(&[][..], |d| &d.chains[..]);
        chains.iter().find(|c| c.parts.len() == segments).cloned().map(LinkForm::Chain).ok_or_else(|| {
            let there: Vec<String> = chains.iter().map(|c| c.parts.len().to_string()).collect();
            let there =
                if there.is_empty() { "only two parts".into() } else { format!("2, {} parts", there.join(", ")) };
            format!(
                "link {name:?}: its .flex file has no chain of {segments} parts (it has {there}): make it with flexarm \
                 reduce {} {segments}, or choose another number of segments",
                Setting::Chains
            )
        })
    }

    fn modal(&self, modelling: &Modelling) -> Result<ModalLink, (RequestedKey, String)> {
        let name = &self.flexible.link;
        let fail = |asked: RequestedKey| {
            move |e: flexarm_fem::FemError| (asked, format!("link {name:?} cannot be modal: {e}"))
        };
        let wanted = modelling.modes.or(self.choices.modes);
        if let Some(modes) = wanted.filter(|modes| *modes > MOST_MODES) {
            let message = format!(
                "link {name:?}: {modes} modes are requested, at most {MOST_MODES} are allowed: the work of a step grows with the cube of their \
                 number, and those beyond the first dozen are far above what a drive or a tool excites"
            );
            return Err((RequestedKey::Modes, message));
        }
        let full = match &self.beam {
            Some(beam) => {
                let modes = wanted.unwrap_or(BEAM_MODES);
                let options = ModalOptions { modes, geometric: self.choices.geometric, ..ModalOptions::default() };
                beam.modal_with(&ModalOptions { elements: options.elements.max(4 * modes), ..options })
                    .map_err(fail(RequestedKey::Modes))?
            }
            None => {
                let details = self.flexible.reduced.details.as_ref();
                let stored = details.and_then(|details| details.modal.clone()).map(Ok);
                let condensed = || {
                    let element = details?.superelement.as_ref()?;
                    Some(ModalLink::from_superelement(name, element).map_err(fail(RequestedKey::Model)))
                };
                let link = stored.or_else(condensed).ok_or_else(|| {
                    let message = format!(
                        "link {name:?} cannot be modal: its .flex file has no mass over interfaces and modes; reduce \
                         the mesh again with this version, or use model = \"lumped\""
                    );
                    (RequestedKey::Model, message)
                })??;
                let all = link.coordinates().saturating_sub(6 * link.interfaces.len());
                match wanted {
                    Some(n) if n < all => link.truncated(n).map_err(fail(RequestedKey::Modes))?,
                    Some(n) if n > all => {
                        let message = format!("link {name:?}: {n} modes are requested, its .flex file has {all}");
                        return Err((RequestedKey::Modes, message));
                    }
                    _ => link,
                }
            }
        };
        if self.choices.geometric && full.geometric.is_none() {
            let message = format!(
                "link {name:?}: geometric_stiffening needs a beam, or a .flex file made with flexarm reduce {}",
                Setting::Geometric
            );
            return Err((RequestedKey::Geometric, message));
        }
        match self.choices.eigenmodes {
            Some(keep) => full.orthogonalised(Some(keep)).map_err(fail(RequestedKey::Eigenmodes)),
            None => Ok(full),
        }
    }
}

/// Robot with flexible links; springs are in coordinate order.
#[derive(Clone, Debug)]
pub struct FlexibleRobot {
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
    /// Path of the URDF.
    pub(crate) path: PathBuf,
    /// The same robot with rigid links and without gearboxes.
    pub rigid: Arc<Model>,
    /// Friction of each actuated coordinate.
    friction: Vec<Friction>,
    /// Gear effects other than elasticity.
    pub(crate) gears: GearLaws,
    /// Torque-driven joints: coordinate, servo, torque limit.
    pub(crate) torque: Vec<(usize, ServoEntry, f64)>,
    /// Caveats about the models of the links.
    pub doubts: Vec<Caveat>,
    /// Index in `spans` of the springs under the base; they are the last span.
    pub(crate) mounting: Option<usize>,
    /// Reach of the mass or of the TCP, used as a length scale (m).
    pub(crate) extent: f64,
    /// Messages about links modelled with modes although rigid parts were requested, with the
    /// reason.
    pub modal_instead: Vec<String>,
}

/// Owner of a spring.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Owner {
    /// Flexible link or mounting; index into [`FlexibleRobot::spans`].
    Link(usize),
    /// Drive; index into [`Robot::drives`].
    Drive(usize),
}

impl FlexibleRobot {
    /// Returns the arm for the steppers, driven along a motion.
    ///
    /// # Errors
    /// As [`FlexibleArm::new`] and [`FlexibleArm::with_servo`].
    pub fn arm(&self, motion: Arc<dyn PrescribedMotion>) -> Result<FlexibleArm, StepError> {
        self.arm_with(self.springs.clone(), motion)
    }

    /// As [`Self::arm`], with other springs in the same places.
    pub(crate) fn arm_with(
        &self,
        springs: Vec<Spring>,
        motion: Arc<dyn PrescribedMotion>,
    ) -> Result<FlexibleArm, StepError> {
        let mut arm = FlexibleArm::new(self.model.clone(), springs, motion)?;
        if self.friction.iter().any(|f| *f != Friction::NONE) {
            arm.friction.clone_from(&self.friction);
        }
        let stiffness: Vec<f64> = arm.elements.iter().map(|element| element.K[(0, 0)]).collect();
        let arm = self.gears.put_into(arm, |k| stiffness[k] / self.springs[k].K[(0, 0)])?;
        if self.torque.is_empty() {
            return Ok(arm);
        }
        let n = self.rigid.nv();
        let (mut q, mut v, mut a) = (DVector::zeros(n), DVector::zeros(n), DVector::zeros(n));
        arm.motion.sample(0.0, q.as_mut_slice(), v.as_mut_slice(), a.as_mut_slice());
        let axes = self.servo_axes(&self.inertias_felt(&self.model, &self.rigid, &q));
        arm.with_servo(Servo { sample_s: self.sample_s(), axes, rigid: self.rigid.clone() })
    }

    /// Returns the coupling of motors that move several joints, if there is one.
    pub fn gear_coupling(&self) -> Option<&GearCoupling> {
        self.gears.coupling.as_ref()
    }

    /// Wraps an error; if the mass matrix is singular, adds the names of the links that lack
    /// inertia.
    pub fn explained(&self, source: StepError) -> Error {
        let light = match source {
            StepError::Singular { matrix: "mass matrix", .. } => self.without_inertia(),
            _ => Vec::new(),
        };
        if light.is_empty() {
            return Error::Step { source, partial: false };
        }
        PoseError::WithoutInertia { path: self.path.clone(), source, links: light }.into()
    }

    /// Names the elastic bodies and torque-driven joints without inertia in some direction: rows of
    /// the mass matrix that depend linearly on earlier rows.
    fn without_inertia(&self) -> Vec<String> {
        /// Threshold for the pivot relative to the diagonal entry; below it a row counts as
        /// dependent.
        const LEAST: f64 = 1e-13;
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
            if left > LEAST * M[(row, row)] {
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

    /// Inertia that each torque-driven joint sees when all other free coordinates are free to
    /// accelerate: `1 / (M_ff^-1)_ii`.
    pub(crate) fn quick_inertia(&self, actuated: &DVector<f64>) -> Vec<f64> {
        self.quick_inertia_of(&self.model, actuated)
    }

    pub(crate) fn quick_inertia_of(&self, model: &Model, actuated: &DVector<f64>) -> Vec<f64> {
        let n = model.n_actuated();
        let mut q = DVector::zeros(model.nv());
        q.rows_mut(0, n).copy_from(actuated);
        let M = mass_matrix(model, &mut Data::new(model), &q).clone();
        let free: Vec<usize> = self.torque.iter().map(|t| t.0).chain(n..model.nv()).collect();
        let inverse = M.select_rows(&free).select_columns(&free).cholesky().map(|c| c.inverse());
        (0..self.torque.len()).map(|i| inverse.as_ref().map_or(0.0, |inverse| 1.0 / inverse[(i, i)])).collect()
    }

    /// Returns the caveats about the models of the links.
    pub fn caveats(&self) -> Vec<Caveat> {
        let help = "write model = \"modal\" into the robot file";
        let instead =
            self.modal_instead.iter().map(|text| Caveat::from_message("third-interface", "links", text, help));
        self.doubts.iter().cloned().chain(instead).collect()
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

impl Robot {
    /// Returns the robot with its flexible links and drives as the file asks.
    ///
    /// # Errors
    /// As [`Robot::modelled`].
    pub fn flexible_robot(&self) -> Result<FlexibleRobot, Error> {
        self.modelled(&Modelling::default())
    }

    /// Returns the robot with all links rigid and all joints prescribed, as an arm without springs.
    ///
    /// # Errors
    /// [`Error::Model`].
    pub fn rigid_robot(&self) -> Result<FlexibleRobot, Error> {
        self.modelled(&Modelling { links: LinkModel::Rigid, drives: DriveModel::Rigid, ..Modelling::default() })
    }

    /// Returns the robot with its links and drives modelled as requested.
    ///
    /// # Errors
    /// [`Error::Modelling`] if a link or drive has no such model, [`Error::Model`] if the result is
    /// not a valid tree.
    pub fn modelled(&self, modelling: &Modelling) -> Result<FlexibleRobot, Error> {
        let ChosenLinks { links, doubts, modal_instead } = self.chosen_links(modelling)?;
        let mut substituted = substitute(&self.rigid, &links).map_err(ModellingError::from)?;
        let bends = crate::bends::bends(&substituted);
        let gearboxes: Vec<Gearbox> =
            self.drives.iter().filter_map(|drive| drive.gearbox_as(modelling.drives)).collect();
        let gears = insert_gearboxes(&mut substituted.mechanism, &gearboxes).map_err(ModellingError::from)?;
        let mounted = self.insert_springs(&mut substituted, modelling)?;
        let model = Model::new(&substituted.mechanism)
            .map_err(|source| Error::Model { path: self.urdf_path.clone(), source: Box::new(source) })?;

        let mut owned = self.lumped_springs(&substituted);
        owned.extend(self.modal_springs(&links, &substituted));
        owned.extend(self.gear_springs(&gears, &model));
        let mounting = mounted.as_ref().map(|_| substituted.spans.len() - 1);
        owned.extend(mounted);
        let (springs, owners) = in_coordinate_order(&model, owned)?;
        let (friction, torque) = self.actuation(&model, modelling.drives);
        let gears = self.gear_laws(&model, &owners);
        Ok(FlexibleRobot {
            path: self.urdf_path.clone(),
            tcp: tcp_frame(&model),
            model: Arc::new(model),
            springs,
            owners,
            spans: substituted.spans,
            bends,
            rigid: self.rigid_model()?,
            friction,
            gears,
            torque,
            doubts,
            mounting,
            extent: Size::of(&self.urdf.mechanism).extent.max(self.tcp.1.translation.vector.norm()),
            modal_instead,
        })
    }

    /// Chooses the model of each flexible link.
    fn chosen_links(&self, modelling: &Modelling) -> Result<ChosenLinks, Error> {
        let mut chosen = ChosenLinks::default();
        let wanted = if modelling.links == LinkModel::Rigid { &[][..] } else { &self.flexible[..] };
        for link in wanted {
            let (form, instead) = self.form_of(link, modelling)?;
            chosen.modal_instead.extend(instead);
            chosen.doubts.extend(doubts_of(link, &form));
            let mut flexible = FlexibleLink { form, ..link.flexible.clone() };
            let uncut = self.uncut(link, &mut flexible);
            chosen.doubts.extend(uncut.map(|text| Caveat::from_message("uniform-mass", "links", text, "")));
            chosen.links.push(flexible);
        }
        // An option that applies to no link is an error.
        let modal = chosen.links.iter().filter(|link| matches!(link.form, LinkForm::Modal(_))).count();
        if let (Some(n), true) = (modelling.segments, modal == chosen.links.len()) {
            return Err(ModellingError::NoLumpedLink { segments: n, modal_instead: chosen.modal_instead }.into());
        }
        if let (Some(n), 0) = (modelling.modes, modal) {
            return Err(ModellingError::NoModalLink { modes: n }.into());
        }
        Ok(chosen)
    }

    /// Inserts the mounting springs under the base; with rigid links the ground is rigid too.
    fn insert_springs(
        &self,
        substituted: &mut Substituted,
        modelling: &Modelling,
    ) -> Result<Option<OwnedSpring>, Error> {
        let Some(RobotMounting::Springs { springs, damping }) = &self.mounting else { return Ok(None) };
        if modelling.links == LinkModel::Rigid {
            return Ok(None);
        }
        let (spring, span) = insert_mounting(&mut substituted.mechanism, springs).map_err(ModellingError::from)?;
        let owner = Owner::Link(substituted.spans.len());
        substituted.spans.push(span);
        let (group, name) = (spring.joint, spring.link);
        Ok(Some(OwnedSpring { group, spring: Spring::from((name, spring.K_S, *damping)), owner }))
    }

    /// Returns the springs of the lumped links.
    fn lumped_springs(&self, substituted: &Substituted) -> Vec<OwnedSpring> {
        let springs = &substituted.springs;
        let mut owned = Vec::new();
        for (k, span) in substituted.spans.iter().enumerate() {
            let of_link: Vec<_> = springs.iter().filter(|spring| spring.link == span.link).collect();
            for (number, spring) in of_link.iter().enumerate() {
                let name = match of_link.len() {
                    1 => span.link.clone(),
                    _ => format!("{}.{}", span.link, number + 1),
                };
                let (group, damping) = (spring.joint.clone(), self.flexible[k].damping);
                owned.push(OwnedSpring {
                    group,
                    spring: Spring::from((name, self.flexible[k].scaled(&spring.K_S), damping)),
                    owner: Owner::Link(k),
                });
            }
        }
        owned
    }

    /// Returns the springs of the modal links.
    fn modal_springs(&self, links: &[FlexibleLink], substituted: &Substituted) -> Vec<OwnedSpring> {
        let mut owned = Vec::new();
        for link in links {
            let span = substituted.spans.iter().position(|span| span.link == link.link);
            let (LinkForm::Modal(modal), Some(k)) = (&link.form, span) else { continue };
            let source = &self.flexible[k];
            let geometric = modal.geometric.as_ref().filter(|_| source.choices.geometric);
            let geometric = geometric.map(|g| Arc::new(stiffening(g)));
            let (name, K, damping) = (link.link.clone(), &modal.K * source.stiffness_factor, source.damping);
            let spring = Spring { name, K, damping, curve: None, geometric };
            owned.push(OwnedSpring { group: link.link.clone(), spring, owner: Owner::Link(k) });
        }
        owned
    }

    /// Returns the springs of the gearboxes.
    fn gear_springs(&self, gears: &[GearSpring], model: &Model) -> Vec<OwnedSpring> {
        let mut owned = Vec::new();
        for gear in gears {
            let found = self.drives.iter().enumerate().find(|(_, drive)| drive.joint == gear.gearbox);
            let Some((number, Some((_, damping)))) = found.map(|(n, drive)| (n, &drive.gearbox)) else { continue };
            let mut spring = Spring {
                name: gear.name.clone(),
                K: gear.K.clone(),
                damping: damping.of(gear.component, gear.K.nrows()),
                curve: damping.curve.clone().map(SpringCurve::from),
                geometric: None,
            };
            if let (Some(tubes), Some(tilt)) = (self.drives[number].guide(), damping.tilts.get(gear.component)) {
                let body = model.bodies().iter().find(|body| body.joint == gear.gearbox);
                let joint = self.rigid.joint(&gear.gearbox);
                let (Some(body), Some(joint)) = (body, joint) else { continue };
                let (law, stiffness) = guide_law(tubes, tilt, body, &joint.limits);
                (spring.curve, spring.K) = (Some(law), DMatrix::from_element(1, 1, stiffness));
            }
            owned.push(OwnedSpring { group: gear.joint.clone(), spring, owner: Owner::Drive(number) });
        }
        owned
    }

    /// Returns the gear effects other than elasticity, for springs with these owners.
    fn gear_laws(&self, model: &Model, owners: &[Owner]) -> GearLaws {
        let mut laws = GearLaws::default();
        let place = |joint: &str| model.coordinates()[..model.n_actuated()].iter().position(|c| c.joint == joint);
        let spring = |number: usize| {
            let element = owners.iter().position(|owner| *owner == Owner::Drive(number))?;
            (model.elastic()[element].size == 1).then_some(element)
        };
        for (number, drive) in self.drives.iter().enumerate() {
            if let Some(coordinate) = place(&drive.joint) {
                laws.add(drive, coordinate, spring(number));
            }
        }
        if let Some(RobotCoupling { joints, C, C_inverse }) = &self.coupling {
            let number = |joint: &String| self.drives.iter().position(|drive| drive.joint == *joint);
            laws.coupling = Some(GearCoupling {
                elements: joints.iter().filter_map(|joint| spring(number(joint)?)).collect(),
                coordinates: joints.iter().filter_map(|joint| place(joint)).collect(),
                C: C.clone(),
                C_inverse: C_inverse.clone(),
            });
        }
        laws
    }

    /// Returns the friction of each actuated coordinate, and the torque-driven joints as
    /// coordinate, servo and torque limit.
    fn actuation(&self, model: &Model, drives: DriveModel) -> (Vec<Friction>, Vec<(usize, ServoEntry, f64)>) {
        let actuated = &model.coordinates()[..model.n_actuated()];
        let drive_of = |joint: &str| self.drives.iter().find(|d| d.joint == joint);
        let friction = actuated.iter().map(|c| drive_of(&c.joint).map_or(Friction::NONE, |d| d.friction)).collect();
        let servo = |(k, coordinate): (usize, &Coordinate)| match drive_of(&coordinate.joint) {
            Some(d) => (d.kind_as(drives) == DriveKind::Torque).then_some((k, d.servo, d.torque_limit)),
            None => (drives == DriveModel::Servo).then(|| (k, ServoEntry::default(), coordinate.limits.effort)),
        };
        (friction, actuated.iter().enumerate().filter_map(servo).collect())
    }

    /// Returns the model of a link on this robot, and a message if it differs from the requested
    /// one: a link loaded at a third interface becomes modal, because rigid parts with springs have
    /// only two interfaces.
    pub(crate) fn form_of(&self, link: &RobotLink, modelling: &Modelling) -> Result<(LinkForm, Option<String>), Error> {
        let form = link.form(modelling).map_err(ModellingError::NoSuchModel)?;
        let branches =
            if matches!(form, LinkForm::Modal(_)) { Vec::new() } else { branch_joints(&self.rigid, &link.flexible) };
        let Some(BranchJoint { joint, interface }) = branches.first() else { return Ok((form, None)) };
        let name = &link.flexible.link;
        let why =
            format!("joint {joint:?} is on its interface {interface:?}, and a lumped link has only two interfaces");
        let modelling = Modelling { links: LinkModel::Modal, ..*modelling };
        let modal = link.form(&modelling).map_err(|instead| ModellingError::Branch {
            link: name.clone(),
            why: why.clone(),
            instead,
        })?;
        Ok((modal, Some(format!("link {name:?} is modal (model = \"modal\"): {why}"))))
    }

    /// Uses the mass of a uniform beam if the file does not choose whose mass the parts take and
    /// the link's own mass cannot be cut; returns a message in that case.
    fn uncut(&self, link: &RobotLink, flexible: &mut FlexibleLink) -> Option<String> {
        if link.choices.parts_asked {
            return None;
        }
        let Err(SubstitutionError::Cut { link: name, source }) =
            substitute(&self.rigid, std::slice::from_ref(flexible))
        else {
            return None;
        };
        flexible.parts = Parts::Reduced;
        let middle = flexible.reduced.rigid().com;
        let own =
            self.rigid.link(&name).and_then(|link| link.inertia).map_or_else(Vector3::zeros, |inertia| inertia.com);
        Some(format!(
            "link {name:?}: the URDF's inertia cannot be spread along the beam ({source}); its parts have the URDF's mass as a \
             uniform beam instead, whose centre of mass is {:.4} m from the URDF's; set parts = \"uniform\" if this is intended",
            (middle - own).norm()
        ))
    }
}

/// Flexible links with the model chosen for each.
#[derive(Default)]
struct ChosenLinks {
    links: Vec<FlexibleLink>,
    doubts: Vec<Caveat>,
    modal_instead: Vec<String>,
}

/// Returns the caveats about a link in this form.
fn doubts_of(link: &RobotLink, form: &LinkForm) -> Vec<Caveat> {
    let mut doubts = Vec::new();
    let is_modal = matches!(form, LinkForm::Modal(_));
    if is_modal && link.stress == Some(StressSource::Beam) {
        doubts.push(kinds::NO_STRESS_OF_MODES.found(format!("link {:?}", link.flexible.link), 0.0, 0.0));
    }
    let link = &link.flexible;
    if matches!(form, LinkForm::Modal(modal) if !modal.has_second_order()) {
        let text = format!("link {:?}: {SECOND_ORDER_UNKNOWN}", link.link);
        let help = "reduce the mesh itself (flexarm reduce) to have them";
        doubts.push(Caveat::from_message("second-order-unknown", "links", text, help));
    }
    if matches!(form, LinkForm::Chain(_)) && link.angles == ElasticAngles::EulerZyx {
        let text = format!("link {:?}: {EULER_CHAIN}", link.link);
        doubts.push(Caveat::from_message("euler-chain", "links", text, "leave angles away: rotation vectors"));
    }
    doubts
}

/// Spring with the group of elastic coordinates it acts on
/// ([`flexarm_kinematics::ElasticGroup::name`]).
struct OwnedSpring {
    group: String,
    spring: Spring,
    owner: Owner,
}

/// Sorts springs and their owners into the order of the model's elastic coordinates.
///
/// # Errors
/// [`ModellingError::NoStiffness`] for a group without a spring.
fn in_coordinate_order(model: &Model, owned: Vec<OwnedSpring>) -> Result<(Vec<Spring>, Vec<Owner>), ModellingError> {
    let mut by_group: HashMap<String, (Spring, Owner)> =
        owned.into_iter().map(|owned| (owned.group, (owned.spring, owned.owner))).collect();
    let of_group = |group: &ElasticGroup| {
        by_group.remove(&group.name).ok_or_else(|| ModellingError::NoStiffness { joint: group.name.clone() })
    };
    model.elastic().iter().map(of_group).collect::<Result<Vec<_>, _>>().map(|found| found.into_iter().unzip())
}

fn stiffening(g: &flexarm_fem::GeometricStiffness) -> GeometricStiffness {
    GeometricStiffness {
        acceleration: g.acceleration.clone(),
        angular: g.angular.clone(),
        centrifugal: g.centrifugal.clone(),
        interface: g.interface.clone(),
    }
}
