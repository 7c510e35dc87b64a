//! Explains in sentences with numbers why a pixel is noisy and what would help.

use std::fmt;

use super::decomposition::{Cause, Decomposition, Share};

impl Decomposition {
    /// Explains why the pixel is noisy, in a sentence with numbers. The mean of a biased strategy is compared with that
    /// of the best unbiased one among all `strategies` at the pixel.
    pub fn diagnosis<'a>(&'a self, strategies: &'a [Self]) -> Diagnosis<'a> {
        Diagnosis { decomposition: self, unbiased: best_first(strategies).first().copied() }
    }
}

/// The unbiased strategies; the first needs the fewest rays.
fn best_first(strategies: &[Decomposition]) -> Vec<&Decomposition> {
    let mut order: Vec<&Decomposition> = strategies.iter().filter(|d| d.unbiased).collect();
    order.sort_by(|a, b| a.variance_per_ray().total_cmp(&b.variance_per_ray()));
    order
}

/// Why the pixel is noisy with one strategy. It displays as a sentence.
#[derive(Clone, Copy, Debug)]
pub struct Diagnosis<'a> {
    decomposition: &'a Decomposition,
    /// The best unbiased strategy.
    unbiased: Option<&'a Decomposition>,
}

impl fmt::Display for Diagnosis<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.decomposition.shares.first(), self.decomposition.unbiased) {
            (None, true) => f.write_str("no error: all estimates of this pixel are equal"),
            (None, false) => {
                f.write_str("no noise, but biased: ")?;
                self.write_bias(f)
            }
            (Some(&first), true) => self.write_cause(f, first, "error"),
            (Some(&first), false) => {
                f.write_str("biased: ")?;
                self.write_bias(f)?;
                f.write_str("; ")?;
                self.write_cause(f, first, "noise")
            }
        }
    }
}

impl Diagnosis<'_> {
    /// The mean beside that of an unbiased strategy.
    fn write_bias(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        /// A difference that is not worth a number.
        const EQUAL: f64 = 5e-4;
        let mean = self.decomposition.mean;
        let Some(Decomposition { name, mean: exact, .. }) = self.unbiased else {
            return f.write_str("compare its mean with that of an unbiased strategy, such as mis");
        };
        let off = mean / exact - 1.0;
        match off {
            _ if mean == *exact || off.abs() < EQUAL => write!(f, "its mean is that of {name}"),
            f64::INFINITY => write!(f, "its mean is {mean:.2e}, and that of {name} is 0"),
            _ => {
                let side = if off < 0.0 { "below" } else { "above" };
                write!(f, "its mean is {} {side} that of {name}", percent(off.abs()))
            }
        }
    }

    /// The largest cause of `what`.
    fn write_cause(&self, f: &mut fmt::Formatter<'_>, first: Share, what: &str) -> fmt::Result {
        let (Share { cause, share }, decomposition) = (first, self.decomposition);
        if share >= 0.995 {
            write!(f, "nearly all of the {what}: ")?;
        } else {
            write!(f, "{} of the {what}: ", percent(share))?;
        }
        let of = |kind| decomposition.source(kind).copied();
        match cause {
            Cause::Coverage => write!(
                f,
                "{} of the camera samples show the scene: an edge, or a surface that is partly transparent",
                percent(decomposition.coverage)
            ),
            Cause::Background => f.write_str("the background differs between camera samples"),
            Cause::Emission => f.write_str("emission differs between camera samples"),
            Cause::Known => f.write_str("the part known without rays differs from pass to pass"),
            Cause::Shading(kind) => {
                write!(f, "the surfaces that the pixel shows reflect {kind} differently")
            }
            Cause::ShadowEdge(kind) => {
                let seen = of(kind).map_or(0.0, |statistics| statistics.seen);
                write!(f, "{kind} is seen by {} of the camera samples", percent(seen))
            }
            Cause::Directions(kind) => {
                let (rays, light) = of(kind).map_or((0.0, 0.0), |s| (s.rays, s.light));
                let rays = if rays < 5e-4 { "hardly any".to_owned() } else { percent(rays) };
                let light = percent(light);
                write!(f, "{rays} of the rays go to {kind}, which gives {light} of the light")
            }
            Cause::Penumbra(kind) => {
                let free = of(kind).and_then(|statistics| statistics.free).unwrap_or(0.0);
                write!(
                    f,
                    "{kind} is partly hidden: {} of the rays to it are unoccluded",
                    percent(free)
                )
            }
        }
    }
}

/// What would help at a pixel. It displays as a sentence.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "io", derive(serde::Serialize), serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Advice {
    /// There is no error.
    Nothing,
    /// All strategies are biased, so that their noise is not their error.
    AllBiased,
    /// The error of most strategies is between camera samples.
    CameraSamples {
        /// The strategy that needs the fewest rays.
        name: String,
        /// Share of its variance between camera samples.
        between: f64,
    },
    /// This strategy needs the fewest rays for the same error.
    Strategy {
        /// Name of the best strategy.
        name: String,
        /// How many times fewer rays than the next that is much worse.
        times_fewer: f64,
        /// That one.
        than: String,
    },
    /// All strategies perform about the same; more rays would help.
    Rays,
}

/// Advice for a pixel, given the variance of some strategies there. Biased strategies have no part in it.
pub fn advice(strategies: &[Decomposition]) -> Advice {
    /// A factor that is worth changing the strategy for.
    const WORTH: f64 = 1.5;
    let order = best_first(strategies);
    let (Some(best), Some(worst)) = (order.first(), order.last()) else {
        return if strategies.is_empty() { Advice::Nothing } else { Advice::AllBiased };
    };
    if worst.variance == 0.0 {
        return Advice::Nothing;
    }
    let (name, between) = (best.name.clone(), best.between_samples());
    let is_between = |d: &&&Decomposition| d.variance > 0.0 && d.between_samples() >= 0.5;
    if between >= 0.5 && 2 * order.iter().filter(is_between).count() >= order.len() {
        return Advice::CameraSamples { name, between };
    }
    let ratio = |d: &Decomposition| d.variance_per_ray() / best.variance_per_ray();
    let next = order.iter().find(|d| ratio(d) >= WORTH).map(|d| (ratio(d), d.name.clone()));
    if let Some((times_fewer, than)) = next {
        return Advice::Strategy { name, times_fewer, than };
    }
    Advice::Rays
}

impl fmt::Display for Advice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nothing => f.write_str("nothing needs to be done"),
            Self::AllBiased => f.write_str(
                "an unbiased strategy, such as mis, would show the bias: all strategies here are biased, and their noise \
                 is not their error",
            ),
            Self::CameraSamples { name, between } => write!(
                f,
                "more camera samples would help: {} of the error of {name}, the best here, is between them, and no \
                 choice of directions changes that",
                percent(*between)
            ),
            Self::Strategy { name, times_fewer, than } if times_fewer.is_finite() => {
                let digits = usize::from(*times_fewer < 10.0);
                write!(
                    f,
                    "{name} is best here: it needs {times_fewer:.digits$} times fewer rays than {than} to the same error"
                )
            }
            Self::Strategy { name, .. } => {
                write!(f, "{name} is best here: it has no error at this pixel")
            }
            Self::Rays => f.write_str("more rays would help; the strategies are about equal here"),
        }
    }
}

/// Two digits.
pub(super) fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    let digits = usize::from(percent.abs() < 10.0 && percent != 0.0);
    format!("{percent:.digits$} %")
}
