"""The measurement: one gyro or the difference of two, its table, and its lines taken out."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Final

import numpy as np

from sagnac.analysis.settings import Method, Settings
from sagnac.core.arrays import BooleanArray, FloatArray, blocks, elementwise, extent
from sagnac.core.errors import Note, RecordingError, rounded
from sagnac.core.units import ARCSECOND
from sagnac.lines.model import Removal
from sagnac.lines.published import LITERAL, remove_lines_as_published
from sagnac.lines.search import remove_lines, without_lines
from sagnac.quality.encoder import require_encoder_follows
from sagnac.quality.profile import Profile
from sagnac.quality.samples import missing_notes, stamp_notes, stuck_notes
from sagnac.recording.channel import PAIR_SIZE, angle_of
from sagnac.recording.model import Recording
from sagnac.table.estimate import EstimatedTable, estimated_table, order_drift
from sagnac.table.kinematics import KINEMATIC_RATE, averages_of
from sagnac.table.turns import SHORTEST, full_rotation_samples, is_turning, mean_rate

ALIKE: Final = (0.9, 1.1)
"""Weights of a pair that take the table out of it, between which they stand for its difference."""

# Part of the pair's increments by which the encoder has to raise them for weights far from one.
_QUIETER: Final = 0.9
# Change of a delay that is worth a note, s. What interpolation does between slow readings is less.
_CHANGES: Final = 1e-4
# Standard errors of it from which on it is no chance.
_SURE: Final = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Measurement:
    """The angle that an analysis is of.

    Attributes
    ----------
    channel
        ``x`` or ``x-z``.
    angle
        (samples,) rad; of two gyros their difference, in which its lines are sought. The noise of
        one gyro is that over `size`: each squared coefficient is then the mean of the two gyros'.
    gyros
        One name, or the two that are differenced.
    sample_rate
        Hz.
    weights
        Of the two gyros of a difference, the second as a rule below zero; their squares add up
        to 2.
    """

    channel: str
    angle: FloatArray
    gyros: tuple[str, ...]
    sample_rate: float
    weights: tuple[float, float] = (1.0, -1.0)

    @property
    def is_pair(self) -> bool:
        """Whether it is the difference of two gyros."""
        return len(self.gyros) > 1

    @property
    def size(self) -> float:
        """Size of its noise over that of one gyro."""
        return PAIR_SIZE if self.is_pair else 1.0

    @property
    def weighs_alike(self) -> bool:
        """Whether its two gyros take the table out by weights near one, whatever the encoder."""
        return self.is_pair and all(ALIKE[0] < abs(weight) < ALIKE[1] for weight in self.weights)

    def noise(self, angle: FloatArray) -> FloatArray:
        """Its angle, or what is left of it, with the noise of one gyro."""
        return elementwise(np.divide, angle, PAIR_SIZE) if self.is_pair else angle

    def share(self, shares: Mapping[str, float]) -> float:
        """Share of the table's rate in the angle, from the shares of the gyros."""
        of_gyros = zip(self.gyros, self.weights, strict=False)
        return float(sum(weight * shares.get(name, 0.0) for name, weight in of_gyros))


def measure(recording: Recording, gyros: tuple[str, ...]) -> Measurement:
    """The angle of one gyro, or of the first less the last of several.

    Parameters
    ----------
    recording
        Has these gyros.
    gyros
        One to three names.

    Raises
    ------
    RecordingError
        If the recording lacks one of them.
    """
    rate = recording.sample_rate
    angle, names = angle_of(recording.gyro(gyros[0]), rate), gyros[:1]
    if len(gyros) > 1:
        names = (gyros[0], gyros[-1])
        angle = elementwise(np.subtract, angle, angle_of(recording.gyro(gyros[-1]), rate))
    return Measurement(channel="-".join(names), angle=angle, gyros=names, sample_rate=rate)


def require_sound(recording: Recording, gyros: tuple[str, ...]) -> None:
    """Refuse a gyro with missing samples, or one that is stuck, and stamps that are no times.

    Raises
    ------
    RecordingError
        For the first of them.
    """
    profiles = [Profile.of(recording, recording.gyro(name)) for name in gyros]
    for note in stamp_notes(recording, profiles[0]):
        if note.level == "error":
            raise RecordingError.of(note)
    for profile in profiles:
        for note in (*missing_notes(recording, profile), *stuck_notes(recording, profile)):
            raise RecordingError.of(note)


