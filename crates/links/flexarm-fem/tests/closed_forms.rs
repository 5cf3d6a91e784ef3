//! Beams against textbook formulas: sections, tip displacements, masses, frequencies.

use std::f64::consts::PI;

use approx::assert_relative_eq;
use flexarm_fem::{Bar, Beam, BeamTheory, FemError, Material, Pose, Section};
use flexarm_spatial::{adjoint, skew};
use nalgebra::{DMatrix, Matrix6, SMatrix, Vector6};

const THEORIES: [BeamTheory; 2] = [BeamTheory::EulerBernoulli, BeamTheory::Timoshenko];

/// All values differ, so that a swap is detected.
fn bar() -> Bar {
    Bar {
        EA: 4.2e8,
        EI_y: 2.1e5,
        EI_z: 1.3e5,
        GJ: 3.1e5,
        kGA_y: Some(0.9e8),
        kGA_z: Some(0.7e8),
        mass_per_length: 14.0,
        rotary_y: 0.008,
        rotary_z: 0.005,
    }
}

/// Truth: cantilever, F l/EA; T l/GJ; F l³/3EI + F l/kGA with slope F l²/2EI; M l²/2EI with M l/EI.
#[test]
fn tip_yields_to_six_loads_as_the_textbook_says() {
    let (l, b) = (0.8, bar());
    for theory in THEORIES {
        let shear = f64::from(theory == BeamTheory::Timoshenko);
        let K_BB = Beam::new(b, theory, l).unwrap().tip_stiffness();
        let u_B = |load: usize| K_BB.lu().solve(&Vector6::ith(load, 150.0)).unwrap();
        let bend_y = 150.0 * (l.powi(3) / (3.0 * b.EI_z) + shear * l / 0.9e8);
        let bend_z = 150.0 * (l.powi(3) / (3.0 * b.EI_y) + shear * l / 0.7e8);
        let slope_y = 150.0 * l * l / (2.0 * b.EI_z);
        let slope_z = 150.0 * l * l / (2.0 * b.EI_y);

        let expected = [
            Vector6::new(150.0 * l / b.EA, 0.0, 0.0, 0.0, 0.0, 0.0),
            Vector6::new(0.0, bend_y, 0.0, 0.0, 0.0, slope_y),
            Vector6::new(0.0, 0.0, bend_z, 0.0, -slope_z, 0.0),
            Vector6::new(0.0, 0.0, 0.0, 150.0 * l / b.GJ, 0.0, 0.0),
            Vector6::new(0.0, 0.0, -slope_z, 0.0, 150.0 * l / b.EI_y, 0.0),
            Vector6::new(0.0, slope_y, 0.0, 0.0, 0.0, 150.0 * l / b.EI_z),
        ];
        for (load, expected) in expected.into_iter().enumerate() {
            // measured 2e-15
            assert_relative_eq!(u_B(load), expected, max_relative = 1e-13, epsilon = 1e-18);
        }
    }
}

/// Identity: compliance and stiffness are inverses, and rigid motions cause no force.
#[test]
fn stiffness_and_compliance_belong_together() {
    let l = 0.8;
    for theory in THEORIES {
        let beam = Beam::new(bar(), theory, l).unwrap();
        let one = beam.tip_stiffness() * beam.tip_compliance();
        assert!((one - Matrix6::identity()).amax() < 1e-13); // measured 2e-15

        let K = beam.stiffness12();
        assert_eq!(K, K.transpose());
        let mut R = SMatrix::<f64, 12, 6>::zeros();
        R.fixed_view_mut::<6, 6>(0, 0).fill_with_identity();
        let Ad_BA = adjoint(&Pose::translation(-l, 0.0, 0.0));
        R.fixed_view_mut::<6, 6>(6, 0).copy_from(&Ad_BA);
        assert!((K * R).amax() < 1e-15 * K.amax()); // measured 2e-18
    }
}

