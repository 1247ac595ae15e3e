"""The session: what was given, and what follows from it."""

from __future__ import annotations

import datetime
import json
import os
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _core
from ._error import SupineWarning
from ._values import Deformation, Mesh, Tumour, Volume, tumour

if TYPE_CHECKING:
    import numpy as np
    from typing_extensions import Unpack

    from ._parameters import Accepted, Values

Progress = Callable[[str, float], object]


class Session:
    """What was given of a patient, and all that follows from it, in memory.

    Every key of a case file is a keyword (``supine help case`` and :func:`parameters` list them); tables are dicts. Nothing is
    computed before it is asked for. A changed value (:meth:`set`) makes anew only what rests on it. Sessions may be used
    from several threads at once: the work goes on without Python's lock.

    ``ct``, ``labels``, ``mesh`` and ``deformation`` can be set to values of your own, from which all else then follows, and
    deleted again. They are checked and copied once. What follows from values of your own cannot be written by :meth:`run`,
    whose case would not tell of them.

    Args:
        folder: where relative paths lead from; the working folder if it is not given.
        threads: how many to use; 0 for all cores.
        progress: called as ``progress(stage, share)`` while a stage is at work, ``share`` from 0 to 1. What it raises ends the
            work. Ctrl-C does so too.
        values: of the case.

    Raises:
        SupineError: when there is no such key, or a value does not fit.
    """

    _warnings: list[SupineWarning]
    _verdict: dict[str, Any] | None

    def __init__(
        self,
        *,
        folder: str | os.PathLike[str] | None = None,
        threads: int = 0,
        progress: Progress | None = None,
        **values: Unpack[Values],
    ) -> None:
        own = _own(dict(values))
        self.progress = progress
        self._changed()
        given = json.dumps(own.plain)
        self._core = _core.Core(given, Path(folder or Path.cwd()), threads, *_start())
        if own.ct is not None:
            self.ct = own.ct
        if own.labels is not None:
            self.labels = own.labels

    @classmethod
    def read(
        cls,
        case: str | os.PathLike[str],
        *,
        threads: int = 0,
        progress: Progress | None = None,
        **values: Unpack[Values],
    ) -> Session:
        """A session of a case file, or of the ``summary.json`` of a run.

        Args:
            case: the file. Its relative paths lead from its folder.
            threads: how many to use; 0 for all cores.
            progress: as of the class.
            values: take the place of those of the file.

        Raises:
            SupineError: when the file cannot be used.
        """
        own = _own(dict(values))
        session = cls.__new__(cls)
        session.progress = progress
        session._changed()
        session._core = _core.Core.read(Path(case), json.dumps(own.plain), threads, *_start())
        if own.ct is not None:
            session.ct = own.ct
        if own.labels is not None:
            session.labels = own.labels
        return session

    def set(self, **values: Unpack[Values]) -> tuple[str, ...]:
        """Changes values; ``None`` takes one away. The keys of a table that are not named stay as they are.

        Returns:
            The stages whose results no longer hold.

        Raises:
            SupineError: when a value does not fit; all stays as it was then.
        """
        own = _own(dict(values))
        stale = tuple(self._core.merge(json.dumps(own.plain)))
        self._changed()
        if own.ct is not None:
            self.ct = own.ct
        if own.labels is not None:
            self.labels = own.labels
        return stale

    @property
    def case(self) -> dict[str, Any]:
        """Every value of the case, with its defaults: what a summary holds and a case file may hold."""
        case: dict[str, Any] = json.loads(self._core.case())
        return case

    @property
    def ct(self) -> Volume:
        """The CT as it was read, HU."""
        return Volume(*self._core.ct(self._hear))

    @ct.setter
    def ct(self, ct: Volume) -> None:
        import numpy as np

        array = np.ascontiguousarray(ct.array, dtype=_int16(ct.array))
        self._changed()
        self._core.give_ct(array, (ct.origin, ct.spacing, ct.direction))

    @ct.deleter
    def ct(self) -> None:
        self._changed()
        self._core.take_back("import")

    @property
    def labels(self) -> Volume:
        """Tissues on the grid of the CT: 0 outside, 1 soft tissue, 2 chest wall; finer ones 3 lung, 4 bone, 5 muscle (of the
        chest wall), 6 fat, 7 gland, 8 skin, 9 tumour, 10 implant (of the soft tissue)."""
        return Volume(*self._core.labels(self._hear))

    @labels.setter
    def labels(self, labels: Volume) -> None:
        import numpy as np

        array = np.ascontiguousarray(labels.array, dtype=np.uint8)
        if not np.array_equal(array, labels.array):
            raise ValueError("labels are whole numbers from 0 to 10")
        self._changed()
        self._core.give_labels(self._hear, array, (labels.origin, labels.spacing, labels.direction))

    @labels.deleter
    def labels(self) -> None:
        self._changed()
        self._core.take_back("segment")

    @property
    def mesh(self) -> Mesh:
        """The mesh of the soft tissue in the region, in the shape of the CT."""
        return Mesh(*self._core.mesh(self._hear))

    @mesh.setter
    def mesh(self, mesh: Mesh) -> None:
        self._changed()
        self._core.give_mesh(self._hear, _arrays(mesh))

    @mesh.deleter
    def mesh(self) -> None:
        self._changed()
        self._core.take_back("mesh")

    @property
    def deformation(self) -> Deformation:
        """The displacement of the mesh under the table's gravity."""
        mesh, displacement, order = self._core.deformation(self._hear)
        return Deformation(Mesh(*mesh), displacement, order)

    @deformation.setter
    def deformation(self, deformation: Deformation) -> None:
        import numpy as np

        vectors = np.ascontiguousarray(deformation.displacement, dtype=np.float64)
        rows, points = len(vectors), len(deformation.mesh.points)
        # Any other number is refused with what would fit.
        if rows >= points and deformation.order != (order := 1 if rows == points else 2):
            raise ValueError(f"order is {deformation.order}, but there are as many rows as of order {order}")
        self._changed()
        self._core.give_deformation(self._hear, _arrays(deformation.mesh), vectors)

    @deformation.deleter
    def deformation(self) -> None:
        self._changed()
        self._core.take_back("solve")
        self._core.take_back("mesh")

    @property
    def deformed_ct(self) -> Volume:
        """The CT on the operating table, HU, on the grid of the CT."""
        return Volume(*self._core.deformed_ct(self._hear))

    @property
    def tumour(self) -> Tumour:
        """The tumour's centre in the CT and on the table, and how sure its way is.

        How sure it is takes several solves more than :attr:`movement` does.
        """
        return tumour(json.loads(self._core.tumour(self._hear)))

    @property
    def movement(self) -> Tumour:
        """The same without how sure it is: for sweeps over values that only one number is wanted of."""
        movement = json.loads(self._core.movement(self._hear))
        return tumour({"movement": movement, "interval": None})

    @property
    def region(self) -> tuple[tuple[float, float, float], float]:
        """Centre (LPS, mm) and radius (mm) of the sphere that is modelled."""
        return self._core.region(self._hear)

    @property
    def given(self) -> tuple[str, ...]:
        """The stages whose results are your own: ``import``, ``segment``, ``mesh``, ``solve``."""
        return tuple(self._core.given())

    @property
    def nbytes(self) -> int:
        """Memory that results hold, bytes; those that come with least work go first when it gets too much."""
        return self._core.bytes()

    def run(self, out: str | os.PathLike[str], *, overwrite: bool = False) -> dict[str, Any]:
        """Writes the folder that ``supine run`` writes: DICOM series, report, mesh, field, ``summary.json``.

        What the session holds is not computed again, and what an earlier run of the same case left in the folder neither.

        Args:
            out: the folder.
            overwrite: replace the finished result of another case in that folder.

        Returns:
            The summary. ``["verdict"]["colour"]`` is ``"green"``, ``"amber"`` or ``"red"``: a red one is not raised, as the
            result is there; look at it, here or at :attr:`verdict`.

        Raises:
            SupineError: when a stage fails, the folder holds the finished result of another case, or it cannot be written.
        """
        summary: dict[str, Any] = json.loads(self._core.run(self._hear, Path(out), overwrite))
        self._verdict = summary["verdict"]
        return summary

    @property
    def warnings(self) -> tuple[SupineWarning, ...]:
        """All that the session has warned of since it was last changed, each once. They are also issued as Python warnings."""
        return tuple(self._warnings)

    @property
    def verdict(self) -> dict[str, Any] | None:
        """The verdict of the last run, with its reasons; ``None`` before the first one and after a change."""
        return self._verdict

    def _changed(self) -> None:
        """What was told is of what was given before."""
        self._warnings = []
        self._verdict = None

    def _hear(self, kind: str, stage: str, share: float, text: str) -> None:
        if kind == "warning":
            code, _, message = text.partition("\n")
            warning = SupineWarning(message, code, stage)
            if not any((w.stage, w.code, w.message) == (stage, code, message) for w in self._warnings):
                self._warnings.append(warning)
            warnings.warn(warning, stacklevel=3)
        elif self.progress is not None:
            self.progress(stage, share)

    def __repr__(self) -> str:
        return f"Session({json.dumps(self.case)})"


