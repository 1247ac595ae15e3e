"""decompress.py SERIES FOLDER: the same data sets with plain pixels, identity kept."""

import sys
from pathlib import Path

import pydicom

series, folder = map(Path, sys.argv[1:])
folder.mkdir()
for file in sorted(series.iterdir()):
    slice_ = pydicom.dcmread(file)
    slice_.decompress(generate_instance_uid=False)
    slice_.save_as(folder / file.name)
