//! The suite `interiors`: what the error of a room costs, in rays and in time, with portals and without.

mod scenes;

use domelight::Rgb;
use domelight::bsdf::Bsdf;
use domelight::environment::Environment;
use domelight::math::Vec3;
use domelight::render::{Background, Filter, RenderSettings, Renderer, Rendering};
use domelight::scene::{Camera, CameraSettings, Scene, SceneDescription};
use domelight::strategy::{PreparedStrategy, StrategySpec};
use serde::{Deserialize, Serialize};

use super::Bench;
use super::cases::{self, CaseMaterial, short};
use super::mitsuba::{Mitsuba, MitsubaScene};
use super::table::{Table, number};
use crate::job::{FilePart, load_scene};
use crate::scene::view_of;
use crate::usage::{Seconds, Stopwatch};
use crate::{At as _, Error};
use scenes::Interior;

const SIZE: [usize; 2] = [128, 128];
const MATERIALS: &str = "diffuse:0.7,ggx:0.2:single";
/// Those of a file, whose own are measured, too.
const MATERIALS_OF_FILES: &str = "diffuse:0.7,ggx:0.2:single,own";
/// Camera samples of the measured pictures.
const SAMPLES: [u32; 2] = [4, 16];
/// A reference's strategy, and the camera samples of each of its halves.
const REFERENCE: &str = "product:8";
const REFERENCE_SAMPLES: u32 = 256;
/// The first seed of a reference, which no measured picture has.
const REFERENCE_SEED: u64 = 1 << 40;

/// What strategies know of the openings of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Portals {
    None,
    /// What the renderer finds.
    Found,
    Named,
}

impl Portals {
    const ALL: [Self; 3] = [Self::None, Self::Found, Self::Named];

    /// The strategies that are measured, with the usual way to sample portals.
    fn strategies(self) -> &'static [&'static str] {
        match self {
            Self::None => &["mis:4:4", "product:4"],
            Self::Found => &["product:4"],
            Self::Named => &["mis:1:1:portals=4", "product:4"],
        }
    }

    /// As a part of a strategy's name.
    fn label(self) -> &'static str {
        match self {
            Self::None => "",
            Self::Found => ", portals found",
            Self::Named => ", portals named",
        }
    }
}

/// A scene, a probe, a material and a strategy.
#[derive(Serialize, Deserialize)]
pub(super) struct Row {
    scene: String,
    probe: String,
    material: String,
    strategy: String,
    portals: Portals,
    samples: u32,
    /// Mean over the seeds.
    rel_mse: f64,
    /// `None` of another program, which does not count them.
    shadow_rays_per_pixel: Option<f64>,
    /// Of one picture, scouts and preparation included.
    cpu_seconds: f64,
    /// The part of the error in the pixel that has most of it.
    largest_pixel: f64,
}

pub(super) fn run(bench: &Bench, rows: &mut Vec<Row>) -> Result<(), Error> {
    let environments = cases::environments(bench.settings, &[256], bench.host)?;
    let mut peer = Mitsuba::of_settings(bench.settings)?;
    let builtin = Interior::ALL.map(|interior| interior.name().to_owned());
    let given = &bench.settings.meshes[..];
    for scene in if given.is_empty() { &builtin[..] } else { given } {
        let interior = Interior::from_name(scene);
        let usual = if interior.is_some() { MATERIALS } else { MATERIALS_OF_FILES };
        let materials = bench.settings.materials.as_deref().unwrap_or(usual);
        let materials = cases::case_materials(materials)?;
        let description = match interior {
            Some(interior) => interior.describe(),
            None => load_scene(scene, &FilePart::default(), false, bench.host)?.0,
        };
        for (probe, environment) in &environments {
            for material in &materials {
                let [scene, probe] = [scene, probe].map(|name| short(name).to_owned());
                bench.host.status(&format!("{scene} / {probe} / {material}"));
                let case = InteriorCase::new(bench, &description, environment, material);
                let case = case.at(&scene)?;
                for measured in case.measure(bench, material, peer.as_mut())? {
                    let (scene, probe) = (scene.clone(), probe.clone());
                    rows.push(Row { scene, probe, material: material.to_string(), ..measured });
                }
            }
        }
    }
    Ok(())
}

/// A scene with and without portals under a probe, and what it looks like.
struct InteriorCase<'a> {
    environment: &'a Environment,
    view: CameraSettings,
    camera: Camera,
    without_portals: Scene,
    with_portals: Option<Scene>,
    settings: RenderSettings,
    halves: [Vec<Rgb>; 2],
}

