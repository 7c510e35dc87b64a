//! A Gothic nave seen from its center: dim stone, small bright stained glass, hanging lamps.
//!
//! It stresses a sampler like the Grace Cathedral probe of Debevec 1998, "Rendering Synthetic Objects
//! into Real Scenes": the brightest 0.1 % of the pixels hold about two thirds of the energy.
//! The room is a box under a barrel vault. The light on the stone is painted, not simulated.

use super::smoothstep;
use crate::color::Rgb;
use crate::math::{Vec2, Vec3, functions, sqr, vec2, vec3};

/// Half width of the nave, height of the vault's spring, the ends and the floor \[m\]; the eye is at 0.
const HALF_WIDTH: f32 = 6.0;
const SPRING: f32 = 9.0;
const EAST: f32 = -30.0;
const WEST: f32 = 24.0;
const FLOOR: f32 = -1.7;
/// Length of a bay along the nave \[m\].
const BAY: f32 = 6.0;

const LAMP_RADIUS: f32 = 0.13;
const LAMP_COLOR: Rgb = Rgb::new(640.0, 430.0, 215.0);
const STONE: Rgb = Rgb::new(0.078, 0.064, 0.050);

/// Radiance from the direction `d`.
pub(super) fn radiance(d: Vec3) -> Rgb {
    lamps(d).unwrap_or_else(|| {
        let (wall, p) = hit(d);
        match wall {
            Wall::Floor => floor(p),
            Wall::Vault => vault(p),
            Wall::Side => side(p),
            Wall::East => end(p, 1.0),
            Wall::West => end(p, 0.45),
        }
    })
}

enum Wall {
    Floor,
    Vault,
    Side,
    East,
    West,
}

/// What the ray from the origin along `d` meets, and where.
fn hit(d: Vec3) -> (Wall, Vec3) {
    let along =
        |component: f32, at: f32| if component * at > 0.0 { at / component } else { f32::INFINITY };
    let (t_end, end) =
        if d.z < 0.0 { (along(d.z, EAST), Wall::East) } else { (along(d.z, WEST), Wall::West) };
    let t_side = along(d.x, HALF_WIDTH.copysign(d.x));
    let t_floor = along(d.y, FLOOR);
    let t_around = if d.y * t_side.min(1e6) > SPRING { vault_distance(d) } else { t_side };
    let t = t_end.min(t_floor).min(t_around);
    let wall = if t == t_end {
        end
    } else if t == t_floor {
        Wall::Floor
    } else if d.y * t > SPRING {
        Wall::Vault
    } else {
        Wall::Side
    };
    (wall, d * t)
}

/// Distance to the cylinder of radius [`HALF_WIDTH`] about the axis x = 0, y = [`SPRING`].
fn vault_distance(d: Vec3) -> f32 {
    let a = sqr(d.x) + sqr(d.y);
    let b = -d.y * SPRING;
    let c = sqr(SPRING) - sqr(HALF_WIDTH);
    (-b + (b * b - a * c).max(0.0).sqrt()) / a
}

/// Lamps on both sides of the nave, two a bay.
fn lamps(d: Vec3) -> Option<Rgb> {
    const PLACES: [Vec3; 8] = [
        vec3(-2.6, 3.1, -9.0),
        vec3(2.6, 3.1, -9.0),
        vec3(-2.6, 3.1, -15.0),
        vec3(2.6, 3.1, -15.0),
        vec3(-2.6, 3.1, 6.0),
        vec3(2.6, 3.1, 6.0),
        vec3(-2.6, 3.1, 13.0),
        vec3(2.6, 3.1, 13.0),
    ];
    PLACES.iter().find_map(|&center| {
        let along = d.dot(center);
        let miss = (center - d * along).length() / LAMP_RADIUS;
        (along > 0.0 && miss < 1.0).then(|| LAMP_COLOR * (1.0 - 0.55 * miss * miss))
    })
}

/// Stone of one course pattern: `u` along, `v` up \[m\].
fn masonry(u: f32, v: f32, light: f32) -> Rgb {
    let row = (v / 0.45).floor();
    let column = (u / 0.9 + 0.5 * row.rem_euclid(2.0)).floor();
    let tint = hash(column, row);
    let joint = edge_distance(v / 0.45) * 0.45;
    let joint = joint.min(edge_distance(u / 0.9 + 0.5 * row.rem_euclid(2.0)) * 0.9);
    let shade = (0.82 + 0.36 * tint) * (0.62 + 0.38 * smoothstep(0.0, 0.035, joint));
    STONE.lerp(Rgb::new(0.072, 0.067, 0.062), hash(row, column + 7.0)) * (shade * light)
}

