"""convert.py SERIES FILE: a DICOM series as SimpleITK writes it in the format of the file's name."""

import sys

import SimpleITK as sitk
from grids import series_by_itk

sitk.WriteImage(sitk.Cast(series_by_itk(sys.argv[1]), sitk.sitkInt16), sys.argv[2], True)
