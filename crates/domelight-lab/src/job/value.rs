//! Values of a job's fields. Each has one text, which the command line, TOML and JSON share, and a range that its type
//! enforces.

use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;
use std::str::FromStr;

use clap::builder::{
    MapValueParser, PossibleValue, PossibleValuesParser, TypedValueParser as _, ValueParserFactory,
};
use domelight::environment::UpAxis;
use domelight::environment::convention::Convention;
use domelight::environment::io::Window;
use domelight::environment::mapping::Mapping;
use domelight::math::DVec3;
use domelight::picture::tone::ToneCurve;
use domelight::render::{Filter, Passes};
use domelight::sampling::SamplerKind;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::ground::Ground;

/// A value that could not be read, and what it should look like.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{text}' is not {expected}")]
pub struct BadValue {
    text: String,
    expected: &'static str,
}

impl BadValue {
    /// `text` is not what is `expected`, which reads after "is not".
    pub fn new(text: &str, expected: &'static str) -> Self {
        Self { text: text.to_owned(), expected }
    }
}

/// Reads a text, a number, or numbers in brackets, which stand for their text separated by commas.
fn from_text<'de, T, D>(deserializer: D) -> Result<T, D::Error>
where
    T: FromStr<Err: fmt::Display>,
    D: Deserializer<'de>,
{
    struct Text<T>(PhantomData<T>);

    impl<'de, T: FromStr<Err: fmt::Display>> Visitor<'de> for Text<T> {
        type Value = T;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("a text, a number or numbers in brackets")
        }

        fn visit_str<E: de::Error>(self, text: &str) -> Result<T, E> {
            text.parse().map_err(E::custom)
        }

        fn visit_i64<E: de::Error>(self, number: i64) -> Result<T, E> {
            self.visit_str(&number.to_string())
        }

        fn visit_u64<E: de::Error>(self, number: u64) -> Result<T, E> {
            self.visit_str(&number.to_string())
        }

        fn visit_f64<E: de::Error>(self, number: f64) -> Result<T, E> {
            self.visit_str(&number.to_string())
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut numbers: A) -> Result<T, A::Error> {
            let mut texts = Vec::new();
            while let Some(Text64(text)) = numbers.next_element()? {
                texts.push(text);
            }
            self.visit_str(&texts.join(","))
        }
    }

    deserializer.deserialize_any(Text(PhantomData))
}

/// The text of a number in brackets.
struct Text64(String);

impl<'de> Deserialize<'de> for Text64 {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(Self(f64::deserialize(deserializer)?.to_string()))
    }
}

/// A value that is written as text, or as a number if its text is one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Text<T>(pub T);

impl<T: FromStr> FromStr for Text<T> {
    type Err = T::Err;

    fn from_str(text: &str) -> Result<Self, T::Err> {
        text.parse().map(Self)
    }
}

impl<T: fmt::Display> fmt::Display for Text<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl<T: fmt::Display> Serialize for Text<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let text = self.0.to_string();
        match text.parse::<f64>() {
            Ok(number) if number.to_string() == text => serializer.serialize_f64(number),
            _ => serializer.serialize_str(&text),
        }
    }
}

impl<'de, T: FromStr<Err: fmt::Display>> Deserialize<'de> for Text<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        from_text(deserializer)
    }
}

impl<T> JsonSchema for Text<T> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Text".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": ["string", "number", "array"], "items": { "type": "number" } })
    }
}

/// Defines a number with a condition.
macro_rules! number {
    ($(#[$doc:meta])* $name:ident, $holds:expr, $expected:expr, $schema:tt) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
        pub struct $name(f32);

        impl $name {
            /// The number.
            pub fn get(self) -> f32 {
                self.0
            }
        }

        impl FromStr for $name {
            type Err = BadValue;

            fn from_str(text: &str) -> Result<Self, BadValue> {
                let holds: fn(f32) -> bool = $holds;
                match text.parse::<f32>() {
                    Ok(x) if x.is_finite() && holds(x) => Ok(Self(x)),
                    Ok(x) if x == f32::INFINITY => Err(BadValue::new(text, "a number up to 3.4e38")),
                    _ => Err(BadValue::new(text, $expected)),
                }
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        }

        impl Serialize for $name {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                shortest(self.0).serialize(serializer)
            }
        }

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                from_text(deserializer)
            }
        }

        impl JsonSchema for $name {
            fn inline_schema() -> bool {
                true
            }

            fn schema_name() -> Cow<'static, str> {
                stringify!($name).into()
            }

            fn json_schema(_: &mut SchemaGenerator) -> Schema {
                json_schema!($schema)
            }
        }
    };
}

