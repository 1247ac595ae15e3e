//! Requests: what is admitted, refused, opened, edited and run.

use crate::client::{Answer, PATIENCE, Page, opened, patient, small};
use serde_json::{Value, json};
use std::io::{ErrorKind, Write};
use std::net::TcpStream;
use std::path::Path;
use supine_flow::{Request, Session, Spec};

#[test]
fn the_page_bears_what_keeps_others_out_and_data_stay_in_no_cache() {
    let page = Page::open(&patient());
    for path in ["/", "/style.css", "/js/main.js", "/api/state", "/no/such", "/api/no/such"] {
        let answer = page.get(path);
        assert_eq!(answer.header("cache-control"), Some("no-store"), "{path}");
        assert_eq!(answer.header("x-content-type-options"), Some("nosniff"), "{path}");
        assert_eq!(answer.header("referrer-policy"), Some("no-referrer"), "{path}");
        assert_eq!(answer.header("access-control-allow-origin"), None, "{path}");
        let policy = answer.header("content-security-policy").unwrap();
        assert!(policy.starts_with("default-src 'none'") && !policy.contains("unsafe"), "{policy}");
    }
    assert_eq!(page.get("/").status, 200);
    assert_eq!(page.get("/no/such").status, 404);
    // The token is in no answer.
    assert!(!page.get("/").text().contains(&page.token));
    assert!(!page.get("/api/state").text().contains(&page.token));
}

#[test]
fn requests_that_are_refused() {
    let page = Page::open(&patient());
    let host = format!("127.0.0.1:{}", page.port);
    let own = format!("http://{host}");
    let bearer = format!("Bearer {}", page.token);
    let ask = |first: &str, host: &str, headers: &[(&str, &str)]| -> u16 {
        page.ask(first, host, headers, b"").status
    };
    let token = ("Authorization", bearer.as_str());
    assert_eq!(ask("GET /api/state", &host, &[token]), 200);
    assert_eq!(ask("GET /api/state", &host, &[token, ("Origin", &own)]), 200);
    // A tunnel has another port.
    let tunnel = [token, ("Origin", "http://localhost:9000")];
    assert_eq!(ask("GET /api/state", "localhost:9000", &tunnel), 200);
    // No token, another one, one in the address, a cookie.
    assert_eq!(ask("GET /api/state", &host, &[]), 401);
    assert_eq!(ask("GET /api/state", &host, &[("Authorization", "Bearer 00")]), 401);
    assert_eq!(ask(&format!("GET /api/state?token={}", page.token), &host, &[]), 401);
    let cookie = format!("token={}", page.token);
    assert_eq!(ask("GET /api/state", &host, &[("Cookie", &cookie)]), 401);
    // A name that was bound to loopback, this machine's name in a network, no host.
    assert_eq!(ask("GET /api/state", "evil.example", &[token]), 403);
    assert_eq!(ask("GET /", "evil.example", &[]), 403);
    assert_eq!(ask("GET /", "192.168.1.2", &[]), 403);
    // Pages of other programs on this machine.
    for origin in ["http://127.0.0.1:1", "http://localhost:1", "null", "https://evil.example"] {
        assert_eq!(ask("GET /api/state", &host, &[token, ("Origin", origin)]), 403, "{origin}");
        assert_eq!(ask("POST /api/cancel", &host, &[token, ("Origin", origin)]), 403, "{origin}");
    }
    assert_eq!(ask("GET /api/state", &host, &[token, ("Sec-Fetch-Site", "same-site")]), 403);
    // Sockets: without an origin, or with that of another page.
    let socket = [
        ("Connection", "Upgrade"),
        ("Upgrade", "websocket"),
        ("Sec-WebSocket-Version", "13"),
        ("Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="),
    ];
    let with = |origin| [&socket[..], &[("Origin", origin)]].concat();
    assert_eq!(ask("GET /api/link", &host, &socket), 403);
    assert_eq!(ask("GET /api/link", &host, &with("http://127.0.0.1:1")), 403);
    assert_eq!(ask("GET /api/link", &host, &with(&own)), 101);
    // Methods, paths, bodies.
    assert_eq!(ask("GET /api/cancel", &host, &[token]), 405);
    assert_eq!(ask("DELETE /api/state", &host, &[token]), 405);
    for path in ["/../Cargo.toml", "/js/../../Cargo.toml", "/%2e%2e/Cargo.toml", "//etc/passwd"] {
        assert_eq!(ask(&format!("GET {path}"), &host, &[]), 404, "{path}");
    }
    assert_eq!(page.post("/api/open", &json!({ "case": "77" })).status, 403);
    assert_eq!(page.post("/api/open", &json!({ "case": "/etc/passwd" })).status, 403);
    assert_eq!(page.post("/api/inspect", &json!({ "dir": "../.." })).status, 403);
    assert_eq!(page.get("/api/list?dir=..%2f..").status, 403);
    assert_eq!(page.post("/api/open", &json!({ "path": "/etc" })).status, 400);
    assert_eq!(page.post("/api/run", &json!({ "until": "nothing" })).status, 400);
    assert_eq!(page.ask("POST /api/open", &host, &[token], &[b'x'; 70_000]).status, 413);
    assert_eq!(page.get("/api/volume/ct/7").status, 204);
    assert_eq!(page.get("/api/picture/99").status, 403);
}

