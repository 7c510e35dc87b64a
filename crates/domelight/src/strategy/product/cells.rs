//! Light cells: the map divided into a few hundred squares along a space-filling curve.
//!
//! A cell is a node of the environment's pyramid of weights, or a part of a texel, which is constant.
//! Cells are ordered along a Hilbert curve, so that a running sum over them is a one-dimensional
//! distribution whose strata are compact regions of the sky. A choice spread evenly over the running sum
//! is then spread evenly over the sky.
//!
//! Cells are split in order of the variance of their light: first the cell with the largest
//!
//! ```text
//! (W − |R|²/W)/W₀ + 0.02 (W/W₀) s + 10⁻⁴ a s        + 10³ s if s > 0.08
//! ```
//!
//! where W = ∫ L dω and R = ∫ L ω dω over the cell, W₀ is W of the whole map, a is its solid angle
//! and s = 1 − |∫ ω dω|/a, half the square of its angular radius. The first term is the variance of
//! directions of Viriyothai & Debevec 2009 on the sphere; the others keep dim cells small enough for
//! a cosine and a lobe to be evaluated at their centers.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::f64::consts::{PI, TAU};
use std::ops::{Deref, DerefMut, Range};

use crate::Rgb;
use crate::environment::Environment;
use crate::math::{Vec3, functions};
use crate::sampling::hilbert::HilbertState;
use crate::simd::{LANES, Lanes, Simd, SimdF32x16};

/// The maximum number of cells per lane, which has an eighth of the curve.
pub(super) const MAX_ROWS: usize = 48;

/// The number of rows of a table: a power of two, so that a masked index needs no other check.
pub(super) const TABLE_ROWS: usize = MAX_ROWS.next_power_of_two();
/// The number of slots in a table. Slots in rows that the cells do not fill are unused.
pub(super) const N_SLOTS: usize = TABLE_ROWS * LANES;

/// One number per cell, at [`Cells::slot`], by row.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub(super) struct CellArray([Lanes; TABLE_ROWS]);

impl CellArray {
    /// A pair of rows.
    #[inline(always)]
    pub(super) fn pair<S: Simd>(&self, simd: S, pair: usize) -> S::F32x16 {
        simd.load_f32x16([&self.0[2 * pair], &self.0[2 * pair + 1]])
    }

    #[inline(always)]
    pub(super) fn set_pair(&mut self, pair: usize, numbers: impl SimdF32x16) {
        [self.0[2 * pair], self.0[2 * pair + 1]] = numbers.store();
    }
}

impl Default for CellArray {
    fn default() -> Self {
        ZERO_CELLS
    }
}

impl Deref for CellArray {
    type Target = [Lanes; TABLE_ROWS];

    #[inline(always)]
    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl DerefMut for CellArray {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.0
    }
}

/// Zero for every cell.
pub(super) const ZERO_CELLS: CellArray = CellArray([[0.0; LANES]; TABLE_ROWS]);

/// The number in a slot.
#[inline(always)]
pub(super) fn get(slots: &CellArray, slot: usize) -> f32 {
    slots[slot / LANES % TABLE_ROWS][slot % LANES]
}

/// A mutable reference to the number in a slot.
#[inline(always)]
pub(super) fn get_mut(slots: &mut CellArray, slot: usize) -> &mut f32 {
    &mut slots[slot / LANES % TABLE_ROWS][slot % LANES]
}

/// The number of search steps replaced by a look-up.
const KNOWN_DEPTH: u32 = 6;

/// Texels are divided into squares of at least 2⁻⁸ of their side.
const FINEST: i32 = -8;

/// A square of the map.
#[derive(Clone, Copy, Debug)]
struct Square {
    /// The side is 2^`size` texels.
    size: i32,
    /// The position in units of such squares.
    column: u32,
    row: u32,
    state: HilbertState,
    /// ∫ luminance dω.
    mass: f32,
}

impl Square {
    /// The quarter that the curve visits as number `i` of four, which has the given mass.
    fn quarter(&self, i: usize, mass: f32) -> Self {
        let (x, y, state) = self.state.quadrant(i);
        Self {
            size: self.size - 1,
            column: 2 * self.column + x as u32,
            row: 2 * self.row + y as u32,
            state,
            mass,
        }
    }
}

