//! `flexarm import` and `flexarm export`: from flags to a job.
//!
//! Start at [`import`] and [`export`]. Not here: the flags (`exchange_args.rs`), the work
//! (`flexarm-linkmaker`).

use std::process::ExitCode;

use flexarm::links::WordError;
use flexarm::links::export::ExportJob;
use flexarm::links::import::{ImportJob, ImportOutputs, Names, PartMasses, RigidPart, parse_inertia, triple};
use flexarm::robots::RobotFormat;

use crate::exchange_args::{ExportArgs, ImportArgs};
use crate::failure::Failure;
use crate::shipped::OutputFolder;
use crate::terminal::{Terminal, answer, answer_as_is, to_json, working};
use crate::{print, values};

pub(crate) fn import(terminal: &Terminal, args: &ImportArgs) -> Result<ExitCode, Failure> {
    let job = import_job(args)?;
    let in_folder = args.output.is_some() || args.flex.is_none();
    let folder = OutputFolder::of(args.output.as_deref(), &job.link_name(), in_folder && !args.no_files)?;
    let outputs = ImportOutputs { folder: folder.path(), flex: args.flex.clone(), overwrite: args.force };
    let outputs = (!args.no_files).then_some(outputs);
    let summary = working(terminal, "importing", || flexarm::links::import::import(&job, outputs.as_ref()))?;
    print::warnings(terminal, &summary.warnings);
    answer_as_is(terminal, || to_json(&summary), || print::imported(&summary));
    Ok(ExitCode::SUCCESS)
}

pub(crate) fn export(terminal: &Terminal, args: &ExportArgs) -> Result<ExitCode, Failure> {
    let (Some(format), Some(units)) = (args.format, args.units) else { return export_robot(terminal, args) };
    let stem = args.input.file_stem().unwrap_or_default().to_string_lossy();
    let folder = OutputFolder::of(args.output.as_deref(), &stem, true)?;
    let job = ExportJob {
        link: args.input.clone(),
        format,
        units,
        nodes: args.nodes.clone(),
        folder: folder.path().unwrap_or_default(),
        overwrite: args.force,
    };
    let summary = working(terminal, "exporting", || flexarm::links::export::export(&job))?;
    print::warnings(terminal, &summary.warnings);
    answer(terminal, || to_json(&summary), || print::exported(&summary));
    Ok(ExitCode::SUCCESS)
}

fn export_robot(terminal: &Terminal, args: &ExportArgs) -> Result<ExitCode, Failure> {
    let robot = args.load.load(&args.input)?;
    let format = args.to.unwrap_or(RobotFormat::Mjcf);
    let at = Some(values::joint_values(args.at.as_deref(), &robot)?.map_or_else(|| robot.start_pose(), Ok)?);
    let name = robot.name.clone();
    let arm = robot.model(&args.modelling.modelling())?;
    let export = working(terminal, "exporting", || arm.export(at.as_deref(), format))?;
    let folder = OutputFolder::of(args.output.as_deref(), &name, true)?;
    let paths = export.write(&folder.path().unwrap_or_default(), args.force)?;
    let files: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    let json = serde_json::json!({ "step_s": export.step_s, "left_out": export.left_out, "files": files });
    answer(terminal, || to_json(&json), || print::exported_robot(&export, &files));
    Ok(ExitCode::SUCCESS)
}

/// Makes the job of the flags.
fn import_job(args: &ImportArgs) -> Result<ImportJob, Failure> {
    let usage = |flag: &'static str| move |error: WordError| Failure::Usage(format!("{flag}: {error}"));
    let masses = match (&args.part_a, &args.part_b, args.mass, &args.com, &args.inertia) {
        (Some(a), Some(b), ..) => PartMasses::Given([a.clone(), b.clone()]),
        (_, _, Some(mass), Some(com), Some(inertia)) => PartMasses::Whole(RigidPart {
            mass,
            com: triple(com).map_err(usage("--com"))?,
            inertia: parse_inertia(inertia).map_err(usage("--inertia"))?,
        }),
        _ => PartMasses::FromMatrix,
    };
    let default = ImportJob::default();
    Ok(ImportJob {
        files: args.files.clone(),
        mass_file: args.mass_file.clone(),
        format: args.format,
        names: Names { stiffness: args.k_name.clone(), mass: args.m_name.clone() },
        units: args.units,
        map: args.map.clone(),
        at: args.at.clone(),
        axes_rpy: match &args.axes_rpy {
            Some(text) => triple(text).map_err(usage("--axes-rpy"))?,
            None => default.axes_rpy,
        },
        modes: args.modes,
        masses,
        split: args.split.unwrap_or(default.split),
        name: args.name.clone(),
    })
}
