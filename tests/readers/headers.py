"""headers.py FOLDER KEYWORD=VALUE ...: the DICOM files of a folder with these values in their headers."""

import pathlib
import sys

import pydicom

folder, *changes = sys.argv[1:]
for path in pathlib.Path(folder).iterdir():
    if path.suffix == ".txt":
        continue
    header = pydicom.dcmread(path)
    for change in changes:
        keyword, value = change.split("=", 1)
        setattr(header, keyword, value)
    header.save_as(path)
