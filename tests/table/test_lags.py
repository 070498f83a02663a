"""Gyros read after one another on a table that hunts, ripples or turns back."""

import numpy as np
import pytest

from sagnac import Recording, analyze
from sagnac.table.lags import without_lags

_RATE = 100.0
_SHARES = 0.577, 0.575
_WALK = 0.003  # of each gyro, deg/sqrt(h)


def table_angle(time: np.ndarray, *, turns_back: bool) -> np.ndarray:
    """deg; 40 deg/s with gear ripple and a servo's hunting, or 30 deg/s to and fro."""
    ripple = 0.002 * np.sin(26.0 * time) + 0.001 * np.sin(19.0 * time + 5.0 * np.sin(0.3 * time))
    if not turns_back:
        return 40.0 * time + ripple
    # Each way takes a minute, each reversal about a second.
    rate = 30.0 * np.tanh(5.0 * np.sin(np.pi * time / 60.0) * 4.0)
    return np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))]) + ripple


def two_gyros(lag: float, *, turns_back: bool = False, seed: int = 1):
    """(deg, deg), deg: angles of two gyros of which the second is read late, and the encoder."""
    random, fine = np.random.default_rng(seed), 10
    # The table turns before the first sample and behind the last.
    time = np.arange(-fine * 100, 601 * 100 * fine) / (_RATE * fine)
    table, read = table_angle(time, turns_back=turns_back), np.arange(60_000) / _RATE
    gyros = []
    for share, late in zip(_SHARES, (0.0, lag), strict=True):
        seen = np.interp(read - late, time, table)
        noise = np.cumsum(random.normal(size=seen.size)) * _WALK / 60.0 / np.sqrt(_RATE)
        gyros.append(share * seen + noise)
    return gyros, np.interp(read, time, table) + 3e-5 * random.normal(size=read.size)


@pytest.mark.parametrize("turns_back", [False, True])
@pytest.mark.parametrize("lag", [1e-3, -0.4e-3, 6e-3])
def test_the_lag_of_a_gyro_is_found_and_its_motion_taken_back(lag, turns_back):
    gyros, encoder = two_gyros(lag, turns_back=turns_back)
    sound, _ = two_gyros(0.0, turns_back=turns_back)
    angles, (first, second) = without_lags(np.radians(gyros), np.radians(encoder), _RATE)
    assert first is None
    assert second.value == pytest.approx(lag, abs=max(5.0 * second.error, 1e-5))
    # What is left is what two gyros that are read at once leave.
    left, right = (
        np.diff((one[0] / _SHARES[0] - one[1] / _SHARES[1])[50:-50:5])
        for one in (angles, np.radians(sound))
    )
    assert np.std(left) == pytest.approx(np.std(right), rel=0.05)


@pytest.mark.parametrize("turns_back", [False, True])
def test_gyros_that_are_read_at_once_are_left_as_they_are(turns_back):
    gyros, encoder = two_gyros(0.0, turns_back=turns_back)
    angles, lags = without_lags(np.radians(gyros), np.radians(encoder), _RATE)
    assert lags == [None, None]
    assert all(
        np.array_equal(one, np.radians(other)) for one, other in zip(angles, gyros, strict=True)
    )


def test_orders_that_gyros_show_at_phases_of_their_own_are_no_lag():
    # On a table that turns evenly, nothing else tells the motion that a lag would move.
    angle = np.radians(59.4) * np.arange(16_000) / 50.0
    gyros = [
        angle + 1e-8 * np.cumsum(np.random.default_rng(seed).standard_normal(angle.size))
        + sum(
            size * part * np.cos(order * angle + phase)
            for order, size in ((6, 1e-5), (24, 3e-6), (36, 3e-6))
        )
        for seed, phase, part in ((1, 0.0, 1.0), (2, 0.6, 0.7))
    ]  # fmt: skip
    step = 2.0 * np.pi / 2**23
    assert without_lags(gyros, step * np.floor(angle / step), 50.0)[1] == [None, None]


@pytest.mark.parametrize("turns_back", [False, True])
def test_a_pair_keeps_its_interval_if_one_gyro_is_read_late(turns_back):
    """It was +-5 to 15 % on an even table, and a bound of many times N on one that turns back."""
    (x, z), encoder = two_gyros(1e-3, turns_back=turns_back, seed=3)
    recording = Recording.from_arrays(
        x=x, z=z, table=encoder, kind="angle", unit="deg", sample_rate=_RATE
    )
    analysis = analyze(recording)
    walk = analysis.angle_random_walk.to("deg/sqrt(h)")
    assert walk.status == "estimated"
    assert walk.low < _WALK < walk.high < 1.03 * _WALK
    (said,) = (note for note in analysis.notes if "shows the table's motion" in note.text)
    assert said.channel == "z"
    assert "after gyro x" in said.text
