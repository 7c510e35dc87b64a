//! The texels of a lat-long map, with exact integrals over each.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use crate::Rgb;
use crate::environment::Environment;
use crate::environment::lat_long::{RowIntegrals, column_integrals};
use crate::math::{Vec2, Vec3, functions, vec2, vec3};

/// A map in its own frame: +Y up, the center column toward −Z, whatever its orientation.
pub(super) struct Texels<'a> {
    environment: &'a Environment,
    /// ∫ sin φ dφ and −∫ cos φ dφ over each column.
    pub(super) columns: Vec<[f64; 2]>,
    pub(super) rows: Vec<RowIntegrals>,
    /// sin φ and −cos φ at the edges and middles of columns, by half columns from the left.
    half_columns: Vec<[f32; 2]>,
    /// sin θ and cos θ at the edges and middles of rows, by half rows from the top.
    half_rows: Vec<[f32; 2]>,
    /// The world directions of the map's axes.
    axes: [Vec3; 3],
}

impl<'a> Texels<'a> {
    pub(super) fn new(environment: &'a Environment) -> Self {
        let (width, height) = (environment.map().width, environment.map().height);
        let half_column = |i: usize| {
            let (sin, cos) = functions::sin_cos(TAU * (0.5 * i as f64 / width as f64 - 0.5));
            [sin as f32, -cos as f32]
        };
        let half_row = |i: usize| {
            let (sin, cos) = functions::sin_cos(PI * 0.5 * i as f64 / height as f64);
            [sin as f32, cos as f32]
        };
        Self {
            environment,
            columns: (0..width).map(|x| column_integrals(x, width)).collect(),
            rows: (0..height).map(|y| RowIntegrals::new(y, width, height)).collect(),
            half_columns: (0..=2 * width).map(half_column).collect(),
            half_rows: (0..=2 * height).map(half_row).collect(),
            axes: [vec2(0.75, 0.5), vec2(0.5, 0.0), vec2(0.5, 0.5)]
                .map(|uv: Vec2| environment.direction(uv)),
        }
    }

    pub(super) fn environment(&self) -> &'a Environment {
        self.environment
    }

    pub(super) fn width(&self) -> usize {
        self.columns.len()
    }

    pub(super) fn height(&self) -> usize {
        self.rows.len()
    }

    pub(super) fn row(&self, y: usize) -> &'a [Rgb] {
        self.environment.map().row(y)
    }

    /// The middle of a texel, unit vector in the map's frame.
    pub(super) fn center(&self, x: usize, y: usize) -> Vec3 {
        self.half(2 * x + 1, 2 * y + 1)
    }

    /// The direction at `x` half columns and `y` half rows.
    fn half(&self, x: usize, y: usize) -> Vec3 {
        let ([sin_phi, cos_phi], [sin_theta, cos_theta]) =
            (self.half_columns[x], self.half_rows[y]);
        vec3(sin_phi * sin_theta, cos_theta, cos_phi * sin_theta)
    }

    /// A direction in a rectangle without a seam, and a bound on the angle from it to any other.
    ///
    /// The straight line on the map from the middle, Δφ and Δθ away at the most, is no longer than
    /// √(Δθ² + Δφ² sin² θ) on the sphere with the largest sin θ, and a great circle is shorter.
    pub(super) fn cone(&self, columns: &Range<usize>, rows: &Range<usize>) -> (Vec3, f32) {
        let middle = self.half(columns.start + columns.end, rows.start + rows.end);
        let delta_phi = PI as f32 * columns.len() as f32 / self.width() as f32;
        let delta_theta = 0.5 * PI as f32 * rows.len() as f32 / self.height() as f32;
        let equator = (self.height()).clamp(2 * rows.start, 2 * rows.end);
        (middle, functions::hypot(delta_theta, delta_phi * self.half_rows[equator][0]))
    }

    /// The direction at column `x` and row `y`, fractions allowed, in the map's frame.
    pub(super) fn direction(&self, x: f64, y: f64) -> [f64; 3] {
        let (sin_phi, cos_phi) = functions::sin_cos(TAU * (x / self.width() as f64 - 0.5));
        let (sin_theta, cos_theta) = functions::sin_cos(PI * y / self.height() as f64);
        [sin_phi * sin_theta, cos_theta, -cos_phi * sin_theta]
    }

    /// The world directions of the map frame's x, y and z.
    pub(super) fn axes(&self) -> [[f64; 3]; 3] {
        let [x, y, minus_z] = self.axes.map(|a| a.as_dvec3().to_array());
        [x, y, minus_z.map(|c| -c)]
    }

    /// The unit vector along `m` of the map's frame, in the world; up where `m` has no direction.
    pub(super) fn to_world(&self, m: [f64; 3]) -> Vec3 {
        let v = unit(m).unwrap_or(Vec3::Y);
        (self.axes[0] * v.x + self.axes[1] * v.y - self.axes[2] * v.z).normalize()
    }
}

/// `m` as a unit vector; none if its length is zero or lost in rounding.
pub(super) fn unit(m: [f64; 3]) -> Option<Vec3> {
    let length = m.map(|c| c * c).iter().sum::<f64>().sqrt();
    let [x, y, z] = m.map(|c| (c / length) as f32);
    (length > 0.0 && length.is_finite()).then(|| vec3(x, y, z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RgbImage;
    use crate::environment::{Orientation, UpAxis};

    /// Midpoint sums over a fine grid inside each texel, against the closed forms.
    #[test]
    fn integrals_over_a_texel() {
        let (width, height, n) = (7, 5, 400);
        let map = RgbImage::filled(width, height, Rgb::WHITE);
        let env = Environment::new(map, Orientation::default(), 1.0).unwrap();
        let texels = Texels::new(&env);
        for (x, y) in [(0, 0), (3, 2), (6, 4), (2, 1)] {
            let mut sum = [0.0; 4];
            for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
                let v = y as f64 + (j as f64 + 0.5) / n as f64;
                let d = texels.direction(x as f64 + (i as f64 + 0.5) / n as f64, v);
                let cell = TAU * PI / (n * n * width * height) as f64;
                let weight = cell * (PI * v / height as f64).sin();
                sum[0] += weight;
                (0..3).for_each(|c| sum[c + 1] += weight * d[c]);
            }
            let (row, column) = (texels.rows[y], texels.columns[x]);
            let exact = [
                row.solid_angle,
                row.horizontal * column[0],
                row.vertical,
                row.horizontal * column[1],
            ];
            for (a, b) in sum.iter().zip(exact) {
                assert!((a - b).abs() < 1e-5, "({x}, {y}): {sum:?} {exact:?}");
            }
            assert!((row.solid_angle - env.texel_solid_angle(y)).abs() < 1e-12);
        }
    }

    #[test]
    fn the_world_is_the_environments() {
        for (up, rotation) in [(UpAxis::Y, 0.0), (UpAxis::Y, 70.0), (UpAxis::Z, -123.0)] {
            let map = RgbImage::filled(12, 6, Rgb::WHITE);
            let env = Environment::new(map, Orientation { up, rotation }, 1.0).unwrap();
            let texels = Texels::new(&env);
            for (x, y) in [(0.5, 0.5), (3.0, 2.2), (11.9, 5.0), (6.0, 3.0)] {
                let world = texels.to_world(texels.direction(x, y));
                let expected = env.direction(vec2(x as f32 / 12.0, y as f32 / 6.0));
                assert!((world - expected).length() < 1e-5, "{world} {expected}");
            }
        }
    }
}
