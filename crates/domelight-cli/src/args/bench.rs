//! The arguments of `domelight bench`.

use std::path::PathBuf;

use clap::{ArgAction, Args, ValueEnum};

use super::{finite, positive};
use domelight_lab::NamedStrategy;
use domelight_lab::bench::Suite;
use domelight_lab::job::value::Size;

pub(super) const EXAMPLES: &str = "\
Strategies are written as for compare: NAME[:OPTION]…, such as mis:3/1 or sir:15/800. Materials are written
as for render's --material; own is the scene's own. In the tables, ~ marks an extrapolated value and ≤ an
upper bound; brackets hold the range over the seeds.

Examples:
  domelight bench
      the lecture's statue: CPU time of its strategies to the quality of its SIR picture
  domelight bench --suite probes
      the built-in statue with four materials under the built-in probes
  domelight bench --suite probes --meshes bunny.ply --probes hdris/ --materials diffuse:0.8,ggx:0.2
      your mesh under all probes of a folder
  domelight bench --suite probes --case blob.ply sky.exr ggx:0.05 --case helmet.glb studio.hdr own
      cases of your choice
  domelight bench --suite probes --strategies product,mis --vs mitsuba --python venv/bin/python
      the same pictures rendered by Mitsuba 3, in turns
  domelight bench --suite felt --program ./domelight ./domelight-0.1
      what people wait for, by two versions in turns
  domelight bench --suite rigs -o rigs.json && domelight bench --table rigs.json
      results as a file, and its tables as Markdown";

/// Measure the CPU time that each strategy needs to reach a given error.
#[derive(Args, Debug)]
pub(crate) struct BenchArguments {
    /// What to measure
    #[arg(long, value_enum, default_value_t = Suite::Lecture)]
    pub(crate) suite: Suite,

    /// Meshes and scenes (.ply, .obj, .gltf, .glb, .toml; built-in: statue, spheres, …) [default: statue; for interiors,
    /// room, blinds, corridor, cage]
    #[arg(long, value_name = "SCENE", num_args = 1.., value_delimiter = ',', help_heading = "Inputs")]
    pub(crate) meshes: Vec<String>,
    /// Probes: files, folders of files, or built-in probes [default: sky, studio, cathedral]
    #[arg(long, value_name = "PROBE", num_args = 1.., value_delimiter = ',', help_heading = "Inputs")]
    pub(crate) probes: Vec<String>,
    /// Materials, separated by commas; own is the scene's own [default: diffuse:0.8, ggx:0.2:single,
    /// ggx:0.05:single, phong:50:0.5:0.5; own for glTF and scene files; for interiors, diffuse:0.7, ggx:0.2:single, and
    /// own of files]
    #[arg(long, value_name = "LIST", help_heading = "Inputs")]
    pub(crate) materials: Option<String>,
    /// Cases of these scenes, probes and materials, each a comma-separated list; may be repeated
    #[arg(long = "case", num_args = 3, action = ArgAction::Append,
          value_names = ["SCENES", "PROBES", "MATERIALS"], help_heading = "Inputs")]
    pub(crate) cases: Vec<String>,
    /// Rotate the probes about the up axis [degrees]
    #[arg(long, value_name = "DEG", default_value_t = 0.0, value_parser = finite,
          allow_negative_numbers = true, help_heading = "Inputs")]
    pub(crate) env_rotate: f32,
    /// Size of the pictures [default: 256x256; 176x248 for the lecture]
    #[arg(long, value_name = "WxH", help_heading = "Inputs")]
    pub(crate) size: Option<Size>,

    /// Strategies [default: brdf, environment, mis, sir, rejection, product; for the lecture, with its
    /// own counts]
    #[arg(long, value_name = "LIST", value_delimiter = ',', help_heading = "Measurement")]
    pub(crate) strategies: Vec<NamedStrategy>,
    /// Pictures per budget, each with its own seed
    #[arg(long, value_name = "N", default_value_t = 5, help_heading = "Measurement",
          value_parser = clap::value_parser!(u32).range(1..=256))]
    pub(crate) seeds: u32,
    /// The first seed
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = "Measurement")]
    pub(crate) seed: u64,
    /// CPU seconds that the pictures of a strategy's last budget may take in total; four times as many
    /// if an error of 1e-3 is a target and near
    #[arg(long, value_name = "SECONDS", default_value_t = 5.0, value_parser = positive,
          help_heading = "Measurement")]
    pub(crate) most: f32,
    /// Target errors (relMSE) [default: 4e-3,1e-3,1e-4; 1e-2 for the lecture]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = error,
          help_heading = "Measurement")]
    pub(crate) errors: Vec<f64>,
    /// Number of threads [default: SLURM_CPUS_PER_TASK, otherwise the cores available to the process]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024),
          help_heading = "Measurement")]
    pub(crate) threads: Option<u32>,

    /// Also measure another renderer on the same cases, in turns with this one
    #[arg(long, value_enum, help_heading = "Others")]
    pub(crate) vs: Option<Peer>,
    /// Python interpreter that has the module mitsuba
    #[arg(long, value_name = "PROGRAM", default_value = "python3", help_heading = "Others")]
    pub(crate) python: PathBuf,
    /// Programs that the suite felt measures in turns, such as an earlier version beside this one [default: this program]
    #[arg(long = "program", value_name = "PROGRAM", num_args = 1.., help_heading = "Others")]
    pub(crate) programs: Vec<PathBuf>,
    /// Embree 4, such as libembree4.so, as the peer of the suite kernels; loaded at run time
    #[arg(long, value_name = "LIBRARY", help_heading = "Others")]
    pub(crate) embree: Option<PathBuf>,

    /// Target relMSE of the references, which have at most 2048 camera samples with 4 environment and 4 BRDF samples;
    /// it is subtracted from measured errors [default: a tenth of the smallest of --errors, but at least 5e-5]
    #[arg(long, value_name = "E", value_parser = error, help_heading = "Reference")]
    pub(crate) reference_error: Option<f64>,
    /// Folder for references [default: domelight in the user's cache folder]
    #[arg(long, value_name = "FOLDER", help_heading = "Reference")]
    pub(crate) cache: Option<PathBuf>,
    /// Do not use the cache for references
    #[arg(long, help_heading = "Reference", conflicts_with = "cache")]
    pub(crate) no_cache: bool,

    /// Print the results as JSON instead of tables
    #[arg(long, help_heading = "Output")]
    pub(crate) json: bool,
    /// Also write the results as JSON to a file
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

/// Another renderer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Peer {
    /// Mitsuba 3 through its Python module: MIS with compensation and multijitter, compiled by LLVM
    Mitsuba,
}
