"""Noise that goes with lines when they are removed: how much, and given back to the curve."""

import numpy as np
import pytest

from sagnac.lines.naming import taken_allan_variance, with_noise_restored
from sagnac.stability.curve import stability_curve

RATES = np.random.default_rng(4).standard_normal(1000)


def test_variance_that_lines_took_is_added_and_said():
    curve = stability_curve(RATES, kind="rate", sample_rate=1.0, taus=[1, 10, 100])
    taken = np.array([0.0, 0.25, 1.0]) * curve.deviation**2
    restored = with_noise_restored(curve, taken, 12)
    assert restored.deviation**2 == pytest.approx(curve.deviation**2 + taken)
    factor = np.sqrt([1.0, 1.25, 2.0])
    assert restored.low == pytest.approx(curve.low * factor)
    assert restored.high == pytest.approx(curve.high * factor)
    assert restored.edf == pytest.approx(curve.edf)
    assert restored.notes[-1].text == (
        "removal of 12 lines took up to 50 % of the noise variance (at tau = 100 s); "
        "it is added back"
    )
    assert with_noise_restored(curve, 1e-5 * taken, 1).notes == curve.notes


@pytest.mark.parametrize(
    ("kind", "edges", "lines", "parameters", "seen"),
    [
        ("white", (0.01, 0.5), 20, 3, 0.1),
        ("white", (0.01, 0.1), 8, 2, 0.2),
        # Above the Nyquist frequency of angles a second apart: what is taken there is folded.
        ("white", (0.5, 1.5), 60, 2, 0.01),
        ("quantization", (0.5, 4.5), 40, 2, 0.02),
    ],
)
def test_noise_that_goes_with_fitted_lines_is_what_is_said(kind, edges, lines, parameters, seen):
    interval, steps, seeds = 0.1, 4000, 150
    clusters = np.array([1, 2, 5, 13, 40])
    generator = np.random.default_rng(11)
    frequency = np.sort(generator.uniform(*edges, lines))
    number = np.arange(steps + 1) - 0.5 * steps
    phase = 2.0 * np.pi * interval * np.outer(frequency, number)
    columns = [np.cos(phase), np.sin(phase)]
    if parameters == 3:
        # A fitted frequency moves the line along its derivative.
        columns.append(number * np.sin(phase + 1.0))
    basis, _ = np.linalg.qr(np.diff(np.concatenate(columns), axis=1).T)
    power = np.ones(lines)
    if kind == "quantization":
        power = 4.0 * np.sin(np.pi * frequency * interval) ** 2
    before, after = np.empty((2, seeds, clusters.size))
    for seed in range(seeds):
        white = generator.standard_normal(steps + 1)
        noise = np.diff(white) if kind == "quantization" else white[1:]
        rest = noise - basis @ (basis.T @ noise)
        for store, increments in ((before, noise), (after, rest)):
            angle = np.concatenate([[0.0], np.cumsum(increments)])[::10]
            for point, m in enumerate(clusters):
                difference = angle[2 * m :] - 2.0 * angle[m:-m] + angle[: -2 * m]
                store[seed, point] = 0.5 * np.mean(difference**2) / m**2
    bandwidth = np.full(lines, 0.5 * parameters / (steps * interval))
    # One-sided: twice the power of an increment for every hertz to half the sample rate.
    bands = np.stack([frequency, bandwidth, 2.0 / interval * power])
    taken = taken_allan_variance(clusters.astype(float), bands, interval=interval)
    lost = before - after
    error = lost.std(axis=0, ddof=1) / np.sqrt(seeds)
    share = lost.mean(axis=0) / before.mean(axis=0)
    # Uncorrected the curve is low, and plainly so; corrected it is what it was.
    assert np.max(share) > seen
    assert np.max(lost.mean(axis=0) / error) > 10.0
    assert np.all(np.abs(lost.mean(axis=0) - taken) < 3.5 * error + 0.02 * taken)
