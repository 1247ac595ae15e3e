//! How good the last answer is, as everybody is told.

use crate::support::{
    Client, PATIENCE, TRIES, answered, during, link, longest_silence, near, stale, stamp, status,
    tumour,
};
use std::time::{Duration, Instant};
use supine_fem::Contact;
use supine_navigate::{Frame, Link};
use supine_openigtlink::{Content, Message, Stamp, Status, StatusCode};

/// Time between two poses of a tracker.
const EACH: Duration = Duration::from_millis(20);

/// What is told of the silence after a pose. Where a machine has other work there may have been one
/// before, too.
fn last_silence(client: &mut Client, last: Stamp) -> Status {
    let silence = |m: &Message| status(m, "Silence");
    client.until(|m| stale(m).filter(|_| m.stamp == last));
    let told = client.so_far();
    told.iter().rev().find_map(silence).unwrap_or_else(|| client.until(silence))
}

/// What is told each second.
fn each_second(message: &Message) -> Option<Status> {
    ["Waiting", "Stale", "ok", "predicted"].iter().find_map(|name| status(message, name))
}

#[test]
fn silence_makes_the_answer_stale_once_and_a_new_pose_makes_it_good() {
    during(&link(Frame::Lps), Contact::Tied, |session| {
        let (mut client, mut other) = (session.client(), session.client());
        other.so_far();
        for n in 1..10 {
            client.follow(stamp(20 * n), &near(n));
            std::thread::sleep(EACH);
        }
        let last = stamp(200);
        client.pose(last, &near(10));
        for client in [&mut client, &mut other] {
            let silent = last_silence(client, last);
            assert_eq!(silent.code, StatusCode::TimedOut);
            let ms: u32 = silent.text.split(' ').find_map(|word| word.parse().ok()).unwrap();
            assert!(ms >= 40, "{silent:?}");
            // Two more seconds of silence, and nothing new is said of it.
            for _ in 0..2 {
                let (passed, told) = client.passing(each_second);
                assert_eq!((told.code, told.name.as_str()), (StatusCode::TimedOut, "Stale"));
                assert!(told.text.starts_with("frame LPS; stale: Silence"), "{told:?}");
                let again = |m: &Message| stale(m).is_some() || status(m, "Silence").is_some();
                assert!(!passed.iter().any(again), "{passed:?}");
            }
        }
        client.ask(supine_openigtlink::Verb::Get, "POINT");
        client.until(|m| stale(m).filter(|_| m.stamp == last));
        let again = client.good_again(Frame::Lps, 11);
        other.until(|m| answered(m, again));
        client.ask(supine_openigtlink::Verb::Get, "STATUS");
        let told = client.until(each_second);
        assert!(told.code == StatusCode::Ok || told.text.contains("Silence"), "{told:?}");
    });
}

/// The interval of a tracker is known from its second pose on; until then nobody knows how long it
/// may be silent.
#[test]
fn a_slow_tracker_is_not_stale_between_its_first_poses() {
    const SLOW: Duration = Duration::from_millis(120);
    for _ in 0..TRIES {
        let (mut passed, mut poses) = (vec![], vec![]);
        during(&link(Frame::Lps), Contact::Tied, |session| {
            let mut client = session.client();
            for n in 1..=4 {
                let sent = Instant::now();
                client.pose(stamp(120 * n), &near(n));
                let (before, _) = client.passing(|m| answered(m, stamp(120 * n)));
                passed.extend(before);
                passed.extend(client.so_far());
                poses.push([sent, Instant::now()]);
                std::thread::sleep(SLOW);
            }
        });
        // A test that is held up for three intervals is silent in truth, and is tried again.
        if longest_silence(&poses) < SLOW * 3 {
            assert!(!passed.iter().any(|m| stale(m).is_some()), "{passed:?}");
            break;
        }
    }
}