/// The number of 64 bits with the same shortest decimal text.
fn shortest(x: f32) -> f64 {
    x.to_string().parse().unwrap_or(f64::from(x))
}

number!(
    /// A finite number.
    Finite, |_| true, "a finite number", { "type": "number" });
number!(
    /// A finite number ≥ 0.
    NotNegative, |x| x >= 0.0, "a number that is not negative", { "type": "number", "minimum": 0 });
number!(
    /// A finite number > 0.
    Positive, |x| x > 0.0, "a number above 0", { "type": "number", "exclusiveMinimum": 0 });

impl Finite {
    /// The number, if it is finite.
    pub fn new(x: f32) -> Option<Self> {
        x.is_finite().then_some(Self(x))
    }
}

impl NotNegative {
    /// The number, if it is finite and ≥ 0.
    pub fn new(x: f32) -> Option<Self> {
        (x.is_finite() && x >= 0.0).then_some(Self(x))
    }
}

/// A whole number from `MIN` to `MAX`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Count<const MIN: u32, const MAX: u32>(u32);

impl<const MIN: u32, const MAX: u32> Count<MIN, MAX> {
    /// The number, in a constant.
    ///
    /// # Panics
    /// If it is out of range.
    pub const fn new(n: u32) -> Self {
        assert!(MIN <= n && n <= MAX, "the number is out of range");
        Self(n)
    }

    /// The number.
    pub const fn get(self) -> u32 {
        self.0
    }
}

/// A text that is no whole number in a range.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{text}' is not a whole number from {min} to {max}")]
pub struct BadCount {
    text: String,
    min: u32,
    max: u32,
}

impl<const MIN: u32, const MAX: u32> FromStr for Count<MIN, MAX> {
    type Err = BadCount;

    fn from_str(text: &str) -> Result<Self, BadCount> {
        let n = text.parse().ok().filter(|n| (MIN..=MAX).contains(n));
        n.map(Self).ok_or_else(|| BadCount { text: text.to_owned(), min: MIN, max: MAX })
    }
}

impl<const MIN: u32, const MAX: u32> fmt::Display for Count<MIN, MAX> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl<const MIN: u32, const MAX: u32> Serialize for Count<MIN, MAX> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

impl<'de, const MIN: u32, const MAX: u32> Deserialize<'de> for Count<MIN, MAX> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        from_text(deserializer)
    }
}

impl<const MIN: u32, const MAX: u32> JsonSchema for Count<MIN, MAX> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Count".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "integer", "minimum": MIN, "maximum": MAX })
    }
}

/// A seed of random numbers. TOML, whose integers have a sign, holds the upper half of the seeds as text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Seed(pub u64);

impl FromStr for Seed {
    type Err = BadValue;

    fn from_str(text: &str) -> Result<Self, BadValue> {
        let expected = "a whole number from 0 to 18446744073709551615";
        text.parse().map(Self).map_err(|_| BadValue::new(text, expected))
    }
}

impl fmt::Display for Seed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl Serialize for Seed {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match i64::try_from(self.0) {
            Ok(seed) => seed.serialize(serializer),
            Err(_) => serializer.collect_str(&self.0),
        }
    }
}

impl<'de> Deserialize<'de> for Seed {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        from_text(deserializer)
    }
}

impl JsonSchema for Seed {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Seed".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": ["integer", "string"], "minimum": 0 })
    }
}

/// A closed set of values with names.
pub trait Named: Copy + PartialEq + Send + Sync + 'static {
    /// All values, in the order of the help.
    fn all() -> Vec<Self>;

    /// The name of the value.
    fn name(self) -> &'static str;

    /// Another name that is read, too.
    fn alias(self) -> Option<&'static str> {
        None
    }

    /// What the help says beside the name; may be empty.
    fn help(self) -> &'static str {
        ""
    }
}

/// One value of a closed set, written as its name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Choice<T>(pub T);

/// A name that is not in the set.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{text}' is not one of {names}")]
pub struct BadChoice {
    text: String,
    names: String,
}

impl<T: Named> FromStr for Choice<T> {
    type Err = BadChoice;

