"""Archives beside `supine send` and `supine fetch`, and what both hold, for archive.py and its like.

They are called with SUPINE SERIES SOURCE SCRATCH: SERIES is a series that supine exported from SOURCE.
They run in a network name space of their own, since Orthanc listens on every address whatever it is
told; ports are fixed for the same reason.
"""

import contextlib
import json
import pathlib
import shutil
import socket
import struct
import subprocess
import sys
import time

import pydicom

SUPINE, SERIES, SOURCE, SCRATCH = (pathlib.Path(a) for a in sys.argv[1:5])
ARCHIVE, RECEIVER, STORESCP, PROXY = 14242, 14243, 14244, 14245
# All waits end after so many seconds: what they wait for comes within a few, and much later where a machine has other work.
PATIENCE = 300


def supine(*words, code=0):
    """Runs supine; the result it prints as JSON. No word of it may name the patient."""
    command = [SUPINE, *map(str, words), "--json", "--no-progress"]
    said = subprocess.run(command, capture_output=True, text=True, timeout=2 * PATIENCE)
    assert said.returncode == code, (words, said.returncode, said.stdout, said.stderr)
    for secret in SECRETS:
        assert secret not in said.stdout + said.stderr, f"{words} names the patient"
    return (json.loads(said.stdout) if said.stdout else None), said.stderr


def data_set(path):
    """The bytes after the file header (PS3.10 7.1)."""
    whole = path.read_bytes()
    (length,) = struct.unpack("<I", whole[140:144])
    return whole[144 + length :]


def by_instance(folder):
    files = [f for f in folder.rglob("*") if f.is_file() and not f.name.startswith(".")]
    return {pydicom.dcmread(f, stop_before_pixels=True).SOPInstanceUID: f for f in files}


def assert_same(sent, got):
    """Every object is there once, its data set is the same to the byte, its file names no more than
    its UID, and nothing else is there."""
    a, b = by_instance(sent), by_instance(got)
    assert a.keys() == b.keys(), (len(a), len(b))
    for uid, file in a.items():
        assert data_set(file) == data_set(b[uid]), uid
        one, other = pydicom.dcmread(file), pydicom.dcmread(b[uid])
        assert one == other and one.file_meta.TransferSyntaxUID == other.file_meta.TransferSyntaxUID
    left = sorted(f.name for f in got.iterdir())
    assert left == sorted(f"{uid}.dcm" for uid in a), left


@contextlib.contextmanager
def running(name, *command):
    with (SCRATCH / f"{name}.log").open("w") as log:
        process = subprocess.Popen(command, stdout=log, stderr=log)
        try:
            yield process
        finally:
            # Orthanc takes seconds to say farewell, for a store that nobody looks at again.
            process.kill()
            process.wait()


def until(holds, what):
    end = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < end, what
        time.sleep(0.05)


def listens(port):
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def wait_for(port):
    until(lambda: listens(port), f"nobody listens on {port}")


def orthanc(name="orthanc", **more):
    store = SCRATCH / name
    store.mkdir()
    settings = {
        "StorageDirectory": str(store),
        "IndexDirectory": str(store),
        "HttpServerEnabled": False,
        "DicomAet": "ARCHIVE",
        "DicomPort": ARCHIVE,
        "DicomCheckCalledAet": True,
        "DicomAlwaysAllowFind": True,
        "DicomAlwaysAllowGet": True,
        "DicomAlwaysAllowMove": True,
        "DicomModalities": {"receiver": ["RECEIVER", "127.0.0.1", RECEIVER]},
        "Plugins": [],
        **more,
    }
    (SCRATCH / f"{name}.json").write_text(json.dumps(settings))
    return running(name, "Orthanc", str(SCRATCH / f"{name}.json"))


def copy(name, folder):
    """A copy, without what is on record about the original."""
    target = SCRATCH / name
    shutil.copytree(folder, target, ignore=shutil.ignore_patterns(".*"))
    return target


first = pydicom.dcmread(next(iter(by_instance(SERIES).values())), stop_before_pixels=True)
SECRETS = [str(first.PatientName), str(first.PatientID), str(first.PatientBirthDate)]
assert all(len(secret) > 3 for secret in SECRETS), SECRETS
