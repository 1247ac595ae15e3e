"""What a session gives and takes: volumes, meshes, displacements and the tumour's way.

numpy is imported where arrays are worked on, and not before: a script that only writes run folders starts without it.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _core
from ._late import Late
from ._refuse import in_words

if TYPE_CHECKING:
    import nibabel
    import numpy as np
    import numpy.typing as npt
    import pyvista
    import SimpleITK
else:
    modules = ("nibabel", "numpy", "numpy.typing", "pyvista", "SimpleITK")
    nibabel, np, npt, pyvista, SimpleITK = map(Late, modules)

Triple = tuple[float, float, float]
Direction = tuple[Triple, Triple, Triple]

AXES: Direction = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@in_words
@dataclass(frozen=True, eq=False)
class Volume:
    """Voxels on a regular grid in the patient frame LPS.

    Attributes:
        array: the voxels, ``[k, j, i]``; HU of a CT, numbers of tissues of labels, Gy of a dose. Of a field of vectors
            ``[k, j, i, x]``, x being the three components, LPS.
        origin: centre of voxel (0, 0, 0), LPS, mm.
        spacing: distance of voxel centres along i, j, k, mm.
        direction: orthonormal; its columns are the axes i, j, k in LPS, so that voxel (i, j, k) lies at
            ``origin + direction @ (spacing * (i, j, k))``.
    """

    array: npt.NDArray[Any]
    origin: Triple = (0.0, 0.0, 0.0)
    spacing: Triple = (1.0, 1.0, 1.0)
    direction: Direction = AXES

    @property
    def size(self) -> tuple[int, int, int]:
        """Voxels along i, j, k."""
        k, j, i = self.array.shape[:3]
        return (i, j, k)

    @property
    def affine(self) -> npt.NDArray[np.float64]:
        """The matrix (4, 4) from (i, j, k, 1) to LPS, mm."""
        affine = np.eye(4)
        affine[:3, :3] = np.asarray(self.direction) * np.asarray(self.spacing)
        affine[:3, 3] = self.origin
        return affine

    def to_sitk(self) -> SimpleITK.Image:
        """A SimpleITK image of the same voxels at the same place; needs SimpleITK."""
        import SimpleITK

        image = SimpleITK.GetImageFromArray(_no_truths(self.array), isVector=self.array.ndim == 4)
        image.SetOrigin(self.origin)
        image.SetSpacing(self.spacing)
        image.SetDirection([x for row in self.direction for x in row])
        return image

    @classmethod
    def from_sitk(cls, image: SimpleITK.Image) -> Volume:
        """The volume of a SimpleITK image of three dimensions. Its voxels are copied: they go with the image otherwise.

        Raises:
            ValueError: when it has another number of dimensions, or several numbers in a voxel.
        """
        import SimpleITK

        dimensions, numbers = image.GetDimension(), image.GetNumberOfComponentsPerPixel()
        if (dimensions, numbers) != (3, 1):
            raise ValueError(f"the image has {dimensions} dimensions and {numbers} numbers in a voxel: a volume has 3 and 1")
        x = tuple(float(x) for x in image.GetDirection())
        rows = (x[0:3], x[3:6], x[6:9])
        return cls(
            SimpleITK.GetArrayFromImage(image),
            triple(image.GetOrigin()),
            triple(image.GetSpacing()),
            (triple(rows[0]), triple(rows[1]), triple(rows[2])),
        )

    def to_nibabel(self) -> nibabel.Nifti1Image:
        """A NIfTI image (frame RAS, mm) of the same voxels at the same place; needs nibabel.

        Raises:
            ValueError: of a field of vectors, whose axes NIfTI does not tell.
        """
        import nibabel

        if self.array.ndim != 3:
            raise ValueError("NIfTI does not tell in which axes vectors are: take `array` and `affine`, or to_sitk()")
        image = nibabel.Nifti1Image(_no_truths(self.array).transpose(2, 1, 0), _other_frame() @ self.affine)
        image.header.set_xyzt_units("mm")
        return image

    @classmethod
    def from_nibabel(cls, image: nibabel.Nifti1Image) -> Volume:
        """The volume of an image of nibabel (frame RAS, mm) of three dimensions, in LPS; voxels in memory are not copied.

        Raises:
            ValueError: when it has another number of dimensions, or does not say where its voxels lie, in mm.
        """
        affine = _other_frame() @ _affine(image)
        array = np.asanyarray(image.dataobj)
        if array.ndim == 4 and array.shape[3] == 1:
            array = array[..., 0]
        if array.ndim != 3:
            raise ValueError(f"the image has the shape {array.shape}: a volume has three dimensions")
        spacing = np.linalg.norm(affine[:3, :3], axis=0)
        if not np.isfinite(affine).all() or not (spacing > 0).all():
            raise ValueError(f"the affine of the image places no voxels: {image.affine.tolist()}")
        rows = [triple(row) for row in affine[:3, :3] / spacing]
        return cls(array.transpose(2, 1, 0), triple(affine[:3, 3]), triple(spacing), (rows[0], rows[1], rows[2]))

    def to_pyvista(self) -> pyvista.ImageData:
        """A grid with the point data ``values``, LPS, mm; needs pyvista."""
        import pyvista

        grid = pyvista.ImageData(
            dimensions=self.size,
            spacing=self.spacing,
            origin=self.origin,
            direction_matrix=np.asarray(self.direction),
        )
        grid.point_data["values"] = self.array.reshape(-1, *self.array.shape[3:])
        return grid

    def __repr__(self) -> str:
        i, j, k = self.size
        spacing = " x ".join(f"{s:g}" for s in self.spacing)
        return f"Volume({i} x {j} x {k} voxels of {spacing} mm, {self.array.dtype})"


@in_words
@dataclass(frozen=True, eq=False)
class Mesh:
    """Tetrahedra of the soft tissue in the shape of the CT.

    Attributes:
        points: (n, 3), LPS, mm.
        tets: (m, 4), points of each tetrahedron, of positive volume.
        faces: (f, 3), points of each face of the boundary, counter-clockwise seen from outside.
        tags: (f,), what each face is part of: 1 skin, 2 chest wall, 3 the cut through the tissue.
    """

    points: npt.NDArray[np.float64]
    tets: npt.NDArray[np.uint32]
    faces: npt.NDArray[np.uint32]
    tags: npt.NDArray[np.uint8]

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Mesh:
        """The mesh of a ``.vtu`` file (of meshio, VTK, ParaView, this program) or of Gmsh (``.msh`` 4.1, text), LPS, mm.

        A ``.vtu`` holds tetrahedra and the triangles of their boundary with the cell data ``boundary``: 1 skin, 2 chest wall,
        3 cut, and 0 on the tetrahedra. A ``.msh`` has the boundary in physical groups ``skin``, ``chest_wall`` and ``cut``.

        Raises:
            SupineError: when it cannot be read, or a part is missing.
        """
        return cls(*_core.read_mesh(Path(path)))

    def to_pyvista(self) -> pyvista.UnstructuredGrid:
        """An unstructured grid of the tetrahedra, LPS, mm; needs pyvista."""
        import pyvista

        cells = np.column_stack([np.full(len(self.tets), 4, dtype=np.int64), self.tets])
        types = np.full(len(self.tets), int(pyvista.CellType.TETRA), dtype=np.uint8)
        return pyvista.UnstructuredGrid(cells.ravel(), types, np.array(self.points))

    def __repr__(self) -> str:
        return f"Mesh({len(self.tets)} tetrahedra, {len(self.points)} points)"


@in_words
@dataclass(frozen=True, eq=False)
class Deformation:
    """A mesh and the displacement of its nodes.

    Attributes:
        mesh: in the shape of the CT.
        displacement: (n, 3), from the shape of the CT to that on the table, LPS, mm: one row for each point, then, of
            quadratic order, one for the middle of each edge, sorted by the edge's (lower, higher) point.
        order: 1 linear, 2 quadratic within a tetrahedron.
    """

    mesh: Mesh
    displacement: npt.NDArray[np.float64]
    order: int

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Deformation:
        """The mesh and the displacement (point data ``displacement``, mm) of a file as :meth:`Mesh.read` reads it.

        Raises:
            SupineError: when it cannot be read, a part is missing, or there is no displacement.
        """
        mesh, displacement, order = _core.read_deformation(Path(path))
        return cls(Mesh(*mesh), displacement, order)

    @property
    def points(self) -> npt.NDArray[np.float64]:
        """The points of the mesh on the table, (n, 3), LPS, mm."""
        deformed: npt.NDArray[np.float64] = (
            self.mesh.points + self.displacement[: len(self.mesh.points)]
        )
        return deformed

    def to_pyvista(self) -> pyvista.UnstructuredGrid:
        """The mesh in the shape of the CT with the point data ``displacement`` (mm); needs pyvista.

        The tetrahedra are straight: of quadratic order the middles of edges are left out.
        """
        grid = self.mesh.to_pyvista()
        grid.point_data["displacement"] = np.array(self.displacement[: len(self.mesh.points)])
        return grid

    def __repr__(self) -> str:
        length = float(np.linalg.norm(self.displacement, axis=1).max())
        return f"Deformation({self.mesh!r}, order {self.order}, {length:.1f} mm at most)"


@in_words
@dataclass(frozen=True)
class Interval:
    """How sure the tumour's displacement is.

    Attributes:
        level: the probability with which each interval holds the truth.
        within: the tumour's true place lies within this distance of the place given, mm.
        length: of the displacement, mm.
        components: of the displacement along x, y, z (LPS), mm.
        young: of Young's modulus, kPa.
        young_origin: ``"literature"``, ``"given"`` or ``"scans"``.
    """

    level: float
    within: float
    length: tuple[float, float]
    components: tuple[tuple[float, float], tuple[float, float], tuple[float, float]]
    young: tuple[float, float]
    young_origin: str


@in_words
@dataclass(frozen=True)
class Tumour:
    """The tumour's centre in the CT and on the table.

    Attributes:
        before: in the CT, LPS, mm.
        after: on the table, LPS, mm.
        displacement: ``after - before``, mm.
        distance: its length, mm.
        interval: how sure that is; ``None`` where it could not be found.
    """

    before: Triple
    after: Triple
    displacement: Triple
    distance: float
    interval: Interval | None

    def __str__(self) -> str:
        if self.interval is None:
            return f"{self.distance:.1f} mm (how sure is not known)"
        low, high = self.interval.length
        share = 100.0 * self.interval.level
        return f"{self.distance:.1f} mm ({share:g} %: {low:.1f} to {high:.1f} mm)"


def _other_frame() -> npt.NDArray[np.float64]:
    """The matrix from RAS to LPS, and back."""
    return np.diag([-1.0, -1.0, 1.0, 1.0])


def _affine(image: nibabel.Nifti1Image) -> npt.NDArray[np.float64]:
    """The matrix from (i, j, k, 1) to RAS, mm, of an image that says by a code that it is one, as far as it has codes."""
    coded = [getattr(image, name)(coded=True) for name in ("get_sform", "get_qform") if hasattr(image, name)]
    told = [affine for affine, code in coded if code > 0 and affine is not None]
    if image.affine is None or coded and not told:
        raise ValueError("the image does not say which way its axes point: give it an affine (RAS, mm) that does")
    if any(not np.allclose(affine, told[0], rtol=0.0, atol=0.01) for affine in told[1:]):
        raise ValueError("sform and qform of the image contradict each other: give the wrong one the code 0 (unknown)")
    unit = image.header.get_xyzt_units()[0] if hasattr(image.header, "get_xyzt_units") else "mm"
    if unit in ("meter", "micron"):
        raise ValueError(f"the affine of the image is in {unit}s: give it one in mm")
    affine: npt.NDArray[np.float64] = np.asarray(image.affine, dtype=np.float64)
    return affine


def _no_truths(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The array as numbers: images of other libraries hold no truth values."""
    return array.astype(np.uint8) if array.dtype == np.bool_ else array


def triple(values: Any) -> Triple:
    """Three numbers."""
    x, y, z = (float(value) for value in values)
    return (x, y, z)


def tumour(told: dict[str, Any]) -> Tumour:
    """The tumour from what the flow tells."""
    movement, known = told["movement"], told["interval"]
    interval = None
    if known is not None:
        pairs = [(float(low), float(high)) for low, high in known["components_mm"]]
        low, high = known["length_mm"]
        softest, stiffest = known["modulus"]["young_kpa"]
        interval = Interval(
            level=known["level"],
            within=known["within_mm"],
            length=(low, high),
            components=(pairs[0], pairs[1], pairs[2]),
            young=(softest, stiffest),
            young_origin=known["modulus"]["origin"],
        )
    return Tumour(
        before=triple(movement["before_mm"]),
        after=triple(movement["after_mm"]),
        displacement=triple(movement["displacement_mm"]),
        distance=movement["distance_mm"],
        interval=interval,
    )