def require_noise(measured: Measurement) -> None:
    """Refuse a measurement whose rate is a straight line to the last place of its numbers.

    Raises
    ------
    RecordingError
        If there is no noise in it, as in the difference of two copies of one gyro, or in a column
        of times that is read as a rate.
    """
    angle = measured.angle
    # A rate that bends by fewer units of the last place is rounding.
    rounding = 64.0 * float(np.spacing(max(map(abs, extent(angle)))))
    lowest, highest = math.inf, -math.inf
    for block in blocks(angle.size - 2):
        bent = np.diff(angle[block.start : block.stop + 2], n=2)
        lowest, highest = min(lowest, bent.min()), max(highest, bent.max())
        if highest - lowest > rounding:
            return
    what = "the two gyros turn alike" if measured.is_pair else "its rate is even, or a ramp"
    problem = f"holds no noise: {what} to the last place of the numbers"
    remedy = "name other gyros with {gyros} or {columns}"
    raise RecordingError(problem, channel=measured.channel, remedy=remedy)


# ---- the table ---------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class TurningTable:
    """The table as an analysis uses it.

    Attributes
    ----------
    angle
        (samples,) as read, unwrapped, rad; None where nothing turns.
    estimate
        What gyros and encoder together say of it; None for a method that takes readings as they
        are.
    shares
        Gyro -> its share of the table's rate, as in `estimate`.
    notes
        On the encoder.
    """

    angle: FloatArray | None
    estimate: EstimatedTable | None = None
    shares: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[Note, ...] = ()

    @property
    def known(self) -> FloatArray | None:
        """(samples,) the best angle there is, rad."""
        return self.angle if self.estimate is None else self.estimate.angle

    @property
    def readings(self) -> FloatArray | None:
        """(samples,) as read, a delay taken out, rad."""
        return self.angle if self.estimate is None else self.estimate.readings


def turning_table(recording: Recording, gyros: tuple[str, ...], method: Method) -> TurningTable:
    """The table angle, if there is a table and it turns.

    Raises
    ------
    RecordingError
        If the encoder does not follow the gyros, or the recording is too short to tell its motion
        from their noise.
    """
    if recording.table is None:
        return TurningTable(angle=None)
    table, rate = recording.table.values, recording.sample_rate
    if not is_turning(table):
        note = Note(text="the table does not turn: its angle is not used")
        return TurningTable(angle=None, notes=(note,))
    if method == "fos" and recording.duration < SHORTEST:
        short = f"{recording.duration:.4g} s of a turning table do not tell its motion"
        remedy = f"take {SHORTEST:g} s or more, or the standing part ({{slice}})"
        raise RecordingError(f"{short} from the gyro's noise", remedy=remedy)
    for name in gyros:
        require_encoder_follows(recording, recording.gyro(name))
    if method != "fos":
        return TurningTable(angle=table)
    angles = [angle_of(recording.gyro(name), rate) for name in gyros]
    estimate = estimated_table(angles, table, rate)
    shares = dict(zip(gyros, estimate.shares.tolist(), strict=True))
    notes = _encoder_notes(estimate, rate)
    return TurningTable(angle=table, estimate=estimate, shares=shares, notes=notes)


def _encoder_notes(estimate: EstimatedTable, sample_rate: float) -> tuple[Note, ...]:
    """Notes on the encoder's readings beside the gyros."""
    texts, delay = [], estimate.delay
    if delay is not None:
        late = f"{1e3 * abs(delay.mean):.4g} ms (± {1e3 * delay.mean_error:.1g} ms)"
        text = f"its readings come {late} {'after' if delay.mean > 0.0 else 'before'} the gyros'"
        if abs(delay.change) > max(_SURE * delay.change_error, _CHANGES):
            change = f"{1e3 * abs(delay.change):.4g} ms (± {1e3 * delay.change_error:.1g} ms)"
            later = "later" if delay.change > 0.0 else "earlier"
            text += f" on average, at the end {change} {later} than at the start"
        texts.append(f"{text}; they are shifted by that")
    # Less is not worth a note.
    if estimate.smoothed and estimate.noise > ARCSECOND:
        # The root mean square rate: the table may turn back or stand.
        block = max(1, round(sample_rate / KINEMATIC_RATE))
        turned = np.diff(averages_of(estimate.angle, block))
        rate = float(np.sqrt(np.mean(turned**2))) * sample_rate / block
        jitter = estimate.noise / max(rate, 1e-12)
        scatter = f"its readings scatter by {rounded(estimate.noise / ARCSECOND, 3)} arcsec rms"
        latched = f"as if latched {rounded(1e6 * jitter, 3)} us rms beside them"
        above = f"above {estimate.corner:.2g} Hz the angle is taken from the gyros"
        texts.append(f"{scatter} about the angle that the gyros sense, {latched}; {above}")
    return tuple(Note(channel="table", text=text) for text in texts)


