//! The candidates of a pixel: directions from the product table and from the material, weighed by the
//! balance heuristic.
//!
//! M strata of the table and N samples of the material are shared by the n camera hits of the pixel:
//! stratum k belongs to hit (k + r) mod n with one random r, so every hit has each stratum with
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
use crate::environment::Environment;
use crate::math::Vec3;
use crate::sampling::{Dimension, Stream};

/// A direction that may become a shadow ray.
#[derive(Clone, Copy, Debug)]
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

    /// The hit of candidate `k` of a kind, of `n` hits.
    fn hit(&self, kind: usize, k: usize, n: usize) -> usize {
        (k + (self.shift[kind] * n as f32) as usize) % n
    }
}

impl Sources<'_> {
    /// Draws all candidates that are not black: first along the curve, then those of the material.
    pub(super) fn draw(
        &self,
        points: &[ShadingPoint],
        counts: Counts,
        numbers: &PixelNumbers,
        strata: &mut Vec<u32>,
        candidates: &mut Vec<Candidate>,
    ) {
        candidates.clear();
        let (m, n_brdf) = (counts.light, counts.brdf as f32);
        let total = self.table.total();
        let n_light = if total > 0.0 { m as f32 / total } else { 0.0 };
        if n_light > 0.0 {
            self.table.strata(m, numbers.strata, strata);
            for (k, &cell) in strata.iter().enumerate() {
                let inside = self.table.inside(cell as usize, k, m, numbers.strata);
                let light = self.pool.at(cell as usize, inside);
                let hit = numbers.hit(0, k, points.len());
                let (f, pdf) = points[hit].eval_pdf(light.wi);
                let density =
                    n_light * self.table.width(cell as usize) * light.density + n_brdf * pdf;
                push(candidates, light.wi, f * light.le / density, cell, hit);
            }
        }
        for j in 0..counts.brdf {
            let hit = numbers.hit(1, j, points.len());
            let u = numbers.stream.numbers(Dimension::Brdf, j as u32);
            let Some(s) = points[hit].sample(u.u_lobe(), u.u()) else { continue };
            let Some((cell, le)) = self.cells.find(self.environment, s.wi) else { continue };
            let density = le.luminance() / self.cells.mass_of(cell);
            let density = n_light * self.table.width(cell) * density + n_brdf * s.pdf;
            push(candidates, s.wi, s.value * le / density, cell as u32, hit);
        }
    }
}

fn push(candidates: &mut Vec<Candidate>, wi: Vec3, value: Rgb, cell: u32, hit: usize) {
    let luminance = value.luminance();
    if luminance != 0.0 {
        candidates.push(Candidate { wi, value, luminance, cell, hit: hit as u32 });
    }
}
