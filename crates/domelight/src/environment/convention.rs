//! How other programs orient a lat-long map.
//!
//! Programs agree that the top row is up. They differ in the direction of the center column, and in whether the map is
//! seen from inside the sphere, as a photograph is, or from outside, mirrored. A scene that comes from a program in its
//! usual way, as glTF or with its up axis kept, meets its map again by one turn about the up axis.

use std::fmt;

use crate::math::{TAU, functions};
use crate::names::read_by_name;
use crate::{Rgb, RgbImage};

/// A program, and how it orients a lat-long map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Convention {
    /// Blender's world and Cycles.
    Blender,
    /// Mitsuba 3's `envmap`.
    Mitsuba,
    /// pbrt-v4 after `imgtool makeequiarea`, and pbrt-v3.
    Pbrt,
    /// OpenUSD's `DomeLight` in the format latlong.
    Usd,
    /// The Khronos glTF viewer and IBL sampler.
    Gltf,
    /// three.js' `EquirectangularReflectionMapping`.
    Three,
    /// Babylon.js' `HDRCubeTexture` in a left-handed scene, as scenes are by default.
    Babylon,
    /// Unreal Engine's sky light with an imported `.hdr`.
    Unreal,
    /// Unity's panoramic skybox.
    Unity,
    /// Godot's panorama sky.
    Godot,
    /// Bevy, whose panoramas become cubes.
    Bevy,
    /// Filament's `cmgen`.
    Filament,
    /// PlayCanvas' textures in its projection equirect.
    PlayCanvas,
    /// A Radiance source with a lat-long picture, as domelight writes it.
    Radiance,
    /// nvdiffrec and nvdiffrecmc.
    Nvdiffrec,
}

/// What a statement on a program rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Proof {
    /// Maps that domelight turned were rendered in the program (`checks/interop`).
    Program,
    /// They were read as the program's format says (`checks/interop`).
    Format,
    /// The source code of its look-up.
    Source,
}

impl Proof {
    /// A word for tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Program => "in the program",
            Self::Format => "by its format",
            Self::Source => "from its source",
        }
    }
}

/// A map whose columns cannot be turned by a quarter without mixing them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{width} columns cannot be turned by a quarter without mixing them; 4 must divide their number"
)]
pub struct Indivisible {
    /// The number of columns.
    pub width: usize,
}

impl Convention {
    /// All programs.
    pub const ALL: [Self; 15] = [
        Self::Blender,
        Self::Mitsuba,
        Self::Pbrt,
        Self::Usd,
        Self::Gltf,
        Self::Three,
        Self::Babylon,
        Self::Unreal,
        Self::Unity,
        Self::Godot,
        Self::Bevy,
        Self::Filament,
        Self::PlayCanvas,
        Self::Radiance,
        Self::Nvdiffrec,
    ];

