"""Every benchmark takes the arguments that `make benchmark` gives it."""

import importlib
import pkgutil

import benchmarks
import pytest

NAMES = [one.name for one in pkgutil.iter_modules(benchmarks.__path__) if one.name[0] != "_"]


@pytest.mark.parametrize("name", NAMES)
def test_a_benchmark_reads_its_arguments(name, capsys):
    main = getattr(importlib.import_module(f"benchmarks.{name}"), "main", None)
    if main is None:
        # What several of them share has nothing to run.
        assert name in {"gallery", "rate_sweep", "recording_lines", "recording_sets"}
        return
    with pytest.raises(SystemExit) as ended:
        main(["--help"])
    assert ended.value.code == 0
    assert "--help" in capsys.readouterr().out
