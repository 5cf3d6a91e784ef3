//! Stress against closed forms and energies.
//!
//! Truths: F/A, M c/I, the centrifugal load of a bar, the energy ½ ηᵀ K η of the amplitudes, and
//! one model of a link against another. Link axes, Pa. Not here: beams (`beam.rs`).
#![allow(clippy::print_stderr, reason = "tables of measured errors, shown with --nocapture")]

mod beam;

use flexarm_spatial::Pose;
use nalgebra::{DVector, Rotation3, Vector3};

use super::*;
use crate::element::Quadrature;
use crate::material::Material;
use crate::mesh::{ElementKind, Mesh};
use crate::mesh_link::{LinkPlan, SplitAt, reduce_mesh};
use crate::modal::{ModalLink, ModalSource};
use crate::model::{AssemblyOptions, FeModel};
use crate::reduced::ElasticSplit;
use crate::reduction::{Condensation, Interface, InterfaceFrame, Tie};
use crate::rigid_part::RigidPart;
use crate::sparse::ModesWanted;
use crate::test_mesh::{SOLIDS, cube};

/// Bar along x with its interfaces at both ends.
struct Bar {
    mesh: Mesh,
    interfaces: Vec<Interface>,
    material: Material,
    quadrature: Quadrature,
}

impl Bar {
    fn new(kind: ElementKind, divisions: [usize; 3], [l, w, h]: [f64; 3]) -> Self {
        let size = |u: Vector3<f64>| Vector3::new(u.x * l, (u.y - 0.5) * w, (u.z - 0.5) * h);
        let mesh = cube(kind, divisions, true, size);
        let near = |x: f64| -> Vec<u32> {
            let nodes = mesh.nodes.iter().enumerate().filter(|(_, p)| (p.x - x).abs() < 1e-9);
            nodes.map(|(k, _)| k as u32).collect()
        };
        let interface = |name: &str, x: f64| Interface {
            name: name.into(),
            X_LI: Pose::from_parts(Vector3::new(x, 0.0, 0.0).into(), Rotation3::identity()),
            nodes: near(x),
            tie: Tie::Rigid,
        };
        let interfaces = vec![interface("a", 0.0), interface("b", l)];
        // Without lateral contraction a rigid interface does not disturb the stress of a bar.
        Self { mesh, interfaces, material: Material { nu: 0.0, ..Material::STEEL }, quadrature: Quadrature::Exact }
    }

