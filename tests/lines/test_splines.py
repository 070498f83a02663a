"""The uniform splines against scipy's, and their least squares against dense ones."""

from types import SimpleNamespace

import numpy as np
import pytest
import scipy.linalg
from scipy.interpolate import BSpline

from sagnac.lines.envelopes import (
    knot_values,
    knot_variances,
    normal_bands,
    pieces,
    places,
    spline_products,
    spline_values,
)
from sagnac.lines.wandering import values

SAMPLES, BLOCKS = 1000, 8
MIDDLES = np.arange(4.5, SAMPLES - 1, 10.0)
COEFFICIENTS = np.random.default_rng(0).standard_normal(BLOCKS + 3)


def scipys():
    knots = np.arange(-3, BLOCKS + 4) * (SAMPLES / BLOCKS)
    return BSpline(knots, COEFFICIENTS, 3)


def test_values_pieces_and_knots_are_those_of_scipy():
    at = places(MIDDLES, SAMPLES, BLOCKS)
    assert spline_values(at, at.now, COEFFICIENTS) == pytest.approx(scipys()(MIDDLES), abs=1e-12)
    edges = np.arange(BLOCKS + 1) * (SAMPLES / BLOCKS)
    assert knot_values(COEFFICIENTS) == pytest.approx(scipys()(edges), abs=1e-12)
    powers = pieces(COEFFICIENTS)
    assert powers.shape == (4, BLOCKS)
    for block in range(BLOCKS):
        place = np.array([0.0, 0.3, 1.0])
        assert np.polyval(powers[:, block], place) == pytest.approx(
            scipys()((block + place) * (SAMPLES / BLOCKS)), abs=1e-12
        )


def test_a_sample_later_goes_on_with_the_same_piece():
    at = places(MIDDLES, SAMPLES, BLOCKS)
    powers = pieces(COEFFICIENTS)
    scale = BLOCKS / SAMPLES
    expected = [
        np.polyval(powers[:, block], (middle + 1.0) * scale - block)
        for block, middle in zip(at.block, MIDDLES, strict=True)
    ]
    assert spline_values(at, at.after, COEFFICIENTS) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(("start", "count"), [(0, SAMPLES), (437, 129), (999, 1)])
def test_a_drifting_tone_is_its_splines_times_its_carrier(start, count):
    """Over steep phases, blocks that begin between samples and stretches that begin anywhere."""
    random, number = np.random.default_rng(2), np.arange(start, start + count)
    phase, real, imaginary = random.standard_normal((3, BLOCKS + 3)) * [[9.0], [1.0], [1.0]]
    knots = np.arange(-3, BLOCKS + 4) * (SAMPLES / BLOCKS)
    angle, *parts = (BSpline(knots, one, 3)(number) for one in (phase, real, imaginary))
    turns = 0.0793 * (number - 499.5)
    expected = ((parts[0] + 1j * parts[1]) * np.exp(1j * (angle + 2.0 * np.pi * turns))).real
    line = SimpleNamespace(carrier=0.0793, center=499.5, blocks=BLOCKS, samples=SAMPLES)
    line.envelope, line.phase = pieces(real + 1j * imaginary), pieces(phase)
    assert values(line, start, count) == pytest.approx(expected, abs=1e-10)


def test_least_squares_are_the_dense_ones():
    at = places(MIDDLES, SAMPLES, BLOCKS)
    generator = np.random.default_rng(1)
    turn = np.exp(1j * generator.uniform(0.0, 6.0, MIDDLES.size))
    rows = turn[:, np.newaxis] * at.now
    dense = np.zeros((MIDDLES.size, BLOCKS + 3), dtype=complex)
    for n, block in enumerate(at.block):
        dense[n, block : block + 4] = rows[n]
    normal = dense.conj().T @ dense
    bands = normal_bands(at, rows)
    for offset in range(4):
        assert bands[3 - offset, offset:] == pytest.approx(np.diag(normal, offset), abs=1e-12)
    target = generator.standard_normal(MIDDLES.size) + 1j
    assert spline_products(at, rows, target) == pytest.approx(dense.conj().T @ target, abs=1e-12)
    at_knots = np.zeros((BLOCKS + 1, BLOCKS + 3))
    for knot in range(BLOCKS + 1):
        at_knots[knot, knot : knot + 3] = np.array([1.0, 4.0, 1.0]) / 6.0
    variances = np.diag(at_knots @ np.linalg.inv(normal).real @ at_knots.T)
    assert knot_variances(scipy.linalg.cholesky_banded(bands)) == pytest.approx(variances)
