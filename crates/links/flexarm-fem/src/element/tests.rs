//! Elements against closed forms, integrals with matrices, finer rules and rigid motions.
//!
//! Each kind is tested on straight and on distorted elements. Truths: partition of unity, central
//! differences, six rigid motions without force, constant strain, volume, `∫ Bᵀ D B`. SI units.
//! Not here: assembled meshes (`model`), stress (`stress/tests.rs`).

use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, Vector3};

use super::geometry::{InversionPoint, Nodes};
use super::quadrature::tet_collapsed;
use super::rules::{TET10_DISTORTIONS, Table, tables};
use super::*;
use crate::material::Material;
use crate::mesh::ElementKind::{self, Hex8, Hex20, Tet4, Tet10, Wedge6, Wedge15};
use crate::test_mesh::{Noise, SOLIDS, cube, positions};

const STEEL: Material = Material::STEEL;

/// Distorted element of 10 cm far from the origin: corners moved by a tenth, mid-edge nodes also
/// moved by `curvature`.
fn distorted(kind: ElementKind, curvature: f64, seed: u64) -> Vec<Vector3<f64>> {
    let mut noise = Noise(seed);
    let nodes = reference_nodes(kind);
    let corners = match kind {
        Tet4 | Tet10 => 4,
        Wedge6 | Wedge15 => 6,
        _ => 8,
    };
    let mut x: Vec<Vector3<f64>> = nodes[..corners]
        .iter()
        .map(|xi| 0.1 * (Vector3::from(*xi) + 0.1 * noise.vector()) + Vector3::repeat(0.7))
        .collect();
    for [a, b] in edges(kind).iter().take(nodes.len() - corners) {
        let middle = (x[*a] + x[*b]) * 0.5;
        x.push(middle + curvature * 0.1 * noise.vector());
    }
    x
}

fn matrices(kind: ElementKind, x: &[Vector3<f64>], rule: Quadrature) -> (DMatrix<f64>, DMatrix<f64>) {
    let mut workspace = ElementWorkspace::new();
    workspace.stiffness_and_mass(kind, x, &STEEL, rule).unwrap();
    let n = kind.nodes();
    let K = DMatrix::from_row_slice(3 * n, 3 * n, workspace.stiffness());
    (K, DMatrix::from_row_slice(n, n, workspace.mass()))
}

/// Identity: shape functions add up to one and their derivatives to zero; each is one at its node.
#[test]
fn shape_functions_are_a_partition_of_unity_and_one_at_their_own_node() {
    for kind in SOLIDS {
        let n = kind.nodes();
        let (mut N, mut dN) = (vec![0.0; n], vec![[0.0; 3]; n]);
        shape_functions(kind, [0.21, 0.13, -0.37], &mut N, &mut dN);
        assert!((N.iter().sum::<f64>() - 1.0).abs() < 1e-14); // measured 4e-16
        for c in 0..3 {
            assert!(dN.iter().map(|d| d[c]).sum::<f64>().abs() < 1e-14); // measured 6e-16
        }
        for (i, xi) in reference_nodes(kind).iter().enumerate() {
            shape_functions(kind, *xi, &mut N, &mut dN);
            for (j, N_j) in N.iter().enumerate() {
                assert!((N_j - f64::from(u8::from(i == j))).abs() < 1e-15, "{} {i} {j}", kind.name());
            }
        }
    }
}

/// Second algorithm: central differences, error h² N''' / 6 with N''' of order one.
#[test]
fn derivatives_of_shape_functions_agree_with_central_differences() {
    let h = 1e-5;
    for kind in SOLIDS {
        let n = kind.nodes();
        let (mut N, mut dN, mut unused) = ([vec![0.0; n], vec![0.0; n]], vec![[0.0; 3]; n], vec![[0.0; 3]; n]);
        let xi = [0.23, 0.31, -0.17];
        for c in 0..3 {
            for (N, sign) in N.iter_mut().zip([-1.0, 1.0]) {
                let mut moved = xi;
                moved[c] += sign * h;
                shape_functions(kind, moved, N, &mut unused);
            }
            shape_functions(kind, xi, &mut unused.iter().map(|_| 0.0).collect::<Vec<_>>(), &mut dN);
            for i in 0..n {
                let error = ((N[1][i] - N[0][i]) / (2.0 * h) - dN[i][c]).abs();
                assert!(error < 1e-9, "{} {i} {c}: {error:.1e}", kind.name()); // measured 4e-12
            }
        }
    }
}

