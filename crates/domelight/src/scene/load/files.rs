//! The source of a scene's files: the file system, or the caller.

use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

/// Returns the bytes of the files that a scene refers to, for use without a file system.
///
/// The path is relative to the scene and has neither `.` nor inner `..`: `textures/wood.png`, `../shared/wood.png`. An
/// error of the kind [`io::ErrorKind::NotFound`] means that there is no such file.
pub type Resolver<'r> = dyn Fn(&Path) -> io::Result<Vec<u8>> + 'r;

/// The files that a scene refers to.
pub(super) enum Files<'r> {
    /// Files of the file system.
    System,
    /// Those that the caller gives.
    Given(&'r Resolver<'r>),
}

impl Files<'_> {
    /// The bytes of a plain file: a device or a pipe might never end. `allow` may refuse their number first.
    pub(super) fn read<E>(
        &self,
        path: &Path,
        allow: impl FnOnce(u64) -> Result<(), E>,
        error: impl Fn(io::Error) -> E,
    ) -> Result<Vec<u8>, E> {
        if let Self::Given(resolver) = self {
            let bytes = resolver(&lexically_normal(path)).map_err(error)?;
            allow(bytes.len() as u64)?;
            return Ok(bytes);
        }
        let metadata = fs::metadata(path).map_err(&error)?;
        if metadata.is_dir() {
            return Err(error(io::ErrorKind::IsADirectory.into()));
        }
        if !metadata.is_file() {
            let what = "not a regular file";
            return Err(error(io::Error::new(io::ErrorKind::InvalidInput, what)));
        }
        allow(metadata.len())?;
        fs::read(path).map_err(error)
    }

    /// Whether there is such a file.
    pub(super) fn exists(&self, path: &Path) -> bool {
        match self {
            Self::System => path.exists(),
            Self::Given(resolver) => resolver(&lexically_normal(path)).is_ok(),
        }
    }

    /// The path without links and `..`; none of a file that is not there.
    pub(super) fn resolved(&self, path: &Path) -> Option<PathBuf> {
        match self {
            Self::System => path.canonicalize().ok(),
            // In a folder of its own, above which there may be others.
            Self::Given(_) => Some(lexically_normal(path)),
        }
    }
}

/// The path without `.` and inner `..`.
fn lexically_normal(path: &Path) -> PathBuf {
    let mut normal = PathBuf::new();
    for component in path.components() {
        let ends_in_name = matches!(normal.components().next_back(), Some(Component::Normal(_)));
        match component {
            Component::CurDir => {}
            Component::ParentDir if ends_in_name => {
                normal.pop();
            }
            other => normal.push(other),
        }
    }
    normal
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_given_in_one_form() {
        let normal = |path: &str| lexically_normal(Path::new(path));
        assert_eq!(normal("./a/./b/../c.png"), Path::new("a/c.png"));
        assert_eq!(normal("a/../../c.png"), Path::new("../c.png"));
        assert_eq!(normal("../../c.png"), Path::new("../../c.png"));
    }
}
