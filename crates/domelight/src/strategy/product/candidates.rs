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
use super::cells::{Cells, at, slot};
use super::control::Control;
use super::pool::{Lights, Pool};
use super::table::Table;
use crate::Rgb;
use crate::bsdf::{Brdf as _, Material};
use crate::environment::Environment;
use crate::math::Vec3;
use crate::sampling::{Dimension, Stream};
use crate::simd::{Colors, Floats, Ints, LANES, Lanes, Mask as _, Real, Simd, Vectors, set_bits};

/// A direction that may become a shadow ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    /// World direction.
    pub(super) wi: Vec3,
    /// W.
    pub(super) value: Rgb,
    /// Its luminance.
    pub(super) luminance: f32,
    /// The slot of the cell where its light is.
    pub(super) slot: u32,
    /// Which hit of the pixel.
    pub(super) hit: u32,
    /// π, as [`choose`](super::choose) has it.
    pub(super) chance: u32,
}

/// Candidates of one hit side by side.
#[derive(Clone, Copy, Debug)]
pub(super) struct CandidateBlock {
    pub(super) wi: [Lanes; 3],
    /// Black in a lane without a candidate.
    pub(super) value: [Lanes; 3],
    /// W without what the control variate knows of it.
    pub(super) rest: [Lanes; 3],
    pub(super) luminance: Lanes,
    pub(super) slots: [i32; LANES],
    /// π of each.
    pub(super) chances: [i32; LANES],
}

impl CandidateBlock {
    /// One of them, of hit `hit`.
    #[inline(always)]
    pub(super) fn get(&self, lane: usize, hit: u32) -> Candidate {
        Candidate {
            wi: Vec3::from(self.wi.map(|c| c[lane])),
            value: Rgb::from(self.value.map(|c| c[lane])),
            luminance: self.luminance[lane],
            slot: self.slots[lane] as u32,
            hit,
            chance: self.chances[lane] as u32,
        }
    }
}

/// The candidates of a pixel.
#[derive(Clone, Debug, Default)]
pub(super) struct Candidates {
    /// From the table: as many blocks for each hit.
    pub(super) lights: Vec<CandidateBlock>,
    /// From the material.
    pub(super) brdf: Vec<Candidate>,
    /// How the strata are dealt to the hits.
    pub(super) deal: Deal,
    /// The slot of each stratum, where its candidate is in `lights`.
    slots: Vec<[i32; LANES]>,
    /// Memory of [`Table::deal`].
    marks: Vec<i32>,
}

/// Stratum k belongs to hit (k − r) mod n: who has which.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Deal {
    /// M.
    n_strata: usize,
    /// n.
    pub(super) n_hits: usize,
    /// r.
    shift: usize,
}

impl Deal {
    /// Of M strata to n hits, shifted by a number in [0, 1).
    pub(super) fn new(n_strata: usize, n_hits: usize, shift: f32) -> Self {
        Self { n_strata, n_hits, shift: (shift * n_hits as f32) as usize % n_hits.max(1) }
    }

    /// Blocks of each hit.
    pub(super) fn blocks(self) -> usize {
        self.n_strata.div_ceil(self.n_hits.max(1)).div_ceil(LANES)
    }

    /// The first stratum of a hit; every n-th follows.
    #[inline(always)]
    fn first(self, hit: usize) -> usize {
        let k = hit + self.shift;
        if k < self.n_hits { k } else { k - self.n_hits }
    }

    /// The places of strata 0 to M − 1 in blocks of hits that follow each other.
    #[inline(always)]
    pub(super) fn places(self) -> impl Iterator<Item = Place> {
        let (n, stride) = (self.n_hits, self.blocks() * LANES);
        let start = if self.shift == 0 { 0 } else { n - self.shift };
        let mut next = Place { hit: start, lane: start * stride };
        let mut left = n;
        (0..self.n_strata).map(move |_| {
            let place = next;
            next.hit += 1;
            next.lane += stride;
            if next.hit == n {
                next = Place { hit: 0, lane: next.lane - n * stride };
            }
            left -= 1;
            if left == 0 {
                next.lane += 1;
                left = n;
            }
            place
        })
    }
}

