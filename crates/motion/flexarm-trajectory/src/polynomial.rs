//! One polynomial piece of degree five, its derivatives, and its exact extrema.
//!
//! ```text
//! q(τ) = c0 + c1 τ + c2 τ² + c3 τ³ + c4 τ⁴ + c5 τ⁵,    0 <= τ <= width,   τ in s from the start of the piece
//! ```
//! Start at [`Piece::hermite`]; everything else evaluates. Extrema come from the real roots of the
//! next derivative, isolated between the roots of the derivative after that: there is no sampling,
//! and none is missed. Values are in rad or m. Not here: sequences of pieces (`curve`).

use std::ops::Deref;

/// Maximum distance of a joint from 0, rad or m: about a day's travel of a spindle.
pub(crate) const FARTHEST: f64 = 1e9;

/// Minimum and maximum of a quantity within a piece, as `(τ, value)`.
pub(crate) type Range = [(f64, f64); 2];

/// A polynomial of degree five on `0 <= τ <= width`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Length in s, positive.
    pub width: f64,
    /// Coefficients of `τ^k`, lowest first.
    pub c: [f64; 6],
}

impl Piece {
    /// A piece that stays at `q`.
    pub(crate) fn constant(width: f64, q: f64) -> Self {
        Self { width, c: [q, 0.0, 0.0, 0.0, 0.0, 0.0] }
    }

    /// Returns the quintic with position, velocity and acceleration (rad or m, s) at both ends.
    ///
    /// * `width`: s, positive.
    pub fn hermite(width: f64, [q0, v0, a0]: [f64; 3], [q1, v1, a1]: [f64; 3]) -> Self {
        let h = width;
        let step = q1 - q0;
        let c3 = (20.0 * step - (8.0 * v1 + 12.0 * v0) * h - (3.0 * a0 - a1) * h * h) / (2.0 * h.powi(3));
        let c4 = (-30.0 * step + (14.0 * v1 + 16.0 * v0) * h + (3.0 * a0 - 2.0 * a1) * h * h) / (2.0 * h.powi(4));
        let c5 = (12.0 * step - 6.0 * (v1 + v0) * h + (a1 - a0) * h * h) / (2.0 * h.powi(5));
        Self { width, c: [q0, v0, a0 / 2.0, c3, c4, c5] }
    }

    /// Returns position, velocity, acceleration and jerk at `tau` (s).
    pub fn at(&self, tau: f64) -> [f64; 4] {
        let [c0, c1, c2, c3, c4, c5] = self.c;
        [
            c0 + tau * (c1 + tau * (c2 + tau * (c3 + tau * (c4 + tau * c5)))),
            c1 + tau * (2.0 * c2 + tau * (3.0 * c3 + tau * (4.0 * c4 + tau * 5.0 * c5))),
            2.0 * c2 + tau * (6.0 * c3 + tau * (12.0 * c4 + tau * 20.0 * c5)),
            6.0 * c3 + tau * (24.0 * c4 + tau * 60.0 * c5),
        ]
    }

    /// `offset + factor * q(τ)`, with the time multiplied by `stretch`.
    pub(crate) fn mapped(&self, offset: f64, factor: f64, stretch: f64) -> Self {
        let mut c = self.c;
        let mut scale = factor;
        for coefficient in &mut c {
            *coefficient *= scale;
            scale /= stretch;
        }
        c[0] += offset;
        Self { width: self.width * stretch, c }
    }

    /// Whether the width is positive and finite, all coefficients are finite, and all values are
    /// within [`FARTHEST`] of 0.
    pub(crate) fn is_sound(&self) -> bool {
        let finite = self.width.is_finite() && self.c.iter().all(|c| c.is_finite());
        self.width > 0.0 && finite && self.c[0].abs() + self.excursion_bound() <= FARTHEST
    }

    /// Whether the value is constant.
    pub(crate) fn is_still(&self) -> bool {
        self.c[1..].iter().all(|c| *c == 0.0)
    }

    /// Upper bound on the distance from the starting value.
    pub(crate) fn excursion_bound(&self) -> f64 {
        (1..6).map(|k| self.c[k].abs() * self.width.powi(k as i32)).sum()
    }

