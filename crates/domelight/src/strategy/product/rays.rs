//! The rays of a pixel: the traced candidates and their weights.
//!
//! Systematic sampling with unequal probabilities π and the estimator Σ W/π: Horvitz & Thompson 1952, "A
//! Generalization of Sampling Without Replacement from a Finite Universe".

use super::candidate::Candidate;
use super::candidates::Candidates;
use super::cells::{CellArray, get};
use super::strata::CandidateIndex;
use super::systematic::{SystematicSampler, probabilities, probability, weight};
use crate::Rgb;
use crate::simd::{Colors, LANES, Simd, SimdF32x8};
use crate::strategy::{Contributions, PixelPoints};

/// The output of a pixel's rays.
pub(super) struct Rays<'a> {
    pub(super) pixel: &'a PixelPoints,
    pub(super) out: &'a mut Contributions,
    /// The slot of each ray's cell.
    pub(super) targets: &'a mut Vec<u16>,
}

impl Rays<'_> {
    /// The mean over the pixel's hits becomes a sum over its points.
    fn scale(&self) -> f32 {
        self.pixel.points.len() as f32
    }

    /// The part of `hit` that needs no rays.
    #[inline(always)]
    pub(super) fn base(&mut self, hit: u32) -> &mut Rgb {
        &mut self.out.base[self.pixel.points.start + hit as usize]
    }

    #[inline(always)]
    fn push(&mut self, c: &Candidate, weight: Rgb) {
        let point = self.pixel.points.start as u32 + c.hit;
        self.out.wi.push(c.wi);
        self.out.weight.push(weight);
        self.out.point.push(point);
        self.targets.push(c.slot as u16);
    }

    /// Σ W V: traces every candidate.
    #[inline(always)]
    pub(super) fn push_all(&mut self, candidates: &Candidates) {
        let scale = self.scale();
        let n_blocks = candidates.assignment.blocks().max(1);
        for (i, block) in candidates.lights.iter().enumerate() {
            for lane in (0..LANES).filter(|&lane| block.luminance[lane] > 0.0) {
                let c = block.get(lane, (i / n_blocks) as u32);
                self.push(&c, c.value * scale);
            }
        }
        for c in candidates.others.iter().filter(|c| c.luminance > 0.0) {
            self.push(c, c.value * scale);
        }
    }

    /// Adds Σ W V̂ and sets the π of all candidates to W g times `importance`.
    #[inline(always)]
    pub(super) fn weigh_candidates<S: Simd>(
        &mut self,
        simd: S,
        candidates: &mut Candidates,
        (visible, std_dev): (&CellArray, &CellArray),
        importance: f32,
    ) {
        let scale = self.scale();
        let Candidates { lights, others, assignment, .. } = candidates;
        for (hit, blocks) in lights.chunks_mut(assignment.blocks().max(1)).enumerate() {
            let mut sums = [simd.splat(0.0); 3];
            for c in blocks {
                let slots = simd.load_i32(&c.slots);
                let visible = S::F32x8::gather(visible, slots);
                for (sum, residual) in sums.iter_mut().zip(&c.residual) {
                    *sum = *sum + simd.load(residual) * visible;
                }
                let std_dev = S::F32x8::gather(std_dev, slots);
                let size = simd.load(&c.luminance) * std_dev * simd.splat(importance);
                c.selection_probabilities = probabilities(simd, size);
            }
            *self.base(hit as u32) += Colors(sums).sum() * scale;
        }
        for c in others {
            let slot = c.slot as usize;
            *self.base(c.hit) += c.value * (scale * get(visible, slot));
            c.selection_probability = probability(c.luminance * get(std_dev, slot) * importance);
        }
    }

    /// Σ W (V − V̂)/π: traces the chosen candidates.
    #[inline(always)]
    pub(super) fn push_chosen(
        &mut self,
        candidates: &Candidates,
        visible: &CellArray,
        mut systematic_sampler: SystematicSampler,
        chosen: &mut Vec<CandidateIndex>,
    ) {
        let Candidates { lights, others, assignment, .. } = candidates;
        chosen.resize(lights.len() * LANES + 1, CandidateIndex::default());
        let mut n_chosen = 0;
        for index in assignment.indices() {
            // The next one overwrites this unless it is chosen.
            chosen[n_chosen] = index;
            let selection_probability =
                lights[index.lane / LANES].selection_probabilities[index.lane % LANES];
            n_chosen += usize::from(systematic_sampler.select(selection_probability as u32));
        }
        for &CandidateIndex { hit, lane } in &chosen[..n_chosen] {
            self.push_one(&lights[lane / LANES].get(lane % LANES, hit as u32), visible);
        }
        for c in others.iter().filter(|c| systematic_sampler.select(c.selection_probability)) {
            self.push_one(c, visible);
        }
    }

    /// W (V − V̂)/π of one candidate.
    #[inline(always)]
    fn push_one(&mut self, c: &Candidate, visible: &CellArray) {
        let value = c.value * (self.scale() * weight(c.selection_probability));
        *self.base(c.hit) += value * -get(visible, c.slot as usize);
        self.push(c, value);
    }
}
