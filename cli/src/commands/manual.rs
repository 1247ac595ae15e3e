//! `supine completions` and `supine man`.

use crate::End;
use crate::args::{Cli, EXIT_CODES};
use crate::failure::Failure;
use crate::screen::data;
use clap::CommandFactory;
use clap_complete::Shell;
use std::path::Path;
use std::process::ExitCode;
use supine_space::Failure as Kind;

/// What people begin with, by command.
const EXAMPLES: &[(&str, &str)] = &[
    ("demo", "supine demo"),
    ("inspect", "supine inspect CT_FOLDER"),
    ("init", "supine init CT_FOLDER --structures RS.dcm --tumour GTV"),
    ("check", "supine check case.toml"),
    ("run", "supine run case.toml --out result"),
    ("run", "supine run case.toml --out result --set bed.ap=10"),
    ("run", "supine run case.toml --out result --json > summary.json"),
    ("run", "supine run case.toml --out result --status result.json"),
    ("batch", "supine batch p1/case.toml p2 p3 --out cohort"),
    ("batch", "supine batch cases.csv --out cohort --jobs 4 --memory 16"),
    ("batch", "supine batch --collect --out cohort"),
    ("carry", "supine carry result RS.dcm --out carried.dcm"),
    ("send", "supine send result --to ARCHIVE@pacs.example:104"),
    ("verify-export", "supine verify-export result/ct --source CT_FOLDER"),
];

/// What a run reads and leaves.
const FILES: &[&str] = &[
    "case.toml: the case; supine help case lists its keys",
    "OUT/ct: the deformed CT as a DICOM series",
    "OUT/structures.dcm: body, chest wall, breast and tumour on that series",
    "OUT/report/index.html: the report",
    "OUT/report.dcm: what it says first, as a PDF in a DICOM object, where the case asks for it",
    "OUT/summary.json: the result for scripts; supine schema summary describes it",
    "OUT/log.jsonl: what was done, a line each",
    "DIR/cohort.csv, DIR/index.html: all patients of a batch beside each other",
    "DIR/runs/NAME, DIR/status/NAME.json: the run of each, and how it ended",
    "OUT-reidentification: the key of a de-identified run; keep it apart",
];

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

/// Adds to the pages what is the same for all commands, and examples of those that people begin with.
fn complete_pages(out: &Path) -> std::io::Result<()> {
    let mut cli = Cli::command();
    cli.build();
    let names = cli.get_subcommands().filter(|command| !command.is_hide_set());
    let names: Vec<String> = names.map(|command| command.get_name().to_owned()).collect();
    for name in std::iter::once(String::new()).chain(names) {
        let page = if name.is_empty() { "supine.1".into() } else { format!("supine-{name}.1") };
        let path = out.join(page);
        let mut text = std::fs::read_to_string(&path)?;
        for (title, lines) in sections(&name) {
            text += &format!(".SH {title}\n");
            lines.iter().for_each(|line| text += &format!("{}\n.br\n", roff(line)));
        }
        std::fs::write(&path, text)?;
    }
    Ok(())
}

/// Sections of a page with their lines.
fn sections(name: &str) -> Vec<(&'static str, Vec<String>)> {
    let shown = EXAMPLES.iter().filter(|(command, _)| name.is_empty() || *command == name);
    let examples: Vec<String> = shown.map(|(_, line)| (*line).to_owned()).collect();
    let codes = EXIT_CODES.strip_prefix("Exit codes: ").unwrap_or(EXIT_CODES);
    let codes = codes.trim_end_matches('.').split("; ").map(str::to_owned).collect();
    let files = FILES.iter().map(|line| (*line).to_owned()).collect();
    let all = [("EXAMPLES", examples), ("EXIT STATUS", codes), ("FILES", files)];
    all.into_iter().filter(|(_, lines)| !lines.is_empty()).collect()
}

/// A line of text as it stands in a page.
fn roff(line: &str) -> String {
    let text = line.replace('\\', "\\e").replace('-', "\\-");
    if text.starts_with(['.', '\'']) { format!("\\&{text}") } else { text }
}
