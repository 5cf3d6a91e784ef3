//! Arms for tests and benchmarks: shipped ones, well-known ones, and random members of each class.
#![allow(dead_code, reason = "tests and bench each use a part")]

use std::f64::consts::{FRAC_PI_2, PI};

use flexarm_kinematics::*;
use flexarm_testkit::Draw;
use nalgebra::{Rotation3, Translation3, Unit, Vector3};

/// Joint as in URDF files: origin (m), roll, pitch, yaw (rad), axis.
type Row = ([f64; 3], [f64; 3], [f64; 3]);

/// Arm with its name and expected class.
pub(crate) struct Named {
    pub(crate) name: String,
    pub(crate) model: Model,
    pub(crate) class: ArmClass,
}

impl Named {
    pub(crate) fn tool(&self) -> Frame {
        self.model.frame("tool").expect("made here").clone()
    }
}

/// Chain of joints with axes in their frames, and a tool frame after the last one.
pub(crate) fn chain(name: &str, joints: &[(Pose, JointKind)], tool: Pose) -> Mechanism {
    let mut arm = Mechanism::new(name);
    arm.links.push(Link { name: "base".into(), inertia: None });
    for (k, (X_PJ, kind)) in joints.iter().enumerate() {
        let (parent, child) = (arm.links[k].name.clone(), format!("link_{}", k + 1));
        arm.links.push(Link { name: child.clone(), inertia: None });
        arm.joints.push(Joint::new(format!("joint_{}", k + 1), *kind, parent, child, *X_PJ));
    }
    let last = arm.links[joints.len()].name.clone();
    arm.links.push(Link { name: "tool".into(), inertia: None });
    arm.joints.push(Joint::new("tool_mount", JointKind::Fixed, last, "tool", tool));
    arm
}

fn pose(xyz: [f64; 3], rpy: [f64; 3]) -> Pose {
    Pose::from_parts(Translation3::new(xyz[0], xyz[1], xyz[2]), Rotation3::from_euler_angles(rpy[0], rpy[1], rpy[2]))
}

fn named(arm: &Mechanism, class: ArmClass) -> Named {
    Named { name: arm.name.clone(), model: Model::new(arm).expect("valid"), class }
}

pub(crate) fn from_rows(name: &str, rows: &[Row], tool: ([f64; 3], [f64; 3])) -> Mechanism {
    let joint =
        |(xyz, rpy, axis): &Row| (pose(*xyz, *rpy), JointKind::Continuous(Unit::new_normalize(Vector3::from(*axis))));
    chain(name, &rows.iter().map(joint).collect::<Vec<_>>(), pose(tool.0, tool.1))
}

/// Builds an arm from Denavit-Hartenberg rows (d, a, alpha): `Rz(q) Tz(d) Tx(a) Rx(alpha)`.
pub(crate) fn from_dh(name: &str, rows: &[[f64; 3]; 6]) -> Mechanism {
    let link = |[d, a, alpha]: &[f64; 3]| pose([*a, 0.0, *d], [*alpha, 0.0, 0.0]);
    let mut before = Pose::identity();
    let mut joints = Vec::new();
    for row in rows {
        joints.push((before, JointKind::Continuous(Vector3::z_axis())));
        before = link(row);
    }
    chain(name, &joints, before)
}

