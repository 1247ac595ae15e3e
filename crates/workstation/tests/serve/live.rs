//! The live picture of the table, and of an applicator in the breast.

use crate::client::{Page, small};
use serde_json::{Value, json};

/// A frame: its first word, four numbers, the planes with their values, what follows.
pub(crate) struct Frame {
    magic: u32,
    pub(crate) numbers: [f32; 4],
    /// View, slice, first voxel and how many along the right and down axes; HU.
    pub(crate) planes: Vec<([u32; 6], Vec<i16>)>,
    pub(crate) rest: Vec<f32>,
}

pub(crate) fn read(bytes: &[u8]) -> Frame {
    let whole = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let float = |at: usize| f32::from_bits(whole(at));
    let mut at = 32;
    let mut planes = vec![];
    for _ in 0..whole(8) {
        let head = [0, 4, 8, 12, 16, 20].map(|n| whole(at + n));
        let count = (head[4] * head[5]) as usize;
        let hu = bytes[at + 24..at + 24 + 2 * count].chunks(2);
        planes.push((head, hu.map(|b| i16::from_le_bytes([b[0], b[1]])).collect()));
        at += 24 + (2 * count).next_multiple_of(4);
    }
    let rest = (at..bytes.len()).step_by(4).map(float).collect();
    Frame { magic: whole(0), numbers: [16, 20, 24, 28].map(float), planes, rest }
}

fn opened(dir: &std::path::Path) -> Page {
    let page = Page::open(&small(dir));
    page.idle();
    assert_eq!(page.post("/api/run", &json!({ "until": null })).status, 200);
    assert_eq!(page.idle()["problem"], Value::Null);
    page
}

/// What a picture rests on is made first, all on the one thread.
#[test]
fn one_thread_is_enough_for_a_picture() {
    let dir = tempfile::tempdir().unwrap();
    let page = Page::with_threads(&small(dir.path()), 1);
    page.idle();
    let mut link = page.link(&page.token).unwrap();
    let asked = json!({ "tilt": { "ap": 7.0, "lat": 5.0, "planes": [["axial", 49]] } });
    link.say(&asked.to_string());
    assert_eq!(read(&link.picture()).numbers[..2], [7.0, 5.0]);
}

#[test]
fn the_table_is_tilted_live_and_comes_near_to_the_planning_mesh() {
    let dir = tempfile::tempdir().unwrap();
    let page = opened(dir.path());
    let way = page.get("/api/state").json()["tumour"]["distance_mm"].as_f64().unwrap();
    let mut link = page.link(&page.token).unwrap();
    let planes = json!([["axial", 49], ["sagittal", 187], ["coronal", 54]]);
    let mut tilt = |ap: f64, lat: f64| {
        let asked = json!({ "tilt": { "ap": ap, "lat": lat, "planes": planes } });
        link.say(&asked.to_string());
        read(&link.picture())
    };
    let frame = tilt(7.0, 5.0);
    assert_eq!((frame.magic, frame.planes.len()), (0x4442_4553, 3));
    assert_eq!(frame.numbers[..2], [7.0, 5.0]);
    // Quadratic and coarse beside the linear mesh of this case.
    assert!((f64::from(frame.numbers[2]) - way).abs() < 1.5, "{} {way}", frame.numbers[2]);
    for (head, hu) in &frame.planes {
        assert_eq!(hu.len() as u32, head[4] * head[5]);
        assert!(hu.len() > 1000, "{head:?}");
    }
    // Level: nothing moves. Back: the same picture as before.
    let level = tilt(0.0, 0.0);
    assert!(level.planes.iter().all(|(head, _)| head[4] * head[5] < 400), "{:?}", level.numbers);
    let again = tilt(7.0, 5.0);
    for ((_, hu), (_, before)) in again.planes.iter().zip(&frame.planes) {
        let off = hu.iter().zip(before).filter(|(a, b)| a.abs_diff(**b) > 20).count();
        assert!(hu.len() == before.len() && off * 200 < hu.len(), "{off} of {}", hu.len());
    }
    let state = page.get("/api/state").json();
    assert_eq!(state["preview_tilt"]["state"], "ready");
    assert!(state["preview_tilt"]["final_mm"].as_f64().unwrap() < 1.5, "{}", state["preview_tilt"]);
    // What is no question is passed over, and the socket lives on.
    link.say("{\"tilt\":{\"ap\":900,\"lat\":0,\"planes\":[]}}");
    link.say("nonsense");
    link.say(&json!({ "tilt": { "ap": 1.0, "lat": 0.0, "planes": [] } }).to_string());
    assert_eq!(read(&link.picture()).numbers[0], 1.0);
}

#[test]
fn an_applicator_pushes_the_tissue_and_feels_it() {
    let dir = tempfile::tempdir().unwrap();
    let page = opened(dir.path());
    let mut link = page.link(&page.token).unwrap();
    let mut hold = |contact: &str, shift: [f64; 3]| {
        let asked = json!({ "applicator": {
            "ap": 7.0, "lat": 5.0, "planes": [["axial", 49]],
            "centre": [91.0, -246.0, -596.0], "axis": [0.0, -1.0, 0.0], "radius": 15.0, "shaft": 5.0,
            "contact": contact, "pose": { "shift": shift, "turn": [0.0, 0.0, 0.0] },
        } });
        link.say(&asked.to_string());
        read(&link.picture())
    };
    let there = hold("tied", [0.0; 3]);
    assert_eq!((there.magic, there.rest.len()), (0x4442_4541, 8));
    assert_eq!(there.rest[5..7], [7.0, 5.0]);
    let pushed = hold("tied", [0.0, 3.0, 0.0]);
    // The tumour's centre lies in the sphere, and goes with it; that costs force.
    assert!(
        (pushed.rest[1] - there.rest[1] - 3.0).abs() < 0.8,
        "{:?} {:?}",
        there.rest,
        pushed.rest
    );
    assert!(
        pushed.numbers[1] > there.numbers[1] + 0.01,
        "{:?} {:?}",
        there.numbers,
        pushed.numbers
    );
    assert!(pushed.rest[3] < 0.0, "{:?}", pushed.rest);
    let state = page.get("/api/state").json();
    assert_eq!(state["preview_applicator"]["state"], "ready");
    // Nothing of it is in the case.
    assert_eq!(state["case"]["can_undo"], false);
}