/// More than may stand at the door; a process that holds both ends has no descriptors for a
/// thousand.
#[test]
fn who_has_no_key_neither_stays_nor_keeps_the_owner_out() {
    let page = Page::open(&patient());
    let strangers: Vec<TcpStream> = (0..300)
        .map(|n| {
            let mut stream = TcpStream::connect(("127.0.0.1", page.port)).unwrap();
            // Silent ones, half a request, and whole ones without the key.
            let said =
                ["", "GET /api/state HTTP/1.1\r\nHo", "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"];
            // It may have been closed for the next already.
            let _closed = stream.write_all(said[n % 3].as_bytes());
            stream
        })
        .collect();
    assert_eq!(page.get("/api/state").status, 200);
    assert!(page.link(&page.token).is_some());
    // None is left open, whatever it waits for.
    for mut stream in strangers {
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let ended = std::io::copy(&mut stream, &mut std::io::sink());
        assert!(!matches!(&ended, Err(e) if e.kind() == ErrorKind::WouldBlock), "{ended:?}");
    }
    assert_eq!(page.get("/api/state").status, 200);
}

#[test]
fn a_folder_is_looked_through_a_case_opened_segmented_and_warped() {
    let page = Page::open(&patient());
    page.idle();
    let listing = page.get("/api/list").json();
    let id = |of: &str, name: &str| -> Value {
        let all = listing[of].as_array().unwrap();
        all.iter().find(|entry| entry["name"] == name).unwrap()["id"].clone()
    };
    assert_eq!(page.post("/api/inspect", &json!({ "dir": id("folders", "ct") })).status, 200);
    let state = page.idle();
    let series = &state["inspection"]["series"][0];
    assert_eq!((&series["usable"], &series["size"]), (&json!(true), &json!([256, 256, 86])));
    let picture = page.get(&format!("/api/picture/{}", series["id"].as_str().unwrap()));
    assert!(picture.status == 200 && picture.body.starts_with(b"\x89PNG"), "{}", picture.status);
    // The series by itself, then the case.
    assert_eq!(page.post("/api/open", &json!({ "series": series["id"] })).status, 200);
    let state = page.idle();
    assert_eq!((&state["phase"], &state["case"]["saved"]), (&json!("ready"), &json!(false)));
    assert_eq!(page.post("/api/open", &json!({ "case": id("cases", "case.toml") })).status, 200);
    let state = page.idle();
    assert_eq!(state["problem"], Value::Null);
    let session = Session::new(Spec::read(&patient().join("case.toml")).unwrap(), 2).unwrap();
    let ct = session.ct(&Request::default()).unwrap();
    let sent = |state: &Value, volume: &str| -> Vec<u8> {
        let volumes = state["volumes"].as_array().unwrap();
        let key = volumes.iter().find(|v| v["id"] == volume).unwrap()["key"].as_str().unwrap();
        page.get(&format!("/api/volume/{volume}/{key}")).body
    };
    let bytes = |data: &[i16]| data.iter().flat_map(|hu| hu.to_le_bytes()).collect::<Vec<u8>>();
    assert!(sent(&state, "ct") == bytes(ct.data()));
    assert_eq!(page.post("/api/run", &json!({ "until": null })).status, 200);
    // One thing after the other.
    assert_eq!(page.post("/api/run", &json!({ "until": "segment" })).status, 409);
    let state = page.idle();
    assert_eq!(state["problem"], Value::Null);
    assert!(sent(&state, "labels") == session.labels(&Request::default()).unwrap().data());
    let deformed = session.deformed_ct(&Request::default()).unwrap();
    assert!(sent(&state, "deformed") == bytes(deformed.data()));
    let simulated = |n: usize| state["volumes"][n]["simulated"].as_bool().unwrap();
    assert!(!simulated(0) && state["volumes"][2]["id"] == "deformed" && simulated(2));
    assert!(!state["patches"].as_array().unwrap().is_empty());
    assert_eq!(state["case"]["region"]["radius_mm"].as_f64().map(|r| r > 50.0), Some(true));
}

