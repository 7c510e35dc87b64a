//! A picture of a rig: the probe with regions and lights, a sphere under both, and the error.

use std::path::Path;

use anyhow::Result;
use domelight::environment::Environment;
use domelight::math::{Vec2, Vec3, vec2};
use domelight::picture::tone::{ToneCurve, ToneMapping, srgb_from_linear};
use domelight::rig::{Rig, RigLight, quadrature};
use domelight::{Rgb, RgbImage};
use rayon::prelude::*;

use super::ExtractedRig;
use super::report::error_text;
use crate::map_picture::{MAP, circle, map_picture, place, png_bytes};
use domelight_lab::svg::plot::{Axis, Datum, Join, Legend, Marker, Plot, Scale, Series};
use domelight_lab::svg::{Anchor, Color, Document, PALETTE, Pixels, Rect, Style, TextStyle};

const WIDTH: f64 = 1320.0;
const MARGIN: f64 = 20.0;
/// Pixels along the edge of the picture of a sphere.
const SPHERE: usize = 300;
/// Its edge on the sheet, and beside a plot of errors.
const LARGE: f64 = 416.0;
const SMALL: f64 = 280.0;
/// Room between pictures.
const GAP: f64 = 16.0;
/// Lights that stand for the probe when it lights the sphere.
const QUADRATURE: usize = 1 << 13;
/// Lights above which they have no numbers.
const MAX_NUMBERS: usize = 128;

pub(super) struct Preview<'a> {
    pub(super) environment: &'a Environment,
    /// The environment's radiance.
    pub(super) map: &'a RgbImage,
    pub(super) found: &'a ExtractedRig,
    pub(super) probe: &'a str,
    pub(super) tone: ToneMapping,
}

impl Preview<'_> {
    pub(super) fn png(&self) -> Result<Vec<u8>> {
        let has_plot = self.found.errors.len() > 1;
        let map = Rect::new(MARGIN, 64.0, MAP.0 as f64, MAP.1 as f64);
        let below = map.y + map.height + GAP;
        let edge = if has_plot { SMALL } else { LARGE };
        let mut sheet = Document::new(WIDTH, below + edge + 76.0);
        self.draw_title(&mut sheet);
        sheet.image(map, &png_bytes(&self.map())?, Pixels::Smooth);
        sheet.clipped(map, |sheet| self.draw_lights(sheet, map));
        self.draw_spheres(&mut sheet, below, edge)?;
        if has_plot {
            let left = MARGIN + 3.0 * (edge + GAP);
            self.draw_errors(&mut sheet, Rect::new(left, below, WIDTH - left - MARGIN, 340.0));
        }
        Ok(sheet.to_png(1.0)?)
    }

    fn rig(&self) -> &Rig {
        &self.found.extraction.rig
    }

    fn draw_title(&self, sheet: &mut Document) {
        let n = self.rig().lights.len();
        let beside = if self.found.extraction.residual.is_some() { " beside a dome" } else { "" };
        let lights = if n == 1 { "light" } else { "lights" };
        let probe =
            Path::new(self.probe).file_name().map_or(self.probe.into(), |n| n.to_string_lossy());
        let title = format!("{probe}: {n} {lights}{beside}");
        sheet.text((MARGIN, 32.0), &title, TextStyle::new(24.0).bold());
        if let Some(error) = self.found.error() {
            let style = TextStyle::new(17.0).color(Color::GRAY);
            sheet.text((MARGIN, 54.0), &error_text(error), style);
        }
    }

    /// The probe with the borders of regions, ready to be shown.
    fn map(&self) -> RgbImage {
        let (width, height) = MAP;
        let rig = self.rig();
        let label = |x: usize, y: usize| {
            let (column, row) = (x * rig.width / width, y * rig.height / height);
            rig.labels[row * rig.width + column]
        };
        map_picture(self.map, |x, y, radiance| {
            let here = label(x, y);
            let border =
                label((x + 1) % width, y) != here || label(x, (y + 1).min(height - 1)) != here;
            let le = self.tone.apply(radiance);
            // Seen on dark and on bright ground.
            let bright = le.luminance() > 0.2;
            if border { le.map(|c| if bright { 0.25 * c } else { c + 0.3 }) } else { le }
        })
    }

    /// Each light as the outline of its disc, and a point in its color with its number.
    fn draw_lights(&self, sheet: &mut Document, map: Rect) {
        let lights = &self.rig().lights;
        // The brightest on top.
        for (i, light) in lights.iter().enumerate().rev() {
            let color = hue(light.irradiance);
            for run in circle(self.environment, light.direction, light.angular_radius, map) {
                sheet.polyline(run.iter().copied(), Style::stroke(Color::INK, 3.2).opacity(0.5));
                sheet.polyline(run, Style::stroke(color, 1.6));
            }
            let at = place(self.environment, light.direction, map);
            let numbered = lights.len() <= MAX_NUMBERS;
            let radius = if numbered { 10.0 } else { 3.5 };
            sheet.circle(at, radius, Style::fill(color).outlined(Color::INK, 1.2));
            if numbered {
                let number = (i + 1).to_string();
                let style = TextStyle::new(if i < 99 { 13.0 } else { 10.0 });
                sheet.text((at.0, at.1 + 4.5), &number, style.anchor(Anchor::Middle).bold());
            }
        }
    }

    /// A white matte sphere under the probe and under the rig, and how much they differ.
    fn draw_spheres(&self, sheet: &mut Document, top: f64, edge: f64) -> Result<()> {
        let lights = quadrature(self.environment, QUADRATURE).lights;
        let probe = sphere(self.environment, &lights);
        let mut lights = self.rig().lights.clone();
        if let Some(dome) = &self.found.extraction.residual {
            lights.extend(quadrature(dome, QUADRATURE).lights);
        }
        let rig = sphere(self.environment, &lights);
        let brightest = probe.pixels.iter().map(|p| p.max_component()).fold(0.0, f32::max);
        let exposed = |image: &RgbImage, scale: f32| {
            let curve = ToneMapping { exposure: 0.0, curve: ToneCurve::Standard };
            let show = |p: &Rgb| curve.apply(*p * (scale / brightest.max(f32::MIN_POSITIVE)));
            RgbImage { pixels: image.pixels.iter().map(show).collect(), ..*image }
        };
        let difference = |(p, r): (&Rgb, &Rgb)| (*p - *r).map(f32::abs);
        let pixels: Vec<Rgb> = probe.pixels.iter().zip(&rig.pixels).map(difference).collect();
        let worst = pixels.iter().map(|p| p.max_component()).fold(0.0, f32::max) / brightest;
        let gain = magnification(worst);
        let difference = RgbImage { pixels, ..probe };
        let titles = [
            (exposed(&probe, 1.0), "under the probe".to_owned()),
            (exposed(&rig, 1.0), "under the rig".to_owned()),
            (exposed(&difference, gain), format!("difference × {gain}")),
        ];
        for (i, (image, title)) in titles.iter().enumerate() {
            let r = Rect::new(MARGIN + i as f64 * (edge + GAP), top, edge, edge);
            sheet.image(r, &png_bytes(image)?, Pixels::Smooth);
            let style = TextStyle::new(17.0).anchor(Anchor::Middle);
            sheet.text((r.x + 0.5 * edge, top + edge + 24.0), title, style);
        }
        let note = format!(
            "a white matte sphere without shadows; the largest difference is {:.2} % of its \
             brightest point",
            100.0 * worst
        );
        let style = TextStyle::new(15.0).color(Color::GRAY);
        sheet.text((MARGIN, top + edge + 52.0), &note, style);
        Ok(())
    }

    /// The error over the numbers of lights that were tried.
    fn draw_errors(&self, sheet: &mut Document, r: Rect) {
        let errors = &self.found.errors;
        let series =
            |name: &str, i: usize, value: fn(&domelight::rig::ShadingError) -> f64| Series {
                name: name.to_owned(),
                color: PALETTE[i],
                join: Join::Curve,
                marker: Some(Marker::ALL[i]),
                points: errors
                    .iter()
                    .map(|(n, e)| Datum::new(*n as f64, 100.0 * value(e)))
                    .collect(),
            };
        let series = vec![series("matte", 0, |e| e.diffuse), series("glossy", 1, |e| e.glossy)];
        let y = series.iter().flat_map(|s| &s.points).map(|p| p.y);
        let plot = Plot {
            title: String::new(),
            x: Axis::around("lights", Scale::Log, errors.iter().map(|(n, _)| *n as f64)),
            y: Axis::around("shading error [%]", Scale::Log, y),
            series: series.clone(),
            legend: Legend::Above,
        };
        plot.draw(sheet, r);
    }
}

