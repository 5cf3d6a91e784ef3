//! Stress at integration points and at nodes.
//!
//! Start at [`StressRecovery::at_nodes`]; the method is in the module above. Pa, mesh axes,
//! `xx yy zz xy yz zx`; displacements over all DoF of the model, one column per load.
//!
//! Not here: unit loads and modes of a link ([`super::StressFields`]), beams (`beam`).

use nalgebra::{DMatrix, Matrix3, SMatrix, Vector3};

use crate::element::{
    ElementWorkspace, Point, Purpose, Quadrature, edges, for_each_point, lame, mode_gradients_at, shape_functions,
};
use crate::material::Material;
use crate::mesh::{ElementBlock, ElementKind, Mesh, corner_count};
use crate::model::FeModel;

/// Node at which the stress is averaged over the elements of one material.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct NodalPlace {
    /// Index of the node.
    pub node: u32,
    /// Index of the material in `StressRecovery::distinct_materials`.
    pub material: u32,
}

/// Stress at one integration point.
#[derive(Debug, Clone, Copy)]
pub struct StressPoint<'a> {
    /// Index of the block of the element.
    pub block: usize,
    /// Index of the element in its block.
    pub element: usize,
    /// Position, m.
    pub position: Vector3<f64>,
    /// Weight times `det J`, m³.
    pub weight: f64,
    /// Stress per column, Pa: `xx yy zz xy yz zx`.
    pub stress: &'a [[f64; 6]],
}

/// Mesh whose stress is computed from displacements.
#[derive(Debug, Clone, Copy)]
pub struct StressRecovery<'a> {
    /// Mesh, link axes.
    pub mesh: &'a Mesh,
    /// Model of the mesh, for the places of its DoF.
    pub model: &'a FeModel,
    /// Material of each region.
    pub materials: &'a [Material],
    /// Quadrature with which the model was assembled; HEX8 with incompatible modes have them here
    /// too. Points are those of [`Quadrature::Calculix`].
    pub quadrature: Quadrature,
}

/// Returns the von Mises stress, in the unit of the components; it does not depend on the axes.
///
/// ```text
/// σ_v² = ½ ((σ_xx - σ_yy)² + (σ_yy - σ_zz)² + (σ_zz - σ_xx)²) + 3 (σ_xy² + σ_yz² + σ_zx²)
/// ```
pub fn von_mises([xx, yy, zz, xy, yz, zx]: [f64; 6]) -> f64 {
    let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
    (0.5 * normal + 3.0 * (xy * xy + yz * yz + zx * zx)).sqrt()
}

