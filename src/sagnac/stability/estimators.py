"""The Allan family: one table of what each estimator is, and how the total family sums.

A new estimator takes its name in `sagnac.stability.Estimator`, a compiled loop in `_kernels` with a
function that sums by it, a row here, and its definition in plain loops in
``tests/naive_stability.py``.

==========  =====================================  =====  ===========  ====================
name        deviation                              order  overlapping  degrees of freedom
==========  =====================================  =====  ===========  ====================
adev        Allan                                  2      no           Greenhall and Riley
oadev       overlapping Allan                      2      yes          Greenhall and Riley
mdev        modified Allan                         2      yes          Greenhall and Riley
tdev        time, tau mdev / sqrt(3)               2      yes          Greenhall and Riley
hdev        Hadamard                               3      no           Greenhall and Riley
ohdev       overlapping Hadamard                   3      yes          Greenhall and Riley
totdev      total                                  2      yes          SP1065 Table 7
mtotdev     modified total                         2      yes          SP1065 Table 8
theo1       Theo1                                  2      yes          SP1065 Table 9
theoh       oadev, then Theo1 less its bias        2      yes          SP1065 Table 9
haar        Haar wavelet, oadev / sqrt(2)          2      yes          Greenhall and Riley
==========  =====================================  =====  ===========  ====================

Total and modified total variance, Theo1 and its bias-removed hybrid: SP1065, sections 5.2.11,
5.2.12, 5.2.15 and 5.2.16.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final

import numpy as np

from sagnac.core.arrays import IntegerArray, blocks, empty, is_mapped, release
from sagnac.core.errors import Note, RecordingError, require_choice, rounded
from sagnac.stability import Estimator, _kernels, freedom
from sagnac.stability import sums as track_sums
from sagnac.stability.freedom import THEO1_EFFECTIVE, FreedomLaw
from sagnac.stability.sums import Counted, Points, Track

# Sums, and numbers of outer windows, of a track by clusters; windows a stride apart.
Sums = Callable[[Track, IntegerArray, IntegerArray], Counted]
# Ratios that the bias is the mean of, at most.
_BIAS_RATIOS: Final = 48


@dataclass(frozen=True, slots=True, kw_only=True)
class Properties:
    """Properties of one estimator.

    Attributes
    ----------
    name, title
        As arguments name it, and in words.
    order
        Of the differences of the angle.
    overlapping
        Whether differences start at every sample, or at every m-th.
    whole_record_only
        Whether it takes no record with gaps.
    shortest
        Smallest cluster, in samples.
    longest
        Largest cluster by the number of accumulated angles.
    windows
        Outer averages of a whole record, by cluster and number of angles.
    squares
        Squares in each of these, by cluster, if there are so many that windows are skipped before
        taking every one costs too much; else None, for one.
    sums
        Sums of squares, and the windows that they are of.
    divisor, power
        The variance is the mean of the squares over `divisor` m^`power`.
    effective
        Cluster time as a share of the cluster.
    freedom
        Degrees of freedom by noise type, cluster, angles and windows.
    fewest_angles
        Angles below which it gives nothing.
    step
        Clusters are multiples of it.
    octaves
        Whether the default clusters are the powers of two.
    is_time
        Whether the deviation is shown times tau / sqrt(3).
    is_hybrid
        Whether it is overlapping Allan first, and then Theo1 less its bias.
    remark
        Note on every curve.
    """

    name: Estimator
    title: str
    longest: Callable[[int], int]
    windows: Callable[[int, int], int]
    sums: Sums
    freedom: FreedomLaw
    divisor: float = 2.0
    power: int = 2
    squares: Callable[[IntegerArray], IntegerArray] | None = None
    order: int = 2
    effective: float = 1.0
    overlapping: bool = True
    whole_record_only: bool = False
    shortest: int = 1
    fewest_angles: int = 0
    step: int = 1
    octaves: bool = False
    is_time: bool = False
    is_hybrid: bool = False
    remark: str = ""

    def points(self, track: Track, clusters: IntegerArray) -> Points:
        """Its variance at each cluster.

        Raises
        ------
        RecordingError
            If gaps leave no term at any cluster.
        """
        if self.is_hybrid:
            return _hybrid_points(self, track, clusters)
        angles = track.angle.size
        whole = np.array([self.windows(m, angles) for m in clusters.tolist()], dtype=np.int64)
        squares = strides = np.ones_like(whole)
        if self.squares is not None:
            squares = self.squares(clusters)
            strides = track_sums.stride_of(whole, squares, clusters)
        sums, windows = self.sums(track, clusters, strides)
        kept = windows > 0
        if clusters.size and not kept.any():
            problem = f"the gaps leave no term of {self.name} at any tau asked for"
            raise RecordingError(problem, channel="values", remedy="ask for shorter")
        m = clusters[kept]
        notes = _gap_notes(whole, windows) if track.missing else ()
        notes += _skip_notes(self.name, strides, clusters)
        return Points(
            variance=sums[kept] / (self.divisor * (1.0 * m) ** self.power * windows[kept]),
            terms=windows[kept] * squares[kept],
            windows=windows[kept],
            clusters=m,
            rules=(self.name,) * m.size,
            notes=(*notes, Note(text=self.remark)) if self.remark else notes,
        )

    @property
    def lowest_exponent(self) -> int:
        """Steepest power law of the rate noise for which it converges."""
        return -2 if self.order == 2 else -4


def _gap_notes(whole: IntegerArray, terms: IntegerArray) -> tuple[Note, ...]:
    lost = whole - terms
    most = f"at most {rounded(100.0 * float((lost / whole).max()), 3)} % of those at one tau"
    note = Note(text=f"gaps left out {int(lost.sum())} of {int(whole.sum())} terms, {most}")
    without = int(np.count_nonzero(terms <= 0))
    left_out = Note(text=f"{without} taus have no term free of gaps and are left out")
    return (note, left_out) if without else (note,)


def _skip_notes(name: Estimator, strides: IntegerArray, clusters: IntegerArray) -> tuple[Note, ...]:
    """Note on windows that are skipped, if any are."""
    skipped = strides > 1
    if not skipped.any():
        return ()
    some = strides[skipped]
    taus = f"{name} averages every k-th window at {some.size} of {strides.size} taus"
    most = f"at most {(some / clusters[skipped]).max():.2g} of a cluster"
    return (Note(text=f"{taus}, k = {some.min()} to {some.max()}, {most}"),)


# ---- how the total family and Theo1 sum ----------------------------------------------------


def _theo1_sums(track: Track, spans: IntegerArray, strides: IntegerArray) -> Counted:
    """Weighed squares of even spans."""
    angle, mirrored = track.angle, empty(track.angle.size)
    mirrored[:] = angle[::-1]
    sums = np.empty(spans.size)
    for number, (span, stride) in enumerate(zip(spans.tolist(), strides.tolist(), strict=True)):
        sums[number] = _kernels.sum_theo1_terms(angle, mirrored, span, stride)
        release()
    return sums, -(-(angle.size - spans) // strides)


def _hybrid_points(row: Properties, track: Track, clusters: IntegerArray) -> Points:
    """Overlapping Allan up to a fifth of the record, Theo1 less its bias beyond."""
    short = clusters[clusters <= 0.2 * (track.angle.size - 1)]
    spans = np.unique(2 * np.rint(clusters[short.size :] / (2 * THEO1_EFFECTIVE)).astype(np.int64))
    allan = ESTIMATORS["oadev"].points(track, short)
    if not spans.size:
        return allan
    theo1 = replace(ESTIMATORS["theo1"], name=row.name, remark="").points(track, spans)
    # Mean ratio of Allan to Theo1 at equal tau up to a tenth of the record.
    ratios = int(0.1 * track.angle.size / 3.0 - 3.0) + 1
    steps, notes = np.arange(ratios), theo1.notes
    if ratios > _BIAS_RATIOS:
        steps = np.unique(np.rint(np.linspace(0, ratios - 1, _BIAS_RATIOS)).astype(np.int64))
        text = f"theoh takes its bias from {steps.size} of {ratios} ratios, evenly spaced"
        notes = (Note(text=text), *notes)
    lower = ESTIMATORS["theo1"].points(track, 12 + 4 * steps).variance
    upper = ESTIMATORS["oadev"].points(track, 9 + 3 * steps).variance
    usable = lower > 0.0
    ratio = float(np.mean(upper[usable] / lower[usable])) if usable.any() else 1.0
    return allan.followed_by(replace(theo1, variance=theo1.variance * ratio, notes=notes))


def _total_sums(track: Track, clusters: IntegerArray, strides: IntegerArray) -> Counted:
    """Squared second differences centred on every inner sample.

    Beyond an end the angle is its point reflection in that end, ``x[-k] = 2 x[0] - x[k]``.
    """
    angle, size = track.angle, track.angle.size
    # A mapped array would be read anew from its file for each cluster.
    longer = empty(3 * size - 2) if is_mapped(angle) else np.empty(3 * size - 2)
    before, behind = longer[: size - 1][::-1], longer[2 * size - 1 :]
    for block in blocks(size - 1):
        first, last = angle[block.start + 1 : block.stop + 1], angle[size - 1 - block.stop :]
        np.subtract(2.0 * angle[0], first, out=before[block])
        longer[size - 1 :][block] = angle[block]
        np.subtract(2.0 * angle[-1], last[: first.size][::-1], out=behind[block])
    longer[2 * size - 2] = angle[-1]
    whole = track_sums.whole_track(longer).stretches
    sums, _ = track_sums.overlapping_sums(track, clusters, 2)
    for number, m in enumerate(clusters.tolist()):
        own, first_arm = slice(number, number + 1), size - 1 - m
        # Centres nearer to the first or to the last angle than the arms are long.
        for begin, end in ((1, min(m, size - 1)), (max(m, size - m), size - 1)):
            for block in blocks(end + first_arm, start=begin + first_arm):
                here = clusters[own], 2, block.start, block.stop, sums[own]
                _kernels.sum_squared_differences(longer, whole, *here)
    return sums, np.full(clusters.size, size - 2)


def _modified_total_sums(track: Track, clusters: IntegerArray, strides: IntegerArray) -> Counted:
    """Squares of every window of three clusters, extended by its mirror image."""
    pairs = zip(clusters.tolist(), strides.tolist(), strict=True)
    sums = [_kernels.sum_modified_total_terms(track.angle, *pair) for pair in pairs]
    return np.array(sums), -(-(track.angle.size - 3 * clusters + 1) // strides)


# ---- table -------------------------------------------------------------------------


def _differences(
    name: Estimator, title: str, *, order: int = 2, overlapping: bool = True, **others: Any
) -> Properties:
    """Averages of squared differences of an order."""

    def windows(cluster: int, angles: int) -> int:
        return angles - order * cluster if overlapping else (angles - 1) // cluster - order + 1

    summed = track_sums.overlapping_sums if overlapping else track_sums.plain_sums
    row = Properties(
        name=name,
        title=title,
        order=order,
        overlapping=overlapping,
        longest=lambda angles: (angles - 1) // order,
        windows=windows,
        sums=lambda track, clusters, _: summed(track, clusters, order),
        divisor=2.0 if order == 2 else 6.0,
        freedom=partial(freedom.greenhall_riley_freedom, order=order, overlapping=overlapping),
    )
    return replace(row, **others)


_MODIFIED: Final = Properties(
    name="mdev",
    title="modified Allan",
    longest=lambda angles: angles // 3,
    windows=lambda cluster, angles: angles - 3 * cluster + 1,
    sums=lambda track, clusters, _: track_sums.modified_sums(track, clusters),
    power=4,
    freedom=partial(freedom.greenhall_riley_freedom, modified=True),
)
_THEO1: Final = Properties(
    name="theo1",
    title="Theo1",
    whole_record_only=True,
    shortest=10,
    step=2,
    longest=lambda angles: (angles - 1) // 2 * 2,
    windows=lambda span, angles: angles - span,
    squares=lambda spans: spans // 2,
    sums=_theo1_sums,
    divisor=THEO1_EFFECTIVE,
    effective=THEO1_EFFECTIVE,
    freedom=freedom.theo1_freedom,
    remark="theo1 keeps its bias (theoh removes it); taus asked for are its spans m tau0",
)
_ROWS: Final = (
    _differences("adev", "Allan", overlapping=False),
    _differences("oadev", "overlapping Allan"),
    _MODIFIED,
    replace(_MODIFIED, name="tdev", title="time", is_time=True),
    _differences("hdev", "Hadamard", order=3, overlapping=False),
    _differences("ohdev", "overlapping Hadamard", order=3),
    Properties(
        name="totdev",
        title="total",
        whole_record_only=True,
        longest=lambda angles: angles - 1,
        windows=lambda cluster, angles: angles - 2,
        sums=_total_sums,
        freedom=freedom.total_freedom,
    ),
    replace(
        _MODIFIED,
        name="mtotdev",
        title="modified total",
        whole_record_only=True,
        squares=lambda clusters: 6 * clusters,
        sums=_modified_total_sums,
        freedom=freedom.modified_total_freedom,
        remark="mtotdev keeps its bias: its variance lies below that of mdev",
    ),
    _THEO1,
    replace(
        _THEO1,
        name="theoh",
        title="overlapping Allan and bias-removed Theo1",
        shortest=1,
        step=1,
        longest=lambda angles: int(THEO1_EFFECTIVE * _THEO1.longest(angles)),
        is_hybrid=True,
        fewest_angles=90,  # the first ratio to Allan needs 0.1 N / 3 - 3 >= 0
    ),
    _differences("haar", "Haar wavelet", divisor=4.0, octaves=True),
)
ESTIMATORS: Final[Mapping[Estimator, Properties]] = {row.name: row for row in _ROWS}


def properties_of(estimator: Estimator) -> Properties:
    """The row of the table.

    Raises
    ------
    ValueError
        If there is no such estimator.
    """
    require_choice("estimator", estimator, Estimator)
    return ESTIMATORS[estimator]
