//! Peers that read slowly or not at all cost nobody else anything.

use crate::support::{AtEnd, Client, Session, comes, during, link, near, stamp};
use std::io::{ErrorKind, Read};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use supine_fem::Contact;
use supine_navigate::Frame;
use supine_openigtlink::{Start, Verb};

/// Most that may lie in the sockets when the peer is let go, bytes: what the system keeps for both
/// ends.
const IN_SOCKETS: usize = 32 << 20;
/// A peer is let go within this: a message under way, and images until the sockets are full. That
/// takes some seconds, and longer where a machine has other work.
const LET_GO: Duration = Duration::from_secs(300);

/// A peer that wants all that is large.
fn greedy(session: &Session<'_>) -> Client {
    let mut client = session.client();
    for of in ["IMAGE", "POLYDATA"] {
        client.ask(Verb::Start(Start::Plain), of);
    }
    client.so_far();
    client
}

/// Poses, each answered, until the other peer is gone.
fn work_until_alone(session: &Session<'_>) {
    let (begun, mut client) = (Instant::now(), session.client());
    // The host looks ten times a second: it has seen both before one of them can be gone.
    assert!(comes(|| session.peers() == 2), "{} peers", session.peers());
    for n in 1.. {
        client.follow(stamp(20 * n), &near(n));
        if session.peers() == 1 {
            break;
        }
        assert!(begun.elapsed() < LET_GO, "the slow reader is kept");
    }
}

#[test]
fn who_never_reads_is_let_go_and_the_others_get_their_answers() {
    during(&link(Frame::Lps), Contact::Tied, |session| {
        let mut slow = greedy(session);
        work_until_alone(session);
        let (mut piece, mut all) = (vec![0; 1 << 20], 0);
        while let Ok(read) = slow.0.read(&mut piece)
            && read > 0
        {
            all += read;
            assert!(all < IN_SOCKETS, "more waited than the sockets hold");
        }
    });
}

#[test]
fn who_reads_in_small_pieces_is_let_go_too() {
    during(&link(Frame::Lps), Contact::Tied, |session| {
        let (mut slow, over) = (greedy(session), AtomicBool::new(false));
        std::thread::scope(|scope| {
            let _at_end = AtEnd(&over);
            let over = &over;
            scope.spawn(move || {
                let mut piece = vec![0; 48 << 10];
                while slow.0.read(&mut piece).is_ok_and(|read| read > 0) {
                    if over.load(Ordering::SeqCst) {
                        break;
                    }
                    std::thread::sleep(Duration::from_millis(100));
                }
            });
            work_until_alone(session);
        });
    });
}

/// Answers to questions wait as little as all else.
#[test]
fn who_asks_without_end_and_never_reads_is_let_go() {
    during(&link(Frame::Lps), Contact::Tied, |session| {
        let mut client = session.client();
        client.follow(stamp(20), &near(1));
        let mut slow = session.client();
        slow.0.set_write_timeout(Some(LET_GO)).unwrap();
        let begun = Instant::now();
        let query = crate::raw::Raw::new("GET_POLYDATA", &[]).bytes().repeat(50);
        let over = loop {
            if let Err(over) = std::io::Write::write_all(&mut slow.0, &query) {
                break over.kind();
            }
            assert!(begun.elapsed() < LET_GO, "it may ask for ever");
        };
        let waits = [ErrorKind::WouldBlock, ErrorKind::TimedOut];
        assert!(!waits.contains(&over), "it is not let go");
        client.follow(stamp(40), &near(2));
    });
}
