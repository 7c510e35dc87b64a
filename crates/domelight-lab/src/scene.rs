//! Turns the user's settings for a scene, its light and its view into a renderable scene.

use std::str::FromStr as _;

use domelight::RgbImage;
use domelight::environment::{Environment, key_light_rotation};
use domelight::math::Vec3;
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{
    Camera, CameraSettings, EnvironmentSettings, Framing, Lens, Projection, Scene, SceneDescription,
};

pub use crate::depth_of_field::{BadDepthOfField, DepthOfField};
pub use crate::ground::Ground;
use crate::job::value::{Choice, Rotation, Size, Text};
use crate::job::{SceneSettings, load_scene, probe_name};
use crate::names::file_name;
use crate::report::{CameraReport, EnvironmentReport, SceneReport};
use crate::{At as _, Error, Host};

/// Memory per triangle \[bytes\] of the BVH and its construction.
pub const TRIANGLE: u64 = 140;

/// A loaded scene, changed according to the settings but not yet built.
#[derive(Debug)]
pub struct LoadedScene {
    /// Geometry and materials.
    pub description: SceneDescription,
    /// The use of the map.
    pub light: EnvironmentSettings,
    /// The map, lat-long.
    pub map: RgbImage,
    /// The camera, in the coordinates of the description.
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
    /// The view, in the coordinates of the description, as `camera`.
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
            let light = self.light.over(&of_scene);
            let map = || self.light.load(&light, host);
            let (description, map) = rayon::join(|| scene.description(), map);
            (description, light, map?, Vec::new())
        } else {
            let strict = self.light.strict;
            let (description, warnings) = load_scene(&self.scene, &self.file, strict, host)?;
            let light = self.light.over(&description);
            let map = self.light.load(&light, host)?;
            (description, light, map, warnings)
        };
        self.view.choose(&self.scene, &mut description)?;
        let camera = self.frame(&mut description, light.up.vector())?;
        if self.light.rotate == Some(Text(Rotation::Auto)) {
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
        let Text(Size { width, height }) = settings.view.size;
        let dof = settings.view.dof.map(|Text(dof)| dof.focused(&camera, &description));
        let lens = dof.map(|(dof, focus)| dof.lens(&camera, focus)).transpose()?;
        let focused =
            |(dof, focus): (DepthOfField, f32)| DepthOfField { focus_distance: Some(focus), ..dof };
        let camera_report = CameraReport::new(&camera, description.offset, dof.map(focused));
        let (camera, camera_settings) = (Camera::new(&camera, width, height)?, camera);
        let camera = through(camera, lens);
        let n_triangles = description.built_triangle_count();
        let tree = format!("{}: a BVH over {n_triangles} triangles", settings.scene);
        host.take_memory(&tree, TRIANGLE * n_triangles as u64)?;
        let scene = Scene::new(description).at(&settings.scene)?;
        let probe = probe_name(&light.source);
        let environment = light.environment(map).at(&probe)?;
        if environment.power() == 0.0 {
            host.warn(&format!("{probe}: gives no light: the map is black, or --env-scale is 0"));
        }
        let report = SceneReport {
            scene: file_name(&settings.scene),
            triangles: scene.triangle_count(),
            warnings,
            material: settings.subject.material.map(|Text(material)| material.text),
            normalize: settings.subject.normalize,
            ground: settings.subject.ground.map(|Choice(ground)| ground),
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
