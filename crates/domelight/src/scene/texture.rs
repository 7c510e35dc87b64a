//! Textures: images on surfaces, of reflectance, roughness or normals.
//!
//! Texels are stored as in the file, with 8 or 16 bits per channel, and decoded through a table of the
//! 2⁸ or 2¹⁶ values. Alpha has 8 bits and is stored if a material needs it. Look-ups are bilinear or
//! take the nearest texel. There are no mip maps: many samples per pixel average the texture, and
//! without ray differentials a mip level would be a guess.

use crate::Rgb;
use crate::math::{Vec2, functions, vec2};

/// The mapping from texel values to numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Encoding {
    /// Colors with the transfer curve of IEC 61966-2-1.
    Srgb,
    /// Numbers in \[0, 1\]: roughness, metalness, normals.
    Linear,
}

/// An image that materials refer to.
#[derive(Clone, Debug)]
pub struct Texture {
    name: String,
    width: u32,
    height: u32,
    texels: Texels,
    /// The number for each texel value.
    decode: Vec<f32>,
    /// 0 to 255 from transparent to opaque; empty if opaque.
    alpha: Vec<u8>,
}

#[derive(Clone, Debug)]
enum Texels {
    Bits8(Vec<[u8; 3]>),
    Bits16(Vec<[u16; 3]>),
}

/// The treatment of texture coordinates outside \[0, 1\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "io", derive(serde::Deserialize), serde(rename_all = "lowercase"))]
pub enum Wrap {
    /// The image is tiled.
    #[default]
    Repeat,
    /// The border texels extend indefinitely.
    Clamp,
    /// The image is tiled, with every second tile mirrored.
    Mirror,
}

/// The filter of texture look-ups.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TextureFilter {
    /// The bilinear mean of the four nearest texels.
    #[default]
    Linear,
    /// The nearest texel.
    Nearest,
}

/// A point's texture coordinates: the first set and the second.
pub(crate) type Uvs = [Vec2; 2];

/// A reference to a texture: which one, and how it is placed on the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// Index into the scene's textures.
    pub texture: usize,
    /// The mesh's set of texture coordinates: 0 for [`Mesh::uvs`](crate::geometry::Mesh::uvs), 1 for
    /// [`Mesh::uvs2`](crate::geometry::Mesh::uvs2).
    pub uv_set: usize,
    /// Wrapping in u and in v.
    pub wrap: [Wrap; 2],
    /// The filter between texel centers.
    pub filter: TextureFilter,
    /// The transform from the mesh's texture coordinates to the image's.
    pub transform: UvTransform,
}

impl TextureRef {
    /// References a texture, repeated and untransformed.
    pub fn new(texture: usize) -> Self {
        Self {
            texture,
            uv_set: 0,
            wrap: [Wrap::Repeat; 2],
            filter: TextureFilter::Linear,
            transform: UvTransform::IDENTITY,
        }
    }
}

/// An affine map of texture coordinates: uv ↦ u · x + v · y + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvTransform {
    /// The step in the image for one step in u.
    pub x: Vec2,
    /// The step in the image for one step in v.
    pub y: Vec2,
    /// The image coordinates of (0, 0).
    pub offset: Vec2,
}

impl UvTransform {
    /// The identity.
    pub const IDENTITY: Self = Self { x: Vec2::X, y: Vec2::Y, offset: Vec2::ZERO };

    /// Scale, then rotation \[rad\], then offset, as the glTF extension `KHR_texture_transform`
    /// defines them.
    pub fn new(offset: Vec2, rotation: f32, scale: Vec2) -> Self {
        let (sin, cos) = functions::sin_cos(rotation);
        Self { x: scale.x * vec2(cos, -sin), y: scale.y * vec2(sin, cos), offset }
    }

    /// Maps the mesh's `uv` to image coordinates.
    #[inline]
    pub fn apply(&self, uv: Vec2) -> Vec2 {
        uv.x * self.x + uv.y * self.y + self.offset
    }
}

/// A texture whose size and data disagree.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("texture {name} of {width} x {height} texels cannot hold {count}")]
pub struct TextureError {
    /// The texture's name.
    pub name: String,
    /// Its width.
    pub width: u32,
    /// Its height.
    pub height: u32,
    /// The number of texels given.
    pub count: usize,
}

