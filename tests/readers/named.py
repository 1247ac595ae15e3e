"""What tells series apart in a planning system's list: a JSON object per file named."""

import json
import sys

import pydicom

for path in sys.argv[1:]:
    found = pydicom.dcmread(path, stop_before_pixels=True)
    listed = {
        "description": str(found.SeriesDescription),
        "number": int(found.SeriesNumber),
        "content": f"{found.ContentDate} {found.ContentTime}",
        "series": f"{found.SeriesDate} {found.SeriesTime}",
    }
    print(json.dumps(listed))
