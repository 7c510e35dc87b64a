//! Determines the scale of the sample allocation of a picture: small windows, spread over the picture, are rendered
//! first and show how many samples its pixels will get.

use rayon::prelude::*;

use super::allocation::{OCTAVES, mean_count};
use super::tile::{Pass, SECOND_SETS, Scratch, Tile};
use super::tiling::Window;
use super::{Observer, RenderContext, RenderSettings};
use crate::sampling::{Pcg32, Sampler};
use crate::strategy::Strategy;
use crate::strategy::levels::N_LEVELS;

/// The number of columns and rows of a scout window, whose corners are pixels of the first level. Many small windows
/// estimate the mean over the picture better than a few large ones: the error of 9 × 9 windows at equal cost was twice
/// as large (docs/experiments.md).
const SCOUT_WINDOW: usize = 5;

/// The fraction of a tile's pixels in a level.
fn share(level: u32) -> f64 {
    f64::from(1 << level.saturating_sub(1)) / 16.0
}

/// A pixel that shows how many samples pixels like it will get.
#[derive(Clone, Copy, Debug)]
struct Scout {
    level: u32,
    /// The logarithm that determines its number of samples; `None` for the default number.
    log: Option<f32>,
    /// The minimum octaves of that number.
    fewest: i32,
    /// The expected number of its sets of samples.
    n_sets: f64,
    /// The luminance, if surfaces cover it.
    luminance: Option<f32>,
}

/// What scouts tell about a picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scouted {
    /// The logarithm at which a pixel gets the default number of samples, so that the total over the picture is about
    /// the number requested.
    pub(super) mean_log: f32,
    /// The mean luminance of surfaces, if a pixel shows nothing else.
    pub(super) brightness: Option<f32>,
}

impl Scouted {
    /// `None` if no scout sees the scene.
    fn by(scouts: &[Scout], n: u32) -> Option<Self> {
        let mean_log = mean_log(scouts, n)?;
        let luminances = || scouts.iter().filter_map(|scout| scout.luminance);
        let sum: f64 = luminances().map(f64::from).sum();
        let brightness = (sum > 0.0).then(|| (sum / luminances().count() as f64) as f32);
        Some(Self { mean_log, brightness })
    }
}

impl Scout {
    /// The pixels of a rendered window. Pixels with fewer known neighbors than others of their level are left out,
    /// because they are rarer in tiles than in windows.
    fn of_window<S: Strategy>(
        scratch: &Scratch<S>,
        second_sets: f64,
    ) -> impl Iterator<Item = Self> {
        let allocation = scratch.allocation();
        let mut most = [0; N_LEVELS as usize];
        for pixel in 0..allocation.n_pixels() {
            let most = &mut most[allocation.level(pixel) as usize];
            *most = allocation.n_known(pixel).max(*most);
        }
        let is_typical =
            move |&i: &usize| allocation.n_known(i) == most[allocation.level(i) as usize];
        let scout = move |pixel: usize| Self {
            level: allocation.level(pixel),
            log: allocation.log(pixel),
            fewest: allocation.fewest(pixel),
            luminance: allocation.covered_luminance(pixel),
            n_sets: if scratch.seen()[pixel] { 1.0 + second_sets } else { 1.0 },
        };
        (0..allocation.n_pixels()).filter(is_typical).map(scout)
    }

    /// The expected number of samples of pixels like it, if a pixel at `mean_log` has `n`.
    fn count(self, n: u32, mean_log: f32) -> f64 {
        let octaves = self.log.map(|log| log - mean_log);
        let count = |octaves| mean_count(n, octaves, self.fewest);
        self.n_sets * octaves.map_or(f64::from(n), count)
    }
}

