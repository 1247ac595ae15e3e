//! Changes that no file holds, files that others change, and whose a case is.

use crate::client::{PATIENCE, Page, opened, patient, small};
use serde_json::{Value, json};
use std::path::Path;
use std::time::Instant;

/// A folder with the patient's CT.
fn folder_of_a_patient() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let ct = dir.path().join("ct");
    std::fs::create_dir(&ct).unwrap();
    for file in std::fs::read_dir(patient().join("ct")).unwrap() {
        let file = file.unwrap();
        std::fs::copy(file.path(), ct.join(file.file_name())).unwrap();
    }
    dir
}

fn edit(page: &Page, key: &str, value: Value) {
    let revision = page.get("/api/state").json()["revision"].clone();
    let edits = json!([{ "key": key, "value": value }]);
    let answer = page.post("/api/edit", &json!({ "revision": revision, "edits": edits }));
    assert_eq!(answer.status, 200, "{}", answer.text());
}

/// A new case of the CT in a folder.
fn new_case(dir: &Path, unsaved: &Path) -> Page {
    let page = Page::keeping(dir, unsaved);
    page.idle();
    let ct = page.get("/api/list").json()["folders"][0]["id"].clone();
    page.post("/api/inspect", &json!({ "dir": ct }));
    let series = page.idle()["inspection"]["series"][0]["id"].clone();
    page.post("/api/open", &json!({ "series": series }));
    page.idle();
    page
}

/// What a page offers, once it offers as much as is wanted: a program that ends lets go of what it
/// has open.
fn offered(page: &Page, wanted: usize) -> Vec<Value> {
    let begun = Instant::now();
    loop {
        page.get("/api/list");
        let all = page.get("/api/state").json()["unsaved"].as_array().unwrap().clone();
        if all.len() == wanted {
            return all;
        }
        assert!(begun.elapsed() < PATIENCE, "{all:?}");
        std::thread::sleep(std::time::Duration::from_millis(40));
    }
}

