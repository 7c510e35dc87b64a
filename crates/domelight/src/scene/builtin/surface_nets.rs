//! Meshes of implicit surfaces: surface nets whose vertices are drawn onto the surface.
//!
//! One vertex stands in each grid cell that the surface crosses, at the mean of the crossings of
//! the cell's edges (Gibson 1998, "Constrained Elastic Surface Nets"), and one quadrilateral across each
//! grid edge that the surface crosses. Newton steps along the gradient then bring the vertices onto the
//! surface, and the gradient there is the exact normal. Marching cubes was not chosen for its slivers
//! and its table; dual contouring (Ju et al. 2002) would keep sharp edges, which our sculptures do
//! not have.
//!
//! Where two sheets pass through one cell they share a vertex and the mesh is not a manifold there;
//! the field must be smooth at the size of a cell.

use crate::geometry::{Aabb, Mesh};
use crate::math::{Vec3, vec3};

/// Cells along the edge of a block, the unit in which empty space is skipped.
const BLOCK: usize = 8;
/// Newton steps toward the surface.
const PROJECTIONS: usize = 3;
/// A cell that the surface does not cross.
const NO_VERTEX: u32 = u32::MAX;

/// The zero set of `field` (negative inside, positive on the boundary of `bounds` and beyond) in
/// cubic cells of edge `cell`; `lipschitz` bounds the field's slope.
pub(super) fn surface_nets(
    field: &impl Fn(Vec3) -> f32,
    bounds: &Aabb,
    cell: f32,
    lipschitz: f32,
) -> Mesh {
    let grid = Grid::sample(field, bounds, cell, lipschitz);
    let (vertex_of, mut mesh) = grid.place_vertices();
    grid.connect(&vertex_of, &mut mesh);
    for p in &mut mesh.positions {
        let normal = project(field, p, cell);
        mesh.normals.push(normal);
    }
    mesh
}

/// Samples of the field at the corners of cubic cells.
struct Grid {
    origin: Vec3,
    cell: f32,
    /// Samples along x, y, z, whole blocks.
    size: [usize; 3],
    values: Vec<f32>,
    /// First samples of the blocks that the surface may cross.
    active: Vec<[usize; 3]>,
}

