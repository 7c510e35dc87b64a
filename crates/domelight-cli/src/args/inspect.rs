//! The arguments of `domelight inspect`.

use std::path::PathBuf;

use clap::Args;
use domelight_lab::NamedStrategy;
use domelight_lab::job::{Given, Pixel, SceneSettings};

use super::ThreadArguments;

pub(super) const EXAMPLES: &str = "\
Examples:
  domelight inspect
      the pixel in the middle of the built-in statue, into inspect.html
  domelight inspect robot.glb --env studio.hdr --pixel 120,88 --size 640x640
      why that pixel is noisy, and which strategy helps
  domelight inspect --pixel 300,200 --strategies mis:4:4,product -o pixel.json
      the numbers and maps as JSON";

/// Inspect one pixel: its hemisphere, where each strategy sends its rays, and why it is noisy.
#[derive(Args, Debug)]
pub(crate) struct InspectArguments {
    #[command(flatten)]
    pub(crate) given: Given,
    #[command(flatten)]
    pub(crate) scene: SceneSettings,

    /// Column and row of the pixel, counted from 0 at the upper left [default: the center]
    #[arg(
        long,
        value_name = "X,Y",
        help_heading = "Inspection",
        value_parser = pixel,
        allow_hyphen_values = true
    )]
    pub(crate) pixel: Option<[usize; 2]>,
    /// Strategies, in the notation of compare
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        help_heading = "Inspection",
        default_value = "product,mis,environment,brdf,sir"
    )]
    pub(crate) strategies: Vec<NamedStrategy>,

    #[command(flatten)]
    pub(crate) sampling: Pixel,
    #[command(flatten)]
    pub(crate) threads: ThreadArguments,

    /// Output file, .html or .json; - writes JSON to standard output
    #[arg(
        short,
        long,
        value_name = "FILE",
        default_value = "inspect.html",
        help_heading = "Output"
    )]
    pub(crate) output: PathBuf,
    /// Also print the report as JSON
    #[arg(long, help_heading = "Output")]
    pub(crate) json: bool,
}

fn pixel(text: &str) -> Result<[usize; 2], String> {
    let numbers = text
        .split_once(',')
        .and_then(|(x, y)| Some([x.trim().parse().ok()?, y.trim().parse().ok()?]));
    numbers.ok_or_else(|| "not a column and a row such as 120,88".to_owned())
}
