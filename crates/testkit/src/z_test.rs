//! "This estimates that integral": batch means against a reference, or against each other, by
//! Student's t.

use crate::{Failure, Suite};
use statrs::distribution::{ContinuousCDF as _, StudentsT};

/// Mean and variance of a stream (Welford 1962; merged as in Chan, Golub & LeVeque 1979).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Welford {
    n: u64,
    mean: f64,
    m2: f64,
}

impl Welford {
    /// Adds a value.
    pub fn push(&mut self, x: f64) {
        self.n += 1;
        let delta = x - self.mean;
        self.mean += delta / self.n as f64;
        self.m2 += delta * (x - self.mean);
    }

    /// This stream followed by another.
    #[must_use]
    pub fn merge(self, other: Self) -> Self {
        if other.n == 0 {
            return self;
        }
        let n = self.n + other.n;
        let delta = other.mean - self.mean;
        let share = other.n as f64 / n as f64;
        Self {
            n,
            mean: self.mean + delta * share,
            m2: self.m2 + other.m2 + delta * delta * self.n as f64 * share,
        }
    }

    /// How many values.
    pub fn count(&self) -> u64 {
        self.n
    }

    /// The mean; 0 of none.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// The unbiased variance of one value; 0 of fewer than two.
    pub fn variance(&self) -> f64 {
        if self.n < 2 { 0.0 } else { self.m2 / (self.n - 1) as f64 }
    }

    /// The standard error of the mean.
    pub fn standard_error(&self) -> f64 {
        (self.variance() / self.n.max(1) as f64).sqrt()
    }
}

impl FromIterator<f64> for Welford {
    fn from_iter<I: IntoIterator<Item = f64>>(values: I) -> Self {
        let mut w = Self::default();
        values.into_iter().for_each(|x| w.push(x));
        w
    }
}

/// Means of `n` independent batches of `size` estimates each.
pub fn batches<const N: usize>(
    n: usize,
    size: usize,
    mut estimate: impl FnMut() -> [f64; N],
) -> Vec<[f64; N]> {
    let mut batch = || {
        let mut sum = [0.0; N];
        for _ in 0..size {
            let value = estimate();
            (0..N).for_each(|k| sum[k] += value[k]);
        }
        sum.map(|s| s / size as f64)
    };
    (0..n).map(|_| batch()).collect()
}

/// A value known with a standard error, per channel.
#[derive(Clone, Copy, Debug)]
pub struct Reference<const N: usize> {
    /// The value.
    pub value: [f64; N],
    /// Its standard error; zero when exact.
    pub standard_error: [f64; N],
}

impl<const N: usize> From<[f64; N]> for Reference<N> {
    fn from(value: [f64; N]) -> Self {
        Self { value, standard_error: [0.0; N] }
    }
}

/// A t-test of batch means, each channel on its own.
#[derive(Clone, Copy, Debug)]
pub struct ZTest {
    /// The tests that share the probability of a false alarm; channels are counted by the test.
    pub suite: Suite,
    /// The relative difference that rounding explains. It matters only where an estimator has
    /// hardly any variance (a constant integrand) and the arithmetic is in f32.
    pub rounding: f64,
}

impl Default for ZTest {
    fn default() -> Self {
        Self { suite: Suite::default(), rounding: 2e-6 }
    }
}

/// The fewest batches for which the mean is close enough to normal.
const MIN_BATCHES: usize = 30;

impl ZTest {
    /// A test in a suite of `tests`.
    pub fn in_suite_of(tests: usize) -> Self {
        Self { suite: Suite::of(tests), ..Self::default() }
    }

    /// The mean of `batches` is `reference`. Gives the smallest p-value.
    ///
    /// # Errors
    /// A channel differs by more than chance allows, or is not finite.
    ///
    /// # Panics
    /// With fewer than 30 batches.
    pub fn against<const N: usize>(
        &self,
        name: &str,
        batches: &[[f64; N]],
        reference: impl Into<Reference<N>>,
    ) -> Result<f64, Failure> {
        let reference = reference.into();
        self.channels::<N>(name, |k| {
            let a = moments(batches, k);
            let b = Moments {
                mean: reference.value[k],
                variance: reference.standard_error[k].powi(2),
                dof: f64::INFINITY,
            };
            (a, b, Tail::Both)
        })
    }

    /// Two estimators have the same mean (Welch's test). Gives the smallest p-value.
    ///
    /// # Errors
    /// A channel differs by more than chance allows, or is not finite.
    ///
    /// # Panics
    /// With fewer than 30 batches of either.
    pub fn two_sample<const N: usize>(
        &self,
        name: &str,
        a: &[[f64; N]],
        b: &[[f64; N]],
    ) -> Result<f64, Failure> {
        self.channels::<N>(name, |k| (moments(a, k), moments(b, k), Tail::Both))
    }

    /// The mean of `batches` is at most `bound`: energy, one-sided. Gives the smallest p-value.
    ///
    /// # Errors
    /// A channel exceeds the bound by more than chance allows, or is not finite.
    ///
    /// # Panics
    /// With fewer than 30 batches.
    pub fn at_most<const N: usize>(
        &self,
        name: &str,
        batches: &[[f64; N]],
        bound: [f64; N],
    ) -> Result<f64, Failure> {
        self.channels::<N>(name, |k| {
            let exact = Moments { mean: bound[k], variance: 0.0, dof: f64::INFINITY };
            (moments(batches, k), exact, Tail::Above)
        })
    }