/// The target of a link in the tree.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Link {
    /// No light.
    Dark,
    Cell(u16),
    Split(u16),
}

/// The cells of an environment.
#[derive(Clone, Debug)]
pub(super) struct Cells {
    /// The number of rows per lane.
    rows: usize,
    /// The cells, along the curve.
    squares: Vec<Square>,
    /// The four quarters of each split square, by row; the first square is the whole map.
    links: Vec<[Link; 4]>,
    /// The number of levels from the map to its texels.
    depth: u32,
    /// The target after the first [`KNOWN_DEPTH`] steps, for each square at that depth, by row.
    known: Vec<Link>,
    /// The mean direction of the light, a unit vector in world space.
    pub(super) center: [Box<CellArray>; 3],
    /// The angular radius.
    pub(super) radius: Box<CellArray>,
    /// The ramps for each normal spread in [`NORMAL_SPREADS`].
    ramps: [Ramp; NORMAL_SPREADS.len()],
    /// No direction of the cell is farther from its center than this \[rad\].
    pub(super) bounding_angle: Box<CellArray>,
    /// ∫ luminance dω; 0 if there is no cell.
    pub(super) mass: Box<CellArray>,
    /// The solid angle divided by the mass.
    pub(super) inverse_radiance: Box<CellArray>,
    /// ∫ luminance dω/∫ luminance² dω, estimated from a few directions. At most [`Cells::inverse_radiance`].
    pub(super) inverse_brightness: Box<CellArray>,
}

/// The soft step of the cosine over a cell, from its angular radius r and the spread of normals.
#[derive(Clone, Debug)]
pub(super) struct Ramp {
    /// s = √(r² + spread²).
    pub(super) s: Box<CellArray>,
    /// 1/4s.
    pub(super) scale: Box<CellArray>,
}

/// The normal spreads for which ramps are tabulated \[rad\].
const NORMAL_SPREADS: [f32; 7] = [0.02, 0.04, 0.08, 0.16, 0.32, 0.64, 1.28];

impl Cells {
    /// Divides an environment into as many cells as fit in each of the given numbers of rows, which are even and at
    /// most [`MAX_ROWS`]. Empty for a black environment.
    pub(super) fn new<const N: usize>(
        environment: &Environment,
        rows: [usize; N],
    ) -> Option<[Self; N]> {
        let map = Map { environment };
        let root = map.root()?;
        let most = rows.into_iter().max().unwrap_or(0) * LANES;
        let tree = Tree::grow(&map, root, most);
        Some(rows.map(|rows| Self::of(&map, &tree, rows)))
    }

    /// The leaves of the first splits of a tree.
    fn of(map: &Map, tree: &Tree, rows: usize) -> Self {
        let zeros = || Box::new(ZERO_CELLS);
        let mut cells = Self {
            rows,
            squares: Vec::new(),
            links: vec![[Link::Dark; 4]; tree.n_splits(rows * LANES)],
            depth: tree.nodes[0].square.size as u32,
            known: Vec::new(),
            center: [zeros(), zeros(), zeros()],
            radius: zeros(),
            ramps: NORMAL_SPREADS.map(|_| Ramp { s: zeros(), scale: zeros() }),
            bounding_angle: zeros(),
            mass: zeros(),
            inverse_radiance: zeros(),
            inverse_brightness: zeros(),
        };
        cells.number(tree, 0, &tree.nodes[0]);
        cells.known = cells.first_steps();
        for cell in 0..cells.squares.len() {
            let square = cells.squares[cell];
            let (center, radius, bounding_angle) = map.extent(&square);
            let slot = cells.slot(cell);
            for (c, x) in cells.center.iter_mut().zip(center.to_array()) {
                *get_mut(c, slot) = x;
            }
            *get_mut(&mut cells.radius, slot) = radius;
            for (spread, ramp) in NORMAL_SPREADS.iter().zip(&mut cells.ramps) {
                let s = functions::hypot(radius, *spread);
                *get_mut(&mut ramp.s, slot) = s;
                *get_mut(&mut ramp.scale, slot) = 0.25 / s;
            }
            *get_mut(&mut cells.bounding_angle, slot) = bounding_angle;
            *get_mut(&mut cells.mass, slot) = square.mass;
            *get_mut(&mut cells.inverse_radiance, slot) =
                (map.area(&square).0 / f64::from(square.mass)) as f32;
            *get_mut(&mut cells.inverse_brightness, slot) =
                (1.0 / cells.brightness(map.environment, cell)) as f32;
        }
        cells
    }

