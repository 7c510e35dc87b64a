//! The arguments of `domelight ibl`.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::Args;
use clap::builder::{PossibleValue, TypedValueParser};
use domelight::picture::texture::{Container, RadianceFile, RadianceFileError, TexelFormat};
use domelight::rig::ibl::{Engine, IblSettings, Layout, SunTreatment};

use super::one_of;
use crate::error::UsageError;
use domelight_lab::job::Light;

pub(super) const EXAMPLES: &str = "\
Every texel is the integral over the whole map, so a small sun leaves neither fireflies nor rings.

Examples:
  domelight ibl studio.hdr -o studio.ktx2 --for bevy
      a cube whose levels are filtered for Bevy's roughness, as RGB9E5
  domelight ibl road.hdr -o road.dds --texels half --irradiance road_irradiance.dds
      the same as DDS in half precision, and the cube of diffuse light
  domelight ibl studio.hdr -o studio.env
      one file for Babylon.js; studio.ktx is one for Filament
  domelight ibl studio.hdr -o studio.ktx2 --layout octahedral --size 512
      one square per level instead of six faces, for shaders of your own
  domelight ibl road.hdr -o road/ --sun remove
      a folder with everything, without the sun, which becomes a light of its own: domelight lights --sun";

/// Prefilter a light probe for an engine.
#[derive(Args, Debug)]
pub(crate) struct IblArguments {
    #[command(flatten)]
    pub(crate) light: Light,

    /// Output: .ktx2 or .dds, a map with a level for each roughness; .ktx for Filament or .env for Babylon.js, the same with
    /// the irradiance; or a folder, whose name ends in /, for the map, the irradiance, the table and OpenEXR pictures of all
    /// levels
    #[arg(short, long, value_name = "OUT", help_heading = "Output")]
    pub(crate) output: IblPath,
    /// Write the irradiance over π as a map of its own (.ktx2, .dds)
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub(crate) irradiance: Option<TexturePath>,
    /// Write the table of the BRDF, the second factor of the split sum (.ktx2, .dds)
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub(crate) brdf: Option<TexturePath>,
    /// Print levels, spherical harmonics and files as JSON
    #[arg(long, help_heading = "Output")]
    pub(crate) json: bool,

    /// How the texels of all maps cover the sphere
    #[arg(long, default_value = Layout::default().name(), help_heading = "Prefiltered light",
          value_parser = layout())]
    pub(crate) layout: Layout,
    /// Columns of a face in the first level; an octahedral map is a single face
    #[arg(long, value_name = "N", default_value_t = 256, help_heading = "Prefiltered light",
          value_parser = clap::value_parser!(u32).range(1..=IblSettings::MAX_SIZE as i64))]
    pub(crate) size: u32,
    /// The engine, which decides how the map stands, the roughness of each level and the terms of the table [default:
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
    /// Keep the spherical harmonics as they are where their irradiance would be negative, opposite to small bright lights. By
    /// default, a window removes such rings
    #[arg(long, help_heading = "Prefiltered light")]
    pub(crate) no_sh_window: bool,
    /// Format of the texels in .ktx2 and .dds [default: rgb9e5]
    #[arg(long, help_heading = "Prefiltered light", value_parser = texels())]
    pub(crate) texels: Option<TexelFormat>,
}

pub(super) fn engine() -> impl TypedValueParser<Value = Engine> {
    one_of(Engine::ALL.map(Engine::name))
}

fn layout() -> impl TypedValueParser<Value = Layout> {
    let help = |layout| match layout {
        Layout::Cube => "six square faces",
        Layout::Octahedral => "one square, of equal areas and with +Y at its center",
    };
    one_of(Layout::ALL.map(|layout| PossibleValue::new(layout.name()).help(help(layout))))
}

const TEXELS: TexelFormat = TexelFormat::SharedExponent;

fn texels() -> impl TypedValueParser<Value = TexelFormat> {
    let help = [
        "4 bytes: mantissas of 9 bits with a common exponent, up to 65408",
        "8 bytes: RGBA in half precision, up to 65504",
    ];
    let names = TexelFormat::LIGHT.map(TexelFormat::name).into_iter();
    one_of(names.zip(help).map(|(name, help)| PossibleValue::new(name).help(help)))
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
        let container = extension(&path).and_then(|e| Container::of_extension(&e));
        let container = container.ok_or("its name must end in .ktx2 or .dds")?;
        Ok(Self { path, container })
    }
}

/// Where prefiltered light goes.
#[derive(Clone, Debug)]
pub(crate) enum IblPath {
    File(PathBuf),
    Folder(PathBuf),
}

impl FromStr for IblPath {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let path = PathBuf::from(text);
        if text.ends_with(std::path::is_separator) || path.is_dir() {
            return Ok(Self::Folder(path));
        }
        let format = extension(&path).and_then(|e| RadianceFile::of_extension(&e, TEXELS));
        let known = "its name must end in .ktx2, .dds, .ktx or .env, or in / for a folder";
        format.map(|_| Self::File(path)).ok_or_else(|| known.into())
    }
}

fn extension(path: &Path) -> Option<Cow<'_, str>> {
    path.extension().map(std::ffi::OsStr::to_string_lossy)
}

impl IblArguments {
    /// The format of the texels of maps.
    pub(crate) fn texel_format(&self) -> TexelFormat {
        self.texels.unwrap_or(TEXELS)
    }

    /// The format of the radiance.
    pub(crate) fn radiance_file(&self) -> RadianceFile {
        let texels = self.texel_format();
        let of = |path: &PathBuf| RadianceFile::of_extension(&extension(path)?, texels);
        let file = match &self.output {
            IblPath::File(path) => of(path),
            IblPath::Folder(_) => None,
        };
        file.unwrap_or(RadianceFile::Texture(Container::Ktx2, texels))
    }

    /// The engine that the files are for, which the format of the radiance may decide.
    pub(crate) fn target(&self) -> Result<Option<Engine>, UsageError> {
        let file = self.radiance_file();
        file.check(self.layout, self.size as usize).map_err(|error| {
            let option = match error {
                RadianceFileError::Size { .. } => "--size",
                RadianceFileError::Layout { .. } => "--layout",
            };
            UsageError(format!("{option}: {error}"))
        })?;
        let Some(only) = file.engine() else { return Ok(self.engine) };
        match self.engine {
            Some(other) if other != only => {
                let text =
                    format!("{} reads other files than those of {}", other.name(), only.name());
                Err(UsageError(format!("--for {}: {text}; write .ktx2 or .dds", other.name())))
            }
            Some(_) | None if self.texels.is_some() => {
                let text =
                    "--texels is for .ktx2 and .dds; other files have their own format of texels";
                Err(UsageError(text.into()))
            }
            Some(_) | None => Ok(Some(only)),
        }
    }
}
