//! Parts of a cut mesh against closed forms and integrals.
//!
//! Truths: half of a bar, a box cut by an oblique plane, the tetrahedron at a corner, pipes; the
//! parts add up to the whole. Axes of the mesh; kg, m. Not here: where a link is cut (`mesh_link`).

use nalgebra::{Matrix3, Rotation3, Vector3, vector};

use super::*;
use crate::beam::{Beam, BeamTheory};
use crate::material::Material;
use crate::mesh::{BeamProperties, ElementBlock};
use crate::section::Section;
use crate::test_mesh::{Noise, SOLIDS, cube, positions};

const RHO: f64 = 7850.0;
/// Steel beam A1: x from 0 to 1, centred in y and z, m.
const SIZE: Vector3<f64> = Vector3::new(1.0, 0.10, 0.05);

fn beam_a1(unit: Vector3<f64>) -> Vector3<f64> {
    (unit - vector![0.0, 0.5, 0.5]).component_mul(&SIZE)
}

/// Beam A1 with its inner nodes moved, so that no element is affine.
fn uneven_beam(kind: ElementKind) -> Mesh {
    let mut noise = Noise(5);
    let step = vector![0.02, 0.01, 0.005];
    cube(kind, [5, 2, 2], false, |unit| {
        let inside = unit.iter().all(|x| *x > 1e-9 && *x < 1.0 - 1e-9);
        beam_a1(unit) + if inside { noise.vector().component_mul(&step) } else { Vector3::zeros() }
    })
}

fn moments(mass: f64, first: Vector3<f64>, second: Matrix3<f64>) -> RigidPart {
    Moments { origin: Vector3::zeros(), mass, first, second }.rigid_part()
}

/// Maximum difference of mass, centre of mass and inertia, scaled by a body of the size of `whole`.
fn difference(part: &RigidPart, other: &RigidPart, whole: &RigidPart) -> f64 {
    let size = (whole.inertia.trace() / whole.mass).sqrt();
    let mass = (part.mass - other.mass).abs() / whole.mass;
    mass.max((part.com - other.com).amax() / size).max((part.inertia - other.inertia).amax() / whole.inertia.amax())
}

/// Reference values of the test body A1 (closed form of a box).
#[test]
fn the_beam_a1_is_cut_into_two_equal_halves() {
    let plane = CutPlane { point: vector![0.5, 0.0, 0.0], normal: Vector3::x() };
    for kind in SOLIDS {
        let parts = cut(&uneven_beam(kind), &[RHO], &[plane]).unwrap();
        for (part, x) in parts.iter().zip([0.25, 0.75]) {
            // measured 5e-8 if the plane is curved in reference coordinates, 1e-15 in tetrahedra
            let tolerance = if matches!(kind, ElementKind::Tet4 | ElementKind::Tet10) { 1e-13 } else { 1e-6 };
            assert!((part.mass - 19.625).abs() < tolerance * 19.625, "{}", kind.name());
            assert!((part.com - vector![x, 0.0, 0.0]).amax() < tolerance);
            let inertia = Matrix3::from_diagonal(&vector![0.020_442_708_3, 0.412_942_708_3, 0.425_208_333_3]);
            assert!((part.inertia - inertia).amax() < 1e-10 + tolerance, "{}", part.inertia);
        }
    }
}

