//! Framing: places a camera so that the subject fills its picture.
//!
//! Four planes through the camera's position bound the picture. For a viewing direction f with right r and up u, a
//! point p is within the left and right ones if |x − c_x| ≤ t_x (z − c_z), with (x, y, z) the coordinates of p along
//! (r, u, f), c those of the camera and t_x the tangent of half the horizontal field of view. The largest values of
//! x − t_x z and −x − t_x z over all points give c_x and the largest c_z, so one pass over the vertices finds the
//! nearest camera.

use std::fmt;
use std::str::FromStr;

use super::Scene;
use super::camera::{Camera, CameraSettings, Projection};
use crate::geometry::Aabb;
use crate::math::{Vec3, functions};

/// The fraction of the picture's height or width that a subject fills, whichever is tighter.
const FILL: f32 = 0.86;

/// The direction from which a framed camera views its subject.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewDirection {
    azimuth: f32,
    elevation: f32,
}

/// A text that is not a view.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "there is no view {text:?}; the views are front, back, left, right, top, bottom and \
     three-quarter, or azimuth and \
     elevation in degrees such as 30,15, the elevation from -90 to 90"
)]
pub struct UnknownView {
    /// The text.
    pub text: String,
}

impl ViewDirection {
    /// The named views.
    pub const NAMED: [(&'static str, Self); 7] = [
        ("front", Self { azimuth: 0.0, elevation: 0.0 }),
        ("back", Self { azimuth: 180.0, elevation: 0.0 }),
        ("left", Self { azimuth: -90.0, elevation: 0.0 }),
        ("right", Self { azimuth: 90.0, elevation: 0.0 }),
        ("top", Self { azimuth: 0.0, elevation: 90.0 }),
        ("bottom", Self { azimuth: 0.0, elevation: -90.0 }),
        ("three-quarter", Self { azimuth: 40.0, elevation: 20.0 }),
    ];

    /// From the front, 20° from above.
    pub const DEFAULT: Self = Self { azimuth: 0.0, elevation: 20.0 };

    /// A view from an azimuth \[degrees\], where 0 is in front of the subject and 90 to its right as seen from there,
    /// and an elevation from −90 (below) to 90 (above) \[degrees\]. The front is +Z if +Y is up, and −Y if +Z is up.
    ///
    /// # Errors
    /// If an angle is not finite, or the elevation is outside its range.
    pub fn new(azimuth: f32, elevation: f32) -> Result<Self, UnknownView> {
        if azimuth.is_finite() && (-90.0..=90.0).contains(&elevation) {
            Ok(Self { azimuth, elevation })
        } else {
            Err(UnknownView { text: format!("{azimuth},{elevation}") })
        }
    }

    /// The azimuth around the subject \[degrees\].
    pub fn azimuth(self) -> f32 {
        self.azimuth
    }

    /// The elevation above the subject \[degrees\], in \[−90, 90\].
    pub fn elevation(self) -> f32 {
        self.elevation
    }

    /// The unit vector from the subject to the camera, and the direction that is up in the picture.
    fn axes(self, up: Vec3) -> [Vec3; 2] {
        /// From this elevation on, the view is along the up axis.
        const STEEP: f32 = 89.9;
        let up = up.try_normalize().unwrap_or(Vec3::Y);
        let front = Vec3::Z - up * up.z;
        let front = front.try_normalize().filter(|_| up.z.abs() < 0.9).unwrap_or(-Vec3::Y);
        let front = (front - up * up.dot(front)).normalize();
        let (sin, cos) = functions::sin_cos(self.azimuth.to_radians());
        let aside = cos * front + sin * up.cross(front);
        let (sin, cos) = functions::sin_cos(self.elevation.to_radians());
        let is_steep = self.elevation.abs() > STEEP;
        [cos * aside + sin * up, if is_steep { cos * up - sin * aside } else { up }]
    }
}

impl Default for ViewDirection {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl FromStr for ViewDirection {
    type Err = UnknownView;

