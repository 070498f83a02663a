"""The page in Chromium: opened, stated, run, changed, compared and saved by clicks.

Out of the default suite: ``make test-browser``.
"""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import sagnac

pytestmark = pytest.mark.browser

OPTIONS = (
    "--headless --no-sandbox --disable-dev-shm-usage --disable-gpu --disable-quic --no-first-run "
    "--disable-background-networking --disable-component-update --disable-sync "
    "--window-size=1500,1000"
)
PATIENCE = 240.0


class Page:
    """A tab, driven as a person does."""

    def __init__(self, driver, address):
        self.driver = driver
        driver.get(address)

    def script(self, text, *arguments):
        return self.driver.execute_script(text, *arguments)

    def until(self, condition):
        """Wait until an expression of the page is true; its value."""
        begun = time.monotonic()
        while time.monotonic() - begun < PATIENCE:
            found = self.script(f"return {condition}")
            if found:
                return found
            time.sleep(0.05)
        raise AssertionError(f"{condition}: never; {self.text('message')!r}")

    def find(self, selector):
        return self.driver.find_element("css selector", selector)

    def text(self, name):
        return self.script(f"return document.getElementById('{name}').textContent")

    def click(self, selector):
        element = self.find(selector)
        self.script("arguments[0].scrollIntoView({block: 'center'})", element)
        element.click()

    def state(self, **texts):
        """Type into fields of the forms, and leave each."""
        for name, text in texts.items():
            element = self.find(f"[name={name}]")
            element.clear()
            element.send_keys(text + "\t")

    def drag(self, selector, start, stop):
        """Drag across a figure, from one share of its width to another."""
        from selenium.webdriver import ActionChains  # noqa: PLC0415  (of an extra)

        element = self.find(selector)
        self.script("arguments[0].scrollIntoView({block: 'center'})", element)
        width = element.size["width"]
        chain = ActionChains(self.driver).move_to_element_with_offset(
            element, int((start - 0.5) * width), 0
        )
        chain.click_and_hold().move_by_offset(int(0.5 * (stop - start) * width), 2)
        chain.move_by_offset(int(0.5 * (stop - start) * width), 2).release().perform()

    def run(self):
        """Analyze, and wait for the answer."""
        before = self.script("return document.querySelectorAll('#runs button:enabled').length")
        self.click("#run")
        self.until(f"document.querySelectorAll('#runs button:enabled').length > {before}")
        self.until("document.getElementById('run').disabled === false")
        self.until("document.querySelector('#spectrum').dataset.lines")


@pytest.fixture
def folder(tmp_path):
    """A CSV that states nothing, of a bench; and one that cannot be read."""
    place = tmp_path / "bench"
    place.mkdir()
    random, time_s = np.random.default_rng(7), np.arange(30_000) / 100.0
    rates = np.array([9.0, 2.0, 11.88]) + 1.8 * random.standard_normal((30_000, 3))
    rates[:, 0] += 2.0 * np.cos(2.0 * np.pi * 7.0 * time_s)
    np.savetxt(place / "run.csv", rates, "%.6f", delimiter=",", header="x,y,z", comments="")
    (place / "hostile.csv").write_bytes(b"x,y\n<script>alert(1)</script>,\xff\n")
    return place


