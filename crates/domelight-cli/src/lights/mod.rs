//! `domelight lights`: converts a probe to a light rig and a residual map.

mod gaussians;
mod preview;
mod report;
mod written;

use std::fs;
use std::io::{self, IsTerminal as _};
use std::path::{Component, Path, PathBuf};

use anyhow::{Context as _, Result};
use domelight::environment::mapping::from_lat_long;
use domelight::environment::{Environment, Orientation};
use domelight::picture::exposure::Exposure;
use domelight::rig::export::{Dome, DomePicture, Format, RigExport};
use domelight::rig::{
    Extraction, ExtractionSettings, ShadingError, ShadingReference, SphericalHarmonics, extract,
    smallest_rig,
};
use domelight::scene::SceneDescription;
use domelight::{Rgb, RgbImage};

use crate::args::lights::{LightsArguments, PreviewPath, RigPath};
use crate::error::{UsageError, status, warn};
use crate::files;
use crate::memory;
use crate::output::{PictureFormat, PicturePath, print, print_json};
use crate::scene::without_camera;
use crate::terminal::Terminal;
use domelight_lab::Stopwatch;
use domelight_lab::names::file_name;
use preview::Preview;
use report::{LightsReport, Timings};
use written::WrittenFiles;

/// The default number of lights.
const N_LIGHTS: usize = 64;

/// Runs the subcommand.
pub(crate) fn run(arguments: &LightsArguments, quiet: bool) -> Result<()> {
    if let Some(n) = arguments.sg {
        return gaussians::run(arguments, n as usize, quiet);
    }
    let outputs = arguments.outputs()?;
    let preview = arguments.preview_path(&outputs, quiet);
    let dome_path = arguments.declare(&outputs, preview.as_deref())?;
    let mut watch = Stopwatch::start();

    let (environment, probe) = arguments.load(quiet)?;
    let is_turned = environment.orientation() != Orientation::default();
    for output in outputs.iter().filter(|o| is_turned && o.format == Format::Sibl) {
        let path = output.path.display();
        let text = "an .ibl file cannot state the orientation of its panorama: turn the lights and the panorama in the \
                    program that opens it";
        warn(quiet, &format!("{path}: {text}"));
    }
    let load = watch.lap();
    let measured = preview.is_some() || arguments.json;
    let found = arguments.find(&environment, measured).with_context(|| probe.clone())?;
    let extract = watch.lap();

    let domes = match (&dome_path, &found.extraction.residual) {
        (Some(path), Some(dome)) => arguments.write_dome(path, &dome.radiance_map(), &outputs)?,
        // The sun and the lamps are all of the light.
        (Some(path), None) if !arguments.has_regions() => {
            let RgbImage { width, height, .. } = *environment.map();
            arguments.write_dome(path, &RgbImage::filled(width, height, Rgb::BLACK), &outputs)?
        }
        _ if arguments.keep_residual.is_some() => {
            return Err(UsageError(NOTHING_LEFT.into()).into());
        }
        _ => DomeFiles { written: Vec::new(), of_outputs: vec![None; outputs.len()] },
    };
    let harmonics = found.extraction.residual.as_ref().map(SphericalHarmonics::project);
    let probe_name = file_name(&probe);
    for (output, dome_file) in outputs.iter().zip(&domes.of_outputs) {
        let file = dome_file.as_ref().map(|dome| refer(output.path, dome)).transpose()?;
        let rig = RigExport {
            probe: &probe_name,
            orientation: environment.orientation(),
            lights: &found.extraction.rig.lights,
            dome: harmonics.zip(found.extraction.residual.as_ref()).map(
                |(harmonics, environment)| Dome { environment, harmonics, file: file.as_deref() },
            ),
        };
        let bytes = output.format.encode(&rig).with_context(|| probe.clone())?;
        files::write(output.path, |out| out.write_all(&bytes))?;
    }
    if let Some(path) = &preview {
        let map = environment.radiance_map();
        let tone = arguments.tone.of_picture(|| Exposure::Auto.stops(&map, None));
        let preview =
            Preview { environment: &environment, map: &map, found: &found, probe: &probe, tone };
        let bytes = preview.png()?;
        files::write(path, |out| out.write_all(&bytes))?;
    }
    let timings = Timings { load, extract, write: watch.lap() };
    let written =
        WrittenFiles { rigs: &outputs, domes: &domes.written, preview: preview.as_deref() };
    let report = LightsReport {
        arguments,
        probe: &probe,
        found: &found,
        timings,
        dome: harmonics,
        written: &written,
    };
    if arguments.json {
        print_json(&report.json())?;
    } else if !quiet && arguments.n_on_standard_output() == 0 {
        print(&report.table())?;
    } else if !quiet {
        written.lines().iter().for_each(|line| status(line));
    }
    Ok(())
}

