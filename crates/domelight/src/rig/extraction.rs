//! Extraction of lights from an environment, with the residual.
//!
//! Compact sources come first: suns, lamps and windows. Each is extracted as a whole if it stands out from
//! its surroundings, and the gap is filled from around it. Then regions of the remaining light become
//! lights, or it stays as a dome beside the lights. Lights and residual add up to the environment, channel
//! by channel: the light taken from a texel is the difference of two single-precision numbers, summed in
//! double precision.

use std::str::FromStr;

use super::median_cut::{MedianCut, median_cut};
use super::texels::Texels;
use super::variance_minimization::{VarianceMinimization, variance_minimization};
use super::{Region, RegionSums, Rig, RigError, RigLight};
use crate::environment::Environment;
use crate::environment::compact::{CompactSource, SourceCriteria, compact_sources};
use crate::{Rgb, RgbImage};

/// The algorithm that divides a map into regions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Regions of equal energy.
    MedianCut(MedianCut),
    /// Regions of small variance.
    VarianceMinimization(VarianceMinimization),
}

impl Default for Method {
    fn default() -> Self {
        Self::VarianceMinimization(VarianceMinimization::default())
    }
}

impl Method {
    /// The names that [`FromStr`] reads; the first is the default.
    pub const NAMES: [&'static str; 3] =
        ["variance-minimization", "variance-minimization:2009", "median-cut"];

    /// The name of a method with its usual settings.
    pub fn name(self) -> &'static str {
        match self {
            Self::VarianceMinimization(settings) if settings == VarianceMinimization::poster() => {
                Self::NAMES[1]
            }
            Self::VarianceMinimization(_) => Self::NAMES[0],
            Self::MedianCut(_) => Self::NAMES[2],
        }
    }

    /// Divides all of the environment's light into `n_lights` lights.
    ///
    /// # Errors
    /// Those of [`median_cut`] and [`variance_minimization`].
    pub fn rig(self, environment: &Environment, n_lights: usize) -> Result<Rig, RigError> {
        match self {
            Self::MedianCut(settings) => median_cut(environment, n_lights, settings),
            Self::VarianceMinimization(settings) => {
                variance_minimization(environment, n_lights, settings)
            }
        }
    }
}

/// A name that is not in [`Method::NAMES`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no method {name:?}; known are {}", Method::NAMES.join(", "))]
pub struct UnknownMethod {
    /// The given name.
    pub name: String,
}

impl FromStr for Method {
    type Err = UnknownMethod;

    fn from_str(name: &str) -> Result<Self, UnknownMethod> {
        let usual = [
            Self::default(),
            Self::VarianceMinimization(VarianceMinimization::poster()),
            Self::MedianCut(MedianCut::default()),
        ];
        let found = usual.into_iter().find(|method| method.name() == name);
        found.ok_or_else(|| UnknownMethod { name: name.to_owned() })
    }
}

/// Settings for the extraction of lights.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ExtractionSettings {
    /// Extract the sun: the compact source with the most light among those within a cap of 7°.
    pub sun: bool,
    /// The maximum number of other compact sources to extract, those with the most light within a cap
    /// of 28°.
    pub n_lamps: usize,
    /// The number of lights, including compact ones, among which all light is divided. `None` leaves the light
    /// outside compact sources in the residual.
    pub n_lights: Option<usize>,
    /// The algorithm that divides the map after the compact sources are removed.
    pub method: Method,
    /// The share of the environment's luminance, in \[0, 1\], below which a light is left in the residual;
    /// by default 0 for regions and 0.001 for compact sources.
    pub min_share: Option<f32>,
}

/// An environment with its compact sources extracted, from which rigs of any size can be made.
#[derive(Clone, Debug)]
pub struct CompactExtraction<'a> {
    environment: &'a Environment,
    settings: ExtractionSettings,
    lights: Vec<RigLight>,
    sources: Vec<CompactSource>,
    /// The environment without them; none if there are none.
    residual: Option<Environment>,
}

