//! Elementary shapes as meshes: spheres, a disc, a beveled box, surfaces of revolution.
//!
//! All triangles are counterclockwise seen from outside and all normals are those of the exact
//! surface. Where two patches meet (a seam of texture coordinates, a crease) vertices are doubled
//! with the same position bit for bit, so that the solids are closed.

use std::collections::HashMap;

use crate::geometry::Mesh;
use crate::math::{FRAC_PI_2, PI, TAU, Vec2, Vec3, functions, vec2, vec3};

/// Profiles of [`lathe`] are smooth where they turn by less than this angle \[rad\].
const CREASE: f32 = 0.5;

/// The unit sphere as an icosahedron whose triangles are split in four `subdivisions` times:
/// 20 · 4ⁿ nearly equal triangles, no texture coordinates.
pub fn icosphere(subdivisions: u32) -> Mesh {
    let (mut positions, mut triangles) = icosahedron();
    for _ in 0..subdivisions {
        let mut midpoints = HashMap::new();
        let mut midpoint = |a: u32, b: u32| {
            *midpoints.entry((a.min(b), a.max(b))).or_insert_with(|| {
                let sum = positions[a as usize] + positions[b as usize];
                positions.push(sum.normalize());
                positions.len() as u32 - 1
            })
        };
        triangles = triangles
            .into_iter()
            .flat_map(|[a, b, c]| {
                let (ab, bc, ca) = (midpoint(a, b), midpoint(b, c), midpoint(c, a));
                [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
            })
            .collect();
    }
    Mesh { normals: positions.clone(), positions, triangles, ..Mesh::default() }
}

/// Vertices on the unit sphere: the poles and two staggered rings of five.
fn icosahedron() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let y = 1.0 / 5f32.sqrt();
    let ring = |y: f32, turn: f32| {
        (0..5).map(move |i| around_y(vec2((1.0 - y * y).sqrt(), y), TAU * (i as f32 + turn) / 5.0))
    };
    let mut positions = vec![Vec3::Y];
    positions.extend(ring(y, 0.0).chain(ring(-y, 0.5)));
    positions.push(Vec3::NEG_Y);
    let triangles = (0..5).flat_map(|i| {
        let j = (i + 1) % 5;
        let (u, v, s, t) = (1 + i, 1 + j, 6 + i, 6 + j);
        [[0, u, v], [u, s, v], [v, s, t], [11, t, s]]
    });
    (positions, triangles.collect())
}

/// The unit sphere in `segments` meridians (≥ 3) and `rings` parallels (≥ 2), with texture
/// coordinates of a lat-long map: (½, ½) lies at −Z, v = 0 at +Y.
pub fn uv_sphere(segments: u32, rings: u32) -> Mesh {
    let parallel = |j: u32| match j {
        0 => Vec2::NEG_Y,
        j if j == rings => Vec2::Y,
        j => {
            let (sin, cos) = functions::sin_cos(PI * j as f32 / rings as f32);
            vec2(sin, -cos)
        }
    };
    let mut builder = Revolution::new(segments);
    for j in 0..rings {
        let ends = [parallel(j), parallel(j + 1)];
        let v = [j, j + 1].map(|j| 1.0 - j as f32 / rings as f32);
        builder.strip(ends, ends, v);
    }
    builder.mesh
}

/// A horizontal disc at y = 0 that faces +Y, of `segments` (≥ 3) equal sectors.
pub fn disc(radius: f32, segments: u32) -> Mesh {
    let mut builder = Revolution::new(segments);
    builder.strip([vec2(radius, 0.0), Vec2::ZERO], [Vec2::Y, Vec2::Y], [1.0, 0.0]);
    let mut mesh = builder.mesh;
    mesh.uvs = mesh.positions.iter().map(|p| 0.5 + 0.5 * vec2(p.x, p.z) / radius).collect();
    mesh
}

/// A horizontal ring at y = 0 that faces +Y, in `segments` (≥ 3) sectors and `steps` (≥ 1) circles, whose opacity falls
/// smoothly from 1 at radius `inner` > 0 to 0 at `outer`.
pub fn fading_ring(inner: f32, outer: f32, segments: u32, steps: u32) -> Mesh {
    let mut builder = Revolution::new(segments);
    let mut alphas = Vec::new();
    let at = |i: u32| {
        let t = i as f32 / steps as f32;
        (inner + (outer - inner) * t, 1.0 - t * t * (3.0 - 2.0 * t))
    };
    for i in 0..steps {
        let [(near, near_alpha), (far, far_alpha)] = [at(i), at(i + 1)];
        builder.strip([vec2(far, 0.0), vec2(near, 0.0)], [Vec2::Y; 2], [1.0, 0.0]);
        alphas.extend((0..=segments).flat_map(|_| [far_alpha, near_alpha]));
    }
    let mut mesh = builder.mesh;
    mesh.uvs = mesh.positions.iter().map(|p| 0.5 + 0.5 * vec2(p.x, p.z) / outer).collect();
    mesh.alphas = alphas;
    mesh
}