/// Where a stratum's candidate is.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Place {
    pub(super) hit: usize,
    /// Counted through all blocks.
    pub(super) lane: usize,
}

/// Strata of a table that share one random offset.
#[derive(Clone, Copy, Debug)]
pub(super) struct Strata {
    /// M.
    pub(super) n: usize,
    /// ξ in [0, 1).
    pub(super) offset: f32,
    /// Their width in the running sum.
    pub(super) width: f32,
    /// What none may reach.
    total: f32,
}

impl Strata {
    /// `n` strata of a table of the given total.
    pub(super) fn new(n: usize, offset: f32, total: f32) -> Self {
        Self { n, offset, width: total / n as f32, total }
    }

    /// Where strata `first`, `first` + `step`, … fall in the running sum.
    #[inline(always)]
    pub(super) fn places<S: Simd>(&self, simd: S, first: usize, step: usize) -> S::Floats {
        let k = simd.counting().to_floats() * simd.splat(step as f32) + simd.splat(first as f32);
        let last = simd.splat(self.total * (1.0 - f32::EPSILON));
        ((k + simd.splat(self.offset)) * simd.splat(self.width)).min(last)
    }
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
    /// None if visibility is not known.
    pub(super) control: Option<&'a Control>,
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

    /// The hit of sample `j` of the material, of `n` hits.
    fn brdf_hit(&self, j: usize, n: usize) -> usize {
        (j + (self.shift[1] * n as f32) as usize) % n
    }
}

