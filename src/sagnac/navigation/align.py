"""Navigation with the noise of a unit: heading without aiding, and azimuth found."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from sagnac.core.documents import Documented, require_source
from sagnac.core.errors import as_several, is_finite, quoted, refusal, require_confidence
from sagnac.core.units import DEGREE
from sagnac.navigation import error_model as model
from sagnac.navigation.drift import Drift, drift
from sagnac.navigation.models import require_numbers
from sagnac.navigation.noise import GyroNoise, Triad

_LONGEST: Final = 1e10  # s unaided; no square of it overflows


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Unaided:
    """Errors without aiding, and of what gyros.

    Attributes
    ----------
    drift
        At the times that were asked for.
    along
        The same at many times, for a picture.
    noises
        Of the gyros about north, east and down.
    accelerometers
        Along north and east; none if they are taken as ideal.
    latitude
        rad.
    latitude_stated
        Whether it was stated.
    confidence
        Of the interval.
    """

    drift: Drift
    along: Drift
    noises: Triad
    accelerometers: tuple[GyroNoise, ...]
    latitude: float
    latitude_stated: bool
    confidence: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Prospect:
    """Heading found with a gyro of some noise.

    Attributes
    ----------
    noise, start
        Of each gyro, and before the alignment.
    latitude
        rad.
    compass
        Of a gyrocompass of two positions, against time; the last is at the end.
    filtered
        Azimuth in the course of an alignment by a Kalman filter.
    position
        After the alignment.
    rotating
        Of a triad that turns all the time, at the end; None if no table rate was given.
    foretold
        In words, from what N is foretold; empty if it was measured.
    """

    noise: GyroNoise
    start: model.Start
    latitude: float
    compass: model.AzimuthError
    filtered: model.Course
    position: model.Course
    rotating: model.AzimuthError | None = None
    foretold: str = ""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Foresight:
    """Answer of `align`.

    Attributes
    ----------
    unaided
        Heading, attitude and position without aiding.
    prospect
        Azimuth found at rest; None without a latitude.

    Examples
    --------
    >>> from sagnac.navigation.noise import GyroNoise
    >>> noise = GyroNoise(angle_random_walk=1e-6, bias_instability=0.0, rate_random_walk=0.0)
    >>> ahead = align((noise, noise, noise), latitude=0.8, after=[60.0, 600.0])
    >>> ahead.unaided.drift.heading.deviation().shape
    (2,)
    """

    unaided: Unaided
    prospect: Prospect | None

    def __repr__(self) -> str:
        drift = self.unaided.drift
        heading = drift.heading.deviation(misaligned=False) / DEGREE
        attitude = drift.attitude.deviation() / DEGREE
        parts = [
            f"after {time:g} s heading drift {heading[row]:.3g} deg, attitude "
            f"{attitude[row]:.3g} deg, position {drift.position.deviation()[row]:.3g} m"
            for row, time in enumerate(drift.heading.times)
        ]
        if self.prospect is not None:
            azimuth = self.prospect.compass.deviation[-1] / DEGREE
            seen = f"found to {azimuth:.3g} deg" if azimuth <= 180.0 else "not observable"
            parts.append(f"azimuth {seen} by a gyrocompass")
        return f"<Foresight, 1 sigma: {'; '.join(parts)}>"


def align(
    source: Documented | str | Path | Triad,
    *,
    latitude: float | None = None,
    rest: float = 600.0,
    azimuth: float | None = None,
    tilt: float | None = None,
    bias: float | None = None,
    table_rate: float | None = None,
    after: float | Sequence[float] = (60.0, 600.0, 3600.0),
    confidence: float = 0.95,
    foretold: str = "",
) -> Foresight:
    """Heading, attitude and position without aiding, and azimuth found, from N, B and K.

    Parameters
    ----------
    source
        An analysis; the path of its ``analysis.json`` or of the folder of its report; or the noises
        (`GyroNoise`) of gyros about north, east and down, with ideal accelerometers.
    latitude
        rad; without it no azimuth is found.
    rest
        Length of the alignment at rest, from which the biases are taken, s.
    azimuth, tilt
        Not known of azimuth and of each tilt at the start, 1 sigma, rad; 2 deg and 0.5 deg unless
        stated.
    bias
        Not known of a gyro's bias, 1 sigma, rad/s; unless stated what the rest leaves, and 0 for
        gyrocompass and filter.
    table_rate
        Of a table that turns all the time, rad/s, for a triad that turns; needs a latitude.
    after
        Times without aiding, s.
    confidence
        Of the intervals.
    foretold
        In words, from what N is foretold, if it was not measured.

    Raises
    ------
    RecordingError
        If the document cannot be read, or states no N.
    ValueError
        If a value cannot be.

    Examples
    --------
    >>> from sagnac.navigation.noise import GyroNoise
    >>> noise = GyroNoise(angle_random_walk=1e-6, bias_instability=0.0, rate_random_walk=0.0)
    >>> found = align((noise, noise, noise), bias=0.0, after=[100.0])
    >>> found.unaided.drift.heading.deviation(misaligned=False).round(7)
    array([1.e-05])
    """
    if table_rate is not None and latitude is None:
        raise refusal("table_rate", "needs a latitude, since azimuth is found from Earth rate")
    require_confidence(confidence)
    if not isinstance(foretold, str):
        raise refusal("foretold", f"is {quoted(foretold)}; give words")
    after = as_several(after)
    wrong = [time for time in after if not (is_finite(time) and 0.0 < time <= _LONGEST)]
    if wrong or not after:
        problem = f"give seconds, above zero, {_LONGEST:g} at most"
        raise refusal("after", f"is {quoted([*wrong, after][0])}; {problem}")
    if not isinstance(source, tuple):
        require_source(source)
        noises, forces = GyroNoise.unit(source)
    elif all(isinstance(one, GyroNoise) for one in source):
        noises, forces = source, ()
    else:
        remedy = "give one analysis of all gyros, or a GyroNoise each"
        raise refusal("source", f"is {quoted(source)}; {remedy}")
    stated = {"azimuth": azimuth, "tilt": tilt}
    known = {name: value for name, value in stated.items() if value is not None}
    start = model.Start(**known, rest=rest, bias=bias)
    require_numbers(start, known, above_zero=True)
    moments = np.array(after, dtype=np.float64)
    longest = float(moments.max())
    # A latitude counts little without aiding over minutes.
    place = 45.0 * DEGREE if latitude is None else latitude
    how: dict[str, Any] = {"accelerometers": forces, "latitude": place, "confidence": confidence}
    reached = drift(noises, times=moments, priors=start, **how)
    times, is_stated = np.geomspace(0.01 * longest, longest, 41), latitude is not None
    along = drift(noises, times=times, priors=start, **how)
    unaided = Unaided(drift=reached, along=along, noises=noises, latitude_stated=is_stated, **how)
    prospect = _prospect(unaided, start, longest, table_rate, foretold) if is_stated else None
    return Foresight(unaided=unaided, prospect=prospect)


def _prospect(
    unaided: Unaided, start: model.Start, longest: float, table_rate: float | None, foretold: str
) -> Prospect:
    """Azimuth found in the rest, and the position after it for the longest time."""
    # Which of them lies across the meridian is not known: azimuth is as good as with the loudest
    # over the rest. N alone does not tell: one of less N may have more B or K.
    latitude, rest = unaided.latitude, start.rest
    loudest = max(unaided.noises, key=lambda one: one.allan_variance(rest))
    how: dict[str, Any] = {"latitude": latitude, "confidence": unaided.confidence}
    turning = None
    if table_rate is not None:
        turned = {**how, "table_rate": table_rate, "bias": start.bias or 0.0}
        turned["times"] = np.array([rest])
        try:
            # Turning takes off what is slower than the table: another may be the loudest.
            errors = [model.rotating_azimuth_error(one, **turned) for one in unaided.noises]
            turning = max(errors, key=lambda one: float(one.deviation[-1]))
        except ValueError as error:
            raise ValueError(f"table rate: {error}") from None
    filtered = model.aligned(loudest, latitude=latitude, rest=rest, start=start)
    course = {"seconds": longest, "latitude": latitude}
    return Prospect(
        noise=loudest,
        start=start,
        latitude=latitude,
        compass=model.azimuth_error(loudest, times=np.geomspace(rest / 100.0, rest, 101), **how),
        filtered=filtered,
        position=model.position_error(loudest, covariance=filtered.covariance, **course),
        rotating=turning,
        foretold=foretold,
    )
