//! The report as one page of HTML that needs nothing else.

use domelight::RgbImage;
use domelight::picture::compare::ColorScale;
use domelight::quote::{Code, Html, html};
use serde_json::json;

use super::Picture;
use super::pixels;
use super::plots::{Cost, convergence};
use super::report::CompareReport;
use crate::Error;
use crate::page::{STYLE as PAGE_STYLE, fill};
use crate::svg::{PALETTE, font_face_css};

const TEMPLATE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// The whole page.
pub(super) fn page(
    report: &CompareReport,
    pictures: &[Option<Picture>],
    reference: &RgbImage,
) -> Result<Code<Html>, Error> {
    let width = reference.width;
    let entries = pictures.iter().map(|picture| {
        let Some(Picture { image, relative_error, flip }) = picture else { return Ok(None) };
        Ok(Some(json!({
            "radiance": pixels::radiance(image)?,
            "relative": pixels::relative_errors(relative_error, width)?,
            "flip": pixels::unit(flip, width)?,
        })))
    });
    let (low, high) = pixels::RELATIVE_ERRORS;
    let data = json!({
        "report": report,
        "pictures": entries.collect::<Result<Vec<_>, Error>>()?,
        "reference": pixels::radiance(reference)?,
        "relativeErrors": [low, high],
        "viridis": pixels::colors(ColorScale::Viridis),
        "magma": pixels::colors(ColorScale::Magma),
        "palette": PALETTE.map(|color| color.to_string()),
    });
    let title = report.scene.title();
    Ok(fill(
        TEMPLATE,
        &[
            ("title", html::text(&title)),
            ("style", Code::generated(format!("{}\n{PAGE_STYLE}\n{STYLE}", font_face_css()))),
            ("over-rays", Code::generated(convergence(report, Cost::Rays))),
            ("over-time", Code::generated(convergence(report, Cost::Seconds))),
            ("command", html::text(&report.command)),
            ("version", html::text(report.version)),
            ("data", html::script_data(&data)),
            ("script", Code::literal(SCRIPT)),
        ],
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_template_has_no_unknown_places() {
        let names =
            ["title", "style", "over-rays", "over-time", "command", "version", "data", "script"];
        for place in TEMPLATE.split("{{").skip(1).filter_map(|p| p.split_once("}}")) {
            assert!(names.contains(&place.0), "{}", place.0);
        }
    }
}
