//! Statistics of a light probe: brightness, concentration, and the position of its sun.
//!
//! Everything is weighted by the exact solid angle of the texels, in f64. Means over pixels, which
//! overweight the poles, are included only because other programs print them.

use std::f64::consts::{FRAC_PI_2, PI};

use super::LatLongGrid;
use super::compact::{SourceCriteria, compact_sources};
use super::lat_long::{RowIntegrals, column_integrals, even_disc_radius};
use super::mapping::Mapping;
use crate::color::Rgb;
use crate::image::RgbImage;
use crate::math::{Vec3, functions, vec2};

/// A part of this size counts as the brightest texels.
const BRIGHTEST: f64 = 0.001;

/// Statistics of a lat-long map.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbeStatistics {
    /// The minimum luminance above zero; 0 if the map is black.
    pub min_luminance: f32,
    /// The maximum luminance.
    pub max_luminance: f32,
    /// The mean over pixels.
    pub pixel_mean: Rgb,
    /// The mean radiance over the sphere, ∫ L dω / 4π.
    pub mean_radiance: Rgb,
    /// The irradiance of a surface that faces up, ∫ L max(0, ω·Y) dω \[W·m⁻²\].
    pub irradiance_up: Rgb,
    /// The share of ∫ L dω (in luminance) in the brightest 0.1 % of the texels, in \[0, 1\].
    pub brightest_share: f64,
    /// The sun, if there is one.
    pub sun: Option<Sun>,
    /// Adjacent texels with the maximum value, if there are any: a source that the camera clipped, or an evenly bright
    /// one.
    pub plateau: Option<Plateau>,
}

/// A sharply bounded set of texels with the maximum value of the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plateau {
    /// The value of their largest channel.
    pub value: f32,
    /// The number of texels.
    pub n_texels: usize,
    /// Their solid angle \[sr\].
    pub solid_angle: f64,
    /// Their share of ∫ L dω (in luminance), in \[0, 1\].
    pub share: f64,
}

/// The compact source identified as the sun: the radiance in excess of its surroundings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// The energy centroid, a unit vector.
    pub direction: Vec3,
    /// The solid angle of its texels \[sr\], including the glare around it.
    pub solid_angle: f64,
    /// The angular radius of the uniform disc with the same variance \[rad\].
    pub angular_radius: f64,
    /// The irradiance at normal incidence \[W·m⁻²\].
    pub irradiance: Rgb,
    /// Its share of ∫ L dω (in luminance), in \[0, 1\].
    pub share: f64,
}

impl ProbeStatistics {
    /// Computes the statistics of a lat-long map with finite radiance ≥ 0 and any shape.
    ///
    /// # Panics
    /// If the map has no texels.
    pub fn new(map: &RgbImage) -> Self {
        assert!(!map.pixels.is_empty(), "an empty map");
        let luminance: Vec<f32> = map.pixels.iter().map(|p| p.luminance()).collect();
        let positive = luminance.iter().copied().filter(|&l| l > 0.0);
        let min = positive.fold(f32::INFINITY, f32::min);
        let weights = Weights::new(map);
        Self {
            min_luminance: if min.is_finite() { min } else { 0.0 },
            max_luminance: luminance.iter().copied().fold(0.0, f32::max),
            pixel_mean: weighted_sum(map, |_| 1.0 / map.pixels.len() as f64),
            mean_radiance: weighted_sum(map, |y| weights.solid_angle(y) / (4.0 * PI)),
            irradiance_up: weighted_sum(map, |y| weights.projected_up(y)),
            brightest_share: brightest_share(map, &luminance, &weights),
            sun: sun(map, &luminance, &weights),
            plateau: plateau(map, &luminance, &weights),
        }
    }

    /// The ratio of the maximum to the minimum positive luminance; 1 for a black map.
    pub fn dynamic_range(&self) -> f64 {
        if self.max_luminance > 0.0 {
            self.max_luminance as f64 / self.min_luminance as f64
        } else {
            1.0
        }
    }

    /// The ratio of the maximum luminance to that of the mean radiance; 1 for a black map.
    pub fn peak_to_mean(&self) -> f64 {
        let mean = self.mean_radiance.luminance();
        if mean > 0.0 { self.max_luminance as f64 / mean as f64 } else { 1.0 }
    }
}

