//! `supine completions` and `supine man`.

use crate::End;
use crate::args::Cli;
use crate::failure::Failure;
use crate::screen::data;
use clap::CommandFactory;
use clap_complete::Shell;
use std::path::Path;
use std::process::ExitCode;
use supine_space::Failure as Kind;

pub(crate) fn completions(shell: Shell) -> Result<End, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "supine", &mut script);
    data(&String::from_utf8_lossy(&script));
    Ok(End::Done)
}

/// The help of the program, of a command, or the keys of the case file.
pub(crate) fn help(topic: Option<&str>) -> Result<End, Failure> {
    let mut cli = Cli::command();
    cli.build();
    match topic {
        None => data(&cli.render_long_help().to_string()),
        Some("case") => data(&supine_flow::spec::key_list()),
        Some(topic) => {
            let known: Vec<String> = cli
                .get_subcommands()
                .filter(|command| !command.is_hide_set())
                .map(|command| command.get_name().to_owned())
                .collect();
            let command = cli.find_subcommand_mut(topic).ok_or_else(|| {
                let message = format!("no help on {topic:?}; there is: case, {}", known.join(", "));
                Failure::new(Kind::Usage, message)
            })?;
            data(&command.render_long_help().to_string());
        }
    }
    Ok(End::Done)
}

/// A command line that cannot be: said by clap, for scripts on stdout too.
pub(crate) fn usage(error: &clap::Error) -> ExitCode {
    let json = std::env::args_os().any(|word| word == "--json");
    if json && error.use_stderr() {
        let text = error.to_string();
        let message = text.lines().next().unwrap_or_default();
        let message = message.strip_prefix("error: ").unwrap_or(message);
        data(&format!("{:#}\n", Failure::new(Kind::Usage, message).json()));
    }
    let _closed = error.print();
    ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(Kind::Usage.exit_code()))
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
