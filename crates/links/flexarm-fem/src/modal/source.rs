//! Computes the integrals of a modal link from a mesh and its condensation.
//!
//! ```text
//! solids   u = Σ N_i u_i, one shape function in x, y, z:
//!          ∫ s_a φ_b dm = x_aᵀ M_s φ_b,     ∫ φ_a φ_b dm = φ_aᵀ M_s φ_b
//! beams    φ = u + θ × r over the section, D = ∫ r rᵀ dm per length:
//!          ∫ s φᵀ dm = ∫ (μ s uᵀ + D [θ]xᵀ) dx
//!          ∫ φ_k φ_lᵀ dm = ∫ (μ u_k u_lᵀ + [θ_k]x D [θ_l]xᵀ) dx
//! ```
//! M_s, x and φ are those of the FE model, so both formulas are exact for its displacement field:
//! for solids of any shape, and for beams with four Gauss points for the cubic shapes of
//! [`Beam`].

use flexarm_spatial::symmetric_part;
use nalgebra::{DMatrix, Matrix3, Matrix3xX, Matrix6xX, Vector3};

use super::{ModalInterface, ModalLink, axial, geometric, inertia_of};
use crate::beam::{Beam, gauss4};
use crate::element::Quadrature;
use crate::error::COMPONENTS;
use crate::material::Material;
use crate::mesh::Mesh;
use crate::model::{FeModel, beam_of};
use crate::reduction::{Condensation, Interface, Superelement};
use crate::sparse::{Modes, gram};

/// Reduced mesh whose shapes are integrated.
#[derive(Debug, Clone, Copy)]
pub struct ModalSource<'a> {
    /// Mesh, link axes.
    pub mesh: &'a Mesh,
    /// Material of each region.
    pub materials: &'a [Material],
    /// Quadrature of the model.
    pub quadrature: Quadrature,
    /// Condensation of the model to the interfaces.
    pub condensation: &'a Condensation<'a>,
    /// Interfaces, proximal first.
    pub interfaces: &'a [Interface],
    /// Fixed-interface modes to keep.
    pub fixed_modes: &'a Modes,
    /// Stiffness and mass over the interfaces and these modes.
    pub superelement: &'a Superelement,
}

/// Beam element of a mesh, with its position.
pub(super) struct BeamElement {
    pub(super) beam: Beam,
    /// Rotation of the beam axes E in the link.
    pub(super) R_LE: Matrix3<f64>,
    /// Position of its first node, link axes, m.
    pub(super) p_LE: Vector3<f64>,
    /// DoF of both nodes.
    pub(super) dofs: [usize; 12],
}

impl BeamElement {
    /// Extracts the displacements of the two ends of the element, beam axes.
    ///
    /// * `U`: displacements of all DoF, link axes, one column per load or shape.
    ///
    /// Returns 12 rows and as many columns.
    pub(super) fn gather(&self, U: &DMatrix<f64>) -> DMatrix<f64> {
        let mut local = DMatrix::from_fn(12, U.ncols(), |i, j| U[(self.dofs[i], j)]);
        for mut column in local.column_iter_mut() {
            for corner in [0, 3, 6, 9] {
                let turned = self.R_LE.transpose() * column.fixed_rows::<3>(corner);
                column.fixed_rows_mut::<3>(corner).copy_from(&turned);
            }
        }
        local
    }

    /// Second mass moments of the section per length, link axes, kg·m.
    pub(super) fn section_moments(&self) -> Matrix3<f64> {
        let bar = self.beam.bar();
        let D_E = Matrix3::from_diagonal(&Vector3::new(0.0, bar.rotary_z, bar.rotary_y));
        self.R_LE * D_E * self.R_LE.transpose()
    }

    /// Position `p_L` of the centre line at `xi = x/l`, m.
    pub(super) fn point(&self, xi: f64) -> Vector3<f64> {
        self.p_LE + self.R_LE.column(0) * (xi * self.beam.length())
    }
}

/// Integrals over the body.
struct Integrals {
    mass: f64,
    first: Vector3<f64>,
    /// `∫ s sᵀ dm`.
    second: Matrix3<f64>,
    C_t: Matrix3xX<f64>,
    P: Vec<Matrix3<f64>>,
    N: Vec<Matrix3<f64>>,
}

