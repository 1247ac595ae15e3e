//! What an archive answers to objects that are sent.

use super::*;
use dicom_ul::pdu::{AbortRQSource, PDataValue, PDataValueType, Pdu};
use std::io::{Read as _, Write as _};

fn try_send(folder: &Path, call: &Call) -> Result<crate::SendInfo, Error> {
    crate::send(&[folder.to_owned()], call, &SendParams::default(), Progress::none())
}

/// Answers on a port as no archive does, whoever calls first.
fn stranger(answer: impl FnOnce(TcpStream) + Send + 'static) -> u16 {
    let (socket, port) = listen();
    std::thread::spawn(move || answer(socket.accept().unwrap().0));
    port
}

#[test]
fn success_for_another_object_is_none() {
    let folder = tempfile::tempdir().unwrap();
    write_objects(folder.path(), 2);
    let mut first = true;
    let archive = Archive::start(move |talk, message| {
        if message.command.field() != field::STORE {
            return reply(talk, message, 0);
        }
        data_of(talk, message);
        let mut answer = Command::answer(&message.command, 0);
        if std::mem::take(&mut first) {
            answer = answer.text(element::AFFECTED_SOP_INSTANCE, "1.2.3.4.5");
        }
        talk.send(message.context, &answer, None).unwrap();
    });
    let info = send(folder.path(), &archive, 0);
    assert_eq!((info.stored, info.refused.len()), (1, 1), "{info:?}");
    assert!(info.refused[0].reason.contains("answers for another object"), "{info:?}");
    let info = send(folder.path(), &archive, 0);
    assert_eq!((info.stored, info.known), (1, 1), "it is sent again: {info:?}");
}

#[test]
fn only_success_and_what_begins_with_b_is_kept_and_what_is_there_is_there() {
    let folder = tempfile::tempdir().unwrap();
    write_objects(folder.path(), 6);
    let (archive, _) = keeper(&[0x0001, 0x0107, 0x0111, 0x0116, 0x0124, 0xB000]);
    let info = send(folder.path(), &archive, 0);
    assert_eq!((info.stored, info.present, info.left), (1, 1, 0), "{info:?}");
    let refused: Vec<&str> = info.refused.iter().map(|refused| &*refused.file).collect();
    assert_eq!(refused, ["1.dcm", "2.dcm", "4.dcm", "5.dcm"], "{info:?}");
    assert!(info.refused[3].reason.contains("is the AE title SUPINE permitted"), "{info:?}");
    let told: Vec<String> = info.warnings.iter().map(ToString::to_string).collect();
    assert!(told[0].contains("3.dcm") && told[0].contains("there already"), "{told:?}");
    assert!(told[1].contains("6.dcm") && told[1].contains("B000H"), "{told:?}");
    let info = send(folder.path(), &archive, 0);
    assert_eq!(info.known, 1, "only what was acknowledged is on record: {info:?}");
    let known = info.known_in_words().unwrap();
    assert!(known.starts_with("1 acknowledged on 2"), "{known}");
}

/// An archive that aborts when more than this is to be stored.
fn aborting(most: usize) -> Archive {
    let mut asked = 0;
    Archive::start(move |talk, message| {
        if message.command.field() != field::STORE {
            return reply(talk, message, 0);
        }
        data_of(talk, message);
        asked += 1;
        if asked <= most {
            return reply(talk, message, 0);
        }
        talk.link.send(&Pdu::AbortRQ { source: AbortRQSource::ServiceUser }).unwrap();
    })
}

#[test]
fn who_may_not_store_is_told_its_title_and_address_and_not_to_try_again() {
    let folder = tempfile::tempdir().unwrap();
    write_objects(folder.path(), 2);
    let archive = aborting(0);
    let error = try_send(folder.path(), &call(archive.port, 1)).unwrap_err();
    assert_eq!(error.kind(), Failure::Input, "{error}");
    for words in ["asked to store", "SUPINE", "127.0.0.1"] {
        assert!(error.to_string().contains(words), "{words}: {error}");
    }
    // One that has kept something permits it.
    let archive = aborting(1);
    let info = send(folder.path(), &archive, 0);
    assert_eq!((info.stored, info.left), (1, 1), "{info:?}");
    assert!(info.broken.unwrap().contains("aborted"));
}

#[test]
fn who_speaks_no_dicom_is_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    write_objects(folder.path(), 1);
    for (says, words) in [
        ("HTTP/1.1 400 Bad Request\r\n\r\n", "speaks HTTP"),
        ("SSH-2.0-OpenSSH_9.2\r\n", "something else than DICOM"),
    ] {
        let port = stranger(move |mut stream| {
            stream.write_all(says.as_bytes()).unwrap();
            // Until the caller is gone.
            let _gone = stream.read_to_end(&mut Vec::new());
        });
        let error = try_send(folder.path(), &call(port, 0)).unwrap_err();
        assert!(error.to_string().contains(words), "{error}");
    }
}

