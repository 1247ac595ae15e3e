//! `supine fetch`.

use crate::End;
use crate::args_network as args;
use crate::failure::Failure;
use crate::screen::Screen;
use std::fmt::Write as _;
use supine_dicom_network::{FetchInfo, QuerySpec, StudyEntry, Way};
use supine_space::{Failure as Kind, Progress};

/// More instances that are missing than this are only counted.
const NAMED: usize = 20;

pub(crate) fn fetch(args: &args::Fetch, screen: &Screen) -> Result<End, Failure> {
    let call = args.link.call(&args.from, &args.own)?;
    if args.move_to.is_some() && call.tls.as_ref().is_some_and(|tls| !tls.can_listen()) {
        let why = "a C-MOVE with --tls is answered here: give --tls-cert and --tls-key, and the archive's \
                   certificate or its issuer's as --tls-ca";
        return Err(Failure::new(Kind::Usage, why));
    }
    let wanted = QuerySpec {
        study: args.study.clone(),
        series: args.series.clone(),
        patient_id: args.patient_id.clone(),
        date: args.date.clone(),
    };
    let watch = |share| screen.share("fetch", share);
    let progress = Progress::new(&watch);
    let Some(out) = &args.out else {
        let studies = supine_dicom_network::list(&call, &wanted, progress)?;
        let failure = studies.is_empty().then(|| {
            Failure::coded(Kind::Input, "nothing-listed", wanted.nothing_listed(&args.from))
        });
        screen.answer_but(failure.as_ref(), &studies, &table(&studies));
        return failure.map_or(Ok(End::Done), Err);
    };
    let way = match (&args.move_to, args.port) {
        (Some(title), Some(port)) => Way::Move { title: title.clone(), bind: args.bind, port },
        _ => Way::Get,
    };
    let info = supine_dicom_network::fetch(&call, &wanted, &way, out, progress)?;
    info.warnings.iter().for_each(|warning| screen.say(&format!("warning: {warning}")));
    info.strangers.iter().for_each(|strangers| screen.say(&format!("refused: {strangers}")));
    for missing in info.missing.iter().take(NAMED) {
        screen.say(&format!("missing: {missing}"));
    }
    if info.missing.len() > NAMED {
        screen.say(&format!("missing: {} more", info.missing.len() - NAMED));
    }
    let known = if info.known > 0 { format!(", {} were there", info.known) } else { String::new() };
    let text = format!("{} fetched into {}{known}", info.received, out.display());
    let failure = incomplete(&info);
    screen.result_but(failure.as_ref(), &info, &text);
    failure.map_or(Ok(End::Done), Err)
}

/// Why not all came, if not all came.
fn incomplete(info: &FetchInfo) -> Option<Failure> {
    let (left, received) = (info.missing.len(), info.received);
    if let (Some(broken), 1..) = (&info.broken, left) {
        let message =
            format!("{broken}; {received} fetched, {left} left: the same call goes on from there");
        return Some(Failure::coded(Kind::Retry, "network", message));
    }
    let strangers: usize = info.strangers.iter().map(|one| one.instances.len()).sum();
    if strangers > 0 {
        let missing = if left > 0 { format!("; {left} did not come") } else { String::new() };
        let message = format!(
            "{strangers} objects that the archive lists are not of what was asked for and were refused{missing}: \
             have it put right in the archive; the {received} that were kept are of what was asked for"
        );
        return Some(Failure::coded(Kind::Input, "objects-of-others", message));
    }
    let why = info.failed.as_ref().map(|why| format!(": {why}")).unwrap_or_default();
    let message = format!("{left} instances did not come{why}");
    (left > 0).then(|| Failure::coded(Kind::Input, "instances-missing", message))
}

/// A line for each series, under its study.
fn table(studies: &[StudyEntry]) -> String {
    let mut text = String::new();
    for StudyEntry { study, date, description, series } in studies {
        // Writing to a string cannot fail.
        let date = plain(date);
        let _infallible = writeln!(text, "study {study}\n  {date} {description:?}");
        for one in series {
            let count = one.instances.map_or_else(|| "?".to_owned(), |n| n.to_string());
            let number = Some(plain(&one.number)).filter(|number| !number.is_empty());
            let number = number.unwrap_or_else(|| "-".into());
            let (modality, description) = (plain(&one.modality), &one.description);
            let line = format!(
                "  {modality:9} number {number:>4} {count:>6} objects  {}  {description:?}",
                one.series
            );
            let _infallible = writeln!(text, "{line}");
        }
    }
    text
}

/// A short text of an archive's, without what a terminal would obey.
fn plain(text: &str) -> String {
    text.chars().filter(char::is_ascii_graphic).collect()
}
