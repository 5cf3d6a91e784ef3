//! Geometric stiffness: contribution of a static stress to the stiffness of the shapes.
//!
//! ```text
//! G_kl = ∫ Σ_c ∇φ_k,cᵀ σ ∇φ_l,c dV        σ: stress under one unit load, A held
//! ```
//! Solids: evaluated at the quadrature points, with the stress from the displacement gradients (for
//! HEX8 without the incompatible modes, so its bending stress is only as accurate as that of a
//! brick without them).
//!
//! Beams: the same with plane sections, from the internal forces N, V, T, M of each element, which
//! are linear between its ends (end forces are exact; only the curvature of N and M within an
//! element is lost):
//!
//! ```text
//! N (v'v' + w'w' + r² θx'θx') - M_y v'θx' - M_z w'θx' + V_y w'θx - V_z v'θx + T/2 (θy'θz - θz'θy)
//! r² = polar/mass
//! ```
//! Terms in the axial strain u' are omitted: they are as small as the strain of the load. Bending
//! moments are then pairs of axial forces of fixed direction. At both ends of each element they are
//! corrected to rotate by half the section rotation (semi-tangential, as torques already are);
//! without this, frames with bends are wrong:
//!
//! ```text
//! G_θθ = -M_z (θx θy + θy θx)/2 + M_y (θx θz + θz θx)/2         at each end, M on the element
//! ```
//! These terms cancel at a node between collinear elements.
//!
//! Rigid ties rotate with their interface. The second-order part of that motion, `θ × (θ × r)/2` at
//! each tied node, does work with the forces f of the tie:
//!
//! ```text
//! G_θθ = Σ (r fᵀ + f rᵀ)/2 - (r·f) 1
//! ```
//! so an interface beyond the elastic part buckles correctly, and torques on it are
//! semi-tangential: their virtual work is that on the rotation vector. For distributing ties this
//! term is not included.
//!
//! Source: Przemieniecki (1968), chapter 15; Argyris, Dunne & Scharpf (1978), *Comput. Meth. Appl.
//! Mech. Eng.* 14, for moments; Wallrapp & Schwertassek (1991), *Int. J. Numer. Meth. Eng.* 32, for
//! the unit loads of the floating frame.

use flexarm_spatial::symmetric_part;
use nalgebra::{DMatrix, Matrix3, Vector3};

use super::source::{BeamElement, ModalSource};
use super::{GeometricStiffness, axial};
use crate::beam::gauss4;
use crate::element::{Purpose, for_each_point, lame};
use crate::reduction::Tie;
use crate::sparse::add_product;

/// Number of acceleration fields of the floating frame: three linear, three angular, six
/// centrifugal.
pub(super) const FIELDS: usize = 12;

/// Acceleration field that is linear in position: `a = A s + b`.
pub(crate) struct Field {
    pub(crate) A: Matrix3<f64>,
    pub(crate) b: Vector3<f64>,
}

impl Field {
    /// Unit field `i` of [`FIELDS`].
    pub(crate) fn unit(i: usize) -> Self {
        let e = |a: usize| Vector3::ith(a, 1.0);
        let (zero, none) = (Matrix3::zeros(), Vector3::zeros());
        match i {
            0..3 => Self { A: zero, b: e(i) },
            3..6 => Self { A: e(i - 3).cross_matrix(), b: none },
            // ω × (ω × s) = ω (ω·s) - ω² s
            6..9 => Self { A: e(i - 6) * e(i - 6).transpose() - Matrix3::identity(), b: none },
            _ => {
                let (a, b) = [(0, 1), (0, 2), (1, 2)][i - 9];
                Self { A: e(a) * e(b).transpose() + e(b) * e(a).transpose(), b: none }
            }
        }
    }

    /// Acceleration at the position s, both in link axes.
    fn at(&self, s: &Vector3<f64>) -> Vector3<f64> {
        self.A * s + self.b
    }
}