/// The message if there is nothing to write for --keep-residual.
const NOTHING_LEFT: &str = "nothing is left for --keep-residual: the lights use the whole probe. Omit -n and --error to \
                            keep the light that --sun and --lamps do not use, or leave dim lights in the map with \
                            --min-energy";

/// The pictures of a dome.
struct DomeFiles {
    /// All of them.
    written: Vec<PathBuf>,
    /// The one that each output names.
    of_outputs: Vec<Option<PathBuf>>,
}

/// A rig and its error, if known.
pub(crate) struct ExtractedRig {
    pub(crate) extraction: Extraction,
    /// Numbers of lights that were tried for `--error`, rising; else the rig's alone, if it was
    /// measured.
    pub(crate) errors: Vec<(usize, ShadingError)>,
}

impl ExtractedRig {
    /// The rig's own error.
    pub(crate) fn error(&self) -> Option<ShadingError> {
        let n = self.extraction.rig.lights.len();
        self.errors.iter().find(|(tried, _)| *tried == n).map(|(_, error)| *error)
    }
}

/// A rig's output file with its format.
struct Output<'a> {
    path: &'a Path,
    format: Format,
}

impl LightsArguments {
    /// Whether regions of the map become lights.
    fn has_regions(&self) -> bool {
        self.n_lights.is_some() || self.error.is_some() || !(self.sun || self.lamps > 0)
    }

    /// Whether lights may leave something of the map: what is not compact, lights that are too dim, or all regions, if
    /// -n allows only for the sun and lamps.
    fn may_leave_light(&self) -> bool {
        !self.has_regions() || self.min_energy.is_some() || self.sun || self.lamps > 0
    }

    fn settings(&self) -> ExtractionSettings {
        ExtractionSettings {
            sun: self.sun,
            n_lamps: self.lamps as usize,
            n_lights: self.has_regions().then(|| self.n_lights.map_or(N_LIGHTS, |n| n as usize)),
            method: self.method,
            min_share: self.min_energy.map(|percent| (0.01 * percent) as f32),
        }
    }

