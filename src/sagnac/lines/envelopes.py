"""A line in a baseband as a carrier under a spline envelope, with as many blocks as it asks for."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.linalg
from scipy.special import chdtri

from sagnac.arrays import BooleanArray, ComplexArray, FloatArray
from sagnac.lines.baseband import Baseband, SteadyLines, sum_of_tones
from sagnac.lines.splines import (
    Places,
    coefficients_of,
    normal_bands,
    places,
    spline_products,
    spline_values,
)

# Chance that a description with more parameters is taken where fewer would do.
_CHANCE: Final = 0.01
# The noise floor is known to some per cent, which for a thousand parameters is more than chance.
_FLOOR_ERROR: Final = 0.05
# Weight of a block in which the line was gone, as a share of the strongest: it has no phase.
_GONE: Final = 1e-9
# Parameters of a steady line: two of amplitude, one of frequency.
_OF_STEADY: Final = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Description:
    """Splines over `blocks` blocks fitted to a baseband, some steady lines left beside them.

    Attributes
    ----------
    base
        What they are fitted to.
    blocks
        That the record is cut into.
    coefficients, phase
        (blocks + 3,) of the envelope (complex, rad) and of the carrier's phase (rad).
    factor
        Banded Cholesky factor of the normal matrix.
    kept
        (lines,) bool, the steady lines beside it.
    cost, significance
        -2 log likelihood, and how much lower it is than without the line.
    parameters
        All told, those of the lines kept among them.

    Raises
    ------
    ValueError
        If the sizes do not agree.
    """

    base: Baseband
    blocks: int
    coefficients: ComplexArray
    phase: FloatArray
    factor: ComplexArray
    kept: BooleanArray
    cost: float
    significance: float
    parameters: int

    def __post_init__(self) -> None:
        size = coefficients_of(self.blocks)
        if not self.coefficients.shape == self.phase.shape == (size,):
            raise ValueError(
                f"coefficients and phase have shapes {self.coefficients.shape} and "
                f"{self.phase.shape}; {self.blocks} blocks have {size}"
            )

    def places(self) -> Places:
        """Places of the baseband's values in the blocks."""
        return places(self.base.middles, self.base.samples, self.blocks)

    def variance(self, gradient: ComplexArray) -> float:
        """Variance of a number whose change is the real part of gradient* times coefficients'."""
        solved = scipy.linalg.cho_solve_banded((self.factor, False), gradient)
        return self.base.variance * float(np.vdot(gradient, solved).real)

    def shown_by(self, base: Baseband) -> ComplexArray:
        """(values,) the line as another baseband shows it."""
        apart = self.base.frequency - base.frequency
        shown = _columns(base, self.blocks, self.phase, apart)
        return spline_values(shown.at, shown.rows, self.coefficients)


def best_description(base: Baseband, steady: SteadyLines, most: int) -> Description | None:
    """The description that no other with more parameters beats; None if it is steady lines.

    Parameters
    ----------
    base
        What is described.
    steady
        Steady lines fitted to it.
    most
        The largest number of blocks; powers of 2 up to it are tried.
    """
    numbers = [2**power for power in range(most.bit_length())]
    # What is left without the steady lines kept is the same for many a number of blocks.
    without: dict[bytes, ComplexArray] = {}

    def fitted(blocks: int, phase: FloatArray) -> Description:
        columns = _columns(base, blocks, phase, 0.0)
        kept = _beyond(base, steady, columns.turned, blocks)
        if kept.tobytes() not in without:
            others = sum_of_tones(base, steady.frequencies[kept], steady.amplitudes[kept])
            without[kept.tobytes()] = base.target - others
        return _fitted(base, columns, phase, kept, without[kept.tobytes()])

    found = [fitted(blocks, np.zeros(coefficients_of(blocks))) for blocks in numbers]
    plain = found[simplest([(one.parameters, one.cost) for one in found])]
    if plain.blocks > 1:
        followed = [blocks for blocks in numbers if blocks <= plain.blocks]
        found += [fitted(blocks, followed_phase(plain, blocks)) for blocks in followed]
    rivals = [(_OF_STEADY * steady.frequencies.size, steady.cost)]
    index = simplest(rivals + [(one.parameters, one.cost) for one in found])
    return None if index == 0 else found[index - 1]


