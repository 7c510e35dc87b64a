//! Figure 6: median cut, its regions and lights, and what they shade.

use anyhow::Result;
use domelight::picture::tone::ToneMapping;
use domelight::quote::Code;
use domelight::rig::{LightPosition, MedianCut, Rig, ShadingReference, median_cut};
use domelight::strategy::StrategySpec;

use super::figure::{Figure, Picture, Radiance, Row, Table, number, picture_panel, png_bytes};
use super::formulas;
use super::maps::{black_panel, borders, map_panel, mark, on_map, shown_color};
use super::studio::{Measured, Shot, Studio, Subject};
use crate::svg::{Document, Pixels, Rect, Style};

/// The lecture's numbers of regions.
const REGIONS: [usize; 6] = [1, 2, 4, 16, 64, 256];
/// Lights of the renders.
const LIGHTS: [usize; 5] = [2, 4, 16, 64, 256];
/// All of the map.
pub(super) const WHOLE: Rect = Rect { x: 0.0, y: 0.0, width: 1.0, height: 1.0 };

pub(crate) fn make(studio: &Studio) -> Result<Figure> {
    let rig = |n| median_cut(&studio.environment, n, MedianCut::default());
    let mut maps = Vec::new();
    for n in REGIONS {
        let title = if n == 1 { "1 region".to_owned() } else { format!("{n} regions") };
        maps.push(regions_panel(studio, &rig(n)?, &title)?);
    }
    let rows_of_maps = [maps.split_off(3), maps];
    let [late, early] = rows_of_maps;

    let mut table = Table::new(&[
        "lights",
        "relMSE, scene",
        "relMSE, sphere",
        "RMS error [%], matt",
        "of geometric centres [%]",
    ]);
    let (scene, sphere) = (scene_shot(studio)?, sphere_shot(studio)?);
    let shading = ShadingReference::new(&studio.environment);
    let mut rows = [Vec::new(), Vec::new()];
    let mut pictures = Vec::new();
    for n in LIGHTS {
        let mut cells = vec![n.into()];
        for (row, (shot, name)) in rows.iter_mut().zip([(&scene, "scene"), (&sphere, "sphere")]) {
            let plan = StrategySpec::MedianCut { n_lights: n as u32 };
            let measured = shot.measure(plan)?;
            cells.push(measured.rel_mse.into());
            row.push(lit_panel(&format!("{n} lights"), &measured, shot.tone()?)?);
            let image = measured.taken.layers.color;
            pictures.push(Radiance {
                name: format!("{name}-{n}-lights"),
                image,
                tone: shot.tone()?,
            });
        }
        let centre = MedianCut { position: LightPosition::GeometricCentre, ..MedianCut::default() };
        let centre = median_cut(&studio.environment, n, centre)?;
        cells.extend([&rig(n)?, &centre].map(|rig| (100.0 * shading.error(rig).diffuse).into()));
        table.rows.push(cells);
    }
    let [mut scene_row, mut sphere_row] = rows;
    for (row, (shot, name)) in
        [(&mut scene_row, (&scene, "scene")), (&mut sphere_row, (&sphere, "sphere"))]
    {
        row.push(converged_panel(shot)?);
        let image = shot.reference(studio.seed, shot.settings.sampler)?.color.clone();
        pictures.push(Radiance { name: format!("{name}-converged"), image, tone: shot.tone()? });
    }
    let lights = lights_panel(studio, &rig(256)?, "256 lights, their colour and energy")?;
    let on_the_map = map_panel(studio, "256 lights on the map", &[], |sheet, r| {
        for light in &rig(256).map(|r| r.lights).unwrap_or_default() {
            mark(sheet, on_map(studio, r, light.direction));
        }
    })?;
    Ok(Figure {
        number: 6,
        title: "Median cut",
        slides: "slides 31–41",
        caption: Code::literal(
            "<p>The map is one region; each region is cut along its longer side, its width scaled by \
            sin θ, so that both halves have the same energy; after n rounds each of 2<sup>n</sup> regions \
            becomes a light with the region's energy. It stands at the centroid of that <em>energy</em> (blue); at the \
            middle of the rectangle instead, errors are several times as large, as the table shows: RMS error of \
            unoccluded matt shading over all normals.</p><p>Fixed lights have no noise but bias: shadows are \
            sums of hard ones, and narrow lobes would see separate lights. The bias falls as lights are added.</p>",
        ),
        formulas: vec![formulas::region_light()],
        rows: vec![
            Row::new("", early),
            Row::new("", late),
            Row::new("The lights", vec![on_the_map, lights]),
            Row::new("The scene, lit by them", scene_row),
            Row::new("A matt sphere", sphere_row),
        ],
        tables: vec![table],
        has_data: false,
        pictures,
    })
}

/// The scene as it is, in a picture that both figures of fixed lights share.
pub(super) fn scene_shot(studio: &Studio) -> Result<Shot<'_>> {
    let size = studio.choose(220, 24);
    Ok(studio.shot(Subject::Scene, size, size)?.samples(studio.choose(2, 1)))
}

/// A matt sphere.
pub(super) fn sphere_shot(studio: &Studio) -> Result<Shot<'_>> {
    let size = studio.choose(220, 24);
    Ok(studio.shot(Subject::Sphere, size, size)?.samples(studio.choose(2, 1)))
}

/// The map, the borders of regions in white and their lights in blue.
pub(super) fn regions_panel(studio: &Studio, rig: &Rig, title: &str) -> Result<Document> {
    map_panel(studio, title, &[], |sheet, r| {
        borders(sheet, r, rig, WHOLE);
        for light in &rig.lights {
            mark(sheet, on_map(studio, r, light.direction));
        }
    })
}

/// The lights alone: discs in their colours, their area in proportion to their energy.
fn lights_panel(studio: &Studio, rig: &Rig, title: &str) -> Result<Document> {
    let total = rig.lights.len() as f64;
    black_panel(studio, title, &[], |sheet, r| {
        for light in &rig.lights {
            let radius = 3.0 * (f64::from(light.share) * total).sqrt().clamp(0.3, 4.0);
            let color = shown_color(light.irradiance / light.irradiance.max_component());
            sheet.circle(on_map(studio, r, light.direction), radius, Style::fill(color));
        }
    })
}

/// A picture that fixed lights made, and its error.
pub(super) fn lit_panel(title: &str, measured: &Measured, tone: ToneMapping) -> Result<Document> {
    let notes = [format!("relMSE {}", number(measured.rel_mse))];
    square_panel(title, &measured.taken.layers.color, tone, &notes)
}

/// The converged picture.
pub(super) fn converged_panel(shot: &Shot) -> Result<Document> {
    let reference = shot.reference(shot.settings.seed, shot.settings.sampler)?;
    square_panel("Converged", &reference.color, shot.tone()?, &[])
}

fn square_panel(
    title: &str,
    image: &domelight::RgbImage,
    tone: ToneMapping,
    notes: &[String],
) -> Result<Document> {
    // At the scale of the file a pixel is a pixel.
    const SIZE: f64 = 220.0;
    let png = png_bytes(image, tone)?;
    let picture = Picture { png, width: SIZE, height: SIZE, pixels: Pixels::Smooth, title, notes };
    Ok(picture_panel(&picture, |_, _| {}))
}