    fn from_str(text: &str) -> Result<Self, UnknownView> {
        let unknown = || UnknownView { text: text.to_owned() };
        if let Some((_, view)) = Self::NAMED.into_iter().find(|(name, _)| *name == text) {
            return Ok(view);
        }
        let (azimuth, elevation) = text.split_once(',').ok_or_else(unknown)?;
        let number = |text: &str| text.trim().parse::<f32>().map_err(|_| unknown());
        Self::new(number(azimuth)?, number(elevation)?).map_err(|_| unknown())
    }
}

impl fmt::Display for ViewDirection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match Self::NAMED.into_iter().find(|(_, view)| view == self) {
            Some((name, _)) => f.pad(name),
            None => write!(f, "{},{}", self.azimuth, self.elevation),
        }
    }
}

/// How a camera frames a subject.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Framing {
    /// The direction of the view; `None` is the scene's own, or else [`ViewDirection::DEFAULT`].
    pub view: Option<ViewDirection>,
    /// Width / height of the picture, > 0.
    pub aspect: f32,
    /// The direction that points up; zero means +Y.
    pub up: Vec3,
    /// The vertical field of view \[degrees\]; values outside (0, 180) mean
    /// [`CameraSettings::DEFAULT_FOV_Y_DEGREES`].
    pub fov_y_degrees: f32,
    /// Whether the subject must stay in the picture while the camera goes around it, about an axis along `up` through
    /// the center of the bounds.
    pub all_around: bool,
}

impl Framing {
    /// The default view, for a picture with `aspect` = width / height.
    pub fn new(aspect: f32, up: Vec3) -> Self {
        let fov_y_degrees = CameraSettings::DEFAULT_FOV_Y_DEGREES;
        Self { view: None, aspect, up, fov_y_degrees, all_around: false }
    }

    /// The nearest camera that sees all points, with a margin on either side of 7 % of the picture's height or width,
    /// whichever is tighter. Without points, or with infinite ones, it frames the cube from −1 to 1.
    pub fn fit(&self, points: impl Iterator<Item = Vec3> + Clone) -> CameraSettings {
        let bounds = Aabb::around(points.clone());
        if bounds.is_empty() || !(bounds.min.is_finite() && bounds.max.is_finite()) {
            return self.fit_within(
                &Aabb { min: Vec3::splat(-1.0), max: Vec3::ONE },
                cube(Vec3::ZERO, 1.0).into_iter(),
            );
        }
        if bounds.size().max_element() == 0.0 {
            return self.fit_within(&bounds, cube(bounds.center(), 1.0).into_iter());
        }
        self.fit_within(&bounds, points)
    }

    fn fit_within(&self, bounds: &Aabb, points: impl Iterator<Item = Vec3>) -> CameraSettings {
        let [toward, picture_up] = self.view.unwrap_or_default().axes(self.up);
        let forward = -toward;
        let right = forward.cross(picture_up).normalize();
        let up = right.cross(forward);
        let fov_y_degrees = self.fov();
        let tan_y = FILL * functions::tan(0.5 * fov_y_degrees.to_radians());
        let tan_x = tan_y * self.aspect.max(1e-3);

        // Find how far the subject reaches beyond each plane of a picture at the center.
        let center = 0.5 * bounds.min + 0.5 * bounds.max;
        let local = points.map(|p| {
            let p = p - center;
            Vec3::new(p.dot(right), p.dot(up), p.dot(forward))
        });
        let reach = if self.all_around {
            let axis = self.up.try_normalize().unwrap_or(Vec3::Y);
            let axis = Vec3::new(axis.dot(right), axis.dot(up), axis.dot(forward));
            Reach::all_around(local, axis, tan_x, tan_y)
        } else {
            Reach::of(local, tan_x, tan_y)
        };

        // Move the camera back until the tighter pair of planes holds it.
        let depth = (-0.5 * (reach.right + reach.left) / tan_x)
            .min(-0.5 * (reach.top + reach.bottom) / tan_y)
            .min(reach.nearest - 0.05 * bounds.size().max_element());
        let shift_x = 0.5 * (reach.right - reach.left);
        let shift_y = 0.5 * (reach.top - reach.bottom);
        let target = center + shift_x * right + shift_y * up;
        CameraSettings {
            projection: Projection::Perspective { fov_y_degrees },
            origin: target + depth * forward,
            target,
            up: picture_up,
        }
    }

