//! The exact overlap on the sphere between texels of a lat-long map and texels of any mapping.
//!
//! In the plane of longitude and height (φ, y = cos θ), areas equal solid angles (Archimedes), and the texels of a
//! lat-long map are rectangles. A texel of another mapping becomes a polygon in that plane, with its edges refined
//! until parabolas suffice. The polygon's area within each rectangle is summed edge by edge, as in font rasterizers.
//! Neighboring texels share their edges, so the whole sphere is covered exactly once.
//!
//! Everything is in double precision: at 4096 rows, a single-precision coordinate is off by 10⁻⁴ of a texel.

use super::fisheye::Fisheye;
use super::{CubeLayout, Mapping};
use crate::environment::LatLongGrid;
use crate::math::{Mat3, functions};
use std::f64::consts::{FRAC_PI_4, PI, TAU};

type Point = [f64; 2];
type Direction = [f64; 3];

/// A lat-long texel and the solid angle \[sr\] that is shared with it.
pub(super) type Share = (usize, f64);

/// How a lat-long map stands in the picture that it is converted to.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct MapFrame {
    /// The fraction of a full turn by which the map is rotated about the up axis, counterclockwise as seen from above.
    pub(crate) turn: f64,
    /// The directions in the map without its turn that the picture shows at +X, +Y and +Z, which may only permute and mirror the
    /// axes; not of a lat-long picture.
    pub(crate) axes: Option<Mat3>,
}

/// One texel at a time against a [`LatLongGrid`]; keeps its memory.
pub(super) struct Overlap<'a> {
    grid: &'a LatLongGrid,
    mapping: Mapping,
    /// The view of a fisheye picture, which is none of the mappings.
    fisheye: Option<Fisheye>,
    /// The size of the picture whose texels are laid over the grid.
    width: usize,
    height: usize,
    /// How many columns the grid is turned counterclockwise, as seen from above.
    turn: f64,
    /// The directions that the picture shows at +X, +Y and +Z, if they are others.
    axes: Option<[Direction; 3]>,
    /// The texel's outline in columns (unwrapped) and cos θ.
    outline: Vec<Point>,
    /// The signed area in each rectangle within the outline's bounds.
    areas: Vec<f64>,
    /// The shares of the texel that was asked for last.
    pub(super) shares: Vec<Share>,
}

/// A point of an outline.
#[derive(Clone, Copy)]
struct Vertex {
    direction: Direction,
    /// sin θ.
    across: f64,
    /// None at a pole.
    longitude: Option<f64>,
}

impl Vertex {
    fn new(direction: Direction) -> Self {
        let [x, _, z] = direction;
        let across = functions::hypot(x, z);
        // As in `lat_long_uv`, from 0 at the map's left border.
        let longitude = (across >= POLE).then(|| functions::atan2(x, -z) + PI);
        Self { direction, across, longitude }
    }
}

impl<'a> Overlap<'a> {
    pub(super) fn new(
        grid: &'a LatLongGrid,
        mapping: Mapping,
        width: usize,
        height: usize,
    ) -> Self {
        let (outline, areas, shares) = (Vec::new(), Vec::new(), Vec::new());
        let (fisheye, turn, axes) = (None, 0.0, None);
        Self { grid, mapping, fisheye, width, height, turn, axes, outline, areas, shares }
    }

    pub(super) fn of_fisheye(
        grid: &'a LatLongGrid,
        fisheye: Fisheye,
        width: usize,
        height: usize,
    ) -> Self {
        let angular = Self::new(grid, Mapping::Angular, width, height);
        Self { fisheye: Some(fisheye), ..angular }
    }

    /// The overlap with a map that is turned.
    pub(super) fn framed(self, frame: MapFrame) -> Self {
        let turn = frame.turn.rem_euclid(1.0) * self.grid.width() as f64;
        let axes = frame.axes.map(|axes| [0, 1, 2].map(|i| axes.col(i).as_dvec3().to_array()));
        Self { turn, axes, ..self }
    }

    /// The direction in the map at (u, v) of the picture.
    fn vertex(&self, chart: &Chart, uv: Point) -> Vertex {
        let d = chart.direction(uv);
        let Some(axes) = self.axes else { return Vertex::new(d) };
        Vertex::new(std::array::from_fn(|i| (0..3).map(|k| axes[k][i] * d[k]).sum()))
    }

