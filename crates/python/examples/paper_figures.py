"""Figures as papers on breast simulation show them: the model, the CT before and after, and what the tissue decides.

    python paper_figures.py CT_FOLDER FIGURES [--threads N] [--tetrahedra N]      # needs matplotlib and pyvista

The tumour and the side are those of the synthetic patient that `supine demo` unpacks; change them for your own.
"""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

import supine

TUMOUR = (91.37, -248.09, -594.5)
MODULI = (0.3, 0.45, 0.6, 0.9, 1.35, 2.0, 3.0)


def slice_of(volume: supine.Volume, z: float) -> int:
    """The slice at a height, LPS, mm (slices of this CT are axial)."""
    return round((z - volume.origin[2]) / volume.spacing[2])


def extent(volume: supine.Volume) -> tuple[float, float, float, float]:
    """Where a slice lies, mm: left, right, bottom, top."""
    (i, j, _), (x, y, _), (dx, dy, _) = volume.size, volume.origin, volume.spacing
    return (x - dx / 2, x + (i - 0.5) * dx, y + (j - 0.5) * dy, y - dy / 2)


def shown(axes: Axes, volume: supine.Volume, z: float, title: str) -> None:
    """A slice in the window of soft tissue, with the tumour's height."""
    picture = volume.array[slice_of(volume, z)]
    axes.imshow(picture, cmap="gray", vmin=-160, vmax=240, extent=extent(volume))
    axes.set(title=title, xlabel="x, mm (to her left)", ylabel="y, mm (to her back)")
    axes.set(xlim=(10, 180), ylim=(-130, -310))


def model(session: supine.Session, out: Path) -> None:
    """The mesh on the CT, and how far each part of the skin moves."""
    deformation, (_, _, z) = session.deformation, TUMOUR
    mesh = deformation.mesh
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 5), layout="constrained")
    shown(left, session.ct, z, f"{len(mesh.tets)} tetrahedra, cut by the slice")
    cut = mesh.to_pyvista().slice(normal="z", origin=TUMOUR).extract_all_edges()
    for start, end in cut.lines.reshape(-1, 3)[:, 1:]:
        left.plot(*cut.points[[start, end], :2].T, color="tab:orange", linewidth=0.6)
    skin = mesh.faces[mesh.tags == 1]
    a, b, c = (mesh.points[skin[:, corner]] for corner in range(3))
    skin = skin[np.cross(b - a, c - a)[:, 1] < 0]  # what is seen from the front,
    skin = skin[np.argsort(-mesh.points[skin, 1].mean(axis=1))]  # the nearest drawn last
    length = np.linalg.norm(deformation.points - mesh.points, axis=1)
    x, _, height = mesh.points.T
    drawn = right.tripcolor(x, height, length, triangles=skin, shading="gouraud")
    right.set(title="displacement of the skin, from the front", xlabel="x, mm", ylabel="z, mm")
    right.set_aspect("equal")
    figure.colorbar(drawn, label="mm")
    figure.savefig(out / "model.png", dpi=120)


def before_and_after(session: supine.Session, out: Path) -> None:
    """The CT as it was taken, on the table, and their difference, at the tumour."""
    tumour, ct, moved = session.tumour, session.ct, session.deformed_ct
    figure, axes = plt.subplots(1, 3, figsize=(15, 5), layout="constrained")
    shown(axes[0], ct, tumour.before[2], "CT")
    axes[0].plot(*tumour.before[:2], "c+", markersize=14)
    shown(axes[1], moved, tumour.after[2], f"on the table: {tumour}")
    axes[1].plot(*tumour.after[:2], "c+", markersize=14)
    n = slice_of(ct, tumour.before[2])
    difference = moved.array[n].astype(int) - ct.array[n]
    drawn = axes[2].imshow(difference, cmap="RdBu", vmin=-300, vmax=300, extent=extent(ct))
    axes[2].set(title="difference in the slice of the CT", xlim=(10, 180), ylim=(-130, -310))
    figure.colorbar(drawn, label="HU")
    figure.savefig(out / "before_and_after.png", dpi=120)


def tissue(session: supine.Session, out: Path) -> None:
    """The tumour's way for several moduli and both rest states: nobody's tissue is known beforehand."""
    figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
    for rest in ("net", "unloaded"):
        way: list[float] = []
        for young in MODULI:
            session.set(tissue={"young": young, "rest": rest})
            try:
                way.append(session.movement.distance)
            except supine.SupineError as error:
                print(f"{young} kPa, {rest}: {error.message}")
                way.append(np.nan)
        axes.plot(MODULI, way, "o-", label=f"rest state {rest}")
    session.set(tissue={"young": None, "rest": None})
    axes.set(xscale="log", xlabel="Young's modulus, kPa", ylabel="tumour's displacement, mm")
    axes.set_xticks(MODULI, [f"{young:g}" for young in MODULI], minor=False)
    axes.set_xticks([], minor=True)
    axes.legend()
    figure.savefig(out / "tissue.png", dpi=120)


def main() -> None:
    """All figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("ct", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--threads", type=int)
    parser.add_argument("--tetrahedra", type=int, default=5000)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    warnings.simplefilter("ignore", supine.SupineWarning)
    session = supine.Session(
        ct=given.ct,
        breast="left",
        table={"ap": 7.0, "lat": 5.0},
        tumour={"centre": TUMOUR, "radius": 9.0},
        mesh={"tetrahedra": given.tetrahedra},
        threads=given.threads,
    )
    for figure in (model, before_and_after, tissue):
        figure(session, given.out)
    print(f"tumour: {session.tumour}")


if __name__ == "__main__":
    main()
