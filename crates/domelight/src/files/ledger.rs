//! The files that are read and written, identified by the system's identifiers rather than by their names.

use std::ffi::OsString;
use std::fs::{self, Metadata};
use std::io;
use std::path::{Path, PathBuf};

use super::atomic::target;

/// The files that a task will read and write, declared in advance.
///
/// ```
/// use domelight::files::FileLedger;
///
/// let folder = tempfile::tempdir()?;
/// let map = folder.path().join("map.exr");
/// std::fs::write(&map, "")?;
/// let mut files = FileLedger::default();
/// files.write(&folder.path().join("../").join(folder.path()).join("./map.exr"))?;
/// assert!(files.read(&map).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Default)]
pub struct FileLedger {
    read: Vec<(PathBuf, FileIdentity)>,
    written: Vec<(PathBuf, FileIdentity)>,
}

/// Two conflicting uses of a file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FileConflict {
    /// What is to be written would take the place of what is read.
    #[error(
        "{} would overwrite {}, which is an input: choose another name",
        name(output),
        if input == output { "itself".to_owned() } else { name(input) }
    )]
    Overwrites {
        /// What is to be written.
        output: PathBuf,
        /// What is read.
        input: PathBuf,
    },
    /// Two outputs with the same name.
    #[error("two results are written to {}: choose another name for one", both(first, second))]
    Twice {
        /// As it was named first.
        first: PathBuf,
        /// As it was named then.
        second: PathBuf,
    },
}

fn name(path: &Path) -> String {
    if path == Path::new("-") {
        "the file of standard input or output".into()
    } else {
        path.display().to_string()
    }
}

fn both(first: &Path, second: &Path) -> String {
    if first == second {
        name(first)
    } else {
        format!("{}, which is {}", name(second), name(first))
    }
}

/// What a plain file is known by. Devices and pipes have none: they may be read and written at once.
#[derive(Clone, Debug, PartialEq, Eq)]
enum FileIdentity {
    /// Device and number of a file.
    #[cfg(unix)]
    There(u64, u64),
    /// The path without links, where the system has no numbers.
    #[cfg(not(unix))]
    There(PathBuf),
    /// A name in a folder that is there.
    NotYet(Box<Self>, OsString),
    /// A path of which not even the folder is there.
    Nowhere(PathBuf),
}

impl FileLedger {
    /// Declares that `path` is read; `-` is standard input.
    ///
    /// # Errors
    /// If it is declared as written.
    pub fn read(&mut self, path: &Path) -> Result<(), FileConflict> {
        let Some(identity) = FileIdentity::of_input(path) else { return Ok(()) };
        let output = self.written.iter().find(|(_, written)| *written == identity);
        let output = output.map(|(output, _)| output.clone());
        // Also if it is refused: whoever writes all the same is refused as well.
        self.read.push((path.to_owned(), identity));
        match output {
            Some(output) => Err(FileConflict::Overwrites { output, input: path.to_owned() }),
            None => Ok(()),
        }
    }

    /// The files that are declared as read, in the order of their declarations.
    pub fn inputs(&self) -> impl Iterator<Item = &Path> {
        self.read.iter().map(|(path, _)| path.as_path())
    }

    /// A file in a folder that is declared as read, if there is one.
    pub fn read_in(&self, folder: &Path) -> Option<&Path> {
        let folder = fs::canonicalize(folder).ok()?;
        let is_inside =
            |path: &Path| fs::canonicalize(path).is_ok_and(|path| path.parent() == Some(&*folder));
        self.read.iter().map(|(path, _)| path.as_path()).find(|path| is_inside(path))
    }

    /// Declares that `path` is written; `-` is standard output.
    ///
    /// # Errors
    /// If it is already declared as read or written.
    pub fn write(&mut self, path: &Path) -> Result<(), FileConflict> {
        let Some(identity) = FileIdentity::of_output(path) else { return Ok(()) };
        if let Some((input, _)) = self.read.iter().find(|(_, read)| *read == identity) {
            return Err(FileConflict::Overwrites { output: path.to_owned(), input: input.clone() });
        }
        if let Some((first, _)) = self.written.iter().find(|(_, written)| *written == identity) {
            return Err(FileConflict::Twice { first: first.clone(), second: path.to_owned() });
        }
        self.written.push((path.to_owned(), identity));
        Ok(())
    }

    /// Checks that `path` is not declared as read.
    ///
    /// # Errors
    /// If it is, and so must not be written.
    pub fn check_unread(&self, path: &Path) -> Result<(), FileConflict> {
        let identity = FileIdentity::of_output(path);
        match self.read.iter().find(|(_, read)| Some(read) == identity.as_ref()) {
            Some((input, _)) => {
                Err(FileConflict::Overwrites { output: path.to_owned(), input: input.clone() })
            }
            None => Ok(()),
        }
    }
}

