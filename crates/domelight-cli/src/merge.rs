//! `domelight merge`: merges parts into a picture.
//!
//! The parts are read twice: first to check that they are complete, belong to one render and cover the picture, then band by
//! band from top to bottom, each part only while its rows are written.

use std::fs;
use std::iter::Peekable;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::slice;

use anyhow::{Context as _, Result};
use domelight::picture::exposure::Exposure;
use domelight::picture::exr::bands::BAND_ROWS;
use domelight::render::{
    Checkpoint, CheckpointError, Counts, Film, Layers, VarianceSums, kept_exposure,
};
use domelight::{Rgb, RgbImage};
use serde::Serialize;

use crate::args::MergeArguments;
use crate::error::status;
use crate::memory;
use crate::output::{PicturePath, print_json, require_one_on_standard_output};
use crate::render_run::{or_none, read, spelled};
use crate::terminal::Terminal;
use crate::tone::Shown;
use domelight_lab::Host as _;

/// Memory per pixel of a band: its layers, as channels, and compressed.
const BAND_PIXEL: u64 = 300;

/// Memory per pixel whose color and alpha are kept, including as PNG.
const FLAT_PIXEL: u64 = 20;

/// An error in merging parts.
#[derive(Debug, thiserror::Error)]
pub(crate) enum MergeError {
    /// Tiles that no part has, or interrupted parts.
    #[error("{0}")]
    Missing(String),
    /// A tile in two parts.
    #[error("{first} and {second} both hold tile {tile}")]
    Doubled { first: String, second: String, tile: usize },
    /// A damaged file, or one that belongs to another render.
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

/// The common data of the parts, and their files.
struct Merged {
    /// The first part's file, with which the others are compared.
    name: String,
    identity: Vec<(String, String)>,
    provenance: Vec<(String, String)>,
    width: usize,
    height: usize,
    n_tiles: usize,
    n_samples: u32,
    counts: Counts,
    /// Over all parts.
    variance: VarianceSums,
    /// The parts, sorted by tile once all are read.
    parts: Vec<Part>,
}

/// A part that was read and is complete.
struct Part {
    path: PathBuf,
    name: String,
    tiles: Range<usize>,
    first_row: usize,
}

/// Runs the subcommand.
pub(crate) fn run(arguments: &MergeArguments, quiet: bool) -> Result<()> {
    let outputs: Vec<_> = arguments.output.iter().map(Some).collect();
    require_one_on_standard_output(&outputs, arguments.json)?;
    arguments.output.iter().try_for_each(PicturePath::declare)?;
    let parts = files(&arguments.parts)?;
    parts.iter().try_for_each(|part| crate::files::reads(part))?;
    let mut merged: Option<Merged> = None;
    let mut unfinished = Vec::new();
    for path in parts {
        let part = read_part(&path)?;
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
        merged.take(path, name, &part)?;
    }
    let Some(mut merged) = merged else {
        return Err(MergeError::Missing("there are no parts in the folder".into()).into());
    };
    merged.require_all(&unfinished)?;

    let png = merged.write(arguments)?;
    merged.report(arguments, png, quiet)
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
            width,
            height,
            n_tiles: part.n_tiles,
            n_samples: part.n_samples,
            counts: Counts::default(),
            variance: VarianceSums::default(),
            parts: Vec::new(),
        }
    }

    fn require_same(&self, name: &str, part: &Checkpoint) -> Result<(), MergeError> {
        let foreign = |what: &str, here: &str, there: &str| {
            let first = &self.name;
            let what = spelled(what);
            let text = format!(
                "{name} belongs to another render: its {what} is {}, that of {first} {}",
                or_none(here),
                or_none(there)
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
        let divided = |width, height, n_tiles| format!("{width}x{height} in {n_tiles} tiles");
        let here = divided(part.film.width, part.film.height, part.n_tiles);
        let there = divided(self.width, self.height, self.n_tiles);
        if here != there {
            return foreign("division into tiles", &here, &there);
        }
        Ok(())
    }

    fn take(&mut self, path: PathBuf, name: String, part: &Checkpoint) -> Result<(), MergeError> {
        let tiles = part.tiles.clone();
        let overlap = |other: &Part| {
            let tile = other.tiles.start.max(tiles.start);
            (tile < other.tiles.end.min(tiles.end)).then(|| (tile, other.name.clone()))
        };
        if let Some((tile, first)) = self.parts.iter().find_map(overlap) {
            return Err(MergeError::Doubled { first, second: name, tile });
        }
        self.counts += part.counts;
        self.variance.add(&part.film.variance_sums());
        self.parts.push(Part { path, name, tiles, first_row: part.film.window.y });
        Ok(())
    }

    fn require_all(&mut self, unfinished: &[String]) -> Result<(), MergeError> {
        self.parts.sort_by_key(|part| (part.tiles.start, part.tiles.end));
        let ends = self.parts.iter().map(|part| part.tiles.end);
        let starts = self.parts.iter().map(|part| part.tiles.start).chain([self.n_tiles]);
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
            text.push(format!("unfinished: {names}: run the same render again to continue"));
        }
        if text.is_empty() { Ok(()) } else { Err(MergeError::Missing(text.join("; "))) }
    }

    /// Writes all outputs; what is no OpenEXR needs all of the picture's colors in memory. Returns how PNG output is
    /// shown.
    fn write(&self, arguments: &MergeArguments) -> Result<Option<Shown>> {
        let mut attributes = self.provenance.clone();
        attributes.push(("domelight.complete".into(), "true".into()));
        let (layered, flat): (Vec<_>, Vec<_>) =
            arguments.output.iter().partition(|output| output.has_all_layers());
        let (width, height) = (self.width, self.height);
        memory::allow_picture(width, BAND_ROWS.min(height), BAND_PIXEL)?;
        if !flat.is_empty() {
            memory::allow_picture(width, height, FLAT_PIXEL)?;
            memory::keep(FLAT_PIXEL * (width * height) as u64);
        }
        let mut picture = (!flat.is_empty()).then(Flat::default);
        for output in &layered {
            let mut bands = Bands::new(self);
            let mut gathered = picture.as_mut().filter(|picture| picture.color.is_empty());
            output.write_bands(self.height, |y| {
                let band = bands.next(y)?;
                if let Some(picture) = &mut gathered {
                    picture.add(&band);
                }
                Ok(band.to_exr(attributes.clone()))
            })?;
        }
        let Some(mut picture) = picture else { return Ok(None) };
        if layered.is_empty() {
            let mut bands = Bands::new(self);
            for y in (0..self.height).step_by(BAND_ROWS) {
                picture.add(&bands.next(y)?);
            }
        }
        let background =
            |(name, value): &(String, String)| name == "background" && value == "hidden";
        let hidden = self.identity.iter().any(background);
        let color = RgbImage::new(self.width, self.height, picture.color);
        let alpha = hidden.then_some(&picture.alpha[..]);
        let median = || Exposure::Auto.stops(&color, alpha);
        let automatic = || kept_exposure(&self.provenance).unwrap_or_else(median);
        let tone = arguments.tone.of_picture(automatic);
        flat.iter().try_for_each(|output| output.write_color(&color, alpha, &tone))?;
        let is_shown = flat.iter().any(|output| output.is_png());
        Ok(is_shown.then(|| Shown::new(&arguments.tone, &tone)))
    }

    fn report(&self, arguments: &MergeArguments, png: Option<Shown>, quiet: bool) -> Result<()> {
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
            png: Option<Shown>,
        }
        Terminal { quiet }.warn_of_non_finite("", self.counts.non_finite);
        let report = Report {
            parts: self.parts.len(),
            tiles: self.n_tiles,
            size: [self.width, self.height],
            spp: self.n_samples,
            camera_rays: self.counts.camera_rays,
            shadow_rays: self.counts.shadow_rays,
            non_finite_samples: self.counts.non_finite,
            outputs: arguments.output.iter().map(ToString::to_string).collect(),
            png,
        };
        if arguments.json {
            print_json(&report)?;
        } else if !quiet {
            let Report { parts, size: [w, h], spp, outputs, .. } = report;
            let outputs = outputs.join(", ");
            let png = png.map_or(String::new(), |shown| format!(" (PNG at {shown})"));
            status(&format!("{parts} parts: {w}x{h}, {spp} samples per pixel -> {outputs}{png}"));
        }
        Ok(())
    }
}

