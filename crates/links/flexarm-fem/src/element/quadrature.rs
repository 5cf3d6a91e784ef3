//! Quadrature points and weights on the reference tetrahedron, brick and wedge.
//!
//! Products of one-dimensional Gauss rules are computed once for any number of points. For the
//! triangle and tetrahedron the square and cube are collapsed, with the factor `(1-s)^k` of the map
//! in the weight (Gauss-Jacobi), so that n points per direction are exact to total degree 2n - 1.
//! Symmetric rules with fewer points are tabulated. All weights are positive and all points are
//! inside.
//!
//! # Source
//! One dimension: Golub & Welsch (1969). Collapsed: Karniadakis & Sherwin, *Spectral/hp Element
//! Methods*, section 4.1. Tables: Witherden & Vincent (2015), *Comput. Math. Appl.* 69(10), the
//! rules of degree 5, 8 and 10 for the tetrahedron as published with PyFR.

use std::sync::OnceLock;

use nalgebra::DMatrix;

/// Reference coordinates and weight; the weights add up to the reference volume.
pub(crate) type WeightedPoint = ([f64; 3], f64);

/// Gauss-Jacobi points on [0, 1] for the weight `(1-x)^alpha`: exact to degree 2n - 1.
///
/// Points: eigenvalues of the Jacobi matrix of the recurrence of `P_n^(alpha, 0)`. Weights: from
/// the first components of the eigenvectors.
pub(crate) fn gauss_jacobi(n: usize, alpha: usize) -> Vec<(f64, f64)> {
    let a = alpha as f64;
    let mut jacobi = DMatrix::<f64>::zeros(n, n);
    for i in 0..n {
        let k = i as f64;
        let c = 2.0 * k + a;
        jacobi[(i, i)] = if alpha == 0 { 0.0 } else { -a * a / (c * (c + 2.0)) };
        if i > 0 {
            let b = 2.0 * k * (k + a) / (c * (c * c - 1.0).sqrt());
            jacobi[(i, i - 1)] = b;
            jacobi[(i - 1, i)] = b;
        }
    }
    let eigen = jacobi.symmetric_eigen();
    let mut points: Vec<(f64, f64)> =
        (0..n).map(|i| (0.5 * (1.0 + eigen.eigenvalues[i]), eigen.eigenvectors[(0, i)].powi(2) / (a + 1.0))).collect();
    points.sort_by(|p, q| p.0.total_cmp(&q.0));
    points
}

/// Gauss-Legendre points on [-1, 1].
fn gauss(n: usize) -> Vec<(f64, f64)> {
    gauss_jacobi(n, 0).into_iter().map(|(x, w)| (2.0 * x - 1.0, 2.0 * w)).collect()
}

/// n³ points on the brick, exact to degree 2n - 1 in each variable.
pub(crate) fn brick(n: usize) -> Vec<WeightedPoint> {
    let line = gauss(n);
    let mut points = Vec::with_capacity(n * n * n);
    for (t, w_t) in &line {
        for (s, w_s) in &line {
            points.extend(line.iter().map(|(r, w_r)| ([*r, *s, *t], w_r * w_s * w_t)));
        }
    }
    points
}

/// n² points on the triangle, exact to total degree 2n - 1; mapped by `r = u (1-s)`.
fn triangle(n: usize) -> Vec<([f64; 2], f64)> {
    let u_points = gauss_jacobi(n, 0);
    let mut points = Vec::with_capacity(n * n);
    for (s, w_s) in gauss_jacobi(n, 1) {
        points.extend(u_points.iter().map(|(u, w_u)| ([u * (1.0 - s), s], w_u * w_s)));
    }
    points
}

/// n_triangle² × n_line points on the wedge.
pub(crate) fn wedge(n_triangle: usize, n_line: usize) -> Vec<WeightedPoint> {
    prism(&triangle(n_triangle), n_line)
}

/// Midpoint of the triangle (exact to degree 1 there) times n points along the wedge.
pub(crate) fn wedge_midpoint(n_line: usize) -> Vec<WeightedPoint> {
    prism(&[([1.0 / 3.0; 2], 0.5)], n_line)
}

/// Three interior points of the triangle (exact to degree 2 there) times n points along the wedge.
pub(crate) fn wedge_three(n_line: usize) -> Vec<WeightedPoint> {
    let (a, b) = (1.0 / 6.0, 2.0 / 3.0);
    prism(&[([a, a], a), ([b, a], a), ([a, b], a)], n_line)
}

fn prism(triangle: &[([f64; 2], f64)], n_line: usize) -> Vec<WeightedPoint> {
    let along = gauss(n_line);
    let layer = |(t, w_t): &(f64, f64)| {
        let (t, w_t) = (*t, *w_t);
        triangle.iter().map(move |([r, s], w)| ([*r, *s, t], w * w_t))
    };
    along.iter().flat_map(layer).collect()
}

