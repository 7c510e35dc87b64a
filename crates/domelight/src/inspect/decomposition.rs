//! Decomposes the variance of a strategy at a pixel by cause.
//!
//! Let t be the estimate from one camera sample, a sum of parts: the contributions of rays toward each source, and the
//! part known without rays. By the law of total variance, Var\[t\] = Var\[E\[t | p\]\] + E\[Var\[t | p\]\] over
//! points p of the pixel. Both terms are sums of covariances with the parts, Var\[t\] = Σ Cov\[t, tᵣ\], so that the
//! shares sum to 1. Each part is split once more, tᵣ = v uᵣ + (tᵣ − v uᵣ), where uᵣ is the same part with all rays
//! unoccluded and v = E\[tᵣ\] / E\[uᵣ\]: the first term varies with light, reflectance and densities, the second with
//! visibility. A cause with a negative share offsets others.
//!
//! Where a strategy's rays seldom reach a source, most points have at most one of them, whose visibility is 0 or 1. So would
//! be v, and nothing would be a penumbra. There, v is that of multiple importance sampling.

use std::fmt;

use super::CameraSample;
use super::KnownLight;
use super::regions::{Regions, Source, SourceKind};
use super::replicates::{N_PIXELS, Replicates, SAMPLES_PER_PIXEL};

/// A cause of differences between estimates of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "io", derive(serde::Serialize), serde(rename_all = "snake_case"))]
pub enum Cause {
    /// Some camera samples hit the scene, some miss it.
    Coverage,
    /// The background differs between camera samples.
    Background,
    /// Emission differs between camera samples.
    Emission,
    /// The part known without rays differs between camera samples, or between passes.
    Known,
    /// The unoccluded light of a source differs between camera samples: texture, curvature, materials.
    Shading(SourceKind),
    /// Only some of the camera samples see the source: the edge of a shadow.
    ShadowEdge(SourceKind),
    /// The density of directions does not follow the light of the source at a point.
    Directions(SourceKind),
    /// The source is partly hidden from a point: a penumbra.
    Penumbra(SourceKind),
}

impl Cause {
    /// Whether the cause lies between camera samples, so that no choice of directions changes it.
    pub fn is_between_samples(self) -> bool {
        !matches!(self, Self::Directions(_) | Self::Penumbra(_) | Self::Known)
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Coverage => f.write_str("edge of the scene"),
            Self::Background => f.write_str("background"),
            Self::Emission => f.write_str("emission"),
            Self::Known => f.write_str("known without rays"),
            Self::Shading(source) => write!(f, "shading, {source}"),
            Self::ShadowEdge(source) => write!(f, "shadow edge, {source}"),
            Self::Directions(source) => write!(f, "directions, {source}"),
            Self::Penumbra(source) => write!(f, "penumbra, {source}"),
        }
    }
}

/// A cause and its share of the variance.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "io", derive(serde::Serialize))]
pub struct Share {
    /// The cause.
    pub cause: Cause,
    /// The share of the variance; all shares sum to 1.
    pub share: f64,
}

/// Statistics of a strategy for a source.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "io", derive(serde::Serialize))]
pub struct SourceStatistics {
    /// The source.
    pub source: Source,
    /// The share of the strategy's rays toward the source.
    pub rays: f64,
    /// The share of the light reflected toward the camera that comes from the source, estimated by multiple importance
    /// sampling.
    pub light: f64,
    /// The mean visibility of the rays toward the source; `None` without such rays.
    pub free: Option<f64>,
    /// The share of the hits at which any light from the source was found.
    pub seen: f64,
}

/// The variance of a strategy at a pixel, decomposed by cause. Units are those of luminance.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "io", derive(serde::Serialize))]
pub struct Decomposition {
    /// The name of the strategy.
    pub name: String,
    /// Whether the strategy is unbiased. Otherwise its variance is not its error.
    pub unbiased: bool,
    /// The luminance of the pixel.
    pub mean: f64,
    /// The variance of the estimate from one camera sample. Directions are as well distributed as in a pass of 16
    /// samples per pixel; camera samples count as independent.
    pub variance: f64,
    /// The number of shadow rays per camera sample.
    pub rays_per_sample: f64,
    /// The fraction of the camera samples that hit the scene.
    pub coverage: f64,
    /// The causes in descending order of their share; empty if there is no variance.
    pub shares: Vec<Share>,
    /// The statistics for each source.
    pub sources: Vec<SourceStatistics>,
}

