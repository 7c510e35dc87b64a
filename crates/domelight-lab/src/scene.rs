//! Turns the user's settings for a scene, its light and its view into a renderable scene.

use std::path::{Path, PathBuf};
use std::str::FromStr as _;

use domelight::RgbImage;
use domelight::bsdf::{Bsdf, MaterialSpec, ParseMaterialError};
use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::io::{ProbeError, ProbeOptions};
use domelight::environment::mapping::Mapping;
use domelight::environment::{Environment, Orientation, UpAxis, key_light_rotation};
use domelight::math::Vec3;
use domelight::picture::{PictureError, PictureErrorKind};
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{
    AnimationTime, Camera, CameraSettings, EnvironmentSettings, EnvironmentSource, Framing, Lens,
    LoadError, LoadOptions, NamedCamera, Projection, Scene, SceneDescription, ViewDirection,
    load_with,
};

pub use crate::depth_of_field::{BadDepthOfField, DepthOfField};
pub use crate::ground::Ground;
use crate::names::{file_name, without_folders};
use crate::report::{CameraReport, EnvironmentReport, SceneReport};
use crate::{At as _, Error, Host};

/// The default number of rows of a built-in probe.
pub const BUILTIN_ROWS: u32 = 1024;

/// Memory per triangle \[bytes\] of the BVH and its construction.
pub const TRIANGLE: u64 = 140;

/// The user's settings for a scene, its light and a camera.
#[derive(Clone, Debug)]
pub struct SceneSettings {
    /// A built-in scene or a file.
    pub scene: String,
    /// The part of the file to show.
    pub file: FileSettings,
    /// The light.
    pub environment: LightSettings,
    /// The view.
    pub view: ViewSettings,
    /// The changes to the scene.
    pub subject: SubjectSettings,
}

/// The part of a file to show.
#[derive(Clone, Debug, Default)]
pub struct FileSettings {
    /// The scene of a glTF file, by name or number; `None` is the file's default scene.
    pub scene: Option<String>,
    /// The animation of a glTF file and the time in it; `None` is the rest pose.
    pub animation: Option<AnimationTime>,
}

/// The light. `None` means the scene's own setting.
#[derive(Clone, Debug)]
pub struct LightSettings {
    /// A built-in probe or a file.
    pub probe: Option<String>,
    /// The rotation about the up axis, counterclockwise as seen from above \[degrees\].
    pub rotate: Option<f32>,
    /// Whether to rotate the map instead so that its key light comes from the left of the camera.
    pub rotate_to_camera: bool,
    /// A factor on the radiance.
    pub scale: Option<f32>,
    /// Exposure: multiplies the radiance by 2 to this power.
    pub exposure: Option<f32>,
    /// The direction of the top of the map.
    pub up: Option<UpAxis>,
    /// The layout of the map, if the shape and the attributes of the file do not determine it.
    pub mapping: Option<Mapping>,
    /// The layer of an OpenEXR map.
    pub layer: Option<String>,
    /// The number of rows of a built-in probe.
    pub rows: u32,
    /// Whether to reject scenes that would be repaired or shown in part.
    pub strict_scene: bool,
    /// Whether to reject maps that would be repaired.
    pub strict_map: bool,
}

impl Default for LightSettings {
    fn default() -> Self {
        Self {
            probe: None,
            rotate: None,
            rotate_to_camera: false,
            scale: None,
            exposure: None,
            up: None,
            mapping: None,
            layer: None,
            rows: BUILTIN_ROWS,
            strict_scene: false,
            strict_map: false,
        }
    }
}

/// The view. `None` means the setting of the scene's camera, or else of a framing camera.
#[derive(Clone, Debug)]
pub struct ViewSettings {
    /// Width and height of the picture \[pixels\].
    pub size: [usize; 2],
    /// One of the scene's cameras, by name or number; `None` is the first.
    pub camera: Option<String>,
    /// The direction of a camera that frames the scene, regardless of the scene's cameras.
    pub view: Option<ViewDirection>,
    /// Whether a framed camera keeps the subject in the picture while it goes around it.
    pub all_around: bool,
    /// The depth of field; `None` is sharp everywhere.
    pub depth_of_field: Option<DepthOfField>,
    /// The position of the camera.
    pub origin: Option<Vec3>,
    /// What it looks at.
    pub target: Option<Vec3>,
    /// The direction that is up in the picture.
    pub up: Option<Vec3>,
    /// Perspective or orthographic.
    pub projection: Option<Projection>,
}

