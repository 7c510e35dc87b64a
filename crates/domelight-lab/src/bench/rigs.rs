//! The suite `rigs`: the cost of light rigs, and their shading error.

use domelight::Rgb;
use domelight::environment::Environment;
use domelight::rig::{MedianCut, Method, Rig, ShadingReference, VarianceMinimization};
use serde::{Deserialize, Serialize};

use super::Bench;
use super::bench_run::median;
use super::cases::{self, short};
use super::table::{Table, number};
use crate::names::file_name;
use crate::usage::Stopwatch;
use crate::{At as _, Error};

/// Lights of each rig.
const COUNTS: [usize; 4] = [16, 64, 256, 1024];
/// Rows of the built-in probes.
const ROWS: [u32; 2] = [128, 512];

/// A rig of a probe.
#[derive(Serialize, Deserialize)]
pub(super) struct Row {
    probe: String,
    /// Columns and rows of the map.
    size: [usize; 2],
    method: String,
    lights: usize,
    /// To extract them; one value a repetition, wall-clock seconds where the system does not report them.
    cpu_seconds: Vec<f64>,
    /// The irradiance of all lights against that of the map, the largest difference of a channel relative to it.
    flux_error: f64,
    /// Root mean square of the shading relative to that of the map's: a matte surface, and the lobe cos²⁰.
    diffuse_error: f64,
    glossy_error: f64,
}

fn methods() -> [(&'static str, Method); 2] {
    [
        ("variance minimization", Method::VarianceMinimization(VarianceMinimization::default())),
        ("median cut", Method::MedianCut(MedianCut::default())),
    ]
}

/// Every probe, method and number of lights.
pub(super) fn run(bench: &Bench, rows: &mut Vec<Row>) -> Result<(), Error> {
    let environments = cases::environments(bench.settings, &ROWS, bench.host)?;
    for (i, (probe, environment)) in environments.iter().enumerate() {
        bench.host.status(&format!("probe {} of {}: {probe}", i + 1, environments.len()));
        let reference = ShadingReference::new(environment);
        for (name, method) in methods() {
            for n_lights in COUNTS {
                bench.host.check_canceled()?;
                let repetitions = bench.settings.n_seeds;
                let row = Row::measure(environment, &reference, method, n_lights, repetitions)
                    .at(format_args!("{probe}, {n_lights} lights"))?;
                rows.push(Row { probe: file_name(probe), method: name.to_owned(), ..row });
            }
        }
    }
    Ok(())
}

impl Row {
    fn measure(
        environment: &Environment,
        reference: &ShadingReference,
        method: Method,
        n_lights: usize,
        repetitions: u32,
    ) -> Result<Self, Error> {
        // Once more than it counts: the first warms the caches.
        let mut rig = method.rig(environment, n_lights)?;
        let mut cpu_seconds = Vec::new();
        for _ in 0..repetitions {
            let mut watch = Stopwatch::start();
            rig = method.rig(environment, n_lights)?;
            let time = watch.lap();
            cpu_seconds.push(time.cpu.unwrap_or(time.wall));
        }
        let error = reference.error(&rig);
        Ok(Self {
            probe: String::new(),
            size: [rig.width, rig.height],
            method: String::new(),
            lights: rig.lights.len(),
            cpu_seconds,
            flux_error: flux_error(environment, &rig),
            diffuse_error: error.diffuse,
            glossy_error: error.glossy,
        })
    }
}

/// Summed in double precision, texel by texel, so that it is the rig's error and not the sum's.
fn flux_error(environment: &Environment, rig: &Rig) -> f64 {
    let map = environment.radiance_map();
    let mut flux = [0.0; 3];
    for (row, pixels) in map.pixels.chunks(map.width).enumerate() {
        let solid_angle = environment.texel_solid_angle(row);
        for pixel in pixels {
            let channels = flux.iter_mut().zip(pixel.to_array());
            channels.for_each(|(sum, c)| *sum += solid_angle * f64::from(c));
        }
    }
    let Rgb { r, g, b } = rig.irradiance();
    let errors = flux.iter().zip([r, g, b]).filter(|(flux, _)| **flux > 0.0);
    errors.map(|(flux, rig)| (f64::from(rig) / flux - 1.0).abs()).fold(0.0, f64::max)
}

pub(super) fn tables(rows: &[Row]) -> Vec<Table> {
    let head = ["probe", "map", "method", "lights", "CPU-s", "flux error", "matte %", "glossy %"];
    let mut table = Table::new("Rigs of lights", &head);
    for row in rows {
        table.rows.push(vec![
            short(&row.probe).to_owned(),
            format!("{}x{}", row.size[0], row.size[1]),
            row.method.clone(),
            row.lights.to_string(),
            number(median(&row.cpu_seconds)),
            number(row.flux_error),
            number(100.0 * row.diffuse_error),
            number(100.0 * row.glossy_error),
        ]);
    }
    let note = "CPU-s: the median of repetitions. Errors: of the flux, relative; of what a matte surface and a lobe \
                cos²⁰ see over 600 normals, root mean squares in percent.";
    table.notes.push(note.to_owned());
    vec![table]
}
