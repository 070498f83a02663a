"""Stages of an analysis: how long each took, how far it is, and which file an error is about."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from sagnac.analysis.settings import Progress
from sagnac.errors import RecordingError


class Stages:
    """The clock of one analysis.

    Parameters
    ----------
    progress
        Called with the stage and the fraction of it done; None for nobody.
    path
        Of the file, put into an error that does not name it: a stage knows the data alone.

    Attributes
    ----------
    seconds
        Wall time by stage, in the order in which the stages first began.
    """

    def __init__(self, progress: Progress | None, path: str) -> None:
        self._progress = progress or (lambda _stage, _fraction: None)
        self._path = path
        self.seconds: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[Callable[[float], None]]:
        """Time what is done inside; gives a function to be called with the fraction done."""
        began = time.perf_counter()
        self._progress(name, 0.0)
        try:
            yield lambda fraction: self._progress(name, fraction)
        except RecordingError as error:
            raise error.at(self._path) from None
        self._progress(name, 1.0)
        self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - began
