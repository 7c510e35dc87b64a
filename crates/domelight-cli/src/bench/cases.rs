//! The suites `lecture` and `probes`: what error costs in a render.

use anyhow::Result;
use serde::{Deserialize, Serialize};

use super::Bench;
use super::table::Table;

/// A case.
#[derive(Serialize, Deserialize)]
pub(super) struct Row {}

/// Measures, and keeps each row as it is done.
pub(super) fn run_lecture(bench: &Bench, rows: &mut Vec<Row>) -> Result<()> {
    bench.check_interrupted()?;
    rows.clear();
    Ok(())
}

/// Scenes, probes and materials.
pub(super) fn run_probes(bench: &Bench, rows: &mut Vec<Row>) -> Result<()> {
    run_lecture(bench, rows)
}

pub(super) fn tables(rows: &[Row]) -> Vec<Table> {
    let _ = rows;
    Vec::new()
}
