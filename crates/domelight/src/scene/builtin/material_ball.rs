//! The material ball: a sphere with a girdle cut through to its core, tilted in a cradle.
//!
//! It shows a material on smooth curvature, on tight rounded edges, in a narrow groove and in contact
//! shadow at once.

use super::shapes::{arc, lathe, uv_sphere};
use crate::geometry::Mesh;
use crate::math::{FRAC_PI_2, Mat4, PI, Vec2, Vec3, functions, rotation_x, rotation_z, vec2};

/// Height of the ball's center above the floor; its radius is 1.
pub(crate) const CENTER_HEIGHT: f32 = 1.14;

/// Half the width of the girdle.
const GIRDLE: f32 = 0.17;
/// Radius of the rounded edges.
const EDGE: f32 = 0.035;
/// Radius of the core.
const CORE: f32 = 0.79;
/// Radius of the polar recess.
const RECESS: f32 = 0.36;
/// Sectors round the axis.
const SEGMENTS: u32 = 192;

/// The ball: a sphere of radius 1 cut in at its girdle and recessed at its upper pole.
pub(crate) fn ball() -> Mesh {
    let lower = lip(GIRDLE, -1.0);
    let upper = lip(GIRDLE, 1.0);
    let mut profile = arc(Vec2::ZERO, 1.0, -FRAC_PI_2, lower.angle, 48);
    profile[0].x = 0.0;
    profile.extend(arc(lower.center, EDGE, lower.angle, FRAC_PI_2, 10).into_iter().skip(1));
    // Below the surface of the core.
    profile.push(vec2(0.9 * CORE, -GIRDLE));
    profile.push(vec2(0.9 * CORE, GIRDLE));
    profile.extend(arc(upper.center, EDGE, -FRAC_PI_2, upper.angle, 10));
    profile.extend(recessed_pole(upper.angle));
    placed(lathe(&profile, SEGMENTS))
}

/// The core, seen in the girdle.
pub(crate) fn core() -> Mesh {
    let mut mesh = uv_sphere(SEGMENTS, SEGMENTS / 2);
    mesh.transform(&Mat4::from_scale(Vec3::splat(CORE)));
    placed(mesh)
}

/// The cradle, standing on y = 0.
pub(crate) fn cradle() -> Mesh {
    let mut profile = vec![Vec2::ZERO];
    profile.extend(arc(vec2(0.80, 0.02), 0.02, -FRAC_PI_2, 0.0, 6));
    profile.extend(arc(vec2(0.80, 0.06), 0.02, 0.0, FRAC_PI_2, 6));
    // A hollow up to the rim, the rim, and down into the bowl under the ball.
    profile.extend(arc(vec2(0.74, 0.22), 0.14, -FRAC_PI_2, -PI, 16));
    profile.extend(arc(vec2(0.56, 0.265), 0.04, 0.0, PI, 12));
    profile.push(vec2(0.0, 0.1));
    lathe(&profile, SEGMENTS)
}

/// A rounded edge between the sphere and the girdle.
struct Lip {
    /// Center of the edge's arc.
    center: Vec2,
    /// Where the arc leaves the sphere \[rad above the equator\].
    angle: f32,
}

/// The edge at height `side · half_width`: its circle touches that plane and the unit sphere inside.
fn lip(half_width: f32, side: f32) -> Lip {
    let y = side * (half_width + EDGE);
    let center = vec2((functions::powi(1.0 - EDGE, 2) - y * y).sqrt(), y);
    Lip { center, angle: functions::atan2(center.y, center.x) }
}

/// The sphere from the latitude `from` to the rim of the recess at the pole, and its flat ground.
fn recessed_pole(from: f32) -> Vec<Vec2> {
    let x = RECESS + EDGE;
    let center = vec2(x, (functions::powi(1.0 - EDGE, 2) - x * x).sqrt());
    let rim = functions::atan2(center.y, center.x);
    let ground = center.y - 2.0 * EDGE;
    let mut profile: Vec<Vec2> = arc(Vec2::ZERO, 1.0, from, rim, 40).split_off(1);
    profile.extend(arc(center, EDGE, rim, PI, 10).into_iter().skip(1));
    // A fillet into the ground.
    let fillet = vec2(RECESS - EDGE, ground + EDGE);
    profile.extend(arc(fillet, EDGE, 0.0, -FRAC_PI_2, 8));
    profile.push(vec2(0.0, ground));
    profile
}

/// Tilted toward +x and +z, and lifted onto the cradle.
fn placed(mut mesh: Mesh) -> Mesh {
    let tilt = Mat4::from_mat3(rotation_x(0.55) * rotation_z(-0.42));
    mesh.transform(&(Mat4::from_translation(CENTER_HEIGHT * Vec3::Y) * tilt));
    mesh
}
