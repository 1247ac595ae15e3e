"""mirror.py LABELS FILE AXES: a label map with its voxels in reverse order along axes such as `xz`,
on the same grid: the accident of a wrong order of axes. Without axes it is only converted."""

import sys

import SimpleITK as sitk

source, file, axes = sys.argv[1:]
image = sitk.ReadImage(source)
turned = sitk.Flip(image, [axis in axes for axis in "xyz"])
turned.CopyInformation(image)
sitk.WriteImage(turned, file, True)
