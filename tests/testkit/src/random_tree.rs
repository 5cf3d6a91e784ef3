//! Random trees of all joint kinds.

use std::sync::Arc;

use flexarm_kinematics::{
    ElasticAngles, InterfaceShape, Joint, JointKind, Link, LinkInertia, Mechanism, ModalBody, Model, Pose, State,
};
use nalgebra::{DMatrix, Matrix3, Matrix6xX, Rotation3, Translation3, Unit, Vector3};

/// A small deterministic generator (SplitMix64), so that a seed is a whole test case.
#[derive(Clone, Debug)]
pub struct Draw(pub u64);

impl Draw {
    /// Uniform in `[-1, 1)`.
    pub fn signed(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// Uniform in `[low, high)`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * 0.5 * (self.signed() + 1.0)
    }

    /// Vector with components in `[-size, size)`.
    pub fn vector(&mut self, size: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| size * self.signed())
    }

    /// Index below `n`.
    pub fn index(&mut self, n: usize) -> usize {
        ((0.5 * (self.signed() + 1.0) * n as f64) as usize).min(n - 1)
    }

    /// A pose within `size` metres.
    pub fn pose(&mut self, size: f64) -> Pose {
        let (p, r) = (self.vector(size), self.vector(1.5));
        Pose::from_parts(Translation3::from(p), Rotation3::from_scaled_axis(r))
    }

    /// A physical inertia: a few point masses.
    pub fn inertia(&mut self) -> LinkInertia {
        let points: Vec<(f64, Vector3<f64>)> = (0..6).map(|_| (self.between(0.2, 3.0), self.vector(0.4))).collect();
        let mass = points.iter().map(|p| p.0).sum::<f64>();
        let com = points.iter().fold(Vector3::zeros(), |s, (m, p)| s + p * *m) / mass;
        let inertia_com = points.iter().fold(Matrix3::zeros(), |s, (m, p)| {
            let d = p - com;
            s + (Matrix3::identity() * d.norm_squared() - d * d.transpose()) * *m
        });
        LinkInertia { mass, com, inertia_com }
    }
}

/// A random tree with `n_joints` joints: chains and branches, all kinds, fixed frames in between.
pub fn random_tree(seed: u64, n_joints: usize) -> Mechanism {
    let mut draw = Draw(seed);
    let mut tree = Mechanism::new(format!("random_{seed}_{n_joints}"));
    tree.gravity = Vector3::new(0.0, 0.0, -9.81) + draw.vector(1.0);
    tree.links.push(Link { name: "base".into(), inertia: None });
    for i in 0..n_joints {
        // Mostly chains, some branches.
        let parent = if draw.signed() > -0.6 { tree.links.len() - 1 } else { draw.index(tree.links.len()) };
        let axis = Unit::new_normalize(draw.vector(1.0) + Vector3::new(0.01, 0.02, 1.5 * draw.signed()));
        let kind = match draw.index(7) {
            0 => JointKind::Prismatic(axis),
            1 => JointKind::Elastic(ElasticAngles::RotationVector),
            2 => JointKind::Elastic(ElasticAngles::EulerZyx),
            3 => JointKind::Continuous(axis),
            4 => JointKind::Helical { axis, pitch: 0.2 * draw.signed() },
            _ => JointKind::Revolute(axis),
        };
        let (name, parent) = (format!("link_{i}"), tree.links[parent].name.clone());
        tree.joints.push(Joint::new(format!("joint_{i}"), kind, parent, name.clone(), draw.pose(0.5)));
        tree.links.push(Link { name: name.clone(), inertia: Some(draw.inertia()) });
        if draw.signed() > 0.5 {
            let fixed = format!("fixed_{i}");
            tree.joints.push(Joint::new(format!("weld_{i}"), JointKind::Fixed, name, fixed.clone(), draw.pose(0.3)));
            tree.links.push(Link { name: fixed, inertia: Some(draw.inertia()) });
        }
    }
    tree
}

/// Mass points with their shapes: what a modal body's integrals are sums over.
#[derive(Clone, Debug)]
pub struct Cloud {
    /// Masses (kg).
    pub mass: Vec<f64>,
    /// Places, undeformed (m).
    pub s: Vec<Vector3<f64>>,
    /// Shapes per point and coordinate.
    pub phi: Vec<Vec<Vector3<f64>>>,
}

