//! A picture of a probe: the map with its sun, its light by stops, and the noise of each strategy.

use anyhow::Result;
use domelight::RgbImage;
use domelight::environment::LatLongGrid;
use domelight::environment::statistics::Sun;
use domelight::picture::tone::ToneMapping;
use domelight_lab::probe::{RAYS_A_PIXEL, StrategyNoise};
use domelight_lab::svg::plot::{Axis, Datum, Join, Legend, Plot, Scale, Series};
use domelight_lab::svg::{
    Anchor, Color, Document, PALETTE, Pixels, Rect, Style, TextStyle, text_width,
};

use super::MeasuredProbe;
use crate::map_picture::{MAP, circle, map_picture, place, png_bytes};

const WIDTH: f64 = 1320.0;
const MARGIN: f64 = 20.0;
/// Height of the panels under the map.
const PANEL: f64 = 400.0;
/// Stops below and above the mean radiance that have bars.
const STOPS: std::ops::Range<i32> = -12..20;

pub(super) struct Sheet<'a> {
    pub(super) measured: &'a MeasuredProbe,
    pub(super) tone: ToneMapping,
}

impl Sheet<'_> {
    pub(super) fn png(&self) -> Result<Vec<u8>> {
        let map = Rect::new(MARGIN, 64.0, MAP.0 as f64, MAP.1 as f64);
        let below = map.y + map.height + 24.0;
        let mut sheet = Document::new(WIDTH, below + PANEL + MARGIN);
        self.draw_title(&mut sheet);
        let image = &self.measured.probe.image;
        let picture = map_picture(image, |_, _, radiance| self.tone.apply(radiance));
        sheet.image(map, &png_bytes(&picture)?, Pixels::Smooth);
        if let Some(sun) = &self.measured.statistics.sun {
            sheet.clipped(map, |sheet| self.draw_sun(sheet, map, sun));
        }
        let half = 0.5 * (WIDTH - 3.0 * MARGIN);
        light_by_stops(image).draw(&mut sheet, Rect::new(MARGIN, below, half, PANEL));
        let right = Rect::new(2.0 * MARGIN + half, below, half, PANEL);
        draw_noise(&mut sheet, right, &self.measured.noise);
        Ok(sheet.to_png(1.0)?)
    }

    fn draw_title(&self, sheet: &mut Document) {
        let MeasuredProbe { probe, statistics: s, name, .. } = self.measured;
        sheet.text((MARGIN, 32.0), name, TextStyle::new(24.0).bold());
        let (width, height) = probe.file_size;
        let mut facts = format!(
            "{width} × {height}, {}; {:.1} stops; the brightest texel has {:.0} times the mean radiance",
            probe.mapping,
            s.dynamic_range().log2(),
            s.peak_to_mean()
        );
        if s.plateau.is_some() && !self.measured.is_builtin {
            facts += "; the greatest value is clipped, or evenly bright";
        }
        sheet.text((MARGIN, 54.0), &facts, TextStyle::new(17.0).color(Color::GRAY));
    }

    /// A ring around the sun, and what it is like.
    fn draw_sun(&self, sheet: &mut Document, map: Rect, sun: &Sun) {
        let environment = &self.measured.environment;
        // Wide enough to be seen.
        let radius = sun.angular_radius.max(0.03) * 1.3;
        for run in circle(environment, sun.direction, radius as f32, map) {
            sheet.polyline(run.iter().copied(), Style::stroke(Color::INK, 4.0).opacity(0.6));
            sheet.polyline(run, Style::stroke(PALETTE[4], 2.0));
        }
        let e = sun.irradiance;
        let lines = [
            format!("sun: azimuth {:.1}°, elevation {:.1}°", sun.azimuth(), sun.elevation()),
            format!(
                "{:.2}° wide, {:.1} % of the energy",
                2.0 * sun.angular_radius.to_degrees(),
                100.0 * sun.share
            ),
            format!("irradiance {:.3} {:.3} {:.3}", e.r, e.g, e.b),
        ];
        let (size, leading) = (17.0, 22.0);
        let widest = lines.iter().map(|line| text_width(line, size)).fold(0.0, f64::max);
        let plate = (widest + 16.0, leading * lines.len() as f64 + 12.0);
        let (x, y) = place(environment, sun.direction, map);
        let gap = radius / std::f64::consts::PI * map.height + 14.0;
        let is_right = x + gap + plate.0 < map.x + map.width;
        let left = if is_right { x + gap } else { x - gap - plate.0 };
        let top = (y - 0.5 * plate.1).clamp(map.y + 8.0, map.y + map.height - plate.1 - 8.0);
        let plate = Rect::new(left, top, plate.0, plate.1);
        sheet.rect(plate, Style::fill(Color::WHITE).opacity(0.8));
        for (i, line) in lines.iter().enumerate() {
            let baseline = top + leading * (i + 1) as f64;
            sheet.text((left + 8.0, baseline), line, TextStyle::new(size));
        }
    }
}

