//! `domelight doctor`: what a report of a problem should say of the program and its machine.

use std::env;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Result;
use domelight::bvh::InstructionSet;
use domelight::memory::MemorySize;
use domelight_lab::bench::Machine;
use domelight_lab::denoise::Denoiser;
use domelight_lab::display;
use domelight_lab::measure::Cache;
use serde::Serialize;

use crate::args::DoctorArguments;
use crate::output::{print, print_json};
use crate::{memory, scene};

#[derive(Serialize)]
struct Report {
    version: &'static str,
    machine: Machine,
    /// Those that the processor has, the fastest last.
    instruction_sets: Vec<String>,
    threads: usize,
    /// `None` without a limit.
    memory_limit_bytes: Option<u64>,
    cache: Option<CacheReport>,
    denoiser: Part,
    blender: Part,
    viewer: Part,
}

/// The cache of references.
#[derive(Serialize)]
struct CacheReport {
    folder: PathBuf,
    files: usize,
    bytes: u64,
}

/// An optional part of another maker.
#[derive(Serialize)]
struct Part {
    /// What was found.
    found: Option<String>,
    /// Why it was not.
    missing: Option<String>,
}

impl Part {
    fn new(found: Result<String, String>) -> Self {
        match found {
            Ok(found) => Self { found: Some(found), missing: None },
            Err(missing) => Self { found: None, missing: Some(missing) },
        }
    }

    fn text(&self) -> &str {
        self.found.as_deref().or(self.missing.as_deref()).unwrap_or_default()
    }
}

/// Runs the subcommand.
pub(crate) fn run(arguments: &DoctorArguments) -> Result<()> {
    scene::start_threads(None)?;
    let report = Report {
        version: env!("CARGO_PKG_VERSION"),
        machine: Machine::this(),
        instruction_sets: instruction_sets(),
        threads: rayon::current_num_threads(),
        memory_limit_bytes: memory::left(),
        cache: Cache::user_folder().map(CacheReport::new),
        denoiser: Part::new(Denoiser::load().map(|d| d.name()).map_err(|e| first_line(&e))),
        blender: Part::new(blender().ok_or_else(|| "no program blender on the path".to_owned())),
        viewer: Part::new(viewer()),
    };
    if arguments.json { print_json(&report) } else { print(&text(&report)) }
}

fn instruction_sets() -> Vec<String> {
    let available = InstructionSet::ALL.into_iter().filter(|set| set.is_available());
    available.map(|set| format!("{set:?}").to_lowercase()).collect()
}

/// The reason without the advice that follows it.
fn first_line(error: &domelight_lab::Error) -> String {
    let text = error.to_string();
    text.lines().next().unwrap_or_default().to_owned()
}

/// The first program of that name on the path, which is not started.
fn blender() -> Option<String> {
    let name = format!("blender{}", env::consts::EXE_SUFFIX);
    let path = env::var_os("PATH")?;
    let found =
        env::split_paths(&path).map(|folder| folder.join(&name)).find(|file| file.is_file());
    found.map(|file| file.display().to_string())
}

/// Whether tev or HDRView waits for pictures.
fn viewer() -> Result<String, String> {
    let address = display::ADDRESS;
    if display::is_listening(address) {
        Ok(format!("a viewer listens on {address}"))
    } else {
        Err(format!("no viewer listens on {address}"))
    }
}

impl CacheReport {
    fn new(folder: PathBuf) -> Self {
        let sizes = sizes(&folder);
        Self { files: sizes.len(), bytes: sizes.iter().sum(), folder }
    }
}

/// The sizes of the files in a folder; none if it is not there \[bytes\].
fn sizes(folder: &Path) -> Vec<u64> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let files = entries.filter_map(|entry| entry.metadata().ok()).filter(fs::Metadata::is_file);
    files.map(|file| file.len()).collect()
}

fn text(report: &Report) -> String {
    let machine = &report.machine;
    let memory = match report.memory_limit_bytes {
        Some(bytes) => MemorySize(bytes).to_string(),
        None => "none".to_owned(),
    };
    let cache = match &report.cache {
        Some(CacheReport { folder, files, bytes }) => {
            format!("{}: {files} files, {}", folder.display(), MemorySize(*bytes))
        }
        None => "no home folder".to_owned(),
    };
    let lines = [
        ("build", format!("{}, {}, {}", machine.profile, machine.target, machine.rustc)),
        ("processor", machine.cpu.clone().unwrap_or_else(|| "not reported".to_owned())),
        ("instructions", report.instruction_sets.join(", ")),
        ("threads", report.threads.to_string()),
        ("memory limit", memory),
        ("cache", cache),
        ("denoiser", report.denoiser.text().to_owned()),
        ("Blender", report.blender.text().to_owned()),
        ("viewer", report.viewer.text().to_owned()),
    ];
    let mut text = format!("domelight {}\n", report.version);
    for (name, value) in lines {
        let _ = writeln!(text, "{name:<14}{value}");
    }
    text
}
