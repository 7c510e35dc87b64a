//! Vectors of directions and colors.

use super::{Lanes, Simd, SimdF32x8, SimdFloat};
use crate::Rgb;
use crate::math::Vec3;

/// Vectors by component.
#[derive(Clone, Copy, Debug)]
pub struct Vectors<F> {
    pub(crate) x: F,
    pub(crate) y: F,
    pub(crate) z: F,
}

impl<F: SimdFloat> Vectors<F> {
    /// The dot products with one vector.
    #[inline(always)]
    pub(crate) fn dot(self, v: Vec3) -> F {
        self.x * self.x.splat(v.x) + self.y * self.x.splat(v.y) + self.z * self.x.splat(v.z)
    }

    /// The pairwise dot products.
    #[inline(always)]
    pub(crate) fn dot_each(self, b: Self) -> F {
        self.x * b.x + self.y * b.y + self.z * b.z
    }

    #[inline(always)]
    pub(crate) fn length_squared(self) -> F {
        self.dot_each(self)
    }

    /// `v` in every lane of vectors like `like`.
    #[inline(always)]
    pub(crate) fn splat(like: F, v: Vec3) -> Self {
        Self { x: like.splat(v.x), y: like.splat(v.y), z: like.splat(v.z) }
    }

    #[inline(always)]
    pub(crate) fn plus(self, b: Self) -> Self {
        Self { x: self.x + b.x, y: self.y + b.y, z: self.z + b.z }
    }

    #[inline(always)]
    pub(crate) fn minus(self, b: Self) -> Self {
        Self { x: self.x - b.x, y: self.y - b.y, z: self.z - b.z }
    }

    #[inline(always)]
    pub(crate) fn cross(self, b: Self) -> Self {
        Self {
            x: self.y * b.z - b.y * self.z,
            y: self.z * b.x - b.z * self.x,
            z: self.x * b.y - b.x * self.y,
        }
    }

    /// The unit vectors, or `other` where the length is not positive and finite.
    #[inline(always)]
    pub(crate) fn normalized_or(self, other: Self) -> Self {
        let (zero, infinity) = (self.x.splat(0.0), self.x.splat(f32::INFINITY));
        let scale = self.x.splat(1.0) / self.length_squared().sqrt();
        Self::select(zero.lt(scale) & scale.lt(infinity), self.times(scale), other)
    }

    /// mask ? a : b.
    #[inline(always)]
    pub(crate) fn select(mask: F::Mask, a: Self, b: Self) -> Self {
        let Self { x, y, z } = a;
        Self { x: F::select(mask, x, b.x), y: F::select(mask, y, b.y), z: F::select(mask, z, b.z) }
    }

    /// Each vector times a number.
    #[inline(always)]
    pub(crate) fn times(self, f: F) -> Self {
        Self { x: self.x * f, y: self.y * f, z: self.z * f }
    }
}

impl<F: SimdF32x8> Vectors<F> {
    /// By component.
    #[inline(always)]
    pub(crate) fn load<S: Simd<F32x8 = F>>(simd: S, v: &[Lanes; 3]) -> Self {
        let [x, y, z] = v;
        Self { x: simd.load(x), y: simd.load(y), z: simd.load(z) }
    }

    /// By component.
    #[inline(always)]
    pub(crate) fn store(self) -> [Lanes; 3] {
        [self.x.store(), self.y.store(), self.z.store()]
    }
}

impl From<Vectors<f32>> for Vec3 {
    #[inline(always)]
    fn from(Vectors { x, y, z }: Vectors<f32>) -> Self {
        Self { x, y, z }
    }
}

impl From<Vec3> for Vectors<f32> {
    #[inline(always)]
    fn from(v: Vec3) -> Self {
        Self { x: v.x, y: v.y, z: v.z }
    }
}

/// Colors by channel.
#[derive(Clone, Copy, Debug)]
pub struct Colors<F>(pub(crate) [F; 3]);

impl<F: SimdFloat> Colors<F> {
    /// `color` in every lane of vectors like `like`.
    #[inline(always)]
    pub(crate) fn splat(like: F, color: Rgb) -> Self {
        Self([like.splat(color.r), like.splat(color.g), like.splat(color.b)])
    }

    /// Combines the channels of two colors.
    #[inline(always)]
    pub(crate) fn zip(self, b: Self, f: impl Fn(F, F) -> F) -> Self {
        let ([r, g, b], [r2, g2, b2]) = (self.0, b.0);
        Self([f(r, r2), f(g, g2), f(b, b2)])
    }

    #[inline(always)]
    pub(crate) fn map(self, f: impl Fn(F) -> F) -> Self {
        let [r, g, b] = self.0;
        Self([f(r), f(g), f(b)])
    }

    /// Times a number.
    #[inline(always)]
    pub(crate) fn scaled(self, x: F) -> Self {
        let [r, g, b] = self.0;
        Self([r * x, g * x, b * x])
    }

    /// The products of two colors.
    #[inline(always)]
    pub(crate) fn times(self, b: Self) -> Self {
        self.zip(b, |a, b| a * b)
    }

    /// Divided by a number.
    #[inline(always)]
    pub(crate) fn divided(self, x: F) -> Self {
        let [r, g, b] = self.0;
        Self([r / x, g / x, b / x])
    }

    /// mask ? self : black.
    #[inline(always)]
    pub(crate) fn masked(self, mask: F::Mask) -> Self {
        let [r, g, b] = self.0;
        let zero = r.splat(0.0);
        Self([F::select(mask, r, zero), F::select(mask, g, zero), F::select(mask, b, zero)])
    }

    /// The Rec. 709 luminance.
    #[inline(always)]
    pub(crate) fn luminance(self) -> F {
        let [r, g, b] = self.0;
        let [wr, wg, wb] = Rgb::LUMINANCE;
        r.splat(wr) * r + g.splat(wg) * g + b.splat(wb) * b
    }
}

// Arrays of vectors are spelled out, because `map` may not be inlined.
impl<F: SimdF32x8> Colors<F> {
    /// By channel.
    #[inline(always)]
    pub(crate) fn load<S: Simd<F32x8 = F>>(simd: S, color: &[Lanes; 3]) -> Self {
        let [r, g, b] = color;
        Self([simd.load(r), simd.load(g), simd.load(b)])
    }

    /// By channel.
    #[inline(always)]
    pub(crate) fn store(self) -> [Lanes; 3] {
        let [r, g, b] = self.0;
        [r.store(), g.store(), b.store()]
    }

    /// The sum of all.
    #[inline(always)]
    pub(crate) fn sum(self) -> Rgb {
        let [r, g, b] = self.0;
        Rgb::new(r.sum(), g.sum(), b.sum())
    }
}

impl From<Rgb> for Colors<f32> {
    #[inline(always)]
    fn from(color: Rgb) -> Self {
        Self(color.to_array())
    }
}

impl Colors<f32> {
    #[inline(always)]
    pub(crate) fn single(self) -> Rgb {
        Rgb::from(self.0)
    }
}
