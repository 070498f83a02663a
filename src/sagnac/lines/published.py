"""Lines removed as the paper removes them: Steps 1 and 2."""

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
    """
    report = progress or (lambda _: None)
    rest = angle
    lines: list[Line] = []
    if table is not None and is_turning(table):
        found = fast_orthogonal_search(table, rest, spacing=1.0, candidates=_PUBLISHED_ORDERS)
        rest = rest - found.series(table)
        lines += _published(found, "angle", 1.0, channel)
    report(0.3)
    duration = angle.size / sample_rate
    time = np.arange(angle.size) / sample_rate
    spacing = 2.0 * np.pi / duration
    found = fast_orthogonal_search(
        time, rest, spacing=spacing, candidates=max(1, angle.size // 2 - 1)
    )
    report(0.8)
    rest = rest - found.series(time)
    lines += _published(found, "time", 1.0 / (2.0 * np.pi), channel)
    width = TAKEN_BINS / duration
    masked = tuple(
        (line.frequency - width, line.frequency + width) for line in lines if line.scale == "time"
    )
    report(1.0)
    return Removal(
        residual=rest, lines=tuple(lines), masked=masked, taken=np.empty((3, 0)), notes=()
    )


def _published(found: OrthogonalSearch, scale: Scale, cycles: float, channel: str) -> list[Line]:
    """Terms of an orthogonal search as lines; it has no noise model, so no errors either."""
    drops = -np.diff(found.mean_square) / found.mean_square[1:]
    return [
        Line(
            scale=scale,
            frequency=float(frequency * cycles),
            frequency_error=float("nan"),
            amplitude=float(np.hypot(cosine, sine)),
            amplitude_error=float("nan"),
            phase=float(np.arctan2(-sine, cosine)),
            phase_error=float("nan"),
            significance=float(drop),
            channel=channel,
        )
        for frequency, cosine, sine, drop in zip(
            found.frequencies, found.cosine, found.sine, drops, strict=True
        )
    ]