impl Cloud {
    /// Twelve points with n random shapes.
    pub fn random(draw: &mut Draw, n: usize) -> Self {
        let mass = (0..12).map(|_| draw.between(0.1, 1.0)).collect();
        let s = (0..12).map(|_| draw.vector(0.5)).collect();
        let phi = (0..12).map(|_| (0..n).map(|_| draw.vector(0.5)).collect()).collect();
        Self { mass, s, phi }
    }

    /// The mass integrals, by summation, with interfaces that move anyhow.
    pub fn modal_body(&self, draw: &mut Draw, interfaces: usize) -> ModalBody {
        let n = self.phi[0].len();
        let (zero, one) = (Vector3::zeros(), Matrix3::identity());
        let mut body = ModalBody {
            mass: self.mass.iter().sum(),
            first_moment: zero,
            inertia: Matrix3::zeros(),
            C_t: vec![zero; n],
            C_r: vec![zero; n],
            P: vec![Matrix3::zeros(); n],
            N: vec![Matrix3::zeros(); n * n],
            M: DMatrix::zeros(n, n),
            interfaces: Vec::new(),
        };
        for ((m, s), phi) in self.mass.iter().zip(&self.s).zip(&self.phi) {
            body.first_moment += s * *m;
            body.inertia += (one * s.norm_squared() - s * s.transpose()) * *m;
            for k in 0..n {
                body.C_t[k] += phi[k] * *m;
                body.C_r[k] += s.cross(&phi[k]) * *m;
                body.P[k] += s * phi[k].transpose() * *m;
                for l in 0..n {
                    body.N[k * n + l] += phi[k] * phi[l].transpose() * *m;
                    body.M[(k, l)] += phi[k].dot(&phi[l]) * m;
                }
            }
        }
        let shape = |draw: &mut Draw| Matrix6xX::from_fn(n, |_, _| 0.4 * draw.signed());
        body.interfaces =
            (0..interfaces).map(|_| InterfaceShape { X_LI: Pose::from(draw.vector(0.5)), Phi: shape(draw) }).collect();
        body
    }
}

/// A random tree in which some links bend in modes, some joints are single springs and some have
/// rotors.
pub fn random_flexible_tree(seed: u64, n_joints: usize) -> Mechanism {
    let mut tree = random_tree(seed, n_joints);
    let mut draw = Draw(seed ^ 0x5EED);
    for joint in &mut tree.joints {
        match joint.kind {
            JointKind::Revolute(axis) if draw.signed() > 0.6 => joint.kind = JointKind::ElasticRevolute(axis),
            JointKind::Prismatic(axis) if draw.signed() > 0.6 => joint.kind = JointKind::ElasticPrismatic(axis),
            JointKind::Helical { axis, pitch } if draw.signed() > 0.6 => {
                joint.kind = JointKind::ElasticHelical { axis, pitch };
            }
            JointKind::Revolute(_) | JointKind::Prismatic(_) | JointKind::Helical { .. } => {
                joint.armature = draw.between(-1.0, 2.0).max(0.0)
            }
            _ => {}
        }
    }
    let candidates: Vec<String> = tree.links.iter().map(|l| l.name.clone()).collect();
    for link in candidates {
        if draw.signed() < 0.3 {
            continue;
        }
        let n = 1 + draw.index(4);
        let children: Vec<usize> = (0..tree.joints.len()).filter(|&j| tree.joints[j].parent == link).collect();
        let interfaces = children.len().max(1);
        let body = Cloud::random(&mut draw, n).modal_body(&mut draw, interfaces);
        for k in 0..interfaces {
            let name = format!("{link}_interface_{k}");
            let X = body.interfaces[k].X_LI;
            tree.joints.push(Joint::new(
                format!("{name}_joint"),
                JointKind::Interface(k),
                link.clone(),
                name.clone(),
                X,
            ));
            tree.links.push(Link { name: name.clone(), inertia: None });
            if let Some(&child) = children.get(k) {
                tree.joints[child].parent = name;
            }
        }
        tree.modal.push((link, Arc::new(body)));
    }
    tree
}

/// Random positions (elastic angles below a radian) and velocities.
pub fn random_state(model: &Model, draw: &mut Draw) -> State {
    let mut state = State::zeros(model);
    let n = model.n_actuated();
    for k in 0..model.nv() {
        state.q[k] = if k < n { 2.0 * draw.signed() } else { 0.4 * draw.signed() };
        state.qdot[k] = 1.5 * draw.signed();
    }
    state
}