    /// The field of view \[degrees\].
    fn fov(&self) -> f32 {
        let fov = self.fov_y_degrees;
        if fov > 0.0 && fov < 180.0 { fov } else { CameraSettings::DEFAULT_FOV_Y_DEGREES }
    }
}

/// The largest values of ±x − t_x z and ±y − t_y z, and the least z.
struct Reach {
    right: f32,
    left: f32,
    top: f32,
    bottom: f32,
    nearest: f32,
}

impl Reach {
    const NONE: Self = Self {
        right: f32::NEG_INFINITY,
        left: f32::NEG_INFINITY,
        top: f32::NEG_INFINITY,
        bottom: f32::NEG_INFINITY,
        nearest: f32::INFINITY,
    };

    /// The extremes of points with coordinates along right, up and forward.
    fn of(points: impl Iterator<Item = Vec3>, tan_x: f32, tan_y: f32) -> Self {
        points.fold(Self::NONE, |reach, p| Self {
            right: reach.right.max(p.x - tan_x * p.z),
            left: reach.left.max(-p.x - tan_x * p.z),
            top: reach.top.max(p.y - tan_y * p.z),
            bottom: reach.bottom.max(-p.y - tan_y * p.z),
            nearest: reach.nearest.min(p.z),
        })
    }

    /// The extremes of the circles of points around `axis`, a unit vector with x = 0.
    ///
    /// Each value is a linear function g · p, whose largest value on a circle of radius ρ about the axis a at height h is
    /// h (g · a) + ρ |g − (g · a) a|.
    fn all_around(points: impl Iterator<Item = Vec3>, axis: Vec3, tan_x: f32, tan_y: f32) -> Self {
        let gradients = [
            Vec3::new(1.0, 0.0, -tan_x),
            Vec3::new(0.0, 1.0, -tan_y),
            Vec3::new(0.0, -1.0, -tan_y),
            Vec3::NEG_Z,
        ];
        let parts = gradients.map(|g| (g.dot(axis), (g - g.dot(axis) * axis).length()));
        points.fold(Self::NONE, |reach, p| {
            let height = p.dot(axis);
            let radius = (p - height * axis).length();
            let [side, top, bottom, near] = parts.map(|(h, r)| h * height + r * radius);
            Self {
                right: reach.right.max(side),
                left: reach.left.max(side),
                top: reach.top.max(top),
                bottom: reach.bottom.max(bottom),
                nearest: reach.nearest.min(-near),
            }
        })
    }
}

/// The corners of a cube.
fn cube(center: Vec3, half: f32) -> [Vec3; 8] {
    corners(&Aabb { min: center - half, max: center + half })
}

/// The corners of a box.
pub(super) fn corners(bounds: &Aabb) -> [Vec3; 8] {
    let ends = [bounds.min, bounds.max];
    std::array::from_fn(|i| Vec3::new(ends[i & 1].x, ends[i >> 1 & 1].y, ends[i >> 2 & 1].z))
}

impl CameraSettings {
    /// A view from the front, 20° from above, that fits `bounds` into a picture of `aspect` = width / height with a
    /// small margin; [`Framing`] has other views, and [`Scene::framed`] fits the scene's vertices, which is tighter.
    ///
    /// Empty or infinite bounds mean the cube from −1 to 1, and an `up` of zero means +Y.
    pub fn framing(bounds: &Aabb, aspect: f32, up: Vec3) -> Self {
        let corners = if bounds.is_empty() { None } else { Some(corners(bounds)) };
        Framing::new(aspect, up).fit(corners.into_iter().flatten())
    }
}

