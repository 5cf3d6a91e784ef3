//! Contributions to the maximum TCP error of links, drives, servos and stepper, for tables and
//! page.

use crate::run::headline::{self, rounded};
use crate::run::summary::{DriveFigures, LinkFigures, Summary};

/// Contribution of one part of the arm to the maximum TCP error, with its own figures.
pub(super) struct PartShare<'a> {
    /// Name of the link or joint, or of the stepper.
    pub(super) name: &'a str,
    /// Kind, as in [`crate::ShareFigures`].
    pub(super) kind: &'a str,
    /// Contribution along the direction of the maximum TCP error (m), if known.
    pub(super) at_peak_m: Option<f64>,
    /// Maximum TCP displacement that it causes at any time (m).
    pub(super) largest_m: Option<f64>,
    /// Further figures of the part.
    pub(super) part: Part<'a>,
}

/// Part of the arm to which a contribution belongs.
pub(super) enum Part<'a> {
    Link(&'a LinkFigures),
    Drive(&'a DriveFigures),
    /// Servos and stepper.
    None,
}

/// Returns links, drives and all other contributors to the maximum TCP error; the contributions add
/// up to it.
pub(super) fn part_shares(summary: &Summary) -> Vec<PartShare<'_>> {
    let shares = summary.tcp.as_ref().map_or(&[][..], |tcp| &tcp.shares_at_peak);
    let known = |name: &str, kinds: &[&str]| {
        shares.iter().find(|share| share.name == name && kinds.contains(&share.kind.as_str()))
    };
    // Links and drives have figures of their own; servos and the stepper have a share only.
    let links = summary.links.iter().map(|link| {
        let share = known(&link.name, &[headline::LINK, headline::MOUNTING]);
        PartShare {
            name: &link.name,
            kind: share.map_or(headline::LINK, |share| share.kind.as_str()),
            at_peak_m: share.map(|share| share.along_m),
            largest_m: Some(link.peak_contribution_m),
            part: Part::Link(link),
        }
    });
    let drives = summary.elastic_drives.iter().map(|drive| PartShare {
        name: &drive.joint,
        kind: headline::GEARBOX,
        at_peak_m: known(&drive.joint, &[headline::GEARBOX]).map(|share| share.along_m),
        largest_m: Some(drive.peak_contribution_m),
        part: Part::Drive(drive),
    });
    let others = shares.iter().filter(|share| [headline::SERVO, headline::STEPPER].contains(&share.kind.as_str()));
    let others = others.map(|share| PartShare {
        name: &share.name,
        kind: &share.kind,
        at_peak_m: Some(share.along_m),
        largest_m: None,
        part: Part::None,
    });
    links.chain(drives).chain(others).collect()
}

/// Formats the contributions of all parts in mm such that they add up to the displayed peak; `None`
/// for those that are not known.
pub(super) fn share_numbers(summary: &Summary, shares: &[PartShare<'_>], digits: usize) -> Vec<Option<String>> {
    let known: Vec<f64> = shares.iter().filter_map(|share| Some(1e3 * share.at_peak_m?)).collect();
    let peak = summary.tcp.as_ref().map_or(f64::NAN, |tcp| 1e3 * tcp.peak_m);
    let mut numbers = rounded(&known, peak, digits).into_iter();
    shares.iter().map(|share| share.at_peak_m.and_then(|_| numbers.next())).collect()
}
