"""A real scheduler and two workers on loopback, started as the documentation says."""

import contextlib
import json
import socket
import subprocess
import threading
import time
from collections import Counter
from contextlib import contextmanager
from pathlib import Path

import pytest
from distributed import Client

from sagnac.fleet import runner
from tests.fleet.commands import campaign, command, rows_of
from tests.fleet.conftest import write_recording
from tests.processes import PYTHON, started


@contextmanager
def cluster(place: Path, workers: int = 2):
    """Address of a scheduler on loopback, its process, and those of its workers."""
    dask = [PYTHON, "-m", "dask"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    shared = ["--scheduler-file", str(place), "--no-dashboard"]
    scheduler = started(*dask, "scheduler", "--host", "127.0.0.1", "--port", "0", *shared, **quiet)
    # Without a nanny a worker that is killed is gone.
    worker = [*dask, "worker", "--nworkers", "1", "--nthreads", "1", "--no-nanny", *shared]
    all_workers = [started(*worker, "--host", "127.0.0.1", **quiet) for _ in range(workers)]
    try:
        yield _address(place, workers), scheduler, all_workers
    finally:
        for process in (scheduler, *all_workers):
            process.kill()
            process.wait(timeout=60)


def gives_the_same_table(address: str, recordings: Path, place: Path) -> None:
    """To the last digit, of a whole recording and a damaged one."""
    files = [str(recordings / f"{name}_day1.parquet") for name in "AC"]
    tables, shared = [], (*files, "-o")
    for name, where in (("local", ("--workers", 1)), ("there", ("--scheduler", address))):
        status, said, errors = campaign(*shared, place / name, *where)
        assert status == 1, errors
        assert "1 row without an answer left out\n" in said
        tables.append((place / name / "campaign.csv").read_bytes())
    assert tables[0] == tables[1]


def test_a_cluster_gives_the_same_table_and_one_that_is_lost_costs_no_row(folder, tmp_path) -> None:
    """A worker is killed first, then the scheduler, in the middle of the work."""
    recordings = tmp_path / "recordings"
    recordings.mkdir()
    names = [f"{unit}_day{day}.parquet" for unit in "ABC" for day in (1, 2)][:4]
    for number, name in enumerate(names):
        write_recording(recordings / name, seed=number)
    out = tmp_path / "out"
    words = [str(recordings), "-o", str(out)]
    with cluster(tmp_path / "scheduler.json") as (address, scheduler, workers):
        gives_the_same_table(address, folder, tmp_path)
        said = tmp_path / "said.txt"
        with said.open("w") as stream:
            words_there = command(*words, "--scheduler", address)
            running = started(*words_there, stdout=stream, stderr=stream)
            results = out / "results"
            for wanted, process in ((1, workers[0]), (2, scheduler)):
                until = time.monotonic() + 240.0
                while len(list(results.glob("*.json"))) < wanted and time.monotonic() < until:
                    assert running.poll() is None, said.read_text()
                    time.sleep(0.02)
                assert len(list(results.glob("*.json"))) >= wanted, said.read_text()
                process.kill()
            killed = time.monotonic()
            assert running.wait(timeout=90) == 1, said.read_text()
            assert time.monotonic() - killed < 45.0
    text = said.read_text()
    assert "Traceback" not in text
    assert "internal error" not in text
    rows = rows_of(out)
    assert sorted(Path(row["file"]).name for row in rows) == sorted(names)
    states = Counter(row["state"] for row in rows)
    # What is on the disk is done, also where the scheduler was lost before it could tell.
    assert 2 <= states["done"] <= len(list(results.glob("*.json")))
    assert states["lost"] == len(names) - states["done"] > 0
    assert {row["reason"] for row in rows if row["state"] == "lost"} == {
        "the scheduler was lost; start the same campaign again, and it goes on"
    }
    status, again, errors = campaign(*words, "--workers", 1)
    assert status == 0, errors
    assert [row["state"] for row in rows_of(out)] == ["done"] * len(names)
    assert f"{len(names)} rows analyzed now" not in again


@pytest.mark.parametrize("answers", ["nobody", "nothing", "rubbish"])
def test_who_is_no_scheduler_is_one_line(answers, folder, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(runner, "_PATIENCE", 2.0)
    began = time.monotonic()
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(0.2)
        stop = threading.Event()
        held: list[socket.socket] = []

        def serve() -> None:
            while not stop.is_set():
                with contextlib.suppress(TimeoutError):
                    held.append(server.accept()[0])
                    if answers == "rubbish":
                        held[-1].sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n" * 100)

        thread = threading.Thread(target=serve)
        thread.start()
        port = 9 if answers == "nobody" else server.getsockname()[1]
        address = f"tcp://127.0.0.1:{port}"
        try:
            status, _, errors = campaign(folder, "-o", tmp_path / "out", "--scheduler", address)
        finally:
            stop.set()
            thread.join()
            for one in held:
                one.close()
    assert status == 1
    assert f"no scheduler answers at {address}" in errors
    assert errors.count("sagnac: ") == 1
    assert time.monotonic() - began < 20.0  # twice the patience, on a busy machine


def _address(place: Path, workers: int = 2) -> str:
    """Address of the scheduler, once its workers are with it."""
    # The scheduler writes its file in place, so it can be there and still be empty.
    for _ in range(900):
        with contextlib.suppress(FileNotFoundError, json.JSONDecodeError):
            address = str(json.loads(place.read_text())["address"])
            break
        time.sleep(0.1)
    else:
        raise AssertionError(f"{place}: no address of a scheduler in 90 s")
    with Client(address) as client:
        client.wait_for_workers(workers, timeout=120)
    return address
