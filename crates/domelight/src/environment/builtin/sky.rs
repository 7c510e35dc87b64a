//! A clear sky, its sun and the ground below.
//!
//! Sky: Preetham, Shirley, Smits 1999, "A Practical Analytic Model for Daylight", SIGGRAPH: Perez's
//! five-parameter distribution for luminance Y and chromaticity x, y, fitted over turbidity
//! (appendix A.2). Sun: the same paper's attenuation by air, aerosol and ozone (appendix A.1) of a
//! 5778 K black body outside the atmosphere. The paper's zenith luminance is about twice too high on
//! clear days (Zotti, Wilkie, Purgathofer 2007, "A Critical Review of the Preetham Skylight Model"), so
//! the sky as a whole is scaled to the measured illuminance of clear skies instead.
//!
//! Hošek and Wilkie 2012 is more accurate at high turbidity and low sun, but needs tables of some
//! thousand coefficients; at the turbidity and sun elevation used here, the two differ little. The CIE
//! standard skies have no color. Single scattering as in Nishita's model loses the third of the light
//! that is multiply scattered.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::{averaged, direction};
use crate::color::Rgb;
use crate::environment::lat_long::narrow_band;
use crate::image::RgbImage;
use crate::math::{Vec3, functions, vec3};

/// Haziness: 2 is very clear, 3 clear, 6 warm and moist.
const TURBIDITY: f64 = 2.3;
/// Angle of the sun from the zenith \[rad\]: 36° above the horizon.
const SUN_THETA: f64 = 54.0 * PI / 180.0;
/// Angle of the sun from −Z toward +X \[rad\]: over the left shoulder of who looks along −Z.
const SUN_PHI: f64 = -122.0 * PI / 180.0;
/// Angular radius of the sun's disc \[rad\].
const SUN_RADIUS: f64 = 0.265 * PI / 180.0;
/// Illuminance of the sun outside the atmosphere \[klx\].
const SOLAR_ILLUMINANCE: f64 = 133.0;
/// Lambert reflectance of the ground: dry soil.
const GROUND_ALBEDO: [f64; 3] = [0.27, 0.235, 0.19];
/// Luminance of one unit of radiance \[kcd/m²\]: a white surface that faces the sun comes out at about 1.5.
const UNIT: f64 = 18.0;
/// Height of the eye over the ground as a part of the visibility: how fast the ground fades into the horizon.
const HAZE: f32 = 0.012;

/// The lat-long map of sky, sun and ground.
pub(super) fn image(height: usize) -> RgbImage {
    let sky = Sky::new(TURBIDITY, SUN_THETA, SUN_PHI);
    let ground = sky.ground();
    let mut image =
        averaged(height, 512, |d| if d.y > 0.0 { sky.radiance(d) } else { sky.hazy(ground, d) });
    sky.add_sun(&mut image);
    image
}

/// Perez's distribution for Y, x and y, normalized to the zenith.
struct Sky {
    sun: Vec3,
    sun_theta: f64,
    sun_phi: f64,
    sun_radiance: Rgb,
    /// A to E of Y, x, y.
    perez: [[f64; 5]; 3],
    /// Y \[kcd/m²\], x and y in units of their distributions.
    scale: [f64; 3],
}

impl Sky {
    fn new(turbidity: f64, sun_theta: f64, sun_phi: f64) -> Self {
        let t = turbidity;
        let perez = [
            [
                0.1787 * t - 1.4630,
                -0.3554 * t + 0.4275,
                -0.0227 * t + 5.3251,
                0.1206 * t - 2.5771,
                -0.0670 * t + 0.3703,
            ],
            [
                -0.0193 * t - 0.2592,
                -0.0665 * t + 0.0008,
                -0.0004 * t + 0.2125,
                -0.0641 * t - 0.8989,
                -0.0033 * t + 0.0452,
            ],
            [
                -0.0167 * t - 0.2608,
                -0.0950 * t + 0.0092,
                -0.0079 * t + 0.2102,
                -0.0441 * t - 1.6537,
                -0.0109 * t + 0.0529,
            ],
        ];
        let [x, y] = zenith_chromaticity(t, sun_theta);
        let gamma = (sun_theta, functions::cos(sun_theta));
        let at_zenith = |i: usize| distribution(&perez[i], 1.0, gamma);
        let scale = [1.0, x / at_zenith(1), y / at_zenith(2)];
        let sun_radiance = sun_radiance(t, sun_theta);
        let sun = direction(sun_theta, sun_phi);
        let mut sky = Self { sun, sun_theta, sun_phi, sun_radiance, perez, scale };
        sky.scale[0] =
            clear_sky_illuminance(sun_theta) / UNIT / sky.irradiance().luminance() as f64;
        sky
    }

    /// Radiance of the sky without the sun; `d` above the horizon.
    fn radiance(&self, d: Vec3) -> Rgb {
        let cos_gamma = (d.dot(self.sun) as f64).clamp(-1.0, 1.0);
        let gamma = (functions::acos(cos_gamma), cos_gamma);
        let [luminance, x, y] =
            [0, 1, 2].map(|i| self.scale[i] * distribution(&self.perez[i], d.y as f64, gamma));
        rgb_of_chromaticity(luminance / UNIT, x, y)
    }

