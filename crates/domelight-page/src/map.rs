//! Pictures on the sphere of directions: the map, and what one pixel makes of it.

use std::sync::Arc;

use domelight::Rgb;
use domelight::environment::mapping::Mapping;
use domelight::environment::{Environment, LatLongGrid, Orientation, UpAxis};
use domelight::geometry::{Hit, Ray};
use domelight::math::{Vec3, vec2};
use domelight::render::visibility;
use domelight::sampling::{Sampler, SamplerKind};
use domelight::scene::Camera;
use domelight::strategy::{
    Estimator, PixelPoints, Portal, PreparedStrategy, ShadingPoint, Strategy, StrategySpec,
    TileShading,
};
use serde::{Deserialize, Serialize};

use crate::error::{error, refused};
use crate::setup::{CameraState, LoadedScene, parse, to_json};
use crate::{Engine, Error};

/// A pixel of a picture.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Pixel {
    /// Column and row.
    x: usize,
    y: usize,
    width: usize,
    height: usize,
    camera: Option<CameraState>,
}

/// What a pixel shows, for the page.
#[derive(Serialize)]
struct PointReport {
    normal: [f32; 3],
    /// Toward the viewer, world.
    view: [f32; 3],
    /// ∫ f · cos θ · L dω with and without V, luminance.
    shadowed: f64,
    unshadowed: f64,
}

/// The shading point in the middle of a pixel.
struct Picked {
    scene: Arc<LoadedScene>,
    at: ShadingPoint,
}

impl Picked {
    /// V in [0, 1] toward each direction.
    fn visibility(&self, directions: &[Vec3]) -> Vec<f32> {
        visibility(&self.scene.scene, &self.at, directions)
    }
}

/// A picture's size and the directions of its texels' centers in a mapping, upright in the world; `None` beside the
/// mapping's picture. A lat-long map has `width` columns; others have their shape for as many rows.
struct Texels {
    size: [usize; 2],
    directions: Vec<Option<Vec3>>,
}

impl Texels {
    fn new(mapping: Mapping, width: usize, up: UpAxis) -> Self {
        let (width, height) = size(mapping, width);
        let to_world = up.from_y_up();
        let at = |i: usize, n: usize| (i as f32 + 0.5) / n as f32;
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
        let direction = |[x, y]: [usize; 2]| mapping.direction(vec2(at(x, width), at(y, height)));
        let directions = texels.map(|texel| direction(texel).map(|d| to_world * d)).collect();
        Self { size: [width, height], directions }
    }

    /// Layers of as many values for each texel, 0 where it has no direction.
    fn layers<const N: usize>(&self, mut of: impl FnMut(Vec3) -> [f32; N]) -> MapView {
        let mut layers = vec![Vec::with_capacity(self.directions.len()); N];
        for direction in &self.directions {
            let values = direction.map_or([0.0; N], &mut of);
            layers.iter_mut().zip(values).for_each(|(layer, value)| layer.push(value));
        }
        let [width, height] = self.size;
        MapView { width, height, pixels: layers.concat(), integrals: Vec::new() }
    }
}

fn size(mapping: Mapping, width: usize) -> (usize, usize) {
    mapping.size_of([width, width / 2])
}

pub(crate) fn mapping_of(name: &str) -> Result<Mapping, Error> {
    name.parse().map_err(refused)
}

/// The directions of the texels' centers of a lat-long map, with their solid angles.
fn directions(width: usize) -> impl Iterator<Item = (Vec3, f64)> {
    let grid = LatLongGrid::new(width, width / 2);
    let texels = Texels::new(Mapping::LatLong, width, UpAxis::Y).directions;
    let solid_angle = move |i: usize| grid.solid_angle(i / width);
    texels.into_iter().enumerate().filter_map(move |(i, d)| Some((d?, solid_angle(i))))
}

/// A part of the sphere of directions that is no larger than the map's texels, or a block of them.
struct Cell {
    /// Its center, world.
    center: Vec3,
    solid_angle: f64,
    /// The means of the light, in the map's units, and of its density \[sr⁻¹\].
    light: Rgb,
    density: f32,
}

