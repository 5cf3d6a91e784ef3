//! Elastic guide of a telescopic joint: one tube slides in another and tilts against it. The
//! shorter their overlap, the more it tilts.
//!
//! ```text
//! θ = C(l) M + g / (2 l) tanh((M - M_0) / w)      C(l) = c_0 + c_1 / l + c_2 / l²         (1)
//! l = l_0 + l' q                                                                           (2)
//! V = θ M - C M² / 2 - g w / (2 l) ln(cosh((M - M_0) / w) / cosh(M_0 / w))                 (3)
//! ```
//! θ is the tilt about one axis, M the bending moment at the middle of the overlap l, q the joint.
//! Two pads of stiffness k at the ends of the overlap have c_2 = 2/k; c_0 is the bending of the
//! tubes outside the overlap. g is the clearance of the pads: the inner tube tilts by g/l from one
//! side to the other as the moment passes M_0, over a width w of the moment.
//! M(θ) is the solution of (1), which is unique since θ rises with M.
//!
//! Not here: files, damping, friction.

/// Law of one axis of a guide; see the module documentation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guide {
    /// Actuated coordinate q on which the overlap depends.
    pub coordinate: usize,
    /// l_0 (m) and l' of equation (2).
    pub overlap: [f64; 2],
    /// c_0 (rad/(N m)), c_1 (rad/N) and c_2 (rad m/N).
    pub compliance: [f64; 3],
    /// Clearance between the tubes.
    pub play: Option<Play>,
}

/// Clearance of the pads of a guide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Play {
    /// Total clearance g at a pad (m).
    pub gap: f64,
    /// Moment M_0 at which the inner tube is in the middle (N m).
    pub centre: f64,
    /// Width w of the transition from one side to the other (N m).
    pub width: f64,
}

/// Unknown number of a guide's law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GuideTerm {
    /// c_0, c_1 or c_2.
    Compliance(usize),
    /// The clearance g.
    Gap,
    /// The moment M_0.
    Centre,
    /// The width w.
    Width,
}

/// Maximum number of iterations for the moment; halving the bracket alone needs 60.
const MAX_ITERATIONS: usize = 100;

impl GuideTerm {
    /// Whether the number is positive in every law.
    pub fn is_positive(self) -> bool {
        matches!(self, Self::Gap | Self::Width)
    }
}

impl Guide {
    /// Returns the overlap (m) with the joints at `q`.
    pub fn overlap(&self, q: &[f64]) -> f64 {
        self.overlap[0] + self.overlap[1] * q[self.coordinate]
    }

    /// Returns C (rad/(N m)) at an overlap.
    pub fn compliance(&self, overlap: f64) -> f64 {
        let [c0, c1, c2] = self.compliance;
        c0 + (c1 + c2 / overlap) / overlap
    }

