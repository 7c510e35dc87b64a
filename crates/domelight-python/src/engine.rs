//! Calls the engine: without holding the interpreter, in its own thread pool, interruptible, and with panics converted
//! to exceptions.
//!
//! Every call has its own pool, because a pool that outlives the call would be dead after `fork`, and the child would
//! wait for it forever.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::ThreadPool;

use crate::error::{bad_value, from_panic};
use crate::failure::Failure;

/// The interval at which a waiting call checks for signals and reports progress.
const POLL: Duration = Duration::from_millis(10);

/// The number of threads of a pool: the requested number, otherwise the cores available to the process.
pub(crate) fn n_threads(asked: Option<usize>) -> PyResult<usize> {
    match asked {
        Some(n) if (1..=1024).contains(&n) => Ok(n),
        Some(n) => Err(bad_value(format!("threads is {n}; it must be from 1 to 1024"))),
        None => Ok(std::thread::available_parallelism().map_or(1, std::num::NonZero::get)),
    }
}

/// A thread pool whose threads report exceptions of Python functions to `failure`.
pub(crate) fn pool(n_threads: usize, failure: &Arc<Failure>) -> PyResult<ThreadPool> {
    let failure = failure.clone();
    let builder = rayon::ThreadPoolBuilder::new().num_threads(n_threads);
    let pool = builder.start_handler(move |_| failure.watch_thread()).build();
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

/// Computes without holding the interpreter, on the requested number of threads, otherwise on all cores.
pub(crate) fn parallel_on<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    f: impl FnOnce() -> T + Send,
) -> PyResult<T> {
    let n = n_threads(threads)?;
    py.detach(|| {
        let failure = Arc::new(Failure::default());
        let pool = pool(n, &failure)?;
        let result = caught(|| pool.install(f));
        failure.take().map_or(result, Err)
    })
}

/// Computes without holding the interpreter, on all cores, until a signal's handler raises. The computation, which cannot
/// end early, then finishes in the background, and its result is dropped.
pub(crate) fn abandonable<T: Send + 'static>(
    py: Python<'_>,
    f: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let pool = pool(n_threads(None)?, &Arc::default())?;
    abandonable_on(py, pool, f)
}

/// [`abandonable`] in a pool.
pub(crate) fn abandonable_on<T: Send + 'static>(
    py: Python<'_>,
    pool: ThreadPool,
    f: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    py.detach(|| {
        let (sender, results) = mpsc::channel();
        std::thread::spawn(move || {
            // Nobody receives it after a signal.
            let _ = sender.send(caught(|| pool.install(f)));
        });
        loop {
            match results.recv_timeout(POLL) {
                Ok(result) => return result,
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(PyRuntimeError::new_err("the computation has ended with an error"));
                }
                Err(RecvTimeoutError::Timeout) => {
                    Python::attach(|py: Python<'_>| py.check_signals())?;
                }
            }
        }
    })
}

/// Returns the result, or a panic as an exception.
pub(crate) fn caught<T>(f: impl FnOnce() -> T) -> PyResult<T> {
    catch_unwind(AssertUnwindSafe(f)).map_err(|panic| from_panic(&*panic))
}

/// Waits for a result; call it without holding the interpreter. A signal sets `cancel`, after which the result is
/// expected soon; the second value is then the exception that the signal's handler raised. `progress` is called
/// periodically.
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
