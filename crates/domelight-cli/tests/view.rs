//! `domelight view`, with a stand-in for the page: its protocol, and what others on the computer may try.

#[cfg(unix)]
use crate::common::interrupted;
use crate::common::{domelight, load, stderr};
use serde_json::{Value, json};
use std::fs;
use std::io::{BufRead as _, BufReader, ErrorKind, Read as _, Write as _};
use std::net::{Shutdown, TcpStream};
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use tempfile::TempDir;
use tungstenite::client::IntoClientRequest as _;
use tungstenite::{Message, WebSocket};

const PAGE: &str = "<!doctype html>\n<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:\">\n\
                    <meta name=\"native\" content=\"\">\n<title>domelight</title>\n";

/// As long as a busy machine may take.
const PATIENCE: Duration = Duration::from_secs(30);

/// A running program.
struct View {
    child: Child,
    /// `127.0.0.1:PORT`.
    server: String,
    token: String,
    /// What follows `#` in its address.
    state: String,
}

impl View {
    fn start(folder: &TempDir, arguments: &[&str]) -> Self {
        fs::write(folder.path().join("page.html"), PAGE).unwrap();
        let mut child = Command::new(env!("CARGO_BIN_EXE_domelight"))
            .args(["view", "--no-open", "--page=page.html", "-q", "--threads=2"])
            .args(arguments)
            .current_dir(folder)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let address = line.trim().strip_prefix("http://").expect("an address");
        let (address, state) = address.split_once('#').unwrap();
        let (server, token) = address.split_once('/').unwrap();
        let [server, token, state] =
            [server, token.trim_end_matches('/'), state].map(str::to_owned);
        Self { child, server, token, state }
    }

    /// What the server answers to some bytes, if the other side sends no more.
    fn answer(&self, request: &[u8]) -> String {
        let mut stream = TcpStream::connect(&self.server).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        // The server may refuse before it has read all.
        let _ = stream.write_all(request);
        let _ = stream.shutdown(Shutdown::Write);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        String::from_utf8_lossy(&answer).into_owned()
    }

    /// A request for a path below the token, with the right host.
    fn get(&self, path: &str, headers: &str) -> String {
        let Self { server, token, .. } = self;
        self.answer(
            format!("GET /{token}/{path} HTTP/1.1\r\nHost: {server}\r\n{headers}\r\n").as_bytes(),
        )
    }

    fn serves_its_page(&self) -> bool {
        self.get("", "").ends_with("<title>domelight</title>\n")
    }

    fn engine(&self) -> Engine {
        let Self { server, token, .. } = self;
        let mut request = format!("ws://{server}/{token}/engine").into_client_request().unwrap();
        request.headers_mut().insert("Origin", format!("http://{server}").parse().unwrap());
        let stream = TcpStream::connect(server).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let (socket, _) = tungstenite::client(request, stream).expect("a socket");
        Engine { socket, n_calls: 0 }
    }
}

impl Drop for View {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The page's end of a socket.
struct Engine {
    socket: WebSocket<TcpStream>,
    n_calls: u64,
}

/// A message: its header and its arrays.
struct Incoming {
    header: Value,
    arrays: Vec<u8>,
}

impl Incoming {
    /// The numbers of an array.
    fn floats(&self, place: &Value) -> Vec<f32> {
        assert_eq!(place["array"], "f32", "{place}");
        let [at, length] = ["at", "length"].map(|key| place[key].as_u64().unwrap() as usize);
        let bytes = self.arrays[at..at + 4 * length].as_chunks().0;
        bytes.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect()
    }

    fn words(&self, place: &Value) -> Vec<usize> {
        assert_eq!(place["array"], "u32", "{place}");
        let [at, length] = ["at", "length"].map(|key| place[key].as_u64().unwrap() as usize);
        let bytes = self.arrays[at..at + 4 * length].as_chunks().0;
        bytes.iter().map(|&bytes| u32::from_le_bytes(bytes) as usize).collect()
    }
}

fn message(header: &str, arrays: &[u8]) -> Vec<u8> {
    let mut bytes = (header.len() as u32).to_le_bytes().to_vec();
    bytes.extend_from_slice(header.as_bytes());
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes.extend_from_slice(arrays);
    bytes
}

impl Engine {
    fn send(&mut self, header: &Value) {
        let bytes = message(&header.to_string(), &[]);
        self.socket.send(Message::Binary(bytes.into())).unwrap();
    }

