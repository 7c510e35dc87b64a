//! Strategies as text: `NAME[:OPTION]…`, the options those of `render`'s flags.

use std::str::FromStr;

use clap::Parser;

use crate::args::sampling::{StrategyArguments, StrategyName};
use crate::strategy::Plan;

/// A strategy and the text that it was given as.
#[derive(Clone, Debug)]
pub(crate) struct NamedStrategy {
    pub(crate) text: String,
    pub(crate) name: StrategyName,
    pub(crate) plan: Plan,
}

/// A text that is no strategy.
#[derive(Debug, thiserror::Error)]
#[error("'{text}' is no strategy: {why}")]
pub(crate) struct BadStrategy {
    text: String,
    why: String,
}

/// The flags of a strategy, on their own.
#[derive(Debug, Parser)]
#[command(no_binary_name = true, disable_help_flag = true)]
struct Flags {
    #[command(flatten)]
    strategy: StrategyArguments,
}

impl FromStr for NamedStrategy {
    type Err = BadStrategy;

    fn from_str(text: &str) -> Result<Self, BadStrategy> {
        let bad = |why: String| BadStrategy { text: text.to_owned(), why };
        let flags = flags(text).map_err(|why| bad(why.into()))?;
        let Flags { strategy } =
            Flags::try_parse_from(flags).map_err(|error| bad(first_paragraph(&error)))?;
        let plan = strategy.plan().map_err(|error| bad(error.to_string()))?;
        Ok(Self { text: text.to_owned(), name: strategy.strategy, plan })
    }
}

/// What the text is as flags of `render`.
fn flags(text: &str) -> Result<Vec<String>, &'static str> {
    let mut parts = text.trim().split(':');
    let name = parts.next().unwrap_or_default();
    let mut flags = vec![format!("--strategy={name}")];
    for (i, part) in parts.enumerate() {
        match part.split_once('=') {
            // The colon of a split stands between options here.
            Some((key, value)) => flags.push(format!("--{key}={}", value.replace('/', ":"))),
            None if i == 0 && part.starts_with(|c: char| c.is_ascii_digit()) => {
                flags.extend(shorthand(name, part)?);
            }
            None => flags.push(format!("--{part}")),
        }
    }
    Ok(flags)
}

/// The flags that a first number, or two, stand for.
fn shorthand(name: &str, numbers: &str) -> Result<Vec<String>, &'static str> {
    Ok(match (name, numbers.split_once('/')) {
        ("mis", Some((m, n))) => vec![format!("--split={m}:{n}")],
        ("sir", Some((n, m))) => vec![format!("--rays={n}"), format!("--candidates={m}")],
        (_, Some(_)) => return Err("two numbers go with mis:M/N and sir:N/M alone"),
        ("rejection", None) => vec![format!("--tries={numbers}")],
        ("median-cut" | "variance-minimization", None) => vec![format!("--lights={numbers}")],
        (_, None) => vec![format!("--rays={numbers}")],
    })
}

/// What clap says, on one line, without its label and advice.
fn first_paragraph(error: &clap::Error) -> String {
    let text = error.to_string();
    let paragraph = text.split("\n\n").next().unwrap_or_default();
    let lines: Vec<&str> = paragraph.lines().map(str::trim).collect();
    lines.join(" ").trim_start_matches("error: ").to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn described(text: &str) -> String {
        text.parse::<NamedStrategy>().expect(text).plan.describe()
    }

    #[test]
    fn numbers_and_options_mean_the_flags() {
        let mis = "mis 3:1, balance heuristic, compensated";
        assert_eq!(described("brdf:4"), "brdf, 4 a camera sample");
        assert_eq!(described("mis:3/1:heuristic=balance"), mis);
        assert_eq!(described("mis:split=3/1:heuristic=balance"), mis);
        assert_eq!(described("mis:no-compensation"), "mis 1:1, power heuristic");
        let sir = "sir 15/800, mixture candidates, systematicsorted resampling";
        assert_eq!(described("sir:15/800"), sir);
        assert_eq!(described("sir:rays=15:candidates=800"), sir);
        let rejection = "rejection from environment, 16 tries";
        assert_eq!(described("rejection:proposal=environment"), rejection);
        assert_eq!(described("median-cut:64"), "median-cut, 64 lights");
    }

    #[test]
    fn what_is_wrong_is_said() {
        for (text, words) in [
            ("velvet", "velvet"),
            ("", "strategy"),
            ("brdf:0", "0 is not in"),
            ("brdf:3/4", "two numbers"),
            ("brdf:lights=4", "--lights"),
            ("sir:9/8", "--candidates"),
            ("mis:colour=red", "--colour"),
            ("mis:strategy=brdf", "--strategy"),
        ] {
            let error = text.parse::<NamedStrategy>().expect_err(text).to_string();
            assert!(error.contains(words), "{text}: {error}");
            assert!(!error.contains('\n'), "{error}");
        }
    }
}
