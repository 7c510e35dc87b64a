//! Openings: portals that the program finds where a scene names none.
//!
//! In a room, most rays from what the camera sees are blocked, and the free ones meet in the windows. So windows are the
//! rectangles that many free rays from different places pass:
//!
//! 1. Send rays from the points of a pilot in cosine-weighted directions. If many are free, the scene is no room.
//! 2. Take the orientations of most surfaces that block rays as those of possible planes, and where they lie as offsets.
//! 3. Of each orientation, choose the plane in which free rays are most concentrated: by the number of pairs of rays from
//!    different places that pass the same patch. Move it while the concentration grows. There and in the planes of walls
//!    nearby, grow the densest patch to its neighbors, and put a rectangle around the rays.
//! 4. Of these rectangles, choose the one that the most free rays pass, times the part of all rays through it that are
//!    free. It is a portal if that part is large and the rays come from several places.
//! 5. Leave its rays out, and go on with step 3 until almost all free rays are explained.
//!
//! A portal is a hint, so a wrong one costs noise and no bias. The rays have random numbers of their own and depend on the
//! scene, the camera and the size of the picture alone.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use super::{RenderSettings, pilot_points, visibility};
use crate::geometry::Ray;
use crate::math::{Frame, Vec2, Vec3, vec2};
use crate::sampling::{Pcg32, warp};
use crate::scene::{Camera, Scene};
use crate::strategy::{Portal, ShadingPoint};

/// Rays of each point that show whether the scene is a room.
const FIRST_RAYS: usize = 4;
/// Rays of each point.
const RAYS: usize = 128;
/// The fraction of free rays above which the map is sampled well enough without portals.
const OPEN: f64 = 0.1;
/// The least number of free rays through a portal.
const FEWEST: usize = 6;
/// The least number of places from which they come.
const FEWEST_PLACES: usize = 4;
/// The least part of the rays through a portal that is free.
const LEAST_FREE: f64 = 0.3;
/// The least part of the free rays that all portals together explain; else there are none.
const LEAST_EXPLAINED: f64 = 0.7;
/// The part of the free rays that may be left unexplained.
const REST: f64 = 0.05;
/// The most portals.
const MOST: usize = 16;
/// The sizes of patches in which rays meet, of those by which an opening grows, and of places, as fractions of the extent of
/// the points. The second are so wide that most patches of a window have several rays.
const PATCH: f32 = 1.0 / 48.0;
const WIDE_PATCH: f32 = 1.0 / 24.0;
const PLACE: f32 = 1.0 / 12.0;
/// Rays that choose a plane, and normals that choose orientations, at most.
const CHOOSING: usize = 1000;
/// Offsets of planes of one orientation, besides those of walls.
const OFFSETS: usize = 64;
/// The most walls of one orientation.
const WALLS: usize = 8;
/// The cosine above which normals are alike.
const ALIKE: f32 = 0.99;
/// The least part of the surfaces that block rays that makes an orientation or a wall.
const LEAST_SHARE: f64 = 0.02;
/// An opening in a wall is preferred to one beside it that is worth up to 1/WALL times as much.
const WALL: f64 = 0.5;
/// The part of the densest patch's rays that its neighbors must have.
const GROWTH: f64 = 0.05;

/// The portals of a render: those that the scene names, otherwise those that are found if the settings ask for it, in
/// units of [`Scene::unit`].
pub fn portals<'a>(
    scene: &'a Scene,
    camera: &Camera,
    settings: &RenderSettings,
) -> Cow<'a, [Portal]> {
    counted_portals(scene, camera, settings).0
}

/// [`portals`] and the number of rays that were sent for them.
pub(super) fn counted_portals<'a>(
    scene: &'a Scene,
    camera: &Camera,
    settings: &RenderSettings,
) -> (Cow<'a, [Portal]>, u64) {
    if scene.portals().is_empty() && settings.find_portals {
        let (found, n_rays) = find(scene, camera, settings);
        (Cow::Owned(found), n_rays)
    } else {
        (Cow::Borrowed(scene.portals()), 0)
    }
}