def simplest(rivals: list[tuple[int, float]]) -> int:
    """Which (parameters, cost) no other with more parameters beats by more than chance."""
    order = sorted(range(len(rivals)), key=lambda index: rivals[index])
    best = order[0]
    for index in order[1:]:
        added = rivals[index][0] - rivals[best][0]
        gained = rivals[best][1] - rivals[index][1]
        chance = float(chdtri(added, _CHANCE / len(rivals))) if added else 0.0
        if gained > chance * (1.0 + _FLOOR_ERROR):
            best = index
    return best


def followed_phase(plain: Description, blocks: int) -> FloatArray:
    """(blocks + 3,) spline through the phase of an envelope, weighted by its power."""
    at = plain.places()
    envelope = spline_values(at, at.now, plain.coefficients)
    weight = np.abs(envelope)
    at = places(plain.base.middles, plain.base.samples, blocks)
    band = normal_bands(at, (weight[:, np.newaxis] * at.now).astype(np.complex128))
    band[-1] += _GONE * band[-1].real.max()
    phase = (weight * np.unwrap(np.angle(envelope))).astype(complex)
    right = spline_products(at, weight[:, np.newaxis] * at.now, phase)
    return np.asarray(scipy.linalg.solveh_banded(band, right).real)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Columns:
    """Columns of the splines of an envelope on a baseband.

    Attributes
    ----------
    at
        Places of the baseband's values.
    rows
        (values, 4) of the splines that reach there.
    turned
        (values,) phase that the carrier gains in a sample there, rad.
    """

    at: Places
    rows: ComplexArray
    turned: FloatArray


def _columns(base: Baseband, blocks: int, phase: FloatArray, apart: float) -> _Columns:
    """Columns about a carrier `apart`, cycles per sample, from the frequency of the baseband."""
    at = places(base.middles, base.samples, blocks)
    here, later = spline_values(at, at.now, phase), spline_values(at, at.after, phase)
    turned = later - here + 2.0 * np.pi * apart
    angle = here + 2.0 * np.pi * apart * (base.middles - base.center)
    # From the envelope of the angle to that of its increments, and to the mean over a length.
    lead = np.exp(2j * np.pi * base.frequency + 1j * turned)
    gain = np.sinc(base.length * turned / (2.0 * np.pi)) * np.exp(1j * angle)
    rows = gain[:, np.newaxis] * (lead[:, np.newaxis] * at.after - at.now)
    return _Columns(at=at, rows=rows, turned=turned)


def _beyond(base: Baseband, steady: SteadyLines, turned: FloatArray, blocks: int) -> BooleanArray:
    """(lines,) which steady lines lie beyond the band of an envelope over those blocks."""
    half = 0.5 * coefficients_of(blocks) / base.samples
    slow, fast = float(turned.min()) / (2.0 * np.pi), float(turned.max()) / (2.0 * np.pi)
    offset = steady.frequencies - base.frequency
    return np.asarray((offset < slow - half) | (offset > fast + half))


def _fitted(
    base: Baseband, columns: _Columns, phase: FloatArray, kept: BooleanArray, target: ComplexArray
) -> Description:
    """Least squares of the envelope on what is left of the baseband without the lines kept."""
    at, rows = columns.at, columns.rows
    factor = scipy.linalg.cholesky_banded(normal_bands(at, rows))
    coefficients = scipy.linalg.cho_solve_banded((factor, False), spline_products(at, rows, target))
    rest = target - spline_values(at, rows, coefficients)
    cost = float(np.vdot(rest, rest).real)
    return Description(
        base=base,
        blocks=at.blocks,
        coefficients=coefficients,
        phase=phase,
        factor=factor,
        kept=kept,
        cost=cost / base.variance,
        significance=(float(np.vdot(target, target).real) - cost) / base.variance,
        parameters=2 * coefficients_of(at.blocks) + _OF_STEADY * int(kept.sum()),
    )
