//! Shows a render while it is made in tev or HDRView.
//!
//! Both listen for tev's messages on a TCP port, little endian, strings ended by NUL: the length of the message, a byte for
//! its kind, and its content (`Ipc.h` of tev). A thread sends them. Tiles that wait are replaced by newer ones, so neither a
//! slow viewer nor one that never reads holds up the render. The tiles being worked on are outlined.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Write as _};
use std::net::{TcpStream, ToSocketAddrs as _};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use domelight::picture::exr::{ExrLayers, Plane};
use domelight::render::{Layers, TileView, Window};

/// Where viewers listen.
pub const ADDRESS: &str = "127.0.0.1:14158";

/// How long [`is_listening`] waits.
const MOMENT: Duration = Duration::from_millis(300);

/// Whether a viewer accepts connections at an address.
pub fn is_listening(address: &str) -> bool {
    let found = address.to_socket_addrs().ok().and_then(|mut all| all.next());
    found.is_some_and(|address| TcpStream::connect_timeout(&address, MOMENT).is_ok())
}

/// How long a viewer may take to accept a connection, or to read anything.
const PATIENCE: Duration = Duration::from_secs(3);

/// Rows of a message of the finished picture.
const BAND: usize = 64;

/// A picture in a viewer.
#[derive(Debug)]
pub struct Display {
    name: String,
    shared: Arc<Shared>,
    worker: Mutex<Option<JoinHandle<()>>>,
}

#[derive(Debug, Default)]
struct Shared {
    waiting: Mutex<Waiting>,
    changed: Condvar,
}

/// What the viewer does not have yet.
#[derive(Debug, Default)]
struct Waiting {
    /// The newest message of each window, by its corner.
    messages: BTreeMap<[usize; 2], Vec<u8>>,
    /// The tiles being worked on, as corner and size.
    tiles: BTreeSet<[usize; 4]>,
    /// Whether they have changed since they were sent.
    is_outdated: bool,
    /// No more will come.
    is_over: bool,
    /// Why the viewer gets no more.
    broken: Option<io::Error>,
}

