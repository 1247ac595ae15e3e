//! What goes on beside the work that was asked for: labels follow the seeds, the table is tilted
//! live, and the CT is made ready for a brush.

use crate::Error;
use crate::bed::{BedWish, Frames, PreviewRequest};
use crate::job::JobObserver;
use crate::state::{Problem, Readiness};
use crate::workspace::Workspace;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use supine_flow::{Lane, LiveTilt, NodeId, Request, Session};

/// What is wanted beside the work, the most urgent last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Wish {
    /// The CT made ready, so that labels can follow.
    Prepare,
    /// The table tilted.
    Bed,
    /// Labels of the seeds that are given now.
    Labels,
}

/// What goes on; of each kind of wish the newest counts.
#[derive(Default)]
pub(crate) struct Live(Mutex<Wanted>);

#[derive(Default)]
struct Wanted {
    labels: Option<Arc<Session>>,
    bed: Option<BedWish>,
    prepare: Option<Arc<Session>>,
    /// What is being done, and how to end it.
    doing: Option<(Wish, Arc<AtomicBool>)>,
}

/// What is done next.
enum Next {
    Labels(Arc<Session>),
    Bed(BedWish),
    Prepare(Arc<Session>),
}

impl Wanted {
    fn next(&mut self) -> Option<Next> {
        let labels = self.labels.take().map(Next::Labels);
        let bed = |wanted: &mut Self| wanted.bed.take().map(Next::Bed);
        labels.or_else(|| bed(self)).or_else(|| self.prepare.take().map(Next::Prepare))
    }

    /// Ends what is less urgent, and what a newer wish has made pointless.
    fn interrupt(&self, by: Wish) {
        if let Some((doing, stop)) = &self.doing {
            let again = *doing == by && by == Wish::Labels;
            if *doing < by || again {
                stop.store(true, Ordering::SeqCst);
            }
        }
    }
}

impl Next {
    fn wish(&self) -> Wish {
        match self {
            Self::Labels(_) => Wish::Labels,
            Self::Bed(_) => Wish::Bed,
            Self::Prepare(_) => Wish::Prepare,
        }
    }
}

impl Live {
    fn wanted(&self) -> MutexGuard<'_, Wanted> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Ends the making ready: other work does the same with more threads.
    pub(crate) fn make_way(&self) {
        self.wanted().interrupt(Wish::Bed);
    }

    /// Ends all of it.
    pub(crate) fn end(&self) {
        let mut wanted = self.wanted();
        (wanted.labels, wanted.bed, wanted.prepare) = (None, None, None);
        if let Some((_, stop)) = &wanted.doing {
            stop.store(true, Ordering::SeqCst);
        }
    }
}

impl Workspace {
    /// Makes the labels of a session's seeds, for somebody looks at them.
    pub(crate) fn follow_seeds(self: &Arc<Self>, session: &Arc<Session>) {
        self.want(Wish::Labels, |wanted| wanted.labels = Some(Arc::clone(session)));
    }

    /// Makes a session's CT ready for that.
    pub(crate) fn prepare(self: &Arc<Self>, session: &Arc<Session>) {
        self.want(Wish::Prepare, |wanted| wanted.prepare = Some(Arc::clone(session)));
    }

    /// Tilts the table for a page.
    pub(crate) fn tilt(self: &Arc<Self>, asked: PreviewRequest, to: &Frames) {
        let Some(session) = self.held().session.clone() else { return };
        let wish = BedWish { session, asked, to: to.clone() };
        self.want(Wish::Bed, |wanted| wanted.bed = Some(wish));
    }

    fn want(self: &Arc<Self>, wish: Wish, put: impl FnOnce(&mut Wanted)) {
        let mut wanted = self.live.wanted();
        put(&mut wanted);
        wanted.interrupt(wish);
        if wanted.doing.is_none() {
            wanted.doing = Some((wish, Arc::default()));
            let workspace = Arc::clone(self);
            std::thread::spawn(move || workspace.work_beside());
        }
    }

