//! The interface of `include/flexarm.h`: open a robot, find variables, start, step, read.
//!
//! A function returns 0, or -1 after keeping its message for `flexarm_error` of the same thread.
//! Not here: rules of pointers (`mod.rs`), what the functions do ([`FmuModel`]).

use std::cell::RefCell;
use std::ffi::{CString, c_char, c_int};
use std::path::Path;
use std::ptr;

use flexarm::settings::Words;
use flexarm::{DriveModel, LinkModel, Modelling};

use super::{Logger, NULL, array, free, get_each, guarded, logged, message, set_each, string, string_or_null, text_of};
use crate::error::FmuError;
use crate::model::{FmuModel, FmuSettings, FmuState};
use crate::variables::{Causality, Kind};

thread_local! {
    /// Message of the last error of this thread.
    static ERROR: RefCell<CString> = RefCell::default();
}

/// A plant with the names of its variables as C strings.
pub(super) struct Handle {
    plant: FmuModel,
    names: Vec<CString>,
    units: Vec<CString>,
}

fn failed(text: &str) {
    ERROR.with(|error| *error.borrow_mut() = message(text));
}

/// Keeps messages for [`flexarm_error`].
struct Last;

impl Logger for Last {
    fn write(&self, text: &str) {
        failed(text);
    }
}

/// Runs a function; returns 0, or -1 after keeping the message.
///
/// # Safety
/// `plant` is null or a plant that is not freed.
unsafe fn call(plant: *mut Handle, work: impl FnOnce(&mut Handle) -> Result<(), FmuError>) -> c_int {
    // SAFETY: as promised by the caller.
    let Some(plant) = (unsafe { plant.as_mut() }) else {
        failed("the plant is a null pointer");
        return -1;
    };
    logged(&Last, || work(plant)).map_or(-1, |()| 0)
}

/// Writes functions of a plant: their arguments, and what is done with the plant.
macro_rules! plant_functions {
    ($($name:ident($($argument:ident: $type:ty),*) = $work:expr;)*) => {$(
        #[unsafe(no_mangle)]
        extern "C" fn $name(plant: *mut Handle $(, $argument: $type)*) -> c_int {
            // SAFETY: the caller passes a plant, a state of it and arrays of this length, or null.
            unsafe { call(plant, $work) }
        }
    )*};
}

#[unsafe(no_mangle)]
extern "C" fn flexarm_version() -> *const c_char {
    const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");
    VERSION.as_ptr().cast()
}

#[unsafe(no_mangle)]
extern "C" fn flexarm_error() -> *const c_char {
    ERROR.with(|error| error.borrow().as_ptr())
}

#[unsafe(no_mangle)]
extern "C" fn flexarm_open(
    robot: *const c_char,
    links: *const c_char,
    drives: *const c_char,
    step_s: f64,
    pose: *const f64,
    n_pose: usize,
) -> *mut Handle {
    // SAFETY: the caller passes strings and an array of this length, or null.
    let made = guarded(|| unsafe { opened(robot, [links, drives], step_s, array(pose, n_pose)) });
    match made {
        Some(Ok(handle)) => Box::into_raw(Box::new(handle)),
        Some(Err(text)) => {
            failed(&text);
            ptr::null_mut()
        }
        None => {
            failed("the library failed; please report it");
            ptr::null_mut()
        }
    }
}

