//! WebAssembly SIMD: a vector is two registers of four. The instructions are a property of the module, so there is no
//! run-time check, and the intrinsics are safe, except for loads. Vectors are loaded whole: compilers otherwise load the
//! lanes one by one where only some are used together.
#![allow(unsafe_code)]

use std::arch::wasm32::{
    f32x4_add, f32x4_convert_i32x4, f32x4_demote_f64x2_zero, f32x4_div, f32x4_eq,
    f32x4_extract_lane, f32x4_le, f32x4_lt, f32x4_mul, f32x4_pmax, f32x4_pmin, f32x4_splat,
    f32x4_sqrt, f32x4_sub, f64x2_mul, f64x2_promote_low_f32x4, f64x2_sub, i32x4, i32x4_add,
    i32x4_bitmask, i32x4_eq, i32x4_extract_lane, i32x4_lt, i32x4_min, i32x4_shl, i32x4_shuffle,
    i32x4_splat, i32x4_trunc_sat_f32x4, i64x2_shuffle, u8x16, u8x16_add, u8x16_splat, u8x16_sub,
    u8x16_swizzle, u32x4, u32x4_splat, v128, v128_and, v128_bitselect, v128_load, v128_not,
    v128_or,
};
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

use super::pair::Pair;
use super::{LANES, LaneMask, Lanes, Simd, SimdBitSets, SimdF32x8, SimdFloat, SimdI32x8, last_of};

#[derive(Clone, Copy)]
pub(crate) struct Simd128;

#[derive(Clone, Copy)]
pub(crate) struct F32x8(v128, v128);

#[derive(Clone, Copy)]
pub(crate) struct I32x8(v128, v128);

/// A lane has all bits set or none.
#[derive(Clone, Copy)]
pub(crate) struct Mask8(v128, v128);

#[derive(Clone, Copy)]
pub(crate) struct BitSets8(v128, v128);

/// The lanes of two integer registers.
#[inline(always)]
fn lanes(a: v128, b: v128) -> [i32; LANES] {
    [
        i32x4_extract_lane::<0>(a),
        i32x4_extract_lane::<1>(a),
        i32x4_extract_lane::<2>(a),
        i32x4_extract_lane::<3>(a),
        i32x4_extract_lane::<0>(b),
        i32x4_extract_lane::<1>(b),
        i32x4_extract_lane::<2>(b),
        i32x4_extract_lane::<3>(b),
    ]
}

/// Transposes four rows of four numbers.
#[inline(always)]
fn transpose([a, b, c, d]: [v128; 4]) -> [v128; 4] {
    let [ab_low, cd_low] = [(a, b), (c, d)].map(|(x, y)| i32x4_shuffle::<0, 4, 1, 5>(x, y));
    let [ab_high, cd_high] = [(a, b), (c, d)].map(|(x, y)| i32x4_shuffle::<2, 6, 3, 7>(x, y));
    [
        i64x2_shuffle::<0, 2>(ab_low, cd_low),
        i64x2_shuffle::<1, 3>(ab_low, cd_low),
        i64x2_shuffle::<0, 2>(ab_high, cd_high),
        i64x2_shuffle::<1, 3>(ab_high, cd_high),
    ]
}

/// Moves lanes to the front.
#[derive(Clone, Copy)]
struct Compression {
    /// For each register, the bytes of the kept lanes, in order; zeros follow.
    low: v128,
    high: v128,
    /// The same, moved up by the number of lanes kept of the lower register, and what is moved out of that register.
    up: v128,
    down: v128,
    count: usize,
}

impl Compression {
    /// `keep` is a set of lanes.
    #[inline(always)]
    fn of(keep: u32) -> Self {
        /// The bytes of the lanes in each set of four; 255 selects a zero.
        const FRONT: [[u8; 16]; 16] = {
            let mut table = [[255; 16]; 16];
            let mut set = 0;
            while set < 16 {
                let (mut byte, mut len) = (0, 0);
                while byte < 16 {
                    if set >> (byte / 4) & 1 == 1 {
                        table[set][len] = byte as u8;
                        len += 1;
                    }
                    byte += 1;
                }
                set += 1;
            }
            table
        };
        let [low, high] = [keep & 15, keep >> 4 & 15].map(|set| bytes(&FRONT[set as usize]));
        let shift = 4 * (keep & 15).count_ones() as u8;
        let iota = u8x16(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
        // Indices below 0 wrap around, so they also select zeros.
        let up = u8x16_sub(iota, u8x16_splat(shift));
        let down = u8x16_add(iota, u8x16_splat(16 - shift));
        Self { low, high, up, down, count: keep.count_ones() as usize }
    }

    #[inline(always)]
    fn apply(self, [a, b]: [v128; 2]) -> [v128; 2] {
        let (a, b) = (u8x16_swizzle(a, self.low), u8x16_swizzle(b, self.high));
        [v128_or(a, u8x16_swizzle(b, self.up)), u8x16_swizzle(b, self.down)]
    }
}

/// Loads sixteen bytes.
#[inline(always)]
fn bytes(x: &[u8; 16]) -> v128 {
    // SAFETY: sixteen bytes are a register, and `v128_load` needs no alignment.
    unsafe { v128_load(x.as_ptr().cast()) }
}

impl Simd for Simd128 {
    type F32x8 = F32x8;
    type I32x8 = I32x8;
    type F32x16 = Pair<F32x8>;
    type BitSets = BitSets8;

