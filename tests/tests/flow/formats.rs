//! Meshes for other programs, as those read and solve them.

use crate::shared::{scratch, shared};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;
use supine_tests::{Outcome, readers_python, source, supine};

#[test]
fn one_mesh_in_four_formats_is_read_the_same() {
    let scratch = scratch();
    let rest = shared().out.join("mesh/rest.vtu");
    let coarsen = |from: &Path, out: &Path| {
        supine(&[&"coarsen", &from, &"--tetrahedra", &"800", &"--out", &out])
    };
    let files = ["a.vtu", "a.msh", "a.feb", "a.inp"].map(|name| scratch.path().join(name));
    for file in &files {
        coarsen(&rest, file).success("supine coarsen");
    }
    readers_python("formats.py", &files).success("formats.py, a mesh");
    // What was written for Gmsh is taken as a mesh again.
    let again = scratch.path().join("again.inp");
    supine(&[&"coarsen", &files[1], &"--tetrahedra", &"700", &"--out", &again])
        .success("supine coarsen a.msh");
    let said = coarsen(&rest, &scratch.path().join("b.stl"));
    assert_eq!(said.code, Some(2), "{}", said.stderr);
    assert!(said.stderr.contains(".feb"), "the endings are listed: {}", said.stderr);
}

#[test]
fn what_the_modulus_decides_is_told_and_written() {
    let scratch = scratch();
    let mesh = shared().out.join("mesh/rest.vtu");
    for name in ["a.vtu", "a.msh"] {
        let out = scratch.path().join(name);
        let said = supine(&[
            &"solve",
            &"--mesh",
            &mesh,
            &"--table",
            &"7,5",
            &"--order",
            &"1",
            &"--sensitivity",
            &"--young-interval",
            &"0.5,0.7",
            &"--json",
            &"--out",
            &out,
        ]);
        let said = said.success("supine solve --sensitivity");
        let told: serde_json::Value = serde_json::from_str(&said.stdout).unwrap();
        let most = |of: &serde_json::Value| of.as_f64().unwrap();
        let ends = &told["young_interval"]["max_displacement_mm"];
        let (low, high) = (most(&ends[0]), most(&ends[1]));
        assert!(low > most(&told["max_displacement_mm"]) && high < low, "{told}");
        let slope = most(&told["max_displacement_mm_per_kpa"]);
        assert!((slope - (low - high) / 0.2).abs() < 0.2 * slope, "{told}");
        let text = std::fs::read_to_string(&out).unwrap();
        for field in ["displacement", "displacement_per_kpa", "displacement_low_modulus"] {
            assert!(text.contains(&format!("\"{field}\"")), "{name}: {field}");
        }
    }
}

/// Half the tetrahedra of the run's mesh, which are solved in a part of the time.
fn coarse_mesh(folder: &Path) -> PathBuf {
    let (fine, mesh) = (shared().out.join("mesh/rest.vtu"), folder.join("rest.vtu"));
    supine(&[&"coarsen", &fine, &"--tetrahedra", &"500", &"--out", &mesh])
        .success("supine coarsen");
    mesh
}

#[test]
fn calculix_solves_the_problem_as_we_do() {
    let scratch = scratch();
    let to = |name: &str| scratch.path().join(name);
    let mesh = coarse_mesh(scratch.path());
    let spring = to("spring.inp");
    for order in ["1", "2"] {
        let vtu = to("spring.vtu");
        let words: [&dyn AsRef<OsStr>; 13] = [
            &"solve",
            &"--mesh",
            &mesh,
            &"--table",
            &"7,5",
            &"--order",
            &order,
            &"--cut",
            &"spring",
            &"--overwrite",
            &"--out",
            &vtu,
            &"--problem",
        ];
        supine(&[&words[..], &[&spring]].concat()).success("supine solve --problem, springs");
        let job = spring.with_extension("");
        Outcome::of(Command::new("ccx").current_dir(scratch.path()).arg(job)).success("ccx");
        readers_python("calculix.py", [&vtu, &spring.with_extension("frd")])
            .success("calculix.py, springs");
    }
    for (order, files) in [("1", ["1.vtu", "1.feb", "1.inp"]), ("2", ["2.vtu", "2.feb", "2.inp"])] {
        let [vtu, feb, inp] = files.map(to);
        let msh = vtu.with_extension("msh");
        for (out, problem) in [(&vtu, &feb), (&msh, &inp)] {
            supine(&[
                &"solve",
                &"--mesh",
                &mesh,
                &"--table",
                &"7,5",
                &"--order",
                &order,
                &"--cut",
                &"free",
                &"--out",
                out,
                &"--problem",
                problem,
            ])
            .success("supine solve --problem");
        }
        readers_python("formats.py", [&vtu, &msh, &feb, &inp]).success("formats.py, solved");
        // It leaves a file in the folder that it is started in.
        let job = inp.with_extension("");
        Outcome::of(Command::new("ccx").current_dir(scratch.path()).arg(job)).success("ccx");
        let frd = inp.with_extension("frd");
        readers_python("calculix.py", [&vtu, &frd]).success("calculix.py");
    }
    let refused = [to("u.vtu"), to("u.feb")];
    for (rest, cut, code, why) in [
        ("unloaded", "free", 2, "stress-free shape"),
        ("net", "spring", 2, "no springs between nodes and the ground; name an .inp"),
    ] {
        let said = supine(&[
            &"solve",
            &"--mesh",
            &mesh,
            &"--sitting",
            &"--rest",
            &rest,
            &"--cut",
            &cut,
            &"--out",
            &refused[0],
            &"--problem",
            &refused[1],
        ]);
        assert_eq!(said.code, Some(code), "{}", said.stderr);
        assert!(said.stderr.contains(why), "{}", said.stderr);
        assert!(!refused[1].exists());
    }
}

