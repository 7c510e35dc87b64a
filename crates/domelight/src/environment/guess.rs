//! Guesses the mapping of a picture that does not state it, from its shape and where its light is.
//!
//! | shape | candidates | told apart by |
//! |---|---|---|
//! | 1:1 | angular, octahedral | the light in the corners outside the disc, and between the disc and the upper hemisphere's diamond |
//! | 4:3, 3:4 | cross, photograph | the light in the cells without a face |
//! | 6:1, 1:6 | strip of faces, panorama | the steps of luminance at the borders of the faces |
//! | other | lat-long | |
//!
//! A doubt is reported where the picture looks like something else that cannot be read.

use super::mapping::{CubeLayout, EnvmapKind, Mapping};
use crate::math::{Vec2, functions, vec2};
use crate::{Rgb, RgbImage};

/// What is darker than this share of its surroundings is empty, up to the error of lossy compression.
const EMPTY: f64 = 0.05;

/// A border with at most this multiple of the usual step of luminance is none.
const CONTINUOUS: f64 = 2.0;

/// A border with at least this multiple is one.
const BROKEN: f64 = 4.0;

/// The guessed mapping of a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Guess {
    /// The likeliest mapping that can be read.
    pub mapping: Mapping,
    /// Why it may be wrong and what to do, if there is reason.
    pub doubt: Option<String>,
}

impl Guess {
    /// Guesses from the picture and its OpenEXR attribute. Mirror balls are taken for angular maps.
    pub fn of(image: &RgbImage, envmap: Option<EnvmapKind>) -> Self {
        let mapping = Mapping::guess(image.width, image.height, envmap);
        if envmap.is_some() && mapping.envmap() == envmap {
            return Self { mapping, doubt: None };
        }
        match mapping {
            Mapping::Angular | Mapping::MirrorBall | Mapping::Octahedral => of_square(image),
            Mapping::Cube(layout @ (CubeLayout::CrossHorizontal | CubeLayout::CrossVertical)) => {
                of_cross(image, layout)
            }
            Mapping::Cube(layout @ (CubeLayout::StripHorizontal | CubeLayout::StripVertical)) => {
                of_strip(image, layout)
            }
            Mapping::LatLong | Mapping::LatLongExr => Self { mapping, doubt: of_lat_long(image) },
        }
    }
}

/// An angular map is black outside its disc, but not just inside of it. An octahedral map may be black in the lower
/// hemisphere, outside the diamond of the upper one.
fn of_square(image: &RgbImage) -> Guess {
    // Leave out a texel's half diagonal on either side of the circle.
    let margin = 3.0 / image.width as f32;
    let radius = |uv: Vec2| (2.0 * uv - Vec2::ONE).length();
    let corners = mean(image, |uv| radius(uv) > 1.0 + margin);
    let is_shoulder = |uv: Vec2| {
        let p = (2.0 * uv - Vec2::ONE).abs();
        p.x + p.y > 1.0 && radius(uv) < 1.0 - margin
    };
    let is_angular = if mean(image, is_shoulder) > 0.0 {
        corners == 0.0 || corners <= EMPTY * typical(image, is_shoulder)
    } else {
        mean(image, |_| true) == 0.0
    };
    let mapping = if is_angular { Mapping::Angular } else { Mapping::Octahedral };
    let doubt = (!is_angular && has_equal_halves(image)).then(|| {
        "its halves look alike, as those of a stereo panorama, one eye over the other, which is not read: crop one of them"
            .to_owned()
    });
    Guess { mapping, doubt }
}

/// Whether the upper and the lower half of a picture show nearly the same, and something.
fn has_equal_halves(image: &RgbImage) -> bool {
    let half = image.height / 2;
    let log = |x: usize, y: usize| log_luminance(image.row(y)[x]);
    let (mut apart, mut structure) = (0.0, 0.0);
    for y in (0..half).step_by(step(image.height)) {
        for x in (0..image.width).step_by(step(image.width)) {
            apart += (log(x, y) - log(x, y + half)).abs();
            structure += (log(x, y) - log(x, half - 1 - y)).abs();
        }
    }
    structure > 0.0 && apart < 0.25 * structure
}

/// A cross is black in the cells without a face.
fn of_cross(image: &RgbImage, layout: CubeLayout) -> Guess {
    let mapping = Mapping::Cube(layout);
    let is_face = |uv: Vec2| mapping.direction(uv).is_some();
    if mean(image, |uv| !is_face(uv)) > 0.0
        && typical(image, |uv| !is_face(uv)) > EMPTY * typical(image, is_face)
    {
        let doubt = format!(
            "it has the shape of a cross of cube faces, but light in its empty cells: read as lat-long; for a cross, say \
             {mapping}"
        );
        return Guess { mapping: Mapping::LatLong, doubt: Some(doubt) };
    }
    let face = image.width / 3;
    let is_upright = layout == CubeLayout::CrossVertical
        && border(image, (face..2 * face).map(|x| [0, 1, 2, 3].map(|i| [x, 3 * face + i - 2])))
            > BROKEN;
    let doubt = is_upright.then(|| {
        "its lowest face does not continue the one above, as if it were upright: if so, read it with --faces U,L,F,R,D,B (of \
         render: --env-faces)"
            .to_owned()
    });
    Guess { mapping, doubt }
}

