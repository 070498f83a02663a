"""Fast orthogonal search against greedy least squares that solves every system outright."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sagnac.lines.orthogonal_search import fast_orthogonal_search
from tests.naive_search import greedy_pairs, textbook_search


def wandering_phase(samples, turns, generator):
    """A table angle whose rate varies by some tens of percent."""
    rate = 1.0 + 0.3 * np.sin(np.linspace(0.0, 9.0, samples)) + 0.1 * generator.random(samples)
    phase = np.cumsum(rate)
    return 2.0 * np.pi * turns * phase / phase[-1] + generator.uniform(-5.0, 5.0)


def series_with_noise(phase, generator, *, noise):
    signal = 0.3 + 0.02 * phase + noise * generator.standard_normal(phase.size)
    for order, amplitude in ((2, 1.0), (5, 0.6), (6, 0.5), (11, 0.2)):
        signal += amplitude * np.cos(order * phase + generator.uniform(0.0, 6.0))
    return signal


def assert_same(found, naive, *, spacing, rel=1e-6):
    chosen, left, solution = naive
    assert found.frequencies == pytest.approx(spacing * np.array(chosen, dtype=float))
    assert found.mean_square == pytest.approx(left, rel=rel)
    assert (found.constant, found.slope) == pytest.approx(tuple(solution[:2]), rel=rel, abs=1e-8)
    assert found.cosine == pytest.approx(solution[2::2], rel=rel, abs=1e-8)
    assert found.sine == pytest.approx(solution[3::2], rel=rel, abs=1e-8)


STOPS = {
    "korenberg": lambda samples, _: 8.0 / (samples + 1),
    "false-alarm": lambda samples, candidates: 2.0 * np.log(candidates / 0.05) / samples,
    "none": lambda *_: 0.0,
}


@pytest.mark.parametrize("stop", STOPS)
@pytest.mark.parametrize("seed", range(3))
def test_order_mean_squares_and_coefficients_are_those_of_greedy_least_squares(stop, seed):
    generator = np.random.default_rng(seed)
    phase = wandering_phase(400, 6.3, generator)
    signal = series_with_noise(phase, generator, noise=0.3)
    found = fast_orthogonal_search(
        phase, signal, spacing=1.0, candidates=20, stop=stop, most_terms=8
    )
    naive = greedy_pairs(
        phase,
        signal,
        spacing=1.0,
        candidates=20,
        bound=STOPS[stop](400, 20),
        most_terms=8,
    )
    assert len(naive[0]) >= 4
    assert_same(found, naive, spacing=1.0)
    assert found.stop == stop


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    samples=st.integers(30, 80),
    spacing=st.floats(0.3, 2.0),
    candidates=st.integers(1, 8),
    terms=st.integers(0, 4),
)
def test_any_small_search_is_greedy_least_squares(seed, samples, spacing, candidates, terms):
    generator = np.random.default_rng(seed)
    phase = np.sort(generator.uniform(-20.0, 20.0, samples))
    signal = generator.standard_normal(samples)
    found = fast_orthogonal_search(
        phase, signal, spacing=spacing, candidates=candidates, stop="none", most_terms=terms
    )
    naive = greedy_pairs(
        phase, signal, spacing=spacing, candidates=candidates, bound=0.0, most_terms=terms
    )
    assert_same(found, naive, spacing=spacing, rel=1e-5)


def test_time_scale_of_a_uniform_record():
    # The candidates are multiples of one cycle a record. Their pairs are orthogonal to each other,
    # but not to the straight line.
    generator = np.random.default_rng(1)
    time = np.arange(300) / 10.0
    signal = np.cumsum(generator.standard_normal(300))
    spacing = 2.0 * np.pi / 30.0
    found = fast_orthogonal_search(
        time, signal, spacing=spacing, candidates=149, stop="none", most_terms=6
    )
    naive = greedy_pairs(time, signal, spacing=spacing, candidates=149, bound=0.0, most_terms=6)
    assert_same(found, naive, spacing=spacing)


def test_a_whole_record_in_time_is_exact():
    # The sums are a Fourier transform there, not a non-uniform one that is good to 1e-9.
    time = np.arange(3000) / 10.0
    signal = np.cumsum(np.random.default_rng(2).standard_normal(3000))
    found = fast_orthogonal_search(
        time, signal, spacing=2.0 * np.pi / 300.0, candidates=1499, most_terms=12
    )
    assert found.chosen.size == 12
    assert np.mean((signal - found.series(time)) ** 2) == pytest.approx(
        found.mean_square[-1], rel=1e-11
    )


def test_series_is_the_fit():
    generator = np.random.default_rng(2)
    phase = wandering_phase(500, 5.0, generator)
    signal = series_with_noise(phase, generator, noise=0.1)
    found = fast_orthogonal_search(phase, signal, spacing=1.0, candidates=16)
    assert np.mean((signal - found.series(phase)) ** 2) == pytest.approx(
        found.mean_square[-1], rel=1e-7
    )


def test_a_noiseless_series_is_found_whole():
    generator = np.random.default_rng(3)
    phase = wandering_phase(800, 12.0, generator)
    signal = series_with_noise(phase, generator, noise=0.0)
    found = fast_orthogonal_search(phase, signal, spacing=1.0, candidates=16)
    assert sorted(found.frequencies) == [2.0, 5.0, 6.0, 11.0]
    # The Fourier sums are good to 1e-9 of a sum, and the mean square left is a difference of them.
    assert found.mean_square[-1] < 1e-9 * found.mean_square[0]


def test_korenbergs_stop_accepts_noise_and_the_set_stop_does_not():
    # Each pair passes the published bound with probability exp(-4): 18 of 1000 at the first
    # step, and more as the mean square falls; the bound for the whole set passes 5 % of records.
    taken = {"korenberg": 0, "false-alarm": 0}
    for seed in range(10):
        signal = np.random.default_rng(seed).standard_normal(4000)
        time = np.arange(4000.0)
        for stop in taken:
            found = fast_orthogonal_search(
                time,
                signal,
                spacing=2.0 * np.pi / 4000,
                candidates=1000,
                stop=stop,
                most_terms=30,
            )
            taken[stop] += found.frequencies.size
    assert taken["korenberg"] / 10 > 10
    assert taken["false-alarm"] <= 3  # binomial(10, 0.05): four or more in 1 of 1000 runs


def test_a_pair_one_of_whose_terms_is_nothing_counts_by_the_other():
    phase = 2.0 * np.pi * np.arange(1000) / 100.0
    noise = 1e-3 * np.random.default_rng(5).standard_normal(1000)
    cosines = np.cos(np.outer(phase, np.arange(1, 51)))
    for signal, candidates, spacing in (
        (np.cos(50.0 * phase), 50, 1.0),
        (cosines[:, 49], np.stack([cosines, np.zeros_like(cosines)], axis=2), None),
        (cosines[:, 49], np.stack([np.zeros_like(cosines), cosines], axis=2), None),
    ):
        found = fast_orthogonal_search(
            phase, signal + noise, candidates=candidates, spacing=spacing, most_terms=1
        )
        assert found.chosen.tolist() == [49]
        assert np.abs(found.coefficients).max() == pytest.approx(1.0, abs=1e-3)
        assert np.abs(found.coefficients).min() == 0.0
        assert found.mean_square[-1] < 2e-6


def test_the_same_frequency_twice_is_refused():
    # At a phase sampled 16 times a turn, order 15 is order 1 over again, 17 too, and 16 is 1.
    phase = 2.0 * np.pi * np.arange(160) / 16.0
    signal = np.cos(phase) + 0.5 * np.sin(3.0 * phase)
    signal += 1e-3 * np.random.default_rng(4).standard_normal(160)
    found = fast_orthogonal_search(
        phase, signal, spacing=1.0, candidates=40, stop="none", most_terms=40
    )
    folded = {int(min(order % 16, -order % 16)) for order in found.frequencies}
    # No order twice, none that folds to the constant, and 8, whose sine is zero, by its cosine.
    assert len(folded) == found.frequencies.size
    assert folded == {1, 2, 3, 4, 5, 6, 7, 8}
    assert not found.sine[found.frequencies % 16 == 8].any()
    assert np.all(np.abs(np.concatenate([found.cosine, found.sine])) < 2.0)


def test_terms_of_zero_signal_and_no_terms():
    phase = np.linspace(0.0, 30.0, 100)
    found = fast_orthogonal_search(phase, np.zeros(100), spacing=1.0, candidates=5)
    assert found.frequencies.size == 0
    line = fast_orthogonal_search(phase, 2.0 - 3.0 * phase, spacing=1.0, candidates=5, most_terms=0)
    assert (line.constant, line.slope) == pytest.approx((2.0, -3.0), rel=1e-12)
    assert line.frequencies.size == 0


def test_searches_are_equal_if_all_that_they_hold_is():
    first, same, other = (
        fast_orthogonal_search(np.arange(40.0), level * np.ones(40), spacing=1.0, candidates=5)
        for level in (1.0, 1.0, 2.0)
    )
    assert first == same != other


def test_a_large_ramp_costs_no_precision():
    generator = np.random.default_rng(5)
    phase = wandering_phase(2000, 12.0, generator)
    small = series_with_noise(phase, generator, noise=0.1)
    without = fast_orthogonal_search(phase, small, spacing=1.0, candidates=16)
    with_ramp = fast_orthogonal_search(phase, small + 1e6 * phase, spacing=1.0, candidates=16)
    assert np.array_equal(with_ramp.frequencies, without.frequencies)
    assert with_ramp.cosine == pytest.approx(without.cosine, abs=1e-7)


def correlated(samples, count, generator):
    """Columns that share much of each other, with means and sizes of their own."""
    columns = generator.standard_normal((samples, count)) @ generator.standard_normal(
        (count, count)
    )
    return columns * np.geomspace(1e-3, 1e3, count) + generator.uniform(-5.0, 5.0, count)


@pytest.mark.parametrize("with_phase", [True, False])
@pytest.mark.parametrize("seed", range(3))
def test_columns_are_chosen_as_the_textbook_recursion_chooses_them(with_phase, seed):
    generator = np.random.default_rng(seed)
    phase = wandering_phase(300, 4.0, generator)
    columns = correlated(300, 9, generator)
    signal = 2.0 + columns[:, [1, 6]] @ [300.0, -0.02] + generator.standard_normal(300)
    signal += 0.1 * phase if with_phase else 0.0
    found = fast_orthogonal_search(
        phase if with_phase else None, signal, candidates=columns, stop="none", most_terms=5
    )
    base = [np.ones(300), phase] if with_phase else [np.ones(300)]
    chosen, left, coefficients = textbook_search(signal, base, columns, terms=5)
    assert found.chosen.tolist() == chosen
    assert found.mean_square == pytest.approx(left, rel=1e-8)
    assert found.constant == pytest.approx(coefficients[0], rel=1e-7)
    assert found.slope == pytest.approx(coefficients[1] if with_phase else 0.0, rel=1e-7)
    assert found.coefficients[:, 0] == pytest.approx(coefficients[len(base) :], rel=1e-7)
    series = found.series(phase if with_phase else None, columns)
    assert np.mean((signal - series) ** 2) == pytest.approx(left[-1], rel=1e-8)


@pytest.mark.parametrize("stop", STOPS)
def test_a_matrix_of_pairs_is_searched_as_the_phase_is(stop):
    generator = np.random.default_rng(6)
    phase = wandering_phase(500, 6.3, generator)
    signal = series_with_noise(phase, generator, noise=0.3)
    argument = np.outer(phase, np.arange(1.0, 21.0))
    pairs = np.stack([np.cos(argument), np.sin(argument)], axis=2)
    by_phase = fast_orthogonal_search(phase, signal, spacing=1.0, candidates=20, stop=stop)
    by_matrix = fast_orthogonal_search(phase, signal, candidates=pairs, stop=stop)
    assert by_matrix.chosen.tolist() == by_phase.chosen.tolist()
    # The sums over the phase are good to 1e-9 of their strengths.
    assert by_matrix.mean_square == pytest.approx(by_phase.mean_square, rel=1e-7)
    assert by_matrix.coefficients == pytest.approx(by_phase.coefficients, abs=1e-7)
    assert (by_matrix.constant, by_matrix.slope) == pytest.approx(
        (by_phase.constant, by_phase.slope), abs=1e-7
    )
    assert by_matrix.series(phase, pairs) == pytest.approx(by_phase.series(phase), abs=1e-6)


def test_columns_that_say_nothing_new_are_refused():
    generator = np.random.default_rng(7)
    column = generator.standard_normal(200)
    columns = np.stack([np.full(200, 3.0), column, 5.0 - 2.0 * column, np.zeros(200)], axis=1)
    signal = column + 0.1 * generator.standard_normal(200)
    found = fast_orthogonal_search(None, signal, candidates=columns, stop="none")
    assert found.chosen.size == 1
    assert found.chosen[0] in {1, 2}


def test_a_large_mean_hides_no_column():
    # A temperature near 300 K that moves by a tenth.
    generator = np.random.default_rng(8)
    temperature = 300.0 + 0.1 * generator.standard_normal(400)
    signal = 2.0 * temperature + 0.01 * generator.standard_normal(400)
    found = fast_orthogonal_search(None, signal, candidates=temperature[:, np.newaxis])
    assert found.chosen.tolist() == [0]
    assert found.coefficients[0, 0] == pytest.approx(2.0, abs=0.02)


def test_single_columns_of_noise_pass_at_the_false_alarm_stated():
    taken = 0
    for seed in range(200):
        generator = np.random.default_rng(seed)
        found = fast_orthogonal_search(
            None,
            generator.standard_normal(300),
            candidates=generator.standard_normal((300, 30)),
            stop="false-alarm",
            false_alarm=0.1,
            most_terms=1,
        )
        taken += found.chosen.size
    # Binomial(200, 0.1): 20 +- 4.2.
    assert 7 <= taken <= 33


def test_the_result_carries_its_settings_and_takes_lists():
    found = fast_orthogonal_search(
        [0.0, 1.0, 2.0, 3.0, 4.0],
        [1.0, 2.0, 0.0, 1.0, 3.0],
        spacing=0.7,
        candidates=2,
        stop="false-alarm",
        false_alarm=0.2,
        most_terms=1,
    )
    assert (found.spacing, found.candidates, found.stop) == (0.7, 2, "false-alarm")
    assert (found.false_alarm, found.most_terms) == (0.2, 1)
    with pytest.raises(ValueError, match="read-only"):
        found.mean_square[0] = 0.0
    with pytest.raises(ValueError, match="given for a matrix"):
        found.series([0.0], [[1.0]])
    own = fast_orthogonal_search(None, [1.0, 2.0, 0.5], candidates=[[1.0], [2.0], [0.0]])
    with pytest.raises(ValueError, match="no frequencies"):
        _ = own.frequencies


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"stop": "f-test"}, "stop is 'f-test'; use one of korenberg, false-alarm, none"),
        ({"false_alarm": 1.0}, "false_alarm is 1.0"),
        ({"spacing": None}, "spacing is None"),
        ({"false_alarm": "1%"}, "false_alarm is '1%'; give a number between 0 and 1"),
        ({"signal": np.full(10, np.nan)}, "signal: sample 0 is nan"),
        ({"signal": np.zeros((5, 2))}, r"signal has shape \(5, 2\)"),
        ({"candidates": np.zeros((10, 2))}, "candidates is a matrix"),
        ({"candidates": np.zeros((9, 2)), "spacing": None}, r"candidates has shape \(9, 2\)"),
        ({"candidates": np.zeros((10, 2, 3)), "spacing": None}, "for pairs"),
        ({"candidates": np.full((10, 2), np.inf), "spacing": None}, "not finite"),
        ({"candidates": np.ones((10, 2)) + 1j, "spacing": None}, "candidates holds complex128"),
        ({"candidates": np.full((10, 2), "1"), "spacing": None}, "candidates holds <U1 values"),
        ({"spacing": 0.0}, "spacing is 0"),
        ({"candidates": 0}, "candidates is 0"),
        ({"most_terms": -1}, "most_terms is -1"),
        ({"signal": np.zeros(9)}, "signal \\(9,\\)"),
    ],
)
def test_refusals_are_one_line(change, message):
    arguments = {"signal": np.zeros(10), "spacing": 1.0, "candidates": 3} | change
    with pytest.raises(ValueError, match=message) as caught:
        fast_orthogonal_search(np.arange(10.0), arguments.pop("signal"), **arguments)
    assert "\n" not in str(caught.value)
