//! `domelight view`: the page of the browser edition, with the program as its engine.

mod address;
mod ahead;
mod connection;
mod http;
mod message;
mod server;
mod watch;

use std::fs::File;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::str::FromStr as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use anyhow::{Context as _, Result};
use domelight::environment::builtin::BuiltinProbe;
use domelight::quote::xml;
use domelight::scene::builtin::BuiltinScene;
use domelight_lab::job::Job;
use domelight_page::Host;

use crate::args::view::ViewArguments;
use crate::clock;
use crate::error::{UsageError, status, warn};
use crate::files;
use crate::interrupt;
use crate::job;
use crate::memory;
use crate::output::print;
use crate::page;
use crate::scene::start_threads;
use crate::terminal::Terminal;

use ahead::Ahead;
use server::Server;
use watch::Watch;

/// The part of the page that says whether a program is its engine.
const NATIVE: &str = "<meta name=\"native\" content=\"\">";

/// The part of the page that lets it reach nothing.
const POLICY: &str = "default-src 'none';";

/// Runs the subcommand.
pub(crate) fn run(arguments: &ViewArguments, quiet: bool) -> Result<()> {
    let job = job::resolve(&arguments.job, &arguments.given, quiet)?;
    let source = page::source(arguments.page.as_deref(), "--page")?;
    let page = page::read(&source)?;
    let files = named_files(&job)?;
    start_threads(arguments.threads.threads)?;
    let interrupted = interrupt::flag();
    let page_job = address::of_job(&job, &Terminal { quiet })?;
    let port = arguments.port.unwrap_or(0);
    let listener = server::listen(port).with_context(|| format!("port {port}"))?;
    let page = native(&page, listener.local_addr()?, &files).ok_or_else(|| {
        let why = "this is not the page of domelight, or one of another version";
        UsageError(format!("{}: {why}", source.display()))
    })?;
    let host = Host::new(clock::milliseconds, memory::left(), files);
    let revision = Arc::new(AtomicU64::new(0));
    let fragment = page_job.fragment.clone();
    let ahead = Ahead::load(host.clone(), page_job);
    let server = Server::new(listener, page, host.clone(), ahead, revision.clone())?;
    let address = format!("{}#{fragment}", server.address());
    server.start();
    print(&address)?;
    if !arguments.no_open
        && let Err(error) = open::that_detached(&address)
    {
        warn(quiet, &format!("no browser could be started ({error}): open the address in one"));
    }
    if !quiet {
        status("Ctrl-C ends it");
    }
    let mut watch = arguments.watch.then(Watch::default);
    while !interrupted.load(Ordering::Relaxed) {
        if watch.as_mut().is_some_and(|watch| watch.look(&host)) {
            host.forget();
            revision.fetch_add(1, Ordering::Relaxed);
        }
        wait(interrupted);
    }
    Ok(())
}

/// Waits until it is time to look at files, or for Ctrl-C.
fn wait(interrupted: &AtomicBool) {
    const PAUSE: Duration = Duration::from_millis(50);
    for _ in 0..10 {
        if !interrupted.load(Ordering::Relaxed) {
            thread::sleep(PAUSE);
        }
    }
}

/// The files that the command line names.
fn named_files(job: &Job) -> Result<Vec<PathBuf>, UsageError> {
    let scene = BuiltinScene::from_str(&job.scene).is_err().then_some(&job.scene);
    let map = job.light.map.as_ref().filter(|map| BuiltinProbe::from_str(map).is_err());
    let named: Vec<_> = [scene, map].into_iter().flatten().map(PathBuf::from).collect();
    for file in &named {
        let name = file.display();
        if files::waits(file) {
            return Err(UsageError(format!(
                "{name}: the page reads it more than once; give a file"
            )));
        }
        File::open(file).map_err(|error| UsageError(format!("cannot read {name}: {error}")))?;
    }
    Ok(named)
}

/// The page with what a program as its engine needs: the address of its socket, and the files that the program opens.
fn native(page: &str, address: SocketAddr, files: &[PathBuf]) -> Option<String> {
    let port = address.port();
    let policy = format!("{POLICY} connect-src ws://{address} ws://localhost:{port};");
    let names: Vec<_> = files.iter().map(|file| file.to_string_lossy()).collect();
    let names = xml::text(&serde_json::to_string(&names).ok()?).into_string();
    let (before, after) = page.split_once(NATIVE)?;
    let (start, end) = before.split_once(POLICY)?;
    Some(format!("{start}{policy}{end}<meta name=\"native\" content=\"{names}\">{after}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_learns_of_socket_and_files() {
        let page = format!("<meta content=\"{POLICY} img-src data:\">{NATIVE}<p>");
        let address = SocketAddr::from(([127, 0, 0, 1], 80));
        let made = native(&page, address, &["a \"b\".glb".into()]).unwrap();
        let policy =
            "default-src 'none'; connect-src ws://127.0.0.1:80 ws://localhost:80; img-src data:";
        let names = "[&quot;a \\&quot;b\\&quot;.glb&quot;]";
        assert_eq!(
            made,
            format!("<meta content=\"{policy}\"><meta name=\"native\" content=\"{names}\"><p>")
        );
        assert_eq!(native("<p>", address, &[]), None);
    }
}
