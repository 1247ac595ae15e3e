"""dose_volume.py RUN DOSE STRUCTURES: the dose-volume figures of a run before deformation are those of other readers and of numpy."""

import json
import sys
from pathlib import Path

import numpy as np
import pydicom
import SimpleITK as sitk
from grids import check

run, dose_file, structures_file = (Path(path) for path in sys.argv[1:])
given = pydicom.dcmread(structures_file)
image = sitk.ReadImage(str(dose_file))
dose = sitk.Cast(image, sitk.sitkFloat64) * float(pydicom.dcmread(dose_file).DoseGridScaling)
if dose.GetDimension() == 4:
    dose = dose[:, :, :, 0]
told = json.loads((run / "summary.json").read_text())["dose_volume"]
STEP = 0.5


def inside(polygon, x, y):
    """Even-odd rule at points within one polygon."""
    odd = np.zeros(x.shape, bool)
    for (x0, y0), (x1, y1) in zip(polygon, np.roll(polygon, -1, axis=0)):
        crosses = (y0 > y) != (y1 > y)
        with np.errstate(divide="ignore", invalid="ignore"):
            odd ^= crosses & (x < (x1 - x0) * (y - y0) / (y1 - y0) + x0)
    return odd


def at(point):
    index = dose.TransformPhysicalPointToContinuousIndex(point)
    size = dose.GetSize()
    if any(i < -0.5 or i > n - 0.5 for i, n in zip(index, size)):
        return 0.0
    held = [min(max(i, 0.0), n - 1.0) for i, n in zip(index, size)]
    return dose.EvaluateAtContinuousIndex(held, sitk.sitkLinear)


def closed(contour):
    """Whether a contour encloses something."""
    return contour.ContourGeometricType == "CLOSED_PLANAR" and contour.NumberOfContourPoints > 2


def samples(roi):
    """Doses in the planes of a region's closed contours, and its volume in ml."""
    planes = {}
    for contour in roi.get("ContourSequence", []):
        if closed(contour):
            points = np.array(contour.ContourData, float).reshape(-1, 3)
            planes.setdefault(round(points[0, 2], 2), []).append(points)
    doses, area = [], []
    for z, contours in sorted(planes.items()):
        low = np.min([c.min(0) for c in contours], axis=0)
        high = np.max([c.max(0) for c in contours], axis=0)
        x, y = np.meshgrid(np.arange(low[0], high[0], STEP) + STEP / 2, np.arange(low[1], high[1], STEP) + STEP / 2)
        odd = np.zeros(x.shape, bool)
        for contour in contours:
            odd ^= inside(contour[:, :2], x, y)
        doses += [at((float(a), float(b), z)) for a, b in zip(x[odd], y[odd])]
        area.append(odd.sum() * STEP**2)
    step = np.median(np.diff(sorted(planes))) if len(planes) > 1 else 0.0
    return np.array(doses), sum(area) * step / 1000


regions = [roi for roi in given.ROIContourSequence if any(map(closed, roi.get("ContourSequence", [])))]
check(len(told) == len(regions) > 0, f"{len(told)} histograms of {len(regions)} regions")
for roi, of in zip(regions, told):
    doses, volume = samples(roi)
    before, most = of["before"], max(float(doses.max()), 1e-9)
    check(abs(before["volume_ml"] / volume - 1) < 0.1, f"{of['region']}: {before['volume_ml']} ml, numpy {volume}")
    for name, want in (("mean_gy", doses.mean()), ("d50_gy", np.median(doses)), ("max_gy", most)):
        check(abs(before[name] - want) < 0.04 * most, f"{of['region']}: {name} {before[name]}, numpy {want}")
    falls = np.diff(before["shares"])
    check(before["shares"][0] == 1 and (falls <= 1e-12).all(), f"{of['region']}: the curve rises")
    here = [(doses >= n * of["step_gy"]).mean() for n in range(len(before["shares"]))]
    off = np.abs(np.array(here) - before["shares"])
    check(np.mean(off) < 0.02, f"{of['region']}: the curve is {off.mean():.3f} off in the mean")
print(f"{len(told)} histograms")
