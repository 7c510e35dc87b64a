//! Sampling importance resampling of the product of light and reflectance: Burke, Ghosh & Heidrich
//! 2005, "Bidirectional Importance Sampling for Direct Illumination"; the same estimator with one
//! pick is the resampled importance sampling of Talbot, Cline & Egbert 2005.
//!
//! M candidates xⱼ are drawn from an easy density. Each has a weight Wⱼ, its unshadowed contribution
//! p̂(xⱼ) divided by M times the density. N of them are picked in proportion to their weights, and only those
//! are traced:
//!
//! ```text
//! (Σ W) · (1/N) Σ V(pick)        Σ W estimates L_ns, the unshadowed integral
//! ```
//!
//! The expectation over the picks is Σ Wⱼ V(xⱼ), the estimate from tracing all candidates, so it is
//! unbiased for every M, N ≥ 1. With independent candidates and picks, its variance is
//!
//! ```text
//! A/M + (1 − 1/M) B/N     A = Var(p̂ V / q),  B = I (L_ns − I)
//! ```
//!
//! The first term is that of plain importance sampling with M rays. The second comes from the unknown
//! visibility. This is no better than tracing all candidates, but a candidate costs less than a ray. See
//! [`Candidates::optimal_number`].
//!
//! Weights are luminances, and a pick carries its color divided by its luminance. The luminances of the
//! weights add up to Σ W exactly, and the colors do so in expectation. A candidate picked k times is one
//! ray with k times the weight.
//!
//! Candidates from both factors are weighted by Veach's balance heuristic: the density is the mixture
//! with the expected counts. An odd candidate comes from either factor at random. If the candidates are
//! sorted along a space-filling curve, systematic resampling becomes stratified, because the picks spread
//! over the light that reaches the point.
//!
//! Rejected: a number of candidates that adapts to the estimate itself (biased, because the decision to
//! stop would depend on the values), or from pixel to pixel (the points would no longer form one
//! sequence).

use super::multi_sample::{Count, MultiSample, SampleScratch};
use super::point_lanes::MOST_LANES;
use super::portal::Portals;
use super::{Contributions, PointStrategy, SampleIndex, ShadingPoint, TileShading};
use crate::Rgb;
use crate::environment::Environment;
use crate::math::{Vec3, functions};
use crate::sampling::hilbert::hemisphere_index;
use crate::sampling::rng::hash2;
use crate::sampling::{
    Dimension, Heuristic, ONE_MINUS_EPSILON, Pcg32, Sampler, SamplerKind, WeightedReservoirs,
};
use crate::simd::InstructionSet;

/// The density from which candidates are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Candidates {
    /// The environment, in proportion to luminance.
    Environment,
    /// The BRDF.
    Brdf,
    /// Half from each, an odd one from either at random, weighted by the balance heuristic.
    #[default]
    Mixture,
}

impl Candidates {
    /// The fixed numbers out of `m` from the environment and from the BRDF; one more may come from either.
    fn split(self, m: u32) -> (u32, u32) {
        match self {
            Self::Environment => (m, 0),
            Self::Brdf => (0, m),
            Self::Mixture => (m / 2, m / 2),
        }
    }
}

/// The method that picks N of the candidates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Resampling {
    /// One random number per pick. The picks are as well stratified as the numbers.
    Multinomial,
    /// N equally spaced picks from one random offset: candidate j is picked ⌊N Wⱼ/ΣW⌋ times or once
    /// more.
    Systematic,
    /// The same, with candidates sorted along a Hilbert curve over the hemisphere.
    #[default]
    SystematicSorted,
    /// N independent reservoirs over the stream of candidates (Chao 1982; Bitterli et al. 2020):
    /// nothing is stored, so memory does not grow with M.
    Reservoir,
}

