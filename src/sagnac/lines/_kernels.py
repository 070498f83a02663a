"""Compiled loops of line removal: arrays in, arrays out; no validation, no files."""

# Compiled loops take their arrays by position.
# ruff: noqa: PLR0917

import numpy as np

from sagnac.core.arrays import BooleanArray, ComplexArray, FloatArray, IntegerArray
from sagnac.core.kernels import compiled


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
    phases = np.empty(2)
    steps = np.empty(2)
    lags = np.empty(2)
    sizes = np.empty(2)
    slopes = np.empty(2)
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
                target[pair, 1] += phasor * (
                    -sign * product * lags[0] + sign * 1j * slopes[0] * sizes[1]
                )
                target[pair, 2] += phasor * (-sign * product * lags[1] + 1j * sizes[0] * slopes[1])
                target[pair, 3] += phasor * (
                    -sign * product * lags[0] * lags[1]
                    + slopes[0] * slopes[1]
                    + 1j * (lags[0] * sizes[0] * slopes[1] + sign * lags[1] * sizes[1] * slopes[0])
                )
    return straight, mirrored


@compiled(fastmath=True)
def spread(
    table: FloatArray, steps: FloatArray, low: float, scale: float, grid: FloatArray
) -> None:
    """Add each step times the table's own to `grid`, over even angles about the middle of both.

    Point j of the grid is the angle ``low + (j - 1) / scale``. A cubic B-spline shares a product
    out: at x cycles a point its transform is ``sinc(x)^4``.
    """
    for n in range(steps.size):
        weight = steps[n] * (table[n + 1] - table[n]) / 6.0
        place = (0.5 * (table[n] + table[n + 1]) - low) * scale
        at = int(place)
        t = place - at
        u = 1.0 - t
        grid[at] += weight * u * u * u
        grid[at + 1] += weight * (4.0 - 3.0 * t * t * (1.0 + u))
        grid[at + 2] += weight * (4.0 - 3.0 * u * u * (1.0 + t))
        grid[at + 3] += weight * t * t * t


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
    blocks = envelope.shape[1]
    for n in range(out.size):
        place = (start + n) * scale
        k = min(int(place), blocks - 1)
        x = place - k
        a = envelope[3, k] + x * (envelope[2, k] + x * (envelope[1, k] + x * envelope[0, k]))
        phi = phase[3, k] + x * (phase[2, k] + x * (phase[1, k] + x * phase[0, k]))
        turns = frequency * (start + n - center)
        turns -= np.floor(turns)
        phi += 2.0 * np.pi * turns
        out[n] = a.real * np.cos(phi) - a.imag * np.sin(phi)


@compiled()
def orthogonal_products(
    sampling: ComplexArray,
    tilted: ComplexArray,
    chosen: IntegerArray,
    row: FloatArray,
    candidates: int,
) -> ComplexArray:
    """Inner products of exp(i k phase), k = 1 ... candidates, with one function.

    `sampling[k]` is the mean of exp(i k phase), `tilted[k]` of ramp * exp(i k phase), and `row`
    holds the function's coefficients on 1, ramp and the cosine and sine of each chosen k - 1.
    """
    products = np.empty(candidates, dtype=np.complex128)
    for m in range(candidates):
        products[m] = row[0] * sampling[m + 1] + row[1] * tilted[m + 1]
    for term in range(chosen.size):
        other = chosen[term]
        up = 0.5 * (row[2 + 2 * term] - 1j * row[3 + 2 * term])
        down = 0.5 * (row[2 + 2 * term] + 1j * row[3 + 2 * term])
        if up == 0.0:
            continue
        for m in range(candidates):
            products[m] += up * sampling[m + other + 2]
        for m in range(min(other, candidates)):
            products[m] += down * np.conj(sampling[other - m])
        for m in range(other, candidates):
            products[m] += down * sampling[m - other]
    return products


@compiled(inline="always")
def _overlap(lag: int, length: int, sines: FloatArray, inverse: FloatArray) -> float:
    """Mean over the samples n, counted from mid-record, of cos(2 pi lag n / length)."""
    if lag == 0:
        return 1.0
    lag = abs(lag)
    # The table covers half a cycle per sample; the other half mirrors it.
    return float(sines[lag % sines.size] * inverse[min(lag, length - lag)])


@compiled(inline="always")
def _tilt(
    place: int, samples: int, sines: FloatArray, cosines: FloatArray, inverse: FloatArray
) -> float:
    """Mean of ramp * sin(2 pi place n / length), where the ramp runs from -1 to 1."""
    size = inverse[place]
    bend = np.sqrt(max(1.0 - 1.0 / (samples * size) ** 2, 0.0))
    turn = place % sines.size
    slope = sines[turn] * samples * size * bend - samples * cosines[turn]
    return float(slope * size / (samples - 1))


@compiled()
def grid_powers(
    even: FloatArray,
    odd: FloatArray,
    tables: tuple[FloatArray, FloatArray, FloatArray],
    length: int,
    samples: int,
    ramp_power: float,
) -> None:
    """Mean squares of cosine and sine of every candidate, made orthogonal to 1 and to the ramp."""
    sines, cosines, inverse = tables
    for place in range(1, even.size + 1):
        double = _overlap(2 * place, length, sines, inverse)
        level = _overlap(place, length, sines, inverse)
        tilt = _tilt(place, samples, sines, cosines, inverse)
        even[place - 1] = 0.5 * (1.0 + double) - level**2
        odd[place - 1] = 0.5 * (1.0 - double) - tilt**2 / ramp_power


