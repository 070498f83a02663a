"""What goes wrong between a sensor and its file: thirty and some pathologies, each of any strength.

A gyro at rest, or a pair on a table that turns at 20 deg/s, three minutes at 100 Hz; x is spoilt,
or the encoder, or the stamps.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

import sagnac
from sagnac.core.arrays import FloatArray
from sagnac.recording.channel import Kind

RATE: Final = 100.0
SAMPLES: Final = 18_000
WALK: Final = 0.003  # deg/sqrt(h)
SIGMA: Final = WALK * 60.0 * math.sqrt(RATE)  # deg/h
MEAN: Final = 10.0  # deg/h
TABLE: Final = 20.0  # deg/s
# No two gyros of a triad sense the same.
SHARES: Final = {"x": 0.577, "z": 0.575}
UNITS: Final[dict[Kind, str]] = {"rate": "deg/h", "angle": "arcsec"}

Generator = np.random.Generator


@dataclass(frozen=True, slots=True, kw_only=True)
class Samples:
    """What a file would hold.

    Attributes
    ----------
    x, z
        Of the gyros, deg/h or arcsec; z is None if there is one gyro.
    table
        Encoder, deg; None at rest.
    times
        Stamps, s; None if there are none.
    kind
        Of the gyros.
    motion
        Rate that x shows of the table, or its mean at rest, deg/h: the rest is noise.
    """

    x: FloatArray
    z: FloatArray | None
    table: FloatArray | None
    motion: FloatArray
    times: FloatArray | None = None
    kind: Kind = "rate"

    def recording(self) -> sagnac.Recording:
        """As a reader would make it."""
        more = {} if self.z is None else {"z": self.z}
        return sagnac.Recording.from_arrays(
            x=self.x,
            kind=self.kind,
            unit=UNITS[self.kind],
            sample_rate=None if self.times is not None else RATE,
            times=self.times,
            # Files are read once, arrays may be worked on in place.
            table=None if self.table is None else self.table.copy(),
            table_unit=None if self.table is None else "deg",
            **more,
        )


Fault = Callable[[Samples, float, Generator], Samples]
OfRates = Callable[[FloatArray, float, Generator], FloatArray]


@dataclass(frozen=True, slots=True, kw_only=True)
class Pathology:
    """One fault.

    Attributes
    ----------
    name, unit
        What it is, and what its strength counts.
    strengths
        From weak to strong.
    spoil
        Samples, strength and generator -> the samples of the file.
    pair
        Whether it takes two gyros at rest, too.
    standing, turning
        Whether there is such a thing at rest, and on a table.
    """

    name: str
    unit: str
    strengths: tuple[float, ...]
    spoil: Fault
    pair: bool = False
    standing: bool = True
    turning: bool = True

    def recording(self, strength: float, seed: int, *, turning: bool) -> sagnac.Recording:
        """A recording with this fault."""
        random = np.random.default_rng(seed)
        sound = _sound(random, turning=turning, pair=self.pair or turning)
        return self.spoil(sound, strength, random).recording()


def _sound(random: Generator, *, turning: bool, pair: bool) -> Samples:
    ripple = np.sin(2.0 * np.pi * np.arange(SAMPLES) / RATE * TABLE / 30.0)
    table_rate = TABLE + 0.01 * ripple
    moving = [
        3600.0 * share * table_rate if turning else np.full(SAMPLES, MEAN)
        for share in SHARES.values()
    ]
    x, z = (one + SIGMA * random.standard_normal(SAMPLES) for one in moving)
    table = np.cumsum(table_rate) / RATE if turning else None
    return Samples(x=x, z=z if pair else None, table=table, motion=moving[0])


# --- samples of a gyro --------------------------------------------------------------------------


def _of_x(spoil: OfRates) -> Fault:
    """A fault of the rates of x."""
    return lambda sound, strength, random: replace(sound, x=spoil(sound.x, strength, random))


def _of_noise(spoil: OfRates) -> Fault:
    """A fault of what x shows besides its motion."""

    def spoilt(sound: Samples, strength: float, random: Generator) -> Samples:
        return replace(sound, x=sound.motion + spoil(sound.x - sound.motion, strength, random))

    return spoilt


def _of_angle(spoil: OfRates) -> Fault:
    """A fault of the angle of x."""

    def spoilt(sound: Samples, strength: float, random: Generator) -> Samples:
        x = np.cumsum(sound.x) / RATE
        z = None if sound.z is None else np.cumsum(sound.z) / RATE
        return replace(sound, x=spoil(x, strength, random), z=z, kind="angle")

    return spoilt


def _clip(low: float, high: float) -> OfRates:
    """Limits at `low` and `high` sigma, divided by the strength: a stronger one lies nearer."""

    def spoil(rate: FloatArray, strength: float, _: Generator) -> FloatArray:
        mean = float(np.median(rate))
        reach = SIGMA / strength
        return np.clip(rate, mean + low * reach, mean + high * reach)

    return spoil


def _at(share: float, random: Generator, size: int = SAMPLES) -> FloatArray:
    return random.random(size) < share


def _spiked(height: float) -> OfRates:
    def spoil(rate: FloatArray, share: float, random: Generator) -> FloatArray:
        return np.where(_at(share, random), rate + height * SIGMA, rate)

    return spoil


def _one_spike(rate: FloatArray, strength: float, random: Generator) -> FloatArray:
    rate = rate.copy()
    rate[random.integers(100, SAMPLES - 100)] += strength * SIGMA
    return rate


def _lost(rate: FloatArray, share: float, random: Generator) -> FloatArray:
    return np.where(_at(share, random), 0.0, rate)


def _held(rate: FloatArray, share: float, random: Generator) -> FloatArray:
    rate = rate.copy()
    for place in np.flatnonzero(_at(share, random)[1:]) + 1:
        rate[place] = rate[place - 1]
    return rate


def _runs(length: int, share: float, random: Generator) -> FloatArray:
    """Where runs of a length begin that take a share of the samples."""
    return random.integers(0, SAMPLES - length, round(share * SAMPLES / length))


def _stuck(length: int) -> OfRates:
    def spoil(rate: FloatArray, share: float, random: Generator) -> FloatArray:
        rate = rate.copy()
        for start in _runs(length, share, random):
            rate[start : start + length] = rate[start]
        return rate

    return spoil


def _zero_runs(rate: FloatArray, share: float, random: Generator) -> FloatArray:
    rate = rate.copy()
    for start in _runs(50, share, random):
        rate[start : start + 50] = 0.0
    return rate


def _coarse(rate: FloatArray, strength: float, _: Generator) -> FloatArray:
    return strength * SIGMA * np.rint(rate / (strength * SIGMA))


def _unsigned(bits: int) -> OfRates:
    def spoil(rate: FloatArray, strength: float, _: Generator) -> FloatArray:
        counts = np.rint((rate - np.median(rate)) / SIGMA * 20.0 + 60.0 - 30.0 * strength)
        return np.where(counts < 0, counts + 2.0**bits, counts) * SIGMA / 20.0

    return spoil


def _louder(factor: float) -> OfRates:
    def spoil(noise: FloatArray, share: float, random: Generator) -> FloatArray:
        noise = noise.copy()
        count = round(share * SAMPLES)
        start = int(random.integers(0, SAMPLES - count + 1))
        noise[start : start + count] *= factor
        return noise

    return spoil


def _growing(noise: FloatArray, strength: float, _: Generator) -> FloatArray:
    return noise * (1.0 + strength * np.linspace(0.0, 1.0, SAMPLES))


def _stepped(rate: FloatArray, strength: float, random: Generator) -> FloatArray:
    rate = rate.copy()
    rate[int(random.integers(SAMPLES // 4, 3 * SAMPLES // 4)) :] += strength * SIGMA
    return rate


def _bit(rate: FloatArray, share: float, random: Generator) -> FloatArray:
    """One bit of the counts, of 64 sigma, is wrong now and then."""
    return np.where(_at(share, random), rate + 64.0 * SIGMA, rate)


def _soft(noise: FloatArray, strength: float, _: Generator) -> FloatArray:
    return SIGMA / strength * np.tanh(noise * strength / SIGMA)


def _hole(rate: FloatArray, samples: float, random: Generator) -> FloatArray:
    rate = rate.copy()
    start = int(random.integers(100, SAMPLES // 2))
    rate[start : start + round(samples)] = np.nan
    return rate


def _in_another_unit(rate: FloatArray, factor: float, _: Generator) -> FloatArray:
    return factor * rate


# --- angles -------------------------------------------------------------------------------------


def _single_precision(angle: FloatArray, degrees: float, _: Generator) -> FloatArray:
    """The counter has run for a while already."""
    return (3600.0 * degrees + angle).astype(np.float32).astype(np.float64)


def _wrapping(angle: FloatArray, wraps: float, _: Generator) -> FloatArray:
    """Signed counts of an angle, read as unsigned: it falls by the width of the counter."""
    width = (angle.max() - angle.min()) / wraps
    return np.mod(angle + 0.5 * width, width)


def _stepping(angle: FloatArray, arcseconds: float, random: Generator) -> FloatArray:
    angle = angle.copy()
    angle[int(random.integers(SAMPLES // 4, 3 * SAMPLES // 4)) :] += arcseconds
    return angle


# --- two gyros ----------------------------------------------------------------------------------


def _partial_copy(sound: Samples, share: float, _: Generator) -> Samples:
    """The noise of z is in part that of x, one sample later."""
    if sound.z is None:
        raise ValueError("z is None; a copy takes two gyros")
    shown = SHARES["z"] / SHARES["x"] if sound.table is not None else 1.0
    moving = shown * sound.motion
    own = math.sqrt(1.0 - share * share) * (sound.z - moving)
    return replace(sound, z=moving + own + share * np.roll(sound.x - sound.motion, 1))


def _late_copy(sound: Samples, samples: float, _: Generator) -> Samples:
    """z is x, some samples later."""
    late = round(samples)
    table = None if sound.table is None else sound.table[late:]
    return replace(sound, x=sound.x[late:], z=sound.x[: sound.x.size - late], table=table)


# --- rows, stamps and the encoder ---------------------------------------------------------------


def _of_rows(sound: Samples, rows: FloatArray) -> Samples:
    """Some rows of the file, in some order, without stamps."""
    return replace(
        sound,
        x=sound.x[rows],
        z=None if sound.z is None else sound.z[rows],
        table=None if sound.table is None else sound.table[rows],
    )


def _lost_rows(sound: Samples, share: float, random: Generator) -> Samples:
    return _of_rows(sound, np.flatnonzero(~_at(share, random)))


def _lost_block(sound: Samples, samples: float, random: Generator) -> Samples:
    start = int(random.integers(SAMPLES // 4, SAMPLES // 2))
    return _of_rows(sound, np.delete(np.arange(SAMPLES), np.s_[start : start + round(samples)]))


def _block_twice(sound: Samples, share: float, random: Generator) -> Samples:
    size = round(share * SAMPLES)
    start = int(random.integers(0, SAMPLES - size + 1))
    rows = np.arange(SAMPLES)
    return _of_rows(sound, np.insert(rows, start + size, rows[start : start + size]))


def _stamps_jump(sound: Samples, seconds: float, random: Generator) -> Samples:
    """The clock is set, forwards or backwards."""
    times = np.arange(SAMPLES) / RATE
    times[int(random.integers(SAMPLES // 4, 3 * SAMPLES // 4)) :] += seconds
    return replace(sound, times=times)


def _of_table(spoil: OfRates) -> Fault:
    def spoilt(sound: Samples, strength: float, random: Generator) -> Samples:
        if sound.table is None:
            raise ValueError("table is None; the fault is of an encoder")
        return replace(sound, table=spoil(sound.table.copy(), strength, random))

    return spoilt


def _table_jumps(table: FloatArray, degrees: float, random: Generator) -> FloatArray:
    """From one sample to the next, for good."""
    table[int(random.integers(SAMPLES // 4, 3 * SAMPLES // 4)) :] += degrees
    return table


def _table_spikes(table: FloatArray, degrees: float, random: Generator) -> FloatArray:
    """For one sample, ten times."""
    table[random.choice(np.arange(100, SAMPLES - 100, 10), 10, replace=False)] += degrees
    return table


def _table_held(table: FloatArray, share: float, random: Generator) -> FloatArray:
    """The reading before once more."""
    return _held(table, share, random)


def _table_stuck(table: FloatArray, share: float, random: Generator) -> FloatArray:
    """For half a second, again and again."""
    return _stuck(50)(table, share, random)


def _table_late(table: FloatArray, samples: float, _: Generator) -> FloatArray:
    late = round(samples)
    start = table[0] - TABLE / RATE * np.arange(late, 0, -1)
    return np.concatenate([start, table[: table.size - late]])


_SHARES: Final = (1e-4, 1e-3, 0.01, 0.05, 0.2)
_REACHES: Final = (0.25, 0.33, 0.5, 1.0, 3.0)


def _pathology(
    name: str,
    unit: str,
    strengths: tuple[float, ...],
    spoil: OfRates,
    of: Callable[[OfRates], Fault] = _of_x,
) -> Pathology:
    return Pathology(name=name, unit=unit, strengths=strengths, spoil=of(spoil))


_OF_SAMPLES: Final = (
    _pathology("clipped on both sides", "sigma/limit", _REACHES, _clip(-1.0, 1.0)),
    _pathology("clipped above", "sigma/limit", _REACHES, _clip(-99.0, 1.0)),
    _pathology("clipped below", "sigma/limit", _REACHES, _clip(-1.0, 99.0)),
    _pathology("soft saturation", "sigma/limit", (0.05, 0.1, 0.3, 1.0), _soft, _of_noise),
    _pathology("one spike", "sigma", (5.0, 10.0, 30.0, 100.0, 1000.0), _one_spike),
    _pathology("spikes of 10 sigma", "share", _SHARES, _spiked(10.0)),
    _pathology("spikes of 100 sigma", "share", _SHARES, _spiked(100.0)),
    _pathology("a bit that flips", "share", _SHARES, _bit),
    _pathology("zeros", "share", _SHARES, _lost),
    _pathology("runs of 50 zeros", "share", _SHARES[1:], _zero_runs),
    _pathology("held samples", "share", _SHARES, _held),
    _pathology("stuck runs of 20", "share", _SHARES[1:], _stuck(20)),
    _pathology("stuck runs of 99", "share", _SHARES[2:], _stuck(99)),
    _pathology("coarse counts", "step/sigma", (0.3, 1.0, 1.2, 2.0, 4.0), _coarse),
    _pathology("unsigned, 12 bits", "offset", (0.0, 1.0, 2.0), _unsigned(12)),
    _pathology("unsigned, 16 bits", "offset", (0.0, 1.0, 2.0), _unsigned(16)),
    _pathology("unsigned, 24 bits", "offset", (0.0, 1.0, 2.0), _unsigned(24)),
    _pathology("twice as loud for a while", "share", _SHARES[1:], _louder(2.0), _of_noise),
    _pathology("ten times as loud for a while", "share", _SHARES[1:], _louder(10.0), _of_noise),
    _pathology("louder and louder", "growth", (0.05, 0.1, 0.3, 1.0, 3.0), _growing, _of_noise),
    _pathology("step of the rate", "sigma", (0.3, 1.0, 3.0, 10.0, 100.0), _stepped),
    _pathology("a hole of NaN", "samples", (1.0, 10.0, 1000.0), _hole),
)
_OF_ANGLES: Final = tuple(
    Pathology(name=name, unit=unit, strengths=strengths, spoil=_of_angle(spoil))
    for name, unit, strengths, spoil in (
        ("angle in float32", "deg at the start", (0.1, 1.0, 10.0, 100.0, 1e4), _single_precision),
        ("angle of unsigned counts", "wraps", (1.0, 2.0, 5.0, 20.0, 100.0), _wrapping),
        ("step of the angle", "arcsec", (0.01, 0.1, 1.0, 10.0, 100.0), _stepping),
    )
)
_OF_PAIRS: Final = tuple(
    Pathology(name=name, unit=unit, strengths=strengths, spoil=spoil, pair=True)
    for name, unit, strengths, spoil in (
        (
            "a unit too large beside another",
            "factor",
            (180.0 / math.pi, 60.0, 100.0, 3600.0),
            _of_x(_in_another_unit),
        ),
        (
            "a unit too small beside another",
            "1/factor",
            (180.0 / math.pi, 60.0, 100.0, 3600.0),
            _of_x(lambda rate, factor, random: _in_another_unit(rate, 1.0 / factor, random)),
        ),
        ("a copy in part, one sample late", "correlation", (0.05, 0.1, 0.3, 0.6), _partial_copy),
        ("a copy, late", "samples", (1.0, 4.0, 16.0, 64.0, 256.0), _late_copy),
    )
)
_OF_ROWS: Final = (
    Pathology(name="rows lost", unit="share", strengths=_SHARES, spoil=_lost_rows),
    Pathology(
        name="a block of rows lost",
        unit="samples",
        strengths=(1.0, 10.0, 100.0, 1000.0),
        spoil=_lost_block,
    ),
    Pathology(
        name="a block twice", unit="share", strengths=(1e-3, 0.01, 0.1, 0.5), spoil=_block_twice
    ),
    Pathology(
        name="stamps jump ahead", unit="s", strengths=(0.01, 0.1, 1.0, 100.0), spoil=_stamps_jump
    ),
    Pathology(
        name="stamps jump back",
        unit="s",
        strengths=(0.01, 0.1, 1.0, 100.0),
        spoil=lambda sound, strength, random: _stamps_jump(sound, -strength, random),
    ),
)
_OF_ENCODERS: Final = tuple(
    Pathology(
        name=f"encoder {name}",
        unit=unit,
        strengths=strengths,
        spoil=_of_table(spoil),
        standing=False,
    )
    for name, unit, strengths, spoil in (
        ("jumps", "deg", (1e-4, 1e-3, 0.01, 0.1, 1.0, 10.0), _table_jumps),
        ("off for a sample", "deg", (1e-4, 1e-3, 0.01, 0.1, 1.0, 10.0), _table_spikes),
        ("held", "share", _SHARES, _table_held),
        ("stuck for half a second", "share", (0.01, 0.05, 0.2), _table_stuck),
        ("late", "samples", (1.0, 5.0, 20.0, 100.0), _table_late),
    )
)
PATHOLOGIES: Final[tuple[Pathology, ...]] = (
    *_OF_SAMPLES,
    *_OF_ANGLES,
    *_OF_PAIRS,
    *_OF_ROWS,
    *_OF_ENCODERS,
)
