//! Scenes and cameras.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::PathBuf;
use std::str::FromStr as _;
use std::sync::Arc;

use domelight::environment::UpAxis;
use domelight::environment::io::ProbeOptions;
use domelight::geometry::{Aabb, Mesh};
use domelight::math::{DVec3, Vec2, Vec3};
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{
    self, AnimationTime, CameraError, CameraSettings, EnvironmentSettings, EnvironmentSource,
    Framing, Lens, LoadOptions, Material, NamedCamera, Part, Projection, SceneDescription,
};
use numpy::PyArrayDyn;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyFloat, PyString, PyTuple, PyType};

use crate::arrays::{Floats, array, hashable, indices, vector};
use crate::bsdf::MaterialLike;
use crate::engine::{abandonable, parallel};
use crate::environment::{Environment, builtin_map, load_map, up_axis, up_name};
use crate::error::{bad_value, from_source, to_python, warn};
use crate::lobe::PythonLobe;
use crate::recipe::{self, Recipe};

/// A camera. Omitted parts come from the scene's own camera, or from one that frames the scene. Cameras can be pickled and
/// compared.
///
/// Parameters
/// ----------
/// origin : array_like, shape (3,), optional
///     Position of the camera, or any point on the axis of an orthographic camera.
/// target : array_like, shape (3,), optional
///     A point that it looks at.
/// up : array_like, shape (3,), optional
///     A direction that points up in the picture.
/// fov : float, optional
///     Vertical field of view of a perspective camera, in (0, 180) [degrees].
/// ortho : float, optional
///     Height of an orthographic camera's picture in world units, positive.
/// shift : (float, float), default (0, 0)
///     Moves the picture across the image plane, to the right in widths of the picture and up in heights of it, as a
///     view camera does; verticals stay parallel.
/// aperture : float, optional
///     Radius of a thin lens in world units, ≥ 0; perspective cameras only.
/// focus_distance : float, optional
///     Distance along the axis at which the lens is sharp, positive; required with `aperture`.
/// blades : int, default 0
///     Number of aperture blades; fewer than 3 mean a round aperture.
#[pyclass(frozen, from_py_object, module = "domelight")]
#[derive(Clone, PartialEq)]
pub(crate) struct Camera {
    origin: Option<Vec3>,
    target: Option<Vec3>,
    up: Option<Vec3>,
    projection: Option<Projection>,
    shift: [f32; 2],
    lens: Option<Lens>,
}

impl Camera {
    /// The camera with the shift and the lens.
    fn through_lens(
        &self,
        camera: scene::Camera,
        settings: &CameraSettings,
        (width, height): (usize, usize),
    ) -> Result<scene::Camera, CameraError> {
        let [right, up] = self.shift;
        let camera = camera.shifted(right * width as f32, -up * height as f32);
        match (self.lens, settings.projection) {
            (None, _) => Ok(camera),
            (Some(lens), Projection::Perspective { .. }) => Ok(camera.with_lens(lens)),
            (Some(_), Projection::Orthographic { .. }) => Err(CameraError::NoLens),
        }
    }

    fn settings(&self, mut of_scene: CameraSettings) -> CameraSettings {
        of_scene.origin = self.origin.unwrap_or(of_scene.origin);
        of_scene.target = self.target.unwrap_or(of_scene.target);
        of_scene.up = self.up.unwrap_or(of_scene.up);
        of_scene.projection = self.projection.unwrap_or(of_scene.projection);
        of_scene
    }

    fn of(settings: CameraSettings) -> Self {
        let CameraSettings { projection, origin, target, up } = settings;
        let [origin, target, up] = [origin, target, up].map(Some);
        Self { origin, target, up, projection: Some(projection), shift: [0.0; 2], lens: None }
    }
}

