"""Drift with temperature: fitted beside the noise and taken off, and nothing if there is none."""

import math
from dataclasses import replace

import numpy as np
import pytest

import sagnac
from sagnac.analysis.corrections import thermal_drift, without_temperature
from sagnac.core.errors import RecordingError
from tests.navigation.strapdown import coloured

RATE, SECONDS = 10.0, 6000.0
COUNT = int(RATE * SECONDS)
TIME = np.arange(COUNT) / RATE
WARM = 20.0 + 15.0 * -np.expm1(-TIME / 900.0) + 0.5 * np.sin(TIME / 200.0)
WHITE = 1e-5
LINEAR, SQUARE, RATE_OF = 4e-6, -4e-7, 3e-3  # rad/s per K, per K^2 and per K/s


def noise(seed, walk=0.0):
    random = np.random.default_rng(seed)
    made = WHITE * math.sqrt(RATE) * random.standard_normal(COUNT)
    return made + walk / math.sqrt(RATE) * np.cumsum(random.standard_normal(COUNT))


def drift(*, square=SQUARE, rate_of=RATE_OF):
    level = WARM - WARM.mean()
    return LINEAR * level + square * level**2 + rate_of * np.gradient(WARM, 1.0 / RATE)


def recorded(values, kind="rate", temperature=WARM, **more):
    steps = values / RATE
    shown = {"rate": values, "increment": steps, "angle": np.cumsum(steps)}[kind]
    unit = "rad/s" if kind == "rate" else "rad"
    return sagnac.Recording.from_arrays(
        x=shown, kind=kind, unit=unit, sample_rate=RATE, temperature=temperature, **more
    )


def test_the_terms_put_in_come_out_with_their_errors():
    found = []
    for seed in range(12):
        gyro = recorded(noise(seed) + drift()).gyro("x")
        made = thermal_drift(gyro, WARM, RATE)
        found.append((made.coefficients - [LINEAR, SQUARE, RATE_OF]) / made.errors)
    # 36 deviations in standard errors: their mean square is 1 within 24 % (1 sigma).
    assert np.mean(np.square(found)) == pytest.approx(1.0, abs=0.7)


def test_a_walk_of_the_rate_widens_the_errors_and_is_kept():
    walk = 6e-8
    found, walks = [], []
    for seed in range(8):
        made = thermal_drift(recorded(noise(seed, walk) + drift(square=0.0)).gyro("x"), WARM, RATE)
        found.append((made.coefficients[0] - LINEAR) / made.errors[0])
        walks.append(made.walk)
        assert made.walk_before > made.walk
    assert np.mean(np.square(found)) < 2.5
    # A walk is known to 30 % from one run; the mean of eight to 11 %.
    assert np.mean(walks) == pytest.approx(walk, rel=0.3)


@pytest.mark.parametrize("kind", ["rate", "increment", "angle"])
def test_what_is_left_is_the_noise(kind):
    made = noise(3)
    recording = recorded(made + drift(), kind)
    left = without_temperature(recording, ("x",)).gyro("x")
    assert left.kind == kind
    rates = {
        "rate": left.values,
        "increment": left.values * RATE,
        "angle": np.diff(left.values, prepend=0.0) * RATE,
    }[kind]
    rest = rates - made
    # Three terms fitted to 300 means are wrong by sqrt(3/300) of the noise of a mean of 20 s.
    wanted = math.sqrt(3.0 / 300.0) * WHITE / math.sqrt(20.0)
    assert (rest - rest.mean())[10:].std() < 2.0 * wanted
    assert drift().std() > 20.0 * wanted


def test_white_noise_beside_a_temperature_is_left_as_it_is():
    found = without_temperature(recorded(noise(4)), ("x",))
    np.testing.assert_array_equal(found.gyro("x").values, noise(4))
    (note,) = found.notes
    assert "no drift with it is seen" in note.text


