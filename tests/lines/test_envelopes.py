"""Which description of a line is taken, and steady lines in a baseband."""

from dataclasses import replace

import numpy as np
import pytest

from sagnac.lines.envelopes import (
    Baseband,
    best_description,
    simplest,
    steady_lines,
    sum_of_tones,
)

VALUES, LENGTH = 600, 50


def made(frequencies, amplitudes, *, noise=0.0, seed=0):
    """A baseband about 0.1 cycles per sample that holds steady lines."""
    samples = VALUES * LENGTH + 1
    generator = np.random.default_rng(seed)
    white = generator.standard_normal((2, VALUES))
    base = Baseband(
        target=noise * (white[0] + 1j * white[1]),
        middles=np.arange(VALUES) * LENGTH + 0.5 * (LENGTH - 1),
        length=LENGTH,
        variance=max(noise, 1e-3) ** 2,
        frequency=0.1,
        center=0.5 * (samples - 1),
        samples=samples,
    )
    tones = sum_of_tones(base, np.array(frequencies), np.array(amplitudes))
    return Baseband(
        target=base.target + tones,
        middles=base.middles,
        length=LENGTH,
        variance=base.variance,
        frequency=0.1,
        center=base.center,
        samples=samples,
    )


def test_a_tone_is_the_mean_of_its_phasors():
    base = made([], [])
    number = np.arange(VALUES * LENGTH) - base.center
    phasors = (0.3 - 0.2j) * np.exp(2j * np.pi * 1.7e-3 * number)
    means = phasors.reshape(VALUES, LENGTH).mean(axis=1)
    assert sum_of_tones(base, np.array([0.1017]), np.array([0.3 - 0.2j])) == pytest.approx(
        means, abs=1e-6
    )


def test_steady_lines_are_refined_to_where_they_are():
    cell = 1.0 / (VALUES * LENGTH)
    places = 0.1 + np.array([0.4, 3.1]) * cell
    base = made(places, [1.0 + 0.5j, -0.4j])
    found = steady_lines(base, places + np.array([0.2, -0.15]) * cell)
    assert found.frequencies == pytest.approx(places, abs=1e-3 * cell)
    assert found.amplitudes == pytest.approx(np.array([1.0 + 0.5j, -0.4j]), abs=1e-2)


def test_the_simplest_is_beaten_only_by_more_than_chance():
    assert simplest([(3, 100.0), (10, 95.0)]) == 0
    assert simplest([(3, 100.0), (10, 60.0)]) == 1
    # Whichever comes first, and only as many parameters as it takes.
    assert simplest([(30, 55.0), (10, 60.0), (3, 100.0)]) == 1
    assert simplest([(3, 100.0), (3, 90.0)]) == 1


def test_a_steady_line_in_noise_has_no_description():
    base = made([0.1], [5.0], noise=1.0)
    assert best_description(base, steady_lines(base, np.array([0.1])), 16) is None


def test_an_envelope_of_as_many_parameters_as_samples_leaves_nothing():
    base, few = made([0.1], [5.0], noise=1.0), 7
    base = replace(
        base,
        target=base.target[:few],
        middles=base.middles[:few],
        center=0.5 * few * LENGTH,
        samples=few * LENGTH + 1,
    )
    found = best_description(base, steady_lines(base, np.array([0.1])), 4)
    assert found is None or found.parameters < 2 * few