/// Divides the sphere into cells along the map's own texels, so that no small sun falls between them: at least
/// `FINEST` columns, parts of texels of a smaller map and blocks of a map more than twice as wide.
fn cells(environment: &Environment) -> impl Iterator<Item = Cell> {
    const FINEST: usize = 1024;
    let map = environment.map();
    let parts = FINEST.div_ceil(map.width);
    let block = (map.width / FINEST).max(1);
    let [width, height] = [map.width * parts, map.height * parts];
    let grid = LatLongGrid::new(width, height);
    let to_world = environment.orientation().map_to_world();
    let direction = move |x: f32, y: f32| {
        let uv = vec2(x / width as f32, y / height as f32);
        to_world * Mapping::LatLong.direction(uv).unwrap_or(Vec3::Y)
    };
    let corners = move |n: usize| (0..n).step_by(block);
    let corners = corners(height).flat_map(move |y| corners(width).map(move |x| [x, y]));
    corners.map(move |[x, y]| {
        let [right, bottom] = [(x + block).min(width), (y + block).min(height)];
        let (mut solid_angle, mut light, mut density) = (0.0, Rgb::BLACK, 0.0);
        for row in y..bottom {
            let w = grid.solid_angle(row);
            for column in x..right {
                let center = direction(column as f32 + 0.5, row as f32 + 0.5);
                let (le, pdf) = environment.le_pdf(center);
                solid_angle += w;
                light += le * w as f32;
                density += pdf * w as f32;
            }
        }
        let center = direction(0.5 * (x + right) as f32, 0.5 * (y + bottom) as f32);
        let scale = (1.0 / solid_angle) as f32;
        Cell { center, solid_angle, light: light * scale, density: density * scale }
    })
}

/// Shadow rays counted in cells of a lat-long map.
struct RayCounts {
    grid: LatLongGrid,
    size: [usize; 2],
    counts: Vec<f32>,
    n_rays: f32,
}

impl RayCounts {
    fn new(width: usize) -> Self {
        let size = [width, width / 2];
        let counts = vec![0.0; width * width / 2];
        Self { grid: LatLongGrid::new(width, width / 2), size, counts, n_rays: 0.0 }
    }

    fn cell(&self, direction: Vec3) -> [usize; 2] {
        let uv = Mapping::LatLong.uv(direction);
        let [width, height] = self.size;
        let at = |c: f32, n: usize| ((c * n as f32) as usize).min(n - 1);
        [at(uv.x, width), at(uv.y, height)]
    }

    fn add(&mut self, direction: Vec3) {
        let [x, y] = self.cell(direction);
        self.counts[y * self.size[0] + x] += 1.0;
        self.n_rays += 1.0;
    }

    /// Rays per solid angle and ray \[sr⁻¹\].
    fn density(&self, direction: Vec3) -> f32 {
        let [x, y] = self.cell(direction);
        let solid_angle = self.grid.solid_angle(y) as f32;
        self.counts[y * self.size[0] + x] / (self.n_rays.max(1.0) * solid_angle)
    }

    /// The integral of the density over the sphere.
    fn integral(&self) -> f64 {
        self.counts.iter().map(|&n| f64::from(n)).sum::<f64>() / f64::from(self.n_rays.max(1.0))
    }
}

/// The shadow rays that a strategy asks for at a point in `n` camera samples, to `found`: directions, weights and
/// visibility.
fn shadow_rays(
    at: &ShadingPoint,
    strategy: &PreparedStrategy<'_>,
    portals: &[Portal],
    (n, seed): (u32, u64),
    visible: impl Fn(&[Vec3]) -> Vec<f32>,
    mut found: impl FnMut(Vec3, Rgb, f32),
) {
    let points = vec![*at; n as usize];
    let samples: Vec<u32> = (0..n).collect();
    let sampler = Sampler::new(SamplerKind::default(), seed, 0);
    let pixels = [PixelPoints::new(0..n as usize, n, sampler)];
    let tile = TileShading { portals, ..TileShading::new(&points, &samples, &pixels, 1) };
    let pass = strategy.begin_pass(Sampler::for_pass(SamplerKind::default(), seed, 0), n);
    Estimator::new(strategy).estimate(&pass, &tile, |rays, visibility| {
        visibility.copy_from_slice(&visible(&rays.wi));
        for ((&wi, &weight), &v) in rays.wi.iter().zip(&rays.weight).zip(&*visibility) {
            found(wi, weight, v);
        }
    });
}

