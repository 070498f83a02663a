"""An analysis on a terminal: the answer first, then tables. Nothing is printed here.

The one screen of a command has no line wider than 80 columns.
"""

import math
import textwrap
from collections.abc import Collection, Mapping, Sequence

from rich.cells import cell_len

from sagnac.analysis.result import Analysis, headline_coefficients, headline_estimates
from sagnac.analysis.verdict import EITHER, verdict_of
from sagnac.core.errors import Note, counted, ranked
from sagnac.core.units import field_unit
from sagnac.noise.cross_spectra import SelfNoise
from sagnac.noise.laws import COEFFICIENT_NAMES, SYMBOLS, CoefficientName
from sagnac.recording.model import Recording
from sagnac.report import as_typed, error_text, note_text, quantities, sections, wrapped
from sagnac.stability.curve import StabilityCurve

# ---- text --------------------------------------------------------------------------


def answer(analysis: Analysis) -> str:
    """Each gyro asked for, the worst marked; what two make per gyro; what it rests on."""
    source = textwrap.fill(f"Rests on: {analysis.source}", 80, subsequent_indent="  ")
    return sections.rendered("answer.txt", analysis=analysis, source=source)


def beside_truth(analysis: Analysis, truth: float) -> str:
    """The answer against the ARW that was put in, `truth` in deg/sqrt(h)."""
    shown = analysis.angle_random_walk.in_field_unit()
    return sections.rendered("truth.txt", shown=shown, truth=truth)


def verdict(analysis: Analysis) -> str:
    """Each limit beside what was measured, and the decision on all; empty without a limit."""
    decided = verdict_of(analysis)
    if decided is None:
        return ""
    rows = [
        (sections.gyro_text(one), one.limit.in_words, sections.found_text(one), one.decision)
        for one in decided.judgements
    ]
    noticed = [one for one in decided.judgements if one.decision != "pass" or EITHER in one.reason]
    reasons = dict.fromkeys(f"{sections.gyro_text(one)}: {one.reason}" for one in noticed)
    product = f" for {decided.specification.product}" if decided.specification.product else ""
    line = f"Verdict{product}: {sections.DECISIONS[decided.decision]}"
    listed = table(("gyro", "limit", "measured", "verdict"), rows)
    return "\n".join((line, listed, *reasons, f"Risk: {sections.risk_text(decided)}"))


def with_lines(analysis: Analysis) -> str:
    """The answer with the lines left in."""
    sentence = quantities.sentence(analysis.angle_random_walk, plain=True)
    return f"With the lines below left in  {sentence}"


def coefficients(analysis: Analysis) -> str:
    """Q, N, B, K, R by each fit, in the field's units."""
    fits = [analysis.fits[name] for name in quantities.FIT_TITLES if name in analysis.fits]
    rows = [
        (*_titled(name), *(quantities.reading(fit.coefficients[name]) for fit in fits))
        for name in COEFFICIENT_NAMES
    ]
    header = ("coefficient", "unit", *(f"{fit.method} fit" for fit in fits))
    return table(header, rows) if fits else ""


def _titled(name: CoefficientName) -> tuple[str, str]:
    """A coefficient by its letter and title, and the unit of the field."""
    return f"{SYMBOLS[name]} {quantities.TITLES[name].lower()}", field_unit(name).symbol


def shares(analysis: Analysis) -> str:
    """Scale factor, axis, asymmetry and bias of each gyro on a turning table."""
    if not analysis.shares:
        return ""
    remarks = [textwrap.fill(remark, 80) for remark in sections.share_remarks(analysis)]
    return "\n".join((table(sections.HEADER, sections.share_rows(analysis)), *remarks))


def accelerometers(analysis: Analysis) -> str:
    """The coefficients of accelerometers, and what was noticed of them."""
    forces = list(analysis.accelerometers.values())
    if not forces:
        return ""
    names = [f"accelerometer {name}" for name in analysis.accelerometers]
    rows = [(title, unit, *readings) for title, unit, readings in sections.force_rows(forces)]
    shown = table(("coefficient", "unit", *names), rows)
    return blocks(shown, "\n".join(f"note: {note}" for note in sections.force_notes(forces)))