impl Sources<'_> {
    /// Draws all candidates. Some are black.
    #[inline(always)]
    pub(super) fn draw<S: Simd>(
        &self,
        simd: S,
        hits: Hits,
        diffuse: &[Rgb],
        counts: Counts,
        numbers: &PixelNumbers,
        candidates: &mut Candidates,
    ) {
        let total = self.table.total();
        let n_strata = if total > 0.0 { counts.light } else { 0 };
        let deal = Deal::new(n_strata, hits.points.len(), numbers.shift[0]);
        let strata = Strata::new(n_strata, numbers.strata, total);
        let scale = if n_strata > 0 { n_strata as f32 / total } else { 0.0 };
        candidates.deal = deal;
        candidates.lights.clear();
        if n_strata > 0 {
            let Candidates { slots, marks, .. } = &mut *candidates;
            self.table.deal(simd, &strata, deal, marks, slots);
        }
        for (hit, at) in hits.points.iter().enumerate() {
            let (material, diffuse) = (hits.material(hit), diffuse[hit]);
            let of_hit = OfHit { at, material, diffuse, scale, n_brdf: counts.brdf as f32 };
            for block in 0..deal.blocks() {
                let first = deal.first(hit) + block * LANES * deal.n_hits;
                let places = strata.places(simd, first, deal.n_hits);
                let n = n_strata.saturating_sub(first).div_ceil(deal.n_hits);
                let slots = simd.load_ints(&candidates.slots[hit * deal.blocks() + block]);
                candidates.lights.push(self.draw_lights(simd, &of_hit, slots, places, n));
            }
        }
        candidates.brdf.clear();
        for first in (0..counts.brdf).step_by(LANES) {
            let n = (counts.brdf - first).min(LANES);
            let drawn = Drawn::new(hits, numbers, first..first + n);
            self.weigh_drawn(simd, hits, &drawn, [scale, counts.brdf as f32], &mut candidates.brdf);
        }
    }

    /// The first `n` lanes of a block of strata that fall at `places`.
    #[inline(always)]
    fn draw_lights<S: Simd>(
        &self,
        simd: S,
        of_hit: &OfHit,
        slots: S::Ints,
        places: S::Floats,
        n: usize,
    ) -> CandidateBlock {
        let one = |x| simd.splat(x);
        let inside = self.table.inside(slots, places);
        let Lights { wi, le, density } = self.pool.at(simd, slots, inside);
        let (f, pdf) = of_hit.at.eval_lanes(of_hit.material, wi);
        let density = one(of_hit.scale) * self.table.widths(slots) * density;
        let weight = one(1.0) / (density + one(of_hit.n_brdf) * pdf);
        let there = simd.counting().to_floats().lt(one(n as f32));
        let weight = Real::select(there, weight, one(0.0));
        let value = f.zip(le, |f, le| f * le).scaled(weight);
        let rest = match self.control {
            Some(control) => {
                let cosine = wi.dot(of_hit.at.frame.z);
                let h = control.at(slots, wi, cosine, of_hit.diffuse);
                let weight = Real::select(there, one(1.0) / density, one(0.0));
                let known = h.zip(le, |h, le| h * le).scaled(weight);
                value.zip(known, |value, known| value - known)
            }
            None => value,
        };
        CandidateBlock {
            wi: wi.store(),
            value: value.store(),
            rest: rest.store(),
            luminance: value.luminance().store(),
            slots: slots.store(),
            chances: [0; LANES],
        }
    }

    /// Adds samples of the material, weighed with `counts`: M over the total of the table, and N.
    #[inline(always)]
    fn weigh_drawn<S: Simd>(
        &self,
        simd: S,
        hits: Hits,
        drawn: &Drawn,
        counts: [f32; 2],
        candidates: &mut Vec<Candidate>,
    ) {
        let wi = drawn.sample(simd, hits);
        let (f, pdf) = drawn.eval(simd, hits, wi);
        let wi = drawn.to_world(simd, wi);
        let zero = simd.splat(0.0);
        let above = zero.lt(wi.dot_each(Vectors::load(simd, &drawn.ng)));
        let possible = zero.lt(pdf) & pdf.le(simd.splat(f32::MAX)) & above;
        let [columns, rows] = self.environment.texels_at(wi);
        let (world, mut found) = (wi.store(), Found::default());
        for lane in set_bits(possible.bits() & ((1 << drawn.n) - 1)) {
            let wi = Vec3::from(world.map(|c| c[lane]));
            let texel = [columns[lane], rows[lane]].map(|i| i as usize);
            let Some(cell) = self.cells.at_texel(self.environment, texel, wi) else { continue };
            let le = self.environment.map().get(texel[0], texel[1]);
            found.push(lane, slot(cell), le, at(&self.cells.mass, slot(cell)));
        }
        let [r, g, b] = &found.le;
        let le = Colors([simd.load(r), simd.load(g), simd.load(b)]);
        let width = self.table.widths(simd.load_ints(&found.slots));
        let within = le.luminance() / simd.load(&found.mass);
        let density = simd.splat(counts[0]) * width * within + simd.splat(counts[1]) * pdf;
        let value = f.zip(le, |f, le| f * le).scaled(simd.splat(1.0) / density);
        let (value, luminance) = (value.store(), value.luminance().store());
        for lane in set_bits(found.lanes) {
            candidates.push(Candidate {
                wi: Vec3::from(world.map(|c| c[lane])),
                value: Rgb::from(value.map(|c| c[lane])),
                luminance: luminance[lane],
                slot: found.slots[lane] as u32,
                hit: drawn.hits[lane] as u32,
                chance: 0,
            });
        }
    }
}

/// The camera hits of a pixel.
#[derive(Clone, Copy)]
pub(super) struct Hits<'a> {
    pub(super) points: &'a [ShadingPoint],
    /// The material of the first is that of all.
    pub(super) one_material: bool,
}

impl<'a> Hits<'a> {
    /// The material that a hit is sampled by.
    fn material(self, hit: usize) -> &'a Material {
        &self.points[if self.one_material { 0 } else { hit }].material
    }
}

/// Samples of the material side by side: where they are drawn, and by which numbers.
#[derive(Default)]
struct Drawn {
    n: usize,
    hits: [usize; LANES],
    wo: [Lanes; 3],
    /// The axes of the shading frames by component.
    frame: [[Lanes; 3]; 3],
    ng: [Lanes; 3],
    u: [Lanes; 2],
    u_lobe: Lanes,
}

