//! The arguments of `domelight render`.

use clap::{Args, ValueEnum};
use domelight::environment::UpAxis;
use domelight::environment::mapping::Mapping;
use domelight::render::Filter;

use super::{Tone, finite, mapping, one_of};
use crate::output::PicturePath;
use crate::values::{NamedMaterial, Size, Split, Triple, not_negative};

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
    /// A built-in scene (statue, spheres, material-ball, sphere, …), a mesh (.ply, .obj, .gltf,
    /// .glb) or a scene file (.toml)
    #[arg(default_value = "statue")]
    pub(crate) scene: String,

    #[command(flatten)]
    pub(crate) environment: EnvironmentArguments,
    #[command(flatten)]
    pub(crate) sampling: SamplingArguments,
    #[command(flatten)]
    pub(crate) camera: CameraArguments,
    #[command(flatten)]
    pub(crate) stage: StageArguments,
    #[command(flatten)]
    pub(crate) output: OutputArguments,
}

#[derive(Args, Debug)]
#[command(next_help_heading = "Environment")]
pub(crate) struct EnvironmentArguments {
    /// A built-in probe (sky, studio, cathedral, constant) or a file (.hdr, .exr, .pfm; - reads
    /// standard input) [default: the scene's, else sky]
    #[arg(long, value_name = "PROBE")]
    pub(crate) env: Option<String>,
    /// Turn the environment about the up axis, counter-clockwise seen from above [degrees]
    #[arg(long, value_name = "DEG", value_parser = finite, allow_negative_numbers = true)]
    pub(crate) env_rotate: Option<f32>,
    /// Multiply the environment's radiance
    #[arg(long, value_name = "X", value_parser = not_negative, allow_negative_numbers = true)]
    pub(crate) env_scale: Option<f32>,
    /// Multiply the environment's radiance by 2^EV
    #[arg(long, value_name = "EV", value_parser = finite, allow_negative_numbers = true)]
    pub(crate) env_exposure: Option<f32>,
    /// The world axis that the top of the map points to
    #[arg(long, value_enum, value_name = "AXIS")]
    pub(crate) env_up: Option<Up>,
    /// The map's layout, where shape and attributes do not tell it rightly
    #[arg(long, value_name = "MAPPING", value_parser = mapping())]
    pub(crate) env_mapping: Option<Mapping>,
    /// The layer of an OpenEXR map
    #[arg(long, value_name = "NAME")]
    pub(crate) env_layer: Option<String>,
    /// Rows of a built-in probe
    #[arg(long, value_name = "ROWS", default_value_t = 1024,
          value_parser = clap::value_parser!(u32).range(1..=16_384))]
    pub(crate) env_rows: u32,
    /// Repair negative, NaN and infinite texels instead of refusing them
    #[arg(long)]
    pub(crate) sanitize: bool,
}

#[derive(Args, Debug)]
#[command(next_help_heading = "Sampling")]
pub(crate) struct SamplingArguments {
    /// How directions are chosen
    #[arg(long, value_enum, default_value_t = StrategyName::Mis)]
    pub(crate) strategy: StrategyName,
    /// Camera samples of each pixel
    #[arg(long, value_name = "N", default_value_t = 64,
          value_parser = clap::value_parser!(u32).range(1..=1 << 24))]
    pub(crate) spp: u32,
    /// Shadow rays of each camera sample; with rejection, samples to accept [default: 1,
    /// with mis 2, with product 8]
    #[arg(long, value_name = "N", conflicts_with = "split",
          value_parser = clap::value_parser!(u32).range(1..=65_536))]
    pub(crate) rays: Option<u32>,
    /// Environment and BRDF samples of each camera sample, with mis [default: half of --rays each]
    #[arg(long, value_name = "M:N")]
    pub(crate) split: Option<Split>,
    /// Lights that stand for the probe, with median-cut and variance-minimization [default: 64]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub(crate) lights: Option<u32>,
    /// Candidates of each camera sample, with sir [default: by a pilot, for the least error in time]
    #[arg(long, value_name = "M", value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub(crate) candidates: Option<u32>,
    /// Where sir draws its candidates from [default: mixture]
    #[arg(long, value_enum, value_name = "SOURCE")]
    pub(crate) from: Option<SourceName>,
    /// How sir picks rays from candidates [default: sorted]
    #[arg(long, value_enum, value_name = "HOW")]
    pub(crate) resampling: Option<ResamplingName>,
    /// Tries of each camera sample, with rejection; with --rays the most tries [default: 16; with
    /// --rays N 64 N]
    #[arg(long, value_name = "M", value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub(crate) tries: Option<u32>,
    /// What rejection draws its tries from [default: tighter]
    #[arg(long, value_enum, value_name = "SOURCE")]
    pub(crate) proposal: Option<ProposalName>,
    /// How mis weighs its samples [default: power]
    #[arg(long, value_enum)]
    pub(crate) heuristic: Option<HeuristicName>,
    /// With mis, draw from the environment's whole table; by default what is dimmer than the mean
    /// is left to the BRDF samples
    #[arg(long)]
    pub(crate) no_compensation: bool,
    /// Which points: Owen-scrambled Sobol' or independent random numbers
    #[arg(long, value_enum, default_value_t = SamplerName::Sobol)]
    pub(crate) sampler: SamplerName,
    /// Pixel filter
    #[arg(long, default_value = "gaussian", value_parser = one_of::<Filter>(Filter::ALL.map(Filter::name)))]
    pub(crate) filter: Filter,
    /// Names the random numbers; the same seed gives the same picture
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,
    /// Threads [default: all cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) threads: Option<u32>,
}

