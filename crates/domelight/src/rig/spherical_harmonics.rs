//! The first nine spherical harmonics of an environment.
//!
//! Ramamoorthi & Hanrahan 2001, "An Efficient Representation for Irradiance Environment Maps":
//! irradiance, as a function of the normal, is so smooth that the harmonics up to degree 2 hold 99 % of
//! it.

use std::f64::consts::PI;

use super::texels::Texels;
use crate::Rgb;
use crate::environment::Environment;
use crate::math::{Mat3, Vec3, functions, vec3};
use crate::parallel::in_order;

/// Radiance as Σ L_i Y_i with the real harmonics up to degree 2, in world space.
///
/// The basis is that of the paper's equation 3, without the Condon-Shortley phase, in the order
/// (l, m) = (0, 0), (1, −1), (1, 0), (1, 1), (2, −2), (2, −1), (2, 0), (2, 1), (2, 2):
///
/// | i | Y_i of the direction (x, y, z) |
/// |---|---|
/// | 0 | 0.282095 |
/// | 1, 2, 3 | 0.488603 · y, z, x |
/// | 4, 5, 7 | 1.092548 · xy, yz, xz |
/// | 6 | 0.315392 · (3z² − 1) |
/// | 8 | 0.546274 · (x² − y²) |
///
/// x, y and z are the *world's* axes, whichever is up, so z is the polar axis of the harmonics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphericalHarmonics {
    /// L_i = ∫ L Y_i dω \[W·m⁻²·sr⁻¹\].
    pub coefficients: [Rgb; 9],
}

impl SphericalHarmonics {
    /// Integrates the environment, each texel exactly.
    pub fn project(environment: &Environment) -> Self {
        let moments = RadianceMoments::of(&Texels::new(environment));
        let mut coefficients = [Rgb::BLACK; 9];
        let channels = moments.channels.map(|c| c.harmonics());
        for (i, coefficient) in coefficients.iter_mut().enumerate() {
            *coefficient = Rgb::from(channels.map(|c| (c[i] * environment.unit()) as f32));
        }
        Self { coefficients }
    }

    /// The radiance from the unit direction `wi`, which may be negative if the environment is not smooth.
    pub fn radiance(&self, wi: Vec3) -> Rgb {
        basis(wi).into_iter().zip(self.coefficients).map(|(y, l)| l * y).sum()
    }

    /// The coefficients of the radiance rotated by `rotation`.
    ///
    /// Uses the quadrature rule with 14 points, the corners and face centers of a cube, which integrates
    /// polynomials of degree 5 over the sphere exactly.
    #[must_use]
    pub fn turned(&self, rotation: Mat3) -> Self {
        let (inverse, centers) = (rotation.transpose(), [Vec3::X, Vec3::Y, Vec3::Z]);
        let sign = |bit: usize| if bit == 0 { 1.0 } else { -1.0 };
        let corner = |i: usize| vec3(sign(i & 1), sign(i & 2), sign(i & 4)).normalize();
        let faces = centers.into_iter().flat_map(|w| [w, -w]).map(|w| (w, 1.0 / 15.0));
        let mut coefficients = [Rgb::BLACK; 9];
        for (w, weight) in faces.chain((0..8).map(|i| (corner(i), 3.0 / 40.0))) {
            let le = self.radiance(inverse * w) * (weight * 4.0 * PI as f32);
            coefficients.iter_mut().zip(basis(w)).for_each(|(c, y)| *c += le * y);
        }
        Self { coefficients }
    }

    /// The irradiance of a surface with the unit normal `normal` \[W·m⁻²\]: Σ Â_l L_lm Y_lm
    /// with Â = (π, 2π/3, π/4), equation 8 of the paper.
    pub fn irradiance(&self, normal: Vec3) -> Rgb {
        Self { coefficients: self.irradiance_coefficients() }.radiance(normal)
    }