/// n³ points on the tetrahedron, exact to total degree 2n - 1; by `s = v (1-t)`, `r = u (1-s-t)`.
pub(crate) fn tet_collapsed(n: usize) -> Vec<WeightedPoint> {
    let (u_points, v_points) = (gauss_jacobi(n, 0), gauss_jacobi(n, 1));
    let mut points = Vec::with_capacity(n * n * n);
    for (t, w_t) in gauss_jacobi(n, 2) {
        for (v, w_v) in &v_points {
            let s = v * (1.0 - t);
            points.extend(u_points.iter().map(|(u, w_u)| ([u * (1.0 - s - t), s, t], w_u * w_v * w_t)));
        }
    }
    points
}

/// Orbit of points of a symmetric rule of the tetrahedron; all weights of a rule add up to 1.
enum Orbit {
    /// The centroid: weight.
    Centre(f64),
    /// Barycentric `(a, a, a, 1-3a)`, 4 points: a, weight.
    Vertex(f64, f64),
    /// Barycentric `(a, a, 1/2-a, 1/2-a)`, 6 points: a, weight.
    Edge(f64, f64),
    /// Barycentric `(a, a, b, 1-2a-b)`, 12 points: a, b, weight.
    Face(f64, f64, f64),
}

/// Symmetric rules of the tetrahedron.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TetRule {
    /// 1 point, degree 1.
    P1,
    /// 4 points, degree 2.
    P4,
    /// 14 points, degree 5.
    P14,
    /// 46 points, degree 8.
    P46,
    /// 81 points, degree 10.
    P81,
}

const P14: [Orbit; 3] = [
    Orbit::Vertex(0.310_885_919_263_300_6, 0.112_687_925_718_015_85),
    Orbit::Vertex(0.092_735_250_310_891_22, 0.073_493_043_116_361_96),
    Orbit::Edge(0.045_503_704_125_649_65, 0.042_546_020_777_081_466),
];

const P46: [Orbit; 7] = [
    Orbit::Vertex(0.107_952_724_962_210_85, 0.026_426_650_908_408_83),
    Orbit::Vertex(0.185_109_487_782_586_57, 0.052_031_747_563_738_53),
    Orbit::Vertex(0.042_316_543_684_767_28, 0.007_525_256_153_540_2),
    Orbit::Vertex(0.314_181_709_124_039, 0.041_763_782_856_934_9),
    Orbit::Edge(0.435_591_328_583_830_2, 0.036_280_930_261_308_825),
    Orbit::Face(0.021_433_930_127_130_574, 0.717_464_063_426_308_3, 0.007_156_902_890_844_433_5),
    Orbit::Face(0.204_139_333_876_029_12, 0.583_797_378_302_144_4, 0.015_453_486_150_960_335),
];

const P81: [Orbit; 9] = [
    Orbit::Centre(0.047_399_773_556_020_736),
    Orbit::Vertex(0.312_250_068_695_188_7, 0.026_937_059_992_268_7),
    Orbit::Vertex(0.114_309_653_857_346_15, 0.009_869_159_716_793_384),
    Orbit::Face(0.410_430_739_218_965_5, 0.165_486_025_619_611_04, 0.011_393_881_220_195_232),
    Orbit::Face(0.006_138_008_824_790_748, 0.942_988_767_345_204_9, 0.000_361_944_344_339_253_6),
    Orbit::Face(0.121_050_181_145_589_44, 0.477_190_379_904_280_37, 0.025_739_731_980_456_072),
    Orbit::Face(0.032_779_468_216_442_67, 0.594_256_269_480_007, 0.010_135_871_679_755_793),
    Orbit::Face(0.032_485_281_564_823_05, 0.801_177_284_658_344_4, 0.006_576_147_277_035_904),
    Orbit::Face(0.174_979_342_183_939, 0.628_071_845_475_366, 0.012_907_035_798_861_991),
];

/// Points of a symmetric rule.
pub(crate) fn tet(rule: TetRule) -> Vec<WeightedPoint> {
    match rule {
        TetRule::P1 => expand(&[Orbit::Centre(1.0)]),
        TetRule::P4 => expand(&[Orbit::Vertex(0.25 - 0.05 * 5.0_f64.sqrt(), 0.25)]),
        TetRule::P14 => expand(&P14),
        TetRule::P46 => expand(&P46),
        TetRule::P81 => expand(&P81),
    }
}

/// Points of a symmetric rule, computed once per process.
pub(crate) fn tet_points(rule: TetRule) -> &'static [WeightedPoint] {
    static POINTS: [OnceLock<Vec<WeightedPoint>>; 5] = [const { OnceLock::new() }; 5];
    POINTS[rule as usize].get_or_init(|| tet(rule))
}

