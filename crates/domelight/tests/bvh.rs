//! The hierarchy gives the answers of a loop over all triangles, on every instruction set, for
//! ordinary and for hostile scenes and rays.
#![cfg(feature = "render")]

use std::f32::consts::TAU;

use domelight::bvh::{Bvh, BvhError, InstructionSet};
use domelight::geometry::{Hit, Ray, RayBatch};
use domelight::math::{Vec3, vec3};

// ---- scenes ------------------------------------------------------------------------------------

/// SplitMix64.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// In [0, 1).
    fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u32 << 24) as f32
    }

    /// In [-1, 1)³.
    fn cube(&mut self) -> Vec3 {
        2.0 * vec3(self.unit(), self.unit(), self.unit()) - Vec3::ONE
    }

    fn direction(&mut self) -> Vec3 {
        let (z, phi) = (2.0 * self.unit() - 1.0, TAU * self.unit());
        let r = (1.0 - z * z).sqrt();
        vec3(r * phi.cos(), r * phi.sin(), z)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }
}

#[derive(Clone)]
struct Scene {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Scene {
    fn bvh(&self) -> Bvh {
        let bvh = Bvh::build(&self.positions, &self.triangles).unwrap();
        bvh.validate().unwrap();
        bvh
    }

    fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|i| self.positions[i as usize])
    }

    fn map(mut self, f: impl Fn(Vec3) -> Vec3) -> Self {
        for p in &mut self.positions {
            *p = f(*p);
        }
        self
    }
}

fn soup(count: usize, size: f32, seed: u64) -> Scene {
    let mut random = Random(seed);
    let mut positions = Vec::new();
    for _ in 0..count {
        let center = random.cube();
        positions.extend((0..3).map(|_| center + size * random.cube()));
    }
    let triangles = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Scene { positions, triangles }
}

/// A closed sphere of 20 · 4^`level` triangles.
fn icosphere(level: u32) -> Scene {
    let g = f32::midpoint(1.0, 5f32.sqrt());
    let mut positions: Vec<Vec3> = [
        [-1.0, g, 0.0],
        [1.0, g, 0.0],
        [-1.0, -g, 0.0],
        [1.0, -g, 0.0],
        [0.0, -1.0, g],
        [0.0, 1.0, g],
        [0.0, -1.0, -g],
        [0.0, 1.0, -g],
        [g, 0.0, -1.0],
        [g, 0.0, 1.0],
        [-g, 0.0, -1.0],
        [-g, 0.0, 1.0],
    ]
    .map(|p| Vec3::from_array(p).normalize())
    .to_vec();
    let mut triangles: Vec<[u32; 3]> = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..level {
        let mut middles = std::collections::HashMap::new();
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[i, j]| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    positions.push((positions[i as usize] + positions[j as usize]).normalize());
                    positions.len() as u32 - 1
                })
            });
            finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    Scene { positions, triangles }
}

/// The closed box [-1, 1]³.
fn cube() -> Scene {
    let corner = |i: u32, bit: u32| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
    let positions = (0..8).map(|i| vec3(corner(i, 0), corner(i, 1), corner(i, 2))).collect();
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Scene { positions, triangles }
}

fn bumpy(level: u32) -> Scene {
    icosphere(level).map(|p| p * (1.0 + 0.15 * (7.0 * p.x).sin() * (9.0 * p.y + 2.0 * p.z).cos()))
}

/// Closed convex meshes about the origin that hold the ball of a third of their least half-width.
fn closed_meshes() -> Vec<(&'static str, Scene)> {
    let offset = vec3(4096.5, -8191.25, 1234.0);
    vec![
        ("cube", cube()),
        ("icosphere", icosphere(3)),
        ("fine icosphere", icosphere(5)),
        ("long thin box", cube().map(|p| p * vec3(1e-4, 1.0, 1e3))),
        ("long thin sphere", icosphere(3).map(|p| p * vec3(1e3, 1e-3, 1.0))),
        ("huge", icosphere(3).map(|p| p * 1e8)),
        ("tiny", icosphere(3).map(|p| p * 1e-8)),
        ("far away", icosphere(3).map(|p| p + offset)),
        ("far away and on a coarse grid", cube().map(|p| p * 64.0 + 1e8)),
    ]
}

