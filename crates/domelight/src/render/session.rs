//! A render that can be interrupted, saved, restored and gone on with: its tiles and what they have.

use std::ops::Range;

use rayon::prelude::*;

use super::film::{Film, Layers, Misfit, PixelSums};
use super::filter::FilterSampler;
use super::spread::usual_growth;
use super::tile::{Counts, Pass, Scratch, Tile};
use super::tiling::{Tiling, Window};
use super::{Frame, Observer, RenderSettings, Rendering};
use crate::environment::Environment;
use crate::sampling::Stream;
use crate::scene::{Camera, Scene};
use crate::strategy::Strategy;

/// The tiles of a picture, or some of them, on their way to all their samples.
///
/// A tile depends on nothing but the scene, the settings, the seed and its own place: whether the
/// others are rendered here or elsewhere, and how often the work was interrupted, changes no bit.
pub struct Session<'a, S: Strategy> {
    frame: Frame<'a>,
    strategy: &'a S,
    tiling: Tiling,
    /// Which tiles.
    range: Range<usize>,
    tiles: Vec<Tile>,
    /// What was done before the session was restored.
    before: Counts,
}

impl<'a, S: Strategy> Session<'a, S> {
    /// All tiles of a picture.
    ///
    /// The camera must have been made for the settings' width and height. The strategy brings its own
    /// reference to the light that it samples; `environment` is what camera rays see.
    ///
    /// # Panics
    /// If width, height or tile size are zero.
    pub fn new(
        scene: &'a Scene,
        camera: &'a Camera,
        environment: &'a Environment,
        strategy: &'a S,
        settings: &'a RenderSettings,
    ) -> Self {
        let filter = FilterSampler::new(settings.filter);
        let extent = scene.bounds().size().max_element();
        let frame = Frame { scene, camera, environment, settings, filter, extent };
        let tiling = Tiling::new(settings, strategy.n_rays());
        let empty = Self {
            frame,
            strategy,
            tiling,
            range: 0..0,
            tiles: Vec::new(),
            before: Counts::default(),
        };
        empty.only(0..tiling.n_tiles())
    }

    /// The same with `tiles` alone, without samples.
    ///
    /// # Panics
    /// If there are no such tiles.
    #[must_use]
    pub fn only(mut self, tiles: Range<usize>) -> Self {
        self.tiles = tiles.clone().map(|t| Tile::new(self.tiling.tile(t))).collect();
        self.range = tiles;
        self
    }

    /// How the picture is divided.
    pub fn tiling(&self) -> Tiling {
        self.tiling
    }

    /// Which tiles these are.
    pub fn tiles(&self) -> Range<usize> {
        self.range.clone()
    }

    /// Renders what is missing, on rayon's current pool of threads, until the observer ends it: then a
    /// later run goes on. Returns whether all is there.
    pub fn run(&mut self, observer: &impl Observer) -> bool {
        while let Some(start) = self.unfinished().map(Tile::n_samples).min() {
            if observer.cancelled() {
                return false;
            }
            let Self { frame, strategy, tiling, tiles, .. } = self;
            let n_samples = frame.settings.n_samples;
            let samples = tiling.pass(*strategy, start, n_samples - start);
            observer.pass_started(samples.clone());
            let stream = Stream::of_pass(frame.settings.sampler, frame.settings.seed, start);
            let n_samples = samples.len() as u32;
            let shared = strategy.begin_pass(stream, n_samples);
            let mut pass = Pass { n_samples, usual_growth: None, shared };
            if frame.settings.adaptive && S::N_ROUNDS > 1 {
                pass.usual_growth = usual_growth(frame, *strategy, &pass);
            }
            let behind =
                |tile: &Tile| tile.n_samples() == start && !tile.is_finished(frame.settings);
            let complete = tiles
                .par_iter_mut()
                .filter(|tile| behind(tile))
                .map_init(Scratch::<S>::default, |scratch, tile| {
                    if observer.cancelled() {
                        return false;
                    }
                    let counts = tile.render(frame, *strategy, &pass, scratch, observer);
                    observer.tile_finished(&counts);
                    true
                })
                .reduce(|| true, |a, b| a & b);
            if !complete {
                return false;
            }
        }
        true
    }

    /// Has all samples of all its pixels.
    pub fn is_complete(&self) -> bool {
        self.unfinished().next().is_none()
    }

    fn unfinished(&self) -> impl Iterator<Item = &Tile> {
        self.tiles.iter().filter(|tile| !tile.is_finished(self.frame.settings))
    }

    /// What was done, before the session was restored as well.
    pub fn counts(&self) -> Counts {
        self.tiles.iter().fold(self.before, |sum, tile| sum + tile.counts)
    }

    /// The sums of all pixels so far.
    pub fn film(&self) -> Film {
        let RenderSettings { width, height, .. } = *self.frame.settings;
        let window = self.tiling.window(&self.range);
        let mut film = Film::new(width, height, window);
        for tile in &self.tiles {
            film.put(tile.window, &tile.sums());
        }
        film
    }

    /// Takes the sums over that another session of the same render had.
    ///
    /// # Errors
    /// If they are of another part or size of picture, or of no whole number of passes.
    pub fn restore(&mut self, film: &Film, counts: Counts) -> Result<(), Misfit> {
        film.require_window(self.frame.settings, self.tiling.window(&self.range))?;
        for tile in &mut self.tiles {
            let pixels: Vec<PixelSums> = film.get(tile.window);
            let n_samples = pixels[0].n_samples();
            if pixels.iter().any(|p| (p.n_samples() == 0) != (n_samples == 0)) {
                let Window { x, y, .. } = tile.window;
                return Err(Misfit::Samples { x, y });
            }
            tile.restore(pixels);
        }
        self.before = counts;
        Ok(())
    }

    /// The picture of all tiles so far.
    pub fn rendering(&self) -> Rendering {
        let window = self.tiling.window(&self.range);
        let mut layers = Layers::new(window.width, window.height);
        for tile in &self.tiles {
            tile.put_into(&mut layers, window);
        }
        Rendering { layers, counts: self.counts(), complete: self.is_complete() }
    }
}
