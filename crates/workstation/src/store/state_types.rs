//! The types of what the page is told, for the page's JavaScript: made from those here.

use super::State;
use crate::navigation::follow::Navigation;
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value};
use std::fmt::Write as _;
use std::path::Path;

/// Writes the file in place of comparing it.
const WRITE: &str = "SUPINE_WRITE_TYPES";
/// A list of no more numbers than this is told one by one.
const FEW: u64 = 4;

/// A schema as a type of TypeScript.
fn of_schema(schema: &Value) -> String {
    let Some(schema) = schema.as_object() else { return "any".into() };
    if let Some(name) = schema.get("$ref").and_then(Value::as_str) {
        return name.trim_start_matches("#/$defs/").into();
    }
    for key in ["anyOf", "oneOf"] {
        if let Some(all) = schema.get(key).and_then(Value::as_array) {
            return all.iter().map(of_schema).collect::<Vec<_>>().join(" | ");
        }
    }
    if let Some(word) = schema.get("const") {
        return word.to_string();
    }
    if let Some(words) = schema.get("enum").and_then(Value::as_array) {
        return words.iter().map(Value::to_string).collect::<Vec<_>>().join(" | ");
    }
    match schema.get("type") {
        Some(Value::Array(all)) => {
            let one = |kind: &Value| {
                let mut schema = schema.clone();
                schema.insert("type".into(), kind.clone());
                of_schema(&schema.into())
            };
            all.iter().map(one).collect::<Vec<_>>().join(" | ")
        }
        Some(Value::String(kind)) => of_kind(kind, schema),
        _ => "any".into(),
    }
}

fn of_kind(kind: &str, schema: &Map<String, Value>) -> String {
    match kind {
        "integer" | "number" => "number".into(),
        "array" => {
            let item = schema.get("items").map_or("any".into(), of_schema);
            let ends = ["minItems", "maxItems"].map(|end| schema.get(end).and_then(Value::as_u64));
            match ends {
                [Some(low), Some(high)] if low == high && low <= FEW => {
                    format!("[{}]", vec![item; low as usize].join(", "))
                }
                _ if item.contains('|') => format!("({item})[]"),
                _ => format!("{item}[]"),
            }
        }
        "object" if schema.contains_key("properties") => fields(schema, " ", " "),
        "object" => {
            let of = schema.get("additionalProperties").map_or("any".into(), of_schema);
            format!("Record<string, {of}>")
        }
        // `string`, `boolean` and `null` are called the same.
        other => other.into(),
    }
}

/// The fields of an object, each after `before`; those that may be missing with a question mark.
fn fields(schema: &Map<String, Value>, before: &str, end: &str) -> String {
    let needed = schema.get("required").and_then(Value::as_array).cloned().unwrap_or_default();
    let all = schema.get("properties").and_then(Value::as_object);
    let mut text = String::from("{");
    for (name, schema) in all.into_iter().flatten() {
        let mark = if needed.contains(&name.as_str().into()) { "" } else { "?" };
        let _infallible = write!(text, "{before}{name}{mark}: {};", of_schema(schema));
    }
    text + end + "}"
}

fn declared(name: &str, schema: &Value) -> String {
    let about = schema.get("description").and_then(Value::as_str).unwrap_or_default();
    let about = match about.replace('\n', " ") {
        about if about.is_empty() => String::new(),
        about => format!("/** {about} */\n"),
    };
    match schema.as_object().filter(|schema| schema.contains_key("properties")) {
        Some(object) => {
            format!("\n{about}export interface {name} {}\n", fields(object, "\n  ", "\n"))
        }
        None => format!("\n{about}export type {name} = {};\n", of_schema(schema)),
    }
}

/// The file with the types.
fn types() -> String {
    let settings = SchemaSettings::draft2020_12().for_serialize();
    let mut generator = settings.into_generator();
    generator.subschema_for::<Navigation>();
    let root = generator.into_root_schema_for::<State<'_>>().to_value();
    let mut text = format!(
        "// What the page is told. Made from the Rust types: {WRITE}=1 cargo test -p supine-workstation types\n"
    );
    text += &declared("State", &root);
    for (name, schema) in root["$defs"].as_object().into_iter().flatten() {
        text += &declared(name, schema);
    }
    text
}

#[test]
fn the_pages_types_are_those_of_what_it_is_told() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("types/server.d.ts");
    let wanted = types();
    if std::env::var_os(WRITE).is_some() {
        std::fs::write(&file, &wanted).unwrap();
    }
    let found = std::fs::read_to_string(&file).unwrap_or_default();
    assert!(found == wanted, "{} is of other types: {WRITE}=1 makes it anew", file.display());
}

/// Every type that the page's state takes from there is there.
#[test]
fn the_page_names_types_that_are_there() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("page/js/state.js");
    let (page, types) = (std::fs::read_to_string(page).unwrap(), types());
    let named = page.split("server.d.ts\").").skip(1);
    let names: Vec<&str> = named.filter_map(|rest| rest.split(['}', ' ']).next()).collect();
    assert!(names.len() > 10, "{names:?}");
    for name in names {
        let declared = ["interface", "type"].map(|kind| format!("export {kind} {name} "));
        assert!(declared.iter().any(|line| types.contains(line.as_str())), "{name}");
    }
}
