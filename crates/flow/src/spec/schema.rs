//! The table as a JSON schema and as the guide's table.

use super::read::{FORMER, SHORT};
use super::stroke;
use super::table::{Kind, Parameter, Preset, TABLE};
use serde_json::{Map, Value as Json, json};

/// Which format of case files the schema is of: another number where files of before no longer
/// hold.
const CASE_ID: &str = "urn:supine:schema:case:1";

/// The JSON schema (2020-12) of a case file, after its TOML is read.
pub fn case_schema() -> Json {
    let (mut properties, mut required) = (Map::new(), Vec::new());
    for parameter in TABLE {
        let (table, name) = parameter.path();
        let one = property(parameter);
        let needed = parameter.default == Preset::Required;
        let Some(table) = table else {
            properties.insert(name.into(), one);
            required.extend(needed.then_some(name));
            continue;
        };
        let inner = properties.entry(table).or_insert_with(|| {
            let either = matches!(parameter.default, Preset::RequiredOr(_));
            required.extend((needed || either).then_some(table));
            json!({ "type": "object", "additionalProperties": false, "properties": {}, "required": [] })
        });
        inner["properties"][name] = one;
        if let (true, Json::Array(list)) = (needed, &mut inner["required"]) {
            list.push(name.into());
        }
    }
    for (table, branch) in either() {
        properties[table]["oneOf"] = branch;
    }
    for short in SHORT {
        if let Some(full) = properties.remove(*short) {
            let file = full["properties"]["file"].clone();
            properties.insert((*short).into(), json!({ "anyOf": [file, full] }));
        }
    }
    // A table under its former name is as good as under its present one.
    let mut ways = Vec::new();
    for (former, now) in FORMER {
        let mut same = properties[*now].clone();
        same["deprecated"] = true.into();
        properties.insert((*former).into(), same);
        required.retain(|name| name != now);
        ways.push(json!({ "oneOf": [{ "required": [now] }, { "required": [former] }] }));
    }
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema", "$id": CASE_ID, "title": "supine case",
        "type": "object", "additionalProperties": false, "properties": properties, "required": required,
        "allOf": ways,
    })
}

/// The tables that are given in one of two ways, and what each way needs: `{ centre, radius }` or
/// `{ structure, file }`.
fn either() -> Vec<(&'static str, Json)> {
    let mut tables: Vec<(&str, [Vec<&str>; 2])> = vec![];
    for parameter in TABLE {
        let ((Some(table), name), Preset::RequiredOr(_)) = (parameter.path(), &parameter.default)
        else {
            continue;
        };
        if tables.last().is_none_or(|last| last.0 != table) {
            let others = TABLE.iter().filter(|p| p.path().0 == Some(table));
            let others = others.filter(|p| !matches!(p.default, Preset::RequiredOr(_)));
            tables.push((table, [vec![], others.map(|p| p.path().1).collect()]));
        }
        if let Some((_, [first, _])) = tables.last_mut() {
            first.push(name);
        }
    }
    let none = |names: &[&str]| -> Vec<Json> {
        names.iter().map(|name| json!({ "required": [name] })).collect()
    };
    let branch = |[one, other]: &[Vec<&str>; 2]| {
        let way = |needs: &[&str], not: &[&str]| json!({ "required": needs, "not": { "anyOf": none(not) } });
        json!([way(one, other), way(other, one)])
    };
    tables.iter().map(|(table, ways)| (*table, branch(ways))).collect()
}

fn strokes(point: &Json) -> Json {
    let [least, most] = stroke::RADIUS;
    json!({ "type": "array", "items": {
        "type": "object", "additionalProperties": false, "required": ["tissue", "radius", "points"],
        "properties": {
            "tissue": { "enum": stroke::words() },
            "radius": { "type": "number", "minimum": least, "maximum": most },
            "points": { "type": "array", "items": point, "minItems": 1 },
        },
    } })
}

fn property(parameter: &Parameter) -> Json {
    let text = json!({ "type": "string" });
    let point =
        json!({ "type": "array", "items": { "type": "number" }, "minItems": 3, "maxItems": 3 });
    // Tells keys that name files from other texts: the workflow watches these.
    let file = json!({ "type": "string", "format": "path" });
    let one_or_more = |one: &Json| json!({ "anyOf": [one, { "type": "array", "items": one }] });
    let mut schema = match parameter.kind {
        Kind::Switch => json!({ "type": "boolean" }),
        Kind::Number { min, max } => json!({ "type": "number", "minimum": min, "maximum": max }),
        Kind::Whole { min, max } => json!({ "type": "integer", "minimum": min, "maximum": max }),
        Kind::Choice(words) => json!({ "enum": words }),
        Kind::Text => text,
        Kind::File => file,
        Kind::Point => point,
        Kind::Points => json!({ "type": "array", "items": point }),
        Kind::Strokes => strokes(&point),
        Kind::Interval { min, max } => json!({
            "type": "array", "items": { "type": "number", "minimum": min, "maximum": max },
            "minItems": 2, "maxItems": 2,
        }),
        Kind::Files => one_or_more(&file),
        Kind::Names => one_or_more(&text),
    };
    let unit =
        if parameter.unit.is_empty() { String::new() } else { format!(" ({})", parameter.unit) };
    schema["description"] = format!("{}{unit}", parameter.help).into();
    let default = match parameter.default {
        Preset::Switch(on) => on.into(),
        Preset::Number(x) => x.into(),
        Preset::Whole(n) => n.into(),
        Preset::Choice(word) => word.into(),
        Preset::Required | Preset::RequiredOr(_) | Preset::Absent(_) => Json::Null,
    };
    if !default.is_null() {
        schema["default"] = default;
    }
    schema
}

/// Every key for the terminal: what it is, what it may be, what holds without it.
pub fn key_list() -> String {
    let one = |p: &Parameter| {
        format!("{}\n    {}\n    {}; {}\n", p.key, p.help, p.expected(), p.default_text())
    };
    TABLE.iter().map(one).collect()
}

/// The table of the planner's guide, in Markdown.
pub fn guide_table() -> String {
    let mut text = String::from("| key | what | value | default |\n|---|---|---|---|\n");
    for p in TABLE {
        let expected = p.expected().replace('|', "\\|");
        text += &format!("| `{}` | {} | {expected} | {} |\n", p.key, p.help, p.default_text());
    }
    text
}
