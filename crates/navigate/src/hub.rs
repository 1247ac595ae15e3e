//! What the threads of a session share.

use crate::answer::{Answer, State};
use crate::frame::Frame;
use crate::intake::Wanted;
use crate::messages;
use crate::outbox::{Images, Outbox};
use crate::slot::Slot;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use supine_mesh::Deformation;
use supine_openigtlink::{Message, Stamp, StatusCode};

/// Peers at the same time.
const PEERS: usize = 8;
/// A peer that has sent no pose for so long, and for so many of its intervals, leads no more:
/// another may.
const LEADS: Duration = Duration::from_millis(300);
/// Poses that stay away for so many intervals, and at least this long, make the answer stale.
const INTERVALS: u32 = 3;
const SILENCE: Duration = Duration::from_millis(40);
/// A tracker slower than this is not waited for, before the answer is stale.
const SLOWEST: Duration = Duration::from_millis(400);

/// How many of what.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Poses that came.
    pub received: u64,
    /// Poses that were taken.
    pub accepted: u64,
    /// Poses that were refused: no pose of the applicator.
    pub refused: u64,
    /// Poses that were passed over: an equal or newer one was there.
    pub dropped: u64,
    /// Poses that a newer one overtook before they were followed.
    pub overtaken: u64,
    /// Poses that were followed.
    pub followed: u64,
    /// Answers that were predictions.
    pub predicted: u64,
}

/// The tissue as it was for a pose.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    pub(crate) deformation: Deformation,
    pub(crate) stamp: Stamp,
}

/// Who sends the poses, and when.
#[derive(Debug, Default)]
struct Lead {
    peer: Option<(u64, String)>,
    last: Duration,
    /// It leads, but no pose of it was taken yet: what was before is no interval.
    begins: bool,
    /// Mean time between two poses.
    interval: Option<Duration>,
}

/// How a device stands to the one whose poses count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Standing {
    /// It is that one.
    Leads,
    /// There is none.
    Free,
    /// Another device of the same peer is.
    OtherDevice,
    /// A device of another peer is.
    OtherPeer,
}

impl Lead {
    fn standing(&self, peer: u64, device: &str, now: Duration) -> Standing {
        // Between two poses of a slow tracker it leads on.
        let leads = LEADS.max(self.interval.unwrap_or_default().min(SLOWEST) * INTERVALS);
        match &self.peer {
            Some((id, of)) if now.saturating_sub(self.last) <= leads => {
                match (*id == peer, of == device) {
                    (true, true) => Standing::Leads,
                    (true, false) => Standing::OtherDevice,
                    (false, _) => Standing::OtherPeer,
                }
            }
            _ => Standing::Free,
        }
    }
}

/// What was told last.
#[derive(Clone, Debug, Default)]
struct Told {
    answer: Option<Arc<Answer>>,
    /// When its age was what it says.
    at: Duration,
    /// Why it is stale, if it is.
    stale: Option<String>,
}

