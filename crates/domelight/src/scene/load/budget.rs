//! How much memory a scene may still take while it is loaded.

use std::cell::Cell;

use super::LoadError;
use crate::memory::require;

/// What was taken of the memory allowed, by estimates from headers and counts.
pub(super) struct Budget {
    max: Option<u64>,
    taken: Cell<u64>,
}

impl Budget {
    pub(super) fn new(max: Option<u64>) -> Self {
        Self { max, taken: Cell::new(0) }
    }

    pub(super) fn taken(&self) -> u64 {
        self.taken.get()
    }

    pub(super) fn left(&self) -> Option<u64> {
        self.max.map(|max| max - self.taken())
    }

    /// Refuses, before they are taken, more `bytes` than are left; `file` is for the message.
    pub(super) fn take(&self, file: &str, bytes: u64) -> Result<(), LoadError> {
        require(bytes, self.left())
            .map_err(|source| LoadError::Memory { file: file.to_owned(), source })?;
        self.taken.set(self.taken().saturating_add(bytes));
        Ok(())
    }
}
