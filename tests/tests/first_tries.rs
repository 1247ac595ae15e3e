//! What people try first and what they are told: the table of docs/FIRST_TRIES.md, made by the
//! program itself.
//!
//! With `SUPINE_WRITE_FIRST_TRIES=1` the page is written anew.
#![expect(clippy::disallowed_methods, reason = "the tests make what is wrong")]

use std::fs;
use std::path::Path;
use supine_tests::{
    Case, Drawn, Finished, Outcome, copy_series, frame_of_reference, root, source, supine_command,
    write_structures,
};

/// A try: what is wrong, what is made of a good case, what is typed, the exit code, and the words
/// that matter.
struct Try {
    what: &'static str,
    /// Lines that take the place of those of the good case with the same first word; and files.
    case: &'static [&'static str],
    make: fn(&Path),
    typed: &'static str,
    code: i32,
    words: &'static [&'static str],
}

/// A try of `supine check` on a case with other lines.
const fn case(
    what: &'static str,
    case: &'static [&'static str],
    words: &'static [&'static str],
) -> Try {
    Try { what, case, make: nothing, typed: "check case.toml", code: 1, words }
}

fn nothing(_: &Path) {}

const GOOD: [&str; 4] = [
    "ct = 'ct'",
    "breast = \"left\"",
    "table = { ap = 7.0, lat = 5.0 }",
    "tumour = { centre = [91.4, -248.1, -594.5], radius = 9.0 }",
];

/// The mesh of the run that is there already, in its sphere.
const SMALL: [&str; 2] = [
    "mesh = { tetrahedra = 1000, order = 1 }",
    "region = { centre = [99.0, -236.5, -612.5], radius = 96.0 }",
];

const GTV: Drawn = Drawn { name: "GTV", centre: [91.37, -248.09, -594.5], radius: 9.0 };
const BY_NAME: &str = "tumour = { structure = \"GTV\", file = \"RS.dcm\" }";

