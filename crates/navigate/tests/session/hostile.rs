//! Peers that send what is no message, or no pose, or do not read: each gets what the protocol has
//! for it, and nobody else notices.

use crate::cases::{Case, Then, Wanted, all};
use crate::support::{
    Client, PATIENCE, Session, answered, during, link, near, stale, stamp, status,
};
use std::io::Write;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;
use supine_fem::Contact;
use supine_navigate::Frame;
use supine_openigtlink::{Content, Message, Verb};

/// Names of STATUS that everybody gets.
const TO_ALL: [&str; 7] = ["Waiting", "ok", "predicted", "Stale", "Silence", "Frozen", "ClockSet"];

/// What came of a case.
#[derive(Debug, Default)]
struct Seen {
    statuses: Vec<(u16, String)>,
    replied: bool,
    stale: bool,
    kept: bool,
    over: bool,
}

impl Seen {
    fn take(&mut self, message: &Message, wanted: &Wanted) {
        if let Wanted::Reply(stamp) = wanted {
            self.replied |= answered(message, *stamp).is_some();
        }
        self.stale |= stale(message).is_some();
        match &message.content {
            Content::Status(status) if !TO_ALL.contains(&status.name.as_str()) => {
                self.statuses.push((status.code.number(), status.name.clone()));
            }
            Content::Capabilities(_) => self.kept = true,
            _ => {}
        }
    }

    /// What is not as wanted.
    fn fault(&self, case: &Case) -> Option<String> {
        let statuses: Vec<_> = self.statuses.iter().map(|(c, name)| (*c, name.as_str())).collect();
        let as_wanted = match &case.wanted {
            Wanted::Reply(_) => self.replied && statuses.is_empty(),
            Wanted::Status(wanted) => statuses == *wanted,
            Wanted::Refused => self.stale && statuses == [(10, "PoseRefused")],
            Wanted::Nothing | Wanted::Unread => statuses.is_empty(),
        };
        let then = match case.then {
            Then::Kept => self.kept,
            Then::Closed => self.over,
            Then::Left => true,
        };
        let Case { name, wanted, then: after, .. } = case;
        (!as_wanted || !then).then(|| format!("{name}: wanted {wanted:?}, {after:?}; {self:?}"))
    }
}

/// What the session makes of a case.
fn tried(session: &Session<'_>, case: &Case, meanwhile: &dyn Fn()) -> Seen {
    let mut client = session.client();
    for (bytes, pause) in &case.sent {
        if client.0.write_all(bytes).is_err() {
            // Closed already.
            break;
        }
        std::thread::sleep(*pause);
    }
    let (begun, mut seen, mut asked) = (Instant::now(), Seen::default(), false);
    if case.wanted.is_unread() {
        meanwhile();
        return seen;
    }
    if case.then == Then::Left {
        return seen;
    }
    while !seen.kept {
        assert!(begun.elapsed() < PATIENCE, "{}: {seen:?}", case.name);
        let waits = matches!(case.wanted, Wanted::Reply(_)) && !seen.replied;
        if case.then == Then::Kept && !asked && !waits {
            client.ask(Verb::Get, "CAPABILITY");
            asked = true;
        }
        match client.next() {
            Some(message) => seen.take(&message, &case.wanted),
            None => {
                seen.over = begun.elapsed() < PATIENCE;
                return seen;
            }
        }
    }
    client.leave();
    seen
}

impl Wanted {
    fn is_unread(&self) -> bool {
        matches!(self, Self::Unread)
    }
}

/// A new client gets the place of the tumour for a pose of its own, as soon as nobody else leads.
fn served(session: &Session<'_>, number: &AtomicU64) {
    let (begun, mut client): (_, Client) = (Instant::now(), session.client());
    loop {
        assert!(begun.elapsed() < PATIENCE, "nobody else is served");
        let n = number.fetch_add(1, Ordering::SeqCst);
        client.pose(stamp(n), &near(n));
        let led = |m: &Message| status(m, "AnotherLeads").map(|_| false);
        if client.until(|m| answered(m, stamp(n)).map(|_| true).or_else(|| led(m))) {
            return client.leave();
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
}

#[test]
fn whatever_a_peer_does_it_is_told_and_the_next_one_is_served() {
    let number = AtomicU64::new(1_000_000);
    during(&link(Frame::Lps), Contact::Tied, |session| {
        let served = || served(session, &number);
        served();
        let cases = all(1000);
        assert_eq!(cases.len(), 57);
        let (slow, quick): (Vec<_>, Vec<_>) = cases.iter().partition(|case| case.slow);
        let faults: Vec<String> = std::thread::scope(|scope| {
            let slow: Vec<_> = slow
                .into_iter()
                .map(|case| (case, scope.spawn(|| tried(session, case, &|| {}))))
                .collect();
            let mut faults = vec![];
            for case in quick {
                faults.extend(tried(session, case, &served).fault(case));
                served();
            }
            for (case, running) in slow {
                let mut seen = running.join().unwrap();
                // That was said of the poses of others.
                seen.statuses.retain(|(_, name)| name != "PoseRefused");
                faults.extend(seen.fault(case));
                served();
            }
            faults
        });
        assert!(faults.is_empty(), "{}", faults.join("\n"));
    });
}
