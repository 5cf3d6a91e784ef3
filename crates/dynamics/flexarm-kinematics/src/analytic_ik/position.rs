//! Position problem of three joints: `E_1 E_2 E_3 c = p`.
//!
//! If two neighbouring axes intersect or are parallel, one equation contains a single angle and the
//! others follow in closed form (subproblems of Paden and Kahan, [Elias & Wen 2022]); otherwise the
//! angle of the third joint is a root of a quartic [Pieper 1968].
//!
//! Not here: orientation (`wrist`), polynomials (`trig`), arms with parallel axes 2 to 4
//! (`parallel`).

use nalgebra::Vector3;

use super::screw::Screw;
use super::trig::{List, TrigPolynomial, angle_about, dot_turned, linear};

/// Geometric property of the three axes that determines how the position problem is solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PositionForm {
    /// Second and third axis are parallel (nearly all industrial arms).
    Parallel23,
    /// First and second axis intersect.
    Intersecting12,
    /// Second and third axis intersect.
    Intersecting23,
    /// First and second axis are parallel.
    Parallel12,
    /// None of these: a quartic.
    General,
}

/// Joint angles (rad), and whether one of them is free.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ThreeAngles {
    pub(crate) q: [f64; 3],
    pub(crate) free: bool,
}

/// At most four solutions: roots of a quartic, or two times two roots.
pub(crate) type Threes = List<ThreeAngles, 8>;

/// Finds all angles with `E_1 E_2 E_3 c = p`; if there are none, angles that miss.
///
/// * `hint`: values used for free angles (rad).
/// * `reach`: length scale (m).
pub(crate) fn place(
    form: PositionForm,
    axes: &[Screw; 3],
    c: &Vector3<f64>,
    p: &Vector3<f64>,
    hint: &[f64; 3],
    reach: f64,
) -> Threes {
    let mut found = Threes::new(ThreeAngles { q: [0.0; 3], free: false });
    let forward = Task { axes: *axes, c: *c, p: *p, hint: *hint, reach };
    match form {
        PositionForm::Intersecting12 => forward.intersecting(&mut found),
        PositionForm::Parallel12 => forward.parallel(&mut found),
        PositionForm::General => forward.general(&mut found),
        PositionForm::Parallel23 => forward.reversed(&mut found, Task::parallel),
        PositionForm::Intersecting23 => forward.reversed(&mut found, Task::intersecting),
    }
    found
}

struct Task {
    axes: [Screw; 3],
    c: Vector3<f64>,
    p: Vector3<f64>,
    hint: [f64; 3],
    reach: f64,
}

/// Lengths below this fraction of the reach are rounding errors.
pub(crate) const ROUNDING: f64 = 1e-13;

impl Task {
    /// `E_3⁻¹ E_2⁻¹ E_1⁻¹ p = c`: the same problem from the other end.
    fn reversed(&self, found: &mut Threes, solve: impl Fn(&Task, &mut Threes)) {
        let [a, b, c] = &self.axes;
        let [h1, h2, h3] = self.hint;
        let axes = [c.reversed(), b.reversed(), a.reversed()];
        solve(&Task { axes, c: self.p, p: self.c, hint: [h3, h2, h1], reach: self.reach }, found);
        for three in found.as_mut_slice() {
            three.q.reverse();
        }
    }

    /// Axes 1 and 2 intersect at o: `|E_3 c - o| = |p - o|`, then
    /// `h_1 · R_2 (E_3 c - o) = h_1 · (p - o)`.
    fn intersecting(&self, found: &mut Threes) {
        let [s1, s2, s3] = &self.axes;
        let (p, v, d) = (self.p - s1.o, self.c - s3.o, s3.o - s1.o);
        let (k, a, b) = dot_turned(&d, &s3.h, &v);
        let distance = 0.5 * (p.norm_squared() - d.norm_squared() - v.norm_squared());
        let floor = ROUNDING * self.reach;
        let third = linear(a, b, distance - k, floor * self.reach, self.hint[2]);
        for &q3 in third.angles() {
            let w = s3.at(q3).point(&self.c) - s1.o;
            let (k, a, b) = dot_turned(&s1.h, &s2.h, &w);
            let second = linear(a, b, s1.h.dot(&p) - k, floor, self.hint[1]);
            for &q2 in second.angles() {
                let w = s2.at(q2).vector(&w);
                self.finish(&w, &p, q2, q3, third.free || second.free, found);
            }
        }
    }

    /// Axes 1 and 2 are parallel: `h_1 · E_3 c = h_1 · p`, then two bars in the normal plane.
    fn parallel(&self, found: &mut Threes) {
        let [s1, s2, s3] = &self.axes;
        let floor = ROUNDING * self.reach;
        let (k, a, b) = dot_turned(&s1.h, &s3.h, &(self.c - s3.o));
        let third = linear(a, b, s1.h.dot(&(self.p - s3.o)) - k, floor, self.hint[2]);
        for &q3 in third.angles() {
            let c = s3.at(q3).point(&self.c);
            for two in two_bars(s1, s2, &c, &self.p, [self.hint[0], self.hint[1]], self.reach).as_slice() {
                found.push(ThreeAngles { q: [two.q[0], two.q[1], q3], free: third.free || two.free });
            }
        }
    }

