//! Pictures of the reduction of a mesh file: `cargo run --release -p flexarm-draw
//! --features png --example mesh_pictures -- MESH OUT SET_A x,y,z SET_B x,y,z`.
//!
//! The mesh is in SI units and has its material; both node sets are tied rigidly to frames at the
//! given points.
#![allow(non_snake_case, reason = "monogram notation: X_LI, pose of the interface in the link")]
#![allow(
    clippy::print_stdout,
    clippy::unwrap_used,
    reason = "an example shows its result and stops at the first failure"
)]

use std::path::Path;
use std::time::Instant;

use flexarm_draw::mesh_picture::{MeshPictures, write_pictures};
use flexarm_fe_io::mesh::{ReadOptions, read_mesh};
use flexarm_fem::reduction::{CondensationOptions, Interface, Tie};
use flexarm_fem::sparse::ModesWanted;
use flexarm_fem::{GateLimits, LinkPlan, Pose, Provenance, SplitAt, UnitSystem, reduce_mesh};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [file, out, set_a, at_a, set_b, at_b] = &words[..] else {
        println!("give MESH OUT SET_A x,y,z SET_B x,y,z");
        return Ok(());
    };
    let mesh = read_mesh(file, &ReadOptions { units: UnitSystem::SI, beams: Vec::new() })?.mesh;
    let interface = |name: &str, set: &str, at: &str| {
        let p: Vec<f64> = at.split(',').map(|x| x.parse().unwrap()).collect();
        let tie = if set.ends_with('~') { Tie::Distributing } else { Tie::Rigid };
        let nodes = mesh.node_sets[set.trim_end_matches('~')].clone();
        Interface { name: name.into(), X_LI: Pose::translation(p[0], p[1], p[2]), nodes, tie }
    };
    let interfaces = vec![interface("A", set_a, at_a), interface("B", set_b, at_b)];
    let plan = LinkPlan {
        name: Path::new(file).file_name().and_then(|name| name.to_str()).unwrap_or("link").into(),
        interfaces: interfaces.clone(),
        assembly: Default::default(),
        condensation: CondensationOptions::default(),
        modes: ModesWanted::Count(10),
        split: SplitAt::ElasticCentre,
        chains: Vec::new(),
        attached: Vec::new(),
        geometric: false,
        stress: false,
        judged_modes: 6,
        limits: GateLimits::default(),
        provenance: Provenance::default(),
    };
    let start = Instant::now();
    let reduction = reduce_mesh(&mesh, &plan, &mut |_| ())?;
    println!("reduced in {:.2} s", start.elapsed().as_secs_f64());

    let start = Instant::now();
    let mut lap = start;
    let mut done = |what: &str| {
        println!("{what:<12} {:6.3} s", lap.elapsed().as_secs_f64());
        lap = Instant::now();
    };
    let pictures = MeshPictures::new(&mesh, &interfaces, &reduction)?;
    done("skin");
    pictures.render_interfaces();
    done("interfaces");
    pictures.render_unit_loads();
    done("unit loads");
    pictures.render_modes()?;
    done("modes");
    for path in write_pictures(Path::new(out), &mesh, &interfaces, &reduction)? {
        println!("{}", path.display());
    }
    done("all, written");
    Ok(())
}
