//! Cube maps whose faces stand in another order, or turned, as other programs write them.

use std::fmt;
use std::str::FromStr;

use super::cube::Face;
use super::{CubeLayout, Mapping};
use crate::RgbImage;
use crate::math::Vec3;

/// The faces of a cube in a picture, in the reading order of its cells: rows from top to bottom, each from left to right.
///
/// The text form is six letters, each once, of the directions front (−Z), right (+X), back (+Z), left (−X), up (+Y) and
/// down (−Y), each with the degrees by which its face is turned clockwise in the picture: `F,R,B180,L,U,D90`. A face that is
/// not turned is seen from inside, the four at the sides with +Y at the top, the upper one with the front at its bottom edge,
/// the lower one with the front at its top edge.
///
/// [`CubeLayout::StripHorizontal`] has `R,L,U,D,B,F`, [`CubeLayout::CrossVertical`] `U,L,F,R,D,B180`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CubeFaces([TurnedFace; 6]);

/// A face in a cell of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct TurnedFace {
    side: Side,
    /// Quarter turns clockwise, 0 to 3.
    quarters: u8,
}

/// Where a face looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Front,
    Right,
    Back,
    Left,
    Up,
    Down,
}

/// A text that does not name the faces of a cube.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "'{text}' does not list the faces F, R, B, L, U and D, each once, with turns of 90, 180 or 270 degrees, such as \
     F,R,B180,L,U,D"
)]
pub struct UnknownFaces {
    /// The given text.
    pub text: String,
}

impl Side {
    const ALL: [Self; 6] = [Self::Front, Self::Right, Self::Back, Self::Left, Self::Up, Self::Down];

    fn letter(self) -> char {
        match self {
            Self::Front => 'F',
            Self::Right => 'R',
            Self::Back => 'B',
            Self::Left => 'L',
            Self::Up => 'U',
            Self::Down => 'D',
        }
    }

    fn forward(self) -> Vec3 {
        match self {
            Self::Front => Vec3::NEG_Z,
            Self::Right => Vec3::X,
            Self::Back => Vec3::Z,
            Self::Left => Vec3::NEG_X,
            Self::Up => Vec3::Y,
            Self::Down => Vec3::NEG_Y,
        }
    }

    /// What is at the top of the face, if it is not turned.
    fn top(self) -> Vec3 {
        match self {
            Self::Front | Self::Right | Self::Back | Self::Left => Vec3::Y,
            Self::Up => Vec3::Z,
            Self::Down => Vec3::NEG_Z,
        }
    }
}

impl TurnedFace {
    fn parse(text: &str) -> Option<Self> {
        let mut letters = text.chars();
        let letter = letters.next()?.to_ascii_uppercase();
        let side = Side::ALL.into_iter().find(|side| side.letter() == letter)?;
        let quarters = match letters.as_str() {
            "" | "0" => 0,
            "90" => 1,
            "180" => 2,
            "270" => 3,
            _ => return None,
        };
        Some(Self { side, quarters })
    }
}

impl fmt::Display for TurnedFace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.side.letter())?;
        match self.quarters {
            0 => Ok(()),
            quarters => write!(f, "{}", 90 * u32::from(quarters)),
        }
    }
}

impl fmt::Display for CubeFaces {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.0.map(|face| face.to_string()).join(","))
    }
}

impl FromStr for CubeFaces {
    type Err = UnknownFaces;

    fn from_str(text: &str) -> Result<Self, UnknownFaces> {
        let faces: Option<Vec<_>> = text.split(',').map(|t| TurnedFace::parse(t.trim())).collect();
        let faces = faces.and_then(|faces| <[TurnedFace; 6]>::try_from(faces).ok());
        let has = |faces: &[TurnedFace; 6], side| faces.iter().any(|face| face.side == side);
        faces
            .filter(|faces| Side::ALL.iter().all(|&side| has(faces, side)))
            .map(Self)
            .ok_or_else(|| UnknownFaces { text: text.to_owned() })
    }
}

impl CubeFaces {
    /// Moves the faces of a picture in this order to their places in `layout`, texel by texel. Empty cells of a cross stay.
    ///
    /// # Panics
    /// If the picture does not have the shape of the layout ([`Mapping::check_shape`]).
    pub fn arranged(&self, image: &RgbImage, layout: CubeLayout) -> RgbImage {
        let mapping = Mapping::Cube(layout);
        assert!(mapping.check_shape(image.width, image.height).is_ok(), "not a {mapping}");
        let (columns, rows) = layout.faces_across_and_down();
        let n = image.width / columns;
        let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
        let cells = cells.filter_map(|(column, row)| layout.face_at(column, row));
        let mut arranged = image.clone();
        for (of_picture, cell) in self.0.iter().zip(cells) {
            let forward = of_picture.side.forward();
            let Some(own) = layout.face_toward(forward) else { continue };
            // Clockwise from the picture's face to that of the layout.
            let quarters = 4 + quarters_of(own, of_picture.side.top()) - of_picture.quarters;
            for y in 0..n {
                for x in 0..n {
                    let (mut u, mut v) = (x, y);
                    for _ in 0..quarters % 4 {
                        (u, v) = (n - 1 - v, u);
                    }
                    let from = image.get(cell.column * n + x, cell.row * n + y);
                    let to = (own.row * n + v) * image.width + own.column * n + u;
                    arranged.pixels[to] = from;
                }
            }
        }
        arranged
    }
}

