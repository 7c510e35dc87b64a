//! Why the scene of a picture is black, or not in it.

use domelight::Rgb;
use domelight::render::Layers;

/// The share of the unoccluded light below which a scene counts as black.
const BLACK: f64 = 1e-6;

/// Says that the scene covers nothing of a whole picture; `None` if it does.
pub fn unseen(layers: &Layers) -> Option<&'static str> {
    let is_unseen = layers.n_hits.iter().all(|&n| n == 0);
    is_unseen.then_some(
        "the camera sees nothing of the model, which may be flat or out of view; try --view three-quarter",
    )
}

/// Says why all that the scene covers is black; `None` if it is not, or covers nothing.
pub fn reason(layers: &Layers) -> Option<&'static str> {
    // Pixels that the scene covers in part show the background, too.
    let is_covered = |&i: &usize| layers.n_hits[i] > 0 && layers.n_hits[i] == layers.n_samples[i];
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
        assert_eq!(reason(&Layers::new(2, 1)), None);
        assert!(unseen(&Layers::new(2, 1)).unwrap().contains("--view"));
        assert_eq!(unseen(&layers(0.0, 0.0, 0.0)), None);
        assert!(reason(&layers(0.0, 0.0, 0.0)).unwrap().contains("materials"));
        assert!(reason(&layers(0.0, 1.0, 0.5)).unwrap().contains("encloses"));
        assert!(reason(&layers(0.0, 0.0, 0.5)).unwrap().contains("side"));
    }
}
