//! A page of the server, and its requests by hand: what a browser would add must be seen.

use serde_json::Value;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::time::{Duration, Instant};
use supine_workstation::{Host, Open, open};

/// The waits of all tests end after this: the longest work takes half a minute, and much longer
/// where a machine has other work.
pub(crate) const PATIENCE: Duration = Duration::from_secs(600);

/// A server, and how to speak to it.
pub(crate) struct Page {
    pub(crate) port: u16,
    pub(crate) token: String,
    goes_on: Arc<AtomicBool>,
}

struct Starter {
    address: Sender<String>,
    goes_on: Arc<AtomicBool>,
}

impl Host for Starter {
    fn address(&self, address: &str) {
        self.address.send(address.into()).unwrap();
    }

    fn no_browser(&self, _: &str) {}

    fn go_on(&self) -> bool {
        self.goes_on.load(Ordering::SeqCst)
    }
}

impl Page {
    pub(crate) fn open(path: &Path) -> Self {
        Self::with_threads(path, 2)
    }

    pub(crate) fn with_threads(path: &Path, threads: usize) -> Self {
        Self::start(path, threads, None)
    }

    /// One that keeps unsaved changes in a folder.
    pub(crate) fn keeping(path: &Path, unsaved: &Path) -> Self {
        Self::start(path, 2, Some(unsaved.into()))
    }

    fn start(path: &Path, threads: usize, unsaved: Option<PathBuf>) -> Self {
        let (address, told) = channel();
        let goes_on = Arc::new(AtomicBool::new(true));
        let starter = Starter { address, goes_on: Arc::clone(&goes_on) };
        let given = Open {
            path: path.into(),
            look_through: true,
            port: 0,
            browser: false,
            nodes: vec![],
            threads,
            start: None,
            unsaved,
        };
        std::thread::spawn(move || open(&given, &starter).unwrap());
        let address = told.recv_timeout(PATIENCE).unwrap();
        let rest = address.strip_prefix("http://127.0.0.1:").unwrap();
        let (port, token) = rest.split_once("/#").unwrap();
        Self { port: port.parse().unwrap(), token: token.into(), goes_on }
    }

    pub(crate) fn ask(
        &self,
        first: &str,
        host: &str,
        headers: &[(&str, &str)],
        body: &[u8],
    ) -> Answer {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        let mut text = format!("{first} HTTP/1.1\r\nHost: {host}\r\n");
        if !headers.iter().any(|(name, _)| *name == "Connection") {
            text += "Connection: close\r\n";
        }
        for (name, value) in headers {
            text += &format!("{name}: {value}\r\n");
        }
        text += &format!("Content-Length: {}\r\n\r\n", body.len());
        stream.write_all(text.as_bytes()).unwrap();
        // One that is refused unread closes early.
        let _refused = stream.write_all(body);
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        Answer::read(stream)
    }

    fn own(&self, first: &str, body: &[u8]) -> Answer {
        let (host, bearer) = (format!("127.0.0.1:{}", self.port), format!("Bearer {}", self.token));
        self.ask(first, &host, &[("Authorization", &bearer)], body)
    }

    pub(crate) fn get(&self, path: &str) -> Answer {
        self.own(&format!("GET {path}"), b"")
    }

    pub(crate) fn post(&self, path: &str, body: &Value) -> Answer {
        self.own(&format!("POST {path}"), body.to_string().as_bytes())
    }

    /// The state once nothing is worked on.
    pub(crate) fn idle(&self) -> Value {
        self.state_once(|state| state["job"].is_null())
    }

    /// The state once it is as wanted.
    pub(crate) fn state_once(&self, wanted: impl Fn(&Value) -> bool) -> Value {
        let begun = Instant::now();
        loop {
            let state = self.get("/api/state").json();
            if wanted(&state) {
                return state;
            }
            assert!(begun.elapsed() < PATIENCE, "the work does not end: {state}");
            std::thread::sleep(Duration::from_millis(40));
        }
    }

    /// A socket that said a token; none when the server closed it.
    pub(crate) fn link(&self, token: &str) -> Option<Link> {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let host = format!("127.0.0.1:{}", self.port);
        let text = format!(
            "GET /api/link HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nConnection: Upgrade\r\n\
             Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
             Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
        );
        stream.write_all(text.as_bytes()).unwrap();
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            stream.read_exact(&mut byte).unwrap();
            head.push(byte[0]);
        }
        assert!(head.starts_with(b"HTTP/1.1 101"));
        let mut link = Link { stream };
        link.say(&serde_json::json!({ "token": token }).to_string());
        link.frame().map(|first| {
            assert!(first.starts_with("{\"state\""));
            Link { stream: link.stream.try_clone().unwrap() }
        })
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        self.goes_on.store(false, Ordering::SeqCst);
    }
}

