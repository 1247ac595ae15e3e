"""dask_cohort.py CASES.csv OUT [SCHEDULER]: a cohort by Dask and the Python package `supine`, where there is a Dask cluster already.

CASES.csv has the columns name and case. One JSON line tells how each patient ended, as she ends; `supine batch --collect --out OUT`
then makes table and page. Workers with one thread of Dask each, `dask worker --nthreads 1`: a run brings its own.
"""

import csv
import json
import os
import sys

from dask.distributed import Client, as_completed


def run(name, case, out):
    """One patient; a failure is a result like any other: Dask does not try it again, and nobody else's run ends by it."""
    import supine  # where the worker is

    try:
        verdict = supine.Session.read(case, threads=2).run(f"{out}/runs/{name}")["verdict"]
        return {"case": name, "colour": verdict["colour"]}
    except supine.SupineError as error:
        return {"case": name, "code": error.code, "message": error.message, "advice": error.advice}


if __name__ == "__main__":
    table, out = map(os.path.abspath, sys.argv[1:3])
    with open(table, newline="", encoding="utf-8-sig") as file:
        cases = {row["name"]: os.path.join(os.path.dirname(table), row["case"]) for row in csv.DictReader(file)}
    with Client(*sys.argv[3:]) as client:
        runs = [client.submit(run, name, case, out, pure=False) for name, case in cases.items()]
        for done in as_completed(runs):
            print(json.dumps(done.result()), flush=True)
