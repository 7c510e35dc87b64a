//! A photographer's dark room: soft boxes around the subject at the origin.
//!
//! Every light is a rectangle seen from the origin, brightest in the center and soft at the edge, like
//! cloth in front of a lamp.

use super::smoothstep;
use crate::color::Rgb;
use crate::math::{Vec3, functions, vec3};

/// A rectangle that faces the origin.
struct SoftBox {
    /// Center \[m\].
    center: Vec3,
    /// Half width and half height \[m\].
    half: [f32; 2],
    /// Radiance in the middle.
    radiance: Rgb,
    /// Width of the soft edge as a part of the half size.
    softness: f32,
}

const LIGHTS: [SoftBox; 7] = [
    // Key: large and warm, over the left shoulder of the camera.
    SoftBox {
        center: vec3(-3.0, 2.4, 2.6),
        half: [1.25, 1.25],
        radiance: Rgb::new(10.5, 9.4, 7.8),
        softness: 0.22,
    },
    // Fill: dim and cool, from the right.
    SoftBox {
        center: vec3(3.9, 0.9, 1.8),
        half: [1.1, 1.5],
        radiance: Rgb::new(1.25, 1.55, 2.0),
        softness: 0.35,
    },
    // Overhead bank.
    SoftBox {
        center: vec3(0.0, 3.4, -0.4),
        half: [1.7, 0.8],
        radiance: Rgb::new(5.6, 5.8, 6.0),
        softness: 0.15,
    },
    // Rim strips behind the subject: cool right, warm left.
    SoftBox {
        center: vec3(2.7, 1.0, -2.7),
        half: [0.22, 1.7],
        radiance: Rgb::new(9.5, 12.0, 16.0),
        softness: 0.35,
    },
    SoftBox {
        center: vec3(-3.3, 0.9, -2.2),
        half: [0.2, 1.5],
        radiance: Rgb::new(15.0, 9.5, 5.2),
        softness: 0.35,
    },
    // Accents near the floor.
    SoftBox {
        center: vec3(-1.7, -0.6, -3.6),
        half: [0.28, 0.18],
        radiance: Rgb::new(14.0, 2.6, 4.6),
        softness: 0.5,
    },
    SoftBox {
        center: vec3(1.2, -0.55, 3.9),
        half: [0.5, 0.14],
        radiance: Rgb::new(1.6, 6.0, 7.0),
        softness: 0.5,
    },
];

/// The room with its lights in place.
pub(super) struct Studio {
    boxes: [PlacedBox; LIGHTS.len()],
    /// The directions of the glows on the walls.
    glows: [Vec3; 4],
}

impl Studio {
    pub(super) fn new() -> Self {
        let glows = [
            vec3(0.1, 0.12, -1.0),
            vec3(-1.0, -0.15, -0.75),
            vec3(-1.0, 0.3, 0.9),
            vec3(0.0, 1.0, -0.12),
        ];
        Self { boxes: LIGHTS.map(PlacedBox::new), glows: glows.map(Vec3::normalize) }
    }

    /// Radiance from the direction `d`.
    pub(super) fn radiance(&self, d: Vec3) -> Rgb {
        self.boxes.iter().fold(self.room(d), |behind, light| match light.radiance(d) {
            Some((le, opacity)) => behind.lerp(le, opacity),
            None => behind,
        })
    }

    /// Dark walls that catch a little of the lights, a backdrop with a glow behind the subject, the floor.
    fn room(&self, d: Vec3) -> Rgb {
        let wall = Rgb::new(0.030, 0.031, 0.035)
            .lerp(Rgb::new(0.012, 0.013, 0.016), smoothstep(-0.1, 0.8, d.y));
        let floor = Rgb::new(0.085, 0.080, 0.076)
            .lerp(Rgb::new(0.030, 0.029, 0.030), smoothstep(0.9, 0.1, -d.y));
        let glow = |i: usize, power: f32, color: Rgb| {
            color * functions::powf(d.dot(self.glows[i]).max(0.0), power)
        };
        let base = wall.lerp(floor, smoothstep(0.06, -0.10, d.y));
        base + glow(0, 7.0, Rgb::new(0.10, 0.13, 0.19))
            + glow(1, 12.0, Rgb::new(0.09, 0.045, 0.02))
            + glow(2, 6.0, Rgb::new(0.09, 0.075, 0.055))
            + glow(3, 10.0, Rgb::new(0.07, 0.072, 0.075))
    }
}

/// A soft box and its frame.
struct PlacedBox {
    light: SoftBox,
    normal: Vec3,
    axes: [Vec3; 2],
    distance: f32,
}

impl PlacedBox {
    fn new(light: SoftBox) -> Self {
        let normal = light.center.normalize();
        let up = if normal.y.abs() > 0.9 { Vec3::NEG_Z } else { Vec3::Y };
        let x_axis = normal.cross(up).normalize();
        let distance = light.center.length();
        Self { light, normal, axes: [x_axis, x_axis.cross(normal)], distance }
    }

    /// Radiance and opacity toward the direction `d` from the origin; `None` beside the box.
    fn radiance(&self, d: Vec3) -> Option<(Rgb, f32)> {
        /// From the center, in half sizes: the edge, and more than rounding.
        const OUTSIDE: f32 = 1.001;
        let Self { light, normal, axes, distance } = self;
        let cos = d.dot(*normal);
        if cos <= 0.0 {
            return None;
        }
        let p = d * (distance / cos);
        let (x, y) = (p.dot(axes[0]) / light.half[0], p.dot(axes[1]) / light.half[1]);
        if x.abs() > OUTSIDE || y.abs() > OUTSIDE {
            return None;
        }
        // The edge is a rounded square: the fourth-power norm.
        let r = functions::powf(functions::powi(x, 4) + functions::powi(y, 4), 0.25);
        let hot = 1.0 - 0.45 * smoothstep(0.0, 1.3, (x * x + y * y).sqrt());
        Some((light.radiance * hot, smoothstep(1.0, 1.0 - light.softness, r)))
    }
}