def test_n_is_unchanged_and_slow_noise_gone():
    def curve(values):
        return sagnac.stability_curve(values, kind="rate", sample_rate=RATE)

    recording = recorded(noise(5) + drift())
    warmed = sagnac.analyze(recording, sagnac.Settings(covariates=("temperature",)))
    assert warmed.angle_random_walk.low < WHITE < warmed.angle_random_walk.high
    quiet, raw = curve(noise(5)), curve(noise(5) + drift())
    for tau in (500.0, 1000.0):
        at = np.argmin(np.abs(quiet.tau - tau))
        left = np.interp(quiet.tau[at], warmed.curve.tau, warmed.curve.deviation)
        assert left < 1.2 * quiet.deviation[at]
        assert raw.deviation[at] > 5.0 * left
    (said,) = (note.text for note in warmed.notes if "temperature" in note.text)
    assert "was taken off" in said
    assert "dT/dt" in said
    assert "(+- 1 sigma)" in said


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"temperature": None}, "has no column of temperature"),
        ({"temperature": np.full(COUNT, np.nan)}, "missing or infinite"),
        ({"table": 0.3 * TIME}, "motion of a table"),
    ],
)
def test_what_cannot_be_fitted_is_refused(change, said):
    recording = recorded(noise(6), **change)
    with pytest.raises(RecordingError, match=said):
        without_temperature(recording, ("x",))
    with pytest.raises(ValueError, match="covariates is 'pressure'"):
        sagnac.Settings(covariates=("pressure",))
    with pytest.raises(ValueError, match="give names"):
        sagnac.Settings(covariates="temperature")


def test_a_table_that_stands_still_hides_no_drift():
    recording = recorded(noise(6) + drift(), table=np.full(COUNT, 0.2))
    (note,) = without_temperature(recording, ("x",)).notes
    assert "was taken off" in note.text


def test_a_temperature_is_of_the_length_of_the_gyros_and_stays_with_them(tmp_path):
    with pytest.raises(ValueError, match="temperature has shape"):
        recorded(noise(7), temperature=WARM[:-1])
    recording = recorded(noise(7))
    assert recording != replace(recording, temperature=None)
    np.testing.assert_array_equal(recording[100:200].temperature, WARM[100:200])
    for name in ("run.csv", "run.parquet", "run.npz", "run.h5"):
        sagnac.write(recording, tmp_path / name)
        back = sagnac.read(tmp_path / name, columns={"temperature": "temperature"})
        np.testing.assert_allclose(back.temperature, WARM, rtol=1e-12)
        assert sagnac.read(tmp_path / name).temperature is None


RECORDINGS = 100
# White noise, flicker and walk of each kind, by turns; none has a ramp. Two hours at 1 Hz.
SLOW = {"white": (0.0, 0.0), "flicker": (1.5e-6, 0.0), "walk": (0.0, 1e-7), "both": (1e-6, 6e-8)}
SLOW_SECONDS = 7200


def slow_coverage(recordings):
    """Whether B, K and R hold by the way it was analyzed, and N of each way, of each recording."""
    random = np.random.default_rng(31)
    times = np.arange(SLOW_SECONDS)
    held = {way: {name: [] for name in ("B", "K", "R")} for way in ("none", "fitted", "left in")}
    walks = {way: [] for way in held}
    for place in range(recordings):
        flicker, walk = list(SLOW.values())[place % len(SLOW)]
        made = coloured(random, 1, SLOW_SECONDS, white=WHITE, flicker=flicker, walk=walk)[0, :, 0]
        warm = 20.0 + 15.0 * -np.expm1(-times / random.uniform(600.0, 1500.0))
        warm += 0.5 * np.sin(times / random.uniform(150.0, 400.0))
        level = warm - warm.mean()
        moved = LINEAR * level + SQUARE * level**2 + RATE_OF * np.gradient(warm)
        for way, rates in {"none": made, "fitted": made + moved, "left in": made + moved}.items():
            recording = sagnac.Recording.from_arrays(
                x=rates, kind="rate", unit="rad/s", sample_rate=1.0, temperature=warm
            )
            fitted = ("temperature",) if way == "fitted" else ()
            found = sagnac.analyze(recording, method="none", covariates=fitted)
            walks[way].append(found.angle_random_walk.value)
            truth = {"bias_instability": flicker, "rate_random_walk": walk, "rate_ramp": 0.0}
            for name, (coefficient, value) in zip("BKR", truth.items(), strict=True):
                one = found.coefficients[coefficient]
                if one.status != "not observable":
                    held[way][name].append(one.low <= value <= one.high)
    return held, {way: np.array(one) for way, one in walks.items()}


