//! Files and folders that break readers.

use crate::shared::scratch;
use supine_tests::{readers_python, root, supine_command, tool};

#[test]
fn public_odd_files_are_read_as_others_read_them_or_refused_by_name() {
    let given = root().join("../shared/real/awkward");
    if !given.is_dir() {
        println!("left out: there is no {}", given.display());
        return;
    }
    let files = scratch();
    let packed = given.join("awkward.tar.zst");
    let unpack = [
        "--zstd".as_ref(),
        "-xf".as_ref(),
        packed.as_os_str(),
        "-C".as_ref(),
        files.path().as_os_str(),
    ];
    tool("tar", unpack).success("tar");
    let supine = supine_command().get_program().to_owned();
    let (table, page) = (given.join("TABLE.csv"), root().join("docs/HAZARDS.md"));
    let arguments = [supine, files.path().into(), table.into(), page.into()];
    let said = readers_python("awkward.py", arguments).success("awkward.py");
    println!("{}", said.stdout.lines().last().unwrap_or_default());
}
