//! Selection among the solutions: sides of shoulder, elbow and wrist, configuration data of robot
//! programs, and whole turns within limits.
//!
//! Start at [`AnalyticArm::choose`]. Not here: the solutions (`wrist`, `parallel`).
//! Sources: [KUKA KSS] for status and turn, [ABB RAPID] for confdata.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::Vector3;

use super::position::{PositionForm, feet};
use super::screw::{Screw, wrapped};
use super::trig::across;
use super::{AnalyticArm, ArmClass, Kernel, Solution, Solutions};

/// Sides of shoulder, elbow and wrist. They are functions of the joint values only and distinguish
/// the solutions of a pose.
///
/// Spherical wrist: `shoulder` is set if the wrist centre is in front of axis 1, `elbow` if joint 3
/// is beyond the angle of the stretched arm (in its positive sense, within half a turn), `wrist` if
/// joint 5 is beyond the angle of the straight wrist (the one closest to zero). If axes 1 and 2 are
/// parallel or axes 2 and 3 intersect, `shoulder` and `elbow` denote the two roots of the first and
/// of the second equation solved. Arms solved from the tool have `shoulder` and `wrist` exchanged.
/// Three parallel axes: the sides denote the first angle, the elbow of the two bars, and the other
/// angle.
///
/// Each of the eight labels belongs to at most one solution, except where a quartic or a polynomial
/// of degree eight is solved ([`PositionForm::General`], [`ArmClass::ThreeParallel`] without
/// meeting axes): there several solutions may share a label.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Branch {
    /// Whether the wrist centre is in front of axis 1.
    pub shoulder: bool,
    /// Whether the elbow is bent in the positive sense of its joint.
    pub elbow: bool,
    /// Whether joint 5 is beyond the straight wrist in its positive sense.
    pub wrist: bool,
}

impl Branch {
    /// Index from 0 to 7: shoulder 4, elbow 2, wrist 1.
    pub fn index(self) -> usize {
        4 * usize::from(self.shoulder) + 2 * usize::from(self.elbow) + usize::from(self.wrist)
    }
}

/// Conversion of the model's joint values to the axis values of a robot controller:
/// `axis = sign q + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControllerAxes {
    /// 1 or -1 for each joint.
    pub sign: [f64; 6],
    /// Axis value at zero joint value (rad).
    pub offset: [f64; 6],
}

impl ControllerAxes {
    /// Identity: joint values are the controller's axis values.
    pub const SAME: Self = Self { sign: [1.0; 6], offset: [0.0; 6] };

    /// Value (rad) of axis `k`, 0 to 5.
    pub fn axis(&self, k: usize, q: &[f64; 6]) -> f64 {
        self.sign[k] * q[k] + self.offset[k]
    }
}

impl Default for ControllerAxes {
    fn default() -> Self {
        Self::SAME
    }
}

/// Criterion by which a solution is selected.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Selection {
    /// The solution closest to a reference.
    #[default]
    Nearest,
    /// KUKA's status and turn ([`AnalyticArm::kuka_status`], [`kuka_turn`]).
    Kuka {
        /// Bits of S; `None` for any.
        status: Option<u8>,
        /// Bits of T; `None` for any.
        turn: Option<u8>,
    },
    /// ABB's confdata ([`AnalyticArm::abb_configuration`]).
    Abb {
        /// Quarter turns of axes 1, 4 and 6.
        quadrants: [i32; 3],
        /// Configuration number, 0 to 7.
        cfx: i32,
    },
    /// Named sides; `None` for any.
    Words {
        /// Whether the wrist centre is in front of axis 1.
        front: Option<bool>,
        /// Whether the elbow is up.
        elbow_up: Option<bool>,
        /// Whether axis 5 is negative.
        wrist_flipped: Option<bool>,
    },
    /// Branch label.
    Branch(Branch),
}

/// KUKA turn T: bit k is set if axis k + 1 is negative (rad; a controller ignores it within some
/// degrees of zero).
pub fn kuka_turn(q: &[f64; 6], axes: &ControllerAxes) -> u8 {
    (0..6).fold(0, |bits, k| bits | u8::from(axes.axis(k, q) < 0.0) << k)
}