/// N picks from M candidates at each point.
#[derive(Clone, Copy, Debug)]
pub struct SamplingImportanceResampling<'a> {
    /// The light.
    pub environment: &'a Environment,
    /// The number of candidates per point, at least 1.
    pub n_candidates: u32,
    /// The number of picks per point, at least 1; the maximum number of shadow rays.
    pub n_samples: u32,
    /// The density from which candidates are drawn.
    pub candidates: Candidates,
    /// The method that picks candidates.
    pub resampling: Resampling,
}

/// A direction that may become a shadow ray.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    wi: Vec3,
    /// Unshadowed contribution to the integral over M candidates.
    value: Rgb,
    /// Its luminance, positive.
    weight: f32,
    /// Its index among the candidates of the point.
    index: u32,
}

/// Scratch memory of [`SamplingImportanceResampling`].
#[derive(Clone, Debug, Default)]
pub struct SirScratch {
    samples: SampleScratch,
    picking: PickScratch,
}

/// The candidates of a point, and scratch memory to pick from them.
#[derive(Clone, Debug, Default)]
struct PickScratch {
    candidates: Vec<Candidate>,
    /// The position on the curve in the upper half, the index of the candidate in the lower half.
    order: Vec<u64>,
    /// The positions of picks as fractions of the total, in ascending order.
    ticks: Vec<f32>,
    reservoirs: WeightedReservoirs<Candidate>,
}