/// A variance below that share of the mean's square is rounding.
const ROUNDING: f64 = 1e-10;

impl Decomposition {
    pub(super) fn new(
        name: &str,
        unbiased: bool,
        samples: &[CameraSample],
        replicates: &Replicates,
        regions: &Regions,
        known: &KnownLight,
    ) -> Self {
        let light = &known.by_source;
        let means = Means::of(samples, replicates);
        let mut shares = means.between(regions.sources());
        let visible = |point: usize, part: usize| {
            let own = || ratio(means.seen[point][part], means.unoccluded[point][part]);
            let of_rays = replicates.visible(point, part);
            of_rays.or_else(|| known.visible(point, part)).unwrap_or_else(own)
        };
        for Share { cause, share } in within(samples, replicates, visible, regions.sources()) {
            // What is known without rays differs between camera samples and between passes.
            match shares.iter_mut().find(|other| other.cause == cause) {
                Some(other) => other.share += share,
                None => shares.push(Share { cause, share }),
            }
        }
        // A biased strategy has no light to find by chance.
        if unbiased {
            add_missed(&mut shares, replicates, regions.sources(), light, samples.len());
        }
        let variance: f64 = shares.iter().map(|share| share.share).sum();
        if variance <= ROUNDING * means.mean * means.mean {
            shares.clear();
        }
        shares.retain(|share| share.share != 0.0);
        for share in &mut shares {
            share.share /= variance;
        }
        shares.sort_by(|a, b| b.share.total_cmp(&a.share));
        Self {
            name: name.to_owned(),
            unbiased,
            mean: means.mean,
            variance: if shares.is_empty() { 0.0 } else { variance },
            rays_per_sample: replicates.rays_per_sample(),
            coverage: means.coverage,
            shares,
            sources: means.statistics(replicates, regions.sources(), light),
        }
    }

    /// The variance of the estimate from one shadow ray, or from one camera sample if there are no rays.
    pub fn variance_per_ray(&self) -> f64 {
        self.variance * if self.rays_per_sample > 0.0 { self.rays_per_sample } else { 1.0 }
    }

    /// The share of the variance between camera samples, which no choice of directions changes.
    pub fn between_samples(&self) -> f64 {
        let between = self.shares.iter().filter(|share| share.cause.is_between_samples());
        between.map(|share| share.share).sum()
    }

    /// What a strategy does with a source of that kind.
    pub(super) fn source(&self, kind: SourceKind) -> Option<&SourceStatistics> {
        self.sources.iter().find(|statistics| statistics.source.kind == kind)
    }
}

/// Means over replicates, and over the pixel.
struct Means {
    /// For each camera sample, the luminance that needs no estimate, and its index among the hits.
    samples: Vec<(f64, Option<usize>)>,
    /// The sum of each hit and part, with visibility and without.
    seen: Vec<Vec<f64>>,
    unoccluded: Vec<Vec<f64>>,
    /// The visible share of each part, over the pixel.
    visible: Vec<f64>,
    /// For each part, the mean over the hits of the covariance (over replicates) of a hit's sum with its part, divided by
    /// the number of replicates: the variation that the means of finitely many replicates have by themselves.
    seen_noise: Vec<f64>,
    unoccluded_noise: Vec<f64>,
    coverage: f64,
    mean: f64,
}

