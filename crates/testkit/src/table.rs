//! Two tables of cells side by side, and their pictures.

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

/// Counts in the cells of a grid, row by row, row 0 on top.
pub(crate) struct Table {
    pub(crate) columns: usize,
    pub(crate) cells: Vec<f64>,
}

impl Table {
    /// Writes a gray PFM (rows from the bottom up, little endian).
    fn write_pfm(&self, path: &Path) -> io::Result<()> {
        let rows = self.cells.len() / self.columns;
        let mut bytes = Vec::new();
        write!(bytes, "Pf\n{} {rows}\n-1.0\n", self.columns)?;
        for row in self.cells.chunks(self.columns).rev() {
            bytes.extend(row.iter().flat_map(|&v| (v as f32).to_le_bytes()));
        }
        std::fs::write(path, bytes)
    }
}

/// Writes both tables beside the build's other products and says where.
pub(crate) fn dump(name: &str, observed: &Table, expected: &Table) -> String {
    let directory = directory();
    let file = |kind: &str| directory.join(format!("{}-{kind}.pfm", slug(name)));
    let (a, b) = (file("observed"), file("expected"));
    match observed.write_pfm(&a).and_then(|()| expected.write_pfm(&b)) {
        Ok(()) => format!("tables: {} and {}", a.display(), b.display()),
        Err(e) => format!("the tables could not be written to {}: {e}", directory.display()),
    }
}

fn directory() -> PathBuf {
    let target = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/testkit");
    match std::fs::create_dir_all(&target) {
        Ok(()) => target.canonicalize().unwrap_or(target),
        Err(_) => std::env::temp_dir(),
    }
}

fn slug(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect()
}
