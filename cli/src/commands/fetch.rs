//! `supine fetch`.

use crate::args_network as args;
use crate::failure::Failure;
use crate::screen::{Screen, data};
use std::fmt::Write as _;
use std::time::Duration;
use supine_dicom_network::{Call, StudyEntry, Wanted, Way};
use supine_space::Progress;

/// More instances that are missing than this are only counted.
const NAMED: usize = 20;

pub(crate) fn fetch(args: &args::Fetch, screen: &Screen) -> Result<u8, Failure> {
    let call = Call {
        peer: args.from.clone(),
        own: args.own.clone(),
        tls: args.secure.tls()?,
        timeout: Duration::from_secs(args.patience.timeout.get().into()),
        retries: args.patience.retries,
    };
    if args.move_to.is_some() && call.tls.as_ref().is_some_and(|tls| !tls.can_listen()) {
        let why = "a C-MOVE with --tls is answered here: give --tls-cert and --tls-key, and the archive's \
                   certificate or its issuer's as --tls-ca";
        return Err(Failure::usage(why));
    }
    let wanted = Wanted {
        study: args.study.clone(),
        series: args.series.clone(),
        patient_id: args.patient_id.clone(),
        date: args.date.clone(),
    };
    let watch = |share| screen.share("fetch", share);
    let progress = Progress::new(&watch);
    let Some(out) = &args.out else {
        let studies = supine_dicom_network::list(&call, &wanted, progress)?;
        screen.clear();
        if screen.json {
            screen.result(&studies, "");
        } else {
            data(&table(&studies));
        }
        return if studies.is_empty() {
            Err(Failure::input(format!("{} lists nothing of that", args.from)))
        } else {
            Ok(0)
        };
    };
    let way = match (&args.move_to, args.port) {
        (Some(title), Some(port)) => Way::Move { title: title.clone(), bind: args.bind, port },
        _ => Way::Get,
    };
    let info = supine_dicom_network::fetch(&call, &wanted, &way, out, progress)?;
    screen.warn_all(&info.warnings);
    for missing in info.missing.iter().take(NAMED) {
        screen.say(&format!("missing: {missing}"));
    }
    if info.missing.len() > NAMED {
        screen.say(&format!("missing: {} more", info.missing.len() - NAMED));
    }
    let known = if info.known > 0 { format!(", {} were there", info.known) } else { String::new() };
    let text = format!("{} fetched into {}{known}", info.received, out.display());
    screen.result(&info, &text);
    let left = info.missing.len();
    match &info.broken {
        _ if left == 0 => Ok(0),
        Some(broken) => {
            let received = info.received;
            let message = format!(
                "{broken}; {received} fetched, {left} left: the same call goes on from there"
            );
            Err(Failure { code: 75, message })
        }
        None => Err(Failure::input(format!("{left} instances did not come"))),
    }
}

/// A line for each series, under its study.
fn table(studies: &[StudyEntry]) -> String {
    let mut text = String::new();
    for StudyEntry { study, date, description, series } in studies {
        // Writing to a string cannot fail.
        let _infallible = writeln!(text, "study {study}\n  {date} {description:?}");
        for one in series {
            let count = one.instances.map_or_else(|| "?".to_owned(), |n| n.to_string());
            let (modality, description) = (&one.modality, &one.description);
            let line = format!("  {modality:9} {count:>6}  {}  {description:?}", one.series);
            let _infallible = writeln!(text, "{line}");
        }
    }
    text
}