def beside_flicker(seed, share):
    """The drift found of a gyro with flicker in a chamber of four soaks, and the truth of it."""
    times = np.arange(SLOW_SECONDS)
    soaks = np.interp(times, np.arange(0, 8001, 1000), [0, 0, 30, 30, 60, 60, 80, 80, 80])
    late = np.convolve(soaks, np.exp(-np.arange(4000) / 400.0) / 400.5)[:SLOW_SECONDS]
    truth = share * np.array([2e-6, 0.0, 1e-3])
    random = np.random.default_rng(seed)
    made = coloured(random, 1, SLOW_SECONDS, white=WHITE, flicker=6e-6, walk=0.0)[0, :, 0]
    values = made + truth[0] * late + truth[2] * np.gradient(late)
    recording = sagnac.Recording.from_arrays(
        x=values, kind="rate", unit="rad/s", sample_rate=1.0, temperature=late
    )
    return thermal_drift(recording.gyro("x"), late, 1.0), truth


def test_flicker_does_not_hide_a_drift():
    found = []
    for seed in range(5):
        made, truth = beside_flicker(seed, 1.0)
        seen = made.errors > 0.0
        assert seen[[0, 2]].all()
        found += list(((made.coefficients - truth)[seen] / made.errors[seen]) ** 2)
    # Taken for a walk, the flicker hid all of it four times out of five.
    # Ten deviations in standard errors: their mean square is 1 within 45 % (1 sigma).
    assert np.mean(found) == pytest.approx(1.0, abs=0.9)


def test_flicker_beside_a_temperature_is_left_as_it_is():
    assert [beside_flicker(seed, 0.0)[0] for seed in range(5)] == [None] * 5


@pytest.mark.statistics
def test_b_k_and_r_hold_beside_a_drift_as_without_and_n_is_unchanged():
    held, walks = slow_coverage(RECORDINGS)
    shares = {
        way: {name: (round(float(np.mean(one)), 3), len(one)) for name, one in each.items()}
        for way, each in held.items()
    }
    changed = np.abs(walks["fitted"] / walks["none"] - 1.0)
    print(shares, f"N changes by {100 * changed.max():.2f} % at most, {100 * changed.mean():.2f} %")
    for name, (share, count) in shares["fitted"].items():
        # Chance moves a share of 95 % by this much, one standard error of each of two.
        chance = math.sqrt(0.95 * 0.05 * (1.0 / count + 1.0 / shares["none"][name][1]))
        assert share > max(shares["none"][name][0] - 2.0 * chance, 0.95 - 3.0 * chance), name
    assert changed.mean() < 0.005
    # Left in, the drift is taken for a random walk of the rate.
    assert shares["left in"]["K"][0] < 0.85


@pytest.mark.parametrize(
    ("temperature", "seen"),
    [
        # Its slope is a constant, as the bias of the gyro is.
        (20.0 + 1e-3 * TIME, 1),
        # Of two temperatures the square is the level again.
        (np.where(TIME < SECONDS / 2.0, 20.0, 25.0), 1),
        (np.where(np.arange(COUNT) == COUNT // 2, 20.0, 21.0), 0),
    ],
)
def test_terms_that_one_another_make_are_fitted_once(temperature, seen):
    values = noise(5) + LINEAR * (temperature - temperature.mean())
    made = thermal_drift(recorded(values).gyro("x"), temperature, RATE)
    assert (0 if made is None else np.count_nonzero(made.errors)) == seen
    if made is not None:
        assert made.coefficients[0] == pytest.approx(LINEAR, abs=4.0 * made.errors[0])


@pytest.mark.parametrize(
    ("made", "covariates", "told"),
    [
        (noise(5, 2e-8) + drift(), (), True),
        (noise(5, 2e-8) + drift(), ("temperature",), False),
        (noise(5, 2e-8), (), False),
        (noise(5, 6e-7), (), False),
    ],
    ids=["left in", "taken off", "none", "a walk alone"],
)
def test_slow_noise_that_is_a_drift_with_a_temperature_left_unused_is_told(made, covariates, told):
    analysis = sagnac.analyze(recorded(made), covariates=covariates)
    notes = [note for note in analysis.notes if "mostly a drift with temperature" in note.text]
    assert [note.channel for note in notes] == (["x"] if told else [])
    if told:
        # From rad/s/sqrt(s) to deg/h/sqrt(h).
        walk = 2e-8 * math.degrees(3600.0) * 60.0
        stated = float(notes[0].text.split(" instead of ")[1].split()[0])
        assert stated == pytest.approx(walk, rel=0.5)
