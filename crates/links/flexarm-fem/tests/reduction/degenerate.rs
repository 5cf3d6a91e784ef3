//! Models at the limit of what can be reduced: nothing free, one unknown, parts attached to only
//! one interface, no mass.

use super::*;
use flexarm_fem::matrix_link::reduce_matrices;
use flexarm_fem::mesh_link::MeshLinkError;
use flexarm_fem::sparse::{Modes, ModesError, SparseSymmetric};

fn model_of(mesh: &Mesh) -> FeModel {
    FeModel::assemble(mesh, &AssemblyOptions { material: Some(STEEL), ..Default::default() }).unwrap()
}

fn bar_between(divisions: [usize; 3], tie: [Tie; 2]) -> (FeModel, Vec<Interface>) {
    let (mesh, a, b) = bar(ElementKind::Hex8, divisions, [0.4, 0.1, 0.1], |p| p);
    let ends =
        vec![interface("A", Vector3::zeros(), &a, tie[0]), interface("B", Vector3::new(0.4, 0.0, 0.0), &b, tie[1])];
    (model_of(&mesh), ends)
}

/// Dense matrix from products with the unit vectors.
fn dense(size: usize, product: impl Fn(&DMatrix<f64>) -> DMatrix<f64>) -> DMatrix<f64> {
    product(&DMatrix::identity(size, size))
}

/// Squared frequencies of a small pencil over the given DoF, ascending.
fn dense_omega2(model: &FeModel, dofs: &[usize]) -> Vec<f64> {
    let part = |A: DMatrix<f64>| A.select_rows(dofs).select_columns(dofs);
    let K = part(dense(model.size(), |X| model.K.product(X)));
    let M = part(dense(model.size(), |X| model.M.product(X)));
    let L = M.cholesky().unwrap().l().try_inverse().unwrap();
    let mut omega2: Vec<f64> =
        nalgebra::SymmetricEigen::new(&L * K * L.transpose()).eigenvalues.iter().copied().collect();
    omega2.sort_by(f64::total_cmp);
    omega2
}

fn check_modes(reduction: &Condensation<'_>, modes: &Modes, count: usize) {
    assert_eq!(modes.len(), count);
    let residual = worst(reduction.mode_residuals(modes));
    assert!(residual < 1e-6, "{residual:.1e}"); // measured 2e-9
}

/// Truth: all eigenvalues of the dense pencil.
#[test]
fn more_modes_than_there_are_unknowns_are_all_modes_that_there_are() {
    let (model, ends) = bar_between([2, 1, 1], [Tie::Rigid; 2]);
    let reduction = Condensation::new(&model, &ends, CondensationOptions::default()).unwrap();
    let inner: Vec<usize> =
        (0..model.size()).filter(|dof| model.nodes[dof / 3].x > 0.1 && model.nodes[dof / 3].x < 0.3).collect();
    let truth = dense_omega2(&model, &inner);
    let (fixed, held) = reduction.fixed_and_held_modes(ModesWanted::Count(100), 100).unwrap();
    check_modes(&reduction, &fixed, 12);
    assert_eq!(held.len(), 18);
    for (found, truth) in fixed.omega2.iter().zip(&truth) {
        assert!((found / truth - 1.0).abs() < 1e-9, "{found} {truth}"); // measured 2e-14
    }
    let all = reduction.fixed_modes(ModesWanted::Below { omega2: f64::INFINITY, at_most: 12 }).unwrap();
    check_modes(&reduction, &all, 12);
}

/// Each distributing interface removes six degrees of freedom from the nodes of its surface.
#[test]
fn a_cube_all_of_whose_nodes_are_in_interfaces_has_the_modes_that_its_ties_leave() {
    let (model, ends) = bar_between([1, 1, 1], [Tie::Rigid; 2]);
    let refused = Condensation::new(&model, &ends, CondensationOptions::default());
    assert!(matches!(refused.err(), Some(ReductionError::Tie(TieError::NothingFree))));
    for (tie, count) in [([Tie::Rigid, Tie::Distributing], 6), ([Tie::Distributing; 2], 12)] {
        let (model, ends) = bar_between([1, 1, 1], tie);
        let reduction = Condensation::new(&model, &ends, CondensationOptions::default()).unwrap();
        let (fixed, held) = reduction.fixed_and_held_modes(ModesWanted::Count(50), 50).unwrap();
        check_modes(&reduction, &fixed, count);
        assert_eq!(held.len(), count + 6);
        assert!(reduction.condition_estimate() > 1.0);
    }
}

