"""The phantom of the bead: a CT series with a bead of one voxel, a mesh that moves it by a known way, a dose that
peaks in it and circles round it.

`bead.py FOLDER` writes FOLDER/ct, FOLDER/run/mesh/deformed.vtu, FOLDER/dose.dcm, FOLDER/structures.dcm. Row, column and slice distances all
differ, the frames of the dose come last first, and the patient's name is no ASCII.
"""

import sys
from itertools import permutations
from pathlib import Path

import meshio
import numpy as np
from grids import slices
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.sequence import Sequence
from pydicom.uid import ExplicitVRLittleEndian
from structures import write_structures

SIZE = np.array([64, 56, 20])  # columns, rows, slices
STEP = np.array([1.25, 1.5, 3.0])  # column, row, slice distance, mm
ORIGIN = np.array([-40.625, -31.4, -120.7])
BEFORE, AFTER = np.array([40, 18, 9]), np.array([44, 22, 10])  # voxels of the bead
WAY = (AFTER - BEFORE) * STEP  # (5, 6, 3) mm
REACH = 20.0  # mm round the bead within which tissue moves
PEAK = 20.0  # Gy
RADIUS = 10.0  # of the ball that the circles stand for, mm


def place(voxel):
    """Of a voxel's centre, LPS, mm."""
    return ORIGIN + np.asarray(voxel) * STEP


def displacement(points):
    """Of tissue in the CT, mm: WAY in the bead, smoothly 0 at REACH."""
    square = ((points - place(BEFORE)) ** 2).sum(-1) / REACH**2
    return np.clip(1 - square, 0, None)[..., None] ** 2 * WAY


def places():
    """Of all voxels, [k, j, i]."""
    k, j, i = np.indices(SIZE[::-1])
    return place(np.stack([i, j, k], -1))


def uid(number):
    return f"1.2.826.0.1.3680043.10.99.{number}"


def common(kind, number, modality):
    ds = Dataset()
    ds.SpecificCharacterSet = "ISO_IR 192"
    ds.PatientName, ds.PatientID, ds.PatientBirthDate, ds.PatientSex = "Muster^Änne", "SYN-001", "19600101", "F"
    ds.StudyInstanceUID, ds.StudyDate, ds.StudyTime, ds.StudyID = uid(1), "20260105", "101500", "7"
    ds.AccessionNumber, ds.ReferringPhysicianName = "A7", ""
    ds.SOPClassUID, ds.SOPInstanceUID, ds.Modality = kind, uid(number), modality
    ds.FrameOfReferenceUID, ds.PositionReferenceIndicator = uid(2), ""
    ds.Manufacturer = "test"
    return ds


def save(ds, path):
    ds.file_meta = FileMetaDataset()
    ds.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    ds.file_meta.MediaStorageSOPClassUID, ds.file_meta.MediaStorageSOPInstanceUID = ds.SOPClassUID, ds.SOPInstanceUID
    ds.save_as(path, enforce_file_format=True)


def pixels(ds, bits, signed):
    ds.Rows, ds.Columns = int(SIZE[1]), int(SIZE[0])
    ds.PixelSpacing, ds.ImageOrientationPatient = [STEP[1], STEP[0]], [1, 0, 0, 0, 1, 0]
    ds.SamplesPerPixel, ds.PhotometricInterpretation = 1, "MONOCHROME2"
    ds.BitsAllocated = ds.BitsStored = bits
    ds.HighBit, ds.PixelRepresentation = bits - 1, int(signed)


def write_ct(folder):
    """A body, a plate of bone and the bead."""
    at, middle = places(), place(SIZE / 2)
    hu = np.full(SIZE[::-1], -1000)
    hu[(((at - middle) / [34, 36, 40]) ** 2).sum(-1) < 1] = -100
    hu[(np.abs(at[..., 1] - middle[1] - 25) < 3) & (np.abs(at[..., 0] - middle[0]) < 20)] = 700
    hu[tuple(BEFORE[::-1])] = 2000
    folder.mkdir()
    for k in range(SIZE[2]):
        ds = common("1.2.840.10008.5.1.4.1.1.2", 100 + k, "CT")
        ds.ImageType = ["ORIGINAL", "PRIMARY", "AXIAL"]
        ds.SeriesInstanceUID, ds.SeriesNumber, ds.SeriesDescription = uid(3), 3, "Thorax 3.0"
        ds.SeriesDate, ds.SeriesTime, ds.AcquisitionNumber, ds.InstanceNumber = "20260105", "102000", 1, k + 1
        ds.BodyPartExamined, ds.Laterality, ds.PatientPosition, ds.KVP = "BREAST", "L", "HFS", "120"
        ds.SliceThickness = STEP[2]
        ds.ImagePositionPatient = [f"{v:.6g}" for v in place([0, 0, k])]
        ds.RescaleIntercept, ds.RescaleSlope, ds.RescaleType = -1024, 1, "HU"
        pixels(ds, 16, True)
        ds.PixelData = (hu[k] + 1024).astype("<i2").tobytes()
        save(ds, folder / f"{k:03}.dcm")


