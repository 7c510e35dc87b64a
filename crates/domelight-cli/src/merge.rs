//! `domelight merge`: from parts to the picture.

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use domelight::picture::tone::ToneCurve;
use domelight::render::{Checkpoint, CheckpointError, Counts, Film, Window};
use serde::Serialize;

use crate::args::MergeArguments;
use crate::course::read;
use crate::failure::tell;
use crate::output::{PicturePath, print, require_one_on_standard_output};

/// Why parts make no picture.
#[derive(Debug, thiserror::Error)]
pub(crate) enum MergeError {
    /// Tiles that no part has; parts that were interrupted.
    #[error("{0}")]
    Missing(String),
    /// A tile in two parts.
    #[error("{first} and {second} both hold tile {tile}")]
    Doubled { first: String, second: String, tile: usize },
    /// A damaged file, or one of another render.
    #[error("{0}")]
    Foreign(String),
}

impl MergeError {
    /// The program's exit code.
    pub(crate) fn code(&self) -> u8 {
        match self {
            Self::Missing(_) => 3,
            Self::Doubled { .. } => 4,
            Self::Foreign(_) => 5,
        }
    }
}

/// What the parts have in common, and the picture that they make.
struct Merged {
    /// The first part's file; the others are held against it.
    name: String,
    identity: Vec<(String, String)>,
    provenance: Vec<(String, String)>,
    n_tiles: usize,
    n_samples: u32,
    counts: Counts,
    film: Film,
    /// Which tiles are there, and whose.
    taken: Vec<(Range<usize>, String)>,
}

/// Runs the subcommand.
pub(crate) fn run(arguments: &MergeArguments, quiet: bool) -> Result<()> {
    let outputs: Vec<_> = arguments.output.iter().map(Some).collect();
    require_one_on_standard_output(&outputs, arguments.json)?;
    arguments.output.iter().try_for_each(PicturePath::require_writable)?;
    let files = files(&arguments.parts)?;
    let mut merged: Option<Merged> = None;
    let mut unfinished = Vec::new();
    for path in &files {
        let part = read_part(path)?;
        let name = path.display().to_string();
        let merged = match &mut merged {
            Some(merged) => {
                merged.require_same(&name, &part)?;
                merged
            }
            none => none.insert(Merged::new(&name, &part)),
        };
        if !part.complete {
            unfinished.push(name.clone());
        }
        merged.take(name, &part)?;
    }
    let Some(mut merged) = merged else {
        return Err(MergeError::Missing("there are no parts in the folder".into()).into());
    };
    merged.require_all(&unfinished)?;

    let tone = arguments.tone.mapping(ToneCurve::Agx);
    let mut attributes = merged.provenance.clone();
    attributes.push(("domelight.complete".into(), "true".into()));
    let background = |(name, value): &(String, String)| name == "background" && value == "hidden";
    let hidden = merged.identity.iter().any(background);
    let layers = merged.film.layers();
    for output in &arguments.output {
        output.write_layers(&layers, &tone, hidden, attributes.clone())?;
    }
    merged.report(files.len(), arguments, quiet)
}

/// The files themselves, and the pictures in folders by name.
fn files(parts: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for part in parts {
        if !part.is_dir() {
            files.push(part.clone());
            continue;
        }
        let entries = fs::read_dir(part).with_context(|| part.display().to_string())?;
        let mut inside = Vec::new();
        for entry in entries {
            let path = entry.with_context(|| part.display().to_string())?.path();
            let hidden = path.file_name().is_some_and(|n| n.to_string_lossy().starts_with('.'));
            if !hidden && path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
                inside.push(path);
            }
        }
        inside.sort();
        files.extend(inside);
    }
    Ok(files)
}

fn read_part(path: &Path) -> Result<Checkpoint> {
    read(path).map_err(|error| match error.downcast_ref::<CheckpointError>() {
        Some(_) => MergeError::Foreign(format!("{error:#}")).into(),
        None => error,
    })
}