    /// ∫ luminance² dω/∫ luminance dω over a cell: the mean luminance of directions that are drawn in it.
    fn brightness(&self, environment: &Environment, cell: usize) -> f64 {
        const N: u32 = 16;
        let luminance = |i: u32| {
            let u = (f64::from(i) + 0.5) / f64::from(N);
            f64::from(self.draw(environment, cell, u, [0.5; 2]).1.luminance())
        };
        (0..N).map(luminance).sum::<f64>() / f64::from(N)
    }

    /// Numbers the leaves below split `split` along the curve.
    fn number(&mut self, tree: &Tree, split: usize, node: &Node) {
        let children = tree.links[split];
        for i in 0..4 {
            let (x, y, _) = node.square.state.quadrant(i);
            let Some(child) = children[2 * y + x] else { continue };
            let child = &tree.nodes[child];
            let split_below = child.split.filter(|&below| below < self.links.len());
            self.links[split][2 * y + x] = if let Some(below) = split_below {
                self.number(tree, below, child);
                Link::Split(below as u16)
            } else {
                self.squares.push(child.square);
                Link::Cell(self.squares.len() as u16 - 1)
            };
        }
    }

    fn known_depth(&self) -> u32 {
        self.depth.min(KNOWN_DEPTH)
    }

    /// [`Cells::known`].
    fn first_steps(&self) -> Vec<Link> {
        let depth = self.known_depth();
        let step = |link, (x, y)| match link {
            Link::Split(below) => self.links[usize::from(below)][2 * y + x],
            end => end,
        };
        let walk = |square: usize| {
            let (column, row) = (square & ((1 << depth) - 1), square >> depth);
            let quarters = (0..depth).rev().map(|bit| (column >> bit & 1, row >> bit & 1));
            quarters.fold(Link::Split(0), step)
        };
        (0..1 << (2 * depth)).map(walk).collect()
    }

    /// The ramps for normals with a spread of `spread`, or slightly more.
    pub(super) fn ramp(&self, spread: f32) -> &Ramp {
        let above = NORMAL_SPREADS.partition_point(|&s| s < spread);
        &self.ramps[above.min(NORMAL_SPREADS.len() - 1)]
    }

    /// The rows of a table that the cells fill.
    #[inline(always)]
    pub(super) fn rows(&self) -> Range<usize> {
        0..self.rows.min(MAX_ROWS)
    }

    /// The number of slots in these rows.
    pub(super) fn n_slots(&self) -> usize {
        self.rows * LANES
    }

    /// The same rows in pairs, where all lanes are alike.
    #[inline(always)]
    pub(super) fn pairs(&self) -> Range<usize> {
        0..self.rows.min(MAX_ROWS) / 2
    }

    /// The slot of a cell, row by row. Lane l has the l-th eighth of the curve, so that one running sum per lane and
    /// one over the lanes give the sum along the curve.
    pub(super) fn slot(&self, cell: usize) -> usize {
        cell % self.rows * LANES + cell / self.rows
    }

    /// The cell of a slot; `None` for unused rows and beyond the last cell.
    pub(super) fn cell_in(&self, slot: usize) -> Option<usize> {
        let (row, lane) = (slot / LANES, slot % LANES);
        let cell = lane * self.rows + row;
        (row < self.rows && cell < self.len()).then_some(cell)
    }

    /// The number of cells.
    pub(super) fn len(&self) -> usize {
        self.squares.len()
    }

    /// ∫ luminance dω over a cell.
    pub(super) fn mass_of(&self, cell: usize) -> f32 {
        get(&self.mass, self.slot(cell))
    }