#[test]
fn meta_images_are_those_of_itk() {
    let scratch = scratch();
    let mesh = shared().out.join("mesh/deformed.vtu");
    let slices = source();
    let write = ["write".as_ref(), slices.as_os_str(), scratch.path().as_os_str()];
    readers_python("meta_image.py", write).success("meta_image.py write");
    let to = |name: &str| scratch.path().join(name);
    let made = [
        (source(), "a.nrrd"),
        (source(), "a.mha"),
        (to("ct.mha"), "b.nrrd"),
        (to("ct.mhd"), "c.mha"),
    ];
    for (ct, out) in &made {
        supine(&[&"warp", &"--ct", ct, &"--mesh", &mesh, &"--out", &to(out)])
            .success("supine warp");
    }
    let files = std::iter::once("same".into()).chain(made.map(|(_, out)| to(out).into_os_string()));
    readers_python("meta_image.py", files).success("meta_image.py same");
}

#[test]
fn what_cannot_be_written_is_told_before_the_work() {
    let folder = scratch();
    let at = folder.path();
    let (ct, mesh) = (source(), shared().out.join("mesh/deformed.vtu"));
    let nowhere = |name: &str| at.join("none").join(name);
    let said = supine(&[&"segment", &"--ct", &ct, &"--out", &nowhere("l.nrrd")]);
    assert_eq!(said.code, Some(5), "{}", said.stderr);
    // Not a stage was begun.
    assert_eq!(said.stderr.lines().count(), 1, "{}", said.stderr);
    for (command, file) in [("warp", "w.nrrd"), ("solve", "s.vtu")] {
        let (given, value) =
            if command == "warp" { ("--ct", ct.as_os_str()) } else { ("--table", "7,5".as_ref()) };
        let out = nowhere(file);
        let said = supine(&[&command, &given, &value, &"--mesh", &mesh, &"--out", &out]);
        assert_eq!((said.code, said.stderr.lines().count()), (Some(5), 1), "{}", said.stderr);
    }
    let said = supine(&[&"warp", &"--ct", &ct, &"--mesh", &mesh, &"--out", &at.join("w.xyz")]);
    assert_eq!(said.code, Some(2), "{}", said.stderr);
    assert!(said.stderr.contains("a CT is written as .nrrd"), "{}", said.stderr);
    let rest = shared().out.join("mesh/rest.vtu");
    let labels = shared().out.join("labels.seg.nrrd");
    let other = at.join("o.xyz");
    let calls: [&[&dyn AsRef<OsStr>]; 5] = [
        &[&"segment", &"--ct", &ct],
        &[&"solve", &"--mesh", &rest, &"--table", &"7,5"],
        &[&"coarsen", &rest, &"--tetrahedra", &"500"],
        &[&"carry", &shared().out, &labels],
        &[&"carry", &shared().out, &at.join("points.csv")],
    ];
    for call in calls {
        let said = supine(&[call, &[&"--out", &other]].concat());
        assert_eq!((said.code, said.stderr.lines().count()), (Some(2), 1), "{}", said.stderr);
        assert!(said.stderr.contains("o.xyz"), "{}", said.stderr);
    }
    let said = supine(&[&"check", &shared().case, &"--threads", &"100000"]);
    assert_eq!(said.code, Some(2), "{}", said.stderr);
    let said = supine(&[&"fit", &shared().case, &"--out", &at.join("fit")]);
    assert_eq!(said.code, Some(1), "{}", said.stderr);
    let text = std::fs::read_to_string(&shared().case).expect("a case");
    let wide: Vec<u8> =
        std::iter::once(0xfeff).chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    let other = at.join("other.toml");
    for (bytes, words) in
        [(wide, "it is UTF-16"), (b"# M\xfcller\n".to_vec(), "the byte FC in line 1")]
    {
        std::fs::write(&other, bytes).expect("it can be written");
        let said = supine(&[&"check", &other]);
        assert_eq!(said.code, Some(1), "{}", said.stderr);
        assert!(
            said.stderr.contains(words) && said.stderr.contains("save it as UTF-8"),
            "{}",
            said.stderr
        );
    }
}

#[test]
fn a_surface_in_metres_is_hinted_at_when_it_is_carried() {
    let folder = scratch();
    let given = folder.path().join("breast.obj");
    let at = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]];
    let corners = at.map(|[x, y, z]| format!("v {} {} {}\n", 0.09 + x, y - 0.25, z - 0.6));
    let text = corners.concat() + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
    std::fs::write(&given, text).expect("a surface");
    let out = folder.path().join("carried.obj");
    let said = supine(&[&"carry", &shared().out, &given, &"--out", &out]).success("supine carry");
    assert!(said.stderr.contains("is it in metres? give it in mm"), "{}", said.stderr);
}

#[test]
fn inspect_names_what_is_no_dicom() {
    let folder = scratch();
    let inspect = |name: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, "no DICOM").expect("a file");
        supine(&[&"inspect", &path])
    };
    for (name, words) in [
        ("study.zip", "unpack it"),
        ("ct.img", "two files (.hdr and .img)"),
        ("ct.nrrd", "is no DICOM, which is what `inspect` looks at"),
    ] {
        let said = inspect(name);
        assert!(said.code == Some(1) && said.stderr.contains(words), "{}", said.stderr);
    }
}
