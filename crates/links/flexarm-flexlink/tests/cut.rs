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

/// The two parts of a beam from 0 to 0.8 m with the mass of [`bar`], cut at a quarter.
fn halves() -> [RigidPart; 2] {
    [(3.0, 0.1, 0.2), (9.0, 0.5, 0.6)].map(|(mass, x, length)| {
        let I = mass * length * length / 12.0;
        let inertia = Matrix3::from_diagonal(&vector![0.02 * mass / 12.0, I, I]);
        RigidPart { mass, com: vector![x, 0.0, 0.0], inertia }
    })
}

fn uniform() -> RigidPart {
    let [a, b] = halves();
    a.merged(&b)
}

fn share(link: &LinkInertia) -> Result<SharedInertia, CutError> {
    let [a, b] = halves();
    share_inertia(link, [&a, &b])
}

fn assert_is(found: &RigidPart, link: &LinkInertia) {
    assert_relative_eq!(found.mass, link.mass, epsilon = 1e-12);
    assert_relative_eq!(found.com, link.com, epsilon = 1e-12);
    assert_relative_eq!(found.inertia, link.inertia_com, epsilon = 1e-12);
}

/// Truth: the link. Its centre of mass lies near A, behind A, beyond B, beside the line; its
/// inertia is that of the bar, half of it, a tenth of it. Measured 4e-15.
#[test]
fn beam_and_ends_of_a_link_that_cannot_be_cut_are_exactly_the_link() {
    let (p_LA, p_LB) = (Vector3::zeros(), vector![0.8, 0.0, 0.0]);
    for (x, y, factor) in [(0.1, 0.0, 1.0), (-0.05, 0.1, 1.0), (0.9, 0.0, 0.5), (0.4, 0.0, 0.1), (0.3, 0.02, 0.1)] {
        let mut link = bar();
        (link.com.x, link.com.y) = (x, y);
        link.inertia_com *= factor;
        assert!(cut_inertia(&link, &p_LA, &p_LB, 0.5).is_none(), "{x} {factor}");
        let SharedInertia { share, ends: [near, far] } = share(&link).unwrap();
        let beam = uniform().with_mass(share * link.mass);
        let whole = [&near, &far].into_iter().filter(|end| end.mass > 0.0).fold(beam, |sum, end| sum.merged(end));
        assert_is(&whole, &link);
        for end in [near, far] {
            assert!(end.mass >= 0.0 && end.inertia.symmetric_eigenvalues().min() > -1e-12, "{end:?}");
        }
        assert!(share > 0.05 && share < 0.9, "{x} {y} {factor}: {share}");
    }
}

/// Truth: half of the mass in a uniform bar, half in a ball of radius 0.1 m at A.
#[test]
fn a_bar_with_a_ball_at_its_end_has_the_mass_of_the_ball_there() {
    let ball = RigidPart { mass: 6.0, com: Vector3::zeros(), inertia: Matrix3::identity() * (0.4 * 6.0 * 0.01) };
    let whole = uniform().with_mass(6.0).merged(&ball);
    let link = LinkInertia { mass: 12.0, com: whole.com, inertia_com: whole.inertia };
    let found = share(&link).unwrap();
    // The beam takes as much as the inertia admits, a little more than the bar's half.
    assert!((0.5..0.56).contains(&found.share), "{}", found.share);
    let [near, far] = found.ends;
    assert!(near.mass > 5.2 && far.mass < 1e-12, "{} {}", near.mass, far.mass);
}

/// Centre of mass 0.22 m from that of the beam, a tenth of its inertia: 0.2 % are left for the beam.
#[test]
fn a_body_far_off_its_beam_that_leaves_less_than_a_percent_is_refused() {
    let mut link = bar();
    (link.com.x, link.com.y) = (0.3, 0.2);
    link.inertia_com *= 0.1;
    let error = share(&link).unwrap_err();
    assert_relative_eq!(error.share, 0.002_028_873, epsilon = 1e-8);
    let text = error.to_string();
    assert!(text.contains("leave 0.20 % of its 12.000 kg for the beam, at least 1 % are needed"), "{text}");
}

#[test]
fn a_point_mass_leaves_nothing_for_a_beam_and_the_remedy_is_named() {
    let mut point = bar();
    point.inertia_com *= 1e-6;
    let error = share(&point).unwrap_err();
    assert!(error.share < 1e-3 && error.to_string().contains("parts = \"uniform\""), "{error}");
}