/// Physics: a rigid motion causes no strain; includes curved elements and both rules.
#[test]
fn rigid_motions_cost_no_force_on_distorted_elements() {
    for kind in SOLIDS {
        for (curvature, rule) in [(0.0, Quadrature::Exact), (0.08, Quadrature::Exact), (0.08, Quadrature::Calculix)] {
            let x = distorted(kind, curvature, 3);
            let (K, _) = matrices(kind, &x, rule);
            let size = K.amax();
            for mode in 0..6 {
                let axis = Vector3::ith(mode % 3, 1.0);
                let u = x.iter().flat_map(|x| if mode < 3 { axis } else { axis.cross(x) }.data.0[0]);
                let force = &K * DVector::from_iterator(K.ncols(), u);
                assert!(force.amax() < 1e-12 * size, "{}: {:.1e}", kind.name(), force.amax() / size); // measured 1e-15
            }
        }
    }
}

/// Physics: an unsupported elastic body has exactly six motions without strain. The exception is a
/// property of CalculiX: the two points of C3D6 miss one of its deformations.
#[test]
fn every_element_has_exactly_six_modes_without_strain() {
    for kind in SOLIDS {
        for (curvature, rule) in [(0.0, Quadrature::Exact), (0.05, Quadrature::Exact), (0.05, Quadrature::Calculix)] {
            let (K, _) = matrices(kind, &distorted(kind, curvature, 5), rule);
            let mut values: Vec<f64> = K.symmetric_eigenvalues().iter().copied().collect();
            values.sort_by(f64::total_cmp);
            let largest = values[values.len() - 1];
            if (kind, rule) == (Wedge6, Quadrature::Calculix) {
                assert_eq!(values.iter().filter(|v| v.abs() < 1e-13 * largest).count(), 7);
                continue;
            }
            // measured: zeros below 2e-16, then at least 1.2e-3 of the largest
            assert!(values[..6].iter().all(|v| v.abs() < 1e-13 * largest), "{} {values:?}", kind.name());
            assert!(values[6] > 1e-4 * largest, "{} {:.1e}", kind.name(), values[6] / largest);
        }
    }
}

#[test]
fn stiffness_and_mass_are_symmetric_to_the_last_bit() {
    for kind in SOLIDS {
        for rule in [Quadrature::Exact, Quadrature::Calculix] {
            let (K, M) = matrices(kind, &distorted(kind, 0.05, 7), rule);
            assert_eq!(K, K.transpose());
            assert_eq!(M, M.transpose());
        }
    }
}

/// Physics: the patch test. Boundary nodes of a distorted patch follow a linear field; in
/// equilibrium the inner nodes follow it too, and the stress is constant. Quadratic elements have
/// curved faces inside.
#[test]
fn constant_strain_passes_through_a_distorted_patch_unchanged() {
    for kind in SOLIDS {
        for (curved, rule) in [(true, Quadrature::Exact), (false, Quadrature::Exact), (false, Quadrature::Calculix)] {
            let mut noise = Noise(11);
            let mut inner = vec![];
            let mesh = cube(kind, [2, 2, 2], curved, |x| {
                let inside = x.iter().all(|x| *x > 0.0 && *x < 1.0);
                inner.push(inside);
                if inside { x + 0.04 * noise.vector() } else { x }
            });
            let inside = |x: &Vector3<f64>| x.iter().all(|x| *x > 1e-9 && *x < 1.0 - 1e-9);
            let gradient = Matrix3::new(1.0, 0.3, -0.2, 0.1, -0.7, 0.4, 0.6, 0.2, 0.5) * 1e-3;
            let exact =
                DVector::from_iterator(3 * mesh.nodes.len(), mesh.nodes.iter().flat_map(|x| (gradient * x).data.0[0]));

            let mut K = DMatrix::zeros(exact.len(), exact.len());
            for element in mesh.blocks[0].elements() {
                let (K_e, _) = matrices(kind, &positions(&mesh, element), rule);
                for (i, j) in (0..K_e.nrows()).flat_map(|i| (0..K_e.ncols()).map(move |j| (i, j))) {
                    K[(3 * element[i / 3] as usize + i % 3, 3 * element[j / 3] as usize + j % 3)] += K_e[(i, j)];
                }
            }
            let free: Vec<usize> = (0..exact.len()).filter(|d| inside(&mesh.nodes[d / 3])).collect();
            assert!(!free.is_empty());
            let mut given = exact.clone();
            free.iter().for_each(|d| given[*d] = 0.0);
            let load = (&K * &given).select_rows(&free);
            let u = K.select_rows(&free).select_columns(&free).cholesky().unwrap().solve(&-load);
            let error = (u - exact.select_rows(&free)).amax() / exact.amax();
            assert!(error < 1e-12, "{} {curved} {rule:?}: {error:.1e}", kind.name()); // measured 2.5e-15
        }
    }
}

