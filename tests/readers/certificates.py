"""Certificates for secure.py, made by the openssl command in a folder."""

import pathlib
import subprocess


class Authority:
    """Signs certificates. `pem` is its own."""

    def __init__(self, folder, name):
        self.folder, self.name = pathlib.Path(folder), name
        self.pem, self.key = self.folder / f"{name}.pem", self.folder / f"{name}.key"
        openssl("req", "-x509", *NEW_KEY, "-nodes", "-days", "2", "-subj", f"/CN={name}",
                "-keyout", self.key, "-out", self.pem)

    def issue(self, name, san="IP:127.0.0.1", days=2, rsa=False):
        """A certificate and its key (PKCS#8) for what `san` says."""
        key, request, pem = (self.folder / f"{name}.{end}" for end in ("key", "csr", "pem"))
        kind = ["-newkey", "rsa:2048"] if rsa else NEW_KEY
        openssl("req", *kind, "-nodes", "-subj", f"/CN={name}", "-keyout", key, "-out", request)
        extensions = self.folder / f"{name}.ext"
        extensions.write_text(f"subjectAltName={san}\nbasicConstraints=CA:FALSE\n")
        openssl("x509", "-req", "-in", request, "-CA", self.pem, "-CAkey", self.key,
                "-CAcreateserial", "-days", days, "-extfile", extensions, "-out", pem)
        return pem, key


NEW_KEY = ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256"]


def self_signed(folder, name, common=None, kind="rsa:2048"):
    """As handbooks of archives say: an issuer by its form, with a Common Name and no other."""
    pem, key = (pathlib.Path(folder) / f"{name}.{end}" for end in ("pem", "key"))
    new = NEW_KEY if kind == "ec" else ["-newkey", kind]
    openssl("req", "-x509", *new, "-nodes", "-days", "2", "-subj", f"/CN={common or name}",
            "-keyout", key, "-out", pem)
    return pem, key


def rewritten(key, name, *how):
    """The same key in another form."""
    other = key.with_name(name)
    openssl(*how, "-in", key, "-out", other)
    return other


def openssl(*words):
    said = subprocess.run(["openssl", *map(str, words)], capture_output=True, text=True)
    assert said.returncode == 0, (words, said.stderr)
