"""Cells of a tapered spectrum against naive sums and known noise."""

import numpy as np
import pytest

from sagnac.spectrum.levels import robust_levels
from sagnac.spectrum.periodogram import band_degrees_of_freedom, sine_taper
from sagnac.spectrum.tapered import line_density, tapered_spectrum

RATE = 100.0


def test_density_is_the_naive_multitaper():
    rng = np.random.default_rng(1)
    values = rng.standard_normal(500)
    spectrum = tapered_spectrum(values, sample_rate=RATE)
    time = np.arange(500)
    hann = np.sin(np.pi * (time + 0.5) / 500)
    line = np.polynomial.Polynomial.fit(time, values, 1, w=hann)
    # 499 samples and the zero after them make 500, which is quick to transform.
    time = time[:499]
    rest = values[:499] - line(time)
    density = np.zeros(8)
    for order in range(1, 8):
        taper = sine_taper(order, 499)
        for index, ordinate in enumerate(range(6, 14)):
            wave = np.exp(-2j * np.pi * ordinate * time / 500)
            density[index] += 2.0 * RATE * abs(np.sum(taper * rest * wave)) ** 2 / 7
    assert spectrum.cells.density[0] == pytest.approx(density.mean(), rel=1e-9)
    assert spectrum.cells.low[0] == pytest.approx(5.5 * RATE / 500)


def test_degrees_of_freedom_are_those_of_white_noise():
    rng = np.random.default_rng(2)
    values = rng.standard_normal(400_000)
    density = tapered_spectrum(values, sample_rate=RATE, segment=2**19).cells.density
    found = 2.0 / np.var(density / density.mean())
    assert found == pytest.approx(band_degrees_of_freedom(8), rel=0.05)
    assert band_degrees_of_freedom(1) == pytest.approx(14.0, rel=1e-6)


def test_a_line_far_off_leaks_less_than_the_floor():
    samples = 20_000
    time = np.arange(samples) / RATE
    rng = np.random.default_rng(3)
    noise = rng.standard_normal(samples)
    line = 1e3 * np.sin(2 * np.pi * 29.91 * time)
    quiet = tapered_spectrum(noise, sample_rate=RATE)
    loud = tapered_spectrum(noise + line, sample_rate=RATE)
    low = quiet.cells.frequency < 5.0
    assert np.allclose(loud.cells.density[low], quiet.cells.density[low], rtol=0.02)


def test_leaked_density_is_about_what_a_line_leaks():
    samples = 8192
    time = np.arange(samples) / RATE
    spectrum = tapered_spectrum(np.sin(2 * np.pi * 20.005 * time), sample_rate=RATE)
    far = np.abs(spectrum.cells.frequency - 20.0) > 2.0
    # The bound lies above what is there, and not by orders of magnitude.
    assert np.all(spectrum.cells.density[far] < 10.0 * spectrum.cells.leaked[far])


def test_segments_and_decimation_join_without_a_step():
    rng = np.random.default_rng(4)
    spectrum = tapered_spectrum(rng.standard_normal(60_000), sample_rate=RATE, segment=8192)
    assert np.all(np.diff(spectrum.cells.frequency) > 0.0)
    for part in np.array_split(spectrum.cells.density, 4):
        assert part.mean() == pytest.approx(2.0 * RATE, rel=0.1)
    levels = robust_levels(spectrum)
    pull = (levels.level / (2.0 * RATE) - 1.0) * np.sqrt(levels.shape)
    assert np.abs(pull).max() < 4.0


@pytest.mark.parametrize("frequency", [0.73, 7.03, 49.2, 61.0])
def test_what_a_line_adds_is_the_spectrum_of_a_sinusoid(frequency):
    amplitude, time = 2e-6, np.arange(20_001) / RATE
    spectra = [
        tapered_spectrum(
            np.diff(amplitude * np.cos(2 * np.pi * frequency * time + phase)),
            sample_rate=RATE,
            segment=4096,
        )
        for phase in 0.4 * np.arange(16)
    ]
    density = np.mean([one.cells.density for one in spectra], axis=0)
    added = line_density(spectra[0], frequency, amplitude)
    width = spectra[0].cells.high - spectra[0].cells.low
    assert added @ width == pytest.approx(density @ width, rel=0.02)
    strong = density > 0.02 * density.max()
    np.testing.assert_allclose(added[strong], density[strong], rtol=0.1)
