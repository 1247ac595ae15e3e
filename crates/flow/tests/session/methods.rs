//! The version of a node's method is raised when its bytes change: results in folders are known by
//! it.
//!
//! What each node leaves on the patient in full size is pinned in `methods.json`, for each kind of
//! processor on which it was pinned: the last bits of a sum of products depend on it. With
//! `SUPINE_PIN_METHODS=1` the test pins anew.

use crate::support::{full_size_patient, run};
use serde_json::{Map, Value, json};
use std::path::Path;
use supine_flow::NodeId;

const PIN: &str = "SUPINE_PIN_METHODS";

fn pinned() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/session/methods.json")
}

/// What decides how sums of products are rounded.
fn processor() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        if std::is_x86_feature_detected!("avx512f") {
            return "x86-64 with AVX-512";
        }
        if std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma") {
            return "x86-64 with AVX2";
        }
    }
    std::env::consts::ARCH
}

/// What a node left: version of its method, keys it was made from, hash of all that its record
/// tells.
struct Left {
    method: u64,
    parents: Vec<String>,
    key: String,
    bytes: String,
}

fn left(out: &Path, node: NodeId) -> Left {
    let text = std::fs::read(out.join(format!(".stages/{node}.json"))).unwrap();
    let kept: Value = serde_json::from_slice(&text).unwrap();
    let record = &kept["record"];
    let files: Vec<&Value> = record["files"].as_array().unwrap().iter().collect();
    let files: Vec<Value> = files.iter().map(|f| json!([f["path"], f["blake3"]])).collect();
    let mut facts = record["facts"].clone();
    if let Some(facts) = facts.as_object_mut() {
        // The report tells of all others.
        facts.remove("outputs");
    }
    let told = serde_json::to_vec(&json!([files, facts, record["warnings"]])).unwrap();
    let keys = record["parents"].as_array().unwrap().iter();
    Left {
        method: record["method"].as_u64().unwrap(),
        parents: keys.map(|k| k.as_str().unwrap().to_owned()).collect(),
        key: record["key"].as_str().unwrap().to_owned(),
        bytes: blake3::hash(&told).to_string(),
    }
}

/// All nodes of which one or an ancestor has another method than is pinned.
fn renewed(all: &[(NodeId, Left)], known: &Map<String, Value>) -> Vec<NodeId> {
    let mut renewed: Vec<(NodeId, &str)> = Vec::new();
    for (node, left) in all {
        let own = known.get(node.name()).and_then(|k| k["method"].as_u64()) != Some(left.method);
        let inherited = left.parents.iter().any(|p| renewed.iter().any(|(_, key)| key == p));
        if own || inherited {
            renewed.push((*node, &left.key));
        }
    }
    renewed.into_iter().map(|(node, _)| node).collect()
}

#[test]
fn a_nodes_bytes_change_with_the_version_of_its_method() {
    let dir = tempfile::tempdir().unwrap();
    let case = format!(
        "{}tissues = true\ncarry = {{ points = \"points.csv\" }}\n[tissue]\nyoung_interval = [0.5, 0.9]\n",
        full_size_patient(dir.path())
    );
    std::fs::write(dir.path().join("points.csv"), "name,x,y,z\nclip,90,-240,-590\n").unwrap();
    let out = dir.path().join("out");
    run(&case, dir.path(), &out).unwrap();
    let all: Vec<(NodeId, Left)> =
        NodeId::ALL.into_iter().map(|node| (node, left(&out, node))).collect();
    let text = std::fs::read_to_string(pinned()).unwrap_or_else(|_| "{}".into());
    let mut known: Map<String, Value> = serde_json::from_str(&text).unwrap();
    if std::env::var_os(PIN).is_some() {
        // A test that was compiled before METHOD was raised would pin the old version.
        if let Some(pinned) = known.get(processor()) {
            let older = all.iter().find(|(node, left)| {
                pinned[node.name()]["method"].as_u64().is_some_and(|m| left.method < m)
            });
            let older = older.map(|(node, _)| node);
            assert_eq!(older, None, "its METHOD is lower than what is pinned: compile anew");
        }
        let one = |(node, left): &(NodeId, Left)| {
            (node.name().to_owned(), json!({ "method": left.method, "bytes": left.bytes }))
        };
        // Pins of other processors for other versions say nothing any more; they are made there
        // anew.
        known.retain(|_, pins| pins.as_object().is_some_and(|pins| renewed(&all, pins).is_empty()));
        known.insert(processor().into(), all.iter().map(one).collect::<Map<_, _>>().into());
        std::fs::write(pinned(), serde_json::to_string_pretty(&known).unwrap() + "\n").unwrap();
        return;
    }
    let versions = known.values().next().and_then(Value::as_object).expect("something is pinned");
    let new = renewed(&all, versions);
    assert!(
        new.is_empty(),
        "the methods of {new:?} have other versions: pin their bytes ({PIN}=1)"
    );
    let Some(known) = known.get(processor()) else {
        eprintln!("the bytes are not pinned for {}: {PIN}=1 does so", processor());
        return;
    };
    let changed = |(node, left): &&(NodeId, Left)| known[node.name()]["bytes"] != left.bytes[..];
    let first = all.iter().find(changed).map(|(node, _)| node);
    assert_eq!(first, None, "its bytes changed: raise METHOD in its file, then pin ({PIN}=1)");
}
