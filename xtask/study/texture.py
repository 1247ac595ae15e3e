#!/usr/bin/env python3
"""Noise of fat before and after it was carried, and of fat beside it. Needs numpy, scipy, SimpleITK.

  texture.py CT DEFORMED FIELD      JSON on stdout

CT, DEFORMED: folders of one DICOM series or files, on one grid. FIELD: NRRD, displacement from the operating position to the
CT (mm) on that grid or a part of it, beyond which nothing moves. Fat: smoothed (3 mm) within 25 HU of its mode in both volumes and 2 mm from all else. Squares of 9 x 9
voxels of a slice in fat, plane taken off: `region` where the fat moves by 0.5 mm or more, `beside` where it does not move.
The deviation in HU, its 10 % and 90 %; shares of the power in the lower and upper half of the in-plane frequencies up to the
grid's limit, and how much of each is left, after over before.
"""
import json
import sys

import numpy as np
import SimpleITK as sitk
from scipy.ndimage import binary_erosion, gaussian_filter
from volumes import read

SIDE, BAND_HU, SMOOTH_MM, MARGIN_MM, MOVED_MM = 9, 25, 3.0, 2.0, 0.5


def fat(hu, spacing):
    smooth = gaussian_filter(hu, [SMOOTH_MM / 2.3548 / s for s in spacing])
    counts, edges = np.histogram(smooth[(smooth > -160) & (smooth < -50)], 110, (-160, -50))
    mode = edges[counts.argmax()] + 0.5
    steps = [max(1, int(round(MARGIN_MM / s))) for s in spacing]
    return binary_erosion(np.abs(smooth - mode) < BAND_HU, np.ones([2 * n + 1 for n in steps]))


def squares(mask):
    """Corners of squares that do not overlap and lie in the mask."""
    found = []
    for k in np.nonzero(mask.any((1, 2)))[0]:
        for j in range(0, mask.shape[1] - SIDE, SIDE):
            for i in range(0, mask.shape[2] - SIDE, SIDE):
                if mask[k, j : j + SIDE, i : i + SIDE].mean() > 0.9:
                    found.append((k, j, i))
    return found


def noise(hu, places):
    """Residuals of the plane through each square."""
    y, x = np.mgrid[0:SIDE, 0:SIDE].reshape(2, -1)
    base = np.linalg.qr(np.stack([np.ones(SIDE * SIDE), x, y], 1))[0]
    flat = np.stack([hu[k, j : j + SIDE, i : i + SIDE].ravel() for k, j, i in places])
    return (flat - flat @ base @ base.T).reshape(-1, SIDE, SIDE)


def power(residuals):
    """Mean power in the lower and in the upper half of the frequencies."""
    window = np.outer(np.hanning(SIDE + 2)[1:-1], np.hanning(SIDE + 2)[1:-1])
    spectrum = (np.abs(np.fft.fft2(residuals * window)) ** 2).mean(0)
    at = np.abs(np.fft.fftfreq(SIDE))
    radius = np.hypot(at[:, None], at[None])
    return np.array([spectrum[(radius > 0) & (radius <= 0.25)].sum(), spectrum[(radius > 0.25) & (radius <= 0.5)].sum()])


def figures(residuals):
    deviation = residuals.std((1, 2))
    low, high = np.percentile(deviation, [10, 90])
    return {"squares": len(residuals), "hu": float(np.median(deviation)), "p10": float(low), "p90": float(high)}


def main():
    ct, moved = (read(p) for p in sys.argv[1:3])
    before, after = (sitk.GetArrayFromImage(v).astype(np.float32) for v in (ct, moved))
    vectors = sitk.ReadImage(sys.argv[3], sitk.sitkVectorFloat64)
    vectors = sitk.Resample(vectors, ct, sitk.Transform(), sitk.sitkNearestNeighbor, 0.0)
    field = np.linalg.norm(sitk.GetArrayFromImage(vectors), axis=-1)
    spacing = ct.GetSpacing()[::-1]
    both = fat(before, spacing) & fat(after, spacing)
    region, beside = squares(both & (field >= MOVED_MM)), squares(both & (field == 0))
    told = {}
    for name, places in (("region", region), ("beside", beside)):
        old, new = noise(before, places), noise(after, places)
        left = power(new) / power(old)
        told[name] = {"before": figures(old), "after": figures(new), "low_left": float(left[0]), "high_left": float(left[1])}
    print(json.dumps(told))


if __name__ == "__main__":
    main()
