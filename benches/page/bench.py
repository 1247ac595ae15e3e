#!/usr/bin/env python3
"""The workstation's page beside its peers: slices and 3D, in one interleaved run. For developers; see README.md here."""

import argparse
import asyncio
import json
import os
import sys
from pathlib import Path

from playwright.async_api import async_playwright

import prepare
from measure import Page, measure

HOUSE = prepare.HERE.parent.parent


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--case", type=Path, required=True, help="a case file with a CT of 512x512")
    parser.add_argument("--supine", type=Path, default=HOUSE / "target" / "release" / "supine")
    parser.add_argument("--work", type=Path, default=HOUSE / "target" / "page-bench", help="folder of what is downloaded and made")
    parser.add_argument("--out", type=Path, help="figures as JSON")
    parser.add_argument("--slices", type=int, default=200, help="the CT is brought to so many; 0: as it is")
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=5)
    parser.add_argument("--chromium", default="/usr/bin/chromium")
    parser.add_argument("--only", default="", help="pages whose name holds this word")
    return parser.parse_args()


def pages(supine, site):
    """All that is measured, in the order of a round."""
    version = prepare.versions()
    yield Page("supine", "slices", supine.address, ours=True, served=True)
    yield Page("supine, one busy process beside", "slices", supine.address, ours=True, served=True, busy=True)
    named = {"vtk": f"vtk.js {version['vtk.js']}", "niivue": f"niivue {version['niivue']}", "three": f"three.js {version['three']}",
             "cornerstone": f"cornerstone {version['core']}"}
    for peer in prepare.PEERS["slices"]:
        yield Page(named[peer], "slices", f"{site}/{peer}-slices.html")
    yield Page(f"{named['cornerstone']}, its CPU viewports", "slices", f"{site}/cornerstone-slices.html?cpu")
    for mesh in prepare.MESHES:
        address = f"{site}/ours-mesh.html?mesh={mesh}"
        yield Page("supine", mesh, address, ours=True)
        yield Page("supine, one busy process beside", mesh, address, ours=True, busy=True)
        yield Page("supine, half as fine as while it is turned by hand", mesh, f"{address}&half", ours=True)
        for peer in prepare.PEERS["mesh"][:-1]:
            yield Page(named[peer], mesh, f"{site}/{peer}-mesh.html?mesh={mesh}")


async def run(options, supine, site):
    results = []
    shots = options.work / "pictures"
    shots.mkdir(exist_ok=True)
    async with async_playwright() as playwright:
        for turn in range(options.rounds):
            for n, one in enumerate(page for page in pages(supine, site) if options.only in page.name):
                print(f"round {turn + 1}: {one.kind}, {one.name}", file=sys.stderr)
                figures = await measure(playwright, options.chromium, one, options.seconds, shots / f"{n:02}.png")
                results.append({"round": turn + 1, "kind": one.kind, "name": one.name, **figures})
    return results


def cell(runs, key, digits=0):
    """The values of all rounds, as they came."""
    return ", ".join("–" if one.get(key) is None else f"{one[key]:.{digits}f}" for one in runs)


def table(results, kind, columns):
    head = [title for title, *_ in columns]
    lines = ["| page | " + " | ".join(head) + " |", "|---" * (len(head) + 1) + "|"]
    for name in dict.fromkeys(one["name"] for one in results if one["kind"] == kind):
        runs = [one for one in results if one["kind"] == kind and one["name"] == name]
        failed = next((one["failed"] for one in runs if "failed" in one), None)
        cells = [f"failed: {failed}"] if failed else [cell(runs, key, digits) for _, key, digits in columns]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def report(results, facts):
    motion = [("frames/s", "frames_per_second", 0), ("a step, ms", "step_ms", 1), ("main thread a step, ms", "thread_ms", 1),
              ("tasks over 50 ms", "long_tasks", 0)]
    first = [("data in memory, ms", "data_ms", 0), ("from there to the picture, ms", "picture_ms", 0)]
    size = "×".join(map(str, facts["size"]))
    parts = [f"Slices: three planes of {size} i16 change at every step, wheel at 60 events/s, window 1280×800.\n",
             table(results, "slices", first + motion)]
    for mesh, count in facts["triangles"].items():
        parts += [f"\n3D: {count:,} triangles turn, 640×400.\n", table(results, mesh, [("first picture, ms", "picture_ms", 0), *motion])]
    loads = [load for one in results for load in one["load"]]
    gpus = sorted({one["gpu"] for one in results if one.get("gpu")})
    parts.append(f"\nValues of all rounds. Peers draw by WebGL of: {'; '.join(gpus) or 'none'}; supine without any. "
                 f"{os.cpu_count()} cores, load {min(loads):.1f} to {max(loads):.1f}. A step's time includes waiting for its picture; "
                 "frames/s are measured without that wait. Main thread: all of its tasks in those seconds, by frames.")
    return "\n".join(parts)


def main():
    options = arguments()
    site = options.work / "site"
    site.mkdir(parents=True, exist_ok=True)
    prepare.write_pages(prepare.install(options.work), site)
    triangles = {name: prepare.write_mesh(site, name) for name in prepare.MESHES}
    supine = prepare.Supine(options.supine, prepare.stretched(options.case, options.slices, options.work))
    try:
        facts = {"size": supine.write_volume(site), "triangles": triangles, "versions": prepare.versions(), "cores": os.cpu_count()}
        results = asyncio.run(run(options, supine, prepare.serve(site)))
    finally:
        supine.stop()
    print(report(results, facts))
    if options.out:
        options.out.write_text(json.dumps({"facts": facts, "results": results}, indent=1))


if __name__ == "__main__":
    main()
