//! `domelight ibl`: prefilters a light probe for an engine.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use domelight::environment::Environment;
use domelight::files::create_folder;
use domelight::picture::exr::ExrLayers;
use domelight::picture::texture::{Container, EncodingLoss, RadianceFile, Texture};
use domelight::rig::ibl::{
    BrdfTable, Cube, Engine, IblSettings, PrefilteredLight, SunError, SunTreatment, TableTerms,
    TreatedEnvironment, prefilter,
};
use domelight::rig::{RigError, RigLight};
use domelight::scene::SceneDescription;
use domelight::{Rgb, RgbImage};
use serde_json::{Value, json};

use crate::args::ibl::{IblArguments, IblPath, TexturePath};
use crate::error::{UsageError, warn};
use crate::files;
use crate::memory;
use crate::output::{print, print_json};
use crate::scene::without_camera;
use crate::terminal::Terminal;
use domelight_lab::names::file_name;

/// Runs the subcommand.
pub(crate) fn run(arguments: &IblArguments, quiet: bool) -> Result<()> {
    let engine = arguments.target()?;
    let settings = IblSettings {
        harmonics_window: !arguments.no_sh_window,
        ..IblSettings::for_engine(engine, arguments.size as usize)
    };
    let results = Results::of(arguments, settings.roughness.len());
    results.declare()?;
    let (environment, probe) = arguments.load(&settings, quiet)?;
    let treated = arguments.treat_sun(&environment, &probe, quiet)?;
    let light = prefilter(&treated.environment, &settings).with_context(|| probe.clone())?;
    let loss = arguments.radiance_file().loss(&light);
    arguments.report_loss(loss, &probe, quiet)?;
    let sun = treated.sun.as_ref().and_then(|rig| rig.lights.first());
    let description = json_of(&light, &settings, sun);
    results.write(arguments, &light, Engine::terms(engine), &description)?;
    if arguments.json {
        let mut report = description;
        report["probe"] = probe.into();
        report["engine"] = engine.map(Engine::name).into();
        report["clipped"] = json!({ "texels": loss.texels, "lost": loss.clipped });
        report["rounded"] = loss.rounded.into();
        let names = results.files.iter().map(|(path, _)| path.to_string_lossy().into_owned());
        report["files"] = names.collect();
        return print_json(&report);
    }
    if quiet {
        return Ok(());
    }
    let line = |(path, content): &(PathBuf, Content)| {
        format!("-> {}: {}", path.display(), content.description(&settings))
    };
    print(&results.files.iter().map(line).collect::<Vec<_>>().join("\n"))
}

impl IblArguments {
    fn load(&self, settings: &IblSettings, quiet: bool) -> Result<(Environment, String)> {
        let given = without_camera(&self.light)?;
        let light = given.over(&SceneDescription::default());
        let map = given.load(&light, &Terminal { quiet })?;
        let probe = self.light.map.clone().unwrap_or_default();
        let cubes = 8 * settings.size.pow(2) as u64;
        let treated = match self.sun {
            SunTreatment::Keep => 0,
            SunTreatment::Remove | SunTreatment::Clamp(_) => memory::EXTRACTION_TEXEL,
        };
        let bytes = cubes * memory::IBL_TEXEL
            + memory::IBL_HIERARCHY
            + (Environment::MEMORY_PER_TEXEL + treated) * map.pixels.len() as u64;
        memory::allow(&format!("{probe}: its prefiltered light"), bytes)?;
        let environment = light.environment(map).with_context(|| probe.clone())?;
        Ok((environment, file_name(&probe)))
    }

    /// The environment with the sun kept, removed or clamped.
    fn treat_sun<'a>(
        &self,
        environment: &'a Environment,
        probe: &str,
        quiet: bool,
    ) -> Result<TreatedEnvironment<'a>> {
        match self.sun.apply(environment) {
            Err(SunError::Extraction(error @ RigError::NoSun { .. })) if !self.light.strict => {
                warn(quiet, &format!("{probe}: {error}; nothing is removed"));
                Ok(SunTreatment::Keep.apply(environment)?)
            }
            Err(error @ SunError::NothingLeft) => {
                Err(UsageError(format!("{probe}: {error}")).into())
            }
            treated => {
                let treated = treated.with_context(|| probe.to_owned())?;
                if let SunTreatment::Clamp(radiance) = self.sun
                    && treated.clamped > 0.0
                {
                    let percent = 100.0 * treated.clamped;
                    warn(quiet, &format!("{probe}: clamped to {radiance}, -{percent:.2} % light"));
                }
                Ok(treated)
            }
        }
    }

    /// States what the format cannot hold.
    fn report_loss(&self, loss: EncodingLoss, probe: &str, quiet: bool) -> Result<()> {
        let Some(text) = loss.warning() else { return Ok(()) };
        let text = format!("{probe}: {text}");
        if self.light.strict {
            return Err(UsageError(format!("{text}; without --strict this is a warning")).into());
        }
        warn(quiet, &text);
        Ok(())
    }
}

