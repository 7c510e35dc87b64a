//! Vectors of eight and sixteen numbers for each instruction set, with the only unsafe code of the library.
//!
//! A [`Kernel`] is written once over the vectors of a [`Simd`], whose operators are one IEEE
//! operation per lane. Nothing fuses or reorders them, so a kernel gives the same bits on every instruction set; only
//! [`SimdF32x8::mul_sub`] may differ. [`dispatch`] compiles a kernel for each instruction set and picks one at run
//! time, so that a portable binary traces as fast as one built for the machine. Another instruction set takes one
//! file like `avx2.rs`, or like `neon.rs` for half the width, and one line each in [`InstructionSet`] and [`dispatch`].
//!
//! Formulas are written over [`SimdFloat`], a scalar or a vector.
#![cfg_attr(not(feature = "render"), allow(dead_code))] // Some of it serves only rays.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
#[cfg(any(target_arch = "aarch64", test))]
mod neon;
#[cfg(all(test, not(target_arch = "aarch64")))]
mod neon_model;
mod pair;
mod scalar;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
mod simd128;
mod single;
mod vector;

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

pub(crate) use vector::{Colors, Vectors};

/// The number of lanes in a vector.
pub(crate) const LANES: usize = 8;

/// One number per lane.
pub(crate) type Lanes = [f32; LANES];

/// An instruction set for tracing rays and evaluating light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// Scalar code, the reference, available on every processor.
    Scalar,
    /// WebAssembly SIMD: four numbers at a time, in modules compiled for it.
    Simd128,
    /// AArch64 NEON: four numbers at a time.
    Neon,
    /// x86-64 AVX2 and FMA: eight numbers at a time.
    Avx2,
    /// x86-64 AVX-512: eight or sixteen numbers at a time, with masks.
    Avx512,
}

impl InstructionSet {
    /// All instruction sets that this version supports, the fastest last.
    pub const ALL: [Self; 5] = [Self::Scalar, Self::Simd128, Self::Neon, Self::Avx2, Self::Avx512];

    /// Whether this processor has the instructions.
    pub fn is_available(self) -> bool {
        match self {
            Self::Scalar => true,
            Self::Simd128 => cfg!(all(target_arch = "wasm32", target_feature = "simd128")),
            #[cfg(any(target_arch = "aarch64", test))]
            Self::Neon => neon::Neon::new().is_some(),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => avx2::Avx2::new().is_some(),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => avx512::Avx512::new().is_some(),
            #[cfg(not(any(target_arch = "aarch64", test)))]
            Self::Neon => false,
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 | Self::Avx512 => false,
        }
    }

    /// The fastest instruction set of this processor.
    pub fn best() -> Self {
        Self::ALL.into_iter().rfind(|i| i.is_available()).unwrap_or(Self::Scalar)
    }
}

/// Code that is compiled for each instruction set.
///
/// `run` and everything below it that handles vectors must be `#[inline(always)]` functions: code that is not inlined
/// is compiled without the instructions and is slow, as are closures over vectors.
pub(crate) trait Kernel {
    type Output;
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// Runs the kernel with the given instructions, or the scalar ones if the processor lacks them.
#[inline]
pub(crate) fn dispatch<K: Kernel>(instruction_set: InstructionSet, kernel: K) -> K::Output {
    match instruction_set {
        #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
        InstructionSet::Simd128 => return kernel.run(simd128::Simd128),
        #[cfg(any(target_arch = "aarch64", test))]
        InstructionSet::Neon => {
            if let Some(simd) = neon::Neon::new() {
                return simd.run(kernel);
            }
        }
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => {
            if let Some(simd) = avx2::Avx2::new() {
                return simd.run(kernel);
            }
        }
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 => {
            if let Some(simd) = avx512::Avx512::new() {
                return simd.run(kernel);
            }
        }
        _ => {}
    }
    scalar::Scalar.run(kernel)
}

/// An instruction set. Any value of this type, and any vector created with it, proves that the processor has the
/// instructions.
pub(crate) trait Simd: Copy {
    type F32x8: SimdF32x8<I32x8 = Self::I32x8>;
    type I32x8: SimdI32x8<F32x8 = Self::F32x8>;
    type F32x16: SimdF32x16<Half = Self::F32x8>;
    type BitSets: SimdBitSets<Mask = <Self::F32x8 as SimdFloat>::Mask>;

