//! Scenes.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::PathBuf;
use std::str::FromStr as _;
use std::sync::Arc;

use domelight::environment::UpAxis;
use domelight::geometry::{Aabb, Mesh};
use domelight::math::{DVec3, Vec2, Vec3};
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{
    self, CameraSettings, EnvironmentSettings, Framing, Material, NamedCamera, Part,
    SceneDescription,
};
use domelight_lab::job::{Job, Light, Subject};
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict as _, PyDict, PyString, PyTuple, PyType};

use crate::arrays::{Floats, array, indices};
use crate::bsdf::MaterialLike;
use crate::camera::{self, CameraLike};
use crate::engine::{abandonable, parallel};
use crate::environment::{Environment, up_axis, with_warnings};
use crate::error::{bad_value, from_source, to_python};
use crate::lobe::PythonLobe;
use crate::options;
use crate::recipe::{self, Recipe};

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
    pub(crate) subject: Subject,
}

/// The options of constructors.
const CHANGES: [&str; 3] = ["subject.portal", "subject.normalize", "subject.ground"];

/// The options of files.
const OF_FILES: [&str; 4] = ["file.scene", "file.animation", "file.at", "light.strict"];

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
/// ground : bool or {'plate', 'shadow'}, default False
///     Put ground under the subject: a diffuse plate of reflectance 0.5 that fades out toward its rim, or one that shows
///     only shadows.
/// normalize : bool, default False
///     Move the center of the bounds to the origin and scale the longest half-extent to 1.
/// portal : str, optional
///     Rectangles through which light enters, as in `--portal` of the program.
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
        if let Some(material) = &changes.material {
            let (bsdf, lobe) = material.bsdf(py)?;
            description.set_subject_material(bsdf);
            lobes.extend(lobe);
        }
        let up = description.up.unwrap_or_default();
        changes.subject.apply(&mut description, up.vector());
        let subject = description.subject_bounds();
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

    /// The scene's own environment, changed, otherwise the built-in sky.
    pub(crate) fn lit_by(&self, py: Python<'_>, light: Light) -> PyResult<Environment> {
        let (environment, up) = (self.inner.environment.clone(), Some(self.inner.up));
        let of_scene = SceneDescription { environment, up, ..SceneDescription::default() };
        let settings = light.over(&of_scene);
        Environment::of(py, light, settings)
    }
}

#[pymethods]
impl Scene {
    #[new]
    #[pyo3(signature = (vertices, faces, *, normals = None, colors = None, uvs = None, material = None, up = "y",
        name = "mesh", **options),
        text_signature = "(vertices, faces, *, normals=None, colors=None, uvs=None, material=None, ground=False, normalize=False, portal=None, up='y', name='mesh')")]
    fn new(
        vertices: &Bound<'_, PyAny>,
        faces: &Bound<'_, PyAny>,
        normals: Option<Bound<'_, PyAny>>,
        colors: Option<Bound<'_, PyAny>>,
        uvs: Option<Bound<'_, PyAny>>,
        material: Option<MaterialLike>,
        up: &str,
        name: &str,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let py = vertices.py();
        let Job { subject, .. } = options::scene_job(options, &CHANGES)?;
        // Copies, because arrays can be changed.
        let given = [
            ("normals", normals.as_ref().map(copied).transpose()?),
            ("colors", colors.as_ref().map(copied).transpose()?),
            ("uvs", uvs.as_ref().map(copied).transpose()?),
            ("material", material.as_ref().map(|material| material.object(py))),
            ("up", Some(PyString::new(py, up).into_any())),
            ("name", Some(PyString::new(py, name).into_any())),
        ];
        let keywords = recipe::keywords(py, options, given)?;
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
        Self::build(py, name.to_owned(), description, Changes { material, subject }, recipe)
    }

    /// Load a mesh or a scene file: .ply, .obj, .stl, .off, .gltf, .glb or .toml.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     The file.
    /// material : Material, Bsdf or str, optional
    ///     Replaces the file's materials, except for floors and plinths.
    /// ground, normalize, portal
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
    #[pyo3(signature = (path, *, material = None, up = None, **options),
        text_signature = "(path, *, material=None, ground=False, normalize=False, portal=None, scene=None, animation=None, at=0.0, strict=False, up=None)")]
    fn load(
        cls: &Bound<'_, PyType>,
        path: PathBuf,
        material: Option<MaterialLike>,
        up: Option<&str>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let py = cls.py();
        let Job { subject, file, light, .. } =
            options::scene_job(options, &[&CHANGES[..], &OF_FILES].concat())?;
        let given = [
            ("material", material.as_ref().map(|material| material.object(py))),
            ("up", up.map(|up| PyString::new(py, up).into_any())),
        ];
        let keywords = recipe::keywords(py, options, given)?;
        let arguments = PyTuple::new(py, [path.as_os_str()])?;
        let recipe = Recipe::new(Some("load"), &arguments, &keywords);
        let name = path.display().to_string();
        let (mut description, _) =
            with_warnings(py, move |host| file.load(&path, light.strict, host))?;
        if let Some(up) = up {
            description.up = Some(up_axis(up)?);
        }
        let changes = Changes { material, subject };
        Self::build(py, name, description, changes, recipe)
    }

    /// Create a built-in scene: 'statue', 'spheres', 'material-ball', 'room', 'sphere' or 'sphere-orthographic'.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     The name of the scene.
    /// material, ground, normalize, portal
    ///     As in `load`.
    #[classmethod]
    #[pyo3(signature = (name, *, material = None, **options),
        text_signature = "(name, *, material=None, ground=False, normalize=False, portal=None)")]
    fn builtin(
        cls: &Bound<'_, PyType>,
        name: &str,
        material: Option<MaterialLike>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let py = cls.py();
        let Job { subject, .. } = options::scene_job(options, &CHANGES)?;
        let builtin = BuiltinScene::from_str(name).map_err(|e| from_source(&e))?;
        let description = parallel(py, || builtin.description())?;
        let given = [("material", material.as_ref().map(|material| material.object(py)))];
        let keywords = recipe::keywords(py, options, given)?;
        let recipe = Recipe::new(Some("builtin"), &PyTuple::new(py, [name])?, &keywords);
        Self::build(py, name.to_owned(), description, Changes { material, subject }, recipe)
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
        self.inner.up.name()
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
    fn camera<'py>(&self, py: Python<'py>, aspect: f32) -> PyResult<Bound<'py, PyAny>> {
        if !(aspect.is_finite() && aspect > 0.0) {
            return Err(bad_value(format!("aspect is {aspect}; it must be positive and finite")));
        }
        let up = self.inner.up.vector();
        camera::to_python(py, self.inner.camera_settings(None, aspect, up)?)
    }

    /// Return the environment named by the scene, otherwise the built-in sky.
    ///
    /// Parameters
    /// ----------
    /// rows : int, default 1024
    ///     Rows of a built-in probe.
    #[pyo3(signature = (rows = 1024))]
    fn environment(&self, py: Python<'_>, rows: usize) -> PyResult<Environment> {
        let rows = [("rows", rows)].into_py_dict(py)?;
        self.lit_by(py, options::light(Some(&rows), &["rows"])?)
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
