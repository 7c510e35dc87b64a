//! References in the user's cache folder, by content.
//!
//! An entry is `KEY-SUM.exr`: KEY is the SHA-256 of everything that decides the picture, SUM that of
//! the file itself, so that a damaged entry is known and made again.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, bail};
use domelight::picture::write_atomically;
use domelight::render::RenderSettings;
use etcetera::base_strategy::{BaseStrategy as _, choose_native_strategy};
use sha2::{Digest as _, Sha256};

use crate::failure::warn;
use crate::scene::LoadedScene;
use crate::strategy::Plan;

/// Bytes of a hash that names show.
const KEPT: usize = 16;

/// A folder of references.
pub(super) struct Cache {
    folder: PathBuf,
}

impl Cache {
    /// The folder that was asked for, else that of the platform.
    pub(super) fn new(folder: Option<&Path>) -> Result<Self> {
        let folder = match folder {
            Some(folder) => folder.to_path_buf(),
            None => match choose_native_strategy() {
                Ok(places) => places.cache_dir().join("domelight"),
                Err(_) => bail!("this user has no home; use --cache FOLDER or --no-cache"),
            },
        };
        Ok(Self { folder })
    }

    /// The entry and its bytes, if it is there and sound; a damaged one is removed.
    pub(super) fn get(&self, key: &Key, quiet: bool) -> Option<(PathBuf, Vec<u8>)> {
        let entries = fs::read_dir(&self.folder).ok()?.flatten().map(|entry| entry.path());
        for path in entries {
            let Some(sum) = key.sum_in(&path) else { continue };
            match fs::read(&path) {
                Ok(bytes) if hex(&Sha256::digest(&bytes)) == sum => return Some((path, bytes)),
                _ => {
                    warn(quiet, &format!("{}: damaged; it is made again", path.display()));
                    let _ = fs::remove_file(&path);
                }
            }
        }
        None
    }

    /// Keeps the bytes.
    pub(super) fn put(&self, key: &Key, bytes: &[u8]) -> Result<PathBuf> {
        let folder = &self.folder;
        fs::create_dir_all(folder)
            .with_context(|| format!("cannot make the cache folder {}", folder.display()))?;
        let path = folder.join(format!("{}-{}.exr", key.0, hex(&Sha256::digest(bytes))));
        write_atomically(&path, |out| out.write_all(bytes))?;
        Ok(path)
    }
}

/// Names everything that decides a picture.
pub(super) struct Key(String);

impl Key {
    /// Of a reference: the scene and the probe as they were read, the settings, the plan and the
    /// program itself.
    pub(super) fn new(loaded: &LoadedScene, settings: &RenderSettings, plan: Plan) -> Self {
        let mut hash = Hashing(Sha256::new());
        hash.0.update(env!("CARGO_PKG_VERSION"));
        if let Ok(program) = std::env::current_exe().and_then(fs::read) {
            hash.0.update(program);
        }
        let LoadedScene { description, light, map, view } = loaded;
        // Debug's text of a number is exact, and nothing of the scene can be forgotten.
        let _ = write!(hash, "{description:?}{light:?}{view:?}{settings:?}{plan:?}");
        let _ = write!(hash, "{}x{}", map.width, map.height);
        for pixel in &map.pixels {
            pixel.to_array().into_iter().for_each(|c| hash.0.update(c.to_le_bytes()));
        }
        Self(hex(&hash.0.finalize()))
    }

    /// The sum that the name of an entry of this key tells.
    fn sum_in<'a>(&self, path: &'a Path) -> Option<&'a str> {
        let name = path.file_name()?.to_str()?;
        name.strip_prefix(&self.0)?.strip_prefix('-')?.strip_suffix(".exr")
    }
}

/// Takes text.
struct Hashing(Sha256);

impl std::fmt::Write for Hashing {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        self.0.update(text);
        Ok(())
    }
}

fn hex(hash: &[u8]) -> String {
    hash.iter().take(KEPT).fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}
