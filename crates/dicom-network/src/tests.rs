//! Send and fetch beside a small archive that answers as the test says.

use crate::command::{Command, element, field};
use crate::contexts::Proposal;
use crate::link::Link;
use crate::message::{Message, Payload, Talk};
use crate::{Call, Error, QuerySpec, SendParams, Title, Way, syntaxes};
use dicom_dictionary_std::{tags, uids};
use std::io::ErrorKind;
use std::net::{IpAddr, Ipv4Addr, TcpListener, TcpStream};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

mod answers;
mod queries;
mod retrieval;

use supine_dicom::{Identifier, file_header};
use supine_space::{Failure, Progress};

const CLASS: &str = uids::CT_IMAGE_STORAGE;
const PATIENT: &str = "ZZ9";
const STUDY: &str = "1.2.1";
const SERIES: &str = "1.2.1.1";
const INSTANCES: [&str; 3] = ["1.2.1.1.1", "1.2.1.1.2", "1.2.1.1.3"];
/// Nobody here is silent for long, however much other work the machine has.
const PATIENCE: Duration = Duration::from_secs(120);

fn go_on() -> Result<(), Error> {
    Ok(())
}

fn call(port: u16, retries: u32) -> Call {
    Call {
        peer: format!("ARCHIVE@127.0.0.1:{port}").parse().unwrap(),
        own: title("SUPINE"),
        tls: None,
        timeout: PATIENCE,
        retries,
    }
}

fn title(text: &str) -> Title {
    text.parse().unwrap()
}

fn listen() -> (TcpListener, u16) {
    let socket = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let port = socket.local_addr().unwrap().port();
    (socket, port)
}

