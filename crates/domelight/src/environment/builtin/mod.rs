//! Procedural light probes at any size.
//!
//! Each is a radiance over directions; a texel of the lat-long map is its mean over the texel's solid
//! angle, from a regular grid of directions fine enough that the coarsest map still resolves the smallest
//! lamp. Only the sun is smaller than any such grid; it is added with its exact solid angle.
//!
//! A stored picture would fix the resolution and take megabytes, and a fit to a measured probe would
//! carry somebody else's license. There is no random placement: important lights were positioned by eye.

mod cathedral;
mod sky;
mod studio;

use std::f64::consts::{PI, TAU};
use std::fmt;

use crate::color::Rgb;
use crate::image::RgbImage;
use crate::math::{Vec3, functions, vec3};
use crate::names::read_by_name;

/// A procedural light probe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BuiltinProbe {
    /// A clear afternoon sky with a true-size sun over a plain ground.
    Sky,
    /// A dark room with soft boxes.
    Studio,
    /// A dim nave with small bright windows and lamps: two thirds of the energy in 0.1 % of the pixels
    /// (62 % at 256 rows, 67 % at 512, 72 % at 1024; finer texels separate glass from lead).
    Cathedral,
    /// Radiance 1 from all directions, the white furnace.
    Constant,
}

impl BuiltinProbe {
    /// All built-in probes, in the order of their documentation.
    pub const ALL: [Self; 4] = [Self::Sky, Self::Studio, Self::Cathedral, Self::Constant];

    /// The name that [`FromStr`](std::str::FromStr) reads.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sky => "sky",
            Self::Studio => "studio",
            Self::Cathedral => "cathedral",
            Self::Constant => "constant",
        }
    }

    /// A one-line description for a list of probes.
    pub const fn description(self) -> &'static str {
        match self {
            Self::Sky => "clear afternoon sky with a true-size sun, over a plain ground",
            Self::Studio => "dark room with soft boxes: warm key, cool fill and rims, overhead",
            Self::Cathedral => {
                "dim nave, small bright stained glass and lamps (2/3 of the energy in 0.1 % of the pixels)"
            }
            Self::Constant => "radiance 1 everywhere, the white furnace",
        }
    }

    /// The probe as a lat-long map with `height` rows and `2 · height` columns.
    ///
    /// The mean radiance is the same at every size, up to the sampling of edges. The pixels do not depend
    /// on the number of threads.
    ///
    /// # Panics
    /// If `height` is 0.
    pub fn image(self, height: usize) -> RgbImage {
        assert!(height > 0, "a probe has at least one row");
        match self {
            Self::Sky => sky::image(height),
            Self::Studio => {
                let studio = studio::Studio::new();
                averaged(height, 1024, |d| studio.radiance(d))
            }
            Self::Cathedral => averaged(height, 2048, cathedral::radiance),
            Self::Constant => RgbImage::filled(2 * height, height, Rgb::WHITE),
        }
    }
}

