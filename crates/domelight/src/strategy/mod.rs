//! Strategies: how shading points become shadow rays.
//!
//! Under a distant environment every ray that a strategy asks for is the same thing: a shadow ray
//! to infinity. So a strategy turns shading points into pairs (wi, weight), and the estimate of
//! ∫ f_r · cos θ · L · V dω at a point is
//!
//! ```text
//! base + Σ weight · V(wi)
//! ```
//!
//! 1/n, 1/pdf and combination weights are already in the weight; `base` is what a strategy knows
//! without rays. Visibility, ray counts, the unoccluded picture (every V = 1, the lecture's L_ns)
//! and the variance are then computed once, outside, and strategies compare at equal shadow rays
//! by construction. Nothing here traces a ray.

mod brdf;
mod environment;
mod estimator;
pub mod levels;
mod light_set;
mod mis;
mod prepared;
pub mod product;
mod rejection;
mod sir;
mod spec;

pub use brdf::BrdfSampling;
pub use environment::EnvironmentSampling;
pub use estimator::Estimator;
pub use light_set::LightSet;
pub use mis::{CompensationNeedsBrdf, LightTable, MultipleImportanceSampling};
pub use prepared::{PrepareError, PreparedStrategy};
pub use product::ProductSampling;
pub use rejection::{
    Proposal, RejectionError, RejectionSampling, RejectionScratch, RejectionStatistics,
    StoppingRule,
};
pub use sir::{
    CandidatePilot, Candidates, RAY_COST, Resampling, SamplingImportanceResampling, SirScratch,
};
pub use spec::{StrategyError, StrategyKind, StrategyOptions, StrategySpec};

use crate::Rgb;
use crate::bsdf::{Brdf, Bsdf};
use crate::math::{Frame, Vec2, Vec3};
use crate::sampling::sampler::SamplePoint;
use crate::sampling::{Dimension, Pcg32, Sampler};
use crate::simd::{Colors, SimdFloat, Vectors};

/// A point where a camera ray met an opaque surface.
#[derive(Clone, Copy, Debug)]
pub struct ShadingPoint {
    /// World position.
    pub position: Vec3,
    /// Geometric normal, toward the viewer's side.
    pub ng: Vec3,
    /// Shading frame; its z axis is the shading normal, toward the viewer's side.
    pub frame: Frame,
    /// Unit direction toward the viewer, in the shading frame.
    pub wo: Vec3,
    /// The BSDF, in the shading frame.
    pub bsdf: Bsdf,
}

impl ShadingPoint {
    /// Memory for a point.
    #[cfg(feature = "render")]
    pub(crate) const UNSET: Self = {
        let frame = Frame { x: Vec3::X, y: Vec3::Y, z: Vec3::Z };
        let (position, ng, wo) = (Vec3::ZERO, Vec3::Z, Vec3::Z);
        Self { position, ng, frame, wo, bsdf: Bsdf::BLACK }
    };

    /// f_r · max(0, cos θ_i) for the world direction `wi` \[sr⁻¹\].
    ///
    /// Black below the geometric surface as well: it is opaque, and no ray need be traced to know.
    pub fn eval(&self, wi: Vec3) -> Rgb {
        if self.ng.dot(wi) <= 0.0 {
            return Rgb::BLACK;
        }
        self.bsdf.eval(self.wo, self.frame.to_local(wi))
    }

    /// [`ShadingPoint::eval`] and the density of [`ShadingPoint::sample`] \[sr⁻¹\].
    pub fn eval_pdf(&self, wi: Vec3) -> (Rgb, f32) {
        if self.ng.dot(wi) <= 0.0 {
            return (Rgb::BLACK, 0.0);
        }
        self.bsdf.eval_pdf(self.wo, self.frame.to_local(wi))
    }

    /// [`ShadingPoint::eval_pdf`] of world directions side by side, of another BSDF.
    #[inline(always)]
    pub(crate) fn eval_lanes<F: SimdFloat>(&self, bsdf: &Bsdf, wi: Vectors<F>) -> (Colors<F>, F) {
        let Frame { x, y, z } = self.frame;
        let local = Vectors { x: wi.dot(x), y: wi.dot(y), z: wi.dot(z) };
        let (value, pdf) = bsdf.eval_lanes(Vectors::splat(wi.x, self.wo), local);
        let zero = pdf.splat(0.0);
        let above = zero.lt(wi.dot(self.ng));
        (value.map(|c| F::select(above, c, zero)), F::select(above, pdf, zero))
    }

