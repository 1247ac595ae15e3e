use super::*;
use proptest::prelude::*;

const FILES: [&[u8]; 7] = [
    include_bytes!("../../tests/data/meshio_ascii.vtu"),
    include_bytes!("../../tests/data/meshio_plain.vtu"),
    include_bytes!("../../tests/data/meshio_zlib.vtu"),
    include_bytes!("../../tests/data/pyvista_quadratic.vtu"),
    include_bytes!("../../tests/data/pyvista_ascii.vtu"),
    include_bytes!("../../tests/data/vtk_appended_raw.vtu"),
    include_bytes!("../../tests/data/vtk_appended_base64.vtu"),
];

/// A text file with one passage replaced.
fn replaced(file: usize, from: &str, to: &str) -> String {
    let text = std::str::from_utf8(FILES[file]).unwrap();
    assert!(text.contains(from), "{from} in {text}");
    let changed = text.replacen(from, to, 1);
    match parse(changed.as_bytes()) {
        Ok(_) => "taken".into(),
        Err(problem) => problem.to_string(),
    }
}

#[test]
fn unusable_meshes_are_refused_by_name() {
    let refused = [
        (0, "UnstructuredGrid\"", "PolyData\"", "a VTK file of type `PolyData`"),
        (
            0,
            "Name=\"boundary\"",
            "Name=\"tag\"",
            "`boundary`: is missing: CellData holds only `tag`",
        ),
        (0, "NumberOfPoints=\"8\"", "NumberOfPoints=\"999999999999999999\"", "`Points`: holds 24"),
        (
            0,
            "NumberOfCells=\"18\"",
            "NumberOfCells=\"17\"",
            "`types`: holds 18 values instead of 17",
        ),
        (0, "VTKFile", "VTK", "malformed XML"),
        (0, "NumberOfComponents=\"3\"", "NumberOfComponents=\"x\"", "`NumberOfComponents`"),
        (
            2,
            "vtkZLibDataCompressor",
            "vtkLZ4DataCompressor",
            "the compression `vtkLZ4DataCompressor`",
        ),
        (3, "<Points>", "<Dots>", "malformed XML"),
        (4, "format=\"ascii\"", "format=\"other\"", "the format `other` is unknown"),
    ];
    for (file, from, to, expected) in refused {
        let message = replaced(file, from, to);
        assert!(message.contains(expected), "{to}: {message}");
    }
    assert!(parse(b"").unwrap_err().to_string().contains("VTK XML"));
    assert!(parse(b"<a/>").unwrap_err().to_string().contains("VTK XML"));
}

/// The first cells of a text file changed.
#[test]
fn cells_that_cannot_be_are_refused() {
    let file = |types: &str, connectivity: &str, offsets: &str, boundary: &str, last: &str| {
        let array = |kind: &str, name: &str, data: &str| {
            format!(
                "<DataArray type=\"{kind}\" Name=\"{name}\" format=\"ascii\">{data}</DataArray>"
            )
        };
        let text = format!(
            "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"4\" \
             NumberOfCells=\"5\"><Points>{}</Points><Cells>{}{}{}</Cells><CellData>{}</CellData>\
             </Piece></UnstructuredGrid></VTKFile>",
            array("Float64", "P", &format!("0 0 0 1 0 0 0 1 0 0 0 {last}")),
            array("UInt8", "types", types),
            array("Int32", "connectivity", connectivity),
            array("Int32", "offsets", offsets),
            array("UInt8", "boundary", boundary),
        );
        match parse(text.as_bytes()) {
            Ok((mesh, displacement)) => {
                assert!(displacement.is_none());
                format!("{} faces", mesh.boundary().len())
            }
            Err(problem) => problem.to_string(),
        }
    };
    let (types, offsets, tags) = ("10 5 5 5 5", "4 7 10 13 16", "0 1 2 3 1");
    let cells = "0 1 2 3 0 1 2 0 1 3 1 2 3 0 2 3";
    assert_eq!(file(types, cells, offsets, tags, "1"), "4 faces");
    for (got, expected) in [
        (file("12 5 5 5 5", cells, offsets, tags, "1"), "cell 0, of VTK type 12"),
        (file("10 5 5 5 3", cells, offsets, tags, "1"), "1 faces of the mesh's surface"),
        (file("5 5 5 5 5", cells, offsets, tags, "1"), "cell 0 has 4 points instead of 3"),
        (file("1 5 5 5 5", cells, offsets, tags, "1"), "there are no tetrahedra"),
        (file("24 5 5 5 5", cells, offsets, tags, "1"), "4 points instead of 10"),
        (file(types, "0 1 2 4 0 1 2 0 1 3 1 2 3 0 2 3", offsets, tags, "1"), "cell 0 has no such"),
        (file(types, "0 1 2 -3 0 1 2 0 1 3 1 2 3 0 2 3", offsets, tags, "1"), "cell 0 has no such"),
        (file(types, cells, "4 7 10 13 99", tags, "1"), "cell 4 has no such points"),
        (file(types, cells, "4 3 10 13 16", tags, "1"), "cell 1 has no such points"),
        (file(types, cells, offsets, "0 1 2 3 7", "1"), "`boundary`: is 7 on triangle cell 4"),
        (file(types, cells, offsets, "0 1 2 3 0", "1"), "`boundary`: is 0 on triangle cell 4"),
        (file(types, cells, offsets, tags, "-1"), "flat or inverted"),
        (file(types, cells, offsets, tags, "nan"), "not finite"),
        (file(types, cells, offsets, tags, "x"), "`x` is not a number"),
        (file(types, cells, offsets, "1.5 1 1 1 1", "1"), "`1.5` is not a number"),
    ] {
        assert!(got.contains(expected), "{got}");
    }
}

#[test]
fn a_file_cut_anywhere_gives_an_error_or_the_same_mesh() {
    for file in FILES {
        let whole = parse(file).unwrap();
        for end in 0..file.len() {
            if let Ok(part) = parse(&file[..end]) {
                // Only closing tags may be missing.
                assert_eq!(part.0, whole.0, "cut at {end} of {}", file.len());
            }
        }
    }
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic(
        file in 0..FILES.len(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
    ) {
        let mut bytes = FILES[file].to_vec();
        for (at, value) in changes {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        let _ = parse(&bytes);
    }

    #[test]
    fn no_number_of_a_tag_makes_it_panic(
        file in 0..FILES.len(),
        at in any::<prop::sample::Index>(),
        digits in "[-0-9]{1,20}",
    ) {
        let mut bytes = FILES[file].to_vec();
        let numbers: Vec<usize> =
            (0..bytes.len()).filter(|&n| bytes[n].is_ascii_digit()).collect();
        let at = numbers[at.index(numbers.len())];
        bytes.splice(at..=at, digits.bytes());
        let _ = parse(&bytes);
    }
}
