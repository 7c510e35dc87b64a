//! The results of a run, which `--json` prints and `--table` reads.

use std::path::Path;
use std::time::SystemTime;
use std::{fs, io};

use serde::{Deserialize, Serialize};

use super::Suite;
use super::machine::Machine;
use super::table::Table;
use super::{felt, interiors, kernels, renders, rigs};
use crate::{At as _, Error};

/// Raised when a file of before can no longer be read.
const SCHEMA: u32 = 1;

/// The results of a run: when, where, with which settings, and the rows.
#[derive(Serialize, Deserialize)]
pub struct Results {
    schema: u32,
    /// Version of domelight.
    version: String,
    /// When it began, RFC 3339.
    date: String,
    /// As it was typed.
    command: String,
    machine: Machine,
    threads: usize,
    /// False if it was interrupted or failed: then the rows are what was done.
    pub(super) complete: bool,
    #[serde(flatten)]
    pub(super) rows: Rows,
}

/// One list of rows a suite.
#[derive(Serialize, Deserialize)]
#[serde(tag = "suite", content = "rows", rename_all = "lowercase")]
pub(super) enum Rows {
    Lecture(Vec<renders::Row>),
    Kernels(Vec<kernels::Row>),
    Probes(Vec<renders::Row>),
    Interiors(Vec<interiors::Row>),
    Rigs(Vec<rigs::Row>),
    Felt(Vec<felt::Row>),
}

impl Results {
    /// Nothing yet.
    pub(super) fn new(suite: Suite, command: &str) -> Self {
        Self {
            schema: SCHEMA,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            date: humantime::format_rfc3339_seconds(SystemTime::now()).to_string(),
            command: command.to_owned(),
            machine: Machine::this(),
            threads: rayon::current_num_threads(),
            complete: false,
            rows: match suite {
                Suite::Lecture => Rows::Lecture(Vec::new()),
                Suite::Kernels => Rows::Kernels(Vec::new()),
                Suite::Probes => Rows::Probes(Vec::new()),
                Suite::Interiors => Rows::Interiors(Vec::new()),
                Suite::Rigs => Rows::Rigs(Vec::new()),
                Suite::Felt => Rows::Felt(Vec::new()),
            },
        }
    }

    /// Reads the output of [`Results::json`].
    ///
    /// # Errors
    /// If it cannot be read, or is of another version.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let name = path.display();
        let text = fs::read_to_string(path).map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => Error::Usage(format!("{name}: {error}")),
            _ => Error::At { place: name.to_string(), error: Box::new(error.into()) },
        })?;
        let usage = |why: String| Error::Usage(format!("{name}: {why}"));
        let value: serde_json::Value = serde_json::from_str(&text)
            .map_err(|e| usage(format!("it is not JSON from domelight bench ({e})")))?;
        match value["schema"].as_u64() {
            Some(schema) if schema == u64::from(SCHEMA) => {}
            Some(schema) => {
                let why = format!("its schema is {schema}, that of this version {SCHEMA}");
                return Err(usage(why));
            }
            None => return Err(usage("it is not JSON from domelight bench".into())),
        }
        let results = serde_json::from_value(value);
        results.map_err(|e| usage(format!("it is damaged ({e})")))
    }

    /// As [`Results::read`] reads it.
    ///
    /// # Errors
    /// If a number is none.
    pub fn json(&self) -> Result<String, Error> {
        serde_json::to_string_pretty(self).at("the results cannot be written as JSON")
    }

    /// A sentence that says when, where and with which settings.
    pub fn describe(&self) -> String {
        let day = self.date.split('T').next().unwrap_or(&self.date);
        let threads = if self.threads == 1 { "thread" } else { "threads" };
        let complete = if self.complete { "" } else { "; incomplete" };
        format!(
            "domelight {}, {day}, {} {threads} on {}{complete}",
            self.version,
            self.threads,
            self.machine.describe()
        )
    }

    /// The tables for readers.
    pub fn tables(&self) -> Vec<Table> {
        match &self.rows {
            Rows::Lecture(rows) => renders::lecture_tables(rows),
            Rows::Probes(rows) => renders::tables(rows),
            Rows::Kernels(rows) => kernels::tables(rows),
            Rows::Interiors(rows) => interiors::tables(rows),
            Rows::Rigs(rows) => rigs::tables(rows),
            Rows::Felt(rows) => felt::tables(rows),
        }
    }
}