    fn from_str(text: &str) -> Result<Self, BadChoice> {
        let is = |value: &T| value.name() == text || value.alias() == Some(text);
        T::all().into_iter().find(is).map(Self).ok_or_else(|| {
            let names: Vec<_> = T::all().into_iter().map(T::name).collect();
            BadChoice { text: text.to_owned(), names: names.join(", ") }
        })
    }
}

impl<T: Named> fmt::Display for Choice<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.0.name())
    }
}

impl<T: Named> Serialize for Choice<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.0.name())
    }
}

impl<'de, T: Named> Deserialize<'de> for Choice<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        from_text(deserializer)
    }
}

impl<T: Named> JsonSchema for Choice<T> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Choice".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let names: Vec<_> = T::all().into_iter().map(T::name).collect();
        json_schema!({ "type": "string", "enum": names })
    }
}

/// The command line lists the names, and their help.
impl<T: Named> ValueParserFactory for Choice<T> {
    type Parser = MapValueParser<PossibleValuesParser, fn(String) -> Self>;

    fn value_parser() -> Self::Parser {
        let value = |value: T| {
            let possible = PossibleValue::new(value.name()).aliases(value.alias());
            if value.help().is_empty() { possible } else { possible.help(value.help()) }
        };
        let of_name: fn(String) -> Self = |name| {
            name.parse().unwrap_or_else(|error| unreachable!("{error}, although it was listed"))
        };
        PossibleValuesParser::new(T::all().into_iter().map(value)).map(of_name)
    }
}

impl Named for UpAxis {
    fn all() -> Vec<Self> {
        Self::ALL.to_vec()
    }

    fn name(self) -> &'static str {
        self.name()
    }

    fn help(self) -> &'static str {
        match self {
            Self::Y => "+Y",
            Self::Z => "+Z",
        }
    }
}

impl Named for Ground {
    fn all() -> Vec<Self> {
        vec![Self::Plate, Self::Shadow]
    }

    fn name(self) -> &'static str {
        match self {
            Self::Plate => "plate",
            Self::Shadow => "shadow",
        }
    }

    fn help(self) -> &'static str {
        match self {
            Self::Plate => "A diffuse plate that fades out toward its rim",
            Self::Shadow => "Only shadows",
        }
    }
}

impl Named for Passes {
    fn all() -> Vec<Self> {
        vec![Self::Efficient, Self::Doubling]
    }

    fn name(self) -> &'static str {
        self.name()
    }

    fn help(self) -> &'static str {
        match self {
            Self::Efficient => "Passes of the length that suits the strategy best",
            Self::Doubling => {
                "Passes of 1, 1, 2, 4, … samples, as in the browser edition; with product, this gives a different picture"
            }
        }
    }
}

impl Named for SamplerKind {
    fn all() -> Vec<Self> {
        vec![Self::Sobol, Self::Independent]
    }

    fn name(self) -> &'static str {
        self.name()
    }

    fn help(self) -> &'static str {
        match self {
            Self::Sobol => "Owen-scrambled Sobol' points",
            Self::Independent => "Independent pseudo-random points",
        }
    }
}

/// Types of the library whose names need no help.
macro_rules! named {
    ($($type:ty),*) => {
        $(impl Named for $type {
            fn all() -> Vec<Self> {
                Self::ALL.to_vec()
            }

            fn name(self) -> &'static str {
                self.name()
            }
        })*
    };
}

named!(Filter, Window, Mapping, Convention);

impl Named for ToneCurve {
    fn all() -> Vec<Self> {
        Self::ALL.to_vec()
    }

    fn name(self) -> &'static str {
        self.name()
    }

    fn alias(self) -> Option<&'static str> {
        self.alias()
    }
}

/// The size of a picture, `WxH`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// The number of columns, 1 to 65,536.
    pub width: usize,
    /// The number of rows, 1 to 65,536; at most 2²⁸ pixels in all.
    pub height: usize,
}

impl Size {
    /// The longest edge of a picture.
    const MAX_EDGE: usize = 65_536;

    /// The most pixels of a picture, whose sums take some 120 bytes each.
    const MAX_PIXELS: usize = 1 << 28;
}

impl FromStr for Size {
    type Err = BadValue;

