//! The law of a guide: tilt, moment, energy and their derivatives.

use flexarm_stepping::*;

fn with_play() -> Guide {
    let play = Some(Play { gap: 4.1e-4, centre: 5.8, width: 27.0 });
    Guide { coordinate: 0, overlap: [1.448, -0.5], compliance: [2e-6, 4e-7, 3e-7], play }
}

#[test]
fn the_moment_is_the_inverse_of_the_tilt_and_its_slope_the_derivative() {
    let mut narrow = with_play();
    narrow.play = Some(Play { gap: 1e-3, centre: -3.0, width: 0.01 });
    let mut worst = [0.0f64; 2];
    for guide in [with_play(), narrow, Guide { play: None, ..with_play() }] {
        for q in [0.0, 1.3, 2.4] {
            for moment in (-200..=200).map(|k| 2.3 * f64::from(k)).chain([-0.02, 0.0, 5.8, 6.3]) {
                let [theta, compliance] = guide.tilt(moment, guide.overlap(&[q]));
                let off = [guide.torque(theta, &[q]) - moment, guide.slope(theta, &[q]) * compliance - 1.0];
                worst.iter_mut().zip(off).for_each(|(worst, off)| *worst = worst.max(off.abs()));
            }
        }
    }
    assert!(worst[0] < 1e-11 && worst[1] < 1e-9, "{worst:?}"); // measured 2.3e-13 N m, 1e-15
}

#[test]
fn moment_and_reaction_are_derivatives_of_the_energy() {
    let (guide, mut worst) = (with_play(), [0.0f64; 2]);
    for (theta, q) in [(1e-3, 2.2), (-4e-4, 1.0), (2e-5, 2.0)] {
        let h = 1e-7;
        let by_tilt = (guide.energy(theta + h, &[q]) - guide.energy(theta - h, &[q])) / (2.0 * h);
        let h = 1e-5;
        let by_joint = (guide.energy(theta, &[q + h]) - guide.energy(theta, &[q - h])) / (2.0 * h);
        let off = [by_tilt / guide.torque(theta, &[q]) - 1.0, by_joint / guide.reaction(theta, &[q]) - 1.0];
        worst.iter_mut().zip(off).for_each(|(worst, off)| *worst = worst.max(off.abs()));
    }
    assert!(worst[0] < 1e-6 && worst[1] < 1e-6, "{worst:?}"); // measured 1.1e-8, 2.6e-10
}

#[test]
fn derivatives_by_the_numbers_of_the_law_are_those_of_the_moment() {
    let (guide, mut worst) = (with_play(), 0.0f64);
    let terms = (0..3).map(GuideTerm::Compliance).chain([GuideTerm::Gap, GuideTerm::Centre, GuideTerm::Width]);
    for (term, h) in terms.zip([1e-10, 1e-10, 1e-10, 1e-8, 1e-4, 1e-4]) {
        for (theta, q) in [(1e-3, 2.2), (-4e-4, 1.0), (2e-4, 2.0)] {
            let at = |change: f64| guide.with(term, change).torque(theta, &[q]);
            let (difference, slope) = ((at(h) - at(-h)) / (2.0 * h), guide.torque_slope(term, theta, &[q]));
            worst = worst.max((difference / slope - 1.0).abs());
        }
    }
    assert!(worst < 1e-5, "{worst:e}"); // measured 2.5e-8
}

#[test]
fn the_clearance_of_a_stiff_guide_is_the_tilt_between_its_sides() {
    let mut guide = with_play();
    guide.compliance = [1e-12, 0.0, 0.0];
    guide.play = Some(Play { gap: 4e-4, centre: 0.0, width: 0.1 });
    let sides = [1.0, -1.0].map(|side| guide.tilt(50.0 * side, 0.2)[0]);
    assert!((sides[0] - sides[1] - 4e-4 / 0.2).abs() < 1e-9);
}
