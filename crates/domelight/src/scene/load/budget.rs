//! What a scene may take while it is loaded: memory, and files.

use std::cell::{Cell, RefCell};
use std::path::{Path, PathBuf};

use super::{LoadError, Reach};
use crate::memory::require;

/// What was taken of the memory allowed, by estimates from headers and counts, and which files were read.
pub(super) struct Budget {
    max: Option<u64>,
    taken: Cell<u64>,
    /// Whether files outside of the folder may be read.
    reach: Reach,
    /// The scene's own folder, without links.
    folder: Option<PathBuf>,
    files: RefCell<Vec<PathBuf>>,
    outside: RefCell<Vec<PathBuf>>,
}

impl Budget {
    /// For the scene in a file.
    pub(super) fn new(scene: &Path, max: Option<u64>, reach: Reach) -> Self {
        let folder = scene.canonicalize().ok().and_then(|path| Some(path.parent()?.to_owned()));
        Self {
            max,
            taken: Cell::new(0),
            reach,
            folder,
            files: RefCell::default(),
            outside: RefCell::default(),
        }
    }

    /// Without limits.
    #[cfg(test)]
    pub(super) fn unlimited() -> Self {
        Self::new(Path::new(""), None, Reach::Anywhere)
    }

    pub(super) fn taken(&self) -> u64 {
        self.taken.get()
    }

    pub(super) fn left(&self) -> Option<u64> {
        self.max.map(|max| max.saturating_sub(self.taken()))
    }

    /// Refuses, before they are taken, more `bytes` than are left; `file` is for the message.
    pub(super) fn take(&self, file: &str, bytes: u64) -> Result<(), LoadError> {
        require(bytes, self.left())
            .map_err(|source| LoadError::Memory { file: file.to_owned(), source })?;
        self.taken.set(self.taken().saturating_add(bytes));
        Ok(())
    }

    /// Counts a file that the scene refers to, before it is read.
    pub(super) fn refer(&self, path: &Path, referrer: &str) -> Result<(), LoadError> {
        // What is not there is somebody else's error.
        if let (Ok(path), Some(folder)) = (path.canonicalize(), &self.folder)
            && !path.starts_with(folder)
        {
            if self.reach == Reach::OwnFolder {
                let referrer = referrer.to_owned();
                return Err(LoadError::Outside { path, referrer });
            }
            self.outside.borrow_mut().push(path);
        }
        self.files.borrow_mut().push(path.to_owned());
        Ok(())
    }

    /// The files that were read beside the scene's own.
    pub(super) fn files(&self) -> Vec<PathBuf> {
        self.files.take()
    }

    /// One sentence on files outside of the scene's folder.
    pub(super) fn warning(&self, scene: &Path) -> Option<String> {
        let mut outside = self.outside.take();
        outside.sort();
        outside.dedup();
        let first = outside.first()?.display();
        let more = match outside.len() - 1 {
            0 => String::new(),
            n => format!(" and {n} more"),
        };
        Some(format!("{} reads files outside of its folder: {first}{more}", scene.display()))
    }
}
