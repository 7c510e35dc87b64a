//! The hemisphere above a point as maps.
//!
//! A map is the disk of Lambert's azimuthal equal-area projection in a square. The normal is in the center, the
//! horizon is the circle, and every pixel has the same solid angle. The top of a map is the upper side of the surface;
//! of a surface that is nearly horizontal, the side away from the viewer.

use crate::Rgb;
use crate::environment::Environment;
use crate::math::{Frame, Vec3, vec3};
use crate::strategy::ShadingPoint;

/// Rays along an edge of a map's pixel.
const SUBPIXELS: usize = 4;

/// Light, reflectance and visibility above a point. Pixels outside the disk are black.
#[derive(Clone, Debug, PartialEq)]
pub struct Hemisphere {
    /// The number of pixels along an edge.
    pub resolution: usize,
    /// The x, y and z axes of the maps in world space: to the right, to the top, and the shading normal.
    pub frame: [[f32; 3]; 3],
    /// L \[W·m⁻²·sr⁻¹\].
    pub radiance: Vec<Rgb>,
    /// f_r · cos θ \[sr⁻¹\].
    pub bsdf_cos: Vec<Rgb>,
    /// V, in \[0, 1\].
    pub visibility: Vec<f32>,
    /// f_r · cos θ · L · V.
    pub product: Vec<Rgb>,
}

impl Hemisphere {
    pub(super) fn new(
        point: &ShadingPoint,
        environment: &Environment,
        resolution: usize,
        trace: impl Fn(&ShadingPoint, &[Vec3]) -> Vec<f32>,
    ) -> Self {
        let n = resolution * resolution;
        let frame = upright(point);
        let mut maps = Self {
            resolution,
            frame: [frame.x, frame.y, frame.z].map(|v| v.to_array()),
            radiance: vec![Rgb::BLACK; n],
            bsdf_cos: vec![Rgb::BLACK; n],
            visibility: vec![0.0; n],
            product: vec![Rgb::BLACK; n],
        };
        let unit = environment.unit() as f32;
        let mut wi = Vec::new();
        for row in 0..resolution {
            wi.clear();
            let mut pixels = Vec::new();
            for column in 0..resolution {
                for sub in 0..SUBPIXELS * SUBPIXELS {
                    let at = |i: usize, sub: usize| (i * SUBPIXELS + sub) as f32 + 0.5;
                    let edge = (resolution * SUBPIXELS) as f32;
                    let x = 2.0 * at(column, sub % SUBPIXELS) / edge - 1.0;
                    let y = 1.0 - 2.0 * at(row, sub / SUBPIXELS) / edge;
                    if let Some(local) = direction(x, y) {
                        wi.push(frame.to_world(local));
                        pixels.push(row * resolution + column);
                    }
                }
            }
            let visible = trace(point, &wi);
            let share = 1.0 / (SUBPIXELS * SUBPIXELS) as f32;
            for ((&wi, &pixel), v) in wi.iter().zip(&pixels).zip(visible) {
                let (le, f) = (environment.le(wi) * unit, point.eval(wi));
                maps.radiance[pixel] += le * share;
                maps.bsdf_cos[pixel] += f * share;
                maps.visibility[pixel] += v * share;
                maps.product[pixel] += f * le * (v * share);
            }
        }
        maps
    }
}

/// A ray of a strategy.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "io", derive(serde::Serialize))]
pub struct DirectionSample {
    /// The position on the maps, with x to the right and y up, in \[−1, 1\].
    pub place: [f32; 2],
    /// The luminance of its contribution if it is unoccluded.
    pub weight: f32,
    /// V, in \[0, 1\].
    pub visibility: f32,
}

/// The distribution of the rays that a strategy sends from a point.
#[derive(Clone, Debug, PartialEq)]
pub struct DirectionHistogram {
    /// The number of pixels along an edge.
    pub resolution: usize,
    /// The density \[sr⁻¹\], estimated by counting rays.
    pub density: Vec<f32>,
    /// The number of rays counted.
    pub n_rays: usize,
    /// Some of the rays.
    pub samples: Vec<DirectionSample>,
}

