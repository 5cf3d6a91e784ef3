//! The reference arm: six axes, two links split at mid length into two halves with a 6×6 spring.
//!
//! Numbers as in the converged cross-check of `tests/golden/reference_arm_mid.csv`; all joint
//! frames are parallel to the world at the home pose. The robot folder `robots/test/reference_arm` is
//! the same arm by file.

use flexarm_kinematics::{ElasticAngles, Joint, JointKind, Link, LinkInertia, Mechanism, Pose};
use nalgebra::{Matrix3, Matrix6, Translation3, Vector3, Vector6};

/// The arm with its two springs.
#[derive(Clone, Debug)]
pub struct ReferenceArm {
    /// Links and joints; elastic joints `joint2b` and `joint4b`; frame `tcp`.
    pub mechanism: Mechanism,
    /// Stiffness at the two splits.
    pub K_S: [Matrix6<f64>; 2],
    /// `D = beta K` (s).
    pub beta: f64,
}

fn box_inertia(m: f64, x: f64, y: f64, z: f64) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(y * y + z * z, x * x + z * z, x * x + y * y)) * (m / 12.0)
}

fn body(mass: f64, com: [f64; 3], inertia_com: Matrix3<f64>) -> LinkInertia {
    LinkInertia { mass, com: com.into(), inertia_com }
}

/// Spring of a uniform beam at its middle: diagonal, because mid length is the elastic centre.
///
/// Translation: `1/(EA/L)` and, across, `L³/(12 EI) + L/(kGA)`; rotation `L/(GJ)`, `L/(EI)`.
struct Beam {
    length: f64,
    EA: f64,
    GJ: f64,
    EI_2: f64,
    EI_3: f64,
    kGA_2: f64,
    kGA_3: f64,
}

impl Beam {
    /// Compliances along (1, 2, 3) and about (1, 2, 3), inverted.
    fn middle(&self) -> [f64; 6] {
        let l = self.length;
        let across = |EI: f64, kGA: f64| 1.0 / (l.powi(3) / (12.0 * EI) + l / kGA);
        [
            self.EA / l,
            across(self.EI_3, self.kGA_2),
            across(self.EI_2, self.kGA_3),
            self.GJ / l,
            self.EI_2 / l,
            self.EI_3 / l,
        ]
    }
}

/// The arm, variant `mid`. With `elastic = false` the halves are welded: the rigid twin with six
/// coordinates.
pub fn reference_arm(elastic: bool) -> ReferenceArm {
    // Lower arm: aluminium box 160 x 120 mm, wall 10 mm, along z; axis 2 = link x, axis 3 = link y.
    let (b, h, t): (f64, f64, f64) = (0.120, 0.160, 0.010);
    let (bi, hi) = (b - 2.0 * t, h - 2.0 * t);
    let (E, G) = (70e9, 70e9 / (2.0 * 1.33));
    let A = b * h - bi * hi;
    let (I2, I3) = ((h * b * b * b - hi * bi * bi * bi) / 12.0, (b * h * h * h - bi * hi * hi * hi) / 12.0);
    let J = 4.0 * ((b - t) * (h - t)).powi(2) * t / (2.0 * (b - t) + 2.0 * (h - t));
    let lower = Beam {
        length: 1.095,
        EA: E * A,
        GJ: G * J,
        EI_2: E * I2,
        EI_3: E * I3,
        kGA_2: G * 2.0 * t * h,
        kGA_3: G * 2.0 * t * b,
    };
    let (lower_i2, lower_i3) = (I2 / A, I3 / A);

    // Upper arm: steel tube, outer diameter 140 mm, wall 6 mm, along x.
    let (ro, ri): (f64, f64) = (0.070, 0.064);
    let (E, nu) = (210e9, 0.30);
    let G = E / (2.0 * (1.0 + nu));
    let A = std::f64::consts::PI * (ro * ro - ri * ri);
    let I = std::f64::consts::PI / 4.0 * (ro.powi(4) - ri.powi(4));
    let k = 2.0 * (1.0 + nu) / (4.0 + 3.0 * nu);
    let upper =
        Beam { length: 1.0, EA: E * A, GJ: G * 2.0 * I, EI_2: E * I, EI_3: E * I, kGA_2: k * G * A, kGA_3: k * G * A };
    let upper_i = I / A;

    // Lower: beam axes (1, 2, 3) = link (z, x, y). Upper: beam axes = link axes.
    let m = lower.middle();
    let K_lower = Matrix6::from_diagonal(&Vector6::new(m[1], m[2], m[0], m[4], m[5], m[3]));
    let K_upper = Matrix6::from_diagonal(&Vector6::from(upper.middle()));

    let (l2, l4) = (0.5 * 1.095, 0.5);
    let half_lower = |z: f64| {
        let about = l2 * l2 / 12.0;
        let I = Vector3::new(about + lower_i2, about + lower_i3, lower_i2 + lower_i3) * 30.0;
        body(30.0, [0.0, 0.0, z], Matrix3::from_diagonal(&I))
    };
    let half_upper = |x: f64| {
        let about = l4 * l4 / 12.0 + upper_i;
        body(20.0, [x, 0.0, 0.0], Matrix3::from_diagonal(&(Vector3::new(2.0 * upper_i, about, about) * 20.0)))
    };
    // Flange and tool in one body.
    let tool = {
        let parts = [
            (3.0, Vector3::new(-0.01, 0.0, 0.0), box_inertia(3.0, 0.03, 0.10, 0.10)),
            (20.0, Vector3::new(0.12, 0.0, 0.04), box_inertia(20.0, 0.20, 0.20, 0.20)),
        ];
        let mass = 23.0;
        let com = parts.iter().fold(Vector3::zeros(), |s, p| s + p.1 * p.0) / mass;
        let inertia_com = parts.iter().fold(Matrix3::zeros(), |s, (m, c, I)| {
            let d = c - com;
            s + I + (Matrix3::identity() * d.norm_squared() - d * d.transpose()) * *m
        });
        LinkInertia { mass, com, inertia_com }
    };

    let mut arm = Mechanism::new("reference_arm");
    arm.links.push(Link { name: "base".into(), inertia: None });
    let (x, y, z) = (Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis());
    let spring = if elastic { JointKind::Elastic(ElasticAngles::EulerZyx) } else { JointKind::Fixed };
    let chain: [(&str, JointKind, [f64; 3], LinkInertia); 8] = [
        ("1", JointKind::Continuous(z), [0.0; 3], body(140.0, [0.06, 0.0, 0.33], box_inertia(140.0, 0.45, 0.40, 0.50))),
        ("2", JointKind::Continuous(y), [0.175, 0.0, 0.495], half_lower(0.5 * l2)),
        ("2b", spring, [0.0, 0.0, l2], half_lower(0.5 * l2)),
        (
            "3",
            JointKind::Continuous(y),
            [0.0, 0.0, l2],
            body(90.0, [0.03, 0.0, 0.15], box_inertia(90.0, 0.50, 0.35, 0.38)),
        ),
        ("4", JointKind::Continuous(x), [0.27, 0.0, 0.175], half_upper(0.5 * l4)),
        ("4b", spring, [l4, 0.0, 0.0], half_upper(0.5 * l4)),
        (
            "5",
            JointKind::Continuous(y),
            [l4, 0.0, 0.0],
            body(12.0, [0.04, 0.0, 0.0], box_inertia(12.0, 0.16, 0.14, 0.14)),
        ),
        ("6", JointKind::Continuous(x), [0.135, 0.0, 0.0], tool),
    ];
    let mut parent = "base".to_owned();
    for (name, kind, origin, inertia) in chain {
        let child = format!("link{name}");
        let X = Pose::from_parts(Translation3::from(Vector3::from(origin)), nalgebra::Rotation3::identity());
        arm.joints.push(Joint::new(format!("joint{name}"), kind, parent, child.clone(), X));
        arm.links.push(Link { name: child.clone(), inertia: Some(inertia) });
        parent = child;
    }
    let X = Pose::from_parts(Translation3::new(0.20, 0.0, 0.0), nalgebra::Rotation3::identity());
    arm.joints.push(Joint::new("joint_tcp", JointKind::Fixed, parent, "tcp", X));
    arm.links.push(Link { name: "tcp".into(), inertia: None });
    ReferenceArm { mechanism: arm, K_S: [K_lower, K_upper], beta: 0.001_053_607_817_458_580_5 }
}