/// What the threads of a session share.
#[derive(Debug)]
pub(crate) struct Hub {
    begun: Instant,
    pub(crate) frame: Frame,
    /// Answers for poses older than this are late.
    late: Duration,
    /// Radius of the tumour, mm.
    pub(crate) radius_mm: f64,
    /// Triangles of points of the mesh.
    pub(crate) surface: Vec<[u32; 3]>,
    pub(crate) poses: Slot<Wanted>,
    /// What the region is carried by.
    pub(crate) region: Slot<Arc<Shape>>,
    newest: Mutex<Option<Arc<Shape>>>,
    outboxes: Mutex<Vec<Arc<Outbox>>>,
    counts: Mutex<Counts>,
    lead: Mutex<Lead>,
    told: Mutex<Told>,
    ids: AtomicU64,
    over: AtomicBool,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Hub {
    pub(crate) fn new(
        (frame, late): (Frame, Duration),
        radius_mm: f64,
        surface: Vec<[u32; 3]>,
    ) -> Self {
        Self {
            begun: Instant::now(),
            frame,
            late,
            radius_mm,
            surface,
            poses: Slot::default(),
            region: Slot::default(),
            newest: Mutex::default(),
            outboxes: Mutex::default(),
            counts: Mutex::default(),
            lead: Mutex::default(),
            told: Mutex::default(),
            ids: AtomicU64::new(1),
            over: AtomicBool::new(false),
        }
    }

    /// Time since the session began.
    pub(crate) fn now(&self) -> Duration {
        self.begun.elapsed()
    }

    pub(crate) fn count(&self, count: impl FnOnce(&mut Counts)) {
        count(&mut lock(&self.counts));
    }

    pub(crate) fn counts(&self) -> Counts {
        *lock(&self.counts)
    }

    /// A new peer; none when there are too many.
    pub(crate) fn join(&self) -> Option<Arc<Outbox>> {
        let mut outboxes = lock(&self.outboxes);
        if outboxes.len() >= PEERS {
            return None;
        }
        let outbox = Arc::new(Outbox::new(self.ids.fetch_add(1, Ordering::Relaxed)));
        outboxes.push(Arc::clone(&outbox));
        Some(outbox)
    }

    /// A peer is gone: another may lead at once.
    pub(crate) fn leave(&self, outbox: &Outbox) {
        outbox.close();
        lock(&self.outboxes).retain(|other| other.id != outbox.id);
        let mut lead = lock(&self.lead);
        if lead.peer.as_ref().is_some_and(|(id, _)| *id == outbox.id) {
            lead.peer = None;
        }
    }

    pub(crate) fn peers(&self) -> usize {
        lock(&self.outboxes).len()
    }

    /// How a peer's device stands to the one that leads.
    pub(crate) fn standing(&self, peer: u64, device: &str, now: Duration) -> Standing {
        lock(&self.lead).standing(peer, device, now)
    }

    /// Whether a peer's device leads, or does from now on.
    pub(crate) fn leads(&self, peer: u64, device: &str, now: Duration) -> bool {
        let mut lead = lock(&self.lead);
        match lead.standing(peer, device, now) {
            Standing::Leads => true,
            Standing::Free => {
                let peer = Some((peer, device.to_owned()));
                // One that comes back is as slow as it was.
                let interval = lead.interval.filter(|_| lead.peer == peer);
                let begins = lead.peer != peer;
                *lead = Lead { peer, last: if begins { now } else { lead.last }, begins, interval };
                true
            }
            Standing::OtherDevice | Standing::OtherPeer => false,
        }
    }

    /// A pose of the leader was taken; one that is `new` is followed.
    pub(crate) fn accept(&self, wanted: Wanted, new: bool) {
        let mut lead = lock(&self.lead);
        if !std::mem::take(&mut lead.begins) {
            let since = wanted.arrived.saturating_sub(lead.last).min(SLOWEST * INTERVALS);
            lead.interval = Some(lead.interval.map_or(since, |mean| (mean * 7 + since) / 8));
        }
        lead.last = wanted.arrived;
        drop(lead);
        let overtaken = new && self.poses.put(wanted).is_some();
        self.count(|counts| {
            counts.accepted += 1;
            counts.overtaken += u64::from(overtaken);
        });
    }

    /// Mean time between two poses of the leader.
    pub(crate) fn interval(&self) -> Option<Duration> {
        lock(&self.lead).interval
    }

    /// For how long there has been no pose, if that is too long.
    pub(crate) fn silence(&self) -> Option<Duration> {
        let lead = lock(&self.lead);
        let interval = lead.interval.unwrap_or(SLOWEST).min(SLOWEST);
        let silent = self.now().saturating_sub(lead.last);
        (silent > (interval * INTERVALS).max(SILENCE)).then_some(silent)
    }

    /// How good an answer is for a pose of that age, s.
    pub(crate) fn state(&self, is_settled: bool, age_s: f64) -> State {
        match (age_s > self.late.as_secs_f64(), is_settled) {
            (true, _) => State::Late,
            (false, true) => State::Ok,
            (false, false) => State::Predicted,
        }
    }

    /// A new answer goes to everybody; that it is late is told where the one before was not.
    pub(crate) fn publish(&self, answer: Answer) {
        let answer = Arc::new(answer);
        let told = Told { answer: Some(Arc::clone(&answer)), at: self.now(), stale: None };
        let before = std::mem::replace(&mut *lock(&self.told), told);
        let is_late = |answer: &Arc<Answer>| answer.state == State::Late;
        let begins = is_late(&answer) && !before.answer.as_ref().is_some_and(is_late);
        let (age, late) = (1e3 * answer.age_s, self.late.as_millis());
        let text = format!("the pose is {age:.0} ms old, more than {late} ms");
        for outbox in lock(&self.outboxes).iter() {
            outbox.answer(&answer);
            if begins {
                outbox.note(messages::status(StatusCode::TimedOut, "Late", &text));
            }
        }
    }

    /// The shape of an answer to come; it is carried on for those who want the region.
    pub(crate) fn shape(&self, shape: Shape) -> Arc<Shape> {
        let shape = Arc::new(shape);
        *lock(&self.newest) = Some(Arc::clone(&shape));
        if self.wanted().1 {
            self.region.put(Arc::clone(&shape));
        }
        shape
    }

    /// The newest shape.
    pub(crate) fn newest(&self) -> Option<Arc<Shape>> {
        lock(&self.newest).clone()
    }

    /// The last answer is stale from now on; told once for each reason. Whether it was told now.
    pub(crate) fn stale(&self, code: StatusCode, name: &str, why: &str) -> bool {
        let mut told = lock(&self.told);
        if told.stale.as_deref() == Some(name) {
            return false;
        }
        told.stale = Some(name.to_owned());
        let answer = self.as_of_now(&told);
        (told.answer, told.at) = (answer.clone(), self.now());
        drop(told);
        for outbox in lock(&self.outboxes).iter() {
            answer.iter().for_each(|answer| outbox.answer(answer));
            outbox.note(messages::status(code, name, why));
        }
        true
    }

    /// The last answer with the age that its pose has now, and why it is stale.
    pub(crate) fn last(&self) -> (Option<Arc<Answer>>, Option<String>) {
        let told = lock(&self.told);
        (self.as_of_now(&told), told.stale.clone())
    }

    fn as_of_now(&self, told: &Told) -> Option<Arc<Answer>> {
        let answer = told.answer.as_deref()?;
        let age_s = answer.age_s + self.now().saturating_sub(told.at).as_secs_f64();
        let state = match told.stale {
            Some(_) => State::Stale,
            None => self.state(answer.tissue.settled, age_s),
        };
        Some(Arc::new(Answer { age_s, state, ..*answer }))
    }

    /// A note goes to everybody.
    pub(crate) fn note(&self, message: &Message) {
        lock(&self.outboxes).iter().for_each(|outbox| outbox.note(message.clone()));
    }

    /// Surfaces and images go to who wants them.
    pub(crate) fn each_peer(&self, send: impl Fn(&Outbox)) {
        lock(&self.outboxes).iter().for_each(|outbox| send(outbox));
    }

    /// Whether anybody wants surfaces, and images.
    pub(crate) fn wanted(&self) -> (bool, bool) {
        let outboxes = lock(&self.outboxes);
        let any = |which: fn(&Outbox) -> bool| outboxes.iter().any(|outbox| which(outbox));
        (
            any(|outbox| outbox.streams().surface),
            any(|outbox| outbox.streams().image != Images::None),
        )
    }

    /// How it is, for a STATUS.
    pub(crate) fn state_text(&self) -> (StatusCode, &'static str, String) {
        let (answer, stale) = self.last();
        let frame = self.frame.name();
        let rate = self.interval().map_or(0.0, |mean| 1.0 / mean.as_secs_f64().max(1e-3));
        match (answer, stale) {
            (None, _) => {
                let late = self.late.as_millis();
                let text = format!("frame {frame}; late after {late} ms; no pose yet");
                (StatusCode::NotReady, "Waiting", text)
            }
            (Some(answer), Some(why)) => {
                let age = 1e3 * answer.age_s;
                let text = format!("frame {frame}; stale: {why}; the last pose is {age:.0} ms old");
                (StatusCode::TimedOut, "Stale", text)
            }
            (Some(answer), None) => {
                let age_ms = answer.age_s * 1e3;
                let within =
                    answer.within_mm.map_or_else(|| "?".into(), |mm| format!("{mm:.1} mm"));
                let text = format!(
                    "frame {frame}; {rate:.0} poses/s; age {age_ms:.1} ms; within {within} (95 %)"
                );
                match answer.state {
                    State::Late => (StatusCode::TimedOut, "Late", text),
                    state => (StatusCode::Ok, state.name(), text),
                }
            }
        }
    }

    /// The session ends; peers are told so.
    pub(crate) fn end(&self) {
        let text = "the session has ended";
        let over = messages::status(StatusCode::ShuttingDown, "ShuttingDown", text);
        for outbox in lock(&self.outboxes).iter() {
            outbox.note(over.clone());
            outbox.close();
        }
        // Only now: readers that see it close what is not closed yet.
        self.over.store(true, Ordering::SeqCst);
        self.poses.close();
        self.region.close();
    }

    pub(crate) fn is_over(&self) -> bool {
        self.over.load(Ordering::SeqCst)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_tracker_leads_on_between_its_poses_but_not_for_ever() {
        let ms = Duration::from_millis;
        let of = |interval| Lead {
            peer: Some((1, "a".into())),
            last: ms(1000),
            begins: false,
            interval,
        };
        for (interval, leads_ms) in
            [(None, 300), (Some(ms(16)), 300), (Some(ms(350)), 1050), (Some(ms(9000)), 1200)]
        {
            let lead = of(interval);
            let at = |since: u64| lead.standing(1, "a", ms(1000 + since));
            assert_eq!(
                (at(leads_ms), at(leads_ms + 1)),
                (Standing::Leads, Standing::Free),
                "{interval:?}"
            );
            assert_eq!(lead.standing(2, "a", ms(1000 + leads_ms)), Standing::OtherPeer);
        }
    }

    #[test]
    fn a_pose_that_is_too_old_is_late_whether_the_tissue_has_settled_or_not() {
        let hub = Hub::new((Frame::Lps, Duration::from_millis(200)), 5.0, vec![]);
        let states = [(true, 0.2), (false, 0.2), (true, 0.21), (false, 2.0)];
        let found = states.map(|(is_settled, age_s)| hub.state(is_settled, age_s));
        assert_eq!(found, [State::Ok, State::Predicted, State::Late, State::Late]);
    }

    #[test]
    fn one_that_comes_back_keeps_its_interval_and_another_begins_anew() {
        let hub = Hub::new((Frame::Lps, Duration::from_millis(200)), 5.0, vec![]);
        *lock(&hub.lead) = Lead {
            peer: Some((1, "a".into())),
            last: Duration::ZERO,
            begins: false,
            interval: Some(Duration::from_millis(500)),
        };
        let late = Duration::from_secs(60);
        assert!(hub.leads(1, "a", late));
        assert_eq!(hub.interval(), Some(Duration::from_millis(500)));
        assert!(hub.leads(2, "a", late));
        assert_eq!(hub.interval(), None);
    }
}
