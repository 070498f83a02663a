"""What holds for every test, before numpy is imported."""

import os
import signal
from concurrent.futures import Executor, Future

import pytest

# Thousands of small factorizations: several threads only wait for one another.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("MKL_NUM_THREADS", "1")
# A shell that starts the tests in the background has them ignore SIGINT, and what they start, too.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


class _Here(Executor):
    """Does a job where it is given, for tests that are not about processes."""

    def __init__(self, **_: object) -> None:
        super().__init__()

    def submit(self, work, /, *arguments, **keywords):
        done: Future = Future()
        if work is os.getpid:
            done.set_result(0)  # of no process that may be ended
            return done
        try:
            done.set_result(work(*arguments, **keywords))
        except Exception as error:
            done.set_exception(error)
        return done


def in_one_process(patch: pytest.MonkeyPatch) -> None:
    patch.setattr("sagnac.core.processes.ProcessPoolExecutor", _Here)


def undrawn(patch: pytest.MonkeyPatch) -> None:
    patch.setattr("matplotlib.figure.Figure.draw", lambda *_: None)


@pytest.fixture
def in_this_process(monkeypatch):
    """Campaigns start no process, which takes longer to start than a short recording takes."""
    in_one_process(monkeypatch)


@pytest.fixture
def blank_figures(monkeypatch):
    """Figures are put together and not drawn, for tests that do not look at a picture.

    To draw them takes longer than to analyze a short recording.
    """
    undrawn(monkeypatch)
