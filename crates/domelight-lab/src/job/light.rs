//! The light: a map and how it is used.

use std::path::Path;
use std::str::FromStr as _;

use clap::Args;
use domelight::RgbImage;
use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::convention::Convention;
use domelight::environment::io::{ProbeError, ProbeOptions, Window};
use domelight::environment::mapping::{CubeFaces, Mapping};
use domelight::environment::{Environment, UpAxis};
use domelight::math::Vec3;
use domelight::picture::{PictureError, PictureErrorKind};
use domelight::rig::ibl::Engine;
use domelight::scene::{EnvironmentSettings, EnvironmentSource, LoadError, SceneDescription};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::defaults;
use super::value::{Choice, Count, Finite, NotNegative, Rotation, Text};
use crate::{Error, Host};

/// The light. What is not said comes from the scene.
#[derive(Args, Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[command(next_help_heading = "Environment")]
#[serde(default, deny_unknown_fields)]
pub struct Light {
    /// A built-in probe (sky, studio, cathedral, constant) or a file (.hdr, .exr, .pfm, .ktx2, .dds, .png,
    /// .jpg; - reads standard input) [default: the scene's, otherwise sky]
    #[arg(id = "light.map", long = "env", value_name = "PROBE")]
    pub map: Option<String>,
    /// Program that the scene comes from: the map is oriented as in that program (domelight conventions lists how)
    /// [default: the map's center is toward -Z, or toward +Y if its top is toward +Z]
    #[arg(id = "light.convention", long = "env-convention", value_name = "PROGRAM")]
    pub convention: Option<Choice<Convention>>,
    /// Rotate the environment about the up axis, counterclockwise as seen from above [degrees]; with a
    /// camera, auto puts its sun or brightest side to the left of it
    #[arg(id = "light.rotate", long = "env-rotate", value_name = "DEG|auto")]
    pub rotate: Option<Text<Rotation>>,
    /// Multiply the environment's radiance
    #[arg(id = "light.scale", long = "env-scale", value_name = "X")]
    pub scale: Option<NotNegative>,
    /// Multiply the environment's radiance by 2^EV
    #[arg(id = "light.exposure", long = "env-exposure", value_name = "EV")]
    pub exposure: Option<Finite>,
    /// World axis toward which the top of the map points
    #[arg(id = "light.up", long = "env-up", value_name = "AXIS")]
    pub up: Option<Choice<UpAxis>>,
    /// Layout of the map [default: inferred from the shape and the attributes of the file]
    #[arg(id = "light.mapping", long = "env-mapping", value_name = "MAPPING")]
    pub mapping: Option<Choice<Mapping>>,
    /// Faces of an unfolded cube in reading order, with degrees by which they are turned clockwise, such as F,R,B180,L,U,D
    /// (front, right, back, left, up, down) [default: as in the layout]
    #[arg(id = "light.faces", long = "env-faces", value_name = "LIST")]
    pub faces: Option<Text<CubeFaces>>,
    /// Window of an OpenEXR map that is the map [default: the data window if it has the shape of a map]
    #[arg(id = "light.window", long = "env-window", value_name = "WINDOW")]
    pub window: Option<Choice<Window>>,
    /// Layer of an OpenEXR map
    #[arg(id = "light.layer", long = "env-layer", value_name = "NAME")]
    pub layer: Option<String>,
    /// Number of rows of a built-in probe
    #[arg(id = "light.rows", long = "env-rows", value_name = "ROWS", default_value = "1024")]
    pub rows: Count<1, 16_384>,
    /// Refuse input that is otherwise repaired or skipped with a warning: negative, NaN and infinite texels, non-finite
    /// vertices, images and material libraries that cannot be read, and unknown extensions that a glTF file requires
    #[arg(id = "light.strict", long = "strict")]
    pub strict: bool,
}

impl Default for Light {
    fn default() -> Self {
        defaults()
    }
}

/// The name of the probe, for messages.
pub fn probe_name(source: &EnvironmentSource) -> String {
    match source {
        EnvironmentSource::File(path) => path.display().to_string(),
        EnvironmentSource::Builtin(name) => name.clone(),
    }
}

