//! The split: an elastic joint at any frame reproduces the stiffness of the whole link.

use crate::common::{fixed_cases, frames, lower_arm, offset_arm, pose, spd_stiffness, turned_arm, vector6};
use approx::assert_relative_eq;
use flexarm_fem::{
    Bar, Beam, BeamLink, BeamTheory, FemError, Material, Pose, Section, drop_coupling, stiffness_at_split,
};
use flexarm_spatial::adjoint;
use nalgebra::{Matrix6, Vector3, Vector6};
use proptest::prelude::*;

/// Truth: Euler-Bernoulli cantilever, w = F l³/(3EI), slope = F l²/(2EI), for any position of the
/// split.
#[test]
fn split_keeps_cantilever_tip_deflection() {
    let bar = Bar {
        EA: 4.2e8,
        EI_y: 2.1e5,
        EI_z: 1.3e5,
        GJ: 3.1e5,
        kGA_y: None,
        kGA_z: None,
        mass_per_length: 14.0,
        rotary_y: 0.008,
        rotary_z: 0.005,
    };
    let (l, EI, force) = (0.8, bar.EI_z, 150.0);
    let K_BB = Beam::new(bar, BeamTheory::EulerBernoulli, l).unwrap().tip_stiffness();
    let F_B = Vector6::new(0.0, force, 0.0, 0.0, 0.0, 0.0);
    for fraction in [0.0, 0.3, 0.5, 1.0] {
        let X_BS = Pose::new(Vector3::new(-(1.0 - fraction) * l, 0.0, 0.0), Vector3::new(0.4, -0.2, 0.1));
        let K_S = stiffness_at_split(&K_BB, &X_BS).unwrap();
        let Ad_BS = adjoint(&X_BS);
        let u_B = Ad_BS * K_S.cholesky().unwrap().solve(&(Ad_BS.transpose() * F_B));
        // measured 2e-15
        assert_relative_eq!(u_B[1], force * l.powi(3) / (3.0 * EI), max_relative = 1e-12);
        assert_relative_eq!(u_B[5], force * l.powi(2) / (2.0 * EI), max_relative = 1e-12);
    }
}

/// Golden: `K_S` and the halves of the two flexible links of a test arm, cut in the middle.
/// Provenance: numpy implementation of the same closed form (exact Timoshenko 12×12).
#[test]
fn mid_split_agrees_with_the_numpy_implementation() {
    let lower = lower_arm().reduce().unwrap();
    let expected = [
        10_061_440.364_592_962,
        6_461_387.335_055_217,
        332_420_091.324_200_8,
        727_062.404_870_622_8,
        1_156_651.445_966_515_2,
        503_299.872_441_905_6,
    ];
    for (i, expected) in expected.into_iter().enumerate() {
        assert_relative_eq!(lower.split.K_S[(i, i)], expected, max_relative = 1e-12); // measured 1e-15
    }
    assert_relative_eq!(lower.K_BB[(0, 4)], -5_508_638.599_614_646, max_relative = 1e-12);
    assert_relative_eq!(lower.split.X_LS.translation.vector, Vector3::new(0.0, 0.0, 0.5475));
    assert_relative_eq!(lower.proximal.com, Vector3::new(0.0, 0.0, 0.27375), epsilon = 1e-15);
    assert_relative_eq!(lower.distal.com, Vector3::new(0.0, 0.0, 0.82125), epsilon = 1e-15);
    let moments = [0.815_006_009_615_384_6, 0.853_775_240_384_615_5, 0.17];
    for (i, moment) in moments.into_iter().enumerate() {
        assert_relative_eq!(lower.distal.inertia[(i, i)], moment, max_relative = 1e-12);
    }

    // The upper arm of the reference uses the thin-tube shear factor 2(1+nu)/(4+3nu); `Tube` uses
    // the exact one.
    let tube = Section::Tube { outer_diameter: 0.140, wall: 0.006 };
    let bar = tube.bar(&Material::STEEL).unwrap();
    let kGA = bar.EA / 2.6 * (2.6 / 4.9);
    let thin = Section::Given(Bar { kGA_y: Some(kGA), kGA_z: Some(kGA), ..bar });
    let upper = |section| {
        let link = BeamLink::new("upper_arm", section, Material::STEEL, 1.0);
        BeamLink { mass: Some(40.0), ..link }.reduce().unwrap()
    };
    let expected = [
        530_426_503.632_101_24,
        12_643_198.710_683_86,
        12_643_198.710_683_86,
        917_637.851_283_535,
        1_192_929.206_668_595_8,
        1_192_929.206_668_595_8,
    ];
    let (thin, exact) = (upper(thin).split.K_S, upper(tube).split.K_S);
    for (i, expected) in expected.into_iter().enumerate() {
        assert_relative_eq!(thin[(i, i)], expected, max_relative = 1e-12); // measured 0
        assert_relative_eq!(exact[(i, i)], expected, max_relative = 2e-3); // measured 4e-4
    }
}