def refused(analysis: Analysis) -> str:
    """Why channels were not analyzed, a line each."""
    refusals = analysis.refused.items()
    return "\n".join(f"{name} was not analyzed: {error_text(why)}" for name, why in refusals)


def units(analysis: Analysis) -> str:
    """The coefficients of the answer's fit in every unit that they are written in."""
    rows: list[tuple[str, ...]] = []
    for name, estimate in headline_estimates(analysis).items():
        rows += [(_titled(name)[0], *cells) for cells in quantities.unit_cells(estimate)]
    return table(("coefficient", "value", "interval", "unit"), rows, right=(1,)) if rows else ""


def self_noise(found: SelfNoise, band: tuple[float, float]) -> str:
    """N of each of several gyros alone, and the gain with which it senses what all share."""
    rows = [
        (name, quantities.sentence(walk, plain=True), f"{gain:.5g}")
        for (name, walk), gain in zip(found.angle_random_walk.items(), found.gains, strict=True)
    ]
    title = f"Self-noise from the cross spectra of {len(rows)} gyros, {band[0]:g} to {band[1]:g} Hz"
    return f"{title}\n{table(('gyro', 'ARW of it alone', 'gain'), rows)}"


def curve(of: StabilityCurve) -> str:
    """A stability curve per gyro."""
    unit, columns = quantities.curve_unit(of.estimator), quantities.curve_columns(of).values()
    rows = [tuple(f"{value:.4g}" for value in row) for row in zip(*columns, strict=True)]
    header = ("τ s", f"{of.estimator} {unit.symbol}", "low", "high", "edf", "terms", "noise f^")
    return table(header, rows, right=range(len(columns)))


def density(analysis: Analysis) -> str:
    """The power spectral density per gyro, averaged into few bins; the table has them all."""
    if analysis.density is None or not analysis.density.frequency.size:
        return ""
    shown = quantities.coarser(quantities.shown_density(analysis), most=24)
    rows = [
        tuple(f"{value:.4g}" for value in (place, square, math.sqrt(square)))
        for place, square in zip(shown.frequency, shown.density, strict=True)
    ]
    return table(("f Hz", "PSD, one-sided (°/h)²/Hz", "its root °/h/√Hz"), rows, right=(0, 1, 2))


def lines(analysis: Analysis, most: int | None = 20) -> str:
    """Periodic components: the table's by order, then those in time, the strongest first.

    At most `most` of each, the strongest; None shows all.
    """
    of_table = [line for line in analysis.lines if line.scale == "angle"][:most]
    of_table.sort(key=lambda line: line.frequency)
    rows = []
    for line in of_table + [line for line in analysis.lines if line.scale == "time"][:most]:
        where = "table angle" if line.scale == "angle" else "time", quantities.line_position(line)
        figures = (*quantities.line_amplitude(line), f"{line.significance:.4g}")
        rows.append((*where, *figures, line.channel, line.name))
    header = ("periodic in", "position", "amplitude ″", "± ″", "significance", "channel")
    return _listed(analysis, table((*header, "known as"), rows, right=(2, 3, 4)), len(rows), "ones")


def _listed(analysis: Analysis, shown: str, rows: int, weaker: str = "") -> str:
    """A table of some lines of an analysis, and how many are not in it."""
    if not analysis.fits:
        # Between gaps too close together for any fit, none was looked for.
        return ""
    if not analysis.lines:
        return wrapped(f"No periodic component was found in {analysis.channel}.")
    more = len(analysis.lines) - rows
    if not more:
        return shown
    weaker_lines = f"{more} weaker {weaker}" if weaker else counted(more, "weaker line")
    return f"{shown}\n… and {weaker_lines}: sagnac lines shows all"


def methods_by_gyro(analyses: Mapping[str, Analysis]) -> dict[str, dict[str, Analysis]]:
    """Analyses by method of each gyro that was taken alone, or of what was measured."""
    by_gyro: dict[str, dict[str, Analysis]] = {}
    for method, analysis in analyses.items():
        for name, one in (analysis.gyros or {analysis.channel: analysis}).items():
            by_gyro.setdefault(name, {})[method] = one
    return by_gyro


