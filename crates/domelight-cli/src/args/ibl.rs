//! The arguments of `domelight ibl`.

use std::path::PathBuf;
use std::str::FromStr;

use clap::builder::TypedValueParser;
use clap::{Args, ValueEnum};
use domelight::picture::texture::TexelFormat;
use domelight::rig::ibl::{Engine, IblSettings};

use super::{one_of, positive};
use domelight_lab::job::Light;

pub(super) const EXAMPLES: &str = "\
Every texel is the integral over the whole map, so a small sun leaves neither fireflies nor rings.

Examples:
  domelight ibl studio.hdr -o studio.ktx2 --for bevy
      a cube whose levels are filtered for Bevy's roughness, as RGB9E5
  domelight ibl road.hdr -o road.dds --texels half --irradiance road_irradiance.dds
      the same as DDS in half precision, and the cube of diffuse light
  domelight ibl road.hdr -o road/ --sun remove
      a folder with everything, without the sun, which becomes a light of its own: domelight lights --sun";

/// Prefilter a light probe for an engine.
#[derive(Args, Debug)]
pub(crate) struct IblArguments {
    #[command(flatten)]
    pub(crate) light: Light,

    /// Output: .ktx2 or .dds, a cube with a level for each roughness; or a folder, whose name ends in /, for it and the
    /// irradiance, the table and OpenEXR pictures of all levels
    #[arg(short, long, value_name = "OUT", help_heading = "Output")]
    pub(crate) output: IblPath,
    /// Write the irradiance over π as a cube (.ktx2, .dds)
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub(crate) irradiance: Option<TexturePath>,
    /// Write the table of the BRDF, the second factor of the split sum (.ktx2, .dds)
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub(crate) brdf: Option<TexturePath>,
    /// Print levels, spherical harmonics and files as JSON
    #[arg(long, help_heading = "Output")]
    pub(crate) json: bool,

    /// Columns of a face in the first level
    #[arg(long, value_name = "N", default_value_t = 256, help_heading = "Prefiltered light",
          value_parser = clap::value_parser!(u32).range(1..=IblSettings::MAX_SIZE as i64))]
    pub(crate) size: u32,
    /// The engine, which decides how the cube stands, the roughness of each level and the terms of the table [default:
    /// looked up with the world direction, roughness = level / (levels - 1)]
    #[arg(long = "for", id = "engine", value_name = "ENGINE", help_heading = "Prefiltered light",
          value_parser = engine())]
    pub(crate) engine: Option<Engine>,
    /// What to do with the sun: keep it, remove it, or clamp:X, which clamps all radiance to X
    #[arg(
        long,
        value_name = "keep|remove|clamp:X",
        default_value = "keep",
        help_heading = "Prefiltered light"
    )]
    pub(crate) sun: SunTreatment,
    /// Format of the cubes' texels
    #[arg(long, value_enum, default_value_t = Texels::Rgb9e5, help_heading = "Prefiltered light")]
    pub(crate) texels: Texels,
}

fn engine() -> impl TypedValueParser<Value = Engine> {
    one_of(Engine::ALL.map(Engine::name))
}

/// The format of a cube's texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Texels {
    /// 4 bytes: mantissas of 9 bits with a common exponent, up to 65408
    Rgb9e5,
    /// 8 bytes: RGBA in half precision, up to 65504
    Half,
}

impl From<Texels> for TexelFormat {
    fn from(texels: Texels) -> Self {
        match texels {
            Texels::Rgb9e5 => Self::SharedExponent,
            Texels::Half => Self::Half,
        }
    }
}

/// What happens to the sun before the map is filtered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum SunTreatment {
    Keep,
    Remove,
    /// The brightest channel of every texel is at most this.
    Clamp(f32),
}

impl FromStr for SunTreatment {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.strip_prefix("clamp:")) {
            ("keep", _) => Ok(Self::Keep),
            ("remove", _) => Ok(Self::Remove),
            (_, Some(radiance)) => positive(radiance).map(Self::Clamp),
            _ => Err("not keep, remove or clamp:X, such as clamp:100".into()),
        }
    }
}

/// The container of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Container {
    Ktx2,
    Dds,
}

/// A texture file to write.
#[derive(Clone, Debug)]
pub(crate) struct TexturePath {
    pub(crate) path: PathBuf,
    pub(crate) container: Container,
}

impl FromStr for TexturePath {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let path = PathBuf::from(text);
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        let container = match extension.as_deref() {
            Some("ktx2") => Container::Ktx2,
            Some("dds") => Container::Dds,
            _ => return Err("its name must end in .ktx2 or .dds".into()),
        };
        Ok(Self { path, container })
    }
}

/// Where prefiltered light goes.
#[derive(Clone, Debug)]
pub(crate) enum IblPath {
    File(TexturePath),
    Folder(PathBuf),
}

impl FromStr for IblPath {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let is_folder =
            text.ends_with(std::path::is_separator) || std::path::Path::new(text).is_dir();
        if is_folder {
            return Ok(Self::Folder(PathBuf::from(text)));
        }
        let file = text.parse().map(Self::File);
        file.map_err(|_| "its name must end in .ktx2 or .dds, or in / for a folder".into())
    }
}