    /// The ground seen along `d` through the air, which takes the color of the horizon above it.
    fn hazy(&self, ground: Rgb, d: Vec3) -> Rgb {
        let horizon = self.radiance(vec3(d.x, 0.02, d.z).normalize());
        horizon.lerp(ground, functions::exp(HAZE / d.y.min(-1e-6)))
    }

    /// Irradiance of the ground by the sky without the sun.
    fn irradiance(&self) -> Rgb {
        const N: usize = 64;
        let d_theta = FRAC_PI_2 / N as f64;
        let d_phi = TAU / (4 * N) as f64;
        let ring = |theta: f64| -> Rgb {
            let radiance = |j: usize| self.radiance(direction(theta, d_phi * j as f64));
            (0..4 * N).map(radiance).sum::<Rgb>()
                * (functions::sin(theta) * functions::cos(theta) * d_theta * d_phi) as f32
        };
        (0..N).map(|i| ring(d_theta * (i as f64 + 0.5))).sum()
    }

    /// Irradiance of the ground by the sun.
    fn sun_irradiance(&self) -> Rgb {
        self.sun_radiance * (sun_solid_angle() * functions::cos(self.sun_theta)) as f32
    }

    /// Radiance of the Lambertian ground: albedo · E / π.
    fn ground(&self) -> Rgb {
        (self.irradiance() + self.sun_irradiance())
            * Rgb::from(GROUND_ALBEDO.map(|a| (a / PI) as f32))
    }

    /// Adds the disc of the sun, each texel by the part of it that the disc covers.
    ///
    /// Coverage is counted on cells of a sixteenth of the radius and scaled so that the sum is the
    /// disc's solid angle: the irradiance is exact at every resolution.
    fn add_sun(&self, image: &mut RgbImage) {
        let height = image.height;
        let grid = (16.0 * PI / height as f64 / SUN_RADIUS).ceil().max(4.0) as usize;
        let (rows, columns) = (height * grid, 2 * height * grid);
        let cell = PI / rows as f64;
        let span = |center: f64, half: f64| {
            ((center - half) / cell).floor() as isize..((center + half) / cell).ceil() as isize
        };
        let mut covered: Vec<(usize, f64)> = Vec::new();
        for row in span(self.sun_theta, SUN_RADIUS) {
            let theta = (row as f64 + 0.5) * cell;
            let solid_angle = functions::sin(theta) * cell * cell;
            for column in span(self.sun_phi + PI, 1.1 * SUN_RADIUS / functions::sin(self.sun_theta))
            {
                let phi = (column as f64 + 0.5) * cell - PI;
                if angle_to(self.sun_theta, self.sun_phi, theta, phi) < SUN_RADIUS {
                    let (x, y) =
                        (column.rem_euclid(columns as isize) as usize / grid, row as usize / grid);
                    covered.push((y * image.width + x, solid_angle));
                }
            }
        }
        let total: f64 = covered.iter().map(|c| c.1).sum();
        for (texel, solid_angle) in covered {
            let row = texel / image.width;
            let weight = solid_angle / total * sun_solid_angle() / texel_solid_angle(row, height);
            image.pixels[texel] += self.sun_radiance * weight as f32;
        }
    }
}

/// Perez 1993 (Preetham et al., equation 3): (1 + A e^{B/cos θ})(1 + C e^{Dγ} + E cos² γ).
/// The luminance distribution, given γ and its cosine.
fn distribution([a, b, c, d, e]: &[f64; 5], cos_theta: f64, (gamma, cos_gamma): (f64, f64)) -> f64 {
    (1.0 + a * functions::exp(b / cos_theta.max(1e-3)))
        * (1.0 + c * functions::exp(d * gamma) + e * cos_gamma * cos_gamma)
}

/// Illuminance of the ground by a clear sky without its sun \[klx\]: IESNA 2000, The IESNA Lighting
/// Handbook, 9th edition, chapter 8.
fn clear_sky_illuminance(sun_theta: f64) -> f64 {
    0.8 + 15.5 * functions::cos(sun_theta).sqrt()
}

/// x and y at the zenith, of appendix A.2.
fn zenith_chromaticity(t: f64, sun_theta: f64) -> [f64; 2] {
    let cubic = |[a, b, c, d]: [f64; 4]| ((a * sun_theta + b) * sun_theta + c) * sun_theta + d;
    let fit = |m: [[f64; 4]; 3]| (cubic(m[0]) * t + cubic(m[1])) * t + cubic(m[2]);
    let x = fit([
        [0.00166, -0.00375, 0.00209, 0.0],
        [-0.02903, 0.06377, -0.03202, 0.00394],
        [0.11693, -0.21196, 0.06052, 0.25886],
    ]);
    let y = fit([
        [0.00275, -0.00610, 0.00317, 0.0],
        [-0.04214, 0.08970, -0.04153, 0.00516],
        [0.15346, -0.26756, 0.06670, 0.26688],
    ]);
    [x, y]
}