fn scenes() -> Vec<(&'static str, Scene)> {
    let mut scenes = vec![
        ("nothing", soup(0, 1.0, 1)),
        ("one triangle", soup(1, 1.0, 2)),
        ("a leaf", soup(8, 1.0, 3)),
        ("more than a leaf", soup(9, 1.0, 4)),
        ("small triangles", soup(1500, 0.1, 5)),
        ("large triangles", soup(300, 2.0, 6)),
        ("bumpy sphere", bumpy(3)),
        ("huge soup", soup(200, 0.3, 7).map(|p| p * 1e8)),
        ("tiny soup", soup(200, 0.3, 8).map(|p| p * 1e-8)),
        ("flat soup", soup(200, 0.3, 9).map(|p| vec3(p.x, 0.25, p.z))),
        ("needles", soup(200, 0.5, 10).map(|p| p * vec3(1e-4, 1.0, 1.0))),
        ("coplanar stack", coplanar_stack()),
    ];
    scenes.extend(closed_meshes());
    scenes
}

/// Twenty copies of the same square, then parallel ones very near.
fn coplanar_stack() -> Scene {
    let square =
        |z: f32| [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| vec3(x, y, z));
    let heights = (0..40).map(|i| 0.5 + 1e-7 * (i - 20i32).max(0) as f32);
    let positions: Vec<Vec3> = heights.flat_map(square).collect();
    let quads = 0..positions.len() as u32 / 4;
    let triangles = quads
        .flat_map(|q| [[4 * q, 4 * q + 1, 4 * q + 2], [4 * q, 4 * q + 2, 4 * q + 3]])
        .collect();
    Scene { positions, triangles }
}

// ---- rays --------------------------------------------------------------------------------------

/// Ordinary rays through the scene, and those that go wrong first: along axes, with components of
/// ±0, through vertices and edges, from corners of boxes, of odd lengths and intervals.
fn rays(scene: &Scene, bvh: &Bvh, count: usize, seed: u64) -> Vec<Ray> {
    let mut random = Random(seed);
    let bounds = bvh.bounds();
    let (center, size) =
        if bounds.is_empty() { (Vec3::ZERO, Vec3::ONE) } else { (bounds.center(), bounds.size()) };
    let mut rays = Vec::new();
    for i in 0..count {
        let inside = center + 0.5 * size * random.cube();
        let outside = center + 3.0 * size.max_element() * random.direction();
        let target = surface_point(scene, &mut random).unwrap_or(inside);
        let axis = [vec3(1.0, 0.0, -0.0), vec3(-0.0, -1.0, 0.0), vec3(0.0, -0.0, 1.0)][i % 3];
        let (origin, direction) = match i % 8 {
            0 => (inside, random.direction()),
            1 => (outside, inside - outside),
            2 => (outside, target - outside),
            3 => (inside, target - inside),
            4 => (target, random.direction()),
            5 => (target - axis * size.max_element(), axis),
            6 => (inside, random.direction() * vec3(1.0, 0.0, 1.0)),
            _ => (bounds.min.min(center), target - bounds.min.min(center)),
        };
        let scale = [1.0, 1e-6, 1e5][random.below(3)];
        let t_max = [f32::INFINITY, f32::INFINITY, 0.9, 1.0, 1.1][random.below(5)];
        rays.push(Ray { origin, direction: direction * scale, t_max: t_max / scale });
    }
    rays
}

/// A vertex, a point on an edge, or one within a triangle.
fn surface_point(scene: &Scene, random: &mut Random) -> Option<Vec3> {
    let count = scene.triangles.len();
    let [a, b, c] = (count > 0).then(|| scene.corners(random.below(count)))?;
    let (s, t) = (random.unit(), random.unit());
    Some([a, a.lerp(b, 0.5), a.lerp(b, s), a.lerp(b, s).lerp(c, t)][random.below(4)])
}

fn batch(rays: &[Ray]) -> RayBatch {
    let mut batch = RayBatch::default();
    for ray in rays {
        batch.push(ray.origin, ray.direction);
    }
    batch
}

fn on(bvh: &Bvh) -> Vec<Bvh> {
    InstructionSet::ALL.into_iter().filter_map(|i| bvh.clone().with_instruction_set(i)).collect()
}

