"""What tells series apart in a planning system's list: a JSON object per file named."""

import json
import sys

import pydicom

for path in sys.argv[1:]:
    found = pydicom.dcmread(path, stop_before_pixels=True)
    listed = {
        "description": str(found.SeriesDescription),
        "number": int(found.SeriesNumber),
        # A structure set has dates of its own.
        "content": " ".join(
            str(found.get(f"Content{what}", found.get(f"StructureSet{what}"))) for what in ("Date", "Time")
        ),
        "series": f"{found.SeriesDate} {found.SeriesTime}",
    }
    print(json.dumps(listed))
