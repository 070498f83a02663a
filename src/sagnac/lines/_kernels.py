"""Compiled loops of line removal: arrays in, arrays out; no validation, no files."""

# Compiled loops take their arrays by position.
# ruff: noqa: PLR0917

import numpy as np

from sagnac.core.arrays import BooleanArray, ComplexArray, FloatArray, IntegerArray
from sagnac.core.kernels import compiled

# Samples over which the phase of a tone is carried on by products.
_RUN = 64


@compiled(fastmath=True)
def paired_sums(
    rates: FloatArray,
    in_angle: BooleanArray,
    first: IntegerArray,
    second: IntegerArray,
    angle: FloatArray,
    step: FloatArray,
    lag: FloatArray,
    count: FloatArray,
    middle: float,
    span: float,
    turn: float,
) -> tuple[ComplexArray, ComplexArray]:
    """Sums over blocks of the increments of two phasors and of their derivatives.

    The phase of component j is ``rates[j]`` times the table angle where ``in_angle[j]``, else
    times the sample number from mid-record (`lag`). It is taken to be straight over a block of
    `count` steps, which then sum to ``sin(count x / 2) / sin(x / 2)``, x the difference of both
    phases a step. A derivative is the phasor times ``(angle - middle) / span``, or times
    ``turn * lag``.

    Returns
    -------
    straight, mirrored
        (pairs, 4): `first` with the conjugate of `second`, and `first` with `second`: both plain,
        the first's derivative, the second's derivative, both derivatives.
    """
    # One loop nest, since each sum needs the phases, sizes and slopes of both sides at hand.
    straight = np.zeros((first.size, 4), dtype=np.complex128)
    mirrored = np.zeros((first.size, 4), dtype=np.complex128)
    phases, steps, lags = np.empty(2), np.empty(2), np.empty(2)
    sizes, slopes = np.empty(2), np.empty(2)
    for pair in range(first.size):
        members = (first[pair], second[pair])
        for b in range(angle.size):
            for side in range(2):
                rate = rates[members[side]]
                if in_angle[members[side]]:
                    phases[side] = rate * angle[b]
                    steps[side] = rate * step[b]
                    lags[side] = (angle[b] - middle) / span
                    slope = step[b] / span
                else:
                    phases[side] = rate * lag[b]
                    steps[side] = rate
                    lags[side] = turn * lag[b]
                    slope = turn
                sizes[side] = 2.0 * np.sin(0.5 * steps[side])
                slopes[side] = slope * np.cos(0.5 * steps[side])
            product = sizes[0] * sizes[1]
            for sign in (-1.0, 1.0):
                half = 0.5 * (steps[0] + sign * steps[1])
                if abs(np.sin(half)) < 1e-9:
                    weight = count[b] * np.cos(count[b] * half) / np.cos(half)
                else:
                    weight = np.sin(count[b] * half) / np.sin(half)
                phasor = weight * np.exp(1j * (phases[0] + sign * phases[1]))
                # (1j size lag + slope) of the first times that of the second, or its conjugate.
                target = straight if sign < 0.0 else mirrored
                target[pair, 0] -= sign * product * phasor
                crossed = -sign * product * lags[0] + sign * 1j * slopes[0] * sizes[1]
                target[pair, 1] += phasor * crossed
                target[pair, 2] += phasor * (-sign * product * lags[1] + 1j * sizes[0] * slopes[1])
                target[pair, 3] += phasor * (
                    -sign * product * lags[0] * lags[1]
                    + slopes[0] * slopes[1]
                    + 1j * (lags[0] * sizes[0] * slopes[1] + sign * lags[1] * sizes[1] * slopes[0])
                )
    return straight, mirrored


