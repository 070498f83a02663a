"""From a recording to its angle random walk, every method, and every refusal."""

from dataclasses import replace

import numpy as np
import pytest

from sagnac.analysis.pipeline import analyze, answer_of
from sagnac.analysis.settings import Settings
from sagnac.core import arrays
from sagnac.core.errors import RecordingError
from sagnac.core.units import UNITS
from sagnac.formats import read, write
from sagnac.formats.arrow import writer
from sagnac.formats.source import Outgoing
from sagnac.recording.model import Channel, Provenance, Recording
from sagnac.rig.config import preset
from sagnac.rig.simulate import simulate
from tests.processes import PYTHON, ran

DEGREE = np.pi / 180
ROOT_HOUR = DEGREE / 60.0  # rad/sqrt(s) in one deg/sqrt(h)
PAIR = Settings(gyros=("x", "z"))


@pytest.fixture(scope="module")
def simulation():
    """The paper's experiment for a quarter of an hour at 100 Hz, at twice the speed.

    At 40 deg/s its hundred turns would be too few for a curve of full turns.
    """
    base = preset("paper")
    times = tuple(line for line in base.disturbances.time if line[0] < 50.0)
    return simulate(
        replace(
            base,
            duration_s=900.0,
            sample_rate_hz=100.0,
            table=replace(base.table, rate_deg_per_s=80.0),
            disturbances=replace(base.disturbances, time=times),
        )
    )


@pytest.fixture(scope="module")
def told():
    """Stages and fractions of each method's analysis."""
    return {method: [] for method in ("fos", "fos-paper", "fris", "none")}


@pytest.fixture(scope="module")
def answers(simulation, told):
    return {
        method: analyze(
            simulation.recording,
            replace(PAIR, method=method),
            progress=lambda *told, seen=seen: seen.append(told),
        )
        for method, seen in told.items()
    }


def true_walk(simulation):
    return simulation.truth.pairs["x-z"].arw_deg_per_sqrt_h * ROOT_HOUR


def test_the_pair_gives_the_walk_that_was_put_in(simulation, answers):
    answer = answers["fos"].angle_random_walk
    truth = true_walk(simulation)
    assert answer.status == "estimated"
    # Half of a 95 % interval is 1.96 standard errors; four of them.
    half = 0.5 * (answer.high - answer.low)
    assert abs(answer.value - truth) < 4.0 / 1.96 * half
    assert half < 0.1 * truth
    assert answers["fos"].is_pair
    assert answers["fos"].channel == "x-z"


@pytest.mark.parametrize(
    "method", ["fos", "fos-paper", pytest.param("none", marks=pytest.mark.statistics)]
)
def test_the_answer_alone_is_that_of_the_whole_analysis(simulation, answers, method):
    alone, evidence = answer_of(simulation.recording, replace(PAIR, method=method))
    whole = answers[method]
    assert repr(alone.estimate) == repr(whole.angle_random_walk)
    # It leaves out the fits of the curve that no answer rests on.
    assert set(alone.fits) == {"likelihood"} | ({"paper"} if method == "fos-paper" else set())
    assert {name: repr(fit) for name, fit in alone.fits.items()} == {
        name: repr(whole.fits[name]) for name in alone.fits
    }
    assert repr(evidence.lines) == repr(whole.lines)
    for name in ("tau", "deviation", "low", "high"):
        np.testing.assert_array_equal(getattr(evidence.curve, name), getattr(whole.curve, name))


def test_all_of_a_pair_is_per_gyro(simulation, answers):
    """Written out: the curve at 1 s and 4 s and the density of the difference, both halved."""
    made = answers["none"]
    x, z = (simulation.recording.gyro(name).values for name in ("x", "z"))
    for cluster in (1, 4):
        steps = (x - z)[::100]
        second = steps[2 * cluster :] - 2.0 * steps[cluster:-cluster] + steps[: -2 * cluster]
        variance = np.mean(second**2) / (2.0 * cluster**2)
        at = int(np.argmin(np.abs(made.curve.tau - cluster)))
        assert made.curve.deviation[at] == pytest.approx(np.sqrt(0.5 * variance), rel=1e-6, abs=0.0)
    rates = 100.0 * np.diff(x - z)
    # A sine taper keeps what leaks from the table's orders below the noise.
    taper = np.sin(np.pi * np.arange(1, rates.size + 1) / (rates.size + 1))
    frequency = np.fft.rfftfreq(rates.size, 0.01)
    transformed = np.fft.rfft(taper * (rates - rates.mean()))
    density = 2.0 * np.abs(transformed) ** 2 / (100.0 * np.sum(taper**2))
    within = (frequency > 30.0) & (frequency < 45.0)
    shown = (made.spectrum.frequency > 30.0) & (made.spectrum.frequency < 45.0)
    width = np.gradient(made.spectrum.frequency)
    level = np.average(made.spectrum.density[shown], weights=width[shown])
    assert level == pytest.approx(0.5 * np.mean(density[within]), rel=0.02, abs=0.0)


