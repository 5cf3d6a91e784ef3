//! Stress of beams against solid meshes, equilibrium and handbooks.
//!
//! Truths: the solid mesh of the same bar, equilibrium of the shear flow, torsion constants of
//! handbooks. Section axes: x along the beam, y and z across. Not here: solids (`stress/tests.rs`).

use flexarm_spatial::Pose;
use nalgebra::{DVector, Rotation3, Vector3, Vector6};

use super::Bar;
use crate::beam_link::BeamLink;
use crate::material::Material;
use crate::mesh::ElementKind;
use crate::reduced::ElasticSplit;
use crate::rigid_part::RigidPart;
use crate::section::Section;
use crate::stress::{StressFields, inertia_loads};

/// Steel without lateral contraction, for which solids and beams agree.
const PLAIN: Material = Material { nu: 0.0, ..Material::STEEL };

fn fields_of(link: &BeamLink) -> StressFields {
    let reduced = link.reduce().unwrap();
    link.stress_fields(std::slice::from_ref(&reduced.split), &[reduced.proximal, reduced.distal]).unwrap()
}

/// Columns of torsion: torque, angular acceleration and product of angular velocities.
const TORSION: [usize; 3] = [3, 9, 17];

/// Truth: the same bar as a solid mesh, in the middle of its length, where the clamped ends do not
/// restrain warping.
#[test]
fn a_beam_has_the_stress_of_a_solid_bar_under_every_load_and_acceleration() {
    let size = [1.0, 0.05, 0.1];
    let bar = Bar::new(ElementKind::Hex20, [10, 8, 8], size);
    let solid = bar.reduced(0, |source| source.stress_fields("bar"));
    let section = Section::Rectangle { width: size[1], height: size[2] };
    let beam = fields_of(&BeamLink::new("bar", section, PLAIN, size[0]));
    let mut worst = [0.0_f64; 18];
    for (k, site) in beam.sites.iter().enumerate().filter(|(_, site)| (site.position.x - 0.5).abs() < 1e-9) {
        let of_solid = (0..solid.sites.len()).find(|m| (solid.sites[*m].position - site.position).norm() < 1e-9);
        let m = of_solid.unwrap();
        let is_corner = site.position.y != 0.0 && site.position.z != 0.0;
        for (j, worst) in worst.iter_mut().enumerate() {
            // At its corners the stress of the mesh in torsion converges slowly to zero.
            if is_corner && TORSION.contains(&j) {
                continue;
            }
            let six = |fields: &StressFields, site: usize| -> Vector6<f64> {
                Vector6::from_fn(|c, _| f64::from(fields.stress[(6 * site + c, j)]))
            };
            let scale = (0..beam.sites.len())
                .filter(|k| (beam.sites[*k].position.x - 0.5).abs() < 1e-9)
                .map(|k| six(&beam, k).amax())
                .fold(0.0, f64::max);
            let off = (six(&beam, k) - six(&solid, m)).amax();
            *worst = worst.max(if scale > 0.0 { off / scale } else { off });
        }
    }
    eprintln!("{:?}", worst.map(|off| format!("{off:.1e}")));
    // A beam that spins about its own axis has no stress.
    for (j, off) in worst.iter().enumerate().filter(|(j, _)| *j != 12) {
        assert!(*off < 0.015, "column {j}: {off:e}"); // torsion 1.2e-2, others up to 6.3e-3
    }
}

