//! x86-64 AVX2: a vector is one register.
#![allow(unsafe_code)]
#![allow(clippy::wildcard_imports)] // The intrinsics' names are distinctive enough.

use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

use super::pair::Pair;
use super::{
    Kernel, LANES, LaneMask, Lanes, Simd, SimdBitSets, SimdF32x8, SimdFloat, SimdI32x8, last_of,
};

/// Proof that the processor has AVX2, FMA and the bit instructions introduced with them.
#[derive(Clone, Copy)]
pub(crate) struct Avx2(());

/// Made only by an [`Avx2`], so it proves the same.
#[derive(Clone, Copy)]
pub(crate) struct F32x8(__m256);

/// Made only by an [`Avx2`], so it proves the same.
#[derive(Clone, Copy)]
pub(crate) struct I32x8(__m256i);

/// Made only from a vector, so it proves the same; a lane has all bits set or none.
#[derive(Clone, Copy)]
pub(crate) struct Mask8(__m256);

/// Made only by an [`Avx2`], so it proves the same.
#[derive(Clone, Copy)]
pub(crate) struct BitSets8(__m256i);

impl Avx2 {
    #[inline]
    pub(crate) fn new() -> Option<Self> {
        let available = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt");
        available.then_some(Self(()))
    }

    #[inline]
    pub(crate) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
        fn run<K: Kernel>(simd: Avx2, kernel: K) -> K::Output {
            kernel.run(simd)
        }
        // SAFETY: `self` proves the features that `run` enables.
        unsafe { run(self, kernel) }
    }
}

