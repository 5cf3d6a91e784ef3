//! The piece of one element ahead of a plane.
//!
//! In reference coordinates the plane is the zero set of `d(xi) = Σ N_i d_i`, with the distances
//! `d_i` of the nodes. The reference element is split into tetrahedra; those that the zero set
//! crosses are split into eight until `d` is nearly linear in each. There `d` is replaced by its
//! best linear fit, the tetrahedron is clipped, and `det J`, `x det J`, `x xᵀ det J` are integrated
//! over the remainder. With a least squares fit instead of interpolation the mean position error of
//! the cut is zero, so that errors of neighbours cancel.

use nalgebra::{Matrix3, Vector3};

use super::Plane;
use super::moments::Moments;
use crate::element::{
    InvertedElement, Purpose, Quadrature, TetRule, edges, for_each_point, shape_functions, tet_points,
};
use crate::mesh::ElementKind;

/// Accepted deviation of `d` from linear on a small tetrahedron, relative to the range of `d` in
/// the element.
const FLAT: f64 = 1e-4;

/// Maximum number of times that a tetrahedron is split into eight.
const DEEPEST: usize = 4;

/// Position of an element relative to a plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Behind,
    Ahead,
    Crossed,
}

/// Position of an element with the nodes x (mesh axes, m); some curved elements near the plane are
/// reported as crossed although they are not.
pub(super) fn side(kind: ElementKind, x: &[Vector3<f64>], plane: &Plane) -> Side {
    let corners = corners(kind);
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for x in &x[..corners] {
        let d = plane.distance(x);
        (low, high) = (low.min(d), high.max(d));
    }
    if !kind.is_beam() {
        // A quadratic element is its straight counterpart plus offsets times bubbles; the bubbles
        // add up to at most 3.
        let offset = edges(kind).iter().zip(&x[corners..]).fold(0.0, |offset, ([a, b], middle)| {
            f64::max(offset, plane.normal.dot(&(middle - (x[*a] + x[*b]) * 0.5)).abs())
        });
        (low, high) = (low - 3.0 * offset, high + 3.0 * offset);
    }
    if low >= 0.0 {
        Side::Ahead
    } else if high <= 0.0 {
        Side::Behind
    } else {
        Side::Crossed
    }
}

fn corners(kind: ElementKind) -> usize {
    match kind {
        ElementKind::Beam2 => 2,
        ElementKind::Tet4 | ElementKind::Tet10 => 4,
        ElementKind::Wedge6 | ElementKind::Wedge15 => 6,
        ElementKind::Hex8 | ElementKind::Hex20 => 8,
    }
}

/// Fractions of the length of a crossed beam, from its first node, between which it is ahead of the
/// plane.
pub(super) fn ahead_of_line(x: &[Vector3<f64>], plane: &Plane) -> (f64, f64) {
    let (d_0, d_1) = (plane.distance(&x[0]), plane.distance(&x[1]));
    let root = d_0 / (d_0 - d_1);
    if d_0 > 0.0 { (0.0, root) } else { (root, 1.0) }
}

/// Exact moments of the volume of an element (m³, m⁴, m⁵) about `origin`; x, origin: mesh axes, m.
pub(super) fn whole(kind: ElementKind, x: &[Vector3<f64>], origin: &Vector3<f64>) -> Result<Moments, InvertedElement> {
    let mut moments = Moments::about(*origin);
    for_each_point(kind, x, Purpose::Mass, Quadrature::Exact, |point| {
        moments.add_point(point.weight, &(point.position - origin));
    })?;
    Ok(moments)
}

/// As [`whole`], of the volume ahead of the plane; see the module for its error.
pub(super) fn ahead(kind: ElementKind, x: &[Vector3<f64>], plane: &Plane, origin: &Vector3<f64>) -> Moments {
    let n = kind.nodes();
    let mut d = [0.0; 20];
    for (d, x) in d.iter_mut().zip(x) {
        *d = plane.distance(x);
    }
    let range = d[..n].iter().fold(0.0, |range: f64, d| range.max(d.abs()));
    let mut clip = Clip { kind, x, d, flat: FLAT * range, origin, moments: Moments::about(*origin) };
    for tet in reference_tets(kind) {
        let d = tet.map(|xi| clip.distance(&xi));
        clip.visit(tet, d, 0);
    }
    clip.moments
}

/// Reference coordinates of an element, dimensionless.
type Xi = Vector3<f64>;

/// Splits the reference element into tetrahedra of positive volume.
fn reference_tets(kind: ElementKind) -> Vec<[Xi; 4]> {
    let nodes = crate::element::reference_nodes(kind);
    let tets: &[[usize; 4]] = match corners(kind) {
        4 => &[[0, 1, 2, 3]],
        6 => &[[0, 1, 2, 5], [0, 1, 5, 4], [0, 4, 5, 3]],
        _ => &[[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]],
    };
    tets.iter().map(|tet| tet.map(|i| Vector3::from(nodes[i]))).collect()
}

const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];

/// Integration of one element over what is ahead of the plane.
struct Clip<'a> {
    kind: ElementKind,
    /// Positions of the nodes, mesh axes, m.
    x: &'a [Vector3<f64>],
    /// Distances of the nodes from the plane.
    d: [f64; 20],
    /// Accepted deviation of `d` from linear, m.
    flat: f64,
    origin: &'a Vector3<f64>,
    moments: Moments,
}

