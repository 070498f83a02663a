"""N over parts of a record."""

from dataclasses import replace

import numpy as np
import pytest
from benchmarks.gallery import Gyro, low_passed

from sagnac.analysis.averaged import PartEstimate, estimate_in_band, over_parts
from sagnac.analysis.pipeline import analyze
from sagnac.analysis.settings import Settings
from sagnac.noise.band_models import BandModel
from sagnac.noise.estimates import Interval
from sagnac.noise.model_average import ModelChoice
from sagnac.recording.model import Recording
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
        read=lambda part: PartEstimate(walk=deviation(part), change=change(part), error=0.1),
        whole=whole or deviation(values),
    )


def test_parts_that_disagree_are_told():
    rng = np.random.default_rng(14)
    values = np.concatenate([rng.standard_normal(4000), 2.0 * rng.standard_normal(4000)])
    parts = parts_of(values)
    assert not parts.agree
    assert min(parts.values) < 1.1
    assert max(parts.values) > 1.9
    assert [part.stop_s for part in parts.parts] == [20.0, 40.0, 60.0, 80.0]


def test_parts_of_still_noise_agree():
    assert parts_of(np.random.default_rng(14).standard_normal(8000)).agree


def test_parts_that_agree_with_each_other_and_not_with_the_whole_disagree():
    values = np.random.default_rng(14).standard_normal(8000)
    assert not parts_of(values, Interval(value=1.3, low=1.27, high=1.33)).agree


def test_parts_whose_spectra_differ_disagree_though_their_fits_do_not():
    # Fits whose intervals reach over each other, changes five of their errors apart.
    values = np.random.default_rng(14).standard_normal(8000)
    second_quarter = values[values.size // 4]

    def change(part):
        return 0.5 if part[0] == second_quarter else 0.0

    parts = parts_of(values, change=change)
    assert not parts.agree
    assert parts.walks_agree
    assert parts.spread == pytest.approx(np.exp(0.25))
    assert parts_of(values, change=lambda part: 0.5).agree


def levels(walk, quantum, generator):
    """The levels of white rate noise with white angle noise of deviation `quantum` on top."""
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
    choice = ModelChoice(
        band_hz=(0.1, 24.0), terms=terms, mask=0b11 if quantum else 0b10, share=1.0, law=law
    )
    deviates = []
    for walk in np.linspace(0.9, 1.1, 21):
        found = estimate_in_band(levels(walk, quantum, generator), choice, 0.95)
        deviates.append((found.change - 2.0 * np.log(walk)) / found.error)
    # The error also allows every bin 3 % that these levels do not have.
    assert abs(np.mean(deviates)) < 0.6
    assert 0.5 < np.std(deviates) < 1.2


def white_part(values):
    """What a part of white noise says of N = 1, which is all that its band holds."""
    law = BandModel(squares=(0.0, 1.0, 0.0, 0.0), interval=1.0 / RATE)
    choice = ModelChoice(
        band_hz=(0.0, 0.5 * RATE), terms=("angle_random_walk",), mask=0b10, share=1.0, law=law
    )
    return estimate_in_band(robust_levels(tapered_spectrum(values, sample_rate=RATE)), choice, 0.95)


@pytest.mark.parametrize(("samples", "draws"), [(125, 400), (2500, 200)])
def test_the_error_of_a_short_part_is_how_its_change_scatters(samples, draws):
    """In few cells most bins are of one, and share with the next: the error was 16 % too small."""
    generator = np.random.default_rng(samples)
    changes, errors = [], []
    for _ in range(draws):
        values = generator.standard_normal(samples) / np.sqrt(RATE)
        found = white_part(values)
        changes.append(found.change)
        errors.append(found.error)
    # Four hundred tell a scatter to 3.5 %. Of 2500 the 3 % that each bin is allowed shows.
    assert np.std(changes) / np.mean(errors) == pytest.approx(0.95, abs=0.10)
    # The mean square of normal numbers has at least this relative error, whatever the method.
    assert np.mean(errors) > np.sqrt(2.0 / samples)


@pytest.mark.parametrize(
    ("louder", "draws", "fewest", "most"), [(1.0, 200, 0, 5), (2.0, 20, 19, 20)]
)
def test_spectra_of_short_parts_differ_by_chance_once_in_a_hundred(louder, draws, fewest, most):
    """Of white noise of 500 samples 25 records in 600 were told that it changes, not 6."""
    generator, told = np.random.default_rng(500), 0
    for _ in range(draws):
        values = generator.standard_normal(500) / np.sqrt(RATE)
        values[375:] *= louder
        whole = Interval(value=1.0, low=0.9, high=1.1)
        told += not over_parts(values, sample_rate=RATE, read=white_part, whole=whole).spectra_agree
    assert fewest <= told <= most


def test_the_change_is_found_under_a_low_pass_and_beside_bias_instability():
    # Densities written out: 2 N^2 and B^2/(pi f) behind a filter of first order at 3 Hz.
    seen = levels(1.0, 0.0, np.random.default_rng(3))
    frequency = seen.frequency
    law = BandModel(squares=(0.0, 1.0, 0.3, 0.0), interval=1.0 / RATE, falls=(1.0 / 3.0**2, 0.0))
    choice = ModelChoice(
        band_hz=(0.03, 4.0),
        terms=("angle_random_walk", "bias_instability"),
        mask=0b10110,
        share=1.0,
        law=law,
    )
    for change in (-0.1, 0.0, 0.1):
        rates = 2.0 * np.exp(change) + 0.3 / (np.pi * frequency)
        made = replace(seen, level=rates / (1.0 + (frequency / 3.0) ** 2))
        found = estimate_in_band(made, choice, 0.95)
        # The tapers see B a little higher than it is at the middle of a bin.
        assert found.change == pytest.approx(change, abs=0.015)


def test_no_change_is_told_by_a_law_in_which_the_walk_does_not_rule():
    # A part need not reach to where the walk rules; without this its change overflowed.
    seen = levels(1.0, 0.0, np.random.default_rng(3))
    law = BandModel(squares=(0.0, 1e-12, 0.0, 1e6), interval=1.0 / RATE)
    terms = ("angle_random_walk", "rate_random_walk")
    choice = ModelChoice(band_hz=(0.1, 24.0), terms=terms, mask=0b1010, share=1.0, law=law)
    assert estimate_in_band(seen, choice, 0.95) is None


def test_noise_that_grows_behind_a_low_pass_is_told_by_its_spectrum():
    # N of each half rests on few bins and passes for the same by chance.
    rng = np.random.default_rng(3)
    gyro = low_passed(rng, 20_000, 50.0, gyro=Gyro(), corner=0.01)
    growing = np.where(np.arange(20_000) < 10_000, 1.0, 2.0) * gyro.increments
    recording = Recording.from_arrays(
        x=1e-6 * growing, kind="increment", unit="rad", sample_rate=50.0
    )
    found = analyze(recording, Settings(method="none"))
    (note,) = (note for note in found.notes if note.name == "unsteady")
    assert 1.5 < note.effect < 2.7
    assert "noise in the band" in note.text
    truth = 1e-6 * gyro.angle_random_walk * np.sqrt(2.5)
    assert found.angle_random_walk.low < truth < found.angle_random_walk.high
