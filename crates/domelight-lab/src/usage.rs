//! What the process has used: CPU time and memory.

use std::ops::AddAssign;

/// CPU seconds of all threads so far; none where the system does not report them.
pub fn cpu_seconds() -> Option<f64> {
    #[cfg(unix)]
    {
        use nix::sys::resource::{UsageWho, getrusage};
        let usage = getrusage(UsageWho::RUSAGE_SELF).ok()?;
        let seconds = |t: nix::sys::time::TimeVal| t.tv_sec() as f64 + t.tv_usec() as f64 * 1e-6;
        Some(seconds(usage.user_time()) + seconds(usage.system_time()))
    }
    #[cfg(not(unix))]
    None
}

/// CPU seconds of this thread since some moment; wall-clock seconds where the system does not report them.
pub fn thread_seconds() -> f64 {
    use std::{sync::LazyLock, time::Instant};
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    #[cfg(unix)]
    {
        use nix::time::{ClockId, clock_gettime};
        if let Ok(time) = clock_gettime(ClockId::CLOCK_THREAD_CPUTIME_ID) {
            return time.tv_sec() as f64 + time.tv_nsec() as f64 * 1e-9;
        }
    }
    START.elapsed().as_secs_f64()
}

/// The most memory that was ever resident \[bytes\]; none where the system does not report it.
pub fn peak_memory() -> Option<u64> {
    // Linux hands the largest value of `getrusage` on to what a process becomes: a small program that a large one
    // starts would report the large one's memory.
    #[cfg(target_os = "linux")]
    if let Some(peak) =
        std::fs::read_to_string("/proc/self/status").ok().and_then(|s| high_water_mark(&s))
    {
        return Some(peak);
    }
    #[cfg(unix)]
    {
        use nix::sys::resource::{UsageWho, getrusage};
        let usage = getrusage(UsageWho::RUSAGE_SELF).ok()?;
        // Bytes on Apple's systems, kibibytes elsewhere.
        let unit = if cfg!(target_vendor = "apple") { 1 } else { 1024 };
        Some(usage.max_rss() as u64 * unit)
    }
    #[cfg(not(unix))]
    None
}

/// The peak of resident memory that /proc/self/status states \[bytes\].
#[cfg(target_os = "linux")]
fn high_water_mark(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

/// Wall-clock and CPU seconds between two moments.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub struct Seconds {
    /// By the clock.
    pub wall: f64,
    /// CPU seconds of all threads; none where the system does not report them.
    pub cpu: Option<f64>,
}

impl Seconds {
    /// No time.
    pub const ZERO: Self = Self { wall: 0.0, cpu: Some(0.0) };
}

impl AddAssign for Seconds {
    fn add_assign(&mut self, other: Self) {
        self.wall += other.wall;
        self.cpu = self.cpu.zip(other.cpu).map(|(a, b)| a + b);
    }
}

/// Measures one phase after another.
pub struct Stopwatch {
    wall: std::time::Instant,
    cpu: Option<f64>,
}

impl Stopwatch {
    /// From now on.
    pub fn start() -> Self {
        Self { wall: std::time::Instant::now(), cpu: cpu_seconds() }
    }

    /// The time since the start or the last lap.
    pub fn lap(&mut self) -> Seconds {
        let now = Self::start();
        let seconds = Seconds {
            wall: (now.wall - self.wall).as_secs_f64(),
            cpu: now.cpu.zip(self.cpu).map(|(now, then)| now - then),
        };
        *self = now;
        seconds
    }
}
