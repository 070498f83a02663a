"""Drifting lines against simulated truth: what is removed, what is left, and what is said of it."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.stats import chi2

from sagnac.core import arrays
from sagnac.lines.naming import taken_bands
from sagnac.lines.wandering import clusters, fit_drifting, values

SAMPLES = 75_000
RATE = 500.0
CENTER = 0.5 * (SAMPLES - 1)
NUMBER = np.arange(SAMPLES) - CENTER
PLACE = np.arange(SAMPLES) / SAMPLES


def slow(seed, cells):
    """A smooth random series of unit variance, some cycles a record fast."""
    grid = np.fft.rfftfreq(4096, 1.0 / 4096)
    drawn = np.fft.rfft(np.random.default_rng(seed).standard_normal(4096))
    drawn[0] = 0.0
    made = np.fft.irfft(drawn * np.exp(-((grid / cells) ** 2)), 4096)
    return np.interp(PLACE * 4095, np.arange(4096), made / made.std())


def envelope(kind, seed=0):
    """(samples,) complex amplitude of mean square near one."""
    if kind == "steady":
        return np.ones(SAMPLES, dtype=complex)
    if kind == "fading":
        return 1.0 - 0.3 * PLACE + 0j
    if kind == "swinging":
        return 1.0 + 0.3 * np.sin(2.0 * np.pi * 2.3 * PLACE) + 0j
    if kind == "breathing":
        return 1.0 + 0.15 * slow(seed, 8.0) + 0j
    if kind == "random walk":
        steps = np.random.default_rng(seed + 100).standard_normal(SAMPLES)
        return 1.0 + 0.3 * np.cumsum(steps) / np.sqrt(SAMPLES) + 0j
    assert kind == "wandering"
    return np.exp(2j * np.pi * np.cumsum(0.01 / RATE * slow(seed, 4.0)))


def made(kind, frequency, strength, seed=0):
    """Angle of a line whose chi-square in white increments of variance one is strength^2."""
    size = strength * np.sqrt(2.0 / SAMPLES) / (2.0 * np.sin(np.pi * frequency))
    return size * envelope(kind, seed) * np.exp(2j * np.pi * ((frequency * NUMBER) % 1.0))


def white(seed):
    return np.random.default_rng(seed).standard_normal(SAMPLES - 1)


def without(steps, frequencies):
    """Amplitudes of steady lines, by least squares on columns written out, and what they leave."""
    number = np.arange(steps.size + 1) - 0.5 * steps.size
    tones = np.exp(2j * np.pi * np.outer(number, frequencies))
    columns = np.diff(np.concatenate([tones.real, -tones.imag], axis=1), axis=0)
    solution = np.linalg.lstsq(columns, steps, rcond=None)[0]
    half = frequencies.size
    return solution[:half] + 1j * solution[half:], steps - columns @ solution


def highest(steps, frequency):
    """The highest peak within thirty cells, its amplitude, and what it leaves."""
    ordinates = np.abs(np.fft.rfft(steps, 4 * steps.size))
    places = np.arange(ordinates.size) / (4.0 * steps.size)
    ordinates[np.abs(places - frequency) * steps.size > 30.0] = 0.0
    lines = places[[np.argmax(ordinates)]]
    return lines, *without(steps, lines)


def drifting(steps, frequency, level=1.0):
    """The line at a frequency, once a search has taken out its highest peak."""
    lines, amplitudes, rest = highest(steps, frequency)
    return fit_drifting(rest, lines, amplitudes, level, center=0.5 * steps.size)


def left_in_band(found, steps):
    """Power of the residual at whole cycles a record within three of the band, and how many."""
    rest = steps - np.diff(values(found, 0, SAMPLES))
    power = np.abs(np.fft.rfft(rest)) ** 2 / rest.size
    low, high = np.array(found.band) * rest.size
    inside = slice(max(int(low) - 3, 1), min(int(high) + 4, power.size))
    return power[inside].sum(), power[inside].size


@pytest.mark.parametrize("frequency", [0.7 / RATE, 37.37 / RATE, 50.0 / RATE, 249.0 / RATE])
@pytest.mark.parametrize("strength", [30.0, 300.0, 3000.0])
def test_steady_line_is_none_of_ours(frequency, strength):
    steps = np.diff(made("steady", frequency, strength).real) + white(1)
    assert drifting(steps, frequency + 1.3 / SAMPLES) is None


@pytest.mark.parametrize("draws", [2, pytest.param(4, marks=pytest.mark.statistics)])
@pytest.mark.parametrize("kind", ["fading", "swinging", "random walk", "wandering"])
@pytest.mark.parametrize(
    ("frequency", "strength"),
    [(1.1 / RATE, 300.0), (50.0 / RATE, 300.0), (150.03 / RATE, 2000.0), (237.0 / RATE, 300.0)],
)
def test_only_the_noise_that_is_said_to_be_taken_is_taken(kind, frequency, strength, draws):
    left = expected = cells = beyond = taken = 0.0
    for seed in range(draws):
        angle = made(kind, frequency, strength, seed).real
        noise = white(seed)
        found = drifting(np.diff(angle) + noise, frequency)
        assert found is not None
        power, bins = left_in_band(found, np.diff(angle) + noise)
        left += power
        cells += bins
        expected += bins - 0.5 * found.parameters
        # The error of what was removed: a share of the noise for every parameter, and misfit.
        beyond += np.sum(np.diff(angle - values(found, 0, SAMPLES)) ** 2)
        taken += found.parameters
    if kind == "random walk":
        # Its side lines never end; those below the noise stay, and add up to some of it.
        assert left < cells + 3.5 * np.sqrt(cells)
    else:
        assert abs(left - expected) < 3.5 * np.sqrt(expected) + 0.05 * cells
        assert beyond < 1.3 * taken + 3.5 * np.sqrt(2.0 * taken)


@pytest.mark.parametrize("draws", [16, pytest.param(40, marks=pytest.mark.statistics)])
def test_errors_are_those_that_are_said(draws):
    frequency, knots, frequencies, amplitudes = 50.0 / RATE, [], [], []
    # Four pieces of cubics, with no turn: what four blocks can say exactly.
    pieces = CubicSpline(np.linspace(0.0, 1.0, 5), [1.0, 1.5, 0.9, 1.3, 1.1], bc_type="natural")
    unit = 2000.0 * np.sqrt(2.0 / SAMPLES) / (2.0 * np.sin(np.pi * frequency))
    turning = np.exp(2j * np.pi * frequency * NUMBER)
    angle = unit * pieces(PLACE) * turning
    rms = np.sqrt(np.mean(np.abs(angle) ** 2))
    for seed in range(draws):
        found = drifting(np.diff(angle.real) + white(seed), frequency)
        assert found is not None
        assert found.blocks == 4
        at = np.arange(5) * SAMPLES / 4.0
        carrier = np.exp(2j * np.pi * (found.carrier - frequency) * (at - CENTER))
        error = (found.knots - unit * pieces(at / SAMPLES) / carrier) / found.knot_errors
        # Every other one: neighbours share coefficients.
        knots += [*error.real[::2], *error.imag[::2]]
        frequencies.append((found.frequency - frequency) / found.frequency_error)
        amplitudes.append((found.amplitude - rms) / found.amplitude_error)
        assert found.drift == pytest.approx(np.std(np.abs(angle)) / rms, rel=0.01)
    # Six knots a draw. A sum of squares so far off has a chance of one in five hundred.
    for errors in (knots, frequencies, amplitudes):
        assert 1e-3 < chi2.sf(np.sum(np.square(errors)), len(errors)) < 1.0 - 1e-3


def test_frequency_that_wanders_takes_few_parameters():
    # Straight pieces would follow such a phase over thousands of blocks, not tens.
    frequency = 50.0 / RATE
    angle = made("wandering", frequency, 3000.0, seed=2).real
    found = drifting(np.diff(angle) + white(2), frequency)
    assert found is not None
    assert np.ptp(found.phase) > 0.0
    assert found.parameters < 150
    assert found.drift < 0.01
    assert found.band[0] < frequency - 0.01 / RATE < frequency + 0.01 / RATE < found.band[1]
    taken, bandwidth = taken_bands(found)
    assert np.sum(bandwidth) == pytest.approx(0.5 * found.parameters / SAMPLES)
    assert found.band[0] < taken.min() < frequency < taken.max() < found.band[1]


def thicket(steps, count):
    """The highest peaks of what the ones before leave, all fitted together."""
    lines = np.empty(0)
    rest = steps
    for _ in range(count):
        power = np.abs(np.fft.rfft(rest, 4 * SAMPLES))
        lines = np.append(lines, np.argmax(power) / (4.0 * SAMPLES))
        amplitudes, rest = without(steps, lines)
    return lines, amplitudes, rest


def test_thicket_of_steady_lines_is_one_that_drifts():
    frequency = 50.0 / RATE
    steps = np.diff(made("breathing", frequency, 300.0).real) + white(3)
    lines, amplitudes, rest = thicket(steps, 8)
    found = fit_drifting(rest, lines, amplitudes, 1.0, center=CENTER)
    direct = drifting(steps, frequency)
    assert found is not None
    assert direct is not None
    assert found.blocks == direct.blocks
    assert found.replaced.tolist() == list(range(8))
    assert found.amplitude == pytest.approx(direct.amplitude, rel=1e-3)
    assert direct.replaced.tolist() == [0]
    # Eight lines, three parameters each, leave more than it does.
    error = np.diff(values(found, 0, SAMPLES)) - (steps - rest)
    assert np.sum((rest - error) ** 2) < np.sum(rest**2) - 20.0


@pytest.mark.parametrize("cells", [[0.0, 2.0], [0.0, 2.0, -2.0], [0.0, 1.5, 7.3, -11.0]])
def test_steady_lines_close_together_stay_what_they_are(cells):
    lines = 50.0 / RATE + np.array(cells) / SAMPLES
    angle = sum(made("steady", one, 500.0) * np.exp(1j * one * 3e5) for one in lines).real
    amplitudes, rest = without(np.diff(angle) + white(4), lines)
    assert fit_drifting(rest, lines, amplitudes, 1.0, center=CENTER) is None


def test_steady_line_beyond_the_band_is_kept():
    frequency, other = 50.0 / RATE, 50.0 / RATE + 40.0 / SAMPLES
    angle = (made("fading", frequency, 1000.0) + made("steady", other, 300.0)).real
    lines = np.array([frequency, frequency + 1.5 / SAMPLES, frequency - 1.5 / SAMPLES, other])
    amplitudes, rest = without(np.diff(angle) + white(5), lines)
    found = fit_drifting(rest, lines, amplitudes, 1.0, center=CENTER)
    assert found is not None
    assert found.replaced.tolist() == [0, 1, 2]
    assert found.band[1] < other


def test_drifting_lines_beside_each_other_do_not_disturb():
    first, second = 50.0 / RATE, 50.0 / RATE + 400.0 / SAMPLES
    angles = [made("swinging", first, 300.0).real, made("fading", second, 300.0).real]
    steps = np.diff(angles[0] + angles[1]) + white(6)
    for frequency, angle in zip((first, second), angles, strict=True):
        found = drifting(steps, frequency)
        assert found is not None
        error = np.diff(angle - values(found, 0, SAMPLES))
        assert np.sum(error**2) < found.parameters + 4.0 * np.sqrt(2.0 * found.parameters)


def test_a_line_that_wanders_fast_is_followed_in_shorter_blocks():
    """The means of a first look allow 128 blocks."""
    wander = CubicSpline(np.linspace(0.0, 1.0, 151), np.random.default_rng(9).standard_normal(151))
    cycles = np.cumsum(0.1 + 2e-4 * wander(PLACE))
    angle = 3000.0 * np.sqrt(2.0 / SAMPLES) * np.cos(2.0 * np.pi * cycles)
    found = drifting(np.diff(angle) + white(7), float(np.mean(np.diff(cycles))))
    assert found is not None
    assert found.blocks > 128
    error = np.diff(angle - values(found, 0, SAMPLES))
    assert np.sum(error**2) < found.parameters + 4.0 * np.sqrt(2.0 * found.parameters)


@pytest.mark.parametrize("strength", [3000.0, 30000.0])
def test_a_floor_that_the_line_itself_has_raised_does_not_stop_its_description(strength):
    steps = np.diff(made("wandering", 50.0 / RATE, strength).real) + white(7)
    known, raised = (drifting(steps, 50.0 / RATE, level) for level in (1.0, 30.0))
    assert raised.blocks == known.blocks
    assert left_in_band(raised, steps)[0] == pytest.approx(left_in_band(known, steps)[0], rel=0.02)
    # Errors are those of the noise that there is.
    assert np.allclose(raised.knot_errors, known.knot_errors, rtol=0.1)


def test_increments_may_be_mapped_and_go_by_blocks(monkeypatch):
    frequency = 50.0 / RATE
    steps = np.diff(made("wandering", frequency, 300.0).real) + white(7)
    lines, amplitudes, rest = highest(steps, frequency)
    whole = fit_drifting(rest, lines, amplitudes, 1.0, center=CENTER)
    monkeypatch.setattr(arrays, "IN_MEMORY", 1000)
    monkeypatch.setattr(arrays, "BLOCK", 10_000)
    mapped = arrays.empty(steps.size)
    mapped[:] = rest
    assert arrays.is_mapped(mapped)
    found = fit_drifting(mapped, lines, amplitudes, 1.0, center=CENTER)
    assert whole is not None
    assert found is not None
    assert found.blocks == whole.blocks
    assert found.knots == pytest.approx(whole.knots, abs=1e-9 * whole.amplitude)
    assert mapped == pytest.approx(rest)
    pieces = [values(found, part.start, part.stop - part.start) for part in arrays.blocks(SAMPLES)]
    assert np.concatenate(pieces) == pytest.approx(
        values(found, 0, SAMPLES), abs=1e-9 * found.amplitude
    )


def test_clusters_are_three_or_more_within_thirty_cells():
    lines = np.array([900.0, 100.0, 112.0, 91.0, 130.0, 500.0, 502.0, 1500.0, 1529.0, 1558.0])
    strength = np.array([10.0, 50.0, 90.0, 70.0, 20.0, 80.0, 80.0, 30.0, 10.0, 20.0])
    found = clusters(lines / SAMPLES, strength, SAMPLES)
    assert [group.tolist() for group in found] == [[2, 3, 1, 4], [7, 9, 8]]
    assert clusters(np.empty(0), np.empty(0), SAMPLES) == []


def test_too_few_cycles_or_samples_are_no_line_to_follow():
    for steps, frequency in ((white(8), 1.5 / SAMPLES), (white(8)[:700], 0.1)):
        line = np.array([frequency]), np.array([1.0 + 0j])
        assert fit_drifting(steps, *line, 1.0, center=0.5 * steps.size) is None
