//! Converts SVG text to PNG with resvg, in one font that is part of the program.

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb};
use std::sync::{Arc, LazyLock};

use super::{FONT, data_uri};
use crate::Error;

/// Inter Regular: Latin, Greek and mathematical symbols.
const FONT_FILE: &[u8] = include_bytes!("../../assets/Inter-subset.otf");

/// The maximum width and height of a picture \[pixels\].
const MOST: f32 = 20_000.0;

/// Converts a drawing to PNG, enlarged by `scale`.
///
/// # Errors
/// If the text is not a valid drawing, or the picture would be empty or too large.
pub fn rasterize(svg: &str, scale: f32) -> Result<Vec<u8>, Error> {
    static FONTS: LazyLock<Arc<fontdb::Database>> = LazyLock::new(|| {
        let mut fonts = fontdb::Database::new();
        fonts.load_font_data(FONT_FILE.to_vec());
        Arc::new(fonts)
    });
    let options =
        Options { font_family: FONT.to_owned(), fontdb: FONTS.clone(), ..Options::default() };
    let tree = Tree::from_str(svg, &options)
        .map_err(|error| Error::Failed(format!("cannot read the drawing: {error}")))?;
    let size = tree.size();
    let [width, height] = [size.width(), size.height()].map(|length| (length * scale).ceil());
    if !(width <= MOST && height <= MOST) {
        let why = format!("a picture of {width}x{height} pixels is too large");
        return Err(Error::Failed(why));
    }
    let empty = || Error::Failed("the drawing is empty".into());
    let mut picture = Pixmap::new(width as u32, height as u32).ok_or_else(empty)?;
    resvg::render(&tree, Transform::from_scale(scale, scale), &mut picture.as_mut());
    picture.encode_png().map_err(|error| Error::Failed(error.to_string()))
}

/// The CSS rule with which a page shows drawings in their font.
pub fn font_face_css() -> String {
    let source = data_uri("font/otf", FONT_FILE);
    format!("@font-face{{font-family:{FONT};src:url({source})}}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::svg::{Color, Document, Pixels, Rect, Style, TextStyle};
    use domelight::picture::png;

    fn pixels(sheet: &Document, scale: f32) -> domelight::RgbImage {
        png::decode(&rasterize(&sheet.to_svg(), scale).unwrap()).unwrap().image
    }

    #[test]
    fn shapes_text_and_pictures_arrive() {
        let mut inner = Document::new(4.0, 4.0);
        inner.rect(Rect::new(0.0, 0.0, 2.0, 4.0), Style::fill(Color(255, 0, 0)));
        let red_and_white = rasterize(&inner.to_svg(), 1.0).unwrap();

        let mut sheet = Document::new(60.0, 20.0);
        sheet.image(Rect::new(0.0, 0.0, 20.0, 20.0), &red_and_white, Pixels::Sharp);
        sheet.clipped(Rect::new(20.0, 0.0, 10.0, 20.0), |sheet| {
            sheet.circle((25.0, 10.0), 30.0, Style::fill(Color(0, 0, 255)));
        });
        sheet.text((32.0, 18.0), "θ∫", TextStyle::new(20.0));
        let image = pixels(&sheet, 2.0);
        assert_eq!((image.width, image.height), (120, 40));
        let is = |x, y, [r, g, b]: [f32; 3]| {
            let c = image.get(x, y);
            assert_eq!([c.r, c.g, c.b], [r, g, b], "{x} {y}");
        };
        is(10, 20, [1.0, 0.0, 0.0]);
        is(30, 20, [1.0, 1.0, 1.0]);
        is(42, 2, [0.0, 0.0, 1.0]);
        let ink = (64..120).flat_map(|x| (0..40).map(move |y| (x, y)));
        let dark = ink.filter(|&(x, y)| image.get(x, y).g < 0.1).count();
        assert!(dark > 100, "{dark} dark pixels of text");
    }

    #[test]
    fn what_is_no_drawing_is_refused() {
        assert!(rasterize("<svg", 1.0).is_err());
        assert!(rasterize(&Document::new(30_000.0, 1.0).to_svg(), 1.0).is_err());
    }
}
