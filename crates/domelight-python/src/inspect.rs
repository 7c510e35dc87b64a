//! The pixel X-ray.

use std::sync::Arc;

use domelight::Rgb;
use domelight::inspect::{
    Decomposition, DirectionHistogram, Enclosure, Hemisphere, PixelSummary, advice,
};
use domelight::strategy::PreparedStrategy;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::arrays::{array, rows};
use crate::camera::CameraLike;
use crate::engine::abandonable_on;
use crate::environment::Environment;
use crate::error::{bad_value, from_source, to_python};
use crate::options;
use crate::render::{Arguments, Choice, RenderSetup, choose};
use crate::scene::Scene;

/// The result at a pixel.
struct Found {
    summary: PixelSummary,
    hemisphere: Option<Hemisphere>,
    enclosure: Option<Enclosure>,
    strategies: Vec<(Decomposition, Option<DirectionHistogram>)>,
}

/// The pixel X-ray; `domelight.inspect` documents it and converts the dictionary to an `Inspection`.
#[pyfunction]
pub(crate) fn inspect<'py>(
    py: Python<'py>,
    scene: &Bound<'py, Scene>,
    env: Option<&Bound<'py, Environment>>,
    strategies: Vec<(String, Bound<'py, PyAny>)>,
    pixel: [i64; 2],
    options: &Bound<'py, PyDict>,
    threads: Option<usize>,
    camera: Option<CameraLike>,
    resolution: usize,
) -> PyResult<Bound<'py, PyDict>> {
    if !(8..=1024).contains(&resolution) {
        return Err(bad_value(format!("resolution is {resolution}; it must be from 8 to 1024")));
    }
    let Some((_, first)) = strategies.first() else {
        return Err(bad_value("there is no strategy to inspect"));
    };
    let arguments = Arguments {
        job: options::job_of_one_sample(options)?,
        strategy: first.clone(),
        threads,
        camera,
        tile_size: None,
    };
    let setup = Arc::new(RenderSetup::new(py, scene.get(), env, arguments)?);
    let inside = |[x, y]: [i64; 2]| Some([usize::try_from(x).ok()?, usize::try_from(y).ok()?]);
    let pixel = inside(pixel).ok_or_else(|| {
        let [x, y] = pixel;
        bad_value(format!("pixel is ({x}, {y}); column and row are not negative"))
    })?;
    let lobes = &scene.get().inner.lobes;
    let choices = strategies
        .into_iter()
        .map(|(name, strategy)| Ok((name, choose(&strategy, 1, lobes)?)))
        .collect::<PyResult<Vec<_>>>()?;
    let on_pool = setup.clone();
    let inspect = move || -> PyResult<Found> {
        let setup = &*on_pool;
        let inspector = setup.inspector(pixel).map_err(|e| from_source(&e))?;
        let one = |(name, choice): &(String, Choice)| match choice {
            Choice::Builtin(spec) => {
                let spec = setup.for_picture(*spec);
                let strategy =
                    PreparedStrategy::new(spec, setup.environment()).map_err(to_python)?;
                let directions = inspector.directions(&strategy, resolution);
                Ok((inspector.decompose(name, &strategy), directions))
            }
            Choice::Python(strategy) => {
                let directions = inspector.directions(strategy, resolution);
                Ok((inspector.decompose(name, strategy), directions))
            }
        };
        Ok(Found {
            summary: inspector.summary(),
            hemisphere: inspector.hemisphere(resolution),
            enclosure: inspector.enclosure(),
            strategies: choices.iter().map(one).collect::<PyResult<_>>()?,
        })
    };
    let found = abandonable_on(py, setup.pool()?, inspect)?;
    if let Some(error) = setup.failure().take() {
        return Err(error);
    }
    found?.into_dict(py, resolution)
}

impl Found {
    fn into_dict(self, py: Python<'_>, resolution: usize) -> PyResult<Bound<'_, PyDict>> {
        let Self { summary, hemisphere, enclosure, strategies } = self;
        let square = [resolution, resolution];
        let picture =
            |pixels: &[Rgb]| rows(py, pixels.iter().map(|p| p.to_array()).collect(), &square);
        let found = PyDict::new(py);
        found.set_item("pixel", (summary.pixel[0], summary.pixel[1]))?;
        found.set_item("coverage", summary.coverage)?;
        let vectors = [
            ("position", summary.position),
            ("normal", summary.normal),
            ("albedo", summary.albedo),
        ];
        for (name, vector) in vectors {
            let vector = vector.map(|v| array(py, v.to_vec(), &[3])).transpose()?;
            found.set_item(name, vector)?;
        }
        let maps = PyDict::new(py);
        if let Some(hemisphere) = &hemisphere {
            maps.set_item("radiance", picture(&hemisphere.radiance)?)?;
            maps.set_item("bsdf_cos", picture(&hemisphere.bsdf_cos)?)?;
            maps.set_item("visibility", array(py, hemisphere.visibility.clone(), &square)?)?;
            maps.set_item("product", picture(&hemisphere.product)?)?;
        }
        found.set_item("maps", maps)?;
        let frame = hemisphere.map(|h| rows(py, h.frame.to_vec(), &[3])).transpose()?;
        found.set_item("frame", frame)?;
        let list = PyList::empty(py);
        let decompositions: Vec<Decomposition> =
            strategies.iter().map(|(decomposition, _)| decomposition.clone()).collect();
        for (decomposition, directions) in strategies {
            let one = PyDict::new(py);
            one.set_item("name", &decomposition.name)?;
            one.set_item("unbiased", decomposition.unbiased)?;
            one.set_item("mean", decomposition.mean)?;
            one.set_item("variance", decomposition.variance)?;
            one.set_item("variance_per_ray", decomposition.variance_per_ray())?;
            one.set_item("rays_per_sample", decomposition.rays_per_sample)?;
            one.set_item("between_samples", decomposition.between_samples())?;
            let shares = PyDict::new(py);
            for share in &decomposition.shares {
                // Two causes can have the same name; add their shares.
                let cause = share.cause.to_string();
                let before =
                    shares.get_item(&cause)?.map_or(Ok(0.0), |before| before.extract::<f64>())?;
                shares.set_item(cause, before + share.share)?;
            }
            one.set_item("shares", shares)?;
            one.set_item("diagnosis", decomposition.diagnosis(&decompositions).to_string())?;
            let density = directions.map(|d| array(py, d.density, &square)).transpose()?;
            one.set_item("density", density)?;
            list.append(one)?;
        }
        found.set_item("strategies", list)?;
        let enclosure = enclosure.map(|enclosure| enclosure.to_string());
        let sentences = [Some(advice(&decompositions).to_string()), enclosure];
        let advice: Vec<String> = sentences.into_iter().flatten().collect();
        found.set_item("advice", advice.join("; "))?;
        Ok(found)
    }
}
