"""``sagnac analyze``, ``avar``, ``compare`` and ``lines``: recordings in, answers out."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

from cyclopts import Parameter

import sagnac
from sagnac.cli import output as results
from sagnac.cli.options import (
    ANALYSIS,
    NO_HEADING,
    NO_OPTIONS,
    Curve,
    Estimators,
    File,
    Files,
    Folder,
    Force,
    Heading,
    Options,
    band,
    estimators_of,
    inputs,
    one_argument,
    settings_of,
    settings_text,
    statement_of,
    title_block_of,
    with_settings,
)
from sagnac.core import overwriting

if TYPE_CHECKING:
    from sagnac.analysis.pipeline import AtRest
    from sagnac.analysis.settings import Method


# ---- analyze -----------------------------------------------------------------------


def analyze(
    files: Files,
    /,
    *,
    options: Options = NO_OPTIONS,
    heading: Heading = NO_HEADING,
    curve: Curve = False,
    output: Folder = None,
    force: Force = False,
) -> int:
    """A recording in; report.html, analysis.json, tables and figures out.

    They go into DIR (several files: a folder each in it), by default NAME-report; with
    --json and no DIR nothing is written.
    """
    options = with_settings(options)
    stated = _stated(options, heading, force=force)
    statement, settings = statement_of(options), settings_of(options)
    folders = results.folders_of(files, output, as_json=options.as_json)
    reads = inputs(files, options, heading.heading)
    for folder in folders:
        results.require_writable(folder)
        if folder is not None:
            overwriting.require_free(overwriting.outputs_in(folder, "report"), reads, force=force)
    several = len(files) > 1
    done: list[sagnac.Analysis] = []
    named: list[tuple[str, sagnac.Analysis]] = []
    failed = results.DONE
    for file, folder in zip(files, folders, strict=True):
        try:
            analysis = _analyzed(file, statement, settings, options.memory, of=file.name * several)
            one = _reported(analysis, folder, stated)
        except Exception as error:
            if not several or options.debug:
                raise
            failed = max(failed, results.explain(error))
            continue
        done.append(one.analysis)
        named.append((file.name, one.analysis))
        if not options.as_json:
            if several:
                print(file, end="\n\n")
            _print_analysis(one, curve=curve, end="\n\n\n" if several else "\n")
    if several and not options.as_json:
        results.print_closing(named)
    if options.as_json and done:
        results.print_documents(done, single=not several)
    return failed or results.verdict_status(done)


def _stated(options: Options, heading: Heading, *, force: bool) -> dict[str, Any]:
    """Keywords of `sagnac.write_report` that hold for every report of a run."""
    return {
        "block": title_block_of(heading), "settings": settings_text(options), "pdf": heading.pdf,
        "force": force,
    }  # fmt: skip


def _analyzed(
    file: Path,
    statement: "sagnac.Statement",
    settings: "sagnac.Settings",
    memory: int | None,
    *,
    of: str = "",
) -> "sagnac.Analysis":
    """One file; `of` goes before the stages of its progress."""
    with results.progress_shown(of) as progress:
        read = results.read_file(file, statement, progress, memory=memory)
        with results.naming(file, read.recording):
            analysis = sagnac.analyze(read.recording, settings, progress=progress)
    return analysis.with_seconds(read.seconds)


def _reported(
    analysis: "sagnac.Analysis", folder: Path | None, stated: Mapping[str, Any]
) -> "sagnac.Report":
    """The analysis with its report in `folder`, unless that is None."""
    # Before the first name of the report, which loads what draws.
    results.ready_to_draw()
    if folder is None:
        return sagnac.Report(analysis=analysis, paths=())
    with results.progress_shown() as progress:
        progress("report", 0.0)
        return sagnac.write_report(analysis, folder, **stated)


def _print_analysis(one: "sagnac.Report", *, curve: bool, end: str) -> None:
    from sagnac.report import text

    analysis = one.analysis
    for gyro in analysis.each:
        shown = text.full(gyro) if curve else text.brief(gyro)
        print(text.blocks(text.answer(gyro), text.verdict(gyro), *shown), end="\n\n")
    results.print_beside(analysis)
    results.print_paths(one.paths)
    if analysis.gyros:
        results.print_closing([("", analysis)], end="\n\n")
    print(text.seconds(analysis), end=end)


# ---- avar --------------------------------------------------------------------------

# Folder of their report, beside those of the gyros.
_ACCELEROMETERS: Final = "accelerometers"


def avar(
    file: File,
    /,
    *,
    options: Options = NO_OPTIONS,
    estimator: Estimators = None,
    gaps: Annotated[
        Literal["reject", "omit"],
        Parameter(
            group=ANALYSIS,
            help="Missing samples (NaN, jumps of the time stamps): an error that says where, or "
            "terms that touch one are left out, counted and noted.",
        ),
    ] = "reject",
    self_noise: Annotated[
        tuple[float, float] | None,
        one_argument(
            band,
            group=ANALYSIS,
            metavar="LOW:HIGH",
            help="Also the noise of each of three or more parallel gyros without what all of them "
            "turn, from their cross spectra; N of each over this band, Hz.",
        ),
    ] = None,
    heading: Heading = NO_HEADING,
    curve: Curve = False,
    output: Folder = None,
    force: Force = False,
) -> int:
    """The still bench: the ARW of each gyro, its curves, and the lines in it.

    The answer is with the lines out; curves and fits are of the recording as it is unless
    --method says what to remove; with --method none the answer is of the recording as it is, too.
    With -o, each gyro's report goes into a folder of its own beside a page of all of them, and the
    accelerometers' into another.
    """
    options = with_settings(options)
    stated = _stated(options, heading, force=force)
    statement = statement_of(options)
    settings = settings_of(options, method="none", estimators=estimators_of(estimator))
    results.require_writable(output)
    alone: sagnac.SelfNoise | None = None
    paths: list[Path] = []
    with results.progress_shown() as progress:
        read = results.read_file(
            file, statement, progress, memory=options.memory, verify=gaps == "reject"
        )
        if output is not None:
            reads = inputs([file], options, heading.heading)
            for one in _outputs(read, settings, output):
                overwriting.require_free(one, reads, force=force)
        with results.naming(file, read.recording):
            if gaps == "omit":
                from sagnac.quality.samples import with_gaps_marked

                read = replace(read, recording=with_gaps_marked(read.recording))
            if self_noise is not None:
                alone = _alone(read.recording, settings, self_noise)
            analysis, benches = _benches(read, settings, progress, options.method == "none")
        if output is not None:
            analysis, paths = _bench_reported(analysis, alone, output, progress, stated)
    if options.as_json:
        from sagnac.report.document import self_noise_data

        results.print_documents(
            analysis.each,
            single=not analysis.gyros,
            unit=analysis,
            beside={} if alone is None else self_noise_data(alone),
        )
        return results.verdict_status([analysis])
    for name, bench in benches.items():
        _print_bench(bench, analysis.gyros.get(name, analysis), curve or estimator is not None)
    if alone is not None and self_noise is not None:
        from sagnac.report import text

        print(text.self_noise(alone, self_noise), end="\n\n")
    results.print_beside(analysis)
    results.print_paths(paths)
    results.print_closing([("", analysis)])
    return results.verdict_status([analysis])


def _benches(
    read: results.ReadFile, settings: "sagnac.Settings", progress: results.Progress, lines_in: bool
) -> "tuple[sagnac.Analysis, dict[str, AtRest]]":
    """All gyros with the accelerometers, and each gyro with its lines in and out.

    With `lines_in` the answer is of the recording as it is, since that was asked for.
    """
    from sagnac.analysis.pipeline import accelerometers_of, at_rest, gyros_alone

    benches: dict[str, AtRest] = {}

    def run(recording: "sagnac.Recording", chosen: "sagnac.Settings", /, **how: Any) -> Any:
        bench = at_rest(recording, chosen, lines_in=lines_in, **how)
        (name,) = chosen.gyros
        benches[name] = bench
        return bench.analysis.with_seconds(read.seconds)

    def run_force(recording: "sagnac.Recording", chosen: "sagnac.Settings", /, **how: Any) -> Any:
        return at_rest(recording, chosen, **how).analysis

    still = replace(read.recording, table=None, null_pulse=None)
    names = settings.gyros_of(still)
    settings = replace(settings, gyros=names)
    if len(names) == 1:
        analysis = run(still, settings, progress=results.prefixed(progress, names[0]))
    else:
        analysis = gyros_alone(still, settings, run, progress)
    forces = accelerometers_of(still, settings, run=run_force, progress=progress)
    return analysis.with_accelerometers(forces), benches


def _alone(
    recording: "sagnac.Recording", settings: "sagnac.Settings", band: tuple[float, float]
) -> "sagnac.SelfNoise":
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


def _outputs(
    read: results.ReadFile, settings: "sagnac.Settings", output: Path
) -> list[overwriting.Outputs]:
    """Places to be written: a folder for each gyro beside the page of all, and the forces'."""
    names = settings.gyros or tuple(gyro.name for gyro in read.recording.gyros)
    from sagnac.report.sections import folder_name

    made = [overwriting.outputs_in(output / folder_name(name), "report") for name in names]
    if len(names) > 1:
        made.append(overwriting.outputs_in(output, "report"))
    if read.recording.accelerometers:
        made.append(overwriting.outputs_in(output / _ACCELEROMETERS, "accelerometers"))
    return made


