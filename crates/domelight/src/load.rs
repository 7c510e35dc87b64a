//! From a file to a scene or an environment in one call.

use std::path::Path;

use crate::Error;
use crate::environment::Environment;
use crate::environment::io::{ProbeOptions, load_probe, probe_from_bytes};
use crate::scene::{self, LoadOptions, Resolver, Scene, SceneFormat};

impl Environment {
    /// Loads a light probe of any known format and mapping.
    ///
    /// # Errors
    /// If the file cannot be read or is damaged, or holds negative or non-finite values;
    /// [`load_probe`] takes options for these.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        let probe = load_probe(path.as_ref(), &ProbeOptions::default())?;
        Ok(Self::from_image(probe.image)?)
    }

    /// The light probe in the bytes of a picture file of any known format and mapping.
    ///
    /// # Errors
    /// If the bytes are damaged or no picture; [`probe_from_bytes`] takes options.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        let probe = probe_from_bytes(bytes, "the map", &ProbeOptions::default())?;
        Ok(Self::from_image(probe.image)?)
    }
}

impl Scene {
    /// Loads a mesh or a scene file of any known format and builds it.
    ///
    /// # Errors
    /// If the file cannot be read, is damaged, or makes no scene. [`scene::load()`] gives the loader's warnings as well, and
    /// a description to change before it is built.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        Ok(Self::new(scene::load(path)?.description)?)
    }

    /// Builds a scene from the bytes of a file, for instance where there is no file system; `resolver` gives the bytes of
    /// the files that it refers to.
    ///
    /// # Errors
    /// If the file is damaged or makes no scene. [`scene::load_bytes`] gives the loader's warnings as well, and a description to
    /// change before it is built.
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
