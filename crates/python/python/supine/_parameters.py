"""Types of all keywords. Made from the table of parameters by tests/write_parameters.py; do not edit."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, TypedDict

import numpy as np
import numpy.typing as npt

from ._late import Late
from ._values import Volume

if TYPE_CHECKING:
    import nibabel
    import SimpleITK
else:
    nibabel, SimpleITK = map(Late, ("nibabel", "SimpleITK"))

Place = str | os.PathLike[str]
Array = npt.NDArray[np.floating[Any]] | npt.NDArray[np.integer[Any]]
Point = Sequence[float] | Array


class Table(TypedDict, total=False):
    """The table `table`."""

    ap: float | None
    """Tilt of the table: positive raises the head (degrees); -180 to 180. Default: required."""
    lat: float | None
    """Tilt of the table: positive lowers the patient's left side (degrees); -180 to 180. Default: required."""


class Tumour(TypedDict, total=False):
    """The table `tumour`."""

    centre: Point | None
    """Centre of the tumour in the CT (LPS) (mm). Default: required, or `tumour.structure`."""
    radius: float | None
    """Radius of the tumour (mm); 0.5 to 50. Default: required, or `tumour.structure`."""
    structure: str | None
    """Name of the tumour's region in a structure set: its centroid is the centre, the radius that of the sphere of
    its volume. Default: centre and radius."""
    file: Place | None
    """RT structure set of the CT that holds this region. Default: centre and radius."""


class Report(TypedDict, total=False):
    """The table `report`."""

    seen: str | Sequence[str] | None
    """Warnings that the planner has looked at, as the page ticks them: the report says so. Default: none."""


class Dose(TypedDict, total=False):
    """The table `dose`."""

    tolerance: float | None
    """The same asked as an error of the dose of a kilovoltage source, which falls as 1/r³; with both the less holds
    (%); 0.1 to 500. Default: in millimetres, by `tolerance`."""
    at: float | None
    """How far from the centre of the applicator, with dose.tolerance (mm); 1 to 100. Default: 17.5: the surface of
    a sphere of 35 mm."""


class Posture(TypedDict, total=False):
    """The table `posture`."""

    arms: Literal["unknown", "as in the CT", "moved"] | None
    """How her arms lie on the table: where they are moved the breast goes along by millimetres, which no simulation
    tells. Default: "unknown"."""
    breathing: float | None
    """How far breath takes the breast, at 95 % probability (mm); 0 to 20. Default: 2."""


class Region(TypedDict, total=False):
    """The table `region`."""

    centre: Point | None
    """Centre of the sphere that is modelled (LPS) (mm). Default: found from the breast."""
    radius: float | None
    """Radius of the sphere that is modelled (mm); 0.1 to 500. Default: found from the breast."""


class Mesh(TypedDict, total=False):
    """The table `mesh`."""

    tetrahedra: int | None
    """Number of tetrahedra; 1 to 2e+06. Default: 5000."""
    order: int | None
    """Order of the displacement within a tetrahedron: 1 linear, 2 quadratic; 1 to 2. Default: 2."""
    geometry: Literal["straight", "curved"] | None
    """Geometry of the elements on skin and chest wall: curved ones follow the surface between their corners (order
    2, mechanics only). Default: "straight"."""
    mesher: Literal["native", "cgal", "tetgen"] | None
    """What makes the tetrahedra; cgal and tetgen in programs built with them. Default: "native"."""
    piece: Literal["largest", "centre"] | None
    """Which of several separate pieces of soft tissue in the sphere: the largest, or the one that holds the centre.
    Default: "largest"."""
    refine: Literal["none", "tumour", "goal"] | None
    """Where the tetrahedra are smaller: in and around the tumour, or where its displacement depends on them.
    Default: "none"."""
    tumour_edge: float | None
    """Longest edge wanted in the tumour, with refine = "tumour" (mm); 0.1 to 50. Default: 4."""
    tumour_growth: float | None
    """Growth of that length with the distance from the tumour, with refine = "tumour" (mm/mm); 0.05 to 2. Default:
    0.5."""


