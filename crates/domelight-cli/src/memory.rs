//! How much memory the program may take, and what it has taken already: estimates, before it is taken.
//!
//! The figures for a pixel, a texel and a triangle are measured peaks, rounded up.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

use anyhow::{Context as _, Result};
use domelight::memory::{MemorySize, OverLimit, require};

/// What --max-memory says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MaxMemory {
    None,
    Bytes(u64),
}

impl std::str::FromStr for MaxMemory {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "none" {
            return Ok(Self::None);
        }
        let size = text.parse::<MemorySize>();
        size.map(|MemorySize(bytes)| Self::Bytes(bytes))
            .map_err(|error| format!("{error}, or none"))
    }
}

/// For each texel of a probe whose light is taken out: the map, what is left of it, and where lamps are.
pub(crate) const EXTRACTION_TEXEL: u64 = 64;

/// For each texel of a cube of prefiltered light: the texel, its level's bytes and the work on it.
pub(crate) const IBL_TEXEL: u64 = 64;

/// The hierarchy over the texels of a map that is prefiltered, at the most.
pub(crate) const IBL_HIERARCHY: u64 = 128 << 20;

/// For each texel of tables for shaders: the averaged map and its table, the groups, the texture and its bytes, a picture of it.
pub(crate) const TABLES_TEXEL: u64 = 160;

/// For each texel of a map that is computed or converted.
pub(crate) const MAP_TEXEL: u64 = 24;

/// For each texel of a map that is written: the map, its channels, the file.
pub(crate) const WRITTEN_TEXEL: u64 = 24;

/// For each pixel of a render with a checkpoint, or of a part: what a render takes, the sums again, their bits and the file.
pub(crate) const SAVED_PIXEL: u64 = 776;

/// For each pixel of a comparison of so many pictures: a render, the reference, what its page shows, and the pictures, each
/// with its error and what the page shows of it.
pub(crate) fn compared_pixel(n_pictures: usize) -> u64 {
    684 + 37 * n_pictures.max(8) as u64
}

static LIMIT: OnceLock<Option<u64>> = OnceLock::new();
static TAKEN: AtomicU64 = AtomicU64::new(0);

/// Sets the limit once and for all; by default nine tenths of what machine and control group give.
pub(crate) fn limit(asked: Option<MaxMemory>) {
    LIMIT.get_or_init(|| match asked {
        Some(MaxMemory::None) => None,
        Some(MaxMemory::Bytes(bytes)) => Some(bytes),
        None => granted().map(|bytes| bytes / 10 * 9),
    });
}

/// What may still be taken; none if there is no limit.
pub(crate) fn left() -> Option<u64> {
    let limit = LIMIT.get().copied().flatten();
    limit.map(|limit| limit.saturating_sub(TAKEN.load(Ordering::Relaxed)))
}

/// Counts what was taken and is kept.
pub(crate) fn keep(bytes: u64) {
    TAKEN.fetch_add(bytes, Ordering::Relaxed);
}

/// Refuses, by the name of what takes it, more than is left.
pub(crate) fn allow(what: &str, bytes: u64) -> Result<()> {
    require(bytes, left()).with_context(|| what.to_owned())
}

/// Refuses a picture with so many bytes for each pixel.
pub(crate) fn allow_picture(width: usize, height: usize, pixel: u64) -> Result<()> {
    allow(&format!("a picture of {width}x{height}"), pixel * width as u64 * height as u64)
}

/// What helps against the error.
pub(crate) fn hint(error: &OverLimit) -> String {
    let limit = LIMIT.get().copied().flatten().unwrap_or(error.allowed.0);
    let rest = limit.saturating_sub(error.allowed.0);
    let rest = if rest == 0 {
        String::new()
    } else {
        format!(", of which {} is already in use", MemorySize(rest))
    };
    format!(
        "the limit is {}{rest}; --max-memory SIZE sets another, --max-memory none removes it",
        MemorySize(limit)
    )
}

/// Bytes of the machine's memory, or those that its control groups leave to the process; none where the system does not
/// report them.
fn granted() -> Option<u64> {
    let machine = proc_meminfo();
    machine.into_iter().chain(control_groups()).min()
}

fn proc_meminfo() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
    line.trim().trim_end_matches("kB").trim().parse::<u64>().ok().map(|kibibytes| kibibytes * 1024)
}

/// The limits of the process's group and of those around it: control groups of version 2, and of version 1.
fn control_groups() -> Vec<u64> {
    let groups = std::fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let number = |path: std::path::PathBuf| {
        std::fs::read_to_string(path).ok().and_then(|text| text.trim().parse::<u64>().ok())
    };
    let of_line = |line: &str| {
        let mut fields = line.splitn(3, ':').skip(1);
        let (controllers, group) = (fields.next()?, fields.next()?);
        let (root, file) = match controllers {
            "" => ("/sys/fs/cgroup", "memory.max"),
            _ if controllers.split(',').any(|name| name == "memory") => {
                ("/sys/fs/cgroup/memory", "memory.limit_in_bytes")
            }
            _ => return None,
        };
        let group = std::path::Path::new(group.trim_start_matches('/')).to_owned();
        let limits = group
            .ancestors()
            .filter_map(|group| number(std::path::Path::new(root).join(group).join(file)));
        limits.min()
    };
    groups.lines().filter_map(of_line).collect()
}
