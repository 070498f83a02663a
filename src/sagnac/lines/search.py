"""The search for periodic components: rounds of finding, fitting and judging.

A joint least-squares fit of all lines with a test of each against the noise floor, akin to
Newtonized orthogonal matching pursuit (NOMP; Mamandipoor, Ramasamy and Madhow 2016,
arXiv:1509.01942). The option that chooses it is called ``fos`` after the paper's method; fast
orthogonal search proper is in `orthogonal_search`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from sagnac.core.arrays import FloatArray, differences, extent
from sagnac.core.errors import Note, counted, refusal, require_name, require_progress, rounded
from sagnac.core.kernels import one_thread
from sagnac.lines import components, joint_fit, naming, passes
from sagnac.lines.candidates import NewLines, bands_of_peaks, crowded_bands, new_lines
from sagnac.lines.detection import Band, Peaks, joined_bands, peaks_in_frequency
from sagnac.lines.model import Line, Removal
from sagnac.lines.state import Record, State, first_state
from sagnac.recording.channel import whole_series
from sagnac.table.kinematics import (
    KINEMATIC_RATE,
    Kinematics,
    averages_of,
    kinematics,
    rate_variation,
)
from sagnac.table.motion import follow_table
from sagnac.table.turns import FEW_TURNS, AngleFunction, full_turns, function_of_angle, is_turning

_MOST_LINES: Final = 250
_ROUNDS: Final = 20
# Passes over the record for pairs of lines that the table sweeps over each other, and samples below
# which there are more of them, for the same five seconds (50 ns for a sample in a pass).
_MOST_PASSES: Final = 500.0
_LONG: Final = 200_000
# Where the rate varies and the table makes fewer turns than this, the search by orders may not end,
# or may leave orders in. Alone, over 4 to 9 turns, it made 4 of 114 single gyros read 6 to 40 times
# N, and gave no N for 6 of 66 pairs.
_SOME_TURNS: Final = 9.0
# Where the rate varies, a table of this many turns has its orders sought before a function of the
# angle is fitted. Over 2 to 4 turns, half intervals of 31 pairs were 1.3 bounds in the median, and
# 2.8 with the function alone.
_FEWEST_TURNS: Final = 2.0
# Most times that a function of the angle is fitted beside the tones known so far.
_FUNCTIONS: Final = 3
# Rounds in which lines are looked for beside bands of vibration.
_PATIENT_ROUNDS: Final = 5
# Rounds after which tones that lie together have stood beside all strong lines, if none waits.
_SURE_ROUNDS: Final = 2


def remove_lines(
    angle: FloatArray,
    table: FloatArray | None,
    sample_rate: float,
    *,
    channel: str,
    false_alarm: float = 0.01,
    progress: Callable[[float], None] | None = None,
) -> Removal:
    """Find, refine, fit jointly and remove every periodic component of `angle`.

    Table motion and Earth rate come first (`table.motion.follow_table`); over part of a turn, or a
    few, what goes with the table angle comes with them (`table.turns`). Rounds follow until
    nothing exceeds the noise floor: new lines in frequency and in order of table angle
    (`candidates.new_lines`); a joint Gauss-Newton step of all (`joint_fit.fit`); table motion again
    without them; tones that follow the table moved to the angle scale (`passes.rescaled`); and
    clusters that are one line with a drifting amplitude made one (`wandering.fit_drifting`).

    This is what the method ``fos`` does. It is a joint fit with a noise-floor test, akin to NOMP
    (arXiv:1509.01942), not the fast orthogonal search of the paper.

    Parameters
    ----------
    angle
        (samples,) gyro angle or difference of two, rad.
    table
        (samples,) unwrapped table angle, rad; None at rest.
    sample_rate
        Hz.
    channel
        Name for the lines found.
    false_alarm
        Probability that noise alone yields any line at all.
    progress
        Called with the fraction done.

    Returns
    -------
    Removal
        What is left, the lines, and the noise that went with them.

    Raises
    ------
    ValueError
        If `false_alarm` is no probability, `sample_rate` is not above zero, `channel` is no name,
        a value is missing or infinite, all are the same, there are too few, or the table has
        another number of them.

    Examples
    --------
    Forty seconds of a walking angle, 10 nrad a step, with a line of 1 urad at 7.3 Hz:

    >>> import numpy as np
    >>> steps = 1e-8 * np.random.default_rng(1).standard_normal(4000)
    >>> seconds = np.arange(4000) / 100.0
    >>> angle = np.cumsum(steps) + 1e-6 * np.cos(2.0 * np.pi * 7.3 * seconds)
    >>> removal = remove_lines(angle, None, 100.0, channel="x")
    >>> [f"{line.frequency:.3f} Hz, {1e6 * line.amplitude:.2f} urad" for line in removal.lines]
    ['7.300 Hz, 1.00 urad']
    >>> round(float(np.std(np.diff(removal.residual)) / np.std(steps)), 2)
    1.0
    """
    require_name("channel", channel)
    require_progress(progress)
    angle = whole_series(angle, "angle")
    table = None if table is None else whole_series(table, "table")
    record = Record(angle=angle, encoder=table, sample_rate=sample_rate, false_alarm=false_alarm)
    _require_noise(angle)
    if table is not None and 2.0 * sample_rate / KINEMATIC_RATE > angle.size:
        remedy = f"beside a table give {2.0 / KINEMATIC_RATE:g} s or more"
        raise refusal("angle", f"has {angle.size} samples at {sample_rate:g} Hz; {remedy}")
    report = progress or (lambda _: None)
    # Products within a block are too small to share out among threads.
    with one_thread():
        removal = _removed(record, channel, report)
    report(1.0)
    return removal


def without_lines(
    angle: FloatArray, table: FloatArray, sample_rate: float, lines: tuple[Line, ...]
) -> FloatArray:
    """(samples,) an angle without the steady lines of these that stand in it.

    Lines with a name, such as products of two others, are not fitted.
    """
    own = sorted((line for line in lines if not line.name), key=lambda line: line.frequency)
    orders = np.array([line.frequency for line in own if line.scale == "angle"])
    tones = np.array([line.frequency / sample_rate for line in own if line.scale == "time"])
    known = {"orders": orders, "frequencies": tones, "phasor": np.zeros(len(own), dtype=complex)}
    record = Record(angle=angle, encoder=table, sample_rate=sample_rate, false_alarm=0.01)
    state = State(record=record, motion=None, components=components.components_of(angle.size))
    state = passes.joined_by(passes.looked(state), components.components_of(angle.size, **known))
    return passes.pruned(state).residual()


def _require_noise(angle: FloatArray) -> None:
    """Refuse an angle that holds no noise, or none that can be squared."""
    low, high = extent(angle)
    if low == high:
        raise refusal("angle", f"is {low + 0.0:g} throughout; give values that vary")
    noise = float(np.ptp(extent(differences(differences(angle)))))
    # Steps of an angle that vary by no more than this share of its size vary by rounding.
    if noise <= 8.0 * float(np.finfo(np.float64).eps) * max(abs(low), abs(high)):
        raise refusal("angle", "is a straight line, to rounding; give one with noise")
    # Floating point does not hold squares of numbers beyond these to all their digits.
    if not (noise > 1e-140 and high - low < 1e140):
        raise refusal("angle", f"runs from {low:g} to {high:g}; give it in rad")


def _removed(record: Record, channel: str, report: Callable[[float], None]) -> Removal:
    """The removal of lines, and over a few turns of what goes with the table angle."""
    table, turned = record.encoder, math.inf
    if table is not None and is_turning(table):
        turned = full_turns(table)
    if table is None or turned >= _SOME_TURNS:
        return _removal(searched(first_state(record), report), channel)
    kinematic = kinematics(table, record.sample_rate)
    varies = rate_variation(kinematic) > 0.1
    if turned < (_FEWEST_TURNS if varies else FEW_TURNS):
        function = function_of_angle(record.angle, kinematic)
        return _beside_function(record, kinematic, function, channel, report)
    removal = _removal(searched(first_state(record), report), channel)
    if not varies:
        return removal
    record.made.clear()
    # Where the rate varies, orders smear and raise the floor that they are sought above. A search
    # for all of them beside tones may also take too long.
    hides = removal.unfinished is None
    function = function_of_angle(removal.residual if hides else record.angle, kinematic)
    if function is None:
        return removal
    if hides:
        record = replace(record, angle=function.less(record.angle, table), made={})
        again = _removal(searched(first_state(record), report), channel)
        why = "where its rate varies, weak orders are not found one by one"
        again = _with_function(again, function, f"over {turned:.2g} turns, {why}", channel)
    else:
        again = _beside_function(record, kinematic, function, channel, report)
    return again if again.unfinished is None else removal


def _beside_function(
    record: Record,
    kinematic: Kinematics,
    function: AngleFunction | None,
    channel: str,
    report: Callable[[float], None],
) -> Removal:
    """The removal over so few turns of a table that orders are not told apart.

    Each could be taken for table motion: what goes with the angle is taken out as one function, and
    the rest is searched as that of a gyro at rest. Tones that are found so are fitted with the
    function, and what it took of them is searched for once more.
    """
    tones = np.empty(0)
    for left in reversed(range(_FUNCTIONS)):
        angle = record.angle
        if function is not None:
            angle = function.less(angle, kinematic.table)
        averages = averages_of(angle, kinematic.block)
        angle = follow_table(averages, kinematic).less(angle)
        state = first_state(replace(record, angle=angle, encoder=None, made={}))
        state = searched(state, report)
        if function is None or not left:
            break
        # At its highest speed a table has its orders at several times their usual frequency.
        found = _tones(state)
        found = found[found < 4.0 * function.taken[0, -1]]
        apart = np.abs(np.subtract.outer(found, tones)).min(axis=1, initial=np.inf)
        if not (is_new := apart > record.sample_rate / angle.size).any():
            break
        tones = np.append(tones, found[is_new])
        # What was made of this angle would lie in memory beside the next.
        state.record.made.clear()
        function = function_of_angle(record.angle, kinematic, tones, function)
    removal = _removal(state, channel)
    if function is None:
        return removal
    few = f"over {full_turns(kinematic.table):.2g} turns orders of the table are not told apart"
    return _with_function(removal, function, few, channel)


def _with_function(removal: Removal, function: AngleFunction, why: str, channel: str) -> Removal:
    """The removal of what was left behind a function of the angle, and a note with its reason."""
    what = f"one function, a sum of {function.orders.size} orders that mean nothing one by one"
    text = f"{why}: what goes with its angle was taken out as {what}"
    return replace(
        removal,
        taken=np.concatenate([function.taken, removal.taken], axis=1),
        masked=(*function.masked, *removal.masked),
        notes=(Note(channel=channel, text=text), *removal.notes),
    )


def _tones(state: State) -> FloatArray:
    """(tones,) Hz, of lines in time, and of the highest peak in each band of vibration."""
    carriers = [line.carrier for line in state.drifting]
    if state.bands:
        power = state.look().power
        for band in state.bands:
            low, high = (round(2.0 * edge * (power.size - 1)) for edge in band)
            carriers.append((low + int(np.argmax(power[low:high]))) / (2.0 * (power.size - 1)))
    return np.append(state.components.frequencies, carriers) * state.record.sample_rate


# --- the rounds ------------------------------------------------------------------------------


def searched(state: State, report: Callable[[float], None]) -> State:
    """The state in which a search ends, with its `end`."""
    state = passes.looked(state)
    before: State | None = None
    while state.end is None:
        report(state.rounds / _ROUNDS)
        # Past states hold lines alone: a noise floor of each would lie beside the next transform.
        earlier, before = before, replace(state, seen=None)
        state = next_round(state)
        if state.end is not None:
            break
        if earlier is not None and state.rounds > _PATIENT_ROUNDS and _same_lines(earlier, state):
            # A line that comes and goes by turns: with it nothing more stands.
            more = before.components.size >= state.components.size
            state = replace(passes.looked(before) if more else state, end="nothing new stood")
        elif state.rounds == _ROUNDS:
            state = replace(state, end="too many rounds")
    return state


def next_round(state: State) -> State:
    """One round of finding, fitting and judging; with an `end` if there is nothing more to do."""
    number, before = state.rounds, state
    state = replace(state, rounds=number + 1)
    tones = peaks_in_frequency(state.look(), state.record.threshold)
    crowds = _crowds(state, tones)
    new = new_lines(state, tones, crowds)
    if not _may_be_images(state, new):
        state = passes.without_vibration(replace(state, bands=crowds))
    found_none = new.lines.size == 0 and state.components.size == before.components.size
    if new.lines.size == 0 and state.bands and number >= _PATIENT_ROUNDS:
        return replace(state, end="nothing stands")
    if found_none and number > 0:
        if state.patience is not None:
            return replace(state, earth_settled=True)
        if new.restless.size == 0:
            after = passes.gathered(state, np.empty(0))
            over = len(after.drifting) == len(state.drifting)
            return replace(after, end="nothing stands" if over else None)
    # A round has three joint fits or more, each with a pass over the record for each pair of lines
    # that meet. The time of a search grows with the record, whatever is in it.
    together = components.joined(state.components, new.lines)
    expected = joint_fit.pairs_summed(state.record.sampled, together)
    if state.passes + 3.0 * expected > _MOST_PASSES * max(1.0, _LONG / state.record.angle.size):
        return replace(state, end="too many pairs")
    state = passes.joined_by(state, new.lines)
    state = passes.pruned(state)
    # An order that smears looks like a line that drifts: what follows the table moves to its own
    # scale first.
    state = passes.without_earth_orders(state)
    state = passes.looked(passes.settled_motion(state))
    after = passes.rescaled(state)
    # If that moved any line, those go that no more stand.
    state = state if after is state else passes.looked(passes.pruned_all(after))
    if found_none or (number >= _SURE_ROUNDS and not new.waiting):
        state = passes.gathered(state, new.restless)
    if number > 0 and _same_lines(before, state):
        # What was found did not stand once fitted with the rest, and would not next time.
        return replace(state, end="nothing new stood")
    return replace(state, end="too many lines" if state.components.size > _MOST_LINES else None)


def _crowds(state: State, peaks: Peaks) -> tuple[Band, ...]:
    """Bands of vibration known so far, and those in which peaks in frequency crowd now.

    If the search goes on and on, all that still stands is of such bands.
    """
    bins = state.floor.size
    crowds = crowded_bands(peaks, state.components, bins)
    if state.rounds > (_PATIENT_ROUNDS if state.bands else 10):
        crowds = (*crowds, *bands_of_peaks(peaks, bins))
    return joined_bands((*state.bands, *crowds))


def _may_be_images(state: State, new: NewLines) -> bool:
    """Whether peaks that crowd may be what an order smears: seen when all orders are out.

    A table that dwells or turns back makes a comb of each, which a band of vibration would hide.
    """
    return state.record.sampled.table is not None and (
        state.rounds == 1
        or (new.waiting and state.rounds <= _SURE_ROUNDS)
        or (new.lines.orders.size > 0 and state.rounds <= _PATIENT_ROUNDS)
    )


def _same_lines(before: State, after: State) -> bool:
    """Whether two states hold the same lines, to within a bin."""
    first, second, turns = before.components, after.components, after.record.sampled.turns
    same = len(before.drifting) == len(after.drifting) and first.size == second.size
    if not (same and first.orders.size == second.orders.size):
        return False
    orders = np.abs(first.orders - second.orders) * turns
    tones = np.abs(np.sort(first.frequencies) - np.sort(second.frequencies)) * (2.0 * first.center)
    return bool(np.all(orders < 0.5) and np.all(tones < 1.0))


def final_fit(state: State) -> State:
    """All lines on their right scale, the fit settled, and only those that stand."""
    after = passes.rescaled(state)
    if after is state and not state.settled:
        after = passes.refitted(state)
    return passes.pruned_all(after)


# --- the answer ------------------------------------------------------------------------------


def _removal(ended: State, channel: str) -> Removal:
    """Notes of a search that is over."""
    state = final_fit(ended)
    # The last fit moves lines by less than their errors: the floor is that of the last look, whose
    # power is not asked for any more.
    state.record.made.pop("spectrum", None)
    residual = state.residual()
    lines = naming.describe_lines(state, channel)
    rate = state.record.sample_rate
    vibration = tuple((low * rate, high * rate) for low, high in state.bands)
    finished = ended.end in {"nothing stands", "nothing new stood"}
    bare = replace(state, components=components.components_of(residual.size), fit=None, drifting=())
    return Removal(
        residual=residual,
        lines=lines,
        masked=(*naming.masked_bands(lines, state), *vibration),
        taken=naming.noise_taken(lines, state),
        notes=tuple(_notes(state, vibration, ended, channel)),
        unfinished=None if finished else bare.residual(),
    )


def _notes(state: State, vibration: tuple[Band, ...], ended: State, channel: str) -> Iterator[Note]:
    """What the search noticed: lines fitted by blocks, bands left alone, an end before the end."""
    for line in state.drifting:
        # An amplitude that drifts by less is steady.
        drift = "drifts in phase"
        if line.drift >= 0.005:
            drift = f"drifts, by {rounded(100.0 * line.drift)} % in amplitude"
        fitted = f"fitted in {counted(line.blocks, 'block')} with {line.parameters} parameters"
        hertz = line.frequency * state.record.sample_rate
        text = f"the line at {hertz:.6g} Hz {drift}; it is {fitted}"
        yield Note(channel=channel, text=text)
    if vibration:
        named = ", ".join(f"{low:.3g} to {high:.3g} Hz" for low, high in vibration)
        left = "it is left in the curve, and left out of what is fitted to the spectrum"
        text = f"vibration at {named}: peaks crowd there and are no lines; {left}"
        yield Note(level="warning", channel=channel, text=text)
    stopped = f"the search stopped at {ended.components.size} lines"
    text = {
        "too many lines": f"{stopped}; more peaks stand above the floor",
        "too many pairs": f"{stopped}: this table sweeps orders and tones over each other, and "
        "more of them would take a pass over the record for each pair; more peaks stand above the "
        "floor",
        "too many rounds": f"the search stopped after {_ROUNDS} rounds; weaker peaks may still "
        "stand above the floor",
    }.get(ended.end or "", "")
    if text:
        yield Note(channel=channel, level="warning", text=text)
    if state.fit is not None and state.fit.collinear:
        alike = f"{state.fit.collinear} directions among the lines of {channel}"
        why = "(angle and time coincide at this steady rate)"
        left = "their sum is removed, their single amplitudes are not to be trusted"
        yield Note(level="warning", text=f"{alike} cannot be told apart {why}; {left}")