/// Answers every association on a port, message by message, until it is dropped.
struct Archive {
    port: u16,
    over: Arc<AtomicBool>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Archive {
    fn start(answer: impl FnMut(&mut Talk<'_>, &Message) + Send + 'static) -> Self {
        Self::taking(|_| &syntaxes::IDENTIFIER, answer)
    }

    /// One that takes classes in the transfer syntaxes that `syntaxes_of` gives.
    fn taking(
        syntaxes_of: fn(&str) -> &'static [&'static str],
        mut answer: impl FnMut(&mut Talk<'_>, &Message) + Send + 'static,
    ) -> Self {
        let (socket, port) = listen();
        let over = Arc::new(AtomicBool::new(false));
        let ended = over.clone();
        let thread = std::thread::spawn(move || {
            while let Ok((stream, _)) = socket.accept() {
                if ended.load(Ordering::Relaxed) {
                    break;
                }
                let own = title("ARCHIVE");
                let link = Link::accept(stream, None, &own, &syntaxes_of, PATIENCE, &go_on);
                let mut talk = Talk::new(link.unwrap());
                // Until the caller is done, or breaks off.
                while let Ok(Some(message)) = talk.receive() {
                    answer(&mut talk, &message);
                }
            }
        });
        Self { port, over, thread: Some(thread) }
    }
}

impl Drop for Archive {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        let _wakes = TcpStream::connect((Ipv4Addr::LOCALHOST, self.port));
        if let Some(thread) = self.thread.take() {
            let ended = thread.join();
            assert!(ended.is_ok() || std::thread::panicking(), "the archive panicked");
        }
    }
}

fn reply(talk: &mut Talk<'_>, message: &Message, status: u16) {
    talk.send(message.context, &Command::answer(&message.command, status), None).unwrap();
}

fn data_of(talk: &mut Talk<'_>, message: &Message) -> Vec<u8> {
    let mut bytes = Vec::new();
    talk.data(message, 1 << 20, &mut |piece| bytes.extend(piece)).unwrap();
    bytes
}

fn object(instance: &str) -> Vec<u8> {
    object_of(PATIENT, SERIES, instance)
}

fn object_of(patient: &str, series: &str, instance: &str) -> Vec<u8> {
    Identifier::default()
        .with(tags::SOP_CLASS_UID, CLASS)
        .with(tags::SOP_INSTANCE_UID, instance)
        .with(tags::STUDY_DATE, "20260310")
        .with(tags::PATIENT_ID, patient)
        .with(tags::STUDY_INSTANCE_UID, STUDY)
        .with(tags::SERIES_INSTANCE_UID, series)
        // One pixel.
        .with(tags::ROWS, "\x01\0")
        .with(tags::COLUMNS, "\x01\0")
        .with(tags::BITS_ALLOCATED, "\x10\0")
        .with(tags::PIXEL_DATA, "\0\0")
        .to_bytes(true)
}

fn write_objects(folder: &Path, count: usize) {
    for n in 1..=count {
        let instance = format!("1.2.3.{n}");
        let mut bytes = file_header(CLASS, &instance, uids::EXPLICIT_VR_LITTLE_ENDIAN);
        bytes.extend(object(&instance));
        std::fs::write(folder.join(format!("{n}.dcm")), bytes).unwrap();
    }
}

/// An archive that answers C-STORE with these statuses, one after the other, the last for ever;
/// what it was sent is noted.
fn keeper(statuses: &[u16]) -> (Archive, Arc<Mutex<Vec<String>>>) {
    let sent = Arc::new(Mutex::new(Vec::new()));
    let (seen, mut statuses) = (sent.clone(), statuses.to_vec());
    let archive = Archive::start(move |talk, message| {
        if message.command.field() != field::STORE {
            return reply(talk, message, 0);
        }
        data_of(talk, message);
        let instance = message.command.get_text(element::AFFECTED_SOP_INSTANCE);
        seen.lock().unwrap().push(instance.to_owned());
        let status = if statuses.len() > 1 { statuses.remove(0) } else { statuses[0] };
        reply(talk, message, status);
    });
    (archive, sent)
}

fn send(folder: &Path, archive: &Archive, retries: u32) -> crate::SendInfo {
    let paths = [folder.to_owned()];
    let call = call(archive.port, retries);
    crate::send(&paths, &call, &SendParams::default(), Progress::none()).unwrap()
}

#[test]
fn a_warning_is_kept_and_told_and_a_failure_is_sent_again_in_the_next_call() {
    let folder = tempfile::tempdir().unwrap();
    write_objects(folder.path(), 6);
    let (archive, sent) = keeper(&[0xB000, 0xB006, 0xB007, 0xA900, 0xC000, 0]);
    let info = send(folder.path(), &archive, 0);
    assert_eq!((info.stored, info.left, info.associations), (4, 0, 1), "{info:?}");
    let told = [("1.dcm", "B000H"), ("2.dcm", "B006H"), ("3.dcm", "B007H")];
    assert_eq!(info.warnings.len(), told.len(), "{info:?}");
    for (warning, (file, status)) in info.warnings.iter().zip(told) {
        let told = warning.to_string();
        assert!(told.starts_with(&format!("{file:?}")) && told.contains(status), "{told}");
    }
    let refused: Vec<&str> = info.refused.iter().map(|refused| &*refused.file).collect();
    assert_eq!(refused, ["4.dcm", "5.dcm"]);
    assert!(info.refused[0].reason.contains("A900H"), "{info:?}");
    let info = send(folder.path(), &archive, 0);
    assert_eq!((info.stored, info.known, info.refused.len()), (2, 4, 0), "{info:?}");
    let again = sent.lock().unwrap().split_off(6);
    assert_eq!(again, ["1.2.3.4", "1.2.3.5"]);
}

#[test]
fn an_archive_out_of_resources_is_asked_again_on_another_association() {
    let folder = tempfile::tempdir().unwrap();
    write_objects(folder.path(), 3);
    let (archive, sent) = keeper(&[0, 0xA700, 0xA7FF, 0]);
    let info = send(folder.path(), &archive, 2);
    assert_eq!((info.stored, info.left, info.associations), (3, 0, 3), "{info:?}");
    assert!(info.broken.is_none() && info.refused.is_empty(), "{info:?}");
    let sent = sent.lock().unwrap().clone();
    assert_eq!(sent, ["1.2.3.1", "1.2.3.2", "1.2.3.2", "1.2.3.2", "1.2.3.3"]);
}

#[test]
fn an_archive_that_stays_out_of_resources_leaves_the_rest_to_the_next_call() {
    let folder = tempfile::tempdir().unwrap();
    write_objects(folder.path(), 3);
    let (archive, _) = keeper(&[0, 0xA701]);
    let info = send(folder.path(), &archive, 1);
    assert_eq!((info.stored, info.left), (1, 2), "{info:?}");
    assert!(info.broken.as_ref().unwrap().contains("A701H"), "{info:?}");
    drop(archive);
    let (archive, _) = keeper(&[0]);
    // Another port is another node, to which nothing was sent.
    assert_eq!(send(folder.path(), &archive, 0).stored, 3);
}

/// What a C-FIND asks for, from an archive of one series.
fn found(talk: &mut Talk<'_>, message: &Message) {
    found_of(&[PATIENT], talk, message);
}

/// What a C-FIND asks for, from an archive of one series in a study that it lists for these
/// patients.
fn found_of(patients: &[&str], talk: &mut Talk<'_>, message: &Message) {
    let query = Identifier::from_bytes(&data_of(talk, message), true).unwrap();
    let level = query.text(tags::QUERY_RETRIEVE_LEVEL);
    let asked = query.text(tags::PATIENT_ID);
    let study = Identifier::default()
        .with(tags::QUERY_RETRIEVE_LEVEL, &level)
        .with(tags::STUDY_INSTANCE_UID, STUDY);
    let series = study.clone().with(tags::SERIES_INSTANCE_UID, SERIES);
    let image = |instance| {
        series.clone().with(tags::SOP_INSTANCE_UID, instance).with(tags::SOP_CLASS_UID, CLASS)
    };
    let answers: Vec<Identifier> = match level.as_str() {
        "STUDY" => {
            let meant = patients.iter().filter(|id| asked.is_empty() || asked == **id);
            meant.map(|id| study.clone().with(tags::PATIENT_ID, id)).collect()
        }
        "IMAGE" => INSTANCES.map(image).into(),
        _ => vec![series],
    };
    for answer in answers {
        let found = answer.to_bytes(true);
        let pending = Command::answer(&message.command, 0xFF00).number(element::DATA_SET_TYPE, 1);
        let length = found.len() as u64;
        talk.send(message.context, &pending, Some(Payload { reader: &mut &found[..], length }))
            .unwrap();
    }
    reply(talk, message, 0);
}

/// Stores an instance at the port of the one who asked; the status it answers.
fn store_at(port: u16, instance: &str, data: &[u8]) -> u16 {
    let mut call = call(port, 0);
    call.peer.title = title("RECEIVER");
    let proposals = [Proposal::new(CLASS, &syntaxes::IDENTIFIER)];
    let link = Link::open(&call, &proposals, &go_on).unwrap();
    let mut talk = Talk::new(link);
    let (context, _) = talk.link.context(CLASS, None).unwrap();
    let request = Command::request(field::STORE, 1, CLASS, true)
        .text(element::AFFECTED_SOP_INSTANCE, instance);
    talk.send(context, &request, Some(Payload::of(&mut &data[..]))).unwrap();
    let status = talk.answer().unwrap().command.get_number(element::STATUS).unwrap();
    talk.link.release().unwrap();
    status
}

/// An archive of one series, whose C-MOVE does what `moves` does and answers status and failures.
fn mover(mut moves: impl FnMut() -> (u16, u16) + Send + 'static) -> Archive {
    Archive::start(move |talk, message| match message.command.field() {
        field::FIND => found(talk, message),
        field::MOVE => {
            data_of(talk, message);
            let (status, failed) = moves();
            let answer = Command::answer(&message.command, status).number(element::FAILED, failed);
            talk.send(message.context, &answer, None).unwrap();
        }
        other => panic!("nobody asks for {other:04X}"),
    })
}

fn fetch(archive: &Archive, port: u16, out: &Path) -> Result<crate::FetchInfo, Error> {
    let spec = QuerySpec { study: Some(STUDY.into()), ..QuerySpec::default() };
    fetch_what(&spec, archive, port, out)
}

fn fetch_what(
    spec: &QuerySpec,
    archive: &Archive,
    port: u16,
    out: &Path,
) -> Result<crate::FetchInfo, Error> {
    let bind = Some(IpAddr::from(Ipv4Addr::LOCALHOST));
    let way = Way::Move { title: title("RECEIVER"), bind, port };
    crate::fetch(&call(archive.port, 1), spec, &way, out, Progress::none())
}

#[test]
fn what_an_archive_fails_to_move_is_asked_for_again_and_told() {
    let (out, (free, port)) = (tempfile::tempdir().unwrap(), listen());
    drop(free);
    let mut round = 0;
    let archive = mover(move || {
        round += 1;
        match round {
            1 => {
                for instance in &INSTANCES[..2] {
                    assert_eq!(store_at(port, instance, &object(instance)), 0);
                }
                // Not one that was asked for, and one that is not what it is called.
                assert_eq!(store_at(port, "1.2.9", &object("1.2.9")), 0x0124);
                assert_eq!(store_at(port, INSTANCES[2], &object("1.2.9")), 0xA900);
                (0xB000, 1)
            }
            _ => (0xB000, 1),
        }
    });
    let info = fetch(&archive, port, out.path()).unwrap();
    assert_eq!((info.received, info.associations), (2, 2), "{info:?}");
    assert_eq!(info.missing, INSTANCES[2..], "{info:?}");
    assert!(info.broken.is_none(), "it will not come: {info:?}");
    let told: String = info.warnings.iter().map(|w| w.to_string() + "\n").collect();
    for words in ["1 transfers failed", "not asked for", "names another object"] {
        assert!(told.contains(words), "{words}: {told}");
    }
    let files = std::fs::read_dir(out.path()).unwrap().count();
    assert_eq!(files, 2, "nothing half is left");
}

#[test]
fn an_archive_that_cannot_move_now_or_at_all_is_told_apart() {
    let (out, (free, port)) = (tempfile::tempdir().unwrap(), listen());
    drop(free);
    let archive = mover(|| (0xA702, 3));
    let info = fetch(&archive, port, out.path()).unwrap();
    assert!(info.broken.as_ref().unwrap().contains("A702H"), "{info:?}");
    assert_eq!(info.missing.len(), 3);
    let archive = mover(|| (0xA801, 0));
    let error = fetch(&archive, port, out.path()).unwrap_err();
    assert_eq!(error.kind(), Failure::Input);
    assert!(error.to_string().contains("the move destination is unknown there"), "{error}");
}

#[test]
fn a_caller_who_says_nothing_keeps_no_other_out() {
    let (out, (free, port)) = (tempfile::tempdir().unwrap(), listen());
    drop(free);
    let mut kept = Vec::new();
    let archive = mover(move || {
        let silent = TcpStream::connect((Ipv4Addr::LOCALHOST, port)).unwrap();
        for instance in INSTANCES {
            assert_eq!(store_at(port, instance, &object(instance)), 0);
        }
        // It is still waited for: the others did not come after its end.
        silent.set_nonblocking(true).unwrap();
        let waits = silent.peek(&mut [0]).unwrap_err().kind();
        assert_eq!(waits, ErrorKind::WouldBlock);
        kept.push(silent);
        (0, 0)
    });
    let info = fetch(&archive, port, out.path()).unwrap();
    assert_eq!((info.received, info.missing.len()), (3, 0), "{info:?}");
}

#[test]
fn objects_of_another_patient_or_series_are_refused_named_and_not_asked_for_again() {
    let (out, (free, port)) = (tempfile::tempdir().unwrap(), listen());
    drop(free);
    let mut asked = 0;
    let archive = mover(move || {
        asked += 1;
        assert_eq!(asked, 1, "what an archive has wrong does not become right");
        assert_eq!(store_at(port, INSTANCES[0], &object(INSTANCES[0])), 0);
        let evil = object_of("EVIL", "1.2.3", INSTANCES[1]);
        assert_eq!(store_at(port, INSTANCES[1], &evil), 0xA900);
        let series = object_of("ZZ9 ", "1.2.3", INSTANCES[2]);
        assert_eq!(store_at(port, INSTANCES[2], &series), 0xA900);
        (0xB000, 2)
    });
    let info = fetch(&archive, port, out.path()).unwrap();
    assert_eq!((info.received, info.missing.len()), (1, 0), "{info:?}");
    let told: Vec<String> = info.strangers.iter().map(ToString::to_string).collect();
    let refused = "than was asked for, refused and not kept: series 1.2.3";
    let of = |of: &str| format!("1 object of {of} {refused}");
    assert_eq!(told, [of("another patient"), of("another series")]);
    let files: Vec<_> = std::fs::read_dir(out.path()).unwrap().map(|f| f.unwrap().path()).collect();
    assert_eq!(files, [out.path().join(format!("{}.dcm", INSTANCES[0]))]);
    assert!(!format!("{info:?}").contains("EVIL"), "messages do not name patients");
}

#[test]
fn the_right_object_is_taken_though_another_came_under_its_name() {
    let (out, (free, port)) = (tempfile::tempdir().unwrap(), listen());
    drop(free);
    let archive = mover(move || {
        assert_eq!(store_at(port, INSTANCES[0], &object_of("EVIL", SERIES, INSTANCES[0])), 0xA900);
        for instance in INSTANCES {
            assert_eq!(store_at(port, instance, &object(instance)), 0);
        }
        (0, 0)
    });
    let info = fetch(&archive, port, out.path()).unwrap();
    assert_eq!((info.received, info.missing.len(), info.strangers.len()), (3, 0, 1), "{info:?}");
}

#[test]
fn a_file_of_another_patient_in_the_folder_is_no_object_that_came() {
    let (out, (free, port)) = (tempfile::tempdir().unwrap(), listen());
    drop(free);
    let path = out.path().join(format!("{}.dcm", INSTANCES[1]));
    let mut bytes = file_header(CLASS, INSTANCES[1], uids::EXPLICIT_VR_LITTLE_ENDIAN);
    bytes.extend(object_of("EVIL", SERIES, INSTANCES[1]));
    std::fs::write(&path, bytes).unwrap();
    let archive = mover(|| (0, 0));
    let info = fetch(&archive, port, out.path()).unwrap();
    assert_eq!((info.known, info.missing.len()), (0, 3), "{info:?}");
    let told: String = info.warnings.iter().map(ToString::to_string).collect();
    assert!(told.contains("was there before and is of another patient: remove it"), "{told}");
}

#[test]
fn a_study_of_two_patients_is_fetched_for_the_one_who_is_named() {
    let (out, (free, port)) = (tempfile::tempdir().unwrap(), listen());
    drop(free);
    let archive = Archive::start(move |talk, message| match message.command.field() {
        // The first of them is listed twice.
        field::FIND => found_of(&["EVIL", "EVIL", PATIENT], talk, message),
        _ => {
            data_of(talk, message);
            let others = object_of("EVIL", SERIES, INSTANCES[0]);
            assert_eq!(store_at(port, INSTANCES[0], &others), 0xA900);
            for instance in &INSTANCES[1..] {
                assert_eq!(store_at(port, instance, &object(instance)), 0);
            }
            reply(talk, message, 0);
        }
    });
    let error = fetch(&archive, port, out.path()).unwrap_err().to_string();
    assert!(error.contains("for 2 patients: name the one who is meant"), "{error}");
    let spec = QuerySpec { patient_id: Some(PATIENT.into()), ..QuerySpec::default() };
    let info = fetch_what(&spec, &archive, port, out.path()).unwrap();
    let strangers: usize = info.strangers.iter().map(|one| one.instances.len()).sum();
    assert_eq!((info.received, info.missing.len(), strangers), (2, 0, 1), "{info:?}");
}

#[test]
fn a_request_that_ends_as_failed_is_gone_on_with_as_long_as_something_comes() {
    let (out, (free, port)) = (tempfile::tempdir().unwrap(), listen());
    drop(free);
    let mut asked = 0;
    let archive = mover(move || {
        asked += 1;
        // The first of a series is another patient's, and the archive gives up there; then it sends
        // one at a time.
        match asked {
            1 => {
                let evil = object_of("EVIL", SERIES, INSTANCES[0]);
                assert_eq!(store_at(port, INSTANCES[0], &evil), 0xA900);
            }
            n @ 2..=3 => assert_eq!(store_at(port, INSTANCES[n - 1], &object(INSTANCES[n - 1])), 0),
            _ => panic!("all has come"),
        }
        (0xC000, 1)
    });
    let info = fetch(&archive, port, out.path()).unwrap();
    assert_eq!((info.received, info.missing.len(), info.strangers.len()), (2, 0, 1), "{info:?}");
}
