"""One gyro on a turning table: what its answer says of the encoder, and its sound twins."""

import numpy as np
import pytest
from scipy import stats

import sagnac
from sagnac.analysis.result import Analysis
from tests.analysis.recorded import recorded
from tests.instruments import Readout, turntable
from tests.second_rig import DEGREE, DEGREE_PER_ROOT_HOUR, Bench, simulate

RING_LASER, MEMS = 2.5e-5, 0.1  # deg/sqrt(h)
COMPANIONS = ("x", "y", "z")


def analyzed(names: tuple[str, ...], walk: float, **settings: object) -> Analysis:
    """Gyro x of a recording that holds these gyros."""
    bench = Bench(**{"seconds": 450.0, "sample_rate": 100.0, "walks": (walk,) * 3, **settings})
    return sagnac.analyze(recorded(simulate(bench), names), sagnac.Settings(gyros=("x",)))


# One draw in the default suite, the others in `make test-statistics`.
SEEDS = [1, *(pytest.param(seed, marks=pytest.mark.statistics) for seed in (2, 3))]


def of_encoder(result: Analysis) -> list[str]:
    """Warnings by which the encoder decides the answer."""
    return [
        note.text
        for note in result.notes
        if note.level == "warning"
        and ("the encoder decides" in note.text or "may be the encoder's" in note.text)
    ]


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    ("names", "settings", "why"),
    [
        (COMPANIONS, {"jitter": 100e-6}, "it hides the gyro's noise"),
        (("x", "z"), {"latency_walk": 100e-6}, "shows the same wander"),
    ],
    ids=["jitter", "walk"],
)
def test_beside_a_companion_the_encoder_leaves_a_bound_that_holds(names, settings, why, seed):
    result = analyzed(names, RING_LASER, seed=seed, **settings)
    answer = result.angle_random_walk
    assert answer.status == "upper bound"
    assert answer.low == 0.0
    assert 1.0 <= answer.to("deg/sqrt(h)").high / RING_LASER < 3.0
    (warning,) = of_encoder(result)
    assert why in warning
    assert f"{names[1]} together" in warning


@pytest.mark.parametrize("seed", SEEDS)
def test_a_lone_ring_laser_gyro_is_bounded_by_what_no_one_sees_of_the_encoder(seed):
    result = analyzed(("x",), RING_LASER, seed=seed, seconds=900.0)
    answer = result.angle_random_walk
    assert answer.status == "upper bound"
    assert answer.low == 0.0
    assert answer.to("deg/sqrt(h)").high >= RING_LASER
    (warning,) = of_encoder(result)
    assert "100 us in half an hour" in warning


def test_a_lone_gyro_beside_a_latch_that_jitters_is_told_of_it():
    result = analyzed(("x",), RING_LASER, jitter=100e-6)
    assert result.angle_random_walk.status != "estimated"
    assert of_encoder(result)


@pytest.mark.parametrize("seeds", [(1,), pytest.param((1, 2, 3), marks=pytest.mark.statistics)])
@pytest.mark.parametrize("names", [COMPANIONS, ("x",)], ids=["triad", "lone"])
def test_noise_above_the_encoders_is_the_gyros(names, seeds):
    held = 0
    for seed in seeds:
        result = analyzed(names, MEMS, seed=seed)
        answer = result.angle_random_walk
        assert answer.status == "estimated"
        shown = answer.to("deg/sqrt(h)")
        held += shown.low <= MEMS <= shown.high
        assert shown.high < 1.1 * MEMS
        assert of_encoder(result) == []
    assert held >= max(len(seeds) - 1, 1)


@pytest.mark.parametrize("seed", SEEDS)
def test_no_wander_is_said_of_an_encoder_that_has_none(seed):
    result = analyzed(COMPANIONS, RING_LASER, seed=seed)
    answer = result.angle_random_walk.to("deg/sqrt(h)")
    assert answer.low <= RING_LASER <= answer.high
    assert not any("wander" in text for text in of_encoder(result))


def test_what_the_encoder_may_add_lowers_the_interval_of_a_lone_gyro():
    # 100 us in half an hour at 40 deg/s and a share of 0.578, as a walk.
    unseen = 0.578 * 40.0 * 100e-6 / np.sqrt(1800.0) * 60.0
    walk = 8.0 * unseen
    answer = analyzed(("x",), walk).angle_random_walk
    assert answer.status == "estimated"
    shown = answer.to("deg/sqrt(h)")
    below, above = shown.value**2 - shown.low**2, shown.high**2 - shown.value**2
    assert below - above == pytest.approx(unseen**2, abs=0.5 * above)
    assert below > above


def test_what_the_levels_allow_bounds_a_lone_gyro_behind_jitter():
    # A reading's noise stands in each point of the curve; a level holds all of them.
    answer = analyzed(("x",), RING_LASER, jitter=20e-6, motion="reversing").angle_random_walk
    assert answer.status == "upper bound"
    assert 1.0 <= answer.to("deg/sqrt(h)").high / RING_LASER < 50.0


