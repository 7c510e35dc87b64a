//! Pinhole, thin-lens and orthographic cameras.
//!
//! The picture's basis is f = normalize(target − origin), r = normalize(f × up), u = r × f. The
//! point (px, py) of a W × H picture, px to the right and py **down** from the top left corner in
//! pixels, looks along
//!
//! normalize(f + tan(fov/2) · ((2 px/W − 1) · W/H · r + (1 − 2 py/H) · u)),
//!
//! so pixel centers lie at +½, pixels are square and `fov` is the vertical field of view. The
//! orthographic camera moves the origin instead, with height/2 in place of tan(fov/2).

use crate::bvh::Frustum;
use crate::geometry::{Ray, power_of_two};
use crate::math::{Mat4, TAU, Vec2, Vec3, functions, vec2};
use crate::sampling::warp::concentric_disk;
use crate::simd::{SimdFloat, Vectors};

/// The settings of a camera, independent of the size of its picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraSettings {
    /// Perspective or orthographic.
    pub projection: Projection,
    /// The position of the camera.
    pub origin: Vec3,
    /// The point it looks at: any point on its axis except the origin.
    pub target: Vec3,
    /// The direction that points up in the picture, of any length and not parallel to the axis.
    pub up: Vec3,
}

/// The projection of the scene onto the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// All rays start at the origin.
    Perspective {
        /// Vertical field of view in (0, 180) \[degrees\].
        fov_y_degrees: f32,
    },
    /// All rays are parallel.
    Orthographic {
        /// Height of the picture in world units, > 0.
        height: f32,
    },
}

/// A thin lens with an aperture, which blurs everything away from the focus distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// The radius of the aperture in world units, ≥ 0.
    pub radius: f32,
    /// The distance from the camera to the focal plane along its axis, > 0.
    pub focus_distance: f32,
    /// The number of aperture blades, at least 3; a smaller number means a round aperture.
    pub blades: u32,
}

impl Lens {
    /// Height of the sensor of a full-frame camera \[m\].
    const SENSOR: f32 = 0.024;

    /// Creates the lens of a full-frame camera with an f-number > 0, in a world measured in meters. The sensor height
    /// of 24 mm and the field of view of `settings` give the focal length; the aperture diameter is the focal length
    /// divided by the f-number.
    ///
    /// # Errors
    /// If the camera is orthographic, or a number is not positive and finite.
    pub fn new(
        settings: &CameraSettings,
        f_number: f32,
        focus_distance: f32,
        blades: u32,
    ) -> Result<Self, CameraError> {
        let Projection::Perspective { .. } = settings.projection else {
            return Err(CameraError::NoLens);
        };
        for (name, value) in [("f-number", f_number), ("focus distance", focus_distance)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(CameraError::Lens { name, value });
            }
        }
        let focal_length = 0.5 * Self::SENSOR / half_height(settings.projection)?;
        Ok(Self { radius: 0.5 * focal_length / f_number, focus_distance, blades })
    }

    /// Scales the lens with the scene by a factor > 0.
    pub fn scale(&mut self, factor: f32) {
        self.radius *= factor;
        self.focus_distance *= factor;
    }

    /// A point of the aperture, in \[−1, 1\]² times its radius, from uniform numbers in \[0, 1).
    fn point(&self, [u, v]: [f32; 2]) -> Vec2 {
        if self.blades < 3 {
            return concentric_disk(vec2(u, v));
        }
        // Choose one of the triangles from the center to an edge, and sample it uniformly by area.
        let n = self.blades as f32;
        let blade = (u * n).floor().min(n - 1.0);
        let corner = |i: f32| {
            let (sin, cos) = functions::sin_cos(TAU * i / n);
            vec2(sin, cos)
        };
        let out = (u * n - blade).clamp(0.0, 1.0).sqrt();
        out * ((1.0 - v) * corner(blade) + v * corner(blade + 1.0))
    }
}

