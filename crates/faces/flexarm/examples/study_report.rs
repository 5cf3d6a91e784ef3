//! One report of several runs: a robot with lumped links, with modal links, and with links of eight
//! parts.
//!
//! `cargo run -p flexarm --example study_report -- study.html`: three curves in one plot, figures
//! side by side.

use std::error::Error;
use std::path::Path;

use flexarm::report::{ReportRun, html};
use flexarm::{Keep, LinkModel, Modelling, Motion, Robot, RunOptions, RunRequest};

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("give the file to write")?;
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..");
    let robot = Robot::load(root.join("robots/kr210"))?;
    let model = robot.rigid_model()?;
    let motion = Motion::load_for(&root.join("trajectories/pick_and_place.toml"), &model)?;
    let choices = [
        ("2 parts", Modelling { links: LinkModel::Lumped, ..Modelling::default() }),
        ("8 parts", Modelling { links: LinkModel::Lumped, segments: Some(8), ..Modelling::default() }),
        ("modal", Modelling { links: LinkModel::Modal, ..Modelling::default() }),
    ];
    let mut runs = Vec::new();
    for (label, modelling) in choices {
        let run = robot.model(&modelling)?.simulate_with(
            &motion,
            &RunOptions::default(),
            RunRequest::keeping(Keep::Curves),
        )?;
        runs.push((label, (run.summary, run.trace)));
    }
    let report: Vec<ReportRun<'_>> =
        runs.iter().map(|(label, (summary, trace))| ReportRun { label, summary, trace }).collect();
    std::fs::write(path, html(&report))?;
    Ok(())
}
