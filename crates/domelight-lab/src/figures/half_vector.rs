//! Figure 9: half vectors, and the Jacobian from half vectors to reflected directions.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use domelight::bsdf::{Brdf, Bsdf};
use domelight::code;
use domelight::math::{Frame, Vec3, reflect, vec3};
use domelight::quote::Html;
use domelight::sampling::{Dimension, Sampler, SamplerKind};

use super::context::FigureContext;
use super::figure::{Figure, Row, Table, number, plot_panel};
use super::formulas;
use crate::Error;
use crate::svg::plot::{Axis, Datum, Join, Legend, Plot, Scale, Series};
use crate::svg::{Anchor, Color, Document, PALETTE, Point, Style, TextStyle};

/// The lobe, and the angle between the viewer and the normal [degrees].
const MATERIAL: &str = "ggx:0.3";
const VIEWER: f64 = 40.0;
/// Angular radius of the patches of half vectors [degrees].
const PATCH: f32 = 6.0;
/// Half vectors at the patch centers: polar angle and azimuth, 180 toward the viewer [degrees]. The page's are the same.
/// Chosen so that the labels of the reflected patches do not overlap.
const PATCHES: [(f32, f32); 5] =
    [(0.0, 0.0), (18.0, 60.0), (20.0, -70.0), (40.0, 115.0), (38.0, -140.0)];
/// Width of the slice around the plane of incidence, and of its bins; no bin straddles the normal [degrees].
const SLICE: f64 = 12.0;
const BIN: f64 = 5.0;

pub(crate) fn make(context: &FigureContext) -> Result<Figure, Error> {
    let n = context.choose(400_000, 20_000);
    let wo = in_plane(VIEWER);
    let bsdf = MATERIAL.parse::<Bsdf>()?.for_view(wo);
    let mut table = Table::new(&[
        "half vector, polar angle and azimuth [°]",
        "its patch [sr]",
        "the patch of directions [sr]",
        "ratio",
        "4 (ωh · ωi)",
    ]);
    for (i, patch) in patches(wo).iter().enumerate() {
        let (theta, phi) = PATCHES[i];
        let ratio = patch.reflected_solid_angle / patch.solid_angle;
        let rounded = |x: f64| number(x).parse::<f64>().unwrap_or(x);
        table.rows.push(vec![
            format!("{theta:.0}, {phi:.0}").into(),
            rounded(patch.solid_angle).into(),
            rounded(patch.reflected_solid_angle).into(),
            rounded(ratio).into(),
            rounded(patch.jacobian).into(),
        ]);
    }
    let integral = integrals(&bsdf, wo);
    let plot = densities(&bsdf, wo, n, context.seed);
    Ok(Figure {
        number: 9,
        title: "Half vectors and the Jacobian",
        slides: "slides 8–9",
        caption: code!(
            Html,
            "<p>A microfacet reflects the viewer’s direction ω<sub>o</sub> into ω<sub>i</sub> if its normal is their \
             half vector ω<sub>h</sub>. So directions are sampled by sampling half vectors and reflecting about them. \
             In the plane of incidence, rotating ω<sub>h</sub> rotates ω<sub>i</sub> twice as far; on the sphere, a \
             small patch of half vectors maps to a patch of directions 4 (ω<sub>h</sub>·ω<sub>i</sub>) times as large, \
             as the table measures. The density per solid angle of ω<sub>i</sub> is lower by the same factor.</p>\
             <p>Below: the lobe {MATERIAL} seen {VIEWER}° from the normal, in the plane of incidence. {n} sampled \
             directions follow the density with the Jacobian. Without the Jacobian the density integrates to {without} \
             instead of {with}, the fraction of samples above the horizon; an estimate that divides by it is too dark \
             by the ratio of the two.</p>",
            MATERIAL = MATERIAL,
            VIEWER = VIEWER,
            n = n,
            without = (100.0 * integral.without).round() / 100.0,
            with = (100.0 * integral.with).round() / 100.0,
        ),
        formulas: formulas::half_vector(),
        rows: vec![
            Row::new("", vec![plane_of_incidence(), sphere(wo)]),
            Row::new("Density of ωi in the plane of incidence", vec![plot]),
        ],
        tables: vec![table],
        pictures: Vec::new(),
    })
}

/// The direction at this angle from the normal [degrees], in the plane of incidence, on the viewer's side.
fn in_plane(degrees: f64) -> Vec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    vec3(-sin as f32, 0.0, cos as f32)
}