@pytest.fixture
def served(folder):
    command = [sys.executable, "-m", "sagnac", "app", str(folder), "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process, process.stdout.readline().strip()
        finally:
            process.terminate()


@pytest.fixture
def driver(tmp_path):
    from selenium import webdriver  # noqa: PLC0415  (of an extra)

    options = webdriver.ChromeOptions()
    for option in (*OPTIONS.split(), f"--user-data-dir={tmp_path / 'profile'}"):
        options.add_argument(option)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    # Named, so that nothing is looked for elsewhere.
    options.binary_location = shutil.which("chromium")
    service = webdriver.ChromeService(shutil.which("chromedriver"))
    made = webdriver.Chrome(options=options, service=service)
    yield made
    made.quit()


def children(process_id):
    """Processes that a process has started."""
    tasks = Path(f"/proc/{process_id}/task").glob("*/children")
    found = {int(one) for path in tasks for one in path.read_text().split()}
    # What tells of shared memory runs as long as the server.
    return {one for one in found if b"spawn_main" in Path(f"/proc/{one}/cmdline").read_bytes()}


def require_quiet(driver, address):
    """No error of the page, and no request that leaves the machine."""
    assert not [one for one in driver.get_log("browser") if one["level"] == "SEVERE"]
    origin = "/".join(address.split("/")[:3]) + "/"
    for entry in driver.get_log("performance"):
        event = json.loads(entry["message"])["message"]
        if event["method"] == "Network.requestWillBeSent":
            asked = event["params"]["request"]["url"]
            assert asked.startswith((origin, "data:", "blob:", "chrome"))


def test_from_a_csv_to_a_report_by_clicks(served, driver, folder):
    process, address = served
    page = Page(driver, address)
    page.until("document.querySelectorAll('#listing button').length >= 2")
    page.click("#listing li:nth-child(2) button")
    page.until("document.body.dataset.first")
    # Drawn before anything is stated.
    assert "as they are written" in page.text("window-text")
    page.until("document.querySelectorAll('#raw-spectrum > *').length")
    assert page.script("return document.getElementById('analysis').hidden")
    page.state(kind="rate", unit="deg/s", rate="100")
    page.until("document.querySelector('#beside .differs')")
    page.state(unit="deg/h")
    page.until("document.querySelector('#beside .agrees')")
    assert not page.script("return document.getElementById('lacking').offsetHeight")
    page.until("document.getElementById('findings').dataset.done")

    page.state(spec="1deg/sqrt(h)")
    page.run()
    assert "N of x" in page.text("answer")
    assert "pass" in page.text("verdict")
    walk = sagnac.read(folder / "run.csv", kind="rate", unit="deg/h", sample_rate=100.0)
    expected = sagnac.analyze(walk).gyros["x"].angle_random_walk.to("deg/sqrt(h)")
    assert format(expected) in page.text("answer")

    # A line put back, and a band masked.
    page.click("#lines input")
    page.until("document.getElementById('trial').dataset.drawn")
    assert "becomes" in page.text("trial")
    page.until("document.getElementById('script').textContent.includes('left_in')")
    page.script("delete document.getElementById('trial').dataset.drawn")
    page.drag("#spectrum", 0.4, 0.6)
    page.until("document.querySelectorAll('#bands button').length === 1")
    page.until("document.getElementById('trial').dataset.drawn")

    # Another method beside it.
    page.state(method="none")
    page.run()
    assert page.script("return document.querySelectorAll('#runs tr').length") == 3
    assert page.find("#together").size["height"] > 100

    page.state(method="")
    page.click("#save-report")
    page.until("document.getElementById('saved').textContent.includes('report.html')")
    assert (folder / "run report" / "report.html").is_file()
    page.click("#save-toml")
    page.until("document.getElementById('saved').textContent.includes('.toml')")
    assert 'kind = "rate"' in (folder / "run report.toml").read_text()
    assert "--kind rate" in page.text("command")
    assert len(children(process.pid)) == 2
    require_quiet(driver, address)

    driver.get("about:blank")
    begun = time.monotonic()
    while children(process.pid) and time.monotonic() - begun < 10.0:
        time.sleep(0.05)
    assert not children(process.pid)


def test_zoom_span_and_a_file_that_is_hostile(served, driver):
    _, address = served
    page = Page(driver, address)
    page.until("document.querySelectorAll('#listing button').length >= 2")
    page.click("#listing li:nth-child(1) button")
    page.until("document.getElementById('message').textContent.includes('hostile.csv')")
    page.click("#listing li:nth-child(2) button")
    page.until("document.body.dataset.first")
    page.state(kind="rate", unit="deg/h", rate="100")
    page.until("document.getElementById('findings').dataset.done")
    drawn = page.script("return document.getElementById('trace').dataset.drawn")
    page.script(
        "const r = Bokeh.documents.flatMap((d) => d.roots()).flatMap((r) => r.children ?? [])"
        "[0].x_range; r.setv({start: 10, end: 12})"
    )
    page.until(f"document.getElementById('trace').dataset.drawn > {drawn}")
    drawn = page.script("return document.getElementById('trace').dataset.drawn")
    page.click("#whole")
    page.until(f"document.getElementById('trace').dataset.drawn > {drawn}")
    taken = "return document.querySelector('[name=slice]').value.includes(':')"
    for _ in range(8):
        # What is drawn late may move the figure away from under the pointer.
        page.click("#choose")
        page.drag("#trace", 0.3, 0.6)
        time.sleep(0.5)
        if page.script(taken):
            break
    assert page.script(taken)
    page.until("document.getElementById('facts').textContent.split(' ')[0] < 15000")
    require_quiet(driver, address)


def test_two_tabs_a_cancelled_run_and_a_server_that_ends(served, driver):
    process, address = served
    page = Page(driver, address)
    first = driver.current_window_handle
    page.until("document.querySelectorAll('#listing button').length >= 2")
    page.click("#listing li:nth-child(2) button")
    page.until("document.body.dataset.first")
    page.state(kind="rate", unit="deg/h", rate="100")
    page.until("!document.getElementById('analysis').hidden")
    page.click("#run")
    page.until("!document.getElementById('cancel').hidden")
    driver.switch_to.new_window("tab")
    other = Page(driver, address)
    other.until("document.querySelectorAll('#listing button').length >= 2")
    assert other.script("return document.getElementById('results').hidden")
    assert len(children(process.pid)) == 1
    driver.switch_to.window(first)
    page.click("#cancel")
    page.until("document.getElementById('stage').textContent === 'cancelled'")
    assert not children(process.pid)
    page.click("#run")
    page.until("!document.getElementById('cancel').hidden")
    (run,) = children(process.pid)
    process.kill()
    process.wait()
    begun = time.monotonic()
    while Path(f"/proc/{run}").exists() and time.monotonic() - begun < 10.0:
        time.sleep(0.05)
    assert not Path(f"/proc/{run}").exists()
    page.until("document.getElementById('message').textContent.includes('does not answer')")


def test_another_page_cannot_ask(served, driver, tmp_path):
    _, address = served
    (tmp_path / "other.html").write_text(
        "<script>fetch('" + address + "call/start', {method: 'POST', body: '{}', mode: 'no-cors'})"
        ".finally(() => document.title = 'asked')</script>"
        f"<iframe src='{address}'></iframe>"
    )
    driver.get(f"file://{os.fspath(tmp_path / 'other.html')}")
    Page.until(type("Tab", (), {"script": lambda self, text: driver.execute_script(text)})(),
               "document.title === 'asked'")  # fmt: skip
    said = [one["message"] for one in driver.get_log("browser")]
    # Neither the answer of a request nor the page in a frame reaches another origin.
    assert any("call/start" in one and "NotSameOrigin" in one for one in said)
    assert any("frame-ancestors" in one for one in said)