impl Texture {
    /// Creates a texture from 8-bit texels, with the first row at the top.
    ///
    /// # Errors
    /// If the number of texels is not width · height, or is 0.
    pub fn from_rgb8(
        name: impl Into<String>,
        width: u32,
        height: u32,
        texels: Vec<[u8; 3]>,
        encoding: Encoding,
    ) -> Result<Self, TextureError> {
        Self::new(name.into(), width, height, Texels::Bits8(texels), encoding)
    }

    /// Creates a texture from 16-bit texels, with the first row at the top.
    ///
    /// # Errors
    /// If the number of texels is not width · height, or is 0.
    pub fn from_rgb16(
        name: impl Into<String>,
        width: u32,
        height: u32,
        texels: Vec<[u16; 3]>,
        encoding: Encoding,
    ) -> Result<Self, TextureError> {
        Self::new(name.into(), width, height, Texels::Bits16(texels), encoding)
    }

    /// The stored texels, byte by byte, and everything else as text.
    #[cfg(feature = "io")]
    pub(crate) fn add_to(&self, fingerprinter: &mut crate::fingerprint::Fingerprinter) {
        let Self { name: _, width, height, texels, decode, alpha } = self;
        fingerprinter.bytes(alpha.iter().copied());
        fingerprinter.text(format_args!("{width}x{height}"));
        fingerprinter.numbers(decode.iter().copied());
        match texels {
            Texels::Bits8(texels) => fingerprinter.bytes(texels.as_flattened().iter().copied()),
            Texels::Bits16(texels) => {
                let values = texels.as_flattened().iter();
                fingerprinter.bytes(values.flat_map(|value| value.to_le_bytes()));
            }
        }
    }

    fn new(
        name: String,
        width: u32,
        height: u32,
        texels: Texels,
        encoding: Encoding,
    ) -> Result<Self, TextureError> {
        let (count, levels) = match &texels {
            Texels::Bits8(t) => (t.len(), 1 << 8),
            Texels::Bits16(t) => (t.len(), 1 << 16),
        };
        if count == 0 || count as u64 != u64::from(width) * u64::from(height) {
            return Err(TextureError { name, width, height, count });
        }
        let decode =
            (0..levels).map(|i| decode(i as f32 / (levels - 1) as f32, encoding)).collect();
        Ok(Self { name, width, height, texels, decode, alpha: Vec::new() })
    }

    /// Adds one alpha per texel.
    ///
    /// # Errors
    /// If the number of alphas differs from the number of texels.
    pub fn with_alpha(self, alpha: Vec<u8>) -> Result<Self, TextureError> {
        let Self { width, height, .. } = self;
        if alpha.len() as u64 != u64::from(width) * u64::from(height) {
            return Err(TextureError { name: self.name, width, height, count: alpha.len() });
        }
        Ok(Self { alpha, ..self })
    }

    /// Whether the texture has alpha.
    pub fn has_alpha(&self) -> bool {
        !self.alpha.is_empty()
    }

    /// The name, for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Width and height in texels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// The texel in column `x` of row `y` from the top, decoded.
    ///
    /// # Panics
    /// If the position is outside the image.
    #[inline]
    pub fn texel(&self, x: u32, y: u32) -> Rgb {
        let i = y as usize * self.width as usize + x as usize;
        let [r, g, b] = match &self.texels {
            Texels::Bits8(t) => t[i].map(usize::from),
            Texels::Bits16(t) => t[i].map(usize::from),
        };
        Rgb::new(self.decode[r], self.decode[g], self.decode[b])
    }

    /// Whether the mean suggests a tangent-space normal map: half red, half green, full blue.
    #[cfg(feature = "io")]
    pub(crate) fn looks_like_normals(&self) -> bool {
        // Enough texels for a mean, in all parts of the image.
        const SIDE: u32 = 64;
        let (columns, rows) = (self.width.min(SIDE), self.height.min(SIDE));
        let at = |i: u32, n: u32, size: u32| (u64::from(i) * u64::from(size) / u64::from(n)) as u32;
        let mut sum = Rgb::BLACK;
        for i in 0..columns * rows {
            let (x, y) = (at(i % columns, columns, self.width), at(i / columns, rows, self.height));
            sum += self.texel(x, y);
        }
        let mean = sum / (columns * rows) as f32;
        let half = 0.35..0.65;
        half.contains(&mean.r) && half.contains(&mean.g) && mean.b > mean.r.max(mean.g) + 0.15
    }

