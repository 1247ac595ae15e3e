//! One peer: a thread reads what it sends, another sends what waits for it.

use crate::gate::Refusal;
use crate::hub::{Hub, Shape, Standing};
use crate::intake::{Intake, Taken};
use crate::messages;
use crate::outbox::{Images, Next, Outbox};
use crate::wire::{Came, Wire};
use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::Arc;
use std::time::{Duration, Instant};
use supine_openigtlink::{Content, Message, Outcome, Query, Rows, StatusCode, Verb};

/// A peer that takes nothing for so long is let go,
const WRITE: Duration = Duration::from_millis(500);
/// and one that does not take a whole message in this time.
const MESSAGE: Duration = Duration::from_secs(2);
/// What a peer still sends at the end is read for so long at most,
const LINGER: Duration = Duration::from_millis(200);
/// and until nothing comes for so long.
const PAUSE: Duration = Duration::from_millis(50);

/// Serves a peer until it is gone or the session is over. `device`: the only one whose poses count.
pub(crate) fn serve(hub: &Hub, stream: &TcpStream, intake: Intake, device: Option<&str>) {
    let Some(outbox) = hub.join() else {
        refuse(stream);
        return;
    };
    let prepared = stream.set_nodelay(true).and_then(|()| stream.set_write_timeout(Some(WRITE)));
    if prepared.is_ok() {
        std::thread::scope(|scope| {
            scope.spawn(|| send(hub, stream, &outbox));
            Reader { hub, outbox: &outbox, intake, device }.read(stream);
            // The writer sends what waits, such as why it ends.
            outbox.close();
        });
    }
    hub.leave(&outbox);
    part(stream);
}

fn refuse(mut stream: &TcpStream) {
    let mut bytes = vec![];
    let text = "there are as many peers as are served; close another one";
    messages::status(StatusCode::Busy, "TooManyPeers", text).write(&mut bytes);
    // Who does not read it learns it by the end of the connection.
    let _ = stream.set_write_timeout(Some(WRITE)).and_then(|()| stream.write_all(&bytes));
    part(stream);
}

/// Ends a connection. Bytes that nobody read would take back what was said last, on some systems.
fn part(mut stream: &TcpStream) {
    // A peer that is gone already has nothing to shut down, and sends nothing.
    let said = stream.set_read_timeout(Some(PAUSE)).and_then(|()| stream.shutdown(Shutdown::Write));
    let (begun, mut sink) = (Instant::now(), [0; 4096]);
    while said.is_ok() && begun.elapsed() < LINGER && stream.read(&mut sink).is_ok_and(|n| n > 0) {}
    let _ = stream.shutdown(Shutdown::Both);
}

/// Sends what waits, each message in one write.
fn send(hub: &Hub, stream: &TcpStream, outbox: &Outbox) {
    let mut bytes = vec![];
    while let Some(next) = outbox.next() {
        bytes.clear();
        let sent = match next {
            Next::Answer(answer) => {
                let version = outbox.version();
                if outbox.streams().pose {
                    messages::transform(&answer, hub.frame, version).write(&mut bytes);
                }
                messages::point(&answer, hub.radius_mm, hub.frame, version).write(&mut bytes);
                write(stream, &bytes, hub)
            }
            Next::Note(message) => {
                message.write(&mut bytes);
                write(stream, &bytes, hub)
            }
            Next::Large(large) => write(stream, &large, hub),
        };
        if sent.is_err() {
            break;
        }
    }
    // The reader ends, too.
    outbox.close();
}

/// Writes a message. A peer that takes it byte by byte is given up; at the end of the session there
/// is no second try.
fn write(mut stream: &TcpStream, mut bytes: &[u8], hub: &Hub) -> std::io::Result<()> {
    let begun = Instant::now();
    loop {
        match stream.write(bytes) {
            Ok(0) => return Err(ErrorKind::WriteZero.into()),
            Ok(written) => bytes = bytes.get(written..).unwrap_or_default(),
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
        if bytes.is_empty() {
            return Ok(());
        }
        if hub.is_over() || begun.elapsed() > MESSAGE {
            return Err(ErrorKind::TimedOut.into());
        }
    }
}

/// What reads from a peer.
struct Reader<'a> {
    hub: &'a Hub,
    outbox: &'a Arc<Outbox>,
    intake: Intake,
    device: Option<&'a str>,
}