    /// Draws a world direction from the BSDF; none is a sample of value zero.
    pub fn sample(&self, u_lobe: f32, u: Vec2) -> Option<DirectionSample> {
        let s = self.bsdf.sample(self.wo, u_lobe, u)?;
        let wi = self.frame.to_world(s.wi);
        (self.ng.dot(wi) > 0.0).then_some(DirectionSample { wi, value: s.value, pdf: s.pdf })
    }
}

/// A world direction drawn from the BSDF of a point.
#[derive(Clone, Copy, Debug)]
pub struct DirectionSample {
    /// Unit direction toward the light, in the world.
    pub wi: Vec3,
    /// f_r · cos θ_i \[sr⁻¹\].
    pub value: Rgb,
    /// Density \[sr⁻¹\].
    pub pdf: f32,
}

/// Addresses the uniform numbers of one camera sample: a sampler, and the index in it.
#[derive(Clone, Copy, Debug)]
pub struct SampleIndex {
    /// The pixel's sampler.
    pub sampler: Sampler,
    /// Index of the camera sample in its pixel.
    pub sample: u32,
}

impl SampleIndex {
    /// Numbers j of n for one purpose: those of all camera samples of a pixel form one sequence.
    pub fn get(&self, dimension: Dimension, j: u32, n: u32) -> SamplePoint {
        self.sampler.numbers(dimension, self.sample.wrapping_mul(n).wrapping_add(j))
    }

    /// Independent numbers without end.
    pub fn generator(&self) -> Pcg32 {
        self.sampler.generator(self.sample)
    }
}

/// What a strategy asks for: pairs (wi, weight) by point, and what it knows without rays.
#[derive(Clone, Debug, Default)]
pub struct Contributions {
    /// World directions of the shadow rays.
    pub wi: Vec<Vec3>,
    /// What each ray adds if it is free.
    pub weight: Vec<Rgb>,
    /// The shading point of each ray; rising.
    pub point: Vec<u32>,
    /// Added to each point without a ray; as many as there are points.
    pub base: Vec<Rgb>,
}

impl Contributions {
    /// Forgets the pairs, keeps the memory, and makes `base` black for `n_points`.
    pub fn reset(&mut self, n_points: usize) {
        self.wi.clear();
        self.weight.clear();
        self.point.clear();
        self.base.clear();
        self.base.resize(n_points, Rgb::BLACK);
    }

    /// The number of shadow rays.
    pub fn len(&self) -> usize {
        self.wi.len()
    }

    /// No shadow rays.
    pub fn is_empty(&self) -> bool {
        self.wi.is_empty()
    }

    /// Asks for a ray; a black weight needs none.
    pub fn push(&mut self, point: u32, wi: Vec3, weight: Rgb) {
        if !weight.is_black() {
            self.wi.push(wi);
            self.weight.push(weight);
            self.point.push(point);
        }
    }
}

/// A strategy that looks at one shading point at a time: the lecture's.
pub trait PointStrategy: Sync {
    /// Memory that is kept from point to point; it carries no state.
    type Scratch: Default;

    /// The expected value of the estimate is the integral.
    const UNBIASED: bool;

    /// Shadow rays asked for at each point at the most.
    fn n_rays(&self) -> u32;

    /// What weights are multiples of: [`Environment::unit`](crate::environment::Environment::unit) of a strategy whose weights are
    /// in proportion to [`Environment::le`](crate::environment::Environment::le).
    fn unit(&self) -> f64 {
        1.0
    }

    /// Calls `push(wi, weight)` for each shadow ray at the point.
    fn sample(
        &self,
        at: &ShadingPoint,
        sample_index: SampleIndex,
        scratch: &mut Self::Scratch,
        push: impl FnMut(Vec3, Rgb),
    );
}

