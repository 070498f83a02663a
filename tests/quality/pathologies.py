"""A still gyro, and what may go wrong with it between the sensor and the file."""

from collections.abc import Callable

import numpy as np

from sagnac.recording.model import Recording

RATE = 100.0
SAMPLES = 30_000
MEAN, SIGMA = 10.0, 1.8  # deg/h: N is 0.003 deg/sqrt(h)


def still(seed: int = 1) -> np.ndarray:
    return MEAN + SIGMA * np.random.default_rng(seed).standard_normal(SAMPLES)


def of_rate(x: np.ndarray, **more: np.ndarray) -> Recording:
    return Recording.from_arrays(x=x, kind="rate", unit="deg/h", sample_rate=RATE, **more)


def of_angle(x: np.ndarray) -> Recording:
    return Recording.from_arrays(x=x, kind="angle", unit="arcsec", sample_rate=RATE)


def angle(rate: np.ndarray) -> np.ndarray:
    """Arcsec, of a rate in deg/h."""
    return np.cumsum(rate) / RATE


def _changed(values: np.ndarray, places: object, new: object) -> np.ndarray:
    values = values.copy()
    values[places] = new
    return values


def clipped(low: float, high: float) -> Recording:
    return of_rate(np.clip(still(), MEAN + low * SIGMA, MEAN + high * SIGMA))


def bent(limit: float) -> Recording:
    """A soft limit, `limit` in sigma."""
    return of_rate(MEAN + limit * SIGMA * np.tanh((still() - MEAN) / (limit * SIGMA)))


def spiked(share: float, height: float) -> Recording:
    values = still()
    values[np.random.default_rng(5).random(SAMPLES) < share] += height * SIGMA
    return of_rate(values)


def zeros(share: float) -> Recording:
    lost = np.random.default_rng(2).random(SAMPLES) < share
    return of_rate(_changed(still(), lost, 0.0))


def far_zeros(share: float) -> Recording:
    """As `zeros`, of a gyro whose mean is a thousand times its noise."""
    lost = np.random.default_rng(2).random(SAMPLES) < share
    return of_rate(_changed(still() + 1000.0 * SIGMA - MEAN, lost, 0.0))


def stuck(runs: int, length: int) -> Recording:
    values = still()
    for start in np.linspace(0, SAMPLES - length, runs).astype(int):
        values[start : start + length] = values[start]
    return of_rate(values)


def stuck_once(length: int, off: float = 0.0) -> Recording:
    """A gyro that gives one value once, which lies `off` sigma from the mean."""
    return of_rate(_changed(still(), slice(7000, 7000 + length), MEAN + off * SIGMA))


def with_held(values: np.ndarray, share: float) -> np.ndarray:
    values = values.copy()
    for place in np.flatnonzero(np.random.default_rng(3).random(values.size - 1) < share) + 1:
        values[place] = values[place - 1]
    return values


def unsigned(bits: int) -> Recording:
    counts = np.rint(50.0 * (still() - MEAN) / SIGMA)
    return of_rate(np.where(counts < 0, counts + 2.0**bits, counts))


def louder(share: float, factor: float) -> Recording:
    values = still()
    part = slice(0, round(share * SAMPLES))
    values[part] = MEAN + factor * (values[part] - MEAN)
    return of_rate(values)


def late(samples: int) -> Recording:
    values = still()
    return of_rate(values[samples:], z=values[: SAMPLES - samples])


def growing(growth: float) -> Recording:
    return of_rate(MEAN + (still() - MEAN) * np.linspace(1.0, 1.0 + growth, SAMPLES))


def copied_in_part(share: float, samples: int) -> Recording:
    """The noise of z is in part that of x, late."""
    x, own = still() - MEAN, still(2) - MEAN
    z = share * np.roll(x, samples) + np.sqrt(1.0 - share**2) * own
    return of_rate(MEAN + x, z=MEAN + z)


def block_twice(samples: int) -> Recording:
    values = still()
    return of_rate(np.insert(values, 20_000, values[5000 : 5000 + samples]))


