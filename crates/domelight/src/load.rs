//! Loads a scene or an environment from a file in one call.

use std::path::Path;

use crate::Error;
use crate::environment::Environment;
use crate::environment::io::{ProbeOptions, load_probe, probe_from_bytes};
#[cfg(feature = "io")]
use crate::scene::{self, LoadOptions, Resolver, Scene, SceneFormat};

impl Environment {
    /// Loads a light probe of any known format and mapping.
    ///
    /// # Errors
    /// If the file cannot be read, is damaged, or holds negative or non-finite values.
    /// [`load_probe`] has options for such files.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        let probe = load_probe(path.as_ref(), &ProbeOptions::default())?;
        Ok(Self::from_image(probe.image)?)
    }

    /// Reads a light probe from the bytes of a picture file in any known format and mapping.
    ///
    /// # Errors
    /// If the bytes are damaged or not a picture. [`probe_from_bytes`] has options for such files.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        let probe = probe_from_bytes(bytes, "the map", &ProbeOptions::default())?;
        Ok(Self::from_image(probe.image)?)
    }
}

#[cfg(feature = "io")]
impl Scene {
    /// Loads a mesh or a scene file of any known format and builds it.
    ///
    /// # Errors
    /// If the file cannot be read, is damaged, or holds no valid scene. [`scene::load()`] also returns the loader's
    /// warnings, and a description that you can change before building it.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        Ok(Self::new(scene::load(path)?.description)?)
    }

    /// Builds a scene from the bytes of a file, for instance without a file system. `resolver` returns the bytes of the
    /// files that the scene refers to.
    ///
    /// # Errors
    /// If the file is damaged or holds no valid scene. [`scene::load_bytes`] also returns the loader's warnings, and a
    /// description that you can change before building it.
    pub fn from_bytes(
        bytes: &[u8],
        format: SceneFormat,
        resolver: &Resolver<'_>,
    ) -> Result<Self, Error> {
        let name = format!("scene.{format}");
        let loaded = scene::load_bytes(name, bytes, resolver, &LoadOptions::default())?;
        Ok(Self::new(loaded.description)?)
    }
}