/// The mean number of samples of a pixel of the picture over n, second sets included, if a pixel at `mean_log` has `n`.
fn spent(scouts: &[Scout], n: u32, mean_log: f32) -> f64 {
    let (mut sum, mut shares) = (0.0, 0.0);
    for level in 0..N_LEVELS {
        let of_level = || scouts.iter().filter(|scout| scout.level == level);
        let counts: f64 = of_level().map(|scout| scout.count(n, mean_log)).sum();
        if counts > 0.0 {
            sum += share(level) * counts / of_level().count() as f64;
            shares += share(level);
        }
    }
    sum / shares / f64::from(n)
}

/// The logarithm at which a pixel has `n` samples, if pixels like these have `n` on average; `None` if no pixel sees the
/// scene.
fn mean_log(scouts: &[Scout], n: u32) -> Option<f32> {
    /// The number of bisection steps.
    const STEPS: usize = 20;
    let [fewest, most] = OCTAVES.map(|octaves| octaves as f32);
    let logs = || scouts.iter().filter_map(|scout| scout.log);
    let mut low = logs().reduce(f32::min)? - most - 1.0;
    let mut high = logs().reduce(f32::max)? - fewest + 1.0;
    // `low` spends too much; `high` does not.
    for _ in 0..STEPS {
        let middle = 0.5 * (low + high);
        if spent(scouts, n, middle) > 1.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(high)
}

/// What scouts tell about a picture, and what the strategy has learned in each window.
type Scouting<S> = (Scouted, Vec<<S as Strategy>::Findings>);

/// Sends scouts over the picture, and returns what they tell, `None` if none of them sees the scene, and the number of
/// shadow rays that they took.
///
/// Scouts are windows of pixels, spread over the picture, with their own random numbers, because a scale that depends
/// on a pixel's own samples would introduce bias. They are rendered twice: a few with the same number of samples in
/// every pixel, which gives a first scale; then all of them with that scale, because a strategy that learns has less
/// error with more samples to learn from. The first ones tell the others what they have found.
///
/// Once the observer has cut the render short, no more are sent, and what they tell is worth nothing.
pub(super) fn scout<S: Strategy>(
    context: &RenderContext,
    strategy: &S,
    pass: &Pass<S>,
    observer: &(impl Observer + ?Sized),
) -> (Option<Scouting<S>>, u64) {
    /// The number of pixels of the picture per window. Scouts cost a fiftieth of the render, less for large pictures.
    const PIXELS_PER_WINDOW: usize = 20 * SCOUT_WINDOW * SCOUT_WINDOW;
    /// The minimum and maximum number of windows.
    const N_WINDOWS: [usize; 2] = [52, 1296];
    /// The number of windows for the first scale.
    const FIRST: usize = 29;
    /// The divisor of the picture's samples per pixel: the estimated noise depends little on the number of samples.
    const SAMPLES_DIVISOR: u32 = 4;
    /// The minimum number of samples per pixel.
    const FEWEST_SAMPLES: u32 = 4;
    let RenderSettings { width, height, seed, .. } = context.settings;
    let settings = RenderSettings { seed: !seed, ..context.settings };
    let (filter, portals) = (context.filter.clone(), context.portals.clone());
    let context = &RenderContext { settings, filter, portals, ..*context };
    let sampler = Sampler::for_pass(settings.sampler, settings.seed, 0);
    let n_samples = (pass.n_samples / SAMPLES_DIVISOR).max(FEWEST_SAMPLES).min(pass.n_samples);
    // Prepare it for as many samples as the picture's, because the findings are about its cells.
    let shared = strategy.begin_pass(sampler, pass.n_samples);
    let mut pass = Pass {
        n_samples,
        adaptive: true,
        mean_log: None,
        brightness: None,
        is_scouting: true,
        shared,
        ..*pass
    };
    // Second sets of samples count toward the budget, except with a target error, where they are passes of their own.
    let second_sets = if settings.target_error.is_none() { SECOND_SETS } else { 0.0 };
    let mut n_rays = 0;
    let mut send = |n: usize, pass: &Pass<S>| -> (Vec<Scout>, Vec<S::Findings>) {
        let windows: Vec<_> = spread(width, height, SCOUT_WINDOW, n)
            .into_par_iter()
            .filter(|_| !observer.has_cut_short())
            .map_init(Box::<Scratch<S>>::default, |scratch, window| {
                let counts = Tile::new(window).render(context, strategy, pass, scratch, &());
                let scouts: Vec<_> = Scout::of_window(scratch, second_sets).collect();
                // A strategy is not asked about a window where nothing is visible.
                let seeing = scratch.seen().contains(&true);
                let findings = seeing.then(|| strategy.findings(scratch.of_strategy()));
                (scouts, findings, counts.shadow_rays)
            })
            .collect();
        let (mut scouts, mut findings) = (Vec::new(), Vec::new());
        for (of_window, found, rays) in windows {
            scouts.extend(of_window);
            findings.extend(found);
            n_rays += rays;
        }
        (scouts, findings)
    };
    let (scouts, findings) = send(FIRST, &pass);
    let Some(first) = Scouted::by(&scouts, pass.n_samples) else { return (None, n_rays) };
    (pass.mean_log, pass.brightness) = (Some(first.mean_log), first.brightness);
    strategy.brief(&mut pass.shared, findings);
    let [fewest, most] = N_WINDOWS;
    let n_windows = (width * height / PIXELS_PER_WINDOW).clamp(fewest, most);
    let (scouts, findings) = send(n_windows, &pass);
    (Scouted::by(&scouts, pass.n_samples).map(|scouted| (scouted, findings)), n_rays)
}

/// About `n` windows of `size` × `size` pixels, or as large as the picture allows, one at a random position in each
/// cell of a grid.
fn spread(width: usize, height: usize, size: usize, n: usize) -> Vec<Window> {
    let aspect = (width as f64 / height as f64).sqrt();
    let cells = |of: f64, extent: usize| ((n as f64).sqrt() * of).round().clamp(1.0, extent as f64);
    let (across, down) = (cells(aspect, width), cells(1.0 / aspect, height));
    let mut pcg = Pcg32::new(0, 0);
    let mut place = |i: usize, cells: f64, extent: usize| {
        let free = (extent + 1 - size.min(extent)) as f64;
        ((i as f64 + f64::from(pcg.next_f32())) / cells * free) as usize
    };
    let mut windows = Vec::with_capacity((across * down) as usize);
    for row in 0..down as usize {
        for column in 0..across as usize {
            let (x, y) = (place(column, across, width), place(row, down, height));
            windows.push(Window { x, y, width: size.min(width), height: size.min(height) });
        }
    }
    windows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::strategy::levels::level;

    /// Pixels like the scouts get the requested number of samples on average.
    #[test]
    fn the_scale_spends_what_was_asked_for() {
        let mut pcg = Pcg32::new(1, 2);
        for n in [8, 16, 64] {
            for range in [0.0, 1.0, 4.0] {
                let scouts: Vec<Scout> = (0..1024)
                    .map(|i| {
                        let level = level(i % 32, i / 32);
                        let log = -3.0 + range * (pcg.next_f32() - 0.5);
                        Scout {
                            level,
                            log: (level > 0).then_some(log),
                            fewest: OCTAVES[0],
                            n_sets: 1.0,
                            luminance: None,
                        }
                    })
                    .collect();
                let mean_log = mean_log(&scouts, n).unwrap();
                let mean = spent(&scouts, n, mean_log);
                assert!((mean - 1.0).abs() < 1e-3, "{n} {range}: {mean}");
            }
        }
        assert_eq!(
            mean_log(&[Scout { level: 0, log: None, fewest: 0, n_sets: 1.0, luminance: None }], 8),
            None
        );
    }

    #[test]
    fn scouts_lie_within_the_picture() {
        for (width, height) in [(1, 1), (640, 3), (9, 700), (640, 480)] {
            let windows = spread(width, height, SCOUT_WINDOW, 25);
            assert!((1..=100).contains(&windows.len()), "{}", windows.len());
            for w in windows {
                assert!(w.x + w.width <= width && w.y + w.height <= height, "{w:?}");
            }
        }
    }
}
