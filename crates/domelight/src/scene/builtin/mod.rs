//! Procedural scenes, for pictures and tests.
//!
//! Each serves one purpose: self-shadowing, roughness, a material, or a plain sphere that shows every
//! normal. [`BuiltinScene::environment`] is a suitable light.

pub(crate) mod material_ball;
pub(crate) mod room;
pub mod shapes;
pub(crate) mod statue;
mod surface_nets;

use std::fmt;

use super::camera::{CameraSettings, Projection};
use super::framing::ViewDirection;
use super::material::{Material, MaterialModel, MetallicRoughnessMaterial};
use super::{EnvironmentSettings, EnvironmentSource, Part, SceneDescription, UpAxis};
use crate::Rgb;
use crate::geometry::Mesh;
use crate::math::{Mat4, Vec3, vec3};
use crate::names::read_by_name;

/// Spheres in the row.
const SPHERES: usize = 7;
/// Radius of each.
const SPHERE_RADIUS: f32 = 0.5;
/// Distance between their centers.
const SPHERE_SPACING: f32 = 1.12;
/// Azimuth and elevation from which the row is seen \[degrees\]: along it, so that it fills pictures of any shape.
const SPHERES_VIEW: [f32; 2] = [-52.0, 16.0];
/// Roughness of the first; the last has 1.
const LEAST_ROUGHNESS: f32 = 0.1;
/// Radius of the floors.
const FLOOR_RADIUS: f32 = 100.0;

/// The parts that only set off the subject.
const SCENERY: [&str; 4] = ["floor", "plinth", "cradle", "walls"];

/// A procedural scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BuiltinScene {
    /// A pierced, fluted sculpture on a plinth, with strong self-shadowing.
    Statue,
    /// Seven metal spheres with increasing roughness on a floor.
    Spheres,
    /// A grooved ball in a cradle: curvature, edges and contact shadows.
    MaterialBall,
    /// A room with a table, lit through a window.
    Room,
    /// The unit sphere at the origin in perspective.
    Sphere,
    /// The unit sphere at the origin, filling an orthographic picture.
    SphereOrthographic,
}

impl BuiltinScene {
    /// All built-in scenes, in the order of their documentation.
    pub const ALL: [Self; 6] = [
        Self::Statue,
        Self::Spheres,
        Self::MaterialBall,
        Self::Room,
        Self::Sphere,
        Self::SphereOrthographic,
    ];

    /// The name that [`FromStr`](std::str::FromStr) reads.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Statue => "statue",
            Self::Spheres => "spheres",
            Self::MaterialBall => "material-ball",
            Self::Room => "room",
            Self::Sphere => "sphere",
            Self::SphereOrthographic => "sphere-orthographic",
        }
    }

    /// A one-line description for a list of scenes.
    pub const fn summary(self) -> &'static str {
        match self {
            Self::Statue => "pierced, fluted marble on a plinth, with strong self-shadowing",
            Self::Spheres => "seven metal spheres with increasing roughness on a floor",
            Self::MaterialBall => "grooved ball in a cradle: curvature, edges, contact shadows",
            Self::Room => "a table and a vase in a room, lit through a window",
            Self::Sphere => "a single diffuse sphere in perspective",
            Self::SphereOrthographic => "a single diffuse sphere that fills the picture",
        }
    }

    /// The name of the built-in probe that suits the scene best.
    pub const fn probe(self) -> &'static str {
        match self {
            Self::Statue | Self::Room => "sky",
            Self::Spheres | Self::MaterialBall => "studio",
            Self::Sphere | Self::SphereOrthographic => "cathedral",
        }
    }

    /// How far that probe is turned \[degrees\]: its key light comes over the camera's shoulder, or
    /// through the window.
    const fn probe_rotation(self) -> f32 {
        match self {
            Self::Statue => 125.0,
            Self::Room => 90.0,
            _ => 0.0,
        }
    }

    /// The suitable probe, rotated for the scene.
    pub fn environment(self) -> EnvironmentSettings {
        let source = EnvironmentSource::Builtin(self.probe().to_owned());
        let rotate_degrees = self.probe_rotation();
        EnvironmentSettings { rotate_degrees, ..EnvironmentSettings::new(source, UpAxis::Y) }
    }

    /// The description of the scene, with its camera or the view that frames it, and the suitable probe.
    pub fn description(self) -> SceneDescription {
        SceneDescription { environment: Some(self.environment()), ..self.geometry() }
    }

    fn geometry(self) -> SceneDescription {
        match self {
            Self::Statue => statue_scene(),
            Self::Spheres => spheres_scene(),
            Self::MaterialBall => material_ball_scene(),
            Self::Room => room_scene(),
            Self::Sphere => sphere_scene(camera(30.0, vec3(0.0, 0.0, 4.4), Vec3::ZERO)),
            Self::SphereOrthographic => sphere_scene(CameraSettings {
                projection: Projection::Orthographic { height: 2.0 },
                origin: vec3(0.0, 0.0, 4.0),
                target: Vec3::ZERO,
                up: Vec3::Y,
            }),
        }
    }
}