    fn receive(&mut self) -> Incoming {
        loop {
            let Message::Binary(bytes) = self.socket.read().expect("a message") else { continue };
            let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
            let header = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
            let start = (4 + length).next_multiple_of(8).min(bytes.len());
            return Incoming { header, arrays: bytes[start..].to_vec() };
        }
    }

    /// Says that the page has shown an update.
    fn acknowledge(&mut self) {
        self.socket.send(Message::Text("".into())).unwrap();
    }

    /// The result of a call, or its error.
    fn call(&mut self, call: &str, args: &Value) -> Result<Value, String> {
        self.n_calls += 1;
        self.send(&json!({ "kind": "call", "id": self.n_calls, "call": call, "args": args }));
        let Incoming { header, .. } = self.receive();
        assert_eq!(header["id"], self.n_calls, "{header}");
        match header["error"].as_str() {
            Some(error) => Err(error.to_owned()),
            None => Ok(header["result"].clone()),
        }
    }

    fn load_scene(&mut self, scene: &str) -> Result<Value, String> {
        let setup = json!({ "scene": scene, "material": "", "ground": false });
        self.call("loadScene", &json!([setup.to_string()]))
    }

    fn load_light(&mut self, probe: &str) -> Result<Value, String> {
        let light = json!({ "probe": probe, "rows": 16, "rotate": 30, "scale": 1, "exposure": 0 });
        self.call("loadEnvironment", &json!([light.to_string()]))
    }