impl SamplingImportanceResampling<'_> {
    /// The samples that become candidates at one point.
    fn samples(&self, sample_index: SampleIndex) -> MultiSample<'_> {
        let mut samples = self.common_samples();
        if self.has_odd_candidate() {
            let is_of_light = self.odd_is_of_light(sample_index);
            let chosen = if is_of_light { &mut samples.n_light } else { &mut samples.n_brdf };
            chosen.n += 1;
        }
        samples
    }

    /// The samples that all points have: all but an odd candidate, for which both sources have a place.
    fn common_samples(&self) -> MultiSample<'_> {
        let (m, n) = self.candidates.split(self.n_candidates);
        let [mut n_light, mut n_brdf] = [Count::fixed(m), Count::fixed(n)];
        if self.has_odd_candidate() {
            for count in [&mut n_light, &mut n_brdf] {
                count.expected += 0.5;
                // All samples of the pixel share a sequence, so each reserves the same number of points.
                count.reserved += 1;
            }
        }
        let (environment, light) = (self.environment, self.environment.light_density());
        let n_portal = Count::fixed(0);
        MultiSample { environment, light, n_light, n_brdf, n_portal, heuristic: Heuristic::Balance }
    }

    fn has_odd_candidate(&self) -> bool {
        let (m, n) = self.candidates.split(self.n_candidates);
        m + n < self.n_candidates
    }

    /// Whether the odd candidate of a point comes from the light, by a number that no direction uses.
    fn odd_is_of_light(&self, sample_index: SampleIndex) -> bool {
        let (m, _) = self.candidates.split(self.n_candidates);
        sample_index.get(Dimension::Environment, m, m + 1).u_lobe() < 0.5
    }

    /// The samples of all points, with an odd candidate from both sources; `None` if those of one point fill the lanes.
    fn few_samples(&self) -> Option<MultiSample<'_>> {
        let mut samples = self.common_samples();
        if self.has_odd_candidate() {
            samples.n_light.n += 1;
            samples.n_brdf.n += 1;
        }
        (samples.n_light.n.max(samples.n_brdf.n) < MOST_LANES as u32).then_some(samples)
    }

    /// The number among [`few_samples`](Self::few_samples) that is none of a point's.
    fn left_out(&self, few: &MultiSample, sample_index: SampleIndex) -> Option<u32> {
        self.has_odd_candidate().then(|| {
            let (n_light, n_brdf) = (few.n_light.n, few.n_brdf.n);
            // The last of the other source.
            if self.odd_is_of_light(sample_index) { n_light + n_brdf - 1 } else { n_light - 1 }
        })
    }

    fn collector<'s>(
        &self,
        sample_index: SampleIndex,
        picking: &'s mut PickScratch,
    ) -> Collector<'s> {
        picking.candidates.clear();
        picking.reservoirs.clear();
        Collector {
            picking,
            generator: sample_index.generator(),
            n: self.n_samples as usize,
            streams: self.resampling == Resampling::Reservoir,
        }
    }

    fn fill_ticks(&self, sample_index: SampleIndex, ticks: &mut Vec<f32>) {
        let n = self.n_samples;
        let number = |j, n| sample_index.get(Dimension::Resampling, j, n).0[0];
        ticks.clear();
        if self.resampling == Resampling::Multinomial {
            ticks.extend((0..n).map(|j| number(j, n)));
            ticks.sort_unstable_by(f32::total_cmp);
        } else {
            let offset = number(0, 1);
            let tick = |j: u32| ((j as f32 + offset) / n as f32).min(ONE_MINUS_EPSILON);
            ticks.extend((0..n).map(tick));
        }
    }

    /// Picks from the stored candidates.
    fn pick_stored(
        &self,
        at: &ShadingPoint,
        sample_index: SampleIndex,
        picking: &mut PickScratch,
        mut push: impl FnMut(Vec3, Rgb),
    ) {
        let PickScratch { candidates, order, ticks, .. } = picking;
        let total = candidates.iter().map(|c| f64::from(c.weight)).sum();
        if !f64::is_finite(total) {
            // Pass overflow on to the film, which counts it.
            candidates.iter().take(1).for_each(|c| push(c.wi, c.value * f32::INFINITY));
            return;
        }
        self.fill_ticks(sample_index, ticks);
        if self.resampling == Resampling::SystematicSorted {
            order.clear();
            order.extend(
                (0u64..)
                    .zip(&*candidates)
                    .map(|(i, c)| u64::from(hemisphere_index(at.frame.to_local(c.wi))) << 32 | i),
            );
            order.sort_unstable();
            let sorted = order.iter().map(|&key| &candidates[key as u32 as usize]);
            pick(sorted, total, ticks, push);
        } else {
            pick(candidates.iter(), total, ticks, push);
        }
    }

    /// Picks from the candidates in the reservoirs.
    fn pick_streamed(&self, picking: &mut PickScratch, mut push: impl FnMut(Vec3, Rgb)) {
        let PickScratch { candidates: picked, reservoirs, .. } = picking;
        picked.clear();
        picked.extend(reservoirs.items());
        picked.sort_unstable_by_key(|c| c.index);
        for same in picked.chunk_by(|a, b| a.index == b.index) {
            let (wi, weight) =
                same[0].picked(same.len(), self.n_samples as usize, reservoirs.total());
            push(wi, weight);
        }
    }

    fn pick(
        &self,
        at: &ShadingPoint,
        sample_index: SampleIndex,
        picking: &mut PickScratch,
        push: impl FnMut(Vec3, Rgb),
    ) {
        match self.resampling {
            Resampling::Reservoir => self.pick_streamed(picking, push),
            Resampling::Multinomial | Resampling::Systematic | Resampling::SystematicSorted => {
                self.pick_stored(at, sample_index, picking, push);
            }
        }
    }

    /// [`PointStrategy::sample`] with an instruction set.
    fn sample_with(
        &self,
        instruction_set: InstructionSet,
        at: &ShadingPoint,
        sample_index: SampleIndex,
        scratch: &mut SirScratch,
        push: impl FnMut(Vec3, Rgb),
    ) {
        let SirScratch { samples, picking } = scratch;
        let mut collector = self.collector(sample_index, picking);
        let drawn = self.samples(sample_index);
        drawn.sample_each(instruction_set, at, sample_index, samples, |wi, value, index| {
            collector.add(wi, value, index);
        });
        self.pick(at, sample_index, picking, push);
    }
}

/// Collects the candidates of positive weight.
struct Collector<'a> {
    picking: &'a mut PickScratch,
    generator: Pcg32,
    n: usize,
    streams: bool,
}

