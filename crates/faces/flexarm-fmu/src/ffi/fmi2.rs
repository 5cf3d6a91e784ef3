//! FMI 2.0, co-simulation and model exchange.

use std::ffi::{CString, c_char, c_int, c_uint, c_void};
use std::path::PathBuf;
use std::ptr;

use super::{
    Differential, NULL, array, free_state, get_each, guarded, message, put_state, put_states, set_each, string, text_of,
};
use crate::error::FmuError;
use crate::instance::{Instance, InstanceState, Interface, StateValues};

type Status = c_int;
const OK: Status = 0;
const DISCARD: Status = 2;
const ERROR: Status = 3;
/// `fmi2ModelExchange`.
const MODEL_EXCHANGE: c_int = 0;
/// `fmi2CoSimulation`.
const CO_SIMULATION: c_int = 1;
/// `fmi2LastSuccessfulTime`.
const LAST_SUCCESSFUL_TIME: c_int = 2;

type Logger = Option<unsafe extern "C" fn(*mut c_void, *const c_char, Status, *const c_char, *const c_char, ...)>;

/// `fmi2CallbackFunctions`.
#[repr(C)]
struct Callbacks {
    logger: Logger,
    allocate: *const c_void,
    free: *const c_void,
    step_finished: *const c_void,
    environment: *mut c_void,
}

/// An instance with its logger.
struct Component {
    instance: Instance,
    log: Log,
}

/// Logger with what it is called with.
struct Log {
    logger: Logger,
    environment: *mut c_void,
    name: CString,
}

impl Log {
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

/// Runs a function of an instance.
///
/// # Safety
/// `component` is null or an instance that is not freed.
unsafe fn call(component: *mut c_void, work: impl FnOnce(&mut Instance) -> Result<(), FmuError>) -> Status {
    // SAFETY: as promised by the caller.
    let Some(component) = (unsafe { component.cast::<Component>().as_mut() }) else { return ERROR };
    match guarded(|| work(&mut component.instance)) {
        Some(Ok(())) => OK,
        Some(Err(error)) => {
            component.log.write(&text_of(&error));
            ERROR
        }
        None => {
            component.log.write("the library failed; please report it");
            ERROR
        }
    }
}

/// Writes functions that this kind of FMU does not have: they return an error.
macro_rules! without {
    ($($name:ident($($argument:ty),*);)*) => {$(
        #[unsafe(no_mangle)]
        extern "C" fn $name(component: *mut c_void $(, _: $argument)*) -> Status {
            let missing = FmuError::Order { function: stringify!($name), phase: "of this FMU" };
            // SAFETY: the importer passes an instance or null.
            unsafe { call(component, |_| Err(missing)) }
        }
    )*};
}

#[unsafe(no_mangle)]
extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
    c"default".as_ptr()
}

#[unsafe(no_mangle)]
extern "C" fn fmi2GetVersion() -> *const c_char {
    c"2.0".as_ptr()
}

