"""One gyro on a turning table: what of its noise may be the encoder's.

Nothing but the encoder tells the motion of the table from the noise of one gyro, so the encoder's
own wander counts as the gyro's. A second gyro on the table gives it away: both show the same. And
the two together, each weighted by the other's share, hold no table at all: what is left bounds the
noise of either.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

from sagnac.analysis.headline import Headline
from sagnac.analysis.measurement import Measurement
from sagnac.analysis.sharing import shared_walk
from sagnac.analysis.table_angle import TurningTable
from sagnac.coefficients.estimates import Estimate
from sagnac.errors import Note
from sagnac.recording.encoder_faults import LEAST_SHARE, table_share
from sagnac.recording.model import Recording
from sagnac.table.turns import mean_rate

# Rms s by which the time of an encoder's readings may wander unseen in half an hour.
_WANDERS: Final = 100e-6

WANDER: Final = _WANDERS / math.sqrt(1800.0)
"""Random walk that the time of an encoder's readings may have unseen, s/sqrt(s)."""

# Part of N that it may make up in an estimate.
_UNSEEN: Final = 0.3


@dataclass(frozen=True, slots=True, kw_only=True)
class OneGyro:
    """The answer of one gyro, and whether what is left of it is the encoder's rather than its own.

    Attributes
    ----------
    headline
        With the interval or the bound that the encoder leaves.
    by_encoder
        Whether the encoder decides it.
    """

    headline: Headline
    by_encoder: bool


def answer_of_one(
    headline: Headline,
    measured: Measurement,
    recording: Recording,
    table: TurningTable,
    *,
    masked: Sequence[tuple[float, float]],
    levels: Estimate | None,
    pair: Callable[[str], Estimate],
    doubted: bool = False,
) -> OneGyro:
    """The answer of one gyro with what its encoder may have added.

    Parameters
    ----------
    headline
        Of the gyro with the encoder's readings taken off.
    measured, recording, table
        The gyro, its recording and the table.
    masked
        (low, high) bands of its lines, Hz.
    levels
        What the levels of its spectrum say of it; None if they are not to be trusted.
    pair
        Angle random walk per gyro of this gyro and another one, by that one's name.
    doubted
        Whether a finding says that the encoder errs by more than noise.
    """
    other = _other(measured, recording)
    if other is None:
        return _lone(headline, measured, table, levels, doubted=doubted)
    two = pair(other)
    if two.status == "not observable":
        return _lone(headline, measured, table, levels, doubted=doubted)
    own, shown = headline.estimate, math.sqrt(2.0) * two.high
    shared = shared_walk(
        recording, (measured.gyros[0], other), table, masked=masked, confidence=own.confidence
    )
    if own.status == "estimated" and own.low < shown and shared and not shared.is_present:
        low = math.sqrt(max(own.low**2 - max(shared.high, 0.0), 0.0))
        if low > 0.0:
            return OneGyro(
                headline=replace(headline, estimate=replace(own, low=low)), by_encoder=False
            )
    # All of what the two hold may be the noise of one, whose weight is one within their shares.
    high = shown if own.status == "not observable" else min(shown, own.high)
    bound = replace(own, value=high, low=0.0, high=high, status="upper bound")
    name = measured.gyros[0]
    seen = shared is not None and shared.low > 0.0
    why = f"{other} shows the same wander" if seen else "it hides the gyro's noise"
    note = Note(
        channel=name,
        level="warning",
        text=f"the encoder decides what {name} alone can show: {why}; the "
        f"bound is of {name} and {other} together, which take the table out by "
        "themselves (name both with {gyros})",
    )
    source = f"{name} and {other} together, all of whose noise may be that of {name}"
    return OneGyro(
        headline=Headline(estimate=bound, source=source, notes=(*headline.notes, note)),
        by_encoder=True,
    )


def _other(measured: Measurement, recording: Recording) -> str | None:
    """Another gyro that senses the table, the first there is."""
    for gyro in recording.gyros:
        if gyro.name not in measured.gyros and abs(table_share(recording, gyro)) > LEAST_SHARE:
            return gyro.name
    return None


def _lone(
    headline: Headline,
    measured: Measurement,
    table: TurningTable,
    levels: Estimate | None,
    *,
    doubted: bool,
) -> OneGyro:
    """Without a second gyro: the wander that no one sees is part of the answer."""
    own = headline.estimate
    lowest = levels if levels is not None and levels.status == "upper bound" else own
    if own.status == "upper bound" and lowest.value < own.value:
        # The curve is of points, in each of which the noise of a reading stands in full.
        source = f"the spectrum of {measured.channel} below its roll-off"
        headline = replace(headline, estimate=lowest, source=source)
    own, name = headline.estimate, measured.gyros[0]
    known, estimate = table.known, table.estimate
    if known is None or estimate is None:
        return OneGyro(headline=headline, by_encoder=False)
    if own.status != "estimated":
        if not estimate.smoothed:
            return OneGyro(headline=headline, by_encoder=False)
        note = Note(
            channel=name,
            level="warning",
            text=f"the encoder decides what {name} can show: its noise lies above the gyro's, and "
            "no second gyro on the table takes it out; record one, or latch the encoder with the "
            "gyros",
        )
        return OneGyro(headline=replace(headline, notes=(*headline.notes, note)), by_encoder=True)
    if doubted:
        bound = replace(own, value=own.high, low=0.0, status="upper bound")
        return OneGyro(headline=replace(headline, estimate=bound), by_encoder=True)
    unseen = abs(table.shares[name] * mean_rate(known, measured.sample_rate)) * WANDER
    if unseen < _UNSEEN * own.low:
        low = math.sqrt(own.low**2 - unseen**2)
        return OneGyro(headline=replace(headline, estimate=replace(own, low=low)), by_encoder=False)
    bound = replace(own, value=own.high, low=0.0, status="upper bound")
    note = Note(
        channel=name,
        level="warning",
        text=f"what {name} shows beside the encoder may be the encoder's: readings whose time "
        f"wanders by {1e6 * _WANDERS:g} us in half an hour make as much, and no second gyro on the "
        "table tells; "
        f"only an upper bound is given (if the encoder adds nothing, {name} has "
        f"{own.to('deg/sqrt(h)')})",
    )
    return OneGyro(
        headline=replace(headline, estimate=bound, notes=(*headline.notes, note)), by_encoder=True
    )
