"""series.py SOURCE EXPORT VOLUME: the exported series is the same for pydicom, highdicom and
SimpleITK, is the NRRD volume that supine wrote, and lies on the grid of the source."""

import sys

import numpy as np
import SimpleITK as sitk
from grids import by_highdicom, by_itk, by_pydicom, check, check_same, check_same_grid, of_itk, slices

source, export, volume = sys.argv[1:]
ours = by_pydicom(export)
check_same("highdicom against pydicom", by_highdicom(export), ours)
check_same("SimpleITK against pydicom", by_itk(export), ours)
check_same("the NRRD volume against the series", of_itk(sitk.ReadImage(volume)), ours)

before = by_pydicom(source)
check_same_grid("export against source", ours, before)
for a, b in zip(slices(export), slices(source), strict=True):
    for keyword in ("ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing"):
        check(a[keyword].value == b[keyword].value, f"{keyword} is {a[keyword].value}, not {b[keyword].value}")
    for keyword in ("PatientID", "PatientName", "StudyInstanceUID", "PatientPosition"):
        check(a[keyword].value == b[keyword].value, f"{keyword} is not the source's")
    for keyword in ("SOPInstanceUID", "SeriesInstanceUID", "FrameOfReferenceUID"):
        check(a[keyword].value != b[keyword].value, f"{keyword} is the source's")
    check(list(a.ImageType)[:2] == ["DERIVED", "SECONDARY"], f"Image Type {a.ImageType}")

moved = np.count_nonzero(ours[0] != before[0])
check(moved > 10_000, f"only {moved} voxels changed: nothing was deformed")
check(moved < ours[0].size / 4, f"{moved} of {ours[0].size} voxels changed: more than a breast")