    /// The bilinear look-up at `uv`, where (0, 0) is the top left corner of the image and (1, 1) the bottom
    /// right corner. Non-finite coordinates count as 0.
    #[inline]
    pub fn sample(&self, uv: Vec2, wrap: [Wrap; 2]) -> Rgb {
        let (x0, x1, fx) = neighbors(uv.x, self.width, wrap[0]);
        let (y0, y1, fy) = neighbors(uv.y, self.height, wrap[1]);
        let top = self.texel(x0, y0).lerp(self.texel(x1, y0), fx);
        let bottom = self.texel(x0, y1).lerp(self.texel(x1, y1), fx);
        top.lerp(bottom, fy)
    }
}

impl Texture {
    /// Like [`Texture::sample`], with a choice of filter.
    #[inline]
    pub fn sample_by(&self, uv: Vec2, wrap: [Wrap; 2], filter: TextureFilter) -> Rgb {
        match filter {
            TextureFilter::Linear => self.sample(uv, wrap),
            TextureFilter::Nearest => {
                let (x, y) = self.nearest(uv, wrap);
                self.texel(x, y)
            }
        }
    }

    /// The alpha at `uv` in \[0, 1\], looked up like [`Texture::sample_by`]; 1 if the texture has no alpha.
    #[inline]
    pub fn sample_alpha(&self, uv: Vec2, wrap: [Wrap; 2], filter: TextureFilter) -> f32 {
        if self.alpha.is_empty() {
            return 1.0;
        }
        let alpha = |x: u32, y: u32| {
            f32::from(self.alpha[y as usize * self.width as usize + x as usize]) / 255.0
        };
        if filter == TextureFilter::Nearest {
            let (x, y) = self.nearest(uv, wrap);
            return alpha(x, y);
        }
        let (x0, x1, fx) = neighbors(uv.x, self.width, wrap[0]);
        let (y0, y1, fy) = neighbors(uv.y, self.height, wrap[1]);
        let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
        let top = mix(alpha(x0, y0), alpha(x1, y0), fx);
        mix(top, mix(alpha(x0, y1), alpha(x1, y1), fx), fy)
    }

    /// The texel nearest to `uv`.
    #[inline]
    fn nearest(&self, uv: Vec2, wrap: [Wrap; 2]) -> (u32, u32) {
        let along = |t, n, wrap| {
            let (a, b, f) = neighbors(t, n, wrap);
            if f < 0.5 { a } else { b }
        };
        (along(uv.x, self.width, wrap[0]), along(uv.y, self.height, wrap[1]))
    }
}

/// IEC 61966-2-1 decoding, or none.
pub(crate) fn decode(v: f32, encoding: Encoding) -> f32 {
    match encoding {
        Encoding::Linear => v,
        Encoding::Srgb if v <= 0.04045 => v / 12.92,
        Encoding::Srgb => functions::powf((v + 0.055) / 1.055, 2.4),
    }
}

/// The two texels nearest to the coordinate `t` along an axis of `n` texels, and the second's weight.
#[inline]
fn neighbors(t: f32, n: u32, wrap: Wrap) -> (u32, u32, f32) {
    let t = if t.is_finite() { t } else { 0.0 };
    let t = match wrap {
        Wrap::Repeat => t - t.floor(),
        Wrap::Clamp => t.clamp(0.0, 1.0),
        Wrap::Mirror => 1.0 - (t - 2.0 * (0.5 * t).floor() - 1.0).abs(),
    };
    let x = t * n as f32 - 0.5;
    let floor = x.floor();
    let i = floor as i64;
    (wrap_index(i, n, wrap), wrap_index(i + 1, n, wrap), x - floor)
}

