"""The Allan family: gyro samples in, a stability curve with intervals out."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sagnac.recording import FloatArray, Kind

Estimator = Literal[
    "adev", "oadev", "mdev", "tdev", "hdev", "ohdev", "totdev", "mtotdev", "theo1", "theoh", "haar"
]


@dataclass(frozen=True, slots=True, kw_only=True)
class StabilityCurve:
    """Deviation against cluster time, with its interval and its settings.

    Attributes
    ----------
    tau
        (points,) cluster times, s.
    deviation
        (points,) in the unit of the values given, per second.
    terms
        (points,) number of squared terms averaged.
    edf
        (points,) equivalent degrees of freedom of the variance.
    low, high
        (points,) limits of `deviation` at `confidence`.
    noise_type
        (points,) power-law exponent of the rate noise at each point: 2 quantization
        (white angle), 1 flicker angle, 0 angle random walk (white rate), -1 bias
        instability (flicker rate), -2 rate random walk, -3, -4 (ramp-like).
    estimator, kind, sample_rate, confidence, samples
        The settings it was made with.
    notes
        What was noticed, gap terms left out among them.
    """

    tau: FloatArray
    deviation: FloatArray
    terms: NDArray[np.int64]
    edf: FloatArray
    low: FloatArray
    high: FloatArray
    noise_type: NDArray[np.int64]
    estimator: Estimator
    kind: Kind
    sample_rate: float
    confidence: float
    samples: int
    notes: tuple[str, ...] = ()