/// The shading points of a tile, grouped by pixel.
#[derive(Clone, Copy, Debug)]
pub struct TileShading<'a> {
    /// All camera hits of the round.
    pub points: &'a [ShadingPoint],
    /// Index of each point's camera sample in its pixel.
    pub samples: &'a [u32],
    /// The pixels of the tile in row order, those of other rounds and those without a hit as well.
    pub pixels: &'a [PixelPoints],
    /// Pixels in a row of the tile.
    pub width: usize,
}

/// The points of one pixel.
#[derive(Clone, Debug)]
pub struct PixelPoints {
    /// Their range in [`TileShading::points`].
    pub points: std::ops::Range<usize>,
    /// Camera samples of the pixel in this round, hits and misses.
    pub n_samples: u32,
    /// The pixel's uniform numbers.
    pub sampler: Sampler,
    /// All show one material without textures: their BSDFs differ in no more than what
    /// [`Bsdf::for_view`] makes of them.
    pub one_material: bool,
}

impl PixelPoints {
    /// The points of a pixel, of any materials, with its camera samples in this round, hits and misses, and its
    /// uniform numbers.
    pub fn new(points: std::ops::Range<usize>, n_samples: u32, sampler: Sampler) -> Self {
        Self { points, n_samples, sampler, one_material: false }
    }

    /// A pixel of another round, which has no points.
    #[cfg(feature = "render")]
    pub(crate) const NONE: Self =
        Self { points: 0..0, n_samples: 0, sampler: Sampler::NONE, one_material: true };
}

/// A strategy that looks at a tile at a time, in rounds: all its pixels, or one of their [`levels`] after the other.
/// Every [`PointStrategy`] is one: it needs a single round and learns nothing.
pub trait Strategy: Sync {
    /// What all tiles of a pass share.
    type Pass: Sync;
    /// Memory that a thread keeps. It carries what is learned from round to round of a tile, and nothing
    /// from tile to tile: passes are independent, so a render may be interrupted between them.
    type Scratch: Default;

    /// Rounds of a tile: 1, or [`levels::N_LEVELS`].
    fn n_rounds(&self) -> u32 {
        1
    }

    /// The most shadow rays at a point, for sizing batches.
    fn n_rays(&self) -> u32;

    /// What weights and base are multiples of; see [`PointStrategy::unit`].
    fn unit(&self) -> f64 {
        1.0
    }

    /// Camera samples of each pixel that a pass should have, for strategies that place the rays of
    /// all of them together; `None` where it does not matter.
    fn samples_per_pass(&self) -> Option<u32> {
        None
    }

    /// Prepares a pass of `n_samples` camera samples per pixel, as a rule; `sampler` is its own, independent of those of
    /// pixels and other passes.
    fn begin_pass(&self, sampler: Sampler, n_samples: u32) -> Self::Pass;

    /// Asks for the shadow rays of a round; `out` comes reset. Pixels of other rounds have no points.
    fn push(
        &self,
        pass: &Self::Pass,
        tile: &TileShading,
        round: u32,
        scratch: &mut Self::Scratch,
        out: &mut Contributions,
    );

    /// Learns from the rays of a round, unless it was the last: `visibility` has V in [0, 1] of each pushed ray.
    fn learn(
        &self,
        _tile: &TileShading,
        _pushed: &Contributions,
        _visibility: &[f32],
        _scratch: &mut Self::Scratch,
    ) {
    }
}

impl<S: PointStrategy> Strategy for S {
    type Pass = ();
    type Scratch = S::Scratch;

    fn n_rays(&self) -> u32 {
        PointStrategy::n_rays(self)
    }

    fn unit(&self) -> f64 {
        PointStrategy::unit(self)
    }

    fn begin_pass(&self, _: Sampler, _: u32) {}

    fn push(
        &self,
        (): &(),
        tile: &TileShading,
        _round: u32,
        scratch: &mut S::Scratch,
        out: &mut Contributions,
    ) {
        for pixel in tile.pixels {
            for i in pixel.points.clone() {
                let sample_index = SampleIndex { sampler: pixel.sampler, sample: tile.samples[i] };
                let push = |wi, weight| out.push(i as u32, wi, weight);
                self.sample(&tile.points[i], sample_index, scratch, push);
            }
        }
    }
}
