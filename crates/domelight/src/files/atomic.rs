//! Atomic writing: a file is complete or does not exist.

use super::temporary::{Temporary, remove_abandoned};
use crate::picture::{PictureError, PictureErrorKind};
use std::fs::{self, File, Metadata};
use std::io::{self, BufWriter, Cursor, Seek, Write};
use std::path::{Path, PathBuf};

/// Runs `write` on a new file next to `path` and renames it to `path` once it is completely on disk, so that a crash
/// never leaves an incomplete file; `-` is standard output. A device, a pipe or an open file without a name is written to
/// directly, and a symbolic link keeps its target. A replaced file keeps its permissions and, if allowed, its owner.
///
/// # Errors
/// If the file cannot be created, written or renamed, or the existing file is read-only. The old file is then
/// unchanged.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), PictureError> {
    if path == Path::new("-") {
        let mut out = io::stdout().lock();
        return write(&mut out)
            .and_then(|()| out.flush())
            .map_err(|error| PictureErrorKind::Io(error).in_file("standard output"));
    }
    replace(path, write)
        .map_err(|error| PictureErrorKind::Io(error).in_file(&path.display().to_string()))
}

/// A file that can be written in any order.
pub trait WriteSeek: Write + Seek {}

impl<T: Write + Seek> WriteSeek for T {}

/// Like [`write_atomically`], for formats that are not written sequentially. If seeking is not possible (standard
/// output, a device, a pipe), the bytes are collected in memory first.
///
/// # Errors
/// Those of [`write_atomically`].
pub fn write_atomically_seeking(
    path: &Path,
    write: impl FnOnce(&mut dyn WriteSeek) -> io::Result<()>,
) -> Result<(), PictureError> {
    if path != Path::new("-") && !is_nameless(path) {
        let replaced = target(path).and_then(|path| replace_plain(&path, |out| write(out)));
        return replaced
            .map_err(|error| PictureErrorKind::Io(error).in_file(&path.display().to_string()));
    }
    write_atomically(path, |out| {
        let mut bytes = Cursor::new(Vec::new());
        write(&mut bytes)?;
        out.write_all(bytes.get_ref())
    })
}

/// Checks whether [`write_atomically`] can create a file at `path` now, for use before hours of work. It leaves nothing
/// behind, removes what killed runs left in the folder ([`remove_abandoned`]), and does not open devices and pipes.
///
/// # Errors
/// If a file cannot be created there.
pub fn require_writable(path: &Path) -> Result<(), PictureError> {
    if path == Path::new("-") {
        return Ok(());
    }
    try_place(path)
        .map_err(|error| PictureErrorKind::Io(error).in_file(&path.display().to_string()))
}

fn try_place(path: &Path) -> io::Result<()> {
    let path = target(path)?;
    match fs::metadata(&path) {
        Ok(there) if there.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        Ok(_) if is_nameless(&path) => Ok(()),
        there => {
            there.map_or(Ok(()), |there| require_replaceable(&path, &there))?;
            remove_abandoned(folder_of(&path));
            name_fits(&path)?;
            Temporary::beside(&path).map(drop)
        }
    }
}

/// The folder of a file.
fn folder_of(path: &Path) -> &Path {
    let folder = path.parent().unwrap_or(Path::new(""));
    if folder.as_os_str().is_empty() { Path::new(".") } else { folder }
}

/// Asks the file system whether it can hold the name, which is longer than that of the temporary file.
fn name_fits(path: &Path) -> io::Result<()> {
    match fs::symlink_metadata(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Refuses what is not to be written to: the folder would let it be replaced all the same.
fn require_replaceable(path: &Path, there: &Metadata) -> io::Result<()> {
    if there.permissions().readonly() {
        let text = "it is read-only: make it writable, or choose another name";
        return Err(io::Error::new(io::ErrorKind::PermissionDenied, text));
    }
    File::options().write(true).open(path).map(drop)
}

/// Gives the new file what the old one has beside its content.
fn take_after(old: &Metadata, new: &File) -> io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::{MetadataExt as _, fchown};
        // Others than root may only give a file to groups that they are in.
        let owner = fchown(new, Some(old.uid()), Some(old.gid()));
        if owner.is_err() {
            let _ = fchown(new, None, Some(old.gid()));
        }
    }
    new.set_permissions(old.permissions())
}

fn replace(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let path = target(path)?;
    if is_nameless(&path) {
        return finish(File::options().write(true).open(&path)?, |out| write(out));
    }
    replace_plain(&path, |out| write(out))
}

/// Whether a path leads to what no other file can replace: a device, a pipe, or an open file that was removed
/// (`/dev/fd/3`).
fn is_nameless(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|there| !there.is_file() || fs::canonicalize(path).is_err())
}

/// The file itself, at the end of symbolic links, also where it is not there yet.
pub(super) fn target(path: &Path) -> io::Result<PathBuf> {
    if is_nameless(path) {
        return Ok(path.to_path_buf());
    }
    match fs::canonicalize(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => match fs::read_link(path) {
            // A circle of links is another error.
            Ok(link) => target(&path.parent().unwrap_or(Path::new("")).join(link)),
            Err(_) => Ok(path.to_path_buf()),
        },
        canonical => canonical,
    }
}

fn replace_plain(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>,
) -> io::Result<()> {
    let old = fs::metadata(path).ok();
    old.as_ref().map_or(Ok(()), |old| require_replaceable(path, old))?;
    let mut temporary = Temporary::beside(path)?;
    temporary.write(|file| {
        finish(&mut *file, write)?;
        old.map_or(Ok(()), |old| take_after(&old, file))
    })?;
    temporary.keep(path)
}

fn finish<F: Write>(
    file: F,
    write: impl FnOnce(&mut BufWriter<F>) -> io::Result<()>,
) -> io::Result<()> {
    let mut out = BufWriter::new(file);
    write(&mut out)?;
    out.flush()
}
