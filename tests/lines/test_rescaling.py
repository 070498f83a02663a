"""Tones that follow the table are told from those that do not."""

import numpy as np
import pytest

from sagnac.lines.components import components_of, mixed_down
from sagnac.lines.detection import spectrum
from sagnac.lines.passes import rescaled_components, timed_components
from sagnac.lines.sampling import MIX_BLOCK, Sampling

SAMPLES = 64 * MIX_BLOCK + 1
RATE = 2.0 * np.pi / 400.0
NOISE = 1e-3
FREQUENCY = 100.0
NUMBER = np.arange(float(SAMPLES))
# Turns at a mean rate, and strays from it by a swing of 1.5 rad.
STEADY = RATE * NUMBER
WANDERING = STEADY + 1.5 * np.sin(2.0 * np.pi * 5.0 * NUMBER / SAMPLES)


def sampled(table):
    return Sampling(samples=table.size, table=table, sample_rate=FREQUENCY)


def wandered(table):
    return sampled(table).wander


def test_wander_is_the_mean_angle_of_each_block_less_a_straight_line():
    found = wandered(WANDERING)
    block = MIX_BLOCK
    angle = np.array([WANDERING[n : n + block].mean() for n in range(0, SAMPLES - 1, block)])
    middle = np.array([n + 0.5 * (block - 1) for n in range(0, SAMPLES - 1, block)])
    slope, level = np.polyfit(middle, angle, 1)
    assert found.rate == pytest.approx(slope)
    assert found.middles == pytest.approx(middle - 0.5 * (SAMPLES - 1))
    assert found.phase == pytest.approx(angle - slope * middle - level, abs=1e-9)


def test_a_table_that_comes_back_has_no_rate_and_a_short_record_tells_none():
    back_and_forth = 30.0 * np.sin(2.0 * np.pi * NUMBER / SAMPLES)
    assert wandered(back_and_forth) is None
    assert wandered(WANDERING[: 2 * MIX_BLOCK]) is None


def tone(order, amplitude=1.0):
    """A component at the frequency that an order has at the mean rate."""
    return components_of(
        SAMPLES,
        orders=np.array([2.0]),
        frequencies=np.array([order * wandered(WANDERING).rate / (2.0 * np.pi)]),
        phasor=np.array([1.0, amplitude], dtype=complex),
    )


def angle_of_tone(found):
    phase = 2.0 * np.pi * found.frequencies[0] * (NUMBER - found.center)
    return found.phasor[1].real * np.cos(phase)


def rescaled(found, signal, table=WANDERING):
    """What becomes of components fitted to a signal in noise, which are taken out of it."""
    noise = NOISE * np.random.default_rng(1).standard_normal(SAMPLES - 1)
    steps = np.diff(signal - angle_of_tone(found)) + noise
    return rescaled_components(found, steps, sampled(table), np.full(2, NOISE**2))


def in_phase(order, found):
    """An order of the table whose mean phasor is that of the component."""
    return found.phasor[1].real * np.cos(order * (WANDERING - WANDERING.mean()))


@pytest.mark.parametrize(("order", "whole"), [(5.0, True), (5.003, True), (5.4, False)])
def test_what_follows_the_table_is_moved_to_its_order(order, whole):
    found = tone(order)
    moved = rescaled(found, in_phase(order, found))
    assert moved.frequencies.size == 0
    assert moved.orders == pytest.approx([2.0, 5.0 if whole else order])
    assert moved.free.tolist() == [False, not whole]
    assert moved.phasor.tolist() == [1.0, 1.0]


def test_what_keeps_its_frequency_stays_in_time():
    found = tone(5.0)
    assert rescaled(found, angle_of_tone(found)) is None


@pytest.mark.parametrize("phase", [0.0, 1.6, 3.1, 4.7])
def test_a_weak_tone_beside_a_strong_one_is_no_order(phase):
    """Where the wander of the table puts a sideband of the strong one: 50.03 beside 50 Hz was."""
    table = STEADY + 0.05 * np.sin(2.0 * np.pi * 12.0 * NUMBER / SAMPLES)
    strong = 15.0 * wandered(table).rate / (2.0 * np.pi)
    found = components_of(
        SAMPLES,
        frequencies=np.array([strong, strong + 12.0 / SAMPLES]),
        phasor=np.array([1.0, 0.1 * np.exp(1j * phase)]),
    )
    noise = NOISE * np.random.default_rng(1).standard_normal(SAMPLES - 1)
    assert rescaled_components(found, noise, sampled(table), np.full(2, NOISE**2)) is None


def test_at_a_steady_rate_a_tone_and_an_order_are_one():
    found = tone(5.0)
    assert rescaled(found, np.cos(5.0 * (STEADY - STEADY.mean())), STEADY) is None