#[pymethods]
impl Camera {
    #[new]
    #[pyo3(signature = (*, origin = None, target = None, up = None, fov = None, ortho = None, shift = [0.0, 0.0],
        aperture = None, focus_distance = None, blades = 0),
        text_signature = "(*, origin=None, target=None, up=None, fov=None, ortho=None, shift=(0.0, 0.0), aperture=None, focus_distance=None, blades=0)")]
    fn new(
        origin: Option<Bound<'_, PyAny>>,
        target: Option<Bound<'_, PyAny>>,
        up: Option<Bound<'_, PyAny>>,
        fov: Option<f32>,
        ortho: Option<f32>,
        shift: [f32; 2],
        aperture: Option<f32>,
        focus_distance: Option<f32>,
        blades: u32,
    ) -> PyResult<Self> {
        let projection = match (fov, ortho) {
            (Some(_), Some(_)) => return Err(bad_value("give fov or ortho, not both")),
            (Some(fov_y_degrees), None) => Some(Projection::Perspective { fov_y_degrees }),
            (None, Some(height)) => Some(Projection::Orthographic { height }),
            (None, None) => None,
        };
        let read =
            |name, value: Option<Bound<'_, PyAny>>| value.map(|v| vector(name, &v)).transpose();
        let (origin, target, up) =
            (read("origin", origin)?, read("target", target)?, read("up", up)?);
        if !shift.iter().all(|s| s.is_finite()) {
            let [x, y] = shift;
            return Err(bad_value(format!("shift is ({x}, {y}); it must be two finite numbers")));
        }
        let lens = lens(aperture, focus_distance, blades)?;
        Ok(Self { origin, target, up, projection, shift, lens })
    }

    /// ndarray, shape (3,), or None: position of the camera.
    #[getter]
    fn origin<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<f32>>>> {
        from_vector(py, self.origin)
    }

    /// ndarray, shape (3,), or None: a point that it looks at.
    #[getter]
    fn target<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<f32>>>> {
        from_vector(py, self.target)
    }

    /// ndarray, shape (3,), or None: a direction that points up in the picture.
    #[getter]
    fn up<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<f32>>>> {
        from_vector(py, self.up)
    }

    /// float or None: vertical field of view [degrees].
    #[getter]
    fn fov(&self) -> Option<f32> {
        match self.projection {
            Some(Projection::Perspective { fov_y_degrees }) => Some(fov_y_degrees),
            _ => None,
        }
    }

    /// float or None: height of an orthographic picture in world units.
    #[getter]
    fn ortho(&self) -> Option<f32> {
        match self.projection {
            Some(Projection::Orthographic { height }) => Some(height),
            _ => None,
        }
    }

    /// (float, float): shift of the picture to the right, in widths, and up, in heights.
    #[getter]
    fn shift(&self) -> (f32, f32) {
        self.shift.into()
    }

    /// float or None: radius of the lens in world units.
    #[getter]
    fn aperture(&self) -> Option<f32> {
        self.lens.map(|lens| lens.radius)
    }

    /// float or None: distance along the axis at which the lens is sharp.
    #[getter]
    fn focus_distance(&self) -> Option<f32> {
        self.lens.map(|lens| lens.focus_distance)
    }

    /// int: number of aperture blades.
    #[getter]
    fn blades(&self) -> u32 {
        self.lens.map_or(0, |lens| lens.blades)
    }

    fn __repr__(&self) -> String {
        let vector =
            |name: &str, v: Option<Vec3>| v.map(|v| format!("{name}=({}, {}, {})", v.x, v.y, v.z));
        let projection = self.projection.map(|p| match p {
            Projection::Perspective { fov_y_degrees } => format!("fov={fov_y_degrees}"),
            Projection::Orthographic { height } => format!("ortho={height}"),
        });
        let parts = [
            vector("origin", self.origin),
            vector("target", self.target),
            vector("up", self.up),
            projection,
            (self.shift != [0.0; 2])
                .then(|| format!("shift=({}, {})", self.shift[0], self.shift[1])),
            self.lens.map(|Lens { radius, focus_distance, blades }| {
                format!("aperture={radius}, focus_distance={focus_distance}, blades={blades}")
            }),
        ];
        format!("Camera({})", parts.into_iter().flatten().collect::<Vec<_>>().join(", "))
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| self == other.get())
    }

    fn __hash__(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        for v in [self.origin, self.target, self.up] {
            v.map(|v| v.to_array().map(hashable)).hash(&mut hasher);
        }
        self.shift.map(hashable).hash(&mut hasher);
        hasher.finish()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, PickledCamera)> {
        let this = slf.get();
        let [origin, target, up] = [this.origin, this.target, this.up].map(|v| v.map(Into::into));
        let lens = this.lens.map(|l| (l.radius, l.focus_distance, l.blades));
        let state = (origin, target, up, this.fov(), this.ortho(), this.shift, lens);
        Ok((slf.get_type().getattr("_restore")?, state))
    }

    #[classmethod]
    fn _restore(
        _cls: &Bound<'_, PyType>,
        origin: Option<[f32; 3]>,
        target: Option<[f32; 3]>,
        up: Option<[f32; 3]>,
        fov: Option<f32>,
        ortho: Option<f32>,
        shift: [f32; 2],
        lens: Option<(f32, f32, u32)>,
    ) -> Self {
        let [origin, target, up] = [origin, target, up].map(|v| v.map(Vec3::from));
        let perspective = fov.map(|fov_y_degrees| Projection::Perspective { fov_y_degrees });
        let projection =
            perspective.or_else(|| ortho.map(|height| Projection::Orthographic { height }));
        let lens =
            lens.map(|(radius, focus_distance, blades)| Lens { radius, focus_distance, blades });
        Self { origin, target, up, projection, shift, lens }
    }
}

