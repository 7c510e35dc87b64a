//! What was written, which program it is for, and how it is opened.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::Output;

/// The files of a run.
pub(super) struct WrittenFiles<'a> {
    pub(super) rigs: &'a [Output<'a>],
    pub(super) domes: &'a [PathBuf],
    pub(super) preview: Option<&'a Path>,
}

impl WrittenFiles<'_> {
    /// A line for each file.
    pub(super) fn lines(&self) -> Vec<String> {
        let rig = |output: &&Output| {
            let path = output.path.display().to_string();
            let (program, open) = (output.format.program(), output.format.how_to_open(&path));
            format!("-> {path} for {program}: {open}")
        };
        let mut lines: Vec<String> =
            self.rigs.iter().filter(|o| is_file(o.path)).map(|o| rig(&o)).collect();
        let domes = self.domes.iter().filter(|path| is_file(path));
        lines.extend(domes.map(|path| {
            format!("-> {}: the light that is left, which rigs name as their dome", path.display())
        }));
        let preview = self.preview.filter(|path| is_file(path));
        lines.extend(preview.map(|path| format!("-> {}: a picture of the rig", path.display())));
        lines
    }

    /// The same for programs.
    pub(super) fn json(&self) -> Value {
        let rig = |output: &Output| {
            let path = output.path.to_string_lossy();
            json!({
                "file": path,
                "format": output.format.name(),
                "program": output.format.program(),
                "open": output.format.how_to_open(&path),
            })
        };
        let name = |path: &Path| path.to_string_lossy().into_owned();
        json!({
            "rigs": self.rigs.iter().filter(|o| is_file(o.path)).map(rig).collect::<Vec<_>>(),
            "domes": self.domes.iter().map(|path| name(path)).collect::<Vec<_>>(),
            "preview": self.preview.map(name),
        })
    }
}

fn is_file(path: &Path) -> bool {
    path != Path::new("-")
}