impl Sun {
    /// The elevation above the horizon \[°\].
    pub fn elevation(&self) -> f64 {
        functions::asin((self.direction.y as f64).clamp(-1.0, 1.0)).to_degrees()
    }

    /// The angle around +Y from −Z toward +X \[°\], in (−180, 180]; 0 is the center column of the map.
    pub fn azimuth(&self) -> f64 {
        functions::atan2(self.direction.x as f64, -self.direction.z as f64).to_degrees()
    }
}

/// Integrals over a texel of each row.
struct Weights(LatLongGrid);

impl Weights {
    fn new(map: &RgbImage) -> Self {
        Self(LatLongGrid::new(map.width, map.height))
    }

    /// ∫ dω over a texel \[sr\].
    fn solid_angle(&self, y: usize) -> f64 {
        self.0.column_angle() * self.0.band(y..y + 1)
    }

    /// ∫ max(0, cos θ) dω over a texel, with ∫ sin θ cos θ dθ = ½ sin² θ.
    fn projected_up(&self, y: usize) -> f64 {
        let theta = |row: usize| PI * row as f64 / self.0.height() as f64;
        let [a, b] =
            [y, y + 1].map(|row| functions::powi(functions::sin(theta(row).min(FRAC_PI_2)), 2));
        self.0.column_angle() * 0.5 * (b - a)
    }
}

/// Σ weight(row) · texel.
fn weighted_sum(map: &RgbImage, weight: impl Fn(usize) -> f64) -> Rgb {
    let mut sum = [0.0f64; 3];
    for y in 0..map.height {
        let w = weight(y);
        for texel in map.row(y) {
            sum.iter_mut().zip(texel.to_array()).for_each(|(s, c)| *s += w * c as f64);
        }
    }
    Rgb::from(sum.map(|s| s as f32))
}

fn brightest_share(map: &RgbImage, luminance: &[f32], weights: &Weights) -> f64 {
    let energy =
        |i: &u32| luminance[*i as usize] as f64 * weights.solid_angle(*i as usize / map.width);
    let mut order: Vec<u32> = (0..luminance.len() as u32).collect();
    let total: f64 = order.iter().map(energy).sum();
    if total <= 0.0 {
        return 0.0;
    }
    let n = ((luminance.len() as f64 * BRIGHTEST).round() as usize).clamp(1, luminance.len());
    let brighter =
        |a: &u32, b: &u32| luminance[*b as usize].total_cmp(&luminance[*a as usize]).then(a.cmp(b));
    order.select_nth_unstable_by(n - 1, brighter);
    order[..n].sort_unstable();
    order[..n].iter().map(energy).sum::<f64>() / total
}

/// What is taken out of the map as its sun.
fn sun(map: &RgbImage, luminance: &[f32], weights: &Weights) -> Option<Sun> {
    let source = compact_sources(map, SourceCriteria::SUN).pop()?;
    let [mut moment, mut irradiance] = [[0.0f64; 3]; 2];
    let [mut energy, mut solid_angle] = [0.0; 2];
    for (&i, rest) in source.texels.iter().zip(&source.residual) {
        let (x, y) = (i as usize % map.width, i as usize / map.width);
        let row = RowIntegrals::new(y, map.width, map.height);
        let [sin, cos] = column_integrals(x, map.width);
        let omega = row.solid_angle;
        let taken = map.pixels[i as usize] - *rest;
        let luminance = f64::from(taken.luminance());
        let d = [row.horizontal * sin, row.vertical, row.horizontal * cos];
        moment.iter_mut().zip(d).for_each(|(m, d)| *m += luminance * d);
        irradiance.iter_mut().zip(taken.to_array()).for_each(|(e, l)| *e += l as f64 * omega);
        energy += luminance * omega;
        solid_angle += omega;
    }
    let direction = Vec3::from_array(moment.map(|m| (m / energy) as f32)).try_normalize()?;
    let angular_radius = even_disc_radius(moment, energy);
    let power = |(i, &l): (usize, &f32)| l as f64 * weights.solid_angle(i / map.width);
    let all: f64 = luminance.iter().enumerate().map(power).sum();
    let irradiance = Rgb::from(irradiance.map(|e| e as f32));
    Some(Sun { direction, solid_angle, angular_radius, irradiance, share: energy / all })
}

