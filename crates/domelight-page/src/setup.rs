//! What is rendered: the page's settings, and the scene and light that they name.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;

use domelight::bsdf::{Bsdf, MaterialSpec};
use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::io::{ProbeOptions, probe_from_bytes, reduced_probe_from_bytes};
use domelight::environment::{Environment, UpAxis};
use domelight::math::Vec3;
use domelight::picture::{memory_to_read, reduced_size};
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{
    CameraSettings, EnvironmentSettings, EnvironmentSource, Layers, LoadOptions, Material,
    MaterialModel, Projection, Scene, SceneDescription, load_bytes, load_with,
};
use domelight::{Rgb, RgbImage};
use serde::{Deserialize, Serialize};

use crate::error::{error, refused};
use crate::{Engine, Error};

/// The settings of [`Engine::load_scene`].
#[derive(Clone, PartialEq, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub(crate) struct Setup {
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

/// A scene, and what is known of it beside its geometry.
pub(crate) struct LoadedScene {
    pub(crate) scene: Scene,
    /// What the page hears of it.
    report: String,
}

/// A camera in JSON; one of `fov` and `ortho` is null.
#[derive(Clone, Copy, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct CameraState {
    origin: [f32; 3],
    target: [f32; 3],
    up: [f32; 3],
    fov: Option<f32>,
    ortho: Option<f32>,
}

