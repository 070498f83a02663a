"""N over parts of a record."""

import numpy as np
import pytest

from sagnac.analysis.parts import Reading, over_parts, reading_in_band
from sagnac.coefficients.band_models import BandModel
from sagnac.coefficients.mixture import Interval
from sagnac.coefficients.model_average import Resting
from sagnac.spectrum.levels import robust_levels
from sagnac.spectrum.tapered import tapered_spectrum

RATE = 100.0


def deviation(part):
    size = float(part.std())
    return Interval(value=size, low=0.97 * size, high=1.03 * size)


def parts_of(values, whole=None, change=lambda part: 0.0):
    return over_parts(
        values,
        sample_rate=RATE,
        read=lambda part: Reading(walk=deviation(part), change=change(part), error=0.1),
        whole=whole or deviation(values),
    )


def test_parts_that_disagree_are_told():
    rng = np.random.default_rng(14)
    values = np.concatenate([rng.standard_normal(4000), 2.0 * rng.standard_normal(4000)])
    parts = parts_of(values)
    assert not parts.agree
    assert parts.smallest < 1.1
    assert parts.largest > 1.9
    assert [part.stop_s for part in parts.parts] == [20.0, 40.0, 60.0, 80.0]


def test_parts_of_still_noise_agree():
    assert parts_of(np.random.default_rng(14).standard_normal(8000)).agree


def test_parts_that_agree_with_each_other_and_not_with_the_whole_disagree():
    values = np.random.default_rng(14).standard_normal(8000)
    assert not parts_of(values, Interval(value=1.3, low=1.27, high=1.33)).agree


def test_parts_whose_spectra_differ_disagree_though_their_fits_do_not():
    # Fits whose intervals reach over each other, changes five of their errors apart.
    values = np.random.default_rng(14).standard_normal(8000)
    middle = values.size // 4

    def change(part):
        return 0.5 if part[0] == values[middle] else 0.0

    assert not parts_of(values, change=change).agree
    assert parts_of(values, change=lambda part: 0.5).agree


def test_an_error_of_zero_is_refused():
    with pytest.raises(ValueError, match="error is 0"):
        Reading(walk=Interval(value=1.0, low=0.9, high=1.1), change=0.0, error=0.0)


def levels(walk, quantum, generator):
    """Of a rate with a white part, and of the differences of white angles."""
    size = 20_000
    increments = walk / np.sqrt(RATE) * generator.standard_normal(size)
    increments += np.diff(quantum * generator.standard_normal(size + 1))
    return robust_levels(tapered_spectrum(increments, sample_rate=RATE))


# White angles of deviation d have Q = d (IEEE Std 952).
@pytest.mark.parametrize("quantum", [0.0, 0.2])
def test_the_change_of_a_part_is_that_of_its_walk_with_all_else_as_it_is(quantum):
    generator = np.random.default_rng(3)
    law = BandModel(squares=(quantum**2, 1.0, 0.0, 0.0), interval=1.0 / RATE)
    terms = ("quantization", "angle_random_walk") if quantum else ("angle_random_walk",)
    resting = Resting(
        band_hz=(0.1, 24.0), terms=terms, mask=0b11 if quantum else 0b10, share=1.0, law=law
    )
    deviates = []
    for walk in np.linspace(0.9, 1.1, 21):
        found = reading_in_band(levels(walk, quantum, generator), resting, 0.95)
        deviates.append((found.change - 2.0 * np.log(walk)) / found.error)
    # The error also allows every bin 3 % that these levels do not have.
    assert abs(np.mean(deviates)) < 1.0
    assert 0.1 < np.std(deviates) < 1.2