impl<'a> InteriorCase<'a> {
    fn new(
        bench: &Bench,
        description: &SceneDescription,
        environment: &'a Environment,
        material: &CaseMaterial,
    ) -> Result<Self, Error> {
        let [width, height] = bench.settings.size.unwrap_or(SIZE);
        let mut with = description.clone();
        if let CaseMaterial::Of { material, .. } = *material {
            with.set_subject_material(Bsdf::from(material));
            with.remove_scenery();
        }
        let view = view_of(&with, width as f32 / height as f32, Vec3::Y);
        let without = SceneDescription { portals: Vec::new(), ..with.clone() };
        let with_portals = (!with.portals.is_empty()).then(|| Scene::new(with)).transpose()?;
        let settings = RenderSettings {
            width,
            height,
            filter: Filter::Box,
            background: Background::Hidden,
            ..RenderSettings::default()
        };
        let mut case = Self {
            environment,
            view,
            camera: Camera::new(&view, width, height)?,
            without_portals: Scene::new(without)?,
            with_portals,
            settings,
            halves: [Vec::new(), Vec::new()],
        };
        let best = if case.with_portals.is_some() { Portals::Named } else { Portals::Found };
        for half in 0..2 {
            bench.host.check_canceled()?;
            let seed = REFERENCE_SEED + half as u64;
            (case.halves[half], _) = case.render(best, REFERENCE, REFERENCE_SAMPLES, seed)?;
        }
        Ok(case)
    }

    /// The picture and the number of its shadow rays, with those of scouts.
    fn render(
        &self,
        portals: Portals,
        strategy: &str,
        n_samples: u32,
        seed: u64,
    ) -> Result<(Vec<Rgb>, u64), Error> {
        let named = self.with_portals.as_ref().filter(|_| portals == Portals::Named);
        let (scene, camera) = (named.unwrap_or(&self.without_portals), &self.camera);
        let find_portals = portals == Portals::Found;
        let settings = RenderSettings { n_samples, seed, find_portals, ..self.settings };
        let spec: StrategySpec =
            strategy.parse().map_err(|e| Error::Usage(format!("{strategy}: {e}")))?;
        let spec = spec.for_picture(scene, camera, self.environment, &settings);
        let strategy = PreparedStrategy::new(spec, self.environment)?;
        let mut renderer =
            Renderer::with_strategy(scene, camera, self.environment, &strategy, settings);
        renderer.run(&());
        let Rendering { layers, counts, rays_ahead, .. } = renderer.rendering();
        Ok((layers.color.pixels, counts.shadow_rays + rays_ahead))
    }

    fn measure(
        &self,
        bench: &Bench,
        material: &CaseMaterial,
        mut peer: Option<&mut Mitsuba>,
    ) -> Result<Vec<Row>, Error> {
        let RenderSettings { width, height, .. } = self.settings;
        if let Some(mitsuba) = &mut peer {
            let scene = MitsubaScene {
                scene: &self.without_portals,
                camera: self.view,
                environment: self.environment,
                size: [width, height],
            };
            if mitsuba.load(&scene, material)?.is_some() {
                peer = None;
            }
        }
        let mut rows = Vec::new();
        for samples in SAMPLES {
            let has_named = self.with_portals.is_some();
            for portals in Portals::ALL.into_iter().filter(|&p| has_named || p != Portals::Named) {
                for strategy in portals.strategies() {
                    rows.push(self.measure_one(bench, strategy, portals, samples, |seed| {
                        let mut watch = Stopwatch::start();
                        let (picture, n_rays) = self.render(portals, strategy, samples, seed)?;
                        Ok((picture, Some(n_rays), watch.lap()))
                    })?);
                }
            }
            if let Some(mitsuba) = &mut peer {
                rows.push(self.measure_one(bench, MITSUBA, Portals::None, samples, |seed| {
                    let (picture, time) = mitsuba.render(samples, seed)?;
                    Ok((picture.image.pixels, None, time))
                })?);
            }
        }
        Ok(rows)
    }

    /// `render` takes a seed, and gives a picture, its shadow rays and its time.
    fn measure_one(
        &self,
        bench: &Bench,
        strategy: &str,
        portals: Portals,
        samples: u32,
        mut render: impl FnMut(u64) -> Result<(Vec<Rgb>, Option<u64>, Seconds), Error>,
    ) -> Result<Row, Error> {
        let n_seeds = bench.settings.n_seeds;
        let mut errors = vec![0.0; self.halves[0].len()];
        let (mut rays, mut cpu_seconds) = (Some(0), 0.0);
        for seed in 0..u64::from(n_seeds) {
            bench.host.check_canceled()?;
            let (picture, n_rays, time) = render(bench.settings.seed + seed)?;
            cpu_seconds += time.cpu.unwrap_or(time.wall) / f64::from(n_seeds);
            rays = rays.zip(n_rays).map(|(sum, n)| sum + n);
            self.add_errors(&picture, &mut errors);
        }
        let n = errors.len() as f64 * f64::from(n_seeds);
        let sum: f64 = errors.iter().sum();
        let largest = errors.iter().copied().fold(0.0, f64::max);
        Ok(Row {
            scene: String::new(),
            probe: String::new(),
            material: String::new(),
            strategy: strategy.to_owned(),
            portals,
            samples,
            rel_mse: sum / n,
            shadow_rays_per_pixel: rays.map(|rays| rays as f64 / n),
            cpu_seconds,
            largest_pixel: largest / sum,
        })
    }