/// The color of light at full brightness, not darker than can be seen.
fn hue(light: Rgb) -> Color {
    let shown = light / light.max_component().max(f32::MIN_POSITIVE);
    let encoded = shown.map(srgb_from_linear).to_array();
    let [r, g, b] = encoded.map(|c| (255.0 * c).round().clamp(70.0, 255.0) as u8);
    Color(r, g, b)
}

/// A power of two that shows a difference of `worst` at about half brightness.
fn magnification(worst: f32) -> f32 {
    (0.5 / worst.clamp(1e-6, 0.5)).log2().floor().exp2()
}

/// Irradiance over π of a sphere, seen along the map's center column, slightly from above.
fn sphere(environment: &Environment, lights: &[RigLight]) -> RgbImage {
    let view = -environment.direction(vec2(0.5, 0.55));
    let right = environment.orientation().up.vector().cross(view).normalize();
    let up = view.cross(right);
    let lights: Vec<(Vec3, Rgb)> =
        lights.iter().map(|l| (l.direction, l.irradiance * std::f32::consts::FRAC_1_PI)).collect();
    let pixel = |i: usize| {
        let (x, y) = ((i % SPHERE) as f32 + 0.5, (i / SPHERE) as f32 + 0.5);
        let p: Vec2 = vec2(x, SPHERE as f32 - y) * (2.1 / SPHERE as f32) - Vec2::splat(1.05);
        let z = 1.0 - p.length_squared();
        if z < 0.0 {
            return Rgb::BLACK;
        }
        let normal = right * p.x + up * p.y + view * z.sqrt();
        lights.iter().map(|(direction, light)| *light * normal.dot(*direction).max(0.0)).sum()
    };
    let pixels = (0..SPHERE * SPHERE).into_par_iter().map(pixel).collect();
    RgbImage::new(SPHERE, SPHERE, pixels)
}
