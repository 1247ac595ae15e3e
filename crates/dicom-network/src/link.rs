//! An association: protocol data units over one connection (PS3.8 section 9).
//!
//! Reading and writing wait in short turns, so that Ctrl-C is heard and a silent peer is given up.

use crate::Call;
use crate::cancel::GoOn;
use crate::contexts::{Context, Proposal};
use crate::error::Error;
use crate::node::Title;
use crate::tls::Tls;
use crate::units::{MAX_PDU, kind, own_variables};
use crate::wire::{Wire, connect};
use dicom_dictionary_std::uids;
use dicom_ul::pdu::{
    AbortRQServiceProviderReason, AbortRQSource, AssociationAC, AssociationRQ, PDataValue, Pdu,
    PresentationContextProposed, PresentationContextResult, PresentationContextResultReason,
    RequestorRoles, UserVariableItem,
};
use std::collections::{BTreeMap, BTreeSet};
use std::io::ErrorKind;
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// The application context of DICOM (PS3.7 A.2.1).
const APPLICATION_CONTEXT: &str = "1.2.840.10008.3.1.1.1";
/// Shortest that a peer may ask for; the standard's table has no lower bound.
const MIN_PDU: u32 = 64;
/// Longest time for the peer to answer a release; the work is done by then.
const RELEASE: Duration = Duration::from_secs(5);
/// Slowest rate at which a message may move once it has begun, bytes per second. A peer below it is
/// never silent for long and would still keep us for days.
const SLOWEST: u64 = 1 << 10;

/// An association. One that is dropped without [`Link::release`] is aborted.
pub(crate) struct Link<'a> {
    wire: Wire,
    /// Who the peer is, for messages.
    pub(crate) peer: String,
    /// The contexts agreed on, by their number.
    pub(crate) contexts: BTreeMap<u8, Context>,
    /// Classes that the peer does not even take in the default transfer syntax (PS3.5 10.1).
    pub(crate) untaken: BTreeSet<String>,
    /// What came and is not used yet.
    buffer: Vec<u8>,
    /// When the message that is coming in began, and how many bytes have come since.
    coming: Option<(Instant, u64)>,
    /// Longest protocol data unit that the peer takes, without its header, bytes.
    pub(crate) peer_max: u32,
    timeout: Duration,
    go_on: GoOn<'a>,
    open: bool,
}

impl<'a> Link<'a> {
    /// Asks a peer for an association.
    pub(crate) fn open(
        call: &Call,
        proposals: &[Proposal],
        go_on: GoOn<'a>,
    ) -> Result<Self, Error> {
        let socket = connect(call, go_on)?;
        let peer = call.peer.to_string();
        let wire = Wire::call(socket, call.tls.as_ref(), &call.peer.host)
            .map_err(|what| Error::Tls { node: peer.clone(), what })?;
        let mut link = Self::new(wire, peer, call.timeout, go_on)?;
        // As many as there are numbers: nobody proposes more than
        // [`crate::contexts::MAX_CONTEXTS`].
        let numbered = || (1..=u8::MAX).step_by(2).zip(proposals);
        let presentation_contexts = numbered().map(|(id, p)| PresentationContextProposed {
            id,
            abstract_syntax: p.class.clone(),
            transfer_syntaxes: p.syntaxes.clone(),
        });
        let mut user_variables = own_variables();
        let mut roles: Vec<&str> = Vec::new();
        for proposal in proposals.iter().filter(|p| p.receives) {
            if !roles.contains(&proposal.class.as_str()) {
                roles.push(&proposal.class);
                user_variables.push(UserVariableItem::ScuScpRoleSelectionSubItem(
                    proposal.class.clone(),
                    RequestorRoles { scu: false, scp: true },
                ));
            }
        }
        link.send(&Pdu::AssociationRQ(AssociationRQ {
            protocol_version: 1,
            calling_ae_title: call.own.to_string(),
            called_ae_title: call.peer.title.to_string(),
            application_context_name: APPLICATION_CONTEXT.to_owned(),
            presentation_contexts: presentation_contexts.collect(),
            user_variables,
        }))?;
        let answer = link.receive().map_err(|error| match error {
            // An archive that wants TLS just closes, or waits for more.
            Error::Broken { node, what } if call.tls.is_none() => {
                let what = format!("{what}, before it was accepted (does it want TLS, --tls?)");
                Error::Broken { node, what }
            }
            error => error,
        });
        let accepted = match answer? {
            Pdu::AssociationAC(accepted) => accepted,
            Pdu::AssociationRJ(rejected) => {
                link.open = false;
                let transient = rejected.result == dicom_ul::pdu::AssociationRJResult::Transient;
                let (node, mut reason) = (call.peer.clone(), rejected.source.to_string());
                if !transient {
                    let (own, from) = (&call.own, link.local_address()?);
                    reason += &format!(" (we call as {own} from {from})");
                }
                return Err(Error::Rejected { node, reason, transient });
            }
            other => return Err(link.unexpected(&other)),
        };
        link.peer_max = link.max_length(&accepted.user_variables)?;
        for (id, proposal) in numbered() {
            let Some(result) = accepted.presentation_contexts.iter().find(|c| c.id == id) else {
                continue;
            };
            // Of the reasons none is to be relied on: some refuse a class in a transfer syntax as a
            // class.
            if result.reason != PresentationContextResultReason::Acceptance
                && proposal.syntaxes.iter().any(|s| s == uids::IMPLICIT_VR_LITTLE_ENDIAN)
            {
                link.untaken.insert(proposal.class.clone());
            }
            let role = accepted.user_variables.iter().any(|item| {
                matches!(item, UserVariableItem::ScuScpRoleSelectionSubItem(class, roles)
                    if bare(class) == proposal.class && roles.scp)
            });
            if result.reason == PresentationContextResultReason::Acceptance
                && (role || !proposal.receives)
            {
                let syntax = bare(&result.transfer_syntax).to_owned();
                if !proposal.syntaxes.contains(&syntax) {
                    return Err(link.protocol("it accepts a transfer syntax that was not proposed"));
                }
                link.contexts.insert(id, Context { class: proposal.class.clone(), syntax });
            }
        }
        Ok(link)
    }