/// The changes to the scene.
#[derive(Clone, Debug, Default)]
pub struct SubjectSettings {
    /// The material of the subject; `None` is its own.
    pub material: Option<NamedMaterial>,
    /// Whether to move and scale the scene: center of the bounds to 0, longest half-extent to 1.
    pub normalize: bool,
    /// The ground under the subject.
    pub ground: Option<Ground>,
    /// Whether to hide the background.
    pub hide_env: bool,
}

/// A material in the notation of `--material`, with its original text.
#[derive(Clone, Debug)]
pub struct NamedMaterial {
    /// As it was given.
    pub text: String,
    /// What it says.
    pub spec: MaterialSpec,
}

impl std::str::FromStr for NamedMaterial {
    type Err = ParseMaterialError;

    fn from_str(s: &str) -> Result<Self, ParseMaterialError> {
        Ok(Self { text: s.to_owned(), spec: s.parse()? })
    }
}

/// A loaded scene, changed according to the settings but not yet built.
#[derive(Debug)]
pub struct LoadedScene {
    /// Geometry and materials.
    pub description: SceneDescription,
    /// The use of the map.
    pub light: EnvironmentSettings,
    /// The map, lat-long.
    pub map: RgbImage,
    /// The camera.
    pub camera: CameraSettings,
    /// What the picture will lack of the files, one sentence per item.
    pub warnings: Vec<String>,
    settings: SceneSettings,
}

/// A scene under its light, seen by a camera.
#[derive(Debug)]
pub struct PreparedScene {
    /// Geometry and materials.
    pub scene: Scene,
    /// The view.
    pub camera: Camera,
    /// The view, in the units of the scene's file, as `camera`.
    pub camera_settings: CameraSettings,
    /// The lens of a camera with depth of field.
    lens: Option<Lens>,
    /// The axis around which the camera goes.
    up: Vec3,
    /// The light.
    pub environment: Environment,
    /// The name of the probe, built-in or a file, for messages.
    pub probe: String,
    /// A report in words and numbers.
    pub report: SceneReport,
}

/// A borrowed scene with its light and camera.
#[derive(Clone, Copy, Debug)]
pub struct PreparedSceneRef<'a> {
    /// Geometry and materials.
    pub scene: &'a Scene,
    /// The view.
    pub camera: &'a Camera,
    /// The light.
    pub environment: &'a Environment,
    /// A report in words and numbers.
    pub report: &'a SceneReport,
}

impl PreparedScene {
    /// The parts that a render needs.
    pub fn view(&self) -> PreparedSceneRef<'_> {
        let Self { scene, camera, environment, report, .. } = self;
        PreparedSceneRef { scene, camera, environment, report }
    }

    /// The camera rotated around the subject by an angle, counterclockwise as seen from above \[degrees\].
    ///
    /// # Errors
    /// If the camera would be invalid.
    pub fn camera_around(&self, degrees: f32) -> Result<Camera, Error> {
        let center = self.scene.subject_bounds().center();
        let center = if center.is_finite() { center } else { self.camera_settings.target };
        let settings = self.camera_settings.orbited(center, self.up, degrees);
        let [width, height] = self.report.size;
        Ok(through(Camera::new(&settings, width, height)?, self.lens))
    }
}

/// The camera with the lens, if there is one.
fn through(camera: Camera, lens: Option<Lens>) -> Camera {
    lens.map_or(camera, |lens| camera.with_lens(lens))
}

impl SceneSettings {
    /// An unchanged scene under its own light or the built-in sky.
    pub fn new(scene: impl Into<String>, size: [usize; 2]) -> Self {
        Self {
            scene: scene.into(),
            file: FileSettings::default(),
            environment: LightSettings::default(),
            view: ViewSettings {
                size,
                camera: None,
                view: None,
                all_around: false,
                depth_of_field: None,
                origin: None,
                target: None,
                up: None,
                projection: None,
            },
            subject: SubjectSettings::default(),
        }
    }

