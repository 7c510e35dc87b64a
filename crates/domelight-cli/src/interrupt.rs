//! Ctrl-C: the first asks the work to stop and keep its results, and the second ends the process. While there is nothing to
//! keep, the first ends the process too.

use std::process::exit;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::thread;
use std::time::Duration;

use anyhow::{Result, bail};

use crate::error::status;

/// The shell's exit code after Ctrl-C.
pub(crate) const ENDED: i32 = 130;

/// EX_TEMPFAIL of sysexits.h: retry.
pub(crate) const RUN_AGAIN: i32 = 75;

static RAISED: AtomicBool = AtomicBool::new(false);

/// How the first Ctrl-C ends the process: the exit code and the message. `None` while there is something to keep.
static ENDS: Mutex<Option<(i32, &str)>> = Mutex::new(None);

/// The flag that the first Ctrl-C (or SIGTERM) raises. Installs the handler on the first call.
///
/// If no handler can be installed, the flag is never raised and the system's default action applies.
pub(crate) fn flag() -> &'static AtomicBool {
    static INSTALLED: OnceLock<bool> = OnceLock::new();
    INSTALLED.get_or_init(|| {
        ctrlc::set_handler(|| {
            if RAISED.swap(true, Ordering::SeqCst) {
                exit(ENDED);
            }
            let ends = *ENDS.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some((code, why)) = ends {
                status(&format!("error: interrupted {why}"));
                exit(code);
            }
        })
        .is_ok()
    });
    &RAISED
}

/// While this value lives, the first Ctrl-C ends the process.
pub(crate) struct EndsAtOnce(Option<(i32, &'static str)>);

/// From now on there is nothing to keep, for what reads a pipe or builds a tree looks at no flag; `code` is the exit code
/// of a process that is ended so.
pub(crate) fn nothing_to_keep(code: i32) -> EndsAtOnce {
    EndsAtOnce::new(code, "before the first sample; nothing was written")
}

/// From now on, the process waits for the other end of a pipe.
pub(crate) fn while_waiting() -> EndsAtOnce {
    EndsAtOnce::new(ENDED, "while waiting for the other end of a pipe")
}

impl EndsAtOnce {
    fn new(code: i32, why: &'static str) -> Self {
        let mut ends = ENDS.lock().unwrap_or_else(PoisonError::into_inner);
        Self(ends.replace((code, why)))
    }
}

impl Drop for EndsAtOnce {
    fn drop(&mut self) {
        *ENDS.lock().unwrap_or_else(PoisonError::into_inner) = self.0;
    }
}

/// Runs work that may block on a pipe or a device, and stops waiting after Ctrl-C.
///
/// # Errors
/// If it was; what waits is left behind.
pub(crate) fn unless_interrupted<T: Send + 'static>(
    name: &str,
    wait: impl FnOnce() -> T + Send + 'static,
) -> Result<T> {
    const PAUSE: Duration = Duration::from_millis(20);
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || drop(sender.send(wait())));
    loop {
        match receiver.recv_timeout(PAUSE) {
            Ok(done) => return Ok(done),
            Err(RecvTimeoutError::Disconnected) => bail!("{name}: reading it failed"),
            Err(RecvTimeoutError::Timeout) if RAISED.load(Ordering::SeqCst) => {
                bail!("{name}: interrupted while waiting for it")
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
    }
}
