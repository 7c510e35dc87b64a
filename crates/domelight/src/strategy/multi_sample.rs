//! Samples of light, BRDF and portals at one point or at several side by side: Veach & Guibas 1995, equation 10 (the
//! multi-sample model; the weights sum to one for each direction).
//!
//! All strategies of independent samples draw them here: BRDF and environment sampling have samples of one technique, and
//! the candidates of resampling are weighted by the balance heuristic.

use super::point_lanes::{MOST_LANES, PointLanes, SampleLanes};
use super::portal::Portals;
use super::{Contributions, SampleIndex, ShadingPoint, TileShading};
use crate::Rgb;
use crate::environment::{Environment, LightDensity};
use crate::math::Vec3;
use crate::sampling::{Dimension, Heuristic};
use crate::simd::{
    Colors, InstructionSet, Kernel, Lanes, Simd, SimdF32x16 as _, SimdFloat, Vectors, dispatch,
};

/// The samples of one technique at a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Count {
    /// Their number.
    pub(super) n: u32,
    /// The expected number over all points, if it is random.
    pub(super) expected: f32,
    /// The number of points of a sequence that a camera sample reserves.
    pub(super) reserved: u32,
}

impl Count {
    /// The same number everywhere.
    pub(super) fn fixed(n: u32) -> Self {
        Self { n, expected: n as f32, reserved: n }
    }
}

/// Samples of light and of the BRDF at each point.
#[derive(Clone, Copy, Debug)]
pub(super) struct MultiSample<'a> {
    pub(super) environment: &'a Environment,
    /// The density of light samples.
    pub(super) light: LightDensity<'a>,
    pub(super) n_light: Count,
    pub(super) n_brdf: Count,
    /// Of points on portals, where a scene has any.
    pub(super) n_portal: Count,
    pub(super) heuristic: Heuristic,
}

/// Implements [`PointStrategy`](super::PointStrategy) for a strategy whose `samples` are a [`MultiSample`].
macro_rules! point_strategy_of_samples {
    ($strategy:ident) => {
        impl $crate::strategy::PointStrategy for $strategy<'_> {
            type Scratch = $crate::strategy::SampleScratch;

            const UNBIASED: bool = true;

            fn unit(&self) -> f64 {
                self.environment.unit()
            }

            fn n_rays(&self) -> u32 {
                let samples = self.samples();
                samples.n_light.n + samples.n_brdf.n + samples.n_portal.n
            }

            fn samples_portals(&self) -> bool {
                self.samples().n_portal.n > 0
            }

            fn sample(
                &self,
                at: &$crate::strategy::ShadingPoint,
                sample_index: $crate::strategy::SampleIndex,
                _: &mut Self::Scratch,
                push: impl FnMut($crate::math::Vec3, $crate::Rgb),
            ) {
                self.samples().sample(at, sample_index, push);
            }

            fn sample_tile(
                &self,
                tile: &$crate::strategy::TileShading,
                scratch: &mut Self::Scratch,
                out: &mut $crate::strategy::Contributions,
            ) {
                self.samples().sample_tile(tile, scratch, out);
            }
        }
    };
}
pub(super) use point_strategy_of_samples;

/// A way to draw directions.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Technique {
    Light,
    Brdf,
    Portal,
}

