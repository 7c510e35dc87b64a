//! Exceptions of Python functions that the engine calls where it cannot propagate them.

use std::cell::RefCell;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::prelude::*;

/// The first exception raised during a call of the engine. A call that failed has no result.
#[derive(Debug, Default)]
pub(crate) struct Failure {
    failed: AtomicBool,
    error: Mutex<Option<PyErr>>,
    canceled: AtomicBool,
    cut_short: AtomicBool,
}

thread_local! {
    /// The failure of the call that this thread works for.
    static OF_THREAD: RefCell<Option<Arc<Failure>>> = const { RefCell::new(None) };
}

impl Failure {
    /// Makes the calling thread, one of a pool, report here.
    pub(crate) fn watch_thread(self: &Arc<Self>) {
        OF_THREAD.set(Some(self.clone()));
    }

    /// Keeps an exception, unless there was one before.
    pub(crate) fn report(&self, error: PyErr) {
        let mut kept = self.error.lock().unwrap_or_else(PoisonError::into_inner);
        if !self.failed.swap(true, Ordering::Relaxed) {
            *kept = Some(error);
        }
    }

    /// Whether there was an exception, taken or not.
    pub(crate) fn has_failed(&self) -> bool {
        self.failed.load(Ordering::Relaxed)
    }

    /// The flag that cancels the call: the engine stops soon, and Python functions are no longer called.
    pub(crate) fn canceled(&self) -> &AtomicBool {
        &self.canceled
    }

    /// Whether the call is to end: it failed or is canceled.
    pub(crate) fn is_over(&self) -> bool {
        self.has_failed() || self.canceled.load(Ordering::Relaxed)
    }

    /// Whether a Python function was not called because the call was canceled.
    pub(crate) fn has_cut_short(&self) -> bool {
        self.cut_short.load(Ordering::Relaxed)
    }

    /// Begins a call that continues a canceled one.
    pub(crate) fn resume(&self) {
        self.canceled.store(false, Ordering::Relaxed);
        self.cut_short.store(false, Ordering::Relaxed);
    }

    /// The exception, once.
    pub(crate) fn take(&self) -> Option<PyErr> {
        self.error.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// Calls Python for the engine's current call. Returns `None` if the function raises, whose exception it keeps, if one has
/// raised before, or if the call is canceled.
pub(crate) fn or_report<T>(call: impl FnOnce(Python<'_>) -> PyResult<T>) -> Option<T> {
    let failure = OF_THREAD.with_borrow(Clone::clone);
    let failure = failure.expect("Python functions are called in a job's pool");
    if failure.has_failed() {
        return None;
    }
    if failure.canceled.load(Ordering::Relaxed) {
        failure.cut_short.store(true, Ordering::Relaxed);
        return None;
    }
    Python::attach(call).map_err(|error| failure.report(error)).ok()
}
