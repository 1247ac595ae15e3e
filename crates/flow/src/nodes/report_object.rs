//! What the report says first, as a PDF beside the exported series, when the case asks for it.

use super::{Export, Import, Pictures, Report, Source};
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::work::Work;
use crate::{Error, NodeId};
use serde::Serialize;
use supine_dicom::{CompanionParams, Document, ReadParams, write_document};
use supine_space::Warning;

pub(crate) struct ReportObject;

#[derive(Serialize)]
pub(crate) struct NodeInputs {
    asked: bool,
    anonymise: bool,
}

impl Node for ReportObject {
    const ID: NodeId = NodeId::ReportObject;
    const METHOD: u32 = 3;
    const KEPT: bool = true;
    const WRITES: bool = true;
    type NodeInputs = NodeInputs;
    type Parents = (Import, Source, Export, Pictures, Report);
    type Out = ();

    fn inputs(case_state: &CaseState) -> Result<NodeInputs, Error> {
        let export = &case_state.case.export;
        Ok(NodeInputs { asked: export.pdf, anonymise: export.anonymise })
    }

    fn not_asked(inputs: &NodeInputs) -> Option<()> {
        (!inputs.asked).then_some(())
    }

    fn run(
        inputs: &NodeInputs,
        (input, named, exported, drawn, summary): Outs<Self>,
        work: &Work<'_>,
    ) -> Result<(), Error> {
        let (Some(named), Some(series)) = (named.as_ref(), &exported.series) else {
            let text = "the CT did not come as DICOM, so there is no series that the report could go with: \
                        there is no report.dcm";
            work.warn(Warning::new("no-report-object", text));
            return Ok(());
        };
        let read = work.progress.part(0.0, 0.5);
        let read = supine_dicom::read_series(series, &ReadParams::default(), read);
        let (_, ct, _) = read.map_err(Error::Export)?;
        let clock = ct.clock();
        let whose =
            input.source.as_ref().filter(|_| !inputs.anonymise).map(|source| source.whose());
        let date = clock.to_string();
        let pdf = supine_report::pdf((&summary, whose.as_ref()), &drawn.pictures, &date)?;
        work.progress.at(0.8)?;
        let document = Document {
            pdf: &pdf,
            title: "DEFORMED: report of the simulation [supine]",
            names_patient: whose.is_some(),
            source: &named.source,
        };
        let params = CompanionParams {
            series_description: "DEFORMED report of the simulation [supine]".into(),
            derivation: "DERIVED: a report on a simulated deformation. The CT:".into(),
            clock,
            before: 0,
            software_version: env!("CARGO_PKG_VERSION").into(),
        };
        let path = work.place("document")?;
        write_document(&document, &ct, &params, &path).map_err(Error::Export)?;
        work.progress.at(1.0)?;
        Ok(())
    }

    fn load(_: serde_json::Value, _: &Work<'_>) -> Result<(), Error> {
        Ok(())
    }
}
