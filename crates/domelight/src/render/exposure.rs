//! The automatic exposure: an incident light meter.
//!
//! It meters the light, not the subject, so black stays black and white stays white: a gray ball of albedo 0.18 in the
//! middle of the open scene, seen by the camera, is middle gray on average. Where the scene keeps most of the light off
//! what the camera sees, as in a room, the meter reads the share that arrives there.

use serde::Serialize;

use super::{Background, Layers, RenderSettings, Renderer};
use crate::environment::Environment;
use crate::math::{Vec3, functions};
use crate::picture::exposure::{Exposure, rounded};
use crate::sampling::Heuristic;
use crate::scene::{Camera, Scene};
use crate::strategy::StrategySpec;

/// The larger dimension of the pilot picture.
const PILOT_SIZE: usize = 64;

/// A white surface that faces the brightest light in the open is shown at most at this multiple of white. The default tone
/// curve still separates it from what is brighter.
const BRIGHTEST_WHITE: f64 = 4.0;

/// An exposure that was determined before rendering.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AutomaticExposure {
    /// Radiance is shown times 2^stops; in hundredths.
    pub stops: f32,
    /// What was metered.
    pub basis: ExposureBasis,
}

/// What an automatic exposure meters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ExposureBasis {
    /// The light on a gray ball in the open.
    Light,
    /// The same where the scene lets through only a share of it, in (0, 1).
    Shade(f32),
    /// The median of the picture: the scene glows by itself, or the camera sees only the background.
    Median,
}

impl std::fmt::Display for ExposureBasis {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Light => f.pad("for the light"),
            Self::Shade(share) => {
                write!(f, "for the {:.2} % of the light that arrive", 100.0 * share)
            }
            Self::Median => f.pad("for the median"),
        }
    }
}

/// The exposure \[stops\] of a view by the rule of this module.
///
/// It depends only on scene, light, view and the aspect ratio, not on seed, samples or strategy. So it is the same
/// for all parts of a picture, for a render resumed with more samples, and for a preview. In the open, it is the same for
/// all subjects. The frames of an animation may share the exposure of the first. It costs about 100,000 shadow rays, and
/// is 0 if there is no light.
pub fn automatic_exposure(
    scene: &Scene,
    camera: &Camera,
    environment: &Environment,
    settings: &RenderSettings,
) -> AutomaticExposure {
    let pilot = pilot(scene, camera, environment, settings);
    let light = MeteredLight::of(environment);
    let center = camera.ray(0.5 * settings.width as f32, 0.5 * settings.height as f32);
    let open = light.on_ball(-center.direction).max(light.brightest() / BRIGHTEST_WHITE);
    let is_covered = pilot.n_hits.iter().any(|&n| n > 0);
    if open == 0.0 || !is_covered {
        let coverage: Vec<f32> = pilot.n_hits.iter().map(|&n| n as f32).collect();
        let stops = Exposure::Auto.stops(&pilot.color, Some(&coverage));
        return AutomaticExposure { stops, basis: ExposureBasis::Median };
    }
    let share = arriving_share(&pilot);
    let basis = if share < 1.0 { ExposureBasis::Shade(share) } else { ExposureBasis::Light };
    // A card of albedo 0.18 under the irradiance E has the radiance 0.18 E / π.
    let irradiance = f64::from(share) * open;
    let stops = functions::log2((std::f64::consts::PI / irradiance) as f32);
    AutomaticExposure { stops: rounded(stops), basis }
}

