"""One page in one browser: its first picture, then its frames while the wheel turns or the mesh does."""

import asyncio
import os
import statistics
import subprocess
import sys
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
WINDOW = {"width": 1280, "height": 800}
OURS = ["--disable-3d-apis"]
PEERS = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
# After so many events the wheel turns back: no end of the volume is reached.
TURN = 30


@dataclass
class Page:
    name: str
    kind: str
    address: str
    ours: bool = False
    served: bool = False
    busy: bool = False


@contextmanager
def busy(wanted):
    other = subprocess.Popen([sys.executable, "-c", "while True: pass"]) if wanted else None
    try:
        yield
    finally:
        if other:
            other.kill()
            other.wait()


async def when(page, told):
    """What the page tells once it does. Asked from outside: the workstation's own rules forbid text to be run in it."""
    for _ in range(1800):
        if value := await page.evaluate(told):
            return value
        await asyncio.sleep(0.1)
    raise TimeoutError(f"{told}: nothing in three minutes")


async def wheel(page, seconds):
    """Real events, 60 a second, whether or not the page keeps up: none is waited for."""
    clock = asyncio.get_running_loop().time
    start, sent = clock(), []
    while clock() - start < seconds:
        down = (len(sent) // TURN) % 2 == 0
        sent.append(asyncio.create_task(page.mouse.wheel(0, 120 if down else -120)))
        await asyncio.sleep(max(0, start + len(sent) / 60 - clock()))
    events = len(sent)
    return events, asyncio.gather(*sent)


async def watch(page, session, kind, seconds, sync):
    """Frames and time of the main thread over some seconds; `sync` waits for each picture, which costs frames but tells its time."""
    async def thread():
        metrics = (await session.send("Performance.getMetrics"))["metrics"]
        return next(one["value"] for one in metrics if one["name"] == "TaskDuration")

    before = await thread()
    await page.evaluate(f"bench.begin({str(sync).lower()})")
    events, rest = 0, None
    if kind == "slices":
        events, rest = await wheel(page, seconds)
    else:
        await asyncio.sleep(seconds)
    told = await page.evaluate("bench.end()")
    used = 1000 * (await thread() - before)
    if rest:
        await asyncio.wait_for(rest, 60)
    return {
        "frames_per_second": told["frames"] / told["seconds"], "events_per_second": events / told["seconds"],
        "step_ms": statistics.median(told["steps"]) if told["steps"] else None,
        "thread_ms": used / max(1, told["frames"]), "long_tasks": told["slow"],
    }


async def measure(playwright, chromium, one, seconds, picture=None):
    """All figures of one page; a page that fails tells why."""
    load = os.getloadavg()[0]
    browser = await playwright.chromium.launch(executable_path=chromium, args=OURS if one.ours else PEERS)
    errors = []
    try:
        page = await browser.new_page(viewport=WINDOW)
        page.on("pageerror", lambda error: errors.append(str(error)))
        await page.add_init_script(path=HERE / "harness.js")
        if one.served:
            await page.add_init_script(path=HERE / "ours.js")
        session = await page.context.new_cdp_session(page)
        await session.send("Performance.enable")
        with busy(one.busy):
            await page.goto(one.address)
            first = await when(page, "bench.first()")
            view = page.locator("#view-axial" if one.served else "#views > *").first
            box = await view.bounding_box()
            # In niivue all planes lie in one canvas; anywhere in it will do.
            await page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
            if one.kind == "slices":
                await page.evaluate("bench.centre()")
            await asyncio.sleep(1)
            free = await watch(page, session, one.kind, seconds, False)
            synced = await watch(page, session, one.kind, seconds / 2, True)
        if picture:
            await page.screenshot(path=picture)
        return {**free, "step_ms": synced["step_ms"], "data_ms": first["data"], "picture_ms": first["after"], "gpu": first["gpu"],
                "view": [round(box["width"]), round(box["height"])], "load": [load, os.getloadavg()[0]], "errors": errors}
    except Exception as error:  # noqa: BLE001 - one page that fails must not take the others' figures along
        return {"failed": " ".join(str(error).split())[:200], "load": [load, os.getloadavg()[0]], "errors": errors}
    finally:
        await browser.close()
