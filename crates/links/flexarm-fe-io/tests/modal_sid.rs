//! Conversion of modal links to Standard Input Data and back.

use crate::common::turned;
use crate::exchange::sid_writer::{sid_of_modal_link, write_sid};
use flexarm_fe_io::exchange::{Sid, SidMatrix, modal_link_from_sid, modal_link_held_at, parse_sid};
use flexarm_fem::{ModalLink, ModalOptions, UnitSystem};
use nalgebra::{DMatrix, Matrix3, Matrix6xX};

fn worst(gaps: impl Iterator<Item = f64>) -> f64 {
    gaps.fold(0.0, f64::max)
}

#[test]
fn a_modal_link_survives_standard_input_data() {
    let link = turned().modal_with(&ModalOptions { modes: 5, geometric: true, ..ModalOptions::default() }).unwrap();
    let sid = sid_of_modal_link(&link);
    let text = write_sid(&sid);
    let read = parse_sid(&text, "arm.SID_FEM").unwrap();
    assert_eq!(read, sid);
    let found = read.conventions("arm").unwrap();
    assert!(found.gyro_residual < 1e-14 && found.oe_residual < 1e-14); // measured 0
    let back = modal_link_from_sid("other name", &read).unwrap();
    let n = link.coordinates();
    let size = |k: usize| link.M[(k, k)].sqrt();
    let P = worst((0..n).map(|k| (link.P[k] - back.P[k]).amax() / (link.inertia.amax().sqrt() * size(k))));
    let N = worst((0..n * n).map(|at| (link.N[at] - back.N[at]).amax() / (size(at / n) * size(at % n))));
    eprintln!("SID: P {P:.1e} N {N:.1e}");
    assert!(P < 1e-12 && N < 1e-12, "{P:.1e} {N:.1e}"); // measured 7e-17, 1.1e-15
    assert_eq!(ModalLink { P: link.P.clone(), N: link.N.clone(), ..back }, link);

    // Without flexarm's own blocks the stiffening comes from the places of the standard, except for
    // the centrifugal part.
    let mut plain = read.clone();
    plain.others.clear();
    let (standard, own) = (modal_link_from_sid("arm", &plain).unwrap().geometric.unwrap(), link.geometric.unwrap());
    let gap = |a: &[DMatrix<f64>], b: &[DMatrix<f64>]| {
        let size = b.iter().fold(0.0_f64, |s, b| s.max(b.amax()));
        worst(a.iter().zip(b).map(|(a, b)| (a - b).amax() / size))
    };
    let gaps = [
        gap(&standard.acceleration, &own.acceleration),
        gap(&standard.angular, &own.angular),
        gap(&standard.interface[0], &own.interface[0]),
    ];
    eprintln!("stiffening {gaps:?}");
    assert!(gaps.iter().all(|gap| *gap < 1e-12), "{gaps:?}"); // measured 1e-17

    // Data that cannot be a modal link is rejected.
    let mut stressed = read.clone();
    stressed.ksigma = SidMatrix::constant(n, &DMatrix::from_element(n, 1, 1.0));
    let refused = |sid: &Sid| modal_link_from_sid("arm", sid).unwrap_err().element;
    assert_eq!(&*refused(&stressed), "ksigma");
    let mut adrift = read.clone();
    adrift.nodes.remove(0);
    assert_eq!(&*refused(&adrift), "frame");
    let mut loose = read.clone();
    loose.Ke = SidMatrix::constant(n, &DMatrix::zeros(n, n));
    assert_eq!(&*refused(&loose), "Me, Ke");
    let mut skewed = read;
    skewed.nodes[1].AP = SidMatrix::constant(n, &DMatrix::from_element(3, 3, 0.5));
    assert_eq!(&*refused(&skewed), "AP");
}

