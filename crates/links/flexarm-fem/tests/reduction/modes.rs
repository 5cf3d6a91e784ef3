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

/// Identity: `K φ = ω² M φ` on the mesh, and `φᵀ M φ = 1`.
#[test]
fn modes_with_fixed_interfaces_and_with_a_alone_clamped_solve_the_pencil_of_the_mesh() {
    for tie in
        [[Tie::Rigid; 2], [Tie::Distributing; 2], [Tie::Rigid, Tie::Distributing], [Tie::Distributing, Tie::Rigid]]
    {
        let (mesh, interfaces) = casting(ElementKind::Hex20, tie);
        let options = AssemblyOptions { material: Some(STEEL), ..Default::default() };
        let model = FeModel::assemble(&mesh, &options).unwrap();
        let reduction = Condensation::new(&model, &interfaces, CondensationOptions::default()).unwrap();
        let wanted = ModesWanted::Count(12);
        for modes in [reduction.fixed_modes(wanted).unwrap(), reduction.held_modes(wanted).unwrap()] {
            assert_eq!(modes.len(), 12);
            let residual = worst(reduction.mode_residuals(&modes));
            assert!(residual < 1e-6, "{tie:?}: {residual:.1e}"); // measured 1e-8
            let gram = modes.shapes.transpose() * model.M.product(&modes.shapes);
            assert!((gram - DMatrix::identity(12, 12)).amax() < 1e-10, "{tie:?}");
        }
    }
}
