//! Triangulates polygons of any shape by ear clipping.
//!
//! Meisters 1975, "Polygons Have Ears"; Eberly, "Triangulation by Ear Clipping". A convex polygon is a fan around
//! its first corner. A hole connected to the outline by a slit, as in many polygon files, is followed around.
//!
//! We do not use the crate earcut, because it tries every diagonal of a polygon that it cannot clip, which takes hours
//! for a hostile one. Here the work per file is bounded; polygons beyond the bound become fans.

use crate::math::Vec3;

/// Corners that are compared with a triangle, at the most, for all polygons of a file.
const MAX_WORK: u64 = 1 << 30;

/// Cuts a file's polygons, keeping its memory from one to the next.
#[derive(Default)]
pub(super) struct Triangulator {
    work: u64,
    /// Corners in the plane of the polygon.
    plane: Vec<[f64; 2]>,
    /// Corners that are left, in order.
    ring: Vec<u32>,
    triangles: Vec<[u32; 3]>,
}

impl Triangulator {
    /// Triangles over the corners `0..n` at `position(i)`, of the polygon's orientation: n − 2 of them.
    pub(super) fn triangulate(
        &mut self,
        n: usize,
        position: impl Fn(usize) -> Vec3,
    ) -> &[[u32; 3]] {
        self.triangles.clear();
        if n > 3 && !self.project(n, position) && !self.is_convex() {
            self.clip();
        } else {
            self.fan(n);
        }
        &self.triangles
    }

    fn fan(&mut self, n: usize) {
        let n = n as u32;
        self.triangles.extend((2..n).map(|i| [0, i - 1, i]));
    }

    /// Drops the axis along which the polygon's area is largest; true if it has no area.
    fn project(&mut self, n: usize, position: impl Fn(usize) -> Vec3) -> bool {
        let at = |i: usize| (position(i) - position(0)).as_dvec3();
        // Newell's normal.
        let normal = (1..n - 1).map(|i| at(i).cross(at(i + 1))).sum::<glam::DVec3>();
        let axis = normal.abs().max_position();
        // Counterclockwise in the plane.
        let (u, v) = match (axis, normal[axis] > 0.0) {
            (0, true) => (1, 2),
            (0, false) => (2, 1),
            (1, true) => (2, 0),
            (1, false) => (0, 2),
            (_, true) => (0, 1),
            (_, false) => (1, 0),
        };
        self.plane.clear();
        self.plane.extend((0..n).map(|i| [at(i)[u], at(i)[v]]));
        !(normal[axis].abs() > 0.0 && normal.is_finite())
    }

    /// Every corner turns left, and all of them together once.
    fn is_convex(&self) -> bool {
        let n = self.plane.len();
        let at = |i: usize| self.plane[i % n];
        let turns_left = (0..n).all(|i| area(at(i), at(i + 1), at(i + 2)) >= 0.0);
        // A convex ring goes up once and down once.
        let rises = |i: usize| at(i + 1)[1] > at(i)[1];
        let changes = (0..n).filter(|&i| rises(i) != rises(i + 1)).count();
        turns_left && changes <= 2
    }

    /// Cuts off ears until a triangle is left. Where there is none, as where sides cross, any corner is cut off.
    fn clip(&mut self) {
        self.ring.clear();
        self.ring.extend(0..self.plane.len() as u32);
        // The corner before the one that is tried, and how many were tried since the last ear.
        let (mut i, mut tried) = (0, 0);
        while self.ring.len() > 3 && self.work < MAX_WORK {
            let n = self.ring.len();
            let [a, b, c] = [i, i + 1, i + 2].map(|i| self.ring[i % n]);
            if tried >= n || self.is_ear([a, b, c]) {
                self.triangles.push([a, b, c]);
                let cut = (i + 1) % n;
                self.ring.remove(cut);
                // The corner before stands where it stood, or one earlier.
                i = if cut == 0 { n - 2 } else { cut - 1 };
                // Alternate sides, so that triangles stay stout.
                i = (i + 1) % (n - 1);
                tried = 0;
            } else {
                i = (i + 1) % n;
                tried += 1;
            }
        }
        let rest = &self.ring;
        self.triangles.extend((2..rest.len()).map(|i| [rest[0], rest[i - 1], rest[i]]));
    }

    /// Whether the corner b turns left and the triangle (a, b, c) holds no other corner.
    fn is_ear(&mut self, [a, b, c]: [u32; 3]) -> bool {
        let [pa, pb, pc] = [a, b, c].map(|i| self.plane[i as usize]);
        self.work += self.ring.len() as u64;
        if area(pa, pb, pc) <= 0.0 {
            return false;
        }
        let is_inside = |p: [f64; 2]| {
            // A slit's two banks have the same corners.
            p != pa
                && p != pb
                && p != pc
                && area(pa, pb, p) >= 0.0
                && area(pb, pc, p) >= 0.0
                && area(pc, pa, p) >= 0.0
        };
        !self.ring.iter().any(|&i| is_inside(self.plane[i as usize]))
    }
}

