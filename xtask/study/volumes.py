"""Volumes from files and from folders of DICOM. Needs SimpleITK."""
import os

import SimpleITK as sitk


def read(path):
    """A file, or the longest series of a folder."""
    if not os.path.isdir(path):
        return sitk.ReadImage(path)
    reader = sitk.ImageSeriesReader()
    series = [reader.GetGDCMSeriesFileNames(path, uid) for uid in reader.GetGDCMSeriesIDs(path)]
    reader.SetFileNames(max(series, key=len))
    return reader.Execute()
