"""The page of ``sagnac app`` in Chromium: first picture, pan and zoom, a line switched off.

Each time is of the clock of the page: from the click until the figures stand, from the gesture to
the frame after the drawing. Beside it stand the processor seconds that server and browser took,
which depend less on what else the machine does.

    python -m benchmarks.app [--hours 2 24] [--gestures 40] [--no-lines]
"""

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, Final

import numpy as np

import sagnac
from benchmarks._page import Page, chromium, lacking, served

RATE: Final = 500.0
TURN_DEG_S: Final = 40.0
# Notes every gesture, and the frame after the picture that answers it.
LISTEN: Final = """
window.waits = []; let asked = null;
for (const name of ['wheel', 'pointermove'])
  document.getElementById('trace').addEventListener(
    name, () => { asked ??= performance.now(); }, true);
const drawn = () => { const since = asked; asked = null;
  if (since === null) return;
  requestAnimationFrame(() => setTimeout(() => waits.push(performance.now() - since))); };
new MutationObserver(drawn).observe(
  document.getElementById('trace'), { attributeFilter: ['data-drawn'] });
"""


def recording(hours: float) -> sagnac.Recording:
    """Two gyros on a table at 40 deg/s: white noise of 1e-4 deg/sqrt(h), two lines and an order."""
    size = int(hours * 3600.0 * RATE)
    random, time_s = np.random.default_rng(1), np.arange(size) / RATE

    def gyro(share: float, lines: float) -> Any:
        angle = random.standard_normal(size)
        angle *= 1e-4 / 60.0 / np.sqrt(RATE)
        np.cumsum(angle, out=angle)
        angle += share * TURN_DEG_S * time_s
        for hertz in (7.3, 50.0, 12.0 * TURN_DEG_S / 360.0):
            angle += lines * np.sin(2.0 * np.pi * hertz * time_s)
        return angle

    return sagnac.Recording.from_arrays(
        x=gyro(0.5774, 5e-5), z=gyro(0.5770, 0.0), table=TURN_DEG_S * time_s,
        kind="angle", unit="deg", sample_rate=RATE,
    )  # fmt: skip


def processor_s(process_id: int) -> float:
    """Processor time of a process and of all that it started, s."""
    used, ticks = 0.0, os.sysconf("SC_CLK_TCK")
    waiting = [process_id]
    while waiting:
        one = Path(f"/proc/{waiting.pop()}")
        try:
            fields = (one / "stat").read_text().rpartition(")")[2].split()
            waiting += [
                int(child)
                for path in one.glob("task/*/children")
                for child in path.read_text().split()
            ]
        except (FileNotFoundError, ProcessLookupError):
            continue
        used += sum(map(int, fields[11:15])) / ticks
    return used


class Measured:
    """What is printed: times of the page, and processor time since the last row."""

    def __init__(self, server: int, browser: int) -> None:
        self.processes = (server, browser)
        self.before = [processor_s(one) for one in self.processes]

    def row(self, what: str, waits_s: list[float]) -> None:
        """Median and 95th percentile of times, and processor time of each on average."""
        now = [processor_s(one) for one in self.processes]
        spent = [(b - a) / len(waits_s) for a, b in zip(self.before, now, strict=True)]
        self.before = now
        middle, late = np.quantile(waits_s, [0.5, 0.95])
        print(
            f"| {what} | {len(waits_s)} | {middle:.3f} s | {late:.3f} s | "
            f"{spent[0]:.3f} s | {spent[1]:.3f} s |",
            flush=True,
        )


def gestures(page: Page, count: int) -> list[float]:
    """Zoom in and out by the wheel and drag; the times until each picture, s."""
    from selenium.webdriver import ActionChains  # noqa: PLC0415  (of an extra)
    from selenium.webdriver.common.actions.wheel_input import ScrollOrigin  # noqa: PLC0415

    page.script(LISTEN)
    place = page.find("#trace")
    for number in range(count):
        drawn = page.script("return document.getElementById('trace').dataset.drawn")
        chain = ActionChains(page.driver, duration=20)
        if number % 3 == 2:
            chain.move_to_element(place).click_and_hold().move_by_offset(90, 0).release().perform()
        else:
            turn = -240 if number % 8 < 5 else 300
            chain.scroll_from_origin(ScrollOrigin.from_element(place), 0, turn).perform()
        page.until(f"document.getElementById('trace').dataset.drawn !== '{drawn}'")
        time.sleep(0.3)
    return [0.001 * wait for wait in page.script("return waits")]


def toggles(page: Page, count: int) -> list[float]:
    """Switch a line off and on beside one that stays off; the times until all figures stand, s."""
    waits = []
    for number in range(count):
        page.script("delete document.getElementById('trial').dataset.drawn")
        page.click(f"#lines tr:nth-child({3 if number else 2}) input")
        waits.append(0.001 * float(page.until("document.getElementById('trial').dataset.drawn")))
    return waits


def measure(hours: float, count: int, lines: bool) -> None:
    """All rows of one length."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "room"
        place.mkdir()
        made = recording(hours)
        size = f"{1e-6 * made.samples:.3g} M"
        sagnac.write(made, place / "run.parquet")
        del made
        with served(place) as (process, address), chromium(Path(folder) / "profile") as driver:
            page = Page(driver, address)
            page.until("document.querySelectorAll('#listing button').length")
            time.sleep(3.0)  # as long as a person takes to find the file
            told = Measured(process.pid, driver.service.process.pid)
            firsts = []
            for _ in range(3):
                page.script("delete document.body.dataset.first")
                page.click("#listing button")
                firsts.append(0.001 * float(page.until("document.body.dataset.first")))
                page.until("document.getElementById('findings').dataset.done")
            told.row(f"{size}: first picture (then spectrum and check)", firsts)
            told.row(f"{size}: pan and zoom", gestures(page, count))
            if lines:
                page.run()
                told = Measured(process.pid, driver.service.process.pid)
                told.row(f"{size}: a line off or on", toggles(page, count // 4))


def main(arguments: list[str] | None = None) -> int:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hours", type=float, nargs="+", default=[2.0, 24.0])
    parser.add_argument("--gestures", type=int, default=40)
    parser.add_argument("--no-lines", action="store_true")
    chosen = parser.parse_args(arguments)
    if lacking():
        print(lacking())
        return 0
    print("| | times | median | 95th percentile | server, processor | browser, processor |")
    print("|---|---|---|---|---|---|")
    for hours in chosen.hours:
        # The search takes minutes of 43 million samples, and a line then the same time as of 3.6.
        measure(hours, chosen.gestures, lines=not chosen.no_lines and hours <= 2.0)
    return 0


if __name__ == "__main__":
    sys.exit(main())
