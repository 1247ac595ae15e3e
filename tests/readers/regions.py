"""regions.py SOURCE LABELS FOLDER: the labels as other programs export them: `seg.dcm` by highdicom
(body and chest wall in codes, names in German), `rtss.dcm` by pydicom (contours round the pixels)."""

import sys
from pathlib import Path

import highdicom
import numpy as np
import SimpleITK as sitk
from grids import slices
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.sequence import Sequence
from pydicom.sr.codedict import codes
from pydicom.uid import ExplicitVRLittleEndian

SOFT, WALL = 1, 2

source, labels, folder = sys.argv[1:]
ct = slices(source)
array = sitk.GetArrayFromImage(sitk.ReadImage(labels))
body, wall = array > 0, array == WALL


def description(number, name, category, kind):
    return highdicom.seg.SegmentDescription(
        number, name, category, kind, highdicom.seg.SegmentAlgorithmTypeValues.MANUAL
    )


def write_segmentation(path):
    segments = [
        description(1, "Umriss", codes.SCT.AnatomicalStructure, codes.SCT.EntireBody),
        description(2, "Brustwand", codes.SCT.AnatomicalStructure, codes.SCT.ChestWall),
    ]
    seg = highdicom.seg.Segmentation(
        ct, np.stack([body, wall], -1), highdicom.seg.SegmentationTypeValues.BINARY, segments,
        highdicom.UID(), 77, highdicom.UID(), 1, "nobody", "hand", "1", "0", content_label="LABELS",
    )
    seg.save_as(path)


def outlines(mask):
    """Closed chains of pixel corners (row, column) round a mask, inside on one side."""
    padded = np.pad(mask, 1)
    ends = {}

    def edges(inside, outside, start, end):
        for j, i in np.argwhere(inside & ~outside):
            ends.setdefault((j + start[0], i + start[1]), []).append((j + end[0], i + end[1]))

    edges(mask, padded[:-2, 1:-1], (0, 0), (0, 1))
    edges(mask, padded[1:-1, 2:], (0, 1), (1, 1))
    edges(mask, padded[2:, 1:-1], (1, 1), (1, 0))
    edges(mask, padded[1:-1, :-2], (1, 0), (0, 0))
    chains = []
    while ends:
        start = at = next(iter(ends))
        chain = []
        while True:
            chain.append(at)
            following = ends[at].pop()
            if not ends[at]:
                del ends[at]
            at = following
            if at == start:
                break
        chains.append(np.array(chain) - 0.5)
    return chains


def contours(mask):
    drawn = []
    for header, plane in zip(ct, mask, strict=True):
        origin = np.array(header.ImagePositionPatient, float)
        row, column = np.array(header.ImageOrientationPatient, float).reshape(2, 3)
        down, across = (float(s) for s in header.PixelSpacing)
        for chain in outlines(plane):
            c, image = Dataset(), Dataset()
            image.ReferencedSOPClassUID, image.ReferencedSOPInstanceUID = header.SOPClassUID, header.SOPInstanceUID
            c.ContourImageSequence, c.ContourGeometricType = Sequence([image]), "CLOSED_PLANAR"
            points = origin + chain[:, 1:] * across * row + chain[:, :1] * down * column
            c.NumberOfContourPoints, c.ContourData = len(points), [f"{v:.3f}" for v in points.ravel()]
            drawn.append(c)
    return drawn


def write_structures(path):
    ds = Dataset()
    for keyword in ("PatientName", "PatientID", "PatientBirthDate", "PatientSex", "StudyInstanceUID", "StudyDate", "StudyTime"):
        setattr(ds, keyword, ct[0].get(keyword, ""))
    ds.SOPClassUID, ds.SOPInstanceUID = "1.2.840.10008.5.1.4.1.1.481.3", highdicom.UID()
    ds.Modality, ds.SeriesInstanceUID, ds.StructureSetLabel = "RTSTRUCT", highdicom.UID(), "TEST"
    regions = [("Patient Outline", "EXTERNAL", body), ("CHEST_WALL", "", wall), ("Heart", "ORGAN", wall[:0])]
    ds.StructureSetROISequence, ds.ROIContourSequence, ds.RTROIObservationsSequence = Sequence(), Sequence(), Sequence()
    for number, (name, kind, mask) in enumerate(regions, 1):
        roi, drawn, seen = Dataset(), Dataset(), Dataset()
        roi.ROINumber, roi.ROIName, roi.ROIGenerationAlgorithm = number, name, "MANUAL"
        roi.ReferencedFrameOfReferenceUID = ct[0].FrameOfReferenceUID
        drawn.ReferencedROINumber, drawn.ContourSequence = number, Sequence(contours(mask) if len(mask) else [])
        seen.ObservationNumber, seen.ReferencedROINumber, seen.RTROIInterpretedType = number, number, kind
        for sequence, item in zip((ds.StructureSetROISequence, ds.ROIContourSequence, ds.RTROIObservationsSequence), (roi, drawn, seen)):
            sequence.append(item)
    ds.file_meta = FileMetaDataset()
    ds.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    ds.file_meta.MediaStorageSOPClassUID, ds.file_meta.MediaStorageSOPInstanceUID = ds.SOPClassUID, ds.SOPInstanceUID
    ds.save_as(path, enforce_file_format=True)


write_segmentation(Path(folder) / "seg.dcm")
write_structures(Path(folder) / "rtss.dcm")
