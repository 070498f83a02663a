"""The answer beside the encoder of a turning table, and beside noise that two gyros share.

Two gyros with unlike shares of the table are weighted so that its motion cancels; what is left is
not their plain mean.

One gyro: nothing but the encoder tells the motion of the table from its noise, so the encoder's own
wander counts as the gyro's. A second gyro on the table gives it away: both show the same. And the
two together, each weighted by the other's share, hold no table at all: what is left bounds the
noise of either.

What is measured holds the encoder's noise by its share of the table. It is white noise of the
angle, a Q, and hides N from some frequency on. What the spectrum tells of N with that Q and without
it (Whittle's information) says what a better latch would bring.

Noise that two gyros share does not show in their difference. Their cross spectrum tells of it. If
two gyros do not show the table's motion alike, some of it is left in their difference.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

import numpy as np
from scipy.special import ndtri

from sagnac.analysis.averaged import AnswerSpectrum, Headline
from sagnac.analysis.evidence import Evidence
from sagnac.analysis.measurement import ALIKE, Measurement, measure
from sagnac.core.arrays import FloatArray, differences, square
from sagnac.core.errors import Level, Note, rounded
from sagnac.core.marks import stretches
from sagnac.noise.cross_spectra import CommonWalk, band_cells, common_walk, differenced_factor
from sagnac.noise.estimates import Estimate, part_of_errors, rooted, unobserved
from sagnac.noise.lowest_ordinates import LEAST_AVERAGES, highest_walk
from sagnac.quality.encoder import LEAST_SHARE
from sagnac.quality.profile import Profile, scatter_of
from sagnac.recording.channel import PAIR_SIZE, angle_of
from sagnac.table import kinematics
from sagnac.table.estimate import EstimatedTable
from sagnac.table.kinematics import KINEMATIC_RATE, Kinematics, averages_of
from sagnac.table.motion import follow_table_together
from sagnac.table.turns import FEW_TURNS, full_turns, mean_rate

WalkOfPair = Callable[[Evidence, str], Estimate]
"""Angle random walk per gyro of the one that is measured and another one, which is named."""

# From this ratio of the weights on, the pair shows only the gyro of the larger weight.
_ONE_ALONE: Final = 10.0


def with_encoder(headline: Headline, evidence: Evidence, walk_of_pair: WalkOfPair) -> Headline:
    """The answer with what the encoder may have added to it or hides.

    Parameters
    ----------
    headline, evidence
        As the spectrum was read.
    walk_of_pair
        Called if the encoder decides what one gyro shows.
    """
    table, measured = evidence.table.estimate, evidence.measured
    if table is not None and not measured.is_pair:
        headline = _of_one(headline, evidence, table, walk_of_pair)
        headline = headline.with_each(_of_readings_too, beside=True)
    if headline.spectrum is not None:
        band = headline.spectrum.average.rests_on.band_hz
        headline = replace(headline, findings=(*headline.findings, *unlike_motion(evidence, band)))
    answer = for_plain_mean(measured, headline)
    answer = answer.with_each(lambda one: of_plain_mean(one, measured.weights), beside=True)
    return _with_latch_note(answer, headline.estimate, evidence)


def _of_readings_too(one: Estimate) -> Estimate:
    """A coefficient of one gyro less the encoder's readings: Q holds their noise, too."""
    is_bound = one.name == "quantization" and one.status == "estimated"
    return one.bounded(one.high) if is_bound else one


def for_plain_mean(measured: Measurement, read: Headline) -> Headline:
    """The answer of a pair of which each gyro has a weight, with an interval for the plain mean.

    The square of what is read is the mean of N^2 of the two gyros by the squares of their weights,
    so that N of the pair lies between what is read over the larger weight and over the smaller. The
    interval holds any value between the two at the confidence asked for (`part_of_errors`).

    Parameters
    ----------
    measured
        As `without_encoder_errors` gives it.
    read
        The answer.
    """
    least, most = sorted(abs(weight) for weight in measured.weights)
    estimate, notes = read.estimate, read.notes
    if least == most or estimate.status == "not observable":
        return read
    if not (ALIKE[0] < least and most < ALIKE[1]):
        first, second = measured.gyros
        # If one weight is far larger, N is that of its gyro alone.
        alone = most > _ONE_ALONE * least
        heavier = first if abs(measured.weights[0]) == most else second
        what = "the interval holds their plain mean whichever of the two has the noise"
        if alone:
            reads = f"whose angle random walk reads {estimate.in_field_unit()}"
            what = f"it shows {heavier} alone, {reads}, and not their mean"
        one, other = (f"{abs(weight):.2f} times" for weight in measured.weights)
        counts = f"{first} counts {one} and {second} {other}"
        text = f"{counts}, so that the two take the table out; {what}"
        level: Level = "warning" if alone else "remark"
        notes = (*notes, Note(channel=measured.channel, level=level, text=text))
    return replace(read, estimate=of_plain_mean(estimate, measured.weights), notes=notes)


