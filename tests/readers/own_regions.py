"""own_regions.py RUN: the structure set of a run has body, chest wall, breast and tumour where its CT and its summary have them."""

import json
import sys
from pathlib import Path

import numpy as np
import pydicom
import SimpleITK as sitk
from grids import check, series_by_itk



def filled(shape, x, y):
    """The pixels whose middles lie within a polygon: those with an odd number of crossings to their left."""
    inside = np.zeros(shape, bool)
    ends = np.roll(x, -1), np.roll(y, -1)
    for row in range(max(0, int(y.min())), min(shape[0], int(y.max()) + 2)):
        crossed = (y <= row) != (ends[1] <= row)
        at = x[crossed] + (row - y[crossed]) / (ends[1] - y)[crossed] * (ends[0] - x)[crossed]
        inside[row] = (at[:, None] < np.arange(shape[1])).sum(0) % 2 == 1
    return inside


run = Path(sys.argv[1])
ct = series_by_itk(run / "ct")
hu = sitk.GetArrayFromImage(ct)
found = pydicom.dcmread(run / "structures.dcm")
slices = {pydicom.dcmread(path, stop_before_pixels=True).SOPInstanceUID for path in (run / "ct").iterdir()}
spacing, masks = np.array(ct.GetSpacing()), {}
for roi, drawn, seen in zip(found.StructureSetROISequence, found.ROIContourSequence, found.RTROIObservationsSequence):
    mask = np.zeros(hu.shape, bool)
    for contour in drawn.ContourSequence:
        check(contour.ContourImageSequence[0].ReferencedSOPInstanceUID in slices, f"{roi.ROIName}: another image")
        points = np.array(contour.ContourData, float).reshape(-1, 3)
        index = np.array([ct.TransformPhysicalPointToContinuousIndex(p) for p in points.tolist()])
        k = round(index[0, 2])
        check(np.abs(index[:, 2] - k).max() < 1e-3, f"{roi.ROIName}: a contour between slices")
        mask[k] ^= filled(hu.shape[1:], index[:, 0], index[:, 1])
    masks[roi.ROIName] = mask, seen.RTROIInterpretedType
check(list(masks) == ["Body", "Chest wall", "Breast, simulated", "Tumour"], f"regions {list(masks)}")
kinds = [kind for _, kind in masks.values()]
check(kinds == ["EXTERNAL", "ORGAN", "ORGAN", "GTV"], f"types {kinds}")
body, wall, breast, tumour = (mask for mask, _ in masks.values())
ml = spacing.prod() / 1000
print({name: round(mask.sum() * ml, 1) for name, (mask, _) in masks.items()})
check((hu[~body] > -300).mean() < 0.02, "tissue outside the body")
check((hu[body] > -300).mean() > 0.6, "air in the body")
for name, mask in (("wall", wall), ("breast", breast), ("tumour", tumour)):
    check((mask & ~body).sum() < 0.02 * mask.sum(), f"the {name} leaves the body")
check((wall & breast).sum() < 0.05 * breast.sum(), "breast and wall overlap")
told = json.loads((run / "summary.json").read_text())["tumour"]
middle = np.argwhere(tumour).mean(0)[::-1]
middle = np.array(ct.TransformContinuousIndexToPhysicalPoint(middle.tolist()))
off = np.linalg.norm(middle - np.array(told["after_mm"]))
print(f"the tumour's middle is {off:.2f} mm from that of the summary")
check(off < 0.6, f"the tumour lies {off:.2f} mm off")
