//! The reference: plain Rust, one lane after the other.

use std::array::from_fn;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

use super::{Floats, Lanes, Mask, Sets, Simd};

#[derive(Clone, Copy)]
pub(super) struct Scalar;

#[derive(Clone, Copy)]
pub(super) struct F32x8(Lanes);

#[derive(Clone, Copy)]
pub(super) struct Mask8([bool; 8]);

#[derive(Clone, Copy)]
pub(super) struct Sets8([u32; 8]);

impl Simd for Scalar {
    type Floats = F32x8;
    type Sets = Sets8;

    #[inline(always)]
    fn splat(self, x: f32) -> F32x8 {
        F32x8([x; 8])
    }
    #[inline(always)]
    fn load(self, x: &Lanes) -> F32x8 {
        F32x8(*x)
    }
    #[inline(always)]
    fn prefetch<T>(self, _: &T) {}
    #[inline(always)]
    fn empty(self) -> Sets8 {
        Sets8([0; 8])
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident, $type:ident, $op:tt) => {
        impl $trait for $type {
            type Output = Self;

            #[inline(always)]
            fn $method(self, b: Self) -> Self {
                Self(from_fn(|i| self.0[i] $op b.0[i]))
            }
        }
    };
}
operator!(Add, add, F32x8, +);
operator!(Sub, sub, F32x8, -);
operator!(Mul, mul, F32x8, *);
operator!(Div, div, F32x8, /);
operator!(BitAnd, bitand, Mask8, &);
operator!(BitOr, bitor, Mask8, |);

impl Floats for F32x8 {
    type Mask = Mask8;

    #[inline(always)]
    fn min(self, b: Self) -> Self {
        Self(from_fn(|i| if self.0[i] < b.0[i] { self.0[i] } else { b.0[i] }))
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        Self(from_fn(|i| if self.0[i] > b.0[i] { self.0[i] } else { b.0[i] }))
    }
    #[inline(always)]
    fn le(self, b: Self) -> Mask8 {
        Mask8(from_fn(|i| self.0[i] <= b.0[i]))
    }
    #[inline(always)]
    fn lt(self, b: Self) -> Mask8 {
        Mask8(from_fn(|i| self.0[i] < b.0[i]))
    }
    #[inline(always)]
    fn eq(self, b: Self) -> Mask8 {
        Mask8(from_fn(|i| self.0[i] == b.0[i]))
    }
    #[inline(always)]
    fn select(m: Mask8, a: Self, b: Self) -> Self {
        Self(from_fn(|i| if m.0[i] { a.0[i] } else { b.0[i] }))
    }
    #[inline(always)]
    fn store(self) -> Lanes {
        self.0
    }
}

impl Mask for Mask8 {
    #[inline(always)]
    fn bits(self) -> u32 {
        (0..8).fold(0, |bits, i| bits | u32::from(self.0[i]) << i)
    }
}

impl Sets for Sets8 {
    type Mask = Mask8;

    #[inline(always)]
    fn insert(self, m: Mask8, bit: u32) -> Self {
        Self(from_fn(|i| if m.0[i] { self.0[i] | bit } else { self.0[i] }))
    }
    #[inline(always)]
    fn not_empty(self) -> u32 {
        (0..8).fold(0, |bits, i| bits | u32::from(self.0[i] != 0) << i)
    }
    #[inline(always)]
    fn pack(self, numbers: [u32; 8]) -> ([u32; 8], [u32; 8], usize) {
        super::pack(self.store(), numbers)
    }
    #[inline(always)]
    fn store(self) -> [u32; 8] {
        self.0
    }
}
