//! Map from reference to real element: Jacobian, classification and inversion checks.
//!
//! Start at [`jacobian_range`]. `J = dx/dξ`, m; `det J` is positive in a valid element.
//!
//! Not here: the rule that a class of geometry gets (`rules`), the fix of mirrored meshes
//! ([`crate::mesh::turn_reversed`]).

use std::fmt;

use nalgebra::Vector3;

use super::rules::{Table, tables};
use super::shape::{MAX_NODES, edges, reference_volume};
use crate::mesh::ElementKind;

/// Offset of a mid-edge node, or gap to a parallelepiped, per edge length that counts as zero.
const STRAIGHT: f64 = 1e-12;

/// Allowed negative `det J` at a node, relative to the largest at Gauss points: rounding.
const NODE_SLACK: f64 = 1e-12;

/// Place of an inversion in an element; both numbers count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InversionPoint {
    /// Gauss point of the stiffness or mass.
    GaussPoint(usize),
    /// Node of the element.
    Node(usize),
}

/// Element whose map is inverted or collapses somewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InvertedElement {
    /// Kind of the element.
    pub kind: ElementKind,
    /// Determinant of the Jacobian there, m³; zero, negative or NaN.
    pub det: f64,
    /// Place of the determinant.
    pub place: InversionPoint,
}

impl fmt::Display for InvertedElement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (place, number) = match self.place {
            InversionPoint::GaussPoint(number) => ("Gauss point", number + 1),
            InversionPoint::Node(number) => ("node", number + 1),
        };
        let name = self.kind.name();
        write!(f, "{name} is inverted: det J is {:.3e} m3 at its {place} {number}, it must be positive", self.det)
    }
}

impl std::error::Error for InvertedElement {}

/// Shape quality of an element: the ratios are 1 for a parallelepiped, and zero or less if it is
/// inverted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct JacobianRange {
    /// Minimum `det J` over the Gauss points of the exact stiffness, relative to `|mean|`.
    pub min_gauss: f64,
    /// Gauss point of the minimum, from 0.
    pub gauss_point: usize,
    /// Minimum `det J` over the nodes, relative to `|mean|`.
    pub min_node: f64,
    /// Node of the minimum, from 0.
    pub node: usize,
    /// Mean `det J`, m³: volume divided by that of the reference element.
    pub mean: f64,
}

/// Computes the minimum `det J` over Gauss points and over nodes, relative to the mean.
///
/// An element without volume gives zero ratios.
///
/// # Panics
/// For a beam, and for a wrong number of nodes.
pub(crate) fn jacobian_range(kind: ElementKind, x: &[Vector3<f64>]) -> JacobianRange {
    let nodes = Nodes::new(kind, x);
    let all = tables(kind);
    let volume: f64 = dets(all.mass(nodes.geometry), &nodes).map(|(w, det)| w * det).sum();
    let mean = volume / reference_volume(kind);
    let scale = if mean == 0.0 { f64::INFINITY } else { mean.abs() };
    let smallest = |table: &Table| {
        let (mut at, mut min) = (0, f64::INFINITY);
        for (i, (_, det)) in dets(table, &nodes).enumerate() {
            if !(det >= min) {
                (at, min) = (i, det);
            }
        }
        (at, min / scale)
    };
    let (gauss_point, min_gauss) = smallest(all.stiffness(nodes.geometry));
    let (node, min_node) = smallest(&all.nodes);
    JacobianRange { min_gauss, gauss_point, min_node, node, mean }
}

fn dets(table: &Table, nodes: &Nodes) -> impl Iterator<Item = (f64, f64)> {
    (0..table.len()).map(move |p| (table.weight[p], Jacobian::new(nodes.n, table.dN(p), &nodes.x).det))
}

/// Kind of map of an element; determines the quadrature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Geometry {
    /// Constant Jacobian.
    Affine,
    /// Mid-edge nodes in the middle of straight edges.
    Straight,
    /// Distortion: the maximum of two numbers. The first is the relative difference between `det J`
    /// at a node and its mean over the nodes (how far `1/det J` in the stiffness is from a
    /// polynomial). The second is twice the offset of a mid-edge node per edge length (weight of
    /// the polynomial terms of high degree).
    Curved(f64),
}

/// Nodes of one element relative to the first, which reduces rounding; padded for vector
/// instructions.
pub(crate) struct Nodes {
    pub(crate) n: usize,
    pub(crate) x: [[f64; 4]; MAX_NODES],
    pub(crate) geometry: Geometry,
}

impl Nodes {
    /// Classifies an element by the positions of its nodes, m, any axes.
    ///
    /// # Panics
    /// For a beam, and for a wrong number of nodes.
    pub(crate) fn new(kind: ElementKind, x: &[Vector3<f64>]) -> Self {
        let n = kind.nodes();
        assert!(!kind.is_beam() && x.len() == n, "a {} has {n} nodes, {} were given", kind.name(), x.len());
        let mut padded = [[0.0; 4]; MAX_NODES];
        for (padded, x_i) in padded.iter_mut().zip(x) {
            let d = x_i - x[0];
            *padded = [d.x, d.y, d.z, 0.0];
        }
        let mut nodes = Self { n, x: padded, geometry: classify(kind, x) };
        if let Geometry::Curved(distortion) = &mut nodes.geometry {
            *distortion = distortion.max(spread_at_nodes(kind, &nodes.x));
        }
        nodes
    }
}