/// A patch of half vectors and its reflection.
struct Patch {
    /// The rim of the patch: half vectors and reflected directions.
    half_vectors: Vec<Vec3>,
    directions: Vec<Vec3>,
    solid_angle: f64,
    reflected_solid_angle: f64,
    /// 4 (ωh · ωi) at the center.
    jacobian: f64,
}

fn patches(wo: Vec3) -> Vec<Patch> {
    const STEPS: usize = 720;
    PATCHES
        .iter()
        .map(|&(theta, phi)| {
            let (sin, cos) = theta.to_radians().sin_cos();
            let (sin_phi, cos_phi) = phi.to_radians().sin_cos();
            let middle = vec3(sin * cos_phi, sin * sin_phi, cos);
            let frame = Frame::from_z(middle);
            let (sin, cos) = PATCH.to_radians().sin_cos();
            let rim = |i: usize| {
                let (s, c) = (std::f32::consts::TAU * i as f32 / STEPS as f32).sin_cos();
                frame.to_world(vec3(sin * c, sin * s, cos))
            };
            let half_vectors: Vec<Vec3> = (0..STEPS).map(rim).collect();
            let directions: Vec<Vec3> = half_vectors.iter().map(|&h| reflect(wo, h)).collect();
            Patch {
                solid_angle: solid_angle(middle, &half_vectors),
                reflected_solid_angle: solid_angle(reflect(wo, middle), &directions),
                jacobian: 4.0 * f64::from(middle.dot(wo)),
                half_vectors,
                directions,
            }
        })
        .collect()
}

