"""carried.py RUN CONTOURS X,Y,Z RADIUS BEFORE AFTER: the contours of `CTV` in CONTOURS (CSV), a ball round X,Y,Z
(LPS, mm) in the CT, lie in the slices of the run's CT and enclose what its fields make of the ball: the volume (mL) that
the Jacobian says, round the place that the displacement says."""

import csv
import sys
from itertools import groupby
from pathlib import Path

import numpy as np
import SimpleITK as sitk
from grids import check, of_itk, slices

run, contours = Path(sys.argv[1]), sys.argv[2]
centre, radius = np.array(sys.argv[3].split(","), float), float(sys.argv[4])
before, after = (float(v) for v in sys.argv[5:])

# What the fields make of the ball.
u, affine = of_itk(sitk.ReadImage(str(run / "field/ct_to_deformed.nrrd")))
jacobian = of_itk(sitk.ReadImage(str(run / "field/jacobian.nrrd")))[0]
k, j, i = np.indices(jacobian.shape)
places = np.stack([i, j, k, np.ones_like(i)], -1) @ affine[:3].T
inside = ((places - centre) ** 2).sum(-1) < radius**2
# The fields cover what moves: the whole ball.
share = inside.sum() * abs(np.linalg.det(affine[:3, :3])) / (4 / 3 * np.pi * radius**3)
check(abs(share - 1) < 0.05, f"{share:.2f} of the ball lie in the fields")
weight = jacobian[inside]
grown = weight.mean()
middle = (weight[:, None] * (places + u)[inside]).sum(0) / weight.sum()

# What the contours enclose: areas and middles by the boundary, slice by slice.
with open(contours, newline="") as file:
    rows = [row for row in csv.DictReader(file) if row["structure"] == "CTV"]
levels = np.array([float(s.ImagePositionPatient[2]) for s in slices(run / "ct")])
step = np.diff(levels).mean()
volume, first = 0.0, np.zeros(3)
seen = set()
for _, corners in groupby(rows, key=lambda row: row["contour"]):
    p = np.array([[float(c["x"]), float(c["y"]), float(c["z"])] for c in corners])
    z = p[:, 2].mean()
    check(np.ptp(p[:, 2]) < 1e-3, f"a contour leaves its plane by {np.ptp(p[:, 2])} mm")
    check(np.abs(levels - z).min() < 1e-3, f"a contour lies between slices: {z}")
    seen.add(round(z, 3))
    q = np.roll(p, -1, 0)
    twice = p[:, 0] * q[:, 1] - q[:, 0] * p[:, 1]
    part = abs(twice.sum()) / 2 * step
    volume += part
    first += part * np.append(((p + q)[:, :2] * twice[:, None]).sum(0) / (3 * twice.sum()), z)
found, ml = first / volume, volume / 1000
check(len(seen) >= 2 * radius / step - 2, f"contours in {len(seen)} slices only")
off, moved = found - middle, np.linalg.norm(middle - centre)
print(f"{ml:.3f} ml in the slices, {after:.3f} told; ratio {after / before:.4f}, by the Jacobian {grown:.4f}; {off} mm from the middle by the field, which is {moved:.2f} mm away")
check(abs(ml / after - 1) < 0.02, f"{ml} ml in the slices, {after} told")
check(abs(after / before / grown - 1) < 0.002, f"the volume changes by {after / before}, by the Jacobian {grown}")
check(moved > 1.0 and np.linalg.norm(off[:2]) < 0.1, f"the middle lies {off} mm from where the field leads, {moved} mm away")
# Other slices than those it was drawn on cut the ends elsewhere.
check(abs(off[2]) < 0.1 * step, f"the middle lies {off} mm from where the field leads")
