//! AArch64 NEON: a vector is two registers of four.
#![allow(unsafe_code)]
#![allow(clippy::wildcard_imports)] // The intrinsics' names are distinctive enough.
#![cfg_attr(not(target_arch = "aarch64"), allow(unused_unsafe))]

#[cfg(not(target_arch = "aarch64"))]
use super::neon_model::*;
#[cfg(target_arch = "aarch64")]
use std::arch::aarch64::*;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

use super::pair::Pair;
use super::{
    Kernel, LANES, LaneMask, Lanes, Simd, SimdBitSets, SimdF32x8, SimdFloat, SimdI32x8, last_of,
};

/// Proof that the processor has NEON.
#[derive(Clone, Copy)]
pub(crate) struct Neon(());

/// Made only by a [`Neon`], so it proves the same.
#[derive(Clone, Copy)]
pub(crate) struct F32x8(float32x4_t, float32x4_t);

/// Made only by a [`Neon`], so it proves the same.
#[derive(Clone, Copy)]
pub(crate) struct I32x8(int32x4_t, int32x4_t);

/// Made only from a vector, so it proves the same; a lane has all bits set or none.
#[derive(Clone, Copy)]
pub(crate) struct Mask8(uint32x4_t, uint32x4_t);

/// Made only by a [`Neon`], so it proves the same.
#[derive(Clone, Copy)]
pub(crate) struct BitSets8(uint32x4_t, uint32x4_t);

impl Neon {
    #[inline]
    pub(crate) fn new() -> Option<Self> {
        #[cfg(target_arch = "aarch64")]
        let is_available = std::arch::is_aarch64_feature_detected!("neon");
        #[cfg(not(target_arch = "aarch64"))]
        let is_available = true;
        is_available.then_some(Self(()))
    }

    #[inline]
    pub(crate) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[cfg_attr(target_arch = "aarch64", target_feature(enable = "neon"))]
        fn run<K: Kernel>(simd: Neon, kernel: K) -> K::Output {
            kernel.run(simd)
        }
        // SAFETY: `self` proves the feature that `run` enables.
        unsafe { run(self, kernel) }
    }
}

impl Simd for Neon {
    type F32x8 = F32x8;
    type I32x8 = I32x8;
    type F32x16 = Pair<F32x8>;
    type BitSets = BitSets8;

    #[inline(always)]
    fn splat(self, x: f32) -> F32x8 {
        // SAFETY: `self` proves NEON.
        let x = unsafe { vdupq_n_f32(x) };
        F32x8(x, x)
    }
    #[inline(always)]
    fn load(self, x: &Lanes) -> F32x8 {
        // SAFETY: `self` proves NEON; `x` is 8 readable f32, and the loads need no alignment.
        unsafe { F32x8(vld1q_f32(x.as_ptr()), vld1q_f32(x.as_ptr().add(4))) }
    }
    #[inline(always)]
    fn prefetch<T>(self, x: &T) {
        let start = std::ptr::from_ref(x).cast::<u8>();
        for offset in (0..size_of::<T>()).step_by(64) {
            // SAFETY: `offset` is within `x`.
            let line = unsafe { start.add(offset) };
            // SAFETY: a prefetch reads nothing and changes nothing.
            #[cfg(target_arch = "aarch64")]
            unsafe {
                std::arch::asm!(
                    "prfm pldl1keep, [{at}]",
                    at = in(reg) line,
                    options(nostack, readonly, preserves_flags)
                );
            };
            #[cfg(not(target_arch = "aarch64"))]
            let _ = line;
        }
    }
    #[inline(always)]
    fn splat_i32(self, x: i32) -> I32x8 {
        // SAFETY: `self` proves NEON.
        let x = unsafe { vdupq_n_s32(x) };
        I32x8(x, x)
    }
    #[inline(always)]
    fn load_i32(self, x: &[i32; LANES]) -> I32x8 {
        // SAFETY: `self` proves NEON; `x` is 8 readable i32, and the loads need no alignment.
        unsafe { I32x8(vld1q_s32(x.as_ptr()), vld1q_s32(x.as_ptr().add(4))) }
    }
    #[inline(always)]
    fn iota(self) -> I32x8 {
        self.load_i32(&[0, 1, 2, 3, 4, 5, 6, 7])
    }
    #[inline(always)]
    fn transpose(self, rows: [&Lanes; LANES]) -> [F32x8; LANES] {
        std::array::from_fn(|column| self.load(&rows.map(|row| row[column])))
    }
    #[inline(always)]
    fn empty(self) -> BitSets8 {
        // SAFETY: `self` proves NEON.
        let none = unsafe { vdupq_n_u32(0) };
        BitSets8(none, none)
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident, $type:ident, $intrinsic:ident) => {
        impl $trait for $type {
            type Output = Self;

            #[inline(always)]
            fn $method(self, b: Self) -> Self {
                // SAFETY: `self` proves NEON.
                unsafe { Self($intrinsic(self.0, b.0), $intrinsic(self.1, b.1)) }
            }
        }
    };
}
operator!(Add, add, F32x8, vaddq_f32);
operator!(Sub, sub, F32x8, vsubq_f32);
operator!(Mul, mul, F32x8, vmulq_f32);
operator!(Div, div, F32x8, vdivq_f32);
operator!(Add, add, I32x8, vaddq_s32);
operator!(BitAnd, bitand, Mask8, vandq_u32);
operator!(BitOr, bitor, Mask8, vorrq_u32);

