//! Prints the cost of a reduction, phase by phase:
//! `cargo run --release -p flexarm-fe-io --example reduction_cost -- MESH UNITS A B [MODES]`.
//!
//! `A` and `B` are node sets of the mesh; each is tied rigidly to a frame at the mean of its nodes.
#![allow(
    clippy::print_stdout,
    clippy::unwrap_used,
    reason = "an example shows its result and stops at the first failure"
)]

use std::time::Instant;

use flexarm_fe_io::mesh::{ReadOptions, read_mesh};
use flexarm_fem::model::{AssemblyOptions, FeModel};
use flexarm_fem::reduction::{Condensation, CondensationOptions, Interface, Tie};
use flexarm_fem::sparse::{ModesWanted, Ordering};
use flexarm_fem::{Material, Pose, UnitSystem};
use nalgebra::{Rotation3, Vector3};

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let units: UnitSystem = words[1].parse().unwrap();
    let modes: usize = words.get(4).map_or(20, |w| w.parse().unwrap());
    let ordering = match std::env::var("ORDERING").as_deref() {
        Ok("amd") => Ordering::MinimumDegree,
        Ok("nested") => Ordering::NestedDissection,
        _ => Ordering::Auto,
    };
    let mut last = Instant::now();
    let mut lap = |what: &str| {
        println!("{what:<28} {:8.2} s", last.elapsed().as_secs_f64());
        last = Instant::now();
    };
    let mesh = read_mesh(&words[0], &ReadOptions { units, beams: Vec::new() }).unwrap().mesh;
    lap("read");
    let options = AssemblyOptions { material: Some(Material::ALUMINIUM), ..AssemblyOptions::default() };
    let model = FeModel::assemble(&mesh, &options).unwrap();
    lap("assembly");
    let interface = |name: &str| {
        let nodes = mesh.node_sets[name].clone();
        let centre = nodes.iter().map(|n| mesh.nodes[*n as usize]).sum::<Vector3<f64>>() / nodes.len() as f64;
        Interface {
            name: name.into(),
            X_LI: Pose::from_parts(centre.into(), Rotation3::identity()),
            nodes,
            tie: Tie::Rigid,
        }
    };
    let interfaces = [interface(&words[2]), interface(&words[3])];
    let reduction = Condensation::new(&model, &interfaces, CondensationOptions { ordering }).unwrap();
    lap("factor and static shapes");
    println!("{:?}", reduction.figures());
    let (fixed, held) = reduction.fixed_and_held_modes(ModesWanted::Count(modes), 10).unwrap();
    lap("modes, fixed and A held");
    println!("{} right-hand sides, fixed f = {:.4?} ...", fixed.solves, &fixed.frequencies_hz()[..3.min(modes)]);
    println!("A held f = {:.4?} ...", &held.frequencies_hz()[..3]);
    println!("residuals {:?}, {:?}", reduction.mode_residuals(&fixed), reduction.mode_residuals(&held));
}
