//! Why the scene of a picture is black, or not in it.

use domelight::Rgb;
use domelight::render::Layers;

/// The share of the unoccluded light below which a scene counts as black.
const BLACK: f64 = 1e-6;

/// Says why all that the scene covers is black, or that it covers nothing; `None` if it is seen.
pub fn reason(layers: &Layers) -> Option<&'static str> {
    // Pixels that the scene covers in part show the background, too.
    let is_covered = |&i: &usize| layers.n_hits[i] > 0 && layers.n_hits[i] == layers.n_samples[i];
    if layers.n_hits.iter().all(|&n| n == 0) {
        return Some(
            "the camera sees nothing of the model, which may be flat or beside the picture; try --view three-quarter",
        );
    }
    let covered: Vec<usize> = (0..layers.n_hits.len()).filter(is_covered).collect();
    let sum =
        |pixels: &[Rgb]| -> f64 { covered.iter().map(|&i| f64::from(pixels[i].luminance())).sum() };
    let [light, unoccluded, albedo] =
        [&layers.color, &layers.unoccluded, &layers.albedo].map(|layer| sum(&layer.pixels));
    if covered.is_empty() || light > BLACK * unoccluded {
        return None;
    }
    Some(if albedo == 0.0 {
        "the model is black: its materials reflect nothing; try --material diffuse:0.5"
    } else if unoccluded > 0.0 {
        "the model is black: something keeps all light from what the camera sees, such as a mesh that encloses it"
    } else {
        "the model is black: no light comes from the side that its faces turn to the camera"
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_reason_is_told_apart() {
        let layers = |color: f32, unoccluded: f32, albedo: f32| {
            let mut layers = Layers::new(2, 1);
            (layers.n_hits[1], layers.n_samples) = (4, vec![4, 4]);
            layers.color.pixels = vec![Rgb::WHITE, Rgb::splat(color)];
            layers.unoccluded.pixels = vec![Rgb::WHITE, Rgb::splat(unoccluded)];
            layers.albedo.pixels = vec![Rgb::BLACK, Rgb::splat(albedo)];
            layers
        };
        assert_eq!(reason(&layers(0.5, 0.5, 0.5)), None);
        assert!(reason(&Layers::new(2, 1)).unwrap().contains("--view"));
        assert!(reason(&layers(0.0, 0.0, 0.0)).unwrap().contains("materials"));
        assert!(reason(&layers(0.0, 1.0, 0.5)).unwrap().contains("encloses"));
        assert!(reason(&layers(0.0, 0.0, 0.5)).unwrap().contains("side"));
    }
}
