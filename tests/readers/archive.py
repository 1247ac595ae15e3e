"""archive.py SUPINE SERIES SOURCE SCRATCH: send and fetch beside Orthanc and dcmtk, see nodes.py."""

import signal
import socket
import subprocess
import time

import pydicom
from broken import Proxy, full_peer, lying_peer, silent_peer
from nodes import (ARCHIVE, PATIENCE, PROXY, RECEIVER, SCRATCH, SERIES, SOURCE, STORESCP, SUPINE, assert_same,
                   by_instance, copy, orthanc, running, supine, until, wait_for)


def round_trip(name, folder):
    """Send, find, fetch both ways: what comes back is what was sent."""
    node, sent = f"ARCHIVE@127.0.0.1:{ARCHIVE}", copy(f"{name}-sent", folder)
    count = len(by_instance(sent))
    start = time.monotonic()
    said, _ = supine("send", sent, "--to", node)
    seconds = time.monotonic() - start
    assert (said["stored"], said["known"], said["refused"]) == (count, 0, []), said
    said, _ = supine("send", sent, "--to", node)
    assert (said["stored"], said["known"], said["associations"]) == (0, count, 0), said

    head = pydicom.dcmread(next(iter(by_instance(sent).values())), stop_before_pixels=True)
    study, series = head.StudyInstanceUID, head.SeriesInstanceUID
    keys = f"QueryRetrieveLevel=IMAGE StudyInstanceUID={study} SeriesInstanceUID={series} SOPInstanceUID"
    words = [word for key in keys.split() for word in ("-k", key)]
    found = subprocess.run(["findscu", "-S", "-aec", "ARCHIVE", *words, "127.0.0.1", str(ARCHIVE)],
                           capture_output=True, text=True)
    assert (found.stdout + found.stderr).count("SOPInstanceUID") >= count, "findscu sees them"

    [listed], _ = supine("fetch", "--from", node, "--series", series, "--list")
    assert listed["study"] == study and listed["series"][0]["instances"] == count, listed
    wanted = ["--study", study, "--series", series]
    got = SCRATCH / f"{name}-get"
    start = time.monotonic()
    said, _ = supine("fetch", "--from", node, *wanted, "--out", got)
    back = time.monotonic() - start
    assert (said["received"], said["missing"]) == (count, []), said
    assert_same(sent, got)
    for file in sorted(got.iterdir())[:5]:
        file.unlink()
    said, _ = supine("fetch", "--from", node, *wanted, "--out", got)
    assert (said["received"], said["known"]) == (5, count - 5), said
    assert_same(sent, got)

    by_id = ["--patient-id", head.PatientID, "--date", head.StudyDate, "--series", series]
    moved = SCRATCH / f"{name}-move"
    said, _ = supine("fetch", "--from", node, *by_id, "--as", "RECEIVER", "--move-to", "RECEIVER",
                     "--port", RECEIVER, "--out", moved)
    assert said["received"] == count, said
    assert_same(sent, moved)
    with socket.socket() as probe:
        assert probe.connect_ex(("127.0.0.1", RECEIVER)) != 0, "the port is closed again"
    print(f"{name}: {count} objects sent in {seconds:.1f} s, back in {back:.1f} s")
    return got, wanted


def broken_send():
    """A connection that breaks every 3 MB is got over; one that stays away is told, and the next
    call goes on: nothing is lost, and no more than what was under way is sent twice."""
    node = f"STORESCP@127.0.0.1:{PROXY}"
    for name, stays_away in [("breaks", False), ("away", True)]:
        sent, got = copy(f"{name}-sent", SERIES), SCRATCH / f"{name}-got"
        got.mkdir()
        count = len(by_instance(sent))
        storescp = ["storescp", "-v", "-uf", "-aet", "STORESCP", "-od", str(got), str(STORESCP)]
        with running(f"storescp-{name}", *storescp):
            wait_for(STORESCP)
            cut = {"cut": 3_000_000, "times": 1 if stays_away else 99}
            with Proxy(PROXY, STORESCP, **cut, then_refuse=stays_away):
                said, words = supine("send", sent, "--to", node, "--retries", 1,
                                     code=75 if stays_away else 0)
            if stays_away:
                assert 0 < said["stored"] < count and said["stored"] + said["left"] == count, said
                assert f"{said['stored']} stored, {said['left']} left" in words, words
                first = said["stored"]
                with Proxy(PROXY, STORESCP):
                    said, _ = supine("send", sent, "--to", node)
                assert (said["stored"], said["known"]) == (count - first, first), said
            else:
                assert said["stored"] == count and said["associations"] > 2, said
                breaks = said["associations"] - 1
        arrived = by_instance(got)
        assert arrived.keys() == by_instance(sent).keys(), (len(arrived), count)
        requests = (SCRATCH / f"storescp-{name}.log").read_text().count("Received Store Request")
        assert count <= requests <= count + (1 if stays_away else breaks), (requests, count)


def broken_fetch(sent, wanted):
    node, got = f"ARCHIVE@127.0.0.1:{PROXY}", SCRATCH / "broken-get"
    count = len(by_instance(sent))
    # The first connection is for the queries.
    with Proxy(PROXY, ARCHIVE, cut=3_000_000, times=1, then_refuse=True):
        said, _ = supine("fetch", "--from", node, *wanted, "--out", got, "--retries", 1, code=75)
    arrived = len(by_instance(got))
    assert 0 < arrived == said["received"] < count, said
    assert not [f for f in got.iterdir() if f.name.startswith(".")], "nothing half is left"
    with Proxy(PROXY, ARCHIVE):
        said, _ = supine("fetch", "--from", node, *wanted, "--out", got)
    assert (said["received"], said["known"]) == (count - arrived, arrived), said
    assert_same(sent, got)