    /// Fills [`Overlap::shares`] with those of texel (x, y).
    pub(super) fn texel(&mut self, x: usize, y: usize) {
        self.shares.clear();
        self.outline.clear();
        if self.width == 1 && self.height == 1 {
            let whole = |i: usize| (i, self.grid.solid_angle(i / self.grid.width()));
            self.shares.extend((0..self.grid.width() * self.grid.height()).map(whole));
            return;
        }
        match self.mapping {
            Mapping::LatLong => self.rectangle(x, y, 0.0),
            Mapping::LatLongExr => self.rectangle(x, y, 0.5),
            Mapping::Angular | Mapping::MirrorBall | Mapping::Cube(_) | Mapping::Octahedral => {
                let size = [self.width as f64, self.height as f64];
                let chart = match self.fisheye {
                    Some(fisheye) => Chart::of_fisheye(fisheye, size, x, y),
                    None => Chart::of(self.mapping, size, x, y),
                };
                let Some(chart) = chart else { return };
                self.trace(&chart, size, [x as f64, y as f64]);
                self.close();
            }
        }
        self.rasterize();
    }

    /// The outline of a texel of a lat-long map that is turned by so much of a turn.
    fn rectangle(&mut self, x: usize, y: usize, turn: f64) {
        let column = |x: usize| (x as f64 / self.width as f64 + turn) * self.grid.width() as f64;
        let line = |y: usize| functions::cos(PI * y as f64 / self.height as f64);
        let (left, right, top, bottom) = (column(x), column(x + 1), line(y), line(y + 1));
        self.outline.extend([[left, top], [right, top], [right, bottom], [left, bottom]]);
    }

    /// The outline, counterclockwise or clockwise, its longitudes continuous.
    fn trace(&mut self, chart: &Chart, size: [f64; 2], at: Point) {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
            .map(|c: Point| [(at[0] + c[0]) / size[0], (at[1] + c[1]) / size[1]]);
        let vertices = corners.map(|uv| self.vertex(chart, uv));
        for i in 0..4 {
            let j = (i + 1) % 4;
            self.push(vertices[i]);
            self.edge(chart, [corners[i], corners[j]], [vertices[i], vertices[j]], 0);
        }
        self.push(vertices[0]);
    }

    /// The points of an edge between its ends, so many that the areas beside it are right to some 10⁻⁷.
    ///
    /// The points depend on the edge's ends alone, so that both texels at an edge see the same.
    fn edge(&mut self, chart: &Chart, [from, to]: [Point; 2], [a, b]: [Vertex; 2], depth: u32) {
        const MOST: u32 = 14;
        /// Halvings of an edge that leaves the disc.
        const AT_RIM: u32 = 8;
        let middle = [0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])];
        let m = self.vertex(chart, middle);
        let least = if chart.leaves_disc(from, to) { AT_RIM } else { 0 };
        if depth >= least
            && let Some(m) = arc(&a, &m, &b)
        {
            self.push(m);
            return;
        }
        if depth >= MOST {
            self.push(m);
            return;
        }
        self.edge(chart, [from, middle], [a, m], depth + 1);
        self.push(m);
        self.edge(chart, [middle, to], [m, b], depth + 1);
    }

    /// Appends a point; one at a pole takes the longitudes of those before and after.
    fn push(&mut self, vertex: Vertex) {
        let height = vertex.direction[1].clamp(-1.0, 1.0);
        let Some(longitude) = vertex.longitude else {
            let last = self.outline.last().map_or(f64::NAN, |p| p[0]);
            self.outline.push([last, height.signum()]);
            return;
        };
        let turn = self.grid.width() as f64;
        let mut column = longitude * turn / TAU;
        if let Some(&[last, last_height]) = self.outline.last() {
            if last.is_nan() {
                // The outline began at the pole.
                self.outline.iter_mut().for_each(|p| p[0] = column);
            } else {
                column -= turn * ((column - last) / turn).round();
            }
            if last_height.abs() == 1.0 {
                self.outline.push([column, last_height]);
            }
        }
        self.outline.push([column, height]);
    }

    /// Leads an outline that goes round a pole over the pole.
    fn close(&mut self) {
        let (Some(&first), Some(&last)) = (self.outline.first(), self.outline.last()) else {
            return;
        };
        if (last[0] - first[0]).abs() > 0.5 * self.grid.width() as f64 {
            let mean: f64 = self.outline.iter().map(|p| p[1]).sum::<f64>();
            let pole = mean.signum();
            self.outline.extend([[last[0], pole], [first[0], pole]]);
        }
    }

    /// The outline's area in each rectangle: that between an edge and the grid's left border, summed with its sign.
    fn rasterize(&mut self) {
        if self.outline.iter().flatten().any(|c| !c.is_finite()) {
            return;
        }
        self.outline.iter_mut().for_each(|point| point[0] += self.turn);
        let fold = |f: fn(f64, f64) -> f64, i: usize| {
            self.outline.iter().map(|p| p[i]).reduce(f).unwrap_or(0.0)
        };
        let (left, right) = (fold(f64::min, 0).floor(), fold(f64::max, 0));
        let (top, bottom) = (self.grid.row(fold(f64::max, 1)), self.grid.row(fold(f64::min, 1)));
        let columns = (right - left) as usize + 1;
        self.areas.clear();
        self.areas.resize(columns * (bottom - top + 1), 0.0);
        let outline = std::mem::take(&mut self.outline);
        for i in 0..outline.len() {
            let ([x0, y0], [x1, y1]) = (outline[i], outline[(i + 1) % outline.len()]);
            self.line([x0 - left, y0], [x1 - left, y1], top, columns);
        }
        self.outline = outline;
        let (width, scale) = (self.grid.width(), TAU / self.grid.width() as f64);
        let sign = self.areas.iter().sum::<f64>().signum();
        let left = (left as i64).rem_euclid(width as i64) as usize;
        for (i, &area) in self.areas.iter().enumerate() {
            // Rounding leaves specks of either sign beside the outline.
            let share = area * sign * scale;
            if share > 1e-15 * scale {
                let (row, column) = (top + i / columns, (left + i % columns) % width);
                self.shares.push((row * width + column, share));
            }
        }
    }

    /// Adds the area between a line and the left border, row by row.
    fn line(&mut self, a: Point, b: Point, top: usize, columns: usize) {
        if a[1] == b[1] {
            return;
        }
        // From the upper end to the lower.
        let (upper, lower, sign) = if a[1] > b[1] { (a, b, 1.0) } else { (b, a, -1.0) };
        let slope = (lower[0] - upper[0]) / (lower[1] - upper[1]);
        let at = |y: f64| {
            let x = upper[0] + (y - upper[1]) * slope;
            x.clamp(upper[0].min(lower[0]), upper[0].max(lower[0]))
        };
        let first = self.grid.row_near(top, upper[1]);
        let last = self.grid.row_near(first, lower[1]);
        let mut from = upper;
        for row in first..=last {
            let to = match row {
                _ if row == last => lower,
                _ => [at(self.grid.cos_edge(row + 1)), self.grid.cos_edge(row + 1)],
            };
            let cells = &mut self.areas[(row - top) * columns..][..columns];
            add_trapezoids(cells, from, to, sign);
            from = to;
        }
    }
}