/// The texels of the largest value, if they are several, small, bright, and end sharply.
fn plateau(map: &RgbImage, luminance: &[f32], weights: &Weights) -> Option<Plateau> {
    /// What is at least so bright has the greatest value, up to the error of lossy compression.
    const GREATEST: f32 = 0.98;
    /// What is at least so bright beside it belongs to a peak that has no sharp edge.
    const NEAR: f32 = 0.9;
    const LEAST_TEXELS: usize = 4;
    /// A cap of 7° \[sr\]: what is wider is a lamp or a window, which may well be even.
    const WIDEST: f64 = 0.047;
    let value = map.pixels.iter().map(|p| p.max_component()).fold(0.0, f32::max);
    let (mut n_texels, mut n_near) = (0, 0);
    let [mut solid_angle, mut energy, mut all] = [0.0; 3];
    for y in 0..map.height {
        let omega = weights.solid_angle(y);
        let row = y * map.width..(y + 1) * map.width;
        for (texel, &l) in map.row(y).iter().zip(&luminance[row]) {
            let power = f64::from(l) * omega;
            all += power;
            let brightest = texel.max_component();
            if brightest >= GREATEST * value {
                n_texels += 1;
                solid_angle += omega;
                energy += power;
            } else if brightest > NEAR * value {
                n_near += 1;
            }
        }
    }
    let is_source = value > 0.0 && n_texels >= LEAST_TEXELS && solid_angle <= WIDEST;
    let is_sharp = n_texels >= 2 * n_near;
    let share = energy / all;
    // As bright as its surroundings it is no source.
    let stands_out = share > 4.0 * solid_angle / (4.0 * PI);
    (is_source && is_sharp && stands_out).then_some(Plateau { value, n_texels, solid_angle, share })
}