def read_ct(path: str | os.PathLike[str], **accept: Unpack[Accepted]) -> Volume:
    """Reads a CT, HU: a DICOM folder or a file of the series, ``.nrrd``, ``.nii.gz`` or ``.mha``.

    Args:
        path: the folder or file.
        accept: ``series``, ``exclude``, ``assume_hu``, ``equalise_steps`` as in a case file.

    Raises:
        SupineError: when it is not one usable series; the message says which file is wrong and why.
    """
    values: dict[str, Any] = {"ct": path, **accept}
    return Session(**values).ct


def parameters() -> list[dict[str, Any]]:
    """Every key of a case: ``key``, ``kind``, ``within`` (words or range), ``unit``, ``default``, ``help``."""
    rows: list[dict[str, Any]] = json.loads(_core.parameters())
    return rows


class _own:
    """Values of a case, apart from volumes that were given in place of files."""

    def __init__(self, values: dict[str, Any]) -> None:
        self.ct = values.pop("ct") if isinstance(values.get("ct"), Volume) else None
        self.labels = values.pop("labels") if isinstance(values.get("labels"), Volume) else None
        self.plain = _plain(values)


def _plain(value: Any) -> Any:
    """A value as JSON has it."""
    if isinstance(value, dict):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(inner) for inner in value]
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, (str, bool, int, float)) or value is None:
        return value
    # numpy's arrays and numbers, also those that are no floats of Python.
    return value.tolist() if hasattr(value, "tolist") else value


def _arrays(mesh: Mesh) -> _core.MeshArrays:
    import numpy as np

    return (
        np.ascontiguousarray(mesh.points, dtype=np.float64),
        np.ascontiguousarray(mesh.tets, dtype=np.uint32),
        np.ascontiguousarray(mesh.faces, dtype=np.uint32),
        np.ascontiguousarray(mesh.tags, dtype=np.uint8),
    )


def _int16(array: Any) -> type[np.int16]:
    """The type of a CT, where its values fit: HU beyond it, or parts of HU, are refused and not cut off."""
    import numpy as np

    if np.asarray(array).dtype != np.int16:
        values = np.asarray(array)
        if not np.array_equal(values, values.astype(np.int16)):
            raise ValueError("a CT is whole HU from -32768 to 32767: round it first")
    return np.int16


def _start() -> tuple[str, list[str]]:
    """When and by which command it began, as a summary tells."""
    return (datetime.datetime.now().strftime("%Y-%m-%d %H:%M:%S"), [sys.executable, *sys.argv])
