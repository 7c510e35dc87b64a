//! The sphere of directions around a lobe that leans past the brightest light.

use domelight::bsdf::Bsdf;
use domelight::environment::Environment;
use domelight::environment::mapping::Mapping;
use domelight::math::{Frame, Vec2, Vec3, reflect, vec2};
use domelight::picture::compare::ColorScale;
use domelight::picture::tone::{ToneCurve, ToneMapping};
use domelight::strategy::ShadingPoint;
use domelight::{Rgb, RgbImage};

use super::context::FigureContext;
use super::figure::{Picture, picture_panel, png_bytes};
use crate::Error;
use crate::svg::{Color, Document, Pixels, Style};

/// Width of a sphere map.
const SIZE: f64 = 440.0;
/// Angle between the lobe's axis and the brightest light [degrees].
pub(super) const OFF_AXIS: f32 = 14.0;
/// Angle between the lobe's axis and the normal [degrees].
const TILT: f32 = 35.0;
/// The identity tone mapping, for colors that are already final.
pub(super) const AS_IT_IS: ToneMapping = ToneMapping { exposure: 0.0, curve: ToneCurve::Standard };

/// A vertical strip of the color scale for weights, its end on top.
pub(super) fn weight_strip() -> Result<Vec<u8>, Error> {
    let color = |_, y: usize| ColorScale::Viridis.color(1.0 - y as f32 / 127.0);
    png_bytes(&RgbImage::from_fn(1, 128, color), AS_IT_IS)
}

/// A panel with a picture of the sphere in large cells.
pub(super) fn sharp_panel(png: &[u8], title: &str, notes: &[String]) -> Document {
    const SMALL: f64 = 0.75 * SIZE;
    let (png, pixels) = (png.to_vec(), Pixels::Sharp);
    let picture = Picture { png, width: SMALL, height: SMALL, pixels, title, notes };
    picture_panel(&picture, |_, _| {})
}

/// A picture of values up to `top` in a color scale over value^0.4, as PNG.
pub(super) fn scaled(values: &RgbImage, top: f32) -> Result<Vec<u8>, Error> {
    let color = |p: &Rgb| ColorScale::Magma.color((p.g / top).max(0.0).powf(0.4));
    let shown = values.pixels.iter().map(color).collect();
    png_bytes(&RgbImage::new(values.width, values.height, shown), AS_IT_IS)
}

/// The luminance exceeded by only one in two thousand pixels.
pub(super) fn peak(picture: &RgbImage) -> f32 {
    let mut values: Vec<f32> = picture.pixels.iter().map(|p| p.luminance()).collect();
    values.sort_by(f32::total_cmp);
    values[(values.len() - 1) * 1999 / 2000].max(f32::MIN_POSITIVE)
}

/// The sphere of directions as an angular map of n × n pixels.
pub(super) struct SphereView<'a> {
    environment: &'a Environment,
    /// The center's position across the map, relative to the middle.
    turn: f32,
    pub(super) n: usize,
    /// The displayed part of the sphere's radius: 1 is the whole sphere, ½ the hemisphere around the center.
    radius: f32,
}

impl<'a> SphereView<'a> {
    /// A view of the sphere centered on the direction of a point's lobe.
    pub(super) fn new(context: &'a FigureContext, point: &ShadingPoint) -> Self {
        let environment = &context.environment;
        let ahead = environment.uv(point.frame.to_world(reflect(point.wo, Vec3::Z)));
        let n = context.choose(SIZE as usize, 64);
        Self { environment, turn: ahead.x - 0.5, n, radius: 1.0 }
    }

    /// Limits the view to directions within `degrees` of the center (slightly more in the corners).
    pub(super) fn within(self, degrees: f32) -> Self {
        Self { radius: degrees / 180.0, ..self }
    }

    /// Sets the number of pixels across.
    pub(super) fn of_pixels(self, n: usize) -> Self {
        Self { n, ..self }
    }

