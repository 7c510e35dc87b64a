//! x86-64 AVX-512: comparisons write mask registers, and there are twice as many registers, each with room for sixteen
//! numbers.
#![allow(unsafe_code)]
#![allow(clippy::wildcard_imports)] // The intrinsics' names are distinctive enough.

use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

use super::{
    Kernel, LANES, LaneMask, Lanes, Simd, SimdBitSets, SimdF32x8, SimdF32x16, SimdFloat, SimdI32x8,
    last_of,
};

/// Proof that the processor has AVX-512 F and VL, FMA and the bit instructions introduced with AVX2.
#[derive(Clone, Copy)]
pub(crate) struct Avx512(());

/// Made only by an [`Avx512`], so it proves the same.
#[derive(Clone, Copy)]
pub(crate) struct F32x8(__m256);

/// Made only by an [`Avx512`], so it proves the same.
#[derive(Clone, Copy)]
pub(crate) struct I32x8(__m256i);

/// Made only by an [`Avx512`], so it proves the same.
#[derive(Clone, Copy)]
pub(crate) struct F32x16(__m512);

/// A bit a lane.
#[derive(Clone, Copy)]
pub(crate) struct Mask8(__mmask8);

/// A bit a lane.
#[derive(Clone, Copy)]
pub(crate) struct Mask16(__mmask16);

/// Made only by an [`Avx512`], so it proves the same.
#[derive(Clone, Copy)]
pub(crate) struct BitSets8(__m256i);

impl Avx512 {
    #[inline]
    pub(crate) fn new() -> Option<Self> {
        let available = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt");
        available.then_some(Self(()))
    }

    #[inline]
    pub(crate) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[target_feature(enable = "avx512f,avx512vl,fma,bmi1,bmi2,lzcnt,popcnt")]
        fn run<K: Kernel>(simd: Avx512, kernel: K) -> K::Output {
            kernel.run(simd)
        }
        // SAFETY: `self` proves the features that `run` enables.
        unsafe { run(self, kernel) }
    }
}