impl Light {
    /// The scene's own settings, overridden by these.
    pub fn over(&self, scene: &SceneDescription) -> EnvironmentSettings {
        let source = |name: &str| match BuiltinProbe::from_str(name) {
            Ok(probe) => EnvironmentSource::Builtin(probe.name().to_owned()),
            Err(_) => EnvironmentSource::File(name.into()),
        };
        let plain = |source| EnvironmentSettings::new(source, scene.up.unwrap_or_default());
        self.over_settings(match (&self.map, &scene.environment) {
            // Another probe does not inherit the first one's adjustments.
            (Some(name), _) => plain(source(name)),
            (None, Some(of_scene)) => of_scene.clone(),
            (None, None) => plain(source(BuiltinProbe::Sky.name())),
        })
    }

    /// The settings of a map, overridden by these.
    pub fn over_settings(&self, mut settings: EnvironmentSettings) -> EnvironmentSettings {
        let rotate = self.rotate.and_then(|Text(rotate)| rotate.degrees());
        let turn = self.convention.map_or(0.0, |Choice(convention)| convention.rotation());
        settings.rotate_degrees = rotate.unwrap_or(settings.rotate_degrees) + turn;
        settings.scale = self.scale.map_or(settings.scale, NotNegative::get);
        settings.exposure = self.exposure.map_or(settings.exposure, Finite::get);
        settings.up = self.up.map_or(settings.up, |Choice(up)| up);
        settings
    }

    /// Reads or creates the lat-long map.
    ///
    /// # Errors
    /// If it cannot be read, or needs too much memory.
    pub fn load(&self, light: &EnvironmentSettings, host: &dyn Host) -> Result<RgbImage, Error> {
        let path = match &light.source {
            EnvironmentSource::Builtin(name) => {
                let probe = BuiltinProbe::from_str(name);
                let probe = probe.map_err(|error| match &light.referrer {
                    Some(referrer) => Error::Usage(format!("{referrer}: {error}")),
                    None => Error::Usage(error.to_string()),
                })?;
                let chosen = [self.mapping.is_some(), self.faces.is_some(), self.window.is_some()];
                if self.layer.is_some() || chosen.contains(&true) {
                    host.warn(&format!(
                        "{name} is built in: its layer, mapping, faces and window cannot be chosen"
                    ));
                }
                let rows = u64::from(self.rows.get());
                let bytes = Environment::MEMORY_PER_TEXEL * 2 * rows * rows;
                host.take_memory(&format!("{name} with {rows} rows"), bytes)?;
                return Ok(self.in_convention(probe.image(self.rows.get() as usize)));
            }
            EnvironmentSource::File(path) => path,
        };
        let options = ProbeOptions {
            mapping: self.mapping.map(|Choice(mapping)| mapping),
            faces: self.faces.map(|Text(faces)| faces),
            window: self.window.map(|Choice(window)| window),
            layer: self.layer.clone(),
            cube_axes: self.convention.and_then(|Choice(program)| cube_axes(program)),
            strict: self.strict,
            max_memory: host.memory_left(),
        };
        host.reads(path)?;
        let loaded = host.load_probe(path, &options);
        let loaded = loaded.map_err(|error| of_scene_file(error, path, light))?;
        let texels = loaded.image.pixels.len() as u64;
        host.take_memory(&path.display().to_string(), Environment::MEMORY_PER_TEXEL * texels)?;
        loaded.warnings.iter().for_each(|warning| host.warn(warning));
        Ok(self.in_convention(loaded.image))
    }

    /// The map as it is taken, if it comes from another program.
    fn in_convention(&self, map: RgbImage) -> RgbImage {
        match self.convention {
            Some(Choice(convention)) => convention.from_program(map),
            None => map,
        }
    }
}

/// What a cube texture shows at its axes, if it was made for a program that takes cubes.
fn cube_axes(program: Convention) -> Option<[Vec3; 3]> {
    Engine::of_convention(program).map(|engine| engine.axes().world)
}

/// An error in loading a probe, with the line of the scene file that names it, if there is one.
fn of_scene_file(error: Error, path: &Path, light: &EnvironmentSettings) -> Error {
    let Some(referrer) = &light.referrer else { return error };
    match error {
        Error::Probe(ProbeError::Picture(PictureError {
            kind: PictureErrorKind::Io(source),
            ..
        })) => {
            let (path, referrer) = (path.to_owned(), format!("{referrer},"));
            LoadError::ReadReferenced { path, referrer, source }.into()
        }
        Error::Probe(error) => Error::At { place: referrer.clone(), error: Box::new(error.into()) },
        other => other,
    }
}