fn find(scene: &Scene, camera: &Camera, settings: &RenderSettings) -> (Vec<Portal>, u64) {
    let points = pilot_points(scene, camera, settings);
    let first = send(scene, &points, 0..FIRST_RAYS);
    let free = |beams: &[Beam]| beams.iter().filter(|beam| beam.is_free).count();
    if free(&first) as f64 > OPEN * first.len() as f64 {
        return (Vec::new(), first.len() as u64);
    }
    let walls = blockers(scene, &first);
    let beams = [first, send(scene, &points, FIRST_RAYS..RAYS)].concat();
    let n_rays = (beams.len() + walls.len()) as u64;
    if free(&beams) < FEWEST || free(&beams) as f64 > OPEN * beams.len() as f64 {
        return (Vec::new(), n_rays);
    }
    (Search::new(&beams, &walls).map_or_else(Vec::new, Search::run), n_rays)
}

/// A ray from a point.
#[derive(Clone, Copy, Debug)]
struct Beam {
    origin: Vec3,
    direction: Vec3,
    is_free: bool,
}

/// A point on a surface that blocks a ray, with its normal.
#[derive(Clone, Copy, Debug)]
struct Blocker {
    position: Vec3,
    normal: Vec3,
}

/// Sends the rays of these numbers from all points.
fn send(scene: &Scene, points: &[ShadingPoint], numbers: std::ops::Range<usize>) -> Vec<Beam> {
    let of_point = |(i, point): (usize, &ShadingPoint)| {
        let mut pcg = Pcg32::new(numbers.start as u64, i as u64);
        // A surface is seen from above, and light comes from there.
        let frame = Frame::from_z(point.ng);
        let directions: Vec<Vec3> = numbers
            .clone()
            .map(|_| {
                let u = vec2(pcg.next_f32(), pcg.next_f32());
                frame.to_world(warp::cosine_hemisphere(u)).normalize()
            })
            .collect();
        let origin = |wi| visibility::origin(point, wi, scene.extent());
        let visible = visibility(scene, point, &directions);
        let beam = |(&direction, v): (&Vec3, f32)| Beam {
            origin: origin(direction),
            direction,
            is_free: v > 0.0,
        };
        directions.iter().zip(visible).map(beam).collect::<Vec<_>>()
    };
    let beams: Vec<Vec<Beam>> = points.par_iter().enumerate().map(of_point).collect();
    beams.concat()
}

/// What blocks the rays.
fn blockers(scene: &Scene, beams: &[Beam]) -> Vec<Blocker> {
    let hit = |(i, beam): (usize, &Beam)| {
        let ray = Ray::new(beam.origin, beam.direction);
        let hit = scene.camera_hit(&ray, i as u64, 0)?;
        let point = scene.shading_point(&ray, &hit);
        Some(Blocker { position: point.position, normal: point.ng })
    };
    let blocked = beams.par_iter().enumerate().filter(|(_, beam)| !beam.is_free);
    blocked.map(hit).collect::<Vec<_>>().into_iter().flatten().collect()
}

/// The planes of one orientation.
struct Orientation {
    normal: Vec3,
    /// The unit vectors along the edges of rectangles in these planes.
    axes: [Vec3; 2],
    /// The offsets of walls along the normal.
    walls: Vec<f32>,
    /// The least and the largest offset of the points.
    range: [f32; 2],
}

/// A plane.
#[derive(Clone, Copy)]
struct Plane {
    normal: Vec3,
    axes: [Vec3; 2],
    offset: f32,
}

impl Plane {
    /// Where a ray passes the plane, by the axes.
    fn crossing(&self, beam: &Beam, extent: f32) -> Option<Vec2> {
        /// The least cosine to the normal.
        const LEAST_COSINE: f32 = 0.1;
        /// The least distance, as a fraction of the extent.
        const LEAST_DISTANCE: f32 = 1e-3;
        let cosine = beam.direction.dot(self.normal);
        if cosine.abs() < LEAST_COSINE {
            return None;
        }
        let distance = (self.offset - beam.origin.dot(self.normal)) / cosine;
        if distance < LEAST_DISTANCE * extent {
            return None;
        }
        let at = beam.origin + distance * beam.direction;
        Some(vec2(at.dot(self.axes[0]), at.dot(self.axes[1])))
    }
}

/// A rectangle in a plane.
struct Rectangle {
    plane: Plane,
    from: Vec2,
    to: Vec2,
}

impl Rectangle {
    fn is_passed(&self, beam: &Beam, extent: f32) -> bool {
        let is_inside = |at: Vec2| at.cmpge(self.from).all() && at.cmple(self.to).all();
        self.plane.crossing(beam, extent).is_some_and(is_inside)
    }

