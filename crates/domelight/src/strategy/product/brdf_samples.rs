//! BRDF sample candidates, for several hits side by side.

use super::candidate::Candidate;
use super::cells::Cells;
use super::hits::Hits;
use super::strata::PixelSamples;
use super::table::Table;
use crate::Rgb;
use crate::bsdf::Brdf as _;
use crate::environment::Environment;
use crate::math::Vec3;
use crate::sampling::Dimension;
use crate::simd::{
    Colors, LANES, LaneMask as _, Lanes, Simd, SimdF32x8 as _, SimdFloat as _, Vectors, lane_of,
    set_bits,
};

/// The shading frames and random numbers of BRDF samples, one per lane.
#[derive(Default)]
pub(super) struct BrdfSamples {
    n: usize,
    hits: [usize; LANES],
    wo: [Lanes; 3],
    /// The axes of the shading frames by component.
    frame: [[Lanes; 3]; 3],
    ng: [Lanes; 3],
    u: [Lanes; 2],
    u_lobe: Lanes,
}

impl BrdfSamples {
    /// The samples `which` of the pixel, at most one per lane.
    #[inline(always)]
    pub(super) fn new(hits: Hits, numbers: &PixelSamples, which: std::ops::Range<usize>) -> Self {
        let set = numbers.sampler.set(Dimension::Brdf);
        let u = set.u(which.start as u32);
        let mut samples = Self { n: which.len(), u, ..Self::default() };
        for (lane, j) in which.enumerate() {
            let hit = numbers.brdf_hit(j, hits.points.len());
            let at = &hits.points[hit];
            samples.hits[lane] = hit;
            if hits.bsdf(hit).has_choice() {
                samples.u_lobe[lane] = set.numbers(j as u32).u_lobe();
            }
            let axes = [at.frame.x, at.frame.y, at.frame.z];
            for c in 0..3 {
                (samples.wo[c][lane], samples.ng[c][lane]) = (at.wo[c], at.ng[c]);
                for (lanes, axis) in samples.frame.iter_mut().zip(axes) {
                    lanes[c][lane] = axis[c];
                }
            }
        }
        samples
    }

    /// The directions in the local frames.
    #[inline(always)]
    fn sample<S: Simd>(&self, simd: S, hits: Hits) -> Vectors<S::F32x8> {
        if hits.one_material {
            let (wo, u_lobe) = (Vectors::load(simd, &self.wo), simd.load(&self.u_lobe));
            let u = [simd.load(&self.u[0]), simd.load(&self.u[1])];
            return hits.bsdf(0).sample_lanes(wo, u_lobe, u);
        }
        let mut wi = [[0.0; LANES]; 3];
        for lane in 0..self.n {
            let (wo, u) = (Vec3::from(lane_of(&self.wo, lane)), lane_of(&self.u, lane));
            let bsdf = hits.bsdf(self.hits[lane]);
            let of_lane = Vec3::from(bsdf.sample_lanes(wo.into(), self.u_lobe[lane], u));
            (0..3).for_each(|c| wi[c][lane] = of_lane[c]);
        }
        Vectors::load(simd, &wi)
    }

    /// The values and densities of directions in the local frames.
    #[inline(always)]
    fn eval<S: Simd>(
        &self,
        simd: S,
        hits: Hits,
        wi: Vectors<S::F32x8>,
    ) -> (Colors<S::F32x8>, S::F32x8) {
        if hits.one_material {
            return hits.bsdf(0).eval_lanes(Vectors::load(simd, &self.wo), wi);
        }
        let (mut f, mut pdf, wi) = ([[0.0; LANES]; 3], [0.0; LANES], wi.store());
        for lane in 0..self.n {
            let [wo, wi] = [&self.wo, &wi].map(|v| Vec3::from(lane_of(v, lane)));
            let (value, density) = hits.bsdf(self.hits[lane]).eval_pdf(wo, wi);
            (f[0][lane], f[1][lane], f[2][lane]) = (value.r, value.g, value.b);
            pdf[lane] = density;
        }
        (Colors::load(simd, &f), simd.load(&pdf))
    }

    #[inline(always)]
    fn to_world<S: Simd>(&self, simd: S, v: Vectors<S::F32x8>) -> Vectors<S::F32x8> {
        let [x, y, z] = &self.frame;
        let (x, y, z) = (Vectors::load(simd, x), Vectors::load(simd, y), Vectors::load(simd, z));
        x.times(v.x).plus(y.times(v.y)).plus(z.times(v.z))
    }
}

