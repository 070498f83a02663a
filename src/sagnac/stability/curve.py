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
from collections.abc import Mapping
from dataclasses import dataclass, replace
from html import escape
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sagnac.arrays import FloatArray
from sagnac.dataframes import pandas_for
from sagnac.errors import Note, quoted
from sagnac.recording.model import Kind
from sagnac.stability.accumulate import accumulated_track
from sagnac.stability.clusters import cluster_sizes
from sagnac.stability.degrees_of_freedom import chi_squared_limits
from sagnac.stability.estimators import ESTIMATORS, properties_of
from sagnac.stability.names import Estimator, Gaps, check_choice
from sagnac.stability.noise_type import NoiseTypes, check_noise_type, identified_noise_types
from sagnac.stability.sums import Points

# Rows that a notebook shows of a curve.
_SHOWN_POINTS: Final = 12
_ARRAYS: Final[Mapping[str, type]] = {
    "tau": np.float64,
    "deviation": np.float64,
    "terms": np.int64,
    "edf": np.float64,
    "low": np.float64,
    "high": np.float64,
    "noise_type": np.int64,
}


@dataclass(frozen=True, slots=True, kw_only=True, repr=False, eq=False)
class StabilityCurve:
    """Deviation against cluster time, with its interval and its settings.

    Attributes
    ----------
    tau
        (points,) cluster times, s.
    deviation
        (points,) in the unit of the values given, per second (the unit itself for ``tdev``).
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
    gyros_differenced
        2 if the values were the difference of two gyros, so that the curve lies a factor
        sqrt(2) above that of one (see `per_gyro`); 1 otherwise.

    Raises
    ------
    ValueError
        If an array differs in length from `tau`, or a setting is none of its choices.

    Examples
    --------
    >>> import numpy as np
    >>> from sagnac.stability.curve import stability_curve
    >>> rate = np.random.default_rng(1).standard_normal(1000)
    >>> curve = stability_curve(rate, kind="rate", sample_rate=10.0, taus=[0.1, 1.0, 10.0])
    >>> curve
    <StabilityCurve oadev, 3 points, tau 0.1 s to 10 s, 1000 samples of rate at 10 Hz>
    >>> curve.deviation.round(3)
    array([0.995, 0.299, 0.11 ])
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
    notes: tuple[Note, ...] = ()
    gyros_differenced: int = 1

    def __post_init__(self) -> None:
        for name, kind in _ARRAYS.items():
            array: NDArray[Any] = np.array(getattr(self, name), dtype=kind)
            if array.ndim != 1 or array.shape != np.shape(self.tau):
                raise ValueError(
                    f"{name} has shape {array.shape}; give one value for each tau, "
                    f"shape {np.shape(self.tau)}"
                )
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        if not np.all(self.tau > 0.0):
            raise ValueError("tau holds a value that is not above zero; give cluster times in s")
        check_choice("estimator", self.estimator, Estimator)
        check_choice("kind", self.kind, Kind)
        _check_sample_rate(self.sample_rate)
        _check_confidence(self.confidence)
        if self.gyros_differenced not in (1, 2):
            raise ValueError(
                f"gyros_differenced is {quoted(self.gyros_differenced)}; "
                "use 1 (a gyro) or 2 (a pair)"
            )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, StabilityCurve):
            return NotImplemented
        return all(
            np.array_equal(one, two, equal_nan=True)
            if isinstance(one, np.ndarray)
            else bool(one == two)
            for one, two in (
                (getattr(self, name), getattr(other, name)) for name in self.__dataclass_fields__
            )
        )

    __hash__ = None  # type: ignore[assignment]  # arrays have none

    def __repr__(self) -> str:
        taus = f", tau {self.tau[0]:.4g} s to {self.tau[-1]:.4g} s" if self.tau.size else ""
        pair = ", difference of two gyros" if self.gyros_differenced == 2 else ""
        return (
            f"<StabilityCurve {self.estimator}, {self.tau.size} points{taus}, "
            f"{self.samples} samples of {self.kind} at {self.sample_rate:g} Hz{pair}>"
        )

    def _repr_html_(self) -> str:
        chosen = np.unique(
            np.linspace(0, self.tau.size - 1, min(self.tau.size, _SHOWN_POINTS)).round().astype(int)
        )
        rows = "".join(
            f"<tr><td>{self.tau[i]:.4g}</td><td>{self.deviation[i]:.4g}</td>"
            f"<td>{self.low[i]:.4g}</td><td>{self.high[i]:.4g}</td>"
            f"<td>{self.edf[i]:.3g}</td><td>{self.noise_type[i]}</td></tr>"
            for i in chosen
        )
        return (
            f"<table><caption>{escape(repr(self)[1:-1])}</caption>"
            "<tr><th>tau, s</th><th>deviation</th><th>low</th><th>high</th>"
            f"<th>edf</th><th>noise type</th></tr>{rows}</table>"
        )

    def per_gyro(self) -> "StabilityCurve":
        """The curve of one gyro: that of a pair over sqrt(2), any other as it is.

        Independent gyros add in square, so a difference of two has twice their mean variance.
        """
        if self.gyros_differenced == 1:
            return self
        root = math.sqrt(self.gyros_differenced)
        return replace(
            self,
            deviation=self.deviation / root,
            low=self.low / root,
            high=self.high / root,
            gyros_differenced=1,
        )

    def to_frame(self) -> Any:
        """One row a point: tau, deviation, low, high, edf, terms and noise type.

        The settings are in its ``attrs``.

        Raises
        ------
        MissingExtra
            If pandas is not installed.
        """
        pandas = pandas_for("a curve as a data frame")
        names = ("tau", "deviation", "low", "high", "edf", "terms", "noise_type")
        frame = pandas.DataFrame({name: getattr(self, name) for name in names})
        frame.attrs.update(self._settings())
        return frame

    def _settings(self) -> dict[str, Any]:
        names = ("estimator", "kind", "sample_rate", "confidence", "samples", "gyros_differenced")
        return {name: getattr(self, name) for name in names}


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
        Probability content of [low, high], between 0 and 1.
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

    Examples
    --------
    White rate noise of 0.02 deg/s/sqrt(Hz), sampled at 50 Hz: the deviation at 1 s is 0.02 deg/s.

    >>> import numpy as np
    >>> from sagnac.stability.curve import stability_curve
    >>> rate = 0.02 * np.sqrt(50.0) * np.random.default_rng(2).standard_normal(20_000)
    >>> curve = stability_curve(rate, kind="rate", sample_rate=50.0, taus=[1.0], confidence=0.95)
    >>> bool(curve.low[0] < 0.02 < curve.high[0])
    True
    >>> curve.noise_type
    array([0])
    """
    check_choice("kind", kind, Kind)
    row = properties_of(estimator)
    check_choice("gaps", gaps, Gaps)
    _check_sample_rate(sample_rate)
    _check_confidence(confidence)
    if noise_type is not None:
        check_noise_type(noise_type, row)
    samples = np.asarray(values, dtype=np.float64)
    if samples.ndim != 1:
        raise ValueError(f"values has shape {samples.shape}; give one channel, shape (samples,)")
    only_whole = estimator if row.whole_record_only else None
    track = accumulated_track(samples, kind, sample_rate, gaps, only_whole=only_whole)
    angles = track.angle.size
    clusters = cluster_sizes(taus, angles, sample_rate, row)
    points = row.sums(track, clusters.sizes)
    tau = points.tau_samples / sample_rate
    scale = 1.0 if kind == "rate" else sample_rate
    deviation = row.finished(np.sqrt(points.variance) * scale, tau)
    if noise_type is None:
        noise = identified_noise_types(track, points.clusters, row)
    else:
        noise = NoiseTypes(exponents=np.full(tau.size, noise_type, dtype=np.int64))
    edf = _degrees_of_freedom(points, noise, angles)
    low, high = chi_squared_limits(deviation, edf, confidence)
    missing = Note(text=f"{track.missing} of {samples.size} samples are missing")
    return StabilityCurve(
        tau=tau,
        deviation=deviation,
        terms=points.terms,
        edf=edf,
        low=low,
        high=high,
        noise_type=noise.exponents,
        estimator=estimator,
        kind=kind,
        sample_rate=float(sample_rate),
        confidence=float(confidence),
        samples=int(samples.size),
        notes=(
            *((missing,) if track.missing else ()),
            *clusters.notes,
            *points.notes,
            *noise.notes,
        ),
    )


def _degrees_of_freedom(points: Points, noise: NoiseTypes, angles: int) -> FloatArray:
    """(points,) equivalent degrees of freedom, by the rule and the noise type of each point."""
    return np.array(
        [
            ESTIMATORS[rule].freedom(int(alpha), int(cluster), angles, int(windows))
            for rule, alpha, cluster, windows in zip(
                points.rules, noise.exponents, points.clusters, points.windows, strict=True
            )
        ]
    )


def _check_sample_rate(sample_rate: float) -> None:
    if not (math.isfinite(sample_rate) and sample_rate > 0.0):
        raise ValueError(f"sample_rate {sample_rate!r} is not a positive number of hertz")


def _check_confidence(confidence: float) -> None:
    if not 0.0 < confidence < 1.0:
        raise ValueError(f"confidence {confidence!r} is not between 0 and 1; give 0.95 for 95 %")
