//! `flexarm view`: finds the Rerun viewer and opens a recording in it, which it makes of an MCAP file
//! if there is no other.

use std::ffi::OsStr;
use std::fmt::Write as _;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use clap::Args;
use flexarm::Error;
#[cfg(feature = "rerun")]
use flexarm::recordings::ConvertOptions;

use crate::failure::Failure;
use crate::print::{complaint, warning};
use crate::terminal::{Terminal, answer, to_json};

/// Oldest viewer that shows the `.rrd` files of this program.
const OLDEST: &str = "0.36.3";
/// File with the error output of a viewer.
const LOG: &str = "log";
/// Time for which a new viewer is watched: one that cannot start fails at once.
const WATCHED: Duration = Duration::from_secs(1);

#[derive(Debug, Args)]
pub(crate) struct ViewArgs {
    /// .rrd or .mcap recording, .html report, or the folder of a run; an .mcap needs the feature
    /// rerun
    pub(crate) file: PathBuf,
    /// Return only after the viewer is closed
    #[arg(long)]
    pub(crate) wait: bool,
}

pub(crate) fn run(terminal: &Terminal, args: &ViewArgs) -> Result<ExitCode, Failure> {
    let mut file = recording(&args.file)?;
    if ending(&file) == "mcap" {
        file = arranged(terminal, &file)?;
    }
    match ending(&file).as_str() {
        "html" | "htm" => Ok(browse(terminal, &file)),
        _ => {
            let Some(viewer) = Viewer::find() else {
                return Ok(failed(&format!(
                    "there is no Rerun viewer: neither `rerun` nor `{}` runs here.\nGet it with one of\n    \
                     pip install \"rerun-sdk>={OLDEST}\"\n    cargo install rerun-cli --locked\nor open the .mcap \
                     recording with Foxglove (https://foxglove.dev) or PlotJuggler",
                    WAYS[1].join(" ")
                )));
            };
            if numbers(&viewer.version) < numbers(OLDEST) && !terminal.quiet {
                warning(&format!(
                    ".rrd files are written for Rerun {OLDEST} or newer, the viewer here is {}: if it cannot show the \
                     file, `pip install \"rerun-sdk>={OLDEST}\"`",
                    viewer.version
                ));
            }
            Ok(show(terminal, &file, &viewer, args.wait))
        }
    }
}

/// Returns the file to show: the given one, or that of a run's folder.
fn recording(given: &Path) -> Result<PathBuf, Failure> {
    let fault = |what: &str| Err(Error::File { path: given.to_owned(), what: what.to_owned() }.into());
    if given.is_dir() {
        let names = ["study.rrd", "run.rrd", "run.mcap", "report.html"];
        let found = names.map(|name| given.join(name)).into_iter().find(|path| path.is_file());
        return match found {
            Some(path) => Ok(path),
            None => {
                fault("the folder has no run.rrd, run.mcap or report.html; `flexarm compare -o FOLDER` writes them")
            }
        };
    }
    if !given.is_file() {
        return fault("there is no such file; give a .rrd, .mcap or .html file or the folder of a run");
    }
    match ending(given).as_str() {
        "rrd" | "mcap" | "html" | "htm" => Ok(given.to_owned()),
        _ => fault("cannot be viewed: give a .rrd or .mcap recording, a .html report or the folder of a run"),
    }
}

/// Makes an `.rrd` file, with its layout, of an MCAP file: beside it, or in a folder for temporary
/// files if another file or the file system is in the way.
#[cfg(feature = "rerun")]
fn arranged(terminal: &Terminal, mcap: &Path) -> Result<PathBuf, Failure> {
    let convert = |to: PathBuf| crate::convert::convert(terminal, mcap, &to, &ConvertOptions::default()).map(|_| to);
    let beside = mcap.with_extension("rrd");
    let time = |path: &Path| path.metadata().and_then(|file| file.modified()).ok();
    if !beside.exists() {
        match convert(beside) {
            Err(Error::Write { .. }) => {}
            made => return Ok(made?),
        }
    } else if time(&beside) >= time(mcap) {
        return Ok(beside); // made of this file before
    }
    let parent = std::env::temp_dir();
    let folder = flexarm::files::private_folder(&parent).map_err(|source| Error::Write { path: parent, source })?;
    Ok(convert(folder.join(mcap.file_stem().unwrap_or_default()).with_extension("rrd"))?)
}

/// Refuses an MCAP file: as the viewer arranges it, the magnified arm is missing.
#[cfg(not(feature = "rerun"))]
fn arranged(_: &Terminal, mcap: &Path) -> Result<PathBuf, Failure> {
    let file = mcap.display();
    let what = format!(
        "the Rerun viewer needs an .rrd of it, and this program was built without Rerun.\n    \
         cargo run --release --features rerun -- view {file}\nmakes and opens it. Foxglove, PlotJuggler and \
         `rerun {file}` open the .mcap as it is"
    );
    Err(Error::File { path: mcap.to_owned(), what }.into())
}

fn ending(path: &Path) -> String {
    path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

/// Programs and leading arguments: the viewer on the path, else the one of Python, which must not take
/// modules from the working folder (`-I`).
const WAYS: [&[&str]; 2] = [&["rerun"], &["python3", "-I", "-m", "rerun"]];

/// A viewer that reported its version.
struct Viewer {
    /// Program and leading arguments.
    words: &'static [&'static str],
    version: String,
}

