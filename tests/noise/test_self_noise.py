"""Each of several gyros alone, from their cross spectra."""

from copy import deepcopy

import numpy as np
import pytest
from scipy.signal import csd, lfilter

import sagnac
from sagnac.core.errors import RecordingError

RATE = 10.0
NOISE = np.array([1.0, 1.5, 0.7])  # rad/s of a sample
LOUD = np.sqrt(1000.0)  # 30 dB


def motion(random, samples):
    """Slow motion 30 dB above noise of one."""
    moved = lfilter([1.0], [1.0, -0.9], random.standard_normal(samples))
    return LOUD * moved / moved.std()


def three(seed, samples=16_384, extra=0.0):
    """Parallel gyros, gains 2 % and axes 1 degree off; `extra` goes to gyro x."""
    random = np.random.default_rng(seed)
    gains = (1.0 + 0.02 * random.standard_normal(3)) * np.cos(np.deg2rad(1.0))
    values = np.outer(gains, motion(random, samples))
    values += NOISE[:, np.newaxis] * random.standard_normal((3, samples))
    values[0] += extra
    return recorded(values), gains


def recorded(values):
    names = [f"g{place}" for place in range(len(values))]
    if len(values) == 3:
        names = list("xyz")
    channels = dict(zip(names, values, strict=True))
    return sagnac.Recording.from_arrays(**channels, kind="rate", unit="rad/s", sample_rate=RATE)


def walks(found):
    return np.array([one.value for one in found.angle_random_walk.values()]) * np.sqrt(RATE)


def held(found, noise):
    limits = [(one.low, one.high) for one in found.angle_random_walk.values()]
    return [
        low < one / np.sqrt(RATE) < high for (low, high), one in zip(limits, noise, strict=True)
    ]


@pytest.mark.parametrize("seed", range(3))
def test_three_gyros_under_motion_a_thousand_times_their_noise(seed):
    recording, gains = three(seed)
    found = sagnac.self_noise(recording, band=(0.0, 5.0))
    assert walks(found) == pytest.approx(NOISE, rel=0.05)
    assert found.gains == pytest.approx(gains / gains.mean(), rel=2e-3)
    # One-sided density of white samples: 2 variance over the rate.
    told = np.where(np.isnan(found.density), 0.0, found.frequency)
    level = np.nansum(told * found.density, axis=1) / told.sum(axis=1)
    assert level == pytest.approx(2.0 * NOISE**2 / RATE, rel=0.15)
    inside = (found.low < 2.0 * NOISE[:, np.newaxis] ** 2 / RATE) & (
        found.high > 2.0 * NOISE[:, np.newaxis] ** 2 / RATE
    )
    assert inside[told > 0.0].mean() > 0.8
    assert found.motion[0] > 100.0 * np.nanmax(found.density[:, 0])


def test_it_is_what_sleemans_formula_gives():
    recording, _ = three(11)
    found = sagnac.self_noise(recording, band=(0.0, 5.0))
    assert deepcopy(found) == found != sagnac.self_noise(recording)
    rates = [gyro.values for gyro in recording.gyros]

    def cross(one, other):
        return csd(rates[one], rates[other], RATE, nperseg=256)[1][2:-2]

    plain = (cross(0, 0) - cross(1, 0) * cross(0, 2) / cross(1, 2)).real.mean()
    assert walks(found)[0] ** 2 * 2.0 / RATE == pytest.approx(plain, rel=0.06)


def test_a_line_of_one_gyro_is_kept_out():
    samples = 16_384
    line = 0.3 * np.sin(2.0 * np.pi * 1.7 / RATE * np.arange(samples))
    sound = sagnac.self_noise(three(5)[0], band=(0.0, 5.0))
    found = sagnac.self_noise(three(5, extra=line)[0], band=(0.0, 5.0))
    assert walks(found) == pytest.approx(walks(sound), rel=0.005)
    assert found.left_out.sum() > 0 == sound.left_out.sum()


