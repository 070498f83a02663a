"""Encoders as they are, by a second simulator: jitter, delay, clock, steps, lost readings."""

from collections.abc import Mapping

import numpy as np
import pytest
from scipy import stats

from sagnac.analysis.pipeline import analyze
from sagnac.analysis.settings import Settings
from sagnac.recording.model import Recording
from tests import second_rig

SECONDS, RATE = 900.0, 200.0
WALK = 2.5e-5  # deg/sqrt(h), of every gyro
SHARES = (0.5784, 0.5773, 0.5764)
LINES = 10  # put in

FAULTS: Mapping[str, Mapping[str, object]] = {
    "delay changes by 0.2 ms": {"latency": 2e-3, "latency_drift": 2e-4, "jitter": 20e-6},
    "delay changes by 1 ms": {"latency": 2e-3, "latency_drift": 1e-3, "jitter": 20e-6},
    "delay changes by 5 ms": {"latency": 2e-3, "latency_drift": 5e-3, "jitter": 20e-6},
    "clock": {"clock": 20e-6, "jitter": 20e-6},
    "delay walks by 20 us": {"latency_walk": 20e-6, "jitter": 20e-6},
    "delay walks by 100 us": {"latency_walk": 100e-6, "jitter": 20e-6},
    "10 readings a second": {"held_hz": 10.0},
    "20 readings a second": {"held_hz": 20.0},
    "100 readings a second": {"held_hz": 100.0},
    "steps in beat with the sampling": {"step": 36.0, "hunting": 5e-4, "wander": 1e-5},
    "steps": {"step": 36.0, "jitter": 20e-6},
    "lost readings": {"lost": 1e-3, "jitter": 20e-6},
    "swings": {"motion": "swinging", "swing": 400.0, "latency": 1e-3, "jitter": 20e-6},
}


def answer(gyros=("x", "z"), **settings):
    """The answer over the truth, and how many lines were found."""
    bench = second_rig.Bench(
        seconds=SECONDS, sample_rate=RATE, walks=(WALK,) * 3, shares=SHARES, **settings
    )
    made = second_rig.simulate(bench)
    recording = Recording.from_arrays(
        **made.angles,
        kind="angle",
        unit="rad",
        sample_rate=RATE,
        table=made.table,
        table_unit="rad",
    )
    analysis = analyze(recording, Settings(gyros=gyros))
    walk = analysis.angle_random_walk.to("deg/sqrt(h)")
    assert analysis.angle_random_walk.status == "estimated", (settings, analysis.source)
    return (walk.low / WALK, walk.high / WALK), len(analysis.lines)


def bound(seconds=SECONDS, rate=RATE, walk=WALK, readout=0.001):
    """Half interval of 95 %, as a part of N, that no estimate without bias beats.

    Of all ordinates of the spectrum N^2 + Q^2 (2 r sin(pi f/r))^2 / r (Whittle), Q being the
    readout's step by the root of 12, and both unknown: walk in deg/sqrt(h), readout in arcsec.
    """
    frequency = np.arange(1, round(0.5 * seconds * rate)) / seconds
    white = (2.0 * rate * np.sin(np.pi * frequency / rate)) ** 2 / rate
    square = (60.0 * walk) ** 2  # arcsec^2/s
    total = square + readout**2 / 12.0 * white
    slopes = np.stack([np.ones_like(white), white]) / total
    return 1.96 * np.sqrt(np.linalg.inv(slopes @ slopes.T)[0, 0]) / (2.0 * square)


def holds(interval):
    return interval[0] <= 1.0 <= interval[1]


@pytest.mark.statistics
def test_jitter_of_the_latch_costs_a_pair_nothing():
    """Every recording is estimated, 93 % hold, no line comes of jitter, no interval is wider."""
    widths, held, lines, runs = {}, 0, [], 0
    for jitter in (0.0, 5e-6, 20e-6, 100e-6, 500e-6):
        own = []
        for seed in range(1, 11):
            for rate in (10.0, 20.0, 40.0, 80.0):
                interval, found = answer(jitter=jitter, rate=rate, seed=seed)
                own.append(0.5 * (interval[1] - interval[0]))
                held += holds(interval)
                lines.append(found)
                runs += 1
        widths[jitter] = float(np.mean(own))
    text = ", ".join(
        f"{1e6 * jitter:g} us {100.0 * width:.2f} %" for jitter, width in widths.items()
    )
    print(
        f"{held} of {runs} hold; mean half interval {text}; {np.mean(lines):.2f} lines of {LINES}; "
        f"{np.mean(list(widths.values())) / bound():.2f} times the bound of {100.0 * bound():.2f} %"
    )
    # The same ten draws of noise at each jitter: forty of the recordings are independent.
    assert held / runs >= stats.binom.ppf(0.01, 40, 0.93) / 40
    assert max(widths.values()) < 1.1 * widths[0.0]
    assert np.mean(lines) < LINES + 0.1
    # Robust levels, which no line moves, average the lower half of a bin's ordinates.
    assert max(widths.values()) < 1.65 * bound()


@pytest.mark.statistics
def test_what_else_an_encoder_does_costs_a_pair_nothing():
    held, runs = 0, 0
    for name, fault in FAULTS.items():
        own = [
            holds(answer(**{"rate": rate, "seed": seed, **fault})[0])
            for seed in range(11, 16)
            for rate in (20.0, 40.0)
        ]
        print(f"{name}: {sum(own)} of {len(own)} hold")
        held, runs = held + sum(own), runs + len(own)
    assert held / runs >= stats.binom.ppf(0.01, 10, 0.93) / 10


@pytest.mark.parametrize("jitter", [20e-6, 500e-6])
def test_a_pair_is_estimated_whatever_its_latch_does(jitter):
    interval, found = answer(jitter=jitter, rate=20.0, seed=31)
    assert holds(interval)
    assert found == LINES