/// Truth: springs in series, `C_BB = Σ Ad_Bk C_k Ad_Bkᵀ`, for equal and unequal segments.
#[test]
fn compliances_of_segments_add_up_to_the_whole_beam() {
    for theory in THEORIES {
        let whole = Beam::new(bar(), theory, 0.8).unwrap().tip_compliance();
        for cuts in [vec![0.4, 0.8], vec![0.1, 0.35, 0.8], vec![0.2, 0.4, 0.6, 0.8]] {
            let mut sum = Matrix6::zeros();
            let mut start = 0.0;
            for end in cuts {
                let C_k = Beam::new(bar(), theory, end - start).unwrap().tip_compliance();
                let Ad_Bk = adjoint(&Pose::translation(end - 0.8, 0.0, 0.0));
                sum += Ad_Bk * C_k * Ad_Bk.transpose();
                start = end;
            }
            // measured 2e-16
            assert_relative_eq!(sum, whole, max_relative = 1e-13, epsilon = 1e-20);
        }
    }
}

/// Truth: textbook mass matrix m/420 [156 22l 54 -13l; ...] of a beam without rotary inertia.
#[test]
fn slender_mass_is_the_textbook_matrix() {
    let l = 0.8;
    let slender = Bar { rotary_y: 1e-30, rotary_z: 1e-30, ..bar() };
    let M = Beam::new(slender, BeamTheory::EulerBernoulli, l).unwrap().mass12();
    let m = 14.0 * l / 420.0;
    let expected = [
        (1, 1, 156.0),
        (1, 5, 22.0 * l),
        (1, 7, 54.0),
        (1, 11, -13.0 * l),
        (5, 5, 4.0 * l * l),
        (5, 7, 13.0 * l),
        (5, 11, -3.0 * l * l),
        (2, 4, -22.0 * l),
        (2, 10, 13.0 * l),
    ];
    for (i, j, factor) in expected {
        assert_relative_eq!(M[(i, j)], m * factor, max_relative = 1e-13); // measured 4e-16
    }
}

/// Identity: `Rᵀ M R` of the consistent mass is the spatial inertia of the piece, for both
/// theories.
#[test]
fn consistent_mass_has_the_mass_properties_of_the_piece() {
    let l = 0.8;
    for theory in THEORIES {
        let beam = Beam::new(bar(), theory, l).unwrap();
        let mut R = SMatrix::<f64, 12, 6>::zeros();
        R.fixed_view_mut::<6, 6>(0, 0).fill_with_identity();
        R.fixed_view_mut::<6, 6>(6, 0).copy_from(&adjoint(&Pose::translation(-l, 0.0, 0.0)));
        let M_rigid = R.transpose() * beam.mass12() * R;
        let M_piece = beam.piece(0.0, 1.0).unwrap().spatial_inertia();
        assert!((M_rigid - M_piece).amax() < 1e-13 * M_piece.amax()); // measured 2e-16
    }
}

/// Truth: w_n = (beta_n l)² sqrt(EI/(rho A l⁴)) of the clamped-free beam, with eight elements.
#[test]
fn cantilever_frequencies_converge_to_the_closed_form() {
    let (l, n) = (1.0, 8_u32);
    // No rotary inertia and equal stiffness in y and z: the lowest pair is the first bending mode.
    let slender = Bar { EI_y: 1.3e5, rotary_y: 1e-9, rotary_z: 1e-9, ..bar() };
    let element = Beam::new(slender, BeamTheory::EulerBernoulli, l / f64::from(n)).unwrap();
    let (k, m) = (element.stiffness12(), element.mass12());
    let size = 6 * n as usize;
    let (mut K, mut M) = (DMatrix::<f64>::zeros(size, size), DMatrix::<f64>::zeros(size, size));
    for e in 0..n as usize {
        for i in 0..12 {
            for j in 0..12 {
                let (row, column) = (6 * e + i, 6 * e + j);
                if row >= 6 && column >= 6 {
                    K[(row - 6, column - 6)] += k[(i, j)];
                    M[(row - 6, column - 6)] += m[(i, j)];
                }
            }
        }
    }
    // Torsion has almost no inertia here and therefore only very high frequencies.
    let L_inv = M.cholesky().unwrap().l().try_inverse().unwrap();
    let mut squares: Vec<f64> = (&L_inv * K * L_inv.transpose()).symmetric_eigenvalues().iter().copied().collect();
    squares.sort_by(f64::total_cmp);
    for (pair, beta_l, bound) in [(0, 1.875_104_069, 1e-5), (2, 4.694_091_133, 3e-4)] {
        let omega_n = f64::powi(beta_l, 2) * (1.3e5 / 14.0_f64).sqrt() / (l * l);
        // measured 2e-6 and 8e-5: discretisation error of the element, of order (beta h)⁴
        assert_relative_eq!(squares[pair].sqrt(), omega_n, max_relative = bound);
        assert_relative_eq!(squares[pair + 1].sqrt(), omega_n, max_relative = bound);
    }
}