impl MultiSample<'_> {
    /// [`PointStrategy::sample`](super::PointStrategy::sample).
    pub(super) fn sample(
        &self,
        at: &ShadingPoint,
        sample_index: SampleIndex,
        mut push: impl FnMut(Vec3, Rgb),
    ) {
        let (points, numbers) = ([at], [sample_index]);
        let at = PointLanes::load(0.0, &points);
        let portals = Portals::new(&[]);
        for (technique, count) in self.techniques(portals) {
            for j in 0..count.n {
                let numbers = SampleLanes::Points(&numbers);
                let (wi, weight) = self.draw(technique, portals, &at, numbers, j);
                let weight = weight.single();
                if !weight.is_black() {
                    push(wi.into(), weight);
                }
            }
        }
    }

    /// [`PointStrategy::sample_tile`](super::PointStrategy::sample_tile).
    pub(super) fn sample_tile(
        &self,
        tile: &TileShading,
        scratch: &mut SampleScratch,
        out: &mut Contributions,
    ) {
        let portals = Portals::new(tile.portals);
        self.each_point(tile, portals, scratch, |(point, ..), samples| {
            samples.each().for_each(|(wi, weight)| out.push(point, wi, weight));
        });
    }

    /// Calls `each` with each point of a tile and its samples, which are drawn for several points side by side.
    pub(super) fn each_point(
        &self,
        tile: &TileShading,
        portals: Portals,
        scratch: &mut SampleScratch,
        mut each: impl FnMut((u32, &ShadingPoint, SampleIndex), PointSamples),
    ) {
        let mut points = tile.each_point();
        // Take the next points, of any pixels.
        while let Some(first) = points.next() {
            let (mut batch, mut n) = ([first; MOST_LANES], 1);
            for point in points.by_ref().take(MOST_LANES - 1) {
                batch[n] = point;
                n += 1;
            }
            let (at, samples) = (batch.map(|(_, at, _)| at), batch.map(|(_, _, sample)| sample));
            let numbers = SampleLanes::Points(&samples[..n]);
            self.draw_all(tile.instruction_set, portals, &at[..n], numbers, scratch);
            for (lane, &point) in batch[..n].iter().enumerate() {
                each(point, PointSamples { rows: &scratch.rows, lane });
            }
        }
    }

    /// Calls `push` with the directions, the weights and the numbers of the samples at one point, which are drawn side
    /// by side, including black ones.
    pub(super) fn sample_each(
        &self,
        instruction_set: InstructionSet,
        at: &ShadingPoint,
        sample_index: SampleIndex,
        scratch: &mut SampleScratch,
        mut push: impl FnMut(Vec3, Rgb, u32),
    ) {
        let lanes = self.n_light.n.max(self.n_brdf.n).clamp(1, MOST_LANES as u32) as usize;
        let points = &[at; MOST_LANES][..lanes];
        let (numbers, portals) = (SampleLanes::Consecutive(sample_index), Portals::new(&[]));
        self.draw_all(instruction_set, portals, points, numbers, scratch);
        let mut rows = scratch.rows.iter();
        let mut number = 0;
        for (_, count) in self.techniques(portals) {
            for first in (0..count.n).step_by(MOST_LANES) {
                let row = rows.next().expect("a row for each step");
                for lane in 0..MOST_LANES.min((count.n - first) as usize) {
                    push(row.wi(lane), row.weight(lane), number);
                    number += 1;
                }
            }
        }
    }

    /// The ways to draw directions in a scene with these portals.
    fn techniques(&self, portals: Portals) -> [(Technique, Count); 3] {
        let n_portal = if portals.is_empty() { Count::fixed(0) } else { self.n_portal };
        [
            (Technique::Light, self.n_light),
            (Technique::Brdf, self.n_brdf),
            (Technique::Portal, n_portal),
        ]
    }

    fn draw_all(
        &self,
        instruction_set: InstructionSet,
        portals: Portals,
        points: &[&ShadingPoint],
        numbers: SampleLanes,
        scratch: &mut SampleScratch,
    ) {
        dispatch(instruction_set, DrawAll { samples: self, portals, points, numbers, scratch });
    }

    /// Draws sample `j` of a technique at each point: the direction of a shadow ray and its weight, black where there is
    /// no ray.
    #[inline(always)]
    fn draw<F: SimdFloat>(
        &self,
        technique: Technique,
        portals: Portals,
        at: &PointLanes<F>,
        numbers: SampleLanes,
        j: u32,
    ) -> (Vectors<F>, Colors<F>) {
        let zero = at.wo.x.splat(0.0);
        let black = Colors::splat(zero, Rgb::BLACK);
        // Draw directions, in world space and in the shading frames.
        let (wi, local, le) = match technique {
            Technique::Light => {
                let u = numbers.u(zero, Dimension::Environment, j, self.n_light.reserved);
                match self.light.sample_lanes(self.environment, u) {
                    Some(s) => (s.wi, at.to_local(s.wi), s.le),
                    None => return (at.wo, black),
                }
            }
            Technique::Brdf => {
                let local = at.sample(numbers, j, self.n_brdf.reserved);
                let wi = at.to_world(local);
                (wi, local, self.environment.le_lanes(wi))
            }
            Technique::Portal => {
                let wi = at.toward_portals(portals, numbers, j, self.n_portal.reserved);
                (wi, at.to_local(wi), self.environment.le_lanes(wi))
            }
        };
        // Weigh them by the densities of both techniques. Directions below the surface are dark without a ray.
        let (value, pdf_brdf) = at.eval(local);
        let (n_light, n_brdf) =
            (zero.splat(self.n_light.expected), zero.splat(self.n_brdf.expected));
        let (of_light, of_brdf) = (n_light * self.light.pdf(le), n_brdf * pdf_brdf);
        // A technique without samples has no density, even where that is infinite.
        let of_light = F::select(zero.lt(n_light), of_light, zero);
        let of_brdf = F::select(zero.lt(n_brdf), of_brdf, zero);
        let (own, other) = if self.n_portal.n == 0 || portals.is_empty() {
            match technique {
                Technique::Light => (of_light, of_brdf),
                Technique::Brdf | Technique::Portal => (of_brdf, of_light),
            }
        } else {
            let of_portal = zero.splat(self.n_portal.expected) * portals.pdf(at.positions(), wi);
            let (own, others) = match technique {
                Technique::Light => (of_light, [of_brdf, of_portal]),
                Technique::Brdf => (of_brdf, [of_light, of_portal]),
                Technique::Portal => (of_portal, [of_light, of_brdf]),
            };
            (own, self.heuristic.together(others))
        };
        let has_density = zero.lt(own) & own.le(zero.splat(f32::MAX));
        let is_drawn = has_density & zero.lt(at.ng.dot_each(wi));
        let weight = self.heuristic.weight_lanes(own, other);
        (wi, value.times(le).divided(own).scaled(weight).masked(is_drawn))
    }
}