def of_plain_mean(estimate: Estimate, weights: tuple[float, float]) -> Estimate:
    """A coefficient of a pair of which each gyro has a weight, for the plain mean of the two.

    It is not observable if the pair is all but one gyro.
    """
    least, most = sorted(map(abs, weights))
    if least == most or estimate.status == "not observable":
        return estimate
    if most > _ONE_ALONE * least:
        return unobserved(estimate.name, estimate.confidence)
    if estimate.status != "estimated":
        return estimate.bounded(estimate.high / least)
    half_width = 0.5 * math.log(estimate.high / estimate.low) if estimate.low > 0.0 else 0.0
    part = part_of_errors(math.log(most / least), half_width, estimate.confidence)
    low = estimate.value / most * (estimate.low / estimate.value) ** part
    high = estimate.value / least * (estimate.high / estimate.value) ** part
    return replace(estimate, low=low, high=high)


# ---- one gyro beside its encoder ---------------------------------------------------------

# Rms s by which the time of an encoder's readings may wander unseen in half an hour.
_WANDERS: Final = 100e-6


def _of_one(
    headline: Headline, evidence: Evidence, table: EstimatedTable, walk_of_pair: WalkOfPair
) -> Headline:
    """The answer of one gyro; another one on the table tells what its encoder adds, if there is."""
    recording, name, own = evidence.corrected, evidence.measured.gyros[0], headline.estimate
    beside = (gyro for gyro in recording.gyros if gyro.name != name)
    senses = (one for one in beside if abs(Profile.of(recording, one).share) > LEAST_SHARE)
    other = next((one.name for one in senses), None)
    two = None if other is None else walk_of_pair(evidence, other)
    if other is None or two is None or two.status == "not observable":
        alone = _without_second_gyro(headline, evidence, table)
        return _by_lowest_frequencies(alone, own, evidence)
    # All of what the two hold may be the noise of one, whose weight is one within their shares.
    both = PAIR_SIZE * two.high
    shared = shared_walk(evidence, (name, other))
    if own.status == "estimated" and own.low < both and shared and not shared.is_present:
        low = math.sqrt(max(own.low**2 - max(shared.high, 0.0), 0.0))
        if low > 0.0:
            return replace(headline, estimate=replace(own, low=low))
    seen = shared is not None and shared.low > 0.0
    why = f"{other} shows the same wander" if seen else "it hides the gyro's noise"
    text = (
        f"the encoder decides what {name} alone can show: {why}; the bound is of {name} and "
        f"{other} together, which take the table out by themselves (name both with {{gyros}})"
    )
    bound = own.bounded(both if own.status == "not observable" else min(both, own.high))
    source = f"{name} and {other} together, all of whose noise may be that of {name}"
    return _decided_by_encoder(headline, name, text, estimate=bound, source=source)


def _decided_by_encoder(headline: Headline, name: str, text: str, **changes: Any) -> Headline:
    note = Note(channel=name, level="warning", text=text)
    return replace(headline, notes=(*headline.notes, note), by_encoder=True, **changes)


