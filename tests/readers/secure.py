"""secure.py SUPINE SERIES SOURCE SCRATCH: send and fetch over TLS, see nodes.py."""

import contextlib
import shutil
import signal
import subprocess

import pydicom
from broken import Proxy, silent_peer
from certificates import Authority, rewritten, self_signed
from nodes import (ARCHIVE, PATIENCE, PROXY, RECEIVER, SCRATCH, SERIES, STORESCP, SUPINE, assert_same,
                   by_instance, copy, orthanc, running, supine, wait_for)

ours = Authority(SCRATCH, "authority")
stranger = Authority(SCRATCH, "stranger")
ARCHIVES = ours.issue("archive")
OWN = ours.issue("supine", san="DNS:supine", rsa=True)
BY_AUTHORITY = ["--tls", "--tls-ca", ours.pem]


def as_us(certificate, key):
    return ["--tls-cert", certificate, "--tls-key", key]


def some(name, count=3):
    """A folder with a few objects."""
    folder = SCRATCH / name
    folder.mkdir()
    for file in sorted(by_instance(SERIES).values())[:count]:
        shutil.copy(file, folder)
    return folder


@contextlib.contextmanager
def storescp(name, certificate, key, *more, before=()):
    """dcmtk's receiver, which wants our certificate unless told otherwise; gives where objects go."""
    got = SCRATCH / f"{name}-got"
    got.mkdir()
    words = ["-v", "-aet", "STORESCP", "-od", got, "+tls", key, certificate, "+cf", ours.pem, *more]
    with running(name, *before, "storescp", *map(str, words), str(STORESCP)):
        wait_for(STORESCP)
        yield got


def every_form_of_key():
    """Keys as they come: PKCS#8, PKCS#1, SEC1; an archive that wants our certificate."""
    elliptic = ours.issue("elliptic")
    forms = [
        OWN,
        (OWN[0], rewritten(OWN[1], "pkcs1.key", "rsa", "-traditional")),
        (elliptic[0], rewritten(elliptic[1], "sec1.key", "ec")),
    ]
    heads = [form[1].read_text().split("\n")[0] for form in forms]
    assert [head.strip("-") for head in heads] == \
        ["BEGIN PRIVATE KEY", "BEGIN RSA PRIVATE KEY", "BEGIN EC PRIVATE KEY"], heads
    sent = some("keys-sent")
    with storescp("keys", *ARCHIVES) as got:
        for n, form in enumerate(forms):
            said, _ = supine("send", sent, "--to", f"STORESCP@127.0.0.1:{STORESCP}", "--again",
                             *BY_AUTHORITY, *as_us(*form))
            assert said["stored"] == 3, (n, said)
        assert by_instance(got).keys() == by_instance(sent).keys()


def version_1_2():
    """An archive that knows no TLS 1.3, and one that knows no more than 1.1."""
    sent, rsa = some("version-sent"), ours.issue("rsa", rsa=True)
    node = f"STORESCP@127.0.0.1:{STORESCP}"
    for version, code in [("TLSv1.2", 0), ("TLSv1.1", 1)]:
        settings = SCRATCH / f"{version}.cnf"
        settings.write_text("openssl_conf = a\n[a]\nssl_conf = b\n[b]\nsystem_default = c\n[c]\n"
                            f"MinProtocol = TLSv1\nMaxProtocol = {version}\n"
                            "CipherString = ALL:@SECLEVEL=0\n")
        with storescp(version, *rsa, "+px", before=["env", f"OPENSSL_CONF={settings}"]) as got:
            said, words = supine("send", sent, "--to", node, "--retries", 0,
                                 *BY_AUTHORITY, *as_us(*OWN), code=code)
            if code == 0:
                assert by_instance(got).keys() == by_instance(sent).keys(), said
            else:
                assert "TLS 1.2 or 1.3 is needed" in words, words
        # Nothing was sent to it yet, as far as is known here.
        (sent / ".supine-sent").unlink(missing_ok=True)