/// A small picture of the view, with 4 samples per pixel.
fn pilot(
    scene: &Scene,
    camera: &Camera,
    environment: &Environment,
    settings: &RenderSettings,
) -> Layers {
    let longest = settings.width.max(settings.height);
    let scaled = |n: usize| match longest {
        ..=PILOT_SIZE => n,
        _ => (n * PILOT_SIZE).div_ceil(longest),
    };
    let size = (settings.width, settings.height);
    let settings = RenderSettings {
        width: scaled(settings.width),
        height: scaled(settings.height),
        n_samples: 4,
        background: Background::Shown,
        ..RenderSettings::default()
    };
    let camera = camera.resized(size, (settings.width, settings.height));
    // The median requires each pixel to be nearly right under any light, not just the mean.
    let strategy = StrategySpec::Mis {
        n_environment: 4,
        n_brdf: 2,
        n_portal: 0,
        heuristic: Heuristic::Power,
        compensation: false,
    };
    match Renderer::new(scene, &camera, environment, strategy, settings) {
        Ok(mut renderer) => renderer.finish().layers(),
        Err(_) => Layers::new(settings.width, settings.height),
    }
}

/// The share of the light that the scene lets through to what the camera sees, in (0, 1]: 1 where at least half of it
/// arrives, as on subjects in the open.
fn arriving_share(pilot: &Layers) -> f32 {
    let pixels = pilot.color.pixels.iter().zip(&pilot.unoccluded.pixels).zip(&pilot.n_hits);
    let covered = pixels.filter(|&(_, &n)| n > 0);
    let mut shares: Vec<f32> = covered
        .map(|((color, unoccluded), _)| color.luminance() / unoccluded.luminance())
        .filter(|s| s.is_finite() && *s > 0.0)
        .collect();
    if shares.is_empty() {
        return 1.0;
    }
    let middle = shares.len() / 2;
    let (_, &mut median, _) = shares.select_nth_unstable_by(middle, f32::total_cmp);
    // All of what arrives below a quarter, none of it from a half on, and a smooth passage.
    (4.0 * median * median).max(median).min(1.0)
}

/// The luminance of an environment, as beams of light from patches of the sphere.
struct MeteredLight {
    /// The direction of each patch and its luminance times its solid angle.
    beams: Vec<(Vec3, f64)>,
}

impl MeteredLight {
    /// Divides the map into patches.
    fn of(environment: &Environment) -> Self {
        const COLUMNS: usize = 64;
        const ROWS: usize = 32;
        let map = environment.radiance_map();
        let to_world = environment.orientation().map_to_world();
        let column_angle = std::f64::consts::TAU / map.width as f64;
        let row_of_patches = |row: usize| {
            let rows = Span::of(row, ROWS, map.height);
            let patch = |column: usize| {
                let columns = Span::of(column, COLUMNS, map.width);
                let mut flux = 0.0;
                for [top, bottom] in rows.texels() {
                    let texels = &map.row(top as usize);
                    let luminance = columns.texels().map(|[left, right]| {
                        (right - left) * f64::from(texels[left as usize].luminance())
                    });
                    let band = environment.cos_theta(top) - environment.cos_theta(bottom);
                    flux += column_angle * band * luminance.sum::<f64>();
                }
                (to_world * environment.map_direction(columns.middle(), rows.middle()), flux)
            };
            (0..COLUMNS).map(patch).collect::<Vec<_>>()
        };
        // Rows in order, whichever thread computed them.
        Self { beams: crate::parallel::in_order(ROWS, row_of_patches).concat() }
    }

    /// The mean irradiance of the visible half of a ball, seen from the direction `toward` \[W·m⁻²\]: the sum over the
    /// beams of Lambert's phase function (van de Hulst 1980, "Multiple Light Scattering", section 18.1.4, for
    /// a white sphere).
    fn on_ball(&self, toward: Vec3) -> f64 {
        let mean_cosine = |direction: Vec3| {
            let cos = direction.dot(toward).clamp(-1.0, 1.0);
            let phase = functions::acos(cos);
            f64::from(functions::sin(phase) + (std::f32::consts::PI - phase) * cos)
        };
        let sum: f64 = self.beams.iter().map(|&(wi, flux)| flux * mean_cosine(wi)).sum();
        sum * 2.0 / (3.0 * std::f64::consts::PI)
    }