def _without_second_gyro(headline: Headline, evidence: Evidence, table: EstimatedTable) -> Headline:
    """The answer of a gyro alone on its table: a wander that no one sees is part of it."""
    own, spectrum, name = headline.estimate, headline.spectrum, evidence.measured.channel
    levels = own if spectrum is None else spectrum.average.angle_random_walk
    if own.status == levels.status == "upper bound" and levels.value < own.value:
        # The curve is of points, in each of which the noise of a reading stands in full.
        source = f"the spectrum of {name} below its roll-off"
        headline = replace(headline, estimate=levels, source=source)
    if own.status != "estimated":
        text = (
            f"the encoder decides what {name} can show: its noise lies above the gyro's, and "
            "no second gyro on the table takes it out; record one, or latch the encoder with the "
            "gyros"
        )
        return _decided_by_encoder(headline, name, text) if table.smoothed else headline
    names = {(note.name, note.channel, note.level) for note in evidence.findings}
    if ("encoder", "table", "warning") in names:
        return replace(headline, estimate=own.bounded(own.high), by_encoder=True)
    rate = mean_rate(table.angle, evidence.measured.sample_rate)
    unseen = abs(evidence.table.shares[name] * rate) * _WANDERS / math.sqrt(1800.0)
    # A wander may make up this part of N in an estimate.
    if unseen < 0.3 * own.low:
        return replace(headline, estimate=replace(own, low=math.sqrt(own.low**2 - unseen**2)))
    text = (
        f"what {name} shows beside the encoder may be the encoder's: readings whose time "
        f"wanders by {1e6 * _WANDERS:g} us in half an hour make as much, and no second gyro on the "
        f"table tells; only an upper bound is given (if the encoder adds nothing, {name} has "
        f"{own.to('deg/sqrt(h)')})"
    )
    return _decided_by_encoder(headline, name, text, estimate=own.bounded(own.high))


def _by_lowest_frequencies(answer: Headline, read: Estimate, evidence: Evidence) -> Headline:
    """The answer, its bound lowered to what the lowest frequencies allow.

    The encoder's noise is least there. Beside N and white noise of the readings the residual may
    hold a drift, a part of the table's motion by an error of the share, and a part of its rate by a
    delay and a change of it.

    An estimate that was read has the lowest frequencies in it, and the lower of its end and their
    bound would hold N less often than either: it stands unless they contradict it.
    """
    own, readings, left = answer.estimate, evidence.table.readings, evidence.left
    residual = left.removal.residual
    # Enough averages for the lowest ordinates, and few in a record of any length.
    block = residual.size // (2 * LEAST_AVERAGES)
    untrusted = left.once_a_turn or not left.is_finished
    if own.status == "estimated" or readings is None or untrusted or block == 0:
        return answer
    averages, angle = averages_of(residual, block), averages_of(readings, block)
    rate = np.gradient(angle)
    columns = np.stack([angle, rate, rate * np.linspace(-1.0, 1.0, rate.size)])
    how = {**evidence.how, "interval": block / evidence.measured.sample_rate}
    if read.status == "estimated":
        # At this confidence the lowest frequencies contradict what was read.
        surely = {**how, "confidence": 0.999}
        if highest_walk(averages, columns, **surely) >= read.low:
            return answer
    highest = highest_walk(averages, columns, **how)
    if not highest < (own.value if own.status == "upper bound" else math.inf):
        return answer
    source = f"the lowest frequencies of the spectrum of {evidence.measured.channel}"
    return replace(answer, estimate=own.bounded(highest), source=source)


# ---- what a better latch would bring -----------------------------------------------------

# Part of the interval that a better latch has to leave at the most to be worth a note.
_WORTH: Final = 0.8


def _with_latch_note(answer: Headline, read: Estimate, evidence: Evidence) -> Headline:
    """An answer with a note if the encoder, or unlike shares of two gyros, decide its interval.

    `read` is the estimate without what unlike weights of a pair leave open.
    """
    estimate, spectrum, table = answer.estimate, answer.spectrum, evidence.table.angle
    if estimate.status != "estimated" or spectrum is None or table is None:
        return answer
    half, narrowed = _half(estimate), _half(read)
    if narrowed > _WORTH * half:
        bound, without = _bounds(estimate.value, spectrum, evidence, table)
        # From here on something else than white noise decides the interval.
        narrowed = half * without / bound if half < 3.0 * bound else half
    if narrowed > _WORTH * half:
        return answer
    # Two gyros whose weights are nearly alike are never taken beside the encoder.
    what = "the noise of the encoder decides the interval: latched with the gyros, it"
    if _half(read) <= _WORTH * half and evidence.measured.weighs_alike:
        differ = "the shares of the table's rate that the two gyros sense differ"
        what = f"{differ}, which decides the interval: alike, they"
    now, then = rounded(100.0 * half), rounded(100.0 * narrowed)
    text = f"{what} would narrow it from ± {now} % to about ± {then} %"
    note = Note(channel=evidence.measured.channel, text=text)
    return replace(answer, notes=(*answer.notes, note))


