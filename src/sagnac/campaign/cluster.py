"""Tasks done by the workers of a Dask scheduler: paths travel, not arrays."""

import importlib
import uuid
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from sagnac import __version__
from sagnac.campaign.measure import lost, measure
from sagnac.campaign.results import Result
from sagnac.campaign.tasks import Task
from sagnac.errors import MissingExtra, RecordingError

_PATIENCE = "20s"


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
    distributed = _distributed()
    try:
        client = distributed.Client(scheduler, timeout=_PATIENCE)
    except (OSError, ValueError, TypeError) as error:
        raise RecordingError(
            f"no scheduler answers at {scheduler} ({' '.join(str(error).split())})",
            remedy="start one with dask scheduler, and give the address that it prints",
        ) from None
    with client:
        _check_workers(client, folder)
        by_future = {
            client.submit(measure, task, folder, pure=False, retries=0): task for task in tasks
        }
        try:
            for future in distributed.as_completed(by_future):
                task = by_future[future]
                yield task, _result_of(future, task)
        finally:
            client.cancel([future for future in by_future if not future.done()])


def _result_of(future: Any, task: Task) -> Result:
    error = future.exception()
    if error is None:
        result: Result = future.result()
        return result
    if type(error).__name__ == "KilledWorker":
        return lost(task, "the worker died; it was killed, or memory ran out")
    return lost(task, f"{type(error).__name__}: {error}")


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
