//! The reference: plain Rust, lane by lane.

use std::array::from_fn;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

use super::pair::Pair;
use super::{
    Kernel, LANES, LaneMask, Lanes, Simd, SimdBitSets, SimdF32x8, SimdFloat, SimdI32x8, last_of,
};

#[derive(Clone, Copy)]
pub(crate) struct Scalar;

#[derive(Clone, Copy)]
pub(crate) struct F32x8(Lanes);

#[derive(Clone, Copy)]
pub(crate) struct I32x8([i32; 8]);

#[derive(Clone, Copy)]
pub(crate) struct Mask8([bool; 8]);

#[derive(Clone, Copy)]
pub(crate) struct BitSets8([u32; 8]);

impl Scalar {
    /// Runs the kernel in a function of its own: without optimization, its variables would fill the stack of every
    /// instruction set's caller.
    #[inline]
    pub(crate) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        kernel.run(self)
    }
}

impl Simd for Scalar {
    type F32x8 = F32x8;
    type I32x8 = I32x8;
    type F32x16 = Pair<F32x8>;
    type BitSets = BitSets8;

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
    fn splat_i32(self, x: i32) -> I32x8 {
        I32x8([x; 8])
    }
    #[inline(always)]
    fn load_i32(self, x: &[i32; LANES]) -> I32x8 {
        I32x8(*x)
    }
    #[inline(always)]
    fn iota(self) -> I32x8 {
        I32x8([0, 1, 2, 3, 4, 5, 6, 7])
    }
    #[inline(always)]
    fn empty(self) -> BitSets8 {
        BitSets8([0; 8])
    }
    #[inline(always)]
    fn transpose(self, rows: [&Lanes; LANES]) -> [F32x8; LANES] {
        from_fn(|column| F32x8(rows.map(|row| row[column])))
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

impl SimdFloat for F32x8 {
    type Mask = Mask8;
    const N_LANES: usize = LANES;

    #[inline(always)]
    fn splat(self, x: f32) -> Self {
        Self([x; 8])
    }
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
    fn sqrt(self) -> Self {
        Self(self.0.map(f32::sqrt))
    }
    #[inline(always)]
    fn select(mask: Mask8, a: Self, b: Self) -> Self {
        Self(from_fn(|i| if mask.0[i] { a.0[i] } else { b.0[i] }))
    }
    #[inline(always)]
    fn each<const M: usize, const N: usize>(
        arguments: [Self; M],
        mut f: impl FnMut([f32; M]) -> [f32; N],
    ) -> [Self; N] {
        let mut values = [[0.0; LANES]; N];
        for lane in 0..LANES {
            for (value, y) in values.iter_mut().zip(f(arguments.map(|x| x.0[lane]))) {
                value[lane] = y;
            }
        }
        values.map(Self)
    }
}

impl SimdF32x8 for F32x8 {
    type I32x8 = I32x8;
    const FUSES: bool = false;

    #[inline(always)]
    fn mul_sub(self, b: Self, c: Self) -> Self {
        Self(from_fn(|i| {
            let [a, b, c] = [self.0[i], b.0[i], c.0[i]].map(f64::from);
            (a * b - c) as f32
        }))
    }
    #[inline(always)]
    fn store(self) -> Lanes {
        self.0
    }
    #[inline(always)]
    fn to_i32(self) -> I32x8 {
        I32x8(self.0.map(|x| x as i32))
    }
    #[inline(always)]
    fn gather<const N: usize>(table: &[Lanes; N], at: I32x8) -> Self {
        Self(at.0.map(|i| {
            let i = i as usize & last_of::<N>();
            table[i / LANES][i % LANES]
        }))
    }
}

impl Add for I32x8 {
    type Output = Self;

    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self(from_fn(|i| self.0[i].wrapping_add(b.0[i])))
    }
}

impl SimdI32x8 for I32x8 {
    type F32x8 = F32x8;

    #[inline(always)]
    fn shl<const N: i32>(self) -> Self {
        Self(self.0.map(|x| x << N))
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        Self(from_fn(|i| self.0[i].min(b.0[i])))
    }
    #[inline(always)]
    fn lt(self, b: Self) -> Mask8 {
        Mask8(from_fn(|i| self.0[i] < b.0[i]))
    }
    #[inline(always)]
    fn to_f32(self) -> F32x8 {
        F32x8(self.0.map(|x| x as f32))
    }
    #[inline(always)]
    fn select(mask: Mask8, a: Self, b: Self) -> Self {
        Self(from_fn(|i| if mask.0[i] { a.0[i] } else { b.0[i] }))
    }
    #[inline(always)]
    fn compress(self, keep: Mask8) -> [i32; 8] {
        super::compress(self.store(), keep.bits())
    }
    #[inline(always)]
    fn store(self) -> [i32; 8] {
        self.0
    }
}

impl LaneMask for Mask8 {
    #[inline(always)]
    fn bits(self) -> u32 {
        (0..8).fold(0, |bits, i| bits | u32::from(self.0[i]) << i)
    }
}

impl SimdBitSets for BitSets8 {
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
    fn pack(pair: [Self; 2], numbers: [u32; 8]) -> ([[u32; 8]; 2], [u32; 8], usize) {
        super::pack(pair.map(Self::store), numbers)
    }
    #[inline(always)]
    fn store(self) -> [u32; 8] {
        self.0
    }
}
