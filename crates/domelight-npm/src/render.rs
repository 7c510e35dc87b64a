//! A picture of a scene under a map.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use domelight::bsdf::{Bsdf, MaterialSpec};
use domelight::environment::{Environment, Orientation, UpAxis};
use domelight::picture::tone::{ToneCurve, ToneMapping, srgb_from_linear};
use domelight::render::{Background, Deadline, RenderSettings, Renderer, automatic_exposure};
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{
    Camera, CameraSettings, LoadOptions, Projection, Scene, SceneDescription, load_bytes,
};
use domelight::strategy::StrategySpec;
use domelight::{Rgb, RgbImage};
use serde::{Deserialize, Serialize};
use wasm_bindgen::prelude::*;

use crate::map::LightMap;
use crate::options::{named, parse, to_json};
use crate::{error, now};

/// The most that a scene and its textures take \[bytes\].
const MAX_MEMORY: u64 = 1 << 30;

/// Between two reports of progress \[ms\].
const INTERVAL: f64 = 100.0;

/// A picture has at most so many columns and rows.
const MAX_SIZE: usize = 8192;

/// Files by their paths, which have slashes.
#[wasm_bindgen]
#[derive(Default)]
pub struct Files(BTreeMap<PathBuf, Vec<u8>>);

#[wasm_bindgen]
impl Files {
    /// None.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds one.
    pub fn add(&mut self, path: &str, bytes: Vec<u8>) {
        self.0.insert(path.into(), bytes);
    }
}

impl Files {
    fn get(&self, path: &Path) -> io::Result<&[u8]> {
        let missing =
            || io::Error::new(io::ErrorKind::NotFound, "it is not among the option files");
        self.0.get(path).map(Vec::as_slice).ok_or_else(missing)
    }
}

/// The options of a picture, as those of `domelight render`.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", default, deny_unknown_fields)]
struct RenderOptions {
    width: usize,
    height: usize,
    spp: u32,
    strategy: String,
    seed: u64,
    /// Whether the map is seen behind the scene.
    background: bool,
    ground: bool,
    /// The subject's, as `--material` has it.
    material: Option<String>,
    /// The scene's own, or framed to it, if none is given.
    camera: Option<CameraOptions>,
    /// \[stops\]; automatic if none is given.
    exposure: Option<f32>,
    tone: String,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            width: 512,
            height: 512,
            spp: 32,
            strategy: "product".to_owned(),
            seed: 0,
            background: true,
            ground: false,
            material: None,
            camera: None,
            exposure: None,
            tone: "agx".to_owned(),
        }
    }
}

#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraOptions {
    origin: [f32; 3],
    target: [f32; 3],
    #[serde(default)]
    up: Option<[f32; 3]>,
    /// Vertical \[degrees\].
    #[serde(default)]
    fov: Option<f32>,
}

/// A picture.
#[wasm_bindgen]
pub struct Picture {
    linear: Vec<f32>,
    display: Vec<u8>,
    report: String,
}

/// How a picture was made, for JavaScript.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Report {
    width: usize,
    height: usize,
    /// \[stops\]
    exposure: f32,
    strategy: String,
    camera_rays: u64,
    shadow_rays: u64,
    warnings: Vec<String>,
}

/// The map, upright in a scene with this up axis.
fn upright(map: &LightMap, up: UpAxis) -> Result<Cow<'_, Environment>, JsError> {
    let environment = &map.environment;
    let orientation = environment.orientation();
    if map.up.is_some() || orientation.up == up {
        return Ok(Cow::Borrowed(environment));
    }
    let orientation = Orientation { up, ..orientation };
    let texels = environment.map().clone();
    let upright = Environment::from_units(texels, orientation, environment.unit());
    Ok(Cow::Owned(upright.map_err(error)?))
}

impl CameraOptions {
    fn settings(self, up: UpAxis) -> CameraSettings {
        let fov_y_degrees = self.fov.unwrap_or(CameraSettings::DEFAULT_FOV_Y_DEGREES);
        CameraSettings {
            projection: Projection::Perspective { fov_y_degrees },
            origin: self.origin.into(),
            target: self.target.into(),
            up: self.up.map_or(up.vector(), Into::into),
        }
    }
}

impl RenderOptions {
    fn check(&self) -> Result<(), JsError> {
        let sizes = [("width", self.width), ("height", self.height)];
        if let Some((name, size)) = sizes.iter().find(|(_, size)| !(1..=MAX_SIZE).contains(size)) {
            let text = format!("render: option {name}: {size} is not in [1, {MAX_SIZE}]");
            return Err(JsError::new(&text));
        }
        if self.spp == 0 {
            return Err(JsError::new("render: option spp: a pixel has at least one sample"));
        }
        Ok(())
    }

    fn settings(&self) -> RenderSettings {
        RenderSettings {
            width: self.width,
            height: self.height,
            n_samples: self.spp,
            seed: self.seed,
            background: if self.background { Background::Shown } else { Background::Hidden },
            ..RenderSettings::default()
        }
    }

