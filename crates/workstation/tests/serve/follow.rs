//! A navigation that is followed: a navigator of the test's own says what one says.

use crate::client::{Link, PATIENCE, Page, patient, small};
use crate::live::read;
use serde_json::{Value, json};
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};
use supine_openigtlink::{
    Content, Endian, HEADER_BYTES, Header, Image, ImageFrame, ImageLayout, Message, PointItem,
    Query, Rows, Scalar, Stamp, Start, Status, StatusCode, Verb, Version,
};

/// A navigator with one peer.
struct Navigator {
    stream: TcpStream,
}

impl Navigator {
    /// Waits for a peer, and for its questions.
    fn serve(listener: &TcpListener) -> Self {
        let stream = accepted(listener);
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let mut navigator = Self { stream };
        let asked = [navigator.read(), navigator.read()];
        let wanted =
            [Query::new(Verb::Get, "STATUS"), Query::new(Verb::Start(Start::Plain), "TRANSFORM")];
        for (message, query) in asked.into_iter().zip(wanted) {
            assert_eq!((message.version, message.device.as_str()), (Version::Two, ""));
            assert_eq!(message.content, Content::Query(query));
        }
        navigator
    }

    fn read(&mut self) -> Message {
        let mut head = [0; HEADER_BYTES];
        self.stream.read_exact(&mut head).unwrap();
        let header = Header::read(&head).unwrap();
        let mut body = vec![0; usize::try_from(header.body).unwrap()];
        self.stream.read_exact(&mut body).unwrap();
        Message::read(&header, &body).unwrap()
    }

    fn say(&mut self, message: &Message) {
        let mut bytes = vec![];
        message.write(&mut bytes);
        self.stream.write_all(&bytes).unwrap();
    }

    fn status(&mut self, code: StatusCode, name: &str, text: &str) {
        let status = Content::Status(Status::new(code, name, text));
        self.say(&Message::new("supine", Stamp::NONE, status));
    }

    /// An answer as a navigator has it: its pose, then the place.
    fn answer(&mut self, n: u32, frame: &str, (rows, place): (Rows, [f32; 3]), state: &str) {
        let figures = [
            ("frame", frame),
            ("state", state),
            ("age_ms", "4.25"),
            ("within_95_mm", "unknown"),
            ("solver_error_mm", "0.0012"),
            ("moved_mm", "2.000 3.000 6.000"),
            ("force_n", "0.000 -0.300 0.400"),
            ("from_surface_mm", "7.50"),
            ("from_axis_mm", "21.25"),
            ("sphere_radius_mm", "20.00"),
            ("shaft_radius_mm", "6.00"),
        ];
        let item = PointItem {
            name: "Tumour".into(),
            group: state.into(),
            position: place,
            diameter: 18.0,
            ..PointItem::default()
        };
        for (device, content) in
            [("Applicator", Content::Transform(rows)), ("Tumour", Content::Points(vec![item]))]
        {
            let mut message = Message::new(device, Stamp(u64::from(n) << 32), content);
            (message.version, message.id) = (Version::Two, n);
            message.metadata = figures.map(|(key, value)| (key.into(), value.into())).into();
            self.say(&message);
        }
    }
}

/// The next who connects.
fn accepted(listener: &TcpListener) -> TcpStream {
    listener.set_nonblocking(true).unwrap();
    let begun = Instant::now();
    loop {
        if let Ok((stream, _)) = listener.accept() {
            // Those of a listener that does not block do not either, on some systems.
            stream.set_nonblocking(false).unwrap();
            return stream;
        }
        assert!(begun.elapsed() < PATIENCE, "nobody connects");
        std::thread::sleep(Duration::from_millis(10));
    }
}

const LPS: (Rows, [f32; 3]) = (
    [[1.0, 0.0, 0.0, 91.0], [0.0, 0.0, -1.0, -246.0], [0.0, 1.0, 0.0, -596.0]],
    [90.0, -240.0, -590.0],
);
const RAS: (Rows, [f32; 3]) = (
    [[-1.0, 0.0, 0.0, -91.0], [0.0, 0.0, 1.0, 246.0], [0.0, 1.0, 0.0, -596.0]],
    [-90.0, 240.0, -590.0],
);