def refusals():
    one = copy("refused", SOURCE)
    count = len(by_instance(one))
    with running("storescp-plain", "storescp", "-aet", "STORESCP", "--ignore", str(STORESCP)):
        wait_for(STORESCP)
        said, words = supine("send", one, "--to", f"STORESCP@127.0.0.1:{STORESCP}", code=1)
        assert said["stored"] == 0 and len(said["refused"]) == count, said
        assert "takes no CT Image Storage in RLE Lossless" in words, words
    to = ["--to", f"ARCHIVE@127.0.0.1:{PROXY}", "--retries", 0]
    _, words = supine("send", one, *to, code=75)
    assert "Connection refused" in words, words
    _, words = supine("send", one, "--to", f"WRONG@127.0.0.1:{ARCHIVE}", code=1)
    assert "called AE title not recognized" in words, words
    with lying_peer(PROXY):
        _, words = supine("send", one, *to, code=1)
        assert "4294967295 bytes" in words, words
    with silent_peer(PROXY) as came:
        _, words = supine("send", one, *to, "--timeout", 1, code=75)
        assert "no answer within 1 s" in words, f"a silent peer is given up: {words}"
        before = len(came)
        # By itself it would wait for longer than this test does.
        process = send(one, *to, "--timeout", 10 * PATIENCE)
        until(lambda: len(came) > before or process.poll() is not None, "it does not call")
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == 130, "Ctrl-C is heard while it waits"
    with full_peer(PROXY) as knocking:
        before = knocking()
        process = send(one, *to)
        until(lambda: knocking() > before or process.poll() is not None, "it does not call")
        assert process.poll() is None, "it waits for a connection"
        process.send_signal(signal.SIGINT)
        # By itself it would end after 10 s, a hundred times what it needs to hear of it.
        assert process.wait(9) == 130, "Ctrl-C is heard while it connects"


def many_classes():
    """A study of more classes than one association has contexts for comes whole, and a title that the archive does not
    know is named."""
    node, sent, got = f"ARCHIVE@127.0.0.1:{ARCHIVE}", SCRATCH / "many-sent", SCRATCH / "many-got"
    sent.mkdir()
    head = pydicom.dcmread(next(iter(by_instance(SERIES).values())), stop_before_pixels=True)
    head.StudyInstanceUID, classes = pydicom.uid.generate_uid(), STORED
    for number, uid in enumerate(classes):
        head.SOPClassUID = head.file_meta.MediaStorageSOPClassUID = uid
        head.SOPInstanceUID = head.file_meta.MediaStorageSOPInstanceUID = pydicom.uid.generate_uid()
        head.SeriesInstanceUID, head.SeriesNumber, head.Modality = pydicom.uid.generate_uid(), number, "OT"
        head.save_as(sent / f"{number}.dcm")
    said, _ = supine("send", sent, "--all", "--to", node)
    assert said["stored"] == len(classes), said
    wanted = ["fetch", "--from", node, "--study", head.StudyInstanceUID]
    said, _ = supine(*wanted, "--out", got)
    assert (said["received"], said["missing"], said["warnings"]) == (len(classes), [], []), said
    assert said["associations"] > 1, said
    assert_same(sent, got)
    nowhere = SCRATCH / "nowhere" / "deep"
    _, words = supine(*wanted, "--out", nowhere, "--move-to", "NOBODY", "--port", RECEIVER, code=1)
    assert f"AE title NOBODY entered there as a receiver, at 127.0.0.1 port {RECEIVER}?" in words, words
    assert not nowhere.parent.exists(), "a folder was left"


# Images of many kinds, which may be compressed, and objects that may not.
STORED = [f"1.2.840.10008.5.1.4.1.1.{end}" for end in
          ("1", "1.1", "1.2", "1.3", "4", "6.1", "7", "12.1", "12.2", "20", "128", "481.1", "481.2", "77.1.1", "77.1.2",
           "77.1.4", "481.3", "481.5", "66", "66.1", "66.2", "66.3", "88.11", "88.22", "88.33", "11.1", "11.2", "104.1")]


def not_permitted():
    """Orthanc aborts what a title may not do: that is no failure to try again."""
    one = copy("forbidden", SOURCE)
    for word in (["send", one, "--to"], ["fetch", "--study", "1.2.3", "--list", "--from"]):
        _, words = supine(*word, f"ARCHIVE@127.0.0.1:{ARCHIVE}", "--retries", 1, code=1)
        assert "SUPINE, calling from 127.0.0.1, may not be permitted" in words, words


def send(*words):
    return subprocess.Popen([SUPINE, "send", *map(str, words)], stderr=subprocess.DEVNULL)


with orthanc():
    wait_for(ARCHIVE)
    exported, wanted = round_trip("exported", SERIES)
    verify = [SUPINE, "verify-export", exported, "--source", SOURCE]
    assert subprocess.run(verify, capture_output=True).returncode == 0, "verify-export"
    round_trip("source", SOURCE)
    broken_fetch(exported, wanted)
    many_classes()
    broken_send()
    refusals()
with orthanc("forbidding", DicomAlwaysAllowStore=False, DicomAlwaysAllowFind=False):
    wait_for(ARCHIVE)
    not_permitted()
