//! Conversion of panics in a dependency, caused by a damaged file, into errors.
//!
//! Sizes claimed by a file are checked before a dependency sees them; what still goes wrong inside
//! the dependency is caught here.

use std::any::Any;
use std::cell::Cell;
use std::panic::AssertUnwindSafe;
use std::sync::Once;

thread_local! {
    /// Whether a panic of the current thread is caught here.
    pub static CAUGHT: Cell<bool> = const { Cell::new(false) };
}

/// Panic in a reader of a dependency.
#[derive(Debug, PartialEq, thiserror::Error)]
#[error("its reader gave up: {message}")]
pub struct ReaderPanic {
    message: String,
}

/// Calls a reader of a dependency. A panic in it becomes an error and is not printed. Data changed
/// by the reader must not be used after an error.
pub fn caught<T>(read: impl FnOnce() -> T) -> Result<T, ReaderPanic> {
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        let usual = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            if !CAUGHT.get() {
                usual(panic);
            }
        }));
    });
    let before = CAUGHT.replace(true);
    let result = std::panic::catch_unwind(AssertUnwindSafe(read));
    CAUGHT.set(before);
    result.map_err(|panic| ReaderPanic { message: message(panic.as_ref()) })
}

/// Returns the message of a panic, on one short line.
fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied().or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("without a word").chars().map(|c| if c.is_control() { ' ' } else { c }).take(120).collect()
}
