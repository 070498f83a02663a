"""A real scheduler and two workers on loopback, started as the documentation says."""

import json
import subprocess
import sys
import time
from pathlib import Path

from distributed import Client

from tests.campaign.commands import campaign, environment


def test_cluster_gives_the_same_table_to_the_last_digit(folder, tmp_path) -> None:
    local = campaign(str(folder), "-o", str(tmp_path / "local"), "--span", "1min")
    assert local.returncode == 1, local.stderr
    dask = [sys.executable, "-m", "dask"]
    quiet = {"env": environment(), "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    place = tmp_path / "scheduler.json"
    shared = ["--scheduler-file", str(place), "--no-dashboard"]
    scheduler = [*dask, "scheduler", "--host", "127.0.0.1", "--port", "0", *shared]
    worker = [*dask, "worker", "--nworkers", "1", "--nthreads", "1", *shared]
    processes = [subprocess.Popen(one, **quiet) for one in (scheduler, worker, worker)]
    try:
        address = _address(place)
        cluster = tmp_path / "cluster"
        said = campaign(str(folder), "-o", str(cluster), "--span", "1min", "--scheduler", address)
    finally:
        for process in processes:
            process.terminate()
        for process in processes:
            process.wait(timeout=60)
    assert said.returncode == 1, said.stderr
    assert (cluster / "campaign.csv").read_bytes() == (
        tmp_path / "local" / "campaign.csv"
    ).read_bytes()
    assert "5 of 5" not in said.stdout  # one of them is damaged


def test_scheduler_that_is_not_there_is_one_line(folder, tmp_path) -> None:
    said = campaign(str(folder), "-o", str(tmp_path / "out"), "--scheduler", "tcp://127.0.0.1:9")
    assert said.returncode == 1
    assert "no scheduler answers at tcp://127.0.0.1:9" in said.stderr
    assert "Traceback" not in said.stderr


def _address(place: Path) -> str:
    """Address of the scheduler, once two workers are with it."""
    for _ in range(900):
        if place.exists():
            break
        time.sleep(0.1)
    address = str(json.loads(place.read_text())["address"])
    with Client(address) as client:
        client.wait_for_workers(2, timeout=120)
    return address