/// The solid angle inside a rim around `middle` [sr], as a fan of triangles (Van Oosterom & Strackee 1983).
fn solid_angle(middle: Vec3, rim: &[Vec3]) -> f64 {
    let double = |v: Vec3| v.to_array().map(f64::from);
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let a = double(middle);
    let mut sum = 0.0;
    for i in 0..rim.len() {
        let (b, c) = (double(rim[i]), double(rim[(i + 1) % rim.len()]));
        let cross =
            [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
        let below = 1.0 + dot(a, b) + dot(b, c) + dot(c, a);
        sum += 2.0 * dot(a, cross).atan2(below);
    }
    sum.abs()
}

/// A side view of the surface: a fan of half vectors, and the reflected directions.
fn plane_of_incidence() -> Document {
    const SIZE: (f64, f64) = (620.0, 400.0);
    const RADIUS: f64 = 270.0;
    let origin = (0.5 * SIZE.0, SIZE.1 - 40.0);
    let mut panel = Document::new(SIZE.0, SIZE.1);
    let at = |degrees: f64, radius: f64| -> Point {
        let (sin, cos) = degrees.to_radians().sin_cos();
        (origin.0 - radius * sin, origin.1 - radius * cos)
    };
    panel.text((0.0, 19.0), "In the plane of incidence", TextStyle::new(19.0).bold());
    panel.line((20.0, origin.1), (SIZE.0 - 20.0, origin.1), Style::stroke(Color::INK, 2.0));
    panel.line(origin, at(0.0, RADIUS + 30.0), Style::stroke(Color::GRAY, 1.2).dashed(6.0));
    let label = |panel: &mut Document, at: Point, text: &str, color: Color| {
        panel.text(at, text, TextStyle::new(17.0).color(color).anchor(Anchor::Middle).halo());
    };
    label(&mut panel, at(0.0, RADIUS + 40.0), "n", Color::GRAY);
    // Half vectors 8° apart reflect to directions 16° apart.
    for half in [8.0, 0.0, -8.0, -16.0] {
        let direction = 2.0 * half - VIEWER;
        let strong = half == -8.0;
        let width = if strong { 3.0 } else { 1.6 };
        arrow(
            &mut panel,
            origin,
            at(half, 0.62 * RADIUS),
            Style::stroke(PALETTE[2], width),
            PALETTE[2],
        );
        arrow(
            &mut panel,
            origin,
            at(direction, RADIUS),
            Style::stroke(PALETTE[1], width),
            PALETTE[1],
        );
        if strong {
            label(&mut panel, at(half - 5.0, 0.62 * RADIUS + 16.0), "ωh", PALETTE[2]);
            label(&mut panel, at(direction, RADIUS + 20.0), "ωi", PALETTE[1]);
        }
    }
    arrow(&mut panel, origin, at(VIEWER, RADIUS), Style::stroke(PALETTE[0], 3.0), PALETTE[0]);
    label(&mut panel, at(VIEWER, RADIUS + 20.0), "ωo", PALETTE[0]);
    let arc = |from: f64, to: f64, radius: f64| {
        (0..=24).map(move |i| from + (to - from) * f64::from(i) / 24.0).map(move |a| at(a, radius))
    };
    panel.polyline(arc(0.0, -8.0, 0.62 * RADIUS + 10.0), Style::stroke(PALETTE[2], 2.0));
    label(&mut panel, at(-3.5, 0.62 * RADIUS + 18.0), "8°", PALETTE[2]);
    panel.polyline(arc(-VIEWER, -VIEWER - 16.0, 190.0), Style::stroke(PALETTE[1], 2.0));
    label(&mut panel, at(-VIEWER - 8.0, 172.0), "16°", PALETTE[1]);
    panel
}

/// A line with a point at its end.
fn arrow(panel: &mut Document, from: Point, to: Point, style: Style, color: Color) {
    const LENGTH: f64 = 13.0;
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let length = dx.hypot(dy).max(1.0);
    let (dx, dy) = (dx / length, dy / length);
    let back = (to.0 - LENGTH * dx, to.1 - LENGTH * dy);
    panel.line(from, back, style);
    let side = |s: f64| (back.0 - s * 0.4 * LENGTH * dy, back.1 + s * 0.4 * LENGTH * dx);
    panel.polyline([to, side(1.0), side(-1.0), to], Style::fill(color));
}

/// The hemisphere from above, with radius proportional to the polar angle.
fn sphere(wo: Vec3) -> Document {
    const SIZE: f64 = 400.0;
    let (center, radius) = (0.5 * SIZE, 0.5 * SIZE - 24.0);
    let mut panel = Document::new(SIZE + 40.0, SIZE);
    let at = |w: Vec3| {
        let theta = f64::from(w.x.hypot(w.y)).atan2(f64::from(w.z));
        let phi = f64::from(w.y.atan2(w.x));
        let r = radius * theta / FRAC_PI_2;
        (center + 12.0 + r * phi.cos(), center + 12.0 - r * phi.sin())
    };
    panel.text((0.0, 19.0), "On the hemisphere, from above", TextStyle::new(19.0).bold());
    for degrees in [30.0, 60.0, 90.0] {
        let r = radius * degrees / 90.0;
        panel.circle((center + 12.0, center + 12.0), r, Style::stroke(Color::FAINT, 1.4));
    }
    let patches = patches(wo);
    let middle = |rim: &[Vec3]| at(rim.iter().copied().sum::<Vec3>().normalize());
    for patch in &patches {
        let (a, b) = (middle(&patch.half_vectors), middle(&patch.directions));
        panel.line(a, b, Style::stroke(Color::GRAY, 1.0).dashed(4.0));
    }
    for patch in &patches {
        let loop_of = |rim: &[Vec3]| -> Vec<Point> {
            rim.iter().chain(rim.first()).map(|&w| at(w)).collect()
        };
        for (rim, color) in [(&patch.directions, PALETTE[1]), (&patch.half_vectors, PALETTE[2])] {
            panel.polyline(loop_of(rim), Style::fill(color).opacity(0.35));
            panel.polyline(loop_of(rim), Style::stroke(color, 2.0));
        }
        let (x, y) = middle(&patch.directions);
        let times = format!("× {:.2}", patch.reflected_solid_angle / patch.solid_angle);
        let style = TextStyle::new(15.0).anchor(Anchor::Middle).halo();
        panel.text((x, y + 5.0), &times, style);
    }
    panel.circle(at(wo), 6.0, Style::fill(PALETTE[0]).outlined(Color::WHITE, 1.0));
    let (x, y) = at(wo);
    panel.text((x - 12.0, y - 10.0), "ωo", TextStyle::new(17.0).color(PALETTE[0]).halo());
    panel
}

/// The integral of the density over the hemisphere, with and without the Jacobian.
struct Integrals {
    with: f64,
    without: f64,
}

/// Integrates with the midpoint rule over rings and sectors.
fn integrals(bsdf: &Bsdf, wo: Vec3) -> Integrals {
    const RINGS: usize = 256;
    const SECTORS: usize = 512;
    let (mut with, mut without) = (0.0, 0.0);
    for i in 0..RINGS {
        let theta = FRAC_PI_2 * (i as f64 + 0.5) / RINGS as f64;
        let omega = theta.sin() * FRAC_PI_2 / RINGS as f64 * TAU / SECTORS as f64;
        for j in 0..SECTORS {
            let (sin_phi, cos_phi) = (TAU * (j as f64 + 0.5) / SECTORS as f64).sin_cos();
            let wi = vec3(
                (theta.sin() * cos_phi) as f32,
                (theta.sin() * sin_phi) as f32,
                theta.cos() as f32,
            );
            let pdf = f64::from(bsdf.pdf(wo, wi));
            with += pdf * omega;
            without += pdf * jacobian(wo, wi) * omega;
        }
    }
    Integrals { with, without }
}

/// 4 (ωh · ωi).
fn jacobian(wo: Vec3, wi: Vec3) -> f64 {
    4.0 * f64::from((wo + wi).normalize().dot(wi))
}

/// Densities along the plane of incidence, and a histogram of the directions sampled near it.
fn densities(bsdf: &Bsdf, wo: Vec3, n: usize, seed: u64) -> Document {
    // The side away from the viewer counts as positive.
    let toward = |degrees: f64| in_plane(-degrees);
    let curve = |value: &dyn Fn(Vec3) -> f64| -> Vec<Datum> {
        (-178..=178).map(|i| 0.5 * f64::from(i)).map(|x| Datum::new(x, value(toward(x)))).collect()
    };
    let with = curve(&|wi| f64::from(bsdf.pdf(wo, wi)));
    let without = curve(&|wi| f64::from(bsdf.pdf(wo, wi)) * jacobian(wo, wi));
    let bars = histogram(bsdf, wo, n, seed);
    let top = without.iter().chain(&bars).map(|d| d.y).fold(0.0, f64::max);
    let plot = Plot {
        title: String::new(),
        x: Axis::new(
            "angle of ωi from the normal, away from the viewer [°]",
            Scale::Linear,
            -90.0,
            90.0,
        ),
        y: Axis::new("density [1/sr]", Scale::Linear, 0.0, 1.08 * top),
        series: vec![
            Series::new("sampled directions", PALETTE[0], Join::Bars, bars),
            Series::new("p(ωh) / 4 (ωh · ωi)", PALETTE[1], Join::Curve, with),
            Series::new("p(ωh), without the Jacobian", PALETTE[6], Join::Dashed, without),
        ],
        legend: Legend::Above,
    };
    plot_panel(&plot, 1080.0, 420.0)
}

/// Directions per solid angle in a slice of [`SLICE`] around the plane of incidence.
fn histogram(bsdf: &Bsdf, wo: Vec3, n: usize, seed: u64) -> Vec<Datum> {
    let n_bins = (180.0 / BIN) as usize;
    let sampler = Sampler::new(SamplerKind::Independent, seed, 9);
    let mut counts = vec![0u32; n_bins];
    for i in 0..n {
        let u = sampler.numbers(Dimension::Brdf, i as u32);
        let Some(sample) = bsdf.sample(wo, u.u_lobe(), u.u()) else { continue };
        let wi = sample.wi;
        let azimuth = f64::from(wi.y.atan2(wi.x.abs())).to_degrees();
        if azimuth.abs() < 0.5 * SLICE {
            let theta = f64::from(wi.x.hypot(wi.y)).atan2(f64::from(wi.z)).to_degrees();
            let angle = theta.copysign(f64::from(wi.x));
            counts[(((angle + 90.0) / BIN) as usize).min(n_bins - 1)] += 1;
        }
    }
    let edge = |i: usize| -90.0 + BIN * i as f64;
    let density = |i: usize| {
        // The ring sector between two polar angles on one side.
        let cos = |degrees: f64| degrees.to_radians().cos();
        let omega = (cos(edge(i)) - cos(edge(i + 1))).abs() * SLICE * PI / 180.0;
        f64::from(counts[i]) / (n as f64 * omega)
    };
    let last = Datum::new(90.0, 0.0);
    (0..n_bins).map(|i| Datum::new(edge(i), density(i))).chain([last]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_grow_by_the_jacobian() {
        for patch in patches(in_plane(VIEWER)) {
            let ratio = patch.reflected_solid_angle / patch.solid_angle;
            assert!((ratio / patch.jacobian - 1.0).abs() < 0.01, "{ratio} {}", patch.jacobian);
        }
        let cap = TAU * (1.0 - f64::from(PATCH.to_radians()).cos());
        assert!((patches(in_plane(VIEWER))[0].solid_angle / cap - 1.0).abs() < 1e-3);
    }
}
