//! What notebooks show of lobes and rigs.

use std::f64::consts::PI;

use domelight::environment::Environment;
use domelight::math::{Vec3, vec3};
use domelight::rig::{Rig, SphericalHarmonics};
use domelight::{Rgb, RgbImage};
use domelight_lab::svg::plot::{Axis, Datum, Join, Legend, Plot, Scale, Series};
use domelight_lab::svg::{Document, PALETTE, Rect};

/// The viewer's angles to the normal [degrees].
const VIEWS: [f32; 3] = [0.0, 45.0, 75.0];

/// Angles of the light on either side of the normal.
const ANGLES: i32 = 360;

/// A plot of f cos θ in the plane of incidence. `eval` has the viewer's direction and those of the light.
pub(crate) fn lobe_svg<E>(
    title: &str,
    mut eval: impl FnMut([f32; 3], &[[f32; 3]]) -> Result<Vec<Rgb>, E>,
) -> Result<String, E> {
    let direction = |degrees: f32| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        [sin, 0.0, cos]
    };
    let angles: Vec<f32> = (1 - ANGLES..ANGLES).map(|i| 90.0 * i as f32 / ANGLES as f32).collect();
    let lights: Vec<[f32; 3]> = angles.iter().map(|&angle| direction(angle)).collect();
    let mut series = Vec::new();
    for (view, color) in VIEWS.into_iter().zip(PALETTE) {
        let values = eval(direction(-view), &lights)?;
        let datum = |(&angle, value): (&f32, &Rgb)| {
            Datum::new(f64::from(angle), f64::from(value.luminance()))
        };
        let points = angles.iter().zip(&values).map(datum).collect();
        let name =
            if view == 0.0 { "viewer at 0°".into() } else { format!("viewer at −{view}°") };
        series.push(Series::new(name, color, Join::Curve, points));
    }
    let values = series.iter().flat_map(|s| s.points.iter().map(|p| p.y));
    let most = values.filter(|y| y.is_finite()).fold(0.0, f64::max);
    let plot = Plot {
        title: title.to_owned(),
        x: Axis::new("light in the plane of incidence [degrees]", Scale::Linear, -90.0, 90.0),
        y: Axis::new("f cos θ", Scale::Linear, 0.0, 1.05 * most.max(1e-6)),
        series,
        legend: Legend::Above,
    };
    let (width, height) = (520.0, 340.0);
    let mut sheet = Document::new(width, height);
    plot.draw(&mut sheet, Rect::new(0.0, 0.0, width, height));
    Ok(sheet.to_svg())
}

/// Rows of the picture of a rig.
const BALL: usize = 192;

/// Matte balls in the light of the rig alone, of the residual alone, and of both; and their coverage.
pub(crate) fn balls(rig: &Rig, residual: Option<&Environment>) -> (RgbImage, Vec<f32>) {
    const REFLECTANCE: f32 = 0.8;
    let rest = residual.map(SphericalHarmonics::project);
    let shading = |normal: Vec3| {
        let lights = rig.lights.iter().fold(Rgb::BLACK, |sum, light| {
            sum + light.irradiance * normal.dot(light.direction).max(0.0)
        });
        let rest =
            rest.as_ref().map_or(Rgb::BLACK, |rest| rest.irradiance(normal).map(|c| c.max(0.0)));
        [lights, rest, lights + rest].map(|irradiance| irradiance * (REFLECTANCE / PI as f32))
    };
    let n_balls = if rest.is_some() { 3 } else { 1 };
    let radius = 0.46 * BALL as f32;
    let mut picture = RgbImage::new(n_balls * BALL, BALL, vec![Rgb::BLACK; n_balls * BALL * BALL]);
    let mut alpha = vec![0.0; picture.pixels.len()];
    for y in 0..BALL {
        for x in 0..BALL {
            let at = |i: usize| (i as f32 + 0.5 - 0.5 * BALL as f32) / radius;
            let (u, v) = (at(x), -at(y));
            let r = u.hypot(v);
            let covered = ((1.0 - r) * radius + 0.5).clamp(0.0, 1.0);
            let normal = vec3(u, v, (1.0 - r * r).max(0.0).sqrt()).normalize();
            for (ball, color) in shading(normal).into_iter().take(n_balls).enumerate() {
                let i = y * picture.width + ball * BALL + x;
                picture.pixels[i] = color * covered;
                alpha[i] = covered;
            }
        }
    }
    (picture, alpha)
}