/// Adds the area to the left of a line within one row to its cells; `from` is above `to`.
fn add_trapezoids(cells: &mut [f64], from: Point, to: Point, sign: f64) {
    let height = sign * (from[1] - to[1]);
    if height == 0.0 {
        return;
    }
    let (left, right) = (from[0].min(to[0]), from[0].max(to[0]));
    let (first, last) = (left as usize, (right as usize).min(cells.len() - 1));
    for cell in &mut cells[..first] {
        *cell += height;
    }
    if first == last {
        cells[first] += height * (0.5 * (left + right) - first as f64);
        return;
    }
    // The line rises evenly over the columns that it crosses.
    let per_column = height / (right - left);
    let mut x = left;
    for column in first..=last {
        let end = right.min((column + 1) as f64);
        let part = (end - x) * per_column;
        cells[column] += part * (0.5 * (x + end) - column as f64);
        // What the line does further right, it does to the right of this whole cell.
        cells[column] += per_column * (right - end);
        x = end;
    }
}

/// sin θ below which a direction is a pole.
const POLE: f64 = 1e-13;

/// The middle of two straight lines from `a` to `b` on the plane with the area of the parabola through `m` (Simpson's
/// rule); none if the curve bends too much for that.
fn arc(a: &Vertex, m: &Vertex, b: &Vertex) -> Option<Vertex> {
    /// The largest area of the triangle (a, m, b) over the square of the line; the area missed is about 4 times its cube.
    const BEND: f64 = 2e-3;
    let (Some(_), Some(longitude), Some(_)) = (a.longitude, m.longitude, b.longitude) else {
        return is_meridian(&[a, m, b].map(|v| v.longitude)).then_some(*m);
    };
    let chord = |p: &Vertex, q: &Vertex| {
        let [x, y, z]: Direction = std::array::from_fn(|i| p.direction[i] - q.direction[i]);
        x * x + y * y + z * z
    };
    // The longitude from `m`; none if it is far.
    let from_m = |v: &Vertex| {
        let ([x, _, z], [mx, _, mz]) = (v.direction, m.direction);
        let scale = 1.0 / (v.across * m.across);
        let (sin, cos) = ((mx * z - mz * x) * scale, (x * mx + z * mz) * scale);
        let square = sin * sin;
        // The arc sine to its fifth order, which is right to 4e-9.
        (cos > 0.995).then(|| sin * (1.0 + square * (1.0 / 6.0 + square * 3.0 / 40.0)))
    };
    let (before, after) = (from_m(a)?, from_m(b)?);
    let (rise, fall) = (a.direction[1] - m.direction[1], b.direction[1] - m.direction[1]);
    let triangle = 0.5 * (before * fall - after * rise);
    if triangle.abs() > BEND * (chord(a, m) + chord(m, b)) {
        return None;
    }
    // A third further from the straight line's middle.
    let [x, y, z] = m.direction;
    let height = (y - (rise + fall) / 6.0).clamp(-1.0, 1.0);
    let longitude = longitude - (before + after) / 6.0;
    Some(Vertex { direction: [x, height, z], longitude: Some(longitude), ..*m })
}

