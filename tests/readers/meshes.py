"""meshes.py REST DEFORMED: two VTU files, linear or quadratic, read in meshio as
docs/CONVENTIONS.md says: CT shape, tagged boundary, displacement."""

import sys

import meshio
import numpy as np
from grids import check

SKIN, CHEST_WALL, CUT = 1, 2, 3
ASKED = 1000


def volumes(points, tets):
    a, b, c, d = (points[tets[:, n]] for n in range(4))
    return np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a)) / 6


def boundary(tets):
    """The faces of exactly one tetrahedron, as sorted corners."""
    faces = np.concatenate([tets[:, f] for f in ([1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2])])
    face, count = np.unique(np.sort(faces), axis=0, return_counts=True)
    check(count.max() <= 2, "a face belongs to three tetrahedra")
    return face[count == 1]


def read(path):
    """The mesh, its tetrahedra and boundary triangles (all their nodes), and the tags."""
    mesh = meshio.read(path)
    number = {block.type: n for n, block in enumerate(mesh.cells)}
    kinds = ("tetra", "triangle") if "tetra" in number else ("tetra10", "triangle6")
    check(set(number) == set(kinds), f"{path} holds {set(number)}")
    tets, triangles = (mesh.cells[number[kind]].data for kind in kinds)
    tags = np.ravel(mesh.cell_data["boundary"][number[kinds[1]]]).astype(int)
    check(set(tags.tolist()) == {SKIN, CHEST_WALL, CUT}, f"{path}: tags {set(tags.tolist())}")
    faces = np.unique(np.sort(triangles[:, :3]), axis=0)
    check(len(faces) == len(triangles), f"{path}: a boundary face stands twice")
    check(np.array_equal(faces, boundary(tets[:, :4])), f"{path}: the triangles are no boundary")
    # Mid-side nodes lie in the middle of their edges, in the order of VTK.
    ends = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
    for n, (a, b) in zip(range(4, tets.shape[1]), ends):
        middle = (mesh.points[tets[:, a]] + mesh.points[tets[:, b]]) / 2
        check(np.abs(mesh.points[tets[:, n]] - middle).max() < 1e-9, f"{path}: mid-side node {n}")
    return mesh, tets, triangles, tags


rest, tets, _, _ = read(sys.argv[1])
check(abs(len(tets) / ASKED - 1) <= 0.05, f"{len(tets)} tetrahedra, {ASKED} asked")
smallest = volumes(rest.points, tets).min()
check(smallest > 0, f"a tetrahedron of {smallest:.3g} mm³")

deformed, again, triangles, tags = read(sys.argv[2])
check(np.array_equal(again[:, :4], tets), "the two meshes differ")
n = len(rest.points)
check(np.array_equal(deformed.points[:n], rest.points), "the points are not those of the CT shape")
u = deformed.point_data["displacement"]
check(u.shape == deformed.points.shape and np.isfinite(u).all(), f"displacement {u.shape}")
held = np.unique(triangles[tags == CHEST_WALL])
check(np.abs(u[held]).max() == 0, f"the chest wall moves by {np.abs(u[held]).max():.3g} mm")
largest = np.linalg.norm(u, axis=1).max()
check(0.5 < largest < 60, f"largest displacement {largest:.2f} mm")
smallest = volumes(deformed.points + u, again).min()
check(smallest > 0, f"a tetrahedron turns over in the operating pose: {smallest:.3g} mm³")
print(f"{len(tets)} tetrahedra, {np.bincount(tags)[1:]} faces, {largest:.2f} mm at most")
