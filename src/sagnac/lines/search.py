"""The search for periodic components: rounds of finding, fitting and judging."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.constants import EARTH_RATE
from sagnac.lines import joint_fit
from sagnac.lines.candidates import new_lines, new_orders
from sagnac.lines.components import Components, joined, no_components, removed
from sagnac.lines.earth_orders import earth_amplitudes
from sagnac.lines.joint_fit import ComponentFit
from sagnac.lines.model import Removal
from sagnac.lines.naming import blocks_text, describe_lines
from sagnac.lines.products import Sampling, sampling
from sagnac.lines.rescaling import rescaled_components
from sagnac.lines.selection import (
    Residue,
    detection_threshold,
    floors,
    residue,
    significances,
    significant,
)
from sagnac.lines.taken_noise import masked_bands, noise_taken
from sagnac.lines.wandering import DriftingLine, clusters, fit_drifting, values
from sagnac.table.kinematics import averaged, kinematics
from sagnac.table.motion import TableMotion, follow_table
from sagnac.table.turns import FEW_TURNS, full_turns, is_turning

# Spans of a record are shared out among threads; products within them are not.
_BLAS: Final = ThreadpoolController()
# Lag of the encoder, in samples, that is worth a note.
_SEEN_LAG: Final = 0.05
_MOST_LINES: Final = 250
_ROUNDS: Final = 20
# Rounds after which tones that lie together have stood beside all strong lines, if none waits.
_SURE_ROUNDS: Final = 2
# Share of Earth rate by which its terms may still move when they are called settled.
_SAME_EARTH: Final = 0.02
# Share of its error by which an amplitude may still move when the fit is called settled.
_SETTLED: Final = 0.1


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
                detection_threshold(angle.size // 2, false_alarm),
            ),
            channel,
            progress or (lambda _: None),
        )


def _removal(search: "Search", channel: str, report: Callable[[float], None]) -> Removal:
    turns = 0.0 if search.table is None else full_turns(search.table)
    reach = None if search.table is None else earth_amplitudes(search.table, search.sample_rate)
    notes: list[str] = []
    ended = True
    search.take_out()
    search.look()
    for number in range(_ROUNDS):
        report(number / _ROUNDS)
        first = number == 0
        before, drifting = search.components, search.drifting
        found = 0
        while search.table is not None and first and turns < FEW_TURNS:
            # Orders are hardly told apart: one at a time, the strongest first.
            orders, height, _ = new_orders(search.left, search.components)
            if orders.size == 0:
                break
            search.add(orders.select(height == height.max()))
            search.take_out()
            search.look()
            found += 1
        # Once taken for lines, what Earth rate makes would hide it: it waits until that is settled.
        patient = reach if search.unsettled_earth else None
        new, restless, waiting = new_lines(search.left, search.components, patient)
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
        if search.table is not None and turns >= FEW_TURNS:
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
    lines = describe_lines(search, channel)
    if search.fit is not None and search.components.size and search.fit.collinear:
        notes.append(
            f"{search.fit.collinear} directions among the lines of {channel} cannot be told "
            "apart (angle and time coincide at this steady rate); their sum is removed, their "
            "single amplitudes are not to be trusted"
        )
    removal = Removal(
        residual=residual,
        lines=lines,
        masked=masked_bands(lines, search),
        taken=noise_taken(lines, search),
        notes=(*search.notes(channel), *notes),
    )
    if not ended:
        search.components, search.drifting = no_components(search.angle.size), ()
        unfinished = series.empty(search.angle.size)
        search.take_out(unfinished)
        removal = replace(removal, unfinished=unfinished)
    report(1.0)
    return removal


@dataclass(slots=True, kw_only=True)
class Search:
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
    motion: TableMotion | None
    sampled: Sampling
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
            rest = removed(rest, table, self.components, here)
            for line in self.drifting:
                rest -= values(line, here.start, rest.size)
            np.subtract(rest[1:], rest[:-1], out=self.steps[span.start : here.stop - 1])
            if residual is not None:
                residual[span] = rest[: span.stop - span.start]
            own = rest[: span.stop - span.start]
            means = own[:0] if motion is None else averaged(own, motion.kinematics.block)
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
        self.left = residue(self.steps, self.sampled, self.threshold)

    def add(self, found: Components) -> None:
        """Fit components that are still in the increments with those that are not."""
        flags = joined(
            replace(self.components, cosine=np.zeros(self.components.size)),
            replace(found, cosine=np.ones(found.size)),
        )
        self.components = joined(self.components, found)
        self.refit(absent=flags.cosine > 0.0)

    def refit(self, absent: NDArray[np.bool_] | None = None) -> None:
        """One joint step of all components; `take_out` before and after."""
        before = self.components
        self.fit = joint_fit.fit(self.steps, self.sampled, before, absent=absent)
        self.components = after = self.fit.components
        levels = floors(after, self.table, self.left.floor)
        errors = np.sqrt(np.einsum("nii->ni", self.fit.covariance) * levels[:, np.newaxis])
        moved = np.stack([after.cosine - before.cosine, after.sine - before.sine], axis=1)
        self.settled = absent is None and bool(np.all(np.abs(moved) < _SETTLED * errors[:, :2]))

    def prune(self) -> bool:
        """Drop the components that do not stand above the floor; whether there were any."""
        if self.fit is None:
            return False
        kept = significant(self.fit, self.table, self.left.floor, self.threshold)
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
        rescaled = rescaled_components(self)
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
        levels = floors(components, self.table, self.left.floor)
        significance = significances(fit, levels)[angles:]
        amplitudes = (components.cosine - 1j * components.sine)[angles:]
        apart = np.abs(components.frequencies[:, np.newaxis] - restless) * self.angle.size
        alone = np.flatnonzero((apart < 1.0).any(axis=1))
        for group in (
            *clusters(components.frequencies, significance, self.angle.size),
            *alone[:, np.newaxis],
        ):
            # To a quarter of a cycle a record: a refit moves the last digits.
            places = np.rint(4.0 * components.frequencies[group] * self.angle.size)
            key = tuple(places.astype(int).tolist())
            if key in self.steady:
                continue
            found = fit_drifting(
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
        self.motion = follow_table(
            self.averages + self.motion.averages,
            self.encoder,
            before,
            harmonics=known.orders,
            cosine=known.cosine[:angles],
            sine=known.sine[:angles],
        )
        moved = max(abs(now - was) for now, was in zip(self.motion.earth, earth, strict=True))
        self.unsettled_earth &= moved > _SAME_EARTH * EARTH_RATE
        # What harmonics and motion trade with each other, they trade here: nothing of it is left to
        # the fit of the lines, which would meet a residual far above the noise.
        motion = self.motion
        cosine, sine = known.cosine.copy(), known.sine.copy()
        place = np.flatnonzero(np.isin(known.orders, motion.orders))
        cosine[place] = motion.cosine
        sine[place] = motion.sine
        self.components = replace(known, cosine=cosine, sine=sine)
        if self.motion.kinematics is not before:
            self.sampled = sampling(self.angle.size, self.table)

    def notes(self, channel: str) -> tuple[str, ...]:
        """What was noticed of the table, and lines that were fitted by blocks."""
        notes = [
            f"{channel}: the line at {line.frequency * self.sample_rate:.6g} Hz drifts, by "
            f"{100.0 * line.drift:.2g} % in amplitude; it is fitted in {blocks_text(line.blocks)} "
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
) -> Search:
    """A search that knows table motion alone."""
    motion = None
    if table is not None and is_turning(table):
        kinematic = kinematics(table, sample_rate)
        parts = series.each(
            lambda span: averaged(angle[span], kinematic.block),
            angle.size,
            kinematic.length,
            release_of=(angle,),
        )
        motion = follow_table(np.concatenate(list(parts)), table, kinematic)
    steps = series.empty(angle.size - 1)
    return Search(
        angle=angle,
        encoder=table,
        sample_rate=sample_rate,
        threshold=threshold,
        motion=motion,
        sampled=sampling(angle.size, None if motion is None else motion.kinematics.table),
        components=no_components(angle.size),
        steps=steps,
        averages=np.empty(0),
    )


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
