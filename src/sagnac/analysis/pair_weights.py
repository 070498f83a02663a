"""A pair whose weights are unlike: what its answer says of the plain mean of the two gyros."""

from dataclasses import replace

from sagnac.analysis.headline import Headline
from sagnac.analysis.measurement import Measurement
from sagnac.analysis.table_angle import ALIKE
from sagnac.errors import Note


def of_both_alike(measured: Measurement, read: Headline) -> Headline:
    """The answer of a pair whose weights are unlike, with an interval that holds the plain mean.

    The square of what is read is the mean of N^2 of the two gyros by the squares of their weights.

    Parameters
    ----------
    measured
        As `followed` gives it.
    read
        The answer.
    """
    least, most = sorted(abs(weight) for weight in measured.weights)
    estimate = read.estimate
    if (ALIKE[0] < least and most < ALIKE[1]) or estimate.status == "not observable":
        return read
    first, second = measured.gyros
    note = Note(
        channel=measured.channel,
        text=f"{first} counts {abs(measured.weights[0]):.2f} times and {second} "
        f"{abs(measured.weights[1]):.2f} times, so that the two take the table out; the interval "
        "holds their plain mean whichever of the two has the noise",
    )
    low, high = estimate.low / most, estimate.high / least
    value = estimate.value if estimate.status == "estimated" else high
    return replace(
        read,
        estimate=replace(estimate, value=value, low=low, high=high),
        notes=(*read.notes, note),
    )