def test_three_triads_about_three_axes():
    """Axes 1 degree off mix motions that are all 30 dB above the noise."""
    random = np.random.default_rng(2)
    samples = 16_384
    moved = np.array([motion(random, samples) for _ in range(3)])
    axes = np.concatenate([np.eye(3) + np.deg2rad(1.0) * random.standard_normal((3, 3))] * 3)
    axes += 0.02 * random.standard_normal(axes.shape)
    noise = np.tile(NOISE, 3)
    values = axes @ moved + noise[:, np.newaxis] * random.standard_normal((9, samples))
    found = sagnac.self_noise(recorded(values), motions=3, band=(0.0, 5.0))
    assert walks(found) == pytest.approx(noise, rel=0.06)
    assert found.gains.size == 0
    # As parallel gyros the first of each would be taken to have what the axes mix in.
    alone = sagnac.self_noise(recorded(values), gyros=["g0", "g3", "g6"], band=(0.0, 5.0))
    assert alone.density[:, 0].max() > 3.0 * found.density[0, 0]


@pytest.mark.parametrize("noise", [NOISE, np.array([1.0, 0.1, 0.3])], ids=["alike", "unlike"])
def test_gyros_that_share_nothing_have_all_that_they_show(noise):
    """A motion that is not there was fitted: every tenth gyro had no answer, every tenth missed."""
    holding = []
    for seed in range(40):
        random = np.random.default_rng([20, seed])
        still = recorded(noise[:, np.newaxis] * random.standard_normal((3, 8192)))
        found = sagnac.self_noise(still, band=(0.05, 4.5))
        assert {one.status for one in found.angle_random_walk.values()} == {"estimated"}
        assert walks(found) == pytest.approx(noise, rel=0.06)
        assert not np.isnan(found.density).any()
        holding += held(found, noise)
    # 95 %, less three standard errors.
    assert np.mean(holding) > 0.89


def test_what_cannot_be_told_apart_is_refused():
    recording, _ = three(1, samples=40)
    with pytest.raises(RecordingError, match="40 samples are too few for cross spectra"):
        sagnac.self_noise(recording)
    recording, _ = three(1)
    with pytest.raises(ValueError, match="give 3 or more for each of 1 motions"):
        sagnac.self_noise(recording, gyros=["x", "y"])
    with pytest.raises(ValueError, match="give 3 or more for each of 2 motions"):
        sagnac.self_noise(recording, motions=2)
    for band in ((2.0, 1.0), (2.0,), ("1", "2"), 3.0, (0.1, 500.0)):
        with pytest.raises(ValueError, match=r"band is .*; give two frequencies in Hz"):
            sagnac.self_noise(recording, band=band)
    for motions in (0, "1", 1.5, None, True):
        with pytest.raises(ValueError, match=r"motions is .*; give a whole number of 1 or more"):
            sagnac.self_noise(recording, motions=motions)
    for gyros in (3, "xyz", ["x", "y", "q"]):
        with pytest.raises(ValueError, match=r"gyros is .*; (give names, such|use one of x, y, z)"):
            sagnac.self_noise(recording, gyros=gyros)
    with pytest.raises(RecordingError, match="holds too little between"):
        sagnac.self_noise(recording, band=(1.0, 1.001))


def least_errors(samples):
    """Cramer-Rao bound of ln N of each gyro: the motion takes one of three directions.

    Under motion far above the noise the information on the logarithms of the densities is
    the squared projector, element by element, beside the motion as the noise sees it, once for each
    complex ordinate.
    """
    motion = 1.0 / NOISE / np.linalg.norm(1.0 / NOISE)
    information = (np.eye(3) - np.outer(motion, motion)) ** 2
    return 0.5 * np.sqrt(np.diag(np.linalg.inv(information)) / (samples / 2))


@pytest.mark.statistics
def test_intervals_hold_over_two_hundred_seeds():
    """Records of 55 minutes at 10 Hz."""
    samples = 2**15
    found = [sagnac.self_noise(three(seed, samples)[0], band=(0.0, 5.0)) for seed in range(200)]
    errors = np.array([walks(one) / NOISE - 1.0 for one in found])
    holding = np.mean([held(one, NOISE) for one in found])
    scatter = np.sqrt(np.mean(errors**2, axis=0))
    print(
        f"N within {100 * np.abs(errors).max():.1f} %, mean {100 * errors.mean():.2f} %, rms "
        f"{(100 * scatter).round(2).tolist()} %, at least "
        f"{(100 * least_errors(samples)).round(2).tolist()} %; "
        f"{100 * holding:.1f} % of 600 intervals hold"
    )
    assert np.abs(errors).max() < 0.05
    assert 0.93 <= holding <= 0.97
    # Two hundred seeds know a scatter to 5 %.
    assert np.all(scatter < 1.15 * least_errors(samples))