    /// Irradiance over π \[W·m⁻²·sr⁻¹\] as a polynomial of the normal: the factors of 1, y, z, x, xy, yz, 3z² − 1, xz and
    /// x² − y².
    pub fn irradiance_polynomial(&self) -> [Rgb; 9] {
        let [y0, y1, y2, y20, y22] = normalizations();
        let y = [y0, y1, y1, y1, y2, y2, y20, y2, y22];
        let coefficients = self.irradiance_coefficients();
        std::array::from_fn(|i| coefficients[i].map(|c| (f64::from(c) * y[i] / PI) as f32))
    }

    /// Â_l L_lm: the coefficients of irradiance as a function of the normal, in the same basis
    /// \[W·m⁻²\].
    pub fn irradiance_coefficients(&self) -> [Rgb; 9] {
        const COSINE: [f64; 3] = [PI, 2.0 * PI / 3.0, PI / 4.0];
        let degree = |i: usize| if i == 0 { 0 } else { 1 + usize::from(i > 3) };
        std::array::from_fn(|i| self.coefficients[i] * COSINE[degree(i)] as f32)
    }
}

/// Y_i of a unit vector.
fn basis(w: Vec3) -> [f32; 9] {
    let [x, y, z] = w.as_dvec3().to_array();
    let [xx, yy, zz] = [x * x, y * y, z * z];
    harmonics(1.0, [x, y, z], [xx, yy, zz], [x * y, y * z, x * z]).map(|y| y as f32)
}

/// The constants of Y_0, of Y_1 to Y_3, of Y_4, Y_5 and Y_7, of Y_6, and of Y_8.
fn normalizations() -> [f64; 5] {
    [1.0, 3.0, 15.0, 1.25, 3.75].map(|c| (c / (4.0 * PI)).sqrt())
}

/// The harmonics from ∫ L, ∫ L (x, y, z), ∫ L (x², y², z²) and ∫ L (xy, yz, xz).
pub(super) fn harmonics(
    sum: f64,
    first: [f64; 3],
    squares: [f64; 3],
    products: [f64; 3],
) -> [f64; 9] {
    let [y0, y1, y2, y20, y22] = normalizations();
    let ([x, y, z], [xx, yy, zz], [xy, yz, xz]) = (first, squares, products);
    [
        y0 * sum,
        y1 * y,
        y1 * z,
        y1 * x,
        y2 * xy,
        y2 * yz,
        y20 * (3.0 * zz - sum),
        y2 * xz,
        y22 * (xx - yy),
    ]
}

/// Integrals of radiance times polynomials of the direction, in the world.
#[derive(Clone, Copy, Debug, Default)]
struct RadianceMoments {
    channels: [Moments; 3],
}

/// ∫ L dω, ∫ L ω dω and ∫ L ω ωᵀ dω of one channel.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    sum: f64,
    first: [f64; 3],
    second: [[f64; 3]; 3],
}

impl RadianceMoments {
    fn of(texels: &Texels) -> Self {
        let twice = twice_azimuth(texels.width());
        let rows = in_order(texels.height(), |y| Self::of_row(texels, &twice, y));
        let mut total = Self::default();
        for row in &rows {
            total.channels.iter_mut().zip(&row.channels).for_each(|(t, r)| t.add(r));
        }
        let axes = texels.axes();
        Self { channels: total.channels.map(|m| m.turned(axes)) }
    }

    /// Sums over a row in the map's frame: the integrals over θ and φ are factors.
    fn of_row(texels: &Texels, twice: &[[f64; 2]], y: usize) -> Self {
        let mut sums = [[0.0; 5]; 3];
        for ((le, column), twice) in texels.row(y).iter().zip(&texels.columns).zip(twice) {
            for (sum, l) in sums.iter_mut().zip(le.to_array().map(f64::from)) {
                sum[0] += l;
                sum[1] += l * column[0];
                sum[2] += l * column[1];
                sum[3] += l * twice[0];
                sum[4] += l * twice[1];
            }
        }
        let (row, step) = (&texels.rows[y], 2.0 * PI / texels.width() as f64);
        let [cos_cubed, sin_cubed, across] = polar_integrals(y, texels.height());
        let moments = |[l, sin, cos, cos_2, sin_2]: [f64; 5]| {
            let xx = 0.5 * (l * step - cos_2) * sin_cubed;
            let zz = 0.5 * (l * step + cos_2) * sin_cubed;
            let yy = l * step * cos_cubed;
            let (xy, yz, xz) = (sin * across, cos * across, -0.5 * sin_2 * sin_cubed);
            Moments {
                sum: l * row.solid_angle,
                first: [sin * row.horizontal, l * row.vertical, cos * row.horizontal],
                second: [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]],
            }
        };
        Self { channels: sums.map(moments) }
    }
}

