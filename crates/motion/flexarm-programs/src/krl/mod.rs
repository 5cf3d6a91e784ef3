//! KUKA's KRL: `.src` with `.dat`, including the code written by teach pendants.
//!
//! [`parse`] converts lines to statements and [`dialect`] runs them: [`motion`] converts PTP, LIN,
//! CIRC and the splines to moves, [`mod@bas`] and [`functions`] implement the inline forms,
//! [`system`] holds the variables of the controller.
//!
//! Frames: B `$BASE` in W `$WORLD` (relative to `$ROBROOT`), T `$TOOL` on the flange F. A, B, C are
//! Z-Y'-X'' angles in degrees.

mod bas;
mod dialect;
mod functions;
mod motion;
mod parse;
mod system;

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use crate::common::machine::{Flow, Machine};
use crate::common::recorder::{Recorded, Recorder};
use crate::common::tree::{Action, Routine, Statement};
use crate::common::{Result, Span, Text, fail};
use crate::{ReadOptions, decode, given_text};

pub(crate) use parse::SPELLING;
use parse::Unit;
use system::Krl;

/// Maximum number of routine files read in addition to the program.
const MAX_SIBLINGS: usize = 64;

/// Number of parent folders of the program in which the controller's data are searched.
const LEVELS_OF_A_BACKUP: usize = 4;

pub(crate) fn read(texts: &mut Vec<Text>, options: &ReadOptions<'_>) -> Result<Recorded> {
    let mut unit = parse::parse(&texts[0], 0)?;
    let path = texts[0].path.clone();
    let mut data = companions(texts, &path, options)?;
    let entry = entry(&unit, options)?;
    for further in data.iter_mut() {
        unit.routines.append(&mut further.routines);
    }
    if options.find_companions {
        add_siblings(texts, &path, &mut unit, &mut data)?;
    }
    texts.push(given_text(options, "=", ""));
    let given = parse::parse(&texts[texts.len() - 1], texts.len() - 1)?;

    let mut machine = Machine::new(Recorder::new(options, texts.clone()), Krl::new());
    system::set_up(&mut machine);
    machine.dialect.is_given = true;
    machine.recorder.note_files();
    machine.run(&given.main)?;
    for further in &data {
        machine.declare_all(&further.data);
    }
    machine.declare_all(&unit.data);
    machine.run(&given.main)?; // takes precedence over the files
    machine.dialect.is_given = false;
    machine.add(unit.routines);
    let name = match &entry {
        Some(name) => {
            run_routine(&mut machine, name)?;
            name.to_string()
        }
        None => {
            machine.run(&unit.main)?;
            stem(&path)
        }
    };
    Ok(machine.recorder.finish(&name))
}

/// Adds the files given with the program, its data list, and the controller's `$config.dat`.
fn companions(texts: &mut Vec<Text>, path: &Path, options: &ReadOptions<'_>) -> Result<Vec<Unit>> {
    let mut data = Vec::new();
    for (companion, bytes) in &options.companions {
        data.push(add(texts, companion, bytes)?);
    }
    if options.find_companions {
        let is_new = |(found, _): &(PathBuf, Vec<u8>)| options.companions.iter().all(|(path, _)| path != found);
        if let Some((found, bytes)) = beside(path, &stem(path), "dat").filter(is_new) {
            data.push(add(texts, &found, &bytes)?);
        }
        if let Some((found, bytes)) = configuration(path).filter(is_new) {
            data.insert(0, add(texts, &found, &bytes)?);
        }
    }
    Ok(data)
}

