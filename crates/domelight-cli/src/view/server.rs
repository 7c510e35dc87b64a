//! The page and its socket, on this computer alone.
//!
//! Another page in the same browser can send requests here, too, under any name that leads to this computer. So every
//! request needs the token, and the names of the server and of the page that asks must be ours. There are no files to ask
//! for: the page is the only one.

use std::io;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::thread;

use domelight_page::{Engine, Host};
use tungstenite::WebSocket;
use tungstenite::handshake::server::{create_response, write_response};
use tungstenite::http;
use tungstenite::protocol::{Role, WebSocketConfig};

use super::ahead::Ahead;
use super::connection;
use super::http::{Head, Refusal, respond};

/// The most that the page may send at once, a file \[bytes\].
const MAX_MESSAGE: usize = 1 << 30;

/// Connections at one time: a page has four engines.
const MAX_CONNECTIONS: usize = 64;

/// A server that waits for its page.
pub(super) struct Server {
    listener: TcpListener,
    service: Service,
}

/// What all connections share.
struct Service {
    /// Where it listens.
    address: SocketAddr,
    token: String,
    page: String,
    host: Host,
    ahead: Ahead,
    revision: Arc<AtomicU64>,
    n_connections: AtomicUsize,
}

/// What a request gets.
enum Route {
    Page,
    Engine,
}

/// Listens at a port of this computer, any if it is 0.
pub(super) fn listen(port: u16) -> io::Result<TcpListener> {
    TcpListener::bind((Ipv4Addr::LOCALHOST, port))
}

impl Server {
    /// A server of a page. Its engines have what `host` says, the first of them what is loaded ahead.
    pub(super) fn new(
        listener: TcpListener,
        page: String,
        host: Host,
        ahead: Ahead,
        revision: Arc<AtomicU64>,
    ) -> io::Result<Self> {
        let (address, token) = (listener.local_addr()?, token()?);
        let n_connections = AtomicUsize::new(0);
        let service = Service { address, token, page, host, ahead, revision, n_connections };
        Ok(Self { listener, service })
    }

    /// The address of the page.
    pub(super) fn address(&self) -> String {
        format!("http://{}/{}/", self.service.address, self.service.token)
    }

    /// Serves in threads of its own as long as the process lives.
    pub(super) fn start(self) {
        let Self { listener, service } = self;
        let service = Arc::new(service);
        thread::spawn(move || {
            for stream in listener.incoming().filter_map(Result::ok) {
                let service = service.clone();
                thread::spawn(move || service.serve(stream));
            }
        });
    }
}

/// 128 random bits.
fn token() -> io::Result<String> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).map_err(io::Error::from)?;
    Ok(format!("{:032x}", u128::from_ne_bytes(bytes)))
}

impl Service {
    /// Answers a connection. What goes wrong with it is the other side's affair.
    fn serve(&self, mut stream: TcpStream) {
        let before = self.n_connections.fetch_add(1, Ordering::Relaxed);
        let _ = if before < MAX_CONNECTIONS {
            self.answer(stream)
        } else {
            Refusal::BUSY.send(&mut stream)
        };
        self.n_connections.fetch_sub(1, Ordering::Relaxed);
    }

    fn answer(&self, mut stream: TcpStream) -> io::Result<()> {
        stream.set_nodelay(true)?;
        let head = match Head::read(&mut stream) {
            Ok(head) => head,
            Err(refusal) => return refusal.send(&mut stream),
        };
        match self.route(&head) {
            Ok(Route::Page) => respond(&mut stream, "200 OK", "text/html", self.page.as_bytes()),
            Ok(Route::Engine) => self.upgrade(stream, head),
            Err(refusal) => refusal.send(&mut stream),
        }
    }

    /// What a request asks for, if it may.
    fn route(&self, head: &Head) -> Result<Route, Refusal> {
        let names = [self.address.to_string(), format!("localhost:{}", self.address.port())];
        let host = head.header("host")?.ok_or(Refusal::MALFORMED)?;
        // A page of another server whose name leads here, too (DNS rebinding), names that server.
        if !names.iter().any(|name| name.eq_ignore_ascii_case(host)) {
            return Err(Refusal::FOREIGN);
        }
        let origin = head.header("origin")?;
        let is_ours = |origin: &str| origin.eq_ignore_ascii_case(&format!("http://{host}"));
        if !origin.is_none_or(is_ours) {
            return Err(Refusal::FOREIGN);
        }
        let path = head.path.strip_prefix('/').ok_or(Refusal::NOTHING_HERE)?;
        let (token, rest) = path.split_once('/').ok_or(Refusal::NOTHING_HERE)?;
        if !is_equal(token.as_bytes(), self.token.as_bytes()) {
            return Err(Refusal::NOTHING_HERE);
        }
        if head.method != "GET" {
            return Err(Refusal::METHOD);
        }
        // Browsers name the page that opens a socket, so who does not is none.
        match (rest.split('?').next().unwrap_or(rest), origin) {
            ("", _) => Ok(Route::Page),
            ("engine", Some(_)) => Ok(Route::Engine),
            ("engine", None) => Err(Refusal::FOREIGN),
            _ => Err(Refusal::NOTHING_HERE),
        }
    }

    /// Makes a request a socket, and serves an engine through it.
    fn upgrade(&self, mut stream: TcpStream, head: Head) -> io::Result<()> {
        let mut request = http::Request::builder().uri(&head.path).version(http::Version::HTTP_11);
        for (name, value) in head.headers() {
            request = request.header(name, value);
        }
        let response = request.body(()).ok().and_then(|request| create_response(&request).ok());
        let Some(response) = response else { return Refusal::MALFORMED.send(&mut stream) };
        if write_response(&mut stream, &response).is_err() {
            return Ok(());
        }
        let config = WebSocketConfig::default()
            .max_message_size(Some(MAX_MESSAGE))
            .max_frame_size(Some(MAX_MESSAGE));
        let socket = WebSocket::from_partially_read(stream, head.rest, Role::Server, Some(config));
        let engine = self.ahead.take().unwrap_or_else(|| Engine::new(self.host.clone()));
        connection::serve(socket, engine, &self.revision);
        Ok(())
    }
}

/// Whether two texts are equal, in a time that does not depend on where they differ.
fn is_equal(a: &[u8], b: &[u8]) -> bool {
    a.len() == b.len() && a.iter().zip(b).fold(0, |all, (a, b)| all | (a ^ b)) == 0
}