// ---- loops over all triangles ------------------------------------------------------------------

/// Woop, Benthin & Wald 2013, one triangle at a time: the definition of a hit.
fn watertight(ray: &Ray, corners: [Vec3; 3]) -> Option<(f32, f32, f32)> {
    let d = ray.direction;
    let a = d.abs();
    let z = if a.x > a.y && a.x > a.z {
        0
    } else if a.y > a.z {
        1
    } else {
        2
    };
    let (x, y) = ((z + 1) % 3, (z + 2) % 3);
    let scale = 1.0 / d[z];
    let (sx, sy) = (d[x] * scale, d[y] * scale);
    let turned = |p: Vec3| vec3(p[x], p[y], p[z]);
    let to_corners = corners.map(|p| turned(p - ray.origin));
    let [a, b, c] = to_corners.map(|p| (p.x - sx * p.z, p.y - sy * p.z, p.z));
    let edge = |p: (f32, f32, f32), q: (f32, f32, f32)| p.0 * q.1 - p.1 * q.0;
    let exact = |p: (f32, f32, f32), q: (f32, f32, f32)| {
        (f64::from(p.0) * f64::from(q.1) - f64::from(p.1) * f64::from(q.0)) as f32
    };
    let (mut u, mut v, mut w) = (edge(c, b), edge(a, c), edge(b, a));
    if u == 0.0 || v == 0.0 || w == 0.0 {
        (u, v, w) = (exact(c, b), exact(a, c), exact(b, a));
    }
    let inside = u >= 0.0 && v >= 0.0 && w >= 0.0 || u <= 0.0 && v <= 0.0 && w <= 0.0;
    let n = turned((corners[1] - corners[0]).cross(corners[2] - corners[0]));
    let to_plane = n.x * to_corners[0].x + n.y * to_corners[0].y + n.z * to_corners[0].z;
    let plane = to_plane / (n.z + n.x * sx + n.y * sy);
    let depths = [a.2, b.2, c.2];
    let depth = plane.max(depths[0].min(depths[1]).min(depths[2]));
    let t = scale * depth.min(depths[0].max(depths[1]).max(depths[2]));
    let determinant = u + v + w;
    let hit = inside && determinant != 0.0 && t > 0.0 && t < ray.t_max;
    hit.then(|| (t, v / determinant, w / determinant))
}

fn has_area([a, b, c]: [Vec3; 3]) -> bool {
    let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
    (b - a).cross(c - a).length_squared() > 0.0
}

fn brute_force(scene: &Scene, ray: &Ray) -> Option<Hit> {
    brute_force_where(scene, ray, |_| true)
}

fn brute_force_where(scene: &Scene, ray: &Ray, accept: impl Fn(&Hit) -> bool) -> Option<Hit> {
    let mut closest: Option<Hit> = None;
    for hit in all_hits(scene, ray) {
        if closest.is_none_or(|c| hit.t < c.t) && accept(&hit) {
            closest = Some(hit);
        }
    }
    closest
}

/// In the order of the triangles.
fn all_hits(scene: &Scene, ray: &Ray) -> impl Iterator<Item = Hit> {
    (0..scene.triangles.len()).filter_map(|triangle| {
        let corners = scene.corners(triangle);
        let (t, u, v) = watertight(ray, corners).filter(|_| has_area(corners))?;
        Some(Hit { t, u, v, triangle: triangle as u32 })
    })
}

/// Möller & Trumbore 1997 in f64: t, and how far inside the triangle, in barycentric weight.
fn moeller_trumbore(ray: &Ray, [a, b, c]: [Vec3; 3]) -> (f64, f64) {
    let [o, d, a, b, c] = [ray.origin, ray.direction, a, b, c].map(Vec3::as_dvec3);
    let (ab, ac) = (b - a, c - a);
    let p = d.cross(ac);
    let determinant = ab.dot(p);
    let q = (o - a).cross(ab);
    let (u, v) = ((o - a).dot(p) / determinant, d.dot(q) / determinant);
    (ac.dot(q) / determinant, u.min(v).min(1.0 - u - v))
}

// ---- answers -----------------------------------------------------------------------------------

