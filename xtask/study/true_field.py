#!/usr/bin/env python3
"""The true displacement of a synthetic patient as a mesh that `supine warp` reads. Needs numpy, meshio.

  true_field.py PATIENT OUT.vtu

PATIENT: folder with truth/displacement.npz, ten-node tetrahedra (VTK order) with curved sides at the supine shape.
OUT: each cut into eight straight ones through its ten nodes; point data `displacement` (mm, supine to operating).
"""
import os
import sys

import meshio
import numpy as np

# Corner tetrahedra, then four round the diagonal 4-9 of the octahedron between them.
PARTS = [[0, 4, 6, 7], [4, 1, 5, 8], [6, 5, 2, 9], [7, 8, 9, 3], [4, 9, 5, 6], [4, 9, 6, 7], [4, 9, 7, 8], [4, 9, 8, 5]]
SKIN, WALL, CUT = 1, 2, 3


def straight(tets, nodes):
    """Eight tetrahedra of positive volume for each."""
    parts = tets[:, PARTS].reshape(-1, 4)
    a, b, c, d = (nodes[parts[:, k]] for k in range(4))
    volume = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a)
    turned = volume < 0
    parts[turned] = parts[turned][:, [0, 2, 1, 3]]
    return parts


def boundary(parts, wall, fixed):
    """Faces of one tetrahedron only, each with its tag."""
    faces = parts[:, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]].reshape(-1, 3)
    key, first, count = np.unique(np.sort(faces, 1), axis=0, return_index=True, return_counts=True)
    outer = faces[first[count == 1]]
    tag = np.where(wall[outer].all(1), WALL, np.where(fixed[outer].all(1), CUT, SKIN))
    return outer, tag


def main():
    patient, out = sys.argv[1:]
    truth = np.load(os.path.join(patient, "truth/displacement.npz"))
    nodes = truth["nodes"].astype(float)
    parts = straight(truth["tets"].astype(np.int64), nodes)
    wall, fixed = np.zeros(len(nodes), bool), np.zeros(len(nodes), bool)
    wall[truth["wall_nodes"]] = True
    fixed[truth["fixed_nodes"]] = True
    outer, tag = boundary(parts, wall, fixed | wall)
    mesh = meshio.Mesh(
        nodes,
        [("tetra", parts), ("triangle", outer)],
        point_data={"displacement": truth["u_operating"].astype(float)},
        cell_data={"boundary": [np.zeros(len(parts), np.int32), tag.astype(np.int32)]},
    )
    mesh.write(out)


if __name__ == "__main__":
    main()