/// Scratch memory of strategies that draw samples side by side.
#[derive(Clone, Debug, Default)]
pub struct SampleScratch {
    rows: Vec<Row>,
}

/// The samples of one of the points side by side.
#[derive(Clone, Copy)]
pub(super) struct PointSamples<'a> {
    rows: &'a [Row],
    lane: usize,
}

impl<'a> PointSamples<'a> {
    /// Directions and weights, including black ones.
    pub(super) fn each(self) -> impl Iterator<Item = (Vec3, Rgb)> + use<'a> {
        self.rows.iter().map(move |row| (row.wi(self.lane), row.weight(self.lane)))
    }
}

/// Samples side by side.
#[derive(Clone, Debug)]
struct Row {
    /// World directions.
    wi: [[Lanes; 2]; 3],
    weight: [[Lanes; 2]; 3],
}

impl Row {
    fn wi(&self, lane: usize) -> Vec3 {
        self.wi.map(|c| c.as_flattened()[lane]).into()
    }

    fn weight(&self, lane: usize) -> Rgb {
        self.weight.map(|c| c.as_flattened()[lane]).into()
    }
}

/// Draws all samples of the points, a row for each sample, or the samples of one point, a row for as many as there are lanes.
struct DrawAll<'a> {
    samples: &'a MultiSample<'a>,
    portals: Portals<'a>,
    points: &'a [&'a ShadingPoint],
    numbers: SampleLanes<'a>,
    scratch: &'a mut SampleScratch,
}

impl Kernel for DrawAll<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { samples, portals, points, numbers, scratch: SampleScratch { rows } } = self;
        let at = PointLanes::load(simd.splat_f32x16(0.0), points);
        let step = match numbers {
            SampleLanes::Points(_) => 1,
            SampleLanes::Consecutive(_) => MOST_LANES,
        };
        rows.clear();
        for (technique, count) in samples.techniques(portals) {
            for j in (0..count.n).step_by(step) {
                let (Vectors { x, y, z }, Colors([r, g, b])) =
                    samples.draw(technique, portals, &at, numbers, j);
                rows.push(Row {
                    wi: [x.store(), y.store(), z.store()],
                    weight: [r.store(), g.store(), b.store()],
                });
            }
        }
    }
}