/// An open socket.
pub(crate) struct Link {
    stream: TcpStream,
}

impl Link {
    /// A text frame, masked with zeros.
    pub(crate) fn say(&mut self, text: &str) {
        let length = u16::try_from(text.len()).unwrap();
        let mut frame = vec![0x81, 0x80 | u8::try_from(length).unwrap_or(126).min(126)];
        if length >= 126 {
            frame.extend(length.to_be_bytes());
        }
        frame.extend([0; 4]);
        frame.extend(text.as_bytes());
        self.stream.write_all(&frame).unwrap();
    }

    /// The next text; none when the socket closes.
    fn frame(&mut self) -> Option<String> {
        let (kind, bytes) = self.any()?;
        (kind == 0x81).then(|| String::from_utf8(bytes).ok())?
    }

    /// The next picture; texts before it are passed over.
    pub(crate) fn picture(&mut self) -> Vec<u8> {
        loop {
            if let (0x82, bytes) = self.any().unwrap() {
                return bytes;
            }
        }
    }

    fn any(&mut self) -> Option<(u8, Vec<u8>)> {
        let mut head = [0; 2];
        self.stream.read_exact(&mut head).ok()?;
        let length = match head[1] {
            126 => {
                let mut long = [0; 2];
                self.stream.read_exact(&mut long).ok()?;
                u64::from(u16::from_be_bytes(long))
            }
            127 => {
                let mut long = [0; 8];
                self.stream.read_exact(&mut long).ok()?;
                u64::from_be_bytes(long)
            }
            short => u64::from(short),
        };
        let mut text = vec![0; usize::try_from(length).unwrap()];
        self.stream.read_exact(&mut text).ok()?;
        Some((head[0], text))
    }

    pub(crate) fn next(&mut self) -> Value {
        serde_json::from_str(&self.frame().unwrap()).unwrap()
    }
}

/// An answer.
pub(crate) struct Answer {
    pub(crate) status: u16,
    headers: Vec<(String, String)>,
    pub(crate) body: Vec<u8>,
}

impl Answer {
    pub(crate) fn read(mut from: impl Read) -> Self {
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            from.read_exact(&mut byte).unwrap();
            head.push(byte[0]);
        }
        let head = String::from_utf8(head).unwrap();
        let mut lines = head.lines();
        let status = lines.next().unwrap().split(' ').nth(1).unwrap().parse().unwrap();
        let headers = lines.filter_map(|line| line.split_once(": "));
        let headers = headers.map(|(name, value)| (name.to_lowercase(), value.into())).collect();
        let mut answer = Self { status, headers, body: vec![] };
        answer.read_body(from);
        answer
    }

    /// The body: as long as it says, or up to the end of the connection. A socket stays open, and
    /// has none.
    fn read_body(&mut self, from: impl Read) {
        let length = self.header("content-length").map(|length| length.parse().unwrap());
        let most = if self.status == 101 { 0 } else { length.unwrap_or(u64::MAX) };
        // One that is refused unread closes early.
        let _refused = from.take(most).read_to_end(&mut self.body);
    }

    pub(crate) fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str())
    }

    pub(crate) fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }

    pub(crate) fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|_| panic!("{}", self.text()))
    }
}

pub(crate) fn patient() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/patient")
}

/// A case that is quickly run, and the page that shows its CT.
pub(crate) fn opened(dir: &Path) -> (PathBuf, Page) {
    let path = small(dir);
    let page = Page::open(&path);
    page.idle();
    (path, page)
}

/// A case that is quickly run.
pub(crate) fn small(dir: &Path) -> PathBuf {
    let text = std::fs::read_to_string(patient().join("case.toml")).unwrap();
    let mut table: toml::Table = text.parse().unwrap();
    table.insert("ct".into(), patient().join("ct").to_string_lossy().into_owned().into());
    table.insert("mesh".into(), toml::toml! { tetrahedra = 900 order = 1 }.into());
    table.remove("carry");
    let path = dir.join("case.toml");
    std::fs::write(&path, format!("# Looked at by nobody yet\n{table}")).unwrap();
    path
}
