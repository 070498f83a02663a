"""The joint fit against columns written out and solved outright, and against its own scatter."""

from dataclasses import replace

import numpy as np
import pytest

from sagnac.core import arrays
from sagnac.lines import components as model
from sagnac.lines import joint_fit
from sagnac.lines.components import Components, components_of, joined
from sagnac.lines.sampling import Sampling

SAMPLES = 20_000


@pytest.fixture(autouse=True)
def several_spans(monkeypatch):
    monkeypatch.setattr(arrays, "BLOCK", 8192)


def removed(angle, table, components):
    parts = []
    for part in arrays.blocks(angle.size):
        alpha = None if table is None else table[part]
        parts.append(model.removed(angle[part], alpha, components, start=part.start))
    return np.concatenate(parts)


def fit(increments, table, components, *, fresh=False):
    """One step from increments that still hold the components, as `remove_lines` makes it."""
    absent = np.full(components.size, fresh)
    without = components.select(~absent)
    left = increments - np.diff(angle_of(without, table, increments.size + 1))
    sampled = Sampling(samples=increments.size + 1, table=table, sample_rate=100.0)
    return joint_fit.fit(left, sampled, components, absent=absent)


def wandering_table(samples=SAMPLES, turns=30.0):
    rate = 1.0 + 0.2 * np.sin(np.linspace(0.0, 11.0, samples))
    angle = np.cumsum(rate)
    return 2.0 * np.pi * turns * angle / angle[-1] - 4.0


def components(samples=SAMPLES, *, orders=(), free=(), frequencies=(), pairs=()):
    cosine, sine = np.array(pairs, dtype=float).reshape(-1, 2).T
    return components_of(
        samples,
        orders=np.array(orders, dtype=float),
        free=np.array(free if len(free) else np.zeros(len(orders)), dtype=bool),
        frequencies=np.array(frequencies, dtype=float),
        phasor=cosine + 1j * sine,
    )


def angle_of(found: Components, table, samples=SAMPLES):
    """The components' sum, term by term."""
    number = np.arange(samples) - 0.5 * (samples - 1)
    phases = [order * table for order in found.orders]
    phases += [2.0 * np.pi * frequency * number for frequency in found.frequencies]
    total = np.zeros(samples)
    for phase, cosine, sine in zip(phases, found.phasor.real, found.phasor.imag, strict=True):
        total += cosine * np.cos(phase) + sine * np.sin(phase)
    return total


MIXED = components(
    orders=(1.0, 2.0, 7.3, 300.0),
    free=(False, False, True, False),
    frequencies=(0.0031, 0.0412, 0.3),
    pairs=((1, 0.3), (-0.4, 0.2), (0.5, 0.5), (0.1, -0.2), (0.7, 0.1), (0.2, -0.3), (0.3, 0.05)),
)