/// Truth: pieces of a bar, m l²/12 and the parallel axis theorem.
#[test]
fn pieces_add_up_to_the_beam() {
    let beam = Beam::new(bar(), BeamTheory::EulerBernoulli, 0.8).unwrap();
    let (near, far) = (beam.piece(0.0, 0.3).unwrap(), beam.piece(0.3, 1.0).unwrap());
    let (sum, whole) = (near.merged(&far), beam.piece(0.0, 1.0).unwrap());
    assert_relative_eq!(whole.mass, 11.2, max_relative = 1e-15);
    assert_relative_eq!(whole.inertia[(1, 1)], 11.2 * 0.64 / 12.0 + 0.0064, max_relative = 1e-14);
    assert_relative_eq!(sum.mass, whole.mass, max_relative = 1e-14);
    assert_relative_eq!(sum.com, whole.com, max_relative = 1e-14);
    assert_relative_eq!(sum.inertia, whole.inertia, max_relative = 1e-13); // measured 2e-16
    assert!(beam.piece(0.5, 0.5).is_err() && beam.piece(-0.1, 0.5).is_err());
    assert!(beam.piece(0.5, 1.1).is_err() && beam.piece(f64::NAN, 0.5).is_err());
    assert!(skew(&whole.com).amax() > 0.0);
}

/// Truth: b h³/12 about y with `height` along z, walls by difference, Bredt 4 A² t/U.
#[test]
fn box_of_the_lower_arm_has_its_hand_calculated_values() {
    let section = Section::Box { width: 0.160, height: 0.120, wall: 0.010 };
    let s = section.properties(0.33).unwrap();
    assert_relative_eq!(s.A, 5.2e-3, max_relative = 1e-13);
    assert_relative_eq!(s.I_y, 1.137_333_333_333_333e-5, max_relative = 1e-13);
    assert_relative_eq!(s.I_z, 1.809_333_333_333_333e-5, max_relative = 1e-13);
    assert_relative_eq!(s.J, 2.094_230_769_230_769e-5, max_relative = 1e-13);
}

/// Truths: two distant walls are two strips, 10(1+nu)/(12+11nu); a square by Cowper's table,
/// 20(1+nu)/(48+39nu); a square with nu = 0 by its shear flow, 5/12. Solid elements: 0.2797, 0.5946
/// for the last case.
#[test]
fn all_walls_of_a_box_shear() {
    let k = |width, height, wall, nu| {
        let s = Section::Box { width, height, wall }.properties(nu).unwrap();
        [s.k_y, s.k_z]
    };
    assert_relative_eq!(k(1.0, 1e-4, 1e-7, 0.3)[0], 13.0 / 15.3, max_relative = 1e-3);
    for nu in [0.0, 0.3] {
        let square = k(0.24, 0.24, 0.01, nu);
        assert_relative_eq!(square[0], 20.0 * (1.0 + nu) / (48.0 + 39.0 * nu), max_relative = 1e-12);
        assert_relative_eq!(square[1], square[0], max_relative = 1e-14);
    }
    assert_relative_eq!(k(0.24, 0.24, 0.01, 0.0)[0], 5.0 / 12.0, max_relative = 1e-12);
    let [k_y, k_z] = k(0.03, 0.05, 0.003, 0.33);
    assert_relative_eq!(k_y, 0.2797, max_relative = 1e-2);
    assert_relative_eq!(k_z, 0.5946, max_relative = 1e-2);
}