def _bounds(
    walk: float, spectrum: AnswerSpectrum, evidence: Evidence, table: FloatArray
) -> tuple[float, float]:
    """Half intervals that no estimate beats, with the noise of the encoder and without it."""
    measured, rate = evidence.measured, evidence.measured.sample_rate
    confidence = evidence.settings.confidence
    of_encoder = abs(measured.share(evidence.table.shares)) * white_noise(table) / measured.size
    quantization = spectrum.average.coefficients["quantization"]
    in_all = quantization.value if quantization.status == "estimated" else of_encoder
    of_gyros = white_noise(measure(evidence.corrected, evidence.settings.gyros).angle)
    own = min(math.sqrt(max(in_all**2 - of_encoder**2, 0.0)), of_gyros / measured.size)
    seconds = evidence.recording.samples / rate
    how = {"sample_rate": rate, "seconds": seconds, "confidence": confidence}
    return half_interval(walk, in_all, **how), half_interval(walk, own, **how)


def _half(answer: Estimate) -> float:
    """Half interval, as a part of N."""
    return 0.5 * (answer.high - answer.low) / answer.value


def half_interval(
    walk: float, white: float, *, sample_rate: float, seconds: float, confidence: float
) -> float:
    """Half interval, as a part of N, that no estimate without bias beats.

    Of all ordinates of the spectrum N^2 + Q^2 (2 r sin(pi f/r))^2 / r, with Q unknown, too.

    Parameters
    ----------
    walk, white
        N, rad/sqrt(s), and Q, rad: white noise of each sample.
    sample_rate, seconds
        r, Hz, and the length of the record.
    confidence
        Of the interval.
    """
    edges = np.geomspace(1.0 / seconds, 0.5 * sample_rate, 2000)
    frequency, count = np.sqrt(edges[1:] * edges[:-1]), np.diff(edges) * seconds
    shape = (2.0 * sample_rate * np.sin(np.pi * frequency / sample_rate)) ** 2 / sample_rate
    slopes = np.stack([np.ones_like(shape), shape]) / (walk**2 + white**2 * shape)
    information = (slopes * count) @ slopes.T
    square = 1.0 / (information[0, 0] - information[0, 1] ** 2 / information[1, 1])
    return float(ndtri(0.5 + 0.5 * confidence)) * math.sqrt(square) / (2.0 * walk**2)


def white_noise(angle: FloatArray) -> float:
    """Rms of the noise from reading to reading, rad, by third differences, which leave no motion.

    Parameters
    ----------
    angle
        (samples,) rad.
    """
    thirds = differences(differences(differences(angle)))
    # A third difference of white noise has 20 times its variance.
    return math.sqrt(square(thirds) / thirds.size / 20.0)


# ---- motion that two gyros do not show alike ---------------------------------------------

# Mean coherence in the band of N above which a difference follows the table. Noise has 0.09. Of 19
# triads with a lag of 0.3 to 3 ms or a low-pass of 8 to 80 Hz in one gyro, the eleven below 0.19
# held N; the eight above 0.41 read 1.0 to 69 times as much.
_FOLLOWS: Final = 0.28
# Samples from the beginning that the coherence is computed of.
FOR_COHERENCE: Final = 2**18


def unlike_motion(
    evidence: Evidence, band_hz: tuple[float, float], number: int = 0
) -> tuple[Note, ...]:
    """A finding if the difference of a pair holds motion of the table beside the noise of the two.

    If one of them is behind a filter of its own, their difference follows a third gyro, or the
    encoder, neither of which shares noise with it.

    Parameters
    ----------
    evidence
        With what the search for lines left of the pair.
    band_hz
        Band in which N of the pair is read.
    number
        Of the pair in `evidence.remainders`.
    """
    left, names = evidence.remainders[number], evidence.settings.gyros
    # A difference without weights holds errors of the encoder.
    if left.weights == (1.0, -1.0) or evidence.table.estimate is None:
        return ()
    pair = names[0], names[-1 - number]
    beside = [angle_of(evidence.corrected.gyro(one), left.rate) for one in names if one not in pair]
    moved = (*beside, evidence.table.estimate.readings)[0]
    steps = np.stack([differences(one[:FOR_COHERENCE]) for one in (left.removal.residual, moved)])
    band = band_hz[0], max(band_hz[1], 0.5)
    try:
        cells = np.abs(band_cells(steps, left.rate, band, left.removal.masked)[1])
    except ValueError:
        # Too few frequencies tell nothing.
        return ()
    shared = cells[0, 1] ** 2 / (cells[0, 0] * cells[1, 1])
    part = float(np.mean(shared))
    # Eight cells of noise exceed it by chance once in a hundred thousand times.
    if part <= _FOLLOWS or shared.size < 8:
        return ()
    text = f"what is left follows the table: {' and '.join(pair)} do not show its motion alike, as "
    text += "behind unlike filters, and N reads too high; give both the same filter, or name "
    text += "others ({gyros})"
    effect = 1.0 / math.sqrt(max(1.0 - part, 1e-6))
    return (Note(name="unlike", channel="-".join(pair), level="error", text=text, effect=effect),)


