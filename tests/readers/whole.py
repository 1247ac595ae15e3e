"""whole.py SUPINE SERIES SOURCE SCRATCH: all that a run leaves goes to Orthanc and comes back, see nodes.py.

SERIES is `ct` in the folder of a run; dose and structures are carried from here.
"""

import shutil

import numpy as np
import pydicom
from grids import slices
from nodes import (ARCHIVE, RECEIVER, SCRATCH, SERIES, SOURCE, assert_same, by_instance, orthanc, supine,
                   wait_for)
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.uid import ExplicitVRLittleEndian, generate_uid
from structures import write_structures

KINDS = {
    "1.2.840.10008.5.1.4.1.1.2": "CT",
    "1.2.840.10008.5.1.4.1.1.66.1": "REG",
    "1.2.840.10008.5.1.4.1.1.66.3": "deformable REG",
    "1.2.840.10008.5.1.4.1.1.66.4": "SEG",
    "1.2.840.10008.5.1.4.1.1.481.2": "RTDOSE",
    "1.2.840.10008.5.1.4.1.1.481.3": "RTSTRUCT",
}


def write_dose(path, ct):
    """A small ramp in the patient's frame, 5 mm apart."""
    ds = Dataset()
    for keyword in ("PatientName", "PatientID", "PatientBirthDate", "PatientSex", "StudyInstanceUID",
                    "StudyDate", "StudyTime", "FrameOfReferenceUID"):
        setattr(ds, keyword, ct[0].get(keyword, ""))
    ds.SOPClassUID, ds.SOPInstanceUID = "1.2.840.10008.5.1.4.1.1.481.2", generate_uid()
    ds.SeriesInstanceUID, ds.Modality = generate_uid(), "RTDOSE"
    ds.DoseUnits, ds.DoseType, ds.DoseSummationType = "GY", "PHYSICAL", "PLAN"
    ds.Rows, ds.Columns, ds.NumberOfFrames, ds.FrameIncrementPointer = 20, 24, 16, 0x3004000C
    ds.ImagePositionPatient = [40, -280, -650]
    ds.ImageOrientationPatient, ds.PixelSpacing = [1, 0, 0, 0, 1, 0], [5, 5]
    ds.GridFrameOffsetVector = [5.0 * k for k in range(16)]
    ds.SamplesPerPixel, ds.PhotometricInterpretation, ds.PixelRepresentation = 1, "MONOCHROME2", 0
    ds.BitsAllocated, ds.BitsStored, ds.HighBit, ds.DoseGridScaling = 16, 16, 15, "0.001"
    ds.PixelData = np.arange(20 * 24 * 16).astype("<u2").tobytes()
    ds.file_meta = FileMetaDataset()
    ds.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    ds.file_meta.MediaStorageSOPClassUID = ds.SOPClassUID
    ds.file_meta.MediaStorageSOPInstanceUID = ds.SOPInstanceUID
    ds.save_as(path, enforce_file_format=True)


def carried(folder):
    """Dose and structures of the source, as the run carries them."""
    ct = slices(SOURCE)
    turn = np.linspace(0, 2 * np.pi, 60, endpoint=False)[:, None]
    ring = np.hstack([91 + 20 * np.cos(turn), -248 + 20 * np.sin(turn)])

    def drawn(header):
        z = float(header.ImagePositionPatient[2])
        return header, "CLOSED_PLANAR", np.hstack([ring, np.full((60, 1), z)])

    near = [header for header in ct if abs(float(header.ImagePositionPatient[2]) + 594) < 20]
    write_structures(SCRATCH / "structures.dcm", ct, [("CTV", "CTV", [drawn(h) for h in near])])
    write_dose(SCRATCH / "dose.dcm", ct)
    for name in ("structures.dcm", "dose.dcm"):
        supine("carry", SERIES.parent, SCRATCH / name, "--out", folder / name)


sent = SCRATCH / "whole-sent"
sent.mkdir()
shutil.copytree(SERIES, sent / "ct", ignore=shutil.ignore_patterns(".*"))
shutil.copytree(SERIES.parent / "registration", sent / "registration")
shutil.copy(SERIES.parent / "labels.dcm", sent)
carried(sent)
heads = [pydicom.dcmread(file, stop_before_pixels=True) for file in by_instance(sent).values()]
assert {head.SOPClassUID for head in heads} == set(KINDS), {head.SOPClassUID for head in heads}
series = {head.SeriesInstanceUID for head in heads}
count, study = len(heads), heads[0].StudyInstanceUID

with orthanc():
    wait_for(ARCHIVE)
    node = f"ARCHIVE@127.0.0.1:{ARCHIVE}"
    said, _ = supine("send", sent, "--to", node)
    assert (said["stored"], said["refused"]) == (count, []), said
    # They are copies: nothing beside them tells what became of the run.
    [told] = said["warnings"]
    assert "objects that a run left lie outside its folder" in told, told
    [listed], _ = supine("fetch", "--from", node, "--study", study, "--list")
    found = {one["series"]: one["instances"] for one in listed["series"]}
    assert found.keys() == series and sum(found.values()) == count, found
    for name, how in [("get", []), ("move", ["--as", "RECEIVER", "--move-to", "RECEIVER", "--port", RECEIVER])]:
        got = SCRATCH / f"whole-{name}"
        said, _ = supine("fetch", "--from", node, "--study", study, "--out", got, *how)
        assert (said["received"], said["missing"], said["associations"]) == (count, [], 1), said
        assert_same(sent, got)