/// Computes the geometric stiffness of all unit loads.
///
/// * `shapes`: displacements of all DoF per coordinate, link axes.
///
/// Returns one n×n matrix per load for n coordinates, symmetric.
pub(super) fn geometric_stiffness(
    source: &ModalSource<'_>,
    beams: &[BeamElement],
    shapes: &DMatrix<f64>,
) -> GeometricStiffness {
    // Static displacements U of the mesh under each unit load.
    let model = source.condensation.model();
    let beam_forces: Vec<_> = beams.iter().map(element_forces).collect();
    let F = inertia_forces(source, beams, &beam_forces);
    let U = displacements(source, &F);
    let loads = U.ncols();

    // Work of the stress of each load over the second-order strains of the shapes.
    let n = shapes.ncols();
    let mut G = vec![DMatrix::zeros(n, n); loads];
    add_solids(source, &U, shapes, &mut G);
    for (beam, forces) in beams.iter().zip(&beam_forces) {
        add_beam(beam, forces, &U, shapes, &mut G);
    }
    // Ties carry the forces K U - F that their nodes exert; the first loads are those of inertia.
    let mut on_mesh = model.K.product(&U);
    for j in 0..FIELDS {
        on_mesh.column_mut(j).axpy(-1.0, &F.column(j), 1.0);
    }
    add_ties(source, &on_mesh, &mut G);

    // Matrices in the order of the loads.
    let mut G = G.into_iter().map(|G| symmetric_part(&G));
    let mut next = || G.next().unwrap_or_else(|| DMatrix::zeros(n, n));
    GeometricStiffness {
        acceleration: std::array::from_fn(|_| next()),
        angular: std::array::from_fn(|_| next()),
        centrifugal: std::array::from_fn(|_| next()),
        interface: (1..source.interfaces.len()).map(|_| std::array::from_fn(|_| next())).collect(),
    }
}

/// Displacements of all DoF (m, rad; link axes) with A clamped, under the [`FIELDS`] inertia loads,
/// then under unit wrenches on the interfaces after the first.
pub(super) fn displacements_under_loads(source: &ModalSource<'_>) -> DMatrix<f64> {
    let beams = source.beams();
    let beam_forces: Vec<_> = beams.iter().map(element_forces).collect();
    displacements(source, &inertia_forces(source, &beams, &beam_forces))
}

/// As [`displacements_under_loads`], for given inertia forces.
fn displacements(source: &ModalSource<'_>, F: &DMatrix<f64>) -> DMatrix<f64> {
    let wrenches = source.condensation.unit_load_shapes();
    let mut U = DMatrix::zeros(F.nrows(), FIELDS + wrenches.ncols());
    let mut under_inertia = F.clone();
    source.condensation.solve_held(&mut under_inertia);
    U.columns_mut(0, FIELDS).copy_from(&under_inertia);
    U.columns_mut(FIELDS, wrenches.ncols()).copy_from(&wrenches);
    U
}

/// Inertia forces on all DoF, link axes (N, N·m), one column per field.
///
/// * `beam_forces`: those of each beam element, 12 rows, beam axes.
fn inertia_forces(source: &ModalSource<'_>, beams: &[BeamElement], beam_forces: &[DMatrix<f64>]) -> DMatrix<f64> {
    let mut F = solid_forces(source);
    for (beam, forces) in beams.iter().zip(beam_forces) {
        for (i, dof) in beam.dofs.iter().enumerate() {
            let corner = i / 3 * 3;
            for j in 0..FIELDS {
                let turned = beam.R_LE * forces.fixed_view::<3, 1>(corner, j);
                F[(*dof, j)] += turned[i - corner];
            }
        }
    }
    F
}

/// `-∫ Nᵀ a dm` over the solids; the nodal interpolation of a linear field is exact.
fn solid_forces(source: &ModalSource<'_>) -> DMatrix<f64> {
    let model = source.condensation.model();
    let fields: [Field; FIELDS] = std::array::from_fn(Field::unit);
    let mut a = DMatrix::zeros(model.size(), FIELDS);
    for (node, s) in model.nodes.iter().enumerate() {
        let dofs = model.dofs.of(node);
        for (j, field) in fields.iter().enumerate().filter(|_| !dofs.is_empty()) {
            a.view_mut((dofs.start, j), (3, 1)).copy_from(&field.at(s));
        }
    }
    -model.M.solid_product(&a)
}