#[test]
fn poses_that_are_equal_to_the_bit_are_frozen() {
    let counts = during(&link(Frame::Lps), Contact::Tied, |session| {
        let mut client = session.client();
        for n in 1..=4 {
            client.follow(stamp(20 * n), &near(1));
        }
        client.pose(stamp(100), &near(1));
        let frozen = client.until(|m| status(m, "Frozen"));
        assert_eq!(frozen.code, StatusCode::NotReady);
        client.ask(supine_openigtlink::Verb::Get, "POINT");
        client.until(|m| stale(m).filter(|_| m.stamp == stamp(80)));
        // Once is enough.
        for n in 6..=10 {
            client.pose(stamp(20 * n), &near(1));
        }
        assert!(!client.so_far().iter().any(|m| status(m, "Frozen").is_some()));
        client.follow(stamp(220), &near(2));
    });
    assert_eq!((counts.accepted, counts.followed - counts.predicted), (11, 5));
}

#[test]
fn an_answer_for_an_old_pose_is_late_and_everybody_is_told_so() {
    let link = Link { late: Duration::from_millis(200), ..link(Frame::Lps) };
    during(&link, Contact::Tied, |session| {
        let (mut client, mut other) = (session.client(), session.client());
        client.follow(stamp(20), &near(1));
        // Its stamp is 20 ms later, and it comes half a second later.
        std::thread::sleep(Duration::from_millis(520));
        client.pose(stamp(40), &near(2));
        for client in [&mut client, &mut other] {
            let (passed, told) = client.passing(|m| status(m, "Late"));
            let is_good = |item: supine_openigtlink::PointItem| item.group.to_string() == "ok";
            let good = |m: &Message| m.stamp == stamp(40) && tumour(m).is_some_and(is_good);
            assert!(!passed.iter().any(good), "{passed:?}");
            assert_eq!(told.code, StatusCode::TimedOut);
            let ms: u32 = told.text.split(' ').find_map(|word| word.parse().ok()).unwrap();
            assert!(ms >= 480, "{told:?}");
        }
        // After some silence the age is that of the pose, not that of the answer when it was ready.
        let silent = client.until(|m| status(m, "Stale"));
        // "… the last pose is 530 ms old"
        let old = silent.text.rsplit(' ').find_map(|word| word.parse::<u32>().ok()).unwrap();
        assert!(old >= 480, "{silent:?}");
    });
}

#[test]
fn each_second_everybody_is_told_the_state_and_the_frame() {
    for frame in [Frame::Lps, Frame::Ras] {
        during(&link(frame), Contact::Tied, |session| {
            let (mut client, mut other) = (session.client(), session.client());
            other.so_far();
            for client in [&mut client, &mut other] {
                for _ in 0..2 {
                    let told = client.until(each_second);
                    assert_eq!((told.code, told.name.as_str()), (StatusCode::NotReady, "Waiting"));
                    assert_eq!(
                        told.text,
                        format!("frame {}; late after 3600000 ms; no pose yet", frame.name())
                    );
                }
            }
            // A tracker at work: the state is good.
            let begun = Instant::now();
            for n in 1.. {
                client.pose(stamp(20 * n), &(frame.turn() * near(n)));
                std::thread::sleep(EACH);
                let good = |m: &Message| status(m, "ok").filter(|s| s.text.contains("poses/s"));
                if let Some(told) = client.so_far().iter().find_map(good) {
                    assert_eq!(told.code, StatusCode::Ok);
                    assert!(told.text.starts_with(&format!("frame {};", frame.name())), "{told:?}");
                    break;
                }
                assert!(begun.elapsed() < PATIENCE, "no good state is told");
            }
        });
    }
}

#[test]
fn a_refused_pose_is_said_once_to_each() {
    during(&link(Frame::Lps), Contact::Tied, |session| {
        let (mut client, mut other) = (session.client(), session.client());
        other.so_far();
        client.follow(stamp(20), &near(1));
        let mut bad = crate::support::rows(&near(2));
        bad[0][0] = f32::INFINITY;
        client.send(&Message::new("Applicator", stamp(40), Content::Transform(bad)));
        let told = |messages: &[Message]| {
            messages.iter().filter(|m| status(m, "PoseRefused").is_some()).count()
        };
        assert_eq!(told(&client.so_far()), 1);
        other.until(|m| stale(m).filter(|_| m.stamp == stamp(20)));
        other.until(|m| status(m, "PoseRefused"));
        assert_eq!(told(&other.so_far()), 0);
    });
}