/// Conservation: the mass matrix gives density times volume; both rules, curved elements.
#[test]
fn the_mass_of_an_element_is_its_density_times_its_volume() {
    for kind in SOLIDS {
        for rule in [Quadrature::Exact, Quadrature::Calculix] {
            let x = distorted(kind, 0.05, 13);
            let (_, M) = matrices(kind, &x, rule);
            let mut volume = 0.0;
            for_each_point(kind, &x, Purpose::Mass, rule, |point| volume += point.weight).unwrap();
            assert!((M.sum() / (STEEL.rho * volume) - 1.0).abs() < 1e-13); // measured 8e-16
        }
    }
}

/// Truth: ∫ a! b! c! d! / (a+b+c+d+3)! over a straight tetrahedron: rho V/20 for TET4, rho V/420
/// for TET10.
#[test]
fn mass_of_straight_tetrahedra_is_the_closed_form() {
    let volume =
        |x: &[Vector3<f64>]| Matrix3::from_columns(&[x[1] - x[0], x[2] - x[0], x[3] - x[0]]).determinant() / 6.0;
    let x = distorted(Tet4, 0.0, 17);
    let ((_, M), volume_4) = (matrices(Tet4, &x, Quadrature::Exact), volume(&x));
    let scale = STEEL.rho * volume_4 / 20.0;
    let exact = DMatrix::from_fn(4, 4, |i, j| if i == j { 2.0 * scale } else { scale });
    assert!((&M - &exact).amax() < 1e-13 * exact.amax());

    let x = distorted(Tet10, 0.0, 17);
    let ((_, M), volume) = (matrices(Tet10, &x, Quadrature::Exact), volume(&x));
    let ends = |i: usize| if i < 4 { [i, i] } else { edges(Tet10)[i - 4] };
    let exact = DMatrix::from_fn(10, 10, |i, j| {
        let shared = ends(i).iter().filter(|a| ends(j).contains(a)).count();
        let factor = match (i < 4, j < 4) {
            (true, true) if i == j => 6.0,
            (true, true) => 1.0,
            (false, false) => [8.0, 16.0, 32.0][shared],
            _ if shared > 0 => -4.0,
            _ => -6.0,
        };
        STEEL.rho * volume / 420.0 * factor
    });
    assert!((&M - &exact).amax() < 1e-13 * exact.amax());
}

/// Second algorithm: mass of curved elements by a rule of much higher degree.
#[test]
fn mass_of_curved_elements_is_exact() {
    for kind in [Tet10, Hex8, Hex20, Wedge6, Wedge15] {
        let x = distorted(kind, 0.08, 19);
        let (_, M) = matrices(kind, &x, Quadrature::Exact);
        let points = match kind {
            Tet10 => tet_collapsed(7),
            Hex8 | Hex20 => super::quadrature::brick(7),
            _ => super::quadrature::wedge(7, 7),
        };
        let (table, nodes) = (Table::new(kind, &points), Nodes::new(kind, &x));
        let mut fine = DMatrix::zeros(M.nrows(), M.ncols());
        for p in 0..table.len() {
            let det = super::geometry::Jacobian::new(nodes.n, table.dN(p), &nodes.x).det;
            let N = DVector::from_column_slice(table.N(p));
            fine += STEEL.rho * table.weight[p] * det * &N * N.transpose();
        }
        assert!((&M - &fine).amax() < 1e-13 * fine.amax(), "{}", kind.name()); // measured 5e-15
    }
}

