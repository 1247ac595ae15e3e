"""meta_image.py write CT FOLDER: SimpleITK writes a CT as ct.mha, compressed, and as ct.mhd with ct.raw.
meta_image.py same A B ...: SimpleITK reads the same voxels at the same places from each."""

import sys
from pathlib import Path

import SimpleITK as sitk
from grids import check_same, of_itk, series_by_itk

if sys.argv[1] == "write":
    ct, folder = sitk.Cast(series_by_itk(sys.argv[2]), sitk.sitkInt16), Path(sys.argv[3])
    sitk.WriteImage(ct, str(folder / "ct.mha"), True)
    sitk.WriteImage(ct, str(folder / "ct.mhd"), False)
else:
    first, *others = [of_itk(sitk.ReadImage(name)) for name in sys.argv[2:]]
    for name, other in zip(sys.argv[3:], others):
        check_same(name, first, other)
    print(f"{first[0].size} voxels, from {first[0].min()} to {first[0].max()}")
