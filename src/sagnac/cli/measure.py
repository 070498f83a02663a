"""``sagnac analyze``, ``avar``, ``compare`` and ``lines``: recordings in, answers out."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

from cyclopts import Parameter

import sagnac
from sagnac.cli import options as typed
from sagnac.cli import output as results
from sagnac.cli.options import NO_OPTIONS, NO_REPORT, File, Folder, Force, Options, ReportOptions
from sagnac.report import as_typed, error_text

if TYPE_CHECKING:
    from sagnac import Analysis, Recording, SelfNoise, Settings
    from sagnac.analysis.pipeline import AtRest
    from sagnac.analysis.settings import Method


_Sheet = dict[str, Any]
_Band = tuple[float, float]

# ---- analyze -----------------------------------------------------------------------


def analyze(
    files: typed.Files, /, *, options: Options = NO_OPTIONS, report: ReportOptions = NO_REPORT
) -> int:
    """A recording in; report.html, analysis.json, tables and figures out.

    They go into DIR (several files: a folder each in it), by default NAME-report; with
    --json and no DIR nothing is written.
    """
    settings = typed.settings_of(options)
    folders = results.folders_of(files, report.output, as_json=options.as_json)
    sheet = _sheet(options, report, written=None not in folders)
    for folder in folders:
        reads = typed.inputs(files, options, report.heading)
        results.require_place(folder, "report", reads, force=report.force)
    several, status = len(files) > 1, results.DONE
    named: list[tuple[str, Analysis]] = []
    refused: dict[str, str] = {}
    for file, folder in zip(files, folders, strict=True):
        try:
            with typed.reading(file, options, prefix=file.name * several) as read:
                analysis = read.analyzed(settings)
            paths: Sequence[Path] = ()
            if folder is not None:
                analysis, paths = results.reported(analysis, folder, **sheet)
        except Exception as error:
            if not several or options.debug:
                raise
            status = max(status, results.explain(error))
            refused[str(file)] = as_typed(str(error))
            continue
        named.append((file.name, analysis))
        if not options.as_json:
            if several:
                print(file, end="\n\n")
            _print_analysis(analysis, paths, curve=report.curve)
            print("\n\n" * several, end="")
    done = [analysis for _, analysis in named]
    if several and not options.as_json:
        from sagnac.report import text

        results.show(text.closing(named, refused), end="\n")
    if options.as_json and done:
        from sagnac.report.document import many_document, to_json

        print(to_json(many_document(done, refused=refused)) if several else done[0].to_json())
    return status or results.verdict_status(done)


def _sheet(options: Options, report: ReportOptions, *, written: bool) -> _Sheet:
    """Keywords of `sagnac.write_report` that hold for every report of a run.

    Raises
    ------
    UsageError
        If something is stated of a report and none is written.
    """
    if report.stated and not written:
        raise results.UsageError(f"--{report.stated[0]} is of a report; name its folder with -o")
    block, settings = report.title_block, options.as_toml
    return {"block": block, "settings": settings, "pdf": report.pdf, "force": report.force}


def _print_analysis(analysis: "Analysis", paths: Sequence[Path], *, curve: bool) -> None:
    from sagnac.report import text

    for gyro in analysis.each:
        shown = text.full(gyro) if curve else text.brief(gyro)
        print(text.blocks(text.answer(gyro), text.verdict(gyro), *shown), end="\n\n")
    results.show(text.accelerometers(analysis), text.refused(analysis))
    results.print_paths(paths)
    if analysis.gyros:
        results.show(text.closing([("", analysis)]))
    print(text.seconds(analysis))


# ---- avar --------------------------------------------------------------------------


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class BenchOptions:
    """Choices of the still bench.

    Attributes
    ----------
    estimator
        Curves: oadev (unless stated), adev, mdev, tdev, hdev, ohdev, totdev, mtotdev, theo1,
        theoh, haar; several with commas between, or given again.
    gaps
        Missing samples (NaN, jumps of the time stamps): an error that says where, or terms that
        touch one are left out, counted and noted.
    self_noise
        Also the noise of each of three or more parallel gyros without what all of them turn, from
        their cross spectra; N of each over this band, Hz.
    """

    estimator: typed.SeveralNames = None
    gaps: Annotated[Literal["reject", "omit"], Parameter(group=typed.ANALYSIS)] = "reject"
    self_noise: Annotated[_Band | None, typed.of_analysis(typed.band, "LOW:HIGH")] = None


NO_BENCH: Final = BenchOptions()
# Folder of their report, beside those of the gyros.
_ACCELEROMETERS: Final = "accelerometers"


def avar(
    file: File,
    /,
    *,
    options: Options = NO_OPTIONS,
    bench: BenchOptions = NO_BENCH,
    report: ReportOptions = NO_REPORT,
) -> int:
    """The still bench: the ARW of each gyro, its curves, and the lines in it.

    The answer is with the lines out; curves and fits are of the recording as it is unless
    --method says what to remove; with --method none the answer is of the recording as it is, too.
    With -o, each gyro's report goes into a folder of its own beside a page of all of them, and the
    accelerometers' into another.
    """
    from sagnac.analysis.pipeline import still_bench
    from sagnac.report import text

    settings = typed.settings_of(options, method="none", estimators=bench.estimator or ("oadev",))
    output = report.output
    sheet = _sheet(options, report, written=output is not None)
    alone: SelfNoise | None = None
    paths: Sequence[Path] = ()
    with typed.reading(file, options, verify=bench.gaps == "reject") as read:
        recording = read.recording
        if output is not None:
            reads = typed.inputs([file], options, report.heading)
            for folder, what in _places(recording, settings, output):
                results.require_place(folder, what, reads, force=report.force)
        if bench.gaps == "omit":
            from sagnac.quality.samples import with_gaps_marked

            recording = with_gaps_marked(recording)
        if bench.self_noise is not None:
            alone = _alone(recording, settings, bench.self_noise)
        lines_in = options.method == "none"
        analysis, benches = still_bench(
            recording, settings, progress=read.progress, lines_in=lines_in, gaps=bench.gaps
        )
        analysis = analysis.with_seconds(read.seconds)
    if output is not None:
        analysis, paths = _bench_reported(analysis, alone, output, sheet)
    if options.as_json:
        from sagnac.report import document

        made = document.analysis_document(analysis)
        if analysis.gyros:
            made = document.many_document(analysis.each, analysis)
        beside = {} if alone is None else document.self_noise_data(alone)
        print(document.to_json(made | beside))
        return results.verdict_status([analysis])
    curve = report.curve or bench.estimator is not None
    for gyro in analysis.each:
        _print_bench(benches[gyro.channel], gyro, curve=curve)
    if alone is not None and bench.self_noise is not None:
        print(text.self_noise(alone, bench.self_noise), end="\n\n")
    results.show(text.accelerometers(analysis), text.refused(analysis))
    results.print_paths(paths)
    results.show(text.closing([("", analysis)]), end="\n")
    return results.verdict_status([analysis])


def _places(recording: "Recording", settings: "Settings", into: Path) -> Iterator[tuple[Path, str]]:
    """Folders to be written and what goes into them: a gyro's, all gyros', the accelerometers'."""
    from sagnac.report.tables import folder_name

    names = settings.gyros or tuple(gyro.name for gyro in recording.gyros)
    yield from ((into / folder_name(name), "report") for name in names)
    if len(names) > 1:
        yield into, "report"
    if recording.accelerometers:
        yield into / _ACCELEROMETERS, "accelerometers"


