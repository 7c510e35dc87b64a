//! A map as a sum of spherical Gaussians, μ exp(λ (ξ·ω − 1)): the light of PhySG (Zhang et al. 2021) and NeRD (Boss et
//! al. 2021), whose products and integrals are closed forms.
//!
//! The sun becomes a lobe of its own that keeps its flux, its direction and its size. The other lobes start at the
//! regions of [`variance_minimization`] and then minimize the squared error of radiance over the sphere (`fit.rs`).
//! Everything is an integral over the map's texels; none of them are sampled.
//!
//! Everything here has the same bits for any number of threads.

mod cholesky;
mod fit;
mod light;
mod product;

use super::pyramid::Pyramid;
use super::{
    ExtractionSettings, RigError, RigLight, ShadingError, ShadingReference, VarianceMinimization,
    variance_minimization,
};
use crate::environment::lat_long::LatLongGrid;
use crate::environment::mapping::Mapping;
use crate::environment::{Environment, Orientation};
use crate::math::{Vec3, functions, vec2};
use crate::parallel::bands;
use crate::{Rgb, RgbImage};
use fit::{DULLEST, Lobe, Target, fit};
use product::{Kernel, integral};

/// The radiance μ exp(λ (ξ·ω − 1)) from each direction ω.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphericalGaussian {
    /// ξ, the unit vector toward the lobe's center, in world space.
    pub axis: Vec3,
    /// λ, in \[0.001, 10⁶\]. Radiance falls to 1/e at the angle arccos(1 − 1/λ), for sharp lobes √(2/λ) \[rad\].
    pub sharpness: f32,
    /// μ, the radiance at the center \[W·m⁻²·sr⁻¹\], not negative.
    pub amplitude: Rgb,
}

impl SphericalGaussian {
    /// The radiance from the unit direction `wi` \[W·m⁻²·sr⁻¹\].
    pub fn radiance(&self, wi: Vec3) -> Rgb {
        // 1 − ξ·ω by the chord, which keeps its digits near the center.
        let apart = f64::from((self.axis - wi).length_squared());
        self.amplitude * functions::exp(-0.5 * f64::from(self.sharpness) * apart) as f32
    }

    /// ∫ L dω = 2π μ (1 − e^(−2λ)) / λ over the sphere \[W·m⁻²\].
    pub fn flux(&self) -> Rgb {
        let integral = integral(f64::from(self.sharpness));
        self.amplitude.map(|c| (f64::from(c) * integral) as f32)
    }
}

/// Lobes that replace an environment.
#[derive(Clone, Debug, PartialEq)]
pub struct SphericalGaussians {
    /// The lobes in descending order of luminous flux, but the sun first.
    pub lobes: Vec<SphericalGaussian>,
    /// Whether the first lobe is the sun.
    pub has_sun: bool,
}

/// Sharpness above which single precision cannot evaluate a lobe by a scalar product.
const SHARPEST: f64 = 1e6;
/// A lobe is at least as wide as this part of a texel's height.
const NARROWEST: f64 = 0.25;

impl SphericalGaussians {
    /// The greatest number of lobes.
    pub const MOST: usize = 1024;

    /// Fits `n_lobes` lobes in \[1, [`SphericalGaussians::MOST`]\] to an environment.
    ///
    /// In each channel, their flux is that of the map. There are fewer lobes if the sun is all of the light.
    ///
    /// # Errors
    /// [`RigError::NoLights`] for no lobes, [`RigError::TooManyLobes`], [`RigError::Black`] for a map without light, and
    /// [`RigError::TooFewTexels`] if fewer texels than lobes are lit.
    pub fn fit(environment: &Environment, n_lobes: usize) -> Result<Self, RigError> {
        if n_lobes > Self::MOST {
            return Err(RigError::TooManyLobes { n_lobes });
        }
        let mut lobes = Vec::new();
        let mut rest = None;
        if n_lobes > 1 {
            (lobes, rest) = sun(environment)?;
        }
        let has_sun = !lobes.is_empty();
        let dome = rest.as_ref().unwrap_or(environment);
        if dome.power() > 0.0 || !has_sun {
            let mut others = fit_dome(dome, n_lobes - lobes.len())?;
            others.sort_by(|a, b| b.flux().luminance().total_cmp(&a.flux().luminance()));
            lobes.extend(others);
        }
        Ok(Self { lobes, has_sun })
    }

