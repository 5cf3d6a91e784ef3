//! Arms with three successive parallel axes: projection onto their common direction leaves
//! equations in the other angles only. What remains is a planar problem of two bars ([`two_bars`]).
//!
//! World axes; `s_i` is the screw of joint i, `E_i` its motion and `R_i` its rotation, h the direction
//! of the three parallel axes, `G = X_WT X_WT(0)^-1`. Not here: which axes are parallel (`recognise`).

use std::f64::consts::FRAC_PI_4;

use flexarm_spatial::Pose;
use nalgebra::{Point3, Vector3};

use super::position::{ROUNDING, bars_reach, feet, two_bars};
use super::screw::Screw;
use super::trig::{CirclePlane, List, Roots, TrigPolynomial, across, angle_about, dot_turned, linear};
use super::{Candidates, Kind, STRAIGHT};

/// Axes 2, 3 and 4 are parallel (or, from the other end, 3, 4 and 5).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Parallel234 {
    pub(crate) axes: [Screw; 6],
    /// Closest points of axes 5 and 6 (m).
    pub(crate) near: (Vector3<f64>, Vector3<f64>),
    pub(crate) fan: CirclePlane,
    pub(crate) meet: bool,
    pub(crate) reach: f64,
}

/// Axes 1, 2 and 3 are parallel (or, from the other end, 4, 5 and 6).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Parallel123 {
    pub(crate) axes: [Screw; 6],
    pub(crate) near: (Vector3<f64>, Vector3<f64>),
    pub(crate) meet: bool,
    pub(crate) reach: f64,
}

/// Pairs of angles, each with a flag for a free angle.
type Pairs = List<(f64, f64, bool), 16>;

/// Candidates for the last angle. If its axis is along the parallel ones the angle is free, and the
/// first candidate is the angle closest to the hint, in steps of an eighth of a turn, at which the
/// bars reach.
fn sixth_angles(
    (angle, size): (f64, f64),
    hint: f64,
    group: usize,
    free: bool,
    reaches: impl Fn(f64) -> bool,
) -> List<(f64, Kind), 2> {
    let mut angles = List::new((0.0, Kind::Single { free }));
    if size < STRAIGHT {
        let near = [0, 1, -1, 2, -2, 3, -3, 4].map(|k| hint + FRAC_PI_4 * f64::from(k));
        let reachable = near.into_iter().find(|q6| reaches(*q6)).unwrap_or(hint);
        angles.push((reachable, Kind::Representative { group }));
        angles.push((angle, Kind::Member { group }));
    } else {
        angles.push((angle, Kind::Single { free }));
    }
    angles
}

/// Closest points of the last two axes; a common midpoint if they intersect.
fn near_points(axes: &[Screw; 6], meet: bool) -> (Vector3<f64>, Vector3<f64>) {
    let (o5, o6) = feet(&axes[4], &axes[5]);
    if meet { (0.5 * (o5 + o6), 0.5 * (o5 + o6)) } else { (o5, o6) }
}

impl Parallel234 {
    pub(crate) fn new(axes: [Screw; 6], meet: bool, reach: f64) -> Self {
        let fan = CirclePlane::new(&axes[1].h, &axes[4].h, &axes[5].h);
        Self { axes, near: near_points(&axes, meet), fan, meet, reach }
    }

