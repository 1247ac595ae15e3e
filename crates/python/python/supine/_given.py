"""What users give, made ready for the flow: nothing is rounded, cut off or guessed, and what cannot be taken is refused in words."""

from __future__ import annotations

import math
import operator
import os
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ._late import Late
from ._refuse import unfit
from ._values import Deformation, Mesh, Volume, triple

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from . import _core
else:
    np, npt = map(Late, ("numpy", "numpy.typing"))

# As the command line has it: more than there are processors gain nothing.
MOST_THREADS = 1024
# The largest number of a tissue: an implant.
LAST_LABEL = 10


def threads(given: object) -> int:
    """A number of threads as the flow takes it, where 0 stands for all cores.

    Raises:
        TypeError: when it is no whole number.
        ValueError: when it is not from 1 to 1024.
    """
    if given is None:
        return 0
    words = f"threads is a whole number from 1 to {MOST_THREADS}, not {given!r}; leave it out for all cores"
    if isinstance(given, bool) or not hasattr(given, "__index__"):
        raise TypeError(words)
    number = operator.index(given)
    if not 1 <= number <= MOST_THREADS:
        raise ValueError(words)
    return number


def progress(given: object) -> None:
    """Refuses what cannot be called.

    Raises:
        TypeError: then.
    """
    if given is not None and not callable(given):
        raise TypeError(f"progress is called as progress(stage, share), or None: {given!r} cannot be called")


class Own:
    """Values of a case, apart from volumes that were given in place of files."""

    def __init__(self, values: dict[str, Any]) -> None:
        self.ct = values.pop("ct") if is_voxels(values.get("ct")) else None
        self.labels = values.pop("labels") if is_voxels(values.get("labels")) else None
        self.plain = {key: plain(key, value) for key, value in values.items()}


def plain(key: str, value: Any) -> Any:
    """A value of a key as JSON has it.

    Raises:
        SupineError: when no case can hold it; it names the key.
    """
    if isinstance(value, Mapping):
        return {str(inner): plain(f"{key}.{inner}", of) for inner, of in value.items()}
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    if isinstance(value, str):
        return _text(key, value)
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, (int, float)):
        return _number(key, value)
    if isinstance(value, Sequence) and not isinstance(value, (bytes, bytearray, memoryview)):
        return [plain(key, inner) for inner in value]
    # Arrays and numbers of numpy and those who do as it does.
    if hasattr(value, "tolist"):
        return plain(key, value.tolist())
    raise unfit(key, f"{type(value).__name__} is no type of a case: give text, numbers, a path, a list or a dict")


def _text(key: str, value: str) -> str:
    try:
        value.encode()
    except UnicodeEncodeError:
        raise unfit(key, f"{value!r} holds bytes that are no text: give it another name") from None
    return value


def _number(key: str, value: float) -> float:
    try:
        finite = math.isfinite(value)
    except OverflowError:
        finite = False
    if not finite:
        raise unfit(key, f"{value!s:.40} is not a finite number; leave the key out, or give None, for its default")
    return value


def is_voxels(value: Any) -> bool:
    """Whether it stands for voxels in memory, and not for a file or a table."""
    return isinstance(value, Volume) or _is_sitk(value) or _is_nibabel(value) or _is_array(value)


def _is_sitk(value: Any) -> bool:
    return all(hasattr(value, name) for name in ("GetSpacing", "GetOrigin", "GetDirection"))


def _is_nibabel(value: Any) -> bool:
    return hasattr(value, "affine") and hasattr(value, "dataobj")


def _is_array(value: Any) -> bool:
    return hasattr(value, "__array__") and hasattr(value, "shape")


def volume(name: str, given: Any, of_ct: Callable[[], Volume] | None = None) -> Volume:
    """The volume of an image of SimpleITK or nibabel, or of an array on the grid of the CT, where `of_ct` gives that.

    Raises:
        TypeError: when it is none of these.
        ValueError: when its voxels have no place in three dimensions, or an array has another shape than the CT.
    """
    if isinstance(given, Volume):
        return given
    if _is_sitk(given):
        if any(of.__module__.partition(".")[0] == "SimpleITK" for of in type(given).__mro__):
            return Volume.from_sitk(given)
        raise TypeError(
            f"`{name}`: an image of {type(given).__module__.partition('.')[0]} is not known: give supine.Volume(array, origin, "
            "spacing, direction), an image of SimpleITK or one of nibabel"
        )
    if _is_nibabel(given):
        return Volume.from_nibabel(given)
    if not _is_array(given):
        raise TypeError(
            f"`{name}` in memory is a supine.Volume, or an image of SimpleITK or nibabel, not a {type(given).__name__}; a file is "
            f"named by session.set({name}=...)"
        )
    if of_ct is None:
        raise TypeError(f"`{name}`: an array does not say where its voxels lie: give supine.Volume(array, origin, spacing, direction)")
    return _on_grid(name, np.asarray(given), of_ct())


