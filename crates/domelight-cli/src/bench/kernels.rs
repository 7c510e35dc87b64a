//! The suite `kernels`: rays a second of the ray kernel.

use anyhow::Result;
use serde::{Deserialize, Serialize};

use super::Bench;
use super::table::Table;

/// A kernel on a mesh.
#[derive(Serialize, Deserialize)]
pub(super) struct Row {}

/// Measures, and keeps each row as it is done.
pub(super) fn run(bench: &Bench, rows: &mut Vec<Row>) -> Result<()> {
    bench.check_interrupted()?;
    rows.clear();
    Ok(())
}

pub(super) fn tables(rows: &[Row]) -> Vec<Table> {
    let _ = rows;
    Vec::new()
}