/// An invalid camera.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CameraError {
    /// A coordinate is NaN or infinite.
    #[error("the camera's {name} is not finite: {value}; give three finite numbers")]
    NotFinite {
        /// Which vector.
        name: &'static str,
        /// Its value.
        value: Vec3,
    },
    /// The viewing direction is undefined.
    #[error("the camera's origin and target are the same point: {origin}; move one of them")]
    NoDirection {
        /// The origin.
        origin: Vec3,
    },
    /// The picture could be rotated freely.
    #[error(
        "the camera's up vector {up} is zero or parallel to its viewing direction {forward}; choose another"
    )]
    Up {
        /// The up vector.
        up: Vec3,
        /// The viewing direction.
        forward: Vec3,
    },
    /// A field of view outside (0°, 180°).
    #[error("the field of view {fov_y_degrees}° is outside (0°, 180°)")]
    FieldOfView {
        /// The vertical field of view \[degrees\].
        fov_y_degrees: f32,
    },
    /// An invalid orthographic height.
    #[error("the orthographic height {height} is not a positive finite number")]
    Height {
        /// The height.
        height: f32,
    },
    /// An orthographic camera with a lens.
    #[error("an orthographic camera has no lens; give a field of view, or no depth of field")]
    NoLens,
    /// An invalid lens.
    #[error("the lens's {name} {value} is not a positive finite number")]
    Lens {
        /// Which number.
        name: &'static str,
        /// Its value.
        value: f32,
    },
    /// A picture without pixels.
    #[error("a picture of {width} x {height} has no pixels")]
    Size {
        /// Its width.
        width: usize,
        /// Its height.
        height: usize,
    },
}

impl CameraSettings {
    /// The vertical field of view of [`CameraSettings::framing`] \[degrees\].
    pub const DEFAULT_FOV_Y_DEGREES: f32 = 35.0;

    /// Checks that the settings are valid.
    ///
    /// # Errors
    /// The [`CameraError`] of the first invalid setting.
    pub fn check(&self) -> Result<(), CameraError> {
        basis(self).and(half_height(self.projection)).map(|_| ())
    }

    /// The direction along the ground from the target to the camera, perpendicular to the axis `up`, which may have any
    /// length. For a camera that looks along the axis, it is the direction of the bottom of its picture.
    pub fn side(&self, up: Vec3) -> Vec3 {
        let flat = |v: Vec3| v - up * (v.dot(up) / up.length_squared().max(f32::MIN_POSITIVE));
        let toward = (self.origin - self.target).normalize_or_zero();
        let along = flat(toward);
        if along.length() > 1e-2 {
            return along;
        }
        if toward.dot(up) > 0.0 { -flat(self.up) } else { flat(self.up) }
    }

    /// The camera rotated around `center` about `axis`, counterclockwise as seen from the tip of the axis \[degrees\].
    #[must_use]
    pub fn orbited(&self, center: Vec3, axis: Vec3, degrees: f32) -> Self {
        let Some(axis) = direction(axis) else { return *self };
        let (sin, cos) = functions::sin_cos(degrees.to_radians());
        let turn = |v: Vec3| cos * v + sin * axis.cross(v) + (1.0 - cos) * axis.dot(v) * axis;
        Self {
            origin: center + turn(self.origin - center),
            target: center + turn(self.target - center),
            up: turn(self.up),
            ..*self
        }
    }

    /// Scales the camera's position and, for an orthographic camera, its height by a factor > 0.
    pub fn scale(&mut self, factor: f32) {
        self.origin *= factor;
        self.target *= factor;
        if let Projection::Orthographic { height } = &mut self.projection {
            *height *= factor;
        }
    }

    /// Transforms the camera by an affine matrix, whose scale also applies to an orthographic height.
    pub fn transform(&mut self, m: &Mat4) {
        self.origin = m.transform_point3(self.origin);
        self.target = m.transform_point3(self.target);
        self.up = m.transform_vector3(self.up);
        if let Projection::Orthographic { height } = &mut self.projection {
            *height *= functions::cbrt(m.determinant().abs());
        }
    }
}

/// A camera for a picture of given size, which generates camera rays from pixel positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The origin of all rays (perspective), or of the ray through the top left corner (orthographic).
    origin: Vec3,
    /// The direction toward the top left corner (perspective), or of all rays (orthographic).
    direction: Vec3,
    /// One pixel to the right, as a change of direction or of origin.
    step_x: Vec3,
    /// One pixel down.
    step_y: Vec3,
    /// The camera's axis through its position, along which depth is measured.
    axis: Ray,
    orthographic: bool,
    lens: Option<LensPlane>,
}

/// A lens in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LensPlane {
    lens: Lens,
    /// Unit vectors to the right and down.
    right: Vec3,
    down: Vec3,
}

