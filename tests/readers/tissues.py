"""The tissues of a run as 3D Slicer finds them: names and colours, and volumes as in the summary."""

import json
import sys

import numpy as np
import SimpleITK as sitk

image = sitk.ReadImage(sys.argv[1])
with open(sys.argv[2], encoding="utf-8") as file:
    summary = json.load(file)

segments = {}
for n in range(100):
    if not image.HasMetaDataKey(f"Segment{n}_ID"):
        break
    color = [float(c) for c in image.GetMetaData(f"Segment{n}_Color").split()]
    assert len(color) == 3 and all(0 <= c <= 1 for c in color), color
    name, value = (image.GetMetaData(f"Segment{n}_{key}") for key in ("Name", "LabelValue"))
    segments[name] = int(value)
expected = {"lung", "bone", "muscle", "fat", "gland", "skin", "tumour"}
assert set(segments) == expected, segments
voxels = sitk.GetArrayFromImage(image)
assert set(np.unique(voxels)) == {0, *segments.values()}, np.unique(voxels)

voxel_ml = float(np.prod(image.GetSpacing())) / 1000
k, j, i = np.indices(voxels.shape)
index = np.stack([i, j, k], axis=-1) * np.array(image.GetSpacing())
place = index @ np.array(image.GetDirection()).reshape(3, 3).T + np.array(image.GetOrigin())
region = summary["parameters"]["region"]
inside = np.linalg.norm(place - region["centre_mm"], axis=-1) <= region["radius_mm"]
told = {v["name"]: v for v in summary["segmentation"]["tissues"]["volumes"]}
for name, number in segments.items():
    ml = np.count_nonzero((voxels == number) & inside) * voxel_ml
    assert abs(ml - told[name]["region_ml"]) < 0.01 * ml + 0.01, (name, ml, told[name])
gland, fat = told["gland"]["region_ml"], told["fat"]["region_ml"]
density = summary["segmentation"]["tissues"]["density_percent"]
assert abs(density - 100 * gland / (gland + fat)) < 1e-6, density
