//! The arguments of `domelight render`.

use clap::{Args, ValueEnum};

use domelight_lab::display;
use domelight_lab::job::{Given, Job};

use super::ThreadArguments;
use super::render_run::RenderRunArguments;
use super::turntable::TurntableArguments;
use crate::output::PicturePath;

pub(super) const EXAMPLES: &str = "\
Examples:
  domelight render
      the built-in statue under the built-in sky, into domelight.exr and domelight.png
  domelight render bunny.ply --env studio.hdr --material ggx:0.2 --ground -o bunny.png
      your mesh under your HDRI
  domelight render scene.toml --strategy mis:3:1 --spp 256 -o out.exr -o out.png
      a scene file, three environment samples per BRDF sample
  domelight render robot.glb --env studio.hdr --view three-quarter --env-rotate auto --ground shadow
      a three-quarter view, lit from the left, with its shadow on the map
  domelight render robot.glb --env studio.hdr --turntable 36 -o robot.png
      robot.0000.png to robot.0035.png, once around the robot
  domelight render spheres --env cathedral --strategy brdf:4 --json > stats.json
      another built-in scene, with its statistics as JSON
  domelight render --spp 4096 --checkpoint long.exr
  domelight render --spp 4096 --resume long.exr
      a long render that survives interruptions
  domelight render --shard 0/8 -o part-0.exr
      one of eight parts; `domelight merge part-*.exr -o whole.exr` merges them";

/// Render a scene lit by an HDR environment.
#[derive(Args, Debug)]
pub(crate) struct RenderArguments {
    #[command(flatten)]
    pub(crate) given: Given,
    #[command(flatten)]
    pub(crate) job: Job,
    #[command(flatten)]
    pub(crate) threads: ThreadArguments,
    #[command(flatten)]
    pub(crate) render_run: RenderRunArguments,
    #[command(flatten)]
    pub(crate) turntable: TurntableArguments,
    #[command(flatten)]
    pub(crate) output: OutputArguments,
}

#[derive(Args, Debug)]
#[command(next_help_heading = "Output")]
#[expect(clippy::struct_excessive_bools, reason = "each is an option of its own")]
pub(crate) struct OutputArguments {
    /// Output file: .exr (all layers), .png, .hdr or .pfm; may be repeated; - writes OpenEXR to
    /// standard output [default: domelight.exr and domelight.png]
    #[arg(short, long = "output", value_name = "FILE")]
    pub(crate) output: Vec<PicturePath>,
    /// Denoise PNG, HDR and PFM output with Open Image Denoise, if its library is installed or $OIDN_LIBRARY names it;
    /// OpenEXR keeps all layers as rendered and gets an additional layer, denoised
    #[arg(long, conflicts_with_all = ["shard", "tiles"])]
    pub(crate) denoise: bool,
    /// Print settings, times and counts as JSON to standard output
    #[arg(long)]
    pub(crate) json: bool,
    /// Show the picture while it is made in a viewer that listens at this address, such as tev or HDRView [default
    /// address: 127.0.0.1:14158]
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, require_equals = true, default_missing_value = display::ADDRESS)]
    pub(crate) display: Option<String>,
    /// First write PNG output at half size after one sample, as a preview of the rest
    #[arg(long)]
    pub(crate) preview: bool,
    /// Report the CPU seconds of each stage to standard error and in --json
    #[arg(long)]
    pub(crate) profile: bool,
    /// Form of the progress report
    #[arg(long, value_enum, value_name = "HOW", default_value_t = ProgressKind::Bar)]
    pub(crate) progress: ProgressKind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ProgressKind {
    /// A bar on standard error, if it is a terminal
    Bar,
    /// Open Job Description messages on standard output
    Openjd,
}
