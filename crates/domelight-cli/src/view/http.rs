//! As much of HTTP as the page needs: heads of requests, and responses.

use std::io::{self, Read as _, Write as _};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use httparse::Status;

/// A longer head, or one with more headers, is refused.
const MAX_HEAD: usize = 16 << 10;
const MAX_HEADERS: usize = 64;

/// How long the head of a request may take.
const PATIENCE: Duration = Duration::from_secs(5);

/// Headers of all responses: nothing is kept, and no other page shows or reads this one.
const HEADERS: &str = "Cache-Control: no-store\r\nReferrer-Policy: no-referrer\r\nX-Content-Type-Options: nosniff\r\n\
                       X-Frame-Options: DENY\r\nCross-Origin-Opener-Policy: same-origin\r\n\
                       Cross-Origin-Resource-Policy: same-origin\r\nConnection: close\r\n";

/// The head of a request.
#[derive(Debug)]
pub(super) struct Head {
    pub(super) method: String,
    pub(super) path: String,
    headers: Vec<(String, String)>,
    /// What came after it.
    pub(super) rest: Vec<u8>,
}

/// Why a request gets nothing else: the status, and a sentence for who made it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Refusal {
    status: &'static str,
    text: &'static str,
}

impl Refusal {
    pub(super) const MALFORMED: Self =
        Self::new("400 Bad Request", "This is no request that domelight knows.");
    pub(super) const FOREIGN: Self =
        Self::new("403 Forbidden", "The page is for this computer alone.");
    pub(super) const NOTHING_HERE: Self =
        Self::new("404 Not Found", "Open the address that domelight view has printed.");
    pub(super) const METHOD: Self =
        Self::new("405 Method Not Allowed", "domelight view answers GET alone.");
    pub(super) const SLOW: Self = Self::new("408 Request Timeout", "The request did not arrive.");
    pub(super) const LONG: Self =
        Self::new("431 Request Header Fields Too Large", "The request is too long.");
    pub(super) const BUSY: Self = Self::new(
        "503 Service Unavailable",
        "Too many pages are open: close some of them, or start domelight view again.",
    );

    const fn new(status: &'static str, text: &'static str) -> Self {
        Self { status, text }
    }

    /// Sends it.
    pub(super) fn send(self, stream: &mut TcpStream) -> io::Result<()> {
        respond(stream, self.status, "text/plain", self.text.as_bytes())
    }
}

impl Head {
    /// Reads the head of a request.
    pub(super) fn read(stream: &mut TcpStream) -> Result<Self, Refusal> {
        let end = Instant::now() + PATIENCE;
        let mut bytes = Vec::new();
        let mut buffer = [0; 4096];
        loop {
            if let Some(head) = Self::parse(&bytes)? {
                return Ok(head);
            }
            if bytes.len() > MAX_HEAD {
                return Err(Refusal::LONG);
            }
            let left = end.saturating_duration_since(Instant::now());
            // A timeout of 0 is refused.
            let waits = stream.set_read_timeout(Some(left.max(Duration::from_millis(1))));
            match waits.and_then(|()| stream.read(&mut buffer)) {
                Ok(0) => return Err(Refusal::MALFORMED),
                Ok(n) => bytes.extend_from_slice(&buffer[..n]),
                Err(_) => return Err(Refusal::SLOW),
            }
        }
    }

    /// The head at the beginning of some bytes, if it is whole.
    fn parse(bytes: &[u8]) -> Result<Option<Self>, Refusal> {
        let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
        let mut request = httparse::Request::new(&mut headers);
        let length = match request.parse(bytes) {
            Ok(Status::Complete(length)) => length,
            Ok(Status::Partial) => return Ok(None),
            Err(httparse::Error::TooManyHeaders) => return Err(Refusal::LONG),
            Err(_) => return Err(Refusal::MALFORMED),
        };
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).map_err(|_| Refusal::MALFORMED);
        let header = |h: &httparse::Header<'_>| Ok((h.name.to_owned(), text(h.value)?));
        Ok(Some(Self {
            method: request.method.unwrap_or_default().to_owned(),
            path: request.path.unwrap_or_default().to_owned(),
            headers: request.headers.iter().map(header).collect::<Result<_, _>>()?,
            rest: bytes[length..].to_vec(),
        }))
    }

    /// The header of a name, of which there must not be two.
    pub(super) fn header(&self, name: &str) -> Result<Option<&str>, Refusal> {
        let mut found = self.headers.iter().filter(|(other, _)| other.eq_ignore_ascii_case(name));
        let value = found.next().map(|(_, value)| value.trim());
        if found.next().is_some() { Err(Refusal::MALFORMED) } else { Ok(value) }
    }

    /// All headers.
    pub(super) fn headers(&self) -> impl Iterator<Item = (&str, &str)> {
        self.headers.iter().map(|(name, value)| (&name[..], &value[..]))
    }
}

/// Sends a response, after which the connection ends.
pub(super) fn respond(
    stream: &mut TcpStream,
    status: &str,
    kind: &str,
    body: &[u8],
) -> io::Result<()> {
    let length = body.len();
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}; charset=utf-8\r\nContent-Length: {length}\r\n{HEADERS}\r\n"
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(body)?;
    stream.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heads_are_parsed_when_they_are_whole() {
        let bytes = b"GET /a/ HTTP/1.1\r\nHost: 127.0.0.1:80\r\nORIGIN: null\r\n\r\nrest";
        assert!(Head::parse(&bytes[..30]).unwrap().is_none());
        let head = Head::parse(bytes).unwrap().unwrap();
        assert_eq!(
            (&head.method[..], &head.path[..], &head.rest[..]),
            ("GET", "/a/", &b"rest"[..])
        );
        assert_eq!(head.header("origin"), Ok(Some("null")));
        assert_eq!(head.header("upgrade"), Ok(None));
    }

    #[test]
    fn what_is_malformed_or_ambiguous_is_refused() {
        let refused = |bytes: &[u8]| Head::parse(bytes).unwrap_err();
        assert_eq!(refused(b"\x16\x03\x01\x02\x00"), Refusal::MALFORMED);
        assert_eq!(refused(b"GET / HTTP/1.1\r\nHost: \xff\r\n\r\n"), Refusal::MALFORMED);
        let many = format!("GET / HTTP/1.1\r\n{}\r\n", "A: b\r\n".repeat(MAX_HEADERS + 1));
        assert_eq!(refused(many.as_bytes()), Refusal::LONG);
        let two = Head::parse(b"GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n").unwrap().unwrap();
        assert_eq!(two.header("host"), Err(Refusal::MALFORMED));
    }
}
