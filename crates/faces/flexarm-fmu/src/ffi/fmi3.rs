//! FMI 3.0, co-simulation and model exchange: the functions that an importer calls by name.
//!
//! Each passes its arguments to [`Instance`]; what has no meaning for this FMU (clocks, strings,
//! integers, events) returns an error or nothing. Not here: rules of pointers (`mod.rs`).

use std::ffi::{c_char, c_int, c_void};
use std::path::Path;
use std::ptr;

use super::{
    Component, Differential, ERROR, Logger, NULL, Status, array, call, free, free_state, get_each, instantiated,
    message, put_state, put_states, set_each, string,
};
use crate::error::FmuError;
use crate::instance::{Instance, InstanceState, Interface, StateValues};

type LogMessage = Option<unsafe extern "C" fn(*mut c_void, Status, *const c_char, *const c_char)>;

/// Logger with what it is called with.
struct Log(LogMessage, *mut c_void);

impl Logger for Log {
    fn write(&self, text: &str) {
        let Self(logger, environment) = *self;
        if let Some(log) = logger {
            let text = message(text);
            // SAFETY: the importer gave logger and environment for each other.
            unsafe { log(environment, ERROR, c"logStatusError".as_ptr(), text.as_ptr()) }
        }
    }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
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
    unsafe { opened([token, resources], Interface::ModelExchange, Log(logger, environment)) }
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
    Log(logger, environment).write("this FMU is for co-simulation and model exchange");
    ptr::null_mut()
}

/// Returns a new instance, or null after a message.
///
/// # Safety
/// Token and path of the resources are null or end with zero.
unsafe fn opened([token, resources]: [*const c_char; 2], interface: Interface, log: Log) -> *mut c_void {
    // SAFETY: as promised by the caller.
    let (Some(token), Some(resources)) = (unsafe { (string(token), string(resources)) }) else {
        log.write("token and path of the resources are needed as UTF-8");
        return ptr::null_mut();
    };
    instantiated(log, || Instance::new(Path::new(resources), token, interface))
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
        Log(logger, environment).write("this FMU has no intermediate update");
        return ptr::null_mut();
    }
    // SAFETY: the importer passes strings or null.
    unsafe { opened([token, resources], Interface::CoSimulation, Log(logger, environment)) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3FreeInstance(component: *mut c_void) {
    // SAFETY: the importer frees an instance once.
    unsafe { free(component.cast::<Component<Log>>()) }
}

type Refs = *const u32;
type Out<T> = *mut T;

functions! {
    fmi3SetDebugLogging(_on: bool, _n: usize, _categories: *const *const c_char) = |_| Ok(());
    fmi3EnterInitializationMode(
        _has_tolerance: bool, _tolerance: f64, begin_s: f64, _has_end: bool, _end_s: f64
    ) = |instance| {
        instance.set_begin(begin_s)?;
        instance.enter_initialisation()
    };
    fmi3ExitInitializationMode() = Instance::exit_initialisation;
    fmi3Terminate() = Instance::terminate;
    fmi3Reset() = |instance| {
        instance.reset();
        Ok(())
    };
    fmi3GetFloat64(references: Refs, n: usize, values: Out<f64>, n_values: usize) = |instance| {
        lengths(n, n_values)?;
        get_each(references, values, n, |reference| instance.get(reference))
    };
    fmi3SetFloat64(references: Refs, n: usize, values: *const f64, n_values: usize) = |instance| {
        lengths(n, n_values)?;
        set_each(references, values, n, |reference, value| instance.set(reference, value))
    };
    fmi3GetBoolean(references: Refs, n: usize, values: Out<bool>, n_values: usize) = |instance| {
        lengths(n, n_values)?;
        get_each(references, values, n, |reference| instance.get_flag(reference))
    };
    fmi3SetBoolean(references: Refs, n: usize, values: *const bool, n_values: usize) = |instance| {
        lengths(n, n_values)?;
        set_each(references, values, n, |reference, value| instance.set_flag(reference, value))
    };
    fmi3GetFMUState(state: Out<*mut c_void>) = |instance| put_state(state, instance.state()?);
    fmi3SetFMUState(state: *mut c_void) =
        |instance| instance.restore(state.cast::<InstanceState>().as_ref().ok_or(NULL)?);
    fmi3FreeFMUState(state: Out<*mut c_void>) = |_| free_state(state);
    fmi3DoStep(
        from_s: f64, length_s: f64, _no_return: bool,
        event: Out<bool>, terminate: Out<bool>, early: Out<bool>, last_s: Out<f64>
    ) = |instance| {
        lower([event, terminate, early]);
        let done = instance.step(from_s, length_s);
        if let Some(last_s) = last_s.as_mut() {
            *last_s = instance.time_s();
        }
        done
    };
    fmi3EnterEventMode() = Instance::enter_event_mode;
    fmi3EnterContinuousTimeMode() = Instance::enter_continuous_time_mode;
    fmi3UpdateDiscreteStates(
        again: Out<bool>, terminate: Out<bool>, nominals_changed: Out<bool>, states_changed: Out<bool>,
        has_next: Out<bool>, _next_s: Out<f64>
    ) = |instance| {
        lower([again, terminate, nominals_changed, states_changed, has_next]);
        instance.update_discrete_states()
    };
    fmi3CompletedIntegratorStep(_final: bool, event: Out<bool>, terminate: Out<bool>) = |instance| {
        lower([event, terminate]);
        instance.complete_step()
    };
    fmi3SetTime(time_s: f64) = |instance| instance.set_time(time_s);
    fmi3SetContinuousStates(states: *const f64, n: usize) =
        |instance| instance.set_states(array(states, n).ok_or(NULL)?);
    fmi3GetContinuousStates(states: Out<f64>, n: usize) =
        |instance| put_states(instance, StateValues::States, states, n);
    fmi3GetContinuousStateDerivatives(slopes: Out<f64>, n: usize) =
        |instance| put_states(instance, StateValues::Derivatives, slopes, n);
    fmi3GetNominalsOfContinuousStates(nominals: Out<f64>, n: usize) =
        |instance| put_states(instance, StateValues::Nominals, nominals, n);
    fmi3GetNumberOfContinuousStates(count: Out<usize>) = |instance| {
        *count.as_mut().ok_or(NULL)? = instance.n_states();
        Ok(())
    };
    fmi3GetNumberOfEventIndicators(count: Out<usize>) = |_| {
        *count.as_mut().ok_or(NULL)? = 0;
        Ok(())
    };
    /// There are no event indicators.
    fmi3GetEventIndicators(_indicators: Out<f64>, _n: usize) = |_| Ok(());
    fmi3GetDirectionalDerivative(
        unknowns: Refs, n_unknowns: usize, knowns: Refs, n_knowns: usize,
        seed: *const f64, n_seed: usize, result: Out<f64>, n_result: usize
    ) = |instance| Differential {
        unknowns: (unknowns, n_unknowns),
        knowns: (knowns, n_knowns),
        seed: (seed, n_seed),
        result: (result, n_result),
    }.compute(instance);
}

/// Checks that there is a value for each reference; all variables are scalars.
fn lengths(references: usize, values: usize) -> Result<(), FmuError> {
    match references == values {
        true => Ok(()),
        false => Err(FmuError::Order { function: "a getter or setter", phase: "with another number of values" }),
    }
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
