"""Writes the files of this folder with tools that are not ours.

Run with numpy, pydicom, highdicom and Pillow (OpenJPEG) installed, in this folder. The grid is oblique, of unequal
spacing, and its frames have no whole number of bytes. Of voxel (i, j, k) the label is
1 for 3 <= i < 15 and 2 <= j < 17 and k != 2, but 2 within that for i >= 9 - k.
"""

import highdicom as hd
import numpy as np
import pydicom
from PIL import Image
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.sequence import Sequence
from pydicom.sr.codedict import codes
from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian, ImplicitVRLittleEndian

COLUMNS, ROWS, SLICES = 21, 19, 6
SPACING = (0.75, 1.25, 2.5)
ORIGIN = np.array([-20.25, 5.5, 100.125])
ANGLE = 0.3
ROW = np.array([np.cos(ANGLE), np.sin(ANGLE), 0.0])
COLUMN = np.array([-np.sin(ANGLE), np.cos(ANGLE), 0.0])
NORMAL = np.cross(ROW, COLUMN)
FRAME = "2.25.1001"

I, J, K = np.meshgrid(range(COLUMNS), range(ROWS), range(SLICES), indexing="ij")
LABELS = np.where((I >= 3) & (I < 15) & (J >= 2) & (J < 17) & (K != 2), np.where(I >= 9 - K, 2, 1), 0)
LABELS = LABELS.transpose(2, 1, 0).astype(np.uint8)


def text(numbers):
    return [f"{n:.10f}"[:16] for n in numbers]


def patient(ds):
    ds.PatientName, ds.PatientID, ds.PatientBirthDate, ds.PatientSex = "Nobody", "0", "", "F"
    ds.StudyInstanceUID, ds.StudyID, ds.AccessionNumber = "2.25.1002", "1", ""
    ds.StudyDate, ds.StudyTime, ds.ReferringPhysicianName = "20200101", "120000", ""


def slice_(k):
    ds = Dataset()
    ds.file_meta = FileMetaDataset()
    ds.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    patient(ds)
    ds.SOPClassUID, ds.SOPInstanceUID = CTImageStorage, f"2.25.200{k}"
    ds.Modality, ds.SeriesInstanceUID, ds.SeriesNumber = "CT", "2.25.1003", 1
    ds.InstanceNumber, ds.FrameOfReferenceUID, ds.PositionReferenceIndicator = k + 1, FRAME, ""
    ds.ImageType, ds.PatientPosition = ["ORIGINAL", "PRIMARY", "AXIAL"], "HFS"
    ds.ImagePositionPatient = text(ORIGIN + k * SPACING[2] * NORMAL)
    ds.ImageOrientationPatient = text([*ROW, *COLUMN])
    ds.PixelSpacing, ds.SliceThickness = [SPACING[1], SPACING[0]], SPACING[2]
    ds.Rows, ds.Columns, ds.SamplesPerPixel = ROWS, COLUMNS, 1
    ds.BitsAllocated, ds.BitsStored, ds.HighBit, ds.PixelRepresentation = 16, 16, 15, 1
    ds.PhotometricInterpretation, ds.RescaleSlope, ds.RescaleIntercept = "MONOCHROME2", 1, 0
    ds.PixelData = np.zeros((ROWS, COLUMNS), np.int16).tobytes()
    return ds


def segment(number, label, category, kind):
    return hd.seg.SegmentDescription(
        number, label, category, kind, hd.seg.SegmentAlgorithmTypeValues.MANUAL
    )


def write_segmentations(slices):
    descriptions = [
        segment(1, "Weichteile", codes.SCT.Tissue, codes.SCT.SoftTissue),
        segment(2, "Brustwand", codes.SCT.AnatomicalStructure, codes.SCT.ChestWall),
    ]
    kinds = hd.seg.SegmentationTypeValues
    stacks = np.stack([LABELS == 1, LABELS == 2], -1)
    shares = np.where(stacks, 0.6, 0.0) + np.where(np.roll(stacks, 1, axis=2) & ~stacks, 0.3, 0.0)
    for name, kind, array in (
        ("binary", kinds.BINARY, LABELS),
        ("fractional", kinds.FRACTIONAL, shares.astype(np.float32)),
        ("labelmap", kinds.LABELMAP, LABELS),
    ):
        seg = hd.seg.Segmentation(
            slices, array, kind, descriptions, "2.25.1004", 2, f"2.25.30{len(name)}", 1,
            "nobody", "hand", "1", "0", content_label="LABELS",
        )
        seg.save_as(f"highdicom_{name}.dcm")
        if name == "binary":
            shuffle(seg)
            seg.save_as("highdicom_shuffled.dcm")


