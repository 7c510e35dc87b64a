//! Custom densities over an environment's texels.

use super::{Environment, EnvironmentSample, Texel, unit_of};
use crate::math::Vec2;
use crate::sampling::HierarchicalTable;
use crate::simd::Vectors;

/// A density over directions proportional to the caller's weights for the texels of an environment, constant over each
/// texel.
///
/// If a weight is zero but the radiance is not, sampling this density alone is biased. Combine it with another one by
/// multiple importance sampling.
#[derive(Clone, Debug)]
pub struct EnvironmentDensity {
    table: HierarchicalTable,
    weights: Vec<f32>,
    width: usize,
    /// One over ∫ weight dω.
    inverse_total: f32,
}

/// Invalid weights of a density.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DensityError {
    /// The number of weights differs from the number of texels.
    #[error("there are {found} weights for a map of {width}x{height} texels")]
    Count {
        /// How many weights.
        found: usize,
        /// Columns of the map.
        width: usize,
        /// Rows of the map.
        height: usize,
    },
    /// A weight that is negative, NaN or infinite.
    #[error("the weight of texel ({x}, {y}) is {value}; it must be finite and not negative")]
    BadWeight {
        /// Column.
        x: usize,
        /// Row.
        y: usize,
        /// The weight.
        value: f32,
    },
    /// All weights are 0.
    #[error("all weights are 0")]
    AllZero,
}

impl EnvironmentDensity {
    /// Creates the density per solid angle proportional to `weights`, one for each texel of [`Environment::map`], row
    /// by row.
    ///
    /// # Errors
    /// The first weight in row order that is negative or not finite, a number of weights that differs from the number
    /// of texels, or weights that are all 0.
    pub fn new(environment: &Environment, weights: Vec<f32>) -> Result<Self, DensityError> {
        let grid = &environment.grid;
        let (width, height) = (grid.texels.width(), grid.texels.height());
        if weights.len() != width * height {
            return Err(DensityError::Count { found: weights.len(), width, height });
        }
        if let Some(i) = weights.iter().position(|w| !(w.is_finite() && *w >= 0.0)) {
            return Err(DensityError::BadWeight { x: i % width, y: i / width, value: weights[i] });
        }
        // Only quotients of weights matter, and neither sums nor their inverses may overflow.
        let greatest = weights.iter().copied().fold(0.0, f32::max);
        let unit = unit_of(f64::from(greatest));
        let scaled = |w: f32| (f64::from(w) / unit) as f32;
        let weights: Vec<f32> = weights.into_iter().map(scaled).collect();
        let table = HierarchicalTable::from_rows(width, height, |row, out| {
            let solid_angle = grid.texels.solid_angle(row) as f32;
            for (o, &weight) in out.iter_mut().zip(&weights[row * width..(row + 1) * width]) {
                *o = weight * solid_angle;
            }
        });
        // Finite weights that are not negative have no other fault.
        let table = table.map_err(|_| DensityError::AllZero)?;
        let inverse_total = (1.0 / table.total()) as f32;
        Ok(Self { table, weights, width, inverse_total })
    }

    /// Samples a direction; `None` if the density is too small for single precision. `environment` is that of
    /// [`EnvironmentDensity::new`], or one of the same size.
    pub fn sample(&self, environment: &Environment, u: Vec2) -> Option<EnvironmentSample> {
        let drawn = self.table.sample(u);
        let texel = Texel { column: drawn.column, row: drawn.row };
        let (column, row) = (texel.column as f32, texel.row as f32);
        let inside = environment.grid.directions_inside(column, row, drawn.inside.to_array());
        let wi = environment.orientation.up.to_world(inside.into());
        let le = environment.map.get(texel.column, texel.row);
        let pdf = self.density(texel);
        (pdf > 0.0).then_some(EnvironmentSample { wi, le, pdf })
    }

    /// The density of [`EnvironmentDensity::sample`] at `wi` \[sr⁻¹\].
    pub fn pdf(&self, environment: &Environment, wi: crate::math::Vec3) -> f32 {
        self.density(
            environment.grid.texel(environment.orientation.up.to_map(Vectors::from(wi)).into()),
        )
    }

    fn density(&self, texel: Texel) -> f32 {
        self.weights[texel.row * self.width + texel.column] * self.inverse_total
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::Orientation;
    use crate::math::{Vec3, vec2};
    use crate::sampling::Pcg32;
    use crate::{Rgb, RgbImage};
    use testkit::Chi2;

    fn environment() -> Environment {
        let orientation = Orientation { rotation: 40.0, ..Orientation::default() };
        Environment::new(RgbImage::filled(8, 4, Rgb::WHITE), orientation, 1.0).unwrap()
    }

    #[test]
    fn samples_follow_the_callers_weights() {
        let environment = environment();
        let weights: Vec<f32> = (0..32).map(|i| ((i * 7 % 11) as f32).powi(2)).collect();
        let density = EnvironmentDensity::new(&environment, weights).unwrap();
        let report = Chi2::default().sphere(
            "an environment's own density",
            |u, _| density.sample(&environment, u.into()).map(|s| s.wi.to_array()),
            |w| f64::from(density.pdf(&environment, Vec3::from(w))),
        );
        let report = report.unwrap();
        assert!((report.mass - 1.0).abs() < 1e-3, "{report:?}");
        let mut pcg = Pcg32::new(1, 2);
        for _ in 0..1000 {
            let u = vec2(pcg.next_f32(), pcg.next_f32());
            let s = density.sample(&environment, u).unwrap();
            assert_eq!(s.pdf, density.pdf(&environment, s.wi));
        }
    }

    #[test]
    fn luminance_as_weight_is_the_environments_own_density() {
        let map = RgbImage::from_fn(16, 8, |x, y| Rgb::new(x as f32, 0.5 * y as f32, 1.0));
        let environment = Environment::from_image(map).unwrap();
        let weights = environment.map().pixels.iter().map(|p| p.luminance()).collect();
        let density = EnvironmentDensity::new(&environment, weights).unwrap();
        for u in [vec2(0.1, 0.7), vec2(0.5, 0.5), vec2(0.9, 0.2)] {
            assert_eq!(density.sample(&environment, u), environment.sample(u));
        }
    }

    #[test]
    fn bad_weights_are_refused() {
        let environment = environment();
        let refused = |weights| EnvironmentDensity::new(&environment, weights).unwrap_err();
        assert_eq!(refused(vec![1.0; 3]), DensityError::Count { found: 3, width: 8, height: 4 });
        assert_eq!(refused(vec![0.0; 32]), DensityError::AllZero);
        for value in [f32::INFINITY, -1.0] {
            let mut weights = vec![1.0; 32];
            weights[10] = value;
            assert_eq!(refused(weights), DensityError::BadWeight { x: 2, y: 1, value });
        }
    }

    #[test]
    fn only_quotients_of_weights_matter() {
        let environment = environment();
        for weight in [f32::MAX, 1.0, 1e-44] {
            let density = EnvironmentDensity::new(&environment, vec![weight; 32]).unwrap();
            let sample = density.sample(&environment, vec2(0.3, 0.6)).unwrap();
            assert!((sample.pdf * 4.0 * crate::math::PI - 1.0).abs() < 1e-6, "{weight}");
        }
    }
}
