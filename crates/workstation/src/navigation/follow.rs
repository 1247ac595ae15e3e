//! Following a navigation that runs: a thread connects to it as a client and tells the newest
//! answer. Nothing of the patient is sent, nothing queues, and every wait but that of the system
//! for a host's name is bounded.

use crate::Error;
use crate::navigation::messages::{AnswerShown, Ear, Heard, Mood, REGION, STALE};
use serde::Serialize;
use std::collections::VecDeque;
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use supine_openigtlink::{
    Content, HEADER_BYTES, Header, Limits, Message, Outcome, Query, Stamp, Start, Verb, Version,
};
use supine_volume::Ct;
use tokio::sync::watch;

/// A connection that does not come about in this time is none.
const CONNECT: Duration = Duration::from_secs(2);
/// A write takes no longer.
const WRITE: Duration = Duration::from_millis(500);
/// A read waits so long before it looks whether to go on.
const TICK: Duration = Duration::from_millis(50);
/// From its first byte on a message has this long to arrive.
const IN_TIME: Duration = Duration::from_secs(2);
/// The navigator says something each second: after so long it is gone.
const SILENCE: Duration = Duration::from_secs(5);
/// After this it is tried again.
const AGAIN: Duration = Duration::from_secs(1);
/// Largest body of a message, bytes: a picture has 4 MiB.
const MOST: u64 = 1 << 24;
/// A picture comes in this time, or the page shows the table without one.
const PICTURE: Duration = Duration::from_millis(300);
/// Poses a second are counted over this time.
const COUNTED: Duration = Duration::from_secs(2);
/// And over so many poses at most.
const COUNTS: usize = 2048;

/// How far following is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(rename = "NavigationPhase"))]
#[serde(rename_all = "lowercase")]
pub(crate) enum Phase {
    #[default]
    Off,
    Connecting,
    Following,
    /// The navigator is not there, or not any more: it is tried again each second.
    Gone,
}

/// What the page is told.
#[derive(Clone, Debug, Default, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Navigation {
    phase: Phase,
    address: Option<String>,
    /// The newest; stale where the navigator is gone.
    answer: Option<AnswerShown>,
    /// Poses a second that were answered.
    rate: Option<f64>,
    /// Text of its last STATUS.
    status: Option<String>,
    /// Why the answer is stale, or the navigator gone.
    why: Option<String>,
    /// Messages that were of no use, and why the last was not.
    passed: u64,
    passed_why: Option<String>,
    /// Which following it is of.
    #[serde(skip)]
    run: u64,
}

impl Navigation {
    /// Whether something is followed.
    pub(crate) fn is_on(&self) -> bool {
        self.phase != Phase::Off
    }
}

/// The CT as the navigation carried it, and what it said then.
#[derive(Debug)]
pub(crate) struct Pictured {
    pub(crate) ct: Ct,
    pub(crate) answer: Option<AnswerShown>,
}

/// Pictures that are asked for one by one.
#[derive(Debug, Default)]
struct Pictures {
    /// Where they come from; nothing while nobody is there.
    from: Option<Arc<TcpStream>>,
    newest: Option<Arc<Pictured>>,
    /// How many came.
    came: u64,
}

/// Which navigation is followed.
pub(crate) struct Following {
    newest: watch::Sender<Arc<Navigation>>,
    /// Ends the thread that follows.
    stop: Mutex<Arc<AtomicBool>>,
    pictures: Mutex<Pictures>,
    /// A picture came, or none can come any more.
    pictured: Condvar,
}

impl Default for Following {
    fn default() -> Self {
        Self {
            newest: watch::Sender::new(Arc::default()),
            stop: Mutex::default(),
            pictures: Mutex::default(),
            pictured: Condvar::new(),
        }
    }
}

impl Following {
    /// Follows the navigation at an address; another one is left.
    pub(crate) fn follow(self: &Arc<Self>, address: String) {
        let (phase, named) = (Phase::Connecting, Some(address.clone()));
        let next = Navigation { phase, address: named, ..Navigation::default() };
        let (run, stop) = self.renew(next);
        let following = Arc::clone(self);
        std::thread::spawn(move || follow(&following, run, &address, &stop));
    }