    /// Finds all joint values with `E_1 ... E_6 = G`.
    ///
    /// With h the common direction and o_6 a point of axis 6, these components are not affected by
    /// the three parallel joints:
    /// ```text
    /// (i)   G_R h_6 · R_1 h = h · R_5 h_6            (ii)   (G o_6 - o_1) · R_1 h = h · (E_5 o_6 - o_1)
    /// ```
    /// Joint 6 then rotates `G_Rᵀ R_1 h` onto `R_5ᵀ h`, and a planar problem of two bars with a
    /// given end point remains.
    pub(crate) fn solve(&self, G: &Pose, hint: &[f64; 6], found: &mut Candidates) {
        let [s1, s2, s3, s4, s5, s6] = &self.axes;
        let h = s2.h;
        for (group, &(q1, q5, free)) in self.first_and_fifth(G, hint).as_slice().iter().enumerate() {
            let (t1, t5) = (s1.at(q1), s5.at(q5));
            // Joint 6 turns G_Rᵀ R_1 h onto R_5ᵀ h; the bars must reach its end point.
            let turned = angle_about(&s6.h, &(G.rotation.inverse() * t1.vector(&h)), &t5.inverse().vector(&h));
            let end = |q6: f64| {
                let end = G * Point3::from(s6.at(q6).inverse().point(&t5.inverse().point(&s4.o)));
                t1.inverse().point(&end.coords)
            };
            let sixth = sixth_angles(turned, hint[5], group, free, |q6| bars_reach(s2, s3, &s4.o, &end(q6)));
            for &(q6, kind) in sixth.as_slice() {
                // Sum of the angles of the parallel joints, then the angles of the two bars.
                let n = across(&h);
                let turned = G.rotation * s6.at(q6).inverse().vector(&t5.inverse().vector(&n));
                let (total, _) = angle_about(&h, &n, &t1.inverse().vector(&turned));
                for two in two_bars(s2, s3, &s4.o, &end(q6), [hint[1], hint[2]], self.reach).as_slice() {
                    let [q2, q3] = two.q;
                    let q4 = s4.h.dot(&h) * (total - q2 - s3.h.dot(&h) * q3);
                    found.add([q1, q2, q3, q4, q5, q6], kind.or_free(two.free));
                }
            }
        }
    }

    /// Angles of joints 1 and 5 from (i) and (ii), with whether one of them is free.
    fn first_and_fifth(&self, G: &Pose, hint: &[f64; 6]) -> Pairs {
        let [s1, s2, _, _, s5, s6] = &self.axes;
        let (h, (o5, o6)) = (s2.h, self.near);
        let tip = G.rotation * s6.h;
        let point = (G * Point3::from(o6)).coords - s1.o;
        let (k, a, b) = dot_turned(&point, &s1.h, &h);
        let mut pairs = Pairs::new((0.0, 0.0, false));
        if self.meet {
            let first = linear(a, b, h.dot(&(o5 - s1.o)) - k, ROUNDING * self.reach, hint[0]);
            for &q1 in first.angles() {
                for &q5 in self.fan.angles(&h, &s1.at(q1).inverse().vector(&tip)).angles() {
                    pairs.push((q1, q5, first.free));
                }
            }
            return pairs;
        }
        // a_i cos q1 + b_i sin q1 = k_i(q5), lengths relative to the reach.
        let (kt, at, bt) = dot_turned(&tip, &s1.h, &h);
        let (kr, ar, br) = dot_turned(&h, &s5.h, &s6.h);
        let (kp, ap, bp) = dot_turned(&h, &s5.h, &(o6 - o5));
        let l = 1.0 / self.reach;
        let rows = [
            (at, bt, TrigPolynomial::affine(kr - kt, ar, br)),
            (a * l, b * l, TrigPolynomial::affine((kp + h.dot(&(o5 - s1.o)) - k) * l, ap * l, bp * l)),
        ];
        pair_of_equations(&rows, hint, &mut pairs);
        pairs
    }
}

