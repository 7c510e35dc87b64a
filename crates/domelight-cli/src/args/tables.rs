//! The arguments of `domelight tables`.

use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;
use clap::builder::TypedValueParser;
use domelight::rig::tables::{ShaderLanguage, TableSettings};

use super::one_of;
use domelight_lab::job::Light;

pub(super) const EXAMPLES: &str = "\
A renderer on a graphics card samples an HDRI from the tables as domelight does, strata included.

Examples:
  domelight tables studio.hdr -o studio.tables.bin --snippet wgsl
      the tables as a buffer, and studio.tables.wgsl, the code that samples them
  domelight tables studio.hdr -o studio.tables.exr --snippet glsl --env-rotate 90
      the same as a texture for WebGL 2, with the map turned
  domelight tables road.hdr -o road.bin --texels 65536 --mis-compensation
      at most 65536 texels, whose light is that of the map, and a density for renderers that sample the BSDF, too";

/// Write a light probe as tables that shaders sample, and the code for it.
#[derive(Args, Debug)]
pub(crate) struct TablesArguments {
    #[command(flatten)]
    pub(crate) light: Light,

    /// Output: .bin, 32-bit floats in little-endian order, or the same as a texture in .ktx2 or as a picture with alpha in
    /// .exr; may be repeated
    #[arg(short, long, value_name = "FILE", required = true, help_heading = "Output")]
    pub(crate) output: Vec<TablesPath>,
    /// Also write the code that reads the tables, beside the first output; may be repeated
    #[arg(long, value_name = "LANGUAGE", help_heading = "Output", value_parser = language())]
    pub(crate) snippet: Vec<ShaderLanguage>,
    /// Print sizes and files as JSON
    #[arg(long, help_heading = "Output")]
    pub(crate) json: bool,

    /// Average the map to at most N texels, with the same light
    #[arg(long, value_name = "N", default_value_t = TableSettings::default().texels as u32, help_heading = "Tables",
          value_parser = clap::value_parser!(u32).range(1..=TableSettings::MOST_TEXELS as i64))]
    pub(crate) texels: u32,
    /// Sample only what is brighter than the mean, for renderers that combine it with samples of the BSDF
    #[arg(long, help_heading = "Tables")]
    pub(crate) mis_compensation: bool,
}

fn language() -> impl TypedValueParser<Value = ShaderLanguage> {
    one_of(ShaderLanguage::ALL.map(ShaderLanguage::name))
}

/// How tables are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TablesFormat {
    /// The numbers alone.
    Binary,
    /// A picture with R, G, B and A.
    Exr,
    /// A texture.
    Ktx2,
}

/// A file of tables to write.
#[derive(Clone, Debug)]
pub(crate) struct TablesPath {
    pub(crate) path: PathBuf,
    pub(crate) format: TablesFormat,
}

impl FromStr for TablesPath {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let path = PathBuf::from(text);
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        let format = match extension.as_deref() {
            Some("bin") => TablesFormat::Binary,
            Some("exr") => TablesFormat::Exr,
            Some("ktx2") => TablesFormat::Ktx2,
            _ => return Err("its name must end in .bin, .ktx2 or .exr".into()),
        };
        Ok(Self { path, format })
    }
}
