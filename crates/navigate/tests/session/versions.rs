//! Version 2 for peers that know it, with all that is known of an answer.

use crate::support::{answered, during, follower, link, near, stamp, taken, transform, tumour};
use std::collections::BTreeMap;
use supine_fem::Contact;
use supine_navigate::Frame;
use supine_openigtlink::{Message, Version};

#[test]
fn version_2_comes_only_after_the_peer_has_used_it() {
    during(&link(Frame::Lps), Contact::Tied, |session| {
        let (mut old, mut new) = (session.client(), session.client());
        // Both are known to the session.
        old.so_far();
        new.so_far();
        let first = |m: &Message| answered(m, stamp(20)).map(|_| m.clone());
        new.pose(stamp(20), &near(1));
        for message in [old.until(first), new.until(first)] {
            assert_eq!(message.version, Version::One);
            assert!(message.metadata.is_empty());
        }
        let second = |m: &Message| answered(m, stamp(40)).map(|_| m.clone());
        let version = Version::Two;
        new.send(&Message { version, ..transform("Applicator", stamp(40), &near(2)) });
        assert_eq!(old.until(second).version, Version::One);
        assert_eq!(new.until(second).version, Version::Two);
        let third = |m: &Message| answered(m, stamp(60)).map(|_| m.clone());
        new.pose(stamp(60), &near(3));
        assert_eq!(old.until(third).version, Version::One);
        let third = new.until(third);
        assert!(third.version == Version::Two && third.id >= 3, "{third:?}");
    });
}

#[test]
fn metadata_say_the_figures_of_the_answer_in_the_frame_of_the_peer() {
    for frame in [Frame::Lps, Frame::Ras] {
        let mut alone = follower(Contact::Tied);
        during(&link(frame), Contact::Tied, |session| {
            let mut client = session.client();
            let pose = frame.turn() * near(6);
            let version = Version::Two;
            client.send(&Message { version, ..transform("Applicator", stamp(20), &pose) });
            let message = client.until(|m| answered(m, stamp(20)).map(|_| m.clone()));
            let (wanted, _) = alone.follow(&taken(frame, &pose)).unwrap();
            let state = tumour(&message).unwrap().group.to_string();
            let said: BTreeMap<_, _> = message.metadata.into_iter().collect();
            let number = |key: &str| said[key].parse::<f64>().unwrap();
            assert_eq!((said["frame"].as_str(), said["state"].as_str()), (frame.name(), &*state));
            assert!((0.0..10_000.0).contains(&number("age_ms")));
            assert!((number("within_95_mm") - 2.0 - wanted.error_mm).abs() <= 0.006);
            assert!((number("solver_error_mm") - wanted.error_mm).abs() <= 1e-4);
            assert!((number("from_surface_mm") - wanted.from_surface_mm).abs() <= 0.006);
            assert!((number("from_axis_mm") - wanted.from_axis_mm).abs() <= 0.006);
            assert_eq!((number("sphere_radius_mm"), number("shaft_radius_mm")), (15.0, 5.0));
            for (key, vector) in [("moved_mm", wanted.moved), ("force_n", wanted.force_n)] {
                let words: Vec<f32> =
                    said[key].split(' ').map(|word| word.parse().unwrap()).collect();
                for (said, wanted) in words.iter().zip(frame.out(&vector)) {
                    assert!((said - wanted).abs() <= 1e-3, "{frame:?} {key}: {words:?} {vector:?}");
                }
                assert_eq!(words.len(), 3);
            }
            assert!(wanted.moved.norm() > 0.1);
        });
    }
}
