//! Eigenvalues of small symmetric matrices in storage of the caller, without allocation.
//!
//! Householder reduction to tridiagonal form ([Golub and Van Loan 2013], 8.3), then QL steps with
//! squared rotations, as in LAPACK's `dsterf`: two independent divisions instead of a root followed
//! by a division. Computes eigenvalues only; absolute errors are a few units in the last place of
//! the largest one. For eigenvectors use nalgebra. Works on one matrix or on several in SIMD lanes;
//! the result of a lane is bitwise that of its matrix by itself.
//!
//! Not here: the products of vectors (`dense`).

use flexarm_kinematics::Real;

use crate::dense::{dot, larger};

/// Maximum number of QL steps per eigenvalue; two are typical.
const MAX_STEPS: usize = 60;

/// Lower bound of squares used as divisors; the matrix is scaled to about one.
const SMALLEST: f64 = 1e-280;

/// Writes the eigenvalues of the symmetric matrix `A` (n×n, column-major, lower triangle read,
/// destroyed), unsorted, into `d` (n).
///
/// * `e`: n numbers of workspace.
///
/// Returns 1 on convergence, else 0, as with NaN or infinite entries.
#[inline(always)]
pub fn symmetric_eigenvalues<T: Real>(A: &mut [T], d: &mut [T], e: &mut [T]) -> T {
    tridiagonalise(A, d, e);
    // Scale to about one, so that squares neither overflow nor underflow.
    let (mut largest, mut broken) = (T::zero(), T::zero());
    for x in d.iter().chain(e.iter()) {
        largest = larger(largest, x.abs());
        broken += *x * T::zero();
    }
    let usual = largest.pick_below(T::splat(f64::INFINITY), largest, T::one());
    let scale = T::zero().pick_below(largest, usual, T::one());
    for (d, e) in d.iter_mut().zip(e.iter_mut()) {
        *d /= scale;
        let ratio = *e / scale;
        // Without finite entries there is nothing to iterate.
        *e = broken.pick_below(T::one(), ratio * ratio, T::zero());
    }
    let ended = ql(d, e);
    for x in d.iter_mut() {
        *x *= scale;
    }
    broken.pick_below(T::one(), ended, T::zero())
}

/// Reduces `A`: diagonal into `d`, subdiagonal into `e[..n-1]`, `e[n-1] = 0`.
#[inline(always)]
fn tridiagonalise<T: Real>(A: &mut [T], d: &mut [T], e: &mut [T]) {
    let n = d.len();
    for k in 0..n.saturating_sub(2) {
        let (inward, B) = A.split_at_mut((k + 1) * n);
        let (v, w) = (&mut inward[k * n + k + 1..], &mut e[k + 1..]);
        // v = x - α e_1 below the diagonal of column k; H = 1 - 2 v vᵀ / vᵀv maps it to (α, 0, 0,
        // ...).
        let (norm, first) = (dot(v, v).sqrt(), v[0]);
        let alpha = first.pick_below(T::zero(), norm, -norm);
        v[0] -= alpha;
        // A zero column stays as it is: v is zero then.
        let half = norm * (norm + first.abs());
        let half = T::zero().pick_below(norm, half, T::one());
        // p = B v / (vᵀv / 2);  w = p - v (pᵀv) / vᵀv;  B -= v wᵀ + w vᵀ
        multiply(B, k + 1, v, w);
        let inverse = T::one() / half;
        for w in w.iter_mut() {
            *w *= inverse;
        }
        let along = dot(w, v) * inverse * T::splat(0.5);
        for (w, v) in w.iter_mut().zip(v.iter()) {
            *w -= *v * along;
        }
        for (j, column) in B.chunks_exact_mut(n).enumerate() {
            let (v_j, w_j) = (v[j], w[j]);
            for ((to, v), w) in column[k + 1 + j..].iter_mut().zip(&v[j..]).zip(&w[j..]) {
                *to -= *v * w_j + *w * v_j;
            }
        }
        v[0] = alpha;
    }
    for i in 0..n {
        d[i] = A[i * n + i];
        e[i] = if i + 1 < n { A[i * n + i + 1] } else { T::zero() };
    }
}

/// Computes `w = B v` with the lower triangle of a symmetric B whose columns begin with `above`
/// unused entries.
#[inline(always)]
fn multiply<T: Real>(B: &[T], above: usize, v: &[T], w: &mut [T]) {
    w.fill(T::zero());
    for (j, column) in B.chunks_exact(above + v.len()).enumerate() {
        let (column, v_j) = (&column[above + j..], v[j]);
        w[j] += column[0] * v_j + dot(&column[1..], &v[j + 1..]);
        for (w, b) in w[j + 1..].iter_mut().zip(&column[1..]) {
            *w += *b * v_j;
        }
    }
}

