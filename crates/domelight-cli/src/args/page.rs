//! The arguments of `domelight page`.

use std::path::PathBuf;

use clap::Args;

pub(super) const EXAMPLES: &str = "\
Examples:
  domelight page
      domelight.html, to open in a browser, from a disk or a server
  domelight page -o lecture.html --base https://example.org/lecture.html
      the same for a server; links that are copied from it begin with its address";

/// The name of the page, where it is written and where it is installed.
pub(crate) const FILE: &str = "domelight.html";

/// Write the browser edition.
#[derive(Args, Debug)]
pub(crate) struct PageArguments {
    /// Output; - is standard output
    #[arg(short, long, value_name = "FILE", default_value = FILE)]
    pub(crate) output: PathBuf,
    /// The address that copied links begin with [default: that of the page]
    #[arg(long, value_name = "URL", value_parser = address)]
    pub(crate) base: Option<String>,
    /// The page as it was built [default: domelight.html beside the program, or in share/domelight]
    #[arg(long, value_name = "FILE")]
    pub(crate) from: Option<PathBuf>,
    /// Print the files as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

/// An address of a page on the web.
fn address(text: &str) -> Result<String, String> {
    let is_address = text.starts_with("https://") || text.starts_with("http://");
    if is_address {
        Ok(text.to_owned())
    } else {
        Err("it must begin with https:// or http://".into())
    }
}