/// `-∫ (N_uᵀ a μ + N_θᵀ ∫ r × (A r) dm) dx` of one beam, beam axes, one column per field.
fn element_forces(element: &BeamElement) -> DMatrix<f64> {
    let (l, mu) = (element.beam.length(), element.beam.bar().mass_per_length);
    let D = element.section_moments();
    let R_EL = element.R_LE.transpose();
    let mut F = DMatrix::zeros(12, FIELDS);
    for (xi, weight) in gauss4() {
        let section = element.beam.section_at(xi);
        let s = element.point(xi);
        for j in 0..FIELDS {
            let field = Field::unit(j);
            let force = R_EL * field.at(&s) * mu;
            let torque = R_EL * axial(&(D * field.A.transpose()));
            let nodal = section.u.transpose() * force + section.theta.transpose() * torque;
            F.column_mut(j).axpy(-weight * l, &nodal, 1.0);
        }
    }
    F
}

/// Adds `∫ Σ_c ∇φ_k,cᵀ σ ∇φ_l,c dV` over the solids, for the stress σ of each column of `U`.
fn add_solids(source: &ModalSource<'_>, U: &DMatrix<f64>, shapes: &DMatrix<f64>, G: &mut [DMatrix<f64>]) {
    let model = source.condensation.model();
    let (n, loads) = (shapes.ncols(), U.ncols());
    for block in source.mesh.blocks.iter().filter(|block| !block.kind.is_beam()) {
        let material = &source.materials[block.region];
        let (lambda, mu) = lame(material);
        for nodes in block.elements() {
            let x: Vec<_> = nodes.iter().map(|node| source.mesh.nodes[*node as usize]).collect();
            let dof = |i: usize| model.dofs.of(nodes[i] as usize).start;
            // Displacement gradients at a point: [c, b] = du_c/dx_b.
            let gradient = |A: &DMatrix<f64>, column: usize, dN: &[Vector3<f64>]| {
                dN.iter()
                    .enumerate()
                    .fold(Matrix3::zeros(), |sum, (i, d)| sum + A.fixed_view::<3, 1>(dof(i), column) * d.transpose())
            };
            // Nine rows per point: gradients times weighted stress on one side, gradients on the
            // other.
            let (mut right, mut stresses) = (Vec::new(), Vec::new());
            let visited = for_each_point(block.kind, &x, Purpose::Stiffness, source.quadrature, |point| {
                for k in 0..n {
                    right.push(gradient(shapes, k, point.dN));
                }
                for j in 0..loads {
                    let H = gradient(U, j, point.dN);
                    let stress = (H + H.transpose()) * mu + Matrix3::identity() * (lambda * H.trace());
                    stresses.push(stress * point.weight);
                }
            });
            // Inverted elements were rejected when the model was assembled.
            if visited.is_err() {
                continue;
            }
            let points = right.len() / n;
            let entry = |row: usize| (row / 9, row % 9 / 3, row % 3);
            let B = DMatrix::from_fn(9 * points, n, |row, k| {
                let (p, c, b) = entry(row);
                right[p * n + k][(c, b)]
            });
            // G += A B with A[k, (p, c, b)] = (∇φ_k σ_p w_p)_cb, B[(p, c, b), l] = (∇φ_l)_cb.
            for (j, G) in G.iter_mut().enumerate() {
                let stressed: Vec<_> = (0..points * n).map(|at| right[at] * stresses[at / n * loads + j]).collect();
                let A = DMatrix::from_fn(n, 9 * points, |k, row| {
                    let (p, c, b) = entry(row);
                    stressed[p * n + k][(c, b)]
                });
                add_product(G, 1.0, &A, &B);
            }
        }
    }
}