/// Computes the eigenvalues of a tridiagonal matrix, with squared subdiagonal in `e`, in place of
/// its diagonal `d`; returns 1 on convergence, else 0.
///
/// All lanes work on the same eigenvalue: a lane that has converged waits for the others.
#[inline(always)]
fn ql<T: Real>(d: &mut [T], e: &mut [T]) -> T {
    let n = d.len();
    let mut ended = T::one();
    for l in 0..n {
        for step in 0.. {
            let block = Block::new(d, e, l);
            if !block.end.any_above(l as f64) {
                break;
            }
            if step == MAX_STEPS {
                ended = T::splat(l as f64).pick_below(block.end, T::zero(), ended);
                break;
            }
            sweep(d, e, l, &block);
        }
    }
    ended
}

/// Leading unreduced block that starts at row l.
struct Block<T> {
    /// Last row of the block in each lane, as a number, and its diagonal entry.
    end: T,
    d_end: T,
    /// Maximum of the last rows.
    last: usize,
    /// Whether the last row is the same in all lanes.
    alike: bool,
}

impl<T: Real> Block<T> {
    #[inline(always)]
    fn new(d: &[T], e: &[T], l: usize) -> Self {
        let last = d.len() - 1;
        let none = T::splat(d.len() as f64);
        let (mut end, mut d_end) = (none, d[last]);
        let mut row = l;
        while row < last {
            let bound = T::splat(f64::EPSILON) * (d[row].abs() + d[row + 1].abs());
            let small = (bound * bound).pick_below(e[row], T::zero(), T::one());
            // First row with a negligible subdiagonal entry.
            let here = end.pick_below(none, T::zero(), small);
            end = T::splat(0.5).pick_below(here, T::splat(row as f64), end);
            d_end = T::splat(0.5).pick_below(here, d[row], d_end);
            if end.all_below(d.len() as f64) {
                break;
            }
            row += 1;
        }
        end = end.pick_below(none, end, T::splat(last as f64));
        Self { end, d_end, last: row, alike: !end.any_below(row as f64) }
    }
}

/// Applies a QL step with Wilkinson's shift σ to the rows from l to the end of a block, from the
/// bottom up. Only the squares of the rotations by c and s are needed:
///
/// ```text
/// r = p + e²,   c² = p/r,   s² = e²/r,   γ' = c² (d - σ) - s² γ,   p' = γ'²/c²
/// ```
#[inline(always)]
fn sweep<T: Real>(d: &mut [T], e: &mut [T], l: usize, block: &Block<T>) {
    let (zero, one, two, half) = (T::zero(), T::one(), T::splat(2.0), T::splat(0.5));
    let root = e[l].sqrt();
    let g = (d[l + 1] - d[l]) / (two * root);
    let away = (g * g + one).sqrt();
    let shift = d[l] - root / (g + g.pick_below(zero, -away, away));
    let (mut c, mut s, mut gamma) = (one, zero, block.d_end - shift);
    let mut p = gamma * gamma;
    for i in (l..block.last).rev() {
        let (a, b) = (d[i], e[i]);
        let r = p + b;
        let (c_new, s_new, inverse) = (p / r, b / r, r / p);
        let gamma_new = c_new * (a - shift) - s_new * gamma;
        // γ is nearly zero if p is.
        let p_new = T::splat(SMALLEST).pick_below(p, gamma_new * gamma_new * inverse, c * b);
        // In the first rotation s is zero, because the block ends there.
        let (above, below) = (s * r, gamma + (a - gamma_new));
        if block.alike {
            (e[i + 1], d[i + 1]) = (above, below);
            (c, s, gamma, p) = (c_new, s_new, gamma_new, p_new);
            continue;
        }
        let on = T::splat(i as f64).pick_below(block.end, one, zero);
        e[i + 1] = half.pick_below(on, above, e[i + 1]);
        d[i + 1] = half.pick_below(on, below, d[i + 1]);
        c = half.pick_below(on, c_new, c);
        s = half.pick_below(on, s_new, s);
        gamma = half.pick_below(on, gamma_new, gamma);
        p = half.pick_below(on, p_new, p);
    }
    // Lanes whose block is a single row are unchanged.
    let row = T::splat(l as f64);
    d[l] = row.pick_below(block.end, shift + gamma, d[l]);
    e[l] = row.pick_below(block.end, s * p, e[l]);
}
