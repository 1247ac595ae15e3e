//! What stands in the manual of each command beside its options: its exit codes, and the files that
//! it reads and leaves.

use clap::Command;

/// An exit code and what it means there.
pub(crate) type Code = (u8, &'static str);

const DONE: Code = (0, "done");
const INPUT: Code = (1, "the input cannot be used");
const USAGE: Code = (2, "wrong usage");
const METHOD: Code = (3, "the method failed");
const OUTPUT: Code = (5, "an output cannot be written");
const RETRY: Code = (75, "worth a retry: memory, disk, another run in the folder");
const STOPPED: Code = (130, "interrupted");

/// Commands that work on the network try again what may pass.
const NETWORK: Code =
    (75, "the connection or the archive failed for the moment: the same call goes on from there");

/// The exit codes of a command, those of all where no command is named.
pub(crate) fn codes(command: &str) -> Vec<Code> {
    let judged = "the verdict is red, or not green with --deny-warnings; the outputs are there";
    match command {
        "" => vec![
            DONE,
            INPUT,
            USAGE,
            METHOD,
            (4, "a check failed, outputs are there"),
            OUTPUT,
            (75, "worth a retry"),
            STOPPED,
        ],
        "run" | "demo" => {
            let done = (0, "done: the verdict is green or amber");
            vec![done, INPUT, USAGE, METHOD, (4, judged), OUTPUT, RETRY, STOPPED]
        }
        "batch" => vec![
            (0, "all ended with a verdict that is green or amber"),
            (1, "the cases or their table cannot be used"),
            USAGE,
            (3, "some failed"),
            (4, "none failed, and some must not be used"),
            OUTPUT,
            (75, "all that failed are worth a retry"),
            STOPPED,
        ],
        "open" => {
            vec![(0, "ended by Ctrl-C, or after twelve hours without a page"), INPUT, USAGE, RETRY]
        }
        "inspect" => {
            let none = (1, "nothing there can be used");
            vec![(0, "there is a series that can be used"), none, USAGE, RETRY, STOPPED]
        }
        "check" => {
            let not = (1, "it cannot be run: the message names file, slice or key");
            vec![(0, "the case can be run"), not, USAGE, RETRY, STOPPED]
        }
        "init" => vec![DONE, INPUT, USAGE, OUTPUT, RETRY, STOPPED],
        "replay" => {
            let differs = (4, "the replay is not the recording");
            vec![DONE, INPUT, USAGE, METHOD, differs, OUTPUT, RETRY, STOPPED]
        }
        "send" => vec![
            (0, "all are stored, or were before"),
            (1, "some were not stored, they contradict each other, or the archive refuses"),
            USAGE,
            (4, "a run must not be used, or its files were changed: nothing was sent"),
            OUTPUT,
            NETWORK,
            STOPPED,
        ],
        "fetch" => vec![
            (0, "all that is meant is there"),
            (1, "nothing is listed, something did not come, or is not of what was asked for"),
            USAGE,
            OUTPUT,
            NETWORK,
            STOPPED,
        ],
        "verify-export" => {
            vec![(0, "all checks passed"), INPUT, USAGE, (4, "a check failed"), RETRY, STOPPED]
        }
        "provenance" => vec![DONE, INPUT, USAGE, OUTPUT],
        "schema" | "completions" | "man" | "help" => vec![DONE, USAGE, OUTPUT],
        _ => vec![DONE, INPUT, USAGE, METHOD, OUTPUT, RETRY, STOPPED],
    }
}

/// What a run leaves.
const RUN: &[&str] = &[
    "OUT/ct: the deformed CT as a DICOM series, or ct.nrrd where the CT did not come as DICOM",
    "OUT/structures.dcm: body, chest wall, breast and tumour on that series",
    "OUT/report/index.html: the report",
    "OUT/report.dcm: what it says first, as a PDF in a DICOM object, where the case asks for it",
    "OUT/summary.json: the result for scripts; supine schema summary describes it",
    "OUT/log.jsonl: what was done, a line each",
    "OUT-reidentification: the key of a de-identified run; keep it apart",
];

const CASE: &str = "case.toml: the case; supine help case lists its keys";
const RECORD: &str = "DIR/.supine-sent: what an archive has acknowledged; remove it to forget";

/// The files of a command, those that people meet first where no command is named.
pub(crate) fn files(command: &str) -> Vec<&'static str> {
    let with_case = |files: &[&'static str]| [&[CASE], files].concat();
    match command {
        "" => {
            let batch = [
                "DIR/cohort.csv, DIR/index.html: all patients of a batch beside each other",
                "DIR/runs/NAME, DIR/status/NAME.json: the run of each, and how it ended",
            ];
            [&with_case(RUN)[..], &batch].concat()
        }
        "run" | "fit" => with_case(RUN),
        "demo" => RUN.to_vec(),
        "batch" => with_case(&[
            "cases.csv: a table of cases; its head has keys of the case file and `name`",
            "OUT/runs/NAME: the run of each case, as supine run leaves it",
            "OUT/status/NAME.json: how it ended; supine schema status describes it",
            "OUT/cohort.csv, OUT/index.html: all patients beside each other",
        ]),
        "init" | "check" => vec![CASE],
        "open" => with_case(&[
            "RUN/summary.json: the result that is shown, where the folder of a run is named",
            "~/.local/state/supine/unsaved: changed cases that are in no file",
        ]),
        "mesh" | "coarsen" | "solve" => vec![
            "FILE.vtu: the mesh; point data `displacement` (mm), cell data `boundary` (1 skin, 2 chest_wall, 3 cut)",
        ],
        "warp" => vec!["FILE.vtu: the mesh with its displacement", "DIR or FILE: the deformed CT"],
        "carry" => vec!["RUN/summary.json: the run's own record, by which its files are known"],
        "navigate" => vec!["RUN/mesh/deformed.vtu: from where it begins"],
        "send" => vec![RECORD],
        "fetch" => vec!["OUT/UID.dcm: each object, by its SOP Instance UID"],
        "provenance" => vec!["RUN/summary.json: the chain of hashes that is told"],
        _ => vec![],
    }
}

/// A command line that tells its exit codes at the end of its help, and whose commands tell these
/// lists at the end of their long one.
pub(crate) fn with_lists(cli: Command) -> Command {
    let codes: Vec<String> =
        codes("").into_iter().map(|(code, text)| format!("{code} {text}")).collect();
    let cli = cli.after_help(format!("Exit codes: {}.", codes.join("; ")));
    let names: Vec<String> = cli.get_subcommands().map(|c| c.get_name().to_owned()).collect();
    names.into_iter().fold(cli, |cli, name| {
        cli.mut_subcommand(&name, |command| {
            if command.is_hide_set() {
                return command;
            }
            let examples = command.get_after_long_help().map(ToString::to_string);
            let after = [examples, Some(told(&name))].into_iter().flatten();
            command.after_long_help(after.collect::<Vec<_>>().join("\n\n"))
        })
    })
}

/// Both lists as text.
fn told(command: &str) -> String {
    let codes = codes(command).into_iter().map(|(code, text)| format!("\n  {code:<4}{text}"));
    let mut text = format!("Exit codes:{}", codes.collect::<String>());
    let files: String = files(command).into_iter().map(|file| format!("\n  {file}")).collect();
    if !files.is_empty() {
        text += &format!("\n\nFiles:{files}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::Cli;
    use clap::CommandFactory as _;

    #[test]
    fn every_command_tells_its_exit_codes_in_its_help() {
        let mut cli = with_lists(Cli::command());
        cli.build();
        let commands: Vec<Command> = cli.get_subcommands().cloned().collect();
        for mut command in commands.into_iter().filter(|command| !command.is_hide_set()) {
            let (name, help) =
                (command.get_name().to_owned(), command.render_long_help().to_string());
            assert!(help.contains("Exit codes:\n  0   "), "{name}: {help}");
            let codes = codes(&name);
            assert!(codes.is_sorted(), "{name}");
            assert!(codes.contains(&USAGE), "{name}");
        }
        let of = |name: &str| codes(name).into_iter().map(|(code, _)| code).collect::<Vec<_>>();
        assert_eq!(of("verify-export"), [0, 1, 2, 4, 75, 130]);
        assert!(!of("send").contains(&3) && of("send").contains(&4));
    }
}
