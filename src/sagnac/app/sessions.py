"""What belongs to one open page: its recordings, its runs, and what it is told."""

import asyncio
import csv
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from sagnac.app.looks import Look
from sagnac.app.runs import Run, Task

# Runs whose process is kept to be asked again, and events that a page may have missed.
_KEPT_RUNS: Final = 4
_KEPT_LOOKS: Final = 4


@dataclass(slots=True, kw_only=True, eq=False)
class Session:
    """One page.

    Attributes
    ----------
    loop
        In which events are handed on.
    looks
        Recordings that it has open, by number.
    runs
        Analyses, by number.
    said
        The latest event of each run: a page that comes back is told these.
    missed
        Other events while the page listened to none.
    listener
        Wakes the stream of events; None if the page listens to none.
    left
        When the page stopped listening, s of a clock that stands still while the machine sleeps.
    """

    loop: asyncio.AbstractEventLoop
    looks: dict[int, Look] = field(default_factory=dict)
    runs: dict[int, Run] = field(default_factory=dict)
    said: dict[int, dict[str, Any]] = field(default_factory=dict)
    missed: list[dict[str, Any]] = field(default_factory=list)
    listener: "asyncio.Queue[dict[str, Any]] | None" = None
    left: float = field(default_factory=time.monotonic)
    count: int = 0

    def keep(self, look: Look) -> int:
        """A number by which the page names a recording; the oldest of many is forgotten."""
        self.count += 1
        self.looks[self.count] = look
        while len(self.looks) > _KEPT_LOOKS:
            self.looks.pop(next(iter(self.looks)))
        return self.count

    def start(self, task: Task) -> int:
        """Start a run; the oldest of many ends."""
        self.count += 1
        number = self.count

        def tell(event: dict[str, Any]) -> None:
            self.loop.call_soon_threadsafe(self._say, number, event)

        while len(self.runs) >= _KEPT_RUNS:
            self.cancel(next(iter(self.runs)))
        self.runs[number] = Run(task, tell)
        return number

    def _say(self, number: int, event: dict[str, Any]) -> None:
        if number not in self.runs:
            return
        event = {**event, "run": number}
        if event["event"] in ("progress", "done", "failed"):
            self.said[number] = event
        elif self.listener is None:
            self.missed.append(event)
        if self.listener is not None:
            self.listener.put_nowait(event)

    def cancel(self, number: int) -> bool:
        """End a run; whether there was one."""
        run = self.runs.pop(number, None)
        self.said.pop(number, None)
        if run is not None:
            run.end()
        return run is not None

    def listen(self) -> "asyncio.Queue[dict[str, Any]]":
        """Events from now on, after the latest of each run."""
        queue: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        for event in (*self.said.values(), *self.missed):
            queue.put_nowait(event)
        self.missed.clear()
        self.listener = queue
        return queue

    def leave(self, queue: "asyncio.Queue[dict[str, Any]]") -> None:
        """The page listens no more."""
        if self.listener is queue:
            self.listener, self.left = None, time.monotonic()

    def end(self) -> None:
        """End all runs."""
        for number in list(self.runs):
            self.cancel(number)
        self.looks.clear()


@dataclass(slots=True, kw_only=True, eq=False)
class Sessions:
    """All pages that are open.

    Attributes
    ----------
    patience
        Seconds after which a page that no longer listens counts as closed.
    """

    patience: float = 600.0
    open: dict[str, Session] = field(default_factory=dict)

    def of(self, name: str, loop: asyncio.AbstractEventLoop) -> Session:
        """The session of a page, a new one if it is not known.

        ValueError if the name cannot be one, or there are too many pages.
        """
        if name not in self.open:
            if not (8 <= len(name) <= 64 and name.isalnum()):
                raise ValueError("the page has no name of its own; load it again")
            if len(self.open) >= 64:
                raise ValueError("64 pages are open; close some")
            self.open[name] = Session(loop=loop)
        return self.open[name]

    def close(self, name: str) -> str:
        """A page was closed; its name."""
        if session := self.open.pop(name, None):
            session.end()
        return name

    def forget_left(self, now: Callable[[], float] = time.monotonic) -> None:
        """Close those that were left long ago."""
        for name, session in list(self.open.items()):
            if session.listener is None and now() - session.left > self.patience:
                self.close(name)

    def end(self) -> None:
        """Close all."""
        for name in list(self.open):
            self.close(name)


def campaign_table(folder: Path) -> dict[str, Any]:
    """The table of a campaign's folder.

    ValueError if the folder holds none.
    """
    try:
        with (folder / "campaign.csv").open(newline="", encoding="utf-8") as stream:
            rows = list(csv.reader(stream))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{folder}: campaign.csv cannot be read ({error})") from None
    if not rows:
        raise ValueError(f"{folder}: campaign.csv is empty")
    return {"head": rows[0], "rows": rows[1:2001], "left_out": max(0, len(rows) - 2001)}
