"""Parts of a report that several outputs share.

How a number came about, shares of the table's rate, accelerometers, a verdict; pages from
templates, the page as a PDF, its title block and its notes.
"""

import math
import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path
from typing import Any, Final, Literal, Self

import jinja2

from sagnac.analysis.result import Analysis, answer_coefficients, headline_fit
from sagnac.analysis.verdict import verdict_of
from sagnac.core.documents import ANY, read_toml, table
from sagnac.core.errors import MissingExtra, Note, RecordingError, ranked, rounded
from sagnac.core.units import DEGREE, DEGREE_PER_HOUR, SENSED, field_unit
from sagnac.core.version import __version__
from sagnac.core.whole_files import write_bytes
from sagnac.noise.estimates import Interval
from sagnac.noise.laws import COEFFICIENT_NAMES, SYMBOLS
from sagnac.report import error_text, note_text, quantities, tables
from sagnac.verdict.judgement import Decision, Judgement, Verdict, overall

# ---- methods -----------------------------------------------------------------------

REFERENCES: Final[dict[str, str]] = {
    "paper": "Yu, Wang, Wang and Wu, Sensors 2013, 13, 2750, doi:10.3390/s130302750",
    "ieee": "IEEE Std 952-1997, Annex C, and IEEE Std 647-2006, Annex C",
    "average": "Jay and Neil, Phys. Rev. D 103, 114502, 2021, arXiv:2008.01069",
}


def cited(text: str) -> dict[str, Any]:
    """The `methods` of an analysis as one paragraph with numbers for references; these by number.

    Parameters
    ----------
    text
        The method, one sentence a line, each reference in brackets by its key.
    """
    paragraph = " ".join(text.split())
    mark = re.compile(rf"\[({'|'.join(REFERENCES)})\]")
    used = list(dict.fromkeys(mark.findall(paragraph)))
    numbered = mark.sub(lambda found: f"[{used.index(found[1]) + 1}]", paragraph)
    return {"methods": numbered, "references": [REFERENCES[key] for key in used]}


# ---- shares ------------------------------------------------------------------------

_OF_AXIS: Final = ("share of the table's rate", "angle to the table's axis °")
HEADER: Final = ("gyro", *_OF_AXIS, "asymmetry ppm", "bias °/h")


def share_rows(analysis: Analysis) -> list[tuple[str, ...]]:
    """A row for each gyro under `HEADER`, each value with its interval; empty at rest.

    What the recording does not tell is an empty cell.
    """
    angles = analysis.triad.angles if analysis.triad is not None else {}
    rows: list[tuple[str, ...]] = []
    for name, one in analysis.shares.items():
        angle = with_interval(angles.get(name) or _axis_angle(one.share), DEGREE)
        asymmetry = with_interval(one.asymmetry, 1e-6)
        bias = with_interval(one.bias, DEGREE_PER_HOUR)
        rows.append((name, with_interval(one.share), angle, asymmetry, bias))
    return rows


def share_remarks(analysis: Analysis) -> list[str]:
    """Basis of the shares, and the scale factor of a triad; none at rest."""
    return rendered("shares.txt", analysis=analysis).splitlines()


def with_interval(interval: Interval | None, size: float = 1.0) -> str:
    """``0.57735 [0.57734, 0.57736]`` in units of `size`, with the digits that it allows.

    Examples
    --------
    >>> with_interval(Interval(value=0.5773503, low=0.5773482, high=0.5773524))
    '0.5773503 [0.5773482, 0.5773524]'
    >>> with_interval(None)
    ''
    """
    if interval is None:
        return ""
    width = 0.5 * (interval.high - interval.low) / size
    ends = (interval.value, interval.low, interval.high)
    value, low, high = (quantities.number(end / size, width, plain=True) for end in ends)
    return f"{value} [{low}, {high}]"


def _axis_angle(share: Interval) -> Interval | None:
    """Angle between a gyro's axis and the table's, rad, if the scale factor is 1.

    None if no axis has so large a share.
    """
    if abs(share.value) > 1.0:
        return None
    ends = (share.high, share.value, share.low)
    low, value, high = (math.acos(max(-1.0, min(1.0, end))) for end in ends)
    return Interval(value=value, low=low, high=high)