/// Truth: the forces themselves. The shear flow of thin walls adds up to the force, and its moment
/// about the axis to the torque.
#[test]
fn the_shear_flow_of_a_box_adds_up_to_force_and_torque() {
    let (width, height, wall) = (0.2, 0.3, 1e-4);
    let outline = Section::Box { width, height, wall }.outline(0.3).unwrap();
    let mut sums = [[0.0; 3]; 3];
    for ends in outline.as_chunks::<3>().0 {
        let length = (ends[2].y - ends[0].y).hypot(ends[2].z - ends[0].z);
        // Simpson's rule is exact for the parabola along a wall.
        for (point, weight) in ends.iter().zip([1.0, 4.0, 1.0]) {
            let area = wall * length * weight / 6.0;
            let [t_y, t_z] = point.tangent;
            for (sum, tau) in sums.iter_mut().zip([point.torsion, point.shear_y, point.shear_z]) {
                sum[0] += tau * t_y * area;
                sum[1] += tau * t_z * area;
                sum[2] += tau * (point.y * t_z - point.z * t_y) * area;
            }
        }
    }
    let truth = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let off = sums.iter().flatten().zip(truth.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    eprintln!("{off:.1e}");
    assert!(off < 2e-3, "{sums:?}"); // the outline is half a wall outside the midline
}

/// Truth: the table of Timoshenko & Goodier, art. 109: largest stress T/(c a b²) with c = 0.208 for
/// a square, 0.246 for sides 2:1, 0.291 for 5:1.
#[test]
fn the_torsion_of_a_rectangle_is_that_of_the_handbook() {
    for (ratio, c) in [(1.0, 0.208), (2.0, 0.246), (5.0, 0.291)] {
        for (width, height) in [(0.1, 0.1 * ratio), (0.1 * ratio, 0.1)] {
            let outline = Section::Rectangle { width, height }.outline(0.3).unwrap();
            let largest = outline.iter().map(|point| point.torsion).fold(0.0, f64::max);
            let off = (largest * c * 0.1 * ratio * 0.01 - 1.0).abs();
            assert!(off < 2e-3, "{ratio}: {off:e}");
        }
    }
}

/// Truth: section forces from statics. A beam that is turned in its link, beside the line of the
/// joints, under a force at B: N/A + M c/I at its root.
#[test]
fn a_beam_beside_the_line_of_its_joints_bears_the_moment_of_the_offset() {
    let section = Section::Tube { outer_diameter: 0.1, wall: 0.01 };
    let axis = Vector3::new(0.0, 0.0, 1.0);
    let offset = Vector3::new(0.0, 0.05, 0.0);
    let link = BeamLink::new("tube", section, Material::STEEL, 0.8).along(axis, Vector3::x(), 0.0, offset).unwrap();
    let fields = fields_of(&link);
    let own = section.properties(0.3).unwrap();
    let pull = 1000.0;
    let worst = (0..fields.sites.len()).map(|k| {
        let p = fields.sites[k].position;
        // The force acts 0.05 m from the axis, on the side of -y.
        let truth = pull / own.A - pull * 0.05 * (p.y - 0.05) / own.I_y;
        let found = pull * f64::from(fields.stress[(6 * k + 2, 2)]);
        (found / truth - 1.0).abs()
    });
    let off = worst.fold(0.0, f64::max);
    eprintln!("{off:.1e}");
    assert!(off < 1e-5, "{off:e}");
}

/// Truth: weight and length. A horizontal beam under its own weight and angular acceleration bears
/// the same at its root, whatever the number of its parts and their mass.
#[test]
fn the_root_of_a_beam_carries_all_of_its_parts() {
    let section = Section::Box { width: 0.1, height: 0.14, wall: 0.008 };
    let link = BeamLink { mass: Some(24.0), ..BeamLink::new("boom", section, Material::ALUMINIUM, 1.2) };
    let reduced = link.reduce().unwrap();
    let two = (vec![reduced.split.clone()], vec![reduced.proximal.clone(), reduced.distal.clone()]);
    let chain = link.chain(5).unwrap();
    let cases: [(Vec<ElasticSplit>, Vec<RigidPart>); 2] = [two, (chain.joints, chain.parts)];
    let properties = section.properties(Material::ALUMINIUM.nu).unwrap();
    for (joints, parts) in cases {
        let fields = link.stress_fields(&joints, &parts).unwrap();
        // An acceleration upward is weight; the top corner of the root is pulled.
        let moment = 24.0 * 9.81 * 0.6;
        let top = fields.sites.iter().position(|site| site.position.x == 0.0 && site.position.z > 0.069).unwrap();
        let off = (9.81 * f64::from(fields.stress[(6 * top, 6 + 2)]) / (moment * 0.07 / properties.I_y) - 1.0).abs();
        eprintln!("{} parts: {off:.1e}", parts.len());
        assert!(off < 1e-6, "{off:e}");
        // The model's own deflection at rest leaves the same stress.
        let springs: Vec<_> = joints.iter().map(|joint| joint.K_S).collect();
        let map = fields.chain_map(&joints, &parts, &springs).unwrap();
        let a = Vector3::new(1.0, -2.0, 9.81);
        let q = joints.iter().enumerate().flat_map(|(k, joint)| {
            let p = joint.X_LS.translation.vector;
            let mut F = Vector6::zeros();
            for part in &parts[k + 1..] {
                let force = -a * part.mass;
                let torque = (part.com - p).cross(&force);
                F += Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z);
            }
            joint.K_S.cholesky().unwrap().solve(&F).iter().copied().collect::<Vec<_>>()
        });
        let (q, loads) = (q.collect::<Vec<_>>(), inertia_loads(&a, &Vector3::zeros(), &Vector3::zeros()));
        let mut amplitudes = Vec::new();
        map.append(&q, &loads, &mut amplitudes);
        let whole = fields.stress.columns(6, 3) * Vector3::new(1.0, -2.0, 9.81_f32);
        let off = (map.stress() * DVector::from_vec(amplitudes) - &whole).amax() / whole.amax();
        eprintln!("its model at rest: {off:.1e}");
        assert!(off < 1e-5, "{off:e}");
    }
}

