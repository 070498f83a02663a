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

Every cluster time
------------------
The overlapping Allan deviation at every cluster time of a record, exactly.

The sum of squared second differences over all starts,

    V(m) = sum over k of (x[k + 2m] - 2 x[k + m] + x[k])^2,    k = 0 .. M - 1 - 2m,

takes M terms for one cluster and M^2 / 4 for all. Written out, it is three sums of squares, the
autocorrelation R(2m), and two sums of x[k] x[k + m] that lack m products at one end of the
record. R is one transform. The missing products are those of j < m: a triangle, cut into squares of
halving size, each of them a short correlation. So the whole takes O(M log^2 M).

The angle of a random walk of the rate is large beside its differences over a small cluster, and
the expansion would lose them to rounding. V(m) does not change if a straight line is taken from
x; so clusters of like size are summed in stretches of eight of the longest, each without its
own line, and what two stretches share is subtracted.

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

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import Any, Final

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike, NDArray
from scipy import fft
from scipy.special import gammaincinv

from sagnac.core.arrays import FloatArray, pandas_for
from sagnac.core.errors import Note, refusal, require_choice, require_confidence, require_shape
from sagnac.recording.channel import Compared, Kind, is_constant_rate, require_rate, squarable
from sagnac.stability import Estimator, Gaps
from sagnac.stability.estimators import ESTIMATORS, properties_of
from sagnac.stability.noise_type import check_noise_type, cluster_sizes, identified_noise_types
from sagnac.stability.sums import accumulated_track, overlapping_sums, whole_track

# ---- every cluster -----------------------------------------------------------------

# Clusters up to here are summed term by term, which is as fast.
_DIRECT: Final = 32
# Side of the smallest rectangle that is worth a transform.
_SMALL: Final = 32