impl Viewer {
    /// Returns the first viewer that runs.
    fn find() -> Option<Self> {
        WAYS.into_iter().find_map(|words| {
            let output = command(words).arg("--version").stdin(Stdio::null()).stderr(Stdio::null()).output().ok()?;
            let text = String::from_utf8_lossy(&output.stdout).into_owned();
            // Another program of that name would print something else.
            let version = text.contains("rerun").then(|| text.split_whitespace().find(|word| is_version(word)))??;
            output.status.success().then(|| Self { words, version: version.to_owned() })
        })
    }

    fn name(&self) -> String {
        self.words.join(" ")
    }
}

fn command(words: &[&str]) -> Command {
    let mut command = Command::new(words[0]);
    command.args(&words[1..]);
    // A relative or empty entry of the path would offer programs of the working folder.
    let path = std::env::var_os("PATH").unwrap_or_default();
    if let Ok(path) = std::env::join_paths(std::env::split_paths(&path).filter(|folder| folder.is_absolute())) {
        command.env("PATH", path);
    }
    command
}

/// Returns whether a word is digits, point, digits, point, something.
pub fn is_version(word: &str) -> bool {
    let mut parts = word.split('.');
    let mut number = || parts.next().is_some_and(|part| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit()));
    number() && number() && parts.next().is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()))
}

/// Returns the three numbers of a version.
fn numbers(version: &str) -> Vec<u32> {
    version.split(['.', '-']).take(3).map_while(|part| part.parse().ok()).collect()
}

/// Starts the viewer, and watches it for a moment or waits until it is closed.
fn show(terminal: &Terminal, file: &Path, viewer: &Viewer, wait: bool) -> ExitCode {
    let mut command = command(viewer.words);
    command.arg(file).stdin(Stdio::null()).stdout(Stdio::null());
    // Error output of a viewer that cannot start. A pipe would break when this program ends.
    let mut folder = None;
    if !wait {
        folder = flexarm::files::private_folder(&std::env::temp_dir()).ok();
        let log = folder.as_ref().and_then(|folder| File::create(folder.join(LOG)).ok());
        command.stderr(log.map_or_else(Stdio::null, Stdio::from)).env("NO_COLOR", "1");
        detach(&mut command);
    }
    let mut child = command.spawn();
    let ended = child.as_mut().ok().and_then(watch);
    let mut said = String::new();
    if let Some(folder) = folder {
        said = std::fs::read_to_string(folder.join(LOG)).unwrap_or_default();
        let _ = std::fs::remove_dir_all(folder); // the log is still open in the viewer, deleted when it closes
    }
    let mut child = match child {
        Ok(child) => child,
        Err(error) => return failed(&format!("`{}` cannot be started: {error}", viewer.name())),
    };
    if let Some(Err(status)) = ended {
        return failed(&format!("`{} {}` ended with {status}{}", viewer.name(), file.display(), last_lines(&said)));
    }
    let json = || {
        to_json(&serde_json::json!({
            "file": file.display().to_string(), "viewer": viewer.name(), "version": viewer.version, "pid": child.id(),
        }))
    };
    let how = match ended {
        Some(_) => "handed to the viewer that is open already, by".to_owned(),
        None => format!("open in process {} of", child.id()),
    };
    answer(terminal, json, || format!("{}: {how} `{}` {}\n", file.display(), viewer.name(), viewer.version));
    if wait && ended.is_none() {
        return match child.wait() {
            Ok(status) if status.success() => ExitCode::SUCCESS,
            Ok(status) => failed(&format!("`{} {}` ended with {status}", viewer.name(), file.display())),
            Err(error) => failed(&format!("lost sight of `{}`: {error}", viewer.name())),
        };
    }
    ExitCode::SUCCESS
}

/// Detaches the viewer, so that Ctrl-C in the terminal does not close it.
fn detach(command: &mut Command) {
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(command, 0);
    #[cfg(not(unix))]
    let _ = command;
}

/// Returns how the viewer ended, if it ended at once.
fn watch(child: &mut Child) -> Option<Result<(), std::process::ExitStatus>> {
    let begin = Instant::now();
    while begin.elapsed() < WATCHED {
        if let Ok(Some(status)) = child.try_wait() {
            return Some(if status.success() { Ok(()) } else { Err(status) });
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    None
}

fn last_lines(text: &str) -> String {
    let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
    lines[lines.len().saturating_sub(5)..].iter().fold(String::new(), |mut all, line| {
        let _ = write!(all, "\n    {line}");
        all
    })
}

/// Opens a report in the browser; if none can be started, prints which file to open.
fn browse(terminal: &Terminal, file: &Path) -> ExitCode {
    let path = file.canonicalize().unwrap_or_else(|_| file.to_owned());
    let pid = open_in_browser(path.as_os_str());
    let json = || {
        let viewer = pid.map(|_| "xdg-open");
        to_json(&serde_json::json!({
            "file": file.display().to_string(), "viewer": viewer, "version": null, "pid": pid,
        }))
    };
    answer(terminal, json, || match pid {
        Some(_) => format!("{}: opened with xdg-open\n", file.display()),
        None => format!("{}: a report for a browser; open file://{}\n", file.display(), path.display()),
    });
    ExitCode::SUCCESS
}

/// Opens a file or an address in the browser; returns the process id of the opener if it started.
pub(crate) fn open_in_browser(target: &OsStr) -> Option<u32> {
    let mut opener = command(&["xdg-open"]);
    opener.arg(target).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    detach(&mut opener);
    let mut child = opener.spawn().ok().filter(|_| cfg!(target_os = "linux"))?;
    let opened = !matches!(watch(&mut child), Some(Err(_)));
    opened.then(|| child.id())
}

fn failed(message: &str) -> ExitCode {
    complaint("error", message);
    ExitCode::from(1)
}