#[test]
fn the_normal_of_the_outline_points_outward_at_every_place() {
    let sections = [
        Section::Circle { diameter: 0.1 },
        Section::Tube { outer_diameter: 0.1, wall: 0.01 },
        Section::Rectangle { width: 0.1, height: 0.05 },
        Section::Box { width: 0.1, height: 0.05, wall: 0.005 },
        Section::IBeam { width: 0.1, height: 0.2, web: 0.006, flange: 0.008, fillet: 0.0 },
        Section::Channel { width: 0.1, height: 0.2, web: 0.006, flange: 0.008, fillet: 0.0 },
    ];
    for section in sections {
        let link = BeamLink::new("link", section, Material::STEEL, 1.0);
        let fields = fields_of(&BeamLink { X_LE: Pose::identity(), ..link });
        let outline = section.outline(0.3).unwrap();
        for (k, site) in fields.sites.iter().enumerate() {
            let normal = fields.normal(k);
            assert!((normal.norm() - 1.0).abs() < 1e-12 && normal.x.abs() < 1e-12, "{section:?} {k}: {normal}");
            // Outside of a convex section; along the tangent turned by a right angle elsewhere.
            let point = outline[k % outline.len()];
            let out = Vector3::new(0.0, point.tangent[1], -point.tangent[0]);
            let is_corner = point.torsion == 0.0;
            assert!(is_corner || normal.dot(&out) > 0.7, "{section:?} {k}: {normal} {site:?}");
        }
    }
    let given = Section::Given(Section::Circle { diameter: 0.1 }.bar(&Material::STEEL).unwrap());
    let link = BeamLink::new("link", given, Material::STEEL, 1.0);
    let reduced = link.reduce().unwrap();
    let error =
        link.stress_fields(std::slice::from_ref(&reduced.split), &[reduced.proximal.clone(), reduced.distal.clone()]);
    assert!(error.unwrap_err().to_string().contains("shape of a section"));
    let back =
        Pose::from_parts(Vector3::new(1.0, 0.0, 0.0).into(), Rotation3::from_axis_angle(&Vector3::z_axis(), 3.1));
    let link = BeamLink { X_LE: back, ..BeamLink::new("x", Section::Circle { diameter: 0.1 }, Material::STEEL, 1.0) };
    assert!(link.stress_fields(&[reduced.split], &[reduced.proximal, reduced.distal]).is_err());
}