def test_every_line_put_in_is_listed_and_no_other(simulation, answers):
    found = {(line.scale, round(line.frequency, 2)) for line in answers["fos"].lines}
    truth = {
        (line.scale, round(line.order or line.frequency_hz, 2)) for line in simulation.truth.lines
    }
    # 0.0137 Hz is twelve cycles, of which the random walk hides most.
    assert truth - found <= {("time", 0.01)}
    named = {(line.scale, round(line.frequency, 2)) for line in answers["fos"].lines if line.name}
    assert found - named <= truth


def test_fris_and_no_removal_are_wrong_and_fos_is_not(simulation, answers):
    truth = true_walk(simulation)

    def wrong(method):
        # No answer at all is as wrong as can be.
        return max(
            (
                np.abs(
                    np.log(
                        answers[method].fits[fit].coefficients["angle_random_walk"].value / truth
                    )
                )
                for fit in ("likelihood", "weighted")
                if answers[method].fits[fit].coefficients["angle_random_walk"].status
                != "not observable"
            ),
            default=np.inf,
        )

    assert wrong("fos") < np.log(1.2)
    assert wrong("none") > np.log(5.0)
    assert wrong("fris") > np.log(3.0)


def test_the_curve_is_of_points_at_the_interval(answers):
    tau = answers["fos"].curve.tau
    assert tau[0] == pytest.approx(1.0)
    assert answers["fos"].curve.deviation[0] < 0.1 * answers["fos"].curve_before.deviation[0]
    # Once a turn: 4.5 s at 80 deg/s.
    assert answers["fris"].curve.tau[0] == pytest.approx(4.5, rel=1e-3)


def test_spectra_before_and_after(simulation, answers):
    before, after = answers["fos"].spectrum_before, answers["fos"].spectrum
    assert before.frequency.shape == before.density.shape
    assert before.frequency[-1] == pytest.approx(50.0, rel=0.01)
    # Between 0.05 and 0.5 Hz the residual has the density of one gyro's random walk, one-sided.
    band = (after.frequency > 0.05) & (after.frequency < 0.5)
    level = np.mean(after.density[band])
    assert level == pytest.approx(2.0 * true_walk(simulation) ** 2, rel=0.15, abs=0.0)
    assert np.max(before.density[band]) > 1e3 * level


def test_stages_and_progress(answers, told):
    result, seen = answers["fos"], told["fos"]
    stages = {stage for stage, _ in seen}
    assert stages == set(result.seconds)
    assert all(0.0 <= fraction <= 1.0 for _, fraction in seen)
    assert all((stage, 1.0) in seen for stage in stages)
    assert result.table_rate == pytest.approx(80.0 * DEGREE, rel=1e-3)
    assert len(set(result.notes)) == len(result.notes)


# --- without a table -------------------------------------------------------------------------


def still(samples=40_000, rate=20.0, *, walk=1e-6, names=("x",), path="bench.csv", table=None):
    generator = np.random.default_rng(7)
    gyros = tuple(
        Channel(
            name=name,
            kind="rate",
            shown_in="rad/s",
            values=3e-5 + walk * np.sqrt(rate) * generator.standard_normal(samples),
        )
        for name in names
    )
    return Recording(
        gyros=gyros,
        sample_rate=rate,
        table=table,
        provenance=Provenance(path=path, sha256="0" * 64, format="csv"),
    )


@pytest.mark.parametrize("method", ["fos", "none"])
def test_a_single_gyro_at_rest(method):
    result = analyze(still(), Settings(gyros=("x",), method=method))
    answer = result.angle_random_walk
    half = 0.5 * (answer.high - answer.low)
    assert abs(answer.value - 1e-6) < 4.0 / 1.96 * half
    assert half < 0.1e-6
    assert result.lines == ()
    assert result.table_rate is None
    assert not result.is_pair