#[test]
fn work_is_ended_on_request_and_a_failure_is_told() {
    let page = Page::open(&patient().join("case.toml"));
    page.idle();
    assert_eq!(page.post("/api/run", &json!({ "until": "warp" })).status, 200);
    assert_eq!(page.post("/api/cancel", &json!({})).status, 200);
    let state = page.idle();
    assert_eq!((&state["problem"], &state["job"]), (&Value::Null, &Value::Null));
    let held = |state: &Value| state["volumes"].as_array().unwrap().len();
    assert!(held(&state) < 3, "{state}");
    // A case that cannot be used.
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("wrong.toml"), "ct = 'nowhere'\nbreast = 'left'\n").unwrap();
    let page = Page::open(dir.path());
    page.idle();
    let id = page.get("/api/list").json()["cases"][0]["id"].clone();
    page.post("/api/open", &json!({ "case": id }));
    let state = page.idle();
    let problem = state["problem"]["message"].as_str().unwrap();
    assert!(problem.contains("nowhere"), "{problem}");
    assert_eq!(state["phase"], "empty");
    page.post("/api/dismiss", &json!({}));
    assert_eq!(page.idle()["problem"], Value::Null);
}

#[test]
fn edits_are_in_the_file_are_taken_back_and_refused_when_somebody_was_faster() {
    let dir = tempfile::tempdir().unwrap();
    let path = small(dir.path());
    let before = std::fs::read_to_string(&path).unwrap();
    let page = Page::open(&path);
    let state = page.idle();
    let revision = state["revision"].as_u64().unwrap();
    let edit = |revision: u64, key: &str, value: Value| {
        page.post(
            "/api/edit",
            &json!({ "revision": revision, "edits": [{ "key": key, "value": value }] }),
        )
    };
    assert_eq!(edit(revision, "table.ap", json!(3.0)).status, 200);
    // The second of two windows.
    let answer = edit(revision, "table.ap", json!(4.0));
    assert_eq!(answer.status, 409);
    // What was not given out: files are named by numbers alone.
    for key in ["labels.file", "seeds.file", "carry.dose", "carry", "ct"] {
        let answer = edit(revision + 1, key, json!("/etc/passwd"));
        assert_eq!(answer.status, 403, "{key}: {}", answer.text());
    }
    for (path, body) in [
        ("/api/carry", json!({ "revision": 0, "id": "7", "on": true })),
        ("/api/carry", json!({ "revision": 0, "id": "../rt", "on": true })),
        ("/api/tumour", json!({ "revision": 0, "id": "7", "region": "GTV" })),
    ] {
        assert_eq!(page.post(path, &body).status, 403, "{path} {body}");
    }
    assert!(answer.text().contains("another window"), "{}", answer.text());
    let state = page.get("/api/state").json();
    assert_eq!(
        (&state["case"]["values"]["table.ap"], &state["case"]["can_undo"]),
        (&json!(3.0), &json!(true))
    );
    let on_disk = std::fs::read_to_string(&path).unwrap();
    assert!(on_disk.starts_with("# Looked at by nobody yet") && on_disk != before, "{on_disk}");
    assert_eq!(edit(revision + 1, "table.ap", json!(500)).status, 400);
    assert_eq!(edit(revision + 1, "no.such", json!(1)).status, 400);
    assert_eq!(page.post("/api/undo", &json!({ "revision": revision + 1 })).status, 200);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), before);
    assert_eq!(page.post("/api/redo", &json!({ "revision": revision + 2 })).status, 200);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), on_disk);
    // Another program.
    std::fs::write(&path, &before).unwrap();
    assert_eq!(edit(revision + 3, "table.ap", json!(1.0)).status, 409);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), before);
}

/// How far a stage is.
fn stage(state: &Value, name: &str) -> Value {
    let all = state["stages"].as_array().unwrap();
    all.iter().find(|stage| stage["name"] == name).unwrap()["state"].clone()
}

