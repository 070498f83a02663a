"""The search over an even grid against the one that multiplies everything out."""

import numpy as np
import pytest

from sagnac.lines.grid_search import grid_fit, grid_search, grid_sinusoids
from sagnac.lines.orthogonal_search import fast_orthogonal_search


def signal(samples, seed=1):
    """Lines on and off the grid and near half a cycle a sample, on a walk and a ramp."""
    number = np.arange(samples)
    turns = 2.0 * np.pi * number / samples
    walk = np.cumsum(np.random.default_rng(seed).standard_normal(samples))
    return (
        walk
        + 30.0 * np.cos(100.37 * turns + 0.3)
        + 5.0 * np.sin(260.1 * turns)
        + 4.0 * np.cos((0.5 * samples - 0.8) * turns)
        + 0.03 * number
    )


@pytest.mark.parametrize("samples", [1000, 1001])
@pytest.mark.parametrize("cells", [1, 2, 4])
def test_it_chooses_as_the_plain_search_does(samples, cells):
    values = signal(samples)
    number = np.arange(float(samples))
    found = grid_search(values, cells=cells, most_terms=25)
    plain = fast_orthogonal_search(
        number,
        values,
        spacing=found.spacing,
        candidates=found.candidates,
        most_terms=25,
    )
    np.testing.assert_array_equal(found.chosen, plain.chosen)
    np.testing.assert_allclose(found.mean_square, plain.mean_square, rtol=2e-4)
    # The plain search holds products to a millionth: what is left of close pairs shows that.
    scale = np.abs(values).max()
    np.testing.assert_allclose(found.series(number), plain.series(number), atol=1e-4 * scale)


def test_coefficients_are_those_of_least_squares():
    values = signal(1000)
    number = np.arange(1000.0)
    found = grid_search(values, cells=4, most_terms=20)
    waves = found.frequencies * number[:, np.newaxis]
    columns = np.column_stack([np.ones(1000), number, np.cos(waves), np.sin(waves)])
    solution = np.linalg.lstsq(columns, values, rcond=None)[0]
    np.testing.assert_allclose(found.series(number), columns @ solution, atol=1e-6)
    left = values - columns @ solution
    assert found.mean_square[-1] == pytest.approx(np.mean(left**2), rel=1e-6)


def test_sinusoids_are_the_series_without_its_line():
    values = signal(501)
    number = np.arange(501.0)
    found = grid_search(values, cells=3, most_terms=8)
    expected = found.series(number) - found.constant - found.slope * number
    np.testing.assert_allclose(grid_sinusoids(found, 501), expected, atol=1e-9)


def test_a_fit_of_chosen_places_is_that_of_the_search():
    values = signal(1000)
    found = grid_search(values, cells=4, most_terms=12)
    fitted = grid_fit(values, found.chosen, cells=4)
    np.testing.assert_array_equal(fitted.chosen, found.chosen)
    np.testing.assert_allclose(fitted.coefficients, found.coefficients, atol=1e-9)
    # A place given twice is nothing new.
    again = grid_fit(values, np.append(found.chosen, found.chosen[:3]), cells=4)
    np.testing.assert_array_equal(again.chosen, found.chosen)


def test_white_noise_stops_a_search_that_counts_its_candidates():
    noise = np.random.default_rng(4).standard_normal(4000)
    assert grid_search(noise, cells=4, stop="false-alarm", false_alarm=1e-3).chosen.size == 0
    line = noise + 0.5 * np.cos(2.0 * np.pi * 0.1234 * np.arange(4000))
    found = grid_search(line, cells=4, stop="false-alarm", false_alarm=1e-3)
    assert found.frequencies[0] / (2.0 * np.pi) == pytest.approx(0.1234, abs=1.0 / 8.0 / 4000)


def test_a_line_without_noise_is_found_and_the_search_ends():
    line = np.cos(2.0 * np.pi * 100.25 * np.arange(1000) / 1000)
    found = grid_search(line, cells=4, stop="none", most_terms=30)
    assert found.chosen[0] == 400
    assert found.mean_square[-1] < 1e-12


def test_false_alarms_of_a_walk_are_few_above_the_lowest_frequency():
    """Walks with readout noise and no line; neighbours on the finer grid add to the 5 %."""
    alarms = 0
    for seed in range(200):
        random = np.random.default_rng(seed)
        values = np.cumsum(random.standard_normal(3000)) + 3.0 * random.standard_normal(3000)
        found = grid_search(values, cells=4, lowest=76, stop="false-alarm", most_terms=3)
        alarms += found.chosen.size > 0
    assert 2 <= alarms <= 40


def test_the_lowest_candidate_is_the_lowest_chosen():
    found = grid_search(signal(1000), cells=4, lowest=300, stop="none", most_terms=30)
    assert found.chosen.min() + 1 >= 300
    assert 401 in found.chosen + 1  # the line at 100.37 cycles