impl SimdFloat for F32x8 {
    type Mask = Mask8;
    const N_LANES: usize = LANES;

    #[inline(always)]
    fn splat(self, x: f32) -> Self {
        // SAFETY: `self` proves NEON.
        let x = unsafe { vdupq_n_f32(x) };
        Self(x, x)
    }

    // The instructions FMIN and FMAX treat NaN and −0 differently.
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        Self::select(self.lt(b), self, b)
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        Self::select(b.lt(self), self, b)
    }
    #[inline(always)]
    fn le(self, b: Self) -> Mask8 {
        // SAFETY: `self` proves NEON.
        unsafe { Mask8(vcleq_f32(self.0, b.0), vcleq_f32(self.1, b.1)) }
    }
    #[inline(always)]
    fn lt(self, b: Self) -> Mask8 {
        // SAFETY: `self` proves NEON.
        unsafe { Mask8(vcltq_f32(self.0, b.0), vcltq_f32(self.1, b.1)) }
    }
    #[inline(always)]
    fn eq(self, b: Self) -> Mask8 {
        // SAFETY: `self` proves NEON.
        unsafe { Mask8(vceqq_f32(self.0, b.0), vceqq_f32(self.1, b.1)) }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: `self` proves NEON.
        unsafe { Self(vsqrtq_f32(self.0), vsqrtq_f32(self.1)) }
    }
    #[inline(always)]
    fn select(m: Mask8, a: Self, b: Self) -> Self {
        // SAFETY: the arguments prove NEON.
        unsafe { Self(vbslq_f32(m.0, a.0, b.0), vbslq_f32(m.1, a.1, b.1)) }
    }
    #[inline(always)]
    fn each<const M: usize, const N: usize>(
        arguments: [Self; M],
        mut f: impl FnMut([f32; M]) -> [f32; N],
    ) -> [Self; N] {
        const { assert!(M > 0) };
        let arguments = arguments.map(Self::store);
        let mut values = [[0.0; LANES]; N];
        for lane in 0..LANES {
            for (value, y) in values.iter_mut().zip(f(arguments.map(|x| x[lane]))) {
                value[lane] = y;
            }
        }
        // The arguments prove NEON.
        values.map(|value| Neon(()).load(&value))
    }
}

impl SimdF32x8 for F32x8 {
    type I32x8 = I32x8;
    const FUSES: bool = true;

    #[inline(always)]
    fn mul_sub(self, b: Self, c: Self) -> Self {
        // SAFETY: `self` proves NEON.
        unsafe {
            Self(vfmaq_f32(vnegq_f32(c.0), self.0, b.0), vfmaq_f32(vnegq_f32(c.1), self.1, b.1))
        }
    }
    #[inline(always)]
    fn store(self) -> Lanes {
        let mut lanes = [0.0; 8];
        // SAFETY: `self` proves NEON; `lanes` is 8 writable f32, and the stores need no alignment.
        unsafe {
            vst1q_f32(lanes.as_mut_ptr(), self.0);
            vst1q_f32(lanes.as_mut_ptr().add(4), self.1);
        };
        lanes
    }
    #[inline(always)]
    fn to_i32(self) -> I32x8 {
        // SAFETY: `self` proves NEON.
        unsafe { I32x8(vcvtq_s32_f32(self.0), vcvtq_s32_f32(self.1)) }
    }
    #[inline(always)]
    fn gather<const N: usize>(table: &[Lanes; N], at: I32x8) -> Self {
        let lanes = at.store().map(|i| {
            let i = i as usize & last_of::<N>();
            table[i / LANES][i % LANES]
        });
        // `at` proves NEON.
        Neon(()).load(&lanes)
    }
}

