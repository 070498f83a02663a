"""Jobs done by several processes: all of them, each once, whatever dies on the way."""

import os
import signal
import time
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing
from functools import partial
from itertools import pairwise

import pytest

from sagnac.core.processes import GIBIBYTE, Means, Standing, completed, means_of
from tests.processes import PYTHON, ran

TWO = Means(workers=2, memory=4.0 * GIBIBYTE)


def squared(number, folder):
    """A job: leaves its process in `folder`; number 3 dies, number 5 fails."""
    (folder / f"{number}-{os.getpid()}").touch()
    if number == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    if number == 5:
        raise ValueError("five")
    return number**2


def nothing(_):
    return 0.0


def test_each_job_is_done_once_and_a_death_or_an_error_is_of_one_alone(tmp_path):
    work = partial(squared, folder=tmp_path)
    futures = dict(completed(range(8), work, TWO, nothing))
    assert sorted(futures) == list(range(8))
    assert isinstance(futures.pop(3).exception(), BrokenProcessPool)
    with pytest.raises(ValueError, match="five"):
        futures.pop(5).result()
    assert {number: future.result() for number, future in futures.items()} == {
        number: number**2 for number in (0, 1, 2, 4, 6, 7)
    }
    places = [path.name.split("-") for path in tmp_path.iterdir()]
    assert sorted(int(number) for number, _ in places) == list(range(8))
    assert str(os.getpid()) not in {process for _, process in places}
    # Two workers, and the one that took the place of the dead.
    assert len({process for _, process in places}) <= 3


def span(_):
    """A job: when it began and ended."""
    began = time.monotonic()
    time.sleep(0.2)
    return began, time.monotonic()


def test_jobs_that_need_all_the_memory_run_one_after_another():
    ended = completed(range(3), span, TWO, lambda _: 3.0 * GIBIBYTE)
    spans = sorted(future.result() for _, future in ended)
    for (_, end), (begin, _) in pairwise(spans):
        assert begin >= end


def test_a_script_is_not_run_again_by_its_processes(tmp_path):
    """Though it has no ``if __name__ == "__main__"``."""
    script = tmp_path / "script.py"
    script.write_text(
        "from sagnac.core.processes import Means, completed\n"
        "ended = completed([-3], abs, Means(workers=1, memory=1e9), float)\n"
        "print([future.result() for _, future in ended])\n"
    )
    done = ran(PYTHON, str(script), check=True)
    assert done.stdout == "[3]\n"


def held_back(_):
    return signal.pthread_sigmask(signal.SIG_BLOCK, ())


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="no masks of signals here")
def test_an_interrupt_of_a_process_that_still_starts_is_left_to_the_parent():
    ((_, future),) = completed([0], held_back, TWO, nothing)
    assert signal.SIGINT in future.result()
    assert signal.SIGINT not in held_back(0)


def process_of(_):
    return os.getpid()


def test_who_takes_no_more_ends_the_processes():
    with closing(completed(range(2), process_of, TWO, nothing)) as ended:
        _, future = next(ended)
        assert _is_alive(future.result())
    assert not _is_alive(future.result())


def _is_alive(process):
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def test_time_left_is_that_of_what_was_made_now():
    standing = Standing(done=60, total=90, computed=10, elapsed_s=50.0)
    assert standing.left_s == 150.0
    assert standing.per_hour == 720.0
    assert Standing(done=60, total=90, computed=0, elapsed_s=1.0).left_s is None


def test_wrong_means_are_refused():
    with pytest.raises(ValueError, match="workers is 0"):
        means_of(workers=0)
    with pytest.raises(ValueError, match="memory is 0"):
        means_of(memory=0.0)
