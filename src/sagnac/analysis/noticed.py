"""Notes on what is in a record besides its noise, and on noise that changes."""

import math
from collections.abc import Sequence
from dataclasses import replace

from sagnac.analysis.averaged import Averaged
from sagnac.analysis.corrections import WarmUp
from sagnac.analysis.parts import Parts
from sagnac.coefficients.bounds import Hump, RollOff
from sagnac.coefficients.estimates import Estimate
from sagnac.coefficients.model_average import Elsewhere
from sagnac.coefficients.slow_model import MarkovEstimate
from sagnac.errors import Level, Note, counted, rounded
from sagnac.recording.spikes import Spikes
from sagnac.units import SENSED, UNITS, Sensor, field_unit

# Share of N from which on what spikes would add is worth a warning.
_ADDS: float = 0.05


def noticed(channel: str, found: Averaged, sensor: Sensor = "gyro") -> tuple[Note, ...]:
    """Notes of an average on its record.

    Parameters
    ----------
    channel
        ``x`` or ``x-z``.
    found
        The average.
    sensor
        What the channel is of, which says the units.
    """
    walk = found.average.angle_random_walk
    notes = (
        _spikes_note(found.cleaned.spikes, walk, sensor),
        _warm_up_note(found.cleaned.warm_up, sensor),
        _roll_off_note(found.roll_off),
        _hump_note(found.hump, sensor),
        _elsewhere_note(found.average.rests_on.elsewhere, walk, sensor),
        _parts_note(found.parts, sensor),
    )
    return tuple(replace(note, channel=channel) for note in notes if note)


def _shown(value: float, sensor: Sensor) -> str:
    """N in the unit of the field."""
    unit = field_unit("angle_random_walk", sensor)
    return f"{value / unit.size:.3g}"


def _spikes_note(spikes: Spikes | None, walk: Estimate, sensor: Sensor) -> Note | None:
    if spikes is None or spikes.index.size == 0:
        return None
    added = spikes.added_walk
    seen = walk.status == "estimated" and added > _ADDS * walk.value
    level: Level = "warning" if seen else "remark"
    return Note(
        name="spikes",
        effect=math.hypot(1.0, added / walk.value) if walk.status == "estimated" else None,
        level=level,
        text=f"{counted(int(spikes.index.size), 'sample')} far off their neighbours (spikes) "
        "were replaced by them for the answer; left in, they would add "
        f"{_shown(added, sensor)} {field_unit('angle_random_walk', sensor).symbol} to it in square",
    )


def _warm_up_note(warm_up: WarmUp | None, sensor: Sensor) -> Note | None:
    if warm_up is None:
        return None
    unit = UNITS[SENSED[sensor].rate_unit]
    return Note(
        name="warm-up",
        text=f"the rate settles by {warm_up.rate / unit.size:.3g} {unit} with a time "
        f"constant of {warm_up.time:.3g} s (warm-up): it was taken off for the answer, and stays "
        f"in the curve; {{slice {warm_up.until_s:.0f}:}} leaves it out, {{covariates temperature}} "
        "fits it if there is a column of temperature",
    )


def _roll_off_note(found: RollOff) -> Note | None:
    if not found.is_there:
        return None
    falls = (
        f"falls to half at {found.half:.3g} Hz"
        if math.isfinite(found.half)
        else f"falls beyond {found.frequency:.3g} Hz"
    )
    return Note(
        text=f"the spectrum {falls}, as behind a low-pass or a hump: cluster times below "
        f"{found.cluster_time():.3g} s bound nothing",
    )


def _hump_note(found: Hump | None, sensor: Sensor) -> Note | None:
    """The answer is read below a hump, behind which there is less."""
    if found is None:
        return None
    top, behind = _shown(found.walk, sensor), _shown(found.least, sensor)
    return Note(
        level="warning",
        text=f"the answer is read below a hump of {top} at {found.frequency:.3g} Hz, behind which "
        f"the spectrum falls to {behind} {field_unit('angle_random_walk', sensor).symbol} at "
        f"{found.behind:.3g} Hz: either the sensor has a low-pass there, or the motion that makes "
        "the hump (sway of the bench) is in the answer; a quieter stretch tells",
    )


def _elsewhere_note(found: Elsewhere | None, walk: Estimate, sensor: Sensor) -> Note | None:
    """Models of another N, which the interval spans."""
    if found is None or walk.status != "estimated":
        return None
    symbol = field_unit("angle_random_walk", sensor).symbol
    return Note(
        level="warning",
        text=f"the spectrum is level in more than one band: {rounded(100.0 * found.share)} % "
        f"of the weight reads another {SENSED[sensor].titles['angle_random_walk']}, most of it "
        f"{_shown(found.walk, sensor)} {symbol} at {found.low:.3g} to {found.high:.3g} Hz; the "
        "interval spans both",
    )


def _parts_note(parts: Parts | None, sensor: Sensor) -> Note | None:
    if parts is None or len(parts.seen) < 2:
        return None
    reach = (
        f"{len(parts.seen)} parts of the recording read {_shown(parts.smallest, sensor)} "
        f"to {_shown(parts.largest, sensor)} {field_unit('angle_random_walk', sensor).symbol}"
    )
    walk = SENSED[sensor].titles["angle_random_walk"]
    if parts.agree:
        return Note(text=f"the {walk} is steady: {reach}, as far apart as by chance")
    if parts.walks_agree:
        return Note(
            name="unsteady",
            effect=parts.spread,
            level="warning",
            text=f"the noise in the band of the {walk} changes: {reach}, which chance could do, "
            "but their spectra differ as if it were "
            f"{rounded(parts.spread, 3)} times as large in one as in another; the interval covers "
            "them",
        )
    apart = 100.0 * (parts.largest / parts.smallest - 1.0)
    return Note(
        name="unsteady",
        effect=parts.largest / parts.smallest,
        level="warning",
        text=f"the {walk} changes: {reach}, {rounded(apart)} % apart, more than by chance; "
        "the interval covers them",
    )


def markov_text(found: Sequence[MarkovEstimate], sensor: Sensor) -> str:
    """The Markov rates that describe slow noise where B and K are bounds at most."""
    unit = UNITS[SENSED[sensor].rate_unit]
    rate = "rate" if sensor == "gyro" else "acceleration"
    each = []
    for one in found:
        size, time = one.deviation, one.correlation_time
        each.append(
            f"a Markov {rate} of {size.value / unit.size:.3g} {unit.name} "
            f"({size.low / unit.size:.3g} to {size.high / unit.size:.3g}) with a correlation time "
            f"of {time.value:.3g} s ({time.low:.3g} to {time.high:.3g})"
        )
    describes = "describes it" if len(each) == 1 else "describe it together"
    return f"slow noise: {' and '.join(each)} {describes}; B and K are bounds"