    #[inline(always)]
    fn splat(self, x: f32) -> F32x8 {
        F32x8(f32x4_splat(x), f32x4_splat(x))
    }
    #[inline(always)]
    fn load(self, x: &Lanes) -> F32x8 {
        let halves: *const v128 = x.as_ptr().cast();
        // SAFETY: eight numbers are two registers of four, and `v128_load` needs no alignment.
        unsafe { F32x8(v128_load(halves), v128_load(halves.add(1))) }
    }
    #[inline(always)]
    fn prefetch<T>(self, _: &T) {}
    #[inline(always)]
    fn splat_i32(self, x: i32) -> I32x8 {
        I32x8(i32x4_splat(x), i32x4_splat(x))
    }
    #[inline(always)]
    fn load_i32(self, x: &[i32; LANES]) -> I32x8 {
        I32x8(i32x4(x[0], x[1], x[2], x[3]), i32x4(x[4], x[5], x[6], x[7]))
    }
    #[inline(always)]
    fn iota(self) -> I32x8 {
        I32x8(i32x4(0, 1, 2, 3), i32x4(4, 5, 6, 7))
    }
    #[inline(always)]
    fn empty(self) -> BitSets8 {
        BitSets8(u32x4_splat(0), u32x4_splat(0))
    }
    #[inline(always)]
    fn transpose(self, rows: [&Lanes; LANES]) -> [F32x8; LANES] {
        let [a, b, c, d, e, f, g, h] = rows.map(|row| self.load(row));
        let [upper_left, lower_left] =
            [[a, b, c, d], [e, f, g, h]].map(|rows| transpose(rows.map(|row| row.0)));
        let [upper_right, lower_right] =
            [[a, b, c, d], [e, f, g, h]].map(|rows| transpose(rows.map(|row| row.1)));
        std::array::from_fn(|i| match i {
            0..4 => F32x8(upper_left[i], lower_left[i]),
            _ => F32x8(upper_right[i - 4], lower_right[i - 4]),
        })
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident, $type:ident, $intrinsic:ident) => {
        impl $trait for $type {
            type Output = Self;

            #[inline(always)]
            fn $method(self, b: Self) -> Self {
                Self($intrinsic(self.0, b.0), $intrinsic(self.1, b.1))
            }
        }
    };
}
operator!(Add, add, F32x8, f32x4_add);
operator!(Sub, sub, F32x8, f32x4_sub);
operator!(Mul, mul, F32x8, f32x4_mul);
operator!(Div, div, F32x8, f32x4_div);
operator!(Add, add, I32x8, i32x4_add);
operator!(BitAnd, bitand, Mask8, v128_and);
operator!(BitOr, bitor, Mask8, v128_or);

impl SimdFloat for F32x8 {
    type Mask = Mask8;
    const N_LANES: usize = LANES;

    #[inline(always)]
    fn splat(self, x: f32) -> Self {
        Simd128.splat(x)
    }

    // The pseudo-minimum of x and y is y < x ? y : x.
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        Self(f32x4_pmin(b.0, self.0), f32x4_pmin(b.1, self.1))
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        Self(f32x4_pmax(b.0, self.0), f32x4_pmax(b.1, self.1))
    }
    #[inline(always)]
    fn le(self, b: Self) -> Mask8 {
        Mask8(f32x4_le(self.0, b.0), f32x4_le(self.1, b.1))
    }
    #[inline(always)]
    fn lt(self, b: Self) -> Mask8 {
        Mask8(f32x4_lt(self.0, b.0), f32x4_lt(self.1, b.1))
    }
    #[inline(always)]
    fn eq(self, b: Self) -> Mask8 {
        Mask8(f32x4_eq(self.0, b.0), f32x4_eq(self.1, b.1))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(f32x4_sqrt(self.0), f32x4_sqrt(self.1))
    }
    #[inline(always)]
    fn select(m: Mask8, a: Self, b: Self) -> Self {
        Self(v128_bitselect(a.0, b.0, m.0), v128_bitselect(a.1, b.1, m.1))
    }
    #[inline(always)]
    fn each<const M: usize, const N: usize>(
        arguments: [Self; M],
        mut f: impl FnMut([f32; M]) -> [f32; N],
    ) -> [Self; N] {
        let arguments = arguments.map(Self::store);
        let mut values = [[0.0; LANES]; N];
        for lane in 0..LANES {
            for (value, y) in values.iter_mut().zip(f(arguments.map(|x| x[lane]))) {
                value[lane] = y;
            }
        }
        values.map(|value| Simd128.load(&value))
    }
}

