"""Spectra as they are shown."""

import dataclasses

import numpy as np
import pytest

from sagnac.analysis.spectra import Spectrum
from sagnac.report import quantities as spectra
from tests.handmade import analysis


def test_a_coarser_spectrum_keeps_its_power():
    frequency = np.arange(1.0, 1001.0)
    density = np.random.default_rng(3).exponential(size=1000)
    made = spectra.coarser(Spectrum(frequency=frequency, density=density), 20)
    assert made.frequency.size <= 20
    assert np.all(np.diff(made.frequency) > 0.0)
    edges = np.searchsorted(frequency, np.geomspace(1.0, 1000.0, 21)[:-1])
    starts = np.unique(edges)
    assert made.density == pytest.approx([part.mean() for part in np.split(density, starts[1:])])


@pytest.mark.parametrize("count", [0, 1, 5])
def test_residual_peaks_counts_what_stands_out(count):
    made = analysis()
    density = made.spectrum.density.copy()
    for index in range(count):
        density[300 + 250 * index] *= 1000.0
    spectrum = dataclasses.replace(made.spectrum, density=density)
    clean = spectra.residual_peaks(made)
    assert spectra.residual_peaks(dataclasses.replace(made, spectrum=spectrum)) == clean + count
