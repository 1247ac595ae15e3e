#!/usr/bin/env python3
"""How far the chest wall's boundary lies from that of another segmentation of the same patient. Needs numpy, scipy,
scikit-image, SimpleITK.

  moved.py FOLDER OTHER X,Y,Z R     sphere (LPS, mm) within which both boundaries are compared

Each folder holds `labels.nrrd` and `chest_wall.nrrd`, the signed distance that `supine segment --surfaces` writes: grids of
different position and spacing are compared below the size of a voxel. Prints the mean and the 95 % distance from the points of
each boundary that soft tissue touches to the other boundary, mm; distances above 5 mm count as 5.
"""
import sys
from pathlib import Path

import numpy as np
import SimpleITK as sitk
from scipy.ndimage import gaussian_filter, map_coordinates
from skimage.measure import marching_cubes

SOFT = 1
UNIT_MM = 1 / 2000


class Wall:
    def __init__(self, folder, centre, radius):
        image = sitk.ReadImage(Path(folder) / "chest_wall.nrrd")
        self.origin, self.spacing = np.array(image.GetOrigin()), np.array(image.GetSpacing())
        low = np.clip(((centre - radius - 8 - self.origin) / self.spacing).astype(int), 0, None)
        high = ((centre + radius + 8 - self.origin) / self.spacing).astype(int) + 1
        box = tuple(slice(a, b) for a, b in zip(low[::-1], high[::-1]))
        self.origin = self.origin + low * self.spacing
        self.distance = sitk.GetArrayFromImage(image)[box].astype(np.float32) * UNIT_MM
        self.soft = sitk.GetArrayFromImage(sitk.ReadImage(Path(folder) / "labels.nrrd"))[box] == SOFT

    def points(self, centre, radius):
        """Points of the boundary with soft tissue (x, y, z), mm: corners and middles of triangles."""
        vertices, faces, _, _ = marching_cubes(self.distance, 0.0)
        points = np.concatenate([vertices, vertices[faces].mean(axis=1)])
        tissue = gaussian_filter(self.soft.astype(np.float32), 2.0)
        near = tissue[tuple(np.round(points).astype(int).T)] > 0.05
        points = points[near][:, ::-1] * self.spacing + self.origin
        return points[((points - centre) ** 2).sum(axis=1) < (radius - 3.0) ** 2]

    def distances(self, points):
        at = (points - self.origin) / self.spacing
        return np.abs(map_coordinates(self.distance, at[:, ::-1].T, order=1, mode="nearest"))


def main():
    one, other, centre, radius = sys.argv[1:]
    centre, radius = np.array([float(c) for c in centre.split(",")]), float(radius)
    a, b = Wall(one, centre, radius), Wall(other, centre, radius)
    distances = np.concatenate([b.distances(a.points(centre, radius)), a.distances(b.points(centre, radius))])
    print(f'{{"mean_mm": {distances.mean():.4f}, "p95_mm": {np.percentile(distances, 95):.4f}}}')


if __name__ == "__main__":
    main()
