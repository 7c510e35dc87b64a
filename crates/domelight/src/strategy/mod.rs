//! Strategies: how shading points become shadow rays.
//!
//! Under a distant environment, every ray that a strategy requests is a shadow ray to infinity. So a
//! strategy turns shading points into pairs (wi, weight), and the estimate of
//! ∫ f_r · cos θ · L · V dω at a point is
//!
//! ```text
//! base + Σ weight · V(wi)
//! ```
//!
//! The weight includes 1/n, 1/pdf and the combination weight. `base` is the part of the estimate that
//! a strategy knows without rays. Visibility, ray counts, the unoccluded picture (every V = 1, the
//! lecture's L_ns) and the variance are computed outside of strategies, so that strategies compare at
//! equal shadow rays by construction. Nothing here traces a ray.

mod brdf;
mod environment;
mod estimator;
pub mod levels;
mod light_set;
mod mis;
mod multi_sample;
mod point_lanes;
mod portal;
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
pub use multi_sample::SampleScratch;
pub use portal::{Portal, PortalError};
pub use prepared::{PrepareError, PreparedStrategy};
pub use product::ProductSampling;
pub use rejection::{
    Proposal, RejectionError, RejectionSampling, RejectionScratch, RejectionStatistics,
    StoppingRule,
};
pub use sir::{
    CandidatePilot, Candidates, RAY_COST, Resampling, SamplingImportanceResampling, SirScratch,
};
pub use spec::{
    ParameterValues, StrategyDeclaration, StrategyError, StrategyKind, StrategyParameter,
    StrategySpec,
};

pub use crate::simd::InstructionSet;

use crate::Rgb;
use crate::bsdf::{Brdf, Bsdf};
use crate::math::{Frame, Vec2, Vec3};
use crate::sampling::sampler::SamplePoint;
use crate::sampling::{Dimension, Pcg32, Sampler};
use crate::simd::{Colors, SimdFloat, Vectors};

/// A point where a camera ray hit an opaque surface.
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
    /// A placeholder to be overwritten.
    #[cfg(feature = "render")]
    pub(crate) const UNSET: Self = {
        let frame = Frame { x: Vec3::X, y: Vec3::Y, z: Vec3::Z };
        let (position, ng, wo) = (Vec3::ZERO, Vec3::Z, Vec3::Z);
        Self { position, ng, frame, wo, bsdf: Bsdf::BLACK }
    };

    /// f_r · max(0, cos θ_i) for the world direction `wi` \[sr⁻¹\].
    ///
    /// Black below the geometric surface too: it is opaque, so no ray needs to be traced.
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

    /// [`ShadingPoint::eval_pdf`] for several world directions at once, with another BSDF.
    #[inline(always)]
    pub(crate) fn eval_lanes<F: SimdFloat>(&self, bsdf: &Bsdf, wi: Vectors<F>) -> (Colors<F>, F) {
        let Frame { x, y, z } = self.frame;
        let local = Vectors { x: wi.dot(x), y: wi.dot(y), z: wi.dot(z) };
        let (value, pdf) = bsdf.eval_lanes(Vectors::splat(wi.x, self.wo), local);
        let zero = pdf.splat(0.0);
        let above = zero.lt(wi.dot(self.ng));
        (value.map(|c| F::select(above, c, zero)), F::select(above, pdf, zero))
    }

    /// Samples a world direction from the BSDF. `None` is a sample with value zero.
    pub fn sample(&self, u_lobe: f32, u: Vec2) -> Option<DirectionSample> {
        let s = self.bsdf.sample(self.wo, u_lobe, u)?;
        let wi = self.frame.to_world(s.wi);
        (self.ng.dot(wi) > 0.0).then_some(DirectionSample { wi, value: s.value, pdf: s.pdf })
    }
}

/// A world direction sampled from the BSDF of a point.
#[derive(Clone, Copy, Debug)]
pub struct DirectionSample {
    /// Unit direction toward the light, in the world.
    pub wi: Vec3,
    /// f_r · cos θ_i \[sr⁻¹\].
    pub value: Rgb,
    /// Density \[sr⁻¹\].
    pub pdf: f32,
}

/// Identifies the uniform random numbers of one camera sample: a sampler, and the index of the sample.
#[derive(Clone, Copy, Debug)]
pub struct SampleIndex {
    /// The pixel's sampler.
    pub sampler: Sampler,
    /// Index of the camera sample in its pixel.
    pub sample: u32,
}

