//! The connection below an association: plain TCP, or TLS over it.
//!
//! Reading and writing wait for one turn at most and then end with `WouldBlock`, TLS or not.

use crate::Call;
use crate::cancel::GoOn;
use crate::error::Error;
use crate::pinned::Renewed;
use crate::tls::{Asked, Tls};
use rustls::{AlertDescription, CertificateError, Connection};
use std::io::{ErrorKind, Read as _, Result, Write as _};
use std::net::{TcpStream, ToSocketAddrs as _};
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// How long reading or writing waits before the caller may look whether the user wants to stop.
const TURN: Duration = Duration::from_millis(100);

/// Longest time for one address of a peer to answer.
const CONNECT: Duration = Duration::from_secs(10);

/// A TCP connection to the peer, each of its addresses in turn.
///
/// Looking up a name and waiting for an address are waits of the system that nothing cuts short.
/// They are a thread's, which is left to itself when the user wants to stop; it ends by itself.
pub(crate) fn connect(call: &Call, go_on: GoOn<'_>) -> std::result::Result<TcpStream, Error> {
    let fail = |source| Error::Connect { node: call.peer.clone(), source };
    let (host, port, longest) = (call.peer.host.clone(), call.peer.port, call.timeout.min(CONNECT));
    let (sender, outcome) = mpsc::sync_channel(1);
    let reaching = move || {
        // Nobody may listen any more: then the connection is closed again.
        let _unheard = sender.send(reach(&host, port, longest));
    };
    std::thread::Builder::new().spawn(reaching).map_err(fail)?;
    let start = Instant::now();
    loop {
        go_on()?;
        match outcome.recv_timeout(TURN) {
            Ok(reached) => return reached.map_err(fail),
            Err(mpsc::RecvTimeoutError::Timeout) if start.elapsed() < call.timeout + CONNECT => {}
            Err(_) => return Err(fail(ErrorKind::TimedOut.into())),
        }
    }
}

fn reach(host: &str, port: u16, longest: Duration) -> Result<TcpStream> {
    let mut last = std::io::Error::from(ErrorKind::AddrNotAvailable);
    for address in (host, port).to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, longest) {
            Ok(socket) => return Ok(socket),
            Err(error) => last = error,
        }
    }
    Err(last)
}

/// A connection.
pub(crate) struct Wire {
    pub(crate) socket: TcpStream,
    tunnel: Option<Tunnel>,
}

/// TLS over the connection.
struct Tunnel {
    connection: Box<Connection>,
    asked: Asked,
    /// The host that was called; none where we were called.
    host: Option<String>,
}

impl Wire {
    /// A connection we opened to `host`; why TLS cannot be spoken to it.
    pub(crate) fn call(
        socket: TcpStream,
        tls: Option<&Tls>,
        host: &str,
    ) -> std::result::Result<Self, String> {
        let tunnel = match tls {
            Some(tls) => {
                let (connection, asked) = tls.call(host)?;
                Some(Tunnel { connection: Box::new(connection), asked, host: Some(host.into()) })
            }
            None => None,
        };
        Ok(Self { socket, tunnel })
    }

    /// A connection that was opened to us.
    pub(crate) fn answer(
        socket: TcpStream,
        tls: Option<&Tls>,
    ) -> std::result::Result<Self, String> {
        let tunnel = match tls {
            Some(tls) => Some(Tunnel {
                connection: Box::new(tls.answer()?),
                asked: Asked::default(),
                host: None,
            }),
            None => None,
        };
        Ok(Self { socket, tunnel })
    }

    /// Sets how long reading and writing wait, and that small messages do not wait for the next
    /// (Nagle's algorithm).
    pub(crate) fn prepare(&self) -> Result<()> {
        self.socket.set_nonblocking(false)?;
        self.socket.set_nodelay(true)?;
        self.socket.set_read_timeout(Some(TURN))?;
        self.socket.set_write_timeout(Some(TURN))
    }

