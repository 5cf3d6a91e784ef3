//! Signal handling: stop requests, and signals that must not end a command without a message.
//!
//! Until a command first checks for a stop request, nothing is open that must be closed, and
//! signals keep their default effect. From then on they only set a flag, and the command stops at a
//! point where its files are complete. Signals that the caller has set to be ignored (`nohup`, a
//! background job) stay ignored.

use std::ops::ControlFlow;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

#[cfg(not(target_family = "wasm"))]
use signal_hook::consts::{SIGINT, SIGTERM};

/// Must be called first. A file that reaches its size limit (`ulimit -f`) then gives a write error,
/// which names the file, instead of a signal that kills the program.
pub(crate) fn turn_into_errors() {
    #[cfg(unix)]
    {
        // The flag is not used: a signal with a handler does not kill the process.
        set_on(signal_hook::consts::SIGXFSZ, &Arc::default());
    }
}

/// Returns a function that reports whether the user or the system has requested a stop since its
/// first call.
pub(crate) fn stop_when_asked() -> impl FnMut() -> ControlFlow<()> {
    let asked = Arc::new(AtomicBool::new(false));
    let mut armed = false;
    move || {
        if !std::mem::replace(&mut armed, true) {
            for signal in signals() {
                set_on(signal, &asked);
            }
        }
        if asked.load(Ordering::SeqCst) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// Ends the process if a command does not stop by itself soon after a stop request; see
/// [`end_if_not_stopped`].
pub(crate) struct Watch(Arc<AtomicBool>);

impl Watch {
    /// Marks the command as finished; returns true for the first caller, which decides the exit
    /// code.
    fn is_first(over: &AtomicBool) -> bool {
        !over.swap(true, Ordering::SeqCst)
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        // The other thread is ending the process: wait.
        while !Self::is_first(&self.0) {
            std::thread::sleep(PATIENCE);
        }
    }
}

/// Time that a command may take to stop by itself, and polling interval of stop requests.
const PATIENCE: Duration = Duration::from_millis(300);
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Watches a command whose files are complete at any time. If the command has not stopped within
/// [`PATIENCE`] after a request, the process ends with the exit code that `last_words` returns.
/// Dropping the returned value ends the watch.
pub(crate) fn end_if_not_stopped(last_words: impl Fn() -> ExitCode + Send + 'static) -> Watch {
    let over = Arc::new(AtomicBool::new(false));
    let watched = over.clone();
    let mut asked = stop_when_asked();
    let _ = asked(); // from here on
    let watching = std::thread::Builder::new().spawn(move || {
        while asked().is_continue() {
            if watched.load(Ordering::SeqCst) {
                return;
            }
            std::thread::sleep(POLL_INTERVAL);
        }
        std::thread::sleep(PATIENCE);
        if Watch::is_first(&watched) {
            let code = last_words();
            std::process::exit(i32::from(code != ExitCode::SUCCESS));
        }
    });
    drop(watching); // without threads, nothing is watched
    Watch(over)
}

/// Lets a signal set a flag. Without a handler the signal keeps its default effect.
#[cfg(not(target_family = "wasm"))]
fn set_on(signal: i32, flag: &Arc<AtomicBool>) {
    let _ = signal_hook::flag::register(signal, flag.clone());
}

/// There are no signals.
#[cfg(target_family = "wasm")]
fn set_on(_: i32, _: &Arc<AtomicBool>) {}

#[cfg(target_family = "wasm")]
fn signals() -> Vec<i32> {
    Vec::new()
}

/// Ctrl-C, SIGTERM and a closed terminal, unless they are ignored.
#[cfg(not(target_family = "wasm"))]
fn signals() -> Vec<i32> {
    #[cfg(target_os = "linux")]
    let known = vec![SIGINT, SIGTERM, signal_hook::consts::SIGHUP];
    // Without a way to detect whether it is ignored, SIGHUP keeps its default effect: recordings
    // survive being killed.
    #[cfg(not(target_os = "linux"))]
    let known = vec![SIGINT, SIGTERM];
    let ignored = ignored();
    known.into_iter().filter(|signal| ignored >> (signal - 1) & 1 == 0).collect()
}

#[cfg(not(target_family = "wasm"))]
/// Bit mask of the signals that this process was started to ignore: bit k - 1 is signal k.
fn ignored() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}
