//! The clock of the process.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

static START: OnceLock<Instant> = OnceLock::new();

/// When the process began; the first call, which `main` makes, decides.
pub(crate) fn start() -> Instant {
    *START.get_or_init(Instant::now)
}

/// The time since the process began.
pub(crate) fn elapsed() -> Duration {
    start().elapsed()
}

/// The same as a number \[ms\].
pub(crate) fn milliseconds() -> f64 {
    1000.0 * elapsed().as_secs_f64()
}