def write_dose(path):
    """A peak in the bead, 16 bit, on the voxels of the CT; the frames run from the last slice to the first."""
    gy = PEAK * np.exp(-((places() - place(BEFORE)) ** 2).sum(-1) / 200)
    ds = common("1.2.840.10008.5.1.4.1.1.481.2", 200, "RTDOSE")
    ds.SeriesInstanceUID, ds.SeriesNumber, ds.InstanceNumber, ds.OperatorsName = uid(4), 4, 1, ""
    ds.DoseUnits, ds.DoseType, ds.DoseSummationType = "GY", "PHYSICAL", "PLAN"
    plan = Dataset()
    plan.ReferencedSOPClassUID, plan.ReferencedSOPInstanceUID = "1.2.840.10008.5.1.4.1.1.481.5", uid(5)
    ds.ReferencedRTPlanSequence = Sequence([plan])
    ds.ImagePositionPatient = list(place([0, 0, SIZE[2] - 1]).round(6))
    ds.NumberOfFrames, ds.FrameIncrementPointer = int(SIZE[2]), 0x3004000C
    ds.GridFrameOffsetVector = [-k * STEP[2] for k in range(SIZE[2])]
    ds.SliceThickness = STEP[2]
    pixels(ds, 16, False)
    ds.DoseGridScaling = "0.0005"
    ds.PixelData = np.rint(gy[::-1] / 0.0005).astype("<u2").tobytes()
    save(ds, path)


def write_mesh(path, centre, half, edge, displacement):
    """Blocks of six tetrahedra, `half` of them to each side of a corner in `centre`; all of its boundary is held."""
    half, edge = np.array(half), np.array(edge)
    corners = 2 * half + 1
    k, j, i = np.indices(corners[::-1])
    points = centre + (np.stack([i, j, k], -1).reshape(-1, 3) - half) * edge
    strides = np.array([1, corners[0], corners[0] * corners[1]])
    k, j, i = np.indices(corners[::-1] - 1)
    first = np.stack([i, j, k], -1).reshape(-1, 3) @ strides
    tets = []
    for order in permutations(range(3)):
        steps = np.cumsum([0, *strides[list(order)]])
        # Odd orders are mirror images.
        odd = np.linalg.det(np.eye(3)[list(order)]) < 0
        tets.append(first[:, None] + (steps[[0, 1, 3, 2]] if odd else steps))
    tets = np.concatenate(tets)
    faces = np.concatenate([tets[:, [1, 2, 3]], tets[:, [0, 3, 2]], tets[:, [0, 1, 3]], tets[:, [0, 2, 1]]])
    _, where, count = np.unique(np.sort(faces, 1), axis=0, return_index=True, return_counts=True)
    outer = faces[where[count == 1]]
    cells = [("tetra", tets), ("triangle", outer)]
    tags = [np.zeros(len(tets), np.int32), np.full(len(outer), 2, np.int32)]
    path.parent.mkdir(parents=True)
    given = {"displacement": displacement(points)}
    meshio.Mesh(points, cells, point_data=given, cell_data={"boundary": tags}).write(path)


def circle(header, middle, radius):
    """On a slice, of 90 corners."""
    turn = np.linspace(0, 2 * np.pi, 90, endpoint=False)[:, None]
    ring = middle[:2] + radius * np.hstack([np.cos(turn), np.sin(turn)])
    z = float(header.ImagePositionPatient[2])
    return (header, "CLOSED_PLANAR", np.hstack([ring, np.full((90, 1), z)]))


def write_circles(path, ct):
    """A ball round the bead with a point in it, a region without contours, and one where nothing moves."""
    middle, ball = place(BEFORE), []
    for header in ct:
        off = float(header.ImagePositionPatient[2]) - middle[2]
        if abs(off) < RADIUS:
            ball.append(circle(header, middle, np.sqrt(RADIUS**2 - off**2)))
    far = [circle(ct[k], place([12, 40, k]), 5.0) for k in (3, 4)]
    point = (ct[9], "POINT", middle[None])
    wire = (ct[9], "OPEN_PLANAR", middle + np.outer([-8, -4, 0, 4, 8], [1, 0, 0]))
    write_structures(path, ct, [("Clip Höhle", "CTV", [*ball, point, wire]), ("Empty", "ORGAN", []), ("Far", "ORGAN", far)])


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    write_ct(folder / "ct")
    write_mesh(folder / "run/mesh/deformed.vtu", place(BEFORE), [16, 14, 14], [1.25, 1.5, 1.5], displacement)
    write_dose(folder / "dose.dcm")
    write_circles(folder / "structures.dcm", slices(folder / "ct"))
