//! The elementary functions of the library, with the same bits on every processor and operating system.
//!
//! The standard library calls the platform's C library, whose rounding varies. So does `f32::mul_add` if the processor
//! has no such instruction, and `powi` does not define the order of its products. Clippy forbids all of these here
//! (`clippy.toml`). Square roots and rounding are exact everywhere.
//!
//! Exponentials and logarithms of f32 are computed in f64 and rounded once. They use argument reduction and a Taylor
//! polynomial without tables, so that loops over them vectorize. Functions used by lobes are not inlined, because the
//! compiler treats them as pure and would hoist them above the branch on the lobe. All others come from the `libm`
//! crate, which is about as fast as the platform's library. [`super::atan2`] and its neighbors are for vectors and less
//! accurate.
#![cfg_attr(not(feature = "io"), allow(dead_code))] // Some serve files alone.

use std::f64::consts::{FRAC_1_SQRT_2, LN_2, LOG2_E, LOG10_2};

/// f32 or f64.
pub(crate) trait Float: Copy {
    fn sin(self) -> Self;
    fn cos(self) -> Self;
    fn sin_cos(self) -> (Self, Self);
    fn tan(self) -> Self;
    fn asin(self) -> Self;
    fn acos(self) -> Self;
    fn atan2(self, x: Self) -> Self;
    fn hypot(self, y: Self) -> Self;
    fn cbrt(self) -> Self;
    fn exp(self) -> Self;
    fn exp2(self) -> Self;
    fn exp_m1(self) -> Self;
    fn ln_1p(self) -> Self;
    fn log2(self) -> Self;
    fn log10(self) -> Self;
    fn powf(self, exponent: Self) -> Self;
    fn powi(self, exponent: i32) -> Self;
}

macro_rules! from_libm {
    ($($method:ident = $function:path),* $(,)?) => {
        $(
            #[inline]
            fn $method(self) -> Self {
                $function(self)
            }
        )*
    };
}

/// Powers by repeated squaring, the lowest bit of the exponent first.
macro_rules! powi {
    () => {
        #[inline(always)]
        fn powi(self, exponent: i32) -> Self {
            let (mut power, mut square, mut n) = (1.0, self, exponent.unsigned_abs());
            loop {
                if n & 1 == 1 {
                    power *= square;
                }
                n >>= 1;
                if n == 0 {
                    break if exponent < 0 { 1.0 / power } else { power };
                }
                square *= square;
            }
        }
    };
}

impl Float for f32 {
    from_libm!(
        sin = libm::sinf,
        cos = libm::cosf,
        tan = libm::tanf,
        asin = libm::asinf,
        acos = libm::acosf,
        cbrt = libm::cbrtf,
    );
    powi!();

    #[inline]
    fn sin_cos(self) -> (f32, f32) {
        libm::sincosf(self)
    }
    #[inline]
    fn atan2(self, x: f32) -> f32 {
        libm::atan2f(self, x)
    }
    #[inline]
    fn hypot(self, y: f32) -> f32 {
        let (x, y) = (f64::from(self), f64::from(y));
        (x * x + y * y).sqrt() as f32
    }
    #[inline(never)]
    fn exp(self) -> f32 {
        Power::of_two(f64::from(self) * LOG2_E).value() as f32
    }
    #[inline(always)]
    fn exp2(self) -> f32 {
        Power::of_two(f64::from(self)).value() as f32
    }
    #[inline(never)]
    fn exp_m1(self) -> f32 {
        let power = Power::of_two(f64::from(self) * LOG2_E);
        let scale = power.scale();
        (scale * power.excess + (scale - 1.0)) as f32
    }
    #[inline(never)]
    fn ln_1p(self) -> f32 {
        let x = f64::from(self);
        let y = 1.0 + x;
        let (exponent, mantissa) = split(y);
        // Where nothing was split off, 1 + x − 1 would lose what x has beyond.
        let beyond_one = if exponent == 0.0 { x } else { mantissa - 1.0 };
        where_positive(y, exponent * LN_2 + ln_near_one(beyond_one)) as f32
    }
    #[inline(always)]
    fn log2(self) -> f32 {
        log2_kernel(self) as f32
    }
    #[inline(always)]
    fn log10(self) -> f32 {
        (log2_kernel(self) * LOG10_2) as f32
    }
    /// A power of a base ≥ 0; NaN for other bases.
    #[inline(always)]
    fn powf(self, exponent: f32) -> f32 {
        if exponent == 0.0 || self == 1.0 {
            return 1.0;
        }
        Power::of_two(log2_kernel(self) * f64::from(exponent)).value() as f32
    }
}