/// Quarter turns clockwise of a face of a layout whose top would be `top`, were it not turned.
fn quarters_of(face: &Face, top: Vec3) -> u8 {
    // Clockwise by a quarter, what was at the top is at the right.
    match [face.up, face.right, -face.up].iter().position(|&edge| edge == top) {
        Some(quarters) => quarters as u8,
        None => 3,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rgb;
    use crate::environment::mapping::from_lat_long;
    use crate::math::vec2;

    /// A map that differs in every direction.
    fn probe() -> RgbImage {
        RgbImage::from_fn(64, 32, |x, y| Rgb::new(x as f32, y as f32, (x * y % 7) as f32))
    }

    fn layout(layout: CubeLayout) -> RgbImage {
        let (columns, rows) = layout.faces_across_and_down();
        from_lat_long(&probe(), Mapping::Cube(layout), (8 * columns, 8 * rows))
    }

    #[test]
    fn layouts_are_orders_of_faces() {
        let strip = layout(CubeLayout::StripHorizontal);
        for (of, faces) in [
            (CubeLayout::StripHorizontal, "R,L,U,D,B,F"),
            (CubeLayout::StripVertical, "R,L,U,D,B,F"),
            (CubeLayout::CrossHorizontal, "U,L,F,R,B,D"),
            (CubeLayout::CrossVertical, "U,L,F,R,D,B180"),
        ] {
            let own: CubeFaces = faces.parse().unwrap();
            assert_eq!(own.to_string(), faces);
            let picture = layout(of);
            assert_eq!(own.arranged(&picture, of), picture, "{faces}");
        }
        // Another order, and back.
        let other: CubeFaces = "F,R,B,L,U,D".parse().unwrap();
        assert_ne!(other.arranged(&strip, CubeLayout::StripHorizontal), strip);
    }

    /// A strip of front, right, back, left, up and down, the latter two turned: texels are moved to their directions.
    #[test]
    fn faces_are_moved_and_turned() {
        let of = CubeLayout::StripHorizontal;
        let n = 8;
        for (text, turns) in
            [("F,R,B,L,U,D", [0; 6]), ("F90,R180,B270,L,U90,D270", [1, 2, 3, 0, 1, 3])]
        {
            let faces: CubeFaces = text.parse().unwrap();
            // The direction's x, y and z of every texel, written as such a program would.
            let picture = RgbImage::from_fn(6 * n, n, |x, y| {
                let (k, mut u, mut v) = (x / n, x % n, y);
                for _ in 0..(4 - turns[k]) % 4 {
                    (u, v) = (n - 1 - v, u);
                }
                let side = faces.0[k].side;
                let (forward, top) = (side.forward(), side.top());
                let s = (2.0 * u as f32 + 1.0) / n as f32 - 1.0;
                let t = 1.0 - (2.0 * v as f32 + 1.0) / n as f32;
                let d = (forward + s * forward.cross(top) + t * top).normalize();
                Rgb::from(d.to_array())
            });
            let arranged = faces.arranged(&picture, of);
            for y in 0..n {
                for x in 0..6 * n {
                    let uv = vec2((x as f32 + 0.5) / (6 * n) as f32, (y as f32 + 0.5) / n as f32);
                    let direction = Mapping::Cube(of).direction(uv).unwrap();
                    let found = Vec3::from(arranged.get(x, y).to_array());
                    assert!(
                        found.distance(direction) < 1e-5,
                        "{text} {x} {y}: {found} {direction}"
                    );
                }
            }
        }
    }

    #[test]
    fn lists_that_are_none_are_refused() {
        for text in
            ["", "F,R,B,L,U", "F,R,B,L,U,U", "F,R,B,L,U,D45", "F,R,B,L,U,D,F", "F,R,B,L,U,X"]
        {
            let error = text.parse::<CubeFaces>().unwrap_err().to_string();
            assert!(error.contains("F,R,B180,L,U,D"), "{error}");
        }
        assert_eq!("f, r0, b, l, u, d".parse::<CubeFaces>().unwrap().to_string(), "F,R,B,L,U,D");
    }
}
