//! Converts color spaces given by RGB primaries to Rec. 709.
//!
//! Matrices from chromaticities: SMPTE RP 177-1993. White points are adapted with Bradford's cone responses.

use crate::Rgb;
use crate::math::Mat3;
use glam::{Vec3, vec3};

/// CIE 1931 (x, y) of red, green, blue and white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Primaries(pub(super) [[f32; 2]; 4]);

impl Primaries {
    /// ITU-R BT.709 with D65.
    pub(super) const REC709: Self =
        Self([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]]);

    /// The matrix to linear Rec. 709; `None` where it is that already (to the three digits that files keep) or
    /// where the chromaticities span no color space.
    pub(super) fn to_rec709(self) -> Option<Mat3> {
        let same =
            |a: &[f32; 2], b: &[f32; 2]| (a[0] - b[0]).abs() < 1e-3 && (a[1] - b[1]).abs() < 1e-3;
        if self.0.iter().zip(&Self::REC709.0).all(|(a, b)| same(a, b)) {
            return None;
        }
        // The colors are XYZ, whatever white the file states.
        if self.0[..3] == Self::XYZ {
            return Some(xyz_to_rec709());
        }
        let matrix = xyz_to_rec709() * adaptation(self.white()) * self.to_xyz()?;
        matrix.is_finite().then_some(matrix)
    }

    /// The chromaticities of X, Y and Z.
    const XYZ: [[f32; 2]; 3] = [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]];

    /// Whether every color is a mixture of red, green and blue.
    pub(super) fn span_a_space(&self) -> bool {
        self.to_xyz().is_some()
    }

    /// RGB = (1, 1, 1) has the white's chromaticity and Y = 1.
    fn to_xyz(self) -> Option<Mat3> {
        // A primary on the line y = 0 has no luminance, and so no length yet.
        let [r, g, b] =
            [0, 1, 2].map(|i| vec3(self.0[i][0], self.0[i][1], 1.0 - self.0[i][0] - self.0[i][1]));
        let columns = Mat3::from_cols(r, g, b);
        if !columns.is_finite() || columns.determinant().abs() < 1e-6 || !self.white().is_finite() {
            return None;
        }
        let scale = columns.inverse() * self.white();
        Some(columns * Mat3::from_diagonal(scale))
    }

    /// The weights of red, green and blue in luminance, their sum 1; Rec. 709's where there are none.
    pub(super) fn luminance(self) -> [f32; 3] {
        let row = |matrix: Mat3| matrix.row(1).to_array();
        self.to_xyz().map_or(Rgb::LUMINANCE, row)
    }

    fn white(self) -> Vec3 {
        xyz_of(self.0[3])
    }
}

/// XYZ (relative to Y = 1 of D65 white, no adaptation) to linear Rec. 709.
pub(super) fn xyz_to_rec709() -> Mat3 {
    Primaries::REC709.to_xyz().expect("Rec. 709 spans a color space").inverse()
}

/// XYZ with a white of chromaticity `white` to linear Rec. 709, white to white.
pub(super) fn xyz_of_white_to_rec709(white: [f32; 2]) -> Mat3 {
    xyz_to_rec709() * adaptation(xyz_of(white))
}

/// Converts a color of a file by `matrix`, and clips what lies outside Rec. 709. A color with a value that is negative or not
/// finite is no light: it is left as it is in the file, so that whoever checks colors finds it.
pub(super) fn to_light(matrix: &Mat3, c: Rgb) -> Rgb {
    if !c.to_array().into_iter().all(is_light) {
        return c;
    }
    transform(matrix, c).map(|c| c.max(0.0))
}

/// Whether a value can be light: finite and not negative.
pub(super) fn is_light(value: f32) -> bool {
    (0.0..f32::INFINITY).contains(&value)
}

/// `matrix` on a color.
fn transform(matrix: &Mat3, c: Rgb) -> Rgb {
    Rgb::from((*matrix * vec3(c.r, c.g, c.b)).to_array())
}

fn xyz_of([x, y]: [f32; 2]) -> Vec3 {
    vec3(x / y, 1.0, (1.0 - x - y) / y)
}

/// From `white` to D65 (Lam 1985, the Bradford transform).
fn adaptation(white: Vec3) -> Mat3 {
    let cones = Mat3::from_cols(
        vec3(0.8951, -0.7502, 0.0389),
        vec3(0.2664, 1.7135, -0.0685),
        vec3(-0.1614, 0.0367, 1.0296),
    );
    let gain = (cones * Primaries::REC709.white()) / (cones * white);
    cones.inverse() * Mat3::from_diagonal(gain) * cones
}

#[cfg(test)]
mod tests {
    use super::*;

    const ACESCG: Primaries =
        Primaries([[0.713, 0.293], [0.165, 0.830], [0.128, 0.044], [0.32168, 0.33767]]);

    #[test]
    fn xyz_matrix_is_that_of_srgb() {
        // IEC 61966-2-1, to its four digits.
        let expected =
            [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]];
        let matrix = xyz_to_rec709().transpose().to_cols_array_2d();
        for (row, expected) in matrix.iter().zip(&expected) {
            for (a, b) in row.iter().zip(expected) {
                assert!((a - b).abs() < 1e-3, "{a} {b}");
            }
        }
    }

    #[test]
    fn what_is_no_light_stays_to_be_found() {
        let matrix = ACESCG.to_rec709().unwrap();
        for c in [[f32::INFINITY; 3], [f32::INFINITY, 1.0, 1.0], [-1.0, 2.0, 1e30]] {
            assert_eq!(to_light(&matrix, Rgb::from(c)), Rgb::from(c));
        }
        assert!(to_light(&matrix, Rgb::new(1.0, f32::NAN, 1.0)).g.is_nan());
        assert!(to_light(&matrix, Rgb::new(0.0, 1.0, 0.0)).r == 0.0, "Rec. 709 has no such green");
    }

    #[test]
    fn white_stays_white() {
        assert_eq!(Primaries::REC709.to_rec709(), None);
        let white = ACESCG.to_rec709().unwrap() * Vec3::ONE;
        assert!((white - Vec3::ONE).length() < 1e-4, "{white}");
        assert_eq!(Primaries([[0.3, 0.0]; 4]).to_rec709(), None);
    }
}
