//! What is rendered: the page's settings, and the scene and light that they name.

use std::collections::BTreeMap;
use std::path::Path;
use std::str::FromStr;
use std::sync::Arc;

use domelight::Rgb;
use domelight::bsdf::{Bsdf, MaterialSpec};
use domelight::environment::UpAxis;
use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::io::{ProbeOptions, probe_from_bytes, reduced_probe_from_bytes};
use domelight::math::Vec3;
use domelight::picture::{memory_to_read, reduced_size};
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{
    CameraSettings, EnvironmentSettings, EnvironmentSource, Framing, Layers, LoadOptions, Material,
    MaterialModel, Projection, Scene, SceneDescription, load_bytes,
};
use serde::{Deserialize, Serialize};

use crate::error::{error, refused};
use crate::{Engine, Error};

/// The most that a scene and its textures take: an instance of WebAssembly has 4 GiB at the most, and builds a
/// hierarchy beside them \[bytes\].
const MAX_SCENE_MEMORY: u64 = 1 << 30;
/// The most that reading a probe takes \[bytes\].
const MAX_PROBE_MEMORY: u64 = 1 << 30;

/// The settings of [`Engine::load_scene`].
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
struct Setup {
    /// A built-in scene, or a file.
    scene: String,
    /// The subject's, as `--material` has it; empty leaves what the scene brings.
    material: String,
    /// Single materials of the scene by their index, which the subject's leaves alone.
    #[serde(default)]
    materials: BTreeMap<usize, String>,
    ground: bool,
}

impl Setup {
    /// Replaces the materials that the settings name.
    fn replace_materials(&self, description: &mut SceneDescription) -> Result<(), Error> {
        let parsed = |text: &str| {
            let material: MaterialSpec = text.parse().map_err(error)?;
            Ok::<_, Error>(Bsdf::from(material))
        };
        let n = description.materials.len();
        let own: Vec<usize> = description.parts.iter().map(|part| part.material).collect();
        if !self.material.is_empty() {
            description.set_subject_material(parsed(&self.material)?);
        }
        for (&index, text) in &self.materials {
            let missing = || refused(format!("material {index}: the scene has only {n}"));
            let material = description.materials[..n].get_mut(index).ok_or_else(missing)?;
            // The outline of a leaf and its relief stay.
            material.model = MaterialModel::Fixed(parsed(text)?);
            material.layers = Layers::default();
            material.unlit = false;
            for (part, &own) in description.parts.iter_mut().zip(&own) {
                if own == index {
                    part.material = own;
                }
            }
        }
        Ok(())
    }
}

/// What is known of a scene beside its geometry.
pub(crate) struct LoadedScene {
    up: UpAxis,
    camera: Option<CameraSettings>,
    /// What the scene was scaled by.
    scale: f32,
}

/// A camera in JSON; one of `fov` and `ortho` is null.
#[derive(Clone, Copy, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CameraState {
    origin: [f32; 3],
    target: [f32; 3],
    up: [f32; 3],
    fov: Option<f32>,
    ortho: Option<f32>,
}

impl CameraState {
    fn new(settings: &CameraSettings) -> Self {
        let (fov, ortho) = match settings.projection {
            Projection::Perspective { fov_y_degrees } => (Some(fov_y_degrees), None),
            Projection::Orthographic { height } => (None, Some(height)),
        };
        let [origin, target, up] =
            [settings.origin, settings.target, settings.up].map(|v| v.to_array());
        Self { origin, target, up, fov, ortho }
    }

    fn settings(self) -> CameraSettings {
        let projection = match self.ortho {
            Some(height) => Projection::Orthographic { height },
            None => Projection::Perspective {
                fov_y_degrees: self.fov.unwrap_or(CameraSettings::DEFAULT_FOV_Y_DEGREES),
            },
        };
        let [origin, target, up] = [self.origin, self.target, self.up].map(Vec3::from);
        CameraSettings { projection, origin, target, up }
    }
}

impl LoadedScene {
    /// The camera that was asked for, or else the scene's own, or one framed to `scene`.
    pub(crate) fn camera(
        &self,
        scene: &Scene,
        asked: Option<CameraState>,
        aspect: f32,
    ) -> CameraSettings {
        let own = asked.map(CameraState::settings).or(self.camera);
        let Some(mut camera) = own else {
            return scene.framed(&Framing::new(aspect, self.up.vector()));
        };
        if self.scale != 1.0 {
            camera.scale(self.scale);
        }
        camera
    }
}