/// Second algorithm: 12³ points. The basis of the table [`TET10_DISTORTIONS`].
#[test]
fn the_stiffness_of_a_curved_tetrahedron_does_not_depend_on_the_rule() {
    let mut noise = Noise(23);
    let (fine, mut tried) = (tet_collapsed(12), [0; 5]);
    while tried.iter().any(|count| *count < 10) {
        // Curvatures of all magnitudes, on tetrahedra of all shapes.
        let curvature = 10.0_f64.powf(-2.0 + 1.5 * noise.next());
        let mut x: Vec<Vector3<f64>> =
            reference_nodes(Tet10)[..4].iter().map(|xi| Vector3::from(*xi) + 0.2 * noise.vector()).collect();
        for [a, b] in edges(Tet10) {
            x.push((x[*a] + x[*b]) * 0.5 + curvature * noise.vector());
        }
        let super::geometry::Geometry::Curved(distortion) = Nodes::new(Tet10, &x).geometry else { unreachable!() };
        let Some(class) = TET10_DISTORTIONS.iter().position(|limit| distortion <= *limit) else { continue };
        tried[class] += 1;

        let (K, _) = matrices(Tet10, &x, Quadrature::Exact);
        let (table, nodes) = (Table::new(Tet10, &fine), Nodes::new(Tet10, &x));
        let D = stress_strain(&STEEL);
        let mut K_fine = DMatrix::zeros(30, 30);
        for p in 0..table.len() {
            let jacobian = super::geometry::Jacobian::new(10, table.dN(p), &nodes.x);
            let mut g = [0.0; 30];
            jacobian.gradients(10, table.dN(p), 10, &mut g);
            let B = strain_matrix(&(0..10).map(|i| Vector3::new(g[i], g[10 + i], g[20 + i])).collect::<Vec<_>>());
            K_fine += table.weight[p] * jacobian.det * B.transpose() * D * B;
        }
        let error = (&K - &K_fine).amax() / K_fine.amax();
        assert!(error < 3e-8, "distortion {distortion:.1e}: {error:.1e}"); // measured 4e-9
    }
}

/// Hooke's law `sigma = D epsilon` in the order `xx yy zz xy yz zx`, with engineering shear
/// strains.
fn stress_strain(material: &Material) -> Matrix6<f64> {
    let (lambda, mu) = lame(material);
    Matrix6::from_fn(|i, j| match (i < 3 && j < 3, i == j) {
        (true, true) => lambda + 2.0 * mu,
        (true, false) => lambda,
        (false, same) => mu * f64::from(same),
    })
}

/// `epsilon = B u` in the order of [`stress_strain`].
fn strain_matrix(dN: &[Vector3<f64>]) -> DMatrix<f64> {
    let mut B = DMatrix::zeros(6, 3 * dN.len());
    for (i, d) in dN.iter().enumerate() {
        for (row, a, b) in [(0, 0, 0), (1, 1, 1), (2, 2, 2), (3, 0, 1), (4, 1, 2), (5, 2, 0)] {
            B[(row, 3 * i + a)] = d[b];
            B[(row, 3 * i + b)] = d[a];
        }
    }
    B
}

/// Second algorithm: `∫ Bᵀ D B` with matrices and [`for_each_point`] against the outer products.
#[test]
fn stiffness_is_the_integral_of_b_transposed_d_b() {
    let D = stress_strain(&STEEL);
    for kind in SOLIDS {
        for rule in [Quadrature::Exact, Quadrature::Calculix] {
            if (kind, rule) == (Hex8, Quadrature::Exact) {
                continue; // incompatible modes
            }
            let x = distorted(kind, 0.05, 29);
            let (K, _) = matrices(kind, &x, rule);
            let mut sum = DMatrix::zeros(K.nrows(), K.ncols());
            for_each_point(kind, &x, Purpose::Stiffness, rule, |point| {
                let B = strain_matrix(point.dN);
                sum += point.weight * B.transpose() * D * B;
            })
            .unwrap();
            assert!((&K - &sum).amax() < 1e-13 * K.amax(), "{}", kind.name()); // measured 9e-16
        }
    }
}

