//! `flexarm verify`: runs the case studies, writes their page, and compares it with a stored page.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::Args;
use flexarm::Error;
use flexarm_verify::bench::Bench;
use flexarm_verify::{Verification, VerificationFiles, case_names, differences_from, verify};
use serde_json::json;

use crate::failure::Failure;
use crate::shipped::OutputFolder;
use crate::terminal::{Bar, Terminal, answer};
use crate::{shipped, signals};

#[derive(Debug, Args)]
pub(crate) struct VerifyArgs {
    /// Cases to run: one-beam, three-beams, lower-arm, manipulator, programs, measured, benchmarks,
    /// measured-arm
    /// [default: all]
    pub(crate) cases: Vec<String>,
    /// Leave out slow parts
    #[arg(long)]
    pub(crate) quick: bool,
    /// Folder with robots, trajectories and tests [default: here, else where the program was built]
    #[arg(long, value_name = "DIR")]
    pub(crate) data: Option<PathBuf>,
    /// Folder for verification.md, its pictures and verification.json [default: a new one in out]
    #[arg(long, short, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Overwrite existing files
    #[arg(long)]
    pub(crate) force: bool,
    /// Write no files
    #[arg(long, conflicts_with_all = ["output", "force"])]
    pub(crate) no_files: bool,
    /// Compare with a stored page of the same cases instead of writing one; exit code 1 if it
    /// differs
    #[arg(long, value_name = "FILE", conflicts_with_all = ["output", "force"])]
    pub(crate) check: Option<PathBuf>,
}

/// Maximum number of differences shown.
const SHOWN: usize = 20;

pub(crate) fn run(terminal: &Terminal, args: &VerifyArgs) -> Result<ExitCode, Failure> {
    let stored = args.check.as_ref().map(|path| {
        let what = |e| Error::File { path: path.clone(), what: format!("the stored page cannot be read: {e}") };
        std::fs::read_to_string(path).map_err(what)
    });
    let stored = stored.transpose()?;
    let wanted = !args.no_files && stored.is_none();
    let folder = OutputFolder::of(args.output.as_deref(), "verification", wanted)?;
    let files = folder.path().map(|folder| VerificationFiles::new(folder, args.force)).transpose()?;
    let root = args.data.clone().unwrap_or_else(shipped::checkout);
    let bench = Bench { root, scratch: std::env::temp_dir(), quick: args.quick };

    let started = Instant::now();
    let (mut stop, mut bar) = (signals::stop_when_asked(), Bar::new(terminal));
    let result = verify(&bench, &args.cases, &mut |share, name| {
        bar.show_as(share, 1.0, || format!("case {name}"));
        stop()
    });
    bar.clear();
    let verification = match result {
        Err(flexarm_verify::Error::Library(Error::Interrupted { .. })) => {
            crate::print::complaint("error", "stopped; nothing was written");
            return Ok(ExitCode::from(1));
        }
        other => other?,
    };
    let wall_s = started.elapsed().as_secs_f64();
    if let Some(files) = &files {
        files.write(&verification)?;
    }
    let changed = match (&stored, &args.check) {
        (Some(stored), Some(path)) => differences_from(stored, path, &verification)?,
        _ => Vec::new(),
    };
    let page = files.as_ref().map(|files| files.page().display().to_string());
    let json = || {
        let claims: Vec<_> = verification
            .cases
            .iter()
            .flat_map(|c| c.claims().map(|claim| json!({"case": c.name, "claim": claim})))
            .collect();
        json!({
            "passed": verification.passed, "claims": claims, "cases": verification.cases, "differences": changed,
            "wall_s": wall_s, "file": page,
        })
        .to_string()
    };
    answer(terminal, json, || {
        text(&verification, &changed.iter().map(line).collect::<Vec<_>>(), args, page.as_deref(), wall_s)
    });
    Ok(if verification.passed && changed.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

fn line(difference: &flexarm_verify::check::Difference) -> String {
    let flexarm_verify::check::Difference { line, stored, found } = difference;
    match line {
        0 => format!("  picture {found}: stored is {stored}\n"),
        _ => format!("  line {line}\n    stored {stored}\n    found  {found}\n"),
    }
}

/// Formats the claims, then the location of the full results.
fn text(verification: &Verification, changed: &[String], args: &VerifyArgs, page: Option<&str>, wall_s: f64) -> String {
    let mut text = String::new();
    for case in &verification.cases {
        text += &format!("{}\n", case.title);
        for claim in case.claims() {
            let mark = if claim.holds { "ok  " } else { "FAIL" };
            let (found, limit) = (claim.found(), claim.limit());
            text += &format!("  {mark} {found:>8} {limit:<9}  {} [{}]\n", claim.text, claim.truth);
        }
    }
    let all: usize = verification.cases.iter().map(|case| case.claims().count()).sum();
    let broken = verification.cases.iter().flat_map(|case| case.claims()).filter(|claim| !claim.holds).count();
    text += &format!("{} of {all} claims hold, {wall_s:.1} s\n", all - broken);
    if let Some(stored) = &args.check {
        text += &match changed.len() {
            0 => format!("{} is what this command prints\n", stored.display()),
            n => format!(
                "{} differs in {n} place(s); flexarm verify -o {} --force writes it again\n{}",
                stored.display(),
                stored
                    .parent()
                    .map(|p| p.display().to_string())
                    .filter(|p| !p.is_empty())
                    .unwrap_or_else(|| ".".into()),
                changed.iter().take(SHOWN).cloned().collect::<String>()
                    + &if n > SHOWN { format!("  and {} more\n", n - SHOWN) } else { String::new() }
            ),
        };
    }
    if let Some(page) = page {
        text += &format!("page: {page}\n");
    }
    if args.cases.is_empty() && !args.quick {
        return text;
    }
    text + &format!("(cases: {})\n", case_names().join(", "))
}