def _bench_reported(
    analysis: "sagnac.Analysis",
    alone: "sagnac.SelfNoise | None",
    output: Path,
    progress: results.Progress,
    stated: Mapping[str, Any],
) -> "tuple[sagnac.Analysis, list[Path]]":
    """The analysis with the time of its report, and every file written.

    One gyro's report goes into a folder of its own, too.
    """
    results.ready_to_draw()
    from sagnac.report.figures import self_noise_figure, write_png
    from sagnac.report.folder import write_accelerometers
    from sagnac.report.sections import folder_name

    place = output if analysis.gyros else output / folder_name(analysis.channel)
    progress("report", 0.0)
    report = sagnac.write_report(analysis, place, with_forces=False, **stated)
    paths = list(report.paths)
    if analysis.accelerometers:
        progress("accelerometers: report", 0.0)
        paths += write_accelerometers(analysis, output / _ACCELEROMETERS, pdf=stated["pdf"])
    if alone is not None:
        paths.append(output / "self_noise.png")
        write_png(self_noise_figure(alone), paths[-1])
    return report.analysis, paths


def _print_bench(bench: "AtRest", analysis: "sagnac.Analysis", curve: bool) -> None:
    """One gyro."""
    from sagnac.report import text

    print(text.answer(analysis))
    if bench.as_it_is is not bench.without_lines and analysis.lines:
        print(text.with_lines(bench.as_it_is))
    print()
    print(
        text.blocks(
            text.verdict(analysis),
            *(
                text.full(analysis)
                if curve
                else text.brief(analysis, (bench.without_lines, bench.as_it_is))
            ),
            text.seconds(analysis),
        ),
        end="\n\n",
    )