impl SimdI32x8 for I32x8 {
    type F32x8 = F32x8;

    #[inline(always)]
    fn shl<const N: i32>(self) -> Self {
        // SAFETY: `self` proves NEON.
        unsafe { Self(vshlq_n_s32::<N>(self.0), vshlq_n_s32::<N>(self.1)) }
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        // SAFETY: `self` proves NEON.
        unsafe { Self(vminq_s32(self.0, b.0), vminq_s32(self.1, b.1)) }
    }
    #[inline(always)]
    fn lt(self, b: Self) -> Mask8 {
        // SAFETY: `self` proves NEON.
        unsafe { Mask8(vcltq_s32(self.0, b.0), vcltq_s32(self.1, b.1)) }
    }
    #[inline(always)]
    fn to_f32(self) -> F32x8 {
        // SAFETY: `self` proves NEON.
        unsafe { F32x8(vcvtq_f32_s32(self.0), vcvtq_f32_s32(self.1)) }
    }
    #[inline(always)]
    fn select(m: Mask8, a: Self, b: Self) -> Self {
        // SAFETY: the arguments prove NEON.
        unsafe { Self(vbslq_s32(m.0, a.0, b.0), vbslq_s32(m.1, a.1, b.1)) }
    }
    #[inline(always)]
    fn compress(self, keep: Mask8) -> [i32; 8] {
        super::compress(self.store(), keep.bits())
    }
    #[inline(always)]
    fn store(self) -> [i32; 8] {
        let mut lanes = [0; 8];
        // SAFETY: `self` proves NEON; `lanes` is 8 writable i32, and the stores need no alignment.
        unsafe {
            vst1q_s32(lanes.as_mut_ptr(), self.0);
            vst1q_s32(lanes.as_mut_ptr().add(4), self.1);
        };
        lanes
    }
}

impl LaneMask for Mask8 {
    #[inline(always)]
    fn bits(self) -> u32 {
        const LOWER: [u32; 4] = [1, 2, 4, 8];
        const UPPER: [u32; 4] = [16, 32, 64, 128];
        // SAFETY: `self` proves NEON; both tables are 4 readable u32.
        unsafe {
            let lower = vandq_u32(self.0, vld1q_u32(LOWER.as_ptr()));
            let upper = vandq_u32(self.1, vld1q_u32(UPPER.as_ptr()));
            vaddvq_u32(vorrq_u32(lower, upper))
        }
    }
}

impl SimdBitSets for BitSets8 {
    type Mask = Mask8;

    #[inline(always)]
    fn insert(self, m: Mask8, bit: u32) -> Self {
        // SAFETY: `self` proves NEON.
        unsafe {
            let bit = vdupq_n_u32(bit);
            Self(vorrq_u32(self.0, vandq_u32(m.0, bit)), vorrq_u32(self.1, vandq_u32(m.1, bit)))
        }
    }
    #[inline(always)]
    fn not_empty(self) -> u32 {
        // SAFETY: `self` proves NEON.
        let mask = unsafe { Mask8(vtstq_u32(self.0, self.0), vtstq_u32(self.1, self.1)) };
        mask.bits()
    }
    #[inline(always)]
    fn pack(pair: [Self; 2], numbers: [u32; 8]) -> ([[u32; 8]; 2], [u32; 8], usize) {
        super::pack(pair.map(Self::store), numbers)
    }
    #[inline(always)]
    fn store(self) -> [u32; 8] {
        let mut lanes = [0; 8];
        // SAFETY: `self` proves NEON; `lanes` is 8 writable u32, and the stores need no alignment.
        unsafe {
            vst1q_u32(lanes.as_mut_ptr(), self.0);
            vst1q_u32(lanes.as_mut_ptr().add(4), self.1);
        };
        lanes
    }
}
