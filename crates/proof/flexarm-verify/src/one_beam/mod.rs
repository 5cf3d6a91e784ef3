//! One clamped beam: all results that have a closed form.
//!
//! `bar` holds the closed forms, `study`, `motion`, `mesh` and `large_loads` compute findings,
//! `page` and `mesh_page` write them up.

mod bar;
mod large_loads;
mod mesh;
mod mesh_page;
mod motion;
mod page;
mod study;

use flexarm::Robot;
use flexarm_kinematics::LinkInertia;

use crate::bench::Bench;
use crate::page::Case;
use crate::{Error, Pace};

use large_loads::LargeLoads;
use mesh::BarMesh;
use motion::{SpinUp, Steps};
use study::{EndLoads, Splits, Stations, Weight};

const ROBOT: &str = "robots/test/one_beam/robot.toml";
/// The same robot with its link reduced from a mesh.
const MESHED: &str = "robots/test/one_beam/mesh.toml";
/// The mesh.
const MESH: &str = "robots/test/one_beam/fe/one_beam.msh";
/// Results of CalculiX on the mesh.
const STORED: &str = "one_beam_calculix.json";
/// Acceleration of gravity (m/s²).
const G: f64 = 9.81;

/// Findings of the case.
struct Findings {
    end_loads: EndLoads,
    stations: Stations,
    splits: Splits,
    weight: Weight,
    steps: Steps,
    spin_up: SpinUp,
    mesh: BarMesh,
    large_loads: LargeLoads,
}

impl Findings {
    fn new(bench: &Bench) -> Result<Self, Error> {
        let robot = bench.robot(ROBOT)?;
        let meshed = bench.robot(MESHED)?;
        Ok(Self {
            end_loads: EndLoads::new(&robot)?,
            stations: Stations::new(&robot)?,
            splits: Splits::new(&robot)?,
            weight: Weight::new(&robot)?,
            steps: Steps::new(&robot, bench.quick)?,
            spin_up: SpinUp::new(&robot)?,
            mesh: BarMesh::new(bench, &meshed)?,
            large_loads: LargeLoads::new(bench, &robot, &meshed)?,
        })
    }
}

/// Runs the case.
pub(crate) fn case(bench: &Bench, _pace: &mut Pace<'_>) -> Result<Case, Error> {
    Ok(page::page(&Findings::new(bench)?))
}

/// The `k`-th frequency of a list; NaN if a model with few coordinates does not have it.
fn nth(hz: &[f64], k: usize) -> f64 {
    hz.get(k).copied().unwrap_or(f64::NAN)
}

/// Returns the robot without the ball.
fn without_ball(robot: &Robot) -> Robot {
    let mut bare = robot.clone();
    for link in bare.rigid.links.iter_mut().filter(|link| link.name == "tip") {
        link.inertia = None::<LinkInertia>;
    }
    bare
}