    /// Whether the program ends the connection after some bytes.
    fn closes_after(mut self, bytes: &[u8]) -> bool {
        self.socket.get_mut().write_all(bytes).unwrap();
        loop {
            match self.socket.read() {
                Err(tungstenite::Error::Io(error)) if error.kind() == ErrorKind::WouldBlock => {
                    return false;
                }
                Ok(Message::Close(_)) | Err(_) => return true,
                Ok(Message::Binary(_) | Message::Text(_)) => return false,
                Ok(_) => {}
            }
        }
    }
}

/// A frame of a client, masked with zeros.
fn frame(opcode: u8, payload: &[u8]) -> Vec<u8> {
    assert!(payload.len() < 126);
    let head = [0x80 | opcode, 0x80 | payload.len() as u8, 0, 0, 0, 0];
    [&head[..], payload].concat()
}

const RENDER: &str = r#"{"width":40,"height":40,"spp":3,"strategy":"mis:1:1","seed":5,"hideEnvironment":false,"camera":null,"shard":[0,1]}"#;

#[test]
fn pictures_arrive_in_tiles_with_the_bits_of_render() {
    let folder = TempDir::new().unwrap();
    let view = View::start(&folder, &["sphere", "--env=studio", "--env-rows=16", "--size=40x40"]);
    assert!(view.state.starts_with("scene=sphere&env=studio&"), "{}", view.state);
    let mut engine = view.engine();
    engine.load_scene("sphere").unwrap();
    engine.load_light("studio").unwrap();
    engine.send(&json!({ "kind": "render", "token": 3, "settings": RENDER }));
    let started = engine.receive().header;
    assert_eq!(started, json!({ "kind": "started", "token": 3, "strategy": "mis:1:1" }));
    let mut picture = vec![[0.0; 3]; 40 * 40];
    loop {
        let update = engine.receive();
        assert_eq!(
            (&update.header["kind"], &update.header["token"]),
            (&"update".into(), &3.into())
        );
        let pixels = update.floats(&update.header["pixels"]);
        let mut pixels = pixels.as_chunks::<4>().0.iter();
        for &[x, y, width, height] in update.words(&update.header["windows"]).as_chunks().0 {
            for (row, column) in (y..y + height).flat_map(|y| (x..x + width).map(move |x| (y, x))) {
                let &[r, g, b, _] = pixels.next().expect("as many pixels as the windows have");
                picture[row * 40 + column] = [r, g, b];
            }
        }
        engine.acknowledge();
        if update.header["complete"] == true {
            assert_eq!(update.header["statistics"]["complete"], true);
            break;
        }
    }
    let words = "render sphere --env=studio --env-rows=16 --env-rotate=30 --size=40x40 --spp=3 --strategy=mis:1:1 --seed=5 \
                 --passes=doubling -o a.exr -q";
    let output =
        domelight(&folder, &words.split(' ').filter(|w| !w.is_empty()).collect::<Vec<_>>());
    assert!(output.status.success(), "{}", stderr(&output));
    let expected: Vec<_> = load(&folder, "a.exr").pixels.iter().map(|c| c.to_array()).collect();
    assert_eq!(picture, expected);
}

#[test]
fn a_slow_page_has_one_update_before_it() {
    let folder = TempDir::new().unwrap();
    let view = View::start(&folder, &[]);
    let mut engine = view.engine();
    engine.load_scene("sphere").unwrap();
    engine.load_light("studio").unwrap();
    // Each pass ends with an update, and there are three.
    engine.send(&json!({ "kind": "render", "token": 1, "settings": RENDER }));
    assert_eq!(engine.receive().header["kind"], "started");
    let update = |token: i64| json!({ "kind": "update", "token": token });
    let next = |engine: &mut Engine| {
        let header = engine.receive().header;
        json!({ "kind": header["kind"], "token": header["token"] })
    };
    assert_eq!(next(&mut engine), update(1));
    // Nothing stands before the answer of a call and that of another picture.
    engine.call("automaticExposure", &json!([RENDER])).unwrap();
    engine.send(&json!({ "kind": "render", "token": 2, "settings": RENDER }));
    assert_eq!(engine.receive().header["kind"], "started");
    engine.call("automaticExposure", &json!([RENDER])).unwrap();
    for pass in 1..=3 {
        engine.acknowledge();
        assert_eq!(next(&mut engine), update(2), "{pass}");
        engine.call("automaticExposure", &json!([RENDER])).unwrap();
    }
}

#[test]
fn the_page_is_told_its_files_and_opens_no_others() {
    let folder = TempDir::new().unwrap();
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    for name in ["named.obj", "other.obj"] {
        fs::write(folder.path().join(name), triangle).unwrap();
    }
    let view = View::start(&folder, &["named.obj"]);
    let page = view.get("", "");
    assert!(page.contains("content=\"[&quot;named.obj&quot;]\""), "{page}");
    assert!(page.contains(&format!("connect-src ws://{}", view.server)), "{page}");
    assert!(page.contains("\r\nX-Frame-Options: DENY\r\n"), "{page}");
    let mut engine = view.engine();
    let report = engine.load_scene("named.obj").unwrap();
    assert!(report.as_str().unwrap().contains("\"triangles\":1"), "{report}");
    for name in ["other.obj", "./named.obj", "../named.obj", "/etc/passwd", "page.html", ""] {
        let error = engine.load_scene(name).unwrap_err();
        assert!(error.contains("it was not dropped on the page"), "{error}");
        let error = engine.load_light(name).unwrap_err();
        assert!(error.contains("it was not dropped on the page"), "{error}");
    }
    // A scene from the page reads nothing of the disk.
    let scene = "mesh = \"other.obj\"\n";
    let header = json!({ "kind": "call", "id": 0, "call": "addFile",
        "args": ["a.toml", { "array": "u8", "at": 0, "length": scene.len() }] });
    let bytes = message(&header.to_string(), scene.as_bytes());
    engine.socket.send(Message::Binary(bytes.into())).unwrap();
    assert_eq!(engine.receive().header["kind"], "result");
    engine.load_scene("a.toml").unwrap_err();
}

#[test]
fn requests_of_others_are_refused() {
    let folder = TempDir::new().unwrap();
    let view = View::start(&folder, &[]);
    let View { server, token, .. } = &view;
    let port = server.rsplit(':').next().unwrap();
    let get = |path: &str, headers: &str| format!("GET {path} HTTP/1.1\r\n{headers}\r\n");
    let ours = format!("Host: {server}\r\n");
    let page = format!("/{token}/");
    let socket = format!("/{token}/engine");
    let upgrade = "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
                   Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    let wrong = "0".repeat(32);
    let requests = [
        ("no token", "404", get("/", &ours)),
        ("a wrong token", "404", get(&format!("/{wrong}/"), &ours)),
        ("half a token", "404", get(&format!("/{}/", &token[..16]), &ours)),
        ("a file", "404", get(&format!("{page}page.html"), &ours)),
        ("path traversal", "404", get(&format!("{page}../../etc/passwd"), &ours)),
        ("encoded traversal", "404", get(&format!("{page}%2e%2e/%2e%2e/etc/passwd"), &ours)),
        ("another server's page", "404", get(&format!("http://{server}{page}"), &ours)),
        ("no host", "400", get(&page, "")),
        ("two hosts", "400", get(&page, &format!("{ours}{ours}"))),
        ("a name that leads here", "403", get(&page, &format!("Host: evil.example:{port}\r\n"))),
        ("another port", "403", get(&page, "Host: 127.0.0.1:1\r\n")),
        ("a foreign page", "403", get(&page, &format!("{ours}Origin: https://evil.example\r\n"))),
        ("a page of a file", "403", get(&page, &format!("{ours}Origin: null\r\n"))),
        ("another method", "405", get(&page, &ours).replacen("GET", "DELETE", 1)),
        ("a long header", "431", get(&page, &format!("{ours}A: {}\r\n", "b".repeat(1 << 20)))),
        ("many headers", "431", get(&page, &format!("{ours}{}", "A: b\r\n".repeat(1000)))),
        ("half a request", "400", get(&page, &ours)[..20].to_owned()),
        ("nothing", "400", String::new()),
        ("another protocol", "400", "\x16\x03\x01\x02\x00\x01\x00\r\n\r\n".to_owned()),
        ("a socket of no page", "403", get(&socket, &format!("{ours}{upgrade}"))),
        (
            "a socket of a foreign page",
            "403",
            get(&socket, &format!("{ours}Origin: http://evil.example\r\n{upgrade}")),
        ),
        (
            "a socket with a wrong token",
            "404",
            get(
                &format!("/{wrong}/engine"),
                &format!("{ours}Origin: http://{server}\r\n{upgrade}"),
            ),
        ),
        (
            "a socket that is none",
            "400",
            get(&socket, &format!("{ours}Origin: http://{server}\r\nUpgrade: websocket\r\n")),
        ),
    ];
    for (what, status, request) in &requests {
        let answer = view.answer(request.as_bytes());
        assert!(answer.starts_with(&format!("HTTP/1.1 {status} ")), "{what}: {answer}");
        assert!(!answer.contains("<title>") && !answer.contains("root:"), "{what}: {answer}");
        assert!(!answer.contains(token.as_str()), "{what}: {answer}");
    }
    let latin = [get(&page, &ours).trim_end().as_bytes(), b"\r\nA: \xff\r\n\r\n"].concat();
    assert!(view.answer(&latin).starts_with("HTTP/1.1 400 "));
    assert!(view.get("", "").starts_with("HTTP/1.1 200 OK\r\n"));
    let local = get(&page, &format!("Host: LOCALHOST:{port}\r\n"));
    assert!(view.answer(local.as_bytes()).starts_with("HTTP/1.1 200 OK\r\n"));
}

#[test]
fn messages_that_are_none_end_their_connection_alone() {
    const TEXT: u8 = 1;
    const BINARY: u8 = 2;
    let folder = TempDir::new().unwrap();
    let view = View::start(&folder, &[]);
    let mut first = view.engine();
    first.load_scene("sphere").unwrap();
    let header = |text: &str| frame(BINARY, &message(text, &[]));
    let far =
        r#"{"kind":"call","id":0,"call":"addPart","args":[{"array":"u8","at":9,"length":9}]}"#;
    let oversize = [&[0x82, 0xff][..], &u64::MAX.to_be_bytes()[1..], &[0; 5]].concat();
    let messages = [
        ("text", frame(TEXT, b"{}")),
        ("an empty message", frame(BINARY, b"")),
        ("a message that is shorter than it says", frame(BINARY, b"\xff\xff\xff\x7f{}")),
        ("no JSON", header("{")),
        ("no request", header("{}")),
        ("an unknown request", header(r#"{"kind":"exec","id":0}"#)),
        ("a request with more", header(r#"{"kind":"stop","file":"/etc/passwd"}"#)),
        ("an array out of the message", frame(BINARY, &message(far, &[]))),
        ("an oversize message", oversize),
        ("a frame without a mask", [&[0x82, 4][..], b"\x02\0\0\0"].concat()),
        ("no frame", vec![0xff; 64]),
        ("HTTP", b"GET / HTTP/1.1\r\n\r\n".to_vec()),
    ];
    for (what, bytes) in messages {
        assert!(view.engine().closes_after(&bytes), "{what}");
    }
    // Each viewer has an engine of its own.
    let mut second = view.engine();
    let unloaded = second.call("point", &json!(["{}"])).unwrap_err();
    assert!(
        unloaded.starts_with("settings: ") || unloaded.starts_with("there is no scene"),
        "{unloaded}"
    );
    // What is wrong within a call is its error.
    let mut refused = |call: &str, args: &Value| first.call(call, args).unwrap_err();
    assert_eq!(refused("readFile", &json!(["/etc/passwd"])), "there is no call \"readFile\"");
    assert_eq!(refused("map", &json!([])), "map: the number of arguments is wrong");
    assert_eq!(refused("map", &json!([1e300])), "map: there is no such width");
    assert!(refused("loadScene", &json!(["{"])).starts_with("settings: "));
    first.send(&json!({ "kind": "render", "token": 1, "settings": "{}" }));
    assert_eq!(first.receive().header["kind"], "failed");
    let huge = RENDER.replace("40", "4000000000");
    first.send(&json!({ "kind": "render", "token": 2, "settings": huge }));
    assert_eq!(first.receive().header["kind"], "failed");
    first.load_scene("spheres").unwrap();
    assert!(view.serves_its_page());
}

#[test]
fn changes_of_files_are_told() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("a.obj");
    fs::write(&file, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let view = View::start(&folder, &["a.obj", "--watch"]);
    let mut engine = view.engine();
    assert!(engine.load_scene("a.obj").unwrap().as_str().unwrap().contains("\"triangles\":1"));
    fs::write(&file, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n").unwrap();
    assert_eq!(engine.receive().header, json!({ "kind": "changed" }));
    assert!(engine.load_scene("a.obj").unwrap().as_str().unwrap().contains("\"triangles\":2"));
}

#[test]
fn what_cannot_be_shown_is_refused() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("page.html"), PAGE).unwrap();
    fs::write(folder.path().join("other.html"), "<p>").unwrap();
    let refused = |arguments: &[&str], what: &str| {
        let arguments = [&["view", "--no-open"], arguments].concat();
        let output = domelight(&folder, &arguments);
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains(what), "{}", stderr(&output));
    };
    refused(&["--page=page.html", "missing.glb"], "missing.glb");
    refused(&["--page=page.html", "--env=-"], "-: the page reads it more than once; give a file");
    refused(&["--page=page.html", "--size=64x32"], "the page's pictures are square");
    refused(&["--page=page.html", "--dof=2.8,auto"], "the page cannot show --dof=2.8,auto");
    refused(&["--page=other.html"], "other.html: this is not the page of domelight");
    refused(&["--page=missing.html"], "missing.html");
    refused(&["--page=page.html", "--port=0"], "--port");
}

#[cfg(unix)]
#[test]
fn an_interruption_ends_it_without_a_complaint() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("page.html"), PAGE).unwrap();
    let arguments = ["view", "--no-open", "--page=page.html"];
    let output = interrupted(&folder, &arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(stderr(&output), "Ctrl-C ends it\n");
}
