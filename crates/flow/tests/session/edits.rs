//! Sessions in memory: edited at random, two at once, ended in the middle, with little memory.

use crate::support::{Seen, patient};
use serde_json::json;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::AtomicI64;
use supine_flow::{Error, Freshness, Lane, NodeId, Request, Session, Spec, Unwatched};

/// Parameters that are changed back and forth.
const EDITS: &[(&str, [f64; 2])] = &[
    ("table.ap", [7.0, -3.0]),
    ("tissue.young", [0.609, 1.1]),
    ("mesh.tetrahedra", [500.0, 400.0]),
];

fn session(case: &str, base: &Path) -> Session {
    Session::new(Spec::from_text(case, base).unwrap(), 2).unwrap()
}

/// Memory for results, bytes: less than all results that are asked for hold together.
const BUDGET: usize = 4_500_000;

/// A number that stands for a result, to the bit.
fn result(session: &Session, which: usize, request: &Request<'_>) -> Result<String, Error> {
    Ok(match which {
        0 => format!("{:?}", session.mesh(request)?.points()),
        1 => format!("{:?}", session.deformation(request)?.displacement()),
        2 => blake3(session.deformed_ct(request)?.data()),
        _ => format!("{:?}", session.tumour(request)?),
    })
}

fn blake3(data: &[i16]) -> String {
    let bytes: Vec<u8> = data.iter().flat_map(|hu| hu.to_le_bytes()).collect();
    blake3::hash(&bytes).to_string()
}

/// Results of sessions that did nothing else, by case and question.
#[derive(Default)]
struct Cold(Mutex<BTreeMap<(String, usize), String>>);

impl Cold {
    fn result(&self, case: &Spec, base: &Path, which: usize) -> String {
        let canonical = case.case().unwrap().canonical().clone();
        let name = serde_json::to_string(&canonical).unwrap();
        let key = (name, which);
        if let Some(known) = self.0.lock().unwrap().get(&key) {
            return known.clone();
        }
        let spec = Spec::from_canonical(&canonical, base).unwrap();
        let cold = Session::new(spec, 1).unwrap();
        let mut found = String::new();
        for which in 0..4 {
            let one = result(&cold, which, &Request::default()).unwrap();
            self.0.lock().unwrap().insert((key.0.clone(), which), one.clone());
            if which == key.1 {
                found = one;
            }
        }
        assert!(cold.bytes() > BUDGET, "{} bytes: the budget drops nothing", cold.bytes());
        found
    }
}

/// Numbers that look like chance and are the same each time.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, sides: usize) -> usize {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % sides
    }
}

#[test]
fn edits_at_random_in_two_sessions_at_once_equal_cold_runs() {
    let dir = tempfile::tempdir().unwrap();
    let case = patient(dir.path());
    let cold = Cold::default();
    std::thread::scope(|scope| {
        for seed in [1, 2] {
            let (case, cold, base) = (&case, &cold, dir.path());
            scope.spawn(move || {
                let session = session(case, base).with_budget(BUDGET);
                let mut dice = Dice(seed);
                for n in 0..50 {
                    let (key, values) = EDITS[dice.roll(EDITS.len())];
                    session.set(key, &json!(number(key, values[dice.roll(2)]))).unwrap();
                    let which = dice.roll(4);
                    let lane = if dice.roll(3) == 0 { Lane::Live } else { Lane::Final };
                    if dice.roll(4) == 0 {
                        // Ended somewhere in the middle: nothing of it may be left.
                        let patience = Some(AtomicI64::new(dice.roll(40) as i64));
                        let seen = Seen { patience, ..Seen::default() };
                        let request = Request { observer: &seen, lane, ..Request::default() };
                        match result(&session, which, &request) {
                            Ok(_) | Err(Error::Stopped) => {}
                            Err(error) => panic!("{error}"),
                        }
                    }
                    let request = Request { observer: &Unwatched, lane, ..Request::default() };
                    let found = result(&session, which, &request).unwrap();
                    assert!(found == cold.result(&session.spec(), base, which), "{seed}: edit {n}");
                    // What was asked for stays, whatever the budget.
                    assert!(session.bytes() <= BUDGET + (2 << 20), "{} bytes", session.bytes());
                }
            });
        }
    });
}

/// Whole numbers for parameters that are.
fn number(key: &str, value: f64) -> serde_json::Value {
    if key == "mesh.tetrahedra" { json!(value as u64) } else { json!(value) }
}

#[test]
fn stale_labels_stay_to_be_looked_at_and_a_bad_edit_changes_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let session = session(&patient(dir.path()), dir.path());
    assert!(session.peek_labels().is_none());
    session.labels(&Request::default()).unwrap();
    assert_eq!(session.peek_labels().unwrap().1, Freshness::Fresh);
    let stale = session.set("seeds.chest_wall", &json!([[60.0, -190.0, -594.5]])).unwrap();
    assert!(stale.contains(&NodeId::Segment), "{stale:?}");
    assert_eq!(session.peek_labels().unwrap().1, Freshness::Stale);
    session.set("seeds.chest_wall", &serde_json::Value::Null).unwrap();
    assert_eq!(session.peek_labels().unwrap().1, Freshness::Fresh);
    let before = session.spec();
    for (key, value) in
        [("table.ap", json!(700)), ("table.app", json!(1)), ("tissue.fat", json!(1.0))]
    {
        assert!(session.set(key, &value).is_err(), "{key}");
        assert_eq!(session.spec(), before);
    }
    session.forget(NodeId::Segment);
    assert!(session.peek_labels().is_none());
}

/// Fails in the middle of a node.
struct Fails;

impl supine_flow::Observer for Fails {
    fn share(&self, node: NodeId, _: f64) {
        assert_ne!(node, NodeId::Segment, "meant to fail");
    }
}

#[test]
fn a_panic_in_a_node_ends_the_work_and_the_session_goes_on() {
    let dir = tempfile::tempdir().unwrap();
    let session = session(&patient(dir.path()), dir.path());
    let request = Request { observer: &Fails, ..Request::default() };
    let ended = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| session.labels(&request)));
    assert!(ended.is_err());
    assert!(session.labels(&Request::default()).is_ok());
}