    /// Does what is wanted until nothing is. The preview of the table is kept as long as it is of
    /// what is open.
    fn work_beside(self: &Arc<Self>) {
        loop {
            let (next, stop) = {
                let mut wanted = self.live.wanted();
                let Some(next) = wanted.next() else {
                    wanted.doing = None;
                    return;
                };
                let stop = Arc::<AtomicBool>::default();
                wanted.doing = Some((next.wish(), Arc::clone(&stop)));
                (next, stop)
            };
            let wish = next.wish();
            let watching = JobObserver::beside(Arc::clone(self), stop);
            // What fails here must not end the following of seeds for ever.
            let work = std::panic::AssertUnwindSafe(|| self.do_beside(&next, &watching));
            let done = std::panic::catch_unwind(work).unwrap_or(Err(Error::Broken));
            self.change(|held| {
                held.state.live.share = None;
                // A newer stroke may be waiting.
                let waits = self.live.wanted().labels.is_some();
                (held.state.live.following, held.state.live.busy) = (waits, waits);
                // A preview tells of itself; that the CT cannot be made ready is told by the work
                // that needs it.
                if wish == Wish::Labels {
                    held.state.live.problem = match done {
                        Ok(()) | Err(Error::Flow(supine_flow::Error::Stopped)) => None,
                        Err(error) => Some(Problem::of(&error)),
                    };
                }
            });
        }
    }

    fn do_beside(&self, next: &Next, watching: &JobObserver) -> Result<(), Error> {
        match next {
            Next::Labels(session) => self.make_labels(session, watching),
            Next::Bed(wish) => self.preview(&mut self.kept_bed(), wish, watching),
            Next::Prepare(session) => self.make_ready(session, watching),
        }
    }

    fn make_ready(&self, session: &Session, watching: &JobObserver) -> Result<(), Error> {
        self.read_objects(session, watching, Lane::Live);
        if !session.is_fresh(NodeId::Prepare) {
            self.make_segmenter(session, watching)?;
        }
        if session.is_fresh(NodeId::Segment) && session.peek_surfaces().is_none() {
            let request = Request { observer: watching, lane: Lane::Live, ..Request::default() };
            session.surfaces(&request)?;
            self.change(|held| held.show_results(session));
        }
        // The table comes next.
        if session.is_fresh(NodeId::Region) {
            self.keep_preview(&mut self.kept_bed(), session, watching)?;
        }
        Ok(())
    }

    fn make_segmenter(&self, session: &Session, watching: &JobObserver) -> Result<(), Error> {
        let show = |ready: Readiness| self.change(|held| held.state.live.segmenter = ready);
        show(Readiness::Preparing);
        let request = Request { observer: watching, lane: Lane::Live, ..Request::default() };
        let done = session.update(&[NodeId::Prepare], &request);
        show(match &done {
            Ok(()) => Readiness::Ready,
            Err(supine_flow::Error::Stopped) => Readiness::None,
            Err(_) => Readiness::Failed,
        });
        Ok(done?)
    }

    /// The labels first, for somebody looks at them; then what is known of their border.
    fn make_labels(&self, session: &Session, watching: &JobObserver) -> Result<(), Error> {
        let request = Request { observer: watching, lane: Lane::Live, ..Request::default() };
        session.labels(&request)?;
        self.change(|held| {
            held.state.live.following = false;
            held.show_results(session);
        });
        session.surfaces(&request)?;
        if crate::open::has_breast(session) {
            session.update(&[NodeId::Region], &request)?;
        }
        self.change(|held| held.show_results(session));
        Ok(())
    }

    fn kept_bed(&self) -> MutexGuard<'_, Option<LiveTilt>> {
        self.kept_bed.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Lets the preview go, with the CT that it holds.
    pub(crate) fn drop_preview(&self) {
        *self.kept_bed() = None;
    }
}

/// A preview that is kept.
pub(crate) type KeptBed = Mutex<Option<LiveTilt>>;