/// Truth: the box behind `x = X(y, z) = x_0 + b y + c z`, with `A` the area of the section and `J`
/// its second moments: `m = ρ A x_0`, `∫ x = ρ/2 ∫ X²`, `∫ x² = ρ/3 ∫ X³`, ...
#[test]
fn a_box_cut_by_an_oblique_plane_is_the_closed_form() {
    let (x_0, b, c) = (0.43, 0.9, -0.7);
    let A = SIZE.y * SIZE.z;
    let (J_y, J_z) = (A * SIZE.y.powi(2) / 12.0, A * SIZE.z.powi(2) / 12.0);
    let square = b * b * J_y + c * c * J_z; // ∫ (X - x_0)² dA
    let first = vector![0.5 * (A * x_0 * x_0 + square), b * J_y, c * J_z];
    let (xx, xy, xz) = ((A * x_0.powi(3) + 3.0 * x_0 * square) / 3.0, x_0 * b * J_y, x_0 * c * J_z);
    let second = Matrix3::new(xx, xy, xz, xy, x_0 * J_y, 0.0, xz, 0.0, x_0 * J_z);
    let exact = moments(RHO * A * x_0, RHO * first, RHO * second);

    let plane = CutPlane { point: vector![x_0, 0.0, 0.0], normal: 3.0 * vector![1.0, -b, -c] };
    for kind in SOLIDS {
        for (mesh, tolerance) in [
            (cube(kind, [4, 2, 2], false, beam_a1), 1e-13), // measured 3e-15
            (uneven_beam(kind), 1e-7),                      // measured 3e-9, 1e-15 in tetrahedra
        ] {
            let whole = mass_properties(&mesh, &[RHO]).unwrap();
            let parts = cut(&mesh, &[RHO], &[plane]).unwrap();
            let error = difference(&parts[0], &exact, &whole);
            assert!(error < tolerance, "{}: {error:.1e}", kind.name());
            assert!(difference(&parts[0].merged(&parts[1]), &whole, &whole) < 1e-13); // measured 3e-16
        }
    }
}

/// Truth: a tetrahedron with edges a, b, c along the axes: volume abc/6, centre a/4, ∫ x² = V
/// a²/10, ∫ x y = V a b/20.
#[test]
fn a_plane_across_a_corner_cuts_off_a_tetrahedron() {
    let edge = vector![0.3, 0.08, 0.04];
    let V = edge.product() / 6.0;
    let second = Matrix3::from_fn(|i, j| V * edge[i] * edge[j] / if i == j { 10.0 } else { 20.0 });
    let exact = moments(RHO * V, RHO * V * edge / 4.0, RHO * second);

    let plane = CutPlane { point: edge.x * Vector3::x(), normal: edge.map(|a| 1.0 / a) };
    for kind in SOLIDS {
        let mesh = cube(kind, [3, 2, 2], false, |unit| unit.component_mul(&SIZE));
        let parts = cut(&mesh, &[RHO], &[plane]).unwrap();
        // measured 7e-13: a small part is the difference of two large ones
        assert!(difference(&parts[0], &exact, &exact) < 1e-10, "{}", kind.name());
    }
}

/// Truth: a bar bent to the parabola `z + κ x²`, which quadratic elements represent exactly, above
/// the plane `z = s + b x + c y`: its height there is `h/2 - s - b x - c y + κ x²`.
#[test]
fn a_bent_bar_of_curved_elements_is_cut_as_the_integral_says() {
    let (kappa, s, b, c) = (0.4, 0.006, 0.02, 0.05);
    let (l, w, h) = (0.4, 0.1, 0.06);
    let bend = |unit: Vector3<f64>| {
        let p = (unit - Vector3::repeat(0.5)).component_mul(&vector![l, w, h]);
        p + kappa * p.x * p.x * Vector3::z()
    };
    // Gauss points in x, y and between the plane and the top: the integrands are polynomials.
    let mut exact = Moments::about(Vector3::zeros());
    for (x, w_x) in crate::element::gauss_jacobi(8, 0).into_iter().map(|(x, w_x)| ((x - 0.5) * l, w_x * l)) {
        for (y, w_y) in crate::element::gauss_jacobi(8, 0).into_iter().map(|(y, w_y)| ((y - 0.5) * w, w_y * w)) {
            let (low, high) = (s + b * x + c * y, 0.5 * h + kappa * x * x);
            for (t, w_t) in crate::element::gauss_jacobi(3, 0) {
                exact.add_point(RHO * w_x * w_y * w_t * (high - low), &vector![x, y, low + t * (high - low)]);
            }
        }
    }
    let plane = CutPlane { point: s * Vector3::z(), normal: vector![-b, -c, 1.0] };
    for kind in [ElementKind::Tet10, ElementKind::Hex20, ElementKind::Wedge15] {
        let mesh = cube(kind, [4, 2, 2], true, bend);
        let whole = mass_properties(&mesh, &[RHO]).unwrap();
        assert!((whole.mass - RHO * l * w * h).abs() < 1e-12 * whole.mass); // det J is one; measured 2e-15
        let parts = cut(&mesh, &[RHO], &[plane]).unwrap();
        let error = difference(&parts[1], &exact.rigid_part(), &whole);
        assert!(error < 1e-6, "{}: {error:.1e}", kind.name()); // measured 6e-8
    }
}

