//! Depth of field in the user's terms: an f-number, a focus distance, and the number of aperture blades.

use std::fmt;
use std::str::FromStr;

use domelight::scene::{CameraSettings, Lens, SceneDescription};
use serde::Serialize;

use crate::Error;

/// Depth of field in the notation of `--dof`: `F,DIST` or `F,DIST,BLADES`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DepthOfField {
    /// The f-number, > 0; a smaller number blurs more.
    pub f_number: f32,
    /// The focus distance along the camera's axis, > 0; `None` is the distance of the subject's center.
    pub focus_distance: Option<f32>,
    /// The number of aperture blades, at least 3; 0 is a round aperture.
    pub blades: u32,
}

/// A text that is no depth of field.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "'{0}' is not an f-number and a distance or auto, such as 2.8,auto or 1.4,3.5, optionally \
     with 3 to 64 blades as in 2.8,auto,6"
)]
pub struct BadDepthOfField(String);

impl FromStr for DepthOfField {
    type Err = BadDepthOfField;

    fn from_str(text: &str) -> Result<Self, BadDepthOfField> {
        let bad = || BadDepthOfField(text.to_owned());
        let positive = |text: &str| match text.trim().parse::<f32>() {
            Ok(x) if x > 0.0 && x.is_finite() => Ok(x),
            _ => Err(bad()),
        };
        let parts: Vec<&str> = text.split(',').collect();
        let (f_number, distance, blades) = match parts[..] {
            [f_number, distance] => (f_number, distance, None),
            [f_number, distance, blades] => (f_number, distance, Some(blades)),
            _ => return Err(bad()),
        };
        let blades = match blades.map(|blades| blades.trim().parse()) {
            None => 0,
            Some(Ok(blades)) if (3..=64).contains(&blades) => blades,
            Some(_) => return Err(bad()),
        };
        let focus_distance = match distance.trim() {
            "auto" => None,
            distance => Some(positive(distance)?),
        };
        Ok(Self { f_number: positive(f_number)?, focus_distance, blades })
    }
}

impl fmt::Display for DepthOfField {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.f_number)?;
        match self.focus_distance {
            Some(distance) => write!(f, ",{distance}")?,
            None => f.write_str(",auto")?,
        }
        if self.blades == 0 { Ok(()) } else { write!(f, ",{}", self.blades) }
    }
}

impl DepthOfField {
    /// With the distance of what is sharp: of the subject's center, if that is before the camera, else of its target.
    pub(crate) fn focused(self, camera: &CameraSettings, scene: &SceneDescription) -> (Self, f32) {
        let forward = (camera.target - camera.origin).normalize_or_zero();
        let center = (scene.subject_bounds().center() - camera.origin).dot(forward);
        let target = (camera.target - camera.origin).length();
        let automatic = if center > 0.0 && center.is_finite() { center } else { target };
        (self, self.focus_distance.unwrap_or(automatic))
    }

    pub(crate) fn lens(self, camera: &CameraSettings, focus_distance: f32) -> Result<Lens, Error> {
        Ok(Lens::new(camera, self.f_number, focus_distance, self.blades)?)
    }
}
