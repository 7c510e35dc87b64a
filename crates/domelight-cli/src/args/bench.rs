//! The arguments of `domelight bench`.

use std::path::PathBuf;

use clap::{ArgAction, Args, ValueEnum};

use super::{finite, positive};
use crate::parse::Size;
use domelight_lab::NamedStrategy;

pub(super) const EXAMPLES: &str = "\
Strategies are written as for compare: NAME[:OPTION]…, such as mis:3/1 or sir:15/800. Materials are those
of render's --material, or own for the scene's own. In the tables ~ stands before what was extrapolated and
≤ before what is cheaper still; in brackets is the range over the seeds.

Examples:
  domelight bench
      the lecture's statue: CPU time of its strategies to the quality of its SIR picture
  domelight bench --suite probes
      the built-in statue of four materials under the built-in probes
  domelight bench --suite probes --meshes bunny.ply --probes hdris/ --materials diffuse:0.8,ggx:0.2
      your mesh under all probes of a folder
  domelight bench --suite probes --case blob.ply sky.exr ggx:0.05 --case helmet.glb studio.hdr own
      cases of your choice
  domelight bench --suite probes --strategies product,mis --vs mitsuba --python venv/bin/python
      the same pictures by Mitsuba 3, in turn
  domelight bench --suite rigs -o rigs.json && domelight bench --table rigs.json
      results as a file, and its tables as Markdown";

/// Measure what error costs.
#[derive(Args, Debug)]
pub(crate) struct BenchArguments {
    /// What is measured
    #[arg(long, value_enum, default_value_t = Suite::Lecture)]
    pub(crate) suite: Suite,

    /// Meshes and scenes (.ply, .obj, .gltf, .glb, .toml; built-in: statue, spheres, …) [default:
    /// statue]
    #[arg(long, value_name = "SCENE", num_args = 1.., value_delimiter = ',', help_heading = "Inputs")]
    pub(crate) meshes: Vec<String>,
    /// Probes: files, folders of them, built-in ones [default: sky, studio, cathedral]
    #[arg(long, value_name = "PROBE", num_args = 1.., value_delimiter = ',', help_heading = "Inputs")]
    pub(crate) probes: Vec<String>,
    /// Materials, separated by commas; own is the scene's own [default: diffuse:0.8, ggx:0.2, ggx:0.05,
    /// phong:50:0.5:0.5; of glTF and scene files own]
    #[arg(long, value_name = "LIST", help_heading = "Inputs")]
    pub(crate) materials: Option<String>,
    /// Cases of these scenes, probes and materials, each a list with commas; may be given several times
    #[arg(long = "case", num_args = 3, action = ArgAction::Append,
          value_names = ["SCENES", "PROBES", "MATERIALS"], help_heading = "Inputs")]
    pub(crate) cases: Vec<String>,
    /// Turn the probes about the up axis [degrees]
    #[arg(long, value_name = "DEG", default_value_t = 0.0, value_parser = finite,
          allow_negative_numbers = true, help_heading = "Inputs")]
    pub(crate) env_rotate: f32,
    /// Size of the pictures [default: 256x256, of the lecture 176x248]
    #[arg(long, value_name = "WxH", help_heading = "Inputs")]
    pub(crate) size: Option<Size>,

    /// Strategies [default: brdf, environment, mis, sir, rejection, product; of the lecture its own
    /// counts]
    #[arg(long, value_name = "LIST", value_delimiter = ',', help_heading = "Measurement")]
    pub(crate) strategies: Vec<NamedStrategy>,
    /// Pictures at each budget, each of another seed
    #[arg(long, value_name = "N", default_value_t = 5, help_heading = "Measurement",
          value_parser = clap::value_parser!(u32).range(1..=256))]
    pub(crate) seeds: u32,
    /// The first seed
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = "Measurement")]
    pub(crate) seed: u64,
    /// CPU seconds that the pictures of a strategy's last budget may take together; four times as many
    /// where an error of 1e-3 is wanted and near
    #[arg(long, value_name = "SECONDS", default_value_t = 5.0, value_parser = positive,
          help_heading = "Measurement")]
    pub(crate) most: f32,
    /// The errors (relMSE) that strategies are to reach [default: 4e-3,1e-3,1e-4; of the lecture 1e-2]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = error,
          help_heading = "Measurement")]
    pub(crate) errors: Vec<f64>,
    /// Threads [default: SLURM_CPUS_PER_TASK, else the cores that the process may use]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024),
          help_heading = "Measurement")]
    pub(crate) threads: Option<u32>,

    /// Measure another renderer on the same cases, in turn with this one
    #[arg(long, value_enum, help_heading = "Others")]
    pub(crate) vs: Option<Peer>,
    /// The Python whose module mitsuba is used
    #[arg(long, value_name = "PROGRAM", default_value = "python3", help_heading = "Others")]
    pub(crate) python: PathBuf,
    /// Embree 4, such as libembree4.so, for the suite kernels to measure against; loaded while
    /// the program runs
    #[arg(long, value_name = "LIBRARY", help_heading = "Others")]
    pub(crate) embree: Option<PathBuf>,

    /// The relMSE of the converged pictures, if 2048 camera samples of 4 environment and 4 BRDF samples suffice;
    /// it is taken off what is measured against them [default: a tenth of the least of --errors, but 5e-5 or more]
    #[arg(long, value_name = "E", value_parser = error, help_heading = "Reference")]
    pub(crate) reference_error: Option<f64>,
    /// Where references are kept [default: domelight in the user's cache folder]
    #[arg(long, value_name = "FOLDER", help_heading = "Reference")]
    pub(crate) cache: Option<PathBuf>,
    /// Neither look for references in the cache nor keep them
    #[arg(long, help_heading = "Reference", conflicts_with = "cache")]
    pub(crate) no_cache: bool,

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

/// A relMSE.
fn error(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("not a number above 0".into()),
    }
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

/// Another renderer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Peer {
    /// Mitsuba 3, its module for Python: MIS with compensation and multijitter, compiled by LLVM
    Mitsuba,
}