impl Camera {
    /// Creates the camera for a picture of `width` × `height` pixels.
    ///
    /// # Errors
    /// The [`CameraError`] of the first invalid setting.
    pub fn new(
        settings: &CameraSettings,
        width: usize,
        height: usize,
    ) -> Result<Self, CameraError> {
        if width == 0 || height == 0 {
            return Err(CameraError::Size { width, height });
        }
        let [forward, right, up] = basis(settings)?;
        let half = half_height(settings.projection)?;
        let half_right = half * (width as f32 / height as f32) * right;
        let half_up = half * up;
        let step_x = half_right * (2.0 / width as f32);
        let step_y = half_up * (-2.0 / height as f32);
        let corner = half_up - half_right;
        let axis = Ray::new(settings.origin, forward);
        Ok(match settings.projection {
            Projection::Perspective { .. } => Self {
                origin: settings.origin,
                direction: forward + corner,
                step_x,
                step_y,
                axis,
                orthographic: false,
                lens: None,
            },
            Projection::Orthographic { .. } => Self {
                origin: settings.origin + corner,
                direction: forward,
                step_x,
                step_y,
                axis,
                orthographic: true,
                lens: None,
            },
        })
    }

    /// Adds a lens. An orthographic camera is unchanged.
    #[must_use]
    pub fn with_lens(mut self, lens: Lens) -> Self {
        if !self.orthographic && lens.radius > 0.0 {
            let [right, down] = [self.step_x, self.step_y].map(Vec3::normalize);
            self.lens = Some(LensPlane { lens, right, down });
        }
        self
    }

    /// Moves the picture across the image plane, to the right and down in pixels; the axis and the focal plane stay.
    #[must_use]
    pub fn shifted(mut self, right: f32, down: f32) -> Self {
        let shift = right * self.step_x + down * self.step_y;
        if self.orthographic {
            self.origin += shift;
        } else {
            self.direction += shift;
        }
        self
    }

    /// Whether rays depend on a point on the lens.
    #[inline]
    pub fn has_lens(&self) -> bool {
        self.lens.is_some()
    }

    /// The same view for a picture of another size. Sizes are (columns, rows), each at least 1.
    #[must_use]
    pub fn resized(&self, from: (usize, usize), to: (usize, usize)) -> Self {
        let [x, y] = [from.0 as f32 / to.0 as f32, from.1 as f32 / to.1 as f32];
        Self { step_x: self.step_x * x, step_y: self.step_y * y, ..*self }
    }

    /// The same view with all lengths multiplied by a factor > 0.
    pub(crate) fn scaled(&self, factor: f32) -> Self {
        let step = if self.orthographic { factor } else { 1.0 };
        let mut lens = self.lens;
        if let Some(plane) = &mut lens {
            plane.lens.scale(factor);
        }
        Self {
            lens,
            origin: self.origin * factor,
            step_x: self.step_x * step,
            step_y: self.step_y * step,
            axis: Ray::new(self.axis.origin * factor, self.axis.direction),
            ..*self
        }
    }

    /// The ray through the point (`px`, `py`) of the picture in pixels, `px` in [0, width) to the
    /// right and `py` in [0, height) down; its direction is a unit vector.
    #[inline]
    pub fn ray(&self, px: f32, py: f32) -> Ray {
        if self.orthographic {
            let step = px * self.step_x + py * self.step_y;
            Ray::new(self.origin + step, self.direction)
        } else {
            Ray::new(self.origin, self.directions(px, py).into())
        }
    }

    /// The origin of all rays of a pinhole camera.
    pub(crate) fn pinhole(&self) -> Option<Vec3> {
        (!self.orthographic && self.lens.is_none()).then_some(self.origin)
    }

    /// The directions of the rays of a perspective camera through points of the picture, see [`Camera::ray`].
    #[inline(always)]
    pub(crate) fn directions<F: SimdFloat>(&self, px: F, py: F) -> Vectors<F> {
        let step_x = Vectors::splat(px, self.step_x).times(px);
        let step_y = Vectors::splat(py, self.step_y).times(py);
        let toward = Vectors::splat(px, self.direction).plus(step_x.plus(step_y));
        toward.times(px.splat(1.0) / toward.length_squared().sqrt())
    }

    /// Like [`Camera::ray`], for a ray through the point of the lens that `u` in \[0, 1)² samples. `u` is ignored if
    /// there is no lens.
    pub fn lens_ray(&self, px: f32, py: f32, u: [f32; 2]) -> Ray {
        let Some(LensPlane { lens, right, down }) = self.lens else { return self.ray(px, py) };
        let at = lens.radius * lens.point(u);
        let aside = at.x * right + at.y * down;
        let step = px * self.step_x + py * self.step_y;
        let direction = lens.focus_distance * (self.direction + step) - aside;
        Ray::new(self.origin + aside, direction.normalize())
    }

