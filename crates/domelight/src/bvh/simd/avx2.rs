//! x86-64 AVX2: a vector is one register.
#![allow(unsafe_code)]
#![allow(clippy::wildcard_imports)] // The intrinsics' names are distinctive enough.

use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

use super::{Floats, Kernel, Lanes, Mask, Sets, Simd};

/// Exists only where the processor has AVX2 and the bit instructions that came with it.
#[derive(Clone, Copy)]
pub(super) struct Avx2(());

/// Made only by an [`Avx2`], so it proves the same.
#[derive(Clone, Copy)]
pub(super) struct F32x8(__m256);

/// Made only from a vector, so it proves the same; a lane has all bits set or none.
#[derive(Clone, Copy)]
pub(super) struct Mask8(__m256);

/// Made only by an [`Avx2`], so it proves the same.
#[derive(Clone, Copy)]
pub(super) struct Sets8(__m256i);

impl Avx2 {
    #[inline]
    pub(super) fn new() -> Option<Self> {
        let available = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt");
        available.then_some(Self(()))
    }

    #[inline]
    pub(super) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
        fn run<K: Kernel>(simd: Avx2, kernel: K) -> K::Output {
            kernel.run(simd)
        }
        // SAFETY: `self` proves the features that `run` enables.
        unsafe { run(self, kernel) }
    }
}

impl Simd for Avx2 {
    type Floats = F32x8;
    type Sets = Sets8;

    #[inline(always)]
    fn splat(self, x: f32) -> F32x8 {
        // SAFETY: `self` proves AVX2.
        F32x8(unsafe { _mm256_set1_ps(x) })
    }
    #[inline(always)]
    fn load(self, x: &Lanes) -> F32x8 {
        // SAFETY: `self` proves AVX2; `x` is 8 readable f32, and the load needs no alignment.
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
        // SAFETY: `self` proves AVX2.
        Sets8(unsafe { _mm256_setzero_si256() })
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident, $type:ident, $intrinsic:ident) => {
        impl $trait for $type {
            type Output = Self;

            #[inline(always)]
            fn $method(self, b: Self) -> Self {
                // SAFETY: `self` proves AVX2.
                Self(unsafe { $intrinsic(self.0, b.0) })
            }
        }
    };
}
operator!(Add, add, F32x8, _mm256_add_ps);
operator!(Sub, sub, F32x8, _mm256_sub_ps);
operator!(Mul, mul, F32x8, _mm256_mul_ps);
operator!(Div, div, F32x8, _mm256_div_ps);
operator!(BitAnd, bitand, Mask8, _mm256_and_ps);
operator!(BitOr, bitor, Mask8, _mm256_or_ps);

impl Floats for F32x8 {
    type Mask = Mask8;

    #[inline(always)]
    fn min(self, b: Self) -> Self {
        // SAFETY: `self` proves AVX2.
        Self(unsafe { _mm256_min_ps(self.0, b.0) })
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        // SAFETY: `self` proves AVX2.
        Self(unsafe { _mm256_max_ps(self.0, b.0) })
    }
    #[inline(always)]
    fn le(self, b: Self) -> Mask8 {
        // SAFETY: `self` proves AVX2.
        Mask8(unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(self.0, b.0) })
    }
    #[inline(always)]
    fn lt(self, b: Self) -> Mask8 {
        // SAFETY: `self` proves AVX2.
        Mask8(unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, b.0) })
    }
    #[inline(always)]
    fn eq(self, b: Self) -> Mask8 {
        // SAFETY: `self` proves AVX2.
        Mask8(unsafe { _mm256_cmp_ps::<_CMP_EQ_OQ>(self.0, b.0) })
    }
    #[inline(always)]
    fn select(m: Mask8, a: Self, b: Self) -> Self {
        // SAFETY: the arguments prove AVX2.
        Self(unsafe { _mm256_blendv_ps(b.0, a.0, m.0) })
    }
    #[inline(always)]
    fn store(self) -> Lanes {
        let mut lanes = [0.0; 8];
        // SAFETY: `self` proves AVX2; `lanes` is 8 writable f32, and the store needs no alignment.
        unsafe { _mm256_storeu_ps(lanes.as_mut_ptr(), self.0) };
        lanes
    }
}

impl Mask for Mask8 {
    #[inline(always)]
    fn bits(self) -> u32 {
        // SAFETY: `self` proves AVX2.
        unsafe { _mm256_movemask_ps(self.0) as u32 }
    }
}

impl Sets for Sets8 {
    type Mask = Mask8;

    #[inline(always)]
    fn insert(self, m: Mask8, bit: u32) -> Self {
        // SAFETY: `self` proves AVX2.
        Self(unsafe {
            let bit = _mm256_set1_epi32(bit as i32);
            _mm256_or_si256(self.0, _mm256_and_si256(_mm256_castps_si256(m.0), bit))
        })
    }
    #[inline(always)]
    fn not_empty(self) -> u32 {
        // SAFETY: `self` proves AVX2.
        unsafe {
            let empty = _mm256_cmpeq_epi32(self.0, _mm256_setzero_si256());
            !_mm256_movemask_ps(_mm256_castsi256_ps(empty)) as u32 & 0xff
        }
    }
    #[inline(always)]
    fn pack(self, numbers: [u32; 8]) -> ([u32; 8], [u32; 8], usize) {
        let not_empty = self.not_empty();
        let lanes = &super::PACKED_LANES[not_empty as usize % 256];
        // SAFETY: `self` proves AVX2; both arrays are 32 readable bytes, the loads need no alignment.
        let (sets, numbers) = unsafe {
            let lanes = _mm256_loadu_si256(lanes.as_ptr().cast());
            let numbers = _mm256_loadu_si256(numbers.as_ptr().cast());
            let sets = _mm256_permutevar8x32_epi32(self.0, lanes);
            (Self(sets), Self(_mm256_permutevar8x32_epi32(numbers, lanes)))
        };
        (sets.store(), numbers.store(), not_empty.count_ones() as usize)
    }
    #[inline(always)]
    fn store(self) -> [u32; 8] {
        let mut lanes = [0; 8];
        // SAFETY: `self` proves AVX2; `lanes` is 32 writable bytes, the store needs no alignment.
        unsafe { _mm256_storeu_si256(lanes.as_mut_ptr().cast(), self.0) };
        lanes
    }
}