    /// Adds (I − A)(I − B)/(R² + (mean/10)²) of each pixel, where A and B are the halves of the reference and R is their
    /// mean luminance. The noise of one half has nothing to do with that of the other, so it does not count as error.
    fn add_errors(&self, picture: &[Rgb], errors: &mut [f64]) {
        let [a, b] = &self.halves;
        let luminance = |(a, b): (&Rgb, &Rgb)| f64::from(0.5 * (*a + *b).luminance());
        let mean = a.iter().zip(b).map(luminance).sum::<f64>() / a.len() as f64;
        let floor = (0.1 * mean).powi(2);
        for (i, (error, pixel)) in errors.iter_mut().zip(picture).enumerate() {
            let [from_a, from_b] = [a[i], b[i]].map(|r| (*pixel - r).to_array());
            let products = from_a.iter().zip(from_b).map(|(x, y)| f64::from(*x) * f64::from(y));
            *error += products.sum::<f64>() / 3.0 / (luminance((&a[i], &b[i])).powi(2) + floor);
        }
    }
}

/// As a strategy's name.
const MITSUBA: &str = "Mitsuba, mis:1:1";

/// What an error costs.
#[derive(Clone, Copy)]
enum Cost {
    Rays,
    Time,
}

impl Cost {
    const ALL: [Self; 2] = [Self::Rays, Self::Time];

    fn unit(self) -> &'static str {
        match self {
            Self::Rays => "shadow rays of a pixel",
            Self::Time => "CPU seconds of a picture",
        }
    }

    /// `None` if it is not known.
    fn times_error(self, row: &Row) -> Option<f64> {
        let cost = match self {
            Self::Rays => row.shadow_rays_per_pixel,
            Self::Time => Some(row.cpu_seconds),
        };
        cost.map(|cost| row.rel_mse * cost)
    }
}

pub(super) fn tables(rows: &[Row]) -> Vec<Table> {
    let of_samples = |samples| {
        let rows: Vec<&Row> = rows.iter().filter(|row| row.samples == samples).collect();
        Cost::ALL.map(|cost| table(&rows, samples, cost))
    };
    SAMPLES.into_iter().flat_map(of_samples).collect()
}

/// relMSE times the cost: a line for each case and the geometric mean of each scene, a column for each strategy.
fn table(rows: &[&Row], samples: u32, cost: Cost) -> Table {
    let case = |row: &Row| format!("{} / {} / {}", row.scene, row.probe, row.material);
    let strategy = |row: &Row| format!("{}{}", row.strategy, row.portals.label());
    let known = rows.iter().filter(|row| cost.times_error(row).is_some());
    let strategies = distinct(known.map(|row| strategy(row)));
    let head: Vec<&str> = std::iter::once("case")
        .chain(strategies.iter().map(String::as_str))
        .chain(["largest pixel"])
        .collect();
    let mut table =
        Table::new(format!("relMSE × {}, {samples} camera samples", cost.unit()), &head);
    let mut line = |name: String, rows: &[&&Row]| {
        let mean = |column: &String| {
            let of_column = rows.iter().filter(|row| strategy(row) == *column);
            let logs: Vec<f64> =
                of_column.filter_map(|row| cost.times_error(row)).map(f64::ln).collect();
            // No rows have a mean of NaN, which is shown as none.
            number((logs.iter().sum::<f64>() / logs.len() as f64).exp())
        };
        let products = rows.iter().filter(|row| row.strategy.starts_with("product"));
        let largest = products.map(|row| row.largest_pixel).fold(0.0, f64::max);
        let means = strategies.iter().map(mean);
        let largest = format!("{:.0} %", 100.0 * largest);
        table.rows.push([name].into_iter().chain(means).chain([largest]).collect());
    };
    for name in distinct(rows.iter().map(|row| case(row))) {
        let rows: Vec<_> = rows.iter().filter(|row| case(row) == name).collect();
        line(name, &rows);
    }
    for scene in distinct(rows.iter().map(|row| row.scene.clone())) {
        let rows: Vec<_> = rows.iter().filter(|row| row.scene == scene).collect();
        line(format!("{scene}, geometric mean"), &rows);
    }
    let note = "relMSE: the squared error over R² + (0.1 × the mean luminance)², so that dark rooms count. Largest pixel: \
                the most of product's error that one pixel has, over all seeds.";
    table.notes.push(note.to_owned());
    table
}

/// Each text once, in the order of the first.
fn distinct(texts: impl Iterator<Item = String>) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for text in texts {
        if !found.contains(&text) {
            found.push(text);
        }
    }
    found
}
