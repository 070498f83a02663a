"""The one door: what it names, what it costs, and what it can do without."""

import subprocess
import sys

import numpy as np
import pytest

import sagnac

NAMES = {
    "Analysis",
    "Channel",
    "Estimate",
    "Note",
    "Recording",
    "RecordingError",
    "RigConfig",
    "Settings",
    "StabilityCurve",
    "__version__",
    "analyze",
    "fast_orthogonal_search",
    "fit_coefficients",
    "plot",
    "read",
    "remove_lines",
    "simulate",
    "stability_curve",
    "write",
}


def run(code, *arguments):
    return subprocess.run(
        [sys.executable, "-c", code, *arguments],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


def test_the_door_shows_what_it_exports_and_nothing_else():
    assert set(dir(sagnac)) == set(sagnac.__all__) == NAMES
    for name in NAMES:
        assert getattr(sagnac, name) is not None
        assert name == "__version__" or getattr(sagnac, name).__doc__


def test_a_name_that_is_not_there_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'likelihood'"):
        _ = sagnac.likelihood


def test_importing_loads_nothing_heavy():
    heavy = "{'numpy', 'scipy', 'numba', 'matplotlib', 'pyarrow', 'h5py', 'pandas', 'finufft'}"
    done = run(f"import sagnac, sys; print({heavy} & set(sys.modules))")
    assert done.stdout.strip() == "set()", done.stderr


def test_field_units_are_converted_on_the_way_in():
    rates = np.random.default_rng(3).standard_normal(4000)
    one = sagnac.Recording.from_arrays(x=list(rates), kind="rate", unit="deg/s", sample_rate=10.0)
    other = sagnac.Recording.from_arrays(
        x=np.deg2rad(rates), kind="rate", unit="rad/s", sample_rate=10.0
    )
    np.testing.assert_allclose(one.gyro("x").values, other.gyro("x").values, rtol=1e-12)
    found = sagnac.analyze(one, sagnac.Settings(method="none", interval=None))
    truth = np.deg2rad(1.0) / np.sqrt(10.0)
    assert found.angle_random_walk.low < truth < found.angle_random_walk.high
    degrees = float(found.angle_random_walk.to("deg/sqrt(h)"))
    assert degrees == pytest.approx(np.rad2deg(found.angle_random_walk.value) * 60.0)


BLOCKED = "import sys; sys.modules['finufft'] = None; "


def test_the_still_bench_runs_without_finufft(tmp_path):
    path = tmp_path / "still.csv"
    values = np.random.default_rng(5).standard_normal(3000)
    np.savetxt(path, values, header="x", comments="")
    done = run(
        BLOCKED + "from sagnac.cli import main; sys.exit(main())",
        "avar",
        str(path),
        "--kind",
        "rate",
        "--unit",
        "deg/h",
        "--rate",
        "10",
    )
    assert done.returncode == 0, done.stderr
    assert "ARW of gyro x" in done.stdout
