//! Rejection sampling of the product of light and reflectance: Burke, Ghosh & Heidrich 2005,
//! "Bidirectional Importance Sampling for Direct Illumination".
//!
//! Directions are drawn from one factor and accepted with a probability proportional to the other. An
//! envelope with mass C bounds the product p̂. A try is accepted with probability a = ∫ p̂ / C, and accepted
//! directions follow p̂ exactly. There are two envelopes:
//!
//! ```text
//! from the environment   q = L_y / Q    keep with (f_r cos θ · L)_y / (L_y · g_max)   C = Q · g_max
//! from the BRDF          q = p_brdf     keep with L_y / L_max                         C = L_max
//! ```
//!
//! Here y is luminance, Q = ∫ L_y dω and g_max bounds the largest channel of f_r cos θ
//! ([`Brdf::max_eval`]), hence (g · L)_y ≤ g_max · L_y for any colors. The first accepts directions in
//! proportion to the luminance of the product. The second accepts them in proportion to p_brdf · L_y,
//! because f_r cos θ / p_brdf has no bound in general; that quotient stays in the weight, and so does the
//! color.
//!
//! To divide by the acceptance probability, a must be known, and estimating 1 / a or a from the same tries
//! is a trap: N accepted over T tries is biased upward if the tries stop at the N-th. There are two
//! stopping rules with an unbiased estimate, each with its limit on tries *inside* the estimate:
//!
//! * [`StoppingRule::Tries`]: always M tries, C/M · Σ accepted. This is plain importance sampling with the
//!   envelope, where most values are known to be zero without a ray. The points may be stratified.
//! * [`StoppingRule::Accepted`]: stop at the N-th acceptance or the M-th try. The unbiased estimate of a is
//!   the probability that the *first* try was accepted given how the tries ended (Girshick, Mosteller & Savage
//!   1946, "Unbiased Estimates for Certain Binomial Sampling Problems with Applications"): the fraction
//!   of the paths to the end that begin with an acceptance. That is (N − 1)/(T − 1) at the N-th (Haldane 1945, "On a
//!   Method of Estimating Frequencies") and k/M if the tries ran out with k < N accepted. The accepted
//!   directions are exchangeable and independent of T, so the estimate of a times C times the mean is
//!   unbiased for any limit, however low. The tries must be independent, because a stratified sequence
//!   reveals how many are still to come.
//!
//! At equal tries, both have the variance I (C − I) / M, to first order. Rejected: an unlimited number of
//! tries (a point that sees no light would never finish), and sampling from another density at the limit
//! (a bias, if a small one).

use super::{PointStrategy, SampleIndex, ShadingPoint};
use crate::Rgb;
use crate::bsdf::Brdf;
use crate::environment::Environment;
use crate::math::Vec3;
use crate::sampling::sampler::SamplePoint;
use crate::sampling::{Dimension, Pcg32};

/// The factor of the product from which directions are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Proposal {
    /// The environment, accepted by the BRDF.
    Environment,
    /// The BRDF, accepted by the environment.
    Brdf,
    /// The factor that accepts more samples, chosen at each point.
    ///
    /// With ρ = ∫ f_r cos θ dω, the BRDF's envelope of the product has the mass ρ · L_max
    /// (exact where the density follows f_r cos θ), so the environment is better where
    /// Q · g_max ≤ ρ · L_max. ρ is an approximation; its error costs tries but adds no bias.
    #[default]
    Tighter,
}

/// The rule that ends the tries at a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoppingRule {
    /// Stop after this many tries, at least 1. Each accepted direction is one shadow ray.
    Tries(u32),
    /// Stop at a number of accepted samples or a number of tries, whichever comes first. Tries use independent random
    /// numbers.
    Accepted {
        /// The number of directions to accept, at least 2.
        n: u32,
        /// The maximum number of tries, at least 1.
        max_tries: u32,
    },
}

/// A stopping rule without a useful unbiased estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RejectionError {
    /// No tries.
    #[error("rejection sampling needs at least one try")]
    NoTries,
    /// One accepted direction does not determine the acceptance rate.
    #[error(
        "stopping after {n} accepted directions: at least 2 are needed for an unbiased estimate \
         of the acceptance rate"
    )]
    TooFewAccepted {
        /// The requested number.
        n: u32,
    },
}

