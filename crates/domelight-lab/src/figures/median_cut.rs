//! Figure 6: median cut: its regions and lights, and renders with them.

use crate::Error;
use domelight::picture::tone::ToneMapping;
use domelight::quote::Code;
use domelight::rig::{LightPosition, MedianCut, Rig, ShadingReference, median_cut};
use domelight::strategy::StrategySpec;

use super::context::{FigureContext, FigureMeasurement, FigureScene, Subject};
use super::figure::{Figure, Picture, Radiance, Row, Table, number, picture_panel, png_bytes};
use super::formulas;
use super::maps::{black_panel, borders, map_panel, mark, on_map, shown_color};
use crate::svg::{Document, Pixels, Rect, Style};

/// The lecture's region counts.
const REGIONS: [usize; 6] = [1, 2, 4, 16, 64, 256];
/// Light counts of the renders.
const LIGHTS: [usize; 5] = [2, 4, 16, 64, 256];
/// The whole map.
pub(super) const WHOLE: Rect = Rect { x: 0.0, y: 0.0, width: 1.0, height: 1.0 };

pub(crate) fn make(context: &FigureContext) -> Result<Figure, Error> {
    let rig = |n| median_cut(&context.environment, n, MedianCut::default());
    let mut maps = Vec::new();
    for n in REGIONS {
        let title = if n == 1 { "1 region".to_owned() } else { format!("{n} regions") };
        maps.push(regions_panel(context, &rig(n)?, &title)?);
    }
    let rows_of_maps = [maps.split_off(3), maps];
    let [late, early] = rows_of_maps;

    let mut table = Table::new(&[
        "lights",
        "relMSE, scene",
        "relMSE, sphere",
        "RMS error [%], matte",
        "of geometric centers [%]",
    ]);
    let (scene, sphere) = (full_scene(context)?, sphere_scene(context)?);
    let shading = ShadingReference::new(&context.environment);
    let mut rows = [Vec::new(), Vec::new()];
    let mut pictures = Vec::new();
    for n in LIGHTS {
        let mut cells = vec![n.into()];
        for (row, (figure_scene, name)) in
            rows.iter_mut().zip([(&scene, "scene"), (&sphere, "sphere")])
        {
            let spec = StrategySpec::MedianCut { n_lights: n as u32 };
            let measured = figure_scene.measure(spec)?;
            cells.push(measured.rel_mse.into());
            row.push(lit_panel(&format!("{n} lights"), &measured, figure_scene.tone()?)?);
            let image = measured.render.layers.color;
            pictures.push(Radiance {
                name: format!("{name}-{n}-lights"),
                image,
                tone: figure_scene.tone()?,
            });
        }
        let center = MedianCut { position: LightPosition::GeometricCenter, ..MedianCut::default() };
        let center = median_cut(&context.environment, n, center)?;
        cells.extend([&rig(n)?, &center].map(|rig| (100.0 * shading.error(rig).diffuse).into()));
        table.rows.push(cells);
    }
    let [mut scene_row, mut sphere_row] = rows;
    for (row, (figure_scene, name)) in
        [(&mut scene_row, (&scene, "scene")), (&mut sphere_row, (&sphere, "sphere"))]
    {
        row.push(converged_panel(figure_scene)?);
        let image =
            figure_scene.reference(context.seed, figure_scene.settings.sampler)?.color.clone();
        pictures.push(Radiance {
            name: format!("{name}-converged"),
            image,
            tone: figure_scene.tone()?,
        });
    }
    let lights = lights_panel(context, &rig(256)?, "Color and energy of 256 lights")?;
    let on_the_map = map_panel(context, "256 lights on the map", &[], |sheet, r| {
        for light in &rig(256).map(|r| r.lights).unwrap_or_default() {
            mark(sheet, on_map(context, r, light.direction));
        }
    })?;
    Ok(Figure {
        number: 6,
        title: "Median cut",
        slides: "slides 31–41",
        caption: Code::literal(
            "<p>The map starts as one region. Each round cuts every region across its longer side (with widths scaled \
            by sin θ) into halves of equal energy; after n rounds each of the 2<sup>n</sup> regions becomes a light \
            with the region's energy. The light sits at the centroid of that <em>energy</em> (blue). At the center of \
            the rectangle instead, errors are several times as large, as the table shows (RMS error of unoccluded \
            matte shading over all normals).</p>\
            <p>Fixed lights have bias instead of noise: shadows become sums of hard shadows, and narrow lobes would \
            show separate lights. The bias falls as lights are added.</p>",
        ),
        formulas: vec![formulas::region_light()],
        rows: vec![
            Row::new("", early),
            Row::new("", late),
            Row::new("The lights", vec![on_the_map, lights]),
            Row::new("The scene under the lights", scene_row),
            Row::new("A matte sphere", sphere_row),
        ],
        tables: vec![table],
        pictures,
    })
}

/// The whole scene, in the view that both figures of fixed lights share.
pub(super) fn full_scene<'a>(context: &'a FigureContext) -> Result<FigureScene<'a>, Error> {
    let size = context.choose(220, 24);
    Ok(context.scene(Subject::Scene, size, size)?.samples(context.choose(2, 1)))
}

/// A matte sphere.
pub(super) fn sphere_scene<'a>(context: &'a FigureContext) -> Result<FigureScene<'a>, Error> {
    let size = context.choose(220, 24);
    Ok(context.scene(Subject::Sphere, size, size)?.samples(context.choose(2, 1)))
}

/// The map with region borders in white and lights in blue.
pub(super) fn regions_panel(
    context: &FigureContext,
    rig: &Rig,
    title: &str,
) -> Result<Document, Error> {
    map_panel(context, title, &[], |sheet, r| {
        borders(sheet, r, rig, WHOLE);
        for light in &rig.lights {
            mark(sheet, on_map(context, r, light.direction));
        }
    })
}

/// The lights alone: discs in their colors, with areas proportional to energy.
fn lights_panel(context: &FigureContext, rig: &Rig, title: &str) -> Result<Document, Error> {
    let total = rig.lights.len() as f64;
    black_panel(context, title, &[], |sheet, r| {
        for light in &rig.lights {
            let radius = 3.0 * (f64::from(light.share) * total).sqrt().clamp(0.3, 4.0);
            let color = shown_color(light.irradiance / light.irradiance.max_component());
            sheet.circle(on_map(context, r, light.direction), radius, Style::fill(color));
        }
    })
}

/// A render with fixed lights, and its error.
pub(super) fn lit_panel(
    title: &str,
    measured: &FigureMeasurement,
    tone: ToneMapping,
) -> Result<Document, Error> {
    let notes = [format!("relMSE {}", number(measured.rel_mse))];
    square_panel(title, &measured.render.layers.color, tone, &notes)
}

/// The converged picture.
pub(super) fn converged_panel(figure_scene: &FigureScene) -> Result<Document, Error> {
    let reference =
        figure_scene.reference(figure_scene.settings.seed, figure_scene.settings.sampler)?;
    square_panel("Converged", &reference.color, figure_scene.tone()?, &[])
}

fn square_panel(
    title: &str,
    image: &domelight::RgbImage,
    tone: ToneMapping,
    notes: &[String],
) -> Result<Document, Error> {
    // At the file's scale, one pixel stays one pixel.
    const SIZE: f64 = 220.0;
    let png = png_bytes(image, tone)?;
    let picture = Picture { png, width: SIZE, height: SIZE, pixels: Pixels::Smooth, title, notes };
    Ok(picture_panel(&picture, |_, _| {}))
}
