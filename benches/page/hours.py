#!/usr/bin/env python3
"""Hours of use of the workstation's page, and the memory of server and page at the end of each cycle. For developers; see README.md here.

CASE names a large series, as for bench.py. Beside it lie hours-case.toml, a whole case that can be simulated, and the CT that it names; the
page sees that folder, and writes into hours-case.toml.
"""

import argparse
import json
import math
import os
import statistics
import sys
import time
from pathlib import Path

from playwright.sync_api import sync_playwright

import prepare
from measure import WINDOW

SLICES, STROKES, POSITIONS, DRAGS = 200, 30, 20, 20
# Seconds that one step of the work may take.
WAIT = 600
# What is measured, with its unit.
COLUMNS = {"server": " MB", "its peak": " MB", "JavaScript heap": " MB", "renderer": " MB", "DOM nodes": "", "listeners": ""}
# The page has that state, and all voxels that it names.
HAS = """([revision, volumes]) => import("/js/state.js").then(({ now }) => {
    const { server, voxels } = now(), whole = (held, key) => held?.key === key && held.arrived === held.voxels.length;
    return server?.revision >= revision && volumes.every(([id, key]) => whole(voxels[id], key)); })"""
DRAWN = "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
# Where the applicator is in the axial view.
APPLICATOR = """() => Promise.all([import("/js/state.js"), import("/js/views/pane.js"), import("/js/applicator.js")])
    .then(([{ now }, { paneOf, toScreenOf }, { centreOf }]) => toScreenOf(paneOf(now(), "axial"), centreOf(now().applicator)))"""
LOAD = "now().preview?.load ?? null"


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--supine", type=Path, required=True)
    parser.add_argument("--case", type=Path, required=True, help="a case file with a CT of 512x512; see above")
    parser.add_argument("--minutes", type=float, required=True, help="after so many no cycle begins")
    parser.add_argument("--rest", type=float, default=10, help="seconds without use after each cycle")
    return parser.parse_args()


class Window:
    def __init__(self, browser, supine):
        self.supine, self.wrong = supine, []
        self.page = browser.new_page(viewport=WINDOW)
        self.page.set_default_timeout(1000 * WAIT)
        self.page.on("pageerror", lambda error: self.wrong.append(str(error)))
        self.session = self.page.context.new_cdp_session(self.page)
        self.session.send("Performance.enable")
        self.page.goto(supine.address)

    def state(self):
        # Asked from outside: what the page itself is answered the browser keeps for its debugger, and it would be measured.
        return json.loads(self.supine.read("/api/state"))

    def until(self, what, holds):
        """Waits until the state is so, and the page has it and has drawn it."""
        end = time.time() + WAIT
        while True:
            state = self.state()
            wrong = self.wrong or state["problem"] or state["live"]["problem"]
            assert not wrong and time.time() < end, f"{what}: {json.dumps(wrong or state)[:2000]}"
            # The change of volume is read when it is looked at.
            volumes = [[one["id"], one["key"]] for one in state["volumes"] if one["id"] != "jacobian"]
            if holds(state) and self.page.evaluate(HAS, [state["revision"], volumes]):
                break
            time.sleep(0.05)
        self.page.evaluate(DRAWN)
        return state

    def told(self, what, good=bool):
        """What the page's own state tells, once it is good."""
        end = time.time() + WAIT
        while not good(told := self.page.evaluate(f"() => import('/js/state.js').then(({{ now }}) => {what})")):
            assert time.time() < end, f"{what}: {told}"
            time.sleep(0.1)
        return told

    def key(self, keys):
        self.page.locator("#view-axial").focus()
        self.page.keyboard.press(keys)

    def click(self, name):
        self.page.get_by_role("button", name=name, exact=True).click()

    def middle(self, view):
        box = self.page.locator(f"#view-{view}").bounding_box()
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def drag(self, start, *ways, button="left"):
        """From a spot of the page to others beside it, one after another."""
        x, y = start
        self.page.mouse.move(x, y)
        self.page.mouse.down(button=button)
        for right, down in ways:
            self.page.mouse.move(x + right, y + down, steps=8)
        self.page.mouse.up(button=button)

    def wheel(self, view, notches):
        self.page.mouse.move(*self.middle(view))
        for _ in range(abs(notches)):
            self.page.mouse.wheel(0, math.copysign(120, notches))


