"""Times by which gyros on one table are read, or answer, after one another.

Channels that are sampled by turns, and low-passes whose corners are not quite alike, leave a part
of the table's rate in the difference of two gyros: its hunting, its ripple, and a step wherever it
speeds up or turns back.
"""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from sagnac.core.arrays import FloatArray, blocks, empty
from sagnac.table import estimate
from sagnac.table.estimate import FIRST_DELAY, SEEN, SHORTEST_DELAY, Shift
from sagnac.table.kinematics import averages_of
from sagnac.table.whitened import whitened

# Weights of the averages around one, of which its rate is: exact for polynomials of degree 6, as
# those of ``scipy.signal.savgol_filter``, whose import takes as long as the fit.
_AROUND: Final = np.array([1.0, -9.0, 45.0, 0.0, -45.0, 9.0, -1.0]) / 60.0


def without_lags(
    gyros: Sequence[FloatArray], encoder: FloatArray, sample_rate: float
) -> tuple[list[FloatArray], list[Shift | None]]:
    """Gyros with the table's motion at the instants of the first one.

    Only the motion is moved, so that the noise of each gyro stays as it is.

    Parameters
    ----------
    gyros
        (samples,) angle of each, rad.
    encoder
        (samples,) unwrapped table angle as read, rad.
    sample_rate
        Hz.

    Returns
    -------
    angles, lags
        Of each gyro; a gyro without a lag is as it was, and has None.
    """
    angles = list(gyros)
    lags: list[Shift | None] = [None] * len(gyros)
    for number in range(1, len(gyros)):
        # Averages that are looked at, from the start: first whether there is a lag, then how long
        # it is. Each pass knows the motion better than the one before.
        for most in (2**16, 2**18, 2**18):
            pair, known = [angles[0], angles[number]], lags[number]
            shares, lag = _lag(pair, encoder, sample_rate, most)
            if lag is None and known is None:
                break
            both = [one for one in (known, lag) if one is not None]
            total = Shift(sum(one.value for one in both), both[-1].error)
            lags[number] = total
            angles[number] = _moved(gyros[number], pair, shares, total.value, sample_rate)
    return angles, lags


def _lag(
    pair: list[FloatArray], encoder: FloatArray, sample_rate: float, most: int
) -> tuple[FloatArray, Shift | None]:
    """Shares of two gyros, and the lag of the second; None if none is seen in `most` averages.

    A gyro that comes later shows its share times the table's rate times the lag less. That is
    fitted beside what else tells two gyros on a table apart, as the delay of an encoder is.
    """
    # So many averages a second show how a servo hunts.
    block = max(1, round(sample_rate / 50.0))
    first, second, read = (averages_of(one[: most * block], block) for one in (*pair, encoder))
    coarse = np.stack([first, second])
    shares, _ = estimate.shares_of_table(coarse, read, max(1, round(sample_rate / block)))
    # Below this share of the table's rate a gyro tells no lag of its own.
    if read.size < 10 * _AROUND.size or not np.abs(shares).min() > 0.05:
        return shares, None
    interval = block / sample_rate
    sensed = shares @ coarse / float(shares @ shares)
    columns, prior = estimate.columns_beside_delay(read, sensed, interval)
    columns[FIRST_DELAY, 3:-3] = np.convolve(sensed, _AROUND / interval, mode="valid")
    # A lag does not change. The rates at both ends are of fewer averages and follow no ripple.
    columns, prior = columns[: FIRST_DELAY + 1, 3:-3], prior[: FIRST_DELAY + 1]
    fit = whitened((second / shares[1] - first / shares[0])[3:-3], columns, prior)
    lag = Shift(-float(fit.values[-1]), math.sqrt(float(fit.covariance[-1, -1])))
    return shares, lag if abs(lag.value) > max(SEEN * lag.error, SHORTEST_DELAY) else None


def _moved(
    angle: FloatArray, pair: list[FloatArray], shares: FloatArray, lag: float, sample_rate: float
) -> FloatArray:
    """(samples,) of a gyro, with the table's motion in it earlier by its lag.

    The motion is what two gyros sense together. It is taken at two times by cubic convolution
    (Keys, 1981), which lets motion through and less of the noise that is faster.
    """
    # The motion to be moved is made of 100 samples a second: what lies above is noise of the gyros.
    step, late = max(1, round(sample_rate / 100.0)), lag * sample_rate
    reach = 2 * step + math.ceil(abs(late))
    places = np.arange(-reach, reach + 1.0)
    # Convolution turns the kernel round: place k takes the sample k before.
    kernel = (_keys(places / step) - _keys((places - late) / step)) * shares[1] / step
    weights = shares / float(shares @ shares)
    result = empty(angle.size)
    for block in blocks(angle.size):
        start, stop = max(0, block.start - reach), min(angle.size, block.stop + reach)
        sensed = weights[0] * pair[0][start:stop] + weights[1] * pair[1][start:stop]
        beside = (reach - (block.start - start), reach - (stop - block.stop))
        # At its ends the table goes on as it turned before.
        known = np.pad(sensed - sensed[0], beside, mode="reflect", reflect_type="odd")
        np.add(angle[block], np.convolve(known, kernel, mode="valid"), out=result[block])
    return result


def _keys(place: FloatArray) -> FloatArray:
    """Kernel of cubic convolution, exact for parabolas; zero two places away."""
    far = np.abs(place)
    near, beyond = (1.5 * far - 2.5) * far**2 + 1.0, ((-0.5 * far + 2.5) * far - 4.0) * far + 2.0
    return np.where(far < 1.0, near, np.where(far < 2.0, beyond, 0.0))