/// Twice the signed area of a triangle.
fn area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vec3;

    /// Areas of the triangles, and the polygon's own.
    fn areas(corners: &[[f32; 2]]) -> (Vec<f64>, f64) {
        let at = |i: usize| corners[i].map(f64::from);
        let n = corners.len();
        // On a plane that leans, so that the projection matters.
        let position = |i: usize| vec3(corners[i][0], corners[i][1], 0.3 * corners[i][0]);
        let mut triangulator = Triangulator::default();
        let triangles = triangulator.triangulate(n, position);
        assert_eq!(triangles.len(), n - 2);
        let areas = triangles
            .iter()
            .map(|t| 0.5 * area(at(t[0] as usize), at(t[1] as usize), at(t[2] as usize)));
        let areas = areas.collect();
        let whole =
            (0..n).map(|i| 0.5 * (at(i)[0] * at((i + 1) % n)[1] - at(i)[1] * at((i + 1) % n)[0]));
        (areas, whole.sum())
    }

    fn covers_once(corners: &[[f32; 2]]) {
        for corners in [corners.to_vec(), corners.iter().rev().copied().collect()] {
            for start in 0..corners.len() {
                let mut turned = corners.clone();
                turned.rotate_left(start);
                let (areas, whole) = areas(&turned);
                assert!(areas.iter().all(|a| a * whole >= 0.0), "{turned:?}: {areas:?}");
                let sum: f64 = areas.iter().sum();
                assert!((sum / whole - 1.0).abs() < 1e-6, "{turned:?}: {sum} {whole}");
            }
        }
    }

    #[test]
    fn polygons_of_any_shape_are_covered_once() {
        // An arrow head, an L, a comb, a star and a spiral.
        covers_once(&[[0.0, 0.0], [2.0, 1.0], [0.0, 2.0], [0.5, 1.0]]);
        covers_once(&[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]]);
        let comb: Vec<[f32; 2]> =
            (0..10).map(|i| [i as f32, if i % 2 == 0 { 1.0 } else { 5.0 }]).collect();
        covers_once(
            &[&[[9.0, 0.0], [0.0, 0.0]], &comb[..]].concat().into_iter().rev().collect::<Vec<_>>(),
        );
        let star = |i: i32| {
            let (r, phi) = (if i % 2 == 0 { 1.0 } else { 0.3 }, i as f32 * 0.628);
            [r * phi.cos(), r * phi.sin()]
        };
        covers_once(&(0..10).map(star).collect::<Vec<_>>());
        let arm = |i: i32, r: f32| {
            let phi = i as f32 * 0.5;
            [(r + 0.1 * phi) * phi.cos(), (r + 0.1 * phi) * phi.sin()]
        };
        let out = (0..30).map(|i| arm(i, 0.3));
        covers_once(&out.chain((0..30).rev().map(|i| arm(i, 0.1))).collect::<Vec<_>>());
    }

    #[test]
    fn a_hole_that_is_slit_open_stays_a_hole() {
        let square = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0], [0.0, 0.0]];
        let hole = [[1.0, 1.0], [1.0, 3.0], [3.0, 3.0], [3.0, 1.0], [1.0, 1.0]];
        let corners = [&square[..], &hole[..]].concat();
        let (areas, whole) = areas(&corners);
        assert_eq!(whole, 12.0);
        assert!(areas.iter().all(|&a| a >= 0.0), "{areas:?}");
        assert_eq!(areas.iter().sum::<f64>(), 12.0);
    }

    #[test]
    fn convex_and_degenerate_polygons_are_fans() {
        let mut triangulator = Triangulator::default();
        let quad = [Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y];
        assert_eq!(triangulator.triangulate(4, |i| quad[i]), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(triangulator.triangulate(5, |_| Vec3::ONE), [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
        assert_eq!(triangulator.triangulate(4, |i| Vec3::X * i as f32).len(), 2);
        assert_eq!(triangulator.triangulate(3, |i| quad[i]), [[0, 1, 2]]);
        // Twice round.
        let double = |i: usize| quad[i % 4];
        assert_eq!(triangulator.triangulate(8, double).len(), 6);
    }

    #[test]
    fn hostile_polygons_take_bounded_time() {
        let mut state = 7u32;
        let mut random = || {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            (state >> 8) as f32
        };
        let corners: Vec<Vec3> = (0..20_000).map(|_| vec3(random(), random(), 0.0)).collect();
        let mut triangulator = Triangulator::default();
        for _ in 0..3 {
            assert_eq!(triangulator.triangulate(corners.len(), |i| corners[i]).len(), 19_998);
        }
    }
}