def test_every_sample_where_no_interval_is_asked():
    result = analyze(still(4000), Settings(gyros=("x",), interval=None))
    assert result.curve.tau[0] == pytest.approx(0.05)
    answer = result.angle_random_walk
    assert abs(answer.value - 1e-6) < 4.0 / 1.96 * 0.5 * (answer.high - answer.low)


def test_a_table_that_does_not_turn_is_noted():
    table = Channel(name="table", kind="angle", shown_in="rad", values=np.full(8000, 1.2))
    result = analyze(still(8000, table=table), Settings(gyros=("x",)))
    assert result.table_rate is None
    assert any("does not turn" in str(note) for note in result.notes)


# --- refusals --------------------------------------------------------------------------------


def turned(turns, samples=8000, *, share=0.577):
    angle = 2.0 * np.pi * turns * np.arange(samples) / samples
    table = Channel(name="table", kind="angle", shown_in="rad", values=angle)
    recording = still(samples, table=table)
    follows = share * turns * 2.0 * np.pi / (samples / 20.0)
    gyro = replace(recording.gyros[0], values=recording.gyros[0].values + follows)
    return replace(recording, gyros=(gyro,))


@pytest.mark.parametrize(
    ("recording", "settings", "words"),
    [
        (
            still(),
            Settings(gyros=("x",), method="fris"),
            ["needs a turning table", "table=COLUMN:UNIT"],
        ),
        (
            turned(1.3),
            Settings(gyros=("x",), method="fris"),
            ["never completes two full turns", "method=fos"],
        ),
        (
            turned(20, share=-0.577 * 20),
            Settings(gyros=("x",)),
            ["x", "times as fast as the table", "unit"],
        ),
        (still(400), Settings(gyros=("x",), interval=1.0), ["a curve needs 32", "interval=0.31s"]),
        (still(40), Settings(gyros=("x",), interval=1.0), ["a curve needs 32", "interval=0.05s"]),
        (
            turned(1.0, 180),
            Settings(gyros=("x",), interval=0.1),
            ["9 s of a turning table", "10 s or more", "(span)"],
        ),
        (still(), Settings(gyros=("q",)), ["no gyro 'q'", "it has x", "gyros"]),
        (still(names=("x", "y")), Settings(gyros=("x", "q")), ["no gyro 'q'", "x, y", "gyros"]),
        (still(), Settings(gyros=("x", "x")), ["x,x", "gyros=x,z"]),
        (still(), Settings(gyros=("a", "b", "c", "d")), ["a,b,c,d", "gyros=x,z"]),
    ],
)
def test_refusals_are_one_line_with_the_file_and_a_remedy(recording, settings, words):
    with pytest.raises(RecordingError) as caught:
        analyze(recording, settings)
    message = str(caught.value)
    assert message.startswith("bench.csv: ")
    assert "\n" not in message
    for word in words:
        assert word in message


# --- recordings longer than memory should hold ------------------------------------------------


def figures_of(result):
    """Every number of an analysis, by name."""
    curves = {"curve": result.curve, "before": result.curve_before}
    curves |= {curve.estimator: curve for curve in result.family}
    spectra = {"spectrum": result.spectrum, "spectrum before": result.spectrum_before}
    if result.density is not None:
        spectra["density"] = result.density
    estimates = {"answer": result.angle_random_walk, **result.per_gyro}
    for name, fit in result.fits.items():
        estimates |= {f"{name} {key}": one for key, one in fit.coefficients.items()}
    figures = {"table rate": np.array([result.table_rate or 0.0])}
    for name, curve in curves.items():
        figures |= {f"{name} tau": curve.tau, name: curve.deviation, f"{name} low": curve.low}
    for name, one in spectra.items():
        figures |= {f"{name} frequency": one.frequency, name: one.density}
    for name, one in estimates.items():
        figures[name] = np.array([one.value, one.low, one.high])
    return figures