# ---- noise that two gyros share ----------------------------------------------------------

# More than this it adds to no N: gyros do not lean on each other so.
_ODD: Final = 1.5


def with_shared_noise(headline: Headline, evidence: Evidence) -> Headline:
    """The answer of a pair on a turning table, whose interval holds N of the gyros themselves.

    Shared noise is seen in the cross spectrum of the two, motion and orders taken out. What the
    encoder adds to every gyro looks like the gyros' own, but not like an angle random walk
    (`noise.cross_spectra`), unless it wanders.
    """
    spectrum, measured = headline.spectrum, evidence.measured
    if spectrum is None or evidence.table.angle is None or not measured.is_pair:
        return headline
    walk, read = spectrum.average.angle_random_walk, headline.estimate
    if walk.status != "estimated":
        return headline
    shared = shared_walk(evidence, measured.gyros, spectrum.average.rests_on.band_hz)
    if shared is None or _stands_at_times(evidence.table.angle, measured.sample_rate):
        return headline
    # Two gyros mounted in opposite senses are added, and the sum holds twice what they share.
    left_out = 1.0 - 0.5 * sum(measured.weights) ** 2
    squares = (left_out * square for square in (shared.reach, shared.square, shared.low))
    least, factor, most = sorted(differenced_factor(square, walk.value) for square in squares)
    note = _shared_note(measured.channel, shared, (least, factor, most), lost=left_out > 0.0)
    if note is None:
        return headline
    if note.name == "shared" and note.level == "warning" and read.status == "estimated":
        low, high = min(read.low, read.low / most), max(read.high, read.high / least)
        headline = replace(headline, estimate=replace(read, low=low, high=high))
    return replace(headline, findings=(*headline.findings, note))


def _stands_at_times(angle: FloatArray, sample_rate: float) -> bool:
    """Whether a table stands now and then. Its encoder then holds one step, as a walk would."""
    moved = np.abs(np.diff(averages_of(angle, max(1, round(sample_rate / KINEMATIC_RATE)))))
    # It stands below a hundredth of its usual rate.
    return float(np.mean(moved < 0.01 * np.median(moved[moved > 0.0]))) > 0.05


def shared_walk(
    evidence: Evidence, gyros: tuple[str, ...], band_hz: tuple[float, float] = (0.0, math.inf)
) -> CommonWalk | None:
    """Angle random walk that gyros on a turning table show alike: their own, or the encoder's.

    Parameters
    ----------
    evidence
        Of one of the gyros or of the pair.
    gyros
        Names.
    band_hz
        In which to look.

    Returns
    -------
    CommonWalk or None
        None if it cannot be told.
    """
    recording, known, readings = evidence.corrected, evidence.table.known, evidence.table.readings
    if known is None or readings is None or full_turns(known) < FEW_TURNS:
        # Table motion and its orders are nearly one basis: nothing is left of a gyro alone.
        return None
    kinematic = kinematics.kinematics(known, recording.sample_rate)
    angles = [angle_of(recording.gyro(name), recording.sample_rate) for name in gyros]
    rate = 1.0 / kinematic.interval
    beside = {line.frequency for line in evidence.lines if line.scale == "angle"}
    orders = np.array(sorted(order for order in beside if order != round(order)))
    averages = _without_table(angles, kinematic, readings, orders)
    _go_on_across_changes(averages, kinematic.angle)
    steps = np.diff(averages)
    # Readings that slip at times, or come back, make no walk.
    alike = steps.mean(axis=0)
    # A step that all gyros make against the encoder beyond eight deviations is one of the encoder.
    slips = np.abs(alike) > 8.0 * scatter_of(alike)
    if slips.mean() < 1e-3:
        steps[:, slips] = 0.0
    try:
        # Averages are bent above a quarter of their rate.
        band_hz = (band_hz[0], min(band_hz[1], 0.25 * rate))
        return common_walk(steps, sample_rate=rate, band_hz=band_hz, **evidence.how)
    except ValueError:
        # A band that is too narrow, or of lines alone.
        return None