/// Directions of BRDF samples and the texels that they look up.
#[derive(Clone, Debug)]
pub(super) struct BrdfSampleBatch {
    /// Bit i: lane i may see light.
    possible: u32,
    hits: [usize; LANES],
    /// The directions in world space.
    wi: [Lanes; 3],
    f: [Lanes; 3],
    pdf: Lanes,
    /// The columns and rows of the map.
    texels: [[i32; LANES]; 2],
}

/// The strata of a table, against which BRDF samples are weighted.
#[derive(Clone, Copy)]
pub(super) struct BesideStrata<'a> {
    pub(super) environment: &'a Environment,
    pub(super) cells: &'a Cells,
    pub(super) table: &'a Table,
    /// The number of strata M divided by the total of the table.
    pub(super) strata: f32,
    /// The number of BRDF samples N.
    pub(super) n_brdf: f32,
}

/// The radiance of BRDF samples, looked up in the map.
#[derive(Default)]
struct LightLookup {
    /// Bit i: there is light for lane i.
    lanes: u32,
    slots: [i32; LANES],
    le: [Lanes; 3],
}

impl LightLookup {
    #[inline(always)]
    fn push(&mut self, lane: usize, slot: usize, le: Rgb) {
        self.lanes |= 1 << lane;
        self.slots[lane] = slot as i32;
        (self.le[0][lane], self.le[1][lane], self.le[2][lane]) = (le.r, le.g, le.b);
    }
}

impl BrdfSampleBatch {
    /// Draws `n` BRDF samples, and prefetches their texels, which are far from each other and rarely in a near cache.
    #[inline(always)]
    pub(super) fn draw<S: Simd>(
        simd: S,
        environment: &Environment,
        hits: Hits,
        numbers: &PixelSamples,
        n: usize,
        drawn: &mut Vec<Self>,
    ) {
        drawn.clear();
        let map = environment.map();
        for first in (0..n).step_by(LANES) {
            let samples = BrdfSamples::new(hits, numbers, first..n.min(first + LANES));
            let wi = samples.sample(simd, hits);
            let (f, pdf) = samples.eval(simd, hits, wi);
            let wi = samples.to_world(simd, wi);
            let zero = simd.splat(0.0);
            let above = zero.lt(wi.dot_each(Vectors::load(simd, &samples.ng)));
            let possible = zero.lt(pdf) & pdf.le(simd.splat(f32::MAX)) & above;
            let possible = possible.bits() & ((1 << samples.n) - 1);
            let texels = environment.texels_at(wi);
            for lane in set_bits(possible) {
                let [column, row] = [texels[0][lane], texels[1][lane]].map(|i| i as usize);
                simd.prefetch(&map.row(row)[column]);
            }
            let (wi, f, pdf) = (wi.store(), f.store(), pdf.store());
            drawn.push(Self { possible, hits: samples.hits, wi, f, pdf, texels });
        }
    }

    /// Adds the samples as candidates, weighted against the strata of the table by the balance heuristic.
    #[inline(always)]
    pub(super) fn weigh<S: Simd>(
        &self,
        simd: S,
        beside: &BesideStrata,
        candidates: &mut Vec<Candidate>,
    ) {
        let BesideStrata { environment, cells, table, strata, n_brdf } = *beside;
        let mut found = LightLookup::default();
        let at = |lane: usize| Vec3::from(lane_of(&self.wi, lane));
        for lane in set_bits(self.possible) {
            let texel = self.texels.each_ref().map(|i| i[lane] as usize);
            let Some(cell) = cells.at_texel(environment, texel, at(lane)) else {
                continue;
            };
            let le = environment.map().get(texel[0], texel[1]);
            found.push(lane, cells.slot(cell), le);
        }
        let (le, f) = (Colors::load(simd, &found.le), Colors::load(simd, &self.f));
        let slots = simd.load_i32(&found.slots);
        let within = le.luminance() / S::F32x8::gather(&cells.mass, slots);
        let density = simd.splat(strata) * table.widths(slots) * within
            + simd.splat(n_brdf) * simd.load(&self.pdf);
        let value = f.zip(le, |f, le| f * le).scaled(simd.splat(1.0) / density);
        let (value, luminance) = (value.store(), value.luminance().store());
        for lane in set_bits(found.lanes) {
            candidates.push(Candidate {
                wi: at(lane),
                value: Rgb::from(lane_of(&value, lane)),
                luminance: luminance[lane],
                slot: found.slots[lane] as u32,
                hit: self.hits[lane] as u32,
                selection_probability: 0,
            });
        }
    }
}