def with_order_phases(table: TurningTable, measured: Measurement) -> TurningTable:
    """The table with the phases that the orders of what is measured keep.

    Parameters
    ----------
    table
        As `turning_table` gives it.
    measured
        As `without_encoder_errors` gives it.
    """
    if table.estimate is None:
        return table
    share = measured.share(table.shares)
    drift = order_drift(table.estimate, measured.angle, measured.sample_rate, share=share)
    if drift is None:
        return table
    led = replace(table, estimate=table.estimate.with_drift(drift))
    rate = mean_rate(table.estimate.angle, measured.sample_rate)
    # A delay that was fitted has a change of its own, with an error that the orders undo.
    fitted = 0.0 if table.estimate.delay is None else table.estimate.delay.change
    change, error = fitted + drift.value / rate, drift.error / abs(rate)
    if fitted and abs(change) < max(_SURE * error, _CHANGES):
        return led
    size, spread = -change * rate / ARCSECOND, rounded(drift.error / ARCSECOND, 1)
    off = f"its angle runs off by {size:+.4g} arcsec (± {spread} arcsec) over the record"
    delay = f"against what repeats with it, as if its delay changed by {1e3 * change:.3g} ms"
    note = Note(channel="table", text=f"{off} {delay}; the angle is brought to that")
    return replace(led, notes=(*table.notes, note))


def without_encoder_errors(
    measured: Measurement, recording: Recording, table: TurningTable
) -> Measurement:
    """The measurement without what the encoder's readings say beside the estimated angle.

    Two gyros take the table out by themselves: each is weighted by the other's share, so that
    no error of the encoder is left. One gyro alone has the readings taken off, since
    nothing else tells its own noise from the table's motion.

    Parameters
    ----------
    measured
        One gyro or a difference.
    recording
        With the gyros.
    table
        As `turning_table` gives it.
    """
    estimate = table.estimate
    if estimate is None:
        return measured
    if measured.is_pair:
        first, second = weights = _weights([table.shares[name] for name in measured.gyros])
        angles = [angle_of(recording.gyro(name), measured.sample_rate) for name in measured.gyros]
        angle = elementwise(lambda one, other: first * one + second * other, *angles)
        alone = replace(measured, angle=angle, weights=weights)
        if _takes_table_out(alone, measured, table, estimate):
            return alone
    if estimate.angle is estimate.readings:
        return measured
    share = measured.share(table.shares)
    three = measured.angle, estimate.readings, estimate.angle
    own = elementwise(lambda angle, read, known: angle - share * (read - known), *three)
    return replace(measured, angle=own)


def _weights(shares: Sequence[float]) -> tuple[float, float]:
    """Weights of two gyros that leave no motion of the table; their squares add up to 2."""
    size = math.hypot(*shares)
    if size == 0.0:
        return 1.0, -1.0
    sign = math.copysign(PAIR_SIZE, shares[1])
    return sign * shares[1] / size, -sign * shares[0] / size


def _takes_table_out(
    alone: Measurement, measured: Measurement, table: TurningTable, estimate: EstimatedTable
) -> bool:
    """Whether two gyros weighted so `alone` tell more than their difference and the encoder."""
    # From a tenth of motion that two gyros do not share, no weights take it out.
    if estimate.alike >= 0.1:
        return False
    if alone.weighs_alike:
        return True
    share = measured.share(table.shares)
    both = measured.angle, estimate.readings
    by_encoder = elementwise(lambda angle, readings: angle - share * readings, *both)
    block = max(1, round(measured.sample_rate / KINEMATIC_RATE))
    slow = _step(averages_of(alone.angle, block)) < _QUIETER * _step(averages_of(by_encoder, block))
    return slow or _step(alone.angle) < _QUIETER * _step(by_encoder)


def _step(angle: FloatArray) -> float:
    """Rms change from increment to increment, rad, in which Earth rate and drift are little."""
    total = 0.0
    for block in blocks(angle.size - 2):
        changes = np.diff(angle[block.start : block.stop + 2], 2)
        total += float(changes @ changes)
    return math.sqrt(total / (angle.size - 2))


