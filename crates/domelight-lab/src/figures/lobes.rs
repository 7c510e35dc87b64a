//! Figure 1: directions sampled from lobes; their histograms and densities.

use crate::Error;
use domelight::bsdf::{Brdf, Bsdf};
use domelight::code;
use domelight::math::{Vec3, from_spherical};
use domelight::quote::Html;
use domelight::sampling::{Dimension, Sampler, SamplerKind};
use std::f64::consts::{PI, TAU};

use super::context::FigureContext;
use super::figure::{Figure, Row, Table, number, plot_panel};
use super::formulas;
use crate::svg::plot::{Axis, Datum, Join, Legend, Plot, Scale, Series};
use crate::svg::{Anchor, Color, Document, PALETTE, Style, TextStyle};

/// Name, and material in the notation of `--material`.
const LOBES: [(&str, &str); 4] = [
    ("Phong, n = 50", "phong:50"),
    ("Ward, α = 0.2", "ward:0.2"),
    ("Ward, α = 0.15 × 0.5", "ward:0.15:0.5"),
    ("GGX, α = 0.3", "ggx:0.3"),
];
const THETA_BINS: usize = 45;
const PHI_BINS: usize = 36;
/// Quadrature points over the other angle.
const QUADRATURE: usize = 256;
/// Directions shown as dots.
const DOTS: usize = 1000;

pub(crate) fn make(context: &FigureContext) -> Result<Figure, Error> {
    let n = context.choose(100_000, 2_000);
    let mut rows = Vec::new();
    let mut table =
        Table::new(&["lobe", "drawn", "lost below the horizon", "χ² of θ", "degrees of freedom"]);
    for (name, notation) in LOBES {
        let lobe = Lobe::new(notation, n, context.seed)?;
        let (chi2, freedom) = lobe.chi2();
        table.rows.push(vec![
            name.into(),
            n.into(),
            (n - lobe.drawn.len()).into(),
            rounded(chi2),
            freedom.into(),
        ]);
        rows.push(Row::new(name, vec![lobe.dots(), lobe.theta_plot(), lobe.phi_plot()]));
    }
    Ok(Figure {
        number: 1,
        title: "Directions sampled from lobes",
        slides: "slides 5–9",
        caption: code!(
            Html,
            "<p>{n} directions per lobe, sampled by inverting its distribution function with the viewer along the \
             normal: a thousand of them as dots (the center is the normal, the rim the horizon), and all of them as \
             histograms over the density that the program divides by. If the histogram follows the curve, sampler and \
             density agree; then χ² is near its degrees of freedom.</p>\
             <p>Three pitfalls: the density of Ward's half vector needs cos³θ<sub>h</sub> in the denominator; a plain \
             arctan for φ<sub>h</sub> reaches only half of the lobe, atan2 all of it; and p(ω<sub>i</sub>) = \
             p(ω<sub>h</sub>) / 4(ω<sub>h</sub>·ω<sub>i</sub>), because ω<sub>i</sub> is traced.</p>",
            n = n,
        ),
        formulas: formulas::lobes(),
        rows,
        tables: vec![table],
        pictures: Vec::new(),
    })
}

/// Rounds a number for the table to meaningful digits.
fn rounded(x: f64) -> serde_json::Value {
    number(x).parse::<f64>().unwrap_or(x).into()
}

/// A lobe seen along the normal, and directions sampled from it.
struct Lobe {
    bsdf: Bsdf,
    /// Polar angle and azimuth [degrees], azimuth in [−180, 180).
    drawn: Vec<(f64, f64)>,
    n: usize,
}

impl Lobe {
    fn new(notation: &str, n: usize, seed: u64) -> Result<Self, Error> {
        let bsdf = notation.parse::<Bsdf>()?.for_view(Vec3::Z);
        let sampler = Sampler::new(SamplerKind::Independent, seed, 0);
        let draw = |i: usize| {
            let u = sampler.numbers(Dimension::Brdf, i as u32);
            let wi = bsdf.sample(Vec3::Z, u.u_lobe(), u.u())?.wi;
            let theta = f64::from(wi.x.hypot(wi.y)).atan2(f64::from(wi.z));
            Some((theta.to_degrees(), f64::from(wi.y.atan2(wi.x)).to_degrees()))
        };
        Ok(Self { bsdf, drawn: (0..n).filter_map(draw).collect(), n })
    }

    /// Density over the hemisphere's angles [rad⁻²].
    fn density(&self, theta: f64, phi: f64) -> f64 {
        let wi = from_spherical(theta.cos() as f32, phi as f32);
        f64::from(self.bsdf.pdf(Vec3::Z, wi)) * theta.sin()
    }

    /// Marginal density of θ [1/degree].
    fn theta_density(&self, degrees: f64) -> f64 {
        let sum: f64 = (0..QUADRATURE)
            .map(|i| self.density(degrees.to_radians(), TAU * (i as f64 + 0.5) / QUADRATURE as f64))
            .sum();
        sum * TAU / QUADRATURE as f64 * PI / 180.0
    }