impl Collector<'_> {
    fn add(&mut self, wi: Vec3, value: Rgb, index: u32) {
        let weight = value.luminance();
        if weight == 0.0 {
            return;
        }
        let candidate = Candidate { wi, value, weight, index };
        let PickScratch { candidates, reservoirs, .. } = &mut *self.picking;
        if self.streams {
            reservoirs.add(candidate, f64::from(weight), self.n, &mut self.generator);
        } else {
            candidates.push(candidate);
        }
    }
}

impl Candidate {
    /// The shadow ray of a candidate that has `count` of the `n` picks.
    fn picked(&self, count: usize, n: usize, total: f64) -> (Vec3, Rgb) {
        let share = total * count as f64 / n as f64;
        (self.wi, self.value * (share / f64::from(self.weight)) as f32)
    }
}

/// Picks for each tick t the candidate at t · `total` of the running sum of weights.
fn pick<'a>(
    candidates: impl Iterator<Item = &'a Candidate>,
    total: f64,
    ticks: &[f32],
    mut push: impl FnMut(Vec3, Rgb),
) {
    let n = ticks.len();
    let (mut sum, mut ticks) = (0.0, ticks);
    for c in candidates {
        sum += f64::from(c.weight);
        let count = ticks.iter().take_while(|&&t| f64::from(t) * total < sum).count();
        if count > 0 {
            let (wi, weight) = c.picked(count, n, total);
            push(wi, weight);
            ticks = &ticks[count..];
        }
    }
    // A tick is below 1 by more than the rounding error of double-precision sums.
    debug_assert!(ticks.is_empty() || total == 0.0);
}

impl PointStrategy for SamplingImportanceResampling<'_> {
    type Scratch = SirScratch;

    const UNBIASED: bool = true;

    fn unit(&self) -> f64 {
        self.environment.unit()
    }

    fn n_rays(&self) -> u32 {
        self.n_samples
    }

    fn sample(
        &self,
        at: &ShadingPoint,
        sample_index: SampleIndex,
        scratch: &mut SirScratch,
        push: impl FnMut(Vec3, Rgb),
    ) {
        self.sample_with(InstructionSet::best(), at, sample_index, scratch, push);
    }

    fn sample_tile(&self, tile: &TileShading, scratch: &mut SirScratch, out: &mut Contributions) {
        if let Some(few) = self.few_samples() {
            let SirScratch { samples, picking } = scratch;
            let portals = Portals::new(&[]);
            few.each_point(tile, portals, samples, |(i, at, sample_index), drawn| {
                let mut collector = self.collector(sample_index, picking);
                let left_out = self.left_out(&few, sample_index);
                let kept = (0..).zip(drawn.each()).filter(|(number, _)| Some(*number) != left_out);
                for (index, (_, (wi, value))) in (0..).zip(kept) {
                    collector.add(wi, value, index);
                }
                self.pick(at, sample_index, picking, |wi, weight| out.push(i, wi, weight));
            });
            return;
        }
        for (i, at, sample_index) in tile.each_point() {
            let push = |wi, weight| out.push(i, wi, weight);
            self.sample_with(tile.instruction_set, at, sample_index, scratch, push);
        }
    }
}

/// The cost of a shadow ray divided by that of a candidate. Measured with this library on scenes with a
/// hundred thousand triangles under a map of 1024 × 512 texels: 0.05 to 0.08 µs against 0.2 µs, most of it
/// for the look-up in the map and its table. Rays cost more in larger scenes.
pub const RAY_COST: f64 = 0.3;

/// Estimates of a pilot at each point.
const REPEATS: u32 = 16;

/// Measures SIR at a few points of a scene, to choose its number of candidates.
#[derive(Clone, Debug)]
pub struct CandidatePilot<'p, V> {
    visibility: V,
    seed: u64,
    /// Points that see light, with an approximation of the light they reflect.
    points: Vec<(&'p ShadingPoint, f64)>,
}