    /// The scene with the changes that the options ask for, and warnings.
    fn scene(&self, files: &Files, name: &str) -> Result<(Scene, Vec<String>), JsError> {
        let (mut description, warnings) = description(files, name)?;
        if let Some(text) = &self.material {
            let material: MaterialSpec = text.parse().map_err(error)?;
            description.set_subject_material(Bsdf::from(material));
        }
        if self.ground {
            let up = description.up.unwrap_or_default();
            description.add_ground(up.vector());
        }
        Ok((Scene::new(description).map_err(error)?, warnings))
    }

    fn camera(&self, scene: &Scene) -> Result<Camera, JsError> {
        let Self { width, height, .. } = *self;
        let view = match self.camera {
            Some(camera) => camera.settings(scene.up_axis()),
            None => scene.camera(width as f32 / height as f32),
        };
        Camera::new(&view, width, height).map_err(error)
    }
}

/// The built-in scene of a name, or the scene in its file, with warnings.
fn description(files: &Files, name: &str) -> Result<(SceneDescription, Vec<String>), JsError> {
    if let Ok(scene) = BuiltinScene::from_str(name) {
        return Ok((scene.description(), Vec::new()));
    }
    let path = Path::new(name);
    let bytes = files.get(path).map_err(|e| JsError::new(&format!("{name}: {e}")))?;
    let options = LoadOptions { max_memory: Some(MAX_MEMORY), ..LoadOptions::default() };
    let resolver = |path: &Path| files.get(path).map(<[u8]>::to_vec);
    let loaded = load_bytes(path, bytes, &resolver, &options).map_err(error)?;
    Ok((loaded.description, loaded.warnings))
}

/// sRGB with straight alpha.
fn developed(color: &RgbImage, alpha: &[f32], tone: ToneMapping) -> Vec<u8> {
    let byte = |x: f32| (255.0 * x).round() as u8;
    let pixel = |(&color, &alpha): (&Rgb, &f32)| {
        let straight = if alpha > 0.0 { color / alpha } else { Rgb::BLACK };
        let Rgb { r, g, b } = tone.apply(straight).map(srgb_from_linear);
        [r, g, b, alpha].map(byte)
    };
    color.pixels.iter().zip(alpha).flat_map(pixel).collect()
}

/// Renders the scene `name`, a built-in one or among `files`, under the map. `progress` gets the share that is done.
///
/// # Errors
/// If the scene is damaged, the camera makes no picture, or an option is wrong.
#[wasm_bindgen]
pub fn render(
    files: &Files,
    name: &str,
    map: &LightMap,
    options: &str,
    progress: &js_sys::Function,
) -> Result<Picture, JsError> {
    let options: RenderOptions = parse("render", options)?;
    options.check()?;
    let curve: ToneCurve = named("render", "tone", &options.tone)?;
    let strategy: StrategySpec = options.strategy.parse().map_err(error)?;
    let (scene, warnings) = options.scene(files, name)?;
    let (scene, camera) = (&scene, &options.camera(&scene)?);
    let environment = &*upright(map, scene.up_axis())?;
    let settings = options.settings();
    let mut renderer =
        Renderer::new(scene, camera, environment, strategy, settings).map_err(error)?;
    while !renderer.is_complete() {
        renderer.step_with(&Deadline::new(now, now() + INTERVAL));
        // What the caller's function throws does not end the picture.
        let _ = progress.call1(&JsValue::NULL, &renderer.progress().into());
    }
    let (color, alpha) = renderer.film().picture();
    let automatic = || automatic_exposure(scene, camera, environment, &settings).stops;
    let exposure = options.exposure.unwrap_or_else(automatic);
    let counts = renderer.counts();
    let report = Report {
        width: options.width,
        height: options.height,
        exposure,
        strategy: renderer.spec().unwrap_or(strategy).to_string(),
        camera_rays: counts.camera_rays,
        shadow_rays: counts.shadow_rays,
        warnings,
    };
    let linear = color.pixels.iter().zip(&alpha).flat_map(|(c, &a)| [c.r, c.g, c.b, a]).collect();
    let display = developed(&color, &alpha, ToneMapping { exposure, curve });
    Ok(Picture { linear, display, report: to_json(&report) })
}

#[wasm_bindgen]
impl Picture {
    /// R, G, B \[W·m⁻²·sr⁻¹\] and alpha of all pixels, once.
    #[wasm_bindgen(js_name = takeLinear)]
    pub fn take_linear(&mut self) -> Vec<f32> {
        std::mem::take(&mut self.linear)
    }

    /// sRGB and straight alpha of all pixels, once.
    #[wasm_bindgen(js_name = takeDisplay)]
    pub fn take_display(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.display)
    }

    /// How the picture was made, as JSON.
    pub fn report(&self) -> String {
        self.report.clone()
    }
}