impl Grid {
    fn sample(field: &impl Fn(Vec3) -> f32, bounds: &Aabb, cell: f32, lipschitz: f32) -> Self {
        let count = |extent: f32| ((extent / cell).ceil() as usize + 1).next_multiple_of(BLOCK);
        let size = bounds.size().to_array().map(count);
        let values = vec![0.0; size.iter().product()];
        let mut grid = Self { origin: bounds.min, cell, size, values, active: Vec::new() };
        // No surface within a block or one cell beyond it when its centre is farther than this.
        let reach = lipschitz * cell * 3f32.sqrt() * (0.5 * BLOCK as f32 + 1.0);
        for block in points(size.map(|n| n / BLOCK)) {
            let first = block.map(|i| i * BLOCK);
            let center = grid.position(first) + 0.5 * cell * (BLOCK - 1) as f32;
            let distance = field(center);
            let is_active = distance.abs() < reach;
            for offset in points([BLOCK; 3]) {
                let p = add(first, offset);
                let i = grid.index(p);
                grid.values[i] = if is_active { field(grid.position(p)) } else { distance };
            }
            if is_active {
                grid.active.push(first);
            }
        }
        grid
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.size[1] + y) * self.size[0] + x
    }

    fn position(&self, p: [usize; 3]) -> Vec3 {
        self.origin + self.cell * Vec3::from_array(p.map(|i| i as f32))
    }

    /// The samples of the active blocks that are the least corner of a cell.
    fn active_cells(&self) -> impl Iterator<Item = [usize; 3]> {
        let blocks = self.active.iter();
        blocks
            .flat_map(|&first| points([BLOCK; 3]).map(move |offset| add(first, offset)))
            .filter(|p| (0..3).all(|axis| p[axis] + 1 < self.size[axis]))
    }

    /// One vertex a crossed cell, at the mean of the crossings; and which vertex each cell has.
    fn place_vertices(&self) -> (Vec<u32>, Mesh) {
        let mut vertex_of = vec![NO_VERTEX; self.values.len()];
        let mut mesh = Mesh::default();
        for p in self.active_cells() {
            if let Some(offset) = self.mean_crossing(p) {
                vertex_of[self.index(p)] = mesh.positions.len() as u32;
                mesh.positions.push(self.position(p) + self.cell * offset);
            }
        }
        (vertex_of, mesh)
    }

    /// The mean of the points where the surface crosses the edges of a cell, in cells from its
    /// least corner.
    fn mean_crossing(&self, p: [usize; 3]) -> Option<Vec3> {
        let corner = |k: usize| [k & 1, k >> 1 & 1, k >> 2];
        let values: [f32; 8] = std::array::from_fn(|k| self.values[self.index(add(p, corner(k)))]);
        let inside = values.iter().filter(|&&v| v < 0.0).count();
        if inside == 0 || inside == 8 {
            return None;
        }
        let mut sum = Vec3::ZERO;
        let mut crossings = 0.0;
        for a in 0..8 {
            for b in [a | 1, a | 2, a | 4] {
                let (va, vb) = (values[a], values[b]);
                if (va < 0.0) != (vb < 0.0) {
                    let [pa, pb] = [a, b].map(|k| Vec3::from_array(corner(k).map(|i| i as f32)));
                    sum += pa.lerp(pb, va / (va - vb));
                    crossings += 1.0;
                }
            }
        }
        Some(sum / crossings)
    }

    /// Two triangles round each crossed grid edge, through the vertices of the four cells there.
    fn connect(&self, vertex_of: &[u32], mesh: &mut Mesh) {
        for p in self.active_cells() {
            for axis in 0..3 {
                let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
                if p[b] == 0 || p[c] == 0 {
                    continue;
                }
                let begins_inside = self.values[self.index(p)] < 0.0;
                let ends_inside = self.values[self.index(step(p, axis))] < 0.0;
                if begins_inside == ends_inside {
                    continue;
                }
                // Counter-clockwise about the axis, which points out where the edge begins inside.
                let round = [p, back(p, b), back(back(p, b), c), back(p, c)];
                let mut quad = round.map(|cell| vertex_of[self.index(cell)]);
                if !begins_inside {
                    quad.reverse();
                }
                push_quad(mesh, quad);
            }
        }
    }
}

/// Splits a quadrilateral along its shorter diagonal.
fn push_quad(mesh: &mut Mesh, [a, b, c, d]: [u32; 4]) {
    let diagonal = |i: u32, j: u32| {
        mesh.positions[i as usize].distance_squared(mesh.positions[j as usize])
    };
    let halves = if diagonal(a, c) <= diagonal(b, d) {
        [[a, b, c], [a, c, d]]
    } else {
        [[a, b, d], [b, c, d]]
    };
    mesh.triangles.extend(halves);
}

/// Moves `p` onto the surface, by at most a cell, and returns the normal there.
fn project(field: &impl Fn(Vec3) -> f32, p: &mut Vec3, cell: f32) -> Vec3 {
    let start = *p;
    for _ in 0..PROJECTIONS {
        let slope = gradient(field, *p, cell);
        let newton = field(*p) / slope.length_squared().max(1e-6);
        *p = start + (*p - newton * slope - start).clamp_length_max(cell);
    }
    gradient(field, *p, cell).normalize_or(Vec3::Y)
}

/// ∇field from four samples at the corners of a tetrahedron.
fn gradient(field: &impl Fn(Vec3) -> f32, p: Vec3, cell: f32) -> Vec3 {
    let h = 0.2 * cell;
    let corners =
        [vec3(1.0, -1.0, -1.0), vec3(-1.0, -1.0, 1.0), vec3(-1.0, 1.0, -1.0), Vec3::ONE];
    corners.into_iter().map(|k| k * field(p + h * k)).sum::<Vec3>() / (4.0 * h)
}

/// All index triples below `size`, x fastest.
fn points([nx, ny, nz]: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..nz).flat_map(move |z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])))
}

fn add(a: [usize; 3], b: [usize; 3]) -> [usize; 3] {
    std::array::from_fn(|i| a[i] + b[i])
}

fn step(mut p: [usize; 3], axis: usize) -> [usize; 3] {
    p[axis] += 1;
    p
}

fn back(mut p: [usize; 3], axis: usize) -> [usize; 3] {
    p[axis] -= 1;
    p
}