impl DirectionHistogram {
    pub(super) fn new(
        point: &ShadingPoint,
        rays: &[(Vec3, Rgb)],
        visibility: &[f32],
        resolution: usize,
    ) -> Self {
        /// Samples that are kept.
        const SHOWN: usize = 256;
        let n = resolution * resolution;
        let mut density = vec![0.0; n];
        // The disk has area π and 2π sr, the square area 4.
        let pixel = 8.0 / n as f32;
        let (frame, mut samples) = (upright(point), Vec::new());
        for (&(wi, weight), &visibility) in rays.iter().zip(visibility) {
            let Some(place) = place(&frame, wi) else { continue };
            let cell = |c: f32| {
                (((0.5 + 0.5 * c) * resolution as f32) as usize).min(resolution.saturating_sub(1))
            };
            density[cell(-place[1]) * resolution + cell(place[0])] +=
                1.0 / (pixel * rays.len() as f32);
            if samples.len() < SHOWN {
                samples.push(DirectionSample { place, weight: weight.luminance(), visibility });
            }
        }
        Self { resolution, density, n_rays: rays.len(), samples }
    }
}

/// The frame of a point's maps.
fn upright(point: &ShadingPoint) -> Frame {
    /// The cosine of 8°.
    const HORIZONTAL: f32 = 0.99;
    let normal = point.frame.z;
    let top = if normal.y.abs() < HORIZONTAL { Vec3::Y } else { -point.frame.to_world(point.wo) };
    Frame::from_z_and_tangent(normal, top.cross(normal))
}

/// The local direction at a place of the disk; none outside.
fn direction(x: f32, y: f32) -> Option<Vec3> {
    // r² = 1 − cos θ.
    let r2 = x * x + y * y;
    if r2 >= 1.0 {
        return None;
    }
    let scale = (2.0 - r2).sqrt();
    Some(vec3(x * scale, y * scale, 1.0 - r2).normalize())
}

/// The place of a world direction; none below the horizon.
fn place(frame: &Frame, wi: Vec3) -> Option<[f32; 2]> {
    let local = frame.to_local(wi);
    if local.z <= 0.0 {
        return None;
    }
    let scale = 1.0 / (1.0 + local.z).sqrt();
    Some([local.x * scale, local.y * scale])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_are_upright() {
        for normal in [vec3(0.6, 0.0, 0.8), vec3(-0.3, 0.5, -0.2).normalize()] {
            let frame = Frame::from_z(normal);
            let maps = upright(&ShadingPoint { frame, ..ShadingPoint::UNSET });
            assert!(maps.x.y.abs() < 1e-6 && maps.y.y > 0.0, "{maps:?}");
            assert!(maps.x.cross(maps.y).abs_diff_eq(normal, 1e-6));
        }
    }

    #[test]
    fn the_top_of_a_floor_is_away_from_the_viewer() {
        let frame = Frame::from_z(Vec3::Y);
        let wo = frame.to_local(vec3(0.0, 0.6, 0.8));
        let maps = upright(&ShadingPoint { frame, wo, ..ShadingPoint::UNSET });
        assert!(maps.y.abs_diff_eq(-Vec3::Z, 1e-6) && maps.x.abs_diff_eq(Vec3::X, 1e-6));
    }

    #[test]
    fn places_are_directions() {
        let frame = Frame::from_z(vec3(0.6, 0.0, 0.8));
        for (x, y) in [(0.0, 0.0), (0.5, -0.3), (-0.7, 0.7), (0.0, 0.99)] {
            let wi = frame.to_world(direction(x, y).unwrap());
            let [u, v] = place(&frame, wi).unwrap();
            assert!((u - x).abs() < 1e-5 && (v - y).abs() < 1e-5, "{x} {y}: {u} {v}");
        }
        assert_eq!(direction(0.8, 0.8), None);
        assert_eq!(place(&frame, -frame.z), None);
    }
}