def deviation_at_every_tau(
    values: ArrayLike, *, kind: Kind, sample_rate: float
) -> tuple[FloatArray, FloatArray]:
    """Overlapping Allan deviation at all of the N/2 cluster times of a record.

    Parameters
    ----------
    values
        (samples,) in any unit, none missing.
    kind, sample_rate
        As in `stability_curve`.

    Returns
    -------
    tuple[FloatArray, FloatArray]
        (clusters,) cluster times, s, and deviations: those of `stability_curve` for each of
        these times, in O(N log^2 N).

    Raises
    ------
    RecordingError
        If a value is missing or infinite.
    ValueError
        If there are too few, or an argument makes no sense.

    Examples
    --------
    >>> import numpy as np
    >>> from sagnac.stability.curve import deviation_at_every_tau
    >>> rate = np.random.default_rng(1).standard_normal(10_000)
    >>> tau, deviation = deviation_at_every_tau(rate, kind="rate", sample_rate=100.0)
    >>> tau.size, bool(abs(deviation[0] - 1.0) < 0.05)
    (5000, True)
    """
    samples = squarable(values)
    require_choice("kind", kind, Kind)
    require_rate(sample_rate)
    angle = np.asarray(accumulated_track(samples, kind, sample_rate, "reject", None).angle)
    cluster = np.arange(1, (angle.size - 1) // 2 + 1)
    variance = _sums_of_all_clusters(angle) / (2.0 * cluster**2 * (angle.size - 2.0 * cluster))
    return cluster / sample_rate, (1.0 if kind == "rate" else sample_rate) * np.sqrt(variance)


def _sums_of_all_clusters(angle: FloatArray) -> FloatArray:
    """((angles - 1) // 2,) V(m) from m = 1 on."""
    longest = (angle.size - 1) // 2
    direct = np.arange(1, longest + 1)
    # Sums over few starts may be small by chance.
    direct = direct[(direct <= _DIRECT) | (angle.size - 2 * direct <= 1024)]
    sums = np.empty(longest)
    while longest > _DIRECT:
        # The longest cluster of a set is six times its shortest, and a stretch has starts for six
        # of the longest: (6 * 8)^3 roundings of a rate random walk are 1e-10 of its variance.
        shorter = max(longest // 6, _DIRECT)
        sums[shorter:longest] = _sums_up_to(angle, longest)[shorter:]
        longest = shorter
    sums[direct - 1], _ = overlapping_sums(whole_track(angle), direct, 2)
    return sums


def _sums_up_to(angle: FloatArray, longest: int) -> FloatArray:
    """(longest,) V(m), over stretches that are long beside the longest cluster."""
    step, shared = 6 * longest, 2 * longest
    # The last stretch, which takes the rest of the record, is at least as long as what is shared.
    stretches = max((angle.size - shared) // step, 0)
    sums = _sums_in_rows(angle[None, stretches * step :], longest)
    if stretches:
        # About a million angles are transformed at a time.
        at_once = max(2**20 // (step + shared), 1)
        long = sliding_window_view(angle, step + shared)[::step][:stretches]
        short = sliding_window_view(angle, shared)[step::step][:stretches]
        for first in range(0, stretches, at_once):
            sums += _sums_in_rows(long[first : first + at_once], longest)
            sums -= _sums_in_rows(short[first : first + at_once], longest)
    return sums


def _sums_in_rows(rows: FloatArray, longest: int) -> FloatArray:
    """(longest,) V(m), added over the rows, (rows, angles), each a record of its own."""
    length = rows.shape[1]
    place = np.arange(length) - 0.5 * (length - 1)
    slopes = rows @ place / (place @ place)
    rows = rows - rows.mean(axis=1, keepdims=True) - slopes[:, None] * place
    m = np.arange(1, longest + 1)
    squares = np.concatenate([[0.0], np.cumsum((rows**2).sum(axis=0))])
    ends = squares[length] - squares[2 * m] + squares[length - 2 * m]
    middle = squares[length - m] - squares[m]
    # Sums of x[k] x[k + lag] over each row.
    size = fft.next_fast_len(length + 2 * longest, real=True)
    correlation = fft.irfft((np.abs(fft.rfft(rows, size, axis=1)) ** 2).sum(axis=0), size)
    neighbours = 2.0 * correlation[m] - _triangle(rows, longest) - _triangle(rows[:, ::-1], longest)
    return np.asarray(ends + 4.0 * middle + 2.0 * correlation[2 * m] - 4.0 * neighbours)


def _triangle(rows: FloatArray, longest: int) -> FloatArray:
    """(longest,) sums over j < m of x[j] x[j + m], m from 1 on, added over the rows.

    Blocks of m and j, [b, b + size) of both, are halved: the upper half of the m takes the whole
    lower half of the j, and what is left are two blocks of half the size.
    """
    side = _SMALL * 2 ** max((-(-longest // _SMALL) - 1).bit_length(), 0)
    head = np.zeros((rows.shape[0], 2 * side))
    head[:, : min(2 * longest, rows.shape[1])] = rows[:, : 2 * longest]
    sums, size = np.zeros(side), side
    while size > _SMALL:
        half, count = size // 2, side // size
        first = head[:, :side].reshape(-1, count, size)[:, :, :half]
        second = head.reshape(-1, count, 2 * size)[:, :, half + 1 : half + size]
        spectra = np.conj(fft.rfft(first, size)), fft.rfft(second, size)
        products = fft.irfft(np.einsum("rcf,rcf->cf", *spectra), size)
        sums.reshape(count, size)[:, half:] += products[:, :half]
        size = half
    first = head[:, :side].reshape(-1, side // size, size)
    second = head.reshape(-1, side // size, 2 * size)
    for m in range(1, size + 1):
        products = np.einsum("rca,rca->c", first[:, :, :m], second[:, :, m : 2 * m])
        sums[m - 1 :: size] += products
    return sums[:longest]


# ---- curve -------------------------------------------------------------------------

_COLUMNS: Final = ("tau", "deviation", "low", "high", "edf", "terms", "noise_type")


@dataclass(frozen=True, slots=True, kw_only=True, repr=False, eq=False)
class StabilityCurve(Compared):
    """Deviation against cluster time, with its interval and its settings.

    Attributes
    ----------
    tau
        (points,) cluster times, s.
    deviation
        (points,) of rates in their own unit, of angles and increments in theirs per second; of
        ``tdev`` times s.
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

    def __post_init__(self) -> None:
        for name in _COLUMNS:
            kind = np.int64 if name in {"terms", "noise_type"} else np.float64
            array: NDArray[Any] = np.array(getattr(self, name), dtype=kind)
            require_shape(name, array.shape, (np.size(self.tau),))
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        if not np.all(self.tau > 0.0):
            raise refusal("tau", "holds a value that is not above zero; give cluster times in s")
        require_choice("estimator", self.estimator, Estimator)
        require_choice("kind", self.kind, Kind)
        require_rate(self.sample_rate)
        require_confidence(self.confidence)

    def __repr__(self) -> str:
        taus = f", tau {self.tau[0]:.4g} s to {self.tau[-1]:.4g} s" if self.tau.size else ""
        samples = f"{self.samples} samples of {self.kind} at {self.sample_rate:g} Hz"
        return f"<StabilityCurve {self.estimator}, {self.tau.size} points{taus}, {samples}>"

    def _repr_html_(self) -> str:
        some = np.linspace(0, self.tau.size - 1, min(self.tau.size, 12))
        rows = "".join(
            f"<tr><td>{self.tau[i]:.4g}</td><td>{self.deviation[i]:.4g}</td>"
            f"<td>{self.low[i]:.4g}</td><td>{self.high[i]:.4g}</td>"
            f"<td>{self.edf[i]:.3g}</td><td>{self.noise_type[i]}</td></tr>"
            for i in np.unique(some.round().astype(int))
        )
        return (
            f"<table><caption>{escape(repr(self)[1:-1])}</caption>"
            "<tr><th>tau, s</th><th>deviation</th><th>low</th><th>high</th>"
            f"<th>edf</th><th>noise type</th></tr>{rows}</table>"
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
        settings = ("estimator", "kind", "sample_rate", "confidence", "samples")
        frame = pandas.DataFrame({name: getattr(self, name) for name in _COLUMNS})
        frame.attrs.update({name: getattr(self, name) for name in settings})
        return frame


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
        `deviation` of rates in their unit, of others in theirs per second; ``tdev`` times s.

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
    require_choice("kind", kind, Kind)
    row = properties_of(estimator)
    require_choice("gaps", gaps, Gaps)
    require_rate(sample_rate)
    require_confidence(confidence)
    if noise_type is not None:
        check_noise_type(noise_type, row)
    samples = squarable(values)
    only_whole = estimator if row.whole_record_only else None
    track = accumulated_track(samples, kind, sample_rate, gaps, only_whole)
    if is_constant_rate(values, kind):
        track = whole_track(np.zeros(track.angle.size))
    angles = track.angle.size
    clusters, of_clusters = cluster_sizes(taus, angles, sample_rate, row)
    points = row.points(track, clusters)
    laws = [ESTIMATORS[rule] for rule in points.rules]
    tau = np.array([law.effective for law in laws]) * points.clusters / sample_rate
    deviation = np.sqrt(points.variance) * (1.0 if kind == "rate" else sample_rate)
    if row.is_time:
        deviation *= tau / np.sqrt(3.0)
    of_noise: tuple[Note, ...] = ()
    exponents = np.full(tau.size, noise_type or 0, dtype=np.int64)
    if noise_type is None:
        exponents, of_noise = identified_noise_types(track, points.clusters, row)
    settings = zip(laws, exponents, points.clusters, points.windows, strict=True)
    each = (law.freedom(int(alpha), int(m), angles, int(some)) for law, alpha, m, some in settings)
    edf = np.array(list(each))
    # Degrees of freedom times s^2 / sigma^2 are chi-squared.
    upper = 0.5 * (1.0 + confidence)
    squares = (gammaincinv(0.5 * edf, chance) for chance in (upper, 1.0 - upper))
    low, high = (deviation * np.sqrt(0.5 * edf / square) for square in squares)
    missing = Note(text=f"{track.missing} of {samples.size} samples are missing")
    return StabilityCurve(
        tau=tau,
        deviation=deviation,
        terms=points.terms,
        edf=edf,
        low=low,
        high=high,
        noise_type=exponents,
        estimator=estimator,
        kind=kind,
        sample_rate=float(sample_rate),
        confidence=float(confidence),
        samples=int(samples.size),
        notes=(*((missing,) if track.missing else ()), *of_clusters, *points.notes, *of_noise),
    )
