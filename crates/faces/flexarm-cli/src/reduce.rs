//! `flexarm reduce`: from flags to a job, and progress on the terminal.
//!
//! A job comes from a file, from flags, or from both: flags fill what a file leaves open and must
//! not say it twice. Not here: the reduction (`flexarm::links::reduce`).

use std::process::ExitCode;

use flexarm::links::reduce::{At, InterfaceEntry, ReduceJob, ReduceOptions, ReduceOutputs, UrdfEntry};

use crate::failure::Failure;
use crate::print;
use crate::reduce_args::{NamedValue, PlaceWord, ReduceArgs};
use crate::shipped::OutputFolder;
use crate::terminal::{Spinner, Terminal, answer, answer_as_is, to_json};

pub(crate) fn run(terminal: &Terminal, args: &ReduceArgs) -> Result<ExitCode, Failure> {
    let mut job = ReduceJob::load(&args.mesh)?;
    job.put_over(flags(args)?);
    if args.list {
        let listing = flexarm::links::reduce::list_mesh(&job)?;
        answer(terminal, || to_json(&listing), || print::listing(&listing));
        return Ok(ExitCode::SUCCESS);
    }
    let in_folder = args.output.is_some() || args.flex.is_none();
    let folder = OutputFolder::of(args.output.as_deref(), &job.link_name(), in_folder && !args.no_files)?;
    let outputs = ReduceOutputs { folder: folder.path(), flex: args.flex.clone(), overwrite: args.force };
    let outputs = (!args.no_files).then_some(outputs);
    let mut options = ReduceOptions::default();
    options.urdf.search_paths = flexarm::robots::search_paths_from_environment();

    let spinner = Spinner::new(terminal, "{pos}/{len} {msg}");
    let result = flexarm::links::reduce::reduce(&job, &options, outputs.as_ref(), &mut |step| {
        spinner.bar.set_length(step.of as u64);
        spinner.bar.set_position(step.number as u64);
        spinner.bar.set_message(step.step);
    });
    spinner.clear();
    let summary = result?;
    print::warnings(terminal, &summary.warnings);
    answer_as_is(terminal, || to_json(&summary), || print::reduction(&summary));
    Ok(ExitCode::SUCCESS)
}

/// Returns the job of the flags, without a mesh.
fn flags(args: &ReduceArgs) -> Result<ReduceJob, Failure> {
    let urdf = args.urdf.clone().zip(args.link.clone());
    let mut job = ReduceJob {
        link: args.name.clone(),
        units: args.units,
        modes: args.modes,
        modes_up_to_hz: args.modes_up_to,
        split: args.split,
        chains: args.chains.clone(),
        geometric: args.geometric.then_some(true),
        stress: args.stress.then_some(true),
        merge: args.merge,
        quadrature: args.quadrature,
        ordering: args.ordering,
        mesh_frame: args.mesh_frame,
        urdf: urdf.map(|(file, link)| UrdfEntry { file, link, joint: args.joint.clone(), rest: args.rest }),
        ..ReduceJob::default()
    };
    for NamedValue { name, value } in &args.materials {
        match name {
            Some(region) => {
                job.materials.insert(region.clone(), *value);
            }
            None => once(&mut job.material, *value, "--material")?,
        }
    }
    name_interfaces(&mut job, args)?;
    Ok(job)
}

/// Adds interfaces with their nodes, frames and ties.
fn name_interfaces(job: &mut ReduceJob, args: &ReduceArgs) -> Result<(), Failure> {
    for (NamedValue { name, value }, letter) in args.interfaces.iter().zip('A'..='Z') {
        let name = name.clone().unwrap_or_else(|| letter.to_string());
        once(&mut entry(job, &name).select, value.clone(), &format!("--interface {name}=..."))?;
        entry(job, &name).place = "command line".into();
    }
    for NamedValue { name, value } in &args.at {
        let Some(name) = name else {
            let text = "--at needs the name of an interface: --at A=x,y,z, --at A=centroid or --at A=joint:NAME";
            return Err(Failure::Usage(text.into()));
        };
        let own = entry(job, name);
        if own.xyz.is_some() || own.at.is_some() || own.joint.is_some() {
            return Err(Failure::Usage(format!("--at {name}=... is given twice")));
        }
        match value {
            PlaceWord::Centroid => own.at = Some(At::Centroid),
            PlaceWord::Joint(joint) => own.joint = Some(joint.clone()),
            PlaceWord::Frame(frame) => (own.xyz, own.rpy) = (Some(frame.xyz), Some(frame.rpy)),
        }
    }
    for NamedValue { name, value } in &args.ties {
        match name {
            Some(name) => once(&mut entry(job, name).tie, value.0, &format!("--tie {name}=..."))?,
            None => once(&mut job.tie, value.0, "--tie")?,
        }
    }
    Ok(())
}

fn once<T>(own: &mut Option<T>, value: T, flag: &str) -> Result<(), Failure> {
    match own.replace(value) {
        None => Ok(()),
        Some(_) => Err(Failure::Usage(format!("{flag} is given twice"))),
    }
}

/// Returns the interface of that name, adding it if there is none yet.
fn entry<'a>(job: &'a mut ReduceJob, name: &str) -> &'a mut InterfaceEntry {
    let found = job.interface.iter().position(|own| own.name.as_deref() == Some(name));
    let index = found.unwrap_or_else(|| {
        job.interface.push(InterfaceEntry { name: Some(name.to_owned()), ..InterfaceEntry::default() });
        job.interface.len() - 1
    });
    &mut job.interface[index]
}