impl Camera {
    /// The scene's own camera, or one that frames the scene, for a picture of `width` × `height` pixels, each at
    /// least 1. If the file's camera is invalid, a framing camera replaces it.
    ///
    /// # Panics
    /// If width or height are zero.
    pub fn framing(scene: &Scene, width: usize, height: usize) -> Self {
        assert!(width > 0 && height > 0, "a picture of {width} x {height} has no pixels");
        let aspect = width as f32 / height as f32;
        let up = scene.up_axis().vector();
        let framed = || scene.framed(&Framing::new(aspect, up));
        Self::new(&scene.camera(aspect), width, height)
            .or_else(|_| Self::new(&framed(), width, height))
            .expect("framing settings make a picture")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vec3;
    use crate::scene::builtin::shapes;

    /// The least and the largest of the picture's coordinates, from −1 to 1, at which points are seen.
    fn seen(s: &CameraSettings, aspect: f32, points: &[Vec3]) -> [[f32; 2]; 2] {
        let Projection::Perspective { fov_y_degrees } = s.projection else { panic!() };
        let f = (s.target - s.origin).normalize();
        let r = f.cross(s.up).normalize();
        let u = r.cross(f);
        let tan = (0.5 * fov_y_degrees).to_radians().tan();
        let mut range = [[f32::INFINITY, f32::NEG_INFINITY]; 2];
        for p in points {
            let d = *p - s.origin;
            let z = f.dot(d);
            assert!(z > 0.0, "behind the camera");
            let at = [r.dot(d) / (z * tan * aspect), u.dot(d) / (z * tan)];
            for (range, at) in range.iter_mut().zip(at) {
                *range = [range[0].min(at), range[1].max(at)];
            }
        }
        range
    }

    fn shapes() -> Vec<Vec<Vec3>> {
        let sphere = shapes::icosphere(3).positions;
        let ball = sphere.iter().map(|p| *p * 0.3 + vec3(9.0, 1.0, -4.0));
        let slab = corners(&Aabb { min: vec3(-3.0, 1.0, 2.0), max: vec3(4.0, 1.2, 9.0) });
        let rod = corners(&Aabb { min: vec3(0.0, 7.0, 1.0), max: vec3(2.0, 7.1, 1.3) });
        vec![ball.collect(), slab.to_vec(), rod.to_vec()]
    }

    fn views() -> impl Iterator<Item = ViewDirection> {
        let named = ViewDirection::NAMED.into_iter().map(|(_, view)| view);
        named.chain([ViewDirection::DEFAULT, ViewDirection::new(-130.0, -35.0).unwrap()])
    }

    /// The tighter side of the picture is filled up to the margin, and the subject stands in the middle.
    #[test]
    fn a_framed_subject_fills_its_picture() {
        for points in shapes() {
            for up in [Vec3::Y, Vec3::Z, vec3(0.0, 1.0, 1.0)] {
                for aspect in [0.4, 1.0, 2.5] {
                    for view in views() {
                        let framing = Framing { view: Some(view), ..Framing::new(aspect, up) };
                        let s = framing.fit(points.iter().copied());
                        Camera::new(&s, 30, 30).unwrap();
                        let [x, y] = seen(&s, aspect, &points);
                        let widest = (x[1] - x[0]).max(y[1] - y[0]);
                        assert!((0.5 * widest - FILL).abs() < 1e-3, "{view} {aspect} {x:?} {y:?}");
                        assert!((x[0] + x[1]).abs() < 0.6 && x[1] < FILL + 1e-3);
                        assert!((y[0] + y[1]).abs() < 0.6 && y[1] < FILL + 1e-3);
                    }
                }
            }
        }
    }

    #[test]
    fn all_around_a_subject_never_leaves_the_picture() {
        for points in shapes() {
            for elevation in [-90.0, -20.0, 0.0, 35.0] {
                let mut widest = [0.0f32; 2];
                for turn in 0..24 {
                    let view = ViewDirection::new(15.0 * turn as f32, elevation).ok();
                    let framing = Framing { view, all_around: true, ..Framing::new(1.5, Vec3::Y) };
                    let s = framing.fit(points.iter().copied());
                    let [x, y] = seen(&s, 1.5, &points);
                    for (widest, range) in widest.iter_mut().zip([x, y]) {
                        *widest = widest.max(range[1]).max(-range[0]);
                    }
                }
                let widest = widest[0].max(widest[1]);
                assert!(widest < FILL + 1e-3 && widest > 0.9 * FILL, "{elevation}: {widest}");
            }
        }
    }

    #[test]
    fn views_are_on_the_side_that_they_name() {
        let points = shapes::icosphere(2).positions;
        let toward = |name: &str, up| {
            let framing = Framing { view: name.parse().ok(), ..Framing::new(1.0, up) };
            let s = framing.fit(points.iter().copied());
            (s.origin - s.target).normalize()
        };
        let near = |a: Vec3, b: Vec3| assert!((a - b).length() < 1e-3, "{a} is not {b}");
        for (name, y_up, z_up) in [
            ("front", Vec3::Z, Vec3::NEG_Y),
            ("back", Vec3::NEG_Z, Vec3::Y),
            ("right", Vec3::X, Vec3::X),
            ("left", Vec3::NEG_X, Vec3::NEG_X),
            ("top", Vec3::Y, Vec3::Z),
            ("bottom", Vec3::NEG_Y, Vec3::NEG_Z),
            ("90,0", Vec3::X, Vec3::X),
        ] {
            near(toward(name, Vec3::Y), y_up);
            near(toward(name, Vec3::Z), z_up);
        }
    }

    #[test]
    fn views_are_read_and_written() {
        for view in views() {
            assert_eq!(view.to_string().parse(), Ok(view));
        }
        assert_eq!("30, -15".parse(), ViewDirection::new(30.0, -15.0));
        for text in ["", "side", "1", "1,2,3", "nan,0", "0,91", "inf,0"] {
            let error = text.parse::<ViewDirection>().unwrap_err().to_string();
            assert!(error.contains("three-quarter") && error.contains(&format!("{text:?}")));
        }
    }

    #[test]
    fn odd_subjects_are_framed() {
        let framing = Framing::new(1.0, Vec3::ZERO);
        for points in [vec![], vec![Vec3::ONE], vec![Vec3::splat(f32::INFINITY), Vec3::ZERO]] {
            Camera::new(&framing.fit(points.iter().copied()), 4, 4).unwrap();
        }
        let wide = Framing { fov_y_degrees: 200.0, ..framing };
        assert_eq!(wide.fit([Vec3::ZERO, Vec3::ONE].into_iter()), {
            framing.fit([Vec3::ZERO, Vec3::ONE].into_iter())
        });
    }

    #[test]
    fn framing_fits_the_bounds() {
        let bounds = Aabb { min: vec3(-3.0, 1.0, 2.0), max: vec3(4.0, 2.0, 9.0) };
        for up in [Vec3::Y, Vec3::Z, vec3(0.0, 1.0, 1.0)] {
            for (w, h) in [(300, 100), (100, 100), (100, 300)] {
                let s = CameraSettings::framing(&bounds, w as f32 / h as f32, up);
                Camera::new(&s, w, h).unwrap();
                let [f, r, u] = crate::scene::camera::basis(&s).unwrap();
                let t = 17.5f32.to_radians().tan();
                for i in 0..8 {
                    let pick = |k: i32, lo: f32, hi: f32| if i >> k & 1 == 0 { lo } else { hi };
                    let corner = vec3(
                        pick(0, bounds.min.x, bounds.max.x),
                        pick(1, bounds.min.y, bounds.max.y),
                        pick(2, bounds.min.z, bounds.max.z),
                    ) - s.origin;
                    let z = f.dot(corner);
                    assert!(z > 0.0);
                    assert!(r.dot(corner).abs() < z * t * w as f32 / h as f32);
                    assert!(u.dot(corner).abs() < z * t);
                }
            }
        }
        let s = CameraSettings::framing(&bounds, 1.0, Vec3::Y);
        assert!(s.origin.z > bounds.max.z && s.origin.y > bounds.max.y);
        for odd in [Aabb::EMPTY, Aabb { min: Vec3::ONE, max: Vec3::ONE }] {
            Camera::new(&CameraSettings::framing(&odd, 1.0, Vec3::ZERO), 4, 4).unwrap();
        }
    }
}
