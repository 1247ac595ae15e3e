//! Labels follow the seeds, and what was edited is what a cold open finds.

use crate::client::{Page, opened, patient};
use serde_json::{Value, json};
use supine_flow::{Request, Session, Spec};

fn edit(page: &Page, edits: Value) -> u16 {
    let revision = page.get("/api/state").json()["revision"].clone();
    page.post("/api/edit", &json!({ "revision": revision, "edits": edits })).status
}

/// The state once nothing goes on beside the work either.
fn settled(page: &Page) -> Value {
    page.state_once(|state| {
        let live = &state["live"];
        state["job"].is_null() && live["busy"] == false && live["segmenter"] != "preparing"
    })
}

fn sent(page: &Page, state: &Value, id: &str) -> Vec<u8> {
    let volumes = state["volumes"].as_array().unwrap();
    let volume = volumes.iter().find(|v| v["id"] == id).unwrap();
    assert_eq!(volume["fresh"], true);
    page.get(&format!("/api/volume/{id}/{}", volume["key"].as_str().unwrap())).body
}

#[test]
fn labels_follow_strokes_and_equal_those_of_a_cold_session() {
    let dir = tempfile::tempdir().unwrap();
    let (path, page) = opened(dir.path());
    assert_eq!(page.post("/api/run", &json!({ "until": "segment" })).status, 200);
    let state = settled(&page);
    assert_eq!(state["live"]["segmenter"], "ready");
    let plain = sent(&page, &state, "labels");
    let stroke = |tissue: &str, z: f64| {
        let points = [[91.0, -205.0, z], [97.0, -205.0, z]];
        json!({ "tissue": tissue, "radius": 5.0, "points": points })
    };
    let strokes = |all: Value| json!([{ "key": "seeds.strokes", "value": all }]);
    // The second comes while labels are made of the first.
    assert_eq!(edit(&page, strokes(json!([stroke("chest_wall", -594.5)]))), 200);
    let both = json!([stroke("chest_wall", -594.5), stroke("soft_tissue", -580.0)]);
    assert_eq!(edit(&page, strokes(both)), 200);
    let state = settled(&page);
    assert_eq!(state["live"]["problem"], Value::Null);
    let painted = sent(&page, &state, "labels");
    assert!(painted != plain);
    let session = Session::new(Spec::read(&path).unwrap(), 1).unwrap();
    assert!(painted == session.labels(&Request::default()).unwrap().data());
    // Lines between the voxels, of these labels.
    let lines = state["lines"].as_array().unwrap();
    let key = lines.iter().find(|l| l["volume"] == "ct").unwrap()["key"].as_str().unwrap();
    let axial = page.get(&format!("/api/lines/ct/{key}/axial/40")).json();
    let names: Vec<_> = axial["lines"].as_array().unwrap().iter().map(|l| &l["name"]).collect();
    assert!(names.contains(&&json!("skin")) && names.contains(&&json!("chest wall")), "{names:?}");
    assert_eq!(page.get("/api/lines/ct/0/axial/40").status, 204);
    // What cannot be meant is told, and taken back.
    let lung = json!([{ "key": "seeds.soft_tissue", "value": [[-60.0, -150.0, -594.5]] }]);
    assert_eq!(edit(&page, lung), 200);
    let state = settled(&page);
    assert!(state["live"]["problem"]["message"].as_str().unwrap().contains("soft-tissue seed"));
    for _ in 0..3 {
        let revision = page.get("/api/state").json()["revision"].clone();
        assert_eq!(page.post("/api/undo", &json!({ "revision": revision })).status, 200);
    }
    let state = settled(&page);
    assert_eq!(state["live"]["problem"], Value::Null);
    assert!(sent(&page, &state, "labels") == plain);
}

