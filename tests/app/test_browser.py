"""The page in Chromium: opened, stated, run, changed, compared and saved by clicks.

Out of the default suite: ``make test-browser``.
"""

import contextlib
import json
import os
import time
from pathlib import Path

import numpy as np
import pytest
from benchmarks._page import Page, chromium, served

import sagnac

pytestmark = pytest.mark.browser


@pytest.fixture
def folder(tmp_path):
    """A CSV that states nothing, of a bench; and one that cannot be read."""
    place = tmp_path / "bench"
    place.mkdir()
    random, time_s = np.random.default_rng(7), np.arange(30_000) / 100.0
    rates = np.array([9.0, 2.0, 11.88]) + 1.8 * random.standard_normal((30_000, 3))
    rates[:, 0] += 2.0 * np.cos(2.0 * np.pi * 7.0 * time_s)
    np.savetxt(place / "run.csv", rates, "%.6f", delimiter=",", header="x,y,z", comments="")
    rows = np.column_stack([10.0 * np.arange(3000.0), rates[:3000] / 3600.0])
    names = "Timestamp (ms),Gyro X (dps),Gyro Y (dps),Gyro Z (dps)"
    np.savetxt(place / "units.csv", rows, "%.9f", delimiter=",", header=names, comments="")
    (place / "hostile.csv").write_bytes(b"x,y\n<script>alert(1)</script>,\xff\n")
    return place


@pytest.fixture
def server(folder):
    with served(folder) as found:
        yield found


@pytest.fixture
def driver(tmp_path):
    with chromium(tmp_path / "profile") as made:
        yield made


def opened(driver, address, row):
    """The page with the file of a row of its list open, and its trace drawn."""
    page = Page(driver, address)
    page.until(f"document.querySelectorAll('#listing button').length >= {row}")
    page.click(f"#listing li:nth-child({row}) button")
    page.until("document.body.dataset.first")
    return page


def children(process_id):
    """Processes that a process has started."""
    tasks = Path(f"/proc/{process_id}/task").glob("*/children")
    found = {int(one) for path in tasks for one in path.read_text().split()}
    left = set()
    for one in found:
        # One may end while it is looked at. What tells of shared memory runs as long as the server.
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            if b"spawn_main" in Path(f"/proc/{one}/cmdline").read_bytes():
                left.add(one)
    return left


def require_quiet(driver, address):
    """No error of the page, and no request that leaves the machine."""
    assert not [one for one in driver.get_log("browser") if one["level"] == "SEVERE"]
    origin = "/".join(address.split("/")[:3]) + "/"
    for entry in driver.get_log("performance"):
        event = json.loads(entry["message"])["message"]
        if event["method"] == "Network.requestWillBeSent":
            asked = event["params"]["request"]["url"]
            assert asked.startswith((origin, "data:", "blob:", "chrome"))


def test_from_a_csv_to_a_report_by_clicks(server, driver, folder):
    process, address = server
    page = opened(driver, address, 2)
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


def test_zoom_span_and_a_file_that_is_hostile(server, driver):
    _, address = server
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
    page.until("!document.getElementById('analysis').hidden")
    # What was open is neither shown nor analyzed beside a file that cannot be read.
    page.click("#listing li:nth-child(1) button")
    page.until("document.getElementById('message').textContent.includes('hostile.csv')")
    for name in ("recording", "analysis"):
        assert page.script(f"return document.getElementById('{name}').hidden")
    # All that this one leaves open is guessed, and taken by a click.
    page.click("#listing li:nth-child(3) button")
    page.until("document.getElementById('lacking').offsetHeight")
    assert page.script("return document.getElementById('analysis').hidden")
    page.click("#reread")
    page.until("!document.getElementById('analysis').hidden")
    assert "100 Hz" in page.text("facts")
    require_quiet(driver, address)


def test_a_whole_number_keeps_its_zeros(server, driver):
    page = opened(driver, server[1], 2)
    page.state(kind="rate", unit="deg/h", rate="100000")
    page.until("document.getElementById('facts').textContent.includes('Hz')")
    assert "30000 samples, 100000 Hz, 0.3 s" in page.text("facts")


def test_a_dead_gyro_and_a_clipped_one_are_told_beside_the_others(server, driver, folder):
    _, address = server
    rates = np.random.default_rng(5).standard_normal((3000, 3))
    rates[:, 0], rates[:, 1] = 0.5, np.clip(rates[:, 1], -1.5, 1.5)
    np.savetxt(folder / "faulty.csv", rates, "%.6f", delimiter=",", header="x,y,z", comments="")
    page = opened(driver, address, 1)
    page.state(kind="rate", unit="deg/h", rate="100")
    page.until("document.getElementById('findings').dataset.done")
    page.until("document.querySelector('#findings .place')")
    page.click("#findings .place")
    page.run()
    row = page.script("return document.querySelector('#runs tr:nth-child(2)').textContent")
    assert "x was not analyzed: " in row
    assert "faulty.csv: x: is stuck" in row
    assert "name another channel with gyros or columns" in row
    # Marks of the check are drawn without an error of the page.
    require_quiet(driver, address)