    fn portal(&self) -> Option<Portal> {
        let Plane { normal, axes: [a, b], offset } = self.plane;
        let corner = offset * normal + self.from.x * a + self.from.y * b;
        let size = self.to - self.from;
        Portal::new(corner, [size.x * a, size.y * b]).ok()
    }
}

/// A rectangle that free rays pass.
struct Opening {
    rectangle: Rectangle,
    /// The free rays through it that no other opening explains.
    through: Vec<usize>,
    /// The part of all rays through it that are free.
    part_free: f64,
}

/// The search for the rectangles that free rays pass.
struct Search<'a> {
    beams: &'a [Beam],
    orientations: Vec<Orientation>,
    /// The longest extent of the points.
    extent: f32,
    /// The place of each beam's origin.
    places: Vec<u32>,
}

impl<'a> Search<'a> {
    /// `None` if all rays come from one point.
    fn new(beams: &'a [Beam], blockers: &[Blocker]) -> Option<Self> {
        let low = beams.iter().fold(Vec3::INFINITY, |low, beam| low.min(beam.origin));
        let high = beams.iter().fold(Vec3::NEG_INFINITY, |high, beam| high.max(beam.origin));
        let extent = (high - low).max_element();
        if extent.is_nan() || extent <= 0.0 {
            return None;
        }
        let place = |beam: &Beam| {
            let cell = ((beam.origin - low) / (PLACE * extent)).floor();
            (cell.x as u32 * 16 + cell.y as u32) * 16 + cell.z as u32
        };
        let places = beams.iter().map(place).collect();
        let orientations = orientations(beams, blockers, extent);
        Some(Self { beams, orientations, extent, places })
    }

    fn run(self) -> Vec<Portal> {
        let mut left: Vec<usize> =
            (0..self.beams.len()).filter(|&i| self.beams[i].is_free).collect();
        let n_free = left.len();
        let enough = FEWEST.max((REST * n_free as f64) as usize);
        let (mut found, mut explained) = (Vec::new(), 0);
        while left.len() >= enough && found.len() < MOST {
            let Some(opening) = self.widest(&left).filter(|opening| !opening.through.is_empty())
            else {
                break;
            };
            let through: BTreeSet<usize> = opening.through.iter().copied().collect();
            left.retain(|i| !through.contains(i));
            if self.is_portal(&opening) {
                explained += through.len();
                found.extend(opening.rectangle.portal());
            }
        }
        if explained as f64 >= LEAST_EXPLAINED * n_free as f64 { found } else { Vec::new() }
    }

    /// The opening through which the most of these rays pass that others do not.
    fn widest(&self, beams: &[usize]) -> Option<Opening> {
        let choosing: Vec<usize> =
            beams.iter().copied().step_by(beams.len().div_ceil(CHOOSING)).collect();
        let worth = |opening: &Opening| opening.through.len() as f64 * opening.part_free;
        let better = |a: Opening, b: Opening| if worth(&b) > worth(&a) { b } else { a };
        let of_orientation = |orientation: &Orientation| {
            let plane = self.densest(orientation, &choosing)?;
            let in_wall = orientation.near(plane, self.extent);
            let in_wall = in_wall.filter_map(|plane| self.opening(plane, beams)).reduce(better);
            let free = self.opening(plane, beams)?;
            Some(in_wall.filter(|wall| worth(wall) >= WALL * worth(&free)).unwrap_or(free))
        };
        let of_each: Vec<_> = self.orientations.par_iter().map(of_orientation).collect();
        of_each.into_iter().flatten().reduce(better)
    }

    /// The densest opening in a plane.
    fn opening(&self, plane: Plane, beams: &[usize]) -> Option<Opening> {
        let rectangle = self.grown(plane, beams)?;
        let is_passed = |beam: &&Beam| rectangle.is_passed(beam, self.extent);
        let through = beams.iter().copied().filter(|&i| is_passed(&&self.beams[i])).collect();
        let all: Vec<&Beam> = self.beams.iter().filter(is_passed).collect();
        let n_free = all.iter().filter(|beam| beam.is_free).count();
        let part_free = n_free as f64 / all.len().max(1) as f64;
        Some(Opening { rectangle, through, part_free })
    }

    /// Whether rays from several places pass an opening, and not too many others.
    fn is_portal(&self, opening: &Opening) -> bool {
        let places: BTreeSet<u32> = opening.through.iter().map(|&i| self.places[i]).collect();
        places.len() >= FEWEST_PLACES && opening.part_free >= LEAST_FREE
    }