    /// Follows nothing any more.
    pub(crate) fn leave(&self) {
        if self.newest.borrow().is_on() {
            self.renew(Navigation::default());
        }
    }

    /// What is followed, now and after each change; a newer one takes the place of one that was not
    /// seen yet.
    pub(crate) fn watched(&self) -> watch::Receiver<Arc<Navigation>> {
        self.newest.subscribe()
    }

    /// Ends what is followed; the new following has a number and a flag of its own.
    fn renew(&self, next: Navigation) -> (u64, Arc<AtomicBool>) {
        let mut stop = self.stop.lock().unwrap_or_else(PoisonError::into_inner);
        stop.store(true, Ordering::SeqCst);
        *stop = Arc::default();
        let run = self.newest.borrow().run + 1;
        self.newest.send_replace(Arc::new(Navigation { run, ..next }));
        // After it: a thread that ends puts nothing there any more.
        *self.pictures() = Pictures::default();
        self.pictured.notify_all();
        (run, Arc::clone(&stop))
    }

    fn pictures(&self) -> MutexGuard<'_, Pictures> {
        self.pictures.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes where pictures come from, or the newest, unless another following has begun.
    fn put(&self, run: u64, put: impl FnOnce(&mut Pictures)) {
        let mut pictures = self.pictures();
        if self.newest.borrow().run == run {
            put(&mut pictures);
            self.pictured.notify_all();
        }
    }

    /// The CT around the tumour as the navigation has it now: asked for, and waited for. None where
    /// none comes in time.
    pub(crate) fn picture(&self) -> Option<Arc<Pictured>> {
        let mut bytes = vec![];
        let query = Content::Query(Query::new(Verb::Get, "IMAGE"));
        let message = Message::new(REGION, Stamp::NONE, query);
        Message { version: Version::Two, ..message }.write(&mut bytes);
        let pictures = self.pictures();
        let before = pictures.came;
        let mut to: &TcpStream = pictures.from.as_ref()?;
        to.write_all(&bytes).ok()?;
        let waits = |now: &mut Pictures| now.from.is_some() && now.came == before;
        let waited = self.pictured.wait_timeout_while(pictures, PICTURE, waits);
        let (now, _) = waited.unwrap_or_else(PoisonError::into_inner);
        now.newest.clone().filter(|_| now.came > before)
    }

    /// Changes what is told, unless another following has begun.
    fn change(&self, run: u64, change: impl FnOnce(&mut Navigation)) {
        self.newest.send_if_modified(|newest| {
            let is_this = newest.run == run;
            if is_this {
                change(Arc::make_mut(newest));
            }
            is_this
        });
    }
}

/// An address as it is typed: a host and a port.
///
/// # Errors
/// When it is none.
pub(crate) fn address(text: &str) -> Result<String, Error> {
    let text = text.trim();
    let good = text.rsplit_once(':').is_some_and(|(host, port)| {
        let named =
            !host.is_empty() && !host.contains(|c: char| c.is_whitespace() || c.is_control());
        named && host.len() <= 255 && port.parse::<u16>().is_ok_and(|port| port > 0)
    });
    let wrong = || {
        let says = "the address of a navigation is HOST:PORT, such as 127.0.0.1:18944";
        Error::Request(says.into())
    };
    good.then(|| text.to_owned()).ok_or_else(wrong)
}

/// Connects, again each second, until it is told to stop.
fn follow(following: &Following, run: u64, address: &str, stop: &AtomicBool) {
    while !stop.load(Ordering::SeqCst) {
        let why = match connect(address) {
            Ok(stream) => Client { following, run, stop, stream: &Arc::new(stream) }.serve(),
            Err(why) => why,
        };
        following.put(run, |pictures| *pictures = Pictures::default());
        following.change(run, |newest| {
            newest.phase = Phase::Gone;
            newest.rate = None;
            newest.why = Some(why);
            newest.answer.iter_mut().for_each(|answer| answer.state = STALE);
        });
        let begun = Instant::now();
        while begun.elapsed() < AGAIN && !stop.load(Ordering::SeqCst) {
            std::thread::sleep(TICK);
        }
    }
}

