//! FMI 2.0, co-simulation and model exchange: the functions that an importer calls by name.
//!
//! Each passes its arguments to [`Instance`]; what has no meaning for this FMU (integers, strings,
//! input derivatives) returns an error. Not here: rules of pointers (`mod.rs`).

use std::ffi::{CString, c_char, c_int, c_uint, c_void};
use std::path::PathBuf;
use std::ptr;

use super::{
    Component, Differential, ERROR, Logger, NULL, Status, array, call, free, free_state, get_each, instantiated,
    message, put_state, put_states, set_each, string,
};
use crate::error::FmuError;
use crate::instance::{Instance, InstanceState, Interface, StateValues};

const DISCARD: Status = 2;
/// `fmi2ModelExchange`.
const MODEL_EXCHANGE: c_int = 0;
/// `fmi2CoSimulation`.
const CO_SIMULATION: c_int = 1;
/// `fmi2LastSuccessfulTime`.
const LAST_SUCCESSFUL_TIME: c_int = 2;

type LogMessage = Option<unsafe extern "C" fn(*mut c_void, *const c_char, Status, *const c_char, *const c_char, ...)>;

/// `fmi2CallbackFunctions`.
#[repr(C)]
struct Callbacks {
    logger: LogMessage,
    allocate: *const c_void,
    free: *const c_void,
    step_finished: *const c_void,
    environment: *mut c_void,
}

/// Logger with what it is called with.
struct Log {
    logger: LogMessage,
    environment: *mut c_void,
    name: CString,
}

