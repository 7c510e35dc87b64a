//! The reference: plain Rust, one lane after the other.

use std::array::from_fn;

use super::{Lanes, Simd};

#[derive(Clone, Copy)]
pub(super) struct Scalar;

impl Simd for Scalar {
    type F = Lanes;
    type M = [bool; 8];
    type B = [u32; 8];

    #[inline(always)]
    fn splat(self, x: f32) -> Lanes {
        [x; 8]
    }
    #[inline(always)]
    fn load(self, x: &Lanes) -> Lanes {
        *x
    }
    #[inline(always)]
    fn store(self, x: Lanes) -> Lanes {
        x
    }
    #[inline(always)]
    fn add(self, a: Lanes, b: Lanes) -> Lanes {
        from_fn(|i| a[i] + b[i])
    }
    #[inline(always)]
    fn sub(self, a: Lanes, b: Lanes) -> Lanes {
        from_fn(|i| a[i] - b[i])
    }
    #[inline(always)]
    fn mul(self, a: Lanes, b: Lanes) -> Lanes {
        from_fn(|i| a[i] * b[i])
    }
    #[inline(always)]
    fn div(self, a: Lanes, b: Lanes) -> Lanes {
        from_fn(|i| a[i] / b[i])
    }
    #[inline(always)]
    fn min(self, a: Lanes, b: Lanes) -> Lanes {
        from_fn(|i| if a[i] < b[i] { a[i] } else { b[i] })
    }
    #[inline(always)]
    fn max(self, a: Lanes, b: Lanes) -> Lanes {
        from_fn(|i| if a[i] > b[i] { a[i] } else { b[i] })
    }
    #[inline(always)]
    fn le(self, a: Lanes, b: Lanes) -> [bool; 8] {
        from_fn(|i| a[i] <= b[i])
    }
    #[inline(always)]
    fn lt(self, a: Lanes, b: Lanes) -> [bool; 8] {
        from_fn(|i| a[i] < b[i])
    }
    #[inline(always)]
    fn eq(self, a: Lanes, b: Lanes) -> [bool; 8] {
        from_fn(|i| a[i] == b[i])
    }
    #[inline(always)]
    fn and(self, a: [bool; 8], b: [bool; 8]) -> [bool; 8] {
        from_fn(|i| a[i] & b[i])
    }
    #[inline(always)]
    fn or(self, a: [bool; 8], b: [bool; 8]) -> [bool; 8] {
        from_fn(|i| a[i] | b[i])
    }
    #[inline(always)]
    fn bits(self, m: [bool; 8]) -> u32 {
        (0..8).fold(0, |bits, i| bits | u32::from(m[i]) << i)
    }
    #[inline(always)]
    fn no_bits(self) -> [u32; 8] {
        [0; 8]
    }
    #[inline(always)]
    fn insert(self, sets: [u32; 8], m: [bool; 8], bit: u32) -> [u32; 8] {
        from_fn(|i| if m[i] { sets[i] | bit } else { sets[i] })
    }
    #[inline(always)]
    fn store_bits(self, sets: [u32; 8]) -> [u32; 8] {
        sets
    }
    #[inline(always)]
    fn not_empty(self, sets: [u32; 8]) -> u32 {
        (0..8).fold(0, |bits, i| bits | u32::from(sets[i] != 0) << i)
    }
}