    /// The cell in direction `wi`, which is in this texel (column and row); `None` if there is no light.
    #[inline]
    pub(super) fn at_texel(
        &self,
        environment: &Environment,
        [column, row]: [usize; 2],
        wi: Vec3,
    ) -> Option<usize> {
        let mut bit = self.depth - self.known_depth();
        let mut link = self.known[(row >> bit) << self.known_depth() | column >> bit];
        let mut inside = None;
        loop {
            let below = match link {
                Link::Dark => return None,
                Link::Cell(cell) => return Some(usize::from(cell)),
                Link::Split(below) => usize::from(below),
            };
            let (x, y) = if bit > 0 {
                bit -= 1;
                (column >> bit & 1, row >> bit & 1)
            } else {
                let at = 2.0 * inside.unwrap_or_else(|| environment.inside(wi));
                inside = Some(at.fract());
                (at.x as usize, at.y as usize)
            };
            link = self.links[below][2 * y + x];
        }
    }

    /// The cell in direction `wi`, and its radiance.
    #[cfg(test)]
    pub(super) fn find(&self, environment: &Environment, wi: Vec3) -> Option<(usize, Rgb)> {
        let texel = environment.texel_at(wi);
        let le = environment.map().get(texel[0], texel[1]);
        Some((self.at_texel(environment, texel, wi)?, le))
    }

    /// Samples a direction in a cell in proportion to luminance. Neighboring `u` in [0, 1) give
    /// neighbors along the curve. `jitter` in [0, 1)² positions it below the resolution of `u`.
    ///
    /// The density within the cell is the luminance of the radiance divided by the cell's mass \[sr⁻¹\].
    pub(super) fn draw(
        &self,
        environment: &Environment,
        cell: usize,
        mut u: f64,
        jitter: [f32; 2],
    ) -> (Vec3, Rgb) {
        /// The number of levels below the cell to which the curve is followed, unless it reaches single texels first.
        const BELOW: i32 = 3;
        let map = Map { environment };
        let mut square = self.squares[cell];
        let last = (square.size - BELOW).min(0);
        while square.size > last {
            let masses = map.masses(&square);
            let [a, b, c, d] = masses.map(f64::from);
            let (b, c, d) = (a + b, a + b + c, a + b + c + d);
            let at = u * d;
            // Avoid branches, because they are mispredicted.
            let mut i = usize::from(at >= a) + usize::from(at >= b) + usize::from(at >= c);
            // Rounding may lead past the last quarter with mass.
            while masses[i] <= 0.0 && i > 0 {
                i -= 1;
            }
            let mass = masses[i];
            u = ((at - [0.0, a, b, c][i]) / f64::from(mass)).clamp(0.0, 1.0 - f64::EPSILON);
            square = square.quarter(i, mass);
        }
        let side = functions::exp2(f64::from(square.size));
        let column = (f64::from(square.column) + f64::from(jitter[0])) * side;
        let row = (f64::from(square.row) + f64::from(jitter[1])) * side;
        let wi = environment.orientation().up.to_world(environment.map_direction(column, row));
        (wi, environment.map().get(column as usize, row as usize))
    }
}

/// The squares of a map.
struct Map<'a> {
    environment: &'a Environment,
}

