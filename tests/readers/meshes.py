"""meshes.py FOLDER: rest.vtu and deformed.vtu read in meshio as docs/CONVENTIONS.md says."""

import sys
from pathlib import Path

import meshio
import numpy as np
from grids import check

SKIN, CHEST_WALL, CUT = 1, 2, 3


def volumes(points, tets):
    a, b, c, d = (points[tets[:, n]] for n in range(4))
    return np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a)) / 6


def faces(tets):
    """The faces of exactly one tetrahedron, as sorted points."""
    every = np.sort(np.concatenate([tets[:, [1, 2, 3]], tets[:, [0, 2, 3]], tets[:, [0, 1, 3]], tets[:, [0, 1, 2]]]))
    face, count = np.unique(every, axis=0, return_counts=True)
    check(count.max() <= 2, "a face belongs to three tetrahedra")
    return face[count == 1]


folder = Path(sys.argv[1])
rest, deformed = (meshio.read(folder / name) for name in ("rest.vtu", "deformed.vtu"))
for name, mesh in (("rest.vtu", rest), ("deformed.vtu", deformed)):
    cells = {block.type: (block.data, n) for n, block in enumerate(mesh.cells)}
    check(set(cells) == {"tetra", "triangle"}, f"{name} holds {set(cells)}")
    tets, triangles = cells["tetra"][0], cells["triangle"][0]
    tags = np.asarray(mesh.cell_data["boundary"][cells["triangle"][1]]).astype(int)
    check(set(tags.tolist()) == {SKIN, CHEST_WALL, CUT}, f"{name}: boundary {set(tags.tolist())}")
    tagged = np.unique(np.sort(triangles), axis=0)
    check(len(tagged) == len(triangles), f"{name}: a boundary face stands twice")
    check(np.array_equal(tagged, faces(tets)), f"{name}: the triangles are not the boundary")
    smallest = volumes(mesh.points, tets).min()
    check(smallest > 0, f"{name}: a tetrahedron of {smallest:.3g} mm³")
    print(f"{name}: {len(tets)} tetrahedra, {len(mesh.points)} points, {np.bincount(tags)[1:]} faces")

check(abs(len(tets) / 1000 - 1) <= 0.05, f"{len(tets)} tetrahedra, 1000 asked")
u = deformed.point_data["displacement"]
check(u.shape == rest.points.shape and np.isfinite(u).all(), f"displacement {u.shape}")
held = np.unique(triangles[tags == CHEST_WALL])
check(np.abs(u[held]).max() == 0, f"the chest wall moves by {np.abs(u[held]).max():.3g} mm")
largest = np.linalg.norm(u, axis=1).max()
check(0.5 < largest < 60, f"largest displacement {largest:.2f} mm")
# The points stay those of the CT; the displacement stands beside them.
check(np.array_equal(deformed.points, rest.points), "deformed.vtu has moved its points")
smallest = volumes(deformed.points + u, tets).min()
check(smallest > 0, f"a tetrahedron turns over in the operating pose: {smallest:.3g} mm³")
print(f"largest displacement {largest:.2f} mm")