# ---- without its lines -------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Remainder:
    """An angle after a method removed its lines.

    Attributes
    ----------
    removal
        The angle left and what was taken, per gyro; its lines are of the channel that they name.
    rate
        Of the angle left, Hz: the sample rate, or one a turn.
    weights
        Of the two gyros of a difference, as in `Measurement`.
    once_a_turn
        Whether there is but one angle for each turn of the table. Such angles lie between
        samples.
    """

    removal: Removal
    rate: float
    weights: tuple[float, float] = (1.0, -1.0)
    once_a_turn: bool = False

    @property
    def is_finished(self) -> bool:
        """Whether the search for lines came to an end."""
        return self.removal.unfinished is None


def remainder_of(
    measured: Measurement,
    turning: TurningTable,
    recording: Recording,
    settings: Settings,
    progress: Callable[[float], None],
) -> Remainder:
    """Removes lines from what is measured by the chosen method.

    Here the difference of two gyros ends: what is left has the noise of one.

    Parameters
    ----------
    measured
        One gyro or a difference.
    turning
        The table, as `with_order_phases` gives it.
    recording
        The gyros themselves, for a method that takes them one by one.
    settings
        Method, and how a published search is run.
    progress
        Called with the fraction done.

    Raises
    ------
    RecordingError
        If the method cannot be used on this recording.
    """
    rate, table, estimate = measured.sample_rate, turning.known, turning.estimate
    if settings.method == "fos":
        find = partial(remove_lines, sample_rate=rate, channel=measured.channel)
        removal = find(measured.angle, table, progress=progress)
        made = any(line.name.startswith("product") for line in removal.lines)
        if made and estimate is not None and estimate.smoothed and measured.weights != (1.0, -1.0):
            # Lines of the gyros are in the angle that they lead, and not in the readings. Their
            # products with orders raise N by up to 3 % where they are too weak to be found.
            left = elementwise(np.subtract, estimate.readings, estimate.angle)
            left = without_lines(left, estimate.angle, rate, removal.lines)
            corrected = elementwise(np.subtract, estimate.readings, left, out=left)
            again = find(measured.angle, corrected)
            fewer = len(again.lines) < len(removal.lines) and again.unfinished is None
            removal = again if fewer else removal
    elif settings.method == "fris":
        removal, rate = _once_a_turn(measured, table, recording.null_pulse)
    elif settings.method == "none":
        value = "the value and its bounds are of table motion and lines, not of the gyro"
        text = f"no line was removed: on a turning table {value} (use {{method fos}})"
        left_in = Note(level="warning", text=text)
        removal = _nothing_removed(measured.angle, *([] if table is None else [left_in]))
    else:
        # Steps 1 to 3 of the paper; `search` says whether the difference comes first.
        angles = {measured.channel: measured.angle}
        if measured.is_pair:
            angles = {name: angle_of(recording.gyro(name), rate) for name in measured.gyros}
        search = settings.published if settings.method == "fos-paper" else LITERAL
        removal = remove_lines_as_published(angles, table, rate, search=search, progress=progress)
    unfinished, residual = removal.unfinished, measured.noise(removal.residual)
    unfinished = None if unfinished is None else measured.noise(unfinished)
    taken = removal.taken / [[1.0], [1.0], [measured.size**2]]
    removal = replace(removal, residual=residual, taken=taken, unfinished=unfinished)
    once_a_turn, weights = settings.method == "fris", measured.weights
    return Remainder(removal=removal, rate=rate, weights=weights, once_a_turn=once_a_turn)


def _nothing_removed(angle: FloatArray, *notes: Note) -> Removal:
    return Removal(residual=angle, lines=(), masked=(), taken=np.empty((3, 0)), notes=notes)


def _once_a_turn(
    measured: Measurement, table: FloatArray | None, pulse: BooleanArray | None
) -> tuple[Removal, float]:
    """Full rotation interval sampling (FRIS), Eqs. 8 and 9: the angles left, and their rate, Hz."""
    if table is None and pulse is None:
        problem = "full rotation interval sampling ({method fris}) needs a turning table"
        remedy = "name its encoder ({table COLUMN:UNIT}) or its null pulse ({null-pulse COLUMN})"
        raise RecordingError(problem, remedy=remedy + ", or use {method fos}")
    times, values = full_rotation_samples(measured.angle, table, pulse)
    rate = float((times.size - 1) / (times[-1] - times[0]) * measured.sample_rate)
    angles = f"{times.size} angles, one a turn, every {1.0 / rate:.4g} s"
    text = f"full rotation interval sampling: {angles}; the interval asked for plays no part. "
    text += "Lines in time are still in, folded at that interval: value and bounds may be wrong "
    text += "either way (use {method fos})"
    return _nothing_removed(values, Note(level="warning", text=text)), rate