impl Map<'_> {
    /// The whole map; `None` if it is black.
    fn root(&self) -> Option<Square> {
        let table = self.environment.table()?;
        // A 2:1 map is visited from its left to its right half.
        let state = HilbertState::SWAPPED;
        let (size, mass) = (table.depth() as i32, table.total() as f32);
        Some(Square { size, column: 0, row: 0, state, mass })
    }

    /// The quarters of a square, along the curve.
    fn quarters(&self, square: &Square) -> [Square; 4] {
        let masses = self.masses(square);
        std::array::from_fn(|i| square.quarter(i, masses[i]))
    }

    /// The masses of the quarters.
    fn masses(&self, &Square { size, column, row, state, mass }: &Square) -> [f32; 4] {
        let masses = match self.environment.table() {
            Some(table) if size > 0 => table.quarters(size as usize, column as usize, row as usize),
            _ => [0.25 * mass; 4],
        };
        std::array::from_fn(|i| {
            let (x, y, _) = state.quadrant(i);
            masses[2 * y + x]
        })
    }

    /// The rectangle of a square on the map, in texels: columns and rows, start and end.
    fn rectangle(&self, square: &Square) -> [[f64; 2]; 2] {
        let side = functions::exp2(f64::from(square.size));
        let span =
            |i: u32, n: usize| [f64::from(i) * side, (f64::from(i + 1) * side).min(n as f64)];
        let map = self.environment.map();
        [span(square.column, map.width), span(square.row, map.height)]
    }

    /// The mean direction of a square's light in the map's frame, times its mass.
    fn moment(&self, square: &Square, depth: u32) -> Vec3 {
        if square.mass == 0.0 {
            return Vec3::ZERO;
        }
        if depth == 0 {
            let [[x0, x1], [y0, y1]] = self.rectangle(square);
            return self.environment.map_direction(0.5 * (x0 + x1), 0.5 * (y0 + y1)) * square.mass;
        }
        self.quarters(square).iter().map(|q| self.moment(q, depth - 1)).sum()
    }

    /// The solid angle a of a square, and 1 − |∫ ω dω|/a.
    fn area(&self, square: &Square) -> (f64, f64) {
        let [columns, rows] = self.rectangle(square);
        let width = (columns[1] - columns[0]) * TAU / self.environment.map().width as f64;
        let cos = rows.map(|row| self.environment.cos_theta(row).clamp(-1.0, 1.0));
        let area = width * (cos[0] - cos[1]);
        // ∫ sin² θ dθ and ∫ sin θ cos θ dθ
        let across = |c: f64| 0.5 * (functions::acos(c) - c * (1.0 - c * c).sqrt());
        let along = |c: f64| -0.5 * c * c;
        let horizontal = (across(cos[1]) - across(cos[0])) * 2.0 * functions::sin(0.5 * width);
        let vertical = (along(cos[1]) - along(cos[0])) * width;
        (area, 1.0 - (functions::hypot(horizontal, vertical) / area).min(1.0))
    }

    fn priority(&self, square: &Square) -> f64 {
        let mass = f64::from(square.mass);
        let moment = f64::from(self.moment(square, 3).length());
        let (area, spread) = self.area(square);
        let total = self.environment.power();
        let scatter = (mass - moment * moment / mass).max(0.0) / total;
        let wide = if spread > 0.08 { 1e3 * spread } else { 0.0 };
        scatter + (0.02 * mass / total + 1e-4 * area) * spread + wide
    }

    /// Center, angular radius and bounding angle of a cell.
    fn extent(&self, square: &Square) -> (Vec3, f32, f32) {
        let moment = self.moment(square, 3);
        let [[x0, x1], [y0, y1]] = self.rectangle(square);
        let middle = self.environment.map_direction(0.5 * (x0 + x1), 0.5 * (y0 + y1));
        let center = moment.try_normalize().unwrap_or(middle);
        let bounding_angle = self.farthest(square, center);
        // The light's variance along one axis, and half the side of a square with this variance.
        let variance = 0.5 * (1.0 - functions::powi((moment.length() / square.mass).min(1.0), 2));
        let radius = (3.0 * variance).sqrt().max(0.5 * bounding_angle);
        let up = self.environment.orientation().up;
        // Directions are in single precision.
        (up.to_world(center), radius, 1.001 * bounding_angle + 1e-4)
    }

    /// The angle from `center` to the farthest point of a square.
    ///
    /// Along a parallel, it is at the column farthest from the center's. Along that meridian, the cosine is
    /// A sin θ + B cos θ, which is smallest at an end or at its only minimum.
    fn farthest(&self, square: &Square, center: Vec3) -> f32 {
        let [columns, rows] = self.rectangle(square);
        let azimuth = |v: Vec3| functions::atan2(f64::from(v.x), f64::from(-v.z));
        let edge = self.environment.map_direction(columns[0], 0.5 * (rows[0] + rows[1]));
        let first = wrapped(azimuth(edge) - azimuth(center));
        let last = first + (columns[1] - columns[0]) * TAU / self.environment.map().width as f64;
        let away = if last >= PI { PI } else { first.abs().max(last.abs()) };

        let a = f64::from(functions::hypot(center.x, center.z)) * functions::cos(away);
        let b = f64::from(center.y);
        let thetas =
            rows.map(|row| functions::acos(self.environment.cos_theta(row).clamp(-1.0, 1.0)));
        let cosine = |theta: f64| a * functions::sin(theta) + b * functions::cos(theta);
        let lowest = functions::atan2(a, b) + PI;
        let inside = thetas[0] < lowest && lowest < thetas[1];
        let least = cosine(thetas[0]).min(cosine(thetas[1]));
        let least = if inside { -functions::hypot(a, b) } else { least };
        functions::acos(least.clamp(-1.0, 1.0)) as f32
    }
}