/// Whether each volume is of what is given now.
fn fresh(state: &Value) -> Vec<bool> {
    let all = state["volumes"].as_array().unwrap();
    all.iter().map(|v| v["fresh"].as_bool().unwrap()).collect()
}

/// The summary of a run, which names every file with its hash, without times and memory.
fn summary(out: &Path) -> Value {
    let text = std::fs::read_to_string(out.join("summary.json")).unwrap();
    let mut summary: Value = serde_json::from_str(&text).unwrap();
    summary.as_object_mut().unwrap().remove("run");
    summary
}

#[test]
fn what_is_stale_is_marked_and_a_run_leaves_what_the_command_line_leaves() {
    let dir = tempfile::tempdir().unwrap();
    let (path, page) = opened(dir.path());
    page.post("/api/run", &json!({ "until": "warp" }));
    let state = page.idle();
    assert_eq!(state["problem"], Value::Null);
    assert_eq!((stage(&state, "solve"), fresh(&state)), (json!("done"), vec![true; 3]));
    // A stage that fails is marked, and all is as it was once the change is taken back.
    let edits = json!([{ "key": "mesh.tetrahedra", "value": 100 }]);
    page.post("/api/edit", &json!({ "revision": state["revision"], "edits": edits }));
    page.post("/api/run", &json!({ "until": "warp" }));
    let failed = page.idle();
    let told = failed["problem"]["message"].as_str().unwrap();
    assert!(told.contains("100 tetrahedra are too few"), "{told}");
    assert_eq!(
        (stage(&failed, "mesh"), fresh(&failed)),
        (json!("failed"), vec![true, true, false])
    );
    page.post("/api/undo", &json!({ "revision": failed["revision"] }));
    page.post("/api/run", &json!({ "until": "warp" }));
    let state = page.idle();
    assert_eq!((stage(&state, "mesh"), fresh(&state)), (json!("done"), vec![true; 3]));
    let revision = &state["revision"];
    let edits = json!([{ "key": "table.ap", "value": 2.0 }]);
    page.post("/api/edit", &json!({ "revision": revision, "edits": edits }));
    let state = page.idle();
    assert_eq!((stage(&state, "solve"), stage(&state, "segment")), (json!("stale"), json!("done")));
    assert_eq!(fresh(&state), [true, true, false]);
    // The whole run, by the page and by the command line.
    let out = json!({ "dir": "0", "name": "result" });
    assert_eq!(page.post("/api/run", &json!({ "out": out })).status, 200);
    let state = page.idle();
    assert_eq!(state["problem"], Value::Null);
    assert_eq!(fresh(&state), [true; 3]);
    let cold = dir.path().join("cold");
    let run = supine_flow::commands::run::Run {
        case: path,
        changes: vec![],
        anonymise: false,
        out: cold.clone(),
        options: supine_flow::Options::default(),
        start: None,
    };
    supine_flow::commands::run::run(&run, &supine_flow::Unwatched).unwrap();
    let ours = summary(&dir.path().join("result"));
    assert!(ours == summary(&cold));
    assert_eq!(
        state["result"]["outputs"].as_array().unwrap().len(),
        ours["outputs"].as_array().unwrap().len()
    );
    // What the run left is opened, and nothing is made.
    let left = Page::open(&dir.path().join("result"));
    let state = left.idle();
    assert_eq!(state["problem"], Value::Null);
    assert_eq!((fresh(&state), state["result"]["verdict"].is_string()), (vec![true; 3], true));
    assert!(summary(&dir.path().join("result")) == ours);
    // A case that no file holds has no command line, once it is another one than what was opened.
    assert_eq!(state["command"], "supine run result/summary.json --out result");
    let edits = json!([{ "key": "export.anonymise", "value": true }]);
    left.post("/api/edit", &json!({ "revision": state["revision"], "edits": edits }));
    assert_eq!(left.idle()["command"], "");
    let out = json!({ "dir": "0", "name": "anon" });
    assert_eq!(left.post("/api/run", &json!({ "out": out })).status, 200);
    let state = left.idle();
    assert_eq!((&state["result"]["name"], &state["command"]), (&json!("anon"), &json!("")));
    drop(left);
    // One key of the chain is another one now.
    let path = dir.path().join("result/summary.json");
    let text = std::fs::read_to_string(&path).unwrap();
    let key = ours["chain"][0]["key"].as_str().unwrap();
    std::fs::write(&path, text.replace(key, &"0".repeat(key.len()))).unwrap();
    let other = Page::open(&dir.path().join("result")).idle();
    let told = other["problem"]["message"].as_str().unwrap();
    assert!(told.contains("run it again") && fresh(&other) == [true], "{told}");
    // What was written is of the case before the next change.
    let edits = json!([{ "key": "table.ap", "value": 1.0 }]);
    let revision = page.idle()["revision"].clone();
    page.post("/api/edit", &json!({ "revision": revision, "edits": edits }));
    what_was_written_is_old_until_the_change_is_taken_back(&page, &state);
    for name in ["../out", "a/b", "", ".hidden"] {
        let out = json!({ "dir": "0", "name": name });
        assert_eq!(page.post("/api/run", &json!({ "out": out })).status, 400, "{name}");
    }
}