#[test]
fn a_peer_that_drips_is_given_up_though_it_is_never_silent() {
    let folder = tempfile::tempdir().unwrap();
    write_objects(folder.path(), 1);
    let (tell, told) = std::sync::mpsc::channel();
    let port = stranger(move |mut stream| {
        // An acceptance of 60 KB, one byte after the other, for a minute at most.
        let _head = stream.write_all(&[2, 0, 0, 0, 0xEA, 0x60]);
        for _ in 0..1200 {
            if stream.write_all(&[0]).is_err() {
                return;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        tell.send(()).unwrap();
    });
    let call = Call { timeout: Duration::from_secs(2), ..call(port, 0) };
    let info = try_send(folder.path(), &call).unwrap();
    // Where the machine is so slow that the peer seems silent, it is given up for that.
    let broken = info.broken.unwrap();
    assert!(broken.contains("too slow") || broken.contains("no answer within"), "{broken}");
    assert!(told.try_recv().is_err(), "it was given up before it was done");
}

#[test]
fn a_message_of_pieces_without_a_byte_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    write_objects(folder.path(), 1);
    let archive = Archive::start(|talk, message| {
        let value = |_| PDataValue {
            presentation_context_id: message.context,
            value_type: PDataValueType::Command,
            is_last: false,
            data: Vec::new(),
        };
        talk.link.send(&Pdu::PData { data: (0..3).map(value).collect() }).unwrap();
    });
    let error = try_send(folder.path(), &call(archive.port, 0)).unwrap_err().to_string();
    assert!(error.contains("without a byte"), "{error}");
}

#[test]
fn a_class_that_is_not_taken_is_told_apart_from_its_transfer_syntax() {
    let implicit = "not even in Implicit VR Little Endian";
    for (syntax, words) in [
        (uids::EXPLICIT_VR_LITTLE_ENDIAN, implicit),
        // Nothing else was proposed for it.
        (uids::RLE_LOSSLESS, "takes no CT Image Storage in RLE Lossless"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let mut bytes = file_header(CLASS, "1.2.3", syntax);
        bytes.extend(object("1.2.3"));
        std::fs::write(folder.path().join("1.dcm"), bytes).unwrap();
        let taken = |class: &str| -> &'static [&'static str] {
            if class == CLASS { &[] } else { &syntaxes::IDENTIFIER }
        };
        let archive = Archive::taking(taken, |talk, message| reply(talk, message, 0));
        let info = send(folder.path(), &archive, 0);
        assert!(info.refused[0].reason.contains(words), "{info:?}");
    }
}

#[test]
fn as_many_contexts_are_proposed_as_there_are_numbers() {
    let archive = Archive::start(|_, _| {});
    let proposals = vec![Proposal::new(CLASS, &syntaxes::IDENTIFIER); 128];
    let link = Link::open(&call(archive.port, 0), &proposals, &go_on).unwrap();
    assert_eq!(link.contexts.len(), 128);
    link.release().unwrap();
}

/// Writes an object of a patient, study and series (in this order) with a comment in it.
fn write_object(path: &Path, instance: &str, whose: [&str; 3], comment: &str) {
    let [patient, study, series] = whose;
    let mut bytes = file_header(CLASS, instance, uids::EXPLICIT_VR_LITTLE_ENDIAN);
    let set = Identifier::from_bytes(&object(instance), true).unwrap();
    let set = set.with(tags::PATIENT_ID, patient).with(tags::STUDY_INSTANCE_UID, study);
    let set = set.with(tags::SERIES_INSTANCE_UID, series).with(tags::IMAGE_COMMENTS, comment);
    bytes.extend(set.to_bytes(true));
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn objects_that_contradict_each_other_do_not_leave() {
    let (archive, sent) = keeper(&[0]);
    let of = |second: &str, whose: [&str; 3], comment: &str| {
        let folder = tempfile::tempdir().unwrap();
        write_object(&folder.path().join("1.dcm"), "1.2.3.1", ["A", "1.2", "1.2.3"], "");
        write_object(&folder.path().join("2.dcm"), second, whose, comment);
        let outcome = try_send(folder.path(), &call(archive.port, 0));
        (outcome, std::mem::take(&mut *sent.lock().unwrap()).len())
    };
    for (second, whose, comment, words) in [
        ("1.2.3.2", ["B", "1.2", "1.2.3"], "", "two Patient IDs"),
        ("1.2.3.2", ["B", "1.2", "1.2.4"], "", "two Patient IDs"),
        ("1.2.3.2", ["A", "1.3", "1.2.3"], "", "two Study Instance UIDs"),
        ("1.2.3.1", ["A", "1.2", "1.2.3"], "other", "one SOP Instance UID and are not the same"),
    ] {
        let (outcome, sent) = of(second, whose, comment);
        let error = outcome.unwrap_err();
        assert!(error.to_string().contains(words), "{error}");
        assert!(error.to_string().contains("1.dcm and 2.dcm have"), "{error}");
        assert_eq!((sent, error.kind()), (0, Failure::Input), "{words}");
    }
    for (second, whose, count, words) in [
        ("1.2.3.1", ["A", "1.2", "1.2.3"], 1, "is the same object as 1.dcm: it is sent once"),
        ("1.2.3.2", ["B", "1.3", "1.2.4"], 2, "objects of 2 patients"),
    ] {
        let (outcome, sent) = of(second, whose, "");
        let info = outcome.unwrap();
        let told: String = info.warnings.iter().map(ToString::to_string).collect();
        assert!(told.contains(words) && info.refused.is_empty(), "{info:?}");
        assert_eq!(sent, count, "{words}");
    }
}
