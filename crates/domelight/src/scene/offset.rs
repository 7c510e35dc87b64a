//! Scenes far from the origin of their coordinates, such as those of maps (UTM) and of the whole Earth (ECEF).
//!
//! Half a meter is one unit in the last place of single precision 5000 km away. Such a scene is described relative to a
//! point nearby, which is subtracted in double precision.

use crate::math::DVec3;

/// The distance of the center from which on a scene is far away, in extents of the scene.
const FAR: f64 = 256.0;

/// The point near the center of `points` that their positions are to be relative to; zero unless they are far away.
/// Points that are not finite do not count.
pub(super) fn of_points(points: impl IntoIterator<Item = DVec3>) -> DVec3 {
    let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for point in points.into_iter().filter(|point| point.is_finite()) {
        (min, max) = (min.min(point), max.max(point));
        // More points only make the extent larger.
        if max != min && of_bounds(min, max) == DVec3::ZERO {
            return DVec3::ZERO;
        }
    }
    of_bounds(min, max)
}

/// The same for points whose bounds are known.
pub(super) fn of_bounds(min: DVec3, max: DVec3) -> DVec3 {
    let size = (max - min).max_element();
    let center = 0.5 * min + 0.5 * max;
    let is_usual = size.is_finite() && size >= f64::MIN_POSITIVE;
    if !is_usual || center.abs().max_element() < FAR * size {
        return DVec3::ZERO;
    }
    // Multiples of a power of two are subtracted from single-precision numbers without rounding.
    let unit = f64::from_bits(size.to_bits() & f64::INFINITY.to_bits());
    (center / unit).round() * unit
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The corners of a cube from −1 to 1, scaled and moved.
    fn cube(half: f64, center: DVec3) -> impl Iterator<Item = DVec3> {
        let sign = move |i: u32, axis: u32| if i >> axis & 1 == 0 { -half } else { half };
        (0..8).map(move |i| center + DVec3::new(sign(i, 0), sign(i, 1), sign(i, 2)))
    }

    #[test]
    fn only_what_is_far_away_is_moved() {
        let place = DVec3::new(448_262.35, 5_411_932.68, 320.1);
        let offset = of_points(cube(2.1, place));
        assert_eq!(offset, DVec3::new(448_264.0, 5_411_932.0, 320.0));
        let shell = DVec3::new(4_156_000.0, 672_000.0, 4_775_000.0);
        assert_eq!(of_points(cube(2.0, shell)), shell);
        // At any scale.
        assert_ne!(of_points(cube(2e-9, 1e-9 * place)), DVec3::ZERO);
        for near in [cube(1.0, DVec3::ZERO), cube(1.0, DVec3::splat(500.0)), cube(1e5, place)] {
            assert_eq!(of_points(near), DVec3::ZERO);
        }
    }

    #[test]
    fn what_has_no_extent_stays() {
        assert_eq!(of_points([]), DVec3::ZERO);
        assert_eq!(of_points([DVec3::splat(1e7); 3]), DVec3::ZERO);
        assert_eq!(of_points([DVec3::NAN, DVec3::INFINITY]), DVec3::ZERO);
        let place = DVec3::splat(1e6);
        let with_nan = std::iter::once(DVec3::NAN).chain(cube(1.0, place));
        assert_eq!(of_points(with_nan), place);
        assert_eq!(of_points([-f64::MAX, f64::MAX].map(DVec3::splat)), DVec3::ZERO);
    }
}
