//! A light probe as a picture on a sheet, and what is drawn on it.

use anyhow::Result;
use domelight::environment::Environment;
use domelight::math::{Frame, Vec3, vec3};
use domelight::picture::png::{self, Depth};
use domelight::picture::tone::ToneMapping;
use domelight::{Rgb, RgbImage};
use rayon::prelude::*;

use domelight_lab::svg::Rect;

/// Columns and rows of the picture of the probe.
pub(crate) const MAP: (usize, usize) = (1280, 640);

/// The picture of a map; `color` makes what is shown at a pixel from the mean radiance behind it.
pub(crate) fn map_picture(
    map: &RgbImage,
    color: impl Fn(usize, usize, Rgb) -> Rgb + Sync,
) -> RgbImage {
    let (width, height) = MAP;
    let pixels: Vec<Rgb> = (0..height)
        .into_par_iter()
        .flat_map_iter(|y| (0..width).map(move |x| (x, y)))
        .map(|(x, y)| color(x, y, footprint(map, x, y)))
        .collect();
    RgbImage::new(width, height, pixels)
}

/// Mean radiance of the texels behind a pixel of the picture.
fn footprint(map: &RgbImage, x: usize, y: usize) -> Rgb {
    let range = |i: usize, n: usize, of: usize| {
        let start = i * of / n;
        start..((i + 1) * of / n).max(start + 1)
    };
    let (columns, rows) = (range(x, MAP.0, map.width), range(y, MAP.1, map.height));
    let n = (columns.len() * rows.len()) as f32;
    let sum: Rgb = rows.flat_map(|y| map.row(y)[columns.clone()].iter().copied()).sum();
    sum / n
}

/// Where a direction is on the picture of the probe.
pub(crate) fn place(environment: &Environment, direction: Vec3, map: Rect) -> (f64, f64) {
    let uv = environment.uv(direction);
    (map.x + f64::from(uv.x) * map.width, map.y + f64::from(uv.y) * map.height)
}

/// The circle of an angular radius \[rad\] around a direction, cut where it runs across the seam.
pub(crate) fn circle(
    environment: &Environment,
    direction: Vec3,
    angular_radius: f32,
    map: Rect,
) -> Vec<Vec<(f64, f64)>> {
    const STEPS: usize = 96;
    let frame = Frame::from_z(direction);
    let (sin, cos) = angular_radius.sin_cos();
    let mut runs: Vec<Vec<(f64, f64)>> = vec![Vec::new()];
    for i in 0..=STEPS {
        let (sin_phi, cos_phi) = (std::f32::consts::TAU * i as f32 / STEPS as f32).sin_cos();
        let on_circle = frame.to_world(vec3(sin * cos_phi, sin * sin_phi, cos));
        let at = place(environment, on_circle, map);
        let last = runs.last().and_then(|run| run.last());
        if last.is_some_and(|last| (last.0 - at.0).abs() > 0.5 * map.width) {
            runs.push(Vec::new());
        }
        if let Some(run) = runs.last_mut() {
            run.push(at);
        }
    }
    runs
}

/// A picture whose values are already those to be shown.
pub(crate) fn png_bytes(image: &RgbImage) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    png::encode(image, None, &ToneMapping::default(), Depth::Eight, &mut bytes)?;
    Ok(bytes)
}