#[test]
fn all_queries_answer_like_a_loop_over_all_triangles() {
    for (seed, (name, scene)) in scenes().into_iter().enumerate() {
        let bvh = scene.bvh();
        let rays = rays(&scene, &bvh, 4_000_000 / (scene.triangles.len() + 1000), seed as u64);
        let expected: Vec<_> = rays.iter().map(|r| brute_force(&scene, r)).collect();
        let to_infinity = rays.iter().map(|r| Ray { t_max: f32::INFINITY, ..*r });
        let blocked: Vec<_> = to_infinity.map(|r| brute_force(&scene, &r).is_some()).collect();
        for bvh in on(&bvh) {
            let (mut hits, mut occluded) = (vec![None], vec![true]);
            bvh.closest_hits(&rays, &mut hits);
            bvh.occluded(&batch(&rays), &mut occluded);
            assert_eq!((hits.len(), occluded.len()), (rays.len(), rays.len()));
            for (i, ray) in rays.iter().enumerate() {
                assert_eq!(hits[i], expected[i], "{name}: {ray:?}");
                assert_eq!(bvh.closest_hit(ray), expected[i], "{name}: {ray:?}");
                assert_eq!(bvh.any_hit(ray), expected[i].is_some(), "{name}: {ray:?}");
                assert_eq!(occluded[i], blocked[i], "{name}: {ray:?}");
            }
        }
    }
}

/// Accepted or not by where it is and whose it is.
fn accepted(hit: &Hit) -> bool {
    (hit.triangle.wrapping_mul(0x9e37_79b9) ^ hit.u.to_bits() ^ hit.v.to_bits()).is_multiple_of(3)
}

#[test]
fn refused_hits_are_as_if_they_were_not_there() {
    for (seed, (name, scene)) in scenes().into_iter().enumerate() {
        let bvh = scene.bvh();
        let rays = rays(&scene, &bvh, 2_000_000 / (scene.triangles.len() + 1000), seed as u64);
        let expected: Vec<_> =
            rays.iter().map(|r| brute_force_where(&scene, r, accepted)).collect();
        let accept = |hits: &[(usize, Hit)], is_accepted: &mut [bool]| {
            assert_eq!(hits.len(), is_accepted.len());
            for ((_, hit), is_accepted) in hits.iter().zip(is_accepted) {
                *is_accepted = accepted(hit);
            }
        };
        for bvh in on(&bvh) {
            let mut hits = vec![None];
            bvh.closest_hits_where(&rays, accept, &mut hits);
            assert!(hits == expected, "{name}");
            for (ray, expected) in rays.iter().zip(&expected) {
                assert_eq!(bvh.closest_hit_where(ray, accepted), *expected, "{name}: {ray:?}");
                assert_eq!(bvh.closest_hit_where(ray, |_| true), bvh.closest_hit(ray));
                assert_eq!(bvh.closest_hit_where(ray, |_| false), None);
            }
        }
    }
}

/// Powers of two have exact products in any order.
#[test]
fn transmittances_are_products_over_all_hits() {
    let of_hit = |direction: Vec3, hit: &Hit| match hit.triangle % 61 {
        0 => 0.0,
        odd if odd % 2 == 1 => 1.0,
        _ if direction.x > 0.0 => 0.5,
        _ => 0.25,
    };
    for (seed, (name, scene)) in scenes().into_iter().enumerate() {
        let bvh = scene.bvh();
        let rays = rays(&scene, &bvh, 2_000_000 / (scene.triangles.len() + 1000), seed as u64);
        let product = |ray: &Ray| {
            let ray = Ray { t_max: f32::INFINITY, ..*ray };
            all_hits(&scene, &ray).map(|hit| of_hit(ray.direction, &hit)).product::<f32>()
        };
        let expected: Vec<_> = rays.iter().map(product).collect();
        for bvh in on(&bvh) {
            let mut transmittances = vec![7.0];
            let of_ray = |i: usize, hit: &Hit| of_hit(rays[i].direction, hit);
            bvh.transmittances(&batch(&rays), &of_ray, &mut transmittances);
            assert_eq!(transmittances.len(), rays.len());
            for ((ray, t), expected) in rays.iter().zip(transmittances).zip(&expected) {
                assert_eq!(t, *expected, "{name}: {ray:?}");
            }
        }
    }
}