# ---- forces ------------------------------------------------------------------------


def force_rows(analyses: Sequence[Analysis]) -> list[tuple[str, str, tuple[str, ...]]]:
    """The coefficients of accelerometers: symbol and title, unit, and a reading of each.

    Parameters
    ----------
    analyses
        Of accelerometers.
    """
    titles, rows = SENSED["accelerometer"].titles, []
    for name in COEFFICIENT_NAMES:
        estimates = [answer_coefficients(one).get(name) for one in analyses]
        readings = ("not fitted" if one is None else quantities.reading(one) for one in estimates)
        unit = field_unit(name, "accelerometer").symbol
        rows.append((f"{SYMBOLS[name]} {titles[name]}", unit, tuple(readings)))
    return rows


def force_notes(analyses: Sequence[Analysis]) -> tuple[str, ...]:
    """Notes on accelerometers that do not stand among those of the recording."""
    read = [note for one in analyses for note in one.recording.notes]
    others = [note for one in analyses for note in one.notes if note not in read]
    return tuple(dict.fromkeys(map(note_text, others)))


def together(notes: Iterable[Note]) -> list[Note]:
    """Notes in their order; what is said of several channels alike is one note of all of them."""
    channels: dict[Note, list[str]] = {}
    for note in notes:
        channels.setdefault(replace(note, channel=""), []).append(note.channel)
    return [replace(note, channel=", ".join(names)) for note, names in channels.items()]


# ---- verdicts ----------------------------------------------------------------------

DECISIONS: Final[dict[Decision, str]] = {"pass": "PASS", "fail": "FAIL", "undecided": "UNDECIDED"}


def verdict_data(verdict: Verdict) -> dict[str, Any]:
    """The verdict as plain data, figures in the units of the field."""
    return {
        "overall": verdict.decision,
        "risk": verdict.risk,
        "product": verdict.specification.product or None,
        "gyros": dict(verdict.by_gyro),
        "limits": [_judgement(one) for one in verdict.judgements],
    }


def overall_decision(several: Iterable[Analysis], refused: Collection[str] = ()) -> Decision | None:
    """The decision on several analyses together; None if none has a specification.

    Recordings that were `refused` beside them are undecided: a limit is kept by all or not at all.
    """
    decisions = [verdict.decision for each in several if (verdict := verdict_of(each)) is not None]
    undecided: list[Decision] = ["undecided"] if refused else []
    return overall(decisions + undecided) if decisions else None


def found_text(judgement: Judgement) -> str:
    """Measured value in the unit of its limit: with its interval, a bound, or neither."""
    limit, estimate = judgement.limit, judgement.estimate
    interval = quantities.reading(estimate, limit.unit.name)
    return interval if estimate.status == "not observable" else f"{interval} {limit.unit.symbol}"


def risk_text(verdict: Verdict) -> str:
    """The risk in words."""
    percent = f"{rounded(100.0 * verdict.risk, 3)} %"
    return f"a gyro at its limit passes with a probability of {percent} at most"


def gyro_text(judgement: Judgement) -> str:
    """The gyro, or the pair whose root mean square N̄ is judged."""
    first, dash, second = judgement.gyro.partition("-")
    return f"{first} − {second}, per gyro" if dash else first


def _judgement(one: Judgement) -> dict[str, Any]:
    name, shown = one.limit.coefficient, one.estimate.in_field_unit()
    return {
        "gyro": one.gyro,
        "coefficient": name,
        "limit": one.limit.value / field_unit(name).size,
        **{key: getattr(shown, key) for key in ("value", "low", "high", "unit", "status")},
        "confidence": one.estimate.confidence,
        "verdict": one.decision,
        "risk": one.risk,
        "reason": one.reason,
        "stated": f"{one.limit.in_unit:.9g} {one.limit.unit.name}",
    }


# ---- html --------------------------------------------------------------------------


def rendered(template: str, **values: Any) -> str:
    """A template of the report filled in; what is not marked as safe is escaped.

    Templates call what this module, `tables` and `quantities` hold.
    """
    return _templates().get_template(template).render(**values).rstrip()


