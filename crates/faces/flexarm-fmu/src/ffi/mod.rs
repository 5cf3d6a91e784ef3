//! Functions for C: FMI 2.0, FMI 3.0 and the interface of `include/flexarm.h`.
//!
//! Rules of all of them: a null pointer where an object or an array is needed is an error and not
//! undefined; no panic crosses the border; arrays have at least the given lengths, strings end with
//! zero, and objects are those that this library returned and that are not freed yet.

mod c;
mod fmi2;
mod fmi3;

use std::ffi::{CStr, CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::error::PlantError;

/// Runs a function; a panic becomes `None`.
fn guarded<T>(work: impl FnOnce() -> T) -> Option<T> {
    catch_unwind(AssertUnwindSafe(work)).ok()
}

/// Returns the text of a string; `None` for null and for what is not UTF-8.
///
/// # Safety
/// `text` is null or ends with zero.
unsafe fn string<'a>(text: *const c_char) -> Option<&'a str> {
    // SAFETY: as promised by the caller.
    (!text.is_null()).then(|| unsafe { CStr::from_ptr(text) }).and_then(|text| text.to_str().ok())
}

/// Returns an array as a slice; `None` if it is null but not empty.
///
/// # Safety
/// `values` is null or has `count` values that live as long as the slice.
unsafe fn array<'a, T>(values: *const T, count: usize) -> Option<&'a [T]> {
    match (count, values.is_null()) {
        (0, _) => Some(&[]),
        (_, true) => None,
        // SAFETY: as promised by the caller.
        _ => Some(unsafe { std::slice::from_raw_parts(values, count) }),
    }
}

/// Returns an array that is written, as [`array`].
///
/// # Safety
/// As [`array`]; nothing else uses the values meanwhile.
unsafe fn array_mut<'a, T>(values: *mut T, count: usize) -> Option<&'a mut [T]> {
    match (count, values.is_null()) {
        (0, _) => Some(&mut []),
        (_, true) => None,
        // SAFETY: as promised by the caller.
        _ => Some(unsafe { std::slice::from_raw_parts_mut(values, count) }),
    }
}

/// Returns a message as a C string.
fn message(text: &str) -> CString {
    CString::new(text.replace('\0', " ")).unwrap_or_default()
}

/// Returns the text of an error with its causes.
fn text_of(error: &PlantError) -> String {
    let mut text = error.to_string();
    let mut cause = std::error::Error::source(error);
    while let Some(error) = cause {
        let more = error.to_string();
        if !text.contains(&more) {
            text = format!("{text}: {more}");
        }
        cause = error.source();
    }
    text
}