impl FileIdentity {
    fn of_input(path: &Path) -> Option<Self> {
        if path == Path::new("-") { Self::of_stream(io::stdin()) } else { Self::of_file(path) }
    }

    fn of_output(path: &Path) -> Option<Self> {
        if path == Path::new("-") { Self::of_stream(io::stdout()) } else { Self::of_file(path) }
    }

    fn of_file(path: &Path) -> Option<Self> {
        // Where the links lead: what is written takes the place of the file, not of a link.
        let path = target(path).unwrap_or_else(|_| path.to_owned());
        if let Ok(there) = fs::metadata(&path) {
            return there.is_file().then(|| Self::of_metadata(&there, &path));
        }
        let folder = match path.parent() {
            Some(folder) if folder.as_os_str().is_empty() => Path::new("."),
            Some(folder) => folder,
            None => Path::new("/"),
        };
        match (fs::metadata(folder), path.file_name()) {
            (Ok(there), Some(name)) => {
                Some(Self::NotYet(Box::new(Self::of_metadata(&there, folder)), name.to_owned()))
            }
            _ => Some(Self::Nowhere(std::path::absolute(&path).unwrap_or(path))),
        }
    }

    #[cfg(unix)]
    fn of_metadata(there: &Metadata, _: &Path) -> Self {
        use std::os::unix::fs::MetadataExt as _;
        Self::There(there.dev(), there.ino())
    }

    #[cfg(not(unix))]
    fn of_metadata(_: &Metadata, path: &Path) -> Self {
        Self::There(fs::canonicalize(path).unwrap_or_else(|_| path.to_owned()))
    }

    /// The file that a standard stream was directed to.
    #[cfg(unix)]
    fn of_stream(stream: impl std::os::fd::AsFd) -> Option<Self> {
        let file = fs::File::from(stream.as_fd().try_clone_to_owned().ok()?);
        let there = file.metadata().ok()?;
        there.is_file().then(|| Self::of_metadata(&there, Path::new("-")))
    }

    #[cfg(not(unix))]
    fn of_stream<S>(_: S) -> Option<Self> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_known_under_all_its_names() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::write(path("in.hdr"), "x").unwrap();
        fs::create_dir(path("sub")).unwrap();
        let mut names = vec!["in.hdr", "./in.hdr", "sub/../in.hdr"];
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(path("in.hdr"), path("link.hdr")).unwrap();
            std::os::unix::fs::symlink(folder.path(), path("loop")).unwrap();
            fs::hard_link(path("in.hdr"), path("hard.hdr")).unwrap();
            names.extend(["link.hdr", "loop/in.hdr", "loop/loop/link.hdr", "hard.hdr"]);
        }
        for name in names {
            let mut files = FileLedger::default();
            files.read(&path("in.hdr")).unwrap();
            let error = files.write(&path(name)).unwrap_err();
            assert!(matches!(error, FileConflict::Overwrites { .. }), "{name}");
            assert!(error.to_string().contains("in.hdr"), "{error}");
            let mut files = FileLedger::default();
            files.write(&path(name)).unwrap();
            assert!(files.read(&path("in.hdr")).is_err(), "{name}");
            assert!(files.check_unread(&path(name)).is_err(), "{name}");
        }
        let mut files = FileLedger::default();
        files.read(&path("in.hdr")).unwrap();
        files.read(&path("in.hdr")).unwrap();
        files.write(&path("in.exr")).unwrap();
        assert!(files.check_unread(&path("in.hdr")).is_err());
        assert!(files.check_unread(&path("in.exr")).is_ok());
    }

    #[test]
    fn what_is_not_there_yet_is_known_too() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let mut names = vec!["x.exr", "./x.exr"];
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("x.exr", path("dangling.exr")).unwrap();
            std::os::unix::fs::symlink(".", path("here")).unwrap();
            names.extend(["dangling.exr", "here/x.exr"]);
        }
        for name in names {
            let mut files = FileLedger::default();
            files.write(&path("x.exr")).unwrap();
            files.write(&path("y.exr")).unwrap();
            let error = files.write(&path(name)).unwrap_err();
            assert!(matches!(error, FileConflict::Twice { .. }), "{name}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn devices_may_be_read_and_written() {
        let mut files = FileLedger::default();
        for _ in 0..2 {
            files.read(Path::new("/dev/null")).unwrap();
            files.write(Path::new("/dev/null")).unwrap();
        }
    }
}
