//! FMI 3.0, co-simulation and model exchange.

use std::ffi::{c_char, c_int, c_void};
use std::path::Path;
use std::ptr;

use super::{
    Differential, NULL, array, free_state, get_each, guarded, message, put_state, put_states, set_each, string, text_of,
};
use crate::error::FmuError;
use crate::instance::{Instance, InstanceState, Interface, StateValues};

type Status = c_int;
const OK: Status = 0;
const ERROR: Status = 3;

type LogMessage = Option<unsafe extern "C" fn(*mut c_void, Status, *const c_char, *const c_char)>;

/// An instance with its logger.
struct Component {
    instance: Instance,
    environment: *mut c_void,
    log: LogMessage,
}

impl Component {
    fn log(&self, error: &FmuError) {
        log(self.log, self.environment, &text_of(error));
    }
}

fn log(log: LogMessage, environment: *mut c_void, text: &str) {
    if let Some(log) = log {
        let text = message(text);
        // SAFETY: the importer gave logger and environment for each other.
        unsafe { log(environment, ERROR, c"logStatusError".as_ptr(), text.as_ptr()) }
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
            component.log(&error);
            ERROR
        }
        None => {
            log(component.log, component.environment, "the library failed; please report it");
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
extern "C" fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

#[unsafe(no_mangle)]
extern "C" fn fmi3SetDebugLogging(component: *mut c_void, _: bool, _: usize, _: *const *const c_char) -> Status {
    // SAFETY: the importer passes an instance or null.
    unsafe { call(component, |_| Ok(())) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3InstantiateModelExchange(
    _name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    _visible: bool,
    _logging: bool,
    environment: *mut c_void,
    logger: LogMessage,
) -> *mut c_void {
    // SAFETY: the importer passes strings or null.
    unsafe { instantiated([token, resources], Interface::ModelExchange, environment, logger) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3InstantiateScheduledExecution(
    _: *const c_char,
    _: *const c_char,
    _: *const c_char,
    _: bool,
    _: bool,
    environment: *mut c_void,
    logger: LogMessage,
    _: *const c_void,
    _: *const c_void,
    _: *const c_void,
) -> *mut c_void {
    log(logger, environment, "this FMU is for co-simulation and model exchange");
    ptr::null_mut()
}

/// Returns a new instance, or null after a message.
///
/// # Safety
/// Token and path of the resources are null or end with zero.
unsafe fn instantiated(
    [token, resources]: [*const c_char; 2],
    interface: Interface,
    environment: *mut c_void,
    logger: LogMessage,
) -> *mut c_void {
    // SAFETY: as promised by the caller.
    let (token, resources) = unsafe { (string(token), string(resources)) };
    let (Some(token), Some(resources)) = (token, resources) else {
        log(logger, environment, "token and path of the resources are needed as UTF-8");
        return ptr::null_mut();
    };
    match guarded(|| Instance::new(Path::new(resources), token, interface)) {
        Some(Ok(instance)) => Box::into_raw(Box::new(Component { instance, environment, log: logger })).cast(),
        Some(Err(error)) => {
            log(logger, environment, &text_of(&error));
            ptr::null_mut()
        }
        None => {
            log(logger, environment, "the library failed; please report it");
            ptr::null_mut()
        }
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3InstantiateCoSimulation(
    _name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    _visible: bool,
    _logging: bool,
    _events: bool,
    _early_return: bool,
    _intermediate: *const u32,
    n_intermediate: usize,
    environment: *mut c_void,
    logger: LogMessage,
    _update: *const c_void,
) -> *mut c_void {
    if n_intermediate > 0 {
        log(logger, environment, "this FMU has no intermediate update");
        return ptr::null_mut();
    }
    // SAFETY: the importer passes strings or null.
    unsafe { instantiated([token, resources], Interface::CoSimulation, environment, logger) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3FreeInstance(component: *mut c_void) {
    if !component.is_null() {
        // SAFETY: the importer frees an instance once.
        let component = unsafe { Box::from_raw(component.cast::<Component>()) };
        guarded(|| drop(component));
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3EnterInitializationMode(
    component: *mut c_void,
    _: bool,
    _: f64,
    begin_s: f64,
    _: bool,
    _: f64,
) -> Status {
    // SAFETY: the importer passes an instance or null.
    unsafe {
        call(component, |instance| {
            instance.set_begin(begin_s)?;
            instance.enter_initialisation()
        })
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3ExitInitializationMode(component: *mut c_void) -> Status {
    // SAFETY: the importer passes an instance or null.
    unsafe { call(component, Instance::exit_initialisation) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3Terminate(component: *mut c_void) -> Status {
    // SAFETY: the importer passes an instance or null.
    unsafe { call(component, Instance::terminate) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3Reset(component: *mut c_void) -> Status {
    // SAFETY: the importer passes an instance or null.
    unsafe {
        call(component, |instance| {
            instance.reset();
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3GetFloat64(
    component: *mut c_void,
    references: *const u32,
    n: usize,
    values: *mut f64,
    n_values: usize,
) -> Status {
    // SAFETY: the importer passes an instance and arrays of these lengths, or null.
    unsafe {
        call(component, |instance| {
            lengths(n, n_values)?;
            get_each(references, values, n, |reference| instance.get(reference))
        })
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3SetFloat64(
    component: *mut c_void,
    references: *const u32,
    n: usize,
    values: *const f64,
    n_values: usize,
) -> Status {
    // SAFETY: the importer passes an instance and arrays of these lengths, or null.
    unsafe {
        call(component, |instance| {
            lengths(n, n_values)?;
            set_each(references, values, n, |reference, value| instance.set(reference, value))
        })
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3GetBoolean(
    component: *mut c_void,
    references: *const u32,
    n: usize,
    values: *mut bool,
    n_values: usize,
) -> Status {
    // SAFETY: the importer passes an instance and arrays of these lengths, or null.
    unsafe {
        call(component, |instance| {
            lengths(n, n_values)?;
            get_each(references, values, n, |reference| instance.get_flag(reference))
        })
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3SetBoolean(
    component: *mut c_void,
    references: *const u32,
    n: usize,
    values: *const bool,
    n_values: usize,
) -> Status {
    // SAFETY: the importer passes an instance and arrays of these lengths, or null.
    unsafe {
        call(component, |instance| {
            lengths(n, n_values)?;
            set_each(references, values, n, |reference, value| instance.set_flag(reference, value))
        })
    }
}

/// Checks that there is a value for each reference; all variables are scalars.
fn lengths(references: usize, values: usize) -> Result<(), FmuError> {
    match references == values {
        true => Ok(()),
        false => Err(FmuError::Order { function: "a getter or setter", phase: "with another number of values" }),
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3GetFMUState(component: *mut c_void, state: *mut *mut c_void) -> Status {
    // SAFETY: the importer passes an instance and a place for the state, or null.
    unsafe { call(component, |instance| put_state(state, instance.state()?)) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3SetFMUState(component: *mut c_void, state: *mut c_void) -> Status {
    // SAFETY: the importer passes an instance and a state of it, or null.
    unsafe { call(component, |instance| instance.restore(state.cast::<InstanceState>().as_ref().ok_or(NULL)?)) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3FreeFMUState(component: *mut c_void, state: *mut *mut c_void) -> Status {
    // SAFETY: the importer passes an instance and a place with a state that is not freed, or null.
    unsafe { call(component, |_| free_state(state)) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3DoStep(
    component: *mut c_void,
    from_s: f64,
    length_s: f64,
    _no_return: bool,
    event: *mut bool,
    terminate: *mut bool,
    early: *mut bool,
    last_s: *mut f64,
) -> Status {
    // SAFETY: the importer passes an instance and places for the answers, or null.
    unsafe {
        lower([event, terminate, early]);
        call(component, |instance| {
            let done = instance.step(from_s, length_s);
            if let Some(last_s) = last_s.as_mut() {
                *last_s = instance.time_s();
            }
            done
        })
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3EnterEventMode(component: *mut c_void) -> Status {
    // SAFETY: the importer passes an instance or null.
    unsafe { call(component, Instance::enter_event_mode) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3EnterContinuousTimeMode(component: *mut c_void) -> Status {
    // SAFETY: the importer passes an instance or null.
    unsafe { call(component, Instance::enter_continuous_time_mode) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3UpdateDiscreteStates(
    component: *mut c_void,
    again: *mut bool,
    terminate: *mut bool,
    nominals_changed: *mut bool,
    states_changed: *mut bool,
    has_next: *mut bool,
    _next_s: *mut f64,
) -> Status {
    // SAFETY: the importer passes an instance and places for the answers, or null.
    unsafe {
        lower([again, terminate, nominals_changed, states_changed, has_next]);
        call(component, Instance::update_discrete_states)
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3CompletedIntegratorStep(
    component: *mut c_void,
    _final: bool,
    event: *mut bool,
    terminate: *mut bool,
) -> Status {
    // SAFETY: the importer passes an instance and places for the answers, or null.
    unsafe {
        lower([event, terminate]);
        call(component, Instance::complete_step)
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3SetTime(component: *mut c_void, time_s: f64) -> Status {
    // SAFETY: the importer passes an instance or null.
    unsafe { call(component, |instance| instance.set_time(time_s)) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3SetContinuousStates(component: *mut c_void, states: *const f64, n: usize) -> Status {
    // SAFETY: the importer passes an instance and an array of this length, or null.
    unsafe { call(component, |instance| instance.set_states(array(states, n).ok_or(NULL)?)) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3GetContinuousStates(component: *mut c_void, states: *mut f64, n: usize) -> Status {
    // SAFETY: the importer passes an instance and an array of this length, or null.
    unsafe { call(component, |instance| put_states(instance, StateValues::States, states, n)) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3GetContinuousStateDerivatives(component: *mut c_void, slopes: *mut f64, n: usize) -> Status {
    // SAFETY: the importer passes an instance and an array of this length, or null.
    unsafe { call(component, |instance| put_states(instance, StateValues::Derivatives, slopes, n)) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3GetNominalsOfContinuousStates(component: *mut c_void, nominals: *mut f64, n: usize) -> Status {
    // SAFETY: the importer passes an instance and an array of this length, or null.
    unsafe { call(component, |instance| put_states(instance, StateValues::Nominals, nominals, n)) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3GetNumberOfContinuousStates(component: *mut c_void, count: *mut usize) -> Status {
    // SAFETY: the importer passes an instance and a place for the number, or null.
    unsafe {
        call(component, |instance| {
            *count.as_mut().ok_or(NULL)? = instance.n_states();
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3GetNumberOfEventIndicators(component: *mut c_void, count: *mut usize) -> Status {
    // SAFETY: the importer passes an instance and a place for the number, or null.
    unsafe {
        call(component, |_| {
            *count.as_mut().ok_or(NULL)? = 0;
            Ok(())
        })
    }
}

/// There are no event indicators.
#[unsafe(no_mangle)]
extern "C" fn fmi3GetEventIndicators(component: *mut c_void, _: *mut f64, _: usize) -> Status {
    // SAFETY: the importer passes an instance or null.
    unsafe { call(component, |_| Ok(())) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3GetDirectionalDerivative(
    component: *mut c_void,
    unknowns: *const u32,
    n_unknowns: usize,
    knowns: *const u32,
    n_knowns: usize,
    seed: *const f64,
    n_seed: usize,
    result: *mut f64,
    n_result: usize,
) -> Status {
    let own = Differential {
        unknowns: (unknowns, n_unknowns),
        knowns: (knowns, n_knowns),
        seed: (seed, n_seed),
        result: (result, n_result),
    };
    // SAFETY: the importer passes an instance and arrays of these lengths, or null.
    unsafe { call(component, |instance| own.compute(instance)) }
}

/// Writes "false" to every place that is there.
///
/// # Safety
/// Each place is null or can be written.
unsafe fn lower<const N: usize>(places: [*mut bool; N]) {
    for place in places {
        // SAFETY: as promised by the caller.
        if let Some(place) = unsafe { place.as_mut() } {
            *place = false;
        }
    }
}

type Refs = *const u32;
type Out<T> = *mut T;
without! {
    fmi3EnterStepMode();
    fmi3EnterConfigurationMode();
    fmi3ExitConfigurationMode();
    fmi3EvaluateDiscreteStates();
    fmi3GetFloat32(Refs, usize, Out<f32>, usize);
    fmi3GetInt8(Refs, usize, Out<i8>, usize);
    fmi3GetUInt8(Refs, usize, Out<u8>, usize);
    fmi3GetInt16(Refs, usize, Out<i16>, usize);
    fmi3GetUInt16(Refs, usize, Out<u16>, usize);
    fmi3GetInt32(Refs, usize, Out<i32>, usize);
    fmi3GetUInt32(Refs, usize, Out<u32>, usize);
    fmi3GetInt64(Refs, usize, Out<i64>, usize);
    fmi3GetUInt64(Refs, usize, Out<u64>, usize);
    fmi3GetString(Refs, usize, Out<*const c_char>, usize);
    fmi3GetBinary(Refs, usize, Out<usize>, Out<*const u8>, usize);
    fmi3GetClock(Refs, usize, Out<bool>);
    fmi3SetFloat32(Refs, usize, *const f32, usize);
    fmi3SetInt8(Refs, usize, *const i8, usize);
    fmi3SetUInt8(Refs, usize, *const u8, usize);
    fmi3SetInt16(Refs, usize, *const i16, usize);
    fmi3SetUInt16(Refs, usize, *const u16, usize);
    fmi3SetInt32(Refs, usize, *const i32, usize);
    fmi3SetUInt32(Refs, usize, *const u32, usize);
    fmi3SetInt64(Refs, usize, *const i64, usize);
    fmi3SetUInt64(Refs, usize, *const u64, usize);
    fmi3SetString(Refs, usize, *const *const c_char, usize);
    fmi3SetBinary(Refs, usize, *const usize, *const *const u8, usize);
    fmi3SetClock(Refs, usize, *const bool);
    fmi3GetNumberOfVariableDependencies(u32, Out<usize>);
    fmi3GetVariableDependencies(u32, Out<usize>, Out<u32>, Out<usize>, Out<c_int>, usize);
    fmi3SerializedFMUStateSize(*mut c_void, Out<usize>);
    fmi3SerializeFMUState(*mut c_void, Out<u8>, usize);
    fmi3DeserializeFMUState(*const u8, usize, Out<*mut c_void>);
    fmi3GetAdjointDerivative(Refs, usize, Refs, usize, *const f64, usize, Out<f64>, usize);
    fmi3GetIntervalDecimal(Refs, usize, Out<f64>, Out<c_int>);
    fmi3GetIntervalFraction(Refs, usize, Out<u64>, Out<u64>, Out<c_int>);
    fmi3GetShiftDecimal(Refs, usize, Out<f64>);
    fmi3GetShiftFraction(Refs, usize, Out<u64>, Out<u64>);
    fmi3SetIntervalDecimal(Refs, usize, *const f64);
    fmi3SetIntervalFraction(Refs, usize, *const u64, *const u64);
    fmi3SetShiftDecimal(Refs, usize, *const f64);
    fmi3SetShiftFraction(Refs, usize, *const u64, *const u64);
    fmi3GetOutputDerivatives(Refs, usize, *const i32, Out<f64>, usize);
    fmi3ActivateModelPartition(u32, f64);
}
