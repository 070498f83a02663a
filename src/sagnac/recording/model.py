"""A recording: gyro channels, the table encoder, sample times, and where they came from."""

import math
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from sagnac.arrays import FloatArray
from sagnac.errors import RecordingError

# An interval longer than this many nominal steps is a gap: an error. Recorders that stamp on
# arrival, on a clock of 1 ms, repeat a stamp now and then and follow it with one of two steps,
# and a busy host holds a few samples back (stamps up to 4.4 steps apart at 100 Hz are known
# from sound recordings); from more than four samples missing, the angle turned meanwhile is a
# guess. Shorter ones are a note.
GAP_STEPS: Final = 5.0


Kind = Literal["angle", "increment", "rate"]
MINIMUM_SAMPLES: Final = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class Channel:
    """One measured column.

    Attributes
    ----------
    name
        As the user calls it: ``x``, ``y``, ``z``, ``table``.
    kind
        What one sample is. ``angle``: accumulated angle at the sample time.
        ``increment``: angle turned since the sample before. ``rate``: mean rate over
        the sample interval.
    unit
        Unit the source stated, for the report; `values` are SI already.
    values
        (samples,), rad for ``angle`` and ``increment``, rad/s for ``rate``. Counters
        and 360 degree encoders are unwrapped.
    """

    name: str
    kind: Kind
    unit: str
    values: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Provenance:
    """Where a recording came from: path, SHA-256 of the file, format, span taken.

    The span is in s from the first sample of the file, as ``--slice`` takes it.
    """

    path: str
    sha256: str
    format: str
    span_s: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """Gyros and table encoder sampled together.

    Attributes
    ----------
    gyros
        One or more gyro channels, all of one length.
    sample_rate
        Nominal samples per second.
    times
        (samples,) sample times in s from the first sample, or None where sampling is
        uniform.
    table
        Table angle from the encoder, unwrapped (kind ``angle``), or None at rest.
    null_pulse
        (samples,) bool, true on the first sample at or after the null pulse, or None.
    provenance
        None for a recording that never was a file.
    notes
        Everything noticed while reading, in words.
    """

    gyros: tuple[Channel, ...]
    sample_rate: float
    times: FloatArray | None = None
    table: Channel | None = None
    null_pulse: NDArray[np.bool_] | None = None
    provenance: Provenance | None = None
    notes: tuple[str, ...] = ()

    @property
    def samples(self) -> int:
        """Number of samples."""
        return int(self.gyros[0].values.size)

    @property
    def duration(self) -> float:
        """Time covered, s: samples over sample rate, or the span of the time stamps."""
        if self.times is not None:
            return float(self.times[-1] - self.times[0]) + 1.0 / self.sample_rate
        return self.samples / self.sample_rate

    def gyro(self, name: str) -> Channel:
        """The gyro called `name`.

        Raises
        ------
        RecordingError
            If there is none; the message lists those there are.
        """
        for channel in self.gyros:
            if channel.name == name:
                return channel
        present = ", ".join(channel.name for channel in self.gyros)
        where = self.provenance.path if self.provenance else "recording"
        raise RecordingError(f"{where}: no gyro {name!r}; it has {present} (--gyros, --columns)")


def second_of(recording: Recording, index: int) -> float:
    """When sample `index` was taken, s from the first sample of the file."""
    provenance = recording.provenance
    offset = provenance.span_s[0] if provenance and provenance.span_s else 0.0
    if recording.times is not None and math.isfinite(recording.times[index]):
        return offset + float(recording.times[index])
    return offset + index / recording.sample_rate