@pytest.mark.parametrize(
    "settings",
    [
        PAIR,
        replace(PAIR, method="fris"),
        pytest.param(Settings(gyros=("y",), method="none"), marks=pytest.mark.statistics),
        # Without its lines: bounds of three gyros that the terms do not describe hang on rounding.
        Settings(gyros=("x", "y", "z")),
        replace(PAIR, method="none", interval=None, estimators=("adev", "mdev", "ohdev", "totdev")),
    ],
    ids=["lines", "full turns", "single", "triad", "every sample"],
)
def test_a_long_recording_gives_the_same_from_its_file(simulation, tmp_path, monkeypatch, settings):
    # Full turns need many. In the first 20,000 samples rounding decides whether B of the weighted
    # fit of three gyros is a bound.
    part = slice(None) if settings.method == "fris" else slice(20_000, 40_000)
    path = write(simulation.recording[part], tmp_path / "run.parquet")
    whole = analyze(read(path), settings)
    monkeypatch.setattr(arrays, "IN_MEMORY", 2**12)
    monkeypatch.setattr(arrays, "BLOCK", 2**12)
    recording = read(path)
    assert all(arrays.is_mapped(gyro.values) for gyro in recording.gyros)
    spans = analyze(recording, settings)
    assert [replace(note, effect=None) for note in spans.notes] == [
        replace(note, effect=None) for note in whole.notes
    ]
    assert [note.effect for note in spans.notes] == [
        note.effect and pytest.approx(note.effect, rel=1e-9) for note in whole.notes
    ]
    assert spans.source == whole.source
    found, expected = (
        [(line.frequency, line.amplitude, line.phase) for line in one.lines]
        for one in (spans, whole)
    )
    # Sums over table angle are good to 1e-9 of their largest, whatever the spans.
    rounding = 1e-6 if settings.method == "fos" else 1e-9
    assert np.array(found) == pytest.approx(np.array(expected), rel=rounding)
    expected, found = figures_of(whole), figures_of(spans)
    assert found.keys() == expected.keys()
    for name, values in expected.items():
        assert found[name] == pytest.approx(values, rel=rounding, nan_ok=True), name


def test_rates_are_summed_span_by_span(monkeypatch):
    recording = still()
    settings = Settings(gyros=("x",), method="none")
    whole = analyze(recording, settings)
    monkeypatch.setattr(arrays, "IN_MEMORY", 1000)
    monkeypatch.setattr(arrays, "BLOCK", 777)
    expected, found = figures_of(whole), figures_of(analyze(recording, settings))
    for name, values in expected.items():
        assert found[name] == pytest.approx(values, rel=1e-9, abs=0.0, nan_ok=True), name


MEASURE = """
import resource, sys
from pathlib import Path
from sagnac.core import arrays
from sagnac.analysis.pipeline import analyze, answer_of
from sagnac.analysis.settings import Settings
from sagnac.formats import read
from sagnac.quality.check import check

arrays.IN_MEMORY, arrays.BLOCK = 2**16, 2**16
for name in sys.argv[1:]:
    recording = read(name)
    check(recording)
    for method in ("fos", "fris"):
        analyze(recording, Settings(gyros=("x", "z"), method=method))
    curves = ("mdev", "totdev")
    analyze(recording, Settings(gyros=("x",), method="none", interval=None, estimators=curves))
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


def test_memory_does_not_grow_with_the_recording(tmp_path):
    samples, rate, turn = 2**19, 1000.0, 2.0 * np.pi
    random = np.random.default_rng(5)
    for name, pieces in (("short.parquet", 4), ("long.parquet", 64)):
        kinds = dict.fromkeys(("x", "y", "z"), "angle")
        units = {**dict.fromkeys(kinds, UNITS["arcsec"]), "table": UNITS["deg"]}
        heading = Outgoing(units=units, kinds=kinds, sample_rate=rate)
        with writer(tmp_path / name, heading) as append:
            for piece in range(pieces):
                seconds = (np.arange(samples // 64) + piece * (samples // 64)) / rate
                noise = 1e-6 * random.standard_normal((3, seconds.size))
                angles = 0.577 * turn * seconds + noise
                columns = dict(zip("xyz", angles, strict=True)) | {"table": turn * seconds}
                append(heading.in_units(columns))
    files = (str(tmp_path / name) for name in ("short.parquet", "long.parquet"))
    peaks = ran(PYTHON, "-c", MEASURE, *files, check=True).stdout.split()
    growth = 1024 * (int(peaks[1]) - int(peaks[0]))
    # A series in memory is 4 MiB, and there are seven at the least: three gyros, the table, the
    # difference, its increments and their spectrum; the search adds some. Spans and what
    # libraries keep are less.
    assert growth < 24 * 2**20