/// The next navigation that is so; states before it are passed over.
fn until(link: &mut Link, holds: impl Fn(&Value) -> bool) -> Value {
    for _ in 0..2000 {
        let told = link.next();
        if !told["navigation"].is_null() && holds(&told["navigation"]) {
            return told["navigation"].clone();
        }
    }
    panic!("it does not become so");
}

fn numbered(n: u32) -> impl Fn(&Value) -> bool {
    move |told| told["answer"]["stamp"] == f64::from(n)
}

/// A server with a case, its socket, and where a navigator is expected.
fn opened(dir: &std::path::Path) -> (Page, Link, TcpListener) {
    let page = Page::open(&small(dir));
    page.idle();
    let link = page.link(&page.token).unwrap();
    (page, link, TcpListener::bind("127.0.0.1:0").unwrap())
}

fn follow(page: &Page, listener: &TcpListener) {
    let address = listener.local_addr().unwrap().to_string();
    assert_eq!(page.post("/api/follow", &json!({ "address": address })).status, 200);
}

#[test]
fn the_socket_carries_what_a_navigation_says_in_lps() {
    let dir = tempfile::tempdir().unwrap();
    let (page, mut link, listener) = opened(dir.path());
    follow(&page, &listener);
    let mut navigator = Navigator::serve(&listener);
    let told = until(&mut link, |told| told["phase"] == "following");
    assert_eq!(told["address"], listener.local_addr().unwrap().to_string());
    assert_eq!(told["answer"], Value::Null);
    navigator.answer(1, "LPS", LPS, "ok");
    let lps = until(&mut link, numbered(1))["answer"].clone();
    let wanted = json!({
        "state": "ok", "age_ms": 4.25, "within_mm": null, "moved_mm": 7.0, "from_surface_mm": 7.5, "from_axis_mm": 21.25,
        "force_n": 0.5, "solver_error_mm": 0.0012, "tumour": [90.0, -240.0, -590.0], "radius_mm": 9.0,
        "sphere_radius_mm": 20.0, "shaft_radius_mm": 6.0,
        "rest": [88.0, -243.0, -596.0], "centre": [91.0, -246.0, -596.0], "axis": [0.0, 1.0, 0.0], "stamp": 1.0,
    });
    assert_eq!(lps, wanted);
    // The same place in the other frame.
    navigator.answer(2, "RAS", RAS, "predicted");
    let told = until(&mut link, numbered(2));
    let ras = &told["answer"];
    for key in ["tumour", "centre", "axis", "moved_mm", "force_n"] {
        assert_eq!(ras[key], lps[key], "{key}");
    }
    assert_eq!((&ras["state"], told["rate"].is_f64()), (&json!("predicted"), true));
    // What happened is why it is stale, not that it is still so.
    navigator.answer(2, "RAS", RAS, "stale");
    navigator.status(StatusCode::NotReady, "Frozen", "the poses are equal");
    navigator.status(StatusCode::TimedOut, "Stale", "frame RAS; stale: Frozen");
    let told = until(&mut link, |told| told["status"] == "frame RAS; stale: Frozen");
    assert_eq!(
        (&told["answer"]["state"], &told["why"]),
        (&json!("stale"), &json!("the poses are equal"))
    );
    navigator.answer(3, "LPS", LPS, "ok");
    assert_eq!(until(&mut link, numbered(3))["why"], Value::Null);
    assert_eq!(page.post("/api/leave", &json!({})).status, 200);
    let told = until(&mut link, |told| told["phase"] == "off");
    assert_eq!(told["answer"], Value::Null);
    // The connection ends.
    let mut rest = vec![];
    assert!(navigator.stream.read_to_end(&mut rest).is_ok_and(|_| rest.is_empty()));
}