/// ABB quarter turn of an axis (rad): 0 for 0 to 90 degrees, -1 for -90 to 0, and so on.
fn abb_quadrant(axis: f64) -> i32 {
    (axis / FRAC_PI_2).floor() as i32
}

impl Selection {
    /// Whether the value of an axis (0 to 5, rad) matches the selected turn or quadrant.
    fn allows(&self, k: usize, axis: f64) -> bool {
        match *self {
            Self::Kuka { turn: Some(turn), .. } => axis.abs() < BOUNDARY || (axis < 0.0) == (turn >> k & 1 == 1),
            Self::Abb { quadrants: [first, fourth, sixth], .. } => match k {
                0 => is_in_quadrant(axis, first),
                3 => is_in_quadrant(axis, fourth),
                5 => is_in_quadrant(axis, sixth),
                _ => true,
            },
            _ => true,
        }
    }
}

fn is_in_quadrant(axis: f64, quadrant: i32) -> bool {
    abb_quadrant(axis - BOUNDARY) == quadrant || abb_quadrant(axis + BOUNDARY) == quadrant
}

/// Distance to a change of a bit or quadrant (rad, sine, or fraction of the reach) within which
/// either value matches.
const BOUNDARY: f64 = 1e-4;

/// Reference directions for the sides, at zero joint values.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sides {
    /// Unit vector normal to axes 1 and 2, pointing to the front, in world axes.
    front: Vector3<f64>,
    /// Whether a positive rotation of joint 3 bends the forearm forward and down when the upper arm
    /// is upright.
    elbow_forward: bool,
    /// Whether the positive side of the wrist is above `phi` (otherwise above `phi + π`).
    wrist_at_phi: bool,
}

impl Sides {
    /// Chooses the sides of an arm.
    ///
    /// * `up_W`: direction against gravity, in world axes, any length.
    pub(crate) fn new(kernel: &Kernel, reversed: bool, up_W: Vector3<f64>) -> Self {
        let (axes, fan, reach) = match kernel {
            Kernel::Wrist(k) => (&k.axes, Some(k.fan), k.reach),
            Kernel::Parallel234(k) => (&k.axes, Some(k.fan), k.reach),
            Kernel::Parallel123(k) => (&k.axes, None, k.reach),
        };
        let wrist_at_phi = fan.is_none_or(|f| wrapped(f.phi).abs() <= FRAC_PI_2 + 1e-9);
        let side = axes[0].h.cross(&axes[1].h);
        let mut sides = Self { front: across(&axes[0].h), elbow_forward: true, wrist_at_phi };
        if side.norm() < 1e-6 {
            return sides;
        }
        // Front: the side of axis 2, or else of the centre, across the first two axes.
        let (foot, shoulder) = feet(&axes[0], &axes[1]);
        let floor = 1e-6 * reach;
        let first = |values: &[f64]| values.iter().copied().find(|v| v.abs() > floor).unwrap_or(1.0).signum();
        let front = side.normalize();
        let center = if let Kernel::Wrist(k) = kernel { k.center - axes[0].o } else { Vector3::zeros() };
        sides.front = front * first(&[front.dot(&(shoulder - foot)), front.dot(&center)]);
        // Up: along axis 1 from the base to the foot of axis 2, or else against gravity.
        let up = axes[0].h;
        let height = if reversed { 0.0 } else { up.dot(&foot) };
        let up = up * first(&[height, up.dot(&up_W)]);
        sides.elbow_forward = axes[2].h.dot(&up.cross(&sides.front)) > 0.0;
        sides
    }
}

impl AnalyticArm {
    /// Branch label of joint values (rad).
    pub fn branch(&self, q: &[f64; 6]) -> Branch {
        let [shoulder, elbow, wrist] = self.side_values(q).map(|v| v >= 0.0);
        Branch { shoulder, elbow, wrist }
    }

