//! One engine of the page: answers calls in order, and renders between them, as a Worker does in the page alone.

use std::collections::VecDeque;
use std::net::TcpStream;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use domelight_page::Engine;
use tungstenite::error::CapacityError;
use tungstenite::protocol::CloseFrame;
use tungstenite::protocol::frame::coding::CloseCode;
use tungstenite::{Message, WebSocket};

use super::message::{self, BadMessage, Incoming, Request};

/// How long the picture is rendered before it is shown, at first and later \[ms\].
const FIRST_SLICE: f64 = 8.0;
const SLICE: f64 = 40.0;

/// How often files that have changed are noticed, while there is nothing to render.
const PAUSE: Duration = Duration::from_millis(250);

/// Why a connection ends.
#[derive(Debug, thiserror::Error)]
enum Ended {
    #[error(transparent)]
    Socket(#[from] tungstenite::Error),
    #[error(transparent)]
    Io(#[from] std::io::Error),
    #[error(transparent)]
    Message(#[from] BadMessage),
}

/// How a frame begins that acknowledges an update: an empty text, followed by the four bytes of a client's mask.
const ACKNOWLEDGEMENT: [u8; 2] = [0x81, 0x80];
const ACKNOWLEDGEMENT_SIZE: usize = 6;

/// A picture in progress.
struct Rendering {
    token: i64,
    paused: bool,
    /// The length of the next slice \[ms\].
    slice: f64,
    untold: Untold,
}

/// What the page has not been told of a picture.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Untold {
    Nothing,
    /// Tiles, which later ones may replace.
    Tiles,
    /// The end of a pass or of the budget, at which the picture waits.
    End,
}

struct Connection<'a> {
    socket: WebSocket<TcpStream>,
    engine: Engine,
    rendering: Option<Rendering>,
    pending: VecDeque<Incoming>,
    /// Whether the page has not acknowledged the last update. More of them would stand before the next answer.
    is_behind: bool,
    /// Counts the changes of files.
    revision: &'a AtomicU64,
    seen: u64,
}

/// Serves one engine until the page is closed.
pub(super) fn serve(socket: WebSocket<TcpStream>, engine: Engine, revision: &AtomicU64) {
    let seen = revision.load(Ordering::Relaxed);
    // Without it, changes of files would be noticed at the next message.
    if socket.get_ref().set_read_timeout(Some(PAUSE)).is_err() {
        return;
    }
    let (rendering, pending) = (None, VecDeque::new());
    let mut connection =
        Connection { socket, engine, rendering, pending, is_behind: false, revision, seen };
    let why = loop {
        if let Err(why) = connection.turn() {
            break why;
        }
    };
    connection.close(&why);
}

impl Connection<'_> {
    fn turn(&mut self) -> Result<(), Ended> {
        self.receive()?;
        let revision = self.revision.load(Ordering::Relaxed);
        if revision != self.seen {
            self.seen = revision;
            self.send(message::changed())?;
        }
        match self.pending.pop_front() {
            Some(incoming) => self.answer(&incoming),
            None if self.can_tell() => self.tell(),
            None if self.is_rendering() => self.slice(),
            None => Ok(()),
        }
    }

    fn is_rendering(&self) -> bool {
        let is_due = |rendering: &Rendering| !rendering.paused && rendering.untold != Untold::End;
        self.rendering.as_ref().is_some_and(is_due)
    }

    /// Whether the page has time for an update, and there is one.
    fn can_tell(&self) -> bool {
        let is_due = |rendering: &Rendering| rendering.untold != Untold::Nothing;
        !self.is_behind && self.rendering.as_ref().is_some_and(is_due)
    }

    /// Takes the messages that are there; waits a moment for one if there is nothing else to do.
    fn receive(&mut self) -> Result<(), Ended> {
        let mut waits = self.pending.is_empty() && !self.can_tell() && !self.is_rendering();
        loop {
            self.socket.get_mut().set_nonblocking(!waits)?;
            let read = self.socket.read();
            self.socket.get_mut().set_nonblocking(false)?;
            match read {
                Ok(Message::Binary(bytes)) => self.keep(Incoming::parse(&bytes)?),
                Ok(Message::Text(text)) if text.is_empty() => self.is_behind = false,
                Ok(Message::Text(_)) => return Err(BadMessage::Text.into()),
                Ok(Message::Ping(_) | Message::Pong(_) | Message::Close(_) | Message::Frame(_)) => {
                }
                Err(tungstenite::Error::Io(error)) if is_pause(&error) => return Ok(()),
                Err(error) => return Err(error.into()),
            }
            waits = false;
        }
    }

    /// Keeps a request for its turn; a pause is for now.
    fn keep(&mut self, incoming: Incoming) {
        match (&incoming.request, &mut self.rendering) {
            (&Request::Pause { token, paused }, Some(rendering)) if rendering.token == token => {
                rendering.paused = paused;
            }
            (Request::Pause { .. }, _) => {}
            _ => self.pending.push_back(incoming),
        }
    }