    /// Marginal density of φ [1/degree].
    fn phi_density(&self, degrees: f64) -> f64 {
        let sum: f64 = (0..QUADRATURE)
            .map(|i| {
                self.density(0.5 * PI * (i as f64 + 0.5) / QUADRATURE as f64, degrees.to_radians())
            })
            .sum();
        sum * 0.5 * PI / QUADRATURE as f64 * PI / 180.0
    }

    /// Counts values in bins of equal width over [min, max).
    fn histogram(
        values: impl Iterator<Item = f64>,
        min: f64,
        max: f64,
        n_bins: usize,
    ) -> Vec<usize> {
        let mut counts = vec![0; n_bins];
        for v in values {
            let bin = ((v - min) / (max - min) * n_bins as f64) as usize;
            counts[bin.min(n_bins - 1)] += 1;
        }
        counts
    }

    /// Σ (observed − expected)² / expected over the bins of θ with expected counts of five or more, and their number.
    fn chi2(&self) -> (f64, usize) {
        const STEPS: usize = 16;
        let counts = Self::histogram(self.drawn.iter().map(|d| d.0), 0.0, 90.0, THETA_BINS);
        let width = 90.0 / THETA_BINS as f64;
        let (mut chi2, mut freedom) = (0.0, 0);
        for (i, &observed) in counts.iter().enumerate() {
            let at = |k: usize| (i as f64 + (k as f64 + 0.5) / STEPS as f64) * width;
            let mean = (0..STEPS).map(|k| self.theta_density(at(k))).sum::<f64>() / STEPS as f64;
            let expected = mean * width * self.n as f64;
            if expected >= 5.0 {
                chi2 += (observed as f64 - expected).powi(2) / expected;
                freedom += 1;
            }
        }
        (chi2, freedom)
    }

    fn plot(
        &self,
        label: &str,
        range: (f64, f64),
        counts: &[usize],
        density: impl Fn(f64) -> f64,
    ) -> Document {
        let (min, max) = range;
        let width = (max - min) / counts.len() as f64;
        let edge = |i: usize| min + i as f64 * width;
        let height = |i: usize| counts.get(i).map_or(0.0, |&c| c as f64 / (self.n as f64 * width));
        let bars: Vec<Datum> = (0..=counts.len()).map(|i| Datum::new(edge(i), height(i))).collect();
        let curve: Vec<Datum> = (0..=360)
            .map(|i| min + (max - min) * f64::from(i) / 360.0)
            .map(|x| Datum::new(x, density(x)))
            .collect();
        let top = bars.iter().chain(&curve).map(|d| d.y).fold(0.0, f64::max);
        let plot = Plot {
            title: String::new(),
            x: Axis::new(label, Scale::Linear, min, max),
            y: Axis::new("density [1/°]", Scale::Linear, 0.0, 1.08 * top),
            series: vec![
                Series::new("histogram", PALETTE[0], Join::Bars, bars),
                Series::new("density", PALETTE[1], Join::Curve, curve),
            ],
            legend: Legend::Above,
        };
        plot_panel(&plot, 500.0, 300.0)
    }

    fn theta_plot(&self) -> Document {
        let counts = Self::histogram(self.drawn.iter().map(|d| d.0), 0.0, 90.0, THETA_BINS);
        self.plot("polar angle θ [°]", (0.0, 90.0), &counts, |x| self.theta_density(x))
    }

    fn phi_plot(&self) -> Document {
        let counts = Self::histogram(self.drawn.iter().map(|d| d.1), -180.0, 180.0, PHI_BINS);
        self.plot("azimuth φ [°]", (-180.0, 180.0), &counts, |x| self.phi_density(x))
    }

    /// The hemisphere from above, with radius proportional to θ.
    fn dots(&self) -> Document {
        const SIZE: f64 = 300.0;
        let (center, radius) = (0.5 * SIZE, 0.5 * SIZE - 12.0);
        let mut panel = Document::new(SIZE, SIZE);
        let rings = [30.0, 60.0, 90.0].map(|degrees| (degrees, radius * degrees / 90.0));
        for (_, r) in rings {
            panel.circle((center, center), r, Style::stroke(Color::FAINT, 1.4));
        }
        for (theta, phi) in self.drawn.iter().take(DOTS) {
            let (r, phi) = (radius * theta / 90.0, phi.to_radians());
            let at = (center + r * phi.cos(), center - r * phi.sin());
            panel.circle(at, 1.7, Style::fill(PALETTE[0]).opacity(0.7));
        }
        for (degrees, r) in rings {
            let at = (center + 0.707 * r, center + 0.707 * r + 5.0);
            let style = TextStyle::new(14.0).color(Color::GRAY).anchor(Anchor::Middle).halo();
            panel.text(at, &format!("{degrees}°"), style);
        }
        panel
    }
}