/// # Safety
/// Strings are null or end with zero.
unsafe fn opened(
    robot: *const c_char,
    models: [*const c_char; 2],
    step_s: f64,
    pose: Option<&[f64]>,
) -> Result<Handle, String> {
    // SAFETY: as promised by the caller.
    let (robot, [links, drives]) = unsafe { (string(robot), models.map(|model| string_or_null(model))) };
    let robot = robot.ok_or("robot: expected a path as UTF-8")?;
    let links = links.map_err(|error| format!("links: expected a word as UTF-8 ({error})"))?;
    let drives = drives.map_err(|error| format!("drives: expected a word as UTF-8 ({error})"))?;
    let pose = pose.ok_or("pose: a null pointer, expected n_pose numbers; for zero, n_pose = 0")?;
    let unknown = |what: &str, word: &str, known: String| format!("{what} = {word:?}: expected one of {known}");
    let links = match links {
        None => LinkModel::AsFiled,
        Some(word) => {
            LinkModel::from_word(word).ok_or_else(|| unknown("links", word, LinkModel::known().join(", ")))?
        }
    };
    let drives = match drives {
        None => DriveModel::AsFiled,
        Some(word) => {
            DriveModel::from_word(word).ok_or_else(|| unknown("drives", word, DriveModel::known().join(", ")))?
        }
    };
    let settings = FmuSettings {
        modelling: Modelling { links, drives, ..Modelling::default() },
        step_s: (step_s != 0.0).then_some(step_s),
        pose: (!pose.is_empty()).then(|| pose.to_vec()),
        ..FmuSettings::default()
    };
    let plant = FmuModel::new(Path::new(robot), &settings).map_err(|error| text_of(&error))?;
    let names = plant.variables().iter().map(|variable| message(&variable.name)).collect();
    let units = plant.variables().iter().map(|variable| message(variable.unit)).collect();
    Ok(Handle { plant, names, units })
}

#[unsafe(no_mangle)]
extern "C" fn flexarm_free(plant: *mut Handle) {
    // SAFETY: the caller frees a plant once.
    unsafe { free(plant) }
}

#[unsafe(no_mangle)]
extern "C" fn flexarm_count(plant: *const Handle) -> usize {
    // SAFETY: the caller passes a plant or null.
    unsafe { plant.as_ref() }.map_or(0, |handle| handle.names.len())
}

#[unsafe(no_mangle)]
extern "C" fn flexarm_find(plant: *const Handle, name: *const c_char) -> c_int {
    // SAFETY: the caller passes a plant and a string, or null.
    let (plant, name) = unsafe { (plant.as_ref(), string(name)) };
    let Some((handle, name)) = plant.zip(name) else {
        failed("a null pointer or a name that is not UTF-8; expected a plant and the name of a variable");
        return -1;
    };
    let found = handle.plant.find(name);
    found.and_then(|reference| c_int::try_from(reference).ok()).unwrap_or_else(|| {
        failed(&format!("there is no variable {name:?}"));
        -1
    })
}

#[unsafe(no_mangle)]
extern "C" fn flexarm_name(plant: *const Handle, reference: u32) -> *const c_char {
    // SAFETY: the caller passes a plant or null.
    let text = unsafe { plant.as_ref() }.and_then(|handle| handle.names.get(reference as usize));
    text.map_or(ptr::null(), |text| text.as_ptr())
}

#[unsafe(no_mangle)]
extern "C" fn flexarm_unit(plant: *const Handle, reference: u32) -> *const c_char {
    // SAFETY: the caller passes a plant or null.
    let text = unsafe { plant.as_ref() }.and_then(|handle| handle.units.get(reference as usize));
    text.map_or(ptr::null(), |text| text.as_ptr())
}

#[unsafe(no_mangle)]
extern "C" fn flexarm_causality(plant: *const Handle, reference: u32) -> c_int {
    // SAFETY: the caller passes a plant or null.
    let plant = unsafe { plant.as_ref() };
    match plant.and_then(|handle| handle.plant.variables().get(reference as usize)).map(|own| own.causality) {
        Some(Causality::Independent) => 0,
        Some(Causality::Parameter) => 1,
        Some(Causality::Input) => 2,
        Some(Causality::Output) => 3,
        Some(Causality::Local) => 4,
        None => -1,
    }
}

plant_functions! {
    flexarm_set(references: *const u32, values: *const f64, n: usize) = |handle| {
        set_each(references, values, n, |reference, value| {
            let reference = reference as usize;
            match handle.plant.variables().get(reference).map(|variable| variable.kind) {
                Some(Kind::Boolean) if value == 0.0 || value == 1.0 => handle.plant.set_flag(reference, value == 1.0),
                Some(Kind::Boolean) => {
                    let name = handle.plant.variables()[reference].name.clone();
                    Err(FmuError::Value { name, found: value, expected: "0 or 1" })
                }
                _ => handle.plant.set(reference, value),
            }
        })
    };
    flexarm_get(references: *const u32, values: *mut f64, n: usize) = |handle| {
        get_each(references, values, n, |reference| {
            let reference = reference as usize;
            match handle.plant.variables().get(reference).map(|variable| variable.kind) {
                Some(Kind::Boolean) => handle.plant.get_flag(reference).map(f64::from),
                _ => handle.plant.get(reference),
            }
        })
    };
    flexarm_start(begin_s: f64) = |handle| handle.plant.start(begin_s);
    flexarm_step(length_s: f64) = |handle| handle.plant.step(handle.plant.time_s(), length_s);
    flexarm_reset() = |handle| {
        handle.plant.reset();
        Ok(())
    };
    flexarm_restore(state: *const FmuState) = |handle| handle.plant.restore(state.as_ref().ok_or(NULL)?);
}

