//! Amounts of memory as text, and memory limits.

use crate::math::functions;
use std::fmt;
use std::str::FromStr;

/// A number of bytes. It displays as `1.5 GiB`, and also parses from `1536M`, `1.5GB` or `1610612736`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct MemorySize(pub u64);

/// A text that is not an amount of memory.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{text}' is not an amount of memory such as 4GiB, 500MB or 1.5G")]
pub struct ParseMemorySizeError {
    text: String,
}

const BINARY: [&str; 5] = ["B", "KiB", "MiB", "GiB", "TiB"];

impl fmt::Display for MemorySize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (mut amount, mut unit) = (self.0 as f64, 0);
        while amount >= 1023.95 && unit + 1 < BINARY.len() {
            amount /= 1024.0;
            unit += 1;
        }
        let decimals = usize::from(unit > 0);
        write!(f, "{amount:.decimals$} {}", BINARY[unit])
    }
}

impl FromStr for MemorySize {
    type Err = ParseMemorySizeError;

    /// A number and a unit: powers of 1024 with `K`, `M`, `G`, `T` and `KiB` …, of 1000 with `kB`, `MB`, `GB`, `TB`.
    fn from_str(text: &str) -> Result<Self, ParseMemorySizeError> {
        let digits = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
        let (number, unit) = text.split_at(digits);
        let unit = unit.to_ascii_lowercase();
        let power = match unit.trim_end_matches("ib").trim_end_matches('b') {
            "" => Some(0),
            "k" => Some(1),
            "m" => Some(2),
            "g" => Some(3),
            "t" => Some(4),
            _ => None,
        };
        let decimal = unit.len() == 2 && unit.ends_with('b');
        let base: f64 = if decimal { 1000.0 } else { 1024.0 };
        let bytes =
            number.trim().parse::<f64>().ok().zip(power).map(|(n, p)| n * functions::powi(base, p));
        match bytes {
            Some(bytes) if (1.0..1e18).contains(&bytes) => Ok(Self(bytes as u64)),
            _ => Err(ParseMemorySizeError { text: text.to_owned() }),
        }
    }
}

/// An allocation that would exceed the limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("needs some {needed} of memory, but only {allowed} are left")]
pub struct OverLimit {
    /// An estimate of the memory needed.
    pub needed: MemorySize,
    /// The memory left under the limit.
    pub allowed: MemorySize,
}

/// Checks `needed` bytes against a limit, if there is one.
///
/// # Errors
/// If `needed` exceeds `allowed`.
pub fn require(needed: u64, allowed: Option<u64>) -> Result<(), OverLimit> {
    match allowed {
        Some(allowed) if needed > allowed => {
            Err(OverLimit { needed: MemorySize(needed), allowed: MemorySize(allowed) })
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amounts_as_text() {
        let bytes = |text: &str| text.parse::<MemorySize>().map(|size| size.0);
        assert_eq!(bytes("4GiB"), Ok(4 << 30));
        assert_eq!(bytes("1.5 g"), Ok(3 << 29));
        assert_eq!(bytes("500MB"), Ok(500_000_000));
        assert_eq!((bytes("77"), bytes("77B"), bytes("2k")), (Ok(77), Ok(77), Ok(2048)));
        for text in ["", "G", "-1G", "0", "nan", "1e30T", "4 GiBi", "1x", "ib"] {
            assert!(bytes(text).is_err(), "{text}");
        }
        assert_eq!(MemorySize(77).to_string(), "77 B");
        assert_eq!(MemorySize(3 << 29).to_string(), "1.5 GiB");
        assert_eq!(MemorySize((1 << 30) - 1).to_string(), "1.0 GiB");
    }
}
