"""Whether the two gyros of a pair share noise, which their difference hides."""

from typing import Final

import numpy as np

from sagnac import series
from sagnac.analysis.averaged import Averaged
from sagnac.analysis.measurement import Measurement
from sagnac.analysis.removal import Remainder
from sagnac.coefficients.common_noise import Common, band_moments, common_noise
from sagnac.errors import Note
from sagnac.recording.kinds import angle_of
from sagnac.recording.model import Recording

# A correlation below this moves the answer by less than half a per cent.
_WORTH_A_NOTE: Final = 0.01
# Samples of each gyro that are looked at.
_MOST: Final = 2**21


def sharing_notes(
    recording: Recording, measured: Measurement, left: Remainder, found: Averaged
) -> tuple[Note, ...]:
    """What the cross spectrum of a pair at rest says over the band of N.

    On a turning table both gyros sense the table, and their cross spectrum is of that.

    Parameters
    ----------
    recording
        With both gyros.
    measured, left
        The difference, and what removal left of it.
    found
        The average, which says where N rules.
    """
    if measured.gyros_differenced == 1 or not found.average.rests_on.terms:
        return ()
    rate = recording.sample_rate
    increments = np.stack(
        [
            series.differences(angle_of(recording.gyro(name), rate)[: _MOST + 1])
            for name in measured.gyros
        ]
    )
    low, high = found.average.rests_on.band_hz
    try:
        moments = band_moments(
            increments,
            sample_rate=rate,
            band_hz=(low, min(high, 0.5 * rate)),
            masked=left.removal.masked,
        )
    except ValueError:
        # A band of lines alone.
        return ()
    common = common_noise(moments)
    return (_note(measured.channel, common),) if common.degrees_of_freedom > _LEAST else ()


# Degrees of freedom from which on a correlation says anything.
_LEAST: Final = 8.0


def _note(channel: str, common: Common) -> Note:
    said = f"correlation {common.correlation:+.2g} ({common.low:+.2g} to {common.high:+.2g})"
    if not common.present or abs(common.correlation) < _WORTH_A_NOTE:
        return Note(
            channel=channel, text=f"the two gyros share no noise in the band of the answer: {said}"
        )
    off = 100.0 * (common.differenced - 1.0)
    return Note(
        name="shared",
        effect=common.differenced,
        channel=channel,
        level="warning" if abs(off) >= 1.0 else "remark",
        text=f"the two gyros share noise in the band of the answer ({said}): the difference reads "
        f"{abs(off):.2g} % {'low' if off < 0.0 else 'high'} against the gyros themselves; "
        "see each alone ({gyros})",
    )
