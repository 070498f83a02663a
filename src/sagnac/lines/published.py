"""Lines removed as the paper removes them: Steps 1 and 2."""

import math
from collections.abc import Callable
from typing import Final

import numpy as np

from sagnac.arrays import FloatArray
from sagnac.lines.model import Line, Removal, Scale
from sagnac.lines.orthogonal_search import OrthogonalSearch, fast_orthogonal_search
from sagnac.lines.taken_noise import TAKEN_BINS
from sagnac.table.turns import is_turning

# Candidates of Step 1 as published: whole orders up to this one.
_PUBLISHED_ORDERS: Final = 64


def remove_lines_as_published(
    angle: FloatArray,
    table: FloatArray | None,
    sample_rate: float,
    *,
    channel: str,
    progress: Callable[[float], None] | None = None,
) -> Removal:
    """Steps 1 and 2 of the paper to the letter, on one gyro.

    Fast orthogonal search over the whole orders of table angle, then over the multiples of
    one cycle per record to Nyquist, each with Korenberg's stop. Kept for reproduction and
    comparison: greed for mean square in an angle picks the random walk's own slow wander, and a
    fixed grid leaves most of a line that falls between its frequencies.

    Parameters
    ----------
    angle
        (samples,) rad.
    table
        (samples,) unwrapped table angle, rad; None at rest.
    sample_rate
        Hz.
    channel
        Name of the gyro.
    progress
        Told the share that is done.

    Raises
    ------
    ValueError
        If the arrays or the sample rate make no sense.

    References
    ----------
    Eqs. 17-20 of Yu et al. 2013.
    """
    if angle.ndim != 1 or angle.size < 2:
        raise ValueError(f"angle has shape {angle.shape}; give (samples,), 2 or more")
    if table is not None and table.shape != angle.shape:
        raise ValueError(
            f"table has shape {table.shape} and angle {angle.shape}; give one of each a sample"
        )
    if not (sample_rate > 0.0 and math.isfinite(sample_rate)):
        raise ValueError(f"sample_rate is {sample_rate!r}; give a positive number of Hz")
    report = progress or (lambda _: None)
    rest = angle
    in_angle: tuple[Line, ...] = ()
    if table is not None and is_turning(table):
        found = fast_orthogonal_search(table, rest, spacing=1.0, candidates=_PUBLISHED_ORDERS)
        rest = rest - found.series(table)
        in_angle = published_lines(found, "angle", 1.0, channel)
    report(0.3)
    time = np.arange(angle.size) / sample_rate
    duration = angle.size / sample_rate
    found = fast_orthogonal_search(
        time, rest, spacing=2.0 * np.pi / duration, candidates=max(1, angle.size // 2 - 1)
    )
    report(0.8)
    rest = rest - found.series(time)
    in_time = published_lines(found, "time", 1.0 / (2.0 * np.pi), channel)
    width = TAKEN_BINS / duration
    report(1.0)
    return Removal(
        residual=rest,
        lines=(*in_angle, *in_time),
        masked=tuple((line.frequency - width, line.frequency + width) for line in in_time),
        taken=np.empty((3, 0)),
        notes=(),
    )


def published_lines(
    found: OrthogonalSearch, scale: Scale, cycles: float, channel: str
) -> tuple[Line, ...]:
    """Terms of an orthogonal search as lines; it has no noise model, so no errors either.

    Parameters
    ----------
    found
        The search.
    scale
        Of its phase.
    cycles
        Turns the search's frequencies into cycles per turn, or into Hz.
    channel
        Name of the gyro.
    """
    drops = -np.diff(found.mean_square) / found.mean_square[1:]
    return tuple(
        Line(
            scale=scale,
            frequency=float(frequency * cycles),
            frequency_error=math.nan,
            amplitude=float(np.hypot(cosine, sine)),
            amplitude_error=math.nan,
            phase=float(np.arctan2(-sine, cosine)),
            phase_error=math.nan,
            significance=float(drop),
            channel=channel,
        )
        for frequency, cosine, sine, drop in zip(
            found.frequencies, found.cosine, found.sine, drops, strict=True
        )
    )
