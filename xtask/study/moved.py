#!/usr/bin/env python3
"""How far the chest wall's boundary lies from that of another segmentation of the same patient. Needs numpy, scipy,
scikit-image, SimpleITK.

  moved.py LABELS OTHER X,Y,Z R     sphere (LPS, mm) within which both boundaries are compared

Prints the mean and the 95 % distance, both ways, mm. The boundaries are the half-way surfaces of the wall's mask blurred by
0.7 voxels, so that grids of different position and spacing can be compared below the size of a voxel.
"""
import sys

import numpy as np
import SimpleITK as sitk
from scipy.ndimage import gaussian_filter
from scipy.spatial import cKDTree
from skimage.measure import marching_cubes

SOFT, WALL = 1, 2


def boundary(path, centre, radius):
    """Points of the boundary between wall and soft tissue, dense enough for distances (x, y, z)."""
    image = sitk.ReadImage(path)
    origin, spacing = np.array(image.GetOrigin()), np.array(image.GetSpacing())
    labels = sitk.GetArrayFromImage(image)
    low = np.clip(((centre - radius - 8 - origin) / spacing).astype(int), 0, None)
    high = ((centre + radius + 8 - origin) / spacing).astype(int) + 1
    part = labels[low[2] : high[2], low[1] : high[1], low[0] : high[0]]
    level = gaussian_filter((part == WALL).astype(np.float32), 0.7)
    vertices, faces, _, _ = marching_cubes(level, 0.5)
    corners = vertices[faces]
    points = np.concatenate([vertices, corners.mean(axis=1), 0.5 * (corners[:, 0] + corners[:, 1])])
    tissue = gaussian_filter((part == SOFT).astype(np.float32), 2.0)
    near = tissue[tuple(np.round(points).astype(int).T)] > 0.05
    points = points[near][:, ::-1] * spacing + low * spacing + origin
    return points


def main():
    one, other, centre, radius = sys.argv[1:]
    centre, radius = np.array([float(c) for c in centre.split(",")]), float(radius)
    a, b = boundary(one, centre, radius), boundary(other, centre, radius)
    inside = lambda p: p[((p - centre) ** 2).sum(axis=1) < (radius - 3.0) ** 2]
    distances = np.concatenate([cKDTree(b).query(inside(a))[0], cKDTree(a).query(inside(b))[0]])
    print(f'{{"mean_mm": {distances.mean():.4f}, "p95_mm": {np.percentile(distances, 95):.4f}}}')


if __name__ == "__main__":
    main()