    /// The plane of an orientation in which these rays are most concentrated.
    fn densest(&self, orientation: &Orientation, beams: &[usize]) -> Option<Plane> {
        let &Orientation { normal, axes, .. } = orientation;
        let of_plane = |offset: f32| {
            let plane = Plane { normal, axes, offset };
            (self.meetings(&plane, beams, PATCH), plane)
        };
        let (meetings, plane) =
            orientation.offsets().map(of_plane).reduce(|a, b| if b.0 > a.0 { b } else { a })?;
        (meetings > 0).then(|| self.refined(plane, beams))
    }

    /// The number of ordered pairs of rays from different places that pass the same patch of a plane.
    fn meetings(&self, plane: &Plane, beams: &[usize], patch: f32) -> u64 {
        let patch = patch * self.extent;
        let crossing = |&i: &usize| {
            let cell = (plane.crossing(&self.beams[i], self.extent)? / patch).floor();
            let [x, y] = [cell.x, cell.y].map(|x| u64::from(x as i16 as u16));
            Some((x << 48) | (y << 32) | u64::from(self.places[i]))
        };
        let mut keys: Vec<u64> = beams.iter().filter_map(crossing).collect();
        keys.sort_unstable();
        let squares = |same: fn(&u64, &u64) -> bool| -> u64 {
            keys.chunk_by(same).map(|run| (run.len() * run.len()) as u64).sum()
        };
        squares(|a, b| a >> 32 == b >> 32) - squares(|a, b| a == b)
    }

    /// The plane moved to where more rays meet.
    fn refined(&self, mut plane: Plane, beams: &[usize]) -> Plane {
        /// As fractions of the extent.
        const STEPS: [f32; 3] = [0.01, 0.004, 0.0015];
        for step in STEPS {
            let moved =
                |k: i32| Plane { offset: plane.offset + k as f32 * step * self.extent, ..plane };
            let near = [0, -1, 1, -2, 2].map(|k| {
                let plane = moved(k);
                (self.meetings(&plane, beams, 0.7 * PATCH), plane)
            });
            let best = near.iter().map(|&(n, _)| n).max().expect("five planes");
            plane = near.into_iter().find(|&(n, _)| n == best).expect("one is the best").1;
        }
        plane
    }

    /// The rectangle around the densest patch and its neighbors.
    fn grown(&self, plane: Plane, beams: &[usize]) -> Option<Rectangle> {
        let crossings: Vec<Vec2> =
            beams.iter().filter_map(|&i| plane.crossing(&self.beams[i], self.extent)).collect();
        let patch_of = |at: Vec2| {
            let cell = (at / (WIDE_PATCH * self.extent)).floor();
            [cell.x as i32, cell.y as i32]
        };
        let mut patches: BTreeMap<[i32; 2], usize> = BTreeMap::new();
        for &at in &crossings {
            *patches.entry(patch_of(at)).or_default() += 1;
        }
        let most = *patches.values().max()?;
        let (&start, _) = patches.iter().find(|&(_, &n)| n == most)?;
        let is_dense = |patch: &[i32; 2]| {
            patches.get(patch).is_some_and(|&n| n as f64 >= (GROWTH * most as f64).max(1.0))
        };
        let mut members = BTreeSet::from([start]);
        let mut border = vec![start];
        while let Some([x, y]) = border.pop() {
            let beside = (-1..=1).flat_map(|i| (-1..=1).map(move |j| [x + i, y + j]));
            for patch in beside.filter(is_dense) {
                if members.insert(patch) {
                    border.push(patch);
                }
            }
        }
        let inside: Vec<Vec2> =
            crossings.into_iter().filter(|&at| members.contains(&patch_of(at))).collect();
        (inside.len() >= FEWEST).then(|| self.around(plane, &inside))
    }

    /// The rectangle around points of a plane, with a margin, because the outermost rays pass inside the true edge.
    fn around(&self, plane: Plane, points: &[Vec2]) -> Rectangle {
        /// One in so many points may lie outside at each edge.
        const OUTLIERS: usize = 250;
        let n = points.len();
        let [x, y] = [|p: &Vec2| p.x, |p: &Vec2| p.y].map(|of: fn(&Vec2) -> f32| {
            let mut sorted: Vec<f32> = points.iter().map(of).collect();
            sorted.sort_unstable_by(f32::total_cmp);
            let [low, high] = [sorted[n / OUTLIERS], sorted[n - 1 - n / OUTLIERS]];
            let margin = (high - low) * (1.5 / n as f32 + 0.02) + 1e-3 * self.extent;
            [low - margin, high + margin]
        });
        Rectangle { plane, from: vec2(x[0], y[0]), to: vec2(x[1], y[1]) }
    }
}

