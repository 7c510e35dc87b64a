//! Pictures on the sphere of directions: the map, and what one pixel makes of it.

use std::rc::Rc;

use domelight::Rgb;
use domelight::environment::{LatLongGrid, Orientation};
use domelight::environment::mapping::Mapping;
use domelight::geometry::{Ray, RayBatch, offset_origin};
use domelight::math::{Vec3, vec2};
use domelight::sampling::{Sampler, SamplerKind};
use domelight::scene::{Camera, Scene};
use domelight::strategy::{
    Estimator, PixelPoints, PreparedStrategy, ShadingPoint, Strategy, StrategySpec, TileShading,
};
use serde::{Deserialize, Serialize};
use wasm_bindgen::prelude::*;

use crate::setup::{CameraState, parse, to_json};
use crate::{Engine, error};

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
    scene: Rc<Scene>,
    at: ShadingPoint,
    extent: f32,
}

impl Picked {
    /// V in [0, 1] toward each direction.
    fn visibility(&self, directions: &[Vec3]) -> Vec<f32> {
        let ShadingPoint { position, ng, .. } = self.at;
        let mut batch = RayBatch::default();
        let mut visible = Vec::new();
        let mut occluded = Vec::new();
        for &wi in directions {
            let side = if ng.dot(wi) < 0.0 { -ng } else { ng };
            let origin = offset_origin(position, side, self.extent);
            occluded.push(self.scene.bvh().any_hit(&Ray::new(origin, wi)));
            batch.push(origin, wi);
        }
        self.scene.transmittances(&batch, &mut visible);
        visible.iter().zip(occluded).map(|(&v, hit)| if hit { 0.0 } else { v }).collect()
    }
}

