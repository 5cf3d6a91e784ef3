//! The same for the usual numbers of coordinates, one, two or three springs of six: loops of a length that the compiler knows take a
//! third of the instructions, and give the same bits.

use flexarm_kinematics::Real;

/// Columns of an N × N matrix, if it is one.
#[inline(always)]
fn columns<T, const N: usize>(A: &[T]) -> Option<&[[T; N]; N]> {
    A.as_chunks::<N>().0.try_into().ok()
}

/// The same, to be changed.
#[inline(always)]
fn columns_mut<T, const N: usize>(A: &mut [T]) -> Option<&mut [[T; N]; N]> {
    A.as_chunks_mut::<N>().0.try_into().ok()
}

/// `y = A x`; false where the size is another one.
#[inline(always)]
pub(super) fn product<T: Real>(A: &[T], x: &[T], y: &mut [T]) -> bool {
    match y.len() {
        6 => rows::<T, 6, 6>(A, x, 0, y),
        12 => rows::<T, 12, 12>(A, x, 0, y),
        18 => rows::<T, 18, 12>(A, x, 0, y) && rows::<T, 18, 6>(A, x, 12, y),
        _ => false,
    }
}

/// R rows of `y = A x` from the first one on, whose sums are in registers.
#[inline(always)]
fn rows<T: Real, const N: usize, const R: usize>(A: &[T], x: &[T], first: usize, y: &mut [T]) -> bool {
    let (Some(A), Some(x)) = (columns::<T, N>(A), x.first_chunk::<N>()) else { return false };
    let mut sums = [T::zero(); R];
    for r in 0..R {
        sums[r] = A[0][first + r] * x[0];
    }
    for k in 1..N {
        for r in 0..R {
            sums[r] = A[k][first + r] * x[k] + sums[r];
        }
    }
    y[first..first + R].copy_from_slice(&sums);
    true
}

/// `y += A x` of a spring of six coordinates; false where the size is another one.
#[inline(always)]
pub(super) fn add_product<T: Real>(A: &[T], x: &[T], y: &mut [T]) -> bool {
    let (Some(A), Some(x), Ok(y)) = (columns::<T, 6>(A), x.first_chunk::<6>(), <&mut [T; 6]>::try_from(y)) else {
        return false;
    };
    let mut sums = *y;
    for k in 0..6 {
        for r in 0..6 {
            sums[r] = A[k][r] * x[k] + sums[r];
        }
    }
    *y = sums;
    true
}

/// `A ← A + B`, then `y = A x`; false where the size is another one.
#[inline(always)]
pub(super) fn change_and_product<T: Real>(A: &mut [T], B: &[T], x: &[T], y: &mut [T]) -> bool {
    match y.len() {
        6 => changed_rows::<T, 6, 6>(A, B, x, 0, y),
        12 => changed_rows::<T, 12, 12>(A, B, x, 0, y),
        18 => changed_rows::<T, 18, 12>(A, B, x, 0, y) && changed_rows::<T, 18, 6>(A, B, x, 12, y),
        _ => false,
    }
}

/// R rows of [`change_and_product`] from the first one on.
#[inline(always)]
fn changed_rows<T: Real, const N: usize, const R: usize>(
    A: &mut [T],
    B: &[T],
    x: &[T],
    first: usize,
    y: &mut [T],
) -> bool {
    let (Some(A), Some(B), Some(x)) = (columns_mut::<T, N>(A), columns::<T, N>(B), x.first_chunk::<N>()) else {
        return false;
    };
    let mut sums = [T::zero(); R];
    for r in 0..R {
        A[0][first + r] += B[0][first + r];
        sums[r] = A[0][first + r] * x[0];
    }
    for k in 1..N {
        for r in 0..R {
            A[k][first + r] += B[k][first + r];
            sums[r] = A[k][first + r] * x[k] + sums[r];
        }
    }
    y[first..first + R].copy_from_slice(&sums);
    true
}

/// `to += factor from`.
#[inline(always)]
fn add<const N: usize>(to: &mut [f64; N], factor: f64, from: &[f64; N]) {
    for r in 0..N {
        to[r] += from[r] * factor;
    }
}

