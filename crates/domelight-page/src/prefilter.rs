//! Light for engines and shaders: prefiltered cubes, tables, and the code that samples them.

use std::borrow::Cow;

use domelight::environment::Environment;
use domelight::picture::exr::ExrLayers;
use domelight::picture::texture::{TexelFormat, Texture, dds, ktx2};
use domelight::rig::ibl::{BrdfTable, Engine as Target, IblSettings, TableTerms, prefilter};
use domelight::rig::tables::{ShaderLanguage, ShaderTables, TableSettings};
use domelight::rig::{ExtractionSettings, extract};
use domelight::{Rgb, RgbImage};
use serde::{Deserialize, Serialize};

use crate::error::{error, refused};
use crate::setup::{parse, to_json};
use crate::{Engine, Error};

/// Columns of the table of the BRDF.
const TABLE_SIZE: usize = 128;

/// Columns of a face of the irradiance cube.
const IRRADIANCE_SIZE: usize = 32;

/// The settings of prefiltered light, as those of `domelight ibl`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct IblState {
    /// Empty for levels of linear roughness that are looked up with the world direction.
    engine: String,
    size: usize,
    texels: TexelsName,
    sun: SunName,
    /// The most radiance where `sun` is clamped \[W·m⁻²·sr⁻¹\].
    clamp: f32,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum TexelsName {
    Rgb9e5,
    Half,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum SunName {
    Keep,
    Remove,
    Clamp,
}

/// The textures of prefiltered light.
pub(crate) struct Textures {
    radiance: Texture,
    irradiance: Texture,
}

/// What there is to choose from, for the page.
#[derive(Serialize)]
struct Offers {
    engines: Vec<&'static str>,
    languages: Vec<Language>,
    texels: usize,
}

#[derive(Serialize)]
struct Language {
    name: &'static str,
    extension: &'static str,
}

/// What prefiltered light is, for the page.
#[derive(Serialize)]
struct IblReport {
    levels: usize,
    /// Texels above what the format holds, and the share of the light of level 0 that they lose.
    clipped: usize,
    lost: f64,
    /// The share of the light that was clamped.
    clamped: f64,
}

/// The settings of tables, as those of `domelight tables`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TablesState {
    texels: usize,
    compensated: bool,
}

impl IblState {
    fn target(&self) -> Result<Option<Target>, Error> {
        let named = (!self.engine.is_empty()).then(|| self.engine.parse());
        named.transpose().map_err(refused)
    }

    fn settings(&self) -> Result<IblSettings, Error> {
        if self.size == 0 || self.size > IblSettings::MAX_SIZE {
            let text = format!("a cube's faces have 1 to {} columns", IblSettings::MAX_SIZE);
            return Err(refused(text));
        }
        let linear = IblSettings::linear(self.size);
        let settings = match self.target()? {
            None => linear,
            Some(engine) => IblSettings {
                roughness: engine.roughness(self.size),
                axes: engine.axes(),
                ..linear
            },
        };
        Ok(IblSettings { irradiance_size: IRRADIANCE_SIZE.min(settings.size), ..settings })
    }

    /// The environment with its sun treated, and the share of the light that was clamped.
    fn treated<'a>(
        &self,
        environment: &'a Environment,
    ) -> Result<(Cow<'a, Environment>, f64), Error> {
        match self.sun {
            SunName::Keep => Ok((Cow::Borrowed(environment), 0.0)),
            SunName::Clamp if self.clamp > 0.0 => {
                let (clamped, lost) = environment.clamped(self.clamp).map_err(error)?;
                Ok((Cow::Owned(clamped), lost))
            }
            SunName::Clamp => Err(refused("radiance is clamped to a positive number")),
            SunName::Remove => {
                let settings = ExtractionSettings { sun: true, ..ExtractionSettings::default() };
                let extraction = extract(environment, settings).map_err(error)?;
                let nothing = || refused("all of the light is the sun; nothing is left");
                Ok((Cow::Owned(extraction.residual.ok_or_else(nothing)?), 0.0))
            }
        }
    }

    fn format(&self) -> TexelFormat {
        match self.texels {
            TexelsName::Rgb9e5 => TexelFormat::SharedExponent,
            TexelsName::Half => TexelFormat::Half,
        }
    }
}

