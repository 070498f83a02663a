"""Line removal at its limits: Cramér-Rao bounds, resolution, and false alarms.

Run by ``make test-statistics``; prints the rows of the tables in the documentation. Noises
and bounds are made here, without the package. The signal-to-noise ratio is that of the
angle's increments, in which the angle random walk is white.
"""

import numpy as np
import pytest

from sagnac.lines.search import remove_lines

pytestmark = pytest.mark.statistics

SAMPLES = 3000
ARCSECOND = np.pi / 648_000
SIGMA = 1e-3 * ARCSECOND  # of an increment


def walk(generator):
    return SIGMA * np.cumsum(generator.standard_normal(SAMPLES))


def tone(frequency, ratio_db, generator):
    """Angle of a tone whose increments stand `ratio_db` above SIGMA, and its amplitude."""
    increment = SIGMA * np.sqrt(2.0 * 10.0 ** (ratio_db / 10.0))
    amplitude = increment / (2.0 * np.sin(np.pi * frequency))
    phase = generator.uniform(0.0, 2.0 * np.pi)
    return amplitude * np.cos(2.0 * np.pi * frequency * np.arange(SAMPLES) + phase), amplitude


@pytest.mark.parametrize("ratio_db", [-10, 0, 20])
def test_a_single_tone_is_estimated_at_the_cramer_rao_bound(ratio_db):
    trials = 1500
    ratio = 10.0 ** (ratio_db / 10.0)
    steps = SAMPLES - 1
    # Rife and Boorstyn 1974, for a real tone of amplitude b in white noise of variance s^2,
    # ratio = b^2 / (2 s^2): var(omega) = 12 / (ratio n (n^2 - 1)), var(b) / b^2 = 1 / (ratio n).
    frequency_bound = np.sqrt(12.0 / (ratio * steps * (steps**2 - 1.0))) / (2.0 * np.pi)
    amplitude_bound = np.sqrt(1.0 / (ratio * steps))
    errors, stated, others = [], [], 0
    for trial in range(trials):
        generator = np.random.default_rng([1, ratio_db % 100, trial])
        frequency = generator.uniform(0.02, 0.48)
        angle, amplitude = tone(frequency, ratio_db, generator)
        lines = remove_lines(angle + walk(generator), None, 1.0, channel="x").lines
        assert lines, f"trial {trial}: nothing found"
        line = lines[0]
        others += len(lines) - 1
        errors.append(
            [
                (line.frequency - frequency) / frequency_bound,
                (line.amplitude / amplitude - 1.0) / amplitude_bound,
            ]
        )
        stated.append(
            [
                (line.frequency - frequency) / line.frequency_error,
                (line.amplitude - amplitude) / line.amplitude_error,
            ]
        )
    variance = np.mean(np.square(errors), axis=0)
    own = np.sqrt(np.mean(np.square(stated), axis=0))
    print(
        f"\n| {ratio_db} dB | {variance[0]:.3f} | {variance[1]:.3f} | "
        f"{own[0]:.3f} | {own[1]:.3f} | {others} |"
    )
    # A variance of 1500 normal errors is itself good to 3.7 %.
    assert np.all(variance <= 1.1)
    assert own == pytest.approx([1.0, 1.0], abs=0.08)
    # One false line in a hundred records is what the default asks for.
    assert others <= 0.02 * trials


@pytest.mark.parametrize("second_db", [20, 0])
def test_two_tones_two_cycles_a_record_apart_are_both_found(second_db):
    trials = 500
    both = more = 0
    for trial in range(trials):
        generator = np.random.default_rng([2, second_db, trial])
        frequency = generator.uniform(0.02, 0.48)
        apart = 2.0 / SAMPLES * generator.choice([-1.0, 1.0])
        angle = walk(generator)
        angle += (
            tone(frequency, 20, generator)[0] + tone(frequency + apart, second_db, generator)[0]
        )
        found = np.array(
            [line.frequency for line in remove_lines(angle, None, 1.0, channel="x").lines]
        )
        near = [
            np.any(np.abs(found - truth) * SAMPLES < 0.5)
            for truth in (frequency, frequency + apart)
        ]
        both += all(near)
        more += found.size > 2
    print(f"\n| 20 and {second_db} dB, 2/T apart | {both / trials:.3f} | {more / trials:.3f} |")
    assert both >= 0.95 * trials
    assert more <= 0.03 * trials


def flicker(generator):
    frequency = np.fft.rfftfreq(8 * SAMPLES)
    frequency[0] = frequency[1]
    parts = generator.standard_normal((2, frequency.size))
    return np.fft.irfft((parts[0] + 1j * parts[1]) / np.sqrt(frequency))[:SAMPLES]


NOISES = {
    # Named by what the angle does; each makes the increments.
    "white angle": lambda g: np.diff(g.standard_normal(SAMPLES + 1)),
    "random walk": lambda g: g.standard_normal(SAMPLES),
    "random walk + quantization": lambda g: (
        g.standard_normal(SAMPLES) + 3.0 * np.diff(g.standard_normal(SAMPLES + 1))
    ),
    "flicker of rate": flicker,
    "random walk of rate": lambda g: np.cumsum(g.standard_normal(SAMPLES)),
    "random walk of rate + quantization": lambda g: (
        0.03 * np.cumsum(g.standard_normal(SAMPLES)) + 3.0 * np.diff(g.standard_normal(SAMPLES + 1))
    ),
}


@pytest.mark.parametrize("noise", NOISES)
def test_noise_alone_gives_a_line_as_seldom_as_stated(noise):
    trials = 500
    alarms = 0
    for trial in range(trials):
        generator = np.random.default_rng([3, list(NOISES).index(noise), trial])
        angle = SIGMA * np.cumsum(NOISES[noise](generator))
        alarms += bool(remove_lines(angle, None, 1.0, channel="x", false_alarm=0.05).lines)
    print(f"\n| {noise} | {alarms / trials:.3f} |")
    assert alarms <= 0.05 * trials