def _on_grid(name: str, array: npt.NDArray[Any], ct: Volume) -> Volume:
    """An array [k, j, i] in the place of the CT."""
    if array.shape != ct.array.shape:
        turned = array.shape == ct.array.shape[::-1]
        how = "transpose it, array.transpose(2, 1, 0)" if turned else "for another grid give a supine.Volume, which says where it lies"
        raise ValueError(
            f"`{name}`: the array has the shape {array.shape}, and the CT, indexed [k, j, i], {ct.array.shape}: {how}"
        )
    return Volume(array, ct.origin, ct.spacing, ct.direction)


def real(what: str, given: Any, dimensions: int) -> npt.NDArray[np.float64]:
    """Finite numbers in so many dimensions.

    Raises:
        ValueError: when they are none.
    """
    array = _numbers(what, given, dimensions)
    return np.ascontiguousarray(array, dtype=np.float64)


def whole(
    what: str, given: Any, dimensions: int, kind: type[np.integer[Any]], last: int | None = None
) -> npt.NDArray[Any]:
    """Whole numbers of a kind of numpy's, up to the `last` of them.

    Raises:
        ValueError: when there are others.
    """
    array = _numbers(what, given, dimensions)
    if array.dtype == kind and last is None:
        return np.ascontiguousarray(array)
    low, high = np.iinfo(kind).min, np.iinfo(kind).max if last is None else last
    wrong = (array < low) | (array > high)
    if array.dtype.kind == "f":
        wrong |= array != np.floor(array)
    if wrong.any():
        raise ValueError(f"{what} are whole numbers from {low} to {high}, and {array[wrong][0]:g} is none: round it or change it first")
    return np.ascontiguousarray(array, dtype=kind)


def _numbers(what: str, given: Any, dimensions: int) -> npt.NDArray[Any]:
    array = np.asarray(given)
    if array.dtype.kind not in "buif":
        raise ValueError(f"{what} are numbers, not of the type {array.dtype}")
    if array.ndim != dimensions:
        raise ValueError(f"{what} are an array of {dimensions} dimensions, not of the shape {array.shape}")
    if array.dtype.kind == "f" and not (finite := np.isfinite(array)).all():
        first = np.argwhere(~finite)[0].tolist()
        raise ValueError(f"{what} are finite numbers: {np.count_nonzero(~finite)} are NaN or infinite, the first at {first}")
    return array


def geometry(given: Volume) -> _core.Geometry:
    """Where the voxels of a volume lie.

    Raises:
        ValueError: when the numbers are too few or too many.
    """
    rows = _triples("direction", given.direction, (3, 3))
    origin, spacing = (_triples(name, of, (3,)) for name, of in (("origin", given.origin), ("spacing", given.spacing)))
    return (triple(origin), triple(spacing), (triple(rows[0]), triple(rows[1]), triple(rows[2])))


def _triples(name: str, given: Any, shape: tuple[int, ...]) -> npt.NDArray[np.float64]:
    try:
        array = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != shape:
        words = "three numbers (x, y, z)" if shape == (3,) else "three rows of three numbers, as a matrix is written"
        raise ValueError(f"the {name} of a volume is {words}, not {given!r}")
    return array


def mesh_arrays(given: Any) -> _core.MeshArrays:
    """The arrays of a mesh.

    Raises:
        TypeError: when it is none.
        ValueError: when its arrays hold other numbers than those of a mesh.
    """
    if not isinstance(given, Mesh):
        raise TypeError(
            f"a mesh is a supine.Mesh or the path of a .vtu or .msh file, not a {type(given).__name__}; a grid of pyvista or a mesh "
            "of meshio with the cell data `boundary` can be saved as .vtu and given by its path"
        )
    return (
        real("points of a mesh", given.points, 2),
        whole("tetrahedra of a mesh", given.tets, 2, np.uint32),
        whole("faces of a mesh", given.faces, 2, np.uint32),
        whole("tags of a mesh", given.tags, 1, np.uint8),
    )


def deformation_arrays(given: Any) -> tuple[_core.MeshArrays, npt.NDArray[np.float64]]:
    """The arrays of a mesh, and the vectors of its nodes.

    Raises:
        TypeError: when it is no displacement.
        ValueError: when its arrays hold other numbers, or fewer or more of them than its order says.
    """
    if not isinstance(given, Deformation):
        raise TypeError(
            "a displacement is a supine.Deformation, or the path of a .vtu or .msh file with the point data `displacement`, not a "
            f"{type(given).__name__}"
        )
    vectors = real("vectors of a displacement", given.displacement, 2)
    rows, points = len(vectors), len(given.mesh.points)
    # Any other number is refused with what would fit.
    if rows >= points and given.order != (order := 1 if rows == points else 2):
        raise ValueError(f"order is {given.order}, but there are as many rows as of order {order}")
    return (mesh_arrays(given.mesh), vectors)
