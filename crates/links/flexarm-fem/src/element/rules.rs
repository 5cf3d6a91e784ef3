//! Choice of quadrature per element, shape functions tabulated at its points, and a visitor.
//!
//! Start at [`Quadrature`], whose table lists the rules, and [`for_each_point`].
//!
//! Not here: points and weights of the rules (`quadrature`), classification of an element
//! (`geometry`).

use std::sync::OnceLock;

use nalgebra::Vector3;

use super::geometry::{Geometry, InvertedElement, Jacobian, Nodes};
use super::quadrature::{TetRule, WeightedPoint, brick, tet, tet_collapsed, wedge, wedge_midpoint, wedge_three};
use super::shape::{MAX_NODES, no_beam, reference_nodes, shape_functions};
use crate::mesh::ElementKind;

/// Quadrature rules for the matrices of an element.
///
/// | | `Exact`: stiffness | `Exact`: mass | `Calculix`: both |
/// | --- | --- | --- | --- |
/// | TET4 | 1 point | closed form | 1 |
/// | TET10 straight | 4, exact | closed form | 4 |
/// | TET10 curved | 14, 46, 81, 216, 343 or 512 by distortion | 46, exact | 4 |
/// | HEX8 | 2×2×2 and nine incompatible modes | 3×3×3, exact | 2×2×2, no modes |
/// | HEX20 affine, straight, curved | 3³ (exact), 4³, 5³ | closed form, 4³, 5³, exact | 3×3×3 |
/// | WEDGE6 prism, other | 3×2 (exact), 9×3 | closed form, 4×3, exact | 1×2 |
/// | WEDGE15 prism, straight, curved | 9×3 (exact), 16×4, 25×5 | closed form, 9×4, 25×5, exact | 3×3 |
///
/// Closed form: for every affine element, the mass of the reference element times `det J`. The
/// stiffness of an element that is not affine is the integral of a rational function, which no rule
/// integrates exactly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Quadrature {
    /// Sufficient for stiffness and consistent mass.
    #[default]
    Exact,
    /// The rules of CalculiX for C3D4, C3D10, C3D8, C3D20, C3D6 and C3D15, the same for stiffness
    /// and mass. The mass of tetrahedra, HEX20 and wedges is under-integrated: the total is right,
    /// the distribution is not. WEDGE6 has one zero-energy mode in addition to the rigid motions.
    Calculix,
    /// As `Calculix`, but HEX8 with incompatible modes: C3D8I.
    CalculixModes,
}

/// Purpose of the quadrature points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Purpose {
    /// Products of two gradients.
    Stiffness,
    /// Products of two shape functions, or of two coordinates: mass, centre of mass, inertia.
    Mass,
}

/// One quadrature point of an element.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Point<'a> {
    /// Position, m.
    pub position: Vector3<f64>,
    /// Reference coordinates.
    pub xi: [f64; 3],
    /// Weight times `det J`, m³; the weights add up to the volume.
    pub weight: f64,
    /// Gradients of the shape functions, 1/m.
    pub dN: &'a [Vector3<f64>],
}

/// Visits the quadrature points of an element in a fixed order.
///
/// The incompatible modes of HEX8 are not included: the gradients are those of the eight nodes.
///
/// # Errors
/// [`InvertedElement`] at the first point without a positive `det J`; `visit` has already been
/// called for the points before it.
///
/// # Panics
/// For a beam, and for a wrong number of nodes.
pub(crate) fn for_each_point(
    kind: ElementKind,
    x: &[Vector3<f64>],
    purpose: Purpose,
    rule: Quadrature,
    mut visit: impl FnMut(&Point),
) -> Result<(), InvertedElement> {
    let nodes = Nodes::new(kind, x);
    let n = nodes.n;
    let table = match purpose {
        Purpose::Stiffness => tables(kind).stiffness_for(rule, nodes.geometry),
        Purpose::Mass => tables(kind).mass_for(rule, nodes.geometry),
    };
    let (mut flat, mut dN) = ([0.0; 3 * MAX_NODES], [Vector3::zeros(); MAX_NODES]);
    for p in 0..table.len() {
        let jacobian = Jacobian::checked(kind, n, table, p, &nodes.x)?;
        // dN/dx = J^-1 dN/dξ.
        jacobian.gradients(n, table.dN(p), n, &mut flat);
        for i in 0..n {
            dN[i] = Vector3::new(flat[i], flat[n + i], flat[2 * n + i]);
        }
        visit(&Point {
            position: table.N(p).iter().zip(x).map(|(N_i, x_i)| x_i * *N_i).sum(),
            xi: table.xi[p],
            weight: table.weight[p] * jacobian.det,
            dN: &dN[..n],
        });
    }
    Ok(())
}