impl Shared {
    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Display {
    /// Connects to the viewer at `address` and opens a picture named `name` of that size.
    ///
    /// # Errors
    /// If the address is invalid, or nothing listens there.
    pub fn connect(address: &str, name: &str, [width, height]: [usize; 2]) -> io::Result<Self> {
        let mut addresses = address.to_socket_addrs()?;
        let address = addresses.next().ok_or(io::ErrorKind::AddrNotAvailable)?;
        let mut stream = TcpStream::connect_timeout(&address, PATIENCE)?;
        stream.set_write_timeout(Some(PATIENCE))?;
        stream.set_nodelay(true)?;
        let names = channels(&Layers::new(1, 1).to_exr(Vec::new()));
        let names: Vec<&str> = names.iter().map(|(name, _)| &name[..]).collect();
        stream.write_all(&create_image(name, [width, height], &names))?;
        let shared = Arc::<Shared>::default();
        let (of_worker, of_picture) = (shared.clone(), name.to_owned());
        let worker = std::thread::spawn(move || send(&of_worker, &of_picture, &mut stream));
        Ok(Self { name: name.to_owned(), shared, worker: Mutex::new(Some(worker)) })
    }

    /// Outlines a tile that is being worked on, soon.
    pub fn outline(&self, window: Window) {
        self.change_tiles(|tiles| tiles.insert(corner_and_size(window)));
    }

    /// Shows a tile, soon.
    pub fn show(&self, tile: &TileView) {
        if self.shared.waiting().broken.is_none() {
            self.change_tiles(|tiles| tiles.remove(&corner_and_size(tile.window())));
            self.put(tile.window(), &tile.layers());
        }
    }

    fn change_tiles(&self, change: impl FnOnce(&mut BTreeSet<[usize; 4]>) -> bool) {
        let mut waiting = self.shared.waiting();
        waiting.is_outdated |= change(&mut waiting.tiles);
        self.shared.changed.notify_one();
    }

    /// Shows the finished picture, waits until the viewer has it, and returns why it does not.
    ///
    /// # Errors
    /// If the connection broke.
    pub fn finish(&self, layers: &Layers) -> io::Result<()> {
        let (width, height) = (layers.width(), layers.height());
        let whole = channels(&layers.to_exr(Vec::new()));
        self.change_tiles(|tiles| !std::mem::take(tiles).is_empty());
        for y in (0..height).step_by(BAND) {
            let window = Window { x: 0, y, width, height: BAND.min(height - y) };
            let rows = y * width..(y + window.height) * width;
            let band: Vec<_> =
                whole.iter().map(|(name, values)| (name.clone(), &values[rows.clone()])).collect();
            let message = update_image(&self.name, window, &band);
            let mut waiting = self.shared.waiting();
            if y == 0 {
                waiting.messages.clear();
            }
            waiting.messages.insert([y, 0], message);
        }
        self.close();
        match self.shared.waiting().broken.take() {
            Some(error) => Err(error),
            None => Ok(()),
        }
    }

    fn put(&self, window: Window, layers: &Layers) {
        let channels = channels(&layers.to_exr(Vec::new()));
        let channels: Vec<_> = channels.iter().map(|(name, v)| (name.clone(), &v[..])).collect();
        let message = update_image(&self.name, window, &channels);
        self.shared.waiting().messages.insert([window.y, window.x], message);
        self.shared.changed.notify_one();
    }

    /// Lets the worker send the rest and waits for it.
    fn close(&self) {
        self.shared.waiting().is_over = true;
        self.shared.changed.notify_one();
        let worker = self.worker.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(worker) = worker {
            _ = worker.join();
        }
    }
}

/// The viewer gets what waits.
impl Drop for Display {
    fn drop(&mut self) {
        self.close();
    }
}

/// Sends what waits until no more comes, or the viewer is gone.
fn send(shared: &Shared, name: &str, stream: &mut TcpStream) {
    loop {
        let mut waiting = shared.waiting();
        let message = loop {
            if let Some((_, message)) = waiting.messages.pop_first() {
                break message;
            }
            if std::mem::take(&mut waiting.is_outdated) {
                break outlines(name, &waiting.tiles);
            }
            if waiting.is_over {
                return;
            }
            waiting = shared.changed.wait(waiting).unwrap_or_else(PoisonError::into_inner);
        };
        drop(waiting);
        if let Err(error) = stream.write_all(&message) {
            let mut waiting = shared.waiting();
            waiting.broken = Some(error);
            waiting.messages.clear();
            return;
        }
    }
}

fn corner_and_size(window: Window) -> [usize; 4] {
    [window.x, window.y, window.width, window.height]
}

/// The channels of layers with their full names; counts as numbers.
fn channels(layers: &ExrLayers) -> Vec<(String, Vec<f32>)> {
    let all = layers.layers.iter().flat_map(|layer| {
        layer.channels.iter().map(|(channel, plane)| {
            let name = match &layer.name[..] {
                "" => channel.clone(),
                layer => format!("{layer}.{channel}"),
            };
            (name, values(plane))
        })
    });
    all.collect()
}

fn values(plane: &Plane) -> Vec<f32> {
    match plane {
        Plane::Float(values) => values.clone(),
        Plane::Uint(values) => values.iter().map(|&n| n as f32).collect(),
    }
}

/// A message under construction.
struct Message(Vec<u8>);

impl Message {
    /// The length is known at the end.
    fn new(kind: u8) -> Self {
        // The window of the viewer keeps its focus.
        Self(vec![0, 0, 0, 0, kind, 0])
    }

    fn string(mut self, text: &str) -> Self {
        // A NUL would end it.
        self.0.extend(text.bytes().filter(|&byte| byte != 0));
        self.0.push(0);
        self
    }

    fn byte(mut self, value: u8) -> Self {
        self.0.push(value);
        self
    }

    fn int(mut self, value: usize) -> Self {
        self.0.extend((value as i32).to_le_bytes());
        self
    }

    fn long(mut self, value: usize) -> Self {
        self.0.extend((value as i64).to_le_bytes());
        self
    }

    fn floats(mut self, values: &[f32]) -> Self {
        self.0.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        self
    }