    fn answer(&mut self, incoming: &Incoming) -> Result<(), Ended> {
        match &incoming.request {
            Request::Call { id, call, args } => {
                let arguments = incoming.arguments(args)?;
                let answered = self.engine.call(call, arguments);
                // The render in progress was of an old scene or light.
                if !self.engine.is_rendering() {
                    self.rendering = None;
                }
                self.send(match answered {
                    Ok(answer) => message::result(*id, &answer),
                    Err(error) => message::error(*id, &error.to_string()),
                })
            }
            Request::Render { token, settings } => {
                let is_render = |other: &Incoming| matches!(other.request, Request::Render { .. });
                if self.pending.iter().any(is_render) {
                    return Ok(());
                }
                self.rendering = None;
                let message = match self.engine.start(settings) {
                    Ok(strategy) => {
                        let (slice, untold) = (FIRST_SLICE, Untold::Nothing);
                        self.rendering =
                            Some(Rendering { token: *token, paused: false, slice, untold });
                        message::started(*token, &strategy)
                    }
                    Err(error) => message::failed(*token, &error.to_string()),
                };
                self.send(message)
            }
            Request::Budget { token, rays } => match &mut self.rendering {
                Some(rendering) if rendering.token == *token => {
                    rendering.paused = false;
                    self.engine.set_budget(*rays);
                    Ok(())
                }
                _ => self.send(message::spent(*token)),
            },
            Request::Stop {} => {
                self.rendering = None;
                Ok(())
            }
            Request::Pause { .. } => Ok(()),
        }
    }

    /// Renders a little, or until the next message.
    fn slice(&mut self) -> Result<(), Ended> {
        let Some(rendering) = &mut self.rendering else { return Ok(()) };
        let slice = rendering.slice;
        rendering.slice = SLICE.min(2.0 * slice);
        let stream = self.socket.get_mut();
        stream.set_nonblocking(true)?;
        let ended = self.engine.step(slice, &|| has_news(stream));
        stream.set_nonblocking(false)?;
        match ended {
            Ok(ended) => rendering.untold = if ended { Untold::End } else { Untold::Tiles },
            Err(error) => return self.fail(&error),
        }
        Ok(())
    }

    /// Sends what was rendered since the last update.
    fn tell(&mut self) -> Result<(), Ended> {
        let Some(rendering) = &mut self.rendering else { return Ok(()) };
        let token = rendering.token;
        let update = match self.engine.update() {
            Ok(update) => update,
            Err(error) => return self.fail(&error),
        };
        rendering.untold = Untold::Nothing;
        rendering.paused |= update.spent;
        if update.complete {
            self.rendering = None;
        }
        // A slice that was interrupted may have rendered nothing.
        if update.complete || !update.windows.is_empty() {
            self.send(message::update(token, &update))?;
            self.is_behind = true;
        }
        if update.spent { self.send(message::spent(token)) } else { Ok(()) }
    }

    /// Ends the picture in progress with an error.
    fn fail(&mut self, error: &domelight_page::Error) -> Result<(), Ended> {
        match self.rendering.take() {
            Some(Rendering { token, .. }) => self.send(message::failed(token, &error.to_string())),
            None => Ok(()),
        }
    }

    fn send(&mut self, message: Vec<u8>) -> Result<(), Ended> {
        Ok(self.socket.send(Message::Binary(message.into()))?)
    }

    /// Says why it ends, to who still listens.
    fn close(&mut self, why: &Ended) {
        let code = match why {
            Ended::Message(_) => CloseCode::Unsupported,
            Ended::Socket(tungstenite::Error::Capacity(CapacityError::MessageTooLong {
                ..
            })) => CloseCode::Size,
            Ended::Socket(_) | Ended::Io(_) => CloseCode::Protocol,
        };
        let reason = why.to_string().into();
        let _ = self.socket.close(Some(CloseFrame { code, reason }));
        let _ = self.socket.flush();
    }
}

/// Whether something has come besides acknowledgements, or the other side is gone.
fn has_news(stream: &TcpStream) -> bool {
    let mut bytes = [0; 2 * ACKNOWLEDGEMENT_SIZE];
    match stream.peek(&mut bytes) {
        Ok(0) => true,
        Ok(n) => !bytes[..n].chunks(ACKNOWLEDGEMENT_SIZE).all(is_acknowledgement),
        Err(error) => !is_pause(&error),
    }
}

/// Whether a frame acknowledges an update, as far as it has come.
fn is_acknowledgement(frame: &[u8]) -> bool {
    frame.iter().zip(ACKNOWLEDGEMENT).all(|(&byte, expected)| byte == expected)
}

/// Whether nothing has come yet.
fn is_pause(error: &std::io::Error) -> bool {
    matches!(error.kind(), std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut)
}
