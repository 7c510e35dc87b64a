//! Precomputes ray data for the intersection tests, eight rays at a time.

use super::{Lanes, WIDTH};
use crate::geometry::Aabb;
use crate::math::Vec3;
use crate::simd::{LaneMask, Simd, SimdF32x8, SimdFloat};

/// Up to `N` rays of one octant, `N` a multiple of eight, with precomputed data for both tests.
pub(super) struct PreparedRays<const N: usize> {
    /// One bit per axis: set if the rays enter through the upper plane.
    pub(super) octant: u32,
    /// Whether products of planes and inverse directions neither overflow nor lose digits to underflow.
    is_moderate: bool,
    /// The origins, by axis. Origins and directions are given; the rest is computed from them.
    origins: [[f32; N]; 3],
    directions: [[f32; N]; 3],
    /// The origins moved forward along each axis, times the inverse direction, for near planes.
    pub(super) near_origins: [[f32; N]; 3],
    /// The origins moved backward along each axis, times the inverse direction, for far planes.
    pub(super) far_origins: [[f32; N]; 3],
    pub(super) inverse_directions: [[f32; N]; 3],
    /// The axes x, y and z of the sheared space: z is the direction's longest, and x and y are the two that follow it.
    axes: [[u8; N]; 3],
    /// The origins' x, y and z.
    pub(super) sheared_origins: [[f32; N]; 3],
    /// Direction x/z, y/z and 1/z.
    pub(super) shears: [[f32; N]; 3],
}