def test_a_step_is_that_of_least_squares_on_increments():
    table = wandering_table()
    start = MIXED
    increments = np.diff(angle_of(MIXED, table))
    increments += 0.01 * np.random.default_rng(0).standard_normal(SAMPLES - 1)
    number = np.arange(SAMPLES) - 0.5 * (SAMPLES - 1)
    columns = []
    for order in start.orders:
        columns += [np.cos(order * table), np.sin(order * table)]
    for frequency in start.frequencies:
        columns += [
            np.cos(2 * np.pi * frequency * number),
            np.sin(2 * np.pi * frequency * number),
        ]
    amplitudes = 2 * start.size
    middle = 0.5 * (table.min() + table.max())
    # The derivative in order, about the middle of the range; in frequency, about mid-record.
    cosine, sine = columns[4], columns[5]
    columns.append((table - middle) * (0.5 * cosine - 0.5 * sine))
    for j, index in enumerate((4, 5, 6)):
        cosine, sine = columns[8 + 2 * j], columns[9 + 2 * j]
        slope = start.phasor[index].imag * cosine - start.phasor[index].real * sine
        columns.append(2 * np.pi * number * slope)
    design = np.diff(np.array(columns), axis=1).T
    scale = np.linalg.norm(design, axis=0)
    solution = np.linalg.lstsq(design / scale, increments, rcond=None)[0] / scale
    covariance = np.linalg.inv((design / scale).T @ (design / scale)) / np.outer(scale, scale)
    found = fit(increments, table, start)
    expected = solution[:amplitudes].copy()
    step = solution[amplitudes]
    turn = np.array([[np.cos(step * middle), -np.sin(step * middle)]])
    turn = np.vstack([turn, [[-turn[0, 1], turn[0, 0]]]])
    expected[4:6] = turn @ expected[4:6]
    assert found.components.orders == pytest.approx(
        [*start.orders[:2], start.orders[2] + step, 300.0], rel=1e-7
    )
    assert found.components.frequencies == pytest.approx(
        start.frequencies + solution[amplitudes + 1 :], rel=1e-7
    )
    # The step is some hundredths of the amplitudes; its matrix takes the table to turn evenly
    # within blocks, which is good to a part in a million here.
    assert found.components.phasor.real == pytest.approx(expected[0::2], rel=1e-6, abs=1e-7)
    assert found.components.phasor.imag == pytest.approx(expected[1::2], rel=1e-6, abs=1e-7)
    assert found.collinear == 0
    for index in range(start.size):
        rows = [2 * index, 2 * index + 1]
        if index in (2, 4, 5, 6):
            rows.append(amplitudes + (2, 4, 5, 6).index(index))
        size = len(rows)
        block = covariance[np.ix_(rows, rows)]
        if index == 2:
            # Amplitudes about the middle of the range, carried to alpha = 0 by the order.
            moved = np.eye(3)
            moved[:2, :2] = turn
            moved[:2, 2] = middle * np.array([-expected[5], expected[4]])
            block = moved @ block @ moved.T
        scale = np.sqrt(np.outer(np.diag(block), np.diag(block)))
        assert found.covariance[index, :size, :size] / scale == pytest.approx(
            block / scale, abs=1e-3
        )
        assert np.all(found.covariance[index, size:] == 0.0)


def test_gauss_newton_converges_to_what_was_put_in():
    table = wandering_table()
    increments = np.diff(angle_of(MIXED, table))
    # A third of a cycle a record off, as a search on a grid of half a cycle may leave it.
    now = replace(
        MIXED,
        orders=MIXED.orders + np.array([0.0, 0.0, 0.3 / 30.0, 0.0]),
        frequencies=MIXED.frequencies + np.array([0.3, -0.3, 0.2]) / SAMPLES,
    )
    now = fit(increments, table, now, fresh=True).components
    for _ in range(8):
        now = fit(increments, table, now).components
    assert now.orders == pytest.approx(MIXED.orders, abs=1e-9)
    assert now.frequencies == pytest.approx(MIXED.frequencies, abs=1e-12)
    assert now.phasor == pytest.approx(MIXED.phasor, abs=1e-7)


@pytest.mark.parametrize("draws", [50, pytest.param(200, marks=pytest.mark.statistics)])
def test_covariance_is_the_scatter_of_the_estimates(draws):
    samples = 3000
    table = wandering_table(samples, turns=12.0)
    truth = components(
        samples,
        orders=(1.0, 4.4),
        free=(False, True),
        frequencies=(0.0123, 0.21),
        pairs=((1.0, 0.5), (0.5, -0.5), (0.6, 0.2), (0.1, 0.1)),
    )
    clean = np.diff(angle_of(truth, table, samples))
    sigma = 0.003
    ratios = []
    for seed in range(draws):
        noise = sigma * np.random.default_rng(seed).standard_normal(samples - 1)
        now = truth
        for _ in range(2):
            result = fit(clean + noise, table, now)
            now = result.components
        error = now.phasor - truth.phasor
        errors = np.stack([error.real, error.imag])
        places = np.concatenate([now.orders - truth.orders, now.frequencies - truth.frequencies])
        deviation = sigma * np.sqrt(np.einsum("nii->in", result.covariance))
        ratios.append(
            np.concatenate([(errors / deviation[:2]).ravel(), places[1:] / deviation[2, 1:]])
        )
    ratios = np.array(ratios)
    # Four errors of a standard deviation and of a mean; two of eleven beside each other.
    assert np.std(ratios, axis=0) == pytest.approx(np.ones(11), abs=4.0 / np.sqrt(2.0 * draws))
    assert np.mean(ratios, axis=0) == pytest.approx(np.zeros(11), abs=4.0 / np.sqrt(draws))
    assert np.sqrt(np.mean(ratios**2)) == pytest.approx(1.0, abs=4.0 / np.sqrt(22.0 * draws))