    fn from_str(text: &str) -> Result<Self, BadValue> {
        let bad = || {
            let expected = "a size such as 800x600, each from 1 to 65536, with at most 2^28 pixels";
            BadValue::new(text, expected)
        };
        let (width, height) = text.split_once(['x', 'X', ',']).ok_or_else(bad)?;
        let edge = |text: &str| {
            let edge = text.trim().parse().ok();
            edge.filter(|edge| (1..=Self::MAX_EDGE).contains(edge)).ok_or_else(bad)
        };
        let (width, height) = (edge(width)?, edge(height)?);
        if width * height <= Self::MAX_PIXELS { Ok(Self { width, height }) } else { Err(bad()) }
    }
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

/// A point or a direction, `X,Y,Z`, each finite in single precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triple(pub DVec3);

impl FromStr for Triple {
    type Err = BadValue;

    fn from_str(text: &str) -> Result<Self, BadValue> {
        let numbers: Result<Vec<f64>, _> = text.split(',').map(|x| x.trim().parse()).collect();
        match numbers.as_deref() {
            Ok(&[x, y, z]) if DVec3::new(x, y, z).as_vec3().is_finite() => {
                Ok(Self(DVec3::new(x, y, z)))
            }
            _ => Err(BadValue::new(text, "three numbers such as 0,1.5,-4")),
        }
    }
}

impl fmt::Display for Triple {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let DVec3 { x, y, z } = self.0;
        write!(f, "{x},{y},{z}")
    }
}

/// The rotation of an environment about the up axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rotation {
    /// So that its key light comes from the left of the camera.
    Auto,
    /// By an angle, finite.
    Degrees(f32),
}

impl Rotation {
    /// The angle, if one was given \[degrees\].
    pub fn degrees(self) -> Option<f32> {
        match self {
            Self::Auto => None,
            Self::Degrees(degrees) => Some(degrees),
        }
    }
}

impl FromStr for Rotation {
    type Err = BadValue;

    fn from_str(text: &str) -> Result<Self, BadValue> {
        if text == "auto" {
            return Ok(Self::Auto);
        }
        match text.parse::<f32>() {
            Ok(degrees) if degrees.is_finite() => Ok(Self::Degrees(degrees)),
            _ => Err(BadValue::new(text, "an angle in degrees or auto")),
        }
    }
}

impl fmt::Display for Rotation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.pad("auto"),
            Self::Degrees(degrees) => degrees.fmt(f),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn good_and_bad_values() {
        assert_eq!("640x480".parse(), Ok(Size { width: 640, height: 480 }));
        let bad_sizes = ["", "640", "0x1", "1x65537", "ax3", "65536x65536"];
        assert!(bad_sizes.iter().all(|s| s.parse::<Size>().is_err()));
        assert_eq!("1, -2,3e1".parse(), Ok(Triple(DVec3::new(1.0, -2.0, 30.0))));
        assert!(["1,2", "1,2,nan", "a,b,c"].iter().all(|s| s.parse::<Triple>().is_err()));
        assert_eq!("auto".parse(), Ok(Rotation::Auto));
        assert_eq!("-30".parse(), Ok(Rotation::Degrees(-30.0)));
        assert!(["", "x", "inf"].iter().all(|s| s.parse::<Rotation>().is_err()));
        assert_eq!("7".parse(), Ok(Count::<1, 8>(7)));
        assert!(["0", "9", "-1", "x"].iter().all(|s| s.parse::<Count<1, 8>>().is_err()));
        assert_eq!("0.5".parse(), Ok(Positive(0.5)));
        assert!(["0", "-1", "nan", "inf"].iter().all(|s| s.parse::<Positive>().is_err()));
        assert!(["-1", "nan", "inf"].iter().all(|s| s.parse::<NotNegative>().is_err()));
        assert_eq!("z".parse(), Ok(Choice(UpAxis::Z)));
        assert_eq!("srgb".parse(), Ok(Choice(ToneCurve::Standard)));
    }

    /// A number of 32 bits keeps its short decimal text.
    #[test]
    fn numbers_stay_short() {
        assert_eq!(serde_json::to_string(&Finite(0.1)).unwrap(), "0.1");
        assert_eq!(serde_json::from_str::<Finite>("0.1").unwrap(), Finite(0.1));
        assert_eq!(serde_json::from_str::<Text<Size>>("[64, 48]").unwrap().0.height, 48);
        assert!(serde_json::from_str::<Positive>("0").is_err());
    }
}
