"""A filter with the exported settings: is its error as large as it thinks?"""

import json
from dataclasses import dataclass

import numpy as np
import pytest

import sagnac
from sagnac.core.units import DEGREE_PER_HOUR, DEGREE_PER_ROOT_HOUR
from tests.navigation.strapdown import coloured
from tests.navigation.test_drift import KINDS

REST = RUN = 600  # s
HOURS = 4
RECORDINGS = 16  # of three gyros each
RUNS = 11  # with the settings of each gyro: 528 of a kind
TIMES = (10, 60, 600)


@dataclass(frozen=True)
class Model:
    """The discrete model of an export at 1 Hz: white noise, and slow states that add up."""

    white: float
    decay: np.ndarray
    step: np.ndarray

    @classmethod
    def of(cls, discrete):
        markov = discrete["markov"]
        return cls(
            white=discrete["white_rad_per_s"],
            decay=np.array([1.0] + [one["decay"] for one in markov]),
            step=np.array([discrete["walk_rad_per_s"]] + [one["step_rad_per_s"] for one in markov]),
        )

    def start(self):
        """(states, states): Markov rates as they are for long, and a walk of unknown level."""
        variance = np.full(self.step.size, (1e3 * (self.white + self.step.max())) ** 2)
        variance[1:] = self.step[1:] ** 2 / (1.0 - self.decay[1:] ** 2)
        return np.diag(variance)


def rested(model, rates):
    """States (runs, states) and covariance after a rest, in which every rate is the bias."""
    covariance, ones = model.start(), np.ones(model.step.size)
    states = np.zeros((rates.shape[0], model.step.size))
    for rate in rates.T:
        gain = covariance @ ones / (ones @ covariance @ ones + model.white**2)
        states += np.outer(rate - states.sum(axis=1), gain)
        covariance -= np.outer(gain, ones @ covariance)
        states *= model.decay
        covariance = covariance * np.outer(model.decay, model.decay) + np.diag(model.step**2)
    return states, covariance


def nees(model, rates, *, fix, random):
    """Mean normalized error squared of the angle without aiding at `TIMES`, and before fixes.

    `fix` is the deviation of an angle that is seen every ten seconds, rad.
    """
    slow, known = rested(model, rates[:, :REST])
    size = model.step.size
    move = np.diag(np.append(model.decay, 1.0))
    move[-1, :size] = -1.0
    grown = np.diag(np.append(model.step**2, model.white**2))
    found = {"aided": []}
    for aided in (False, True):
        states = np.column_stack([slow, np.zeros(len(slow))])
        covariance = np.zeros((size + 1, size + 1))
        covariance[:size, :size] = known
        for second, rate in enumerate(rates[:, REST:].T, 1):
            states = states @ move.T
            states[:, -1] += rate  # the truth is at rest
            covariance = move @ covariance @ move.T + grown
            ratio = np.mean(states[:, -1] ** 2) / covariance[-1, -1]
            if not aided and second in TIMES:
                found[f"{second} s"] = ratio
            if aided and second % 10 == 0:
                found["aided"].append(ratio)
                gain = covariance[:, -1] / (covariance[-1, -1] + fix**2)
                seen = fix * random.standard_normal(len(states)) - states[:, -1]
                states += np.outer(seen, gain)
                covariance -= np.outer(gain, covariance[-1])
    return {name: float(np.mean(one)) for name, one in found.items()}


def consistency(kind, *, recordings, runs):
    """By model, by time: the mean over recordings that are exported and runs with each."""
    white, flicker, walk = KINDS[kind]
    noise = {
        "white": white * DEGREE_PER_ROOT_HOUR,
        "flicker": flicker * DEGREE_PER_HOUR,
        "walk": walk * DEGREE_PER_HOUR / 60.0,
    }
    random = np.random.default_rng(17)
    found: dict[str, list[dict[str, float]]] = {"full": [], "simple": []}
    for _ in range(recordings):
        made = coloured(random, 1, HOURS * 3600, **noise)[0]
        still = sagnac.Recording.from_arrays(
            **dict(zip("xyz", made.T, strict=True)), kind="rate", unit="rad/s", sample_rate=1.0
        )
        exported = sagnac.export(sagnac.analyze(still, method="none"), tool="json", rate=1.0)
        sensors = json.loads(exported.text)["sensors"]
        rates = coloured(random, runs, REST + RUN, **noise)
        for axis, name in enumerate("xyz"):
            for which, one in found.items():
                model = Model.of(sensors[name][which]["discrete"])
                fix = noise["white"] * np.sqrt(10.0)
                one.append(nees(model, rates[:, :, axis], fix=fix, random=random))
    return {
        which: {name: float(np.mean([each[name] for each in one])) for name in one[0]}
        for which, one in found.items()
    }


def test_an_engine_that_runs_does_not_hide_how_the_bias_walks():
    """Twenty minutes in a van: a filter knew a quarter of the walk, and its NEES was above two."""
    random, rate, samples = np.random.default_rng(4), 20.0, 24_000
    white, walk = 0.15 * DEGREE_PER_ROOT_HOUR, 20.0 * DEGREE_PER_HOUR / 60.0
    gyros = {}
    for name in "xyz":
        drawn = random.standard_normal((3, samples))
        speed = 6.0 + 0.05 * np.cumsum(drawn[0]) / np.sqrt(rate)  # Hz
        engine = 1.5e-3 * np.sin(2.0 * np.pi * np.cumsum(speed) / rate)
        bias = walk * np.cumsum(drawn[1]) / np.sqrt(rate)
        gyros[name] = white * np.sqrt(rate) * drawn[2] + bias + engine
    van = sagnac.Recording.from_arrays(**gyros, kind="rate", unit="rad/s", sample_rate=rate)
    sensors = json.loads(sagnac.export(sagnac.analyze(van, method="none"), tool="json").text)
    for one in sensors["sensors"].values():
        assert one["simple"]["continuous"]["walk_rad_per_s2_per_sqrt_hz"] >= 0.9 * walk


def test_a_filter_with_the_true_noise_is_consistent_and_one_with_half_is_not():
    random = np.random.default_rng(8)
    rates = coloured(random, 400, REST + RUN, white=1e-4, flicker=0.0, walk=3e-6)[:, :, 0]
    true = Model(white=1e-4, decay=np.ones(1), step=np.full(1, 3e-6))
    half = Model(white=0.5e-4, decay=np.ones(1), step=np.full(1, 1.5e-6))
    # Of 400 squares the mean scatters by 7 %.
    for each in nees(true, rates, fix=3e-4, random=random).values():
        assert each == pytest.approx(1.0, abs=0.22)
    assert nees(half, rates, fix=3e-4, random=random)["600 s"] == pytest.approx(4.0, rel=0.22)


@pytest.mark.statistics
@pytest.mark.parametrize("kind", KINDS)
def test_the_error_of_a_filter_is_as_large_as_it_thinks(kind):
    found = consistency(kind, recordings=RECORDINGS, runs=RUNS)
    print(kind, {which: {k: round(v, 2) for k, v in one.items()} for which, one in found.items()})
    for each in found["full"].values():
        assert 0.5 <= each <= 1.1
    assert max(found["simple"].values()) <= 1.2
