//! What was rendered, in words and numbers.

use domelight::environment::Environment;
use domelight::math::{DVec3, Vec3};
use domelight::scene::{CameraSettings, EnvironmentSettings, Projection};
use serde::Serialize;

use crate::depth_of_field::DepthOfField;
use crate::ground::Ground;
use crate::names::display_name;

/// A scene under its light, seen by a camera.
#[derive(Clone, Debug, Serialize)]
pub struct SceneReport {
    /// A built-in scene, or a file's name without its folder.
    pub scene: String,
    /// The number of triangles.
    pub triangles: usize,
    /// What the picture lacks of the file, one sentence each.
    pub warnings: Vec<String>,
    /// What the subject is made of instead of its own material.
    pub material: Option<String>,
    /// The scene was moved and scaled to the unit cube.
    pub normalize: bool,
    /// What was put under the subject.
    pub ground: Option<Ground>,
    /// The background is left out.
    pub hide_env: bool,
    /// The light.
    pub environment: EnvironmentReport,
    /// The view.
    pub camera: CameraReport,
    /// Width and height \[pixels\].
    pub size: [usize; 2],
}

/// The light of a render.
#[derive(Clone, Debug, Serialize)]
pub struct EnvironmentReport {
    probe: String,
    size: [usize; 2],
    rotate: f32,
    scale: f32,
    exposure: f32,
    up: &'static str,
}

impl SceneReport {
    /// What the pictures show, in a few words.
    pub fn title(&self) -> String {
        let [scene, probe] = [&self.scene, &self.environment.probe].map(|name| display_name(name));
        format!("{scene} under {probe}")
    }
}

impl EnvironmentReport {
    /// A built-in probe, or a file's name without its folder.
    pub fn probe(&self) -> &str {
        &self.probe
    }

    /// The turn about the up axis, counterclockwise seen from above \[degrees\].
    pub fn rotate(&self) -> f32 {
        self.rotate
    }

    /// The report of a probe with this name, without folders, used as `light` says.
    pub fn new(probe: String, light: &EnvironmentSettings, environment: &Environment) -> Self {
        Self {
            probe,
            size: [environment.map().width, environment.map().height],
            rotate: light.rotate_degrees,
            scale: light.scale,
            exposure: light.exposure,
            up: light.up.name(),
        }
    }
}

/// The view of a render; one of `fov` and `ortho` is null.
#[derive(Clone, Debug, Serialize)]
pub struct CameraReport {
    origin: Point,
    target: Point,
    up: [f32; 3],
    fov: Option<f32>,
    ortho: Option<f32>,
    /// What the lens blurs.
    #[serde(skip_serializing_if = "Option::is_none")]
    dof: Option<DepthOfField>,
}

/// A point in the coordinates of the file.
#[derive(Clone, Copy, Debug, Serialize)]
#[serde(untagged)]
enum Point {
    Near([f32; 3]),
    /// Beyond single precision.
    Far([f64; 3]),
}

impl Point {
    fn new(point: Vec3, offset: DVec3) -> Self {
        if offset == DVec3::ZERO {
            Self::Near(point.to_array())
        } else {
            Self::Far((point.as_dvec3() + offset).to_array())
        }
    }
}

impl CameraReport {
    /// The report of a camera and of what its lens blurs, in the coordinates of the scene's file: `offset` is that of the
    /// [description](domelight::scene::SceneDescription::offset).
    pub fn new(view: &CameraSettings, offset: DVec3, dof: Option<DepthOfField>) -> Self {
        let (fov, ortho) = match view.projection {
            Projection::Perspective { fov_y_degrees } => (Some(fov_y_degrees), None),
            Projection::Orthographic { height } => (None, Some(height)),
        };
        let [origin, target] = [view.origin, view.target].map(|point| Point::new(point, offset));
        Self { origin, target, up: view.up.to_array(), fov, ortho, dof }
    }
}
