//! x86-64 AVX-512 with vectors of eight: comparisons go to mask registers, and there are twice as many
//! registers.
#![allow(unsafe_code)]
#![allow(clippy::wildcard_imports)] // The intrinsics' names are distinctive enough.

use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

use super::{Floats, Kernel, Lanes, Mask, Sets, Simd};

/// Exists only where the processor has AVX-512 F and VL and the bit instructions of AVX2's time.
#[derive(Clone, Copy)]
pub(super) struct Avx512(());

/// Made only by an [`Avx512`], so it proves the same.
#[derive(Clone, Copy)]
pub(super) struct F32x8(__m256);

/// A bit a lane.
#[derive(Clone, Copy)]
pub(super) struct Mask8(__mmask8);

/// Made only by an [`Avx512`], so it proves the same.
#[derive(Clone, Copy)]
pub(super) struct Sets8(__m256i);

impl Avx512 {
    #[inline]
    pub(super) fn new() -> Option<Self> {
        let available = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt");
        available.then_some(Self(()))
    }

    #[inline]
    pub(super) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[target_feature(enable = "avx512f,avx512vl,bmi1,bmi2,lzcnt,popcnt")]
        fn run<K: Kernel>(simd: Avx512, kernel: K) -> K::Output {
            kernel.run(simd)
        }
        // SAFETY: `self` proves the features that `run` enables.
        unsafe { run(self, kernel) }
    }
}

impl Simd for Avx512 {
    type Floats = F32x8;
    type Sets = Sets8;

    #[inline(always)]
    fn splat(self, x: f32) -> F32x8 {
        // SAFETY: `self` proves AVX-512.
        F32x8(unsafe { _mm256_set1_ps(x) })
    }
    #[inline(always)]
    fn load(self, x: &Lanes) -> F32x8 {
        // SAFETY: `self` proves AVX-512; `x` is 8 readable f32, and the load needs no alignment.
        F32x8(unsafe { _mm256_loadu_ps(x.as_ptr()) })
    }
    #[inline(always)]
    fn prefetch<T>(self, x: &T) {
        let start = std::ptr::from_ref(x).cast::<i8>();
        for offset in (0..size_of::<T>()).step_by(64) {
            // SAFETY: a prefetch reads nothing; `offset` is within `x`.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(start.add(offset)) };
        }
    }
    #[inline(always)]
    fn empty(self) -> Sets8 {
        // SAFETY: `self` proves AVX-512.
        Sets8(unsafe { _mm256_setzero_si256() })
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident, $type:ident, $intrinsic:ident) => {
        impl $trait for $type {
            type Output = Self;

            #[inline(always)]
            fn $method(self, b: Self) -> Self {
                // SAFETY: `self` proves AVX-512.
                Self(unsafe { $intrinsic(self.0, b.0) })
            }
        }
    };
}
operator!(Add, add, F32x8, _mm256_add_ps);
operator!(Sub, sub, F32x8, _mm256_sub_ps);
operator!(Mul, mul, F32x8, _mm256_mul_ps);
operator!(Div, div, F32x8, _mm256_div_ps);

impl BitAnd for Mask8 {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, b: Self) -> Self {
        Self(self.0 & b.0)
    }
}

impl BitOr for Mask8 {
    type Output = Self;

    #[inline(always)]
    fn bitor(self, b: Self) -> Self {
        Self(self.0 | b.0)
    }
}

impl Floats for F32x8 {
    type Mask = Mask8;

    #[inline(always)]
    fn min(self, b: Self) -> Self {
        // SAFETY: `self` proves AVX-512.
        Self(unsafe { _mm256_min_ps(self.0, b.0) })
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        // SAFETY: `self` proves AVX-512.
        Self(unsafe { _mm256_max_ps(self.0, b.0) })
    }
    #[inline(always)]
    fn le(self, b: Self) -> Mask8 {
        // SAFETY: `self` proves AVX-512.
        Mask8(unsafe { _mm256_cmp_ps_mask::<_CMP_LE_OQ>(self.0, b.0) })
    }
    #[inline(always)]
    fn lt(self, b: Self) -> Mask8 {
        // SAFETY: `self` proves AVX-512.
        Mask8(unsafe { _mm256_cmp_ps_mask::<_CMP_LT_OQ>(self.0, b.0) })
    }
    #[inline(always)]
    fn eq(self, b: Self) -> Mask8 {
        // SAFETY: `self` proves AVX-512.
        Mask8(unsafe { _mm256_cmp_ps_mask::<_CMP_EQ_OQ>(self.0, b.0) })
    }
    #[inline(always)]
    fn select(m: Mask8, a: Self, b: Self) -> Self {
        // SAFETY: the arguments prove AVX-512.
        Self(unsafe { _mm256_mask_blend_ps(m.0, b.0, a.0) })
    }
    #[inline(always)]
    fn store(self) -> Lanes {
        let mut lanes = [0.0; 8];
        // SAFETY: `self` proves AVX-512; `lanes` is 8 writable f32, and the store needs no alignment.
        unsafe { _mm256_storeu_ps(lanes.as_mut_ptr(), self.0) };
        lanes
    }
}

impl Mask for Mask8 {
    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self.0)
    }
}

impl Sets for Sets8 {
    type Mask = Mask8;

    #[inline(always)]
    fn insert(self, m: Mask8, bit: u32) -> Self {
        // SAFETY: `self` proves AVX-512.
        Self(unsafe { _mm256_mask_or_epi32(self.0, m.0, self.0, _mm256_set1_epi32(bit as i32)) })
    }
    #[inline(always)]
    fn not_empty(self) -> u32 {
        // SAFETY: `self` proves AVX-512.
        u32::from(unsafe { _mm256_test_epi32_mask(self.0, self.0) })
    }
    #[inline(always)]
    fn pack(self, numbers: [u32; 8]) -> ([u32; 8], [u32; 8], usize) {
        // SAFETY: `self` proves AVX-512; `numbers` is 32 readable bytes, the load needs no alignment.
        let (sets, numbers, not_empty) = unsafe {
            let not_empty = _mm256_test_epi32_mask(self.0, self.0);
            let numbers = _mm256_loadu_si256(numbers.as_ptr().cast());
            let sets = _mm256_maskz_compress_epi32(not_empty, self.0);
            (Self(sets), Self(_mm256_maskz_compress_epi32(not_empty, numbers)), not_empty)
        };
        (sets.store(), numbers.store(), not_empty.count_ones() as usize)
    }
    #[inline(always)]
    fn store(self) -> [u32; 8] {
        let mut lanes = [0; 8];
        // SAFETY: `self` proves AVX-512; `lanes` is 32 writable bytes, the store needs no alignment.
        unsafe { _mm256_storeu_si256(lanes.as_mut_ptr().cast(), self.0) };
        lanes
    }
}
