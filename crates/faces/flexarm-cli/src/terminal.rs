//! Output of a command: text or JSON, progress.
//!
//! Start at [`Terminal`]: whether people or programs read the output. Answers go to standard
//! output, progress and warnings to standard error. Not here: texts and tables (`print.rs`,
//! `layout.rs`).

use std::io::{IsTerminal, Write};
use std::process::ExitCode;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use clap::Args;
use flexarm::settings::written::visible;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::layout::filled;
use crate::print;

/// Options of all commands.
#[derive(Debug, Args)]
pub(crate) struct Terminal {
    /// Print one JSON object on standard output and nothing else
    #[arg(long, global = true, help_heading = "Terminal")]
    pub(crate) json: bool,
    /// Hide the progress bar and all messages except errors
    #[arg(long, short, global = true, help_heading = "Terminal")]
    pub(crate) quiet: bool,
}

/// Width if neither the terminal nor the environment has one (columns).
const USUAL_WIDTH: usize = 80;

/// Width of text for people (columns): that of the terminal, else that of the variable COLUMNS.
pub(crate) fn columns() -> usize {
    let terminal = std::io::stdout()
        .is_terminal()
        .then(terminal_size::terminal_size)
        .flatten()
        .map(|(width, _)| usize::from(width.0));
    let named = || std::env::var("COLUMNS").ok().and_then(|text| text.parse().ok());
    // Some terminals report a width of zero.
    terminal.filter(|width| *width > 0).or_else(named).unwrap_or(USUAL_WIDTH)
}

/// Prints text for people or JSON for programs, with control characters escaped and long lines
/// wrapped; a closed pipe is not an error.
pub(crate) fn answer(terminal: &Terminal, json: impl FnOnce() -> String, text: impl FnOnce() -> String) {
    answer_as_is(terminal, json, || readable(&text()));
}

/// Text for people with control characters escaped and long lines wrapped.
pub(crate) fn readable(text: &str) -> String {
    filled(&print::plain_zeros(&visible(text)), columns())
}

/// The same for text whose lines stay as they are: [`readable`] already, styled, or to be pasted.
pub(crate) fn answer_as_is(terminal: &Terminal, json: impl FnOnce() -> String, text: impl FnOnce() -> String) {
    let out = if terminal.json { visible_json(&json()) + "\n" } else { text() };
    // Colours go only to terminals, and not if NO_COLOR is set.
    let mut stdout = anstream::stdout().lock();
    match stdout.write_all(out.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            // A lost answer must not look like success.
            print::complaint("error", &format!("standard output cannot be written: {error}"));
            std::process::exit(1);
        }
        _ => {}
    }
}

/// Escapes the control characters that the JSON writer leaves; they occur only in strings.
fn visible_json(text: &str) -> String {
    let is_left = |c: &char| ('\u{7f}'..='\u{9f}').contains(c);
    let escaped = |c: char| if is_left(&c) { format!("\\u{:04x}", u32::from(c)) } else { c.to_string() };
    if text.chars().any(|c| is_left(&c)) { text.chars().map(escaped).collect() } else { text.to_owned() }
}

/// Prints text generated in memory; in JSON under the given key.
pub(crate) fn written(terminal: &Terminal, key: &str, bytes: Vec<u8>) -> ExitCode {
    let text = String::from_utf8_lossy(&bytes);
    answer_as_is(terminal, || to_json(&serde_json::json!({ key: text })), || visible(&text));
    ExitCode::SUCCESS
}

pub(crate) fn to_json(value: &impl serde::Serialize) -> String {
    serde_json::to_string(value).expect("plain numbers and strings")
}

/// A progress bar that appears only on a terminal and only for runs longer than two seconds.
pub(crate) struct Bar {
    bar: Option<ProgressBar>,
    wanted: bool,
    started: Instant,
}

impl Bar {
    pub(crate) fn new(terminal: &Terminal) -> Self {
        Self { bar: None, wanted: !terminal.quiet && std::io::stderr().is_terminal(), started: Instant::now() }
    }

    pub(crate) fn show(&mut self, t: f64, total: f64) {
        self.show_as(t, total, || format!("{t:.2} of {total:.2} s simulated"));
    }

    pub(crate) fn show_as(&mut self, t: f64, total: f64, message: impl FnOnce() -> String) {
        if !self.wanted {
            return;
        }
        if self.bar.is_none() && self.started.elapsed() > Duration::from_secs(1) && t < 0.5 * total {
            let style = ProgressStyle::with_template("{msg} {wide_bar} {percent}% {eta} left");
            let bar = ProgressBar::new(1000).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            self.bar = Some(bar);
        }
        if let Some(bar) = &self.bar {
            bar.set_message(message());
            bar.set_position((1000.0 * t / total.max(1e-9)) as u64);
        }
    }

    pub(crate) fn clear(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// A line with a turning mark and the elapsed time, for work without a known end; shown only on a
/// terminal and only if the work takes more than two seconds.
pub(crate) struct Spinner {
    pub(crate) bar: ProgressBar,
    /// Stops the waiting thread that shows the line.
    waiting: Option<(Sender<()>, JoinHandle<()>)>,
}

impl Spinner {
    /// Waits for two seconds in a thread; `template` is one of [`ProgressStyle`].
    pub(crate) fn new(terminal: &Terminal, template: &str) -> Self {
        let style = ProgressStyle::with_template(&format!("{{spinner}} {template}, {{elapsed}}"));
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden())
            .with_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
        let wanted = !terminal.quiet && std::io::stderr().is_terminal();
        let waiting = wanted.then(|| {
            let (sender, receiver) = channel();
            let shown = bar.clone();
            let wait = move || {
                // A step may take minutes: the line must appear without waiting for the next step.
                if receiver.recv_timeout(Duration::from_secs(2)) == Err(RecvTimeoutError::Timeout) {
                    shown.set_draw_target(ProgressDrawTarget::stderr());
                    shown.enable_steady_tick(Duration::from_millis(200));
                }
            };
            (sender, std::thread::spawn(wait))
        });
        Self { bar, waiting }
    }

    pub(crate) fn clear(self) {
        if let Some((sender, thread)) = self.waiting {
            drop(sender);
            // The thread only displays progress; its failure can be ignored.
            let _ = thread.join();
        }
        self.bar.finish_and_clear();
    }
}

/// Does work during which a [`Spinner`] shows `message`.
pub(crate) fn working<T>(terminal: &Terminal, message: &str, work: impl FnOnce() -> T) -> T {
    let spinner = Spinner::new(terminal, message);
    let result = work();
    spinner.clear();
    result
}