/// Radiance of the sun's disc through the atmosphere, of appendix A.1, at one wavelength a primary.
fn sun_radiance(turbidity: f64, theta: f64) -> Rgb {
    let outside = rgb_of_chromaticity(SOLAR_ILLUMINANCE / sun_solid_angle() / UNIT, 0.3266, 0.3359);
    let air_mass =
        1.0 / (functions::cos(theta) + 0.15 * functions::powf(93.885 - theta.to_degrees(), -1.253));
    let aerosol = 0.04608 * turbidity - 0.04586;
    // Wavelength [µm] and ozone absorption [1/cm] of 0.35 cm of ozone.
    let transmittance =
        [(0.61, 0.12), (0.55, 0.085), (0.465, 0.008)].map(|(wavelength, ozone): (f64, f64)| {
            let depth = 0.008735 * functions::powf(wavelength, -4.08)
                + aerosol * functions::powf(wavelength, -1.3)
                + 0.35 * ozone;
            functions::exp(-depth * air_mass) as f32
        });
    outside * Rgb::from(transmittance)
}

/// Solid angle of the sun's disc \[sr\], 2π (1 − cos r), in a form that does not cancel.
fn sun_solid_angle() -> f64 {
    4.0 * PI * functions::powi(functions::sin(0.5 * SUN_RADIUS), 2)
}

/// Exact solid angle of a texel of `row` \[sr\].
fn texel_solid_angle(row: usize, height: usize) -> f64 {
    narrow_band(row, height) * (PI / height as f64)
}

/// Angle between two directions \[rad\], by haversines, which are exact for small angles.
fn angle_to(theta_a: f64, phi_a: f64, theta_b: f64, phi_b: f64) -> f64 {
    let haversine = |x: f64| functions::powi(functions::sin(0.5 * x), 2);
    let h = haversine(theta_a - theta_b)
        + functions::sin(theta_a) * functions::sin(theta_b) * haversine(phi_a - phi_b);
    2.0 * functions::asin(h.sqrt().min(1.0))
}

/// Linear Rec. 709 of luminance and CIE 1931 chromaticity; what lies outside the gamut is clipped.
fn rgb_of_chromaticity(luminance: f64, x: f64, y: f64) -> Rgb {
    let (big_x, big_z) = (luminance * x / y, luminance * (1.0 - x - y) / y);
    let r = 3.2404542 * big_x - 1.5371385 * luminance - 0.4985314 * big_z;
    let g = -0.9692660 * big_x + 1.8760108 * luminance + 0.0415560 * big_z;
    let b = 0.0556434 * big_x - 0.2040259 * luminance + 1.0572252 * big_z;
    Rgb::from([r, g, b].map(|c| c.max(0.0) as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Irradiance of the disc at normal incidence, summed over the map.
    fn sun_irradiance(height: usize) -> f64 {
        let sky = Sky::new(TURBIDITY, SUN_THETA, SUN_PHI);
        let mut image = RgbImage::filled(2 * height, height, Rgb::BLACK);
        sky.add_sun(&mut image);
        (0..height)
            .map(|y| {
                image.row(y).iter().map(|p| p.luminance() as f64).sum::<f64>()
                    * texel_solid_angle(y, height)
            })
            .sum()
    }

    #[test]
    fn the_sun_keeps_its_irradiance_at_every_size() {
        let exact = sun_radiance(TURBIDITY, SUN_THETA).luminance() as f64 * sun_solid_angle();
        for height in [1, 2, 3, 16, 255, 512, 2048] {
            assert!((sun_irradiance(height) / exact - 1.0).abs() < 1e-5, "{height} rows");
        }
    }

    #[test]
    fn the_sun_is_a_disc_of_its_size_where_the_map_resolves_it() {
        let sky = Sky::new(TURBIDITY, SUN_THETA, SUN_PHI);
        let height = 4096;
        let mut image = RgbImage::filled(2 * height, height, Rgb::BLACK);
        sky.add_sun(&mut image);
        let peak = image.pixels.iter().map(|p| p.luminance()).fold(0.0, f32::max);
        assert!((peak / sky.sun_radiance.luminance() - 1.0).abs() < 0.01);
        let rows: Vec<usize> =
            (0..height).filter(|&y| image.row(y).iter().any(|p| !p.is_black())).collect();
        let degrees = rows.len() as f64 * 180.0 / height as f64;
        assert!((degrees - 0.53).abs() < 0.09, "{degrees}");
    }

    #[test]
    fn a_clear_day_has_a_strong_sun_and_a_blue_sky() {
        let sky = Sky::new(TURBIDITY, SUN_THETA, SUN_PHI);
        let (sun, diffuse) = (sky.sun_irradiance(), sky.irradiance());
        let ratio = sun.luminance() / diffuse.luminance();
        assert!((3.0..7.0).contains(&ratio), "{ratio}");
        assert!(sky.radiance(Vec3::Y).b > 1.5 * sky.radiance(Vec3::Y).r);
        assert!(sun.r > sun.b);
        let facing = (sky.sun_radiance * sun_solid_angle() as f32).luminance() / PI as f32;
        assert!((1.0..3.0).contains(&facing), "{facing}");
    }
}