/// What a file holds.
#[derive(Clone, Copy, Debug)]
enum Content {
    /// All levels.
    Radiance(RadianceFile),
    Irradiance(Container),
    Table(Container),
    /// One level as a strip of faces.
    LevelPicture(usize),
    IrradiancePicture,
    /// Levels and coefficients.
    Description,
}

impl Content {
    fn description(self, settings: &IblSettings) -> String {
        let IblSettings { size, roughness, .. } = settings;
        match self {
            Self::Radiance(_) => {
                format!("a cube of {size}x{size} texels with {} levels", roughness.len())
            }
            Self::Irradiance(_) => "irradiance over π, a cube".into(),
            Self::Table(_) => {
                "the table of the BRDF: cos θ to the right, roughness downward".into()
            }
            Self::LevelPicture(level) => {
                format!("level {level}, roughness {:.3}, six faces", roughness[level])
            }
            Self::IrradiancePicture => "irradiance over π, six faces".into(),
            Self::Description => "levels and spherical harmonics".into(),
        }
    }
}

/// The files of a run.
struct Results {
    folder: Option<PathBuf>,
    files: Vec<(PathBuf, Content)>,
}

impl Results {
    fn of(arguments: &IblArguments, n_levels: usize) -> Self {
        let mut files = Vec::new();
        let folder = match &arguments.output {
            IblPath::File(path) => {
                files.push((path.clone(), Content::Radiance(arguments.radiance_file())));
                None
            }
            IblPath::Folder(folder) => {
                let mut add = |name: &str, content| files.push((folder.join(name), content));
                add("radiance.ktx2", Content::Radiance(arguments.radiance_file()));
                add("irradiance.ktx2", Content::Irradiance(Container::Ktx2));
                add("brdf.ktx2", Content::Table(Container::Ktx2));
                for level in 0..n_levels {
                    add(&format!("radiance_{level:02}.exr"), Content::LevelPicture(level));
                }
                add("irradiance.exr", Content::IrradiancePicture);
                add("ibl.json", Content::Description);
                Some(folder.clone())
            }
        };
        let mut also = |file: &Option<TexturePath>, content: fn(Container) -> Content| {
            files.extend(file.iter().map(|file| (file.path.clone(), content(file.container))));
        };
        also(&arguments.irradiance, Content::Irradiance);
        also(&arguments.brdf, Content::Table);
        Self { folder, files }
    }

    /// Declares all files before the work.
    fn declare(&self) -> Result<()> {
        let is_new = self.folder.as_ref().is_some_and(|folder| !folder.is_dir());
        for (path, _) in &self.files {
            let in_new = is_new && path.parent() == self.folder.as_deref();
            if in_new { files::declare(path)? } else { files::writes(path)? }
        }
        Ok(())
    }

    fn write(
        &self,
        arguments: &IblArguments,
        light: &PrefilteredLight,
        terms: TableTerms,
        description: &Value,
    ) -> Result<()> {
        if let Some(folder) = &self.folder {
            create_folder(folder).with_context(|| folder.display().to_string())?;
        }
        for (path, content) in &self.files {
            match content {
                Content::Radiance(file) => files::write(path, |out| file.encode(light, out))?,
                Content::Irradiance(container) => {
                    let levels = std::slice::from_ref(&light.irradiance);
                    let (texture, _) = Texture::cube(levels, arguments.texel_format());
                    write_texture(path, *container, &texture)?;
                }
                Content::Table(container) => {
                    let table = BrdfTable::new(BrdfTable::SIZE, terms);
                    write_texture(path, *container, &Texture::table(&table))?;
                }
                Content::LevelPicture(level) => write_strip(path, &light.levels[*level])?,
                Content::IrradiancePicture => write_strip(path, &light.irradiance)?,
                Content::Description => {
                    let text = serde_json::to_string_pretty(description)?;
                    files::write(path, |out| writeln!(out, "{text}"))?;
                }
            }
        }
        Ok(())
    }
}

fn write_texture(path: &Path, container: Container, texture: &Texture) -> Result<()> {
    files::write(path, |out| container.encode(texture, out))
}

/// The faces of a cube from top to bottom.
fn write_strip(path: &Path, cube: &Cube) -> Result<()> {
    let picture = RgbImage::new(cube.size, 6 * cube.size, cube.texels.clone());
    let bytes = ExrLayers::from_image(&picture, None).encode()?;
    files::write(path, |out| out.write_all(&bytes))
}

/// Levels, harmonics and the removed sun.
fn json_of(light: &PrefilteredLight, settings: &IblSettings, sun: Option<&RigLight>) -> Value {
    let levels = light.levels.iter().zip(&settings.roughness);
    let level =
        |(cube, roughness): (&Cube, &f32)| json!({ "size": cube.size, "roughness": roughness });
    json!({
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
