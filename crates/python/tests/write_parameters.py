"""Writes python/supine/_parameters.py: the types of all keywords, from the table of parameters.

Run it with the package installed when the table has changed: `python tests/write_parameters.py`.
"""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import Any

import supine

FILE = Path(__file__).parents[1] / "python" / "supine" / "_parameters.py"

HEAD = '''"""Types of all keywords. Made from the table of parameters by tests/write_parameters.py; do not edit."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, TypedDict

import numpy as np
import numpy.typing as npt

from ._late import Late
from ._values import Volume

if TYPE_CHECKING:
    import nibabel
    import SimpleITK
else:
    nibabel, SimpleITK = map(Late, ("nibabel", "SimpleITK"))

Place = str | os.PathLike[str]
Array = npt.NDArray[np.floating[Any]] | npt.NDArray[np.integer[Any]]
Point = Sequence[float] | Array
'''

TYPES = {
    "switch": "bool",
    "number": "float",
    "whole": "int",
    "text": "str",
    "point": "Point",
    "points": "Sequence[Point] | Array",
    "strokes": "Sequence[Mapping[str, Any]]",
    "interval": "Sequence[float] | Array",
    "file": "Place",
    "files": "Place | Sequence[Place]",
    "names": "str | Sequence[str]",
}

# May be given in memory too; labels also as an array on the grid of the CT.
IMAGES = "Volume | SimpleITK.Image | nibabel.Nifti1Image | "
VOLUMES = {"ct": IMAGES, "labels": f"{IMAGES}npt.NDArray[Any] | "}
# Tables that a file alone may stand for.
SHORT = ("seeds", "labels")
ACCEPTED = ("series", "exclude", "assume_hu", "equalise_steps")


def type_of(row: dict[str, Any]) -> str:
    """The type of a key's value; None takes it away."""
    if row["kind"] == "choice":
        words = ", ".join(f'"{word}"' for word in row["within"])
        return f"Literal[{words}] | None"
    return f"{TYPES[row['kind']]} | None"


def field(name: str, kind: str, row: dict[str, Any] | None) -> str:
    """One key with what it means."""
    line = f"    {name}: {kind}\n"
    if row is None:
        return line
    text = row["help"][0].upper() + row["help"][1:]
    ends = [f" ({row['unit']})" if row["unit"] else ""]
    if row["kind"] in ("number", "whole", "interval"):
        low, high = row["within"]
        ends.append(f"; {low:g} to {high:g}")
    text = f"{text}{''.join(ends)}. Default: {row['default']}."
    doc = textwrap.fill(text, 116, initial_indent='    """', subsequent_indent="    ")
    return f'{line}{doc}"""\n'


def main() -> str:
    """The whole file."""
    rows = supine.parameters()
    tables: dict[str, list[dict[str, Any]]] = {}
    for row in rows:
        table, _, name = row["key"].rpartition(".")
        tables.setdefault(table, []).append({**row, "name": name})
    text = HEAD
    for table, inner in tables.items():
        if table:
            fields = "".join(field(row["name"], type_of(row), row) for row in inner)
            title = f'"""The table `{table}`."""'
            text += f"\n\nclass {table.capitalize()}(TypedDict, total=False):\n    {title}\n\n{fields}"
    text += '\n\nclass Accepted(TypedDict, total=False):\n    """What may be wrong with a CT, and which one it is."""\n\n'
    text += "".join(field(r["name"], type_of(r), r) for r in tables[""] if r["name"] in ACCEPTED)
    text += '\n\nclass Values(Accepted, total=False):\n    """Every key of a case."""\n\n'
    for row in tables[""]:
        if row["name"] not in ACCEPTED:
            text += field(row["name"], VOLUMES.get(row["name"], "") + type_of(row), row)
    for table in tables:
        if table:
            short = "Place | " if table in SHORT else ""
            text += field(table, f"{VOLUMES.get(table, '')}{short}{table.capitalize()} | None", None)
    return text


if __name__ == "__main__":
    FILE.write_text(main(), encoding="utf-8")