/// Whether the longitudes that there are are one, or half a turn apart.
fn is_meridian(longitudes: &[Option<f64>]) -> bool {
    let mut known = longitudes.iter().flatten();
    let Some(first) = known.next() else { return true };
    known.all(|other| functions::sin(other - first).abs() < 1e-12)
}

/// The part of a mapping in which a texel lies, continuous up to and on the texel's outline: [`Mapping::direction`] in
/// double precision, but for the lat-long mappings.
enum Chart {
    Angular,
    MirrorBall,
    Octahedral,
    Fisheye(Fisheye),
    /// A face, and how many columns and rows of faces the picture has.
    Cube {
        forward: Direction,
        right: Direction,
        up: Direction,
        cell: Point,
        count: Point,
    },
}

impl Chart {
    /// The chart of texel (x, y); none where the picture shows nothing.
    fn of(mapping: Mapping, size: [f64; 2], x: usize, y: usize) -> Option<Self> {
        let center = [(x as f64 + 0.5) / size[0], (y as f64 + 0.5) / size[1]];
        Some(match mapping {
            // These are rectangles on the plane.
            Mapping::LatLong | Mapping::LatLongExr => return None,
            Mapping::Angular => Self::Angular,
            Mapping::MirrorBall => Self::MirrorBall,
            Mapping::Octahedral => Self::Octahedral,
            Mapping::Cube(layout) => Self::face(layout, center)?,
        })
    }

    /// The chart of texel (x, y); none if it is outside the disc.
    fn of_fisheye(fisheye: Fisheye, size: [f64; 2], x: usize, y: usize) -> Option<Self> {
        let nearest = |i: usize, size: f64| {
            let [low, high] = [i, i + 1].map(|i| 2.0 * i as f64 / size - 1.0);
            if low * high < 0.0 { 0.0 } else { low.abs().min(high.abs()) }
        };
        let distance = functions::hypot(nearest(x, size[0]), nearest(y, size[1]));
        (distance < 1.0).then_some(Self::Fisheye(fisheye))
    }

    fn face(layout: CubeLayout, [u, v]: Point) -> Option<Self> {
        let (columns, rows) = layout.faces_across_and_down();
        let count = [columns as f64, rows as f64];
        let cell = [(u * count[0]).floor(), (v * count[1]).floor()];
        let face = layout.face_at(cell[0] as usize, cell[1] as usize)?;
        let [forward, right, up] =
            [face.forward, face.right, face.up].map(|axis| axis.as_dvec3().to_array());
        Some(Self::Cube { forward, right, up, cell, count })
    }

    /// Whether a line begins inside the disc and ends outside.
    fn leaves_disc(&self, from: Point, to: Point) -> bool {
        let is_inside = |[u, v]: Point| functions::hypot(2.0 * u - 1.0, 2.0 * v - 1.0) < 1.0;
        matches!(self, Self::Angular | Self::MirrorBall | Self::Fisheye(_))
            && is_inside(from) != is_inside(to)
    }

    /// The unit direction at (u, v); outside a disc that of the disc's border.
    fn direction(&self, [u, v]: Point) -> Direction {
        let disc = [2.0 * u - 1.0, 1.0 - 2.0 * v];
        match self {
            Self::Angular => around_forward(disc, |r| functions::sin_cos(PI * r)),
            Self::MirrorBall => around_forward([-disc[0], disc[1]], |r| {
                // θ = 2 asin r.
                (2.0 * r * (1.0 - r * r).max(0.0).sqrt(), 1.0 - 2.0 * r * r)
            }),
            Self::Octahedral => octahedral([2.0 * u - 1.0, 2.0 * v - 1.0]),
            Self::Fisheye(fisheye) => fisheye.direction(disc),
            Self::Cube { forward, right, up, cell, count } => {
                let s = 2.0 * (u * count[0] - cell[0]) - 1.0;
                let t = 1.0 - 2.0 * (v * count[1] - cell[1]);
                // In a face's middle, where a pole may be, rounding must not miss it.
                let [s, t] = [s, t].map(|c| if c.abs() < 1e-14 { 0.0 } else { c });
                let d: [f64; 3] = std::array::from_fn(|i| forward[i] + s * right[i] + t * up[i]);
                let length = (1.0 + s * s + t * t).sqrt();
                d.map(|c| c / length)
            }
        }
    }
}

