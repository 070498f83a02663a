"""Periodic components in table angle and in time: found, refined, fitted, removed."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController

from sagnac import _kernels, detection, drift, regression, rotation, series, spectrum
from sagnac.detection import Residue
from sagnac.drift import DriftingLine
from sagnac.orthogonal_search import OrthogonalSearch, fast_orthogonal_search
from sagnac.recording import FloatArray
from sagnac.regression import ComponentFit, Components
from sagnac.units import ARCSECOND

Scale = Literal["angle", "time"]

# Spans of a record are shared out among threads; products within them are not.
_BLAS: Final = ThreadpoolController()
# Lag of the encoder, in samples, that is worth a note.
_SEEN_LAG: Final = 0.05
# Periodic error that an encoder may have, rad.
_ENCODER_ERROR: Final = 5.0 * ARCSECOND
# Candidates of Step 1 as published: whole orders up to this one.
_PUBLISHED_ORDERS: Final = 64
_MOST_LINES: Final = 250
_ROUNDS: Final = 20
# Rounds after which tones that lie together have stood beside all strong lines, if none waits.
_SURE_ROUNDS: Final = 2
# Share of Earth rate by which its terms may still move when they are called settled.
_SAME_EARTH: Final = 0.02
# Share of its error by which an amplitude may still move when the fit is called settled.
_SETTLED: Final = 0.1
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
    taken
        (3, bands) noise that went with the lines: frequency and bandwidth, Hz, and one-sided rate
        density, (rad/s)^2/Hz.
    notes
        What was noticed.
    unfinished
        (samples,) the angle without table motion but with all lines, rad, where the search did not
        come to an end and nobody knows what `residual` lacks; None where it did.
    """

    residual: FloatArray
    lines: tuple[Line, ...]
    masked: tuple[tuple[float, float], ...]
    taken: FloatArray
    notes: tuple[str, ...]
    unfinished: FloatArray | None = None


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

    Table motion and Earth rate first (`rotation.follow_table`). Then rounds until nothing
    exceeds the noise floor: new lines in frequency and in order (`detection.new_lines`), a joint
    Gauss-Newton step of all (`regression.fit`), table motion again without them, tones that
    follow the table moved to the angle scale, and clusters that are one line with a drifting
    amplitude made one (`drift.fit_drifting`).

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

    Raises
    ------
    ValueError
        If `false_alarm` is not above zero.
    """
    with _BLAS.limit(limits=1, user_api="blas"):
        return _removal(
            _search(
                angle,
                table,
                sample_rate,
                detection.detection_threshold(angle.size // 2, false_alarm),
            ),
            channel,
            progress or (lambda _: None),
        )


def _removal(search: "_Search", channel: str, report: Callable[[float], None]) -> Removal:
    turns = 0.0 if search.table is None else rotation.full_turns(search.table)
    reach = (
        None
        if search.table is None
        else detection.earth_amplitudes(search.table, search.sample_rate)
    )
    notes: list[str] = []
    ended = True
    search.take_out()
    search.look()
    for number in range(_ROUNDS):
        report(number / _ROUNDS)
        first = number == 0
        before, drifting = search.components, search.drifting
        found = 0
        while search.table is not None and first and turns < rotation.FEW_TURNS:
            # Orders are hardly told apart: one at a time, the strongest first.
            orders, height, _ = detection.new_orders(search.left, search.components)
            if orders.size == 0:
                break
            search.add(orders.select(height == height.max()))
            search.take_out()
            search.look()
            found += 1
        # Once taken for lines, what Earth rate makes would hide it: it waits until that is settled.
        patient = reach if search.unsettled_earth else None
        new, restless, waiting = detection.new_lines(search.left, search.components, patient)
        found += new.size
        if found == 0 and patient is not None and not first:
            search.unsettled_earth = False
            continue
        if found == 0 and not first and restless.size == 0:
            if not search.gather_all(restless):
                break
            continue
        if new.size:
            search.add(new)
        if search.components.size:
            search.prune()
            if patient is not None:
                search.keep_above(patient)
        search.take_out()
        # Over part of a turn harmonics and table motion trade with each other: one fit of motion.
        if search.table is not None and turns >= rotation.FEW_TURNS:
            # Table motion was fitted with these lines for noise; they are out of it now. And
            # chance orders, which would hide Earth rate from it, are gone.
            search.follow()
            search.take_out()
        if search.components.size:
            search.refit()
            search.take_out()
        search.look()
        # What follows the table first: an order that smears looks like a line that drifts.
        if search.rescale():
            search.prune_all()
            search.take_out()
            search.look()
        if found == 0 or (number >= _SURE_ROUNDS and not waiting):
            search.gather_all(restless)
        if not first and _same(before, search.components, turns) and drifting is search.drifting:
            # What was found did not stand once fitted with the rest, and would not next time.
            break
        if search.components.size > _MOST_LINES:
            ended = False
            notes.append(
                f"the search stopped at {search.components.size} lines; more peaks stand above "
                "the floor"
            )
            break
    else:
        ended = False
        notes.append(
            f"the search stopped after {_ROUNDS} rounds; weaker peaks may still stand "
            "above the floor"
        )
    if search.components.size:
        if not search.rescale() and not search.settled:
            search.refit()
        search.prune_all()
    residual = series.empty(search.angle.size)
    search.take_out(residual)
    search.look()
    lines = _described(search, channel)
    if search.fit is not None and search.components.size and search.fit.collinear:
        notes.append(
            f"{search.fit.collinear} directions among the lines of {channel} cannot be told "
            "apart (angle and time coincide at this steady rate); their sum is removed, their "
            "single amplitudes are not to be trusted"
        )
    removal = Removal(
        residual=residual,
        lines=lines,
        masked=_masked(lines, search),
        taken=_taken(lines, search),
        notes=(*search.notes(channel), *notes),
    )
    if not ended:
        search.components, search.drifting = regression.no_components(search.angle.size), ()
        unfinished = series.empty(search.angle.size)
        search.take_out(unfinished)
        removal = replace(removal, unfinished=unfinished)
    report(1.0)
    return removal


@dataclass(slots=True, kw_only=True)
class _Search:
    """A search on its way: what is known, and the increments that are left without it.

    Attributes
    ----------
    angle, encoder, sample_rate, threshold
        What is searched, and the ratio of power to floor that a line has to exceed.
    motion, sampled
        Table motion known so far, None at rest, and the sampling of the angle that goes with it.
    components, fit
        Steady lines known so far, and the fit that they are from.
    drifting
        Lines whose amplitude drifts.
    steps, averages
        Increments, (samples - 1,), and averages of the angle less all of that.
    left
        The increments with their power and noise floor, as `look` saw them last.
    taken_out, seen
        Motion and lines that `steps` lack, and whether `left` is of these steps.
    settled
        Whether the last step of the fit was small beside the errors.
    unsettled_earth
        Whether Earth rate may still move.
    steady
        Tones, alone or in clusters, that were found to be steady lines.
    """

    angle: FloatArray
    encoder: FloatArray | None
    sample_rate: float
    threshold: float
    motion: rotation.TableMotion | None
    sampled: regression.Sampling
    components: Components
    fit: ComponentFit | None = None
    drifting: tuple[DriftingLine, ...] = ()
    steps: FloatArray
    averages: FloatArray
    left: Residue = field(init=False)
    taken_out: tuple[object, ...] = ()
    seen: bool = False
    settled: bool = False
    unsettled_earth: bool = True
    steady: set[tuple[int, ...]] = field(default_factory=set)

    @property
    def table(self) -> FloatArray | None:
        """(samples,) table angle as the gyro saw it, rad."""
        return None if self.motion is None else self.motion.kinematics.table

    def take_out(self, residual: FloatArray | None = None) -> None:
        """Take table motion and lines, as they are now, out of the angle; keep it if asked."""
        now = (self.motion, self.components, self.drifting)
        same = len(self.taken_out) == len(now) and all(
            one is other for one, other in zip(now, self.taken_out, strict=True)
        )
        if residual is None and same:
            return
        self.seen, self.taken_out = self.seen and same, now
        angle, motion, table = self.angle, self.motion, self.table
        size = angle.size
        length = series.SPAN if motion is None else motion.kinematics.length

        def work(span: slice) -> tuple[FloatArray, float, float]:
            # One sample more: the increment that leads to the next span.
            here = slice(span.start, min(span.stop + 1, size))
            rest = angle[here] if motion is None else angle[here] - motion.over(here)
            rest = regression.removed(rest, table, self.components, here)
            for line in self.drifting:
                rest -= drift.values(line, here.start, rest.size)
            np.subtract(rest[1:], rest[:-1], out=self.steps[span.start : here.stop - 1])
            if residual is not None:
                residual[span] = rest[: span.stop - span.start]
            own = rest[: span.stop - span.start]
            means = own[:0] if motion is None else rotation.averaged(own, motion.kinematics.block)
            return means, float(rest[0]), float(rest[-1])

        known = (angle, self.steps) if table is None else (angle, self.steps, table)
        if residual is not None:
            known = (*known, residual)
        parts = list(series.each(work, size, length, release_of=known))
        self.averages = np.concatenate([part[0] for part in parts])
        mean = (parts[-1][2] - parts[0][1]) / (size - 1)
        for span in series.through(size - 1, self.steps):
            self.steps[span] -= mean

    def look(self) -> None:
        """Power of the increments, and its noise floor."""
        if self.seen:
            return
        self.seen = True
        self.left = detection.residue(self.steps, self.sampled, self.threshold)

    def add(self, found: Components) -> None:
        """Fit components that are still in the increments with those that are not."""
        flags = regression.joined(
            replace(self.components, cosine=np.zeros(self.components.size)),
            replace(found, cosine=np.ones(found.size)),
        )
        self.components = regression.joined(self.components, found)
        self.refit(absent=flags.cosine > 0.0)

    def refit(self, absent: NDArray[np.bool_] | None = None) -> None:
        """One joint step of all components; `take_out` before and after."""
        before = self.components
        self.fit = regression.fit(self.steps, self.sampled, before, absent=absent)
        self.components = after = self.fit.components
        levels = detection.floors(after, self.table, self.left.floor)
        errors = np.sqrt(np.einsum("nii->ni", self.fit.covariance) * levels[:, np.newaxis])
        moved = np.stack([after.cosine - before.cosine, after.sine - before.sine], axis=1)
        self.settled = absent is None and bool(np.all(np.abs(moved) < _SETTLED * errors[:, :2]))

    def prune(self) -> bool:
        """Drop the components that do not stand above the floor; whether there were any."""
        if self.fit is None:
            return False
        kept = detection.significant(self.fit, self.table, self.left.floor, self.threshold)
        dropped = kept.size < self.components.size
        if dropped:
            self._keep(kept)
        return dropped

    def _keep(self, kept: Components) -> None:
        self.components = kept
        if kept.size == 0:
            self.fit = None

    def keep_above(self, reach: FloatArray) -> None:
        """Drop the orders that are no larger than Earth rate could make them."""
        keep = np.ones(self.components.size, dtype=bool)
        angles = self.components.orders.size
        place = np.rint(self.components.orders).astype(np.int64) - 1
        own = np.where(
            (place >= 0) & (place < reach.size), reach[np.clip(place, 0, reach.size - 1)], 0.0
        )
        keep[:angles] = self.components.free | (self.components.amplitude[:angles] > own)
        if not keep.all():
            self._keep(self.components.select(keep))

    def prune_all(self) -> None:
        """Prune until all that is left stands: the rest is fitted again after each loss."""
        while self.prune() and self.components.size:
            for _ in range(2):
                self.take_out()
                self.refit()

    def rescale(self) -> bool:
        """Move tones that follow the table to the angle scale; whether there were any.

        A line on its right scale takes from its neighbours, which then stand out no more.
        """
        rescaled = _rescaled(self)
        if rescaled is self.components:
            return False
        self.components = rescaled
        for _ in range(2):
            self.take_out()
            self.refit()
        return True

    def gather_all(self, restless: FloatArray) -> bool:
        """`gather` until there is nothing more to gather; whether there was anything."""
        any_found = False
        while self.gather(restless):
            any_found = True
            self.take_out()
            if self.components.size:
                self.refit()
                self.take_out()
            self.look()
        return any_found

    def gather(self, restless: FloatArray) -> bool:
        """Make one drifting line of a cluster that is better described so; whether there was one.

        The increments must be without the steady lines as they are.
        """
        components, fit = self.components, self.fit
        angles = components.orders.size
        if fit is None or fit.components is not components or components.size == 0:
            return False
        levels = detection.floors(components, self.table, self.left.floor)
        significance = detection.significances(fit, levels)[angles:]
        amplitudes = (components.cosine - 1j * components.sine)[angles:]
        apart = np.abs(components.frequencies[:, np.newaxis] - restless) * self.angle.size
        alone = np.flatnonzero((apart < 1.0).any(axis=1))
        for group in (
            *drift.clusters(components.frequencies, significance, self.angle.size),
            *alone[:, np.newaxis],
        ):
            # To a quarter of a cycle a record: a refit moves the last digits.
            places = np.rint(4.0 * components.frequencies[group] * self.angle.size)
            key = tuple(places.astype(int).tolist())
            if key in self.steady:
                continue
            found = drift.fit_drifting(
                self.steps,
                float(components.frequencies[group[0]]),
                float(levels[angles + group[0]]),
                center=components.center,
                steady_frequencies=components.frequencies[group],
                steady_amplitudes=amplitudes[group],
            )
            if found is None:
                self.steady.add(key)
                continue
            keep = np.ones(components.size, dtype=bool)
            keep[angles + group[found.replaced]] = False
            self.components = components.select(keep)
            self.fit, self.settled = None, False
            self.drifting = (*self.drifting, found)
            return True
        return False

    def follow(self) -> None:
        """Fit table motion again, with the orders that are known now and no others."""
        if self.motion is None or self.encoder is None:
            return
        before, earth = self.motion.kinematics, self.motion.earth
        known, angles = self.components, self.components.orders.size
        self.motion = rotation.follow_table(
            self.averages + self.motion.averages,
            self.encoder,
            before,
            harmonics=known.orders,
            cosine=known.cosine[:angles],
            sine=known.sine[:angles],
        )
        moved = max(abs(now - was) for now, was in zip(self.motion.earth, earth, strict=True))
        self.unsettled_earth &= moved > _SAME_EARTH * rotation.EARTH_RATE
        # What harmonics and motion trade with each other, they trade here: nothing of it is left to
        # the fit of the lines, which would meet a residual far above the noise.
        motion = self.motion
        cosine, sine = known.cosine.copy(), known.sine.copy()
        place = np.flatnonzero(np.isin(known.orders, motion.orders))
        cosine[place] = motion.cosine
        sine[place] = motion.sine
        self.components = replace(known, cosine=cosine, sine=sine)
        if self.motion.kinematics is not before:
            self.sampled = regression.sampling(self.angle.size, self.table)

    def notes(self, channel: str) -> tuple[str, ...]:
        """What was noticed of the table, and lines that were fitted by blocks."""
        notes = [
            f"{channel}: the line at {line.frequency * self.sample_rate:.6g} Hz drifts, by "
            f"{100.0 * line.drift:.2g} % in amplitude; it is fitted in {_counted(line.blocks)} "
            f"with {line.parameters} parameters"
            for line in self.drifting
        ]
        lag = 0.0 if self.motion is None else self.motion.kinematics.lag
        if abs(lag) * self.sample_rate > _SEEN_LAG:
            notes.append(
                f"the encoder is {1e3 * lag:+.2f} ms from the gyro in time; "
                "the table angle was shifted by that"
            )
        return tuple(notes)


def _search(
    angle: FloatArray, table: FloatArray | None, sample_rate: float, threshold: float
) -> _Search:
    """A search that knows table motion alone."""
    motion = None
    if table is not None and rotation.is_turning(table):
        kinematic = rotation.kinematics(table, sample_rate)
        parts = series.each(
            lambda span: rotation.averaged(angle[span], kinematic.block),
            angle.size,
            kinematic.length,
            release_of=(angle,),
        )
        motion = rotation.follow_table(np.concatenate(list(parts)), table, kinematic)
    steps = series.empty(angle.size - 1)
    return _Search(
        angle=angle,
        encoder=table,
        sample_rate=sample_rate,
        threshold=threshold,
        motion=motion,
        sampled=regression.sampling(
            angle.size, None if motion is None else motion.kinematics.table
        ),
        components=regression.no_components(angle.size),
        steps=steps,
        averages=np.empty(0),
    )


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


def _same(first: Components, second: Components, turns: float) -> bool:
    """Whether both hold the same lines, to within a bin, on a table of so many turns."""
    return (
        first.orders.size == second.orders.size
        and bool(np.all(np.abs(first.orders - second.orders) * turns < 0.5))
        and first.frequencies.size == second.frequencies.size
        and bool(
            np.all(
                np.abs(np.sort(first.frequencies) - np.sort(second.frequencies))
                * (2.0 * first.center)
                < 1.0
            )
        )
    )


def _rescaled(search: _Search) -> Components:
    """Components in time that follow the table better, moved to the angle scale.

    A tone is mixed down to zero frequency and its phase compared with the table's
    wander about its mean rate, scaled by the order it would have. At a steady rate the two are
    one, and the component stays in time.
    """
    alpha, components, steps = search.table, search.components, search.steps
    block = _kernels.MIX_BLOCK
    if alpha is None or components.frequencies.size == 0 or steps.size < 3 * block:
        return components
    length = block * max(1, series.SPAN // block)
    parts = series.each(
        lambda span: rotation.averaged(alpha[span], block), steps.size, length, release_of=(alpha,)
    )
    mean_angle = np.concatenate(list(parts))
    middles = np.arange(mean_angle.size) * block + 0.5 * (block - 1) - components.center
    number = middles - middles.mean()
    rate = float(number @ mean_angle) / float(number @ number)
    speed = abs(rotation.mean_rate(alpha, search.sample_rate)) / search.sample_rate
    if abs(rate) < 0.5 * speed:
        # A table that goes back and forth has no rate that a tone could be an order of.
        return components
    wander = mean_angle - mean_angle.mean() - rate * number
    levels = detection.floors(components, alpha, search.left.floor)[components.orders.size :]
    spread = float(np.std(wander))
    moved = np.zeros(components.size, dtype=bool)
    orders: list[float] = []
    in_time = slice(components.orders.size, None)
    # Increments of the components: step n leads from sample n to n + 1.
    phasors = components.cosine[in_time] - 1j * components.sine[in_time]
    phasors = phasors * (np.exp(2j * np.pi * components.frequencies) - 1.0)
    for index, frequency in enumerate(components.frequencies, start=components.orders.size):
        order = 2.0 * np.pi * frequency / abs(rate)
        level = levels[index - components.orders.size]
        own = np.abs(phasors[index - components.orders.size])
        strength = own * np.sqrt(steps.size / (2.0 * level))
        if order * spread * strength < 6.0:
            continue
        mixed = _mixed_down(steps, float(frequency), components.center)
        # The component is put back, and its neighbours too: sidebands that the table's wander makes
        # of one order.
        for other in np.flatnonzero(
            np.abs(components.frequencies - frequency) < min(0.1 * frequency, 0.25 / block)
        ):
            apart = components.frequencies[other] - frequency
            mixed += 0.5 * phasors[other] * np.exp(2j * np.pi * apart * middles[: mixed.size])
        turned = mixed * np.exp(-1j * np.sign(rate) * order * wander[: mixed.size])
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


def _mixed_down(steps: FloatArray, frequency: float, center: float) -> NDArray[np.complex128]:
    """Means over blocks of the steps, mixed down from `frequency` (cycles a sample) to zero."""

    def mixed(span: slice) -> NDArray[np.complex128]:
        return _kernels.mixed_down(steps[span], frequency, center - span.start)

    length = _kernels.MIX_BLOCK * max(1, series.SPAN // _kernels.MIX_BLOCK)
    return np.concatenate(list(series.each(mixed, steps.size, length, release_of=(steps,))))


# --- description -------------------------------------------------------------------------


def _described(search: _Search, channel: str) -> tuple[Line, ...]:
    """The lines, strongest first, named where their frequency says what they are."""
    components, fit = search.components, search.fit
    alpha, floor, sample_rate = search.table, search.left.floor, search.sample_rate
    lines = [_of_drifting(line, sample_rate, channel) for line in search.drifting]
    if fit is None or components.size == 0:
        return _named(lines, search)
    levels = detection.floors(components, alpha, floor)
    significance = detection.significances(fit, levels)
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
    return _named(lines, search)


def _named(lines: list[Line], search: _Search) -> tuple[Line, ...]:
    """The lines, strongest first, with their names."""
    lines = sorted(lines, key=lambda line: -line.significance)
    alpha, sample_rate = search.table, search.sample_rate
    turn_rate = 0.0 if alpha is None else abs(rotation.mean_rate(alpha, sample_rate)) / (2 * np.pi)
    resolution = sample_rate / (2.0 * (search.left.floor.size - 1))
    return tuple(
        line if line.name else replace(line, name=_name(line, lines[:rank], turn_rate, resolution))
        for rank, line in enumerate(lines)
    )


def _of_drifting(line: DriftingLine, sample_rate: float, channel: str) -> Line:
    """A drifting line in the terms of a steady one, with the phase that it starts with."""
    start = complex(line.knots[0] * np.exp(-2j * np.pi * line.carrier * line.center))
    return Line(
        scale="time",
        frequency=line.frequency * sample_rate,
        frequency_error=line.frequency_error * sample_rate,
        amplitude=line.amplitude,
        amplitude_error=line.amplitude_error,
        phase=float(np.angle(start)),
        phase_error=float(line.knot_errors[0]) / max(abs(start), np.finfo(float).tiny),
        significance=line.significance,
        channel=channel,
        name=f"drifts: fitted in {_counted(line.blocks)}",
    )


def _counted(blocks: int) -> str:
    return f"{blocks} block" if blocks == 1 else f"{blocks} blocks"


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


def _masked(lines: tuple[Line, ...], search: _Search) -> tuple[tuple[float, float], ...]:
    """Bands in Hz in which the fit took the noise with the line."""
    width = _TAKEN_BINS * search.sample_rate / search.angle.size
    bands: list[tuple[float, float]] = [
        (found.band[0] * search.sample_rate - width, found.band[1] * search.sample_rate + width)
        for found in search.drifting
    ]
    for line in lines:
        if line.scale == "time":
            bands.append((line.frequency - width, line.frequency + width))
        elif search.table is not None:
            speed = detection.speeds(search.table) * search.sample_rate / (2.0 * np.pi)
            low, high = float(speed[0]), float(speed[-1])
            # Spread over many bins, a component takes two of many ordinates: nothing to mask.
            if line.frequency * (high - low) < 20.0 * width:
                center = 0.5 * (low + high) * line.frequency
                bands.append((center - 10.0 * width, center + 10.0 * width))
    return tuple(bands)


def _taken(lines: tuple[Line, ...], search: _Search) -> FloatArray:
    """`taken` of `Removal`: half a cycle a record for each parameter fitted, where it was."""
    rate, cell = search.sample_rate, search.sample_rate / search.angle.size
    bands: list[tuple[float, float]] = []
    for found in search.drifting:
        cells = zip(*drift.taken_bands(found), strict=True)
        bands += [(place * rate, width * rate) for place, width in cells]
    turn_rate = 0.0
    if search.table is not None:
        turn_rate = float(np.median(detection.speeds(search.table))) * rate / (2.0 * np.pi)
    drifting = {found.frequency * rate for found in search.drifting}
    for line in lines:
        if line.scale == "time" and line.frequency not in drifting:
            bands.append((line.frequency, 1.5 * cell))
        elif line.scale == "angle":
            fitted = 1.5 if line.frequency_error > 0.0 else 1.0
            bands.append((line.frequency * turn_rate, fitted * cell))
    frequency, bandwidth = np.array(bands).reshape(-1, 2).T
    inside = (frequency > 0.0) & (frequency < 0.5 * rate)
    frequency, bandwidth = frequency[inside], bandwidth[inside]
    bins = np.rint(frequency / rate * (2.0 * (search.left.floor.size - 1))).astype(np.int64)
    density = spectrum.density(search.left.floor[bins], rate)
    return np.stack([frequency, bandwidth, density])