/// Shape functions of one element kind at the points of one rule.
pub(crate) struct Table {
    n: usize,
    pub(crate) xi: Vec<[f64; 3]>,
    pub(crate) weight: Vec<f64>,
    N: Vec<f64>,
    dN: Vec<f64>,
    NN: Vec<f64>,
}

impl Table {
    /// Evaluates the shape functions and their derivatives at the points of a rule.
    pub(crate) fn new(kind: ElementKind, points: &[WeightedPoint]) -> Self {
        let n = kind.nodes();
        let mut table = Self { n, xi: vec![], weight: vec![], N: vec![], dN: vec![], NN: vec![] };
        for (xi, weight) in points {
            let (mut N, mut dN) = ([0.0; MAX_NODES], [[0.0; 3]; MAX_NODES]);
            shape_functions(kind, *xi, &mut N, &mut dN);
            table.xi.push(*xi);
            table.weight.push(*weight);
            // N_i, then dN_i/dξ_c by c, then N_i N_j for j ≥ i.
            table.N.extend(&N[..n]);
            for c in 0..3 {
                table.dN.extend(dN[..n].iter().map(|d| d[c]));
            }
            for i in 0..n {
                table.NN.extend((i..n).map(|j| N[i] * N[j]));
            }
        }
        table
    }

    /// Number of points.
    pub(crate) fn len(&self) -> usize {
        self.weight.len()
    }

    /// Shape functions at a point.
    pub(crate) fn N(&self, point: usize) -> &[f64] {
        &self.N[point * self.n..(point + 1) * self.n]
    }

    /// Derivatives of the shape functions by r for all nodes, then by s, then by t.
    pub(crate) fn dN(&self, point: usize) -> &[f64] {
        &self.dN[point * 3 * self.n..(point + 1) * 3 * self.n]
    }

    /// Upper triangle of `N Nᵀ` by rows.
    pub(crate) fn NN(&self, point: usize) -> &[f64] {
        let size = self.n * (self.n + 1) / 2;
        &self.NN[point * size..(point + 1) * size]
    }
}

/// All tables of one element kind.
pub(crate) struct Tables {
    /// In order of distortion: affine, straight, curved and more strongly curved.
    stiffness: Vec<Table>,
    /// Affine, straight, curved; shorter if the kind lacks such a geometry.
    mass: Vec<Table>,
    calculix: Table,
    /// At the nodes, without weights.
    pub(crate) nodes: Table,
    /// `∫ N Nᵀ` over the reference element, upper triangle by rows.
    pub(crate) reference_mass: Vec<f64>,
}

/// Maximum distortion of a curved TET10 for 14, 46, 81, 216 and 343 points; above the last, 512
/// points.
///
/// Up to a distortion of 0.35 the error of the stiffness is below 1e-8 of its largest entry, on
/// nearly flat tetrahedra below 3e-8
/// (`the_stiffness_of_a_curved_tetrahedron_does_not_depend_on_the_rule`); with 512 points it is
/// 2e-8 at a distortion of 0.4 and 2e-6 at 0.7.
pub(crate) const TET10_DISTORTIONS: [f64; 5] = [0.005, 0.07, 0.12, 0.2, 0.35];

