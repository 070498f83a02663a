"""Choices of the caller, and the clock of an analysis that they are told by."""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final, Literal, TypedDict, get_args

from sagnac.core import errors
from sagnac.core.errors import RecordingError, quoted, refusal
from sagnac.lines.published import FAIR, PublishedSearch
from sagnac.noise.readings import PLAIN, READINGS, Reading
from sagnac.quality.check import FINDINGS
from sagnac.recording.model import Recording
from sagnac.stability import Estimator
from sagnac.table.turns import turns
from sagnac.verdict.limits import Specification, specification_of

Covariate = Literal["temperature"]
Method = Literal["fos", "fos-paper", "fos-korenberg", "fris", "none"]
PUBLISHED: Final[tuple[Method, ...]] = ("fos-paper", "fos-korenberg")
"""Methods whose answer is the fit of the Allan curve (Step 4 of the paper)."""

CurveNames = tuple[Estimator, ...]
ESTIMATORS: Final[CurveNames] = get_args(Estimator)
"""All of the Allan family, in its order."""

Progress = Callable[[str, float], None]

MOST_GYROS = 3


class SettingsFields(TypedDict, total=False):
    """The fields of `Settings` as keywords, for editors and type checkers."""

    gyros: Sequence[str]
    method: Method
    interval: float | None
    confidence: float
    estimators: Sequence[Estimator]
    strict: bool
    accepted: Sequence[str]
    specification: Specification | str | None
    published: PublishedSearch
    step_4: Reading | str
    covariates: Sequence[Covariate]


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Choices of the caller.

    Parameters
    ----------
    gyros
        Names; without any, all gyros of the recording. At rest each is taken alone. On a turning
        table: one gyro, a pair to difference, or a triad. The first gyro of a triad less the last
        gives the curve and the answer; with the second, each gyro's own N is told apart.
    method
        How the periodic parts are removed. ``fos``: joint fit of all lines that stand above the
        noise floor. ``fos-paper``: fast orthogonal search, of the difference of a pair, and the fit
        of the Allan curve (Steps 3, 1, 2 and 4 of the paper). ``fos-korenberg``: the search of each
        gyro first, on the frequencies of the Fourier transform, with Korenberg's stop and 40 terms.
        ``fris``: one angle a turn. ``none``: nothing is removed.
    interval
        Seconds between the angles that the curve is made of; None for every sample at rest and
        for 1 s on a turning table (Step 4 of the paper).
    confidence
        Of every interval, between 0 and 1.
    estimators
        Which of the Allan family to make of the same angles, with the power spectral density,
        beside the overlapping Allan deviation that the coefficients rest on.
    strict
        Refuse a recording in which a fault is found, be it one that the answer survives.
    accepted
        Findings taken knowingly, by name (`sagnac.quality.check.FINDINGS`): the answer is
        given in spite of them, and a note says so.
    specification
        Limits that the gyros have to keep, or their text (`sagnac.judge`); None for no verdict.
    published
        How ``fos-paper`` searches: grid, orders, terms, rule and order of the steps.
    step_4
        How the paper's methods read their Step 4: which squares, and whether the noise that went
        with the lines is put back; a reading, or the name of one (`sagnac.noise.readings`).
    covariates
        What a drift at rest is fitted with and taken off by, before anything else is done.

    Raises
    ------
    ValueError
        If a value is none of these.

    Examples
    --------
    >>> Settings(gyros=("x", "z"), confidence=0.9).method
    'fos'
    >>> Settings(confidence=2.0)
    Traceback (most recent call last):
        ...
    sagnac.core.errors.ArgumentError: confidence is 2.0; give a number between 0 and 1
    """

    gyros: tuple[str, ...] = ()
    method: Method = "fos"
    interval: float | None = None
    confidence: float = 0.95
    estimators: CurveNames = ()
    strict: bool = False
    accepted: tuple[str, ...] = ()
    specification: Specification | None = None
    published: PublishedSearch = FAIR
    step_4: Reading = PLAIN
    covariates: tuple[Covariate, ...] = ()

    def __post_init__(self) -> None:
        names = self.gyros if isinstance(self.gyros, Iterable) else (self.gyros,)
        if isinstance(names, str) or not all(isinstance(name, str) for name in names):
            raise refusal("gyros", f"is {quoted(self.gyros)}; give names, such as ('x', 'z')")
        object.__setattr__(self, "gyros", tuple(self.gyros))
        errors.require_choice("method", self.method, Method)
        errors.require_choice("strict", self.strict, (False, True))
        if not isinstance(self.step_4, Reading):
            errors.require_choice("step_4", self.step_4, READINGS)
            object.__setattr__(self, "step_4", READINGS[self.step_4])
        if not isinstance(self.published, PublishedSearch):
            raise refusal("published", f"is {quoted(self.published)}; give a PublishedSearch")
        if self.specification is not None:
            object.__setattr__(self, "specification", specification_of(self.specification))
        several = {"accepted": FINDINGS, "covariates": Covariate, "estimators": ESTIMATORS}
        for field, allowed in several.items():
            object.__setattr__(self, field, errors.choices_of(field, getattr(self, field), allowed))
        in_order = tuple(name for name in ESTIMATORS if name in self.estimators)
        object.__setattr__(self, "estimators", in_order)
        interval = self.interval
        if interval is not None and not (errors.is_finite(interval) and interval > 0.0):
            raise refusal("interval", f"is {quoted(interval)}; give seconds above zero, or None")
        errors.require_confidence(self.confidence)

    def gyros_of(self, recording: Recording) -> tuple[str, ...]:
        """The gyros asked for, or all that the recording has.

        Raises
        ------
        RecordingError
            If these are not different gyros that it has, or more than three on a turning table.
        """
        names = self.gyros or tuple(channel.name for channel in recording.gyros)
        most = MOST_GYROS if turns(recording) else len(recording.gyros)
        if len(names) > most or len(set(names)) != len(names):
            remedy = "name one gyro, a pair or a triad, each once ({gyros x,z})"
            raise RecordingError(f"gyros {','.join(names)}", remedy=remedy)
        for name in names:
            # One that is not there is no gyro that was refused.
            recording.gyro(name)
        return names


class Stages:
    """The clock of one analysis.

    Parameters
    ----------
    progress
        Called with the stage and the fraction of it done; None for nobody.
    path
        Of the file, put into an error that does not name it: a stage knows the data alone.

    Attributes
    ----------
    seconds
        Wall time by stage, in the order in which the stages first began.
    """

    def __init__(self, progress: Progress | None, path: str) -> None:
        errors.require_progress(progress)
        self._progress = progress or (lambda _stage, _fraction: None)
        self._path = path
        self.seconds: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[Callable[[float], None]]:
        """Time what is done inside; gives a function to be called with the fraction done."""
        began = time.perf_counter()
        self._progress(name, 0.0)
        try:
            yield lambda fraction: self._progress(name, fraction)
        except RecordingError as error:
            raise error.at(self._path) from None
        self._progress(name, 1.0)
        self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - began
