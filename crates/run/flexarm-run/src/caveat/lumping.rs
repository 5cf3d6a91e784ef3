//! Finding about rigid parts that do not converge to their mesh: open profiles, whose sections warp,
//! and links whose section is not the same along the line from A to B.
//!
//! Start at [`of_parts`]. Truth: the modes of the mesh in the `.flex` file. A uniform beam of as many
//! parts gives the yardstick. Not here: sag and frequencies of parts (`flexarm_fem::chain`).

use flexarm_fem::ModalLink;
use flexarm_fem::chain::Chain;
use flexarm_flexlink::LinkForm;
use flexarm_settings::Setting;
use nalgebra::{DVector, Vector3};

use super::{Finding, Severity};
use crate::robot::robot_link::RobotLink;
use crate::run::monitor::stress::without_attached;

/// Error of the sag of a uniform beam of two parts under its own weight, and of the frequency of
/// its third mode in a plane; both fall with the square of the number of joints.
const UNIFORM: [f64; 2] = [0.165, 0.35];
/// Allowance in addition to 1.5 times the error of a uniform beam.
const MORE: f64 = 0.01;
/// Number of frequencies that are compared.
const MODES: usize = 3;
/// Minimum number of stored modes beside those of the interfaces for frequencies to compare with.
const STORED: usize = 6;

/// Compares the rigid parts of a link with the modes of its mesh; returns a caveat if they are
/// farther off than those of a uniform beam would be.
pub(crate) fn of_parts(link: &RobotLink, form: &LinkForm) -> Option<Finding> {
    let reduced = &link.flexible.reduced;
    let modal = reduced.details.as_ref()?.modal.as_ref()?;
    let chain = match form {
        LinkForm::Modal(_) => return None,
        LinkForm::Chain(chain) => chain.clone(),
        LinkForm::TwoParts => {
            Chain { joints: vec![reduced.split.clone()], parts: vec![reduced.proximal.clone(), reduced.distal.clone()] }
        }
    };
    // Sag under the own weight and first frequencies, without bodies that the mesh does not have.
    let chain = Chain { parts: without_attached(reduced, chain.parts), ..chain };
    let joints = (chain.joints.len() as f64).powi(2);
    let sag = sag_error(&chain, modal, &reduced.X_LB.translation.vector)?;
    // Bounds: 1.5 times the error of a uniform beam, which falls with the square of the joints.
    let [bound, of_modes] = UNIFORM.map(|error| 1.5 * error / joints + MORE);
    let modes = frequency_errors(&chain, modal);
    let worst =
        modes.iter().copied().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).filter(|(_, e)| e.abs() > of_modes);
    if sag <= bound && worst.is_none() {
        return None;
    }
    let mode = worst.map(|(k, error)| format!(" and mode {k} by {:+.1} %", 100.0 * error)).unwrap_or_default();
    let message = format!(
        "link {:?}: with {} rigid parts its sag under its own weight is off by {:.1} %{mode} from its mesh; a uniform \
         beam would be off by {:.1} %",
        link.flexible.link,
        chain.parts.len(),
        100.0 * sag,
        100.0 * UNIFORM[0] / joints
    );
    let help = format!(
        "rigid parts do not represent its shape, with more of them neither: model = \"modal\" on the link, or {} modal, \
         is exact",
        Setting::Links
    );
    let severity = if matches!(form, LinkForm::TwoParts) { Severity::Note } else { Severity::Warning };
    let caveat = Finding::warning("parts-off", format!("link {:?}", link.flexible.link), message, &help);
    Some(Finding { severity, value: Some(sag), yardstick: Some(bound), ..caveat })
}

/// Maximum difference of the displacement of B under the own weight along x, y or z from that of
/// the mesh, relative to the largest of the mesh.
fn sag_error(chain: &Chain, modal: &ModalLink, p_LB: &Vector3<f64>) -> Option<f64> {
    let Phi = &modal.interfaces.first()?.Phi;
    let factor = modal.K.clone().cholesky()?;
    let (mut off, mut size) = (0.0f64, 0.0f64);
    for axis in 0..3 {
        let gravity = Vector3::ith(axis, 1.0);
        let load = DVector::from_column_slice((modal.C_t.transpose() * gravity).as_slice());
        let truth = (Phi * factor.solve(&load)).fixed_rows::<3>(0).into_owned();
        let found = chain.sag(p_LB, &gravity)?;
        off = off.max((found.fixed_rows::<3>(0) - truth).norm());
        size = size.max(truth.norm());
    }
    (size > 0.0).then(|| off / size)
}

/// Relative errors of the first frequencies with A held, with the number of the mode; none if the
/// mesh has few modes stored.
fn frequency_errors(chain: &Chain, modal: &ModalLink) -> Vec<(usize, f64)> {
    if modal.coordinates() < 6 * modal.interfaces.len() + STORED {
        return Vec::new();
    }
    let truth = modal.held_frequencies_hz().into_iter();
    let pairs = chain.held_frequencies_hz().into_iter().zip(truth).take(MODES);
    pairs.enumerate().map(|(k, (found, truth))| (k + 1, found / truth - 1.0)).collect()
}