def notes_by_method(analyses: Mapping[str, Analysis]) -> list[str]:
    """Notes of the recording, then what each method says besides."""
    noticed = [note_text(note) for note in next(iter(analyses.values())).recording.notes]
    read = set(noticed)
    for method, analysis in analyses.items():
        own = (text for text in map(note_text, analysis.notes) if text not in read)
        noticed += [f"{method}: {text}" for text in own]
    return noticed


def comparison(analyses: Mapping[str, Analysis], refused: Mapping[str, str]) -> str:
    """The methods side by side; why, of each that the recording does not allow."""
    one = next(iter(analyses.values()))
    rows = []
    for method, analysis in analyses.items():
        cells = quantities.reading_cells(analysis.angle_random_walk)
        counts = str(len(analysis.lines)), str(quantities.residual_peaks(analysis))
        rows.append((method, *cells, *counts, f"{sum(analysis.seconds.values()):.1f}"))
    header = ("method", "N °/√h", "interval", "status", "lines", "peaks left", "s")
    noticed = [f"note: {text}" for text in notes_by_method(analyses)]
    reasons = "\n".join(f"{method}: {why}" for method, why in refused.items())
    shown = table(header, rows, right=(1, 4, 5, 6))
    return blocks(quantities.subject(one), shown, reasons, "\n".join(noticed))


def findings(notes: Sequence[Note]) -> str:
    """Findings of a check of the data."""
    rows = [(one.level, one.channel, as_typed(one.text)) for one in notes]
    return table(("level", "channel", "finding"), rows) if rows else "Nothing was found wrong."


def recording(read: Recording) -> str:
    """The recording, in one line."""
    return sections.rendered("recording.txt", read=read)


def notes(noticed: Sequence[Note]) -> str:
    """One line each."""
    return "\n".join(f"note: {note_text(note)}" for note in noticed)


def seconds(analysis: Analysis) -> str:
    """Time by stage."""
    stages = ", ".join(f"{stage} {spent:.2f}" for stage, spent in analysis.seconds.items())
    line = f"seconds: {stages}; in all {sum(analysis.seconds.values()):.2f}"
    return textwrap.fill(line, 80, subsequent_indent="  ")


def table(head: Sequence[str], rows: Sequence[Sequence[str]], *, right: Sequence[int] = ()) -> str:
    """Aligned columns under a rule, as wide as they need and no wider.

    Parameters
    ----------
    head, rows
        Texts. A column that is empty in every row is left out.
    right
        Numbers of the columns that stand to the right.
    """
    padded, widths = [], []
    for place, column in enumerate(zip(head, *rows, strict=True)):
        if rows and not any(column[1:]):
            continue
        width = max(map(cell_len, column))
        gaps = [" " * (width - cell_len(text)) for text in column]
        pairs = zip(column, gaps, strict=True)
        padded.append([gap + text if place in right else text + gap for text, gap in pairs])
        widths.append(width)
    # Each column but the last has the space between it and the next under its rule.
    rule = " ".join("─" * (width + 1) for width in widths)[:-1]
    first, *others = ("  ".join(row).rstrip() for row in zip(*padded, strict=True))
    return "\n".join((first, rule, *others))


def blocks(*parts: str) -> str:
    """The parts that are not empty, with an empty line between."""
    return "\n\n".join(part for part in parts if part)


# ---- brief -------------------------------------------------------------------------


def main_coefficients(analysis: Analysis) -> str:
    """Q, N, B, K and R beside the answer, in the field's units; empty if there are none."""
    coefficients, rows = headline_coefficients(analysis), []
    for name in COEFFICIENT_NAMES:
        if name in coefficients:
            title, unit = _titled(name)
            value, interval, status = quantities.reading_cells(coefficients[name])
            rows.append((title, value, interval, unit, status))
    return table(("coefficient", "value", "interval", "unit", "status"), rows) if rows else ""


def strongest_lines(analysis: Analysis) -> str:
    """How many periodic components there are, and the strongest five."""
    rows = []
    for line in analysis.lines[:5]:
        position, amplitude = quantities.line_position(line), quantities.line_amplitude(line)
        known_as = line.name if len(line.name) <= 32 else f"{line.name[:31]}…"
        rows.append((position, *amplitude, line.channel, known_as))
    header = ("periodic", "amplitude ″", "± ″", "channel", "known as")
    return _listed(analysis, table(header, rows, right=(1, 2)), len(rows))


