//! The acceptance rate and the number of tries of rejection sampling over some points.

use domelight::render::Counts;
use domelight::sampling::{Sampler, SamplerKind};
use domelight::strategy::{
    Proposal, RejectionSampling, RejectionScratch, RejectionStatistics, SampleIndex, ShadingPoint,
    StrategySpec,
};
use rayon::prelude::*;

/// Runs rejection sampling at each point without tracing rays.
pub fn count_tries(
    rejection: &RejectionSampling,
    points: &[ShadingPoint],
    seed: u64,
) -> Vec<RejectionStatistics> {
    let count = |(i, at): (usize, &ShadingPoint)| {
        let sampler = Sampler::new(SamplerKind::Independent, seed, i as u64);
        let numbers = SampleIndex { sampler, sample: 0 };
        rejection.sample_counted(at, numbers, &mut RejectionScratch::default(), |_, _| {})
    };
    points.par_iter().enumerate().map(count).collect()
}

/// The shading points for each accepted direction from which on a picture is called noise.
const RARE: u64 = 100;

/// Warns of a picture for which rejection sampling accepted almost nothing; `None` for other pictures.
pub fn warn_of_rare_acceptance(spec: StrategySpec, counts: &Counts) -> Option<String> {
    let StrategySpec::Rejection { proposal, .. } = spec else { return None };
    let Counts { shading_points, shadow_rays, .. } = *counts;
    if shading_points == 0 || shadow_rays >= shading_points.div_ceil(RARE) {
        return None;
    }
    let looks = if shadow_rays == 0 { "the model is black" } else { "the model is noise" };
    let accepted = if shadow_rays == 0 { "no direction".into() } else { shadow_rays.to_string() };
    let why = match proposal {
        Proposal::Brdf => {
            "directions drawn from the BRDF are accepted in proportion to the map's radiance over its brightest texel; draw \
             them from the map (proposal=environment) or from whichever accepts more (proposal=tighter), or use product"
        }
        Proposal::Environment => {
            "directions drawn from the map are accepted in proportion to the BRDF over its maximum; draw them from \
             whichever accepts more (proposal=tighter), or use product"
        }
        Proposal::Tighter => "light and BRDF have too little in common; use more tries, or product",
    };
    Some(format!(
        "{looks}: rejection accepted {accepted} at {shading_points} shading points; {why}"
    ))
}

/// The acceptance of rejection sampling over all points.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Acceptance {
    /// The number of points.
    pub points: usize,
    /// The mean acceptance rate over the points.
    pub mean: f64,
    /// The median number of tries.
    pub median_tries: u32,
    /// The share of the points whose tries ran out before enough were accepted.
    pub gave_up: f64,
}

impl Acceptance {
    /// Computes the acceptance from per-point statistics.
    pub fn of(statistics: &[RejectionStatistics]) -> Self {
        let n = statistics.len().max(1) as f64;
        let mut tries: Vec<u32> = statistics.iter().map(|s| s.tries).collect();
        tries.sort_unstable();
        Self {
            points: statistics.len(),
            mean: statistics.iter().map(|s| f64::from(s.acceptance())).sum::<f64>() / n,
            median_tries: tries.get(tries.len() / 2).copied().unwrap_or(0),
            gave_up: statistics.iter().filter(|s| s.ran_out).count() as f64 / n,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn acceptance_is_rare_below_one_direction_for_a_hundred_points() {
        let warning = |text: &str, shading_points, shadow_rays| {
            let counts = Counts { shading_points, shadow_rays, ..Counts::default() };
            warn_of_rare_acceptance(text.parse().unwrap(), &counts)
        };
        let black = warning("rejection:8:proposal=brdf", 1000, 0).unwrap();
        assert!(
            black.starts_with("the model is black: rejection accepted no direction"),
            "{black}"
        );
        assert!(black.contains("proposal=environment"), "{black}");
        let noise = warning("rejection:8:proposal=environment", 1000, 9).unwrap();
        assert!(noise.starts_with("the model is noise: rejection accepted 9 at 1000"), "{noise}");
        assert_eq!(warning("rejection:8", 1000, 10), None);
        assert_eq!(warning("rejection:8", 0, 0), None);
        assert_eq!(warning("brdf:8", 1000, 0), None);
    }
}