@compiled()
def grid_tilts(
    places: IntegerArray,
    samples: int,
    tables: tuple[FloatArray, FloatArray, FloatArray],
) -> FloatArray:
    """Mean of ramp times sine at some places."""
    sines, cosines, inverse = tables
    result = np.empty(places.size)
    for index in range(places.size):
        result[index] = _tilt(places[index], samples, sines, cosines, inverse)
    return result


@compiled()
def grid_overlaps(
    lags: IntegerArray, length: int, tables: tuple[FloatArray, FloatArray, FloatArray]
) -> FloatArray:
    """Mean of the cosine at some sums or differences of places."""
    sines, _, inverse = tables
    result = np.empty(lags.size)
    for index in range(lags.size):
        result[index] = _overlap(lags[index], length, sines, inverse)
    return result


@compiled()
def _best_of(
    low: int,
    high: int,
    even: FloatArray,
    odd: FloatArray,
    even_power: FloatArray,
    odd_power: FloatArray,
    least: float,
    walk: float,
    white: float,
) -> tuple[float, int]:
    """Greatest drop of the mean square that a candidate from `low` to `high` brings, and which.

    Drops below walk / place^2 + white do not count.
    """
    best, place = 0.0, low
    for m in range(low, high + 1):
        if even_power[m - 1] > least and odd_power[m - 1] > least:
            merit = even[m - 1] ** 2 / even_power[m - 1] + odd[m - 1] ** 2 / odd_power[m - 1]
            if merit > best and merit > walk / m**2 + white:
                best, place = merit, m
    return best, place


@compiled()
def _repeated(sines: FloatArray, size: int, step: int) -> FloatArray:
    """(size,) `sines` over and over, forwards (`step` 1) or backwards from the first (-1)."""
    result = np.empty(size)
    for index in range(size):
        result[index] = sines[step * index % sines.size]
    return result


@compiled()
def _take(
    even: FloatArray,
    odd: FloatArray,
    start: int,
    stop: int,
    a: float,
    b: float,
    wave: FloatArray,
    inverse: FloatArray,
    lag: int,
    step: int,
) -> None:
    """Take `a` and `b` times the overlap off the products of candidates `start` to `stop` - 1.

    The overlap is `wave`, from its first on, times `inverse`, from `lag` on, forwards (`step` 1)
    or backwards (-1). The loops have neither branch nor remainder, so that the compiler makes of
    them several candidates at once.
    """
    count = stop - start
    if count <= 0:
        return
    evens, odds = even[start - 1 : stop - 1], odd[start - 1 : stop - 1]
    if step > 0:
        near = inverse[lag:]
        for index in range(count):
            shared = wave[index] * near[index]
            evens[index] -= a * shared
            odds[index] -= b * shared
    else:
        near = inverse[lag - count + 1 :]
        for index in range(count):
            shared = wave[index] * near[count - 1 - index]
            evens[index] -= a * shared
            odds[index] -= b * shared


@compiled()
def grid_update(
    even: FloatArray,
    odd: FloatArray,
    even_power: FloatArray,
    odd_power: FloatArray,
    tables: tuple[FloatArray, FloatArray, FloatArray],
    length: int,
    samples: int,
    places: IntegerArray,
    even_change: FloatArray,
    odd_change: FloatArray,
    reach: IntegerArray,
    tilt_change: float,
    tilt_reach: int,
    least: float,
    walk: float,
    white: float,
    stale: BooleanArray,
    best: FloatArray,
    best_place: IntegerArray,
    block: int,
) -> None:
    """Products of every candidate with what is left, after coefficients changed; and the best.

    `places` are those of the chosen, 0 for the constant. A change reaches so far that what it
    adds beyond is negligible. Blocks that nothing reaches keep their best, unless they are stale.
    """
    sines, cosines, inverse = tables
    cycle = sines.size
    ahead, back = _repeated(sines, block + cycle, 1), _repeated(sines, block + cycle, -1)
    for number in range(best.size):
        low, high = number * block + 1, min((number + 1) * block, even.size)
        touched = stale[number]
        for term in range(places.size):
            place, far = places[term], reach[term]
            a, b = 0.5 * even_change[term], 0.5 * odd_change[term]
            if low - far <= place <= high + far:
                touched = True
                split = min(max(place, low), high + 1)
                wave = back[(low - place) % cycle :]
                _take(even, odd, low, split, a, b, wave, inverse, place - low, -1)
                wave = ahead[(split - place) % cycle :]
                _take(even, odd, split, high + 1, a, b, wave, inverse, split - place, 1)
                if low <= place <= high:
                    # The table of inverses has a 0 for the overlap with itself, which is 1.
                    even[place - 1] -= a
                    odd[place - 1] -= b
            if low + place <= far or length - (high + place) <= far:
                touched = True
                # Beyond half a cycle a sample the table of inverses is gone through backwards.
                split = min(max(length // 2 + 1 - place, low), high + 1)
                wave = ahead[(low + place) % cycle :]
                _take(even, odd, low, split, a, -b, wave, inverse, low + place, 1)
                wave, lag = ahead[(split + place) % cycle :], length - (split + place)
                _take(even, odd, split, high + 1, a, -b, wave, inverse, lag, -1)
        if low <= tilt_reach:
            touched = True
            for m in range(low, high + 1):
                odd[m - 1] -= tilt_change * _tilt(m, samples, sines, cosines, inverse)
        if touched:
            best[number], best_place[number] = _best_of(
                low, high, even, odd, even_power, odd_power, least, walk, white
            )
            stale[number] = False