/// # Errors
/// Why there is no connection, in words.
fn connect(address: &str) -> Result<TcpStream, String> {
    let known = address.to_socket_addrs().map_err(|_| "this host is not known".to_owned())?;
    let mut why = "this host has no address".to_owned();
    // A name may stand for an address of each kind.
    for address in known.take(2) {
        match TcpStream::connect_timeout(&address, CONNECT) {
            Ok(stream) => return Ok(stream),
            Err(error) => {
                why = match error.kind() {
                    ErrorKind::ConnectionRefused => "refused: nothing listens there".into(),
                    ErrorKind::TimedOut => "nobody answers there".into(),
                    _ => error.to_string(),
                };
            }
        }
    }
    Err(why)
}

/// A connection.
struct Client<'a> {
    following: &'a Following,
    run: u64,
    stop: &'a AtomicBool,
    stream: &'a Arc<TcpStream>,
}

impl Client<'_> {
    /// Follows until the connection ends; why it did.
    fn serve(&self) -> String {
        match self.begin().and_then(|()| self.read()) {
            Ok(()) => String::new(),
            Err(why) => why,
        }
    }

    /// Asks for what is followed: in version 2, for only then the answers bear their figures.
    fn begin(&self) -> Result<(), String> {
        let mut bytes = vec![];
        for (verb, of) in [(Verb::Get, "STATUS"), (Verb::Start(Start::Plain), "TRANSFORM")] {
            let query = Content::Query(Query::new(verb, of));
            let message = Message::new("", Stamp::NONE, query);
            Message { version: Version::Two, ..message }.write(&mut bytes);
        }
        let mut stream: &TcpStream = self.stream;
        let sent = stream
            .set_nodelay(true)
            .and_then(|()| stream.set_write_timeout(Some(WRITE)))
            .and_then(|()| stream.set_read_timeout(Some(TICK)))
            .and_then(|()| stream.write_all(&bytes));
        sent.map_err(|_| "it takes nothing".to_owned())?;
        self.following.put(self.run, |pictures| pictures.from = Some(Arc::clone(self.stream)));
        self.following.change(self.run, |newest| {
            newest.phase = Phase::Following;
            (newest.status, newest.why) = (None, None);
            (newest.passed, newest.passed_why) = (0, None);
        });
        Ok(())
    }

    /// Reads until it is told to stop.
    ///
    /// # Errors
    /// Why the connection is of no use any more.
    fn read(&self) -> Result<(), String> {
        let mut ear = Ear::default();
        let mut count = Count::default();
        // Why the next answer that is stale is so.
        let mut trouble: Option<String> = None;
        loop {
            let message = match self.next() {
                Ok(Some(message)) => message,
                Ok(None) => return Ok(()),
                Err(why) => {
                    return Err(
                        trouble.map_or_else(|| why.clone(), |said| format!("{why} ({said})"))
                    );
                }
            };
            let heard = match message {
                Ok(message) if refused(&message) => {
                    Heard::Nonsense("it sends no poses of the applicator".into())
                }
                Ok(message) => ear.hear(&message),
                Err(why) => Heard::Nonsense(why),
            };
            match heard {
                Heard::Answer(answer) => {
                    let stale = answer.state == STALE;
                    if !stale {
                        trouble = None;
                    }
                    let rate = count.rate((!stale).then_some(answer.of));
                    let why = trouble.clone();
                    self.following.change(self.run, |newest| {
                        (newest.answer, newest.rate, newest.why) = (Some(*answer), rate, why);
                    });
                }
                Heard::Region(ct) => {
                    let answer = self.following.newest.borrow().answer.clone();
                    let newest = Some(Arc::new(Pictured { ct: *ct, answer }));
                    self.following.put(self.run, |pictures| {
                        pictures.newest = newest;
                        pictures.came += 1;
                    });
                }
                Heard::Status { text, mood: Mood::Ended } => return Err(text),
                Heard::Status { text, mood } => {
                    // What happened says more than that it is still so.
                    if mood == Mood::Trouble || (mood == Mood::Still && trouble.is_none()) {
                        trouble = Some(text.clone());
                    }
                    let why = trouble.clone();
                    self.following.change(self.run, |newest| {
                        let stale = newest.answer.as_ref().is_none_or(|a| a.state == STALE);
                        newest.status = Some(text);
                        newest.why = why.filter(|_| stale);
                    });
                }
                Heard::Nonsense(why) => self.following.change(self.run, |newest| {
                    newest.passed = newest.passed.saturating_add(1);
                    newest.passed_why = Some(why);
                }),
                Heard::Nothing => {}
            }
        }
    }

    /// The next message, or why it is none; nothing when it is told to stop.
    ///
    /// # Errors
    /// Why no message can come after it.
    fn next(&self) -> Result<Option<Result<Message, String>>, String> {
        let mut head = [0; HEADER_BYTES];
        let mut began = None;
        if !self.fill(&mut head, &mut began)? {
            return Ok(None);
        }
        let limits = Limits { body: MOST };
        let header = Header::read_within(&head, &limits).map_err(|error| error.to_string())?;
        // The limit is far below the address space.
        let mut body = vec![0; usize::try_from(header.body).unwrap_or(0)];
        if !self.fill(&mut body, &mut began)? {
            return Ok(None);
        }
        match Message::read(&header, &body) {
            Ok(message) => Ok(Some(Ok(message))),
            Err(error) if error.keeps() => Ok(Some(Err(error.to_string()))),
            Err(error) => Err(error.to_string()),
        }
    }

    /// Fills a piece; false when it is told to stop. `began`: when the message did.
    fn fill(&self, piece: &mut [u8], began: &mut Option<Instant>) -> Result<bool, String> {
        let (mut filled, waits) = (0, Instant::now());
        let mut stream: &TcpStream = self.stream;
        while let Some(rest) = piece.get_mut(filled..).filter(|rest| !rest.is_empty()) {
            if self.stop.load(Ordering::SeqCst) {
                return Ok(false);
            }
            if began.is_some_and(|began| began.elapsed() > IN_TIME) {
                return Err("a message was not complete in time".into());
            }
            if began.is_none() && waits.elapsed() > SILENCE {
                return Err("it has said nothing for 5 s".into());
            }
            match stream.read(rest) {
                Ok(0) => return Err("it closed the connection".into()),
                Ok(read) => {
                    filled += read;
                    began.get_or_insert_with(Instant::now);
                }
                Err(error) => match error.kind() {
                    ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted => {}
                    _ => return Err("the connection was lost".into()),
                },
            }
        }
        Ok(true)
    }
}