class Tissue(TypedDict, total=False):
    """The table `tissue`."""

    young: float | None
    """Young's modulus (kPa); 0.001 to 1e+06. Default: 0.609."""
    poisson: float | None
    """Poisson's ratio; 0 to 0.4998. Default: 0.45."""
    density: float | None
    """Density (kg/m3); 1 to 20000. Default: 1000."""
    law: Literal["neo-hookean", "exponential", "gent", "yeoh"] | None
    """How tissue resists beyond small strain: all but neo-hookean stiffen. Default: "neo-hookean"."""
    stiffening: float | None
    """How much the shear modulus grows by unit of Q = tr C - 3 - 2 ln J at small strain, with a law that stiffens;
    0.001 to 20. Default: 1.5."""
    fibres: float | None
    """Young's modulus that fibres from the chest wall to the skin add along themselves in tension, over that of the
    tissue; 0: none; 0 to 1000. Default: 0."""
    fibre_stiffening: float | None
    """K of the fibres, how fast they stiffen, with fibres; 0.001 to 100. Default: 1."""
    fibre_direction: Point | None
    """Which way the fibres run in the CT (LPS), of any length, with fibres. Default: from the chest wall to the
    skin."""
    rest: Literal["net", "unloaded"] | None
    """Rest state: net takes the CT shape as free of stress, unloaded finds the shape without gravity first.
    Default: "net"."""
    cut: Literal["spring", "free", "fixed"] | None
    """What stands for the tissue beyond the sphere: springs, nothing, or everything held. Default: "spring"."""
    spring: float | None
    """Stiffness of the springs, with cut = "spring" (kPa/mm); 0 to 1e+06. Default: that of a layer as thick as the
    cut."""
    map: Literal["none", "labels", "hu"] | None
    """A modulus for each tissue, from the finer labels or from the HU between fat and gland. Default: "none"."""
    fat: float | None
    """Young's modulus of fat, with a map; with `scans.sitting` the moduli say proportions, and are fitted if none
    is given (kPa); 0.001 to 1e+06. Default: in proportion."""
    gland: float | None
    """Young's modulus of gland, with a map (kPa); 0.001 to 1e+06. Default: 1.5 x fat."""
    skin: float | None
    """Young's modulus of skin, with a map (kPa); 0.001 to 1e+06. Default: 16 x fat."""
    tumour: float | None
    """Young's modulus of the tumour, with a map (kPa); 0.001 to 1e+06. Default: 6 x fat."""
    young_interval: Sequence[float] | Array | None
    """Interval that holds the modulus of this patient with 95 % probability (kPa); 0.001 to 1e+06. Default: that of
    published moduli, 0.23 to 2.43."""


class Wall(TypedDict, total=False):
    """The table `wall`."""

    hold: Literal["held", "sliding"] | None
    """Whether the tissue is held on the chest wall or slides on it below the breast. Default: "held"."""
    shear: float | None
    """Shear traction per way that it slid, with hold = "sliding"; 0: without friction (kPa/mm); 0 to 1e+06.
    Default: 0.02."""
    radius: float | None
    """Radius of the part of the wall on which it slides; over the outer third it is held more and more, with hold =
    "sliding" (mm); 1 to 500. Default: 60."""
    centre: Point | None
    """Middle of that part, with hold = "sliding" (mm). Default: the point of the wall below the middle of the
    breast."""


class Skin(TypedDict, total=False):
    """The table `skin`."""

    young: float | None
    """Young's modulus of the skin as a membrane on the tissue (kPa); 0.001 to 1e+06. Default: skin is tissue."""
    thickness: float | None
    """Thickness of that membrane, with a modulus of the skin (mm); 0.1 to 10. Default: 1.5."""
    stretch: float | None
    """How far it is stretched where the tissue is free of stress, with a modulus of the skin; 1: not at all; 1 to
    2. Default: 1."""


class Scans(TypedDict, total=False):
    """The table `scans`."""

    sitting: Place | None
    """Surface scan of the patient sitting upright, arms and torso as in the CT (.ply, .stl, .obj): the modulus is
    fitted to it. Default: the modulus is not fitted."""
    supine: Place | None
    """Surface scan of the patient lying as in the CT, held against the skin of the CT. Default: nothing."""
    intraop: Place | None
    """Surface scan of the patient on the operating table: the CT's skin, the default tissue's and the result's are
    held against it. Default: nothing."""
    landmarks: Place | None
    """Landmarks of the scans and the CT (.json), three or more that each scan and the CT have. Default: poses are
    searched."""
    laws: bool | None
    """Hold laws of the tissue and its boundary against the scan of the sitting patient; not where the case names
    one. Default: true."""
    lean: float | None
    """How far she leaned back in the scan of the sitting patient, as it was measured; less than 0: forward
    (degrees); -30 to 60. Default: upright, 0."""
    unit: Literal["auto", "mm", "cm", "m", "inch"] | None
    """Unit of length of the scans and their landmarks; auto: mm or m, by the size of the scan. Default: "auto"."""