/// a b − c with an exact product, for the first two lanes.
#[inline(always)]
fn mul_sub_low(a: v128, b: v128, c: v128) -> v128 {
    let [a, b, c] = [a, b, c].map(|x| f64x2_promote_low_f32x4(x));
    f32x4_demote_f64x2_zero(f64x2_sub(f64x2_mul(a, b), c))
}

/// The same for all four lanes.
#[inline(always)]
fn mul_sub(a: v128, b: v128, c: v128) -> v128 {
    let low = mul_sub_low(a, b, c);
    let [a, b, c] = [a, b, c].map(|x| i32x4_shuffle::<2, 3, 2, 3>(x, x));
    i32x4_shuffle::<0, 1, 4, 5>(low, mul_sub_low(a, b, c))
}

impl SimdF32x8 for F32x8 {
    type I32x8 = I32x8;
    const FUSES: bool = false;

    #[inline(always)]
    fn mul_sub(self, b: Self, c: Self) -> Self {
        Self(mul_sub(self.0, b.0, c.0), mul_sub(self.1, b.1, c.1))
    }
    #[inline(always)]
    fn store(self) -> Lanes {
        [
            f32x4_extract_lane::<0>(self.0),
            f32x4_extract_lane::<1>(self.0),
            f32x4_extract_lane::<2>(self.0),
            f32x4_extract_lane::<3>(self.0),
            f32x4_extract_lane::<0>(self.1),
            f32x4_extract_lane::<1>(self.1),
            f32x4_extract_lane::<2>(self.1),
            f32x4_extract_lane::<3>(self.1),
        ]
    }
    #[inline(always)]
    fn to_i32(self) -> I32x8 {
        I32x8(i32x4_trunc_sat_f32x4(self.0), i32x4_trunc_sat_f32x4(self.1))
    }
    #[inline(always)]
    fn gather<const N: usize>(table: &[Lanes; N], at: I32x8) -> Self {
        let lanes = at.store().map(|i| {
            let i = i as usize & last_of::<N>();
            table[i / LANES][i % LANES]
        });
        Simd128.load(&lanes)
    }
}

impl SimdI32x8 for I32x8 {
    type F32x8 = F32x8;

    #[inline(always)]
    fn shl<const N: i32>(self) -> Self {
        Self(i32x4_shl(self.0, N as u32), i32x4_shl(self.1, N as u32))
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        Self(i32x4_min(self.0, b.0), i32x4_min(self.1, b.1))
    }
    #[inline(always)]
    fn lt(self, b: Self) -> Mask8 {
        Mask8(i32x4_lt(self.0, b.0), i32x4_lt(self.1, b.1))
    }
    #[inline(always)]
    fn to_f32(self) -> F32x8 {
        F32x8(f32x4_convert_i32x4(self.0), f32x4_convert_i32x4(self.1))
    }
    #[inline(always)]
    fn select(m: Mask8, a: Self, b: Self) -> Self {
        Self(v128_bitselect(a.0, b.0, m.0), v128_bitselect(a.1, b.1, m.1))
    }
    #[inline(always)]
    fn compress(self, keep: Mask8) -> [i32; 8] {
        let [low, high] = Compression::of(keep.bits()).apply([self.0, self.1]);
        lanes(low, high)
    }
    #[inline(always)]
    fn store(self) -> [i32; 8] {
        lanes(self.0, self.1)
    }
}

impl LaneMask for Mask8 {
    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(i32x4_bitmask(self.0)) | u32::from(i32x4_bitmask(self.1)) << 4
    }
}

impl SimdBitSets for BitSets8 {
    type Mask = Mask8;

    #[inline(always)]
    fn insert(self, m: Mask8, bit: u32) -> Self {
        let bit = u32x4_splat(bit);
        Self(v128_or(self.0, v128_and(m.0, bit)), v128_or(self.1, v128_and(m.1, bit)))
    }
    #[inline(always)]
    fn not_empty(self) -> u32 {
        let is_set = |x| v128_not(i32x4_eq(x, i32x4_splat(0)));
        Mask8(is_set(self.0), is_set(self.1)).bits()
    }
    #[inline(always)]
    fn pack([a, b]: [Self; 2], numbers: [u32; 8]) -> ([[u32; 8]; 2], [u32; 8], usize) {
        let not_empty = Self(v128_or(a.0, b.0), v128_or(a.1, b.1)).not_empty();
        let compression = Compression::of(not_empty);
        let compressed = |x: Self| {
            let [low, high] = compression.apply([x.0, x.1]);
            Self(low, high).store()
        };
        let [n0, n1, n2, n3, n4, n5, n6, n7] = numbers;
        let numbers = Self(u32x4(n0, n1, n2, n3), u32x4(n4, n5, n6, n7));
        ([compressed(a), compressed(b)], compressed(numbers), compression.count)
    }
    #[inline(always)]
    fn store(self) -> [u32; 8] {
        lanes(self.0, self.1).map(|x| x as u32)
    }
}
