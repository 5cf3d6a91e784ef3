//! Equations in one angle, solved in closed form or by all roots of a polynomial.
//!
//! ```text
//! a cos t + b sin t = c                          two roots, or the angle of minimum residual
//! c_0 + 2 Re sum_k c_k e^{i k t} = 0             up to 2 n roots, as points on the unit circle
//! ```
//!
//! Not here: what the angles mean for an arm (`position`, `wrist`, `parallel`).

use nalgebra::{Complex, Vector3};

/// List of bounded length on the stack.
#[derive(Clone, Copy, Debug)]
pub struct List<T: Copy, const N: usize> {
    items: [T; N],
    n: usize,
}

impl<T: Copy, const N: usize> List<T, N> {
    /// An empty list.
    pub fn new(blank: T) -> Self {
        Self { items: [blank; N], n: 0 }
    }

    /// Adds an item; the maximum number of roots of each class bounds the length.
    pub(crate) fn push(&mut self, item: T) {
        assert!(self.n < N, "more roots than the equations can have");
        self.items[self.n] = item;
        self.n += 1;
    }

    /// The items.
    pub fn as_slice(&self) -> &[T] {
        &self.items[..self.n]
    }

    pub(crate) fn as_mut_slice(&mut self) -> &mut [T] {
        &mut self.items[..self.n]
    }

    pub(crate) fn clear(&mut self) {
        self.n = 0;
    }
}

/// Roots of an equation in one angle (rad).
#[derive(Clone, Copy, Debug)]
pub struct Roots {
    angles: [f64; 2],
    n: usize,
    /// Whether every angle is a root; the one given is then the hint.
    pub(crate) free: bool,
}

impl Roots {
    pub(crate) fn two(center: f64, half: f64) -> Self {
        Self { angles: [center + half, center - half], n: if half == 0.0 { 1 } else { 2 }, free: false }
    }

    /// The roots (rad).
    pub fn angles(&self) -> &[f64] {
        &self.angles[..self.n]
    }
}

/// Roots of `a cos t + b sin t = c`; if there are none, the single angle of minimum residual.
///
/// * `floor`: if `hypot(a, b)` does not exceed it, the angle is free and the hint is returned.
pub(crate) fn linear(a: f64, b: f64, c: f64, floor: f64, hint: f64) -> Roots {
    let size = a.hypot(b);
    if size <= floor {
        return Roots { angles: [hint; 2], n: 1, free: true };
    }
    let product = (size - c) * (size + c);
    let half = if product > 0.0 {
        product.sqrt().atan2(c)
    } else if c > 0.0 {
        0.0
    } else {
        std::f64::consts::PI
    };
    if half == std::f64::consts::PI {
        return Roots::two(b.atan2(a) + half, 0.0);
    }
    Roots::two(b.atan2(a), half)
}

/// Coefficients `(k, a, b)` of `u · R(h, t) v = k + a cos t + b sin t`; `u`, the unit axis `h` and
/// `v` in the same axes.
pub(crate) fn dot_turned(u: &Vector3<f64>, h: &Vector3<f64>, v: &Vector3<f64>) -> (f64, f64, f64) {
    let k = u.dot(h) * h.dot(v);
    (k, u.dot(v) - k, u.dot(&h.cross(v)))
}

/// Angle about the unit axis `h`, in the axes of `a` and `b`, that rotates the part of `a` normal to
/// `h` onto that of `b`, and the smaller of the lengths of these parts.
pub(crate) fn angle_about(h: &Vector3<f64>, a: &Vector3<f64>, b: &Vector3<f64>) -> (f64, f64) {
    let (a, b) = (a - h * h.dot(a), b - h * h.dot(b));
    (h.dot(&a.cross(&b)).atan2(a.dot(&b)), a.norm().min(b.norm()))
}

/// Unit vector normal to `h`, in its axes.
pub(crate) fn across(h: &Vector3<f64>) -> Vector3<f64> {
    let e = Vector3::ith(h.iamin(), 1.0);
    (e - h * h.dot(&e)).normalize()
}

/// Solves `u · R(h, t) w = u · v` for the angle t, without cancellation near the ends of the range:
/// the circle of the turned w meets a plane normal to u (subproblem 4 of [Elias & Wen 2022]).
///
/// ```text
/// u · R(h, t) w = a + b cos(t - phi),     t = phi ± d,     tan²(d/2) = (a + b - u·v) / (u·v - a + b)
/// ```
/// If the range ends at ±1 (`w` can be rotated onto `u`, as in a straight wrist), `1 - u·v` is
/// computed as `|u - v|²/2`.
#[derive(Clone, Copy, Debug)]
pub struct CirclePlane {
    pub(crate) phi: f64,
    a: f64,
    b: f64,
}

impl CirclePlane {
    /// Prepares the equation for u, the unit axis h and w, in the same axes.
    pub fn new(u: &Vector3<f64>, h: &Vector3<f64>, w: &Vector3<f64>) -> Self {
        let (a, cosine, sine) = dot_turned(u, h, w);
        Self { phi: sine.atan2(cosine), a, b: cosine.hypot(sine) }
    }

    /// The angles t for `v`, in the axes of `u`.
    pub fn angles(&self, u: &Vector3<f64>, v: &Vector3<f64>) -> Roots {
        const UNIT: f64 = 1e-14;
        let cosine = u.dot(v);
        let (top, bottom) = (self.a + self.b, self.a - self.b);
        let below = if (top - 1.0).abs() < UNIT { 0.5 * (u - v).norm_squared() } else { (top - cosine).max(0.0) };
        let above = if (bottom + 1.0).abs() < UNIT { 0.5 * (u + v).norm_squared() } else { (cosine - bottom).max(0.0) };
        let half = 2.0 * below.sqrt().atan2(above.sqrt());
        match half == std::f64::consts::PI {
            true => Roots::two(self.phi + half, 0.0),
            false => Roots::two(self.phi, half),
        }
    }
}