impl ModalSource<'_> {
    /// Computes the modal link.
    ///
    /// Returns shapes, integrals, stiffness and mass over six coordinates per interface after A and
    /// one per fixed-interface mode, link axes about Lo, SI.
    ///
    /// * `name`: of the link.
    /// * `geometric`: whether to compute the geometric stiffness: 12 more solves, and a pass over
    ///   the elements.
    pub fn modal_link(&self, name: impl Into<String>, geometric: bool) -> ModalLink {
        let shapes = self.shapes();
        let n = shapes.ncols();
        let mut sums = Integrals {
            mass: 0.0,
            first: Vector3::zeros(),
            second: Matrix3::zeros(),
            C_t: Matrix3xX::zeros(n),
            P: vec![Matrix3::zeros(); n],
            N: vec![Matrix3::zeros(); n * n],
        };
        let beams = self.beams();
        sums.add_solids(self.condensation.model(), &shapes);
        for beam in &beams {
            sums.add_beam(beam, &shapes);
        }

        // Copying the transposed half makes the identity hold bit for bit.
        for k in 0..n {
            sums.N[k * n + k] = (sums.N[k * n + k] + sums.N[k * n + k].transpose()) * 0.5;
            for l in 0..k {
                sums.N[k * n + l] = sums.N[l * n + k].transpose();
            }
        }
        let block = |A: &DMatrix<f64>| symmetric_part(&A.view((6, 6), (n, n)).into_owned());
        let C_r: Vec<_> = sums.P.iter().map(axial).collect();
        ModalLink {
            name: name.into(),
            interfaces: self.modal_interfaces(n),
            mass: sums.mass,
            first_moment: sums.first,
            inertia: inertia_of(&sums.second),
            C_t: sums.C_t,
            C_r: Matrix3xX::from_columns(&C_r),
            P: sums.P,
            N: sums.N,
            M: block(&self.superelement.M),
            K: block(&self.superelement.K),
            geometric: geometric.then(|| geometric::geometric_stiffness(self, &beams, &shapes)),
            labels: labels(
                &self.superelement.interfaces[1..].iter().map(|i| &*i.name).collect::<Vec<_>>(),
                self.superelement,
            ),
            X_LA: self.interfaces[0].X_LI,
        }
    }

    /// Displacements of all DoF with A clamped: under unit wrenches on the interfaces after the
    /// first, under the inertia loads, and in the fixed-interface modes.
    ///
    /// Returns one row per DoF of the model (m, rad; link axes) and one column per unit load and
    /// mode, in the order of [`StressFields::stress`](crate::stress::StressFields).
    pub fn displacements(&self) -> DMatrix<f64> {
        let (under_loads, modes) = (geometric::displacements_under_loads(self), &self.fixed_modes.shapes);
        let wrenches = under_loads.ncols() - geometric::FIELDS;
        let mut U = DMatrix::zeros(under_loads.nrows(), under_loads.ncols() + modes.ncols());
        U.columns_mut(0, wrenches).copy_from(&under_loads.columns(geometric::FIELDS, wrenches));
        U.columns_mut(wrenches, geometric::FIELDS).copy_from(&under_loads.columns(0, geometric::FIELDS));
        U.columns_mut(under_loads.ncols(), modes.ncols()).copy_from(modes);
        U
    }

    /// Displacements φ of all DoF per coordinate, A clamped, link axes: static shapes of the
    /// interfaces after the first, then modes.
    pub(super) fn shapes(&self) -> DMatrix<f64> {
        let (T, modes) = (self.condensation.shapes(), &self.fixed_modes.shapes);
        let statics = T.ncols() - 6;
        let n = statics + self.fixed_modes.len();
        let mut shapes = DMatrix::zeros(T.nrows(), n);
        shapes.columns_mut(0, statics).copy_from(&T.columns(6, statics));
        shapes.columns_mut(statics, n - statics).copy_from(&modes.columns(0, n - statics));
        shapes
    }

    fn modal_interfaces(&self, n: usize) -> Vec<ModalInterface> {
        let one = |(i, interface): (usize, &Interface)| ModalInterface {
            name: interface.name.clone(),
            X_LI: interface.X_LI,
            Phi: unit_shapes(i, n),
        };
        self.interfaces[1..].iter().enumerate().map(one).collect()
    }

    /// Beam elements of the mesh, with the axes of their sections.
    pub(super) fn beams(&self) -> Vec<BeamElement> {
        let model = self.condensation.model();
        let mut beams = Vec::new();
        for block in self.mesh.blocks.iter().filter(|block| block.kind.is_beam()) {
            for nodes in block.elements() {
                // Invalid beams were rejected when the model was assembled.
                let Ok((beam, Q)) = beam_of(self.mesh, block.region, nodes, &self.materials[block.region]) else {
                    continue;
                };
                let dof = |i: usize| model.dofs.of(nodes[i / 6] as usize).start + i % 6;
                beams.push(BeamElement {
                    beam,
                    R_LE: Q.fixed_view::<3, 3>(0, 0).into_owned(),
                    p_LE: self.mesh.nodes[nodes[0] as usize],
                    dofs: std::array::from_fn(dof),
                });
            }
        }
        beams
    }
}