    /// The name that [`FromStr`](std::str::FromStr) parses.
    pub fn name(self) -> &'static str {
        match self {
            Self::Blender => "blender",
            Self::Mitsuba => "mitsuba",
            Self::Pbrt => "pbrt",
            Self::Usd => "usd",
            Self::Gltf => "gltf",
            Self::Three => "three",
            Self::Babylon => "babylon",
            Self::Unreal => "unreal",
            Self::Unity => "unity",
            Self::Godot => "godot",
            Self::Bevy => "bevy",
            Self::Filament => "filament",
            Self::PlayCanvas => "playcanvas",
            Self::Radiance => "radiance",
            Self::Nvdiffrec => "nvdiffrec",
        }
    }

    /// The turn that makes domelight's map stand as in the program: an [`Orientation`](super::Orientation)'s rotation
    /// \[degrees\].
    pub fn rotation(self) -> f32 {
        90.0 * self.quarter_turns() as f32
    }

    /// The same in quarter turns, counterclockwise as seen from above: 1 has the center column on the left.
    fn quarter_turns(self) -> usize {
        match self {
            Self::Unreal | Self::Bevy | Self::Radiance | Self::Nvdiffrec => 0,
            Self::Pbrt | Self::Unity => 1,
            Self::Mitsuba
            | Self::Usd
            | Self::Babylon
            | Self::Godot
            | Self::Filament
            | Self::PlayCanvas => 2,
            Self::Blender | Self::Gltf | Self::Three => 3,
        }
    }

    /// Whether columns grow to the left as seen from inside the sphere.
    pub fn is_mirrored(self) -> bool {
        match self {
            Self::Pbrt => true,
            Self::Blender
            | Self::Mitsuba
            | Self::Usd
            | Self::Gltf
            | Self::Three
            | Self::Babylon
            | Self::Unreal
            | Self::Unity
            | Self::Godot
            | Self::Bevy
            | Self::Filament
            | Self::PlayCanvas
            | Self::Radiance
            | Self::Nvdiffrec => false,
        }
    }

    /// The column of a direction in the program's own axes, as its source computes it, with the whole map as 1, up to a
    /// whole number.
    pub fn look_up(self) -> &'static str {
        match self {
            Self::Blender => "½ − atan2(y, x)/2π, z up",
            Self::Mitsuba | Self::Godot | Self::Filament | Self::PlayCanvas => {
                "atan2(x, −z)/2π, y up"
            }
            Self::Pbrt => "atan2(y, x)/2π, z up",
            Self::Usd => "¼ + atan2(z, x)/2π, y up",
            Self::Gltf | Self::Three => "½ + atan2(z, x)/2π, y up",
            Self::Babylon => "½ + atan2(x, z)/2π, y up, left-handed",
            Self::Unreal => "½ + atan2(x, −y)/2π, z up, left-handed",
            Self::Unity => "½ − atan2(z, x)/2π, y up, left-handed",
            Self::Radiance => "½ + atan2(x, y)/2π, z up",
            Self::Bevy | Self::Nvdiffrec => "½ + atan2(x, −z)/2π, y up",
        }
    }

    /// Where the center column looks in the program's own axes.
    pub fn center(self) -> &'static str {
        match self {
            Self::Blender | Self::Gltf | Self::Three | Self::Unity => "+X",
            Self::Mitsuba
            | Self::Usd
            | Self::Babylon
            | Self::Godot
            | Self::Filament
            | Self::PlayCanvas => "+Z",
            Self::Pbrt => "−X",
            Self::Radiance => "+Y",
            Self::Unreal => "−Y",
            Self::Bevy | Self::Nvdiffrec => "−Z",
        }
    }

    /// The source of the statement.
    pub fn source(self) -> &'static str {
        match self {
            Self::Blender => "Cycles, direction_to_equirectangular",
            Self::Mitsuba => "src/emitters/envmap.cpp",
            Self::Pbrt => "cmd/imgtool.cpp, makeequiarea",
            Self::Usd => "Storm's dome light shader",
            Self::Gltf => "glTF-IBL-Sampler, panorama_to_cubemap.frag",
            Self::Three => "common.glsl, equirectUv",
            Self::Babylon => "panoramaToCubemap.ts; its loader of glTF negates x",
            Self::Unreal => "TextureCompressorModule.cpp; its importers exchange y and z",
            Self::Unity => "Skybox-Panoramic.shader; glTF exporters negate x",
            Self::Godot => "sky.glsl",
            Self::Bevy => "environment_map.wgsl looks cubes up with −z",
            Self::Filament => "cmgen's cubes",
            Self::PlayCanvas => "spherical.js and skybox.js of its shaders",
            Self::Radiance => "the brightness function that domelight writes",
            Self::Nvdiffrec => "render/util.py, cubemap_to_latlong",
        }
    }

    /// What the statement rests on.
    pub fn proof(self) -> Proof {
        match self {
            Self::Blender
            | Self::Mitsuba
            | Self::Three
            | Self::Babylon
            | Self::Filament
            | Self::PlayCanvas
            | Self::Radiance => Proof::Program,
            Self::Pbrt | Self::Usd => Proof::Format,
            Self::Gltf
            | Self::Unreal
            | Self::Unity
            | Self::Godot
            | Self::Bevy
            | Self::Nvdiffrec => Proof::Source,
        }
    }

    /// The program's lat-long map as domelight takes it, together with [`rotation`](Self::rotation): mirrored if the
    /// program mirrors it.
    #[must_use]
    pub fn from_program(self, map: RgbImage) -> RgbImage {
        if self.is_mirrored() { mirrored(&map) } else { map }
    }

    /// domelight's lat-long map as the program takes it: there it stands as here without a rotation.
    ///
    /// # Errors
    /// If a quarter turn does not move whole columns.
    pub fn for_program(self, map: &RgbImage) -> Result<RgbImage, Indivisible> {
        let (width, turns) = (map.width, self.quarter_turns());
        if !(turns * width).is_multiple_of(4) {
            return Err(Indivisible { width });
        }
        let shift = turns * width / 4;
        let turned =
            RgbImage::from_fn(width, map.height, |x, y| map.get((x + width - shift) % width, y));
        Ok(if self.is_mirrored() { mirrored(&turned) } else { turned })
    }
}

/// The columns in reverse.
fn mirrored(map: &RgbImage) -> RgbImage {
    RgbImage::from_fn(map.width, map.height, |x, y| map.get(map.width - 1 - x, y))
}

read_by_name!(Convention::ALL, UnknownConvention, "there is no convention");