/// Solves `a_i cos t + b_i sin t = k_i(u)`, i = 1, 2, with k affine in cosine and sine of u, for
/// pairs (t, u).
fn pair_of_equations(rows: &[(f64, f64, TrigPolynomial); 2], hint: &[f64; 6], pairs: &mut Pairs) {
    let [(a1, b1, k1), (a2, b2, k2)] = rows;
    let d = a1 * b2 - a2 * b1;
    if d.abs() > 1e-6 {
        // Cramer's rule for the cosine and sine of t; cos² t + sin² t = 1 determines u.
        let zero = TrigPolynomial::affine(0.0, 0.0, 0.0);
        let cosine = zero.plus(k1, b2 / d).plus(k2, -b1 / d);
        let sine = zero.plus(k2, a1 / d).plus(k1, -a2 / d);
        let one = TrigPolynomial::affine(1.0, 0.0, 0.0);
        let equation = cosine.times(&cosine).plus(&sine.times(&sine), 1.0).plus(&one, -1.0);
        for &u in equation.roots(1e-3).as_slice() {
            pairs.push((sine.at(u).0.atan2(cosine.at(u).0), u, false));
        }
        return;
    }
    // The left-hand sides are proportional: eliminating t leaves an equation in u only.
    let (big, small) = if a1.hypot(*b1) >= a2.hypot(*b2) { (0, 1) } else { (1, 0) };
    let (a, b, k_big) = &rows[big];
    let size = a.hypot(*b).max(f64::MIN_POSITIVE);
    let factor = (rows[small].0 * a + rows[small].1 * b) / (size * size);
    let rest = rows[small].2.plus(k_big, -factor);
    let k = rest.at(0.0).0 + rest.at(std::f64::consts::PI).0;
    let (cosine, sine) = (rest.at(0.0).0 - 0.5 * k, rest.at(std::f64::consts::FRAC_PI_2).0 - 0.5 * k);
    let us = linear(cosine, sine, -0.5 * k, ROUNDING, hint[4]);
    for &u in us.angles() {
        let ts = linear(*a, *b, k_big.at(u).0, ROUNDING, hint[0]);
        for &t in ts.angles() {
            pairs.push((t, u, us.free || ts.free));
        }
    }
}

impl Parallel123 {
    pub(crate) fn new(axes: [Screw; 6], meet: bool, reach: f64) -> Self {
        Self { axes, near: near_points(&axes, meet), meet, reach }
    }

    /// Finds all joint values with `E_1 ... E_6 = G`.
    ///
    /// ```text
    /// (i)   h · R_4 R_5 h_6 = h · G_R h_6            (ii)   h · E_4 E_5 o_6 = h · G o_6
    /// ```
    /// Linear in cosine and sine of q_4 with coefficients affine in those of q_5: a polynomial of
    /// degree eight, or one equation after the other if axes 5 and 6 intersect. Joint 6 then
    /// rotates `G_Rᵀ h` onto `(R_4 R_5)ᵀ h`.
    pub(crate) fn solve(&self, G: &Pose, hint: &[f64; 6], found: &mut Candidates) {
        let [s1, s2, s3, s4, s5, s6] = &self.axes;
        let h = s1.h;
        for (group, &(q4, q5, free)) in self.fourth_and_fifth(G, hint).as_slice().iter().enumerate() {
            let (t4, t5) = (s4.at(q4).inverse(), s5.at(q5).inverse());
            let turned = angle_about(&s6.h, &(G.rotation.inverse() * h), &t5.vector(&t4.vector(&h)));
            let end = |q6: f64| (G * Point3::from(s6.at(q6).inverse().point(&t5.point(&t4.point(&s3.o))))).coords;
            let sixth = sixth_angles(turned, hint[5], group, free, |q6| bars_reach(s1, s2, &s3.o, &end(q6)));
            for &(q6, kind) in sixth.as_slice() {
                let n = across(&h);
                let turned = G.rotation * s6.at(q6).inverse().vector(&t5.vector(&t4.vector(&n)));
                let (total, _) = angle_about(&h, &n, &turned);
                for two in two_bars(s1, s2, &s3.o, &end(q6), [hint[0], hint[1]], self.reach).as_slice() {
                    let [q1, q2] = two.q;
                    let q3 = s3.h.dot(&h) * (total - q1 - s2.h.dot(&h) * q2);
                    found.add([q1, q2, q3, q4, q5, q6], kind.or_free(two.free));
                }
            }
        }
    }

