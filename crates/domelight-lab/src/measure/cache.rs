//! References in the user's cache folder, by content.
//!
//! An entry is `KEY-SUM.exr`: KEY is the fingerprint of everything that decides the picture, SUM that of
//! the file itself, so that a damaged entry is detected and rendered again.

use std::fmt::Display;
use std::fs;
use std::path::{Path, PathBuf};

use domelight::files::{create_folder, remove_abandoned, write_atomically};
use domelight::fingerprint::{Fingerprint, Fingerprinter};
use etcetera::base_strategy::{BaseStrategy as _, choose_native_strategy};

use crate::scene::PreparedSceneRef;
use crate::{At as _, Error, Host};

/// A folder of references.
#[derive(Clone, Debug)]
pub struct Cache {
    folder: PathBuf,
    program: String,
}

impl Cache {
    /// The requested folder, or else that of the platform; `None` with a warning if there is none. `program` is the fingerprint
    /// of the renderer, because another build may make other pictures.
    pub fn new(folder: Option<&Path>, program: &str, host: &dyn Host) -> Option<Self> {
        let folder = folder.map(Path::to_path_buf).or_else(Self::user_folder);
        if folder.is_none() {
            host.warn(
                "there is no home folder for the cache of references; name one with --cache FOLDER",
            );
        }
        Some(Self { folder: folder?, program: program.to_owned() })
    }

    /// The platform's folder for the user's references; `None` without a home folder.
    pub fn user_folder() -> Option<PathBuf> {
        Some(choose_native_strategy().ok()?.cache_dir().join("domelight"))
    }

    /// The entry and its bytes, if it exists and is valid. A damaged entry is removed.
    pub(crate) fn get(&self, key: &Key, host: &dyn Host) -> Option<(PathBuf, Vec<u8>)> {
        let entries = fs::read_dir(&self.folder).ok()?.flatten().map(|entry| entry.path());
        for path in entries {
            let Some(sum) = key.sum_in(&path) else { continue };
            // A pipe might never end.
            if !fs::metadata(&path).is_ok_and(|there| there.is_file()) {
                continue;
            }
            match fs::read(&path) {
                Ok(bytes) if of(&bytes).to_string() == sum => return Some((path, bytes)),
                _ => {
                    host.warn(&format!("{}: damaged; it is rendered again", path.display()));
                    let _ = fs::remove_file(&path);
                }
            }
        }
        None
    }

    /// Stores the bytes if possible. Otherwise it only warns, because the render is still available.
    pub(crate) fn put(&self, key: &Key, bytes: &[u8], host: &dyn Host) -> Option<PathBuf> {
        let kept = self.try_put(key, bytes);
        kept.inspect_err(|error| host.warn(&format!("the reference cannot be cached: {error}")))
            .ok()
    }

    fn try_put(&self, key: &Key, bytes: &[u8]) -> Result<PathBuf, Error> {
        let folder = &self.folder;
        create_folder(folder).at(format!("cannot make the cache folder {}", folder.display()))?;
        let path = folder.join(format!("{}-{}.exr", key.0, of(bytes)));
        remove_abandoned(folder);
        // A pipe would be written to directly, and wait for its reader.
        if fs::metadata(&path).is_ok_and(|there| !there.is_file()) {
            return Err(Error::Failed(format!("{}: not a regular file", path.display())));
        }
        write_atomically(&path, |out| out.write_all(bytes))?;
        Ok(path)
    }
}

/// The key of everything that decides a picture.
pub(crate) struct Key(String);

impl Key {
    /// The key of a picture by this program: scene, light and view, the program itself, and `settings`.
    pub(crate) fn of_program(
        cache: &Cache,
        view: PreparedSceneRef,
        settings: impl Display,
    ) -> Self {
        let mut key = Fingerprinter::default();
        key.text(env!("CARGO_PKG_VERSION"));
        key.text(&cache.program);
        Self::of(key, view, settings)
    }

    /// The key of a picture by another program, described by `settings`.
    pub(crate) fn of_other(view: PreparedSceneRef, settings: impl Display) -> Self {
        Self::of(Fingerprinter::default(), view, settings)
    }

    fn of(mut key: Fingerprinter, view: PreparedSceneRef, settings: impl Display) -> Self {
        let PreparedSceneRef { scene, camera, environment, .. } = view;
        key.text(scene.fingerprint());
        key.text(environment.fingerprint());
        // Debug's text of a number is exact.
        key.text(format_args!("{camera:?}{settings}"));
        Self(key.finish().to_string())
    }

    /// The checksum in the name of an entry of this key.
    fn sum_in<'a>(&self, path: &'a Path) -> Option<&'a str> {
        let name = path.file_name()?.to_str()?;
        name.strip_prefix(&self.0)?.strip_prefix('-')?.strip_suffix(".exr")
    }
}

fn of(bytes: &[u8]) -> Fingerprint {
    let mut fingerprint = Fingerprinter::default();
    fingerprint.bytes(bytes.iter().copied());
    fingerprint.finish()
}
