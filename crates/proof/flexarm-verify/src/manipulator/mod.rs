//! The whole manipulator in motion: link models and steppers compared with modal links, links
//! compared with drives.
//!
//! `runs` performs the runs, `methods`, `pick` and `drives` compute findings, `page` and
//! `drives_page` write them up.

mod drives;
mod drives_page;
mod methods;
mod page;
mod pick;
mod runs;

use crate::bench::Bench;
use crate::page::Case;
use crate::{Error, Pace};

use drives::{ElasticDrives, Flexibilities};
use methods::Methods;
use pick::Pick;
use runs::Runs;

const LINKS: &str = "robots/kr210/links.toml";
const DRIVES: &str = "robots/kr210/robot.toml";
const AXES: [&str; 3] = ["x", "y", "z"];
/// Number of modes in the link files of the castings.
const ALL_MODES: usize = 10;
/// Tolerance of the stepper with error control.
const TOLERANCE: f64 = 1e-8;
/// Damping ratio of each mode.
const DAMPING: f64 = 0.03;

/// Findings of the case.
struct Findings {
    /// One per motion.
    motions: Vec<Methods>,
    /// `None` in a quick run.
    pick: Option<Pick>,
    flexibilities: Flexibilities,
    elastic_drives: ElasticDrives,
}

impl Findings {
    fn new(bench: &Bench, pace: &mut Pace<'_>) -> Result<Self, Error> {
        let robot = bench.robot(LINKS)?;
        let moves: &[&'static str] =
            if bench.quick { &["point_to_point"] } else { &["pick_and_place", "point_to_point", "large_moves"] };
        // One motion with all methods costs about 150 runs by generalised-alpha, a pick 55, the
        // rest 80.
        let pick_weight = if bench.quick { 0.0 } else { 55.0 };
        let mut runs = Runs::new(pace, 150.0 * moves.len() as f64 + 80.0 + pick_weight);
        let motions = moves.iter().map(|&name| Methods::new(bench, &mut runs, &robot, name));
        Ok(Self {
            motions: motions.collect::<Result<_, Error>>()?,
            pick: if bench.quick { None } else { Some(Pick::new(bench, &mut runs, &robot)?) },
            flexibilities: Flexibilities::new(bench, &mut runs, moves)?,
            elastic_drives: ElasticDrives::new(bench, &mut runs, moves[moves.len() - 1])?,
        })
    }
}

/// Runs the case.
pub(crate) fn case(bench: &Bench, pace: &mut Pace<'_>) -> Result<Case, Error> {
    Ok(page::page(&Findings::new(bench, pace)?))
}