    /// Values whose signs are the sides: sines of angles or lengths relative to the reach; zero
    /// where two branches meet.
    fn side_values(&self, q: &[f64; 6]) -> [f64; 3] {
        let mut q = *q;
        if self.reversed {
            q.reverse();
        }
        let mut values = match &self.kernel {
            Kernel::Wrist(k) => {
                // Both roots of the position problem, and the wrist beyond φ or not.
                let [base, elbow] = self.arm_sides(&k.axes, k.form, &k.center, &q);
                [base, elbow, self.beyond(k.fan.phi, q[4])]
            }
            Kernel::Parallel234(k) => {
                let [s1, s2, s3, s4, s5, _] = &k.axes;
                let (t2, t3, t4) = (s2.at(q[1]), s3.at(q[2]), s4.at(q[3]));
                // Side of axis 1 on which the point of axis 6 lies, bend of the bars, and joint 5.
                let point = t2.point(&t3.point(&t4.point(&s5.at(q[4]).point(&k.near.1))));
                let base = s1.h.cross(&s2.h).dot(&(point - s1.o)) / k.reach;
                [base, bend(s2, &s3.o, &t3.point(&s4.o), &s3.h), self.beyond(k.fan.phi, q[4])]
            }
            Kernel::Parallel123(k) => {
                let [s1, s2, s3, s4, s5, s6] = &k.axes;
                let (t4, t5) = (s4.at(q[3]), s5.at(q[4]));
                // Bend of the bars, and the sides of joints 4 and 5 relative to the common
                // direction.
                let lever = t4.vector(&(k.near.1 - s4.o));
                let fifth = t4.inverse().vector(&s1.h).dot(&s5.h.cross(&t5.vector(&s6.h)));
                [bend(s1, &s2.o, &s2.at(q[1]).point(&s3.o), &s2.h), -s1.h.dot(&s4.h.cross(&lever)) / k.reach, -fifth]
            }
        };
        if self.reversed {
            values.reverse();
        }
        values
    }

    /// Sides of the two roots of the position problem.
    fn arm_sides(&self, axes: &[Screw; 6], form: PositionForm, center: &Vector3<f64>, q: &[f64; 6]) -> [f64; 2] {
        let [s1, s2, s3, ..] = axes;
        let c3 = s3.at(q[2]).point(center);
        let c2 = s2.at(q[1]).point(&c3);
        let reach = self.chain.reach;
        match form {
            // The distance of the centre from o_2 decreases with the angle beyond the stretched
            // arm.
            PositionForm::Parallel23 | PositionForm::Intersecting12 | PositionForm::General => {
                [self.sides.front.dot(&(c2 - s1.o)) / reach, bend(s2, &s3.o, &c3, &s3.h)]
            }
            PositionForm::Parallel12 => [bend(s1, &s2.o, &c2, &s2.h), -s1.h.dot(&s3.h.cross(&(c3 - s3.o))) / reach],
            PositionForm::Intersecting23 => {
                let first = (s2.o - s1.o).dot(&s1.h.cross(&(c2 - s1.o))) / (reach * reach);
                [first, s3.h.dot(&s2.h.cross(&(c3 - s2.o))) / reach]
            }
        }
    }

    /// Sine of the angle of joint 5 beyond the straight wrist.
    fn beyond(&self, phi: f64, q: f64) -> f64 {
        let phi = if self.sides.wrist_at_phi { phi } else { phi + PI };
        (q - phi).sin()
    }

    /// Whether configuration data of industrial arms apply: spherical wrist, axes 2 and 3 parallel
    /// and perpendicular to axis 1.
    fn is_industrial(&self) -> bool {
        let Kernel::Wrist(k) = &self.kernel else { return false };
        self.class == ArmClass::SphericalWrist(PositionForm::Parallel23) && k.axes[0].h.dot(&k.axes[1].h).abs() < 0.5
    }

    /// Whether the forearm is bent forward and down from the upper arm, with the upper arm upright.
    fn bent_forward(&self, branch: Branch) -> bool {
        branch.elbow == self.sides.elbow_forward
    }

    /// Whether the elbow is up: above the line from axis 2 to the wrist centre, when the wrist
    /// centre is farther out than axis 2. `q`: joint values (rad).
    ///
    /// `None` for arms other than those with a spherical wrist and axes 2 and 3 parallel.
    pub fn elbow_up(&self, q: &[f64; 6]) -> Option<bool> {
        let branch = self.branch(q);
        self.is_industrial().then(|| self.bent_forward(branch) == branch.shoulder)
    }

