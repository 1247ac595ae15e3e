//! What waits to be sent to one peer: of each kind the newest, so that a slow reader costs nobody
//! else anything.

use crate::answer::Answer;
use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use supine_openigtlink::{Message, Version};

/// Notes and replies that wait at most; older ones are forgotten.
const WAITING: usize = 16;

/// What a peer asked to be sent again and again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Streams {
    /// The applicator's pose, before each answer.
    pub(crate) pose: bool,
    pub(crate) surface: bool,
    pub(crate) image: Images,
}

/// Which images a peer asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Images {
    #[default]
    None,
    Next,
    All,
}

/// The next thing to send.
#[derive(Debug)]
pub(crate) enum Next {
    Answer(Arc<Answer>),
    Note(Box<Message>),
    /// A message as bytes, of version 1.
    Large(Arc<Vec<u8>>),
}

#[derive(Debug, Default)]
struct Waiting {
    answer: Option<Arc<Answer>>,
    notes: VecDeque<Message>,
    surface: Option<Arc<Vec<u8>>>,
    image: Option<Arc<Vec<u8>>>,
    streams: Streams,
    /// The peer has used version 2.
    version: Version,
    closed: bool,
}

/// What waits for one peer.
#[derive(Debug)]
pub(crate) struct Outbox {
    pub(crate) id: u64,
    waiting: Mutex<Waiting>,
    came: Condvar,
}

impl Outbox {
    pub(crate) fn new(id: u64) -> Self {
        Self { id, waiting: Mutex::default(), came: Condvar::new() }
    }

    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn put(&self, put: impl FnOnce(&mut Waiting)) {
        let mut waiting = self.waiting();
        if !waiting.closed {
            put(&mut waiting);
        }
        drop(waiting);
        self.came.notify_one();
    }

    pub(crate) fn answer(&self, answer: &Arc<Answer>) {
        self.put(|waiting| waiting.answer = Some(Arc::clone(answer)));
    }

    pub(crate) fn note(&self, message: Message) {
        self.put(|waiting| {
            if waiting.notes.len() == WAITING {
                waiting.notes.pop_front();
            }
            waiting.notes.push_back(message);
        });
    }

    pub(crate) fn surface(&self, bytes: &Arc<Vec<u8>>) {
        self.put(|waiting| waiting.surface = Some(Arc::clone(bytes)));
    }

    pub(crate) fn image(&self, bytes: &Arc<Vec<u8>>) {
        self.put(|waiting| {
            if waiting.streams.image == Images::Next {
                waiting.streams.image = Images::None;
            }
            waiting.image = Some(Arc::clone(bytes));
        });
    }

    pub(crate) fn streams(&self) -> Streams {
        self.waiting().streams
    }

    pub(crate) fn change_streams(&self, change: impl FnOnce(&mut Streams)) {
        change(&mut self.waiting().streams);
    }

    pub(crate) fn version(&self) -> Version {
        self.waiting().version
    }

    /// The peer has used a version: what it can read is known.
    pub(crate) fn used(&self, version: Version) {
        if version == Version::Two {
            self.waiting().version = version;
        }
    }

    /// Nothing more is taken; notes that wait are still sent, such as why it ends.
    pub(crate) fn close(&self) {
        self.put(|waiting| waiting.closed = true);
    }

    pub(crate) fn is_closed(&self) -> bool {
        self.waiting().closed
    }

    /// Waits for the next thing; what is small and urgent first. None at the end.
    pub(crate) fn next(&self) -> Option<Next> {
        let idle = |w: &mut Waiting| {
            let nothing = w.answer.is_none() && w.notes.is_empty();
            nothing && w.surface.is_none() && w.image.is_none() && !w.closed
        };
        let waited = self.came.wait_while(self.waiting(), idle);
        let mut waiting = waited.unwrap_or_else(PoisonError::into_inner);
        let note = |w: &mut Waiting| w.notes.pop_front().map(|note| Next::Note(Box::new(note)));
        if waiting.closed {
            return note(&mut waiting);
        }
        let answer = waiting.answer.take().map(Next::Answer);
        let next = answer.or_else(|| note(&mut waiting));
        let next = next.or_else(|| waiting.surface.take().map(Next::Large));
        next.or_else(|| waiting.image.take().map(Next::Large))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::text;

    #[test]
    fn the_newest_of_each_kind_is_sent_and_what_is_small_first() {
        let outbox = Outbox::new(1);
        let [first, second] = [vec![1u8], vec![2u8]].map(Arc::new);
        outbox.image(&first);
        outbox.image(&second);
        (0..40).for_each(|n| outbox.note(text(&n.to_string())));
        for n in 24..40 {
            let Some(Next::Note(note)) = outbox.next() else { panic!("a note") };
            assert_eq!(note.content, text(&n.to_string()).content);
        }
        assert!(matches!(outbox.next(), Some(Next::Large(image)) if *image == [2]));
        outbox.close();
        assert!(outbox.next().is_none());
    }

    #[test]
    fn at_the_end_notes_are_sent_and_nothing_else_is() {
        let outbox = Outbox::new(1);
        outbox.surface(&Arc::new(vec![1]));
        outbox.note(text("why it ends"));
        outbox.close();
        outbox.note(text("too late"));
        assert!(matches!(outbox.next(), Some(Next::Note(_))));
        assert!(outbox.next().is_none());
    }

    #[test]
    fn version_two_is_used_once_the_peer_has() {
        let outbox = Outbox::new(1);
        outbox.used(Version::One);
        assert_eq!(outbox.version(), Version::One);
        outbox.used(Version::Two);
        outbox.used(Version::One);
        assert_eq!(outbox.version(), Version::Two);
    }
}