/// Unit columns of the six coordinates of interface `i`, counted without A.
pub(super) fn unit_shapes(i: usize, n: usize) -> Matrix6xX<f64> {
    Matrix6xX::from_fn(n, |r, c| if c == 6 * i + r { 1.0 } else { 0.0 })
}

/// Descriptions of the coordinates of a superelement whose first interface is clamped.
pub(super) fn labels(interfaces: &[&str], element: &Superelement) -> Vec<String> {
    let statics = interfaces.iter().flat_map(|name| COMPONENTS.iter().map(move |c| format!("{name} {c}")));
    let modes = element.fixed_frequencies_hz().into_iter().enumerate();
    statics.chain(modes.map(|(k, hz)| format!("fixed-interface mode {}: {hz:.3} Hz", k + 1))).collect()
}

/// Rows of one axis of all nodes with DoF.
fn rows_of(model: &FeModel, axis: usize, A: &DMatrix<f64>) -> DMatrix<f64> {
    let used: Vec<usize> = (0..model.nodes.len()).filter(|node| !model.dofs.of(*node).is_empty()).collect();
    DMatrix::from_fn(used.len(), A.ncols(), |i, j| A[(model.dofs.of(used[i]).start + axis, j)])
}

impl Integrals {
    /// Adds the integrals over the solids; see the module.
    fn add_solids(&mut self, model: &FeModel, shapes: &DMatrix<f64>) {
        let n = shapes.ncols();
        let M_shapes = model.M.solid_product(shapes);

        // 1, x, y, z of the nodes, stored in their first component.
        let mut places = DMatrix::zeros(model.size(), 4);
        for (node, p) in model.nodes.iter().enumerate().filter(|(node, _)| !model.dofs.of(*node).is_empty()) {
            let row = model.dofs.of(node).start;
            places.row_mut(row).copy_from_slice(&[1.0, p.x, p.y, p.z]);
        }
        let X = rows_of(model, 0, &places);
        let moments = gram(&X, &rows_of(model, 0, &model.M.solid_product(&places)));
        self.mass += moments[(0, 0)];
        self.first += Vector3::from_fn(|a, _| moments[(0, 1 + a)]);
        self.second += moments.fixed_view::<3, 3>(1, 1);

        // One axis at a time: copies of all three would dominate the memory.
        for b in 0..3 {
            let M_axis = rows_of(model, b, &M_shapes);
            let with_places = gram(&X, &M_axis);
            for k in 0..n {
                self.C_t[(b, k)] += with_places[(0, k)];
                for a in 0..3 {
                    self.P[k][(a, b)] += with_places[(1 + a, k)];
                }
            }
            for a in 0..=b {
                let products = gram(&rows_of(model, a, shapes), &M_axis);
                for (k, l) in (0..n).flat_map(|k| (k..n).map(move |l| (k, l))) {
                    self.N[k * n + l][(a, b)] += products[(k, l)];
                    if a != b {
                        self.N[k * n + l][(b, a)] += products[(l, k)];
                    }
                }
            }
        }
    }

    /// Adds the integrals over one beam element, by four Gauss points; see the module.
    fn add_beam(&mut self, element: &BeamElement, shapes: &DMatrix<f64>) {
        let n = shapes.ncols();
        let (l, mu) = (element.beam.length(), element.beam.bar().mass_per_length);
        let ends = element.gather(shapes);
        let D = element.section_moments();
        for (xi, weight) in gauss4() {
            let w = weight * l;
            let section = element.beam.section_at(xi);
            let U = element.R_LE * (section.u * &ends);
            let theta = element.R_LE * (section.theta * &ends);
            let s = element.point(xi);

            self.mass += w * mu;
            self.first += s * (w * mu);
            self.second += (s * s.transpose() * mu + D) * w;
            // [θ_k]x of each coordinate.
            let turns: Vec<Matrix3<f64>> = (0..n).map(|k| theta.column(k).into_owned().cross_matrix()).collect();
            for k in 0..n {
                let u_k = U.column(k);
                self.C_t.column_mut(k).axpy(w * mu, &u_k, 1.0);
                self.P[k] += (s * u_k.transpose() * mu + D * turns[k].transpose()) * w;
                let turned = turns[k] * D;
                for (l, turn) in turns.iter().enumerate().skip(k) {
                    self.N[k * n + l] += (u_k * U.column(l).transpose() * mu + turned * turn.transpose()) * w;
                }
            }
        }
    }
}