@cache
def _templates() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("sagnac.report"),
        autoescape=jinja2.select_autoescape(),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.globals |= {**vars(quantities), **vars(tables), **globals()}
    environment.globals |= {"error_text": error_text, "version": __version__}
    return environment


# ---- pdf ---------------------------------------------------------------------------


def require_pdf() -> None:
    """Refuse before the work if there is nothing to write a PDF with.

    Raises
    ------
    MissingExtra
        If weasyprint is not installed.
    RecordingError
        If the Pango library that it draws text with is not, which no Python package brings.
    """
    try:
        import weasyprint  # noqa: F401, PLC0415
    except ImportError as error:
        raise MissingExtra("report.pdf", "weasyprint", "pdf") from error
    except OSError as error:
        where = "Debian and Ubuntu: libpango-1.0-0 and libpangoft2-1.0-0; elsewhere: pango"
        remedy = f"install Pango ({where}), or leave {{pdf}} out"
        problem = "report.pdf cannot be written without the Pango library"
        raise RecordingError(problem, remedy=remedy) from error


def write_pdf(page: str, path: Path) -> None:
    """Write a page as it prints on A4, whole or not at all; nothing is fetched for it.

    Parameters
    ----------
    page
        HTML.
    path
        Of the PDF.

    Raises
    ------
    MissingExtra
        If weasyprint is not installed.
    RecordingError
        If Pango is not installed, or the folder cannot be written to.
    """
    require_pdf()
    from weasyprint import HTML  # noqa: PLC0415

    write_bytes(path, HTML(string=page).write_pdf())


# ---- title block -------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class TitleBlock:
    """Texts on top of a report; those that are empty are left out.

    Attributes
    ----------
    title
        Of the report.
    device, serial
        The unit under test.
    customer, operator, date
        For whom, by whom and when it was measured.
    """

    title: str = ""
    device: str = ""
    serial: str = ""
    customer: str = ""
    operator: str = ""
    date: str = ""

    @classmethod
    def from_toml(cls, path: Path) -> Self:
        """As a file states it.

        Raises
        ------
        ValueError
            If it is no TOML, or has a key that is none of these.
        OSError
            If it cannot be read.
        """
        try:
            stated = read_toml(path, table({field.name: ANY for field in fields(cls)}))
        except ValueError as error:
            raise ValueError(f"heading {path}: {error}") from None
        return cls(**{key: str(value) for key, value in stated.items()})

    @property
    def facts(self) -> list[tuple[str, str]]:
        """Statements besides the title, each with its name."""
        named = {"device": "Unit", "serial": "Serial number"}
        stated = {one.name: getattr(self, one.name) for one in fields(self) if one.name != "title"}
        return [(named.get(name, name.capitalize()), one) for name, one in stated.items() if one]


# ---- placed notes ------------------------------------------------------------------


Place = Literal["answer", "reading", "curve", "fits"]


def placed_notes(analysis: Analysis, others: Sequence[Analysis] = ()) -> dict[Place, list[Note]]:
    """The notes of an analysis by what they are of, each once, errors and warnings first.

    ``answer``: what touches the answer. ``reading``: remarks on how the file was read. ``curve``:
    on the curve. ``fits``: on fits that the answer does not rest on.

    Parameters
    ----------
    analysis
        Whose notes.
    others
        Analyses whose curves and fits it has notes on, besides its own.
    """
    everyone = (analysis, *others)
    places = {note: "reading" for note in analysis.recording.notes if note.level == "remark"}
    places |= {note: "fits" for one in everyone for note in _on_other_fits(one)}
    places |= {note: "curve" for one in everyone for note in one.curve.notes}
    ordered = ranked(analysis.notes)
    return {
        place: [note for note in ordered if places.get(note, "answer") == place]
        for place in ("answer", "reading", "curve", "fits")
    }


def _on_other_fits(analysis: Analysis) -> list[Note]:
    """Notes on fits to the curve that the answer does not rest on."""
    resting = headline_fit(analysis)
    fits = [fit for name, fit in analysis.fits.items() if name != "likelihood"]
    return [note for fit in fits if fit is not resting for note in fit.notes]