/// Runs the routine with which the program starts.
fn run_routine(machine: &mut Machine<'_, Krl>, name: &Rc<str>) -> Result<()> {
    let Some(routine) = machine.routines.get(name).cloned() else {
        return fail(Span::default(), format!("there is no routine `{name}` in this file"));
    };
    if let Some(parameter) = routine.parameters.iter().find(|parameter| !machine.globals.contains_key(&parameter.name))
    {
        let hint = format!("`{}` needs a value for `{}`: give it as an option (`given`)", routine.name, parameter.name);
        return fail(routine.span, hint);
    }
    match machine.run(&routine.body)? {
        Flow::Leave | Flow::Again => fail(routine.span, "EXIT is outside a loop"),
        _ => Ok(()),
    }
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// Adds a file of the program.
fn add(texts: &mut Vec<Text>, path: &Path, bytes: &[u8]) -> Result<Unit> {
    texts.push(Text::new(path, &decode(bytes)));
    parse::parse(&texts[texts.len() - 1], texts.len() - 1)
}

/// Finds a file in the folder of the program, ignoring the case of its name.
fn beside(path: &Path, stem: &str, ending: &str) -> Option<(PathBuf, Vec<u8>)> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let wanted = format!("{stem}.{ending}").to_lowercase();
    let mut found: Vec<_> = std::fs::read_dir(folder).ok()?.flatten().map(|entry| entry.path()).collect();
    found.sort();
    let is_wanted =
        |candidate: &PathBuf| candidate.file_name().is_some_and(|name| name.to_string_lossy().to_lowercase() == wanted);
    let file = found.into_iter().find(is_wanted)?;
    let bytes = std::fs::read(&file).ok()?;
    Some((file, bytes))
}

/// Finds `$config.dat` of the controller in a backup: in `System` next to a folder that contains
/// the program.
fn configuration(path: &Path) -> Option<(PathBuf, Vec<u8>)> {
    let folders = path.ancestors().skip(1).take(LEVELS_OF_A_BACKUP);
    folders
        .flat_map(|folder| [folder.join("x"), folder.join("System/x")])
        .find_map(|place| beside(&place, "$config", "dat"))
}

/// Adds called routines that have files of their own next to the program.
fn add_siblings(texts: &mut Vec<Text>, path: &Path, unit: &mut Unit, data: &mut Vec<Unit>) -> Result<()> {
    let mut asked: HashSet<Rc<str>> = unit.routines.iter().map(|routine| routine.name.clone()).collect();
    let mut calls = Vec::new();
    unit.routines.iter().for_each(|routine| called(&routine.body, &mut calls));
    called(&unit.main, &mut calls);
    let mut siblings = 0;
    while let Some(name) = calls.pop() {
        if siblings >= MAX_SIBLINGS || dialect::is_built_in(&name) || !asked.insert(name.clone()) {
            continue;
        }
        let Some((file, bytes)) = beside(path, &name, "src") else { continue };
        siblings += 1;
        let mut further = add(texts, &file, &bytes)?;
        if let Some((file, bytes)) = beside(path, &name, "dat") {
            data.push(add(texts, &file, &bytes)?);
        }
        further.routines.iter().for_each(|routine| called(&routine.body, &mut calls));
        unit.routines.append(&mut further.routines);
    }
    Ok(())
}

/// Collects the names of all routines that the statements call.
fn called(body: &[Statement], names: &mut Vec<Rc<str>>) {
    for statement in body {
        match &statement.action {
            Action::Call { name, .. } => names.push(name.clone()),
            Action::If { branches, otherwise } => {
                branches.iter().for_each(|(_, body)| called(body, names));
                called(otherwise, names);
            }
            Action::Switch { cases, otherwise, .. } => {
                cases.iter().for_each(|(_, body)| called(body, names));
                called(otherwise, names);
            }
            Action::While { body, .. }
            | Action::For { body, .. }
            | Action::Repeat { body, .. }
            | Action::Block { body, .. } => {
                called(body, names);
            }
            _ => {}
        }
    }
}

/// Routine with which the program starts; `None` for statements outside of routines.
fn entry(unit: &Unit, options: &ReadOptions<'_>) -> Result<Option<Rc<str>>> {
    if let Some(entry) = &options.entry {
        return Ok(Some(entry.to_lowercase().into()));
    }
    Ok(unit
        .routines
        .iter()
        .find(|routine: &&Routine| !routine.body.is_empty())
        .or(unit.routines.first())
        .map(|routine| routine.name.clone()))
}