static TRIES: &[Try] = &[
    case(
        "the other side",
        &["breast = \"right\""],
        &["lies on the patient's left", "the case says right"],
    ),
    case(
        "the tumour in the other breast",
        &["tumour = { centre = [-91.4, -240.0, -594.5], radius = 9.0 }"],
        &["lies on the patient's right", "the case says left"],
    ),
    case(
        "the tumour outside the CT",
        &["tumour = { centre = [91.4, -248.1, 594.5], radius = 9.0 }"],
        &["outside the CT", "z from -741 to -486"],
    ),
    case(
        "the tumour in air",
        &["tumour = { centre = [91.4, -300.0, -594.5], radius = 9.0 }"],
        &["in air or lung", "correct the centre"],
    ),
    case(
        "the tumour with the signs of RAS",
        &["tumour = { centre = [-91.4, 248.1, -594.5], radius = 9.0 }"],
        &["was it given in RAS?"],
    ),
    case("decimal commas", &["table = { ap = 7,0, lat = 5,0 }"], &["7.0, not 7,0"]),
    case(
        "decimal commas in a position",
        &["tumour = { centre = [91,4, -248,1, -594,5], radius = 9.0 }"],
        &["7.0, not 7,0"],
    ),
    case(
        "a typing error in a key",
        &["tumour =", "tumor = { radius = 9.0 }"],
        &["`tumor`", "did you mean `tumour`"],
    ),
    case("a typing error in a value", &["breast = \"lft\""], &["`breast`", "\"left\", \"right\""]),
    case("a side without quotation marks", &["breast = left"], &["case.toml"]),
    case(
        "keys that are missing",
        &["table =", "tumour ="],
        &["`table.ap`, `tumour.centre` are missing", "table = { ap = 7.0, lat = 5.0 }"],
    ),
    case(
        "a tilt out of range",
        &["table = { ap = 700.0, lat = 5.0 }"],
        &["`table.ap`", "from -180 to 180 degrees"],
    ),
    case("a folder that is not there", &["ct = 'scan'"], &["`ct`", "scan"]),
    Try {
        make: |folder| fs::create_dir(folder.join("empty")).expect("the try is set up"),
        ..case("an empty folder", &["ct = 'empty'"], &["no CT image series", "empty"])
    },
    Try {
        make: |folder| {
            fs::write(folder.join("report.pdf"), "%PDF-1.7\n").expect("the try is set up")
        },
        ..case("a PDF as the CT", &["ct = 'report.pdf'"], &["report.pdf", "not a CT image"])
    },
    case("a path of Windows elsewhere", &["ct = 'C:\\data\\ct'"], &["path of Windows"]),
    case(
        "backslashes in double quotation marks",
        &["ct = \"C:\\data\\ct\""],
        &["single quotation marks"],
    ),
    case(
        "a series that is not there",
        &["series = \"1.2.3\""],
        &["no CT series 1.2.3", "86 slices"],
    ),
    Try {
        make: two_series,
        ..case("two series in the folder", &["ct = 'two'"], &["choose one", "86 slices"])
    },
    Try {
        make: a_lost_slice,
        ..case("a slice was lost", &["ct = 'lost'"], &["gap of 6.000 mm", "IM0041"])
    },
    Try {
        make: |folder| {
            write_structures(&folder.join("RS.dcm"), &frame(), &[Drawn { name: "GTVp", ..GTV }])
        },
        ..case("a structure set without that region", &[BY_NAME], &["did you mean \"GTVp\"?"])
    },
    Try {
        make: |folder| write_structures(&folder.join("RS.dcm"), "2.25.99", &[GTV]),
        ..case("a structure set of another CT", &[BY_NAME], &["drawn on another scan"])
    },
    case(
        "a region's name without its file",
        &["tumour = { structure = \"GTV\" }"],
        &["`tumour.file` is missing"],
    ),
    Try {
        make: |folder| {
            fs::write(folder.join("clips.csv"), "clip;91,4;-248,1;-594,5\n")
                .expect("the try is set up")
        },
        ..case(
            "points that are no table",
            &["carry = { points = 'clips.csv' }"],
            &["`carry.points`", "clips.csv"],
        )
    },
    Try {
        typed: "run case.toml --out out --quiet",
        ..case(
            "seeds outside the CT",
            &["seeds = { chest_wall = [[900.0, 0.0, -600.0]] }"],
            &["chest-wall seed at [900.0, 0.0, -600.0] mm", "move or remove it"],
        )
    },
    Try {
        typed: "run case.toml --out out --quiet",
        code: 4,
        ..case(
            "a seed of the chest wall in the tumour",
            &[SMALL[0], SMALL[1], "seeds = { chest_wall = [[91.4, -248.1, -594.5]] }"],
            &[
                "RED: do not use",
                "lies in what was taken for chest wall",
                "chest-wall seed at [91.4, -248.1, -594.5] mm",
            ],
        )
    },
    Try {
        make: begun,
        typed: "run case.toml --out out --quiet",
        code: 4,
        ..case(
            "the tumour in the chest wall",
            &[SMALL[0], SMALL[1], "tumour = { centre = [81.8, -222.0, -612.5], radius = 5.0 }"],
            &["RED: do not use", "which does not move (0.0 mm)"],
        )
    },
    Try {
        make: |folder| Finished::of(&Case::small()).copy_to(&folder.join("first")),
        ..case(
            "a CT that was deformed already",
            &["ct = 'first/ct'"],
            &["deformed by this program already", "name the CT that it was made from"],
        )
    },
    Try {
        make: |folder| Finished::held().copy_to(&folder.join("first")),
        typed: "send first --to PACS@127.0.0.1:9",
        code: 4,
        ..case(
            "sending what must not be used",
            &[],
            &["must not be used", "Nothing was sent", "--although-not-usable"],
        )
    },
    Try {
        typed: "send out --to PACS",
        code: 2,
        ..case("an archive without its address", &[], &["expected AET@HOST:PORT"])
    },
    Try {
        make: begun,
        typed: "run case.toml --out out --quiet",
        ..case(
            "a region that leaves the CT",
            &["region = { centre = [99.0, -236.5, -500.0], radius = 96.0 }"],
            &["beyond the", "a radius of at most"],
        )
    },
    Try {
        make: other_labels,
        typed: "run case.toml --out out --quiet",
        ..case(
            "labels on another grid",
            &["labels = 'labels.nrrd'"],
            &["`labels`", "they are not on the CT's grid"],
        )
    },
    Try {
        make: |folder| fs::write(folder.join("out"), "a file").expect("the try is set up"),
        typed: "run case.toml --out out --quiet",
        code: 5,
        ..case("results into a file", &[], &["out"])
    },
    Try {
        make: |folder| fs::write(folder.join("file"), "a file").expect("the try is set up"),
        typed: "run case.toml --out file/out --quiet",
        code: 5,
        ..case("results where nothing can be written", &[], &["file/out"])
    },
    Try {
        typed: "run ct --out out --quiet",
        ..case("the CT as the case file", &[], &["case file ct cannot be read"])
    },
    Try {
        typed: "run case.toml",
        code: 2,
        ..case("no place for the results", &[], &["--out <DIR>"])
    },
    Try {
        typed: "check case.toml --set table.app=3",
        ..case("a typing error behind --set", &[], &["did you mean `table.ap`?"])
    },
];