def test_a_tone_too_weak_to_tell_stays():
    found = tone(5.0, amplitude=1e-4)
    assert rescaled(found, in_phase(5.0, found)) is None


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize(
    ("hunt", "line", "moves"),
    [
        (3e-4, "order", True),
        (3e-4, "tone", False),
        (3e-4, "wanders by itself", False),
        (3e-6, "order", False),
    ],
)
def test_an_order_of_a_servo_that_hunts_faster_than_the_means_is_moved(
    hunt, line, moves, backwards
):
    random = np.random.default_rng(3)
    hunting, other = (hunt * random.standard_normal((64, MIX_BLOCK)) for _ in range(2))
    # Nothing of it is left in any mean.
    hunting -= hunting.mean(axis=1, keepdims=True)
    table = STEADY + np.append(hunting, 0.0)
    table = 7.0 - table if backwards else table
    center = 0.5 * (SAMPLES - 1)
    rate = wandered(table).rate
    frequency = 5.4 * abs(rate) / (2.0 * np.pi)
    steady = 2.0 * np.pi * frequency * (NUMBER - center) + 0.7
    strays = table - rate * (NUMBER - center) - wandered(table).origin
    phase = {
        "order": steady + np.sign(rate) * 5.4 * strays,
        "tone": steady,
        "wanders by itself": steady + 5.4 * np.append(other, 0.0),
    }[line]
    noise = NOISE * np.random.default_rng(1).standard_normal(SAMPLES - 1)
    steps = np.diff(np.cos(phase) - np.cos(steady)) + noise
    phasor = np.array([np.exp(-0.7j)])
    found = components_of(SAMPLES, frequencies=np.array([frequency]), phasor=phasor)
    moved = rescaled_components(found, steps, sampled(table), np.full(1, NOISE**2))
    assert (moved is not None) == moves
    if moved is not None:
        assert moved.orders == pytest.approx([5.4])
        assert moved.frequencies.size == 0


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("bins", [None, -0.7, 0.0, 0.4])
def test_an_order_that_keeps_time_is_moved_to_its_frequency(bins, backwards):
    """Bins from the order's mean rate; None for an order that is one. The table strays by 0.15."""
    table = STEADY + 0.1 * (WANDERING - STEADY)
    table = 7.0 - table if backwards else table
    center, frequency = 0.5 * (SAMPLES - 1), 5.0 * abs(wandered(table).rate) / (2.0 * np.pi)
    frequency += 0.0 if bins is None else bins / (SAMPLES - 1)
    phase = 5.0 * table if bins is None else 2.0 * np.pi * frequency * (NUMBER - center)
    signal = np.cos(phase + 0.6)
    # The fit of an order to the steps, as a search has it.
    columns = np.diff([np.cos(5.0 * table), np.sin(5.0 * table)], axis=1).T
    (cosine, sine), *_ = np.linalg.lstsq(columns, np.diff(signal), rcond=None)
    noise = NOISE * np.random.default_rng(1).standard_normal(SAMPLES - 1)
    steps = np.diff(signal) - columns @ [cosine, sine] + noise
    found = components_of(SAMPLES, orders=np.array([5.0]), phasor=np.array([complex(cosine, sine)]))
    levels = np.full(1, NOISE**2)
    moved = timed_components(found, steps, sampled(table), levels, spectrum(steps))
    if bins is None:
        assert moved is None
        return
    assert moved.orders.size == 0
    assert moved.frequencies == pytest.approx([frequency], abs=0.1 / SAMPLES)
    # A tenth of a bin turns an amplitude by no more than that.
    assert moved.phasor == pytest.approx([np.exp(-0.6j)], abs=0.1)


def test_mixed_down_is_its_definition():
    values = np.random.default_rng(8).standard_normal(4 * MIX_BLOCK + 7)
    turning = values * np.exp(-2j * np.pi * 0.1234567 * (np.arange(values.size) - 31.5))
    means = turning[: 4 * MIX_BLOCK].reshape(4, MIX_BLOCK).mean(axis=1)
    assert mixed_down(values, np.array([0.1234567]), 31.5)[:, 0] == pytest.approx(
        means, rel=1e-12, abs=1e-13
    )


@pytest.mark.parametrize(("swing", "step", "seeds"), [(1.0, 0.4, 20), (0.02, 0.05, 60)])
def test_peaks_of_a_line_that_wanders_by_itself_stay_in_time(swing, step, seeds):
    """Chance makes half of them follow the table better than a tone, by far more than the noise.

    On a table that turns nearly evenly, an order would gain next to nothing by it.
    """
    table = STEADY + swing * (WANDERING - STEADY)
    followed = 0
    for seed in range(seeds):
        random = np.random.default_rng(seed)
        walk = np.repeat(np.cumsum(step * random.standard_normal(64)), MIX_BLOCK)
        signal = np.cos(5.4 * STEADY + np.append(walk, walk[-1]))
        # The twelve highest ordinates of its steps, as a search would find them.
        steps = np.diff(signal)
        ordinates = np.fft.rfft(steps) / steps.size
        places = np.argsort(-np.abs(ordinates))[:12]
        center = 0.5 * (SAMPLES - 1)
        frequencies = places / steps.size
        # An increment of a tone is 2j sin(pi f) times its phasor in the middle of the step.
        sums = ordinates[places] * np.exp(2j * np.pi * frequencies * (center - 0.5))
        phasors = 2.0 * sums / (2j * np.sin(np.pi * frequencies))
        found = components_of(SAMPLES, frequencies=frequencies, phasor=phasors.conj())
        waves = np.exp(2j * np.pi * frequencies[:, np.newaxis] * (NUMBER - center))
        left = steps - np.diff((phasors @ waves).real)
        assert np.mean(left**2) < 0.5 * np.mean(steps**2)
        noise = NOISE * random.standard_normal(steps.size)
        levels = np.full(12, NOISE**2)
        moved = rescaled_components(found, left + noise, sampled(table), levels)
        followed += 0 if moved is None else moved.orders.size
    assert followed == 0
