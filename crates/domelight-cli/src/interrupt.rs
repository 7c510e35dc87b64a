//! Ctrl-C: the first asks the work to end with what is done, the second ends the process; while there is nothing
//! to keep, so does the first.

use std::process::exit;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::thread;
use std::time::Duration;

use anyhow::{Result, bail};

use crate::error::status;

/// The shell's code for what Ctrl-C has ended.
pub(crate) const ENDED: i32 = 130;

/// EX_TEMPFAIL of sysexits.h: run the same again.
pub(crate) const RUN_AGAIN: i32 = 75;

static RAISED: AtomicBool = AtomicBool::new(false);

/// How the first Ctrl-C ends the process: the exit code, and what is said. None while there is something to keep.
static ENDS: Mutex<Option<(i32, &str)>> = Mutex::new(None);

/// The flag that the first Ctrl-C (or SIGTERM) raises. Installs the handler on the first call.
///
/// Where no handler can be installed the flag stays down and the system's own action holds.
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

/// While this lives the first Ctrl-C ends the process too.
pub(crate) struct EndsAtOnce(Option<(i32, &'static str)>);

/// From now on there is nothing to keep, for what reads a pipe or builds a tree looks at no flag; `code` is the exit code
/// of a process that is ended so.
pub(crate) fn nothing_to_keep(code: i32) -> EndsAtOnce {
    EndsAtOnce::new(code, "before the first sample; nothing was written")
}

/// From now on a pipe is waited for at its other end.
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

/// Runs what may wait for a pipe or a device, and waits no longer once Ctrl-C was pressed.
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