impl Orientation {
    /// Offsets at which a plane may lie: walls, and regular ones, because an opening may have no wall around it.
    fn offsets(&self) -> impl Iterator<Item = f32> {
        let [low, high] = self.range;
        let margin = 0.02 * (high - low);
        let step = (high - low + 2.0 * margin) / (OFFSETS - 1) as f32;
        let regular = (0..OFFSETS).map(move |i| low - margin + i as f32 * step);
        self.walls.iter().copied().chain(regular)
    }

    /// The planes of walls near a plane: most windows lie in a wall.
    fn near(&self, plane: Plane, extent: f32) -> impl Iterator<Item = Plane> {
        /// As a fraction of the extent.
        const NEAR: f32 = 0.12;
        let walls = self.walls.iter().copied();
        let near = walls.filter(move |wall| (wall - plane.offset).abs() < NEAR * extent);
        near.map(move |offset| Plane { offset, ..plane })
    }
}

/// The orientations of most surfaces that block rays, without regard to their sides.
fn orientations(beams: &[Beam], blockers: &[Blocker], extent: f32) -> Vec<Orientation> {
    /// Normals that are compared with each other.
    const COMPARED: usize = 512;
    /// The most orientations.
    const MOST_ORIENTATIONS: usize = 8;
    let step = blockers.len().div_ceil(COMPARED).max(1);
    let mut left: Vec<Vec3> = blockers.iter().step_by(step).map(|b| b.normal).collect();
    let n_all = left.len() as f64;
    let mut normals: Vec<Vec3> = Vec::new();
    while normals.len() < MOST_ORIENTATIONS {
        let alike = |normal: Vec3| left.iter().filter(move |n| n.dot(normal).abs() > ALIKE);
        let counted = left.iter().map(|&normal| (alike(normal).count(), normal));
        let Some((n, normal)) = counted.reduce(|a, b| if b.0 > a.0 { b } else { a }) else { break };
        if (n as f64) < LEAST_SHARE * n_all {
            break;
        }
        let sum: Vec3 = alike(normal).map(|&n| if n.dot(normal) < 0.0 { -n } else { n }).sum();
        normals.push(sum.normalize());
        left.retain(|n| n.dot(normal).abs() <= ALIKE);
    }
    let orientation = |&normal: &Vec3| {
        let offsets = beams.iter().map(|beam| beam.origin.dot(normal));
        let [low, high] = offsets
            .fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
        let walls = walls(normal, blockers, extent);
        Orientation { normal, axes: axes(normal, &normals), walls, range: [low, high] }
    };
    normals.iter().map(orientation).collect()
}

/// Where most surfaces of an orientation lie along its normal.
fn walls(normal: Vec3, blockers: &[Blocker], extent: f32) -> Vec<f32> {
    /// The thickness of a wall, as a fraction of the extent.
    const THICKNESS: f32 = 1.0 / 256.0;
    let offset = |b: &Blocker| (b.normal.dot(normal).abs() > ALIKE).then(|| b.position.dot(normal));
    let mut offsets: Vec<f32> = blockers.iter().filter_map(offset).collect();
    offsets.sort_unstable_by(f32::total_cmp);
    let mut walls: Vec<&[f32]> = offsets.chunk_by(|a, b| b - a < THICKNESS * extent).collect();
    walls.retain(|wall| wall.len() as f64 >= LEAST_SHARE * blockers.len() as f64);
    walls.sort_by_key(|wall| std::cmp::Reverse(wall.len()));
    walls.iter().take(WALLS).map(|wall| wall[wall.len() / 2]).collect()
}