/// The parts of a pickled camera: origin, target, up, field of view, height, shift, and aperture, distance and blades of the
/// lens.
type PickledCamera = (
    Option<[f32; 3]>,
    Option<[f32; 3]>,
    Option<[f32; 3]>,
    Option<f32>,
    Option<f32>,
    [f32; 2],
    Option<(f32, f32, u32)>,
);

/// The lens of an aperture and a focus distance.
fn lens(aperture: Option<f32>, focus_distance: Option<f32>, blades: u32) -> PyResult<Option<Lens>> {
    let Some(radius) = aperture else {
        return match focus_distance {
            None => Ok(None),
            Some(_) => Err(bad_value("focus_distance needs an aperture")),
        };
    };
    let focus_distance =
        focus_distance.ok_or_else(|| bad_value("aperture needs a focus_distance"))?;
    if !(radius >= 0.0 && radius.is_finite()) {
        return Err(bad_value(format!("aperture is {radius}; it must be finite and not negative")));
    }
    if !(focus_distance > 0.0 && focus_distance.is_finite()) {
        return Err(bad_value(format!(
            "focus_distance is {focus_distance}; it must be positive and finite"
        )));
    }
    Ok(Some(Lens { radius, focus_distance, blades }))
}

fn from_vector(py: Python<'_>, v: Option<Vec3>) -> PyResult<Option<Bound<'_, PyArrayDyn<f32>>>> {
    v.map(|v| array(py, v.to_array().to_vec(), &[3])).transpose()
}

/// A camera, or the name or number of one of the scene's cameras.
pub(crate) enum CameraLike {
    Camera(Camera),
    Number(usize),
    Name(String),
}

impl<'py> FromPyObject<'_, 'py> for CameraLike {
    type Error = PyErr;

    fn extract(value: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(camera) = value.cast::<Camera>() {
            return Ok(Self::Camera(camera.get().clone()));
        }
        if let Ok(number) = value.extract() {
            return Ok(Self::Number(number));
        }
        if let Ok(name) = value.extract() {
            return Ok(Self::Name(name));
        }
        Err(PyTypeError::new_err(format!(
            "{} is no camera; give a Camera, or the name or number of one of the scene's",
            value.repr()?
        )))
    }
}

/// A built scene, and the parts of its description that it lacks.
pub(crate) struct SceneData {
    pub(crate) scene: scene::Scene,
    pub(crate) name: String,
    camera: Option<CameraSettings>,
    cameras: Vec<NamedCamera>,
    subject: Aabb,
    /// What all coordinates are relative to.
    pub(crate) offset: DVec3,
    environment: Option<EnvironmentSettings>,
    up: UpAxis,
    /// Reflectance written in Python.
    pub(crate) lobes: Vec<&'static PythonLobe>,
    changes: Changes,
    recipe: Recipe,
}

/// What is done to a scene after it was described.
pub(crate) struct Changes {
    pub(crate) material: Option<MaterialLike>,
    pub(crate) ground: bool,
    pub(crate) normalize: bool,
}

impl Changes {
    /// The keywords of constructors.
    fn keywords<'py>(&self, py: Python<'py>) -> [(&'static str, Option<Bound<'py, PyAny>>); 3] {
        let set = |is: bool| is.then(|| PyBool::new(py, true).to_owned().into_any());
        [
            ("material", self.material.as_ref().map(|material| material.object(py))),
            ("ground", set(self.ground)),
            ("normalize", set(self.normalize)),
        ]
    }
}