    /// Reads scene and probe.
    ///
    /// # Errors
    /// If one cannot be read, or the view is not available.
    pub fn load(self, host: &dyn Host) -> Result<LoadedScene, Error> {
        let is_builtin = BuiltinScene::from_str(&self.scene);
        let (mut description, mut light, map, warnings) = if let Ok(scene) = is_builtin {
            self.file.check_builtin(&self.scene)?;
            // It takes little memory, so its light can be read in parallel.
            let environment = Some(scene.environment());
            let of_scene = SceneDescription { environment, ..SceneDescription::default() };
            let light = self.environment.over(&of_scene);
            let map = || self.environment.load(&light, host);
            let (description, map) = rayon::join(|| scene.description(), map);
            (description, light, map?, Vec::new())
        } else {
            let strict = self.environment.strict_scene;
            let (description, warnings) = load_scene(&self.scene, &self.file, strict, host)?;
            let light = self.environment.over(&description);
            let map = self.environment.load(&light, host)?;
            (description, light, map, warnings)
        };
        self.view.choose(&self.scene, &mut description)?;
        let camera = self.frame(&mut description, light.up.vector())?;
        if self.environment.rotate_to_camera {
            let side = camera.side(light.up.vector());
            light.rotate_degrees = key_light_rotation(&map, light.up, side);
        }
        Ok(LoadedScene { description, light, map, camera, warnings, settings: self })
    }

    /// Changes the scene according to the settings. The camera frames the subject.
    fn frame(&self, scene: &mut SceneDescription, up: Vec3) -> Result<CameraSettings, Error> {
        self.subject.apply(scene, up);
        // Squares of lengths must be finite.
        let extent = scene.subject_bounds().size().max_element();
        if extent > 1e18 || extent > 0.0 && extent < 1e-18 {
            let how = if extent < 1.0 { "small" } else { "large" };
            let text = format!("{}: the scene is too {how}: {extent:e} across", self.scene);
            return Err(Error::Usage(text));
        }
        Ok(self.view.over(scene, up))
    }
}

impl LoadedScene {
    /// Builds the BVH and the tables.
    ///
    /// # Errors
    /// If the scene, the camera or the environment is invalid.
    pub fn build(self, host: &dyn Host) -> Result<PreparedScene, Error> {
        let Self { description, light, map, camera, warnings, settings } = self;
        let [width, height] = settings.view.size;
        let dof = settings.view.depth_of_field.map(|dof| dof.focused(&camera, &description));
        let lens = dof.map(|(dof, focus)| dof.lens(&camera, focus)).transpose()?;
        let focused =
            |(dof, focus): (DepthOfField, f32)| DepthOfField { focus_distance: Some(focus), ..dof };
        let camera_report = CameraReport::new(&camera, dof.map(focused));
        let (camera, camera_settings) = (Camera::new(&camera, width, height)?, camera);
        let camera = through(camera, lens);
        let n_triangles = description.built_triangle_count();
        let tree = format!("{}: a BVH over {n_triangles} triangles", settings.scene);
        host.take_memory(&tree, TRIANGLE * n_triangles as u64)?;
        let scene = Scene::new(description).at(&settings.scene)?;
        let orientation = Orientation { up: light.up, rotation: light.rotate_degrees };
        let probe = probe_name(&light.source);
        let scale = light.factor().at(&probe)?;
        let environment = Environment::new(map, orientation, scale).at(&probe)?;
        if environment.power() == 0.0 {
            host.warn(&format!("{probe}: gives no light: the map is black, or --env-scale is 0"));
        }
        let report = SceneReport {
            scene: file_name(&settings.scene),
            triangles: scene.triangle_count(),
            warnings,
            material: settings.subject.material.map(|m| m.text),
            normalize: settings.subject.normalize,
            ground: settings.subject.ground,
            hide_env: settings.subject.hide_env,
            environment: EnvironmentReport::new(file_name(&probe), &light, &environment),
            camera: camera_report,
            size: [width, height],
        };
        let up = light.up.vector();
        Ok(PreparedScene { scene, camera, camera_settings, lens, up, environment, probe, report })
    }
}

/// The scene's own camera, or one that frames it.
pub(crate) fn view_of(description: &SceneDescription, aspect: f32, up: Vec3) -> CameraSettings {
    description.camera.unwrap_or_else(|| description.framed(&Framing::new(aspect, up)))
}