impl StressRecovery<'_> {
    /// Calls `visit` with the stress at every integration point of the solid elements, Pa, mesh
    /// axes.
    ///
    /// * `U`: displacements of all DoF, m; one column per load.
    ///
    /// # Panics
    /// If `U` has fewer rows than the model has DoF.
    pub fn for_each_point(&self, U: &DMatrix<f64>, mut visit: impl FnMut(StressPoint<'_>)) {
        let mut element = ElementStress::new(U.ncols());
        for (b, block) in self.solid_blocks() {
            for (e, nodes) in block.elements().enumerate() {
                element.compute(self, block, nodes, U);
                let columns = U.ncols();
                for (p, (position, weight)) in element.points.iter().enumerate() {
                    let stress = &element.stress[p * columns..(p + 1) * columns];
                    visit(StressPoint { block: b, element: e, position: *position, weight: *weight, stress });
                }
            }
        }
    }

    /// Returns the stress at nodes, Pa, mesh axes: one entry per column of `U` for the first place,
    /// then for the second, ...
    ///
    /// * `U`: displacements of all DoF, m; one column per load.
    /// * `places`: sorted, as [`Self::places`] returns them.
    ///
    /// # Panics
    /// If `U` has fewer rows than the model has DoF.
    pub fn at_nodes(&self, U: &DMatrix<f64>, places: &[NodalPlace]) -> Vec<[f64; 6]> {
        let columns = U.ncols();
        let mut sums = vec![[0.0; 6]; places.len() * columns];
        let mut counts = vec![0_u32; places.len()];
        // First place of each node; the places of a node follow each other.
        let mut first = vec![u32::MAX; self.mesh.nodes.len()];
        for (k, place) in places.iter().enumerate().rev() {
            first[place.node as usize] = k as u32;
        }
        let materials = self.material_of_regions();
        let mut element = ElementStress::new(columns);
        for (_, block) in self.solid_blocks() {
            let material = materials[block.region];
            let extrapolation = Extrapolation::of(block.kind);
            for nodes in block.elements() {
                if nodes.iter().all(|node| first[*node as usize] == u32::MAX) {
                    continue;
                }
                element.compute(self, block, nodes, U);
                extrapolation.apply(&element, columns, |i, stress| {
                    let node = nodes[i];
                    let mut k = first[node as usize] as usize;
                    while let Some(place) = places.get(k).filter(|place| place.node == node) {
                        if place.material == material {
                            counts[k] += 1;
                            let sums = &mut sums[k * columns..(k + 1) * columns];
                            sums.iter_mut().zip(stress).for_each(|(sum, own)| add(sum, own, 1.0));
                            break;
                        }
                        k += 1;
                    }
                });
            }
        }
        for (k, count) in counts.iter().enumerate() {
            let scale = 1.0 / f64::from((*count).max(1));
            for component in sums[k * columns..(k + 1) * columns].as_flattened_mut() {
                *component *= scale;
            }
        }
        sums
    }

    /// Returns the places of nodes: one per node and material that its solid elements have, sorted.
    ///
    /// * `nodes`: indices into the nodes of the mesh, in any order.
    ///
    /// # Panics
    /// For an index that is not in the mesh.
    pub fn places(&self, nodes: &[u32]) -> Vec<NodalPlace> {
        let mut wanted = vec![false; self.mesh.nodes.len()];
        nodes.iter().for_each(|node| wanted[*node as usize] = true);
        let materials = self.material_of_regions();
        let mut places = Vec::new();
        for (_, block) in self.solid_blocks() {
            let material = materials[block.region];
            let here = block.connectivity.iter().filter(|node| wanted[**node as usize]);
            places.extend(here.map(|node| NodalPlace { node: *node, material }));
        }
        places.sort_unstable();
        places.dedup();
        places
    }

    /// Returns the materials of the regions without repetition.
    pub(crate) fn distinct_materials(&self) -> Vec<Material> {
        let mut distinct: Vec<Material> = Vec::new();
        for material in self.materials {
            if !distinct.contains(material) {
                distinct.push(*material);
            }
        }
        distinct
    }

    /// Returns the index of each region's material in [`Self::distinct_materials`].
    fn material_of_regions(&self) -> Vec<u32> {
        let distinct = self.distinct_materials();
        let index = |material: &Material| distinct.iter().position(|other| other == material).unwrap_or(0);
        self.materials.iter().map(|material| index(material) as u32).collect()
    }

    fn solid_blocks(&self) -> impl Iterator<Item = (usize, &ElementBlock)> {
        self.mesh.blocks.iter().enumerate().filter(|(_, block)| !block.kind.is_beam())
    }

    /// Rule of the points; HEX8 keep their incompatible modes.
    fn rule(&self) -> Quadrature {
        if self.quadrature == Quadrature::Calculix { Quadrature::Calculix } else { Quadrature::CalculixModes }
    }
}

fn add(sum: &mut [f64; 6], stress: &[f64; 6], factor: f64) {
    sum.iter_mut().zip(stress).for_each(|(sum, own)| *sum += factor * own);
}

/// Stress of one element at its points, for all columns.
struct ElementStress {
    workspace: ElementWorkspace,
    x: Vec<Vector3<f64>>,
    /// Displacements of the nodes, then amplitudes of the incompatible modes, column by column.
    u: Vec<Vector3<f64>>,
    points: Vec<(Vector3<f64>, f64)>,
    stress: Vec<[f64; 6]>,
    columns: usize,
}

impl ElementStress {
    fn new(columns: usize) -> Self {
        let workspace = ElementWorkspace::new();
        Self { workspace, x: vec![], u: vec![], points: vec![], stress: vec![], columns }
    }