def _alone(recording: "Recording", settings: "Settings", band: _Band) -> "SelfNoise":
    """The noise of each gyro without what all of them turn.

    Raises
    ------
    UsageError
        If there are too few gyros.
    """
    gyros = settings.gyros_of(recording)
    try:
        return sagnac.self_noise(recording, gyros=gyros, band=band, confidence=settings.confidence)
    except ValueError as error:
        raise results.UsageError(f"--self-noise: {error}") from None


def _bench_reported(
    analysis: "Analysis", alone: "SelfNoise | None", output: Path, sheet: _Sheet
) -> "tuple[Analysis, list[Path]]":
    """The analysis with the time of its report, and every file written.

    One gyro's report goes into a folder of its own, too.
    """
    from sagnac.report.figures import self_noise_figure, write_png
    from sagnac.report.page import write_accelerometers
    from sagnac.report.tables import folder_name

    place = output if analysis.gyros else output / folder_name(analysis.channel)
    reported, written = results.reported(analysis, place, **sheet, with_forces=False)
    paths = list(written)
    if analysis.accelerometers:
        paths += write_accelerometers(analysis, output / _ACCELEROMETERS, pdf=sheet["pdf"])
    if alone is not None:
        paths.append(output / "self_noise.png")
        write_png(self_noise_figure(alone), paths[-1])
    return reported, paths