impl Engine {
    /// What the middle of a pixel shows of the scene.
    fn sight(&self, json: &str) -> Result<Option<(Ray, Hit)>, Error> {
        let Pixel { x, y, width, height, camera } = parse(json)?;
        let scene = self.scene()?;
        let view = scene.camera(camera, width as f32 / height.max(1) as f32);
        let camera = Camera::new(&view, width, height).map_err(error)?;
        let camera = scene.scene.camera_inside(&camera);
        let ray = camera.ray(x as f32 + 0.5, y as f32 + 0.5);
        Ok(scene.scene.camera_hit(&ray, 0, 0).map(|hit| (ray, hit)))
    }

    fn pick(&self, json: &str) -> Result<Option<Picked>, Error> {
        let (scene, sight) = (self.scene()?, self.sight(json)?);
        let picked =
            |(ray, hit)| Picked { at: scene.scene.shading_point(&ray, &hit), scene: scene.clone() };
        Ok(sight.map(picked))
    }

    /// A strategy with what a pilot chooses for one point.
    fn prepared(
        &self,
        strategy: &str,
        picked: &Picked,
        seed: u64,
    ) -> Result<PreparedStrategy<'_>, Error> {
        let spec: StrategySpec = strategy.parse().map_err(error)?;
        let environment = self.environment()?;
        let at = picked.at;
        let v = |_: &ShadingPoint, wi: Vec3| picked.visibility(&[wi])[0];
        let spec = spec.for_scene(|| vec![at], v, environment, seed);
        PreparedStrategy::new(spec, environment).map_err(error)
    }
}

/// A picture on the sphere of directions.
#[derive(Clone, Debug, Default)]
pub struct MapView {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// R, G, B and alpha, or layer by layer, row by row.
    pub pixels: Vec<f32>,
    /// The integral of each layer over the sphere, where the layers have integrals.
    pub integrals: Vec<f64>,
}

impl Engine {
    /// The map as the probe has it, not turned: R, G and B of `width` columns and half as many rows, each the mean over
    /// its texels.
    ///
    /// # Errors
    /// If there is no environment.
    pub fn map(&self, width: usize) -> Result<Vec<f32>, Error> {
        let map = self.environment()?.map();
        let height = width / 2;
        let range = |i: usize, n: usize, of: usize| {
            let start = i * of / n;
            start..((i + 1) * of / n).max(start + 1)
        };
        let mut out = Vec::with_capacity(3 * width * height);
        for y in 0..height {
            for x in 0..width {
                let (mut sum, mut count) = (Rgb::BLACK, 0.0);
                for row in range(y, height, map.height) {
                    for column in range(x, width, map.width) {
                        sum += map.get(column, row);
                        count += 1.0;
                    }
                }
                out.extend((sum / count).to_array());
            }
        }
        Ok(out)
    }

    /// The light around the scene in a mapping, upright in the world and turned by `rotate` degrees: R, G, B and alpha,
    /// which is 0 beside the mapping's picture. A lat-long map has `width` columns; others have their shape for as many
    /// rows.
    ///
    /// # Errors
    /// If there is no environment or no such mapping.
    pub fn map_view(&self, mapping: &str, rotate: f32, width: usize) -> Result<MapView, Error> {
        let mapping = mapping_of(mapping)?;
        let environment = self.environment()?;
        let orientation = Orientation { rotation: rotate, ..environment.orientation() };
        let to_map = orientation.map_to_world().transpose();
        let (width, height) = size(mapping, width);
        let map = environment.map();
        // Several places of each texel, so that no lamp falls between them.
        let across = (2 * map.width).div_ceil(width).clamp(1, 4);
        let up = orientation.up.from_y_up();
        let mut pixels = Vec::with_capacity(4 * width * height);
        for i in 0..width * height {
            let (mut sum, mut inside) = (Rgb::BLACK, 0.0);
            for k in 0..across * across {
                let at = |pixel: usize, part: usize, n: usize| {
                    (pixel as f32 + (part as f32 + 0.5) / across as f32) / n as f32
                };
                let uv = vec2(at(i % width, k % across, width), at(i / width, k / across, height));
                if let Some(direction) = mapping.direction(uv) {
                    let uv = Mapping::LatLong.uv(to_map * (up * direction));
                    let texel = |u: f32, n: usize| ((u * n as f32) as usize).min(n - 1);
                    sum += map.get(texel(uv.x, map.width), texel(uv.y, map.height));
                    inside += 1.0;
                }
            }
            let Rgb { r, g, b } = if inside > 0.0 { sum / inside } else { Rgb::BLACK };
            pixels.extend([r, g, b, f32::from(u8::from(inside > 0.0))]);
        }
        Ok(MapView { width, height, pixels, integrals: Vec::new() })
    }

