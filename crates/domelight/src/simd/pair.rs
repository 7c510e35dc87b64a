//! Sixteen numbers as two vectors, for instruction sets without wider registers.

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

use super::{LaneMask, Lanes, SimdF32x8, SimdF32x16, SimdFloat};

/// The first eight and the last eight numbers.
#[derive(Clone, Copy)]
pub(crate) struct Pair<T>(T, T);

macro_rules! operator {
    ($trait:ident, $method:ident) => {
        impl<T: $trait<Output = T>> $trait for Pair<T> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, b: Self) -> Self {
                Self(self.0.$method(b.0), self.1.$method(b.1))
            }
        }
    };
}
operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);
operator!(BitAnd, bitand);
operator!(BitOr, bitor);

impl<F: SimdFloat> SimdFloat for Pair<F> {
    type Mask = Pair<F::Mask>;
    const N_LANES: usize = 2 * F::N_LANES;

    #[inline(always)]
    fn splat(self, x: f32) -> Self {
        Self(self.0.splat(x), self.1.splat(x))
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        Self(self.0.min(b.0), self.1.min(b.1))
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        Self(self.0.max(b.0), self.1.max(b.1))
    }
    #[inline(always)]
    fn le(self, b: Self) -> Pair<F::Mask> {
        Pair(self.0.le(b.0), self.1.le(b.1))
    }
    #[inline(always)]
    fn lt(self, b: Self) -> Pair<F::Mask> {
        Pair(self.0.lt(b.0), self.1.lt(b.1))
    }
    #[inline(always)]
    fn eq(self, b: Self) -> Pair<F::Mask> {
        Pair(self.0.eq(b.0), self.1.eq(b.1))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt(), self.1.sqrt())
    }
    #[inline(always)]
    fn select(mask: Pair<F::Mask>, a: Self, b: Self) -> Self {
        Self(F::select(mask.0, a.0, b.0), F::select(mask.1, a.1, b.1))
    }
    #[inline(always)]
    fn each<const M: usize, const N: usize>(
        arguments: [Self; M],
        mut f: impl FnMut([f32; M]) -> [f32; N],
    ) -> [Self; N] {
        let first = F::each(arguments.map(|x| x.0), &mut f);
        let others = F::each(arguments.map(|x| x.1), f);
        std::array::from_fn(|i| Self(first[i], others[i]))
    }
}

impl<M: LaneMask> LaneMask for Pair<M> {
    #[inline(always)]
    fn bits(self) -> u32 {
        self.0.bits() | self.1.bits() << 8
    }
}

impl<F: SimdF32x8> SimdF32x16 for Pair<F> {
    type Half = F;

    #[inline(always)]
    fn of([first, others]: [F; 2]) -> Self {
        Self(first, others)
    }
    #[inline(always)]
    fn store(self) -> [Lanes; 2] {
        [self.0.store(), self.1.store()]
    }
    #[inline(always)]
    fn folded(self) -> F {
        self.0 + self.1
    }
}
