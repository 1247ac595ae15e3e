//! A live session: sockets on one side, the tissue on the other.

use crate::Error;
use crate::answer::{Answer, Certainty};
use crate::follower::Follower;
use crate::frame::Frame;
use crate::gate::REACH_MM;
use crate::hub::{Counts, Hub};
use crate::intake::{Frames, Intake};
use crate::record::Recorder;
use crate::region::LiveRegion;
use crate::{peer, solver};
use std::net::{SocketAddr, TcpListener, TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::thread::Scope;
use std::time::Duration;
use supine_space::Point;

/// So often somebody who waits for connections looks whether the session is over.
const TICK: Duration = Duration::from_millis(10);
/// A tracker's server is tried again after this.
const AGAIN: Duration = Duration::from_secs(1);

/// What connects a session with the world.
#[derive(Clone, Debug)]
pub struct Link {
    /// Addresses on which peers may connect.
    pub listen: SocketAddr,
    /// The tracker's own server, to which this connects: `host:port`.
    pub connect: Option<String>,
    /// Only poses of this device count; else those of the first that sends.
    pub device: Option<String>,
    /// Frame of all that is sent, and of poses without a registration.
    pub frame: Frame,
    /// How the frame of the poses lies.
    pub frames: Frames,
    /// Answers for poses older than this are late.
    pub late: Duration,
}

/// What a session starts from.
#[derive(Debug)]
pub struct Start<'a> {
    /// The tissue.
    pub follower: &'a mut Follower,
    /// The CT around the tumour.
    pub region: &'a mut LiveRegion,
    /// How sure the tumour's place is.
    pub certainty: Certainty,
    /// Radius of the tumour, mm.
    pub radius_mm: f64,
    /// Where answers are kept.
    pub record: Option<&'a mut Recorder>,
}

/// How a session is, for those who look on.
#[derive(Clone, Debug)]
pub struct View {
    /// The last answer.
    pub answer: Option<Arc<Answer>>,
    /// Why it is stale, if it is.
    pub stale: Option<String>,
    /// How many of what.
    pub counts: Counts,
    /// Mean time between two poses.
    pub interval: Option<Duration>,
    /// Peers that are connected.
    pub peers: usize,
    /// Since the session began.
    pub since: Duration,
}

/// Who looks on, and may end the session.
pub trait Host: Sync {
    /// Peers can connect.
    fn listening(&self, address: SocketAddr);
    /// How it is, about ten times a second.
    fn view(&self, view: &View);
    /// Something that a person should know.
    fn note(&self, text: &str);
    /// Whether the session may go on.
    fn go_on(&self) -> bool;
}

/// Runs a session until the host ends it.
///
/// # Errors
/// When the address cannot be had, memory is short or the recording cannot be written.
pub fn run(start: Start<'_>, link: &Link, host: &dyn Host) -> Result<Counts, Error> {
    let failed = |source| Error::Listen { address: link.listen.to_string(), source };
    let listener = TcpListener::bind(link.listen).map_err(failed)?;
    listener.set_nonblocking(true).map_err(failed)?;
    host.listening(listener.local_addr().map_err(failed)?);
    let Start { follower, region, certainty, radius_mm, record } = start;
    let hub = Hub::new((link.frame, link.late), radius_mm, follower.surface()?);
    let centre = follower.target_on_table();
    std::thread::scope(|scope| {
        // Whatever ends one of them ends all.
        let solving = scope.spawn(|| {
            let _all = EndsAll(&hub);
            solver::follow(&hub, follower, certainty, record)
        });
        let carrying = scope.spawn(|| {
            let _all = EndsAll(&hub);
            solver::carry(&hub, region)
        });
        scope.spawn(|| solver::watch(&hub));
        scope.spawn(|| look(&hub, host));
        scope.spawn(|| connect(&hub, link, &centre, host));
        accept(&hub, &listener, link, &centre, scope);
        let solved = solving.join().unwrap_or(Err(Error::Stopped));
        solved.and(carrying.join().unwrap_or(Err(Error::Stopped)))
    })?;
    Ok(hub.counts())
}

/// Ends the session when it goes, however that comes.
struct EndsAll<'a>(&'a Hub);

impl Drop for EndsAll<'_> {
    fn drop(&mut self) {
        self.0.end();
    }
}

/// Serves all who connect, each by its own threads.
fn accept<'scope>(
    hub: &'scope Hub,
    listener: &TcpListener,
    link: &'scope Link,
    centre: &Point,
    scope: &'scope Scope<'scope, '_>,
) {
    while !hub.is_over() {
        match listener.accept() {
            Ok((stream, _)) => {
                let intake = Intake::new(link.frames, centre, REACH_MM);
                scope.spawn(move || {
                    // Sockets of a listener that does not block do not either, on some systems.
                    if stream.set_nonblocking(false).is_ok() {
                        peer::serve(hub, &stream, intake, link.device.as_deref());
                    }
                });
            }
            // Nobody is there, or who was is gone again.
            Err(_) => std::thread::sleep(TICK),
        }
    }
}

/// Connects to the tracker's own server, again and again.
fn connect(hub: &Hub, link: &Link, centre: &Point, host: &dyn Host) {
    let Some(address) = &link.connect else { return };
    let mut told = false;
    while !hub.is_over() {
        match reach(address) {
            Ok(stream) => {
                host.note(&format!("connected to {address}"));
                told = false;
                let intake = Intake::new(link.frames, centre, REACH_MM);
                peer::serve(hub, &stream, intake, link.device.as_deref());
                host.note(&format!("{address} has gone"));
            }
            Err(error) if !told => {
                host.note(&format!("{address}: {error}; tried again each second"));
                told = true;
            }
            Err(_) => {}
        }
        let until = hub.now() + AGAIN;
        while !hub.is_over() && hub.now() < until {
            std::thread::sleep(TICK);
        }
    }
}

fn reach(address: &str) -> std::io::Result<TcpStream> {
    let mut last = std::io::Error::from(std::io::ErrorKind::NotFound);
    for address in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, AGAIN) {
            Ok(stream) => return Ok(stream),
            Err(error) => last = error,
        }
    }
    Err(last)
}

/// Shows the host how it is, and ends the session when the host does.
fn look(hub: &Hub, host: &dyn Host) {
    const EACH: Duration = Duration::from_millis(100);
    while !hub.is_over() {
        let (answer, stale) = hub.last();
        host.view(&View {
            answer,
            stale,
            counts: hub.counts(),
            interval: hub.interval(),
            peers: hub.peers(),
            since: hub.now(),
        });
        if !host.go_on() {
            hub.end();
        }
        std::thread::sleep(EACH);
    }
}
