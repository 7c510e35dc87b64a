//! The arguments of `domelight bench`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

pub(super) const EXAMPLES: &str = "\
Examples:
  domelight bench
      the lecture's setting: every strategy's CPU time to the same error";

/// Measure what error costs.
#[derive(Args, Debug)]
pub(crate) struct BenchArguments {
    /// What is measured
    #[arg(long, value_enum, default_value_t = Suite::Lecture)]
    pub(crate) suite: Suite,
    /// Meshes and scenes (.ply, .obj, .gltf, .glb, .toml; built-in: statue, spheres, …) [default:
    /// built-in ones]
    #[arg(long, value_name = "SCENE", num_args = 1.., help_heading = "Inputs")]
    pub(crate) meshes: Vec<String>,
    /// Embree 4, such as libembree4.so, for the suite kernels to measure against; loaded while
    /// the program runs
    #[arg(long, value_name = "LIBRARY", help_heading = "Others")]
    pub(crate) embree: Option<PathBuf>,
    /// Threads [default: SLURM_CPUS_PER_TASK, else the cores that the process may use]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) threads: Option<u32>,

    /// Print the results as JSON instead of tables
    #[arg(long, help_heading = "Output")]
    pub(crate) json: bool,
    /// Write the results as JSON to a file, too
    #[arg(short, long, value_name = "FILE.json", help_heading = "Output")]
    pub(crate) output: Option<PathBuf>,
    /// Measure nothing: print the tables of a results file as Markdown
    #[arg(long, value_name = "FILE.json", exclusive = true, help_heading = "Output")]
    pub(crate) table: Option<PathBuf>,
}

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Suite {
    /// The lecture's statue at 176x248: what its strategies cost
    Lecture,
    /// Rays a second of the ray kernel, and the build of its tree
    Kernels,
    /// Probes x meshes x materials: CPU time of each strategy to the same error
    Probes,
    /// Rigs of lights: time to extract them, and how well they shade
    Rigs,
}
