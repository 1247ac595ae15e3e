//! De-identified results.

use crate::shared::{run, scratch, shared, summary};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use supine_tests::{Case, copy_series, readers_python, source, supine, tool};

#[test]
fn nothing_of_the_patient_is_in_a_de_identified_run() {
    let folder = scratch();
    // Sites name files after patients: one that is no slice, and is told as left out.
    let (ct, _) = copy_series(folder.path());
    std::fs::write(ct.join("PHANTOM^FIXTURE.txt"), "notes").expect("a file can be written");
    // What nobody would look into, and what only eyes see.
    let typed =
        ["ConvolutionKernel=B30 FIXTURE", "BodyPartExamined=FIXTURE", "BurnedInAnnotation=YES"];
    let words = std::iter::once(ct.clone().into_os_string()).chain(typed.map(OsString::from));
    readers_python("headers.py", words).success("headers.py");
    let case = Case::small()
        .with_ct(&ct)
        .with("export", "{ anonymise = true, pdf = true }")
        .with("report", "{ seen = ['told-0123456789ab'] }");
    let case = case.write(folder.path());
    let checked = supine(&[&"check", &case]).success("supine check");
    assert!(checked.stderr.contains("text stands in its pixels"), "{}", checked.stderr);
    let out = folder.path().join("out");
    run(&case, &out, 2).success("supine run");
    let told = summary(&out);
    let reasons = told["verdict"]["reasons"].as_array().expect("reasons");
    assert!(reasons.iter().any(|reason| reason["code"] == "burned-in-text"), "{reasons:?}");
    assert!(!told.to_string().contains("0123456789ab"), "{}", told["case"]);
    std::fs::remove_file(ct.join("PHANTOM^FIXTURE.txt")).expect("it can be removed");
    let said = readers_python("identifiers.py", [&ct, &out]).success("identifiers.py");
    println!("{}", said.stdout.trim());

    readers_python("report_pdf.py", [&out, &ct]).success("report_pdf.py");

    let names = ["labels.dcm", "report.dcm", "ct/CT0001.dcm"];
    let mut objects: Vec<PathBuf> = names.map(|name| out.join(name)).into();
    for object in objects.drain(..) {
        let said = tool("dciodvfy", ["-new".as_ref(), object.as_os_str()]);
        let error = said.stderr.lines().find(|line| line.starts_with("Error"));
        assert_eq!(error, None, "{}", object.display());
    }

    // Without the key the source's patient cannot be compared; all else can.
    let checked = supine(&[&"verify-export", &out.join("ct"), &"--source", &ct]);
    let checked = checked.success("supine verify-export");
    assert!(checked.stdout.contains("----  B2"), "{}", checked.stdout);
    assert!(checked.stdout.contains("----  E4b"), "{}", checked.stdout);

    // Who the patient was is decided once: the next run does nothing anew.
    let before = std::fs::read(out.join("ct/CT0001.dcm")).expect("a slice can be read");
    let again = run(&case, &out, 2).success("supine run, again");
    assert_eq!(before, std::fs::read(out.join("ct/CT0001.dcm")).expect("a slice can be read"));
    assert!(!again.stderr.contains("PHANTOM"), "{}", again.stderr);
}

#[test]
fn objects_of_the_patient_go_with_a_de_identified_run_and_do_not_name_her() {
    let folder = scratch();
    let own = folder.path().join("of PHANTOM^FIXTURE");
    std::fs::create_dir(&own).expect("a folder can be made");
    let words = [source(), own.clone(), PathBuf::from("91.37,-248.09,-594.5")];
    readers_python("own_objects.py", words).success("own_objects.py");
    let object = |name: &str| own.join(format!("{name}.dcm"));
    let carry = ["dose", "structures", "segmentation"]
        .map(|name| format!("{name} = ['{}']", object(name).display()))
        .join(", ");
    let case = Case::small()
        .with("export", "{ anonymise = true }")
        .with("carry", &format!("{{ {carry} }}"))
        .write(folder.path());
    let out = folder.path().join("out");
    shared().begin(&out);
    run(&case, &out, 2).success("supine run");
    let summary = summary(&out);
    assert_eq!(summary["carried"].as_array().expect("what was carried").len(), 3, "{summary}");
    println!("{}", summary["carried"]);
    let pair = [&out, &object("dose"), &object("structures")];
    println!("{}", readers_python("dose_volume.py", pair).success("dose_volume.py").stdout.trim());

    // By themselves they come out the same, to the byte.
    for name in ["dose", "structures", "segmentation"] {
        let (given, again) = (object(name), out.join(format!("carried-{name}.dcm")));
        // The CT tells tissue from air.
        let said =
            supine(&[&"carry", &out, &given, &"--out", &again, &"--ct", &source(), &"--json"]);
        let said = said.success("supine carry");
        assert!(!said.stdout.to_lowercase().contains("auster"), "{}", said.stdout);
        let bytes = |path: &Path| std::fs::read(path).expect("the object is there");
        assert!(bytes(&again) == bytes(&out.join(format!("rt/{name}-1.dcm"))), "{name} differs");
        let faults = tool("dciodvfy", ["-new".as_ref(), again.as_os_str()]).stderr;
        let fault = faults.lines().find(|line| line.starts_with("Error"));
        // It ends itself on doses of 32 bits.
        assert!(fault.is_none() || name == "dose", "{name}: {fault:?}");
    }
    let list = out.join("structures.csv");
    supine(&[&"carry", &out, &object("structures"), &"--out", &list]).success("supine carry");
    let told =
        [source(), out.clone(), object("dose"), object("structures"), object("segmentation")];
    println!("{}", readers_python("identifiers.py", told).success("identifiers.py").stdout.trim());
    println!(
        "{}",
        readers_python("own_found.py", [&out, &own]).success("own_found.py").stdout.trim()
    );

    // Without the key nothing connects them, and an object of someone else is refused with it.
    let other = own.join("other.dcm");
    let words = [object("structures"), other.clone()];
    readers_python("renamed.py", words).success("renamed.py");
    let refused = |what: &Path, word: &str| {
        let said = supine(&[&"carry", &out, &what, &"--out", &out.join("x.dcm")]);
        assert_eq!(said.code, Some(1), "{}", said.stderr);
        assert!(said.stderr.contains(word) && !out.join("x.dcm").exists(), "{}", said.stderr);
    };
    refused(&other, "not that of the patient");
    let within = std::fs::read_dir(out.join(".stages")).expect("the records are there");
    assert!(within.flatten().all(|file| file.file_name() != "anonymise.key"));
    std::fs::remove_file(beside(&out).join("anonymise.key")).expect("the key can be removed");
    refused(&object("structures"), "frame of reference");
}

/// Where a run keeps what tells who the patient was.
fn beside(out: &Path) -> PathBuf {
    let name = out.file_name().expect("a run's folder has a name").to_string_lossy();
    out.with_file_name(format!("{name}-reidentification"))
}