/// Adds the work of the internal forces of one beam element; see the module.
///
/// * `forces`: its inertia forces, 12 rows, beam axes.
/// * `U`: displacements of all DoF under each load; `shapes`: per coordinate.
fn add_beam(
    element: &BeamElement,
    forces: &DMatrix<f64>,
    U: &DMatrix<f64>,
    shapes: &DMatrix<f64>,
    G: &mut [DMatrix<f64>],
) {
    let bar = element.beam.bar();
    let l = element.beam.length();
    // Squared polar radius of gyration of the section.
    let r2 = (bar.rotary_y + bar.rotary_z) / bar.mass_per_length;
    let K = element.beam.stiffness12();
    // End forces of the element: K u minus the inertia forces on it.
    let mut ends = K * element.gather(U);
    let mut inertia = ends.columns_mut(0, FIELDS);
    inertia -= forces;
    let local = element.gather(shapes);

    for (j, G) in G.iter_mut().enumerate() {
        for at in [3, 9] {
            let (M_y, M_z) = (ends[(at + 1, j)], ends[(at + 2, j)]);
            // Semi-tangential correction of the end moments.
            let turning = Matrix3::new(0.0, -M_z, M_y, -M_z, 0.0, 0.0, M_y, 0.0, 0.0) * 0.5;
            let theta = local.fixed_rows::<3>(at);
            *G += theta.transpose() * turning * theta;
        }
    }
    for (xi, weight) in gauss4() {
        let w = weight * l;
        let section = element.beam.section_at(xi);
        let du = section.du * &local;
        let (theta, dtheta) = (section.theta * &local, section.dtheta * &local);
        let (dv, dw) = (du.row(1).transpose(), du.row(2).transpose());
        let [tx, ty, tz] = [0, 1, 2].map(|a| theta.row(a).transpose());
        let [dtx, dty, dtz] = [0, 1, 2].map(|a| dtheta.row(a).transpose());
        let both = |a: &nalgebra::DVector<f64>, b: &nalgebra::DVector<f64>| a * b.transpose() + b * a.transpose();
        // Quadratic forms of each internal force (module documentation).
        let of_N = &dv * dv.transpose() + &dw * dw.transpose() + &dtx * dtx.transpose() * r2;
        let of_Vy = both(&dw, &tx);
        let of_Vz = -both(&dv, &tx);
        let of_T = (both(&dty, &tz) - both(&dtz, &ty)) * 0.5;
        let of_My = -both(&dv, &dtx);
        let of_Mz = -both(&dw, &dtx);
        for (j, G) in G.iter_mut().enumerate() {
            let end = ends.column(j);
            // Internal force on the section facing +x.
            let inside = |i: usize| w * (-(1.0 - xi) * end[i] + xi * end[6 + i]);
            let parts = [&of_N, &of_Vy, &of_Vz, &of_T, &of_My, &of_Mz];
            for (i, part) in parts.into_iter().enumerate() {
                *G += part * inside(i);
            }
        }
    }
}

/// Adds the forces of rigid ties times the second-order part of their motion.
///
/// * `on_mesh`: `K U - F`, the forces of the ties on the mesh.
fn add_ties(source: &ModalSource<'_>, on_mesh: &DMatrix<f64>, G: &mut [DMatrix<f64>]) {
    let model = source.condensation.model();
    for (i, interface) in source.interfaces.iter().enumerate().skip(1).filter(|(_, i)| i.tie == Tie::Rigid) {
        let mut nodes = interface.nodes.clone();
        nodes.sort_unstable();
        nodes.dedup();
        for (j, G) in G.iter_mut().enumerate() {
            let mut sum = Matrix3::zeros();
            for node in nodes.iter().map(|node| *node as usize).filter(|node| !model.dofs.of(*node).is_empty()) {
                let r = model.nodes[node] - interface.X_LI.translation.vector;
                let f: Vector3<f64> = on_mesh.fixed_view::<3, 1>(model.dofs.of(node).start, j).into_owned();
                sum += (r * f.transpose() + f * r.transpose()) * 0.5 - Matrix3::identity() * r.dot(&f);
            }
            let at = 6 * (i - 1) + 3;
            let mut block = G.view_mut((at, at), (3, 3));
            block += sum;
        }
    }
}
