//! Names and paths as data in files of other languages: shell, JavaScript, Python, YAML, XML, ….
//!
//! [`Code<L>`](Code) is text of the language `L`. It is made of literals of this program, of numbers, and of what a
//! function of this module has quoted; [`code!`](crate::code) puts them together. Text from outside, such as a file's
//! name, is a `String`, which [`code!`](crate::code) does not take:
//!
//! ```
//! use domelight::code;
//! use domelight::quote::{Shell, shell};
//!
//! let folder = String::from("$(reboot)");
//! let script = code!(Shell, "cd {folder}\n", folder = shell::word(&folder));
//! assert_eq!(script.as_str(), "cd '$(reboot)'\n");
//! ```
//!
//! ```compile_fail
//! # use domelight::code;
//! # use domelight::quote::Shell;
//! let folder = String::from("$(reboot)");
//! let script = code!(Shell, "cd {folder}\n", folder = folder);
//! ```
//!
//! What is borrowed or captured does not compile either:
//!
//! ```compile_fail
//! # use domelight::code;
//! # use domelight::quote::Shell;
//! let folder = String::from("$(reboot)");
//! let script = code!(Shell, "cd {folder}\n", folder = folder.as_str());
//! ```
//!
//! ```compile_fail
//! # use domelight::code;
//! # use domelight::quote::Shell;
//! let folder = String::from("$(reboot)");
//! let script = code!(Shell, "cd {folder}\n");
//! ```

pub mod html;
pub mod javascript;
pub mod pbrt;
pub mod python;
pub mod radiance;
pub mod shell;
pub mod sibl;
pub mod terminal;
pub mod usd;
pub mod xml;
pub mod yaml;

use std::fmt::{self, Debug, Display, Write as _};
use std::marker::PhantomData;
use std::ops::{Add, AddAssign};

/// HTML text, also within attributes in double quotes.
#[derive(Clone, Copy, Debug)]
pub enum Html {}

/// A JavaScript module.
#[derive(Clone, Copy, Debug)]
pub enum JavaScript {}

/// A scene of pbrt-v4.
#[derive(Clone, Copy, Debug)]
pub enum Pbrt {}

/// A Python script.
#[derive(Clone, Copy, Debug)]
pub enum Python {}

/// A scene of Radiance.
#[derive(Clone, Copy, Debug)]
pub enum Radiance {}

/// A script for a POSIX shell.
#[derive(Clone, Copy, Debug)]
pub enum Shell {}

/// A smart IBL set.
#[derive(Clone, Copy, Debug)]
pub enum Sibl {}

/// OpenUSD as text.
#[derive(Clone, Copy, Debug)]
pub enum Usd {}

/// XML 1.0.
#[derive(Clone, Copy, Debug)]
pub enum Xml {}

/// YAML 1.2, read alike as 1.1.
#[derive(Clone, Copy, Debug)]
pub enum Yaml {}

/// Text of the language `L`.
pub struct Code<L> {
    text: String,
    language: PhantomData<fn() -> L>,
}

/// What may stand in text of the language `L` as it is: numbers, literals, and text of the language.
pub trait Fragment<L>: Display {}

impl<L> Fragment<L> for Code<L> {}
impl<L> Fragment<L> for &Code<L> {}
impl<L> Fragment<L> for &'static str {}
macro_rules! numbers {
    ($($number:ty)*) => { $(impl<L> Fragment<L> for $number {})* };
}
numbers!(u8 u16 u32 u64 usize i32 i64 f32 f64);

/// A [`Code`] of a format string, as [`format!`] makes a `String`: `code!(Shell, "cd {folder}", folder = word)`.
///
/// Every place of the format string is named, and each value is a [`Fragment`](crate::quote::Fragment) of the language.
#[macro_export]
macro_rules! code {
    ($language:ty, $format:literal $(, $name:ident = $value:expr)* $(,)?) => {
        // A format string made by a macro captures nothing from around it, so that all values are checked.
        $crate::quote::Code::<$language>::assembled(::std::format_args!(
            ::std::concat!($format) $(, $name = $crate::quote::fragment::<$language, _>(&$value))*
        ))
    };
}

/// Checks that `value` may stand in text of the language as it is; for [`code!`](crate::code).
#[doc(hidden)]
pub fn fragment<L, F: Fragment<L>>(value: &F) -> &F {
    value
}

impl<L> Code<L> {
    /// What stands in this program.
    pub fn literal(text: &'static str) -> Self {
        Self::generated(text.to_owned())
    }

    /// Text that a program's own code generated, such as base64 or a drawing; never text from outside.
    pub fn generated(text: String) -> Self {
        Self { text, language: PhantomData }
    }

    /// Wraps the text that [`code!`](crate::code) assembles from checked values.
    #[doc(hidden)]
    pub fn assembled(text: fmt::Arguments) -> Self {
        Self::generated(fmt::format(text))
    }

    /// One after the other, with `separator` between them.
    pub fn join(parts: impl IntoIterator<Item = Self>, separator: &'static str) -> Self {
        let parts: Vec<String> = parts.into_iter().map(|part| part.text).collect();
        Self::generated(parts.join(separator))
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        &self.text
    }

    /// The text.
    pub fn into_string(self) -> String {
        self.text
    }
}

impl<L> Default for Code<L> {
    fn default() -> Self {
        Self::literal("")
    }
}

impl<L> Clone for Code<L> {
    fn clone(&self) -> Self {
        Self::generated(self.text.clone())
    }
}

impl<L> Debug for Code<L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Debug::fmt(&self.text, f)
    }
}

impl<L> Display for Code<L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl<L, F: Fragment<L>> AddAssign<F> for Code<L> {
    fn add_assign(&mut self, more: F) {
        let _ = write!(self.text, "{more}");
    }
}

impl<L, F: Fragment<L>> Add<F> for Code<L> {
    type Output = Self;

    fn add(mut self, more: F) -> Self {
        self += more;
        self
    }
}

/// Text in a comment that ends with its line, for any language: what breaks lines, is invisible or turns the writing
/// direction becomes a space. No language reads it back.
fn comment_text(text: &str) -> String {
    text.chars().map(|c| if is_invisible(c) { ' ' } else { c }).collect()
}

/// Controls, separators of lines and paragraphs, marks of writing direction, and what is no character.
fn is_invisible(c: char) -> bool {
    let directs = matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    c.is_control()
        || directs
        || matches!(c, '\u{2028}' | '\u{2029}' | '\u{feff}' | '\u{fffe}' | '\u{ffff}')
}

/// A literal in double quotes that JavaScript, Python, YAML and JSON read alike.
fn double_quoted(text: &str) -> String {
    // All invisible characters have 16 bits.
    escaped(text, |c| is_invisible(c).then(|| format!("\\u{:04x}", u32::from(c))))
}

/// A literal in double quotes with backslash escapes for quotes, backslashes, line breaks and tabs; `escape` gives those
/// of further characters.
fn escaped(text: &str, escape: impl Fn(char) -> Option<String>) -> String {
    let mut quoted = String::with_capacity(text.len() + 2);
    quoted.push('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            '\n' => quoted += "\\n",
            '\r' => quoted += "\\r",
            '\t' => quoted += "\\t",
            c => match escape(c) {
                Some(escape) => quoted += &escape,
                None => quoted.push(c),
            },
        }
    }
    quoted.push('"');
    quoted
}
