//! Strategies by their text.

use std::fmt;
use std::str::FromStr;

use domelight::strategy::{StrategyError, StrategySpec};

use crate::Error;

/// A strategy with its original text.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedStrategy {
    /// As it was given.
    pub text: String,
    /// What it says.
    pub spec: StrategySpec,
}

impl FromStr for NamedStrategy {
    type Err = StrategyError;

    fn from_str(text: &str) -> Result<Self, StrategyError> {
        Ok(Self { text: text.to_owned(), spec: text.parse()? })
    }
}

impl fmt::Display for NamedStrategy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.text)
    }
}

impl From<StrategySpec> for NamedStrategy {
    fn from(spec: StrategySpec) -> Self {
        Self { text: spec.to_string(), spec }
    }
}

/// Rejects more points than the 2³² in the sequence of a pixel.
///
/// # Errors
/// If there are more.
pub fn refuse_repeating_points(spec: StrategySpec, spp: u32) -> Result<(), Error> {
    let n_points = spec.points_per_sample();
    if u64::from(spp) * u64::from(n_points) > 1 << 32 {
        return Err(Error::Usage(format!(
            "{spp} camera samples of {n_points} directions are more points than a pixel has \
             (2^32): lower --spp, or render several seeds and average them"
        )));
    }
    Ok(())
}