#[test]
fn hits_agree_with_double_precision_away_from_edges() {
    for (seed, scene) in [soup(300, 0.3, 20), bumpy(3), soup(20, 1.0, 21)].iter().enumerate() {
        let bvh = scene.bvh();
        let mut random = Random(100 + seed as u64);
        let mut compared = 0;
        for _ in 0..3000 {
            let ray = Ray::new(2.0 * random.cube(), random.direction());
            let all: Vec<_> = (0..scene.triangles.len())
                .map(|i| (i, moeller_trumbore(&ray, scene.corners(i))))
                .filter(|&(_, (t, margin))| t > -1e-3 && margin > -1e-3)
                .collect();
            if all.iter().any(|&(_, (t, margin))| t < 1e-3 || margin < 1e-3) {
                continue;
            }
            let expected = all.iter().min_by(|a, b| a.1.0.total_cmp(&b.1.0));
            let hit = bvh.closest_hit(&ray);
            assert_eq!(hit.is_some(), expected.is_some(), "{ray:?}");
            compared += 1;
            let (Some(hit), Some(&(_, (t, _)))) = (hit, expected) else { continue };
            let [a, b, c] = scene.corners(hit.triangle as usize);
            let on_triangle = a + hit.u * (b - a) + hit.v * (c - a);
            assert!((f64::from(hit.t) - t).abs() < 1e-4, "{hit:?} at {t}");
            assert!(on_triangle.distance(ray.at(hit.t)) < 1e-4, "{hit:?}");
        }
        assert!(compared > 1000, "{compared} rays compared");
    }
}

#[test]
fn instruction_sets_give_the_same_bits() {
    let scene = bumpy(5);
    let bvh = scene.bvh();
    let rays = rays(&scene, &bvh, 20_000, 30);
    let bits =
        |hit: &Option<Hit>| hit.map(|h| [h.t.to_bits(), h.u.to_bits(), h.v.to_bits(), h.triangle]);
    let answers = on(&bvh).into_iter().map(|bvh| {
        let (mut hits, mut occluded) = (Vec::new(), Vec::new());
        bvh.closest_hits(&rays, &mut hits);
        bvh.occluded(&batch(&rays), &mut occluded);
        (hits.iter().map(bits).collect::<Vec<_>>(), occluded)
    });
    let answers: Vec<_> = answers.collect();
    assert!(answers.windows(2).all(|pair| pair[0] == pair[1]));
}

/// What a ray through a rectangle of the picture hits is seen, and what is beside or behind is not.
#[test]
fn a_frustum_sees_what_its_rays_hit() {
    use domelight::scene::{Camera, CameraSettings, Projection};
    let (mut empty, mut hits) = (0, 0);
    for (name, scene) in closed_meshes() {
        let bvh = scene.bvh();
        let sets = on(&bvh);
        for projection in [
            Projection::Perspective { fov_y_degrees: 40.0 },
            Projection::Orthographic { height: 1.0 },
        ] {
            let mut settings = CameraSettings::framing(&bvh.bounds(), 1.5, Vec3::Y);
            if let Projection::Orthographic { .. } = projection {
                let height = 2.0 * bvh.bounds().size().max_element();
                settings.projection = Projection::Orthographic { height };
            }
            let camera = Camera::new(&settings, 60, 40).unwrap();
            let mut random = Random(77);
            for _ in 0..4000 {
                let [x, y] = [random.below(60) as f32, random.below(40) as f32];
                let size = [0.01, 1.0, 7.0][random.below(3)];
                let frustum = camera.frustum([x, x + size], [y, y + size]);
                let seen = bvh.may_hit(&frustum);
                assert!(sets.iter().all(|bvh| bvh.may_hit(&frustum) == seen));
                let ray = camera.ray(x + size * random.unit(), y + size * random.unit());
                let hit = bvh.closest_hit(&ray).is_some();
                assert!(seen || !hit, "{name} {projection:?} {x} {y} {size}");
                empty += usize::from(!seen);
                hits += usize::from(hit);
            }
        }
    }
    assert!(empty > 5_000 && hits > 5_000, "{empty} {hits}");
}