    /// Calls `work` with the reduced mesh and its modal link.
    fn reduced<R>(&self, modes: usize, work: impl FnOnce(&ModalSource<'_>) -> R) -> R {
        let options = AssemblyOptions { quadrature: self.quadrature, material: Some(self.material) };
        let model = FeModel::assemble(&self.mesh, &options).unwrap();
        let condensation = Condensation::new(&model, &self.interfaces, Default::default()).unwrap();
        let fixed_modes = condensation.fixed_modes(ModesWanted::Count(modes)).unwrap();
        let frame = |i: &Interface| InterfaceFrame { name: i.name.clone(), X_LI: i.X_LI, tie: Some(i.tie) };
        let superelement = condensation.superelement(self.interfaces.iter().map(frame).collect(), &fixed_modes);
        work(&ModalSource {
            mesh: &self.mesh,
            materials: &[self.material],
            quadrature: self.quadrature,
            condensation: &condensation,
            interfaces: &self.interfaces,
            fixed_modes: &fixed_modes,
            superelement: &superelement,
        })
    }
}

/// Truth: force over area.
#[test]
fn a_bar_under_tension_has_force_over_area_at_every_node_of_every_element() {
    for kind in SOLIDS {
        let bar = Bar::new(kind, [4, 2, 2], [1.0, 0.1, 0.05]);
        let fields = bar.reduced(0, |source| source.stress_fields("bar"));
        let worst = (0..fields.sites.len()).map(|k| {
            let own: [f64; 6] = std::array::from_fn(|c| f64::from(fields.stress[(6 * k + c, 0)]));
            let off = [own[0] / 200.0 - 1.0, own[1] / 200.0, own[2] / 200.0, own[3] / 200.0];
            off.into_iter().fold(0.0, |worst: f64, off| worst.max(off.abs()))
        });
        let worst = worst.fold(0.0, f64::max);
        eprintln!("{}: {worst:.1e}", kind.name());
        assert!(worst < 2e-7, "{kind:?}: {worst:e}"); // single precision
    }
}

/// Truth: bending stress M z / I of a cantilever with a tip force, at half its length.
#[test]
fn a_cantilever_under_a_tip_force_has_the_bending_stress_of_beam_theory() {
    let [l, w, h] = [1.0, 0.05, 0.1];
    for (kind, bound) in [
        (ElementKind::Tet10, 2e-2),
        (ElementKind::Hex8, 2e-2),
        (ElementKind::Hex20, 1e-3),
        (ElementKind::Wedge15, 1e-3),
    ] {
        let bar = Bar::new(kind, [20, 2, 4], [l, w, h]);
        let fields = bar.reduced(0, |source| source.stress_fields("bar"));
        let sigma = 0.5 * l * (0.5 * h) / (w * h.powi(3) / 12.0);
        let at = |p: &Vector3<f64>| (p.x - 0.5 * l).abs() < 1e-9 && (p.z.abs() - 0.5 * h).abs() < 1e-9;
        let mut worst = 0.0_f64;
        for (k, site) in fields.sites.iter().enumerate().filter(|(_, site)| at(&site.position)) {
            let own = f64::from(fields.stress[(6 * k, 2)]);
            worst = worst.max((own / sigma + site.position.z.signum()).abs());
        }
        eprintln!("{}: {worst:.1e}", kind.name());
        assert!(worst < bound && worst > 0.0, "{kind:?}: {worst:e}");
    }
}

/// Truth: σ = ρ ω² (l² - x²)/2 of a bar that rotates about z through its clamped end, without
/// lateral contraction.
#[test]
fn a_rotating_bar_bears_its_own_centrifugal_load() {
    let bar = Bar::new(ElementKind::Hex20, [10, 1, 1], [1.0, 0.02, 0.02]);
    let fields = bar.reduced(0, |source| source.stress_fields("bar"));
    let omega_zz = 6 + 6 + 2; // wrenches, linear and angular accelerations, xx, yy
    let top = 0.5 * bar.material.rho;
    let off = fields.sites.iter().enumerate().map(|(k, site)| {
        let x = site.position.x;
        (f64::from(fields.stress[(6 * k, omega_zz)]) - top * (1.0 - x * x)).abs() / top
    });
    let off = off.fold(0.0, f64::max);
    eprintln!("{off:.1e}");
    assert!(off < 4e-3, "{off:e}"); // a quadratic within each element, at its ends
}

/// Truth: the energy of the amplitudes, half ηᵀ K η.
#[test]
fn the_energy_of_the_stress_is_that_of_the_amplitudes() {
    for kind in [ElementKind::Tet10, ElementKind::Hex8, ElementKind::Hex20] {
        let mut bar = Bar::new(kind, [6, 2, 2], [0.4, 0.1, 0.05]);
        bar.material = Material::ALUMINIUM;
        let (largest, smallest) = bar.reduced(4, |source| {
            // Displacement of six interface amplitudes and four modes.
            let model = source.condensation.model();
            let (T, modes) = (source.condensation.shapes(), &source.fixed_modes.shapes);
            let eta = [1e-4, -2e-4, 3e-4, 1e-3, 2e-3, -1e-3, 1e-5, 2e-5, -1e-5, 3e-5];
            let mut u = nalgebra::DMatrix::zeros(T.nrows(), 1);
            for (k, eta) in eta.iter().enumerate() {
                let column = if k < 6 { T.column(6 + k) } else { modes.column(k - 6) };
                u.column_mut(0).axpy(*eta, &column, 1.0);
            }
            // Energy of the stress over the points, σᵀ C σ / 2, isotropic.
            let (materials, quadrature) = (source.materials, source.quadrature);
            let recovery = StressRecovery { mesh: source.mesh, model, materials, quadrature };
            let (E, nu) = (materials[0].E, materials[0].nu);
            let mut energy = 0.0;
            recovery.for_each_point(&u, |point| {
                let [xx, yy, zz, xy, yz, zx] = point.stress[0];
                let normal = xx * xx + yy * yy + zz * zz - 2.0 * nu * (xx * yy + yy * zz + zz * xx);
                let shear = 2.0 * (1.0 + nu) * (xy * xy + yz * yz + zx * zx);
                energy += 0.5 * point.weight * (normal + shear) / E;
            });
            let K = source.superelement.K.view((6, 6), (10, 10)).into_owned();
            let eta = nalgebra::DVector::from_row_slice(&eta);
            let truth = 0.5 * (eta.transpose() * K * &eta)[(0, 0)];
            (energy, truth)
        });
        let off = (largest / smallest - 1.0).abs();
        eprintln!("{}: {off:.1e}", kind.name());
        assert!(off < 1e-9, "{kind:?}: {off:e}");
    }
}

#[test]
fn a_stress_file_returns_what_was_written_and_refuses_damage() {
    let bar = Bar::new(ElementKind::Tet10, [2, 1, 1], [0.4, 0.1, 0.05]);
    let fields = bar.reduced(2, |source| source.stress_fields("bar"));
    let bytes = write_stress(&fields);
    assert_eq!(bytes, write_stress(&fields));
    assert_eq!(parse_stress(&bytes).unwrap(), fields);
    for length in [0, 7, 100, bytes.len() / 2, bytes.len() - 1] {
        assert!(parse_stress(&bytes[..length]).is_err(), "{length}");
    }
    let text = String::from_utf8_lossy(&bytes).into_owned();
    assert!(text.contains("flexarm stress 1"));
    let newer: Vec<u8> = {
        let mut bytes = bytes.clone();
        let at = bytes.windows(16).position(|word| word == b"flexarm stress 1").unwrap();
        bytes[at + 15] = b'9';
        bytes
    };
    assert!(parse_stress(&newer).unwrap_err().to_string().contains("flexarm stress 9"));
}

/// Plan of a bar with two parts, a chain of four and six modes, with stress.
fn plan(bar: &Bar) -> LinkPlan {
    LinkPlan {
        name: "bar".into(),
        interfaces: bar.interfaces.clone(),
        assembly: AssemblyOptions { quadrature: bar.quadrature, material: Some(bar.material) },
        condensation: Default::default(),
        modes: ModesWanted::Count(6),
        split: SplitAt::Fraction(0.4),
        chains: vec![4],
        attached: Vec::new(),
        geometric: false,
        stress: true,
        judged_modes: 6,
        limits: Default::default(),
        provenance: Default::default(),
    }
}

/// Deflections of the joints of a link at rest in a frame with the accelerations `a` and `alpha`:
/// by Newton's law for the parts beyond each joint.
fn deflections_of_parts(
    joints: &[ElasticSplit],
    parts: &[RigidPart],
    a: &Vector3<f64>,
    alpha: &Vector3<f64>,
) -> DVector<f64> {
    let deflections = joints.iter().enumerate().flat_map(|(k, joint)| {
        let p = joint.X_LS.translation.vector;
        let mut F = nalgebra::Vector6::zeros();
        for part in &parts[k + 1..] {
            let force = -(a + alpha.cross(&part.com)) * part.mass;
            let torque = (part.com - p).cross(&force) - part.inertia * alpha;
            let R = joint.X_LS.rotation.inverse();
            let (force, torque) = (R * force, R * torque);
            F += nalgebra::Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z);
        }
        let e = joint.K_S.cholesky().unwrap().solve(&F);
        e.iter().copied().collect::<Vec<_>>()
    });
    DVector::from_vec(deflections.collect())
}