/// Truth: a block bent to the curvature κ with its nodes restrained across, plane strain:
/// `E/(1-nu²) I κ² l / 2`. The plain brick cannot represent curvature: it also shears, by κ x, and
/// is restrained across: `[(λ + 2μ) I l + μ b h l³/12] κ² / 2`.
#[test]
fn a_brick_with_incompatible_modes_bends_without_locking() {
    let (l, b, h) = (0.4, 0.05, 0.1);
    let size = Vector3::new(l, b, h) * 0.5;
    let x: Vec<Vector3<f64>> = reference_nodes(Hex8).iter().map(|xi| Vector3::from(*xi).component_mul(&size)).collect();
    let u = DVector::from_iterator(24, x.iter().flat_map(|x| [x.x * x.z, 0.0, 0.0]));
    let energy = |rule| 0.5 * (u.transpose() * matrices(Hex8, &x, rule).0 * &u)[0];

    let I = b * h.powi(3) / 12.0;
    let bending = 0.5 * STEEL.E / (1.0 - STEEL.nu.powi(2)) * I * l;
    assert!((energy(Quadrature::Exact) / bending - 1.0).abs() < 1e-12); // measured 1e-14
    assert!((energy(Quadrature::CalculixModes) / bending - 1.0).abs() < 1e-12); // measured 1e-14
    let (lambda, mu) = super::elasticity::lame(&STEEL);
    let locked = 0.5 * ((lambda + 2.0 * mu) * I * l + mu * b * h * l.powi(3) / 12.0);
    assert!((energy(Quadrature::Calculix) / locked - 1.0).abs() < 1e-12); // measured 1.4e-15
    assert!(locked > 6.0 * bending);
}

/// A mid-edge node at less than a quarter of its edge inverts the map at the corner. Just below
/// that limit no Gauss point detects it.
#[test]
fn an_element_turned_over_at_a_node_is_reported_there() {
    let mut x: Vec<Vector3<f64>> = reference_nodes(Tet10).iter().map(|xi| Vector3::from(*xi)).collect();
    x[4].x = 0.2499;
    let mut workspace = ElementWorkspace::new();
    let at_node = workspace.stiffness_and_mass(Tet10, &x, &STEEL, Quadrature::Exact).unwrap_err();
    assert_eq!(at_node.place, InversionPoint::Node(0));
    assert!((at_node.det + 4e-4).abs() < 1e-14, "{at_node}"); // 4 x_4 - 1, measured 4e-17
    let range = jacobian_range(Tet10, &x);
    assert!(range.node == 0 && range.min_node < 0.0 && range.min_gauss > 0.0);

    // The four points of CalculiX do not detect it either, until a node is moved much further.
    x[4].x = 0.2;
    workspace.stiffness_and_mass(Tet10, &x, &STEEL, Quadrature::Calculix).unwrap();
    x[4].x = -0.8;
    let at_point = workspace.stiffness_and_mass(Tet10, &x, &STEEL, Quadrature::Calculix).unwrap_err();
    assert!(matches!(at_point.place, InversionPoint::GaussPoint(_)) && at_point.det < 0.0);
}

#[test]
fn a_mirrored_a_flat_and_a_broken_element_are_refused() {
    let mut workspace = ElementWorkspace::new();
    for kind in SOLIDS {
        for map in [Vector3::new(1.0, 1.0, -1.0), Vector3::new(1.0, 1.0, 0.0), Vector3::new(1.0, f64::NAN, 1.0)] {
            let x: Vec<Vector3<f64>> = distorted(kind, 0.0, 31).iter().map(|x| x.component_mul(&map)).collect();
            for rule in [Quadrature::Exact, Quadrature::Calculix] {
                let error = workspace.stiffness_and_mass(kind, &x, &STEEL, rule).unwrap_err();
                assert!(!(error.det > 1e-15) && error.to_string().contains("inverted"));
            }
        }
    }
}

/// Truth: a parallelepiped has a constant Jacobian, so every ratio is one.
#[test]
fn a_parallelepiped_is_of_perfect_quality() {
    let skew = Matrix3::new(0.1, 0.03, 0.0, 0.0, 0.2, 0.05, 0.01, 0.0, 0.1);
    for kind in SOLIDS {
        let x: Vec<Vector3<f64>> = reference_nodes(kind).iter().map(|xi| skew * Vector3::from(*xi)).collect();
        let range = jacobian_range(kind, &x);
        assert!((range.min_gauss - 1.0).abs() < 1e-13 && (range.min_node - 1.0).abs() < 1e-13); // measured 1e-15
        assert!((range.mean / skew.determinant() - 1.0).abs() < 1e-13); // measured 7e-16
        assert_eq!(tables(kind).nodes.len(), kind.nodes());
    }
}