/// Warm light of the lamps and colored spill of the windows on a point of the stone.
fn glow(p: Vec3) -> f32 {
    let row = |x: f32| 1.0 / (1.0 + 0.16 * (sqr(p.x - x) + sqr(p.y - 3.1)));
    let far = 0.55 + 0.45 * smoothstep(30.0, 8.0, p.z.abs());
    (0.28 + 1.5 * row(-2.6) + 1.5 * row(2.6)) * far
}

/// Flagstones in two colors with a worn middle, under the reflection of the east window.
fn floor(p: Vec3) -> Rgb {
    let (i, j) = ((p.x / 1.1).floor(), (p.z / 1.1).floor());
    let dark = (i + j).rem_euclid(2.0);
    let joint = edge_distance(p.x / 1.1).min(edge_distance(p.z / 1.1));
    let tile = Rgb::new(0.080, 0.062, 0.047).lerp(Rgb::new(0.030, 0.025, 0.024), dark);
    let worn = 0.8 + 0.4 * hash(i, j);
    let spill = Rgb::new(0.05, 0.06, 0.14)
        * functions::exp(-(sqr(p.x + 1.4) / 2.0 + sqr((p.z + 14.0) / 6.0)))
        + Rgb::new(0.17, 0.055, 0.03)
            * functions::exp(-(sqr(p.x - 1.0) / 2.5 + sqr((p.z + 9.0) / 4.0)));
    tile * (worn * glow(p) * (0.5 + 0.5 * smoothstep(0.0, 0.03, joint))) + spill
}

/// The barrel vault: severies between ribs, darker toward the crown.
fn vault(p: Vec3) -> Rgb {
    let angle = functions::atan2(p.x, p.y - SPRING);
    let bay = edge_distance(p.z / BAY) * BAY;
    let diagonal = (((p.z / BAY).rem_euclid(1.0) - 0.5).abs() - angle.abs() / 3.2).abs() * BAY;
    let rib = smoothstep(0.32, 0.22, bay).max(0.8 * smoothstep(0.26, 0.16, diagonal));
    let ridge = 0.8 * smoothstep(0.03, 0.02, angle.abs());
    let light = glow(p) * (1.15 - 0.55 * functions::cos(angle));
    let blue = masonry(p.z, angle * HALF_WIDTH, light) * Rgb::new(0.66, 0.76, 1.05);
    blue.lerp(STONE * (1.9 * light), rib.max(ridge))
}

/// A side wall: arcade, triforium, clerestory with a lancet and an oculus in each bay.
fn side(p: Vec3) -> Rgb {
    let center = (p.z / BAY).floor() * BAY + 0.5 * BAY;
    let q = vec2(p.z - center, p.y);
    let bay = (p.z / BAY).floor();
    let sunny = p.x < 0.0;
    // Piers between the bays stand in front of everything.
    if q.x.abs() > 0.5 * BAY - 0.42 {
        let round = (0.5 * BAY - q.x.abs()) / 0.42;
        let shafts = 0.75 + 0.25 * functions::cos(9.0 * round);
        return masonry(3.0, p.y, 1.0).lerp(STONE, 0.6)
            * (glow(p) * shafts * (1.45 - 0.9 * round * round));
    }
    let oculus = q - vec2(0.0, 8.1);
    if oculus.length() < 0.52 {
        let brightness = if sunny { 830.0 } else { 7.0 };
        return roundel(oculus / 0.52, bay) * brightness;
    }
    if let Some(g) = lancet(q, 1.05, 4.1, 5.4) {
        let brightness = if sunny { 4.5 } else { 2.2 };
        return glass(g, bay) * brightness;
    }
    let arch = arch_distance(q, 2.1, 1.1);
    if arch < 0.0 {
        let deep = smoothstep(0.0, -1.6, arch);
        return masonry(p.z, p.y, 0.75 * glow(p) * (1.0 - 0.85 * deep))
            + Rgb::new(0.012, 0.007, 0.004) * (1.0 - deep);
    }
    let moulding = smoothstep(0.32, 0.0, arch) * (0.65 + 0.35 * functions::cos(40.0 * arch));
    let string = smoothstep(0.16, 0.1, (p.y - 3.7).abs());
    masonry(p.z, p.y, glow(p) * (1.0 + 0.6 * moulding + 0.5 * string))
}

/// The east or west wall: a rose over three lancets; `sun` scales its glass.
fn end(p: Vec3, sun: f32) -> Rgb {
    let q = vec2(p.x, p.y);
    let rose = (q - vec2(0.0, 9.6)) / 2.3;
    if rose.length() < 1.0 {
        return rose_window(rose) * (26.0 * sun);
    }
    for (i, x) in [-2.6f32, 0.0, 2.6].into_iter().enumerate() {
        let top = if i == 1 { 5.4 } else { 4.6 };
        if let Some(g) = lancet(q - vec2(x, 0.0), 0.62, 1.4, top) {
            return glass(g, 11.0 + i as f32) * (150.0 * sun);
        }
    }
    let frame = smoothstep(1.18, 1.04, rose.length());
    let altar = smoothstep(0.4, 0.1, (p.y - 0.4).abs()) * smoothstep(4.2, 3.8, p.x.abs());
    masonry(p.x, p.y, 0.9 * glow(p) * (1.0 + 0.8 * frame)) + Rgb::new(0.16, 0.10, 0.035) * altar
}

