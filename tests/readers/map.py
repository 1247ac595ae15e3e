"""map.py FIELDS BEFORE AFTER CT WARPED: SimpleITK takes the fields of `supine warp --fields` in both formats as
displacement field transforms that lead a point of the CT (x,y,z) to where it was carried and back, and the transform beside
them; plastimatch warps the CT by the field as we do and leaves no ghost of the breast."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import SimpleITK as sitk
from grids import check, ghost_ml, in_tissue, series_by_itk

folder = Path(sys.argv[1])
before, after = ([float(x) for x in text.split(",")] for text in sys.argv[2:4])
fields = {}
for name in ("ct_to_deformed", "deformed_to_ct"):
    for ending in ("nrrd", "nii.gz"):
        image = sitk.ReadImage(str(folder / f"{name}.{ending}"), sitk.sitkVectorFloat64)
        check(image.GetNumberOfComponentsPerPixel() == 3, f"{name}.{ending} has no vectors")
        fields[name, ending] = image
    one, other = (fields[name, ending] for ending in ("nrrd", "nii.gz"))
    check(one.GetSize() == other.GetSize(), f"{name}: other sizes")
    check(np.allclose(one.GetOrigin(), other.GetOrigin(), atol=1e-3), f"{name}: other origins")
    off = np.abs(sitk.GetArrayFromImage(one) - sitk.GetArrayFromImage(other)).max()
    check(off == 0, f"{name}: the formats differ by {off} mm")
for ending in ("nrrd", "nii.gz"):
    there = sitk.DisplacementFieldTransform(sitk.Image(fields["ct_to_deformed", ending]))
    here = sitk.DisplacementFieldTransform(sitk.Image(fields["deformed_to_ct", ending]))
    carried = there.TransformPoint(before)
    off = np.linalg.norm(np.subtract(carried, after))
    back = np.linalg.norm(np.subtract(here.TransformPoint(carried), before))
    print(f"{ending}: {off:.3f} mm from the carried point, {back:.3f} mm from where it began")
    check(off < 0.05 and back < 0.05, f"{ending}: {off:.3f} and {back:.3f} mm")
read = sitk.ReadTransform(str(folder / "deformed_to_ct.mat"))
off = np.linalg.norm(np.subtract(read.TransformPoint(after), before))
check(off < 0.05, f"the transform leads {off:.3f} mm away from where the point began")
jacobian = [sitk.GetArrayFromImage(sitk.ReadImage(str(folder / f"jacobian.{e}"))) for e in ("nrrd", "nii.gz")]
check((jacobian[0] == jacobian[1]).all() and jacobian[0].min() > 0, "the Jacobians differ or fold")

# Plastimatch, on an older ITK, warps the CT by the field in NIfTI.
output = folder / "plastimatch.nrrd"
field = folder / "deformed_to_ct.nii.gz"
# It does not read RLE.
plain = folder / "ct.nrrd"
sitk.WriteImage(series_by_itk(sys.argv[4]), str(plain))
words = ["--input", plain, "--fixed", plain, "--xf", field, "--output-img", output, "--default-value", "-1000"]
said = subprocess.run(["plastimatch", "warp", *map(str, words)], capture_output=True, text=True)
check(said.returncode == 0, f"plastimatch: {said.stdout} {said.stderr}")
theirs, ours = (sitk.Cast(sitk.ReadImage(str(path)), sitk.sitkFloat64) for path in (output, sys.argv[5]))
theirs = sitk.Resample(theirs, ours)
ghost, without = ghost_ml(theirs, ours), ghost_ml(sitk.Resample(sitk.ReadImage(str(plain)), ours), ours)
print(f"plastimatch: ghost of {ghost:.4f} ml; without the field {without:.2f} ml")
check(without > 0.3 and ghost < 0.05, f"plastimatch leaves a ghost of {ghost:.3f} ml of {without:.2f} ml")
# The fields are a part of the CT's grid.
back = fields["deformed_to_ct", "nrrd"]
moved = in_tissue(back, sitk.ReadImage(str(folder / "jacobian.nrrd"))) & (np.linalg.norm(sitk.GetArrayFromImage(back), axis=-1) > 0.2)
theirs, ours = (sitk.GetArrayFromImage(sitk.Resample(image, back, sitk.Transform())) for image in (theirs, ours))
off = np.abs(theirs - ours)[moved]
print(f"plastimatch: {moved.sum()} voxels moved, mean difference {off.mean():.2f} HU, 99th percentile {np.percentile(off, 99):.1f} HU")
check(moved.sum() > 10_000 and off.mean() < 1.0, f"plastimatch warps otherwise: {off.mean():.2f} HU")
