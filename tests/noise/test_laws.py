"""Laws of the noise terms against numerical integration and dense matrices."""

import itertools
from decimal import Context, Decimal, localcontext

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import toeplitz

from sagnac.noise import _kernels
from sagnac.noise.laws import (
    COEFFICIENT_NAMES,
    STOCHASTIC_NAMES,
    allan_variance,
    allan_variance_basis,
    cosine_power_basis,
    increment_spectrum_basis,
    markov_allan_variance,
    overlapped_allan_covariances,
    sinusoid_allan_variance,
)


def overlapped_allan_covariance(factors, coefficients, **settings):
    """Covariance of the points with some coefficients, the others at zero."""
    squares = np.array([coefficients.get(name, 0.0) ** 2 for name in COEFFICIENT_NAMES])
    pairs = overlapped_allan_covariances(tuple(factors), **settings)
    return np.einsum("a,b,abij->ij", squares, squares, pairs)


def angle_covariances(times, interval):
    """Generalized autocovariance of the angle for Q, N, B, K at one, written out."""
    t = np.abs(times) * interval
    safe = np.where(t > 0.0, t, 1.0)
    return [
        (t == 0.0).astype(float),
        -0.5 * t,
        t**2 * np.log(safe) / (2.0 * np.pi),
        t**3 / 12.0,
    ]


def allan_integral(density, tau):
    """4 int_0^inf S(f) sin^4(pi f tau)/(pi f tau)^2 df of a two-sided density."""

    def integrand(f):
        return density(f) * np.sin(np.pi * f * tau) ** 4 / (np.pi * f * tau) ** 2

    edges = np.concatenate([[0.0], np.arange(1, 61) / tau])
    total = sum(quad(integrand, a, b, limit=200)[0] for a, b in itertools.pairwise(edges))
    # Beyond: the mean of sin^4 is 3/8.
    tail, _ = quad(lambda f: density(f) * 0.375 / (np.pi * f * tau) ** 2, edges[-1], np.inf)
    return 4.0 * (total + tail)


def markov_density(f):
    """Density of a Markov rate with a driving noise of 0.7 and a correlation time of 3 s."""
    return (0.7 * 3.0) ** 2 / (1.0 + (2.0 * np.pi * f * 3.0) ** 2)


@pytest.mark.parametrize("tau", [0.2, 0.3, 1.0, 3.0, 40.0, 50.0])
@pytest.mark.parametrize(
    ("name", "density"),
    [
        ("angle_random_walk", lambda f: 0.49 * np.ones_like(f)),
        ("bias_instability", lambda f: 0.49 / (2.0 * np.pi * f)),
        ("rate_random_walk", lambda f: 0.49 / (2.0 * np.pi * f) ** 2),
        ("Markov rate", markov_density),
    ],
)
def test_allan_variance_is_the_filtered_density(name, density, tau):
    at = np.array([tau])
    is_markov = density is markov_density
    variance = markov_allan_variance(at, 0.7, 3.0) if is_markov else allan_variance(at, {name: 0.7})
    assert variance[0] == pytest.approx(allan_integral(density, tau), rel=2e-4)


def test_markov_rate_is_a_random_walk_at_short_and_white_at_long_times():
    short = np.array([1e-6, 1e-4])
    assert markov_allan_variance(short, 0.7, 1.0) == pytest.approx(0.49 * short / 3.0, rel=1e-3)
    assert markov_allan_variance(np.array([1e6]), 0.7, 1.0)[0] == pytest.approx(0.49e-6, rel=1e-3)


def test_allan_variance_of_a_sinusoid_against_its_definition():
    amplitude, frequency = 0.3, 0.13
    step = 0.01
    time = np.arange(0, 4000.0, step)
    angle = -amplitude / (2.0 * np.pi * frequency) * np.cos(2.0 * np.pi * frequency * time)
    for tau in (1.0, 3.0, 7.7):
        lag = round(tau / step)
        difference = angle[2 * lag :] - 2.0 * angle[lag:-lag] + angle[: -2 * lag]
        assert sinusoid_allan_variance(np.array([tau]), amplitude, frequency)[0] == pytest.approx(
            0.5 * np.mean(difference**2) / tau**2, rel=1e-2, abs=0.0
        )


