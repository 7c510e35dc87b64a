//! Output folders.

use std::fs;
use std::io;
use std::path::Path;

/// Creates a folder and its parents, unless they exist.
///
/// # Errors
/// The system's error, or an error if the name belongs to something that is not a folder.
pub fn create_folder(path: &Path) -> io::Result<()> {
    fs::create_dir_all(path).map_err(|error| match error.kind() {
        io::ErrorKind::AlreadyExists | io::ErrorKind::NotADirectory => {
            let text = "a file has this name, or that of a folder above it; choose another";
            io::Error::new(io::ErrorKind::NotADirectory, text)
        }
        _ => error,
    })
}