/// The direction at point `p` of the disc, with (sin, cos) of its angle to −Z as a function of the radius.
fn around_forward(p: Point, sin_cos: impl Fn(f64) -> (f64, f64)) -> Direction {
    let r = functions::hypot(p[0], p[1]);
    if r >= 1.0 {
        return [0.0, 0.0, 1.0];
    }
    if r == 0.0 {
        return [0.0, 0.0, -1.0];
    }
    let (sin, cos) = sin_cos(r);
    [p[0] / r * sin, p[1] / r * sin, -cos]
}

/// `octahedral_direction` in double precision.
fn octahedral(p: Point) -> Direction {
    let q = p.map(f64::abs);
    let signed_distance = 1.0 - (q[0] + q[1]);
    let r = 1.0 - signed_distance.abs();
    if r <= 0.0 {
        return [0.0, 1.0_f64.copysign(signed_distance), 0.0];
    }
    let phi = ((q[1] - q[0]) / r + 1.0) * FRAC_PI_4;
    let up = (1.0 - r * r).copysign(signed_distance);
    let across = r * (2.0 - r * r).max(0.0).sqrt();
    let (sin_phi, cos_phi) = functions::sin_cos(phi);
    [-(sin_phi * across).copysign(p[1]), up, (cos_phi * across).copysign(p[0])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Vec3, vec2};

    #[test]
    fn charts_are_the_mappings_in_double_precision() {
        let n = 96;
        for mapping in Mapping::ALL {
            for i in 0..n * n {
                let (x, y) = (i % n, i / n);
                let [u, v] = [x, y].map(|i| (i as f64 + 0.5) / n as f64);
                let chart = Chart::of(mapping, [n as f64; 2], x, y);
                let expected = mapping.direction(vec2(u as f32, v as f32));
                let (Some(chart), Some(expected)) = (chart, expected) else { continue };
                let d = chart.direction([u, v]).map(|c| c as f32);
                let error = (Vec3::from(d) - expected).length();
                assert!(error < 4e-6, "{mapping} {u} {v}: {d:?} {expected}");
            }
        }
    }

    /// Asserts that every texel of the grid is shared out once.
    fn check_shares(mapping: Mapping, rows: usize, size: (usize, usize), frame: MapFrame) {
        let grid = LatLongGrid::new(2 * rows, rows);
        let (width, height) = size;
        let mut overlap = Overlap::new(&grid, mapping, width, height).framed(frame);
        let mut covered = vec![0.0; 2 * rows * rows];
        for i in 0..width * height {
            overlap.texel(i % width, i / width);
            for &(j, share) in &overlap.shares {
                covered[j] += share;
            }
        }
        for (j, &covered) in covered.iter().enumerate() {
            let error = covered / grid.solid_angle(j / (2 * rows)) - 1.0;
            let what = format!("{mapping} {size:?} {frame:?} texel {j} of {rows} rows");
            assert!(error.abs() < 2e-6, "{what}: {error:e}");
        }
    }

    #[test]
    fn all_of_the_sphere_is_shared_out_once() {
        for mapping in Mapping::ALL {
            for (rows, size) in
                [(16, mapping.size_for(16)), (9, mapping.size_for(40)), (40, mapping.size_for(7))]
            {
                check_shares(mapping, rows, size, MapFrame::default());
            }
        }
    }

    /// Wherever the poles are: in corners of texels, in their middle or on their edges.
    #[test]
    fn permuted_axes_share_out_all_of_the_sphere() {
        for axes in [[Vec3::X, Vec3::Z, Vec3::Y], [Vec3::NEG_Y, Vec3::X, Vec3::NEG_Z]] {
            let [x, y, z] = axes;
            let frame = MapFrame { turn: 0.1, axes: Some(Mat3::from_cols(x, y, z)) };
            for size in [1, 2, 3, 8, 15] {
                for mapping in [Mapping::Octahedral, Mapping::Angular] {
                    check_shares(mapping, 12, (size, size), frame);
                }
            }
        }
    }
}
