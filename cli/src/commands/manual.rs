//! `supine completions` and `supine man`.

use crate::End;
use crate::args::Cli;
use crate::failure::Failure;
use crate::lists::{codes, files, with_lists};
use crate::screen::data;
use clap::CommandFactory;
use clap_complete::Shell;
use std::path::Path;
use std::process::ExitCode;
use supine_space::Failure as Kind;

/// What people begin with.
const EXAMPLES: &[&str] = &[
    "supine demo",
    "supine inspect CT_FOLDER",
    "supine init CT_FOLDER --structures RS.dcm --tumour GTV",
    "supine check case.toml",
    "supine run case.toml --out result",
    "supine batch p1/case.toml p2 p3 --out cohort",
    "supine carry result RS.dcm --out carried.dcm",
    "supine send result --to ARCHIVE@pacs.example:104",
    "supine verify-export result/ct --source CT_FOLDER",
];

pub(crate) fn completions(shell: Shell) -> Result<End, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "supine", &mut script);
    data(&String::from_utf8_lossy(&script));
    Ok(End::Done)
}

/// The help of the program, of a command, or the keys of the case file.
pub(crate) fn help(topic: Option<&str>) -> Result<End, Failure> {
    let mut cli = with_lists(Cli::command());
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
        data(&format!("{:#}\n", refused(error).json()));
    }
    let _closed = error.print();
    ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(Kind::Usage.exit_code()))
}

/// What clap says, in whole, with its hints as the advice.
fn refused(error: &clap::Error) -> Failure {
    let text = error.to_string();
    let (hints, said): (Vec<&str>, Vec<&str>) =
        text.trim_end().split("\n\n").map(str::trim).partition(|part| is_hint(part));
    let (tips, others): (Vec<&str>, Vec<&str>) =
        hints.into_iter().partition(|hint| hint.starts_with(TIP));
    let hints = if tips.is_empty() { others } else { tips };
    let hints: Vec<&str> = hints.iter().map(|hint| hint.trim_start_matches(TIP)).collect();
    let said = said.join("\n");
    let message = said.strip_prefix("error: ").unwrap_or(&said);
    let advice = (!hints.is_empty()).then(|| hints.join("\n"));
    Failure::new(Kind::Usage, message).advised(advice)
}

const TIP: &str = "tip: ";

fn is_hint(part: &str) -> bool {
    [TIP, "Usage: ", "For more information"].iter().any(|begin| part.starts_with(begin))
}

/// One page for the program and one for each command.
pub(crate) fn man(out: &Path) -> Result<End, Failure> {
    let made = std::fs::create_dir_all(out)
        .and_then(|()| clap_mangen::generate_to(Cli::command(), out))
        .and_then(|()| complete_pages(out));
    made.map_err(|e| {
        Failure::new(Kind::of_output(&e), format!("{} cannot be written: {e}", out.display()))
    })?;
    Ok(End::Done)
}

/// Adds to the pages examples, exit codes and files of their commands.
fn complete_pages(out: &Path) -> std::io::Result<()> {
    let mut cli = Cli::command();
    cli.build();
    complete_page(&out.join("supine.1"), "", EXAMPLES.iter().copied())?;
    for command in cli.get_subcommands().filter(|command| !command.is_hide_set()) {
        let name = command.get_name();
        let examples = command.get_after_long_help().map(ToString::to_string).unwrap_or_default();
        let examples = examples.lines().filter_map(|line| line.strip_prefix("  "));
        complete_page(&out.join(format!("supine-{name}.1")), name, examples)?;
    }
    Ok(())
}

/// Adds sections to the page of a command. What clap makes of the end of its help, on one line,
/// goes.
fn complete_page<'a>(
    path: &Path,
    command: &str,
    examples: impl Iterator<Item = &'a str>,
) -> std::io::Result<()> {
    let text = std::fs::read_to_string(path)?;
    let mut text = text.split(".SH EXTRA").next().unwrap_or_default().to_owned();
    let codes = codes(command).into_iter().map(|(code, means)| format!("{code} {means}"));
    let sections: [(&str, Vec<String>); 3] = [
        ("EXAMPLES", examples.map(str::to_owned).collect()),
        ("EXIT STATUS", codes.collect()),
        ("FILES", files(command).into_iter().map(str::to_owned).collect()),
    ];
    for (title, lines) in sections.into_iter().filter(|(_, lines)| !lines.is_empty()) {
        text += &format!(".SH {title}\n");
        lines.iter().for_each(|line| text += &format!("{}\n.br\n", roff(line)));
    }
    std::fs::write(path, text)
}

/// A line of text as it stands in a page.
fn roff(line: &str) -> String {
    let text = line.replace('\\', "\\e").replace('-', "\\-");
    if text.starts_with(['.', '\'']) { format!("\\&{text}") } else { text }
}