/// Extracts lights from an environment.
///
/// # Errors
/// [`RigError::NoLights`] if no lights are requested, [`RigError::Black`] for an environment without
/// light, [`RigError::NoSun`] and [`RigError::NoLamp`] if nothing stands out from its surroundings by
/// a factor of 4 and no other lights are requested, [`RigError::TooDim`] if `min_share` leaves no
/// light, and [`RigError::TooFewTexels`].
pub fn extract(
    environment: &Environment,
    settings: ExtractionSettings,
) -> Result<Extraction, RigError> {
    let compact = CompactExtraction::new(environment, settings)?;
    if compact.n_regions(settings.n_lights) == 0 {
        return Ok(Extraction { rig: compact.compact_rig(), residual: lit(compact.residual) });
    }
    compact.with_lights(settings.n_lights)
}

/// A rig and its residual, which add up to the environment, channel by channel.
#[derive(Clone, Debug)]
pub struct Extraction {
    /// The lights.
    pub rig: Rig,
    /// The environment without the light of the rig, nowhere negative; `None` if the rig has all light.
    pub residual: Option<Environment>,
}

impl<'a> CompactExtraction<'a> {
    /// Extracts the compact sources.
    ///
    /// # Errors
    /// Those of [`extract`].
    pub fn new(
        environment: &'a Environment,
        settings: ExtractionSettings,
    ) -> Result<Self, RigError> {
        let ExtractionSettings { sun, n_lamps, n_lights, min_share, .. } = settings;
        if n_lights == Some(0) || (n_lights.is_none() && !sun && n_lamps == 0) {
            return Err(RigError::NoLights);
        }
        if environment.power() == 0.0 {
            return Err(RigError::Black);
        }
        let n_lamps = n_lights.map_or(n_lamps, |n| n_lamps.min(n - usize::from(sun)));
        let min_share = min_share.map_or(SourceCriteria::MIN_SHARE, f64::from);
        let sources =
            compact_sources(environment.map(), SourceCriteria { sun, n_lamps, min_share });
        if sun && !sources.first().is_some_and(|s| s.is_sun) {
            return Err(RigError::NoSun { min_share });
        }
        if sources.is_empty() && n_lights.is_none() {
            return Err(RigError::NoLamp { min_share });
        }
        let texels = Texels::new(environment);
        let mut lights: Vec<RigLight> = sources.iter().map(|s| compact_light(&texels, s)).collect();
        // By what was really taken, which may be in another order than what stood out.
        let mut order: Vec<usize> = (0..sources.len()).collect();
        order.sort_by(|&a, &b| {
            let sun = |i: usize| lights[i].region == Region::Sun;
            sun(b).cmp(&sun(a)).then(lights[b].share.total_cmp(&lights[a].share))
        });
        lights = order.iter().map(|&i| lights[i]).collect();
        let sources: Vec<CompactSource> = order.iter().map(|&i| sources[i].clone()).collect();
        let residual = (!sources.is_empty()).then(|| without(environment, &sources));
        Ok(Self { environment, settings, lights, sources, residual })
    }

    /// The compact lights, and what they leave of the environment.
    pub(super) fn into_parts(self) -> (Vec<RigLight>, Option<Environment>) {
        (self.lights, self.residual)
    }

    /// The number of compact sources found.
    pub fn n_compact(&self) -> usize {
        self.lights.len()
    }

    /// How many texels are lit beside them.
    pub(super) fn n_lit(&self) -> usize {
        self.rest().map().pixels.iter().filter(|le| le.luminance() > 0.0).count()
    }

    /// Makes a rig of `n_lights` lights, including compact ones, with all the light; or a rig of only
    /// the compact ones.
    ///
    /// # Errors
    /// Those of [`extract`].
    pub fn with_lights(&self, n_lights: Option<usize>) -> Result<Extraction, RigError> {
        let n_regions = self.n_regions(n_lights);
        if n_regions == 0 {
            return Ok(Extraction {
                rig: self.compact_rig(),
                residual: lit(self.residual.clone()),
            });
        }
        let regions = self.settings.method.rig(self.rest(), n_regions)?;
        self.combine(regions)
    }

    /// What compact sources leave.
    fn rest(&self) -> &Environment {
        self.residual.as_ref().unwrap_or(self.environment)
    }

    /// How many lights of regions a rig of `n_lights` has.
    fn n_regions(&self, n_lights: Option<usize>) -> usize {
        // Compact sources may have been all the light there was.
        let dark = self.rest().power() == 0.0 && !self.lights.is_empty();
        n_lights.filter(|_| !dark).map_or(0, |n| n.saturating_sub(self.lights.len()))
    }