    /// Angles of joints 4 and 5: the height of the tool point along h, and the component of `h_6`
    /// along h, are not affected by joints 1 to 3.
    fn fourth_and_fifth(&self, G: &Pose, hint: &[f64; 6]) -> Pairs {
        let [s1, _, _, s4, s5, s6] = &self.axes;
        let (h, (o5, o6)) = (s1.h, self.near);
        let (level, height) = (h.dot(&(G.rotation * s6.h)), h.dot(&((G * Point3::from(o6)).coords - s4.o)));
        let mut pairs = Pairs::new((0.0, 0.0, false));
        if self.meet {
            let (k, a, b) = dot_turned(&h, &s4.h, &(o6 - s4.o));
            let fourth = linear(a, b, height - k, ROUNDING * self.reach, hint[3]);
            for &q4 in fourth.angles() {
                let u = s4.at(q4).inverse().vector(&h);
                let (k, a, b) = dot_turned(&u, &s5.h, &s6.h);
                let fifth: Roots = linear(a, b, level - k, ROUNDING, hint[4]);
                for &q5 in fifth.angles() {
                    pairs.push((q4, q5, fourth.free || fifth.free));
                }
            }
            return pairs;
        }
        let l = 1.0 / self.reach;
        let rows =
            [self.row(&Vector3::zeros(), &s6.h, level), self.row(&((o5 - s4.o) * l), &((o6 - o5) * l), height * l)];
        // Cramer's rule for cos q4 = a/d and sin q4 = b/d; a² + b² = d² determines q5.
        let [(a1, b1, k1), (a2, b2, k2)] = &rows;
        let d = a1.times(b2).plus(&a2.times(b1), -1.0);
        let a = k1.times(b2).plus(&k2.times(b1), -1.0);
        let b = a1.times(k2).plus(&a2.times(k1), -1.0);
        let equation = a.times(&a).plus(&b.times(&b), 1.0).plus(&d.times(&d), -1.0);
        for &q5 in equation.roots(1e-3).as_slice() {
            let (a, b, d) = (a.at(q5).0, b.at(q5).0, d.at(q5).0);
            if d.abs() > 1e-6 {
                pairs.push(((b / d).atan2(a / d), q5, false));
                continue;
            }
            // The two rows are dependent: take both roots of one; one of them may not satisfy the
            // other.
            let at =
                |(a, b, k): &(TrigPolynomial, TrigPolynomial, TrigPolynomial)| (a.at(q5).0, b.at(q5).0, k.at(q5).0);
            let (first, second) = (at(&rows[0]), at(&rows[1]));
            let (a, b, k) = if first.0.hypot(first.1) >= second.0.hypot(second.1) { first } else { second };
            let fourth = linear(a, b, k, ROUNDING, hint[3]);
            for &q4 in fourth.angles() {
                pairs.push((q4, q5, fourth.free));
            }
        }
        pairs
    }

    /// `h · R_4 (c + R_5 v) = value` as `a cos q4 + b sin q4 = k`, with a, b and k affine in cosine
    /// and sine of q5.
    fn row(&self, c: &Vector3<f64>, v: &Vector3<f64>, value: f64) -> (TrigPolynomial, TrigPolynomial, TrigPolynomial) {
        let (h, h4, h5) = (self.axes[0].h, self.axes[3].h, self.axes[4].h);
        let along = h5 * h5.dot(v);
        let parts = [c + along, v - along, h5.cross(v)];
        let dot = |u: Vector3<f64>| TrigPolynomial::affine(u.dot(&parts[0]), u.dot(&parts[1]), u.dot(&parts[2]));
        let k = TrigPolynomial::affine(value, 0.0, 0.0).plus(&dot(h4), -h.dot(&h4));
        (dot(h - h4 * h4.dot(&h)), dot(h.cross(&h4)), k)
    }
}
