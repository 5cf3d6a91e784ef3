//! Beam sections from mass and shape of a link.

use flexarm_kinematics::{Joint, JointKind, LinkInertia, Pose};
use flexarm_new::internals::{BeamSection, Candidate, NoSection, propose};
use flexarm_urdf::{Geometry, TriangleMesh};
use nalgebra::{Matrix3, Rotation3, Translation3, Vector3};

fn candidate(mass: f64, meshes: &[TriangleMesh], X_LB: Pose) -> Result<BeamSection, NoSection> {
    let distal = Joint::new("elbow", JointKind::Fixed, "arm", "next", X_LB);
    let inertia = LinkInertia { mass, com: Vector3::zeros(), inertia_com: Matrix3::identity() };
    propose(&Candidate {
        proximal: None,
        distal: &distal,
        inertia: Some(inertia),
        meshes,
        arm: 2.0 * X_LB.translation.vector.norm(),
    })
}

/// A body along x of M whose outline at each position is a polygon with these corners.
fn lofted(length: f64, outline: impl Fn(f64) -> Vec<[f64; 2]>) -> TriangleMesh {
    let rings = 40;
    let mut mesh = TriangleMesh::default();
    for ring in 0..=rings {
        let x = length * f64::from(ring) / f64::from(rings);
        mesh.positions.extend(outline(x).iter().map(|[y, z]| [x as f32, *y as f32, *z as f32]));
    }
    let n = outline(0.0).len() as u32;
    for ring in 0..rings as u32 {
        for k in 0..n {
            let (a, b) = (ring * n + k, ring * n + (k + 1) % n);
            mesh.triangles.extend([[a, b, b + n], [a, b + n, a + n]]);
        }
    }
    for k in 1..n - 1 {
        let last = rings as u32 * n;
        mesh.triangles.extend([[0, k + 1, k], [last, last + k, last + k + 1]]);
    }
    mesh
}

fn rectangle(w: f64, h: f64) -> Vec<[f64; 2]> {
    vec![[-w / 2.0, -h / 2.0], [w / 2.0, -h / 2.0], [w / 2.0, h / 2.0], [-w / 2.0, h / 2.0]]
}

/// Truth: the box from which mesh and mass were computed. Bound 1e-4: positions have seven
/// digits, and the wall is a small difference.
#[test]
fn a_box_of_known_wall_is_found_again_however_its_frame_is_turned() {
    let (length, w, h, wall) = (0.9, 0.18, 0.12, 0.008);
    let mass = 2700.0 * length * (w * h - (w - 2.0 * wall) * (h - 2.0 * wall));
    let mesh = lofted(length, |_| rectangle(w, h));
    for angles in [[0.0, 0.0, 0.0], [0.3, -0.5, 0.9], [1.2, 0.4, -2.0]] {
        let R = Rotation3::from_euler_angles(angles[0], angles[1], angles[2]);
        let X = Pose::from_parts(Translation3::identity(), R);
        let X_LB = Pose::from_parts(Translation3::from(R * Vector3::x() * length), Rotation3::identity());
        let found = candidate(mass, &[mesh.clone().transformed(&X)], X_LB).unwrap();
        // The frame decides whether width and height are exchanged.
        let y = R.inverse() * Vector3::from(found.y_axis);
        let (width, height) = if y.y.abs() > 0.5 { (found.width, found.height) } else { (found.height, found.width) };
        let errors = [width / w - 1.0, height / h - 1.0, found.wall.unwrap() / wall - 1.0];
        assert!(errors.iter().all(|e| e.abs() < 1e-4), "{errors:?} {found:?}");
        assert!(y.x.abs() < 1e-6 && y.y.abs().max(y.z.abs()) > 1.0 - 1e-6, "{y}");
        assert_eq!((found.section, found.material), ("box", "aluminium"));
        assert!((found.taper - 1.0).abs() < 1e-5 && found.open == 0.0);
    }
}

/// Truth: tube of diameter 0.2 and wall 0.006. The mesh has 64 corners, so its second moments
/// are 0.3 % below those of a circle.
#[test]
fn a_tube_of_known_wall_is_found_again() {
    let (length, diameter, wall) = (0.8, 0.2, 0.006);
    let mass = 2700.0 * length * std::f64::consts::PI * (diameter - wall) * wall;
    let circle = |_: f64| {
        let corner = |k: i32| (f64::from(k) * std::f64::consts::TAU / 64.0).sin_cos();
        (0..64).map(corner).map(|(s, c)| [0.5 * diameter * c, 0.5 * diameter * s]).collect()
    };
    let X_LB = Pose::from_parts(Translation3::new(length, 0.0, 0.0), Rotation3::identity());
    let found = candidate(mass, &[lofted(length, circle)], X_LB).unwrap();
    let stiffness = |d: f64, t: f64| d.powi(4) - (d - 2.0 * t).powi(4);
    let errors = [
        found.width / diameter - 1.0,
        found.wall.unwrap() / wall - 1.0,
        stiffness(found.width, found.wall.unwrap()) / stiffness(diameter, wall) - 1.0,
    ];
    assert_eq!(found.section, "tube");
    assert!(errors[0].abs() < 2e-3 && errors[1].abs() < 3e-3 && errors[2].abs() < 5e-3, "{errors:?}");
}

