//! The candidates of a pixel: directions from the product table and from the material, weighed by the
//! balance heuristic.
//!
//! M strata of the table and N samples of the material are shared by the n camera hits of the pixel:
//! stratum k belongs to hit (k − r) mod n with one random r, so every hit has each stratum with
//! probability 1/n. A candidate stands for
//!
//! ```text
//! W = f(ω) L(ω) / (M p_table(ω) + N p_brdf(ω))        p_table = width(c)/total · L/W(c)
//! ```
//!
//! f and p_brdf those of its hit, and Σ W is an unbiased estimate of the mean over the hits of
//! ∫ f L dω: of each hit it is the multi-sample estimator of Veach & Guibas 1995 with counts M/n and
//! N/n in expectation.

use super::super::ShadingPoint;
use super::cells::Cells;
use super::pool::Pool;
use super::table::Table;
use crate::Rgb;
use crate::bsdf::{LANES, VecBlock};
use crate::environment::Environment;
use crate::math::Vec3;
use crate::sampling::{Dimension, Stream};

/// A direction that may become a shadow ray.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Candidate {
    /// World direction.
    pub(super) wi: Vec3,
    /// W.
    pub(super) value: Rgb,
    /// Its luminance.
    pub(super) luminance: f32,
    /// Where its light is.
    pub(super) cell: u32,
    /// Which hit of the pixel.
    pub(super) hit: u32,
}

/// How many candidates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Counts {
    /// Strata of the table.
    pub(super) light: usize,
    /// Samples of the material.
    pub(super) brdf: usize,
}

/// Where candidates come from.
pub(super) struct Sources<'a> {
    pub(super) environment: &'a Environment,
    pub(super) cells: &'a Cells,
    pub(super) pool: &'a Pool,
    pub(super) table: &'a Table,
}

/// The random numbers of a pixel in a pass.
#[derive(Clone, Copy, Debug)]
pub(super) struct PixelNumbers {
    /// The offset of all strata.
    pub(super) strata: f32,
    /// The offset of the choice of rays.
    pub(super) choice: f32,
    /// Shifts of the hits against the strata and against the samples of the material.
    shift: [f32; 2],
    stream: Stream,
}

impl PixelNumbers {
    /// From a stream that serves this pixel in this pass alone.
    pub(super) fn new(stream: Stream) -> Self {
        let [strata, choice, a, b] = stream.numbers(Dimension::Resampling, 0).0;
        Self { strata, choice, shift: [a, b], stream }
    }

    /// The first stratum of a hit, of `n` hits; every n-th follows.
    fn first(&self, hit: usize, n: usize) -> usize {
        (hit + (self.shift[0] * n as f32) as usize) % n
    }

    /// The hit of sample `j` of the material, of `n` hits.
    fn brdf_hit(&self, j: usize, n: usize) -> usize {
        (j + (self.shift[1] * n as f32) as usize) % n
    }
}

impl Sources<'_> {
    /// Draws all candidates: first along the curve, then those of the material. Some are black.
    #[inline(always)]
    pub(super) fn draw(
        &self,
        points: &[ShadingPoint],
        counts: Counts,
        numbers: &PixelNumbers,
        strata: &mut Vec<u32>,
        candidates: &mut Vec<Candidate>,
    ) {
        let total = self.table.total();
        let scale = if total > 0.0 { counts.light as f32 / total } else { 0.0 };
        if scale > 0.0 {
            self.table.strata(counts.light, numbers.strata, strata);
            candidates.resize(counts.light, Candidate::default());
            for (hit, at) in points.iter().enumerate() {
                let first = numbers.first(hit, points.len());
                let step = points.len();
                let of_hit = OfHit { hit, at, scale, n_brdf: counts.brdf as f32 };
                for first in (first..counts.light).step_by(step * LANES) {
                    self.draw_lights(&of_hit, first, step, numbers.strata, strata, candidates);
                }
            }
        } else {
            candidates.clear();
        }
        self.draw_brdf(points, counts, scale, numbers, candidates);
    }

    /// Strata `first`, `first` + `step`, … of a hit, up to a block of them.
    #[inline(always)]
    fn draw_lights(
        &self,
        of_hit: &OfHit,
        first: usize,
        step: usize,
        xi: f32,
        strata: &[u32],
        candidates: &mut [Candidate],
    ) {
        let m = strata.len();
        let n = (m - first).div_ceil(step).min(LANES);
        let mut wi = VecBlock::default();
        let mut le = [[0.0; LANES]; 3];
        let mut density = [1.0; LANES];
        for lane in 0..n {
            let k = first + lane * step;
            let cell = strata[k] as usize;
            let light = self.pool.at(cell, self.table.inside(cell, k, m, xi));
            wi.set(lane, light.wi);
            (le[0][lane], le[1][lane], le[2][lane]) = (light.le.r, light.le.g, light.le.b);
            density[lane] = of_hit.scale * self.table.width(cell) * light.density;
        }
        let f = of_hit.at.eval_pdf_block(&wi);
        let mut value = [[0.0; LANES]; 3];
        let mut luminance = [0.0; LANES];
        for lane in 0..LANES {
            let weight = 1.0 / (density[lane] + of_hit.n_brdf * f.pdf[lane]);
            for c in 0..3 {
                value[c][lane] = f.value[c][lane] * le[c][lane] * weight;
            }
            let [r, g, b] = [0, 1, 2].map(|c| value[c][lane]);
            luminance[lane] = Rgb::new(r, g, b).luminance();
        }
        for lane in 0..n {
            let k = first + lane * step;
            candidates[k] = Candidate {
                wi: wi.get(lane),
                value: Rgb::new(value[0][lane], value[1][lane], value[2][lane]),
                luminance: luminance[lane],
                cell: strata[k],
                hit: of_hit.hit as u32,
            };
        }
    }

    /// Samples of the material.
    fn draw_brdf(
        &self,
        points: &[ShadingPoint],
        counts: Counts,
        scale: f32,
        numbers: &PixelNumbers,
        candidates: &mut Vec<Candidate>,
    ) {
        for j in 0..counts.brdf {
            let hit = numbers.brdf_hit(j, points.len());
            let u = numbers.stream.numbers(Dimension::Brdf, j as u32);
            let Some(s) = points[hit].sample(u.u_lobe(), u.u()) else { continue };
            let Some((cell, le)) = self.cells.find(self.environment, s.wi) else { continue };
            let density = le.luminance() / self.cells.mass_of(cell);
            let density = scale * self.table.width(cell) * density + counts.brdf as f32 * s.pdf;
            let value = s.value * le / density;
            let (wi, luminance) = (s.wi, value.luminance());
            candidates.push(Candidate { wi, value, luminance, cell: cell as u32, hit: hit as u32 });
        }
    }
}

/// A hit whose candidates are drawn.
struct OfHit<'a> {
    hit: usize,
    at: &'a ShadingPoint,
    /// M over the total of the table.
    scale: f32,
    /// N.
    n_brdf: f32,
}