/// The faces of a strip do not continue one another, a panorama does everywhere.
fn of_strip(image: &RgbImage, layout: CubeLayout) -> Guess {
    let mapping = Mapping::Cube(layout);
    let face = image.width.min(image.height);
    let border_of = |i: usize| {
        let across = |along: usize, at: usize| match layout {
            CubeLayout::StripVertical => [along, at],
            CubeLayout::StripHorizontal
            | CubeLayout::CrossHorizontal
            | CubeLayout::CrossVertical => [at, along],
        };
        border(image, (0..face).map(|along| [0, 1, 2, 3].map(|j| across(along, i * face + j - 2))))
    };
    let borders: Vec<f64> = if face < 4 { Vec::new() } else { (1..6).map(border_of).collect() };
    let is_continuous = |range: &[f64]| range.iter().all(|&b| b <= CONTINUOUS);
    let doubt = match &borders[..] {
        [] => None,
        all if is_continuous(all) => Some(format!(
            "nothing in it breaks at the borders of cube faces: it may be a panorama; read as {mapping}"
        )),
        [first @ .., fourth, _] if is_continuous(&first[..3]) && *fourth > CONTINUOUS => Some(
            "its first four faces continue one another: they may be in the order front, right, back, left, up, down, but are \
             read as +X, −X, +Y, −Y, +Z, −Z; for that order, say --faces F,R,B,L,U,D (of render: --env-faces)"
                .to_owned(),
        ),
        _ => None,
    };
    Guess { mapping, doubt }
}

/// Two fisheye pictures beside each other are black outside two discs.
fn of_lat_long(image: &RgbImage) -> Option<String> {
    if image.width != 2 * image.height || image.height < 8 {
        return None;
    }
    let margin = 3.0 / image.height as f32;
    let radius = |uv: Vec2| {
        let in_half = vec2((2.0 * uv.x).fract(), uv.y);
        (2.0 * in_half - Vec2::ONE).length()
    };
    let rim = typical(image, |uv| (0.9..1.0 - margin).contains(&radius(uv)));
    let is_empty = |top: f32| {
        let of_half = |uv: Vec2| radius(uv) > 1.0 + margin && (top..top + 0.5).contains(&uv.y);
        mean(image, of_half) <= EMPTY * EMPTY * rim
    };
    (rim > 0.0 && is_empty(0.0) && is_empty(0.5)).then(|| {
        "it is black outside two discs, as two fisheye pictures of a camera with two lenses, which are not read: stitch them \
         first"
            .to_owned()
    })
}

/// The mean luminance of the texels with their middles in a region; 0 if there are none.
fn mean(image: &RgbImage, is_inside: impl Fn(Vec2) -> bool) -> f64 {
    mean_of(image, is_inside, |texel| f64::from(texel.luminance().max(0.0)))
}

/// The geometric mean, which no sun brightens; 0 if all is black.
fn typical(image: &RgbImage, is_inside: impl Fn(Vec2) -> bool) -> f64 {
    if mean(image, &is_inside) > 0.0 {
        functions::powf(2.0, mean_of(image, is_inside, log_luminance))
    } else {
        0.0
    }
}

/// The distance between texels that are looked at, along an edge of `extent` texels.
fn step(extent: usize) -> usize {
    /// The texels along an edge that suffice.
    const ENOUGH: usize = 512;
    (extent / ENOUGH).max(1)
}

/// The mean of a function over the finite texels with their middles in a region; 0 if there are none. Of large maps, it looks at
/// every k-th texel of every k-th row.
fn mean_of(image: &RgbImage, is_inside: impl Fn(Vec2) -> bool, f: impl Fn(Rgb) -> f64) -> f64 {
    let size = vec2(image.width as f32, image.height as f32);
    let [across, down] = [step(image.width), step(image.height)];
    let (mut sum, mut count) = (0.0, 0u64);
    for y in (0..image.height).step_by(down) {
        for (x, &texel) in image.row(y).iter().enumerate().step_by(across) {
            let is_inside = is_inside(vec2(x as f32 + 0.5, y as f32 + 0.5) / size);
            if is_inside && texel.luminance().is_finite() {
                sum += f(texel);
                count += 1;
            }
        }
    }
    sum / count.max(1) as f64
}

