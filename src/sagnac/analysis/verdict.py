"""Whether gyros keep a specification."""

from dataclasses import replace
from typing import Final

from sagnac.analysis.result import Analysis, answer_coefficients, require_analysis, require_gyro
from sagnac.analysis.trust import is_doubt
from sagnac.noise.estimates import Estimate, unobserved
from sagnac.recording.channel import PAIR_SIZE
from sagnac.verdict.judgement import Verdict, judged
from sagnac.verdict.limits import Limit, Specification, specification_of

EITHER: Final = (
    "but it is of the mean square of the two: one of them alone may have up to 1.41 times as much"
)
"""Beside a pass of a pair, where one gyro of it may break the limit."""


def verdict_of(analysis: Analysis) -> Verdict | None:
    """Every limit beside every gyro; None if the settings state no specification.

    N of a triad is judged for each gyro, all else for what the curve is of: one gyro, or what the
    difference of two makes per gyro. A gyro of a triad that is not in that difference is undecided
    there, for nothing was measured of it. At rest each gyro is judged by its own analysis; one
    that was refused is undecided. All are undecided if a unit is in doubt. A gyro that is a copy of
    another passes no limit.
    """
    specification = analysis.settings.specification
    return None if specification is None else judge(analysis, specification)


def judge(
    analysis: Analysis, specification: Specification | str, *, risk: float | None = None
) -> Verdict:
    """Pass, fail or undecided: every limit of a specification beside every gyro.

    Parameters
    ----------
    analysis
        Of one gyro or several.
    specification
        The limits, or their text: ``3e-4deg/sqrt(h)``, ``N=3e-4deg/sqrt(h),B=0.01deg/h`` or the
        path of a TOML file.
    risk
        With a text: largest probability of passing a gyro that lies at its limit.

    Raises
    ------
    ValueError
        If the text states no limits, or a risk is given beside a `Specification`.
    RecordingError
        If the TOML file cannot be read, or the analysis is of an accelerometer.

    Examples
    --------
    >>> import numpy as np
    >>> from sagnac import Recording, analyze
    >>> rate = 1e-6 * np.sqrt(10.0) * np.random.default_rng(1).standard_normal(6000)
    >>> still = Recording.from_arrays(x=rate, kind="rate", unit="rad/s", sample_rate=10.0)
    >>> judge(analyze(still), "1deg/sqrt(h)").decision
    'pass'
    """
    require_analysis(analysis)
    require_gyro(analysis)
    specification = specification_of(specification, risk=risk)
    doubt, rows = _doubt(analysis), []
    # One gyro of a pair may have all that the mean square of the two holds.
    mixed = [analysis.channel] if len(analysis.settings.gyros) == 2 else []
    for limit in specification.limits:
        for one in analysis.each:
            doubts = [note for note in one.findings if note.level == "warning"]
            # What comes late or in part has another effect.
            copies = {n.channel for n in doubts if n.name == "copy" and n.effect == 0.0}
            for name, estimate in _measured(one, limit).items():
                row = judged(name, limit, estimate, specification)
                breaks = PAIR_SIZE * estimate.high > limit.value
                if name in mixed and row.decision == "pass" and breaks:
                    row = replace(row, reason=f"{row.reason}; {EITHER}")
                if name in copies and row.decision == "pass":
                    row = replace(row, decision="undecided", reason="it is a copy of another gyro")
                rows.append(replace(row, decision="undecided", reason=doubt) if doubt else row)
    for limit in specification.limits:
        unseen = unobserved(limit.coefficient, analysis.settings.confidence)
        refused = (name for name in analysis.settings.gyros if name in analysis.refused)
        rows += [judged(name, limit, unseen, specification) for name in refused]
    return Verdict(specification=specification, judgements=tuple(rows))


def _measured(analysis: Analysis, limit: Limit) -> dict[str, Estimate]:
    """The coefficient of a limit, by what it was measured of; unseen of other gyros of a triad."""
    if limit.coefficient == "angle_random_walk" and analysis.per_gyro:
        return dict(analysis.per_gyro)
    unseen = unobserved(limit.coefficient, analysis.settings.confidence)
    taken = {*analysis.channel.split("-"), analysis.channel}
    # If the gyros of a triad are not told apart, the pair says nothing of the third.
    gyros = analysis.settings.gyros if analysis.is_pair else analysis.per_gyro
    return {
        analysis.channel: answer_coefficients(analysis).get(limit.coefficient) or unseen,
        **{name: unseen for name in gyros if name not in taken},
    }


def _doubt(analysis: Analysis) -> str:
    """Why no figure decides: a unit of the gyros or of time looks wrong, and nobody accepted it.

    A gyro that turns steadily, and no encoder with it, is in a wrong unit or on a table.
    """
    doubted = {
        name
        for one in (analysis, *analysis.each)
        for note in one.findings
        if is_doubt(note)
        for name in note.channel.split(", ")
    }
    # If two gyros contradict each other, either may be wrong: a doubt about one holds for all.
    beside = () if analysis.stored else (one.name for one in analysis.recording.gyros)
    names = dict.fromkeys(("time", *analysis.settings.gyros, *beside))
    known = [name for name in names if name in doubted]
    return f"the unit or kind of {', '.join(known)} is in doubt" if known else ""
