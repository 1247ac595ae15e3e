"""own_objects.py CT FOLDER X,Y,Z: a dose, a structure set and a segmentation of the patient of the series CT, round X,Y,Z
(LPS, mm), which name her and others wherever such objects can: FOLDER/dose.dcm, structures.dcm, segmentation.dcm."""

import sys
from pathlib import Path

import highdicom
import numpy as np
import pydicom
from grids import slices
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.sequence import Sequence
from pydicom.sr.codedict import codes
from pydicom.uid import ExplicitVRLittleEndian
from structures import write_structures

source, folder = sys.argv[1], Path(sys.argv[2])
centre = np.array(sys.argv[3].split(","), float)
ct = slices(source)
RADIUS = 12.0


def named(ds):
    """What hospitals write beside the patient's name."""
    ds.PatientName, ds.PatientID, ds.PatientBirthDate = ct[0].PatientName, ct[0].PatientID, "19610307"
    ds.OperatorsName, ds.ReferringPhysicianName, ds.PhysiciansOfRecord = "Auster^Sieglinde", "Auster^Otto", "Auster^Otto"
    ds.InstitutionName, ds.StationName, ds.AccessionNumber = "Klinik Austerlitz", "AUSTER-WS-7", "ACC0815"
    ds.SeriesDescription, ds.PatientComments = "Fixture for Otto Auster", "daughter of Sieglinde Auster"
    ds.InstanceCreationDate, ds.SeriesDate, ds.ContentDate = "20230416", "20230416", "20230416"
    block = ds.private_block(0x0009, "AUSTER PRIVATE", create=True)
    block.add_new(1, "LO", "private Auster")


def ball(radius):
    drawn, turn = [], np.linspace(0, 2 * np.pi, 90, endpoint=False)[:, None]
    for header in ct:
        off = float(header.ImagePositionPatient[2]) - centre[2]
        if abs(off) < radius:
            ring = centre[:2] + np.sqrt(radius**2 - off**2) * np.hstack([np.cos(turn), np.sin(turn)])
            drawn.append((header, "CLOSED_PLANAR", np.hstack([ring, np.full((90, 1), centre[2] + off)])))
    return drawn


def structures(path):
    near = min(ct, key=lambda s: abs(float(s.ImagePositionPatient[2]) - centre[2]))
    clip = (near, "POINT", centre[None])
    wire = (near, "OPEN_PLANAR", np.array([centre + [x, 0, float(near.ImagePositionPatient[2]) - centre[2]] for x in (-8, 0, 8)]))
    write_structures(path, ct, [
        ("PTV_50.4Gy", "PTV", ball(RADIUS)), ("Clip Auster", "MARKER", [clip]), ("Fixture wire", "ORGAN", [wire]), ("Scar", "SIEGLINDE", ball(RADIUS / 2)),
    ])  # fmt: skip
    ds = pydicom.dcmread(path)
    named(ds)
    ds.StructureSetLabel, ds.StructureSetName, ds.StructureSetDescription = "AUSTER LINKS", "Otto Auster", "by Otto Auster"
    ds.StructureSetROISequence[0].ROIDescription = "drawn with Auster"
    ds.RTROIObservationsSequence[0].ROIObservationLabel, ds.RTROIObservationsSequence[0].ROIInterpreter = "seen by Auster", "Auster^Otto"
    ds.save_as(path)


def dose(path):
    """On a grid of its own, the planes last first."""
    ds, size, step = Dataset(), [30, 28, 20], [4.0, 4.0, 5.0]
    for keyword in ("SpecificCharacterSet", "PatientSex", "StudyInstanceUID", "StudyDate", "StudyTime", "StudyID", "FrameOfReferenceUID"):
        setattr(ds, keyword, ct[0].get(keyword, ""))
    named(ds)
    ds.SOPClassUID, ds.SOPInstanceUID, ds.SeriesInstanceUID = "1.2.840.10008.5.1.4.1.1.481.2", highdicom.UID(), highdicom.UID()
    ds.Modality, ds.Manufacturer, ds.SeriesNumber, ds.InstanceNumber = "RTDOSE", "test", 7, 1
    ds.DoseUnits, ds.DoseType, ds.DoseSummationType, ds.DoseComment = "GY", "PHYSICAL", "PLAN", "boost of Sieglinde Auster"
    plan = Dataset()
    plan.ReferencedSOPClassUID, plan.ReferencedSOPInstanceUID = "1.2.840.10008.5.1.4.1.1.481.5", highdicom.UID()
    ds.ReferencedRTPlanSequence = Sequence([plan])
    low = centre - (np.array(size) - 1) / 2 * step
    k, j, i = np.indices(size[::-1])
    at = low + np.stack([i, j, k], -1) * step
    gy = 20 * np.exp(-((at - centre) ** 2).sum(-1) / 800)
    ds.ImagePositionPatient, ds.ImageOrientationPatient = [f"{v:.6g}" for v in [*low[:2], low[2] + (size[2] - 1) * step[2]]], [1, 0, 0, 0, 1, 0]
    ds.PixelSpacing, ds.Columns, ds.Rows, ds.NumberOfFrames = step[:2], *size
    ds.GridFrameOffsetVector, ds.FrameIncrementPointer = [-n * step[2] for n in range(size[2])], 0x3004000C
    ds.SamplesPerPixel, ds.PhotometricInterpretation, ds.PixelRepresentation = 1, "MONOCHROME2", 0
    ds.BitsAllocated, ds.BitsStored, ds.HighBit, ds.DoseGridScaling = 16, 16, 15, "0.0005"
    ds.PixelData = np.rint(gy[::-1] / 0.0005).astype("<u2").tobytes()
    ds.file_meta = FileMetaDataset()
    ds.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    ds.file_meta.MediaStorageSOPClassUID, ds.file_meta.MediaStorageSOPInstanceUID = ds.SOPClassUID, ds.SOPInstanceUID
    ds.save_as(path, enforce_file_format=True)


def segmentation(path):
    down, across = (float(s) for s in ct[0].PixelSpacing)
    masks = []
    for radius in (RADIUS, RADIUS / 2):
        rows, columns = np.indices((ct[0].Rows, ct[0].Columns))
        origins = [np.array(s.ImagePositionPatient, float) for s in ct]
        square = [(o[0] + columns * across - centre[0]) ** 2 + (o[1] + rows * down - centre[1]) ** 2 + (o[2] - centre[2]) ** 2 for o in origins]
        masks.append(np.array(square) < radius**2)
    described = [
        highdicom.seg.SegmentDescription(
            number, label, codes.SCT.AnatomicalStructure, codes.SCT.Breast, "MANUAL", tracking_id=f"Auster {number}", tracking_uid=highdicom.UID(),
        )
        for number, label in ((1, "Tumor"), (2, "Auster Herd"))
    ]  # fmt: skip
    seg = highdicom.seg.Segmentation(
        ct, np.stack(masks, -1).astype(np.uint8), "BINARY", described, highdicom.UID(), 9, highdicom.UID(), 1, "test", "test", "1", "AUSTER-WS-7",
        content_description="by Auster", content_creator_name="Auster^Otto",
    )  # fmt: skip
    named(seg)
    seg.save_as(path)


structures(folder / "structures.dcm")
dose(folder / "dose.dcm")
segmentation(folder / "segmentation.dcm")