const Z: [f64; 3] = [0.0, 0.0, 1.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const X: [f64; 3] = [1.0, 0.0, 0.0];
const NONE: [f64; 3] = [0.0; 3];
const Q: f64 = FRAC_PI_2;

pub(crate) fn kr300() -> Mechanism {
    let rows: [Row; 6] = [
        ([0.0; 3], [PI, 0.0, 0.0], Z),
        ([0.35, 0.0, -0.675], [Q, 0.0, 0.0], Z),
        ([1.15, 0.0, -0.189], NONE, Z),
        ([0.0, 0.041, 0.189], [-Q, 0.0, Q], Z),
        ([0.0, 0.0, -1.0], [Q, 0.0, 0.0], Z),
        ([0.0; 3], [-Q, 0.0, 0.0], Z),
    ];
    from_rows("KUKA KR 300 R2500", &rows, ([0.0, 0.0, -0.24], [PI, 0.0, 0.0]))
}

pub(crate) fn irb120() -> Mechanism {
    let rows: [Row; 6] = [
        ([0.0, 0.0, 0.29], NONE, Z),
        (NONE, NONE, Y),
        ([0.0, 0.0, 0.27], NONE, Y),
        ([0.134, 0.0, 0.07], NONE, X),
        ([0.168, 0.0, 0.0], NONE, Y),
        ([0.072, 0.0, 0.0], NONE, X),
    ];
    from_rows("ABB IRB 120", &rows, (NONE, [0.0, Q, 0.0]))
}

/// ABB IRB 4600-40/2.55.
pub(crate) fn irb4600() -> Mechanism {
    let rows: [Row; 6] = [
        ([0.0, 0.0, 0.495], NONE, Z),
        ([0.175, 0.0, 0.0], NONE, Y),
        ([0.0, 0.0, 1.095], NONE, Y),
        ([0.6, 0.0, 0.175], NONE, X),
        ([0.67, 0.0, 0.0], NONE, Y),
        ([0.135, 0.0, 0.0], NONE, X),
    ];
    from_rows("ABB IRB 4600", &rows, (NONE, [0.0, Q, 0.0]))
}

pub(crate) fn ur5() -> Mechanism {
    let rows = [
        [0.089159, 0.0, Q],
        [0.0, -0.425, 0.0],
        [0.0, -0.39225, 0.0],
        [0.10915, 0.0, Q],
        [0.09465, 0.0, -Q],
        [0.0823, 0.0, 0.0],
    ];
    from_dh("UR5", &rows)
}

pub(crate) fn puma() -> Mechanism {
    let rows =
        [[0.0, 0.0, Q], [0.0, 0.4318, 0.0], [0.15005, 0.0203, -Q], [0.4318, 0.0, Q], [0.0, 0.0, -Q], [0.0, 0.0, 0.0]];
    from_dh("Puma 560", &rows)
}

/// Shipped six-joint arms and well-known ones, with the numbers of their files and data sheets.
pub(crate) fn known_arms() -> Vec<Named> {
    let industrial = ArmClass::SphericalWrist(PositionForm::Parallel23);
    let ur = ArmClass::ThreeParallel { first: 2, meeting: true };
    let kr210: [Row; 6] = [
        ([0.0, 0.0, 0.3056], [PI, 0.0, 0.0], Z),
        ([0.33, 0.072, -0.3394], [Q, 0.0, 0.0], Z),
        ([1.15, 0.0, -0.103], NONE, Z),
        ([0.828, -0.115, 0.175], [Q, 0.0, -Q], Z),
        ([0.0, 0.096, -0.392], [0.0, Q, Q], Z),
        ([0.1665, 0.0, -0.096], [Q, 0.0, -Q], Z),
    ];
    let identified = |a1: f64, h0: f64, h: f64, a2: f64, off: f64, d4: f64| -> [Row; 6] {
        [
            ([0.0, 0.0, h0], NONE, Z),
            ([a1, 0.0, h], [-Q, 0.0, 0.0], Z),
            ([0.0, -a2, 0.0], [0.0, 0.0, -Q], Z),
            ([-off, 0.0, 0.0], [-Q, 0.0, PI], Z),
            ([0.0, 0.0, -d4], [Q, 0.0, 0.0], Z),
            (NONE, [-Q, 0.0, 0.0], Z),
        ]
    };
    let reference: [Row; 6] = [
        (NONE, NONE, Z),
        ([0.175, 0.0, 0.495], NONE, Y),
        ([0.0, 0.0, 1.095], NONE, Y),
        ([0.27, 0.0, 0.175], NONE, X),
        ([1.0, 0.0, 0.0], NONE, Y),
        ([0.135, 0.0, 0.0], NONE, X),
    ];
    let r3: [Row; 6] = [
        ([0.0, 0.351, 0.0], NONE, Y),
        ([0.0, 0.324, 0.3], NONE, X),
        ([0.0, 0.65, 0.0], NONE, X),
        ([0.0, 0.414, -0.155], NONE, Y),
        ([0.0, 0.186, 0.0], NONE, X),
        ([0.0, 0.125, 0.0], NONE, Y),
    ];
    let irb6700: [Row; 6] = [
        ([0.0, 0.0, 0.78], NONE, Z),
        ([0.32, 0.0, 0.0], NONE, Y),
        ([0.0, 0.0, 1.125], NONE, Y),
        ([0.0, 0.0, 0.2], NONE, X),
        ([1.1425, 0.0, 0.0], NONE, Y),
        ([0.2, 0.0, 0.0], NONE, X),
    ];
    let ur10e = [
        [0.1807, 0.0, Q],
        [0.0, -0.6127, 0.0],
        [0.0, -0.57155, 0.0],
        [0.17415, 0.0, Q],
        [0.11985, 0.0, -Q],
        [0.11655, 0.0, 0.0],
    ];
    let tx90 = [[0.478, 0.05, -Q], [0.0, 0.425, 0.0], [0.05, 0.0, Q], [0.425, 0.0, -Q], [0.0, 0.0, Q], [0.1, 0.0, 0.0]];
    vec![
        named(&from_rows("kr210", &kr210, ([0.0, 0.0, -0.0485], [0.0, PI, 0.0])), industrial),
        named(
            &from_rows(
                "kr210_identified",
                &identified(0.35, 0.2256, 0.4494, 1.15, 0.041, 1.2),
                ([0.0, 0.0, -0.42], [PI, 0.0, PI]),
            ),
            industrial,
        ),
        named(
            &from_rows(
                "kr500_identified",
                &identified(0.5, 0.566, 0.479, 1.3, 0.055, 1.025),
                ([0.0, 0.0, -0.377], [PI, 0.0, PI]),
            ),
            industrial,
        ),
        named(&from_rows("reference_arm", &reference, ([0.12, 0.0, 0.04], NONE)), industrial),
        named(&from_rows("manutec_r3", &r3, ([0.0, 0.26, 0.0], NONE)), industrial),
        named(&kr300(), industrial),
        named(&irb120(), industrial),
        named(&from_rows("ABB IRB 6700-200/2.60", &irb6700, (NONE, [0.0, Q, 0.0])), industrial),
        named(&puma(), industrial),
        named(&from_dh("Stäubli TX90", &tx90), industrial),
        named(&ur5(), ur),
        named(&from_dh("UR10e", &ur10e), ur),
    ]
}

/// Builds an arm with arbitrary frames from world axes at zero joint values, given as (direction,
/// point).
pub(crate) fn from_axes(name: &str, axes: &[(Vector3<f64>, Vector3<f64>); 6], draw: &mut Draw) -> Mechanism {
    let mut before = Pose::identity();
    let mut joints = Vec::new();
    for (h, o) in axes {
        let h = h.normalize();
        let R = Rotation3::from_scaled_axis(draw.vector(1.5));
        let X_WJ = Pose::from_parts((o + h * (0.2 * draw.signed())).into(), R);
        let axis = Unit::new_normalize(R.inverse() * h);
        joints.push((before.inverse() * X_WJ, JointKind::Continuous(axis)));
        before = X_WJ;
    }
    chain(name, &joints, draw.pose(0.3))
}

/// One random member of each class.
pub(crate) fn random_arms(seed: u64) -> Vec<Named> {
    let mut draw = Draw(seed);
    let wrist = |form| ArmClass::SphericalWrist(form);
    let three = |first, meeting| ArmClass::ThreeParallel { first, meeting };
    let mut arms = Vec::new();
    use PositionForm::*;
    for class in [
        wrist(Parallel23),
        wrist(Intersecting12),
        wrist(Intersecting23),
        wrist(Parallel12),
        wrist(General),
        ArmClass::SphericalShoulder(Parallel23),
        ArmClass::SphericalShoulder(Intersecting12),
        ArmClass::SphericalShoulder(General),
        three(2, true),
        three(2, false),
        three(3, true),
        three(3, false),
        three(1, true),
        three(1, false),
        three(4, true),
        three(4, false),
    ] {
        let axes = random_axes(class, &mut draw);
        let name = format!("random arm {seed}: {class:?}");
        arms.push(named(&from_axes(&name, &axes, &mut draw), class));
    }
    arms
}

type Axes = [(Vector3<f64>, Vector3<f64>); 6];

fn random_axes(class: ArmClass, draw: &mut Draw) -> Axes {
    // Directions well apart from each other, so that no arm is close to another class.
    let mut axes: Axes = std::array::from_fn(|_| (Vector3::zeros(), draw.vector(0.8)));
    for k in 0..6 {
        loop {
            let h = draw.vector(1.0);
            let apart = |o: &Vector3<f64>| o.norm() == 0.0 || h.normalize().cross(&o.normalize()).norm() > 0.4;
            if h.norm() > 0.2 && (0..k).all(|j| apart(&axes[j].0)) {
                axes[k].0 = h.normalize();
                break;
            }
        }
    }
    match class {
        ArmClass::SphericalWrist(form) | ArmClass::SphericalShoulder(form) => {
            (axes[4].1, axes[5].1) = (axes[3].1, axes[3].1);
            match form {
                PositionForm::Parallel23 => axes[2].0 = -axes[1].0,
                PositionForm::Intersecting12 => axes[1].1 = axes[0].1,
                PositionForm::Intersecting23 => axes[2].1 = axes[1].1,
                PositionForm::Parallel12 => axes[1].0 = axes[0].0,
                _ => {}
            }
            if matches!(class, ArmClass::SphericalShoulder(_)) {
                axes.reverse();
            }
        }
        ArmClass::ThreeParallel { first, meeting } => {
            let start = if first == 1 || first == 4 { 0 } else { 1 };
            axes[start + 1].0 = -axes[start].0;
            axes[start + 2].0 = axes[start].0;
            if meeting {
                axes[5].1 = axes[4].1;
            }
            if first > 2 {
                axes.reverse();
            }
        }
        _ => {}
    }
    axes
}