/// The CT's labels and the small mesh are there already: a run that stops later than that need not
/// make them.
fn begun(folder: &Path) {
    Finished::of(&Case::small()).begin(&folder.join("out"));
}

fn frame() -> String {
    frame_of_reference(&source().join("IM0001"))
}

/// The good case with some lines in place of its own; one without a value takes its line away.
fn text(lines: &[&str]) -> String {
    let key = |line: &str| line.split(' ').next().unwrap_or_default().to_owned();
    let kept = GOOD.iter().filter(|good| !lines.iter().any(|line| key(line) == key(good)));
    let new = lines.iter().filter(|line| !line.ends_with('='));
    kept.chain(new).map(|line| format!("{line}\n")).collect()
}

/// Series Instance UID, explicit little endian.
const SERIES: [u8; 6] = [0x20, 0x00, 0x0E, 0x00, b'U', b'I'];

/// A copy of the fixture's slices.
fn copied(folder: &Path) -> (std::path::PathBuf, Vec<std::path::PathBuf>) {
    let copy = folder.join("copy");
    fs::create_dir(&copy).expect("the try is set up");
    copy_series(&copy)
}

/// The fixture's slices twice, in two series.
fn two_series(folder: &Path) {
    let (other, files) = copied(folder);
    let two = folder.join("two");
    fs::create_dir(&two).expect("the try is set up");
    for file in files {
        let name = file.file_name().expect("the try is set up").to_string_lossy().into_owned();
        let mut bytes = fs::read(&file).expect("the try is set up");
        fs::write(two.join(format!("a-{name}")), &bytes).expect("the try is set up");
        let tag = bytes.windows(6).position(|w| w == SERIES).expect("the try is set up");
        bytes[tag + 12] = if bytes[tag + 12] == b'1' { b'2' } else { b'1' };
        fs::write(two.join(format!("b-{name}")), bytes).expect("the try is set up");
    }
    fs::remove_dir_all(other).expect("the try is set up");
}

/// The fixture's slices without one.
fn a_lost_slice(folder: &Path) {
    let (ct, files) = copied(folder);
    fs::remove_file(&files[41]).expect("the try is set up");
    fs::rename(ct, folder.join("lost")).expect("the try is set up");
}

/// Labels of 4 x 4 x 4 voxels.
fn other_labels(folder: &Path) {
    let head = "NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: 4 4 4\n\
                space directions: (1,0,0) (0,1,0) (0,0,1)\nencoding: raw\nspace origin: (0,0,0)\n\n";
    fs::write(folder.join("labels.nrrd"), [head.as_bytes(), &[1; 64]].concat())
        .expect("the try is set up");
}

