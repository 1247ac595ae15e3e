//! The binary `supine`: arguments, progress and exit codes; no method.
//!
//! stdout is data, stderr is people.

#![expect(clippy::disallowed_methods, reason = "edge crate: the demo's files")]

mod args;
mod args_batch;
mod args_navigate;
mod args_network;
mod cli_values;
mod commands;
#[cfg(windows)]
mod elementary;
mod examples;
mod failure;
mod lists;
mod log;
mod meshers;
#[cfg(unix)]
mod out_of_memory;
mod parameters;
mod profile;
mod resident;
mod screen;
mod start;

use args::{Cli, Command};
use clap::{CommandFactory as _, FromArgMatches as _};
use cli_values::Schema;
use commands::{
    batch, batch_case, carry, demo, fetch, init, inspect, manual, navigate, open, run, send, stages,
};
use failure::Failure;
use screen::{Screen, data};
use std::process::ExitCode;
use supine_flow::commands::provenance::provenance;
use supine_flow::{
    commands::{status_schema, summary_schema},
    spec::case_schema,
};
use supine_space::Failure as Kind;

#[global_allocator]
static ALLOCATOR: supine_flow::CountingAllocator = supine_flow::CountingAllocator;

fn main() -> ExitCode {
    #[cfg(unix)]
    out_of_memory::ends_as_a_retry();
    // Before the arguments, which may name one.
    meshers::offer();
    let parsed = lists::with_lists(Cli::command()).try_get_matches();
    let cli = match parsed.and_then(|matches| Cli::from_arg_matches(&matches)) {
        Ok(cli) => cli,
        Err(error) => return manual::usage(&error),
    };
    let screen = Screen::new(&cli.common);
    let mut done = match screen.check_profile() {
        Ok(()) => {
            let done = work(cli, &screen);
            // What the command itself failed with is told first.
            match screen.write_profile() {
                Ok(()) => done,
                Err(failure) => done.and(Err(failure)),
            }
        }
        Err(failure) => Err(failure),
    };
    if let Err(failure) = screen::check_written() {
        done = done.and(Err(failure));
    }
    if let Err(failure) = &done {
        screen.fail(failure);
    }
    match done {
        Ok(End::Done) => ExitCode::SUCCESS,
        Ok(End::Failed(kind)) => ExitCode::from(kind.exit_code()),
        Err(failure) => ExitCode::from(failure.kind.exit_code()),
    }
}

/// How a command ends that said what there is to say.
#[derive(Clone, Copy, Debug)]
enum End {
    Done,
    /// The answer itself is that something is wrong.
    Failed(Kind),
}

impl End {
    /// Done if all is well, else failed in such a way.
    fn of(well: bool, kind: Kind) -> Self {
        if well { Self::Done } else { Self::Failed(kind) }
    }
}

fn work(cli: Cli, screen: &Screen) -> Result<End, Failure> {
    if let Some(threads) = cli.common.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.get()).build_global();
        pool.map_err(|e| Failure::new(Kind::Usage, format!("--threads: {e}")))?;
    }
    screen.catch_interrupts()?;
    match cli.command {
        Command::Demo(args) => demo::demo(&args, screen),
        Command::Open(args) => open::open(&args, screen),
        Command::Inspect(args) => inspect::inspect(args, screen),
        Command::Init(args) => init::init(args, screen),
        Command::Check(args) => stages::check(args, screen),
        Command::Run(args) => run::run(args, screen),
        Command::Batch(args) => batch::batch(args, screen),
        Command::BatchCase(args) => batch_case::batch_case(args, screen),
        Command::Fit(args) => run::fit(args, screen),
        Command::Segment(args) => stages::segment(args, screen),
        Command::Mesh(args) => stages::mesh(args, screen),
        Command::Coarsen(args) => stages::coarsen(args, screen),
        Command::Solve(args) => stages::solve(args, screen),
        Command::Warp(args) => stages::warp(args, screen),
        Command::Carry(args) => carry::carry(args, screen),
        Command::Navigate(args) => navigate::navigate(&args, screen),
        Command::Replay(args) => navigate::replay(&args, screen),
        Command::Send(args) => send::send(&args, screen),
        Command::Fetch(args) => fetch::fetch(&args, screen),
        Command::VerifyExport(args) => inspect::verify_export(args, screen),
        Command::Provenance { run } => {
            data(&format!("{:#}\n", provenance(&run)?));
            Ok(End::Done)
        }
        Command::Schema { of } => {
            let schema = match of {
                Schema::Case => case_schema(),
                Schema::Summary => summary_schema(),
                Schema::Status => status_schema(),
            };
            data(&format!("{schema:#}\n"));
            Ok(End::Done)
        }
        #[cfg(feature = "tetgen")]
        Command::TetgenWorker => {
            supine_tetrahedralise_tetgen::work().map_err(|e| Failure::new(Kind::Method, e))?;
            Ok(End::Done)
        }
        Command::Help { topic } => manual::help(topic.as_deref()),
        Command::Completions { shell } => manual::completions(shell),
        Command::Man { out } => manual::man(&out),
    }
}