/// The directions of the texels' centers of a lat-long map that stands upright in the world, with their solid angles.
fn directions(width: usize) -> impl Iterator<Item = (Vec3, f64)> {
    let height = width / 2;
    let grid = LatLongGrid::new(width, height);
    (0..height).flat_map(move |y| {
        let solid_angle = grid.solid_angle(y);
        (0..width).map(move |x| {
            let uv = vec2((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
            (Mapping::LatLong.direction(uv).unwrap_or(Vec3::Y), solid_angle)
        })
    })
}

impl Engine {
    fn pick(&self, json: &str) -> Result<Option<Picked>, JsError> {
        let Pixel { x, y, width, height, camera } = parse(json)?;
        let (scene, loaded) = self.scene()?;
        let view = loaded.camera(scene, camera, width as f32 / height.max(1) as f32);
        let camera = Camera::new(&view, width, height).map_err(error)?;
        let ray = camera.ray(x as f32 + 0.5, y as f32 + 0.5);
        let hit = scene.camera_hit(&ray, 0, 0);
        Ok(hit.map(|hit| Picked {
            at: scene.shading_point(&ray, &hit),
            extent: scene.bounds().size().max_element(),
            scene: scene.clone(),
        }))
    }
}

/// A picture of the map.
#[wasm_bindgen]
pub struct MapView {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    pixels: Vec<f32>,
}

#[wasm_bindgen]
impl MapView {
    /// R, G, B and alpha, row by row.
    pub fn pixels(&self) -> Vec<f32> {
        self.pixels.clone()
    }
}

#[wasm_bindgen]
impl Engine {
    /// The map as the probe has it, not turned: R, G and B of `width` columns and half as many rows, each the mean over
    /// its texels.
    ///
    /// # Errors
    /// If there is no environment.
    pub fn map(&self, width: usize) -> Result<Vec<f32>, JsError> {
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
    #[wasm_bindgen(js_name = mapView)]
    pub fn map_view(&self, mapping: &str, rotate: f32, width: usize) -> Result<MapView, JsError> {
        let mapping: Mapping =
            mapping.parse().map_err(|e: domelight::environment::mapping::UnknownMapping| {
                JsError::new(&e.to_string())
            })?;
        let environment = self.environment()?;
        let orientation = Orientation { rotation: rotate, ..environment.orientation() };
        let to_map = orientation.map_to_world().transpose();
        let (width, height) = match mapping {
            Mapping::LatLong => (width, width / 2),
            _ => mapping.size_for(width / 2),
        };
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
        Ok(MapView { width, height, pixels })
    }

    /// What the light, the material and visibility are of every direction at a pixel: seven layers, each `width` by
    /// `width` / 2 on a lat-long map that stands upright in the world: L, f · cos θ and V (luminance), the densities of
    /// environment, BRDF and multiple importance sampling with as many samples of each, and f · cos θ · L over its
    /// integral \[sr⁻¹\]. Empty where the pixel shows no surface.
    ///
    /// # Errors
    /// If scene or environment are missing.
    pub fn importance(&self, pixel: &str, width: usize) -> Result<Vec<f32>, JsError> {
        let Some(picked) = self.pick(pixel)? else { return Ok(Vec::new()) };
        let environment = self.environment()?;
        let (all, solid_angles): (Vec<Vec3>, Vec<f64>) = directions(width).unzip();
        let visibility = picked.visibility(&all);
        let mut layers: [Vec<f32>; 7] = Default::default();
        for (&wi, &v) in all.iter().zip(&visibility) {
            let (le, of_light) = environment.le_pdf(wi);
            let (f, of_brdf) = picked.at.eval_pdf(wi);
            let values = [
                le.luminance(),
                f.luminance(),
                v,
                of_light,
                of_brdf,
                0.5 * (of_light + of_brdf),
                (f * le).luminance(),
            ];
            layers.iter_mut().zip(values).for_each(|(layer, value)| layer.push(value));
        }
        let integral: f64 =
            layers[6].iter().zip(&solid_angles).map(|(&x, w)| f64::from(x) * w).sum();
        let scale = if integral > 0.0 { (1.0 / integral) as f32 } else { 0.0 };
        layers[6].iter_mut().for_each(|x| *x *= scale);
        Ok(layers.concat())
    }

    /// The surface at a pixel and its light, as JSON; `null` where there is none.
    ///
    /// # Errors
    /// If scene or environment are missing.
    pub fn point(&self, pixel: &str) -> Result<String, JsError> {
        let Some(picked) = self.pick(pixel)? else { return Ok("null".to_owned()) };
        let environment = self.environment()?;
        let (all, solid_angles): (Vec<Vec3>, Vec<f64>) = directions(256).unzip();
        let visibility = picked.visibility(&all);
        let (mut shadowed, mut unshadowed) = (0.0, 0.0);
        for ((&wi, w), &v) in all.iter().zip(&solid_angles).zip(&visibility) {
            let light = f64::from((picked.at.eval(wi) * environment.le(wi)).luminance()) * w;
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

    /// The shadow rays that a strategy asks for at a pixel in `n` camera samples: u, v on the upright lat-long map,
    /// luminance of the weight times `n`, and V of each.
    ///
    /// # Errors
    /// If scene or environment are missing, or the strategy does not suit them.
    pub fn samples(
        &self,
        pixel: &str,
        strategy: &str,
        n: u32,
        seed: u32,
    ) -> Result<Vec<f32>, JsError> {
        let Some(picked) = self.pick(pixel)? else { return Ok(Vec::new()) };
        let spec: StrategySpec = strategy.parse().map_err(error)?;
        let environment = self.environment()?;
        let at = &picked.at;
        let v = |_: &ShadingPoint, wi: Vec3| picked.visibility(&[wi])[0];
        let spec = spec.for_scene(|| vec![*at], v, environment, seed.into());
        let strategy = PreparedStrategy::new(spec, environment).map_err(error)?;
        let points = vec![*at; n as usize];
        let samples: Vec<u32> = (0..n).collect();
        let sampler = Sampler::new(SamplerKind::default(), seed.into(), 0);
        let pixels = [PixelPoints::new(0..n as usize, n, sampler)];
        let tile = TileShading { points: &points, samples: &samples, pixels: &pixels, width: 1 };
        let pass =
            strategy.begin_pass(Sampler::for_pass(SamplerKind::default(), seed.into(), 0), n);
        let mut out = Vec::new();
        Estimator::new(&strategy).estimate(&pass, &tile, |rays, visibility| {
            visibility.copy_from_slice(&picked.visibility(&rays.wi));
            for ((&wi, weight), &v) in rays.wi.iter().zip(&rays.weight).zip(&*visibility) {
                let uv = Mapping::LatLong.uv(wi);
                out.extend([uv.x, uv.y, weight.luminance(), v]);
            }
        });
        Ok(out)
    }
}