/// Truth: a model that retains all its DoF is its own superelement; one inner mass on a spring has
/// ω² = k/m.
#[test]
fn a_model_without_inner_dof_stays_as_it_is_and_one_with_a_single_one_has_one_mode() {
    let beam =
        Beam::new(Section::Rectangle { width: 0.1, height: 0.1 }.bar(&STEEL).unwrap(), BeamTheory::EulerBernoulli, 0.4);
    let (K12, M12) = beam.map(|beam| (beam.stiffness12(), beam.mass12())).unwrap();
    let lower = |A: &flexarm_spatial::Matrix12| -> Vec<(u32, u32, f64)> {
        (0..144).filter(|k| k % 12 >= k / 12).map(|k| ((k % 12) as u32, (k / 12) as u32, A[(k % 12, k / 12)])).collect()
    };
    let kept: Vec<u32> = (0..12).collect();
    let reduce = |K: &[(u32, u32, f64)], M: &[(u32, u32, f64)], size: usize, count: usize| {
        let [K, M] = [K, M].map(|entries| SparseSymmetric::from_triplets(size, entries));
        reduce_matrices(K, M, &kept, Vec::new(), ModesWanted::Count(count), CondensationOptions::default())
    };
    let (mut K, mut M) = (lower(&K12), lower(&M12));
    let alone = reduce(&K, &M, 12, 5).unwrap();
    let truth = DMatrix::from_column_slice(12, 12, K12.as_slice());
    assert!(scaled_difference(&alone.K, &truth) < 1e-15, "{}", scaled_difference(&alone.K, &truth));

    // A mass of 2 kg on a spring of 8e5 N/m to the end.
    K.extend([(6, 6, 8e5), (12, 6, -8e5), (12, 12, 8e5)]);
    M.push((12, 12, 2.0));
    let with_one = reduce(&K, &M, 13, 5).unwrap();
    assert_eq!(with_one.K.nrows(), 13);
    assert!((with_one.K[(12, 12)] / 4e5 - 1.0).abs() < 1e-12);
    assert!((with_one.M[(6, 12)].abs() - 2f64.sqrt()).abs() < 1e-12);

    // Without its mass the spring end has no mode.
    let without = reduce(&K, &M[..M.len() - 1], 13, 1);
    assert!(matches!(without, Err(MeshLinkError::Modes(ModesError::NotFinite))), "{without:?}");
    assert!(reduce(&K, &M[..M.len() - 1], 13, 0).is_ok());

    let few = reduce_matrices(
        SparseSymmetric::from_triplets(12, &lower(&K12)),
        SparseSymmetric::from_triplets(12, &lower(&M12)),
        &kept[..6],
        Vec::new(),
        ModesWanted::Count(1),
        CondensationOptions::default(),
    );
    assert!(matches!(few, Err(MeshLinkError::Reduction(ReductionError::Tie(TieError::TooFew { found: 1 })))));
}

/// Truth: with all nodes in interfaces, the modes with A clamped are those of the dense pencil of
/// the other nodes.
#[test]
fn a_beam_of_one_element_has_no_fixed_modes_and_six_with_one_end_held() {
    let beam = Some(BeamProperties {
        section: Section::Rectangle { width: 0.06, height: 0.1 },
        y_axis: Vector3::y(),
        theory: BeamTheory::EulerBernoulli,
    });
    let mesh = Mesh {
        node_ids: vec![1, 2],
        nodes: vec![Vector3::zeros(), Vector3::x() * 0.8],
        blocks: vec![ElementBlock { kind: ElementKind::Beam2, region: 0, ids: vec![1], connectivity: vec![0, 1] }],
        regions: vec![Region { name: "beam".into(), material: Some(STEEL), beam }],
        ..Mesh::default()
    };
    let model = FeModel::assemble(&mesh, &AssemblyOptions::default()).unwrap();
    let boundary = Boundary::retained(12, &(0..12).collect::<Vec<u32>>());
    let reduction = Condensation::with_boundary(&model, boundary, CondensationOptions::default()).unwrap();
    let (fixed, held) = reduction.fixed_and_held_modes(ModesWanted::Count(4), 10).unwrap();
    assert_eq!((fixed.len(), held.len()), (0, 6));
    for (found, truth) in held.omega2.iter().zip(dense_omega2(&model, &[6, 7, 8, 9, 10, 11])) {
        assert!((found / truth - 1.0).abs() < 1e-9, "{found} {truth}"); // measured 6e-15
    }
    assert!(reduction.condition_estimate().is_nan());
}