impl fmt::Display for BuiltinScene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

read_by_name!(BuiltinScene::ALL, UnknownScene, "there is no built-in scene");

fn statue_scene() -> SceneDescription {
    let mut figure = statue::figure();
    figure.transform(&Mat4::from_translation(statue::PLINTH_HEIGHT * Vec3::Y));
    let marble = glossy("marble", Rgb::new(0.76, 0.71, 0.64), 0.0, 0.42);
    let stone = Material::diffuse("stone", Rgb::new(0.33, 0.31, 0.29));
    scene(
        camera(26.0, vec3(7.2, 2.35, -2.6), vec3(0.0, 1.56, 0.0)),
        [("figure", figure, marble), ("plinth", statue::plinth(), stone), floor()],
    )
}

fn spheres_scene() -> SceneDescription {
    let sphere = shapes::icosphere(5);
    let balls = (0..SPHERES).map(|i| {
        let t = i as f32 / (SPHERES - 1) as f32;
        let x = SPHERE_SPACING * (i as f32 - 0.5 * (SPHERES - 1) as f32);
        let mut mesh = sphere.clone();
        mesh.transform(
            &(Mat4::from_translation(vec3(x, SPHERE_RADIUS, 0.0))
                * Mat4::from_scale(Vec3::splat(SPHERE_RADIUS))),
        );
        let roughness = LEAST_ROUGHNESS + (1.0 - LEAST_ROUGHNESS) * t;
        ("sphere", mesh, glossy("metal", Rgb::new(0.93, 0.88, 0.80), 1.0, roughness))
    });
    let view = ViewDirection::new(SPHERES_VIEW[0], SPHERES_VIEW[1]).ok();
    SceneDescription { view, ..scene(None, balls.chain([floor()])) }
}

fn material_ball_scene() -> SceneDescription {
    let glaze = glossy("glaze", Rgb::new(0.62, 0.15, 0.07), 0.0, 0.25);
    let steel = glossy("steel", Rgb::new(0.60, 0.58, 0.55), 1.0, 0.35);
    let stone = Material::diffuse("stone", Rgb::new(0.30, 0.30, 0.30));
    scene(
        camera(28.0, vec3(0.0, 3.0, 5.6), vec3(0.0, 1.02, 0.0)),
        [
            ("ball", material_ball::ball(), glaze),
            ("core", material_ball::core(), steel),
            ("cradle", material_ball::cradle(), stone),
            floor(),
        ],
    )
}

fn room_scene() -> SceneDescription {
    let plaster = Material::diffuse("plaster", Rgb::new(0.76, 0.74, 0.70));
    let planks = glossy("planks", Rgb::new(0.36, 0.22, 0.12), 0.0, 0.4);
    let oak = glossy("oak", Rgb::new(0.48, 0.33, 0.19), 0.0, 0.5);
    let glaze = glossy("glaze", Rgb::new(0.10, 0.22, 0.40), 0.0, 0.25);
    let description = scene(
        camera(60.0, vec3(-1.2, 1.5, 2.3), vec3(0.2, 1.0, -2.0)),
        [
            ("table", room::table(), oak),
            ("vase", room::vase(), glaze),
            ("walls", room::walls(), plaster),
            ("floor", room::floor(), planks),
        ],
    );
    SceneDescription { portals: room::window().into_iter().collect(), ..description }
}

fn sphere_scene(camera: CameraSettings) -> SceneDescription {
    let white = Material::diffuse("white", Rgb::splat(0.8));
    scene(camera, [("sphere", shapes::icosphere(5), white)])
}

/// A wide gray disc at y = 0.
fn floor() -> (&'static str, Mesh, Material) {
    let gray = Material::diffuse("floor", Rgb::new(0.42, 0.41, 0.40));
    ("floor", shapes::disc(FLOOR_RADIUS, 96), gray)
}

fn scene(
    camera: impl Into<Option<CameraSettings>>,
    things: impl IntoIterator<Item = (&'static str, Mesh, Material)>,
) -> SceneDescription {
    let mut description = SceneDescription {
        camera: camera.into(),
        up: Some(UpAxis::Y),
        ..SceneDescription::default()
    };
    for (name, mesh, material) in things {
        if SCENERY.contains(&name) {
            description.scenery.push(description.parts.len());
        }
        let part = Part { name: name.to_owned(), mesh, material: description.materials.len() };
        description.parts.push(part);
        description.materials.push(material);
    }
    description
}

fn camera(fov_y_degrees: f32, origin: Vec3, target: Vec3) -> CameraSettings {
    let projection = Projection::Perspective { fov_y_degrees };
    CameraSettings { projection, origin, target, up: Vec3::Y }
}

fn glossy(name: &str, base_color: Rgb, metallic: f32, roughness: f32) -> Material {
    let model = MetallicRoughnessMaterial {
        base_color,
        base_color_texture: None,
        metallic,
        roughness,
        metallic_roughness_texture: None,
    };
    Material::new(name, MaterialModel::MetallicRoughness(model))
}

#[cfg(test)]
mod tests;