/// The arm's test motion: quintic out in 1.2 s, hold 0.8 s, back in 1.2 s, hold; q, q̇, q̈ of six
/// joints.
pub fn reference_motion(t: f64) -> ([f64; 6], [f64; 6], [f64; 6]) {
    let goal = [60.0f64, 30.0, -20.0, 40.0, 30.0, 90.0].map(f64::to_radians);
    let ramp = |u: f64| {
        let (u, T) = (u.clamp(0.0, 1.0), 1.2);
        [
            u * u * u * (10.0 - 15.0 * u + 6.0 * u * u),
            30.0 * u * u * (1.0 - u).powi(2) / T,
            60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / (T * T),
        ]
    };
    let (a, b) = (ramp(t / 1.2), ramp((t - 2.0) / 1.2));
    (goal.map(|g| g * (a[0] - b[0])), goal.map(|g| g * (a[1] - b[1])), goal.map(|g| g * (a[2] - b[2])))
}

/// Writes positions, velocities and accelerations of [`reference_motion`].
pub fn follow_reference_motion(t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]) {
    let motion = reference_motion(t);
    q.copy_from_slice(&motion.0);
    qdot.copy_from_slice(&motion.1);
    qddot.copy_from_slice(&motion.2);
}

/// The flexible arm with each of its elastic joints as so many in a row, and a part between any
/// two: a tree of 6 + 12 n coordinates for times and instructions.
pub fn arm_of_parts(n: usize) -> Mechanism {
    let mut arm = reference_arm(true).mechanism;
    for joint in std::mem::take(&mut arm.joints) {
        let JointKind::Elastic(_) = joint.kind else {
            arm.joints.push(joint);
            continue;
        };
        let (mut parent, mut X) = (joint.parent.clone(), joint.X_PJ);
        for k in 1..n {
            let part = format!("{} part {k}", joint.name);
            let name = format!("{} {k}", joint.name);
            arm.joints.push(Joint::new(name, joint.kind, parent, part.clone(), X));
            let inertia = Matrix3::from_diagonal(&Vector3::new(0.11, 0.12, 0.02));
            arm.links.push(Link { name: part.clone(), inertia: Some(body(8.0, [0.0, 0.0, 0.1], inertia)) });
            (parent, X) = (part, Pose::translation(0.0, 0.0, 0.2));
        }
        arm.joints.push(Joint { parent, X_PJ: X, ..joint });
    }
    arm
}
