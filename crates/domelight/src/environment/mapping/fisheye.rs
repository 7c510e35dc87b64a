//! The equidistant fisheye: the distance from the center of the picture is proportional to the angle. Radiance's header
//! variable VIEW describes one (`rpict -vta`; the *Radiance* reference manual, "rpict").

use crate::math::functions;

type Direction = [f64; 3];

/// A fisheye picture: the disc that touches the borders of the picture, in a frame of the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fisheye {
    /// The angle \[degrees\] that the disc spans, in \[90, 360\].
    pub angle: f64,
    /// The direction of the center.
    pub forward: Direction,
    /// The direction toward the right border.
    pub right: Direction,
    /// The direction toward the upper border.
    pub up: Direction,
}

impl Fisheye {
    /// The whole sphere with the center toward −Z and up at the top, which is an angular map.
    pub const WHOLE: Self = Self {
        angle: 360.0,
        forward: [0.0, 0.0, -1.0],
        right: [1.0, 0.0, 0.0],
        up: [0.0, 1.0, 0.0],
    };

    /// The picture that a VIEW of Radiance describes; its Z axis, which is up, is the Y axis here.
    ///
    /// # Errors
    /// A phrase for what the view is, if it is known and no fisheye that can be read.
    pub fn of_view(view: &str) -> Result<Option<Self>, String> {
        let words: Vec<&str> = view.split_ascii_whitespace().collect();
        let Some(kind) = words.iter().rev().find_map(|word| kind(word)) else { return Ok(None) };
        let vector = |name, default| values(&words, name).unwrap_or(default);
        let number =
            |name, default| values(&words, name).map_or(default, |[value]: [f64; 1]| value);
        let (across, down) = (number("-vh", 45.0), number("-vv", 45.0));
        if kind != EQUIDISTANT {
            return Err(kind.to_owned());
        }
        let whole = format!("{kind} of {across} by {down} degrees");
        if across != down || !(90.0..=360.0).contains(&across) {
            return Err(whole);
        }
        if number("-vs", 0.0) != 0.0 || number("-vl", 0.0) != 0.0 {
            return Err(format!("{whole}, shifted"));
        }
        let y_up = |[x, y, z]: Direction| [x, z, -y];
        let forward = y_up(vector("-vd", [0.0, 1.0, 0.0]));
        let right = cross(forward, y_up(vector("-vu", [0.0, 0.0, 1.0])));
        let (Some(forward), Some(right)) = (unit(forward), unit(right)) else {
            return Err(format!("{whole} without a direction"));
        };
        Ok(Some(Self { angle: across, forward, right, up: cross(right, forward) }))
    }

    /// The unit direction at a point of the disc, (right, up) ∈ \[−1, 1\]²; outside it, that of its border.
    pub(crate) fn direction(&self, [x, y]: [f64; 2]) -> Direction {
        let r = functions::hypot(x, y);
        if r == 0.0 {
            return self.forward;
        }
        let (sin, cos) = functions::sin_cos(r.min(1.0) * 0.5 * self.angle.to_radians());
        let (x, y) = (x / r * sin, y / r * sin);
        std::array::from_fn(|i| cos * self.forward[i] + x * self.right[i] + y * self.up[i])
    }
}

const EQUIDISTANT: &str = "an equidistant fisheye";

/// What an option `-vt…` says about the projection.
fn kind(word: &str) -> Option<&'static str> {
    Some(match word.strip_prefix("-vt")? {
        "a" => EQUIDISTANT,
        "h" => "an orthographic fisheye",
        "s" => "a stereographic fisheye",
        "v" => "a perspective",
        "l" => "a parallel projection",
        "c" => "a cylinder",
        _ => return None,
    })
}

/// The finite numbers after the last option `name`.
fn values<const N: usize>(words: &[&str], name: &str) -> Option<[f64; N]> {
    let at = words.iter().rposition(|&word| word == name)?;
    let numbers: Option<Vec<f64>> =
        words.get(at + 1..at + 1 + N)?.iter().map(|word| word.parse().ok()).collect();
    numbers?.try_into().ok().filter(|numbers: &[f64; N]| numbers.iter().all(|n| n.is_finite()))
}

fn cross([a, b, c]: Direction, [x, y, z]: Direction) -> Direction {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

/// None of a vector that has no direction.
fn unit(v: Direction) -> Option<Direction> {
    let length = functions::hypot(functions::hypot(v[0], v[1]), v[2]);
    (length > 1e-9 && length.is_finite()).then(|| v.map(|c| c / length))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_view_of_the_whole_sphere_is_an_angular_map() {
        let view = Fisheye::of_view("-vta -vh 360 -vv 360").unwrap().unwrap();
        assert_eq!(view, Fisheye::WHOLE);
    }

    #[test]
    fn the_view_to_the_zenith_has_north_at_the_top_and_west_on_the_right() {
        let view = Fisheye::of_view("rpict -vta -vd 0 0 1 -vu 0 1 0 -vh 180 -vv 180").unwrap();
        let view = view.unwrap();
        assert_eq!((view.forward, view.angle), ([0.0, 1.0, 0.0], 180.0));
        let is = |p, [x, y, z]: Direction| {
            let d = view.direction(p);
            assert!((d[0] - x).abs() + (d[1] - y).abs() + (d[2] - z).abs() < 1e-12, "{d:?}");
        };
        is([0.0, 1.0], [0.0, 0.0, -1.0]);
        is([1.0, 0.0], [-1.0, 0.0, 0.0]);
        is([0.0, 0.5], [0.0, 0.5_f64.sqrt(), -(0.5_f64.sqrt())]);
        is([0.0, 2.0], [0.0, 0.0, -1.0]);
    }

    #[test]
    fn other_views_are_named() {
        let doubt = |view| Fisheye::of_view(view).unwrap_err();
        assert_eq!(doubt("-vtv -vh 60 -vv 40"), "a perspective");
        assert_eq!(doubt("-vth -vh 180 -vv 180"), "an orthographic fisheye");
        assert_eq!(doubt("-vta -vh 180 -vv 90"), "an equidistant fisheye of 180 by 90 degrees");
        assert!(doubt("-vta -vh 180 -vv 180 -vs 0.5").ends_with("shifted"));
        assert!(doubt("-vta -vh 180 -vv 180 -vd 0 0 0").ends_with("without a direction"));
        // The last of several counts, and what is unknown says nothing.
        assert_eq!(Fisheye::of_view("-vtv -vta -vh 360 -vv 360").unwrap(), Some(Fisheye::WHOLE));
        assert_eq!(Fisheye::of_view("-vp 0 0 0").unwrap(), None);
    }
}
