//! The port on which the objects of a C-MOVE arrive, open only while we wait for them.

use crate::Call;
use crate::cancel::GoOn;
use crate::command::{Command, field};
use crate::error::Error;
use crate::inbox::{Inbox, lock, take};
use crate::link::Link;
use crate::message::Talk;
use crate::node::Title;
use crate::tls::Tls;
use crate::{status, syntaxes};
use dicom_dictionary_std::uids;
use std::net::{IpAddr, TcpListener, TcpStream};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;
use supine_space::{Failure, Stopped, Warning};

/// How often it is looked whether somebody calls.
const TURN: Duration = Duration::from_millis(20);
/// Most callers at once; any more are turned away.
const MOST_CALLERS: usize = 16;
/// Root of the UIDs of storage SOP classes (PS3.4 B.5).
const STORAGE: &str = "1.2.840.10008.5.1.4.1.1.";

/// An open port.
#[derive(Debug)]
pub(crate) struct Listener<'a> {
    socket: TcpListener,
    tls: Option<&'a Tls>,
    title: &'a Title,
    timeout: Duration,
}

impl<'a> Listener<'a> {
    pub(crate) fn open(
        address: IpAddr,
        port: u16,
        title: &'a Title,
        call: &'a Call,
    ) -> Result<Self, Error> {
        let fail = |source| Error::Listen { address: format!("{address} port {port}"), source };
        let socket = TcpListener::bind((address, port)).map_err(fail)?;
        socket.set_nonblocking(true).map_err(fail)?;
        Ok(Self { socket, tls: call.tls.as_ref(), title, timeout: call.timeout })
    }

    /// Takes objects into the inbox while `work` runs, in another thread.
    pub(crate) fn while_open(
        self,
        inbox: &Mutex<&mut Inbox>,
        arrived: &AtomicUsize,
        go_on: GoOn<'_>,
        work: impl FnOnce(GoOn<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let (finished, failed) = (AtomicBool::new(false), AtomicBool::new(false));
        let receiving = || -> Result<(), Error> {
            if finished.load(Ordering::Relaxed) { Err(Stopped.into()) } else { go_on() }
        };
        let working = || -> Result<(), Error> {
            if failed.load(Ordering::Relaxed) { Err(Stopped.into()) } else { go_on() }
        };
        std::thread::scope(|scope| {
            let receiver = scope.spawn(|| {
                let outcome = self.receive(inbox, arrived, &receiving);
                // Nothing can be kept any more: there is no use in waiting for the rest.
                failed.store(outcome.is_err(), Ordering::Relaxed);
                outcome
            });
            let worked = work(&working);
            finished.store(true, Ordering::Relaxed);
            match receiver.join() {
                Ok(received) => received.and(worked),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        })
    }

    /// Takes callers until told to stop, each in a thread of its own: one who says nothing must not
    /// keep the archive out.
    fn receive(
        &self,
        inbox: &Mutex<&mut Inbox>,
        arrived: &AtomicUsize,
        go_on: GoOn<'_>,
    ) -> Result<(), Error> {
        let (failed, callers) = (Mutex::new(None), AtomicUsize::new(0));
        let sound = || -> Result<(), Error> {
            if lock(&failed).is_some() { Err(Stopped.into()) } else { go_on() }
        };
        std::thread::scope(|scope| {
            while sound().is_ok() {
                let Ok((stream, _)) = self.socket.accept() else {
                    std::thread::sleep(TURN);
                    continue;
                };
                if callers.load(Ordering::Relaxed) >= MOST_CALLERS {
                    continue;
                }
                callers.fetch_add(1, Ordering::Relaxed);
                scope.spawn(|| {
                    match self.serve(stream, inbox, arrived, &sound) {
                        Err(e @ (Error::Write { .. } | Error::Listen { .. })) => {
                            *lock(&failed) = Some(e)
                        }
                        Err(e) if e.kind() != Failure::Stopped => {
                            lock(inbox).tell(Warning::new("caller-failed", e.to_string()));
                        }
                        _ => {}
                    }
                    callers.fetch_sub(1, Ordering::Relaxed);
                });
            }
        });
        let failed = lock(&failed).take();
        failed.map_or(Ok(()), Err)
    }

    fn serve(
        &self,
        stream: TcpStream,
        inbox: &Mutex<&mut Inbox>,
        arrived: &AtomicUsize,
        go_on: GoOn<'_>,
    ) -> Result<(), Error> {
        let link = Link::accept(stream, self.tls, self.title, &syntaxes_of, self.timeout, go_on)?;
        let mut talk = Talk::new(link);
        while let Some(message) = talk.receive()? {
            match message.command.field() {
                field::STORE => {
                    let received = take(inbox, &mut talk, &message)?;
                    arrived.fetch_max(received, Ordering::Relaxed);
                }
                field::ECHO => {
                    let answer = Command::answer(&message.command, status::SUCCESS);
                    talk.send(message.context, &answer, None)?;
                }
                _ => return Err(talk.link.protocol("a request other than C-STORE and C-ECHO")),
            }
        }
        Ok(())
    }
}

/// The transfer syntaxes in which objects of a class are taken.
fn syntaxes_of(class: &str) -> &'static [&'static str] {
    if class == uids::VERIFICATION {
        &syntaxes::IDENTIFIER
    } else if class.starts_with(STORAGE) {
        &syntaxes::OBJECT
    } else {
        &[]
    }
}