/// Truth: the half between the interfaces on its own; a part beyond A is moved along without
/// forces.
#[test]
fn an_end_that_hangs_on_the_first_interface_alone_does_not_change_the_stiffness() {
    let plane = |mesh: &Mesh, x: f64| -> Vec<u32> {
        (0..mesh.nodes.len() as u32).filter(|node| (mesh.nodes[*node as usize].x - x).abs() < 1e-9).collect()
    };
    let ends = |mesh: &Mesh| {
        let at_x = |x: f64| Vector3::new(x, 0.0, 0.0);
        vec![
            interface("A", at_x(0.0), &plane(mesh, 0.0), Tie::Rigid),
            interface("B", at_x(0.2), &plane(mesh, 0.2), Tie::Rigid),
        ]
    };
    let (whole, _, _) = bar(ElementKind::Hex8, [4, 1, 1], [0.4, 0.1, 0.1], |p| p - Vector3::x() * 0.2);
    let (half, _, _) = bar(ElementKind::Hex8, [2, 1, 1], [0.2, 0.1, 0.1], |p| p);
    let of = |mesh: &Mesh| reduce_mesh(mesh, &plan(ends(mesh), STEEL, 3), &mut |_| ()).unwrap();
    let (found, truth) = (of(&whole), of(&half));
    let K = |result: &MeshReduction| result.link.details.as_ref().unwrap().superelement.as_ref().unwrap().guyan().K;
    let error = scaled_difference(&K(&found), &K(&truth));
    assert!(error < 1e-10, "{error:.1e}"); // measured 2e-15

    // Nothing is between the interfaces, and the free end moves only with A.
    let (short, _, _) = bar(ElementKind::Hex8, [3, 1, 1], [0.6, 0.1, 0.1], |p| p - Vector3::x() * 0.4);
    let gate = of(&short).link.details.as_ref().unwrap().gate.clone().unwrap();
    assert!(gate.condition > 1.0 && gate.condition.is_finite(), "{gate:?}");
    assert_eq!(gate.zero_modes, 6);
}

/// Interfaces on unconnected bodies: an error with that cause, for any ties.
#[test]
fn interfaces_on_bodies_that_nothing_joins_are_refused() {
    let (one, a, _) = bar(ElementKind::Hex8, [2, 1, 1], [0.4, 0.1, 0.1], |p| p);
    let mut mesh = one.clone();
    let count = mesh.nodes.len() as u32;
    mesh.nodes.extend(one.nodes.iter().map(|p| p + Vector3::x()));
    mesh.node_ids.extend(one.node_ids.iter().map(|id| id + u64::from(count)));
    let others: Vec<u32> = one.blocks[0].connectivity.iter().map(|node| node + count).collect();
    mesh.blocks[0].connectivity.extend(others);
    let ids: Vec<u64> = one.blocks[0].ids.iter().map(|id| id + 100).collect();
    mesh.blocks[0].ids.extend(ids);
    let model = model_of(&mesh);
    let b: Vec<u32> = a.iter().map(|node| node + count).collect();
    for tie in
        [[Tie::Rigid; 2], [Tie::Rigid, Tie::Distributing], [Tie::Distributing, Tie::Rigid], [Tie::Distributing; 2]]
    {
        let ends = [interface("A", Vector3::zeros(), &a, tie[0]), interface("B", Vector3::x(), &b, tie[1])];
        let refused = Condensation::new(&model, &ends, CondensationOptions::default()).err();
        let named =
            matches!(refused, Some(ReductionError::FreeInterface { interface: 1, .. } | ReductionError::Loose { .. }));
        assert!(named, "{tie:?}: {refused:?}");
    }
}
