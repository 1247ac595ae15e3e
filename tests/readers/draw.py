"""draw.py SOURCE FILE X,Y,Z RADIUS: a structure set by pydicom, drawn on the slices of SOURCE: `CTV`, a ball
round X,Y,Z (LPS, mm) with a point in its middle, and `Spine`, a ball that lies behind every breast."""

import sys

import numpy as np
from grids import slices
from structures import write_structures

source, file = sys.argv[1:3]
centre, radius = np.array(sys.argv[3].split(","), float), float(sys.argv[4])
ct = slices(source)


def ball(centre, radius):
    """Circles of 90 corners."""
    drawn, turn = [], np.linspace(0, 2 * np.pi, 90, endpoint=False)[:, None]
    for header in ct:
        row, column = np.array(header.ImageOrientationPatient, float).reshape(2, 3)
        normal = np.cross(row, column)
        off = np.dot(np.array(header.ImagePositionPatient, float) - centre, normal)
        if abs(off) < radius:
            r = np.sqrt(radius**2 - off**2)
            points = centre + off * normal + r * (np.cos(turn) * row + np.sin(turn) * column)
            drawn.append((header, "CLOSED_PLANAR", points))
    return drawn


middle = min(ct, key=lambda s: abs(float(s.ImagePositionPatient[2]) - centre[2]))
spine = centre * [0, 0, 1] + [0, -120, 0]
regions = [("CTV", "CTV", [*ball(centre, radius), (middle, "POINT", centre[None])]), ("Spine", "ORGAN", ball(spine, 15.0))]
write_structures(file, ct, regions)
