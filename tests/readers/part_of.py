"""part_of.py WHOLE AROUND AXIAL BEYOND FINE: volumes of a region, of some slices, of slices that reach beyond the
CT, and of a region in finer voxels have the values of the whole where it is, and air where it is not."""

import sys

import numpy as np
import SimpleITK as sitk
from grids import check

AIR = -1000
whole, around, axial, beyond, fine = (sitk.ReadImage(path) for path in sys.argv[1:])


def values(image):
    return sitk.GetArrayFromImage(image).astype(float)


def of_whole(image, shift=(0.0, 0.0, 0.0)):
    """The whole on the voxels of an image, moved by so many mm."""
    move = sitk.TranslationTransform(3, shift)
    return values(sitk.Resample(whole, image, move, sitk.sitkLinear, AIR, sitk.sitkFloat64))


for name, part in {"around": around, "axial": axial}.items():
    check(np.allclose(part.GetSpacing(), whole.GetSpacing()), f"{name}: spacing {part.GetSpacing()}")
    check(part.GetNumberOfPixels() < whole.GetNumberOfPixels() / 2, f"{name}: {part.GetSize()}")

    # A place is counted from another corner: where a value lies half-way between two whole HU it may be rounded the other way.
    off = np.abs(values(part) - of_whole(part))
    check(off.max() < 1.001, f"{name}: {off.max()} HU off the values of the whole")
    check((off > 1e-3).mean() < 1e-5, f"{name}: {(off > 1e-3).sum()} values differ from the whole's")

ends = [axial.TransformIndexToPhysicalPoint([0, 0, k])[2] for k in (0, axial.GetSize()[2] - 1)]
away = np.abs(np.sort(ends) - [-620, -560])
check((away <= 0.5 * axial.GetSpacing()[2]).all(), f"axial: slices at {ends}")

inside = [whole.TransformIndexToPhysicalPoint([0, 0, k])[2] for k in (0, whole.GetSize()[2] - 1)]
tops = [beyond.TransformIndexToPhysicalPoint([0, 0, k])[2] for k in range(beyond.GetSize()[2])]
outside = np.array([z > max(inside) + whole.GetSpacing()[2] for z in tops])
check(outside.any() and not outside.all(), f"beyond: {tops} of {inside}")
check((values(beyond)[outside] == AIR).all(), "beyond the CT is no air")
check((values(beyond)[~outside] > AIR + 500).any(), "beyond: nothing within the CT")

check(np.allclose(fine.GetSpacing(), 1.0), f"fine: spacing {fine.GetSpacing()}")
right = np.abs(values(fine) - of_whole(fine)).mean()
for axis in np.eye(3):
    for way in (-0.5, 0.5):
        wrong = np.abs(values(fine) - of_whole(fine, tuple(way * axis))).mean()
        check(right < wrong, f"fine: {right} HU off, {wrong} when moved by {way * axis} mm")