/// The closed surface that a profile of (distance from the axis, height) sweeps round +Y, in
/// `segments` (≥ 3) sectors.
///
/// The profile rises from the lower end of the axis to the upper one, or is a loop that ends where
/// it began, counterclockwise in the (r, y) plane; no point follows itself. Gentle turns are shaded smooth, sharp ones as creases.
pub fn lathe(profile: &[Vec2], segments: u32) -> Mesh {
    let directions: Vec<Vec2> =
        profile.windows(2).map(|w| (w[1] - w[0]).normalize_or_zero()).collect();
    let n = directions.len();
    let is_loop = profile.first() == profile.last();
    // The normal at an end of segment `i`, shared with segment `j` unless there is a crease.
    let normal = |i: usize, j: Option<usize>| {
        let own = directions[i];
        let other = j.map_or(own, |j| directions[j]);
        let turn = functions::atan2(own.perp_dot(other), own.dot(other)).abs();
        let along = if turn < CREASE { own + other } else { own };
        vec2(along.y, -along.x).normalize_or_zero()
    };
    let mut builder = Revolution::new(segments);
    for i in 0..n {
        let before = if i > 0 { Some(i - 1) } else { is_loop.then_some(n - 1) };
        let after = if i + 1 < n { Some(i + 1) } else { is_loop.then_some(0) };
        let v = [i, i + 1].map(|k| 1.0 - k as f32 / n as f32);
        builder.strip([profile[i], profile[i + 1]], [normal(i, before), normal(i, after)], v);
    }
    builder.mesh
}

/// The points of a circular arc from angle `from` to `to` \[rad\], counterclockwise from +r, in
/// `steps` pieces: a part of a profile for [`lathe`].
pub fn arc(center: Vec2, radius: f32, from: f32, to: f32, steps: u32) -> Vec<Vec2> {
    let angle = |i: u32| from + (to - from) * i as f32 / steps as f32;
    let at = |i| {
        let (sin, cos) = functions::sin_cos(angle(i));
        center + radius * vec2(cos, sin)
    };
    (0..=steps).map(at).collect()
}

/// A point (distance from the axis, height) turned by `phi` from +z toward +x.
fn around_y(p: Vec2, phi: f32) -> Vec3 {
    let (sin, cos) = functions::sin_cos(phi);
    vec3(p.x * sin, p.y, p.x * cos)
}

/// Collects the conical strips of a surface of revolution.
struct Revolution {
    segments: u32,
    mesh: Mesh,
}

impl Revolution {
    fn new(segments: u32) -> Self {
        Self { segments, mesh: Mesh::default() }
    }

    /// Adds the strip between two profile points, `ends` bottom first, with its normals and v.
    fn strip(&mut self, ends: [Vec2; 2], normals: [Vec2; 2], v: [f32; 2]) {
        let first = self.mesh.positions.len() as u32;
        for i in 0..=self.segments {
            // The last column repeats the first exactly: the surface is closed.
            let phi = TAU * (i % self.segments) as f32 / self.segments as f32;
            for k in 0..2 {
                self.mesh.positions.push(around_y(ends[k], phi));
                self.mesh.normals.push(around_y(normals[k], phi).normalize());
                self.mesh.uvs.push(vec2(seam_u(i, self.segments), v[k]));
            }
        }
        for i in 0..self.segments {
            let a = first + 2 * i;
            let (b, c, d) = (a + 1, a + 2, a + 3);
            if ends[0].x > 0.0 {
                self.mesh.triangles.push([a, c, b]);
            }
            if ends[1].x > 0.0 {
                self.mesh.triangles.push([b, c, d]);
            }
        }
    }
}

/// u of column `i`: 0 at +z, where the seam lies; falls toward +x, so that −z has ½ and the picture
/// reads the right way round from inside.
fn seam_u(i: u32, segments: u32) -> f32 {
    1.0 - i as f32 / segments as f32
}

/// A box of the given half extents round the origin, its edges and corners rounded by `bevel`
/// (less than the least half extent) in `steps` (≥ 1) pieces either side of each edge.
pub fn beveled_box(half: Vec3, bevel: f32, steps: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            beveled_face(&mut mesh, half, bevel, steps, axis, sign);
        }
    }
    mesh
}

/// The side of a beveled box that faces `sign` along `axis`, out to the middle of its bevels.
///
/// A point q of the sharp box goes to core + bevel · (q − core)/|q − core|, core the nearest point
/// of the box of half extents half − bevel.
fn beveled_face(mesh: &mut Mesh, half: Vec3, bevel: f32, steps: u32, axis: usize, sign: f32) {
    let (b_axis, c_axis) = ((axis + 1) % 3, (axis + 2) % 3);
    let core_half = half - bevel;
    let ticks = bevel_ticks(steps);
    let at = |core: f32, &(side, t): &(f32, f32)| side * (core + bevel * t);
    let first = mesh.positions.len() as u32;
    let n = ticks.len() as u32;
    for tb in &ticks {
        for tc in &ticks {
            let mut q = Vec3::ZERO;
            q[axis] = sign * (core_half[axis] + bevel);
            q[b_axis] = at(core_half[b_axis], tb);
            q[c_axis] = at(core_half[c_axis], tc);
            let core = q.clamp(-core_half, core_half);
            let normal = (q - core).normalize();
            mesh.positions.push(core + bevel * normal);
            mesh.normals.push(normal);
            mesh.uvs.push(0.5 + 0.5 * vec2(q[b_axis] / half[b_axis], q[c_axis] / half[c_axis]));
        }
    }
    for i in 0..n - 1 {
        for j in 0..n - 1 {
            let a = first + i * n + j;
            let (b, c, d) = (a + n, a + n + 1, a + 1);
            let faces = if sign > 0.0 { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] };
            mesh.triangles.extend(faces);
        }
    }
}

/// Grid lines across a side: (which end, tangent of the bevel's angle), equal angles up to 45°.
fn bevel_ticks(steps: u32) -> Vec<(f32, f32)> {
    let tangent = |i: u32| match i {
        i if i == steps => 1.0,
        i => functions::tan(0.5 * FRAC_PI_2 * i as f32 / steps as f32),
    };
    let low = (0..=steps).rev().map(|i| (-1.0, tangent(i)));
    low.chain((0..=steps).map(|i| (1.0, tangent(i)))).collect()
}