impl Tables {
    fn new(kind: ElementKind) -> Self {
        // Rules by rising distortion of the element; for `calculix` the one of that program.
        let (stiffness, mass, calculix) = match kind {
            ElementKind::Tet4 => (vec![tet(TetRule::P1)], vec![tet(TetRule::P4)], tet(TetRule::P1)),
            ElementKind::Tet10 => {
                let mut stiffness: Vec<_> = [TetRule::P4, TetRule::P14, TetRule::P46, TetRule::P81].map(tet).into();
                stiffness.extend([6, 7, 8].map(tet_collapsed));
                (stiffness, [TetRule::P14, TetRule::P14, TetRule::P46].map(tet).into(), tet(TetRule::P4))
            }
            ElementKind::Hex8 => (vec![brick(2)], vec![brick(2), brick(3)], brick(2)),
            ElementKind::Hex20 => {
                let rules = || vec![brick(3), brick(4), brick(5)];
                (rules(), rules(), brick(3))
            }
            ElementKind::Wedge6 => {
                (vec![wedge_three(2), wedge(3, 3)], vec![wedge_three(2), wedge(2, 3)], wedge_midpoint(2))
            }
            ElementKind::Wedge15 => (
                vec![wedge(3, 3), wedge(4, 4), wedge(5, 5)],
                vec![wedge(3, 3), wedge(3, 4), wedge(5, 5)],
                wedge_three(3),
            ),
            ElementKind::Beam2 => no_beam(),
        };
        let tabulate = |rules: &[Vec<WeightedPoint>]| rules.iter().map(|points| Table::new(kind, points)).collect();
        let mass: Vec<Table> = tabulate(&mass);
        let nodes: Vec<WeightedPoint> = reference_nodes(kind).iter().map(|xi| (*xi, 0.0)).collect();
        Self {
            stiffness: tabulate(&stiffness),
            calculix: Table::new(kind, &calculix),
            nodes: Table::new(kind, &nodes),
            reference_mass: reference_mass(&mass[0]),
            mass,
        }
    }

    /// Rule of [`Quadrature::Exact`] for the stiffness.
    pub(crate) fn stiffness(&self, geometry: Geometry) -> &Table {
        let class = match geometry {
            Geometry::Affine => 0,
            Geometry::Straight => 1,
            Geometry::Curved(distortion) if self.nodes.n == 10 => {
                1 + TET10_DISTORTIONS.iter().filter(|limit| !(distortion <= **limit)).count()
            }
            Geometry::Curved(_) => 2,
        };
        &self.stiffness[class.min(self.stiffness.len() - 1)]
    }

    /// Rule of [`Quadrature::Exact`] for the mass.
    pub(crate) fn mass(&self, geometry: Geometry) -> &Table {
        let class = match geometry {
            Geometry::Affine => 0,
            Geometry::Straight => 1,
            Geometry::Curved(_) => 2,
        };
        &self.mass[class.min(self.mass.len() - 1)]
    }

    pub(crate) fn stiffness_for(&self, rule: Quadrature, geometry: Geometry) -> &Table {
        match rule {
            Quadrature::Exact => self.stiffness(geometry),
            Quadrature::Calculix | Quadrature::CalculixModes => &self.calculix,
        }
    }

    pub(crate) fn mass_for(&self, rule: Quadrature, geometry: Geometry) -> &Table {
        match rule {
            Quadrature::Exact => self.mass(geometry),
            Quadrature::Calculix | Quadrature::CalculixModes => &self.calculix,
        }
    }
}

fn reference_mass(table: &Table) -> Vec<f64> {
    let mut mass = vec![0.0; table.NN(0).len()];
    for p in 0..table.len() {
        for (m, NN) in mass.iter_mut().zip(table.NN(p)) {
            *m += table.weight[p] * NN;
        }
    }
    mass
}

/// Returns the tables of an element kind, computed once per process.
pub(crate) fn tables(kind: ElementKind) -> &'static Tables {
    static TABLES: [OnceLock<Tables>; 6] = [const { OnceLock::new() }; 6];
    let slot = match kind {
        ElementKind::Tet4 => 0,
        ElementKind::Tet10 => 1,
        ElementKind::Hex8 => 2,
        ElementKind::Hex20 => 3,
        ElementKind::Wedge6 => 4,
        ElementKind::Wedge15 => 5,
        ElementKind::Beam2 => no_beam(),
    };
    TABLES[slot].get_or_init(|| Tables::new(kind))
}
