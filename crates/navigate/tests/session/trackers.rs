//! More than one device: one leads.

use crate::support::{
    AtEnd, PATIENCE, TRIES, answered, comes, during, link, longest_silence, near, rows, stale,
    stamp, status, transform,
};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use supine_fem::Contact;
use supine_navigate::{Frame, Link};
use supine_openigtlink::{Content, Message, StatusCode};

/// Time between two poses of a tracker.
const EACH: Duration = Duration::from_millis(20);
/// Time between two poses of a slow one. It leads on for three of these: that it is held up by
/// other work on the machine does not take the lead from it.
const SLOW: Duration = Duration::from_millis(300);
/// After so long without a pose another may lead.
const LEADS: Duration = Duration::from_millis(300);

#[test]
fn while_one_tracker_sends_the_other_is_told_that_it_does() {
    during(&link(Frame::Lps), Contact::Tied, |session| {
        let (mut first, mut second) = (session.client(), session.client());
        first.follow(stamp(300), &near(1));
        std::thread::sleep(SLOW);
        first.follow(stamp(600), &near(2));
        let over = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let _at_end = AtEnd(&over);
            let sending = scope.spawn(|| {
                for n in 3.. {
                    if over.load(Ordering::SeqCst) {
                        break;
                    }
                    first.pose(stamp(300 * n), &near(n));
                    std::thread::sleep(SLOW);
                }
                first
            });
            for n in 1..=5 {
                second.pose(stamp(n), &near(n));
                let busy = second.until(|m| status(m, "AnotherLeads"));
                assert_eq!(busy.code, StatusCode::Busy);
            }
            // That it loses sight of its tool is its own affair.
            let mut bad = rows(&near(0));
            bad[0][3] = f32::NAN;
            second.send(&Message::new("Applicator", stamp(6), Content::Transform(bad)));
            let (before, _) = second.passing(|m| status(m, "PoseRefused"));
            let after = second.so_far();
            let no_pose = |m: &Message| m.stamp == stamp(6) || status(m, "PoseRefused").is_some();
            assert!(!before.iter().chain(&after).any(no_pose));
            over.store(true, Ordering::SeqCst);
            let mut first = sending.join().unwrap();
            assert!(!first.so_far().iter().any(|m| status(m, "PoseRefused").is_some()));
            // The first has left: the second leads at once.
            first.leave();
            second.pose(stamp(100), &near(3));
            let (told, _) = second.passing(|m| answered(m, stamp(100)));
            assert!(!told.iter().any(|m| status(m, "AnotherLeads").is_some()));
        });
    });
}

#[test]
fn a_tracker_that_is_silent_for_0_3_s_leads_no_more() {
    let counts = during(&link(Frame::Lps), Contact::Tied, |session| {
        let (mut first, mut second) = (session.client(), session.client());
        first.follow(stamp(20), &near(1));
        let sent = Instant::now();
        first.pose(stamp(40), &near(2));
        first.until(|m| answered(m, stamp(40)));
        for n in 1.. {
            assert!(sent.elapsed() < PATIENCE);
            second.pose(stamp(1000 + n), &near(n));
            let busy = |m: &Message| status(m, "AnotherLeads").map(|_| false);
            let leads = |m: &Message| answered(m, stamp(1000 + n)).map(|_| true);
            if second.until(|m| leads(m).or_else(|| busy(m))) {
                break;
            }
            std::thread::sleep(EACH);
        }
        assert!(sent.elapsed() >= LEADS);
        // It leads from now on. Where the test is held up so long that it was silent, too, the
        // first may lead once more.
        for n in 1.. {
            assert!(sent.elapsed() < PATIENCE, "the first leads on");
            second.pose(stamp(5000 + n), &near(n));
            first.pose(stamp(60 + n), &near(n));
            let busy = |m: &Message| status(m, "AnotherLeads").map(|_| true);
            let leads = |m: &Message| answered(m, stamp(60 + n)).map(|_| false);
            if first.until(|m| busy(m).or_else(|| leads(m))) {
                break;
            }
            std::thread::sleep(LEADS + EACH);
        }
    });
    assert_eq!(counts.received, counts.accepted + counts.dropped);
}

/// Trackers send all tools that they see, with the same stamps.
#[test]
fn of_two_devices_of_a_peer_the_first_counts_and_the_other_is_passed_over() {
    let rounds = 10;
    for _ in 0..TRIES {
        let (mut told, mut poses) = (vec![], vec![]);
        let counts = during(&link(Frame::Lps), Contact::Tied, |session| {
            let mut client = session.client();
            for n in 1..=rounds {
                let sent = Instant::now();
                let other = transform("Stylus", stamp(20 * n), &near(n + 50));
                if n > 1 && n % 2 == 0 {
                    client.send(&other);
                }
                client.pose(stamp(20 * n), &near(n));
                if n % 2 == 1 {
                    client.send(&other);
                }
                let mut bad = rows(&near(n));
                bad[2][3] = f32::NAN;
                client.send(&Message::new("Pointer", stamp(20 * n), Content::Transform(bad)));
                told.extend(client.passing(|m| answered(m, stamp(20 * n))).0);
                told.extend(client.so_far());
                poses.push([sent, Instant::now()]);
            }
        });
        // A test that is held up so long that another device may lead is tried again.
        if longest_silence(&poses) < LEADS {
            for m in &told {
                let name = ["AnotherLeads", "PoseRefused"];
                assert!(name.iter().all(|name| status(m, name).is_none()), "{m:?}");
            }
            assert_eq!((counts.received, counts.accepted), (3 * rounds, rounds));
            assert_eq!((counts.refused, counts.dropped), (0, 2 * rounds));
            break;
        }
    }
}

#[test]
fn where_a_device_is_named_no_other_counts() {
    let link = Link { device: Some("Applicator".into()), ..link(Frame::Lps) };
    let counts = during(&link, Contact::Tied, |session| {
        let mut client = session.client();
        client.send(&transform("Stylus", stamp(10), &near(1)));
        client.follow(stamp(20), &near(2));
        client.send(&transform("applicator", stamp(30), &near(3)));
        assert!(client.so_far().iter().all(|m| stale(m).is_some() || m.stamp != stamp(30)));
    });
    assert_eq!((counts.received, counts.accepted, counts.dropped), (1, 1, 0));
}

#[test]
fn the_ninth_peer_is_told_that_there_are_too_many() {
    during(&link(Frame::Lps), Contact::Tied, |session| {
        let mut eight: Vec<_> = (0..8).map(|_| session.client()).collect();
        for client in &mut eight {
            client.so_far();
        }
        let mut ninth = session.client();
        let busy = ninth.until(|m| status(m, "TooManyPeers"));
        assert_eq!(busy.code, StatusCode::Busy);
        assert!(ninth.next().is_none());
        eight.remove(3).leave();
        let mut next = session.client();
        next.so_far();
        assert!(comes(|| session.peers() == 8));
    });
}
