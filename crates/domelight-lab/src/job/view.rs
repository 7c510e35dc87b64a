//! The view: the size of the picture and the camera.

use clap::Args;
use domelight::math::Vec3;
use domelight::scene::{
    CameraSettings, Framing, NamedCamera, Projection, SceneDescription, ViewDirection,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::defaults;
use super::value::{NotNegative, Size, Text, Triple};
use crate::Error;
use crate::depth_of_field::DepthOfField;

/// The view. What is not said comes from the scene's camera, or else from one that frames the scene.
#[derive(Args, Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[command(next_help_heading = "Camera")]
#[serde(default, deny_unknown_fields)]
pub struct View {
    /// Width and height of the picture
    #[arg(id = "view.size", long = "size", value_name = "WxH", default_value = "640x640")]
    pub size: Text<Size>,
    /// Camera of the scene, by name or by number from 0 [default: the first]
    #[arg(id = "view.camera", long = "camera", value_name = "NAME|N")]
    pub camera: Option<String>,
    /// Frame the subject from front, back, left, right, top, bottom, three-quarter, or from an azimuth (90 is its
    /// right) and an elevation [degrees], such as 30,15 [default: the scene's camera, otherwise 0,20]
    #[arg(id = "view.from", long = "view", value_name = "VIEW|AZ,EL", allow_hyphen_values = true,
          conflicts_with_all = ["view.camera", "view.origin"])]
    pub from: Option<Text<ViewDirection>>,
    /// Position of the camera, in the coordinates of the scene's file [default: frames the scene]
    #[arg(id = "view.origin", long = "origin", value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub origin: Option<Text<Triple>>,
    /// Point at which the camera looks
    #[arg(id = "view.target", long = "target", value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub target: Option<Text<Triple>>,
    /// Direction that points up in the picture
    #[arg(id = "view.up", long = "up", value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub up: Option<Text<Triple>>,
    /// Vertical field of view [degrees]
    #[arg(id = "view.fov", long = "fov", value_name = "DEG", conflicts_with = "view.ortho")]
    pub fov: Option<NotNegative>,
    /// Use an orthographic camera; HEIGHT is the height of the picture in world units
    #[arg(id = "view.ortho", long = "ortho", value_name = "HEIGHT")]
    pub ortho: Option<NotNegative>,
    /// Depth of field: the f-number of a full-frame camera (world units are meters), the focus distance or auto (the
    /// subject's center), and the number of aperture blades [default: a round aperture], such as 2.8,auto or 1.4,3.5,6
    #[arg(
        id = "view.dof",
        long = "dof",
        value_name = "F,DIST[,BLADES]",
        conflicts_with = "view.ortho"
    )]
    pub dof: Option<Text<DepthOfField>>,
    /// Whether a framed camera keeps the subject in the picture while it goes around it.
    #[arg(skip)]
    #[serde(skip)]
    pub all_around: bool,
}

impl Default for View {
    fn default() -> Self {
        defaults()
    }
}

impl View {
    /// Perspective or orthographic, if one was asked for.
    fn projection(&self) -> Option<Projection> {
        let perspective = self.fov.map(|fov| Projection::Perspective { fov_y_degrees: fov.get() });
        let orthographic =
            self.ortho.map(|height| Projection::Orthographic { height: height.get() });
        orthographic.or(perspective)
    }

    /// Makes the requested camera the scene's.
    pub(crate) fn choose(&self, name: &str, scene: &mut SceneDescription) -> Result<(), Error> {
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
    pub(crate) fn over(&self, scene: &SceneDescription, up: Vec3) -> CameraSettings {
        let Text(Size { width, height }) = self.size;
        let projection = self.projection();
        let framed = || {
            let usual = Framing::new(width as f32 / height as f32, up);
            let fov_y_degrees = match projection {
                Some(Projection::Perspective { fov_y_degrees }) => fov_y_degrees,
                _ => usual.fov_y_degrees,
            };
            let view = self.from.map(|Text(view)| view);
            let all_around = self.all_around;
            scene.framed(&Framing { view, fov_y_degrees, all_around, ..usual })
        };
        let own = scene.camera.filter(|_| self.from.is_none());
        let camera = own.unwrap_or_else(framed);
        let relative = |Text(Triple(point)): Text<Triple>| (point - scene.offset).as_vec3();
        CameraSettings {
            origin: self.origin.map_or(camera.origin, relative),
            target: self.target.map_or(camera.target, relative),
            up: self.up.map_or(camera.up, |Text(Triple(up))| up.as_vec3()),
            projection: projection.unwrap_or(camera.projection),
        }
    }
}
