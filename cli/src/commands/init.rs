//! `supine init`.

use crate::End;
use crate::args;
use crate::failure::Failure;
use crate::screen::Screen;
use supine_flow::commands::init::{self, InitDone};

pub(crate) fn init(args: args::Init, screen: &Screen) -> Result<End, Failure> {
    let args::Init { ct, structures, tumour, radius, breast, out, overwrite } = args;
    let breast = breast.map(Into::into);
    let given = init::Init { ct, structures, tumour, radius, breast, out, overwrite };
    let done = init::init(&given, screen)?;
    screen.result(&done, &told(&done));
    Ok(End::Done)
}

fn told(done: &InitDone) -> String {
    let mut text = done.case.display().to_string();
    if done.series.len() > 1 {
        text += "\nthe folder holds several series; choose one in the file:";
        for series in &done.series {
            text +=
                &format!("\n  {}  {} slices  {:?}", series.uid, series.slices, series.description);
        }
    }
    if done.breast_proposed {
        text += "\n`breast` was proposed from the tumour's place: check it";
    }
    let missing: Vec<String> = done.missing.iter().map(|key| format!("`{key}`")).collect();
    text + &format!(
        "\nto fill in: {}; then: supine check {}",
        missing.join(", "),
        done.case.display()
    )
}
