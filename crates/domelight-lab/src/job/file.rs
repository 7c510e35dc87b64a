//! The scene's file, and which part of it to show.

use std::path::{Path, PathBuf};
use std::str::FromStr as _;

use clap::Args;
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{AnimationTime, LoadOptions, SceneDescription, load_with};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::defaults;
use super::value::Finite;
use crate::names::without_folders;
use crate::{Error, Host};

/// Which part of a file to show, and how strictly to read it.
#[derive(Args, Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[command(next_help_heading = "Scene file")]
#[serde(default, deny_unknown_fields)]
pub struct FilePart {
    /// Scene of a glTF file, by name or by number from 0 [default: the file's default scene]
    #[arg(id = "file.scene", long = "scene", value_name = "NAME|N")]
    pub scene: Option<String>,
    /// Animation of a glTF file, by name or by number from 0 [default: none, the rest pose]
    #[arg(id = "file.animation", long = "animation", value_name = "NAME|N")]
    pub animation: Option<String>,
    /// Time in the animation [seconds]
    #[arg(
        id = "file.at",
        long = "at",
        value_name = "SECONDS",
        default_value = "0",
        requires = "file.animation"
    )]
    pub at: Finite,
}

impl Default for FilePart {
    fn default() -> Self {
        defaults()
    }
}

impl FilePart {
    /// Rejects options that a built-in scene does not have.
    pub(crate) fn check_builtin(&self, scene: &str) -> Result<(), Error> {
        match (&self.scene, &self.animation) {
            (None, None) => Ok(()),
            _ => Err(Error::Usage(format!(
                "--scene and --animation choose in a glTF file; {scene} is built in"
            ))),
        }
    }

    /// Reads this part of a file, with what will not be shown, one sentence per item, without folders.
    ///
    /// # Errors
    /// If a file cannot be read, is damaged, or has no such part.
    pub fn load(
        &self,
        path: &Path,
        strict: bool,
        host: &dyn Host,
    ) -> Result<(SceneDescription, Vec<String>), Error> {
        host.reads(path)?;
        let animation = self.animation.clone();
        let options = LoadOptions {
            max_memory: host.memory_left(),
            strict,
            scene: self.scene.clone(),
            animation: animation.map(|name| AnimationTime { name, seconds: self.at.get() }),
            ..LoadOptions::default()
        };
        let loaded = load_with(path, &options)?;
        loaded.files.iter().try_for_each(|file| host.reads(file))?;
        host.keeps_memory(loaded.memory);
        for warning in &loaded.warnings {
            host.warn(warning);
        }
        let files = || loaded.files.iter().map(PathBuf::as_path).chain([path]);
        let shared = |text: &String| without_folders(text, files());
        let warnings = loaded.warnings.iter().map(shared).collect();
        Ok((loaded.description, warnings))
    }
}

/// A built-in scene by its name, or else a file, with what will not be shown, one sentence per item, without folders.
pub(crate) fn load_scene(
    name: &str,
    part: &FilePart,
    strict: bool,
    host: &dyn Host,
) -> Result<(SceneDescription, Vec<String>), Error> {
    if let Ok(builtin) = BuiltinScene::from_str(name) {
        return Ok((builtin.description(), Vec::new()));
    }
    part.load(Path::new(name), strict, host)
}
