//! Cutter: teeth, engagement, and the force of a tooth on the tool per metre of depth and of chip
//! thickness.
//!
//! Axes: x along the feed (of the tool relative to the work), z along the tool from its tip to the
//! spindle, y completes them. The angle φ of a tooth runs from +y to +x (clockwise seen from the
//! spindle). With the lead angle κ of the edge (90 degrees for an end mill):
//!
//! ```text
//! n = (sin κ sin φ, sin κ cos φ, -cos κ)    chip thickness of a displacement u: nᵀ u
//! t = (cos φ, -sin φ, 0)                    a = (cos κ sin φ, cos κ cos φ, sin κ)
//! F = -(depth / sin κ) (K_t t + K_r n + K_a a) (nᵀ u)
//! ```
//! On a helical tooth the edge at height z lags by the angle `2 z tan(helix) / diameter`; the
//! integral over the depth is in closed form.
//!
//! Not here: times at which teeth enter and leave (`period.rs`), entries of tool files
//! (`tool_file.rs`).

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{Matrix3, Vector3};

use crate::milling::error::ChatterError;

/// Cutting coefficients (N/m²).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients {
    /// Along the cutting velocity.
    pub tangential: f64,
    /// Normal to the cut surface, towards the tool.
    pub radial: f64,
    /// Along the edge; with a lead angle of 90 degrees this force pulls the tool out of the
    /// spindle.
    pub axial: f64,
}

/// Range of angles in which a tooth cuts (rad).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Engagement {
    /// Entry angle, from -2π to 2π.
    pub entry: f64,
    /// Exit angle, above `entry` by at most 2π.
    pub exit: f64,
}

impl Engagement {
    /// Returns the engagement of up-milling: the chip thickness increases from zero. `immersion`:
    /// radial depth of cut over diameter, above 0 to 1.
    pub fn up(immersion: f64) -> Self {
        Self { entry: 0.0, exit: (1.0 - 2.0 * immersion).clamp(-1.0, 1.0).acos() }
    }

    /// Returns the engagement of down-milling: the chip thickness decreases to zero. `immersion` as
    /// in [`Engagement::up`].
    pub fn down(immersion: f64) -> Self {
        Self { entry: (2.0 * immersion - 1.0).clamp(-1.0, 1.0).acos(), exit: PI }
    }

    /// Returns the engagement of a slot of the width of the tool.
    pub fn slot() -> Self {
        Self { entry: 0.0, exit: PI }
    }

    /// Returns the engagement over the full turn.
    pub fn full() -> Self {
        Self { entry: 0.0, exit: TAU }
    }
}

/// Edges of the tool, and their engagement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cutter {
    /// Number of teeth, evenly spaced.
    pub teeth: usize,
    /// Diameter (m); it matters only with a helix.
    pub diameter: f64,
    /// Helix angle (rad), from 0 to below 1.5.
    pub helix: f64,
    /// Lead angle κ of the edge to the feed plane (rad), above 0 to π/2.
    pub lead: f64,
    /// Cutting coefficients.
    pub coefficients: Coefficients,
    /// Engagement.
    pub engagement: Engagement,
}

/// Force on the tool and chip thickness at one instant: `F = -push (thicknessᵀ u)`, as pairs of
/// columns.
#[derive(Clone, Debug, Default)]
pub(crate) struct Regeneration {
    pub(crate) pairs: Vec<(Vector3<f64>, Vector3<f64>)>,
}

impl Cutter {
    /// Returns an end mill with straight teeth.
    pub fn straight(teeth: usize, coefficients: Coefficients, engagement: Engagement) -> Self {
        Self { teeth, diameter: 1.0, helix: 0.0, lead: FRAC_PI_2, coefficients, engagement }
    }

