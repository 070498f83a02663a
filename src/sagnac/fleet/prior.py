"""Prior of N by a campaign, from which a filter starts: the paper's use of its Table 2."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.special import ndtri

from sagnac.alignment.noise import GyroNoise
from sagnac.errors import RecordingError
from sagnac.fleet.scatter import scatter_of
from sagnac.fleet.table import Line, groups_of, read_table
from sagnac.repeatability.study import Range, Repeatability
from sagnac.units import DEGREE_PER_ROOT_HOUR


@dataclass(frozen=True, slots=True, kw_only=True)
class Prior:
    """N of a run not yet made.

    Attributes
    ----------
    noise
        N is the median that is foretold, and the root of its variance half of the interval over
        the normal quantile, both of ln N; B and K were not foretold.
    words
        Of what it is foretold, and from what.
    """

    noise: GyroNoise
    words: str


def prior_of(path: Path, *, confidence: float = 0.95) -> Prior:
    """N of the next unit on a new day or, if the campaign has one unit, of its next day.

    Parameters
    ----------
    path
        Folder of a campaign, or its ``campaign.csv``.
    confidence
        Of the interval that is foretold.

    Raises
    ------
    RecordingError
        If it is no campaign, has several methods or choices of gyros, or does not show how N
        scatters over days.
    """
    groups = groups_of(read_table(path))
    try:
        lines = _only_group(groups)
        scatter = scatter_of(lines, confidence)
        if scatter.found is None:
            raise RecordingError(scatter.why)
        foretold, what = _foretold(scatter.found)
    except RecordingError as error:
        raise error.at(str(path)) from None
    reach = math.log(foretold.high / foretold.low) / (2.0 * float(ndtri(0.5 + 0.5 * confidence)))
    value = foretold.value * DEGREE_PER_ROOT_HOUR
    covariance = np.zeros((3, 3))
    covariance[0, 0] = (value * reach) ** 2
    return Prior(
        noise=GyroNoise(
            angle_random_walk=value,
            covariance=covariance,
            unseen=("bias_instability", "rate_random_walk"),
        ),
        words=f"N is that foretold for {what} by {scatter.found.runs} runs "
        f"({lines[0].method}, {lines[0].gyros}): {foretold.value:.3g} "
        f"[{foretold.low:.3g}, {foretold.high:.3g}] deg/sqrt(h), {100.0 * confidence:g} %",
    )


def _only_group(groups: dict[tuple[str, str], list[Line]]) -> Sequence[Line]:
    if len(groups) != 1:
        held = "; ".join(f"{method} of {gyros}" for method, gyros in groups) or "no recording"
        raise RecordingError(
            f"holds {held}", remedy="give a campaign of one method and one choice of gyros"
        )
    (lines,) = groups.values()
    return lines


def _foretold(found: Repeatability) -> tuple[Range, str]:
    if found.next_unit is not None:
        return found.next_unit, "the next unit on a new day, at a new rate"
    if len(found.next_day) == 1:
        ((unit, foretold),) = found.next_day.items()
        return foretold, f"unit {unit} on a new day, at a new rate"
    raise RecordingError(
        "does not show how N scatters over days", remedy="measure a unit on three days or more"
    )
