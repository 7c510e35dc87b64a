//! The arguments of `domelight render`.

use clap::Args;

use super::Tone;
use super::sampling::{PixelArguments, StrategyArguments};
use super::scene::SceneArguments;
use crate::output::PicturePath;

pub(super) const EXAMPLES: &str = "\
Examples:
  domelight render
      the built-in statue under the built-in sky, into domelight.exr and domelight.png
  domelight render bunny.ply --env studio.hdr --material ggx:0.2 --ground -o bunny.png
      your mesh under your HDRI
  domelight render scene.toml --strategy mis --split 3:1 --spp 256 -o out.exr -o out.png
      a scene file, three environment samples for each BRDF sample
  domelight render spheres --env cathedral --strategy brdf --rays 4 --json > stats.json
      another built-in scene, its statistics as JSON";

/// Render a scene lit by an HDR environment.
#[derive(Args, Debug)]
pub(crate) struct RenderArguments {
    #[command(flatten)]
    pub(crate) scene: SceneArguments,
    #[command(flatten)]
    pub(crate) strategy: StrategyArguments,
    /// Camera samples of each pixel
    #[arg(long, value_name = "N", default_value_t = 64, help_heading = "Sampling",
          value_parser = clap::value_parser!(u32).range(1..=1 << 24))]
    pub(crate) spp: u32,
    #[command(flatten)]
    pub(crate) pixel: PixelArguments,
    #[command(flatten)]
    pub(crate) output: OutputArguments,
}

#[derive(Args, Debug)]
#[command(next_help_heading = "Output")]
pub(crate) struct OutputArguments {
    /// Where to: .exr (all layers), .png, .hdr or .pfm; several times for several files; - writes
    /// OpenEXR to standard output [default: domelight.exr and domelight.png]
    #[arg(short, long = "output", value_name = "FILE")]
    pub(crate) output: Vec<PicturePath>,
    /// How PNG output is shown.
    #[command(flatten)]
    pub(crate) tone: Tone,
    /// Print settings, times and counts as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
}