impl SceneData {
    /// Whether rays, cameras and light find the same.
    fn is_same(&self, other: &Self) -> bool {
        let lobe = |lobe: &&'static PythonLobe| std::ptr::from_ref::<PythonLobe>(*lobe);
        let is_seen_alike = self.camera == other.camera
            && self.cameras == other.cameras
            && (self.up, self.offset) == (other.up, other.offset)
            && self.environment == other.environment
            && self.lobes.iter().map(lobe).eq(other.lobes.iter().map(lobe));
        std::ptr::eq(self, other)
            || is_seen_alike && self.scene.fingerprint() == other.scene.fingerprint()
    }

    /// What was done to the scene.
    pub(crate) fn changes(&self) -> &Changes {
        &self.changes
    }

    /// The camera of a picture, and its settings in the scene's own units.
    pub(crate) fn camera(
        &self,
        camera: Option<&CameraLike>,
        (width, height): (usize, usize),
        up: Vec3,
    ) -> PyResult<(scene::Camera, CameraSettings)> {
        let aspect = width as f32 / height as f32;
        let settings = self.camera_settings(camera, aspect, up)?;
        let pinhole = scene::Camera::new(&settings, width, height).map_err(to_python)?;
        let seen = match camera {
            Some(CameraLike::Camera(camera)) => {
                camera.through_lens(pinhole, &settings, (width, height)).map_err(to_python)?
            }
            None | Some(CameraLike::Number(_) | CameraLike::Name(_)) => pinhole,
        };
        Ok((seen, settings))
    }

    fn camera_settings(
        &self,
        camera: Option<&CameraLike>,
        aspect: f32,
        up: Vec3,
    ) -> PyResult<CameraSettings> {
        let framed = || self.scene.framed(&Framing::new(aspect, up));
        let own = || self.camera.unwrap_or_else(framed);
        let by_number = |i: usize| self.cameras.get(i).map(|camera| camera.settings);
        let by_name = |name: &str| self.cameras.iter().find(|c| c.name == name).map(|c| c.settings);
        let (found, asked) = match camera {
            None => return Ok(own()),
            Some(CameraLike::Camera(camera)) => return Ok(camera.settings(own())),
            Some(CameraLike::Number(i)) => (by_number(*i), i.to_string()),
            Some(CameraLike::Name(name)) => (by_name(name), format!("{name:?}")),
        };
        found.ok_or_else(|| {
            let names: Vec<_> = self.cameras.iter().map(|c| format!("{:?}", c.name)).collect();
            bad_value(format!(
                "{} has no camera {asked}; its cameras are [{}]",
                self.name,
                names.join(", ")
            ))
        })
    }
}

/// Meshes and materials, prepared for ray tracing. Scenes can be pickled and compared: they are equal if everything that rays
/// can hit is, and so are their cameras. A scene that was loaded is loaded again from its file.
///
/// Parameters
/// ----------
/// vertices : array_like, shape (V, 3)
///     Positions, finite.
/// faces : array_like of int, shape (F, 3)
///     Triangles as counterclockwise vertex indices.
/// normals : array_like, shape (V, 3), optional
///     Shading normals of any nonzero length; without them, shading is flat.
/// colors : array_like, shape (V, 3), optional
///     Linear vertex colors in [0, 1], for meshes without a material.
/// uvs : array_like, shape (V, 2), optional
///     Texture coordinates, which orient anisotropic materials.
/// material : Material, Bsdf or str, default 'diffuse:0.5'
///     The material of the mesh.
/// ground : bool, default False
///     Put a diffuse disk of reflectance 0.5 under the mesh.
/// normalize : bool, default False
///     Move the center of the bounds to the origin and scale the longest half-extent to 1.
/// up : {'y', 'z'}, default 'y'
///     The axis that points up.
/// name : str, default 'mesh'
///     The name of the scene in files and messages.
///
/// Raises
/// ------
/// ValueError
///     If an array has a wrong shape or type, an index is out of range, or a position is not finite.
#[pyclass(frozen, module = "domelight")]
pub(crate) struct Scene {
    pub(crate) inner: Arc<SceneData>,
}

/// The reflectance of meshes without a material.
const DEFAULT_REFLECTANCE: f32 = 0.5;

