//! Mappings between pictures of light probes and the sphere of directions, with conversion to and from the
//! lat-long working map.
//!
//! Every mapping is a pair of inverse functions between picture coordinates (u, v) ∈ \[0, 1\]² (u right, v down)
//! and directions in the world frame (right-handed, +Y up), with its Jacobian dω / (du dv). A texel's value is
//! constant over the texel, so conversion is an area average: each target texel is the mean of the source over
//! the texel's solid angle, from the exact overlap of texels (`overlap.rs`). Supersampling was rejected, because it
//! loses or doubles texel-sized lights. So was bilinear look-up, because it smears a one-texel sun over its neighbors
//! and disagrees with the constant texels of the importance table.
//!
//! Sources: Debevec 1998, "Rendering Synthetic Objects into Real Scenes", and his light-probe gallery (angular
//! map); Reinhard et al. 2010, "High Dynamic Range Imaging", ch. 11 (angular map, mirrored sphere, vertical
//! cross); OpenEXR's environment map conventions (`ImfEnvmap.h`); Clarberg 2008, "Fast Equal-Area Mapping of the
//! (Hemi)Sphere using SIMD" (octahedral).

mod convert;
mod cube;
mod faces;
mod fisheye;
mod overlap;

pub(crate) use convert::from_lat_long_in;
pub use convert::{fisheye_to_lat_long, from_lat_long, to_lat_long};
pub use cube::CubeLayout;
pub use faces::{CubeFaces, UnknownFaces};
pub use fisheye::Fisheye;
pub(crate) use overlap::MapFrame;

use crate::math::{PI, TAU, Vec2, Vec3, functions, sqr, vec2, vec3};
use crate::names::read_by_name;

/// The value of the `envmap` attribute of an OpenEXR file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EnvmapKind {
    /// Latitude and longitude, with the center toward +Z.
    LatLong,
    /// The six faces of a cube, stacked vertically.
    Cube,
}

/// A mapping between picture coordinates and directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Mapping {
    /// Latitude and longitude, the working map. Row 0 is +Y, the center column looks toward −Z, and u grows to
    /// the right as seen from inside.
    LatLong,
    /// Latitude and longitude as defined by OpenEXR's `envmap` attribute: like [`Mapping::LatLong`], but the center
    /// column looks toward +Z. OpenEXR puts the centers of the border texels on the border (texel 0 at longitude
    /// π exactly). Here, as in all other mappings, texels are areas, which shifts a texel by less than half its size.
    LatLongExr,
    /// Debevec's light probe: a disc whose radius is the angle to −Z over π; the center looks toward −Z, the
    /// circumference is +Z, right is +X, up is +Y.
    Angular,
    /// An orthographic photograph of a mirror ball that touches the borders of the picture. The camera is at −Z of
    /// the ball, so the center, which reflects the camera, looks toward −Z like that of the angular map, and the
    /// circumference grazes +Z. It is a reflection, so u grows to the *left* as seen from inside, and an unedited
    /// photograph gives an environment in which text reads correctly. (pfstools and the book of Reinhard et al.
    /// expect ball pictures that were mirrored beforehand.)
    MirrorBall,
    /// The six faces of a cube, unfolded in one of several layouts.
    Cube(CubeLayout),
    /// The equal-area octahedral square with +Y at its center and −Y at its corners, as in pbrt-v4. It is rotated so
    /// that a lat-long map converted by pbrt's `imgtool makeequiarea` converts back to the same map.
    Octahedral,
}

/// A picture whose shape does not fit the mapping.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{mapping} maps have width : height = {}:{}, this picture is {width}x{height}", .mapping.aspect().0, .mapping.aspect().1)]
pub struct ShapeError {
    /// The requested mapping.
    pub mapping: Mapping,
    /// The number of columns of the picture.
    pub width: usize,
    /// The number of rows of the picture.
    pub height: usize,
}

impl Mapping {
    /// All mappings.
    pub const ALL: [Self; 9] = [
        Self::LatLong,
        Self::LatLongExr,
        Self::Angular,
        Self::MirrorBall,
        Self::Cube(CubeLayout::CrossHorizontal),
        Self::Cube(CubeLayout::CrossVertical),
        Self::Cube(CubeLayout::StripHorizontal),
        Self::Cube(CubeLayout::StripVertical),
        Self::Octahedral,
    ];

