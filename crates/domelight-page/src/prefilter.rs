//! Light for engines and shaders: prefiltered maps, tables, and the code that samples them.

use domelight::picture::exr::ExrLayers;
use domelight::picture::texture::{
    Container, IblFile, IblFolder, RadianceFile, TexelFormat, Texture,
};
use domelight::rig::RigLight;
use domelight::rig::ibl::{
    BrdfTable, Engine as Target, IblSettings, Layout, PrefilteredLight, SunTreatment, prefilter,
};
use domelight::rig::tables::{ShaderLanguage, ShaderTables, TableSettings};
use domelight::{Rgb, RgbImage};
use rawzip::ZipArchiveWriter;
use serde::{Deserialize, Serialize};

use crate::error::refused;
use crate::setup::{parse, to_json};
use crate::{Engine, Error};

/// The extension of all files in an archive, which the program writes into a folder.
const ARCHIVE: &str = "zip";

/// The settings of prefiltered light, as those of `domelight ibl`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct IblState {
    /// Empty for levels of linear roughness that are looked up with the world direction.
    engine: String,
    layout: String,
    size: usize,
    texels: String,
    /// The extension of the radiance's file.
    file: String,
    sun: String,
    /// The most radiance where `sun` is "clamp" \[W·m⁻²·sr⁻¹\].
    clamp: f32,
}

/// What there is to choose from, for the page.
#[derive(Serialize)]
struct Offers {
    engines: Vec<&'static str>,
    files: Vec<File>,
    layouts: Vec<&'static str>,
    languages: Vec<Language>,
    texels: usize,
}

/// A format of prefiltered light.
#[derive(Serialize)]
struct File {
    extension: &'static str,
    /// The only engine that reads it.
    engine: Option<&'static str>,
}

#[derive(Serialize)]
struct Language {
    name: &'static str,
    extension: &'static str,
}

/// Light, and what it was made with.
pub(crate) struct Prefiltered {
    /// The settings, as JSON.
    of: String,
    /// [`IblReport`], as JSON.
    report: String,
    settings: IblSettings,
    sun: Option<RigLight>,
    light: PrefilteredLight,
}

/// What prefiltered light is, for the page.
#[derive(Serialize)]
struct IblReport {
    levels: usize,
    /// What the format changes, as a sentence.
    loss: Option<String>,
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

    fn treatment(&self) -> Result<SunTreatment, Error> {
        match &self.sun[..] {
            "clamp" => Ok(SunTreatment::Clamp(self.clamp)),
            sun => sun.parse().map_err(refused),
        }
    }

    fn format(&self) -> Result<TexelFormat, Error> {
        self.texels.parse().map_err(refused)
    }

    fn settings(&self) -> Result<IblSettings, Error> {
        let layout = self.layout.parse().map_err(refused)?;
        Ok(IblSettings { layout, ..IblSettings::for_engine(self.target()?, self.size) })
    }

    fn radiance_file(&self) -> Result<RadianceFile, Error> {
        if self.file == ARCHIVE {
            return Ok(RadianceFile::Texture(Container::Ktx2, self.format()?));
        }
        let file = RadianceFile::of_extension(&self.file, self.format()?);
        file.ok_or_else(|| refused(format!("there are no {} files of light", self.file)))
    }
}

fn encoded(texture: &Texture, container: &str) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    let container: Container = container.parse().map_err(refused)?;
    container.encode(texture, &mut bytes).map_err(refused)?;
    Ok(bytes)
}