impl<'p, V: Fn(&ShadingPoint, Vec3) -> f32> CandidatePilot<'p, V> {
    /// Creates a pilot at 64 of the points, spread evenly over them. `visibility` returns V in [0, 1].
    ///
    /// The random numbers differ from those of a render with the same seed.
    pub fn new(
        environment: &'p Environment,
        points: &'p [ShadingPoint],
        visibility: V,
        seed: u64,
    ) -> Self {
        const N_POINTS: usize = 64;
        let chosen = points.iter().step_by(points.len().div_ceil(N_POINTS).max(1));
        let points: Vec<_> = chosen.map(|at| (at, 0.0)).collect();
        let mut pilot = Self { visibility, seed: hash2(seed, 0x0070_696c_6f74), points };
        let precise = SamplingImportanceResampling {
            environment,
            n_candidates: 256,
            n_samples: 16,
            candidates: Candidates::Mixture,
            resampling: Resampling::default(),
        };
        let mut references = vec![0.0; pilot.points.len()];
        pilot.estimate(&precise, |i, estimate| references[i] += estimate / f64::from(REPEATS));
        pilot.points.iter_mut().zip(references).for_each(|((_, old), new)| *old = new);
        pilot.points.retain(|&(_, reference)| reference > 0.0);
        pilot
    }

    /// Calls `each` with the index of a point and an estimate of the luminance that it reflects.
    fn estimate(&self, sir: &SamplingImportanceResampling, mut each: impl FnMut(usize, f64)) {
        let mut scratch = SirScratch::default();
        for (i, (at, _)) in self.points.iter().enumerate() {
            for repeat in 0..REPEATS {
                let stream = i as u64 * u64::from(REPEATS) + u64::from(repeat);
                let seed = hash2(self.seed, u64::from(sir.n_candidates));
                let sampler = Sampler::new(SamplerKind::Sobol, seed, stream);
                let mut estimate = 0.0;
                let add = |wi: Vec3, weight: Rgb| {
                    estimate += f64::from(weight.luminance() * (self.visibility)(at, wi));
                };
                sir.sample(at, SampleIndex { sampler, sample: 0 }, &mut scratch, add);
                each(i, estimate);
            }
        }
    }

    /// The squared error times the cost at each point that sees light: the mean squared relative error of an estimate,
    /// times M + [`RAY_COST`] N.
    pub fn work(&self, sir: &SamplingImportanceResampling) -> Vec<f64> {
        let cost = f64::from(sir.n_candidates) + RAY_COST * f64::from(sir.n_samples);
        let mut work = vec![0.0; self.points.len()];
        self.estimate(sir, |i, estimate| {
            work[i] +=
                functions::powi(estimate / self.points[i].1 - 1.0, 2) * cost / f64::from(REPEATS);
        });
        work
    }

    /// The number of candidates M, which is N or a power of two above it, with the least [`CandidatePilot::work`] for
    /// the picks of `sir`. The M of `sir` itself is ignored.
    ///
    /// The search doubles M until two doublings in a row bring no gain. A gain must exceed two standard errors over the
    /// points.
    pub fn optimal_number(&self, sir: &SamplingImportanceResampling) -> u32 {
        const MOST: u32 = 1 << 14;
        let work = |n_candidates| self.work(&SamplingImportanceResampling { n_candidates, ..*sir });
        let mut best = sir.n_samples.max(1);
        let mut least = work(best);
        let (mut m, mut n_lost) = (best, 0);
        while n_lost < 2 && m < MOST {
            m = (m + 1).next_power_of_two();
            let other = work(m);
            let differences = || least.iter().zip(&other).map(|(old, new)| old - new);
            let won: f64 = differences().sum();
            let deviation = differences().map(|d| d * d).sum::<f64>().sqrt();
            if won > 2.0 * deviation {
                (best, least, n_lost) = (m, other, 0);
            } else {
                n_lost += 1;
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn candidates_are_split_to_the_last() {
        for m in [1, 2, 3, 64] {
            for c in [Candidates::Environment, Candidates::Brdf, Candidates::Mixture] {
                let (from_light, from_brdf) = c.split(m);
                let for_certain = from_light + from_brdf;
                assert_eq!(for_certain, if c == Candidates::Mixture { m & !1 } else { m });
            }
        }
    }
}
