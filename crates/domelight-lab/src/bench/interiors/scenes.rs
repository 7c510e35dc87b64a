//! Interiors: scenes that light enters through small openings.

use domelight::Rgb;
use domelight::bsdf::{Bsdf, MaterialSpec};
use domelight::geometry::Mesh;
use domelight::math::{FRAC_PI_2, Mat4, PI, TAU, Vec2, Vec3, vec2, vec3};
use domelight::sampling::Pcg32;
use domelight::scene::builtin::shapes::icosphere;
use domelight::scene::{CameraSettings, Material, Part, Projection, SceneDescription};
use domelight::strategy::Portal;

/// A scene, all of it diffuse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Interior {
    /// 4 × 3 × 5 m with a window of 1 × 1.2 m, and a ball.
    Room,
    /// The same with a window of 1.6 × 1.6 m behind slats.
    Blinds,
    /// 2 × 2.6 × 9 m with a small window and a skylight, a table, pillars and a ladder.
    Corridor,
    /// A shell with holes around a ball.
    Cage,
}

impl Interior {
    pub(super) const ALL: [Self; 4] = [Self::Room, Self::Blinds, Self::Corridor, Self::Cage];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Room => "room",
            Self::Blinds => "blinds",
            Self::Corridor => "corridor",
            Self::Cage => "cage",
        }
    }

    pub(super) fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|interior| interior.name() == name)
    }

    /// The scene, with its portals.
    pub(super) fn describe(self) -> SceneDescription {
        let mut quads = Quads::default();
        let (mesh, portals, camera) = match self {
            Self::Room => {
                quads.room(ROOM, &[Hole::of(WALL, [1.0, 2.2], [-0.5, 0.5])]);
                let window = portal(vec3(2.0, 1.0, -0.5), 1.2 * Vec3::Y, Vec3::Z);
                (quads.with_ball(0.5, vec3(0.0, 0.5, -1.0)), vec![window], camera_of_room())
            }
            Self::Blinds => {
                quads.room(ROOM, &[Hole::of(WALL, [0.8, 2.4], [-0.8, 0.8])]);
                quads.slats();
                let window = portal(vec3(2.0, 0.8, -0.8), 1.6 * Vec3::Y, 1.6 * Vec3::Z);
                (quads.with_ball(0.5, vec3(0.0, 0.5, -1.0)), vec![window], camera_of_room())
            }
            Self::Corridor => {
                quads.room(
                    [vec3(-1.0, 0.0, -6.0), vec3(1.0, 2.6, 3.0)],
                    &[
                        Hole::of(WALL, [1.1, 1.9], [-1.9, -1.1]),
                        Hole::of(CEILING, [-4.6, -4.0], [-0.6, 0.6]),
                    ],
                );
                quads.furniture();
                let window = portal(vec3(1.0, 1.1, -1.9), 0.8 * Vec3::Y, 0.8 * Vec3::Z);
                let skylight = portal(vec3(-0.6, 2.6, -4.6), 1.2 * Vec3::X, 0.6 * Vec3::Z);
                let camera = camera(vec3(-0.3, 1.6, 2.8), vec3(0.0, 1.0, -3.5), 55.0);
                (quads.mesh(), vec![window, skylight], camera)
            }
            Self::Cage => {
                quads.cage();
                let camera = camera(vec3(0.0, 1.3, 1.8), vec3(0.0, 0.9, 0.0), 60.0);
                (quads.with_ball(0.7, vec3(0.0, 1.0, 0.0)), Vec::new(), camera)
            }
        };
        let white = MaterialSpec::Diffuse { albedo: Rgb::splat(0.7) };
        SceneDescription {
            parts: vec![Part { name: self.name().to_owned(), mesh, material: 0 }],
            materials: vec![Material::fixed(self.name(), Bsdf::from(white))],
            camera: Some(camera),
            portals,
            ..SceneDescription::default()
        }
    }
}

/// The corners of the room.
const ROOM: [Vec3; 2] = [vec3(-2.0, 0.0, -2.5), vec3(2.0, 3.0, 2.5)];

fn camera_of_room() -> CameraSettings {
    camera(vec3(-1.2, 1.5, 2.3), vec3(0.2, 1.0, -2.0), 60.0)
}

fn camera(origin: Vec3, target: Vec3, fov_y_degrees: f32) -> CameraSettings {
    let projection = Projection::Perspective { fov_y_degrees };
    CameraSettings { projection, origin, target, up: Vec3::Y }
}

fn portal(corner: Vec3, a: Vec3, b: Vec3) -> Portal {
    Portal::new(corner, [a, b]).expect("edges that span a rectangle")
}

/// An opening in a wall or in the ceiling, by its ranges along the two axes that follow the normal's.
struct Hole {
    /// The axis of the normal; the hole is in the side with the greater coordinate.
    axis: usize,
    ranges: [[f32; 2]; 2],
}

const WALL: usize = 0;
const CEILING: usize = 1;

impl Hole {
    fn of(axis: usize, a: [f32; 2], b: [f32; 2]) -> Self {
        Self { axis, ranges: [a, b] }
    }
}

/// A mesh of quadrilaterals, with flat faces.
#[derive(Default)]
struct Quads {
    mesh: Mesh,
}

impl Quads {
    fn mesh(self) -> Mesh {
        self.mesh
    }

