//! Header attributes for the position and the colors of the picture.

use crate::environment::mapping::EnvmapKind;
use crate::math::Mat3;
use crate::picture::DataWindow;
use crate::picture::primaries::Primaries;
use ::exr::meta::attribute::{Chromaticities, EnvironmentMap};
use ::exr::meta::header::Header;

/// Where the data window lies in the display window, if they differ.
pub(super) fn window(header: &Header) -> Option<DataWindow> {
    let (data, display) = (header.data_window(), header.shared_attributes.display_window);
    let step = |from: i32, to: i32| i64::from(to) - i64::from(from);
    let position =
        (step(display.position.0, data.position.0), step(display.position.1, data.position.1));
    let display = (display.size.0, display.size.1);
    let same = position == (0, 0) && display == (data.size.0, data.size.1);
    (!same).then_some(DataWindow { position, display })
}

/// The value of the attribute `envmap`.
pub(super) fn envmap(header: &Header) -> Option<EnvmapKind> {
    header.own_attributes.environment_map.map(|kind| match kind {
        EnvironmentMap::LatitudeLongitude => EnvmapKind::LatLong,
        EnvironmentMap::Cube => EnvmapKind::Cube,
    })
}

pub(super) fn to_rec709(c: &Chromaticities) -> Option<Mat3> {
    primaries(c).to_rec709()
}

pub(super) fn primaries(c: &Chromaticities) -> Primaries {
    Primaries([c.red, c.green, c.blue, c.white].map(|xy| [xy.0, xy.1]))
}