    fn channels<const N: usize>(
        &self,
        name: &str,
        mut pair: impl FnMut(usize) -> (Moments, Moments, Tail),
    ) -> Result<f64, Failure> {
        let threshold = self.suite.times(N).threshold();
        let mut least = 1.0f64;
        for k in 0..N {
            let (a, b, tail) = pair(k);
            let p = self.p_value(a, b, tail);
            // A NaN fails as well.
            if p.is_nan() || p < threshold {
                let spread = (a.variance + b.variance).sqrt();
                return Err(Failure::new(format!(
                    "{name}, channel {k}: {} ± {:.3e} against {} ± {:.3e}: a difference of {:.3e}, {:.2} standard errors; p = {p:.3e} < {threshold:.3e}",
                    a.mean,
                    a.variance.sqrt(),
                    b.mean,
                    b.variance.sqrt(),
                    a.mean - b.mean,
                    (a.mean - b.mean) / spread,
                )));
            }
            least = least.min(p);
        }
        Ok(least)
    }

    fn p_value(&self, a: Moments, b: Moments, tail: Tail) -> f64 {
        let difference = match tail {
            Tail::Both => (a.mean - b.mean).abs(),
            Tail::Above => a.mean - b.mean,
        };
        if !difference.is_finite() {
            return f64::NAN;
        }
        let excess = difference - self.rounding * a.mean.abs().max(b.mean.abs());
        if excess <= 0.0 {
            return 1.0;
        }
        let variance = a.variance + b.variance;
        if variance == 0.0 {
            return 0.0;
        }
        // Welch–Satterthwaite degrees of freedom.
        let dof = variance.powi(2) / (a.variance.powi(2) / a.dof + b.variance.powi(2) / b.dof);
        let beyond = match StudentsT::new(0.0, 1.0, dof.min(1e6)) {
            Ok(t) => t.sf(excess / variance.sqrt()),
            Err(_) => f64::NAN,
        };
        match tail {
            Tail::Both => 2.0 * beyond,
            Tail::Above => beyond,
        }
    }
}

#[derive(Clone, Copy)]
enum Tail {
    Both,
    Above,
}

/// A mean, the variance of that mean, and the degrees of freedom of the variance.
#[derive(Clone, Copy)]
struct Moments {
    mean: f64,
    variance: f64,
    dof: f64,
}

fn moments<const N: usize>(batches: &[[f64; N]], channel: usize) -> Moments {
    assert!(batches.len() >= MIN_BATCHES, "{} batches, at least {MIN_BATCHES}", batches.len());
    let w: Welford = batches.iter().map(|b| b[channel]).collect();
    Moments { mean: w.mean(), variance: w.standard_error().powi(2), dof: (w.count() - 1) as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Pcg;

    /// Batches of x² over uniform x, times `scale`: the mean is scale / 3.
    fn squares(seed: u64, scale: f64) -> Vec<[f64; 1]> {
        let mut rng = Pcg::new(seed);
        batches(40, 1000, || [scale * rng.next_f64().powi(2)])
    }

    #[test]
    fn welford_merges_to_the_same() {
        let x: Vec<f64> = (0..57).map(|i| f64::from(i * i % 13)).collect();
        let whole: Welford = x.iter().copied().collect();
        let parts =
            [&x[..20], &x[20..20], &x[20..]].map(|p| p.iter().copied().collect::<Welford>());
        let merged = parts.into_iter().fold(Welford::default(), Welford::merge);
        assert!((merged.mean() - whole.mean()).abs() < 1e-12);
        assert!((merged.variance() - whole.variance()).abs() < 1e-12);
        let mean = x.iter().sum::<f64>() / 57.0;
        let variance = x.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 56.0;
        assert!((whole.variance() - variance).abs() < 1e-12);
    }

    #[test]
    fn a_right_estimator_passes_and_a_wrong_one_fails() {
        let test = ZTest::in_suite_of(2);
        test.against("x²", &squares(1, 1.0), [1.0 / 3.0]).unwrap();
        test.against("x² · 1.05", &squares(1, 1.05), [1.0 / 3.0]).unwrap_err();
        test.two_sample("same", &squares(1, 1.0), &squares(2, 1.0)).unwrap();
        test.two_sample("other", &squares(1, 1.0), &squares(2, 1.05)).unwrap_err();
        test.at_most("bounded", &squares(1, 0.9), [1.0 / 3.0]).unwrap();
        test.at_most("too much", &squares(1, 1.05), [1.0 / 3.0]).unwrap_err();
    }

    #[test]
    fn the_reference_may_be_uncertain() {
        let uncertain = Reference { value: [0.34], standard_error: [0.01] };
        ZTest::default().against("near", &squares(1, 1.0), uncertain).unwrap();
        ZTest::default().against("far", &squares(1, 1.0), [0.34]).unwrap_err();
    }

    #[test]
    fn no_variance_leaves_rounding_and_nan_fails() {
        let constant = vec![[1.0 + 1e-7]; 30];
        ZTest::default().against("constant", &constant, [1.0]).unwrap();
        ZTest::default().against("constant", &constant, [1.001]).unwrap_err();
        let mut spoilt = squares(1, 1.0);
        spoilt[3] = [f64::NAN];
        ZTest::default().against("NaN", &spoilt, [1.0 / 3.0]).unwrap_err();
    }

    #[test]
    fn p_values_are_uniform() {
        // Under the null hypothesis a tenth of the p-values lies below a tenth.
        let test = ZTest::default();
        let p = (0..1000u64).map(|i| {
            let mut rng = Pcg::new(i);
            let b = batches(30, 10, || [rng.next_f64()]);
            test.p_value(
                moments(&b, 0),
                Moments { mean: 0.5, variance: 0.0, dof: f64::INFINITY },
                Tail::Both,
            )
        });
        let below = p.filter(|&p| p < 0.1).count() as f64;
        // Binomial(1000, 0.1): within four standard deviations.
        assert!((below - 100.0).abs() < 4.0 * 90f64.sqrt(), "{below}");
    }
}
