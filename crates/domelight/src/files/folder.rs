//! Folders for results.

use std::fs;
use std::io;
use std::path::Path;

/// Makes a folder and those that it is in, unless it is there.
///
/// # Errors
/// What the system says; where something else has the name, that it is not a folder.
pub fn create_folder(path: &Path) -> io::Result<()> {
    fs::create_dir_all(path).map_err(|error| match error.kind() {
        io::ErrorKind::AlreadyExists | io::ErrorKind::NotADirectory => {
            let text = "a file has this name, or that of a folder above it; choose another";
            io::Error::new(io::ErrorKind::NotADirectory, text)
        }
        _ => error,
    })
}
