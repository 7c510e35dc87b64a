//! What happens to the sun before a map is prefiltered.

use std::borrow::Cow;
use std::str::FromStr;

use crate::environment::{Environment, EnvironmentError};
use crate::rig::{ExtractionSettings, Rig, RigError, extract};

/// What happens to the sun of a map.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum SunTreatment {
    /// It stays in the map.
    #[default]
    Keep,
    /// It is taken out of the map, for an engine that lights the scene by the sun itself.
    Remove,
    /// Every texel is scaled until its brightest channel is at most this \[W·m⁻²·sr⁻¹\].
    Clamp(f32),
}

/// A map whose sun was treated.
#[derive(Clone, Debug)]
pub struct TreatedEnvironment<'a> {
    /// The light that is left.
    pub environment: Cow<'a, Environment>,
    /// The sun that was removed, as a rig of one light.
    pub sun: Option<Rig>,
    /// The share of the light that was clamped, in \[0, 1\].
    pub clamped: f64,
}

/// An error in the treatment of a sun.
#[derive(Debug, thiserror::Error)]
pub enum SunError {
    /// There is no sun to remove.
    #[error(transparent)]
    Extraction(#[from] RigError),
    /// The sun is all of the light.
    #[error("all of its light is the sun; nothing is left")]
    NothingLeft,
    /// A limit of radiance that is no positive number.
    #[error("radiance is clamped to a positive number, not to {0}")]
    Limit(f32),
    /// Nothing is left of the map.
    #[error(transparent)]
    Environment(#[from] EnvironmentError),
}

impl SunTreatment {
    /// Treats the sun of an environment.
    ///
    /// # Errors
    /// If there is no sun to remove or nothing is left, or the limit is not positive.
    pub fn apply(self, environment: &Environment) -> Result<TreatedEnvironment<'_>, SunError> {
        let treated = |environment, sun, clamped| TreatedEnvironment { environment, sun, clamped };
        match self {
            Self::Keep => Ok(treated(Cow::Borrowed(environment), None, 0.0)),
            Self::Remove => {
                let settings = ExtractionSettings { sun: true, ..ExtractionSettings::default() };
                let extraction = extract(environment, settings)?;
                let residual = extraction.residual.ok_or(SunError::NothingLeft)?;
                Ok(treated(Cow::Owned(residual), Some(extraction.rig), 0.0))
            }
            Self::Clamp(radiance) if radiance > 0.0 && radiance.is_finite() => {
                let (rest, lost) = environment.clamped(radiance)?;
                Ok(treated(Cow::Owned(rest), None, lost))
            }
            Self::Clamp(radiance) => Err(SunError::Limit(radiance)),
        }
    }
}

/// A text that is no treatment of a sun.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is not keep, remove or clamp:X, such as clamp:100")]
pub struct UnknownSunTreatment(String);

impl FromStr for SunTreatment {
    type Err = UnknownSunTreatment;

    fn from_str(text: &str) -> Result<Self, UnknownSunTreatment> {
        let limit = text.strip_prefix("clamp:").and_then(|number| number.parse().ok());
        match (text, limit) {
            ("keep", _) => Ok(Self::Keep),
            ("remove", _) => Ok(Self::Remove),
            (_, Some(limit)) if limit > 0.0 && f32::is_finite(limit) => Ok(Self::Clamp(limit)),
            _ => Err(UnknownSunTreatment(text.to_owned())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::Orientation;
    use crate::{Rgb, RgbImage};

    fn sky(sun: f32) -> Environment {
        let mut map = RgbImage::filled(64, 32, Rgb::splat(0.5));
        map.pixels[10 * 64 + 40] = Rgb::splat(sun);
        Environment::new(map, Orientation::default(), 1.0).unwrap()
    }

    #[test]
    fn what_is_removed_is_returned() {
        let sky = sky(1e5);
        let treated = SunTreatment::Remove.apply(&sky).unwrap();
        let sun = treated.sun.unwrap();
        assert!(sun.lights.len() == 1 && sun.lights[0].irradiance.g > 100.0);
        let brightest =
            treated.environment.radiance_map().pixels.iter().map(|p| p.g).fold(0.0, f32::max);
        assert!(brightest < 1.0, "{brightest}");
        let kept = SunTreatment::Keep.apply(&sky).unwrap();
        assert!(kept.sun.is_none() && matches!(kept.environment, Cow::Borrowed(_)));
    }

    #[test]
    fn what_is_clamped_is_counted() {
        let sky = sky(1e5);
        let treated = SunTreatment::Clamp(0.5).apply(&sky).unwrap();
        assert!(
            (treated.environment.power() - sky.power() * (1.0 - treated.clamped)).abs()
                < 1e-6 * sky.power()
        );
        assert!(treated.clamped > 0.5);
    }

    #[test]
    fn errors_say_why() {
        let text =
            |treatment: SunTreatment, sun: f32| treatment.apply(&sky(sun)).unwrap_err().to_string();
        assert!(text(SunTreatment::Remove, 0.5).contains("sun"));
        for limit in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert!(text(SunTreatment::Clamp(limit), 1.0).contains("a positive number"));
        }
        for wrong in ["", "dim", "clamp:", "clamp:0", "clamp:-1", "clamp:nan", "clamp:inf", "clamp"]
        {
            assert!(wrong.parse::<SunTreatment>().is_err(), "{wrong}");
        }
        assert_eq!("clamp:2.5".parse(), Ok(SunTreatment::Clamp(2.5)));
    }
}