/// Truth: the field of the mesh. A link at rest in an accelerated frame has the deflection of its
/// model, here by the mass matrix of the modal link and by Newton's law for rigid parts; its stress
/// does not depend on the model.
#[test]
fn the_stress_of_a_link_at_rest_does_not_depend_on_its_model() {
    let mut bar = Bar::new(ElementKind::Tet10, [8, 2, 2], [0.6, 0.1, 0.05]);
    bar.material = Material::ALUMINIUM;
    let reduction = reduce_mesh(&bar.mesh, &plan(&bar), &mut |_| {}).unwrap();
    let (fields, link) = (reduction.stress.unwrap(), reduction.link);
    let details = link.details.as_ref().unwrap();
    let (a, alpha) = (Vector3::new(1.0, -2.0, 9.81), Vector3::new(5.0, 30.0, -8.0));
    let loads = inertia_loads(&a, &alpha, &Vector3::zeros());
    let column = |numbers: &[f64]| DVector::from_iterator(numbers.len(), numbers.iter().map(|number| *number as f32));
    let whole = fields.stress.columns(6, INERTIA_LOADS) * column(&loads);

    let of_modal = |modal: &ModalLink| {
        let n = modal.coordinates();
        let frame = DVector::from_row_slice(&[a.x, a.y, a.z, alpha.x, alpha.y, alpha.z]);
        let force = -(modal.mass_matrix().view((6, 0), (n, 6)) * frame);
        modal.K.clone().cholesky().unwrap().solve(&force)
    };
    let of_parts = |joints: &[ElasticSplit], parts: &[RigidPart]| deflections_of_parts(joints, parts, &a, &alpha);
    let modal = details.modal.as_ref().unwrap();
    let (few, chain) = (modal.truncated(2).unwrap(), &details.chains[0]);
    let two = (std::slice::from_ref(&link.split), [link.proximal, link.distal]);
    let springs: Vec<_> = chain.joints.iter().map(|joint| joint.K_S).collect();
    let cases = [
        ("six modes", fields.modal_map(modal, 1.0).unwrap(), of_modal(modal)),
        ("two modes", fields.modal_map(&few, 1.0).unwrap(), of_modal(&few)),
        ("two parts", fields.chain_map(two.0, &two.1, &[link.split.K_S]).unwrap(), of_parts(two.0, &two.1)),
        (
            "four parts",
            fields.chain_map(&chain.joints, &chain.parts, &springs).unwrap(),
            of_parts(&chain.joints, &chain.parts),
        ),
    ];
    for (name, map, q) in cases {
        let mut amplitudes = Vec::new();
        map.append(q.as_slice(), &loads, &mut amplitudes);
        let own = map.stress() * DVector::from_vec(amplitudes);
        let off = (&own - &whole).amax() / whole.amax();
        eprintln!("{name}: {off:.1e} of the largest stress");
        assert!(off < 1e-5, "{name}: {off:e}");
    }
    // Twice the stiffness halves the deflection and leaves the stress.
    let map = fields.modal_map(modal, 2.0).unwrap();
    let mut amplitudes = Vec::new();
    map.append((of_modal(modal) * 0.5).as_slice(), &loads, &mut amplitudes);
    let off = (map.stress() * DVector::from_vec(amplitudes) - &whole).amax() / whole.amax();
    assert!(off < 1e-5, "{off:e}");
    let other =
        Bar::new(ElementKind::Tet10, [8, 2, 2], [0.6, 0.1, 0.06]).reduced(2, |source| source.stress_fields("x"));
    let error = other.chain_map(two.0, &two.1, &[link.split.K_S]).unwrap_err();
    assert!(error.to_string().contains("belongs to another link"), "{error}");
}