#[unsafe(no_mangle)]
extern "C" fn flexarm_time(plant: *const Handle) -> f64 {
    // SAFETY: the caller passes a plant or null.
    unsafe { plant.as_ref() }.map_or(f64::NAN, |handle| handle.plant.time_s())
}

#[unsafe(no_mangle)]
extern "C" fn flexarm_state(plant: *mut Handle) -> *mut FmuState {
    let mut state = ptr::null_mut();
    // SAFETY: the caller passes a plant or null.
    unsafe {
        call(plant, |handle| {
            state = Box::into_raw(Box::new(handle.plant.state()?));
            Ok(())
        });
    }
    state
}

#[unsafe(no_mangle)]
extern "C" fn flexarm_free_state(state: *mut FmuState) {
    // SAFETY: the caller frees a state once.
    unsafe { free(state) }
}

#[cfg(test)]
mod tests {
    use std::ffi::CStr;

    use super::*;

    const ROBOT: &CStr = match CStr::from_bytes_with_nul(
        concat!(env!("CARGO_MANIFEST_DIR"), "/../../../robots/moberg_arm/robot.toml\0").as_bytes(),
    ) {
        Ok(path) => path,
        Err(_) => panic!("the path has a zero"),
    };

    fn open(links: *const c_char, pose: *const f64, n_pose: usize) -> *mut Handle {
        flexarm_open(ROBOT.as_ptr(), links, ptr::null(), 0.0, pose, n_pose)
    }

    /// Message of the last error.
    fn said() -> String {
        ERROR.with(|error| error.borrow().to_str().unwrap().to_owned())
    }

    #[test]
    fn what_is_given_but_unreadable_does_not_count_as_not_given() {
        let none = ptr::null();
        assert!(open(c"\xff\xfe".as_ptr(), none.cast(), 0).is_null());
        assert!(said().contains("links: expected a word as UTF-8"), "{}", said());
        assert!(open(none, none.cast(), 5).is_null());
        assert!(said().contains("pose: a null pointer"), "{}", said());
        let plant = open(none, none.cast(), 0);
        assert!(!plant.is_null(), "{}", said());
        assert_eq!(flexarm_find(plant, none), -1);
        assert!(said().contains("a null pointer"), "{}", said());
        flexarm_free(plant);
    }

    #[test]
    fn a_truth_value_is_zero_or_one() {
        let plant = open(ptr::null(), ptr::null(), 0);
        let flag = flexarm_find(plant, c"use_target_velocity".as_ptr()) as u32;
        let mut found = -1.0;
        for (value, expected) in [(1.0, 0), (f64::NAN, -1), (0.5, -1), (0.0, 0)] {
            assert_eq!(flexarm_set(plant, &flag, &value, 1), expected, "{value}");
        }
        assert!(said().contains("use_target_velocity = 0.5: expected 0 or 1"), "{}", said());
        assert_eq!((flexarm_get(plant, &flag, &mut found, 1), found), (0, 0.0));
        flexarm_free(plant);
    }

    #[test]
    fn a_first_step_far_below_the_step_of_the_solver_is_refused_and_the_arm_goes_on() {
        let plant = open(ptr::null(), ptr::null(), 0);
        assert_eq!(flexarm_start(plant, 0.0), 0, "{}", said());
        assert_eq!(flexarm_step(plant, 1e-9), -1);
        assert!(said().contains("the first communication step is 0.000000001 s"), "{}", said());
        assert_eq!((flexarm_step(plant, 0.01), flexarm_time(plant)), (0, 0.01));
        flexarm_free(plant);
    }
}
