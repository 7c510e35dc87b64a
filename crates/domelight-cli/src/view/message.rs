//! The messages between page and program, as `web/src/socket.ts` reads and writes them.
//!
//! A message is binary: the length of its header (32 bits, the lowest first), the header as JSON, and arrays of numbers, the
//! first of which begins at the next multiple of eight bytes. In the header, an array is `{"array", "at", "length"}`: the
//! kind of its numbers, its first byte behind the header and how many numbers it has.
//!
//! The page acknowledges each update by an empty text.

use domelight_page::{Answer, Argument, MapView, Statistics, Update};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// What the page asks for.
#[derive(Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub(super) enum Request {
    /// A call that is answered with the same number.
    Call { id: u64, call: String, args: Vec<Value> },
    /// A picture, in place of the last one.
    Render { token: i64, settings: String },
    /// A pause of a picture, or its end.
    Pause { token: i64, paused: bool },
    /// The number of shadow rays at which a picture ends.
    Budget { token: i64, rays: f64 },
    /// The end of the picture.
    Stop {},
}

/// A message that is none.
#[derive(Debug, thiserror::Error)]
pub(super) enum BadMessage {
    #[error("a message is shorter than it says")]
    Short,
    #[error("a message has no header: {0}")]
    Header(#[from] serde_json::Error),
    #[error("messages are binary, or an empty text for an update")]
    Text,
}

/// A request, and the bytes of its arrays.
#[derive(Debug)]
pub(super) struct Incoming {
    pub(super) request: Request,
    arrays: Vec<u8>,
}

/// An array in a header.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ArrayPlace {
    array: Numbers,
    at: usize,
    length: usize,
}

/// The kind of an array's numbers.
#[derive(Clone, Copy, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
enum Numbers {
    U8,
    U32,
    F32,
    F64,
}

/// Arrays of messages begin at multiples of this.
const ALIGNMENT: usize = 8;

impl Incoming {
    /// Reads a message.
    pub(super) fn parse(bytes: &[u8]) -> Result<Self, BadMessage> {
        let (length, rest) = bytes.split_first_chunk().ok_or(BadMessage::Short)?;
        let length = u32::from_le_bytes(*length) as usize;
        let header = rest.get(..length).ok_or(BadMessage::Short)?;
        let start = (size_of::<u32>() + length).next_multiple_of(ALIGNMENT);
        let arrays = bytes.get(start..).unwrap_or_default().to_vec();
        Ok(Self { request: serde_json::from_slice(header)?, arrays })
    }

    /// The arguments of a call, with arrays in their places.
    pub(super) fn arguments(&self, values: &[Value]) -> Result<Vec<Argument>, BadMessage> {
        values.iter().map(|value| self.argument(value)).collect()
    }

    fn argument(&self, value: &Value) -> Result<Argument, BadMessage> {
        if !value.is_object() {
            return Ok(Argument::Plain(value.clone()));
        }
        let ArrayPlace { array, at, length } = ArrayPlace::deserialize(value)?;
        let width = match array {
            Numbers::U8 => 1,
            Numbers::U32 | Numbers::F32 => 4,
            Numbers::F64 => 8,
        };
        let end = length.checked_mul(width).and_then(|size| at.checked_add(size));
        let bytes = end.and_then(|end| self.arrays.get(at..end)).ok_or(BadMessage::Short)?;
        match array {
            Numbers::U8 => Ok(Argument::Bytes(bytes.to_vec())),
            Numbers::F32 => {
                let numbers = bytes.as_chunks().0.iter().map(|&bytes| f32::from_le_bytes(bytes));
                Ok(Argument::Floats(numbers.collect()))
            }
            // No call has such arguments.
            Numbers::U32 | Numbers::F64 => Ok(Argument::Plain(value.clone())),
        }
    }
}

/// A message to the page in the making.
#[derive(Default)]
struct Outgoing {
    arrays: Vec<u8>,
}

impl Outgoing {
    /// Adds an array; what stands for it in the header.
    fn array<T: Copy, const N: usize>(
        &mut self,
        array: Numbers,
        numbers: &[T],
        bytes: impl Fn(T) -> [u8; N],
    ) -> Value {
        let at = self.arrays.len().next_multiple_of(ALIGNMENT);
        self.arrays.resize(at + N * numbers.len(), 0);
        let (places, _) = self.arrays[at..].as_chunks_mut();
        places.iter_mut().zip(numbers).for_each(|(place, &number)| *place = bytes(number));
        json!({ "array": array, "at": at, "length": numbers.len() })
    }

    fn bytes(&mut self, bytes: &[u8]) -> Value {
        self.array(Numbers::U8, bytes, |byte| [byte])
    }

    fn words(&mut self, words: &[u32]) -> Value {
        self.array(Numbers::U32, words, u32::to_le_bytes)
    }

    fn floats(&mut self, floats: &[f32]) -> Value {
        self.array(Numbers::F32, floats, f32::to_le_bytes)
    }

    fn answer(&mut self, answer: &Answer) -> Value {
        match answer {
            Answer::Nothing => Value::Null,
            Answer::Number(number) => json!(number),
            Answer::Index(index) => json!(index),
            Answer::Text(text) => json!(text),
            Answer::Bytes(bytes) => self.bytes(bytes),
            Answer::Words(words) => self.words(words),
            Answer::Floats(floats) => self.floats(floats),
            Answer::Map(MapView { width, height, pixels, integrals }) => {
                let pixels = self.floats(pixels);
                let integrals = self.array(Numbers::F64, integrals, f64::to_le_bytes);
                json!({ "width": width, "height": height, "pixels": pixels, "integrals": integrals })
            }
        }
    }