impl Logger for Log {
    fn write(&self, text: &str) {
        if let Some(logger) = self.logger {
            let text = message(text);
            // SAFETY: the importer gave logger and environment for each other. The message is an
            // argument and no format.
            unsafe {
                let [category, format] = [c"logStatusError", c"%s"].map(|text| text.as_ptr());
                logger(self.environment, self.name.as_ptr(), ERROR, category, format, text.as_ptr());
            }
        }
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
    c"default".as_ptr()
}

#[unsafe(no_mangle)]
extern "C" fn fmi2GetVersion() -> *const c_char {
    c"2.0".as_ptr()
}

/// Returns the folder of a `file:` address; other texts are taken as paths.
pub fn folder(location: &str) -> PathBuf {
    let Some(rest) = location.strip_prefix("file:") else { return location.into() };
    // file:///path, file:/path and file://localhost/path.
    let path = match rest.strip_prefix("//") {
        Some(rest) => rest.find('/').map_or("/", |slash| &rest[slash..]),
        None => rest,
    };
    let bytes = path.as_bytes();
    let (mut plain, mut k) = (Vec::with_capacity(bytes.len()), 0);
    while k < bytes.len() {
        let code = (bytes[k] == b'%').then(|| path.get(k + 1..k + 3)).flatten();
        match code.and_then(|code| u8::from_str_radix(code, 16).ok()) {
            Some(byte) => {
                plain.push(byte);
                k += 3;
            }
            None => {
                plain.push(bytes[k]);
                k += 1;
            }
        }
    }
    let plain = String::from_utf8_lossy(&plain).into_owned();
    // file:///C:/folder
    let drive = plain.as_bytes().get(2) == Some(&b':') && cfg!(windows);
    PathBuf::from(if drive { plain[1..].to_owned() } else { plain })
}

#[unsafe(no_mangle)]
extern "C" fn fmi2Instantiate(
    name: *const c_char,
    kind: c_int,
    guid: *const c_char,
    location: *const c_char,
    callbacks: *const Callbacks,
    _visible: c_int,
    _logging: c_int,
) -> *mut c_void {
    // SAFETY: the importer passes strings and callbacks, or null.
    let (name, guid, location, callbacks) =
        unsafe { (string(name), string(guid), string(location), callbacks.as_ref()) };
    let (logger, environment) = callbacks.map_or((None, ptr::null_mut()), |own| (own.logger, own.environment));
    let log = Log { logger, environment, name: message(name.unwrap_or_default()) };
    let interface = match kind {
        MODEL_EXCHANGE => Interface::ModelExchange,
        CO_SIMULATION => Interface::CoSimulation,
        _ => {
            log.write("this FMU is for co-simulation and model exchange");
            return ptr::null_mut();
        }
    };
    let (Some(guid), Some(location)) = (guid, location) else {
        log.write("GUID and location of the resources are needed as UTF-8");
        return ptr::null_mut();
    };
    instantiated(log, || Instance::new(&folder(location), guid, interface))
}

#[unsafe(no_mangle)]
extern "C" fn fmi2FreeInstance(component: *mut c_void) {
    // SAFETY: the importer frees an instance once.
    unsafe { free(component.cast::<Component<Log>>()) }
}

/// `fmi2EventInfo`.
#[repr(C)]
#[derive(Default)]
struct EventInfo {
    again: c_int,
    terminate: c_int,
    nominals_changed: c_int,
    states_changed: c_int,
    has_next: c_int,
    next_s: f64,
}

type Refs = *const c_uint;
type Out<T> = *mut T;

functions! {
    fmi2SetDebugLogging(_on: c_int, _n: usize, _categories: *const *const c_char) = |_| Ok(());
    fmi2SetupExperiment(_has_tolerance: c_int, _tolerance: f64, begin_s: f64, _has_end: c_int, _end_s: f64) =
        |instance| instance.set_begin(begin_s);
    fmi2EnterInitializationMode() = Instance::enter_initialisation;
    fmi2ExitInitializationMode() = Instance::exit_initialisation;
    fmi2Terminate() = Instance::terminate;
    fmi2Reset() = |instance| {
        instance.reset();
        Ok(())
    };
    fmi2GetReal(references: Refs, n: usize, values: Out<f64>) =
        |instance| get_each(references, values, n, |reference| instance.get(reference));
    fmi2SetReal(references: Refs, n: usize, values: *const f64) =
        |instance| set_each(references, values, n, |reference, value| instance.set(reference, value));
    fmi2GetBoolean(references: Refs, n: usize, values: Out<c_int>) =
        |instance| get_each(references, values, n, |reference| Ok(instance.get_flag(reference)?.into()));
    fmi2SetBoolean(references: Refs, n: usize, values: *const c_int) =
        |instance| set_each(references, values, n, |reference, value| instance.set_flag(reference, value != 0));
    fmi2GetFMUstate(state: Out<*mut c_void>) = |instance| put_state(state, instance.state()?);
    fmi2SetFMUstate(state: *mut c_void) =
        |instance| instance.restore(state.cast::<InstanceState>().as_ref().ok_or(NULL)?);
    fmi2FreeFMUstate(state: Out<*mut c_void>) = |_| free_state(state);
    fmi2DoStep(from_s: f64, length_s: f64, _no_return: c_int) = |instance| instance.step(from_s, length_s);
    fmi2GetRealStatus(kind: c_int, value: Out<f64>) = |instance| {
        let place = value.as_mut().ok_or(NULL)?;
        if kind != LAST_SUCCESSFUL_TIME {
            return Err(FmuError::Order { function: "fmi2GetRealStatus", phase: "for this kind of status" });
        }
        *place = instance.time_s();
        Ok(())
    };
    fmi2EnterEventMode() = Instance::enter_event_mode;
    fmi2EnterContinuousTimeMode() = Instance::enter_continuous_time_mode;
    fmi2NewDiscreteStates(info: Out<EventInfo>) = |instance| {
        *info.as_mut().ok_or(NULL)? = EventInfo::default();
        instance.update_discrete_states()
    };
    fmi2CompletedIntegratorStep(_final: c_int, event: Out<c_int>, terminate: Out<c_int>) = |instance| {
        if event.is_null() || terminate.is_null() {
            return Err(NULL);
        }
        // Not as references: both may be the same place.
        event.write(0);
        terminate.write(0);
        instance.complete_step()
    };
    fmi2SetTime(time_s: f64) = |instance| instance.set_time(time_s);
    fmi2SetContinuousStates(states: *const f64, n: usize) =
        |instance| instance.set_states(array(states, n).ok_or(NULL)?);
    fmi2GetContinuousStates(states: Out<f64>, n: usize) =
        |instance| put_states(instance, StateValues::States, states, n);
    fmi2GetDerivatives(slopes: Out<f64>, n: usize) =
        |instance| put_states(instance, StateValues::Derivatives, slopes, n);
    fmi2GetNominalsOfContinuousStates(nominals: Out<f64>, n: usize) =
        |instance| put_states(instance, StateValues::Nominals, nominals, n);
    /// There are no event indicators.
    fmi2GetEventIndicators(_indicators: Out<f64>, _n: usize) = |_| Ok(());
    fmi2GetDirectionalDerivative(
        unknowns: Refs, n_unknowns: usize, knowns: Refs, n_knowns: usize, seed: *const f64, result: Out<f64>
    ) = |instance| Differential {
        unknowns: (unknowns, n_unknowns),
        knowns: (knowns, n_knowns),
        seed: (seed, n_knowns),
        result: (result, n_unknowns),
    }.compute(instance);
}

/// Steps are never pending: no other status is known.
macro_rules! discarded {
    ($($name:ident($value:ty);)*) => {$(
        #[unsafe(no_mangle)]
        extern "C" fn $name(_: *mut c_void, _: c_int, _: *mut $value) -> Status {
            DISCARD
        }
    )*};
}

discarded! {
    fmi2GetStatus(Status);
    fmi2GetIntegerStatus(c_int);
    fmi2GetBooleanStatus(c_int);
    fmi2GetStringStatus(*const c_char);
}

without! {
    fmi2GetInteger(Refs, usize, Out<c_int>);
    fmi2SetInteger(Refs, usize, *const c_int);
    fmi2GetString(Refs, usize, Out<*const c_char>);
    fmi2SetString(Refs, usize, *const *const c_char);
    fmi2SerializedFMUstateSize(*mut c_void, Out<usize>);
    fmi2SerializeFMUstate(*mut c_void, Out<c_char>, usize);
    fmi2DeSerializeFMUstate(*const c_char, usize, Out<*mut c_void>);
    fmi2SetRealInputDerivatives(Refs, usize, *const c_int, *const f64);
    fmi2GetRealOutputDerivatives(Refs, usize, *const c_int, Out<f64>);
    fmi2CancelStep();
}
