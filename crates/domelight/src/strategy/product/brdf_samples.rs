//! BRDF sample candidates, for several hits side by side.

use super::candidate::Candidate;
use super::cells::Cells;
use super::hits::Hits;
use super::portal_light::portal_slot;
use super::strata::PixelSamples;
use super::table::Table;
use crate::Rgb;
use crate::bsdf::Brdf as _;
use crate::environment::Environment;
use crate::math::Vec3;
use crate::sampling::Dimension;
use crate::simd::{
    Colors, LANES, LaneMask as _, Lanes, Simd, SimdF32x8 as _, SimdFloat, Vectors, lane_of,
    set_bits,
};
use crate::strategy::portal::Portals;

/// The shading frames and random numbers of BRDF samples, one per lane.
#[derive(Default)]
pub(super) struct BrdfSamples {
    n: usize,
    hits: [usize; LANES],
    position: [Lanes; 3],
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
        let mut samples = Self::at_hits(hits, numbers, which.clone());
        samples.u = set.u(which.start as u32);
        for (lane, j) in which.enumerate() {
            if hits.bsdf(samples.hits[lane]).has_choice() {
                samples.u_lobe[lane] = set.numbers(j as u32).u_lobe();
            }
        }
        samples
    }

    /// The frames of the hits of the samples `which`.
    #[inline(always)]
    fn at_hits(hits: Hits, numbers: &PixelSamples, which: std::ops::Range<usize>) -> Self {
        let mut samples = Self { n: which.len(), ..Self::default() };
        for (lane, j) in which.enumerate() {
            let hit = numbers.hit_of_sample(j, hits.points.len());
            let at = &hits.points[hit];
            samples.hits[lane] = hit;
            let axes = [at.frame.x, at.frame.y, at.frame.z];
            for c in 0..3 {
                samples.position[c][lane] = at.position[c];
                (samples.wo[c][lane], samples.ng[c][lane]) = (at.wo[c], at.ng[c]);
                for (lanes, axis) in samples.frame.iter_mut().zip(axes) {
                    lanes[c][lane] = axis[c];
                }
            }
        }
        samples
    }

    /// The directions to random points on portals, in world space, and the slot of each portal.
    #[inline(always)]
    fn toward_portals(
        &self,
        portals: Portals,
        numbers: &PixelSamples,
        first: usize,
    ) -> ([Lanes; 3], [i32; LANES]) {
        let set = numbers.sampler.set(Dimension::Portal);
        let (mut wi, mut slots) = ([[0.0; LANES]; 3], [0; LANES]);
        for lane in 0..self.n {
            let numbers = set.numbers((first + lane) as u32);
            let Some((portal, point)) = portals.sample(numbers.u_lobe(), numbers.u()) else {
                continue;
            };
            let toward = (point - Vec3::from(lane_of(&self.position, lane))).normalize_or_zero();
            (0..3).for_each(|c| wi[c][lane] = toward[c]);
            slots[lane] = portal_slot(portal) as i32;
        }
        (wi, slots)
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

    /// The density of portal samples in the directions `wi`, times their number.
    #[inline(always)]
    fn portal_density<S: Simd>(
        &self,
        simd: S,
        (portals, n): (Portals, usize),
        wi: Vectors<S::F32x8>,
    ) -> S::F32x8 {
        if n == 0 {
            return simd.splat(0.0);
        }
        simd.splat(n as f32) * portals.pdf(Vectors::load(simd, &self.position), wi)
    }

    #[inline(always)]
    fn to_local<S: Simd>(&self, simd: S, v: Vectors<S::F32x8>) -> Vectors<S::F32x8> {
        let [x, y, z] = &self.frame;
        let (x, y, z) = (Vectors::load(simd, x), Vectors::load(simd, y), Vectors::load(simd, z));
        Vectors { x: v.dot_each(x), y: v.dot_each(y), z: v.dot_each(z) }
    }

    #[inline(always)]
    fn to_world<S: Simd>(&self, simd: S, v: Vectors<S::F32x8>) -> Vectors<S::F32x8> {
        let [x, y, z] = &self.frame;
        let (x, y, z) = (Vectors::load(simd, x), Vectors::load(simd, y), Vectors::load(simd, z));
        x.times(v.x).plus(y.times(v.y)).plus(z.times(v.z))
    }
}

/// Directions of BRDF samples, or to points on portals, and the texels that they look up.
#[derive(Clone, Debug)]
pub(super) struct BrdfSampleBatch {
    /// Bit i: lane i may see light.
    possible: u32,
    hits: [usize; LANES],
    /// The directions in world space.
    wi: [Lanes; 3],
    f: [Lanes; 3],
    /// The density of BRDF samples.
    pdf: Lanes,
    /// The density of portal samples, times their number Q.
    portal_density: Lanes,
    /// The slots of the portals; `None` for BRDF samples.
    portal_slots: Option<[i32; LANES]>,
    /// The columns and rows of the map.
    texels: [[i32; LANES]; 2],
}