/// Any bits, and those that go wrong: NaN, infinities, denormals, zeros of both signs, the largest.
fn hostile_number(random: &mut Random) -> f32 {
    let special = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        f32::MIN_POSITIVE,
        f32::from_bits(1),
        -f32::from_bits(0x7f_ffff),
        f32::MAX,
        f32::MIN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
        1e-20,
        -1e20,
        1.0 + f32::EPSILON,
    ];
    match random.below(4) {
        0 => f32::from_bits(random.bits() as u32),
        1 | 2 => special[random.below(special.len())],
        _ => 2.0 * random.unit() - 1.0,
    }
}

fn hostile_vector(random: &mut Random) -> Vec3 {
    vec3(hostile_number(random), hostile_number(random), hostile_number(random))
}

/// Triangles of any finite numbers: huge, denormal, without area, all in one point.
fn hostile_scene(count: usize, seed: u64) -> Scene {
    let mut random = Random(seed);
    let mut scene = soup(count, 0.5, seed);
    for p in &mut scene.positions {
        *p = match random.below(8) {
            0 => hostile_vector(&mut random).map(|x| if x.is_finite() { x } else { 0.5 }),
            1 => Vec3::ZERO,
            2 => vec3(0.25, -0.0, 0.5),
            _ => *p,
        };
    }
    scene
}

#[test]
fn instruction_sets_give_the_same_bits_for_hostile_numbers() {
    let bits =
        |hit: &Option<Hit>| hit.map(|h| [h.t.to_bits(), h.u.to_bits(), h.v.to_bits(), h.triangle]);
    for seed in 0..24 {
        let scene = match seed % 3 {
            0 => soup(200, 0.4, seed),
            1 => hostile_scene(8, seed),
            _ => hostile_scene(300, seed),
        };
        let bvh = scene.bvh();
        let mut random = Random(500 + seed);
        let mut rays = rays(&scene, &bvh, 1000, seed);
        for ray in &mut rays {
            match random.below(4) {
                0 => ray.origin = hostile_vector(&mut random),
                1 => ray.direction = hostile_vector(&mut random),
                2 => ray.t_max = hostile_number(&mut random),
                _ => {}
            }
        }
        // Streams that are empty, not full, half full, full, and one ray more.
        for count in [0, 1, 7, 8, 9, 31, 32, 33, 63, 64, 65, 1000] {
            let rays = &rays[..count];
            let answers = on(&bvh).into_iter().map(|bvh| {
                let (mut hits, mut occluded) = (Vec::new(), Vec::new());
                bvh.closest_hits(rays, &mut hits);
                bvh.occluded(&batch(rays), &mut occluded);
                let hits = hits.iter().map(bits).collect::<Vec<_>>();
                let singles: Vec<_> = rays.iter().map(|r| bits(&bvh.closest_hit(r))).collect();
                let any: Vec<_> = rays.iter().map(|r| bvh.any_hit(r)).collect();
                (hits, occluded, singles, any)
            });
            let answers: Vec<_> = answers.collect();
            assert!(answers.iter().all(|a| a.0.len() == count && a.1.len() == count));
            for (i, pair) in answers.windows(2).enumerate() {
                assert!(pair[0] == pair[1], "seed {seed}, {count} rays, sets {i} and {}", i + 1);
            }
        }
    }
}

// ---- watertightness ----------------------------------------------------------------------------

/// An interior point of a convex mesh, drawn so that some lie very near the surface.
fn inside(scene: &Scene, center: Vec3, random: &mut Random) -> Vec3 {
    let surface = surface_point(scene, random).unwrap();
    center.lerp(surface, [0.0, 0.3, 0.9][random.below(3)])
}

/// Rays from inside a convex mesh, half of them aimed at vertices, edges and triangles.
fn rays_from_inside(scene: &Scene, bvh: &Bvh, count: usize, seed: u64) -> Vec<Ray> {
    let mut random = Random(seed);
    let mut rays = Vec::new();
    while rays.len() < count {
        let origin = inside(scene, bvh.bounds().center(), &mut random);
        let target = surface_point(scene, &mut random).unwrap();
        if target != origin {
            rays.push(Ray::new(origin, target - origin));
        }
        rays.push(Ray::new(origin, random.direction()));
    }
    rays
}