impl Merged {
    fn new(name: &str, part: &Checkpoint) -> Self {
        let Film { width, height, .. } = part.film;
        Self {
            name: name.to_owned(),
            identity: part.identity.clone(),
            provenance: part.provenance.clone(),
            n_tiles: part.n_tiles,
            n_samples: part.n_samples,
            counts: Counts::default(),
            film: Film::new(width, height, Window { x: 0, y: 0, width, height }),
            taken: Vec::new(),
        }
    }

    fn require_same(&self, name: &str, part: &Checkpoint) -> Result<(), MergeError> {
        let foreign = |what: &str, here: &str, there: &str| {
            let first = &self.name;
            let text = format!(
                "{name} is of another render: its {what} is {here}, that of {first} {there}"
            );
            Err(MergeError::Foreign(text))
        };
        if let Some(d) = part.difference(&self.identity) {
            return foreign(d.name, d.here, d.there);
        }
        let (here, there) = (part.n_samples.to_string(), self.n_samples.to_string());
        if here != there {
            return foreign("number of samples", &here, &there);
        }
        let size = |film: &Film| format!("{}x{}", film.width, film.height);
        let here = (size(&part.film), part.n_tiles);
        let there = (size(&self.film), self.n_tiles);
        if here != there {
            return foreign("division into tiles", &format!("{here:?}"), &format!("{there:?}"));
        }
        Ok(())
    }

    fn take(&mut self, name: String, part: &Checkpoint) -> Result<(), MergeError> {
        let tiles = part.tiles.clone();
        let overlap = |(taken, first): &(Range<usize>, String)| {
            let tile = taken.start.max(tiles.start);
            (tile < taken.end.min(tiles.end)).then(|| (tile, first.clone()))
        };
        if let Some((tile, first)) = self.taken.iter().find_map(overlap) {
            return Err(MergeError::Doubled { first, second: name, tile });
        }
        self.film.merge(&part.film);
        self.counts += part.counts;
        self.taken.push((tiles, name));
        Ok(())
    }

    fn require_all(&mut self, unfinished: &[String]) -> Result<(), MergeError> {
        self.taken.sort_by_key(|(tiles, _)| tiles.start);
        let ends = self.taken.iter().map(|(tiles, _)| tiles.end);
        let starts = self.taken.iter().map(|(tiles, _)| tiles.start).chain([self.n_tiles]);
        let gap =
            |(end, start): (usize, usize)| (end < start).then(|| format!("{end}-{}", start - 1));
        let missing: Vec<_> = [0].into_iter().chain(ends).zip(starts).filter_map(gap).collect();
        let mut text = Vec::new();
        if !missing.is_empty() {
            let (gaps, n) = (missing.join(", "), self.n_tiles);
            text.push(format!(
                "no part holds tiles {gaps} of 0-{}: render them with --tiles",
                n - 1
            ));
        }
        if !unfinished.is_empty() {
            let names = unfinished.join(", ");
            text.push(format!("unfinished: {names}: run the same render again to go on"));
        }
        if text.is_empty() { Ok(()) } else { Err(MergeError::Missing(text.join("; "))) }
    }

    fn report(&self, n_parts: usize, arguments: &MergeArguments, quiet: bool) -> Result<()> {
        #[derive(Serialize)]
        struct Report {
            parts: usize,
            tiles: usize,
            size: [usize; 2],
            spp: u32,
            camera_rays: u64,
            shadow_rays: u64,
            non_finite_samples: u64,
            outputs: Vec<String>,
        }
        let report = Report {
            parts: n_parts,
            tiles: self.n_tiles,
            size: [self.film.width, self.film.height],
            spp: self.n_samples,
            camera_rays: self.counts.camera_rays,
            shadow_rays: self.counts.shadow_rays,
            non_finite_samples: self.counts.non_finite,
            outputs: arguments.output.iter().map(ToString::to_string).collect(),
        };
        if arguments.json {
            print(&serde_json::to_string_pretty(&report)?)?;
        } else if !quiet {
            let Report { parts, size: [w, h], spp, outputs, .. } = report;
            let outputs = outputs.join(", ");
            tell(&format!("{parts} parts: {w}x{h}, {spp} samples a pixel -> {outputs}"));
        }
        Ok(())
    }
}
