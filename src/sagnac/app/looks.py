"""A recording before anything is asked: as it is, its spectrum, its histogram, and what it shows.

Written beside it stands what gives a wrong unit, kind, rate or axis away: gravity, the Earth's
rate, the rate of the table, the stamps.
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.signal import periodogram

import sagnac
from sagnac.app import stated

FloatArray = NDArray[np.float64]

EARTH_RATE: Final = 15.041  # deg/h, against the stars
GRAVITY: Final = 9.80665  # m/s^2, the standard one

_PER_HOUR: Final = math.degrees(3600.0)
# Readings of a table at rest do not stray so far, rad.
_TURNED: Final = 0.01
# Segments of the spectrum, samples of one at most, and bins that are drawn.
_SEGMENTS: Final = 48
_SEGMENT: Final = 2**16
_BINS: Final = 400
# Samples that a histogram is of, about, and its bars.
_COUNTED: Final = 2**18
_BARS: Final = 96
_TIME: Final = re.compile(r"\b(?:at|from) (\d+(?:\.\d+)?) s\b(?: (?:on|to (\d+(?:\.\d+)?) s))?")


# ---- a series at any zoom ------------------------------------------------------------

# Samples in a block, whose lowest and highest values are kept.
BLOCK: Final = 64
# Samples that are worked on at once: a megabyte, which stays in the cache.
_AT_ONCE: Final = 2**17


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pyramid:
    """A series of which any stretch is drawn without going through all of its samples.

    Attributes
    ----------
    values
        (samples,) as they are.
    factor
        What a value is multiplied with.
    differenced
        Whether a sample stands for what the value grew by since the sample before; the first
        stands for what the second does.
    blocks
        (2, blocks) lowest and highest values of 64 samples each.
    mean, deviation
        Of all numbers, as they are drawn; NaN if there is none.
    """

    values: FloatArray
    factor: float
    differenced: bool
    blocks: FloatArray
    mean: float = math.nan
    deviation: float = math.nan

    @classmethod
    def of(cls, values: FloatArray, *, factor: float = 1.0, differenced: bool = False) -> "Pyramid":
        """The pyramid of a series.

        ValueError if there is no sample.
        """
        if values.ndim != 1 or not values.size:
            raise ValueError(f"values have shape {values.shape}; give one sample or more")
        bare = cls(values=values, factor=factor, differenced=differenced, blocks=np.empty((2, 0)))
        parts, sums, near = [], np.zeros(3), math.nan
        for start in range(0, values.size, _AT_ONCE):
            drawn = bare.samples(start, min(start + _AT_ONCE, values.size))
            parts.append(_extremes(drawn, drawn, BLOCK))
            finite = drawn[np.isfinite(drawn)]
            if finite.size and math.isnan(near):
                near = float(finite.mean())
            # About a value near the mean, so that no digits are lost in the squares.
            finite -= near
            # No product of the linear algebra, whose threads would wait for one another.
            sums += finite.size, finite.sum(), np.einsum("i,i", finite, finite)
        blocks, (count, total, squares) = np.concatenate(parts, axis=1), sums.tolist()
        if not count:
            return replace(bare, blocks=blocks)
        away = total / count
        deviation = math.sqrt(max(squares / count - away**2, 0.0))
        return replace(bare, blocks=blocks, mean=near + away, deviation=deviation)

    def times(self, size: float) -> "Pyramid":
        """The same in another unit."""
        scaled = ("factor", "blocks", "mean", "deviation")
        return replace(self, **{name: size * getattr(self, name) for name in scaled})

    def samples(self, start: int, stop: int) -> FloatArray:
        """The values of some samples, as they are drawn."""
        if not self.differenced:
            return self.factor * np.asarray(self.values[start:stop])
        steps = np.diff(self.values[max(start - 1, 0) : max(stop, 2)])
        if start == 0:
            steps = np.concatenate([steps[:1], steps])[:stop] if steps.size else np.zeros(1)
        return np.multiply(steps, self.factor, out=steps)

    def window(self, start: int, stop: int, most: int) -> tuple[NDArray[Any], ...]:
        """Lowest and highest values between two samples, in neighbouring blocks.

        Parameters
        ----------
        start, stop
            First sample and the one after the last; what lies outside the series is left out.
        most
            Blocks at most, about: blocks that lie only partly inside are given whole.

        Returns
        -------
        first
            (blocks,) number of the first sample of each.
        low, high
            (blocks,); NaN if a block holds no number.

        ValueError if no sample lies inside, or no block is asked for.
        """
        start, stop = max(start, 0), min(stop, self.values.size)
        if not start < stop or most < 1:
            raise ValueError(f"no sample of {self.values.size} lies in {start}:{stop}")
        size = math.ceil((stop - start) / most)
        if size < BLOCK:
            first = start // size * size
            values = self.samples(first, stop)
            low, high = _extremes(values, values, size)
        else:
            several, block = size // BLOCK, start // BLOCK
            size, first = several * BLOCK, block * BLOCK
            lows, highs = self.blocks[:, block : math.ceil(stop / BLOCK)]
            low, high = _extremes(lows, highs, several)
        return first + size * np.arange(low.size), low, high


def _extremes(low: FloatArray, high: FloatArray, size: int) -> FloatArray:
    """(2, blocks) lowest of `low` and highest of `high` in each block of `size`; NaN is none."""
    starts = np.arange(0, low.size, size)
    return np.stack([np.fmin.reduceat(low, starts), np.fmax.reduceat(high, starts)])


# ---- a recording ---------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DrawnChannel:
    """A channel as it is drawn.

    Attributes
    ----------
    name, unit
        Of the channel; the unit is empty if nobody has stated one.
    pyramid
        In that unit; of an angle or of increments the rate.
    of
        ``gyro``, ``accelerometer`` or ``table``.
    """

    name: str
    unit: str
    pyramid: Pyramid
    of: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Look:
    """A recording that was opened.

    Attributes
    ----------
    path
        Of the file.
    texts
        What was stated of it: option -> text.
    recording
        With numbers as they are written if too little is stated.
    lacking
        Inputs that are still to be stated: option -> guess; empty if nothing is missing.
    refusal
        Why it cannot be read as it is stated, so that numbers stand as written; empty if it can.
    shown
        What is drawn.
    stamp
        That of the file when it was read.
    """

    path: Path
    texts: stated.Texts
    recording: sagnac.Recording
    lacking: dict[str, str] = field(default_factory=dict)
    refusal: str = ""
    shown: tuple[DrawnChannel, ...] = ()
    stamp: tuple[int, int] | None = None


def stamp_of(path: Path) -> tuple[int, int] | None:
    """By which a file that was written over is known; None if it is not there."""
    found = path.stat() if path.exists() else None
    return found and (found.st_mtime_ns, found.st_size)


def look(path: Path, texts: stated.Texts) -> Look:
    """Open a recording.

    Parameters
    ----------
    path
        Of the file.
    texts
        What is stated: option -> text. If that is too little, numbers come as they are written.

    Raises
    ------
    sagnac.RecordingError
        If the file cannot be read at all.
    ValueError
        If a text is none of its option.
    """
    statement = sagnac.Statement(**stated.reads(texts, {}))
    lacking: dict[str, str] = {}
    refusal, stamp = "", stamp_of(path)
    try:
        recording = sagnac.read(path, statement, verify=False)
    except sagnac.RecordingError as error:
        # A column whose unit still reads UNIT, as the page suggests it, is not stated yet.
        lacking = {name: text for name, text in texts.items() if text.endswith(":UNIT")}
        told = {name: text for name, text in texts.items() if name not in lacking}
        lacking |= sagnac.missing(path, **stated.reads(told, {}))
        refusal = stated.line(error)
        if not lacking:
            raise
        recording = _as_written(path, texts, lacking, error)
    if not recording.samples:
        raise sagnac.RecordingError("holds no sample", path=str(path), remedy="check the file")
    made = Look(path=path, texts=texts, recording=recording, lacking=lacking, refusal=refusal)
    return replace(made, shown=_shown(recording, raw=bool(refusal)), stamp=stamp)


def _as_written(
    path: Path, texts: stated.Texts, lacking: dict[str, str], refusal: sagnac.RecordingError
) -> sagnac.Recording:
    """The numbers of a file of which too little is stated, one a second."""
    columns = lacking.get("columns", "")
    if "COLUMN" in columns:
        taken = {lacking.get(name, "").rpartition(":")[0] for name in ("time", "table")}
        names = [one for one in sagnac.columns(path) if not ({one} & taken or set(one) & set("=,"))]
        names.sort(key=lambda one: re.search("gyr|omega|rate", one, re.IGNORECASE) is None)
        columns = ",".join(f"{name}={name}" for name in names[:6])
    # What stands in for words that no file tells: numbers then come as they are written.
    for kind, unit in (("rate", "rad/s"), ("angle", "rad"), ("increment", "rad")):
        words = {"KIND": kind, "UNIT": unit, "HZ": "1", "SIZE": f"1{unit}"}
        given = dict(texts)
        for name, text in lacking.items():
            given[name] = re.sub(r"\b(KIND|UNIT|HZ|SIZE)\b", lambda one: words[one[0]], text)  # noqa: B023
        if columns:
            given["columns"] = columns
        for name, of in (("table", "deg"), ("time", "s")):
            if name in lacking:
                given[name] = lacking[name].replace("UNIT", of)
        try:
            return sagnac.read(path, verify=False, **stated.reads(given, {}))
        except (sagnac.RecordingError, ValueError):
            continue
    raise refusal


def _shown(recording: sagnac.Recording, *, raw: bool) -> tuple[DrawnChannel, ...]:
    in_si = []
    for one in (*recording.gyros, *recording.accelerometers, recording.table):
        if one is not None:
            factor = 1.0 if one.kind == "rate" else recording.sample_rate
            pyramid = Pyramid.of(one.values, factor=factor, differenced=one.kind == "angle")
            of = "table" if one is recording.table else one.sensor
            in_si.append(DrawnChannel(name=one.name, unit="", pyramid=pyramid, of=of))
    turns = [one.pyramid for one in in_si if one.of != "accelerometer"]
    # Rates beyond this, deg/h, are shown in deg/s.
    fast = any(max(abs(one.mean), one.deviation) * _PER_HOUR > 1800.0 for one in turns)
    of_rate = ("°/s", math.degrees(1.0)) if fast else ("°/h", _PER_HOUR)
    units = {"gyro": of_rate, "accelerometer": ("m/s²", 1.0), "table": of_rate}
    if raw:
        units |= dict.fromkeys(("gyro", "accelerometer"), ("", 1.0))

    def in_unit(one: DrawnChannel) -> DrawnChannel:
        unit, size = units[one.of]
        return replace(one, unit=unit, pyramid=one.pyramid.times(size))

    return tuple(map(in_unit, in_si))


def facts(look: Look) -> dict[str, Any]:
    """Facts beside a recording, as plain data; lines of it say what gives itself away."""
    recording, channels = look.recording, []
    for one in look.shown:
        moments = {name: _plain(getattr(one.pyramid, name)) for name in ("mean", "deviation")}
        channels.append({**_name(one), **moments})
    return {
        "path": str(look.path),
        "name": look.path.name,
        "samples": recording.samples,
        "rate": recording.sample_rate,
        "duration": recording.duration,
        "raw": bool(look.refusal),
        "refusal": look.refusal,
        "lacking": look.lacking,
        "texts": dict(look.texts),
        "columns": list(sagnac.columns(look.path)),
        "format": recording.provenance.format if recording.provenance else "",
        "channels": channels,
        "beside": [] if look.refusal else list(_beside(look)),
        "notes": [str(note) for note in recording.notes],
    }


def _name(one: DrawnChannel) -> dict[str, str]:
    return {"name": one.name, "unit": one.unit, "of": one.of}


def _plain(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _row(what: str, found: str, wanted: str = "", agrees: bool | None = None) -> dict[str, str]:
    verdict = "" if agrees is None else "agrees" if agrees else "differs"
    return {"what": what, "found": found, "wanted": wanted, "verdict": verdict}


def _beside(look: Look) -> Iterator[dict[str, str]]:
    """Lines beside the trace: what is measured, what physics wants, and whether they agree."""
    readings = np.zeros(1) if look.recording.table is None else look.recording.table.values
    angle = readings[:: max(1, readings.size // 4096)]
    turning = bool(np.ptp(angle) > _TURNED)
    swings = turning and bool(abs(angle[-1] - angle[0]) < 0.5 * np.ptp(angle))

    def in_hours(one: DrawnChannel) -> float:
        size = math.hypot(one.pyramid.mean, one.pyramid.deviation) if swings else one.pyramid.mean
        return size * (3600.0 if one.unit == "°/s" else 1.0)

    gyros = [one for one in look.shown if one.of == "gyro"]
    forces = [one for one in look.shown if one.of == "accelerometer"]
    table = next((one for one in look.shown if one.of == "table"), None)
    # Two gyros may not sense all of the Earth's rate; four or more sense parts of it twice.
    if len(gyros) in (2, 3) and not turning:
        size = math.hypot(*(in_hours(one) for one in gyros))
        away = f"{size / EARTH_RATE:.3g} times" if math.isfinite(size) else "no number"
        away += "; more is a bias, a motion or another unit" * bool(size > 1.1 * EARTH_RATE)
        agrees = abs(size / EARTH_RATE - 1.0) < 0.1 if len(gyros) == 3 else size < 1.1 * EARTH_RATE
        wanted = f"{'at most ' * (len(gyros) == 2)}Earth rate {EARTH_RATE:.2f} °/h ({away})"
        names = ", ".join(one.name for one in gyros)
        yield _row(f"mean rate of {names} together", f"{size:.4g} °/h", wanted, agrees)
    if table is not None and turning:
        yield _row("table rate" + swings * ", rms", f"{in_hours(table) / 3600.0:.5g} °/s")
        for one in gyros:
            share, what = in_hours(one) / in_hours(table), f"{one.name} over table rate"
            yield _row(what, f"{share:.4g}", "at most 1", abs(share) < 1.02)
    if len(forces) > 1:
        size = math.hypot(*(one.pyramid.mean for one in forces))
        what = f"mean of {', '.join(one.name for one in forces)} together"
        within = abs(size / GRAVITY - 1.0) < 0.05 if len(forces) == 3 else None
        yield _row(what, f"{size:.4g} m/s²", f"gravity {GRAVITY:.2f} m/s²", within)
    yield _stamps(look.recording)


def _stamps(recording: sagnac.Recording) -> dict[str, str]:
    steps = np.zeros(0) if recording.times is None else np.diff(recording.times)
    steps = steps[np.isfinite(steps)]
    if not steps.size:
        return _row("time stamps", "uniform, or none")
    middle, longest = float(np.median(steps)), float(steps.max())
    gaps = int(np.count_nonzero(steps > 1.5 * middle))
    found = f"median step {1e3 * middle:.5g} ms, longest {1e3 * longest:.5g} ms"
    sound = not gaps and float(steps.min()) > 0.0
    return _row("time stamps", found, f"{gaps} longer than 1.5 steps", sound)


def window(look: Look, start: float, stop: float, pixels: int) -> list[dict[str, Any]]:
    """Lowest and highest values of every channel between two times, s from the first sample.

    ValueError if the span or the number of pixels makes no sense.
    """
    if not (math.isfinite(start) and math.isfinite(stop) and 1 <= pixels <= 10_000):
        raise ValueError(f"span {start}:{stop} on {pixels} pixels; give seconds and pixels")
    rate = look.recording.sample_rate
    first = math.floor(max(start, 0.0) * rate)
    last = math.ceil(min(stop, look.recording.duration) * rate) + 1
    drawn = []
    for one in look.shown:
        begin, low, high = one.pyramid.window(first, last, pixels)
        ends = {"low": numbers(low), "high": numbers(high)}
        drawn.append({**_name(one), "time": numbers(begin / rate), **ends})
    return drawn


def spectra_of(look: Look) -> dict[str, Any]:
    """Root density of each sensor as it stands, and its histogram."""
    sensors, rate = [one for one in look.shown if one.of != "table"], look.recording.sample_rate
    spectra = [{**_name(one), **_spectrum(one.pyramid, rate)} for one in sensors]
    histograms = [{**_name(one), **_histogram(one.pyramid)} for one in sensors]
    return {"spectra": spectra, "histograms": histograms}


def _spectrum(pyramid: Pyramid, rate: float) -> dict[str, Any]:
    """Spectrum by Hann segments spread over the record: lowest and highest of each drawn bin."""
    size = pyramid.values.size
    length = min(_SEGMENT, 2 ** max(int(math.log2(max(size, 2))), 1))
    starts = np.unique(np.linspace(0, size - length, _SEGMENTS).astype(np.int64))
    starts = starts[: max(1, 2 * size // length)]
    parts = np.array([pyramid.samples(start, start + length) for start in starts.tolist()])
    parts = parts[np.isfinite(parts).all(axis=1)]
    # The two lowest bins hold what the window spreads of the mean; the last stands for one side
    # alone, so that white noise would end in a step.
    if not parts.size or length < 8:
        return {"frequency": [], "low": [], "high": []}
    frequency, densities = periodogram(parts, rate, window=np.hanning(length), detrend="constant")
    frequency, density = frequency[2:-1], densities.mean(axis=0)[2:-1]
    first = np.searchsorted(frequency, np.geomspace(frequency[0], frequency[-1], _BINS))
    first = np.unique(first)
    low, high = (one.reduceat(np.sqrt(density), first) for one in (np.minimum, np.maximum))
    return {"frequency": numbers(frequency[first]), "low": numbers(low), "high": numbers(high)}


def _histogram(pyramid: Pyramid) -> dict[str, Any]:
    """Counts of a channel and the edges of the bars."""
    size = pyramid.values.size
    starts = np.linspace(0, size - 4096, _COUNTED // 4096).astype(np.int64).tolist()
    parts = [(0, size)] if size <= _COUNTED else [(start, start + 4096) for start in starts]
    values = np.concatenate([pyramid.samples(*part) for part in parts])
    values = values[np.isfinite(values)]
    if not values.size:
        return {"count": [], "edge": [0.0]}
    counts, edges = np.histogram(values, bins=_bars(values))
    return {"count": counts.tolist(), "edge": numbers(edges)}


def _bars(values: FloatArray) -> FloatArray:
    """Edges of bars of a whole number of readout steps, if there are few steps."""
    low, high = float(values.min()), float(values.max())
    steps = np.diff(np.unique(values))
    step = float(steps[steps > 1e-9 * (high - low)].min(initial=np.inf))
    if (high - low) / step > 20.0 * _BARS or high == low:
        return np.linspace(low, high if high > low else low + 1.0, _BARS + 1)
    width = step * max(1, math.ceil((high - low) / step / _BARS))
    edges = width * np.arange(math.ceil((high - low + step) / width) + 1)
    return np.asarray(low - 0.5 * step + edges)


def findings(look: Look) -> list[dict[str, Any]]:
    """Findings of `sagnac.check`, each with the spans that it names, s; none of bare numbers."""
    return [] if look.refusal else [noted(note) for note in sagnac.check(look.recording)]


def noted(note: sagnac.Note) -> dict[str, Any]:
    """A note as plain data; `spans` are the times that its text names, s from the first sample."""
    spans = [[float(found[1]), float(found[2] or found[1])] for found in _TIME.finditer(note.text)]
    stated = {"level": note.level, "channel": note.channel, "name": note.name}
    return {**stated, "text": str(note), "spans": spans}


def numbers(values: NDArray[Any]) -> list[float | None]:
    """Numbers as JSON takes them, seven digits, None for those that are not finite."""
    return [float(f"{one:.7g}") if math.isfinite(one) else None for one in values.tolist()]