#[derive(Args, Debug)]
#[command(next_help_heading = "Camera")]
pub(crate) struct CameraArguments {
    /// Size of the picture
    #[arg(long, value_name = "WxH", default_value = "640x640")]
    pub(crate) size: Size,
    /// Where the camera is [default: framed to the scene]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(crate) origin: Option<Triple>,
    /// What it looks at
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(crate) target: Option<Triple>,
    /// The direction that is up in the picture
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(crate) up: Option<Triple>,
    /// Vertical field of view [degrees]
    #[arg(long, value_name = "DEG", value_parser = not_negative, allow_negative_numbers = true, conflicts_with = "ortho")]
    pub(crate) fov: Option<f32>,
    /// Orthographic, with this height of the picture in the world
    #[arg(long, value_name = "HEIGHT", value_parser = not_negative, allow_negative_numbers = true)]
    pub(crate) ortho: Option<f32>,
}

#[derive(Args, Debug)]
#[command(next_help_heading = "Scene")]
pub(crate) struct StageArguments {
    /// Material of the subject: diffuse:0.8, phong:50:1:0.5, ward:0.15:0.5, ggx:0.2, mix, …
    #[arg(long, value_name = "M")]
    pub(crate) material: Option<NamedMaterial>,
    /// Move and scale the scene: centre of the bounds to 0, longest half-extent to 1
    #[arg(long)]
    pub(crate) normalize: bool,
    /// Put a diffuse disk (reflectance 0.5) under the scene
    #[arg(long)]
    pub(crate) ground: bool,
    /// Leave the background out: transparent where nothing is
    #[arg(long)]
    pub(crate) hide_env: bool,
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

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum StrategyName {
    /// From the reflectance alone
    Brdf,
    /// From the environment's table alone
    #[value(alias = "env", alias = "em")]
    Environment,
    /// Both, by multiple importance sampling
    Mis,
    /// The product of both, by a table a pixel, with the visibility that is learned on the way; traces
    /// up to --rays where they matter
    Product,
    /// The product of both, by rejection from one with a bound on the other
    Rejection,
    /// The product of both, by resampling --candidates to --rays
    Sir,
    /// The probe as --lights directional lights by median cut: no noise, but bias
    MedianCut,
    /// The probe as --lights directional lights by variance minimization: no noise, but bias
    VarianceMinimization,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum SourceName {
    /// The environment
    Environment,
    /// The reflectance
    Brdf,
    /// Half from each
    Mixture,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum ResamplingName {
    /// Each ray by a number of its own
    Multinomial,
    /// Equally spaced picks
    Systematic,
    /// Equally spaced picks from candidates sorted in space
    Sorted,
    /// Streaming reservoirs: no memory for candidates
    Reservoir,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum ProposalName {
    /// The environment, with a bound on the reflectance
    Environment,
    /// The reflectance, with a bound on the light
    Brdf,
    /// Whichever bound is tighter at the point
    Tighter,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum HeuristicName {
    /// wᵢ = nᵢpᵢ / Σ nₖpₖ
    Balance,
    /// The same with squares
    Power,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum SamplerName {
    /// Owen-scrambled Sobol' points
    Sobol,
    /// Independent pseudo-random points
    Independent,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Up {
    /// +Y
    Y,
    /// +Z
    Z,
}

impl From<Up> for UpAxis {
    fn from(up: Up) -> Self {
        match up {
            Up::Y => Self::Y,
            Up::Z => Self::Z,
        }
    }
}