/// The rows of the picture from top to bottom, [`BAND_ROWS`] at a time.
struct Bands<'m> {
    merged: &'m Merged,
    waiting: Peekable<slice::Iter<'m, Part>>,
    /// The parts that have rows in the current band.
    open: Vec<Film>,
}

impl<'m> Bands<'m> {
    fn new(merged: &'m Merged) -> Self {
        Self { merged, waiting: merged.parts.iter().peekable(), open: Vec::new() }
    }

    /// The band that begins at row `y`, where the last one ended.
    fn next(&mut self, y: usize) -> Result<Layers> {
        let Merged { width, height, .. } = *self.merged;
        let end = height.min(y + BAND_ROWS);
        while let Some(part) = self.waiting.next_if(|part| part.first_row < end) {
            let read = read_part(&part.path)?;
            self.merged.require_same(&part.name, &read)?;
            self.open.push(read.film);
        }
        let mut band = Layers::new(width, end - y);
        self.open.iter().for_each(|film| band.merge(film, y, &self.merged.variance));
        self.open.retain(|film| film.window.y + film.window.height > end);
        Ok(band)
    }
}

/// Only color and alpha, row by row.
#[derive(Default)]
struct Flat {
    color: Vec<Rgb>,
    alpha: Vec<f32>,
}

impl Flat {
    fn add(&mut self, band: &Layers) {
        self.color.extend_from_slice(&band.color.pixels);
        self.alpha.extend_from_slice(&band.alpha);
    }
}