impl Reader<'_> {
    fn read(&mut self, stream: &TcpStream) {
        let Ok(mut wire) = Wire::new(stream) else { return };
        let (hub, outbox) = (self.hub, Arc::clone(self.outbox));
        loop {
            match wire.next(&|| hub.is_over() || outbox.is_closed()) {
                Came::Message(message) => self.message(&message),
                Came::Unknown(header) => {
                    let text = format!("the type {:?} is not known", header.kind);
                    self.tell(StatusCode::UnknownInstruction, "UnknownType", &text);
                }
                Came::Body(error) => {
                    self.note(Content::Status(error.status()));
                    if !error.keeps() {
                        return;
                    }
                }
                Came::Header(error) => {
                    self.note(Content::Status(error.status()));
                    return;
                }
                Came::Late => {
                    let text = "a message was not complete after 2 s";
                    self.tell(StatusCode::TimedOut, "Late", text);
                    return;
                }
                Came::Gone => return,
            }
        }
    }

    fn tell(&self, code: StatusCode, name: &str, text: &str) {
        self.outbox.note(messages::status(code, name, text));
    }

    fn note(&self, content: Content) {
        self.outbox.note(Message::new(messages::NAVIGATOR, messages::now(), content));
    }

    fn message(&mut self, message: &Message) {
        self.outbox.used(message.version);
        match &message.content {
            Content::Transform(rows) => self.pose(message, rows),
            Content::Query(query) => self.query(query),
            Content::Text(_) | Content::Status(_) | Content::Capabilities(_) => {}
            _ => {
                let text = "messages of this type are understood, but not used";
                self.tell(StatusCode::UnknownInstruction, "NotUsed", text);
            }
        }
    }

    fn pose(&mut self, message: &Message, rows: &Rows) {
        if self.device.is_some_and(|device| device != message.device) {
            return;
        }
        let (hub, arrived) = (self.hub, self.hub.now());
        hub.count(|counts| counts.received += 1);
        let standing = hub.standing(self.outbox.id, &message.device, arrived);
        if standing == Standing::OtherDevice {
            // Another tool of the same tracker: its poses and stamps say nothing of the one that
            // leads.
            hub.count(|counts| counts.dropped += 1);
            return;
        }
        // Each message counts for the clock, whoever leads.
        let taken = self.intake.take(message.stamp, arrived, rows);
        match taken {
            Taken::Refused(refusal) => self.refused(&refusal, standing),
            Taken::Dropped => hub.count(|counts| counts.dropped += 1),
            Taken::Pose { wanted, frozen, clock_step_s } => {
                if !hub.leads(self.outbox.id, &message.device, arrived) {
                    hub.count(|counts| counts.dropped += 1);
                    let text = "another device sends the poses; its connection has to end first";
                    self.tell(StatusCode::Busy, "AnotherLeads", text);
                    return;
                }
                if let Some(step) = clock_step_s {
                    let text =
                        format!("the clock of the device was set, by {step:.3} s as it seems");
                    self.tell(StatusCode::Ok, "ClockSet", &text);
                }
                hub.accept(wanted, !frozen);
                if frozen {
                    let text = "the poses are equal to the bit: the tracker does not measure";
                    hub.stale(StatusCode::NotReady, "Frozen", text);
                }
            }
        }
    }

    /// Who sends no pose is told; if it leads, or nobody does, everybody is.
    fn refused(&self, refusal: &Refusal, standing: Standing) {
        self.hub.count(|counts| counts.refused += 1);
        let (code, name, text) =
            (StatusCode::ConfigurationError, "PoseRefused", refusal.to_string());
        let told = standing != Standing::OtherPeer && self.hub.stale(code, name, &text);
        if !told {
            self.tell(code, name, &text);
        }
    }

    fn query(&mut self, query: &Query) {
        let on = match query.verb {
            Verb::Get => return self.get(&query.of),
            Verb::Start(_) => true,
            Verb::Stop => false,
            Verb::Reply(_) => return,
        };
        let known = matches!(query.of.as_str(), "TRANSFORM" | "POLYDATA" | "IMAGE");
        self.outbox.change_streams(|streams| match query.of.as_str() {
            "TRANSFORM" => streams.pose = on,
            "POLYDATA" => streams.surface = on,
            "IMAGE" => streams.image = if on { Images::All } else { Images::None },
            _ => {}
        });
        let outcome = if known { Outcome::Done } else { Outcome::Failed };
        self.note(Content::Query(Query { verb: Verb::Reply(outcome), of: query.of.clone() }));
    }

    fn get(&self, of: &str) {
        let (hub, version) = (self.hub, self.outbox.version());
        let types = || messages::TYPES.map(str::to_owned).to_vec();
        let (answer, _) = hub.last();
        let reply = match of {
            "CAPABILITY" => Some(Message::new(
                messages::NAVIGATOR,
                messages::now(),
                Content::Capabilities(types()),
            )),
            "STATUS" => {
                let (code, name, text) = hub.state_text();
                Some(messages::status(code, name, &text))
            }
            "STRING" => Some(messages::text(&hub.state_text().2)),
            "POINT" => answer.map(|a| messages::point(&a, hub.radius_mm, hub.frame, version)),
            "POSITION" => answer.map(|a| messages::position(&a, hub.frame, version)),
            "TRANSFORM" => answer.map(|a| messages::transform(&a, hub.frame, version)),
            "POLYDATA" | "IMAGE" => match hub.newest() {
                Some(shape) => return self.large(of, shape),
                None => None,
            },
            _ => {
                let verb = Verb::Reply(Outcome::Failed);
                self.note(Content::Query(Query { verb, of: of.to_owned() }));
                return;
            }
        };
        match reply {
            Some(message) => self.outbox.note(message),
            None => {
                self.tell(StatusCode::NotReady, "Waiting", "there is no answer yet: no pose came")
            }
        }
    }
    /// Surface or region of a shape, on the way of what is large: the newest alone waits.
    fn large(&self, of: &str, shape: Arc<Shape>) {
        if of == "IMAGE" {
            let next = |now: Images| if now == Images::None { Images::Next } else { now };
            self.outbox.change_streams(|streams| streams.image = next(streams.image));
            self.hub.region.put(shape);
            return;
        }
        let mut bytes = vec![];
        let (hub, shape) = (&self.hub, &shape);
        messages::surface(&shape.deformation, &hub.surface, shape.stamp, hub.frame)
            .write(&mut bytes);
        self.outbox.surface(&Arc::new(bytes));
    }
}