    /// Returns the law with compliance and clearance divided by a factor on the stiffness.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self { compliance: self.compliance.map(|c| c / factor), ..*self }
    }

    /// Returns the law with one of its numbers changed.
    #[must_use]
    pub fn with(mut self, term: GuideTerm, change: f64) -> Self {
        match (term, &mut self.play) {
            (GuideTerm::Compliance(k), _) => self.compliance[k] += change,
            (GuideTerm::Gap, Some(play)) => play.gap += change,
            (GuideTerm::Centre, Some(play)) => play.centre += change,
            (GuideTerm::Width, Some(play)) => play.width += change,
            (_, None) => {}
        }
        self
    }

    /// Returns one of the numbers of the law; 0 for those of a missing play.
    pub fn number(&self, term: GuideTerm) -> f64 {
        let play = |of: fn(&Play) -> f64| self.play.as_ref().map_or(0.0, of);
        match term {
            GuideTerm::Compliance(k) => self.compliance[k],
            GuideTerm::Gap => play(|play| play.gap),
            GuideTerm::Centre => play(|play| play.centre),
            GuideTerm::Width => play(|play| play.width),
        }
    }

    /// Returns the tilt (rad) under a moment (N m), equation (1), and its derivative.
    pub fn tilt(&self, moment: f64, overlap: f64) -> [f64; 2] {
        let C = self.compliance(overlap);
        let Some(Play { gap, centre, width }) = self.play else { return [C * moment, C] };
        let (half, side) = (0.5 * gap / overlap, ((moment - centre) / width).tanh());
        [C * moment + half * side, C + half / width * (1.0 - side * side)]
    }

    /// Returns the moment (N m) at the tilt `theta` (rad) with the joints at `q`; NaN without
    /// overlap.
    pub fn torque(&self, theta: f64, q: &[f64]) -> f64 {
        let l = self.overlap(q);
        let C = self.compliance(l);
        if l.is_nan() || l <= 0.0 || C <= 0.0 {
            return f64::NAN;
        }
        let Some(play) = self.play else { return theta / C };
        let half = 0.5 * play.gap / l;
        let (mut low, mut high) = ((theta - half) / C, (theta + half) / C);
        let (mut moment, mut last) = (0.5 * (low + high), high - low);
        for _ in 0..MAX_ITERATIONS {
            let [found, slope] = self.tilt(moment, l);
            let off = found - theta;
            if off > 0.0 {
                high = moment
            } else {
                low = moment
            }
            let mut next = moment - off / slope;
            // Newton's steps may swing between the two sides of the transition.
            if !(next > low && next < high && (next - moment).abs() < 0.5 * last) {
                next = 0.5 * (low + high);
            }
            last = (next - moment).abs();
            moment = next;
            if last <= f64::EPSILON * (moment.abs() + play.width) {
                break;
            }
        }
        moment
    }

    /// Returns the stiffness dM/dθ (N m/rad) at a tilt.
    pub fn slope(&self, theta: f64, q: &[f64]) -> f64 {
        1.0 / self.tilt(self.torque(theta, q), self.overlap(q))[1]
    }

    /// Returns the elastic energy (J) at a tilt, equation (3).
    pub fn energy(&self, theta: f64, q: &[f64]) -> f64 {
        let (moment, l) = (self.torque(theta, q), self.overlap(q));
        theta * moment - 0.5 * self.compliance(l) * moment * moment - 0.5 / l * self.play_potential(moment)
    }

    /// Returns `g w ln(cosh((M - M_0)/w) / cosh(M_0/w))`.
    fn play_potential(&self, moment: f64) -> f64 {
        let Some(Play { gap, centre, width }) = self.play else { return 0.0 };
        let ln_cosh = |x: f64| x.abs() + (-2.0 * x.abs()).exp().ln_1p() - std::f64::consts::LN_2;
        gap * width * (ln_cosh((moment - centre) / width) - ln_cosh(centre / width))
    }

    /// Returns the force on the joint, dV/dq at constant tilt (N).
    pub fn reaction(&self, theta: f64, q: &[f64]) -> f64 {
        let (moment, l) = (self.torque(theta, q), self.overlap(q));
        let [_, c1, c2] = self.compliance;
        let by_overlap = (c1 + 2.0 * c2 / l) / (l * l);
        // The energy at constant tilt changes by minus the complementary energy at constant moment.
        self.overlap[1] * 0.5 * (by_overlap * moment * moment + self.play_potential(moment) / (l * l))
    }

    /// Returns the derivative of the moment at constant tilt with respect to a number of the law.
    pub fn torque_slope(&self, term: GuideTerm, theta: f64, q: &[f64]) -> f64 {
        let (moment, l) = (self.torque(theta, q), self.overlap(q));
        let by_moment = self.tilt(moment, l)[1];
        let Play { gap, centre, width } = self.play.unwrap_or(Play { gap: 0.0, centre: 0.0, width: 1.0 });
        let side = ((moment - centre) / width).tanh();
        let turn = -0.5 * gap / l * (1.0 - side * side) / width;
        let by_term = match term {
            GuideTerm::Compliance(k) => moment / l.powi(k as i32),
            GuideTerm::Gap => 0.5 / l * side,
            GuideTerm::Centre => turn,
            GuideTerm::Width => turn * (moment - centre) / width,
        };
        -by_term / by_moment
    }
}