/// Wraps the texel index `i` in [-1, n] into [0, n).
#[inline]
fn wrap_index(i: i64, n: u32, wrap: Wrap) -> u32 {
    match wrap {
        Wrap::Repeat => i.rem_euclid(i64::from(n)) as u32,
        Wrap::Clamp | Wrap::Mirror => i.clamp(0, i64::from(n) - 1) as u32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_by_two() -> Texture {
        let texels = vec![[0, 0, 0], [255, 0, 0], [0, 255, 0], [0, 0, 255]];
        Texture::from_rgb8("t", 2, 2, texels, Encoding::Linear).unwrap()
    }

    #[test]
    fn texel_centers_give_the_texels_under_every_wrap() {
        let t = two_by_two();
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            for (x, y) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let uv = (vec2(x as f32, y as f32) + 0.5) / 2.0;
                assert_eq!(t.sample(uv, [wrap; 2]), t.texel(x, y));
            }
        }
    }

    #[test]
    fn wrapping_repeats_clamps_and_mirrors() {
        let t = two_by_two();
        let at = |u: f32, wrap| t.sample(vec2(u, 0.25), [wrap; 2]).r;
        assert_eq!(at(1.25, Wrap::Repeat), 0.0);
        assert_eq!(at(-0.25, Wrap::Repeat), 1.0);
        assert_eq!(at(0.0, Wrap::Repeat), 0.5);
        assert_eq!(at(1.25, Wrap::Clamp), 1.0);
        assert_eq!(at(-7.0, Wrap::Clamp), 0.0);
        assert_eq!(at(1.25, Wrap::Mirror), 1.0);
        assert_eq!(at(-0.25, Wrap::Mirror), 0.0);
        assert_eq!(at(-0.75, Wrap::Mirror), 1.0);
        for odd in [f32::NAN, f32::INFINITY, 1e30, -1e30] {
            assert!(t.sample(vec2(odd, odd), [Wrap::Repeat; 2]).is_finite());
        }
    }

    #[test]
    fn srgb_is_decoded_at_both_depths() {
        let t8 = Texture::from_rgb8("t", 1, 1, vec![[0, 128, 255]], Encoding::Srgb).unwrap();
        let t16 =
            Texture::from_rgb16("t", 1, 1, vec![[0, 128 * 257, 65535]], Encoding::Srgb).unwrap();
        let c = t8.texel(0, 0);
        assert_eq!(c, t16.texel(0, 0));
        assert_eq!((c.r, c.b), (0.0, 1.0));
        assert!((c.g - 0.215_860_5).abs() < 1e-6);
    }

    #[test]
    fn the_uv_transform_scales_then_rotates_then_moves() {
        let t = UvTransform::new(vec2(0.5, 0.0), std::f32::consts::FRAC_PI_2, vec2(2.0, 1.0));
        assert!((t.apply(vec2(1.0, 0.0)) - vec2(0.5, -2.0)).length() < 1e-6);
        assert!((t.apply(vec2(0.0, 1.0)) - vec2(1.5, 0.0)).length() < 1e-6);
    }

    #[test]
    fn the_nearest_texel_is_its_own_square() {
        let t = two_by_two();
        let at = |u, v| t.sample_by(vec2(u, v), [Wrap::Clamp; 2], TextureFilter::Nearest);
        for (u, v, x, y) in
            [(0.01, 0.01, 0, 0), (0.49, 0.2, 0, 0), (0.51, 0.49, 1, 0), (1.0, 0.51, 1, 1)]
        {
            assert_eq!(at(u, v), t.texel(x, y), "{u}, {v}");
        }
    }

    #[test]
    fn alpha_is_looked_up_as_color_is() {
        let t = two_by_two();
        let by = |t: &Texture, u, filter| t.sample_alpha(vec2(u, 0.25), [Wrap::Clamp; 2], filter);
        assert_eq!(by(&t, 0.5, TextureFilter::Linear), 1.0);
        let t = t.with_alpha(vec![0, 255, 0, 0]).unwrap();
        assert!(t.has_alpha());
        assert_eq!(by(&t, 0.5, TextureFilter::Linear), 0.5);
        assert_eq!(by(&t, 0.45, TextureFilter::Nearest), 0.0);
        assert_eq!(by(&t, 0.55, TextureFilter::Nearest), 1.0);
        assert!(t.with_alpha(vec![0; 3]).is_err());
    }

    #[test]
    fn wrong_sizes_are_refused() {
        assert!(Texture::from_rgb8("t", 2, 2, vec![[0; 3]; 3], Encoding::Linear).is_err());
        assert!(Texture::from_rgb8("t", 0, 0, vec![], Encoding::Linear).is_err());
    }
}
