//! The files that were dropped on the page.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

/// Files by their paths.
#[derive(Default)]
pub(crate) struct Files(BTreeMap<PathBuf, Vec<u8>>);

impl Files {
    pub(crate) fn add(&mut self, path: &str, bytes: Vec<u8>) {
        self.0.insert(PathBuf::from(path), bytes);
    }

    /// Whether a file has exactly this path.
    pub(crate) fn has(&self, path: &Path) -> bool {
        self.0.contains_key(path)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The bytes of a file. One that is not where it is referred to is looked for by its name: who drops files drops
    /// no folders.
    pub(crate) fn get(&self, path: &Path) -> io::Result<&[u8]> {
        let found = self.0.get(path).or_else(|| {
            let same_name = |other: &&PathBuf| other.file_name() == path.file_name();
            self.0.keys().find(same_name).and_then(|path| self.0.get(path))
        });
        let missing = || io::Error::new(io::ErrorKind::NotFound, "it was not dropped on the page");
        found.map(Vec::as_slice).ok_or_else(missing)
    }
}
