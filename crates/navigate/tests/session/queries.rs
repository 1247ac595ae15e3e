//! Questions and their answers.

use crate::raw::Raw;
use crate::support::{
    Client, answered, during, follower, link, near, region, stamp, status, taken, tumour,
};
use std::io::Write;
use supine_fem::Contact;
use supine_mesh::Deformation;
use supine_navigate::{Followed, Follower, Frame};
use supine_openigtlink::{
    Content, Image, ImageFrame, Message, Outcome, PolyData, Query, Rows, Stamp, Start, StatusCode,
    Verb,
};

fn poly_data(message: &Message) -> Option<PolyData> {
    match &message.content {
        Content::PolyData(data) if message.device == "Surface" => Some(data.clone()),
        _ => None,
    }
}

fn image(message: &Message) -> Option<Image> {
    match &message.content {
        Content::Image(image) if message.device == "Region" => Some(image.clone()),
        _ => None,
    }
}

/// The outcome of a query about a type.
fn replied(message: &Message, of: &str) -> Option<Outcome> {
    match &message.content {
        Content::Query(Query { verb: Verb::Reply(outcome), of: about }) if about == of => {
            Some(*outcome)
        }
        _ => None,
    }
}

/// The n-th pose, in the session and alone.
fn followed(
    client: &mut Client,
    alone: &mut Follower,
    frame: Frame,
    n: u64,
) -> (Stamp, Followed, Deformation) {
    let (stamp, pose) = (stamp(20 * n), frame.turn() * near(n));
    client.follow(stamp, &pose);
    let (followed, deformation) = alone.follow(&taken(frame, &pose)).unwrap();
    alone.between().unwrap();
    (stamp, followed, deformation)
}

#[test]
fn before_the_first_pose_there_is_nothing_to_tell() {
    during(&link(Frame::Ras), Contact::Tied, |session| {
        let mut client = session.client();
        for of in ["POINT", "POSITION", "TRANSFORM", "POLYDATA", "IMAGE"] {
            client.ask(Verb::Get, of);
            let told = client.until(|m| status(m, "Waiting").filter(|s| s.text.contains("answer")));
            assert_eq!(told.code, StatusCode::NotReady, "{of}");
        }
        client.ask(Verb::Get, "STATUS");
        let told = client.until(|m| status(m, "Waiting"));
        assert_eq!(
            (told.code, told.text.as_str()),
            (StatusCode::NotReady, "frame RAS; late after 3600000 ms; no pose yet")
        );
        client.ask(Verb::Get, "STRING");
        let text = client.until(|m| match &m.content {
            Content::Text(text) => Some(text.text.clone()),
            _ => None,
        });
        assert_eq!(text, "frame RAS; late after 3600000 ms; no pose yet");
        client.ask(Verb::Get, "CAPABILITY");
        let types = client.until(|m| match &m.content {
            Content::Capabilities(types) => Some(types.clone()),
            _ => None,
        });
        for of in ["TRANSFORM", "POINT", "STATUS", "POLYDATA", "IMAGE", "STRING"] {
            assert!(types.iter().any(|own| own == of), "{of}");
        }
    });
}

#[test]
fn the_last_answer_is_told_in_each_form() {
    for frame in [Frame::Lps, Frame::Ras] {
        let mut alone = follower(Contact::Tied);
        during(&link(frame), Contact::Tied, |session| {
            let mut client = session.client();
            let (stamp, wanted, _) = followed(&mut client, &mut alone, frame, 3);
            let place = frame.place(&wanted.target);
            let of = |m: &Message| m.stamp == stamp;
            let mut other = session.client();
            other.ask(Verb::Get, "POINT");
            let item = other.until(|m| tumour(m).filter(|_| of(m)));
            assert_eq!((item.position, item.diameter), (place, 16.0));
            other.ask(Verb::Get, "POSITION");
            let position = other.until(|m| match &m.content {
                Content::Position(position) if of(m) && m.device == "Tumour" => Some(*position),
                _ => None,
            });
            assert_eq!(position.position, place);
            let pose = frame.turn() * near(3);
            let long = Raw::new("GET_TRANSFOR", &[]).bytes();
            for n in 0..2 {
                match n {
                    0 => other.ask(Verb::Get, "TRANSFORM"),
                    _ => other.0.write_all(&long).unwrap(),
                }
                let rows: Rows = other.until(|m| match &m.content {
                    Content::Transform(rows) if of(m) && m.device == "Applicator" => Some(*rows),
                    _ => None,
                });
                let wanted = crate::support::rows(&pose);
                for (a, b) in rows.iter().flatten().zip(wanted.iter().flatten()) {
                    assert!((a - b).abs() < 1e-5, "{frame:?} {rows:?} {wanted:?}");
                }
            }
            other.ask(Verb::Get, "STATUS");
            let frame = format!("frame {}", frame.name());
            let told = other.until(|m| status(m, "ok").or_else(|| status(m, "Stale")));
            assert!(told.text.starts_with(&frame), "{told:?}");
        });
    }
}

