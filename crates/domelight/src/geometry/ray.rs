//! Rays, batches of rays, and hits.

use crate::math::Vec3;

/// A ray with the open interval (0, `t_max`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// The origin.
    pub origin: Vec3,
    /// The direction; distances are in units of its length.
    pub direction: Vec3,
    /// The end of the interval, `f32::INFINITY` for a shadow ray to the environment.
    pub t_max: f32,
}

impl Ray {
    /// Creates a ray to infinity.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, t_max: f32::INFINITY }
    }

    /// origin + t · direction.
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + t * self.direction
    }
}

/// The nearest intersection of a ray with a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The distance in units of the direction's length.
    pub t: f32,
    /// The barycentric weight of the triangle's second vertex.
    pub u: f32,
    /// The barycentric weight of the triangle's third vertex.
    pub v: f32,
    /// The index of the triangle.
    pub triangle: u32,
}

impl Hit {
    /// The same hit where the triangles are numbered from `first` on.
    #[inline]
    pub(crate) fn numbered_from(self, first: u32) -> Self {
        Self { triangle: self.triangle + first, ..self }
    }
}

/// Shadow rays to infinity in structure-of-arrays form.
#[derive(Clone, Debug, Default)]
pub struct RayBatch {
    /// The origins.
    pub origins: Vec<Vec3>,
    /// The unit directions, as many as origins.
    pub directions: Vec<Vec3>,
}

impl RayBatch {
    /// Appends a ray.
    pub fn push(&mut self, origin: Vec3, direction: Vec3) {
        self.origins.push(origin);
        self.directions.push(direction);
    }

    /// The number of rays.
    pub fn len(&self) -> usize {
        self.origins.len()
    }

    /// Whether there are no rays.
    pub fn is_empty(&self) -> bool {
        self.origins.is_empty()
    }

    /// Removes the rays and keeps the memory.
    pub fn clear(&mut self) {
        self.origins.clear();
        self.directions.clear();
    }
}

/// Offsets a ray's origin from the surface, to the side of `normal`, by a few units in the last place:
/// far enough not to hit the surface where it starts, and too little to be visible.
///
/// Near the origin, where units in the last place vanish, the offset is 2⁻¹⁶ of `extent`, the size of
/// the scene, or of 1 if that is less.
///
/// Wächter & Binder 2019, "A Fast and Robust Method for Avoiding Self-Intersection", Ray Tracing
/// Gems chapter 6.
pub fn offset_origin(position: Vec3, normal: Vec3, extent: f32) -> Vec3 {
    const INT_SCALE: f32 = 256.0;
    let unit = extent.min(1.0);
    let (origin, float_scale) = (unit / 32.0, unit / 65536.0);
    let offset = |p: f32, n: f32| {
        if p.abs() < origin {
            return p + float_scale * n;
        }
        let steps = (INT_SCALE * n) as i32;
        f32::from_bits(p.to_bits().wrapping_add_signed(if p < 0.0 { -steps } else { steps }))
    };
    Vec3::new(
        offset(position.x, normal.x),
        offset(position.y, normal.y),
        offset(position.z, normal.z),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vec3;

    #[test]
    fn the_offset_goes_to_the_side_of_the_normal() {
        for p in [vec3(0.0, 1e-3, 1e3), vec3(-5.0, -1e-9, 2.0)] {
            for n in [vec3(0.6, -0.8, 0.0), vec3(0.0, 0.0, 1.0), vec3(-0.6, 0.0, -0.8)] {
                for extent in [1e-3, 1.0, 1e4] {
                    let q = offset_origin(p, n, extent);
                    assert!((q - p).dot(n) > 0.0);
                    assert!((q - p).length() < 1e-4 * p.length());
                }
            }
        }
    }
}