    /// The bytes of the message.
    fn finish(self, header: &Value) -> Vec<u8> {
        let header = header.to_string();
        let mut bytes = (header.len() as u32).to_le_bytes().to_vec();
        bytes.extend_from_slice(header.as_bytes());
        // An array without numbers has its place, too.
        bytes.resize(bytes.len().next_multiple_of(ALIGNMENT), 0);
        bytes.extend_from_slice(&self.arrays);
        bytes
    }
}

/// A message without arrays.
fn plain(header: &Value) -> Vec<u8> {
    Outgoing::default().finish(header)
}

/// The answer of a call.
pub(super) fn result(id: u64, answer: &Answer) -> Vec<u8> {
    let mut message = Outgoing::default();
    let result = message.answer(answer);
    // Memory is the program's, which the page does not divide among engines.
    message.finish(&json!({ "kind": "result", "id": id, "result": result, "memory": 0 }))
}

/// A call that failed.
pub(super) fn error(id: u64, error: &str) -> Vec<u8> {
    plain(&json!({ "kind": "error", "id": id, "error": error, "dead": false }))
}

/// A picture has begun.
pub(super) fn started(token: i64, strategy: &str) -> Vec<u8> {
    plain(&json!({ "kind": "started", "token": token, "strategy": strategy }))
}

/// A picture has reached its budget.
pub(super) fn spent(token: i64) -> Vec<u8> {
    plain(&json!({ "kind": "spent", "token": token }))
}

/// A picture has failed.
pub(super) fn failed(token: i64, error: &str) -> Vec<u8> {
    plain(&json!({ "kind": "failed", "token": token, "error": error, "dead": false }))
}

/// Scene or map have changed on the disk.
pub(super) fn changed() -> Vec<u8> {
    plain(&json!({ "kind": "changed" }))
}

/// Tiles of a picture.
pub(super) fn update(token: i64, update: &Update) -> Vec<u8> {
    let Update { windows, pixels, complete, progress, whole, milliseconds, statistics, .. } =
        update;
    let statistics: &Statistics = statistics;
    let mut message = Outgoing::default();
    let (windows, pixels) = (message.words(windows), message.floats(pixels));
    message.finish(&json!({
        "kind": "update", "token": token, "windows": windows, "pixels": pixels, "complete": complete,
        "progress": progress, "whole": whole, "milliseconds": milliseconds, "statistics": statistics,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(header: &str, arrays: &[u8]) -> Vec<u8> {
        let mut bytes = (header.len() as u32).to_le_bytes().to_vec();
        bytes.extend_from_slice(header.as_bytes());
        bytes.resize(bytes.len().next_multiple_of(ALIGNMENT), 0);
        bytes.extend_from_slice(arrays);
        bytes
    }

    #[test]
    fn arrays_are_read_from_behind_the_header() {
        let header = r#"{"kind":"call","id":3,"call":"addFile","args":["a.obj",{"array":"u8","at":1,"length":2}]}"#;
        let incoming = Incoming::parse(&message(header, &[1, 2, 3])).unwrap();
        let Request::Call { id, call, args } = &incoming.request else { panic!("{incoming:?}") };
        assert_eq!((*id, &call[..]), (3, "addFile"));
        let arguments = incoming.arguments(args).unwrap();
        assert_eq!(arguments, [Argument::Plain("a.obj".into()), Argument::Bytes(vec![2, 3])]);
    }

    #[test]
    fn messages_that_lie_are_refused() {
        assert!(matches!(Incoming::parse(b"\x01"), Err(BadMessage::Short)));
        assert!(matches!(Incoming::parse(b"\xff\xff\xff\xff{}"), Err(BadMessage::Short)));
        assert!(matches!(Incoming::parse(b"\x02\0\0\0{}"), Err(BadMessage::Header(_))));
        let far = r#"{"kind":"call","id":0,"call":"addPart","args":[{"array":"f32","at":0,"length":4611686018427387905}]}"#;
        let incoming = Incoming::parse(&message(far, &[0; 16])).unwrap();
        let Request::Call { args, .. } = &incoming.request else { panic!("{incoming:?}") };
        assert!(matches!(incoming.arguments(args), Err(BadMessage::Short)));
    }

    #[test]
    fn arrays_without_numbers_begin_within_the_message() {
        for id in [7, 70, 700, 7000] {
            let bytes = result(id, &Answer::Floats(Vec::new()));
            assert_eq!(bytes.len() % ALIGNMENT, 0, "{id}");
        }
    }

    #[test]
    fn arrays_are_written_at_multiples_of_eight() {
        let map = MapView { width: 1, height: 1, pixels: vec![0.5], integrals: vec![2.0] };
        let bytes = result(7, &Answer::Map(map));
        let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
        let header: Value = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
        let start = (4 + length).next_multiple_of(8);
        assert_eq!(header["result"]["pixels"], json!({ "array": "f32", "at": 0, "length": 1 }));
        assert_eq!(header["result"]["integrals"], json!({ "array": "f64", "at": 8, "length": 1 }));
        assert_eq!(bytes[start..start + 4], 0.5_f32.to_le_bytes());
        assert_eq!(bytes[start + 8..], 2.0_f64.to_le_bytes());
    }
}
