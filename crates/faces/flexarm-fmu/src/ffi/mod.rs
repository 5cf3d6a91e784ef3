//! Functions for C: FMI 2.0, FMI 3.0 and the interface of `include/flexarm.h`.
//!
//! Rules of all of them: a null pointer where an object or an array is needed is an error and not
//! undefined; no panic crosses the border; arrays have at least the given lengths, strings end with
//! zero, and objects are those that this library returned and that are not freed yet.

/// Writes functions of FMI: the arguments after the instance, and what is done with the instance.
macro_rules! functions {
    ($($(#[$doc:meta])* $name:ident($($argument:ident: $type:ty),*) = $work:expr;)*) => {$(
        $(#[$doc])*
        #[unsafe(no_mangle)]
        extern "C" fn $name(component: *mut c_void $(, $argument: $type)*) -> Status {
            // SAFETY: the importer passes an instance, and places and arrays of the given lengths, or
            // null.
            unsafe { call::<Log>(component, $work) }
        }
    )*};
}

/// Writes functions that this kind of FMU does not have: they return an error.
macro_rules! without {
    ($($name:ident($($argument:ty),*);)*) => {$(
        #[unsafe(no_mangle)]
        extern "C" fn $name(component: *mut c_void $(, _: $argument)*) -> Status {
            let missing = FmuError::Order { function: stringify!($name), phase: "of this FMU" };
            // SAFETY: the importer passes an instance or null.
            unsafe { call::<Log>(component, |_| Err(missing)) }
        }
    )*};
}

mod c;
pub(crate) mod fmi2;
mod fmi3;

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr;
use std::str::Utf8Error;

use crate::error::FmuError;
use crate::instance::{Instance, InstanceState, StateValues};

/// Status of FMI.
type Status = c_int;
const OK: Status = 0;
const ERROR: Status = 3;

/// Error for a null pointer where an object or an array is needed.
const NULL: FmuError = FmuError::Order { function: "a function", phase: "with a null pointer" };

/// Receiver of messages.
trait Logger {
    fn write(&self, text: &str);
}

/// An instance with the logger of its importer.
struct Component<L> {
    instance: Instance,
    log: L,
}

/// Returns a new instance for the importer, or null after a message.
fn instantiated<L: Logger>(log: L, make: impl FnOnce() -> Result<Instance, FmuError>) -> *mut c_void {
    match logged(&log, make) {
        Some(instance) => Box::into_raw(Box::new(Component { instance, log })).cast(),
        None => ptr::null_mut(),
    }
}

/// Frees an object.
///
/// # Safety
/// `object` is null or an object that is not freed.
unsafe fn free<T>(object: *mut T) {
    if !object.is_null() {
        // SAFETY: as promised by the caller.
        let object = unsafe { Box::from_raw(object) };
        guarded(|| drop(object));
    }
}

/// Runs a function of an instance.
///
/// # Safety
/// `component` is null or an instance with this logger that is not freed.
unsafe fn call<L: Logger>(component: *mut c_void, work: impl FnOnce(&mut Instance) -> Result<(), FmuError>) -> Status {
    // SAFETY: as promised by the caller.
    let Some(component) = (unsafe { component.cast::<Component<L>>().as_mut() }) else { return ERROR };
    logged(&component.log, || work(&mut component.instance)).map_or(ERROR, |()| OK)
}

/// Runs a function; writes its error, or that it panicked.
fn logged<T>(log: &impl Logger, work: impl FnOnce() -> Result<T, FmuError>) -> Option<T> {
    match guarded(work) {
        Some(Ok(done)) => return Some(done),
        Some(Err(error)) => log.write(&text_of(&error)),
        None => log.write("the library failed; please report it"),
    }
    None
}

/// Runs a function; a panic becomes `None`.
fn guarded<T>(work: impl FnOnce() -> T) -> Option<T> {
    catch_unwind(AssertUnwindSafe(work)).ok()
}

/// Returns the text of a string; `None` for null and for what is not UTF-8.
///
/// # Safety
/// As [`string_or_null`].
unsafe fn string<'a>(text: *const c_char) -> Option<&'a str> {
    // SAFETY: as promised by the caller.
    unsafe { string_or_null(text) }.ok().flatten()
}

/// Returns the text of a string; `None` for null.
///
/// # Safety
/// `text` is null or ends with zero.
unsafe fn string_or_null<'a>(text: *const c_char) -> Result<Option<&'a str>, Utf8Error> {
    // SAFETY: as promised by the caller.
    (!text.is_null()).then(|| unsafe { CStr::from_ptr(text) }.to_str()).transpose()
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

/// Writes the value of each reference.
///
/// # Safety
/// Both arrays are null or have `n` entries; they may overlap.
unsafe fn get_each<T>(
    references: *const u32,
    values: *mut T,
    n: usize,
    mut get: impl FnMut(u32) -> Result<T, FmuError>,
) -> Result<(), FmuError> {
    if n > 0 && (references.is_null() || values.is_null()) {
        return Err(NULL);
    }
    (0..n).try_for_each(|k| {
        // SAFETY: as promised by the caller.
        unsafe { values.add(k).write(get(references.add(k).read())?) };
        Ok(())
    })
}

/// Sets the value of each reference.
///
/// # Safety
/// As [`array`], with `n` references and values.
unsafe fn set_each<T: Copy>(
    references: *const u32,
    values: *const T,
    n: usize,
    mut set: impl FnMut(u32, T) -> Result<(), FmuError>,
) -> Result<(), FmuError> {
    // SAFETY: as promised by the caller.
    let (references, values) = unsafe { (array(references, n).ok_or(NULL)?, array(values, n).ok_or(NULL)?) };
    references.iter().zip(values).try_for_each(|(&reference, &value)| set(reference, value))
}

/// Writes values of the continuous states of an instance.
///
/// # Safety
/// As [`array_mut`], with `n` values.
unsafe fn put_states(instance: &mut Instance, what: StateValues, to: *mut f64, n: usize) -> Result<(), FmuError> {
    // SAFETY: as promised by the caller.
    instance.write_states(what, unsafe { array_mut(to, n) }.ok_or(NULL)?)
}

/// Arrays of a directional derivative: references of unknowns and knowns, seed, result.
struct Differential {
    unknowns: (*const u32, usize),
    knowns: (*const u32, usize),
    seed: (*const f64, usize),
    result: (*mut f64, usize),
}

impl Differential {
    /// # Safety
    /// As [`array`] and [`array_mut`].
    unsafe fn compute(self, instance: &mut Instance) -> Result<(), FmuError> {
        let Self { unknowns, knowns, seed, result } = self;
        // SAFETY: as promised by the caller.
        let (unknowns, knowns, seed) =
            unsafe { (array(unknowns.0, unknowns.1), array(knowns.0, knowns.1), array(seed.0, seed.1)) };
        // The result may be written where the seed was.
        let seed = seed.ok_or(NULL)?.to_vec();
        // SAFETY: as promised by the caller.
        let result = unsafe { array_mut(result.0, result.1) }.ok_or(NULL)?;
        instance.directional_derivative([unknowns.ok_or(NULL)?, knowns.ok_or(NULL)?], &seed, result)
    }
}

/// Writes a state to its place; a state that is there is used again.
///
/// # Safety
/// `place` is null or has null or a state of [`put_state`] that is not freed.
unsafe fn put_state(place: *mut *mut c_void, new: InstanceState) -> Result<(), FmuError> {
    // SAFETY: as promised by the caller.
    let place = unsafe { place.as_mut() }.ok_or(NULL)?;
    // SAFETY: as promised by the caller.
    match unsafe { place.cast::<InstanceState>().as_mut() } {
        Some(old) => *old = new,
        None => *place = Box::into_raw(Box::new(new)).cast(),
    }
    Ok(())
}

/// Frees the state of a place and writes null there.
///
/// # Safety
/// As [`put_state`].
unsafe fn free_state(place: *mut *mut c_void) -> Result<(), FmuError> {
    // SAFETY: as promised by the caller.
    if let Some(place) = unsafe { place.as_mut() }.filter(|place| !place.is_null()) {
        // SAFETY: as promised by the caller.
        drop(unsafe { Box::from_raw(place.cast::<InstanceState>()) });
        *place = ptr::null_mut();
    }
    Ok(())
}

/// Returns a message as a C string.
fn message(text: &str) -> CString {
    CString::new(text.replace('\0', " ")).unwrap_or_default()
}

/// Returns the text of an error with its causes.
fn text_of(error: &FmuError) -> String {
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