/// That view, moved until the scene just fits.
pub(crate) fn close_up(description: &SceneDescription, aspect: f32, up: Vec3) -> CameraSettings {
    const FOV: f32 = 26.0;
    let view = view_of(description, aspect, up);
    let bounds = description.bounds();
    let (center, size) = (bounds.center(), bounds.size());
    let toward = (view.origin - view.target).normalize_or(Vec3::Z);
    let height = size.abs().dot(up.abs());
    // The widest side, in any orientation.
    let width = (size - up.abs() * height).max_element();
    let extent = height.max(width / aspect) * 1.08;
    let distance = 0.5 * extent / (0.5 * FOV.to_radians()).tan() + 0.5 * width;
    CameraSettings {
        projection: Projection::Perspective { fov_y_degrees: FOV },
        origin: center + toward * distance,
        target: center,
        up: view.up,
    }
}

/// A built-in scene by its name, or else a file, with what will not be shown, one sentence per item, without folders.
pub(crate) fn load_scene(
    name: &str,
    file: &FileSettings,
    strict: bool,
    host: &dyn Host,
) -> Result<(SceneDescription, Vec<String>), Error> {
    if let Ok(builtin) = BuiltinScene::from_str(name) {
        return Ok((builtin.description(), Vec::new()));
    }
    host.reads(Path::new(name))?;
    let options = LoadOptions {
        max_memory: host.memory_left(),
        strict,
        scene: file.scene.clone(),
        animation: file.animation.clone(),
        ..LoadOptions::default()
    };
    let loaded = load_with(Path::new(name), &options)?;
    loaded.files.iter().try_for_each(|file| host.reads(file))?;
    host.keeps_memory(loaded.memory);
    for warning in &loaded.warnings {
        host.warn(warning);
    }
    let files = || loaded.files.iter().map(PathBuf::as_path).chain([Path::new(name)]);
    let shared = |text: &String| without_folders(text, files());
    let warnings = loaded.warnings.iter().map(shared).collect();
    Ok((loaded.description, warnings))
}

impl FileSettings {
    /// Rejects options that a built-in scene does not have.
    fn check_builtin(&self, scene: &str) -> Result<(), Error> {
        match (&self.scene, &self.animation) {
            (None, None) => Ok(()),
            _ => Err(Error::Usage(format!(
                "--scene and --animation choose in a glTF file; {scene} is built in"
            ))),
        }
    }
}

/// The name of the probe, for messages.
pub(crate) fn probe_name(source: &EnvironmentSource) -> String {
    match source {
        EnvironmentSource::File(path) => path.display().to_string(),
        EnvironmentSource::Builtin(name) => name.clone(),
    }
}

impl LightSettings {
    /// The scene's own settings, overridden by these.
    pub fn over(&self, scene: &SceneDescription) -> EnvironmentSettings {
        let source = |name: &str| match BuiltinProbe::from_str(name) {
            Ok(probe) => EnvironmentSource::Builtin(probe.name().to_owned()),
            Err(_) => EnvironmentSource::File(name.into()),
        };
        let plain = |source| EnvironmentSettings::new(source, scene.up.unwrap_or_default());
        let mut settings = match (&self.probe, &scene.environment) {
            // Another probe does not inherit the first one's adjustments.
            (Some(name), _) => plain(source(name)),
            (None, Some(of_scene)) => of_scene.clone(),
            (None, None) => plain(source(BuiltinProbe::Sky.name())),
        };
        settings.rotate_degrees = self.rotate.unwrap_or(settings.rotate_degrees);
        settings.scale = self.scale.unwrap_or(settings.scale);
        settings.exposure = self.exposure.unwrap_or(settings.exposure);
        settings.up = self.up.unwrap_or(settings.up);
        settings
    }

