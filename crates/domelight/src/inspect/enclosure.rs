//! Surfaces that see little of the map, as in rooms.

use std::fmt;

use super::Hemisphere;

/// A surface of which other surfaces hide most of the map. It displays as a sentence that says what to do.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "io", derive(serde::Serialize))]
pub struct Enclosure {
    /// The fraction of the directions above the surface that are unoccluded, in [0, 1].
    pub open: f64,
    /// Whether the scene names portals.
    pub has_portals: bool,
    /// The number of portals that renders find because the scene names none.
    pub found_portals: usize,
}

impl Enclosure {
    /// `None` for a surface that sees a good part of the map.
    pub(super) fn of(
        hemisphere: &Hemisphere,
        has_portals: bool,
        found_portals: usize,
    ) -> Option<Self> {
        /// The fraction of the hemisphere below which a surface is in a room.
        const ROOM: f64 = 0.1;
        let seen: f64 = hemisphere.visibility.iter().map(|&v| f64::from(v)).sum();
        // The maps' disk covers π/4 of their square.
        let all = std::f64::consts::FRAC_PI_4 * hemisphere.visibility.len() as f64;
        let open = (seen / all).min(1.0);
        (open < ROOM).then_some(Self { open, has_portals, found_portals })
    }
}

impl fmt::Display for Enclosure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [hidden, open] = [1.0 - self.open, 0.5 * self.open].map(super::advice::percent);
        write!(f, "{hidden} of the directions above this surface end at other surfaces")?;
        if self.open == 0.0 {
            return Ok(());
        }
        write!(f, "; what is open holds {open} of the sphere")?;
        match self.found_portals {
            _ if self.has_portals => Ok(()),
            0 => f.write_str(": name it as a portal, and product needs far fewer rays"),
            1 => f.write_str(", through a window that product looks through first"),
            n => write!(f, ", through {n} windows that product looks through first"),
        }
    }
}
