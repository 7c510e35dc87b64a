//! Vectors and the local frame of a shading point.
//!
//! The world is right-handed with +Y up. Vectors are [`glam`]'s; directions are unit vectors.

pub(crate) mod functions;

pub use glam::{DVec3, Mat3, Mat4, Quat, Vec2, Vec3, Vec4, vec2, vec3};

pub use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, PI, TAU};

use crate::simd::{SimdFloat, Vectors};

/// The angle of (x, y) from the x axis in [−π, π], to 5·10⁻⁷.
///
/// arctan t = t P(t²) on [0, 1], P a minimax polynomial of relative error 2·10⁻⁸; the other octants by
/// reflection.
#[inline(always)]
pub(crate) fn atan2<F: SimdFloat>(y: F, x: F) -> F {
    const P: [f32; 9] = [
        1.0,
        -0.333_330_72,
        0.199_926_2,
        -0.142_036_45,
        0.106_409_35,
        -0.075_042_96,
        0.042_691_533,
        -0.016_068_636,
        0.002_849_890_6,
    ];
    let (ax, ay) = (x.abs(), y.abs());
    let t = ax.min(ay) / ax.max(ay).max(x.splat(f32::MIN_POSITIVE));
    let octant = t * polynomial(t.squared(), &P);
    let quadrant = F::select(ax.lt(ay), x.splat(FRAC_PI_2) - octant, octant);
    let zero = x.splat(0.0);
    let half = F::select(x.lt(zero), x.splat(PI) - quadrant, quadrant);
    F::select(y.lt(zero), zero - half, half)
}

/// Sine and cosine of `u` turns for u in [0, 1], to 2·10⁻⁷.
#[inline(always)]
pub(crate) fn sin_cos_turns<F: SimdFloat>(u: F) -> [F; 2] {
    // Half a turn less, which changes both signs.
    let [sin, cos] = sin_cos_half_turns(u - u.splat(0.5));
    [u.splat(0.0) - sin, u.splat(0.0) - cos]
}

/// Sine and cosine of `x` turns for x in [−½, ½], to 2·10⁻⁷.
///
/// sin 2πt = t P(t²) on [0, ¼], P a minimax polynomial; the other quadrants by reflection.
#[inline(always)]
pub(crate) fn sin_cos_half_turns<F: SimdFloat>(x: F) -> [F; 2] {
    let (zero, quarter) = (x.splat(0.0), x.splat(0.25));
    let t = x.abs();
    let folded = t.min(x.splat(0.5) - t);
    let (sin, cos) = (sine_of_quarter(folded), sine_of_quarter(quarter - folded));
    let sin = F::select(x.lt(zero), zero - sin, sin);
    [sin, F::select(t.lt(quarter), cos, zero - cos)]
}

/// Sine and cosine of `t` eighths of a turn for t in [−1, 1], to 2·10⁻⁷.
#[inline(always)]
pub(crate) fn sin_cos_eighth<F: SimdFloat>(t: F) -> [F; 2] {
    let t = t * t.splat(0.125);
    [sine_of_quarter(t), sine_of_quarter(t.splat(0.25) - t.abs())]
}

/// sin 2πt on [−¼, ¼].
#[inline(always)]
fn sine_of_quarter<F: SimdFloat>(t: F) -> F {
    const P: [f32; 5] = [6.283_185_5, -41.341_68, 81.602_234, -76.574_99, 39.710_92];
    t * polynomial(t.squared(), &P)
}

/// Σ cₖ xᵏ by Horner's rule.
#[inline(always)]
fn polynomial<F: SimdFloat, const N: usize>(x: F, c: &[f32; N]) -> F {
    let mut sum = x.splat(c[N - 1]);
    for &c in c[..N - 1].iter().rev() {
        sum = sum * x + x.splat(c);
    }
    sum
}

/// 1 / (4π), the density of the uniform distribution over the sphere \[sr⁻¹\].
pub const FRAC_1_4PI: f32 = 0.25 * FRAC_1_PI;

/// An orthonormal right-handed basis; `z` is the shading normal, `x` the tangent.
///
/// BRDF code works in the local frame, where the cosine to the normal is the z component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The tangent, the direction of `alpha_x` of an anisotropic lobe.
    pub x: Vec3,
    /// The bitangent, `z × x`.
    pub y: Vec3,
    /// The normal.
    pub z: Vec3,
}

impl Frame {
    /// Creates a frame around the unit vector `z`, continuous everywhere except at z = −Z.
    pub fn from_z(z: Vec3) -> Self {
        let [x, y] = tangents(z.into()).map(Vec3::from);
        Self { x, y, z }
    }

    /// Creates a frame around the unit vector `z` whose x axis is as close to `tangent` as possible.
    ///
    /// Falls back to [`Frame::from_z`] if `tangent` is parallel to `z`, zero or not finite.
    pub fn from_z_and_tangent(z: Vec3, tangent: Vec3) -> Self {
        let x = tangent - z * z.dot(tangent);
        match x.try_normalize() {
            Some(x) if x.length_squared() > 0.5 => Self { x, y: z.cross(x), z },
            _ => Self::from_z(z),
        }
    }

