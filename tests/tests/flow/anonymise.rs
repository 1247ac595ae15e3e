//! De-identified results.

use crate::shared::{run, scratch};
use supine_tests::{Case, copy_series, readers_python, supine, tool};

#[test]
fn nothing_of_the_patient_is_in_a_de_identified_run() {
    let folder = scratch();
    // Sites name files after patients: one that is no slice, and is told as left out.
    let (ct, _) = copy_series(folder.path());
    std::fs::write(ct.join("PHANTOM^FIXTURE.txt"), "notes").expect("a file can be written");
    let case = Case::small().with_ct(&ct).with("export", "{ anonymise = true }");
    let case = case.write(folder.path());
    let out = folder.path().join("out");
    run(&case, &out, 2).success("supine run");
    std::fs::remove_file(ct.join("PHANTOM^FIXTURE.txt")).expect("it can be removed");
    let said = readers_python("identifiers.py", [&ct, &out]).success("identifiers.py");
    println!("{}", said.stdout.trim());

    let mut objects = vec![out.join("labels.dcm"), out.join("ct/CT0001.dcm")];
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