def _print_bench(bench: "AtRest", analysis: "Analysis", *, curve: bool) -> None:
    """One gyro."""
    from sagnac.report import text

    print(text.answer(analysis))
    if bench.as_it_is is not bench.without_lines and analysis.lines:
        print(text.with_lines(bench.as_it_is))
    others = (bench.without_lines, bench.as_it_is)
    shown = text.full(analysis) if curve else text.brief(analysis, others)
    print(f"\n{text.blocks(text.verdict(analysis), *shown, text.seconds(analysis))}", end="\n\n")


# ---- compare -----------------------------------------------------------------------

METHODS: "Final[tuple[Method, ...]]" = ("none", "fris", "fos-korenberg", "fos-paper", "fos")


def compare(
    file: File, /, *, options: Options = NO_OPTIONS, output: Folder = None, force: Force = False
) -> int:
    """No removal, fris, fos-korenberg, fos-paper and fos, side by side; with -o also as a page.

    --method picks one to run alone, --gyros one of several gyros at rest, each of which is shown.
    """
    settings = typed.settings_of(options)
    results.require_place(output, "comparison", typed.inputs([file], options), force=force)
    with typed.reading(file, options) as read:
        methods = (settings.method,) if options.method else METHODS
        analyses, refused = _compared(read, settings, methods)
    written = []
    if output is not None:
        from sagnac.report.page import write_comparison

        written = write_comparison(analyses, refused, output)
    from sagnac.report import text
    from sagnac.report.document import comparison_document, to_json

    if options.as_json:
        print(to_json(comparison_document(analyses, refused)))
    else:
        for each in text.methods_by_gyro(analyses).values():
            print(f"{file}: {text.comparison(each, refused)}")
        results.print_paths(written)
    # A verdict rests on fos, or the last if that is not among them.
    return results.verdict_status([analyses.get("fos") or list(analyses.values())[-1]])


def _compared(
    read: typed.ReadFile, settings: "Settings", methods: "Sequence[Method]"
) -> "tuple[dict[str, Analysis], dict[str, str]]":
    """The analysis by each method; and why, of each method that the recording does not allow.

    A refusal is an error only if no method gives anything.
    """
    analyses: dict[str, Analysis] = {}
    errors: dict[str, sagnac.RecordingError] = {}
    for method in methods:
        progress = results.prefixed(read.progress, method)
        try:
            analyses[method] = read.analyzed(replace(settings, method=method), progress)
        except sagnac.RecordingError as error:
            errors[method] = error
    if not analyses:
        raise next(iter(errors.values()))
    return analyses, {method: error_text(error) for method, error in errors.items()}


# ---- lines -------------------------------------------------------------------------


def lines(file: File, /, *, options: Options = NO_OPTIONS) -> int:
    """The periodic components found, strongest first."""
    settings = typed.settings_of(options)
    with typed.reading(file, options) as read:
        analysis = read.analyzed(settings)
    if options.as_json:
        print(analysis.to_json())
    else:
        from sagnac.report import text

        listed = [text.lines(one, most=None) for one in analysis.each]
        below = text.refused(analysis), text.notes(analysis.notes)
        print(text.blocks(text.verdict(analysis), *listed, *below))
    return results.verdict_status([analysis])


COMMANDS: Final = (analyze, avar, compare, lines)
