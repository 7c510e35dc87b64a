//! Vectors of eight numbers on each instruction set: the only unsafe code of the library.
//!
//! A [`Kernel`] is written once over the operations of [`Simd`], each of which is one IEEE operation
//! a lane. Nothing fuses or reorders them, so a kernel gives the same bits on every instruction set.
//! [`dispatch`] compiles it for each and picks at run time, so that a portable binary traces as fast
//! as one built for the machine. Another instruction set is one more file like `avx2.rs` and one more
//! line in each function of [`InstructionSet`] and [`dispatch`]; two vectors of four make one of eight.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod scalar;

use super::Lanes;

/// The instructions that trace rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// One number at a time; the reference, on every processor.
    Scalar,
    /// x86-64 AVX2: eight numbers at a time.
    Avx2,
}

impl InstructionSet {
    /// All that this version knows, the fastest last.
    pub const ALL: [Self; 2] = [Self::Scalar, Self::Avx2];

    /// Whether this processor has the instructions.
    pub fn is_available(self) -> bool {
        match self {
            Self::Scalar => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => avx2::Avx2::new().is_some(),
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 => false,
        }
    }

    /// The fastest that this processor has.
    pub fn best() -> Self {
        Self::ALL.into_iter().rfind(|i| i.is_available()).unwrap_or(Self::Scalar)
    }
}

/// Work to be compiled for each instruction set. `run` and all that it calls must be
/// `#[inline(always)]`, or the compiler may leave them without the instructions.
pub(super) trait Kernel {
    type Output;
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// Runs the kernel with the given instructions, or the scalar ones if the processor lacks them.
#[inline]
pub(super) fn dispatch<K: Kernel>(instruction_set: InstructionSet, kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    if instruction_set == InstructionSet::Avx2
        && let Some(simd) = avx2::Avx2::new()
    {
        return simd.run(kernel);
    }
    let _ = instruction_set;
    kernel.run(scalar::Scalar)
}

/// Operations on eight lanes. A value of the type proves that the processor has the instructions.
pub(super) trait Simd: Copy {
    /// Eight f32.
    type F: Copy;
    /// Eight truth values.
    type M: Copy;
    /// Eight sets of 32 bits.
    type B: Copy;

    fn splat(self, x: f32) -> Self::F;
    fn load(self, x: &Lanes) -> Self::F;
    fn store(self, x: Self::F) -> Lanes;
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
    /// a < b ? a : b; so b if either is NaN.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// a > b ? a : b; so b if either is NaN.
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    /// a ≤ b; false if either is NaN.
    fn le(self, a: Self::F, b: Self::F) -> Self::M;
    /// a < b; false if either is NaN.
    fn lt(self, a: Self::F, b: Self::F) -> Self::M;
    /// a = b; false if either is NaN.
    fn eq(self, a: Self::F, b: Self::F) -> Self::M;
    fn and(self, a: Self::M, b: Self::M) -> Self::M;
    fn or(self, a: Self::M, b: Self::M) -> Self::M;
    /// Bit i is lane i.
    fn bits(self, m: Self::M) -> u32;

    fn no_bits(self) -> Self::B;
    /// Adds `bit` to the sets where `m` is true.
    fn insert(self, sets: Self::B, m: Self::M, bit: u32) -> Self::B;
    fn store_bits(self, sets: Self::B) -> [u32; 8];
    /// Bit i: set i is not empty.
    fn not_empty(self, sets: Self::B) -> u32;
}
