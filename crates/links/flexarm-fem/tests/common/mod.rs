//! Strategies and sample links shared by the tests.
#![allow(dead_code, reason = "each test binary uses its own part of this module")]

pub(crate) mod test_mesh;

use flexarm_fem::{BeamLink, BeamTheory, LinkFrames, Material, Pose, ReducedLink, Section};
use nalgebra::{Matrix6, Rotation3, Translation3, Vector3, Vector6};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Hollow aluminium box 160 x 120 x 10 mm, 1.095 m along link z, 60 kg.
pub(crate) fn lower_arm() -> BeamLink {
    // Shear only in the walls along the force, as in the reference data.
    let whole = Section::Box { width: 0.160, height: 0.120, wall: 0.010 };
    let shear = |side: f64| Some(2.0 * 0.010 * side * Material::ALUMINIUM.shear_modulus());
    let bar = whole.bar(&Material::ALUMINIUM).unwrap();
    let section = Section::Given(flexarm_fem::Bar { kGA_y: shear(0.160), kGA_z: shear(0.120), ..bar });
    let link = BeamLink::new("lower_arm", section, Material::ALUMINIUM, 1.095);
    let link = link.along(Vector3::z(), Vector3::x(), 0.0, Vector3::zeros()).unwrap();
    BeamLink { mass: Some(60.0), ..link }
}

/// The same beam offset from the joint line, rotated, cut off-centre: all couplings are non-zero.
pub(crate) fn offset_arm() -> BeamLink {
    let offset = Vector3::new(0.03, 0.05, 0.0);
    let link = lower_arm().along(Vector3::z(), Vector3::x(), 25_f64.to_radians(), offset).unwrap();
    BeamLink { split_fraction: 0.4, theory: BeamTheory::Timoshenko, ..link }
}

/// A link whose three frames are rotated as well.
pub(crate) fn turned_arm() -> ReducedLink {
    let turned = |x, y, z, roll, pitch, yaw| {
        let R = Rotation3::from_euler_angles(roll, pitch, yaw);
        Pose::from_parts(Translation3::new(x, y, z), R)
    };
    let mut link = offset_arm();
    link.X_LA = turned(0.01, -0.02, 0.03, 0.3, 0.2, -0.9);
    link.X_LB = turned(0.1, 0.2, 1.2, -1.3, 0.4, 2.0);
    link.X_LS = Some(turned(0.2, -0.1, 0.4, 0.5, -0.6, 0.7));
    link.reduce().unwrap()
}

/// The same cases in every run, without files of failures next to the sources.
pub(crate) fn fixed_cases() -> ProptestConfig {
    ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(20_260_131), ..ProptestConfig::default() }
}

/// Any pose within 2 m.
pub(crate) fn pose() -> impl Strategy<Value = Pose> {
    let p = [-2.0..2.0, -2.0..2.0, -2.0..2.0_f64];
    let turn = [-3.0..3.0, -1.5..1.5, -3.0..3.0_f64];
    (p, turn).prop_map(|(p, [roll, pitch, yaw])| {
        Pose::from_parts(Translation3::from(Vector3::from(p)), Rotation3::from_euler_angles(roll, pitch, yaw))
    })
}

pub(crate) fn vector6() -> impl Strategy<Value = Vector6<f64>> {
    prop::array::uniform6(-1.0..1.0_f64).prop_map(Vector6::from)
}

/// Positive definite 6x6 with entries of the size of a link's: 1e7 N/m, 1e6 N m/rad.
pub(crate) fn spd_stiffness() -> impl Strategy<Value = Matrix6<f64>> {
    prop::collection::vec(-1.0..1.0_f64, 36).prop_map(|entries| {
        let X = Matrix6::from_column_slice(&entries);
        let K = X * X.transpose() + Matrix6::identity() * 0.2;
        let s = Vector6::new(3e3, 3e3, 3e3, 1e3, 1e3, 1e3);
        K.component_mul(&(s * s.transpose()))
    })
}

/// Frames of a straight link along x.
pub(crate) fn frames(length: f64) -> LinkFrames {
    LinkFrames::new(Pose::identity(), Pose::translation(length, 0.0, 0.0))
}

/// An arm offset from its joint line, with all frames rotated: all couplings are non-zero.
pub(crate) fn turned() -> BeamLink {
    let pose = |x, y, z, roll, pitch, yaw| {
        Pose::from_parts(Translation3::new(x, y, z), Rotation3::from_euler_angles(roll, pitch, yaw))
    };
    BeamLink {
        X_LA: pose(0.01, -0.02, 0.03, 0.3, 0.2, -0.9),
        X_LB: pose(0.1, 0.2, 1.2, -1.3, 0.4, 2.0),
        mass: Some(60.0),
        ..offset_arm()
    }
}