    /// Two equations linear in cosine and sine of the second angle; eliminating it gives a quartic
    /// in the third.
    ///
    /// With x along the common perpendicular of axes 1 and 2 (length a), y = h_2 × x and
    /// w = E_3 c - o_2:
    /// ```text
    /// X = x · R_2 w = (r² - a² - |w|²) / (2 a)
    /// Y = y · R_2 w = (z - (h_1·h_2) h_2·w) / (h_1·y),     X² + Y² = |w|² - (h_2·w)²
    /// ```
    fn general(&self, found: &mut Threes) {
        let [s1, s2, s3] = &self.axes;
        let (o1, o2) = feet(s1, s2);
        let a = (o2 - o1).norm();
        let x = (o2 - o1) / a;
        let y = s2.h.cross(&x);
        let (cosine, sine) = (s1.h.dot(&s2.h), s1.h.dot(&y));
        let v = self.c - s3.o;
        let along = s3.h * s3.h.dot(&v);
        let (w0, wc, ws) = (s3.o - o2 + along, v - along, s3.h.cross(&v));
        // |w|² and h_2·w as functions of the third angle.
        let square =
            TrigPolynomial::affine(w0.norm_squared() + wc.norm_squared(), 2.0 * w0.dot(&wc), 2.0 * w0.dot(&ws));
        let height = TrigPolynomial::affine(s2.h.dot(&w0), s2.h.dot(&wc), s2.h.dot(&ws));
        let (r, z) = (self.p - o1, s1.h.dot(&(self.p - o1)));
        let constant = |k| TrigPolynomial::affine(k, 0.0, 0.0);
        // X, Y and X² + Y² - |w|² + (h_2·w)² = 0.
        let X = constant((r.norm_squared() - a * a) / (2.0 * a)).plus(&square, -0.5 / a);
        let Y = constant(z / sine).plus(&height, -cosine / sine);
        let equation = X.times(&X).plus(&Y.times(&Y), 1.0).plus(&square, -1.0).plus(&height.times(&height), 1.0);
        for &q3 in equation.roots(1e-3).as_slice() {
            let w = s3.at(q3).point(&self.c) - o2;
            let (to_x, to_y) = (X.at(q3).0, Y.at(q3).0);
            let q2 = to_y.atan2(to_x) - w.dot(&y).atan2(w.dot(&x));
            let u = s2.at(q2).vector(&w) + (o2 - o1);
            self.finish(&u, &r, q2, q3, false, found);
        }
    }

    /// Appends a solution; the first angle rotates `w` onto `p`, both relative to a point of the
    /// first axis.
    fn finish(&self, w: &Vector3<f64>, p: &Vector3<f64>, q2: f64, q3: f64, free: bool, found: &mut Threes) {
        let (angle, size) = angle_about(&self.axes[0].h, w, p);
        let on_axis = size <= ROUNDING * self.reach;
        let q1 = if on_axis { self.hint[0] } else { angle };
        found.push(ThreeAngles { q: [q1, q2, q3], free: free || on_axis });
    }
}

/// Two angles (rad), and whether one of them is free.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TwoAngles {
    pub(crate) q: [f64; 2],
    pub(crate) free: bool,
}

/// Solves `E_a E_b c = p` in the plane normal to two parallel axes: both elbow configurations.
///
/// * `c_W`: point that the second axis carries, at zero angles; `p_W`: its target (m, world axes).
pub(crate) fn two_bars(
    first: &Screw,
    second: &Screw,
    c_W: &Vector3<f64>,
    p_W: &Vector3<f64>,
    hint: [f64; 2],
    reach: f64,
) -> List<TwoAngles, 2> {
    let mut found = List::new(TwoAngles { q: [0.0; 2], free: false });
    let flat = |v: Vector3<f64>| v - first.h * first.h.dot(&v);
    let (d, v, p) = (flat(second.o - first.o), flat(c_W - second.o), flat(p_W - first.o));
    let (k, a, b) = dot_turned(&d, &second.h, &v);
    let distance = 0.5 * (p.norm_squared() - d.norm_squared() - v.norm_squared());
    let roots = linear(a, b, distance - k, ROUNDING * reach * reach, hint[1]);
    for &qb in roots.angles() {
        let w = d + second.at(qb).vector(&v);
        let (angle, size) = angle_about(&first.h, &w, &p);
        let folded = size <= ROUNDING * reach;
        found.push(TwoAngles { q: [if folded { hint[0] } else { angle }, qb], free: roots.free || folded });
    }
    found
}

/// Whether two bars can reach a point; `c_W` and `p_W` as in [`two_bars`].
pub(crate) fn bars_reach(first: &Screw, second: &Screw, c_W: &Vector3<f64>, p_W: &Vector3<f64>) -> bool {
    let length = |v: Vector3<f64>| first.h.cross(&v).norm();
    let (d, v, p) = (length(second.o - first.o), length(c_W - second.o), length(p_W - first.o));
    (d - v).abs() <= p && p <= d + v
}

/// Ends of the common perpendicular of two non-parallel lines, the one on `a` first.
pub(crate) fn feet(a: &Screw, b: &Screw) -> (Vector3<f64>, Vector3<f64>) {
    let (d, k) = (b.o - a.o, a.h.dot(&b.h));
    let square = 1.0 - k * k;
    let s = (a.h.dot(&d) - k * b.h.dot(&d)) / square;
    let t = (k * a.h.dot(&d) - b.h.dot(&d)) / square;
    (a.o + a.h * s, b.o + b.h * t)
}