fn tried(one: &Try) -> Outcome {
    let scratch =
        tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).expect("a scratch folder can be made");
    let folder = scratch.path();
    std::os::unix::fs::symlink(source(), folder.join("ct")).expect("the CT can be linked");
    (one.make)(folder);
    fs::write(folder.join("case.toml"), text(one.case)).expect("the case is written");
    let said = Outcome::of(supine_command().current_dir(folder).args(one.typed.split(' ')));
    let all = format!("{}:\n{}{}", one.what, said.stdout, said.stderr);
    assert_eq!(said.code, Some(one.code), "{all}");
    one.words.iter().for_each(|word| assert!(said.stderr.contains(word), "{word:?}: {all}"));
    assert!(!said.stderr.contains(&folder.display().to_string()), "{all}");
    said
}

/// The message in one line of the table; of a verdict what the try is about, its other figures come
/// of the mechanics.
fn message(one: &Try, said: &Outcome) -> String {
    let from = said.stderr.find("error: ").map(|at| at + "error: ".len());
    let lines = said.stderr[from.unwrap_or(0)..].lines().map(str::trim);
    let about = |line: &&str| one.words.iter().any(|word| line.contains(word));
    let text = match from {
        Some(_) => lines.collect::<Vec<_>>().join(" "),
        None => lines.filter(about).collect::<Vec<_>>().join("; "),
    };
    let text = text.trim().replace('|', "\\|").replace('<', "&lt;");
    text.replace(&source().display().to_string(), "ct")
}

/// What is typed from a CT with its structure set to the first report.
const TYPED: [&str; 2] = [
    "supine init ct --structures RS.dcm --tumour GTV",
    "supine run case.toml --out out --set table.ap=7 --set table.lat=5",
];

/// Types it, and says how much that is.
fn first_report() -> String {
    let scratch =
        tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).expect("a scratch folder can be made");
    let folder = scratch.path();
    std::os::unix::fs::symlink(source(), folder.join("ct")).expect("the CT can be linked");
    write_structures(&folder.join("RS.dcm"), &frame(), &[GTV]);
    begun(folder);
    for line in TYPED {
        let words = line.split(' ').skip(1);
        Outcome::of(supine_command().current_dir(folder).args(words)).success(line);
    }
    assert!(folder.join("out/report/index.html").is_file(), "there is a report");
    let keys = |line: &str| line.chars().count() + 1;
    format!(
        "\n## From nothing to the first report\n\nIn a folder with the CT (`ct`) and its structure set (`RS.dcm`), for a \
         table of AP 7\u{b0}, LAT 5\u{b0}; typed by the same test:\n\n    {}\n    {}\n\n{} keystrokes with Enter; the report is \
         `out/report/index.html`. Without a CT of your own: `supine demo`, {} keystrokes.\n",
        TYPED[0],
        TYPED[1],
        TYPED.into_iter().map(keys).sum::<usize>(),
        keys("supine demo"),
    )
}

#[test]
fn what_people_try_first_is_answered_as_the_page_says() {
    let mut page = String::from(
        "# What people try first, and what they are told\n\nWritten by `tests/tests/first_tries.rs`: each line is a \
         try of the program, most by `supine check` on a good\ncase with one thing wrong, and its answer, word for \
         word. Exit codes: [CONVENTIONS](CONVENTIONS.md#exit-codes).\n\n| what is wrong | typed | answer | exit |\n\
         |---|---|---|---|\n",
    );
    for one in TRIES {
        let said = tried(one);
        let (what, typed, code) = (one.what, one.typed.replace(" --quiet", ""), one.code);
        page += &format!("| {what} | `supine {typed}` | {} | {code} |\n", message(one, &said));
    }
    page += &first_report();
    let path = root().join("docs/FIRST_TRIES.md");
    if std::env::var_os("SUPINE_WRITE_FIRST_TRIES").is_some() {
        fs::write(&path, &page).expect("the page is written");
    }
    let known = fs::read_to_string(&path).unwrap_or_default();
    assert!(known == page, "write the page anew with SUPINE_WRITE_FIRST_TRIES=1:\n{page}");
}