/// What a scene brings, for the page.
#[derive(Serialize)]
struct SceneReport {
    triangles: usize,
    warnings: Vec<String>,
    camera: CameraState,
    /// All of the file, the first of which is `camera`.
    cameras: Vec<CameraReport>,
    /// Those of the file that are used.
    materials: Vec<MaterialReport>,
    /// Center and half diagonal of what the camera orbits.
    center: [f32; 3],
    radius: f32,
    up: [f32; 3],
    environment: Option<LightReport>,
}

/// One of a scene's cameras.
#[derive(Serialize)]
struct CameraReport {
    /// Its name, or its number.
    name: String,
    camera: CameraState,
}

/// One of a scene's materials.
#[derive(Serialize)]
struct MaterialReport {
    index: usize,
    name: String,
    /// The material without textures and layers, as `--material` has it; empty if it has no such form.
    text: String,
}

impl MaterialReport {
    fn of(description: &SceneDescription) -> Vec<Self> {
        let is_used = |index: usize| description.parts.iter().any(|part| part.material == index);
        let materials = description.materials.iter().enumerate();
        materials.filter(|(index, _)| is_used(*index)).map(|(i, m)| Self::new(i, m)).collect()
    }

    fn new(index: usize, material: &Material) -> Self {
        let color = |Rgb { r, g, b }: Rgb| format!("{},{},{}", short(r), short(g), short(b));
        let text = match &material.model {
            MaterialModel::Fixed(_) => String::new(),
            MaterialModel::Phong(m) if m.specular == Rgb::BLACK => {
                format!("diffuse:{}", color(m.diffuse))
            }
            MaterialModel::Phong(m) => {
                let exponent = short(m.exponent);
                format!("phong:{exponent}:{}:{}", color(m.specular), color(m.diffuse))
            }
            MaterialModel::MetallicRoughness(m) => {
                let [metallic, roughness] = [m.metallic, m.roughness].map(short);
                format!("gltf:{}:{metallic}:{roughness}", color(m.base_color))
            }
            MaterialModel::SpecularGlossiness(m) => {
                format!("gltf:{}:0:{}", color(m.diffuse), short(1.0 - m.glossiness))
            }
        };
        Self { index, name: material.name.clone(), text }
    }
}

/// A number with at most three decimals.
fn short(x: f32) -> f64 {
    (1000.0 * f64::from(x)).round() / 1000.0
}

/// The light that a scene names.
#[derive(Serialize)]
struct LightReport {
    probe: String,
    rotate: f32,
    scale: f32,
    exposure: f32,
}

/// The settings of [`Engine::load_environment`].
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Light {
    /// A built-in probe, or a file.
    probe: String,
    /// Rows of a built-in probe.
    rows: usize,
    /// How many columns and rows of a file's map become one; 1 keeps all.
    #[serde(default = "whole")]
    reduce: usize,
    /// \[degrees\]
    rotate: f32,
    scale: f32,
    /// \[stops\]
    exposure: f32,
}

const fn whole() -> usize {
    1
}

/// A smaller size at which a map fits.
#[derive(Serialize)]
struct SmallerMap {
    reduce: usize,
    size: [usize; 2],
}

/// What a probe is, for the page.
#[derive(Serialize)]
struct ProbeReport {
    size: [usize; 2],
    warnings: Vec<String>,
}

/// Reads the page's settings.
pub(crate) fn parse<'a, T: Deserialize<'a>>(json: &'a str) -> Result<T, Error> {
    Ok(serde_json::from_str(json)?)
}

/// Writes what the page reads.
pub(crate) fn to_json(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default()
}