/// Pipe about z, radii 0.05 and 0.1, height 0.2, with `n` quadratic elements around.
fn pipe(kind: ElementKind, n: usize) -> Mesh {
    cube(kind, [2, n, 2], true, |unit| {
        let (sin, cos) = (std::f64::consts::TAU * unit.y).sin_cos();
        let r = 0.05 * (1.0 + unit.x);
        vector![r * cos, r * sin, 0.2 * (unit.z - 0.5)]
    })
}

/// Truth: hollow cylinder, and symmetry: every plane through the centre halves it. The error of
/// quadratic edges is of order h⁴.
#[test]
fn a_pipe_of_curved_elements_weighs_and_halves_as_a_pipe() {
    let (inner, outer, h) = (0.05_f64, 0.1_f64, 0.2_f64);
    let mass = RHO * std::f64::consts::PI * (outer * outer - inner * inner) * h;
    let squares = inner * inner + outer * outer;
    let across = mass * (3.0 * squares + h * h) / 12.0;
    let exact = RigidPart {
        mass,
        com: Vector3::zeros(),
        inertia: Matrix3::from_diagonal(&vector![across, across, 0.5 * mass * squares]),
    };
    for kind in [ElementKind::Tet10, ElementKind::Hex20, ElementKind::Wedge15] {
        let errors = [8, 16].map(|n| difference(&mass_properties(&pipe(kind, n), &[RHO]).unwrap(), &exact, &exact));
        // measured 1.5e-3 and 9.5e-5, a factor of 15.8
        assert!(errors[1] < 2e-4 && errors[0] > 13.0 * errors[1], "{} {errors:?}", kind.name());

        let mesh = pipe(kind, 8);
        let whole = mass_properties(&mesh, &[RHO]).unwrap();
        for normal in [Vector3::x(), vector![0.3, 0.8, 0.4], vector![-0.5, 0.2, 1.0]] {
            let parts = cut(&mesh, &[RHO], &[CutPlane { point: Vector3::zeros(), normal }]).unwrap();
            let error = (parts[0].mass - 0.5 * whole.mass).abs() / whole.mass;
            assert!(error < 1e-6, "{}: {error:.1e}", kind.name()); // measured 2e-7
        }
    }
}

#[test]
fn a_plane_outside_the_body_is_named() {
    let mesh = uneven_beam(ElementKind::Tet10);
    let at = |x: f64| CutPlane { point: vector![x, 0.0, 0.0], normal: vector![1.0, 0.2, 0.0] };
    let empty = |planes: &[CutPlane]| match cut(&mesh, &[RHO], planes).unwrap_err() {
        CutError::EmptyPart { plane, part, .. } => (plane, part),
        other => panic!("{other}"),
    };
    assert_eq!(empty(&[at(-0.5)]), (0, 0));
    assert_eq!(empty(&[at(0.3), at(1.5)]), (1, 2));
    assert_eq!(empty(&[at(0.6), at(0.4)]), (1, 1)); // wrong order
    assert_eq!(cut(&mesh, &[RHO], &[at(0.3), at(0.5), at(0.7)]).unwrap().len(), 4);

    let flat = CutPlane { point: Vector3::zeros(), normal: Vector3::zeros() };
    assert!(matches!(cut(&mesh, &[RHO], &[flat]), Err(CutError::NoNormal { plane: 0, .. })));
    assert!(matches!(cut(&mesh, &[], &[]), Err(CutError::WrongCount { expected: 1, found: 0 })));
    assert!(matches!(cut(&mesh, &[-1.0], &[]), Err(CutError::Region { .. })));
    assert!(matches!(mass_properties(&Mesh::default(), &[]), Err(CutError::NoElements)));
}

