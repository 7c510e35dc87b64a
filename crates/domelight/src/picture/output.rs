//! Files that are whole or not there.

use super::{PictureError, Problem};
use std::fs::{self, File};
use std::io::{self, BufWriter, Cursor, Seek, Write};
use std::path::{Path, PathBuf};

/// Runs `write` on a new file beside `path` and renames it to `path` when all of it is on the disk, so
/// that a crash never leaves half a file; `-` is standard output. What is not a plain file (a device, a pipe) is
/// written to directly, and a symbolic link keeps pointing where it points.
///
/// # Errors
/// If the file cannot be created, written or renamed; the old file is then untouched.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), PictureError> {
    if path == Path::new("-") {
        let mut out = io::stdout().lock();
        return write(&mut out)
            .and_then(|()| out.flush())
            .map_err(|error| Problem::Io(error).in_file("standard output"));
    }
    replace(path, write).map_err(|error| Problem::Io(error).in_file(&path.display().to_string()))
}

/// A file that is written in any order.
pub trait WriteSeek: Write + Seek {}

impl<T: Write + Seek> WriteSeek for T {}

/// As [`write_atomically`], for what is not written from beginning to end. Where one cannot go back (standard output, a
/// device, a pipe) the bytes are gathered in memory first.
///
/// # Errors
/// As [`write_atomically`].
pub fn write_atomically_seeking(
    path: &Path,
    write: impl FnOnce(&mut dyn WriteSeek) -> io::Result<()>,
) -> Result<(), PictureError> {
    if path != Path::new("-") && !fs::metadata(path).is_ok_and(|there| !there.is_file()) {
        let replaced = target(path).and_then(|path| replace_plain(&path, |out| write(out)));
        return replaced.map_err(|error| Problem::Io(error).in_file(&path.display().to_string()));
    }
    write_atomically(path, |out| {
        let mut bytes = Cursor::new(Vec::new());
        write(&mut bytes)?;
        out.write_all(bytes.get_ref())
    })
}

/// Whether [`write_atomically`] can make a file at `path` now: to be asked before hours of work. Leaves nothing behind
/// and does not open devices and pipes.
///
/// # Errors
/// If a file cannot be created there.
pub fn require_writable(path: &Path) -> Result<(), PictureError> {
    if path == Path::new("-") {
        return Ok(());
    }
    try_place(path).map_err(|error| Problem::Io(error).in_file(&path.display().to_string()))
}

fn try_place(path: &Path) -> io::Result<()> {
    let path = target(path)?;
    match fs::metadata(&path) {
        Ok(there) if there.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        Ok(there) if !there.is_file() => Ok(()),
        _ => {
            let temporary = beside(&path)?;
            File::create_new(&temporary)?;
            fs::remove_file(&temporary)
        }
    }
}

fn replace(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let path = target(path)?;
    if fs::metadata(&path).is_ok_and(|there| !there.is_file()) {
        return finish(File::options().write(true).open(&path)?, |out| write(out)).map(drop);
    }
    replace_plain(&path, |out| write(out))
}

/// The file itself, at the end of symbolic links, also where it is not there yet.
fn target(path: &Path) -> io::Result<PathBuf> {
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
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<()> {
    let temporary = beside(path)?;
    finish(File::create_new(&temporary)?, write)
        .and_then(|file| file.sync_all())
        .and_then(|()| fs::rename(&temporary, path))
        .inspect_err(|_| drop(fs::remove_file(&temporary)))
}

fn finish(
    file: File,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<File> {
    let mut out = BufWriter::new(file);
    write(&mut out)?;
    Ok(out.into_inner()?)
}

/// A name in the same folder that nothing else has.
fn beside(path: &Path) -> io::Result<PathBuf> {
    let name = path.file_name().ok_or(io::ErrorKind::InvalidInput)?;
    let free = (0..u32::MAX).map(|i| {
        let mut hidden = std::ffi::OsString::from(".");
        hidden.push(name);
        hidden.push(format!(".{}-{i}.part", std::process::id()));
        path.with_file_name(hidden)
    });
    free.into_iter().find(|name| !name.exists()).ok_or_else(|| io::ErrorKind::AlreadyExists.into())
}
