//! The suite `felt`: how long people wait for the program.

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use domelight::math::{TAU, from_spherical};
use serde::{Deserialize, Serialize};
use tempfile::TempDir;

use super::Bench;
use super::bench_run::median;
use super::table::{Table, number};
use crate::names::file_name;
use crate::{At as _, Error};

/// A command that people wait for.
struct Task {
    name: &'static str,
    arguments: &'static [&'static str],
}

const fn task(name: &'static str, arguments: &'static [&'static str]) -> Task {
    Task { name, arguments }
}

/// Files that the tasks read, made by the first program.
const INPUTS: [&[&str]; 2] = [
    &["probe", "sky", "--size", "4096", "-o", "4k.hdr"],
    &["render", "--spp", "4", "--size", "1920x1080", "-o", "picture.exr"],
];

const TASKS: [Task; 9] = [
    task("first picture", &["render", "--spp", "1", "-o", "out.png"]),
    task("default picture", &["render", "-o", "out.png"]),
    task(
        "first picture, 500,000 triangles under a map of 4k",
        &["render", "mesh.ply", "--env", "4k.hdr", "--spp", "1", "-o", "out.png"],
    ),
    task("probe, a map of 4k", &["probe", "4k.hdr"]),
    task("64 lights, a map of 4k", &["lights", "4k.hdr", "-n", "64", "-o", "rig.json"]),
    task("sun and residual, a map of 4k", &["lights", "4k.hdr", "--sun", "-o", "rig.usda"]),
    task("prefiltered light, a map of 4k", &["ibl", "4k.hdr", "-o", "out.ktx2"]),
    task("OpenEXR to PNG, 1920x1080", &["tone", "picture.exr", "-o", "out.png"]),
    task("comparison", &["compare", "-o", "out.html"]),
];

/// A task by one of the programs.
#[derive(Serialize, Deserialize)]
pub(super) struct Row {
    task: String,
    program: String,
    /// Wall-clock seconds, one value a repetition; none if the program failed.
    seconds: Vec<f64>,
}

/// Runs every task by all programs in turns.
pub(super) fn run(bench: &Bench, rows: &mut Vec<Row>) -> Result<(), Error> {
    let programs = programs(&bench.settings.programs)?;
    let folder = TempDir::new().at("a temporary folder")?;
    write_mesh(&folder.path().join("mesh.ply")).at("mesh.ply")?;
    for arguments in INPUTS {
        bench.host.check_canceled()?;
        run_once(&programs[0], arguments, folder.path())?;
    }
    for (i, task) in TASKS.iter().enumerate() {
        bench.host.status(&format!("task {} of {}: {}", i + 1, TASKS.len(), task.name));
        rows.extend(measure(bench, task, &programs, folder.path())?);
    }
    Ok(())
}

/// A task by every program in turns. A program that fails has no times.
fn measure(
    bench: &Bench,
    task: &Task,
    programs: &[PathBuf],
    folder: &Path,
) -> Result<Vec<Row>, Error> {
    let mut times = vec![Some(Vec::new()); programs.len()];
    // Once more than it counts: the first warms the caches.
    for repetition in 0..=bench.settings.n_seeds {
        for (program, times) in programs.iter().zip(&mut times) {
            bench.host.check_canceled()?;
            let Some(seconds) = times else { continue };
            match run_once(program, task.arguments, folder) {
                Ok(_) if repetition == 0 => {}
                Ok(time) => seconds.push(time),
                Err(error) => {
                    bench.host.warn(&format!("{}: {error}", task.name));
                    *times = None;
                }
            }
        }
    }
    let row = |(program, times): (&PathBuf, Option<Vec<f64>>)| Row {
        task: task.name.to_owned(),
        program: file_name(&program.display().to_string()),
        seconds: times.unwrap_or_default(),
    };
    Ok(programs.iter().zip(times).map(row).collect())
}

/// Those of the settings, or this program. Tasks run in another folder, so the paths must be whole.
fn programs(given: &[PathBuf]) -> Result<Vec<PathBuf>, Error> {
    if given.is_empty() {
        return Ok(vec![std::env::current_exe().at("this program")?]);
    }
    let whole = |path: &PathBuf| {
        fs::canonicalize(path)
            .map_err(|e| Error::Usage(format!("--program {}: {e}", path.display())))
    };
    given.iter().map(whole).collect()
}

/// The wall-clock seconds of a command.
fn run_once(program: &Path, arguments: &[&str], folder: &Path) -> Result<f64, Error> {
    let mut command = Command::new(program);
    command.args(arguments).arg("--quiet").current_dir(folder).stdin(Stdio::null());
    let start = Instant::now();
    let output = command.output().at(program.display())?;
    let seconds = start.elapsed().as_secs_f64();
    if output.status.success() {
        return Ok(seconds);
    }
    let message = String::from_utf8_lossy(&output.stderr);
    let line = message.trim().lines().next().unwrap_or("no message").to_owned();
    Err(Error::Failed(format!("{} {}: {line}", program.display(), arguments.join(" "))))
}

/// A bumpy sphere of 500,000 triangles.
fn write_mesh(path: &Path) -> io::Result<()> {
    const N: u32 = 500;
    let mut out = io::BufWriter::new(fs::File::create(path)?);
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        (N + 1) * (N + 1),
        2 * N * N
    )?;
    for i in 0..=N {
        for j in 0..=N {
            let [z, phi] = [i, j].map(|k| k as f32 / N as f32);
            let d = from_spherical(1.0 - 2.0 * z, TAU * phi);
            let point = d * (1.0 + d.x * d.y * d.z);
            for c in point.to_array() {
                out.write_all(&c.to_le_bytes())?;
            }
        }
    }
    for i in 0..N {
        for j in 0..N {
            let a = i * (N + 1) + j;
            for triangle in [[a, a + 1, a + N + 2], [a, a + N + 2, a + N + 1]] {
                out.write_all(&[3])?;
                triangle.iter().try_for_each(|k| out.write_all(&k.to_le_bytes()))?;
            }
        }
    }
    out.flush()
}

pub(super) fn tables(rows: &[Row]) -> Vec<Table> {
    let mut table = Table::new("What people wait for", &["task", "program", "seconds", "range"]);
    for Row { task, program, seconds } in rows {
        let [least, most] = [f64::min, f64::max].map(|f| seconds.iter().copied().reduce(f));
        let range = least.zip(most);
        let range = range.map_or_else(String::new, |(l, m)| format!("{}–{}", number(l), number(m)));
        table.rows.push(vec![task.clone(), program.clone(), number(median(seconds)), range]);
    }
    table.notes.push(
        "Seconds: the median of repetitions on the wall clock, with the start of the program."
            .into(),
    );
    vec![table]
}
