//! Shares of the peak TCP error for table and page: of links, drives, servos
//! and stepper.

use crate::headline::{self, rounded};
use crate::summary::{DriveFigures, LinkFigures, Summary};

/// Share of one part of the arm in the peak TCP error, with its own figures.
pub(super) struct PartShare<'a> {
    /// Name of the link or joint, or of the stepper.
    pub(super) name: &'a str,
    /// As in [`crate::ShareFigures`].
    pub(super) kind: &'a str,
    /// Part of the largest TCP error along its direction (m), where that is known.
    pub(super) at_peak_m: Option<f64>,
    /// Maximum TCP displacement that it causes at any time (m).
    pub(super) largest_m: Option<f64>,
    /// The rest of its figures.
    pub(super) part: Part<'a>,
}

/// The part of the arm that a share belongs to.
pub(super) enum Part<'a> {
    Link(&'a LinkFigures),
    Drive(&'a DriveFigures),
    /// Servos and stepper.
    None,
}

/// Links, drives, and what else has a share in the largest TCP error; the shares add up to it.
pub(super) fn part_shares(summary: &Summary) -> Vec<PartShare<'_>> {
    let shares = summary.tcp.as_ref().map_or(&[][..], |tcp| &tcp.shares_at_peak);
    let known = |name: &str, kinds: &[&str]| {
        shares.iter().find(|share| share.name == name && kinds.contains(&share.kind.as_str()))
    };
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

/// The shares of all parts in mm, as numbers that add up to the peak as it is shown; those that are
/// not known are `None`.
pub(super) fn share_numbers(summary: &Summary, shares: &[PartShare<'_>], digits: usize) -> Vec<Option<String>> {
    let known: Vec<f64> = shares.iter().filter_map(|share| Some(1e3 * share.at_peak_m?)).collect();
    let peak = summary.tcp.as_ref().map_or(f64::NAN, |tcp| 1e3 * tcp.peak_m);
    let mut numbers = rounded(&known, peak, digits).into_iter();
    shares.iter().map(|share| share.at_peak_m.and_then(|_| numbers.next())).collect()
}
