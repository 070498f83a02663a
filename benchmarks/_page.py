"""The page of ``sagnac app`` in Chromium, driven as a person does it."""

import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

OPTIONS = (
    "--headless --no-sandbox --disable-dev-shm-usage --disable-gpu --disable-quic --no-first-run "
    "--disable-background-networking --disable-component-update --disable-sync"
)
PATIENCE = 240.0


def lacking() -> str:
    """What a driven page needs and this machine has not; empty if it has all."""
    needed = [one for one in ("chromium", "chromedriver") if shutil.which(one) is None]
    needed += [one for one in ("bokeh", "tornado", "selenium") if find_spec(one) is None]
    return f"left out: {', '.join(needed)} not installed; see make test-browser" if needed else ""


@contextmanager
def served(place: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """``sagnac app`` on a folder: its process and its address."""
    command = [sys.executable, "-m", "sagnac", "app", str(place), "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield process, process.stdout.readline().strip()
        finally:
            process.terminate()


@contextmanager
def chromium(profile: Path, size: str = "1500,1000") -> Iterator[Any]:
    """A driver of the Chromium that is installed, with a profile of its own."""
    from selenium import webdriver  # noqa: PLC0415  (of an extra)

    options = webdriver.ChromeOptions()
    for option in (*OPTIONS.split(), f"--window-size={size}", f"--user-data-dir={profile}"):
        options.add_argument(option)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    # Named, so that nothing is looked for elsewhere.
    options.binary_location = shutil.which("chromium") or ""
    service = webdriver.ChromeService(shutil.which("chromedriver"))
    driver = webdriver.Chrome(options=options, service=service)
    try:
        yield driver
    finally:
        driver.quit()


class Page:
    """A tab, driven as a person does."""

    def __init__(self, driver: Any, address: str) -> None:
        self.driver = driver
        driver.get(address)

    def script(self, text: str, *arguments: Any) -> Any:
        """What a script of the page returns."""
        return self.driver.execute_script(text, *arguments)

    def until(self, condition: str) -> Any:
        """Wait until an expression of the page is true; its value."""
        begun = time.monotonic()
        while time.monotonic() - begun < PATIENCE:
            found = self.script(f"return {condition}")
            if found:
                return found
            time.sleep(0.05)
        raise AssertionError(f"{condition}: never; {self.text('message')!r}")

    def find(self, selector: str) -> Any:
        """The first element of a selector."""
        return self.driver.find_element("css selector", selector)

    def text(self, name: str) -> str:
        """Text of the element of an id."""
        return str(self.script(f"return document.getElementById('{name}').textContent"))

    def click(self, selector: str) -> None:
        """Scroll to an element and click it."""
        element = self.find(selector)
        self.script("arguments[0].scrollIntoView({block: 'center'})", element)
        element.click()

    def state(self, **texts: str) -> None:
        """Type into fields of the forms, and leave each."""
        for name, text in texts.items():
            element = self.find(f"[name={name}]")
            element.clear()
            element.send_keys(text + "\t")

    def drag(self, selector: str, start: float, stop: float) -> None:
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

    def run(self) -> None:
        """Analyze, and wait for the answer."""
        before = self.script("return document.querySelectorAll('#runs button:enabled').length")
        self.click("#run")
        self.until(f"document.querySelectorAll('#runs button:enabled').length > {before}")
        self.until("document.getElementById('run').disabled === false")
        self.until("document.querySelector('#spectrum').dataset.lines")
