"""The session: what was given, and what follows from it."""

from __future__ import annotations

import datetime
import json
import os
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, SupportsIndex

from . import _carried, _core, _given
from ._carried import Carried, CarriedPoint, Fields
from ._core import Core
from ._error import SupineWarning
from ._late import Late
from ._refuse import Case, check_keywords, no_attribute
from ._values import Deformation, Mesh, Tumour, Volume, tumour

if TYPE_CHECKING:
    import nibabel
    import numpy as np
    import numpy.typing as npt
    import SimpleITK
    from typing_extensions import Unpack

    from . import _parameters
else:
    try:
        from typing import Unpack
    except ImportError:  # Before 3.11, where the keywords of a session cannot be told one by one.
        from typing import Union as Unpack

    nibabel, np, npt, SimpleITK = map(Late, ("nibabel", "numpy", "numpy.typing", "SimpleITK"))
    _parameters = Late("supine._parameters")

Progress = Callable[[str, float], object]


class Session:
    """What was given of a patient, and all that follows from it, in memory.

    Every key of a case file is a keyword (``supine help case`` and :func:`parameters` list them); tables are dicts. Nothing is
    computed before it is asked for. A changed value (:meth:`set`) makes anew only what rests on it. Sessions may be used
    from several threads at once: the work goes on without Python's lock.

    ``ct``, ``labels``, ``mesh`` and ``deformation`` can be set to values of your own, from which all else then follows, and
    deleted again. They are checked and copied once. :meth:`run` writes labels of your own beside the result, so that its case
    tells of them; what follows from another CT, mesh or displacement it refuses.

    Volumes that are given, here or by their properties, are a :class:`Volume`, or an image of SimpleITK or nibabel, which know
    their axes. Labels may also be an array in the order of ``ct.array``, ``[k, j, i]`` (slice, row, column).

    A session cannot be copied or pickled, nor used in another process after a fork; its results can.

    Args:
        folder: where relative paths lead from; the working folder if it is not given.
        threads: how many to use, 1 to 1024; all cores if it is not given.
        progress: called as ``progress(stage, share)`` while a stage is at work, ``share`` from 0 to 1. What it raises ends the
            work. Ctrl-C does so too.
        values: of the case.

    Raises:
        SupineError: when there is no such key, or a value does not fit.
        TypeError, ValueError: when `threads`, `progress` or a volume is none.
    """

    progress: Progress | None
    """Called while a stage is at work; may be changed at any time."""
    _works: tuple[int, Core]
    _warnings: list[SupineWarning]
    _verdict: dict[str, Any] | None

    def __init__(
        self,
        *,
        folder: str | os.PathLike[str] | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
        **values: Unpack[_parameters.Values],
    ) -> None:
        check_keywords(values, ("folder", "threads", "progress"))
        own, workers = _given.Own(dict(values)), _given.threads(threads)
        self.progress = progress
        self._changed()
        core = _core.Core(json.dumps(own.plain), Path(folder or Path.cwd()), workers, *_start())
        self._works = (os.getpid(), core)
        self._take(own)

    @classmethod
    def read(
        cls,
        case: str | os.PathLike[str],
        *,
        threads: int | None = None,
        progress: Progress | None = None,
        **values: Unpack[_parameters.Values],
    ) -> Session:
        """A session of a case file, or of the ``summary.json`` of a run.

        Args:
            case: the file. Its relative paths lead from its folder.
            threads: how many to use, 1 to 1024; all cores if it is not given.
            progress: as of the class.
            values: take the place of those of the file.

        Raises:
            SupineError: when the file cannot be used.
        """
        check_keywords(values, ("threads", "progress"))
        own, workers = _given.Own(dict(values)), _given.threads(threads)
        session = cls.__new__(cls)
        session.progress = progress
        session._changed()
        core = _core.Core.read(Path(case), json.dumps(own.plain), workers, *_start())
        session._works = (os.getpid(), core)
        session._take(own)
        return session

    def set(self, **values: Unpack[_parameters.Values]) -> tuple[str, ...]:
        """Changes values; ``None`` takes one away. The keys of a table that are not named stay as they are. A file takes the place of
        a CT or labels in memory, and so does ``None``.

        Returns:
            The stages whose results no longer hold.

        Raises:
            SupineError: when a value does not fit; all stays as it was then. A CT or labels in memory are looked at after that: where
                they are refused the values have changed.
        """
        own = _given.Own(dict(values))
        stale = tuple(self._core.merge(json.dumps(own.plain)))
        self._changed()
        # Another file, or none, takes the place of what was given in memory.
        for key, stage in (("ct", "import"), ("labels", "segment")):
            if key in own.plain:
                self._core.take_back(stage)
        self._take(own)
        return stale

    @property
    def _core(self) -> Core:
        """What works. After a fork its threads are in the other process, and whoever waits for them waits for ever."""
        process, core = self._works
        if process != os.getpid():
            raise RuntimeError(
                "a session works in the process alone that made it: hand session.case over, and make another there, "
                "supine.Session(**case)"
            )
        return core

    def _take(self, own: _given.Own) -> None:
        """Takes volumes that were given in place of files."""
        if own.ct is not None:
            self.ct = own.ct
        if own.labels is not None:
            self.labels = own.labels

    @property
    def case(self) -> dict[str, Any]:
        """Every value of the case, with its defaults: what a summary holds and a case file may hold.

        It is for looking alone: values are changed by :meth:`set`. Another session of the same case is
        ``Session(**session.case)``.
        """
        case: dict[str, Any] = json.loads(self._core.case(), object_hook=Case)
        return case

    @property
    def ct(self) -> Volume:
        """The CT as it was read, HU."""
        return Volume(*self._core.ct(self._hear))

    @ct.setter
    def ct(self, ct: Volume | SimpleITK.Image | nibabel.Nifti1Image) -> None:
        given = _given.volume("ct", ct)
        array, place = _given.whole("HU of a CT", given.array, 3, np.int16), _given.geometry(given)
        self._changed()
        self._core.give_ct(array, place)

    @ct.deleter
    def ct(self) -> None:
        self._changed()
        self._core.take_back("import")

    @property
    def labels(self) -> Volume:
        """Tissues on the grid of the CT, ``[k, j, i]``: 0 outside, 1 soft tissue, 2 chest wall; finer ones 3 lung, 4 bone, 5 muscle (of the
        chest wall), 6 fat, 7 gland, 8 skin, 9 tumour, 10 implant (of the soft tissue)."""
        return Volume(*self._core.labels(self._hear))

    @labels.setter
    def labels(self, labels: Volume | SimpleITK.Image | nibabel.Nifti1Image | npt.NDArray[Any]) -> None:
        given = _given.volume("labels", labels, lambda: self.ct)
        array = _given.whole("labels", given.array, 3, np.uint8, _given.LAST_LABEL)
        place = _given.geometry(given)
        self._changed()
        self._core.give_labels(self._hear, array, place)

    @labels.deleter
    def labels(self) -> None:
        self._changed()
        self._core.take_back("segment")

    @property
    def mesh(self) -> Mesh:
        """The mesh of the soft tissue in the region, in the shape of the CT; one's own may be given by the path of a file that
        :meth:`Mesh.read` reads."""
        return Mesh(*self._core.mesh(self._hear))

    @mesh.setter
    def mesh(self, mesh: Mesh | str | os.PathLike[str]) -> None:
        arrays = _given.mesh_arrays(Mesh.read(mesh) if isinstance(mesh, (str, os.PathLike)) else mesh)
        self._changed()
        self._core.give_mesh(self._hear, arrays)

    @mesh.deleter
    def mesh(self) -> None:
        self._changed()
        self._core.take_back("mesh")

    @property
    def deformation(self) -> Deformation:
        """The displacement of the mesh under the table's gravity; one's own may be given by the path of a file that
        :meth:`Deformation.read` reads."""
        mesh, displacement, order = self._core.deformation(self._hear)
        return Deformation(Mesh(*mesh), displacement, order)

    @deformation.setter
    def deformation(self, deformation: Deformation | str | os.PathLike[str]) -> None:
        if isinstance(deformation, (str, os.PathLike)):
            deformation = Deformation.read(deformation)
        arrays, vectors = _given.deformation_arrays(deformation)
        self._changed()
        self._core.give_deformation(self._hear, arrays, vectors)

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
    def fields(self) -> Fields:
        """The displacement and its Jacobian on voxels of the CT, as a run writes them to ``field``."""
        return Fields(*(Volume(*parts) for parts in self._core.fields(self._hear)))

    @property
    def tissues(self) -> Volume | None:
        """Labels of the finer tissues, numbered as those of :attr:`labels`; ``None`` where the case does not ask for them by
        ``tissues`` or ``tissue.map``."""
        parts = self._core.tissues(self._hear)
        return None if parts is None else Volume(*parts)

    @property
    def points(self) -> tuple[CarriedPoint, ...]:
        """The points of ``carry.points`` in the CT and on the table."""
        told = json.loads(self._core.points(self._hear))
        return tuple(map(_carried.point, told["points"]))

    @property
    def nipple(self) -> CarriedPoint | None:
        """The nipple in the CT and on the table; ``None`` where none was found in the tissue that is modelled."""
        told = json.loads(self._core.points(self._hear))["nipple"]
        return None if told is None else _carried.point(told)

    @property
    def carried(self) -> Carried:
        """The doses, structures and segmentations of ``carry`` where the tissue carries them. They need a CT of DICOM.

        Raises:
            SupineError: when one cannot be read, or belongs to another CT or patient.
        """
        return _carried.carried(self._core.carried(self._hear))

    @property
    def fit(self) -> dict[str, Any] | None:
        """The modulus that fits the scans, as ``fit`` of a summary tells it; ``None`` where the case names none."""
        fit: dict[str, Any] | None = json.loads(self._core.fit(self._hear))
        return fit

    @property
    def evaluation(self) -> dict[str, Any] | None:
        """How far a scan on the operating table lies off the result, as ``evaluation`` of a summary tells it; ``None`` where the
        case names none."""
        evaluation: dict[str, Any] | None = json.loads(self._core.evaluation(self._hear))
        return evaluation

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

        What the session holds is not computed again, and what an earlier run of the same case left in the folder neither. Its
        results can be had from the session afterwards.

        Labels of one's own are written to ``own_labels.nrrd`` in the folder, and the case of the summary names that file: the run
        can be repeated from its summary. For that all that rests on them is computed anew, from the file.

        Args:
            out: the folder.
            overwrite: replace the finished result of another case in that folder.

        Returns:
            The summary. ``["verdict"]["colour"]`` is ``"green"``, ``"amber"`` or ``"red"``: a red one is not raised, as the
            result is there; look at it, here or at :attr:`verdict`.

        Raises:
            SupineError: when a stage fails, the folder holds the finished result of another case, it cannot be written, or the CT,
                mesh or displacement is one's own.
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
            warnings.warn(warning, stacklevel=_outside())
        elif self.progress is not None:
            self.progress(stage, share)

    if not TYPE_CHECKING:  # Types refuse it too, and would take this for leave to set anything.

        def __setattr__(self, name: str, value: Any) -> None:
            if name == "progress":
                _given.progress(value)
            elif type(self) is Session and name not in SETTABLE:
                raise no_attribute(name, SETTABLE, dir(Session))
            object.__setattr__(self, name, value)

    def __reduce_ex__(self, protocol: SupportsIndex) -> NoReturn:
        raise TypeError(
            "a session works and holds memory of its own, so that it cannot be copied or pickled: make another of the same case, "
            "supine.Session(**session.case), where it is needed, or take results (session.labels, session.deformation), which can"
        )

    def __repr__(self) -> str:
        return f"Session({json.dumps(self.case)})"