def test_removed_takes_the_components_and_nothing_else():
    table = wandering_table()
    noise = np.cumsum(np.random.default_rng(1).standard_normal(SAMPLES))
    rest = removed(noise + angle_of(MIXED, table), table, MIXED)
    # Harmonics by a non-uniform transform, good to 1e-9 of their sum.
    assert rest == pytest.approx(noise, abs=2e-9)


@pytest.mark.parametrize("samples", [2, 3, 8192, 8193, 8194, 16_385, 16_386])
def test_removed_is_exact_where_blocks_meet(samples):
    tone = components(samples, frequencies=(0.0123,), pairs=((1.0, 0.5),))
    assert removed(angle_of(tone, None, samples), None, tone) == pytest.approx(
        np.zeros(samples), abs=1e-11
    )


def test_nothing_to_remove_is_a_copy():
    angle = np.arange(5.0)
    rest = model.removed(angle, None, components_of(5))
    assert np.array_equal(rest, angle)
    assert rest is not angle


def test_angle_and_time_that_coincide_are_fitted_as_their_sum():
    # At a constant rate order 3 and its frequency are one.
    turns = 20.0
    number = np.arange(SAMPLES)
    table = 2.0 * np.pi * turns * number / SAMPLES
    both = components(
        orders=(3.0, 5.0), frequencies=(3.0 * turns / SAMPLES,), pairs=((1, 0), (0, 1), (1, 0))
    )
    truth = components(orders=(3.0, 5.0), pairs=((0.8, 0.3), (0.1, 0.4)))
    angle = angle_of(truth, table)
    angle += 1e-3 * np.random.default_rng(2).standard_normal(SAMPLES)
    found = fit(np.diff(angle), table, both, fresh=True)
    assert found.collinear == 2
    assert np.abs(found.components.phasor.real).max() < 1.0
    rest = removed(angle, table, found.components)
    assert np.std(rest) == pytest.approx(1e-3, rel=0.05)


def test_joined_sorts_the_orders_and_select_takes_both_apart():
    first = components(orders=(2.0, 9.0), frequencies=(0.1,), pairs=((1, 2), (3, 4), (5, 6)))
    second = components(
        orders=(1.0, 4.5), free=(False, True), frequencies=(0.02,), pairs=((7, 8), (9, 1), (2, 3))
    )
    both = joined(first, second)
    assert both.orders.tolist() == [1.0, 2.0, 4.5, 9.0]
    assert both.free.tolist() == [False, False, True, False]
    assert both.frequencies.tolist() == [0.1, 0.02]
    assert both.phasor.tolist() == [7 + 8j, 1 + 2j, 9 + 1j, 3 + 4j, 5 + 6j, 2 + 3j]
    assert both.size == 6
    assert both.amplitude == pytest.approx(np.hypot(both.phasor.real, both.phasor.imag))
    kept = both.select(np.array([False, True, True, False, False, True]))
    assert kept.orders.tolist() == [2.0, 4.5]
    assert kept.free.tolist() == [False, True]
    assert kept.frequencies.tolist() == [0.02]
    assert kept.phasor.real.tolist() == [1, 9, 2]
