//! Sessions that are kept, and followed once more.

use crate::support::{follower, link, near, recorded, stamp};
use std::path::{Path, PathBuf};
use supine_fem::Contact;
use supine_navigate::{
    Error, Frame, Head, Holding, Recorder, Recording, Renewing, Settings, replay,
};
use supine_space::Progress;

const POSES: u64 = 12;

/// A path of that name at which there is nothing.
fn empty(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    // It may be there from the last time.
    let _ = std::fs::remove_file(&path);
    path
}

fn head() -> Head {
    let settings =
        Settings { contact: Holding::Tied, renewal: Renewing::Between, ..Settings::default() };
    Head::new(Path::new("runs/block"), &settings, 0.7)
}

/// Records a session of some poses.
fn record(path: &Path) {
    let mut recorder = Recorder::new(path, &head()).unwrap();
    let counts = recorded(&link(Frame::Lps), Contact::Tied, Some(&mut recorder), |session| {
        let mut client = session.client();
        for n in 1..=POSES {
            client.follow(stamp(20 * n), &near(n));
        }
    });
    assert!(counts.followed >= POSES);
    recorder.end().unwrap();
}

#[test]
fn a_recorded_session_is_followed_again_to_the_bit() {
    let path = empty("whole.jsonl");
    record(&path);
    let mut recording = Recording::read(&path).unwrap();
    assert_eq!(recording.head, head());
    assert!(recording.lines.len() >= POSES as usize);
    let told = replay(&recording, &mut follower(Contact::Tied), Progress::none()).unwrap();
    assert!(told.promised && told.identical && told.holds(), "{told:?}");
    assert_eq!((told.answers, told.largest_mm, told.beyond), (recording.lines.len(), 0.0, 0));
    // One bit is seen.
    recording.lines[3].target[1] = recording.lines[3].target[1].next_up();
    let told = replay(&recording, &mut follower(Contact::Tied), Progress::none()).unwrap();
    assert!(!told.identical && !told.holds(), "{told:?}");
}

#[test]
fn a_recording_is_read_up_to_where_it_was_cut_and_a_wrong_line_is_named() {
    let path = empty("cut.jsonl");
    record(&path);
    let whole = Recording::read(&path).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let cut = &text[..text.trim_end().len() - 20];
    std::fs::write(&path, cut).unwrap();
    let read = Recording::read(&path).unwrap();
    assert_eq!(read.lines, whole.lines[..whole.lines.len() - 1]);
    // Cut between two lines: nothing is lost.
    std::fs::write(&path, text.trim_end()).unwrap();
    assert_eq!(Recording::read(&path).unwrap(), whole);

    let mut lines: Vec<&str> = text.lines().collect();
    lines[2] = "{\"number\": 2}";
    std::fs::write(&path, lines.join("\n")).unwrap();
    let error = Recording::read(&path).unwrap_err();
    assert!(matches!(&error, Error::Recording { path: of, line: 3, .. } if *of == path), "{error}");
    assert!(error.to_string().contains("cut.jsonl, line 3: "), "{error}");

    for first in ["", "poses", &text.replacen("\"recording\":1", "\"recording\":2", 1)] {
        std::fs::write(&path, first).unwrap();
        let error = Recording::read(&path).unwrap_err();
        assert!(matches!(&error, Error::Recording { line: 1, .. }), "{error}");
    }
    assert!(matches!(Recording::read(&empty("none.jsonl")), Err(Error::Read { .. })));
}

#[test]
fn a_file_that_is_there_is_not_overwritten() {
    let path = empty("there.jsonl");
    std::fs::write(&path, "mine").unwrap();
    let error = Recorder::new(&path, &head()).unwrap_err();
    assert!(matches!(&error, Error::Write { path: of, .. } if *of == path), "{error}");
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "mine");
}