    fn finish(mut self) -> Vec<u8> {
        let length = self.0.len() as u32;
        self.0[..4].copy_from_slice(&length.to_le_bytes());
        self.0
    }
}

/// `CreateImage`: name, size and channels.
fn create_image(name: &str, [width, height]: [usize; 2], channels: &[&str]) -> Vec<u8> {
    let message = Message::new(4).string(name).int(width).int(height).int(channels.len());
    channels.iter().fold(message, |message, channel| message.string(channel)).finish()
}

/// `VectorGraphics` instead of the earlier ones: a white rectangle around each tile.
fn outlines(name: &str, tiles: &BTreeSet<[usize; 4]>) -> Vec<u8> {
    const MOVE: u8 = 2;
    const LINE: u8 = 3;
    const COLOR: u8 = 5;
    const STROKE: u8 = 7;
    const BEGIN: u8 = 8;
    let commands = if tiles.is_empty() { 0 } else { 3 + 5 * tiles.len() };
    let mut message = Message::new(8).string(name).byte(0).int(commands);
    if tiles.is_empty() {
        return message.finish();
    }
    message = message.byte(BEGIN);
    for &[x, y, width, height] in tiles {
        let corners = [[0, 0], [width, 0], [width, height], [0, height], [0, 0]];
        for (i, [dx, dy]) in corners.into_iter().enumerate() {
            let at = [x + dx, y + dy].map(|c| c as f32);
            message = message.byte(if i == 0 { MOVE } else { LINE }).floats(&at);
        }
    }
    message.byte(COLOR).floats(&[1.0; 4]).byte(STROKE).finish()
}

/// `UpdateImage` of version 3: the channels' values one after the other.
fn update_image(name: &str, window: Window, channels: &[(String, &[f32])]) -> Vec<u8> {
    let Window { x, y, width, height } = window;
    let mut message = Message::new(6).string(name).int(channels.len());
    message = channels.iter().fold(message, |message, (name, _)| message.string(name));
    message = message.int(x).int(y).int(width).int(height);
    message = (0..channels.len()).fold(message, |message, i| message.long(i * width * height));
    message = channels.iter().fold(message, |message, _| message.long(1));
    channels.iter().fold(message, |message, (_, values)| message.floats(values)).finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;
    use std::io::Read as _;
    use std::net::TcpListener;
    use std::time::Instant;

    use domelight::environment::{Environment, Orientation, builtin::BuiltinProbe};
    use domelight::render::{Observer, RenderSettings, Renderer};
    use domelight::scene::{Camera, Scene, builtin::BuiltinScene};

    struct Showing<'a>(&'a Display);

    impl Observer for Showing<'_> {
        fn tile_started(&self, window: Window) {
            self.0.outline(window);
        }