impl Scene {
    fn build(
        py: Python<'_>,
        name: String,
        mut description: SceneDescription,
        changes: Changes,
        recipe: Recipe,
    ) -> PyResult<Self> {
        let mut lobes = Vec::new();
        if changes.normalize {
            description.normalize();
        }
        if let Some(material) = &changes.material {
            let (bsdf, lobe) = material.bsdf(py)?;
            description.set_subject_material(bsdf);
            lobes.extend(lobe);
        }
        let up = description.up.unwrap_or_default();
        let subject = description.subject_bounds();
        // Squares of lengths must be finite.
        let extent = subject.size().max_element();
        if extent > 1e18 || extent > 0.0 && extent < 1e-18 {
            return Err(bad_value(format!(
                "{name}: the scene is {extent:e} across; it must be from 1e-18 to 1e18"
            )));
        }
        if changes.ground {
            description.add_ground(up.vector());
        }
        let (camera, cameras) = (description.camera, description.cameras.clone());
        let offset = description.offset;
        let environment = description.environment.clone();
        let built = abandonable(py, move || scene::Scene::new(description))?;
        let scene = built.map_err(|error| bad_value(format!("{name}: {error}")))?;
        let data = SceneData {
            scene,
            name,
            camera,
            cameras,
            subject,
            offset,
            environment,
            up,
            lobes,
            changes,
            recipe,
        };
        Ok(Self { inner: Arc::new(data) })
    }
}