impl CameraState {
    /// What the page knows of a camera.
    pub fn new(settings: &CameraSettings) -> Self {
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
    /// The camera that was asked for, or else the scene's own, or one framed to it.
    pub(crate) fn camera(&self, asked: Option<CameraState>, aspect: f32) -> CameraSettings {
        asked.map_or_else(|| self.scene.camera(aspect), CameraState::settings)
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
#[derive(Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Light {
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

/// A light, and what the page hears of it.
#[derive(Clone)]
pub(crate) struct LoadedLight {
    pub(crate) environment: Arc<Environment>,
    report: String,
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
        let make = || self.built(&setup);
        // Files that the page gives are each engine's own.
        let scene = if self.files.is_empty() {
            self.host.shared.scenes.get_or_make(setup.clone(), make)?
        } else {
            Arc::new(make()?)
        };
        let report = scene.report.clone();
        self.rendering = None;
        self.scene = Some(scene);
        Ok(report)
    }

    /// Reads a scene, with warnings.
    fn described(&self, name: &str) -> Result<(SceneDescription, Vec<String>), Error> {
        if let Ok(scene) = BuiltinScene::from_str(name) {
            return Ok((scene.description(), Vec::new()));
        }
        let options = LoadOptions { max_memory: self.host.max_memory, ..LoadOptions::default() };
        let path = Path::new(name);
        let loaded = if self.is_on_disk(path) {
            self.host.reads([path]);
            let loaded = load_with(path, &options).map_err(error)?;
            self.host.reads(loaded.files.iter().map(PathBuf::as_path));
            if let Some(EnvironmentSource::File(map)) =
                loaded.description.environment.as_ref().map(|light| &light.source)
            {
                self.host.allow_map(map);
            }
            loaded
        } else {
            let bytes = self.given(path)?;
            let resolver = |path: &Path| self.files.get(path).map(<[u8]>::to_vec);
            load_bytes(path, bytes, &resolver, &options).map_err(error)?
        };
        Ok((loaded.description, loaded.warnings))
    }

    /// The bytes of a file that the page has given.
    fn given(&self, path: &Path) -> Result<&[u8], Error> {
        let cannot = |e| refused(format!("cannot read {}: {e}", path.display()));
        self.files.get(path).map_err(cannot)
    }

    fn built(&self, setup: &Setup) -> Result<LoadedScene, Error> {
        let (mut description, warnings) = self.described(&setup.scene)?;
        let materials = MaterialReport::of(&description);
        setup.replace_materials(&mut description)?;
        let up = description.up.unwrap_or_default();
        let framed = description.subject_bounds();
        if setup.ground {
            description.add_ground(up.vector());
        }
        let light = description.environment.take().map(|light| LightReport {
            probe: match light.source {
                EnvironmentSource::Builtin(name) => name,
                EnvironmentSource::File(path) => path.display().to_string(),
            },
            rotate: light.rotate_degrees,
            scale: light.scale,
            exposure: light.exposure,
        });
        let cameras = description.cameras.iter().enumerate().map(|(i, of_file)| CameraReport {
            name: if of_file.name.is_empty() { i.to_string() } else { of_file.name.clone() },
            camera: CameraState::new(&of_file.settings),
        });
        let cameras = cameras.collect();
        let scene = Scene::new(description).map_err(error)?;
        let report = SceneReport {
            triangles: scene.triangle_count(),
            warnings,
            camera: CameraState::new(&scene.camera(1.0)),
            cameras,
            materials,
            center: framed.center().to_array(),
            radius: 0.5 * framed.size().length(),
            up: up.vector().to_array(),
            environment: light,
        };
        Ok(LoadedScene { scene, report: to_json(&report) })
    }

    /// Loads a probe: `{"probe", "rows", "reduce", "rotate", "scale", "exposure"}`; returns its size and what was repaired.
    ///
    /// # Errors
    /// If there is no such probe or its file is damaged.
    pub fn load_environment(&mut self, json: &str) -> Result<String, Error> {
        let light: Light = parse(json)?;
        let up = self.scene.as_ref().map_or(UpAxis::Y, |scene| scene.scene.up_axis());
        let loaded = self.kept_light(light.clone(), up, || self.read_light(&light, up))?;
        let report = loaded.report.clone();
        self.set_light(light, loaded);
        Ok(report)
    }

    fn set_light(&mut self, light: Light, loaded: Arc<LoadedLight>) {
        self.rendering = None;
        self.extraction = None;
        self.prefiltered = None;
        self.light = Some((light, loaded));
    }

    /// The light of some settings, which other engines share. Files that the page gives are each engine's own.
    fn kept_light(
        &self,
        light: Light,
        up: UpAxis,
        make: impl FnOnce() -> Result<LoadedLight, Error>,
    ) -> Result<Arc<LoadedLight>, Error> {
        if self.files.is_empty() {
            self.host.shared.lights.get_or_make((light, up), make)
        } else {
            make().map(Arc::new)
        }
    }

    fn read_light(&self, light: &Light, up: UpAxis) -> Result<LoadedLight, Error> {
        let (image, warnings) = self.read_map(light)?;
        let settings = EnvironmentSettings {
            rotate_degrees: light.rotate,
            scale: light.scale,
            exposure: light.exposure,
            ..EnvironmentSettings::new(EnvironmentSource::Builtin(light.probe.clone()), up)
        };
        let environment = settings.environment(image).map_err(error)?;
        let map = environment.map();
        let report = to_json(&ProbeReport { size: [map.width, map.height], warnings });
        Ok(LoadedLight { environment: Arc::new(environment), report })
    }

    /// The map of a probe, with warnings.
    fn read_map(&self, light: &Light) -> Result<(RgbImage, Vec<String>), Error> {
        if let Ok(probe) = BuiltinProbe::from_str(&light.probe) {
            return Ok((probe.image(light.rows.clamp(1, 4096)), Vec::new()));
        }
        let bytes = self.bytes_of(Path::new(&light.probe))?;
        let options = ProbeOptions { max_memory: self.host.max_memory, ..ProbeOptions::default() };
        let probe = match light.reduce {
            1 => probe_from_bytes(&bytes, &light.probe, &options),
            factor => reduced_probe_from_bytes(&bytes, &light.probe, factor, &options),
        };
        let probe = probe.map_err(error)?;
        Ok((probe.image, probe.warnings))
    }

    /// The bytes of a file, of the disk or given by the page.
    fn bytes_of(&self, path: &Path) -> Result<Cow<'_, [u8]>, Error> {
        if !self.is_on_disk(path) {
            return self.given(path).map(Cow::Borrowed);
        }
        self.host.reads([path]);
        let cannot = |e| refused(format!("cannot read {}: {e}", path.display()));
        fs::read(path).map(Cow::Owned).map_err(cannot)
    }

    /// The sizes, at most half the file's, at which its map can be read where it needs too much memory as a whole: JSON of
    /// `{"reduce", "size"}`, the largest first. None for other files.
    pub fn smaller_maps(&self, probe: &str) -> String {
        let bytes = self.bytes_of(Path::new(probe)).unwrap_or_default();
        let fits = |needed: u64| self.host.max_memory.is_none_or(|most| needed <= most);
        let is_too_large = memory_to_read(&bytes).is_ok_and(|needed| !fits(needed));
        let sizes = [2, 4, 8].into_iter().filter_map(|reduce| {
            let ((width, height), needed) = reduced_size(&bytes, reduce).ok()?;
            (is_too_large && fits(needed)).then_some(SmallerMap { reduce, size: [width, height] })
        });
        to_json(&sizes.collect::<Vec<_>>())
    }

    /// Turns the environment \[degrees\]; the map is not read again.
    ///
    /// # Errors
    /// If there is no environment or the angle is not finite.
    pub fn turn_environment(&mut self, rotate: f32) -> Result<(), Error> {
        let (light, loaded) = self.light.take().ok_or(Error::NoEnvironment)?;
        let light = Light { rotate, ..light };
        let orientation = loaded.environment.orientation();
        let turned = self.kept_light(light.clone(), orientation.up, || {
            // No copy where nobody shares it.
            let LoadedLight { environment, report } = Arc::unwrap_or_clone(loaded);
            let environment = Arc::unwrap_or_clone(environment);
            let environment = environment.rotated(rotate - orientation.rotation).map_err(error)?;
            Ok(LoadedLight { environment: Arc::new(environment), report })
        })?;
        self.set_light(light, turned);
        Ok(())
    }
}
