//! Atomic writing and the identity of files.

mod atomic;
mod folder;
mod ledger;
mod temporary;

pub use atomic::{WriteSeek, require_writable, write_atomically, write_atomically_seeking};
pub use folder::create_folder;
pub use ledger::{FileConflict, FileLedger};
pub use temporary::remove_abandoned;
