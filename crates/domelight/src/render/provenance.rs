//! Provenance: how a picture was made, as attributes of its file.

use super::RenderSettings;
use crate::picture::exposure::Exposure;

/// The attribute of OpenEXR files that keeps the automatic exposure of a render \[stops\].
const EXPOSURE: &str = "domelight.exposure";

/// How a picture was made, in enough detail to render it again. All front ends write the same attributes.
#[derive(Clone, Copy, Debug)]
pub struct Provenance<'a> {
    /// The user's name for the scene.
    pub scene: &'a str,
    /// The user's name for the environment.
    pub environment: &'a str,
    /// [`StrategySpec::description`](crate::strategy::StrategySpec::description) with the pilot's choices, or the name
    /// of a custom strategy.
    pub strategy: &'a str,
    /// The render settings.
    pub settings: &'a RenderSettings,
    /// The automatic exposure \[stops\]; see [`automatic_exposure`](super::automatic_exposure).
    pub exposure: f32,
}

impl Provenance<'_> {
    /// The names and values of the attributes, in file order.
    pub fn attributes(&self) -> Vec<(String, String)> {
        let Self { scene, environment, strategy, settings, exposure } = *self;
        let mut attributes = vec![
            ("domelight.version", env!("CARGO_PKG_VERSION").to_owned()),
            ("domelight.scene", scene.to_owned()),
            ("domelight.environment", environment.to_owned()),
            ("domelight.strategy", strategy.to_owned()),
            ("domelight.samples", settings.n_samples.to_string()),
            ("domelight.adaptive", settings.adaptive.to_string()),
            ("domelight.passes", settings.passes.name().to_owned()),
            ("domelight.sampler", settings.sampler.name().to_owned()),
            ("domelight.filter", settings.filter.name().to_owned()),
            ("domelight.seed", settings.seed.to_string()),
        ];
        let target =
            settings.target_error.map(|error| ("domelight.target_error", error.to_string()));
        attributes.extend(target);
        attributes.push((EXPOSURE, exposure.to_string()));
        attributes.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
    }
}

/// The automatic exposure \[stops\] stored in a file's attributes, if any.
pub fn kept_exposure(attributes: &[(String, String)]) -> Option<f32> {
    let (_, value) = attributes.iter().find(|(name, _)| name == EXPOSURE)?;
    match value.parse() {
        Ok(Exposure::Stops(stops)) => Some(stops),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attributes_keep_the_exposure() {
        let settings = RenderSettings { n_samples: 3, seed: 7, ..Default::default() };
        let provenance = Provenance {
            scene: "statue",
            environment: "sky",
            strategy: "product, up to 8 per camera sample",
            settings: &settings,
            exposure: -1.25,
        };
        let mut attributes = provenance.attributes();
        let of = |name: &str| attributes.iter().find(|(n, _)| n == name).map(|(_, v)| &v[..]);
        assert_eq!(of("domelight.samples"), Some("3"));
        assert_eq!(of("domelight.adaptive"), Some("true"));
        assert_eq!(of("domelight.target_error"), None);
        assert_eq!(of("domelight.passes"), Some("efficient"));
        assert_eq!(of("domelight.sampler"), Some("sobol"));
        assert_eq!(kept_exposure(&attributes), Some(-1.25));
        for bad in ["auto", "nan", ""] {
            attributes.last_mut().unwrap().1 = bad.to_owned();
            assert_eq!(kept_exposure(&attributes), None, "{bad}");
        }
        assert_eq!(kept_exposure(&[]), None);
    }
}
