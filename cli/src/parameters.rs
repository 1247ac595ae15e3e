//! Options made from the table of parameters: their names, help and checks stand there and nowhere
//! else.

use clap::builder::{PossibleValue, TypedValueParser};
use clap::error::ErrorKind;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches};
use std::ffi::OsStr;
use std::marker::PhantomData;
use supine_flow::spec::{Kind, Parameter, Preset, TABLE, Value};
use supine_flow::{CaseError, Spec};

/// The keys of the table that a command takes.
pub(crate) trait Keys {
    /// They.
    const KEYS: &'static [&'static str];
    /// Those without which it cannot work.
    const REQUIRED: &'static [&'static str] = &[];
    /// Whether it takes the tilt of the table, `--table AP,LAT`.
    const TILT: bool = false;
    /// Options of older versions, with what is said in their place.
    const RENAMED: &'static [(&'static str, &'static str)] = &[];
}

/// Values for the keys of a command.
#[derive(Clone, Debug)]
pub(crate) struct Given<K> {
    /// The values, checked each for itself and together.
    pub(crate) spec: Spec,
    keys: PhantomData<K>,
}

const TILT: [&str; 2] = ["table.ap", "table.lat"];

fn parameters<K: Keys>() -> impl Iterator<Item = &'static Parameter> {
    K::KEYS.iter().filter_map(|key| TABLE.iter().find(|parameter| parameter.key == *key))
}