pub(super) fn texel_direction(map: &RgbImage, x: usize, y: usize) -> Vec3 {
    let uv = vec2((x as f32 + 0.5) / map.width as f32, (y as f32 + 0.5) / map.height as f32);
    Mapping::LatLong.direction(uv).expect("a lat-long map shows every direction")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::builtin::BuiltinProbe;

    fn near(a: f32, b: f64, relative: f64) -> bool {
        (a as f64 / b - 1.0).abs() < relative
    }

    #[test]
    fn a_constant_map_gives_pi_and_no_sun() {
        for (width, height) in [(1, 1), (2, 1), (7, 3), (64, 32)] {
            let s = ProbeStatistics::new(&RgbImage::filled(width, height, Rgb::splat(2.0)));
            assert!(near(s.mean_radiance.g, 2.0, 1e-6) && near(s.irradiance_up.g, 2.0 * PI, 1e-6));
            assert_eq!((s.dynamic_range(), s.sun), (1.0, None));
            assert!((s.peak_to_mean() - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn a_black_map_is_defined() {
        let s = ProbeStatistics::new(&RgbImage::filled(4, 2, Rgb::BLACK));
        assert_eq!(
            (s.brightest_share, s.sun, s.dynamic_range(), s.peak_to_mean()),
            (0.0, None, 1.0, 1.0)
        );
    }

    #[test]
    fn the_brightest_texel_of_a_thousand_is_weighed_by_its_solid_angle() {
        let mut map = RgbImage::filled(50, 20, Rgb::WHITE);
        map.pixels[10 * 50 + 7] = Rgb::splat(100.0);
        let omega = Weights::new(&map).solid_angle(10);
        let expected = 100.0 * omega / (4.0 * PI + 99.0 * omega);
        assert!((ProbeStatistics::new(&map).brightest_share - expected).abs() < 1e-9);
    }

    #[test]
    fn the_sun_of_the_sky_is_found_at_every_size() {
        for height in [64, 255, 512] {
            let s = ProbeStatistics::new(&BuiltinProbe::Sky.image(height));
            let sun = s.sun.expect("a sky has a sun");
            let step = 180.0 / height as f64;
            assert!((sun.elevation() - 36.0).abs() < 0.5 * step, "{} at {height}", sun.elevation());
            assert!((sun.azimuth() + 122.0).abs() < 0.5 * step, "{} at {height}", sun.azimuth());
        }
    }

    /// The sun of a coarse map is as wide as its texels, and of one texel.
    #[test]
    fn a_texel_of_sun_is_as_wide_as_a_texel() {
        let mut map = RgbImage::filled(64, 32, Rgb::splat(0.1));
        map.pixels[12 * 64 + 20] = Rgb::splat(500.0);
        let sun = ProbeStatistics::new(&map).sun.expect("a sun");
        let omega = Weights::new(&map).solid_angle(12);
        assert!((sun.solid_angle / omega - 1.0).abs() < 1e-6, "{}", sun.solid_angle);
        // A disc with the texel's variance is a little wider than one with its area.
        let disc = functions::acos(1.0 - omega / (2.0 * PI));
        assert!((1.0..1.1).contains(&(sun.angular_radius / disc)), "{}", sun.angular_radius / disc);
    }

    #[test]
    fn a_sun_on_the_seam_is_one() {
        let mut map = RgbImage::filled(64, 32, Rgb::splat(0.01));
        for x in [0, 63] {
            map.pixels[12 * 64 + x] = Rgb::splat(50.0);
        }
        let sun = ProbeStatistics::new(&map).sun.expect("two bright texels");
        assert!(sun.direction.z > 0.0 && sun.direction.x.abs() < 1e-5, "{:?}", sun.direction);
        assert!((sun.azimuth().abs() - 180.0).abs() < 1e-3);
    }

    #[test]
    fn the_angular_radius_is_that_of_an_even_disc() {
        let height = 512;
        let radius = 0.05f64;
        let axis = texel_direction(&RgbImage::filled(2 * height, height, Rgb::BLACK), 300, 200);
        let mut map = RgbImage::filled(2 * height, height, Rgb::splat(0.01));
        for i in 0..map.pixels.len() {
            let d = texel_direction(&map, i % (2 * height), i / (2 * height));
            if f64::from(d.dot(axis)) > radius.cos() {
                map.pixels[i] = Rgb::splat(500.0);
            }
        }
        let s = ProbeStatistics::new(&map);
        let sun = s.sun.expect("a sun");
        assert!((sun.angular_radius / radius - 1.0).abs() < 0.02, "{}", sun.angular_radius);
        let plateau = s.plateau.expect("even texels");
        let disc = 2.0 * PI * (1.0 - radius.cos());
        assert!((plateau.solid_angle / disc - 1.0).abs() < 0.02 && plateau.value == 500.0);
        assert!((plateau.share - sun.share).abs() < 1e-3);
    }

    #[test]
    fn a_peak_that_fades_is_no_plateau() {
        // Rounded, more coarsely than Radiance pictures are: several texels of a smooth peak share the largest value.
        let rounded = |x: f32| 2.0 * (0.5 * x).round();
        let peak = |variance: f32, clip: f32| {
            RgbImage::from_fn(256, 128, |x, y| {
                let d = (x as f32 - 100.0).hypot(y as f32 - 50.0);
                Rgb::splat(rounded(1.0 + 127.0 * (-0.5 * d * d / variance).exp()).min(clip))
            })
        };
        assert_eq!(ProbeStatistics::new(&peak(100.0, f32::INFINITY)).plateau, None);
        let clipped = ProbeStatistics::new(&peak(5.0, 20.0)).plateau;
        assert!(clipped.is_some_and(|p| p.value == 20.0), "{clipped:?}");
        // As wide as this it may well be a window.
        assert_eq!(ProbeStatistics::new(&peak(100.0, 20.0)).plateau, None);
        assert_eq!(ProbeStatistics::new(&RgbImage::filled(8, 4, Rgb::WHITE)).plateau, None);
    }

    #[test]
    fn irradiance_from_above_of_a_half_lit_odd_map() {
        // Rows 0 to 3 of 7 are white; row 3 straddles the horizon, below which nothing counts.
        let map = RgbImage::from_fn(4, 7, |_, y| if y <= 3 { Rgb::WHITE } else { Rgb::BLACK });
        assert!(near(ProbeStatistics::new(&map).irradiance_up.r, PI, 1e-6));
    }
}