impl Float for f64 {
    from_libm!(
        sin = libm::sin,
        cos = libm::cos,
        tan = libm::tan,
        asin = libm::asin,
        acos = libm::acos,
        cbrt = libm::cbrt,
        exp2 = libm::exp2,
        exp_m1 = libm::expm1,
        ln_1p = libm::log1p,
        log2 = libm::log2,
        log10 = libm::log10,
    );
    powi!();

    #[inline(always)]
    fn exp(self) -> f64 {
        Power::of_e(self).wide_value()
    }
    #[inline]
    fn sin_cos(self) -> (f64, f64) {
        libm::sincos(self)
    }
    #[inline]
    fn atan2(self, x: f64) -> f64 {
        libm::atan2(self, x)
    }
    #[inline]
    fn hypot(self, y: f64) -> f64 {
        libm::hypot(self, y)
    }
    #[inline]
    fn powf(self, exponent: f64) -> f64 {
        libm::pow(self, exponent)
    }
}

/// 2ⁿ (1 + e), n whole and e in [1/√2 − 1, √2 − 1].
struct Power {
    /// n + 3·2⁵¹, so that n is in the lowest bits.
    shifted: f64,
    excess: f64,
}

impl Power {
    /// Adding it rounds to a whole number.
    const SHIFT: f64 = 1.5 * (1u64 << 52) as f64;

    /// 2ˣ to 10⁻¹¹ of the result; beyond the range of f32 only that it is.
    #[inline(always)]
    fn of_two(x: f64) -> Self {
        let x = x.clamp(-300.0, 300.0);
        let shifted = x + Self::SHIFT;
        Self::new::<9>(shifted, (x - (shifted - Self::SHIFT)) * LN_2)
    }

    /// eˣ to 10⁻¹⁵ + 3.4·10⁻¹⁷ |x| of the result: what f64 leaves of ln 2 is 2.3·10⁻¹⁷.
    #[inline(always)]
    fn of_e(x: f64) -> Self {
        /// ln 2, its lower half zero, so that its multiples are exact, and the rest.
        const HIGH: f64 = f64::from_bits(LN_2.to_bits() >> 32 << 32);
        const LOW: f64 = LN_2 - HIGH;
        let x = x.clamp(-800.0, 800.0);
        let shifted = x * LOG2_E + Self::SHIFT;
        let n = shifted - Self::SHIFT;
        Self::new::<13>(shifted, (x - n * HIGH) - n * LOW)
    }

    /// e = eᵗ − 1 by `N` terms of the series.
    #[inline(always)]
    fn new<const N: usize>(shifted: f64, t: f64) -> Self {
        Self { shifted, excess: t * polynomial(t, &const { one_over_factorials::<N>() }) }
    }

    /// 2ⁿ of |n| < 1023.
    #[inline(always)]
    fn scale(&self) -> f64 {
        f64::from_bits(self.shifted.to_bits().wrapping_add(1023) << 52)
    }

    /// For f32: beyond its range ∞ or 0 once it is rounded.
    #[inline(always)]
    fn value(&self) -> f64 {
        let scale = self.scale();
        scale + scale * self.excess
    }

    /// In two steps, for what is less than the least normal number.
    #[inline(always)]
    fn wide_value(&self) -> f64 {
        let n = (self.shifted.to_bits() << 32) as i64 >> 32;
        let half = n >> 1;
        let power = |n: i64| f64::from_bits(((n + 1023) as u64) << 52);
        (1.0 + self.excess) * power(half) * power(n - half)
    }
}

/// 1/k! for k ≥ 1.
const fn one_over_factorials<const N: usize>() -> [f64; N] {
    let (mut c, mut factorial, mut k) = ([0.0; N], 1.0, 0);
    while k < N {
        factorial *= (k + 1) as f64;
        c[k] = 1.0 / factorial;
        k += 1;
    }
    c
}