def idle(state):
    return state["job"] is None and state["phase"] == "ready"


def has(state, *wanted):
    return set(wanted) <= {volume["id"] for volume in state["volumes"]}


def followed(state, count):
    """The labels are those of so many strokes."""
    fresh = all(volume["fresh"] for volume in state["volumes"] if volume["id"] == "labels")
    return len(state["case"]["values"].get("seeds.strokes") or []) == count and not state["live"]["following"] and fresh


def opened(window, what, button):
    """What a button of the first step stands for."""
    before = window.state()
    window.page.keyboard.press("Alt+1")
    if before["case"]:
        window.click("Open another…")
    button.click()
    return window.until(what, lambda s: s["revision"] > before["revision"] and idle(s))


def opened_large(window):
    found = window.until("the series", lambda s: s["inspection"] and s["job"] is None)["inspection"]["series"]
    largest = max((one for one in found if one["usable"]), key=lambda one: math.prod(one["size"]))
    return opened(window, "the large series", window.page.locator(f'[data-key="series {largest["id"]}"]'))


def scrolled(window, state):
    """To one end of each view, through all of its planes, and back to the middle."""
    size = next(volume["size"] for volume in state["volumes"] if volume["id"] == "ct")
    for view in state["views"]:
        planes = size[view["normal"]]
        for notches in (-planes, planes, -(planes // 2)):
            window.wheel(view["name"], notches)


def segmented(window):
    window.page.keyboard.press("Alt+3")
    window.click("Segment")
    ready = lambda s: idle(s) and has(s, "labels") and not s["live"]["busy"] and s["live"]["segmenter"] != "preparing"
    window.until("the labels", ready)


def painted(window):
    """Strokes about the body's middle, where chest wall is what is there; then all are taken back."""
    window.key("b")
    window.click("Chest wall")
    x, y = window.middle("axial")
    for n in range(STROKES):
        window.drag((x + 15 * (n % 6 - 3), y + 12 * (n // 6 - 2)), (12, 4))
        window.until("a stroke", lambda s: followed(s, n + 1))
    for n in reversed(range(STROKES)):
        window.key("Control+z")
        window.until("a stroke taken back", lambda s: followed(s, n))
    window.key("b")
    window.until("the labels without strokes", lambda s: not s["live"]["busy"])


def simulated(window):
    window.page.keyboard.press("Alt+4")
    window.click("Simulate")
    window.until("the deformed CT", lambda s: idle(s) and has(s, "deformed", "jacobian"))


def tilted(window):
    """The slider ends where it began: what was simulated is of the case again."""
    state = window.until("the preview", lambda s: s["preview_tilt"]["state"] == "ready")
    first = state["case"]["values"]["table.ap"]
    window.page.get_by_label("AP, slider").focus()
    for n in range(1, POSITIONS + 1):
        window.page.keyboard.press("ArrowRight" if n <= POSITIONS // 2 else "ArrowLeft")
        angle = first + 0.5 * min(n, POSITIONS - n)
        if n < POSITIONS:
            window.told("now().preview?.ap ?? null", lambda ap: ap == angle)
        window.until("the table", lambda s: s["case"]["values"]["table.ap"] == angle)
    window.told("now().tilt === null")


def pushed(window):
    window.key("Shift+P")
    load = window.told(LOAD)
    for n in range(DRAGS):
        box = window.page.locator("#view-axial").bounding_box()
        x, y = window.page.evaluate(APPLICATOR)
        window.drag((box["x"] + x, box["y"] + y), (-6 if n % 2 else 6, 0))
        load = window.told(LOAD, lambda newest: newest and newest != load)
    window.key("Shift+P")
    window.told("now().applicator === null && now().tilt === null")


def compared(window):
    window.page.keyboard.press("Alt+5")
    for way in ("Curtain", "Blend", "Difference", "Volume change"):
        window.click(way)
        if way == "Curtain":
            window.drag(window.middle("axial"), (-80, 0), (80, 0), (0, 0))
        if way == "Volume change":
            window.told("now().voxels.jacobian?.arrived ?? 0")
        window.wheel("coronal", 10)
        window.wheel("coronal", -10)
    window.click("One")


def warned(window):
    for _ in window.state()["warnings"]:
        window.key("Shift+X")
    window.page.evaluate(DRAWN)


def cycle(window):
    state = opened_large(window)
    scrolled(window, state)
    window.drag(window.middle("axial"), (60, 30), (0, 0), button="right")
    segmented(window)
    painted(window)
    window.drag(window.middle("3d"), (120, 40), (-120, -40), (0, 0))
    opened(window, "the patient's case", window.page.get_by_role("button", name="hours-case.toml"))
    segmented(window)
    simulated(window)
    tilted(window)
    pushed(window)
    compared(window)
    warned(window)


def memory(path, name):
    """MB of a line of /proc."""
    line = next(line for line in Path(path).read_text().splitlines() if line.startswith(f"{name}:"))
    return int(line.split()[1]) * 1.024e-3


def renderers():
    """Chromium's processes of pages below this one."""
    parents, found = {}, []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            parents[int(process.name)] = int((process / "stat").read_text().rpartition(")")[2].split()[1])
            if b"--type=renderer" in (process / "cmdline").read_bytes():
                found.append(int(process.name))
        except OSError:  # it has ended meanwhile
            continue

    def is_below(process):
        return process == os.getpid() or (process in parents and is_below(parents[process]))

    return [process for process in found if is_below(process)]


def figures(window):
    """What COLUMNS name, once garbage is collected."""
    send, server = window.session.send, f"/proc/{window.supine.process.pid}/status"
    send("HeapProfiler.collectGarbage")
    heap = send("Runtime.getHeapUsage")["usedSize"] / 1e6
    # Chromium keeps an empty one ready for the next page.
    renderer = max(memory(f"/proc/{process}/smaps_rollup", "Pss") for process in renderers())
    metrics = {one["name"]: one["value"] for one in send("Performance.getMetrics")["metrics"]}
    return [memory(server, "VmRSS"), memory(server, "VmHWM"), heap, renderer, metrics["Nodes"], metrics["JSEventListeners"]]


def listed(values, form):
    return ", ".join(f"{name} {value:{form}}{unit}" for (name, unit), value in zip(COLUMNS.items(), values))


def used(options, window):
    """The figures of each cycle, and the minutes of all."""
    rows, start = [], time.time()
    while not rows or time.time() - start < 60 * options.minutes:
        cycle(window)
        rows.append(figures(window))
        print(f"cycle {len(rows)}, {(time.time() - start) / 60:.0f} minutes: {listed(rows[-1], '.0f')}", file=sys.stderr, flush=True)
        time.sleep(options.rest)
    return rows, (time.time() - start) / 60


def slopes(rows):
    half = rows[len(rows) // 2:]
    if len(half) < 2:
        return "Too few cycles for a slope"
    slope = [statistics.linear_regression(range(len(half)), values).slope for values in zip(*half)]
    return f"Change a cycle, by least squares over the second half of the cycles: {listed(slope, '+.2f')}"


def report(rows, minutes):
    lines = ["| cycle | " + " | ".join(name + unit for name, unit in COLUMNS.items()) + " |", "|---" * (len(COLUMNS) + 1) + "|"]
    for n, row in enumerate(rows, 1):
        if n <= 3 or n % 4 == 0 or n == len(rows):
            cells = [f"{value:.1f}" if unit else f"{value:.0f}" for unit, value in zip(COLUMNS.values(), row)]
            lines.append(f"| {n} | " + " | ".join(cells) + " |")
    return "\n".join([*lines, "", f"{slopes(rows)}; {len(rows)} cycles in {minutes:.0f} minutes."])


def main():
    options = arguments()
    folder = options.case.resolve().parent
    prepare.stretched(options.case, SLICES, folder)
    supine = prepare.Supine(options.supine, folder)
    try:
        with sync_playwright() as playwright:
            # The flags of tests/readers/page.py.
            browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox", "--disable-3d-apis"])
            rows, minutes = used(options, Window(browser, supine))
            browser.close()
    finally:
        supine.stop()
    print(report(rows, minutes))


if __name__ == "__main__":
    main()