    fn with_ball(mut self, radius: f32, center: Vec3) -> Mesh {
        let mut ball = icosphere(5);
        ball.transform(&(Mat4::from_translation(center) * Mat4::from_scale(Vec3::splat(radius))));
        let first = self.mesh.positions.len() as u32;
        self.mesh.positions.extend(ball.positions);
        self.mesh.triangles.extend(ball.triangles.iter().map(|t| t.map(|i| first + i)));
        self.mesh
    }

    fn push(&mut self, corners: [Vec3; 4]) {
        let first = self.mesh.positions.len() as u32;
        self.mesh.positions.extend(corners);
        self.mesh.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i| first + i)));
    }

    /// A rectangle perpendicular to `axis`, with holes, as a grid of smaller ones.
    fn wall(&mut self, axis: usize, at: f32, ranges: [[f32; 2]; 2], holes: &[[[f32; 2]; 2]]) {
        let cuts = ranges.map(|range| range.to_vec());
        let [mut us, mut vs] = cuts;
        for [u, v] in holes {
            us.extend(u);
            vs.extend(v);
        }
        us.sort_by(f32::total_cmp);
        vs.sort_by(f32::total_cmp);
        let place = |u: f32, v: f32| {
            let mut p = [0.0; 3];
            (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (at, u, v);
            Vec3::from(p)
        };
        let inside = |[a, b]: [f32; 2], x: f32| a < x && x < b;
        for u in us.windows(2) {
            for v in vs.windows(2) {
                let [middle_u, middle_v] = [u, v].map(|w| 0.5 * (w[0] + w[1]));
                let is_open = |h: &[[f32; 2]; 2]| inside(h[0], middle_u) && inside(h[1], middle_v);
                if !holes.iter().any(is_open) && u[0] < u[1] && v[0] < v[1] {
                    let corners = [(0, 0), (1, 0), (1, 1), (0, 1)];
                    self.push(corners.map(|(i, j)| place(u[i], v[j])));
                }
            }
        }
    }

    /// The six sides of a box.
    fn room<const N: usize>(&mut self, [low, high]: [Vec3; 2], holes: &[Hole; N]) {
        for axis in 0..3 {
            let range = |axis: usize| [low[axis], high[axis]];
            let ranges = [range((axis + 1) % 3), range((axis + 2) % 3)];
            let open: Vec<_> = holes.iter().filter(|h| h.axis == axis).map(|h| h.ranges).collect();
            self.wall(axis, low[axis], ranges, &[]);
            self.wall(axis, high[axis], ranges, &open);
        }
    }

    /// Sixteen slats of 8 cm before the window, tilted by 35 degrees.
    fn slats(&mut self) {
        let half = 0.04 * Vec2::from_angle(35f32.to_radians());
        for i in 0..16 {
            let (x, y) = (1.95, 0.85 + 0.1 * i as f32);
            let [low, high] = [vec2(x, y) - half, vec2(x, y) + half];
            let corners = [(low, -0.8), (low, 0.8), (high, 0.8), (high, -0.8)];
            self.push(corners.map(|(p, z)| vec3(p.x, p.y, z)));
        }
    }

    /// A table, three pillars and a ladder.
    fn furniture(&mut self) {
        let mut cuboid = |low, high| self.room([low, high], &[]);
        cuboid(vec3(-0.7, 0.7, -2.2), vec3(-0.1, 0.75, -1.0));
        for (x, z) in [(-0.7, -2.2), (-0.7, -1.05), (-0.15, -2.2), (-0.15, -1.05)] {
            cuboid(vec3(x, 0.0, z), vec3(x + 0.05, 0.7, z + 0.05));
        }
        for z in [-3.2, -2.4, -0.6] {
            cuboid(vec3(0.55, 0.0, z), vec3(0.65, 2.6, z + 0.1));
        }
        for i in 0..7 {
            let z = -4.7 + 0.12 * i as f32;
            cuboid(vec3(-0.5, 1.9, z), vec3(0.5, 1.94, z + 0.04));
        }
    }

    /// A sphere of 36 × 18 patches, 56 of which are left out at random.
    fn cage(&mut self) {
        const COLUMNS: usize = 36;
        const ROWS: usize = 18;
        const HOLES: usize = 56;
        let mut pcg = Pcg32::new(4, 0);
        let mut is_hole = [[false; COLUMNS]; ROWS];
        let mut n_holes = 0;
        while n_holes < HOLES {
            let row = 3 + (pcg.next_f32() * (ROWS - 6) as f32) as usize;
            let column = (pcg.next_f32() * COLUMNS as f32) as usize;
            n_holes += usize::from(!is_hole[row][column]);
            is_hole[row][column] = true;
        }
        let place = |column: usize, row: usize| {
            let azimuth = Vec2::from_angle(TAU * column as f32 / COLUMNS as f32);
            let height = Vec2::from_angle(FRAC_PI_2 - PI * row as f32 / ROWS as f32);
            vec3(height.x * azimuth.x, height.y, height.x * azimuth.y) * 2.0 + Vec3::Y
        };
        for row in 0..ROWS {
            for column in (0..COLUMNS).filter(|&column| !is_hole[row][column]) {
                let corners = [(0, 0), (1, 0), (1, 1), (0, 1)];
                self.push(corners.map(|(i, j)| place(column + i, row + j)));
            }
        }
    }
}
