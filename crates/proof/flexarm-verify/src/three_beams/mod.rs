//! Three beams with right-angle corners: every load bends and twists some of them.
//!
//! `beams` holds the closed forms, `study`, `sections`, `ring_down` and `whirl` compute findings,
//! `page` writes them up.

mod beams;
mod page;
mod ring_down;
mod sections;
mod study;
mod whirl;

use crate::bench::Bench;
use crate::page::Case;
use crate::{Error, Pace};

use ring_down::RingDown;
use sections::Sections;
use study::{Meshes, TipLoads};
use whirl::Whirl;

const ROBOT: &str = "robots/test/three_beams/robot.toml";
const MESH: &str = "robots/test/three_beams/mesh.toml";
/// Acceleration of gravity (m/s²).
const G: f64 = 9.81;

/// Findings of the case.
struct Findings {
    tip_loads: TipLoads,
    meshes: Meshes,
    /// `None` in a quick run.
    sections: Option<Sections>,
    ring_down: RingDown,
    whirl: Whirl,
}

impl Findings {
    fn new(bench: &Bench) -> Result<Self, Error> {
        let robot = bench.robot(ROBOT)?;
        let meshed = bench.robot(MESH)?;
        Ok(Self {
            tip_loads: TipLoads::new(&robot)?,
            meshes: Meshes::new(bench, &meshed)?,
            sections: if bench.quick { None } else { Some(Sections::new(bench, &meshed)?) },
            ring_down: RingDown::new(&robot, bench.quick)?,
            whirl: Whirl::new(&robot)?,
        })
    }
}

/// Runs the case.
pub(crate) fn case(bench: &Bench, _pace: &mut Pace<'_>) -> Result<Case, Error> {
    Ok(page::page(&Findings::new(bench)?))
}
