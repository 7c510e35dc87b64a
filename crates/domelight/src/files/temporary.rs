//! Temporary files that reveal whether their writer is alive.
//!
//! A writer holds a lock on its file, which the system releases however the writer ends. Folders of farms are shared,
//! and not every file system shares locks between machines. So the name contains the machine and its boot time, and no
//! program touches the files of other machines. Process numbers and ages prove nothing.

use std::ffi::OsStr;
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use crate::fingerprint::Fingerprinter;

/// How names of temporary files begin and end; they have 48 bytes, whatever the name of the file.
const PREFIX: &str = ".domelight-";
const SUFFIX: &str = ".part";

/// A new file beside another one, locked while it is written; removed unless it is [kept](Self::keep).
pub(super) struct Temporary {
    file: Option<File>,
    path: PathBuf,
}

impl Temporary {
    /// A file in the folder of `path`.
    pub(super) fn beside(path: &Path) -> io::Result<Self> {
        path.file_name().ok_or(io::ErrorKind::InvalidInput)?;
        loop {
            let path = path.with_file_name(new_name());
            let file = match File::create_new(&path) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
                created => created?,
            };
            // Before it had its lock another run may have found the file. Without locks what killed runs leave stays.
            let taken = matches!(file.try_lock(), Err(TryLockError::WouldBlock));
            if !taken && path.exists() {
                return Ok(Self { file: Some(file), path });
            }
        }
    }

    /// Writes the file.
    pub(super) fn write<T>(
        &mut self,
        write: impl FnOnce(&mut File) -> io::Result<T>,
    ) -> io::Result<T> {
        let file = self.file.as_mut().ok_or(io::ErrorKind::NotFound)?;
        write(file)
    }

    /// Puts all of it on the disk, and in the place of `path`.
    pub(super) fn keep(mut self, path: &Path) -> io::Result<()> {
        self.write(|file| file.sync_all())?;
        fs::rename(&self.path, path)?;
        self.file = None;
        Ok(())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        // The lock goes after the name.
        if self.file.is_some() {
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Removes the temporary files that killed runs on this machine left in a folder: those whose lock can be taken.
/// Returns their number.
pub fn remove_abandoned(folder: &Path) -> usize {
    let Ok(entries) = fs::read_dir(folder) else { return 0 };
    let here = Machine::this();
    let found = entries.flatten().filter(|entry| here.wrote(&entry.file_name()));
    found.filter(|entry| remove_if_unlocked(&entry.path())).count()
}

fn remove_if_unlocked(path: &Path) -> bool {
    let plain = fs::symlink_metadata(path).is_ok_and(|there| there.is_file());
    let Some(file) = plain.then(|| File::open(path).ok()).flatten() else { return false };
    match file.try_lock() {
        Ok(()) => fs::remove_file(path).is_ok(),
        Err(TryLockError::WouldBlock | TryLockError::Error(_)) => false,
    }
}

/// A name that nothing else has.
fn new_name() -> String {
    use std::hash::{BuildHasher as _, Hasher as _, RandomState};
    let Machine { host, boot } = Machine::this();
    // The standard library's only random numbers.
    let random = RandomState::new().build_hasher().finish() as u32 ^ std::process::id();
    format!("{PREFIX}{host}-{boot}-{random:08x}{SUFFIX}")
}

/// Eight digits each for a machine and for the start of its system.
struct Machine {
    host: String,
    boot: String,
}

/// Stands where the system does not report it.
const UNKNOWN: &str = "00000000";

impl Machine {
    fn this() -> Self {
        let read = |path: &str| fs::read_to_string(path).ok().map(|text| text.trim().to_owned());
        let name = read("/proc/sys/kernel/hostname")
            .or_else(|| read("/etc/hostname"))
            .or_else(|| std::env::var("COMPUTERNAME").ok())
            .or_else(|| std::env::var("HOSTNAME").ok());
        let id = read("/etc/machine-id").unwrap_or_default();
        // Many are called so.
        let name = name.filter(|name| !(name.is_empty() || name == "localhost" && id.is_empty()));
        let digits = |text: String| {
            let mut fingerprint = Fingerprinter::default();
            fingerprint.text(text);
            fingerprint.finish().to_string().chars().take(8).collect::<String>()
        };
        let or_unknown = |text: Option<String>| text.map_or_else(|| UNKNOWN.to_owned(), digits);
        Self {
            host: or_unknown(name.map(|name| format!("{name}/{id}"))),
            boot: or_unknown(read("/proc/sys/kernel/random/boot_id")),
        }
    }

    /// Whether a file of this name is a temporary one of this machine.
    fn wrote(&self, name: &OsStr) -> bool {
        let parts = name.to_str().and_then(|n| n.strip_prefix(PREFIX)?.strip_suffix(SUFFIX));
        let mut parts = parts.unwrap_or_default().split('-');
        let same = |here: &str, there: Option<&str>| here != UNKNOWN && there == Some(here);
        let host = same(&self.host, parts.next());
        host || same(&self.boot, parts.next())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write as _;

    #[test]
    fn only_what_nobody_writes_is_removed() {
        let folder = tempfile::tempdir().unwrap();
        let goal = folder.path().join("x.exr");
        let mut alive = Temporary::beside(&goal).unwrap();
        alive.write(|file| file.write_all(b"half")).unwrap();
        // As a killed run leaves it, and as one of another machine does.
        let dead = folder.path().join(new_name());
        fs::write(&dead, "half").unwrap();
        let elsewhere = folder.path().join(".domelight-01234567-89abcdef-01234567.part");
        fs::write(&elsewhere, "half").unwrap();
        assert_eq!(remove_abandoned(folder.path()), 1);
        assert!(!dead.exists() && elsewhere.exists() && alive.path.exists());
        alive.keep(&goal).unwrap();
        assert_eq!(fs::read(&goal).unwrap(), b"half");
        drop(Temporary::beside(&goal).unwrap());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[test]
    fn names_differ_and_are_short() {
        let names: std::collections::HashSet<String> = (0..64).map(|_| new_name()).collect();
        assert_eq!(names.len(), 64);
        assert!(names.iter().all(|name| name.len() <= 48));
    }
}
