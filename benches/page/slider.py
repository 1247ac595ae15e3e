#!/usr/bin/env python3
"""From the slider of the operating table to the picture, in the browser. For developers; see README.md here.

CASE is whole: CT, breast, tumour, table. Each position is asked for alone, and timed from its event until the frame that shows it.
"""

import argparse
import json
import os
import statistics
import time
from pathlib import Path

from playwright.sync_api import sync_playwright

import prepare
from measure import WINDOW

POSITIONS, FIRST = 60, 10
TIMED = """async ([angles]) => {
    const { follow, now } = await import("/js/state.js");
    const slider = document.querySelector('input[type="range"][aria-label="AP, slider"]');
    let shown = () => {};
    follow((state, before) => state.preview !== before.preview && shown(state.preview?.ap));
    const times = [];
    for (const angle of angles) {
        const drawn = new Promise((done) => { shown = (ap) => ap === angle && requestAnimationFrame(() => setTimeout(done)); });
        const began = performance.now();
        slider.value = angle;
        slider.dispatchEvent(new Event("input", { bubbles: true }));
        await drawn;
        times.push([performance.now() - began, now().preview.ms]);
        await new Promise((done) => setTimeout(done, 60));
    }
    return times; }"""


def told(page, what, seconds):
    """What the page's own state tells, once it holds."""
    end = time.time() + seconds
    while not (found := page.evaluate(f"() => import('/js/state.js').then(({{ now }}) => {what})")):
        assert time.time() < end, what
        time.sleep(0.1)
    return found


def ready(supine, page):
    told(page, "now().server?.phase === 'ready' && now().voxels.ct?.arrived === now().voxels.ct?.voxels.length", 60)
    page.keyboard.press("Alt+4")
    told(page, "now().step === 'table' && now().crosshair", 10)
    page.wait_for_timeout(1000)
    page.evaluate("""() => { const slider = document.querySelector('input[aria-label="AP, slider"]');
        slider.value = 1; slider.dispatchEvent(new Event("input", { bubbles: true })); }""")
    told(page, "now().preview !== null", 180)
    page.wait_for_timeout(3000)
    return json.loads(supine.read("/api/state"))


def timed(program, case, cores):
    every = os.sched_getaffinity(0)
    # What is started now inherits it.
    os.sched_setaffinity(0, set(sorted(every)[:cores]))
    supine = prepare.Supine(program, case)
    os.sched_setaffinity(0, every)
    try:
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox", "--disable-3d-apis"])
            page = browser.new_page(viewport=WINDOW)
            page.goto(supine.address)
            state = ready(supine, page)
            angles = [(n * 7) % 23 - 11 + 0.5 * (n % 2) for n in range(POSITIONS)]
            times = page.evaluate(TIMED, [angles])[FIRST:]
            browser.close()
    finally:
        supine.stop()
    return state, times


def row(name, times):
    def figures(all_of_them):
        ordered = sorted(all_of_them)
        return f"{statistics.median(ordered):.0f} / {ordered[int(0.95 * len(ordered))]:.0f} / {ordered[-1]:.0f}"

    return f"| {name} | {figures([whole for whole, _ in times])} | {figures([server for _, server in times])} |"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--supine", type=Path, required=True)
    parser.add_argument("--case", type=Path, required=True)
    options = parser.parse_args()
    print("| the program on | slider to picture, ms: median / 95 % / largest | of that in the program |\n|---|---|---|")
    for cores, name in ((1, "one core"), (len(os.sched_getaffinity(0)), "all cores")):
        state, times = timed(options.supine, options.case, cores)
        print(row(name, times), flush=True)
    print(f"\n{len(times)} positions; {state['preview_tilt']['tetrahedra']} quadratic tetrahedra.")


if __name__ == "__main__":
    main()