    /// The radiance from the unit direction `wi` in world space \[W·m⁻²·sr⁻¹\].
    pub fn radiance(&self, wi: Vec3) -> Rgb {
        self.lobes.iter().map(|lobe| lobe.radiance(wi)).sum()
    }

    /// ∫ L dω over the sphere \[W·m⁻²\].
    pub fn flux(&self) -> Rgb {
        let channel = |c: fn(Rgb) -> f32| self.lobes.iter().map(|l| f64::from(c(l.flux()))).sum();
        let sums: [f64; 3] = [channel(|f| f.r), channel(|f| f.g), channel(|f| f.b)];
        Rgb::from(sums.map(|sum| sum as f32))
    }

    /// The rows of an array of shape \[K, 7\]: axis x, y and z, sharpness, amplitude red, green and blue.
    pub fn rows(&self) -> Vec<[f32; 7]> {
        let row = |lobe: &SphericalGaussian| {
            let ([x, y, z], [r, g, b]) = (lobe.axis.to_array(), lobe.amplitude.to_array());
            [x, y, z, lobe.sharpness, r, g, b]
        };
        self.lobes.iter().map(row).collect()
    }

    /// The lobes as a lat-long map of the given orientation: radiance at the centers of texels.
    pub fn map(&self, orientation: Orientation, width: usize, height: usize) -> RgbImage {
        map(&self.lobes, orientation, width, height)
    }

    /// The root mean square error of radiance over the sphere, relative to the root mean square of the map's, all channels
    /// together: 0.1 is 10 %. Of sharp lobes, radiance at the centers of at least 1024 × 512 texels counts.
    pub fn radiance_error(&self, environment: &Environment) -> f64 {
        let (width, height) = (environment.map().width, environment.map().height);
        let [fine_x, fine_y] = [1024usize.div_ceil(width), 512usize.div_ceil(height)];
        let model = self.map(environment.orientation(), width * fine_x, height * fine_y);
        let grid = LatLongGrid::new(model.width, model.height);
        let (mut error, mut square) = (0.0, 0.0);
        for y in 0..model.height {
            let solid_angle = grid.solid_angle(y);
            let texels = environment.map().row(y / fine_y);
            for (x, model) in model.row(y).iter().enumerate() {
                let exact = texels[x / fine_x].to_array();
                for (exact, model) in exact.into_iter().zip(model.to_array()) {
                    let exact = f64::from(exact) * environment.unit();
                    let difference = exact - f64::from(model);
                    error += solid_angle * difference * difference;
                    square += solid_angle * exact * exact;
                }
            }
        }
        if square > 0.0 { (error / square).sqrt() } else { 0.0 }
    }

    /// The error of shading with the lobes instead of the environment.
    pub fn shading_error(
        &self,
        environment: &Environment,
        reference: &ShadingReference,
    ) -> ShadingError {
        /// Sharper lobes are as small as a light.
        const SMALL: f32 = 2000.0;
        let (small, wide): (Vec<SphericalGaussian>, Vec<_>) =
            self.lobes.iter().partition(|lobe| lobe.sharpness > SMALL);
        let lights: Vec<RigLight> = small.iter().map(SphericalGaussian::light).collect();
        let map = map(&wide, environment.orientation(), 512, 256);
        let dome = Environment::new(map, environment.orientation(), 1.0);
        let dome = dome.unwrap_or_else(|_| unreachable!("lobes are finite and not negative"));
        reference.error_of_lights(&lights, &ShadingReference::new(&dome))
    }
}

impl SphericalGaussian {
    /// A light of the same flux.
    fn light(&self) -> RigLight {
        RigLight {
            direction: self.axis,
            irradiance: self.flux(),
            angular_radius: 2.0 / self.sharpness.sqrt(),
            share: 0.0,
            solid_angle: 0.0,
            region: super::Region::Cell,
        }
    }
}