impl Drawn {
    /// Samples `which` of the pixel, no more than there are lanes.
    #[inline(always)]
    fn new(hits: Hits, numbers: &PixelNumbers, which: std::ops::Range<usize>) -> Self {
        let set = numbers.stream.set(Dimension::Brdf);
        let u = set.u(which.start as u32);
        let mut drawn = Self { n: which.len(), u, ..Self::default() };
        for (lane, j) in which.enumerate() {
            let hit = numbers.brdf_hit(j, hits.points.len());
            let at = &hits.points[hit];
            drawn.hits[lane] = hit;
            if hits.material(hit).has_choice() {
                drawn.u_lobe[lane] = set.numbers(j as u32).u_lobe();
            }
            let axes = [at.frame.x, at.frame.y, at.frame.z];
            for c in 0..3 {
                (drawn.wo[c][lane], drawn.ng[c][lane]) = (at.wo[c], at.ng[c]);
                for (lanes, axis) in drawn.frame.iter_mut().zip(axes) {
                    lanes[c][lane] = axis[c];
                }
            }
        }
        drawn
    }

    /// Their directions in the local frames.
    #[inline(always)]
    fn sample<S: Simd>(&self, simd: S, hits: Hits) -> Vectors<S::Floats> {
        if hits.one_material {
            let (wo, u_lobe) = (Vectors::load(simd, &self.wo), simd.load(&self.u_lobe));
            let u = [simd.load(&self.u[0]), simd.load(&self.u[1])];
            return hits.material(0).sample_lanes(wo, u_lobe, u);
        }
        let mut wi = [[0.0; LANES]; 3];
        for lane in 0..self.n {
            let (wo, u) = (Vec3::from(self.wo.map(|c| c[lane])), self.u.map(|u| u[lane]));
            let material = hits.material(self.hits[lane]);
            let of_lane = Vec3::from(material.sample_lanes(wo.into(), self.u_lobe[lane], u));
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
        wi: Vectors<S::Floats>,
    ) -> (Colors<S::Floats>, S::Floats) {
        if hits.one_material {
            return hits.material(0).eval_lanes(Vectors::load(simd, &self.wo), wi);
        }
        let (mut f, mut pdf, wi) = ([[0.0; LANES]; 3], [0.0; LANES], wi.store());
        for lane in 0..self.n {
            let [wo, wi] = [self.wo, wi].map(|v| Vec3::from(v.map(|c| c[lane])));
            let (value, density) = hits.material(self.hits[lane]).eval_pdf(wo, wi);
            (f[0][lane], f[1][lane], f[2][lane]) = (value.r, value.g, value.b);
            pdf[lane] = density;
        }
        (Colors([simd.load(&f[0]), simd.load(&f[1]), simd.load(&f[2])]), simd.load(&pdf))
    }

    #[inline(always)]
    fn to_world<S: Simd>(&self, simd: S, v: Vectors<S::Floats>) -> Vectors<S::Floats> {
        let [x, y, z] = &self.frame;
        let (x, y, z) = (Vectors::load(simd, x), Vectors::load(simd, y), Vectors::load(simd, z));
        x.times(v.x).plus(y.times(v.y)).plus(z.times(v.z))
    }
}

/// What samples of the material meet on the map.
struct Found {
    /// Bit i: there is light for lane i.
    lanes: u32,
    slots: [i32; LANES],
    le: [Lanes; 3],
    /// Of the cell.
    mass: Lanes,
}

impl Default for Found {
    fn default() -> Self {
        Self { lanes: 0, slots: [0; LANES], le: [[0.0; LANES]; 3], mass: [1.0; LANES] }
    }
}

impl Found {
    #[inline(always)]
    fn push(&mut self, lane: usize, slot: usize, le: Rgb, mass: f32) {
        self.lanes |= 1 << lane;
        self.slots[lane] = slot as i32;
        (self.le[0][lane], self.le[1][lane], self.le[2][lane]) = (le.r, le.g, le.b);
        self.mass[lane] = mass;
    }
}

/// A hit whose candidates are drawn.
struct OfHit<'a> {
    at: &'a ShadingPoint,
    material: &'a Material,
    /// What it reflects by the cosine.
    diffuse: Rgb,
    /// M over the total of the table.
    scale: f32,
    /// N.
    n_brdf: f32,
}
