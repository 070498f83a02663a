"""The passes of a search: each takes a state and gives the next.

A line is what stands above the noise floor once it is fitted jointly with all others. A pass finds,
fits, judges or reinterprets lines; none changes the state that it is given, and each is told by its
name and its docstring. `search` says in which order they come.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from sagnac.core.arrays import BooleanArray, ComplexArray, FloatArray, blocks, square
from sagnac.core.units import EARTH_RATE
from sagnac.lines import detection, joint_fit
from sagnac.lines.components import Components, components_of, joined, mixed_down
from sagnac.lines.sampling import MIX_BLOCK, Sampling, Wander
from sagnac.lines.state import State
from sagnac.lines.wandering import clusters, fit_drifting
from sagnac.table.kinematics import Kinematics, tells_drift
from sagnac.table.motion import follow_table

# --- fit -------------------------------------------------------------------------------------


def looked(state: State) -> State:
    """The power of the increments and its noise floor brought up to date."""
    return replace(state, seen=state.look().floor)


def joined_by(state: State, lines: Components) -> State:
    """New lines, still in the increments, fitted jointly with the known ones, which are not."""
    if lines.size == 0:
        return state
    known = replace(state.components, phasor=np.zeros_like(state.components.phasor))
    flags = joined(known, replace(lines, phasor=np.ones_like(lines.phasor)))
    return _stepped(state, joined(state.components, lines), absent=flags.phasor != 0.0)


def refitted(state: State) -> State:
    """One joint Gauss-Newton step of all lines, if there are any."""
    return _stepped(state, state.components) if state.components.size else state


def _stepped(state: State, components: Components, absent: BooleanArray | None = None) -> State:
    """A joint step of `components`, those but the `absent` ones being out of the increments."""
    sampled, known = state.record.sampled, state.order_sums if components.orders.size else None
    fit = joint_fit.fit(state.steps, sampled, components, absent=absent, known_sums=known)
    after = fit.components
    levels = detection.floors(after, state.record.sampled, state.floor)
    errors = np.sqrt(np.einsum("nii->ni", fit.covariance) * levels[:, np.newaxis])
    moved = (after.phasor - components.phasor).view(np.float64).reshape(-1, 2)
    settled = absent is None and bool(np.all(np.abs(moved) < 0.1 * errors[:, :2]))
    passes = state.passes + joint_fit.pairs_summed(state.record.sampled, components)
    return replace(state, components=after, fit=fit, settled=settled, passes=passes)


# --- judge -----------------------------------------------------------------------------------


def pruned(state: State) -> State:
    """Without the lines that do not stand above the floor."""
    if state.fit is None:
        return state
    threshold = state.record.threshold
    kept = detection.significant(state.fit, state.record.sampled, state.floor, threshold)
    return state if kept.size == state.components.size else _with_components(state, kept)


def pruned_all(state: State) -> State:
    """Without those that do not stand, the others fitted again after each loss."""
    kept = pruned(state)
    while 0 < kept.components.size < state.components.size:
        kept = refitted(refitted(kept))
        state, kept = kept, pruned(kept)
    return kept


def without_earth_orders(state: State) -> State:
    """Without the orders that Earth rate could make as large, until that is settled."""
    reach = state.patience
    if reach is None or state.components.size == 0:
        return state
    components, angles = state.components, state.components.orders.size
    # None below order 1 or beyond the last.
    own = np.interp(np.rint(components.orders), np.arange(1.0, reach.size + 1.0), reach, 0.0, 0.0)
    keep = np.ones(components.size, dtype=bool)
    keep[:angles] = components.free | (components.amplitude[:angles] > own)
    return state if keep.all() else _with_components(state, components.select(keep))


def without_vibration(state: State) -> State:
    """Without tones in bands of vibration, those that drift among them: they are given back.

    Lines that drift side by side are such a band.
    """
    wandering = detection.wandering_bands(tuple(line.band for line in state.drifting))
    state = replace(state, bands=detection.joined_bands((*state.bands, *wandering)))
    known = state.components
    outside = ~detection.inside(known.frequencies, state.bands)
    keep = np.append(np.ones(known.orders.size, bool), outside)
    stay = ~detection.inside(np.array([line.frequency for line in state.drifting]), state.bands)
    if keep.all() and stay.all():
        return state
    drifting = tuple(line for line, own in zip(state.drifting, stay, strict=True) if own)
    return looked(replace(_with_components(state, known.select(keep)), drifting=drifting))


def _with_components(state: State, components: Components) -> State:
    """Other components, which nobody has fitted yet."""
    return replace(state, components=components, fit=None, settled=False)


# --- follow the table ------------------------------------------------------------------------


def settled_motion(state: State, fits: int = 8) -> State:
    """Fit table motion and lines in turn until the share of the table stays.

    Where jitter tells the share, an error of a tone is an error of the share. It stays if what it
    still moves in the residual is a tenth of the noise, or less; no more than `fits` are made.
    """
    after = refitted(followed(state))
    last, motion = state.motion, after.motion
    tones = after.components.frequencies.size
    if fits == 1 or last is None or motion is None or not (tones and motion.drift):
        return after
    jitter = float(np.std(np.diff(motion.kinematics.angle)))
    if abs(motion.share - last.share) * jitter < 0.1 * motion.noise:
        return after
    return replace(settled_motion(after, fits - 1), earth_settled=after.earth_settled)


def followed(state: State) -> State:
    """Table motion and Earth rate fitted again, beside the orders known now and no others.

    The lines are out of what they are fitted to, which were noise to them before; and chance
    orders, which would hide Earth rate, are gone.
    """
    motion = state.motion
    if motion is None:
        return state
    known, table = state.components, motion.kinematics
    own, shared = known.phasor[: known.orders.size], _without_tones(table, known.frequencies)
    averages = state.averages(table.block) + motion.averages + motion.share * (shared - table.angle)
    after = follow_table(averages, table, harmonics=known.orders, phasor=own, shared=shared)
    moved = max(abs(now - was) for now, was in zip(after.earth, motion.earth, strict=True))
    # What harmonics and motion trade with each other, they trade here: nothing of it is left to
    # the fit of the lines, which would meet a residual far above the noise.
    phasor = known.phasor.copy()
    phasor[np.flatnonzero(np.isin(known.orders, after.orders))] = after.phasor
    settled = state.earth_settled or moved <= 0.02 * EARTH_RATE
    state = _with_components(state, replace(known, phasor=phasor))
    return replace(state, motion=after, earth_settled=settled)


def _without_tones(table: Kinematics, tones: FloatArray) -> FloatArray:
    """(averages,) table angle without the tones at some frequencies, cycles a sample.

    If jitter tells the share, a gyro's own tone in that angle would be taken for table motion. If
    the tones make nearly all that the rate varies by, they are motion, and the angle stays.
    """
    angle, place = table.angle, np.arange(table.angle.size)
    for tone in table.block * tones if tells_drift(table) else ():
        # With fewer cycles a tone, or what averages fold it to, is drift.
        if abs(tone - np.rint(tone)) * place.size > 4.0:
            wave, steps = np.exp(2j * np.pi * tone * place), np.diff(angle)
            own = np.diff(wave)
            size = 2.0 * np.vdot(own, steps - steps.mean()) / np.vdot(own, own).real
            angle = angle - (size * wave).real
    return angle if np.std(np.diff(angle)) > 0.1 * np.std(np.diff(table.angle)) else table.angle


def rescaled(state: State) -> State:
    """With tones that follow the table moved to the angle scale, and all fitted again.

    So are orders that do not follow it, to the time scale. The state itself if there are none. A
    line on its right scale takes from its neighbours, which then stand out no more.
    """
    components, sampled = state.components, state.record.sampled
    levels = detection.floors(components, sampled, state.floor)

    def move() -> Components | None:
        moved = rescaled_components(components, state.steps, sampled, levels)
        return moved or timed_components(components, state.steps, sampled, levels, state.look())

    moved = state.record.kept("rescaled", state.key, move)
    return state if moved is None else refitted(refitted(_with_components(state, moved)))


# --- tones that follow the table -------------------------------------------------------------

# Noise levels of a mean by which an order has to say more of the power than a tone, and bins to
# either side, beyond the main lobe of a Hann window, that hold less than what it says more.
_BETTER: Final = 10.0
_BESIDE: Final = np.arange(2, 21)
# How near tones are mixed down at one frequency, as a share of the blocks' rate: their means are
# then short of 2e-4.
_AT_ONCE: Final = 0.01
# Bins to either side in which an order that keeps time leaves sidebands, and how high over the
# floor one of them stands: noise does so once in 5e8 bins.
_SIDEBANDS: Final = 20
_STANDS: Final = 20.0
# Radians rms by which an order strays from a tone at the least: errors of the table angle stray by
# 0.003 at order 64 of a steady table of the disturbed hundred.
_STRAYS: Final = 0.02


def rescaled_components(
    components: Components, steps: FloatArray, sampled: Sampling, levels: FloatArray
) -> Components | None:
    """The components with those moved to the angle scale that follow the table; None if none does.

    A tone is mixed down to zero frequency and its phase compared with the table's
    wander about its mean rate, scaled by the order it would have. At a steady rate the two are
    one, and the component stays in time.

    Parameters
    ----------
    components
        Lines that are out of the increments.
    steps
        (samples - 1,) increments of the angle, rad, without the components.
    sampled
        How the table turns, and strays from a steady rate.
    levels
        (components,) noise floor at each, rad^2.
    """
    angles, frequencies, strays = components.orders.size, components.frequencies, sampled.wander
    if strays is None or sampled.table is None or frequencies.size == 0:
        return None
    orders = 2.0 * np.pi * frequencies / abs(strays.rate)
    # Complex amplitudes of the increments: step n leads from sample n to n + 1.
    phasors = components.phasor[angles:].conj() * (np.exp(2j * np.pi * frequencies) - 1.0)
    # A tone is looked at only if its phase is known so well that an order would look different, by
    # six standard deviations.
    strength = np.abs(phasors) * np.sqrt(steps.size / (2.0 * levels[angles:]))
    shown = orders * float(np.std(strays.phase)) * strength >= 6.0
    moved = np.zeros(components.size, dtype=bool)
    for carrier, means in _mixed_down(steps, frequencies[shown], components.center):
        middles, apart = strays.middles[: means.size], frequencies - carrier
        near = np.abs(apart) < min(0.1 * carrier, 0.25 / MIX_BLOCK)
        for index in np.flatnonzero(shown & (apart >= 0.0) & (apart <= _AT_ONCE / MIX_BLOCK)):
            # Itself and the weaker tones about it are put back: they may be sidebands that the
            # table's wander makes of one order.
            mixed = means.copy()
            for other in np.flatnonzero(near & (np.abs(phasors) <= np.abs(phasors[index]))):
                mixed += 0.5 * phasors[other] * np.exp(2j * np.pi * apart[other] * middles)
            mixed *= np.exp(-2j * np.pi * apart[index] * middles)
            turning = np.sign(strays.rate) * orders[index] * strays.phase[: mixed.size]
            level = float(levels[angles + index]) / steps.size
            moved[angles + index] = _is_better(mixed, np.exp(-1j * turning), level)
    # A servo hunts faster than that: what a tone leaves of an order is a band, as wide as the hunt.
    own = components.phasor[angles:].conj()
    least = 8.5 * np.sqrt(square(steps)) / steps.size
    felt = orders * np.abs(own) * np.std(sampled.speeds) > least
    for at in np.flatnonzero(~moved[angles:] & felt):
        moved[angles + at] = _is_order(frequencies[at], own[at], steps, sampled.table, strays)
    if not moved.any():
        return None
    orders = orders[moved[angles:]]
    # Whole where it is not told from whole.
    whole = np.abs(orders - np.rint(orders)) * sampled.turns < 0.5
    orders, none = np.where(whole, np.rint(orders), orders), np.empty(0)
    in_angle = replace(components.select(moved), orders=orders, free=~whole, frequencies=none)
    return joined(components.select(~moved), in_angle)


def _is_order(
    tone: float, phasor: complex, steps: FloatArray, table: FloatArray, strays: Wander
) -> bool:
    """Whether a tone, cycles a sample, left in the steps what it would leave of an order."""
    order, sums = 2.0 * np.pi * tone / strays.rate, np.zeros((4, 4))
    # A block makes a dozen rows: longer blocks raised the peak of two hours by 20 MiB.
    for some in blocks(steps.size, 2**14):
        number = np.arange(some.start, some.stop + 1) - 0.5 * steps.size
        stray = table[some.start : some.stop + 1] - strays.rate * number - strays.origin
        wave = phasor * np.exp(2j * np.pi * tone * number)
        left = wave * (np.exp(1j * order * stray) - 1.0)
        rows = np.vstack([np.diff([left.real, wave.real, wave.imag]), steps[some]])
        sums += rows @ rows.T
        if some.stop < min(2**18, steps.size):
            continue
        # A line that keeps time, or wanders by itself, has a share of zero.
        inverse = np.linalg.inv(sums[:3, :3])
        share, error = inverse[0] @ sums[:3, 3], np.sqrt(inverse[0, 0] * sums[3, 3] / some.stop)
        # A share of 0 or 1 is ten of these errors from a half: more samples change nothing.
        if error < 0.05:
            break
    return bool(abs(share - 1.0) < 0.5 and share > 6.0 * error)


def timed_components(
    components: Components,
    steps: FloatArray,
    sampled: Sampling,
    levels: FloatArray,
    left: detection.Spectrum,
) -> Components | None:
    """The components with those orders moved to the time scale that keep time; None if none does.

    A whole order counts twice where a tone might be meant, and a tone within a bin of one is taken
    for it. If the table's rate wanders, sidebands of that are left beside it.

    Parameters
    ----------
    components, steps, sampled, levels
        As of `rescaled_components`.
    left
        Of the steps.
    """
    strays = sampled.wander
    if strays is None or components.orders.size == 0:
        return None
    moved, tones = np.zeros(components.size, dtype=np.bool_), []
    for index in _with_sidebands(components, strays, left):
        order, phasor = float(components.orders[index]), complex(components.phasor[index])
        tone = _tone_of(order, phasor, steps, strays, float(levels[index]))
        if tone is not None:
            moved[index] = True
            tones.append(tone)
    if not tones:
        return None
    frequencies, phasors = (np.array(each) for each in zip(*tones, strict=True))
    in_time = components_of(steps.size + 1, frequencies=frequencies, phasor=phasors)
    return joined(components.select(~moved), in_time)


def _with_sidebands(components: Components, strays: Wander, left: detection.Spectrum) -> list[int]:
    """Places of the orders that stray, beside whose mean frequency something stands."""
    bins = components.orders * abs(strays.rate) / (2.0 * np.pi) * 2.0 * (left.floor.size - 1)
    places = np.rint(bins).astype(np.int64) + np.arange(-_SIDEBANDS, _SIDEBANDS + 1)[:, np.newaxis]
    places = np.clip(places, 0, left.floor.size - 1)
    highest = (left.power[::2][places] / left.floor[places]).max(axis=0)
    strays_far = components.orders * float(np.std(strays.phase)) > _STRAYS
    return np.flatnonzero(strays_far & (highest > _STANDS) & (bins < left.floor.size - 1)).tolist()


def _tone_of(
    order: float, phasor: complex, steps: FloatArray, strays: Wander, level: float
) -> tuple[float, complex] | None:
    """Frequency, cycles a sample, and phasor of the tone that an order is; None if it is none.

    `level` is the noise floor of the order, whose phasor is out of the steps.
    """
    speed, sign = abs(strays.rate), float(np.sign(strays.rate))
    carrier, forwards = order * speed / (2.0 * np.pi), phasor.conjugate() if sign > 0.0 else phasor
    mixed = mixed_down(steps, np.array([carrier]), 0.5 * steps.size)[:, 0]
    turning = np.exp(1j * sign * order * (strays.phase + strays.origin))[: mixed.size]
    mixed += 0.5 * forwards * (np.exp(1j * order * speed) - 1.0) * turning
    # Within a bin and a half, an eighth of one apart.
    apart, middles = np.arange(-12, 13) / (8.0 * steps.size), strays.middles[: mixed.size]
    means = np.array([np.mean(mixed * np.exp(-2j * np.pi * one * middles)) for one in apart])
    best = int(np.argmax(np.abs(means)))
    wave = np.exp(-2j * np.pi * apart[best] * middles)
    if not _is_better(mixed * turning.conj(), wave * turning, level / steps.size):
        return None
    frequency = carrier + float(apart[best])
    step = np.exp(2j * np.pi * frequency) - 1.0
    return frequency, complex(2.0 * means[best] / step).conjugate()


def _is_better(mixed: ComplexArray, turning: ComplexArray, level: float) -> bool:
    """Whether a line that was mixed down by one phase holds more power if it is turned to another.

    `turning`, of size one, leads from the first phase to the second; `level` is the noise in the
    power of a mean of all increments.
    """
    turned = mixed * turning
    power = float(np.abs(turned.mean())) ** 2
    gain = power - float(np.abs(mixed.mean())) ** 2
    # Power that turning takes from a line of the first phase. A line of the second phase gains as
    # much by it; a weak line beside a strong one gains less than half of that, by chance.
    takes = 1.0 - float(np.abs(turning.mean())) ** 2
    if gain <= max(_BETTER * level, 0.5 * takes * power):
        return False
    # An order gathers what its tone leaves beside it. A line that drifts gains a little by chance,
    # and the rest of it stands there still. The squares of a Hann window add up to 3/8.
    spectrum = np.abs(np.fft.fft(turned * np.hanning(turned.size))) ** 2
    beside = float(spectrum[_BESIDE].sum() + spectrum[-_BESIDE].sum())
    return gain > beside / (0.375 * turned.size**2)


def _mixed_down(
    steps: FloatArray, frequencies: FloatArray, center: float
) -> Iterator[tuple[float, ComplexArray]]:
    """Carriers, cycles a sample, and means of the steps mixed down from each to zero frequency.

    A carrier serves all the frequencies that are near above it; some share a pass over the steps.
    """
    carriers: list[float] = []
    for frequency in np.sort(frequencies).tolist():
        if not carriers or frequency - carriers[-1] > _AT_ONCE / MIX_BLOCK:
            carriers.append(frequency)
    # The means of a day take 14 MiB for each.
    for some in blocks(len(carriers), 8):
        means = mixed_down(steps, np.array(carriers[some]), center)
        yield from zip(carriers[some], means.T.copy(), strict=True)


# --- lines that drift ------------------------------------------------------------------------


def gathered(state: State, restless: FloatArray) -> State:
    """With one drifting line for each cluster of tones that it describes better.

    Parameters
    ----------
    state
        Looked at, its lines fitted.
    restless
        Frequencies, cycles a sample, of tones beside which peaks stand: each may drift by itself.
    """
    while True:
        after = _with_one_gathered(state, restless)
        if len(after.drifting) == len(state.drifting):
            return after
        state = looked(refitted(after))


def _with_one_gathered(state: State, restless: FloatArray) -> State:
    """With the first cluster that a drifting line describes better made one; others are noted."""
    components, fit = state.components, state.fit
    if fit is None or components.size == 0:
        return state
    angles, samples = components.orders.size, state.record.angle.size
    frequencies, amplitudes = components.frequencies, components.phasor[angles:].conj()
    levels = detection.floors(components, state.record.sampled, state.floor)
    # Tones that may be one that drifts: clusters, the strongest of each first, and the restless.
    suspects = clusters(frequencies, detection.significances(fit, levels)[angles:], samples)
    alone = (np.abs(frequencies[:, np.newaxis] - restless) * samples < 1.0).any(axis=1)
    for group in (*suspects, *np.flatnonzero(alone)[:, np.newaxis]):
        # Where they lie, to a quarter of a cycle a record: a refit moves the last digits.
        key = tuple(np.rint(4.0 * frequencies[group] * samples).astype(int).tolist())
        if key in state.steady:
            continue
        tones = frequencies[group], amplitudes[group], float(levels[angles + group[0]])
        gathered = fit_drifting(state.steps, *tones, center=components.center)
        if gathered is None:
            state = replace(state, steady=state.steady | {key})
            continue
        keep = np.ones(components.size, dtype=bool)
        keep[angles + group[gathered.replaced]] = False
        state = _with_components(state, components.select(keep))
        return replace(state, drifting=(*state.drifting, gathered))
    return state