    fn splat(self, x: f32) -> Self::F32x8;
    fn load(self, x: &Lanes) -> Self::F32x8;
    /// Prefetches memory that will be read soon.
    fn prefetch<T>(self, x: &T);
    fn splat_i32(self, x: i32) -> Self::I32x8;
    fn load_i32(self, x: &[i32; LANES]) -> Self::I32x8;
    /// 0, 1, … 7.
    fn iota(self) -> Self::I32x8;
    /// Eight empty bit sets.
    fn empty(self) -> Self::BitSets;
    /// Component j of eight rows, for each j.
    fn transpose(self, rows: [&Lanes; LANES]) -> [Self::F32x8; LANES];

    /// `x` in all sixteen lanes.
    #[inline(always)]
    fn splat_f32x16(self, x: f32) -> Self::F32x16 {
        SimdF32x16::of([self.splat(x), self.splat(x)])
    }
    #[inline(always)]
    fn load_f32x16(self, [first, others]: [&Lanes; 2]) -> Self::F32x16 {
        SimdF32x16::of([self.load(first), self.load(others)])
    }
}

/// A scalar or a vector, so that formulas are written once for both.
pub trait SimdFloat:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    type Mask: LaneMask;
    /// The number of lanes.
    const N_LANES: usize;

    /// `x` in every lane.
    fn splat(self, x: f32) -> Self;
    /// self < b ? self : b; hence b if either is NaN.
    fn min(self, b: Self) -> Self;
    /// self > b ? self : b; hence b if either is NaN.
    fn max(self, b: Self) -> Self;
    /// self ≤ b; false if either is NaN.
    fn le(self, b: Self) -> Self::Mask;
    /// self < b; false if either is NaN.
    fn lt(self, b: Self) -> Self::Mask;
    /// self = b; false if either is NaN.
    fn eq(self, b: Self) -> Self::Mask;
    fn sqrt(self) -> Self;
    /// mask ? a : b.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// Applies a function of M numbers lane by lane, for operations without an instruction.
    fn each<const M: usize, const N: usize>(
        arguments: [Self; M],
        f: impl FnMut([f32; M]) -> [f32; N],
    ) -> [Self; N];

    #[inline(always)]
    fn squared(self) -> Self {
        self * self
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.max(self.splat(0.0) - self)
    }

    /// Computes numbers lane by lane, from the index of the lane.
    #[inline(always)]
    fn by_lane<const N: usize>(self, mut f: impl FnMut(usize) -> [f32; N]) -> [Self; N] {
        let mut lane = 0;
        Self::each([self], |_| {
            let numbers = f(lane);
            lane += 1;
            numbers
        })
    }

    /// Applies a function of one number lane by lane.
    #[inline(always)]
    fn map(self, mut f: impl FnMut(f32) -> f32) -> Self {
        let [y] = Self::each([self], |[x]| [f(x)]);
        y
    }
}

/// Eight f32.
pub trait SimdF32x8: SimdFloat {
    type I32x8: SimdI32x8<F32x8 = Self>;
    /// Whether [`SimdF32x8::mul_sub`] is one instruction.
    const FUSES: bool;

    fn store(self) -> Lanes;
    /// Rounds toward zero; unspecified for NaN and beyond 2³¹.
    fn to_i32(self) -> Self::I32x8;
    /// a b − c with an exact product; rounded once if there is an instruction for it, otherwise twice. Use it only
    /// where the last bit does not matter.
    #[must_use]
    fn mul_sub(self, b: Self, c: Self) -> Self;
    /// Gathers numbers from a table of N rows, a power of two, at indices `at` modulo 8 N.
    fn gather<const N: usize>(table: &[Lanes; N], at: Self::I32x8) -> Self;

    /// The sum of all lanes, from the first to the last.
    #[inline(always)]
    fn sum(self) -> f32 {
        self.store().iter().sum()
    }
}

/// Sixteen f32.
pub(crate) trait SimdF32x16: SimdFloat {
    type Half: SimdF32x8;

    /// Joins the first eight and the last eight.
    fn of(halves: [Self::Half; 2]) -> Self;
    /// Stores the first eight and the last eight.
    fn store(self) -> [Lanes; 2];
    /// The first eight plus the last eight.
    fn folded(self) -> Self::Half;

    /// The sum of all lanes: first of the halves, then from the first lane to the last.
    #[inline(always)]
    fn sum(self) -> f32 {
        self.folded().sum()
    }
}