    /// Checks the parameters.
    ///
    /// # Errors
    /// [`ChatterError::Invalid`] for invalid parameters.
    pub fn check(&self) -> Result<(), ChatterError> {
        let Engagement { entry, exit } = self.engagement;
        let Coefficients { tangential, radial, axial } = self.coefficients;
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let rules = [
            ("the number of teeth", self.teeth as f64, (1..=1000).contains(&self.teeth), "1 to 1000"),
            ("the diameter (m)", self.diameter, positive(self.diameter), "above 0"),
            ("the helix angle (rad)", self.helix, (0.0..1.5).contains(&self.helix), "0 to below 1.5"),
            (
                "the lead angle (rad)",
                self.lead,
                self.lead > 0.0 && self.lead <= FRAC_PI_2 + 1e-9,
                "above 0, at most pi/2",
            ),
            ("the tangential coefficient (N/m2)", tangential, positive(tangential), "above 0"),
            ("the radial coefficient (N/m2)", radial, radial.is_finite(), "a finite number"),
            ("the axial coefficient (N/m2)", axial, axial.is_finite(), "a finite number"),
            ("the entry angle (rad)", entry, (-TAU..=TAU).contains(&entry), "-2 pi to 2 pi"),
            (
                "the exit angle (rad)",
                exit,
                exit > entry && exit <= entry + TAU * (1.0 + 1e-12),
                "above the entry angle by at most 2 pi",
            ),
        ];
        match rules.into_iter().find(|rule| !rule.2) {
            Some((what, found, _, expected)) => Err(ChatterError::value(what, found, expected)),
            None => Ok(()),
        }
    }

    /// Returns the angle between teeth (rad).
    pub fn pitch(&self) -> f64 {
        TAU / self.teeth as f64
    }

    /// Returns the time between teeth (s) at a spindle speed in rad/s.
    pub fn tooth_period(&self, spindle: f64) -> f64 {
        self.pitch() / spindle
    }

    /// Returns the lag of the edge per height (rad/m).
    pub(crate) fn lag(&self) -> f64 {
        2.0 * self.helix.tan() / self.diameter
    }

    /// Whether the forces are proportional to the depth.
    pub(crate) fn is_straight(&self) -> bool {
        self.helix == 0.0
    }

    /// Returns the direction of the chip thickness.
    pub(crate) fn thickness(&self, phi: f64) -> Vector3<f64> {
        let (s, c) = phi.sin_cos();
        let (sk, ck) = self.lead.sin_cos();
        Vector3::new(sk * s, sk * c, if ck.abs() < 1e-12 { 0.0 } else { -ck })
    }

    /// Returns the negative force per depth and chip thickness (N/m²).
    pub(crate) fn push(&self, phi: f64) -> Vector3<f64> {
        let (s, c) = phi.sin_cos();
        let (sk, ck) = self.lead.sin_cos();
        let k = &self.coefficients;
        let t = Vector3::new(c, -s, 0.0);
        let a = Vector3::new(ck * s, ck * c, sk);
        (t * k.tangential + self.thickness(phi) * k.radial + a * k.axial) / sk
    }

    /// Returns the cutter angles within one pitch at which a tooth, at its tip or at this depth,
    /// enters or leaves the cut; ascending, with 0 and the pitch.
    pub(crate) fn events(&self, depth: f64) -> Vec<f64> {
        let pitch = self.pitch();
        let Engagement { entry, exit } = self.engagement;
        let mut events = vec![0.0, pitch];
        if exit - entry < TAU * (1.0 - 1e-12) {
            let lag = self.lag() * depth;
            let ends = if lag > 0.0 { vec![entry, exit, entry + lag, exit + lag] } else { vec![entry, exit] };
            events.extend(ends.into_iter().map(|x| x.rem_euclid(pitch)));
        }
        events.sort_by(f64::total_cmp);
        let tiny = 1e-9 * pitch;
        let mut kept: Vec<f64> = vec![0.0];
        for x in events {
            if x - kept[kept.len() - 1] > tiny && pitch - x > tiny {
                kept.push(x);
            }
        }
        kept.push(pitch);
        kept
    }