    /// KUKA status S of joint values (rad): bit 0 is set if the wrist centre is behind axis 1
    /// (negative x in the frame that rotates with axis 1), bit 1 if axis 3 is beyond the angle of
    /// the stretched arm, bit 2 if axis 5 is negative.
    ///
    /// The front is the side of axis 1 on which axis 2 is or, if they intersect, on which the wrist
    /// centre is at zero joint values. Bits 3 and 4 (accuracy model) are zero. `None` for arms
    /// other than those with a spherical wrist and axes 2 and 3 parallel.
    pub fn kuka_status(&self, q: &[f64; 6], axes: &ControllerAxes) -> Option<u8> {
        let branch = self.branch(q);
        let bits = u8::from(!branch.shoulder)
            + 2 * u8::from(self.bent_forward(branch))
            + 4 * u8::from(wrapped(axes.axis(4, q)) < 0.0);
        self.is_industrial().then_some(bits)
    }

    /// ABB quarter turns of axes 1, 4 and 6 and configuration number of joint values (rad).
    ///
    /// `cfx` is the sum of 4 if the wrist centre is behind axis 1, 2 if it is behind the lower arm,
    /// and 1 if axis 5 is negative. `None` for arms other than those with a spherical wrist and
    /// axes 2 and 3 parallel.
    pub fn abb_configuration(&self, q: &[f64; 6], axes: &ControllerAxes) -> Option<([i32; 3], i32)> {
        let branch = self.branch(q);
        let cfx = 4 * i32::from(!branch.shoulder)
            + 2 * i32::from(!self.bent_forward(branch))
            + i32::from(wrapped(axes.axis(4, q)) < 0.0);
        self.is_industrial().then(|| ([0, 3, 5].map(|k| abb_quadrant(axes.axis(k, q))), cfx))
    }

    /// Whether joint values are on the selected branch, up to whole turns; where two branches meet
    /// they are on both.
    fn is_on(&self, q: &[f64; 6], selection: &Selection, axes: &ControllerAxes) -> bool {
        let [shoulder, elbow, wrist] = self.side_values(q);
        let fifth = wrapped(axes.axis(4, q)).sin();
        let agree = |wanted: Option<bool>, value: f64| {
            wanted.is_none_or(|wanted| value.abs() < BOUNDARY || wanted == (value >= 0.0))
        };
        // Bent forward means beyond the stretched arm, or before it if joint 3 has the opposite
        // sense.
        let bent = if self.sides.elbow_forward { elbow } else { -elbow };
        let up = if shoulder >= 0.0 { bent } else { -bent };
        let bits = |front: bool, ahead: bool, positive: bool| {
            self.is_industrial()
                && agree(Some(front), shoulder)
                && agree(Some(ahead), bent)
                && agree(Some(positive), fifth)
        };
        match *selection {
            Selection::Nearest => true,
            Selection::Branch(b) => {
                agree(Some(b.shoulder), shoulder) && agree(Some(b.elbow), elbow) && agree(Some(b.wrist), wrist)
            }
            Selection::Kuka { status: None, .. } => true,
            Selection::Kuka { status: Some(s), .. } => bits(s & 1 == 0, s & 2 != 0, s & 4 == 0),
            Selection::Abb { cfx, .. } => (0..8).contains(&cfx) && bits(cfx & 4 == 0, cfx & 2 == 0, cfx & 1 == 0),
            Selection::Words { front: None, elbow_up: None, wrist_flipped: None } => true,
            Selection::Words { front, elbow_up, wrist_flipped } => {
                self.is_industrial()
                    && agree(front, shoulder)
                    && agree(elbow_up, up)
                    && agree(wrist_flipped.map(|flipped| !flipped), fifth)
            }
        }
    }

    /// Returns the solution that matches the selection, including its turns, within the limits and
    /// closest to `near` (rad).
    ///
    /// Turn and quadrants refer to axis values including whole turns, so that an axis at 200
    /// degrees is not at -160. Programs have rounded numbers: an axis or a side within 1e-4 (rad;
    /// sine or fraction of the reach) of a change of a bit matches either value. If axis 5 is that
    /// close to straight, axes 4 and 6 are not checked, since only their sum is well determined.
    /// `None` if no solution of that branch is within the limits, or if the selection does not
    /// apply to this arm ([`Self::kuka_status`], [`Self::abb_configuration`]).
    pub fn choose(
        &self,
        solutions: &Solutions,
        selection: &Selection,
        axes: &ControllerAxes,
        near: &[f64; 6],
    ) -> Option<[f64; 6]> {
        let mut best: Option<(f64, [f64; 6])> = None;
        for solution in solutions.iter().filter(|s| self.is_on(&s.q, selection, axes)) {
            let straight = self.is_industrial() && self.side_values(&solution.q)[2].abs() < BOUNDARY;
            let fits = |k: usize, q: f64| {
                (straight && (k == 3 || k == 5)) || selection.allows(k, axes.sign[k] * q + axes.offset[k])
            };
            let Some(q) = self.nearest_copy(&solution.q, near, fits) else { continue };
            let distance = q.iter().zip(near).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            if best.is_none_or(|(d, _)| distance < d) {
                best = Some((distance, q));
            }
        }
        best.map(|(_, q)| q)
    }