/// Second moments of a box about its two axes.
fn hollow([width, height]: [f64; 2], wall: f64) -> [f64; 2] {
    let (w, h) = (width - 2.0 * wall, height - 2.0 * wall);
    [(width * height.powi(3) - w * h.powi(3)) / 12.0, (height * width.powi(3) - h * w.powi(3)) / 12.0]
}

/// Truth: tip deflection of a cantilever under a force, `∫ (l - x)²/(E I(x)) dx`, by Simpson's
/// rule in 2000 steps over the closed form of I(x) of a tapered box.
#[test]
fn the_tip_of_a_tapered_link_goes_as_far_as_that_of_its_uniform_beam() {
    let (length, wall) = (1.0, 0.01);
    let size = |x: f64| [0.30 - 0.18 * x / length, 0.24 - 0.12 * x / length];
    let area = |x: f64| {
        let [w, h] = size(x);
        w * h - (w - 2.0 * wall) * (h - 2.0 * wall)
    };
    let steps = 2000;
    let simpson = |f: &dyn Fn(f64) -> f64| -> f64 {
        let x = |k: i32| length * f64::from(k) / f64::from(steps);
        let weight = |k: i32| {
            if k == 0 || k == steps {
                1.0
            } else if k % 2 == 1 {
                4.0
            } else {
                2.0
            }
        };
        (0..=steps).map(|k| weight(k) * f(x(k))).sum::<f64>() * length / (3.0 * f64::from(steps))
    };
    let mass = 2700.0 * simpson(&area);
    let mesh = lofted(length, |x| rectangle(size(x)[0], size(x)[1]));
    let X_LB = Pose::from_parts(Translation3::new(length, 0.0, 0.0), Rotation3::identity());
    let found = candidate(mass, &[mesh], X_LB).unwrap();
    let moments = hollow([found.width, found.height], found.wall.unwrap());
    for (axis, moment) in moments.into_iter().enumerate() {
        let truth = simpson(&|x| (length - x).powi(2) / hollow(size(x), wall)[axis]);
        let error = length.powi(3) / (3.0 * moment) / truth - 1.0;
        assert!(error.abs() < 2e-3, "axis {axis}: {error:.2e}");
    }
    assert!(found.taper > 2.0, "{found:?}");
}

#[test]
fn a_mass_that_contradicts_the_mesh_gives_no_section_and_says_so() {
    let mesh = lofted(0.9, |_| rectangle(0.18, 0.12));
    let X_LB = Pose::from_parts(Translation3::new(0.9, 0.0, 0.0), Rotation3::identity());
    let of = |mass: f64| candidate(mass, std::slice::from_ref(&mesh), X_LB);
    let solid = 0.9 * 0.18 * 0.12;
    assert!(of(7900.0 * solid).unwrap_err().to_string().contains("contradicts"));
    assert_eq!(of(7000.0 * solid).unwrap().material, "ductile_iron");
    assert_eq!(of(2600.0 * solid).unwrap().material, "aluminium");
    assert!(of(0.1).unwrap_err().to_string().contains("wall of"));
    // 2 kg of aluminium around 0.18 x 0.12 m are a wall of 1.4 mm, an eighty-seventh of its height;
    // around twice the size 0.7 mm, a 350th.
    assert!(of(2.0).is_ok());
    let large = lofted(0.9, |_| rectangle(0.36, 0.24));
    assert!(candidate(2.0, &[large], X_LB).unwrap_err().to_string().contains("wall of 0.69 mm"));
    let aside = Pose::from_parts(Translation3::new(0.0, 0.0, 0.9), Rotation3::identity());
    let frames = candidate(20.0, std::slice::from_ref(&mesh), aside).unwrap_err().to_string();
    assert!(frames.contains("are not along the link"), "{frames}");
    let short = Pose::from_parts(Translation3::new(0.1, 0.0, 0.0), Rotation3::identity());
    assert!(candidate(20.0, &[mesh], short).unwrap_err().to_string().contains("not slender"));
    let wide = Geometry::Sphere { radius: 0.2 }.triangles().unwrap();
    assert!(candidate(2.0, &[wide], short).is_err());
}