def test_white_angle_gives_the_quantization_law():
    # A uniform step gives Q = step/sqrt(12), whatever is rounded, if the angle roams.
    generator = np.random.default_rng(4)
    step = 0.5
    true = np.cumsum(10.0 * generator.standard_normal(400_000))
    error = step * np.round(true / step) - true
    difference = error[6:] - 2.0 * error[3:-3] + error[:-6]
    measured = 0.5 * np.mean(difference**2) / 3.0**2
    law = allan_variance(np.array([3.0]), {"quantization": step / np.sqrt(12.0)})[0]
    assert measured == pytest.approx(law, rel=0.02)


@pytest.mark.parametrize("cluster", [1, 2, 7])
def test_discrete_spectra_integrate_to_the_allan_variance_of_their_samples(cluster):
    interval = 0.25
    nyquist = 0.5 / interval
    law = allan_variance_basis(np.array([cluster * interval]))[0]
    for term in range(4):

        def integrand(f, term=term):
            gain = np.sin(np.pi * f * cluster * interval) ** 4 / np.sin(np.pi * f * interval) ** 2
            return increment_spectrum_basis(np.array([f]), interval)[0, term] * gain

        edges = np.linspace(0.0, nyquist, 2 * cluster + 1)
        edges[0] = 1e-9
        total = sum(quad(integrand, a, b, limit=200)[0] for a, b in itertools.pairwise(edges))
        measured = 4.0 * total * interval / (cluster * interval) ** 2
        assert measured == pytest.approx(law[term], rel=1e-6)


def test_expected_cosine_squares_against_dense_matrices():
    samples, interval = 90, 0.5
    index = np.arange(samples)
    rows = np.sqrt(2.0 / samples) * np.cos(np.pi * index[1:, np.newaxis] * (index + 0.5) / samples)
    lags = np.arange(samples)
    expected = cosine_power_basis(index[1:].astype(float), samples, interval)
    here, after, before = (angle_covariances(lags + shift, interval) for shift in (0, 1, -1))
    for term in range(4):
        covariance = toeplitz(2.0 * here[term] - after[term] - before[term])
        transformed = rows @ covariance @ rows.T
        # 1/f near the Nyquist frequency folds a little differently in a short record.
        tolerance = 6e-3 if STOCHASTIC_NAMES[term] == "bias_instability" else 1e-7
        assert expected[:, term] == pytest.approx(np.diag(transformed), rel=tolerance)
        if STOCHASTIC_NAMES[term] in ("angle_random_walk", "rate_random_walk"):
            scale = np.sqrt(np.diag(transformed))
            correlation = transformed / np.outer(scale, scale)
            assert np.abs(correlation - np.eye(samples - 1)).max() < 1e-6


@pytest.mark.parametrize("term", range(5))
def test_covariance_of_overlapped_variances_against_dense_matrices(term):
    angles, interval = 121, 0.5
    factors = [1, 2, 5, 13, 30, 60]
    squares = np.array([0.0, 0.3, 0.0, 0.0, 0.0])
    squares[term] += 1.0
    lag = np.subtract.outer(np.arange(angles), np.arange(angles))
    structure = sum(
        square * covariance
        for square, covariance in zip(squares, angle_covariances(lag, interval), strict=False)
    )
    operators = []
    for factor in factors:
        operator = np.zeros((angles - 2 * factor, angles))
        for row in range(operator.shape[0]):
            operator[row, [row, row + factor, row + 2 * factor]] = (1.0, -2.0, 1.0)
        operators.append(operator)
    expected = np.empty((len(factors), len(factors)))
    for i, (first, one) in enumerate(zip(factors, operators, strict=True)):
        for j, (second, other) in enumerate(zip(factors, operators, strict=True)):
            covariance = one @ structure @ other.T
            trend = squares[4] * (first * second * interval**2) ** 2 / 1.0
            total = np.sum(2.0 * covariance**2 + 4.0 * trend * covariance)
            scale = 4.0 * (first * second * interval**2) ** 2
            expected[i, j] = total / scale / covariance.size
    measured = overlapped_allan_covariance(
        factors,
        dict(zip(COEFFICIENT_NAMES, np.sqrt(squares), strict=True)),
        angles=angles,
        interval=interval,
    )
    scale = np.sqrt(np.diag(expected))
    assert np.abs((measured - expected) / np.outer(scale, scale)).max() < 1e-5


