"""gmsh and MMG beside our mesher: edge lengths are searched for a count, as their users must.

peers.py gmsh SURFACE.vtu N VOLUME OUT.npz    remeshes the tagged boundary of a fine mesh and fills it
peers.py mmg MESH.vtu N VOLUME OUT.npz        remeshes a tagged mesh

Prints JSON: seconds of the nearest run and of all runs, number of runs. OUT.npz is what metrics.py
reads: nodes, tets, tri, tri_tag.
"""

import json
import math
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import meshio
import numpy as np

TRIES = 8
NEAR = 0.002


def read(path):
    """Points, tetrahedra, boundary triangles and their tags of one of our VTU files."""
    mesh = meshio.read(path)
    kind = lambda name: np.concatenate([c.data for c in mesh.cells if c.type == name])
    tags = [t for c, t in zip(mesh.cells, mesh.cell_data["boundary"]) if c.type == "triangle"]
    return mesh.points, kind("tetra"), kind("triangle"), np.concatenate(tags).astype(int).ravel()


def nearest_tags(points, tri, fine_points, fine_tri, fine_tags):
    """The tag of the nearest triangle of the fine surface, by middles."""
    middle, fine = points[tri].mean(1), fine_points[fine_tri].mean(1)
    chunks = [middle[n : n + 200] for n in range(0, len(middle), 200)]
    near = [((c[:, None] - fine[None]) ** 2).sum(2).argmin(1) for c in chunks]
    return fine_tags[np.concatenate(near)]


def boundary(tets):
    """The faces that belong to one tetrahedron."""
    faces = np.concatenate([tets[:, f] for f in ([1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1])])
    _, first, count = np.unique(
        np.sort(faces, 1), axis=0, return_index=True, return_counts=True
    )
    return faces[first[count == 1]]


def write_stl(path, points, tri):
    corners = points[tri]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    kind = np.dtype([("n", "<3f4"), ("v", "<9f4"), ("a", "<u2")])
    out = np.zeros(len(tri), kind)
    out["n"], out["v"] = normal, corners.reshape(-1, 9)
    path.write_bytes(bytes(80) + np.uint32(len(tri)).tobytes() + out.tobytes())


def gmsh_run(fine, folder, edge):
    """gmsh remeshes the surface, parted where it bends by 40 degrees, and fills it by HXT."""
    import gmsh

    stl = folder / "fine.stl"
    if not stl.exists():
        write_stl(stl, fine[0], fine[2])
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.merge(str(stl))
        gmsh.model.mesh.classifySurfaces(math.radians(40), True, False, math.pi)
        gmsh.model.mesh.createGeometry()
        loop = gmsh.model.geo.addSurfaceLoop([e[1] for e in gmsh.model.getEntities(2)])
        gmsh.model.geo.addVolume([loop])
        gmsh.model.geo.synchronize()
        for name, value in (
            ("Mesh.MeshSizeMin", edge),
            ("Mesh.MeshSizeMax", edge),
            ("Mesh.MeshSizeFromCurvature", 0),
            ("Mesh.MeshSizeExtendFromBoundary", 0),
            ("Mesh.Algorithm3D", 10),
            ("General.NumThreads", 1),
            ("Mesh.Optimize", 1),
        ):
            gmsh.option.setNumber(name, value)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.optimize("Netgen")
        gmsh.model.mesh.optimize("")
        tags, points, _ = gmsh.model.mesh.getNodes()
        number = np.zeros(int(tags.max()) + 1, int)
        number[tags.astype(int)] = np.arange(len(tags))
        tets = number[gmsh.model.mesh.getElementsByType(4)[1].astype(int)].reshape(-1, 4)
        points = points.reshape(-1, 3)
    finally:
        gmsh.finalize()
    used, tets = np.unique(tets, return_inverse=True)
    points, tets = points[used], tets.reshape(-1, 4)
    tri = boundary(tets)
    return points, tets, tri, nearest_tags(points, tri, fine[0], fine[2], fine[3])


def mmg_run(given, folder, edge):
    """MMG3D with one edge length; the surface may leave the given one by 0.05 of it."""
    source, made = folder / "in.mesh", folder / "out.mesh"
    points, tets, tri, tags = given
    lists = (
        ("Vertices", points, np.zeros(len(points), int), "%.9g %.9g %.9g %d"),
        ("Tetrahedra", tets + 1, np.ones(len(tets), int), "%d"),
        ("Triangles", tri + 1, tags, "%d"),
    )
    with open(source, "w") as file:
        file.write("MeshVersionFormatted 2\nDimension 3\n")
        for name, rows, marks, form in lists:
            file.write(f"{name}\n{len(rows)}\n")
            np.savetxt(file, np.c_[rows, marks], form)
        file.write("End\n")
    mmg = Path(sys.executable).with_name("mmg3d_O3")
    sizes = ["-hsiz", str(edge), "-hausd", str(0.05 * edge)]
    start = time.perf_counter()
    done = subprocess.run(
        [mmg, "-v", "0", "-in", source, "-out", made, *sizes], capture_output=True, text=True
    )
    seconds = time.perf_counter() - start
    if done.returncode:
        sys.exit(f"mmg3d: {done.stderr[-300:]}")
    mesh = meshio.read(made)
    kind = lambda name: np.concatenate([c.data for c in mesh.cells if c.type == name])
    marks = [m for c, m in zip(mesh.cells, mesh.cell_data["medit:ref"]) if c.type == "triangle"]
    # Reading and writing files is not its work.
    return seconds, (mesh.points, kind("tetra"), kind("triangle"), np.concatenate(marks))


def timed(run, given, folder, edge):
    if run is mmg_run:
        return mmg_run(given, folder, edge)
    start = time.perf_counter()
    made = run(given, folder, edge)
    return time.perf_counter() - start, made


def search(run, given, folder, asked, volume):
    """Edge lengths until the count is near; the nearest mesh, its seconds, those of all runs."""
    edge, best, runs = (math.sqrt(72) * volume / asked) ** (1 / 3), None, []
    for _ in range(TRIES):
        seconds, made = timed(run, given, folder, edge)
        off = math.log(len(made[1]) / asked)
        runs.append((math.log(edge), off, seconds))
        if best is None or abs(off) < abs(best[0]):
            best = (off, seconds, made)
        if abs(off) <= NEAR:
            break
        many = [r for r in runs if r[1] > 0]
        few = [r for r in runs if r[1] <= 0]
        if many and few:
            a, b = min(many, key=lambda r: r[1]), max(few, key=lambda r: r[1])
            share = min(max(a[1] / (a[1] - b[1]), 0.1), 0.9)
            edge = math.exp(a[0] + share * (b[0] - a[0]))
        else:
            edge = math.exp(runs[-1][0] + off / 3)
    return best, runs


def main():
    kind, source, asked, volume, out = sys.argv[1:]
    run = {"gmsh": gmsh_run, "mmg": mmg_run}[kind]
    with tempfile.TemporaryDirectory() as folder:
        best, runs = search(run, read(source), Path(folder), int(asked), float(volume))
    points, tets, tri, tags = best[2]
    np.savez_compressed(out, nodes=points, tets=tets, tri=tri, tri_tag=tags)
    print(json.dumps({"once_s": best[1], "search_s": sum(r[2] for r in runs), "runs": len(runs)}))


main()
