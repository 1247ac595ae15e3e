#!/usr/bin/env python3
"""How long a series takes to an archive and back, beside dcmtk. Needs pydicom, dcmtk, Orthanc, openssl.

  network.py SUPINE SERIES SOURCE SCRATCH      Markdown on stdout; in a network name space of its own

SERIES: a series that supine exported from SOURCE. SCRATCH: an empty folder.
"""
import pathlib
import shutil
import statistics
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "tests/readers"))
from certificates import Authority  # noqa: E402
from nodes import ARCHIVE, SCRATCH, SERIES, by_instance, copy, orthanc, supine, wait_for  # noqa: E402

import pydicom  # noqa: E402

NODE, REPEATS = f"ARCHIVE@127.0.0.1:{ARCHIVE}", 5
PLAIN = ["-aec", "ARCHIVE", "127.0.0.1", str(ARCHIVE)]


def dcmtk(*words):
    said = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    assert said.returncode == 0, (words, said.returncode, said.stderr)


def empty(name):
    folder = SCRATCH / name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    return folder


def seconds(once):
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        once()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


sent = copy("sent", SERIES)
files = list(by_instance(sent).values())
head = pydicom.dcmread(files[0], stop_before_pixels=True)
wanted = ["--study", head.StudyInstanceUID, "--series", head.SeriesInstanceUID]
keys = ["-k", "QueryRetrieveLevel=SERIES", "-k", f"StudyInstanceUID={head.StudyInstanceUID}",
        "-k", f"SeriesInstanceUID={head.SeriesInstanceUID}"]


def send_and_fetch(*tls):
    """Seconds of both."""
    there = seconds(lambda: supine("send", sent, "--to", NODE, "--again", *tls))

    def fetch():
        shutil.rmtree(SCRATCH / "got", ignore_errors=True)
        said, _ = supine("fetch", "--from", NODE, *wanted, "--out", SCRATCH / "got", *tls)
        assert said["received"] == len(files), said

    return there, seconds(fetch)


with orthanc("plain", OverwriteInstances=True):
    wait_for(ARCHIVE)
    ours = send_and_fetch()
    theirs = (seconds(lambda: dcmtk("storescu", *PLAIN, *files)),
              seconds(lambda: dcmtk("getscu", "-S", *keys, "-od", empty("theirs"), *PLAIN)))
    assert len(list((SCRATCH / "theirs").iterdir())) == len(files)
authority = Authority(SCRATCH, "authority")
archive, own = authority.issue("archive"), authority.issue("supine", rsa=True)
settings = {"DicomTlsEnabled": True, "DicomTlsCertificate": str(archive[0]), "DicomTlsPrivateKey": str(archive[1]),
            "DicomTlsTrustedCertificates": str(authority.pem)}
with orthanc("secure", OverwriteInstances=True, **settings):
    wait_for(ARCHIVE)
    secure = send_and_fetch("--tls", "--tls-ca", authority.pem, "--tls-cert", own[0], "--tls-key", own[1])
megabytes = sum(file.stat().st_size for file in files) / 1e6
print(f"""
{len(files)} slices, {megabytes:.0f} MB, to Orthanc on the same machine and back by C-GET, median of {REPEATS}; dcmtk's `storescu`
and `getscu` beside. Most of dcmtk's time is waiting: it leaves the delay of acknowledgements (40 ms) on.

| | supine | supine, TLS | dcmtk |
|---|---|---|---|
| send | {ours[0]:.2f} s | {secure[0]:.2f} s | {theirs[0]:.2f} s |
| fetch | {ours[1]:.2f} s | {secure[1]:.2f} s | {theirs[1]:.2f} s |""")
