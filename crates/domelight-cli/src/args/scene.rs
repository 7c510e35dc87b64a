//! Arguments for the scene, the environment and the camera.

use clap::{Args, ValueEnum};
use domelight::environment::UpAxis;
use domelight::environment::mapping::Mapping;
use domelight::scene::ViewDirection;

use super::{finite, mapping};
use crate::parse::{Rotation, Size, Triple, not_negative};
use domelight_lab::scene::{BUILTIN_ROWS, DepthOfField, NamedMaterial};

/// A scene, its light and a camera, for every command that renders.
#[derive(Args, Debug)]
pub(crate) struct SceneArguments {
    /// A built-in scene (statue, spheres, material-ball, room, …), a mesh (.ply, .obj, .stl, .off,
    /// .gltf, .glb) or a scene file (.toml)
    #[arg(default_value = "statue")]
    pub(crate) scene: String,

    #[command(flatten)]
    pub(crate) file: FileArguments,
    #[command(flatten)]
    pub(crate) environment: EnvironmentArguments,
    #[command(flatten)]
    pub(crate) camera: CameraArguments,
    #[command(flatten)]
    pub(crate) subject: SubjectArguments,
}

/// Which parts of a file to show.
#[derive(Args, Debug, Default)]
#[command(next_help_heading = "Scene file")]
pub(crate) struct FileArguments {
    /// Scene of a glTF file, by name or by number from 0 [default: the file's default scene]
    #[arg(long = "scene", id = "file_scene", value_name = "NAME|N")]
    pub(crate) scene: Option<String>,
    /// Animation of a glTF file, by name or by number from 0 [default: none, the rest pose]
    #[arg(long, value_name = "NAME|N")]
    pub(crate) animation: Option<String>,
    /// Time in the animation [seconds]
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, value_parser = finite,
          allow_negative_numbers = true, requires = "animation")]
    pub(crate) at: f32,
}

#[derive(Args, Debug)]
#[command(next_help_heading = "Environment")]
pub(crate) struct EnvironmentArguments {
    /// A built-in probe (sky, studio, cathedral, constant) or a file (.hdr, .exr, .pfm, .png, .jpg;
    /// - reads standard input) [default: the scene's, otherwise sky]
    #[arg(long, value_name = "PROBE")]
    pub(crate) env: Option<String>,
    /// Rotate the environment about the up axis, counterclockwise as seen from above [degrees]; with a
    /// camera, auto puts its sun or brightest side to the left of it
    #[arg(long, value_name = "DEG|auto", allow_negative_numbers = true)]
    pub(crate) env_rotate: Option<Rotation>,
    /// Multiply the environment's radiance
    #[arg(long, value_name = "X", value_parser = not_negative, allow_negative_numbers = true)]
    pub(crate) env_scale: Option<f32>,
    /// Multiply the environment's radiance by 2^EV
    #[arg(long, value_name = "EV", value_parser = finite, allow_negative_numbers = true)]
    pub(crate) env_exposure: Option<f32>,
    /// World axis toward which the top of the map points
    #[arg(long, value_enum, value_name = "AXIS")]
    pub(crate) env_up: Option<Up>,
    /// Layout of the map [default: inferred from the shape and the attributes of the file]
    #[arg(long, value_name = "MAPPING", value_parser = mapping())]
    pub(crate) env_mapping: Option<Mapping>,
    /// Layer of an OpenEXR map
    #[arg(long, value_name = "NAME")]
    pub(crate) env_layer: Option<String>,
    /// Number of rows of a built-in probe
    #[arg(long, value_name = "ROWS", default_value_t = BUILTIN_ROWS,
          value_parser = clap::value_parser!(u32).range(1..=16_384))]
    pub(crate) env_rows: u32,
    /// Refuse input that is otherwise repaired or skipped with a warning: negative, NaN and infinite texels, non-finite
    /// vertices, images and material libraries that cannot be read, and unknown extensions that a glTF file requires
    #[arg(long)]
    pub(crate) strict: bool,
    /// The behavior without --strict; kept for existing scripts.
    #[arg(long, hide = true, conflicts_with = "strict")]
    pub(crate) sanitize: bool,
}

#[derive(Args, Debug)]
#[command(next_help_heading = "Camera")]
pub(crate) struct CameraArguments {
    /// Picture size
    #[arg(long, value_name = "WxH", default_value = "640x640")]
    pub(crate) size: Size,
    /// Camera of the scene, by name or by number from 0 [default: the first]
    #[arg(long, value_name = "NAME|N")]
    pub(crate) camera: Option<String>,
    /// Frame the subject from front, back, left, right, top, bottom, three-quarter, or from an azimuth (90 is its
    /// right) and an elevation [degrees], such as 30,15 [default: the scene's camera, otherwise 0,20]
    #[arg(long, value_name = "VIEW|AZ,EL", allow_hyphen_values = true, conflicts_with_all = ["camera", "origin"])]
    pub(crate) view: Option<ViewDirection>,
    /// Position of the camera [default: frames the scene]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(crate) origin: Option<Triple>,
    /// Point at which the camera looks
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(crate) target: Option<Triple>,
    /// Direction that points up in the picture
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(crate) up: Option<Triple>,
    /// Vertical field of view [degrees]
    #[arg(long, value_name = "DEG", value_parser = not_negative, allow_negative_numbers = true, conflicts_with = "ortho")]
    pub(crate) fov: Option<f32>,
    /// Use an orthographic camera; HEIGHT is the height of the picture in world units
    #[arg(long, value_name = "HEIGHT", value_parser = not_negative, allow_negative_numbers = true)]
    pub(crate) ortho: Option<f32>,
    /// Depth of field: the f-number of a full-frame camera (world units are meters), the focus distance or auto (the
    /// subject's center), and the number of aperture blades [default: a round aperture], such as 2.8,auto or 1.4,3.5,6
    #[arg(long, value_name = "F,DIST[,BLADES]", conflicts_with = "ortho")]
    pub(crate) dof: Option<DepthOfField>,
}

#[derive(Args, Debug)]
#[command(next_help_heading = "Scene")]
pub(crate) struct SubjectArguments {
    /// Material of the subject: diffuse:0.8, phong:50:1:0.5, ward:0.15:0.5, ggx:0.2, mix, …
    #[arg(long, value_name = "M")]
    pub(crate) material: Option<NamedMaterial>,
    /// Move and scale the scene: center of the bounds to 0, longest half-extent to 1
    #[arg(long)]
    pub(crate) normalize: bool,
    /// Put ground under the subject: plate, a diffuse plate (reflectance 0.5) that fades out toward its rim, or
    /// shadow, a shadow catcher that shows only shadows, on the environment or, with --hide-env, in alpha
    #[arg(long, value_enum, value_name = "KIND", num_args = 0..=1, default_missing_value = "plate")]
    pub(crate) ground: Option<GroundName>,
    /// Hide the environment behind the scene: pixels without a surface are transparent
    #[arg(long)]
    pub(crate) hide_env: bool,
}

/// The ground under a subject.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum GroundName {
    /// A diffuse plate that fades out toward its rim
    Plate,
    /// Only shadows
    Shadow,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Up {
    /// +Y
    Y,
    /// +Z
    Z,
}

impl From<Up> for UpAxis {
    fn from(up: Up) -> Self {
        match up {
            Up::Y => Self::Y,
            Up::Z => Self::Z,
        }
    }
}
