//! A small file as Gmsh writes it; damage.

use super::parse;
use proptest::prelude::*;
use supine_mesh::BoundaryTag;

/// One tetrahedron: nodes numbered with gaps and on entities of their own, points and lines among
/// the elements, groups by number, coordinates on a surface.
const FILE: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n\
    $PhysicalNames\n4\n2 7 \"skin\"\n2 8 \"chest_wall\"\n2 9 \"cut\"\n3 1 \"breast\"\n$EndPhysicalNames\n\
    $Entities\n1 1 3 1\n1 0 0 0 0\n1 0 0 0 3 0 0 0 0\n\
    1 0 0 0 3 3 0 1 7 0\n2 0 0 0 3 0 3 1 -8 0\n3 0 0 0 3 3 3 2 12 9 0\n1 0 0 0 3 3 3 1 1 0\n$EndEntities\n\
    $Nodes\n2 4 10 40\n2 1 1 1\n10\n0 0 0 0.5 0.5\n3 1 0 3\n20\n30\n40\n3 0 0\n0 3 0\n0 0 3\n$EndNodes\n\
    $Elements\n6 7 1 7\n0 1 15 1\n1 10\n1 1 1 1\n2 10 20\n2 1 2 1\n3 10 30 20\n2 2 2 1\n4 10 20 40\n\
    2 3 2 2\n5 10 40 30\n6 20 30 40\n3 1 4 1\n7 10 20 30 40\n$EndElements\n\
    $NodeData\n1\n\"displacement\"\n1\n0\n3\n0\n3\n4\n40 0 0 1e-3\n10 0 0 0\n20 -1 0 0\n30 0 2 0\n$EndNodeData\n";

#[test]
fn a_file_as_gmsh_writes_it_is_read() {
    let (mesh, displacement) = parse(FILE.as_bytes()).unwrap();
    assert!((mesh.total_volume() - 4.5).abs() < 1e-12);
    let areas = BoundaryTag::ALL.map(|tag| mesh.area(tag));
    assert_eq!(areas[..2], [4.5, 4.5]);
    assert!((areas[2] - 4.5 - 4.5 * 3f64.sqrt()).abs() < 1e-12);
    let values = displacement.unwrap();
    assert_eq!((values.values()[1].x, values.values()[3].z), (-1.0, 1e-3));
}

#[test]
fn what_cannot_be_used_is_named() {
    let refused = |from: &str, to: &str| {
        assert!(FILE.contains(from));
        parse(FILE.replacen(from, to, 1).as_bytes()).unwrap_err().to_string()
    };
    assert!(refused("4.1 0 8", "4.1 1 8").contains("save it as MSH 4.1, ASCII"));
    assert!(refused("4.1 0 8", "2.2 0 8").contains("save it as MSH 4.1, ASCII"));
    assert!(refused("\"cut\"", "\"sphere\"").contains("surface 3 is in no physical group"));
    assert!(refused("3 1 4 1", "3 1 5 1").contains("Gmsh's type 5"));
    assert!(refused("7 10 20 30 40", "7 10 20 30 50").contains("nodes that are not there"));
    assert!(refused("$EndNodes", "$EndNode").contains("`Nodes`: has no end"));
    assert!(refused("5 10 40 30\n6 20", "6 20").contains("line"));
    assert!(refused("$Nodes\n2 ", "$Nodes\n9999999999999 ").contains("line"));
    // A section again, behind what was read by the first one (found by fuzzing).
    let again = |section: &str| {
        let (begin, end) = (format!("${section}\n"), format!("$End{section}\n"));
        let start = FILE.find(&begin).unwrap();
        let length = FILE[start..].find(&end).unwrap() + end.len();
        parse(format!("{FILE}{}", &FILE[start..start + length]).as_bytes()).unwrap_err().to_string()
    };
    assert!(again("Nodes").contains("second section of nodes"));
    assert!(again("Elements").contains("second section of elements"));
    assert!(again("NodeData").contains("one time step"));
    let early = "$NodeData\n1\n\"displacement\"\n1\n0\n3\n0\n3\n0\n$EndNodeData\n$Nodes\n";
    let (data, _) = FILE.split_once("$NodeData").unwrap();
    let message = parse(data.replacen("$Nodes\n", early, 1).as_bytes()).unwrap_err().to_string();
    assert!(message.contains("has 0 vectors for 4 points"), "{message}");
    assert!(parse(b"solid").unwrap_err().to_string().contains("MSH 4.1"));
}

proptest! {
    #[test]
    fn damage_never_panics(at in 0..FILE.len(), with in any::<char>(), cut in 0..FILE.len()) {
        let spoiled: String = FILE.chars().enumerate().map(|(n, c)| if n == at { with } else { c }).collect();
        for text in [&spoiled[..], FILE.get(..cut).unwrap_or_default()] {
            if let Ok((mesh, _)) = parse(text.as_bytes()) {
                prop_assert!(mesh.total_volume() > 0.0);
            }
        }
    }
}