impl fmt::Display for BuiltinProbe {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

read_by_name!(BuiltinProbe::ALL, UnknownProbe, "there is no built-in probe");

/// The map whose texels are the solid-angle means of `radiance`, taken on a grid of at least
/// `fine_rows` rows over the sphere.
fn averaged(height: usize, fine_rows: usize, radiance: impl Fn(Vec3) -> Rgb + Sync) -> RgbImage {
    let width = 2 * height;
    let grid = fine_rows.div_ceil(height);
    let columns: Vec<(f64, f64)> = (0..width * grid)
        .map(|x| functions::sin_cos(TAU * ((x as f64 + 0.5) / (width * grid) as f64 - 0.5)))
        .collect();
    let rows = map_rows(height, |y| {
        let mut sums = vec![[0.0f64; 3]; width];
        let mut total = 0.0;
        for fine_y in y * grid..(y + 1) * grid {
            let theta = PI * (fine_y as f64 + 0.5) / (height * grid) as f64;
            let (sin_theta, cos_theta) = functions::sin_cos(theta);
            total += sin_theta * grid as f64;
            for (sum, columns) in sums.iter_mut().zip(columns.chunks_exact(grid)) {
                for &(sin_phi, cos_phi) in columns {
                    let le = radiance(toward((sin_theta, cos_theta), (sin_phi, cos_phi)));
                    for (s, c) in sum.iter_mut().zip(le.to_array()) {
                        *s += c as f64 * sin_theta;
                    }
                }
            }
        }
        sums.into_iter().map(|sum| Rgb::from(sum.map(|s| (s / total) as f32))).collect()
    });
    RgbImage::new(width, height, rows.into_iter().flatten().collect())
}

/// `row(y)` for every row, in parallel where the library has threads.
fn map_rows(height: usize, row: impl Fn(usize) -> Vec<Rgb> + Sync) -> Vec<Vec<Rgb>> {
    #[cfg(feature = "render")]
    {
        use rayon::prelude::*;
        (0..height).into_par_iter().map(&row).collect()
    }
    #[cfg(not(feature = "render"))]
    (0..height).map(&row).collect()
}

/// The unit vector θ from +Y and φ from −Z toward +X \[rad\].
fn direction(theta: f64, phi: f64) -> Vec3 {
    toward(functions::sin_cos(theta), functions::sin_cos(phi))
}

/// [`direction`] by sine and cosine of its angles.
fn toward((sin_theta, cos_theta): (f64, f64), (sin_phi, cos_phi): (f64, f64)) -> Vec3 {
    vec3((sin_phi * sin_theta) as f32, cos_theta as f32, (-cos_phi * sin_theta) as f32)
}

/// 0 below `a`, 1 above `b`, 3t² − 2t³ between.
fn smoothstep(a: f32, b: f32, x: f32) -> f32 {
    let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Solid angle of a texel of row `y` \[sr\].
    fn texel_solid_angle(y: usize, height: usize) -> f64 {
        let cos = |row: usize| (PI * row as f64 / height as f64).cos();
        (cos(y) - cos(y + 1)) * PI / height as f64
    }

    /// Mean over the sphere, per channel.
    fn mean(image: &RgbImage) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for y in 0..image.height {
            for pixel in image.row(y) {
                for (s, c) in sum.iter_mut().zip(pixel.to_array()) {
                    *s += c as f64 * texel_solid_angle(y, image.height) / (4.0 * PI);
                }
            }
        }
        sum
    }

    #[test]
    fn names_round_trip() {
        for probe in BuiltinProbe::ALL {
            assert_eq!(probe.to_string().parse(), Ok(probe));
            assert!(!probe.description().is_empty());
        }
        let error = "skye".parse::<BuiltinProbe>().unwrap_err();
        assert!(error.to_string().contains("\"skye\"") && error.to_string().contains("cathedral"));
    }

    #[test]
    fn every_size_is_finite_and_has_the_same_mean() {
        for probe in BuiltinProbe::ALL {
            let fine = mean(&probe.image(128));
            for height in [1, 2, 7, 33] {
                let image = probe.image(height);
                assert_eq!((image.width, image.height), (2 * height, height));
                assert!(image.pixels.iter().all(|p| p.is_finite() && p.min_component() >= 0.0));
                for (a, b) in mean(&image).into_iter().zip(fine) {
                    assert!(
                        (a / b - 1.0).abs() < 0.02,
                        "{probe} at {height} rows: {a} against {b}"
                    );
                }
            }
        }
    }

    #[test]
    #[cfg(feature = "render")]
    fn the_pixels_do_not_depend_on_threads() {
        for probe in BuiltinProbe::ALL {
            let with = |n_threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
                pool.install(|| probe.image(31))
            };
            assert_eq!(with(1), with(3), "{probe}");
        }
    }

    #[test]
    fn constant_is_one() {
        assert!(BuiltinProbe::Constant.image(3).pixels.iter().all(|&p| p == Rgb::WHITE));
    }

    #[test]
    fn cathedral_is_as_concentrated_as_grace() {
        for height in [512, 1024] {
            let image = BuiltinProbe::Cathedral.image(height);
            let mut texels: Vec<(f32, f64)> = (0..height)
                .flat_map(|y| {
                    image.row(y).iter().map(move |p| (p.luminance(), texel_solid_angle(y, height)))
                })
                .collect();
            texels.sort_by(|a, b| b.0.total_cmp(&a.0));
            let energy =
                |texels: &[(f32, f64)]| texels.iter().map(|t| t.0 as f64 * t.1).sum::<f64>();
            let share = energy(&texels[..texels.len() / 1000]) / energy(&texels);
            let peak = texels[0].0 as f64 / (energy(&texels) / (4.0 * PI));
            println!("{height} rows: share {share:.3}, peak {peak:.0}, mean {:?}", mean(&image));
            assert!((0.55..0.75).contains(&share), "{share} at {height} rows");
            assert!((300.0..3000.0).contains(&peak), "{peak} at {height} rows");
        }
    }
}