# ---- compare -----------------------------------------------------------------------

METHODS: "Final[tuple[Method, ...]]" = ("none", "fris", "fos-korenberg", "fos-paper", "fos")


def compare(
    file: File,
    /,
    *,
    options: Options = NO_OPTIONS,
    output: Folder = None,
    force: Force = False,
) -> int:
    """No removal, fris, fos-korenberg, fos-paper and fos, side by side; with -o also as a page.

    --method picks one to run alone, --gyros one of several gyros at rest, each of which is shown.
    """
    options = with_settings(options)
    statement = statement_of(options)
    settings = settings_of(options)
    results.require_writable(output)
    if output is not None:
        reads = inputs([file], options)
        overwriting.require_free(overwriting.outputs_in(output, "comparison"), reads, force=force)
    methods = (options.method,) if options.method else METHODS
    with results.progress_shown() as progress:
        read = results.read_file(file, statement, progress, memory=options.memory)
        with results.naming(file, read.recording):
            analyses, refused = _compared(read, settings, methods, progress)
        written = []
        if output is not None:
            progress("report", 0.0)
            results.ready_to_draw()
            from sagnac.report.folder import write_comparison

            written = write_comparison(analyses, refused, output)
    from sagnac.report import text
    from sagnac.report.document import comparison_document, to_json

    # A verdict rests on fos, or the last if that is not among them.
    status = results.verdict_status([analyses.get("fos") or list(analyses.values())[-1]])
    if options.as_json:
        print(to_json(comparison_document(analyses, refused)))
        return status
    for each in text.methods_by_gyro(analyses).values():
        print(f"{file}: {text.comparison(each, refused)}")
    results.print_paths(written)
    return status


def _compared(
    read: results.ReadFile,
    settings: "sagnac.Settings",
    methods: "Sequence[Method]",
    progress: results.Progress,
) -> "tuple[dict[str, sagnac.Analysis], dict[str, str]]":
    """The analysis by each method; and why, of each method that the recording does not allow.

    A refusal is an error only if no method gives anything.
    """
    from sagnac.report import error_text

    analyses: dict[str, sagnac.Analysis] = {}
    errors: dict[str, sagnac.RecordingError] = {}
    for method in methods:
        named, chosen = results.prefixed(progress, method), replace(settings, method=method)
        try:
            analysis = sagnac.analyze(read.recording, chosen, progress=named)
            analyses[method] = analysis.with_seconds(read.seconds)
        except sagnac.RecordingError as error:
            errors[method] = error
    if not analyses:
        raise next(iter(errors.values()))
    return analyses, {method: error_text(error) for method, error in errors.items()}


# ---- lines -------------------------------------------------------------------------


def lines(file: File, /, *, options: Options = NO_OPTIONS) -> int:
    """The periodic components found, strongest first."""
    options = with_settings(options)
    statement, settings = statement_of(options), settings_of(options)
    analysis = _analyzed(file, statement, settings, options.memory)
    if options.as_json:
        results.print_documents([analysis], single=True)
        return results.verdict_status([analysis])
    from sagnac.report import text

    shown = [text.lines(one, most=None) for one in analysis.each]
    print(
        text.blocks(
            text.verdict(analysis), *shown, text.refused(analysis), text.notes(analysis.notes)
        )
    )
    return results.verdict_status([analysis])
