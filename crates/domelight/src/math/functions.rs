//! The elementary functions of the whole library: the same bits on every processor and operating system.
//!
//! What the standard library calls comes from the platform's C library, which rounds as it likes; so does
//! `f32::mul_add` where the processor has no such instruction, and `powi` leaves the order of its products open. Clippy
//! forbids all of these here (`clippy.toml`). Square roots and rounding are exact everywhere and need no care.
//!
//! Functions of f32 that rendering calls by the million are computed in f64 and rounded once: a Taylor polynomial after
//! a reduction of the argument, without tables or branches, so that loops over them vectorize. All others are those of
//! the `libm` crate. [`super::atan2`] and its neighbors are for vectors, and less accurate.

#![cfg_attr(not(feature = "io"), allow(dead_code))] // Some serve files alone.

use std::f64::consts::{FRAC_1_SQRT_2, LN_2, LOG2_E, LOG10_2};

/// f32 or f64.
pub(crate) trait Real: Copy {
    fn sin(self) -> Self;
    fn cos(self) -> Self;
    fn sin_cos(self) -> (Self, Self);
    fn tan(self) -> Self;
    fn asin(self) -> Self;
    fn acos(self) -> Self;
    fn atan(self) -> Self;
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

impl Real for f32 {
    from_libm!(
        sin = libm::sinf,
        cos = libm::cosf,
        tan = libm::tanf,
        asin = libm::asinf,
        acos = libm::acosf,
        atan = libm::atanf,
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
    #[inline(always)]
    fn exp(self) -> f32 {
        let Power { scale, excess } = Power::of_two(f64::from(self) * LOG2_E);
        (scale + scale * excess) as f32
    }
    #[inline(always)]
    fn exp2(self) -> f32 {
        let Power { scale, excess } = Power::of_two(f64::from(self));
        (scale + scale * excess) as f32
    }
    #[inline(always)]
    fn exp_m1(self) -> f32 {
        let Power { scale, excess } = Power::of_two(f64::from(self) * LOG2_E);
        (scale * excess + (scale - 1.0)) as f32
    }
    #[inline(always)]
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
    /// Of numbers not less than zero; NaN of others.
    #[inline(always)]
    fn powf(self, exponent: f32) -> f32 {
        if exponent == 0.0 || self == 1.0 {
            return 1.0;
        }
        let Power { scale, excess } = Power::of_two(log2_kernel(self) * f64::from(exponent));
        (scale + scale * excess) as f32
    }
}

impl Real for f64 {
    from_libm!(
        sin = libm::sin,
        cos = libm::cos,
        tan = libm::tan,
        asin = libm::asin,
        acos = libm::acos,
        atan = libm::atan,
        cbrt = libm::cbrt,
        exp = libm::exp,
        exp2 = libm::exp2,
        exp_m1 = libm::expm1,
        ln_1p = libm::log1p,
        log2 = libm::log2,
        log10 = libm::log10,
    );
    powi!();

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

/// 2ˣ as s + s e, s a power of two and e in [1/√2 − 1, √2 − 1].
struct Power {
    scale: f64,
    excess: f64,
}

impl Power {
    /// To 10⁻¹¹ of the result; where f32 ends, 0 or ∞ once rounded to f32.
    #[inline(always)]
    fn of_two(x: f64) -> Self {
        /// Adding it rounds to a whole number, which is then in the lowest bits.
        const ROUND: f64 = 1.5 * (1u64 << 52) as f64;
        /// 1/k! for k ≥ 1.
        const TAYLOR: [f64; 9] = [
            1.0,
            1.0 / 2.0,
            1.0 / 6.0,
            1.0 / 24.0,
            1.0 / 120.0,
            1.0 / 720.0,
            1.0 / 5040.0,
            1.0 / 40_320.0,
            1.0 / 362_880.0,
        ];
        let x = x.clamp(-300.0, 300.0);
        let rounded = x + ROUND;
        let t = (x - (rounded - ROUND)) * LN_2;
        let scale = f64::from_bits(rounded.to_bits().wrapping_add(1023) << 52);
        Self { scale, excess: t * polynomial(t, &TAYLOR) }
    }
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

/// Σ cₖ xᵏ by Horner's rule.
#[inline(always)]
fn polynomial<const N: usize>(x: f64, c: &[f64; N]) -> f64 {
    let mut sum = c[N - 1];
    for &c in c[..N - 1].iter().rev() {
        sum = sum * x + c;
    }
    sum
}

macro_rules! functions {
    ($($(#[$doc:meta])* $name:ident($first:ident $(, $second:ident: $type:ty)?) -> $result:ty;)*) => {
        $(
            $(#[$doc])*
            #[inline(always)]
            pub(crate) fn $name<T: Real>($first: T $(, $second: $type)?) -> $result {
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
    /// The angle in [−π/2, π/2] of a tangent \[rad\].
    atan(tangent) -> T;
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

    /// The greatest distance between a function of f32 and the same of f64, in units of the last place of the result.
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
    }
}