fn names(dir: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(dir).into_iter().flatten();
    entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

#[test]
fn a_case_in_no_file_is_kept_and_offered_at_the_next_start() {
    let (dir, state) = (folder_of_a_patient(), tempfile::tempdir().unwrap());
    let unsaved = state.path().join("supine/unsaved");
    let page = new_case(dir.path(), &unsaved);
    let kept = |page: &Page| {
        let state = page.get("/api/state").json();
        [&state["case"]["saved"], &state["case"]["kept"]].map(|is| is.as_bool().unwrap())
    };
    assert_eq!((kept(&page), names(&unsaved).len()), ([false, false], 0));
    edit(&page, "breast", json!("left"));
    assert_eq!(kept(&page), [false, true]);
    // Nothing is left to keep.
    let revision = page.get("/api/state").json()["revision"].clone();
    page.post("/api/undo", &json!({ "revision": revision }));
    assert_eq!((kept(&page), names(&unsaved).len()), ([false, false], 0));
    edit(&page, "breast", json!("left"));
    edit(&page, "mesh.tetrahedra", json!(1200));
    let found = names(&unsaved);
    let plain = |name: &String| {
        let (name, kind) = name.split_once('.').unwrap();
        name.len() == 16
            && name.chars().all(|c| c.is_ascii_hexdigit())
            && ["json", "lock"].contains(&kind)
    };
    assert!(found.len() == 2 && found.iter().all(plain), "{found:?}");
    #[cfg(unix)]
    for path in std::iter::once(unsaved.clone()).chain(found.iter().map(|name| unsaved.join(name)))
    {
        use std::os::unix::fs::PermissionsExt;
        let mode = std::fs::metadata(&path).unwrap().permissions().mode();
        assert_eq!(mode & 0o077, 0, "{path:?}");
    }
    // Not while the first has it open, and not where another folder is opened.
    let next = Page::keeping(dir.path(), &unsaved);
    assert_eq!(offered(&next, 0).len(), 0);
    drop(page);
    let one = offered(&next, 1).remove(0);
    assert_eq!(one["name"], "ct");
    let elsewhere = tempfile::tempdir().unwrap();
    assert_eq!(offered(&Page::keeping(elsewhere.path(), &unsaved), 0).len(), 0);
    let told = next.get(&format!("/api/whose/{}", one["id"].as_str().unwrap())).json();
    assert!(told["whose"].as_str().unwrap().contains("PHANTOM"), "{told}");
    next.idle();
    assert_eq!(next.post("/api/open", &json!({ "unsaved": one["id"] })).status, 200);
    let state = next.idle();
    assert_eq!(state["problem"], Value::Null);
    let values = &state["case"]["values"];
    assert_eq!((&values["breast"], &values["mesh.tetrahedra"]), (&json!("left"), &json!(1200)));
    assert_eq!((kept(&next), state["unsaved"].as_array().unwrap().len()), ([false, true], 0));
    // A file holds it now.
    assert_eq!(next.post("/api/save", &json!({ "dir": "0", "name": "case.toml" })).status, 200);
    assert_eq!((kept(&next), names(&unsaved).len()), ([true, false], 0));
}

#[test]
fn what_is_kept_can_be_thrown_away_and_what_is_damaged_is_not_offered() {
    let (dir, state) = (folder_of_a_patient(), tempfile::tempdir().unwrap());
    let page = new_case(dir.path(), state.path());
    edit(&page, "breast", json!("left"));
    // Another one is opened over it.
    let series = page.get("/api/state").json()["inspection"]["series"][0]["id"].clone();
    page.post("/api/open", &json!({ "series": series }));
    page.idle();
    std::fs::write(state.path().join("0123456789abcdef.json"), "{\"form\": 1").unwrap();
    let one = offered(&page, 1).remove(0);
    for id in ["0123456789abcdef", "../x", "77"] {
        assert_eq!(page.post("/api/open", &json!({ "unsaved": id })).status, 403, "{id}");
        assert_eq!(page.post("/api/discard", &json!({ "id": id })).status, 403, "{id}");
    }
    assert_eq!(page.post("/api/discard", &json!({ "id": one["id"] })).status, 200);
    assert_eq!(offered(&page, 0).len(), 0);
}

#[test]
fn a_case_file_that_another_program_changes_is_taken_over_and_what_was_before_is_marked() {
    let dir = tempfile::tempdir().unwrap();
    let (path, page) = opened(dir.path());
    page.post("/api/run", &json!({ "until": "region" }));
    let state = page.idle();
    assert_eq!((&state["problem"], &state["patches_old"]), (&Value::Null, &json!(false)));
    let text = std::fs::read_to_string(&path).unwrap();
    let other = text.replace("centre = [91", "centre = [90");
    assert!(text != other, "{text}");
    std::fs::write(&path, &other).unwrap();
    let old = page.state_once(|state| state["patches_old"] == true);
    let x = old["case"]["tumour"]["centre_mm"][0].as_f64().unwrap();
    assert!((90.0..91.0).contains(&x) && old["patches_old"] == true, "{old}");
    assert_eq!(old["case"]["can_undo"], true);
    let warned = old["warnings"].as_array().unwrap();
    assert!(warned.iter().all(|one| one["old"] == (one["stage"] == "region")), "{warned:?}");
    // A page that has not heard of it is told so.
    let edits = json!([{ "key": "table.ap", "value": 1.0 }]);
    std::fs::write(&path, &text).unwrap();
    let asked = json!({ "revision": old["revision"], "edits": edits });
    assert_eq!(page.post("/api/edit", &asked).status, 409);
    let back = page.state_once(|state| state["patches_old"] == false);
    assert!(back["warnings"].as_array().unwrap().iter().all(|one| one["old"] == false));
    // Nothing that can be taken over: all is of the case before, until it can be read again.
    for wrong in ["no case".to_owned(), text.replace("/ct\"", "/truth\"")] {
        std::fs::write(&path, wrong).unwrap();
        let astray = page.state_once(|state| state["case"]["astray"].is_string());
        assert_eq!(astray["patches_old"], true);
        assert!(fresh(&astray).iter().skip(1).all(|is| !is), "{astray}");
        std::fs::write(&path, &text).unwrap();
        let back = page.state_once(|state| state["case"]["astray"].is_null());
        assert!(back["patches_old"] == false && fresh(&back).iter().all(|is| *is), "{back}");
    }
}

fn fresh(state: &Value) -> Vec<bool> {
    let all = state["volumes"].as_array().unwrap();
    all.iter().map(|v| v["fresh"].as_bool().unwrap()).collect()
}

#[test]
fn the_list_tells_whose_a_case_is() {
    let dir = tempfile::tempdir().unwrap();
    small(dir.path());
    std::fs::write(dir.path().join("lost.toml"), "ct = 'nowhere'\n").unwrap();
    let page = Page::open(dir.path());
    page.idle();
    let all = page.get("/api/list").json()["cases"].clone();
    let whose = |n: usize| {
        page.get(&format!("/api/whose/{}", all[n]["id"].as_str().unwrap())).json()["whose"].clone()
    };
    let told = whose(0);
    let line = told.as_str().unwrap();
    assert!(["PHANTOM", "PH0143", "2026"].iter().all(|word| line.contains(word)), "{line}");
    assert_eq!(whose(1), Value::Null);
    assert_eq!(page.get("/api/whose/99").status, 403);
}