    /// The files with their formats, checked for conflicts.
    fn outputs(&self) -> Result<Vec<Output<'_>>> {
        if self.n_on_standard_output() > 1 {
            let message = "only one result can go to standard output; give a file name";
            return Err(UsageError(message.into()).into());
        }
        if self.keep_residual.is_some() && !self.may_leave_light() {
            return Err(UsageError(NOTHING_LEFT.into()).into());
        }
        let outputs: Vec<_> = self.output.iter().map(|o| self.output(o)).collect::<Result<_>>()?;
        let unnamed = self.keep_residual.as_ref().is_some_and(PicturePath::is_standard_output);
        if let Some(o) = outputs.iter().find(|o| unnamed && o.format.dome_picture().is_some()) {
            let message = format!(
                "a {} file names the residual map: give --keep-residual a file name instead of -",
                o.format
            );
            return Err(UsageError(message).into());
        }
        Ok(outputs)
    }

    fn output<'a>(&self, output: &'a RigPath) -> Result<Output<'a>> {
        let on_standard_output = output.is_standard_output().then_some(Format::Json);
        let format = output.format.or(self.format).or(on_standard_output);
        let Some(format) = format else {
            let extensions = Format::ALL.map(|f| format!(".{}", f.extensions()[0])).join(", ");
            let path = output.path.display();
            let message = format!("-o {path}: name it {extensions}, or give --format");
            return Err(UsageError(message).into());
        };
        Ok(Output { path: &output.path, format })
    }

    fn n_on_standard_output(&self) -> usize {
        let rigs = self.output.iter().filter(|o| o.is_standard_output()).count();
        let residual = self.keep_residual.as_ref().is_some_and(PicturePath::is_standard_output);
        let preview =
            matches!(&self.preview, Some(PreviewPath::Png(path)) if path == Path::new("-"));
        rigs + [residual, preview, self.json].map(usize::from).iter().sum::<usize>()
    }

    /// The output of the preview, if any: as requested, or on a terminal next to the first rig.
    fn preview_path(&self, outputs: &[Output], quiet: bool) -> Option<PathBuf> {
        match &self.preview {
            Some(PreviewPath::None) => return None,
            Some(PreviewPath::Png(path)) => return Some(path.clone()),
            None if quiet || self.json || !io::stderr().is_terminal() => return None,
            None => {}
        }
        let first = outputs.iter().find(|output| output.path != Path::new("-"))?;
        let stem = first.path.file_stem().unwrap_or_default().to_string_lossy();
        Some(first.path.with_file_name(format!("{stem}_preview.png")))
    }

    /// Declares all possible outputs. Returns the file of the dome's map, if there may be one.
    fn declare(&self, outputs: &[Output], preview: Option<&Path>) -> Result<Option<PicturePath>> {
        outputs.iter().try_for_each(|o| files::writes(o.path))?;
        preview.map_or(Ok(()), files::writes)?;
        let Some(dome) = self.dome_path(outputs)? else { return Ok(None) };
        let mut pictures = vec![dome.path.clone()];
        for picture in outputs.iter().filter_map(|output| output.format.dome_picture()) {
            pictures.push(picture_path(&dome, picture)?.path);
        }
        // Several rigs may name the same picture.
        pictures.sort();
        pictures.dedup();
        pictures.iter().try_for_each(|path| files::writes(path))?;
        Ok(Some(dome))
    }

    fn load(&self, quiet: bool) -> Result<(Environment, String)> {
        let settings = without_camera(&self.light)?;
        let light = settings.over(&SceneDescription::default());
        let map = settings.load(&light, &Terminal { quiet })?;
        let probe = self.light.map.clone().unwrap_or_default();
        let more = memory::EXTRACTION_TEXEL - Environment::MEMORY_PER_TEXEL;
        memory::allow(&format!("{probe}: its lights"), more * map.pixels.len() as u64)?;
        let environment = light.environment(map).with_context(|| probe.clone())?;
        Ok((environment, probe))
    }

    /// The rig; its error if it was searched for by error, or is to be `measured`.
    fn find(&self, environment: &Environment, measured: bool) -> Result<ExtractedRig> {
        let settings = self.settings();
        if let Some(percent) = self.error {
            let found = smallest_rig(environment, settings, 0.01 * percent)?;
            return Ok(ExtractedRig { extraction: found.extraction, errors: found.tried });
        }
        let extraction = extract(environment, settings)?;
        let mut errors = Vec::new();
        if measured {
            errors.push((extraction.rig.lights.len(), measure(environment, &extraction)));
        }
        Ok(ExtractedRig { extraction, errors })
    }

    /// The file of the dome's map, if there may be a residual: as requested, or next to the first rig that refers to it.
    fn dome_path(&self, outputs: &[Output]) -> Result<Option<PicturePath>> {
        if !self.may_leave_light() {
            return Ok(None);
        }
        if let Some(path) = &self.keep_residual {
            return Ok(Some(path.clone()));
        }
        let needs =
            outputs.iter().find(|o| o.format.dome_picture().is_some() && o.path != Path::new("-"));
        let Some(output) = needs else { return Ok(None) };
        let stem = output.path.file_stem().unwrap_or_default().to_string_lossy();
        let path = output.path.with_file_name(format!("{stem}_dome.exr"));
        Ok(Some(path.to_string_lossy().parse::<PicturePath>().map_err(UsageError)?))
    }
}