/// Second algorithm: volumes of the parts of the whole mesh.
#[test]
fn shares_of_the_elements_add_up_to_the_parts() {
    let planes = [0.31, 0.36, 0.8].map(|x| CutPlane { point: x * Vector3::x(), normal: vector![1.0, 0.1, -0.2] });
    for kind in SOLIDS {
        let mesh = uneven_beam(kind);
        let parts = cut(&mesh, &[1.0], &planes).unwrap();
        let mut volumes = [0.0; 4];
        for element in mesh.blocks[0].elements() {
            let x = positions(&mesh, element);
            let fractions = volume_fractions(kind, &x, &planes).unwrap();
            assert!((fractions.iter().sum::<f64>() - 1.0).abs() < 1e-15 && fractions.iter().all(|f| *f >= 0.0));
            let volume = piece::whole(kind, &x, &x[0]).unwrap().mass;
            volumes.iter_mut().zip(fractions).for_each(|(sum, fraction)| *sum += fraction * volume);
        }
        for (volume, part) in volumes.iter().zip(&parts) {
            assert!((volume / part.mass - 1.0).abs() < 1e-12, "{}", kind.name()); // measured 4e-15
        }
    }
}

/// Second algorithm: [`Beam::piece`], rotated into mesh axes.
#[test]
fn a_line_of_beam_elements_is_cut_as_one_beam() {
    let section = Section::Rectangle { width: 0.06, height: 0.1 };
    let R = Rotation3::from_euler_angles(0.4, -0.8, 1.3);
    let beam = BeamProperties { section, y_axis: R * vector![0.3, 2.0, 0.0], theory: BeamTheory::Timoshenko };
    let mesh = Mesh {
        nodes: (0..=3).map(|i| R * vector![0.2 * f64::from(i), 0.0, 0.0]).collect(),
        node_ids: vec![1, 2, 3, 4],
        blocks: vec![ElementBlock {
            kind: ElementKind::Beam2,
            region: 0,
            ids: vec![1, 2, 3],
            connectivity: vec![0, 1, 1, 2, 3, 2],
        }],
        regions: vec![Region { name: "arm".into(), material: None, beam: Some(beam) }],
        ..Mesh::default()
    };
    let plane = CutPlane { point: R * vector![0.25, 0.0, 0.0], normal: R * vector![1.0, 0.5, 0.0] };
    let parts = cut(&mesh, &[RHO], &[plane]).unwrap();

    let one = Beam::new(section.bar(&Material::STEEL).unwrap(), BeamTheory::Timoshenko, 0.6).unwrap();
    for (part, (from, to)) in parts.iter().zip([(0.0, 0.25 / 0.6), (0.25 / 0.6, 1.0)]) {
        let exact = one.piece(from, to).unwrap().transformed(&crate::Pose::from_parts(Vector3::zeros().into(), R));
        assert!(difference(part, &exact, &exact) < 1e-13); // measured 1.4e-15
    }
    let x = &mesh.nodes[1..3];
    assert!((volume_fractions(ElementKind::Beam2, x, &[plane]).unwrap()[0] - 0.25).abs() < 1e-14);

    let mut nameless = mesh.clone();
    nameless.regions[0].beam = None;
    assert!(matches!(cut(&nameless, &[RHO], &[plane]), Err(CutError::NoSection { .. })));
}

#[test]
fn an_inverted_element_is_named() {
    let mut mesh = uneven_beam(ElementKind::Tet10);
    mesh.blocks[0].connectivity.swap(3, 2);
    assert!(matches!(mass_properties(&mesh, &[RHO]), Err(CutError::Inverted { element: 1, .. })));
}
