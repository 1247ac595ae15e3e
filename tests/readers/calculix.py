"""calculix.py DEFORMED.vtu JOB.frd: the displacement CalculiX found for the problem, beside ours.

Its neo-Hookean law answers a change of volume differently; at these small ones they agree to 1 %."""

import sys

import meshio
import numpy as np
from grids import check

wanted = meshio.read(sys.argv[1]).point_data["displacement"]
found, reading = {}, False
for line in open(sys.argv[2], encoding="ascii", errors="replace"):
    if line.startswith(" -4  DISP"):
        reading, found = True, {}
    elif line.startswith(" -3"):
        reading = False
    elif reading and line.startswith(" -1"):
        # Columns: 3 for the key, 10 for the node, 12 for each component.
        found[int(line[3:13])] = [float(line[13 + 12 * c : 25 + 12 * c]) for c in range(3)]
check(sorted(found) == list(range(1, len(wanted) + 1)), f"{len(found)} nodes, {len(wanted)} ours")
found = np.array([found[node] for node in sorted(found)])
largest = np.linalg.norm(wanted, axis=1).max()
off = np.linalg.norm(found - wanted, axis=1).max()
check(off < 0.01 * largest, f"{off:.3f} mm apart of {largest:.3f} mm")
print(f"{off:.4f} mm apart at most, of {largest:.3f} mm")
