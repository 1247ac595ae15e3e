//! The worker of this crate as a program: a surface on stdin, a mesh on stdout.
#![expect(clippy::print_stderr, reason = "a worker says why it failed")]

use std::process::ExitCode;

fn main() -> ExitCode {
    match supine_tetrahedralise_tetgen::work() {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::FAILURE
        }
    }
}