/// ∫ cos 2φ dφ and ∫ sin 2φ dφ over each column.
fn twice_azimuth(width: usize) -> Vec<[f64; 2]> {
    let step = 2.0 * PI / width as f64;
    let column = |x: usize| {
        let (sin, cos) = functions::sin_cos(2.0 * (step * (x as f64 + 0.5) - PI));
        [cos * functions::sin(step), sin * functions::sin(step)]
    };
    (0..width).map(column).collect()
}

/// ∫ cos² θ sin θ dθ, ∫ sin³ θ dθ and ∫ sin² θ cos θ dθ over row `y`.
fn polar_integrals(y: usize, height: usize) -> [f64; 3] {
    let edge = |y: usize| functions::sin_cos(PI * y as f64 / height as f64);
    let ((sin_0, cos_0), (sin_1, cos_1)) = (edge(y), edge(y + 1));
    let cos_cubed = (functions::powi(cos_0, 3) - functions::powi(cos_1, 3)) / 3.0;
    [
        cos_cubed,
        cos_0 - cos_1 - cos_cubed,
        (functions::powi(sin_1, 3) - functions::powi(sin_0, 3)) / 3.0,
    ]
}

impl Moments {
    fn add(&mut self, o: &Self) {
        self.sum += o.sum;
        for i in 0..3 {
            self.first[i] += o.first[i];
            (0..3).for_each(|j| self.second[i][j] += o.second[i][j]);
        }
    }

    /// Those of the directions `axes` · ω.
    fn turned(&self, axes: [[f64; 3]; 3]) -> Self {
        let mut turned = Self { sum: self.sum, ..Self::default() };
        for i in 0..3 {
            for k in 0..3 {
                turned.first[i] += axes[k][i] * self.first[k];
                for (j, l) in (0..9).map(|n| (n / 3, n % 3)) {
                    turned.second[i][j] += axes[k][i] * axes[l][j] * self.second[k][l];
                }
            }
        }
        turned
    }