    /// Transforms from world to local space.
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        vec3(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// Transforms from local to world space.
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}

/// The x and y axes of frames around unit vectors, see [`Frame::from_z`].
///
/// Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
#[inline(always)]
pub(crate) fn tangents<F: SimdFloat>(n: Vectors<F>) -> [Vectors<F>; 2] {
    let (zero, one) = (n.z.splat(0.0), n.z.splat(1.0));
    let sign = F::select(n.z.lt(zero), zero - one, one);
    let a = (zero - one) / (sign + n.z);
    let b = n.x * n.y * a;
    [
        Vectors { x: one + sign * n.x * n.x * a, y: sign * b, z: (zero - sign) * n.x },
        Vectors { x: b, y: sign + n.y * n.y * a, z: zero - n.y },
    ]
}

/// The rotation by an angle about the x axis \[rad\].
#[cfg(feature = "render")]
pub(crate) fn rotation_x(angle: f32) -> Mat3 {
    let (sin, cos) = functions::sin_cos(angle);
    Mat3::from_cols(Vec3::X, vec3(0.0, cos, sin), vec3(0.0, -sin, cos))
}

/// The rotation by an angle about the y axis \[rad\].
pub(crate) fn rotation_y(angle: f32) -> Mat3 {
    let (sin, cos) = functions::sin_cos(angle);
    Mat3::from_cols(vec3(cos, 0.0, -sin), Vec3::Y, vec3(sin, 0.0, cos))
}

/// The rotation by an angle about the z axis \[rad\].
#[cfg(feature = "render")]
pub(crate) fn rotation_z(angle: f32) -> Mat3 {
    let (sin, cos) = functions::sin_cos(angle);
    Mat3::from_cols(vec3(cos, sin, 0.0), vec3(-sin, cos, 0.0), Vec3::Z)
}

/// The mirror direction of `w` about the unit vector `n`; both point away from the surface.
pub fn reflect(w: Vec3, n: Vec3) -> Vec3 {
    2.0 * w.dot(n) * n - w
}

/// A unit vector from spherical angles about +z: cos θ, and φ from +x \[rad\].
pub fn from_spherical(cos_theta: f32, phi: f32) -> Vec3 {
    let sin_theta = ((1.0 - cos_theta) * (1.0 + cos_theta)).max(0.0).sqrt();
    let (sin_phi, cos_phi) = functions::sin_cos(phi);
    vec3(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
}

/// x².
pub fn sqr(x: f32) -> f32 {
    x * x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_those_of_double_precision() {
        let mut worst = 0.0f64;
        for i in 0..40_000 {
            let phi = f64::from(i) * 1e-4 * std::f64::consts::TAU;
            for radius in [1e-6, 0.3, 1.0, 7e5] {
                let (y, x) = ((radius * phi.sin()) as f32, (radius * phi.cos()) as f32);
                let error = f64::from(atan2(y, x)) - f64::from(y).atan2(f64::from(x));
                worst = worst.max(error.abs());
            }
        }
        assert!(worst < 5e-7, "{worst}");
        assert_eq!((atan2(0.0, 0.0), atan2(0.0, 1.0), atan2(0.0, -1.0)), (0.0, 0.0, PI));
        assert_eq!((atan2(1.0, 0.0), atan2(-1.0, 0.0)), (FRAC_PI_2, -FRAC_PI_2));
    }

    #[test]
    fn turns_are_those_of_double_precision() {
        let mut worst = 0.0f64;
        for i in 0..=1 << 16 {
            let u = i as f32 / 65536.0;
            let (sin, cos) = (std::f64::consts::TAU * f64::from(u)).sin_cos();
            let [s, c] = sin_cos_turns(u).map(f64::from);
            worst = worst.max((s - sin).abs()).max((c - cos).abs());
        }
        assert!(worst < 2.5e-7, "{worst}");
    }

    #[cfg(feature = "render")]
    #[test]
    fn rotations_are_those_of_glam() {
        for i in -20..20 {
            let angle = 0.37 * i as f32;
            let pairs = [
                (rotation_x(angle), Mat3::from_rotation_x(angle)),
                (rotation_y(angle), Mat3::from_rotation_y(angle)),
                (rotation_z(angle), Mat3::from_rotation_z(angle)),
            ];
            assert!(pairs.iter().all(|(own, glam)| own.abs_diff_eq(*glam, 1e-6)), "{angle}");
        }
    }

    #[test]
    fn frames_are_orthonormal_and_right_handed() {
        for i in 0..200 {
            let t = i as f32 / 199.0;
            let z = from_spherical(1.0 - 2.0 * t, 37.0 * t);
            for f in [Frame::from_z(z), Frame::from_z_and_tangent(z, vec3(0.3, 1.0, -0.2))] {
                assert!((f.x.cross(f.y) - f.z).length() < 1e-5);
                assert!(f.x.dot(f.y).abs() < 1e-6 && (f.x.length() - 1.0).abs() < 1e-6);
                let v = vec3(0.1, -0.7, 0.4);
                assert!((f.to_world(f.to_local(v)) - v).length() < 1e-5);
            }
        }
    }

    #[test]
    fn a_useless_tangent_falls_back() {
        for tangent in [Vec3::ZERO, Vec3::Z, Vec3::NAN, vec3(0.0, 0.0, 1e-30)] {
            assert_eq!(Frame::from_z_and_tangent(Vec3::Z, tangent), Frame::from_z(Vec3::Z));
        }
    }
}
