"""What the page says when something goes wrong, or is no longer so: the program dies or hangs, two windows disagree, the case was changed."""
import os, signal
from page_window import FOLDER, Window, start


def word(window):
    return window.page.locator("#case .saved").inner_text()


def unsaved(browser, server, window):
    """The program dies with a case that no file holds: the page says so, and the next start offers it."""
    tumour = window.state()["case"]["tumour"]
    assert word(window) == "○ not saved", word(window)
    server.kill()
    server.wait()
    curtain = window.page.locator("#curtain", has_text="closed")
    curtain.wait_for()
    told = curtain.inner_text()
    assert "in no file" in told and "are kept" in told and "saved in" not in told, told
    window.picture("unsaved-closed")
    window.wrong.clear()  # that nobody answers is an error of the console
    window.close()
    server, address = start()
    window = Window(browser, address, {"width": 1280, "height": 800}, "dark")
    offer = window.page.locator(".unsaved")
    offer.get_by_text("PHANTOM").wait_for()
    assert "New case from ct" in offer.inner_text(), offer.inner_text()
    window.picture("unsaved")
    offer.get_by_role("button", name="Go on with it").click()
    state = window.idle("what was not saved")
    assert state["case"]["tumour"] == tumour and not state["case"]["saved"] and state["case"]["kept"], state["case"]
    assert sum(one["on"] for one in state["beside"]) == 2, state["beside"]
    page = window.page
    page.locator("#case-name").fill("case.toml")
    page.locator("#case-name").press("Enter")
    window.until("the case", lambda s: s["case"]["saved"])
    assert word(window) == "● saved" and not os.listdir(f"{os.environ['XDG_STATE_HOME']}/supine/unsaved"), word(window)
    assert "radius = 9.0" in open(f"{FOLDER}/case.toml").read()
    return server, window


def stopped(server, window):
    """A program that does not answer: what it was sent is not called saved."""
    page = window.page
    page.evaluate("""() => { const told = window.told = [], place = document.getElementById("case");
        new MutationObserver(() => told.push(place.querySelector(".saved")?.textContent ?? "")).observe(place, { childList: true, subtree: true }); }""")
    assert word(window) == "● saved", word(window)
    server.send_signal(signal.SIGSTOP)
    try:
        page.locator("#angle-ap").fill("3")
        page.locator("#angle-ap").press("Enter")
        page.locator(".problem", has_text="has not answered for 3 s").wait_for()
        told = page.evaluate("() => window.told")
        assert told and not any("●" in one for one in told), told
        assert word(window) == "○ not saved: the program does not answer", word(window)
        assert page.locator(".problem button").count() == 0
        window.picture("stopped")
    finally:
        server.send_signal(signal.SIGCONT)
    window.until("the edit after all", lambda s: s["case"]["values"]["table.ap"] == 3)
    window.comes("the word", lambda: word(window) == "● saved" and not page.locator(".problem").count())


def changed_by_two(first, second):
    """The same value is changed in two windows: both are shown, and the user chooses."""
    here, there = second.page.locator("#angle-ap"), first.page.locator("#angle-ap")
    second.page.keyboard.press("Alt+4")
    for theirs, choice, stays in ((4, "Keep the other\u2019s", 4), (5, "Use this one", 9)):
        here.fill("9")
        there.fill(str(theirs))
        there.press("Enter")
        for one in (first, second):
            one.until("the first", lambda s: s["case"]["values"]["table.ap"] == theirs)
        here.press("Enter")
        row = second.page.locator(".conflict")
        row.wait_for()
        assert f"table, AP: there {theirs}, here 9." in row.inner_text(), row.inner_text()
        assert word(second) == "○ not saved: choose a value", word(second)
        if theirs == 4:
            second.picture("conflict")
        row.get_by_role("button", name=choice).click()
        for one in (first, second):
            one.until(choice, lambda s: s["case"]["values"]["table.ap"] == stays)
        second.comes("what was chosen", lambda: here.input_value() == str(stays) and word(second) == "● saved")
    # Another value of the same part is no conflict.
    second.page.locator("#angle-lat").fill("6")
    there.fill("2")
    there.press("Enter")
    second.until("the first", lambda s: s["case"]["values"]["table.ap"] == 2)
    second.page.locator("#angle-lat").press("Enter")
    first.until("both", lambda s: [s["case"]["values"][f"table.{name}"] for name in ("ap", "lat")] == [2, 6])
    assert not second.page.locator(".conflict").count()


def old(window):
    """After a change what was found before is marked, until the change is taken back."""
    page = window.page
    page.keyboard.press("Alt+4")
    page.locator("#angle-ap").fill("8")
    page.locator("#angle-ap").press("Enter")
    window.until("another table", lambda s: s["result"]["old"])
    page.keyboard.press("Alt+5")
    window.drawn()
    for part in (".verdict-part", ".figures-part"):
        assert "OLD" in page.locator(part).inner_text(), page.locator(part).inner_text()
    window.picture("old")
    page.keyboard.press("Alt+6")
    window.drawn()
    assert page.locator(".send").is_hidden() and "OLD" in page.locator(".written").inner_text()
    window.key("Control+z")
    window.until("as before", lambda s: not s["result"]["old"])
    page.keyboard.press("Alt+5")
    window.drawn()
    assert "OLD" not in page.locator(".step-panel.check").inner_text()
