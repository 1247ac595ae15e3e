//! The binary `supine`: arguments, progress and exit codes; no method.
//!
//! stdout is data, stderr is people.

#![expect(clippy::disallowed_methods, reason = "edge crate: files, and the clock of the bar")]
#![expect(clippy::print_stderr, reason = "a command line talks")]

mod args;
mod args_network;
mod commands;
mod failure;
mod screen;

use args::{Cli, Command};
use clap::Parser;
use failure::Failure;
use screen::Screen;
use std::process::ExitCode;

fn main() -> ExitCode {
    let cli = Cli::parse();
    let screen = Screen::new(&cli.common);
    match run(cli, &screen) {
        Ok(code) => ExitCode::from(code),
        Err(failure) => {
            screen.fail(&failure.message);
            ExitCode::from(failure.code)
        }
    }
}

fn run(cli: Cli, screen: &Screen) -> Result<u8, Failure> {
    if let Some(threads) = cli.common.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.get()).build_global();
        pool.map_err(|e| Failure::usage(format!("--threads: {e}")))?;
    }
    screen.catch_interrupts()?;
    match cli.command {
        Command::Demo(args) => commands::demo::demo(&args, screen),
        Command::Inspect(args) => commands::inspect::inspect(&args, screen),
        Command::Run(args) => commands::run::run(&args, screen),
        Command::Segment(args) => commands::segment::segment(&args, screen),
        Command::Mesh(args) => commands::mesh::mesh(&args, screen),
        Command::Coarsen(args) => commands::coarsen::coarsen(&args, screen),
        Command::Solve(args) => commands::solve::solve(&args, screen),
        Command::Warp(args) => commands::warp::warp(&args, screen),
        Command::Carry(args) => commands::carry::carry(&args, screen),
        Command::Send(args) => commands::send::send(&args, screen),
        Command::Fetch(args) => commands::fetch::fetch(&args, screen),
        Command::VerifyExport(args) => commands::verify_export::verify_export(&args, screen),
        #[cfg(feature = "tetgen")]
        Command::TetgenWorker => commands::mesh::tetgen_worker(),
        Command::Completions { shell } => commands::manual::completions(shell),
        Command::Man { out } => commands::manual::man(&out),
    }
}
