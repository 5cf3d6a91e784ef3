//! Long calls: the interpreter's lock is given back, Ctrl-C ends them, progress is told.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// Between two looks at signals.
const LOOK_EVERY: Duration = Duration::from_millis(25);
/// How long work that was asked to stop is waited for.
const PATIENCE: Duration = Duration::from_millis(100);
/// Between two calls of a progress function.
const TELL_EVERY: Duration = Duration::from_millis(50);

/// Looks at signals and tells progress from within a run on the thread that called it.
pub(crate) struct Watch {
    progress: Option<Py<PyAny>>,
    looked: Instant,
    told: Instant,
    /// Why it broke off.
    pub(crate) raised: Option<PyErr>,
}

impl Watch {
    pub(crate) fn new(progress: Option<Py<PyAny>>) -> Self {
        let now = Instant::now();
        Self { progress, looked: now, told: now, raised: None }
    }

    /// Whether to go on at `done` of `total`.
    pub(crate) fn look(&mut self, done: f64, total: f64) -> ControlFlow<()> {
        let looks = self.looked.elapsed() >= LOOK_EVERY;
        let tells = self.progress.is_some() && self.told.elapsed() >= TELL_EVERY;
        if !looks && !tells {
            return ControlFlow::Continue(());
        }
        let result = Python::attach(|py| {
            py.check_signals()?;
            match (&self.progress, tells) {
                (Some(progress), true) => progress.call1(py, (done, total)).map(drop),
                _ => Ok(()),
            }
        });
        self.looked = Instant::now();
        if tells {
            self.told = self.looked;
        }
        self.keep(result)
    }

    /// Goes on unless an exception was raised.
    pub(crate) fn keep(&mut self, result: PyResult<()>) -> ControlFlow<()> {
        match result {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                self.raised = Some(error);
                ControlFlow::Break(())
            }
        }
    }

    /// Tells the end.
    pub(crate) fn done(&mut self, total: f64) -> PyResult<()> {
        match self.progress.take() {
            Some(progress) => Python::attach(|py| progress.call1(py, (total, total)).map(drop)),
            None => Ok(()),
        }
    }
}

/// Work on a thread of its own that looks at a flag; meanwhile this thread looks at signals.
///
/// After a signal the work has a moment to end; then nobody waits for it any more: what it finds is lost, and it writes no files.
///
/// # Errors
/// What a signal raised.
pub(crate) fn stoppable<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&(dyn Fn() -> bool + Sync)) -> T + Send + 'static,
) -> PyResult<T> {
    stoppable_telling(py, work, &mut |_| Ok(()))
}

/// As [`stoppable`]; `tell` is called now and then on this thread, and once at the end.
///
/// # Errors
/// What a signal or `tell` raised.
pub(crate) fn stoppable_telling<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&(dyn Fn() -> bool + Sync)) -> T + Send + 'static,
    tell: &mut dyn FnMut(Python<'_>) -> PyResult<()>,
) -> PyResult<T> {
    let stop = Arc::new(AtomicBool::new(false));
    let (asked, unwanted) = (stop.clone(), stop.clone());
    let (sender, receiver) = channel::<T>();
    let worker = std::thread::spawn(move || {
        let work = || work(&|| asked.load(Ordering::Relaxed));
        let found = flexarm::writing_unless(move || unwanted.load(Ordering::Relaxed), work);
        let _ = sender.send(found); // nobody may be waiting
    });
    let receiver = Mutex::new(receiver);
    let receive = |wait| receiver.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(wait);
    loop {
        match py.detach(|| receive(LOOK_EVERY)) {
            Ok(value) => {
                tell(py)?;
                return Ok(value);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => match worker.join() {
                Err(panic) => std::panic::resume_unwind(panic),
                Ok(()) => return Err(PyRuntimeError::new_err("the work ended without a result")),
            },
        }
        if let Err(raised) = py.check_signals().and_then(|()| tell(py)) {
            stop.store(true, Ordering::Relaxed);
            let _ = py.detach(|| receive(PATIENCE));
            return Err(raised);
        }
    }
}
