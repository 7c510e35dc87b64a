//! The statue: a fluted shell that turns about an inner figure, on a moulded plinth.
//!
//! It stands in for the scanned statue of the lecture: deep hollows, overhangs and piercings which
//! shade one another, with ridges fine enough to show noise and broad enough not to alias at 512².
//! An implicit surface (smooth unions and differences of ellipsoids in a twisted space, Hart 1996,
//! "Sphere Tracing"; the ellipsoid's distance and the smooth minimum after Quilez) was chosen over
//! a scanned mesh: no license, no file, any resolution.

use super::shapes::{arc, lathe};
use super::surface_nets::surface_nets;
use crate::geometry::{Aabb, Mesh};
use crate::math::{FRAC_PI_2, PI, Vec2, Vec3, functions, vec2, vec3};

/// Height of the plinth's top above the floor.
pub(crate) const PLINTH_HEIGHT: f32 = 0.8;

/// Edge of a grid cell.
const CELL: f32 = 0.0178;
/// Bound on the slope of [`figure_distance`].
const LIPSCHITZ: f32 = 1.6;
/// Turn of the space about the vertical axis \[rad per unit of height\].
const TWIST: f32 = 1.15;
/// Thickness of the shell.
const SHELL: f32 = 0.11;
/// Flutes round the shell.
const FLUTES: f32 = 24.0;
/// Depth of the flutes.
const FLUTE_DEPTH: f32 = 0.034;

/// The sculpture, standing on y = 0 (on the plinth: move it up by [`PLINTH_HEIGHT`]).
pub(crate) fn figure() -> Mesh {
    let bounds = Aabb { min: vec3(-0.85, -0.12, -0.85), max: vec3(0.85, 2.5, 0.85) };
    surface_nets(&figure_distance, &bounds, CELL, LIPSCHITZ)
}

/// Roughly the signed distance to the sculpture.
fn figure_distance(p: Vec3) -> f32 {
    let q = untwist(p);
    let openings = openings(q);
    let body = body(q);
    // A shell, fluted outside, its lips rounded.
    let outside = body + flutes(q, openings);
    let shell = smooth_max(outside, -(body + SHELL), 0.03);
    let shell = smooth_max(shell, -openings, 0.09);
    let form = smooth_min(shell, inner_figure(q), 0.12);
    let form = smooth_min(form, foot(p), 0.12);
    smooth_max(form, -p.y - 0.05, 0.02)
}

/// Straightens the form's bend and twist.
fn untwist(p: Vec3) -> Vec3 {
    let bend = vec2(0.13 * functions::sin(1.7 * p.y - 0.3), 0.07 * functions::sin(2.1 * p.y));
    let (sin, cos) = functions::sin_cos(TWIST * p.y);
    let (x, z) = (p.x - bend.x, p.z - bend.y);
    vec3(cos * x - sin * z, p.y, sin * x + cos * z)
}

/// The egg from which the shell is hollowed.
fn body(q: Vec3) -> f32 {
    let shoulder = 1.0 + 0.16 * (q.y - 1.2).clamp(-1.3, 1.3);
    ellipsoid(q - vec3(0.0, 1.22, 0.0), vec3(0.62 * shoulder, 1.16, 0.5 * shoulder))
}

/// What is cut out of the shell: a tall opening before and a smaller one behind.
fn openings(q: Vec3) -> f32 {
    let front = ellipsoid(q - vec3(0.05, 1.18, 0.52), vec3(0.36, 0.84, 0.50));
    let back = ellipsoid(q - vec3(-0.08, 1.36, -0.50), vec3(0.27, 0.62, 0.42));
    front.min(back)
}

/// A slender figure inside: skirt, waist, breast and head.
fn inner_figure(q: Vec3) -> f32 {
    let skirt = ellipsoid(q - vec3(0.0, 0.45, 0.0), vec3(0.20, 0.55, 0.18));
    let breast = ellipsoid(q - vec3(0.0, 1.20, 0.01), vec3(0.15, 0.27, 0.12));
    let head = ellipsoid(q - vec3(0.02, 1.66, 0.02), vec3(0.10, 0.15, 0.11));
    let neck = ellipsoid(q - vec3(0.0, 1.4, 0.0), vec3(0.055, 0.3, 0.055));
    let torso = smooth_min(skirt, breast, 0.14);
    smooth_min(torso, smooth_min(head, neck, 0.06), 0.08)
}

/// The low mound that binds shell and figure to the plinth.
fn foot(p: Vec3) -> f32 {
    ellipsoid(p, vec3(0.34, 0.09, 0.31))
}

/// How deep the flutes lie at `q`: scoops with rounded ridges, which fade out toward the lips of
/// the openings and toward the poles of the egg.
fn flutes(q: Vec3, openings: f32) -> f32 {
    let radius = vec2(q.x, q.z).length();
    let fade = smooth_step(0.05, 0.22, openings) * smooth_step(0.10, 0.38, radius);
    if fade == 0.0 {
        return 0.0;
    }
    let phase = 0.5 * FLUTES * functions::atan2(q.x, q.z) + 2.0 * q.y;
    // |sin| with its kink, the ridge, rounded to more than a cell.
    let (rounding, whole) = (0.12, 0.12f32.sqrt());
    let scoop = ((functions::powi(functions::sin(phase), 2) + rounding).sqrt() - whole)
        / ((1.0 + rounding).sqrt() - whole);
    fade * FLUTE_DEPTH * scoop
}

/// A first-order distance to an ellipsoid of the given radii round the origin.
fn ellipsoid(p: Vec3, radii: Vec3) -> f32 {
    let inverse = radii.recip();
    let scaled = p * inverse;
    let k0 = scaled.length();
    let k1 = (scaled * inverse).length();
    if k1 == 0.0 { -radii.min_element() } else { k0 * (k0 - 1.0) / k1 }
}

/// min(a, b), rounded where they differ by less than `k`.
fn smooth_min(a: f32, b: f32, k: f32) -> f32 {
    let h = (k - (a - b).abs()).max(0.0);
    a.min(b) - 0.25 * h * h / k
}

/// max(a, b), rounded where they differ by less than `k`.
fn smooth_max(a: f32, b: f32, k: f32) -> f32 {
    -smooth_min(-a, -b, k)
}

/// 0 below `from`, 1 above `to`, a smooth cubic between.
fn smooth_step(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A round plinth on y = 0: a foot, a torus, a drum between two hollows and a slab, all beveled.
pub(crate) fn plinth() -> Mesh {
    let top = PLINTH_HEIGHT;
    let mut profile = vec![Vec2::ZERO];
    // Foot.
    profile.extend(arc(vec2(0.68, 0.015), 0.015, -FRAC_PI_2, 0.0, 6));
    profile.extend(arc(vec2(0.68, 0.105), 0.015, 0.0, FRAC_PI_2, 6));
    // Torus.
    profile.extend(arc(vec2(0.62, 0.165), 0.045, -FRAC_PI_2, FRAC_PI_2, 16));
    // Hollow up to the drum, the drum, hollow out to the slab.
    profile.extend(arc(vec2(0.62, 0.30), 0.09, -FRAC_PI_2, -PI, 12).into_iter().skip(1));
    profile.extend(arc(vec2(0.62, top - 0.20), 0.09, -PI, -1.5 * PI, 12));
    // Slab.
    profile.extend(arc(vec2(0.64, top - 0.095), 0.015, -FRAC_PI_2, 0.0, 6));
    profile.extend(arc(vec2(0.64, top - 0.015), 0.015, 0.0, FRAC_PI_2, 6));
    profile.push(vec2(0.0, top));
    lathe(&profile, 128)
}
