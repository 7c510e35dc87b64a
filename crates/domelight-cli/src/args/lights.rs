//! The arguments of `domelight lights`.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::Args;
use clap::builder::{PossibleValue, TypedValueParser};
use domelight::rig::export::Format;
use domelight::rig::{Method, SphericalGaussians};

use super::{one_of, percent};
use crate::output::PicturePath;
use domelight_lab::job::{Light, Tone};

pub(super) const EXAMPLES: &str = "\
The rig consists of the sun (--sun) and lamps (--lamps), then of regions of the remaining light
(-n, --error). Without -n and --error, the remaining light stays in the map as a dome, which
--keep-residual writes. Lights and dome together reproduce the probe.

Examples:
  domelight lights venice.hdr
      64 lights, as a table
  domelight lights road.hdr --sun --keep-residual dome.exr -o sun.json
      the sun, and the probe without the sun
  domelight lights studio.hdr --lamps 4 -o lamps.py --preview lamps.png
      up to four lamps for Blender, and a picture of them
  domelight lights chapel.hdr --error 5 -o rig.json -o rig.csv
      as many lights as a shading error of 5 % requires
  domelight lights sky --sun -n 16 -o - --format csv
      the sun and 15 regions, to standard output
  domelight lights venice.hdr --sg 128 -o venice.npy --env-convention mitsuba
      128 spherical Gaussians in the axes of PhySG";

/// Convert a light probe to a light rig.
#[derive(Args, Debug)]
pub(crate) struct LightsArguments {
    #[command(flatten)]
    pub(crate) light: Light,

    /// Number of lights, including sun and lamps [default: 64; with --sun or --lamps, only those]
    #[arg(short = 'n', long = "lights", value_name = "N", help_heading = "Lights",
          conflicts_with = "error", value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub(crate) n_lights: Option<u32>,
    /// Use the fewest lights whose matte and glossy shading errors are at most PERCENT [%]
    #[arg(long, value_name = "PERCENT", help_heading = "Lights", value_parser = percent)]
    pub(crate) error: Option<f64>,
    /// Extract the sun first: the brightest compact source no wider than 14°
    #[arg(long, help_heading = "Lights")]
    pub(crate) sun: bool,
    /// Extract up to K lamps and windows first: compact bright sources no wider than 56°
    #[arg(long, value_name = "K", help_heading = "Lights", default_value_t = 0,
          hide_default_value = true, value_parser = clap::value_parser!(u32).range(0..=4096))]
    pub(crate) lamps: u32,
    /// How to divide the remaining light
    #[arg(long, help_heading = "Lights", default_value = Method::NAMES[0], value_parser = method())]
    pub(crate) method: Method,
    /// Leave lights with a smaller share of the probe's light in the map [%; default: 0.1 for sun and lamps]
    #[arg(long, value_name = "PERCENT", help_heading = "Lights", value_parser = percent)]
    pub(crate) min_energy: Option<f64>,
    /// Instead of lights, fit up to K spherical Gaussians for PhySG or NeRD: rows of axis, sharpness and RGB amplitude, written
    /// as .npy or .json. The sun is a lobe of its own
    #[arg(long, value_name = "K", help_heading = "Lights",
          conflicts_with_all = ["n_lights", "error", "sun", "lamps", "method", "min_energy", "keep_residual", "preview", "format"],
          value_parser = clap::value_parser!(u32).range(1..=SphericalGaussians::MOST as i64))]
    pub(crate) sg: Option<u32>,

    /// Output file, whose extension sets the format; may be repeated; - is standard output
    #[arg(short, long = "output", value_name = "RIG", help_heading = "Output")]
    pub(crate) output: Vec<RigPath>,
    /// Format if the extension does not determine it [default for standard output: json]
    #[arg(long, value_name = "FORMAT", help_heading = "Output", value_parser = format(),
          requires = "output")]
    pub(crate) format: Option<Format>,
    /// Write the probe without the light of the rig (.exr, .hdr, .pfm). It keeps the probe's own orientation: use it with
    /// the same --env-rotate and --env-up, but without --env-scale and --env-exposure, which it contains
    #[arg(long, value_name = "FILE.exr", help_heading = "Output", value_parser = radiance_path)]
    pub(crate) keep_residual: Option<PicturePath>,
    /// Write a picture of the rig: regions, lights, and a sphere under probe and rig; or none [default: on a terminal
    /// RIG_preview.png next to the first rig, otherwise none]
    #[arg(long, value_name = "FILE.png|none", help_heading = "Output")]
    pub(crate) preview: Option<PreviewPath>,
    /// Print lights, error and times as JSON
    #[arg(long, help_heading = "Output")]
    pub(crate) json: bool,
    /// How the preview is developed.
    #[command(flatten, next_help_heading = "Output")]
    pub(crate) tone: Tone,
}

/// `--env` as the first argument.
pub(super) fn positional(env: clap::Arg) -> clap::Arg {
    let help = "A built-in probe (sky, studio, cathedral, constant) or a file (.hdr, .exr, .pfm, .ktx2, \
                .dds; - reads standard input)";
    let env = env.long(None::<&'static str>).index(1).required(true);
    env.help(help).help_heading(None::<&'static str>)
}

/// A picture whose format keeps radiance.
fn radiance_path(text: &str) -> Result<PicturePath, String> {
    let path: PicturePath = text.parse()?;
    if path.is_png() {
        return Err("a PNG cannot hold the light of a map; its name must end in .exr, .hdr or .pfm, or be -".into());
    }
    Ok(path)
}

fn format() -> impl TypedValueParser<Value = Format> {
    one_of(Format::ALL.map(Format::name))
}

/// The algorithms that divide a map.
fn method() -> impl TypedValueParser<Value = Method> {
    let help = [
        "Regions of small variance on the sphere: the sum of both halves' variances is minimized, the worst region is cut \
         first, and regions are then merged and refined into cells",
        "The rule of the poster (Viriyothai & Debevec 2009): rectangles, cut level by level so that the larger of both \
         halves' variances on the map is least",
        "Regions of equal energy (Debevec 2005)",
    ];
    let names = Method::NAMES.into_iter();
    one_of(names.zip(help).map(|(name, help)| PossibleValue::new(name).help(help)))
}

/// The output file of a rig; `-` is standard output.
#[derive(Clone, Debug)]
pub(crate) struct RigPath {
    pub(crate) path: PathBuf,
    /// The format of its extension.
    pub(crate) format: Option<Format>,
}

impl FromStr for RigPath {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let path = PathBuf::from(text);
        let format =
            path.file_name().and_then(|name| Format::of_file_name(&name.to_string_lossy()));
        Ok(Self { path, format })
    }
}

impl RigPath {
    pub(crate) fn is_standard_output(&self) -> bool {
        self.path == Path::new("-")
    }
}

/// The output of the preview; `-` is standard output.
#[derive(Clone, Debug)]
pub(crate) enum PreviewPath {
    /// Nowhere.
    None,
    /// Into a PNG file.
    Png(PathBuf),
}

impl FromStr for PreviewPath {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "none" {
            return Ok(Self::None);
        }
        let path = PathBuf::from(text);
        let is_png = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
        if is_png || text == "-" {
            Ok(Self::Png(path))
        } else {
            Err("its name must end in .png, or be none".into())
        }
    }
}
