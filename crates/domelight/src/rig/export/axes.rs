//! The axes of other programs.

use super::RigExport;
use crate::environment::{Orientation, UpAxis};
use crate::math::Mat3;

/// How a rig stands in a world whose up axis the target dictates.
///
/// A rig of a world with the other axis up is turned such that up stays up and front stays front:
/// Y-up (x, y, z) is Z-up (x, −z, y).
pub(super) struct Axes {
    /// From the rig's world to the target's.
    pub(super) world: Mat3,
    /// From the dome map's own frame (+Y up, the center column toward −Z) to the target's world.
    pub(super) dome: Mat3,
}

impl Axes {
    /// For a target in which `up` is up.
    pub(super) fn with_up(rig: &RigExport, up: UpAxis) -> Self {
        let Orientation { up: from, rotation } = rig.orientation;
        Self {
            world: up.from_y_up() * from.from_y_up().transpose(),
            dome: Orientation { up, rotation }.map_to_world(),
        }
    }

    /// For a target that has no up axis of its own: the rig's world as it is.
    pub(super) fn of_world(rig: &RigExport) -> Self {
        Self::with_up(rig, rig.orientation.up)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests_support::with_example;
    use super::*;
    use crate::math::vec3;

    #[test]
    fn up_stays_up_and_front_stays_front() {
        with_example(|rig| {
            let z_up = Axes::with_up(rig, UpAxis::Z);
            assert_eq!(z_up.world * vec3(1.0, 2.0, 3.0), vec3(1.0, -3.0, 2.0));
            let orientation = Orientation { up: UpAxis::Z, ..rig.orientation };
            let y_up = Axes::with_up(&RigExport { orientation, ..*rig }, UpAxis::Y);
            assert_eq!(y_up.world * vec3(1.0, 2.0, 3.0), vec3(1.0, 3.0, -2.0));
            assert_eq!(Axes::of_world(rig).world, Mat3::IDENTITY);
        });
    }

    /// The dome stands to the lights in the target as it does in the rig's world.
    #[test]
    fn the_dome_turns_with_the_lights() {
        with_example(|rig| {
            let here = rig.orientation.map_to_world();
            for up in [UpAxis::Y, UpAxis::Z] {
                let axes = Axes::with_up(rig, up);
                assert!(axes.dome.abs_diff_eq(axes.world * here, 1e-6));
            }
        });
    }
}
