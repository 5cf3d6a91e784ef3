//! The program `flexarm-verify`: runs the case studies, writes their page, or compares it with a
//! stored page.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "printing is what a program is for")]

use std::error::Error as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use clap::builder::PossibleValuesParser;
use flexarm::Fault;
use flexarm::settings::{Names, Setting};
use flexarm_verify::bench::Bench;
use flexarm_verify::check::Difference;
use flexarm_verify::{Error, Verification, VerificationFiles, case_names, differences_from, verify};
use serde_json::json;

/// Maximum number of differences shown.
const SHOWN: usize = 20;

/// Runs the case studies against their truths and writes the page of results
#[derive(Debug, Parser)]
#[command(version)]
struct Args {
    /// Cases to run [default: all]
    #[arg(value_name = "CASE", value_parser = PossibleValuesParser::new(case_names()))]
    cases: Vec<String>,
    /// Leave out slow parts
    #[arg(long)]
    quick: bool,
    /// Folder with robots, trajectories and tests [default: here, else where the program was built]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Folder for verification.md, a page per case, pictures and verification.json
    #[arg(long, short, value_name = "DIR", default_value = "out/verification")]
    output: PathBuf,
    /// Overwrite existing files
    #[arg(long)]
    force: bool,
    /// Write no files
    #[arg(long, conflicts_with_all = ["output", "force"])]
    no_files: bool,
    /// Compare with the stored pages of the same cases instead of writing them; exit code 1 if they
    /// differ
    #[arg(long, value_name = "FILE", conflicts_with_all = ["output", "force"])]
    check: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

fn main() -> ExitCode {
    let setting = |setting| match setting {
        Setting::Output => "--output",
        Setting::Overwrite => "--force",
        other => other.key(),
    };
    flexarm::settings::name_settings(Names { setting, caller: "the command line" });
    run(&Args::parse()).unwrap_or_else(|error| {
        let text = error.to_string();
        eprintln!("error: {text}");
        let mut source = error.source();
        while let Some(cause) = source {
            if !text.contains(&cause.to_string()) {
                eprintln!("  because: {cause}");
            }
            source = cause.source();
        }
        ExitCode::from(match error.fault() {
            Fault::Input => 2,
            Fault::Run => 1,
        })
    })
}

fn run(args: &Args) -> Result<ExitCode, Error> {
    if let Some(path) = args.check.as_ref().filter(|path| !path.is_file()) {
        let what = "the stored page cannot be read: there is no such file".to_owned();
        return Err(flexarm::Error::File { path: path.clone(), what }.into());
    }
    // Whether files can be written is known before a minute of computing.
    let wanted = !args.no_files && args.check.is_none();
    let files = wanted.then(|| VerificationFiles::new(&args.output, args.force)).transpose()?;
    let root = args.data.clone().unwrap_or_else(checkout);
    let bench = Bench { root, scratch: std::env::temp_dir(), quick: args.quick };

    let started = Instant::now();
    let mut current = String::new();
    let verification = verify(&bench, &args.cases, &mut |share, name| {
        if current != name {
            name.clone_into(&mut current);
            eprintln!("{:3.0} %  {name}", 100.0 * share);
        }
    })?;
    let wall_s = started.elapsed().as_secs_f64();
    // Results: files, or differences from stored ones; then numbers for programs or for people.
    if let Some(files) = &files {
        files.write(&verification)?;
    }
    let changed = args.check.as_ref().map_or(Ok(Vec::new()), |path| differences_from(path, &verification))?;
    let page = files.map(|files| files.page());
    if args.json {
        let case = |c: &flexarm_verify::page::Case| {
            c.claims().map(|claim| json!({"case": c.name, "claim": claim})).collect::<Vec<_>>()
        };
        let claims: Vec<_> = verification.cases.iter().flat_map(case).collect();
        let found = json!({
            "passed": verification.passed, "claims": claims, "cases": verification.cases, "differences": changed,
            "wall_s": wall_s, "file": page,
        });
        println!("{found}");
    } else {
        print!("{}", text(&verification, wall_s));
        if let Some(path) = &args.check {
            print!("{}", comparison(path, &changed));
        }
        if let Some(page) = page {
            println!("page: {}", page.display());
        }
    }
    Ok(if verification.passed && changed.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// Returns the folder with `robots` and `tests/verification`: the current one, else the one where
/// the program was built.
fn checkout() -> PathBuf {
    let built = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..");
    let has_both = |root: &PathBuf| root.join("robots").is_dir() && root.join("tests/verification").is_dir();
    [PathBuf::from("."), built].into_iter().find(has_both).unwrap_or_else(|| PathBuf::from("."))
}

/// Formats the claims.
fn text(verification: &Verification, wall_s: f64) -> String {
    let (mut text, mut all, mut broken) = (String::new(), 0, 0);
    for case in &verification.cases {
        text += &format!("{}\n", case.title);
        for claim in case.claims() {
            let mark = if claim.holds { "ok  " } else { "FAIL" };
            let (found, limit) = (claim.found(), claim.limit());
            text += &format!("  {mark} {found:>8} {limit:<9}  {} [{}]\n", claim.text, claim.truth);
            all += 1;
            broken += usize::from(!claim.holds);
        }
    }
    text + &format!("{} of {all} claims hold, {wall_s:.1} s\n", all - broken)
}

/// Formats the differences from a stored page.
fn comparison(path: &Path, changed: &[Difference]) -> String {
    if changed.is_empty() {
        return format!("{} is what this program writes\n", path.display());
    }
    let folder = path.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
    let mut text = format!(
        "{} differs in {} place(s); flexarm-verify -o {} --force writes it again\n",
        path.display(),
        changed.len(),
        folder.display()
    );
    for Difference { page, line, stored, found } in changed.iter().take(SHOWN) {
        let place = page.display();
        text += &match line {
            0 => format!("  {place}: stored is {stored}\n"),
            _ => format!("  {place}, line {line}\n    stored {stored}\n    found  {found}\n"),
        };
    }
    match changed.len().saturating_sub(SHOWN) {
        0 => text,
        more => text + &format!("  and {more} more\n"),
    }
}
