"""An analysis in a process of its own, which keeps it to be asked again and is ended with the page.

The process reads the file itself, tells how far it is, and then waits for what is asked of its
analysis. It ends when its pipe closes, and at once if the server does.
"""

import contextlib
import multiprocessing
import os
import threading
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import Any, Final

import sagnac
from sagnac.app import stated

# Seconds that a process is given to end before it is killed.
_PATIENCE: Final = 3.0

Told = Callable[[dict[str, Any]], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """What to analyze, and how.

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
        with contextlib.suppress(EOFError, OSError):
            while True:
                self._tell(self._pipe.recv())
        if not self._ended:
            self.process.join(_PATIENCE)
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

    def guarded(work: Callable[[], dict[str, Any]]) -> bool:
        try:
            answer = work()
        except (ValueError, OSError, MemoryError, ImportError) as error:
            answer = {"event": "failed", "line": stated.line(error)}
        pipe.send(answer)
        return bool(answer["event"] != "failed")

    kept: list[tuple[Any, Any]] = []

    def analyze() -> dict[str, Any]:
        progress("read", 0.0)
        recording = sagnac.read(task.path, **stated.reads(task.reading, task.analysis))
        choices = stated.choices(task.analysis)
        analysis = sagnac.analyze(recording, progress=progress, **choices)
        kept.append((analysis, {}))
        progress("figures", 0.0)
        return {"event": "done", "result": results.result(analysis, task.analysis.get("spec", ""))}

    if not guarded(analyze):
        return
    while True:
        request = pipe.recv()
        guarded(lambda: _answered(kept[0], task, request))  # noqa: B023  (at once)


def _answered(kept: tuple[Any, Any], task: Task, request: dict[str, Any]) -> dict[str, Any]:
    """What is asked of an analysis: a verdict, a trial, or files."""
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
