"""An open page: the folder that it may look into, its recordings, and its runs.

A run is an analysis in a process of its own, which reads the file itself, tells how far it is, and
then waits for what is asked of its analysis. It ends when its pipe closes, with the page, and at
once if the server does.
"""

import asyncio
import contextlib
import csv
import multiprocessing
import os
import re
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import Any, Final

import sagnac
from sagnac.app import stated
from sagnac.app.looks import Look

# ---- folders -----------------------------------------------------------------------

_MOST: Final = 500
_RECORDINGS: Final = re.compile(
    r"(?i)\.(?:csv|txt|dat|tsv|parquet|pq|np[yz]|hdf5?|h5|mat|nc|tdms|ulg|bag|db3|mcap|mseed|feather|"
    r"arrow|imu|bin|ins|lvm)$"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Room:
    """Folders whose files a page may open.

    Attributes
    ----------
    root
        Where the page was started: files are listed, read and written below it.
    dropped
        Where files lie that were dropped on the page.
    """

    root: Path
    dropped: Path

    def path(self, text: str, *, write: bool = False) -> Path:
        """A path that the page names, absolute or from the root.

        ValueError if it lies elsewhere, be it by a link.
        """
        if not text or "\0" in text:
            raise ValueError("no path is given")
        place = (self.root / text).resolve()
        allowed = (self.root,) if write else (self.root, self.dropped)
        if not any(place == one or one in place.parents for one in allowed):
            problem = f"{text} lies outside {self.root}, where the page was started"
            raise ValueError(f"{problem}; start sagnac app in the folder of the file")
        return place

    def listing(self, text: str) -> dict[str, Any]:
        """The content of a folder: folders first, then files that may be recordings.

        ValueError if it lies elsewhere. OSError If it cannot be read.
        """
        folder = self.path(text)
        entries = []
        for one in sorted(folder.iterdir(), key=lambda each: each.name.lower()):
            if not one.name.startswith(".") and (kind := _kind(one)):
                size = 0 if kind != "file" else one.stat().st_size
                entries.append({"name": one.name, "kind": kind, "size": size})
        entries.sort(key=lambda each: each["kind"] == "file")
        return {
            "folder": "." if folder == self.root else str(folder.relative_to(self.root)),
            "root": str(self.root),
            "entries": entries[:_MOST],
            "left_out": max(0, len(entries) - _MOST),
        }


def _kind(path: Path) -> str:
    """``folder``, ``campaign``, ``file``, or nothing if it is of no use here."""
    try:
        if path.is_dir():
            if (path / "campaign.csv").is_file():
                return "campaign"
            return "file" if (path / "metadata.yaml").is_file() else "folder"
        return "file" if path.is_file() and _RECORDINGS.search(path.name) else ""
    except OSError:
        return ""


# ---- runs --------------------------------------------------------------------------

# Seconds that a process is given to end before it is killed.
_PATIENCE: Final = 3.0

Told = Callable[[dict[str, Any]], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """A recording to analyze, and how.

    Attributes
    ----------
    path
        Of the recording.
    reading, analysis
        What is stated and chosen: option -> text.
    """

    path: Path
    reading: dict[str, str]
    analysis: dict[str, str]


class Run:
    """One analysis and its process.

    Parameters
    ----------
    task
        What it does.
    tell
        Called, in a thread of its own, with what the process says: ``{"event": "progress", ...}``.
    """

    def __init__(self, task: Task, tell: Told) -> None:
        self.task = task
        self._tell = tell
        # Spawned: a fork would copy threads of the libraries in mid-step.
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self.process: SpawnProcess = context.Process(target=_work, args=(theirs, task), daemon=True)
        self.process.start()
        theirs.close()
        self._ended = False
        threading.Thread(target=self._listen, daemon=True).start()

    def ask(self, request: dict[str, Any]) -> None:
        """Ask something of the analysis; an event answers. OSError if the process has ended."""
        self._pipe.send(request)

    def end(self) -> None:
        """End the process, in the middle of its work if need be: files appear whole or not."""
        self._ended = True
        self.process.terminate()
        self.process.join(_PATIENCE)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()

    def _listen(self) -> None:
        done = failed = False
        with contextlib.suppress(EOFError, OSError):
            while True:
                event = self._pipe.recv()
                done = done or event["event"] == "done"
                failed = failed or (event["event"] == "failed" and not done)
                self._tell(event)
        if self._ended:
            return
        self.process.join(_PATIENCE)
        # An analysis that failed has said why; that its process ends then is no news.
        if not failed:
            self._tell({"event": "failed", "line": "the process of the analysis has ended"})


def _work(pipe: Connection, task: Task) -> None:
    """In the process: analyze, then answer what is asked until the pipe closes."""
    parent = multiprocessing.parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
    warnings.simplefilter("ignore")
    # An interrupt is the server's to hear.
    with contextlib.suppress(EOFError, OSError, KeyboardInterrupt):
        _analyzed(pipe, task)


def _analyzed(pipe: Connection, task: Task) -> None:
    pipe.send({"event": "progress", "stage": "start", "fraction": 0.0})
    # Half a second, in which the page is told already that something happens.
    from sagnac.app import results  # noqa: PLC0415

    def progress(stage: str, fraction: float) -> None:
        pipe.send({"event": "progress", "stage": stage, "fraction": fraction})

    def guarded(work: Callable[[], dict[str, Any]], *others: type[Exception]) -> bool:
        told: tuple[type[Exception], ...] = (ValueError, OSError, MemoryError, ImportError, *others)
        try:
            answer = work()
        except told as error:
            answer = {"event": "failed", "line": stated.line(error)}
        pipe.send(answer)
        return bool(answer["event"] != "failed")

    kept: list[tuple[Any, Any]] = []

    def analyze() -> dict[str, Any]:
        progress("read", 0.0)
        recording = sagnac.read(task.path, **stated.reads(task.reading, task.analysis))
        analysis = sagnac.analyze(recording, progress=progress, **stated.choices(task.analysis))
        kept.append((analysis, {}))
        progress("figures", 0.0)
        return {"event": "done", "result": results.result(analysis, task.analysis.get("spec", ""))}

    if not guarded(analyze):
        return
    while True:
        request = pipe.recv()
        # What a question lacks, or has of another type, is a fault of the question.
        guarded(lambda: _answered(kept[0], task, request), LookupError, TypeError)  # noqa: B023  (at once)


def _answered(kept: tuple[Any, Any], task: Task, request: dict[str, Any]) -> dict[str, Any]:
    """The answer to a question on an analysis: a verdict, a trial, or files."""
    from sagnac.app import results  # noqa: PLC0415

    analysis, before = kept
    if request["ask"] == "verdict":
        return {"event": "verdict", "verdict": results.verdict(analysis, request["spec"])}
    if request["ask"] == "trial":
        each = (*analysis.each, *analysis.accelerometers.values())
        return {"event": "trial", **results.tried(each[request["channel"]], request, before)}
    target, what = Path(request["target"]), request["what"]
    text = stated.toml(task.reading, task.analysis)
    if what == "report":
        target = sagnac.write_report(analysis, target, settings=text).paths[0]
    elif what == "json":
        analysis.to_json(target)
    else:
        text = stated.remark(request.get("changed")) + text
        # Beside, then renamed: a process that is ended leaves no half of it.
        part = target.with_name(f".{target.name}.part")
        part.write_text(text, encoding="utf-8")
        os.replace(part, target)
    return {"event": "saved", "path": str(target)}


# ---- sessions ----------------------------------------------------------------------

# Runs whose process is kept to be asked again, and recordings that are kept to be looked at.
_KEPT: Final = 4


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
        while len(self.looks) > _KEPT:
            self.looks.pop(next(iter(self.looks)))
        return self.count

    def start(self, task: Task) -> int:
        """Start a run; the oldest of many ends."""
        self.count += 1
        number = self.count

        def tell(event: dict[str, Any]) -> None:
            self.loop.call_soon_threadsafe(self._say, number, event)

        kept = [one for one, run in self.runs.items() if run.process.is_alive()]
        for oldest in kept[: max(0, len(kept) + 1 - _KEPT)]:
            self.cancel(oldest)
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

    def ask(self, number: int, request: dict[str, Any]) -> None:
        """Ask something of a run; ValueError if its process has ended."""
        try:
            self.runs[number].ask(request)
        except (LookupError, OSError):
            problem = f"this analysis is no longer open: the last {_KEPT} can be changed"
            raise ValueError(f"{problem}, judged and saved; analyze the recording again") from None

    def cancel(self, number: int) -> bool:
        """End a run; whether there was one."""
        run = self.runs.pop(number, None)
        self.said.pop(number, None)
        if run is not None:
            run.end()
        return run is not None

    @contextlib.contextmanager
    def listening(self) -> "Iterator[asyncio.Queue[dict[str, Any]]]":
        """Inside, the page hears events from now on, after the latest of each run."""
        queue: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        for event in (*self.said.values(), *self.missed):
            queue.put_nowait(event)
        self.missed.clear()
        self.listener = queue
        try:
            yield queue
        finally:
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
    loop
        In which their events are handed on.
    patience
        Seconds after which a page that no longer listens counts as closed.
    """

    loop: asyncio.AbstractEventLoop
    patience: float = 600.0
    open: dict[str, Session] = field(default_factory=dict)

    def of(self, name: str) -> Session:
        """The session of a page, a new one if it is not known.

        ValueError if the name cannot be one, or there are too many pages.
        """
        if name not in self.open:
            if not (8 <= len(name) <= 64 and name.isalnum()):
                raise ValueError("the page has no name of its own; load it again")
            if len(self.open) >= 64:
                raise ValueError("64 pages are open; close some")
        # At once: two questions of one page may come together.
        return self.open.setdefault(name, Session(loop=self.loop))

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
        why = error.strerror if isinstance(error, OSError) else "it is no table of text"
        raise ValueError(f"{folder}: campaign.csv cannot be read ({why})") from None
    if not rows:
        raise ValueError(f"{folder}: campaign.csv is empty")
    return {"head": rows[0], "rows": rows[1:2001], "left_out": max(0, len(rows) - 2001)}
