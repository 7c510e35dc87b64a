//! Benchmarks: the CPU time that strategies need to reach a given error.

mod bench_run;
mod bound;
mod cases;
mod embree;
mod felt;
mod fit;
mod interiors;
mod kernels;
mod machine;
mod mitsuba;
mod ply;
mod renders;
mod results;
mod rigs;
mod table;

use std::path::PathBuf;

use clap::ValueEnum;
pub use machine::Machine;
pub use results::Results;
pub use table::Table;

use crate::measure::Cache;
use crate::{Error, Host, NamedStrategy};
use results::Rows;

/// A set of measurements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Suite {
    /// The lecture's statue at 176x248: the cost of its strategies
    Lecture,
    /// Rays per second of the ray kernel, and the time to build its BVH
    Kernels,
    /// Probes x meshes x materials: CPU time of each strategy to reach the same error
    Probes,
    /// Rooms with windows: error times rays and time, with portals and without
    Interiors,
    /// Light rigs: the time to extract them, and their shading error
    Rigs,
    /// What people wait for: first pictures, large files, rigs, a comparison; by several versions in turns
    Felt,
}

impl Suite {
    /// The name on the command line.
    pub fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }
}

/// Another renderer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Peer {
    /// Mitsuba 3, its module for Python: MIS with compensation and multijitter, compiled by LLVM.
    Mitsuba {
        /// The Python whose module is used.
        python: PathBuf,
    },
}

/// What is measured, and how. Empty lists stand for the suite's own.
#[derive(Clone, Debug)]
pub struct BenchSettings {
    /// What is measured.
    pub suite: Suite,
    /// Scenes.
    pub meshes: Vec<String>,
    /// Probes: files, folders of them, built-in ones.
    pub probes: Vec<String>,
    /// Materials, separated by commas.
    pub materials: Option<String>,
    /// Threes of scenes, probes and materials, each a list with commas.
    pub cases: Vec<String>,
    /// Turn the probes about the up axis \[degrees\].
    pub rotate: f32,
    /// Width and height of the pictures \[pixels\].
    pub size: Option<[usize; 2]>,
    /// The strategies to measure.
    pub strategies: Vec<NamedStrategy>,
    /// Pictures at each budget.
    pub n_seeds: u32,
    /// The first seed.
    pub seed: u64,
    /// CPU seconds that the pictures of a strategy's last budget may take together.
    pub most: f32,
    /// The errors (relMSE) that strategies are to reach.
    pub errors: Vec<f64>,
    /// Another renderer on the same cases.
    pub vs: Option<Peer>,
    /// The programs that the suite `felt` measures in turns; by default, this one.
    pub programs: Vec<PathBuf>,
    /// Embree 4's library, for the suite `kernels` to measure against.
    pub embree: Option<PathBuf>,
    /// The relMSE of converged pictures.
    pub reference_error: Option<f64>,
    /// Where references are kept.
    pub cache: Option<Cache>,
    /// What makes the results again; for people.
    pub command: String,
}

/// Measures. What is done is in the results, whatever ended the work; then comes what ended it.
pub fn run(settings: &BenchSettings, host: &dyn Host) -> (Results, Result<(), Error>) {
    let bench = Bench { settings, host };
    let mut results = Results::new(settings.suite, &settings.command);
    let done = bench.measure(&mut results.rows);
    results.complete = done.is_ok();
    (results, done)
}

/// Tells the host which files will be read.
///
/// # Errors
/// If one must not be, or a folder has no probes.
pub fn declare(settings: &BenchSettings, host: &dyn Host) -> Result<(), Error> {
    cases::declare(settings, host)
}

/// What all suites share.
struct Bench<'a> {
    settings: &'a BenchSettings,
    host: &'a dyn Host,
}

impl Bench<'_> {
    fn measure(&self, rows: &mut Rows) -> Result<(), Error> {
        match rows {
            Rows::Lecture(rows) => renders::run_lecture(self, rows),
            Rows::Kernels(rows) => kernels::run(self, rows),
            Rows::Probes(rows) => renders::run_probes(self, rows),
            Rows::Interiors(rows) => interiors::run(self, rows),
            Rows::Rigs(rows) => rigs::run(self, rows),
            Rows::Felt(rows) => felt::run(self, rows),
        }
    }
}