    fn harmonics(&self) -> [f64; 9] {
        let s = &self.second;
        let (squares, products) = ([s[0][0], s[1][1], s[2][2]], [s[0][1], s[1][2], s[0][2]]);
        harmonics(self.sum, self.first, squares, products)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RgbImage;
    use crate::environment::{Orientation, UpAxis};
    use crate::math::{from_spherical, vec2};
    use crate::sampling::Pcg32;

    fn orientations() -> [Orientation; 3] {
        [(UpAxis::Y, 0.0), (UpAxis::Y, 70.0), (UpAxis::Z, -123.0)]
            .map(|(up, rotation)| Orientation { up, rotation })
    }

    /// A map of `f` over world directions.
    fn map_of(f: impl Fn(Vec3) -> Rgb, height: usize, orientation: Orientation) -> Environment {
        let map = RgbImage::filled(2 * height, height, Rgb::BLACK);
        let frame = Environment::new(map, orientation, 1.0).unwrap();
        let map = RgbImage::from_fn(2 * height, height, |x, y| {
            let uv = vec2(x as f32 + 0.5, y as f32 + 0.5);
            f(frame.direction(uv / vec2(2.0 * height as f32, height as f32)))
        });
        Environment::new(map, orientation, 1.0).unwrap()
    }

    fn directions() -> impl Iterator<Item = Vec3> {
        let mut pcg = Pcg32::new(1, 1);
        (0..50).map(move |_| from_spherical(2.0 * pcg.next_f32() - 1.0, 7.0 * pcg.next_f32()))
    }

    /// A sum of harmonics has those coefficients and no others.
    #[test]
    fn harmonics_are_found_again() {
        let mut pcg = Pcg32::new(3, 1);
        let mut coefficients = [0; 9].map(|_| Rgb::from([0; 3].map(|_| pcg.next_f32() - 0.5)));
        coefficients[0] = Rgb::splat(9.0);
        let exact = SphericalHarmonics { coefficients };
        for orientation in orientations() {
            let env = map_of(|w| exact.radiance(w), 256, orientation);
            let found = SphericalHarmonics::project(&env);
            for (f, e) in found.coefficients.iter().zip(coefficients) {
                let off = (*f - e).map(f32::abs).max_component();
                assert!(off < 2e-4, "{f:?} is not {e:?}, {orientation:?}");
            }
        }
    }

    #[test]
    fn turned_harmonics_are_those_of_the_turned_world() {
        let mut pcg = Pcg32::new(4, 1);
        let coefficients = [0; 9].map(|_| Rgb::from([0; 3].map(|_| pcg.next_f32() - 0.5)));
        let still = SphericalHarmonics { coefficients };
        let rotation = Mat3::from_rotation_y(0.7) * Mat3::from_rotation_x(-2.0);
        let turned = still.turned(rotation);
        for w in directions() {
            let off = (turned.radiance(rotation * w) - still.radiance(w)).map(f32::abs);
            assert!(off.max_component() < 1e-5, "{w}");
        }
    }

    /// On a map of few texels, against sums over a fine grid within them.
    #[test]
    fn texels_are_integrated_exactly() {
        let mut pcg = Pcg32::new(8, 1);
        let coarse = RgbImage::from_fn(5, 3, |_, _| Rgb::splat(pcg.next_f32()));
        let fine = RgbImage::from_fn(5 * 128, 3 * 128, |x, y| coarse.get(x / 128, y / 128));
        let orientation = Orientation { rotation: 33.0, ..Orientation::default() };
        let of = |map| Environment::new(map, orientation, 1.0).unwrap();
        let [coarse, fine] = [coarse, fine].map(|map| SphericalHarmonics::project(&of(map)));
        for (c, f) in coarse.coefficients.iter().zip(fine.coefficients) {
            assert!((c.g - f.g).abs() < 1e-6, "{c:?} {f:?}");
        }
    }

    #[test]
    fn the_polynomial_is_irradiance_over_pi() {
        let mut pcg = Pcg32::new(5, 1);
        let coefficients = [0; 9].map(|_| Rgb::from([0; 3].map(|_| pcg.next_f32() - 0.5)));
        let harmonics = SphericalHarmonics { coefficients };
        for n in directions() {
            let Vec3 { x, y, z } = n;
            let terms = [1.0, y, z, x, x * y, y * z, 3.0 * z * z - 1.0, x * z, x * x - y * y];
            let sum: Rgb =
                harmonics.irradiance_polynomial().into_iter().zip(terms).map(|(c, t)| c * t).sum();
            let off = (sum * PI as f32 - harmonics.irradiance(n)).map(f32::abs);
            assert!(off.max_component() < 1e-5, "{n}");
        }
    }

    /// ∫ L max(0, n·ω) dω is π L of a constant map and 2π/3 a·n of the linear one 1 + a·ω, + π.
    #[test]
    fn irradiance_of_a_constant_and_a_linear_map() {
        let a = Vec3::new(0.3, -0.5, 0.6);
        for orientation in orientations() {
            let env = map_of(|w| Rgb::splat(1.0 + a.dot(w)), 256, orientation);
            let harmonics = SphericalHarmonics::project(&env);
            let white = Environment::new(RgbImage::filled(2, 1, Rgb::WHITE), orientation, 1.0);
            let constant = SphericalHarmonics::project(&white.unwrap());
            for n in directions() {
                assert!((constant.irradiance(n).r - PI as f32).abs() < 1e-5);
                let exact = PI as f32 * (1.0 + 2.0 / 3.0 * a.dot(n));
                assert!((harmonics.irradiance(n).b - exact).abs() < 2e-4, "{n}");
            }
        }
    }
}
