"""Tapered spectra: the power that leaks from a strong line stays beside it."""

from typing import Final

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.spectrum.transforms import power_spectrum, transform_length

_TAPERS: Final = 5


def multitaper(increments: FloatArray, tapers: int = _TAPERS) -> FloatArray:
    """Power of the increments at the frequencies of `periodogram`, averaged over sine tapers.

    Riedel and Sidorenko (1995). The leakage of a periodogram falls as f^-2, no faster than a
    rate random walk does; that of the tapers falls as f^-4. Each ordinate has twice `tapers`
    degrees of freedom, and resolves (tapers + 1) / (2 size) cycles a sample either side.

    Parameters
    ----------
    increments
        (samples,), without their mean.
    tapers
        How many, from 1.

    Returns
    -------
    (transform_length(size) // 2 + 1,) in the unit of `increments` squared.

    Raises
    ------
    ValueError
        If `tapers` is less than 1.
    """
    if tapers < 1:
        raise ValueError(f"tapers is {tapers}; give a number from 1")
    length = transform_length(increments.size)
    # The squares of a sine taper sum to half of size + 1.
    scale = 2.0 / ((increments.size + 1) * tapers)
    power = power_spectrum(increments, length, scale, 1)
    for order in range(2, tapers + 1):
        more = power_spectrum(increments, length, scale, order)
        _add(power, more)
    return power


def _add(power: FloatArray, more: FloatArray) -> None:
    def add(block: slice) -> None:
        power[block] += more[block]

    series.map(add, power.size, power, more)
