//! `domelight page`: writes the browser edition that came with the program.

use std::env;
use std::fs;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use anyhow::Result;
use domelight::quote::xml;

use crate::args::page::{FILE, PageArguments};
use crate::error::{UsageError, status};
use crate::files;
use crate::output::print_json;

/// No page is larger; of another file, no more is read.
const MAX_BYTES: u64 = 1 << 26;

/// The part of the page before the address that copied links begin with.
const BASE: &str = "<meta name=\"base\" content=\"";

/// Runs the subcommand.
pub(crate) fn run(arguments: &PageArguments, quiet: bool) -> Result<()> {
    let source = source(arguments.from.as_deref(), "--from")?;
    files::reads(&source)?;
    files::writes(&arguments.output)?;
    let name = source.display().to_string();
    let page = read(&source)?;
    let page = with_base(&page, arguments.base.as_deref())
        .ok_or_else(|| UsageError(format!("{name}: this is not the page of domelight")))?;
    files::write(&arguments.output, |out| out.write_all(page.as_bytes()))?;
    if arguments.json {
        let file = arguments.output.display().to_string();
        return print_json(&serde_json::json!({ "file": file, "from": name, "bytes": page.len() }));
    }
    if !quiet && arguments.output != Path::new("-") {
        status(&format!("-> {}: open it in a browser", arguments.output.display()));
    }
    Ok(())
}

/// The page's file: the one that an option names, or else the one that came with the program.
pub(crate) fn source(named: Option<&Path>, option: &str) -> Result<PathBuf> {
    named.map_or_else(|| installed(option), |file| Ok(file.to_owned()))
}

/// Reads the page.
pub(crate) fn read(source: &Path) -> Result<String, UsageError> {
    let read = || {
        let mut page = String::new();
        fs::File::open(source)?.take(MAX_BYTES).read_to_string(&mut page)?;
        Ok(page)
    };
    read().map_err(|error: io::Error| UsageError(format!("{}: {error}", source.display())))
}

/// Where the page may be: beside the program, in the folder of data that belongs to the program's, or, in a checkout, where
/// `web/build` makes it.
fn places(program: &Path) -> Vec<PathBuf> {
    let folder = program.parent().unwrap_or(Path::new(""));
    let above = |levels: usize| folder.ancestors().nth(levels);
    let shared = above(1).map(|prefix| prefix.join("share").join("domelight"));
    let built = above(2).map(|checkout| checkout.join("web").join("dist"));
    let folders = [Some(folder.to_path_buf()), shared, built];
    folders.into_iter().flatten().map(|folder| folder.join(FILE)).collect()
}

fn installed(option: &str) -> Result<PathBuf> {
    let program = env::current_exe().and_then(fs::canonicalize)?;
    let places = places(&program);
    let missing = || {
        let looked: Vec<_> = places.iter().take(2).map(|p| p.display().to_string()).collect();
        UsageError(format!(
            "the page is at neither {}: take {FILE} from an archive of the release, or make it with web/build in a checkout, \
             and name it with {option}",
            looked.join(" nor ")
        ))
    };
    Ok(places.iter().find(|place| place.is_file()).cloned().ok_or_else(missing)?)
}

/// The page with another address for copied links; `None` if it has no place for it.
fn with_base(page: &str, base: Option<&str>) -> Option<String> {
    let (before, rest) = page.split_once(BASE)?;
    let (built_in, after) = rest.split_once('"')?;
    let base = base.map(|base| xml::text(base).into_string());
    Some(format!("{before}{BASE}{}\"{after}", base.as_deref().unwrap_or(built_in)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_is_beside_the_program_or_where_packages_put_it() {
        let places = places(Path::new("/opt/domelight/bin/domelight"));
        let expected = ["bin/domelight.html", "share/domelight/domelight.html"];
        assert_eq!(places[..2], expected.map(|p| Path::new("/opt/domelight").join(p)));
        let checkout = super::places(Path::new("/src/domelight/target/release/domelight"));
        assert_eq!(checkout[2], Path::new("/src/domelight/web/dist/domelight.html"));
    }

    #[test]
    fn links_get_an_address() {
        let page = "<meta name=\"base\" content=\"\"><p>";
        assert_eq!(with_base(page, None).as_deref(), Some(page));
        let with = with_base(page, Some("https://a.org/?x=1&y=\"2\"")).unwrap();
        assert_eq!(
            with,
            "<meta name=\"base\" content=\"https://a.org/?x=1&amp;y=&quot;2&quot;\"><p>"
        );
        assert_eq!(with_base("<p>", None), None);
    }
}