    /// Returns the force per displacement at the cutter angle `alpha` (of tooth 0 at the tip) and a
    /// depth.
    pub(crate) fn regeneration(&self, alpha: f64, depth: f64) -> Regeneration {
        let axes = if self.thickness(0.0).z == 0.0 { 2 } else { 3 };
        if self.is_straight() {
            let engaged: Vec<f64> =
                (0..self.teeth).map(|j| alpha + j as f64 * self.pitch()).filter(|phi| self.cuts(*phi)).collect();
            if engaged.len() <= axes {
                let pair = |phi: &f64| (self.push(*phi) * depth, self.thickness(*phi));
                return Regeneration { pairs: engaged.iter().map(pair).collect() };
            }
        }
        let H = self.force_matrix(alpha, depth);
        if H.amax() == 0.0 {
            return Regeneration::default();
        }
        let pair = |k: usize| (H.column(k).into_owned(), Vector3::ith(k, 1.0));
        Regeneration { pairs: (0..axes).map(pair).collect() }
    }

    /// Whether a tooth at this angle is engaged.
    pub(crate) fn cuts(&self, phi: f64) -> bool {
        let Engagement { entry, exit } = self.engagement;
        (phi - entry).rem_euclid(TAU) <= exit - entry
    }

    /// Returns `H` of `F = -H u` at a cutter angle and a depth, over all teeth and integrated over
    /// the depth (N/m), 3×3.
    pub fn force_matrix(&self, alpha: f64, depth: f64) -> Matrix3<f64> {
        let mut H = Matrix3::zeros();
        for j in 0..self.teeth {
            let phi = alpha + j as f64 * self.pitch();
            if self.is_straight() {
                if self.cuts(phi) {
                    H += self.push(phi) * self.thickness(phi).transpose() * depth;
                }
            } else {
                let lag = self.lag();
                H += self.swept(phi - lag * depth, phi) / lag;
            }
        }
        H
    }

    /// Returns the mean of `H` in `F = -H u` over a turn, per metre of depth (N/m²), 3×3. It does
    /// not depend on the helix.
    pub fn mean_force_matrix(&self) -> Matrix3<f64> {
        self.swept(self.engagement.entry, self.engagement.exit) * (self.teeth as f64 / TAU)
    }

    /// Integrates push times thickness over the engaged part of an interval of angles.
    fn swept(&self, from: f64, to: f64) -> Matrix3<f64> {
        let Engagement { entry, exit } = self.engagement;
        let mut H = Matrix3::zeros();
        let first = ((from - exit) / TAU).floor() as i64;
        let last = ((to - entry) / TAU).ceil() as i64;
        for turn in first..=last {
            let shift = TAU * turn as f64;
            let (low, high) = (from.max(entry + shift), to.min(exit + shift));
            if high > low {
                H += self.primitive(high) - self.primitive(low);
            }
        }
        H
    }

    /// Returns the antiderivative over φ of push times thickness.
    fn primitive(&self, phi: f64) -> Matrix3<f64> {
        // Both are e sin φ + f cos φ + g with constant vectors e, f, g.
        let split = |of: &dyn Fn(f64) -> Vector3<f64>| {
            let constant = (of(0.0) + of(PI)) * 0.5;
            (of(FRAC_PI_2) - constant, of(0.0) - constant, constant)
        };
        let (pe, pf, pg) = split(&|x| self.push(x));
        let (ne, nf, ng) = split(&|x| self.thickness(x));
        let (s, c) = phi.sin_cos();
        let (ss, cc, sc) = (phi / 2.0 - s * c / 2.0, phi / 2.0 + s * c / 2.0, s * s / 2.0);
        pe * ne.transpose() * ss
            + pf * nf.transpose() * cc
            + (pe * nf.transpose() + pf * ne.transpose()) * sc
            + (pe * ng.transpose() + pg * ne.transpose()) * -c
            + (pf * ng.transpose() + pg * nf.transpose()) * s
            + pg * ng.transpose() * phi
    }
}