/// Truth: J = 0.140577014955154 a⁴ for a square, b h³/3 (1 - 0.630 h/b) for a strip (Timoshenko &
/// Goodier, art. 109), and the 0.21 approximation of the theory page in between.
#[test]
fn rectangle_torsion_is_the_exact_series() {
    let J = |width, height| Section::Rectangle { width, height }.properties(0.3).unwrap().J;
    assert_relative_eq!(J(1.0, 1.0), 0.140_577_014_955_154, max_relative = 1e-12);
    let strip = 10.0 / 3.0 * (1.0 - 0.630_248_7 * 0.1);
    assert_relative_eq!(J(10.0, 1.0), strip, max_relative = 1e-6);
    assert_eq!(J(0.03, 0.08), J(0.08, 0.03));
    for ratio in [1.0, 1.5, 2.0, 4.0, 8.0] {
        let h: f64 = 1.0 / ratio;
        let approximation = h.powi(3) * (1.0 / 3.0 - 0.21 * h * (1.0 - h.powi(4) / 12.0));
        assert_relative_eq!(J(1.0, h), approximation, max_relative = 5e-3); // measured 2.1e-3
    }
}

/// Truth: Cowper's circle 6(1+nu)/(7+6nu), thin tube 2(1+nu)/(4+3nu), rectangle 10(1+nu)/(12+11nu).
#[test]
fn shear_factors_are_those_of_cowper() {
    let nu = 0.3;
    let k = |section: Section| section.properties(nu).unwrap().k_y;
    let circle = k(Section::Circle { diameter: 0.1 });
    assert_relative_eq!(circle, 6.0 * 1.3 / 8.8, max_relative = 1e-14);
    let thin = k(Section::Tube { outer_diameter: 0.1, wall: 1e-6 });
    assert_relative_eq!(thin, 2.0 * 1.3 / 4.9, max_relative = 1e-4);
    let rectangle = k(Section::Rectangle { width: 0.1, height: 0.02 });
    assert_relative_eq!(rectangle, 13.0 / 15.3, max_relative = 1e-14);
}

#[test]
fn round_sections_have_polar_torsion() {
    let s = Section::Tube { outer_diameter: 0.14, wall: 0.006 }.properties(0.3).unwrap();
    assert_relative_eq!(s.A, PI * (0.07_f64.powi(2) - 0.064_f64.powi(2)), max_relative = 1e-13);
    assert_relative_eq!(s.I_y, 5.680_615_269_850_455e-6, max_relative = 1e-12);
    assert_relative_eq!(s.J, s.I_y + s.I_z, max_relative = 1e-15);
}

#[test]
fn impossible_sections_name_the_dimension() {
    let wall = Section::Box { width: 0.1, height: 0.05, wall: 0.03 };
    let message = wall.bar(&Material::STEEL).unwrap_err().to_string();
    assert!(message.contains("wall") && message.contains("0.03"), "{message}");
    let width = Section::Rectangle { width: f64::NAN, height: 0.1 };
    assert!(width.bar(&Material::STEEL).unwrap_err().to_string().contains("width"));
    let tube = Section::Tube { outer_diameter: 0.1, wall: 0.05 };
    assert!(tube.bar(&Material::STEEL).is_err());
    assert!(Section::Circle { diameter: -1.0 }.bar(&Material::STEEL).is_err());
}

#[test]
fn timoshenko_without_shear_stiffness_is_refused_and_euler_is_not() {
    let b = Bar { kGA_z: None, ..bar() };
    let error = Beam::new(b, BeamTheory::Timoshenko, 1.0).unwrap_err();
    assert!(matches!(error, FemError::Missing { .. }) && error.to_string().contains("kGA_z"));
    assert!(Beam::new(b, BeamTheory::EulerBernoulli, 1.0).is_ok());
}

#[test]
fn sections_and_materials_read_from_toml() {
    let section: Section = toml::from_str("shape = \"tube\"\nouter_diameter = 0.1\nwall = 0.01").unwrap();
    assert_eq!(section, Section::Tube { outer_diameter: 0.1, wall: 0.01 });
    assert!(toml::from_str::<Section>("shape = \"circle\"\ndiametre = 0.1").is_err());
    let material: Material = toml::from_str("E = 2e11\nnu = 0.3\nrho = 7800.0").unwrap();
    assert_relative_eq!(material.shear_modulus(), 2e11 / 2.6, max_relative = 1e-15);
    let given: Section = toml::from_str(&format!("shape = \"given\"\n{}", toml::to_string(&bar()).unwrap())).unwrap();
    assert_eq!(given, Section::Given(bar()));
}
