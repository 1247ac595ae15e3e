"""The CT of a breast as it will lie on the operating table.

A :class:`Session` takes the CT of a woman lying on her back, the tilt of the table and whatever else a case file may hold,
and gives labels, mesh, displacement, deformed CT and the tumour's way, each computed when it is asked for and kept until
something that it rests on changes::

    import supine

    session = supine.Session(
        ct="CT_FOLDER",
        breast="left",
        table={"ap": 7.0, "lat": 5.0},                                  # degrees
        tumour={"centre": (91.4, -248.1, -594.5), "radius": 9.0},       # LPS, mm
    )
    print(session.tumour)                  # 2.9 mm (95 %: 0.9 to 10.3 mm)
    image = session.deformed_ct.to_sitk()
    session.run("result")                  # the folder that `supine run` writes

All positions are in the DICOM patient frame LPS (x to the patient's left, y to her back, z to her head), in mm; CT values are
in HU, moduli in kPa, angles in degrees. Voxels are indexed ``[k, j, i]`` (slice, row, column), as SimpleITK gives them.
Arrays that a session gives share its memory and cannot be written to: ``.copy()`` them to change them.

Research software: the deformed CT is a simulation, not acquired anatomy. No clinical use is claimed.
"""

import warnings as _warnings

from ._core import version as _version
from ._carried import Carried, CarriedDose, CarriedPoint, CarriedSegment, CarriedStructure, Fields
from ._error import SupineError, SupineWarning
from ._session import Session, parameters, read_ct
from ._values import Deformation, Interval, Mesh, Tumour, Volume

__version__: str = _version()

# Python shows a warning once per line of code: in a loop over patients the second one's would not be seen.
_warnings.simplefilter("always", SupineWarning, append=False)

__all__ = [
    "Carried",
    "CarriedDose",
    "CarriedPoint",
    "CarriedSegment",
    "CarriedStructure",
    "Deformation",
    "Fields",
    "Interval",
    "Mesh",
    "Session",
    "SupineError",
    "SupineWarning",
    "Tumour",
    "Volume",
    "__version__",
    "parameters",
    "read_ct",
]
