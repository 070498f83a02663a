"""From a CSV to a report on the page of ``sagnac app``, clicked in Chromium, a picture a step.

    python -m benchmarks.app_steps [--write]

Without ``--write`` it only clicks, and fails if a step no longer does what it says.
"""

import argparse
import io
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from PIL import Image

from benchmarks._made import here, made_page, with_stamp
from benchmarks._page import Page, chromium, lacking, served

SIZE: Final = "1100,820"
# Fewer would turn the blue, orange and red of thin curves into one grey.
COLORS: Final = 128


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """A click and what it shows.

    Attributes
    ----------
    click, text
        What is done, and what the picture shows.
    at
        Element that stands at the top of the picture.
    """

    click: str
    text: str
    at: str


STEPS: Final = (
    Step(
        click="Click the file",
        text="Its numbers are drawn as they are written, with their spectrum and histogram. The "
        "fields that the file does not answer are marked.",
        at="header",
    ),
    Step(
        click="Click `kind` and type `rate`, Tab, `deg/h`; in `rate`, `100` and Tab",
        text="The trace has its unit, the mean of the three gyros agrees with Earth rate, and the "
        "check has nothing to say. With `deg/s` the mean would be 3600 times that, and marked.",
        at="recording",
    ),
    Step(
        click="Click “Analyze”",
        text="N with its interval, what it rests on, the other coefficients, and the Allan "
        "deviation with the fit.",
        at="result",
    ),
    Step(
        click="Untick the line",
        text="It is put back, and N is estimated anew at once: it stays, by the levels of the "
        "spectrum. Tick it again, and all is as it was.",
        at="spectrum",
    ),
    Step(
        click="Click “Save report”",
        text="The folder stands beside the CSV. The command, the Python and the TOML below repeat "
        "the run; what was put back or masked is in the Python, and the other two say so.",
        at="repeat",
    ),
)


def bench(path: Path) -> None:
    """Five minutes of three gyros at rest, deg/h, one with a line at 7 Hz; nothing is stated."""
    random, time_s = np.random.default_rng(7), np.arange(30_000) / 100.0
    rates = np.array([9.0, 2.0, 11.88]) + 1.8 * random.standard_normal((30_000, 3))
    rates[:, 0] += 2.0 * np.cos(2.0 * np.pi * 7.0 * time_s)
    np.savetxt(path, rates, "%.6f", delimiter=",", header="x,y,z", comments="")


def clicked(page: Page, number: int) -> None:
    """Do a step and wait until it is done.

    AssertionError if the page does not show what the step says.
    """
    if number == 0:
        page.until("document.querySelectorAll('#listing button').length")
        page.click("#listing button")
        page.until("document.body.dataset.first")
        page.until("document.getElementById('findings').dataset.done")
        assert "as they are written" in page.text("window-text")
    elif number == 1:
        page.state(kind="rate", unit="deg/h", rate="100")
        page.until("document.querySelector('#beside .agrees')")
        page.until("document.getElementById('findings').dataset.done")
        assert page.text("findings") == "nothing"
    elif number == 2:
        page.run()
        page.until("document.body.dataset.shown")
        assert "N of x" in page.text("answer")
    elif number == 3:
        page.click("#lines input")
        page.until("document.getElementById('trial').dataset.drawn")
        assert "becomes" in page.text("trial")
        page.until("document.getElementById('script').textContent.includes('left_in')")
    else:
        page.click("#save-report")
        page.until("document.getElementById('saved').textContent.includes('report.html')")


def pictures() -> list[bytes]:
    """A picture of each step, PNG of few colours."""
    found = []
    with tempfile.TemporaryDirectory(prefix="sagnac-") as folder:
        place = Path(folder) / "bench"
        place.mkdir()
        bench(place / "run.csv")
        with served(place) as (_, address), chromium(Path(folder) / "profile", SIZE) as driver:
            page = Page(driver, address)
            for number, step in enumerate(STEPS):
                clicked(page, number)
                page.script(
                    "document.getElementById(arguments[0])?.scrollIntoView();"
                    "if (arguments[0] === 'header') window.scrollTo(0, 0);"
                    "else window.scrollBy(0, -70)",
                    step.at,
                )
                page.script("return new Promise((done) => setTimeout(done, 400))")
                drawn = Image.open(io.BytesIO(driver.get_screenshot_as_png())).convert("RGB")
                small = io.BytesIO()
                drawn.quantize(COLORS).save(small, "PNG", optimize=True)
                found.append(small.getvalue())
        assert (place / "run report" / "report.html").is_file()
    return found


def text() -> str:
    """The page of the docs."""
    parts = [
        "# From a CSV to a report in five clicks\n",
        "`sagnac app` in the folder of a CSV that states nothing: five minutes of three simulated "
        "gyros at rest,\nx with a line at 7 Hz. The clicks make the pictures (`python -m "
        "benchmarks.app_steps --write`).\n",
    ]
    for number, step in enumerate(STEPS, start=1):
        parts.append(f"**{number}. {step.click}.** {step.text}\n")
        parts.append(f"![Step {number}: {step.click.replace('`', '')}](app_step_{number}.png)\n")
    return "\n".join(parts)


def main(arguments: list[str] | None = None) -> int:
    """Click through the steps, and write the page if asked."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true")
    chosen = parser.parse_args(arguments)
    if lacking():
        print(lacking())
        return 0
    made = made_page("app_steps.md")
    for number, picture in enumerate(pictures(), start=1):
        print(f"step {number}: {len(picture) / 1e3:.0f} kB")
        if chosen.write:
            made.path.with_name(f"app_step_{number}.png").write_bytes(picture)
    if chosen.write:
        made.path.write_text(with_stamp(text(), made.digest, here()), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
