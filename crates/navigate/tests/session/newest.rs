//! The newest pose wins; what each is counted for.

use crate::support::{PATIENCE, answered, during, link, near, plan, stamp, transform, tumour};
use std::collections::BTreeSet;
use std::io::Write;
use std::time::Instant;
use supine_fem::Contact;
use supine_navigate::Frame;
use supine_navigate::trajectory::{Expect, Row, Trajectory};
use supine_openigtlink::{Content, Message, Rows, Stamp};

/// When the trajectory begins, s since 1970.
const EPOCH_S: u32 = 1_700_000_000;

#[test]
fn of_200_poses_in_one_write_the_last_is_answered_last_and_nothing_queues() {
    let poses = 200;
    let (mut answers, mut good) = (0, 0);
    let counts = during(&link(Frame::Lps), Contact::Tied, |session| {
        let mut bytes = vec![];
        for n in 1..=poses {
            transform("Applicator", stamp(n), &near(n)).write(&mut bytes);
        }
        let mut client = session.client();
        client.0.write_all(&bytes).unwrap();
        let last = stamp(poses);
        let (passed, _) = client.passing(|m| answered(m, last));
        // One that becomes stale meanwhile is told once more, and a prediction is followed once
        // more.
        let told = passed.iter().filter_map(|m| tumour(m).map(|item| (m.stamp.0, item)));
        let stamps: BTreeSet<u64> = told.clone().map(|(stamp, _)| stamp).chain([last.0]).collect();
        answers = stamps.len() as u64;
        good = told.filter(|(_, item)| item.group.to_string() == "ok").count() as u64;
        // What comes from now on is of the last pose alone.
        let after = client.until(|m| {
            assert!(tumour(m).is_none() || m.stamp == last, "{m:?}");
            crate::support::status(m, "Stale")
        });
        assert!(after.text.contains("Silence"), "{after:?}");
    });
    assert_eq!((counts.received, counts.accepted), (poses, poses));
    assert!(answers <= counts.followed && counts.followed <= poses, "{answers} {counts:?}");
    assert!(good <= counts.followed, "{good} {counts:?}");
    // Each was followed or overtaken; one that was predicted may be both.
    let (least, most) = (counts.followed - counts.predicted, counts.followed);
    let wanted = poses - counts.overtaken;
    assert!(least <= wanted && wanted <= most, "{counts:?}");
}

#[test]
fn each_row_of_the_short_motion_is_counted_as_it_expects() {
    let trajectory = Trajectory::short().entering(&plan(Contact::Tied).placed);
    let rows = trajectory.rows();
    let counts = during(&link(Frame::Lps), Contact::Tied, |session| {
        let message = |row: &Row| {
            let wire: Rows = row.rows.map(|row| row.map(|value| value as f32));
            Message::new("Applicator", Stamp(row.stamp(EPOCH_S)), Content::Transform(wire))
        };
        let mut client = session.client();
        rows.iter().for_each(|row| client.send(&message(row)));
        // Questions are answered in their order: all rows have been judged.
        let told = client.so_far();
        if !told.iter().any(|m| tumour(m).is_some()) {
            client.until(tumour);
        }
    });
    let expected =
        |wanted: &[Expect]| rows.iter().filter(|row| wanted.contains(&row.expect)).count() as u64;
    let refused = expected(&[Expect::NotFinite, Expect::NotRigid, Expect::Far]);
    assert_eq!((counts.received, counts.accepted), (1181, expected(&[Expect::Accept])));
    assert_eq!(counts.refused, refused);
    assert_eq!(counts.dropped, expected(&[Expect::Duplicate, Expect::Old]));
    assert_eq!((counts.accepted, counts.refused, counts.dropped), (1158, 10, 13));
    assert!(counts.followed >= 1 && counts.overtaken < counts.accepted, "{counts:?}");
}

/// A tracker that is slower than the tissue has each of its poses followed.
#[test]
fn poses_that_wait_for_their_answers_are_all_followed() {
    let counts = during(&link(Frame::Lps), Contact::Tied, |session| {
        let (begun, mut client) = (Instant::now(), session.client());
        for n in 1..=20 {
            client.follow(stamp(20 * n), &near(n));
            assert!(begun.elapsed() < PATIENCE);
        }
    });
    assert_eq!((counts.accepted, counts.overtaken), (20, 0));
    assert_eq!(counts.followed - counts.predicted, 20);
}
