"""Structure sets as pydicom writes them."""

import highdicom
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.sequence import Sequence
from pydicom.uid import ExplicitVRLittleEndian


def write_structures(path, ct, regions):
    """Regions drawn on the slices `ct`: name, interpreted type, and contours, each the slice it is drawn on,
    its geometric type (CLOSED_PLANAR, POINT) and its points, LPS, mm."""
    ds = Dataset()
    for keyword in ("SpecificCharacterSet", "PatientName", "PatientID", "PatientBirthDate", "PatientSex", "StudyInstanceUID", "StudyDate", "StudyTime"):
        setattr(ds, keyword, ct[0].get(keyword, ""))
    ds.SOPClassUID, ds.SOPInstanceUID = "1.2.840.10008.5.1.4.1.1.481.3", highdicom.UID()
    ds.Modality, ds.SeriesInstanceUID, ds.StructureSetLabel = "RTSTRUCT", highdicom.UID(), "TEST"
    ds.StructureSetROISequence, ds.ROIContourSequence, ds.RTROIObservationsSequence = Sequence(), Sequence(), Sequence()
    for number, (name, kind, contours) in enumerate(regions, 1):
        roi, drawn, seen = Dataset(), Dataset(), Dataset()
        roi.ROINumber, roi.ROIName, roi.ROIGenerationAlgorithm = number, name, "MANUAL"
        roi.ReferencedFrameOfReferenceUID = ct[0].FrameOfReferenceUID
        drawn.ReferencedROINumber, drawn.ContourSequence = number, Sequence(contour(*c) for c in contours)
        drawn.ROIDisplayColor = [250, 20 * number, 0]
        seen.ObservationNumber, seen.ReferencedROINumber, seen.RTROIInterpretedType = number, number, kind
        for sequence, item in zip((ds.StructureSetROISequence, ds.ROIContourSequence, ds.RTROIObservationsSequence), (roi, drawn, seen)):
            sequence.append(item)
    ds.file_meta = FileMetaDataset()
    ds.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    ds.file_meta.MediaStorageSOPClassUID, ds.file_meta.MediaStorageSOPInstanceUID = ds.SOPClassUID, ds.SOPInstanceUID
    ds.save_as(path, enforce_file_format=True)


def contour(header, kind, points):
    found, image = Dataset(), Dataset()
    image.ReferencedSOPClassUID, image.ReferencedSOPInstanceUID = header.SOPClassUID, header.SOPInstanceUID
    found.ContourImageSequence, found.ContourGeometricType = Sequence([image]), kind
    found.NumberOfContourPoints, found.ContourData = len(points), [f"{v:.3f}" for v in points.ravel()]
    return found