#[test]
fn no_ray_leaves_a_closed_mesh() {
    for (seed, (name, scene)) in closed_meshes().into_iter().enumerate() {
        let bvh = scene.bvh();
        let rays = rays_from_inside(&scene, &bvh, 60_000, 200 + seed as u64);
        for bvh in on(&bvh) {
            let mut occluded = Vec::new();
            bvh.occluded(&batch(&rays), &mut occluded);
            for (ray, occluded) in rays.iter().zip(occluded) {
                assert!(occluded, "{name}: {ray:?} leaks");
            }
        }
    }
}

/// The rays above are hard: the textbook's test in f32 loses some of them.
#[test]
fn the_textbook_test_leaks() {
    let scene = icosphere(3);
    let rays = rays_from_inside(&scene, &scene.bvh(), 20_000, 250);
    let hits = |ray: &Ray, [a, b, c]: [Vec3; 3]| {
        let (ab, ac, ao) = (b - a, c - a, ray.origin - a);
        let p = ray.direction.cross(ac);
        let q = ao.cross(ab);
        let (scale, u, v) = (ab.dot(p), ao.dot(p), ray.direction.dot(q));
        let (u, v, t) = (u / scale, v / scale, ac.dot(q) / scale);
        u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0
    };
    let leaks = |ray: &&Ray| !(0..scene.triangles.len()).any(|i| hits(ray, scene.corners(i)));
    assert!(rays.iter().filter(leaks).count() > 0);
}

#[test]
fn no_ray_enters_a_closed_mesh_unseen() {
    for (seed, (name, scene)) in closed_meshes().into_iter().enumerate() {
        let bvh = scene.bvh();
        let center = bvh.bounds().center();
        let (mut random, mut tried) = (Random(300 + seed as u64), 0);
        for _ in 0..20_000 {
            // From outside through a vertex, an edge or a triangle to a point inside.
            let end = inside(&scene, center, &mut random);
            let target = surface_point(&scene, &mut random).unwrap();
            let origin = target + (0.3 + 9.0 * random.unit()) * (target - end);
            if origin.distance(target) < 1e-6 * origin.abs().max_element() {
                continue; // rounding may have put it inside
            }
            let ray = Ray { origin, direction: end - origin, t_max: 1.0 };
            assert!(bvh.any_hit(&ray), "{name}: {ray:?} leaks through {target}");
            tried += 1;
        }
        assert!(tried > 5000, "{name}: {tried} rays tried");
    }
}

// ---- hostile input -----------------------------------------------------------------------------

#[test]
fn bad_meshes_are_refused() {
    let positions = [Vec3::ZERO, Vec3::X, vec3(0.0, f32::NAN, 0.0)];
    let error = Bvh::build(&positions, &[]).unwrap_err();
    assert!(matches!(error, BvhError::NotFinite { vertex: 2, .. }));
    let error = Bvh::build(&positions[..2], &[[0, 1, 0], [0, 7, 1]]).unwrap_err();
    assert_eq!(error, BvhError::Index { triangle: 1, index: 7, vertices: 2 });
    assert!(error.to_string().contains("triangle 1 refers to vertex 7"));
}

#[test]
fn the_interval_is_open() {
    let scene = Scene {
        positions: vec![vec3(-1.0, -1.0, 0.0), vec3(3.0, -1.0, 0.0), vec3(-1.0, 3.0, 0.0)],
        triangles: vec![[0, 1, 2]],
    };
    for bvh in on(&scene.bvh()) {
        let hits = |z: f32, t_max: f32| {
            bvh.any_hit(&Ray { origin: vec3(0.0, 0.0, z), direction: Vec3::Z, t_max })
        };
        assert!(hits(-2.0, 2.0f32.next_up()) && !hits(-2.0, 2.0));
        assert!(hits(-1e-30, 1.0) && !hits(0.0, 1.0) && !hits(1e-30, 1.0));
        for t_max in [0.0, -0.0, -1.0, f32::NAN, f32::NEG_INFINITY] {
            assert!(!hits(-2.0, t_max));
        }
    }
}