    /// The compact lights alone.
    fn compact_rig(&self) -> Rig {
        let map = self.environment.map();
        let mut rig = Rig {
            lights: self.lights.clone(),
            width: map.width,
            height: map.height,
            labels: vec![Rig::NO_LIGHT; map.pixels.len()],
        };
        self.overlay(&mut rig.labels);
        rig
    }

    /// Writes the compact lights into labels.
    fn overlay(&self, labels: &mut [u32]) {
        for (i, source) in self.sources.iter().enumerate() {
            source.texels.iter().for_each(|&texel| labels[texel as usize] = i as u32);
        }
    }

    /// Compact lights and the lights of regions of the rest, without those that are too dim.
    fn combine(&self, mut regions: Rig) -> Result<Extraction, RigError> {
        let rest = self.rest();
        let power = |environment: &Environment| environment.power() * environment.unit();
        let scale = (power(rest) / power(self.environment)) as f32;
        regions.lights.iter_mut().for_each(|l| l.share *= scale);
        // Lights are in order, the dim ones last.
        let min_share = self.settings.min_share.unwrap_or(0.0);
        let n_kept = regions.lights.iter().take_while(|l| l.share >= min_share).count();
        let residual = (n_kept < regions.lights.len()).then(|| {
            let kept = |label: &u32| (*label as usize) < n_kept;
            let left = regions.labels.iter().zip(&rest.map().pixels);
            let pixels = left.map(|(label, &le)| if kept(label) { Rgb::BLACK } else { le });
            environment_of(rest, pixels.collect())
        });
        regions.lights.truncate(n_kept);
        let n_compact = self.lights.len() as u32;
        for label in &mut regions.labels {
            let kept = (*label as usize) < n_kept;
            *label = if kept { *label + n_compact } else { Rig::NO_LIGHT };
        }
        self.overlay(&mut regions.labels);
        regions.lights.splice(0..0, self.lights.iter().copied());
        if regions.lights.is_empty() {
            return Err(RigError::TooDim);
        }
        Ok(Extraction { rig: regions, residual: lit(residual) })
    }
}

/// A residual with any light.
fn lit(residual: Option<Environment>) -> Option<Environment> {
    residual.filter(|residual| residual.power() > 0.0)
}

/// The environment without compact sources.
fn without(environment: &Environment, sources: &[CompactSource]) -> Environment {
    let mut pixels = environment.map().pixels.clone();
    for source in sources {
        for (&texel, &rest) in source.texels.iter().zip(&source.residual) {
            pixels[texel as usize] = rest;
        }
    }
    environment_of(environment, pixels)
}

/// Other radiance of the same orientation, nowhere above the first.
fn environment_of(environment: &Environment, pixels: Vec<Rgb>) -> Environment {
    let map = RgbImage { pixels, ..*environment.map() };
    Environment::from_units(map, environment.orientation(), environment.unit())
        .expect("parts of a valid map are valid")
}

/// The light of what a source took.
fn compact_light(texels: &Texels, source: &CompactSource) -> RigLight {
    let mut sums = RegionSums::default();
    for (&texel, rest) in source.texels.iter().zip(&source.residual) {
        let (x, y) = (texel as usize % texels.width(), texel as usize / texels.width());
        let (le, rest) = (texels.row(y)[x].to_array(), rest.to_array());
        let taken = std::array::from_fn(|c| f64::from(le[c]) - f64::from(rest[c]));
        sums.add_texel(texels, x, y, taken);
    }
    let region = if source.is_sun { Region::Sun } else { Region::Lamp };
    sums.light(texels, texels.environment().power(), region)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn methods_are_read_by_their_names() {
        let read = |name: &str| name.parse::<Method>().map(Method::name);
        assert!(Method::NAMES.into_iter().all(|name| read(name) == Ok(name)));
        assert_eq!(Method::default().name(), Method::NAMES[0]);
        let error = read("k-means").unwrap_err().to_string();
        assert_eq!(
            error,
            "there is no method \"k-means\"; known are variance-minimization, variance-minimization:2009, median-cut"
        );
    }
}