/// Statistics of the tries at a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RejectionStatistics {
    /// The factor that was sampled, never [`Proposal::Tighter`].
    pub proposal: Proposal,
    /// The number of directions drawn; 0 if the product is known to be zero.
    pub tries: u32,
    /// The number of directions accepted, which become shadow rays.
    pub accepted: u32,
    /// Whether the tries ran out before enough were accepted.
    pub ran_out: bool,
}

impl RejectionStatistics {
    /// The acceptance rate; 0 without tries.
    pub fn acceptance(&self) -> f32 {
        self.accepted as f32 / self.tries.max(1) as f32
    }
}

/// A shadow ray to be weighted once the number of tries is known.
#[derive(Clone, Copy, Debug)]
struct AcceptedSample {
    wi: Vec3,
    /// The ratio of its value to the envelope.
    value: Rgb,
}

/// Scratch memory of [`RejectionSampling`].
#[derive(Clone, Debug, Default)]
pub struct RejectionScratch(Vec<AcceptedSample>);

/// Samples the product of light and reflectance by rejection.
#[derive(Clone, Copy, Debug)]
pub struct RejectionSampling<'a> {
    environment: &'a Environment,
    proposal: Proposal,
    stop: StoppingRule,
}

/// The setup of the tries at a point.
#[derive(Clone, Copy, Debug)]
struct Envelope {
    /// Never [`Proposal::Tighter`].
    proposal: Proposal,
    /// The bound on the other factor.
    bound: f32,
    /// C.
    mass: f32,
}

impl<'a> RejectionSampling<'a> {
    /// Creates the strategy with a stopping rule.
    ///
    /// # Errors
    /// If there are no tries, or fewer than two accepted directions.
    pub fn new(
        environment: &'a Environment,
        proposal: Proposal,
        stop: StoppingRule,
    ) -> Result<Self, RejectionError> {
        match stop {
            StoppingRule::Tries(0) | StoppingRule::Accepted { max_tries: 0, .. } => {
                Err(RejectionError::NoTries)
            }
            StoppingRule::Accepted { n: n @ (0 | 1), .. } => {
                Err(RejectionError::TooFewAccepted { n })
            }
            _ => Ok(Self { environment, proposal, stop }),
        }
    }

    /// [`PointStrategy::sample`] that also returns the statistics of the tries.
    pub fn sample_counted(
        &self,
        at: &ShadingPoint,
        sample_index: SampleIndex,
        scratch: &mut RejectionScratch,
        mut push: impl FnMut(Vec3, Rgb),
    ) -> RejectionStatistics {
        let envelope = self.envelope(at);
        let kept = &mut scratch.0;
        kept.clear();
        let tries = self.draw(at, envelope, sample_index, kept);
        let accepted = kept.len() as u32;
        let weight = envelope.mass * self.stop.share(tries, accepted);
        for k in &*kept {
            push(k.wi, k.value * weight);
        }
        let ran_out = matches!(self.stop, StoppingRule::Accepted { n, .. } if accepted < n);
        RejectionStatistics { proposal: envelope.proposal, tries, accepted, ran_out }
    }

    fn envelope(&self, at: &ShadingPoint) -> Envelope {
        let g_max = at.bsdf.max_eval(at.wo);
        let l_max = self.environment.max_luminance();
        let light = Envelope {
            proposal: Proposal::Environment,
            bound: g_max,
            mass: self.environment.power() as f32 * g_max,
        };
        let brdf = Envelope { proposal: Proposal::Brdf, bound: l_max, mass: l_max };
        match self.proposal {
            Proposal::Environment => light,
            Proposal::Brdf => brdf,
            Proposal::Tighter => {
                let albedo = at.bsdf.directional_albedo(at.wo.z.clamp(0.0, 1.0)).luminance();
                if light.mass <= albedo * brdf.mass { light } else { brdf }
            }
        }
    }

    /// Fills `kept` and returns the number of tries.
    fn draw(
        &self,
        at: &ShadingPoint,
        envelope: Envelope,
        sample_index: SampleIndex,
        kept: &mut Vec<AcceptedSample>,
    ) -> u32 {
        if envelope.mass == 0.0 {
            return 0;
        }
        match self.stop {
            StoppingRule::Tries(n) => {
                let from_brdf = envelope.proposal == Proposal::Brdf;
                let dimension = if from_brdf { Dimension::Brdf } else { Dimension::Environment };
                kept.extend(
                    (0..n).filter_map(|j| {
                        self.attempt(at, envelope, sample_index.get(dimension, j, n))
                    }),
                );
                n
            }
            StoppingRule::Accepted { n, max_tries } => {
                let mut generator = sample_index.generator();
                let mut tries = 0;
                while tries < max_tries && kept.len() < n as usize {
                    kept.extend(self.attempt(at, envelope, four(&mut generator)));
                    tries += 1;
                }
                tries
            }
        }
    }