/// Identity: in metres or millimetres it is the same body; with stiffening, without, and with
/// first-order terms only.
#[test]
fn a_modal_link_in_other_units_is_the_same_body() {
    let full = turned().modal_with(&ModalOptions { modes: 5, geometric: true, ..ModalOptions::default() }).unwrap();
    let no_stiffening = ModalLink { geometric: None, ..full.clone() };
    let first_order = ModalLink { N: vec![Matrix3::zeros(); full.N.len()], ..no_stiffening.clone() };
    for link in [full, no_stiffening, first_order] {
        let n = link.coordinates();
        let size = |k: usize| link.M[(k, k)].sqrt();
        let (mm, si) = (UnitSystem { length: 1e-3, mass: 1e3, time: 1e-3 }, UnitSystem::SI);
        let far = sid_of_modal_link(&link).in_units(&si, &mm);
        assert!((far.mass / link.mass - 1e-3).abs() < 1e-15);
        // One t mm²/ms² is 1e3 J.
        assert!((far.Ke.m0()[(0, 0)] * 1e3 / link.K[(0, 0)] - 1.0).abs() < 1e-15);
        let near = parse_sid(&write_sid(&far), "t").unwrap().in_units(&mm, &si);
        let again = modal_link_from_sid("other", &near).unwrap();
        let close = |a: &DMatrix<f64>, b: &DMatrix<f64>| (a - b).amax() <= 1e-15 * b.amax();
        assert!(close(&again.K, &link.K) && close(&again.M, &link.M), "units");
        let N = worst((0..n * n).map(|at| (link.N[at] - again.N[at]).amax() / (size(at / n) * size(at % n))));
        assert!(N < 1e-12, "{N:.1e}");
        assert_eq!(again.geometric.is_some(), link.geometric.is_some());
        if let (Some(a), Some(b)) = (&again.geometric, &link.geometric) {
            let pairs = (a.acceleration.iter().zip(&b.acceleration)).chain(a.angular.iter().zip(&b.angular));
            let pairs = pairs.chain(a.centrifugal.iter().zip(&b.centrifugal));
            let mut pairs = pairs.chain(a.interface[0].iter().zip(&b.interface[0]));
            assert!(pairs.all(|(a, b)| close(a, b)), "stiffening in other units");
        }
    }
}

/// Identity: data in a frame that moves with the shapes, with the motion of A in the file, give the
/// link clamped at A.
#[test]
fn data_in_any_frame_give_the_link_held_at_a() {
    let link = turned().modal_with(&ModalOptions { modes: 5, ..ModalOptions::default() }).unwrap();
    let (n, lever) = (link.coordinates(), link.inertia.amax().sqrt());
    // Motions proportional to the shapes, so that all terms matter.
    let size = |k: usize| (link.M[(k, k)] / link.mass).sqrt();
    let motion = Matrix6xX::from_fn(n, |r, k| 0.5 * size(k) * ((7 * r + 3 * k) as f64).sin());
    let adrift = link.clone().without_rigid_motion(&-&motion);

    // The file of the moving frame contains the motion of A.
    let mut sid = sid_of_modal_link(&adrift);
    let p = link.X_LA.translation.vector;
    let at_A = |k: usize| {
        let (c, theta) = (motion.fixed_view::<3, 1>(0, k), motion.fixed_view::<3, 1>(3, k).into_owned());
        c + theta.cross(&p)
    };
    sid.nodes[0].phi = SidMatrix::constant(n, &DMatrix::from_fn(3, n, |a, k| at_A(k)[a]));
    sid.nodes[0].psi = SidMatrix::constant(n, &DMatrix::from_fn(3, n, |a, k| motion[(3 + a, k)]));
    assert!(modal_link_from_sid("casting", &sid).is_err());
    assert!(modal_link_held_at("casting", &sid, 77).is_err());
    let back = modal_link_held_at("casting", &sid, 1).unwrap();
    let size = |k: usize| link.M[(k, k)].sqrt();
    let errors = [
        worst((0..n).map(|k| (back.C_t.column(k) - link.C_t.column(k)).amax() / (link.mass.sqrt() * size(k)))),
        worst((0..n).map(|k| (back.C_r.column(k) - link.C_r.column(k)).amax() / (lever * size(k)))),
        worst((0..n).map(|k| (back.P[k] - link.P[k]).amax() / (lever * size(k)))),
        worst((0..n * n).map(|at| (back.N[at] - link.N[at]).amax() / (size(at / n) * size(at % n)))),
        worst((0..n * n).map(|at| (back.M[at] - link.M[at]).abs() / (size(at / n) * size(at % n)))),
        worst((0..n).map(|k| (back.interfaces[0].Phi.column(k) - link.interfaces[0].Phi.column(k)).amax())),
    ];
    let list: Vec<_> = errors.iter().map(|e| format!("{e:.1e}")).collect();
    eprintln!("held again: {}", list.join(" "));
    assert!(errors.iter().all(|e| *e < 1e-12), "{}", list.join(" ")); // measured 4e-16
}