/// Wraps an angle to [−π, π].
fn wrapped(angle: f64) -> f64 {
    angle - (angle / TAU).round() * TAU
}

/// The squares during splitting.
struct Tree {
    nodes: Vec<Node>,
    /// The children of each split square, by row; children without light are left out.
    links: Vec<[Option<usize>; 4]>,
}

struct Node {
    square: Square,
    split: Option<usize>,
}

impl Tree {
    /// Splits until there are at most `most` leaves.
    fn grow(map: &Map, root: Square, most: usize) -> Self {
        let nodes = vec![Node { square: root, split: None }];
        let mut tree = Self { nodes, links: Vec::new() };
        let mut queue = BinaryHeap::from([Next { priority: f64::INFINITY, node: 0 }]);
        let mut n_cells = 1;
        while may_split(n_cells, most) {
            let Some(next) = queue.pop() else { break };
            let square = tree.nodes[next.node].square;
            tree.nodes[next.node].split = Some(tree.links.len());
            let mut children = [None; 4];
            for quarter in map.quarters(&square).into_iter().filter(|q| q.mass > 0.0) {
                let node = tree.nodes.len();
                children[(quarter.row % 2 * 2 + quarter.column % 2) as usize] = Some(node);
                tree.nodes.push(Node { square: quarter, split: None });
                if quarter.size > FINEST {
                    queue.push(Next { priority: map.priority(&quarter), node });
                }
                n_cells += 1;
            }
            n_cells -= 1;
            tree.links.push(children);
        }
        tree
    }

    /// The number of splits made while there were at most `most` leaves.
    fn n_splits(&self, most: usize) -> usize {
        let mut n_cells = 1;
        let made = self.links.iter().take_while(|children| {
            let may = may_split(n_cells, most);
            n_cells += children.iter().flatten().count() - 1;
            may
        });
        made.count()
    }
}

/// Whether splitting one of this many cells into four stays within the limit.
fn may_split(n_cells: usize, most: usize) -> bool {
    n_cells + 3 <= most
}

/// A square waiting to be split; ties go to the earlier node.
struct Next {
    priority: f64,
    node: usize,
}

impl Ord for Next {
    fn cmp(&self, other: &Self) -> Ordering {
        self.priority.total_cmp(&other.priority).then(other.node.cmp(&self.node))
    }
}

impl PartialOrd for Next {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Next {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Next {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RgbImage;
    use crate::environment::builtin::BuiltinProbe;
    use crate::environment::{Orientation, UpAxis};
    use crate::sampling::Pcg32;

    fn environments() -> Vec<(&'static str, Environment)> {
        let orientation = Orientation { up: UpAxis::Z, rotation: 77.0 };
        let make = |map| Environment::new(map, orientation, 1.0).unwrap();
        let mut pcg = Pcg32::new(1, 2);
        let noise =
            RgbImage::from_fn(37, 13, |_, _| Rgb::splat((9.0 * pcg.next_f32()).exp() - 1.0));
        let mut lit = RgbImage::filled(100, 50, Rgb::BLACK);
        lit.pixels[1234] = Rgb::WHITE;
        vec![
            ("constant", Environment::constant(Rgb::WHITE).unwrap()),
            ("sky", make(BuiltinProbe::Sky.image(64))),
            ("noise", make(noise)),
            ("one lit texel", make(lit)),
        ]
    }

    #[test]
    fn black_has_no_cells() {
        assert!(Cells::new(&Environment::constant(Rgb::BLACK).unwrap(), [MAX_ROWS]).is_none());
    }

