"""The page of a cohort in a browser: filters, order, links, pictures.

cohort_page.py INDEX PICTURE: INDEX is that of a batch with the patients `good` (flagged), `red` (not usable) and `typo` (failed). Ends with 0
when all is as it must be; what is seen last goes to PICTURE.
"""
import sys
from pathlib import Path

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import sync_playwright

INDEX, PICTURE = sys.argv[1:]
ALL = ["good", "red", "typo"]
# All waits end after so many ms: each takes a moment, and much longer where the machine has other work.
WAIT = 300_000


def names(page):
    """Names of the patients that are shown, in their order."""
    return page.locator("article:visible h3").all_text_contents()


def filters(page):
    assert names(page) == ALL and page.inner_text("#shown") == "all 3"
    page.uncheck("[data-show=flagged]")
    assert names(page) == ["red", "typo"] and page.inner_text("#shown") == "2 of 3"
    page.check("[data-show=flagged]")
    page.fill("#text", "LFT typo")
    assert names(page) == ["typo"]
    page.keyboard.press("Enter")
    assert names(page) == ["typo"], "Enter in the text leaves the page as it is"
    page.fill("#text", "")
    page.select_option("#code", "case-value")
    assert names(page) == ["typo"]


def link(page):
    """One to a patient whom a filter hides shows all again."""
    page.locator("ul.firsts a", has_text="red").click()
    page.locator("#shown", has_text="all 3").wait_for()
    box = page.locator("article", has_text="red").first.bounding_box()
    assert box and box["y"] < page.viewport_size["height"], box


def order(page):
    page.select_option("#order", label="worst verdict first")
    worst = names(page)
    assert worst.index("red") < worst.index("good") and set(worst) == set(ALL), worst
    page.select_option("#order", label="largest displacement first")
    by_length = names(page)
    assert by_length[-1] == "typo", by_length
    page.select_option("#order", label="name")
    assert names(page) == ALL


def pictures(page):
    """Each is there, and leads to itself in full size."""
    for picture in page.locator("article img").all():
        picture.scroll_into_view_if_needed()
        assert picture.evaluate("async image => { await image.decode(); return image.naturalWidth; }") > 0
    assert page.locator("article img").count() >= 2
    report = page.locator("article header a").first
    assert (Path(INDEX).parent / report.get_attribute("href")).is_file()


with sync_playwright() as play:
    browser = play.chromium.launch(executable_path="/usr/bin/chromium", timeout=WAIT,
                                   args=["--no-sandbox", "--disable-dev-shm-usage"])
    page = browser.new_page(viewport={"width": 1100, "height": 900})
    page.set_default_timeout(WAIT)
    wrong = []
    page.on("console", lambda message: message.type == "error" and wrong.append(message.text))
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.goto(Path(INDEX).as_uri())
    filters(page)
    link(page)
    order(page)
    pictures(page)
    for scheme in ("dark", "light"):
        page.emulate_media(color_scheme=scheme)
        found = Axe().run(page)
        assert not found.response["violations"], found.generate_report()
    assert not wrong, wrong
    page.screenshot(path=PICTURE, full_page=True)
    browser.close()