impl SampleIndex {
    /// The j-th of n points for one purpose. The points of all camera samples of a pixel form one sequence.
    pub fn get(&self, dimension: Dimension, j: u32, n: u32) -> SamplePoint {
        self.sampler.numbers(dimension, self.sample.wrapping_mul(n).wrapping_add(j))
    }

    /// An endless supply of independent random numbers.
    pub fn generator(&self) -> Pcg32 {
        self.sampler.generator(self.sample)
    }
}

/// The output of a strategy: pairs (wi, weight) for each point, and the part known without rays.
#[derive(Clone, Debug, Default)]
pub struct Contributions {
    /// World directions of the shadow rays.
    pub wi: Vec<Vec3>,
    /// The contribution of each ray if it is unoccluded.
    pub weight: Vec<Rgb>,
    /// The index of the shading point of each ray, in ascending order.
    pub point: Vec<u32>,
    /// The part of each point's estimate that needs no ray, one per point.
    pub base: Vec<Rgb>,
}

impl Contributions {
    /// Clears the pairs but keeps their memory, and sets `base` to black for `n_points`.
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

    /// Whether there are no shadow rays.
    pub fn is_empty(&self) -> bool {
        self.wi.is_empty()
    }

    /// Requests a ray, unless its weight is black.
    pub fn push(&mut self, point: u32, wi: Vec3, weight: Rgb) {
        if !weight.is_black() {
            self.wi.push(wi);
            self.weight.push(weight);
            self.point.push(point);
        }
    }
}

/// A strategy that processes one shading point at a time, like those of the lecture.
pub trait PointStrategy: Sync {
    /// Scratch memory reused from point to point; it carries no state.
    type Scratch: Default;

    /// Whether the expected value of the estimate is the integral.
    const UNBIASED: bool;

    /// The maximum number of shadow rays per point.
    fn n_rays(&self) -> u32;

    /// The unit of the weights: [`Environment::unit`](crate::environment::Environment::unit) for a strategy whose
    /// weights are proportional to [`Environment::le`](crate::environment::Environment::le).
    fn unit(&self) -> f64 {
        1.0
    }

    /// Whether [`TileShading::portals`] matter; see [`Strategy::samples_portals`].
    fn samples_portals(&self) -> bool {
        false
    }

    /// Calls `push(wi, weight)` for each shadow ray at the point.
    fn sample(
        &self,
        at: &ShadingPoint,
        sample_index: SampleIndex,
        scratch: &mut Self::Scratch,
        push: impl FnMut(Vec3, Rgb),
    );

    /// Pushes the shadow rays of all points of a tile to `out`, point by point. The library's strategies compute
    /// several points side by side, with the same result.
    fn sample_tile(
        &self,
        tile: &TileShading,
        scratch: &mut Self::Scratch,
        out: &mut Contributions,
    ) {
        for (i, at, sample_index) in tile.each_point() {
            self.sample(at, sample_index, scratch, |wi, weight| out.push(i, wi, weight));
        }
    }
}

/// The shading points of a tile, grouped by pixel.
#[derive(Clone, Copy, Debug)]
pub struct TileShading<'a> {
    /// The camera hits of the round.
    pub points: &'a [ShadingPoint],
    /// The index of each point's camera sample within its pixel.
    pub samples: &'a [u32],
    /// The pixels of the tile in row order, including those of other rounds and those without a hit.
    pub pixels: &'a [PixelPoints],
    /// The number of pixels in a row of the tile.
    pub width: usize,
    /// Rectangles through which light enters the scene, in the coordinates of the points: hints, which may be wrong.
    pub portals: &'a [Portal],
    /// The mean luminance of the picture's surfaces, in multiples of the strategy's unit, if it is known: a hint about
    /// which errors are visible.
    pub brightness: Option<f32>,
    /// The instruction set of strategies that compute several points side by side. It changes no result.
    pub instruction_set: InstructionSet,
}

impl<'a> TileShading<'a> {
    /// A tile of a scene without portals, in a picture of unknown brightness.
    pub fn new(
        points: &'a [ShadingPoint],
        samples: &'a [u32],
        pixels: &'a [PixelPoints],
        width: usize,
    ) -> Self {
        let instruction_set = InstructionSet::best();
        Self { points, samples, pixels, width, portals: &[], brightness: None, instruction_set }
    }

