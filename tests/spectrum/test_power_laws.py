"""Power laws fitted to spectra against the laws that those were made by."""

import numpy as np
import pytest

from sagnac.core import arrays
from sagnac.spectrum.power_laws import PowerLaws, bin_levels, fit_levels, fit_power_laws
from tests.spectrum.examples import as_series

BINS = 50_000


def test_laws_at_a_bin_are_those_of_its_frequency():
    law = PowerLaws(coefficients=np.array([1.0, 2.0, 3.0, 4.0]), level=5.0, bins=1000)
    f = 100 / 2000
    expected = 5.0 * (f**-2 + 2.0 / f + 3.0 + 16.0 * np.sin(np.pi * f) ** 2)
    assert law.at(np.array([100.0])) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("mapped", [False, True])
def test_levels_of_bins_are_expected_powers_whatever_lines_there_are(monkeypatch, mapped):
    power = np.random.default_rng(5).exponential(size=BINS)
    power[[2000, 2001, 30_000]] = 1e9
    if mapped:
        monkeypatch.setattr(arrays, "IN_MEMORY", 1000)
        monkeypatch.setattr(arrays, "BLOCK", 7000)
    center, count, level = bin_levels(as_series(power))
    assert count.sum() == BINS
    assert np.array_equal(count[:9], np.ones(9))
    assert center[:3] == pytest.approx([1.0, 2.0, 3.0])
    assert np.array_equal(level[:9], power[:9])
    many = count > 300
    assert level[many] == pytest.approx(1.0, abs=0.25)
    assert np.average(level[many], weights=count[many]) == pytest.approx(1.0, abs=0.02)


def test_levels_that_are_laws_give_their_coefficients():
    frequency = np.geomspace(1e-4, 0.5, 60)
    design = np.column_stack([frequency**-2.0, np.ones(60)])
    level = design @ [1e-5, 2.0]
    found = fit_levels(design, level, np.full(60, 100))
    assert found == pytest.approx([1e-5, 2.0], rel=1e-9, abs=0.0)
    # A line lifts no law.
    level[[20, 45]] *= 1e6
    assert fit_levels(design, level, np.full(60, 100)) == pytest.approx([1e-5, 2.0], rel=1e-6)


def test_coefficients_are_not_negative():
    frequency = np.geomspace(1e-3, 0.5, 60)
    design = np.column_stack([frequency**-2.0, np.ones(60)])
    found = fit_levels(design, 1.0 - 0.5 * frequency**0.1, np.full(60, 100))
    assert np.all(found >= 0.0)


def test_a_walk_under_white_noise_is_fitted_and_scales():
    f = np.arange(1, BINS + 1) / (2.0 * BINS)
    truth = 1e-18 * (1.0 + 1e-6 / f**2)
    power = truth * np.random.default_rng(2).exponential(size=BINS)
    law = fit_power_laws(power)
    at = np.array([30.0, 300.0, 3000.0, 30_000.0])
    assert law.at(at) == pytest.approx(truth[at.astype(int) - 1], rel=0.2, abs=0.0)
    again = fit_power_laws(1e6 * power)
    assert again.at(at) == pytest.approx(1e6 * law.at(at), rel=1e-9, abs=0.0)