fn spread_at_nodes(kind: ElementKind, x: &[[f64; 4]; MAX_NODES]) -> f64 {
    let (n, table) = (kind.nodes(), &tables(kind).nodes);
    let mut dets = [0.0; MAX_NODES];
    for (p, det) in dets[..n].iter_mut().enumerate() {
        *det = Jacobian::new(n, table.dN(p), x).det;
    }
    let mean = dets[..n].iter().sum::<f64>() / n as f64;
    dets[..n].iter().fold(0.0, |spread, det| f64::max(spread, (det / mean - 1.0).abs()))
}

/// Classifies the map; the distortion of a curved one is from its mid-edge offsets only.
fn classify(kind: ElementKind, x: &[Vector3<f64>]) -> Geometry {
    let corners = match kind {
        ElementKind::Tet4 | ElementKind::Tet10 => 4,
        ElementKind::Wedge6 | ElementKind::Wedge15 => 6,
        _ => 8,
    };
    // Coordinates far from the origin have a rounding error of eps |x|.
    let rounding = 4.0 * f64::EPSILON * x[0].amax();
    let (mut curved, mut offset) = (false, 0.0_f64);
    for ([a, b], middle) in edges(kind).iter().zip(&x[corners..]) {
        let edge = (x[*a] - x[*b]).norm();
        let gap = (middle - (x[*a] + x[*b]) * 0.5).norm();
        curved |= !(gap <= STRAIGHT * edge + rounding);
        offset = offset.max(gap / edge);
    }
    if curved {
        return Geometry::Curved(2.0 * offset);
    }
    // Distance of the other corners from the parallelepiped or prism spanned at corner 0.
    let gap = |i: usize, from: [usize; 2]| (x[i] - (x[from[0]] + x[from[1]] - x[0])).norm();
    let gap = match corners {
        4 => return Geometry::Affine,
        6 => gap(4, [1, 3]).max(gap(5, [2, 3])),
        _ => gap(2, [1, 3]).max(gap(5, [1, 4])).max(gap(7, [3, 4])).max((x[6] - (x[2] + x[4] - x[0])).norm()),
    };
    let size = (x[1] - x[0]).norm();
    if gap <= STRAIGHT * size + rounding { Geometry::Affine } else { Geometry::Straight }
}

/// `J = dx/dxi` at one point.
pub(crate) struct Jacobian {
    pub(crate) det: f64,
    /// `inverse[c][a] = dxi_c/dx_a`, meaningless unless `det > 0`.
    pub(crate) inverse: [[f64; 3]; 3],
}

impl Jacobian {
    /// * `dN`: derivatives by r for all nodes, then by s, then by t.
    #[inline(always)]
    pub(crate) fn new(n: usize, dN: &[f64], x: &[[f64; 4]; MAX_NODES]) -> Self {
        let (d_r, d_s, d_t) = (&dN[..n], &dN[n..2 * n], &dN[2 * n..3 * n]);
        let mut J = [[0.0; 4]; 3]; // J[c] = dx/dxi_c
        for i in 0..n {
            for a in 0..4 {
                J[0][a] += d_r[i] * x[i][a];
                J[1][a] += d_s[i] * x[i][a];
                J[2][a] += d_t[i] * x[i][a];
            }
        }
        let cross = |u: &[f64; 4], v: &[f64; 4]| {
            [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
        };
        let adjugate = [cross(&J[1], &J[2]), cross(&J[2], &J[0]), cross(&J[0], &J[1])];
        let det = J[0][0] * adjugate[0][0] + J[0][1] * adjugate[0][1] + J[0][2] * adjugate[0][2];
        let reciprocal = 1.0 / det;
        Self { det, inverse: adjugate.map(|row| row.map(|a| a * reciprocal)) }
    }

    /// As [`Self::new`], with an error for an inverted element.
    #[inline(always)]
    pub(crate) fn checked(
        kind: ElementKind,
        n: usize,
        table: &Table,
        point: usize,
        x: &[[f64; 4]; MAX_NODES],
    ) -> Result<Self, InvertedElement> {
        let jacobian = Self::new(n, table.dN(point), x);
        if jacobian.det > 0.0 {
            return Ok(jacobian);
        }
        Err(InvertedElement { kind, det: jacobian.det, place: InversionPoint::GaussPoint(point) })
    }

    /// Writes `dN_i/dx_a` of all nodes to `gradient[a * stride + i]`.
    #[inline(always)]
    pub(crate) fn gradients(&self, n: usize, dN: &[f64], stride: usize, gradient: &mut [f64]) {
        let (d_r, d_s, d_t) = (&dN[..n], &dN[n..2 * n], &dN[2 * n..3 * n]);
        let inverse = &self.inverse;
        for a in 0..3 {
            let row = &mut gradient[a * stride..a * stride + n];
            for i in 0..n {
                row[i] = inverse[0][a] * d_r[i] + inverse[1][a] * d_s[i] + inverse[2][a] * d_t[i];
            }
        }
    }
}

/// Rejects a negative `det J` at a node: the element then contains a surface where the integrand of
/// the stiffness is infinite, even if `det J` is positive at all Gauss points.
pub(crate) fn check_nodes(kind: ElementKind, nodes: &Nodes, largest_det: f64) -> Result<(), InvertedElement> {
    let table = &tables(kind).nodes;
    for (number, (_, det)) in dets(table, nodes).enumerate() {
        if !(det >= -NODE_SLACK * largest_det) {
            return Err(InvertedElement { kind, det, place: InversionPoint::Node(number) });
        }
    }
    Ok(())
}
