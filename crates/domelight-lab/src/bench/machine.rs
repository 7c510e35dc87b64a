//! The machine on which the results were measured.

use std::fs;

use domelight::bvh::InstructionSet;
use serde::{Deserialize, Serialize};

/// As cargo was told.
const RUSTFLAGS: &str = env!("DOMELIGHT_RUSTFLAGS");

/// The computer and the build of this program.
#[derive(Serialize, Deserialize)]
pub struct Machine {
    /// The processor; null where the system does not report it.
    pub cpu: Option<String>,
    /// Cores that the process may use.
    pub cores: usize,
    /// The one that the ray kernel runs with.
    pub instruction_set: String,
    /// What the program was built for.
    pub target: String,
    /// The compiler.
    pub rustc: String,
    /// Release or debug.
    pub profile: String,
    /// Flags beside those of the profile.
    pub rustflags: String,
    /// Processes that wanted to run in the last minute, before the first measurement; null where the system
    /// does not report it. Above 0, other programs ran beside the bench.
    pub load_average: Option<f64>,
}

impl Machine {
    /// This computer and this build.
    pub fn this() -> Self {
        Self {
            cpu: cpu(),
            cores: std::thread::available_parallelism().map_or(1, Into::into),
            instruction_set: format!("{:?}", InstructionSet::best()).to_lowercase(),
            target: env!("DOMELIGHT_TARGET").to_owned(),
            rustc: env!("DOMELIGHT_RUSTC").to_owned(),
            profile: env!("DOMELIGHT_PROFILE").to_owned(),
            rustflags: RUSTFLAGS.to_owned(),
            load_average: load_average(),
        }
    }

    /// Part of a sentence.
    pub(super) fn describe(&self) -> String {
        let Self { cpu, cores, instruction_set, .. } = self;
        let cpu = cpu.as_deref().unwrap_or("unknown processor");
        let cores = if *cores == 1 { "1 core".to_owned() } else { format!("{cores} cores") };
        format!("{cores} of {cpu}, {instruction_set}")
    }
}

/// As Linux names it; `None` elsewhere.
fn cpu() -> Option<String> {
    let info = fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = info.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

fn load_average() -> Option<f64> {
    fs::read_to_string("/proc/loadavg").ok()?.split_whitespace().next()?.parse().ok()
}