    /// The irradiance of a card that faces the brightest light \[W·m⁻²\].
    fn brightest(&self) -> f64 {
        /// The number of directions of the card; neighbors are 0.3 radians apart, which changes a cosine by 1 %.
        const CARDS: usize = 200;
        let irradiance = |i: usize| {
            let normal = fibonacci_direction(i, CARDS);
            let on_card = |&(wi, flux): &(Vec3, f64)| flux * f64::from(normal.dot(wi).max(0.0));
            self.beams.iter().map(on_card).sum::<f64>()
        };
        (0..CARDS).map(irradiance).fold(0.0, f64::max)
    }
}

/// An interval of columns or rows, in texels.
struct Span {
    start: f64,
    end: f64,
}

impl Span {
    /// Interval `i` of `n` equal ones of `texels` texels.
    fn of(i: usize, n: usize, texels: usize) -> Self {
        let edge = |i: usize| i as f64 * texels as f64 / n as f64;
        Self { start: edge(i), end: edge(i + 1) }
    }

    fn middle(&self) -> f64 {
        0.5 * (self.start + self.end)
    }

    /// The part of each texel that lies in it.
    fn texels(&self) -> impl Iterator<Item = [f64; 2]> {
        let Self { start, end } = *self;
        let whole = start as usize..end.ceil() as usize;
        whole.map(move |i| [start.max(i as f64), end.min((i + 1) as f64)])
    }
}

/// Direction `i` of `n` that are spread evenly over the sphere: a Fibonacci lattice.
fn fibonacci_direction(i: usize, n: usize) -> Vec3 {
    /// The golden ratio.
    const PHI: f32 = 1.618_034;
    let cos = 1.0 - (2.0 * i as f32 + 1.0) / n as f32;
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let turn = std::f32::consts::TAU * (i as f32 / PHI).fract();
    Vec3::new(sin * functions::cos(turn), sin * functions::sin(turn), cos)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::Orientation;
    use crate::{Rgb, RgbImage};

    fn environment(light: impl Fn(usize, usize) -> f32) -> Environment {
        let map = RgbImage::from_fn(256, 128, |x, y| Rgb::splat(light(x, y)));
        Environment::new(map, Orientation::default(), 1.0).unwrap()
    }

    #[test]
    fn uniform_light_reads_pi_everywhere() {
        let light = MeteredLight::of(&environment(|_, _| 1.0));
        for toward in [Vec3::X, Vec3::NEG_Y, Vec3::new(0.6, 0.0, -0.8)] {
            let ball = light.on_ball(toward) / std::f64::consts::PI;
            assert!((ball - 1.0).abs() < 2e-3, "{ball}");
        }
        assert!((light.brightest() / std::f64::consts::PI - 1.0).abs() < 2e-3);
    }

    /// The mean irradiance of the visible half of a ball is that of its normals, weighted by their cosines to the viewer.
    #[test]
    fn the_ball_is_the_mean_over_its_visible_normals() {
        let environment =
            environment(|x, y| if (30..60).contains(&x) && y < 50 { 9.0 } else { 0.1 });
        let light = MeteredLight::of(&environment);
        let toward = Vec3::new(0.48, 0.6, 0.64);
        let (mut sum, mut weights) = (0.0, 0.0);
        for i in 0..2000 {
            let normal = fibonacci_direction(i, 2000);
            let weight = f64::from(normal.dot(toward).max(0.0));
            let on_card = |&(wi, flux): &(Vec3, f64)| flux * f64::from(normal.dot(wi).max(0.0));
            sum += weight * light.beams.iter().map(on_card).sum::<f64>();
            weights += weight;
        }
        let ratio = light.on_ball(toward) * weights / sum;
        assert!((ratio - 1.0).abs() < 5e-3, "{ratio}");
    }

    #[test]
    fn the_brightest_card_faces_the_sun() {
        let sun = environment(|x, y| if (x, y) == (100, 40) { 1e6 } else { 0.0 });
        let irradiance = 1e6 * sun.texel_solid_angle(40);
        let ratio = MeteredLight::of(&sun).brightest() / irradiance;
        assert!((0.98..1.001).contains(&ratio), "{ratio}");
    }
}