    fn attempt(
        &self,
        at: &ShadingPoint,
        envelope: Envelope,
        u: SamplePoint,
    ) -> Option<AcceptedSample> {
        if envelope.proposal == Proposal::Brdf {
            let s = at.sample(u.u_lobe(), u.u())?;
            let le = self.environment.le(s.wi);
            let y = le.luminance();
            let keep = u.u_accept() * envelope.bound < y;
            keep.then(|| AcceptedSample { wi: s.wi, value: s.value / s.pdf * (le / y) })
        } else {
            let s = self.environment.sample(u.u())?;
            let product = at.eval(s.wi) * s.le;
            let y = product.luminance();
            let keep = u.u_accept() * envelope.bound * s.le.luminance() < y;
            keep.then(|| AcceptedSample { wi: s.wi, value: product / y })
        }
    }
}

impl StoppingRule {
    /// The weight of each `accepted` direction: the estimated acceptance probability divided by their number.
    fn share(self, tries: u32, accepted: u32) -> f32 {
        match self {
            Self::Accepted { n, .. } if accepted == n => {
                (n - 1) as f32 / ((tries - 1) as f32 * n as f32)
            }
            _ => 1.0 / tries.max(1) as f32,
        }
    }
}

fn four(generator: &mut Pcg32) -> SamplePoint {
    SamplePoint([(); 4].map(|()| generator.next_f32()))
}

impl PointStrategy for RejectionSampling<'_> {
    type Scratch = RejectionScratch;

    const UNBIASED: bool = true;

    fn unit(&self) -> f64 {
        self.environment.unit()
    }

    fn n_rays(&self) -> u32 {
        match self.stop {
            StoppingRule::Tries(n) | StoppingRule::Accepted { n, .. } => n,
        }
    }

    fn sample(
        &self,
        at: &ShadingPoint,
        sample_index: SampleIndex,
        scratch: &mut RejectionScratch,
        push: impl FnMut(Vec3, Rgb),
    ) {
        self.sample_counted(at, sample_index, scratch, push);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The estimated acceptance probability is unbiased for every limit: sums probability times estimate over all ends
    /// of the walk exactly.
    #[test]
    fn the_limit_on_tries_does_not_bias() {
        for a in [0.01, 0.2, 0.5, 0.9, 1.0] {
            for n in [2, 3, 5] {
                for max_tries in [1, 2, 3, 4, 7, 40] {
                    let stop = StoppingRule::Accepted { n, max_tries };
                    // Probability of k kept after t tries, not yet stopped.
                    let mut walk = vec![0.0; n as usize];
                    walk[0] = 1.0;
                    let mut mean = 0.0;
                    for t in 1..=max_tries {
                        if t >= n {
                            let full = walk[n as usize - 1] * a;
                            mean += full * f64::from(n) * f64::from(stop.share(t, n));
                        }
                        for k in (0..n as usize).rev() {
                            walk[k] =
                                walk[k] * (1.0 - a) + if k > 0 { walk[k - 1] * a } else { 0.0 };
                        }
                    }
                    for k in 0..n {
                        let share = f64::from(stop.share(max_tries, k));
                        mean += walk[k as usize] * f64::from(k) * share;
                    }
                    assert!((mean - a).abs() < 1e-6, "{a} {n} of {max_tries}: {mean}");
                }
            }
        }
    }

    #[test]
    fn stops_without_an_estimate_are_refused() {
        let env = Environment::constant(Rgb::WHITE).unwrap();
        let new = |stop| RejectionSampling::new(&env, Proposal::Tighter, stop);
        assert_eq!(new(StoppingRule::Tries(0)).unwrap_err(), RejectionError::NoTries);
        let one = new(StoppingRule::Accepted { n: 1, max_tries: 10 }).unwrap_err();
        assert_eq!(one, RejectionError::TooFewAccepted { n: 1 });
        assert!(new(StoppingRule::Accepted { n: 2, max_tries: 1 }).is_ok());
    }
}
