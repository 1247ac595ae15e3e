//! What can be typed about many cases at once.

use crate::words::stage;
use clap::Args;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use supine_flow::NodeId;
use supine_flow::commands::run::Change;

/// Each case is run in DIR/runs/NAME, and DIR/status/NAME.json tells how that ended (schema word supine-status/1). DIR/cohort.csv and
/// DIR/index.html show all patients of DIR beside each other. What is finished is not done again: the same call goes on where it was
/// ended. A case that fails ends itself alone.
///
/// On stdout is one line of JSON for each case as it ends: what its status file holds.
#[derive(Args, Debug)]
#[command(
    after_long_help = "Exit codes: 0 all ended as `run` ends with 0; 3 some failed; 75 some failed, and all that did are worth a \
retry; 4 none failed, and some must not be used (red; with --deny-warnings amber too); 130 stopped; 1, 2, 5 nothing was run: the \
cases, the options or DIR are wrong. With --collect 0 whatever the cases' states say.\n\n\
A table: its head has the keys of the case file (`supine help case`), such as ct, breast, bed.ap, tumour.centre, and a column name, \
which names the runs; an empty cell gives nothing; paths lead from the table's folder. A column case names a case file whose values the \
other columns change.\n\n\
With --anonymise the names of cases stay: name them by numbers. The keys to who they are lie in DIR/runs/NAME-reidentification; \
take them out before DIR is passed on."
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
    /// Memory for all cases together, GB [default: 80 % of what the machine has available now]; one case always runs
    #[arg(long, value_name = "GB", value_parser = gigabytes)]
    pub(crate) memory: Option<u64>,
    /// Another value for a key of every case, as for `run`
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) changes: Vec<Change>,
    /// Take the patients out of all that leaves (PS3.15), as `export = { anonymise = true }` does
    #[arg(long)]
    pub(crate) anonymise: bool,
    /// End each case after this stage
    #[arg(long, value_name = "STAGE", value_parser = stage)]
    pub(crate) until: Option<NodeId>,
    /// Replace finished results of other cases in DIR/runs; without, a case whose name had another CT is refused
    #[arg(long)]
    pub(crate) overwrite: bool,
    /// Count a case as not usable unless its verdict is green
    #[arg(long)]
    pub(crate) deny_warnings: bool,
    /// Run nothing: make table and page anew of the states and runs that DIR holds
    #[arg(long, conflicts_with_all = ["jobs", "memory", "changes", "anonymise", "until"])]
    pub(crate) collect: bool,
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

    #[test]
    fn memory_is_given_in_gigabytes() {
        assert_eq!(gigabytes("1.5"), Ok(1_500_000_000));
        assert!(gigabytes("0").is_err() && gigabytes("16GB").is_err());
    }
}
