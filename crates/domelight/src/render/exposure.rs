//! The automatic exposure, determined before rendering.

use super::{Background, RenderSettings, Renderer};
use crate::environment::Environment;
use crate::picture::exposure::Exposure;
use crate::sampling::Heuristic;
use crate::scene::{Camera, Scene};
use crate::strategy::StrategySpec;

/// The larger dimension of the pilot picture.
const PILOT_SIZE: usize = 64;

/// The exposure \[stops\] that [`Exposure::Auto`] gives a small picture of the scene. It maps the median luminance
/// over the pixels that the scene covers, or over the background if it covers none, to middle gray.
///
/// It depends only on scene, light, view and the aspect ratio, not on seed, samples or strategy. So it is the same
/// for all parts of a picture, for a render resumed with more samples, and for a preview. The frames of an animation
/// may share the exposure of the first. It costs about 100,000 shadow rays, and is 0 if there is no light.
pub fn automatic_exposure(
    scene: &Scene,
    camera: &Camera,
    environment: &Environment,
    settings: &RenderSettings,
) -> f32 {
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
        heuristic: Heuristic::Power,
        compensation: false,
    };
    let pilot = Renderer::new(scene, &camera, environment, strategy, settings);
    let Ok(mut pilot) = pilot else { return 0.0 };
    let layers = pilot.finish().layers();
    let coverage: Vec<f32> = layers.n_hits.iter().map(|&n| n as f32).collect();
    Exposure::Auto.stops(&layers.color, Some(&coverage))
}
