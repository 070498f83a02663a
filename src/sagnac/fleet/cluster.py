"""Tasks done by the workers of a Dask scheduler: paths travel, not arrays."""

import asyncio
import importlib
import logging
import time
import uuid
from asyncio import CancelledError
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Final

from sagnac.errors import MissingExtra, RecordingError
from sagnac.fleet.config import Task
from sagnac.fleet.measure import Result, lost, measure
from sagnac.version import __version__

# Time that a scheduler has to answer, and after which one that is silent is lost, s.
_PATIENCE: Final = 20.0
_MOST_SILENT: Final = 10.0
# Between two looks at what has ended, and for a client to close, s.
_BETWEEN: Final = 0.2
_TO_CLOSE: Final = 5.0
_GOES_ON: Final = "start the same campaign again, and it goes on"


def completed(tasks: Sequence[Task], folder: Path, scheduler: str) -> Iterator[tuple[Task, Result]]:
    """Tasks with their results, in the order in which they end.

    Parameters
    ----------
    tasks
        What to do; their paths are those that the workers see.
    folder
        Of the campaign, which all workers have to see under this path.
    scheduler
        Its address: ``tcp://host:8786``.

    Raises
    ------
    MissingExtra
        If Dask is not installed.
    RecordingError
        If there is no such scheduler, it has no workers, or one of these has another version of
        the package or does not see the folder.
    """
    client = _connected(_distributed(), scheduler)
    try:
        _check_workers(client, folder)
        waiting = {
            client.submit(measure, task, folder, pure=False, retries=0): task for task in tasks
        }
        yield from _ended(client, waiting)
    except OSError as error:
        raise RecordingError(
            f"the scheduler at {scheduler} was lost ({_in_short(error)})", remedy=_GOES_ON
        ) from None
    finally:
        # What it still waits for is given up; one that has lost its scheduler would wait for it.
        client.close(timeout=_TO_CLOSE)


def _connected(distributed: Any, scheduler: str) -> Any:
    """A client of a scheduler.

    Raises
    ------
    RecordingError
        If none answers.
    """
    # It tells on the terminal what is told here.
    for name in ("distributed", "distributed.client", "distributed.comm", "tornado.application"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        # A client waits for ever for one that takes the call and says nothing.
        with ThreadPoolExecutor(max_workers=1) as pool:
            pool.submit(asyncio.run, _greeted(scheduler)).result()
        return distributed.Client(scheduler, timeout=_PATIENCE)
    except (OSError, ValueError, TypeError, MemoryError) as error:
        # Another program's answer is taken for the length of what follows, which may be anything.
        raise RecordingError(
            f"no scheduler answers at {scheduler} ({_in_short(error)})",
            remedy="start one with dask scheduler, and give the address that it prints",
        ) from None


async def _greeted(scheduler: str) -> None:
    """Return once a scheduler has answered.

    Raises
    ------
    OSError
        If none does in time.
    """
    connect = importlib.import_module("distributed.comm").connect
    comm = await asyncio.wait_for(connect(scheduler, timeout=_PATIENCE), _PATIENCE)
    comm.abort()


def _ended(client: Any, waiting: dict[Any, Task]) -> Iterator[tuple[Task, Result]]:
    """Tasks with their results as they end; all that wait are lost if the scheduler is."""
    silent = 0.0
    while waiting:
        ended = [future for future in waiting if future.done()]
        for future in ended:
            task = waiting.pop(future)
            yield task, _result_of(future, task)
        if ended:
            continue
        time.sleep(_BETWEEN)
        silent = silent + _BETWEEN if client.status != "running" else 0.0
        if silent > _MOST_SILENT:
            for task in waiting.values():
                yield task, lost(task, f"the scheduler was lost; {_GOES_ON}")
            return


def _result_of(future: Any, task: Task) -> Result:
    try:
        result: Result = future.result()
    except (Exception, CancelledError) as error:
        name = type(error).__name__
        if isinstance(error, OSError) or name.endswith("CancelledError"):
            return lost(task, f"the scheduler was lost; {_GOES_ON}")
        if name == "KilledWorker":
            return lost(task, "the worker died; it was killed, or memory ran out")
        return lost(task, f"{name}: {error}")
    return result


def _in_short(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def _check_workers(client: Any, folder: Path) -> None:
    """Every worker has this version and sees this folder."""
    token = folder / f".seen-{uuid.uuid4().hex}"
    token.write_text(token.name, encoding="ascii")
    try:
        found = client.run(_facts, token)
    finally:
        token.unlink()
    if not found:
        raise RecordingError(
            "the scheduler has no workers", remedy="start some with dask worker ADDRESS"
        )
    for address, (version, seen) in found.items():
        if version != __version__:
            raise RecordingError(
                f"worker {address} has sagnac {version}, this is {__version__}",
                remedy="install the same version everywhere",
            )
        if not seen:
            raise RecordingError(
                f"worker {address} does not see this folder",
                path=str(folder),
                remedy="choose an output that all workers share under one path",
            )


def _facts(token: Path) -> tuple[str, bool]:
    """On a worker: its version of the package, and whether it sees a file."""
    try:
        return __version__, token.read_text(encoding="ascii") == token.name
    except OSError:
        return __version__, False


def _distributed() -> Any:
    try:
        return importlib.import_module("distributed")
    except ImportError:
        raise MissingExtra("a campaign on a cluster", "distributed", "dask") from None