def refusals():
    """What cannot be, each with what to do about it."""
    sent = some("refused", 1)
    node = f"STORESCP@127.0.0.1:{STORESCP}"
    odd = some("odd", 1)
    (odd / "secret.key").write_text(OWN[1].read_text().replace("M", "*"))

    def refused(words, *more, code=1):
        _, said = supine("send", sent, "--to", node, "--retries", 0, *more, code=code)
        assert words in said, (words, said)
        assert "PRIVATE" not in said and OWN[1].read_text().split("\n")[1] not in said, said

    us = as_us(*OWN)
    with storescp("wants", *ARCHIVES):
        refused("asks for a certificate of ours", *BY_AUTHORITY)
        refused("it has to trust it or its issuer", *BY_AUTHORITY, *as_us(*stranger.issue("nobody")))
        refused("give that of its issuer", "--tls", "--tls-ca", stranger.pem, *us)
        locked = rewritten(OWN[1], "locked.key", "pkey", "-aes128", "-passout", "pass:secret")
        refused("private key without a password", *BY_AUTHORITY, *as_us(OWN[0], locked))
        refused("is not the key of", *BY_AUTHORITY, *as_us(OWN[0], ARCHIVES[1]))
        refused("no sound PEM", *BY_AUTHORITY, *as_us(OWN[0], odd / "secret.key"))
        refused("no certificate in PEM", "--tls", "--tls-ca", OWN[1])
        refused("cannot read", "--tls", "--tls-ca", SCRATCH / "nowhere")
        # One side speaks TLS alone: whether the other breaks off or says nothing, the words are the same.
        said, words = supine("send", sent, "--to", node, "--timeout", 5, "--retries", 0, code=75)
        assert "--tls" in words, words
    with storescp("other", *ours.issue("other", san="DNS:pacs.example,IP:192.0.2.9")):
        refused("not for 127.0.0.1 but for pacs.example, 192.0.2.9: call", *BY_AUTHORITY, *us)
    with storescp("nameless", *ours.issue("nameless", san="email:a@example")):
        refused("no alternative name 127.0.0.1", *BY_AUTHORITY, *us)
    with storescp("old", *ours.issue("old", days=-1)):
        refused("has run out", *BY_AUTHORITY, *us)
    with running("plain", "storescp", "-aet", "STORESCP", "--ignore", str(STORESCP)):
        wait_for(STORESCP)
        refused("does it speak TLS on this port?", *BY_AUTHORITY, "--timeout", 5, code=75)
    supine("send", sent, "--to", node, "--tls-ca", ours.pem, code=2)
    supine("send", sent, "--to", node, "--tls", "--tls-cert", OWN[0], code=2)


def by_itself():
    """An archive that signed its own certificate, for a name it is not called by: given as it is."""
    own, sent = self_signed(SCRATCH, "orthanc"), some("itself-sent")
    node = ["--to", f"STORESCP@127.0.0.1:{STORESCP}", "--retries", 0]
    with storescp("itself", *own, "-ic") as got:
        said, _ = supine("send", sent, *node, "--tls", "--tls-ca", own[0])
        assert said["stored"] == 3 and by_instance(got).keys() == by_instance(sent).keys(), said
        _, words = supine("send", sent, "--again", *node, "--tls", code=1)
        assert "--tls-ca" in words, words
    # The same name and another key: not the one that was given.
    other = self_signed(SCRATCH, "impostor")
    with storescp("impostor", *other, "-ic"):
        _, words = supine("send", sent, "--again", *node, "--tls", "--tls-ca", own[0], code=1)
        assert "give that of its issuer" in words, words
    # Renewed: what was given bears its name, and no longer its key, be that of another kind too.
    for kind in ("rsa:2048", "ec"):
        new = self_signed(SCRATCH, f"renewed-{kind[:2]}", "orthanc", kind)
        with storescp(f"renewed-{kind[:2]}", *new, "-ic"):
            _, words = supine("send", sent, "--again", *node, "--tls", "--tls-ca", own[0], code=1)
            assert "it was renewed" in words and "--tls-ca" in words, words
            both = SCRATCH / "both.pem"
            both.write_text(own[0].read_text() + new[0].read_text())
            said, _ = supine("send", sent, "--again", *node, "--tls", "--tls-ca", both)
            assert said["stored"] == 3, f"the new one is among those that were given: {said}"