@compiled(fastmath=True)
def spread(table: FloatArray, steps: FloatArray, low: float, scale: float, out: FloatArray) -> None:
    """Add each step times the table's own to `out`, over even angles about the middle of both.

    Point j of the grid is the angle ``low + (j - 1) / scale``. A cubic B-spline shares a product
    out: at x cycles a point its transform is ``sinc(x)^4``.
    """
    for n in range(steps.size):
        weight = steps[n] * (table[n + 1] - table[n]) / 6.0
        place = (0.5 * (table[n] + table[n + 1]) - low) * scale
        at = int(place)
        t = place - at
        u = 1.0 - t
        out[at] += weight * u * u * u
        out[at + 1] += weight * (4.0 - 3.0 * t * t * (1.0 + u))
        out[at + 2] += weight * (4.0 - 3.0 * u * u * (1.0 + t))
        out[at + 3] += weight * t * t * t


@compiled()
def spline_normal(block: IntegerArray, rows: ComplexArray, blocks: int) -> ComplexArray:
    """Normal matrix of cubic splines, (4, blocks + 3) upper bands; the last is the diagonal.

    Value n is a sum of ``rows[n, p]`` times coefficient ``block[n] + p``, p = 0 ... 3.
    """
    band = np.zeros((4, blocks + 3), dtype=np.complex128)
    for n in range(block.size):
        for p in range(4):
            for q in range(p, 4):
                band[3 + p - q, block[n] + q] += np.conj(rows[n, p]) * rows[n, q]
    return band


@compiled()
def spline_products(
    block: IntegerArray, rows: ComplexArray, weights: ComplexArray, blocks: int
) -> ComplexArray:
    """(blocks + 3,) inner products of each column of those rows with `weights`."""
    products = np.zeros(blocks + 3, dtype=np.complex128)
    for n in range(block.size):
        for p in range(4):
            products[block[n] + p] += np.conj(rows[n, p]) * weights[n]
    return products


@compiled()
def inverse_bands(factor: ComplexArray, inverse: ComplexArray) -> None:
    """Fill `inverse` with upper bands of the inverse of a matrix, (4, size), first the diagonal.

    `factor` is its upper Cholesky factor in bands, (4, size), the last of which is the diagonal.
    Outside the bands the inverse is full, and is not needed for them (Takahashi, Fagan and Chin
    1973): from the last row to the first, each element follows from those of the rows below.
    """
    size = factor.shape[1]
    for i in range(size - 1, -1, -1):
        own = factor[3, i]
        last = min(i + 4, size)
        # The diagonal comes last: it takes the row's other elements.
        for j in range(last - 1, i - 1, -1):
            total = 0j
            for k in range(i + 1, last):
                one = inverse[j - k, k] if k <= j else np.conj(inverse[k - j, j])
                total -= factor[3 + i - k, k] * one
            inverse[j - i, i] = total / own
        inverse[0, i] += 1.0 / (own.real**2 + own.imag**2)


@compiled(fastmath=True)
def drifting_tone(
    start: int,
    frequency: float,
    center: float,
    scale: float,
    envelope: ComplexArray,
    phase: FloatArray,
    out: FloatArray,
) -> None:
    """Fill `out` with ``Re[a(n) exp(i phi(n)) exp(2j pi frequency (n - center))]`` from `start`.

    `envelope` and `phase` are (4, blocks) polynomials of a and phi, highest power first, in
    blocks from the start of each; there are `scale` blocks a sample.
    """
    blocks, n = envelope.shape[1], 0
    while n < out.size:
        k = min(int((start + n) * scale), blocks - 1)
        # Few enough that rounding does not add up, and none of the next block.
        stop = min(out.size, n + _RUN)
        if k < blocks - 1:
            stop = max(n + 1, min(stop, int(np.ceil((k + 1) / scale)) - start))
        x = (start + n) * scale - k
        # The phase from here on is a cubic of the number of the sample: its third difference is
        # constant, so that a sample takes three products and neither sine nor cosine.
        turns = frequency * (start + n - center)
        cubed = phase[0, k] * scale**3
        squared = (phase[1, k] + 3.0 * x * phase[0, k]) * scale**2
        straight = (phase[2, k] + x * (2.0 * phase[1, k] + 3.0 * x * phase[0, k])) * scale
        straight += 2.0 * np.pi * frequency
        phi = phase[3, k] + x * (phase[2, k] + x * (phase[1, k] + x * phase[0, k]))
        wave = np.exp(1j * (phi + 2.0 * np.pi * (turns - np.floor(turns))))
        first = np.exp(1j * (straight + squared + cubed))
        second = np.exp(1j * (2.0 * squared + 6.0 * cubed))
        third = np.exp(6.0j * cubed)
        for m in range(n, stop):
            x = (start + m) * scale - k
            a = envelope[3, k] + x * (envelope[2, k] + x * (envelope[1, k] + x * envelope[0, k]))
            out[m] = a.real * wave.real - a.imag * wave.imag
            wave *= first
            first *= second
            second *= third
        n = stop