/// The mean step of log luminance over a border, relative to the steps beside it. Each item holds the positions of two
/// texels on each side.
fn border(image: &RgbImage, lines: impl Iterator<Item = [[usize; 2]; 4]>) -> f64 {
    let (mut over, mut beside) = (0.0, 0.0);
    for line in lines {
        let [a, b, c, d] = line.map(|[x, y]| log_luminance(image.row(y)[x]));
        over += (b - c).abs();
        beside += 0.5 * ((a - b).abs() + (c - d).abs());
    }
    if over == 0.0 { 0.0 } else { over / beside }
}

/// The binary logarithm of luminance, with a floor.
fn log_luminance(texel: Rgb) -> f64 {
    let luminance = texel.luminance();
    f64::from(functions::log2(if luminance.is_finite() { luminance.max(1e-6) } else { 1e6 }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::builtin::BuiltinProbe;
    use crate::environment::mapping::from_lat_long;

    fn guess(image: &RgbImage) -> (Mapping, bool) {
        let guess = Guess::of(image, None);
        (guess.mapping, guess.doubt.is_some())
    }

    /// With light everywhere, and with a black lower half as of a sky.
    fn probes() -> Vec<RgbImage> {
        let cathedral = BuiltinProbe::Cathedral.image(128);
        let half =
            RgbImage::from_fn(
                256,
                128,
                |x, y| {
                    if y < 64 { cathedral.get(x, y) } else { Rgb::BLACK }
                },
            );
        vec![cathedral, BuiltinProbe::Sky.image(128), half]
    }

    #[test]
    fn every_mapping_is_guessed_from_its_own_pictures() {
        for (i, probe) in probes().iter().enumerate() {
            for mapping in Mapping::ALL {
                let expected = match mapping {
                    Mapping::LatLongExr => Mapping::LatLong,
                    Mapping::MirrorBall => Mapping::Angular,
                    Mapping::LatLong
                    | Mapping::Angular
                    | Mapping::Octahedral
                    | Mapping::Cube(_) => mapping,
                };
                let (columns, rows) = mapping.aspect();
                let image = from_lat_long(probe, mapping, (48 * columns, 48 * rows));
                assert_eq!(guess(&image), (expected, false), "{mapping} of probe {i}");
            }
        }
    }

    /// Lossy compression leaves a little light outside the disc.
    #[test]
    fn corners_are_dark_by_their_energy() {
        let mut image = from_lat_long(&probes()[0], Mapping::Angular, (96, 96));
        for pixel in &mut image.pixels {
            *pixel += Rgb::splat(1e-3);
        }
        assert_eq!(guess(&image), (Mapping::Angular, false));
    }

    #[test]
    fn what_cannot_be_read_is_doubted() {
        let probe = &probes()[0];
        let at =
            |u: f32, v: f32| probe.get((u * 256.0) as usize % 256, ((v * 128.0) as usize).min(127));
        let photograph = RgbImage::from_fn(128, 96, |x, y| at(x as f32 / 128.0, y as f32 / 96.0));
        assert_eq!(guess(&photograph), (Mapping::LatLong, true));
        let panorama = RgbImage::from_fn(384, 64, |x, y| {
            let (x, y) = (x as f32, y as f32);
            Rgb::splat(2.0 + (x / 23.0).sin() * (y / 9.0).cos() + 0.1 * (x / 3.0).sin())
        });
        assert!(guess(&panorama).1);
        let stereo = RgbImage::from_fn(256, 256, |x, y| {
            at((x as f32 + (y / 128) as f32) / 256.0, (y % 128) as f32 / 128.0)
        });
        assert_eq!(guess(&stereo), (Mapping::Octahedral, true));
        // A sun makes nothing beside it empty.
        let with_sun = |mut image: RgbImage, u: f32, v: f32| {
            let (x, y) = (u * image.width as f32, v * image.height as f32);
            image.pixels[y as usize * image.width + x as usize] = Rgb::splat(1e7);
            image
        };
        assert_eq!(guess(&with_sun(photograph, 0.5, 0.5)), (Mapping::LatLong, true));
        assert_eq!(guess(&with_sun(probe.clone(), 0.25, 0.03)), (Mapping::LatLong, false));
        let octahedral = from_lat_long(probe, Mapping::Octahedral, (96, 96));
        assert_eq!(guess(&with_sun(octahedral, 0.2, 0.2)), (Mapping::Octahedral, false));
        let fisheye = from_lat_long(probe, Mapping::Angular, (64, 64));
        let dual = RgbImage::from_fn(128, 64, |x, y| fisheye.get(x % 64, y));
        assert_eq!(guess(&dual), (Mapping::LatLong, true));
    }
}
