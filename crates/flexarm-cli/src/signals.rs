//! Signals: those that ask a command to stop, and those that must not end it without a word.
//!
//! Until a command looks for a wish to stop for the first time, nothing is open that must be closed, and the signals do what
//! they always do; from then on they only leave a note, and the command stops at a place where its files are whole. What the caller has told the system to ignore
//! (`nohup`, a job in the background) stays ignored.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

/// To be called before anything else: a file that may not grow further (`ulimit -f`) is then an error of the write, which
/// names the file, and no longer a signal that kills the program.
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

/// Ctrl-C, a polite kill, and a terminal that closes, as far as they are not ignored.
fn signals() -> Vec<i32> {
    #[cfg(target_os = "linux")]
    let known = vec![SIGINT, SIGTERM, signal_hook::consts::SIGHUP];
    // Where it cannot be told whether it is ignored, a terminal that closes is left alone: recordings survive being killed.
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