/// Expands each orbit into all distinct permutations of its barycentric coordinates.
fn expand(orbits: &[Orbit]) -> Vec<WeightedPoint> {
    let mut points = Vec::new();
    for orbit in orbits {
        let (mut L, weight) = match *orbit {
            Orbit::Centre(w) => ([0.25; 4], w),
            Orbit::Vertex(a, w) => ([a, a, a, 1.0 - 3.0 * a], w),
            Orbit::Edge(a, w) => ([a, a, 0.5 - a, 0.5 - a], w),
            Orbit::Face(a, b, w) => ([a, a, b, 1.0 - 2.0 * a - b], w),
        };
        L.sort_by(f64::total_cmp);
        loop {
            points.push(([L[1], L[2], L[3]], weight / 6.0));
            if !next_permutation(&mut L) {
                break;
            }
        }
    }
    points
}

/// Advances to the next larger permutation, each distinct one once; `false` after the last.
fn next_permutation(L: &mut [f64; 4]) -> bool {
    let Some(i) = (0..3).rev().find(|i| L[*i] < L[i + 1]) else {
        return false;
    };
    let Some(j) = (i + 1..4).rev().find(|j| L[*j] > L[i]) else {
        return false;
    };
    L.swap(i, j);
    L[i + 1..].reverse();
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    fn factorial(n: usize) -> f64 {
        (1..=n).map(|k| k as f64).product()
    }

    fn sum(points: &[WeightedPoint], powers: [usize; 3]) -> f64 {
        points.iter().map(|(x, w)| w * (0..3).map(|c| x[c].powi(powers[c] as i32)).product::<f64>()).sum()
    }

    fn monomials(degree: usize) -> impl Iterator<Item = [usize; 3]> {
        let powers = move |i| (0..=degree - i).flat_map(move |j| (0..=degree - i - j).map(move |k| [i, j, k]));
        (0..=degree).flat_map(powers)
    }

    /// Truth: ∫ r^i s^j t^k = i! j! k! / (i+j+k+3)! on the tetrahedron.
    #[test]
    fn rules_of_the_tetrahedron_integrate_every_monomial_of_their_degree() {
        let mut rules: Vec<_> = (1..=8).map(|n| (tet_collapsed(n), 2 * n - 1)).collect();
        rules.extend([
            (tet(TetRule::P1), 1),
            (tet(TetRule::P4), 2),
            (tet(TetRule::P14), 5),
            (tet(TetRule::P46), 8),
            (tet(TetRule::P81), 10),
        ]);
        for (points, degree) in rules {
            assert!(points.iter().all(|(x, w)| *w > 0.0 && x.iter().all(|x| *x > 0.0) && x.iter().sum::<f64>() < 1.0));
            for [i, j, k] in monomials(degree) {
                let exact = factorial(i) * factorial(j) * factorial(k) / factorial(i + j + k + 3);
                let error = (sum(&points, [i, j, k]) - exact).abs() / exact;
                assert!(error < 1e-12, "{} points, {i} {j} {k}: {error:.1e}", points.len()); // measured 1.2e-14
            }
        }
    }

    /// Truth: products of 2/(k+1) for even k on the brick.
    #[test]
    fn rules_of_the_brick_integrate_every_monomial_of_their_degree() {
        for n in 1..=6 {
            let points = brick(n);
            let line = |k: usize| if k.is_multiple_of(2) { 2.0 / (k + 1) as f64 } else { 0.0 };
            for i in 0..2 * n {
                for j in 0..2 * n {
                    let k = 2 * n - 1 - i.max(j);
                    let error = (sum(&points, [i, j, k]) - line(i) * line(j) * line(k)).abs();
                    assert!(error < 1e-13, "{n} {i} {j} {k}: {error:.1e}"); // measured 2.6e-15
                }
            }
        }
    }

    /// Truth: i! j! / (i+j+2)! times 2/(k+1) for even k on the wedge.
    #[test]
    fn rules_of_the_wedge_integrate_every_monomial_of_their_degree() {
        let mut rules: Vec<_> = (1..=5).map(|n| (wedge(n, n), 2 * n - 1, 2 * n - 1)).collect();
        rules.extend([(wedge_midpoint(2), 1, 3), (wedge_three(3), 2, 5)]);
        for (points, triangle, line) in rules {
            for [i, j, _] in monomials(triangle) {
                for k in 0..=line {
                    let along = if k.is_multiple_of(2) { 2.0 / (k + 1) as f64 } else { 0.0 };
                    let exact = factorial(i) * factorial(j) / factorial(i + j + 2) * along;
                    let error = (sum(&points, [i, j, k]) - exact).abs();
                    assert!(error < 1e-14, "{} points, {i} {j} {k}: {error:.1e}", points.len()); // measured 6e-16
                }
            }
        }
    }
}
