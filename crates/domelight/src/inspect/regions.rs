//! Divides the light into sources: the sun, lamps, and the rest of the map.

use crate::environment::Environment;
use crate::environment::compact::{SourceCriteria, compact_sources};
use crate::math::Vec3;

/// The most lamps that are distinguished.
const N_LAMPS: usize = 3;
/// The least share of the map's luminance that makes a source.
const MIN_SHARE: f64 = 0.01;

/// A part of the light.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "io", derive(serde::Serialize))]
pub struct Source {
    /// The kind of source.
    pub kind: SourceKind,
    /// The direction of its center in world space; `None` for the rest of the map.
    pub direction: Option<[f32; 3]>,
}

/// The kind of a part of the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "io", derive(serde::Serialize), serde(rename_all = "lowercase"))]
pub enum SourceKind {
    /// The brightest source no wider than 7°.
    Sun,
    /// A lamp or window, numbered from 1 in descending order of light.
    Lamp(u32),
    /// The light outside all sources.
    Rest,
}

impl std::fmt::Display for SourceKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Sun => f.write_str("the sun"),
            Self::Lamp(n) => write!(f, "lamp {n}"),
            Self::Rest => f.write_str("the rest of the map"),
        }
    }
}

/// Which source each texel belongs to.
#[derive(Debug)]
pub(super) struct Regions {
    /// Index of the source of each texel.
    labels: Vec<u8>,
    width: usize,
    /// The rest of the map comes last.
    sources: Vec<Source>,
}

impl Regions {
    pub(super) fn of(environment: &Environment) -> Self {
        let map = environment.map();
        let criteria = SourceCriteria { sun: true, n_lamps: N_LAMPS, min_share: MIN_SHARE };
        let found = compact_sources(map, criteria);
        let mut labels = vec![found.len() as u8; map.pixels.len()];
        let mut sources = Vec::new();
        let mut n_lamps = 0;
        for (label, source) in found.iter().enumerate() {
            let mut center = Vec3::ZERO;
            for &texel in &source.texels {
                labels[texel as usize] = label as u8;
                let (x, y) = (texel as usize % map.width, texel as usize / map.width);
                let weight = map.pixels[texel as usize].luminance();
                center += weight * environment.map_direction(x as f64 + 0.5, y as f64 + 0.5);
            }
            let kind = if source.is_sun {
                SourceKind::Sun
            } else {
                n_lamps += 1;
                SourceKind::Lamp(n_lamps)
            };
            sources.push(Source { kind, direction: Some(center.normalize_or_zero().to_array()) });
        }
        sources.push(Source { kind: SourceKind::Rest, direction: None });
        Self { labels, width: map.width, sources }
    }

    /// All, the rest of the map last.
    pub(super) fn sources(&self) -> &[Source] {
        &self.sources
    }

    /// The index of the source that lies in a direction.
    pub(super) fn source_of(&self, environment: &Environment, wi: Vec3) -> usize {
        let [x, y] = environment.texel_at(wi);
        usize::from(self.labels[y * self.width + x])
    }
}
