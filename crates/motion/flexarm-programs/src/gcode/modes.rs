//! Modal codes of G-code: which are in force, which contradict each other, which are not read.
//!
//! Codes are in tenths (590 is G59, 591 G59.1). Codes of one modal group must not occur twice in a
//! line ([`check_groups`]). Not here: codes that act once (`mod.rs`, `frames`).

use std::collections::HashMap;

use flexarm_path::program::Blend;

use super::arcs::Plane;
use super::frames::WORK_FRAMES;
use super::{FeedMode, Gcode, Motion};
use crate::common::{Result, Span, fail};

impl Gcode<'_> {
    /// Sets the modes, in the order of the standard, before any motion.
    pub(super) fn modes(&mut self, codes: &[(i32, Span)], values: &HashMap<char, (f64, Span)>) -> Result<()> {
        // Motion, plane, unit, coordinates, centres, feed, blend, work frame, then codes that act
        // once.
        for &(code, span) in codes {
            match code {
                0 => self.motion = Some(Motion::Rapid),
                10 => self.motion = Some(Motion::Line),
                20 => self.motion = Some(Motion::Clockwise),
                30 => self.motion = Some(Motion::Counterclockwise),
                170 => self.plane = Plane::XY,
                180 => self.plane = Plane::ZX,
                190 => self.plane = Plane::YZ,
                200 | 210 => {
                    self.unit = if code == 200 { 0.0254 } else { 1e-3 };
                    self.unit_is_told = true;
                }
                900 => self.relative = false,
                910 => self.relative = true,
                901 => self.absolute_centres = true,
                911 => self.absolute_centres = false,
                930 => self.feed_mode = FeedMode::InverseTime,
                940 => self.feed_mode = FeedMode::PerMinute,
                800 => self.motion = None,
                610 | 611 | 640 => {
                    self.blend_is_told = true;
                    self.blend = match (code, values.get(&'P')) {
                        (610, _) => Blend::Pass,
                        (611, _) => Blend::Stop,
                        (_, Some((tolerance, at))) => {
                            if *tolerance < 0.0 {
                                return fail(*at, "the tolerance of G64 is 0 or more");
                            }
                            Blend::Distance(tolerance * self.unit)
                        }
                        _ => {
                            self.recorder.note("G64 without P leaves the path without a bound: it is kept exactly; give a tolerance with P", span);
                            Blend::Pass
                        }
                    };
                }
                code if WORK_FRAMES.contains(&code) => self.change_frame(code, span)?,
                400 | 490 | 530 | 40 | 280 | 300 | 920 | 921 | 922 | 923 | 100 | 430 | 980 | 990 | 970 | 500 | 690
                | 150 => {}
                _ => return fail(span, refused(code)),
            }
        }
        Ok(())
    }

    pub(super) fn set_feed(&mut self, feed: f64, span: Span) -> Result<()> {
        if feed.is_nan() || feed <= 0.0 {
            return fail(span, format!("the feed is {feed}: it must be above 0"));
        }
        self.feed = match self.feed_mode {
            FeedMode::PerMinute => Some(feed * self.unit / 60.0),
            FeedMode::InverseTime => self.feed,
        };
        Ok(())
    }
}

/// Rejects two codes of one modal group in a line.
pub(super) fn check_groups(codes: &[(i32, Span)]) -> Result<()> {
    const GROUPS: [&[i32]; 8] = [
        &[0, 10, 20, 30, 800],
        &[170, 180, 190],
        &[200, 210],
        &[900, 910],
        &[930, 940],
        &[610, 611, 640],
        &[540, 550, 560, 570, 580, 590, 591, 592, 593],
        &[901, 911],
    ];
    for group in GROUPS {
        let mut of_group = codes.iter().filter(|(code, _)| group.contains(code));
        if let (Some((first, _)), Some((second, span))) = (of_group.next(), of_group.next())
            && first != second
            && *first != 800
            && *second != 800
        {
            return fail(*span, "two codes of one line contradict each other: write them in two lines");
        }
    }
    Ok(())
}

/// Error message for an unsupported code.
fn refused(code: i32) -> String {
    match code {
        410 | 420 | 411 | 421 => {
            "cutter radius compensation is not computed: let the CAM program write the path of the tool's centre"
        }
        431 | 432 | 433 | 434 | 440 => {
            "this tool length compensation is not computed: write the path of the tool's tip"
        }
        730 | 740 | 760 | 810 | 820 | 821 | 830 | 840 | 850 | 860 | 870 | 880 | 890 => {
            "drilling cycles are not read: let the CAM program write them as G0 and G1"
        }
        950 => "feed per turn of the spindle is not read: write mm per minute (G94)",
        50..=53 => "splines (G5) are not read: write lines or arcs",
        160 => "polar coordinates are not read: write X and Y",
        520 => "the local offset G52 is not read: use G92 or a work frame",
        510 | 511 | 680 => {
            "scaling, mirroring and turning of the program are not read: let the CAM program write the path so"
        }
        380..=385 => "probing depends on what the tool touches: take the line out",
        330 | 331 | 320 => "threads that follow the spindle are not read",
        70 | 80 => "lathe modes (G7, G8) are not read",
        _ => "this code is unknown, and so is its effect on the motion: remove it",
    }
    .into()
}