/// The axes x, y and z of the space whose z axis is the first, second, third.
const AXES: [[u8; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];

/// One bit per axis: set if the direction is negative.
#[inline(always)]
pub(super) fn octant(direction: Vec3) -> u32 {
    direction.is_negative_bitmask()
}

impl<const N: usize> PreparedRays<N> {
    pub(super) const EMPTY: Self = Self {
        octant: 0,
        is_moderate: false,
        origins: [[0.0; N]; 3],
        directions: [[0.0; N]; 3],
        near_origins: [[0.0; N]; 3],
        far_origins: [[0.0; N]; 3],
        inverse_directions: [[0.0; N]; 3],
        axes: [[0; N]; 3],
        sheared_origins: [[0.0; N]; 3],
        shears: [[0.0; N]; 3],
    };

    #[inline(always)]
    pub(super) fn set(&mut self, i: usize, origin: Vec3, direction: Vec3) {
        for axis in 0..3 {
            self.origins[axis][i] = origin[axis];
            self.directions[axis][i] = direction[axis];
        }
    }

    /// Computes the rest for the first `count` rays. Returns a bit mask of the rays that can hit anything, because they
    /// are finite and have a direction.
    #[inline(always)]
    pub(super) fn prepare<S: Simd>(
        &mut self,
        simd: S,
        octant: u32,
        count: usize,
        scene: &Aabb,
    ) -> u64 {
        self.octant = octant;
        let (mut valid, mut moderate) = (0, 0);
        for first in (0..count).step_by(WIDTH) {
            let [is_finite, is_moderate] = self.prepare_eight(simd, first, scene);
            valid |= u64::from(is_finite) << first;
            moderate |= u64::from(is_moderate) << first;
        }
        valid &= u64::MAX.checked_shr(u64::BITS - count as u32).unwrap_or(0);
        self.is_moderate = valid & !moderate == 0;
        valid
    }

    /// Bit masks of the rays, of eight, that are finite and that are moderate.
    #[inline(always)]
    fn prepare_eight<S: Simd>(&mut self, simd: S, first: usize, scene: &Aabb) -> [u32; 2] {
        const INFLATION: f32 = 1.0 / (1 << 20) as f32;
        // The rounding errors of origin ± inflation, of its product with the inverse direction and of the plane's
        // product, with some reserve.
        const ORIGIN_ROUNDING: f32 = 1.0 / (1 << 22) as f32;
        // A smaller component moves the ray by less than the inflation while it crosses the scene.
        const NEGLIGIBLE: f32 = 1.0 / (1 << 24) as f32;
        // A larger margin covers the underflow error of a product, at most 2⁻¹⁵⁰.
        const LEAST_MARGIN: f32 = 1.0 / (1_u128 << 100) as f32;

        let sign = |axis: usize| if self.octant >> axis & 1 == 0 { 1.0 } else { -1.0 };
        let signs = [simd.splat(sign(0)), simd.splat(sign(1)), simd.splat(sign(2))];
        let o = load(simd, &self.origins, first);
        let d = load(simd, &self.directions, first);
        let length = [signs[0] * d[0], signs[1] * d[1], signs[2] * d[2]];

        // The largest distance to the scene along an axis, and the largest component.
        let (mut farthest, mut greatest) = (simd.splat(0.0), simd.splat(0.0));
        for k in 0..3 {
            let lower = simd.splat(scene.min[k]) - o[k];
            let upper = simd.splat(scene.max[k]) - o[k];
            farthest = lower.abs().max(upper.abs()).max(farthest);
            greatest = length[k].max(greatest);
        }
        let inflation = simd.splat(INFLATION) * farthest;
        let negligible = simd.splat(NEGLIGIBLE) * greatest;

        let mut inverse = [simd.splat(1.0); 3];
        let mut is_finite = simd.splat(0.0).eq(simd.splat(0.0));
        let mut is_moderate = is_finite;
        for k in 0..3 {
            let margin = inflation + simd.splat(ORIGIN_ROUNDING) * o[k].abs();
            let forward = signs[k] * margin;
            inverse[k] = inverse[k] / (signs[k] * length[k].max(negligible));
            store((o[k] + forward) * inverse[k], &mut self.near_origins[k], first);
            store((o[k] - forward) * inverse[k], &mut self.far_origins[k], first);
            store(inverse[k], &mut self.inverse_directions[k], first);
            // The sum is not finite if any of the numbers is not.
            let sum = o[k] + d[k] + inverse[k] + inflation;
            is_finite = is_finite & sum.abs().lt(simd.splat(f32::INFINITY));
            let (reach, size) = (scene.min[k].abs().max(scene.max[k].abs()), inverse[k].abs());
            let greatest_product = simd.splat(reach) * size;
            is_moderate = is_moderate
                & greatest_product.lt(simd.splat(f32::INFINITY))
                & simd.splat(LEAST_MARGIN).le(inflation * size);
        }

        let is_x = length[1].lt(length[0]) & length[2].lt(length[0]);
        let is_y = length[2].lt(length[1]);
        let [x, y] = [is_x.bits(), is_y.bits()];
        for i in 0..WIDTH {
            let not_x = 1 - (x >> i & 1) as u8;
            let longest = not_x * (2 - (y >> i & 1) as u8);
            for (axes, axis) in self.axes.iter_mut().zip(AXES[usize::from(longest)]) {
                axes[first + i] = axis;
            }
        }
        for (k, origin) in turned(is_x, is_y, o).into_iter().enumerate() {
            store(origin, &mut self.sheared_origins[k], first);
        }
        let ([x, y, _], [_, _, scale]) = (turned(is_x, is_y, d), turned(is_x, is_y, inverse));
        for (k, shear) in [x * scale, y * scale, scale].into_iter().enumerate() {
            store(shear, &mut self.shears[k], first);
        }
        [is_finite.bits(), is_moderate.bits()]
    }

    /// Whether the instruction set rounds products that must be exact for these rays.
    #[inline(always)]
    pub(super) fn need_exact_products<S: Simd>(&self) -> bool {
        !S::F32x8::FUSES && !self.is_moderate
    }

    /// The axes x, y and z of the sheared space of ray `i`.
    #[inline(always)]
    pub(super) fn axes(&self, i: usize) -> [usize; 3] {
        let [x, y, z] = &self.axes;
        [usize::from(x[i]), usize::from(y[i]), usize::from(z[i])]
    }
}

#[inline(always)]
fn load<S: Simd, const N: usize>(simd: S, numbers: &[[f32; N]; 3], first: usize) -> [S::F32x8; 3] {
    [
        simd.load(eight(&numbers[0], first)),
        simd.load(eight(&numbers[1], first)),
        simd.load(eight(&numbers[2], first)),
    ]
}

#[inline(always)]
fn eight(numbers: &[f32], first: usize) -> &Lanes {
    numbers[first..].first_chunk().expect("a multiple of eight")
}

#[inline(always)]
fn store<F: SimdF32x8>(x: F, numbers: &mut [f32], first: usize) {
    *numbers[first..].first_chunk_mut().expect("a multiple of eight") = x.store();
}

/// Permutes the components to the axes of the sheared space, whose z is the longest axis.
#[inline(always)]
fn turned<F: SimdF32x8>(is_x: F::Mask, is_y: F::Mask, [x, y, z]: [F; 3]) -> [F; 3] {
    [pick(is_x, is_y, [y, z, x]), pick(is_x, is_y, [z, x, y]), pick(is_x, is_y, [x, y, z])]
}

/// Selects the first where the longest axis is x, the second where it is y, otherwise the third.
#[inline(always)]
fn pick<F: SimdF32x8>(is_x: F::Mask, is_y: F::Mask, of: [F; 3]) -> F {
    F::select(is_x, of[0], F::select(is_y, of[1], of[2]))
}
