"""What other programs read: schemas, files of earlier versions, provenance."""

from __future__ import annotations

import json
import subprocess
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import prov.model
import pytest
from conftest import Finished

import supine

ROOT = Path(__file__).parents[3]
KEPT = ROOT / "fixtures" / "versions"


def schema(binary: str, of: str) -> dict[str, Any]:
    done = subprocess.run([binary, "schema", of], capture_output=True, check=True)
    told: dict[str, Any] = json.loads(done.stdout)
    jsonschema.Draft202012Validator.check_schema(told)
    assert told["$id"].startswith(f"urn:supine:schema:{of}:")
    return told


def test_files_of_earlier_versions_still_hold(binary: str) -> None:
    of_case, of_summary, of_status = (schema(binary, of) for of in ("case", "summary", "status"))
    versions = sorted(path for path in KEPT.iterdir() if path.is_dir())
    assert versions
    for version in versions:
        for case in sorted(version.glob("*.toml")):
            values = tomllib.loads(case.read_text())
            jsonschema.validate(values, of_case)
            supine.Session.read(case)
        summary = version / "summary.json"
        jsonschema.validate(json.loads(summary.read_text()), of_summary)
        jsonschema.validate(json.loads((version / "status.json").read_text()), of_status)
        # A run can be repeated from its summary.
        again = supine.Session.read(summary)
        kept = json.loads(summary.read_text())["case"]
        # Keys have their present names; those that came since have their defaults.
        for key, value in kept.items():
            now = again.case[{"bed": "table"}.get(key, key)]
            assert ({**now, **value} if isinstance(value, dict) else value) == now, key


def test_schemas_refuse_what_the_program_refuses(binary: str, values: dict[str, Any]) -> None:
    of_case = schema(binary, "case")
    good = {**values, "ct": str(values["ct"])}
    good["tumour"] = {**good["tumour"], "centre": list(good["tumour"]["centre"])}
    good["region"] = {**good["region"], "centre": list(good["region"]["centre"])}
    jsonschema.validate(good, of_case)
    for wrong in ({"breast": "lft"}, {"brest": "left"}, {"table": {"ap": 700, "lat": 0}}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate({**good, **wrong}, of_case)
        with pytest.raises(supine.SupineError):
            supine.Session(**{**values, **wrong})


def test_provenance_leads_from_the_result_to_the_ct(binary: str, finished: Finished) -> None:
    summary = finished.summary
    told = subprocess.run([binary, "provenance", finished.out], capture_output=True, check=True)
    document = prov.model.ProvDocument.deserialize(content=told.stdout.decode(), format="json")
    derived: dict[str, set[str]] = {}
    for record in document.get_records(prov.model.ProvDerivation):
        made, used = (str(value) for _, value in record.formal_attributes[:2])
        derived.setdefault(made, set()).add(used)

    def origins(of: str) -> set[str]:
        return {of}.union(*(origins(parent) for parent in derived.get(of, ())))

    assert {"run:result-import", "run:result-segment", "run:result-solve"} <= origins("run:result-export")
    entities = {str(entity.identifier) for entity in document.get_records(prov.model.ProvEntity)}
    assert len(entities) == len(summary["chain"]) + len(summary["inputs"]) + len(summary["outputs"])
    text = told.stdout.decode()
    for file in summary["outputs"] + summary["inputs"]:
        assert file["blake3"] in text
