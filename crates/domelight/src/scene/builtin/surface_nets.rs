//! Meshes of implicit surfaces: surface nets whose vertices are drawn onto the surface.
//!
//! One vertex stands in each grid cell for each sheet of the surface that crosses it, at the mean of
//! the crossings of the cell's edges (Gibson 1998, "Constrained Elastic Surface Nets"; Nielson 2004,
//! "Dual Marching Cubes", for the sheets, without which edges may belong to four triangles), and one quadrilateral across each
//! grid edge that the surface crosses. A Newton step along the gradient then brings each vertex onto the
//! surface, and the gradient there is the exact normal. Marching cubes was not chosen for its slivers
//! and its table; dual contouring (Ju et al. 2002) would keep sharp edges, which our sculptures do
//! not have.

use rayon::prelude::*;

use crate::geometry::{Aabb, Mesh};
use crate::math::{Vec3, vec3};

/// Cells along the edge of a block, the unit in which empty space is skipped.
const BLOCK: usize = 4;
/// A cell that the surface does not cross.
const NO_CELL: u32 = u32::MAX;

/// The zero set of `field` (negative inside, positive on the boundary of `bounds` and beyond) in
/// cubic cells of edge `cell`; `lipschitz` bounds the field's slope.
pub(super) fn surface_nets(
    field: &(impl Fn(Vec3) -> f32 + Sync),
    bounds: &Aabb,
    cell: f32,
    lipschitz: f32,
) -> Mesh {
    let grid = Grid::sample(field, bounds, cell, lipschitz);
    let (cells, mut mesh) = grid.place_vertices();
    grid.connect(&cells, &mut mesh);
    mesh.normals = mesh.positions.par_iter_mut().map(|p| project(field, p, cell)).collect();
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
    fn sample(
        field: &(impl Fn(Vec3) -> f32 + Sync),
        bounds: &Aabb,
        cell: f32,
        lipschitz: f32,
    ) -> Self {
        let count = |extent: f32| ((extent / cell).ceil() as usize + 1).next_multiple_of(BLOCK);
        let size = bounds.size().to_array().map(count);
        let values = vec![0.0; size.iter().product()];
        let mut grid = Self { origin: bounds.min, cell, size, values, active: Vec::new() };
        // Samples of a block whose center is farther from the surface have no crossed edge.
        let reach = lipschitz * cell * (3f32.sqrt() * 0.5 * (BLOCK - 1) as f32 + 1.0);
        let firsts: Vec<_> =
            points(size.map(|n| n / BLOCK)).map(|block| block.map(|i| i * BLOCK)).collect();
        let sampled = |&first: &[usize; 3]| {
            let center = grid.position(first) + Vec3::splat(0.5 * cell * (BLOCK - 1) as f32);
            let distance = field(center);
            let of_corner = |offset| field(grid.position(add(first, offset)));
            let is_active = distance.abs() < reach;
            let values = is_active.then(|| points([BLOCK; 3]).map(of_corner).collect::<Vec<_>>());
            (distance, values)
        };
        let blocks: Vec<_> = firsts.par_iter().map(sampled).collect();
        for (first, (distance, values)) in firsts.into_iter().zip(blocks) {
            for (k, offset) in points([BLOCK; 3]).enumerate() {
                let i = grid.index(add(first, offset));
                grid.values[i] = values.as_ref().map_or(distance, |values| values[k]);
            }
            if values.is_some() {
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

    /// The vertices of all crossed cells, and where those of each cell are.
    fn place_vertices(&self) -> (Cells, Mesh) {
        let mut cells = Cells { index: vec![NO_CELL; self.values.len()], sheets: Vec::new() };
        let mut mesh = Mesh::default();
        for p in self.active_cells() {
            let values: [f32; 8] =
                std::array::from_fn(|k| self.values[self.index(add(p, corner(k)))]);
            let inside = values.map(|v| v < 0.0);
            if inside == [false; 8] || inside == [true; 8] {
                continue;
            }
            cells.index[self.index(p)] = cells.sheets.len() as u32;
            let mut sheets = link_crossings(inside);
            for first in 0..12 {
                if sheets[first] == first as u32 {
                    let vertex = mesh.positions.len() as u32;
                    let offset = mean_crossing(&values, |slot| sheets[slot] == first as u32);
                    mesh.positions.push(self.position(p) + self.cell * offset);
                    // Beyond 12, so that it is not taken for a slot.
                    sheets = sheets.map(|s| if s == first as u32 { vertex + 12 } else { s });
                }
            }
            cells.sheets.push(sheets);
        }
        (cells, mesh)
    }

    /// Two triangles round each crossed grid edge, through the vertices of the four cells there.
    fn connect(&self, cells: &Cells, mesh: &mut Mesh) {
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
                // Counterclockwise about the axis, which points out where the edge begins inside.
                let round = [
                    (p, 0, 0),
                    (back(p, b), 1, 0),
                    (back(back(p, b), c), 1, 1),
                    (back(p, c), 0, 1),
                ];
                let mut quad =
                    round.map(|(cell, ob, oc)| cells.vertex(self.index(cell), slot(axis, ob, oc)));
                if !begins_inside {
                    quad.reverse();
                }
                push_quad(mesh, quad);
            }
        }
    }
}

/// The crossed cells.
struct Cells {
    /// The entry in `sheets` of each grid cell, or [`NO_CELL`].
    index: Vec<u32>,
    /// For each edge of a crossed cell, 12 more than the vertex of the sheet that crosses it.
    sheets: Vec<[u32; 12]>,
}

impl Cells {
    /// The vertex in cell `index` of the sheet that crosses the edge `slot`.
    fn vertex(&self, index: usize, slot: usize) -> u32 {
        self.sheets[self.index[index] as usize][slot] - 12
    }
}

/// The number of a cell's edge along `axis`, at offsets `ob` and `oc` (0 or 1) along the two
/// axes that follow it.
fn slot(axis: usize, ob: usize, oc: usize) -> usize {
    4 * axis + ob + 2 * oc
}

/// The corners at the ends of a cell's edge, bit i the offset along axis i.
fn slot_corners(slot: usize) -> [usize; 2] {
    let (axis, ob, oc) = (slot / 4, slot & 1, slot >> 1 & 1);
    let from = ob << ((axis + 1) % 3) | oc << ((axis + 2) % 3);
    [from, from | 1 << axis]
}

fn corner(k: usize) -> [usize; 3] {
    [k & 1, k >> 1 & 1, k >> 2]
}

/// Joins the crossed edges of a cell into sheets: edges of one sheet get the number of its least edge,
/// the others `u32::MAX`.
///
/// On a face the surface joins two crossed edges; of four, those two that meet in a corner inside.
/// Both cells at a face see it alike.
fn link_crossings(inside: [bool; 8]) -> [u32; 12] {
    let mut sheets: [u32; 12] = std::array::from_fn(|slot| {
        let [from, to] = slot_corners(slot);
        if inside[from] == inside[to] { u32::MAX } else { slot as u32 }
    });
    for n in 0..3 {
        let (b, c) = ((n + 1) % 3, (n + 2) % 3);
        for side in 0..2 {
            // Round the face: edge i runs from corner i to corner i + 1.
            let corners = [0, 1 << b, 1 << b | 1 << c, 1 << c].map(|k| k | side << n);
            let edges = [slot(b, 0, side), slot(c, side, 1), slot(b, 1, side), slot(c, side, 0)];
            let crossed: Vec<usize> =
                edges.into_iter().filter(|&e| sheets[e] != u32::MAX).collect();
            match crossed[..] {
                [e, f] => join(&mut sheets, e, f),
                [_, _, _, _] => (0..4)
                    .filter(|&i| inside[corners[i]])
                    .for_each(|i| join(&mut sheets, edges[(i + 3) % 4], edges[i])),
                _ => {}
            }
        }
    }
    sheets
}

/// Makes one sheet of those that cross the edges `e` and `f`.
fn join(sheets: &mut [u32; 12], e: usize, f: usize) {
    let (kept, gone) = (sheets[e].min(sheets[f]), sheets[e].max(sheets[f]));
    *sheets = sheets.map(|s| if s == gone { kept } else { s });
}

/// The mean of the points where the surface crosses those edges of a cell, in cells from its least
/// corner.
fn mean_crossing(values: &[f32; 8], is_of_sheet: impl Fn(usize) -> bool) -> Vec3 {
    let mut sum = Vec3::ZERO;
    let mut crossings = 0.0;
    for slot in (0..12).filter(|&slot| is_of_sheet(slot)) {
        let [a, b] = slot_corners(slot);
        let [pa, pb] = [a, b].map(|k| Vec3::from_array(corner(k).map(|i| i as f32)));
        sum += pa.lerp(pb, values[a] / (values[a] - values[b]));
        crossings += 1.0;
    }
    sum / crossings
}

/// Splits a quadrilateral along its shorter diagonal.
fn push_quad(mesh: &mut Mesh, [a, b, c, d]: [u32; 4]) {
    let diagonal =
        |i: u32, j: u32| mesh.positions[i as usize].distance_squared(mesh.positions[j as usize]);
    let halves = if diagonal(a, c) <= diagonal(b, d) {
        [[a, b, c], [a, c, d]]
    } else {
        [[a, b, d], [b, c, d]]
    };
    mesh.triangles.extend(halves);
}

/// Moves `p` onto the surface by one Newton step, at most half a cell long, and returns the normal there.
fn project(field: &impl Fn(Vec3) -> f32, p: &mut Vec3, cell: f32) -> Vec3 {
    let (value, slope) = value_and_gradient(field, *p, cell);
    *p -= (value / slope.length_squared().max(1e-6) * slope).clamp_length_max(0.5 * cell);
    value_and_gradient(field, *p, cell).1.normalize_or(Vec3::Y)
}

/// The field and its gradient from four samples at the corners of a tetrahedron round `p`.
fn value_and_gradient(field: &impl Fn(Vec3) -> f32, p: Vec3, cell: f32) -> (f32, Vec3) {
    let h = 0.2 * cell;
    let corners = [vec3(1.0, -1.0, -1.0), vec3(-1.0, -1.0, 1.0), vec3(-1.0, 1.0, -1.0), Vec3::ONE];
    let mut value = 0.0;
    let mut slope = Vec3::ZERO;
    for k in corners {
        let sample = field(p + h * k);
        value += 0.25 * sample;
        slope += sample / (4.0 * h) * k;
    }
    (value, slope)
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
