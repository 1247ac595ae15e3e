"""labels.py SOURCE LABELS TRUTH: the segmentation reads in SimpleITK, lies on the grid of the CT,
names its segments, and meets the truth of the fixture patient."""

import sys

import numpy as np
import SimpleITK as sitk
from grids import by_pydicom, check, check_same_grid, of_itk

# Soft tissue and chest wall in our labels (docs/CONVENTIONS.md) and in the truth's (its README).
SOFT, WALL = [1, 6, 7, 8, 9], [2, 3, 4, 5]
TRUE_SOFT, TRUE_WALL = [1, 2, 3, 4], [5, 6, 7, 9]

source, labels, truth = sys.argv[1:]
image = sitk.ReadImage(labels)
ours, true = of_itk(image), of_itk(sitk.ReadImage(truth))
check_same_grid("labels against CT", ours, by_pydicom(source))
check_same_grid("labels against truth", ours, true)
found = set(np.unique(ours[0]).tolist())
check({0, 1, 2} <= found <= set(range(10)), f"labels {sorted(found)}")
keys = image.GetMetaDataKeys()
check(any(k.endswith("_LabelValue") for k in keys), f"no segments are named: {keys}")


def dice(a, b):
    return 2 * np.count_nonzero(a & b) / (np.count_nonzero(a) + np.count_nonzero(b))


for name, mine, theirs in (("soft tissue", SOFT, TRUE_SOFT), ("chest wall", WALL, TRUE_WALL)):
    score = dice(np.isin(ours[0], mine), np.isin(true[0], theirs))
    print(f"Dice of the {name}: {score:.4f}")
    check(score >= 0.95, f"Dice of the {name} is {score:.4f}")
