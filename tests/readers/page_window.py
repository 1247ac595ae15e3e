"""A window of the page, and the server behind it: started as page.py says."""
import base64, json, os, subprocess, sys, tempfile, time
import numpy as np
from axe_playwright_python.sync_playwright import Axe
from page_planes import WAIT

SUPINE, FOLDER, PICTURES = sys.argv[1:4]
os.environ["SOURCE_DATE_EPOCH"] = sys.argv[4]
# Where unsaved changes are kept.
os.environ["XDG_STATE_HOME"] = tempfile.mkdtemp()


def start(path=FOLDER):
    """The server and its address."""
    server = subprocess.Popen([SUPINE, "open", path, "--no-browser", "--json"], stdout=subprocess.PIPE, text=True)
    text = ""
    while "}" not in text:
        line = server.stdout.readline()
        assert line, "the server ended"
        text += line
    return server, json.loads(text)["address"]


class Window:
    def __init__(self, browser, address, size, scheme):
        self.context = browser.new_context(viewport=size, color_scheme=scheme)
        self.context.set_default_timeout(WAIT)
        self.page = self.context.new_page()
        self.wrong, self.asked = [], []
        self.page.on("console", lambda m: m.type == "error" and self.wrong.append(m.text))
        self.page.on("pageerror", lambda e: self.wrong.append(str(e)))
        self.page.on("dialog", lambda d: self.wrong.append(f"a dialog: {d.message}"))
        self.page.on("request", lambda r: self.asked.append(r.url))
        self.page.goto(address)
        self.origin = address.split("/#")[0]

    def state(self):
        return self.page.evaluate("""async () => (await fetch("/api/state", {headers:
            {Authorization: `Bearer ${sessionStorage.getItem("supine-token")}`}})).json()""")

    def until(self, what, holds):
        """Waits until the state is so, and the page has drawn it."""
        end = time.monotonic() + WAIT / 1000
        while not holds(state := self.state()):
            assert time.monotonic() < end, f"{what}: {self.page.locator('#problems').inner_text()} {json.dumps(state)[:2000]}"
            time.sleep(0.05)
        self.drawn()
        assert state["problem"] is None, state["problem"]
        return state

    def drawn(self):
        """Waits until the page has drawn what it was given."""
        self.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def comes(self, what, holds):
        """Waits until it is so on the page."""
        end = time.monotonic() + WAIT / 1000
        while not holds():
            assert time.monotonic() < end, what
            time.sleep(0.05)

    def idle(self, what="idle"):
        return self.until(what, lambda s: s["job"] is None and s["phase"] == "ready")

    def key(self, keys):
        self.page.locator("#view-axial").focus()
        self.page.keyboard.press(keys)

    def works_on(self):
        """That the focus is not lost."""
        self.drawn()
        assert self.page.evaluate("() => Boolean(document.activeElement?.closest('#panel, .view'))"), "the focus is lost"

    def picture(self, name):
        # For those who look at it: lines of planes come a moment later. Nothing that is checked waits for them.
        time.sleep(0.3)
        self.drawn()
        self.page.screenshot(path=f"{PICTURES}/{name}.png")
        found = Axe().run(self.page).response["violations"]
        serious = [(v["id"], v["nodes"][0]["html"][:200]) for v in found if v["impact"] in ("serious", "critical")]
        assert not serious, f"{name}: {serious}"

    def pixels(self, view):
        """The grey of each voxel of a view's plane, as the canvas holds it."""
        text, width, height = self.page.evaluate("""(view) => {
            const canvas = document.querySelector(`#view-${view} canvas.voxels`);
            const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
            const greys = Array.from({length: data.length / 4}, (_, n) => String.fromCharCode(data[4 * n]));
            return [btoa(greys.join("")), canvas.width, canvas.height]; }""", view)
        return np.frombuffer(base64.b64decode(text), np.uint8).reshape(height, width)

    def close(self):
        assert not self.wrong, self.wrong
        assert all(url.startswith((self.origin, "blob:" + self.origin)) for url in self.asked), self.asked
        assert self.page.title() == "supine" and "#" not in self.page.url, self.page.url
        assert self.page.evaluate("() => localStorage.length") == 0
        self.context.close()


def wait_for(page, asked, good=bool):
    """What the page's own modules say, once it is good."""
    end = time.monotonic() + WAIT / 1000
    while True:
        told = page.evaluate(asked)
        if told is not None and good(told):
            return told
        assert time.monotonic() < end, f"{asked}: {told}"
        time.sleep(0.1)