/// log₂ of a number not less than zero, to 10⁻¹³ of the result; NaN of others.
#[inline(always)]
fn log2_kernel(x: f32) -> f64 {
    let x = f64::from(x);
    let (exponent, mantissa) = split(x);
    where_positive(x, exponent + LOG2_E * ln_near_one(mantissa - 1.0))
}

/// A positive normal number as 2ᵉ m, m in [1/√2, √2).
#[inline(always)]
fn split(x: f64) -> (f64, f64) {
    let above = x.to_bits().wrapping_sub(FRAC_1_SQRT_2.to_bits()) as i64 >> 52;
    (above as i32 as f64, f64::from_bits(x.to_bits().wrapping_sub((above as u64) << 52)))
}

/// ln(1 + x) for 1 + x in [1/√2, √2]: 2 artanh x/(2 + x).
#[inline(always)]
fn ln_near_one(x: f64) -> f64 {
    /// 1/(2k + 1).
    const TAYLOR: [f64; 8] =
        [1.0, 1.0 / 3.0, 1.0 / 5.0, 1.0 / 7.0, 1.0 / 9.0, 1.0 / 11.0, 1.0 / 13.0, 1.0 / 15.0];
    let s = x / (2.0 + x);
    2.0 * s * polynomial(s * s, &TAYLOR)
}

/// The logarithm of `x`, given what holds for numbers that are positive, finite and not NaN.
#[inline(always)]
fn where_positive(x: f64, logarithm: f64) -> f64 {
    if x > 0.0 && x < f64::INFINITY {
        logarithm
    } else if x == 0.0 {
        f64::NEG_INFINITY
    } else if x > 0.0 {
        f64::INFINITY
    } else {
        f64::NAN
    }
}

/// Σ cₖ xᵏ by Horner's rule, of even and odd k side by side.
#[inline(always)]
fn polynomial<const N: usize>(x: f64, c: &[f64; N]) -> f64 {
    let square = x * x;
    let mut sums = [0.0; 2];
    for k in (0..N).rev() {
        sums[k % 2] = sums[k % 2] * square + c[k];
    }
    sums[0] + x * sums[1]
}

