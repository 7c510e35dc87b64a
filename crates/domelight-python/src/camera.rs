//! What renders need of `domelight.Camera`, which is written in Python.

use domelight::math::Vec3;
use domelight::scene::{self, CameraError, CameraSettings, Lens, Projection};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A camera whose omitted parts come from the scene.
pub(crate) struct Camera {
    origin: Option<Vec3>,
    target: Option<Vec3>,
    up: Option<Vec3>,
    projection: Option<Projection>,
    shift: [f32; 2],
    lens: Option<Lens>,
}

impl Camera {
    /// The camera of `domelight.Camera._parts`.
    fn from_parts(parts: &Bound<'_, PyAny>) -> PyResult<Self> {
        type Vectors = [Option<[f32; 3]>; 3];
        type Parts = (Vectors, Option<f32>, Option<f32>, [f32; 2], Option<(f32, f32, u32)>);
        let (vectors, fov, ortho, shift, lens): Parts = parts.extract()?;
        let [origin, target, up] = vectors.map(|vector| vector.map(Vec3::from));
        let perspective = fov.map(|fov_y_degrees| Projection::Perspective { fov_y_degrees });
        let orthographic = ortho.map(|height| Projection::Orthographic { height });
        let projection = perspective.or(orthographic);
        let lens =
            lens.map(|(radius, focus_distance, blades)| Lens { radius, focus_distance, blades });
        Ok(Self { origin, target, up, projection, shift, lens })
    }

    /// The camera with the shift and the lens.
    pub(crate) fn through_lens(
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

    /// The camera of the scene, changed.
    pub(crate) fn settings(&self, mut of_scene: CameraSettings) -> CameraSettings {
        of_scene.origin = self.origin.unwrap_or(of_scene.origin);
        of_scene.target = self.target.unwrap_or(of_scene.target);
        of_scene.up = self.up.unwrap_or(of_scene.up);
        of_scene.projection = self.projection.unwrap_or(of_scene.projection);
        of_scene
    }
}

/// A `domelight.Camera`.
pub(crate) fn to_python(py: Python<'_>, settings: CameraSettings) -> PyResult<Bound<'_, PyAny>> {
    let CameraSettings { projection, origin, target, up } = settings;
    let keywords = PyDict::new(py);
    for (name, vector) in [("origin", origin), ("target", target), ("up", up)] {
        keywords.set_item(name, vector.to_array())?;
    }
    match projection {
        Projection::Perspective { fov_y_degrees } => keywords.set_item("fov", fov_y_degrees)?,
        Projection::Orthographic { height } => keywords.set_item("ortho", height)?,
    }
    py.import("domelight._camera")?.getattr("Camera")?.call((), Some(&keywords))
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
        if let Some(parts) = value.getattr_opt("_parts")? {
            return Ok(Self::Camera(Camera::from_parts(&parts)?));
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