@compiled()
def take_pairs(
    left: FloatArray,
    overlap: FloatArray,
    places: IntegerArray,
    change: FloatArray,
    reach: IntegerArray,
    length: int,
    mirror: float,
) -> None:
    """Take changed pairs off the products of all cosines and sines on a grid with what is left.

    `left` and `change` are (2, candidates) and (2, pairs); place m is candidate m - 1. Pairs m and
    k share the overlap at m - k and, with the other sign for sines, that at m + k. It is known up
    to half of `length` and mirrors itself beyond. A pair counts as far as it reaches.
    """
    count = left.shape[1]
    cosines, sines = left[0], left[1]
    for pair in range(places.size):
        place, far = places[pair], reach[pair]
        a, b = change[0, pair], change[1, pair]
        # Each loop goes through neighbours, so that the compiler takes several at once.
        for lag in range(max(1, place - count), min(place - 1, far) + 1):
            cosines[place - 1 - lag] -= a * overlap[lag]
            sines[place - 1 - lag] -= b * overlap[lag]
        for m in range(max(place, 1), min(count, place + far) + 1):
            cosines[m - 1] -= a * overlap[m - place]
            sines[m - 1] -= b * overlap[m - place]
        half = min(count, length // 2 - place)
        for m in range(1, min(half, far - place) + 1):
            cosines[m - 1] -= a * overlap[m + place]
            sines[m - 1] += b * overlap[m + place]
        for m in range(max(half + 1, length - place - far), count + 1):
            cosines[m - 1] -= mirror * a * overlap[length - m - place]
            sines[m - 1] += mirror * b * overlap[length - m - place]


@compiled()
def best_pair(
    left: FloatArray, power: FloatArray, least: float, walk: float, white: float
) -> tuple[float, int]:
    """Greatest drop of the mean square that a pair on a grid brings, and its place.

    Drops below walk / place^2 + white do not count, nor do pairs with less power than `least`.
    """
    best, place = 0.0, 1
    for m in range(left.shape[1]):
        if power[0, m] > least and power[1, m] > least:
            merit = left[0, m] ** 2 / power[0, m] + left[1, m] ** 2 / power[1, m]
            if merit > best and merit > walk / (m + 1) ** 2 + white:
                best, place = merit, m + 1
    return best, place


@compiled()
def level_at(floor: FloatArray, halves: FloatArray, n: int) -> float:
    """Floor at half bin n: given there, or else at whole bins and, if higher, at those between."""
    if halves.size == 0:
        return float(floor[n])
    own = 0.5 * (floor[n // 2] + floor[min((n + 1) // 2, floor.size - 1)])
    return float(max(own, halves[min(n // 2, halves.size - 1)]))


@compiled()
def peaks(
    power: FloatArray, floor: FloatArray, halves: FloatArray, first: int, stop: int, least: float
) -> FloatArray:
    """(2, peaks) tops of parabolas through three ratios of power to floor, and the power there.

    A peak is at a half bin from `first` to before `stop`, and its ratio is above `least`.
    """
    count = 0
    found = np.empty((2, stop - first))
    before = power[first - 1] / level_at(floor, halves, first - 1)
    here = power[first] / level_at(floor, halves, first)
    for n in range(first, stop):
        after = power[n + 1] / level_at(floor, halves, n + 1)
        if here > least and here >= before and here > after:
            found[0, count] = n + 0.5 * (before - after) / (before - 2.0 * here + after)
            found[1, count] = power[n]
            count += 1
        before, here = here, after
    return found[:, :count].copy()
