"""Joint least squares of periodic components in table angle and in time.

Everything is fitted to the *increments* of an angle: there the angle random walk is
white, so that plain least squares neither follows the walk nor leaks from it. One pass
over the samples, in blocks, makes the normal matrix of all components together with the
derivatives in frequency; the Gauss-Newton step that follows moves all amplitudes and
frequencies at once, and its inverse gives their covariance.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController

from sagnac import _kernels
from sagnac.recording import FloatArray

# Products of thin blocks, thousands of them: threads would spend their time waiting for each
# other, and all of it where the machine has other work.
_BLAS: Final = ThreadpoolController()
# Samples a block: the rows of a hundred components stay in the second-level cache.
_BLOCK: Final = 2048
# Up to this order the cosines come from multiplying up; single ones beyond are quicker outright.
_MOST_MULTIPLIED: Final = 256
# Eigenvalues below this share of the largest (of the scaled normal matrix) are directions that
# the data do not distinguish; nothing is fitted along them.
_COLLINEAR: Final = 1e-9
# Cycles over the record by which a frequency, and share by which an amplitude, may have moved
# since the normal matrix was made. It then gives the step, not the solution: a step's error is
# some per cent of a step that is itself small beside the uncertainty.
_SAME_FREQUENCY: Final = 0.02
_SAME_AMPLITUDE: Final = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Components:
    """Periodic components: ``cosine * cos(c) + sine * sin(c)`` of a phase c.

    The phase is ``order * alpha`` on the angle scale and
    ``2 pi * frequency * (n - center)`` on the time scale, n the sample number: with its
    origin at mid-record a frequency and its phase are uncorrelated.

    Attributes
    ----------
    orders
        (angle components,) ascending.
    free
        (angle components,) bool; whether the order is fitted too.
    frequencies
        (time components,) cycles per sample.
    center
        Sample number of the phase origin in time.
    cosine, sine
        (components,) amplitudes in rad; angle components first.
    """

    orders: FloatArray
    free: NDArray[np.bool_]
    frequencies: FloatArray
    center: float
    cosine: FloatArray
    sine: FloatArray

    @property
    def size(self) -> int:
        """Number of components."""
        return self.orders.size + self.frequencies.size

    @property
    def amplitude(self) -> FloatArray:
        """(components,) rad."""
        return np.asarray(np.hypot(self.cosine, self.sine))

    def select(self, keep: NDArray[np.bool_]) -> "Components":
        """The components where `keep`, (components,) bool, is true."""
        angle = keep[: self.orders.size]
        return replace(
            self,
            orders=self.orders[angle],
            free=self.free[angle],
            frequencies=self.frequencies[keep[self.orders.size :]],
            cosine=self.cosine[keep],
            sine=self.sine[keep],
        )


def no_components(samples: int) -> Components:
    """The empty set, for a record of `samples` angles."""
    empty = np.empty(0)
    return Components(
        orders=empty,
        free=np.empty(0, dtype=bool),
        frequencies=empty,
        center=0.5 * (samples - 1),
        cosine=empty,
        sine=empty,
    )


def joined(first: Components, second: Components) -> Components:
    """Both sets as one, orders ascending."""
    orders = np.concatenate([first.orders, second.orders])
    ascending = np.argsort(orders, kind="stable")

    def both(a: FloatArray, b: FloatArray) -> FloatArray:
        angle = np.concatenate([a[: first.orders.size], b[: second.orders.size]])[ascending]
        return np.concatenate([angle, a[first.orders.size :], b[second.orders.size :]])

    return replace(
        first,
        orders=orders[ascending],
        free=np.concatenate([first.free, second.free])[ascending],
        frequencies=np.concatenate([first.frequencies, second.frequencies]),
        cosine=both(first.cosine, second.cosine),
        sine=both(first.sine, second.sine),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class ComponentFit:
    """A fitted set.

    Attributes
    ----------
    components
        With refined amplitudes, frequencies and free orders.
    covariance
        (components, 3, 3) of cosine, sine and frequency (or order), for increments of
        unit variance: multiply by the noise floor at the component's own frequency. The
        third row is 0 where nothing was fitted there.
    collinear
        Directions in which the data do not tell the components apart.
    normal
        (rows, rows) normal matrix, and `start` and `table` the components and the table angle
        it was made for; a later fit takes from it what has not changed.
    """

    components: Components
    covariance: FloatArray
    collinear: int
    normal: FloatArray
    start: Components
    table: FloatArray | None


def fit(
    increments: FloatArray,
    table: FloatArray | None,
    components: Components,
    *,
    refine: bool = True,
    earlier: ComponentFit | None = None,
) -> ComponentFit:
    """Least squares of all components jointly; one Gauss-Newton step in frequency if `refine`.

    Parameters
    ----------
    increments
        (samples - 1,) differences of the angle, rad.
    table
        (samples,) table angle, rad; None if there are no angle components.
    components
        Where to start. With `refine` their amplitudes must be near the solution, since
        the derivative in frequency is proportional to them.
    earlier
        A fit with `refine` to the same samples, of which some components may be these.

    References
    ----------
    The joint step is the cyclic refinement of NOMP (arXiv:1509.01942) done at once.
    """
    angles = components.orders.size
    tunable = np.concatenate([components.free, np.ones(components.frequencies.size, dtype=bool)])
    tuned = np.flatnonzero(tunable) if refine else np.empty(0, dtype=np.int64)
    size = 2 * components.size + tuned.size
    normal = np.zeros((size, size))
    right = np.zeros(size)
    samples = increments.size + 1
    middle = 0.0 if table is None else 0.5 * float(table.min() + table.max())
    # Frequencies in units of one cycle per record, so that the normal matrix is well scaled.
    turn = 2.0 * np.pi / samples
    span = 1.0 if table is None else max(float(np.ptp(table)), 1.0)
    known, known_before, origin = _unchanged(components, table, earlier if refine else None)
    fresh = np.setdiff1d(np.arange(size), known)
    everything = fresh.size == size
    weights = np.zeros(size)
    if not everything:
        # Of what is left of the data the solution is a small step, and errors of the matrix count
        # by as much less.
        weights[0 : 2 * components.size : 2] = components.cosine
        weights[1 : 2 * components.size : 2] = components.sine
    with _BLAS.limit(limits=1, user_api="blas"):
        for start, values in _blocks(samples, table, components, extra=tuned.size):
            count = values.shape[1]
            for row, index in enumerate(tuned.tolist(), start=2 * components.size):
                # An order among the components implies a table, which mypy cannot know.
                lag = (
                    (table[start : start + count] - middle) / span  # type: ignore[index]
                    if index < angles
                    else (np.arange(start, start + count) - components.center) * turn
                )
                values[row] = lag * (
                    components.sine[index] * values[2 * index]
                    - components.cosine[index] * values[2 * index + 1]
                )
            data = increments[start : start + count - 1]
            if not everything:
                data = data - np.diff(weights @ values)
            if fresh.size:
                steps = np.diff(values, axis=1)
                if everything:
                    normal += steps @ steps.T
                else:
                    normal[fresh] += steps[fresh] @ steps.T
            # Summed by parts: values against differences of the data's increments.
            right -= values @ np.diff(data, prepend=0.0, append=0.0)
        if earlier is not None and not everything:
            normal[:, fresh] = normal[fresh].T
            normal[np.ix_(known, known)] = earlier.normal[np.ix_(known_before, known_before)]
        inverse, collinear = _inverse(normal)
    solution = weights + inverse @ right
    cosine, sine = solution[0 : 2 * components.size : 2], solution[1 : 2 * components.size : 2]
    orders, frequencies = components.orders.copy(), components.frequencies.copy()
    covariance = np.zeros((components.size, 3, 3))
    for index in range(components.size):
        pair = slice(2 * index, 2 * index + 2)
        covariance[index, :2, :2] = inverse[pair, pair]
    for row, index in enumerate(tuned.tolist(), start=2 * components.size):
        unit = 1.0 / span if index < angles else 1.0 / samples
        step = float(np.clip(solution[row], -1.0, 1.0)) * unit
        if index < angles:
            # The phase origin of an angle component is alpha = 0, not mid-record.
            orders[index] += step
            cosine[index], sine[index] = _turned(cosine[index], sine[index], step * middle)
        else:
            frequencies[index - angles] += step
        members = np.array([2 * index, 2 * index + 1, row])
        scale = np.array([1.0, 1.0, unit])
        covariance[index] = inverse[np.ix_(members, members)] * np.outer(scale, scale)
        if index < angles:
            # And the order's error moves that origin's phase with it.
            c, s = np.cos(step * middle), np.sin(step * middle)
            moved = np.array(
                [[c, -s, -middle * sine[index]], [s, c, middle * cosine[index]], [0.0, 0.0, 1.0]]
            )
            covariance[index] = moved @ covariance[index] @ moved.T
    return ComponentFit(
        components=replace(
            components, orders=orders, frequencies=frequencies, cosine=cosine, sine=sine
        ),
        covariance=covariance,
        collinear=collinear,
        normal=normal,
        start=origin,
        table=table,
    )


def _unchanged(
    components: Components, table: FloatArray | None, earlier: ComponentFit | None
) -> tuple[NDArray[np.int64], NDArray[np.int64], Components]:
    """Rows of the normal matrix that an earlier one has, which these are there, and a start.

    The start is `components` with those that are the same as they were when their rows were
    made, so that small moves do not add up unseen.
    """
    none = np.empty(0, dtype=np.int64)
    if earlier is None or earlier.collinear or earlier.table is not table:
        return none, none, components
    before = earlier.start
    rows: list[tuple[int, int]] = []
    frequencies = components.frequencies.copy()
    cosine, sine = components.cosine.copy(), components.sine.copy()
    angles, angles_before = components.orders.size, before.orders.size
    tuned = 2 * components.size + int(components.free.sum())
    tuned_before = 2 * before.size + int(before.free.sum())
    for index, order in enumerate(components.orders):
        same = np.flatnonzero((before.orders == order) & ~before.free)
        if same.size == 1 and not components.free[index]:
            rows += [(2 * index + part, 2 * int(same[0]) + part) for part in (0, 1)]
    unit = 1.0 / (2.0 * components.center + 1.0)
    for index, frequency in enumerate(components.frequencies):
        near = np.abs(before.frequencies - frequency) < _SAME_FREQUENCY * unit
        at = angles + index
        change = np.hypot(
            before.cosine[angles_before:] - cosine[at], before.sine[angles_before:] - sine[at]
        )
        near &= change < _SAME_AMPLITUDE * np.hypot(cosine[at], sine[at])
        if near.sum() == 1:
            other = int(np.argmax(near))
            was = angles_before + other
            rows += [(2 * at + part, 2 * was + part) for part in (0, 1)]
            rows.append((tuned + index, tuned_before + other))
            frequencies[index] = before.frequencies[other]
            cosine[at], sine[at] = before.cosine[was], before.sine[was]
    if not rows:
        return none, none, components
    here, there = np.array(rows, dtype=np.int64).T
    origin = replace(components, frequencies=frequencies, cosine=cosine, sine=sine)
    return here, there, origin


def _turned(cosine: float, sine: float, angle: float) -> tuple[float, float]:
    """Amplitudes that keep the component's phase where the order's change would shift it."""
    c, s = np.cos(angle), np.sin(angle)
    return cosine * c - sine * s, sine * c + cosine * s


def removed(angle: FloatArray, table: FloatArray | None, components: Components) -> FloatArray:
    """`angle`, (samples,) rad, without the components."""
    rest = angle.copy()
    if components.size == 0:
        return rest
    weights = np.empty(2 * components.size)
    weights[0::2], weights[1::2] = components.cosine, components.sine
    start = 0
    for start, values in _blocks(angle.size, table, components, extra=0):
        count = values.shape[1]
        # Blocks overlap by the one sample that an increment reaches back.
        own = slice(start if start == 0 else start + 1, start + count)
        rest[own] -= (weights @ values)[-(own.stop - own.start) :]
    return rest


def _blocks(
    samples: int, table: FloatArray | None, components: Components, extra: int
) -> Iterator[tuple[int, FloatArray]]:
    """Start and values, (2 * components + extra, count), block by block.

    Consecutive blocks share one sample. The last `extra` rows are left to the caller.
    """
    angles = components.orders.size
    whole = (components.orders == np.rint(components.orders)) & (
        components.orders <= _MOST_MULTIPLIED
    )
    fixed = np.flatnonzero(whole & ~components.free)
    loose = np.flatnonzero(~(whole & ~components.free))
    harmonics = np.rint(components.orders[fixed]).astype(np.int64)
    harmonic_rows = np.empty((2 * fixed.size, _BLOCK + 1))
    for start in range(0, samples - 1, _BLOCK):
        count = min(_BLOCK + 1, samples - start)
        values = np.empty((2 * components.size + extra, count))
        if angles:
            # As above: orders imply a table.
            alpha = table[start : start + count]  # type: ignore[index]
            if fixed.size:
                rows = harmonic_rows[:, :count]
                _kernels.fill_harmonics(np.cos(alpha), np.sin(alpha), harmonics, rows)
                values[2 * fixed] = rows[0::2]
                values[2 * fixed + 1] = rows[1::2]
            for index in loose:
                phase = components.orders[index] * alpha
                values[2 * index] = np.cos(phase)
                values[2 * index + 1] = np.sin(phase)
        if components.frequencies.size:
            _kernels.fill_tones(
                start - components.center,
                components.frequencies,
                values[2 * angles : 2 * components.size],
            )
        yield start, values


def _inverse(normal: FloatArray) -> tuple[FloatArray, int]:
    """Inverse of the normal matrix, and how many directions were left out of it."""
    scale = np.sqrt(np.diag(normal))
    scale[scale == 0.0] = 1.0
    eigenvalues, vectors = scipy.linalg.eigh(normal / np.outer(scale, scale))
    keep = eigenvalues > _COLLINEAR * eigenvalues[-1] if eigenvalues.size else eigenvalues > 0
    used = vectors[:, keep]
    inverse = (used / eigenvalues[keep]) @ used.T
    return inverse / np.outer(scale, scale), int((~keep).sum())
