#!/usr/bin/env python3
"""Where a deformed CT differs from the noise-free CT of the operating position. Needs numpy, scipy, SimpleITK, scikit-image,
pyvista, matplotlib.

  image_error.py PATIENT WARPED PICTURE.png     JSON on stdout

PATIENT: folder with patient.json and truth/. WARPED: folder of one DICOM series or a file. Soft tissue (truth's labels 1 to
4) in the sphere `score_roi`, in parts that do not overlap, each voxel in the first that fits: `skin` (within 3 mm of the
air), `wall` (within 3 mm of the chest wall), `edge` (the outer 5 mm of the sphere), `inside`. Beside them `air`: within
12 mm of the skin, outside. Of each: share of the voxels of the soft tissue, mean |error| and mean error in HU, share of the
whole error of the soft tissue. `skin_mm`: distance between the surfaces at -450 HU, both ways, mean and 95 %.
PICTURE: the axial slice with the largest mean |error| over soft tissue and that air: warped, truth, difference.
"""
import json
import os
import sys

import matplotlib
import numpy as np
import pyvista
import SimpleITK as sitk
from scipy.ndimage import distance_transform_edt
from skimage.measure import marching_cubes
from volumes import read

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  after the choice of the backend

SOFT, WALL, AIR = (1, 2, 3, 4), (5, 6, 7, 9), (0, 8)
SKIN_HU = -450
NEAR_MM, EDGE_MM, AIR_MM = 3.0, 5.0, 12.0


class Truth:
    """The noise-free CT of the operating position, with what lies where."""

    def __init__(self, patient):
        self.image = sitk.ReadImage(os.path.join(patient, "truth/intraop_ct.nrrd"))
        self.hu = sitk.GetArrayFromImage(self.image).astype(np.float32)
        self.labels = sitk.GetArrayFromImage(sitk.ReadImage(os.path.join(patient, "truth/intraop_labels.nrrd")))
        with open(os.path.join(patient, "patient.json")) as file:
            ball = json.load(file)["score_roi"]
        self.centre, self.radius = np.array(ball["centre_mm"]), ball["radius_mm"]
        self.spacing = np.array(self.image.GetSpacing())[::-1]
        index = np.indices(self.hu.shape, sparse=True)
        origin = np.array(self.image.GetOrigin())[::-1]
        square = sum((origin[a] + self.spacing[a] * index[a] - self.centre[2 - a]) ** 2 for a in range(3))
        self.depth = self.radius - np.sqrt(square)
        self.to_air = self.distance(AIR)

    def distance(self, labels):
        return distance_transform_edt(~np.isin(self.labels, labels), sampling=self.spacing)

    def parts(self):
        soft = np.isin(self.labels, SOFT) & (self.depth > 0)
        left, parts = soft.copy(), {}
        near = {"skin": self.to_air <= NEAR_MM, "wall": self.distance(WALL) <= NEAR_MM, "edge": self.depth <= EDGE_MM}
        for name, where in near.items():
            parts[name] = left & where
            left &= ~where
        parts["inside"] = left
        air = np.isin(self.labels, AIR) & (self.distance(SOFT) <= AIR_MM) & (self.depth > 0)
        return soft, parts, air

    def skin(self, hu):
        """Surface towards the air, within the sphere, in patient coordinates."""
        points, faces, _, _ = marching_cubes(hu, SKIN_HU)
        centre = np.rint(points[faces].mean(1)).astype(int)
        at = tuple(np.minimum(centre, np.array(hu.shape) - 1).T)
        faces = faces[(self.to_air[at] <= 2 * NEAR_MM) & (self.depth[at] > NEAR_MM)]
        points = points[:, ::-1] * self.spacing[::-1] + np.array(self.image.GetOrigin())
        flat = np.hstack([np.full((len(faces), 1), 3), faces])
        return pyvista.PolyData(points, flat.astype(np.int64)).clean()


def apart(a, b):
    """Distances of the points of a to b; those at its rim have no partner and are left out."""
    rim = b.extract_feature_edges(boundary_edges=True, feature_edges=False, manifold_edges=False, non_manifold_edges=False)
    at_rim = np.zeros(a.n_points, bool)
    if rim.n_points:
        from scipy.spatial import cKDTree

        at_rim = cKDTree(rim.points).query(a.points)[0] < 2 * NEAR_MM
    return np.abs(a.compute_implicit_distance(b)["implicit_distance"])[~at_rim]


def picture(truth, got, worst, path):
    want = truth.hu[worst]
    fig, axes = plt.subplots(2, 3, figsize=(18, 10), facecolor="black")
    x, y = (truth.image.GetSpacing()[a] for a in (0, 1))
    show = {"aspect": y / x, "interpolation": "nearest"}
    for row, (low, high) in enumerate([(-200, 200), (-1000, 200)]):
        span = 200 if row == 0 else 600
        panels = [("warped", got[worst], "gray", low, high), ("truth", want, "gray", low, high)]
        panels.append(("warped - truth", got[worst] - want, "RdBu_r", -span, span))
        for axis, (name, slice_, colours, least, most) in zip(axes[row], panels):
            axis.imshow(slice_, cmap=colours, vmin=least, vmax=most, **show)
            axis.contour(want, [SKIN_HU], colors="#00d000", linewidths=0.5)
            axis.contour(truth.depth[worst], [0.0], colors="#d0d000", linewidths=0.5)
            axis.set_title(f"{name}, {least} to {most} HU", color="white", fontsize=10)
            axis.axis("off")
    fig.tight_layout()
    fig.savefig(path, dpi=70)


def main():
    patient, warped, path = sys.argv[1:]
    truth = Truth(patient)
    moved = sitk.Resample(read(warped), truth.image, sitk.Transform(), sitk.sitkLinear, -1024.0, sitk.sitkFloat32)
    got = sitk.GetArrayFromImage(moved)
    error = got - truth.hu
    soft, parts, air = truth.parts()
    whole = np.abs(error[soft]).sum()
    found = {}
    for name, where in [*parts.items(), ("air", air)]:
        e = error[where]
        found[name] = {
            "voxels_share": float(where.sum() / soft.sum()),
            "mean_abs_hu": float(np.abs(e).mean()),
            "bias_hu": float(e.mean()),
            "error_share": float(np.abs(e).sum() / whole),
        }
    found["air"]["above_300_share"] = float((error[air] > 300).mean())
    a, b = truth.skin(got), truth.skin(truth.hu)
    d = np.concatenate([apart(a, b), apart(b, a)])
    found["skin_mm"] = {"mean": float(d.mean()), "p95": float(np.percentile(d, 95)), "max": float(d.max())}
    seen = soft | air
    slices = np.abs(error * seen).sum((1, 2)) / np.maximum(seen.sum((1, 2)), 1)
    slices[seen.sum((1, 2)) < 500] = 0
    worst = int(slices.argmax())
    found["worst"] = {"slice": worst, "z_mm": float(truth.image.GetOrigin()[2] + worst * truth.spacing[0]), "mean_abs_hu": float(slices[worst])}
    found["soft"] = {"mean_abs_hu": float(np.abs(error[soft]).mean()), "bias_hu": float(error[soft].mean())}
    picture(truth, got, worst, path)
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