    /// Answers a peer that asks us, `own`, for an association on which it sends objects.
    pub(crate) fn accept(
        socket: TcpStream,
        tls: Option<&Tls>,
        own: &Title,
        syntaxes_of: &dyn Fn(&str) -> &'static [&'static str],
        timeout: Duration,
        go_on: GoOn<'a>,
    ) -> Result<Self, Error> {
        let caller = socket.peer_addr().map_or_else(|_| "a caller".into(), |a| a.ip().to_string());
        let wire =
            Wire::answer(socket, tls).map_err(|what| Error::Tls { node: caller.clone(), what })?;
        let mut link = Self::new(wire, caller, timeout, go_on)?;
        let asked = match link.receive()? {
            Pdu::AssociationRQ(asked) => asked,
            other => return Err(link.unexpected(&other)),
        };
        if asked.called_ae_title != own.as_str() {
            use dicom_ul::pdu::{
                AssociationRJ, AssociationRJResult, AssociationRJServiceUserReason,
                AssociationRJSource,
            };
            link.send(&Pdu::AssociationRJ(AssociationRJ {
                result: AssociationRJResult::Permanent,
                source: AssociationRJSource::ServiceUser(
                    AssociationRJServiceUserReason::CalledAETitleNotRecognized,
                ),
            }))?;
            link.open = false;
            return Err(link.broken("it calls another AE title than ours"));
        }
        link.peer_max = link.max_length(&asked.user_variables)?;
        let mut results = Vec::new();
        for context in asked.presentation_contexts {
            let ours = syntaxes_of(bare(&context.abstract_syntax));
            let offers = |s: &&&str| context.transfer_syntaxes.iter().any(|t| bare(t) == **s);
            let (reason, syntax) = match ours.iter().find(offers) {
                Some(syntax) => (PresentationContextResultReason::Acceptance, *syntax),
                None if ours.is_empty() => {
                    (PresentationContextResultReason::AbstractSyntaxNotSupported, "")
                }
                None => (PresentationContextResultReason::TransferSyntaxesNotSupported, ""),
            };
            if !syntax.is_empty() {
                let class = bare(&context.abstract_syntax).to_owned();
                link.contexts.insert(context.id, Context { class, syntax: syntax.to_owned() });
            }
            let transfer_syntax = syntax.to_owned();
            results.push(PresentationContextResult { id: context.id, reason, transfer_syntax });
        }
        link.send(&Pdu::AssociationAC(AssociationAC {
            protocol_version: 1,
            calling_ae_title: asked.calling_ae_title,
            called_ae_title: asked.called_ae_title,
            application_context_name: APPLICATION_CONTEXT.to_owned(),
            presentation_contexts: results,
            user_variables: own_variables(),
        }))?;
        Ok(link)
    }

    /// An association to be: both sides agree on keys, where there is TLS.
    fn new(wire: Wire, peer: String, timeout: Duration, go_on: GoOn<'a>) -> Result<Self, Error> {
        let mut link = Self {
            wire,
            peer,
            contexts: BTreeMap::new(),
            untaken: BTreeSet::new(),
            buffer: Vec::new(),
            coming: None,
            peer_max: MAX_PDU,
            timeout,
            go_on,
            open: false,
        };
        link.wire.prepare().map_err(|e| link.broken(e.to_string()))?;
        let start = Instant::now();
        while link.wire.is_handshaking() {
            (link.go_on)()?;
            match link.wire.shake_hands() {
                Err(e) if !is_pause(&e) => return Err(link.failed(&e)),
                _ if start.elapsed() < timeout => {}
                _ => return Err(link.failed(&ErrorKind::TimedOut.into())),
            }
        }
        link.open = true;
        Ok(link)
    }

    /// The address by which the peer reaches this machine.
    pub(crate) fn local_address(&self) -> Result<std::net::IpAddr, Error> {
        self.wire.socket.local_addr().map(|a| a.ip()).map_err(|e| self.broken(e.to_string()))
    }

    /// The number of a context for a class in a transfer syntax; any syntax where none is named.
    pub(crate) fn context(&self, class: &str, syntax: Option<&str>) -> Option<(u8, &Context)> {
        let fits = |c: &Context| c.class == class && syntax.is_none_or(|s| s == c.syntax);
        self.contexts.iter().find(|(_, c)| fits(c)).map(|(id, c)| (*id, c))
    }

    fn max_length(&self, variables: &[UserVariableItem]) -> Result<u32, Error> {
        let stated = variables.iter().find_map(|item| match item {
            UserVariableItem::MaxLength(length) => Some(*length),
            _ => None,
        });
        match stated {
            // Zero: no limit (PS3.8 D.1).
            None | Some(0) => Ok(MAX_PDU),
            Some(length) if length < MIN_PDU => {
                Err(self.protocol(format!("it takes no more than {length} bytes at once")))
            }
            Some(length) => Ok(length.min(MAX_PDU)),
        }
    }

    /// Sends a protocol data unit.
    pub(crate) fn send(&mut self, pdu: &Pdu) -> Result<(), Error> {
        let mut bytes = Vec::new();
        let written = dicom_ul::write_pdu(&mut bytes, pdu);
        written.map_err(|e| self.protocol(format!("a message cannot be written: {e}")))?;
        self.send_bytes(&bytes)
    }

    /// Sends bytes that are whole protocol data units.
    pub(crate) fn send_bytes(&mut self, bytes: &[u8]) -> Result<(), Error> {
        let mut rest = bytes;
        let start = Instant::now();
        let mut moved = start;
        while !rest.is_empty() {
            (self.go_on)()?;
            self.mind_rate(start, bytes.len() as u64)?;
            match self.wire.write(rest) {
                Ok(0) => return Err(self.broken("the connection is closed")),
                Ok(written) => {
                    rest = &rest[written..];
                    moved = Instant::now();
                }
                Err(e) if is_pause(&e) => self.mind(moved)?,
                Err(e) => return Err(self.failed(&e)),
            }
        }
        Ok(())
    }

    /// A command set or a data set ends, or begins: its time counts from its first byte.
    pub(crate) fn begin(&mut self) {
        self.coming = None;
    }

    /// The next protocol data unit.
    pub(crate) fn receive(&mut self) -> Result<Pdu, Error> {
        let mut moved = Instant::now();
        let mut chunk = [0; 64 << 10];
        loop {
            if let Some(pdu) = self.take()? {
                return Ok(pdu);
            }
            (self.go_on)()?;
            if let Some((start, came)) = self.coming {
                self.mind_rate(start, came)?;
            }
            match self.wire.read(&mut chunk) {
                Ok(0) => return Err(self.broken("the connection was closed")),
                Ok(read) => {
                    self.coming.get_or_insert((Instant::now(), 0)).1 += read as u64;
                    self.buffer.extend_from_slice(&chunk[..read]);
                    acknowledge(&self.wire.socket);
                    moved = Instant::now();
                }
                Err(e) if is_pause(&e) => self.mind(moved)?,
                Err(e) => return Err(self.failed(&e)),
            }
        }
    }

    /// A protocol data unit that is whole in the buffer. Its length is checked as soon as it is
    /// known.
    fn take(&mut self) -> Result<Option<Pdu>, Error> {
        let Some([_, _, a, b, c, d]) = self.buffer.first_chunk::<6>() else { return Ok(None) };
        let length = u32::from_be_bytes([*a, *b, *c, *d]);
        if self.buffer.starts_with(&[0x15, 3]) {
            // An alert, RFC 8446 section 5.1; no unit of DICOM has this type.
            return Err(self.protocol("it wants TLS on this port: try with --tls"));
        }
        if self.buffer.starts_with(b"HTTP/") {
            return Err(self.protocol("it speaks HTTP on this port: name its port for DICOM"));
        }
        if !(1..=7).contains(&self.buffer[0]) {
            // PS3.8 9.3.1.
            return Err(self.protocol("it speaks something else than DICOM on this port"));
        }
        if length > MAX_PDU {
            let what = format!("a unit of {length} bytes, {MAX_PDU} were agreed on");
            return Err(self.protocol(what));
        }
        let end = 6 + length as usize;
        let Some(unit) = self.buffer.get(..end) else { return Ok(None) };
        let pdu = match dicom_ul::read_pdu(unit, MAX_PDU, true) {
            Ok(Some(pdu)) => pdu,
            Ok(None) => return Err(self.protocol("a unit that ends early")),
            // The library's words may repeat what the peer sent.
            Err(_) => return Err(self.protocol("a unit that cannot be read")),
        };
        self.buffer.drain(..end);
        Ok(Some(pdu))
    }

    /// Gives the peer up when it was silent for too long.
    fn mind(&self, moved: Instant) -> Result<(), Error> {
        if moved.elapsed() < self.timeout {
            return Ok(());
        }
        Err(self.broken(format!("no answer within {} s", self.timeout.as_secs_f64())))
    }

    /// Gives the peer up when so many bytes took too long, though it was never silent.
    fn mind_rate(&self, start: Instant, bytes: u64) -> Result<(), Error> {
        if start.elapsed() < self.timeout.saturating_add(Duration::from_secs(bytes / SLOWEST)) {
            return Ok(());
        }
        let seconds = start.elapsed().as_secs();
        Err(self.broken(format!("too slow: no more than {bytes} bytes within {seconds} s")))
    }

    /// The presentation data values of the next unit; `None` when the peer releases the
    /// association.
    pub(crate) fn receive_values(&mut self) -> Result<Option<Vec<PDataValue>>, Error> {
        match self.receive()? {
            Pdu::PData { data } => Ok(Some(data)),
            Pdu::ReleaseRQ => {
                self.send(&Pdu::ReleaseRP)?;
                self.open = false;
                Ok(None)
            }
            other => Err(self.unexpected(&other)),
        }
    }

    /// Ends the association in good order.
    pub(crate) fn release(mut self) -> Result<(), Error> {
        self.timeout = self.timeout.min(RELEASE);
        self.begin();
        self.send(&Pdu::ReleaseRQ)?;
        loop {
            match self.receive()? {
                Pdu::ReleaseRP => break,
                // What was under way when we asked.
                Pdu::PData { .. } => {}
                Pdu::ReleaseRQ => self.send(&Pdu::ReleaseRP)?,
                other => return Err(self.unexpected(&other)),
            }
        }
        self.open = false;
        Ok(())
    }

    fn unexpected(&mut self, pdu: &Pdu) -> Error {
        match pdu {
            Pdu::AbortRQ { source } => {
                self.open = false;
                match (source, self.local_address()) {
                    // Something is wrong with what was sent, as the peer sees it.
                    (AbortRQSource::ServiceProvider(reason), _)
                        if *reason != AbortRQServiceProviderReason::ReasonNotSpecified =>
                    {
                        self.broken(format!("the peer aborted it: {reason}"))
                    }
                    (_, Ok(from)) => Error::Aborted { node: self.peer.clone(), from },
                    (_, Err(error)) => error,
                }
            }
            Pdu::ReleaseRQ => self.broken("the peer released it early"),
            other => self.protocol(format!("an unexpected unit: {}", kind(other))),
        }
    }

    /// The association cannot go on, since the connection does not.
    fn failed(&mut self, error: &std::io::Error) -> Error {
        match self.wire.explain(error, &self.peer) {
            // Once both have agreed it is no matter of certificates: worth another try.
            Error::Tls { node, what } if !self.contexts.is_empty() => Error::Broken { node, what },
            error => error,
        }
    }

    pub(crate) fn broken(&self, what: impl Into<String>) -> Error {
        Error::Broken { node: self.peer.clone(), what: what.into() }
    }

    pub(crate) fn protocol(&self, what: impl Into<String>) -> Error {
        Error::Protocol { node: self.peer.clone(), what: what.into() }
    }
}

impl Drop for Link<'_> {
    fn drop(&mut self) {
        if self.open {
            // A-ABORT by the service user (PS3.8 9.3.8); whether it still gets through is no
            // matter.
            let _best_effort = self.wire.write(&[7, 0, 0, 0, 0, 4, 0, 0, 0, 0]);
        }
        self.wire.close();
    }
}

/// Acknowledges what came at once. Peers write the head of an answer and its body one after the
/// other, and by Nagle's algorithm keep the body back until the head is acknowledged, which a
/// system puts off by 40 ms otherwise, for each object. Linux forgets the setting, so it is made
/// after each read.
fn acknowledge(stream: &TcpStream) {
    #[cfg(target_os = "linux")]
    {
        use std::os::linux::net::TcpStreamExt as _;
        // Slower without it, but not wrong.
        let _best_effort = stream.set_quickack(true);
    }
    #[cfg(not(target_os = "linux"))]
    let _ = stream;
}

/// A UID without its padding.
fn bare(uid: &str) -> &str {
    uid.trim_matches([' ', '\0'])
}

fn is_pause(error: &std::io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}
