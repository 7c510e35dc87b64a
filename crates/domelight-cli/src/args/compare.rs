//! The arguments of `domelight compare`.

use std::path::PathBuf;

use clap::Args;

use super::{ThreadArguments, tone_curve};
use domelight::picture::exposure::Exposure;
use domelight::picture::tone::ToneCurve;
use domelight_lab::NamedStrategy;
use domelight_lab::compare::Budget;
use domelight_lab::job::{Given, Pixel, SceneSettings};

pub(super) const EXAMPLES: &str = "\
Strategies are NAME[:OPTION]…, separated by commas. An option is KEY=VALUE or a bare word. One or two
leading numbers set the usual options:
  brdf:4  environment:4  product:4            rays=4
  mis:3:1                                     split=3/1
  sir:15/800                                  rays=15 candidates=800
  rejection:32                                tries=32
  median-cut:64  variance-minimization:64     lights=64
  mis:heuristic=balance:no-compensation  sir:4/64:from=brdf:resampling=reservoir

Budgets are per picture: spp:N is camera samples per pixel, rays:N is shadow rays traced per pixel
that the scene covers, time:T is CPU seconds of rendering, measured. Camera samples are whole: the
report says if a strategy cannot meet the budget with a whole number of samples, and leaves it out
if even one sample is far above the budget.

Examples:
  domelight compare
      the built-in statue under the sky, five strategies at 32 shadow rays, into compare.html
  domelight compare statue --env cathedral --strategies mis,sir:15/800,variance-minimization:64
      your choice of strategies
  domelight compare bunny.ply --env studio.hdr --budget time:2s --seeds 8 -o bunny.html
      your mesh under your HDRI at equal time
  domelight compare robot.glb --env studio.hdr --size 640x480 --pictures others
      also against the pictures of other renderers in the folder others
  domelight compare scene.toml --reference converged.exr --json=result.json -o report.html
      against your own reference, with the numbers as JSON too";

/// Compare strategies on one scene at equal samples, rays or time.
#[derive(Args, Debug)]
#[command(mut_arg("view.size", |size| size.default_value("256x256")))]
pub(crate) struct CompareArguments {
    #[command(flatten)]
    pub(crate) given: Given,
    #[command(flatten)]
    pub(crate) scene: SceneSettings,

    /// Strategies, as described below
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        help_heading = "Comparison",
        default_value = "product,mis,environment,brdf,sir"
    )]
    pub(crate) strategies: Vec<NamedStrategy>,
    /// Budget of every strategy: rays:N, time:T (2s, 500ms, 1m) or spp:N
    #[arg(long, value_name = "BUDGET", default_value = "rays:32", help_heading = "Comparison")]
    pub(crate) budget: Budget,
    /// Pictures by other renderers: a folder of OpenEXR files of the same size. The render time of each comes from its
    /// name as in NAME.12.5s.exr, from lines NAME,SECONDS in a file times.csv in the folder, or from an attribute
    /// domelight.seconds or renderTime
    #[arg(long, value_name = "DIR", help_heading = "Comparison")]
    pub(crate) pictures: Option<PathBuf>,
    /// Pictures per strategy, starting at --seed; they give the spread of the error
    #[arg(long, value_name = "N", default_value_t = 4, help_heading = "Comparison",
          value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) seeds: u32,
    /// Converged picture [default: rendered once, then cached]
    #[arg(long, value_name = "FILE", help_heading = "Reference")]
    pub(crate) reference: Option<PathBuf>,
    /// Camera samples per pixel of the reference, rendered by product [default: 64 to 1024, until its error is at most
    /// a tenth of the smallest error expected of a strategy]
    #[arg(long, value_name = "N", help_heading = "Reference",
          conflicts_with = "reference", value_parser = clap::value_parser!(u32).range(2..=1 << 24))]
    pub(crate) reference_spp: Option<u32>,
    /// Folder for references [default: domelight in the user's cache folder]
    #[arg(long, value_name = "FOLDER", help_heading = "Reference")]
    pub(crate) cache: Option<PathBuf>,
    /// Do not use the cache for the reference
    #[arg(long, help_heading = "Reference", conflicts_with = "cache")]
    pub(crate) no_cache: bool,

    #[command(flatten)]
    pub(crate) pixel: Pixel,
    #[command(flatten)]
    pub(crate) threads: ThreadArguments,

    /// Output file; - writes the report to standard output
    #[arg(
        short,
        long,
        value_name = "FILE",
        default_value = "compare.html",
        help_heading = "Output"
    )]
    pub(crate) output: PathBuf,
    /// Print the numbers as JSON, or write them to a file
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true,
          default_missing_value = "-", help_heading = "Output")]
    pub(crate) json: Option<PathBuf>,
    /// Initial exposure of the page, also used for ꟻLIP, in stops; auto maps the median over the scene's pixels
    /// to middle gray
    #[arg(long, value_name = "EV|auto", default_value_t = Exposure::Auto,
          allow_negative_numbers = true, help_heading = "Output")]
    pub(crate) exposure: Exposure,
    /// Initial tone curve of the page, also used for ꟻLIP
    #[arg(long, default_value_t = ToneCurve::Agx, help_heading = "Output",
          value_parser = tone_curve())]
    pub(crate) tone: ToneCurve,
}