#[unsafe(no_mangle)]
extern "C" fn fmi2SetDebugLogging(component: *mut c_void, _: c_int, _: usize, _: *const *const c_char) -> Status {
    // SAFETY: the importer passes an instance or null.
    unsafe { call(component, |_| Ok(())) }
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
    match guarded(|| Instance::new(&folder(location), guid, interface)) {
        Some(Ok(instance)) => Box::into_raw(Box::new(Component { instance, log })).cast(),
        Some(Err(error)) => {
            log.write(&text_of(&error));
            ptr::null_mut()
        }
        None => {
            log.write("the library failed; please report it");
            ptr::null_mut()
        }
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2FreeInstance(component: *mut c_void) {
    if !component.is_null() {
        // SAFETY: the importer frees an instance once.
        let component = unsafe { Box::from_raw(component.cast::<Component>()) };
        guarded(|| drop(component));
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2SetupExperiment(component: *mut c_void, _: c_int, _: f64, begin_s: f64, _: c_int, _: f64) -> Status {
    // SAFETY: the importer passes an instance or null.
    unsafe { call(component, |instance| instance.set_begin(begin_s)) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2EnterInitializationMode(component: *mut c_void) -> Status {
    // SAFETY: the importer passes an instance or null.
    unsafe { call(component, Instance::enter_initialisation) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2ExitInitializationMode(component: *mut c_void) -> Status {
    // SAFETY: the importer passes an instance or null.
    unsafe { call(component, Instance::exit_initialisation) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2Terminate(component: *mut c_void) -> Status {
    // SAFETY: the importer passes an instance or null.
    unsafe { call(component, Instance::terminate) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2Reset(component: *mut c_void) -> Status {
    // SAFETY: the importer passes an instance or null.
    unsafe {
        call(component, |instance| {
            instance.reset();
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2GetReal(component: *mut c_void, references: *const c_uint, n: usize, values: *mut f64) -> Status {
    // SAFETY: the importer passes an instance and arrays of this length, or null.
    unsafe { call(component, |instance| get_each(references, values, n, |reference| instance.get(reference))) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2SetReal(component: *mut c_void, references: *const c_uint, n: usize, values: *const f64) -> Status {
    // SAFETY: the importer passes an instance and arrays of this length, or null.
    unsafe {
        call(component, |instance| set_each(references, values, n, |reference, value| instance.set(reference, value)))
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2GetBoolean(
    component: *mut c_void,
    references: *const c_uint,
    n: usize,
    values: *mut c_int,
) -> Status {
    // SAFETY: the importer passes an instance and arrays of this length, or null.
    unsafe {
        call(component, |instance| {
            get_each(references, values, n, |reference| Ok(instance.get_flag(reference)?.into()))
        })
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2SetBoolean(
    component: *mut c_void,
    references: *const c_uint,
    n: usize,
    values: *const c_int,
) -> Status {
    // SAFETY: the importer passes an instance and arrays of this length, or null.
    unsafe {
        call(component, |instance| {
            set_each(references, values, n, |reference, value: c_int| instance.set_flag(reference, value != 0))
        })
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2GetFMUstate(component: *mut c_void, state: *mut *mut c_void) -> Status {
    // SAFETY: the importer passes an instance and a place for the state, or null.
    unsafe { call(component, |instance| put_state(state, instance.state()?)) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2SetFMUstate(component: *mut c_void, state: *mut c_void) -> Status {
    // SAFETY: the importer passes an instance and a state of it, or null.
    unsafe { call(component, |instance| instance.restore(state.cast::<InstanceState>().as_ref().ok_or(NULL)?)) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2FreeFMUstate(component: *mut c_void, state: *mut *mut c_void) -> Status {
    // SAFETY: the importer passes an instance and a place with a state that is not freed, or null.
    unsafe { call(component, |_| free_state(state)) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2DoStep(component: *mut c_void, from_s: f64, length_s: f64, _no_return: c_int) -> Status {
    // SAFETY: the importer passes an instance or null.
    unsafe { call(component, |instance| instance.step(from_s, length_s)) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2GetRealStatus(component: *mut c_void, kind: c_int, value: *mut f64) -> Status {
    // SAFETY: the importer passes an instance and a place for the value, or null.
    unsafe {
        call(component, |instance| {
            let place = value.as_mut().ok_or(NULL)?;
            match kind {
                LAST_SUCCESSFUL_TIME => *place = instance.time_s(),
                _ => return Err(FmuError::Order { function: "fmi2GetRealStatus", phase: "for this kind of status" }),
            }
            Ok(())
        })
    }
}

/// `fmi2EventInfo`.
#[repr(C)]
struct EventInfo {
    again: c_int,
    terminate: c_int,
    nominals_changed: c_int,
    states_changed: c_int,
    has_next: c_int,
    next_s: f64,
}

#[unsafe(no_mangle)]
extern "C" fn fmi2EnterEventMode(component: *mut c_void) -> Status {
    // SAFETY: the importer passes an instance or null.
    unsafe { call(component, Instance::enter_event_mode) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2EnterContinuousTimeMode(component: *mut c_void) -> Status {
    // SAFETY: the importer passes an instance or null.
    unsafe { call(component, Instance::enter_continuous_time_mode) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2NewDiscreteStates(component: *mut c_void, info: *mut EventInfo) -> Status {
    // SAFETY: the importer passes an instance and a place for the answer, or null.
    unsafe {
        call(component, |instance| {
            let (none, next_s) = (0, 0.0);
            *info.as_mut().ok_or(NULL)? = EventInfo {
                again: none,
                terminate: none,
                nominals_changed: none,
                states_changed: none,
                has_next: none,
                next_s,
            };
            instance.update_discrete_states()
        })
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2CompletedIntegratorStep(
    component: *mut c_void,
    _final: c_int,
    event: *mut c_int,
    terminate: *mut c_int,
) -> Status {
    // SAFETY: the importer passes an instance and places for the answers, or null.
    unsafe {
        call(component, |instance| {
            if event.is_null() || terminate.is_null() {
                return Err(NULL);
            }
            // Not as references: both may be the same place.
            event.write(0);
            terminate.write(0);
            instance.complete_step()
        })
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2SetTime(component: *mut c_void, time_s: f64) -> Status {
    // SAFETY: the importer passes an instance or null.
    unsafe { call(component, |instance| instance.set_time(time_s)) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2SetContinuousStates(component: *mut c_void, states: *const f64, n: usize) -> Status {
    // SAFETY: the importer passes an instance and an array of this length, or null.
    unsafe { call(component, |instance| instance.set_states(array(states, n).ok_or(NULL)?)) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2GetContinuousStates(component: *mut c_void, states: *mut f64, n: usize) -> Status {
    // SAFETY: the importer passes an instance and an array of this length, or null.
    unsafe { call(component, |instance| put_states(instance, StateValues::States, states, n)) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2GetDerivatives(component: *mut c_void, slopes: *mut f64, n: usize) -> Status {
    // SAFETY: the importer passes an instance and an array of this length, or null.
    unsafe { call(component, |instance| put_states(instance, StateValues::Derivatives, slopes, n)) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2GetNominalsOfContinuousStates(component: *mut c_void, nominals: *mut f64, n: usize) -> Status {
    // SAFETY: the importer passes an instance and an array of this length, or null.
    unsafe { call(component, |instance| put_states(instance, StateValues::Nominals, nominals, n)) }
}

/// There are no event indicators.
#[unsafe(no_mangle)]
extern "C" fn fmi2GetEventIndicators(component: *mut c_void, _: *mut f64, _: usize) -> Status {
    // SAFETY: the importer passes an instance or null.
    unsafe { call(component, |_| Ok(())) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi2GetDirectionalDerivative(
    component: *mut c_void,
    unknowns: *const c_uint,
    n_unknowns: usize,
    knowns: *const c_uint,
    n_knowns: usize,
    seed: *const f64,
    result: *mut f64,
) -> Status {
    let own = Differential {
        unknowns: (unknowns, n_unknowns),
        knowns: (knowns, n_knowns),
        seed: (seed, n_knowns),
        result: (result, n_unknowns),
    };
    // SAFETY: the importer passes an instance and arrays of these lengths, or null.
    unsafe { call(component, |instance| own.compute(instance)) }
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

type Refs = *const c_uint;
type Out<T> = *mut T;
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