# What can be set of a session.
SETTABLE = frozenset(
    name for name, of in vars(Session).items() if isinstance(of, property) and of.fset is not None
).union(Session.__annotations__)


def read_ct(path: str | os.PathLike[str], **accept: Unpack[_parameters.Accepted]) -> Volume:
    """Reads a CT, HU: a DICOM folder or a file of the series, ``.nrrd``, ``.nii.gz`` or ``.mha``.

    Args:
        path: the folder or file.
        accept: ``series``, ``exclude``, ``assume_hu``, ``equalise_steps`` as in a case file.

    Raises:
        SupineError: when it is not one usable series, or holds no HU of a patient in air; the message says which file is wrong
            and why.
    """
    values: dict[str, Any] = {"ct": path, **accept}
    return Session(**values).ct


def parameters() -> list[dict[str, Any]]:
    """Every key of a case: ``key``, ``kind``, ``within`` (words or range), ``unit``, ``default``, ``help``."""
    rows: list[dict[str, Any]] = json.loads(_core.parameters())
    return rows


def _outside() -> int:
    """How far up the first frame lies that is not of this package, as `warnings` counts: a warning is shown where the work was asked
    for, whether by a property, a keyword or a call."""
    level, frame = 1, sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__package__") == __package__:
        level, frame = level + 1, frame.f_back
    return level


def _start() -> tuple[str, list[str]]:
    """When and by which command it began, as a summary tells."""
    return (datetime.datetime.now().strftime("%Y-%m-%d %H:%M:%S"), [sys.executable, *sys.argv])
