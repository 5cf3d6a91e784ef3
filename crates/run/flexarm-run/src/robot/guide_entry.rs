//! Guide of a telescopic joint in a robot file (`docs/mounting.md`): from the text to checked values
//! and to the law of each axis.
//!
//! The compliance of a tilt is `c0 + c1/l + c2/l²` (rad/(N m)) with the overlap l of the tubes (m),
//! `l = outer_end - inner_end - q` at the joint position q. Not here: the joints of the tilt in the
//! tree (`flexarm_flexlink::GuideTubes`), the moment of its play (`flexarm_stepping::Guide`).

use flexarm_flexlink::GuideTubes;
use flexarm_kinematics::{Body, Joint, JointKind, Limits};
use flexarm_stepping::{Guide, Play, SpringCurve};
use serde::Deserialize;

/// Guide of a sliding joint: `gearbox = { guide = { ... } }`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct GuideEntry {
    /// End of the outer tube, along the axis from the joint frame at joint position 0 (m).
    pub outer_end: f64,
    /// End of the inner tube, along the axis from the child frame (m).
    #[serde(default)]
    pub inner_end: f64,
    /// Tilt about the axes of the joint frame; a missing axis is rigid.
    pub x: Option<TiltEntry>,
    pub y: Option<TiltEntry>,
    pub z: Option<TiltEntry>,
}

/// Tilt about one axis.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TiltEntry {
    /// c0 (rad/(N m)), c1 (rad/N) and c2 (rad m/N) of `c0 + c1/l + c2/l²`, l the overlap (m).
    pub compliance: [f64; 3],
    /// Clearance between the tubes.
    pub play: Option<PlayEntry>,
}

/// Clearance between the tubes.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PlayEntry {
    /// Total clearance at a pad (m).
    pub gap: f64,
    /// Moment at which the inner tube is in the middle (N m); 0 by default.
    #[serde(default)]
    pub centre: f64,
    /// Width of the transition from one side to the other (N m).
    #[serde(default = "width")]
    pub width: f64,
}

fn width() -> f64 {
    10.0
}

/// Checked tilt about one axis of the joint frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuideTilt {
    /// Axis of the joint frame: `x`, `y` or `z`.
    pub axis: char,
    /// c0, c1 and c2; see [`Guide::compliance`].
    pub compliance: [f64; 3],
    /// Clearance between the tubes.
    pub play: Option<Play>,
}

impl GuideEntry {
    /// Checks the entry for a joint; returns its tubes and the tilts about their axes.
    ///
    /// # Errors
    /// A sentence with the key, the number found and the remedy.
    pub(crate) fn checked(&self, joint: &Joint) -> Result<(GuideTubes, Vec<GuideTilt>), String> {
        if !matches!(joint.kind, JointKind::Prismatic(_)) {
            return Err("guide is for a prismatic joint, whose tubes slide in each other".into());
        }
        // The tubes must overlap at both limits of the joint.
        let entries = [('x', &self.x), ('y', &self.y), ('z', &self.z)];
        let tubes = GuideTubes {
            outer_end: self.outer_end,
            inner_end: self.inner_end,
            tilts: entries.map(|(_, entry)| entry.is_some()),
        };
        let overlaps = overlaps(&tubes, &joint.limits);
        if let Some(&(position, overlap)) = overlaps.iter().find(|(_, overlap)| *overlap <= 0.0) {
            return Err(format!(
                "guide: at joint position {position} m the tubes overlap by {overlap:.4} m, expected more than 0 \
                 within the limits of the joint: overlap = outer_end - inner_end - position"
            ));
        }
        // Each axis that tilts: a clearance, and a compliance that is positive at every overlap.
        let mut tilts = Vec::new();
        for (axis, entry) in entries {
            let Some(TiltEntry { compliance, play }) = entry else { continue };
            let play = play.map(|PlayEntry { gap, centre, width }| Play { gap, centre, width });
            if let Some(Play { gap, centre, width }) = play
                && !(gap >= 0.0 && width > 0.0 && centre.is_finite())
            {
                return Err(format!(
                    "guide.{axis}.play: gap = {gap} m and width = {width} N m, expected a gap of at least 0 and a \
                     width above 0"
                ));
            }
            if let Some((overlap, found)) = least_compliance(compliance, &overlaps).filter(|(_, found)| *found <= 0.0) {
                return Err(format!(
                    "guide.{axis}.compliance: {found:.3e} rad per N m at an overlap of {overlap:.4} m, expected more \
                     than 0 within the limits of the joint: [c0, c1, c2] of c0 + c1/overlap + c2/overlap²"
                ));
            }
            tilts.push(GuideTilt { axis, compliance: *compliance, play: play.filter(|play| play.gap > 0.0) });
        }
        match tilts.is_empty() {
            true => Err("guide needs x, y or z = { compliance = [c0, c1, c2] }, a tilt about an axis".into()),
            false => Ok((tubes, tilts)),
        }
    }
}

/// Returns positions and overlaps at the limits of a joint; at position 0 without limits.
fn overlaps(tubes: &GuideTubes, limits: &Limits) -> Vec<(f64, f64)> {
    let mut positions: Vec<f64> = [limits.lower, limits.upper].into_iter().filter(|q| q.is_finite()).collect();
    if positions.is_empty() {
        positions.push(0.0);
    }
    positions.into_iter().map(|q| (q, tubes.overlap(q))).collect()
}

/// Returns the overlap with the smallest compliance, and that compliance: at a limit of the joint, or
/// at `l = -2 c2/c1`, where the derivative by l is zero.
fn least_compliance(compliance: &[f64; 3], overlaps: &[(f64, f64)]) -> Option<(f64, f64)> {
    let [_, c1, c2] = *compliance;
    let law = Guide { coordinate: 0, overlap: [0.0; 2], compliance: *compliance, play: None };
    let (least, most) = overlaps.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), (_, l)| (a.min(*l), b.max(*l)));
    let turning = -2.0 * c2 / c1;
    let candidates = [least, most, turning].into_iter().filter(|l| (least..=most).contains(l));
    candidates.map(|l| (l, law.compliance(l))).min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Returns the law of a tilt on the body of its joint, and its stiffness (N m/rad) at the largest
/// overlap within the limits.
pub(crate) fn guide_law(tubes: &GuideTubes, tilt: &GuideTilt, body: &Body, limits: &Limits) -> (SpringCurve, f64) {
    let guide = Guide {
        coordinate: body.coordinate,
        overlap: [tubes.overlap(body.offset), -body.ratio],
        compliance: tilt.compliance,
        play: tilt.play,
    };
    let most = overlaps(tubes, limits).iter().fold(0.0_f64, |most, (_, overlap)| most.max(*overlap));
    (SpringCurve::Guide(guide), 1.0 / guide.compliance(most))
}