/// As `solve_in_place`: A becomes its factor in the lower triangle, and anything above it.
#[inline(always)]
pub(super) fn solve<const N: usize>(A: &mut [f64], Bt: &mut [f64]) -> bool {
    let (Some(A), Some(Bt)) = (columns_mut::<f64, N>(A), columns_mut::<f64, N>(Bt)) else { return false };
    let mut positive = true;
    for j in 0..N {
        let mut column = A[j];
        for inward in &A[..j] {
            add(&mut column, -inward[j], inward);
        }
        positive &= column[j] > 0.0;
        let denominator = column[j].sqrt();
        for entry in &mut column {
            *entry /= denominator;
        }
        column[j] = denominator;
        A[j] = column;
    }
    // B is kept transposed: elimination goes over whole columns.
    for k in 0..N {
        let mut column = Bt[k];
        for j in 0..k {
            add(&mut column, -A[j][k], &Bt[j]);
        }
        let inverse = 1.0 / A[k][k];
        column.iter_mut().for_each(|entry| *entry *= inverse);
        Bt[k] = column;
    }
    for k in (0..N).rev() {
        let mut column = Bt[k];
        for j in k + 1..N {
            add(&mut column, -A[k][j], &Bt[j]);
        }
        let inverse = 1.0 / A[k][k];
        column.iter_mut().for_each(|entry| *entry *= inverse);
        Bt[k] = column;
    }
    transpose(Bt);
    positive
}

/// As `congruence`.
#[inline(always)]
pub(super) fn congruence<const N: usize>(c: f64, X: &[f64], C: &[f64], room: [&mut [f64]; 2], product: &mut [f64]) {
    let [P, Xt] = room.map(columns_mut::<f64, N>);
    let (Some(X), Some(C), Some(P), Some(Xt)) = (columns::<f64, N>(X), columns::<f64, N>(C), P, Xt) else { return };
    let Some(product) = columns_mut::<f64, N>(product) else { return };
    // P = C Sᵀ
    for j in 0..N {
        let mut column = C[j];
        for k in 0..N {
            add(&mut column, c * X[j][k], &C[k]);
        }
        P[j] = column;
    }
    // P + c Xᵀ P
    *Xt = *X;
    transpose(Xt);
    for j in 0..N {
        let mut column = P[j];
        for k in 0..N {
            add(&mut column, c * P[j][k], &Xt[k]);
        }
        product[j] = column;
    }
}

#[inline(always)]
fn transpose<const N: usize>(A: &mut [[f64; N]; N]) {
    let columns = *A;
    for (j, row) in A.iter_mut().enumerate() {
        for (entry, column) in row.iter_mut().zip(&columns) {
            *entry = column[j];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dense;

    /// Truth: the loops over slices; the same bits.
    #[test]
    fn known_sizes_have_the_bits_of_any_size() {
        fn of<const N: usize>() {
            let matrix = |seed: f64| -> Vec<f64> { (0..N * N).map(|k| (k as f64 * seed).sin()).collect() };
            let (B, X) = (matrix(0.731), matrix(1.13));
            let mut A = vec![0.0; N * N];
            for i in 0..N {
                for j in 0..N {
                    let own = if i == j { 1.0 } else { 0.0 };
                    A[j * N + i] = own + (0..N).map(|k| B[k * N + i] * B[k * N + j]).sum::<f64>();
                }
            }
            let [mut sized_A, mut sized_X, mut any_A, mut any_X] = [A.clone(), X.clone(), A.clone(), X.clone()];
            assert!(solve::<N>(&mut sized_A, &mut sized_X));
            assert!(dense::solve_in_place(&mut any_A, &mut any_X, N));
            assert_eq!(sized_X, any_X, "{N}");

            let [mut room, mut turned, mut sized, mut any] = [A.clone(), A.clone(), A.clone(), A.clone()];
            congruence::<N>(0.3, &X, &A, [&mut room, &mut turned], &mut sized);
            dense::congruence(0.3, &X, &A, N, [&mut room, &mut turned], &mut any);
            assert_eq!(sized, any, "{N}");

            let mut y = vec![0.0; N];
            assert!(product(&A, &X[..N], &mut y));
            let mut truth = vec![0.0; N];
            (0..N).for_each(|k| (0..N).for_each(|i| truth[i] += A[k * N + i] * X[k]));
            assert_eq!(y, truth, "{N}");
            A[0] = -1.0;
            assert!(!solve::<N>(&mut A, &mut sized_X));
        }
        of::<6>();
        of::<12>();
        of::<18>();
    }
}
