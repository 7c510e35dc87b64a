//! Figure 14: median cut, step by step: the cuts of each round, and the mean radiance of the cells.

use domelight::picture::exposure::Exposure;
use domelight::picture::tone::ToneMapping;
use domelight::quote::Code;
use domelight::rig::{MedianCut, Rig, median_cut};
use domelight::{Rgb, RgbImage};

use super::context::FigureContext;
use super::figure::{Figure, Row, Table, number, png_bytes};
use super::formulas;
use super::maps::{borders_in, image_panel, map_panel, mark, on_map};
use super::median_cut::WHOLE;
use crate::Error;
use crate::svg::{Color, Document, PALETTE};

/// Rounds of cuts.
const ROUNDS: u32 = 6;

pub(crate) fn make(context: &FigureContext) -> Result<Figure, Error> {
    let rigs: Vec<Rig> = (0..=ROUNDS)
        .map(|round| median_cut(&context.environment, 1 << round, MedianCut::default()))
        .collect::<Result<_, _>>()?;
    let mut table = Table::new(&[
        "round",
        "regions",
        "smallest share of the energy [%]",
        "largest share [%]",
        "smallest solid angle [sr]",
        "largest solid angle [sr]",
    ]);
    // The mean of the map becomes middle gray.
    let tone = ToneMapping {
        exposure: Exposure::Auto.stops(&cells_picture(context, &rigs[0]), None),
        ..context.map_tone()
    };
    let (mut cuts, mut cells) = (Vec::new(), Vec::new());
    for (round, pair) in rigs.windows(2).enumerate() {
        let (before, after) = (&pair[0], &pair[1]);
        cuts.push(cuts_panel(context, before, after, round + 1)?);
        let png = png_bytes(&cells_picture(context, after), tone)?;
        cells.push(image_panel(context, png, &format!("{} cells", after.lights.len())));
        let range = |value: &dyn Fn(usize) -> f64| {
            let values = || (0..after.lights.len()).map(value);
            [values().fold(f64::INFINITY, f64::min), values().fold(0.0, f64::max)]
                .map(|x| number(x).parse::<f64>().unwrap_or(x))
        };
        let share = range(&|i| 100.0 * f64::from(after.lights[i].share));
        let omega = range(&|i| f64::from(after.lights[i].solid_angle));
        table.rows.push(vec![
            (round + 1).into(),
            after.lights.len().into(),
            share[0].into(),
            share[1].into(),
            omega[0].into(),
            omega[1].into(),
        ]);
    }
    let (late_cuts, late_cells) = (cuts.split_off(3), cells.split_off(3));
    Ok(Figure {
        number: 14,
        title: "Median cut, step by step",
        slides: "slides 32–37",
        caption: Code::literal(
            "<p>A round cuts every region once, across its longer side, into halves of equal energy: new cuts are \
             orange, earlier cuts white, and lights blue. Below each round, every cell shows the mean radiance of its \
             region (exposed for the mean of the map); the light of a cell is that radiance times the solid angle. \
             Bright areas are soon cut into small cells; dark areas stay large and waste no lights. Energy shares are \
             not exactly equal, because a cut runs between texels.</p>",
        ),
        formulas: vec![formulas::region_light()],
        rows: vec![
            Row::new("The cuts of rounds 1 to 3", cuts),
            Row::new("Their cells", cells),
            Row::new("The cuts of rounds 4 to 6", late_cuts),
            Row::new("Their cells", late_cells),
        ],
        tables: vec![table],
        pictures: Vec::new(),
    })
}

fn cuts_panel(
    context: &FigureContext,
    before: &Rig,
    after: &Rig,
    round: usize,
) -> Result<Document, Error> {
    let title = format!("Round {round}: {} regions", after.lights.len());
    map_panel(context, &title, &[], |sheet, r| {
        borders_in(sheet, r, after, WHOLE, PALETTE[4], 2.2);
        borders_in(sheet, r, before, WHOLE, Color::WHITE, 2.4);
        for light in &after.lights {
            mark(sheet, on_map(context, r, light.direction));
        }
    })
}

/// The map with every texel replaced by the mean radiance of its region.
fn cells_picture(context: &FigureContext, rig: &Rig) -> RgbImage {
    let radiance: Vec<Rgb> = rig
        .lights
        .iter()
        .map(|light| light.irradiance / light.solid_angle.max(f32::MIN_POSITIVE))
        .collect();
    let (width, height) = (context.map.width, context.map.height);
    RgbImage::from_fn(width, height, |x, y| {
        let texel = y * rig.height / height * rig.width + x * rig.width / width;
        radiance.get(rig.labels[texel] as usize).copied().unwrap_or(Rgb::BLACK)
    })
}