#[test]
fn junk_is_passed_over_and_said_and_what_is_too_large_ends_the_connection() {
    let dir = tempfile::tempdir().unwrap();
    let (page, mut link, listener) = opened(dir.path());
    follow(&page, &listener);
    let mut navigator = Navigator::serve(&listener);
    navigator.answer(1, "LPS", (LPS.0, [f32::NAN; 3]), "ok");
    let told = until(&mut link, |told| told["passed"] == 1);
    assert_eq!(
        (&told["answer"], &told["passed_why"]),
        (&Value::Null, &json!("the tumour\u{2019}s place is no place"))
    );
    // A wrong checksum, an unknown type, another frame.
    let mut bytes = vec![];
    Message::new("Tumour", Stamp::NONE, Content::Points(vec![PointItem::default()]))
        .write(&mut bytes);
    *bytes.last_mut().unwrap() ^= 1;
    navigator.stream.write_all(&bytes).unwrap();
    navigator.say(&Message::new("x", Stamp::NONE, Content::Unknown { kind: "SCANNER".into() }));
    navigator.answer(2, "MNI", LPS, "ok");
    navigator.answer(3, "LPS", LPS, "ok");
    let told = until(&mut link, numbered(3));
    assert!(told["passed"].as_u64().unwrap() >= 4 && told["answer"]["state"] == "ok", "{told}");
    // 32 MiB are announced.
    let mut bytes = vec![];
    navigator.status(StatusCode::Ok, "ok", "well");
    Message::new("x", Stamp::NONE, Content::Points(vec![])).write(&mut bytes);
    bytes[42..50].copy_from_slice(&(32_u64 << 20).to_be_bytes());
    navigator.stream.write_all(&bytes).unwrap();
    let told = until(&mut link, |told| told["phase"] == "gone");
    assert!(told["why"].as_str().unwrap().contains("33554432"), "{told}");
    // The last answer stays, and is none of now.
    assert_eq!(
        (&told["answer"]["state"], &told["answer"]["stamp"]),
        (&json!("stale"), &json!(3.0))
    );
}

/// 41 voxels of 1 mm a side about a place, all with one value.
fn cube(centre: [f32; 3], hu: i16) -> Content {
    let layout = ImageLayout {
        components: 1,
        scalar: Scalar::I16,
        endian: Endian::Little,
        frame: ImageFrame::Lps,
        size: [41; 3],
        steps: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        centre,
        start: [0; 3],
        extent: [41; 3],
    };
    let data = hu.to_le_bytes().repeat(41 * 41 * 41);
    Content::Image(Image::new(layout, data).unwrap())
}

#[test]
fn the_slices_are_those_of_the_navigation_where_it_sends_them() {
    let dir = tempfile::tempdir().unwrap();
    let (page, mut link, listener) = opened(dir.path());
    let ask = json!({ "applicator": {
        "ap": 7.0, "lat": 5.0, "planes": [["axial", 49], ["coronal", 54]], "followed": true,
        "centre": [91.0, -246.0, -596.0], "axis": [0.0, -1.0, 0.0], "radius": 15.0, "shaft": 5.0,
        "contact": "tied", "pose": { "shift": [0, 0, 0], "turn": [0, 0, 0] },
    } });
    // Nobody is followed: the table alone, and no place of the tumour.
    link.say(&ask.to_string());
    let alone = read(&link.picture());
    assert!(alone.rest[..5].iter().all(|number| number.is_nan()), "{:?}", alone.rest);
    follow(&page, &listener);
    let mut navigator = Navigator::serve(&listener);
    navigator.answer(1, "LPS", LPS, "ok");
    until(&mut link, numbered(1));
    let region = Message::new("Region", Stamp(1 << 32), cube([91.0, -246.0, -596.0], 777));
    let mut pictured = |navigator: &mut Navigator, region: Option<&Message>| {
        link.say(&ask.to_string());
        let asked = navigator.read();
        assert_eq!(asked.content, Content::Query(Query::new(Verb::Get, "IMAGE")));
        region.iter().for_each(|region| navigator.say(region));
        read(&link.picture())
    };
    // The page waits 0.3 s for it: one that came later, by other work on the machine, is asked for
    // again.
    let begun = Instant::now();
    let mut shown = pictured(&mut navigator, Some(&region));
    while shown.rest[0].is_nan() && begun.elapsed() < PATIENCE {
        shown = pictured(&mut navigator, Some(&region));
    }
    assert_eq!(shown.rest[..3], [90.0, -240.0, -590.0]);
    assert_eq!((shown.numbers[0], shown.numbers[1]), (7.0, 0.5));
    let carried = |hu: &Vec<i16>| hu.iter().filter(|hu| **hu == 777).count();
    for ((head, hu), (_, before)) in shown.planes.iter().zip(&alone.planes) {
        assert!(carried(hu) > 300 && carried(before) < 20, "{head:?} {}", carried(hu));
    }
    // One that sends none is not waited for: the table alone again. One that came late may be shown
    // before.
    let begun = Instant::now();
    let mut again = pictured(&mut navigator, None);
    while !again.rest[0].is_nan() && begun.elapsed() < PATIENCE {
        again = pictured(&mut navigator, None);
    }
    assert!(again.rest[0].is_nan());
    assert!(again.planes.iter().all(|(_, hu)| hu.len() > 1000 && carried(hu) < 20));
}