fn map(
    lobes: &[SphericalGaussian],
    orientation: Orientation,
    width: usize,
    height: usize,
) -> RgbImage {
    let to_world = orientation.map_to_world();
    let mut map = RgbImage::filled(width, height, Rgb::BLACK);
    bands(&mut map.pixels, width, |y, row| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let at = |i: usize, n: usize| (i as f32 + 0.5) / n as f32;
            let direction = Mapping::LatLong.direction(vec2(at(x, width), at(y, height)));
            let wi = to_world * direction.unwrap_or(Vec3::Y);
            *pixel = lobes.iter().map(|lobe| lobe.radiance(wi)).sum();
        }
    });
    map
}

/// The sun as a lobe with the flux and the first two moments of its light, and the environment without it; nothing if
/// there is no sun.
fn sun(
    environment: &Environment,
) -> Result<(Vec<SphericalGaussian>, Option<Environment>), RigError> {
    let settings = ExtractionSettings { sun: true, ..ExtractionSettings::default() };
    match super::CompactExtraction::new(environment, settings) {
        Ok(extraction) => {
            let (lights, rest) = extraction.into_parts();
            let lobe = |light: &RigLight| {
                let sharpness = sharpness(f64::from(light.angular_radius)).min(SHARPEST);
                let integral = integral(sharpness);
                SphericalGaussian {
                    axis: light.direction,
                    sharpness: sharpness as f32,
                    amplitude: light.irradiance.map(|c| (f64::from(c) / integral) as f32),
                }
            };
            Ok((lights.iter().map(lobe).collect(), rest))
        }
        Err(RigError::NoSun { .. }) => Ok((Vec::new(), None)),
        Err(error) => Err(error),
    }
}

/// The sharpness of a lobe whose light is spread as over an even disc of the angular radius `radius` \[rad\].
///
/// The disc's mean direction has the length (1 + cos r)/2, and the lobe's coth λ − 1/λ.
fn sharpness(radius: f64) -> f64 {
    let lost = functions::powi(functions::sin(0.5 * radius), 2);
    let of_lobe = |lambda: f64| {
        let beyond = 2.0 / functions::exp_m1(2.0 * lambda.min(300.0));
        1.0 / lambda - beyond
    };
    let (mut low, mut high) = (DULLEST, 1e12);
    for _ in 0..80 {
        let middle = (low * high).sqrt();
        if of_lobe(middle) > lost { low = middle } else { high = middle }
    }
    (low * high).sqrt()
}

/// The lobes of an environment without regard to a sun.
fn fit_dome(environment: &Environment, n_lobes: usize) -> Result<Vec<SphericalGaussian>, RigError> {
    let regions = variance_minimization(environment, n_lobes, VarianceMinimization::default())?;
    let map = environment.map();
    let unit = environment.unit();
    let narrowest = NARROWEST * std::f64::consts::PI / map.height as f64;
    let sharpest = (1.0 / (narrowest * narrowest)).min(SHARPEST);
    let pyramid = Pyramid::new(map, narrowest);
    let to_world = environment.orientation().map_to_world();
    let to_map = to_world.transpose();
    let mut lobes: Vec<Lobe> = regions
        .lights
        .iter()
        .map(|light| {
            let sharpness = sharpness(f64::from(light.angular_radius)).clamp(DULLEST, sharpest);
            let kernel = Kernel {
                axis: (to_map * light.direction).as_dvec3().normalize().to_array(),
                sharpness,
            };
            let flux = light.irradiance.to_array().map(|c| f64::from(c) / unit);
            Lobe { kernel, amplitude: flux.map(|f| f / kernel.integral()) }
        })
        .collect();
    let target = target(environment, &pyramid, sharpest);
    fit(&target, &mut lobes);
    let lobe = |lobe: &Lobe| {
        let [x, y, z] = lobe.kernel.axis.map(|c| c as f32);
        SphericalGaussian {
            axis: (to_world * Vec3::new(x, y, z)).normalize(),
            sharpness: lobe.kernel.sharpness as f32,
            amplitude: Rgb::from(lobe.amplitude.map(|c| (c * unit) as f32)),
        }
    };
    Ok(lobes.iter().map(lobe).collect())
}

