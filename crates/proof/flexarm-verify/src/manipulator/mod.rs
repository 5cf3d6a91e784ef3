//! The whole manipulator in motion: link models and steppers compared with modal links, links
//! compared with drives.
//!
//! `runs` performs the runs, `methods`, `pick`, `forearm` and `drives` compute findings, `page` and
//! `drives_page` write them up.

mod drives;
mod drives_page;
mod forearm;
mod methods;
mod page;
mod pick;
mod runs;

use flexarm::Robot;

use crate::Error;
use crate::Pace;
use crate::bench::Bench;
use crate::page::Case;

use drives::{ElasticDrives, Flexibilities};
use forearm::Forearm;
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
    /// Lowest frequency of a casting with both ends held (Hz).
    held_hz: f64,
    /// `None` in a quick run.
    forearm: Option<Forearm>,
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
            held_hz: held_hz(&robot),
            forearm: if bench.quick { None } else { Forearm::new(bench, &robot)? },
            flexibilities: Flexibilities::new(bench, &mut runs, moves)?,
            elastic_drives: ElasticDrives::new(bench, &mut runs, moves[moves.len() - 1])?,
        })
    }
}

/// Lowest frequency of a casting with both ends held (Hz).
fn held_hz(robot: &Robot) -> f64 {
    let details = robot.flexible_links.iter().filter_map(|link| link.flexible.reduced.details.as_ref());
    let elements = details.filter_map(|details| details.superelement.as_ref());
    elements.flat_map(|element| element.fixed_frequencies_hz()).reduce(f64::min).unwrap_or(f64::NAN)
}

/// Runs the case.
pub(crate) fn case(bench: &Bench, pace: &mut Pace<'_>) -> Result<Case, Error> {
    Ok(page::page(&Findings::new(bench, pace)?))
}