#[test]
fn the_surface_is_that_of_the_displaced_tissue() {
    for frame in [Frame::Lps, Frame::Ras] {
        let mut alone = follower(Contact::Tied);
        during(&link(frame), Contact::Tied, |session| {
            let mut client = session.client();
            followed(&mut client, &mut alone, frame, 1);
            let (stamp, _, deformation) = followed(&mut client, &mut alone, frame, 2);
            client.ask(Verb::Get, "POLYDATA");
            let shown = client.until(|m| poly_data(m).filter(|_| m.stamp == stamp));
            let (mesh, u) = (deformation.mesh(), deformation.displacement().values());
            assert_eq!(shown.polygons.len(), mesh.boundary().len());
            let moved = &shown.attributes[0];
            assert_eq!(
                (moved.name(), moved.values().len()),
                ("displacement_mm", shown.points.len())
            );
            for (face, polygon) in mesh.boundary().iter().zip(shown.polygons.iter()) {
                assert_eq!(polygon.len(), 3);
                for (p, shown_at) in face.points.iter().zip(polygon) {
                    let (p, at) = (*p as usize, *shown_at as usize);
                    assert_eq!(shown.points[at], frame.place(&(mesh.points()[p] + u[p])));
                    assert_eq!(moved.values()[at], u[p].norm() as f32);
                }
            }
            let largest = moved.values().iter().fold(0.0_f32, |a, b| a.max(*b));
            assert!(largest > 0.1, "nothing moved");
        });
    }
}

#[test]
fn who_has_heard_an_answer_gets_its_surface_or_a_later_one() {
    during(&link(Frame::Lps), Contact::Tied, |session| {
        let (mut client, mut viewer) = (session.client(), session.client());
        // Another's surface is made first.
        viewer.ask(Verb::Start(Start::Plain), "POLYDATA");
        assert_eq!(viewer.until(|m| replied(m, "POLYDATA")), Outcome::Done);
        for n in 1..60 {
            client.follow(stamp(20 * n), &near(n % 5));
            client.ask(Verb::Get, "POLYDATA");
            let of = client.until(|m| poly_data(m).map(|_| m.stamp));
            assert_eq!(of, stamp(20 * n), "{n}");
        }
    });
}

#[test]
fn the_image_is_the_carried_region_where_its_grid_has_it() {
    for frame in [Frame::Lps, Frame::Ras] {
        let (mut alone, mut region) = (follower(Contact::Tied), region());
        during(&link(frame), Contact::Tied, |session| {
            let mut client = session.client();
            let (stamp, _, deformation) = followed(&mut client, &mut alone, frame, 4);
            client.ask(Verb::Get, "IMAGE");
            let image = client.until(|m| image(m).filter(|_| m.stamp == stamp));
            let ct = region.carry(&deformation).unwrap();
            let bytes: Vec<u8> = ct.data().iter().flat_map(|hu| hu.to_le_bytes()).collect();
            assert!(image.data() == bytes, "voxels differ");
            let layout = image.layout();
            assert_eq!(layout.size.map(usize::from), ct.grid().size());
            let flag = if frame == Frame::Ras { ImageFrame::Ras } else { ImageFrame::Lps };
            assert_eq!(layout.frame, flag);
            let first = layout.first_voxel();
            for index in [[0.0; 3], [127.0, 0.0, 0.0], [3.0, 90.0, 41.0]] {
                let wanted = frame.place(&ct.grid().patient_from_index(index));
                for axis in 0..3 {
                    let along = (0..3).map(|k| index[k] * f64::from(layout.steps[k][axis]));
                    let at = first[axis] + along.sum::<f64>();
                    assert!((at - f64::from(wanted[axis])).abs() < 1e-3, "{frame:?} {index:?}");
                }
            }
        });
    }
}