def _without_table(
    angles: list[FloatArray], kinematic: Kinematics, readings: FloatArray, beside: FloatArray
) -> FloatArray:
    """(gyros, averages) of angles, rad, without table motion, Earth rate, whole orders and others.

    They are fitted to the angle that gyros and encoder know together. The share that each gyro has
    is then taken of the readings: what the encoder errs by is left in all gyros alike.
    """
    averages = np.stack([averages_of(angle, kinematic.block) for angle in angles])
    errors = averages_of(readings, kinematic.block) - kinematic.angle
    for number, motion in enumerate(follow_table_together(averages, kinematic, beside=beside)):
        of = motion.kinematics
        phasor = motion.phasor * kinematics.block_gain(of, motion.orders)
        orders = kinematics.harmonic_sum(of.angle, motion.orders, phasor)
        averages[number] -= motion.averages + orders + motion.share * errors
    return averages


# Averages on each side of a change of rate (3 s). Of 10, 20, 30 and 50 the last two left no walk in
# eight recordings of a table that steps between rates every half minute, readings scattered by 3".
_BESIDE: Final = 30


def _go_on_across_changes(averages: FloatArray, angle: FloatArray) -> None:
    """Draw a line through (gyros, averages) wherever the rate of the table's `angle` changes hard.

    A gyro answers within its bandwidth: where the table turns round, all gyros lag alike by more
    than a delay. A change of twenty times the usual size is one of the table's pattern; up to a
    tenth of the record is replaced. The line runs between means: single averages hold noise of the
    readings, which would make it wander.
    """
    turned = np.diff(angle, 2)
    hard = np.convolve(np.abs(turned) > 20.0 * scatter_of(turned), (1.0, 1.0)) > 0.0
    if hard.mean() >= 0.1:
        return
    for first, after in np.transpose(stretches(hard)).tolist():
        before = averages[:, max(0, first + 1 - _BESIDE) : first + 1].mean(axis=1)
        behind = averages[:, after : after + _BESIDE].mean(axis=1)
        line = np.linspace(before, behind, after - first + 1, axis=1)
        averages[:, first + 1 : after] = line[:, 1:-1]


def _shared_note(
    channel: str, shared: CommonWalk, factors: tuple[float, float, float], *, lost: bool
) -> Note | None:
    """The note on noise that two gyros share; None if it is an unsure wander of the encoder.

    `factors` are the smallest, the likeliest and the largest at which the difference reads N;
    `lost` is whether what they share is lost in it, rather than there twice.
    """
    low, factor, high = factors
    if not shared.is_present or factor > _ODD:
        # If what they share may be more than half of N, or half of what is read, nothing is told.
        if low < 0.5 or (high > 2.0 and not lost) or factor > _ODD:
            walk = "whether the two gyros share an angle random walk"
            text = f"{walk} cannot be told beside the noise of the encoder"
        else:
            most, which = (1.0 - low, "low") if lost else (high - 1.0, "high")
            reads = f"reads at most {rounded(100.0 * most)} % {which} against the gyros themselves"
            none = "no angle random walk that the two gyros share is seen beside the table's motion"
            text = f"{none}: the difference {reads}"
        return Note(channel=channel, text=text)
    # Below this it is the encoder that wanders: two gyros hardly share more noise than they have of
    # their own.
    if factor < 0.6:
        # A wander that is named measures five half intervals.
        if shared.square <= 5.0 * (shared.square - shared.low):
            return None
        squares = shared.square, shared.low, shared.high
        own = rooted("angle_random_walk", shared.confidence, *squares)
        text = (
            "its readings wander: each gyro taken against them shows "
            f"{own.to('deg/sqrt(h)')} that is taken to be the encoder's; the answer of the two "
            "gyros is free of it, and too low if it is their own and common to both"
        )
        return Note(channel="table", text=text)
    off, ends = 100.0 * (factor - 1.0), sorted(abs(100.0 * (end - 1.0)) for end in (low, high))
    matters = abs(factor - 1.0) >= 0.01
    shows, which = "counts twice, since the two are mounted, or move, in opposite senses", "high"
    if off < 0.0:
        shows, which = "does not show", "low"
    reads = f"{rounded(abs(off))} % ({rounded(ends[0])} to {rounded(ends[1])} %) {which}"
    text = f"the two gyros share an angle random walk that their difference {shows}: per gyro it "
    text += f"reads {reads} against the gyros themselves, unless the encoder wanders that much"
    text += "; the interval allows for it" * matters
    level: Level = "warning" if matters else "remark"
    return Note(name="shared", effect=factor, channel=channel, level=level, text=text)