/// Coordinates in a pointed window about x = 0 from `sill` to the spring `top`, if `q` is inside it:
/// x in ±1, y from the sill in half widths.
fn lancet(q: Vec2, half: f32, sill: f32, top: f32) -> Option<Vec2> {
    let inside = q.y > sill && (q.y < top || arch_distance(q, half, top) < 0.0) && q.x.abs() < half;
    inside.then(|| vec2(q.x, q.y - sill) / half)
}

/// Signed distance (about) to a pointed arch of half width `half` whose curve starts at `spring`:
/// two arcs of radius 2 · half about the opposite foot.
fn arch_distance(q: Vec2, half: f32, spring: f32) -> f32 {
    let x = q.x.abs();
    if q.y < spring { x - half } else { vec2(x + half, q.y - spring).length() - 2.0 * half }
}

/// Stained glass of small panes: saturated hues, leading between, a mullion in the middle.
fn glass(g: Vec2, seed: f32) -> Rgb {
    let panes = g * 3.0;
    let medallion = vec2(g.x, (g.y / 2.0).rem_euclid(1.0) * 2.0 - 1.0);
    let ring = medallion.length();
    let lead = edge_distance(panes.x).min(edge_distance(panes.y)) / 3.0;
    let lead = if ring < 0.75 { (0.75 - ring).min(lead + 0.02) } else { lead };
    let hue = if ring < 0.75 {
        hash((panes.x).floor() + 31.0, seed * 3.0 + (panes.y).floor()) * 0.35 + 0.42
    } else {
        hash((panes.x).floor(), (panes.y).floor() + 13.0 * seed)
    };
    let mullion = smoothstep(0.035, 0.06, g.x.abs());
    pane(hue) * (0.04 + 0.96 * smoothstep(0.015, 0.05, lead) * mullion)
}

/// A round window of eight petals about a center.
fn roundel(q: Vec2, seed: f32) -> Rgb {
    let r = q.length();
    let turn = functions::atan2(q.y, q.x) / std::f32::consts::TAU * 8.0;
    let lead = (edge_distance(turn) * r).min((r - 0.38).abs()).min(1.0 - r);
    let hue = if r < 0.38 { 0.95 } else { 0.72 + 0.28 * hash(turn.floor(), seed) };
    pane(hue) * (0.05 + 0.95 * smoothstep(0.02, 0.06, lead))
}

/// A rose of two rings of petals.
fn rose_window(q: Vec2) -> Rgb {
    let r = q.length();
    let turn = functions::atan2(q.y, q.x) / std::f32::consts::TAU;
    let (count, ring) =
        if r > 0.62 { (24.0, 2.0) } else { (12.0, if r > 0.22 { 1.0 } else { 0.0 }) };
    let petal = turn * count;
    let lead = (edge_distance(petal) * r * 6.0 / count)
        .min((r - 0.62).abs())
        .min((r - 0.22).abs())
        .min(1.0 - r);
    let hue = [
        0.95,
        0.15 + 0.45 * petal.floor().rem_euclid(2.0),
        0.02 + 0.3 * petal.floor().rem_euclid(3.0),
    ];
    pane(hue[ring as usize]) * (0.03 + 0.97 * smoothstep(0.012, 0.035, lead))
}

/// Transmittance of old glass: cobalt, ruby, emerald, purple, gold, near white.
fn pane(t: f32) -> Rgb {
    const GLASS: [Rgb; 7] = [
        Rgb::new(0.05, 0.12, 0.72),
        Rgb::new(0.72, 0.04, 0.05),
        Rgb::new(0.08, 0.28, 0.85),
        Rgb::new(0.08, 0.48, 0.16),
        Rgb::new(0.42, 0.10, 0.55),
        Rgb::new(0.95, 0.58, 0.12),
        Rgb::new(1.00, 0.88, 0.66),
    ];
    GLASS[((t * 7.0) as usize).min(6)]
}

/// Distance of `x` to the nearest integer.
fn edge_distance(x: f32) -> f32 {
    (x - x.round()).abs()
}

/// A repeatable number in [0, 1) of a cell (Jarzynski and Olano 2020, the PCG hash).
fn hash(x: f32, y: f32) -> f32 {
    let pcg = |v: u32| {
        let state = v.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
        (word >> 22) ^ word
    };
    (pcg((x as i32 as u32).wrapping_add(pcg(y as i32 as u32))) >> 8) as f32 / 16_777_216.0
}
