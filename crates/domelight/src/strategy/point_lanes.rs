//! Shading points side by side, so that a strategy is written once for one point and for sixteen.

use super::portal::Portals;
use super::{SampleIndex, ShadingPoint};
use crate::Rgb;
use crate::bsdf::{Brdf as _, Bsdf, LobeChoice};
use crate::math::{Frame, Vec3};
use crate::sampling::{Dimension, SampleSequence};
use crate::simd::{Colors, SimdFloat, Vectors};

/// The maximum number of points side by side. Sixteen walks through a table wait for memory at the same time.
pub(super) const MOST_LANES: usize = 16;

/// Shading points, one per lane.
pub(super) struct PointLanes<'a, F: SimdFloat> {
    points: &'a [&'a ShadingPoint],
    /// Directions toward the viewer, in the shading frames.
    pub(super) wo: Vectors<F>,
    /// The axes of the shading frames.
    frame: [Vectors<F>; 3],
    /// Geometric normals.
    pub(super) ng: Vectors<F>,
    bsdfs: Bsdfs<'a, F>,
    /// Whether samples of the BSDFs use `u_lobe`.
    has_choice: bool,
}

/// The BSDFs of points side by side.
enum Bsdfs<'a, F: SimdFloat> {
    /// One material, seen from each point.
    Same(&'a Bsdf, LobeChoice<F>),
    /// One for each of so many lanes.
    Different([&'a Bsdf; MOST_LANES], usize),
}

impl<'a, F: SimdFloat> PointLanes<'a, F> {
    /// The points, at most as many as lanes; the last one stands in for missing ones.
    #[inline(always)]
    pub(super) fn load(like: F, points: &'a [&'a ShadingPoint]) -> Self {
        let last = points.len() - 1;
        let bsdf = |lane: usize| &points[lane.min(last)].bsdf;
        let [ox, oy, oz, gx, gy, gz] = like.by_lane(|lane| {
            let ShadingPoint { wo, ng, .. } = points[lane.min(last)];
            [wo.x, wo.y, wo.z, ng.x, ng.y, ng.z]
        });
        let axis = |axis: fn(&Frame) -> Vec3| {
            let [x, y, z] = like.by_lane(|lane| axis(&points[lane.min(last)].frame).to_array());
            Vectors { x, y, z }
        };
        let first = bsdf(0);
        let bsdfs = if points.iter().all(|at| first.is_same_material(&at.bsdf)) {
            Bsdfs::Same(first, Bsdf::choices(like, bsdf))
        } else {
            Bsdfs::Different(std::array::from_fn(bsdf), points.len())
        };
        Self {
            points,
            wo: Vectors { x: ox, y: oy, z: oz },
            frame: [axis(|frame| frame.x), axis(|frame| frame.y), axis(|frame| frame.z)],
            ng: Vectors { x: gx, y: gy, z: gz },
            bsdfs,
            has_choice: points.iter().any(|at| at.bsdf.has_choice()),
        }
    }

    /// The world positions.
    #[inline(always)]
    pub(super) fn positions(&self) -> Vectors<F> {
        let last = self.points.len() - 1;
        let [x, y, z] = self.wo.x.by_lane(|lane| self.points[lane.min(last)].position.to_array());
        Vectors { x, y, z }
    }

    /// World directions toward points on portals, with number `j` of `n` of each camera sample.
    #[inline(always)]
    pub(super) fn toward_portals(
        &self,
        portals: Portals,
        numbers: SampleLanes,
        j: u32,
        n: u32,
    ) -> Vectors<F> {
        let last = self.points.len() - 1;
        let [x, y, z] = self.wo.x.by_lane(|lane| {
            let (sequence, index) = numbers.sequence(lane, Dimension::Portal, j, n);
            let numbers = sequence.numbers(index);
            let toward =
                portals.sample(numbers.u_lobe(), numbers.u()).map_or(Vec3::ZERO, |(_, point)| {
                    (point - self.points[lane.min(last)].position).normalize_or_zero()
                });
            toward.to_array()
        });
        Vectors { x, y, z }
    }

    /// World directions in the shading frames.
    #[inline(always)]
    pub(super) fn to_local(&self, w: Vectors<F>) -> Vectors<F> {
        let [x, y, z] = &self.frame;
        Vectors { x: x.dot_each(w), y: y.dot_each(w), z: z.dot_each(w) }
    }

    /// Directions in the shading frames in world space.
    #[inline(always)]
    pub(super) fn to_world(&self, w: Vectors<F>) -> Vectors<F> {
        let [x, y, z] = &self.frame;
        x.times(w.x).plus(y.times(w.y)).plus(z.times(w.z))
    }

    /// [`Brdf::eval_pdf`](crate::bsdf::Brdf::eval_pdf) of a direction in each shading frame.
    #[inline(always)]
    pub(super) fn eval(&self, wi: Vectors<F>) -> (Colors<F>, F) {
        match &self.bsdfs {
            Bsdfs::Same(bsdf, choice) => bsdf.eval_chosen(choice, self.wo, wi),
            &Bsdfs::Different(bsdfs, n) => {
                let mut lane = 0;
                let arguments = [self.wo.x, self.wo.y, self.wo.z, wi.x, wi.y, wi.z];
                let [r, g, b, pdf] = F::each(arguments, |[ox, oy, oz, x, y, z]| {
                    lane += 1;
                    if lane > n {
                        return [0.0; 4];
                    }
                    eval_one(bsdfs[lane - 1], [ox, oy, oz], [x, y, z])
                });
                (Colors([r, g, b]), pdf)
            }
        }
    }

    /// Directions sampled from the BSDFs in the shading frames, with number `j` of `n` of each camera sample.
    #[inline(always)]
    pub(super) fn sample(&self, numbers: SampleLanes, j: u32, n: u32) -> Vectors<F> {
        let like = self.wo.x;
        let [u_lobe, u, v] = if self.has_choice {
            numbers.u_with_lobe(like, Dimension::Brdf, j, n)
        } else {
            let [u, v] = numbers.u(like, Dimension::Brdf, j, n);
            [like.splat(0.0), u, v]
        };
        match &self.bsdfs {
            Bsdfs::Same(bsdf, choice) => bsdf.sample_chosen(choice, self.wo, u_lobe, [u, v]),
            &Bsdfs::Different(bsdfs, n) => {
                let mut lane = 0;
                let arguments = [self.wo.x, self.wo.y, self.wo.z, u_lobe, u, v];
                let [x, y, z] = F::each(arguments, |[ox, oy, oz, u_lobe, u, v]| {
                    lane += 1;
                    if lane > n {
                        return [0.0; 3];
                    }
                    sample_one(bsdfs[lane - 1], [ox, oy, oz], u_lobe, [u, v])
                });
                Vectors { x, y, z }
            }
        }
    }
}

/// The uniform random numbers of samples side by side.
#[derive(Clone, Copy)]
pub(super) enum SampleLanes<'a> {
    /// Number `j` of each of these camera samples; the last one stands in for missing ones.
    Points(&'a [SampleIndex]),
    /// The numbers from `j` on of one camera sample.
    Consecutive(SampleIndex),
}

impl SampleLanes<'_> {
    /// [`SampleIndex::get`] of each sample, for a direction.
    #[inline(always)]
    pub(super) fn u<F: SimdFloat>(self, like: F, dimension: Dimension, j: u32, n: u32) -> [F; 2] {
        like.by_lane(|lane| {
            let (sequence, index) = self.sequence(lane, dimension, j, n);
            let [[u], [v]] = sequence.u(index);
            [u, v]
        })
    }

    /// [`SampleIndex::get`] of each sample: the number that chooses a lobe, and those for a direction.
    #[inline(always)]
    fn u_with_lobe<F: SimdFloat>(self, like: F, dimension: Dimension, j: u32, n: u32) -> [F; 3] {
        like.by_lane(|lane| {
            let (sequence, index) = self.sequence(lane, dimension, j, n);
            let numbers = sequence.numbers(index);
            let [u, v] = numbers.u().to_array();
            [numbers.u_lobe(), u, v]
        })
    }

    #[inline(always)]
    fn sequence(self, lane: usize, dimension: Dimension, j: u32, n: u32) -> (SampleSequence, u32) {
        let (SampleIndex { sampler, sample }, j) = match self {
            Self::Points(samples) => (samples[lane.min(samples.len() - 1)], j),
            Self::Consecutive(sample) => (sample, j.wrapping_add(lane as u32)),
        };
        (sampler.set(dimension), sample.wrapping_mul(n).wrapping_add(j))
    }
}

/// The value and the density of one BSDF.
#[inline(never)]
fn eval_one(bsdf: &Bsdf, wo: [f32; 3], wi: [f32; 3]) -> [f32; 4] {
    let (Rgb { r, g, b }, pdf) = bsdf.eval_pdf(wo.into(), wi.into());
    [r, g, b, pdf]
}

/// A direction sampled from one BSDF.
#[inline(never)]
fn sample_one(bsdf: &Bsdf, wo: [f32; 3], u_lobe: f32, u: [f32; 2]) -> [f32; 3] {
    Vec3::from(bsdf.sample_lanes(Vec3::from(wo).into(), u_lobe, u)).to_array()
}