/// Drawn directions side by side.
struct Directions<F: SimdFloat> {
    wi: Vectors<F>,
    f: Colors<F>,
    pdf: F,
    portal_density: F,
    is_drawn: F::Mask,
}

/// The strata of a table, against which BRDF samples are weighted.
#[derive(Clone, Copy)]
pub(super) struct BesideStrata<'a> {
    pub(super) environment: &'a Environment,
    pub(super) cells: &'a Cells,
    pub(super) table: &'a Table,
    /// The number of strata M divided by the total of the table without visibility.
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
        portals: (Portals, usize),
        drawn: &mut Vec<Self>,
    ) {
        for first in (0..n).step_by(LANES) {
            let samples = BrdfSamples::new(hits, numbers, first..n.min(first + LANES));
            let wi = samples.sample(simd, hits);
            let (f, pdf) = samples.eval(simd, hits, wi);
            let wi = samples.to_world(simd, wi);
            let zero = simd.splat(0.0);
            let is_drawn = zero.lt(pdf) & pdf.le(simd.splat(f32::MAX));
            let portal_density = samples.portal_density(simd, portals, wi);
            let directions = Directions { wi, f, pdf, portal_density, is_drawn };
            drawn.push(Self::look_up(simd, environment, &samples, directions));
        }
    }

    /// Draws samples of portals in the same way.
    #[inline(always)]
    pub(super) fn draw_portals<S: Simd>(
        simd: S,
        environment: &Environment,
        hits: Hits,
        numbers: &PixelSamples,
        portals: (Portals, usize),
        drawn: &mut Vec<Self>,
    ) {
        let n = portals.1;
        for first in (0..n).step_by(LANES) {
            let samples = BrdfSamples::at_hits(hits, numbers, first..n.min(first + LANES));
            let (wi, slots) = samples.toward_portals(portals.0, numbers, first);
            let wi = Vectors::load(simd, &wi);
            let (f, pdf) = samples.eval(simd, hits, samples.to_local(simd, wi));
            let portal_density = samples.portal_density(simd, portals, wi);
            let most = simd.splat(f32::MAX);
            let is_drawn = simd.splat(0.0).lt(portal_density) & portal_density.le(most);
            let is_drawn = is_drawn & pdf.le(most);
            let directions = Directions { wi, f, pdf, portal_density, is_drawn };
            let batch = Self::look_up(simd, environment, &samples, directions);
            drawn.push(Self { portal_slots: Some(slots), ..batch });
        }
    }

    /// Prefetches the texels.
    #[inline(always)]
    fn look_up<S: Simd>(
        simd: S,
        environment: &Environment,
        samples: &BrdfSamples,
        Directions { wi, f, pdf, portal_density, is_drawn }: Directions<S::F32x8>,
    ) -> Self {
        let map = environment.map();
        let above = simd.splat(0.0).lt(wi.dot_each(Vectors::load(simd, &samples.ng)));
        let possible = (is_drawn & above).bits() & ((1 << samples.n) - 1);
        let texels = environment.texels_at(wi);
        for lane in set_bits(possible) {
            let [column, row] = [texels[0][lane], texels[1][lane]].map(|i| i as usize);
            simd.prefetch(&map.row(row)[column]);
        }
        Self {
            possible,
            hits: samples.hits,
            wi: wi.store(),
            f: f.store(),
            pdf: pdf.store(),
            portal_density: portal_density.store(),
            portal_slots: None,
            texels,
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
        // Strata cannot reach cells that vanish in the running sum.
        let zero = simd.splat(0.0);
        let reached = zero.lt(table.widths::<S::F32x8>(slots));
        let product = SimdFloat::select(reached, table.products::<S::F32x8>(slots), zero);
        let density = simd.splat(strata) * product * within
            + simd.splat(n_brdf) * simd.load(&self.pdf)
            + simd.load(&self.portal_density);
        let value = f.zip(le, |f, le| f * le).scaled(simd.splat(1.0) / density);
        let (value, luminance) = (value.store(), value.luminance().store());
        for lane in set_bits(found.lanes) {
            candidates.push(Candidate {
                wi: at(lane),
                value: Rgb::from(lane_of(&value, lane)),
                luminance: luminance[lane],
                slot: self.portal_slots.map_or(found.slots[lane], |slots| slots[lane]) as u32,
                hit: self.hits[lane] as u32,
                selection_probability: 0,
            });
        }
    }
}