/// Maximum degree of a [`TrigPolynomial`].
const MAX: usize = 4;

/// `c_0 + 2 Re sum_k c_k e^{i k t}` of degree at most four; `c_0` is real.
#[derive(Clone, Copy, Debug)]
pub struct TrigPolynomial {
    c: [Complex<f64>; MAX + 1],
    degree: usize,
}

impl TrigPolynomial {
    /// `k + a cos t + b sin t`.
    pub fn affine(k: f64, a: f64, b: f64) -> Self {
        let mut c = [Complex::new(0.0, 0.0); MAX + 1];
        c[0].re = k;
        c[1] = Complex::new(0.5 * a, -0.5 * b);
        Self { c, degree: 1 }
    }

    fn coefficient(&self, k: isize) -> Complex<f64> {
        let c = self.c[k.unsigned_abs()];
        if k < 0 { c.conj() } else { c }
    }

    /// Product; its degree, at most four, is the sum of the two degrees.
    pub fn times(&self, other: &Self) -> Self {
        let degree = self.degree + other.degree;
        let (n, m) = (self.degree as isize, other.degree as isize);
        let mut c = [Complex::new(0.0, 0.0); MAX + 1];
        for (k, c) in c.iter_mut().enumerate().take(degree + 1) {
            let k = k as isize;
            for j in (k - m).max(-n)..=n.min(k + m) {
                *c += self.coefficient(j) * other.coefficient(k - j);
            }
        }
        Self { c, degree }
    }

    pub(crate) fn plus(&self, other: &Self, factor: f64) -> Self {
        let mut sum = *self;
        sum.degree = self.degree.max(other.degree);
        for (c, o) in sum.c.iter_mut().zip(&other.c) {
            *c += o * factor;
        }
        sum
    }

    /// Value and derivative.
    pub(crate) fn at(&self, t: f64) -> (f64, f64) {
        let turn = Complex::new(t.cos(), t.sin());
        let (mut value, mut slope, mut power) = (self.c[0].re, 0.0, turn);
        for k in 1..=self.degree {
            let term = self.c[k] * power;
            value += 2.0 * term.re;
            slope -= 2.0 * k as f64 * term.im;
            power *= turn;
        }
        (value, slope)
    }

    /// Refined angles of all roots within `width` of the unit circle; if there is none, the angles
    /// of all roots, which are then not solutions.
    ///
    /// The polynomial `z^n f(z)` of degree 2n is solved by Aberth's simultaneous iteration.
    pub fn roots(&self, width: f64) -> List<f64, { 2 * MAX }> {
        let mut angles = List::new(0.0);
        let largest = self.c.iter().fold(0.0_f64, |m, c| m.max(c.norm()));
        let mut degree = self.degree;
        while degree > 0 && self.c[degree].norm() <= 1e-14 * largest {
            degree -= 1;
        }
        if degree == 0 {
            return angles;
        }
        let z = self.aberth(degree);
        let z = &z[..2 * degree];
        for only_near in [true, false] {
            for z in z.iter().filter(|z| !only_near || (z.norm() - 1.0).abs() < width) {
                angles.push(self.refined(z.arg()));
            }
            if !angles.as_slice().is_empty() {
                break;
            }
        }
        angles
    }

    /// Complex roots of `z^n f(z)`.
    fn aberth(&self, degree: usize) -> [Complex<f64>; 2 * MAX] {
        let n = 2 * degree;
        let mut z = [Complex::new(0.0, 0.0); 2 * MAX];
        for (j, z) in z.iter_mut().enumerate().take(n) {
            // Start values off the circle and irregular: values on the circle, or mirrored in it,
            // would remain so.
            let angle = 0.4 + std::f64::consts::TAU * j as f64 / n as f64;
            *z = Complex::from_polar(0.8 + 0.13 * ((j * 5) % n) as f64 / n as f64, angle);
        }
        for _ in 0..80 {
            let mut largest = 0.0_f64;
            for j in 0..n {
                let (mut p, mut slope) = (Complex::new(0.0, 0.0), Complex::new(0.0, 0.0));
                for k in (0..=n).rev() {
                    slope = slope * z[j] + p;
                    p = p * z[j] + self.coefficient(k as isize - degree as isize);
                }
                if p == Complex::new(0.0, 0.0) {
                    continue;
                }
                let repulsion: Complex<f64> =
                    (0..n).filter(|&i| i != j && z[i] != z[j]).map(|i| (z[j] - z[i]).inv()).sum();
                let step = (slope / p - repulsion).inv();
                if step.re.is_finite() && step.im.is_finite() {
                    z[j] -= step;
                    largest = largest.max(step.norm() / z[j].norm().max(1e-3));
                }
            }
            if largest < 1e-13 {
                break;
            }
        }
        z
    }

    /// Newton's method from an angle near a root; rejects large steps, as at a double root.
    fn refined(&self, start: f64) -> f64 {
        let mut t = start;
        let mut value = self.at(t);
        for _ in 0..3 {
            let trial = t - value.0 / value.1;
            let next = self.at(trial);
            let better = (trial - start).abs() < 1e-3 && next.0.abs() < value.0.abs();
            if !better {
                break;
            }
            (t, value) = (trial, next);
        }
        t
    }
}
