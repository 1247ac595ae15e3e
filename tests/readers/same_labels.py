"""same_labels.py A B: two label maps are the same, voxel by voxel."""

import sys

import SimpleITK as sitk
from grids import check_same, of_itk

check_same("labels", *(of_itk(sitk.ReadImage(path)) for path in sys.argv[1:]))
