//! The chain of a run as W3C PROV-JSON (Member Submission of 24 April 2013), which provenance tools
//! of neuroimaging read.
//!
//! A result of a stage is an entity, named by the hash that it is known by; the stage's work is an
//! activity, which used the results that it was made from. The files that were read and those that
//! were written are entities of the whole run.

use crate::summary::{Link, Summary};
use serde_json::{Map, Value, json};

/// A document of PROV-JSON; records by their kind.
struct Document {
    records: Map<String, Value>,
    relations: usize,
}

impl Document {
    fn add(&mut self, kind: &str, name: &str, record: Value) {
        let of_kind = self.records.entry(kind).or_insert_with(|| json!({}));
        of_kind[name] = record;
    }

    /// A relation, which needs a name of its own.
    fn relate(&mut self, kind: &str, [(from, this), (to, that)]: [(&str, &str); 2]) {
        self.relations += 1;
        let name = format!("_:r{}", self.relations);
        self.add(kind, &name, json!({ format!("prov:{from}"): this, format!("prov:{to}"): that }));
    }
}

/// The provenance of a run: what was read, what each stage made from what, and what was written,
/// each with its hash (BLAKE3, hexadecimal).
pub fn provenance(summary: &Summary) -> Value {
    let mut document = Document { records: Map::new(), relations: 0 };
    let id = summary.id.as_deref().unwrap_or("run");
    document.records.insert(
        "prefix".into(),
        json!({ "supine": "urn:supine:terms:", "run": format!("urn:supine:run:{id}:") }),
    );
    tool(&mut document, summary);
    files(&mut document, summary);
    for link in &summary.chain {
        stage(&mut document, summary, link);
    }
    Value::Object(document.records)
}

const RUN: &str = "run:whole";
const TOOL: &str = "supine:program";

/// The program, and the run as a whole.
fn tool(document: &mut Document, summary: &Summary) {
    let software = json!({ "$": "prov:SoftwareAgent", "type": "prov:QUALIFIED_NAME" });
    let version = &summary.tool.version;
    document.add(
        "agent",
        TOOL,
        json!({ "prov:type": software, "prov:label": summary.tool.name, "supine:version": version }),
    );
    let mut run = json!({
        "prov:label": "run",
        "supine:case": Value::from(summary.case.clone()).to_string(),
        "supine:verdict": summary.verdict.colour,
        "supine:seconds": summary.run.total_seconds,
        "supine:threads": summary.run.threads,
    });
    if let Some(started) = &summary.run.started {
        run["prov:startTime"] = started.replace(' ', "T").into();
    }
    document.add("activity", RUN, run);
    document.relate("wasAssociatedWith", [("activity", RUN), ("agent", TOOL)]);
}

/// What was read and what was written.
fn files(document: &mut Document, summary: &Summary) {
    for (n, input) in summary.inputs.iter().enumerate() {
        let name = format!("run:input-{}", n + 1);
        let what = json!({
            "prov:label": input.role, "supine:form": input.form, "supine:files": input.files, "supine:blake3": input.blake3,
        });
        document.add("entity", &name, what);
        document.relate("used", [("activity", RUN), ("entity", &name)]);
    }
    for (n, output) in summary.outputs.iter().enumerate() {
        let name = format!("run:output-{}", n + 1);
        let derived = "derived: simulated, not acquired";
        let what = json!({
            "prov:label": output.path, "supine:blake3": output.blake3, "supine:status": derived,
        });
        document.add("entity", &name, what);
        document.relate("wasGeneratedBy", [("entity", &name), ("activity", RUN)]);
    }
}

/// What a stage made, and from what.
fn stage(document: &mut Document, summary: &Summary, link: &Link) {
    let (result, work) = (result(link), format!("run:stage-{}", link.stage));
    let mut made = json!({ "prov:label": link.stage, "supine:key": link.key });
    if let Some(value) = &link.value {
        made["supine:value"] = value.as_str().into();
    }
    document.add("entity", &result, made);
    let time = summary.run.stages.iter().find(|time| time.name == link.stage);
    let mut activity = json!({ "prov:label": link.stage });
    if let Some(time) = time {
        activity["supine:seconds"] = time.seconds.into();
        activity["supine:cached"] = time.cached.into();
    }
    document.add("activity", &work, activity);
    document.relate("wasGeneratedBy", [("entity", &result), ("activity", &work)]);
    document.relate("wasAssociatedWith", [("activity", &work), ("agent", TOOL)]);
    document.relate("wasStartedBy", [("activity", &work), ("starter", RUN)]);
    for parent in &link.parents {
        // A result is known by the hash of its content where there is one, else by its key.
        let known = |of: &&Link| of.value.as_ref().unwrap_or(&of.key) == parent;
        if let Some(parent) = summary.chain.iter().find(known) {
            let parent = self::result(parent);
            document.relate("used", [("activity", &work), ("entity", &parent)]);
            document
                .relate("wasDerivedFrom", [("generatedEntity", &result), ("usedEntity", &parent)]);
        }
    }
}

/// The name of what a stage made.
fn result(link: &Link) -> String {
    format!("run:result-{}", link.stage)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::summary::tests::example;

    #[test]
    fn the_chain_is_told_with_every_hash() {
        let mut summary = example();
        let key = summary.chain[0].key.clone();
        let made =
            Link { stage: "prepare".into(), key: "1e".repeat(32), value: None, parents: vec![key] };
        summary.chain.push(made);
        let told = provenance(&summary);
        for link in &summary.chain {
            let entity = &told["entity"][format!("run:result-{}", link.stage)];
            assert_eq!(entity["supine:key"], link.key.as_str());
        }
        let hashes = summary.inputs.iter().map(|i| &i.blake3);
        let text = told.to_string();
        for hash in hashes.chain(summary.outputs.iter().map(|o| &o.blake3)) {
            assert!(text.contains(hash.as_str()));
        }
        let derived = told["wasDerivedFrom"].as_object().map_or(0, Map::len);
        let parents: usize = summary.chain.iter().map(|link| link.parents.len()).sum();
        assert_eq!(derived, parents, "every parent is a result of the chain");
    }
}
