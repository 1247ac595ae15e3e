//! Poses in, places out.

use crate::support::{answered, during, follower, link, rows, shifted, stale, stamp, status};
use supine_fem::Contact;
use supine_navigate::Frame;
use supine_openigtlink::{Content, Message, StatusCode};
use supine_space::Vector;

/// What goes over the wire is what the tissue does, with the stamp of the pose, in the frame of the
/// peer.
#[test]
fn the_tumour_comes_back_with_the_stamp_of_the_pose() {
    for frame in [Frame::Lps, Frame::Ras] {
        let mut alone = follower(Contact::Tied);
        let counts = during(&link(frame), Contact::Tied, |session| {
            let mut client = session.client();
            for n in 1..=5 {
                let pose = shifted(Vector::new(0.4, 0.3, -0.2) * n as f64);
                client.pose(stamp(20 * n), &(frame.turn() * pose));
                let item = client.until(|m| answered(m, stamp(20 * n)));
                let (wanted, _) = alone.follow(&pose).unwrap();
                alone.between().unwrap();
                let wanted = frame.place(&wanted.target);
                for axis in 0..3 {
                    let off = (item.position[axis] - wanted[axis]).abs();
                    assert!(off < 2e-3, "{frame:?} {n}: {:?} {wanted:?}", item.position);
                }
            }
        });
        assert_eq!((counts.received, counts.accepted, counts.followed), (5, 5, 5));
    }
}

#[test]
fn a_pose_that_is_none_makes_the_last_answer_stale() {
    during(&link(Frame::Lps), Contact::Tied, |session| {
        let mut client = session.client();
        let before = client.follow(stamp(20), &shifted(Vector::new(0.5, 0.0, 0.0)));
        let mut bad = rows(&shifted(Vector::zeros()));
        bad[1][1] = f32::NAN;
        client.send(&Message::new("Applicator", stamp(40), Content::Transform(bad)));
        let stale = client.until(stale);
        assert_eq!(stale.position, before.position);
        let refused = client.until(|m| status(m, "PoseRefused"));
        assert_eq!(refused.code, StatusCode::ConfigurationError);
        client.good_again(Frame::Lps, 3);
    });
}