impl fmt::Display for Convention {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A map that shows how it is oriented: the sphere in a gradient, a dot of its own color in each of 26 directions, the names of
/// the six axes as they read from inside, and a sun of one texel to the upper right of −Z. In domelight's world, +Y up.
///
/// # Panics
/// If there are no rows.
pub fn axes_map(rows: usize) -> RgbImage {
    let width = 2 * rows;
    let mut map = RgbImage::from_fn(width, rows, |x, y| {
        let uv = [(x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / rows as f32];
        let ground = 0.05 + 0.1 * (1.0 - uv[1]);
        Rgb::new(ground * (0.5 + uv[0]), ground, ground * (1.5 - uv[0]))
    });
    for (longitude, latitude) in dots() {
        let color = dot_color(longitude, latitude);
        paint(&mut map, |u, v| {
            let (x, y) = (offset(u, longitude) * functions::sin_cos(latitude).1, v - latitude);
            (x * x + y * y < 0.16 * 0.16).then_some(color)
        });
    }
    for (name, longitude, latitude) in AXES {
        // Near a pole, letters turn with the longitude; they stand where they can be read.
        paint(&mut map, |u, v| {
            let x = offset(u, longitude) / LETTER + 6.0;
            let y = (latitude - v) / LETTER + 3.5;
            is_ink(name, x, y).then_some(Rgb::WHITE)
        });
    }
    let (column, row) = ((0.59 * width as f32) as usize, (0.37 * rows as f32) as usize);
    map.pixels[row * width + column] = Rgb::splat(5000.0);
    map
}

/// The size of a dot of a letter \[radians\].
const LETTER: f32 = 0.035;

/// The axes' names, and where they stand: longitude, 0 at −Z and growing to the right, and latitude \[radians\].
const AXES: [(&str, f32, f32); 6] = [
    ("-Z", 0.0, -0.35),
    ("+X", 0.25 * TAU, -0.35),
    ("+Z", 0.5 * TAU, -0.35),
    ("-X", 0.75 * TAU, -0.35),
    ("+Y", 0.0, 1.15),
    ("-Y", 0.0, -1.15),
];

/// Longitude and latitude of the 26 directions.
fn dots() -> impl Iterator<Item = (f32, f32)> {
    let rings = [-1, 0, 1]
        .into_iter()
        .flat_map(|row| (0..8).map(move |i| (TAU * i as f32 / 8.0, TAU * row as f32 / 8.0)));
    rings.chain([(0.0, 0.25 * TAU), (0.0, -0.25 * TAU)])
}

/// A color that no other dot has.
fn dot_color(longitude: f32, latitude: f32) -> Rgb {
    let channel = |phase: f32| 0.6 + 0.5 * functions::sin_cos(longitude + phase * TAU / 3.0).1;
    let [r, g, b] = [0.0, 1.0, 2.0].map(channel);
    Rgb::new(r, g, b) * (1.0 + 0.6 * latitude)
}

/// The difference of longitudes, in (−π, π].
fn offset(longitude: f32, from: f32) -> f32 {
    let turns = (longitude - from) / TAU;
    (turns - turns.round()) * TAU
}

/// Colors texels by their longitude and latitude.
fn paint(map: &mut RgbImage, color: impl Fn(f32, f32) -> Option<Rgb>) {
    let (width, height) = (map.width, map.height);
    for (i, pixel) in map.pixels.iter_mut().enumerate() {
        let u = TAU * ((i % width) as f32 + 0.5) / width as f32 - 0.5 * TAU;
        let v = 0.25 * TAU - 0.5 * TAU * ((i / width) as f32 + 0.5) / height as f32;
        if let Some(color) = color(u, v) {
            *pixel = color;
        }
    }
}

/// Whether a point of a text, 6 dots a letter and 7 dots high, has ink.
fn is_ink(text: &str, x: f32, y: f32) -> bool {
    if x < 0.0 || !(0.0..7.0).contains(&y) {
        return false;
    }
    let (letter, column, row) = (x as usize / 6, x as usize % 6, y as usize);
    let glyph: [u8; 7] = match text.as_bytes().get(letter) {
        Some(b'+') => [0, 0b00100, 0b00100, 0b11111, 0b00100, 0b00100, 0],
        Some(b'-') => [0, 0, 0, 0b11111, 0, 0, 0],
        Some(b'X') => [0b10001, 0b10001, 0b01010, 0b00100, 0b01010, 0b10001, 0b10001],
        Some(b'Y') => [0b10001, 0b10001, 0b01010, 0b00100, 0b00100, 0b00100, 0b00100],
        Some(b'Z') => [0b11111, 0b00001, 0b00010, 0b00100, 0b01000, 0b10000, 0b11111],
        _ => [0; 7],
    };
    column < 5 && glyph[row] >> (4 - column) & 1 == 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::{Environment, Orientation, UpAxis};
    use crate::math::{Vec3, vec3};
    use testkit::Pcg;

    /// The column of a direction of a scene that came from the program, by the program's own look-up, and the scene's up
    /// axis. As glTF comes from there, Unity and Babylon.js negate x, and Unreal exchanges y and z.
    fn column(convention: Convention, d: Vec3) -> f32 {
        let Vec3 { x, y, z } = d;
        match convention {
            Convention::Blender => 0.5 - y.atan2(x) / TAU,
            Convention::Mitsuba | Convention::Godot | Convention::Filament => x.atan2(-z) / TAU,
            Convention::Pbrt => y.atan2(x) / TAU,
            Convention::Usd => 0.25 + z.atan2(x) / TAU,
            Convention::Gltf | Convention::Three => 0.5 + z.atan2(x) / TAU,
            Convention::Babylon | Convention::PlayCanvas => 0.5 + (-x).atan2(z) / TAU,
            Convention::Unity => 0.5 - z.atan2(-x) / TAU,
            Convention::Radiance => 0.5 + x.atan2(y) / TAU,
            Convention::Unreal | Convention::Bevy | Convention::Nvdiffrec => {
                0.5 + x.atan2(-z) / TAU
            }
        }
    }

    fn up(convention: Convention) -> UpAxis {
        let keeps_z_up = convention.look_up().ends_with("z up");
        if keeps_z_up { UpAxis::Z } else { UpAxis::Y }
    }

    /// A map whose columns tell themselves apart.
    fn columns(width: usize) -> RgbImage {
        RgbImage::from_fn(width, width / 2, |x, _| Rgb::splat(1.0 + x as f32))
    }

    fn directions() -> impl Iterator<Item = Vec3> {
        let mut pcg = Pcg::new(4);
        let mut number = move || 2.0 * pcg.next_f64() as f32 - 1.0;
        std::iter::repeat_with(move || vec3(number(), number(), number()).normalize())
            .filter(|d| d.is_finite() && d.x.abs() + d.z.abs() > 0.1 && d.x.abs() + d.y.abs() > 0.1)
            .take(2000)
    }

    #[test]
    fn maps_stand_as_in_the_program() {
        let width = 64;
        for convention in Convention::ALL {
            let map = convention.from_program(columns(width));
            let orientation = Orientation { up: up(convention), rotation: convention.rotation() };
            let environment = Environment::new(map, orientation, 1.0).unwrap();
            for d in directions() {
                let position = column(convention, d).rem_euclid(1.0) * width as f32;
                // The border of a column belongs to either.
                if (position - position.round()).abs() > 1e-3 {
                    let expected = 1.0 + position.floor();
                    assert_eq!(environment.le(d).r, expected, "{convention} {d}");
                }
            }
        }
    }

    #[test]
    fn maps_for_a_program_stand_there_as_here() {
        let width = 64;
        for convention in Convention::ALL {
            let orientation = Orientation { up: up(convention), rotation: 0.0 };
            let here = Environment::new(columns(width), orientation, 1.0).unwrap();
            let there = convention.for_program(&columns(width)).unwrap();
            for d in directions() {
                let position = column(convention, d).rem_euclid(1.0) * width as f32;
                if (position - position.round()).abs() > 1e-3 {
                    let seen = there.get(position as usize % width, width / 4);
                    assert_eq!(here.le(d), seen, "{convention} {d}");
                }
            }
        }
        let odd = columns(6);
        assert_eq!(Convention::Three.for_program(&odd), Err(Indivisible { width: 6 }));
        assert!(Convention::Usd.for_program(&odd).is_ok());
    }

    #[test]
    fn names_are_read_back() {
        for convention in Convention::ALL {
            assert_eq!(convention.name().parse(), Ok(convention));
            assert!(!convention.source().is_empty() && !convention.center().is_empty());
        }
        assert!("maya".parse::<Convention>().is_err());
    }

    #[test]
    fn the_map_of_axes_shows_each_axis_once() {
        let map = axes_map(128);
        assert_eq!(map.pixels.iter().filter(|p| p.r > 1000.0).count(), 1);
        let environment = Environment::from_image(map).unwrap();
        let color = |d: Vec3| environment.le(d);
        // Dots, not letters, are at the axes, and no two have one color.
        let mut colors: Vec<Rgb> = Vec::new();
        for x in [-1.0f32, 0.0, 1.0] {
            for y in [-1.0f32, 0.0, 1.0] {
                for z in [-1.0f32, 0.0, 1.0] {
                    let d = vec3(x, y * (x * x + z * z).sqrt().max(1.0), z);
                    if let Some(d) = d.try_normalize() {
                        let seen = color(d);
                        assert!(!colors.contains(&seen) && seen != Rgb::WHITE, "{d}");
                        colors.push(seen);
                    }
                }
            }
        }
        assert_eq!(colors.len(), 26);
    }
}