impl Means {
    fn of(samples: &[CameraSample], replicates: &Replicates) -> Self {
        let &Replicates { n_points, n_parts, n_passes, .. } = replicates;
        let n = n_passes as f64;
        let mean_of = |value: &dyn Fn(usize) -> f64| (0..n_passes).map(value).sum::<f64>() / n;
        let of_hits = |value: &dyn Fn(usize, usize, usize) -> f64| -> Vec<Vec<f64>> {
            let of_part = |i, part| mean_of(&|k| value(k, i, part));
            (0..n_points).map(|i| (0..n_parts).map(|part| of_part(i, part)).collect()).collect()
        };
        let seen = of_hits(&|k, i, part| replicates.seen(k, i, part));
        let unoccluded = of_hits(&|k, i, part| replicates.unoccluded(k, i, part));
        let visible = (0..n_parts).map(|part| {
            let sum = |of: &[Vec<f64>]| of.iter().map(|hit| hit[part]).sum::<f64>();
            ratio(sum(&seen), sum(&unoccluded))
        });
        let visible = visible.collect();
        let (mut seen_noise, mut unoccluded_noise) = (vec![0.0; n_parts], vec![0.0; n_parts]);
        for i in 0..n_points {
            let sums: Vec<f64> = (0..n_passes)
                .map(|k| (0..n_parts).map(|part| replicates.seen(k, i, part)).sum())
                .collect();
            for part in 0..n_parts {
                let scale = 1.0 / (n * n_points as f64);
                seen_noise[part] += scale * covariance(&sums, |k| replicates.seen(k, i, part));
                unoccluded_noise[part] +=
                    scale * covariance(&sums, |k| replicates.unoccluded(k, i, part));
            }
        }
        let mut hits = 0..n_points;
        let place =
            |sample: &CameraSample| (sample.known, sample.point.as_ref().and_then(|_| hits.next()));
        let samples: Vec<_> = samples.iter().map(place).collect();
        let estimated: f64 = seen.iter().flatten().sum();
        let known: f64 = samples.iter().map(|(known, _)| known).sum();
        Self {
            coverage: n_points as f64 / samples.len() as f64,
            mean: (estimated + known) / samples.len() as f64,
            samples,
            seen,
            unoccluded,
            visible,
            seen_noise,
            unoccluded_noise,
        }
    }

    /// The variance of E\[t | p\] over the pixel, by causes.
    fn between(&self, sources: &[Source]) -> Vec<Share> {
        let n = self.samples.len() as f64;
        // Unbiased for independent camera samples.
        let scale = n / (n - 1.0);
        let total = |&(known, hit): &(f64, Option<usize>)| {
            known + hit.map_or(0.0, |i| self.seen[i].iter().sum())
        };
        let hits: Vec<_> = self.samples.iter().filter(|(_, hit)| hit.is_some()).collect();
        let misses: Vec<_> = self.samples.iter().filter(|(_, hit)| hit.is_none()).collect();
        let totals =
            |of: &[&(f64, Option<usize>)]| of.iter().map(|s| total(s)).collect::<Vec<f64>>();
        let (of_hits, of_misses) = (totals(&hits), totals(&misses));
        let (h, m) = (self.coverage, 1.0 - self.coverage);
        let step = if h > 0.0 && m > 0.0 { average(&of_hits) - average(&of_misses) } else { 0.0 };
        let known = |of: &[&(f64, Option<usize>)]| of.iter().map(|s| s.0).collect::<Vec<f64>>();
        let (emission, background) = (known(&hits), known(&misses));
        let mut shares = vec![
            Share { cause: Cause::Coverage, share: scale * h * m * step * step },
            Share {
                cause: Cause::Background,
                share: scale * m * population_covariance(&of_misses, |i| background[i]),
            },
            Share {
                cause: Cause::Emission,
                share: scale * h * population_covariance(&of_hits, |i| emission[i]),
            },
        ];
        for (part, &visible) in self.visible.iter().enumerate() {
            let seen = population_covariance(&of_hits, |i| self.seen[i][part]);
            let unoccluded = population_covariance(&of_hits, |i| self.unoccluded[i][part]);
            let seen = scale * h * (seen - self.seen_noise[part]);
            let shading = scale * h * visible * (unoccluded - self.unoccluded_noise[part]);
            match sources.get(part) {
                Some(source) => {
                    shares.push(Share { cause: Cause::Shading(source.kind), share: shading });
                    let cause = Cause::ShadowEdge(source.kind);
                    shares.push(Share { cause, share: seen - shading });
                }
                None => shares.push(Share { cause: Cause::Known, share: seen }),
            }
        }
        shares
    }

    fn statistics(
        &self,
        replicates: &Replicates,
        sources: &[Source],
        light: &[f64],
    ) -> Vec<SourceStatistics> {
        let all_rays: u64 = replicates.rays.iter().sum();
        let all_light: f64 = light.iter().sum();
        let of_source = |(part, &source): (usize, &Source)| {
            let seen = self.seen.iter().filter(|hit| hit[part] > 0.0).count();
            let rays = replicates.rays[part] as f64;
            SourceStatistics {
                source,
                rays: ratio(rays, all_rays as f64),
                light: light.get(part).map_or(0.0, |&light| ratio(light, all_light)),
                free: (rays > 0.0).then(|| replicates.free[part] / rays),
                seen: ratio(seen as f64, self.seen.len() as f64),
            }
        };
        sources.iter().enumerate().map(of_source).collect()
    }
}

