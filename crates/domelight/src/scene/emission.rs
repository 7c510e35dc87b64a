//! Emission and unlit colors, which the camera sees but which light nothing else.

use super::Scene;
use super::corners::Corners;
use crate::Rgb;
use crate::geometry::Hit;

impl Scene {
    /// The radiance ≥ 0 that the surface at a hit sends to the camera, independent of the light on it.
    #[inline]
    pub fn emitted(&self, hit: &Hit) -> Rgb {
        if self.emits { self.emitted_there(hit) } else { Rgb::BLACK }
    }

    /// [`Scene::emitted`] where some surface emits.
    fn emitted_there(&self, hit: &Hit) -> Rgb {
        let (part, triangle) = self.locate(hit.triangle);
        let material = &self.materials[part.material];
        let corners = || Corners::new(&part.mesh, triangle, hit);
        if material.unlit {
            let corners = corners();
            let tint = corners.mix(&part.mesh.colors).unwrap_or(Rgb::WHITE);
            return material.color(&self.textures, &corners.uvs(&part.mesh), tint);
        }
        material.emission.as_ref().map_or(Rgb::BLACK, |emission| match &emission.texture {
            Some(texture) => {
                emission.radiance * texture.at(&self.textures, &corners().uvs(&part.mesh))
            }
            None => emission.radiance,
        })
    }
}