/// Eight i32.
pub trait SimdI32x8: Copy + Add<Output = Self> {
    type F32x8: SimdF32x8<I32x8 = Self>;

    /// Times 2ⁿ.
    fn shl<const N: i32>(self) -> Self;
    fn min(self, b: Self) -> Self;
    fn lt(self, b: Self) -> <Self::F32x8 as SimdFloat>::Mask;
    fn to_f32(self) -> Self::F32x8;
    fn select(mask: <Self::F32x8 as SimdFloat>::Mask, a: Self, b: Self) -> Self;
    /// Moves the kept lanes to the front; the other lanes are unspecified.
    fn compress(self, keep: <Self::F32x8 as SimdFloat>::Mask) -> [i32; LANES];
    fn store(self) -> [i32; LANES];
}

/// A truth value per lane.
pub trait LaneMask: Copy + BitAnd<Output = Self> + BitOr<Output = Self> {
    /// Bit i is lane i.
    fn bits(self) -> u32;
}

/// The members of each set of lanes, from the lowest; the remaining entries are unspecified.
#[cfg(target_arch = "x86_64")]
static COMPRESSED_LANES: [[u32; 8]; 256] = {
    let mut table = [[0; 8]; 256];
    let mut set = 0;
    while set < 256 {
        let (mut lane, mut len) = (0, 0);
        while lane < 8 {
            if set >> lane & 1 == 1 {
                table[set][len] = lane;
                len += 1;
            }
            lane += 1;
        }
        set += 1;
    }
    table
};

/// [`SimdI32x8::compress`], lane by lane.
#[inline(always)]
fn compress<T: Copy + Default>(lanes: [T; LANES], keep: u32) -> [T; LANES] {
    let (mut packed, mut len) = ([T::default(); LANES], 0);
    for (i, lane) in lanes.into_iter().enumerate() {
        // The next lane overwrites this one if it is not kept. The modulo avoids a bounds check.
        packed[len % LANES] = lane;
        len += (keep >> i & 1) as usize;
    }
    packed
}

/// [`SimdBitSets::pack`], lane by lane.
#[inline(always)]
fn pack(pair: [[u32; 8]; 2], numbers: [u32; 8]) -> ([[u32; 8]; 2], [u32; 8], usize) {
    let [a, b] = pair;
    let (mut packed, mut packed_numbers, mut len) = ([[0; 8]; 2], [0; 8], 0);
    for i in 0..LANES {
        // As in `compress`.
        packed[0][len % LANES] = a[i];
        packed[1][len % LANES] = b[i];
        packed_numbers[len % LANES] = numbers[i];
        len += usize::from(a[i] | b[i] != 0);
    }
    (packed, packed_numbers, len)
}

/// Eight sets of the numbers 0 to 31.
pub(crate) trait SimdBitSets: Copy {
    type Mask;

    /// Adds `bit` to the sets of the lanes in `m`.
    #[must_use]
    fn insert(self, m: Self::Mask, bit: u32) -> Self;
    /// A bit mask: bit i is set if set i is not empty.
    fn not_empty(self) -> u32;
    /// Moves the pairs of sets that are not both empty, and the numbers of their lanes, to the front; also returns
    /// their count.
    fn pack(pair: [Self; 2], numbers: [u32; 8]) -> ([[u32; 8]; 2], [u32; 8], usize);
    fn store(self) -> [u32; 8];
}

/// Lane `lane` of each row. The rows are not copied.
#[inline(always)]
pub(crate) fn lane_of<const N: usize>(rows: &[Lanes; N], lane: usize) -> [f32; N] {
    rows.each_ref().map(|row| row[lane])
}

/// The set bits, from the lowest.
#[inline(always)]
pub(crate) fn set_bits(bits: impl Into<u64>) -> impl Iterator<Item = usize> {
    let mut bits = bits.into();
    std::iter::from_fn(move || {
        let lane = bits.trailing_zeros();
        bits &= bits.wrapping_sub(1);
        (lane < u64::BITS).then_some(lane as usize)
    })
}

/// The last index of a table of N = 2ⁿ rows.
#[inline(always)]
const fn last_of<const N: usize>() -> usize {
    const { assert!(N.is_power_of_two() && N < 1 << 24) };
    N * LANES - 1
}

#[cfg(test)]
mod tests;
