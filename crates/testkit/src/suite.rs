//! How sure a suite of tests wants to be, and how a test fails.

use std::fmt;

/// Several statistical tests that together may raise a false alarm with a stated probability.
#[derive(Clone, Copy, Debug)]
pub struct Suite {
    /// How many independent tests there are.
    pub tests: usize,
    /// Probability that a right implementation fails any of them.
    pub significance: f64,
}

impl Default for Suite {
    fn default() -> Self {
        Self { tests: 1, significance: 0.01 }
    }
}

impl Suite {
    /// A suite of `tests` tests at the default significance of 1 %.
    pub fn of(tests: usize) -> Self {
        Self { tests, ..Self::default() }
    }

    /// The p-value below which one test fails: 1 − (1 − significance)^(1/tests) (Šidák 1967).
    pub fn threshold(&self) -> f64 {
        -f64::exp_m1(f64::ln_1p(-self.significance) / self.tests.max(1) as f64)
    }

    /// The same suite when each test compares `n` quantities.
    #[must_use]
    pub fn times(self, n: usize) -> Self {
        Self { tests: self.tests * n, ..self }
    }
}

/// A test that failed, as a text to be read. `Debug` prints the same, so `unwrap` is readable.
pub struct Failure(String);

impl Failure {
    pub(crate) fn new(text: String) -> Self {
        Self(text)
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl fmt::Debug for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Failure {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_threshold_shares_the_significance() {
        let suite = Suite { tests: 20, significance: 0.05 };
        assert!((1.0 - (1.0 - suite.threshold()).powi(20) - 0.05).abs() < 1e-12);
        assert_eq!(Suite::of(4).times(3).tests, 12);
    }
}
