//! Benchmarks of flexible multibody systems in large motion, from `tests/benchmarks`: two-link arms
//! of slender beams, Simeon's slider crank, a turning blade.
//!
//! `two_link`, `slider_crank` and `swept_rotor` compute findings, `page` writes them up.

mod page;
mod slider_crank;
mod swept_rotor;
mod two_link;

use flexarm::recordings::Trace;
use flexarm::steppers::ConstraintForm;
use flexarm::{Keep, Modelling, Motion, Robot, RunOptions, RunRequest, StepperKind};
use nalgebra::Vector2;

use crate::bench::{ALPHA, Bench, spook};
use crate::page::Case;
use crate::{Error, Pace};

use slider_crank::SliderCrank;
use swept_rotor::Spin;
use two_link::TwoLink;

/// Folder of the benchmarks.
const FOLDER: &str = "tests/benchmarks";

/// Findings of the case.
struct Findings {
    two_link: TwoLink,
    slider_crank: SliderCrank,
    spins: Vec<Spin>,
}

/// Runs the case.
pub(crate) fn case(bench: &Bench, pace: &mut Pace<'_>) -> Result<Case, Error> {
    let two_link = TwoLink::new(bench, &mut |share| pace.at(0.6 * share))?;
    let slider_crank = SliderCrank::new(bench, &mut |share| pace.at(0.6 + 0.25 * share))?;
    let spins = swept_rotor::spins(bench, &mut |share| pace.at(0.85 + 0.15 * share))?;
    Ok(page::page(&Findings { two_link, slider_crank, spins }))
}

/// A link model, with its name on the page.
struct Method {
    name: String,
    modelling: Modelling,
    /// Whether loads change the stiffness of modal links.
    stiffening: bool,
    stepper: StepperKind,
}

impl Method {
    fn new((name, modelling): (String, Modelling)) -> Self {
        Self { name, modelling, stiffening: false, stepper: ALPHA }
    }

    fn stiffening((name, modelling): (String, Modelling)) -> Self {
        Self { name: format!("{name}, stiffness by load"), stiffening: true, ..Self::new((name, modelling)) }
    }

    /// Rigid parts with compliant constraints.
    fn spook((name, modelling): (String, Modelling)) -> Self {
        let stepper = spook(ConstraintForm::Local);
        Self { name: format!("{name}, compliant constraints"), stepper, ..Self::new((name, modelling)) }
    }

    /// Runs a motion and returns the samples.
    ///
    /// * `step_s`: step size (s).
    /// * `rate_hz`: samples per second.
    fn run(&self, robot: &Robot, motion: &Motion, step_s: f64, rate_hz: f64) -> Result<Trace, Error> {
        let mut robot = robot.clone();
        for link in &mut robot.flexible_links {
            link.choices.geometric = self.stiffening;
        }
        let options = RunOptions { stepper: self.stepper, step_s, log_rate_hz: rate_hz, ..RunOptions::default() };
        let request = RunRequest::keeping(Keep::Curves);
        Ok(robot.model(&self.modelling)?.simulate_with(motion, &options, request)?.trace)
    }
}

/// Checks that a run has the samples of its truth.
fn same_times(times: impl Iterator<Item = f64>, truth: impl Iterator<Item = f64>) -> bool {
    let (times, truth): (Vec<f64>, Vec<f64>) = (times.collect(), truth.collect());
    times.len() == truth.len() && times.iter().zip(&truth).all(|(a, b)| (a - b).abs() < 1e-9)
}

/// Returns x and y of a position (m).
fn in_plane(position: [f64; 3]) -> Vector2<f64> {
    Vector2::new(position[0], position[1])
}
