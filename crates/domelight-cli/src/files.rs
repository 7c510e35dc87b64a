//! The files that the program reads and writes. A command declares them here before its work, so that no result overwrites
//! an input or another result.

use std::collections::HashSet;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use anyhow::Result;
use domelight::files::{self, FileConflict, FileLedger, WriteSeek};
use domelight::fingerprint::Fingerprinter;
use domelight::picture::PictureError;

use crate::error::UsageError;
use crate::interrupt;

static LEDGER: Mutex<Option<FileLedger>> = Mutex::new(None);

fn with_ledger<T>(f: impl FnOnce(&mut FileLedger) -> T) -> T {
    let mut ledger: MutexGuard<Option<FileLedger>> =
        LEDGER.lock().unwrap_or_else(PoisonError::into_inner);
    f(ledger.get_or_insert_default())
}

/// Declares a file that will be read.
///
/// # Errors
/// If it is declared as written.
pub(crate) fn reads(path: &Path) -> Result<(), FileConflict> {
    with_ledger(|ledger| ledger.read(path))
}

/// The files that were read so far, in their order.
pub(crate) fn inputs() -> Vec<PathBuf> {
    let mut paths =
        with_ledger(|ledger| ledger.inputs().map(Path::to_path_buf).collect::<Vec<_>>());
    let mut seen = HashSet::new();
    paths.retain(|path| seen.insert(path.clone()));
    paths
}

/// The fingerprint of a file's bytes; `None` if it is no file that can be read again.
pub(crate) fn fingerprint(path: &Path) -> Option<String> {
    if waits(path) {
        return None;
    }
    let mut fingerprinter = Fingerprinter::default();
    fingerprinter.file(path).ok()?;
    Some(fingerprinter.finish().to_string())
}

/// Declares a result of another run.
///
/// # Errors
/// If it is read or written already.
pub(crate) fn declare(path: &Path) -> Result<(), FileConflict> {
    with_ledger(|ledger| ledger.write(path))
}

/// Declares a folder that will be filled with results.
///
/// # Errors
/// If a file in it is read.
pub(crate) fn require_unread(folder: &Path) -> Result<()> {
    let input = with_ledger(|ledger| ledger.read_in(folder).map(Path::to_path_buf));
    let Some(input) = input else { return Ok(()) };
    let (folder, input) = (folder.display(), input.display());
    let why =
        format!("{input} might be overwritten: results go to {folder}; choose another folder");
    Err(UsageError(why).into())
}

/// Declares a result, and checks that it can be written.
///
/// # Errors
/// If it is read or written already, or cannot be written.
pub(crate) fn writes(path: &Path) -> Result<()> {
    if path == Path::new("-") && standard_output_is_closed() {
        return Err(UsageError("-: standard output is closed; give a file name".into()).into());
    }
    with_ledger(|ledger| ledger.write(path))?;
    Ok(files::require_writable(path)?)
}

/// Writes a result atomically.
///
/// # Errors
/// If the file was read, or those of [`files::write_atomically`].
pub(crate) fn write(path: &Path, f: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
    with_waiting(path, || files::write_atomically(path, f))
}

/// Like [`write`], for formats that are not written sequentially.
///
/// # Errors
/// As [`write`].
pub(crate) fn write_seeking(
    path: &Path,
    f: impl FnOnce(&mut dyn WriteSeek) -> io::Result<()>,
) -> Result<()> {
    with_waiting(path, || files::write_atomically_seeking(path, f))
}

fn with_waiting(path: &Path, write: impl FnOnce() -> Result<(), PictureError>) -> Result<()> {
    with_ledger(|ledger| ledger.check_unread(path))?;
    // A pipe may wait forever for its reader.
    let _waiting = waits(path).then(interrupt::while_waiting);
    Ok(write()?)
}

/// Whether reading or writing may block forever: standard streams, pipes, devices.
pub(crate) fn waits(path: &Path) -> bool {
    path == Path::new("-") || std::fs::metadata(path).is_ok_and(|there| !there.is_file())
}

/// Rust opens /dev/null, for reading and writing, where the standard output is closed when the program starts; a shell
/// opens it for writing alone.
#[cfg(unix)]
fn standard_output_is_closed() -> bool {
    use nix::fcntl::{FcntlArg, OFlag, fcntl};
    use std::os::unix::fs::MetadataExt as _;
    let stdout = io::stdout();
    let is_null = || {
        use std::os::fd::AsFd as _;
        let there =
            std::fs::File::from(stdout.as_fd().try_clone_to_owned().ok()?).metadata().ok()?;
        let null = std::fs::metadata("/dev/null").ok()?;
        Some((there.dev(), there.ino()) == (null.dev(), null.ino()))
    };
    let flags = fcntl(&stdout, FcntlArg::F_GETFL).map(OFlag::from_bits_truncate);
    flags.is_ok_and(|flags| flags & OFlag::O_ACCMODE == OFlag::O_RDWR) && is_null() == Some(true)
}

#[cfg(not(unix))]
fn standard_output_is_closed() -> bool {
    false
}