impl Engine {
    /// Loads and builds a scene: `{"scene", "material", "materials", "ground"}`; returns what it brings.
    ///
    /// # Errors
    /// If there is no such scene, its file is damaged, or the material is none.
    pub fn load_scene(&mut self, json: &str) -> Result<String, Error> {
        let setup: Setup = parse(json)?;
        let (mut description, warnings) = if let Ok(scene) = BuiltinScene::from_str(&setup.scene) {
            (scene.description(), Vec::new())
        } else {
            let options =
                LoadOptions { max_memory: Some(MAX_SCENE_MEMORY), ..LoadOptions::default() };
            let path = Path::new(&setup.scene);
            let bytes = self
                .files
                .get(path)
                .map_err(|e| refused(format!("cannot read {}: {e}", path.display())))?;
            let resolver = |path: &Path| self.files.get(path).map(<[u8]>::to_vec);
            let loaded = load_bytes(path, bytes, &resolver, &options).map_err(error)?;
            (loaded.description, loaded.warnings)
        };
        let materials = MaterialReport::of(&description);
        setup.replace_materials(&mut description)?;
        let up = description.up.unwrap_or_default();
        let framed = description.subject_bounds();
        if setup.ground {
            description.add_ground(up.vector());
        }
        let camera = description.camera;
        let light = description.environment.take().map(|light| LightReport {
            probe: match light.source {
                EnvironmentSource::Builtin(name) => name,
                EnvironmentSource::File(path) => path.display().to_string(),
            },
            rotate: light.rotate_degrees,
            scale: light.scale,
            exposure: light.exposure,
        });
        let mut view =
            camera.unwrap_or_else(|| description.framed(&Framing::new(1.0, up.vector())));
        let report_camera = CameraState::new(&view);
        let cameras = description.cameras.iter().enumerate().map(|(i, of_file)| CameraReport {
            name: if of_file.name.is_empty() { i.to_string() } else { of_file.name.clone() },
            camera: CameraState::new(&of_file.settings),
        });
        let cameras = cameras.collect();
        let scale = description.rescale(&mut view);
        let scene = Scene::new(description).map_err(error)?;
        let report = SceneReport {
            triangles: scene.triangle_count(),
            warnings,
            camera: report_camera,
            cameras,
            materials,
            center: framed.center().to_array(),
            radius: 0.5 * framed.size().length(),
            up: up.vector().to_array(),
            environment: light,
        };
        self.rendering = None;
        self.scene = Some((Arc::new(scene), LoadedScene { up, camera, scale }));
        Ok(to_json(&report))
    }

    /// Loads a probe: `{"probe", "rows", "reduce", "rotate", "scale", "exposure"}`; returns its size and what was repaired.
    ///
    /// # Errors
    /// If there is no such probe or its file is damaged.
    pub fn load_environment(&mut self, json: &str) -> Result<String, Error> {
        let light: Light = parse(json)?;
        let (image, warnings) = if let Ok(probe) = BuiltinProbe::from_str(&light.probe) {
            (probe.image(light.rows.clamp(1, 4096)), Vec::new())
        } else {
            let path = Path::new(&light.probe);
            let bytes = self
                .files
                .get(path)
                .map_err(|e| refused(format!("cannot read {}: {e}", path.display())))?;
            let options =
                ProbeOptions { max_memory: Some(MAX_PROBE_MEMORY), ..ProbeOptions::default() };
            let name = &light.probe;
            let probe = match light.reduce {
                1 => probe_from_bytes(bytes, name, &options),
                factor => reduced_probe_from_bytes(bytes, name, factor, &options),
            };
            let probe = probe.map_err(error)?;
            (probe.image, probe.warnings)
        };
        let up = self.scene.as_ref().map_or(UpAxis::Y, |(_, loaded)| loaded.up);
        let settings = EnvironmentSettings {
            rotate_degrees: light.rotate,
            scale: light.scale,
            exposure: light.exposure,
            ..EnvironmentSettings::new(EnvironmentSource::Builtin(light.probe), up)
        };
        let environment = settings.environment(image).map_err(error)?;
        let map = environment.map();
        let report = ProbeReport { size: [map.width, map.height], warnings };
        self.rendering = None;
        self.extraction = None;
        self.prefiltered = None;
        self.environment = Some(Arc::new(environment));
        Ok(to_json(&report))
    }

    /// The sizes, at most half the file's, at which its map can be read where it needs too much memory as a whole: JSON of
    /// `{"reduce", "size"}`, the largest first. None for other files.
    ///
    /// # Errors
    /// None.
    pub fn smaller_maps(&self, probe: &str) -> Result<String, Error> {
        let bytes = self.files.get(Path::new(probe)).unwrap_or_default();
        let is_too_large = memory_to_read(bytes).is_ok_and(|needed| needed > MAX_PROBE_MEMORY);
        let sizes = [2, 4, 8].into_iter().filter_map(|reduce| {
            let ((width, height), needed) = reduced_size(bytes, reduce).ok()?;
            let fits = is_too_large && needed <= MAX_PROBE_MEMORY;
            fits.then_some(SmallerMap { reduce, size: [width, height] })
        });
        Ok(to_json(&sizes.collect::<Vec<_>>()))
    }

    /// Turns the environment \[degrees\]; the map is not read again.
    ///
    /// # Errors
    /// If there is no environment or the angle is not finite.
    pub fn turn_environment(&mut self, rotate: f32) -> Result<(), Error> {
        self.rendering = None;
        self.extraction = None;
        self.prefiltered = None;
        let environment = self.environment.take().ok_or(Error::NoEnvironment)?;
        let environment = Arc::unwrap_or_clone(environment);
        let by = rotate - environment.orientation().rotation;
        self.environment = Some(Arc::new(environment.rotated(by).map_err(error)?));
        Ok(())
    }
}