impl<K: Keys> Args for Given<K> {
    fn augment_args(command: Command) -> Command {
        let command = command.args(parameters::<K>().map(|p| argument(p, K::REQUIRED)));
        let command = if K::TILT { command.arg(table()) } else { command };
        command.args(K::RENAMED.iter().map(|(old, now)| renamed(old, now)))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<K: Keys> FromArgMatches for Given<K> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut spec = Spec::new("");
        let mut set = |key, text: &str| spec.set_typed(key, text);
        for parameter in parameters::<K>() {
            if parameter.kind == Kind::Switch {
                if matches.get_flag(parameter.key) {
                    set(parameter.key, "true").map_err(invalid)?;
                }
                continue;
            }
            let texts: Vec<&str> = matches
                .get_many::<String>(parameter.key)
                .map(|all| all.map(String::as_str).collect())
                .unwrap_or_default();
            match (texts.as_slice(), parameter.kind) {
                ([], _) => continue,
                ([one], _) => set(parameter.key, one),
                (all, Kind::Points) => set(parameter.key, &all.join(";")),
                (all, _) => set(parameter.key, &serde_json::json!(all).to_string()),
            }
            .map_err(invalid)?;
        }
        if let Some(tilt) = matches.try_get_one::<Vec<String>>("table").ok().flatten() {
            for (key, text) in TILT.into_iter().zip(tilt) {
                set(key, text).map_err(invalid)?;
            }
        }
        spec.case().map_err(invalid)?;
        Ok(Self { spec, keys: PhantomData })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// Values that contradict each other, by the option of the one that is named.
fn invalid(error: CaseError) -> clap::Error {
    let key = match &error {
        CaseError::Value { key, .. } | CaseError::Missing { key, .. } => *key,
        _ => "",
    };
    let option = TABLE.iter().find(|p| p.key == key).map(|p| format!("--{}: ", p.option));
    let message = format!("{}{error}", option.unwrap_or_default());
    clap::Error::raw(ErrorKind::ValueValidation, message)
}

/// The option of a parameter.
fn argument(parameter: &'static Parameter, required: &[&str]) -> Arg {
    let required = required.contains(&parameter.key);
    let mut help = parameter.help.to_owned();
    if let Some(first) = help.get(..1) {
        help = first.to_uppercase() + &help[1..];
    }
    if !parameter.unit.is_empty() {
        help += &format!(", {}", parameter.unit);
    }
    let silent = matches!(
        parameter.default,
        Preset::Required | Preset::RequiredOr(_) | Preset::Switch(false)
    );
    if !silent && !required {
        help += &format!(" [default: {}]", parameter.default_text().replace('"', ""));
    }
    let arg = Arg::new(parameter.key).long(parameter.option).required(required).help(help);
    let name = match parameter.kind {
        Kind::Switch => return arg.action(ArgAction::SetTrue),
        Kind::Number { .. } => "X",
        Kind::Whole { .. } => "N",
        Kind::Choice(_) => "WORD",
        Kind::Text => "TEXT",
        Kind::Point | Kind::Points => "X,Y,Z",
        Kind::Strokes => "JSON",
        Kind::Interval { .. } => "LOW,HIGH",
        Kind::File | Kind::Files => "PATH",
        Kind::Names => "NAME",
    };
    let several = matches!(parameter.kind, Kind::Files | Kind::Names | Kind::Points);
    arg.value_name(name)
        .action(if several { ArgAction::Append } else { ArgAction::Set })
        .allow_hyphen_values(!matches!(parameter.kind, Kind::File | Kind::Files | Kind::Text))
        .value_parser(Checked(parameter))
}

/// Text that is a value of a parameter.
#[derive(Clone, Copy)]
struct Checked(&'static Parameter);

impl TypedValueParser for Checked {
    type Value = String;

    fn parse_ref(
        &self,
        command: &Command,
        arg: Option<&Arg>,
        value: &OsStr,
    ) -> Result<String, clap::Error> {
        let parameter = self.0;
        let check = move |text: &str| Value::typed(parameter, text).map(|_| text.to_owned());
        check.parse_ref(command, arg, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        match self.0.kind {
            Kind::Choice(words) => Some(Box::new(words.iter().map(PossibleValue::new))),
            _ => None,
        }
    }
}

/// The tilt of the table.
fn table() -> Arg {
    let parse = |text: &str| -> Result<Vec<String>, String> {
        let parts: Vec<&str> = text.split(',').map(str::trim).collect();
        if parts.len() != TILT.len() {
            return Err("expected two tilts in degrees with a comma between: AP,LAT".into());
        }
        for (key, part) in TILT.into_iter().zip(&parts) {
            Spec::new("").set_typed(key, part).map_err(|e| e.to_string())?;
        }
        Ok(parts.into_iter().map(String::from).collect())
    };
    let help = "Tilt of the table, degrees: positive AP raises the head, positive LAT lowers the left side";
    Arg::new("table")
        .long("table")
        // What it was called before.
        .alias("bed")
        .value_name("AP,LAT")
        .allow_hyphen_values(true)
        .help(help)
        .value_parser(parse)
}

/// An option of an older version, which says what is to be typed now.
fn renamed(old: &'static str, now: &'static str) -> Arg {
    let refuse = move |_: &str| Err::<String, _>(format!("this option is called {now} now"));
    Arg::new(old).long(old).hide(true).allow_hyphen_values(true).value_parser(refuse)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{CommandFactory, Parser};

    #[derive(Clone, Debug)]
    struct All;

    impl Keys for All {
        const KEYS: &'static [&'static str] = &ALL;
        const TILT: bool = true;
    }

    /// Every key of the table.
    const ALL: [&str; TABLE.len()] = {
        let mut all = [""; TABLE.len()];
        let mut n = 0;
        while n < TABLE.len() {
            all[n] = TABLE[n].key;
            n += 1;
        }
        all
    };

    #[derive(Parser, Debug)]
    struct Words {
        #[command(flatten)]
        given: Given<All>,
    }

    /// Keys that mean something beside others only.
    const BESIDE: &[(&str, &[&str])] = &[
        ("scans.supine", &["scans.sitting"]),
        ("scans.landmarks", &["scans.sitting"]),
        ("scans.lean", &["scans.sitting"]),
        ("scans.unit", &["scans.sitting"]),
        ("table.ap", &["table.lat"]),
        ("table.lat", &["table.ap"]),
        ("tumour.centre", &["tumour.radius"]),
        ("tumour.radius", &["tumour.centre"]),
        ("tumour.structure", &["tumour.file"]),
        ("tumour.file", &["tumour.structure"]),
        ("region.centre", &["region.radius"]),
        ("region.radius", &["region.centre"]),
        ("mesh.tumour_edge", &["mesh.refine"]),
        ("mesh.tumour_growth", &["mesh.refine"]),
        ("tissue.stiffening", &["tissue.law"]),
        ("tissue.fibre_stiffening", &["tissue.fibres"]),
        ("tissue.fibre_direction", &["tissue.fibres"]),
        ("wall.shear", &["wall.hold"]),
        ("wall.radius", &["wall.hold"]),
        ("wall.centre", &["wall.hold"]),
        ("dose.at", &["dose.tolerance"]),
        ("skin.thickness", &["skin.young"]),
        ("skin.stretch", &["skin.young"]),
        ("tissue.fat", &["tissue.map"]),
        ("tissue.gland", &["tissue.map", "tissue.fat"]),
        ("tissue.skin", &["tissue.map", "tissue.fat"]),
        ("tissue.tumour", &["tissue.map", "tissue.fat"]),
        ("labels.body", &["labels.file"]),
        ("labels.soft_tissue", &["labels.file"]),
        ("labels.chest_wall", &["labels.file"]),
    ];

    /// A value that is not the default: as words of the command line, and as a case file has it.
    fn example(parameter: &Parameter) -> (Vec<String>, serde_json::Value) {
        use serde_json::json;
        let option = format!("--{}", parameter.option);
        let one = |text: &str, json| (vec![format!("{option}={text}")], json);
        let two = |a: &str, b: &str| {
            (vec![format!("{option}={a}"), format!("{option}={b}")], json!([a, b]))
        };
        match parameter.kind {
            Kind::Switch => (vec![option], json!(true)),
            Kind::Number { min, max } => {
                let x = min + (max - min) / 4.0;
                one(&x.to_string(), json!(x))
            }
            Kind::Whole { max, .. } => one(&max.to_string(), json!(max)),
            // Another mesher is not in every build.
            Kind::Choice(words) if parameter.key == "mesh.mesher" => one(words[0], json!(words[0])),
            // `tumour` where the mesh is finer.
            Kind::Choice(words) if words.len() > 2 => one(words[1], json!(words[1])),
            Kind::Choice(words) => one(words[words.len() - 1], json!(words[words.len() - 1])),
            Kind::Text if parameter.key == "export.clock" => {
                one("2026-03-01 14:05:00", json!("2026-03-01 14:05:00"))
            }
            Kind::Text => one("1.2.3", json!("1.2.3")),
            Kind::Point => one("-1,2.5,3", json!([-1.0, 2.5, 3.0])),
            Kind::Points => one("1,2,3;4,5,6", json!([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])),
            Kind::Strokes => one(
                STROKE,
                json!([{ "tissue": "erase", "radius": 6.0, "points": [[1.0, 2.0, 3.0]] }]),
            ),
            Kind::Interval { .. } => one("0.5,2", json!([0.5, 2.0])),
            Kind::File => one("/a/b.nrrd", json!("/a/b.nrrd")),
            Kind::Files => two("/a/b.csv", "/a/c.csv"),
            Kind::Names => two("a", "b"),
        }
    }

    const STROKE: &str = r#"[{"tissue":"erase","radius":6.0,"points":[[1.0,2.0,3.0]]}]"#;

    #[test]
    fn every_option_is_its_key_of_the_case_file() {
        Words::command().debug_assert();
        for key in ALL {
            let beside = BESIDE.iter().filter(|(of, _)| *of == key).flat_map(|(_, all)| *all);
            let mut words = vec!["supine".to_string()];
            let mut case = Spec::new("");
            for key in beside.copied().chain([key]) {
                let parameter = TABLE.iter().find(|p| p.key == key).unwrap();
                let (typed, value) = example(parameter);
                words.extend(typed);
                case.set(key, &value).unwrap();
            }
            let typed = Words::try_parse_from(&words).unwrap_or_else(|e| panic!("{words:?}: {e}"));
            assert_eq!(typed.given.spec.get(key), case.get(key), "{words:?}");
            assert!(case.get(key).is_some() && typed.given.spec.case().is_ok(), "{key}");
        }
    }

    #[test]
    fn a_value_out_of_range_is_told_in_the_same_words_wherever_it_came_from() {
        for parameter in TABLE {
            let Kind::Number { max, .. } = parameter.kind else { continue };
            let too_large = max * 2.0 + 1.0;
            let word = format!("--{}={too_large}", parameter.option);
            let typed = Words::try_parse_from(["supine", &word]).unwrap_err().to_string();
            let case = Spec::new("").set(parameter.key, &too_large.into()).unwrap_err().to_string();
            assert!(typed.contains(&case), "{typed} without {case}");
        }
    }
}
