//! What can be typed about many cases at once.

use crate::cli_values::stages;
use crate::examples;
use clap::Args;
use std::ffi::OsString;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use supine_flow::commands::Colour;
use supine_flow::commands::run::Change;
use supine_flow::{NodeId, Options, Start};

/// Each case is run in DIR/runs/NAME, and DIR/status/NAME.json tells how that ended (schema word
/// supine-status/1). DIR/cohort.csv and DIR/index.html show all patients of DIR beside each other.
/// What is finished is not done again: the same call goes on where it was ended. A case that fails
/// ends itself alone.
///
/// On stdout is one line of JSON for each case as it ends: what its status file holds.
#[derive(Args, Debug)]
#[command(
    after_long_help = format!(
        "{}\n\n{}",
        examples::BATCH,
        "Exit codes: 0 all ended as `run` ends with 0; 3 some failed; 75 some failed, and all that did are worth a \
retry; 4 none failed, and some must not be used (red; with --deny-warnings amber too); 130 stopped; 1, 2, 5 nothing was run: the \
cases, the options or DIR are wrong. With --collect 0 whatever the cases' states say.\n\n\
A table: its head has the keys of the case file (`supine help case`), such as ct, breast, table.ap, tumour.centre, and a column name, \
which names the runs; an empty cell gives nothing; paths lead from the table's folder. A column case names a case file whose values the \
other columns change.\n\n\
With --anonymise the names of cases stay: name them by numbers. The keys to who they are lie in DIR/runs/NAME-reidentification; \
take them out before DIR is passed on."
    )
)]
pub(crate) struct Batch {
    /// Case files, folders that hold case.toml, or tables of cases (.csv)
    #[arg(value_name = "CASE", required_unless_present = "collect", conflicts_with = "collect")]
    pub(crate) cases: Vec<PathBuf>,
    /// Where all results go
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Cases at once [default: as many as there are cores]; memory may allow fewer
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<NonZeroUsize>,
    /// Memory for all cases together, GB [default: 80 % of what the machine has available now]; one
    /// case always runs
    #[arg(long, value_name = "GB", value_parser = gigabytes)]
    pub(crate) memory: Option<u64>,
    /// Another value for a key of every case, as for `run`
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) changes: Vec<Change>,
    /// Take the patients out of all that leaves (PS3.15), as `export = { anonymise = true }` does
    #[arg(long)]
    pub(crate) anonymise: bool,
    /// End each case after this stage
    #[arg(long, value_name = "STAGE", value_parser = stages())]
    pub(crate) until: Option<NodeId>,
    /// Replace finished results of other cases in DIR/runs; without, a case whose name had another
    /// CT is refused
    #[arg(long)]
    pub(crate) overwrite: bool,
    /// Count a case as not usable unless its verdict is green
    #[arg(long)]
    pub(crate) deny_warnings: bool,
    /// Run nothing: make table and page anew of the states and runs that DIR holds
    #[arg(long, conflicts_with_all = ["jobs", "memory", "changes", "anonymise", "until"])]
    pub(crate) collect: bool,
}

impl Batch {
    /// What is asked, with so many threads for all together.
    pub(crate) fn given(self, cores: usize, start: Start) -> supine_flow::batch::Batch {
        supine_flow::batch::Batch {
            worst: self.worst(),
            cases: self.cases,
            out: self.out,
            jobs: self.jobs.map(NonZeroUsize::get),
            memory: self.memory,
            cores,
            changes: self.changes,
            anonymise: self.anonymise,
            options: Options { until: self.until, overwrite: self.overwrite, ..Options::default() },
            start: Some(start),
        }
    }

    /// The worst verdict that does.
    pub(crate) fn worst(&self) -> Colour {
        if self.deny_warnings { Colour::Green } else { Colour::Amber }
    }

    /// The words that say the same of each case alone: all but its file, its name and what is
    /// shared out among the cases.
    pub(crate) fn words(&self) -> Vec<OsString> {
        // In one word, as a folder may begin with a hyphen.
        let mut out = OsString::from("--out=");
        out.push(&self.out);
        let mut words = vec![out];
        words.extend(self.changes.iter().map(|c| format!("--set={}={}", c.key, c.value).into()));
        if let Some(until) = self.until {
            words.extend(["--until".into(), until.name().into()]);
        }
        let switches = [
            ("--anonymise", self.anonymise),
            ("--overwrite", self.overwrite),
            ("--deny-warnings", self.deny_warnings),
        ];
        words.extend(switches.into_iter().filter(|(_, on)| *on).map(|(word, _)| word.into()));
        words
    }
}

/// What one case of a batch is run with, in a process of its own.
#[derive(Args, Debug)]
pub(crate) struct BatchCase {
    /// Name of the case
    #[arg(long)]
    pub(crate) name: String,
    /// The same as of the batch, with the one file of the case
    #[command(flatten)]
    pub(crate) batch: Batch,
}

/// Memory in GB, as bytes.
fn gigabytes(text: &str) -> Result<u64, String> {
    let gb: Option<f64> = text.trim().parse().ok();
    let gb = gb.filter(|gb| *gb > 0.0 && *gb < 1e6);
    gb.map(|gb| (gb * 1e9) as u64).ok_or_else(|| "expected a number of GB, such as 16".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(clap::Parser)]
    struct Words {
        #[command(flatten)]
        batch: Batch,
    }

    #[test]
    fn a_case_alone_is_given_what_its_batch_was() {
        let parse = |words: &[OsString]| {
            let first: [OsString; 2] = ["supine".into(), "p1.toml".into()];
            <Words as clap::Parser>::parse_from(first.iter().chain(words)).batch
        };
        let all = "--out o --set table.ap=5 --set tumour.centre=-1,2,3 --until mesh --anonymise --overwrite --deny-warnings";
        for said in [all, "--out=-o"] {
            let words: Vec<OsString> = said.split(' ').map(OsString::from).collect();
            let batch = parse(&words);
            let again = parse(&batch.words());
            assert_eq!(format!("{again:?}"), format!("{batch:?}"));
        }
    }

    #[test]
    fn memory_is_given_in_gigabytes() {
        assert_eq!(gigabytes("1.5"), Ok(1_500_000_000));
        assert!(gigabytes("0").is_err() && gigabytes("16GB").is_err());
    }
}
