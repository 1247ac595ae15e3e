//! Live navigation from outside: how long a pose takes to come back as a place, and how right the
//! place is. JSON on stdout.
//!
//! - `bench-navigate echo FROM MINUTES`: the round trip alone, against a server that answers at
//!   once (S = 0).
//! - `bench-navigate loop SUPINE RUN TETRAHEDRA ORDER FROM MINUTES [hog|image|pressing|record
//!   FILE]`: against a session of the binary on a finished run, with a busy process beside it, with
//!   a viewer that is streamed the image, with tissue that is pressed instead of tied, or with a
//!   recording.
//! - `bench-navigate accuracy RUN RECORDING`: places of a recorded session against settled ones
//!   that know nothing of the way.
//! - `bench-navigate drift RUN STEPS`: so many steps and back to the start.
//! - `bench-navigate path RUN`: a path over the tumour on coarse and fine meshes, one pose after
//!   the other.
//!
//! The poses are those of the motion of 10 minutes at 60 Hz: so many minutes of it, FROM a time in
//! s.
#![expect(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a measurement reads its input, takes times and tells its result"
)]

mod accuracy;
mod drift;
mod echo;
mod live;
mod path;
mod picture;
mod server;
mod tissue;
mod tracker;
mod turnaround;
mod viewer;

use anyhow::{Result, bail};
use std::io::Read;
use std::path::Path;
use tracker::Span;

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let told = match &words[..] {
        ["echo", from, minutes] => echo::measure(&Span::read(from, minutes)?)?,
        ["loop", supine, run, tetrahedra, order, from, minutes, beside @ ..] => {
            let mesh = live::Mesh { tetrahedra: tetrahedra.parse()?, order: order.parse()? };
            let beside = live::Beside::read(beside)?;
            let span = Span::read(from, minutes)?;
            live::measure(Path::new(supine), Path::new(run), mesh, &span, &beside)?
        }
        ["accuracy", run, recording] => accuracy::measure(Path::new(run), Path::new(recording))?,
        ["path", run] => path::measure(Path::new(run))?,
        ["drift", run, steps] => drift::measure(Path::new(run), steps.parse()?)?,
        ["hog"] => return hog(),
        _ => bail!("bench-navigate echo|loop|accuracy|drift|path, see the head of its source"),
    };
    println!("{told}");
    Ok(())
}

/// Keeps a core busy until standard input ends, as it does when the process that started this one
/// is gone.
fn hog() -> Result<()> {
    std::thread::spawn(|| {
        let mut state = 1_u64;
        loop {
            state = std::hint::black_box(state.wrapping_mul(6_364_136_223_846_793_005) + 1);
        }
    });
    std::io::stdin().read_to_end(&mut Vec::new())?;
    Ok(())
}
