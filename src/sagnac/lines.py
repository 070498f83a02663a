"""Periodic components in table angle and in time: found, refined, fitted, removed.

The search judges every candidate against the noise floor at its own frequency, over the
whole band to Nyquist, with one false-alarm probability for the whole candidate set.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from sagnac import _kernels, regression, rotation, spectrum
from sagnac.orthogonal_search import OrthogonalSearch, fast_orthogonal_search
from sagnac.recording import FloatArray
from sagnac.regression import ComponentFit, Components
from sagnac.units import ARCSECOND

Scale = Literal["angle", "time"]

# Below this many cycles a record nothing can be told from the random walk.
_LOWEST_CYCLES: Final = 4
# Integer orders that count as the table's own; a higher one is a line in time until the
# table's unsteadiness shows otherwise.
_MOST_ORDERS: Final = 128
# Periodic error that an encoder may have, rad.
_ENCODER_ERROR: Final = 5.0 * ARCSECOND
# Candidates of Step 1 as published: whole orders up to this one.
_PUBLISHED_ORDERS: Final = 64
_MOST_LINES: Final = 250
_ROUNDS: Final = 6
_PEAKS_A_ROUND: Final = 64
# Bins on each side of a line whose noise the fit takes with the line.
_TAKEN_BINS: Final = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """One periodic component of a gyro angle or of a difference of two.

    Attributes
    ----------
    scale
        ``angle``: periodic in table angle; ``time``: periodic in time.
    frequency
        Cycles per turn (the order) on the angle scale, Hz on the time scale.
    frequency_error
        Standard deviation of `frequency`; 0 where the order was given, not fitted.
    amplitude, amplitude_error
        Peak amplitude of the angle and its standard deviation, rad.
    phase, phase_error
        rad, of ``amplitude * cos(2 pi f t + phase)`` at the first sample, or of
        ``amplitude * cos(order * alpha + phase)``.
    significance
        Drop of -2 log likelihood that the line brings.
    channel
        ``x`` or ``x-z``.
    name
        What it is where that is known: ``sideband of 50 Hz at the table rate``.
    """

    scale: Scale
    frequency: float
    frequency_error: float
    amplitude: float
    amplitude_error: float
    phase: float
    phase_error: float
    significance: float
    channel: str
    name: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Removal:
    """What `remove_lines` leaves, and what it took.

    Attributes
    ----------
    residual
        (samples,) the angle without table motion and lines, rad.
    lines
        Strongest first.
    masked
        (low, high) bands in Hz whose noise went with the lines.
    notes
        What was noticed.
    """

    residual: FloatArray
    lines: tuple[Line, ...]
    masked: tuple[tuple[float, float], ...]
    notes: tuple[str, ...]


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

    Table motion and Earth rate first (`rotation.follow_table`); then rounds of integer
    orders of table angle and of lines in time, each round ended by a joint Gauss-Newton
    fit of all components, until nothing exceeds the noise floor; then both scales are
    compared for each line, and the whole is fitted once more.

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
    """
    report = progress or (lambda _: None)
    turning = table if rotation.is_turning(table) else None
    turns = 0.0 if turning is None else rotation.full_turns(turning)
    notes: list[str] = []
    threshold = detection_threshold(angle.size // 2, false_alarm)
    components = regression.no_components(angle.size)
    fit: ComponentFit | None = None
    rest, alpha = _without_motion(angle, turning, None, sample_rate, notes)
    residual = rest
    floor = _floor(residual)
    reach = None if alpha is None else _earth_amplitudes(alpha, sample_rate)
    for number in range(_ROUNDS):
        report(number / _ROUNDS)
        first = number == 0
        found = 0
        before = components
        while alpha is not None and (first or turns >= rotation.FEW_TURNS):
            orders = _new_orders(
                residual,
                alpha,
                components,
                floor=floor,
                threshold=threshold,
                reach=reach if first else None,
            )
            if orders.size == 0:
                break
            components = regression.joined(components, orders)
            fit = _refitted(rest, alpha, components, fit)
            components = fit.components
            residual = regression.removed(rest, alpha, components)
            floor = _floor(residual)
            found += orders.size
            if turns >= rotation.FEW_TURNS:
                break
        tones = _new_tones(residual, None if not first else alpha, components, floor, threshold)
        components = regression.joined(components, tones)
        found += tones.size
        if found == 0 and not first:
            break
        if components.size:
            fit = _refitted(rest, alpha, components, fit)
            components = _significant(fit, alpha, floor, threshold)
            if first and reach is not None:
                keep = np.ones(components.size, dtype=bool)
                angles = components.orders.size
                own = reach[components.orders.astype(np.int64) - 1]
                keep[:angles] = components.amplitude[:angles] > own
                components = components.select(keep)
        # Over part of a turn harmonics and table motion trade with each other: one fit of motion.
        if turning is not None and turns >= rotation.FEW_TURNS:
            # Table motion was fitted with these lines for noise; they are out of it now. And
            # chance orders, which would hide Earth rate from it, are gone.
            rest, alpha = _without_motion(angle, turning, components, sample_rate, notes)
            if components.size:
                fit = _refitted(rest, alpha, components, fit)
                components = fit.components
        residual = regression.removed(rest, alpha, components)
        floor = _floor(residual)
        if not first and _same(before, components):
            # What was found did not stand once fitted with the rest, and would not next time.
            break
        if components.size > _MOST_LINES:
            notes.append(
                f"the search stopped at {components.size} lines; more peaks stand above the floor"
            )
            break
    else:
        notes.append(
            f"the search stopped after {_ROUNDS} rounds; weaker peaks may still stand "
            "above the floor"
        )
    rescaled = _rescaled(residual, alpha, components, floor)
    lines: tuple[Line, ...] = ()
    masked: tuple[tuple[float, float], ...] = ()
    if components.size:
        if rescaled is not components:
            fit = _refitted(rest, alpha, rescaled, fit)
            components = fit.components
        fit = _refitted(rest, alpha, components, fit)
        # A line on its right scale takes from its neighbours, which then stand out no more.
        while (kept := _significant(fit, alpha, floor, threshold)).size < fit.components.size:
            again = _refitted(rest, alpha, kept, fit)
            fit = _refitted(rest, alpha, again.components, again)
        residual = regression.removed(rest, alpha, fit.components)
        floor = _floor(residual)
        lines = _described(fit, alpha, floor, sample_rate, channel)
        masked = _taken(lines, alpha, sample_rate, angle.size)
        if fit.collinear:
            notes.append(
                f"{fit.collinear} directions among the lines of {channel} cannot be told apart "
                "(angle and time coincide at this steady rate); their sum is removed, their "
                "single amplitudes are not to be trusted"
            )
    report(1.0)
    return Removal(residual=residual, lines=lines, masked=masked, notes=tuple(notes))


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
    if table is not None and rotation.is_turning(table):
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
    width = _TAKEN_BINS / duration
    masked = tuple(
        (line.frequency - width, line.frequency + width) for line in lines if line.scale == "time"
    )
    report(1.0)
    return Removal(residual=rest, lines=tuple(lines), masked=masked, notes=())


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


def detection_threshold(bins: int, false_alarm: float) -> float:
    """Ratio of power to floor that noise exceeds anywhere with probability `false_alarm`.

    The maximum of a periodogram over continuous frequency, not over its bins alone:
    ``bins * sqrt(pi p / 3) * exp(-p) = false_alarm``, the mean number of upcrossings of
    level p by a chi-square field of two degrees of freedom (Rice's formula). Where the floor
    is only known with a relative error s, as `spectrum.noise_floor` knows it, exp(-p)
    averages to exp(-p + (s p)^2 / 2), which for a few thousand bins is a third more.
    """
    scatter = spectrum.floor_scatter(bins)
    return float(
        brentq(
            lambda p: (
                np.log(bins)
                + 0.5 * np.log(np.pi * p / 3.0)
                - p
                + 0.5 * (scatter * p) ** 2
                - np.log(false_alarm)
            ),
            1.0,
            100.0,
        )
    )


def _same(first: Components, second: Components) -> bool:
    """Whether both hold the same lines, to within a bin."""
    return (
        np.array_equal(first.orders, second.orders)
        and first.frequencies.size == second.frequencies.size
        and bool(
            np.all(
                np.abs(np.sort(first.frequencies) - np.sort(second.frequencies))
                * (2.0 * first.center)
                < 1.0
            )
        )
    )


def _floor(residual: FloatArray) -> FloatArray:
    return spectrum.noise_floor(spectrum.periodogram(_increments(residual)))


def _increments(angle: FloatArray) -> FloatArray:
    """Differences of `angle` without their mean; the first, of nothing before it, is zero."""
    steps = np.diff(angle, prepend=angle[0])
    steps[1:] -= steps[1:].mean()
    return steps


def _without_motion(
    angle: FloatArray,
    table: FloatArray | None,
    components: Components | None,
    sample_rate: float,
    notes: list[str],
) -> tuple[FloatArray, FloatArray | None]:
    """`angle` less table motion, lines still in it; and the table angle the gyro saw.

    `components` are the lines known so far, None if nothing is known yet.
    """
    if table is None:
        return angle, None
    without, harmonics = angle, None
    if components is not None:
        taken = np.ones(components.size, dtype=bool)
        highest = rotation.highest_harmonic(table, sample_rate)
        taken[: components.orders.size] = components.orders > highest
        without = regression.removed(angle, table, components.select(taken))
        harmonics = components.orders
    motion = rotation.follow_table(without, table, sample_rate, harmonics=harmonics)
    if abs(motion.lag) * sample_rate > 0.05:
        note = (
            f"the encoder is {1e3 * motion.lag:+.2f} ms from the gyro in time; "
            "the table angle was shifted by that"
        )
        notes[:] = [kept for kept in notes if not kept.startswith("the encoder is")] + [note]
    return angle - (without - motion.residual), motion.table


def _refitted(
    rest: FloatArray,
    alpha: FloatArray | None,
    components: Components,
    earlier: ComponentFit | None,
) -> ComponentFit:
    return regression.fit(_increments(rest)[1:], alpha, components, earlier=earlier)


# --- candidates --------------------------------------------------------------------------


def _new_orders(
    residual: FloatArray,
    alpha: FloatArray,
    known: Components,
    *,
    floor: FloatArray,
    threshold: float,
    reach: FloatArray | None,
) -> Components:
    """Integer orders of table angle that stand above the floor and are not known yet.

    With `reach`, of `_earth_amplitudes`, only those larger than Earth rate could make; the
    others wait until Earth rate is fitted beside the known ones.
    """
    speed = _speeds(alpha)
    fastest = float(speed.max())
    highest = min(_MOST_ORDERS, int(np.pi / fastest)) if fastest > 0.0 else 0
    if highest < 1:
        return known.select(np.zeros(known.size, dtype=bool))
    sums = _order_sums(residual, alpha, highest)
    orders = np.arange(1.0, highest + 1.0)
    length = residual.size * _mean_square_step(orders, speed) / 2.0
    ratio = np.abs(sums) ** 2 / length / (2.0 * _floor_of_orders(orders, speed, floor))
    ratio[np.isin(orders, known.orders[~known.free])] = 0.0
    turns = rotation.full_turns(alpha)
    # Orders closer than one cycle over the whole range, or fewer cycles than one from table motion
    # itself, are not told apart.
    for order in known.orders:
        ratio[np.abs(orders - order) * turns < 0.99] = 0.0
    if reach is not None:
        ratio[np.abs(sums) / length < reach[:highest]] = 0.0
    chosen = np.flatnonzero((ratio > threshold) & (orders * turns > 0.99))
    if turns < rotation.FEW_TURNS and chosen.size:
        # One a round, the strongest first, as orthogonal search does.
        chosen = chosen[[int(np.argmax(ratio[chosen]))]]
    return replace(
        regression.no_components(residual.size),
        orders=orders[chosen],
        free=np.zeros(chosen.size, dtype=bool),
        cosine=sums.real[chosen] / length[chosen],
        sine=-sums.imag[chosen] / length[chosen],
    )


def _earth_amplitudes(alpha: FloatArray, sample_rate: float) -> FloatArray:
    """(orders,) largest amplitude, rad, that Earth rate on an unsteady table puts into each order.

    0 for order 1, in which Earth rate and the harmonic are one at a steady table (Eq. 16).
    """
    orders = np.arange(1.0, _MOST_ORDERS + 1.0)
    # The table turns slowly beside the samples: every so-many-th angle tells the same.
    stride = max(1, int(1.0 / (_MOST_ORDERS * float(_speeds(alpha).max()) + 1e-9)))
    stride = min(stride, max(1, alpha.size // 10_000))
    alpha = alpha[::stride]
    sample_rate = sample_rate / stride
    length = alpha.size * _mean_square_step(orders, _speeds(alpha)) / 2.0
    largest = np.zeros(_MOST_ORDERS)
    # Order 1 is what a steady table would make of it; it goes first, since with ripple in the rate
    # neighbouring orders are not orthogonal to it and would not show beside it.
    rate = float(alpha[-1] - alpha[0]) / (alpha.size - 1) * sample_rate
    path = rotation.mean_rate(alpha, sample_rate)
    steady = 1.0 / rate if abs(rate) > 0.5 * abs(path) else 0.0
    for projection, whole in ((np.cos, np.sin(alpha)), (np.sin, -np.cos(alpha))):
        integral = np.cumsum(projection(alpha)) / sample_rate
        sums = _order_sums(integral - steady * whole, alpha, _MOST_ORDERS)
        largest = np.maximum(largest, np.abs(sums) / np.maximum(length, np.finfo(float).tiny))
    largest[0] = 0.0
    return 2.0 * rotation.EARTH_RATE * largest


def _order_sums(angle: FloatArray, alpha: FloatArray, highest: int) -> NDArray[np.complex128]:
    """Inner products of increments of `angle` and of exp(-i k alpha), k = 1 ... `highest`.

    Summed by parts: increments of the exponential against the data's are the exponential
    itself against the data's second differences.
    """
    steps = _increments(angle)
    strengths = steps
    strengths[:-1] -= steps[1:]
    return spectrum.angle_sums(alpha, strengths, highest)[1:]


def _new_tones(
    residual: FloatArray,
    alpha: FloatArray | None,
    known: Components,
    floor: FloatArray,
    threshold: float,
) -> Components:
    """Peaks of the spectrum above the floor that no stronger peak's leakage explains.

    Given `alpha`, peaks at whole orders of it are left to the angle scale.
    """
    steps = _increments(residual)
    sums = spectrum.transform(steps, padding=2)
    power = (np.square(sums.real) + np.square(sums.imag)) / steps.size
    level = np.interp(np.arange(power.size), 2.0 * np.arange(floor.size), floor)
    # In red noise the jump from the record's end to its start leaks with one sign into whole
    # bins and with the other into the halves between, whose floor may be twice as high.
    halves = spectrum.noise_floor(np.append(power[1::2], power[-2]))
    ratio = power / np.maximum(level, np.repeat(halves, 2)[: power.size])
    ratio[: 2 * _LOWEST_CYCLES] = 0.0
    inner = ratio[1:-1]
    # A peak midway between padded bins shows 0.9 of its height: one below the threshold by
    # that much may be above it once refined, and is pruned there if it is not.
    peaks = 1 + np.flatnonzero(
        (inner > 0.9 * threshold) & (inner >= ratio[:-2]) & (inner > ratio[2:])
    )
    chosen: list[int] = []
    leakage = np.zeros(peaks.size)
    blocked = np.zeros(peaks.size, dtype=bool)
    for at in np.argsort(power[peaks])[::-1]:
        # Sidelobes of a rectangular window fall as 1 / (pi * bins)^2; ten times that leaves room
        # for several of them adding up. What waits is found in the next round.
        if blocked[at] or power[peaks[at]] < 10.0 * leakage[at]:
            continue
        chosen.append(int(peaks[at]))
        if len(chosen) == _PEAKS_A_ROUND:
            break
        distance = np.abs(peaks - peaks[at]) / 2.0
        blocked |= distance < 1.5
        leakage += power[peaks[at]] / (np.pi * np.maximum(distance, 1.0)) ** 2
    index = np.array(sorted(chosen), dtype=np.int64)
    frequency = (index + _parabola(ratio, index)) / (2.0 * (power.size - 1))
    nothing = regression.no_components(residual.size)
    taken = known.frequencies
    if alpha is not None:
        rate = abs(float(alpha[-1] - alpha[0])) / (2.0 * np.pi * (alpha.size - 1))
        taken = np.concatenate([taken, np.arange(1.0, _MOST_ORDERS + 1.0) * rate])
    near = np.array([np.any(np.abs(taken - f) * steps.size < 1.0) for f in frequency], dtype=bool)
    index, frequency = index[~near], frequency[~near]
    turn = np.exp(2j * np.pi * frequency)
    # The sum taken at the bin, its phase carried to mid-record where it does not depend on
    # the fraction of a bin that the peak is off.
    at_bin = np.exp(2j * np.pi * index / (2.0 * (power.size - 1)) * nothing.center)
    # Step n leads from sample n - 1 to n.
    tone = 2.0 / steps.size * sums[index] * at_bin / (1.0 - 1.0 / turn)
    return replace(nothing, frequencies=frequency, cosine=tone.real, sine=-tone.imag)


def _parabola(power: FloatArray, index: NDArray[np.int64]) -> FloatArray:
    """Offset in bins of the top of a parabola through three ordinates."""
    left, top, right = power[index - 1], power[index], power[index + 1]
    return np.asarray(0.5 * (left - right) / (left - 2.0 * top + right))


# --- judgement ---------------------------------------------------------------------------


def _speeds(alpha: FloatArray) -> FloatArray:
    """Table speeds, rad a sample, at a few hundred evenly spaced ranks."""
    block = max(1, alpha.size // 4000)
    speed = np.sort(np.abs(np.diff(alpha[::block]))) / block
    return speed[np.linspace(0, speed.size - 1, min(200, speed.size)).astype(np.int64)]


def _mean_square_step(orders: FloatArray, speed: FloatArray) -> FloatArray:
    """Mean square increment of exp(i k alpha), for each order."""
    return np.asarray((4.0 * np.sin(np.outer(orders, speed) / 2.0) ** 2).mean(axis=1))


def _floor_of_orders(orders: FloatArray, speed: FloatArray, floor: FloatArray) -> FloatArray:
    """Noise floor that each order meets: over the frequencies it sweeps, weighted by power."""
    frequency = np.outer(orders, speed) / (2.0 * np.pi)
    weight = np.sin(np.pi * frequency) ** 2
    bins = np.minimum(frequency * (2.0 * (floor.size - 1)), floor.size - 1).astype(np.int64)
    total = weight.sum(axis=1)
    total[total == 0.0] = 1.0
    return np.asarray((floor[bins] * weight).sum(axis=1) / total)


def _floors(components: Components, alpha: FloatArray | None, floor: FloatArray) -> FloatArray:
    """(components,) noise floor at each component's own frequency."""
    bins = np.rint(components.frequencies * (2.0 * (floor.size - 1))).astype(np.int64)
    in_time = floor[np.clip(bins, 0, floor.size - 1)]
    if alpha is None or components.orders.size == 0:
        return in_time
    return np.concatenate([_floor_of_orders(components.orders, _speeds(alpha), floor), in_time])


def _significances(fit: ComponentFit, levels: FloatArray) -> FloatArray:
    """(components,) Wald statistic of each pair of amplitudes, chi-square with 2 dof."""
    pair = np.stack([fit.components.cosine, fit.components.sine], axis=1)
    block = fit.covariance[:, :2, :2]
    # A pseudo-inverse: of two components that coincide, each direction counts once.
    precision = np.linalg.pinv(block, rcond=1e-9, hermitian=True)
    return np.asarray(np.einsum("ni,nij,nj->n", pair, precision, pair) / levels)


def _significant(
    fit: ComponentFit, alpha: FloatArray | None, floor: FloatArray, threshold: float
) -> Components:
    """The components that stand above the floor with all others fitted beside them."""
    levels = _floors(fit.components, alpha, floor)
    lowest = _LOWEST_CYCLES / (2.0 * (floor.size - 1))
    significance = _significances(fit, levels)
    keep = significance > 2.0 * threshold
    in_time = slice(fit.components.orders.size, None)
    frequencies = fit.components.frequencies
    keep[in_time] &= frequencies >= 0.75 * lowest
    # Two that moved to one frequency share one line between them, with amplitudes that mean
    # nothing: the stronger takes it.
    order = np.argsort(frequencies)
    close = np.flatnonzero(np.diff(frequencies[order]) * fit.components.center * 2.0 < 0.5)
    for first, second in zip(order[close], order[close + 1], strict=True):
        weaker = min(first, second, key=lambda index: float(significance[in_time][index]))
        keep[fit.components.orders.size + weaker] = False
    return fit.components.select(keep)


def _rescaled(
    residual: FloatArray, alpha: FloatArray | None, components: Components, floor: FloatArray
) -> Components:
    """Components in time that follow the table better, moved to the angle scale.

    A tone is mixed down to zero frequency and its phase compared with the table's
    wander about its mean rate, scaled by the order it would have. At a steady rate the two are
    one, and the component stays in time.
    """
    if alpha is None or components.frequencies.size == 0:
        return components
    number = np.arange(alpha.size) - components.center
    rate = float(number @ (alpha - alpha.mean())) / float(number @ number)
    path = float(np.abs(np.diff(alpha[:: max(1, alpha.size // 4000)])).sum())
    if abs(rate) * alpha.size < 0.5 * path:
        # A table that goes back and forth has no rate that a tone could be an order of.
        return components
    wander = alpha - alpha.mean() - rate * number
    levels = _floors(components, alpha, floor)[components.orders.size :]
    spread = float(np.std(wander))
    steps = _increments(residual)
    moved = np.zeros(components.size, dtype=bool)
    orders: list[float] = []
    block = _kernels.MIX_BLOCK
    middles = np.arange(steps.size // block) * block + 0.5 * (block - 1) - components.center
    in_time = slice(components.orders.size, None)
    # Increments of the components: step n leads from sample n - 1 to n.
    phasors = components.cosine[in_time] - 1j * components.sine[in_time]
    phasors = phasors * (1.0 - np.exp(-2j * np.pi * components.frequencies))
    for index, frequency in enumerate(components.frequencies, start=components.orders.size):
        order = 2.0 * np.pi * frequency / abs(rate)
        level = levels[index - components.orders.size]
        own = np.abs(phasors[index - components.orders.size])
        strength = own * np.sqrt(steps.size / (2.0 * level))
        if order * spread * strength < 6.0:
            continue
        mixed = _kernels.mixed_down(steps, frequency, components.center)
        # Neighbours too are put back: sidebands that the table's wander makes of one order.
        for other in np.flatnonzero(
            np.abs(components.frequencies - frequency) < min(0.1 * frequency, 0.25 / block)
        ):
            apart = components.frequencies[other] - frequency
            mixed += 0.5 * phasors[other] * np.exp(2j * np.pi * apart * middles)
        mean_wander = wander[: mixed.size * block].reshape(-1, block).mean(axis=1)
        turned = mixed * np.exp(-1j * np.sign(rate) * order * mean_wander)
        if np.abs(turned.mean()) ** 2 > np.abs(mixed.mean()) ** 2 + 10.0 * level / steps.size:
            moved[index] = True
            orders.append(order)
    if not orders:
        return components
    kept = components.select(~moved)
    taken = components.select(moved)
    as_orders = np.array(orders)
    rounded = np.rint(as_orders)
    whole = np.abs(as_orders - rounded) * rotation.full_turns(alpha) < 0.5
    return regression.joined(
        kept,
        replace(
            taken,
            orders=np.where(whole, rounded, as_orders),
            free=~whole,
            frequencies=np.empty(0),
        ),
    )


# --- description -------------------------------------------------------------------------


def _described(
    fit: ComponentFit,
    alpha: FloatArray | None,
    floor: FloatArray,
    sample_rate: float,
    channel: str,
) -> tuple[Line, ...]:
    """The components as lines, strongest first, named where their frequency says what they are."""
    components = fit.components
    levels = _floors(components, alpha, floor)
    significance = _significances(fit, levels)
    lines: list[Line] = []
    for index in range(components.size):
        a, b = float(components.cosine[index]), float(components.sine[index])
        amplitude = float(np.hypot(a, b))
        covariance = fit.covariance[index] * levels[index]
        along = np.array([a, b]) / amplitude
        across = np.array([-b, a]) / amplitude
        error = float(np.sqrt(max(along @ covariance[:2, :2] @ along, 0.0)))
        phase_error = float(np.sqrt(max(across @ covariance[:2, :2] @ across, 0.0))) / amplitude
        frequency_error = float(np.sqrt(covariance[2, 2]))
        phase = -np.arctan2(b, a)
        if index < components.orders.size:
            scale: Scale = "angle"
            frequency = float(components.orders[index])
        else:
            scale = "time"
            cycles = float(components.frequencies[index - components.orders.size])
            # Phase at the first sample; a fitted frequency adds its own error over half the record.
            phase -= 2.0 * np.pi * cycles * components.center
            phase_error = float(
                np.hypot(phase_error, 2.0 * np.pi * components.center * frequency_error)
            )
            frequency, frequency_error = cycles * sample_rate, frequency_error * sample_rate
        lines.append(
            Line(
                scale=scale,
                frequency=frequency,
                frequency_error=frequency_error,
                amplitude=amplitude,
                amplitude_error=error,
                phase=float(np.angle(np.exp(1j * phase))),
                phase_error=phase_error,
                significance=float(significance[index]),
                channel=channel,
            )
        )
    lines.sort(key=lambda line: -line.significance)
    turn_rate = 0.0 if alpha is None else abs(rotation.mean_rate(alpha, sample_rate)) / (2 * np.pi)
    resolution = sample_rate / (2.0 * (floor.size - 1))
    return tuple(
        replace(line, name=_name(line, lines[:rank], turn_rate, resolution))
        for rank, line in enumerate(lines)
    )


def _name(line: Line, stronger: list[Line], turn_rate: float, resolution: float) -> str:
    """What a line is, where its frequency beside a stronger one's says so."""
    if line.scale == "angle":
        # Harmonics are removed in the angle that the encoder reports. Its periodic error, some
        # arcseconds at a low order, leaves sidebands of order * error / 2 beside each of them.
        for other in stronger:
            apart = abs(line.frequency - other.frequency)
            reach = other.amplitude * max(other.frequency, 1.0) * _ENCODER_ERROR
            if other.scale == "angle" and 0.5 < apart < 2.5 and line.amplitude < reach:
                return f"sideband of order {other.frequency:g} (encoder error)"
        whole = line.frequency == np.rint(line.frequency)
        return "" if whole else "non-integer order"
    if turn_rate == 0.0:
        return ""
    for other in stronger:
        base = other.frequency if other.scale == "time" else other.frequency * turn_rate
        if other.amplitude < 10.0 * line.amplitude:
            continue
        for multiple in (1, 2):
            if abs(abs(line.frequency - base) - multiple * turn_rate) < 2.0 * resolution:
                parent = f"{base:.6g} Hz" if other.scale == "time" else f"order {other.frequency:g}"
                times = "the table rate" if multiple == 1 else "twice the table rate"
                return f"sideband of {parent} at {times}"
        if other.scale == "time" and abs(line.frequency - base) < 20.0 * resolution:
            return f"sideband of {base:.6g} Hz (its amplitude or frequency drifts)"
        if other.scale == "angle" and abs(line.frequency - base) < 0.01 * base:
            return f"sideband of order {other.frequency:g} (table jitter)"
    return ""


def _taken(
    lines: tuple[Line, ...], alpha: FloatArray | None, sample_rate: float, samples: int
) -> tuple[tuple[float, float], ...]:
    """Bands in Hz in which the fit took the noise with the line."""
    width = _TAKEN_BINS * sample_rate / samples
    bands: list[tuple[float, float]] = []
    for line in lines:
        if line.scale == "time":
            bands.append((line.frequency - width, line.frequency + width))
        elif alpha is not None:
            speed = _speeds(alpha) * sample_rate / (2.0 * np.pi)
            low, high = float(speed[0]), float(speed[-1])
            # Spread over many bins, a component takes two of many ordinates: nothing to mask.
            if line.frequency * (high - low) < 20.0 * width:
                center = 0.5 * (low + high) * line.frequency
                bands.append((center - 10.0 * width, center + 10.0 * width))
    return tuple(bands)
