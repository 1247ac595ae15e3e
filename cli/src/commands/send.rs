//! `supine send`.

use crate::End;
use crate::args_network as args;
use crate::failure::Failure;
use crate::screen::Screen;
use std::path::Path;
use supine_dicom_network::{SendInfo, SendParams};
use supine_flow::commands::{check_there, usable::look};
use supine_space::{Failure as Kind, Progress, Warning};

/// More refused objects than this are only counted.
const NAMED: usize = 20;

pub(crate) fn send(args: &args::Send, screen: &Screen) -> Result<End, Failure> {
    args.paths.iter().try_for_each(|path| check_there(path))?;
    let call = args.link.call(&args.to, &args.from)?;
    let told = refuse_unusable(args, screen)?;
    let params = SendParams { all: args.all, again: args.again };
    let watch = |share| screen.share("send", share);
    let mut info = supine_dicom_network::send(&args.paths, &call, &params, Progress::new(&watch))?;
    info.warnings.iter().for_each(|warning| screen.say(&format!("warning: {warning}")));
    for refused in info.refused.iter().take(NAMED) {
        screen.say(&format!("not stored: {}: {}", refused.file, refused.reason));
    }
    if info.refused.len() > NAMED {
        screen.say(&format!("not stored: {} more", info.refused.len() - NAMED));
    }
    let failure = incomplete(&info);
    info.warnings.splice(0..0, told);
    screen.result_but(failure.as_ref(), &info, &describe(&info, args));
    failure.map_or(Ok(End::Done), Err)
}

/// Why not all was stored, if not all was.
fn incomplete(info: &SendInfo) -> Option<Failure> {
    if let Some(broken) = &info.broken {
        let message = format!(
            "{broken}; {} stored, {} left: the same call goes on from there",
            info.stored, info.left
        );
        return Some(Failure::coded(Kind::Retry, "network", message));
    }
    (!info.refused.is_empty()).then(|| {
        let message = format!("{} objects were not stored", info.refused.len());
        Failure::coded(Kind::Input, "objects-not-stored", message)
    })
}

/// What must not be used does not leave by habit; what was told of the rest.
fn refuse_unusable(args: &args::Send, screen: &Screen) -> Result<Vec<Warning>, Failure> {
    let looked = look(&args.paths)?;
    looked.warnings.iter().for_each(|warning| screen.say(&format!("warning: {warning}")));
    for found in looked.unusable {
        let (run, why) = (from_here(&found.path), found.why.trim_end_matches('.'));
        if found.changed {
            let message = format!(
                "{run} must not be used: {why}. Nothing was sent; run the case again, or send a changed object from a folder of its own"
            );
            return Err(Failure::coded(Kind::Check, "run-changed", message).at(&found.path));
        }
        if !args.although_not_usable {
            let message = format!(
                "{run} must not be used: {why}. Nothing was sent; --although-not-usable sends it all the same"
            );
            return Err(Failure::coded(Kind::Check, "run-not-usable", message).at(&found.path));
        }
        screen.say(&format!("warning: {run} is sent although it must not be used: {why}"));
        found.note_override(&args.to.to_string())?;
    }
    Ok(looked.warnings)
}

/// A folder as one would type it here.
fn from_here(folder: &Path) -> String {
    let here = std::env::current_dir().ok();
    let within = here.and_then(|here| folder.strip_prefix(here).ok());
    within.filter(|path| !path.as_os_str().is_empty()).unwrap_or(folder).display().to_string()
}

fn describe(info: &SendInfo, args: &args::Send) -> String {
    let mut text = format!("{} stored at {}", info.stored, args.to);
    if info.converted > 0 {
        text += &format!(", {} of them converted to Implicit VR Little Endian", info.converted);
    }
    if info.present > 0 {
        text += &format!(", {} were there already", info.present);
    }
    if let Some(known) = info.known_in_words() {
        text += &format!(", {known} (--again sends them)");
    }
    if info.foreign > 0 {
        text += &format!(", {} files are not DICOM", info.foreign);
    }
    text
}