impl Simd for Avx2 {
    type F32x8 = F32x8;
    type I32x8 = I32x8;
    type F32x16 = Pair<F32x8>;
    type BitSets = BitSets8;

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
    fn splat_i32(self, x: i32) -> I32x8 {
        // SAFETY: `self` proves AVX2.
        I32x8(unsafe { _mm256_set1_epi32(x) })
    }
    #[inline(always)]
    fn load_i32(self, x: &[i32; LANES]) -> I32x8 {
        // SAFETY: `self` proves AVX2; `x` is 32 readable bytes, and the load needs no alignment.
        I32x8(unsafe { _mm256_loadu_si256(x.as_ptr().cast()) })
    }
    #[inline(always)]
    fn iota(self) -> I32x8 {
        // SAFETY: `self` proves AVX2.
        I32x8(unsafe { _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7) })
    }
    #[inline(always)]
    fn transpose(self, rows: [&Lanes; LANES]) -> [F32x8; LANES] {
        let mut r = [self.load(rows[0]).0; LANES];
        for (r, row) in r.iter_mut().zip(rows) {
            *r = self.load(row).0;
        }
        // SAFETY: `self` proves AVX2.
        unsafe {
            // Pairs of rows, then fours, then all eight.
            let pair =
                |i: usize| [_mm256_unpacklo_ps(r[i], r[i + 1]), _mm256_unpackhi_ps(r[i], r[i + 1])];
            let [a, b, c, d] = [pair(0), pair(2), pair(4), pair(6)];
            let four = |a: [__m256; 2], b: [__m256; 2]| {
                [
                    _mm256_shuffle_ps::<0x44>(a[0], b[0]),
                    _mm256_shuffle_ps::<0xee>(a[0], b[0]),
                    _mm256_shuffle_ps::<0x44>(a[1], b[1]),
                    _mm256_shuffle_ps::<0xee>(a[1], b[1]),
                ]
            };
            let (low, high) = (four(a, b), four(c, d));
            std::array::from_fn(|i| {
                F32x8(if i < 4 {
                    _mm256_permute2f128_ps::<0x20>(low[i], high[i])
                } else {
                    _mm256_permute2f128_ps::<0x31>(low[i - 4], high[i - 4])
                })
            })
        }
    }
    #[inline(always)]
    fn empty(self) -> BitSets8 {
        // SAFETY: `self` proves AVX2.
        BitSets8(unsafe { _mm256_setzero_si256() })
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
operator!(Add, add, I32x8, _mm256_add_epi32);
operator!(BitAnd, bitand, Mask8, _mm256_and_ps);
operator!(BitOr, bitor, Mask8, _mm256_or_ps);

impl SimdFloat for F32x8 {
    type Mask = Mask8;
    const N_LANES: usize = LANES;

    #[inline(always)]
    fn splat(self, x: f32) -> Self {
        // SAFETY: `self` proves AVX2.
        Self(unsafe { _mm256_set1_ps(x) })
    }
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
    fn sqrt(self) -> Self {
        // SAFETY: `self` proves AVX2.
        Self(unsafe { _mm256_sqrt_ps(self.0) })
    }
    #[inline(always)]
    fn select(mask: Mask8, a: Self, b: Self) -> Self {
        // SAFETY: `a` proves AVX2.
        Self(unsafe { _mm256_blendv_ps(b.0, a.0, mask.0) })
    }
    #[inline(always)]
    fn each<const M: usize, const N: usize>(
        arguments: [Self; M],
        mut f: impl FnMut([f32; M]) -> [f32; N],
    ) -> [Self; N] {
        const { assert!(M > 0) };
        let mut lanes = [[0.0; LANES]; M];
        for (lanes, argument) in lanes.iter_mut().zip(arguments) {
            *lanes = argument.store();
        }
        let mut values = [[0.0; LANES]; N];
        for lane in 0..LANES {
            for (value, y) in values.iter_mut().zip(f(lanes.map(|x| x[lane]))) {
                value[lane] = y;
            }
        }
        let mut vectors = [arguments[0]; N];
        for (vector, value) in vectors.iter_mut().zip(&values) {
            // SAFETY: the arguments prove AVX2; `value` is 8 readable f32, and the load needs no alignment.
            *vector = Self(unsafe { _mm256_loadu_ps(value.as_ptr()) });
        }
        vectors
    }
}

impl SimdF32x8 for F32x8 {
    type I32x8 = I32x8;
    const FUSES: bool = true;

    #[inline(always)]
    fn mul_sub(self, b: Self, c: Self) -> Self {
        // SAFETY: `self` proves AVX2 and FMA.
        Self(unsafe { _mm256_fmsub_ps(self.0, b.0, c.0) })
    }
    #[inline(always)]
    fn store(self) -> Lanes {
        let mut lanes = [0.0; 8];
        // SAFETY: `self` proves AVX2; `lanes` is 8 writable f32, and the store needs no alignment.
        unsafe { _mm256_storeu_ps(lanes.as_mut_ptr(), self.0) };
        lanes
    }
    #[inline(always)]
    fn to_i32(self) -> I32x8 {
        // SAFETY: `self` proves AVX2.
        I32x8(unsafe { _mm256_cvttps_epi32(self.0) })
    }
    #[inline(always)]
    fn gather<const N: usize>(table: &[Lanes; N], at: I32x8) -> Self {
        // SAFETY: `at` proves AVX2; masked with 8 N − 1 every index is within the 8 N = 2ⁿ⁺³ numbers.
        Self(unsafe {
            let at = _mm256_and_si256(at.0, _mm256_set1_epi32(last_of::<N>() as i32));
            _mm256_i32gather_ps::<4>(table.as_ptr().cast(), at)
        })
    }
}

impl SimdI32x8 for I32x8 {
    type F32x8 = F32x8;

    #[inline(always)]
    fn shl<const N: i32>(self) -> Self {
        // SAFETY: `self` proves AVX2.
        Self(unsafe { _mm256_slli_epi32::<N>(self.0) })
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        // SAFETY: `self` proves AVX2.
        Self(unsafe { _mm256_min_epi32(self.0, b.0) })
    }
    #[inline(always)]
    fn lt(self, b: Self) -> Mask8 {
        // SAFETY: `self` proves AVX2.
        Mask8(unsafe { _mm256_castsi256_ps(_mm256_cmpgt_epi32(b.0, self.0)) })
    }
    #[inline(always)]
    fn to_f32(self) -> F32x8 {
        // SAFETY: `self` proves AVX2.
        F32x8(unsafe { _mm256_cvtepi32_ps(self.0) })
    }
    #[inline(always)]
    fn select(mask: Mask8, a: Self, b: Self) -> Self {
        // SAFETY: `a` proves AVX2.
        Self(unsafe { _mm256_blendv_epi8(b.0, a.0, _mm256_castps_si256(mask.0)) })
    }
    #[inline(always)]
    fn compress(self, keep: Mask8) -> [i32; 8] {
        let lanes = &super::COMPRESSED_LANES[keep.bits() as usize % 256];
        // SAFETY: `self` proves AVX2; `lanes` is 32 readable bytes, the load needs no alignment.
        Self(unsafe {
            let lanes = _mm256_loadu_si256(lanes.as_ptr().cast());
            _mm256_permutevar8x32_epi32(self.0, lanes)
        })
        .store()
    }
    #[inline(always)]
    fn store(self) -> [i32; 8] {
        let mut lanes = [0; 8];
        // SAFETY: `self` proves AVX2; `lanes` is 32 writable bytes, the store needs no alignment.
        unsafe { _mm256_storeu_si256(lanes.as_mut_ptr().cast(), self.0) };
        lanes
    }
}

impl LaneMask for Mask8 {
    #[inline(always)]
    fn bits(self) -> u32 {
        // SAFETY: `self` proves AVX2.
        unsafe { _mm256_movemask_ps(self.0) as u32 }
    }
}

impl SimdBitSets for BitSets8 {
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
    fn pack([a, b]: [Self; 2], numbers: [u32; 8]) -> ([[u32; 8]; 2], [u32; 8], usize) {
        // SAFETY: `a` proves AVX2.
        let not_empty = Self(unsafe { _mm256_or_si256(a.0, b.0) }).not_empty();
        let lanes = &super::COMPRESSED_LANES[not_empty as usize % 256];
        // SAFETY: `a` proves AVX2; both arrays are 32 readable bytes, the loads need no alignment.
        let (pair, numbers) = unsafe {
            let lanes = _mm256_loadu_si256(lanes.as_ptr().cast());
            let numbers = _mm256_loadu_si256(numbers.as_ptr().cast());
            let a = Self(_mm256_permutevar8x32_epi32(a.0, lanes));
            let b = Self(_mm256_permutevar8x32_epi32(b.0, lanes));
            ([a, b], Self(_mm256_permutevar8x32_epi32(numbers, lanes)))
        };
        (pair.map(Self::store), numbers.store(), not_empty.count_ones() as usize)
    }
    #[inline(always)]
    fn store(self) -> [u32; 8] {
        let mut lanes = [0; 8];
        // SAFETY: `self` proves AVX2; `lanes` is 32 writable bytes, the store needs no alignment.
        unsafe { _mm256_storeu_si256(lanes.as_mut_ptr().cast(), self.0) };
        lanes
    }
}