impl Clip<'_> {
    /// Integrates what is ahead of the plane in a tetrahedron, splitting it where `d` is not
    /// linear.
    ///
    /// * `d`: distances of the four vertices.
    fn visit(&mut self, tet: [Xi; 4], d: [f64; 4], depth: usize) {
        let middles = EDGES.map(|[a, b]| (tet[a] + tet[b]) * 0.5);
        let d_middles = middles.map(|xi| self.distance(&xi));
        let mut offsets = [0.0; 6];
        for (i, [a, b]) in EDGES.into_iter().enumerate() {
            offsets[i] = d_middles[i] - 0.5 * (d[a] + d[b]);
        }
        let bend = offsets.iter().fold(0.0, |bend: f64, o| bend.max(o.abs()));

        // Twice the overshoot of a quadratic beyond its vertices, since d may be of higher degree.
        let (low, high) =
            (d.iter().copied().fold(f64::INFINITY, f64::min), d.iter().copied().fold(-f64::INFINITY, f64::max));
        if high + 3.0 * bend <= 0.0 {
            return;
        }
        if low - 3.0 * bend >= 0.0 {
            return self.integrate(&tet, depth);
        }
        if bend <= self.flat || depth == DEEPEST {
            return self.clip(&tet, best_fit(d, &offsets), depth);
        }
        for child in CHILDREN {
            let vertex = |i: usize| if i < 4 { (tet[i], d[i]) } else { (middles[i - 4], d_middles[i - 4]) };
            let vertices = child.map(vertex);
            self.visit(vertices.map(|v| v.0), vertices.map(|v| v.1), depth + 1);
        }
    }

    /// Integrates over the part of a tetrahedron where the linear `d` is positive.
    fn clip(&mut self, tet: &[Xi; 4], d: [f64; 4], depth: usize) {
        let mut order = [0, 1, 2, 3];
        order.sort_by(|a, b| d[*b].total_cmp(&d[*a]));
        // Vertices by falling distance: the first `ahead` of them are ahead of the plane, and the
        // cut is at the roots of d on the edges to the others.
        let ahead = d.iter().filter(|d| **d > 0.0).count();
        let v = order.map(|i| tet[i]);
        let root = |a: usize, b: usize| {
            let (d_a, d_b) = (d[order[a]], d[order[b]]);
            v[a] + (v[b] - v[a]) * (d_a / (d_a - d_b))
        };
        let prism = |p: [Xi; 6]| [[p[0], p[1], p[2], p[5]], [p[0], p[1], p[5], p[4]], [p[0], p[4], p[5], p[3]]];
        match ahead {
            0 => {}
            1 => self.integrate(&[v[0], root(0, 1), root(0, 2), root(0, 3)], depth),
            2 => {
                for tet in prism([v[0], root(0, 2), root(0, 3), v[1], root(1, 2), root(1, 3)]) {
                    self.integrate(&tet, depth);
                }
            }
            3 => {
                for tet in prism([v[0], v[1], v[2], root(0, 3), root(1, 3), root(2, 3)]) {
                    self.integrate(&tet, depth);
                }
            }
            _ => self.integrate(tet, depth),
        }
    }

    /// Adds the moments of a tetrahedron in reference coordinates, of either orientation.
    fn integrate(&mut self, tet: &[Xi; 4], depth: usize) {
        // The smaller the tetrahedron, the closer det J is to a constant on it.
        let rule = match depth {
            0 => TetRule::P46,
            1 | 2 => TetRule::P14,
            _ => TetRule::P4,
        };
        let edges = Matrix3::from_columns(&[tet[1] - tet[0], tet[2] - tet[0], tet[3] - tet[0]]);
        let det = edges.determinant().abs();
        for (L, weight) in tet_points(rule) {
            let xi = tet[0] + edges * Vector3::from(*L);
            let (r, det_J) = self.place(&xi);
            self.moments.add_point(weight * det * det_J, &r);
        }
    }

    /// Interpolated distance `d(xi)` from the plane, m.
    fn distance(&self, xi: &Xi) -> f64 {
        let (mut N, mut dN) = ([0.0; 20], [[0.0; 3]; 20]);
        shape_functions(self.kind, (*xi).into(), &mut N, &mut dN);
        N.iter().zip(&self.d).map(|(N, d)| N * d).sum()
    }

    /// Position relative to the origin (m, mesh axes), and `det J` (m³).
    fn place(&self, xi: &Xi) -> (Vector3<f64>, f64) {
        let (mut N, mut dN) = ([0.0; 20], [[0.0; 3]; 20]);
        shape_functions(self.kind, (*xi).into(), &mut N, &mut dN);
        let (mut r, mut J) = (Vector3::zeros(), Matrix3::zeros());
        for (i, x) in self.x.iter().enumerate() {
            let r_i = x - self.origin;
            r += r_i * N[i];
            J += r_i * Vector3::from(dN[i]).transpose();
        }
        (r, J.determinant())
    }
}

/// The eight tetrahedra of half the size; vertices 4 to 9 are the midpoints of [`EDGES`].
const CHILDREN: [[usize; 4]; 8] =
    [[0, 4, 6, 7], [4, 1, 5, 8], [6, 5, 2, 9], [7, 8, 9, 3], [4, 9, 6, 7], [4, 9, 7, 8], [4, 9, 8, 5], [4, 9, 5, 6]];

/// Vertex values of the linear function closest in the least squares sense to the quadratic with
/// these vertex values and midpoint offsets: the projection of the bubble `4 L_a L_b` is 8/15 at
/// its two ends and -2/15 at the two other vertices.
fn best_fit(mut d: [f64; 4], offsets: &[f64; 6]) -> [f64; 4] {
    for ([a, b], offset) in EDGES.iter().zip(offsets) {
        for (i, d) in d.iter_mut().enumerate() {
            *d += offset * if i == *a || i == *b { 8.0 / 15.0 } else { -2.0 / 15.0 };
        }
    }
    d
}
