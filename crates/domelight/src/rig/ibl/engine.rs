//! How engines look up prefiltered light.
//!
//! Read in the engines' sources; docs/ibl.md says what of it was proved.

use super::axes::CubeAxes;
use super::brdf::TableTerms;
use crate::environment::convention::Convention;
use crate::math::{Vec3, functions};
use crate::names::read_by_name;

/// An engine that prefiltered light is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Engine {
    /// three.js.
    Three,
    /// Google's Filament.
    Filament,
    /// Babylon.js.
    Babylon,
    /// Godot 4.
    Godot,
    /// Bevy.
    Bevy,
    /// Unreal Engine 5.
    Unreal,
    /// PlayCanvas.
    PlayCanvas,
}

/// The levels below which Filament's tool does not go: 16 columns.
const FILAMENT_SMALLEST: usize = 16;

/// `lodGenerationScale` of Babylon.js: levels per octave of α.
pub(crate) const BABYLON_SCALE: f32 = 0.8;

/// `REFLECTION_CAPTURE_ROUGHNESS_MIP_SCALE` of Unreal: levels per octave of r.
const UNREAL_SCALE: f32 = 1.2;

/// The roughness of levels 0 to `last`: of a mirror, then `rough`, up to 1.
fn with_mirror(last: u32, rough: impl Fn(u32) -> f32) -> Vec<f32> {
    (0..=last).map(|level| if level == 0 { 0.0 } else { rough(level).min(1.0) }).collect()
}

/// A full chain of levels down to a single texel, with the roughness level / (levels − 1).
pub(super) fn linear_roughness(size: usize) -> Vec<f32> {
    let last = size.max(1).ilog2();
    (0..=last).map(|level| level as f32 / last.max(1) as f32).collect()
}

impl Engine {
    /// All engines.
    pub const ALL: [Self; 7] = [
        Self::Three,
        Self::Filament,
        Self::Babylon,
        Self::Godot,
        Self::Bevy,
        Self::Unreal,
        Self::PlayCanvas,
    ];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Three => "three",
            Self::Filament => "filament",
            Self::Babylon => "babylon",
            Self::Godot => "godot",
            Self::Bevy => "bevy",
            Self::Unreal => "unreal",
            Self::PlayCanvas => "playcanvas",
        }
    }

    /// The engine whose panoramas have this convention; `None` for programs for which no cubes are written.
    pub const fn of_convention(convention: Convention) -> Option<Self> {
        match convention {
            Convention::Three => Some(Self::Three),
            Convention::Filament => Some(Self::Filament),
            Convention::Babylon => Some(Self::Babylon),
            Convention::Godot => Some(Self::Godot),
            Convention::Bevy => Some(Self::Bevy),
            Convention::Unreal => Some(Self::Unreal),
            Convention::PlayCanvas => Some(Self::PlayCanvas),
            Convention::Blender
            | Convention::Mitsuba
            | Convention::Pbrt
            | Convention::Usd
            | Convention::Gltf
            | Convention::Unity
            | Convention::Radiance
            | Convention::Nvdiffrec => None,
        }
    }

    /// How a cube stands in the world so that the engine shows the map as it shows a panorama that it loads itself: with
    /// the center column in the engine's own direction, and not mirrored.
    pub const fn axes(self) -> CubeAxes {
        let world = match self {
            // The center of a panorama is +X, its right half +Z; cubes are looked up with −x (`flipEnvMap`).
            Self::Three => [Vec3::Z, Vec3::Y, Vec3::X],
            // The center is +Z, its right half −X; cubes are looked up with the world direction.
            Self::Filament | Self::Godot => [Vec3::NEG_X, Vec3::Y, Vec3::NEG_Z],
            // Babylon's world is left-handed; the center is +Z, its right half +X. In Bevy, panoramas face the camera's
            // −Z, and cubes are looked up with −z. In PlayCanvas, the center is +Z, and cubes are looked up with −x.
            Self::Babylon | Self::Bevy | Self::PlayCanvas => [Vec3::X, Vec3::Y, Vec3::NEG_Z],
            // The world is left-handed with +Z up; the center is −Y, its right half +X.
            Self::Unreal => [Vec3::X, Vec3::Z, Vec3::Y],
        };
        CubeAxes { world }
    }

    /// The perceptual roughness of each level of a cube whose faces have `size` columns: level 0 is a mirror.
    pub fn roughness(self, size: usize) -> Vec<f32> {
        let last = size.max(1).ilog2();
        match self {
            Self::Three | Self::Godot | Self::Bevy | Self::PlayCanvas => linear_roughness(size),
            // The shader looks up level r (2 − r) · last.
            Self::Filament => {
                let last = (size / FILAMENT_SMALLEST).max(1).ilog2();
                let level = |level: u32| 1.0 - (1.0 - level as f32 / last.max(1) as f32).sqrt();
                (0..=last).map(level).collect()
            }
            // The shader looks up level 0.8 log2(size · α).
            Self::Babylon => {
                let alpha =
                    |level: u32| functions::exp2(level as f32 / BABYLON_SCALE) / size as f32;
                with_mirror(last, |level| alpha(level).sqrt())
            }
            // The shader looks up level last − 1 + 1.2 log2 r.
            Self::Unreal => {
                let from_rough = |level: u32| level as f32 + 1.0 - last as f32;
                with_mirror(last, |level| functions::exp2(from_rough(level) / UNREAL_SCALE))
            }
        }
    }

    /// What an engine's table of the BRDF holds; without an engine, A and B.
    pub const fn terms(engine: Option<Self>) -> TableTerms {
        match engine {
            Some(engine) => engine.table(),
            None => TableTerms::ScaleAndBias,
        }
    }

    /// What the engine's table of the BRDF holds.
    pub const fn table(self) -> TableTerms {
        match self {
            Self::Three | Self::Godot | Self::Bevy | Self::Unreal | Self::PlayCanvas => {
                TableTerms::ScaleAndBias
            }
            Self::Filament => TableTerms::BiasAndTotalUpward,
            Self::Babylon => TableTerms::BiasAndTotal,
        }
    }
}

read_by_name!(Engine::ALL, UnknownEngine, "unknown engine");

#[cfg(test)]
mod tests {
    use super::*;

    /// Right-handed engines that look up −x or −z have mirrored cubes; the others have turned ones.
    #[test]
    fn cubes_are_mirrored_where_the_engine_mirrors_them() {
        for engine in Engine::ALL {
            let [x, y, z] = engine.axes().world;
            let handedness = x.cross(y).dot(z);
            let expected = match engine {
                Engine::Filament | Engine::Godot => 1.0,
                Engine::Three
                | Engine::Babylon
                | Engine::Bevy
                | Engine::Unreal
                | Engine::PlayCanvas => -1.0,
            };
            assert_eq!(handedness, expected, "{}", engine.name());
            assert_eq!(engine.name().parse(), Ok(engine));
            let convention = engine.name().parse().unwrap();
            assert_eq!(Engine::of_convention(convention), Some(engine));
        }
    }

    #[test]
    fn levels_grow_rougher() {
        for engine in Engine::ALL {
            for size in [1, 2, 16, 48, 256, 1024] {
                let roughness = engine.roughness(size);
                assert_eq!(roughness[0], 0.0);
                assert!(roughness.len() <= size.ilog2() as usize + 1);
                assert!(roughness.windows(2).all(|pair| pair[0] < pair[1] || pair[0] == 1.0));
                assert!(roughness.iter().all(|r| (0.0..=1.0).contains(r)));
            }
        }
        assert_eq!(Engine::Filament.roughness(256).len(), 5);
    }
}
