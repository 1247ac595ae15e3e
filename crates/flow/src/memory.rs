//! The memory that a session's work holds, apart from that of other sessions in the process.
//!
//! `unsafe` is needed once: an allocator has no safe interface. It hands every call on to the
//! system's.

#![allow(unsafe_code, reason = "an allocator, see above")]

// musl's own allocator has one lock for all threads.
#[cfg(target_env = "musl")]
use mimalloc::MiMalloc as System;
#[cfg(not(target_env = "musl"))]
use std::alloc::System;
use std::alloc::{GlobalAlloc, Layout};
use std::cell::Cell;
use std::sync::atomic::{AtomicBool, AtomicIsize, Ordering};

/// Bytes that a thread counts for itself before it tells its session: threads then seldom wait for
/// each other.
const BATCH: isize = 1 << 16;

/// The system's allocator, which counts for each session what its threads hold. A program that
/// wants sessions to tell their memory names it as its `#[global_allocator]`.
#[derive(Clone, Copy, Debug, Default)]
pub struct CountingAllocator;

static COUNTS: AtomicBool = AtomicBool::new(false);
static REFUSED: AtomicBool = AtomicBool::new(false);

/// Whether the system has refused memory: what aborts the program after that is most likely that.
pub fn memory_was_refused() -> bool {
    REFUSED.load(Ordering::Relaxed)
}

/// Memory as the system gave it; remembers when it gave none.
fn given(memory: *mut u8) -> *mut u8 {
    if memory.is_null() {
        REFUSED.store(true, Ordering::Relaxed);
    }
    memory
}

/// What the threads of a session hold, bytes.
#[derive(Debug, Default)]
pub(crate) struct Meter {
    now: AtomicIsize,
    peak: AtomicIsize,
}

thread_local! {
    static METER: Cell<Option<&'static Meter>> = const { Cell::new(None) };
    static UNTOLD: Cell<isize> = const { Cell::new(0) };
}

impl Meter {
    /// A meter that lives as long as the process, as the threads that count on it may: a few bytes
    /// per session.
    pub(crate) fn leaked() -> &'static Self {
        Box::leak(Box::default())
    }

    /// This thread counts here from now on.
    pub(crate) fn enter(&'static self) {
        tell();
        METER.set(Some(self));
    }

    /// Work that counts here, on this thread.
    pub(crate) fn within<T>(&'static self, work: impl FnOnce() -> T) -> T {
        let before = METER.get();
        self.enter();
        let result = work();
        tell();
        METER.set(before);
        result
    }

    /// The most that was held at once since the last reset, MB; none in a program without the
    /// counting allocator.
    pub(crate) fn peak_mb(&self) -> Option<f64> {
        let counts = COUNTS.load(Ordering::Relaxed);
        counts.then(|| self.peak.load(Ordering::Relaxed).max(0) as f64 / 1e6)
    }

    /// Forgets the highest mark.
    pub(crate) fn reset(&self) {
        self.peak.store(self.now.load(Ordering::Relaxed), Ordering::Relaxed);
    }

    fn add(&self, bytes: isize) {
        let now = self.now.fetch_add(bytes, Ordering::Relaxed) + bytes;
        self.peak.fetch_max(now, Ordering::Relaxed);
    }
}

/// Tells the thread's session what it has not been told.
fn tell() {
    let untold = UNTOLD.replace(0);
    if let Some(meter) = METER.get() {
        meter.add(untold);
    }
}

/// Counts bytes for the session that the thread works for, if any.
fn count(bytes: isize) {
    // A thread that ends frees memory when its counters are gone.
    let Ok(Some(_)) = METER.try_with(Cell::get) else { return };
    let untold = UNTOLD.get() + bytes;
    UNTOLD.set(untold);
    if untold.abs() >= BATCH {
        tell();
    }
}

// SAFETY: every call goes to the system's allocator as it came; counting allocates nothing.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNTS.store(true, Ordering::Relaxed);
        count(layout.size() as isize);
        // SAFETY: the caller's promise, handed on.
        given(unsafe { System.alloc(layout) })
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as isize);
        // SAFETY: the caller's promise, handed on.
        given(unsafe { System.alloc_zeroed(layout) })
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        count(-(layout.size() as isize));
        // SAFETY: the caller's promise, handed on.
        unsafe { System.dealloc(memory, layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(size as isize - layout.size() as isize);
        // SAFETY: the caller's promise, handed on.
        given(unsafe { System.realloc(memory, layout, size) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[global_allocator]
    static ALLOCATOR: CountingAllocator = CountingAllocator;

    #[test]
    fn two_meters_at_once_count_each_its_own() {
        let [a, b] = [Meter::leaked(), Meter::leaked()];
        std::thread::scope(|scope| {
            for (meter, mb) in [(a, 40), (b, 10)] {
                scope.spawn(move || {
                    meter.within(|| {
                        let mut held = vec![1_u8; mb * 1_000_000];
                        held.push(1);
                        drop(held);
                    });
                });
            }
        });
        // The vector doubles as it grows by one.
        for (meter, low, high) in [(a, 40.0, 81.0), (b, 10.0, 21.0)] {
            let peak = meter.peak_mb().unwrap();
            assert!((low..high).contains(&peak), "{peak} MB");
            assert!(meter.now.load(Ordering::Relaxed).abs() < 2 * BATCH);
            meter.reset();
            assert!(meter.peak_mb().unwrap() < 0.2);
        }
    }
}