    /// Where places of the map as the probe has it lie in a mapping, upright in the world, if the map is turned by
    /// `rotate` degrees: u and v, each by each, of both.
    ///
    /// # Errors
    /// If there is no environment or no such mapping.
    pub fn places_of(&self, mapping: &str, rotate: f32, places: &[f32]) -> Result<Vec<f32>, Error> {
        let mapping = mapping_of(mapping)?;
        let orientation = self.environment()?.orientation();
        let turned = Orientation { rotation: rotate, ..orientation };
        let upright = orientation.up.from_y_up().transpose() * turned.map_to_world();
        let place = |uv: &[f32]| {
            let direction = Mapping::LatLong.direction(vec2(uv[0], uv[1])).unwrap_or(Vec3::Y);
            mapping.uv(upright * direction).to_array()
        };
        Ok(places.chunks_exact(2).flat_map(place).collect())
    }

    /// What the light, the material and visibility are of every direction at a pixel: seven layers in a mapping, upright
    /// in the world: L, f · cos θ and V (luminance), the densities of environment, BRDF and multiple importance sampling
    /// with as many samples of each, and f · cos θ · L over its integral \[sr⁻¹\]. Each texel but those of V is the mean
    /// over the map's texels inside, so that no sun falls between them, and the layers' sums are their integrals. Empty
    /// where the pixel shows no surface.
    ///
    /// # Errors
    /// If scene or environment are missing, or there is no such mapping.
    pub fn importance(&self, pixel: &str, mapping: &str, width: usize) -> Result<MapView, Error> {
        const VISIBILITY: usize = 2;
        let mapping = mapping_of(mapping)?;
        let Some(picked) = self.pick(pixel)? else { return Ok(MapView::default()) };
        let environment = self.environment()?;
        let unit = environment.unit() as f32;
        let layers = |wi: Vec3, light: Rgb, of_light: f32| {
            let (f, of_brdf) = picked.at.eval_pdf(wi);
            let mixture = 0.5 * (of_light + of_brdf);
            let product = (f * light).luminance();
            [light.luminance() * unit, f.luminance(), 0.0, of_light, of_brdf, mixture, product]
        };
        let up = environment.orientation().up;
        let texels = Texels::new(mapping, width, up);
        let [columns, rows] = texels.size;
        let n = columns * rows;
        let from_world = up.from_y_up().transpose();
        let texel = |wi: Vec3| {
            let uv = mapping.uv(from_world * wi);
            let at = |c: f32, n: usize| ((c * n as f32) as usize).min(n - 1);
            at(uv.y, rows) * columns + at(uv.x, columns)
        };
        // Add up the cells in each texel, and on the sphere.
        let (mut sums, mut solid_angles) = (vec![[0.0; 7]; n], vec![0.0; n]);
        let mut integrals = [0.0; 7];
        for Cell { center, solid_angle, light, density } in cells(environment) {
            let i = texel(center);
            solid_angles[i] += solid_angle;
            for (k, value) in layers(center, light, density).into_iter().enumerate() {
                sums[i][k] += f64::from(value) * solid_angle;
                integrals[k] += f64::from(value) * solid_angle;
            }
        }
        // The product becomes a density.
        let [.., total] = integrals;
        let scale = if total > 0.0 { 1.0 / total } else { 0.0 };
        integrals[6] = total * scale;
        let all: Vec<Vec3> = texels.directions.iter().flatten().copied().collect();
        let mut visibility = picked.visibility(&all).into_iter();
        let mut pixels = vec![0.0; 7 * n];
        for (i, direction) in texels.directions.iter().enumerate() {
            let Some(wi) = *direction else { continue };
            let mut values = if solid_angles[i] > 0.0 {
                sums[i].map(|sum| sum / solid_angles[i])
            } else {
                // A texel that is smaller than the cells.
                let (le, pdf) = environment.le_pdf(wi);
                layers(wi, le, pdf).map(f64::from)
            };
            values[6] *= scale;
            let v = f64::from(visibility.next().unwrap_or(0.0));
            values[VISIBILITY] = v;
            integrals[VISIBILITY] += v * solid_angles[i];
            values.iter().enumerate().for_each(|(k, &value)| pixels[k * n + i] = value as f32);
        }
        Ok(MapView { width: columns, height: rows, pixels, integrals: integrals.to_vec() })
    }