/// The variance of t given p, averaged over the pixel, by causes; `visible` has v of each point and part. It is that of a pixel's mean over 16 camera samples times
/// 16, so that directions which are well distributed over them count as such.
fn within(
    samples: &[CameraSample],
    replicates: &Replicates,
    visible: impl Fn(usize, usize) -> f64,
    sources: &[Source],
) -> Vec<Share> {
    let &Replicates { n_parts, n_passes, .. } = replicates;
    let n = SAMPLES_PER_PIXEL as f64;
    let (mut seen, mut shape) = (vec![0.0; n_parts], vec![0.0; n_parts]);
    let mut next = 0;
    for of_pixel in samples.chunks(SAMPLES_PER_PIXEL) {
        let hits = of_pixel.iter().filter(|sample| sample.point.is_some()).count();
        let points = next..next + hits;
        next = points.end;
        let mean_of = |k: usize, value: &dyn Fn(usize, usize) -> f64| {
            points.clone().map(|i| value(k, i)).sum::<f64>() / n
        };
        let part_of = |k, part| mean_of(k, &|k, i| replicates.seen(k, i, part));
        let sums: Vec<f64> =
            (0..n_passes).map(|k| (0..n_parts).map(|part| part_of(k, part)).sum()).collect();
        for part in 0..n_parts {
            let visible: Vec<f64> = points.clone().map(|i| visible(i, part)).collect();
            seen[part] += covariance(&sums, |k| part_of(k, part));
            shape[part] += covariance(&sums, |k| {
                mean_of(k, &|k, i| visible[i - points.start] * replicates.unoccluded(k, i, part))
            });
        }
    }
    let scale = n / N_PIXELS as f64;
    let mut shares = Vec::new();
    for part in 0..n_parts {
        let (seen, shape) = (scale * seen[part], scale * shape[part]);
        match sources.get(part) {
            Some(source) => {
                shares.push(Share { cause: Cause::Directions(source.kind), share: shape });
                shares.push(Share { cause: Cause::Penumbra(source.kind), share: seen - shape });
            }
            None => shares.push(Share { cause: Cause::Known, share: seen }),
        }
    }
    shares
}

/// Adds the variance that the estimates cannot show, for a source of which they found less than half. If k of n estimates
/// found it, at most about (k + 3) / n of all estimates do (the rule of three, at 95 %), so a mean ℓ has a variance of at
/// least ℓ² n / (k + 3).
fn add_missed(
    shares: &mut [Share],
    replicates: &Replicates,
    sources: &[Source],
    light: &[f64],
    n_samples: usize,
) {
    let found = replicates.light_by_source(n_samples);
    let n = (replicates.n_passes * n_samples) as f64;
    let all: f64 = light.iter().sum();
    for (part, (&there, &found)) in light.iter().zip(&found).enumerate() {
        /// Less is not worth a word.
        const LEAST: f64 = 0.02;
        if found >= 0.5 * there || there < LEAST * all {
            continue;
        }
        let least = there * there * n / (replicates.rays[part] as f64 + 3.0);
        let of_source = |share: &&mut Share| share.cause == Cause::Directions(sources[part].kind);
        if let Some(share) = shares.iter_mut().find(of_source) {
            share.share = share.share.max(least);
        }
    }
}

fn ratio(a: f64, b: f64) -> f64 {
    if b == 0.0 { 0.0 } else { a / b }
}

fn average(values: &[f64]) -> f64 {
    ratio(values.iter().sum(), values.len() as f64)
}

/// Unbiased.
fn covariance(a: &[f64], b: impl Fn(usize) -> f64) -> f64 {
    let n = a.len() as f64;
    population_covariance(a, b) * n / (n - 1.0)
}

/// The covariance of a whole population.
fn population_covariance(a: &[f64], b: impl Fn(usize) -> f64) -> f64 {
    let b: Vec<f64> = (0..a.len()).map(b).collect();
    let (mean_a, mean_b) = (average(a), average(&b));
    let products = a.iter().zip(&b).map(|(a, b)| (a - mean_a) * (b - mean_b));
    ratio(products.sum(), a.len() as f64)
}