def short_notes(analysis: Analysis, others: Sequence[Analysis] = ()) -> str:
    """Every warning on the answer, and four remarks on it at most.

    Notes on the curve and on fits that a screen does not show are only counted.

    Parameters
    ----------
    analysis
        Whose notes.
    others
        Analyses whose curves and fits it has notes on, besides its own.
    """
    placed = sections.placed_notes(analysis, others)
    ordered = (*placed["answer"], *placed["reading"])
    urgent = [note for note in ordered if note.level != "remark"]
    shown = (*urgent, *ordered[len(urgent) :][:4])
    texts = [_levelled(note) for note in shown]
    more = len(set(analysis.notes)) - len(shown)
    if more:
        texts.append(f"… and {counted(more, 'further note')}: --curve or the report shows all")
    return "\n".join(texts)


def every_note(noticed: Sequence[Note]) -> str:
    """Errors, warnings and remarks, in that order."""
    return "\n".join(_levelled(note) for note in ranked(noticed))


def _levelled(note: Note) -> str:
    return wrapped(f"{note.level}: {note_text(note)}")


def closing(named: Sequence[tuple[str, Analysis]], refused: Collection[str] = ()) -> str:
    """One row for each gyro of several analyses, or of several gyros; empty for one alone.

    The decision on all of them and what was warned of stand below, since the table is what one
    looks at last.

    Parameters
    ----------
    named
        Name of the file, empty if all are of one, and its analysis.
    refused
        Files that have none.
    """
    if len(named) < 2 and not any(analysis.gyros for _, analysis in named):
        return ""
    rows = [row for file, analysis in named for row in _closing_rows(file, analysis)]
    unit = field_unit("angle_random_walk").symbol
    listed = table(("file", "gyro", f"N {unit}", "interval", "status", "verdict"), rows)
    warned = [line for file, analysis in named for line in _warned_of(file, analysis)]
    decision = sections.overall_decision((analysis for _, analysis in named), refused)
    lines = [f"Verdict of all: {sections.DECISIONS[decision]}"] if decision else []
    return "\n".join((listed, *lines, *warned))


def _warned_of(file: str, analysis: Analysis) -> list[str]:
    """Each finding that is more than a remark, and the channels that it is of: a line each."""
    channels: dict[str, list[str]] = {}
    for one in (analysis, *analysis.each):
        for note in ranked(one.findings):
            known = channels.setdefault(note.name, [])
            if note.level != "remark" and note.channel not in known:
                known.append(note.channel)
    of_file = f"{file}: " if file else ""
    listed = ((name, ", ".join(found)) for name, found in channels.items() if found)
    return [wrapped(f"warned of above: {of_file}{name} ({found})") for name, found in listed]


def _closing_rows(file: str, analysis: Analysis) -> list[tuple[str, ...]]:
    verdict = verdict_of(analysis)
    decisions = {} if verdict is None else dict(verdict.by_gyro)
    estimates = dict(analysis.per_gyro) or {analysis.channel: analysis.angle_random_walk}
    named = quantities.ending(file, 24)
    overall = verdict.decision if verdict else ""
    rows: list[tuple[str, ...]] = [
        (named, name, *quantities.reading_cells(estimate), decisions.get(name, overall))
        for name, estimate in estimates.items()
    ]
    lacking = [name for name in analysis.settings.gyros if name in analysis.refused]
    cells = ("–", "", "not analyzed")
    return rows + [(named, name, *cells, decisions.get(name, "")) for name in lacking]


def brief(analysis: Analysis, others: Sequence[Analysis] = ()) -> tuple[str, ...]:
    """Part of a screen below the answer and the verdict."""
    return main_coefficients(analysis), strongest_lines(analysis), short_notes(analysis, others)


def full(analysis: Analysis) -> tuple[str, ...]:
    """The same with curves, spectrum, every fit, every unit and every note."""
    curves = map(curve, analysis.family or (analysis.curve,))
    fits = coefficients(analysis), units(analysis), shares(analysis)
    return (*curves, density(analysis), *fits, lines(analysis), every_note(analysis.notes))