    /// Where a strategy sends its shadow rays from a pixel, counted over many camera samples: rays per solid angle and
    /// ray \[sr⁻¹\] in a mapping, upright in the world. Empty where the pixel shows no surface.
    ///
    /// # Errors
    /// If scene or environment are missing, the strategy does not suit them, or there is no such mapping.
    pub fn ray_density(
        &self,
        pixel: &str,
        strategy: &str,
        mapping: &str,
        width: usize,
    ) -> Result<MapView, Error> {
        /// Pixels with other random numbers, camera samples of each, and columns of the cells that are counted in.
        const REPLICATES: u64 = 64;
        const SAMPLES: u32 = 32;
        const CELLS: usize = 64;
        let mapping = mapping_of(mapping)?;
        let Some(picked) = self.pick(pixel)? else { return Ok(MapView::default()) };
        let environment = self.environment()?;
        let strategy = self.prepared(strategy, &picked, 0)?;
        let mut counts = RayCounts::new(CELLS);
        let visible = |wi: &[Vec3]| picked.visibility(wi);
        for seed in 0..REPLICATES {
            let count = |wi, _, _| counts.add(wi);
            let portals = picked.scene.scene.portals();
            shadow_rays(&picked.at, &strategy, portals, (SAMPLES, seed), visible, count);
        }
        let texels = Texels::new(mapping, width, environment.orientation().up);
        let view = texels.layers(|wi| [counts.density(wi)]);
        Ok(MapView { integrals: vec![counts.integral()], ..view })
    }

    /// The index of the material at a pixel, among those of the scene and what the settings add; nothing where there is
    /// no surface.
    ///
    /// # Errors
    /// If the scene is missing.
    pub fn material_at(&self, pixel: &str) -> Result<Option<u32>, Error> {
        let scene = &self.scene()?.scene;
        Ok(self.sight(pixel)?.map(|(_, hit)| scene.material_of(&hit) as u32))
    }

    /// The surface at a pixel and its light, as JSON; `null` where there is none.
    ///
    /// # Errors
    /// If scene or environment are missing.
    pub fn point(&self, pixel: &str) -> Result<String, Error> {
        let Some(picked) = self.pick(pixel)? else { return Ok("null".to_owned()) };
        let environment = self.environment()?;
        let (all, solid_angles): (Vec<Vec3>, Vec<f64>) = directions(256).unzip();
        let visibility = picked.visibility(&all);
        let (mut shadowed, mut unshadowed) = (0.0, 0.0);
        for ((&wi, w), &v) in all.iter().zip(&solid_angles).zip(&visibility) {
            let radiance = (picked.at.eval(wi) * environment.le(wi)).luminance();
            let light = f64::from(radiance) * environment.unit() * w;
            unshadowed += light;
            shadowed += light * f64::from(v);
        }
        let at = &picked.at;
        Ok(to_json(&PointReport {
            normal: at.frame.z.to_array(),
            view: at.frame.to_world(at.wo).to_array(),
            shadowed,
            unshadowed,
        }))
    }

    /// The shadow rays that a strategy asks for at a pixel in `n` camera samples: u, v in a mapping, upright in the
    /// world, luminance of the weight times `n`, and V of each.
    ///
    /// # Errors
    /// If scene or environment are missing, the strategy does not suit them, or there is no such mapping.
    pub fn samples(
        &self,
        pixel: &str,
        strategy: &str,
        mapping: &str,
        n: usize,
        seed: u32,
    ) -> Result<Vec<f32>, Error> {
        let mapping = mapping_of(mapping)?;
        let Some(picked) = self.pick(pixel)? else { return Ok(Vec::new()) };
        let strategy = self.prepared(strategy, &picked, seed.into())?;
        let from_world = self.environment()?.orientation().up.from_y_up().transpose();
        let visible = |wi: &[Vec3]| picked.visibility(wi);
        let mut out = Vec::new();
        let portals = picked.scene.scene.portals();
        shadow_rays(
            &picked.at,
            &strategy,
            portals,
            (n as u32, seed.into()),
            visible,
            |wi, weight, v| {
                let uv = mapping.uv(from_world * wi);
                out.extend([uv.x, uv.y, weight.luminance(), v]);
            },
        );
        Ok(out)
    }
}