    /// The masses add up to the whole, and each equals the light found in its cell.
    #[test]
    fn cells_partition_the_light() {
        let of_rows = |rows| environments().into_iter().map(move |(name, env)| (name, env, rows));
        for (name, environment, rows) in of_rows(32).chain(of_rows(MAX_ROWS)) {
            let [cells] = Cells::new(&environment, [rows]).unwrap();
            // Cells built together with finer ones are the same.
            let [together, _] = Cells::new(&environment, [rows, MAX_ROWS]).unwrap();
            assert_eq!((&together.mass, &together.known), (&cells.mass, &cells.known), "{name}");
            assert!((100..=rows * LANES).contains(&cells.len()), "{name}: {}", cells.len());
            for cell in 0..cells.len() {
                assert_eq!(cells.cell_in(cells.slot(cell)), Some(cell));
            }
            let slots = (0..N_SLOTS).filter(|&slot| cells.cell_in(slot).is_some());
            assert_eq!(slots.count(), cells.len());
            let total: f64 = cells.mass.iter().flatten().map(|&m| f64::from(m)).sum();
            assert!((total / environment.power() - 1.0).abs() < 1e-5, "{name}");

            // Sum over a grid of equal steps in φ and cos θ that is finer than any cell.
            let map = environment.map();
            let finest = cells.squares.iter().map(|s| s.size).min().unwrap();
            let n = 2 << (-finest).max(0);
            let mut found = vec![0.0; cells.len()];
            for (i, texel) in map.pixels.iter().enumerate().filter(|(_, t)| !t.is_black()) {
                let (row, column) = (i / map.width, i % map.width);
                let solid_angle = environment.texel_solid_angle(row) / f64::from(n * n);
                for (x, y) in (0..n).flat_map(|x| (0..n).map(move |y| (x, y))) {
                    let at = |i: usize, x: i32| i as f64 + (f64::from(x) + 0.5) / f64::from(n);
                    let wi = environment.map_direction(at(column, x), at(row, y));
                    let wi = environment.orientation().up.to_world(wi);
                    let (cell, le) = cells.find(&environment, wi).unwrap();
                    assert_eq!(le, *texel, "{name}");
                    found[cell] += f64::from(le.luminance()) * solid_angle;
                    // No direction is farther from the center than the bounding angle.
                    let center =
                        Vec3::from(cells.center.each_ref().map(|c| get(c, cells.slot(cell))));
                    let bounding_angle = get(&cells.bounding_angle, cells.slot(cell));
                    assert!(center.angle_between(wi) <= bounding_angle, "{name} {cell}");
                }
            }
            for (cell, found) in found.into_iter().enumerate() {
                let mass = f64::from(cells.mass_of(cell));
                assert!((found / mass - 1.0).abs() < 1e-4, "{name} {cell}: {found} {mass}");
            }
        }
    }

    /// Samples are in their cell, follow the light, and keep the order of the random numbers.
    #[test]
    fn directions_are_drawn_by_luminance_along_the_curve() {
        let mut pcg = Pcg32::new(5, 6);
        for (name, environment) in environments() {
            let [cells] = Cells::new(&environment, [MAX_ROWS]).unwrap();
            for cell in (0..cells.len()).step_by(17) {
                let n = 256;
                let mut steps = 0.0;
                let mut last: Option<Vec3> = None;
                for i in 0..n {
                    let u = (f64::from(i) + f64::from(pcg.next_f32())) / f64::from(n);
                    let jitter = [pcg.next_f32(), pcg.next_f32()];
                    let (wi, le) = cells.draw(&environment, cell, u, jitter);
                    assert!(le.luminance() > 0.0);
                    // A direction moved across an edge by rounding is in the cell slightly farther inside.
                    let map = Map { environment: &environment };
                    let [[x0, x1], [y0, y1]] = map.rectangle(&cells.squares[cell]);
                    let middle = environment.map_direction(0.5 * (x0 + x1), 0.5 * (y0 + y1));
                    let middle = environment.orientation().up.to_world(middle);
                    let is_here = |wi| cells.find(&environment, wi) == Some((cell, le));
                    let inward = wi.lerp(middle, 1e-3).normalize();
                    assert!(is_here(wi) || is_here(inward), "{name} {cell}");
                    steps += last.map_or(0.0, |l| l.angle_between(wi));
                    last = Some(wi);
                }
                // A curve through n points of a square is some √n sides long.
                let bounding_angle = get(&cells.bounding_angle, cells.slot(cell));
                assert!(
                    steps < 6.0 * f32::sqrt(n as f32) * bounding_angle,
                    "{name} {cell}: {steps} {bounding_angle}"
                );
            }
        }
    }
}
