"""registration.py SOURCE RUN: the deformable registration of a run, taken from its bytes, is the run's own field between its
places, and numpy makes the exported CT of the source with it."""

import json
import sys
from pathlib import Path

import numpy as np
import pydicom
import SimpleITK as sitk
from grids import check, cubic, in_tissue, of_itk, origins, series_by_itk, slices

source, run = Path(sys.argv[1]), Path(sys.argv[2])
reg = pydicom.dcmread(run / "registration/deformable.dcm")
item = reg.DeformableRegistrationSequence[0]
first, second = slices(source)[0], slices(run / "ct")[0]
check(item.SourceFrameOfReferenceUID == first.FrameOfReferenceUID, "frame of the source")
check(reg.FrameOfReferenceUID == second.FrameOfReferenceUID != first.FrameOfReferenceUID, "frame of the deformed CT")
grid = item.DeformableRegistrationGridSequence[0]
nx, ny, nz = grid.GridDimensions
vectors = np.frombuffer(grid.VectorGridData, "<f4").reshape(nz, ny, nx, 3).astype(float)
row, column = np.array(grid.ImageOrientationPatient, float).reshape(2, 3)
field = sitk.GetImageFromArray(vectors, isVector=True)
field.SetOrigin([float(v) for v in grid.ImagePositionPatient])
field.SetSpacing([float(v) for v in grid.GridResolution])
field.SetDirection(np.array([row, column, np.cross(row, column)]).T.ravel().tolist())
for axis in range(3):
    ends = np.take(vectors, [0, -1], axis)
    check((ends == 0).all(), f"vectors at the border of axis {axis}")

# What lies between its places, against the run's own field, in the tissue.
exact = sitk.ReadImage(str(run / "field/deformed_to_ct.nrrd"))
truth = of_itk(exact)[0].astype(float)
found = sitk.Resample(field, exact, sitk.Transform(), sitk.sitkLinear, 0.0, sitk.sitkVectorFloat64)
between = of_itk(found)[0]
tissue = in_tissue(exact, sitk.ReadImage(str(run / "field/jacobian.nrrd")))
moved = tissue & (truth != 0).any(-1)
off = np.linalg.norm(between - truth, axis=-1)[moved]
said = json.loads((run / "summary.json").read_text())["export"]["registration"]
print(f"{moved.sum()} voxels: {off.mean():.4f} mm off in the mean, {np.quantile(off, 0.99):.4f} at 99 %, {off.max():.4f} at most; said {said}")
# The summary counts the voxels at the skin too, which are told from air here only by their neighbours.
check(0.7 < moved.sum() / said["voxels"] <= 1, f"{said['voxels']} voxels in the summary, {moved.sum()} here")
check(abs(off.mean() - said["mean_mm"]) < 3e-3 and off.max() < said["max_mm"] + 1e-3, "the summary says otherwise")

# The CT that it makes, in the tissue and away from the skin, where a voxel holds air too.
ct, deformed = series_by_itk(source), series_by_itk(run / "ct")
made = sitk.GetArrayFromImage(sitk.Resample(ct, deformed, sitk.DisplacementFieldTransform(field), sitk.sitkLinear, -1000.0))
meant = sitk.GetArrayFromImage(deformed)
# The field is a part of the CT's grid.
there = sitk.Resample(deformed, exact, sitk.Transform(), sitk.sitkNearestNeighbor)
difference = np.abs(cubic(ct, origins(found, moved)) - of_itk(there)[0][moved])
undeformed = sitk.Resample(ct, exact, sitk.Transform(), sitk.sitkNearestNeighbor)
plain = np.abs(of_itk(undeformed)[0] - of_itk(there)[0])[moved]
print(f"in the tissue: {difference.mean():.2f} HU off the exported CT in the mean, {np.quantile(difference, 0.99):.1f} at 99 %; without the registration {plain.mean():.2f} HU")
check(difference.mean() < 2 and difference.mean() < 0.1 * plain.mean(), "the registration makes another CT")

# Where the breast was and now is air, wholly or in part: the vectors alone leave no ghost of it.
before = sitk.GetArrayFromImage(ct)
left = before - meant > 200
ghost = (left & (made - meant > 0.5 * (before - meant))).sum() * np.prod(deformed.GetSpacing()) / 1000
all_left = left.sum() * np.prod(deformed.GetSpacing()) / 1000
print(f"{all_left:.2f} ml were left; ghost of {ghost:.3f} ml; {vectors.size * 4 / 1e6:.2f} MB of vectors")
check(left.sum() > 1000, "nothing was left")
check(ghost < 0.02 * all_left, f"{ghost:.2f} ml of a ghost")