    /// Whether both sides still have to agree on keys.
    pub(crate) fn is_handshaking(&self) -> bool {
        self.tunnel.as_ref().is_some_and(|tunnel| tunnel.connection.is_handshaking())
    }

    /// Does one turn of it.
    pub(crate) fn shake_hands(&mut self) -> Result<()> {
        let Some(Tunnel { connection, .. }) = &mut self.tunnel else { return Ok(()) };
        // One read a turn: the library's own loop goes on for as long as single bytes come.
        if connection.wants_write() {
            return pauses(connection.write_tls(&mut self.socket)).map(drop);
        }
        if pauses(connection.read_tls(&mut self.socket))? == 0 {
            return Err(ErrorKind::UnexpectedEof.into());
        }
        if let Err(fault) = connection.process_new_packets() {
            // What is wrong is told the peer as an alert; whether it gets through is no matter.
            let _best_effort = connection.write_tls(&mut self.socket);
            return Err(std::io::Error::new(ErrorKind::InvalidData, fault));
        }
        Ok(())
    }

    pub(crate) fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        let Some(tunnel) = &mut self.tunnel else { return self.socket.read(buffer) };
        match tunnel.connection.reader().read(buffer) {
            Err(e) if e.kind() == ErrorKind::WouldBlock => {}
            read => return read,
        }
        // Sends what waits, or reads: once, since what comes may be no data for as long as the peer
        // likes.
        pauses(tunnel.connection.complete_io(&mut self.socket))?;
        tunnel.connection.reader().read(buffer)
    }

    /// Takes some of the bytes. What was taken may wait here until the next call, of whatever kind.
    pub(crate) fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        let Some(tunnel) = &mut self.tunnel else { return self.socket.write(bytes) };
        if tunnel.connection.wants_write() {
            pauses(tunnel.connection.complete_io(&mut self.socket))?;
        }
        let taken = tunnel.connection.writer().write(bytes)?;
        if taken == 0 {
            return Err(ErrorKind::WouldBlock.into());
        }
        // What fails here fails again in the next call.
        let _again = tunnel.connection.complete_io(&mut self.socket);
        Ok(taken)
    }

    /// Says that nothing more comes. Whether it gets through is no matter.
    pub(crate) fn close(&mut self) {
        if let Some(tunnel) = &mut self.tunnel {
            tunnel.connection.send_close_notify();
            while tunnel.connection.wants_write() {
                if !matches!(tunnel.connection.write_tls(&mut self.socket), Ok(1..)) {
                    break;
                }
            }
        }
    }

    /// What an error of this connection means to the association with `peer`.
    pub(crate) fn explain(&mut self, error: &std::io::Error, peer: &str) -> Error {
        let node = peer.to_owned();
        let Some(tunnel) = &mut self.tunnel else {
            return Error::Broken { node, what: error.to_string() };
        };
        // A peer that does not want us says so and closes; writing fails before that is read.
        let unread = if error.kind() == ErrorKind::InvalidData {
            None
        } else {
            let _rest = tunnel.connection.read_tls(&mut self.socket);
            tunnel.connection.process_new_packets().err()
        };
        let inner = error.get_ref().and_then(|e| e.downcast_ref::<rustls::Error>());
        if let Some(fault) = unread.as_ref().or(inner) {
            return Error::Tls { node, what: tunnel.words(fault) };
        }
        let what = if tunnel.asked.in_vain() {
            format!("{error}; {NO_CERTIFICATE}")
        } else if tunnel.connection.is_handshaking() {
            format!("{error} before TLS was agreed on: does it speak TLS on this port?")
        } else {
            error.to_string()
        };
        Error::Broken { node, what }
    }
}

const NO_CERTIFICATE: &str =
    "it asks for a certificate of ours: give one with --tls-cert and --tls-key";