#[test]
fn a_navigator_that_is_gone_is_tried_again_until_it_is_there() {
    let dir = tempfile::tempdir().unwrap();
    let (page, mut link, listener) = opened(dir.path());
    let place = listener.local_addr().unwrap();
    drop(listener);
    assert_eq!(page.post("/api/follow", &json!({ "address": place.to_string() })).status, 200);
    let told = until(&mut link, |told| told["phase"] == "gone");
    assert_eq!(told["why"], "refused: nothing listens there");
    let listener = TcpListener::bind(place).unwrap();
    for n in 1..3 {
        let mut navigator = Navigator::serve(&listener);
        navigator.answer(n, "LPS", LPS, "ok");
        assert_eq!(until(&mut link, numbered(n))["phase"], "following");
        navigator.status(StatusCode::ShuttingDown, "ShuttingDown", "the session has ended");
        drop(navigator);
        let told = until(&mut link, |told| told["phase"] == "gone");
        assert_eq!(told["why"], "the session has ended");
    }
    // A page that comes later is told, too.
    let mut second = page.link(&page.token).unwrap();
    assert_eq!(until(&mut second, |_| true)["answer"]["stamp"], 2.0);
    // Another CT has nothing to do with it.
    let listing = page.get("/api/list").json();
    assert_eq!(page.post("/api/open", &json!({ "case": listing["cases"][0]["id"] })).status, 200);
    assert_eq!(until(&mut link, |told| told["phase"] == "off")["address"], Value::Null);
}

#[test]
fn the_newest_wins_and_the_page_is_told_thirty_times_a_second_at_most() {
    let dir = tempfile::tempdir().unwrap();
    let (page, mut link, listener) = opened(dir.path());
    follow(&page, &listener);
    let mut navigator = Navigator::serve(&listener);
    let (begun, last) = (Instant::now(), 2000);
    for n in 1..=last {
        navigator.answer(n, "LPS", LPS, "ok");
    }
    let mut messages = 0.0;
    loop {
        let told = link.next();
        messages += f64::from(u8::from(!told["navigation"].is_null()));
        if numbered(last)(&told["navigation"]) {
            break;
        }
    }
    // One for each begun interval, and those of the beginning.
    let most = begun.elapsed().as_secs_f64() * 30.0 + 4.0;
    assert!(messages <= most, "{messages} {most}");
}

#[test]
fn only_the_page_follows_and_only_an_address() {
    let page = Page::open(&patient());
    page.idle();
    let good = json!({ "address": "127.0.0.1:18944" });
    // No case is open that it could be of.
    assert_eq!(page.post("/api/follow", &good).status, 404);
    assert_eq!(page.post("/api/leave", &json!({})).status, 200);
    for address in ["", "127.0.0.1", ":18944", "127.0.0.1:0", "127.0.0.1:99999", "a b:1"] {
        assert_eq!(
            page.post("/api/follow", &json!({ "address": address })).status,
            400,
            "{address}"
        );
    }
    assert_eq!(page.post("/api/follow", &json!({ "address": "a:1", "more": 1 })).status, 400);
    let host = format!("127.0.0.1:{}", page.port);
    for first in ["POST /api/follow", "POST /api/leave"] {
        assert_eq!(page.ask(first, &host, &[], good.to_string().as_bytes()).status, 401);
        let other = [("Origin", "http://127.0.0.1:1")];
        assert_eq!(page.ask(first, &host, &other, b"{}").status, 403);
    }
    assert_eq!(page.get("/api/follow").status, 405);
}
