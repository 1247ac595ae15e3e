"""What the tissue carries along: fields, points, and the patient's own doses, structures and segmentations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ._late import Late
from ._refuse import in_words
from ._values import Triple, Volume, triple

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from . import _core
else:
    np, npt = map(Late, ("numpy", "numpy.typing"))


@in_words
@dataclass(frozen=True, eq=False)
class Fields:
    """The displacement on voxels of the CT, as a run writes it to ``field``; what lies beyond these voxels does not move.

    Attributes:
        deformed_to_ct: vectors (mm, LPS) by which a resampler of images makes the deformed CT: what lies at x on the table
            comes from x + v(x) of the CT.
        ct_to_deformed: vectors (mm, LPS) by which points move: what lies at x in the CT comes to x + v(x) on the table;
            beside the skin, as far as marks on it are carried, they follow the skin.
        jacobian: volume on the table over that in the CT, at the voxels of the CT; 1 outside the mesh.
    """

    deformed_to_ct: Volume
    ct_to_deformed: Volume
    jacobian: Volume


@in_words
@dataclass(frozen=True)
class CarriedPoint:
    """A point in the CT and on the table.

    Attributes:
        name: that of its file, or ``"nipple"``.
        before: in the CT, LPS, mm.
        after: on the table, LPS, mm.
        inside: whether it lies in the mesh; outside nothing is known to move, and ``after`` is ``before``.
    """

    name: str
    before: Triple
    after: Triple
    inside: bool


@in_words
@dataclass(frozen=True, eq=False)
class CarriedDose:
    """A dose of ``carry.dose``: a deformed dose, and not the one that a plan would give to the deformed patient.

    Attributes:
        file: the name of its file.
        before: as it was given, Gy, on its own grid.
        after: what the tissue that now lies at a place had received, Gy, on the same grid.
    """

    file: str
    before: Volume
    after: Volume


@in_words
@dataclass(frozen=True, eq=False)
class CarriedStructure:
    """A region with contours of ``carry.structures``.

    Attributes:
        file: the name of its file.
        name: its own.
        before: its closed contours as they were drawn, each (n, 3), LPS, mm; inner ones are holes.
        after: those where the tissue carries it, in the slices of the CT.
        volume: before and after, ml.
    """

    file: str
    name: str
    before: tuple[npt.NDArray[np.float64], ...]
    after: tuple[npt.NDArray[np.float64], ...]
    volume: tuple[float, float]


@in_words
@dataclass(frozen=True, eq=False)
class CarriedSegment:
    """A segment of ``carry.segmentation`` on the voxels of the CT.

    Attributes:
        file: the name of its file.
        name: its own.
        before: as it was given, true within it.
        after: where the tissue carries it.
        volume: before and after, ml.
    """

    file: str
    name: str
    before: Volume
    after: Volume
    volume: tuple[float, float]


@in_words
@dataclass(frozen=True, eq=False)
class Carried:
    """The patient's own objects where the tissue carries them, in the order of the case.

    Attributes:
        doses: of ``carry.dose``.
        structures: of ``carry.structures``.
        segments: of ``carry.segmentation``.
    """

    doses: tuple[CarriedDose, ...]
    structures: tuple[CarriedStructure, ...]
    segments: tuple[CarriedSegment, ...]


def point(told: dict[str, Any]) -> CarriedPoint:
    """A point from what the flow tells: of the nipple, neither name nor doubt."""
    name, inside = told.get("name", "nipple"), told.get("inside", True)
    return CarriedPoint(name, triple(told["before_mm"]), triple(told["after_mm"]), inside)


def carried(told: _core.Carried) -> Carried:
    """The objects from what the flow gives."""
    doses, structures, segments = told
    return Carried(
        tuple(CarriedDose(file, Volume(*before), Volume(*after)) for file, before, after in doses),
        tuple(
            CarriedStructure(file, name, tuple(before), tuple(after), volume)
            for file, name, before, after, volume in structures
        ),
        tuple(
            CarriedSegment(file, name, Volume(*before), Volume(*after), volume)
            for file, name, before, after, volume in segments
        ),
    )