#[test]
fn rays_that_are_not_finite_or_have_no_direction_miss() {
    let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    let mut rays = vec![Ray::new(Vec3::ZERO, Vec3::ZERO), Ray::new(Vec3::ZERO, -Vec3::ZERO)];
    for x in bad {
        for v in [vec3(x, 0.1, 0.2), vec3(0.1, x, 0.2), vec3(0.1, 0.2, x), Vec3::splat(x)] {
            rays.extend([Ray::new(v, Vec3::X), Ray::new(Vec3::ZERO, v)]);
        }
    }
    rays.push(Ray::new(Vec3::ZERO, Vec3::Y));
    for bvh in on(&icosphere(2).bvh()) {
        let mut occluded = Vec::new();
        bvh.occluded(&batch(&rays), &mut occluded);
        let blocked = occluded.iter().filter(|&&o| o).count();
        assert!(blocked == 1 && occluded[rays.len() - 1]);
        assert!(rays[..rays.len() - 1].iter().all(|r| bvh.closest_hit(r).is_none()));
        assert!(rays[..rays.len() - 1].iter().all(|r| !bvh.any_hit(r)));
    }
}

#[test]
fn triangles_without_area_are_never_hit() {
    let mut scene = soup(50, 0.5, 40);
    let count = scene.triangles.len();
    for i in 0..count as u32 {
        scene.positions.push(2.0 * scene.positions[i as usize]);
        let double = scene.positions.len() as u32 - 1;
        scene.positions.push(Vec3::ZERO);
        scene.triangles.extend([[i, i, i + 1], [i, i, i], [i, double, double + 1]]);
    }
    let bvh = scene.bvh();
    assert_eq!(bvh.triangle_count(), count);
    for ray in rays(&scene, &bvh, 2000, 41) {
        let hit = bvh.closest_hit(&ray);
        assert!(hit.is_none_or(|h| (h.triangle as usize) < count && (h.t + h.u + h.v).is_finite()));
        assert_eq!(hit, brute_force(&scene, &ray));
    }
}

#[test]
fn ten_thousand_copies_of_a_triangle_are_no_trouble() {
    let mut scene = soup(1, 1.0, 50);
    scene.triangles = vec![[0, 1, 2]; 10_000];
    let bvh = scene.bvh();
    let [a, b, c] = scene.corners(0);
    let ray = Ray::new(vec3(5.0, 4.0, 3.0), (a + b + c) / 3.0 - vec3(5.0, 4.0, 3.0));
    assert_eq!(bvh.closest_hit(&ray).map(|h| h.triangle), Some(0));
}

#[test]
fn the_depth_is_bounded_when_sizes_grow_geometrically() {
    // Each triangle dwarfs all before it, so that bins separate only the last few.
    let mut scene = soup(4000, 1.0, 60);
    for (i, p) in scene.positions.iter_mut().enumerate() {
        *p *= 1.02f32.powi(i as i32 / 3 - 2000);
    }
    let bvh = scene.bvh();
    assert!(bvh.triangle_count() > 3000);
    for bvh in on(&bvh) {
        let reached = (0..3000).filter(|&i| bvh.any_hit(&Ray::new(Vec3::ZERO, scene.positions[i])));
        assert!(reached.count() > 100);
    }
}

#[test]
fn the_greatest_numbers_do_not_panic() {
    for scale in [1e-45, 1e-38, 1e-20, 1e20, 1e30, f32::MAX] {
        let scene = soup(100, 1.0, 70).map(|p| (p * scale).clamp(Vec3::MIN, Vec3::MAX));
        let bvh = scene.bvh();
        for ray in rays(&scene, &bvh, 500, 71) {
            let (hit, any) = (bvh.closest_hit(&ray), bvh.any_hit(&ray));
            assert!(hit.is_none_or(|h| h.t.is_finite()) && hit.is_some() == any);
        }
    }
}

// ---- the build ---------------------------------------------------------------------------------

#[test]
fn the_tree_does_not_depend_on_the_number_of_threads() {
    let scene = bumpy(5);
    let build = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        format!("{:?}", pool.install(|| scene.bvh()))
    };
    let one = build(1);
    assert!(one == build(2) && one == build(5));
}

#[test]
fn bounds_and_sizes_are_those_of_the_mesh() {
    let scene = bumpy(3);
    let bvh = scene.bvh();
    assert_eq!(bvh.triangle_count(), 1280);
    assert!(scene.positions.iter().all(|&p| bvh.bounds().including(p) == bvh.bounds()));
    assert!(bvh.bytes() / bvh.triangle_count() < 100, "{} bytes", bvh.bytes());
    assert!(soup(0, 1.0, 0).bvh().bounds().is_empty());
}
