//! A flexible link of a robot with the data from which its models are built.
//!
//! Start at [`RobotLink::form`]: two rigid parts, a chain of more, or modes, as the robot file or an
//! override asks, made of the beam or taken from the `.flex` file. Not here: reading the entry
//! (`link_entry`), the tree with the link in it (`flexarm-flexlink`).

use std::path::PathBuf;
use std::sync::Arc;

use flexarm_fem::stress::StressFields;
use flexarm_fem::{BeamLink, FemError, ModalLink, ModalOptions};
use flexarm_flexlink::{FlexibleLink, LinkForm};
use flexarm_kinematics::MAX_COORDINATES;
use flexarm_settings::Setting;
use flexarm_stepping::Damping;
use nalgebra::Matrix6;

use crate::arm::options::{LinkModel, Modelling};
use crate::error::Error;
use crate::robot::strength::Strength;

/// Maximum number of fixed-interface modes of a link.
const MAX_MODES: usize = 200;

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
#[derive(Clone, Debug, PartialEq)]
pub enum StressSource {
    /// Stress fields from a file beside that of the reduced link.
    File {
        /// The file.
        path: PathBuf,
        /// Its content.
        fields: Arc<StressFields>,
    },
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
    /// Returns the stiffness of a spring of the lumped models, given that of its source: replaced if
    /// the robot file has one, and with all factors.
    ///
    /// ```text
    /// K = f S K_S S,    S = diag(√f_1, ..., √f_6)
    /// ```
    pub(crate) fn scaled(&self, K: &Matrix6<f64>) -> Matrix6<f64> {
        let root = self.stiffness_factors.map(f64::sqrt);
        let K = self.stiffness.as_ref().unwrap_or(K);
        Matrix6::from_fn(|i, j| root[i] * K[(i, j)] * root[j]) * self.stiffness_factor
    }

    /// Whether the source provides geometric stiffening for a modal link.
    pub(crate) fn has_geometric(&self) -> bool {
        let stored = self.flexible.reduced.details.as_ref().and_then(|details| details.modal.as_ref());
        self.beam.is_some() || stored.is_some_and(|modal| modal.geometric.is_some())
    }

    /// Returns the model of the link; rigid links have none.
    ///
    /// # Errors
    /// [`Error::Modelling`] with what the source of the link lacks.
    pub fn form(&self, modelling: &Modelling) -> Result<LinkForm, Error> {
        self.form_or_key(modelling).map_err(|(_, error)| Error::Modelling(error))
    }

    /// As [`Self::form`], with the robot file key that requested what is missing.
    pub(crate) fn form_or_key(&self, modelling: &Modelling) -> Result<LinkForm, (RequestedKey, String)> {
        // A key that only one of the models has is an error with the other.
        let link = &self.flexible.link;
        let model = if modelling.links == LinkModel::AsFiled { self.choices.model } else { modelling.links };
        match model {
            LinkModel::Modal if self.stiffness_factors != [1.0; 6] => Err((
                RequestedKey::Directions,
                format!(
                    "link {link:?}: stiffness_factors are those of the springs of a lumped link; a modal link has \
                     one stiffness_factor"
                ),
            )),
            LinkModel::Modal if self.stiffness.is_some() => Err((
                RequestedKey::Stiffness,
                format!(
                    "link {link:?} is a modal body: its stiffness is that of the one spring between two rigid parts; \
                     leave it out"
                ),
            )),
            LinkModel::Modal => self.modal(modelling).map(|modal| LinkForm::Modal(Arc::new(modal))),
            _ => match modelling.segments.unwrap_or(self.choices.segments) {
                2 => Ok(LinkForm::TwoParts),
                parts if self.stiffness.is_some() => Err((
                    RequestedKey::Stiffness,
                    format!(
                        "link {link:?} has {parts} parts: its stiffness is that of the one spring between two rigid \
                         parts; leave it out"
                    ),
                )),
                n => self.lumped(n).map_err(|error| (RequestedKey::Segments, error)),
            },
        }
    }

    fn lumped(&self, segments: usize) -> Result<LinkForm, String> {
        let link = &self.flexible.link;
        // Bound on the work of a step.
        let coordinates = 6 * segments.saturating_sub(1);
        if coordinates > MAX_COORDINATES {
            let message = format!(
                "link {link:?}: {segments} segments have {coordinates} elastic coordinates, a robot can have {} in \
                 all, for the time of a step grows with their cube: ask for at most {} in one link, or for modes, \
                 which say more with fewer",
                MAX_COORDINATES,
                MAX_COORDINATES / 6 + 1
            );
            return Err(message);
        }
        // A beam can be cut into any number of parts, a mesh into those stored.
        if let Some(beam) = &self.beam {
            let chain = beam.chain(segments).map(LinkForm::Chain);
            return chain.map_err(|source| format!("link {link:?}: {source}"));
        }
        let chains = self.flexible.reduced.details.as_ref().map_or(&[][..], |d| &d.chains[..]);
        let chain = chains.iter().find(|chain| chain.parts.len() == segments).cloned();
        chain.map(LinkForm::Chain).ok_or_else(|| {
            let stored: Vec<String> = chains.iter().map(|chain| chain.parts.len().to_string()).collect();
            let stored = match stored.is_empty() {
                true => "only two parts".into(),
                false => format!("2, {} parts", stored.join(", ")),
            };
            format!(
                "link {:?}: its .flex file has no chain of {segments} parts (it has {stored}): make it with flexarm \
                 reduce {} {segments}, or choose another number of segments",
                self.flexible.link,
                Setting::Chains
            )
        })
    }

    fn modal(&self, modelling: &Modelling) -> Result<ModalLink, (RequestedKey, String)> {
        let name = &self.flexible.link;
        let fail =
            |asked: RequestedKey| move |source: FemError| (asked, format!("link {name:?} cannot be modal: {source}"));
        // Number of modes: override, robot file, or what the source has.
        let wanted = modelling.modes.or(self.choices.modes);
        if let Some(modes) = wanted.filter(|modes| *modes > MAX_MODES) {
            let error = format!(
                "link {name:?}: {modes} modes are requested, at most {MAX_MODES} are allowed: the work of a step \
                 grows with the cube of their number, and those beyond the first dozen are far above what a drive or \
                 a tool excites"
            );
            return Err((RequestedKey::Modes, error));
        }
        // Modes of the beam, or those stored; a file with matrices alone is condensed to modes.
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
                let no_mass = format!(
                    "link {name:?} cannot be modal: its .flex file has no mass over interfaces and modes; reduce the \
                     mesh again with this version, or use model = \"lumped\""
                );
                let modal = stored.or_else(condensed).ok_or((RequestedKey::Model, no_mass))??;
                let stored = modal.coordinates().saturating_sub(6 * modal.interfaces.len());
                match wanted {
                    Some(n) if n < stored => modal.truncated(n).map_err(fail(RequestedKey::Modes))?,
                    Some(modes) if modes > stored => {
                        let message =
                            format!("link {name:?}: {modes} modes are requested, its .flex file has {stored}");
                        return Err((RequestedKey::Modes, message));
                    }
                    _ => modal,
                }
            }
        };
        // Geometric stiffening and eigenmodes, if the robot file asks for them.
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