/// Which share of the light, and of the sphere, each stop of luminance has.
fn light_by_stops(map: &RgbImage) -> Plot {
    let grid = LatLongGrid::new(map.width, map.height);
    let n = STOPS.len();
    let (mut light, mut sphere) = (vec![0.0; n], vec![0.0; n]);
    let total: f64 = (0..map.height)
        .map(|y| {
            let row: f64 = map.row(y).iter().map(|p| f64::from(p.luminance())).sum();
            row * grid.solid_angle(y)
        })
        .sum();
    let mean = total / (4.0 * std::f64::consts::PI);
    for y in 0..map.height {
        let omega = grid.solid_angle(y);
        for texel in map.row(y) {
            let luminance = f64::from(texel.luminance());
            let stop = (luminance / mean).log2().floor();
            let bin = (stop - f64::from(STOPS.start)).clamp(0.0, (n - 1) as f64) as usize;
            light[bin] += 100.0 * luminance * omega / total.max(f64::MIN_POSITIVE);
            sphere[bin] += 100.0 * omega / (4.0 * std::f64::consts::PI);
        }
    }
    let top = light.iter().chain(&sphere).copied().fold(1.0, f64::max);
    let used = |i: &usize| light[*i] > 0.05 || sphere[*i] > 0.05;
    let first = (0..n).find(used).unwrap_or(0);
    let last = (0..n).rev().find(used).unwrap_or(n - 1) + 1;
    let edge = |i: usize| f64::from(STOPS.start) + i as f64;
    let series = |name: &str, color: usize, shares: &[f64]| Series {
        name: name.to_owned(),
        color: PALETTE[color],
        join: Join::Bars,
        marker: None,
        points: (first..=last)
            .map(|i| Datum::new(edge(i), shares.get(i).copied().unwrap_or(0.0)))
            .collect(),
    };
    Plot {
        title: "Where the light is".to_owned(),
        x: Axis::new("stops above the mean radiance", Scale::Linear, edge(first), edge(last)),
        y: Axis::new("share [%]", Scale::Linear, 0.0, 1.08 * top),
        series: vec![series("of the light", 4, &light), series("of the sphere", 0, &sphere)],
        legend: Legend::Above,
    }
}

/// The error of each strategy as bars over a logarithmic scale.
fn draw_noise(sheet: &mut Document, r: Rect, noise: &[StrategyNoise]) {
    const LABELS: f64 = 150.0;
    const NUMBERS: f64 = 80.0;
    let title = format!("Noise of a sphere, {RAYS_A_PIXEL} shadow rays per pixel");
    let style = TextStyle::new(19.0).bold().anchor(Anchor::Middle);
    sheet.text((r.x + 0.5 * r.width, r.y + 27.0), &title, style);
    let errors = || noise.iter().flat_map(|n| [n.matte, n.glossy]).filter(|e| *e > 0.0);
    let least = errors().fold(f64::INFINITY, f64::min).clamp(1e-4, 0.01) * 0.5;
    let most = errors().fold(0.0, f64::max).max(2.0 * least);
    let length = r.width - LABELS - NUMBERS;
    let along =
        |error: f64| ((error / least).ln() / (most / least).ln()).clamp(0.004, 1.0) * length;
    let materials = [("matte", 2), ("glossy", 1)];
    let mut x = r.x + LABELS;
    for (name, color) in materials {
        sheet.rect(Rect::new(x, r.y + 41.0, 26.0, 14.0), Style::fill(PALETTE[color]).opacity(0.75));
        sheet.text((x + 34.0, r.y + 53.5), name, TextStyle::new(15.0));
        x += 110.0;
    }
    let pitch = (r.height - 110.0) / noise.len().max(1) as f64;
    for (i, n) in noise.iter().enumerate() {
        let top = r.y + 72.0 + pitch * i as f64;
        let label = TextStyle::new(16.0).anchor(Anchor::End);
        sheet.text((r.x + LABELS - 12.0, top + 0.5 * pitch), &n.strategy, label);
        for (k, error) in [n.matte, n.glossy].into_iter().enumerate() {
            let thickness = 0.36 * pitch;
            let y = top + 0.1 * pitch + k as f64 * (thickness + 2.0);
            let bar = Rect::new(r.x + LABELS, y, along(error), thickness);
            sheet.rect(bar, Style::fill(PALETTE[materials[k].1]).opacity(0.75));
            let at = (bar.x + bar.width + 8.0, y + 0.5 * thickness + 5.0);
            sheet.text(at, &percent(error), TextStyle::new(15.0));
        }
    }
    let note =
        "relative RMS error, logarithmic; a sphere on a floor beside another; glossy is GGX 0.2";
    let style = TextStyle::new(14.0).color(Color::GRAY);
    sheet.text((r.x + 12.0, r.y + r.height - 14.0), note, style);
}

/// Two digits that count.
fn percent(error: f64) -> String {
    let percent = 100.0 * error;
    let digits = usize::from(percent < 10.0) + usize::from(percent < 1.0);
    format!("{percent:.digits$} %")
}
