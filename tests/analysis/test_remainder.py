"""Noise of gyros on a turning table: what shows when motion is out, and in one gyro alone."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sagnac.analysis.averaged import Headline
from sagnac.analysis.evidence import Points
from sagnac.analysis.measurement import Remainder
from sagnac.analysis.pipeline import analyze
from sagnac.analysis.settings import Settings
from sagnac.analysis.triad import each_alone
from sagnac.lines.search import remove_lines
from sagnac.noise.estimates import Fit, FitBand, unobserved
from sagnac.noise.three_cornered_hat import Separation
from sagnac.quality.readout import Readout
from sagnac.recording.model import Recording

RATE, SAMPLES = 100.0, 18_000
SIGMA = 1.8  # deg/h: N is 0.003 deg/sqrt(h)
TABLE = 20.0  # deg/s


def turning(spoil, seed=1):
    """A pair of which the noise of x is spoilt."""
    random = np.random.default_rng(seed)
    rate = TABLE + 0.01 * np.sin(2.0 * np.pi * np.arange(SAMPLES) / RATE * TABLE / 30.0)
    noise = {name: SIGMA * random.standard_normal(SAMPLES) for name in ("x", "z")}
    noise["x"] = spoil(noise["x"], random)
    shares = {"x": 0.577, "z": 0.575}
    return Recording.from_arrays(
        **{name: 3600.0 * share * rate + noise[name] for name, share in shares.items()},
        kind="rate",
        unit="deg/h",
        sample_rate=RATE,
        table=np.cumsum(rate) / RATE,
        table_unit="deg",
    )


def spikes(noise, random):
    return np.where(random.random(SAMPLES) < 0.2, noise + 10.0 * SIGMA, noise)


def growth(noise, random):
    return noise * np.linspace(1.0, 1.5, SAMPLES)


def soft_limit(noise, random):
    return SIGMA * np.tanh(noise / SIGMA)


@pytest.mark.parametrize(
    ("spoil", "name", "channel"),
    [(spikes, "spikes", "x-z"), (growth, "unsteady", "x-z"), (soft_limit, "short-tails", "x")],
)
def test_noise_that_is_no_even_noise_is_named(spoil, name, channel):
    found = {(one.name, one.channel) for one in analyze(turning(spoil)).findings}
    assert (name, channel) in found


@pytest.mark.parametrize(
    "seed", [1, *(pytest.param(seed, marks=pytest.mark.statistics) for seed in (2, 3))]
)
def test_of_sound_noise_nothing_is_said(seed):
    sound = analyze(turning(lambda noise, random: noise, seed))
    assert [one for one in sound.findings if one.level != "remark"] == []


def test_vibration_that_leaves_no_band_to_both_pairs_leaves_no_gyro_alone():
    rate, random = 100.0, np.random.default_rng(4)
    angles = {name: np.cumsum(random.standard_normal(6000)) for name in ("x-z", "x-y")}
    left = [remove_lines(angle, None, rate, channel=pair) for pair, angle in angles.items()]
    bands = [((0.0, 30.0),), ((25.0, 60.0),)]
    remainders = [
        Remainder(removal=replace(removal, masked=masked), rate=rate)
        for removal, masked in zip(left, bands, strict=True)
    ]
    fine = Points(angle=left[0].residual, rate=rate)
    whole = FitBand(low=0.0, high=50.0, interval=0.01, masked=())
    fit = Fit(method="likelihood", coefficients={}, band=whole)
    nothing = Headline(estimate=unobserved("angle_random_walk", 0.95), source="")

    def alone(pairs: list[Remainder]) -> Separation:
        known = {"settings": Settings(gyros=("x", "y", "z")), "readout": Readout(), "fine": fine}
        evidence = SimpleNamespace(
            **known, fits={"likelihood": fit}, left=pairs[0], remainders=pairs
        )
        return each_alone(evidence, nothing)

    hat = alone(remainders)
    assert not hat.angle_random_walk
    (note,) = hat.notes
    assert note.level == "warning"
    assert "of each gyro alone" in note.text
    # The same pairs without vibration have one.
    sound = [Remainder(removal=removal, rate=rate) for removal in left]
    hat = alone(sound)
    assert set(hat.angle_random_walk) == {"x", "y", "z"}
