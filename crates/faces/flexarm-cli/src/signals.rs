//! Signals: those that ask a command to stop, and those that must not end it without a word.
//!
//! Until a command looks for a wish to stop for the first time, nothing is open that must be
//! closed, and the signals do what they always do; from then on they only leave a note, and the
//! command stops at a place where its files are whole. What the caller has told the system to
//! ignore (`nohup`, a job in the background) stays ignored.

use std::ops::ControlFlow;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

/// To be called before anything else: a file that may not grow further (`ulimit -f`) is then an
/// error of the write, which names the file, and no longer a signal that kills the program.
pub(crate) fn turn_into_errors() {
    #[cfg(unix)]
    {
        // Nobody looks at the note: a signal that has a handler does not kill.
        let _ = flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
    }
}

/// Says whether the user, or the system, has asked to stop since this was first asked.
pub(crate) fn stop_when_asked() -> impl FnMut() -> ControlFlow<()> {
    let asked = Arc::new(AtomicBool::new(false));
    let mut armed = false;
    move || {
        if !std::mem::replace(&mut armed, true) {
            for signal in signals() {
                let _ = flag::register(signal, asked.clone()); // without a handler the signal stays what it is
            }
        }
        if asked.load(Ordering::SeqCst) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// Ends the process if a command does not stop by itself soon after it was asked to; see
/// [`end_if_not_stopped`].
pub(crate) struct Watch(Arc<AtomicBool>);

impl Watch {
    /// The command has come to its end: whoever asks this first has the last word.
    fn is_first(over: &AtomicBool) -> bool {
        !over.swap(true, Ordering::SeqCst)
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        // The process is being ended: there is nothing left to say.
        while !Self::is_first(&self.0) {
            std::thread::sleep(PATIENCE);
        }
    }
}

/// How long a command may take to stop by itself, and how often it is looked whether it was asked
/// to.
const PATIENCE: Duration = Duration::from_millis(300);
const LOOK: Duration = Duration::from_millis(20);

/// Watches a command whose files are whole at any time: if it was asked to stop and has not after
/// [`PATIENCE`], the process ends with what `last_words` returns. The watch ends with what is
/// returned.
pub(crate) fn end_if_not_stopped(last_words: impl Fn() -> ExitCode + Send + 'static) -> Watch {
    let over = Arc::new(AtomicBool::new(false));
    let watched = over.clone();
    let mut asked = stop_when_asked();
    let _ = asked(); // from here on
    std::thread::spawn(move || {
        while asked().is_continue() {
            if watched.load(Ordering::SeqCst) {
                return;
            }
            std::thread::sleep(LOOK);
        }
        std::thread::sleep(PATIENCE);
        if Watch::is_first(&watched) {
            let code = last_words();
            std::process::exit(i32::from(code != ExitCode::SUCCESS));
        }
    });
    Watch(over)
}

/// Ctrl-C, a polite kill, and a terminal that closes, as far as they are not ignored.
fn signals() -> Vec<i32> {
    #[cfg(target_os = "linux")]
    let known = vec![SIGINT, SIGTERM, signal_hook::consts::SIGHUP];
    // Where it cannot be told whether it is ignored, a terminal that closes is left alone:
    // recordings survive being killed.
    #[cfg(not(target_os = "linux"))]
    let known = vec![SIGINT, SIGTERM];
    let ignored = ignored();
    known.into_iter().filter(|signal| ignored >> (signal - 1) & 1 == 0).collect()
}

/// The signals that this process was started to ignore: bit k - 1 is signal k.
fn ignored() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}