fn what_was_written_is_old_until_the_change_is_taken_back(page: &Page, state: &Value) {
    let old = page.idle();
    assert_eq!((&old["result"]["old"], &old["figures"][0]["old"]), (&json!(true), &json!(false)));
    let figures = old["figures"].as_array().unwrap();
    assert!(figures.iter().any(|figure| figure["group"] == "Mechanics" && figure["old"] == true));
    // What lies in the run's folder alone is old too.
    assert_eq!((stage(&old, "export"), stage(&old, "import")), (json!("stale"), json!("done")));
    let send = json!({ "to": "ARCHIVE@127.0.0.1:1", "confirm": state["result"]["confirm"] });
    assert_eq!(page.post("/api/send", &send).status, 400);
    page.post("/api/undo", &json!({ "revision": old["revision"] }));
    let back = page.idle();
    assert_eq!((&back["result"]["old"], stage(&back, "export")), (&json!(false), json!("done")));
    // An archive that does not answer: who gives up is told how much was stored.
    let archive = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("ARCHIVE@{}", archive.local_addr().unwrap());
    let confirm = page.idle()["result"]["confirm"].clone();
    let send = json!({ "to": address, "confirm": confirm });
    assert_eq!(page.post("/api/send", &send).status, 200);
    page.post("/api/cancel", &json!({}));
    let state = page.idle();
    let told = state["sent"]["text"].as_str().unwrap();
    assert!(told.starts_with("cancelled: 0 objects stored"), "{told}");
    assert_eq!(state["problem"], Value::Null);
}

#[test]
fn a_new_case_is_saved_beside_what_is_seen() {
    let page = Page::open(&patient());
    page.idle();
    let ct = page.get("/api/list").json()["folders"][0]["id"].clone();
    page.post("/api/inspect", &json!({ "dir": ct }));
    let series = page.idle()["inspection"]["series"][0]["id"].clone();
    page.post("/api/open", &json!({ "series": series }));
    let state = page.idle();
    let edits = json!([
        { "key": "breast", "value": "left" },
        { "key": "tumour.centre", "value": [91.37, -248.09, -594.5] },
        { "key": "tumour.radius", "value": 9.0 },
    ]);
    let asked = json!({ "revision": state["revision"], "edits": edits });
    assert_eq!(page.post("/api/edit", &asked).status, 200);
    let state = page.idle();
    assert_eq!(state["case"]["tumour"]["radius_mm"], 9.0);
    let import = &state["stages"][0];
    assert_eq!((&import["name"], &import["state"]), (&json!("import"), &json!("done")));
    for name in ["case.txt", "../case.toml", ".toml", "a/b.toml"] {
        assert_eq!(
            page.post("/api/save", &json!({ "dir": "0", "name": name })).status,
            400,
            "{name}"
        );
    }
    // There is one already.
    assert_eq!(page.post("/api/save", &json!({ "dir": "0", "name": "case.toml" })).status, 400);
}

#[test]
fn the_socket_tells_each_change_and_only_with_the_token() {
    let page = Page::open(&patient());
    page.idle();
    assert!(page.link("0000").is_none());
    let mut link = page.link(&page.token).unwrap();
    let id = page.get("/api/list").json()["cases"][0]["id"].clone();
    page.post("/api/open", &json!({ "case": id }));
    while link.next()["state"]["phase"] != "ready" {}
}

#[test]
fn a_whole_answer_is_read() {
    let answer = Answer::read(&b"HTTP/1.1 200 OK\r\nA: b\r\n\r\nxyz"[..]);
    assert_eq!((answer.status, answer.header("a"), answer.text()), (200, Some("b"), "xyz".into()));
}