    /// The name that [`FromStr`](std::str::FromStr) understands.
    pub const fn name(self) -> &'static str {
        match self {
            Self::LatLong => "lat-long",
            Self::LatLongExr => "lat-long-exr",
            Self::Angular => "angular",
            Self::MirrorBall => "mirror-ball",
            Self::Cube(layout) => layout.name(),
            Self::Octahedral => "octahedral",
        }
    }

    /// The ratio of width to height in lowest terms. Lat-long maps with any other shape are accepted too.
    pub const fn aspect(self) -> (usize, usize) {
        match self {
            Self::LatLong | Self::LatLongExr => (2, 1),
            Self::Angular | Self::MirrorBall | Self::Octahedral => (1, 1),
            Self::Cube(layout) => layout.faces_across_and_down(),
        }
    }

    /// Whether a picture of `width` × `height` texels can be in this mapping.
    ///
    /// # Errors
    /// If it does not have the exact ratio [`Mapping::aspect`]; lat-long maps may have any shape.
    pub fn check_shape(self, width: usize, height: usize) -> Result<(), ShapeError> {
        let (columns, rows) = self.aspect();
        let any_shape = matches!(self, Self::LatLong | Self::LatLongExr);
        if any_shape || width as u128 * rows as u128 == height as u128 * columns as u128 {
            Ok(())
        } else {
            Err(ShapeError { mapping: self, width, height })
        }
    }

    /// The likely mapping of a picture from its size and its OpenEXR attribute.
    ///
    /// The attribute decides if the shape fits. Otherwise, 1:1 is an angular map, 4:3 and 3:4 a cross, 6:1 and 1:6 a
    /// strip of faces, and everything else, including a single texel, is lat-long. A square may also be a mirror ball
    /// or octahedral; the size does not distinguish them.
    pub fn guess(width: usize, height: usize, envmap: Option<EnvmapKind>) -> Self {
        let has_shape = |mapping: &Self| mapping.check_shape(width, height).is_ok();
        match envmap {
            Some(EnvmapKind::LatLong) => return Self::LatLongExr,
            Some(EnvmapKind::Cube) => {
                let strip = Self::Cube(CubeLayout::StripVertical);
                if has_shape(&strip) {
                    return strip;
                }
            }
            None => {}
        }
        if width == 1 && height == 1 {
            return Self::LatLong;
        }
        let cubes = CubeLayout::ALL.map(Self::Cube);
        std::iter::once(Self::Angular).chain(cubes).find(has_shape).unwrap_or(Self::LatLong)
    }

    /// The value of OpenEXR's `envmap` attribute for the mapping, if there is one.
    pub const fn envmap(self) -> Option<EnvmapKind> {
        match self {
            Self::LatLongExr => Some(EnvmapKind::LatLong),
            Self::Cube(CubeLayout::StripVertical) => Some(EnvmapKind::Cube),
            Self::LatLong
            | Self::Angular
            | Self::MirrorBall
            | Self::Cube(
                CubeLayout::CrossHorizontal
                | CubeLayout::CrossVertical
                | CubeLayout::StripHorizontal,
            )
            | Self::Octahedral => None,
        }
    }

    /// The unit direction at (u, v); `None` outside \[0, 1\]², the disc or the faces of the cross.
    pub fn direction(self, uv: Vec2) -> Option<Vec3> {
        if !(0.0..=1.0).contains(&uv.x) || !(0.0..=1.0).contains(&uv.y) {
            return None;
        }
        match self {
            Self::LatLong => Some(lat_long_direction(uv)),
            Self::LatLongExr => Some(half_turn(lat_long_direction(uv))),
            Self::Angular => angular_direction(uv),
            Self::MirrorBall => mirror_ball_direction(uv),
            Self::Octahedral => Some(octahedral_direction(uv)),
            Self::Cube(layout) => layout.direction(uv),
        }
    }

    /// The coordinates of a unit direction, in \[0, 1\]².
    pub fn uv(self, direction: Vec3) -> Vec2 {
        let uv = match self {
            Self::LatLong => lat_long_uv(direction),
            Self::LatLongExr => lat_long_uv(half_turn(direction)),
            Self::Angular => angular_uv(direction),
            Self::MirrorBall => mirror_ball_uv(direction),
            Self::Octahedral => octahedral_uv(direction),
            Self::Cube(layout) => layout.uv(direction),
        };
        uv.clamp(Vec2::ZERO, Vec2::ONE)
    }

    /// dω / (du dv) \[sr\] at (u, v); zero where there is no direction. Its integral over the picture is 4π.
    pub fn solid_angle_density(self, uv: Vec2) -> f32 {
        self.direction(uv).map_or(0.0, |direction| self.density_at(uv, direction))
    }

    fn density_at(self, uv: Vec2, direction: Vec3) -> f32 {
        match self {
            Self::LatLong | Self::LatLongExr => PI * TAU * functions::sin(PI * uv.y).max(0.0),
            Self::Angular => {
                let r = disc(uv).length();
                let sinc = if r < 1e-4 { PI } else { functions::sin(PI * r).max(0.0) / r };
                4.0 * PI * sinc
            }
            // sin θ dθ = 4 r dr for θ = 2 asin r: the reflection in a ball preserves area.
            Self::MirrorBall => 16.0,
            Self::Octahedral => 4.0 * PI,
            // dω = ds dt / (1 + s² + t²)^{3/2}, and 1/√(1 + s² + t²) is the largest component.
            Self::Cube(layout) => {
                let (columns, rows) = layout.faces_across_and_down();
                4.0 * (columns * rows) as f32 * functions::powi(direction.abs().max_element(), 3)
            }
        }
    }

    /// The height of a lat-long map that keeps the finest detail of a picture of this mapping.
    ///
    /// The lat-long texel π / height is as wide as the source's widest texel in the center of the picture.
    pub fn lat_long_height(self, width: usize, height: usize) -> usize {
        let edge = height as f32 / self.aspect().1 as f32;
        let keeps = match self {
            Self::LatLong | Self::LatLongExr => return height,
            Self::Angular => 0.5 * height as f32,
            Self::MirrorBall => 0.25 * PI * height as f32,
            Self::Octahedral => 0.5 * PI.sqrt() * width as f32,
            Self::Cube(_) => 0.5 * PI * edge,
        };
        (keeps.ceil() as usize).max(1)
    }

    /// The size (width, height) of a picture in this mapping that keeps the detail of a lat-long map of a size.
    pub fn size_of(self, [width, height]: [usize; 2]) -> (usize, usize) {
        match self {
            Self::LatLong | Self::LatLongExr => (width, height),
            Self::Angular | Self::MirrorBall | Self::Octahedral | Self::Cube(_) => {
                self.size_for(height)
            }
        }
    }

    /// The size (width, height) of a picture in this mapping that keeps the detail of a lat-long map with
    /// `lat_long_height` rows: the inverse of [`Mapping::lat_long_height`].
    pub fn size_for(self, lat_long_height: usize) -> (usize, usize) {
        let h = lat_long_height as f32;
        let unit = match self {
            Self::LatLong | Self::LatLongExr => return (2 * lat_long_height, lat_long_height),
            Self::Angular => 2.0 * h,
            Self::MirrorBall => 4.0 / PI * h,
            Self::Octahedral => 2.0 / PI.sqrt() * h,
            Self::Cube(_) => 2.0 / PI * h,
        };
        let unit = (unit.ceil() as usize).max(1);
        let (columns, rows) = self.aspect();
        (columns * unit, rows * unit)
    }
}

