//! How the program ends when the system gives it no more memory.
//!
//! Rust aborts then, which a script takes for a crash. A handler of that signal ends the program
//! with the code of what is worth another try. `unsafe` is needed to set it: what a handler may
//! call is little, and nobody checks it. This one reads a flag, writes to stderr and ends the
//! process, all of which POSIX allows there (signal-safety(7)).

#![allow(unsafe_code, reason = "a signal's handler, see above")]

use nix::libc;
use nix::sys::signal::{SaFlags, SigAction, SigHandler, SigSet, Signal, sigaction};
use supine_flow::memory_was_refused;
use supine_space::Failure;

const TEXT: &[u8] = b"error: the memory does not suffice; what was finished stays; run it again with more memory, fewer at once or a smaller CT\n";

/// What the standard library and rayon panic with where they start threads and cannot.
const NO_THREAD: [&str; 2] =
    ["failed to spawn thread", "The global thread pool has not been initialized"];

/// Sees to it that a lack of memory, or of threads, which need some, ends the program with
/// [`Failure::Retry`].
pub(crate) fn ends_as_a_retry() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panicked| {
        let said = panicked.payload_as_str().unwrap_or_default();
        if NO_THREAD.iter().any(|begin| said.starts_with(begin)) {
            end();
        }
        usual(panicked);
    }));
    let action = SigAction::new(SigHandler::Handler(aborted), SaFlags::empty(), SigSet::empty());
    // SAFETY: the handler does what POSIX allows there, see above. Without it an abort stays an
    // abort.
    let _set = unsafe { sigaction(Signal::SIGABRT, &action) };
}

/// Other aborts go on as such: the system ends the program when this returns.
extern "C" fn aborted(_: libc::c_int) {
    if memory_was_refused() {
        end();
    }
}

/// Says why, and ends the process with [`Failure::Retry`].
fn end() {
    let code = i32::from(Failure::Retry.exit_code());
    // SAFETY: the text is as long as it says; `_exit` runs nothing of ours.
    unsafe {
        libc::write(libc::STDERR_FILENO, TEXT.as_ptr().cast(), TEXT.len());
        libc::_exit(code);
    }
}
