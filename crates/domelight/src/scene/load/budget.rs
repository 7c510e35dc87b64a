//! What a scene may take while it is loaded: memory, and files.

use std::cell::{Cell, RefCell};
use std::io;
use std::path::{Path, PathBuf};

use super::files::Files;
use super::{LoadError, Reach};
use crate::memory::require;

/// What was taken of the memory allowed, by estimates from headers and counts, and which files were read.
pub(super) struct Budget<'r> {
    max: Option<u64>,
    taken: Cell<u64>,
    /// Where files are read.
    source: Files<'r>,
    /// Whether files outside of the folder may be read.
    reach: Reach,
    /// The scene's own folder, without links.
    folder: Option<PathBuf>,
    files: RefCell<Vec<PathBuf>>,
    outside: RefCell<Vec<PathBuf>>,
}

impl<'r> Budget<'r> {
    /// For the scene in a file.
    pub(super) fn new(scene: &Path, source: Files<'r>, max: Option<u64>, reach: Reach) -> Self {
        let folder = source.resolved(scene).and_then(|path| Some(path.parent()?.to_owned()));
        Self {
            max,
            taken: Cell::new(0),
            source,
            reach,
            folder,
            files: RefCell::default(),
            outside: RefCell::default(),
        }
    }

    /// Without limits.
    #[cfg(test)]
    pub(super) fn unlimited() -> Self {
        Self::new(Path::new(""), Files::System, None, Reach::Anywhere)
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
        if let (Some(path), Some(folder)) = (self.source.resolved(path), &self.folder)
            && (!path.starts_with(folder) || path.starts_with(".."))
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

    /// The bytes of a file, if they are not too many.
    pub(super) fn read(
        &self,
        path: &Path,
        error: impl Fn(io::Error) -> LoadError,
    ) -> Result<Vec<u8>, LoadError> {
        let allow = |bytes| self.take(&path.display().to_string(), bytes);
        self.source.read(path, allow, error)
    }

    /// Whether there is such a file.
    pub(super) fn exists(&self, path: &Path) -> bool {
        self.source.exists(path)
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