fn target<'a>(environment: &Environment, pyramid: &'a Pyramid<'a>, sharpest: f64) -> Target<'a> {
    let map = environment.map();
    let grid = LatLongGrid::new(map.width, map.height);
    let (mut flux, mut square) = ([0.0; 3], 0.0);
    for y in 0..map.height {
        let solid_angle = grid.solid_angle(y);
        for texel in map.row(y) {
            for (flux, le) in flux.iter_mut().zip(texel.to_array().map(f64::from)) {
                *flux += solid_angle * le;
                square += solid_angle * le * le;
            }
        }
    }
    let harmonics = light::LightMoments::harmonics(pyramid);
    Target { pyramid, flux, harmonics, square, sharpest }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::UpAxis;
    use crate::math::vec3;

    fn environment(map: RgbImage) -> Environment {
        Environment::from_image(map).unwrap()
    }

    fn flux(environment: &Environment) -> [f64; 3] {
        let pyramid = Pyramid::new(environment.map(), 1.0);
        target(environment, &pyramid, 1.0).flux.map(|f| f * environment.unit())
    }

    /// Flux of each channel within 0.1 %, and nothing negative.
    fn check(gaussians: &SphericalGaussians, environment: &Environment) {
        for (a, b) in gaussians.flux().to_array().into_iter().zip(flux(environment)) {
            assert!((f64::from(a) - b).abs() <= 1e-3 * b, "{a} {b}");
        }
        for lobe in &gaussians.lobes {
            assert!(lobe.axis.is_normalized() && lobe.amplitude.min_component() >= 0.0);
            assert!((1e-3..=1e6).contains(&lobe.sharpness), "{lobe:?}");
        }
    }

    /// A gray sphere with a sun of one texel.
    fn sunny() -> RgbImage {
        let mut map = RgbImage::filled(128, 64, Rgb::new(0.5, 0.6, 0.8));
        map.pixels[20 * 128 + 90] = Rgb::new(20_000.0, 18_000.0, 15_000.0);
        map
    }

    #[test]
    fn known_lobes_are_found() {
        let lobe = |axis: Vec3, sharpness: f32, amplitude: Rgb| SphericalGaussian {
            axis: axis.normalize(),
            sharpness,
            amplitude,
        };
        let lobes = [
            lobe(vec3(1.0, 0.5, 0.2), 25.0, Rgb::new(3.0, 2.0, 0.5)),
            lobe(vec3(-0.3, 0.8, -1.0), 8.0, Rgb::new(0.2, 1.0, 2.0)),
            lobe(vec3(0.0, -1.0, 0.4), 1.5, Rgb::new(0.3, 0.25, 0.2)),
        ];
        let environment = environment(map(&lobes, Orientation::default(), 192, 96));
        let found = SphericalGaussians::fit(&environment, 3).unwrap();
        check(&found, &environment);
        assert!(!found.has_sun);
        for known in lobes {
            let near = |l: &&SphericalGaussian| (l.axis - known.axis).length() < 0.01;
            let found = found.lobes.iter().find(near).expect("the lobe is found");
            assert!((found.sharpness / known.sharpness - 1.0).abs() < 0.01, "{found:?}");
            let amplitudes = found.amplitude.to_array().into_iter().zip(known.amplitude.to_array());
            amplitudes.for_each(|(a, b)| assert!((a - b).abs() < 0.03, "{found:?}"));
        }
    }

    #[test]
    fn the_sun_is_a_lobe_of_its_own() {
        for orientation in [Orientation::default(), Orientation { up: UpAxis::Z, rotation: 77.0 }] {
            let environment = Environment::new(sunny(), orientation, 1.0).unwrap();
            let found = SphericalGaussians::fit(&environment, 8).unwrap();
            check(&found, &environment);
            assert!(found.has_sun);
            let sun = found.lobes[0];
            let center = environment.direction(vec2(90.5 / 128.0, 20.5 / 64.0));
            assert!((sun.axis - center).length() < 1e-3, "{sun:?}");
            let texel = environment.texel_solid_angle(20) as f32;
            assert!((sun.flux().r / (19_999.5 * texel) - 1.0).abs() < 1e-3, "{sun:?}");
            // The texel's own size.
            let radius = (texel / std::f32::consts::PI).sqrt();
            assert!((sun.sharpness * radius * radius / 4.0 - 1.0).abs() < 0.1, "{sun:?}");
            let reference = ShadingReference::new(&environment);
            let error = found.shading_error(&environment, &reference);
            assert!(error.worst() < 0.01, "{error:?}");
        }
    }

    #[test]
    fn even_light_is_a_dull_lobe() {
        for (width, height, n) in [(1, 1, 1), (2, 1, 1), (3, 2, 4), (16, 8, 5)] {
            let environment =
                environment(RgbImage::filled(width, height, Rgb::new(2.0, 0.0, 1e-3)));
            let found = SphericalGaussians::fit(&environment, n).unwrap();
            check(&found, &environment);
            for wi in [Vec3::X, Vec3::NEG_Y, Vec3::ONE.normalize()] {
                let radiance = found.radiance(wi).to_array();
                assert!((radiance[0] - 2.0).abs() < 0.02, "{width}x{height}: {radiance:?}");
                assert_eq!(radiance[1], 0.0);
            }
        }
    }

    #[test]
    fn extreme_radiance_is_fitted() {
        for scale in [1e-37, 1e33] {
            let map = sunny();
            let pixels = map.pixels.iter().map(|p| *p * scale).collect();
            let environment = environment(RgbImage { pixels, ..map });
            let found = SphericalGaussians::fit(&environment, 4).unwrap();
            assert_eq!(found.lobes.len(), 4);
            assert!(found.rows().iter().flatten().all(|number| number.is_finite()));
        }
    }

    #[test]
    fn a_sun_alone_is_one_lobe() {
        let mut map = RgbImage::filled(64, 32, Rgb::BLACK);
        map.pixels[12 * 64 + 9] = Rgb::WHITE;
        map.pixels[12 * 64 + 10] = Rgb::WHITE;
        let environment = environment(map);
        let found = SphericalGaussians::fit(&environment, 2).unwrap();
        check(&found, &environment);
        assert_eq!(found.lobes.len(), 1);
    }

    #[test]
    fn what_cannot_be_fitted_is_refused() {
        let black = environment(RgbImage::filled(8, 4, Rgb::BLACK));
        assert_eq!(SphericalGaussians::fit(&black, 2), Err(RigError::Black));
        assert_eq!(SphericalGaussians::fit(&black, 1), Err(RigError::Black));
        let gray = environment(RgbImage::filled(2, 1, Rgb::WHITE));
        assert_eq!(SphericalGaussians::fit(&gray, 0), Err(RigError::NoLights));
        let too_few = RigError::TooFewTexels { n_lights: 3, lit: 2 };
        assert_eq!(SphericalGaussians::fit(&gray, 3), Err(too_few));
        let too_many = RigError::TooManyLobes { n_lobes: 1025 };
        assert_eq!(SphericalGaussians::fit(&gray, 1025), Err(too_many));
    }

    #[test]
    fn discs_and_lobes_have_the_same_mean_direction() {
        for radius in [1e-4, 0.0047, 0.3, 1.5, 3.0] {
            let lambda = sharpness(radius);
            let mean = 0.5 * (1.0 + radius.cos());
            let kernel = Kernel { axis: [0.0, 0.0, 1.0], sharpness: lambda };
            let [along, all] = testkit::quadrature::sphere(40, |w| {
                let g = (lambda * (w[2] - 1.0)).exp();
                [g * w[2], g]
            });
            if radius > 0.1 {
                assert!((along / all - mean).abs() < 1e-6, "{radius}");
            }
            assert!((1.0 - 1.0 / lambda - mean).abs() < 1e-3 || radius > 1.0);
            assert!((kernel.integral() / all - 1.0).abs() < 1e-6 || radius < 0.1);
        }
    }
}