    /// Returns the joint values shifted by whole turns so that they are within the limits and
    /// closest to `near` (rad).
    pub fn nearest_within_limits(&self, q: &[f64; 6], near: &[f64; 6]) -> Option<[f64; 6]> {
        self.nearest_copy(q, near, |_, _| true)
    }

    /// Calls `visit` with every copy of the joint values, shifted by whole turns, that is within
    /// the limits; a joint without limits has one copy, in (-π, π]. Joint values in rad.
    pub fn copies_within_limits(&self, q: &[f64; 6], mut visit: impl FnMut(&[f64; 6])) {
        let ranges: [_; 6] = std::array::from_fn(|k| self.turns(k, wrapped(q[k])));
        if ranges.iter().any(|(low, high)| low > high) {
            return;
        }
        let mut turns = ranges.map(|r| r.0);
        loop {
            visit(&std::array::from_fn(|k| wrapped(q[k]) + TAU * turns[k] as f64));
            let Some(k) = (0..6).find(|&k| turns[k] < ranges[k].1) else { return };
            turns[k] += 1;
            for (turn, range) in turns[..k].iter_mut().zip(&ranges) {
                *turn = range.0;
            }
        }
    }

    /// First and last number of whole turns that keep a joint within its limits.
    fn turns(&self, k: usize, q: f64) -> (i64, i64) {
        let (lower, upper) = self.limits[k];
        if !(lower.is_finite() && upper.is_finite()) {
            let inside = q >= lower - LIMIT_SLACK && q <= upper + LIMIT_SLACK;
            return if inside { (0, 0) } else { (0, -1) };
        }
        (((lower - LIMIT_SLACK - q) / TAU).ceil() as i64, ((upper + LIMIT_SLACK - q) / TAU).floor() as i64)
    }

    fn nearest_copy(&self, q: &[f64; 6], near: &[f64; 6], fits: impl Fn(usize, f64) -> bool) -> Option<[f64; 6]> {
        let mut nearest = [0.0; 6];
        for k in 0..6 {
            let (lower, upper) = self.limits[k];
            let middle = ((near[k] - q[k]) / TAU).round();
            // A matching copy may be several turns away; the search is limited to four.
            let copies = (-4..=4).map(|turn| q[k] + TAU * (middle + f64::from(turn)));
            let inside = copies.filter(|x| *x >= lower - LIMIT_SLACK && *x <= upper + LIMIT_SLACK && fits(k, *x));
            nearest[k] = inside.min_by(|a, b| (a - near[k]).abs().total_cmp(&(b - near[k]).abs()))?;
        }
        Some(nearest)
    }
}

/// Tolerance on joint limits, for rounding (rad).
const LIMIT_SLACK: f64 = 1e-12;

/// Sine of the angle between two bars about the joint axis `h` between them: the bar from axis
/// `first` to the elbow and the bar from there to the end.
fn bend(first: &Screw, elbow: &Vector3<f64>, end: &Vector3<f64>, h: &Vector3<f64>) -> f64 {
    let across = |v: Vector3<f64>| v - h * h.dot(&v);
    let (a, b) = (across(elbow - first.o), across(end - elbow));
    h.dot(&a.cross(&b)) / (a.norm() * b.norm()).max(f64::MIN_POSITIVE)
}

impl Solutions {
    /// Returns the solution closest to joint values (rad), up to whole turns.
    pub fn nearest(&self, q: &[f64; 6]) -> Option<&Solution> {
        let distance = |s: &Solution| s.q.iter().zip(q).map(|(a, b)| wrapped(a - b).powi(2)).sum::<f64>();
        self.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }
}
