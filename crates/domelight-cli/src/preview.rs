//! A first picture of a render, to look at while the rest is made.

use std::sync::atomic::AtomicBool;

use anyhow::Result;
use domelight::RgbImage;
use domelight::picture::tone::ToneMapping;
use domelight::render::RenderSettings;
use domelight::strategy::PreparedStrategy;

use crate::output::PicturePath;
use crate::progress::RenderProgress;
use crate::strategy::RenderTask;
use domelight_lab::scene::PreparedScene;

/// Writes PNG output after one sample of each square of 2 × 2 pixels.
pub(crate) fn write(
    view: &PreparedScene,
    settings: &RenderSettings,
    strategy: &PreparedStrategy,
    outputs: &[PicturePath],
    tone: &ToneMapping,
    interrupted: &'static AtomicBool,
) -> Result<()> {
    let (whole_width, whole_height) = (settings.width, settings.height);
    let (width, height) = (whole_width.div_ceil(2), whole_height.div_ceil(2));
    let settings = &RenderSettings { width, height, n_samples: 1, target_error: None, ..*settings };
    let camera = &view.camera.resized((whole_width, whole_height), (width, height));
    let progress = &RenderProgress::new("", 1, true, interrupted);
    let PreparedScene { scene, environment, .. } = view;
    let job = RenderTask { scene, camera, environment, settings, progress, render_run: None };
    let layers = job.render(strategy)?.layers;

    let at = |x: usize, y: usize| y / 2 * width + x / 2;
    let color = RgbImage::from_fn(whole_width, whole_height, |x, y| layers.color.pixels[at(x, y)]);
    let alpha: Vec<f32> = (0..whole_width * whole_height)
        .map(|i| layers.alpha[at(i % whole_width, i / whole_width)])
        .collect();
    let alpha = view.report.hide_env.then_some(&alpha[..]);
    outputs.iter().filter(|path| path.is_png()).try_for_each(|path| {
        // The attributes would describe another render than this picture shows.
        path.write_color(&color, alpha, tone)
    })
}
