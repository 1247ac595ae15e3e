"""implicit.py SUPINE SERIES SOURCE SCRATCH: an archive that takes Implicit VR alone, see nodes.py."""

import shutil

import pydicom
from nodes import SCRATCH, SERIES, SOURCE, STORESCP, by_instance, copy, running, supine, wait_for
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence
from pydicom.uid import ImplicitVRLittleEndian

NODE = f"STORESCP@127.0.0.1:{STORESCP}"


def awkward(folder):
    """One object more, with what is hard to convert: private and unknown sequences, bytes of unknown
    meaning, sequences without length, empty ones, and characters beyond ASCII."""
    first = sorted(by_instance(folder).values())[0]
    data = pydicom.dcmread(first)
    data.SOPInstanceUID = data.file_meta.MediaStorageSOPInstanceUID = pydicom.uid.generate_uid()
    data.SpecificCharacterSet = "ISO_IR 192"
    data.StudyComments = "Größe 3 µm"
    block = data.private_block(0x0029, "SUPINE TEST", create=True)
    block.add_new(0x01, "FD", 0.1)
    block.add_new(0x02, "UN", b"\1\2\3\4")
    inner, item = Dataset(), Dataset()
    inner.add_new(0x00290010, "LO", "SUPINE TEST")
    inner.add_new(0x00291003, "SS", -5)
    item.add_new(0x00290010, "LO", "SUPINE TEST")
    item.add_new(0x00291004, "SQ", [inner, Dataset()])
    block.add_new(0x05, "SQ", [item])
    block.add_new(0x06, "SQ", [])
    code = Dataset()
    code.CodeValue, code.CodingSchemeDesignator, code.CodeMeaning = "1", "99X", "Brüste"
    data.ProcedureCodeSequence = Sequence([code, Dataset()])
    data["ProcedureCodeSequence"].is_undefined_length = True
    code.is_undefined_length_sequence_item = True
    data.RequestAttributesSequence = Sequence([])
    data.save_as(first.with_name("awkward.dcm"))


def same(a, b, path=()):
    """Equal elements with equal values, at every depth. Of a private element the standard keeps the
    bytes and, of a sequence, the items."""
    lengths = [{e.tag for e in d if e.tag.element != 0} for d in (a, b)]
    assert lengths[0] == lengths[1], (path, lengths[0] ^ lengths[1])
    for tag in lengths[0]:
        one, other, where = a[tag], b[tag], (*path, str(tag))
        if tag.is_private and one.VR == "SQ" and not one.value:
            # Written as a sequence, with delimiters; this reader sees nothing in it and calls it unknown.
            assert not other.value, where
        elif one.VR == "SQ":
            assert other.VR == "SQ" and len(one.value) == len(other.value), where
            for n, (x, y) in enumerate(zip(one.value, other.value)):
                same(x, y, (*where, n))
        elif tag.is_private and one.VR != other.VR:
            assert other.VR == "UN", where
            assert raw(one) == other.value, (where, one.value, other.value)
        else:
            assert one.value == other.value, (where, one.value, other.value)
            assert one.VR == other.VR or {one.VR, other.VR} <= {"OB", "OW"}, (where, one.VR, other.VR)


def raw(element):
    """The bytes of a value."""
    one = Dataset()
    one.add(element)
    buffer = pydicom.filebase.DicomBytesIO()
    buffer.is_little_endian, buffer.is_implicit_VR = True, True
    pydicom.filewriter.write_dataset(buffer, one)
    return buffer.getvalue()[8:]


sent, got = copy("implicit-sent", SERIES), SCRATCH / "implicit-got"
awkward(sent)
# What a run leaves beside the series: registrations and a segmentation.
shutil.copytree(SERIES.parent / "registration", sent / "registration")
shutil.copy(SERIES.parent / "labels.dcm", sent)
count = len(by_instance(sent))
got.mkdir()
# `+B`: what is received is written as it came.
words = ["-aet", "STORESCP", "-od", str(got), "+xi", "+B", str(STORESCP)]
with running("storescp-implicit", "storescp", *words):
    wait_for(STORESCP)
    said, told = supine("send", sent, "--to", NODE)
    assert (said["stored"], said["converted"], said["refused"]) == (count, count, []), said
    said, _ = supine("send", sent, "--to", NODE)
    assert (said["stored"], said["known"]) == (0, count), said
    compressed = copy("implicit-source", SOURCE)
    said, told = supine("send", compressed, "--to", NODE, code=1)
    assert said["stored"] == 0 and "takes no CT Image Storage in RLE Lossless" in told, told
a, b = by_instance(sent), by_instance(got)
assert a.keys() == b.keys(), (len(a), len(b))
for uid in a:
    one, other = pydicom.dcmread(a[uid]), pydicom.dcmread(b[uid])
    assert other.file_meta.TransferSyntaxUID == ImplicitVRLittleEndian
    same(one, other)