fn encoded(texture: &Texture, container: &str) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    match container {
        "ktx2" => ktx2::encode(texture, &mut bytes),
        "dds" => dds::encode(texture, &mut bytes),
        _ => return Err(refused(format!("there are no {container} files of textures"))),
    }
    .map_err(refused)?;
    Ok(bytes)
}

impl Engine {
    /// The engines, the languages of shaders and the usual number of texels of tables, as JSON.
    ///
    /// # Errors
    /// None.
    pub fn targets(&self) -> Result<String, Error> {
        let language = |l: ShaderLanguage| Language { name: l.name(), extension: l.extension() };
        Ok(to_json(&Offers {
            engines: Target::ALL.map(Target::name).into(),
            languages: ShaderLanguage::ALL.map(language).into(),
            texels: TableSettings::default().texels,
        }))
    }

    /// Prefilters the map: `{"engine", "size", "texels", "sun", "clamp"}`; it is kept until the map changes.
    ///
    /// # Errors
    /// If there is no environment, it is black, or the settings are out of range.
    pub fn prefilter(&mut self, json: &str) -> Result<String, Error> {
        if let Some((_, report, _)) = self.prefiltered.as_ref().filter(|(of, ..)| of == json) {
            return Ok(report.clone());
        }
        let state: IblState = parse(json)?;
        let (environment, clamped) = state.treated(self.environment()?)?;
        let light = prefilter(&environment, &state.settings()?).map_err(refused)?;
        let (radiance, clipped) = Texture::cube(&light.levels, state.format());
        let (irradiance, _) =
            Texture::cube(std::slice::from_ref(&light.irradiance), state.format());
        let report = IblReport {
            levels: light.levels.len(),
            clipped: clipped.texels,
            lost: clipped.lost,
            clamped,
        };
        let report = to_json(&report);
        let textures = Textures { radiance, irradiance };
        self.prefiltered = Some((json.to_owned(), report.clone(), textures));
        Ok(report)
    }

    /// A file of the light that was prefiltered with the settings in `json`: `radiance`, `irradiance` or `brdf` as `ktx2`
    /// or `dds`.
    ///
    /// # Errors
    /// If something else was prefiltered, or there is no such file.
    pub fn ibl_file(&self, json: &str, content: &str, container: &str) -> Result<Vec<u8>, Error> {
        if content == "brdf" {
            let state: IblState = parse(json)?;
            let terms = state.target()?.map_or(TableTerms::ScaleAndBias, Target::table);
            return encoded(&Texture::table(&BrdfTable::new(TABLE_SIZE, terms)), container);
        }
        let kept = self.prefiltered.as_ref().filter(|(of, ..)| of == json);
        let (_, _, textures) = kept.ok_or_else(|| refused("this light was not prefiltered"))?;
        match content {
            "radiance" => encoded(&textures.radiance, container),
            "irradiance" => encoded(&textures.irradiance, container),
            _ => Err(refused(format!("there is no texture {content}"))),
        }
    }

    /// The map as tables for shaders, `{"texels", "compensated"}`, as `bin`, `ktx2` or `exr`.
    ///
    /// # Errors
    /// If there is no environment, nothing to sample, or no such format.
    pub fn tables_file(&self, json: &str, format: &str) -> Result<Vec<u8>, Error> {
        let TablesState { texels, compensated } = parse(json)?;
        let settings = TableSettings { texels, compensated };
        let tables = ShaderTables::new(self.environment()?, settings).map_err(refused)?;
        match format {
            "bin" => Ok(tables.to_bytes()),
            "ktx2" => encoded(&Texture::shader_tables(&tables), "ktx2"),
            "exr" => {
                let (texture, width) = (tables.texture(), tables.texture_width());
                let pixels = texture.iter().map(|&[r, g, b, _]| Rgb::new(r, g, b)).collect();
                let alpha: Vec<f32> = texture.iter().map(|group| group[3]).collect();
                let picture = RgbImage::new(width, texture.len() / width, pixels);
                let layers = ExrLayers::from_image(&picture, Some(&alpha));
                layers.encode().map_err(refused)
            }
            _ => Err(refused(format!("there are no {format} files of tables"))),
        }
    }

    /// The code that samples tables in a language of shaders.
    ///
    /// # Errors
    /// If there is no such language.
    pub fn snippet(&self, language: &str) -> Result<Vec<u8>, Error> {
        let language: ShaderLanguage = language.parse().map_err(refused)?;
        Ok(language.snippet().as_bytes().to_vec())
    }
}