        fn tile_rendered(&self, tile: &TileView) {
            self.0.show(tile);
        }
    }

    fn render(mut watch: impl FnMut(&mut Renderer)) {
        let scene = Scene::new(BuiltinScene::Sphere.description()).unwrap();
        let map = BuiltinProbe::Sky.image(16);
        let environment = Environment::new(map, Orientation::default(), 1.0).unwrap();
        let settings =
            RenderSettings { width: 70, height: 90, n_samples: 4, ..RenderSettings::default() };
        let camera = Camera::framing(&scene, 70, 90);
        let strategy = "product:2".parse().unwrap();
        let mut renderer =
            Renderer::new(&scene, &camera, &environment, strategy, settings).unwrap();
        watch(&mut renderer);
    }

    /// Reads a message's content piece by piece.
    struct Content<'a>(&'a [u8]);

    impl Content<'_> {
        fn take<const N: usize>(&mut self) -> [u8; N] {
            let (head, tail) = self.0.split_at(N);
            self.0 = tail;
            head.try_into().unwrap()
        }

        fn string(&mut self) -> String {
            let end = self.0.iter().position(|&byte| byte == 0).unwrap();
            let text = String::from_utf8(self.0[..end].to_vec()).unwrap();
            self.0 = &self.0[end + 1..];
            text
        }

        fn int(&mut self) -> usize {
            i32::from_le_bytes(self.take()) as usize
        }

        fn long(&mut self) -> usize {
            i64::from_le_bytes(self.take()) as usize
        }
    }

    /// The number of rectangles in a message of vector graphics, each of which must lie within the picture.
    fn rectangles(mut content: Content, [columns, rows]: [f32; 2]) -> usize {
        assert_eq!(content.take::<1>(), [0]);
        let (commands, mut moves) = (content.int(), 0);
        for _ in 0..commands {
            let [command] = content.take::<1>();
            let n_floats = match command {
                2 | 3 => 2,
                5 => 4,
                7 | 8 => 0,
                other => panic!("command {other}"),
            };
            let floats: Vec<f32> =
                (0..n_floats).map(|_| f32::from_le_bytes(content.take())).collect();
            moves += usize::from(command == 2);
            if let [x, y] = floats[..] {
                assert!((0.0..=columns).contains(&x) && (0.0..=rows).contains(&y));
            }
        }
        assert!(content.0.is_empty());
        moves
    }

    /// The viewer's picture after all messages: values by channel.
    fn view(mut stream: TcpStream) -> HashMap<String, Vec<f32>> {
        let mut bytes = Vec::new();
        stream.read_to_end(&mut bytes).unwrap();
        let mut rest = &bytes[..];
        let mut picture = HashMap::new();
        let mut outlined = Vec::new();
        let mut columns = 0;
        while !rest.is_empty() {
            let length = u32::from_le_bytes(rest[..4].try_into().unwrap()) as usize;
            let mut content = Content(&rest[6..length]);
            let kind = rest[4];
            rest = &rest[length..];
            assert_eq!(content.string(), "a picture");
            if kind == 4 {
                let (width, height) = (content.int(), content.int());
                columns = width;
                for _ in 0..content.int() {
                    picture.insert(content.string(), vec![f32::NAN; width * height]);
                }
                continue;
            }
            if kind == 8 {
                outlined.push(rectangles(content, [70.0, 90.0]));
                continue;
            }
            assert_eq!(kind, 6);
            let names: Vec<String> = (0..content.int()).map(|_| content.string()).collect();
            let [x, y, width, height] = [(); 4].map(|()| content.int());
            let offsets: Vec<_> = names.iter().map(|_| content.long()).collect();
            let strides: Vec<_> = names.iter().map(|_| content.long()).collect();
            let data: Vec<f32> =
                content.0.chunks(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
            for (i, name) in names.iter().enumerate() {
                let plane = picture.get_mut(name).unwrap();
                for p in 0..width * height {
                    plane[(y + p / width) * columns + x + p % width] =
                        data[offsets[i] + p * strides[i]];
                }
            }
        }
        // Of tiles that were being worked on, none is left.
        assert_eq!(outlined.last(), Some(&0));
        picture
    }

    #[test]
    fn tiles_are_outlined() {
        let tiles = BTreeSet::from([[0, 0, 16, 16], [48, 80, 22, 10]]);
        for (tiles, n) in [(tiles, 2), (BTreeSet::new(), 0)] {
            let bytes = outlines("a picture", &tiles);
            assert_eq!(
                (bytes[..4].to_vec(), bytes[4]),
                ((bytes.len() as u32).to_le_bytes().to_vec(), 8)
            );
            let mut content = Content(&bytes[6..]);
            assert_eq!(content.string(), "a picture");
            assert_eq!(rectangles(content, [70.0, 90.0]), n);
        }
    }

    #[test]
    fn a_viewer_has_the_bits_of_every_layer() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let viewer = std::thread::spawn(move || view(listener.accept().unwrap().0));
        render(|renderer| {
            let display = Display::connect(&address, "a picture", [70, 90]).unwrap();
            renderer.run(&Showing(&display));
            display.finish(&renderer.rendering().layers).unwrap();
        });
        let seen = viewer.join().unwrap();
        render(|renderer| {
            renderer.run(&());
            let layers = renderer.rendering().layers;
            let expected = channels(&layers.to_exr(Vec::new()));
            assert_eq!(seen.len(), expected.len());
            for (name, values) in expected {
                let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(&seen[&name]), bits(&values), "{name}");
            }
        });
    }

    /// Neither a viewer that leaves nor one that never reads holds up the render or changes it.
    #[test]
    fn viewers_that_do_not_read_change_nothing() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        render(|renderer| {
            let display = Display::connect(&address, "a picture", [70, 90]).unwrap();
            drop(listener.accept().unwrap());
            let start = Instant::now();
            renderer.run(&Showing(&display));
            let layers = renderer.rendering().layers;
            // The end may come before the system notices; then there is no error either.
            _ = display.finish(&layers);
            assert!(start.elapsed() < 4 * PATIENCE);
            assert!(renderer.is_complete());
        });
        drop(listener);
        assert!(Display::connect(&address, "a picture", [70, 90]).is_err());
        assert!(Display::connect("nowhere", "a picture", [70, 90]).is_err());
    }
}
