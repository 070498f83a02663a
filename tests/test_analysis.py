"""From a recording to its angle random walk, every method, and every refusal."""

from dataclasses import replace

import numpy as np
import pytest

from sagnac import rig
from sagnac.analysis import Settings, analyze
from sagnac.recording import Channel, Provenance, Recording, RecordingError

DEGREE = np.pi / 180
ROOT_HOUR = DEGREE / 60.0  # rad/sqrt(s) in one deg/sqrt(h)
PAIR = Settings(gyros=("x", "z"))


@pytest.fixture(scope="module")
def simulation():
    """The paper's experiment for a quarter of an hour at 100 Hz, at twice the speed.

    At 40 deg/s its hundred turns would be too few for a curve of full turns.
    """
    base = rig.preset("paper")
    times = tuple(line for line in base.disturbances.time if line[0] < 50.0)
    return rig.simulate(
        replace(
            base,
            duration_s=900.0,
            sample_rate_hz=100.0,
            table=replace(base.table, rate_deg_per_s=80.0),
            disturbances=replace(base.disturbances, time=times),
        )
    )


@pytest.fixture(scope="module")
def answers(simulation):
    return {
        method: analyze(simulation.recording, replace(PAIR, method=method))
        for method in ("fos", "fos-paper", "fris", "none")
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
    assert answers["fos"].gyros_differenced == 2
    assert answers["fos"].channel == "x-z"


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
        return max(
            np.abs(
                np.log(answers[method].fits[fit].coefficients["angle_random_walk"].value / truth)
            )
            for fit in ("likelihood", "weighted")
            if answers[method].fits[fit].coefficients["angle_random_walk"].status
            != "not observable"
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
    # Between 0.05 and 0.5 Hz the residual has the density of two gyros' random walk, one-sided.
    band = (after.frequency > 0.05) & (after.frequency < 0.5)
    level = np.mean(after.density[band])
    assert level == pytest.approx(2.0 * 2.0 * true_walk(simulation) ** 2, rel=0.15)
    assert np.max(before.density[band]) > 1e3 * level


def test_stages_and_progress(simulation):
    seen = []
    result = analyze(
        simulation.recording, PAIR, progress=lambda stage, fraction: seen.append((stage, fraction))
    )
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
            unit="rad/s",
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
    assert result.gyros_differenced == 1


def test_every_sample_where_no_interval_is_asked():
    result = analyze(still(4000), Settings(gyros=("x",), interval=None))
    assert result.curve.tau[0] == pytest.approx(0.05)
    answer = result.angle_random_walk
    assert abs(answer.value - 1e-6) < 4.0 / 1.96 * 0.5 * (answer.high - answer.low)


def test_a_table_that_does_not_turn_is_noted():
    table = Channel(name="table", kind="angle", unit="rad", values=np.full(8000, 1.2))
    result = analyze(still(8000, table=table), Settings(gyros=("x",)))
    assert result.table_rate is None
    assert any("does not turn" in note for note in result.notes)


# --- refusals --------------------------------------------------------------------------------


def turned(turns, samples=8000, *, share=0.577):
    angle = 2.0 * np.pi * turns * np.arange(samples) / samples
    table = Channel(name="table", kind="angle", unit="rad", values=angle)
    recording = still(samples, table=table)
    follows = share * turns * 2.0 * np.pi / (samples / 20.0)
    gyro = replace(recording.gyros[0], values=recording.gyros[0].values + follows)
    return replace(recording, gyros=(gyro,))


@pytest.mark.parametrize(
    ("recording", "settings", "words"),
    [
        (still(), Settings(gyros=("x",), method="fris"), ["needs a turning table", "--table"]),
        (
            turned(1.3),
            Settings(gyros=("x",), method="fris"),
            ["never completes two full turns", "--method fos"],
        ),
        (
            turned(20, share=-0.577 * 20),
            Settings(gyros=("x",)),
            ["x", "times as fast as the table", "--unit"],
        ),
        (still(400), Settings(gyros=("x",)), ["a curve needs 32", "--interval 0.31s"]),
        (still(), Settings(gyros=("q",)), ["no gyro 'q'", "it has x", "--gyros"]),
        (still(), Settings(gyros=("x", "x")), ["x,x", "--gyros x,z"]),
        (still(), Settings(gyros=()), ["(none)", "--gyros x,z"]),
    ],
    ids=[
        "fris at rest",
        "no full turn",
        "too fast",
        "too short",
        "unknown",
        "twice",
        "no gyro named",
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