/// Second algorithm: tip displacement of the offset beam by transforming wrench and displacement.
#[test]
fn offset_beam_moves_its_joint_frame_as_the_rigid_arms_say() {
    let recipe = offset_arm();
    let link = recipe.reduce().unwrap();
    let C_E2 = Beam::new(recipe.section.bar(&recipe.material).unwrap(), recipe.theory, recipe.length)
        .unwrap()
        .tip_compliance();
    let R_LE = recipe.X_LE.rotation;
    let p_BE2 = Vector3::new(0.03, 0.05, 0.0); // joint B is offset from the end of the beam
    let (f, t) = (Vector3::new(120.0, -40.0, 900.0), Vector3::new(15.0, 25.0, -35.0));

    // Wrench at the beam end, displacement there, and back to B.
    let (f_E, t_E) = (R_LE.inverse() * f, R_LE.inverse() * (t - p_BE2.cross(&f)));
    let u = C_E2 * Vector6::new(f_E.x, f_E.y, f_E.z, t_E.x, t_E.y, t_E.z);
    let theta = R_LE * u.fixed_rows::<3>(3).into_owned();
    let shift = R_LE * u.fixed_rows::<3>(0).into_owned() - theta.cross(&p_BE2);

    let u_B = link.tip_compliance().unwrap() * Vector6::new(f.x, f.y, f.z, t.x, t.y, t.z);
    assert_relative_eq!(u_B.fixed_rows::<3>(0).into_owned(), shift, max_relative = 1e-11); // measured 5e-15
    assert_relative_eq!(u_B.fixed_rows::<3>(3).into_owned(), theta, max_relative = 1e-11);
}

/// Identity: mass, centre and inertia of the merged parts do not depend on the position of the cut.
#[test]
fn the_cut_does_not_change_the_whole_body() {
    let whole = |split_fraction| BeamLink { split_fraction, ..offset_arm() }.reduce().unwrap().rigid();
    let middle = whole(0.5);
    assert_relative_eq!(middle.mass, 60.0, max_relative = 1e-14);
    for fraction in [0.1, 0.4, 0.9] {
        let body = whole(fraction);
        assert_relative_eq!(body.com, middle.com, epsilon = 1e-14);
        assert_relative_eq!(body.inertia, middle.inertia, epsilon = 1e-13); // measured 1e-15
    }
}

/// Error of dropping the coupling: tip deflection of a straight beam split at 0.4 of its length.
#[test]
fn dropping_the_coupling_is_wrong_by_tens_of_per_cent() {
    let link = BeamLink { split_fraction: 0.4, ..lower_arm() }.reduce().unwrap();
    let plain = link.without_coupling();
    assert_eq!(plain.split.K_S, drop_coupling(&link.split.K_S));
    let sag = |link: &flexarm_fem::ReducedLink| link.tip_compliance().unwrap()[(0, 0)];
    let error = sag(&plain) / sag(&link) - 1.0;
    assert!(error > 0.1, "{error}"); // measured +22 %
}