def shuffle(seg):
    """The frames in another order than segments and slices have."""
    frames, n = list(seg.PerFrameFunctionalGroupsSequence), int(seg.NumberOfFrames)
    bits = np.unpackbits(np.frombuffer(seg.PixelData, np.uint8), bitorder="little")
    bits = bits[: n * ROWS * COLUMNS].reshape(n, -1)
    order = np.random.default_rng(1).permutation(n)
    seg.PerFrameFunctionalGroupsSequence = Sequence([frames[m] for m in order])
    packed = np.packbits(bits[order].ravel(), bitorder="little").tobytes()
    seg.PixelData = packed + b"\0" * (len(packed) % 2)


def outline(mask):
    """Corner chains round the pixels of a mask that is one rectangle per row run."""
    j, i = np.nonzero(mask)
    return [(i.min() - 0.5, j.min() - 0.5), (i.max() + 0.5, j.min() - 0.5), (i.max() + 0.5, j.max() + 0.5), (i.min() - 0.5, j.max() + 0.5)]


def contour(corners, k, kind="CLOSED_PLANAR"):
    c = Dataset()
    c.ContourGeometricType, c.NumberOfContourPoints = kind, len(corners)
    points = [ORIGIN + i * SPACING[0] * ROW + j * SPACING[1] * COLUMN + k * SPACING[2] * NORMAL for i, j in corners]
    c.ContourData = [f"{v:.4f}" for p in points for v in p]
    return c


def write_structures():
    ds = Dataset()
    patient(ds)
    ds.SOPClassUID, ds.SOPInstanceUID = "1.2.840.10008.5.1.4.1.1.481.3", "2.25.4001"
    ds.Modality, ds.SeriesInstanceUID, ds.StructureSetLabel = "RTSTRUCT", "2.25.1005", "TEST"
    hole = [(5.5, 6.5), (7.5, 6.5), (7.5, 9.5), (5.5, 9.5)]
    filled = [k for k in range(SLICES) if k != 2]
    rois = {
        # The patient within her skin: both labels; slice 2 has none and is bridged.
        "Outline": ("EXTERNAL", [contour(outline(LABELS[k] > 0), k) for k in filled]),
        "CHESTWALL": ("", [contour(outline(LABELS[k] == 2), k) for k in filled]),
        # A hole of 2 x 3 voxels by a second contour, and a line that encloses nothing.
        "Ring": ("ORGAN", [contour(outline(LABELS[0] > 0), 0), contour(hole, 0), contour([(1, 1), (2, 2)], 0)]),
        "Isocentre": ("ISOCENTER", [contour([(3, 3)], 1, "POINT")]),
        "Empty": ("AVOIDANCE", []),
    }
    ds.StructureSetROISequence, ds.ROIContourSequence, ds.RTROIObservationsSequence = Sequence(), Sequence(), Sequence()
    for number, (name, (kind, contours)) in enumerate(rois.items(), 1):
        roi, drawn, seen = Dataset(), Dataset(), Dataset()
        roi.ROINumber, roi.ROIName, roi.ReferencedFrameOfReferenceUID = number, name, FRAME
        roi.ROIGenerationAlgorithm = "MANUAL"
        drawn.ReferencedROINumber, drawn.ROIDisplayColor = number, [250, 10 * number, 0]
        if contours:
            drawn.ContourSequence = Sequence(contours)
        seen.ObservationNumber, seen.ReferencedROINumber = number, number
        seen.RTROIInterpretedType, seen.ROIInterpreter = kind, ""
        ds.StructureSetROISequence.append(roi)
        ds.ROIContourSequence.append(drawn)
        ds.RTROIObservationsSequence.append(seen)
    ds.file_meta = FileMetaDataset()
    ds.file_meta.TransferSyntaxUID = ImplicitVRLittleEndian
    ds.file_meta.MediaStorageSOPClassUID, ds.file_meta.MediaStorageSOPInstanceUID = ds.SOPClassUID, ds.SOPInstanceUID
    ds.save_as("pydicom_rtstruct.dcm", enforce_file_format=True, implicit_vr=True, little_endian=True)


def write_jpeg_2000():
    j, i = np.mgrid[:24, :40]
    values = (i * 1999 + j * 9973).astype(np.uint16)
    values[0, 0], values[23, 39] = 0, 65535
    Image.fromarray(values).save("ramp.j2k", "JPEG2000", no_jp2=True, num_resolutions=3)
    smooth = (1000 + 3 * i + 5 * j).astype(np.uint16)
    Image.fromarray(smooth).save("smooth.j2k", "JPEG2000", no_jp2=True, num_resolutions=3, irreversible=True)


pydicom.config.settings.reading_validation_mode = pydicom.config.RAISE
write_segmentations([slice_(k) for k in range(SLICES)])
write_structures()
write_jpeg_2000()