    /// The frustum of the rays through the rectangle of the picture from (`x[0]`, `y[0]`) to
    /// (`x[1]`, `y[1]`) \[pixels\].
    pub fn frustum(&self, x: [f32; 2], y: [f32; 2]) -> Frustum {
        let corners = [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]];
        let steps = corners.map(|[x, y]| x * self.step_x + y * self.step_y);
        if let Some(LensPlane { lens, right, down }) = self.lens {
            // A ray starts at most at the rim of the aperture, and diverges from the pinhole ray at most as fast as from there.
            let signs = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
            let out = signs.map(|[x, y]| lens.radius * (x * right + y * down));
            let toward = |i: usize| self.direction + steps[i] + out[i] / lens.focus_distance;
            Frustum::new(out.map(|out| self.origin + out), std::array::from_fn(toward))
        } else if self.orthographic {
            Frustum::new(steps.map(|step| self.origin + step), [self.direction; 4])
        } else {
            Frustum::new([self.origin; 4], steps.map(|step| self.direction + step))
        }
    }

    /// The depth of a point: its distance along the camera's axis.
    pub fn depth(&self, point: Vec3) -> f32 {
        (point - self.axis.origin).dot(self.axis.direction)
    }
}

/// The unit vector along a vector of any length but 0, whose square may overflow or vanish.
fn direction(v: Vec3) -> Option<Vec3> {
    (v / power_of_two(v.abs().max_element())).try_normalize()
}

/// Forward, right and up as an orthonormal basis.
pub(super) fn basis(settings: &CameraSettings) -> Result<[Vec3; 3], CameraError> {
    let CameraSettings { origin, target, up, .. } = *settings;
    for (name, value) in [("origin", origin), ("target", target), ("up vector", up)] {
        if !value.is_finite() {
            return Err(CameraError::NotFinite { name, value });
        }
    }
    let forward =
        direction(target / 2.0 - origin / 2.0).ok_or(CameraError::NoDirection { origin })?;
    let unit_up = direction(up).ok_or(CameraError::Up { up, forward })?;
    let right = forward.cross(unit_up);
    if right.length() < 1e-6 {
        return Err(CameraError::Up { up, forward });
    }
    let right = right.normalize();
    Ok([forward, right, right.cross(forward)])
}

