//! Whether the files of scene and map have changed.

use std::path::PathBuf;

use domelight_page::{Host, Stamp};

/// What had changed when the files were last looked at.
#[derive(Default)]
pub(super) struct Watch(Vec<(PathBuf, Stamp)>);

impl Watch {
    /// Looks at the files that engines have read; whether some have changed, and have stayed so since the last look. A file in
    /// the middle of being written changes again.
    pub(super) fn look(&mut self, host: &Host) -> bool {
        let changes = host.changes();
        let is_quiet = !changes.is_empty() && changes == self.0;
        self.0 = changes;
        is_quiet
    }
}
