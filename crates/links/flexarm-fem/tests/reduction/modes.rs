//! Modes under several supports.

use super::*;

#[test]
fn modes_up_to_a_bound_are_those_below_it() {
    let (mesh, interfaces) = casting(ElementKind::Hex20, [Tie::Rigid, Tie::Distributing]);
    let model = FeModel::assemble(&mesh, &AssemblyOptions { material: Some(STEEL), ..Default::default() }).unwrap();
    let reduction = Condensation::new(&model, &interfaces, CondensationOptions::default()).unwrap();
    let all = reduction.fixed_modes(ModesWanted::Count(12)).unwrap();
    let bound = (all.omega2[7] + all.omega2[8]) / 2.0;
    let below = reduction.fixed_modes(ModesWanted::Below { omega2: bound, at_most: 50 }).unwrap();
    assert_eq!(below.len(), 8);
    // The modes are mass-normalised and orthogonal, and do not move the interfaces.
    let gram = below.shapes.transpose() * model.M.product(&below.shapes);
    assert!((gram - DMatrix::identity(8, 8)).amax() < 1e-10);
}

/// Second algorithm: each kind of modes from a basis of its own. The residuals on the mesh confirm
/// that both are modes.
#[test]
fn modes_with_a_held_from_the_basis_of_the_fixed_ones_are_those_of_a_basis_of_their_own() {
    for tie in
        [[Tie::Rigid; 2], [Tie::Distributing; 2], [Tie::Rigid, Tie::Distributing], [Tie::Distributing, Tie::Rigid]]
    {
        let (mesh, interfaces) = casting(ElementKind::Hex20, tie);
        let options = AssemblyOptions { material: Some(STEEL), ..Default::default() };
        let model = FeModel::assemble(&mesh, &options).unwrap();
        let reduction = Condensation::new(&model, &interfaces, CondensationOptions::default()).unwrap();
        for count in [0, 12] {
            let (fixed, held) = reduction.fixed_and_held_modes(ModesWanted::Count(count), 10).unwrap();
            let alone = reduction.fixed_modes(ModesWanted::Count(count)).unwrap();
            let held_alone = reduction.held_modes(ModesWanted::Count(10)).unwrap();
            assert_eq!((fixed.len(), held.len(), held.solves), (count, 10, 0));
            for (found, truth) in [(&fixed, &alone), (&held, &held_alone)] {
                for (found, truth) in found.omega2.iter().zip(&truth.omega2) {
                    assert!((found / truth - 1.0).abs() < 1e-10, "{tie:?}: {found} {truth}"); // measured 4e-12
                }
                let residual = worst(reduction.mode_residuals(found));
                assert!(residual < 1e-6, "{tie:?}: {residual:.1e}"); // measured 1e-8
                let gram = found.shapes.transpose() * model.M.product(&found.shapes);
                let n = found.len();
                assert!((gram - DMatrix::identity(n, n)).amax() < 1e-10, "{tie:?}");
            }
        }
    }
}