impl Simd for Avx512 {
    type F32x8 = F32x8;
    type I32x8 = I32x8;
    type F32x16 = F32x16;
    type BitSets = BitSets8;

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
    fn splat_i32(self, x: i32) -> I32x8 {
        // SAFETY: `self` proves AVX-512.
        I32x8(unsafe { _mm256_set1_epi32(x) })
    }
    #[inline(always)]
    fn load_i32(self, x: &[i32; LANES]) -> I32x8 {
        // SAFETY: `self` proves AVX-512; `x` is 32 readable bytes, and the load needs no alignment.
        I32x8(unsafe { _mm256_loadu_si256(x.as_ptr().cast()) })
    }
    #[inline(always)]
    fn iota(self) -> I32x8 {
        // SAFETY: `self` proves AVX-512.
        I32x8(unsafe { _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7) })
    }
    #[inline(always)]
    fn transpose(self, rows: [&Lanes; LANES]) -> [F32x8; LANES] {
        let mut r = [self.load(rows[0]).0; LANES];
        for (r, row) in r.iter_mut().zip(rows) {
            *r = self.load(row).0;
        }
        // SAFETY: `self` proves AVX-512.
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
        // SAFETY: `self` proves AVX-512.
        BitSets8(unsafe { _mm256_setzero_si256() })
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
operator!(Add, add, I32x8, _mm256_add_epi32);
operator!(Add, add, F32x16, _mm512_add_ps);
operator!(Sub, sub, F32x16, _mm512_sub_ps);
operator!(Mul, mul, F32x16, _mm512_mul_ps);
operator!(Div, div, F32x16, _mm512_div_ps);

macro_rules! mask {
    ($mask:ident) => {
        impl BitAnd for $mask {
            type Output = Self;

            #[inline(always)]
            fn bitand(self, b: Self) -> Self {
                Self(self.0 & b.0)
            }
        }

        impl BitOr for $mask {
            type Output = Self;

            #[inline(always)]
            fn bitor(self, b: Self) -> Self {
                Self(self.0 | b.0)
            }
        }

        impl LaneMask for $mask {
            #[inline(always)]
            fn bits(self) -> u32 {
                u32::from(self.0)
            }
        }
    };
}
mask!(Mask8);
mask!(Mask16);

macro_rules! real {
    ($type:ident, $mask:ident, $set1:ident, $min:ident, $max:ident, $cmp:ident, $sqrt:ident, $blend:ident, $loadu:ident) => {
        impl SimdFloat for $type {
            type Mask = $mask;
            const N_LANES: usize = size_of::<$type>() / size_of::<f32>();

            #[inline(always)]
            fn splat(self, x: f32) -> Self {
                // SAFETY: `self` proves AVX-512.
                Self(unsafe { $set1(x) })
            }
            #[inline(always)]
            fn min(self, b: Self) -> Self {
                // SAFETY: `self` proves AVX-512.
                Self(unsafe { $min(self.0, b.0) })
            }
            #[inline(always)]
            fn max(self, b: Self) -> Self {
                // SAFETY: `self` proves AVX-512.
                Self(unsafe { $max(self.0, b.0) })
            }
            #[inline(always)]
            fn le(self, b: Self) -> $mask {
                // SAFETY: `self` proves AVX-512.
                $mask(unsafe { $cmp::<_CMP_LE_OQ>(self.0, b.0) })
            }
            #[inline(always)]
            fn lt(self, b: Self) -> $mask {
                // SAFETY: `self` proves AVX-512.
                $mask(unsafe { $cmp::<_CMP_LT_OQ>(self.0, b.0) })
            }
            #[inline(always)]
            fn eq(self, b: Self) -> $mask {
                // SAFETY: `self` proves AVX-512.
                $mask(unsafe { $cmp::<_CMP_EQ_OQ>(self.0, b.0) })
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                // SAFETY: `self` proves AVX-512.
                Self(unsafe { $sqrt(self.0) })
            }
            #[inline(always)]
            fn select(mask: $mask, a: Self, b: Self) -> Self {
                // SAFETY: `a` proves AVX-512.
                Self(unsafe { $blend(mask.0, b.0, a.0) })
            }
            #[inline(always)]
            fn each<const M: usize, const N: usize>(
                arguments: [Self; M],
                mut f: impl FnMut([f32; M]) -> [f32; N],
            ) -> [Self; N] {
                const { assert!(M > 0) };
                let mut lanes = [arguments[0].to_array(); M];
                for (lanes, argument) in lanes.iter_mut().zip(arguments) {
                    *lanes = argument.to_array();
                }
                let mut values = [arguments[0].to_array(); N];
                for lane in 0..values[0].len() {
                    for (value, y) in values.iter_mut().zip(f(lanes.map(|x| x[lane]))) {
                        value[lane] = y;
                    }
                }
                let mut vectors = [arguments[0]; N];
                for (vector, value) in vectors.iter_mut().zip(&values) {
                    // SAFETY: the arguments prove AVX-512; `value` has as many readable f32 as a vector, and the load
                    // needs no alignment.
                    *vector = Self(unsafe { $loadu(value.as_ptr()) });
                }
                vectors
            }
        }
    };
}
real!(
    F32x8,
    Mask8,
    _mm256_set1_ps,
    _mm256_min_ps,
    _mm256_max_ps,
    _mm256_cmp_ps_mask,
    _mm256_sqrt_ps,
    _mm256_mask_blend_ps,
    _mm256_loadu_ps
);
real!(
    F32x16,
    Mask16,
    _mm512_set1_ps,
    _mm512_min_ps,
    _mm512_max_ps,
    _mm512_cmp_ps_mask,
    _mm512_sqrt_ps,
    _mm512_mask_blend_ps,
    _mm512_loadu_ps
);

impl F32x8 {
    #[inline(always)]
    fn to_array(self) -> Lanes {
        let mut lanes = [0.0; 8];
        // SAFETY: `self` proves AVX-512; `lanes` is 8 writable f32, and the store needs no alignment.
        unsafe { _mm256_storeu_ps(lanes.as_mut_ptr(), self.0) };
        lanes
    }
}

impl F32x16 {
    #[inline(always)]
    fn to_array(self) -> [f32; 16] {
        let mut lanes = [0.0; 16];
        // SAFETY: `self` proves AVX-512; `lanes` is 16 writable f32, and the store needs no alignment.
        unsafe { _mm512_storeu_ps(lanes.as_mut_ptr(), self.0) };
        lanes
    }
}

impl SimdF32x16 for F32x16 {
    type Half = F32x8;

    #[inline(always)]
    fn of([low, high]: [F32x8; 2]) -> Self {
        // SAFETY: `low` proves AVX-512.
        Self(unsafe {
            let low = _mm512_castpd256_pd512(_mm256_castps_pd(low.0));
            _mm512_castpd_ps(_mm512_insertf64x4::<1>(low, _mm256_castps_pd(high.0)))
        })
    }
    #[inline(always)]
    fn store(self) -> [Lanes; 2] {
        let mut lanes = [[0.0; 8]; 2];
        // SAFETY: `self` proves AVX-512; `lanes` is 16 writable f32, and the store needs no alignment.
        unsafe { _mm512_storeu_ps(lanes.as_mut_ptr().cast(), self.0) };
        lanes
    }
    #[inline(always)]
    fn folded(self) -> F32x8 {
        // SAFETY: `self` proves AVX-512.
        F32x8(unsafe {
            let high = _mm512_extractf64x4_pd::<1>(_mm512_castps_pd(self.0));
            _mm256_add_ps(_mm512_castps512_ps256(self.0), _mm256_castpd_ps(high))
        })
    }
}

impl SimdF32x8 for F32x8 {
    type I32x8 = I32x8;
    const FUSES: bool = true;

    #[inline(always)]
    fn mul_sub(self, b: Self, c: Self) -> Self {
        // SAFETY: `self` proves AVX-512.
        Self(unsafe { _mm256_fmsub_ps(self.0, b.0, c.0) })
    }

    #[inline(always)]
    fn store(self) -> Lanes {
        self.to_array()
    }
    #[inline(always)]
    fn to_i32(self) -> I32x8 {
        // SAFETY: `self` proves AVX-512.
        I32x8(unsafe { _mm256_cvttps_epi32(self.0) })
    }
    #[inline(always)]
    fn gather<const N: usize>(table: &[Lanes; N], at: I32x8) -> Self {
        // SAFETY: `at` proves AVX-512; masked with 8 N − 1 every index is within the 8 N = 2ⁿ⁺³ numbers.
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
        // SAFETY: `self` proves AVX-512.
        Self(unsafe { _mm256_slli_epi32::<N>(self.0) })
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        // SAFETY: `self` proves AVX-512.
        Self(unsafe { _mm256_min_epi32(self.0, b.0) })
    }
    #[inline(always)]
    fn lt(self, b: Self) -> Mask8 {
        // SAFETY: `self` proves AVX-512.
        Mask8(unsafe { _mm256_cmplt_epi32_mask(self.0, b.0) })
    }
    #[inline(always)]
    fn to_f32(self) -> F32x8 {
        // SAFETY: `self` proves AVX-512.
        F32x8(unsafe { _mm256_cvtepi32_ps(self.0) })
    }
    #[inline(always)]
    fn select(mask: Mask8, a: Self, b: Self) -> Self {
        // SAFETY: `a` proves AVX-512.
        Self(unsafe { _mm256_mask_blend_epi32(mask.0, b.0, a.0) })
    }
    #[inline(always)]
    fn compress(self, keep: Mask8) -> [i32; 8] {
        // SAFETY: `self` proves AVX-512.
        Self(unsafe { _mm256_maskz_compress_epi32(keep.0, self.0) }).store()
    }
    #[inline(always)]
    fn store(self) -> [i32; 8] {
        let mut lanes = [0; 8];
        // SAFETY: `self` proves AVX-512; `lanes` is 32 writable bytes, the store needs no alignment.
        unsafe { _mm256_storeu_si256(lanes.as_mut_ptr().cast(), self.0) };
        lanes
    }
}

impl SimdBitSets for BitSets8 {
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
    fn pack([a, b]: [Self; 2], numbers: [u32; 8]) -> ([[u32; 8]; 2], [u32; 8], usize) {
        // SAFETY: `a` proves AVX-512; `numbers` is 32 readable bytes, the load needs no alignment.
        let (pair, numbers, not_empty) = unsafe {
            let any = _mm256_or_si256(a.0, b.0);
            let not_empty = _mm256_test_epi32_mask(any, any);
            let numbers = _mm256_loadu_si256(numbers.as_ptr().cast());
            let a = Self(_mm256_maskz_compress_epi32(not_empty, a.0));
            let b = Self(_mm256_maskz_compress_epi32(not_empty, b.0));
            ([a, b], Self(_mm256_maskz_compress_epi32(not_empty, numbers)), not_empty)
        };
        (pair.map(Self::store), numbers.store(), not_empty.count_ones() as usize)
    }
    #[inline(always)]
    fn store(self) -> [u32; 8] {
        let mut lanes = [0; 8];
        // SAFETY: `self` proves AVX-512; `lanes` is 32 writable bytes, the store needs no alignment.
        unsafe { _mm256_storeu_si256(lanes.as_mut_ptr().cast(), self.0) };
        lanes
    }
}