/// The answer to a navigator of a kind that does not send the applicator's pose.
fn refused(message: &Message) -> bool {
    let failed = Verb::Reply(Outcome::Failed);
    matches!(&message.content, Content::Query(query) if query.verb == failed)
}

/// How many poses come.
#[derive(Default)]
struct Count {
    last: Option<(Stamp, u32)>,
    came: VecDeque<Instant>,
}

impl Count {
    /// Poses a second, with one more where it is new; None before there are two.
    fn rate(&mut self, pose: Option<(Stamp, u32)>) -> Option<f64> {
        let now = Instant::now();
        let pose = pose?;
        if self.last.replace(pose) != Some(pose) {
            self.came.push_back(now);
        }
        let old = |came: &Instant| now.duration_since(*came) > COUNTED;
        while self.came.len() > COUNTS || self.came.front().is_some_and(old) {
            self.came.pop_front();
        }
        let over = now.duration_since(*self.came.front()?).as_secs_f64();
        (self.came.len() > 1 && over > 0.0).then(|| (self.came.len() - 1) as f64 / over)
    }
}

#[cfg(test)]
mod tests {
    use super::address;

    #[test]
    fn an_address_has_a_host_and_a_port() {
        for good in ["127.0.0.1:18944", " localhost:1 ", "[::1]:18944", "tracker.local:65535"] {
            assert_eq!(address(good).unwrap(), good.trim());
        }
        for wrong in ["", "127.0.0.1", ":18944", "host:", "host:0", "host:70000", "a b:1", "a\n:1"]
        {
            assert!(address(wrong).is_err(), "{wrong:?}");
        }
    }
}
