//! Linear Rec. 709 color.

use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub};

/// Linear RGB with Rec. 709 primaries: radiance, irradiance or reflectance, depending on context.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Rgb {
    /// Red.
    pub r: f32,
    /// Green.
    pub g: f32,
    /// Blue.
    pub b: f32,
}

/// Added to R² in the denominator of relMSE, as most papers on sampling do, so that dark pixels do not dominate.
#[cfg(any(feature = "picture", feature = "render"))]
pub(crate) const REGULARIZER: f64 = 0.01;

impl Rgb {
    /// (0, 0, 0).
    pub const BLACK: Self = Self::splat(0.0);
    /// (1, 1, 1).
    pub const WHITE: Self = Self::splat(1.0);

    /// Creates a color from its three channels.
    pub const fn new(r: f32, g: f32, b: f32) -> Self {
        Self { r, g, b }
    }

    /// Creates a gray.
    pub const fn splat(v: f32) -> Self {
        Self { r: v, g: v, b: v }
    }

    /// The channels in order.
    pub const fn to_array(self) -> [f32; 3] {
        [self.r, self.g, self.b]
    }

    /// The weights of [`Rgb::luminance`].
    pub const LUMINANCE: [f32; 3] = [0.2126, 0.7152, 0.0722];

    /// Relative luminance of Rec. 709: 0.2126 R + 0.7152 G + 0.0722 B.
    pub fn luminance(self) -> f32 {
        let [r, g, b] = Self::LUMINANCE;
        r * self.r + g * self.g + b * self.b
    }

    /// (R + G + B) / 3.
    pub fn mean(self) -> f32 {
        (self.r + self.g + self.b) / 3.0
    }

    /// The largest channel.
    pub fn max_component(self) -> f32 {
        self.r.max(self.g).max(self.b)
    }

    /// The smallest channel.
    pub fn min_component(self) -> f32 {
        self.r.min(self.g).min(self.b)
    }

    /// Whether all channels are exactly zero.
    pub fn is_black(self) -> bool {
        self == Self::BLACK
    }

    /// Whether no channel is NaN or infinite.
    pub fn is_finite(self) -> bool {
        self.r.is_finite() && self.g.is_finite() && self.b.is_finite()
    }

    /// Applies `f` to each channel.
    #[must_use]
    pub fn map(self, mut f: impl FnMut(f32) -> f32) -> Self {
        Self::new(f(self.r), f(self.g), f(self.b))
    }

    /// Interpolates linearly: `self` at t = 0, `other` at t = 1.
    #[must_use]
    pub fn lerp(self, other: Self, t: f32) -> Self {
        self * (1.0 - t) + other * t
    }
}

impl From<[f32; 3]> for Rgb {
    fn from([r, g, b]: [f32; 3]) -> Self {
        Self { r, g, b }
    }
}

impl Add for Rgb {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self::new(self.r + o.r, self.g + o.g, self.b + o.b)
    }
}

impl Sub for Rgb {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self::new(self.r - o.r, self.g - o.g, self.b - o.b)
    }
}

impl Neg for Rgb {
    type Output = Self;
    fn neg(self) -> Self {
        self.map(|c| -c)
    }
}

impl Mul for Rgb {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self::new(self.r * o.r, self.g * o.g, self.b * o.b)
    }
}

impl Mul<f32> for Rgb {
    type Output = Self;
    fn mul(self, s: f32) -> Self {
        self.map(|c| c * s)
    }
}

impl Mul<Rgb> for f32 {
    type Output = Rgb;
    fn mul(self, c: Rgb) -> Rgb {
        c * self
    }
}

impl Div<f32> for Rgb {
    type Output = Self;
    fn div(self, s: f32) -> Self {
        self.map(|c| c / s)
    }
}

impl AddAssign for Rgb {
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl MulAssign<f32> for Rgb {
    fn mul_assign(&mut self, s: f32) {
        *self = *self * s;
    }
}

impl Sum for Rgb {
    fn sum<I: Iterator<Item = Self>>(iter: I) -> Self {
        iter.fold(Self::BLACK, Add::add)
    }
}