impl Tunnel {
    /// What is wrong, and what to do.
    fn words(&self, fault: &rustls::Error) -> String {
        use AlertDescription as Alert;
        use rustls::Error as Fault;
        match fault {
            Fault::InvalidCertificate(fault) => self.certificate(fault),
            Fault::NoCertificatesPresented => {
                "it shows no certificate when it calls us: let it use its own for C-MOVE too".into()
            }
            Fault::AlertReceived(Alert::CertificateRequired | Alert::HandshakeFailure)
                if self.asked.in_vain() =>
            {
                NO_CERTIFICATE.into()
            }
            Fault::AlertReceived(
                alert @ (Alert::UnknownCA
                | Alert::BadCertificate
                | Alert::UnsupportedCertificate
                | Alert::CertificateRevoked
                | Alert::CertificateExpired
                | Alert::CertificateUnknown
                | Alert::AccessDenied),
            ) => format!(
                "it does not take our certificate ({alert:?}): it has to trust it or its issuer"
            ),
            Fault::InvalidMessage(_) if self.connection.is_handshaking() => match self.host {
                Some(_) => "it does not speak TLS on this port: try without --tls".into(),
                None => "it does not speak TLS when it calls us: set that in the archive".into(),
            },
            Fault::AlertReceived(Alert::ProtocolVersion | Alert::HandshakeFailure)
            | Fault::PeerIncompatible(_) => format!(
                "no common version and cipher ({fault}): TLS 1.2 or 1.3 is needed, see PS3.15 B.12"
            ),
            fault => fault.to_string(),
        }
    }

    fn certificate(&self, fault: &CertificateError) -> String {
        use CertificateError as C;
        let host = self.host.as_deref().unwrap_or("it");
        match fault {
            C::Other(other) if other.0.is::<Renewed>() => {
                "its certificate, or that of its issuer, has the name of one in --tls-ca and is another: it was \
                 renewed, or another answers in its place; ask its administrator, and give the new one with --tls-ca"
                    .into()
            }
            C::UnknownIssuer | C::Other(_) => {
                "nobody known here answers for its certificate: give that of its issuer, or its own \
                 where it signed itself, with --tls-ca"
                    .into()
            }
            C::Expired | C::ExpiredContext { .. } => {
                "its certificate has run out: it needs a new one (or the clock here is wrong)".into()
            }
            C::NotValidYet | C::NotValidYetContext { .. } => {
                "its certificate is not valid yet (or the clock here is wrong)".into()
            }
            C::NotValidForName | C::NotValidForNameContext { .. } => match names(fault) {
                names if names.is_empty() => format!(
                    "its certificate has no alternative name {host}: it needs one that has, or \
                     give this very certificate with --tls-ca"
                ),
                names => format!(
                    "its certificate is not for {host} but for {names}: call it by that name"
                ),
            },
            C::InvalidPurpose | C::InvalidPurposeContext { .. } => {
                "its certificate is not for this side of a connection (extended key usage)".into()
            }
            fault => format!("its certificate cannot be used: {fault}"),
        }
    }
}

/// The machines a certificate is for, without what a terminal would obey.
fn names(fault: &CertificateError) -> String {
    let CertificateError::NotValidForNameContext { presented, .. } = fault else {
        return String::new();
    };
    // As the library writes them: `DnsName("pacs.example")`, `IpAddress(192.0.2.7)`, others.
    let of = |text: &str| {
        let inner = ["DnsName(", "IpAddress("].iter().find_map(|kind| text.strip_prefix(kind))?;
        Some(inner.trim_matches([')', '"']).chars().filter(|c| c.is_ascii_graphic()).collect())
    };
    let names: Vec<String> = presented.iter().filter_map(|text| of(text)).take(8).collect();
    names.join(", ")
}

/// A pause is a pause, by whatever name the system calls it.
fn pauses<T>(outcome: Result<T>) -> Result<T> {
    outcome.map_err(|e| match e.kind() {
        ErrorKind::TimedOut | ErrorKind::Interrupted => ErrorKind::WouldBlock.into(),
        _ => e,
    })
}
