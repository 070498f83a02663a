"""Sums over table angle by tables of polynomials: against the definition."""

import numpy as np
import pytest

from sagnac.spectrum.sums import HIGHEST, angle_series, angle_sums

PHASE = np.random.default_rng(2).uniform(-40.0, 40.0, 3000)


def test_a_series_is_the_sum_of_its_orders():
    generator = np.random.default_rng(3)
    sums = generator.standard_normal(HIGHEST + 1) + 1j * generator.standard_normal(HIGHEST + 1)
    direct = sum((sums[k] * np.exp(1j * k * PHASE)).real for k in range(HIGHEST + 1))
    assert angle_series(PHASE, sums) == pytest.approx(direct, abs=1e-12 * np.abs(sums).sum())
    assert angle_series(PHASE, np.array([2.0 + 1.0j])) == pytest.approx(np.full(3000, 2.0))


def test_sums_are_those_over_the_samples():
    strengths = np.random.default_rng(4).standard_normal(3000)
    found = angle_sums(PHASE, strengths, HIGHEST)
    direct = [np.sum(strengths * np.exp(-1j * k * PHASE)) for k in range(HIGHEST + 1)]
    assert found == pytest.approx(np.array(direct), abs=1e-10)
    assert angle_sums(PHASE, strengths, 0) == pytest.approx([strengths.sum()])
