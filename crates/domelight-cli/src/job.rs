//! The job of a command line: what a picture or a job file says, with the options that are given instead.

use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr as _;

use anyhow::{Context as _, Result};
use domelight::environment::builtin::BuiltinProbe;
use domelight::picture::exr::plain_attributes;
use domelight::scene::builtin::BuiltinScene;
use domelight_lab::job::{self, Given, Job, Pixel, SceneSettings};
use domelight_lab::names::shared_word;

use crate::error::{UsageError, warn};
use crate::files;

/// The job of the command line. If its scene is a picture that domelight rendered, or a file that holds a job, that
/// job, with the options that are `given` instead.
pub(crate) fn resolve(job: &Job, given: &Given, quiet: bool) -> Result<Job> {
    let path = Path::new(&job.scene);
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    let found = match extension.as_deref() {
        Some("exr") => Some(of_picture(path, quiet)?),
        Some("toml") => of_file(path)?,
        _ => None,
    };
    let Some(found) = found else { return Ok(job.clone()) };
    let changed = found.with(job, given);
    Ok(changed.map_err(|error| UsageError(format!("{}: {error}", path.display())))?)
}

/// The scene of the command line, and its points, as [`resolve`] does.
pub(crate) fn resolve_scene(
    scene: &SceneSettings,
    pixel: &Pixel,
    given: &Given,
    quiet: bool,
) -> Result<(SceneSettings, Pixel)> {
    let SceneSettings { scene, file, light, view, subject } = scene.clone();
    let job = Job { scene, file, light, view, subject, pixel: pixel.clone(), ..Job::default() };
    let job = resolve(&job, given, quiet)?;
    Ok((job.scene_settings(), job.pixel))
}

/// The job that made a picture.
fn of_picture(path: &Path, quiet: bool) -> Result<Job> {
    let name = || path.display().to_string();
    files::reads(path)?;
    let bytes = fs::read(path).with_context(name)?;
    let attributes = plain_attributes(&bytes).with_context(name)?;
    let value = |name| attributes.iter().find(|(n, _)| n == name).map(|(_, value)| &value[..]);
    let Some(text) = value(job::ATTRIBUTE) else {
        let why =
            "it does not say how it was made: domelight did not render it, or an older version did";
        return Err(UsageError(format!("{}: {why}", name())).into());
    };
    let mut job = Job::from_toml(text)
        .map_err(|error| UsageError(format!("{}: the job in it: {error}", name())))?;
    map_inputs(&mut job, |name| beside(name, path));
    for input in value(job::INPUTS_ATTRIBUTE).unwrap_or_default().lines() {
        let Some((hash, input)) = input.split_once(' ') else { continue };
        let found = beside(Path::new(input), path);
        match files::fingerprint(&found) {
            Some(now) if now == hash => {}
            Some(_) => warn(
                quiet,
                &format!("{}: it changed since {} was rendered", found.display(), name()),
            ),
            None => warn(quiet, &format!("{}: not found, but {} was made of it", input, name())),
        }
    }
    Ok(job)
}

/// The job in a TOML file, if it holds more than the description of a scene.
fn of_file(path: &Path) -> Result<Option<Job>> {
    // Whatever is wrong with the file itself, the loader of scenes says.
    let Some(found) = fs::read_to_string(path).ok().as_deref().and_then(Job::in_scene_file) else {
        return Ok(None);
    };
    let (mut job, names_scene) =
        found.map_err(|error| UsageError(format!("{}: {error}", path.display())))?;
    files::reads(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    map_inputs(&mut job, |name| folder.join(name));
    if !names_scene {
        job.scene = path.display().to_string();
    }
    Ok(Some(job))
}

/// Changes the names of the files that a job reads.
fn map_inputs(job: &mut Job, change: impl Fn(&Path) -> PathBuf) {
    let changed = |name: &str| change(Path::new(name)).display().to_string();
    if BuiltinScene::from_str(&job.scene).is_err() {
        job.scene = changed(&job.scene);
    }
    if let Some(map) = &mut job.light.map
        && BuiltinProbe::from_str(map).is_err()
        && map != "-"
    {
        *map = changed(map);
    }
}

/// A file that a picture names: as it is named, or else beside the picture.
fn beside(name: &Path, picture: &Path) -> PathBuf {
    let there = picture.parent().unwrap_or(Path::new("")).join(name);
    if !name.exists() && there.exists() { there } else { name.to_owned() }
}

/// The attributes of a picture that say how to render it again: the job, without folders of this machine, and the
/// fingerprints of the files that it read, except the `source` of the job.
pub(crate) fn attributes(job: &Job, source: &str) -> Vec<(String, String)> {
    let is_input = |path: &Path| path != Path::new(source) || job.scene == source;
    let mut shared = job.clone();
    map_inputs(&mut shared, |name| shared_word(&name.to_string_lossy()).into());
    let inputs = files::inputs().into_iter().filter(|path| is_input(path)).filter_map(|path| {
        let name = shared_word(&path.to_string_lossy());
        Some(format!("{} {name}", files::fingerprint(&path)?))
    });
    let inputs = inputs.collect::<Vec<_>>().join("\n");
    let inputs = (!inputs.is_empty()).then(|| (job::INPUTS_ATTRIBUTE.to_owned(), inputs));
    [(job::ATTRIBUTE.to_owned(), shared.to_toml())].into_iter().chain(inputs).collect()
}
