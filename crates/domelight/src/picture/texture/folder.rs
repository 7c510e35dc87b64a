//! Prefiltered light as a folder of files: textures, a picture of each level, and a description.

use std::io::{self, Write};

use serde_json::{Value, json};

use super::{Container, TexelFormat, Texture};
use crate::picture::exr::ExrLayers;
use crate::rig::RigLight;
use crate::rig::ibl::{BrdfTable, Engine, FilteredMap, IblSettings, PrefilteredLight};
use crate::{Rgb, RgbImage};

/// Prefiltered light, and how it was made.
#[derive(Clone, Copy, Debug)]
pub struct IblFolder<'a> {
    /// The light.
    pub light: &'a PrefilteredLight,
    /// What it was made with.
    pub settings: &'a IblSettings,
    /// The engine, which decides the terms of the table.
    pub engine: Option<Engine>,
    /// The format of texels in textures.
    pub texels: TexelFormat,
    /// The sun that was taken out of the map.
    pub sun: Option<&'a RigLight>,
}

/// A file of such a folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IblFile {
    /// The radiance of all levels as KTX2.
    Radiance,
    /// Irradiance over π as KTX2.
    Irradiance,
    /// The table of the BRDF as KTX2.
    Table,
    /// The radiance of a level as an OpenEXR picture.
    LevelPicture(usize),
    /// Irradiance over π as an OpenEXR picture.
    IrradiancePicture,
    /// Levels, harmonics and the sun as JSON.
    Description,
}

impl IblFile {
    /// All files of light with so many levels.
    pub fn all(n_levels: usize) -> impl Iterator<Item = Self> {
        let textures = [Self::Radiance, Self::Irradiance, Self::Table];
        let levels = (0..n_levels).map(Self::LevelPicture);
        textures.into_iter().chain(levels).chain([Self::IrradiancePicture, Self::Description])
    }

    /// The name in the folder.
    pub fn name(self) -> String {
        match self {
            Self::Radiance => "radiance.ktx2".into(),
            Self::Irradiance => "irradiance.ktx2".into(),
            Self::Table => "brdf.ktx2".into(),
            Self::LevelPicture(level) => format!("radiance_{level:02}.exr"),
            Self::IrradiancePicture => "irradiance.exr".into(),
            Self::Description => "ibl.json".into(),
        }
    }
}

impl IblFolder<'_> {
    /// Writes a file.
    ///
    /// # Errors
    /// If writing to `out` fails, or there is no such level.
    pub fn encode(&self, file: IblFile, out: &mut dyn Write) -> io::Result<()> {
        let light = self.light;
        let texture = |texture: &Texture, out| Container::Ktx2.encode(texture, out);
        match file {
            IblFile::Radiance => texture(&Texture::light(&light.levels, self.texels).0, out),
            IblFile::Irradiance => {
                let irradiance = std::slice::from_ref(&light.irradiance);
                texture(&Texture::light(irradiance, self.texels).0, out)
            }
            IblFile::Table => {
                let table = BrdfTable::new(BrdfTable::SIZE, Engine::terms(self.engine));
                texture(&Texture::table(&table), out)
            }
            IblFile::LevelPicture(level) => {
                let missing =
                    || io::Error::new(io::ErrorKind::InvalidInput, "there is no such level");
                write_picture(light.levels.get(level).ok_or_else(missing)?, out)
            }
            IblFile::IrradiancePicture => write_picture(&light.irradiance, out),
            IblFile::Description => {
                let text = serde_json::to_string_pretty(&self.description())?;
                writeln!(out, "{text}")
            }
        }
    }

    /// Layout, levels, harmonics and the removed sun: docs/json.md, ibl.
    pub fn description(&self) -> Value {
        let Self { light, settings, sun, .. } = self;
        let levels = light.levels.iter().zip(&settings.roughness);
        let level = |(map, roughness): (&FilteredMap, &f32)| json!({ "size": map.size, "roughness": roughness });
        json!({
            "layout": settings.layout.name(),
            "levels": levels.map(level).collect::<Vec<_>>(),
            "irradiance_size": light.irradiance.size,
            "harmonics": light.harmonics.coefficients.map(Rgb::to_array),
            "harmonics_window": light.harmonics_window,
            "axes": settings.axes.world.map(|axis| axis.to_array()),
            "sun": sun.map(|sun| json!({
                "direction": sun.direction.to_array(),
                "irradiance": sun.irradiance.to_array(),
                "angular_radius": sun.angular_radius,
            })),
        })
    }
}

/// The square, or the faces of a cube from top to bottom.
fn write_picture(map: &FilteredMap, out: &mut dyn Write) -> io::Result<()> {
    let FilteredMap { layout, size, ref texels } = *map;
    let picture = RgbImage::new(size, layout.faces() * size, texels.clone());
    let bytes = ExrLayers::from_image(&picture, None).encode().map_err(io::Error::other)?;
    out.write_all(&bytes)
}
