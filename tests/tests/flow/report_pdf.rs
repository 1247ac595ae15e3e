//! The report as a PDF beside the series.

use crate::shared::{run, scratch, shared};
use supine_tests::{Case, forgotten, readers_python, tool};

#[test]
fn other_readers_find_the_report_in_its_object() {
    let scratch = scratch();
    let out = scratch.path().join("out");
    let case = Case::small().with("export", "{ pdf = true }").write(scratch.path());
    shared().begin(&out);
    run(&case, &out, 2).success("supine run");
    assert!(forgotten(&out).is_empty(), "{:?}", forgotten(&out));
    println!("{}", readers_python("report_pdf.py", [&out]).success("report_pdf.py").stdout.trim());
    let object = out.join("report.dcm");
    let said = tool("dciodvfy", ["-new".as_ref(), object.as_os_str()]);
    let text = said.stdout + &said.stderr;
    let fault = text.lines().find(|line| line.starts_with("Error") || line.starts_with("Abort"));
    assert_eq!(fault, None, "{text}");
    assert!(text.lines().any(|line| line == "EncapsulatedPDF"), "{text}");

    // Made again by itself, and on one thread.
    let before = std::fs::read(&object).expect("there is a report");
    std::fs::remove_file(&object).expect("it can be removed");
    run(&case, &out, 1).success("supine run, again");
    assert!(std::fs::read(&object).expect("it comes back") == before, "other bytes");

    // Who no longer asks for it has none.
    let case = Case::small().write(scratch.path());
    run(&case, &out, 2).success("supine run without it");
    assert!(!object.exists());
}
