"""The angle encoder of the rig and its null pulse."""

import math
from dataclasses import dataclass
from typing import Final, Self

import numpy as np

from sagnac.arrays import BooleanArray, FloatArray
from sagnac.rig import _kernels
from sagnac.rig.sections import EncoderConfig
from sagnac.rig.streams import RandomStreams
from sagnac.rig.table import drawn_orders
from sagnac.units import ARCSECOND

_TURN: Final = 2.0 * math.pi
_NULL_MARGIN: Final = 8.0  # null errors that a passage keeps clear
_MOST_NULL_ERRORS: Final = 1_000_000  # then they come round again


@dataclass(slots=True, kw_only=True)
class Encoder:
    """The encoder: the true angle with graduation errors, rounded to its lines.

    Attributes
    ----------
    lines
        Steps in a turn.
    order
        (terms,) orders of the graduation error.
    in_phase, quadrature
        (1, terms) coefficients of its cosines and sines, rad.
    latch_jitter
        Rms time between its sample and the gyros', in sample intervals.
    before
        True table angle at the last sample, rad.
    random
        Stream of the latch.
    """

    lines: int
    order: FloatArray
    in_phase: FloatArray
    quadrature: FloatArray
    latch_jitter: float
    before: float
    random: np.random.Generator

    @classmethod
    def drawn(
        cls, config: EncoderConfig, origin: float, interval: float, streams: RandomStreams
    ) -> Self:
        """An encoder at table angle `origin`, whose graduation errors have drawn phases."""
        error = drawn_orders(config.periodic_error, streams.phases)
        return cls(
            lines=config.lines,
            order=error.order,
            in_phase=(error.size * np.cos(error.phase) * ARCSECOND)[np.newaxis],
            quadrature=(-error.size * np.sin(error.phase) * ARCSECOND)[np.newaxis],
            latch_jitter=config.latch_jitter_s / interval,
            before=origin,
            random=streams.latch,
        )

    def read(self, alpha: FloatArray) -> FloatArray:
        """Reading at the true table angles of the next samples, unwrapped, rad."""
        if self.latch_jitter > 0.0:
            turned = np.diff(alpha, prepend=self.before)
            self.before = float(alpha[-1])
            late = self.latch_jitter * self.random.standard_normal(alpha.size)
            alpha = alpha + turned * late
        graduation = np.zeros((1, alpha.size))
        _kernels.harmonics(alpha, self.order, self.in_phase, self.quadrature, graduation)
        line = _TURN / self.lines
        return np.asarray(np.rint((alpha + graduation[0]) / line) * line)


@dataclass(slots=True, kw_only=True)
class NullPulse:
    """The null pulse: each passage of the null has an error of its own.

    Attributes
    ----------
    errors
        (passages,) rad.
    margin
        How far from a null just passed the table is away from it, rad.
    state
        Of the last sample.
    """

    errors: FloatArray
    margin: float
    state: _kernels.NullState

    @classmethod
    def drawn(
        cls, config: EncoderConfig, origin: float, turned: float, random: np.random.Generator
    ) -> Self:
        """The null pulse at table angle `origin`, with errors for a way of `turned`, rad."""
        accuracy = config.null_accuracy_arcsec * ARCSECOND
        passages = min(1024 + 2 * math.ceil(turned / _TURN), _MOST_NULL_ERRORS)
        return cls(
            errors=accuracy * random.standard_normal(passages),
            margin=_NULL_MARGIN * accuracy,
            state=_kernels.NullState(float(math.floor(origin / _TURN)), 0, math.nan),
        )

    def advance(self, alpha: FloatArray) -> BooleanArray:
        """The pulse at the next samples: true at the first one past each null."""
        pulse = np.empty(alpha.size, dtype=np.bool_)
        self.state = _kernels.null_pulse(alpha, self.errors, self.margin, self.state, pulse)
        return pulse


def within_turn(reading: FloatArray, lines: int) -> FloatArray:
    """Encoder reading within one turn, [0, 2 pi), by its line count."""
    line = _TURN / lines
    return np.asarray(np.mod(np.rint(reading / line), lines) * line)
