//! What comes of a retrieval that fails in part.

use super::*;
use dicom_ul::pdu::{PDataValue, PDataValueType, Pdu};

#[test]
fn an_object_that_fails_takes_no_other_with_it() {
    let (out, (free, port)) = (tempfile::tempdir().unwrap(), listen());
    drop(free);
    let requests = Arc::new(Mutex::new(Vec::new()));
    let asked = requests.clone();
    let archive = Archive::start(move |talk, message| match message.command.field() {
        field::FIND => found(talk, message),
        _ => {
            let request = Identifier::from_bytes(&data_of(talk, message), true).unwrap();
            let named = request.text(tags::SOP_INSTANCE_UID);
            asked.lock().unwrap().push(named.clone());
            // It ends a request with the first object that fails, and that is always the same one.
            let fails = named.is_empty() || named.contains(INSTANCES[0]);
            if !fails {
                assert_eq!(store_at(port, &named, &object(&named)), 0);
            }
            let status = if fails { 0xC000 } else { 0 };
            let answer =
                Command::answer(&message.command, status).number(element::FAILED, fails.into());
            talk.send(message.context, &answer, None).unwrap();
        }
    });
    let info = fetch(&archive, port, out.path()).unwrap();
    assert_eq!((info.received, &info.missing[..]), (2, &INSTANCES.map(String::from)[..1]));
    let asked = requests.lock().unwrap().clone();
    assert_eq!(asked[..4], ["", INSTANCES[0], INSTANCES[1], INSTANCES[2]], "{asked:?}");
}

#[test]
fn a_title_that_the_archive_does_not_know_is_named_with_its_port() {
    let out = tempfile::tempdir().unwrap();
    // As the standard has it, and as archives say it too: it just failed, of no object.
    for status in [0xA801, 0xC000] {
        let (free, port) = listen();
        drop(free);
        let archive = mover(move || (status, 0));
        let error = fetch(&archive, port, out.path()).unwrap_err().to_string();
        let words =
            format!("title RECEIVER entered there as a receiver, at 127.0.0.1 port {port}?");
        assert!(error.contains(&words), "{error}");
    }
}

#[test]
fn an_archive_that_answers_for_ever_that_more_is_to_come_is_given_up() {
    let (out, (free, port)) = (tempfile::tempdir().unwrap(), listen());
    drop(free);
    let archive = Archive::start(move |talk, message| match message.command.field() {
        field::FIND => found(talk, message),
        _ => {
            let _asked = data_of(talk, message);
            let pending = Command::answer(&message.command, 0xFF00);
            while talk.send(message.context, &pending, None).is_ok() {}
        }
    });
    let error = fetch(&archive, port, out.path()).unwrap_err().to_string();
    assert!(error.contains("nothing comes"), "{error}");
}

#[test]
fn a_fetch_that_fails_leaves_no_empty_folder() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("a/b");
    let archive = mover(|| (0xA801, 0));
    let (free, port) = listen();
    drop(free);
    fetch(&archive, port, &out).unwrap_err();
    let other = QuerySpec { study: Some("1.2.99".into()), ..QuerySpec::default() };
    fetch_what(&other, &archive, port, &out).unwrap_err();
    assert!(!root.path().join("a").exists());
}

#[test]
fn an_image_without_pixels_is_not_kept() {
    let (out, (free, port)) = (tempfile::tempdir().unwrap(), listen());
    drop(free);
    let archive = mover(move || {
        let whole = object(INSTANCES[0]);
        // Pixel Data is the last element: 12 bytes before its two.
        assert_eq!(store_at(port, INSTANCES[0], &whole[..whole.len() - 14]), 0xC000);
        for instance in &INSTANCES[1..] {
            // An object of another is one, however often it comes.
            let evil = object_of("EVIL", SERIES, instance);
            assert_eq!(store_at(port, instance, &evil), 0xA900);
            assert_eq!(store_at(port, instance, &evil), 0xA900);
        }
        (0, 0)
    });
    let info = fetch(&archive, port, out.path()).unwrap();
    assert_eq!((info.received, &*info.missing), (0, &[INSTANCES[0].to_owned()][..]), "{info:?}");
    let told: String = info.warnings.iter().map(ToString::to_string).collect();
    assert!(told.contains("lacks pixels"), "{told}");
    let strangers: usize = info.strangers.iter().map(|one| one.instances.len()).sum();
    assert_eq!(strangers, 2, "{info:?}");
}

/// Begins to store an instance at a port and gets no further.
fn half_a_store(port: u16, instance: &str) -> Talk<'static> {
    let mut call = call(port, 0);
    call.peer.title = title("RECEIVER");
    let proposals = [Proposal::new(CLASS, &syntaxes::IDENTIFIER)];
    let mut talk = Talk::new(Link::open(&call, &proposals, &go_on).unwrap());
    let (context, _) = talk.link.context(CLASS, None).unwrap();
    let request = Command::request(field::STORE, 1, CLASS, true)
        .text(element::AFFECTED_SOP_INSTANCE, instance);
    talk.send(context, &request, None).unwrap();
    let half = PDataValue {
        presentation_context_id: context,
        value_type: PDataValueType::Data,
        is_last: false,
        data: object(instance)[..20].to_vec(),
    };
    talk.link.send(&Pdu::PData { data: vec![half] }).unwrap();
    talk
}

#[test]
fn a_caller_who_sends_half_an_object_keeps_no_other_out() {
    let (out, (free, port)) = (tempfile::tempdir().unwrap(), listen());
    drop(free);
    let mut kept = Vec::new();
    let archive = mover(move || {
        kept.push(half_a_store(port, INSTANCES[0]));
        for instance in INSTANCES {
            assert_eq!(store_at(port, instance, &object(instance)), 0);
        }
        (0, 0)
    });
    let info = fetch(&archive, port, out.path()).unwrap();
    assert_eq!((info.received, info.missing.len()), (3, 0), "{info:?}");
    let files = std::fs::read_dir(out.path()).unwrap().count();
    assert_eq!(files, 3, "nothing half is left");
}