impl Prefiltered {
    /// The files that the program writes into a folder, as a ZIP archive.
    fn archive(&self, state: &IblState) -> Result<Vec<u8>, Error> {
        let (light, settings, sun) = (&self.light, &self.settings, self.sun.as_ref());
        let (engine, texels) = (state.target()?, state.format()?);
        let folder = IblFolder { light, settings, engine, texels, sun };
        let mut bytes = Vec::new();
        let mut archive = ZipArchiveWriter::new(&mut bytes);
        for file in IblFile::all(light.levels.len()) {
            // Not compressed, and without a date: the same files make the same bytes.
            let (mut entry, config) = archive.new_file(file.name()).start().map_err(refused)?;
            let mut content = config.wrap(&mut entry);
            folder.encode(file, &mut content).map_err(refused)?;
            let (_, sizes) = content.finish().map_err(refused)?;
            entry.finish(sizes).map_err(refused)?;
        }
        archive.finish().map_err(refused)?;
        Ok(bytes)
    }
}

impl Engine {
    /// The engines, the languages of shaders and the usual number of texels of tables, as JSON.
    pub fn targets(&self) -> String {
        let language = |l: ShaderLanguage| Language { name: l.name(), extension: l.extension() };
        let file = |extension| {
            let file = RadianceFile::of_extension(extension, TexelFormat::Half);
            File { extension, engine: file.and_then(RadianceFile::engine).map(Target::name) }
        };
        let files = RadianceFile::EXTENSIONS.into_iter().chain([ARCHIVE]);
        to_json(&Offers {
            engines: Target::ALL.map(Target::name).into(),
            files: files.map(file).collect(),
            layouts: Layout::ALL.map(Layout::name).into(),
            languages: ShaderLanguage::ALL.map(language).into(),
            texels: TableSettings::default().texels,
        })
    }

    /// Prefilters the map: `{"engine", "layout", "size", "texels", "file", "sun", "clamp"}`; it is kept until the map changes.
    ///
    /// # Errors
    /// If there is no environment, it is black, or the settings are out of range.
    pub fn prefilter(&mut self, json: &str) -> Result<String, Error> {
        if let Some(kept) = self.prefiltered.as_ref().filter(|kept| kept.of == json) {
            return Ok(kept.report.clone());
        }
        let state: IblState = parse(json)?;
        let treated = state.treatment()?.apply(self.environment()?).map_err(refused)?;
        let settings = state.settings()?;
        let file = state.radiance_file()?;
        file.check(settings.layout, settings.size).map_err(refused)?;
        let light = prefilter(&treated.environment, &settings).map_err(refused)?;
        let report = IblReport {
            levels: light.levels.len(),
            loss: file.loss(&light).warning(),
            clamped: treated.clamped,
        };
        let report = to_json(&report);
        let sun = treated.sun.and_then(|rig| rig.lights.into_iter().next());
        let of = json.to_owned();
        self.prefiltered = Some(Prefiltered { of, report: report.clone(), settings, sun, light });
        Ok(report)
    }

    /// A file of the light that was prefiltered with the settings in `json`: `radiance`, or as `ktx2` or `dds` `irradiance` or
    /// `brdf`. An archive holds all of them, pictures of the levels and a description.
    ///
    /// # Errors
    /// If something else was prefiltered, or there is no such file.
    pub fn ibl_file(&self, json: &str, content: &str) -> Result<Vec<u8>, Error> {
        let state: IblState = parse(json)?;
        if content == "brdf" {
            let table = BrdfTable::new(BrdfTable::SIZE, Target::terms(state.target()?));
            return encoded(&Texture::table(&table), &state.file);
        }
        let kept = self.prefiltered.as_ref().filter(|kept| kept.of == json);
        let kept = kept.ok_or_else(|| refused("this light was not prefiltered"))?;
        let light = &kept.light;
        match content {
            "radiance" if state.file == ARCHIVE => kept.archive(&state),
            "radiance" => {
                let mut bytes = Vec::new();
                state.radiance_file()?.encode(light, &mut bytes).map_err(refused)?;
                Ok(bytes)
            }
            "irradiance" => {
                let irradiance = std::slice::from_ref(&light.irradiance);
                encoded(&Texture::light(irradiance, state.format()?).0, &state.file)
            }
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