/// It is there, and on its way, before an answer that comes after it.
fn comes_with(client: &mut Client, n: u64, wanted: &dyn Fn(&Message) -> bool) -> bool {
    let before = client.so_far();
    client.pose(stamp(20 * n), &near(n));
    let (passed, _) = client.passing(|m| status(m, "Silence"));
    before.iter().chain(&passed).any(|m| m.stamp == stamp(20 * n) && wanted(m))
}

#[test]
fn surfaces_and_images_come_from_start_to_stop() {
    during(&link(Frame::Lps), Contact::Tied, |session| {
        let mut client = session.client();
        let surface = |m: &Message| poly_data(m).is_some();
        let picture = |m: &Message| image(m).is_some();
        client.follow(stamp(20), &near(1));
        client.follow(stamp(40), &near(2));
        assert!(!comes_with(&mut client, 3, &|m| surface(m) || picture(m)));
        let reply = |client: &mut Client, verb: Verb, of: &str| {
            client.ask(verb, of);
            client.until(|m| replied(m, of))
        };
        let starts = [("POLYDATA", Start::Interval { interval: 0 }), ("IMAGE", Start::Plain)];
        for (of, start) in starts {
            assert_eq!(reply(&mut client, Verb::Start(start), of), Outcome::Done);
        }
        for n in 4..7 {
            client.pose(stamp(20 * n), &near(n));
            let of = |m: &Message| m.stamp == stamp(20 * n);
            let (mut shown, mut carried) = (false, false);
            while !(shown && carried) {
                let (is_shown, is_carried) = client.until(|m| {
                    let what = (of(m) && surface(m), of(m) && picture(m));
                    (what.0 || what.1).then_some(what)
                });
                (shown, carried) = (shown || is_shown, carried || is_carried);
            }
        }
        assert_eq!(reply(&mut client, Verb::Stop, "POLYDATA"), Outcome::Done);
        client.pose(stamp(200), &near(8));
        let (passed, _) = client.passing(|m| image(m).filter(|_| m.stamp == stamp(200)));
        assert!(!passed.iter().any(|m| m.stamp == stamp(200) && surface(m)));
        assert_eq!(reply(&mut client, Verb::Stop, "IMAGE"), Outcome::Done);
        assert!(!comes_with(&mut client, 12, &|m| surface(m) || picture(m)));
    });
}

#[test]
fn the_pose_of_the_applicator_comes_from_start_to_stop() {
    during(&link(Frame::Ras), Contact::Tied, |session| {
        let mut client = session.client();
        let is_pose = |m: &Message| matches!(m.content, Content::Transform(_));
        let rounds =
            [(None, false), (Some(Verb::Start(Start::Plain)), true), (Some(Verb::Stop), false)];
        for (n, (verb, wanted)) in (1..).zip(rounds) {
            if let Some(verb) = verb {
                client.ask(verb, "TRANSFORM");
                assert_eq!(client.until(|m| replied(m, "TRANSFORM")), Outcome::Done);
            }
            client.pose(stamp(20 * n), &(Frame::Ras.turn() * near(n)));
            let (passed, _) = client.passing(|m| answered(m, stamp(20 * n)));
            let came = passed.iter().any(|m| is_pose(m) && m.stamp == stamp(20 * n));
            assert_eq!(came, wanted, "{n}");
        }
    });
}

#[test]
fn what_cannot_be_had_fails_by_name() {
    during(&link(Frame::Lps), Contact::Tied, |session| {
        let mut client = session.client();
        let asked = [
            (Verb::Get, "SENSOR"),
            (Verb::Get, "TDATA"),
            (Verb::Start(Start::Plain), "POINT"),
            (Verb::Stop, "STATUS"),
        ];
        for (verb, of) in asked {
            client.ask(verb.clone(), of);
            assert_eq!(client.until(|m| replied(m, of)), Outcome::Failed, "{verb:?} {of}");
        }
        client.0.write_all(&Raw::new("GET_WHATEVER", &[]).bytes()).unwrap();
        let unknown = client.until(|m| status(m, "UnknownType"));
        assert_eq!(unknown.code, StatusCode::UnknownInstruction);
        client.send(&Message::new("", Stamp::NONE, Content::Points(vec![])));
        let unused = client.until(|m| status(m, "NotUsed"));
        assert_eq!(unused.code, StatusCode::UnknownInstruction);
    });
}