@pytest.mark.parametrize(
    ("settings", "most"),
    [
        ({"rate": 20.0}, 3.0),
        ({"rate": 20.0, "latency": 2e-3, "latency_drift": 1e-3}, 4.0),
        ({"rate": 20.0, "step": 36.0}, 100.0),
        ({"motion": "swinging", "swing": 200.0, "seconds": 600.0, "latency": 2e-3}, 5.0),
    ],
    ids=["jitter", "delay that drifts", "steps", "swing"],
)
def test_the_lowest_frequencies_bound_a_lone_gyro_behind_its_encoder(settings, most):
    usual = {"seconds": 1800.0, "sample_rate": 50.0, "jitter": 20e-6, "seed": 8}
    result = analyzed(("x",), RING_LASER, **{**usual, **settings})
    answer = result.angle_random_walk
    assert answer.status == "upper bound"
    assert 1.0 <= answer.to("deg/sqrt(h)").high / RING_LASER < most
    assert result.source == "the lowest frequencies of the spectrum of x"
    assert of_encoder(result)


def encoders() -> list[dict[str, object]]:
    """Encoders as they are, on tables of several rates and motions."""
    jitters = [
        *({"rate": rate, "jitter": 20e-6} for rate in (10.0, 20.0, 40.0)),
        *({"rate": rate, "jitter": by} for rate in (40.0, 80.0) for by in (1e-4, 2e-4, 5e-4)),
    ]
    drifts = [
        {"rate": rate, "latency": 2e-3, "latency_drift": by}
        for rate in (20.0, 40.0, 80.0)
        for by in (2e-4, 1e-3, 5e-3)
    ]
    walks = [{"rate": rate, "latency_walk": by} for rate in (20.0, 40.0) for by in (2e-5, 1e-4)]
    held = [
        {"rate": rate, "held_hz": by, "jitter": 0.0}
        for rate in (20.0, 40.0)
        for by in (10.0, 20.0, 50.0, 100.0)
    ]
    steps = [
        {"step": 36.0},
        {"step": 36.0, "rate": 20.0},
        {"step": 36.0, "jitter": 0.0, "hunting": 5e-4, "wander": 1e-5},
        {"step": 36.0, "jitter": 1e-4},
    ]
    motions = [
        {"motion": motion, "swing": swing, "jitter": jitter, "latency": latency}
        for motion in ("reversing", "dwelling", "swinging")
        for swing, jitter, latency in ((120.0, 2e-5, 0.0), (400.0, 1e-4, 2e-3))
    ]
    others = [{"clock": 20e-6}, {"lost": 1e-3}]
    return [*jitters, *drifts, *walks, *held, *steps, *motions, *others]


# Lowest ordinates that a straight line and a part of the table's motion take, at the least.
TAKEN = 2
WALKS = np.geomspace(1e-2, 1e6, 500)


def least_bound(bench: Bench) -> float:
    """Bound of N, in N, of an observer who is told the spectrum of this encoder's errors.

    The spectrum is that of the true errors without what a share, a delay and two orders explain.
    Ordinates are drawn from it and a walk as exponential numbers; each N keeps its likelihood,
    and the bound is its quantile of 95 %, the median of two hundred draws. A walk of the latch is
    no one's to tell from the gyro's.
    """
    recorded = simulate(bench)
    size, rate, table = recorded.table.size, recorded.sample_rate, recorded.true_table
    place, speed = np.linspace(-1.0, 1.0, size), np.gradient(table)
    known = [np.ones(size), place, table, speed, speed * place]
    known += [part(order * table) for order in (1.0, 2.0) for part in (np.cos, np.sin)]
    columns = np.stack(known, axis=1)
    columns /= np.linalg.norm(columns, axis=0)
    error = bench.shares[0] * (recorded.table - table)
    error -= columns @ np.linalg.lstsq(columns, error, rcond=1e-10)[0]
    window = np.hanning(size + 2)[1:-1]
    frequency = np.fft.rfftfreq(size, 1.0 / rate)[1:]
    power = np.abs(np.fft.rfft(error * window))[1:] ** 2 / (rate * np.sum(window**2))
    walk = bench.walks[0] * DEGREE_PER_ROOT_HOUR
    ordinates = power * (2.0 * np.pi * frequency) ** 2 / walk**2
    edges = np.unique(
        np.concatenate([np.arange(8), np.geomspace(8, frequency.size, 200)]).astype(int)
    )
    counts = np.diff(edges)[TAKEN:]
    level = np.add.reduceat(ordinates, edges[:-1])[TAKEN:] / counts
    random = np.random.default_rng(bench.seed)
    drawn = random.gamma(counts, (1.0 + level) / counts, size=(200, counts.size))
    mean = WALKS[:, np.newaxis] + level
    logarithm = -(drawn @ (counts / mean).T) - np.log(mean) @ counts
    weight = np.exp(logarithm - logarithm.max(axis=1, keepdims=True)) * np.sqrt(WALKS)
    below = np.cumsum(weight, axis=1) / weight.sum(axis=1, keepdims=True)
    bounds = [np.sqrt(np.interp(0.95, row, WALKS)) for row in below]
    latch = bench.shares[0] * bench.rate * DEGREE * bench.latency_walk / np.sqrt(bench.seconds)
    return max(float(np.median(bounds)), float(np.hypot(1.0, latch / walk)))