impl LightsArguments {
    /// Writes the dome's map and its other pictures that outputs need.
    fn write_dome(
        &self,
        path: &PicturePath,
        map: &RgbImage,
        outputs: &[Output],
    ) -> Result<DomeFiles> {
        let tone = self.tone.of_measurement(|| Exposure::Auto.stops(map, None));
        path.write(map, tone, PictureFormat::Exr, None)?;
        let mut domes = DomeFiles { written: vec![path.path.clone()], of_outputs: Vec::new() };
        for output in outputs {
            let picture = output.format.dome_picture().unwrap_or(DomePicture::LatLong);
            let file = picture_path(path, picture)?;
            if !domes.written.contains(&file.path) {
                let mapping = picture.mapping();
                let size = mapping.size_of([map.width, map.height]);
                let converted = from_lat_long(map, mapping, size);
                file.write(&converted, tone, PictureFormat::Exr, Some(mapping))?;
                domes.written.push(file.path.clone());
            }
            domes.of_outputs.push(Some(file.path));
        }
        Ok(domes)
    }
}

/// The name of a picture of the dome beside its map: `dome.exr`, `dome.hdr`, `dome_octahedral.exr`.
fn picture_path(map: &PicturePath, picture: DomePicture) -> Result<PicturePath> {
    let path = match picture {
        DomePicture::LatLongExrOrHdr if is_pfm(&map.path) => map.path.with_extension("exr"),
        DomePicture::LatLong | DomePicture::LatLongExrOrHdr => map.path.clone(),
        DomePicture::LatLongHdr => map.path.with_extension("hdr"),
        DomePicture::Octahedral => {
            let [stem, extension] = [map.path.file_stem(), map.path.extension()]
                .map(|part| part.unwrap_or_default().to_string_lossy());
            map.path.with_file_name(format!("{stem}_octahedral.{extension}"))
        }
    };
    Ok(path.to_string_lossy().parse::<PicturePath>().map_err(UsageError)?)
}

fn is_pfm(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("pfm"))
}

fn measure(environment: &Environment, found: &Extraction) -> ShadingError {
    let reference = ShadingReference::new(environment);
    match &found.residual {
        Some(dome) => reference.error_beside(&found.rig, &ShadingReference::new(dome)),
        None => reference.error(&found.rig),
    }
}

/// How a rig's file refers to the dome's: by its path from the rig's folder, which names no other folder of the machine
/// than those between the two.
fn refer(rig: &Path, dome: &Path) -> Result<String, UsageError> {
    let folder = |path: &Path| {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        fs::canonicalize(folder.unwrap_or(Path::new(".")))
    };
    // On Windows another drive has no path from here.
    let name = match (folder(rig), folder(dome), dome.file_name()) {
        (Ok(from), Ok(to), Some(name)) => path_between(&from, &to).join(name),
        _ => dome.to_path_buf(),
    };
    let refuse = || UsageError(format!("{}: its name is not UTF-8", name.display()));
    let text = name.to_str().ok_or_else(refuse)?;
    // Elsewhere, a backslash is an ordinary character.
    Ok(if cfg!(windows) { text.replace('\\', "/") } else { text.to_owned() })
}

/// The path from one folder to another, both without links.
fn path_between(from: &Path, to: &Path) -> PathBuf {
    let (from, to): (Vec<_>, Vec<_>) = (from.components().collect(), to.components().collect());
    let n_common = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    if n_common == 0 {
        return to.iter().collect();
    }
    let up = from[n_common..].iter().map(|_| Component::ParentDir);
    up.chain(to[n_common..].iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_lead_from_folder_to_folder() {
        for (from, to, path) in [
            ("/a/rigs", "/a/rigs", ""),
            ("/a/rigs", "/a/maps/hdr", "../maps/hdr"),
            ("/a", "/a/maps", "maps"),
            ("/a/b/c", "/", "../../.."),
        ] {
            assert_eq!(path_between(Path::new(from), Path::new(to)), Path::new(path));
        }
    }
}