    /// Returns minimum and maximum of derivative `order`, exact up to rounding.
    ///
    /// * `order`: 0 position, 1 velocity, 2 acceleration, 3 jerk.
    ///
    /// # Panics
    /// If `order` is greater than 3.
    pub fn range(&self, order: usize) -> Range {
        let value = |u: f64| self.at(u * self.width)[order];
        let (mut least, mut greatest) = ((0.0, value(0.0)), (0.0, value(0.0)));
        if self.is_still() {
            return [least, greatest];
        }
        let inner = roots_in_unit_interval(&self.derivative_in_u(order + 1));
        for u in inner.iter().copied().chain([1.0]) {
            let candidate = (u * self.width, value(u));
            if candidate.1 < least.1 {
                least = candidate;
            }
            if candidate.1 > greatest.1 {
                greatest = candidate;
            }
        }
        [least, greatest]
    }

    /// First `τ` at which derivative `order` equals `level`, if any.
    pub(crate) fn first_crossing(&self, order: usize, level: f64) -> Option<f64> {
        let mut p = self.derivative_in_u(order);
        // The derivative by u = τ / width is width^order times the derivative by τ.
        p.all[0] -= level * self.width.powi(order as i32);
        roots_in_unit_interval(&p).first().map(|u| u * self.width)
    }

    /// Coefficients of `d^order q / du^order` in `u = τ / width`, lowest first.
    fn derivative_in_u(&self, order: usize) -> Few {
        let mut p = Few::of((0..6).map(|k| self.c[k] * self.width.powi(k as i32)));
        for _ in 0..order {
            p = differentiate(&p);
        }
        p
    }
}

/// A few numbers without heap allocation: coefficients of a polynomial of degree at most five, or
/// its roots and the ends of their interval.
#[derive(Clone, Copy, Debug, Default)]
pub struct Few {
    all: [f64; 12],
    count: usize,
}

impl Few {
    fn of(numbers: impl IntoIterator<Item = f64>) -> Self {
        let mut few = Self::default();
        numbers.into_iter().for_each(|x| few.push(x));
        few
    }

    fn push(&mut self, x: f64) {
        self.all[self.count] = x;
        self.count += 1;
    }

    /// Adds a root unless it equals the last one.
    fn push_new(&mut self, root: f64) {
        if self.last() != Some(&root) {
            self.push(root);
        }
    }
}

impl Deref for Few {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.all[..self.count]
    }
}

fn differentiate(p: &[f64]) -> Few {
    Few::of(p.iter().enumerate().skip(1).map(|(k, c)| k as f64 * c))
}

fn evaluate(p: &[f64], u: f64) -> f64 {
    p.iter().rev().fold(0.0, |sum, c| sum * u + c)
}

/// The real roots in `0 <= u <= 1` at which `p` changes sign (or vanishes at an end), ascending.
///
/// Between neighbouring roots of `p'` the polynomial is monotone and has at most one root, so the
/// recursion over the derivatives finds all roots.
pub fn roots_in_unit_interval(p: &[f64]) -> Few {
    if p.len() < 2 {
        return Few::default();
    }
    let slope = differentiate(p);
    let inner = roots_in_unit_interval(&slope);
    let ends = Few::of([0.0].into_iter().chain(inner.iter().copied()).chain([1.0]));

    let mut roots = Few::default();
    for pair in ends.windows(2) {
        let (low, high) = (evaluate(p, pair[0]), evaluate(p, pair[1]));
        if low == 0.0 {
            roots.push_new(pair[0]);
        } else if low.signum() * high.signum() < 0.0 && high != 0.0 {
            roots.push_new(bracketed_root(p, &slope, pair[0], pair[1]));
        }
    }
    if evaluate(p, 1.0) == 0.0 {
        roots.push_new(1.0);
    }
    roots
}

/// Newton's method within a bracket with a change of sign; bisects where a Newton step leaves the
/// bracket.
fn bracketed_root(p: &[f64], slope: &[f64], mut low: f64, mut high: f64) -> f64 {
    let rising = evaluate(p, low) < 0.0;
    let mut u = 0.5 * (low + high);
    for _ in 0..80 {
        let value = evaluate(p, u);
        if value == 0.0 {
            return u;
        }
        if (value < 0.0) == rising {
            low = u;
        } else {
            high = u;
        }
        let newton = u - value / evaluate(slope, u);
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if (next - u).abs() <= 1e-16 {
            return next;
        }
        u = next;
    }
    u
}
