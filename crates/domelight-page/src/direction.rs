//! The places of one direction in all of the page's pictures of directions.

use domelight::math::{Vec3, vec2};

use crate::map::mapping_of;
use crate::{Engine, Error};

/// The axes of the map of a hemisphere: to the right, to the top, and the normal.
type Axes = [Vec3; 3];

/// The direction at a place of the map of a hemisphere, which is Lambert's azimuthal equal-area projection; none outside.
fn above([x_axis, y_axis, normal]: Axes, x: f32, y: f32) -> Option<Vec3> {
    // r² = 1 − cos θ.
    let r2 = x * x + y * y;
    let scale = (2.0 - r2).max(0.0).sqrt();
    (r2 < 1.0).then(|| x_axis * (x * scale) + y_axis * (y * scale) + normal * (1.0 - r2))
}

/// The place of a direction; none below the horizon.
fn place([x_axis, y_axis, normal]: Axes, wi: Vec3) -> Option<[f32; 2]> {
    let cos = normal.dot(wi);
    let scale = 1.0 / (1.0 + cos).max(1.0).sqrt();
    (cos > 0.0).then(|| [x_axis.dot(wi) * scale, y_axis.dot(wi) * scale])
}

impl Engine {
    /// The places of a direction on the map in `mapping`, u and v, and on the hemisphere above a pixel, x to the right and y
    /// up in \[−1, 1\], both NaN below its horizon. `pixel` is as for [`Engine::inspect`], or empty. The direction is at (a, b)
    /// of a map, named by its mapping, or of the `hemisphere`; if there is none, the result is empty.
    ///
    /// # Errors
    /// If scene or environment are missing, the pixel is outside, or there is no such mapping.
    pub fn direction_at(
        &self,
        pixel: &str,
        from: &str,
        a: f32,
        b: f32,
        mapping: &str,
    ) -> Result<Vec<f32>, Error> {
        let upright = self.environment()?.orientation().up.from_y_up();
        let axes = if pixel.is_empty() { None } else { self.axes(pixel)? };
        let wi = match from {
            "hemisphere" => axes.and_then(|axes| above(axes, a, b)),
            _ => mapping_of(from)?.direction(vec2(a, b)).map(|direction| upright * direction),
        };
        let Some(wi) = wi else { return Ok(Vec::new()) };
        let on_map = mapping_of(mapping)?.uv(upright.transpose() * wi);
        let [x, y] = axes.and_then(|axes| place(axes, wi)).unwrap_or([f32::NAN; 2]);
        Ok(vec![on_map.x, on_map.y, x, y])
    }
}