/// Identity: the 12×12 rebuilt from K_BB passes the gate and gives K_BB back.
#[test]
fn twelve_by_twelve_and_six_by_six_hold_the_same() {
    let link = turned_arm();
    let again = flexarm_fem::ReducedLink::from_matrix12(
        "again",
        link.frames(),
        &link.matrix12(),
        [link.proximal.clone(), link.distal.clone()],
        link.provenance.clone(),
        &flexarm_fem::GateLimits::default(),
    )
    .unwrap();
    assert_eq!(again.K_BB, link.K_BB);
    assert!(again.checks.rigid_body_residual.unwrap() < 1e-14); // measured 5e-17
    assert!(again.checks.block_identity.unwrap() < 1e-14);
    assert!(again.warnings(&flexarm_fem::GateLimits::default()).is_empty());
}

#[test]
fn impossible_recipes_are_named() {
    let message = |link: BeamLink| link.reduce().unwrap_err().to_string();
    assert!(message(BeamLink { split_fraction: 0.0, ..lower_arm() }).contains("split_fraction"));
    assert!(message(BeamLink { mass: Some(-1.0), ..lower_arm() }).contains("mass of the link"));
    assert!(message(BeamLink { length: 0.0, ..lower_arm() }).contains("length"));
    let far = Pose::translation(1095.0, 0.0, 0.0);
    assert!(message(BeamLink { X_LB: far, ..lower_arm() }).contains("millimetres"));
    let parallel = lower_arm().along(Vector3::z(), Vector3::z(), 0.0, Vector3::zeros());
    assert!(matches!(parallel, Err(FemError::OutOfRange { .. })));
    assert_eq!(frames(2.0).p_AB(), Vector3::new(2.0, 0.0, 0.0));
}

proptest! {
    #![proptest_config(fixed_cases())]

    /// u_B = C_BB F_B for any split: the elastic joint at S transmits any wrench at B.
    #[test]
    fn tip_displacement_does_not_depend_on_the_split(
        K_BB in spd_stiffness(), X_BS in pose(), F_B in vector6(),
    ) {
        let K_S = stiffness_at_split(&K_BB, &X_BS).unwrap();
        let Ad_BS = adjoint(&X_BS);
        let F_S = Ad_BS.transpose() * F_B;
        let u_B = Ad_BS * K_S.cholesky().unwrap().solve(&F_S);
        let exact = K_BB.cholesky().unwrap().solve(&F_B);
        // Compared in energy, which has a single unit; measured 2e-13.
        let error = u_B - exact;
        let energy = |x: &Vector6<f64>| x.dot(&(K_BB * x)).max(0.0);
        prop_assert!(energy(&error).sqrt() <= 1e-11 * energy(&exact).sqrt());
    }

    #[test]
    fn elastic_energy_does_not_depend_on_the_split(
        K_BB in spd_stiffness(), X_BS in pose(), d_S in vector6(),
    ) {
        let K_S = stiffness_at_split(&K_BB, &X_BS).unwrap();
        let u_B = adjoint(&X_BS) * d_S;
        let scale = K_S.norm() * d_S.norm_squared(); // bound by the size of the terms; measured 3e-16
        prop_assert!((d_S.dot(&(K_S * d_S)) - u_B.dot(&(K_BB * u_B))).abs() <= 1e-12 * scale);
    }

    /// The stiffness at B does not depend on the position of the split.
    #[test]
    fn moving_the_split_of_a_link_keeps_its_tip_stiffness(X_LS in pose()) {
        let link = turned_arm();
        let moved = link.with_split(X_LS).unwrap();
        prop_assert_eq!(&moved.K_BB, &link.K_BB);
        let X_SB = X_LS.inverse() * Pose::from(link.X_LB.translation);
        let Ad_SB = adjoint(&X_SB);
        let back: Matrix6<f64> = Ad_SB.transpose() * moved.split.K_S * Ad_SB;
        prop_assert!((back - link.K_BB).amax() <= 1e-12 * moved.split.K_S.amax()); // measured 2e-15
    }
}
