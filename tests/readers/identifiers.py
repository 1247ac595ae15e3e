"""identifiers.py SOURCE OUT [OBJECT ...]: whether anything of the patient in SOURCE and her OBJECTs stands in any file of OUT.

Sought are all names, IDs, dates, times, UIDs and free texts of the source's headers, as bytes, in names and contents
of files; the folder .stages, which stays on the machine, is left out. DICOM files must say what was done to them."""
import gzip, pathlib, re, sys
import pydicom

source, out, *objects = map(pathlib.Path, sys.argv[1:])
PERSONAL = {"PN", "UI", "DA", "TM", "DT", "AS"}
# Free texts and identifiers of other value representations.
NAMED = {"PatientID", "AccessionNumber", "StudyID", "StudyDescription", "SeriesDescription", "InstitutionName",
         "InstitutionAddress", "StationName", "ProtocolName", "DeviceSerialNumber", "PatientComments",
         "ImageComments", "OtherPatientIDs", "RequestedProcedureDescription", "StructureSetLabel", "StructureSetName",
         "StructureSetDescription", "ROIDescription", "ROIObservationLabel", "DoseComment", "SegmentDescription", "TrackingID",
         "ContentDescription"}
# Names of regions are looked for when they are no plain words: the objects that a test makes have this in all of those.
AUSTER = "auster"
# Public: they name no one.
PUBLIC = "1.2.840.10008."

secrets, machine = set(), set()
for path in [*source.iterdir(), *objects]:
    header = pydicom.dcmread(path, stop_before_pixels=True)
    # The maker of the scanner may be named (PS3.15 table E.1-1); the fixture's patient is called the same.
    machine |= {str(header.get(k, "")).strip() for k in ("Manufacturer", "ManufacturerModelName")}
    for element in header.iterall():
        personal = element.VR in PERSONAL or element.keyword in NAMED or AUSTER in str(element.value).lower()
        if element.VR == "SQ" or not personal:
            continue
        for value in element.value if element.VM > 1 else [element.value]:
            text = str(value).strip()
            if len(text) > 3 and not text.startswith(PUBLIC):
                secrets.add(text)
                if element.VR == "PN":
                    secrets.update(part for part in text.replace("^", " ").split() if len(part) > 3)
needles = {secret: secret.encode() for secret in sorted(secrets - machine)}
needles |= {word: word.encode() for word in ("Auster", "AUSTER", "Sieglinde", "SIEGLINDE") if objects}
assert len(needles) > 90, needles
faults, files = [], 0
for path in out.rglob("*"):
    if ".stages" in path.parts or not path.is_file():
        continue
    files += 1
    data = path.read_bytes()
    if path.suffix == ".gz":
        data = gzip.decompress(data)
    for secret, needle in needles.items():
        # Six digits of a time stand by chance among the numbers of a mesh, a picture or voxels, and within UIDs.
        chance = secret.isdigit() and len(secret) <= 8 and path.suffix not in {".json", ".jsonl", ".html", ".dcm"}
        within = needle in data
        if within and secret.isdigit():
            within = re.search(rb"(?<![0-9.])" + needle + rb"(?![0-9])", data) is not None
        # Pictures stand in pages as base64, where four letters in a row say nothing.
        if within and path.suffix == ".html":
            within = re.search(rb"(?<![\w+/])" + re.escape(needle) + rb"(?![\w+/])", data) is not None
        if within and not chance or secret in str(path.relative_to(out)):
            faults.append(f"{path.relative_to(out)}: {secret}")
    if path.suffix == ".dcm":
        done = pydicom.dcmread(path, stop_before_pixels=True)
        assert done.PatientIdentityRemoved == "YES", path
        codes = [item.CodeValue for item in done.DeidentificationMethodCodeSequence]
        assert codes == ["113100", "113105"], (path, codes)
        assert str(done.PatientName) == done.PatientID and done.PatientID.startswith("ANON-"), path
        purposes = [i.PurposeOfReferenceCodeSequence[0].CodeValue for i in done.get("ContributingEquipmentSequence", [])]
        if done.Modality == "CT":
            assert "DEFORMED" in done.SeriesDescription and done.DerivationDescription, path
            assert done.ImageType[0] == "DERIVED" and len(done.SourceImageSequence) > 0, path
            assert purposes == ["109104", "109101", "109102"], (path, purposes)
assert not faults, "\n".join(faults[:40])
print(f"{len(needles)} identifiers in none of {files} files")
