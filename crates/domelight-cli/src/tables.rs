//! `domelight tables`: writes a light probe for shaders to sample.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use domelight::environment::Environment;
use domelight::picture::exr::ExrLayers;
use domelight::picture::texture::{Texture, ktx2};
use domelight::rig::tables::{ShaderLanguage, ShaderTables, TableSettings};
use domelight::scene::SceneDescription;
use domelight::{Rgb, RgbImage};
use serde_json::json;

use crate::args::tables::{TablesArguments, TablesFormat};
use crate::files;
use crate::memory;
use crate::output::{print, print_json};
use crate::scene::without_camera;
use crate::terminal::Terminal;
use domelight_lab::names::file_name;

/// Runs the subcommand.
pub(crate) fn run(arguments: &TablesArguments, quiet: bool) -> Result<()> {
    let snippets = arguments.snippets();
    for path in
        arguments.output.iter().map(|output| &output.path).chain(snippets.iter().map(|s| &s.0))
    {
        files::writes(path)?;
    }
    let (environment, probe) = arguments.load(quiet)?;
    let tables =
        ShaderTables::new(&environment, arguments.settings()).with_context(|| probe.clone())?;
    for output in &arguments.output {
        match output.format {
            TablesFormat::Binary => {
                files::write(&output.path, |out| out.write_all(&tables.to_bytes()))?;
            }
            TablesFormat::Exr => write_exr(&output.path, &tables)?,
            TablesFormat::Ktx2 => {
                let texture = Texture::shader_tables(&tables);
                files::write(&output.path, |out| ktx2::encode(&texture, out))?;
            }
        }
    }
    for (path, language) in &snippets {
        files::write(path, |out| out.write_all(language.snippet().as_bytes()))?;
    }
    report(arguments, &environment, &tables, &probe, quiet)
}

impl TablesArguments {
    fn settings(&self) -> TableSettings {
        TableSettings { texels: self.texels as usize, compensated: self.mis_compensation }
    }

    /// The snippets' files, beside the first output.
    fn snippets(&self) -> Vec<(PathBuf, ShaderLanguage)> {
        let beside = |language: ShaderLanguage| {
            self.output
                .first()
                .map(|output| (output.path.with_extension(language.extension()), language))
        };
        let mut snippets: Vec<_> = self.snippet.iter().copied().filter_map(beside).collect();
        snippets.dedup();
        snippets
    }

    fn load(&self, quiet: bool) -> Result<(Environment, String)> {
        let given = without_camera(&self.light)?;
        let light = given.over(&SceneDescription::default());
        let map = given.load(&light, &Terminal { quiet })?;
        let probe = self.light.map.clone().unwrap_or_default();
        let texels = map.pixels.len() as u64;
        let bytes = Environment::MEMORY_PER_TEXEL * texels
            + memory::TABLES_TEXEL * texels.min(u64::from(self.texels));
        memory::allow(&format!("{probe}: its tables"), bytes)?;
        let environment = light.environment(map).with_context(|| probe.clone())?;
        Ok((environment, file_name(&probe)))
    }
}

/// The texture as a picture: four channels, bit for bit.
fn write_exr(path: &Path, tables: &ShaderTables) -> Result<()> {
    let texture = tables.texture();
    let width = tables.texture_width();
    let pixels = texture.iter().map(|&[r, g, b, _]| Rgb::new(r, g, b)).collect();
    let alpha: Vec<f32> = texture.iter().map(|group| group[3]).collect();
    let picture = RgbImage::new(width, texture.len() / width, pixels);
    let bytes = ExrLayers::from_image(&picture, Some(&alpha)).encode()?;
    files::write(path, |out| out.write_all(&bytes))
}

fn report(
    arguments: &TablesArguments,
    environment: &Environment,
    tables: &ShaderTables,
    probe: &str,
    quiet: bool,
) -> Result<()> {
    let columns = tables.texture_width();
    let rows = tables.groups.len().div_ceil(columns);
    let snippets = arguments.snippets();
    if arguments.json {
        let outputs = arguments.output.iter().map(|output| &output.path);
        let names = outputs.chain(snippets.iter().map(|(path, _)| path));
        return print_json(&json!({
            "probe": probe,
            "width": tables.width,
            "height": tables.height,
            "averaged": tables.width * tables.height < environment.map().pixels.len(),
            "mis_compensation": arguments.mis_compensation,
            "columns": columns,
            "rows": rows,
            "power": environment.power() * environment.unit(),
            "files": names.map(|path| path.to_string_lossy()).collect::<Vec<_>>(),
        }));
    }
    if quiet {
        return Ok(());
    }
    let tables_of = |path: &PathBuf| {
        format!(
            "-> {}: {}x{} texels in {columns}x{rows} groups of four floats",
            path.display(),
            tables.width,
            tables.height
        )
    };
    let code_of = |(path, language): &(PathBuf, ShaderLanguage)| {
        format!("-> {}: domelight_sample and domelight_pdf in {}", path.display(), language.name())
    };
    let lines = arguments.output.iter().map(|output| tables_of(&output.path));
    print(&lines.chain(snippets.iter().map(code_of)).collect::<Vec<_>>().join("\n"))
}
