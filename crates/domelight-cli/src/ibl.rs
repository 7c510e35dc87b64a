//! `domelight ibl`: prefilters a light probe for an engine.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use domelight::environment::Environment;
use domelight::files::create_folder;
use domelight::picture::texture::{
    Container, EncodingLoss, IblFile, IblFolder, RadianceFile, Texture,
};
use domelight::rig::RigError;
use domelight::rig::ibl::{
    BrdfTable, Engine, IblSettings, Layout, SunError, SunTreatment, TreatedEnvironment, prefilter,
};
use domelight::scene::SceneDescription;
use serde_json::json;

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
        layout: arguments.layout,
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
    let texels = arguments.texel_format();
    let folder = IblFolder { light: &light, settings: &settings, engine, texels, sun };
    results.write(&folder)?;
    if arguments.json {
        let mut report = folder.description();
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
        // All levels together have a third more texels than the first.
        let filtered = settings.layout.texels(settings.size).div_ceil(3) as u64 * 4;
        let treated = match self.sun {
            SunTreatment::Keep => 0,
            SunTreatment::Remove | SunTreatment::Clamp(_) => memory::EXTRACTION_TEXEL,
        };
        let bytes = filtered * memory::IBL_TEXEL
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
    /// One of the files of a folder.
    File(IblFile),
}

impl Content {
    fn description(self, settings: &IblSettings) -> String {
        let IblSettings { layout, size, roughness, .. } = settings;
        let (a_map, picture) = match layout {
            Layout::Cube => ("a cube", "six faces"),
            Layout::Octahedral => ("an octahedral map", "an octahedral map"),
        };
        match self {
            Self::Radiance(_) | Self::File(IblFile::Radiance) => {
                format!("{a_map} of {size}x{size} texels with {} levels", roughness.len())
            }
            Self::Irradiance(_) | Self::File(IblFile::Irradiance) => {
                format!("irradiance over π, {a_map}")
            }
            Self::Table(_) | Self::File(IblFile::Table) => {
                "the table of the BRDF: cos θ to the right, roughness downward".into()
            }
            Self::File(IblFile::LevelPicture(level)) => {
                format!("level {level}, roughness {:.3}, {picture}", roughness[level])
            }
            Self::File(IblFile::IrradiancePicture) => format!("irradiance over π, {picture}"),
            Self::File(IblFile::Description) => "levels and spherical harmonics".into(),
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
                files.extend(
                    IblFile::all(n_levels).map(|f| (folder.join(f.name()), Content::File(f))),
                );
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

    fn write(&self, content: &IblFolder) -> Result<()> {
        if let Some(folder) = &self.folder {
            create_folder(folder).with_context(|| folder.display().to_string())?;
        }
        let IblFolder { light, engine, texels, .. } = *content;
        for (path, written) in &self.files {
            match written {
                Content::Radiance(file) => files::write(path, |out| file.encode(light, out))?,
                Content::Irradiance(container) => {
                    let levels = std::slice::from_ref(&light.irradiance);
                    write_texture(path, *container, &Texture::light(levels, texels).0)?;
                }
                Content::Table(container) => {
                    let table = BrdfTable::new(BrdfTable::SIZE, Engine::terms(engine));
                    write_texture(path, *container, &Texture::table(&table))?;
                }
                Content::File(file) => files::write(path, |out| content.encode(*file, out))?,
            }
        }
        Ok(())
    }
}

fn write_texture(path: &Path, container: Container, texture: &Texture) -> Result<()> {
    files::write(path, |out| container.encode(texture, out))
}
