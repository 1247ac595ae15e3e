//! Calls as people make them, at the end of the help of a command. A test reads each.

pub(crate) const INSPECT: &str = "Examples:
  supine inspect ct
  supine inspect ct/1-01.dcm --json";

pub(crate) const INIT: &str = "Examples:
  supine init ct --structures rs.dcm --tumour GTV
  supine init ct --tumour tumour.mrk.json --tumour-radius 9 --breast left";

pub(crate) const CHECK: &str = "Examples:
  supine check case.toml
  supine check case.toml --out result";

pub(crate) const RUN: &str = "Examples:
  supine run case.toml --out result
  supine run case.toml --out steeper --set table.ap=12
  supine run case.toml --out result --until segment
  supine run result/summary.json --out again";

pub(crate) const SEGMENT: &str = "Examples:
  supine segment --ct ct --out labels.seg.nrrd
  supine segment --ct ct.nrrd --out labels.nii.gz";

pub(crate) const WARP: &str = "Examples:
  supine warp --ct ct --mesh deformed.vtu --out ct_deformed
  supine warp --ct ct.nrrd --mesh deformed.vtu --out ct_deformed.nrrd";

pub(crate) const CARRY: &str = "Examples:
  supine carry result points.csv --out points_on_table.csv
  supine carry result rs.dcm --out rs_on_table.dcm";

pub(crate) const BATCH: &str = "Examples:
  supine batch p001 p002 p003 --out cohort
  supine batch cases.csv --out cohort --jobs 2
  supine batch --collect --out cohort";

pub(crate) const SEND: &str = "Examples:
  supine send result --to ARCHIVE@pacs:104";

pub(crate) const FETCH: &str = "Examples:
  supine fetch --from ARCHIVE@pacs:104 --patient-id P001 --list
  supine fetch --from ARCHIVE@pacs:104 --study 1.2.3.4 --out ct";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::Cli;
    use clap::Parser as _;

    #[test]
    fn every_example_can_be_typed() {
        let all = [INSPECT, INIT, CHECK, RUN, SEGMENT, WARP, CARRY, BATCH, SEND, FETCH];
        let calls = all.iter().flat_map(|text| text.lines()).filter(|line| line.starts_with("  "));
        for call in calls {
            if let Err(error) = Cli::try_parse_from(call.split_whitespace()) {
                panic!("{call}: {error}");
            }
        }
    }
}