@pytest.mark.parametrize(
    ("motion", "seed"),
    [("steady", 13), pytest.param("dwelling", 13, marks=pytest.mark.statistics), ("dwelling", 25)],
)
def test_chance_at_the_lowest_frequencies_lowers_no_bound_of_what_was_read(motion, seed):
    walk, short = 3e-4, {"seconds": 600.0, "sample_rate": 50.0}
    result = analyzed(("x",), walk, motion=motion, seed=seed, **short)
    answer = result.angle_random_walk.to("deg/sqrt(h)")
    assert answer.status == "upper bound"
    assert walk <= answer.high < 1.2 * walk
    # It is the upper end of what the note tells.
    (warning,) = of_encoder(result)
    end = float(warning.split(" to ")[-1].split(")")[0])
    assert answer.high == pytest.approx(end, rel=1e-3)


@pytest.mark.statistics
def test_bounds_of_a_lone_gyro_hold_and_most_lie_below_three_times_the_truth():
    """Half an hour at 200 Hz, one encoder each; some hide the gyro whatever is done."""
    ratios, least = [], []
    for seed, encoder in enumerate(encoders(), start=100):
        long = {"seconds": 1800.0, "sample_rate": 200.0, "jitter": 20e-6, "rate": 40.0}
        settings = {**long, **encoder}
        result = analyzed(("x",), RING_LASER, seed=seed, **settings)
        answer = result.angle_random_walk
        assert answer.status == "upper bound", encoder
        ratios.append(answer.to("deg/sqrt(h)").high / RING_LASER)
        least.append(least_bound(Bench(walks=(RING_LASER,) * 3, seed=seed, **settings)))
        print(f"{ratios[-1]:.3g} times the truth, told the law {least[-1]:.3g}: {encoder}")
    shown, told = np.array(ratios), np.array(least)
    print(
        f"{np.count_nonzero(shown >= 1.0)} of {shown.size} hold, {np.count_nonzero(shown < 3.0)} "
        f"lie below 3, median {np.median(shown):.3g}, highest {shown.max():.3g}; told the law "
        f"{np.count_nonzero(told < 3.0)} below 3, and ours {np.median(shown / told):.3g} (median) "
        f"to {np.max(shown / told):.3g} times that"
    )
    assert np.count_nonzero(shown >= 1.0) >= stats.binom.ppf(0.01, shown.size, 0.95)
    assert np.count_nonzero(shown < 3.0) > 0.8 * np.count_nonzero(told < 3.0)
    assert np.median(shown / told) < 1.5
    assert shown.max() < 200.0


@pytest.mark.parametrize("walk", [50e-6, pytest.param(100e-6, marks=pytest.mark.statistics)])
def test_a_wander_of_the_latch_is_no_estimate_of_a_lone_gyro(walk):
    result = analyzed(("x",), RING_LASER, latency_walk=walk, jitter=20e-6)
    assert result.angle_random_walk.status == "upper bound"
    assert of_encoder(result)


def test_what_a_spline_leaves_of_slow_readings_is_no_estimate_beside_a_companion():
    result = analyzed(("x", "z"), RING_LASER, held_hz=10.0, sample_rate=200.0)
    answer = result.angle_random_walk
    assert answer.status == "upper bound"
    assert 1.0 <= answer.to("deg/sqrt(h)").high / RING_LASER < 3.0
    assert of_encoder(result)


def test_a_companion_that_is_not_sound_does_not_cost_the_other():
    made = simulate(Bench(seconds=300.0, sample_rate=100.0, walks=(MEMS,) * 3))
    stuck = made.angles["z"]
    stuck[stuck.size // 2 :] = stuck[stuck.size // 2]
    recording = recorded(made, ("x", "z"))
    answer = sagnac.analyze(recording, sagnac.Settings(gyros=("x",))).angle_random_walk
    assert answer.status == "estimated"


def test_readout_noise_of_one_gyro_beside_an_encoder_is_no_more_than_a_bound():
    made = turntable(
        8, seconds=600.0, sample_rate=50.0, walk=1e-3, jitter=1e-3, readout=Readout(step=1e-3)
    )
    # 2 arcsec of the encoder, which one gyro has as its own, and two have not.
    late = made.encoder + np.random.default_rng(8).normal(0.0, 2.0 / 3600.0, made.encoder.size)
    recording = sagnac.Recording.from_arrays(
        x=made.angles["x"],
        z=made.angles["z"],
        table=late,
        kind="angle",
        unit="arcsec",
        sample_rate=50.0,
    )
    alone, pair = (
        sagnac.analyze(recording, gyros=gyros).coefficients["quantization"]
        for gyros in (("x",), ("x", "z"))
    )
    assert alone.status == "upper bound"
    assert alone.to("arcsec").high > 0.5
    assert pair.to("arcsec").high < 0.01