/// Two axes in a plane: along another orientation if one is perpendicular.
fn axes(normal: Vec3, orientations: &[Vec3]) -> [Vec3; 2] {
    /// The largest cosine of perpendicular orientations.
    const PERPENDICULAR: f32 = 0.05;
    let other = orientations.iter().find(|other| other.dot(normal).abs() < PERPENDICULAR);
    let Some(&other) = other else {
        let Frame { x, y, .. } = Frame::from_z(normal);
        return [x, y];
    };
    let along = (other - normal * other.dot(normal)).normalize();
    [along, normal.cross(along)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::{Environment, Orientation, builtin::BuiltinProbe};
    use crate::math::{Mat4, vec3};
    use crate::render::Renderer;
    use crate::scene::builtin::BuiltinScene;
    use crate::scene::{Part, SceneDescription};

    fn found(scene: &Scene) -> Vec<Portal> {
        let settings = RenderSettings { width: 64, height: 48, ..RenderSettings::default() };
        let camera = Camera::framing(scene, settings.width, settings.height);
        portals(scene, &camera, &settings).into_owned()
    }

    /// The room, moved, with the portal that it names and without one.
    fn rooms(m: &Mat4) -> [Scene; 2] {
        let mut with = BuiltinScene::Room.description();
        with.transform(m);
        let without = SceneDescription { portals: Vec::new(), ..with.clone() };
        [with, without].map(|description| Scene::new(description).unwrap())
    }

    /// A window is found within its wall, in any orientation and size, with a margin of a few percent.
    #[test]
    fn the_window_of_a_room_is_found() {
        let turned = Mat4::from_axis_angle(vec3(1.0, 2.0, -0.5).normalize(), 0.7);
        for m in [Mat4::IDENTITY, turned, Mat4::from_scale(Vec3::splat(1e-3))] {
            let [with, without] = rooms(&m);
            let [named] = with.portals() else { panic!("one portal") };
            let found = found(&without);
            let [portal] = &found[..] else { panic!("{found:?}") };
            assert!(portal.area() > named.area() && portal.area() < 1.2 * named.area());
            for corner in corners(portal) {
                let inside = corner - named.corner();
                let depth = inside.dot(named.normal()).abs() / named.edges()[0].length();
                assert!(depth < 0.2, "{depth} of its height off the inner side of the wall");
                for edge in named.edges() {
                    let along = inside.dot(edge) / edge.length_squared();
                    let off = along.abs().min((along - 1.0).abs());
                    assert!(off < 0.06, "{corner} is {off} of the edge beside a corner");
                }
            }
        }
    }

    fn corners(portal: &Portal) -> [Vec3; 4] {
        let (corner, [a, b]) = (portal.corner(), portal.edges());
        [corner, corner + a, corner + b, corner + a + b]
    }

    #[test]
    fn named_portals_are_kept() {
        let [scene, _] = rooms(&Mat4::IDENTITY);
        assert_eq!(found(&scene), scene.portals());
    }

    #[test]
    fn only_strategies_that_sample_portals_look_for_them() {
        let [_, scene] = rooms(&Mat4::IDENTITY);
        let environment =
            Environment::new(BuiltinProbe::Sky.image(16), Orientation::default(), 1.0).unwrap();
        let settings = RenderSettings { width: 64, height: 48, ..RenderSettings::default() };
        let camera = Camera::framing(&scene, settings.width, settings.height);
        for (strategy, n) in [("mis:1:1", 0), ("mis:1:1:portals=2", 1), ("product:4", 1)] {
            let spec = strategy.parse().unwrap();
            let renderer = Renderer::new(&scene, &camera, &environment, spec, settings).unwrap();
            assert_eq!(renderer.rendering().found_portals.len(), n, "{strategy}");
        }
    }

    /// Open scenes, closed rooms and holes that rays do not find have none.
    #[test]
    fn only_rooms_with_windows_have_openings() {
        for scene in [BuiltinScene::Sphere, BuiltinScene::Statue, BuiltinScene::Spheres] {
            assert_eq!(found(&Scene::builtin(scene)), [], "{scene:?}");
        }
        let mut closed = BuiltinScene::Room.description();
        let shutter = closed.portals.pop().unwrap();
        let [corner, _, _, opposite] = corners(&shutter);
        let (low, high) = (corner.min(opposite), corner.max(opposite));
        let mut part: Part = closed.parts[0].clone();
        part.mesh = shutters(low, high);
        closed.parts.push(part);
        closed.instances.clear();
        assert_eq!(found(&Scene::new(closed).unwrap()), []);
    }

    /// A box around a window.
    fn shutters(low: Vec3, high: Vec3) -> crate::geometry::Mesh {
        let (low, high) = (low - 0.05, high + 0.05);
        let at = |i: usize| {
            let of = |axis: usize| if i >> axis & 1 == 1 { high[axis] } else { low[axis] };
            vec3(of(0), of(1), of(2))
        };
        let quads =
            [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        crate::geometry::Mesh {
            positions: (0..8).map(at).collect(),
            triangles,
            ..crate::geometry::Mesh::default()
        }
    }
}
