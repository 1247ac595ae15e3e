//! Trackers that are servers: the session connects to them.

use crate::support::{Client, comes, during, link, near, stamp};
use std::net::TcpListener;
use supine_fem::Contact;
use supine_navigate::{Frame, Link};

/// The session's connection to a tracker.
fn accepted(listener: &TcpListener) -> Client {
    let mut accepted = None;
    assert!(comes(|| {
        accepted = listener.accept().ok();
        accepted.is_some()
    }));
    Client::on(accepted.unwrap().0)
}

#[test]
fn the_session_connects_to_a_tracker_and_again_when_it_comes_back() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.set_nonblocking(true).unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let link = Link { connect: Some(address.clone()), ..link(Frame::Lps) };
    let counts = during(&link, Contact::Tied, |session| {
        let said = |what: &str| session.notes().iter().filter(|note| note.contains(what)).count();
        for n in 1..=3 {
            let mut tracker = accepted(&listener);
            tracker.follow(stamp(20 * n as u64), &near(n as u64));
            assert_eq!(said("connected to"), n, "{:?}", session.notes());
            drop(tracker);
            assert!(comes(|| said("has gone") == n));
        }
    });
    assert_eq!((counts.received, counts.accepted), (3, 3));
}

#[test]
fn a_tracker_that_is_not_there_yet_is_waited_for() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    drop(listener);
    let link = Link { connect: Some(address.to_string()), ..link(Frame::Lps) };
    during(&link, Contact::Tied, |session| {
        assert!(comes(|| session.notes().iter().any(|note| note.contains("tried again"))));
        let listener = TcpListener::bind(address).unwrap();
        listener.set_nonblocking(true).unwrap();
        accepted(&listener).follow(stamp(20), &near(1));
        // Who connects by itself is served as well.
        session.client().so_far();
        let tries = session.notes().iter().filter(|note| note.contains("tried again")).count();
        assert_eq!(tries, 1, "said once");
    });
}