    /// Reads or creates the lat-long map.
    ///
    /// # Errors
    /// If it cannot be read, or needs too much memory.
    pub fn load(&self, light: &EnvironmentSettings, host: &dyn Host) -> Result<RgbImage, Error> {
        let path = match &light.source {
            EnvironmentSource::Builtin(name) => {
                let probe = BuiltinProbe::from_str(name);
                let probe = probe.map_err(|error| match &light.referrer {
                    Some(referrer) => Error::Usage(format!("{referrer}: {error}")),
                    None => Error::Usage(error.to_string()),
                })?;
                if self.layer.is_some() || self.mapping.is_some() {
                    host.warn(&format!(
                        "{name} is built in: its layer and mapping cannot be chosen"
                    ));
                }
                let rows = u64::from(self.rows);
                let bytes = Environment::MEMORY_PER_TEXEL * 2 * rows * rows;
                host.take_memory(&format!("{name} with {rows} rows"), bytes)?;
                return Ok(probe.image(self.rows as usize));
            }
            EnvironmentSource::File(path) => path,
        };
        let options = ProbeOptions {
            mapping: self.mapping,
            layer: self.layer.clone(),
            strict: self.strict_map,
            max_memory: host.memory_left(),
        };
        host.reads(path)?;
        let loaded = host.load_probe(path, &options);
        let loaded = loaded.map_err(|error| of_scene_file(error, path, light))?;
        let texels = loaded.image.pixels.len() as u64;
        host.take_memory(&path.display().to_string(), Environment::MEMORY_PER_TEXEL * texels)?;
        loaded.warnings.iter().for_each(|warning| host.warn(warning));
        Ok(loaded.image)
    }
}

/// An error in loading a probe, with the line of the scene file that names it, if there is one.
fn of_scene_file(error: Error, path: &Path, light: &EnvironmentSettings) -> Error {
    let Some(referrer) = &light.referrer else { return error };
    match error {
        Error::Probe(ProbeError::Picture(PictureError {
            kind: PictureErrorKind::Io(source),
            ..
        })) => {
            let (path, referrer) = (path.to_owned(), format!("{referrer},"));
            LoadError::ReadReferenced { path, referrer, source }.into()
        }
        Error::Probe(error) => Error::At { place: referrer.clone(), error: Box::new(error.into()) },
        other => other,
    }
}

impl SubjectSettings {
    /// Applies the changes to the scene.
    fn apply(&self, scene: &mut SceneDescription, up: Vec3) {
        if self.normalize {
            scene.normalize();
        }
        if let Some(material) = &self.material {
            scene.set_subject_material(Bsdf::from(material.spec));
        }
        match self.ground {
            None => {}
            Some(Ground::Plate) => scene.add_ground(up),
            Some(Ground::Shadow) => scene.add_shadow_catcher(up),
        }
    }
}

impl ViewSettings {
    /// Makes the requested camera the scene's.
    fn choose(&self, name: &str, scene: &mut SceneDescription) -> Result<(), Error> {
        let Some(asked) = &self.camera else { return Ok(()) };
        let cameras = &scene.cameras;
        let by_name = cameras.iter().find(|camera| camera.name == *asked);
        let by_number = || asked.parse().ok().and_then(|i: usize| cameras.get(i));
        if let Some(NamedCamera { settings, .. }) = by_name.or_else(by_number) {
            scene.camera = Some(*settings);
            return Ok(());
        }
        let names: Vec<_> =
            cameras.iter().enumerate().map(|(i, c)| format!("{i} '{}'", c.name)).collect();
        let known = match names.len() {
            0 => "has no camera to choose".to_owned(),
            _ => format!("has no camera '{asked}'; there are {}", names.join(", ")),
        };
        Err(Error::Usage(format!("{name} {known}")))
    }

    /// The scene's own camera, or one that frames the scene with the requested field of view, overridden by these settings.
    fn over(&self, scene: &SceneDescription, up: Vec3) -> CameraSettings {
        let [width, height] = self.size;
        let framed = || {
            let usual = Framing::new(width as f32 / height as f32, up);
            let fov_y_degrees = match self.projection {
                Some(Projection::Perspective { fov_y_degrees }) => fov_y_degrees,
                _ => usual.fov_y_degrees,
            };
            let Self { view, all_around, .. } = *self;
            scene.framed(&Framing { view, fov_y_degrees, all_around, ..usual })
        };
        let own = scene.camera.filter(|_| self.view.is_none());
        let camera = own.unwrap_or_else(framed);
        CameraSettings {
            origin: self.origin.unwrap_or(camera.origin),
            target: self.target.unwrap_or(camera.target),
            up: self.up.unwrap_or(camera.up),
            projection: self.projection.unwrap_or(camera.projection),
        }
    }
}