#[pymethods]
impl Scene {
    #[new]
    #[pyo3(signature = (vertices, faces, *, normals = None, colors = None, uvs = None, material = None,
        ground = false, normalize = false, up = "y", name = "mesh"))]
    fn new(
        vertices: &Bound<'_, PyAny>,
        faces: &Bound<'_, PyAny>,
        normals: Option<Bound<'_, PyAny>>,
        colors: Option<Bound<'_, PyAny>>,
        uvs: Option<Bound<'_, PyAny>>,
        material: Option<MaterialLike>,
        ground: bool,
        normalize: bool,
        up: &str,
        name: &str,
    ) -> PyResult<Self> {
        let py = vertices.py();
        let changes = Changes { material, ground, normalize };
        // Copies, because arrays can be changed.
        let given = [
            ("normals", normals.as_ref().map(copied).transpose()?),
            ("colors", colors.as_ref().map(copied).transpose()?),
            ("uvs", uvs.as_ref().map(copied).transpose()?),
            ("up", Some(PyString::new(py, up).into_any())),
            ("name", Some(PyString::new(py, name).into_any())),
        ];
        let keywords = recipe::keywords(py, given.into_iter().chain(changes.keywords(py)))?;
        let arguments = PyTuple::new(py, [copied(vertices)?, copied(faces)?])?;
        let recipe = Recipe::new(None, &arguments, &keywords);
        let vertices = Floats::new("vertices", vertices)?;
        vertices.require_finite()?;
        let Ok((positions, &[n])) = vertices.rows::<3>() else {
            return Err(vertices.bad_shape("(V, 3)"));
        };
        let positions: Vec<Vec3> = positions.iter().map(|&p| p.into()).collect();
        let (corners, shape) = indices("faces", faces, n)?;
        let triangles = match shape[..] {
            [_, 3] => corners.as_chunks::<3>().0.to_vec(),
            // An empty list is a mesh without faces.
            [0] => Vec::new(),
            _ => {
                let shape = crate::arrays::shape_text(&shape);
                return Err(bad_value(format!("faces has shape {shape}; it must be (F, 3)")));
            }
        };
        let normals =
            normals.map(|v| attribute::<3>("normals", &v, n)).transpose()?.unwrap_or_default();
        let normals = normals.into_iter().map(Vec3::from).enumerate().map(|(i, v)| {
            v.try_normalize()
                .ok_or_else(|| bad_value(format!("normals[{i}] is {v}; it must have a length")))
        });
        let normals = normals.collect::<PyResult<Vec<_>>>()?;
        let colors =
            colors.map(|v| attribute::<3>("colors", &v, n)).transpose()?.unwrap_or_default();
        if let Some(i) = colors.iter().position(|c| c.iter().any(|c| !(0.0..=1.0).contains(c))) {
            return Err(bad_value(format!(
                "colors[{i}] is {:?}; it must lie in [0, 1]",
                colors[i]
            )));
        }
        let uvs = uvs.map(|v| attribute::<2>("uvs", &v, n)).transpose()?.unwrap_or_default();
        let mesh = Mesh {
            positions,
            normals,
            uvs: uvs.into_iter().map(Vec2::from).collect(),
            colors: colors.into_iter().map(domelight::Rgb::from).collect(),
            triangles,
            ..Mesh::default()
        };
        let base = if mesh.colors.is_empty() { DEFAULT_REFLECTANCE } else { 1.0 };
        let description = SceneDescription {
            parts: vec![Part { name: "mesh".to_owned(), mesh, material: 0 }],
            materials: vec![Material::diffuse("mesh", domelight::Rgb::splat(base))],
            up: Some(up_axis(up)?),
            ..SceneDescription::default()
        };
        Self::build(py, name.to_owned(), description, changes, recipe)
    }

    /// Load a mesh or a scene file: .ply, .obj, .stl, .off, .gltf, .glb or .toml.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     The file.
    /// material : Material, Bsdf or str, optional
    ///     Replaces the file's materials, except for floors and plinths.
    /// ground, normalize
    ///     As in the class.
    /// scene : str, optional
    ///     The scene of a glTF file with several, by name or number from 0.
    /// animation : str, optional
    ///     An animation of a glTF file, by name or number from 0; at rest by default.
    /// at : float, default 0
    ///     The time in the animation [s].
    /// strict : bool, default False
    ///     Raise an error for unsupported parts instead of warning.
    /// up : {'y', 'z'}, optional
    ///     The axis that points up, if the file is wrong or does not specify it.
    ///
    /// Raises
    /// ------
    /// OSError
    ///     If a file cannot be read.
    /// ValueError
    ///     If it is damaged; the message names the place.
    ///
    /// Warns
    /// -----
    /// DomelightWarning
    ///     For parts that the picture will lack.
    #[classmethod]
    #[pyo3(signature = (path, *, material = None, ground = false, normalize = false, scene = None,
        animation = None, at = 0.0, strict = false, up = None))]
    fn load(
        cls: &Bound<'_, PyType>,
        path: PathBuf,
        material: Option<MaterialLike>,
        ground: bool,
        normalize: bool,
        scene: Option<String>,
        animation: Option<String>,
        at: f32,
        strict: bool,
        up: Option<&str>,
    ) -> PyResult<Self> {
        let py = cls.py();
        if !at.is_finite() {
            return Err(bad_value(format!("at is {at}; it must be finite")));
        }
        let changes = Changes { material, ground, normalize };
        let text = |text: &str| PyString::new(py, text).into_any();
        let given = [
            ("scene", scene.as_deref().map(text)),
            ("animation", animation.as_deref().map(text)),
            ("at", Some(PyFloat::new(py, f64::from(at)).into_any())),
            ("strict", Some(PyBool::new(py, strict).to_owned().into_any())),
            ("up", up.map(text)),
        ];
        let keywords = recipe::keywords(py, given.into_iter().chain(changes.keywords(py)))?;
        let arguments = PyTuple::new(py, [path.as_os_str()])?;
        let recipe = Recipe::new(Some("load"), &arguments, &keywords);
        let animation = animation.map(|name| AnimationTime { name, seconds: at });
        let options = LoadOptions { strict, scene, animation, ..LoadOptions::default() };
        let loaded = parallel(py, || scene::load_with(&path, &options))?.map_err(to_python)?;
        warn(py, &loaded.warnings)?;
        let mut description = loaded.description;
        if let Some(up) = up {
            description.up = Some(up_axis(up)?);
        }
        Self::build(py, path.display().to_string(), description, changes, recipe)
    }

    /// Create a built-in scene: 'statue', 'spheres', 'material-ball', 'room', 'sphere' or 'sphere-orthographic'.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     The name of the scene.
    /// material, ground, normalize
    ///     As in `load`.
    #[classmethod]
    #[pyo3(signature = (name, *, material = None, ground = false, normalize = false))]
    fn builtin(
        cls: &Bound<'_, PyType>,
        name: &str,
        material: Option<MaterialLike>,
        ground: bool,
        normalize: bool,
    ) -> PyResult<Self> {
        let py = cls.py();
        let builtin = BuiltinScene::from_str(name).map_err(|e| from_source(&e))?;
        let description = parallel(py, || builtin.description())?;
        let changes = Changes { material, ground, normalize };
        let keywords = recipe::keywords(py, changes.keywords(py))?;
        let recipe = Recipe::new(Some("builtin"), &PyTuple::new(py, [name])?, &keywords);
        Self::build(py, name.to_owned(), description, changes, recipe)
    }

    /// str: the name of the scene.
    #[getter]
    fn name(&self) -> &str {
        &self.inner.name
    }

    /// int: triangles of all meshes.
    #[getter]
    fn n_triangles(&self) -> usize {
        self.inner.scene.triangle_count()
    }

    /// ndarray, shape (2, 3), or None: minimum and maximum coordinates of the part that the camera frames.
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<f32>>>> {
        let Aabb { min, max } = self.inner.subject;
        if self.inner.subject.is_empty() {
            return Ok(None);
        }
        array(py, [min.to_array(), max.to_array()].concat(), &[2, 3]).map(Some)
    }

    /// tuple of float: the point of the file that `bounds` and cameras are relative to, for scenes at large coordinates such
    /// as UTM; otherwise 0.
    #[getter]
    fn offset(&self) -> (f64, f64, f64) {
        self.inner.offset.into()
    }

    /// str: the axis that points up, 'y' or 'z'.
    #[getter]
    fn up(&self) -> &'static str {
        up_name(self.inner.up)
    }

    /// list of str: the names of the file's cameras.
    #[getter]
    fn cameras(&self) -> Vec<&str> {
        self.inner.cameras.iter().map(|camera| camera.name.as_str()).collect()
    }

    /// Return the scene's own camera, or one that frames the scene in a picture of this aspect ratio.
    ///
    /// Parameters
    /// ----------
    /// aspect : float, default 1
    ///     Width / height.
    #[pyo3(signature = (aspect = 1.0))]
    fn camera(&self, aspect: f32) -> PyResult<Camera> {
        if !(aspect.is_finite() && aspect > 0.0) {
            return Err(bad_value(format!("aspect is {aspect}; it must be positive and finite")));
        }
        let up = self.inner.up.vector();
        Ok(Camera::of(self.inner.camera_settings(None, aspect, up)?))
    }

    /// Return the environment named by the scene, otherwise the built-in sky.
    ///
    /// Parameters
    /// ----------
    /// rows : int, default 1024
    ///     Rows of a built-in probe.
    #[pyo3(signature = (rows = 1024))]
    pub(crate) fn environment(&self, py: Python<'_>, rows: usize) -> PyResult<Environment> {
        let sky = || {
            let source = EnvironmentSource::Builtin("sky".to_owned());
            EnvironmentSettings::new(source, self.inner.up)
        };
        let settings = self.inner.environment.clone().unwrap_or_else(sky);
        let (map, name) = match &settings.source {
            EnvironmentSource::Builtin(name) => (builtin_map(py, name, rows), name.clone()),
            EnvironmentSource::File(path) => {
                (load_map(py, path.clone(), ProbeOptions::default()), path.display().to_string())
            }
        };
        // Name the line of the scene file that asks for the map.
        let located = |error: PyErr| match &settings.referrer {
            Some(referrer) => {
                let text = format!("{referrer}: {}", error.value(py));
                PyErr::from_type(error.get_type(py), text)
            }
            None => error,
        };
        let map = map.map_err(located)?;
        let orientation = settings.orientation();
        let scale = settings.factor().map_err(to_python)?;
        Environment::build(py, map, orientation, scale, name)
    }

    fn __repr__(&self) -> String {
        format!("<Scene {:?}: {} triangles>", self.inner.name, self.n_triangles())
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> PyResult<bool> {
        let Ok(other) = other.cast::<Self>() else { return Ok(false) };
        let (a, b) = (&*self.inner, &*other.get().inner);
        parallel(other.py(), || a.is_same(b))
    }

    fn __hash__(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        self.n_triangles().hash(&mut hasher);
        hasher.finish()
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        slf.get().inner.recipe.reduce(&slf.get_type())
    }
}

/// A copy of what is like an array.
fn copied<'py>(array: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    array.py().import("numpy")?.call_method1("array", (array,))
}

/// An attribute of each vertex, finite.
fn attribute<const K: usize>(
    name: &'static str,
    value: &Bound<'_, PyAny>,
    n: usize,
) -> PyResult<Vec<[f32; K]>> {
    let floats = Floats::new(name, value)?;
    floats.require_finite()?;
    match floats.rows::<K>() {
        Ok((rows, &[found])) if found == n => Ok(rows.to_vec()),
        _ => Err(floats.bad_shape(&format!("({n}, {K}), a row for each vertex"))),
    }
}
