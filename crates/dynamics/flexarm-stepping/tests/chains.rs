//! Chains of rigid parts connected by springs: convergence of their deflection with the number of
//! parts.

use std::sync::Arc;

use flexarm_kinematics::*;
use flexarm_stepping::*;
use nalgebra::{Matrix3, Matrix6, Translation3, Vector3, Vector6};

/// Cantilever along x: length (m), mass (kg), stiffness EA, GA (N), GJ, EI about y and z (N m²).
const LENGTH: f64 = 1.0;
const MASS: f64 = 3.0;
const STIFFNESS: [f64; 6] = [1e7, 1e6, 1e6, 300.0, 250.0, 500.0];

/// Returns the cantilever as n equal parts with a spring in the middle of each; a heavy ball beside
/// its tip twists it.
fn cantilever(n: usize, angles: ElasticAngles, gravity: Vector3<f64>, aside: f64) -> Plant {
    let mut chain = Mechanism::new("cantilever");
    chain.gravity = gravity;
    chain.links.push(Link { name: "part 0".into(), inertia: None });
    let (piece, mass) = (LENGTH / n as f64, MASS / n as f64);
    let mut springs: Vec<Spring> = Vec::new();
    for k in 1..=n {
        // Between springs a whole part, after the last spring half a part and the ball.
        let last = k == n;
        let (length, mass) = if last { (0.5 * piece, 0.5 * mass) } else { (piece, mass) };
        let mut inertia =
            LinkInertia { mass, com: Vector3::x() * 0.5 * length, inertia_com: Matrix3::identity() * 1e-3 * mass }
                .spatial();
        if last {
            let ball = LinkInertia {
                mass: 2.0,
                com: Vector3::new(length, aside, 0.0),
                inertia_com: Matrix3::identity() * 1e-3,
            };
            inertia += ball.spatial();
        }
        let inertia = LinkInertia { mass: inertia.mass, com: inertia.com(), inertia_com: inertia.inertia_com() };
        chain.links.push(Link { name: format!("part {k}"), inertia: Some(inertia) });
        let at = if k == 1 { 0.5 * piece } else { piece };
        let X_PJ = Pose::from_parts(Translation3::new(at, 0.0, 0.0), nalgebra::Rotation3::identity());
        let (parent, child) = (format!("part {}", k - 1), format!("part {k}"));
        chain.joints.push(Joint::new(format!("spring {k}"), JointKind::Elastic(angles), parent, child, X_PJ));
        let K = Matrix6::from_diagonal(&(Vector6::from(STIFFNESS) / piece));
        springs.push((format!("spring {k}"), K, Damping::StiffnessProportional(1e-4)).into());
    }
    Plant::new(Arc::new(Model::new(&chain).unwrap()), springs, Arc::new(Held(vec![]))).unwrap()
}

/// Returns the static position of the tip.
fn tip(n: usize, angles: ElasticAngles, gravity: Vector3<f64>, aside: f64) -> Vector3<f64> {
    let plant = cantilever(n, angles, gravity, aside);
    let q = static_equilibrium(&plant, 0.0).unwrap();
    let mut data = Data::new(&plant.model);
    forward_kinematics(&plant.model, &mut data, &q);
    let end = data.X_WB.last().unwrap();
    end * nalgebra::Point3::new(0.5 * LENGTH / n as f64, 0.0, 0.0) - nalgebra::Point3::origin()
}

/// Truth: both kinds of angles have the same limit, obtained from the rotation vectors by
/// Richardson extrapolation. Bent about both axes and twisted, by 37 mm, a chain with rotation
/// vectors converges with the square of the number of parts. The additional error of Euler angles
/// decreases only linearly: `½ φᵀKφ` in angles about successive axes changes in third order when
/// the ends of the spring are exchanged, so that n springs with angles of order 1/n keep an error
/// of `n · n · 1/n³`. In a plane the two are the same.
#[test]
fn chains_converge_with_the_square_of_their_parts_unless_with_euler_angles() {
    use ElasticAngles::{EulerZyx, RotationVector};
    let (oblique, down) = (Vector3::new(0.0, -5.0, -8.44), Vector3::new(0.0, 0.0, -9.81));
    let at = |n, angles| tip(n, angles, oblique, 0.3);
    let (coarse, fine) = (at(32, RotationVector), at(64, RotationVector));
    let truth = fine + (fine - coarse) / 3.0;
    let errors = |angles| [8, 16, 32].map(|n| (at(n, angles) - truth).norm());
    let (vector, euler) = (errors(RotationVector), errors(EulerZyx));
    // Additional error of the Euler angles.
    let added = [0, 1, 2].map(|k| euler[k] - vector[k]);
    let order = |e: [f64; 3]| (e[1] / e[2]).log2();
    eprintln!("bent by {:.3} m: rotation vectors {vector:?}, Euler angles {euler:?}", (truth - Vector3::x()).norm());
    eprintln!("orders {:.3}, of what is added {:.3}", order(vector), order(added));
    // measured 2.000 and 0.921
    assert!((order(vector) - 2.0).abs() < 0.05, "{vector:?}");
    assert!((order(added) - 1.0).abs() < 0.2, "{added:?}");
    // In a plane there is one angle, identical for both.
    for n in [4, 16] {
        let apart = (tip(n, EulerZyx, down, 0.0) - tip(n, RotationVector, down, 0.0)).norm();
        assert!(apart < 1e-12, "{apart}");
    }
}
