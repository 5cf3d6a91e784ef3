//! Library errors as exceptions, by cause. The classes are defined in Python (`flexarm/errors.py`),
//! since they have two base classes.

use flexarm::compensate::CompensateError;
use flexarm::errors::NewError;
use flexarm::identify::IdentifyFileError;
use flexarm::map::MapError;
use flexarm::{Error, Fault};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyType;

/// Class name of an error.
fn class(error: &Error) -> &'static str {
    match error {
        Error::File { .. } | Error::Taken { .. } => "FileError",
        Error::InStudy { source, .. } => class(source),
        Error::Several(faults) => faults.first().map_or("InputError", class),
        // Tables of numbers have no page of their own.
        Error::RobotFile(fault) if fault.page.is_empty() => "FileError",
        Error::RobotFile(_) | Error::Flex(_) | Error::NoTcp { .. } | Error::UnknownTcp { .. } => "RobotError",
        Error::Urdf(_) | Error::Model { .. } => "UrdfError",
        Error::Trajectory(_) | Error::Program(_) | Error::Path { .. } | Error::Motion(_) => "MotionError",
        Error::Limits { .. } => "LimitsError",
        Error::Value(_) => "SettingError",
        Error::Modelling(_) => "ModellingError",
        Error::Pose(_) | Error::Loop { .. } => "PoseError",
        Error::Load(_) => "LoadError",
        Error::External(_) => class_of_study(error),
        Error::Recording(_) => "RecordingError",
        Error::Link(_) => "LinkError",
        Error::Write { .. } | Error::Log(_) => "WriteError",
        Error::Step { .. } => "StepError",
        Error::Interrupted { .. } => "Stopped",
        _ => "InputError",
    }
}

/// Class name of an error of a study.
fn class_of_study(error: &Error) -> &'static str {
    match error {
        _ if error.external::<NewError>().is_some() => "RobotError",
        _ if error.external::<IdentifyFileError>().is_some() => "IdentifyError",
        _ if error.external::<CompensateError>().is_some() => "CompensateError",
        _ if error.external::<MapError>().is_some() => "MapError",
        _ => "InputError",
    }
}

/// Creates the exception for an error.
pub(crate) fn exception(error: Error) -> PyErr {
    let fault = error.fault();
    let mut message = error.to_string();
    let mut source = std::error::Error::source(&error);
    while let Some(cause) = source {
        let text = cause.to_string();
        if !message.contains(&text) {
            message = format!("{message}\nbecause: {text}");
        }
        source = cause.source();
    }
    let named = class(&error);
    // A step that cannot start is bad input, as is a file that is not a recording.
    let class = match (fault, named) {
        (Fault::Input, "StepError" | "WriteError") => "InputError",
        (Fault::Run, "StepError" | "WriteError" | "Stopped") => named,
        (Fault::Run, _) => "RunError",
        (Fault::Input, _) => named,
    };
    Python::attach(|py| raised(py, class, message))
}

/// Creates an exception of a class of `flexarm.errors`.
pub(crate) fn raised(py: Python<'_>, class: &str, message: String) -> PyErr {
    let made = || -> PyResult<PyErr> {
        let class = py.import("flexarm.errors")?.getattr(class)?.cast_into::<PyType>()?;
        // Python prints uncaught messages without escaping.
        Ok(PyErr::from_type(class, flexarm::settings::written::message(&message)))
    };
    made().unwrap_or_else(|error| error)
}

/// Converts library results to Python results.
pub(crate) trait OrRaise<T> {
    /// Returns the value, or the exception.
    fn or_raise(self) -> PyResult<T>;
}

impl<T, E: Into<Error>> OrRaise<T> for Result<T, E> {
    fn or_raise(self) -> PyResult<T> {
        self.map_err(|error| exception(error.into()))
    }
}

/// Error of results that exist only for a single pose.
pub(crate) fn only_for_one(what: &str) -> PyErr {
    PyRuntimeError::new_err(format!("{what} is available for a single pose only"))
}
