//! Pictures, the HTML report and summary.json of a run.
