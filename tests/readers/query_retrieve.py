"""query_retrieve.py SUPINE SERIES SOURCE SCRATCH: fetch from dcmqrscp of dcmtk, which says of series whose they are and
lists no SOP classes, see nodes.py."""

import pydicom
from nodes import ARCHIVE, SCRATCH, SERIES, by_instance, running, supine, wait_for

SETTINGS = """NetworkTCPPort = {port}
MaxPDUSize = 16384
MaxAssociations = 16
HostTable BEGIN
HostTable END
VendorTable BEGIN
VendorTable END
AETable BEGIN
ARCHIVE {store} RW (200, 1024mb) ANY
AETable END
"""
# None of them is of a planning CT: those are proposed where an archive does not list classes.
UNPROPOSED = ["1.2.840.10008.5.1.4.1.1.481.5", "1.2.840.10008.5.1.4.1.1.88.11", "1.2.840.10008.5.1.4.1.1.11.1"]
NODE = f"ARCHIVE@127.0.0.1:{ARCHIVE}"


def write(folder, count, patient, study, series, sop_class="1.2.840.10008.5.1.4.1.1.2"):
    """So many objects of one series, from the first slice."""
    folder.mkdir(exist_ok=True)
    one = pydicom.dcmread(next(iter(by_instance(SERIES).values())))
    one.PatientID, one.StudyInstanceUID, one.SeriesInstanceUID = patient, study, series
    one.SOPClassUID = one.file_meta.MediaStorageSOPClassUID = sop_class
    for _ in range(count):
        uid = one.SOPInstanceUID = one.file_meta.MediaStorageSOPInstanceUID = pydicom.uid.generate_uid()
        one.save_as(folder / f"{uid}.dcm")
    return folder


def fetch(*words, code=0):
    return supine("fetch", "--from", NODE, "--retries", 1, *words, code=code)


def study_of_two_patients():
    """One Study Instance UID, two Patient IDs: each has her own objects, and who is meant is asked for."""
    study, first, second = (pydicom.uid.generate_uid() for _ in range(3))
    both = [("FIRST9", 2, first), ("SECOND9", 3, second)]
    for patient, count, series in both:
        sent = write(SCRATCH / f"sent-{patient}", count, patient, study, series)
        said, _ = supine("send", sent, "--to", NODE)
        assert said["stored"] == count, said
    _, words = fetch("--study", study, "--out", SCRATCH / "neither", code=1)
    assert "for 2 patients: name the one who is meant with --patient-id" in words, words
    listed, _ = fetch("--study", study, "--list")
    assert [[one["series"] for one in each["series"]] for each in listed] == [[first], [second]], listed
    for patient, count, _ in both:
        said, _ = fetch("--study", study, "--patient-id", patient, "--out", SCRATCH / patient)
        assert (said["received"], said["missing"], said["strangers"]) == (count, [], []), said
    said, _ = fetch("--series", second, "--out", SCRATCH / "series")
    assert (said["received"], said["missing"], said["strangers"]) == (3, [], []), said


def classes_not_listed():
    """What no context fits is no lack that passes, although the archive says so."""
    study, sent = pydicom.uid.generate_uid(), SCRATCH / "classes-sent"
    for sop_class in UNPROPOSED:
        write(sent, 1, "CLASSES9", study, pydicom.uid.generate_uid(), sop_class)
    said, _ = supine("send", sent, "--all", "--to", NODE)
    assert said["stored"] == len(UNPROPOSED), said
    said, words = fetch("--study", study, "--out", SCRATCH / "none", code=1)
    assert len(said["missing"]) == len(UNPROPOSED) and said["broken"] is None, said
    assert "A702H" in words and "try --move-to" in words, words
    write(sent, 1, "CLASSES9", study, pydicom.uid.generate_uid())
    supine("send", sent, "--all", "--to", NODE)
    said, words = fetch("--study", study, "--out", SCRATCH / "one", code=1)
    assert (said["received"], len(said["missing"])) == (1, len(UNPROPOSED)), said
    assert "it fails for these alone" in words, words


store = SCRATCH / "dcmqrscp"
store.mkdir()
settings = SCRATCH / "dcmqrscp.cfg"
settings.write_text(SETTINGS.format(port=ARCHIVE, store=store))
with running("dcmqrscp", "dcmqrscp", "-c", str(settings)):
    wait_for(ARCHIVE)
    study_of_two_patients()
    classes_not_listed()
