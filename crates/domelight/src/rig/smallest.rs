//! The smallest rig with a given shading error.

use super::{
    CompactExtraction, Extraction, ExtractionSettings, RigError, ShadingError, ShadingReference,
};
use crate::environment::Environment;

/// Lights above which no rig is tried.
const MAX_LIGHTS: usize = 4096;

/// A rig found for a target error.
#[derive(Clone, Debug)]
pub struct SmallestRig {
    /// The lights.
    pub extraction: Extraction,
    /// The error of the lights.
    pub error: ShadingError,
    /// The numbers of lights that were tried, in ascending order, with their errors.
    pub tried: Vec<(usize, ShadingError)>,
}

/// Finds the rig with the fewest lights whose matte and glossy errors are at most `target`.
///
/// The error falls with the number of lights, except for small ripples. The number is doubled until the
/// error is small enough, and the interval before is bisected, so that a rig with one light fewer fails.
/// A still smaller rig may succeed by chance. [`ExtractionSettings::n_lights`] is ignored.
///
/// # Errors
/// [`RigError::ErrorNotReached`] if 4096 lights, or as many lights as there are lit texels, have a larger
/// error; and those of [`extract`](super::extract()).
pub fn smallest_rig(
    environment: &Environment,
    settings: ExtractionSettings,
    target: f64,
) -> Result<SmallestRig, RigError> {
    let settings = ExtractionSettings { n_lights: Some(usize::MAX), ..settings };
    let compact = CompactExtraction::new(environment, settings)?;
    let reference = ShadingReference::new(environment);
    let mut search = Search { compact, reference, target, tried: Vec::new() };
    let mut too_few = search.compact.n_compact();
    let mut enough = too_few + 1;
    let mut best = loop {
        if let Some(found) = search.good_enough(enough)? {
            break found;
        }
        if enough >= search.most() {
            let (n_lights, error) = search.tried[search.tried.len() - 1];
            let percent = (100.0 * error.worst()) as f32;
            return Err(RigError::ErrorNotReached { n_lights, percent });
        }
        too_few = enough;
        enough = (2 * enough).min(search.most());
    };
    while enough - too_few > 1 {
        let middle = too_few.midpoint(enough);
        match search.good_enough(middle)? {
            Some(found) => (best, enough) = (found, middle),
            None => too_few = middle,
        }
    }
    search.tried.sort_by_key(|(n, _)| *n);
    let (extraction, error) = best;
    Ok(SmallestRig { extraction, error, tried: search.tried })
}

struct Search<'a> {
    compact: CompactExtraction<'a>,
    reference: ShadingReference,
    target: f64,
    tried: Vec<(usize, ShadingError)>,
}

impl Search<'_> {
    fn most(&self) -> usize {
        MAX_LIGHTS.min(self.compact.n_compact() + self.compact.n_lit()).max(1)
    }

    /// The rig of so many lights, if its error is small enough.
    fn good_enough(
        &mut self,
        n_lights: usize,
    ) -> Result<Option<(Extraction, ShadingError)>, RigError> {
        let extraction = self.compact.with_lights(Some(n_lights))?;
        let error = match &extraction.residual {
            Some(dome) => {
                self.reference.error_beside(&extraction.rig, &ShadingReference::new(dome))
            }
            None => self.reference.error(&extraction.rig),
        };
        self.tried.push((n_lights, error));
        Ok((error.worst() <= self.target).then_some((extraction, error)))
    }
}