def starting_over(times: int) -> Recording:
    """An angle whose counter is too narrow."""
    turned = angle(still())
    return of_angle(np.mod(turned, (turned[-1] - turned[0]) / times))


# Name of the finding, the recording, and the factor on N: what theory or the making says.
PATHOLOGIES: dict[str, tuple[str, Callable[[], Recording], float | None]] = {
    "clipped at one sigma": ("clipping", lambda: clipped(-1.0, 1.0), 0.718),
    "clipped at 0.3 sigma": ("clipping", lambda: clipped(-0.3, 0.3), 0.269),
    "upper half clipped": ("clipping", lambda: clipped(-9.0, 0.0), 0.584),
    "angle of clipped increments": (
        "clipping",
        lambda: of_angle(angle(np.clip(still(), MEAN - SIGMA, MEAN + SIGMA))),
        0.718,
    ),
    # The standard deviation of 2.5 tanh(x / 2.5), x normal, by quadrature.
    "soft limit": ("short-tails", lambda: bent(2.5), 0.880),
    "a fifth are spikes": ("spikes", lambda: spiked(0.2, 10.0), None),
    "one spike": (
        "spikes",
        lambda: of_rate(_changed(still(), 7000, 1000.0 * SIGMA)),
        np.hypot(1.0, 1000.0 / np.sqrt(SAMPLES)),
    ),
    # A second at 20 sigma is 200 deviations of what a second of noise turns.
    "nudged": (
        "moved",
        lambda: of_rate(still() + 20.0 * SIGMA * (np.arange(SAMPLES) // 100 == 70)),
        np.hypot(1.0, 200.0 / np.sqrt(SAMPLES / 100)),
    ),
    "five per cent zeros": (
        "dropouts",
        lambda: zeros(0.05),
        np.sqrt(0.95 + 0.05 * 0.95 * (MEAN / SIGMA) ** 2),
    ),
    "a hundredth zeros, far from the mean": (
        "dropouts",
        lambda: far_zeros(0.01),
        np.sqrt(0.99 + 0.01 * 0.99 * 1e6),
    ),
    "angle that falls to zero": (
        "dropouts",
        lambda: of_angle(_changed(1000.0 + angle(still()), [4000, 9000], 0.0)),
        None,
    ),
    "stuck again and again": ("repeats", lambda: stuck(50, 99), np.sqrt(1 - 50 * 98 / SAMPLES)),
    "samples held": ("repeats", lambda: of_rate(with_held(still(), 0.2)), np.sqrt(1.2 / 0.8)),
    "coarse": ("resolution", lambda: of_rate(2.0 * SIGMA * np.rint(still() / (2.0 * SIGMA))), 1.15),
    "float32 angle": (
        "resolution",
        lambda: of_angle((5e7 + angle(still())).astype(np.float32)),
        None,
    ),
    "unsigned, 16 bits": ("wraps", lambda: unsigned(16), None),
    "unsigned, 24 bits": ("wraps", lambda: unsigned(24), None),
    "half ten times as loud": ("unsteady", lambda: louder(0.5, 10.0), np.sqrt(50.5)),
    "a twentieth ten times as loud": ("unsteady", lambda: louder(0.05, 10.0), np.sqrt(5.95)),
    "an angle that starts over": ("wraps", lambda: starting_over(5), None),
    # Power that grows as a straight line of its logarithm: the mean over the least.
    "grows by a fifth": ("unsteady", lambda: growing(0.2), 1.10),
    "a block twice": ("repeats", lambda: block_twice(200), 1.0),
    "a fifth of it is late": ("copy", lambda: copied_in_part(0.2, 3), np.sqrt(0.8)),
    "three seconds late": ("copy", lambda: late(300), None),
    "one sample late": ("copy", lambda: late(1), 0.0),
    "seven samples late": ("copy", lambda: late(7), 0.0),
    "the same gyro": ("copy", lambda: of_rate(still(), z=2.0 * still()), 0.0),
    "degrees beside arcseconds": (
        "units",
        lambda: of_rate(still(), z=still(2) / 3600.0),
        np.sqrt(0.5),
    ),
}