    /// A picture with the mean of four values per pixel, and black outside the sphere.
    pub(super) fn picture(&self, value: impl Fn(Vec3) -> Rgb) -> RgbImage {
        let at = |i: usize, k: usize| (i as f32 + 0.25 + 0.5 * k as f32) / self.n as f32;
        RgbImage::from_fn(self.n, self.n, |x, y| {
            let sub = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| vec2(at(x, i), at(y, j)));
            let values = sub.map(|uv| self.direction(uv).map_or(Rgb::BLACK, &value));
            values.into_iter().fold(Rgb::BLACK, |a, b| a + b) * 0.25
        })
    }

    /// A color-scaled picture of values, as PNG.
    pub(super) fn scaled(&self, value: impl Fn(Vec3) -> f32) -> Result<Vec<u8>, Error> {
        let values = self.picture(|wi| Rgb::splat(value(wi)));
        scaled(&values, peak(&values))
    }

    /// A color-scaled picture of weights in [0, 1], as PNG.
    pub(super) fn weights(&self, weight: impl Fn(Vec3) -> f32) -> Result<Vec<u8>, Error> {
        let values = self.picture(|wi| Rgb::splat(weight(wi)));
        let shown = values.pixels.iter().map(|p| ColorScale::Viridis.color(p.g)).collect();
        png_bytes(&RgbImage::new(self.n, self.n, shown), AS_IT_IS)
    }

    /// The mapping uses the map's own frame; the orientation places it in the world.
    fn direction(&self, uv: Vec2) -> Option<Vec3> {
        let middle = Vec2::splat(0.5);
        let in_map = Mapping::Angular.direction(middle + (uv - middle) * self.radius)?;
        let uv = Mapping::LatLong.uv(in_map);
        Some(self.environment.direction(vec2((uv.x + self.turn).rem_euclid(1.0), uv.y)))
    }

    pub(super) fn uv(&self, wi: Vec3) -> Vec2 {
        let uv = self.environment.uv(wi);
        let uv = vec2((uv.x - self.turn).rem_euclid(1.0), uv.y);
        let uv = Mapping::LatLong.direction(uv).map_or(uv, |in_map| Mapping::Angular.uv(in_map));
        let middle = Vec2::splat(0.5);
        middle + (uv - middle) / self.radius
    }

    pub(super) fn panel(
        &self,
        png: &[u8],
        title: &str,
        directions: &[Vec3],
        notes: &[String],
    ) -> Document {
        let pixels = Pixels::Smooth;
        let png = png.to_vec();
        let picture = Picture { png, width: SIZE, height: SIZE, pixels, title, notes };
        picture_panel(&picture, |sheet, r| {
            if self.radius == 1.0 {
                let center = (r.x + 0.5 * r.width, r.y + 0.5 * r.height);
                sheet.circle(center, 0.5 * r.width - 0.5, Style::stroke(Color::GRAY, 1.0));
            }
            for &wi in directions {
                let uv = self.uv(wi);
                let at = (r.x + f64::from(uv.x) * r.width, r.y + f64::from(uv.y) * r.height);
                let style = Style::fill(Color(0x2e, 0xd1, 0xff)).outlined(Color::INK, 0.8);
                sheet.circle(at, 3.2, style);
            }
        })
    }
}

/// A point that reflects the surroundings of the map's brightest light toward the viewer.
pub(super) fn shading_point(context: &FigureContext) -> Result<ShadingPoint, Error> {
    let light = Frame::from_z(context.brightest());
    let (sin, cos) = OFF_AXIS.to_radians().sin_cos();
    let axis = Frame::from_z(light.z * cos + light.x * sin);
    let (sin, cos) = TILT.to_radians().sin_cos();
    let normal = axis.z * cos + axis.y * sin;
    let frame = Frame::from_z(normal);
    let wo = frame.to_local(reflect(axis.z, normal));
    let bsdf = "phong:50".parse::<Bsdf>()?.for_view(wo);
    Ok(ShadingPoint { position: Vec3::ZERO, ng: normal, frame, wo, bsdf })
}
