//! Ctrl-C: the first asks the work to end with what is done, the second ends the process; while there is nothing
//! to keep, so does the first.

use std::process::exit;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};

use crate::failure::tell;

/// The shell's code for what Ctrl-C has ended.
pub(crate) const ENDED: i32 = 130;

/// EX_TEMPFAIL of sysexits.h: run the same again.
pub(crate) const RUN_AGAIN: i32 = 75;

/// The exit code while there is nothing to keep; 0 when there is.
static NOTHING_TO_KEEP: AtomicI32 = AtomicI32::new(0);

/// The flag that the first Ctrl-C (or SIGTERM) raises. Installs the handler on the first call.
///
/// Where no handler can be installed the flag stays down and the system's own action holds.
pub(crate) fn flag() -> &'static AtomicBool {
    static FLAG: AtomicBool = AtomicBool::new(false);
    static INSTALLED: OnceLock<bool> = OnceLock::new();
    INSTALLED.get_or_init(|| {
        ctrlc::set_handler(|| {
            if FLAG.swap(true, Ordering::SeqCst) {
                exit(ENDED);
            }
            let code = NOTHING_TO_KEEP.load(Ordering::SeqCst);
            if code != 0 {
                tell("error: interrupted before the first sample; nothing was written");
                exit(code);
            }
        })
        .is_ok()
    });
    &FLAG
}

/// While this lives the first Ctrl-C ends the process too: what reads a pipe or builds a tree looks at no flag.
pub(crate) struct NothingToKeep(());

/// From now on there is nothing to keep; `code` is the exit code of a process that is ended so.
pub(crate) fn nothing_to_keep(code: i32) -> NothingToKeep {
    NOTHING_TO_KEEP.store(code, Ordering::SeqCst);
    NothingToKeep(())
}

impl Drop for NothingToKeep {
    fn drop(&mut self) {
        NOTHING_TO_KEEP.store(0, Ordering::SeqCst);
    }
}