def test_covariance_far_lags_against_the_sum_over_every_lag():
    # Clusters of thousands, where the kernel sums by panels.
    angles, first, second = 40_001, 37, 5000
    names = STOCHASTIC_NAMES
    squares = np.array([1e3, 1.0, 1e-3, 1e-9])
    lags = np.arange(-(angles - 2 * second - 1), angles - 2 * first)
    total = np.zeros(lags.size)
    for p, one in enumerate((1.0, -2.0, 1.0)):
        for q, other in enumerate((1.0, -2.0, 1.0)):
            shifted = angle_covariances(lags + p * first - q * second, 1.0)
            total += one * other * sum(s * c for s, c in zip(squares, shifted, strict=True))
    pairs = np.minimum(angles - 2 * first, angles - 2 * second + lags) - np.maximum(0, lags)
    expected = np.sum(2.0 * pairs * total**2) / (
        4.0 * (first * second) ** 2 * (angles - 2.0 * first) * (angles - 2.0 * second)
    )
    measured = overlapped_allan_covariance(
        [first, second],
        dict(zip(names, np.sqrt(squares), strict=True)),
        angles=angles,
        interval=1.0,
    )
    assert measured[0, 1] == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(("first", "second"), [(1, 1), (1, 21_000_000), (3_000_001, 40), (7, 9)])
def test_covariance_of_a_day_of_samples_keeps_its_digits(first, second):
    """Lags of 1e7 samples have cubes of 1e21, and the covariance is near one."""
    places = [0.0, 0.5, second, 2 * second - 1.25, -1.5 * first, second - 0.5 * first]
    with localcontext(Context(prec=60)):
        pi = Decimal("3.14159265358979323846264338327950288419716939937510582")
        for lag in [*places, -8.0 * max(first, second), 9.25 * max(first, second)]:
            flicker = walk = Decimal(0)
            for p, q in itertools.product(range(3), repeat=2):
                weight = (1, -2, 1)[p] * (1, -2, 1)[q]
                t = abs(Decimal(lag) + p * first - q * second)
                flicker += weight * (t * t * t.ln() / (2 * pi) if t else 0)
                walk += weight * t**3 / 12
            found = np.empty(5)
            _kernels.second_difference_covariances(lag, first, second, found)
            size = min(first, second) ** 2
            assert found[2] == pytest.approx(float(flicker), rel=1e-9, abs=1e-12 * size)
            largest = size * max(first, second)
            assert found[3] == pytest.approx(float(walk), rel=1e-9, abs=1e-14 * largest)


def test_covariance_of_a_day_of_samples_is_one():
    """Of random walk of the rate at 500 Hz, from one sample to half of the day."""
    factors = np.unique(np.rint(np.geomspace(1, 21_599_999, 147)).astype(np.int64))
    covariance = overlapped_allan_covariance(
        factors.tolist(), {"rate_random_walk": 1.0}, angles=43_200_000, interval=0.002
    )
    scale = np.sqrt(np.diag(covariance))
    values = np.linalg.eigvalsh(covariance / np.outer(scale, scale))
    assert values[0] > -1e-3
