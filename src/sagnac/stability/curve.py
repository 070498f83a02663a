"""The Allan family: gyro samples in, a stability curve with intervals out.

Notation
--------
x
    Accumulated angle (the phase of time and frequency metrology), N samples tau0 apart. N
    rates or increments make N + 1 angles, the first of them zero.
m
    Cluster in samples; tau = m tau0.
alpha
    Power law of the rate noise, S(f) ~ f^alpha, from 2 (white angle, quantization) over
    0 (angle random walk) and -2 (rate random walk) to -4.

References
----------
SP1065
    W. J. Riley, Handbook of Frequency Stability Analysis, NIST SP 1065, 2008: every
    definition, and the degrees of freedom of the total and Theo1 families.
Greenhall and Riley
    Uncertainty of stability variances based on finite differences, PTTI 2003.
Riley and Greenhall
    Power law noise identification using the lag 1 autocorrelation, EFTF 2004.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import gammaincinv

from sagnac.arrays import FloatArray
from sagnac.recording.model import Kind
from sagnac.stability.accumulate import accumulated_track
from sagnac.stability.clusters import cluster_sizes
from sagnac.stability.degrees_of_freedom import curve_degrees_of_freedom
from sagnac.stability.estimators import DIFFERENCES, Estimator, Gaps, check_choice
from sagnac.stability.noise_type import check_noise_type, identified_noise_types
from sagnac.stability.sums import POINTS


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


def stability_curve(
    values: ArrayLike,
    *,
    kind: Kind,
    sample_rate: float,
    estimator: Estimator = "oadev",
    taus: ArrayLike | None = None,
    confidence: float = 0.683,
    gaps: Gaps = "reject",
    noise_type: int | None = None,
) -> StabilityCurve:
    """Stability of a gyro against cluster time, with chi-squared intervals.

    The constant rate is taken out before anything is summed or differenced: the mean of
    rates and increments, the end-to-end ramp of angles. No estimator here responds to it,
    and a table turns 1e9 arcsec in two hours, which would cost the digits of the noise.

    Parameters
    ----------
    values
        (samples,) in any unit; NaN marks a missing sample.
    kind
        ``rate`` (unit/s), ``increment`` (unit turned over each sample interval) or ``angle``
        (unit, accumulated). There is no default.
    sample_rate
        Samples per second.
    estimator
        ``adev``, ``oadev`` Allan, plain and overlapping; ``mdev`` modified; ``tdev``
        tau mdev / sqrt(3); ``hdev``, ``ohdev`` Hadamard; ``totdev``, ``mtotdev`` total and
        modified total; ``theo1``; ``theoh``, overlapping Allan to a fifth of the record and
        bias-removed Theo1 beyond; ``haar``, the Haar wavelet standard deviation, which is
        OADEV / sqrt(2). The biases of ``totdev``, ``mtotdev`` and ``theo1`` are left in.
    taus
        Cluster times wanted, s, each rounded to a whole number of samples. For ``theo1``
        they are the spans m tau0 of its definition, as published tables list them; the tau
        of the curve is then its effective 0.75 m tau0. None: 20 to the decade, up to the
        longest that the record allows (for ``haar`` every power of two).
    confidence
        Probability content of [low, high].
    gaps
        ``reject``: a missing sample is an error. ``omit``: every term that touches one is
        left out, counted and noted; a missing rate or increment breaks the accumulated
        angle, so each term that spans it goes.
    noise_type
        Power law of the rate noise for the intervals, -4 to 2; None identifies it at each
        tau.

    Returns
    -------
    StabilityCurve
        `deviation` in the unit per second (the unit itself for ``tdev``).

    Raises
    ------
    RecordingError
        If a value is infinite, or missing and `gaps` is ``reject``.
    ValueError
        If an argument cannot be used, or the record is too short.
    """
    check_choice("kind", kind, Kind)
    check_choice("estimator", estimator, Estimator)
    check_choice("gaps", gaps, Gaps)
    if not (math.isfinite(sample_rate) and sample_rate > 0.0):
        raise ValueError(f"sample_rate {sample_rate!r} is not a positive number of hertz")
    if not 0.0 < confidence < 1.0:
        raise ValueError(f"confidence {confidence!r} is not between 0 and 1; give 0.95 for 95 %")
    if noise_type is not None:
        check_noise_type(noise_type, estimator)
    samples = np.asarray(values, dtype=np.float64)
    if samples.ndim != 1:
        raise ValueError(f"values has shape {samples.shape}; give one channel, shape (samples,)")
    track = accumulated_track(samples, kind, sample_rate, gaps, estimator)
    notes: list[str] = []
    if track.missing:
        notes.append(f"{track.missing} of {samples.size} samples are missing")
    clusters = cluster_sizes(taus, track.angle.size, sample_rate, estimator, notes)
    scale = 1.0 if kind == "rate" else sample_rate

    points = POINTS[estimator](track, clusters, notes)
    tau = points.tau_samples / sample_rate
    deviation = np.sqrt(points.variance) * scale
    if estimator == "tdev":
        deviation = deviation * tau / math.sqrt(3.0)
    noise = (
        identified_noise_types(track, points.clusters, DIFFERENCES[estimator], notes)
        if noise_type is None
        else np.full(tau.size, noise_type, dtype=np.int64)
    )
    edf = np.array(
        [
            curve_degrees_of_freedom(rule, int(alpha), int(cluster), track.angle.size, int(terms))
            for rule, alpha, cluster, terms in zip(
                points.estimators, noise, points.clusters, points.windows, strict=True
            )
        ]
    )
    low, high = _limits(deviation, edf, confidence)
    return StabilityCurve(
        tau=tau,
        deviation=deviation,
        terms=points.terms,
        edf=edf,
        low=low,
        high=high,
        noise_type=noise,
        estimator=estimator,
        kind=kind,
        sample_rate=float(sample_rate),
        confidence=float(confidence),
        samples=int(samples.size),
        notes=tuple(notes),
    )


def _limits(
    deviation: FloatArray, edf: FloatArray, confidence: float
) -> tuple[FloatArray, FloatArray]:
    """Limits of the deviation: edf s^2 / sigma^2 is chi-squared with edf degrees."""
    tail = 0.5 * (1.0 - confidence)
    upper = 2.0 * gammaincinv(0.5 * edf, 1.0 - tail)
    lower = 2.0 * gammaincinv(0.5 * edf, tail)
    return deviation * np.sqrt(edf / upper), deviation * np.sqrt(edf / lower)