class Seeds(TypedDict, total=False):
    """The table `seeds`."""

    file: Place | Sequence[Place] | None
    """Seeds: .mrk.json, .csv, .seg.nrrd, .nrrd, .nii.gz, .mha or a folder of masks. Default: automatic."""
    chest_wall: Sequence[Point] | Array | None
    """Points in the chest wall (LPS) (mm). Default: none."""
    soft_tissue: Sequence[Point] | Array | None
    """Points in the soft tissue (LPS) (mm). Default: none."""
    exclude: Sequence[Point] | Array | None
    """Points on what is no part of the patient (LPS) (mm). Default: none."""
    strokes: Sequence[Mapping[str, Any]] | None
    """Strokes of a brush, as the page paints them: tissue chest_wall, soft_tissue, exclude or erase; a later one
    counts. Default: none."""


class Labels(TypedDict, total=False):
    """The table `labels`."""

    file: Place | None
    """Your own segmentation: label map, DICOM segmentation or structure set. Default: automatic."""
    body: str | Sequence[str] | None
    """Regions of that file that are the body. Default: by type, code and name."""
    soft_tissue: str | Sequence[str] | None
    """Regions of that file that are the soft tissue. Default: the body without the chest wall."""
    chest_wall: str | Sequence[str] | None
    """Regions of that file that are the chest wall. Default: by type, code and name."""


class Warp(TypedDict, total=False):
    """The table `warp`."""

    interpolation: Literal["cubic", "linear", "lanczos3"] | None
    """Between voxels: linear blurs edges and noise most, lanczos3 least, which is slow. Default: "cubic"."""


class Carry(TypedDict, total=False):
    """The table `carry`."""

    points: Place | Sequence[Place] | None
    """Points to carry along: .csv name,x,y,z or .mrk.json. Default: none."""
    dose: Place | Sequence[Place] | None
    """RT doses to carry along. Default: none."""
    structures: Place | Sequence[Place] | None
    """RT structure sets to carry along. Default: none."""
    segmentation: Place | Sequence[Place] | None
    """DICOM segmentations to carry along. Default: none."""


class Export(TypedDict, total=False):
    """The table `export`."""

    anonymise: bool | None
    """Take the patient out of all that leaves (PS3.15). Default: false."""
    study: Literal["source", "new"] | None
    """The study of the exported series. Default: "source"."""
    equipment: Literal["supine", "scanner"] | None
    """The equipment that the exported series names. Default: "supine"."""
    frame: Literal["new", "source, although the breast has moved in it"] | None
    """The frame of reference of the exported series. Default: "new"."""
    padding: Literal["source", "clipped"] | None
    """What the source has below -1024 HU, outside the reconstruction circle: as it is there, or clipped to -1024
    HU. Default: "source"."""
    registration: bool | None
    """Registrations with the CT beside the exported series; not with its frame of reference. Default: true."""
    structures: bool | None
    """A structure set of body, chest wall, breast and tumour beside the exported series. Default: true."""
    pdf: bool | None
    """What the report says first, as a PDF in a DICOM object beside the exported series. Default: false."""
    clock: str | None
    """Date and time that the exported objects bear, YYYY-MM-DD HH:MM:SS. Default: the time of the run."""


class Accepted(TypedDict, total=False):
    """What may be wrong with a CT, and which one it is."""

    series: str | None
    """Series Instance UID, when the folder holds several series. Default: the only one."""
    exclude: str | Sequence[str] | None
    """Files of the CT to leave out, by their paths below its folder. Default: none."""
    assume_hu: bool | None
    """Take stored values for HU where Rescale Slope and Intercept are missing; air must then lie near -1000.
    Default: false."""
    equalise_steps: bool | None
    """Interpolate slices at unequal steps, or with one missing, to equal steps (up to 10 mm apart). Default: false."""


class Values(Accepted, total=False):
    """Every key of a case."""

    ct: Volume | SimpleITK.Image | nibabel.Nifti1Image | Place | None
    """The CT: DICOM folder or a file of it, .nrrd, .nii.gz or .mha. Default: required."""
    position: Literal["supine", "prone", "left_side", "right_side", "upright"] | None
    """How the patient lay or sat when the CT was taken, which is held against Patient Position, table and lungs.
    Default: "supine"."""
    breast: Literal["left", "right"] | None
    """The patient's side. Default: required."""
    tolerance: float | None
    """Error of the tumour's position, at 95 % probability, up to which the verdict is green (mm); 0.1 to 50.
    Default: 2."""
    tissues: bool | None
    """Label fat, gland, skin, tumour and implant too, for the report. Default: false."""
    table: Table | None
    tumour: Tumour | None
    report: Report | None
    dose: Dose | None
    posture: Posture | None
    region: Region | None
    mesh: Mesh | None
    tissue: Tissue | None
    wall: Wall | None
    skin: Skin | None
    scans: Scans | None
    seeds: Place | Seeds | None
    labels: Volume | SimpleITK.Image | nibabel.Nifti1Image | npt.NDArray[Any] | Place | Labels | None
    warp: Warp | None
    carry: Carry | None
    export: Export | None
