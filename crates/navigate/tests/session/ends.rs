//! How a session ends.

use crate::support::{PATIENCE, during, link, near, stamp, status};
use std::time::{Duration, Instant};
use supine_fem::Contact;
use supine_navigate::Frame;
use supine_openigtlink::{Start, StatusCode, Verb};

/// The goal is 1 s. This is ten times what a machine with other work needs, and tells only an end
/// that waits for a peer.
const AT_THE_LATEST: Duration = Duration::from_secs(30);

#[test]
fn at_the_end_every_peer_is_told_and_nothing_is_waited_for() {
    let mut ended = None;
    during(&link(Frame::Lps), Contact::Tied, |session| {
        let (mut tracker, mut viewer) = (session.client(), session.client());
        let (mut idle, mut half) = (session.client(), session.client());
        // One wants images and does not read them, one never finishes its message.
        viewer.ask(Verb::Start(Start::Plain), "IMAGE");
        viewer.so_far();
        idle.so_far();
        half.so_far();
        std::io::Write::write_all(&mut half.0, &[0, 1, b'T']).unwrap();
        for n in 1..=5 {
            tracker.follow(stamp(20 * n), &near(n));
        }
        ended = Some(Instant::now());
        session.end();
        for client in [&mut tracker, &mut idle, &mut half] {
            let told = client.until(|m| status(m, "ShuttingDown"));
            assert_eq!(told.code, StatusCode::ShuttingDown);
            let begun = Instant::now();
            assert!(client.next().is_none() && begun.elapsed() < PATIENCE, "it is closed");
        }
    });
    // `during` returns when all threads have ended; making of tissue and region lies before.
    let lasted = ended.unwrap().elapsed();
    assert!(lasted < AT_THE_LATEST, "{lasted:?}");
}

#[test]
fn a_session_in_which_nobody_ever_was_ends() {
    let mut ended = None;
    during(&link(Frame::Lps), Contact::Tied, |_| ended = Some(Instant::now()));
    assert!(ended.unwrap().elapsed() < AT_THE_LATEST);
}
