//! Colors of vertices and faces in formats that do not say what their numbers mean: OBJ, OFF and PLY with floats.
//!
//! They are values to display (sRGB), as the programs that write such files take them from the screen. They go from 0 to 1,
//! or to 255 in files where some exceed 1 and all are whole, or some exceed [`GREATEST_OF_ONE`].

use std::path::Path;

use crate::Rgb;
use crate::scene::texture::{Encoding, decode};

/// Values above it are not excess over 1 by rounding or brightness.
const GREATEST_OF_ONE: f32 = 8.0;

/// What the numbers of a file's colors mean.
pub(super) struct ColorScale {
    /// The value of white.
    white: f32,
    /// How many colors are NaN or infinite.
    pub(super) non_finite: usize,
}

impl ColorScale {
    /// The scale of all colors of a file.
    pub(super) fn of(colors: impl Iterator<Item = Rgb>) -> Self {
        let (mut greatest, mut all_whole, mut non_finite) = (0.0, true, 0);
        for color in colors {
            if color.is_finite() {
                greatest = color.max_component().max(greatest);
                all_whole &= color.to_array().iter().all(|c| c.fract() == 0.0);
            } else {
                non_finite += 1;
            }
        }
        let is_of_bytes = greatest > 1.0 && all_whole || greatest > GREATEST_OF_ONE;
        Self { white: if is_of_bytes { 255.0 } else { 1.0 }, non_finite }
    }

    /// A color of the file as linear reflectance in \[0, 1\]; white if it is not finite.
    pub(super) fn linear(&self, color: Rgb) -> Rgb {
        if !color.is_finite() {
            return Rgb::WHITE;
        }
        color.map(|c| decode((c / self.white).clamp(0.0, 1.0), Encoding::Srgb))
    }
}

/// Makes the colors of a file linear, and returns how many are not finite.
pub(super) fn linearize(colors: &mut [Rgb]) -> usize {
    let scale = ColorScale::of(colors.iter().copied());
    for color in colors {
        *color = scale.linear(*color);
    }
    scale.non_finite
}

/// A sentence on `n` colors that are not finite.
pub(super) fn warning(path: &Path, n: usize) -> Option<String> {
    let subject = match n {
        0 => return None,
        1 => "1 color is".to_owned(),
        n => format!("{n} colors are"),
    };
    Some(format!("{}: {subject} NaN or infinite, and white in the picture", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn linear(colors: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let mut colors: Vec<Rgb> = colors.iter().copied().map(Rgb::from).collect();
        linearize(&mut colors);
        colors.into_iter().map(Rgb::to_array).collect()
    }

    #[test]
    fn the_scale_follows_from_all_colors() {
        let gray = decode(0.5, Encoding::Srgb);
        assert_eq!(linear(&[[0.5, 0.0, 1.0]]), [[gray, 0.0, 1.0]]);
        assert_eq!(linear(&[[255.0, 0.0, 127.5]]), [[1.0, 0.0, gray]]);
        assert_eq!(linear(&[[1.0, 0.0, 0.0], [1.0, 1.0, 1.0]]), [[1.0, 0.0, 0.0], [1.0; 3]]);
        let dark = decode(1.0 / 255.0, Encoding::Srgb);
        assert_eq!(linear(&[[1.0, 0.0, 2.0], [0.0; 3]])[0][0], dark);
        // What exceeds the scale.
        assert_eq!(linear(&[[1.25, 0.5, -0.1]]), [[1.0, gray, 0.0]]);
    }

    #[test]
    fn colors_that_are_not_finite_are_white() {
        let mut colors = [Rgb::splat(f32::NAN), Rgb::splat(0.0), Rgb::new(0.0, f32::INFINITY, 0.0)];
        assert_eq!(linearize(&mut colors), 2);
        assert_eq!(colors, [Rgb::WHITE, Rgb::BLACK, Rgb::WHITE]);
        let warning = |n| warning(Path::new("a.ply"), n);
        assert!(warning(0).is_none() && warning(2).is_some_and(|text| text.contains("2 colors")));
    }
}
