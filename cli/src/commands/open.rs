//! `supine open`.

use crate::End;
use crate::args;
use crate::failure::Failure;
use crate::screen::Screen;
use crate::start::start;
use serde_json::json;
use supine_flow::Observer;
use supine_workstation::{Host, Open};

pub(crate) fn open(args: &args::Open, screen: &Screen) -> Result<End, Failure> {
    let given = Open {
        path: args.path.clone().unwrap_or_else(|| ".".into()),
        look_through: args.path.is_some(),
        port: args.port.map_or(0, std::num::NonZeroU16::get),
        browser: !args.no_browser,
        nodes: args.node.clone(),
        threads: rayon::current_num_threads(),
        start: Some(start()?),
        unsaved: supine_workstation::unsaved_folder(),
    };
    let opened = supine_workstation::open(&given, screen);
    opened.map_err(|error| Failure::new(error.kind(), error.to_string()))?;
    screen.say("the page is closed");
    Ok(End::Done)
}

impl Host for Screen {
    fn address(&self, address: &str) {
        let text =
            format!("{address}\nwho has this address sees the patient; Ctrl-C ends the page");
        self.result(&json!({ "address": address }), &text);
    }

    fn no_browser(&self, why: &str) {
        self.say(&format!("no browser could be opened ({why}): open the address in one"));
    }

    fn go_on(&self) -> bool {
        Observer::go_on(self)
    }
}
