//! From radiometric to photometric quantities.
//!
//! One rule for all engines: light of luminance 1 W·m⁻²·sr⁻¹ is 683 cd·m⁻², and each channel is scaled alike, so that a
//! light whose irradiance has luminance E has the illuminance 683 E lux. (683 lm/W is the definition of the candela, at
//! 540 THz; a probe's numbers are no spectra, so any other factor would be a guess about what made the light.) Scripts have the
//! factor as a constant at their beginning: 2^EV instead keeps a probe's own units.

/// The factor \[lm/W\].
pub(super) const LUMENS_PER_WATT: f32 = 683.0;
