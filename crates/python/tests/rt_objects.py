"""A dose and a structure set of the patient of a CT, as small as they can be: the environment of these tests has nothing that
writes such objects."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import numpy.typing as npt
import SimpleITK

LONG = ("OB", "OW", "SQ")
DOSE, STRUCTURES = "1.2.840.10008.5.1.4.1.1.481.2", "1.2.840.10008.5.1.4.1.1.481.3"


def element(tag: int, vr: str, value: str | bytes) -> bytes:
    """An element, explicit VR little endian."""
    filler = b"\0" if vr in ("UI", "OB", "OW", "SQ") else b" "
    data = value if isinstance(value, bytes) else value.encode()
    data += filler * (len(data) % 2)
    head = struct.pack("<HH2s", tag >> 16, tag & 0xFFFF, vr.encode())
    return head + (struct.pack("<HI", 0, len(data)) if vr in LONG else struct.pack("<H", len(data))) + data


def number(tag: int, value: int) -> bytes:
    return element(tag, "US", struct.pack("<H", value))


def sequence(tag: int, items: list[bytes]) -> bytes:
    return element(tag, "SQ", b"".join(struct.pack("<HHI", 0xFFFE, 0xE000, len(item)) + item for item in items))


def numbers(values: npt.ArrayLike) -> str:
    return "\\".join(f"{value:.4f}" for value in np.ravel(np.asarray(values, dtype=np.float64)))


def write(path: Path, of: SimpleITK.Image, kind: str, modality: str, more: list[bytes]) -> None:
    """Writes an object of the patient of a slice, whose further elements come in the order of their tags."""
    instance = f"1.2.826.0.1.3680043.2.1125.{kind.rpartition('.')[2]}"
    meta = element(0x00020002, "UI", kind) + element(0x00020003, "UI", instance) + element(0x00020010, "UI", "1.2.840.10008.1.2.1")
    meta = element(0x00020001, "OB", b"\0\1") + meta
    own = [
        element(0x00080016, "UI", kind),
        element(0x00080018, "UI", instance),
        element(0x00080060, "CS", modality),
        element(0x00100010, "PN", of.GetMetaData("0010|0010")),
        element(0x00100020, "LO", of.GetMetaData("0010|0020")),
        element(0x0020000D, "UI", of.GetMetaData("0020|000d")),
        element(0x0020000E, "UI", f"{instance}.1"),
    ]
    head = b"\0" * 128 + b"DICM" + element(0x00020000, "UL", struct.pack("<I", len(meta))) + meta
    path.write_bytes(head + b"".join(own + more))


def write_dose(path: Path, of: SimpleITK.Image, centre: tuple[float, float, float], size: int = 20, step: float = 4.0) -> None:
    """A dose that falls off from a place (LPS, mm), Gy."""
    k, j, i = np.indices((size, size, size))
    off = (np.stack([i, j, k], -1) - (size - 1) / 2) * step
    gy = 20.0 * np.exp(-(off**2).sum(-1) / 800)
    write(path, of, DOSE, "RTDOSE", [
        element(0x00200032, "DS", numbers(np.subtract(centre, (size - 1) / 2 * step))),
        element(0x00200037, "DS", "1\\0\\0\\0\\1\\0"),
        element(0x00200052, "UI", of.GetMetaData("0020|0052")),
        number(0x00280002, 1),
        element(0x00280004, "CS", "MONOCHROME2"),
        element(0x00280008, "IS", str(size)),
        number(0x00280010, size),
        number(0x00280011, size),
        element(0x00280030, "DS", numbers([step, step])),
        *(number(0x00280100 + n, value) for n, value in enumerate((16, 16, 15, 0))),
        element(0x30040002, "CS", "GY"),
        element(0x30040004, "CS", "PHYSICAL"),
        element(0x3004000A, "CS", "PLAN"),
        element(0x3004000C, "DS", numbers(np.arange(size) * step)),
        element(0x3004000E, "DS", "0.0005"),
        element(0x7FE00010, "OW", np.rint(gy / 0.0005).astype("<u2").tobytes()),
    ])  # fmt: skip


def write_structures(path: Path, of: SimpleITK.Image, name: str, contours: list[npt.NDArray[np.float64]]) -> None:
    """A structure set of one region, by its contours (n, 3), LPS, mm."""
    frame = of.GetMetaData("0020|0052")
    drawn = [
        element(0x30060042, "CS", "CLOSED_PLANAR")
        + element(0x30060046, "IS", str(len(contour)))
        + element(0x30060050, "DS", numbers(contour))
        for contour in contours
    ]
    region = element(0x30060022, "IS", "1") + element(0x30060024, "UI", frame) + element(0x30060026, "LO", name)
    write(path, of, STRUCTURES, "RTSTRUCT", [
        element(0x30060002, "SH", "drawn"),
        sequence(0x30060020, [region]),
        sequence(0x30060039, [sequence(0x30060040, drawn) + element(0x30060084, "IS", "1")]),
    ])  # fmt: skip