def test_a_refusal_that_comes_late_is_not_said_of_what_is_open_by_then(server, driver):
    page = Page(driver, server[1])
    page.until("document.querySelectorAll('#listing button').length >= 3")
    page.script(
        "const asked = window.fetch; let late = true; window.fetch = async (name, body) => {"
        "  if (name !== 'call/open' || !late) return asked(name, body);"
        "  late = false; await new Promise((go) => { window.answerLate = go; });"
        "  return new Response(JSON.stringify({error: 'an earlier file'})); };"
    )
    page.click("#listing li:nth-child(1) button")
    page.click("#listing li:nth-child(2) button")
    page.until("document.body.dataset.first")
    page.script("window.answerLate()")
    time.sleep(0.5)
    assert page.script("return document.getElementById('message').hidden")


def test_a_result_is_no_wider_than_a_telephone(server, driver):
    page = opened(driver, server[1], 2)
    page.state(kind="rate", unit="deg/h", rate="100")
    page.until("!document.getElementById('analysis').hidden")
    page.run()
    narrow = {"width": 390, "height": 800, "deviceScaleFactor": 1, "mobile": True}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", narrow)
    time.sleep(1.0)
    assert page.script("return document.documentElement.scrollWidth") == 390


def test_the_table_of_a_campaign_is_as_wide_as_its_page(folder, tmp_path):
    made = sagnac.campaign(
        folder / "run.csv", tmp_path / "rack", pattern="(?P<unit>ben)(?P<day>ch)", workers=1,
        kind="rate", unit="deg/h", sample_rate=100.0, specification="0.003deg/sqrt(h)",
    )  # fmt: skip
    assert {line.verdict for line in made.lines} == {"undecided"}
    with chromium(tmp_path / "profile", size="1280,1000") as driver:
        page = Page(driver, made.paths[0].as_uri())
        wide = "const rows = document.getElementById('rows'); return rows.scrollWidth"
        assert page.script(wide) <= page.script("return rows.parentElement.clientWidth")
        # On A4, less its margins.
        paper = {"width": 673, "height": 900, "deviceScaleFactor": 1, "mobile": False}
        driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
        driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", paper)
        assert page.script("return document.documentElement.scrollWidth") <= 673


def test_the_table_of_a_campaign_sorts_by_keyboard_as_by_click(folder, tmp_path):
    files = [folder / f"{name}.csv" for name in "ab"]
    for one, size in zip(files, (2.0, 1.0), strict=True):
        rates = size * np.random.default_rng(3).standard_normal(6000)
        np.savetxt(one, rates, "%.6f", header="x", comments="")
    made = sagnac.campaign(
        files, tmp_path / "rack", workers=1, kind="rate", unit="deg/h", sample_rate=100.0
    )
    shown = "return [...document.querySelectorAll('#rows tbody a')].map(one => one.textContent)"
    with chromium(tmp_path / "profile", size="1280,1000") as driver:
        page = Page(driver, made.paths[0].as_uri())
        (head,) = [
            one for one in driver.find_elements("css selector", "#rows th") if "N (" in one.text
        ]
        assert page.script(shown) == ["a.csv", "b.csv"]
        page.script("document.querySelectorAll('#rows th')[0].focus()")
        for _ in range(int(page.script("return arguments[0].cellIndex", head))):
            driver.switch_to.active_element.send_keys("\ue004")  # Tab
        assert driver.switch_to.active_element == head
        for key, order in (("\ue007", "ba"), (" ", "ab"), ("x", "ab")):  # Enter, blank, no key
            head.send_keys(key)
            assert page.script(shown) == [f"{name}.csv" for name in order]
        head.click()
        assert page.script(shown) == ["b.csv", "a.csv"]


def test_a_table_that_turns(server, driver, folder):
    """Ten revolutions at 20 deg/s: the page against the truth that was put in."""
    _, address = server
    turning = sagnac.RigConfig.from_mapping(
        {"duration_s": 180, "sample_rate_hz": 100, "seed": 3, "table": {"rate_deg_per_s": 20}}
    )
    sagnac.write(sagnac.simulate(turning).recording, folder / "table.parquet")
    page = opened(driver, address, 3)
    assert "table rate20 °/s" in page.text("beside")
    page.state(gyros="x,z")
    page.until("document.getElementById('facts').textContent.includes('18000')")
    page.run()
    assert "per gyro" in page.text("answer") or "x-z" in page.text("answer")
    page.until("document.body.dataset.shown")
    for name in ("angle", "orders"):
        assert page.find(f"#{name}").size["height"] > 100
    assert "order " in page.text("lines")
    require_quiet(driver, address)


def test_two_tabs_a_cancelled_run_and_a_server_that_ends(server, driver):
    process, address = server
    page = opened(driver, address, 2)
    first = driver.current_window_handle
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


def test_another_page_cannot_ask(server, driver, tmp_path):
    _, address = server
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