def strangers(wanted):
    """While a C-MOVE is under way its port takes those we trust, and nobody else. The archive waits for
    a receiver that says nothing, and we for the archive: longer than this test does."""
    held = ["--out", SCRATCH / "held", "--as", "SILENT", "--move-to", "SILENT", "--port", RECEIVER,
            "--timeout", 10 * PATIENCE]
    nobody = stranger.issue("caller")
    callers = [(["+tls", OWN[1], OWN[0]], True), (["+tls", nobody[1], nobody[0]], False), (["+tla"], False)]
    with silent_peer(PROXY):
        process = subprocess.Popen([SUPINE, "fetch", *map(str, [*wanted, *held])], stderr=subprocess.DEVNULL)
        wait_for(RECEIVER)
        for how, trusted in callers:
            words = ["echoscu", *how, "+cf", ours.pem, "-aec", "SILENT", "127.0.0.1", RECEIVER]
            said = subprocess.run(list(map(str, words)), capture_output=True, text=True)
            assert (said.returncode == 0) == trusted, (words, said.stderr)
        assert process.poll() is None, "the port was open all the time"
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == 130


def there_and_back():
    """Orthanc with TLS on both ways; an association that breaks; C-MOVE to a port with TLS."""
    settings = {
        "DicomTlsEnabled": True,
        "DicomTlsCertificate": str(ARCHIVES[0]),
        "DicomTlsPrivateKey": str(ARCHIVES[1]),
        "DicomTlsTrustedCertificates": str(ours.pem),
        "DicomTlsRemoteCertificateRequired": True,
        "DicomScuTimeout": 10 * PATIENCE,
    }
    receiver = {"AET": "RECEIVER", "Host": "127.0.0.1", "Port": RECEIVER, "UseDicomTls": True}
    settings["DicomModalities"] = {"receiver": receiver, "silent": ["SILENT", "127.0.0.1", PROXY]}
    tls = [*BY_AUTHORITY, *as_us(*OWN)]
    sent = copy("tls-sent", SERIES)
    count = len(by_instance(sent))
    head = pydicom.dcmread(next(iter(by_instance(sent).values())), stop_before_pixels=True)
    node = f"ARCHIVE@127.0.0.1:{ARCHIVE}"
    with orthanc("orthanc-tls", **settings):
        wait_for(ARCHIVE)
        with Proxy(PROXY, ARCHIVE, cut=3_000_000, times=2):
            said, _ = supine("send", sent, "--to", f"ARCHIVE@127.0.0.1:{PROXY}", *tls)
            assert said["stored"] == count and said["associations"] == 3, said
        wanted = ["--from", node, "--series", head.SeriesInstanceUID, *tls]
        got = SCRATCH / "tls-get"
        said, _ = supine("fetch", *wanted, "--out", got)
        assert said["received"] == count, said
        assert_same(sent, got)
        moved = SCRATCH / "tls-move"
        move = ["--out", moved, "--as", "RECEIVER", "--move-to", "RECEIVER", "--port", RECEIVER]
        said, _ = supine("fetch", *wanted, *move)
        assert said["received"] == count, said
        assert_same(sent, moved)
        _, words = supine("fetch", *wanted[:4], *BY_AUTHORITY, *move, code=2)
        assert "a C-MOVE with --tls is answered here" in words, words
        strangers(wanted)
    # One that calls us without TLS gets nothing, and it is told why.
    settings |= {"DicomPort": STORESCP, "StorageDirectory": str(SCRATCH / "orthanc-tls"),
                 "IndexDirectory": str(SCRATCH / "orthanc-tls")}
    settings["DicomModalities"] = {"receiver": {**receiver, "UseDicomTls": False}}
    with orthanc("orthanc-half", **settings):
        wait_for(STORESCP)
        moved.rename(SCRATCH / "tls-moved")
        wanted[1] = f"ARCHIVE@127.0.0.1:{STORESCP}"
        _, words = supine("fetch", *wanted, *move, code=1)
        assert "does not speak TLS when it calls us" in words, words
        assert not by_instance(moved), "nothing is taken without TLS"


every_form_of_key()
version_1_2()
refusals()
by_itself()
there_and_back()
