"""A recording: gyro channels, the table encoder, sample times, and where they came from."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Kind = Literal["angle", "increment", "rate"]


class RecordingError(ValueError):
    """Something is wrong in the data: one line with the file, the channel and the remedy."""


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
    """Where a recording came from: path, SHA-256 of the file, format, span taken (s)."""

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
        (samples,) sample times in s, or None where sampling is uniform.
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


def angle_of(channel: Channel, sample_rate: float) -> FloatArray:
    """Accumulated angle of a channel, rad, shape (samples,).

    Increments and rates are summed after their mean is taken off and put back as a
    ramp, so that a large constant rate costs no precision in the noise.
    """
    if channel.kind == "angle":
        return channel.values
    step = channel.values if channel.kind == "increment" else channel.values / sample_rate
    mean = float(step.mean())
    return np.cumsum(step - mean) + mean * np.arange(1, step.size + 1)