impl std::fmt::Display for Mapping {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

read_by_name!(Mapping::ALL, UnknownMapping, "unknown mapping");

/// d = (sin φ sin θ, cos θ, −cos φ sin θ), φ = 2π(u − ½), θ = π v.
fn lat_long_direction(uv: Vec2) -> Vec3 {
    let (sin_phi, cos_phi) = functions::sin_cos(TAU * (uv.x - 0.5));
    let (sin_theta, cos_theta) = functions::sin_cos(PI * uv.y);
    vec3(sin_phi * sin_theta, cos_theta, -cos_phi * sin_theta)
}

fn lat_long_uv(d: Vec3) -> Vec2 {
    let phi = functions::atan2(d.x, -d.z);
    let theta = functions::atan2(functions::hypot(d.x, d.z), d.y);
    vec2(phi / TAU + 0.5, theta / PI)
}

/// Half a turn about +Y.
fn half_turn(d: Vec3) -> Vec3 {
    vec3(-d.x, d.y, -d.z)
}

/// The point of the disc of radius 1, x right and y up.
fn disc(uv: Vec2) -> Vec2 {
    vec2(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y)
}

fn disc_uv(p: Vec2) -> Vec2 {
    vec2(0.5 + 0.5 * p.x, 0.5 - 0.5 * p.y)
}

/// θ = π r is the angle to −Z.
fn angular_direction(uv: Vec2) -> Option<Vec3> {
    let p = disc(uv);
    let r = p.length();
    let (sin_theta, cos_theta) = functions::sin_cos(PI * r);
    let xy = p.normalize_or_zero() * sin_theta;
    (r <= 1.0).then(|| vec3(xy.x, xy.y, -cos_theta))
}

fn angular_uv(d: Vec3) -> Vec2 {
    let xy = vec2(d.x, d.y);
    let r = functions::atan2(xy.length(), -d.z) / PI;
    // Straight backward every azimuth is right; take the rightmost point.
    let azimuth = xy.try_normalize().unwrap_or(Vec2::X);
    disc_uv(azimuth * r)
}

/// The direction to the viewer, −Z, mirrored about the normal (−x, y, −√(1−r²)) of the ball.
fn mirror_ball_direction(uv: Vec2) -> Option<Vec3> {
    let p = disc(uv);
    let r2 = p.length_squared();
    let toward = 2.0 * (1.0 - r2).max(0.0).sqrt();
    (r2 <= 1.0).then(|| vec3(-p.x * toward, p.y * toward, 2.0 * r2 - 1.0))
}

/// r = sin(θ/2) with θ the angle to −Z.
fn mirror_ball_uv(d: Vec3) -> Vec2 {
    let xy = vec2(-d.x, d.y);
    let r = functions::sin(0.5 * functions::atan2(xy.length(), -d.z));
    disc_uv(xy.try_normalize().unwrap_or(Vec2::X) * r)
}

/// Clarberg 2008; pbrt-v4 `EqualAreaSquareToSphere`, whose (x, y, z) is our (z, −x, y).
fn octahedral_direction(uv: Vec2) -> Vec3 {
    let p = 2.0 * uv - Vec2::ONE;
    let q = p.abs();
    // Radius r as the distance from the square's outline, folded at the inner diamond.
    let signed_distance = 1.0 - (q.x + q.y);
    let r = 1.0 - signed_distance.abs();
    let phi = if r == 0.0 { 0.25 * PI } else { ((q.y - q.x) / r + 1.0) * 0.25 * PI };
    let up = (1.0 - sqr(r)).copysign(signed_distance);
    let across = r * (2.0 - sqr(r)).max(0.0).sqrt();
    let (sin_phi, cos_phi) = functions::sin_cos(phi);
    vec3(-(sin_phi * across).copysign(p.y), up, (cos_phi * across).copysign(p.x))
}

fn octahedral_uv(d: Vec3) -> Vec2 {
    let (x, y, z) = (d.z, -d.x, d.y);
    let across = sqr(x) + sqr(y);
    // r = √(1 − |z|), written so that it does not cancel near the poles.
    let r = (across / (1.0 + z.abs())).sqrt();
    let phi = if across == 0.0 { 0.5 } else { functions::atan2(y.abs(), x.abs()) * (2.0 / PI) };
    let folded = vec2(r - phi * r, phi * r);
    let unfolded = if z < 0.0 { vec2(1.0 - folded.y, 1.0 - folded.x) } else { folded };
    0.5 * vec2(unfolded.x.copysign(x), unfolded.y.copysign(y)) + Vec2::splat(0.5)
}