/// Half the picture's height at unit distance.
fn half_height(projection: Projection) -> Result<f32, CameraError> {
    match projection {
        Projection::Perspective { fov_y_degrees } => {
            if !(fov_y_degrees > 0.0 && fov_y_degrees < 180.0) {
                return Err(CameraError::FieldOfView { fov_y_degrees });
            }
            Ok(functions::tan(0.5 * fov_y_degrees.to_radians()))
        }
        Projection::Orthographic { height } => {
            if !(height > 0.0 && height.is_finite()) {
                return Err(CameraError::Height { height });
            }
            Ok(0.5 * height)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vec3;

    fn settings() -> CameraSettings {
        CameraSettings {
            projection: Projection::Perspective { fov_y_degrees: 40.0 },
            origin: vec3(1.0, 2.0, 5.0),
            target: vec3(0.3, -0.2, 0.0),
            up: vec3(0.1, 2.0, 0.0),
        }
    }

    #[test]
    fn rays_follow_the_definition() {
        let s = settings();
        let (w, h) = (64, 48);
        let camera = Camera::new(&s, w, h).unwrap();
        let f = (s.target - s.origin).normalize();
        let r = f.cross(s.up).normalize();
        let u = r.cross(f);
        let t = 20f32.to_radians().tan();
        let (w, h) = (w as f32, h as f32);
        for (px, py) in [(0.0, 0.0), (0.5, 0.5), (32.0, 24.0), (63.5, 1.25), (10.0, 47.0)] {
            let x = (2.0 * px / w - 1.0) * w / h;
            let expected = (f + t * (x * r + (1.0 - 2.0 * py / h) * u)).normalize();
            let ray = camera.ray(px, py);
            assert!((ray.direction - expected).length() < 1e-6);
            assert_eq!(ray.origin, s.origin);
        }
    }

    #[test]
    fn orthographic_rays_are_parallel_and_cover_the_height() {
        let s =
            CameraSettings { projection: Projection::Orthographic { height: 3.0 }, ..settings() };
        let camera = Camera::new(&s, 20, 10).unwrap();
        let (top, bottom) = (camera.ray(10.0, 0.0), camera.ray(10.0, 10.0));
        assert_eq!(top.direction, bottom.direction);
        assert!(((top.origin - bottom.origin).length() - 3.0).abs() < 1e-5);
        assert!((camera.ray(10.0, 5.0).origin - s.origin).length() < 1e-6);
        let width = (camera.ray(0.0, 5.0).origin - camera.ray(20.0, 5.0).origin).length();
        assert!((width - 6.0).abs() < 1e-5);
    }

    /// A shifted picture is a window of the same image plane.
    #[test]
    fn a_shift_moves_the_window() {
        let flat =
            CameraSettings { projection: Projection::Orthographic { height: 3.0 }, ..settings() };
        for s in [settings(), flat] {
            let camera = Camera::new(&s, 30, 20).unwrap();
            let shifted = camera.shifted(6.5, -4.0);
            for (px, py) in [(0.0, 0.0), (12.5, 7.25), (30.0, 20.0)] {
                let (ray, expected) = (shifted.ray(px, py), camera.ray(px + 6.5, py - 4.0));
                assert!((ray.direction - expected.direction).length() < 1e-6);
                assert!((ray.origin - expected.origin).length() < 1e-5);
            }
            assert_eq!(shifted.depth(Vec3::ONE), camera.depth(Vec3::ONE));
        }
    }

    /// Rays through one point of the picture meet at the focus distance, and start all over the aperture.
    #[test]
    fn rays_through_a_lens_meet_where_it_is_focused() {
        let s = settings();
        for blades in [0, 5, 7] {
            let lens = Lens { radius: 0.2, focus_distance: 3.0, blades };
            let pinhole = Camera::new(&s, 30, 20).unwrap();
            let camera = pinhole.with_lens(lens);
            let ray = camera.ray(4.25, 17.5);
            assert_eq!(ray, pinhole.ray(4.25, 17.5));
            let focus = ray.at(3.0 / ray.direction.dot(camera.axis.direction));
            let mut farthest = 0.0f32;
            let mut mean = Vec3::ZERO;
            for i in 0..1024 {
                let u = [(i % 32) as f32 / 32.0 + 0.015, (i / 32) as f32 / 32.0 + 0.015];
                let through = camera.lens_ray(4.25, 17.5, u);
                let toward = (focus - through.origin).normalize();
                assert!((toward - through.direction).length() < 1e-5);
                let aside = through.origin - s.origin;
                assert!(aside.dot(camera.axis.direction).abs() < 1e-5);
                farthest = farthest.max(aside.length());
                mean += aside / 1024.0;
            }
            assert!(farthest <= 0.2 + 1e-5 && farthest > 0.17, "{blades}: {farthest}");
            assert!(mean.length() < 0.01, "{blades}: {mean}");
        }
    }

    #[test]
    fn a_lens_takes_its_aperture_from_the_field_of_view() {
        let fov = |fov_y_degrees| CameraSettings {
            projection: Projection::Perspective { fov_y_degrees },
            ..settings()
        };
        // A normal lens of 50 mm sees 27° of 24 mm.
        let lens = Lens::new(&fov(26.991), 2.0, 5.0, 0).unwrap();
        assert!((lens.radius - 0.0125).abs() < 1e-5, "{}", lens.radius);
        for (f_number, distance) in [(0.0, 1.0), (2.0, -1.0), (f32::NAN, 1.0), (2.0, f32::INFINITY)]
        {
            let error = Lens::new(&settings(), f_number, distance, 0).unwrap_err();
            assert!(matches!(error, CameraError::Lens { .. }));
        }
        let flat =
            CameraSettings { projection: Projection::Orthographic { height: 1.0 }, ..settings() };
        assert_eq!(Lens::new(&flat, 2.0, 1.0, 0), Err(CameraError::NoLens));
    }

    #[test]
    fn cameras_that_make_no_picture_are_refused() {
        let s = settings();
        let fov = |fov_y_degrees| CameraSettings {
            projection: Projection::Perspective { fov_y_degrees },
            ..s
        };
        let error = |s: CameraSettings| Camera::new(&s, 4, 4).unwrap_err();
        for f in [0.0, 180.0, -3.0, f32::NAN] {
            assert!(matches!(error(fov(f)), CameraError::FieldOfView { .. }));
        }
        let flat = CameraSettings { projection: Projection::Orthographic { height: 0.0 }, ..s };
        assert!(matches!(error(flat), CameraError::Height { .. }));
        let same = CameraSettings { target: s.origin, ..s };
        assert!(matches!(error(same), CameraError::NoDirection { .. }));
        for up in [Vec3::ZERO, s.target - s.origin, 2.0 * (s.origin - s.target)] {
            assert!(matches!(error(CameraSettings { up, ..s }), CameraError::Up { .. }));
        }
        let nan = CameraSettings { origin: Vec3::NAN, ..s };
        assert!(matches!(error(nan), CameraError::NotFinite { name: "origin", .. }));
        assert!(matches!(Camera::new(&s, 0, 4), Err(CameraError::Size { .. })));
    }
}
