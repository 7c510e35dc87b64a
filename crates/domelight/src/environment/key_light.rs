//! Finds the key light of a map, to rotate the map so that this light falls on the visible side of the subject.

use super::statistics::{ProbeStatistics, Sun, texel_direction};
use super::{LatLongGrid, UpAxis};
use crate::color::Rgb;
use crate::image::RgbImage;
use crate::math::{Vec3, functions};

/// Rows of the reduced map on which the sun is looked for.
const ROWS: usize = 256;

/// The minimum share of the map's light for a compact source to be the key light.
const LEAST_SHARE: f64 = 0.1;

/// Below this share of all light, the direction of the horizontal light vector is not meaningful.
const LEAST_ANISOTROPY: f64 = 1e-3;

/// From the direction to the camera, around the up axis \[degrees\]: negative is on the picture's left.
const BESIDE_CAMERA: f32 = -45.0;

/// The rotation \[degrees\] of [`Orientation`](super::Orientation), in (−180, 180\], at which the key light of a
/// lat-long map comes from the left of a camera: 45° around the up axis from the direction `toward_camera`, which may
/// have any length.
///
/// The key light is the sun of the map or, without a sun that gives a tenth of the light, the direction in the plane of
/// the horizon from which most light comes. Maps without such a direction are not rotated.
///
/// # Panics
/// If the map has no texels.
pub fn key_light_rotation(map: &RgbImage, up: UpAxis, toward_camera: Vec3) -> f32 {
    let map = reduced(map);
    let sun = ProbeStatistics::new(&map).sun.filter(|sun| sun.share >= LEAST_SHARE);
    let key = sun.map(|Sun { direction, .. }| direction).or_else(|| light_vector(&map));
    let Some(key) = key else { return 0.0 };
    let toward_camera = up.from_y_up().transpose() * toward_camera;
    // Counterclockwise as seen from above.
    let angle = |v: Vec3| functions::atan2(v.x, v.z).to_degrees();
    let turn = angle(toward_camera) + BESIDE_CAMERA - angle(key);
    180.0 - (180.0 - turn).rem_euclid(360.0)
}

/// The map with blocks of texels averaged to some hundred rows.
fn reduced(map: &RgbImage) -> RgbImage {
    let block = map.height.div_ceil(ROWS);
    let (width, height) = (map.width.div_ceil(block), map.height.div_ceil(block));
    RgbImage::from_fn(width, height, |x, y| {
        let columns = x * block..map.width.min((x + 1) * block);
        let rows = y * block..map.height.min((y + 1) * block);
        let n = (columns.len() * rows.len()) as f32;
        let texels = rows.flat_map(|y| &map.row(y)[columns.clone()]);
        texels.fold(Rgb::BLACK, |sum, &texel| sum + texel * (1.0 / n))
    })
}

/// ∫ L ω dω, in luminance, if its horizontal part is not negligible.
fn light_vector(map: &RgbImage) -> Option<Vec3> {
    let grid = LatLongGrid::new(map.width, map.height);
    let (mut vector, mut all) = ([0.0f64; 3], 0.0);
    for y in 0..map.height {
        let omega = grid.column_angle() * grid.band(y..y + 1);
        for (x, texel) in map.row(y).iter().enumerate() {
            let power = f64::from(texel.luminance()) * omega;
            let direction = texel_direction(map, x, y).to_array();
            vector.iter_mut().zip(direction).for_each(|(v, d)| *v += power * f64::from(d));
            all += power;
        }
    }
    let [x, _, z] = vector;
    let horizontal = (x * x + z * z).sqrt();
    (horizontal > LEAST_ANISOTROPY * all).then(|| Vec3::new(x as f32, 0.0, z as f32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::builtin::BuiltinProbe;
    use crate::environment::{Environment, Orientation};

    /// The angle of a direction about the up axis from that toward the camera \[degrees\], to the right of the picture.
    fn beside(light: Vec3, toward_camera: Vec3, up: Vec3) -> f32 {
        let flat = |v: Vec3| (v - up * v.dot(up)).normalize();
        let (light, camera) = (flat(light), flat(toward_camera));
        light.dot(up.cross(camera)).atan2(light.dot(camera)).to_degrees()
    }

    #[test]
    fn the_sun_comes_to_the_left_of_every_camera() {
        for (up, axis) in [(UpAxis::Y, Vec3::Y), (UpAxis::Z, Vec3::Z)] {
            let cameras = [Vec3::new(3.0, 1.0, 2.0), Vec3::new(-1.0, 0.4, -5.0), Vec3::X];
            for toward_camera in cameras {
                for height in [64, 300] {
                    let map = BuiltinProbe::Sky.image(height);
                    let rotation = key_light_rotation(&map, up, toward_camera);
                    assert!(rotation > -180.0 && rotation <= 180.0);
                    let sun = ProbeStatistics::new(&map).sun.unwrap().direction;
                    let sun = Orientation { up, rotation }.map_to_world() * sun;
                    let angle = beside(sun, toward_camera, axis);
                    assert!((angle + 45.0).abs() < 2.0, "{angle} at {toward_camera}");
                }
            }
        }
    }

    /// A map without a sun is turned by its broad lights: more light falls on the visible side than from behind.
    #[test]
    fn broad_lights_fall_on_the_visible_side() {
        for probe in [BuiltinProbe::Studio, BuiltinProbe::Cathedral] {
            let map = probe.image(64);
            for toward_camera in [Vec3::Z, Vec3::NEG_X] {
                let rotation = key_light_rotation(&map, UpAxis::Y, toward_camera);
                let orientation = Orientation { up: UpAxis::Y, rotation };
                let environment = Environment::new(map.clone(), orientation, 1.0).unwrap();
                let irradiance = |normal: Vec3| {
                    let texels = (0..64).flat_map(|y| (0..128).map(move |x| (x, y)));
                    texels
                        .map(|(x, y)| {
                            let wi = texel_direction(&map, x, y);
                            let sin_theta = (1.0 - wi.y * wi.y).max(0.0).sqrt();
                            environment.le(wi).luminance() * wi.dot(normal).max(0.0) * sin_theta
                        })
                        .sum::<f32>()
                };
                assert!(irradiance(toward_camera) > irradiance(-toward_camera), "{probe:?}");
            }
        }
    }

    #[test]
    fn maps_of_no_direction_are_not_turned() {
        for value in [0.0, 1.0] {
            let map = RgbImage::filled(8, 4, Rgb::splat(value));
            assert_eq!(key_light_rotation(&map, UpAxis::Y, Vec3::X), 0.0);
        }
    }
}
