//! How the engine is called: without holding the interpreter, in a pool of threads of its own, interruptible, and with
//! panics as exceptions.
//!
//! Every call has its own pool: a pool that outlives the call would be dead after `fork`, and the child would wait
//! for it forever.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::ThreadPool;

use crate::error::{bad_value, from_panic};

/// How often a waiting call looks for signals and reports progress.
const POLL: Duration = Duration::from_millis(10);

/// Threads of a pool: as many as asked for, else the cores that the process may use.
pub(crate) fn n_threads(asked: Option<usize>) -> PyResult<usize> {
    match asked {
        Some(n) if (1..=1024).contains(&n) => Ok(n),
        Some(n) => Err(bad_value(format!("threads is {n}; it must be from 1 to 1024"))),
        None => Ok(std::thread::available_parallelism().map_or(1, std::num::NonZero::get)),
    }
}

/// A pool of threads.
pub(crate) fn pool(n_threads: usize) -> PyResult<ThreadPool> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build();
    pool.map_err(|error| PyRuntimeError::new_err(format!("cannot start the threads: {error}")))
}

/// Computes without holding the interpreter, on the calling thread.
pub(crate) fn alone<T: Send>(py: Python<'_>, f: impl FnOnce() -> T + Send) -> PyResult<T> {
    py.detach(|| caught(f))
}

/// Computes without holding the interpreter, on all cores.
pub(crate) fn parallel<T: Send>(py: Python<'_>, f: impl FnOnce() -> T + Send) -> PyResult<T> {
    parallel_on(py, None, f)
}

/// Computes without holding the interpreter, on as many threads as asked for, else on all cores.
pub(crate) fn parallel_on<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    f: impl FnOnce() -> T + Send,
) -> PyResult<T> {
    let n = n_threads(threads)?;
    py.detach(|| {
        let pool = pool(n)?;
        caught(|| pool.install(f))
    })
}

/// The result, or the panic as an exception.
pub(crate) fn caught<T>(f: impl FnOnce() -> T) -> PyResult<T> {
    catch_unwind(AssertUnwindSafe(f)).map_err(|panic| from_panic(&*panic))
}

/// Waits for a result; to be called without holding the interpreter. A signal raises `cancel`, whereupon the result is
/// expected soon; the second value is then the exception that the signal's handler raised. `progress` is called
/// meanwhile.
pub(crate) fn wait<T>(
    results: &Receiver<T>,
    cancel: &AtomicBool,
    progress: &dyn Fn(Python<'_>) -> PyResult<()>,
) -> PyResult<(T, Option<PyErr>)> {
    let mut stopped = None;
    loop {
        match results.recv_timeout(POLL) {
            Ok(result) => return Ok((result, stopped)),
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err("the render has ended with an error"));
            }
            Err(RecvTimeoutError::Timeout) if stopped.is_none() => {
                let checked = Python::attach(|py| {
                    py.check_signals()?;
                    progress(py)
                });
                if let Err(error) = checked {
                    cancel.store(true, Ordering::Relaxed);
                    stopped = Some(error);
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
    }
}
