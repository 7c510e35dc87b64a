//! The room: four walls, a window, a table and a vase on it, lit only through the window.
//!
//! The room is 4 m wide, 3 m high and 5 m deep; its window of 1 × 1.2 m shows a few percent of the sky.

use super::shapes::{arc, lathe};
use crate::geometry::Mesh;
use crate::math::{FRAC_PI_2, Mat4, Vec2, Vec3, vec2, vec3};
use crate::strategy::Portal;

/// Half the width and half the depth of the room, along x and z.
const HALF: Vec2 = vec2(2.0, 2.5);
/// Height of the ceiling.
const HEIGHT: f32 = 3.0;
/// Thickness of the walls.
const THICKNESS: f32 = 0.15;
/// The window in the wall toward +x: its range of heights, and half its width along z.
const WINDOW_HEIGHTS: [f32; 2] = [1.0, 2.2];
const WINDOW_HALF_WIDTH: f32 = 0.5;
/// Height of the table.
const TABLE: f32 = 0.74;
/// The table's middle on the floor.
const TABLE_PLACE: Vec3 = vec3(0.35, 0.0, -0.8);

/// The walls and the ceiling, around the window.
pub(crate) fn walls() -> Mesh {
    let (x, z, t) = (HALF.x, HALF.y, THICKNESS);
    let ([low, high], w) = (WINDOW_HEIGHTS, WINDOW_HALF_WIDTH);
    // Boxes that meet reach into each other, so that no two share an edge.
    let (above, beside) = (HEIGHT + 0.5 * t, z + 0.5 * t);
    boxes(&[
        [vec3(-x - t, HEIGHT, -z - t), vec3(x + t, HEIGHT + t, z + t)],
        [vec3(-x - t, -0.5 * t, -z), vec3(-x, above, z)],
        [vec3(-x - t, 0.0, -z - t), vec3(x + t, above, -z)],
        [vec3(-x - t, 0.0, z), vec3(x + t, above, z + t)],
        [vec3(x, 0.0, -z), vec3(x + t, low, z)],
        [vec3(x, high, -z), vec3(x + t, above, z)],
        [vec3(x, low, -beside), vec3(x + t, high, -w)],
        [vec3(x, low, w), vec3(x + t, high, beside)],
    ])
}

/// The inner side of the window.
pub(crate) fn window() -> Option<Portal> {
    let ([low, high], w) = (WINDOW_HEIGHTS, WINDOW_HALF_WIDTH);
    Portal::new(vec3(HALF.x, low, -w), [(high - low) * Vec3::Y, 2.0 * w * Vec3::Z]).ok()
}

/// The floor, whose upper side is at y = 0.
pub(crate) fn floor() -> Mesh {
    let outer = HALF + Vec2::splat(THICKNESS);
    boxes(&[[vec3(-outer.x, -THICKNESS, -outer.y), vec3(outer.x, 0.0, outer.y)]])
}

/// A table of 1.2 × 0.8 m.
pub(crate) fn table() -> Mesh {
    let leg = |x: f32, z: f32| {
        let (x, z) = (0.53 * x, 0.33 * z);
        [vec3(x - 0.03, 0.0, z - 0.03), vec3(x + 0.03, TABLE - 0.04, z + 0.03)]
    };
    let top = [vec3(-0.6, TABLE - 0.04, -0.4), vec3(0.6, TABLE, 0.4)];
    let mut mesh = boxes(&[top, leg(-1.0, -1.0), leg(-1.0, 1.0), leg(1.0, -1.0), leg(1.0, 1.0)]);
    mesh.transform(&Mat4::from_translation(TABLE_PLACE));
    mesh
}

/// A vase on the table.
pub(crate) fn vase() -> Mesh {
    let mut profile = vec![Vec2::ZERO];
    profile.extend(arc(vec2(0.08, 0.01), 0.01, -FRAC_PI_2, 0.0, 6));
    profile.extend(arc(vec2(0.04, 0.16), 0.12, -0.8, 1.1, 24));
    // The rim, and down into the neck.
    profile.extend(arc(vec2(0.07, 0.36), 0.01, -0.2, 3.1, 12));
    profile.push(vec2(0.05, 0.25));
    profile.push(vec2(0.0, 0.2));
    let mut mesh = lathe(&profile, 96);
    mesh.transform(&Mat4::from_translation(TABLE_PLACE + TABLE * Vec3::Y));
    mesh
}

/// Boxes between two corners each, with flat faces.
fn boxes(corners: &[[Vec3; 2]]) -> Mesh {
    let mut mesh = Mesh::default();
    for &[low, high] in corners {
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for (side, sign) in [(high, 1.0), (low, -1.0)] {
                let first = mesh.positions.len() as u32;
                let mut normal = Vec3::ZERO;
                normal[axis] = sign;
                for [at_u, at_v] in [[low, low], [high, low], [high, high], [low, high]] {
                    let mut p = side;
                    (p[u], p[v]) = (at_u[u], at_v[v]);
                    mesh.positions.push(p);
                    mesh.normals.push(normal);
                }
                let order = if sign > 0.0 { [0, 1, 2, 3] } else { [3, 2, 1, 0] };
                let [a, b, c, d] = order.map(|i| first + i);
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    mesh
}
