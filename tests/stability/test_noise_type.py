"""Noise types against simulated truth."""

import numpy as np
import pytest

from sagnac.stability.curve import stability_curve
from sagnac.stability.noise_type import lag_one_order
from tests import naive_stability as naive


@pytest.mark.parametrize("alpha", [2, 1, 0, -1, -2, -3, -4])
def test_noise_types_are_identified(alpha):
    rates = naive.power_law_rates(np.random.default_rng(20), 16_384, alpha)
    # Angles taken a cluster apart alias; flicker angle turns white when they are far apart.
    taus = [1, 4, 16] if alpha == 1 else [1, 4, 16, 64]
    # Only Hadamard's differences tell the steepest.
    how = {"estimator": "oadev" if alpha >= -2 else "ohdev", "taus": taus}
    curve = stability_curve(rates, kind="rate", sample_rate=1.0, **how)
    assert curve.noise_type.tolist() == [alpha] * len(taus)


def test_noise_is_mostly_identified_from_thirty_clusters():
    generator = np.random.default_rng(22)
    right = 0
    for _ in range(200):
        curve = stability_curve(
            generator.standard_normal(330), kind="rate", sample_rate=1.0, taus=[11]
        )
        right += abs(int(curve.noise_type[0])) <= 1
    assert right > 190


def test_noise_type_is_carried_to_the_longest_taus():
    rates = np.cumsum(np.random.default_rng(23).standard_normal(1000))
    curve = stability_curve(rates, kind="rate", sample_rate=1.0, taus=[1, 20, 100, 300])
    assert curve.noise_type.tolist() == [-2, -2, -2, -2]
    assert any("intervals of the 2 longest cluster times" in note.text for note in curve.notes)
    lone = stability_curve(rates, kind="rate", sample_rate=1.0, taus=[300])
    assert lone.noise_type.tolist() == [-2]


def test_noise_type_of_a_gapped_record_comes_from_its_stretches():
    rates = np.cumsum(np.random.default_rng(24).standard_normal(4000))
    rates[[1000, 2500]] = np.nan
    curve = stability_curve(rates, kind="rate", sample_rate=1.0, taus=[1, 10], gaps="omit")
    assert curve.noise_type.tolist() == [-2, -2]
    angles = np.random.default_rng(25).standard_normal(4000)
    angles[[0, 1000, 1001, 3999]] = np.nan
    curve = stability_curve(angles, kind="angle", sample_rate=1.0, taus=[1, 10], gaps="omit")
    assert curve.noise_type.tolist() == [2, 2]


def test_a_silent_gyro_has_no_noise_type():
    curve = stability_curve(np.full(100, 3.0), kind="rate", sample_rate=1.0, taus=[1, 10])
    assert curve.deviation.tolist() == [0.0, 0.0]
    assert any("noise type taken as 0" in note.text for note in curve.notes)


@pytest.mark.parametrize("walks", [0, 1, 2, 3])
@pytest.mark.parametrize(("cluster", "counts"), [(1, [400]), (3, [90, 60])])
def test_lag_one_order_is_its_definition(walks, cluster, counts):
    """Riley and Greenhall: less a parabola, differenced until r1/(1 + r1) < 1/4."""
    angle = np.random.default_rng(26).standard_normal(500)
    for _ in range(walks):
        angle = np.cumsum(angle)
    starts, total = np.array([7, 300])[: len(counts)], sum(counts)
    stretches = []
    for start, count in zip(starts, counts, strict=True):
        taken = angle[start : start + cluster * count : cluster]
        place = np.linspace(-1.0, 1.0, count)
        stretches.append(taken - np.polyval(np.polyfit(place, taken, 2), place))
    expected = None
    for order in range(4):
        centred = [stretch - stretch.mean() for stretch in stretches]
        r1 = sum(part[:-1] @ part[1:] for part in centred) / sum(part @ part for part in centred)
        # The parabola's parameters that differencing has not undone pull r1 down.
        r1 += max(3 - order, 1) / (total / len(counts))
        expected = order + r1 / (1.0 + r1)
        if expected - order < 0.25:
            break
        stretches = [np.diff(stretch) for stretch in stretches]
    found = lag_one_order(angle, starts, np.array(counts), cluster, 3)
    assert found == pytest.approx(expected, rel=1e-6)
