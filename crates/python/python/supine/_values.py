"""What a session gives and takes: volumes, meshes, displacements and the tumour's way.

numpy is imported where arrays are worked on, and not before: a script that only writes run folders starts without it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import nibabel
    import numpy as np
    import numpy.typing as npt
    import pyvista
    import SimpleITK

Triple = tuple[float, float, float]
Direction = tuple[Triple, Triple, Triple]

AXES: Direction = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))



@dataclass(frozen=True, eq=False)
class Volume:
    """Voxels on a regular grid in the patient frame LPS.

    Attributes:
        array: the voxels, ``[k, j, i]``; HU of a CT, numbers of tissues of labels.
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
        k, j, i = self.array.shape
        return (i, j, k)

    @property
    def affine(self) -> npt.NDArray[np.float64]:
        """The matrix (4, 4) from (i, j, k, 1) to LPS, mm."""
        import numpy as np

        affine = np.eye(4)
        affine[:3, :3] = np.asarray(self.direction) * np.asarray(self.spacing)
        affine[:3, 3] = self.origin
        return affine

    def to_sitk(self) -> SimpleITK.Image:
        """A SimpleITK image of the same voxels at the same place; needs SimpleITK."""
        import SimpleITK

        image = SimpleITK.GetImageFromArray(self.array)
        image.SetOrigin(self.origin)
        image.SetSpacing(self.spacing)
        image.SetDirection([x for row in self.direction for x in row])
        return image

    @classmethod
    def from_sitk(cls, image: SimpleITK.Image) -> Volume:
        """The volume of a SimpleITK image of three dimensions; its voxels are not copied."""
        import SimpleITK

        x = tuple(float(x) for x in image.GetDirection())
        rows = (x[0:3], x[3:6], x[6:9])
        return cls(
            SimpleITK.GetArrayViewFromImage(image),
            _triple(image.GetOrigin()),
            _triple(image.GetSpacing()),
            (_triple(rows[0]), _triple(rows[1]), _triple(rows[2])),
        )

    def to_nibabel(self) -> nibabel.Nifti1Image:
        """A NIfTI image (frame RAS, mm) of the same voxels at the same place; needs nibabel."""
        import nibabel
        import numpy as np

        to_ras = np.diag([-1.0, -1.0, 1.0, 1.0])
        image = nibabel.Nifti1Image(self.array.transpose(2, 1, 0), to_ras @ self.affine)
        image.header.set_xyzt_units("mm")
        return image

    def to_pyvista(self) -> pyvista.ImageData:
        """A grid with the point data ``values``, LPS, mm; needs pyvista."""
        import numpy as np
        import pyvista

        grid = pyvista.ImageData(
            dimensions=self.size,
            spacing=self.spacing,
            origin=self.origin,
            direction_matrix=np.asarray(self.direction),
        )
        grid.point_data["values"] = self.array.reshape(-1)
        return grid

    def __repr__(self) -> str:
        i, j, k = self.size
        spacing = " x ".join(f"{s:g}" for s in self.spacing)
        return f"Volume({i} x {j} x {k} voxels of {spacing} mm, {self.array.dtype})"


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

    def to_pyvista(self) -> pyvista.UnstructuredGrid:
        """An unstructured grid of the tetrahedra, LPS, mm; needs pyvista."""
        import numpy as np
        import pyvista

        cells = np.column_stack([np.full(len(self.tets), 4, dtype=np.int64), self.tets])
        types = np.full(len(self.tets), int(pyvista.CellType.TETRA), dtype=np.uint8)
        return pyvista.UnstructuredGrid(cells.ravel(), types, np.array(self.points))

    def __repr__(self) -> str:
        return f"Mesh({len(self.tets)} tetrahedra, {len(self.points)} points)"


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
        import numpy as np

        grid = self.mesh.to_pyvista()
        grid.point_data["displacement"] = np.array(self.displacement[: len(self.mesh.points)])
        return grid

    def __repr__(self) -> str:
        import numpy as np

        length = float(np.linalg.norm(self.displacement, axis=1).max())
        return f"Deformation({self.mesh!r}, order {self.order}, {length:.1f} mm at most)"


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


def _triple(values: Any) -> Triple:
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
        before=_triple(movement["before_mm"]),
        after=_triple(movement["after_mm"]),
        displacement=_triple(movement["displacement_mm"]),
        distance=movement["distance_mm"],
        interval=interval,
    )