    /// Computes points and stress of one element.
    ///
    /// * `U`: displacements of all DoF, mesh axes, one column per load.
    fn compute(&mut self, source: &StressRecovery<'_>, block: &ElementBlock, nodes: &[u32], U: &DMatrix<f64>) {
        let material = &source.materials[block.region];
        let rule = source.rule();
        let with_modes = block.kind == ElementKind::Hex8 && rule == Quadrature::CalculixModes;
        self.x.clear();
        self.x.extend(nodes.iter().map(|node| source.mesh.nodes[*node as usize]));
        // Amplitudes of the incompatible modes per nodal displacement. Inverted elements were
        // rejected when the model was assembled.
        let amplitudes = if with_modes { self.workspace.mode_amplitudes(&self.x, material, rule).ok() } else { None };
        self.u.clear();
        for j in 0..self.columns {
            let start = self.u.len();
            self.u.extend(nodes.iter().map(|node| {
                let dof = source.model.dofs.of(*node as usize).start;
                U.fixed_view::<3, 1>(dof, j).into_owned()
            }));
            if let Some(amplitudes) = &amplitudes {
                let own = SMatrix::<f64, 24, 1>::from_fn(|i, _| self.u[start + i / 3][i % 3]);
                let modes = amplitudes * own;
                self.u.extend((0..3).map(|c| modes.fixed_view::<3, 1>(3 * c, 0).into_owned()));
            }
        }
        let (lambda, mu) = lame(material);
        let stride = self.u.len() / self.columns.max(1);
        self.points.clear();
        self.stress.clear();
        let Self { x, u, points, stress, .. } = self;
        let mut gradients = Vec::with_capacity(stride);
        let visited = for_each_point(block.kind, x, Purpose::Stiffness, rule, |point: &Point| {
            points.push((point.position, point.weight));
            gradients.clear();
            gradients.extend_from_slice(point.dN);
            if amplitudes.is_some() {
                gradients.extend(mode_gradients_at(x, point.xi));
            }
            for u in u.chunks_exact(stride.max(1)) {
                // H = ∇u, then Hooke's law.
                let H = u.iter().zip(&gradients).fold(Matrix3::zeros(), |sum, (u, d)| sum + u * d.transpose());
                let [xx, yy, zz] = [0, 1, 2].map(|a| 2.0 * mu * H[(a, a)] + lambda * H.trace());
                let shear = |a: usize, b: usize| mu * (H[(a, b)] + H[(b, a)]);
                stress.push([xx, yy, zz, shear(0, 1), shear(1, 2), shear(2, 0)]);
            }
        });
        debug_assert!(visited.is_ok(), "an inverted element in an assembled model");
    }
}

/// Extrapolation from the points to the nodes of an element kind.
struct Extrapolation {
    /// Corners by points.
    corners: DMatrix<f64>,
    /// Corners of each mid-side node.
    midsides: &'static [[usize; 2]],
}

impl Extrapolation {
    /// Pseudo-inverse of the corners' shape functions at the points of Calculix's rule.
    fn of(kind: ElementKind) -> Self {
        let corner_kind = match kind {
            ElementKind::Tet10 => ElementKind::Tet4,
            ElementKind::Hex20 => ElementKind::Hex8,
            ElementKind::Wedge15 => ElementKind::Wedge6,
            other => other,
        };
        let n = corner_count(kind);
        // The points of a rule are the same for every element of a kind.
        let x: Vec<Vector3<f64>> = crate::element::reference_nodes(kind).iter().map(|xi| Vector3::from(*xi)).collect();
        let mut rows = Vec::new();
        let visited = for_each_point(kind, &x, Purpose::Stiffness, Quadrature::Calculix, |point| {
            let (mut N, mut dN) = ([0.0; 8], [[0.0; 3]; 8]);
            shape_functions(corner_kind, point.xi, &mut N, &mut dN);
            rows.extend_from_slice(&N[..n]);
        });
        debug_assert!(visited.is_ok(), "the reference element is inverted");
        let at_points = DMatrix::from_row_slice(rows.len() / n, n, &rows);
        // Solution of minimum norm where points are fewer than corners (constant in TET4, along the
        // axis of WEDGE6); it exists for every matrix.
        let corners = at_points.pseudo_inverse(1e-10).unwrap_or_else(|_| DMatrix::zeros(n, rows.len() / n));
        let midsides = if kind.nodes() > n { edges(kind) } else { &[] };
        Self { corners, midsides }
    }

    /// Calls `visit` with the number of each node and its stress per column.
    fn apply(&self, element: &ElementStress, columns: usize, mut visit: impl FnMut(usize, &[[f64; 6]])) {
        let n = self.corners.nrows();
        let mut at_corners = vec![[0.0; 6]; n * columns];
        for (i, row) in self.corners.row_iter().enumerate() {
            let own = &mut at_corners[i * columns..(i + 1) * columns];
            for (p, factor) in row.iter().enumerate() {
                let stress = &element.stress[p * columns..(p + 1) * columns];
                own.iter_mut().zip(stress).for_each(|(sum, stress)| add(sum, stress, *factor));
            }
            visit(i, own);
        }
        let mut mean = vec![[0.0; 6]; columns];
        for (k, corners) in self.midsides.iter().enumerate() {
            mean.fill([0.0; 6]);
            for corner in corners {
                let own = &at_corners[corner * columns..(corner + 1) * columns];
                mean.iter_mut().zip(own).for_each(|(sum, stress)| add(sum, stress, 0.5));
            }
            visit(n + k, &mean);
        }
    }
}