    /// The points of all pixels in order, each with its index and its camera sample.
    #[inline]
    pub(crate) fn each_point(
        &self,
    ) -> impl Iterator<Item = (u32, &'a ShadingPoint, SampleIndex)> + use<'a> {
        let Self { points, samples, pixels, .. } = *self;
        pixels.iter().flat_map(move |pixel| {
            pixel.points.clone().map(move |i| {
                let sample_index = SampleIndex { sampler: pixel.sampler, sample: samples[i] };
                (i as u32, &points[i], sample_index)
            })
        })
    }
}

/// The points of one pixel.
#[derive(Clone, Debug)]
pub struct PixelPoints {
    /// Their range in [`TileShading::points`].
    pub points: std::ops::Range<usize>,
    /// The number of camera samples of the pixel in this round, hits and misses.
    pub n_samples: u32,
    /// The pixel's uniform random numbers.
    pub sampler: Sampler,
    /// Whether all points show one material without textures, so that their BSDFs differ only by
    /// [`Bsdf::for_view`].
    pub one_material: bool,
}

impl PixelPoints {
    /// Creates a pixel from its points, which may have any materials, the number of its camera samples in this round
    /// (hits and misses), and its uniform random numbers.
    pub fn new(points: std::ops::Range<usize>, n_samples: u32, sampler: Sampler) -> Self {
        Self { points, n_samples, sampler, one_material: false }
    }

    /// Creates a pixel of another round, which has no points.
    #[cfg(feature = "render")]
    pub(crate) const NONE: Self =
        Self { points: 0..0, n_samples: 0, sampler: Sampler::NONE, one_material: true };
}

/// A strategy that processes one tile at a time, in rounds: all its pixels at once, or one of their [`levels`] after
/// the other. Every [`PointStrategy`] is a `Strategy` with a single round that learns nothing.
pub trait Strategy: Sync {
    /// Data shared by all tiles of a pass.
    type Pass: Sync;
    /// Scratch memory of a thread. It carries what is learned from round to round of a tile, but nothing
    /// from tile to tile. Passes are independent, so a render may be interrupted between them.
    type Scratch: Default;
    /// What a window of scouts has taught; `()` for a strategy that learns nothing.
    type Findings: Send;

    /// The number of rounds per tile: 1, or [`levels::N_LEVELS`].
    fn n_rounds(&self) -> u32 {
        1
    }

    /// The maximum number of shadow rays per point, for sizing batches.
    fn n_rays(&self) -> u32;

    /// Whether the expected value of the estimate is the integral; a strategy that is not needs to say so.
    fn is_unbiased(&self) -> bool {
        true
    }

    /// The unit of weights and base; see [`PointStrategy::unit`].
    fn unit(&self) -> f64 {
        1.0
    }

    /// Whether [`TileShading::portals`] matter. If not, a render looks for none.
    fn samples_portals(&self) -> bool {
        false
    }

    /// The number of camera samples per pixel that a pass should have, for strategies that place the rays of
    /// all of them together; `None` if it does not matter.
    fn samples_per_pass(&self) -> Option<u32> {
        None
    }

    /// Prepares a pass of about `n_samples` camera samples per pixel. `sampler` is independent of the samplers of
    /// pixels and other passes.
    fn begin_pass(&self, sampler: Sampler, n_samples: u32) -> Self::Pass;

    /// Pushes the shadow rays of a round to `out`, which is reset. Pixels of other rounds have no points.
    fn push(
        &self,
        pass: &Self::Pass,
        tile: &TileShading,
        round: u32,
        scratch: &mut Self::Scratch,
        out: &mut Contributions,
    );

    /// Learns from the rays of a round; after the last round, only in windows of scouts. `visibility` has the V in [0, 1] of
    /// each pushed ray.
    fn learn(
        &self,
        _tile: &TileShading,
        _pushed: &Contributions,
        _visibility: &[f32],
        _scratch: &mut Self::Scratch,
    ) {
    }

    /// What the last tile has taught, which was a window of scouts: pixels that are rendered before the picture, with a
    /// pass and random numbers of their own.
    fn findings(&self, scratch: &Self::Scratch) -> Self::Findings;

    /// Tells a pass what scouts have found. The windows are spread over the picture.
    fn brief(&self, _pass: &mut Self::Pass, _findings: Vec<Self::Findings>) {}
}

impl<S: PointStrategy> Strategy for S {
    type Pass = ();
    type Scratch = S::Scratch;
    type Findings = ();

    fn n_rays(&self) -> u32 {
        PointStrategy::n_rays(self)
    }

    fn is_unbiased(&self) -> bool {
        S::UNBIASED
    }

    fn unit(&self) -> f64 {
        PointStrategy::unit(self)
    }

    fn samples_portals(&self) -> bool {
        PointStrategy::samples_portals(self)
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
        self.sample_tile(tile, scratch, out);
    }

    fn findings(&self, _: &S::Scratch) {}
}
