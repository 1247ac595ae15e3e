//! `supine completions` and `supine man`.

use crate::args::Cli;
use crate::failure::Failure;
use crate::screen::data;
use clap::CommandFactory;
use clap_complete::Shell;
use std::path::Path;

pub(crate) fn completions(shell: Shell) -> Result<u8, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "supine", &mut script);
    data(&String::from_utf8_lossy(&script));
    Ok(0)
}

/// One page for the program and one for each command.
pub(crate) fn man(out: &Path) -> Result<u8, Failure> {
    let made =
        std::fs::create_dir_all(out).and_then(|()| clap_mangen::generate_to(Cli::command(), out));
    made.map_err(|e| Failure::output(format!("{} cannot be written: {e}", out.display())))?;
    Ok(0)
}