macro_rules! functions {
    ($($(#[$doc:meta])* $name:ident($first:ident $(, $second:ident: $type:ty)?) -> $result:ty;)*) => {
        $(
            $(#[$doc])*
            #[inline(always)]
            pub(crate) fn $name<T: Float>($first: T $(, $second: $type)?) -> $result {
                T::$name($first $(, $second)?)
            }
        )*
    };
}

functions! {
    /// Sine of an angle \[rad\].
    sin(angle) -> T;
    /// Cosine of an angle \[rad\].
    cos(angle) -> T;
    /// Sine and cosine of an angle \[rad\].
    sin_cos(angle) -> (T, T);
    /// Tangent of an angle \[rad\].
    tan(angle) -> T;
    /// The angle in [−π/2, π/2] of a sine in [−1, 1] \[rad\]; NaN of others.
    asin(sine) -> T;
    /// The angle in [0, π] of a cosine in [−1, 1] \[rad\]; NaN of others.
    acos(cosine) -> T;
    /// The angle of (x, y) from the x axis in [−π, π] \[rad\].
    atan2(y, x: T) -> T;
    /// √(x² + y²), without overflow on the way.
    hypot(x, y: T) -> T;
    /// The cube root.
    cbrt(x) -> T;
    /// eˣ.
    exp(x) -> T;
    /// 2ˣ.
    exp2(x) -> T;
    /// eˣ − 1, of small x, too.
    exp_m1(x) -> T;
    /// ln(1 + x), of small x, too; −∞ of −1, NaN of less.
    ln_1p(x) -> T;
    /// The logarithm to base 2; −∞ of zero, NaN of less.
    log2(x) -> T;
    /// The logarithm to base 10; −∞ of zero, NaN of less.
    log10(x) -> T;
    /// xᵉ of x ≥ 0.
    powf(x, exponent: T) -> T;
    /// xᵉ of a whole exponent.
    powi(x, exponent: i32) -> T;
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest distance between a function of f32 and the same of f64, in units of the last place of the result.
    fn worst(
        arguments: impl Iterator<Item = f32>,
        f: fn(f32) -> f32,
        exact: fn(f64) -> f64,
    ) -> f64 {
        arguments.map(|x| units_between(f(x), exact(f64::from(x)))).fold(0.0, f64::max)
    }

    fn units_between(value: f32, exact: f64) -> f64 {
        let rounded = exact as f32;
        if !rounded.is_finite() || rounded == 0.0 {
            return if value.to_bits() == rounded.to_bits() { 0.0 } else { f64::INFINITY };
        }
        let unit = f64::from(rounded.abs().next_up()) - f64::from(rounded.abs());
        (f64::from(value) - exact).abs() / unit
    }

    /// Numbers of every exponent and both signs.
    fn everywhere() -> impl Iterator<Item = f32> {
        (0..1 << 20).map(|i: u32| f32::from_bits(i << 12 | i)).filter(|x| x.is_finite())
    }

    fn within(least: f32, greatest: f32) -> impl Iterator<Item = f32> {
        let steps = 1 << 18;
        let lerp = move |i| least + (greatest - least) * (i as f32 / steps as f32);
        (0..=steps).map(lerp).chain(everywhere().filter(move |x| (least..=greatest).contains(x)))
    }

    #[test]
    fn functions_of_singles_are_rounded_almost_correctly() {
        let positive = || within(0.0, f32::MAX);
        let all = [
            worst(within(-110.0, 95.0), exp, f64::exp),
            worst(within(-155.0, 130.0), exp2, f64::exp2),
            worst(within(-110.0, 95.0), exp_m1, f64::exp_m1),
            worst(within(-1.0, 100.0), ln_1p, f64::ln_1p),
            worst(positive(), ln_1p, f64::ln_1p),
            worst(positive(), log2, f64::log2),
            worst(positive(), log10, f64::log10),
            worst(positive(), |x| powf(x, 2.4), |x| x.powf(f64::from(2.4f32))),
            worst(positive(), |x| powf(x, 1.0 / 2.4), |x| x.powf(f64::from(1.0f32 / 2.4))),
            worst(within(0.0, 1.0), |x| powf(x, 1000.0), |x| x.powf(1000.0)),
        ];
        assert!(all.iter().all(|&units| units < 0.501), "{all:?}");
        let none = [exp(f32::NAN), exp_m1(f32::NAN), ln_1p(f32::NAN), log2(-1.0)];
        assert!(none.iter().all(|x| x.is_nan()), "{none:?}");
        let ends = [exp(f32::INFINITY), exp(f32::NEG_INFINITY), ln_1p(-1.0)];
        assert_eq!(ends, [f32::INFINITY, 0.0, f32::NEG_INFINITY]);
        assert_eq!([powf(0.0f32, 0.5), powf(0.0f32, 0.0), powf(1.0f32, 9e9)], [0.0, 1.0, 1.0]);
    }

    #[test]
    fn the_exponential_of_doubles_is_that_of_the_platform() {
        for i in -760_000..720_000 {
            let x = 1e-3 * f64::from(i);
            let (own, exact) = (exp(x), x.exp());
            let close = (own - exact).abs() <= exact * (1e-15 + 3.4e-17 * x.abs()) + 5e-324;
            assert!(close || own == exact, "{x}: {own:e}, not {exact:e}");
        }
        assert!(exp(f64::NAN).is_nan());
        assert_eq!([exp(1e9), exp(-1e9), exp(0.0)], [f64::INFINITY, 0.0, 1.0]);
    }

    #[test]
    fn powers_of_whole_exponents_are_products() {
        let powers = [powi(1.1f32, 0), powi(1.1f32, 2), powi(1.1f32, 3)];
        assert_eq!(powers, [1.0, 1.1 * 1.1, 1.1 * (1.1 * 1.1)]);
        let powers = [powi(2.0f64, 60), powi(2.0f64, -60), powi(-3.0f64, 3)];
        assert_eq!(powers, [(1u64 << 60) as f64, 1.0 / (1u64 << 60) as f64, -27.0]);
    }
}
