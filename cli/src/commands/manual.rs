//! `supine completions` and `supine man`.

use crate::End;
use crate::args::Cli;
use crate::failure::Failure;
use crate::screen::data;
use clap::CommandFactory;
use clap_complete::Shell;
use std::path::Path;
use supine_space::Failure as Kind;

pub(crate) fn completions(shell: Shell) -> Result<End, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "supine", &mut script);
    data(&String::from_utf8_lossy(&script));
    Ok(End::Done)
}

/// One page for the program and one for each command.
pub(crate) fn man(out: &Path) -> Result<End, Failure> {
    let made =
        std::fs::create_dir_all(out).and_then(|()| clap_mangen::generate_to(Cli::command(), out));
    made.map_err(|e| {
        Failure::new(Kind::of_output(&e), format!("{} cannot be written: {e}", out.display()))
    })?;
    Ok(End::Done)
}