#[test]
fn a_tick_is_kept_by_the_case_and_told_by_the_report() {
    let dir = tempfile::tempdir().unwrap();
    let (path, page) = opened(dir.path());
    // It reaches beyond the region, which is a warning with a place.
    let beyond = json!([
        { "key": "tumour.radius", "value": 45.0 },
        { "key": "region.centre", "value": [91.0, -235.0, -594.5] },
        { "key": "region.radius", "value": 55.0 },
    ]);
    assert_eq!(edit(&page, beyond), 200);
    assert_eq!(page.post("/api/run", &json!({ "until": "region" })).status, 200);
    let state = settled(&page);
    let told = |state: &Value| -> Value {
        let all = state["warnings"].as_array().unwrap();
        all.iter().find(|w| w["code"] == "tumour-beyond-region").unwrap().clone()
    };
    let warning = told(&state);
    assert_eq!((&warning["ticked"], &warning["place_mm"][0]), (&json!(false), &json!(91.37)));
    assert_eq!(page.post("/api/tick", &json!({ "id": "no-such", "on": true })).status, 400);
    let tick = json!({ "id": warning["id"], "on": true });
    assert_eq!(page.post("/api/tick", &tick).status, 200);
    assert_eq!(told(&settled(&page))["ticked"], true);
    assert!(std::fs::read_to_string(&path).unwrap().contains(warning["id"].as_str().unwrap()));
    let out = json!({ "out": { "dir": "0", "name": "result" } });
    assert_eq!(page.post("/api/run", &out).status, 200);
    let state = settled(&page);
    let ticked = |reason: &Value| reason.as_str().unwrap().contains("beyond the region");
    let reasons = state["result"]["reasons"].as_array().unwrap();
    assert!(reasons.iter().any(ticked), "{reasons:?}");
    let report = std::fs::read_to_string(dir.path().join("result/report/index.html")).unwrap();
    assert!(report.contains("(ticked as looked at)"));
    // A tick that is taken away changes no result: the report alone does not know of it.
    let of_result = |state: &Value| {
        [&state["result"]["old"], &state["result"]["lacks_ticks"]].map(|is| is == true)
    };
    assert_eq!(of_result(&state), [false, false]);
    assert_eq!(page.post("/api/tick", &json!({ "id": warning["id"], "on": false })).status, 200);
    let unticked = settled(&page);
    assert_eq!(of_result(&unticked), [false, true]);
    assert_eq!(unticked["result"]["verdict"], state["result"]["verdict"]);
    assert_eq!(page.post("/api/run", &out).status, 200);
    let state = settled(&page);
    assert_eq!(of_result(&state), [false, false]);
    let report = std::fs::read_to_string(dir.path().join("result/report/index.html")).unwrap();
    assert!(!report.contains("(ticked as looked at)"));
    // Nothing is sent without the words, and what became of it is told.
    let words = state["result"]["confirm"].as_str().unwrap();
    let send = |confirm: Value| {
        page.post("/api/send", &json!({ "to": "PACS@127.0.0.1:1", "confirm": confirm })).status
    };
    assert_eq!((send(Value::Null), send(json!("send"))), (400, 400));
    assert_eq!(send(json!(words)), 200);
    assert_eq!(page.idle()["sent"]["ok"], false);
    assert!(page.get("/api/log").json()["lines"].as_array().unwrap().len() > 5);
}

/// Numbers that are the same in each run (splitmix64).
struct Dice(u64);

impl Dice {
    fn below(&mut self, n: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (x ^ (x >> 31)) % n
    }
}

#[test]
fn two_hundred_edits_with_undo_leave_what_a_cold_open_finds() {
    let dir = tempfile::tempdir().unwrap();
    let (path, page) = opened(dir.path());
    let mut dice = Dice(5);
    let mut done = [0; 2];
    for n in 0..200 {
        let x = dice.below(400) as f64 / 10.0 - 20.0;
        let point = json!([x, -200.0, -590.0 + x]);
        let change = match dice.below(9) {
            0 => json!([{ "key": "table.ap", "value": x }]),
            1 => json!([{ "key": "table.lat", "value": x / 2.0 }]),
            2 => json!([{ "key": "tumour.radius", "value": 5.0 + x.abs() / 4.0 }]),
            3 => json!([{ "key": "region.centre", "value": [91.0 + x, -235.0, -594.5] },
                        { "key": "region.radius", "value": 60.0 + x }]),
            4 => json!([{ "key": "region.centre", "value": null },
                        { "key": "region.radius", "value": null }]),
            5 => json!([{ "key": "seeds.chest_wall", "value": [point] }]),
            6 => json!([{ "key": "seeds.strokes", "value":
                        [{ "tissue": "erase", "radius": 3.5, "points": [point] }] }]),
            7 => json!([{ "key": "seeds.strokes", "value": null }]),
            _ => json!([{ "key": "export.anonymise", "value": n % 2 == 0 }]),
        };
        let revision = page.get("/api/state").json()["revision"].clone();
        let seen = json!({ "revision": revision });
        let status = match dice.below(4) {
            0 => page.post("/api/undo", &seen).status,
            1 => page.post("/api/redo", &seen).status,
            _ => edit(&page, change),
        };
        done[usize::from(status == 200)] += 1;
    }
    assert!(done[1] > 150, "{done:?}");
    let state = page.idle();
    let cold = Page::open(&path).idle();
    assert_eq!(state["case"]["values"], cold["case"]["values"]);
    assert_eq!(state["case"]["tumour"], cold["case"]["tumour"]);
    assert!(std::fs::read_to_string(&path).unwrap().starts_with("# Looked at by nobody yet"));
    assert!(patient().exists());
}
